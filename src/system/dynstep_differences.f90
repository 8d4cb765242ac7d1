! SPDX-License-Identifier: BSD-3-Clause
!> Jacobians by one-sided differences, several columns at once where they are banded.
!>
!> Columns j, j + w, j + 2w, ... with w = kl + ku + 1 of a banded Jacobian touch different
!> rows, so one evaluation serves them all: w evaluations instead of n (A. R. Curtis,
!> M. J. D. Powell, J. K. Reid, J. Inst. Maths Applics 13 (1974) 117-119).
!>
!> The caller evaluates its own function between `perturb` and `collect`:
!>
!>     do group = 1, difference_groups(jacobian)
!>        call perturb(group, jacobian, x, moved)
!>        (r1 = function of moved)
!>        call collect(group, x, moved, r0, r1, sign, jacobian)
!>     end do
module dynstep_differences
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, matrix_type
   implicit none
   private

   public :: difference_groups, perturb, collect

   !> sqrt(epsilon) balances the truncation error delta/2 f'' against the rounding error
   !> epsilon |f|/delta of a one-sided difference
   real(wp), parameter :: relative_step = sqrt(epsilon(1.0_wp))

contains

   !> Number of evaluations that a Jacobian of this structure needs
   pure integer function difference_groups(jacobian)
      type(matrix_type), intent(in) :: jacobian
      select case (jacobian%kind)
      case (kind_diagonal)
         difference_groups = 1
      case (kind_banded)
         difference_groups = min(jacobian%n, jacobian%kl + jacobian%ku + 1)
      case (kind_dense)
         difference_groups = jacobian%n
      case default
         difference_groups = 0
      end select
   end function difference_groups

   !> moved = x with the components of one group changed.  A component is changed in
   !> proportion to its size, but not less than a hundredth of the largest one asks for;
   !> a zero vector is changed as if its components were 1.
   pure subroutine perturb(group, jacobian, x, moved)
      integer, intent(in) :: group                  !! 1 .. difference_groups
      type(matrix_type), intent(in) :: jacobian     !! its structure is read
      real(wp), intent(in) :: x(jacobian%n)
      real(wp), intent(out) :: moved(jacobian%n)
      real(wp) :: least
      integer :: j
      least = 0.01_wp*maxval(abs(x))
      if (.not. least > 0.0_wp) least = 1.0_wp
      moved = x
      do j = group, jacobian%n, difference_groups(jacobian)
         moved(j) = x(j) + relative_step*max(abs(x(j)), least)
      end do
   end subroutine perturb

   !> Columns of one group: sign*(r1 - r0)/(moved - x)
   pure subroutine collect(group, x, moved, r0, r1, sign, jacobian)
      integer, intent(in) :: group
      type(matrix_type), intent(inout) :: jacobian
      real(wp), intent(in) :: x(jacobian%n), moved(jacobian%n)
      real(wp), intent(in) :: r0(jacobian%n), r1(jacobian%n)   !! function at x and at moved
      real(wp), intent(in) :: sign                             !! +1 or -1
      integer :: i, j
      do j = group, jacobian%n, difference_groups(jacobian)
         do i = first_row(jacobian, j), last_row(jacobian, j)
            call jacobian%set_entry(i, j, sign*((r1(i) - r0(i))/(moved(j) - x(j))))
         end do
      end do
   end subroutine collect

   pure integer function first_row(jacobian, j)
      type(matrix_type), intent(in) :: jacobian
      integer, intent(in) :: j
      select case (jacobian%kind)
      case (kind_diagonal)
         first_row = j
      case (kind_banded)
         first_row = max(1, j - jacobian%ku)
      case default
         first_row = 1
      end select
   end function first_row

   pure integer function last_row(jacobian, j)
      type(matrix_type), intent(in) :: jacobian
      integer, intent(in) :: j
      select case (jacobian%kind)
      case (kind_diagonal)
         last_row = j
      case (kind_banded)
         last_row = min(jacobian%n, j + jacobian%kl)
      case default
         last_row = jacobian%n
      end select
   end function last_row
end module dynstep_differences
