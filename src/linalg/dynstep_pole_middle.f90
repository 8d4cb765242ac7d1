! SPDX-License-Identifier: BSD-3-Clause
!> The rows between the two ends of dynstep_pole_sweeps: up to three, one small complex system per pole.
!>
!> Lanes are counted (pole, end).  Rows half+1 and half+2 of l couple the middle to the last rows of
!> each end, counted inwards: S(half+1,half), S(half+1,half-1), S(half+2,half) before, L after.
module dynstep_pole_middle
   use dynstep_kinds, only: wp
   use dynstep_pole_kernels, only: most_growth
   use dynstep_scaling, only: vanished_pivot
   use dynstep_small_complex, only: complex_factorize, complex_solve
   implicit none
   private

   public :: factor_middle, solve_middle

contains

   !> L of the couplings, and the inverse of the middle of pole j
   pure subroutine factor_middle(j, poles, width, half, rows, d, l, a, natural, inverse, failed, weakest)
      integer, intent(in) :: j                               !! number of the pole
      integer, intent(in) :: poles, width                    !! lanes of an end; off-diagonals
      integer, intent(in) :: half, rows                      !! rows of an end and of the middle
      real(wp), intent(in) :: d(poles, 2, 2, half)           !! (pole, end, Re and Im, row)
      real(wp), intent(inout) :: l(poles, 2, 2, width, half + width)
      complex(wp), intent(in) :: a(3, 3)                     !! S of the middle, rows and columns beyond `rows` of the identity
      real(wp), intent(in) :: natural(3)                     !! sizes of its diagonal entries
      complex(wp), intent(out) :: inverse(3, 3)
      real(wp), intent(inout) :: failed                      !! becomes 1
      real(wp), intent(inout) :: weakest
      complex(wp) :: e1, e2, l1, l2, t(3, 3), x(3)
      real(wp) :: r(3), c(3), ratio, smallest
      integer :: end, i, order(3), r1, r2, singular

      t = a
      do end = 1, merge(2, 0, half > 0)
         r1 = merge(1, rows, end == 1)
         e1 = entry(1, half + 1)
         if (width == 2 .and. half > 1) then
            e2 = entry(2, half + 1)
            e1 = e1 - e2*entry(1, half)
            l2 = e2*cmplx(d(j, end, 1, half - 1), d(j, end, 2, half - 1), wp)
            t(r1, r1) = t(r1, r1) - l2*e2
            l(j, end, 1, 2, half + 1) = real(l2, wp)
            l(j, end, 2, 2, half + 1) = aimag(l2)
         end if
         l1 = e1*cmplx(d(j, end, 1, half), d(j, end, 2, half), wp)
         t(r1, r1) = t(r1, r1) - l1*e1
         l(j, end, 1, 1, half + 1) = real(l1, wp)
         l(j, end, 2, 1, half + 1) = aimag(l1)
         if (width == 1) cycle
         r2 = merge(2, rows - 1, end == 1)
         e2 = entry(2, half + 2)
         l2 = e2*cmplx(d(j, end, 1, half), d(j, end, 2, half), wp)
         t(r2, r2) = t(r2, r2) - l2*e2
         t(r1, r2) = t(r1, r2) - l2*e1
         t(r2, r1) = t(r2, r1) - l2*e1
         l(j, end, 1, 2, half + 2) = real(l2, wp)
         l(j, end, 2, 2, half + 2) = aimag(l2)
      end do
      inverse = (0.0_wp, 0.0_wp)
      do i = 1, rows
         if (.not. abs(real(t(i, i), wp)) + abs(aimag(t(i, i))) <= most_growth*natural(i)) failed = 1.0_wp
      end do
      call complex_factorize(3, t, order, r, c, singular, smallest)
      if (singular > 0) then
         failed = 1.0_wp
         weakest = 0.0_wp
         return
      end if
      do i = 1, rows
         x = (0.0_wp, 0.0_wp)
         x(i) = (1.0_wp, 0.0_wp)
         call complex_solve(3, t, order, x)
         inverse(:, i) = x
         ! the pivot of this row, were it the last one
         ratio = 1.0_wp/max(1.0_wp, abs(x(i))*natural(i))
         weakest = min(weakest, ratio)
         if (.not. ratio > vanished_pivot) failed = 1.0_wp
      end do

   contains

      pure complex(wp) function entry(off, row)
         integer, intent(in) :: off, row
         entry = cmplx(l(j, end, 1, off, row), l(j, end, 2, off, row), wp)
      end function entry
   end subroutine factor_middle

   !> x of the middle of pole j and of one side
   pure subroutine solve_middle(j, poles, width, half, rows, l, inverse, s1, s2, x)
      integer, intent(in) :: j, poles, width, half, rows
      real(wp), intent(in) :: l(poles, 2, 2, width, half + width)
      complex(wp), intent(in) :: inverse(3, 3)
      complex(wp), intent(in) :: s1(2), s2(2)                !! last rows of the ends before D^-1, and those before
      complex(wp), intent(inout) :: x(rows)                  !! right side in, solution out
      complex(wp) :: r(3)
      integer :: end, i

      r = (0.0_wp, 0.0_wp)
      r(1:rows) = x
      do end = 1, merge(2, 0, half > 0)
         i = merge(1, rows, end == 1)
         r(i) = r(i) - cmplx(l(j, end, 1, 1, half + 1), l(j, end, 2, 1, half + 1), wp)*s1(end)
         if (width == 1) cycle
         r(i) = r(i) - cmplx(l(j, end, 1, 2, half + 1), l(j, end, 2, 2, half + 1), wp)*s2(end)
         i = merge(2, rows - 1, end == 1)
         r(i) = r(i) - cmplx(l(j, end, 1, 2, half + 2), l(j, end, 2, 2, half + 2), wp)*s1(end)
      end do
      do i = 1, rows
         x(i) = inverse(i, 1)*r(1) + (inverse(i, 2)*r(2) + inverse(i, 3)*r(3))
      end do
   end subroutine solve_middle
end module dynstep_pole_middle
