! SPDX-License-Identifier: BSD-3-Clause
!> Sums and natural scales of a matrix, against which a pivot is judged.
!>
!> Coordinates of a mechanical system have different units (metres, radians, modal
!> amplitudes), so that the size of a pivot alone says nothing: diag(1e-20, 1) is as
!> regular as a matrix can be.  A pivot is compared with what it started from:
!>
!>   symmetric positive definite   d(k) / A(k,k), the pivot of D A D with unit diagonal
!>   all others                    |u(k,k)| r(i) c(k), the pivot of R A C whose absolute
!>                                 row and column sums are near 1
!>
!> Sums rather than largest entries, since a loop of sums runs in vector registers.
module dynstep_scaling
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, matrix_type
   implicit none
   private

   public :: absolute_sum, one_norm, reciprocal_power, row_column_scales

   !> Scaled pivots below this one call for a condition estimate.  A rigid body's vanishing
   !> pivot keeps a rounding error of about eps*n**3/3 on a free bending chain, which stays
   !> below 1e-5 up to n = 5000; pivots of M + beta h**2 K seldom come near it.
   real(wp), parameter, public :: suspicious_pivot = 1.0e-5_wp

   !> Scaled pivots below this one are nothing but rounding error, without an estimate
   real(wp), parameter, public :: vanished_pivot = 1.0e-3_wp*epsilon(1.0_wp)

   !> Limit of sweeps that bring rows and columns to a common size; two or three do for most.  Measured:
   !> D1 A D2 with D1, D2 = 10**(-4...4) at random is solved with backward errors (in the units of A)
   !> below 1e-15 where A is full (1e-13 without the iteration), and below 1e-11 where it is a narrow
   !> band with a strong diagonal, where sizes travel one row a sweep.  With 10**(-8...8) such
   !> bands reach 5e-8, and one in 2000 is refused as singular; 20 sweeps change neither.
   integer, parameter, public :: most_sweeps = 5

contains

   !> Largest absolute column sum; finite = .false. where an entry (or the sum) is not
   pure subroutine one_norm(matrix, norm, finite)
      type(matrix_type), intent(in) :: matrix   !! banded or dense
      real(wp), intent(out) :: norm
      logical, intent(out) :: finite
      real(wp) :: column
      integer :: j, first, last

      norm = 0.0_wp
      finite = .true.
      do j = 1, matrix%n
         call stored_rows(matrix, j, first, last)
         column = absolute_sum(last - first + 1, matrix%a(first:last, j))
         finite = ieee_is_finite(column)
         if (.not. finite) return
         if (column > norm) norm = column
      end do
   end subroutine one_norm

   !> Powers of two r, c that bring the absolute row and column sums of R A C near 1: Sinkhorn and
   !> Knopp's iteration r = 1/(|A| c), c = 1/(|A|^T r), whose limit does not depend on the units of
   !> A.  It ends when no column changes by 16 times.  `needed` tells whether the scales differ
   !> enough (16 times) to choose other pivots.
   pure subroutine row_column_scales(matrix, r, c, needed, empty)
      type(matrix_type), intent(in) :: matrix   !! banded or dense, finite
      real(wp), intent(out) :: r(matrix%n)      !! row scales
      real(wp), intent(out) :: c(matrix%n)      !! column scales
      logical, intent(out) :: needed            !! rows or columns differ in size
      integer, intent(out) :: empty             !! i > 0: row i is zero, j < 0: column -j is zero
      logical :: rows_differ, columns_differ, settled
      real(wp) :: column
      integer :: i, j, n, sweep, first, last, shift

      n = matrix%n
      empty = 0
      needed = .false.
      c = 1.0_wp
      columns_differ = .false.
      shift = 0
      do sweep = 1, most_sweeps
         r = 0.0_wp
         do j = 1, n
            call stored_rows(matrix, j, first, last)
            if (matrix%kind == kind_banded) shift = j - matrix%ku - 1
            call add_absolute(last - first + 1, c(j), matrix%a(first:last, j), r(first + shift:last + shift))
         end do
         do i = 1, n
            if (r(i) > 0.0_wp) cycle
            empty = i
            return
         end do
         call to_scales(n, r, rows_differ)
         settled = .true.
         do j = 1, n
            call stored_rows(matrix, j, first, last)
            if (matrix%kind == kind_banded) shift = j - matrix%ku - 1
            if (rows_differ) then
               column = 0.0_wp
               do i = first, last
                  column = column + r(i + shift)*abs(matrix%a(i, j))
               end do
            else
               column = r(1)*absolute_sum(last - first + 1, matrix%a(first:last, j))
            end if
            if (.not. column > 0.0_wp) then
               empty = -j
               return
            end if
            settled = settled .and. column*c(j) < 16.0_wp .and. column*c(j) > 1.0_wp/16
            c(j) = column
         end do
         call to_scales(n, c, columns_differ)
         if (settled) exit
      end do
      needed = rows_differ .or. columns_differ
   end subroutine row_column_scales

   !> x = powers of two near 1/x; all the same where the x are within a factor of 16
   pure subroutine to_scales(n, x, differ)
      integer, intent(in) :: n
      real(wp), intent(inout) :: x(n)     !! sums > 0 in, scales out
      logical, intent(out) :: differ
      real(wp) :: largest
      integer :: i
      largest = maxval(x)
      differ = minval(x) < largest/16
      if (differ) then
         do i = 1, n
            x(i) = reciprocal_power(x(i))
         end do
      else
         x = reciprocal_power(largest)
      end if
   end subroutine to_scales

   !> y = y + c |x|
   pure subroutine add_absolute(n, c, x, y)
      integer, intent(in) :: n
      real(wp), intent(in) :: c
      real(wp), intent(in) :: x(n)
      real(wp), intent(inout) :: y(n)
      y = y + c*abs(x)
   end subroutine add_absolute

   !> Sum of |x|, in four parts that do not wait for each other
   pure real(wp) function absolute_sum(n, x)
      integer, intent(in) :: n
      real(wp), intent(in) :: x(n)
      real(wp) :: s1, s2, s3, s4
      integer :: i
      s1 = 0.0_wp
      s2 = 0.0_wp
      s3 = 0.0_wp
      s4 = 0.0_wp
      do i = 1, n - 3, 4
         s1 = s1 + abs(x(i))
         s2 = s2 + abs(x(i + 1))
         s3 = s3 + abs(x(i + 2))
         s4 = s4 + abs(x(i + 3))
      end do
      do i = n - modulo(n, 4) + 1, n
         s1 = s1 + abs(x(i))
      end do
      absolute_sum = (s1 + s2) + (s3 + s4)
   end function absolute_sum

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
end module dynstep_scaling
