! SPDX-License-Identifier: BSD-3-Clause
!> DSADAO solves Y' = F(T,Y) from T to TEND, or to an event, within tolerances, by
!> backinterpolation with steps that follow an error estimate.  For FORTRAN 77 programs; nothing
!> is kept between calls.
!>
!>      SUBROUTINE DSADAO (N, F, JAC, OUT, T, Y, YP, TEND, RTOL, ATOL, H,
!>     1                   NEV, EVENT, ACTION, IDIR, KEV,
!>     2                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>      EXTERNAL         F, JAC, OUT, EVENT, ACTION
!>      INTEGER          N, NEV, IDIR(NEV), KEV, IOPT(30), IPAR(*),
!>     1                 ICNT(10), IDID
!>      DOUBLE PRECISION T, Y(N), YP(N), TEND, RTOL, ATOL(*), H,
!>     1                 ROPT(10), RPAR(*)
!>      CHARACTER*(*)    TEXT
!>
!> N, F, JAC, OUT, Y, YP, RPAR, IPAR, ICNT and TEXT are those of DSBINT, RTOL, ATOL (one value, or
!> N of them where IOPT(25) = 1), H, NEV, IDIR, KEV and IDID those of DSADAP; their prologues
!> describe them.  Subroutines for events:
!>
!>      SUBROUTINE EVENT (N, NEV, T, Y, S, RPAR, IPAR, IERR)
!>      SUBROUTINE ACTION (N, KEV, T, Y, JOB, RPAR, IPAR, IERR)
!>
!> IOPT    0 is the default
!>   (1), (2)   as in DSADAP
!>   (3) to (8), (11), (16) to (20)   as in DSBINT
!>   (24), (25)   as in DSADAP
!>
!> ROPT    0.0D0 is the default
!>   (1), (3)     as in DSBINT
!>   (4), (5), (11) ...   as in DSADAP
recursive subroutine dsadao(n, f, jac, out, t, y, yp, tend, rtol, atol, h, nev, event, action, idir, kev, iopt, ropt, rpar, &
   & ipar, icnt, idid, text)
   use dynstep_f77_adaptive, only: run_adaptive_ode
   use dynstep_f77_events, only: f77_ode_action, f77_ode_event
   use dynstep_f77_odes, only: f77_jacobian, f77_ode_out, f77_rhs
   use dynstep_kinds, only: wp
   implicit none
   integer, intent(in) :: n
   procedure(f77_rhs) :: f
   procedure(f77_jacobian) :: jac
   procedure(f77_ode_out) :: out
   real(wp), intent(inout) :: t, y(*), yp(*)
   real(wp), intent(in) :: tend, rtol, atol(*), h
   integer, intent(in) :: nev
   procedure(f77_ode_event) :: event
   procedure(f77_ode_action) :: action
   integer, intent(in) :: idir(*)
   integer, intent(out) :: kev
   integer, intent(in) :: iopt(*)
   real(wp), intent(in) :: ropt(*)
   real(wp), intent(inout) :: rpar(*)
   integer, intent(inout) :: ipar(*)
   integer, intent(inout) :: icnt(*)
   integer, intent(out) :: idid
   character(len=*), intent(out) :: text
   call run_adaptive_ode(n, f, jac, out, t, y, yp, tend, rtol, atol, h, nev, event, action, idir, kev, iopt, ropt, rpar, ipar, &
      & icnt, idid, text)
end subroutine dsadao
