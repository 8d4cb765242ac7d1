! SPDX-License-Identifier: BSD-3-Clause
!> CPU time of the calling thread, and one form of table for all benchmarks.
!>
!> The machine may be busy: a benchmark repeats a short piece of work and keeps the least
!> time.  A neighbour on the same core slows both sides of a ratio alike, if they are
!> measured in turns.
module bench_clock
   use, intrinsic :: iso_c_binding, only: c_int, c_long
   use, intrinsic :: iso_fortran_env, only: int64, real64
   implicit none
   private

   public :: thread_seconds, print_title, print_time, print_ratio

   integer, parameter :: wp = real64

   type, bind(c) :: timespec
      integer(c_long) :: seconds, nanoseconds
   end type timespec

   interface
      integer(c_int) function clock_gettime(clock, time) bind(c)
         import :: c_int, timespec
         integer(c_int), value :: clock
         type(timespec), intent(out) :: time
      end function clock_gettime
   end interface

contains

   !> CPU time of this thread (Linux: clock 3 is CLOCK_THREAD_CPUTIME_ID; elsewhere CPU_TIME)
   real(wp) function thread_seconds()
      type(timespec) :: time
      if (clock_gettime(3_c_int, time) == 0) then
         thread_seconds = real(time%seconds, wp) + 1.0e-9_wp*real(time%nanoseconds, wp)
      else
         call cpu_time(thread_seconds)
      end if
   end function thread_seconds

   subroutine print_title(title, unit)
      character(len=*), intent(in) :: title, unit      !! unit of the times
      print '(/, a)', title
      print '(a, t53, a10, t65, a10, t77, a)', '', unit, 'ratio', 'goal'
   end subroutine print_title

   !> A yardstick
   subroutine print_time(what, nanoseconds)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: nanoseconds
      print '(a, t53, f10.2)', '  '//what, nanoseconds
   end subroutine print_time

   !> A time and its ratio to a yardstick
   subroutine print_ratio(what, nanoseconds, yardstick, goal)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: nanoseconds, yardstick
      character(len=*), intent(in) :: goal
      print '(a, t53, f10.2, t65, f10.3, t77, a)', '  '//what, nanoseconds, nanoseconds/yardstick, goal
   end subroutine print_ratio
end module bench_clock
