! SPDX-License-Identifier: BSD-3-Clause
!> matrix_type: products, sums, row sums and what `check` finds.
module test_matrix
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: banded_matrix, dense_matrix, diagonal_matrix, identity_matrix, kind_banded, &
      & kind_dense, kind_diagonal, kind_identity, kind_zero, matrix_type, zero_matrix
   use dynstep_status, only: dynstep_invalid_input, status_type
   use random_matrices, only: full, random, random_matrix
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_matrix

   integer, parameter :: n = 7

contains

   subroutine collect_matrix(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('constructors', test_constructors), &
         & new_unittest('products', test_products), &
         & new_unittest('sums of all kinds', test_sums), &
         & new_unittest('row sums', test_row_sums), &
         & new_unittest('unused corners of a band', test_corners), &
         & new_unittest('what check finds', test_check), &
         & new_unittest('storage is kept', test_storage)]
   end subroutine collect_matrix

   !> One matrix of each structure
   function sample(number, seed) result(matrix)
      integer, intent(in) :: number            !! 1..9
      integer(int64), intent(inout) :: seed
      type(matrix_type) :: matrix
      integer, parameter :: kinds(9) = [kind_zero, kind_identity, kind_diagonal, kind_banded, kind_banded, &
         & kind_banded, kind_banded, kind_dense, kind_dense]
      integer, parameter :: kl(9) = [0, 0, 0, 0, 1, 2, n - 1, 0, 0], ku(9) = [0, 0, 0, 0, 1, 0, n - 1, 0, 0]
      matrix = random_matrix(seed, kinds(number), n, kl(number), ku(number), number == 9, 0.0_wp)
   end function sample

   subroutine test_constructors(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: ab(3, n), a(n, n)
      integer :: i, j
      ab = reshape([(real(i, wp), i=1, 3*n)], [3, n])
      a = full(banded_matrix(ab, 1, 1))
      do j = 1, n
         do i = 1, n
            if (abs(i - j) <= 1) call check(error, a(i, j), ab(2 + i - j, j), 'band', thr=0.0_wp)
            if (abs(i - j) > 1) call check(error, a(i, j), 0.0_wp, 'outside the band', thr=0.0_wp)
         end do
      end do
      call check(error, all(abs(full(dense_matrix(a)) - a) <= 0), 'dense')
      call check(error, sum(full(diagonal_matrix(ab(1, :)))), sum(ab(1, :)), 'diagonal')
      call check(error, sum(full(identity_matrix(n))), real(n, wp), 'identity')
      call check(error, sum(abs(full(zero_matrix(n)))), 0.0_wp, 'zero')
   end subroutine test_constructors

   !> Each of n products and sums is rounded once: 2 (n+1) eps of the sum of sizes
   subroutine test_products(error)
      type(error_type), allocatable, intent(out) :: error
      type(matrix_type) :: matrix
      real(wp) :: x(n), y(n), expected(n), a(n, n)
      integer(int64) :: seed
      integer :: i, number
      seed = 1
      do number = 1, 9
         matrix = sample(number, seed)
         a = full(matrix)
         do i = 1, n
            x(i) = random(seed)
            y(i) = random(seed)
         end do
         expected = y - 0.7_wp*matmul(a, x)
         call matrix%multiply_add(-0.7_wp, x, y)
         call check(error, maxval(abs(y - expected)), 0.0_wp, 'product', thr=2*(n + 1)*n*epsilon(1.0_wp))
      end do
   end subroutine test_products

   subroutine test_sums(error)
      type(error_type), allocatable, intent(out) :: error
      type(matrix_type) :: a, s
      real(wp) :: expected(n, n)
      integer(int64) :: seed
      integer :: i, j
      seed = 2
      do i = 1, 9
         do j = 1, 9
            a = sample(i, seed)
            s = sample(j, seed)
            if (.not. contains_structure(s, a)) cycle
            expected = full(s) + 1.5_wp*full(a)
            call a%add_to(1.5_wp, s)
            call check(error, maxval(abs(full(s) - expected)), 0.0_wp, 'sum', thr=4*epsilon(1.0_wp))
         end do
      end do
   end subroutine test_sums

   !> The structure of s has room for that of a; an identity has none, its entries are not stored
   logical function contains_structure(s, a)
      type(matrix_type), intent(in) :: s, a
      integer :: s_lower, s_upper, a_lower, a_upper
      call bandwidths(s, s_lower, s_upper)
      call bandwidths(a, a_lower, a_upper)
      contains_structure = s%kind >= kind_diagonal .and. s_lower >= a_lower .and. s_upper >= a_upper
   end function contains_structure

   subroutine bandwidths(a, lower, upper)
      type(matrix_type), intent(in) :: a
      integer, intent(out) :: lower, upper
      lower = a%kl
      upper = a%ku
      if (a%kind /= kind_dense) return
      lower = n - 1
      upper = n - 1
   end subroutine bandwidths

   subroutine test_row_sums(error)
      type(error_type), allocatable, intent(out) :: error
      type(matrix_type) :: matrix
      real(wp) :: sums(n)
      integer(int64) :: seed
      integer :: number
      seed = 3
      do number = 1, 9
         matrix = sample(number, seed)
         call matrix%absolute_row_sums(sums)
         call check(error, maxval(abs(sums - sum(abs(full(matrix)), 2))), 0.0_wp, 'row sums', &
            & thr=2*n*epsilon(1.0_wp))
      end do
   end subroutine test_row_sums

   !> NaN in the corners of a band that LAPACK leaves unused is nobody's business
   subroutine test_corners(error)
      type(error_type), allocatable, intent(out) :: error
      type(matrix_type) :: matrix
      type(status_type) :: status
      real(wp) :: sums(n), y(n)
      matrix = banded_matrix(reshape(spread(1.0_wp, 1, 3*n), [3, n]), 1, 1, .true.)
      matrix%a(1, 1) = ieee_value(1.0_wp, ieee_quiet_nan)
      matrix%a(3, n) = ieee_value(1.0_wp, ieee_quiet_nan)
      call matrix%check('K', n, status)
      call check(error, .not. status%failed(), 'corners are not looked at: '//trim(status%message))
      call matrix%absolute_row_sums(sums)
      y = 0
      call matrix%multiply_add(1.0_wp, sums, y)
      call check(error, sum(y), 9.0_wp*n - 10, 'product')
      call check(error, sum(sums), 3.0_wp*n - 2, 'row sums')
   end subroutine test_corners

   subroutine test_check(error)
      type(error_type), allocatable, intent(out) :: error
      type(matrix_type) :: matrix
      real(wp) :: a(2, 2)
      a = reshape([1.0_wp, 2.0_wp, 2.0_wp, 3.0_wp], [2, 2])
      matrix = dense_matrix(a, .true.)
      call expect(error, matrix, 2, '')
      call expect(error, matrix, 3, 'K has order 2, the system has 3 coordinates')
      matrix%a(1, 2) = 2.5_wp
      call expect(error, matrix, 2, 'K is declared symmetric, but K(2,1) = 2 and K(1,2) = 2.5')
      matrix%symmetric = .false.
      call expect(error, matrix, 2, '')
      matrix%a(2, 1) = ieee_value(1.0_wp, ieee_quiet_nan)
      call expect(error, matrix, 2, 'K(2,1) is not finite')
      matrix%a(2, 1) = ieee_value(1.0_wp, ieee_positive_inf)
      call expect(error, matrix, 2, 'K(2,1) is not finite')
      matrix%kind = 7
      call expect(error, matrix, 2, 'K has the unknown kind 7')
      matrix%kind = kind_diagonal
      call expect(error, matrix, 2, 'K has storage that does not fit its kind: ' &
         & //'diagonal a(n,1), banded a(kl+ku+1,n) with 0 <= kl, ku < n, dense a(n,n)')
      matrix = banded_matrix(a, 0, 1, .true.)
      call expect(error, matrix, 2, 'K is declared symmetric with kl = 0 and ku = 1')
      call expect(error, diagonal_matrix([1.0_wp, 2.0_wp]), 2, '')
      call expect(error, identity_matrix(2), 2, '')
   end subroutine test_check

   subroutine expect(error, matrix, order, message)
      type(error_type), allocatable, intent(inout) :: error
      type(matrix_type), intent(in) :: matrix
      integer, intent(in) :: order
      character(len=*), intent(in) :: message
      type(status_type) :: status
      call matrix%check('K', order, status)
      call check(error, trim(status%message), message)
      call check(error, status%code, merge(dynstep_invalid_input, 0, message /= ''), message)
   end subroutine expect

   subroutine test_storage(error)
      type(error_type), allocatable, intent(out) :: error
      type(matrix_type), target :: matrix
      type(status_type) :: status
      real(wp), pointer :: before(:, :)
      call matrix%init(kind_banded, n, 1, 1, .true., status)
      before => matrix%a
      call matrix%set_entry(2, 1, 5.0_wp)
      call matrix%set_entry(5, 1, 5.0_wp)
      call check(error, sum(matrix%a), 5.0_wp, 'entries outside the band are not kept')
      call matrix%init(kind_banded, n, 1, 1, .true., status)
      call check(error, associated(before, matrix%a), 'a second init allocated again')
      call check(error, sum(abs(matrix%a)), 0.0_wp, 'init clears')
      call matrix%init(kind_dense, n, 0, 0, .false., status)
      call check(error, all(shape(matrix%a) == n), 'another kind has other storage')
   end subroutine test_storage
end module test_matrix
