! SPDX-License-Identifier: BSD-3-Clause
!> Newton's iteration for implicit steps: damping, limits, where it ends.
module test_newton
   use dynstep, only: clock_type, dynstep_callback_failed, dynstep_not_converged, extrapolation_stepper, &
      & mechanical_system, midpoint_stepper, newmark_stepper, state_type, status_type, stepper_type, wp
   use reference_problems, only: new_problem, problem_cubic, problem_mass, start_q, start_v
   use run_cases, only: equal, new_state
   use spring_cases, only: bounded_system, fuzzy_system, spring_system
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_newton

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   subroutine collect_newton(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('damping-rescues', test_damping), &
         & new_unittest('refusal-is-damped', test_refusal), &
         & new_unittest('limit', test_limit), &
         & new_unittest('failure-keeps-run', test_failure_keeps_run), &
         & new_unittest('round-off', test_round_off), &
         & new_unittest('fuzzy-force', test_fuzzy)]
   end subroutine collect_newton

   !> q'' = -1e6 atan(q) from q = 3 with h = 1: a full correction overshoots more and more
   subroutine test_damping(error)
      type(error_type), allocatable, intent(out) :: error
      type(bounded_system) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state, trial
      type(status_type) :: status
      sys%n = 1
      sys%stiffness = 1.0e6_wp
      sys%structure%velocity_free = .true.
      state = new_state([3.0_wp, 0.0_wp])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      trial = state
      call stepper%try_step(sys, state, 1.0_wp, 1.0_wp, trial, status)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, stepper%count%halvings > 0, 'corrections were halved')
      call check(error, trial%a(1), -1.0e6_wp*atan(trial%y(1)), thr=10*eps, rel=.true.)
      call check(error, trial%y(1), 3.0_wp + 0.25_wp*(state%a(1) + trial%a(1)), thr=1.0e6_wp*eps)

      stepper%newton%halvings = 0
      call stepper%init(sys, status)
      call stepper%try_step(sys, state, 1.0_wp, 1.0_wp, trial, status)
      call check(error, status%code, dynstep_not_converged, 'full corrections diverge')
      call check(error, status%retry .and. index(status%message, 't = 1 ') > 0, trim(status%message))
   end subroutine test_damping

   !> A correction that leaves the domain of the force is halved; a predictor that does so fails
   subroutine test_refusal(error)
      type(error_type), allocatable, intent(out) :: error
      type(bounded_system) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state, trial
      type(status_type) :: status
      sys%n = 1
      sys%stiffness = 1.0e6_wp
      sys%bound = 3.5_wp
      state = new_state([3.0_wp, 0.0_wp])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      trial = state
      call stepper%try_step(sys, state, 1.0_wp, 1.0_wp, trial, status)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, stepper%count%halvings > 0, 'corrections were halved')

      state%y(2) = 1.0e6_wp
      call stepper%try_step(sys, state, 1.0_wp, 1.0_wp, trial, status)
      call check(error, status%code, dynstep_callback_failed)
      call check(error, status%retry, 'a smaller step helps')
      call check(error, index(status%message, 'force refused') > 0, trim(status%message))
   end subroutine test_refusal

   subroutine test_limit(error)
      type(error_type), allocatable, intent(out) :: error
      type(spring_system) :: sys
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      call sys%setup([1.0_wp], [1.0_wp], [0.0_wp], [0.0_wp])
      newmark%newton%limit = 2
      call limited(error, newmark, sys)
      midpoint%newton%limit = 2
      call limited(error, midpoint, sys)
   end subroutine test_limit

   !> Two corrections are not enough: nothing changes
   subroutine limited(error, stepper, sys)
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), intent(inout) :: stepper
      type(spring_system), intent(inout) :: sys
      type(state_type) :: state, before
      type(status_type) :: status
      type(clock_type) :: clock
      state = new_state([1.0_wp, 0.75_wp])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call check(error, .not. status%failed(), trim(status%message))
      before = state
      clock%h = 0.5_wp
      call stepper%advance(sys, state, clock, 3, status, complete=.true.)
      call check(error, status%code, dynstep_not_converged)
      call check(error, status%retry .and. index(status%message, '2 corrections at t = ') > 0, trim(status%message))
      call check(error, same(state, before) .and. clock%k == 0, 'the state is untouched')
      call check(error, int(stepper%count%steps), 0, 'no step is counted')
   end subroutine limited

   pure logical function same(left, right)
      type(state_type), intent(in) :: left, right
      same = equal([left%t, left%y, left%a], [right%t, right%y, right%a])
   end function same

   !> A force that refuses beyond a bound ends a run at the last good step, with its acceleration
   subroutine test_failure_keeps_run(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      type(extrapolation_stepper) :: extrapolation
      call runs_into_bound(error, newmark)
      call runs_into_bound(error, midpoint)
      allocate (newmark_stepper :: extrapolation%base)
      call runs_into_bound(error, extrapolation)
      deallocate (extrapolation%base)
      allocate (midpoint_stepper :: extrapolation%base)
      call runs_into_bound(error, extrapolation)
   end subroutine test_failure_keeps_run

   subroutine runs_into_bound(error, stepper)
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), intent(inout) :: stepper
      type(bounded_system) :: sys
      type(state_type) :: state, last
      type(status_type) :: status, again
      type(clock_type) :: clock
      sys%n = 1
      sys%bound = 0.5_wp
      state = new_state([0.0_wp, 1.0_wp])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      clock%h = 0.0625_wp
      call stepper%advance(sys, state, clock, 100, status, complete=.true.)
      call check(error, status%code, dynstep_callback_failed)
      call check(error, clock%k > 4 .and. clock%k < 9, 'stopped before the bound')
      call check(error, state%t, 0.0625_wp*real(clock%k, wp), thr=0.0_wp)
      call check(error, int(stepper%count%steps), int(clock%k), 'steps counted')
      call check(error, state%y(1) <= 0.5_wp, 'the state is in the domain')
      call check(error, state%a(1), -atan(state%y(1)), thr=4*eps, message='its acceleration')
      ! as many steps by themselves give the same bits
      last = new_state([0.0_wp, 1.0_wp])
      call stepper%start(sys, last, again)
      clock = clock_type(h=0.0625_wp, k=0)
      call stepper%advance(sys, last, clock, int(state%t/0.0625_wp), again, complete=.true.)
      call check(error, .not. again%failed() .and. same(state, last), 'the last good step')
   end subroutine runs_into_bound

   !> After a step of any method f - M a is round-off, against the sizes of its terms
   subroutine test_round_off(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state, exact
      type(status_type) :: status
      type(clock_type) :: clock
      real(wp), parameter :: betas(4) = [0.0_wp, 1.0_wp/12, 1.0_wp/6, 0.25_wp]
      integer :: problem, i
      do problem = problem_cubic, problem_mass
         call new_problem(problem, sys)
         do i = 1, size(betas)
            stepper%beta = betas(i)
            state = new_state([start_q, start_v])
            call stepper%init(sys, status)
            call stepper%start(sys, state, status)
            clock = clock_type(h=0.25_wp, k=0)
            call stepper%advance(sys, state, clock, 20, status, complete=.true.)
            exact = state
            call stepper%start(sys, exact, status)
            call check(error, .not. status%failed(), trim(status%message))
            call check(error, maxval(abs(state%a - exact%a)), 0.0_wp, thr=4*eps, message='a = M^-1 f')
         end do
      end do
   end subroutine test_round_off

   !> A force that is a difference of large terms, or of limited accuracy itself, stalls the
   !> iteration early; it must end there, and keep what can be had
   subroutine test_fuzzy(error)
      type(error_type), allocatable, intent(out) :: error
      type(fuzzy_system) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      integer :: i
      sys%n = 1
      do i = -16, -11
         sys%fuzz = 10.0_wp**i
         state = new_state([0.5_wp, 0.0_wp])
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         clock = clock_type(h=0.125_wp, k=0)
         call stepper%advance(sys, state, clock, 100, status, complete=.true.)
         call check(error, .not. status%failed(), trim(status%message))
         call check(error, stepper%count%newton_iterations <= 700, 'at most seven corrections a step')
      end do
      ! single precision inside the force: the caller says what can be asked for
      sys%fuzz = 1.0e-6_wp
      call stepper%init(sys, status)
      call stepper%advance(sys, state, clock, 100, status, complete=.true.)
      call check(error, status%code, dynstep_not_converged)
      call check(error, index(status%message, 'raise the tolerance') > 0, trim(status%message))
      call status%clear()
      stepper%newton%tolerance = 1.0e-3_wp
      call stepper%init(sys, status)
      call stepper%advance(sys, state, clock, 100, status, complete=.true.)
      call check(error, .not. status%failed(), trim(status%message))
   end subroutine test_fuzzy
end module test_newton
