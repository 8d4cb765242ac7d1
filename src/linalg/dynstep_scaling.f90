! SPDX-License-Identifier: BSD-3-Clause
!> Norm and natural scales of a matrix, against which a pivot is judged.
!>
!> Coordinates of a mechanical system have different units (metres, radians, modal
!> amplitudes), so that the size of a pivot alone says nothing: diag(1e-20, 1) is as
!> regular as a matrix can be.  A pivot is compared with what it started from:
!>
!>   symmetric positive definite   d(k) / A(k,k), the pivot of D A D with unit diagonal
!>   all others                    |u(k,k)| r(i) c(k), the pivot of R A C whose largest
!>                                 entry in each row and column is near 1
module dynstep_scaling
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, matrix_type
   implicit none
   private

   public :: one_norm, reciprocal_power, row_column_scales

   !> Scaled pivots below this one call for a condition estimate.  A rigid body's vanishing
   !> pivot keeps a rounding error of about eps*n**3/3 on a free bending chain, which stays
   !> below 1e-5 up to n = 5000; pivots of M + beta h**2 K seldom come near it.
   real(wp), parameter, public :: suspicious_pivot = 1.0e-5_wp

   !> Scaled pivots below this one are nothing but rounding error, without an estimate
   real(wp), parameter, public :: vanished_pivot = 1.0e-3_wp*epsilon(1.0_wp)

contains

   !> Largest absolute column sum; finite = .false. where an entry (or the sum) is not
   pure subroutine one_norm(matrix, norm, finite)
      type(matrix_type), intent(in) :: matrix   !! banded or dense
      real(wp), intent(out) :: norm
      logical, intent(out) :: finite
      real(wp) :: column
      integer :: i, j, first, last

      norm = 0.0_wp
      finite = .true.
      do j = 1, matrix%n
         column = 0.0_wp
         call stored_rows(matrix, j, first, last)
         do i = first, last
            column = column + abs(matrix%a(i, j))
         end do
         finite = ieee_is_finite(column)
         if (.not. finite) return
         if (column > norm) norm = column
      end do
   end subroutine one_norm

   !> Powers of two r, c that bring the largest entry of each row and column of R A C
   !> near 1 (between 1/2 and 1 for the rows before c is applied), as LAPACK's DGEEQU
   pure subroutine row_column_scales(matrix, r, c, zero_row, zero_column)
      type(matrix_type), intent(in) :: matrix   !! banded or dense, finite
      real(wp), intent(out) :: r(matrix%n)      !! row scales
      real(wp), intent(out) :: c(matrix%n)      !! column scales
      integer, intent(out) :: zero_row          !! first row of zeros, 0 if there is none
      integer, intent(out) :: zero_column       !! first column of zeros, 0 if there is none
      real(wp) :: largest
      integer :: i, j, first, last, shift

      zero_row = 0
      zero_column = 0
      r = 0.0_wp
      do j = 1, matrix%n
         call stored_rows(matrix, j, first, last)
         shift = row_shift(matrix, j)
         do i = first, last
            r(i + shift) = max(r(i + shift), abs(matrix%a(i, j)))
         end do
      end do
      do i = matrix%n, 1, -1
         if (.not. r(i) > 0.0_wp) zero_row = i
         r(i) = reciprocal_power(r(i))
      end do
      do j = matrix%n, 1, -1
         call stored_rows(matrix, j, first, last)
         shift = row_shift(matrix, j)
         largest = 0.0_wp
         do i = first, last
            largest = max(largest, r(i + shift)*abs(matrix%a(i, j)))
         end do
         if (.not. largest > 0.0_wp) zero_column = j
         c(j) = reciprocal_power(largest)
      end do
   end subroutine row_column_scales

   !> Power of two near 1/x, so that scaling rounds nothing; 1 for x = 0
   pure real(wp) function reciprocal_power(x)
      real(wp), intent(in) :: x   !! x >= 0
      integer, parameter :: largest = maxexponent(1.0_wp) - 24
      reciprocal_power = 1.0_wp
      if (x > 0.0_wp) reciprocal_power = scale(1.0_wp, max(-largest, min(largest, -exponent(x))))
   end function reciprocal_power

   !> Rows first..last of the storage that column j uses
   pure subroutine stored_rows(matrix, j, first, last)
      type(matrix_type), intent(in) :: matrix
      integer, intent(in) :: j
      integer, intent(out) :: first, last
      first = 1
      last = matrix%n
      if (matrix%kind /= kind_banded) return
      first = matrix%ku + 1 + max(1, j - matrix%ku) - j
      last = matrix%ku + 1 + min(matrix%n, j + matrix%kl) - j
   end subroutine stored_rows

   !> Row of the matrix minus row of the storage
   pure integer function row_shift(matrix, j)
      type(matrix_type), intent(in) :: matrix
      integer, intent(in) :: j
      row_shift = 0
      if (matrix%kind == kind_banded) row_shift = j - matrix%ku - 1
   end function row_shift
end module dynstep_scaling
