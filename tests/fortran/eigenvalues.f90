! SPDX-License-Identifier: BSD-3-Clause
!> Eigenvalues of small dense matrices, by LAPACK, for tests: poles of M q'' + C q' + K q = 0.
module eigenvalues
   use dynstep_kinds, only: wp
   use dynstep_lapack, only: dgetrf, dgetrs
   implicit none
   private

   public :: poles_of, squared_frequencies, symmetric_squares

   interface
      !> Eigenvalues of a general matrix
      subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
         import :: wp
         character(len=1), intent(in) :: jobvl, jobvr
         integer, intent(in) :: n, lda, ldvl, ldvr, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: wr(*), wi(*), vl(ldvl, *), vr(ldvr, *), work(*)
         integer, intent(out) :: info
      end subroutine dgeev

      !> Eigenvalues of A x = lambda B x, A symmetric, B symmetric positive definite
      subroutine dsygv(itype, jobz, uplo, n, a, lda, b, ldb, w, work, lwork, info)
         import :: wp
         integer, intent(in) :: itype, n, lda, ldb, lwork
         character(len=1), intent(in) :: jobz, uplo
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         real(wp), intent(out) :: w(*), work(*)
         integer, intent(out) :: info
      end subroutine dsygv
   end interface

contains

   !> The 2n poles, ordered by imaginary, then by real part
   subroutine poles_of(m, c, k, re, im, info)
      real(wp), intent(in) :: m(:, :), c(:, :), k(:, :)    !! [n,n]
      real(wp), intent(out) :: re(:), im(:)                !! [2n]
      integer, intent(out) :: info                         !! 0, or M is singular, or no convergence
      real(wp), allocatable :: factors(:, :), right(:, :), a(:, :)
      integer, allocatable :: pivots(:)
      integer :: n, i
      n = size(m, 1)
      allocate (factors(n, n), right(n, 2*n), a(2*n, 2*n), pivots(n))
      factors = m
      right(:, :n) = -k
      right(:, n + 1:) = -c
      call dgetrf(n, n, factors, n, pivots, info)
      if (info /= 0) return
      call dgetrs('N', n, 2*n, factors, n, pivots, right, n, info)
      a = 0.0_wp
      do i = 1, n
         a(i, n + i) = 1.0_wp
      end do
      a(n + 1:, :) = right
      call eigenvalues_of(a, re, im, info)
      call sort(im, re)
   end subroutine poles_of

   !> Eigenvalues of M^-1 K, ordered by real part
   subroutine squared_frequencies(m, k, re, im, info)
      real(wp), intent(in) :: m(:, :), k(:, :)             !! [n,n]
      real(wp), intent(out) :: re(:), im(:)                !! [n]
      integer, intent(out) :: info
      real(wp), allocatable :: factors(:, :), right(:, :)
      integer, allocatable :: pivots(:)
      integer :: n
      n = size(m, 1)
      allocate (factors(n, n), right(n, n), pivots(n))
      factors = m
      right = k
      call dgetrf(n, n, factors, n, pivots, info)
      if (info /= 0) return
      call dgetrs('N', n, n, factors, n, pivots, right, n, info)
      call eigenvalues_of(right, re, im, info)
      call sort(re, im)
   end subroutine squared_frequencies

   !> The same for symmetric K and symmetric positive definite M, ascending
   subroutine symmetric_squares(m, k, squares, info)
      real(wp), intent(in) :: m(:, :), k(:, :)             !! [n,n]
      real(wp), intent(out) :: squares(:)                  !! [n]
      integer, intent(out) :: info                         !! n < info: M is not positive definite
      real(wp), allocatable :: a(:, :), b(:, :), work(:)
      integer :: n
      n = size(m, 1)
      allocate (a(n, n), b(n, n), work(34*n))
      a = k
      b = m
      call dsygv(1, 'N', 'U', n, a, n, b, n, squares, work, size(work), info)
   end subroutine symmetric_squares

   !> Eigenvalues of a, which is lost
   subroutine eigenvalues_of(a, re, im, info)
      real(wp), intent(inout) :: a(:, :)                   !! [n,n]
      real(wp), intent(out) :: re(:), im(:)                !! [n]
      integer, intent(out) :: info
      real(wp), allocatable :: work(:)
      real(wp) :: left(1, 1), right(1, 1)
      integer :: n
      n = size(a, 1)
      allocate (work(34*n))
      call dgeev('N', 'N', n, a, n, re, im, left, 1, right, 1, work, size(work), info)
   end subroutine eigenvalues_of

   !> Pairs ordered by their first, then by their second numbers
   pure subroutine sort(first, second)
      real(wp), intent(inout) :: first(:), second(:)
      real(wp) :: x(2)
      integer :: i, j
      do i = 2, size(first)
         x = [first(i), second(i)]
         do j = i - 1, 1, -1
            if (first(j) < x(1)) exit
            if (.not. first(j) > x(1) .and. second(j) <= x(2)) exit
            first(j + 1) = first(j)
            second(j + 1) = second(j)
         end do
         first(j + 1) = x(1)
         second(j + 1) = x(2)
      end do
   end subroutine sort
end module eigenvalues
