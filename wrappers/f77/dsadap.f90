! SPDX-License-Identifier: BSD-3-Clause
!> DSADAP solves M(T,Q,V) Q'' = F(T,Q,V) from T to TEND, or to an event, within tolerances: by
!> extrapolations of Newmark's method or of the midpoint rule, or by backinterpolation, with steps
!> that follow an error estimate.  For FORTRAN 77 programs; nothing is kept between calls.
!>
!>      SUBROUTINE DSADAP (N, FORCE, MASS, TANG, OUT, T, Q, V, A, TEND,
!>     1                   RTOL, ATOL, H, NEV, EVENT, ACTION, IDIR, KEV,
!>     2                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>      EXTERNAL         FORCE, MASS, TANG, OUT, EVENT, ACTION
!>      INTEGER          N, NEV, IDIR(NEV), KEV, IOPT(30), IPAR(*),
!>     1                 ICNT(10), IDID
!>      DOUBLE PRECISION T, Q(N), V(N), A(N), TEND, RTOL, ATOL(*), H,
!>     1                 ROPT(10), RPAR(*)
!>      CHARACTER*(*)    TEXT
!>
!> Arguments; those that are not here are as in DSNEWM, whose prologue describes them.  DSNONE
!> stands for an EXTERNAL that is not called.
!>
!>   T       in: where to begin.  Out: where the run ended, TEND or an event on success
!>   RTOL, ATOL   in: a step is good where the root of the mean of
!>           (E(I)/(ATOL(I) + RTOL*ABS(Y(I))))**2, over all components Y(I) of Q and V with
!>           their estimated errors E(I), is at most 1.  RTOL >= 0; ATOL(1) >= 0 for all, or
!>           where IOPT(25) = 1 one for each, ATOL(1) .. ATOL(N) those of Q, ATOL(N+1) ..
!>           ATOL(2*N) those of V.  Errors of steps add up along the run
!>   H       first step, of the sign of TEND - T; 0.0D0: chosen
!>   NEV     number of events, 0 or more; 0: EVENT and ACTION are not called, IDIR is not read
!>   EVENT   subroutine, NEV functions whose zeros are events (below)
!>   ACTION  subroutine, what is done at an event (below); called where IOPT(24) = 1, else the run
!>           ends at each event
!>   IDIR    1: only from minus to plus, in the direction of the run, -1: only from plus to
!>           minus, 0: both
!>   KEV     out: number of the event, 1 to NEV, that ended the run at T (IDID = 3), else 0
!>   ICNT    out: counters as in DSNEWM; ICNT(3) counts the steps that were thrown away
!>   IDID    out: as in DSNEWM, and
!>             3  an event ended the run      -13  events follow each other without end
!>            -5  no step is short enough     -14  the tolerances are below rounding
!>
!> A step in which a function goes through zero is made again, for real, up to the zero, so that
!> Q and V there have the accuracy of the run.  To go on behind an event that ended a run, call
!> again; a zero at the start is no event.
!>
!> Subroutines of the user, beside those of DSNEWM.  IERR = 0 on entry, as there.
!>
!>      SUBROUTINE EVENT (N, NEV, T, Q, V, S, RPAR, IPAR, IERR)
!>           set S(NEV), the functions at T, Q, V
!>      SUBROUTINE ACTION (N, KEV, T, Q, V, JOB, RPAR, IPAR, IERR)
!>           function KEV is zero at T, Q, V.  JOB = 0 on entry: go on, nothing is changed.
!>           1: Q, V or parameters were changed, go on from there.  2: end the run.
!>           3: end it with what was changed
!>      SUBROUTINE OUT as in DSNEWM; where ACTION changes something, OUT is called before and
!>           behind it, at the same T
!>
!> IOPT    0 is the default
!>   (1)   1: OUT is called for the start, each step, and each event
!>   (2)   K > 0: OUT is called at the times ROPT(11), ..., ROPT(10+K) instead
!>   (3), (4)   as in DSNEWM
!>   (9)   1: the error chooses the levels of an extrapolation, too, step by step; IOPT(6) is the
!>         most, 2 to 12 (9).  IOPT(7) may be 6 then: the harmonic sequence, and the double one
!>         under tolerances below 1D-13
!>   (10)  0: extrapolation, with (5) to (8) as in DSNEXT.  1: backinterpolation, with (5) to (8)
!>         as in DSBINT
!>   (11) to (23)   M and the tangents, as in DSNEWM
!>   (24)  1: ACTION is called at events
!>   (25)  1: ATOL has 2*N values
!>
!> ROPT    0.0D0 is the default
!>   (1), (2)     as in DSNEXT; of backinterpolation ROPT(1) is ALPHA
!>   (3)          as in DSNEWM; leave it with an extrapolation
!>   (4)          longest step                                        (|TEND - T|)
!>   (5)          shortest step, the last one before an end or an event apart
!>   (11) ...     times for OUT
!>
!> Example: a ball that bounces, from rest at 1, to T = 3
!>
!>      PROGRAM BOUNCE
!>      EXTERNAL FALL, FLOOR, REBND, DSNONE
!>      INTEGER IOPT(30), ICNT(10), IPAR(1), IDIR(1), KEV, IDID
!>      DOUBLE PRECISION T, Q(1), V(1), A(1), ATOL(1), ROPT(10), RPAR(1)
!>      CHARACTER*160 TEXT
!>      DATA IOPT /30*0/, ROPT /10*0.0D0/, IDIR /-1/, ATOL /1.0D-9/
!>      T = 0.0D0
!>      Q(1) = 1.0D0
!>      V(1) = 0.0D0
!>      RPAR(1) = 0.8D0
!>      IPAR(1) = 0
!>      IOPT(24) = 1
!>      CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A, 3.0D0,
!>     1             1.0D-9, ATOL, 0.0D0, 1, FLOOR, REBND, IDIR, KEV,
!>     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>      IF (IDID .LT. 0) PRINT *, TEXT
!>      PRINT *, T, Q(1), V(1), IPAR(1), ' bounces'
!>      END
!>      SUBROUTINE FALL (N, T, Q, V, F, RPAR, IPAR, IERR)
!>      INTEGER N, IPAR(*), IERR
!>      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
!>      F(1) = -9.81D0
!>      END
!>      SUBROUTINE FLOOR (N, NEV, T, Q, V, S, RPAR, IPAR, IERR)
!>      INTEGER N, NEV, IPAR(*), IERR
!>      DOUBLE PRECISION T, Q(N), V(N), S(NEV), RPAR(*)
!>      S(1) = Q(1)
!>      END
!>      SUBROUTINE REBND (N, KEV, T, Q, V, JOB, RPAR, IPAR, IERR)
!>      INTEGER N, KEV, JOB, IPAR(*), IERR
!>      DOUBLE PRECISION T, Q(N), V(N), RPAR(*)
!>      V(1) = -RPAR(1)*V(1)
!>      IPAR(1) = IPAR(1) + 1
!>      JOB = 1
!>      END
recursive subroutine dsadap(n, force, mass, tang, out, t, q, v, a, tend, rtol, atol, h, nev, event, action, idir, kev, &
   & iopt, ropt, rpar, ipar, icnt, idid, text)
   use dynstep_f77_adaptive, only: run_adaptive
   use dynstep_f77_events, only: f77_action, f77_event
   use dynstep_f77_systems, only: f77_force, f77_mass, f77_out, f77_tangent
   use dynstep_kinds, only: wp
   implicit none
   integer, intent(in) :: n
   procedure(f77_force) :: force
   procedure(f77_mass) :: mass
   procedure(f77_tangent) :: tang
   procedure(f77_out) :: out
   real(wp), intent(inout) :: t, q(*), v(*), a(*)
   real(wp), intent(in) :: tend, rtol, atol(*), h
   integer, intent(in) :: nev
   procedure(f77_event) :: event
   procedure(f77_action) :: action
   integer, intent(in) :: idir(*)
   integer, intent(out) :: kev
   integer, intent(in) :: iopt(*)
   real(wp), intent(in) :: ropt(*)
   real(wp), intent(inout) :: rpar(*)
   integer, intent(inout) :: ipar(*)
   integer, intent(inout) :: icnt(*)
   integer, intent(out) :: idid
   character(len=*), intent(out) :: text
   call run_adaptive(n, force, mass, tang, out, t, q, v, a, tend, rtol, atol, h, nev, event, action, idir, kev, iopt, ropt, &
      & rpar, ipar, icnt, idid, text)
end subroutine dsadap
