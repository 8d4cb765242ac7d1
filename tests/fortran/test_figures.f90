! SPDX-License-Identifier: BSD-3-Clause
!> Figures that README.md and the pages in docs/ state, measured again.
module test_figures
   use dynstep
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_figures

   integer, parameter :: qp = selected_real_kind(30)

   !> q'' + q = 0 by a force procedure
   type, extends(mechanical_system) :: force_oscillator
   contains
      procedure :: force => oscillator_force
   end type force_oscillator

contains

   subroutine collect_figures(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('readme', test_readme), &
         & new_unittest('round-off', test_roundoff), &
         & new_unittest('newton-tolerance', test_tolerance), &
         & new_unittest('kinks', test_kinks)]
   end subroutine collect_figures

   !> README.md: q'' + 16 q = 0 over 30 s with 15000 Newmark steps, plain and extrapolated to order
   !> 8; and the example, 3 s with h = 0.1
   subroutine test_readme(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: q(1)
      integer(long) :: substeps
      q = oscillate('newmark', 30.0_wp, 30.0_wp/15000)
      call check(error, abs(q(1) - cos(120.0_wp)), 3.7e-4_wp, 'plain', thr=0.1e-4_wp)
      q = oscillate('newmark-extrapolation', 30.0_wp, 0.02_wp, substeps)
      call check(error, q(1), cos(120.0_wp), 'extrapolated', thr=2.0e-13_wp)
      call check(error, int(substeps), 15000)
      q = oscillate('newmark-extrapolation', 3.0_wp, 0.1_wp)
      call check(error, q(1) - cos(12.0_wp), -1.8e-9_wp, 'example', thr=0.1e-9_wp)
   end subroutine test_readme

   !> Displacement at t_end
   function oscillate(method, t_end, h, substeps) result(q)
      character(len=*), intent(in) :: method
      real(wp), intent(in) :: t_end, h
      integer(long), intent(out), optional :: substeps
      real(wp) :: q(1)
      class(stepper_type), allocatable :: stepper
      type(linear_system) :: sys
      type(state_type) :: state
      type(status_type) :: status
      call sys%set(diagonal_matrix([1.0_wp]), zero_matrix(1), diagonal_matrix([16.0_wp]), status)
      call new_method(method, stepper, status)
      call stepper%init(sys, status)
      state%y = [1.0_wp, 0.0_wp]
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, t_end, control_type(h=h), status)
      q = state%y(:1)
      if (status%failed()) q = huge(1.0_wp)
      if (present(substeps)) substeps = stepper%count%substeps
   end function oscillate

   !> docs/theory/newmark-extrapolation.md, "Which unknown is solved for": one base step, P = 4,
   !> Romberg, relative error for omega h from 1e-6 to 1e8
   subroutine test_roundoff(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: matrices
      type(force_oscillator) :: force
      type(status_type) :: status
      real(wp) :: z
      integer :: exponent, start
      character(len=24) :: what

      call matrices%set(identity_matrix(1), zero_matrix(1), diagonal_matrix([1.0_wp]), status)
      force%n = 1
      force%structure%velocity_free = .true.
      do exponent = -6, 8
         z = 10.0_wp**exponent
         write (what, '("z = 1e", i0)') exponent
         do start = 1, 24
            call check(error, one_step(matrices, z, 0.26_wp*start) < 4.0e-15_wp, 'matrices, '//what)
            call check(error, one_step(force, z, 0.26_wp*start) < 4.0e-15_wp, 'force, '//what)
         end do
      end do
   end subroutine test_roundoff

   !> Relative error of a base step of length z from [cos(angle); sin(angle)].  With beta = 1/4 a
   !> substep multiplies q + i v by (1 - i z/2n)/(1 + i z/2n).
   real(wp) function one_step(sys, z, angle)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: z, angle
      type(extrapolation_stepper) :: stepper
      type(state_type) :: state, trial
      type(status_type) :: status
      complex(qp) :: exact, turn
      integer :: i, j
      integer, parameter :: numbers(4) = [1, 2, 4, 8]
      real(qp) :: w

      allocate (newmark_stepper :: stepper%base)
      stepper%sequence = sequence_romberg
      call stepper%init(sys, status)
      state%y = [cos(angle), sin(angle)]
      call stepper%start(sys, state, status)
      call allocate_state(sys, trial, status)
      call stepper%try_step(sys, state, z, z, trial, status)
      exact = 0.0_qp
      do j = 1, 4
         w = 1.0_qp
         do i = 1, 4
            if (i /= j) w = w*numbers(j)**2/real(numbers(j)**2 - numbers(i)**2, qp)
         end do
         turn = cmplx(2*numbers(j), -z, qp)/cmplx(2*numbers(j), z, qp)
         exact = exact + w*turn**numbers(j)
      end do
      exact = exact*cmplx(state%y(1), state%y(2), qp)
      one_step = real(abs(cmplx(trial%y(1), trial%y(2), qp) - exact)/abs(exact), wp)
      if (status%failed()) one_step = huge(one_step)
   end function one_step

   recursive subroutine oscillator_force(self, t, q, v, f, ierr)
      class(force_oscillator), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -q
   end subroutine oscillator_force

   !> The same page: a loose end of Newton's iteration spoils the extrapolation
   subroutine test_tolerance(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: exact(4)
      exact = two_bodies(8, 0.02_wp, 0.0_wp)
      call check(error, maxval(abs(two_bodies(4, 0.03_wp, 0.0_wp) - exact)) < 2.0e-9_wp, 'to round-off')
      call check(error, maxval(abs(two_bodies(4, 0.03_wp, 1.0e-10_wp) - exact)) > 1.0e-6_wp, 'to 1e-10')
   end subroutine test_tolerance

   !> The paper's example 3 at t = 30, Romberg
   function two_bodies(levels, h, tolerance) result(y)
      integer, intent(in) :: levels
      real(wp), intent(in) :: h, tolerance
      real(wp) :: y(4)
      type(two_body_system) :: sys
      type(newmark_stepper) :: base
      type(extrapolation_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      call sys%setup(1.0_wp, 2.0_wp, 1.0_wp, 1.5_wp, 1.0_wp, 3.0_wp)
      base%newton%tolerance = tolerance
      allocate (stepper%base, source=base)
      stepper%levels = levels
      stepper%sequence = merge(sequence_romberg, sequence_harmonic, levels == 4)
      call stepper%init(sys, status)
      state%y = [0.0_wp, 1.0_wp, 0.0_wp, 5.0_wp]
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, 30.0_wp, control_type(h=h), status)
      y = state%y
      if (status%failed()) y = huge(1.0_wp)
   end function two_bodies

   !> docs/howto/ground-motion.md: base steps that end on samples, and others.  omega = 10, 5 % damping,
   !> 300 random samples 0.02 s apart, P = 4; relative error of q at t = 6
   subroutine test_kinks(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: exact, x
      real(wp) :: samples(301)
      integer :: i
      x = 0.3_wp
      do i = 1, size(samples)
         x = modulo(16807.0_wp*x + 0.1234567_wp, 1.0_wp)
         samples(i) = 2.0_wp*x - 1.0_wp
      end do
      exact = shaken(samples, 6, 0.00125_wp)
      call check(error, abs(shaken(samples, 4, 0.02_wp)/exact - 1.0_wp) < 2.0e-11_wp, 'each sample')
      call check(error, abs(shaken(samples, 4, 0.01_wp)/exact - 1.0_wp) < 2.0e-12_wp, 'half')
      call check(error, abs(shaken(samples, 4, 0.04_wp)/exact - 1.0_wp) > 1.0e-2_wp, 'each other')
      call check(error, abs(shaken(samples, 4, 0.015_wp)/exact - 1.0_wp) > 1.0e-2_wp, 'three quarters')
   end subroutine test_kinks

   real(wp) function shaken(samples, levels, h)
      real(wp), intent(in) :: samples(:)
      integer, intent(in) :: levels
      real(wp), intent(in) :: h
      type(linear_system) :: sys
      type(load_table_type) :: table
      type(extrapolation_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      call sys%set(diagonal_matrix([1.0_wp]), diagonal_matrix([1.0_wp]), diagonal_matrix([100.0_wp]), status)
      table%dt = 0.02_wp
      table%samples = reshape(samples, [1, size(samples)])
      call sys%set_table(table, status)
      allocate (newmark_stepper :: stepper%base)
      stepper%levels = levels
      call stepper%init(sys, status)
      state%y = [0.0_wp, 0.0_wp]
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, 6.0_wp, control_type(h=h), status)
      shaken = state%y(1)
      if (status%failed()) shaken = huge(1.0_wp)
   end function shaken
end module test_figures
