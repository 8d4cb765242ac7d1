! SPDX-License-Identifier: BSD-3-Clause
!> The estimate of Pade's steps by a companion: size, order, stiff and forced systems, work.
module test_pade_estimates
   use control_loop, only: even_norm, run_within, slope_of
   use dynstep, only: dense_matrix, diagonal_matrix, free_oscillator, linear_system, load_procedure, loaded_oscillator, &
      & method_properties, pade_stepper, state_type, status_type, wp
   use dynstep_error_norm, only: error_norm_type
   use dynstep_stepper, only: verdict_type
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_pade_estimates

   !> A slow mass and one on a spring of 1e6, damped, under loads
   type, extends(linear_system) :: stiff_pair
   contains
      procedure :: load => stiff_load
   end type stiff_pair

   integer, parameter :: degrees(2, 8) = reshape([1, 1, 2, 2, 1, 2, 2, 3, 3, 3, 2, 4, 4, 4, 0, 2], [2, 8])

contains

   subroutine collect_pade_estimates(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('oscillator', test_oscillator), &
         & new_unittest('forced', test_forced), &
         & new_unittest('stiff', test_stiff), &
         & new_unittest('proportionality', test_proportionality), &
         & new_unittest('work', test_work), &
         & new_unittest('refused', test_refused)]
   end subroutine collect_pade_estimates

   recursive subroutine stiff_load(self, t, p, ierr)
      class(stiff_pair), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      p = [cos(1.5_wp*t), 1.0e6_wp*sin(t)]
   end subroutine stiff_load

   !> Estimate beside the true local error, by ten steps of Pade(6,7), in `steps` steps of length h; the last estimate
   subroutine find_effectivity(stepper, sys, y, h, ratios, size_of_last, error)
      type(pade_stepper), intent(inout) :: stepper
      class(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: y(:), h
      real(wp), intent(out) :: ratios(:), size_of_last
      type(error_type), allocatable, intent(inout) :: error
      type(pade_stepper) :: fine
      type(state_type) :: state, trial, exact, next
      type(verdict_type) :: verdict
      type(status_type) :: status
      type(error_norm_type) :: norm
      integer :: i, j
      norm = even_norm(1.0_wp)
      norm%rtol = 0.0_wp
      fine%p = 6
      fine%q = 7
      call fine%init(sys, status)
      call stepper%init(sys, status)
      call stepper%prepare_control(sys, norm, status)
      state%y = y
      call stepper%start(sys, state, status)
      trial = state
      next = state
      do i = 1, size(ratios)
         exact = state
         call fine%start(sys, exact, status)
         do j = 1, 10
            call fine%try_step(sys, exact, 0.1_wp*h, exact%t + 0.1_wp*h, next, status)
            call fine%accept(exact, next)
         end do
         call stepper%try_within(sys, state, h, state%t + h, norm, trial, verdict, status)
         call check(error, .not. status%failed(), trim(status%message))
         if (allocated(error)) return
         ratios(i) = verdict%error/norm%measure(exact%y - trial%y, state%y, trial%y)
         size_of_last = verdict%error
         call stepper%accept(state, trial)
      end do
   end subroutine find_effectivity

   !> 1 + (q + 1)/p times the error, and of order p + q + 1
   subroutine test_oscillator(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(pade_stepper) :: stepper
      type(method_properties) :: facts
      type(status_type) :: status
      real(wp) :: ratios(2), sizes(2), h(2), expected
      integer :: i, k
      call free_oscillator(sys, 1.0_wp, 1.0_wp, status)
      do i = 1, size(degrees, 2)
         stepper%p = degrees(1, i)
         stepper%q = degrees(2, i)
         expected = 1.0_wp + 1.0_wp/stepper%q
         if (stepper%p > 0) expected = 1.0_wp + real(stepper%q + 1, wp)/stepper%p
         do k = 1, 2
            h(k) = 0.15_wp*(stepper%p + stepper%q)**0.8_wp/k
            call find_effectivity(stepper, sys, [1.0_wp, 0.5_wp], h(k), ratios, sizes(k), error)
            if (allocated(error)) return
            call check(error, ratios(2), expected, 'estimate/error', thr=0.02_wp, rel=.true.)
         end do
         facts = stepper%properties()
         call check(error, facts%error_order, facts%order)
         call check(error, slope_of(h, sizes), facts%error_order + 1.0_wp, 'order', thr=0.1_wp)
      end do
   end subroutine test_oscillator

   !> Damping and a load: never below the error
   subroutine test_forced(error)
      type(error_type), allocatable, intent(out) :: error
      type(loaded_oscillator) :: sys
      type(pade_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: ratios(8), last
      integer :: i
      call sys%setup(status)
      do i = 1, size(degrees, 2)
         stepper%p = degrees(1, i)
         stepper%q = degrees(2, i)
         call find_effectivity(stepper, sys, [1.0_wp, -2.0_wp], 0.1_wp*(stepper%p + stepper%q)**0.8_wp, ratios, last, error)
         if (allocated(error)) return
         call check(error, minval(ratios) >= 1.0_wp .and. maxval(ratios) <= 6.0_wp, 'estimate/error')
      end do
   end subroutine test_forced

   !> A stiff mode that starts off its equilibrium, with and without feedback: not below 0.99 of the error, which where p = q is
   !> the amplitude that R leaves, and no growth with (h omega)^p
   subroutine test_stiff(error)
      type(error_type), allocatable, intent(out) :: error
      type(stiff_pair) :: sys
      type(pade_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: ratios(8), last
      integer :: i, k
      do k = 1, 2
         call sys%set(diagonal_matrix([1.0_wp, 1.0_wp]), diagonal_matrix([0.1_wp, 2.0e3_wp]), &
            & dense_matrix(reshape([2.0_wp, -1.0_wp, -1.0_wp, 1.0e6_wp], [2, 2]), .true.), status)
         sys%load_kind = load_procedure
         if (k == 2) call sys%set_coupling([1.0_wp, 0.5_wp], [0.3_wp, 0.2_wp], [0.1_wp, 0.0_wp], status)
         do i = 1, size(degrees, 2) - 1
            stepper%p = degrees(1, i)
            stepper%q = degrees(2, i)
            call find_effectivity(stepper, sys, [1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp], 0.1_wp*(stepper%p + stepper%q)**0.8_wp, &
               & ratios, last, error)
            if (allocated(error)) return
            call check(error, minval(ratios) >= 0.98_wp .and. maxval(ratios) <= 6.0_wp, 'estimate/error')
         end do
      end do
   end subroutine test_stiff

   !> Errors at the end follow the tolerance like its power (p + q)/(p + q + 1)
   subroutine test_proportionality(error)
      type(error_type), allocatable, intent(out) :: error
      type(loaded_oscillator) :: sys
      type(pade_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(error_norm_type) :: norm
      real(wp) :: tolerances(3), errors(3), x, v, a, order
      integer :: i, k, rejections
      call sys%setup(status)
      do i = 1, 6
         stepper%p = degrees(1, i)
         stepper%q = degrees(2, i)
         order = real(stepper%p + stepper%q, wp)
         do k = 1, 3
            tolerances(k) = 10.0_wp**(-3 - k)
            norm = even_norm(tolerances(k))
            call stepper%init(sys, status)
            call stepper%prepare_control(sys, norm, status)
            state%t = 0.0_wp
            state%y = [1.0_wp, -2.0_wp]
            call stepper%start(sys, state, status)
            call run_within(stepper, sys, state, 1.0_wp, norm, 0.01_wp, status, rejections)
            call check(error, .not. status%failed(), trim(status%message))
            call sys%exact(1.0_wp, x, v, a)
            errors(k) = hypot(state%y(1) - x, state%y(2) - v)
            call check(error, errors(k) <= 3.0_wp*tolerances(k)**(order/(order + 1.0_wp)), 'error beside the tolerance')
         end do
         call check(error, slope_of(tolerances, errors), order/(order + 1.0_wp), 'slope', thr=0.25_wp)
      end do
   end subroutine test_proportionality

   !> Fixed steps cost and give the same with control prepared; steps of one length, up to the rounding of times, keep their factors
   subroutine test_work(error)
      type(error_type), allocatable, intent(out) :: error
      type(loaded_oscillator) :: sys
      type(pade_stepper) :: stepper(3)
      type(state_type) :: state(3), trial
      type(verdict_type) :: verdict
      type(status_type) :: status
      type(error_norm_type) :: norm
      real(wp) :: t1
      integer :: i, j
      call sys%setup(status)
      norm = even_norm(1.0e-6_wp)
      do j = 1, 3
         call stepper(j)%init(sys, status)
         if (j > 1) call stepper(j)%prepare_control(sys, norm, status)
         state(j)%t = 0.1_wp
         state(j)%y = [1.0_wp, -2.0_wp]
         call stepper(j)%start(sys, state(j), status)
      end do
      trial = state(1)
      do i = 1, 20
         do j = 1, 2
            call stepper(j)%try_step(sys, state(j), 0.1_wp, state(j)%t + 0.1_wp, trial, status)
            call stepper(j)%accept(state(j), trial)
         end do
         t1 = state(3)%t + 0.1_wp
         call stepper(3)%try_within(sys, state(3), t1 - state(3)%t, t1, norm, trial, verdict, status)
         call stepper(3)%accept(state(3), trial)
      end do
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, maxval(abs(state(1)%y - state(2)%y)) <= 0.0_wp, 'the same bits')
      call check(error, maxval(abs(state(1)%y - state(3)%y)) <= 1.0e-14_wp, 'nearly the same bits')
      call check(error, int(stepper(2)%count%solves), int(stepper(1)%count%solves))
      call check(error, int(stepper(2)%count%forces), int(stepper(1)%count%forces))
      ! (4,4) has two pairs of poles, (3,5) two and a real one: three matrices more, for all steps
      call check(error, int(stepper(3)%count%factorizations - stepper(1)%count%factorizations), 3)
   end subroutine test_work

   subroutine test_refused(error)
      type(error_type), allocatable, intent(out) :: error
      type(loaded_oscillator) :: sys
      type(pade_stepper) :: stepper
      type(state_type) :: state
      type(verdict_type) :: verdict
      type(status_type) :: status
      type(error_norm_type) :: norm
      call sys%setup(status)
      state%y = [1.0_wp, -2.0_wp]
      norm = even_norm(1.0e-6_wp)
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call stepper%try_within(sys, state, 0.1_wp, 0.1_wp, norm, state, verdict, status)
      call check(error, index(status%message, 'prepare_control') > 0, trim(status%message))
      call status%clear()
      norm%atol(1) = -1.0_wp
      call stepper%prepare_control(sys, norm, status)
      call check(error, index(status%message, 'atol') > 0, trim(status%message))
   end subroutine test_refused
end module test_pade_estimates
