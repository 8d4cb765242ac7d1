! SPDX-License-Identifier: BSD-3-Clause
!> Orders of all of Pade's approximations and of backinterpolation as steps of forced systems, up to 16: in quadruple
!> precision, where diagonal matrices do without LAPACK.
module test_rational_orders
   use dynstep_kinds, only: wp
   use dynstep_linear_ode, only: linear_ode
   use dynstep_linear_system, only: linear_system, load_procedure
   use dynstep_matrix, only: diagonal_matrix, identity_matrix
   use dynstep_ode_system, only: ode_system
   use dynstep_pole_stages, only: form_automatic, form_product, form_refined
   use dynstep_rational, only: fehlberg_rational, pade_rational, rational_type, taylor_rational
   use dynstep_rational_stepper, only: rational_stepper
   use dynstep_status, only: status_type
   use dynstep_stepper, only: allocate_state, clock_type, method_properties, state_type
   use testing, only: error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_rational_orders

   !> Any R(z)
   type, extends(rational_stepper) :: any_stepper
      type(rational_type) :: r
      integer :: form = form_automatic
   contains
      procedure :: properties => any_properties
      procedure :: init => any_init
   end type any_stepper

   !> Two damped oscillators under cos and e^t: q_1 = cos t, q_2 = e^t
   type, extends(linear_system) :: oscillators
   contains
      procedure :: load => oscillators_load
   end type oscillators

   !> y_1 = cos t, y_2 = e^t again
   type, extends(linear_ode) :: decays
   contains
      procedure :: source => decays_source
   end type decays

   real(wp), parameter :: c(2) = [0.3_wp, 0.7_wp], k(2) = [2.0_wp, 1.5_wp], a(2) = [-0.9_wp, 0.6_wp]

contains

   subroutine collect_rational_orders(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('pade', test_pade), &
         & new_unittest('backinterpolation', test_backinterpolation)]
   end subroutine collect_rational_orders

   recursive function any_properties(self) result(facts)
      class(any_stepper), intent(in) :: self
      type(method_properties) :: facts
      facts%order = self%r%order
   end function any_properties

   recursive subroutine any_init(self, sys, status)
      class(any_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      call self%init_rational(sys, self%r, self%form, status)
   end subroutine any_init

   recursive subroutine oscillators_load(self, t, p, ierr)
      class(oscillators), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      p = [(k(1) - 1)*cos(t) - c(1)*sin(t), (1 + c(2) + k(2))*exp(t)]
      ierr = 0
   end subroutine oscillators_load

   recursive subroutine decays_source(self, t, b, ierr)
      class(decays), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: b(self%n)
      integer, intent(out) :: ierr
      b = [-sin(t) - a(1)*cos(t), (1 - a(2))*exp(t)]
      ierr = 0
   end subroutine decays_source

   !> Pade(0,0) ... (8,8), in all forms that are taken
   subroutine test_pade(error)
      type(error_type), allocatable, intent(out) :: error
      type(any_stepper) :: stepper
      type(status_type) :: status
      integer :: p, q
      do p = 0, 8
         do q = 0, 8
            if (p + q == 0) cycle
            call pade_rational(p, q, stepper%r, status)
            call check_orders(error, stepper, 'Pade')
         end do
      end do
   end subroutine test_pade

   !> Every p, q and alpha; both halves by RKF45
   subroutine test_backinterpolation(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: alphas(7) = [0.0_wp, 0.1_wp, 0.3_wp, 0.44_wp, 0.47_wp, 0.5_wp, 1.0_wp]
      type(any_stepper) :: stepper
      type(status_type) :: status
      integer :: i, p, q
      do i = 1, size(alphas)
         do p = 0, 6
            do q = 0, 6
               call taylor_rational(p, q, alphas(i), stepper%r, status)
               if (stepper%r%order > 0) call check_orders(error, stepper, 'BI')
            end do
         end do
         call fehlberg_rational(alphas(i), stepper%r, status)
         call check_orders(error, stepper, 'Fehlberg')
      end do
   end subroutine test_backinterpolation

   subroutine check_orders(error, stepper, name)
      type(error_type), allocatable, intent(inout) :: error
      type(any_stepper), intent(inout) :: stepper
      character(len=*), intent(in) :: name
      type(oscillators) :: second
      type(decays) :: first
      type(status_type) :: status
      integer :: way
      call second%set(identity_matrix(2), diagonal_matrix(c), diagonal_matrix(k), status)
      second%load_kind = load_procedure
      call first%set(diagonal_matrix(a), status)
      first%source_kind = load_procedure
      do way = -1, 1, 2
         stepper%form = merge(form_automatic, form_product, way > 0)
         call check_order(error, stepper, second, real(way, wp), name)
         if (way > 0) stepper%form = form_refined
         call check_order(error, stepper, first, real(way, wp), name)
      end do
   end subroutine check_orders

   !> Order over the last halving above rounding
   subroutine check_order(error, stepper, sys, end, name)
      type(error_type), allocatable, intent(inout) :: error
      type(any_stepper), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: end
      character(len=*), intent(in) :: name
      real(wp) :: coarse, fine, measured
      character(len=100) :: words
      integer :: i
      measured = 0
      coarse = error_of(stepper, sys, end, 1)
      do i = 1, 7
         fine = error_of(stepper, sys, end, 2**i)
         if (fine < 1.0e4_wp*epsilon(1.0_wp) .and. i > 1) exit
         measured = log(coarse/fine)/log(2.0_wp)
         coarse = fine
      end do
      if (abs(measured - stepper%r%order) < 0.3_wp) return
      ! where p < q and alpha is small, the term of the lower order is too small to be seen, and so the other way round
      if (name == 'BI' .and. measured > stepper%r%order .and. measured < max(stepper%r%p, stepper%r%q) + 0.3_wp) return
      write (words, '(a, "(", i0, ",", i0, "), form ", i0, ", to t = ", f4.1, ": order ", f6.2, ", not ", i0)') name, &
         & stepper%r%p, stepper%r%q, stepper%form, end, measured, stepper%r%order
      call test_failed(error, trim(words))
   end subroutine check_order

   real(wp) function error_of(stepper, sys, end, steps)
      class(rational_stepper), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: end
      integer, intent(in) :: steps
      type(status_type) :: status
      type(state_type) :: state
      type(clock_type) :: clock
      real(wp) :: exact(4)
      call allocate_state(sys, state, status)
      state%y = 1
      if (size(state%y) > 2) state%y(3) = 0
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      clock%h = end/steps
      call stepper%advance(sys, state, clock, steps, status, .false.)
      exact = [cos(end), exp(end), -sin(end), exp(end)]
      error_of = maxval(abs(state%y - exact(:size(state%y))))
      if (status%failed()) error_of = huge(1.0_wp)
   end function error_of
end module test_rational_orders
