! SPDX-License-Identifier: BSD-3-Clause
!> Symmetric tridiagonal and pentadiagonal matrices, A = L D L^T without pivoting.
!>
!>   L(i,i) = 1, L(i+1,i) = l1(i), L(i+2,i) = l2(i), dinv(i) = 1/D(i,i)
!>
!> The arrays have n elements each, with zeros where L ends, so that kernels that fuse a
!> time step with the two sweeps need no special last rows:
!>
!>   forward    s(i) = b(i) - l1(i-1)*s(i-1) - l2(i-2)*s(i-2),   z(i) = s(i)*dinv(i)
!>   backward   x(i) = z(i) - l1(i)*x(i+1) - l2(i)*x(i+2)
!>
!> The reciprocal pivot belongs to the forward sweep, where it is off the chain of dependent
!> operations: one multiplication and one subtraction per row and sweep remain on it
!> (measured 2.7 against 3.3 ns per row with the pivot in the backward sweep).
!> A pivot that is not positive ends the factorization: the matrix is not definite and wants
!> pivoting, which is another factorization's business.  The norm and the search for NaN cost
!> nothing beside the division of each row (11 ns per row; 17 with a sweep of their own).
module dynstep_narrow_band
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_scaling, only: suspicious_pivot
   implicit none
   private

   public :: tridiagonal_factorize, tridiagonal_solve
   public :: pentadiagonal_factorize, pentadiagonal_solve

contains

   !> L D L^T of a tridiagonal matrix in band storage; reads the lower triangle
   pure subroutine tridiagonal_factorize(n, ab, dinv, l1, norm, failed, weakest, ratio)
      integer, intent(in) :: n
      real(wp), intent(in) :: ab(3, n)         !! band storage, kl = ku = 1
      real(wp), intent(out) :: dinv(n)         !! reciprocal pivots
      real(wp), intent(out) :: l1(n)           !! subdiagonal of L, l1(n) = 0
      real(wp), intent(out) :: norm            !! 1-norm, where failed = 0
      integer, intent(out) :: failed           !! first row not finite or pivot not positive, or 0
      integer, intent(out) :: weakest          !! row of the smallest suspicious pivot, or 0
      real(wp), intent(out) :: ratio           !! that pivot / A(k,k)
      real(wp) :: d, l, above, row
      integer :: i

      norm = 0.0_wp
      failed = 0
      weakest = 0
      ratio = suspicious_pivot
      d = ab(2, 1)
      above = 0.0_wp
      do i = 1, n
         row = above + abs(ab(2, i))
         if (i < n) then
            above = abs(ab(3, i))
            row = row + above
         end if
         if (.not. ieee_is_finite(row)) then
            failed = i
            return
         end if
         norm = max(norm, row)
         if (d < ratio*ab(2, i) .or. d < tiny(d)) then
            if (d < tiny(d)) then
               failed = i
               return
            end if
            weakest = i
            ratio = d/ab(2, i)
         end if
         dinv(i) = 1.0_wp/d
         if (i == n) exit
         l = ab(3, i)/d
         l1(i) = l
         d = ab(2, i + 1) - l*ab(3, i)
      end do
      l1(n) = 0.0_wp
   end subroutine tridiagonal_factorize

   !> x = A^-1 x
   pure subroutine tridiagonal_solve(n, dinv, l1, x)
      integer, intent(in) :: n
      real(wp), intent(in) :: dinv(n), l1(n)   !! from tridiagonal_factorize
      real(wp), intent(inout) :: x(n)          !! right side in, solution out
      real(wp) :: s
      integer :: i

      s = x(1)
      x(1) = s*dinv(1)
      do i = 2, n
         s = x(i) - l1(i - 1)*s
         x(i) = s*dinv(i)
      end do
      s = x(n)
      do i = n - 1, 1, -1
         s = x(i) - l1(i)*s
         x(i) = s
      end do
   end subroutine tridiagonal_solve

   !> L D L^T of a pentadiagonal matrix in band storage; reads the lower triangle
   pure subroutine pentadiagonal_factorize(n, ab, dinv, l1, l2, norm, failed, weakest, ratio)
      integer, intent(in) :: n
      real(wp), intent(in) :: ab(5, n)         !! band storage, kl = ku = 2
      real(wp), intent(out) :: dinv(n)         !! reciprocal pivots
      real(wp), intent(out) :: l1(n), l2(n)    !! subdiagonals of L, l1(n) = l2(n-1) = l2(n) = 0
      real(wp), intent(out) :: norm            !! 1-norm, where failed = 0
      integer, intent(out) :: failed           !! first row not finite or pivot not positive, or 0
      integer, intent(out) :: weakest          !! row of the smallest suspicious pivot, or 0
      real(wp), intent(out) :: ratio           !! that pivot / A(k,k)
      real(wp) :: d          ! pivot i
      real(wp) :: e          ! D(i,i) L(i+1,i)
      real(wp) :: l, m       ! L(i+1,i), L(i+2,i)
      real(wp) :: next_d, next_e, after_d   ! rows i+1 and i+2 so far
      real(wp) :: above, above2, row        ! |A(i,i-1)| + |A(i,i-2)|, |A(i+1,i-1)|, sum of row i
      integer :: i

      norm = 0.0_wp
      failed = 0
      weakest = 0
      ratio = suspicious_pivot
      above = 0.0_wp
      above2 = 0.0_wp
      d = ab(3, 1)
      e = 0.0_wp
      if (n > 1) e = ab(4, 1)
      next_d = 0.0_wp
      if (n > 1) next_d = ab(3, 2)
      do i = 1, n
         row = above + abs(ab(3, i))
         above = above2
         above2 = 0.0_wp
         if (i < n) then
            row = row + abs(ab(4, i))
            above = above + abs(ab(4, i))
         end if
         if (i + 1 < n) then
            row = row + abs(ab(5, i))
            above2 = abs(ab(5, i))
         end if
         if (.not. ieee_is_finite(row)) then
            failed = i
            return
         end if
         norm = max(norm, row)
         if (d < ratio*ab(3, i) .or. d < tiny(d)) then
            if (d < tiny(d)) then
               failed = i
               return
            end if
            weakest = i
            ratio = d/ab(3, i)
         end if
         dinv(i) = 1.0_wp/d
         l = e/d
         m = 0.0_wp
         next_e = 0.0_wp
         after_d = 0.0_wp
         if (i + 2 <= n) then
            m = ab(5, i)/d
            next_e = ab(4, i + 1) - m*e
            after_d = ab(3, i + 2) - m*ab(5, i)
         end if
         l1(i) = l
         l2(i) = m
         d = next_d - l*e
         e = next_e
         next_d = after_d
      end do
   end subroutine pentadiagonal_factorize

   !> x = A^-1 x
   pure subroutine pentadiagonal_solve(n, dinv, l1, l2, x)
      integer, intent(in) :: n
      real(wp), intent(in) :: dinv(n), l1(n), l2(n)   !! from pentadiagonal_factorize
      real(wp), intent(inout) :: x(n)                 !! right side in, solution out
      real(wp) :: s, s1, s2
      integer :: i

      s2 = 0.0_wp
      s1 = x(1)
      x(1) = s1*dinv(1)
      if (n > 1) then
         s2 = s1
         s1 = x(2) - l1(1)*s1
         x(2) = s1*dinv(2)
      end if
      do i = 3, n
         s = (x(i) - l2(i - 2)*s2) - l1(i - 1)*s1
         x(i) = s*dinv(i)
         s2 = s1
         s1 = s
      end do
      s1 = 0.0_wp
      s2 = 0.0_wp
      do i = n, 1, -1
         s = (x(i) - l2(i)*s2) - l1(i)*s1
         x(i) = s
         s2 = s1
         s1 = s
      end do
   end subroutine pentadiagonal_solve
end module dynstep_narrow_band
