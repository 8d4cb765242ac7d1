! SPDX-License-Identifier: BSD-3-Clause
!> Matrices that a factorization refuses, with the sentences, and those that it must not.
module test_singular
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_factorization, only: factorization_type, method_none
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: banded_matrix, dense_matrix, diagonal_matrix, kind_banded, kind_dense, &
      & kind_diagonal, kind_zero, matrix_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_finite, dynstep_singular_matrix, status_type
   use random_matrices, only: cases, factorize, kls, kus, random, sample, symmetric
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_singular

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   subroutine collect_singular(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('zero and equal rows', test_rows), &
         & new_unittest('free structures', test_free), &
         & new_unittest('nearly singular matrices pass', test_nearly_singular), &
         & new_unittest('sentences', test_sentences), &
         & new_unittest('entries that are not finite', test_not_finite), &
         & new_unittest('wrong use', test_wrong_use)]
   end subroutine collect_singular

   !> Zero rows, zero columns and equal rows are found at any place, by name
   subroutine test_rows(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(matrix_type) :: matrix
      integer(int64) :: seed
      integer :: i, j, k, m, n, number
      integer, parameter :: orders(5) = [2, 5, 14, 20, 60]
      seed = 9
      do k = 1, size(orders)
         n = orders(k)
         do number = 2, cases
            if (max(kls(number), kus(number)) >= n) cycle
            do i = 1, n, max(1, n/5)
               matrix = sample(number, n, seed, 1.1_wp*n)
               do j = 1, n
                  call matrix%set_entry(i, j, 0.0_wp)
                  if (symmetric(number)) call matrix%set_entry(j, i, 0.0_wp)
               end do
               call expect_singular(error, f, matrix, [i], 'zero row')
               matrix = sample(number, n, seed, 1.1_wp*n)
               do j = 1, n
                  call matrix%set_entry(j, i, 0.0_wp)
                  if (symmetric(number)) call matrix%set_entry(i, j, 0.0_wp)
               end do
               call expect_singular(error, f, matrix, [i], 'zero column')
               if (matrix%kind /= kind_dense) cycle
               m = merge(i - 1, n, i > 1)
               matrix = sample(number, n, seed, 1.1_wp*n)
               matrix%a(i, :) = matrix%a(m, :)
               if (symmetric(number)) matrix%a(:, i) = matrix%a(:, m)
               call expect_singular(error, f, matrix, [i, m], 'equal rows')
               matrix = sample(number, n, seed, 1.1_wp*n)
               matrix%a(:, i) = matrix%a(:, m)
               if (symmetric(number)) matrix%a(i, :) = matrix%a(m, :)
               call expect_singular(error, f, matrix, [i, m], 'equal columns')
            end do
         end do
      end do
   end subroutine test_rows

   subroutine expect_singular(error, f, matrix, equations, what)
      type(error_type), allocatable, intent(inout) :: error
      type(factorization_type), intent(inout) :: f
      type(matrix_type), intent(in) :: matrix
      integer, intent(in) :: equations(:)      !! one of these is to be named; all, where empty
      character(len=*), intent(in) :: what
      type(status_type) :: status
      real(wp) :: x(matrix%n)
      call factorize(f, matrix, status)
      call check(error, status%code, dynstep_singular_matrix, what)
      if (size(equations) > 0) call check(error, any(f%singular_equation == equations), what//': '//trim(status%message))
      call check(error, f%method, method_none, what//': method')
      x = 1.0_wp
      call f%solve(x)
      call check(error, sum(x), real(matrix%n, wp), what//': solve leaves x alone', thr=0.0_wp)
   end subroutine expect_singular

   !> Stiffness of a chain (links = 1) or a bending beam (2) of n masses, free or held at the left
   function structure(n, links, held, seed) result(k)
      integer, intent(in) :: n, links
      logical, intent(in) :: held
      integer(int64), intent(inout), optional :: seed      !! for random stiffnesses between 1 and 3
      type(matrix_type) :: k
      type(status_type) :: status
      real(wp) :: pattern(3), stiffness
      integer :: i, j, l
      pattern = merge([1.0_wp, -1.0_wp, 0.0_wp], [1.0_wp, -2.0_wp, 1.0_wp], links == 1)
      call k%init(kind_banded, n, links, links, .true., status)
      do i = merge(1 - links, 1, held), n - links
         stiffness = 1.0_wp
         if (present(seed)) stiffness = 2 + random(seed)
         do j = 0, links
            do l = 0, links
               if (min(i + j, i + l) < 1) cycle
               call k%set_entry(i + j, i + l, k%entry(i + j, i + l) + stiffness*pattern(j + 1)*pattern(l + 1))
            end do
         end do
      end do
   end function structure

   !> A structure that may move as a rigid body is singular, and regular with its mass
   subroutine test_free(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(matrix_type) :: k, other
      type(status_type) :: status
      integer(int64) :: seed
      integer :: i, links, n, turn
      integer, parameter :: orders(5) = [3, 14, 40, 300, 3000]
      seed = 10
      do links = 1, 2
         do i = 1, size(orders)
            n = orders(i)
            do turn = 1, 5
               k = structure(n, links, .false., seed)
               call expect_singular(error, f, k, [integer ::], 'free structure')
               k = structure(n, links, .true., seed)
               call factorize(f, k, status)
               call check(error, f%positive_definite, 'held structure: '//trim(status%message))
               k = structure(n, links, .false., seed)
               if (n <= 300) then
                  call other%init(kind_dense, n, 0, 0, turn > 2, status)
                  call k%add_to(1.0_wp, other)
                  if (turn < 5) call expect_singular(error, f, other, [integer ::], 'free structure, dense')
                  call other%init(kind_banded, n, links, links, .false., status)
                  call k%add_to(1.0_wp, other)
                  call expect_singular(error, f, other, [integer ::], 'free structure, band')
               end if
               call other%init(kind_banded, n, links, links, .true., status)
               call k%add_to(1.0e-6_wp, other)
               call diagonal_add(other, 1.0e-9_wp)
               call factorize(f, other, status)
               call check(error, f%positive_definite, 'with mass: '//trim(status%message))
            end do
         end do
      end do
   end subroutine test_free

   subroutine diagonal_add(matrix, value)
      type(matrix_type), intent(inout) :: matrix
      real(wp), intent(in) :: value
      integer :: i
      do i = 1, matrix%n
         call matrix%set_entry(i, i, matrix%entry(i, i) + value)
      end do
   end subroutine diagonal_add

   !> Ill conditioned is not singular
   subroutine test_nearly_singular(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(matrix_type) :: matrix
      type(status_type) :: status
      real(wp) :: rcond, a(2, 2)
      a = reshape([1.0_wp, 1.0_wp - 1.0e-13_wp, 1.0_wp - 1.0e-13_wp, 1.0_wp], [2, 2])
      call factorize(f, dense_matrix(a, .true.), status)
      call check(error, f%positive_definite, 'two equations: '//trim(status%message))
      call factorize(f, dense_matrix(a), status)
      call check(error, .not. status%failed(), 'two equations: '//trim(status%message))
      matrix = structure(5000, 2, .true.)
      call factorize(f, matrix, status)
      call f%reciprocal_condition(rcond, status)
      call check(error, f%positive_definite, 'long beam: '//trim(status%message))
      call check(error, rcond > 2*eps .and. rcond < 1.0e-12_wp, 'long beam: condition')
      matrix = structure(100, 1, .false.)
      call matrix%set_entry(1, 1, 1.0_wp + 1.0e-11_wp)
      call factorize(f, matrix, status)
      call check(error, f%positive_definite, 'soft spring: '//trim(status%message))
   end subroutine test_nearly_singular

   subroutine test_sentences(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(matrix_type) :: matrix
      type(status_type) :: status
      call f%init(kind_diagonal, 2, 0, 0, .true., status)
      call f%factorize(diagonal_matrix([1.0_wp, 0.0_wp]), status, 0.25_wp, 'mass matrix')
      call check(error, trim(status%message), &
         & 'the mass matrix is singular at t = 0.25, equation 2: its diagonal entry is zero')
      call status%clear()
      call f%init(kind_dense, 3, 0, 0, .false., status)
      matrix = dense_matrix(reshape(real([1, 0, 2, 1, 0, 0, 3, 0, 4], wp), [3, 3]))
      call f%factorize(matrix, status, 0.5_wp)
      call check(error, trim(status%message), 'the matrix is singular at t = 0.5, equation 2: its row is zero')
      call status%clear()
      matrix%a = transpose(matrix%a)
      call f%factorize(matrix, status, name='effective matrix')
      call check(error, trim(status%message), 'the effective matrix is singular, equation 2: its column is zero')
      call status%clear()
      matrix%a = 1.0_wp
      matrix%a(1, 1) = 2.0_wp
      call f%factorize(matrix, status)
      call check(error, trim(status%message), &
         & 'the matrix is singular, equation 3: its row depends on those of the others')
      call f%init(kind_dense, 2, 0, 0, .false., status)
      call check(error, f%n, 3, 'a call on a failed status returns at once')
      call f%factorize(matrix, status)
      call check(error, f%singular_equation, 3, 'a call on a failed status returns at once')
   end subroutine test_sentences

   subroutine test_not_finite(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(matrix_type) :: matrix
      type(status_type) :: status
      integer(int64) :: seed
      integer :: k, n, number
      seed = 11
      do k = 1, 3
         n = 5*k**2
         do number = 2, cases
            if (max(kls(number), kus(number)) >= n) cycle
            matrix = sample(number, n, seed, 1.1_wp*n)
            call matrix%set_entry(n - 1, n - 1, &
               & ieee_value(1.0_wp, merge(ieee_quiet_nan, ieee_positive_inf, modulo(number, 2) == 0)))
            call factorize(f, matrix, status)
            call check(error, status%code, dynstep_not_finite, 'code')
            call check(error, f%method, method_none, 'method')
         end do
      end do
      call status%clear()
      call f%factorize(matrix, status, 1.5_wp, 'mass matrix')
      call check(error, trim(status%message), 'the mass matrix is not finite at t = 1.5: row 44, column 44')
   end subroutine test_not_finite

   subroutine test_wrong_use(error)
      type(error_type), allocatable, intent(out) :: error
      type(factorization_type) :: f
      type(status_type) :: status
      call f%factorize(diagonal_matrix([1.0_wp]), status)
      call check(error, status%code, dynstep_invalid_input, 'factorize before init')
      call expect_invalid(kind_zero, 3, 0, 0, .true.)
      call expect_invalid(kind_dense, 0, 0, 0, .true.)
      call expect_invalid(kind_banded, 3, 3, 0, .false.)
      call expect_invalid(kind_banded, 3, 0, -1, .false.)
      call expect_invalid(kind_banded, 3, 0, 1, .true.)
      call status%clear()
      call f%init(kind_banded, 3, 1, 1, .true., status)
      call f%factorize(banded_matrix(reshape(spread(1.0_wp, 1, 6), [2, 3]), 1, 0), status)
      call check(error, status%code, dynstep_invalid_input, 'another band')
   contains
      subroutine expect_invalid(kind, n, kl, ku, is_symmetric)
         integer, intent(in) :: kind, n, kl, ku
         logical, intent(in) :: is_symmetric
         call status%clear()
         call f%init(kind, n, kl, ku, is_symmetric, status)
         call check(error, status%code, dynstep_invalid_input, 'init')
      end subroutine expect_invalid
   end subroutine test_wrong_use
end module test_singular
