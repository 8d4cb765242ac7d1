! SPDX-License-Identifier: BSD-3-Clause
!> Newton's iteration for implicit steps: damping, limits, reuse of matrices, work, tangents.
module test_newton
   use dynstep, only: clock_type, dynstep_callback_failed, dynstep_not_converged, extrapolation_stepper, &
      & kind_banded, kind_diagonal, mechanical_system, midpoint_stepper, newmark_stepper, state_type, status_type, &
      & stepper_type, wp
   use reference_problems, only: new_problem, problem_cubic, problem_mass, start_q, start_v
   use spring_cases, only: bounded_system, chain_system, cranked_system, fuzzy_system, spring_system
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
         & new_unittest('fuzzy-force', test_fuzzy), &
         & new_unittest('linear-work', test_linear_work), &
         & new_unittest('explicit-work', test_explicit_work), &
         & new_unittest('matrix-reuse', test_reuse), &
         & new_unittest('linear-in-time', test_linear_in_time), &
         & new_unittest('tangents', test_tangents), &
         & new_unittest('groups', test_groups)]
   end subroutine collect_newton

   !> A state with y = [q; v] at time 0
   function start(y) result(state)
      real(wp), intent(in) :: y(:)
      type(state_type) :: state
      allocate (state%y(size(y)), source=y)
   end function start

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
      state = start([3.0_wp, 0.0_wp])
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
      state = start([3.0_wp, 0.0_wp])
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
      state = start([1.0_wp, 0.75_wp])
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
      same = .not. (abs(left%t - right%t) > 0.0_wp .or. any(abs(left%y - right%y) > 0.0_wp) &
         & .or. any(abs(left%a - right%a) > 0.0_wp))
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
      state = start([0.0_wp, 1.0_wp])
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
      last = start([0.0_wp, 1.0_wp])
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
            state = start([start_q, start_v])
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
         state = start([0.5_wp, 0.0_wp])
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

   !> A linear force with its tangent: one force and one solve a step, a factorization for each
   !> step length.  By differences: up to three of each, the same motion.
   subroutine test_linear_work(error)
      type(error_type), allocatable, intent(out) :: error
      type(spring_system) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state, other
      type(status_type) :: status
      type(clock_type) :: clock
      integer :: n
      do n = 1, 2
         call sys%setup([4.0_wp, 9.0_wp], [0.0_wp, 0.0_wp], [0.25_wp, 0.5_wp], [1.0_wp, 0.0_wp])
         sys%n = n
         if (n == 1) call sys%setup([4.0_wp], [0.0_wp], [0.25_wp], [1.0_wp])
         sys%structure%force_is_linear = .true.
         sys%structure%tangent_is_constant = .true.
         sys%gives_tangent = .true.
         state = start([1.0_wp, 1.0_wp, 0.5_wp, 0.0_wp])
         if (n == 1) state = start([1.0_wp, 0.5_wp])
         other = state
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         clock = clock_type(h=0.1_wp, k=0)
         call stepper%advance(sys, state, clock, 100, status, complete=.true.)
         call check(error, .not. status%failed(), trim(status%message))
         call check(error, int(stepper%count%forces), 101, 'one force a step, and the start')
         call check(error, int(stepper%count%solves), 100, 'one solve a step')
         call check(error, int(stepper%count%factorizations), 1, 'one step length')
         call check(error, int(stepper%count%tangents), 1, 'a constant tangent')
         call check(error, int(stepper%count%masses), 0, 'an identity')
         clock%h = 0.05_wp
         clock%t0 = state%t
         clock%k = 0
         call stepper%advance(sys, state, clock, 10, status, complete=.true.)
         call check(error, int(stepper%count%factorizations), 2, 'two step lengths')
         call check(error, int(stepper%count%tangents), 1, 'a constant tangent')

         sys%gives_tangent = .false.
         call stepper%start(sys, other, status)
         clock = clock_type(h=0.1_wp, k=0)
         call stepper%advance(sys, other, clock, 100, status, complete=.true.)
         clock = clock_type(t0=other%t, h=0.05_wp, k=0)
         call stepper%advance(sys, other, clock, 10, status, complete=.true.)
         call check(error, maxval(abs(other%y - state%y)), 0.0_wp, thr=100*eps, message='differences')
         call check(error, stepper%count%forces <= 340, 'three forces a step')
      end do
   end subroutine test_linear_work

   !> beta = 0 without velocities: one force a step, no solve with the identity, one
   !> factorization of a constant mass
   subroutine test_explicit_work(error)
      type(error_type), allocatable, intent(out) :: error
      type(spring_system) :: sys
      type(cranked_system) :: cranked
      type(newmark_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      stepper%beta = 0.0_wp
      call sys%setup([1.0_wp, 2.0_wp], [1.0_wp, 1.0_wp], [0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp])
      sys%structure%velocity_free = .true.
      state = start([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp])
      clock%h = 0.1_wp
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call stepper%advance(sys, state, clock, 50, status, complete=.true.)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, int(stepper%count%forces), 51, 'one force a step, and the start')
      call check(error, int(stepper%count%solves + stepper%count%factorizations), 0, 'nothing to solve')

      cranked%n = 2
      cranked%structure%mass = kind_diagonal
      cranked%structure%velocity_free = .true.
      state = start([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp])
      clock%k = 0
      call stepper%init(cranked, status)
      call stepper%start(cranked, state, status)
      call stepper%advance(cranked, state, clock, 50, status, complete=.true.)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, int(stepper%count%forces), 51, 'one force a step')
      call check(error, int(stepper%count%factorizations), 1, 'a constant mass is factorized once')
      call check(error, int(stepper%count%masses), 1, 'and asked for once')
      call check(error, int(stepper%count%solves), 51, 'a solve a step')
   end subroutine test_explicit_work

   !> Smooth motion, short steps: a matrix serves many of them
   subroutine test_reuse(error)
      type(error_type), allocatable, intent(out) :: error
      type(chain_system) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      real(wp) :: y(20)
      integer :: i
      sys%n = 10
      sys%structure%tangent = kind_banded
      sys%structure%kl = 1
      sys%structure%ku = 1
      sys%structure%tangent_is_symmetric = .true.
      sys%gives_tangent = .true.
      y = [(0.1_wp*sin(1.0_wp*i), i=1, 20)]
      state = start(y)
      clock%h = 0.02_wp
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call stepper%advance(sys, state, clock, 500, status, complete=.true.)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, stepper%count%tangents <= 10, 'ten tangents for 500 steps')
      call check(error, int(stepper%count%factorizations), int(stepper%count%tangents))
      call check(error, stepper%count%forces <= 2500, 'five forces a step')
      call check(error, int(stepper%count%solves), int(stepper%count%newton_iterations))
   end subroutine test_reuse

   !> Stiffness and mass that depend on time: the one correction of a system declared linear gives
   !> what the iteration gives that is not told
   subroutine test_linear_in_time(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      type(newmark_stepper) :: damped
      call told_and_not(error, newmark)
      call told_and_not(error, midpoint)
      damped%beta = 0.3025_wp
      damped%gamma = 0.6_wp
      call told_and_not(error, damped)
   end subroutine test_linear_in_time

   subroutine told_and_not(error, stepper)
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), intent(inout) :: stepper
      type(cranked_system) :: sys
      type(state_type) :: state, told
      type(status_type) :: status
      type(clock_type) :: clock
      integer :: i
      state = start([0.0_wp])
      do i = 1, 2
         sys%n = 2
         sys%rate = 1.5_wp
         sys%gives_tangent = .true.
         sys%structure%mass = kind_diagonal
         sys%structure%mass_is_constant = .false.
         sys%structure%force_is_linear = i == 2
         told = start([1.0_wp, -0.5_wp, 0.0_wp, 0.25_wp])
         clock = clock_type(h=0.25_wp, k=0)
         call stepper%init(sys, status)
         call stepper%start(sys, told, status)
         call stepper%advance(sys, told, clock, 40, status, complete=.true.)
         call check(error, .not. status%failed(), trim(status%message))
         if (i == 1) state = told
      end do
      call check(error, maxval(abs(told%y - state%y)), 0.0_wp, thr=50*eps)
      call check(error, int(stepper%count%newton_iterations), 40, 'one correction a step')
      call check(error, int(stepper%count%tangents), 40, 'new matrices in each step')
   end subroutine told_and_not

   !> Tangents by differences and those of the user lead to the same motion
   subroutine test_tangents(error)
      type(error_type), allocatable, intent(out) :: error
      type(chain_system) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state, by_differences
      type(status_type) :: status
      type(clock_type) :: clock
      real(wp) :: y(12)
      integer :: i, kind
      y = [(0.5_wp*cos(2.0_wp*i), i=1, 12)]
      state = start(y)
      sys%second = 0.25_wp
      do kind = kind_banded, kind_banded + 1       ! banded, dense
         sys%n = 6
         sys%structure%tangent = kind
         sys%structure%kl = 2
         sys%structure%ku = 1
         do i = 1, 2
            sys%gives_tangent = i == 1
            by_differences = start(y)
            clock = clock_type(h=-0.1_wp, k=0)
            call stepper%init(sys, status)
            call stepper%start(sys, by_differences, status)
            call stepper%advance(sys, by_differences, clock, 50, status, complete=.true.)
            call check(error, .not. status%failed(), trim(status%message))
            if (i == 1) state = by_differences
         end do
         call check(error, maxval(abs(by_differences%y - state%y)), 0.0_wp, thr=200*eps)
      end do
   end subroutine test_tangents

   !> Forces for one tangent: one at the point, and one for each group of columns of K and C
   subroutine test_groups(error)
      type(error_type), allocatable, intent(out) :: error
      type(chain_system) :: sys
      integer, parameter :: n = 20
      sys%n = n
      sys%structure%tangent = kind_banded
      sys%structure%kl = 1
      sys%structure%ku = 1
      call count_forces(error, sys, 1 + 3 + 3)
      sys%structure%kl = 2
      sys%second = 0.5_wp
      call count_forces(error, sys, 1 + 4 + 4)
      sys%structure%tangent = kind_banded + 1
      call count_forces(error, sys, 1 + 2*n)
   end subroutine test_groups

   subroutine count_forces(error, sys, expected)
      type(error_type), allocatable, intent(inout) :: error
      type(chain_system), intent(inout) :: sys
      integer, intent(in) :: expected
      type(newmark_stepper) :: stepper
      type(state_type) :: state, trial
      type(status_type) :: status
      integer :: i
      sys%gives_tangent = .false.
      sys%difference_forces = 0
      state = start([(0.2_wp*cos(2.0_wp*i), i=1, 2*sys%n)])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      trial = state
      call stepper%try_step(sys, state, 0.01_wp, 0.01_wp, trial, status)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, int(stepper%count%tangents), 1, 'one tangent')
      call check(error, int(sys%difference_forces), expected, 'forces for it')
      call check(error, int(stepper%count%forces), expected + 1 + int(stepper%count%newton_iterations), 'all forces')
   end subroutine count_forces
end module test_newton
