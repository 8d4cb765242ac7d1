! SPDX-License-Identifier: BSD-3-Clause
!> Reproducible random matrices of every structure, for the tests of linear algebra.
module random_matrices
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_identity, matrix_type
   use dynstep_status, only: status_type
   implicit none
   private

   public :: backward_error, factorize, full, random, random_matrix, sample

   !> Structures: kind, bandwidths, symmetry
   integer, parameter, public :: cases = 12
   integer, parameter, public :: kinds(cases) = [kind_identity, kind_diagonal, kind_banded, kind_banded, kind_banded, &
      & kind_banded, kind_banded, kind_banded, kind_banded, kind_banded, kind_dense, kind_dense]
   integer, parameter, public :: kls(cases) = [0, 0, 0, 1, 2, 3, 6, 1, 3, 0, 0, 0]
   integer, parameter, public :: kus(cases) = [0, 0, 0, 1, 2, 3, 6, 1, 1, 2, 0, 0]
   logical, parameter, public :: symmetric(cases) = [.true., .true., .false., .true., .true., .true., .true., &
      & .false., .false., .false., .true., .false.]

contains

   !> Next number of a sequence, uniform in (-1, 1); `seed` > 0 (Park and Miller's generator)
   real(wp) function random(seed)
      integer(int64), intent(inout) :: seed
      seed = modulo(48271_int64*seed, 2147483647_int64)
      random = 2*(real(seed, wp)/2147483647.0_wp) - 1
   end function random

   !> Entries in (-1, 1), `dominance` added to the diagonal
   function random_matrix(seed, kind, n, kl, ku, symmetric, dominance) result(matrix)
      integer(int64), intent(inout) :: seed
      integer, intent(in) :: kind, n, kl, ku
      logical, intent(in) :: symmetric
      real(wp), intent(in) :: dominance
      type(matrix_type) :: matrix
      type(status_type) :: status
      integer :: i, j
      call matrix%init(kind, n, kl, ku, symmetric, status)
      if (kind <= kind_identity) return
      do j = 1, n
         do i = 1, n
            if (kind == kind_diagonal .and. i /= j) cycle
            if (kind == kind_banded .and. (i - j > kl .or. j - i > ku)) cycle
            call matrix%set_entry(i, j, random(seed))
            if (symmetric .and. i < j) call matrix%set_entry(i, j, matrix%entry(j, i))
            if (i == j) call matrix%set_entry(i, j, matrix%entry(i, j) + dominance)
         end do
      end do
   end function random_matrix

   !> Structure `number` at order n
   function sample(number, n, seed, dominance) result(matrix)
      integer, intent(in) :: number, n
      integer(int64), intent(inout) :: seed
      real(wp), intent(in) :: dominance
      type(matrix_type) :: matrix
      matrix = random_matrix(seed, kinds(number), n, kls(number), kus(number), symmetric(number), dominance)
   end function sample

   !> A new factorization of a matrix
   subroutine factorize(f, matrix, status)
      type(factorization_type), intent(inout) :: f
      type(matrix_type), intent(in) :: matrix
      type(status_type), intent(out) :: status
      call f%init(matrix%kind, matrix%n, matrix%kl, matrix%ku, matrix%symmetric, status)
      call f%factorize(matrix, status)
   end subroutine factorize

   !> All entries of a matrix
   function full(matrix) result(a)
      type(matrix_type), intent(in) :: matrix
      real(wp) :: a(matrix%n, matrix%n)
      integer :: i, j
      do j = 1, matrix%n
         do i = 1, matrix%n
            a(i, j) = matrix%entry(i, j)
         end do
      end do
   end function full

   !> Backward error in rows of size r: x solves a system with a matrix A + E and a right side b + e,
   !> E and e at most this part of r(i) |x| norm(A/r) and of r(i) norm(b/r)
   real(wp) function backward_error(a, x, b, r)
      real(wp), intent(in) :: a(:, :), x(:), b(:), r(:)
      real(wp) :: residual, sizes
      integer :: i
      residual = 0.0_wp
      sizes = tiny(1.0_wp)
      do i = 1, size(b)
         residual = max(residual, abs(dot_product(a(i, :), x) - b(i))/r(i))
         sizes = max(sizes, (dot_product(abs(a(i, :)), abs(x)) + abs(b(i)))/r(i))
      end do
      backward_error = residual/sizes
   end function backward_error
end module random_matrices
