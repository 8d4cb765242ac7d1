! SPDX-License-Identifier: BSD-3-Clause
!> Backinterpolation on nonlinear systems: orders forward and backward in time, the iteration and its limits, the same answer
!> by other ways, faults.
module test_backinterpolation
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use dynstep
   use dynstep_accelerations, only: acceleration_solver
   use dynstep_broyden, only: broyden_type
   use dynstep_rational, only: fehlberg_rational, rational_type, taylor_rational
   use dynstep_runge_kutta_halves, only: formula_fehlberg, runge_kutta_half
   use reference_problems, only: new_problem, problem_mass, qp, reference, start_q, start_v
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_backinterpolation

   real(wp), parameter :: eps = epsilon(1.0_wp)
   real(wp), parameter :: alphas(6) = [0.0_wp, 0.1_wp, 0.3_wp, 0.47_wp, 0.5_wp, 1.0_wp]

   !> y1' = 2 t y1 log(y2), y2' = -2 t y2 log(y1): y = [exp(sin(t^2)), exp(cos(t^2))]; with a fault in one of its calls
   type, extends(ode_system) :: log_pair
      integer :: calls = 0               !! of rhs
      integer :: fault_at = 0            !! number of the call that fails; 0: none
      integer :: answer = 0              !! its ierr; 0: it gives a NaN
      integer :: jacobian_fault = 0      !! the same of jacobian
      integer :: jacobians = 0
      logical :: recovers = .false.      !! later calls are good
   contains
      procedure :: rhs => log_pair_rhs
      procedure :: jacobian => log_pair_jacobian
   end type log_pair

   !> y' = l y
   type, extends(ode_system) :: scalar_linear
      real(wp) :: l = 1.0_wp
   contains
      procedure :: rhs => scalar_rhs
   end type scalar_linear

   !> y' = V diag(l) V^-1 y, with its Jacobian or without
   type, extends(ode_system) :: stiff_linear
      real(wp) :: a(3, 3) = 0.0_wp
      logical :: gives = .true.
   contains
      procedure :: rhs => stiff_rhs
      procedure :: jacobian => stiff_jacobian
   end type stiff_linear

   !> A reacting chain, y_i' = d (y_{i-1} - 2 y_i + y_{i+1}) + y_i (1 - y_i) cos t
   type, extends(ode_system) :: reacting_chain
      real(wp) :: d = 20.0_wp
   contains
      procedure :: rhs => chain_rhs
   end type reacting_chain

   !> y1' = y2, y2' = -y1, y3' = cos t
   type, extends(ode_system) :: plain_system
   contains
      procedure :: rhs => plain_rhs
   end type plain_system

   type, extends(ode_system) :: van_der_pol
      real(wp) :: mu = 1000.0_wp
   contains
      procedure :: rhs => van_der_pol_rhs
   end type van_der_pol

   type, extends(ode_system) :: robertson
   contains
      procedure :: rhs => robertson_rhs
   end type robertson

   !> A pendulum on a cart, driven: M(q) full, products of velocities
   type, extends(mechanical_system) :: cart
   contains
      procedure :: force => cart_force
      procedure :: mass => cart_mass
   end type cart

   !> The same as a system of first order
   type, extends(ode_system) :: as_first_order
      type(cart) :: inner
   contains
      procedure :: rhs => as_first_order_rhs
   end type as_first_order

   !> q'' = -q
   type, extends(mechanical_system) :: spring
   contains
      procedure :: force => spring_force
   end type spring

contains

   subroutine collect_backinterpolation(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('halves', test_halves), &
         & new_unittest('broyden', test_broyden), &
         & new_unittest('printed-update', test_printed_update), &
         & new_unittest('orders', test_orders), &
         & new_unittest('orders-fehlberg', test_orders_fehlberg), &
         & new_unittest('orders-of-mechanics', test_orders_of_mechanics), &
         & new_unittest('error-estimates', test_error_estimates), &
         & new_unittest('plain-estimates', test_plain_estimates), &
         & new_unittest('symmetry', test_symmetry), &
         & new_unittest('extrapolation', test_extrapolation), &
         & new_unittest('stiff-linear', test_stiff_linear), &
         & new_unittest('linear-path', test_linear_path), &
         & new_unittest('known-formulas', test_known_formulas), &
         & new_unittest('jacobians', test_jacobians), &
         & new_unittest('first-order-form', test_first_order_form), &
         & new_unittest('near-special-alphas', test_near_special), &
         & new_unittest('short-steps', test_short_steps), &
         & new_unittest('limits', test_limits), &
         & new_unittest('faults', test_faults), &
         & new_unittest('refusals', test_refusals), &
         & new_unittest('copies', test_copies), &
         & new_unittest('stability-limit', test_stability_limit), &
         & new_unittest('work', test_work), &
         & new_unittest('tolerance', test_tolerance)]
   end subroutine collect_backinterpolation

   recursive subroutine log_pair_rhs(self, t, y, f, ierr)
      class(log_pair), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      f = 0.0_wp
      self%calls = self%calls + 1
      if (minval(y) <= 0.0_wp) then
         ierr = 7
         return
      end if
      f = [2*t*y(1)*log(y(2)), -2*t*y(2)*log(y(1))]
      if (self%fault_at == 0 .or. self%calls < self%fault_at) return
      if (self%calls > self%fault_at .and. self%recovers) return
      ierr = self%answer
      if (ierr == 0) f(2) = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine log_pair_rhs

   recursive subroutine log_pair_jacobian(self, t, y, jac, ierr)
      class(log_pair), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(self%n)
      type(matrix_type), intent(inout) :: jac
      integer, intent(out) :: ierr
      call self%difference_jacobian(t, y, jac, ierr)
      self%jacobians = self%jacobians + 1
      if (self%jacobian_fault == 0 .or. self%jacobians < self%jacobian_fault) return
      ierr = self%answer
      if (ierr == 0) jac%a(2, 1) = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine log_pair_jacobian

   pure function log_pair_exact(t) result(y)
      real(wp), intent(in) :: t
      real(wp) :: y(2)
      y = [exp(sin(t**2)), exp(cos(t**2))]
   end function log_pair_exact

   recursive subroutine scalar_rhs(self, t, y, f, ierr)
      class(scalar_linear), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      f = self%l*y
   end subroutine scalar_rhs

   recursive subroutine stiff_rhs(self, t, y, f, ierr)
      class(stiff_linear), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      f = matmul(self%a, y)
   end subroutine stiff_rhs

   recursive subroutine stiff_jacobian(self, t, y, jac, ierr)
      class(stiff_linear), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(self%n)
      type(matrix_type), intent(inout) :: jac
      integer, intent(out) :: ierr
      ierr = 0
      if (self%gives) then
         jac%a = self%a
      else
         call self%difference_jacobian(t, y, jac, ierr)
      end if
   end subroutine stiff_jacobian

   recursive subroutine chain_rhs(self, t, y, f, ierr)
      class(reacting_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      f = -2*self%d*y + y*(1 - y)*cos(t)
      f(2:) = f(2:) + self%d*y(:self%n - 1)
      f(:self%n - 1) = f(:self%n - 1) + self%d*y(2:)
   end subroutine chain_rhs

   recursive subroutine plain_rhs(self, t, y, f, ierr)
      class(plain_system), intent(inout) :: self
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      f = [y(2), -y(1), cos(t)]
   end subroutine plain_rhs

   recursive subroutine van_der_pol_rhs(self, t, y, f, ierr)
      class(van_der_pol), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      f = 0.0_wp
      ierr = merge(5, 0, maxval(abs(y)) > 1.0e30_wp)
      if (ierr == 0) f = [y(2), self%mu*((1 - y(1)**2)*y(2)) - y(1)]
   end subroutine van_der_pol_rhs

   recursive subroutine robertson_rhs(self, t, y, f, ierr)
      class(robertson), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      f = 0.0_wp
      ierr = merge(5, 0, maxval(abs(y)) > 1.0e30_wp)
      if (ierr /= 0) return
      f(1) = -0.04_wp*y(1) + 1.0e4_wp*y(2)*y(3)
      f(3) = 3.0e7_wp*y(2)**2
      f(2) = -f(1) - f(3)
   end subroutine robertson_rhs

   recursive subroutine cart_force(self, t, q, v, f, ierr)
      class(cart), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = v(2)**2*sin(q(2)) - 3*q(1) - 0.2_wp*v(1) + cos(2*t)
      f(2) = -9.81_wp*sin(q(2)) - 0.1_wp*v(2)
   end subroutine cart_force

   recursive subroutine cart_mass(self, t, q, v, mass, ierr)
      class(cart), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = [3.0_wp, cos(q(2))]
      mass%a(:, 2) = [cos(q(2)), 1.0_wp]
   end subroutine cart_mass

   recursive subroutine as_first_order_rhs(self, t, y, f, ierr)
      class(as_first_order), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      call self%inner%rhs(t, y, f, ierr)
   end subroutine as_first_order_rhs

   subroutine make_cart(sys)
      type(cart), intent(out) :: sys
      sys%n = 2
      sys%structure%mass = kind_dense
      sys%structure%mass_is_constant = .false.
   end subroutine make_cart

   !> Equal steps from a start at time t0; y where the run ended
   subroutine run(stepper, sys, t0, h, steps, y, status)
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t0, h
      integer, intent(in) :: steps
      real(wp), intent(inout) :: y(:)
      type(status_type), intent(inout) :: status
      type(state_type) :: state
      type(clock_type) :: clock
      call stepper%init(sys, status)
      state%t = t0
      state%y = y
      call stepper%start(sys, state, status)
      clock = clock_type(t0=t0, h=h, k=0)
      call stepper%advance(sys, state, clock, steps, status, complete=.true.)
      y = state%y
   end subroutine run

   !> On y' = l y the halves are Taylor polynomials, but for RKF45's z^6/2080; embedded formulas differ from order p on
   subroutine test_halves(error)
      type(error_type), allocatable, intent(out) :: error
      type(scalar_linear) :: sys
      type(runge_kutta_half) :: half
      type(acceleration_solver) :: solver
      type(step_counters) :: counts
      type(status_type) :: status
      real(wp) :: d(1), e(1), z, expected
      integer :: formula, i, k
      sys%n = 1
      call solver%init(sys, status)
      do formula = 1, formula_fehlberg
         call half%init(formula, 1, status)
         do i = -3, 3
            if (i == 0) cycle
            z = 0.5_wp*i
            sys%l = 2*z
            call half%run(sys, 0.0_wp, [2.0_wp], 0.5_wp, solver, d, counts, status)
            expected = 0.0_wp
            do k = min(formula, 5), 1, -1
               expected = z*(1 + expected)/k
            end do
            if (formula == formula_fehlberg) expected = expected + z**6/2080
            call check(error, d(1), 2*expected, 'the increment', thr=30*eps*sum([(abs(z)**k, k=0, 6)]))
            call half%end_derivative(sys%l*([2.0_wp] + d))
            e = 0.0_wp
            call half%add_error(1.0_wp, e)
            ! of orders 1 (trapezoid) to 4 with y' at the end, of RKF45, of Nystroem's with weights
            select case (formula)
            case (1); expected = z**2/2
            case (2); expected = z**2/2
            case (3); expected = z**3/6
            case (4); expected = z**4/72 - z**5/144
            case (5); expected = z**5*nystroem_error()
            case default; expected = z**6/2080 - z**5/780
            end select
            call check(error, e(1), 2*expected, 'the error', thr=30*eps*sum([(abs(z)**k, k=0, 6)]))
         end do
      end do
      call check(error, .not. status%failed(), status%message)
   end subroutine test_halves

   !> z^5 of the difference: sum of e_i a_ij a_jk a_kl a_lm c_m over its chains, of which two are there
   pure real(wp) function nystroem_error()
      ! e5 a54 a43 a32 c2 + e6 a64 a43 a32 c2
      nystroem_error = (-405.0_wp/576*(8.0_wp/81) + 375.0_wp/576*(8.0_wp/75))*(15.0_wp/4)*(6.0_wp/25)/3
   end function nystroem_error

   !> G(x) = A x + small nonlinear terms, for Broyden's method
   pure function sample_residual(x) result(g)
      real(wp), intent(in) :: x(:)
      real(wp) :: g(size(x))
      integer :: i
      do i = 1, size(x)
         g(i) = (2 + 0.3_wp*i)*x(i) + 0.4_wp*x(1 + mod(i, size(x)))*x(i) - 1
      end do
      g(2:) = g(2:) + 0.5_wp*x(:size(x) - 1)
   end function sample_residual

   !> The iterates are those of the update of B, held as a dense matrix, up to rounding; then the restart
   subroutine test_broyden(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 5, most = 6
      type(broyden_type) :: method
      type(status_type) :: status
      real(wp) :: x(n), y(n), b(n, n), s(n), g(n), g_old(n), z(n), start(n), first, last
      integer :: i, k
      call method%init(n, most, status)
      start = [(1 + 0.1_wp*i, i=1, n)]
      x = 0.0_wp
      y = 0.0_wp
      b = 0.0_wp
      do i = 1, n
         b(i, i) = start(i)
      end do
      call method%forget()
      g = sample_residual(y)
      first = norm2(g)
      do k = 1, 40
         z = -sample_residual(x)/start
         call method%next(z)
         x = x + z
         if (k <= most) then
            s = -g
            call solve_dense(b, s)
            y = y + s
            g_old = g
            g = sample_residual(y)
            b = b + spread((g - g_old) - matmul(b, s), 2, n)*spread(s/dot_product(s, s), 1, n)
            call check(error, maxval(abs(x - y)), 0.0_wp, 'the iterates', thr=1.0e-11_wp)
         end if
      end do
      last = norm2(sample_residual(x))
      call check(error, last <= 1.0e-10_wp*first, 'the iteration goes on after its memory is full')
      call check(error, .not. status%failed(), status%message)
   end subroutine test_broyden

   !> x = A^-1 x by elimination with row interchanges
   subroutine solve_dense(a, x)
      real(wp), intent(in) :: a(:, :)
      real(wp), intent(inout) :: x(:)
      real(wp) :: w(size(x), size(x) + 1), row(size(x) + 1)
      integer :: i, j, n
      n = size(x)
      w(:, :n) = a
      w(:, n + 1) = x
      do j = 1, n
         i = j - 1 + maxloc(abs(w(j:, j)), 1)
         row = w(i, :)
         w(i, :) = w(j, :)
         w(j, :) = row/row(j)
         do i = 1, n
            if (i /= j) w(i, :) = w(i, :) - w(i, j)*w(j, :)
         end do
      end do
      x = w(:, n + 1)
   end subroutine solve_dense

   !> The update of the thesis's last chapter, B^-1 + (dG - B^-1 s) s', with s of length 1 as in its listing, against the right
   !> one, on the backward half-step of a linear system: the first diverges where h |l| >= 1
   subroutine test_printed_update(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 3
      real(wp), parameter :: sizes(3) = [1.0_wp, 2.0_wp, 3.0_wp]
      type(broyden_type) :: method
      type(status_type) :: status
      real(wp) :: b(n, n), x(n), y(n), g(n), g_old(n), s(n), z(n), l(n)
      integer :: i, j, k
      call method%init(n, 10, status)
      do j = 1, size(sizes)
         l = [0.25_wp, 0.5_wp, 1.0_wp]*sizes(j)
         b = 0.0_wp
         do i = 1, n
            b(i, i) = 1.0_wp
         end do
         x = 0.0_wp
         y = 0.0_wp
         g = backward(y)
         call method%forget()
         do k = 1, 30
            z = -backward(x)
            if (norm2(z) <= 1.0e-14_wp) exit
            call method%next(z)
            x = x + z
         end do
         do k = 1, 30
            s = -matmul(b, g)
            if (.not. norm2(s) < 1.0e30_wp) exit
            y = y + s
            g_old = g
            g = backward(y)
            b = b + spread((g - g_old)/norm2(s) - matmul(b, s/norm2(s)), 2, n)*spread(s/norm2(s), 1, n)
         end do
         call check(error, norm2(backward(x)) <= 1.0e-13_wp, 'the right update converges')
         call check(error, norm2(g) > 1.0e3_wp, 'the printed one diverges')
      end do

   contains

      function backward(u) result(r)
         real(wp), intent(in) :: u(n)
         real(wp) :: r(n)
         r = (1 + l + l**2/2 + l**3/6)*u - 1
      end function backward
   end subroutine test_printed_update

   !> (p, q) = 1 .. 5 each, both directions of time: the largest errors at eight times of the interval fall with the stated order
   subroutine test_orders(error)
      type(error_type), allocatable, intent(out) :: error
      type(backinterpolation_stepper) :: stepper
      integer :: direction, i, p, q
      do direction = 1, -1, -2
         do i = 1, size(alphas)
            stepper%alpha = alphas(i)
            do p = 1, 5
               do q = 1, 5
                  if (p > 1 .and. .not. alphas(i) > 0.0_wp) cycle
                  if (q > 1 .and. .not. alphas(i) < 1.0_wp) cycle
                  stepper%p = p
                  stepper%q = q
                  call check_order(error, stepper, direction)
               end do
            end do
         end do
      end do
   end subroutine test_orders

   subroutine test_orders_fehlberg(error)
      type(error_type), allocatable, intent(out) :: error
      type(backinterpolation_stepper) :: stepper
      integer :: direction, i
      stepper%halves = halves_fehlberg
      do direction = 1, -1, -2
         do i = 1, size(alphas)
            stepper%alpha = alphas(i)
            call check_order(error, stepper, direction)
         end do
      end do
   end subroutine test_orders_fehlberg

   !> Errors of a half of lower order p with a factor alpha^(p + 1) may not be the largest yet, and change its sign: a bound then
   pure logical function is_small(stepper)
      class(backinterpolation_stepper), intent(in) :: stepper
      is_small = stepper%halves == halves_taylor .and. stepper%p < stepper%q .and. stepper%alpha < 0.4_wp &
         & .and. stepper%alpha > 0.0_wp
   end function is_small

   subroutine check_order(error, stepper, direction)
      type(error_type), allocatable, intent(inout) :: error
      type(backinterpolation_stepper), intent(inout) :: stepper
      integer, intent(in) :: direction
      type(log_pair) :: sys
      type(method_properties) :: facts
      type(state_type) :: state
      type(clock_type) :: clock
      type(status_type) :: status
      real(wp) :: errors(2), slope
      character(len=100) :: words
      integer :: i, k, steps
      sys%n = 2
      facts = stepper%properties()
      errors = 0.0_wp
      do k = 1, 2
         steps = merge(32, 8, facts%order <= 3)*merge(2, 1, direction == 1)*k
         call stepper%init(sys, status)
         state%t = 1.0_wp
         state%y = log_pair_exact(1.0_wp)
         call stepper%start(sys, state, status)
         clock = clock_type(t0=1.0_wp, h=0.5_wp*direction/steps, k=0)
         do i = 1, 8
            call stepper%advance(sys, state, clock, steps/8, status, complete=.true.)
            errors(k) = max(errors(k), maxval(abs(state%y - log_pair_exact(state%t))))
         end do
      end do
      slope = log(errors(1)/errors(2))/log(2.0_wp)
      write (words, '(2i2, f6.3, ", direction ", i2, ": ", f6.3, " for ", i0, ", error ", es9.2)') stepper%p, stepper%q, &
         & stepper%alpha, direction, slope, facts%order, errors(2)
      call check(error, .not. status%failed(), trim(words)//': '//status%message)
      if (.not. is_small(stepper)) then
         ! an odd order has the factor (1 - alpha)^(p + 1) - alpha^(p + 1), which is small near 1/2
         call check(error, slope >= facts%order - 0.45_wp, trim(words))
         call check(error, slope <= facts%order + merge(1.1_wp, 0.45_wp, abs(stepper%alpha - 0.47_wp) <= 0.0_wp), trim(words))
      else
         call check(error, slope >= facts%order - 0.45_wp .or. errors(2) <= 0.02_wp/real(steps, wp)**facts%order, trim(words))
      end if
   end subroutine check_order

   !> M(q, v) and forces with products of velocities, against a reference in quadruple precision
   subroutine test_orders_of_mechanics(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(backinterpolation_stepper) :: stepper
      type(method_properties) :: facts
      type(status_type) :: status
      real(qp) :: exact(6, 1)
      real(wp) :: errors(2), y(4), slope
      character(len=100) :: words
      integer :: direction, i, k, p, q
      call new_problem(problem_mass, sys)
      do direction = 1, -1, -2
         call reference(problem_mass, [1.0_wp*direction], exact)
         do i = 1, size(alphas)
            stepper%alpha = alphas(i)
            do p = 1, 5
               do q = 1, 5
                  if (p > 1 .and. .not. alphas(i) > 0.0_wp) cycle
                  if (q > 1 .and. .not. alphas(i) < 1.0_wp) cycle
                  stepper%p = p
                  stepper%q = q
                  facts = stepper%properties()
                  do k = 1, 2
                     y = [start_q, start_v]
                     call run(stepper, sys, 0.0_wp, 0.25_wp*direction/k, 4*k, y, status)
                     errors(k) = real(maxval(abs(y - exact(1:4, 1))), wp)
                  end do
                  slope = log(errors(1)/errors(2))/log(2.0_wp)
                  write (words, '(2i2, f6.3, ", direction ", i2, ": ", f6.3, " for ", i0, ", error ", es9.2)') p, q, &
                     & alphas(i), direction, slope, facts%order, errors(2)
                  call check(error, .not. status%failed(), trim(words)//': '//status%message)
                  call check(error, slope >= facts%order - 0.4_wp, trim(words))
                  if (.not. is_small(stepper)) call check(error, slope <= facts%order + 0.6_wp, trim(words))
               end do
            end do
         end do
      end do
   end subroutine test_orders_of_mechanics

   !> The estimate falls like h to the power error_order + 1, and Fehlberg's sum is the error of fourth order
   subroutine test_error_estimates(error)
      type(error_type), allocatable, intent(out) :: error
      type(log_pair) :: sys
      type(backinterpolation_stepper) :: stepper
      type(method_properties) :: facts
      type(state_type) :: state, trial
      type(status_type) :: status
      real(wp) :: estimate(2), sizes(2), listed(2), h, slope
      character(len=60) :: words
      integer :: i, k, p
      sys%n = 2
      do i = 1, size(alphas)
         do p = 1, 6
            stepper%alpha = alphas(i)
            stepper%p = min(p, 5)
            stepper%q = min(p, 5)
            stepper%halves = merge(halves_fehlberg, halves_taylor, p == 6)
            stepper%listing_sign = .false.
            facts = stepper%properties()
            do k = 1, 2
               call stepper%init(sys, status)
               state%t = 1.0_wp
               state%y = log_pair_exact(1.0_wp)
               call stepper%start(sys, state, status)
               trial = state
               h = 0.025_wp/k
               call stepper%try_step(sys, state, h, 1 + h, trial, status)
               call stepper%estimate_error(estimate)
               sizes(k) = maxval(abs(estimate))
               stepper%listing_sign = .true.
               call stepper%estimate_error(estimate)
               listed(k) = maxval(abs(estimate))
               stepper%listing_sign = .false.
            end do
            slope = log(sizes(1)/sizes(2))/log(2.0_wp)
            write (words, '("halves ", i1, f6.2, ": ", f6.3, " for ", i1)') p, alphas(i), slope, facts%error_order + 1
            call check(error, .not. status%failed(), status%message)
            call check(error, abs(slope - (facts%error_order + 1)) <= 0.3_wp, words)
            if (p < 6) cycle
            ! C (alpha^5 + (1 - alpha)^5) h^5 and C |alpha^5 - (1 - alpha)^5| h^5
            if (abs(alphas(i) - 0.5_wp) > 0.0_wp) then
               call check(error, listed(2)/sizes(2), abs(alphas(i)**5 - (1 - alphas(i))**5)/(alphas(i)**5 + (1 - alphas(i))**5), &
                  & 'the sign of the listing', thr=0.05_wp)
            else
               call check(error, log(listed(1)/listed(2))/log(2.0_wp) > 5.7_wp, 'the listed estimate vanishes at alpha = 1/2')
            end if
         end do
      end do
   end subroutine test_error_estimates

   !> What the halves' own errors do not see, f(t) with order 4 and J y with order 5: the estimate of each component falls like
   !> h^4 or h^5, and is not smaller than the error
   subroutine test_plain_estimates(error)
      type(error_type), allocatable, intent(out) :: error
      type(plain_system) :: sys
      type(backinterpolation_stepper) :: stepper
      type(state_type) :: state, trial
      type(status_type) :: status
      real(wp) :: estimate(3, 2), missed(3), h, slope
      character(len=80) :: words
      integer :: p, q, k, i
      sys%n = 3
      do p = 4, 5
         do q = 4, 5
            stepper%p = p
            stepper%q = q
            stepper%alpha = merge(0.5_wp, 0.44_wp, p == q)
            do k = 1, 2
               call stepper%init(sys, status)
               state%t = 0.3_wp
               state%y = [sin(0.3_wp), cos(0.3_wp), sin(0.3_wp)]
               call stepper%start(sys, state, status)
               trial = state
               h = 0.2_wp/k
               call stepper%try_step(sys, state, h, 0.3_wp + h, trial, status)
               call stepper%estimate_error(estimate(:, k))
               missed = abs(trial%y - [sin(0.3_wp + h), cos(0.3_wp + h), sin(0.3_wp + h)])
               call check(error, .not. status%failed(), status%message)
               call check(error, all(abs(estimate(:, k)) >= missed), 'no error is overlooked')
            end do
            do i = 1, 3
               slope = log(abs(estimate(i, 1)/estimate(i, 2)))/log(2.0_wp)
               write (words, '("orders ", i1, i2, ", component ", i1, ": ", f6.3)') p, q, i, slope
               call check(error, slope > 3.7_wp .and. slope < 5.3_wp, words)
            end do
         end do
      end do
   end subroutine test_plain_estimates

   !> A symmetric method goes back to where it came from, to the rounding errors of the iteration
   subroutine test_symmetry(error)
      type(error_type), allocatable, intent(out) :: error
      type(log_pair) :: sys
      type(cart) :: mechanics
      type(backinterpolation_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: y(2), z(4)
      integer :: p
      sys%n = 2
      call make_cart(mechanics)
      do p = 1, 5
         stepper%p = p
         stepper%q = p
         y = log_pair_exact(1.0_wp)
         call run(stepper, sys, 1.0_wp, 0.1_wp, 5, y, status)
         call run(stepper, sys, 1.5_wp, -0.1_wp, 5, y, status)
         call check(error, maxval(abs(y - log_pair_exact(1.0_wp))), 0.0_wp, 'first order', thr=100*eps)
         z = [0.5_wp, 1.0_wp, 0.0_wp, -1.0_wp]
         call run(stepper, mechanics, 0.0_wp, 0.1_wp, 5, z, status)
         call run(stepper, mechanics, 0.5_wp, -0.1_wp, 5, z, status)
         call check(error, maxval(abs(z - [0.5_wp, 1.0_wp, 0.0_wp, -1.0_wp])), 0.0_wp, 'mechanics', thr=100*eps)
         call check(error, .not. status%failed(), status%message)
      end do
   end subroutine test_symmetry

   !> A symmetric base on a system of first order: orders 2, 4, 6
   subroutine test_extrapolation(error)
      type(error_type), allocatable, intent(out) :: error
      type(extrapolation_stepper) :: stepper
      type(backinterpolation_stepper) :: base
      type(log_pair) :: sys
      type(status_type) :: status
      real(wp) :: errors(2), y(2), slope
      integer :: k, levels
      sys%n = 2
      base%p = 1
      base%q = 1
      allocate (stepper%base, source=base)
      do levels = 1, 3
         stepper%levels = levels
         do k = 1, 2
            y = log_pair_exact(1.0_wp)
            call run(stepper, sys, 1.0_wp, 0.0625_wp/k, 8*k, y, status)
            errors(k) = maxval(abs(y - log_pair_exact(1.5_wp)))
         end do
         slope = log(errors(1)/errors(2))/log(2.0_wp)
         call check(error, slope, 2.0_wp*levels, 'order', thr=0.4_wp)
      end do
      call check(error, .not. status%failed(), status%message)
      base%q = 2
      deallocate (stepper%base)
      allocate (stepper%base, source=base)
      call stepper%init(sys, status)
      call check(error, status%code, dynstep_invalid_input, 'p /= q is not symmetric')
   end subroutine test_extrapolation

   !> y' = A y with eigenvalues -200, -1 +- 2i and h = 1: as R(hA) y says, in at most five iterations with a J by differences
   subroutine test_stiff_linear(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: parts(4) = [0.0_wp, 0.3_wp, 0.44_wp, 0.5_wp]
      type(stiff_linear) :: sys
      type(backinterpolation_stepper) :: stepper
      type(rational_type) :: r
      type(status_type) :: status
      real(wp) :: v(3, 3), y(3), c(3), expected(3)
      complex(wp) :: slow
      integer :: i, halves, steps
      ! columns of v: the stiff direction, real and imaginary part of the other
      v = reshape([1.0_wp, -0.5_wp, 0.25_wp, 0.3_wp, 1.0_wp, 0.5_wp, -0.2_wp, 0.4_wp, 1.0_wp], [3, 3])
      sys%n = 3
      do i = 1, 3
         y = 0.0_wp
         y(i) = 1.0_wp
         call solve_dense(v, y)
         sys%a(:, i) = matmul(v, [-200*y(1), -y(2) - 2*y(3), 2*y(2) - y(3)])
      end do
      do halves = halves_taylor, halves_fehlberg
         do i = 1, size(parts)
            stepper%alpha = parts(i)
            stepper%halves = halves
            call taylor_rational(merge(4, 0, parts(i) > 0.0_wp), 4, parts(i), r, status)
            if (halves == halves_fehlberg) call fehlberg_rational(parts(i), r, status)
            do steps = 1, 2
               sys%gives = steps == 2
               y = [1.0_wp, 0.5_wp, -0.25_wp]
               c = y
               call solve_dense(v, c)
               call run(stepper, sys, 0.0_wp, 1.0_wp, 1, y, status)
               slow = r%value(cmplx(-1.0_wp, 2.0_wp, wp))*cmplx(c(2), c(3), wp)
               expected = matmul(v, [real(r%value(cmplx(-200.0_wp, 0.0_wp, wp)), wp)*c(1), real(slow, wp), aimag(slow)])
               call check(error, .not. status%failed(), status%message)
               call check(error, int(stepper%count%newton_iterations) <= 5, 'iterations')
               call check(error, maxval(abs(y - expected)), 0.0_wp, 'R(hA) y', thr=1.0e-6_wp)
               if (sys%gives) call check(error, maxval(abs(y - expected)), 0.0_wp, 'with the exact J', thr=2000*eps)
            end do
         end do
      end do
   end subroutine test_stiff_linear

   !> A linear system is stepped without an iteration, to the same motion and the same estimate of the error
   subroutine test_linear_path(error)
      type(error_type), allocatable, intent(out) :: error
      type(stiff_linear) :: general
      type(linear_ode) :: linear
      type(backinterpolation_stepper) :: stepper
      type(state_type) :: state, trial
      type(status_type) :: status
      real(wp) :: y(3), z(3), estimates(3, 2)
      integer :: i, halves
      general%n = 3
      general%a = reshape([-1.0_wp, 0.5_wp, 0.25_wp, -4.0_wp, 0.0_wp, 0.5_wp, 0.0_wp, 1.0_wp, -2.0_wp], [3, 3])
      call linear%set(dense_matrix(general%a), status)
      do halves = halves_taylor, halves_fehlberg
         stepper%halves = halves
         do i = 1, size(alphas)
            stepper%alpha = alphas(i)
            y = [1.0_wp, 0.5_wp, -0.25_wp]
            z = y
            call run(stepper, general, 0.0_wp, 0.1_wp, 10, y, status)
            call run(stepper, linear, 0.0_wp, 0.1_wp, 10, z, status)
            call check(error, maxval(abs(y - z)), 0.0_wp, 'the motion', thr=100*eps)
            call check(error, int(stepper%count%newton_iterations), 0, 'iterations')
            state%t = 0.0_wp
            state%y = z
            call stepper%start(linear, state, status)
            trial = state
            call stepper%try_step(linear, state, 0.1_wp, 0.1_wp, trial, status)
            call stepper%estimate_error(estimates(:, 1))
            call stepper%init(general, status)
            call stepper%start(general, state, status)
            call stepper%try_step(general, state, 0.1_wp, 0.1_wp, trial, status)
            call stepper%estimate_error(estimates(:, 2))
            call check(error, maxval(abs(estimates(:, 1) - estimates(:, 2))), 0.0_wp, 'the estimate', thr=20*eps)
            call check(error, maxval(abs(estimates(:, 1))) > 1.0e-10_wp, 'there is an estimate')
         end do
      end do
      call check(error, .not. status%failed(), status%message)
   end subroutine test_linear_path

   !> p = q = 1: the trapezoid at alpha = 1/2, Euler's implicit formula at alpha = 0, of y' = -y^2: by their quadratic equations
   subroutine test_known_formulas(error)
      type(error_type), allocatable, intent(out) :: error
      type(reacting_chain) :: sys
      type(backinterpolation_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: y(1), u, h
      ! n = 1: y' = -2 d y + y (1 - y) cos t
      sys%n = 1
      sys%d = 0.25_wp
      stepper%p = 1
      stepper%q = 1
      h = 0.5_wp
      stepper%alpha = 0.0_wp
      y = [0.75_wp]
      call run(stepper, sys, 0.0_wp, h, 1, y, status)
      u = y(1)
      call check(error, u - h*(-0.5_wp*u + u*(1 - u)*cos(h)), 0.75_wp, 'Euler', thr=4*eps)
      stepper%alpha = 0.5_wp
      y = [0.75_wp]
      call run(stepper, sys, 0.0_wp, h, 1, y, status)
      u = y(1)
      call check(error, u - 0.5_wp*h*(-0.5_wp*u + u*(1 - u)*cos(h)), 0.75_wp + 0.5_wp*h*(-0.375_wp + 0.1875_wp), 'trapezoid', &
         & thr=4*eps)
      call check(error, .not. status%failed(), status%message)
   end subroutine test_known_formulas

   !> A banded J gives what a dense one gives, and a wrong (diagonal) one too, with more iterations
   subroutine test_jacobians(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 14
      type(reacting_chain) :: sys
      type(backinterpolation_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: start(n), banded(n), dense(n), diagonal(n)
      integer :: i, counts(3)
      sys%n = n
      start = [(sin(0.4_wp*i)**2, i=1, n)]
      dense = start
      call run(stepper, sys, 0.0_wp, 0.05_wp, 10, dense, status)
      counts(1) = int(stepper%count%forces)
      sys%jacobian_kind = kind_banded
      sys%jacobian_kl = 1
      sys%jacobian_ku = 1
      banded = start
      call run(stepper, sys, 0.0_wp, 0.05_wp, 10, banded, status)
      counts(2) = int(stepper%count%forces)
      sys%d = 2.0_wp
      sys%jacobian_kind = kind_dense
      diagonal = start
      call run(stepper, sys, 0.0_wp, 0.05_wp, 10, diagonal, status)
      start = diagonal - start
      sys%jacobian_kind = kind_diagonal
      diagonal = [(sin(0.4_wp*i)**2, i=1, n)]
      start = start + diagonal
      call run(stepper, sys, 0.0_wp, 0.05_wp, 10, diagonal, status)
      call check(error, .not. status%failed(), status%message)
      call check(error, maxval(abs(banded - dense)), 0.0_wp, 'banded and dense', thr=200*eps)
      call check(error, counts(2) < counts(1), 'a band costs fewer evaluations')
      call check(error, maxval(abs(diagonal - start)), 0.0_wp, 'an approximate J', thr=1000*eps)
   end subroutine test_jacobians

   !> M q'' = f, and the same as a system of first order
   subroutine test_first_order_form(error)
      type(error_type), allocatable, intent(out) :: error
      type(cart) :: sys
      type(as_first_order) :: other
      type(backinterpolation_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: y(4), z(4)
      integer :: i
      call make_cart(sys)
      call make_cart(other%inner)
      other%n = 4
      do i = 1, size(alphas)
         stepper%alpha = alphas(i)
         y = [0.5_wp, 1.0_wp, 0.0_wp, -1.0_wp]
         z = y
         call run(stepper, sys, 0.0_wp, 0.05_wp, 20, y, status)
         call run(stepper, other, 0.0_wp, 0.05_wp, 20, z, status)
         call check(error, .not. status%failed(), status%message)
         call check(error, maxval(abs(y - z)), 0.0_wp, 'the same motion', thr=200*eps)
      end do
   end subroutine test_first_order_form

   !> Nothing happens suddenly near alpha = 0 and 1/2
   subroutine test_near_special(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: distances(3) = [1.0e-3_wp, 1.0e-7_wp, 1.0e-13_wp]
      type(log_pair) :: sys
      type(backinterpolation_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: y(2), at(2, 3)
      integer :: i
      sys%n = 2
      at = spread(log_pair_exact(1.0_wp), 2, 3)
      stepper%alpha = 0.0_wp
      call run(stepper, sys, 1.0_wp, 0.1_wp, 3, at(:, 1), status)
      stepper%alpha = 0.5_wp
      call run(stepper, sys, 1.0_wp, 0.1_wp, 3, at(:, 2), status)
      stepper%alpha = 1.0_wp
      call run(stepper, sys, 1.0_wp, 0.1_wp, 3, at(:, 3), status)
      do i = 1, size(distances)
         call near(distances(i), at(:, 1))
         call near(0.5_wp - distances(i), at(:, 2))
         call near(0.5_wp + distances(i), at(:, 2))
         call near(1.0_wp - distances(i), at(:, 3))
      end do
      call check(error, .not. status%failed(), status%message)

   contains

      subroutine near(alpha, expected)
         real(wp), intent(in) :: alpha, expected(2)
         stepper%alpha = alpha
         y = log_pair_exact(1.0_wp)
         call run(stepper, sys, 1.0_wp, 0.1_wp, 3, y, status)
         call check(error, maxval(abs(y - expected)), 0.0_wp, 'near', thr=0.01_wp*distances(i) + 20*eps)
      end subroutine near
   end subroutine test_near_special

   !> Stiff nonlinear problems at steps that are too long end with words on what to do; at shorter ones the steps are good
   subroutine test_limits(error)
      type(error_type), allocatable, intent(out) :: error
      type(van_der_pol) :: oscillator
      type(robertson) :: reactions
      type(backinterpolation_stepper) :: stepper, low
      type(status_type) :: status
      real(wp) :: y(2), z(3)
      integer :: k
      oscillator%n = 2
      reactions%n = 3
      low%p = 1
      low%q = 1
      ! h |J| = 3000 h: the smooth phase
      y = [2.0_wp, -2.0_wp/3000]
      call run(stepper, oscillator, 0.0_wp, 0.1_wp, 20, y, status)
      call check(error, .not. status%failed(), status%message)
      ! -y y'/mu = y^2 - 1 there: log y - y^2/2 grows by t/mu
      call check(error, log(y(1)) - 0.5_wp*y(1)**2, log(2.0_wp) - 2.0_wp + 0.002_wp, 'the smooth phase', thr=2.0e-6_wp)
      do k = 1, 3
         y = [2.0_wp, -2.0_wp/3000]
         call run(stepper, oscillator, 0.0_wp, 10.0_wp**k, 20, y, status)
         call refused('van der Pol')
      end do
      y = [2.0_wp, -2.0_wp/3000]
      call run(low, oscillator, 0.0_wp, 10.0_wp, 20, y, status)
      call check(error, .not. status%failed(), 'p = q = 1 bears more: '//status%message)
      z = [1.0_wp, 0.0_wp, 0.0_wp]
      call run(stepper, reactions, 0.0_wp, 1.0e-3_wp, 400, z, status)
      call check(error, .not. status%failed(), status%message)
      ! the reference by a stage method to 1e-12
      call check(error, z(1), 0.9851721138_wp, 'Robertson at t = 0.4', thr=1.0e-9_wp)
      do k = -1, 3
         z = [1.0_wp, 0.0_wp, 0.0_wp]
         call run(stepper, reactions, 0.0_wp, 10.0_wp**k, 20, z, status)
         call refused('Robertson')
         call check(error, all(abs(z - [1.0_wp, 0.0_wp, 0.0_wp]) <= 0.0_wp), 'the state')
      end do

   contains

      subroutine refused(name)
         character(len=*), intent(in) :: name
         call check(error, status%failed() .and. status%retry, name//': a smaller step may help')
         call check(error, index(status%message, 'p = q = 1') > 0 .or. index(status%message, 'smaller step') > 0, &
            & name//': '//status%message)
         call status%clear()
      end subroutine refused
   end subroutine test_limits

   !> A fault in each call of rhs, and of jacobian: a failed step leaves the state as it was, and says whether to retry; one
   !> refusal in the iteration is got over
   subroutine test_faults(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: answers(3) = [0, 4, -4]
      type(log_pair) :: sys
      type(backinterpolation_stepper) :: stepper
      type(state_type) :: state, before, trial
      type(status_type) :: status
      integer :: call_number, i, j, started, most, survived
      logical :: recovers
      do j = 1, 2
         recovers = j == 2
         survived = 0
         do i = 1, size(answers)
            most = huge(most)
            call_number = 1
            do while (call_number <= most)
               sys = log_pair()
               sys%n = 2
               call status%clear()
               call stepper%init(sys, status)
               state%t = 1.0_wp
               state%y = log_pair_exact(1.0_wp)
               call stepper%start(sys, state, status)
               before = state
               trial = state
               started = sys%calls
               sys%fault_at = started + call_number
               sys%answer = answers(i)
               sys%recovers = recovers
               call stepper%try_step(sys, state, 0.3_wp, 1.3_wp, trial, status)
               if (sys%calls < sys%fault_at) then
                  most = call_number - 1            ! no more calls than that
                  call check(error, .not. status%failed(), status%message)
                  call check(error, call_number > 20, 'there were calls')
               else if (recovers .and. .not. status%failed()) then
                  survived = survived + 1
                  call check(error, answers(i) >= 0, 'who gives up gives up')
                  call check(error, maxval(abs(trial%y - log_pair_exact(1.3_wp))), 0.0_wp, 'after a refusal', thr=2.0e-3_wp)
               else
                  call check(error, status%code, merge(dynstep_not_finite, dynstep_callback_failed, answers(i) == 0), &
                     & status%message)
                  call check(error, status%retry .eqv. answers(i) >= 0, 'retry: '//status%message)
               end if
               call check(error, all(abs(state%y - before%y) <= 0.0_wp) .and. all(abs(state%a - before%a) <= 0.0_wp), 'the state')
               call_number = call_number + 1
            end do
         end do
         if (recovers) call check(error, survived > 10, 'iterations get over a refusal')
      end do
      do i = 1, size(answers)
         sys = log_pair()
         sys%n = 2
         call status%clear()
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         sys%jacobian_fault = 1
         sys%answer = answers(i)
         call stepper%try_step(sys, state, 0.3_wp, 1.3_wp, trial, status)
         call check(error, status%code, merge(dynstep_not_finite, dynstep_callback_failed, answers(i) == 0), status%message)
         call check(error, index(status%message, 'jacobian') > 0, status%message)
      end do
   end subroutine test_faults

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(log_pair) :: sys
      type(cart) :: on_a_rail
      type(backinterpolation_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      sys%n = 2
      call refused('p = 0', p=0)
      call refused('p = 6', p=6)
      call refused('q = 0', q=0)
      call refused('q = 6', q=6)
      call refused('alpha = 1.25', alpha=1.25_wp)
      call refused('alpha = -0.25', alpha=-0.25_wp)
      call refused('alpha = NaN', alpha=ieee_value(1.0_wp, ieee_quiet_nan))
      call refused('halves = 3', halves=3)
      call refused('jacobian_kind', kind=kind_zero)
      call refused('jacobian_kl', kind=kind_banded, kl=2)
      call make_cart(on_a_rail)
      on_a_rail%holonomic = 1
      call stepper%init(on_a_rail, status)
      call check(error, status%code, dynstep_invalid_input)
      call check(error, index(status%message, 'choose soi2') > 0, status%message)
      ! what is not read is not checked
      call status%clear()
      stepper = backinterpolation_stepper(p=9, alpha=0.0_wp)
      call stepper%init(sys, status)
      stepper = backinterpolation_stepper(q=9, alpha=1.0_wp)
      call stepper%init(sys, status)
      stepper = backinterpolation_stepper(p=9, q=9, halves=halves_fehlberg)
      call stepper%init(sys, status)
      call check(error, .not. status%failed(), status%message)
      stepper = backinterpolation_stepper()
      call stepper%init(sys, status)
      state%y = log_pair_exact(1.0_wp)
      stepper%q = 5
      call stepper%start(sys, state, status)
      call check(error, status%code, dynstep_invalid_input)
      call check(error, index(status%message, 'call init again') > 0, status%message)

   contains

      subroutine refused(words, p, q, alpha, halves, kind, kl)
         character(len=*), intent(in) :: words
         integer, intent(in), optional :: p, q, halves, kind, kl
         real(wp), intent(in), optional :: alpha
         type(backinterpolation_stepper) :: wrong
         type(log_pair) :: system
         if (present(p)) wrong%p = p
         if (present(q)) wrong%q = q
         if (present(alpha)) wrong%alpha = alpha
         if (present(halves)) wrong%halves = halves
         system%n = 2
         if (present(kind)) system%jacobian_kind = kind
         if (present(kl)) system%jacobian_kl = kl
         call status%clear()
         call wrong%init(system, status)
         call check(error, status%code, dynstep_invalid_input, words)
         call check(error, index(status%message, words) > 0, status%message)
         call status%clear()
      end subroutine refused
   end subroutine test_refusals

   !> A copy in the middle of a run goes on with the same bits
   subroutine test_copies(error)
      type(error_type), allocatable, intent(out) :: error
      type(cart) :: sys
      type(backinterpolation_stepper) :: stepper
      class(stepper_type), allocatable :: copy
      type(state_type) :: state, other
      type(clock_type) :: clock, clock2
      type(status_type) :: status
      integer :: i
      call make_cart(sys)
      do i = 1, size(alphas)
         stepper%alpha = alphas(i)
         call stepper%init(sys, status)
         state%t = 0.0_wp
         state%y = [0.5_wp, 1.0_wp, 0.0_wp, -1.0_wp]
         call stepper%start(sys, state, status)
         clock = clock_type(h=0.07_wp, k=0)
         call stepper%advance(sys, state, clock, 13, status, complete=.true.)
         if (allocated(copy)) deallocate (copy)
         allocate (copy, source=stepper)
         other = state
         clock2 = clock
         call stepper%advance(sys, state, clock, 13, status, complete=.true.)
         call copy%advance(sys, other, clock2, 13, status, complete=.true.)
         call check(error, .not. status%failed(), status%message)
         call check(error, all(abs(state%y - other%y) <= 0.0_wp) .and. all(abs(state%a - other%a) <= 0.0_wp), 'the bits')
      end do
   end subroutine test_copies

   !> Of the imaginary axis: what is known of explicit formulas, the window of (4,5), symmetric ones
   subroutine test_stability_limit(error)
      type(error_type), allocatable, intent(out) :: error
      call expect(4, 4, 1.0_wp, 2*sqrt(2.0_wp))
      call expect(3, 3, 1.0_wp, sqrt(3.0_wp))
      call expect(2, 2, 1.0_wp, 0.0_wp)
      call expect(1, 1, 1.0_wp, 0.0_wp)
      call expect(1, 1, 0.0_wp, huge(1.0_wp))
      call expect(2, 2, 0.0_wp, huge(1.0_wp))
      call expect(4, 5, 0.44_wp, huge(1.0_wp))
      call expect(4, 4, 0.5_wp, huge(1.0_wp))
      call expect(5, 5, 0.5_wp, huge(1.0_wp))

   contains

      subroutine expect(p, q, alpha, limit)
         integer, intent(in) :: p, q
         real(wp), intent(in) :: alpha, limit
         type(backinterpolation_stepper) :: stepper
         type(method_properties) :: facts
         stepper%p = p
         stepper%q = q
         stepper%alpha = alpha
         facts = stepper%properties()
         call check(error, facts%stability_limit, limit, 'limit', thr=1.0e-10_wp)
      end subroutine expect
   end subroutine test_stability_limit

   !> Counters are those of the calls; J is kept; an explicit step asks for no J
   subroutine test_work(error)
      type(error_type), allocatable, intent(out) :: error
      type(log_pair) :: sys
      type(backinterpolation_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: y(2)
      integer :: i
      do i = 1, size(alphas)
         sys = log_pair()
         sys%n = 2
         stepper%alpha = alphas(i)
         y = log_pair_exact(1.0_wp)
         call run(stepper, sys, 1.0_wp, 0.01_wp, 50, y, status)
         associate (c => stepper%count)
            call check(error, int(c%forces), sys%calls, 'forces')
            call check(error, int(c%tangents), sys%jacobians, 'tangents')
            call check(error, int(c%steps), 50, 'steps')
            if (alphas(i) < 1.0_wp) then
               call check(error, int(c%factorizations), 2*sys%jacobians, 'one for each pair of poles')
               call check(error, sys%jacobians <= 3, 'J is kept')
               call check(error, c%newton_iterations <= 4*50, 'iterations')
               call check(error, c%solves >= 2*c%newton_iterations, 'solves')
            else
               call check(error, int(c%forces), 4*50 + 1, 'four stages, of which the first is known, and the end')
               call check(error, sys%jacobians, 0, 'explicit')
            end if
         end associate
      end do
   end subroutine test_work

   !> A tolerance ends the iteration earlier, with an error of its size
   subroutine test_tolerance(error)
      type(error_type), allocatable, intent(out) :: error
      type(log_pair) :: sys
      type(backinterpolation_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: exact(2), y(2)
      integer :: most, k
      sys%n = 2
      exact = log_pair_exact(1.0_wp)
      call run(stepper, sys, 1.0_wp, 0.1_wp, 5, exact, status)
      most = int(stepper%count%newton_iterations)
      do k = 4, 10, 3
         stepper%newton%tolerance = 10.0_wp**(-k)
         y = log_pair_exact(1.0_wp)
         call run(stepper, sys, 1.0_wp, 0.1_wp, 5, y, status)
         call check(error, int(stepper%count%newton_iterations) < most, 'fewer iterations')
         call check(error, maxval(abs(y - exact)), 0.0_wp, 'the error', thr=20*10.0_wp**(-k))
      end do
      call check(error, .not. status%failed(), status%message)
   end subroutine test_tolerance

   recursive subroutine spring_force(self, t, q, v, f, ierr)
      class(spring), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -q + 0.0_wp*v
      if (t < -1.0_wp) ierr = 1
   end subroutine spring_force

   !> From rest, h |y'| may be lost in the rounding of y: the velocity is h y' to the accuracy of the iteration
   subroutine test_short_steps(error)
      type(error_type), allocatable, intent(out) :: error
      character(len=16), parameter :: names(3) = [character(len=16) :: 'bi', 'bi45', 'bi-extrapolation']
      class(stepper_type), allocatable :: stepper
      type(spring) :: sys
      type(state_type) :: state, trial
      type(status_type) :: status
      real(wp) :: h
      integer :: i, k
      sys%n = 1
      do i = 1, size(names)
         do k = 6, 60, 6
            h = 10.0_wp**(-k)
            call new_method(trim(names(i)), stepper, status)
            call stepper%init(sys, status)
            call allocate_state(sys, state, status)
            call allocate_state(sys, trial, status)
            state%y = [1.0_wp, 0.0_wp]
            call stepper%start(sys, state, status)
            call stepper%try_step(sys, state, h, h, trial, status)
            call check(error, .not. status%failed(), trim(names(i))//': '//trim(status%message))
            if (status%failed()) return
            call check(error, trial%y(1), 1.0_wp, thr=1.0e-12_wp)
            call check(error, trial%y(2)/h, -1.0_wp, thr=1.0e-9_wp)
         end do
      end do
   end subroutine test_short_steps
end module test_backinterpolation
