! SPDX-License-Identifier: BSD-3-Clause
!> Dense complex systems, where LAPACK costs more than its arithmetic (n <= 16) or has no routine
!> of the working precision (any n, in builds of another precision than double).
!>
!>   P A = L U with unit L: a(i,j) = L(i,j) below the diagonal, U(i,j) above it,
!>   a(i,i) = 1/U(i,i); P interchanges rows k and p(k), k = 1, 2, ... (as LAPACK's)
!>
!> Pivots are judged as everywhere in the library (dynstep_scaling): after scaling by powers of two
!> that bring the sums of |Re| + |Im| of rows and columns near 1, so that units neither choose a
!> pivot nor make a matrix singular.
module dynstep_small_complex
   use dynstep_kinds, only: wp
   use dynstep_scaling, only: most_sweeps, reciprocal_power, vanished_pivot
   implicit none
   private

   public :: complex_factorize, complex_solve

contains

   !> P A = L U, in place
   pure subroutine complex_factorize(n, a, p, r, c, singular, weakest)
      integer, intent(in) :: n                    !! order >= 1
      complex(wp), intent(inout) :: a(n, n)       !! finite matrix in, factors out
      integer, intent(out) :: p(n)                !! row that was interchanged with row k, p(k) >= k
      real(wp), intent(out) :: r(n), c(n)         !! scales of rows (in the order of P A) and columns
      integer, intent(out) :: singular            !! column whose pivot is nothing but rounding error, or 0
      real(wp), intent(out) :: weakest            !! smallest scaled pivot, 0 where a row or column is zero
      real(wp) :: largest, size, swap_scale
      complex(wp) :: swap
      integer :: i, j, k, m

      call scales(n, a, r, c, singular)
      weakest = 0.0_wp
      if (singular > 0) return
      weakest = huge(1.0_wp)
      do k = 1, n
         m = k
         largest = one_norm(a(k, k))*r(k)
         do i = k + 1, n
            size = one_norm(a(i, k))*r(i)
            if (size > largest) then
               m = i
               largest = size
            end if
         end do
         p(k) = m
         weakest = min(weakest, largest*c(k))
         if (.not. largest*c(k) > vanished_pivot .or. one_norm(a(m, k)) < tiny(1.0_wp)) then
            singular = k
            return
         end if
         if (m /= k) then
            do j = 1, n
               swap = a(k, j)
               a(k, j) = a(m, j)
               a(m, j) = swap
            end do
            swap_scale = r(k)
            r(k) = r(m)
            r(m) = swap_scale
         end if
         a(k, k) = (1.0_wp, 0.0_wp)/a(k, k)
         do i = k + 1, n
            a(i, k) = a(i, k)*a(k, k)
         end do
         do j = k + 1, n
            do i = k + 1, n
               a(i, j) = a(i, j) - a(i, k)*a(k, j)
            end do
         end do
      end do
   end subroutine complex_factorize

   !> x = A^-1 x
   pure subroutine complex_solve(n, a, p, x)
      integer, intent(in) :: n
      complex(wp), intent(in) :: a(n, n)          !! from complex_factorize
      integer, intent(in) :: p(n)
      complex(wp), intent(inout) :: x(n)          !! right side in, solution out
      complex(wp) :: swap
      integer :: i, j

      do i = 1, n
         swap = x(i)
         x(i) = x(p(i))
         x(p(i)) = swap
      end do
      do j = 1, n - 1
         do i = j + 1, n
            x(i) = x(i) - a(i, j)*x(j)
         end do
      end do
      do j = n, 1, -1
         x(j) = x(j)*a(j, j)
         do i = 1, j - 1
            x(i) = x(i) - a(i, j)*x(j)
         end do
      end do
   end subroutine complex_solve

   !> Powers of two r, c that bring the sums of rows and columns of R A C near 1 (see dynstep_scaling)
   pure subroutine scales(n, a, r, c, empty)
      integer, intent(in) :: n
      complex(wp), intent(in) :: a(n, n)
      real(wp), intent(out) :: r(n), c(n)
      integer, intent(out) :: empty               !! row or column that is zero, or 0
      real(wp) :: column
      logical :: settled
      integer :: i, j, sweep

      empty = 0
      c = 1.0_wp
      do sweep = 1, most_sweeps
         r = 0.0_wp
         do j = 1, n
            do i = 1, n
               r(i) = r(i) + one_norm(a(i, j))*c(j)
            end do
         end do
         do i = 1, n
            if (.not. r(i) > 0.0_wp) then
               empty = i
               return
            end if
            r(i) = reciprocal_power(r(i))
         end do
         settled = .true.
         do j = 1, n
            column = 0.0_wp
            do i = 1, n
               column = column + one_norm(a(i, j))*r(i)
            end do
            if (.not. column > 0.0_wp) then
               empty = j
               return
            end if
            settled = settled .and. column*c(j) < 16.0_wp .and. column*c(j) > 1.0_wp/16
            c(j) = reciprocal_power(column)
         end do
         if (settled) exit
      end do
   end subroutine scales

   pure real(wp) function one_norm(x)
      complex(wp), intent(in) :: x
      one_norm = abs(real(x, wp)) + abs(aimag(x))
   end function one_norm
end module dynstep_small_complex
