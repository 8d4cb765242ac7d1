! SPDX-License-Identifier: BSD-3-Clause
!> Jacobians by one-sided differences, several columns at once where they are banded.
!>
!> Columns j, j + w, j + 2w, ... with w = kl + ku + 1 of a banded Jacobian touch different
!> rows, so one evaluation serves them all: w evaluations instead of n (A. R. Curtis,
!> M. J. D. Powell, J. K. Reid, J. Inst. Maths Applics 13 (1974) 117-119).
!>
!> The caller evaluates its own function between `perturb` and `collect`:
!>
!>     call motion_sizes(q, v, a, q_size, v_size)
!>     do group = 1, difference_groups(jacobian)
!>        call perturb(group, jacobian, x, sizes, moved)
!>        (r1 = function of moved)
!>        call collect(group, x, moved, r0, r1, sign, jacobian)
!>     end do
module dynstep_differences
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, matrix_type
   implicit none
   private

   public :: difference_groups, motion_sizes, state_sizes, perturb, collect

   !> sqrt(epsilon) balances the truncation error delta/2 f'' against the rounding error
   !> epsilon |f|/delta of a one-sided difference
   real(wp), parameter :: relative_step = sqrt(epsilon(1.0_wp))

   !> What is smaller counts as zero: the step of a difference would be among the subnormal numbers, or zero itself
   real(wp), parameter :: smallest = tiny(1.0_wp)/epsilon(1.0_wp)

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

   !> Sizes of q and v for differences: that of each component itself, since components have
   !> different units.  One that is much smaller than what it changes by in the time in which
   !> the largest component changes (it passes through zero, or starts there) is given a hundredth
   !> of that change; one that does not move at all, a hundredth of the largest.
   pure subroutine motion_sizes(q, v, a, q_size, v_size)
      real(wp), intent(in) :: q(:), v(:), a(:)
      real(wp), intent(out) :: q_size(:), v_size(:)
      real(wp) :: time
      time = time_scale(maxval(abs(q)), maxval(abs(v)), maxval(abs(a)))
      q_size = abs(q)
      v_size = abs(v)
      call raise_small(time*v_size, q_size)
      call raise_small(abs(q)/time, v_size)
      where (.not. q_size >= smallest) q_size = 0.01_wp*time**2*abs(a)
      where (.not. v_size >= smallest) v_size = 0.01_wp*time*abs(a)
      where (.not. q_size >= smallest) q_size = 0.01_wp*maxval(q_size)
      where (.not. v_size >= smallest) v_size = 0.01_wp*maxval(v_size)
      where (.not. q_size >= smallest) q_size = 1.0_wp
      where (.not. v_size >= smallest) v_size = 1.0_wp
   end subroutine motion_sizes

   !> Sizes of the components of a state of first order: that of each itself, raised where it is much
   !> smaller than what it changes by in the time in which the largest component changes
   pure subroutine state_sizes(y, f, sizes)
      real(wp), intent(in) :: y(:), f(:)       !! state and its derivative
      real(wp), intent(out) :: sizes(:)
      real(wp) :: time
      time = time_scale(maxval(abs(y)), maxval(abs(f)), 0.0_wp)
      sizes = abs(y)
      call raise_small(time*abs(f), sizes)
      where (.not. sizes >= smallest) sizes = 0.01_wp*maxval(sizes)
      where (.not. sizes >= smallest) sizes = 1.0_wp
   end subroutine state_sizes

   pure elemental subroutine raise_small(change, size)
      real(wp), intent(in) :: change
      real(wp), intent(inout) :: size
      if (size < 1.0e-4_wp*change) size = max(size, 0.01_wp*change)
   end subroutine raise_small

   !> Time in which q, v change by as much as they are
   pure real(wp) function time_scale(q, v, a)
      real(wp), intent(in) :: q, v, a      !! largest components
      time_scale = 1.0_wp
      if (min(q, v) >= smallest) then
         time_scale = q/v
      else if (min(q, a) >= smallest) then
         time_scale = sqrt(q/a)
      else if (min(v, a) >= smallest) then
         time_scale = v/a
      end if
      time_scale = min(max(time_scale, 1.0e-60_wp), 1.0e60_wp)    ! its square must not overflow
   end function time_scale

   !> moved = x with the components of one group changed in proportion to their sizes
   pure subroutine perturb(group, jacobian, x, sizes, moved)
      integer, intent(in) :: group                  !! 1 .. difference_groups
      type(matrix_type), intent(in) :: jacobian     !! its structure is read
      real(wp), intent(in) :: x(jacobian%n)
      real(wp), intent(in) :: sizes(jacobian%n)     !! of either sign: where to move to
      real(wp), intent(out) :: moved(jacobian%n)
      integer :: j
      moved = x
      do j = group, jacobian%n, difference_groups(jacobian)
         moved(j) = x(j) + relative_step*sizes(j)
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
