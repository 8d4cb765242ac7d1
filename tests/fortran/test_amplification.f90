! SPDX-License-Identifier: BSD-3-Clause
!> Amplification matrices of real steps, accuracy domains, damping and frequency.
module test_amplification
   use dynstep_accuracy_domain, only: accuracy_error, accuracy_limit, damping_frequency
   use dynstep_alpha_coefficients, only: coefficients_of
   use dynstep_amplification, only: amplification, spectral_radii
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_extrapolation_stability, only: growth_per_step
   use dynstep_generalized_alpha, only: generalized_alpha_stepper
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: diagonal_matrix
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
   use dynstep_pade, only: pade_stepper
   use dynstep_rational, only: pade_rational, rational_type, taylor_rational
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_converged, status_type
   use dynstep_stepper, only: allocate_state, state_type, stepper_type
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_amplification

   real(wp), parameter :: pi = acos(-1.0_wp)
   complex(wp), parameter :: places(7) = [(0.0_wp, 0.001_wp), (0.0_wp, 2.0_wp), (-0.1_wp, 3.0_wp), (-5.0_wp, 1.0_wp), &
      & (0.5_wp, 1.0_wp), (-1.0_wp, 1.0e4_wp), (-20.0_wp, 50.0_wp)]

contains

   subroutine collect_amplification(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('trapezoid', test_trapezoid), &
         & new_unittest('pade', test_pade), &
         & new_unittest('extrapolation', test_extrapolation), &
         & new_unittest('generalized-alpha', test_alpha), &
         & new_unittest('refusals', test_refusals), &
         & new_unittest('accuracy', test_accuracy), &
         & new_unittest('accuracy-refusals', test_accuracy_refusals), &
         & new_unittest('damping-frequency', test_damping)]
   end subroutine collect_amplification

   !> Newmark with beta = 1/4 and the midpoint rule are Pade's (1,1)
   subroutine test_trapezoid(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      type(status_type) :: status
      real(wp) :: radius(1)
      call check_rational(error, newmark, 1, 1)
      call check_rational(error, midpoint, 1, 1)
      ! a growing motion, too fast for the step: 1 + C/2 < 0
      newmark%beta = 0.0_wp
      call spectral_radii(newmark, [(5.0_wp, 1.0_wp)], radius, status)
      call check(error, .not. status%failed() .and. radius(1) >= huge(1.0_wp), 'a step that is refused')
   end subroutine test_trapezoid

   subroutine test_pade(error)
      type(error_type), allocatable, intent(out) :: error
      call check_rational(error, pade_stepper(p=3, q=4), 3, 4)
      call check_rational(error, pade_stepper(p=4, q=4), 4, 4)
   end subroutine test_pade

   !> Spectral radius of real steps against |R(z)|
   subroutine check_rational(error, stepper, p, q)
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), intent(in) :: stepper
      integer, intent(in) :: p, q
      type(rational_type) :: r
      type(status_type) :: status
      real(wp) :: radius(size(places))
      integer :: i
      call pade_rational(p, q, r, status)
      call spectral_radii(stepper, places, radius, status)
      call check(error, .not. status%failed(), status%message)
      do i = 1, size(places)
         ! the eigenvalues of a step beside the real axis are the root of a small discriminant
         call check(error, radius(i), abs(r%value(places(i))), 'spectral radius', thr=1.0e-11_wp)
      end do
   end subroutine check_rational

   !> Against the stability theory of extrapolations, in twice the precision
   subroutine test_extrapolation(error)
      type(error_type), allocatable, intent(out) :: error
      type(extrapolation_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: radius(3), xi
      real(wp), parameter :: z(3) = [0.5_wp, 2.0_wp, 5.0_wp]
      integer :: i, k
      stepper%levels = 4
      allocate (newmark_stepper :: stepper%base)
      do k = 0, 1
         xi = 0.05_wp*k
         call spectral_radii(stepper, z*cmplx(-xi, sqrt(1.0_wp - xi**2), wp), radius, status)
         call check(error, .not. status%failed(), status%message)
         do i = 1, size(z)
            call check(error, radius(i) - 1.0_wp, growth_per_step([1, 2, 3, 4], 0.25_wp, xi, z(i)), 'growth', thr=1.0e-13_wp)
         end do
      end do
   end subroutine test_extrapolation

   !> The formula is what real steps do with q, v and their a_alpha; at high frequency rho_inf is left
   subroutine test_alpha(error)
      type(error_type), allocatable, intent(out) :: error
      type(generalized_alpha_stepper) :: stepper
      type(linear_system) :: sys
      type(state_type) :: state, trial
      type(status_type) :: status
      complex(wp), parameter :: z = (-0.3_wp, 0.8_wp)       ! |z| < 1: no scales
      real(wp), allocatable :: a(:, :)
      real(wp) :: before(3), after(3), radius(3)
      integer :: step
      call coefficients_of(0.4_wp, stepper%coefficients, status)
      call amplification(stepper, z, a, status)
      call sys%set(diagonal_matrix([1.0_wp]), diagonal_matrix([-2.0_wp*real(z, wp)]), diagonal_matrix([abs(z)**2]), status)
      call stepper%init(sys, status)
      state%t = 0.0_wp
      state%y = [1.0_wp, -0.7_wp]
      call stepper%start(sys, state, status)
      call allocate_state(sys, trial, status)
      do step = 1, 4
         before(1:2) = state%y
         if (step > 1) call stepper%last_a_alpha(before(3:3))
         call stepper%try_step(sys, state, 1.0_wp, real(step, wp), trial, status)
         call stepper%accept(state, trial)
         after(1:2) = state%y
         call stepper%last_a_alpha(after(3:3))
         if (step > 1) call check(error, maxval(abs(matmul(a, before) - after)), 0.0_wp, 'a step', thr=1.0e-14_wp)
      end do
      call check(error, .not. status%failed(), status%message)
      ! three eigenvalues fall together: a third of the digits
      call spectral_radii(stepper, [(0.0_wp, 1.0e-3_wp), (0.0_wp, 1.0e8_wp), (-1.0e8_wp, 1.0_wp)], radius, status)
      call check(error, radius(1), 1.0_wp, 'slow motion', thr=1.0e-6_wp)
      call check(error, radius(2), 0.4_wp, 'fast motion', thr=1.0e-4_wp)
      call check(error, radius(3) <= 1.0_wp, 'overdamped motion')
   end subroutine test_alpha

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(extrapolation_stepper) :: stepper
      type(status_type) :: status
      real(wp), allocatable :: a(:, :)
      real(wp) :: radius(1)
      stepper%levels = 0
      allocate (newmark_stepper :: stepper%base)
      call amplification(stepper, (0.0_wp, 1.0_wp), a, status)
      call check(error, status%code, dynstep_invalid_input, 'no levels')
      status%code = 0
      call spectral_radii(stepper, [(0.0_wp, 1.0_wp)], radius, status)
      call check(error, status%code, dynstep_invalid_input, 'no levels, radii')
   end subroutine test_refusals

   !> The error is the tolerance at the limit; angles beside the real axis go over into those on it; an independent study
   subroutine test_accuracy(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      real(wp) :: h, beside, x0(2)
      integer :: k
      x0 = [1.0_wp, 0.0_wp]
      call taylor_rational(4, 5, 0.3_wp, r, status)
      call accuracy_limit(r, 0.5_wp*pi, x0, 1.0e-4_wp, h, status)
      call check(error, h, 0.55871_wp, 'alpha 0.3, 90 degrees', thr=1.0e-5_wp)
      call check(error, accuracy_error(r, 0.5_wp*pi, x0, h*(1.0_wp - 1.0e-12_wp)) <= 1.0e-4_wp, 'not larger below')
      call check(error, accuracy_error(r, 0.5_wp*pi, x0, h) > 1.0e-4_wp, 'larger there')
      do k = 0, 1
         call accuracy_limit(r, k*pi, x0, 1.0e-4_wp, h, status)
         call accuracy_limit(r, k*pi + 1.0e-3_wp, x0, 1.0e-4_wp, beside, status)
         call check(error, h, beside, 'double eigenvalue', thr=1.0e-5_wp, rel=.true.)    ! even in the angle
      end do
      ! a shorter time allows longer steps, and a wide tolerance any
      call accuracy_limit(r, 0.5_wp*pi, x0, 1.0e-4_wp, h, status, t_end=2.0_wp)
      call check(error, h > 0.55871_wp .and. h < 2.0_wp, 'shorter time')
      call accuracy_limit(r, pi, x0, 10.0_wp, h, status)
      call check(error, h, 10.0_wp, 'wide tolerance')
      call check(error, .not. status%failed(), status%message)
   end subroutine test_accuracy

   subroutine test_accuracy_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      real(wp) :: h
      call taylor_rational(1, 1, 0.5_wp, r, status)
      call accuracy_limit(r, 1.0_wp, [1.0_wp, 0.0_wp], 0.0_wp, h, status)
      call check(error, status%code, dynstep_invalid_input, 'tolerance')
      call status%clear()
      call accuracy_limit(r, 1.0_wp, [1.0_wp, 0.0_wp], 1.0e-4_wp, h, status, t_end=-1.0_wp)
      call check(error, status%code, dynstep_invalid_input, 't_end')
      call status%clear()
      call accuracy_limit(r, 1.0_wp, [1.0_wp, 0.0_wp], 1.0e-13_wp, h, status)
      call check(error, status%code, dynstep_not_converged, 'too much asked')
   end subroutine test_accuracy_refusals

   !> exp(-damping + i frequency) = R; F-stable methods do not damp on the imaginary axis; poles and zeros
   subroutine test_damping(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      real(wp) :: damping, frequency
      integer :: i
      call pade_rational(4, 4, r, status)
      do i = 1, size(places)
         call damping_frequency(r, places(i), damping, frequency)
         call check(error, abs(exp(cmplx(-damping, frequency, wp)) - r%value(places(i))), 0.0_wp, 'R', thr=1.0e-14_wp)
      end do
      call damping_frequency(r, (0.0_wp, 7.0_wp), damping, frequency)
      call check(error, damping, 0.0_wp, 'F-stable', thr=4*epsilon(1.0_wp))
      call pade_rational(1, 1, r, status)
      call damping_frequency(r, (2.0_wp, 0.0_wp), damping, frequency)
      call check(error, damping, -huge(1.0_wp), 'pole')
      call damping_frequency(r, (-2.0_wp, 0.0_wp), damping, frequency)
      call check(error, damping, huge(1.0_wp), 'zero')
   end subroutine test_damping
end module test_amplification
