! SPDX-License-Identifier: BSD-3-Clause
!> The load of a linear system at one time, checked.
module dynstep_linear_load
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: check_callback
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system, load_none, load_samples
   use dynstep_status, only: dynstep_not_finite, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   public :: evaluate_load

contains

   !> p(t), checked; nothing where there is no load
   recursive subroutine evaluate_load(sys, n, t, p, status, count)
      class(linear_system), intent(inout) :: sys
      integer, intent(in) :: n
      real(wp), intent(in) :: t
      real(wp), intent(inout) :: p(n)
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      integer :: i, ierr

      if (status%failed() .or. sys%load_kind == load_none) return
      count%forces = count%forces + 1
      if (sys%load_kind == load_samples) then
         call sys%table%evaluate(t, p)
      else
         call sys%load(t, p, ierr)
         call check_callback('load', ierr, t, status)
         if (status%failed()) return
      end if
      if (count_bad(p) == 0) return
      do i = 1, n - 1
         if (.not. ieee_is_finite(p(i))) exit
      end do
      call status%set(dynstep_not_finite, 'load returned '//text(p(i))//' in component '//text(i) &
         & //' at t = '//text(t)//'; a smaller step may keep it in its domain', retry=.true.)
   end subroutine evaluate_load

   pure integer function count_bad(p)
      real(wp), intent(in), contiguous :: p(:)
      integer :: i
      count_bad = 0
      do i = 1, size(p)
         if (.not. ieee_is_finite(p(i))) count_bad = count_bad + 1
      end do
   end function count_bad
end module dynstep_linear_load
