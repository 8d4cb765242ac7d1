! SPDX-License-Identifier: BSD-3-Clause
!> The sweeps of dynstep_pole_sweeps: real and imaginary parts of several complex symmetric
!> band matrices, one matrix and one of its ends in each SIMD lane.
!>
!>   factor     S = L D L^T, without pivoting
!>   fill       right-hand sides x1 + p x2 and x3 + p x4 of one end
!>   forward    z = D^-1 L^-1 z
!>   backward   x = L^-T z, and its parts Re(c x) of the result
!>   gather     their sums over the poles, of one end
!>
!> Row i, counted from either end, holds S(i,i) or 1/D(i,i) in d, and S(i,i-1), S(i,i-2) or those of
!> L in l (Re, Im of all lanes each).  Numbers of lanes are parameters, since gfortran keeps
!> the state of a recurrence in vector registers only then; the bodies are included for
!> each number.
module dynstep_pole_kernels
   use dynstep_kinds, only: wp
   use dynstep_scaling, only: vanished_pivot
   implicit none
   private

   public :: factor, fill, forward, backward, gather, band_product

   !> A pivot and the terms subtracted in its row may be this many times the size of its diagonal
   !> entry (see dynstep_pole_sweeps).  Measured on random pentadiagonal M, C, K = F^T F, in any units, h from
   !> 1e-8 to 1e8, Re p > 0: 2.8 at |arg p| = 45 degrees, 7 at 75, 17 at 85, 73 at 89, with normwise backward errors below
   !> 7e-16 throughout; 5e3 was met with Re p < 0 and damping.  1e3 lets all definite systems pass and costs
   !> three digits at worst where the conditions do not hold.
   real(wp), parameter, public :: most_growth = 1.0e3_wp

   !> Range of |pivot|^2 that neither overflows nor loses digits
   real(wp), parameter :: least_square = tiny(1.0_wp)/epsilon(1.0_wp), most_square = 1.0_wp/least_square

contains

   !> Reciprocal pivots and L of rows 1, 2, ...
   pure subroutine factor(lanes, width, rows, natural, d, l, s, failed, least, beside)
      integer, intent(in) :: lanes                         !! 2 or 4
      integer, intent(in) :: width                         !! off-diagonals: 1 or 2
      integer, intent(in) :: rows
      real(wp), intent(in) :: natural(lanes, rows)         !! sizes of the diagonal entries
      real(wp), intent(inout) :: d(lanes, 2, rows)         !! S in, 1/D out
      real(wp), intent(inout) :: l(lanes, 2*width, rows)   !! S in, L out
      real(wp), intent(inout) :: s(lanes, 6)               !! state, zero before row 1
      real(wp), intent(inout) :: failed(lanes)             !! becomes 1 where a pivot is too small or grows too large
      real(wp), intent(inout) :: least(lanes), beside(lanes)   !! weakest pivot, and the size of its diagonal entry

      select case (10*width + lanes)
      case (12)
         call factor_12(rows, natural, d, l, s, failed, least, beside)
      case (14)
         call factor_14(rows, natural, d, l, s, failed, least, beside)
      case (22)
         call factor_22(rows, natural, d, l, s, failed, least, beside)
      case (24)
         call factor_24(rows, natural, d, l, s, failed, least, beside)
      end select
   end subroutine factor

   !> z of some rows of one end
   pure subroutine fill(poles, ends, rows, end, x, p, z)
      integer, intent(in) :: poles, ends                   !! 1 and 2, 2 and 2, 4 and 1
      integer, intent(in) :: rows, end                     !! 1: from the first row, 2: from the last
      real(wp), intent(in) :: x(rows, 4)                   !! real vectors, rows in ascending order
      real(wp), intent(in) :: p(poles, 2)                  !! Re, Im
      real(wp), intent(inout) :: z(poles, ends, 4, rows)   !! Re, Im of both sides

      select case (poles)
      case (1)
         call fill_1(rows, end, x, p, z)
      case (2)
         call fill_2(rows, end, x, p, z)
      case (4)
         call fill_4(rows, end, x, p, z)
      end select
   end subroutine fill

   !> Elimination of some rows
   pure subroutine forward(lanes, width, rows, d, l, s, z)
      integer, intent(in) :: lanes, width, rows
      real(wp), intent(in) :: d(lanes, 2, rows), l(lanes, 2*width, rows)
      real(wp), intent(inout) :: s(lanes, 4, 2)            !! last two rows before D^-1, zero before row 1
      real(wp), intent(inout) :: z(lanes, 4, rows)         !! Re, Im of both sides

      select case (10*width + lanes)
      case (12)
         call forward_12(rows, d, l, s, z)
      case (14)
         call forward_14(rows, d, l, s, z)
      case (22)
         call forward_22(rows, d, l, s, z)
      case (24)
         call forward_24(rows, d, l, s, z)
      end select
   end subroutine forward

   !> Substitution of some rows, from the last to the first
   pure subroutine backward(lanes, width, rows, c, l, z, s, y)
      integer, intent(in) :: lanes, width, rows
      real(wp), intent(in) :: c(lanes, 2)                  !! Re, Im of the weights
      real(wp), intent(in) :: l(lanes, 2*width, rows + width)
      real(wp), intent(in) :: z(lanes, 4, rows)
      real(wp), intent(inout) :: s(lanes, 4, 2)            !! x of the next two rows
      real(wp), intent(out) :: y(lanes, 2, rows)           !! Re(c x) of both sides

      select case (10*width + lanes)
      case (12)
         call backward_12(rows, c, l, z, s, y)
      case (14)
         call backward_14(rows, c, l, z, s, y)
      case (22)
         call backward_22(rows, c, l, z, s, y)
      case (24)
         call backward_24(rows, c, l, z, s, y)
      end select
   end subroutine backward

   !> Sums over the poles of some rows of one end
   pure subroutine gather(poles, ends, rows, end, y, dq, dv)
      integer, intent(in) :: poles, ends, rows, end
      real(wp), intent(in) :: y(poles, ends, 2, rows)
      real(wp), intent(out) :: dq(rows), dv(rows)          !! in ascending order

      select case (poles)
      case (1)
         call gather_1(rows, end, y, dq, dv)
      case (2)
         call gather_2(rows, end, y, dq, dv)
      case (4)
         call gather_4(rows, end, y, dq, dv)
      end select
   end subroutine gather

   !> y = A x of rows first..first+rows-1
   pure subroutine band_product(width, n, a0, a1, a2, x, first, rows, y)
      integer, intent(in) :: width, n                   !! off-diagonals of A, 0..2; -1: A = 0
      real(wp), intent(in), dimension(n) :: a0, a1, a2  !! A(i,i), A(i,i-1), A(i,i-2)
      real(wp), intent(in) :: x(n)
      integer, intent(in) :: first, rows
      real(wp), intent(out) :: y(rows)
      integer :: i, low, high, last

      if (width < 0) then
         y = 0.0_wp
         return
      end if
      last = first + rows - 1
      low = max(first, width + 1)
      high = min(last, n - width)
      do i = first, min(low - 1, last)
         y(i - first + 1) = corner_row(i)
      end do
      do i = max(high + 1, low), last
         y(i - first + 1) = corner_row(i)
      end do
      select case (width)
      case (0)
         do i = low, high
            y(i - first + 1) = a0(i)*x(i)
         end do
      case (1)
         do i = low, high
            y(i - first + 1) = (a1(i)*x(i - 1) + a1(i + 1)*x(i + 1)) + a0(i)*x(i)
         end do
      case (2)
         do i = low, high
            y(i - first + 1) = ((a2(i)*x(i - 2) + a2(i + 2)*x(i + 2)) &
               & + (a1(i)*x(i - 1) + a1(i + 1)*x(i + 1))) + a0(i)*x(i)
         end do
      end select

   contains

      pure real(wp) function corner_row(i)
         integer, intent(in) :: i
         corner_row = a0(i)*x(i)
         if (width > 0 .and. i > 1) corner_row = corner_row + a1(i)*x(i - 1)
         if (width > 0 .and. i < n) corner_row = corner_row + a1(i + 1)*x(i + 1)
         if (width > 1 .and. i > 2) corner_row = corner_row + a2(i)*x(i - 2)
         if (width > 1 .and. i < n - 1) corner_row = corner_row + a2(i + 2)*x(i + 2)
      end function corner_row
   end subroutine band_product

   pure subroutine factor_12(rows, natural, d, l, s, failed, least, beside)
      integer, parameter :: width = 1, lanes = 2
      include 'dynstep_pole_factor.inc'
   end subroutine factor_12

   pure subroutine factor_14(rows, natural, d, l, s, failed, least, beside)
      integer, parameter :: width = 1, lanes = 4
      include 'dynstep_pole_factor.inc'
   end subroutine factor_14

   pure subroutine factor_22(rows, natural, d, l, s, failed, least, beside)
      integer, parameter :: width = 2, lanes = 2
      include 'dynstep_pole_factor.inc'
   end subroutine factor_22

   pure subroutine factor_24(rows, natural, d, l, s, failed, least, beside)
      integer, parameter :: width = 2, lanes = 4
      include 'dynstep_pole_factor.inc'
   end subroutine factor_24

   pure subroutine forward_12(rows, d, l, s, z)
      integer, parameter :: width = 1, lanes = 2
      include 'dynstep_pole_forward.inc'
   end subroutine forward_12

   pure subroutine forward_14(rows, d, l, s, z)
      integer, parameter :: width = 1, lanes = 4
      include 'dynstep_pole_forward.inc'
   end subroutine forward_14

   pure subroutine forward_22(rows, d, l, s, z)
      integer, parameter :: width = 2, lanes = 2
      include 'dynstep_pole_forward.inc'
   end subroutine forward_22

   pure subroutine forward_24(rows, d, l, s, z)
      integer, parameter :: width = 2, lanes = 4
      include 'dynstep_pole_forward.inc'
   end subroutine forward_24

   pure subroutine backward_12(rows, c, l, z, s, y)
      integer, parameter :: width = 1, lanes = 2
      include 'dynstep_pole_backward.inc'
   end subroutine backward_12

   pure subroutine backward_14(rows, c, l, z, s, y)
      integer, parameter :: width = 1, lanes = 4
      include 'dynstep_pole_backward.inc'
   end subroutine backward_14

   pure subroutine backward_22(rows, c, l, z, s, y)
      integer, parameter :: width = 2, lanes = 2
      include 'dynstep_pole_backward.inc'
   end subroutine backward_22

   pure subroutine backward_24(rows, c, l, z, s, y)
      integer, parameter :: width = 2, lanes = 4
      include 'dynstep_pole_backward.inc'
   end subroutine backward_24

   pure subroutine fill_1(rows, end, x, p, z)
      integer, parameter :: poles = 1, ends = 2
      include 'dynstep_pole_fill.inc'
   end subroutine fill_1

   pure subroutine fill_2(rows, end, x, p, z)
      integer, parameter :: poles = 2, ends = 2
      include 'dynstep_pole_fill.inc'
   end subroutine fill_2

   pure subroutine fill_4(rows, end, x, p, z)
      integer, parameter :: poles = 4, ends = 1
      include 'dynstep_pole_fill.inc'
   end subroutine fill_4

   pure subroutine gather_1(rows, end, y, dq, dv)
      integer, parameter :: poles = 1, ends = 2
      include 'dynstep_pole_gather.inc'
   end subroutine gather_1

   pure subroutine gather_2(rows, end, y, dq, dv)
      integer, parameter :: poles = 2, ends = 2
      include 'dynstep_pole_gather.inc'
   end subroutine gather_2

   pure subroutine gather_4(rows, end, y, dq, dv)
      integer, parameter :: poles = 4, ends = 1
      include 'dynstep_pole_gather.inc'
   end subroutine gather_4
end module dynstep_pole_kernels
