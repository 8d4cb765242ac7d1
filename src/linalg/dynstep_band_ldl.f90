! SPDX-License-Identifier: BSD-3-Clause
!> Symmetric positive definite matrices of narrow band, A = L D L^T in place, where a LAPACK call for each column
!> costs more than its arithmetic.
!>
!>   f(0, k) = A(k,k), f(i, k) = A(k+i,k) in;   f(0, k) = 1/D(k,k), f(i, k) = L(k+i,k) out,   i = 1 .. width
!>
!> `width` columns of zeros follow the last one, so that no row is special.  A dense matrix of order r is a band of width
!> r - 1.  The sweeps have the form of dynstep_narrow_band: the reciprocal pivot belongs to the forward one.
module dynstep_band_ldl
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: band_ldl_factorize, band_ldl_solve

   !> Widest band of these kernels.  Measured against dpbtrf and dpbtrs of reference LAPACK, factors and solution in ns a row
   !> of 300: width 1 and 3: 10 and 7 (27 and 21), 8: 41 and 13 (47 and 21), 16: 94 and 20 (94 and 22)
   integer, parameter, public :: widest_band = 16

contains

   !> A = L D L^T; gives up where a pivot is less than least*A(k,k), vanishes or is not finite
   pure subroutine band_ldl_factorize(n, width, least, f, failed)
      integer, intent(in) :: n
      integer, intent(in) :: width                      !! subdiagonals, 0 .. widest_band
      real(wp), intent(in) :: least                     !! smallest part of A(k,k) that a pivot may be
      real(wp), intent(inout) :: f(0:width, n + width)  !! matrix in, factors out
      integer, intent(out) :: failed                    !! 0, or the pivot that is too small
      select case (width)
      case (1)
         call factorize_1(n, least, f, failed)
      case (3)
         call factorize_3(n, least, f, failed)
      case default
         call factorize_any(n, width, least, f, failed)
      end select
   end subroutine band_ldl_factorize

   pure logical function is_good(pivot, original, least)
      real(wp), intent(in) :: pivot, original, least
      is_good = pivot >= least*original .and. pivot >= tiny(pivot) .and. pivot <= huge(pivot)
   end function is_good

   pure subroutine factorize_1(n, least, f, failed)
      integer, intent(in) :: n
      real(wp), intent(in) :: least
      real(wp), intent(inout) :: f(0:1, n + 1)
      integer, intent(out) :: failed
      real(wp) :: d, r
      integer :: k
      failed = 0
      d = f(0, 1)
      do k = 1, n
         if (.not. is_good(d, f(0, k), least)) then
            failed = k
            return
         end if
         r = 1.0_wp/d
         d = f(0, k + 1) - (f(1, k)*f(1, k))*r
         f(0, k) = r
         f(1, k) = f(1, k)*r
      end do
   end subroutine factorize_1

   !> Columns k, k + 1 and k + 2 of what remains stay in registers
   pure subroutine factorize_3(n, least, f, failed)
      integer, intent(in) :: n
      real(wp), intent(in) :: least
      real(wp), intent(inout) :: f(0:3, n + 3)
      integer, intent(out) :: failed
      real(wp) :: p0, p1, p2, p3, q0, q1, s0, r, l1, l2, l3
      integer :: k
      failed = 0
      p0 = f(0, 1)
      p1 = f(1, 1)
      p2 = f(2, 1)
      q0 = f(0, 2)
      q1 = f(1, 2)
      s0 = f(0, 3)
      do k = 1, n
         if (.not. is_good(p0, f(0, k), least)) then
            failed = k
            return
         end if
         r = 1.0_wp/p0
         p3 = f(3, k)
         l1 = p1*r
         l2 = p2*r
         l3 = p3*r
         f(0, k) = r
         f(1, k) = l1
         f(2, k) = l2
         f(3, k) = l3
         p0 = q0 - (p1*p1)*r
         q0 = s0 - l2*p2
         s0 = f(0, k + 3) - l3*p3
         r = q1 - l2*p1
         q1 = f(1, k + 2) - l3*p2
         p2 = f(2, k + 1) - l3*p1
         p1 = r
      end do
   end subroutine factorize_3

   pure subroutine factorize_any(n, width, least, f, failed)
      integer, intent(in) :: n, width
      real(wp), intent(in) :: least
      real(wp), intent(inout) :: f(0:width, n + width)
      integer, intent(out) :: failed
      real(wp) :: r, l(widest_band), original(0:widest_band)
      integer :: i, j, k

      failed = 0
      do k = 1, min(n, width + 1)
         original(modulo(k, width + 1)) = f(0, k)
      end do
      do k = 1, n
         j = modulo(k, width + 1)
         if (.not. is_good(f(0, k), original(j), least)) then
            failed = k
            return
         end if
         ! A(k+width+1,k+width+1) is still what it was
         if (k + width < n) original(j) = f(0, k + width + 1)
         r = 1.0_wp/f(0, k)
         f(0, k) = r
!GCC$ novector
         do i = 1, width
            l(i) = f(i, k)*r
         end do
         do j = 1, width
!GCC$ novector
            do i = j, width
               f(i - j, k + j) = f(i - j, k + j) - l(i)*f(j, k)
            end do
         end do
!GCC$ novector
         do i = 1, width
            f(i, k) = l(i)
         end do
      end do
   end subroutine factorize_any

   !> x = A^-1 x
   pure subroutine band_ldl_solve(n, width, f, x)
      integer, intent(in) :: n, width
      real(wp), intent(in) :: f(0:width, n + width)     !! from band_ldl_factorize
      real(wp), intent(inout) :: x(n + width)           !! right side in, solution out; zeros from n + 1 on, out as well
      select case (width)
      case (1)
         call solve_1(n, f, x)
      case (3)
         call solve_3(n, f, x)
      case default
         call solve_any(n, width, f, x)
      end select
   end subroutine band_ldl_solve

   pure subroutine solve_1(n, f, x)
      integer, intent(in) :: n
      real(wp), intent(in) :: f(0:1, n + 1)
      real(wp), intent(inout) :: x(n + 1)
      real(wp) :: s
      integer :: k
      s = x(1)
      do k = 1, n
         x(k) = s*f(0, k)
         s = x(k + 1) - f(1, k)*s
      end do
      s = 0.0_wp
      do k = n, 1, -1
         s = x(k) - f(1, k)*s
         x(k) = s
      end do
   end subroutine solve_1

   pure subroutine solve_3(n, f, x)
      integer, intent(in) :: n
      real(wp), intent(in) :: f(0:3, n + 3)
      real(wp), intent(inout) :: x(n + 3)
      real(wp) :: s, s1, s2, s3
      integer :: k
      s = x(1)
      s1 = x(2)
      s2 = x(3)
      do k = 1, n
         s3 = x(k + 3) - f(3, k)*s
         s2 = s2 - f(2, k)*s
         x(k) = s*f(0, k)
         s = s1 - f(1, k)*s
         s1 = s2
         s2 = s3
      end do
      s1 = 0.0_wp
      s2 = 0.0_wp
      s3 = 0.0_wp
      do k = n, 1, -1
         s = ((x(k) - f(3, k)*s3) - f(2, k)*s2) - f(1, k)*s1
         x(k) = s
         s3 = s2
         s2 = s1
         s1 = s
      end do
   end subroutine solve_3

   pure subroutine solve_any(n, width, f, x)
      integer, intent(in) :: n, width
      real(wp), intent(in) :: f(0:width, n + width)
      real(wp), intent(inout) :: x(n + width)
      real(wp) :: s
      integer :: i, k
      do k = 1, n
         s = x(k)
!GCC$ novector
         do i = 1, width
            x(k + i) = x(k + i) - f(i, k)*s
         end do
         x(k) = s*f(0, k)
      end do
      do k = n, 1, -1
         s = x(k)
!GCC$ novector
         do i = width, 1, -1
            s = s - f(i, k)*x(k + i)
         end do
         x(k) = s
      end do
   end subroutine solve_any
end module dynstep_band_ldl
