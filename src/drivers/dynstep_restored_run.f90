! SPDX-License-Identifier: BSD-3-Clause
!> A run from a checkpoint, whichever kind it is of.
!>
!> PROGRAMMING INTERFACE
!>
!>     class(run_type), allocatable :: run
!>     call stepper%init(sys, status)                               the options of the method that wrote
!>     call restore_run(path, run, stepper, sys, state, status)
!>     call run%proceed(stepper, sys, state, status, ...)           goes on with the same bits
module dynstep_restored_run
   use dynstep_archive_lines, only: archive_lines
   use dynstep_controlled_run, only: controlled_run_type, steps_by_error
   use dynstep_integrate, only: integration_type, steps_of_one_length
   use dynstep_ode_system, only: ode_system
   use dynstep_run, only: run_type
   use dynstep_status, only: status_type
   use dynstep_stepper, only: state_type, stepper_type
   implicit none
   private

   public :: restore_run

contains

   !> `run` is of the kind that the file's section names tell; not allocated where there is none, or the file is not whole
   recursive subroutine restore_run(path, run, stepper, sys, state, status)
      character(len=*), intent(in) :: path
      class(run_type), allocatable, intent(out) :: run
      class(stepper_type), intent(inout) :: stepper       !! `init` was called with `sys`
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      type(archive_lines) :: lines
      type(controlled_run_type), allocatable :: controlled
      type(integration_type), allocatable :: even
      logical :: ends

      if (status%failed()) return
      call lines%open(path)
      ends = .false.
      do while (.not. (ends .or. lines%is_done() .or. allocated(controlled) .or. allocated(even)))
         call lines%get(ends)
         if (lines%buffer == 'begin '//steps_by_error) then
            allocate (controlled)
         else if (lines%buffer == 'begin '//steps_of_one_length) then
            allocate (even)
         end if
      end do
      if (.not. (allocated(controlled) .or. allocated(even))) call lines%refuse('has no run: write it by its `checkpoint`')
      call lines%leave()
      if (lines%status%failed()) then
         status = lines%status
         return
      end if
      if (allocated(controlled)) call move_alloc(controlled, run)
      if (allocated(even)) call move_alloc(even, run)
      call run%restore(path, stepper, sys, state, status)
   end subroutine restore_run
end module dynstep_restored_run
