! SPDX-License-Identifier: BSD-3-Clause
!> DSPADE solves the linear system M Q'' + C Q' + K Q = P(T) from T to TEND with steps of one
!> length, by Pade's approximations of the exponential.  For FORTRAN 77 programs; nothing is
!> kept between calls.
!>
!>      SUBROUTINE DSPADE (N, AM, AC, AK, LOAD, OUT, T, Q, V, A, TEND, H,
!>     1                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>
!> The arguments are those of DSNEWL, and so are IOPT(1), IOPT(2), IOPT(11) to IOPT(23) and the
!> times ROPT(11) ...  The others are
!>
!> IOPT    0 is the default
!>   (6)   degree P of the numerator, 1 to 8, or -1 for 0                             (4)
!>   (7)   degree Q of the denominator, 1 to 8, or -1 for 0                           (4)
!>
!>   (8)   form of a step: 1 a sum over the poles, 2 a product, 3 a product whose solutions are
!>         corrected by their residuals, so that undamped runs do not drift      (automatic)
!>
!> The order is P + Q.  With P = Q undamped modes keep their amplitude, whatever H is; with
!> Q = P + 1 or P + 2 stiff modes are damped at once.
recursive subroutine dspade(n, am, ac, ak, load, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
   use dynstep_f77_run, only: method_pade, run_linear
   use dynstep_f77_systems, only: f77_load, f77_out
   use dynstep_kinds, only: wp
   implicit none
   integer, intent(in) :: n
   real(wp), intent(in) :: am(*), ac(*), ak(*)
   procedure(f77_load) :: load
   procedure(f77_out) :: out
   real(wp), intent(inout) :: t, q(*), v(*), a(*)
   real(wp), intent(in) :: tend, h
   integer, intent(in) :: iopt(*)
   real(wp), intent(in) :: ropt(*)
   real(wp), intent(inout) :: rpar(*)
   integer, intent(inout) :: ipar(*)
   integer, intent(inout) :: icnt(*)
   integer, intent(out) :: idid
   character(len=*), intent(out) :: text
   call run_linear(method_pade, n, am, ac, ak, load, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
end subroutine dspade
