! SPDX-License-Identifier: BSD-3-Clause
!> A force that itself integrates a system of the same type, by the same method, two levels deep;
!> steppers copied in the middle of a run.
module test_nesting
   use dynstep
   use run_cases, only: equal, new_state
   use run_cases, only: takes_forces
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_nesting

   !> q'' = -q; where depth > 0 the force first integrates such a system of depth - 1 over a second,
   !> and adds what its displacement differs from cos 1, which is next to nothing
   type, extends(mechanical_system) :: nested_system
      integer :: depth = 0
      integer :: method = 1
      logical :: failed = .false.
   contains
      procedure :: force => nested_force
   end type nested_system

contains

   subroutine collect_nesting(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('nested', test_nested), &
         & new_unittest('checkpoint', test_checkpoint)]
   end subroutine collect_nesting

   recursive subroutine nested_force(self, t, q, v, f, ierr)
      class(nested_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      real(wp) :: inner_q, inner_v
      logical :: failed
      ierr = 0
      f = -q
      if (self%depth == 0) return
      call run_nested(self%method, self%depth - 1, 0.25_wp, 1.0_wp, inner_q, inner_v, failed)
      self%failed = self%failed .or. failed
      f = f + 1.0e-3_wp*(inner_q**2 + inner_v**2 - 1.0_wp)
   end subroutine nested_force

   !> q, v at t_end of the system that starts at q = 1, v = 0
   recursive subroutine run_nested(method, depth, h, t_end, q, v, failed)
      integer, intent(in) :: method, depth
      real(wp), intent(in) :: h, t_end
      real(wp), intent(out) :: q, v
      logical, intent(out) :: failed
      type(nested_system) :: sys
      class(stepper_type), allocatable :: stepper
      type(trajectory_type) :: points
      type(state_type) :: state
      type(status_type) :: status
      sys%n = 1
      sys%depth = depth
      sys%method = method
      call new_method(trim(method_names(method)), stepper, status)
      state = new_state([1.0_wp, 0.0_wp])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, t_end, control_type(h=h), status, points)
      q = state%y(1)
      v = state%y(2)
      failed = status%failed() .or. sys%failed .or. points%count /= nint(t_end/h) + 1
   end subroutine run_nested

   !> The inner runs leave the outer one alone: all levels see the same inner motion
   subroutine test_nested(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: q(0:2), v(0:2)
      logical :: failed(0:2)
      integer :: method, depth
      do method = 1, size(method_names)
         if (.not. takes_forces(method_names(method))) cycle
         if (method_names(method) == 'bi-extrapolation') cycle     ! runs within runs within runs of hundreds of evaluations
         do depth = 0, 2
            call run_nested(method, depth, 0.25_wp, 0.5_wp, q(depth), v(depth), failed(depth))
         end do
         call check(error, .not. any(failed), trim(method_names(method))//': a run at some level failed')
         ! an inner energy error of a few percent, times 1e-3
         call check(error, maxval(abs(q - q(0))), 0.0_wp, thr=1.0e-4_wp, message=trim(method_names(method)))
         call check(error, abs(q(0) - cos(0.5_wp)), 0.0_wp, thr=1.0e-2_wp, message=trim(method_names(method)))
      end do
   end subroutine test_nested

   !> A copy of stepper and state made in mid-run goes on with the same bits, also after the
   !> original was stepped on
   subroutine test_checkpoint(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: newmark, newmark_copy
      type(midpoint_stepper) :: midpoint, midpoint_copy
      type(extrapolation_stepper) :: extrapolation, extrapolation_copy
      type(nested_system) :: sys
      type(state_type) :: state, copy, trial
      type(status_type) :: status
      type(clock_type) :: clock, copied_clock
      sys%n = 1

      call begin(newmark)
      newmark_copy = newmark
      call go_on(newmark, newmark_copy)
      call begin(midpoint)
      midpoint_copy = midpoint
      call go_on(midpoint, midpoint_copy)
      allocate (newmark_stepper :: extrapolation%base)
      call begin(extrapolation)
      extrapolation_copy = extrapolation
      call go_on(extrapolation, extrapolation_copy)
      deallocate (extrapolation%base)
      allocate (midpoint_stepper :: extrapolation%base)
      call begin(extrapolation)
      extrapolation_copy = extrapolation
      call go_on(extrapolation, extrapolation_copy)

   contains

      subroutine begin(stepper)
         class(stepper_type), intent(inout) :: stepper
         state = new_state([1.0_wp, 0.5_wp])
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         clock = clock_type(h=0.1_wp, k=0)
         call stepper%advance(sys, state, clock, 10, status, complete=.true.)
         copy = state
         copied_clock = clock
      end subroutine begin

      subroutine go_on(stepper, stepper_copy)
         class(stepper_type), intent(inout) :: stepper, stepper_copy
         call stepper%advance(sys, state, clock, 25, status, complete=.true.)
         trial = state
         call stepper%try_step(sys, state, -0.3_wp, state%t - 0.3_wp, trial, status)
         call stepper_copy%advance(sys, copy, copied_clock, 25, status, complete=.true.)
         call check(error, .not. status%failed(), trim(status%message))
         call check(error, equal([state%t, state%y, state%a], [copy%t, copy%y, copy%a]), 'the same bits')
         call check(error, clock%k == 35 .and. copied_clock%k == 35, 'both clocks')
      end subroutine go_on
   end subroutine test_checkpoint
end module test_nesting
