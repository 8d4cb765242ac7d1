! SPDX-License-Identifier: BSD-3-Clause
!> Factorizations of every structure: methods, solutions, scaling, condition estimates.
!>
!> Gaussian elimination and Cholesky's method solve (A + E) x = b with |E| <= 3 m u |L||U|, m the
!> operations that an entry takes part in and u = eps/2 (Higham, Accuracy and Stability of Numerical
!> Algorithms, Theorems 9.4 and 10.4).  The norm of |L||U| is a few times that of A unless pivots are
!> small, so that the backward error is asked to be below 10 m eps.
module test_linalg
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_factorization, only: factorization_type, method_band_cholesky, method_band_lu, &
      & method_dense_cholesky, method_dense_lu, method_diagonal, method_identity, method_pentadiagonal, &
      & method_small, method_tridiagonal
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: banded_matrix, diagonal_matrix, kind_banded, kind_dense, matrix_type
   use dynstep_small_factor, only: small_order
   use dynstep_status, only: status_type
   use random_matrices, only: backward_error, cases, factorize, full, kinds, kls, kus, random, random_matrix, &
      & sample, symmetric
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_linalg

   real(wp), parameter :: eps = epsilon(1.0_wp)

   !> Method of each structure at large orders
   integer, parameter :: large_method(cases) = [method_identity, method_diagonal, method_diagonal, &
      & method_tridiagonal, method_pentadiagonal, method_band_cholesky, method_band_cholesky, &
      & method_band_lu, method_band_lu, method_band_lu, method_dense_cholesky, method_dense_lu]

contains

   subroutine collect_linalg(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('solutions and methods', test_solutions), &
         & new_unittest('same answer by other ways', test_other_ways), &
         & new_unittest('indefinite matrices', test_indefinite), &
         & new_unittest('badly scaled matrices', test_scaled), &
         & new_unittest('condition estimate', test_condition), &
         & new_unittest('copies and repeated use', test_copies), &
         & new_unittest('Harwell-Boeing structures', test_harwell_boeing)]
   end subroutine collect_linalg

   !> Backward errors of both solves with right sides of size r and c
   subroutine check_solves(error, f, matrix, what, r, c, least)
      type(error_type), allocatable, intent(inout) :: error
      type(factorization_type), intent(in) :: f
      type(matrix_type), intent(in) :: matrix
      character(len=*), intent(in) :: what
      real(wp), intent(in), optional :: r(:), c(:)       !! sizes of rows and columns, default 1
      real(wp), intent(in), optional :: least            !! backward error that is allowed in any case
      real(wp) :: a(matrix%n, matrix%n), b(matrix%n), x(matrix%n), rows(matrix%n), columns(matrix%n), allowed
      integer(int64) :: seed
      integer :: i, m
      rows = 1.0_wp
      columns = 1.0_wp
      if (present(r)) rows = r
      if (present(c)) columns = c
      seed = 4
      m = matrix%n
      if (matrix%kind < kind_dense) m = min(m, 2*matrix%kl + matrix%ku + 1)
      allowed = 10*m*eps
      if (present(least)) allowed = max(allowed, least)
      a = full(matrix)
      b = [(rows(i)*random(seed), i=1, matrix%n)]
      x = b
      call f%solve(x)
      call check(error, backward_error(a, x, b, rows), 0.0_wp, what, thr=allowed)
      b = [(columns(i)*random(seed), i=1, matrix%n)]
      x = b
      call f%solve_transposed(x)
      call check(error, backward_error(transpose(a), x, b, columns), 0.0_wp, what//', transposed', thr=allowed)
   end subroutine check_solves

   subroutine test_solutions(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: orders(21) = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 15, 16, 17, 18, 20, 50, 120, 300]
      type(factorization_type) :: f
      type(matrix_type) :: matrix
      type(status_type) :: status
      character(len=40) :: what
      integer(int64) :: seed
      integer :: number, k, n, expected
      seed = 5
      do k = 1, size(orders)
         n = orders(k)
         do number = 1, cases
            if (max(kls(number), kus(number)) >= n) cycle
            matrix = sample(number, n, seed, merge(1.1_wp*n, 1.5_wp, symmetric(number)))
            if (kinds(number) == kind_banded .and. symmetric(number)) then
               matrix = sample(number, n, seed, 2*kls(number) + 1.1_wp)
            end if
            write (what, '("structure ", i0, ", order ", i0)') number, n
            call factorize(f, matrix, status)
            call check(error, .not. status%failed(), trim(what)//': '//trim(status%message))
            expected = large_method(number)
            if (n <= small_order .and. expected >= method_band_cholesky) expected = method_small
            if (n == 1 .and. kinds(number) == kind_dense) expected = method_diagonal
            call check(error, f%method, expected, trim(what)//': method')
            call check(error, f%positive_definite .or. .not. symmetric(number), trim(what)//': definite')
            call check_solves(error, f, matrix, trim(what))
            if (allocated(error)) return
         end do
      end do
   end subroutine test_solutions

   !> The same well conditioned narrow matrix by its own kernel, as a wider band, dense, and without
   !> the word symmetric: two solutions differ by twice the backward error times the condition
   subroutine test_other_ways(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(matrix_type) :: narrow
      type(status_type) :: status
      real(wp), allocatable :: x(:), b(:)
      real(wp) :: rcond, allowed
      integer(int64) :: seed
      integer :: i, k, n, way
      seed = 6
      do k = 1, 2
         do n = 8, 68, 60
            narrow = random_matrix(seed, kind_banded, n, k, k, .true., 2*k + 1.1_wp)
            b = [(random(seed), i=1, n)]
            call factorize(f, narrow, status)
            call f%reciprocal_condition(rcond, status)
            allowed = 2*10*n*eps/rcond
            x = b
            call f%solve(x)
            do way = 1, 6
               call compare(kind_banded, k + modulo(way, 3), way > 3)
            end do
            call compare(kind_dense, 0, .true.)
            call compare(kind_dense, 0, .false.)
            deallocate (b)
         end do
      end do
   contains
      subroutine compare(kind, kl, is_symmetric)
         integer, intent(in) :: kind, kl
         logical, intent(in) :: is_symmetric
         type(factorization_type) :: g
         type(matrix_type) :: other
         real(wp) :: y(n)
         call other%init(kind, n, kl, kl, is_symmetric, status)
         call narrow%add_to(1.0_wp, other)
         call factorize(g, other, status)
         y = b
         call g%solve(y)
         call check(error, maxval(abs(y - x))/maxval(abs(x)), 0.0_wp, 'another way', thr=allowed)
      end subroutine compare
   end subroutine test_other_ways

   !> A symmetric matrix with eigenvalues of both signs goes to LU, and a definite one back
   subroutine test_indefinite(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(matrix_type) :: definite, indefinite
      type(status_type) :: status
      integer(int64) :: seed
      integer :: i, k, n, number, method
      integer, parameter :: orders(4) = [7, 12, 20, 60]
      seed = 7
      do number = 1, cases
         if (.not. symmetric(number) .or. kinds(number) < kind_banded) cycle
         do k = 1, size(orders)
            n = orders(k)
            definite = sample(number, n, seed, 1.5_wp*n)
            indefinite = sample(number, n, seed, 0.0_wp)
            call indefinite%set_entry(1, 1, 0.0_wp)
            call f%init(definite%kind, n, definite%kl, definite%ku, .true., status)
            do i = 1, 2
               call f%factorize(definite, status)
               method = f%method
               call check(error, f%positive_definite, 'definite')
               call check_solves(error, f, definite, 'definite')
               call f%factorize(indefinite, status)
               call check(error, .not. f%positive_definite, 'not definite')
               call check(error, .not. status%failed(), trim(status%message))
               if (n > small_order .or. method == method_tridiagonal .or. method == method_pentadiagonal) then
                  call check(error, f%method, &
                     & merge(method_band_lu, method_dense_lu, definite%kind == kind_banded), 'LU')
               end if
               call check_solves(error, f, indefinite, 'indefinite')
            end do
         end do
      end do
      call factorize(f, diagonal_matrix([2.0_wp, -1.0_wp]), status)
      call check(error, .not. f%positive_definite, 'diagonal')
      call factorize(f, banded_matrix(reshape(real([0, 0, 1, 1, 0, 0], wp), [3, 2]), 1, 1, .true.), status)
      call check(error, .not. status%failed(), 'zero diagonal: '//trim(status%message))
   end subroutine test_indefinite

   !> Units do not make a matrix singular, nor its solution worse: symmetric matrices times
   !> 10**(-8 ... 8) from both sides, others times 10**(-4 ... 4) of their own from each side, where
   !> those with a narrow band lose digits (see most_sweeps in dynstep_scaling)
   subroutine test_scaled(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(matrix_type) :: matrix
      type(status_type) :: status
      character(len=40) :: what
      real(wp), allocatable :: r(:), c(:)
      real(wp) :: decades
      integer(int64) :: seed
      integer :: i, j, k, n, number, turn
      integer, parameter :: orders(5) = [2, 7, 12, 20, 60]
      call factorize(f, diagonal_matrix([1.0e-20_wp, 1.0_wp]), status)
      call check(error, .not. status%failed(), 'diag(1e-20,1): '//trim(status%message))
      seed = 8
      do turn = 1, 10
         do number = 2, cases
            do k = 1, size(orders)
               n = orders(k)
               if (max(kls(number), kus(number)) >= n) cycle
               matrix = sample(number, n, seed, merge(2.0_wp*kls(number) + 1.1_wp, 1.1_wp*n, kinds(number) == kind_banded))
               decades = merge(8.0_wp, 4.0_wp, symmetric(number))
               r = [(10**(decades*random(seed)), i=1, n)]
               c = [(10**(decades*random(seed)), i=1, n)]
               if (symmetric(number)) c = r
               do j = 1, n
                  do i = 1, n
                     call matrix%set_entry(i, j, r(i)*c(j)*matrix%entry(i, j))
                  end do
               end do
               if (symmetric(number)) call mirror(matrix)
               write (what, '("structure ", i0, ", order ", i0)') number, n
               call factorize(f, matrix, status)
               call check(error, .not. status%failed(), trim(what)//': '//trim(status%message))
               call check(error, f%positive_definite .or. .not. symmetric(number), trim(what)//' definite')
               call check_solves(error, f, matrix, 'scaled '//trim(what), r, c, &
                  & merge(1.0e-10_wp, 0.0_wp, kinds(number) == kind_banded .and. .not. symmetric(number)))
            end do
         end do
      end do
   end subroutine test_scaled

   !> The lower triangle into the upper one, to the last bit
   subroutine mirror(matrix)
      type(matrix_type), intent(inout) :: matrix
      integer :: i, j
      do j = 1, matrix%n
         do i = j + 1, matrix%n
            call matrix%set_entry(j, i, matrix%entry(i, j))
         end do
      end do
   end subroutine mirror

   !> Higham's estimate never exceeds |A^-1| and is rarely below a third of it
   subroutine test_condition(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(matrix_type) :: matrix
      type(status_type) :: status
      real(wp), allocatable :: inverse(:, :)
      real(wp) :: rcond, exact
      integer(int64) :: seed
      integer :: j, k, n, number
      integer, parameter :: orders(4) = [1, 7, 14, 40]
      seed = 12
      do k = 1, size(orders)
         n = orders(k)
         do number = 1, cases
            if (max(kls(number), kus(number)) >= n) cycle
            matrix = sample(number, n, seed, 0.5_wp)
            call factorize(f, matrix, status)
            call f%reciprocal_condition(rcond, status)
            call check(error, .not. status%failed(), trim(status%message))
            allocate (inverse(n, n), source=0.0_wp)
            do j = 1, n
               inverse(j, j) = 1.0_wp
               call f%solve(inverse(:, j))
            end do
            exact = 1/(maxval(sum(abs(full(matrix)), 1))*maxval(sum(abs(inverse), 1)))
            call check(error, rcond >= exact*(1 - 1.0e-6_wp), 'estimate below the condition')
            call check(error, rcond <= 3*exact, 'estimate within a factor of 3')
            deallocate (inverse)
         end do
      end do
   end subroutine test_condition

   !> A copy is independent, and the same entries give the same bits again
   subroutine test_copies(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f, g
      type(matrix_type) :: first, second
      type(status_type) :: status
      real(wp), allocatable :: x(:), y(:)
      integer(int64) :: seed
      integer :: k, n, number
      seed = 13
      do k = 1, 2
         n = 10*k
         do number = 1, cases
            first = sample(number, n, seed, 1.1_wp*n)
            second = sample(number, n, seed, merge(0.0_wp, 1.1_wp*n, symmetric(number)))
            x = spread(1.0_wp, 1, n)
            y = x
            call factorize(f, first, status)
            call f%solve(x)
            g = f
            call f%factorize(second, status)
            call g%solve(y)
            call check(error, all(abs(x - y) <= 0), 'copy')
            y = 1.0_wp
            call f%factorize(first, status)
            call f%solve(y)
            call check(error, all(abs(x - y) <= 0), 'again')
         end do
      end do
   end subroutine test_copies

   !> Stiffness matrices of real structures, where the collection lies beside the repository
   subroutine test_harwell_boeing(error)
      type(error_type), allocatable, intent(out) :: error
      character(len=2), parameter :: names(6) = ['01', '02', '05', '06', '20', '22']
      type(factorization_type) :: f
      type(matrix_type) :: k, band
      type(status_type) :: status
      real(wp), allocatable :: d(:)
      integer :: i, j
      logical :: found
      do i = 1, size(names)
         call read_matrix('bcsstk'//names(i)//'.mtx', k, found)
         if (.not. found) then
            print '(a)', 'skip linalg: no '//'shared/data/hb/bcsstk'//names(i)//'.mtx beside the repository'
            cycle
         end if
         d = [(sqrt(k%a(j, j)), j=1, k%n)]
         call factorize(f, k, status)
         call check(error, f%positive_definite, names(i)//': '//trim(status%message))
         call check_solves(error, f, k, 'bcsstk'//names(i), d, d)
         call to_band(k, .true., band)
         call factorize(f, band, status)
         call check(error, f%method, method_band_cholesky, names(i)//': '//trim(status%message))
         call check_solves(error, f, band, 'band of bcsstk'//names(i), d, d)
         call to_band(k, .false., band)
         call factorize(f, band, status)
         call check(error, f%method, method_band_lu, names(i)//': '//trim(status%message))
         call check_solves(error, f, band, 'LU of bcsstk'//names(i), d, d)
      end do
   end subroutine test_harwell_boeing

   subroutine to_band(a, is_symmetric, band)
      type(matrix_type), intent(in) :: a
      logical, intent(in) :: is_symmetric
      type(matrix_type), intent(out) :: band
      type(status_type) :: status
      integer :: i, j, width
      width = 0
      do j = 1, a%n
         do i = j + 1, a%n
            if (abs(a%a(i, j)) > 0) width = max(width, i - j)
         end do
      end do
      call band%init(kind_banded, a%n, width, width, is_symmetric, status)
      do j = 1, a%n
         do i = max(1, j - width), min(a%n, j + width)
            call band%set_entry(i, j, a%a(i, j))
         end do
      end do
   end subroutine to_band

   !> A symmetric matrix in Matrix Market's coordinate form, from ../shared/data/hb or its like further up
   subroutine read_matrix(name, matrix, found)
      character(len=*), intent(in) :: name
      type(matrix_type), intent(out) :: matrix
      logical, intent(out) :: found
      type(status_type) :: status
      character(len=200) :: path, line
      real(wp) :: value
      integer :: unit, level, i, j, k, n, entries
      found = .false.
      do level = 0, 5
         path = repeat('../', level)//'shared/data/hb/'//name
         inquire (file=path, exist=found)
         if (found) exit
      end do
      if (.not. found) return
      open (newunit=unit, file=path, action='read', status='old')
      do
         read (unit, '(a)') line
         if (line(1:1) /= '%') exit
      end do
      read (line, *) n, n, entries
      call matrix%init(kind_dense, n, 0, 0, .true., status)
      do k = 1, entries
         read (unit, *) i, j, value
         call matrix%set_entry(i, j, value)
         call matrix%set_entry(j, i, value)
      end do
      close (unit)
   end subroutine read_matrix
end module test_linalg
