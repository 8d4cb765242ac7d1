! SPDX-License-Identifier: BSD-3-Clause
!> Dense systems of order n <= 16, where a LAPACK call costs more than its arithmetic.
!>
!>   P A = L D U with unit triangles: f(i,j) = L(i,j) below the diagonal, U(i,j) above it,
!>   f(i,i) = 1/D(i,i); row i of P A is row p(i) of A.  For a symmetric positive definite
!>   matrix U = L^T and p(i) = i, and the same solve serves.
!>
!> Rows are compared for the pivot after scaling to a common size, so that units do not choose
!> it.  The reciprocal pivot is applied between the sweeps, off the chain of
!> dependent operations.  Loops are kept scalar: a vector store followed by narrower loads
!> defeats store forwarding (measured at n = 8: 216 against 131 ns in a generic step).
module dynstep_small_factor
   use dynstep_kinds, only: wp
   use dynstep_scaling, only: most_sweeps, suspicious_pivot
   implicit none
   private

   public :: small_factorize_symmetric, small_factorize, small_equation_of
   public :: small_solve, small_solve_transposed

   !> Largest order of these kernels.  Measured against reference LAPACK, LU and solve in ns:
   !> n = 4: 140 and 24 (dgetrf 320, dgetrs 100), n = 8: 370 and 91 (860 and 187), n = 16: 1700 and
   !> 210 (2990 and 450), still 1.5 times faster at n = 24.  A tuned BLAS will overtake earlier.
   integer, parameter, public :: small_order = 16

contains

   !> A = L D L^T of a symmetric matrix, in place; reads the lower triangle
   pure subroutine small_factorize_symmetric(n, f, p, failed, weakest, ratio)
      integer, intent(in) :: n                 !! 1..small_order
      real(wp), intent(inout) :: f(n, n)       !! matrix in, factors out
      integer, intent(out) :: p(n)             !! 1, 2, ..., n
      integer, intent(out) :: failed           !! first pivot that is not positive, or 0
      integer, intent(out) :: weakest          !! row of the smallest suspicious pivot, or 0
      real(wp), intent(out) :: ratio           !! that pivot / A(k,k)
      real(wp) :: d, original(small_order)
      integer :: i, j, k

      failed = 0
      weakest = 0
      ratio = suspicious_pivot
      do k = 1, n
         p(k) = k
         original(k) = f(k, k)
      end do
      do k = 1, n
         d = f(k, k)
         if (d < ratio*original(k) .or. d < tiny(d)) then
            if (d < tiny(d)) then
               failed = k
               return
            end if
            weakest = k
            ratio = d/original(k)
         end if
         f(k, k) = 1.0_wp/d
!GCC$ novector
         do i = k + 1, n
            f(k, i) = f(i, k)/d
         end do
         do j = k + 1, n
!GCC$ novector
            do i = j, n
               f(i, j) = f(i, j) - f(i, k)*f(k, j)
            end do
         end do
!GCC$ novector
         do i = k + 1, n
            f(i, k) = f(k, i)
         end do
      end do
   end subroutine small_factorize_symmetric

   !> P A = L D U with row pivoting, in place
   pure subroutine small_factorize(n, f, p, r, c, failed, weakest, ratio, empty)
      integer, intent(in) :: n                 !! 1..small_order
      real(wp), intent(inout) :: f(n, n)       !! matrix in, factors out
      integer, intent(out) :: p(n)             !! row i of P A is row p(i) of A
      real(wp), intent(out) :: r(n)            !! row scales
      real(wp), intent(out) :: c(n)            !! column scales, set where weakest > 0
      integer, intent(out) :: failed           !! first pivot that is zero, or 0
      integer, intent(out) :: weakest          !! column of the smallest suspicious pivot, or 0
      real(wp), intent(out) :: ratio           !! that pivot, scaled
      integer, intent(out) :: empty            !! i > 0: row i is zero, j < 0: column -j is zero
      real(wp) :: d, largest, swap, scales(small_order)
      integer :: i, j, k, m

      failed = 0
      weakest = 0
      ratio = suspicious_pivot
      call small_scales(n, f, r, c, empty)
      if (empty /= 0) return
      do k = 1, n
         p(k) = k
         scales(k) = r(k)
      end do
      do k = 1, n
         m = k
         largest = abs(f(k, k))*scales(k)
         do i = k + 1, n
            if (abs(f(i, k))*scales(i) > largest) then
               m = i
               largest = abs(f(i, k))*scales(i)
            end if
         end do
         if (m /= k) then
!GCC$ novector
            do j = 1, n
               swap = f(k, j)
               f(k, j) = f(m, j)
               f(m, j) = swap
            end do
            i = p(k)
            p(k) = p(m)
            p(m) = i
            swap = scales(k)
            scales(k) = scales(m)
            scales(m) = swap
         end if
         d = f(k, k)
         if (largest < ratio*c(k) .or. abs(d) < tiny(d)) then
            weakest = k
            ratio = largest/c(k)
            if (abs(d) < tiny(d)) then
               failed = k
               exit
            end if
         end if
         f(k, k) = 1.0_wp/d
!GCC$ novector
         do i = k + 1, n
            f(i, k) = f(i, k)/d
         end do
         do j = k + 1, n
!GCC$ novector
            do i = k + 1, n
               f(i, j) = f(i, j) - f(i, k)*f(k, j)
            end do
            f(k, j) = f(k, j)/d
         end do
      end do
      if (weakest > 0) c = 1.0_wp/c
   end subroutine small_factorize

   !> Sinkhorn and Knopp's r = 1/(|A| c), c = 1/(|A|^T r), see dynstep_scaling; one sweep where the
   !> rows are alike in size
   pure subroutine small_scales(n, a, r, c, empty)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n, n)
      real(wp), intent(out) :: r(n)            !! row scales
      real(wp), intent(out) :: c(n)            !! reciprocal column scales
      integer, intent(out) :: empty            !! i > 0: row i is zero, j < 0: column -j is zero
      real(wp) :: s(small_order), before, w
      integer :: i, j, sweep
      logical :: settled

      empty = 0
      c = 1.0_wp
      do sweep = 1, most_sweeps
         s(:n) = 0.0_wp
         do j = 1, n
            w = 1.0_wp
            if (sweep > 1) w = 1.0_wp/c(j)
!GCC$ novector
            do i = 1, n
               s(i) = s(i) + w*abs(a(i, j))
            end do
         end do
         do i = 1, n
            if (.not. s(i) > 0.0_wp) then
               empty = i
               return
            end if
            r(i) = 1.0_wp/max(s(i), tiny(s))
         end do
         settled = .true.
         do j = 1, n
            before = c(j)
            c(j) = 0.0_wp
!GCC$ novector
            do i = 1, n
               c(j) = c(j) + r(i)*abs(a(i, j))
            end do
            if (.not. c(j) > 0.0_wp) then
               empty = -j
               return
            end if
            settled = settled .and. c(j) < 16*before .and. 16*c(j) > before
         end do
         if (settled) exit
      end do
   end subroutine small_scales

   !> Equation (row of A) that the vanished pivot k belongs to, see dynstep_pivoted_lu
   pure integer function small_equation_of(n, f, p, r, c, k)
      integer, intent(in) :: n
      real(wp), intent(in) :: f(n, n), r(n), c(n)
      integer, intent(in) :: p(n), k
      real(wp), parameter :: noise = 1.0e-10_wp
      integer :: j
      small_equation_of = k
      do j = k + 1, n
         if (abs(f(k, j))*r(p(k))*c(j) > noise) return
      end do
      small_equation_of = p(k)
   end function small_equation_of

   !> x = A^-1 x
   pure subroutine small_solve(n, f, p, x)
      integer, intent(in) :: n                 !! 1..small_order
      real(wp), intent(in) :: f(n, n)          !! factors
      integer, intent(in) :: p(n)              !! row order
      real(wp), intent(inout) :: x(n)          !! right side in, solution out
      real(wp) :: y(small_order), s1, s2, s3, s4
      integer :: i, j

      select case (n)
      case (1)
         x(1) = x(1)*f(1, 1)
      case (2)
         s1 = x(p(1))
         s2 = x(p(2)) - f(2, 1)*s1
         s2 = s2*f(2, 2)
         x(2) = s2
         x(1) = s1*f(1, 1) - f(1, 2)*s2
      case (3)
         s1 = x(p(1))
         s2 = x(p(2)) - f(2, 1)*s1
         s3 = (x(p(3)) - f(3, 1)*s1) - f(3, 2)*s2
         s3 = s3*f(3, 3)
         s2 = s2*f(2, 2) - f(2, 3)*s3
         s1 = (s1*f(1, 1) - f(1, 3)*s3) - f(1, 2)*s2
         x(1) = s1
         x(2) = s2
         x(3) = s3
      case (4)
         s1 = x(p(1))
         s2 = x(p(2)) - f(2, 1)*s1
         s3 = (x(p(3)) - f(3, 1)*s1) - f(3, 2)*s2
         s4 = ((x(p(4)) - f(4, 1)*s1) - f(4, 2)*s2) - f(4, 3)*s3
         s4 = s4*f(4, 4)
         s3 = s3*f(3, 3) - f(3, 4)*s4
         s2 = (s2*f(2, 2) - f(2, 4)*s4) - f(2, 3)*s3
         s1 = ((s1*f(1, 1) - f(1, 4)*s4) - f(1, 3)*s3) - f(1, 2)*s2
         x(1) = s1
         x(2) = s2
         x(3) = s3
         x(4) = s4
      case default
!GCC$ novector
         do i = 1, n
            y(i) = x(p(i))
         end do
         do j = 1, n
!GCC$ novector
            do i = j + 1, n
               y(i) = y(i) - f(i, j)*y(j)
            end do
            y(j) = y(j)*f(j, j)
         end do
         do j = n, 1, -1
            x(j) = y(j)
!GCC$ novector
            do i = 1, j - 1
               y(i) = y(i) - f(i, j)*y(j)
            end do
         end do
      end select
   end subroutine small_solve

   !> x = A^-T x
   pure subroutine small_solve_transposed(n, f, p, x)
      integer, intent(in) :: n                 !! 1..small_order
      real(wp), intent(in) :: f(n, n)          !! factors
      integer, intent(in) :: p(n)              !! row order
      real(wp), intent(inout) :: x(n)          !! right side in, solution out
      real(wp) :: y(small_order)
      integer :: i, j

      do j = 1, n
         y(j) = x(j)
         do i = 1, j - 1
            y(j) = y(j) - f(i, j)*y(i)
         end do
      end do
      do j = n, 1, -1
         y(j) = y(j)*f(j, j)
         do i = j + 1, n
            y(j) = y(j) - f(i, j)*y(i)
         end do
      end do
      do i = 1, n
         x(p(i)) = y(i)
      end do
   end subroutine small_solve_transposed
end module dynstep_small_factor
