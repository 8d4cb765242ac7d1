! SPDX-License-Identifier: BSD-3-Clause
!> Work of implicit and explicit steps, by counters; matrices that are kept; tangents by differences.
module test_work
   use dynstep, only: clock_type, kind_banded, kind_dense, kind_diagonal, midpoint_stepper, newmark_stepper, state_type, &
      & status_type, stepper_type, wp
   use run_cases, only: new_state
   use spring_cases, only: chain_system, cranked_system, spring_system
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_work

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   subroutine collect_work(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('linear', test_linear_work), &
         & new_unittest('explicit', test_explicit_work), &
         & new_unittest('matrix-reuse', test_reuse), &
         & new_unittest('linear-in-time', test_linear_in_time), &
         & new_unittest('tangents', test_tangents), &
         & new_unittest('groups', test_groups)]
   end subroutine collect_work

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
         state = new_state([1.0_wp, 1.0_wp, 0.5_wp, 0.0_wp])
         if (n == 1) state = new_state([1.0_wp, 0.5_wp])
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
      state = new_state([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp])
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
      state = new_state([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp])
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
      state = new_state(y)
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
      state = new_state([0.0_wp])
      do i = 1, 2
         sys%n = 2
         sys%rate = 1.5_wp
         sys%gives_tangent = .true.
         sys%structure%mass = kind_diagonal
         sys%structure%mass_is_constant = .false.
         sys%structure%force_is_linear = i == 2
         told = new_state([1.0_wp, -0.5_wp, 0.0_wp, 0.25_wp])
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
      state = new_state(y)
      sys%second = 0.25_wp
      do kind = kind_banded, kind_dense
         sys%n = 6
         sys%structure%tangent = kind
         sys%structure%kl = 2
         sys%structure%ku = 1
         do i = 1, 2
            sys%gives_tangent = i == 1
            by_differences = new_state(y)
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
      sys%structure%tangent = kind_dense
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
      state = new_state([(0.2_wp*cos(2.0_wp*i), i=1, 2*sys%n)])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      trial = state
      call stepper%try_step(sys, state, 0.01_wp, 0.01_wp, trial, status)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, int(stepper%count%tangents), 1, 'one tangent')
      call check(error, int(sys%difference_forces), expected, 'forces for it')
      call check(error, int(stepper%count%forces), expected + 1 + int(stepper%count%newton_iterations), 'all forces')
   end subroutine count_forces
end module test_work
