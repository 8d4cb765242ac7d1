! SPDX-License-Identifier: BSD-3-Clause
!> Accuracy of single steps of general systems from omega h = 1e-6 to 1e8, against the same
!> step in quadruple precision; drift of long runs.
module test_stiff
   use dynstep, only: clock_type, kind_diagonal, midpoint_stepper, newmark_stepper, state_type, status_type, &
      & stepper_type, wp
   use run_cases, only: new_state
   use spring_cases, only: midpoint_in_quad, newmark_in_quad, pair_in_quad, pair_system, qp, spring_system
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_stiff

contains

   subroutine collect_stiff(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('linear-force', test_linear), &
         & new_unittest('hardening-force', test_hardening), &
         & new_unittest('modes-far-apart', test_far_apart), &
         & new_unittest('scales-far-apart', test_scales), &
         & new_unittest('slow-on-stiff', test_slow), &
         & new_unittest('energy-of-a-long-run', test_energy)]
   end subroutine collect_stiff

   !> A force that is linear, but nobody says so; with and without damping
   subroutine test_linear(error)
      type(error_type), allocatable, intent(out) :: error
      type(spring_system) :: sys
      real(wp), parameter :: damping(4) = [0.0_wp, 0.02_wp, 1.0_wp, 30.0_wp]
      real(wp) :: z
      integer :: i, j
      do j = 1, size(damping)
         do i = -12, 16
            z = 10.0_wp**(0.5_wp*i)
            call sys%setup([z**2], [0.0_wp], [2.0_wp*damping(j)*z], [0.0_wp])
            sys%structure%velocity_free = .not. damping(j) > 0.0_wp
            call check_step(error, sys, 0.25_wp, 1.0_wp, z)
            call check_step(error, sys, 0.25_wp, -1.0_wp, z)
            call check_step(error, sys, 1.0_wp/6, 1.0_wp, z)
            call check_step(error, sys, 0.0_wp, 1.0_wp, z)
         end do
      end do
   end subroutine test_linear

   !> q + e q^3 with e from 0.01 to 100; beta = 1/4 (for beta = 1/6 the iteration may fail far
   !> beyond the limit of stability, and says so)
   subroutine test_hardening(error)
      type(error_type), allocatable, intent(out) :: error
      type(spring_system) :: sys
      real(wp) :: z, e
      integer :: i, j
      do j = -2, 2
         e = 10.0_wp**j
         do i = -12, 16
            z = 10.0_wp**(0.5_wp*i)
            call sys%setup([z**2], [e], [0.0_wp], [0.0_wp])
            sys%structure%velocity_free = .true.
            call check_step(error, sys, 0.25_wp, 1.0_wp, z)
            call check_step(error, sys, 0.25_wp, -1.0_wp, z)
            if (z*sqrt(1.0_wp + 3.0_wp*e) < 3.0_wp) call check_step(error, sys, 1.0_wp/6, 1.0_wp, z)
            call check_step(error, sys, 0.0_wp, 1.0_wp, z)
         end do
      end do
   end subroutine test_hardening

   !> One step from q = 1, v = 0.3, by Newmark or (beta = 0) the midpoint rule: 5e-15 in q and v
   !> where omega h <= 1, else 1e-13
   subroutine check_step(error, sys, beta, h, z)
      type(error_type), allocatable, intent(inout) :: error
      type(spring_system), intent(inout) :: sys
      real(wp), intent(in) :: beta, h, z
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      real(qp) :: q, v, a
      type(state_type) :: state, trial
      type(status_type) :: status
      real(wp) :: errors(2)
      character(len=120) :: words

      if (allocated(error)) return
      state = new_state([1.0_wp, 0.3_wp])
      if (beta > 0.0_wp) then
         newmark%beta = beta
         call one_step(newmark, sys, h, state, trial, status)
         call newmark_in_quad(sys, 1, beta, h, state%y(1), state%y(2), state%a(1), q, v, a)
      else
         call one_step(midpoint, sys, h, state, trial, status)
         call midpoint_in_quad(sys, 1, h, state%y(1), state%y(2), q, v, a)
      end if
      errors = real(abs([trial%y(1) - q, trial%y(2) - v])/abs([q, v]), wp)
      if (.not. status%failed() .and. all(errors <= merge(5.0e-15_wp, 1.0e-13_wp, z <= 1.0_wp))) return
      write (words, '("beta ", f6.4, ", omega h ", es8.1, ", e ", es8.1, ", c ", es8.1, ": errors", 2es8.1)') &
         & beta, z*h, sys%e, sys%c, errors
      call test_failed(error, trim(words), trim(status%message))
   end subroutine check_step

   subroutine one_step(stepper, sys, h, state, trial, status)
      class(stepper_type), intent(inout) :: stepper
      type(spring_system), intent(inout) :: sys
      real(wp), intent(in) :: h
      type(state_type), intent(inout) :: state, trial
      type(status_type), intent(inout) :: status
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      trial = state
      call stepper%try_step(sys, state, h, h, trial, status)
   end subroutine one_step

   !> A soft mode beside a stiff one, coupled: each keeps its digits, in the measure of its
   !> own coordinate
   subroutine test_far_apart(error)
      type(error_type), allocatable, intent(out) :: error
      type(pair_system) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state, trial
      type(status_type) :: status
      real(qp) :: y(4), a(2)
      real(wp) :: worst
      integer :: i
      sys%n = 2
      do i = 0, 14
         sys%between = 10.0_wp**i
         sys%ground = [1.0_wp, 2.0_wp]
         sys%c = [0.25_wp, 0.125_wp]
         state = new_state([1.0_wp, 1.0_wp, 0.5_wp, 0.5_wp])
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         trial = state
         call stepper%try_step(sys, state, 0.25_wp, 0.25_wp, trial, status)
         call pair_in_quad(sys, 0.25_wp, state%y, state%a, y, a)
         worst = real(maxval(abs(trial%y - y)), wp)
         call check(error, .not. status%failed(), trim(status%message))
         call check(error, worst, 0.0_wp, thr=1.0e-13_wp, message='largest error')
      end do
   end subroutine test_far_apart

   !> Coordinates of sizes 1e-6 to 1e6 that do not know of each other: each is as accurate as
   !> if it were alone, while the largest converges first
   subroutine test_scales(error)
      type(error_type), allocatable, intent(out) :: error
      type(spring_system) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state, trial
      type(status_type) :: status
      real(wp), parameter :: scales(4) = [1.0e6_wp, 1.0e-6_wp, 1.0_wp, 1.0e-3_wp]
      real(qp) :: q, v, a
      integer :: i
      call sys%setup([1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp], [0.0_wp, 1.0e12_wp, 1.0_wp, 1.0e6_wp], &
         & [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
      sys%structure%tangent = kind_diagonal
      sys%structure%velocity_free = .true.
      state = new_state([scales, 0.3_wp*scales])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      trial = state
      call stepper%try_step(sys, state, 0.5_wp, 0.5_wp, trial, status)
      call check(error, .not. status%failed(), trim(status%message))
      do i = 1, 4
         call newmark_in_quad(sys, i, 0.25_wp, 0.5_wp, state%y(i), state%y(4 + i), state%a(i), q, v, a)
         call check(error, real(abs(trial%y(i)/q - 1), wp), 0.0_wp, thr=2.0e-15_wp, message='q of one scale')
         call check(error, real(abs(trial%y(4 + i)/v - 1), wp), 0.0_wp, thr=2.0e-15_wp, message='v of one scale')
      end do
   end subroutine test_scales

   !> A slow motion in the equilibrium of a stiff spring: rounding of f hides the velocity's last
   !> digits, and the iteration must not run after them
   subroutine test_slow(error)
      type(error_type), allocatable, intent(out) :: error
      type(spring_system) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      integer :: i
      do i = 2, 14, 4
         call sys%setup([10.0_wp**i], [0.5_wp], [0.0_wp], [1.5_wp*10.0_wp**i])
         state = new_state([1.0_wp, 0.0_wp])               ! k (1 + 0.5) = p
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         clock = clock_type(t0=0.0_wp, h=0.01_wp, k=0)
         call stepper%advance(sys, state, clock, 100, status, complete=.true.)
         call check(error, .not. status%failed(), trim(status%message))
         call check(error, state%y(1), 1.0_wp, thr=1.0e-14_wp, message='it stays')
         call check(error, stepper%count%newton_iterations <= 300, 'three corrections a step are enough')
      end do
   end subroutine test_slow

   !> At small steps the energy errs by the sum of rounding errors at random; at omega h > 0.1
   !> it drifts, by less than eps/4 a step (the linear engine's shears do not)
   subroutine test_energy(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      real(wp), parameter :: z(5) = [0.002_wp, 0.03_wp, 0.5_wp, 1.7_wp, 10.0_wp]
      integer :: i
      do i = 1, size(z)
         call check_energy(error, newmark, z(i))
         call check_energy(error, midpoint, z(i))
      end do
   end subroutine test_energy

   subroutine check_energy(error, stepper, z)
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), intent(inout) :: stepper
      real(wp), intent(in) :: z
      integer, parameter :: steps = 100000
      type(spring_system) :: sys
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      call sys%setup([1.0_wp], [0.0_wp], [0.0_wp], [0.0_wp])
      sys%structure%velocity_free = .true.
      state = new_state([1.0_wp, 0.25_wp])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      clock%h = z
      call stepper%advance(sys, state, clock, steps, status, complete=.true.)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, (state%y(1)**2 + state%y(2)**2)/1.0625_wp, 1.0_wp, &
         & thr=epsilon(1.0_wp)*merge(2.0_wp*sqrt(real(steps, wp)), 0.25_wp*steps, z < 0.1_wp), message='energy')
   end subroutine check_energy
end module test_stiff
