! SPDX-License-Identifier: BSD-3-Clause
!> DSBINT solves Y' = F(T,Y) from T to TEND by backinterpolation: a half-step forward over
!> ALPHA*H, and one backward over (1 - ALPHA)*H from the unknown end of the step to the same
!> point.  Steps have one length, or follow an error estimate.  For FORTRAN 77 programs; nothing
!> is kept between calls.
!>
!>      SUBROUTINE DSBINT (N, F, JAC, OUT, T, Y, YP, TEND, H,
!>     1                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>      EXTERNAL         F, JAC, OUT
!>      INTEGER          N, IOPT(30), IPAR(*), ICNT(10), IDID
!>      DOUBLE PRECISION T, Y(N), YP(N), TEND, H, ROPT(10), RPAR(*)
!>      CHARACTER*(*)    TEXT
!>
!> Arguments
!>
!>   N       number of unknowns, 1 or more
!>   F       subroutine, the right-hand side (below)
!>   JAC     subroutine, the Jacobian dF/dY; not called where IOPT(20) = 0
!>   OUT     subroutine, takes the results; not called where IOPT(1) = IOPT(2) = 0
!>   T       in: where to begin.  Out: where the run ended, TEND on success
!>   Y       in: the unknowns at the first T.  Out: at the last
!>   YP      out: Y' at the last T
!>   TEND    where to end, on either side of T
!>   H       step length, of the sign of TEND - T; the last step is shorter if need be.  Where
!>           IOPT(9) > 0: the first step; 0.0D0: (TEND - T)/128
!>   IOPT    options, all 0 by default (below)
!>   ROPT    options, all 0.0D0 by default (below)
!>   RPAR, IPAR   passed through to the subroutines, any length of 1 or more
!>   ICNT    out: counters as in DSNEWM, F in the place of FORCE, JAC in that of TANG
!>   IDID    out: 0 done, > 0 done with news, < 0 failed, as in DSNEWM
!>   TEXT    out: blank where IDID = 0, else a sentence: what happened, where, what helps.
!>           160 characters are good, 320 always enough
!>
!> INTEGER has 4 bytes and DOUBLE PRECISION 8: no -fdefault-integer-8, no -fdefault-real-8.
!>
!> On failure T, Y and YP are those of the last good step.
!>
!> Subroutines of the user.  IERR = 0 on entry; set it > 0 where T, Y are outside what the
!> model allows (a smaller step may help), < 0 to give up.
!>
!>      SUBROUTINE F (N, T, Y, YP, RPAR, IPAR, IERR)
!>           set YP(N)
!>      SUBROUTINE JAC (N, T, Y, AJ, LD, RPAR, IPAR, IERR)
!>           set AJ(LD,N), which is zero on entry:
!>           diagonal (LD = 1)          AJ(1,J)        = dF(J)/dY(J)
!>           band (LD = KL + KU + 1)    AJ(KU+1+I-J,J) = dF(I)/dY(J)    as in LAPACK
!>           dense (LD = N)             AJ(I,J)        = dF(I)/dY(J)
!>      SUBROUTINE OUT (N, T, Y, YP, RPAR, IPAR, ISTOP)
!>           results at T, not to be changed; ISTOP = 0 on entry, set it to 1 to end the run
!>
!> IOPT    0 is the default
!>   (1)   K > 0: OUT is called for the start, every K-th step, and the last one
!>   (2)   K > 0: OUT is called at the times ROPT(11), ..., ROPT(10+K) instead, in the order
!>         of the run, interpolated inside a step (an error of H**4); where OUT ends the run, T
!>         is the end of that step
!>   (3)   most iterations for the end of a step                                     (25)
!>   (4)   most halvings of a correction, -1: none                                   (20)
!>   (5)   0: halves of orders IOPT(6) and IOPT(7), 1: both by the fifth-order formula of RKF45
!>   (6)   order of the half forward, 1 to 5                                          (4)
!>   (7)   order of the half backward, 1 to 5                                         (4)
!>   (8)   1: ALPHA is in ROPT(1)                                                   (1/2)
!>   (9)   0: steps of length H.  1, 2: steps whose error estimate is ROPT(2)*max(|Y|, 1) at
!>         most, |Y| the largest component; 1 by the standard rule
!>         H = 0.8 H (TAU/ERR)**K, 2 by the PI rule
!>         H = 0.8 H (TAU/ERR)**(0.3 K) (ERR1/ERR)**(0.4 K), ERR1 that of the step before.
!>         Steps that are thrown away are counted in ICNT(3); OUT is called at each step
!>         (IOPT(1) = 1) or at times (IOPT(2))
!>   (10)  place of 0.8 in the PI rule: 0 in front, 1 beside TAU, as in the thesis's listing
!>   (11)  where IOPT(5) = 1, the error estimate is 0: the sum of those of both halves, 1: their
!>         difference, as in the listings, which nearly vanishes at ALPHA = 1/2
!>   (16)  Jacobian: 1 diagonal, 2 band, 3 dense                                  (dense)
!>   (17), (18)   KL and KU of the Jacobian
!>   (20)  1: JAC gives the Jacobian                                      (differences do)
!>
!> ROPT    0.0D0 is the default
!>   (1)          ALPHA, 0 to 1, read where IOPT(8) = 1
!>   (2)          tolerance of a step, where IOPT(9) > 0; must then be given
!>   (3)          tolerance of the iteration, relative to the largest component of Y
!>                                                                            (to round-off)
!>   (4)          longest step, where IOPT(9) > 0                        (|TEND - T|/16)
!>   (11) ...     times for OUT
!>
!> With equal orders up to 4 and ALPHA = 1/2 undamped modes keep their amplitude, whatever H is;
!> orders 4 and 5 want ALPHA between 0.4363 and 0.4486.
!>
!> Example: Y' = -5 (Y - cos T) from 0, to T = 2
!>
!>      PROGRAM FOLLOW
!>      EXTERNAL COOL, DSNONE
!>      INTEGER IOPT(30), ICNT(10), IPAR(1), IDID
!>      DOUBLE PRECISION T, Y(1), YP(1), ROPT(10), RPAR(1)
!>      CHARACTER*160 TEXT
!>      DATA IOPT /30*0/, ROPT /10*0.0D0/
!>      T = 0.0D0
!>      Y(1) = 0.0D0
!>      RPAR(1) = 5.0D0
!>      CALL DSBINT (1, COOL, DSNONE, DSNONE, T, Y, YP, 2.0D0, 0.05D0,
!>     1             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>      IF (IDID .LT. 0) PRINT *, TEXT
!>      PRINT *, T, Y(1)
!>      END
!>      SUBROUTINE COOL (N, T, Y, YP, RPAR, IPAR, IERR)
!>      INTEGER N, IPAR(*), IERR
!>      DOUBLE PRECISION T, Y(N), YP(N), RPAR(*)
!>      YP(1) = -RPAR(1)*(Y(1) - COS(T))
!>      END
recursive subroutine dsbint(n, f, jac, out, t, y, yp, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
   use dynstep_f77_odes, only: f77_jacobian, f77_ode_out, f77_rhs, run_ode
   use dynstep_kinds, only: wp
   implicit none
   integer, intent(in) :: n
   procedure(f77_rhs) :: f
   procedure(f77_jacobian) :: jac
   procedure(f77_ode_out) :: out
   real(wp), intent(inout) :: t, y(*), yp(*)
   real(wp), intent(in) :: tend, h
   integer, intent(in) :: iopt(*)
   real(wp), intent(in) :: ropt(*)
   real(wp), intent(inout) :: rpar(*)
   integer, intent(inout) :: ipar(*)
   integer, intent(inout) :: icnt(*)
   integer, intent(out) :: idid
   character(len=*), intent(out) :: text
   call run_ode(n, f, jac, out, t, y, yp, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
end subroutine dsbint
