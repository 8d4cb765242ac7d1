! SPDX-License-Identifier: BSD-3-Clause
!> Times t_eval that a run is to record: whether they can be, and how many steps lead to one of them.
module dynstep_record_times
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: long, wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_times, steps_before_time

contains

   !> Times to record lie inside the interval, in the order of the run
   recursive subroutine check_times(t_eval, t, t_end, status)
      real(wp), intent(in) :: t_eval(:)
      real(wp), intent(in) :: t, t_end               !! begin and end of the run
      type(status_type), intent(inout) :: status
      integer :: i
      real(wp) :: direction

      direction = sign(1.0_wp, t_end - t)
      do i = 1, size(t_eval)
         if (status%failed()) return
         associate (te => t_eval(i))
            if (.not. ieee_is_finite(te)) then
               call refuse('is not finite')
            else if (direction*(te - t) < 0.0_wp .or. direction*(t_end - te) < 0.0_wp) then
               call refuse('lies outside the interval from '//text(t)//' to '//text(t_end))
            else if (direction*(te - t_eval(max(1, i - 1))) < 0.0_wp) then
               call refuse('is out of order; sort t_eval in the direction of the run')
            end if
         end associate
      end do

   contains

      recursive subroutine refuse(why)
         character(len=*), intent(in) :: why
         call status%set(dynstep_invalid_input, 't_eval('//text(i)//') = '//text(t_eval(i))//' '//why)
      end subroutine refuse
   end subroutine check_times

   !> Steps up to the one that reaches t_eval(i), 1 or more; any number where there is no such time
   pure integer(long) function steps_before_time(t_eval, i, t, longest)
      real(wp), intent(in) :: t_eval(:)
      integer(long), intent(in) :: i
      real(wp), intent(in) :: t                           !! present time
      real(wp), intent(in) :: longest                     !! step, in the direction of the run; 0 where that ends at t
      steps_before_time = huge(steps_before_time)
      if (i > size(t_eval)) return
      steps_before_time = 1
      if (abs(longest) > 0.0_wp) steps_before_time = max(1_long, int(min((t_eval(i) - t)/longest, real(huge(1), wp)), long))
   end function steps_before_time
end module dynstep_record_times
