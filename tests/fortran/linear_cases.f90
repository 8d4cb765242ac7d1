! SPDX-License-Identifier: BSD-3-Clause
!> Linear systems of every structure, and plain Newmark steps in quadruple precision to
!> compare with.
module linear_cases
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: real128
   use dynstep_kinds, only: wp
   use dynstep_linear_newmark, only: linear_newmark
   use dynstep_linear_system, only: linear_system, load_none, load_procedure, load_samples
   use dynstep_load_table, only: load_table_type
   use dynstep_matrix, only: banded_matrix, dense_matrix, diagonal_matrix, identity_matrix, matrix_type, zero_matrix
   use dynstep_status, only: status_type
   use dynstep_stepper, only: clock_type, step_counters
   implicit none
   private

   public :: make_system, make_load, start_state, reference_run, engine_run

   integer, parameter, public :: qp = real128

   !> A load that can fail
   type, extends(linear_system), public :: loaded_system
      real(wp) :: bad_time = huge(1.0_wp)     !! fails from here on
      integer :: ierr = 0                     !! with this code, or with a NaN where it is 0
   contains
      procedure :: load => loaded_load
   end type loaded_system

   !> beta, gamma: trapezoid, linear acceleration, Fox and Goodwin, explicit, damped, backward-like
   real(wp), parameter, public :: members(2, 6) = reshape([0.25_wp, 0.5_wp, 1.0_wp/6.0_wp, 0.5_wp, 1.0_wp/12.0_wp, 0.5_wp, &
      & 0.0_wp, 0.5_wp, 0.3025_wp, 0.6_wp, 1.0_wp, 1.5_wp], [2, 6])

   character(len=15), parameter, public :: structures(11) = [character(len=15) :: 'diagonal', 'tridiagonal', &
      & 'pentadiagonal', 'band', 'dense', 'tri M', 'penta C', 'diagonal C', 'unsymmetric', 'unsymmetric tri', 'dense M']

contains

   recursive subroutine loaded_load(self, t, p, ierr)
      class(loaded_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      integer :: i
      ierr = 0
      if (self%load_kind == load_samples) then
         call self%table%evaluate(t, p)
         return
      end if
      do i = 1, self%n
         p(i) = cos(i*t) + 0.5_wp*i
      end do
      if (t < self%bad_time) return
      ierr = self%ierr
      if (ierr == 0) p(self%n) = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine loaded_load

   !> Numbers in (0,1) that look random
   pure real(wp) function hash(i, j, k)
      integer, intent(in) :: i, j, k
      hash = modulo(sin(12.9898_wp*i + 78.233_wp*j + 37.719_wp*k)*43758.5453_wp, 1.0_wp)
   end function hash

   !> Dense positive definite (or unsymmetric) matrix with `width` off-diagonals and norm 2
   pure function full_matrix(n, width, seed, unsymmetric) result(a)
      integer, intent(in) :: n, width, seed
      logical, intent(in) :: unsymmetric
      real(wp) :: a(n, n)
      integer :: i, j
      a = 0.0_wp
      do j = 1, n
         do i = j + 1, min(n, j + width)
            a(i, j) = -hash(i, j, seed)
            a(j, i) = a(i, j)
         end do
      end do
      do j = 1, n
         a(j, j) = sum(abs(a(:, j))) + 0.2_wp + hash(j, j, seed)
      end do
      if (unsymmetric) then
         do j = 1, n
            do i = j + 1, min(n, j + width)
               a(i, j) = a(i, j) + 0.3_wp*hash(j, i, seed)
            end do
         end do
      end if
      a = a*(2.0_wp/maxval(sum(abs(a), 1)))
   end function full_matrix

   !> A dense array as a band or as it is
   pure function stored(a, width, symmetric) result(matrix)
      real(wp), intent(in) :: a(:, :)
      integer, intent(in) :: width
      logical, intent(in) :: symmetric
      type(matrix_type) :: matrix
      real(wp), allocatable :: ab(:, :)
      integer :: i, j, n
      n = size(a, 1)
      if (width >= n - 1) then
         matrix = dense_matrix(a, symmetric)
      else if (width == 0) then
         matrix = diagonal_matrix([(a(i, i), i=1, n)])
      else
         allocate (ab(2*width + 1, n), source=0.0_wp)
         do j = 1, n
            do i = max(1, j - width), min(n, j + width)
               ab(width + 1 + i - j, j) = a(i, j)
            end do
         end do
         matrix = banded_matrix(ab, width, width, symmetric)
      end if
   end function stored

   !> System of a structure; without C where `damped` is .false. and its name does not ask for C
   subroutine make_system(name, n, damped, sys, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      logical, intent(in) :: damped
      class(linear_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      type(matrix_type) :: m, c, k
      integer :: m_width, c_width, k_width
      logical :: symmetric

      m_width = 0
      c_width = 1
      k_width = 1
      symmetric = index(name, 'unsymmetric') == 0
      select case (name)
      case ('diagonal')
         c_width = 0
         k_width = 0
      case ('pentadiagonal', 'penta C')
         c_width = merge(2, 1, name == 'penta C')
         k_width = merge(1, 2, name == 'penta C')
      case ('band')
         c_width = 3
         k_width = 4
      case ('dense', 'unsymmetric', 'dense M')
         c_width = n
         k_width = n
         if (name == 'dense M') m_width = n
      case ('tri M')
         m_width = 1
      case ('diagonal C')
         c_width = 0
      end select
      m = stored(full_matrix(n, m_width, 1, .false.), m_width, .true.)
      if (name == 'tridiagonal' .and. modulo(n, 2) == 0) m = identity_matrix(n)
      c = zero_matrix(n)
      if (damped .or. name == 'penta C' .or. name == 'diagonal C') &
         & c = stored(0.3_wp*full_matrix(n, c_width, 2, .not. symmetric), c_width, symmetric)
      k = stored(3.0_wp*full_matrix(n, k_width, 3, .not. symmetric), k_width, symmetric)
      call sys%set(m, c, k, status)
   end subroutine make_system

   !> Loads of the three kinds
   subroutine make_load(kind, sys, status)
      integer, intent(in) :: kind
      class(linear_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      type(load_table_type) :: table
      integer :: i
      sys%load_kind = load_none
      if (kind == load_procedure) sys%load_kind = kind
      if (kind /= load_samples) return
      table%t0 = -10.0_wp
      table%dt = 0.25_wp
      table%samples = reshape([(sin(0.2_wp*i), i=1, 400)], [1, 400])
      table%pattern = reshape([(0.3_wp*i, i=1, sys%n)], [sys%n, 1])
      call sys%set_table(table, status)
   end subroutine make_load

   pure subroutine start_state(n, y)
      integer, intent(in) :: n
      real(wp), intent(out) :: y(2*n)
      integer :: i
      do i = 1, 2*n
         y(i) = hash(i, 5, 7) - 0.4_wp
      end do
   end subroutine start_state

   pure function as_dense(matrix) result(a)
      type(matrix_type), intent(in) :: matrix
      real(qp) :: a(matrix%n, matrix%n)
      integer :: i, j
      do j = 1, matrix%n
         do i = 1, matrix%n
            a(i, j) = matrix%entry(i, j)
         end do
      end do
   end function as_dense

   !> x = A^-1 x by elimination with row pivoting
   pure subroutine solve(a_given, x)
      real(qp), intent(in) :: a_given(:, :)
      real(qp), intent(inout) :: x(:)
      real(qp) :: a(size(x), size(x) + 1), row(size(x) + 1)
      integer :: i, k, m, n
      n = size(x)
      a(:, 1:n) = a_given
      a(:, n + 1) = x
      do k = 1, n
         m = k - 1 + maxloc(abs(a(k:, k)), 1)
         row = a(k, :)
         a(k, :) = a(m, :)
         a(m, :) = row
         do i = k + 1, n
            if (abs(a(i, k)) > 0.0_qp) a(i, k:) = a(i, k:) - (a(i, k)/a(k, k))*a(k, k:)
         end do
      end do
      do k = n, 1, -1
         x(k) = (a(k, n + 1) - dot_product(a(k, k + 1:n), x(k + 1:)))/a(k, k)
      end do
   end subroutine solve

   !> Newmark's method as it stands in the books, eqs. (20)-(25), with the loads of the times
   !> that the clock gives
   subroutine reference_run(sys, beta, gamma, clock, steps, y, a)
      class(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: beta, gamma
      type(clock_type), intent(in) :: clock
      integer, intent(in) :: steps
      real(qp), intent(inout) :: y(2*sys%n)
      real(qp), intent(out) :: a(sys%n)
      real(qp), dimension(sys%n, sys%n) :: m, c, k, s
      real(qp) :: h
      integer :: i, n

      n = sys%n
      h = clock%h
      m = as_dense(sys%m)
      c = as_dense(sys%c)
      k = as_dense(sys%k)
      s = m + gamma*h*c + beta*h*h*k
      associate (q => y(1:n), v => y(n + 1:))
         a = load_at(clock%time()) - matmul(c, v) - matmul(k, q)
         call solve(m, a)
         do i = 1, steps
            q = q + h*v + (0.5_qp - beta)*h*h*a
            v = v + (1.0_qp - gamma)*h*a
            a = load_at(clock%time(i)) - matmul(c, v) - matmul(k, q)
            call solve(s, a)
            q = q + beta*h*h*a
            v = v + gamma*h*a
         end do
      end associate

   contains

      function load_at(t) result(p)
         real(wp), intent(in) :: t
         real(qp) :: p(sys%n)
         real(wp) :: x(sys%n)
         integer :: ierr
         call sys%load(t, x, ierr)
         p = x
         if (sys%load_kind == load_none) p = 0.0_qp
      end function load_at
   end subroutine reference_run

   !> Start and `steps` steps in calls of at most `chunk`
   subroutine engine_run(sys, beta, gamma, clock, steps, chunk, y, a, status, count)
      class(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: beta, gamma
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps, chunk
      real(wp), intent(inout) :: y(2*sys%n)
      real(wp), intent(out) :: a(sys%n)
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      type(linear_newmark) :: engine
      integer :: done, next

      a = 0.0_wp
      call engine%init(sys, beta, gamma, status)
      call engine%start(sys, clock%time(), y, a, status, count)
      done = 0
      do while (done < steps .and. .not. status%failed())
         next = min(chunk, steps - done)
         call engine%advance(sys, clock, y, a, next, done + next == steps, status, count)
         done = done + next
      end do
   end subroutine engine_run
end module linear_cases
