! SPDX-License-Identifier: BSD-3-Clause
!> What stages of rational steps of first and of second order have in common (dynstep_rational_first,
!> dynstep_rational_second): weights of poles and of loads, and products of real matrices with complex vectors.
module dynstep_rational_terms
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_zero, matrix_type
   use dynstep_pole_stages, only: stage_type
   implicit none
   private

   public :: add_loads, add_weighted, combine, multiply_both

contains

   !> d = d + w Re(tau x).  Where a pair of zeros mirrors the poles, tau = -2 i Re(p)/Im(p): as a product and a quotient it
   !> has no rounding error of its own, which would be the same in each step.
   pure subroutine add_weighted(n, stage, j, x, d)
      integer, intent(in) :: n
      type(stage_type), intent(in) :: stage
      integer, intent(in) :: j
      complex(wp), intent(in) :: x(n)
      real(wp), intent(inout) :: d(n)
      if (stage%is_mirrored .and. stage%w(j) > 1.0_wp) then
         d = d + (4.0_wp*real(stage%pole(j), wp))*aimag(x)/aimag(stage%pole(j))
      else
         d = d + stage%w(j)*real(stage%tau(j)*x, wp)
      end if
   end subroutine add_weighted

   !> P_j - P_1 of a pole: the weights add up to 1, and where K q and P_1 nearly cancel, as in a stiff equilibrium,
   !> K q - P_1 is to be formed before anything is multiplied
   pure subroutine combine(n, nodes, loads, weights, x)
      integer, intent(in) :: n, nodes
      real(wp), intent(in) :: loads(n, nodes)
      complex(wp), intent(in) :: weights(nodes)
      complex(wp), intent(out) :: x(n)
      integer :: j
      x = (0.0_wp, 0.0_wp)
      do j = 2, nodes
         x = x + weights(j)*(loads(:, j) - loads(:, 1))
      end do
   end subroutine combine

   !> x = x + loads*weights: the source of an explicit factor
   pure subroutine add_loads(n, nodes, loads, weights, x)
      integer, intent(in) :: n, nodes
      real(wp), intent(in) :: loads(n, nodes)
      real(wp), intent(in) :: weights(nodes)
      real(wp), intent(inout) :: x(n)
      integer :: j
      do j = 1, nodes
         x = x + weights(j)*loads(:, j)
      end do
   end subroutine add_loads

   !> A times both parts of a complex vector
   pure subroutine multiply_both(a, re, im, are, aim)
      type(matrix_type), intent(in) :: a
      real(wp), intent(in) :: re(:), im(:)
      real(wp), intent(out) :: are(:), aim(:)
      are = 0.0_wp
      aim = 0.0_wp
      if (a%kind == kind_zero) return
      call a%multiply_add(1.0_wp, re, are)
      call a%multiply_add(1.0_wp, im, aim)
   end subroutine multiply_both
end module dynstep_rational_terms
