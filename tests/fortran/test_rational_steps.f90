! SPDX-License-Identifier: BSD-3-Clause
!> Steps y1 = R(hA) y of linear systems: orders with forcing, stiff and not, the same answer in other forms, extremes, long
!> runs, failures, work.
module test_rational_steps
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep, only: allocate_state, banded_matrix, clock_type, dense_matrix, diagonal_matrix, dynstep_callback_failed, &
      & dynstep_invalid_input, dynstep_not_finite, dynstep_singular_matrix, fehlberg_rational, form_automatic, form_parallel, &
      & form_product, form_refined, identity_matrix, kind_banded, kind_dense, linear_ode, linear_system, load_none, &
      & load_procedure, matrix_type, method_properties, ode_system, pade_rational, pade_stepper, rational_type, state_type, &
      & status_type, taylor_rational, wp, zero_matrix
   use dynstep_rational_stepper, only: rational_stepper
   use random_matrices, only: full, random, random_matrix
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_rational_steps

   real(wp), parameter :: eps = epsilon(1.0_wp)

   !> Any R(z)
   type, extends(rational_stepper) :: any_stepper
      type(rational_type) :: r
      integer :: form = form_automatic
   contains
      procedure :: properties => any_properties
      procedure :: init => any_init
   end type any_stepper

   !> M q'' + C q' + K q = p with the solution q_i = cos(w_i t + i)
   type, extends(linear_system) :: forced_system
      real(wp), allocatable :: w(:)
      real(wp) :: bad_time = huge(1.0_wp)     !! the load fails from here on
      integer :: ierr = 0                     !! with this code, or with a NaN where it is 0
   contains
      procedure :: load => forced_load
      procedure :: solution => forced_solution
   end type forced_system

   !> y' = A y + b with the solution y_i = cos(w_i t + i)
   type, extends(linear_ode) :: forced_ode
      real(wp), allocatable :: w(:)
      real(wp) :: bad_time = huge(1.0_wp)
      integer :: ierr = 0
   contains
      procedure :: source => forced_source
   end type forced_ode

   !> A constant load
   type, extends(linear_system) :: preloaded_system
      real(wp) :: p(2) = 0.0_wp
   contains
      procedure :: load => preload
   end type preloaded_system

contains

   recursive subroutine preload(self, t, p, ierr)
      class(preloaded_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      p = self%p
   end subroutine preload

   subroutine collect_rational_steps(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('orders-of-taylor', test_taylor_orders), &
         & new_unittest('orders-of-pade', test_pade_orders), &
         & new_unittest('orders-of-sources', test_source_orders), &
         & new_unittest('prothero-robinson', test_prothero_robinson), &
         & new_unittest('stiff-and-forced', test_stiff_forced), &
         & new_unittest('banded-dense-first-order', test_forms), &
         & new_unittest('coupling', test_coupling), &
         & new_unittest('kinds-and-sizes', test_sizes), &
         & new_unittest('amplitude-of-oscillators', test_amplitude), &
         & new_unittest('slow-mode-of-stiff', test_slow_mode), &
         & new_unittest('alpha-next-to-its-ends', test_alpha), &
         & new_unittest('energy-of-a-chain', test_energy), &
         & new_unittest('many-unknowns', test_many), &
         & new_unittest('pole-on-the-spectrum', test_pole), &
         & new_unittest('rigid-mode', test_rigid), &
         & new_unittest('stiff-equilibrium', test_equilibrium), &
         & new_unittest('bad-loads', test_bad_loads), &
         & new_unittest('refusals', test_refusals), &
         & new_unittest('changes-after-init', test_changes), &
         & new_unittest('work', test_work)]
   end subroutine collect_rational_steps

   recursive function any_properties(self) result(facts)
      class(any_stepper), intent(in) :: self
      type(method_properties) :: facts
      facts%name = 'any'
      facts%order = self%r%order
      facts%linear = .true.
   end function any_properties

   recursive subroutine any_init(self, sys, status)
      class(any_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      call self%init_rational(sys, self%r, self%form, status)
   end subroutine any_init

   subroutine forced_solution(self, t, q, v, a)
      class(forced_system), intent(in) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      integer :: i
      do i = 1, self%n
         q(i) = cos(self%w(i)*t + i)
         v(i) = -self%w(i)*sin(self%w(i)*t + i)
         a(i) = -self%w(i)**2*cos(self%w(i)*t + i)
      end do
   end subroutine forced_solution

   recursive subroutine forced_load(self, t, p, ierr)
      class(forced_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      real(wp) :: q(self%n), v(self%n), a(self%n)
      call self%solution(t, q, v, a)
      p = 0
      call self%m%multiply_add(1.0_wp, a, p)
      call self%c%multiply_add(1.0_wp, v, p)
      call self%k%multiply_add(1.0_wp, q, p)
      if (self%structure%is_coupled) p = p + self%coupling%b*(dot_product(self%coupling%k, q) &
         & + dot_product(self%coupling%c, v))
      ierr = 0
      if (t < self%bad_time) return
      ierr = self%ierr
      if (ierr == 0) p(self%n) = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine forced_load

   recursive subroutine forced_source(self, t, b, ierr)
      class(forced_ode), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: b(self%n)
      integer, intent(out) :: ierr
      real(wp) :: y(self%n)
      integer :: i
      do i = 1, self%n
         y(i) = cos(self%w(i)*t + i)
         b(i) = -self%w(i)*sin(self%w(i)*t + i)
      end do
      call self%a%multiply_add(-1.0_wp, y, b)
      ierr = 0
      if (t < self%bad_time) return
      ierr = self%ierr
      if (ierr == 0) b(self%n) = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine forced_source

   !> Three masses, C and K unsymmetric
   subroutine small_system(sys)
      type(forced_system), intent(out) :: sys
      type(status_type) :: status
      real(wp) :: c(3, 3), k(3, 3)
      c = reshape([0.3_wp, 0.2_wp, 0.0_wp, -0.1_wp, 0.4_wp, 0.1_wp, 0.1_wp, -0.2_wp, 0.2_wp], [3, 3])
      k = reshape([3.0_wp, -1.0_wp, 0.2_wp, -1.2_wp, 2.0_wp, -0.8_wp, 0.0_wp, -1.0_wp, 2.5_wp], [3, 3])
      call sys%set(diagonal_matrix([1.0_wp, 1.5_wp, 0.8_wp]), dense_matrix(c, .false.), dense_matrix(k, .false.), status)
      sys%w = [1.0_wp, 1.4_wp, 0.7_wp]
      sys%load_kind = load_procedure
   end subroutine small_system

   subroutine small_ode(sys)
      type(forced_ode), intent(out) :: sys
      type(status_type) :: status
      real(wp) :: a(4, 4)
      a = reshape([-0.5_wp, 0.2_wp, 0.1_wp, 0.0_wp, -1.1_wp, -0.3_wp, 0.0_wp, 0.4_wp, 0.2_wp, 0.1_wp, -1.0_wp, 0.5_wp, &
         & 0.0_wp, -0.2_wp, 1.2_wp, -0.4_wp], [4, 4])
      call sys%set(dense_matrix(a, .false.), status)
      sys%w = [1.0_wp, 1.3_wp, 0.6_wp, 0.9_wp]
      sys%source_kind = load_procedure
   end subroutine small_ode

   !> Error at t = end after `steps` steps from the solution at 0, in the largest component
   real(wp) function error_of(stepper, sys, end, steps)
      class(rational_stepper), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: end
      integer, intent(in) :: steps
      type(status_type) :: status
      type(state_type) :: state
      real(wp), allocatable :: exact(:)
      call allocate_state(sys, state, status)
      call solution_of(sys, 0.0_wp, state%y)
      call go(stepper, sys, end/steps, steps, state, status)
      exact = state%y
      call solution_of(sys, end, exact)
      error_of = huge(1.0_wp)
      if (.not. status%failed()) error_of = maxval(abs(state%y - exact))
   end function error_of

   subroutine solution_of(sys, t, y)
      class(ode_system), intent(in) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(inout) :: y(:)
      real(wp) :: a(size(y))
      integer :: i
      select type (sys)
      class is (forced_system)
         call sys%solution(t, y(:sys%n), y(sys%n + 1:), a(:sys%n))
      class is (forced_ode)
         y = [(cos(sys%w(i)*t + i), i=1, sys%n)]
      end select
   end subroutine solution_of

   !> init, start, steps of length h from state%t = 0
   subroutine go(stepper, sys, h, steps, state, status)
      class(rational_stepper), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: h
      integer, intent(in) :: steps
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      type(clock_type) :: clock
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      clock%h = h
      call stepper%advance(sys, state, clock, steps, status, .true.)
   end subroutine go

   !> Order over the last halving whose error is above rounding
   real(wp) function order_of(stepper, sys, end, floor)
      class(rational_stepper), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: end, floor
      real(wp) :: coarse, fine
      integer :: k
      order_of = 0
      coarse = error_of(stepper, sys, end, 2)
      do k = 2, 7
         fine = error_of(stepper, sys, end, 2**k)
         if (fine < floor .and. order_of > 0) return
         order_of = log(coarse/fine)/log(2.0_wp)
         coarse = fine
      end do
   end function order_of

   subroutine check_order(error, stepper, sys, end, what, floor)
      type(error_type), allocatable, intent(inout) :: error
      type(any_stepper), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: end
      character(len=*), intent(in) :: what
      real(wp), intent(in), optional :: floor         !! of rounding, default 2e-12
      real(wp) :: measured, lowest
      character(len=100) :: words
      lowest = 2.0e-12_wp
      if (present(floor)) lowest = floor
      measured = order_of(stepper, sys, end, lowest)
      if (abs(measured - stepper%r%order) < 0.4_wp) return
      ! where p < q and alpha is small, the term of the lower order is too small to be seen, and so the other way round
      if (what == 'BI' .and. measured > stepper%r%order .and. measured < max(stepper%r%p, stepper%r%q) + 0.4_wp) return
      write (words, '(a, " (", i0, ",", i0, "), form ", i0, ", to t = ", f4.1, ": order ", f6.2, ", not ", i0)') what, &
         & stepper%r%p, stepper%r%q, stepper%form, end, measured, stepper%r%order
      call test_failed(error, trim(words))
   end subroutine check_order

   !> Every member of backinterpolation: also those with explicit factors, at the ends of alpha or where p > q
   subroutine test_taylor_orders(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_system) :: sys
      type(any_stepper) :: stepper
      type(status_type) :: status
      real(wp), parameter :: alphas(7) = [0.0_wp, 0.1_wp, 0.3_wp, 0.44_wp, 0.47_wp, 0.5_wp, 1.0_wp]
      integer :: i, p, q
      call small_system(sys)
      do p = 0, 6
         do q = 0, 6
            do i = 1, size(alphas)
               call taylor_rational(p, q, alphas(i), stepper%r, status)
               if (stepper%r%order == 0) cycle
               call check_order(error, stepper, sys, 1.0_wp, 'BI')
               call check_order(error, stepper, sys, -1.0_wp, 'BI')
            end do
         end do
      end do
      do i = 1, size(alphas)
         call fehlberg_rational(alphas(i), stepper%r, status)
         call check_order(error, stepper, sys, 1.0_wp, 'Fehlberg')
         call check_order(error, stepper, sys, -1.0_wp, 'Fehlberg')
      end do
   end subroutine test_taylor_orders

   !> All of order up to 8, which double precision shows (test_rational_orders has the others), in each form
   subroutine test_pade_orders(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_system) :: sys
      type(any_stepper) :: stepper
      type(status_type) :: status
      integer :: p, q
      call small_system(sys)
      do p = 0, 8
         do q = 0, 8 - p
            if (p + q == 0) cycle
            call pade_rational(p, q, stepper%r, status)
            do while (stepper%form <= form_refined)
               if (p <= q .or. stepper%form /= form_parallel) then
                  call check_order(error, stepper, sys, 2.0_wp, 'Pade')
                  call check_order(error, stepper, sys, -2.0_wp, 'Pade')
               end if
               stepper%form = stepper%form + 1
            end do
            stepper%form = form_automatic
         end do
      end do
   end subroutine test_pade_orders

   subroutine test_source_orders(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_ode) :: sys
      type(any_stepper) :: stepper
      type(status_type) :: status
      integer :: p, q
      call small_ode(sys)
      do p = 0, 6
         do q = 0, 6
            stepper%form = mod(p + q, 4)
            if (stepper%form == form_parallel .and. p > q) stepper%form = form_refined
            if (p + q > 0 .and. p + q <= 8) then
               call pade_rational(p, q, stepper%r, status)
               call check_order(error, stepper, sys, 2.0_wp, 'Pade')
               call check_order(error, stepper, sys, -2.0_wp, 'Pade')
            end if
            call taylor_rational(p, q, 0.44_wp, stepper%r, status)
            if (stepper%r%order == 0) cycle
            call check_order(error, stepper, sys, 1.0_wp, 'BI')
            call check_order(error, stepper, sys, -1.0_wp, 'BI')
         end do
      end do
   end subroutine test_source_orders

   !> y' = lambda (y - cos(t + 1)) - sin(t + 1), from lambda = -1e3 to -1e12: the errors of stages at Gauss's nodes would lose half
   !> the order here; with strictly accurate weights the error is at most that of lambda = 0: of size h^(order - 1)/|lambda|,
   !> where |h lambda| > 1
   subroutine test_prothero_robinson(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_ode) :: sys
      type(any_stepper) :: stepper
      type(status_type) :: status
      integer :: k
      do k = 3, 12, 3
         call sys%set(diagonal_matrix([-10.0_wp**k]), status)
         sys%w = [1.0_wp]
         sys%source_kind = load_procedure
         call pade_rational(0, 1, stepper%r, status)
         call check_stiff(error, stepper, sys, 1, 10.0_wp**(-k))
         call pade_rational(0, 2, stepper%r, status)
         call check_stiff(error, stepper, sys, 2, 10.0_wp**(-k))
         call pade_rational(1, 2, stepper%r, status)
         call check_stiff(error, stepper, sys, 3, 10.0_wp**(-k))
         call taylor_rational(4, 5, 0.44_wp, stepper%r, status)
         call check_stiff(error, stepper, sys, 4, 10.0_wp**(-k))
         call pade_rational(3, 4, stepper%r, status)
         call check(error, error_of(stepper, sys, 1.0_wp, 4), 0.0_wp, 'Pade(3,4), 4 steps', &
            & thr=1.0e-14_wp + 4.0e-10_wp*10.0_wp**(-k))
         call pade_rational(4, 4, stepper%r, status)
         call check(error, error_of(stepper, sys, 1.0_wp, 4), 0.0_wp, 'Pade(4,4), 4 steps', &
            & thr=1.0e-14_wp + 4.0e-10_wp*10.0_wp**(-k))
      end do
   end subroutine test_prothero_robinson

   !> Error at most h^(order - 1)/|lambda|/4, with 4 to 64 steps, or 1e-14
   subroutine check_stiff(error, stepper, sys, order, size)
      type(error_type), allocatable, intent(inout) :: error
      type(any_stepper), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      integer, intent(in) :: order
      real(wp), intent(in) :: size
      real(wp) :: h, e
      character(len=80) :: words
      integer :: k
      do k = 2, 6
         h = 0.5_wp**k
         e = error_of(stepper, sys, 1.0_wp, 2**k)
         if (e <= 0.25_wp*size*h**(order - 1) + 1.0e-14_wp) cycle
         write (words, '("(", i0, ",", i0, "), h ", es8.1, ": error ", es8.1, " above ", es8.1)') stepper%r%p, stepper%r%q, h, e, &
            & 0.25_wp*size*h**(order - 1)
         call test_failed(error, trim(words))
      end do
   end subroutine check_stiff

   !> Stiff springs and dampers between masses that are forced: order p + q still, where the slow motion shows it
   subroutine test_stiff_forced(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_system) :: sys
      type(any_stepper) :: stepper
      type(status_type) :: status
      real(wp), parameter :: link(3, 3) = reshape([1.0_wp, -1.0_wp, 0.0_wp, -1.0_wp, 2.0_wp, -1.0_wp, 0.0_wp, -1.0_wp, 1.0_wp], &
         & [3, 3])
      real(wp) :: k(3, 3)
      real(wp) :: floor
      integer :: i
      do i = 3, 6, 3
         k = 10.0_wp**i*link
         floor = 4.0e-15_wp*10.0_wp**i
         k(1, 1) = k(1, 1) + 2
         call sys%set(diagonal_matrix([1.0_wp, 1.5_wp, 0.8_wp]), dense_matrix(0.5_wp*10.0_wp**i*link, .true.), &
            & dense_matrix(k, .true.), status)
         sys%w = [1.0_wp, 1.4_wp, 0.7_wp]
         sys%load_kind = load_procedure
         call taylor_rational(2, 2, 0.0_wp, stepper%r, status)
         call check_order(error, stepper, sys, 1.0_wp, 'BI', floor)
         call taylor_rational(4, 5, 0.44_wp, stepper%r, status)
         call check_order(error, stepper, sys, 1.0_wp, 'BI', floor)
         call pade_rational(1, 2, stepper%r, status)
         call check_order(error, stepper, sys, 1.0_wp, 'Pade', floor)
         call pade_rational(2, 2, stepper%r, status)
         call check_order(error, stepper, sys, 1.0_wp, 'Pade', floor)
         call pade_rational(2, 3, stepper%r, status)
         call check_order(error, stepper, sys, 1.0_wp, 'Pade', floor)
         call pade_rational(3, 4, stepper%r, status)
         call check(error, error_of(stepper, sys, 1.0_wp, 8), 0.0_wp, 'Pade(3,4)', thr=5*floor)
      end do
   end subroutine test_stiff_forced

   !> Random damped systems in a band, in full, and as equations of first order: five steps, so that the matrix of a step is
   !> among them
   subroutine test_forms(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: sizes(4) = [6, 12, 20, 33]
      type(forced_system) :: banded, dense
      type(linear_ode) :: first
      type(any_stepper) :: stepper
      type(status_type) :: status
      type(matrix_type) :: c, k
      integer(int64) :: seed
      real(wp) :: d(33), a(66, 66)
      integer :: i, j, n, loaded
      seed = 4711
      do i = 1, size(sizes)
         n = sizes(i)
         c = random_matrix(seed, kind_banded, n, 2, 1, .false., 1.5_wp)
         k = random_matrix(seed, kind_banded, n, 1, 2, .false., 4.0_wp)
         d(:n) = [(1.5_wp + 0.5_wp*random(seed), j=1, n)]
         call banded%set(diagonal_matrix(d(:n)), c, k, status)
         call dense%set(dense_matrix(full(diagonal_matrix(d(:n))), .true.), dense_matrix(full(c), .false.), &
            & dense_matrix(full(k), .false.), status)
         a = 0
         do j = 1, n
            a(j, n + j) = 1
         end do
         a(n + 1:2*n, 1:n) = -full(k)/spread(d(:n), 2, n)
         a(n + 1:2*n, n + 1:2*n) = -full(c)/spread(d(:n), 2, n)
         call first%set(dense_matrix(a(:2*n, :2*n), .false.), status)
         banded%w = [(1 + 0.5_wp*random(seed), j=1, n)]
         dense%w = banded%w
         do loaded = 0, 1
            banded%load_kind = merge(load_procedure, load_none, loaded == 1)
            dense%load_kind = banded%load_kind
            call pade_rational(4, 4, stepper%r, status)
            call compare_all(0.3_wp)
            call compare_all(-0.3_wp)
            stepper%form = form_product
            call compare_all(2.0_wp)
            stepper%form = form_refined
            call compare_all(2.0_wp)
            stepper%form = form_automatic
            call taylor_rational(4, 5, 0.44_wp, stepper%r, status)
            call compare_all(1.0_wp)
            call pade_rational(3, 2, stepper%r, status)
            call compare_all(0.3_wp)
            call pade_rational(8, 8, stepper%r, status)
            call compare_all(1.0_wp)
         end do
      end do
   contains
      subroutine compare_all(h)
         real(wp), intent(in) :: h
         call compare(error, stepper, banded, dense, h, 1.0e-12_wp, 'band and full')
         if (banded%load_kind == load_none) call compare(error, stepper, banded, first, h, 1.0e-12_wp, 'second and first order')
      end subroutine compare_all
   end subroutine test_forms

   !> The same state after five steps in two systems, to a part of the largest number in it
   subroutine compare(error, stepper, one, other, h, tolerance, what)
      type(error_type), allocatable, intent(inout) :: error
      type(any_stepper), intent(inout) :: stepper
      class(ode_system), intent(inout) :: one, other
      real(wp), intent(in) :: h, tolerance
      character(len=*), intent(in) :: what
      type(state_type) :: x, y
      type(status_type) :: status
      character(len=100) :: words
      integer :: i
      call allocate_state(one, x, status)
      call allocate_state(other, y, status)
      x%y = [(sin(1.7_wp*i**2), i=1, size(x%y))]
      y%y = x%y
      call go(stepper, one, h, 5, x, status)
      call go(stepper, other, h, 5, y, status)
      if (.not. status%failed()) then
         if (maxval(abs(x%y - y%y)) <= tolerance*maxval(abs(x%y))) return
      end if
      write (words, '(a, ": n ", i0, ", (", i0, ",", i0, "), form ", i0, ", h ", f5.2, ": ", es9.2)') what, one%n, stepper%r%p, &
         & stepper%r%q, stepper%form, h, maxval(abs(x%y - y%y))/maxval(abs(x%y))
      call test_failed(error, trim(words), trim(status%message))
   end subroutine compare

   !> A coupling beside a band, and within full matrices
   subroutine test_coupling(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_system) :: beside, within
      type(any_stepper) :: stepper
      type(status_type) :: status
      type(matrix_type) :: m, c, k
      integer(int64) :: seed
      real(wp) :: b(30), g(30), s(30), w(30)
      integer :: i, n
      seed = 99
      do n = 2, 30, 7
         m = random_matrix(seed, kind_banded, n, 1, 1, .true., 4.0_wp)
         c = random_matrix(seed, kind_banded, n, 1, 1, .false., 1.0_wp)
         k = random_matrix(seed, kind_banded, n, 1, 1, .true., 4.0_wp)
         do i = 1, n
            b(i) = random(seed)
            g(i) = random(seed)
            s(i) = random(seed)
            w(i) = 1 + 0.4_wp*random(seed)
         end do
         call beside%set(m, c, k, status)
         call beside%set_coupling(b(:n), g(:n), s(:n), status)
         call within%set(dense_matrix(full(m), .true.), dense_matrix(full(c) + outer(b(:n), s(:n)), .false.), &
            & dense_matrix(full(k) + outer(b(:n), g(:n)), .false.), status)
         beside%w = w(:n)
         within%w = w(:n)
         do i = 0, 1
            beside%load_kind = merge(load_procedure, load_none, i == 1)
            within%load_kind = beside%load_kind
            do while (stepper%form <= form_refined)
               call pade_rational(4, 4, stepper%r, status)
               call compare(error, stepper, beside, within, 0.5_wp, 1.0e-12_wp, 'coupling')
               call taylor_rational(4, 5, 0.44_wp, stepper%r, status)
               call compare(error, stepper, beside, within, -0.5_wp, 1.0e-12_wp, 'coupling')
               stepper%form = stepper%form + 1
            end do
            stepper%form = form_automatic
            call pade_rational(4, 2, stepper%r, status)
            call compare(error, stepper, beside, within, 0.3_wp, 1.0e-12_wp, 'coupling')
         end do
      end do
   end subroutine test_coupling

   pure function outer(x, y)
      real(wp), intent(in) :: x(:), y(:)
      real(wp) :: outer(size(x), size(y))
      outer = spread(x, 2, size(y))*spread(y, 1, size(x))
   end function outer

   !> Identity, diagonal, zero and full matrices of one system; n around 20, where the matrix of a step ends: the refined form
   !> does without it
   subroutine test_sizes(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: sizes(6) = [1, 2, 19, 20, 21, 22]
      type(forced_system) :: sys, in_full
      type(any_stepper) :: stepper, refined
      type(status_type) :: status
      type(state_type) :: x, y
      type(matrix_type) :: m, c, k
      real(wp) :: d(22)
      integer :: i, j, n, kind
      refined%form = form_refined
      do i = 1, size(sizes)
         n = sizes(i)
         d(:n) = [(1.0_wp + 0.1_wp*j, j=1, n)]
         do kind = 1, 4
            m = diagonal_matrix(d(:n))
            c = zero_matrix(n)
            k = diagonal_matrix(2*d(n:1:-1))
            if (kind == 2) m = identity_matrix(n)
            if (kind == 2) k = identity_matrix(n)
            if (kind == 3) c = identity_matrix(n)
            if (kind == 4) c = diagonal_matrix(0.1_wp*d(:n))
            if (kind == 4 .and. n > 1) k = banded_matrix(spread([-1.0_wp, 3.0_wp, -1.0_wp], 2, n), 1, 1, .true.)
            call sys%set(m, c, k, status)
            call in_full%set(dense_matrix(full(m), .true.), dense_matrix(full(c), .true.), dense_matrix(full(k), .true.), status)
            sys%w = d(:n)
            in_full%w = d(:n)
            do j = 0, 1
               sys%load_kind = merge(load_procedure, load_none, j == 1)
               in_full%load_kind = sys%load_kind
               call pade_rational(3, 4, stepper%r, status)
               call compare(error, stepper, sys, in_full, 0.4_wp, 1.0e-13_wp, 'kinds')
               refined%r = stepper%r
               call allocate_state(sys, x, status)
               x%t = 0
               x%y = 1
               y = x
               call go(stepper, sys, 0.4_wp, 8, x, status)
               call go(refined, sys, 0.4_wp, 8, y, status)
               call check(error, .not. status%failed(), status%message)
               call check(error, maxval(abs(x%y - y%y)), 0.0_wp, 'with and without the matrix of a step', thr=2.0e-14_wp &
                  & *maxval(abs(y%y)))
               call check(error, maxval(abs(x%a - y%a)), 0.0_wp, 'accelerations', thr=1.0e-13_wp*maxval(abs(y%y))*n)
            end do
         end do
      end do
   end subroutine test_sizes

   !> One step and the tenth (by the matrix of a step) of an oscillator with h omega from 1e-12 to 1e12, as one equation of
   !> second order and as two of first: amplitude to 1e-14 a step
   subroutine test_amplitude(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: degrees(4) = [1, 2, 4, 8]
      type(any_stepper) :: stepper
      type(status_type) :: status
      integer :: form, i, k
      do k = 1, size(degrees)
         do form = form_automatic, form_refined
            if (form == form_parallel .and. degrees(k) > 4) cycle
            do i = -24, 24
               stepper%form = form
               call pade_rational(degrees(k), degrees(k), stepper%r, status)
               call check_amplitude(error, stepper, 10.0_wp**(0.5_wp*i))
               if (degrees(k) > 6) cycle
               call taylor_rational(degrees(k), degrees(k), 0.5_wp, stepper%r, status)
               call check_amplitude(error, stepper, 10.0_wp**(0.5_wp*i))
            end do
         end do
      end do
   end subroutine test_amplitude

   subroutine check_amplitude(error, stepper, z)
      type(error_type), allocatable, intent(inout) :: error
      type(any_stepper), intent(inout) :: stepper
      real(wp), intent(in) :: z
      type(linear_system) :: second
      type(linear_ode) :: first
      type(status_type) :: status
      type(state_type) :: x
      character(len=100) :: words
      real(wp) :: off(4)
      integer :: steps, i
      call second%set(identity_matrix(1), zero_matrix(1), diagonal_matrix([z**2]), status)
      call first%set(dense_matrix(reshape([0.0_wp, -z, z, 0.0_wp], [2, 2]), .false.), status)
      do i = 1, 2
         steps = merge(1, 10, i == 1)
         call allocate_state(second, x, status)
         x%t = 0
         x%y = [0.6_wp/z, 0.8_wp]
         call go(stepper, second, 1.0_wp, steps, x, status)
         off(2*i - 1) = abs(hypot(z*x%y(1), x%y(2)) - 1)/steps
         call allocate_state(first, x, status)
         x%t = 0
         x%y = [0.6_wp, 0.8_wp]
         call go(stepper, first, 1.0_wp, steps, x, status)
         off(2*i) = abs(hypot(x%y(1), x%y(2)) - 1)/steps
      end do
      if (.not. status%failed() .and. maxval(off) <= 1.0e-14_wp) return
      write (words, '("(", i0, ",", i0, "), form ", i0, ", h omega ", es8.1, ": ", 4es9.1)') stepper%r%p, stepper%r%q, &
         & stepper%form, z, off
      call test_failed(error, trim(words), trim(status%message))
   end subroutine check_amplitude

   !> y' = A y with eigenvalues from -1 to -S: the slow mode alone, one step of length 1, 10 eps S
   subroutine test_slow_mode(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 6
      type(linear_ode) :: sys
      type(any_stepper) :: stepper
      type(status_type) :: status
      type(state_type) :: x
      real(wp) :: u(n), t(n, n), a(n, n), spread_of, off
      character(len=80) :: words
      integer :: i, j, k, form
      u = [(1.0_wp + 0.3_wp*i, i=1, n)]
      u = u/norm2(u)
      t = -2*outer(u, u)
      do i = 1, n
         t(i, i) = t(i, i) + 1
      end do
      do k = 2, 12
         spread_of = 10.0_wp**k
         do j = 1, n
            a(:, j) = -t(:, j)*spread_of**(real(j - 1, wp)/(n - 1))
         end do
         call sys%set(dense_matrix(matmul(a, t), .false.), status)
         do i = 1, 4
            if (i == 1) call pade_rational(4, 4, stepper%r, status)
            if (i == 2) call pade_rational(8, 8, stepper%r, status)
            if (i == 3) call taylor_rational(4, 5, 0.44_wp, stepper%r, status)
            if (i == 4) call pade_rational(3, 4, stepper%r, status)
            do form = form_product, form_refined
               stepper%form = form
               call allocate_state(sys, x, status)
               x%t = 0
               x%y = t(:, 1)
               call go(stepper, sys, 1.0_wp, 1, x, status)
               off = maxval(abs(x%y - t(:, 1)*real(stepper%r%value((-1.0_wp, 0.0_wp)), wp)))
               if (.not. status%failed() .and. off <= 10*eps*spread_of) cycle
               write (words, '("(", i0, ",", i0, "), form ", i0, ", S ", es8.1, ": ", es9.1)') stepper%r%p, stepper%r%q, form, &
                  & spread_of, off
               call test_failed(error, trim(words), trim(status%message))
            end do
         end do
      end do
   end subroutine test_slow_mode

   !> alpha one bit from 0, 1/2 and 1 steps as alpha there does
   subroutine test_alpha(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: limits(3) = [0.0_wp, 0.5_wp, 1.0_wp]
      type(forced_system) :: sys
      type(any_stepper) :: stepper
      type(status_type) :: status
      type(state_type) :: x, y
      integer :: i, k, q
      call small_system(sys)
      do i = 1, 3
         do q = 4, 5
            do k = 1, 3
               call allocate_state(sys, x, status)
               x%t = 0
               x%y = 1
               y = x
               call taylor_rational(4, q, limits(i), stepper%r, status)
               call go(stepper, sys, 0.2_wp, 5, x, status)
               call taylor_rational(4, q, beside(limits(i), k), stepper%r, status)
               call go(stepper, sys, 0.2_wp, 5, y, status)
               call check(error, .not. status%failed(), status%message)
               call check(error, maxval(abs(x%y - y%y)), 0.0_wp, 'next to a limit', thr=merge(1.0e-11_wp, 1.0e-13_wp, k == 3))
            end do
         end do
      end do
   contains
      real(wp) function beside(alpha, k)
         real(wp), intent(in) :: alpha
         integer, intent(in) :: k
         beside = nearest(alpha, 0.4_wp - alpha)
         if (k == 2) beside = alpha + 1.0e-15_wp*sign(1.0_wp, 0.4_wp - alpha)
         if (k == 3) beside = alpha + 1.0e-12_wp*sign(1.0_wp, 0.4_wp - alpha)
      end function beside
   end subroutine test_alpha

   !> The energy of an undamped chain by Pade(4,4), 1e5 steps.  Rounded coefficients and factors make a linear drift in all
   !> forms but the refined one: up to 3e-10 (parallel), 3e-11 (product, matrix of a step) at h omega_max = 2, where the refined
   !> form keeps 1e-13; it was 6e-13 after 1e6 steps of 30 masses.
   subroutine test_energy(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: drift
      drift = energy_drift(24, form_refined, 2.0_wp, 100000)
      call check(error, drift, 0.0_wp, 'refined, h omega = 2', thr=2.0e-13_wp)
      drift = energy_drift(24, form_refined, 0.2_wp, 50000)
      call check(error, drift, 0.0_wp, 'refined, h omega = 0.2', thr=2.0e-13_wp)
      drift = energy_drift(24, form_parallel, 2.0_wp, 10000)
      call check(error, drift, 0.0_wp, 'parallel', thr=3.0e-11_wp)
      drift = energy_drift(24, form_product, 2.0_wp, 10000)
      call check(error, drift, 0.0_wp, 'product', thr=6.0e-12_wp)
      drift = energy_drift(16, form_automatic, 2.0_wp, 10000)
      call check(error, drift, 0.0_wp, 'matrix of a step', thr=6.0e-12_wp)
      drift = energy_drift(16, form_automatic, 0.02_wp, 10000)
      call check(error, drift, 0.0_wp, 'matrix of a step, h omega = 0.02', thr=2.0e-14_wp)
   end subroutine test_energy

   real(wp) function energy_drift(n, form, h_omega, steps)
      integer, intent(in) :: n, form, steps
      real(wp), intent(in) :: h_omega
      type(linear_system) :: sys
      type(pade_stepper) :: stepper
      type(status_type) :: status
      type(state_type) :: x
      real(wp) :: band(3, n), d(n), before, after
      integer :: i, ierr
      d = [(1 + 0.3_wp*sin(7.0_wp*i), i=1, n)]
      band(1, :) = [(-1 + 0.05_wp*sin(3.0_wp*(i - 1)), i=1, n)]
      band(2, :) = [(2.1_wp + 0.1_wp*cos(5.0_wp*i), i=1, n)]
      band(3, :) = [(-1 + 0.05_wp*sin(3.0_wp*i), i=1, n)]
      call sys%set(diagonal_matrix(d), zero_matrix(n), banded_matrix(band, 1, 1, .true.), status)
      stepper%form = form
      call allocate_state(sys, x, status)
      x%y = [(sin(1.7_wp*i), i=1, n), (cos(2.3_wp*i**2), i=1, n)]
      call sys%energy(0.0_wp, x%y(:n), x%y(n + 1:), before, ierr)
      call go(stepper, sys, h_omega/2, steps, x, status)
      call sys%energy(0.0_wp, x%y(:n), x%y(n + 1:), after, ierr)
      energy_drift = huge(1.0_wp)
      if (.not. status%failed()) energy_drift = (after - before)/before
   end function energy_drift

   !> A mode of a chain of a million masses
   subroutine test_many(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 1000000
      type(linear_system) :: sys
      type(pade_stepper) :: stepper
      type(status_type) :: status
      type(state_type) :: x
      real(wp), allocatable :: mode(:)
      real(wp) :: angle, omega
      integer :: i
      angle = acos(-1.0_wp)*333333/(n + 1)
      omega = 2*sin(angle/2)
      allocate (mode(n))
      mode = [(sin(modulo(angle*i, 2*acos(-1.0_wp))), i=1, n)]
      call sys%set(identity_matrix(n), zero_matrix(n), banded_matrix(spread([-1.0_wp, 2.0_wp, -1.0_wp], 2, n), 1, 1, .true.), &
         & status)
      call allocate_state(sys, x, status)
      x%y(:n) = mode
      call go(stepper, sys, 0.5_wp, 3, x, status)
      call check(error, .not. status%failed(), status%message)
      call check(error, maxval(abs(x%y(:n) - cos(1.5_wp*omega)*mode)), 0.0_wp, 'q', thr=1.0e-9_wp)
      call check(error, maxval(abs(x%y(n + 1:) + omega*sin(1.5_wp*omega)*mode)), 0.0_wp, 'v', thr=1.0e-9_wp)
   end subroutine test_many

   !> BI(5,5) with alpha = 1/2 has a pole at h lambda = -0.479613 + 6.256670 i.  With a mode there, alone or among others, in any
   !> storage, a step fails with words and leaves the state alone; a step of half the length goes
   subroutine test_pole(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: second
      type(linear_ode) :: first
      type(any_stepper) :: stepper
      type(status_type) :: status
      complex(wp) :: z
      real(wp), parameter :: t(3, 3) = reshape([1.0_wp, 0.5_wp, 0.2_wp, 0.0_wp, 1.0_wp, 0.3_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
      real(wp) :: c(3), k(3), a(4, 4), band(3, 25)
      integer :: form
      do form = form_automatic, form_refined
         stepper%form = form
         call taylor_rational(5, 5, 0.5_wp, stepper%r, status)
         z = stepper%r%poles(minloc(real(stepper%r%poles, wp), 1))
         call check(error, abs(real(z, wp) + 0.479613_wp) < 1.0e-6_wp .and. abs(abs(aimag(z)) - 6.256670_wp) < 1.0e-6_wp, &
            & 'the pole')
         c = [0.3_wp, -2*real(z, wp), 0.1_wp]
         k = [2.0_wp, abs(z)**2, 5.0_wp]
         call second%set(identity_matrix(1), diagonal_matrix(c(2:2)), diagonal_matrix(k(2:2)), status)
         call check_refused(error, stepper, second, 'one oscillator')
         call second%set(dense_matrix(reshape([2.0_wp], [1, 1]), .true.), diagonal_matrix(2*c(2:2)), diagonal_matrix(2*k(2:2)), &
            & status)
         call check_refused(error, stepper, second, 'one in full')
         call second%set(identity_matrix(3), diagonal_matrix(c), diagonal_matrix(k), status)
         call check_refused(error, stepper, second, 'three')
         call second%set(identity_matrix(3), diagonal_matrix(c), dense_matrix(full(diagonal_matrix(k)), .true.), status)
         call check_refused(error, stepper, second, 'three in full')
         call second%set(dense_matrix(matmul(t, transpose(t)), .false.), &
            & dense_matrix(matmul(t, matmul(full(diagonal_matrix(c)), transpose(t))), .false.), &
            & dense_matrix(matmul(t, matmul(full(diagonal_matrix(k)), transpose(t))), .false.), status)
         call check_refused(error, stepper, second, 'three that hang together')
         band = spread([-1.0_wp, 2.0_wp, -1.0_wp], 2, 25)*(k(2)/(2*sin(9*acos(-1.0_wp)/52))**2)
         call second%set(identity_matrix(25), banded_matrix(band*(c(2)/k(2)), 1, 1, .true.), banded_matrix(band, 1, 1, .true.), &
            & status)
         call check_refused(error, stepper, second, 'a chain')
         a = 0
         a(1, 1) = -1
         a(2:3, 2:3) = reshape([real(z, wp), aimag(z), -aimag(z), real(z, wp)], [2, 2])
         a(4, 4) = -3
         call first%set(dense_matrix(a, .false.), status)
         call check_refused(error, stepper, first, 'first order')
         a(1, 2) = 0.5_wp
         a(3, 4) = -0.5_wp
         call first%set(dense_matrix(a, .false.), status)
         call check_refused(error, stepper, first, 'first order, together')
         call check(error, .not. status%failed(), status%message)
      end do
   end subroutine test_pole

   subroutine check_refused(error, stepper, sys, what)
      type(error_type), allocatable, intent(inout) :: error
      type(any_stepper), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      character(len=*), intent(in) :: what
      type(state_type) :: x, trial
      type(status_type) :: status
      type(clock_type) :: clock
      call allocate_state(sys, x, status)
      x%t = 0
      x%y = 1
      call go(stepper, sys, 1.0_wp, 3, x, status)
      call check(error, status%code, dynstep_singular_matrix, what//': '//trim(status%message))
      call check(error, index(status%message, 'spectrum') > 0 .and. index(status%message, 't = 0') > 0, what//': words')
      call check(error, status%retry, what//': another length may do')
      call check(error, x%t, 0.0_wp, what//': t')
      call check(error, .not. any(abs(x%y - 1) > 0), what//': state')
      call status%clear()
      trial = x
      call stepper%try_step(sys, x, 0.5_wp, 0.5_wp, trial, status)
      call check(error, .not. status%failed() .and. all(ieee_is_finite(trial%y)), what//': half the step')
      clock%h = 1
      call stepper%try_step(sys, x, 1.0_wp, 1.0_wp, trial, status)
      call check(error, status%code, dynstep_singular_matrix, what//': the same again')
   end subroutine check_refused

   !> A chain that is free at both ends, with h omega_max = 2e3 and 1e8: pivots nearly vanish, but no pole is near, and the chain
   !> moves on, with an error of eps (h omega_max)^2
   subroutine test_rigid(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 5
      type(linear_system) :: sys
      type(any_stepper) :: stepper
      type(status_type) :: status
      type(state_type) :: x
      real(wp) :: band(3, n), stiffness
      integer :: i
      do i = 1, 8
         stiffness = merge(1.0e6_wp, 2.5e15_wp, i > 4)
         band = spread([-1.0_wp, 2.0_wp, -1.0_wp], 2, n)*stiffness
         band(2, [1, n]) = stiffness
         call sys%set(identity_matrix(n), zero_matrix(n), banded_matrix(band, 1, 1, .true.), status)
         if (modulo(i, 4) == 1) call pade_rational(4, 4, stepper%r, status)
         if (modulo(i, 4) == 2) call pade_rational(3, 4, stepper%r, status)
         if (modulo(i, 4) == 3) call taylor_rational(5, 5, 0.5_wp, stepper%r, status)
         if (modulo(i, 4) == 0) call taylor_rational(4, 5, 0.44_wp, stepper%r, status)
         call allocate_state(sys, x, status)
         x%t = 0
         x%y(:n) = 1
         x%y(n + 1:) = 0.5_wp
         call go(stepper, sys, 1.0_wp, 2, x, status)
         call check(error, .not. status%failed(), status%message)
         call check(error, maxval(abs(x%y(:n) - 2)), 0.0_wp, 'it has moved', thr=16*eps*stiffness)
         call check(error, maxval(abs(x%y(n + 1:) - 0.5_wp)), 0.0_wp, 'its velocity', thr=16*eps*stiffness)
      end do
   end subroutine test_rigid

   !> Two masses on a link 1e10 times as stiff as their springs, in equilibrium with a load whose parts nearly cancel: K q - p
   !> is formed before anything is multiplied, so it is zero, and nothing moves.  (Added up from a matrix of the step
   !> times q and one times p, Pade(4,4) would be off by 0.5 after 80 steps, (8,8) by 49.)
   subroutine test_equilibrium(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: degrees(2, 5) = reshape([2, 2, 3, 4, 4, 4, 6, 6, 8, 8], [2, 5])
      real(wp), parameter :: link = 1.0e10_wp, rest(2) = [1.0_wp, 2.0_wp]
      real(wp), parameter :: k(2, 2) = reshape([link + 1.0_wp, -link, -link, link + 1.0_wp], [2, 2])
      type(preloaded_system) :: sys
      type(any_stepper) :: stepper
      type(status_type) :: status
      type(state_type) :: x
      integer :: i, form
      call sys%set(identity_matrix(2), zero_matrix(2), dense_matrix(k, .true.), status)
      sys%load_kind = load_procedure
      sys%p = matmul(k, rest)
      do i = 1, size(degrees, 2)
         call pade_rational(degrees(1, i), degrees(2, i), stepper%r, status)
         do form = form_parallel, form_product
            stepper%form = form
            call allocate_state(sys, x, status)
            x%t = 0.0_wp
            x%y = [rest, 0.0_wp, 0.0_wp]
            call go(stepper, sys, 0.05_wp, 80, x, status)
            call check(error, .not. status%failed(), status%message)
            call check(error, maxval(abs(x%y - [rest, 0.0_wp, 0.0_wp])), 0.0_wp, 'at rest', thr=4*eps)
         end do
      end do
   end subroutine test_equilibrium

   !> A load or source that gives up, asks for a smaller step or is no number, from t = 0.5 on: two steps of 0.2 stand
   subroutine test_bad_loads(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_system) :: second
      type(forced_ode) :: first
      integer :: ierr
      call small_system(second)
      call small_ode(first)
      second%bad_time = 0.5_wp
      first%bad_time = 0.5_wp
      do ierr = -1, 1
         second%ierr = ierr
         first%ierr = ierr
         call check_bad(error, second, ierr, 'load')
         call check_bad(error, first, ierr, 'source')
      end do
   end subroutine test_bad_loads

   subroutine check_bad(error, sys, ierr, name)
      type(error_type), allocatable, intent(inout) :: error
      class(ode_system), intent(inout) :: sys
      integer, intent(in) :: ierr
      character(len=*), intent(in) :: name
      type(pade_stepper) :: stepper
      type(state_type) :: x, y
      type(status_type) :: status
      integer :: form
      do form = form_automatic, form_refined
         stepper%form = form
         call allocate_state(sys, x, status)
         x%t = 0
         x%y = 1
         y = x
         call go(stepper, sys, 0.2_wp, 2, y, status)
         call check(error, .not. status%failed(), name//' before')
         call go(stepper, sys, 0.2_wp, 5, x, status)
         call check(error, status%code, merge(dynstep_not_finite, dynstep_callback_failed, ierr == 0), name)
         call check(error, status%retry .eqv. ierr >= 0, name//': retry')
         call check(error, index(status%message, name) > 0, trim(status%message))
         call check(error, x%t, 0.4_wp, name//': time')
         call check(error, .not. any(abs(x%y - y%y) > 0), name//': state')
         call status%clear()
      end do
   end subroutine check_bad

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_system) :: sys
      type(pade_stepper) :: stepper
      type(any_stepper) :: other
      type(status_type) :: status
      call small_system(sys)
      stepper%p = 9
      call refused('p = 9')
      stepper%p = -1
      call refused('p = -1')
      stepper%p = 4
      stepper%q = 9
      call refused('q = 9')
      stepper%q = 4
      stepper%form = 4
      call refused('form = 4')
      stepper%form = form_parallel
      stepper%q = 3
      call refused('product form')
      stepper%form = form_automatic
      sys%n = 0
      call refused('n = 0')
      call taylor_rational(7, 4, 0.5_wp, other%r, status)
      call other%init(sys, status)
      call check(error, status%code, dynstep_invalid_input, 'p of taylor')
      call status%clear()
      call sys%set(zero_matrix(3), identity_matrix(3), identity_matrix(3), status)
      call check(error, status%code, dynstep_invalid_input, 'a mass matrix of zeros')
   contains
      subroutine refused(words)
         character(len=*), intent(in) :: words
         type(state_type) :: x
         call stepper%init(sys, status)
         call check(error, status%code, dynstep_invalid_input, words)
         call check(error, index(status%message, words) > 0, trim(status%message))
         call status%clear()
         x%y = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
         call stepper%start(sys, x, status)
         call check(error, status%code, dynstep_invalid_input, words//': start after it')
         call status%clear()
      end subroutine refused
   end subroutine test_refusals

   !> Another structure after init is refused at start; other numbers, and a load that comes or goes, are taken
   subroutine test_changes(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_system) :: sys
      type(forced_ode) :: first
      type(pade_stepper) :: stepper, fresh
      type(status_type) :: status
      type(state_type) :: x, y
      type(matrix_type) :: a
      integer :: i, n
      call small_system(sys)
      call small_ode(first)
      call stepper%init(first, status)
      a = first%a
      call first%set(diagonal_matrix([1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp]), status)
      x%y = [1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp]
      call stepper%start(first, x, status)
      call check(error, status%code, dynstep_invalid_input, 'another kind of A')
      call status%clear()
      call stepper%init(first, status)
      call first%set(a, status)
      call stepper%start(first, x, status)
      call check(error, status%code, dynstep_invalid_input, 'a full A for a diagonal one')
      call status%clear()
      call stepper%init(sys, status)
      x%y = [1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp]
      call sys%set_coupling([1.0_wp, 0.0_wp, 0.0_wp], [0.5_wp, 0.5_wp, 0.5_wp], [0.0_wp, 0.0_wp, 1.0_wp], status)
      call stepper%start(sys, x, status)
      call check(error, status%code, dynstep_invalid_input, 'a coupling')
      call status%clear()

      do i = 0, 5
         if (i == 0) call small_system(sys)
         if (i == 3) then
            call sys%set(identity_matrix(25), zero_matrix(25), banded_matrix(spread([-1.0_wp, 2.0_wp, -1.0_wp], 2, 25), 1, 1, &
               & .true.), status)
            sys%w = [(1.0_wp, n=1, 25)]
            deallocate (x%y)
            allocate (x%y(50))
         end if
         if (modulo(i, 3) == 0) then
            sys%load_kind = load_none
            call stepper%init(sys, status)
         end if
         if (modulo(i, 3) == 1) sys%load_kind = load_procedure
         if (modulo(i, 3) == 2) sys%k%a = 1.5_wp*sys%k%a
         x%t = 0
         x%y = 1
         y = x
         call run_on(stepper, x)
         call fresh%init(sys, status)
         call run_on(fresh, y)
         call check(error, .not. status%failed(), status%message)
         call check(error, .not. any(abs(x%y - y%y) > 0), 'as a new stepper does')
      end do
   contains
      subroutine run_on(one, state)
         type(pade_stepper), intent(inout) :: one
         type(state_type), intent(inout) :: state
         type(clock_type) :: clock
         call one%start(sys, state, status)
         clock%h = 0.2_wp
         call one%advance(sys, state, clock, 5, status, .true.)
      end subroutine run_on
   end subroutine test_changes

   !> Factorizations once for each step length, solves and loads for each step
   subroutine test_work(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_system) :: sys
      type(pade_stepper) :: stepper
      type(status_type) :: status
      type(state_type) :: x
      type(clock_type) :: clock
      integer, parameter :: n = 30
      integer :: form, i
      call sys%set(identity_matrix(n), zero_matrix(n), banded_matrix(spread([-1.0_wp, 2.0_wp, -1.0_wp], 2, n), 1, 1, .true.), &
         & status)
      sys%w = [(1.0_wp, i=1, n)]
      sys%load_kind = load_procedure
      do form = form_automatic, form_refined
         stepper%form = form
         call stepper%init(sys, status)
         call allocate_state(sys, x, status)
         x%t = 0
         x%y = 1
         call stepper%start(sys, x, status)
         call stepper%count%zero()
         clock = clock_type(h=0.1_wp)
         call stepper%advance(sys, x, clock, 10, status, .false.)
         call check(error, int(stepper%count%steps), 10, 'steps')
         call check(error, int(stepper%count%factorizations), 2, 'one for each pair of poles')
         call check(error, int(stepper%count%solves), merge(80, 40, form == form_refined), 'two for each pair and step')
         call check(error, int(stepper%count%forces), 10*7 + 1, 'order - 1 in a step')
         clock = clock_type(t0=x%t, h=0.05_wp)
         call stepper%advance(sys, x, clock, 4, status, .false.)
         call check(error, int(stepper%count%factorizations), 4, 'again at another length')
         call check(error, int(stepper%count%forces), 14*7 + 1, 'the load at the end serves as the next one''s first')
      end do
      stepper%p = 3
      stepper%q = 0
      stepper%form = form_automatic
      call stepper%init(sys, status)
      call stepper%start(sys, x, status)
      call stepper%count%zero()
      call stepper%advance(sys, x, clock, 10, status, .false.)
      call check(error, int(stepper%count%factorizations), 1, 'M alone')
      call check(error, int(stepper%count%solves), 30, 'a solve with M for each degree')
      call check(error, .not. status%failed(), status%message)

      ! with loads a small system is stepped by its stages
      call small_system(sys)
      stepper%p = 4
      stepper%q = 4
      call stepper%init(sys, status)
      deallocate (x%y, x%a)
      call allocate_state(sys, x, status)
      x%t = 0
      x%y = 1
      call stepper%start(sys, x, status)
      call stepper%count%zero()
      clock = clock_type(h=0.1_wp)
      call stepper%advance(sys, x, clock, 100, status, .false.)
      call check(error, int(stepper%count%factorizations), 2, 'small: factorizations')
      call check(error, int(stepper%count%solves), 4*100, 'small: solves')
      call check(error, int(stepper%count%forces), 701, 'small: loads')

      ! without, the matrix of a step is made once: two steps by stages, 6 columns
      sys%load_kind = load_none
      call stepper%init(sys, status)
      x%t = 0
      x%y = 1
      call stepper%start(sys, x, status)
      call stepper%count%zero()
      clock = clock_type(h=0.1_wp)
      call stepper%advance(sys, x, clock, 100, status, .false.)
      call check(error, int(stepper%count%factorizations), 2, 'free: factorizations')
      call check(error, int(stepper%count%solves), 4*(2 + 6), 'free: solves')
   end subroutine test_work
end module test_rational_steps
