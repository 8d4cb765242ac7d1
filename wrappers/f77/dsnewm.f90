! SPDX-License-Identifier: BSD-3-Clause
!> DSNEWM solves M(T,Q,V) Q'' = F(T,Q,V) from T to TEND with steps of one length, by Newmark's
!> method.  For FORTRAN 77 programs; nothing is kept between calls.
!>
!>      SUBROUTINE DSNEWM (N, FORCE, MASS, TANG, OUT, T, Q, V, A, TEND, H,
!>     1                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>      EXTERNAL         FORCE, MASS, TANG, OUT
!>      INTEGER          N, IOPT(30), IPAR(*), ICNT(10), IDID
!>      DOUBLE PRECISION T, Q(N), V(N), A(N), TEND, H, ROPT(10), RPAR(*)
!>      CHARACTER*(*)    TEXT
!>
!> Relatives with the same options: DSNEXT extrapolates to orders up to 24, DSTABL gives the
!> table of one extrapolated step, DSNEWL and DSNEXL take matrices M, C and K.  DSNONE
!> stands for an EXTERNAL that is not called.
!>
!> Arguments
!>
!>   N       number of coordinates, 1 or more
!>   FORCE   subroutine, all forces on the right-hand side (below)
!>   MASS    subroutine, the mass matrix; not called where IOPT(11) = 0
!>   TANG    subroutine, the tangent matrices; not called where IOPT(20) = 0
!>   OUT     subroutine, takes the results; not called where IOPT(1) = IOPT(2) = 0
!>   T       in: where to begin.  Out: where the run ended, TEND on success
!>   Q, V    in: coordinates and velocities at the first T.  Out: at the last
!>   A       out: accelerations at the last T
!>   TEND    where to end, on either side of T
!>   H       step length, of the sign of TEND - T; the last step is shorter if need be
!>   IOPT    options, all 0 by default (below)
!>   ROPT    options, all 0.0D0 by default (below)
!>   RPAR, IPAR   passed through to the subroutines, any length of 1 or more
!>   ICNT    out: counters of steps, steps of the base of an extrapolation, rejected steps,
!>           FORCE (or LOAD), MASS, TANG (or tangents by differences), factorizations,
!>           solutions, Newton corrections, halved corrections
!>   IDID    out: 0 done, > 0 done with news, < 0 failed (below)
!>   TEXT    out: where IDID is not 0, a sentence: what happened, where, what helps.  Where it is 0
!>           blank, or a warning, with numbers, of steps beyond the stability limit of the method.
!>           160 characters are good, 320 always enough
!>
!> INTEGER has 4 bytes and DOUBLE PRECISION 8: no -fdefault-integer-8, no -fdefault-real-8.
!>
!> On failure T, Q, V and A are those of the last good step.
!>
!> Subroutines of the user.  IERR = 0 on entry; set it > 0 where T, Q, V are outside what the
!> model allows (a smaller step may help), < 0 to give up.
!>
!>      SUBROUTINE FORCE (N, T, Q, V, F, RPAR, IPAR, IERR)
!>           set F(N)
!>      SUBROUTINE MASS (N, T, Q, V, AM, LDM, RPAR, IPAR, IERR)
!>           set AM(LDM,N), which is zero on entry:
!>           diagonal (LDM = 1)          AM(1,J)        = M(J,J)
!>           band (LDM = KL + KU + 1)    AM(KU+1+I-J,J) = M(I,J)    as in LAPACK
!>           dense (LDM = N)             AM(I,J)        = M(I,J)
!>      SUBROUTINE TANG (N, T, Q, V, A, AK, AC, LD, RPAR, IPAR, IERR)
!>           set AK(LD,N) = -d(F - M A)/dQ and AC(LD,N) = -d(F - M A)/dV for this A, stored as
!>           AM is and zero on entry; leave AC alone where IOPT(23) = 1
!>      SUBROUTINE OUT (N, T, Q, V, A, RPAR, IPAR, ISTOP)
!>           results at T, not to be changed; ISTOP = 0 on entry, set it to 1 to end the run
!>
!> IOPT    0 is the default
!>   (1)   K > 0: OUT is called for the start, every K-th step, and the last one
!>   (2)   K > 0: OUT is called at the times ROPT(11), ..., ROPT(10+K) instead, in the order
!>         of the run, interpolated inside a step; where OUT ends the run, T is the end of
!>         that step
!>   (3)   most Newton corrections in a step                                         (25)
!>   (4)   most halvings of a correction, -1: none                                   (20)
!>   (5)   0: Newmark's method, 1: implicit midpoint rule
!>   (6), (7)   read by DSNEXT, DSNEXL and DSTABL
!>   (8)   1: BETA and GAMMA are in ROPT(1) and ROPT(2)                     (1/4 and 1/2)
!>   (11)  M: 0 identity, 1 diagonal, 2 band, 3 dense
!>   (12), (13)   KL and KU of M
!>   (14)  1: M is not symmetric
!>   (15)  1: M is constant, MASS is called once
!>   (16)  tangents: 1 diagonal, 2 band, 3 dense                                    (dense)
!>   (17), (18)   KL and KU of the tangents
!>   (19)  1: the tangents are symmetric
!>   (20)  1: TANG gives the tangents                                       (differences do)
!>   (21)  1: the tangents are constant
!>   (22)  1: F is linear in Q and V, and M depends on T at most (read where IOPT(20) = 1)
!>   (23)  1: F and M do not depend on V, AC is zero
!>
!> ROPT    0.0D0 is the default
!>   (1), (2)     BETA >= 0 and GAMMA >= 0, read where IOPT(8) = 1
!>   (3)          tolerance of a Newton correction, relative to the largest components of Q and V
!>                                                                            (to round-off)
!>   (11) ...     times for OUT
!>
!> IDID    CALL DSMESG (IDID, TEXT) gives these words
!>     0  done                             -5  the step length became too small
!>     1  OUT asked to stop                -6  no memory
!>    -1  an argument is out of range     -10  a subroutine gave NaN or infinity
!>    -2  a subroutine of the user refused
!>    -3  Newton's iteration did not converge
!>    -4  a matrix is singular or indefinite
!>
!> Example: a pendulum, Q'' = -9.81 sin Q, from rest at 1, to T = 2
!>
!>      PROGRAM PENDUL
!>      EXTERNAL SWING, DSNONE
!>      INTEGER IOPT(30), ICNT(10), IPAR(1), IDID
!>      DOUBLE PRECISION T, Q(1), V(1), A(1), ROPT(10), RPAR(1)
!>      CHARACTER*160 TEXT
!>      DATA IOPT /30*0/, ROPT /10*0.0D0/
!>      T = 0.0D0
!>      Q(1) = 1.0D0
!>      V(1) = 0.0D0
!>      RPAR(1) = 9.81D0
!>      CALL DSNEWM (1, SWING, DSNONE, DSNONE, DSNONE, T, Q, V, A, 2.0D0,
!>     1             0.01D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>      IF (IDID .LT. 0) PRINT *, TEXT
!>      PRINT *, T, Q(1), V(1)
!>      END
!>      SUBROUTINE SWING (N, T, Q, V, F, RPAR, IPAR, IERR)
!>      INTEGER N, IPAR(*), IERR
!>      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
!>      F(1) = -RPAR(1)*SIN(Q(1))
!>      END
recursive subroutine dsnewm(n, force, mass, tang, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
   use dynstep_f77_run, only: method_plain, run_external
   use dynstep_f77_systems, only: f77_force, f77_mass, f77_out, f77_tangent
   use dynstep_kinds, only: wp
   implicit none
   integer, intent(in) :: n
   procedure(f77_force) :: force
   procedure(f77_mass) :: mass
   procedure(f77_tangent) :: tang
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
   call run_external(method_plain, n, force, mass, tang, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
end subroutine dsnewm
