! SPDX-License-Identifier: BSD-3-Clause
!> Systems of constrained motion by the complement of a diagonal block, against LU of the same matrix: that is what a
!> saddle_point_type does with A as a band of width zero.
!>
!> The samples have conditions near 1e3; solutions by the two ways differ by at most 2e-13 of the largest (measured),
!> where 1e-12 is asked for.
module test_saddle_schur
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_band_ldl, only: band_ldl_factorize, band_ldl_solve, widest_band
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_diagonal, kind_identity, matrix_type
   use dynstep_saddle_point, only: saddle_point_type
   use dynstep_status, only: dynstep_not_finite, dynstep_singular_matrix, status_type
   use dynstep_text, only: text
   use random_matrices, only: random
   use rod_chains, only: body_order, rod_pattern, shuffled
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_saddle_schur

   real(wp), parameter :: eps = epsilon(1.0_wp)

   !> A system, and the same with A as a band
   type :: sample_type
      integer :: n = 0, m = 0, p = 0
      type(matrix_type) :: a, band
      type(pattern_type) :: g_pattern, k_pattern
      type(jacobian_type) :: g, k
      real(wp), allocatable :: b(:)            ! [n + m + p]
      type(saddle_point_type) :: schur, lu
   end type sample_type

   !> Shapes of B: rows * n entries; four in a row, close to each other; two in a row, 25 apart; as chains of rods
   integer, parameter :: dense = 1, narrow = 2, wide = 3, chain = 4, shuffled_ring = 5, shapes = 5

contains

   subroutine collect_saddle_schur(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('the same as LU', test_same), &
         & new_unittest('held psi and regularization', test_held), &
         & new_unittest('A that is not definite', test_indefinite), &
         & new_unittest('constraints close to dependent', test_dependent), &
         & new_unittest('masses of all sizes', test_masses), &
         & new_unittest('not finite', test_not_finite), &
         & new_unittest('orders', test_orders), &
         & new_unittest('condition', test_condition), &
         & new_unittest('copies', test_copies), &
         & new_unittest('band kernels', test_kernels)]
   end subroutine collect_saddle_schur

   !> A system with constraints that are far from dependent; A has entries between 1 and 3 times `factor`, 0: identity
   subroutine make(s, shape, n, m, p, factor, seed, status, order)
      type(sample_type), intent(out) :: s
      integer, intent(in) :: shape, n, m, p
      real(wp), intent(in) :: factor
      integer(int64), intent(inout) :: seed
      type(status_type), intent(inout) :: status
      integer, intent(in), optional :: order(:)
      integer, allocatable :: given(:), coordinate(:)
      integer :: i
      if (present(order)) given = order
      coordinate = [(i, i=1, n)]
      if (shape == shuffled_ring) coordinate = shuffled(n, seed)
      s%n = n
      s%m = m
      s%p = p
      call make_pattern(s%g_pattern, shape, n, m, 0, n/(m + p), coordinate)
      call make_pattern(s%k_pattern, shape, n, p, m, n/(m + p), coordinate)
      if (m > 0) call fill(s%g, m, s%g_pattern, 0)
      if (p > 0) call fill(s%k, p, s%k_pattern, m)
      call s%a%init(merge(kind_diagonal, kind_identity, abs(factor) > 0), n, 0, 0, .true., status)
      call s%band%init(kind_banded, n, 0, 0, .true., status)
      do i = 1, n
         if (abs(factor) > 0) call s%a%set_entry(i, i, factor*(2 + random(seed)))
      end do
      call same_band(s)
      s%b = [(random(seed), i=1, n + m + p)]
      call s%schur%init(n, m, p, s%a%kind, 0, 0, .true., s%g_pattern, s%k_pattern, .false., given, status)
      call s%lu%init(n, m, p, kind_banded, 0, 0, .true., s%g_pattern, s%k_pattern, .false., given, status)

   contains

      !> Random, and 1.5 more at places of their own; joints of rods: 1 and -1 at positions, random lever arms
      subroutine fill(jacobian, rows, pattern, before)
         type(jacobian_type), intent(inout) :: jacobian
         integer, intent(in) :: rows, before
         type(pattern_type), intent(in) :: pattern
         integer :: row, e, entries
         real(wp) :: size_of_entries
         call jacobian%init(rows, n, pattern, status)
         do row = 1, rows
            entries = jacobian%first(row + 1) - jacobian%first(row)
            size_of_entries = merge(0.4_wp, 0.8_wp/sqrt(real(entries, wp)), entries <= 4)
            do e = jacobian%first(row), jacobian%first(row + 1) - 1
               jacobian%value(e) = size_of_entries*random(seed)
            end do
            if (shape >= chain) then
               do e = jacobian%first(row), jacobian%first(row + 1) - 1
                  if (any(jacobian%column(e) == coordinate(3::3))) cycle
                  i = 3*((row + 1)/2)
                  jacobian%value(e) = merge(1.0_wp, -1.0_wp, any(jacobian%column(e) == coordinate(i - 2:i)))
               end do
               cycle
            end if
            e = jacobian%first(row) + merge(before + row - 1, 0, shape == dense)
            jacobian%value(e) = jacobian%value(e) + 1.5_wp
         end do
      end subroutine fill
   end subroutine make

   subroutine same_band(s)
      type(sample_type), intent(inout) :: s
      integer :: i
      do i = 1, s%n
         call s%band%set_entry(i, i, s%a%entry(i, i))
      end do
   end subroutine same_band

   subroutine make_pattern(pattern, shape, n, rows, before, spread, coordinate)
      type(pattern_type), intent(inout) :: pattern
      integer, intent(in) :: shape, n, rows, before, spread
      integer, intent(in) :: coordinate(:)         !! see rod_pattern [n]
      integer :: i, j
      if (rows == 0) return
      select case (shape)
      case (narrow)
         pattern%first = [(1 + 4*(i - 1), i=1, rows + 1)]
         pattern%column = [((min(n - 3, 1 + (before + i - 1)*spread) + j, j=0, 3), i=1, rows)]
      case (wide)
         pattern%first = [(1 + 2*(i - 1), i=1, rows + 1)]
         pattern%column = [(before + i, before + i + 25, i=1, rows)]
      case (chain, shuffled_ring)
         call rod_pattern(n/3, shape == shuffled_ring, coordinate, pattern)
      end select
   end subroutine make_pattern

   !> Factorize and solve by both ways; the difference as a part of the largest component
   subroutine compare(s, difference, status, hold_psi, regularization)
      type(sample_type), intent(inout) :: s
      real(wp), intent(out) :: difference
      type(status_type), intent(inout) :: status
      logical, intent(in), optional :: hold_psi
      real(wp), intent(in), optional :: regularization
      real(wp) :: x(s%n + s%m + s%p), y(s%n + s%m + s%p)
      call s%schur%factorize(s%a, s%g, s%k, status, hold_psi=hold_psi, regularization=regularization)
      call s%lu%factorize(s%band, s%g, s%k, status, hold_psi=hold_psi, regularization=regularization)
      x = s%b
      y = s%b
      associate (n => s%n, m => s%m)
         call s%schur%solve(x(:n), x(n + 1:n + m), x(n + m + 1:))
         call s%lu%solve(y(:n), y(n + 1:n + m), y(n + m + 1:))
      end associate
      difference = maxval(abs(x - y))/maxval(abs(y))
   end subroutine compare

   !> Largest |B x - c| as a part of what it is the difference of: |B| |A^-1| (|b| + |B^T l|) + |c|, row by row, for
   !> p = 0
   real(wp) function residual(s)
      type(sample_type), intent(inout) :: s
      real(wp) :: x(s%n + s%m + s%p), terms(s%n), sum_of, sizes
      integer :: i, e
      x = s%b
      call s%schur%solve(x(:s%n), x(s%n + 1:s%n + s%m), x(s%n + s%m + 1:))
      terms = abs(s%b(:s%n))
      do i = 1, s%m
         do e = s%g%first(i), s%g%first(i + 1) - 1
            terms(s%g%column(e)) = terms(s%g%column(e)) + abs(s%g%value(e)*x(s%n + i))
         end do
      end do
      do i = 1, s%n
         terms(i) = terms(i)/abs(s%a%entry(i, i))
      end do
      residual = 0.0_wp
      do i = 1, s%m
         sum_of = -s%b(s%n + i)
         sizes = abs(s%b(s%n + i))
         do e = s%g%first(i), s%g%first(i + 1) - 1
            sum_of = sum_of + s%g%value(e)*x(s%g%column(e))
            sizes = sizes + abs(s%g%value(e))*terms(s%g%column(e))
         end do
         residual = max(residual, abs(sum_of)/sizes)
      end do
   end function residual

   !> Sizes (n, m, p) for each shape: small, band of the library, LAPACK's band, LAPACK's dense
   subroutine sizes_of(shape, number, n, m, p)
      integer, intent(in) :: shape, number
      integer, intent(out) :: n, m, p
      integer, parameter :: ns(4) = [3, 12, 40, 90], ms(4) = [2, 3, 12, 20], ps(4) = [0, 2, 5, 7], rods(4) = [1, 2, 10, 200]
      n = ns(number)
      m = ms(number)
      p = ps(number)
      select case (shape)
      case (narrow)
         n = max(n, 8)
      case (wide)
         n = m + p + 25
      case (chain, shuffled_ring)
         n = 3*rods(number)
         p = 0
         if (shape == shuffled_ring) n = max(n, 24)
         m = (2*n)/3
      end select
   end subroutine sizes_of

   !> Every shape and size, A positive, negative and the identity
   subroutine test_same(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: factors(3) = [0.5_wp, -20.0_wp, 0.0_wp]
      type(sample_type) :: s
      type(status_type) :: status
      real(wp) :: difference
      integer(int64) :: seed
      integer :: shape, number, k, n, m, p
      character(len=80) :: what
      seed = 17
      do shape = 1, shapes
         do number = 1, 4
            do k = 1, 3
               ! with small lever arms and large inertia, a ring's constraints are close to dependent
               if (shape == shuffled_ring .and. k == 3) cycle
               call sizes_of(shape, number, n, m, p)
               write (what, '("shape ", i0, ", n = ", i0, ", m = ", i0, ", p = ", i0, ", A ", i0)') shape, n, m, p, k
               call make(s, shape, n, m, p, factors(k), seed, status)
               call compare(s, difference, status)
               call check(error, status%code, 0, trim(what)//trim(status%message))
               call check(error, s%schur%by_schur .and. .not. s%lu%by_schur, trim(what)//': two ways')
               call check(error, difference, 0.0_wp, trim(what), thr=1.0e-12_wp)
               if (p == 0) call check(error, residual(s), 0.0_wp, trim(what)//': B x = c', thr=10*eps)
               if (allocated(error)) return
               ! again with other entries
               s%g%value = s%g%value*0.75_wp
               if (k < 3) s%a%a = s%a%a*2
               call same_band(s)
               call compare(s, difference, status)
               call check(error, difference, 0.0_wp, trim(what)//', again', thr=1.0e-12_wp)
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine test_same

   subroutine test_held(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: factors(3) = [0.5_wp, -20.0_wp, 0.0_wp]
      type(sample_type) :: s
      type(status_type) :: status
      real(wp) :: difference
      integer(int64) :: seed
      integer :: shape, number, k, n, m, p
      seed = 19
      do shape = dense, wide
         do number = 2, 4
            do k = 1, 3
               call sizes_of(shape, number, n, m, p)
               call make(s, shape, n, m, p, factors(k), seed, status)
               call compare(s, difference, status, hold_psi=.true.)
               call check(error, status%code, 0, trim(status%message))
               call check(error, s%schur%by_schur, 'by Schur')
               call check(error, difference, 0.0_wp, 'held', thr=1.0e-12_wp)
               call compare(s, difference, status, regularization=0.01_wp)
               call check(error, difference, 0.0_wp, 'regularized', thr=1.0e-12_wp)
               call compare(s, difference, status, hold_psi=.true., regularization=0.01_wp)
               call check(error, difference, 0.0_wp, 'both', thr=1.0e-12_wp)
               call check(error, s%schur%by_schur, 'by Schur, both')
               call compare(s, difference, status)
               call check(error, difference, 0.0_wp, 'with k again', thr=1.0e-12_wp)
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine test_held

   !> An entry that is zero, tiny or of the other sign: LU; the complement again when it is gone
   subroutine test_indefinite(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: bad(3) = [0.0_wp, -1.5_wp, 1.0e-310_wp]
      type(sample_type) :: s
      type(status_type) :: status
      real(wp) :: difference
      integer(int64) :: seed
      integer :: shape, k, n, m, p, j
      seed = 23
      do shape = dense, narrow
         do k = 1, 3
            call sizes_of(shape, 2, n, m, p)
            call make(s, shape, n, m, p, 0.5_wp, seed, status)
            j = 3
            call s%a%set_entry(j, j, bad(k))
            call same_band(s)
            call compare(s, difference, status)
            call check(error, status%code, 0, trim(status%message))
            call check(error, .not. s%schur%by_schur, 'by LU')
            call check(error, difference, 0.0_wp, 'the same', thr=0.0_wp)
            call s%a%set_entry(j, j, 1.0_wp)
            call same_band(s)
            call compare(s, difference, status)
            call check(error, s%schur%by_schur, 'by Schur again')
            call check(error, difference, 0.0_wp, 'and right', thr=1.0e-12_wp)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_indefinite

   !> Row 2 tends to row 1: LU takes over and names the constraint at last
   subroutine test_dependent(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s
      type(status_type) :: status
      real(wp) :: difference, part
      real(wp), allocatable :: second(:)
      integer(int64) :: seed
      integer :: k, last
      seed = 29
      do k = 1, 2
         call make(s, dense, merge(6, 60, k == 1), merge(3, 25, k == 1), 0, 0.5_wp, seed, status)
         second = s%g%value(s%n + 1:2*s%n)
         last = 0
         part = 1.0_wp
         do while (part > 1.0e-6_wp)
            s%g%value(s%n + 1:2*s%n) = 2*s%g%value(:s%n) + part*second
            call compare(s, difference, status)
            call check(error, status%code, 0, text(part)//trim(status%message))
            call check(error, residual(s), 0.0_wp, 'B x = c', thr=10*eps)
            if (allocated(error)) return
            if (s%schur%by_schur) last = last + 1
            if (.not. s%schur%by_schur) call check(error, difference, 0.0_wp, 'LU', thr=0.0_wp)
            part = part/2
         end do
         call check(error, last > 0 .and. last < 8, 'by Schur while they are far apart')
         s%g%value(s%n + 1:2*s%n) = 2*s%g%value(:s%n)
         s%g%value(s%n + 3) = s%g%value(s%n + 3)*(1 + eps)
         call s%schur%factorize(s%a, s%g, s%k, status)
         call check(error, status%code, dynstep_singular_matrix, 'singular')
         call check(error, any(s%schur%singular_equation == s%n + [1, 2]), 'one of the two')
         call check(error, index(status%message, 'constraint '//text(s%schur%singular_equation - s%n) &
            & //' of g: its row depends on those of the others') > 0, trim(status%message))
         call check(error, .not. s%schur%by_schur, 'no factors')
         call status%clear()
      end do
   end subroutine test_dependent

   !> Chains whose rods weigh 1e-6 to 1e6 times each other
   subroutine test_masses(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s
      type(status_type) :: status
      real(wp) :: difference, scale
      integer(int64) :: seed
      integer :: i, j, rods, ways(0:1)
      seed = 31
      ways = 0
      do i = 1, 200
         rods = 2 + modulo(i, 12)
         call make(s, chain, 3*rods, 2*rods, 0, 0.5_wp, seed, status)
         do j = 1, rods
            scale = 10**(merge(6, 1, modulo(i, 2) == 0)*random(seed))
            s%a%a(3*j - 2:3*j, 1) = scale*s%a%a(3*j - 2:3*j, 1)
         end do
         call same_band(s)
         call compare(s, difference, status)
         call check(error, status%code, 0, trim(status%message))
         call check(error, difference, 0.0_wp, 'x and lambda', thr=1.0e-12_wp)
         call check(error, residual(s), 0.0_wp, 'B x = c', thr=10*eps)
         if (allocated(error)) return
         ways(merge(1, 0, s%schur%by_schur)) = ways(merge(1, 0, s%schur%by_schur)) + 1
      end do
      call check(error, minval(ways) > 20, 'both ways')
   end subroutine test_masses

   !> NaN and infinity in each block: refused as by LU, in its words
   subroutine test_not_finite(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s, bad
      type(status_type) :: status, expected
      real(wp) :: x
      integer(int64) :: seed
      integer :: shape, k, n, m, p
      seed = 37
      do shape = dense, wide
         do k = 1, 6
            call sizes_of(shape, merge(2, 4, shape == narrow), n, m, p)
            call status%clear()
            call make(s, shape, n, m, p, 0.5_wp, seed, status)
            bad = s
            x = ieee_value(x, ieee_quiet_nan)
            if (modulo(k, 2) == 0) x = ieee_value(x, ieee_positive_inf)
            if (k <= 2) bad%a%a(5, 1) = x
            if (k == 3 .or. k == 4) bad%g%value(3) = x
            if (k >= 5) bad%k%value(2) = x
            call same_band(bad)
            call status%clear()
            call expected%clear()
            call bad%schur%factorize(bad%a, bad%g, bad%k, status, 1.0_wp)
            call bad%lu%factorize(bad%band, bad%g, bad%k, expected, 1.0_wp)
            call check(error, status%code, dynstep_not_finite, 'code')
            call check(error, trim(status%message), trim(expected%message))
            if (allocated(error)) return
            ! K is not looked at where psi is held
            if (k < 5) cycle
            call status%clear()
            call bad%schur%factorize(bad%a, bad%g, bad%k, status, hold_psi=.true.)
            call check(error, status%code, 0, trim(status%message))
         end do
      end do
   end subroutine test_not_finite

   !> The user's order, the one that is found, and numbers at random give the same solutions; long chains too
   subroutine test_orders(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s
      type(saddle_point_type) :: given
      type(status_type) :: status
      real(wp) :: difference
      real(wp), allocatable :: x(:)
      integer(int64) :: seed
      integer, allocatable :: order(:)
      integer, parameter :: lengths(3) = [3, 30, 1000]
      integer :: k, rods
      seed = 41
      do k = 1, 3
         rods = lengths(k)
         order = body_order(rods)
         call make(s, chain, 3*rods, 2*rods, 0, 0.5_wp, seed, status, order)
         call compare(s, difference, status)
         call check(error, status%code, 0, trim(status%message))
         call check(error, s%schur%by_schur, 'by Schur')
         call check(error, difference, 0.0_wp, 'given order', thr=1.0e-12_wp)
         x = s%b
         call s%schur%solve(x(:s%n), x(s%n + 1:s%n + s%m), x(s%n + s%m + 1:))
         deallocate (order)
         call given%init(s%n, s%m, 0, kind_diagonal, 0, 0, .true., s%g_pattern, s%k_pattern, .false., order, status)
         call given%factorize(s%a, s%g, s%k, status)
         associate (y => s%b, n => s%n, m => s%m)
            call given%solve(y(:n), y(n + 1:n + m), y(n + m + 1:))
            call check(error, maxval(abs(x - y)), 0.0_wp, 'found order', thr=1.0e-12_wp*maxval(abs(x)))
         end associate
      end do
   end subroutine test_orders

   !> The estimate is that of LU for the same matrix, where both number the unknowns alike
   subroutine test_condition(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: factors(3) = [0.5_wp, -20.0_wp, 0.0_wp]
      type(sample_type) :: s
      type(status_type) :: status
      real(wp) :: rcond, expected, difference
      integer(int64) :: seed
      integer :: k, n, m, p, number, way
      seed = 43
      do number = 2, 4
         do k = 1, 3
            do way = 1, 3
               call sizes_of(dense, number, n, m, p)
               call make(s, dense, n, m, p, factors(k), seed, status)
               call compare(s, difference, status, hold_psi=way == 2, regularization=merge(0.01_wp, 0.0_wp, way == 3))
               call s%schur%reciprocal_condition(rcond, status)
               call s%lu%reciprocal_condition(expected, status)
               call check(error, rcond, expected, 'condition', thr=1.0e-10_wp*expected)
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine test_condition

   subroutine test_copies(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s, copy
      type(status_type) :: status
      real(wp) :: difference
      real(wp), allocatable :: x(:), y(:)
      integer(int64) :: seed
      seed = 47
      call make(s, chain, 30, 20, 0, 0.5_wp, seed, status)
      call compare(s, difference, status)
      copy = s
      x = s%b
      y = s%b
      call s%schur%solve(x(:30), x(31:50), x(51:))
      s%g%value = 2*s%g%value
      call s%schur%factorize(s%a, s%g, s%k, status)
      call copy%schur%solve(y(:30), y(31:50), y(51:))
      call check(error, maxval(abs(x - y)), 0.0_wp, 'a copy has its own factors', thr=0.0_wp)
   end subroutine test_copies

   !> Every width; the pivot that is refused
   subroutine test_kernels(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: ns(4) = [1, 3, 17, 50]
      real(wp), allocatable :: f(:, :), full(:, :), x(:), b(:)
      integer(int64) :: seed
      integer :: width, k, i, j, n, failed
      seed = 53
      do width = 0, widest_band
         do k = 1, size(ns)
            n = ns(k)
            if (width >= n) cycle
            allocate (f(0:width, n + width), full(n, n), x(n + width), b(n), source=0.0_wp)
            do j = 1, n
               b(j) = random(seed)
               do i = j, min(n, j + width)
                  f(i - j, j) = random(seed)
                  if (i == j) f(0, j) = 2 + width
                  full(i, j) = f(i - j, j)
                  full(j, i) = full(i, j)
               end do
            end do
            x(:n) = b
            call band_ldl_factorize(n, width, 1.0e-3_wp, f, failed)
            call check(error, failed, 0, 'width '//text(width)//', n = '//text(n))
            call band_ldl_solve(n, width, f, x)
            call check(error, maxval(abs(matmul(full, x(:n)) - b)), 0.0_wp, 'width '//text(width)//', n = '//text(n), &
               & thr=10*n*eps*maxval(abs(x(:n)))*(2 + width))
            call check(error, maxval(abs([0.0_wp, x(n + 1:)])), 0.0_wp, 'zeros behind', thr=0.0_wp)
            ! pivot n, then pivot 1
            do i = 1, 2
               call to_band(full)
               f(0, merge(n, 1, i == 1)) = -1.0_wp
               call band_ldl_factorize(n, width, 1.0e-3_wp, f, failed)
               call check(error, failed, merge(n, 1, i == 1), 'negative pivot')
            end do
            if (width > 0) then
               ! rows n - 1 and n alike but for 1e-4
               call to_band(full)
               f(:, n - 1:) = 0.0_wp
               f(:, max(1, n - 1 - width):n - 2) = 0.0_wp
               do j = max(1, n - 1 - width), n - 2
                  f(0, j) = 1.0_wp
               end do
               f(0, n - 1) = 1.0_wp
               f(1, n - 1) = 1.0_wp
               f(0, n) = 1.0001_wp
               call band_ldl_factorize(n, width, 1.0e-3_wp, f, failed)
               call check(error, failed, n, 'small pivot')
               f(0, n - 1:n) = [1.0_wp, 1.0001_wp]
               f(1, n - 1) = 1.0_wp
               do j = 1, n - 2
                  f(:, j) = 0.0_wp
                  f(0, j) = 1.0_wp
               end do
               call band_ldl_factorize(n, width, 1.0e-5_wp, f, failed)
               call check(error, failed, 0, 'small pivot, small limit')
            end if
            deallocate (f, full, x, b)
            if (allocated(error)) return
         end do
      end do

   contains

      subroutine to_band(full)
         real(wp), intent(in) :: full(:, :)
         integer :: row, column
         f = 0.0_wp
         do column = 1, n
            do row = column, min(n, column + width)
               f(row - column, column) = full(row, column)
            end do
         end do
      end subroutine to_band
   end subroutine test_kernels
end module test_saddle_schur
