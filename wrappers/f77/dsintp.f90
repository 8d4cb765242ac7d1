! SPDX-License-Identifier: BSD-3-Clause
!> DSINTP interpolates linearly in equally spaced samples, for use in a LOAD.
!>
!>      SUBROUTINE DSINTP (T, T0, DT, NS, S, VALUE)
!>      INTEGER NS
!>      DOUBLE PRECISION T, T0, DT, S(NS), VALUE
!>
!>   T       time
!>   T0, DT  time of S(1), and sampling interval > 0
!>   NS      number of samples, 2 or more
!>   S       samples, such as DSRAT2 reads
!>   VALUE   out: the value at T; 0 before the first and after the last sample
recursive subroutine dsintp(t, t0, dt, ns, s, value)
   use dynstep_kinds, only: wp
   implicit none
   real(wp), intent(in) :: t, t0, dt
   integer, intent(in) :: ns
   real(wp), intent(in) :: s(ns)
   real(wp), intent(out) :: value
   !> How far, in sampling intervals, T may lie outside by rounding, as in dynstep_load_table
   real(wp), parameter :: rounding = 1.0e-6_wp
   real(wp) :: x
   integer :: i

   value = 0.0_wp
   x = (t - t0)/dt
   if (ns < 2 .or. .not. (x >= -rounding .and. x <= ns - 1 + rounding)) return
   x = min(max(x, 0.0_wp), real(ns - 1, wp))
   i = min(int(x), ns - 2) + 1
   value = s(i) + (x - (i - 1))*(s(i + 1) - s(i))
end subroutine dsintp
