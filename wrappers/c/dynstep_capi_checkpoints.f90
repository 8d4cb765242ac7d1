! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: runs that are left and taken up again by another program.  `dynstep.h` describes each function.
module dynstep_capi_checkpoints
   use, intrinsic :: iso_c_binding, only: c_associated, c_int, c_intptr_t, c_ptr
   use dynstep_c_assembly, only: assemble
   use dynstep_c_handle, only: integrator_type, reach
   use dynstep_c_text, only: get_text, length_of_text
   use dynstep_kinds, only: wp
   use dynstep_restored_run, only: restore_run
   use dynstep_run, only: run_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_more, dynstep_success, status_type
   use dynstep_stepper, only: clock_type
   implicit none
   private

   public :: dynstep_checkpoint, dynstep_restore

   !> Longer ones are cut off
   integer, parameter :: longest_path = 4096

contains

   recursive function dynstep_checkpoint(handle, path) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      type(c_ptr), value :: path
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      character(len=:), allocatable :: name

      code = reach(handle, s)
      if (code /= dynstep_success) return
      call take_path(path, name, s%status)
      if (s%status%failed()) then
         continue
      else if (.not. s%running) then
         call s%status%set(dynstep_invalid_input, 'there is no run: call dynstep_begin and dynstep_proceed first')
      else if (s%points%holds_back()) then
         call s%status%set(dynstep_invalid_input, 'recorded points wait for room, and they would be lost: call dynstep_proceed ' &
            & //'before')
      else
         call s%run%checkpoint(name, s%stepper, s%sys, s%state, s%status)
      end if
      code = s%status%code
   end function dynstep_checkpoint

   recursive function dynstep_restore(handle, path) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      type(c_ptr), value :: path
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      character(len=:), allocatable :: name
      class(run_type), allocatable :: run

      code = reach(handle, s)
      if (code /= dynstep_success) return
      call take_path(path, name, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      s%started = .false.
      s%running = .false.
      call assemble(s)
      if (.not. s%status%failed()) then
         s%busy = .true.
         s%is_tuned = .true.
         call restore_run(name, run, s%stepper, s%sys, s%state, s%status)
         s%busy = .false.
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      s%started = .true.
      s%running = .true.
      s%step_clock = clock_type(t0=s%state%t, h=0.0_wp, k=0)
      s%restored_steps = s%stepper%count%steps
      s%wants_nodes = run%keeps_nodes
      s%recording = 0
      call s%points%clear(run%recorded_points())
      s%held%code = dynstep_more
      call move_alloc(run, s%run)
   end function dynstep_restore

   recursive subroutine take_path(path, name, status)
      type(c_ptr), intent(in) :: path
      character(len=:), allocatable, intent(out) :: name
      type(status_type), intent(inout) :: status
      if (.not. c_associated(path)) then
         call status%set(dynstep_invalid_input, 'path is NULL')
         return
      end if
      allocate (character(len=length_of_text(path, longest_path)) :: name)
      call get_text(path, name)
      if (len(name) == 0) call status%set(dynstep_invalid_input, 'path is empty')
   end subroutine take_path
end module dynstep_capi_checkpoints
