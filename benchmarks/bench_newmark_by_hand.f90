! SPDX-License-Identifier: BSD-3-Clause
!> The yardstick of one equation: x'' + 16 x = 0, h = 0.002, by a loop that knows the problem.
module bench_newmark_by_hand
   use bench_clock, only: thread_seconds
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: newmark_by_hand

contains

   !> ns per step; the acceleration form, with the reciprocal outside the loop
   real(wp) function newmark_by_hand(check)
      real(wp), intent(out) :: check        !! q after 200000 steps
      integer, parameter :: steps = 200000
      real(wp) :: q, v, a, h, k, m, reciprocal, start
      integer :: i

      k = 16.0_wp
      m = 1.0_wp
      h = 0.002_wp
      q = 1.0_wp
      v = 0.0_wp
      a = -k*q/m
      start = thread_seconds()
      reciprocal = 1.0_wp/(m + 0.25_wp*h*h*k)
      do i = 1, steps
         q = q + h*v + 0.25_wp*h*h*a
         v = v + 0.5_wp*h*a
         a = -(k*q)*reciprocal
         q = q + 0.25_wp*h*h*a
         v = v + 0.5_wp*h*a
      end do
      newmark_by_hand = 1.0e9_wp*(thread_seconds() - start)/steps
      check = q
      if (abs(q) > 1.1_wp) print *, 'wrong', q, v
   end function newmark_by_hand
end module bench_newmark_by_hand
