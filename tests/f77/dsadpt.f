C     SPDX-License-Identifier: BSD-3-Clause
C     DSADAP and DSADAO: a ball that bounces at known times, tolerances,
C     where runs end, output, what is refused.
C     IPAR(1): bounces, (2): calls of OUT, (3): what REBND does, (4):
C     what FLOOR does, (5): calls of OUT behind a bounce
      PROGRAM DSADPT
      EXTERNAL FALL, FALLO, FLOORS, FLOORO, REBND, REBNDO, OUT, OUTO
      EXTERNAL SWING, DSNONE
      INTEGER IOPT(30), IPAR(5), ICNT(10), IDIR(2), KEV, IDID
      INTEGER NPASS, NFAIL, I, K, NEV, NSTEPS
      DOUBLE PRECISION T, Q(1), V(1), A(1), Y(2), YP(2), ATOL(2)
      DOUBLE PRECISION ROPT(14), RPAR(1), TB(7), AT, W, RTOL
      CHARACTER*160 TEXT
      DATA NPASS, NFAIL /0, 0/

C     Times of the bounces: from rest at 1, restitution 0.8
      AT = SQRT(2.0D0/9.81D0)
      W = 9.81D0*AT
      DO 10 K = 1, 7
         TB(K) = AT
         W = 0.8D0*W
         AT = AT + 2.0D0*W/9.81D0
   10 CONTINUE

C     All of them, by both families, with output at each step; the floor
C     is function 1, the top 2
      DO 20 K = 0, 1
         CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
         IOPT(1) = 1
         IOPT(10) = K
         IOPT(24) = 1
         CALL DSADAP (1, FALL, DSNONE, DSNONE, OUT, T, Q, V, A, 3.0D0,
     1                1.0D-10, ATOL, 0.0D0, 2, FLOORS, REBND, IDIR, KEV,
     2                IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
         CALL CHECK (IDID .EQ. 0 .AND. TEXT .EQ. ' ' .AND. KEV .EQ. 0
     1               .AND. T .EQ. 3.0D0, 'bounces', NPASS, NFAIL)
         CALL CHECK (IPAR(1) .EQ. 6 .AND. ABS(RPAR(1) - TB(6)) .LT.
     1               1.0D-12, 'time of the last', NPASS, NFAIL)
         W = 9.81D0*TB(1)*0.8D0**6
         CALL CHECK (ABS(V(1) - W + 9.81D0*(3.0D0 - TB(6))) .LT. 1D-11
     1               .AND. A(1) .EQ. -9.81D0, 'end', NPASS, NFAIL)
         CALL CHECK (IPAR(2) .EQ. ICNT(1) + 7 .AND. IPAR(5) .EQ. 6,
     1               'OUT before and behind', NPASS, NFAIL)
   20 CONTINUE

C     Levels by the error: less work than with four of them
      DO 25 K = 0, 1
         CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
         IOPT(7) = 3 + 3*K
         IOPT(9) = K
         ATOL(1) = 1.0D-12
         CALL DSADAP (1, SWING, DSNONE, DSNONE, DSNONE, T, Q, V, A,
     1                9.0D0, 1.0D-12, ATOL, 0.0D0, 0, DSNONE, DSNONE,
     2                IDIR, KEV, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     3                TEXT)
         CALL CHECK (IDID .EQ. 0 .AND. TEXT .EQ. ' ', 'by the error',
     1               NPASS, NFAIL)
         IF (K .EQ. 0) NSTEPS = ICNT(4)
   25 CONTINUE
      CALL CHECK (ICNT(4) .LT. NSTEPS, 'less work', NPASS, NFAIL)
      IOPT(9) = 2
      CALL DSADAP (1, SWING, DSNONE, DSNONE, DSNONE, T, Q, V, A, 1D1,
     1             1.0D-9, ATOL, 0.0D0, 0, DSNONE, DSNONE, IDIR, KEV,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(9)') .GT. 0,
     1            'IOPT(9)', NPASS, NFAIL)

C     The run ends at each event, and goes on behind it
      CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
      CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A, 3.0D0,
     1             1.0D-10, ATOL, 0.0D0, 2, FLOORS, DSNONE, IDIR, KEV,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 3 .AND. KEV .EQ. 1 .AND. TEXT .NE. ' '
     1            .AND. ABS(T - TB(1)) .LT. 1.0D-12 .AND. ABS(Q(1))
     2            .LT. 1.0D-13 .AND. V(1) .LT. 0.0D0, 'end at 1',
     3            NPASS, NFAIL)
      V(1) = -V(1)
      CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A, 3.0D0,
     1             1.0D-10, ATOL, 0.0D0, 2, FLOORS, DSNONE, IDIR, KEV,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 3 .AND. KEV .EQ. 2 .AND. ABS(T - 2.0D0
     1            *TB(1)) .LT. 1.0D-12 .AND. ABS(V(1)) .LT. 1.0D-12
     2            .AND. ABS(Q(1) - 1.0D0) .LT. 1.0D-12, 'end at 2',
     3            NPASS, NFAIL)

C     Directions: up alone, never; and the action ends the run, before
C     (JOB = 2) and behind (3) its change
      CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
      IDIR(1) = 1
      IDIR(2) = 1
      CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             1.0D-10, ATOL, 0.0D0, 2, FLOORS, DSNONE, IDIR, KEV,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. T .EQ. 1.0D0 .AND. Q(1) .LT.
     1            -3.0D0, 'directions', NPASS, NFAIL)
      DO 30 K = 2, 3
         CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
         IOPT(24) = 1
         IPAR(3) = K
         CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A,
     1                3.0D0, 1.0D-10, ATOL, 0.0D0, 1, FLOORS, REBND,
     2                IDIR, KEV, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     3                TEXT)
         W = 9.81D0*TB(1)
         IF (K .EQ. 3) W = -0.8D0*W
         CALL CHECK (IDID .EQ. 3 .AND. KEV .EQ. 1 .AND. ABS(V(1) + W)
     1               .LT. 1.0D-11 .AND. ABS(T - TB(1)) .LT. 1.0D-12,
     2               'JOB', NPASS, NFAIL)
   30 CONTINUE

C     First order, at times
      CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Y(1), Y(2))
      IOPT(2) = 4
      IOPT(24) = 1
      CALL DSADAO (2, FALLO, DSNONE, OUTO, T, Y, YP, 3.0D0, 1.0D-10,
     1             ATOL, 0.0D0, 1, FLOORO, REBNDO, IDIR, KEV, IOPT,
     2             ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. IPAR(1) .EQ. 6 .AND. IPAR(2) .EQ. 4
     1            .AND. ABS(RPAR(1) - TB(6)) .LT. 1.0D-12 .AND. YP(1)
     2            .EQ. Y(2), 'DSADAO', NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Y(1), Y(2))
      CALL DSADAO (2, FALLO, DSNONE, DSNONE, T, Y, YP, 3.0D0, 1.0D-10,
     1             ATOL, 0.0D0, 1, FLOORO, DSNONE, IDIR, KEV, IOPT,
     2             ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 3 .AND. KEV .EQ. 1 .AND. ABS(T - TB(1))
     1            .LT. 1.0D-12, 'DSADAO ends', NPASS, NFAIL)

C     Tolerances: q = cos t without events; smaller ones cost more
C     steps and give smaller errors; backward, too
      NSTEPS = 0
      DO 40 K = 4, 10, 3
         CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
         RTOL = 10.0D0**(-K)
         ATOL(1) = RTOL
         CALL DSADAP (1, SWING, DSNONE, DSNONE, DSNONE, T, Q, V, A,
     1                -5.0D0, RTOL, ATOL, 0.0D0, 0, DSNONE, DSNONE,
     2                IDIR, KEV, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     3                TEXT)
         CALL CHECK (IDID .EQ. 0 .AND. T .EQ. -5.0D0 .AND. ABS(Q(1)
     1               - COS(5.0D0)) .LT. 10.0D0*RTOL .AND. ICNT(1) .GT.
     2               NSTEPS, 'tolerances', NPASS, NFAIL)
         NSTEPS = ICNT(1)
   40 CONTINUE
C     One for each, so that V counts for nothing, and limits of steps
      CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
      IOPT(25) = 1
      ATOL(1) = 1.0D-10
      ATOL(2) = 1.0D10
      ROPT(4) = 0.1D0
      CALL DSADAP (1, SWING, DSNONE, DSNONE, DSNONE, T, Q, V, A, 5.0D0,
     1             0.0D0, ATOL, 0.01D0, 0, DSNONE, DSNONE, IDIR, KEV,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ICNT(1) .GE. 50 .AND. ABS(Q(1)
     1            - COS(5.0D0)) .LT. 1.0D-8, 'ATOL(2)', NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
      ROPT(5) = 0.5D0
      CALL DSADAP (1, SWING, DSNONE, DSNONE, DSNONE, T, Q, V, A, 5.0D0,
     1             1.0D-12, ATOL, 1.0D0, 0, DSNONE, DSNONE, IDIR, KEV,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -5 .AND. T .LT. 5.0D0, 'shortest step',
     1            NPASS, NFAIL)

C     Functions that give up or give NaN: the state reached is kept
      DO 50 K = 1, 4
         CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
         IOPT(24) = 1
         IF (K .LE. 2) IPAR(4) = K
         IF (K .EQ. 3) IPAR(3) = -1
         IF (K .EQ. 4) IPAR(3) = 9
         CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A,
     1                3.0D0, 1.0D-10, ATOL, 0.0D0, 1, FLOORS, REBND,
     2                IDIR, KEV, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     3                TEXT)
         I = -2
         IF (K .EQ. 2) I = -10
         CALL CHECK (IDID .EQ. I .AND. KEV .EQ. 0 .AND. ABS(Q(1) - 1D0
     1               + 4.905D0*T*T) .LT. 1.0D-12 .AND. T .GT. 0.0D0
     2               .AND. TEXT .NE. ' ', 'failures', NPASS, NFAIL)
   50 CONTINUE
C     It comes to rest
      CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
      IOPT(24) = 1
      CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A, 9.0D0,
     1             1.0D-10, ATOL, 0.0D0, 1, FLOORS, REBND, IDIR, KEV,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -13 .AND. ABS(T - 9.0D0*TB(1)) .LT. 1.0D-6,
     1            'rest', NPASS, NFAIL)

C     What is refused, before anything is called or changed
      DO 60 K = 1, 14
         CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
         RTOL = 1.0D-10
         NEV = 1
         W = 0.0D0
         IF (K .EQ. 1) NEV = -1
         IF (K .EQ. 2) IDIR(1) = 2
         IF (K .EQ. 3) IOPT(24) = 2
         IF (K .EQ. 4) IOPT(25) = 2
         IF (K .EQ. 5) IOPT(10) = 2
         IF (K .EQ. 6) IOPT(1) = 2
         IF (K .EQ. 7) RTOL = -1.0D0
         IF (K .EQ. 8) ATOL(1) = -1.0D0
         IF (K .EQ. 9) ROPT(4) = -1.0D0
         IF (K .EQ. 10) ROPT(5) = -1.0D0
         IF (K .EQ. 11) W = -0.1D0
         IF (K .EQ. 12) IOPT(6) = 13
         IF (K .EQ. 13) IOPT(6) = 1
         IF (K .EQ. 14) CALL NAN (T)
         CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A,
     1                3.0D0, RTOL, ATOL, W, NEV, FLOORS, DSNONE,
     2                IDIR, KEV, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     3                TEXT)
         CALL CHECK (IDID .EQ. -1 .AND. Q(1) .EQ. 1.0D0 .AND. V(1) .EQ.
     1               0.0D0 .AND. KEV .EQ. 0 .AND. IPAR(1) .EQ. 0 .AND.
     2               TEXT .NE. ' ', 'refusals', NPASS, NFAIL)
   60 CONTINUE
      CALL CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
      ATOL(1) = 0.0D0
      CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A, 3.0D0,
     1             1.0D-17, ATOL, 0.0D0, 0, DSNONE, DSNONE, IDIR, KEV,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -14 .AND. T .EQ. 0.0D0, 'rounding', NPASS,
     1            NFAIL)
      WRITE (*,1000) NPASS, NFAIL
 1000 FORMAT (I5, ' passed,', I5, ' failed')
      IF (NFAIL .GT. 0) STOP 1
      END

      SUBROUTINE CLEAR (IOPT, ROPT, IPAR, IDIR, ATOL, RPAR, T, Q, V)
      INTEGER IOPT(30), IPAR(5), IDIR(2), I
      DOUBLE PRECISION ROPT(14), ATOL(2), RPAR(1), T, Q(*), V(*)
      DO 10 I = 1, 30
         IOPT(I) = 0
   10 CONTINUE
      DO 20 I = 1, 10
         ROPT(I) = 0.0D0
   20 CONTINUE
      ROPT(11) = 0.0D0
      ROPT(12) = 0.7D0
      ROPT(13) = 0.7D0
      ROPT(14) = 2.9D0
      DO 30 I = 1, 5
         IPAR(I) = 0
   30 CONTINUE
      IPAR(3) = 1
      IDIR(1) = -1
      IDIR(2) = -1
      ATOL(1) = 1.0D-10
      ATOL(2) = 1.0D-10
      RPAR(1) = -1.0D0
      T = 0.0D0
      Q(1) = 1.0D0
      V(1) = 0.0D0
      END

      SUBROUTINE FALL (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      F(1) = -9.81D0
      END

      SUBROUTINE FALLO (N, T, Y, YP, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Y(N), YP(N), RPAR(*)
      YP(1) = Y(2)
      YP(2) = -9.81D0
      END

      SUBROUTINE SWING (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      F(1) = -Q(1)
      END

      SUBROUTINE FLOORS (N, NEV, T, Q, V, S, RPAR, IPAR, IERR)
      INTEGER N, NEV, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), S(NEV), RPAR(*)
      S(1) = Q(1)
      IF (NEV .GT. 1) S(2) = V(1)
      IF (IPAR(4) .EQ. 1 .AND. T .GT. 0.4D0) IERR = -1
      IF (IPAR(4) .EQ. 2 .AND. T .GT. 0.4D0) CALL NAN (S(1))
      END

      SUBROUTINE FLOORO (N, NEV, T, Y, S, RPAR, IPAR, IERR)
      INTEGER N, NEV, IPAR(*), IERR
      DOUBLE PRECISION T, Y(N), S(NEV), RPAR(*)
      S(1) = Y(1)
      END

C     Nothing is done at the top; Q is written there and that is lost
      SUBROUTINE REBND (N, KEV, T, Q, V, JOB, RPAR, IPAR, IERR)
      INTEGER N, KEV, JOB, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), RPAR(*)
      IF (KEV .EQ. 2) THEN
         Q(1) = 1.0D9
         RETURN
      END IF
      V(1) = -0.8D0*V(1)
      IPAR(1) = IPAR(1) + 1
      RPAR(1) = T
      JOB = IPAR(3)
      IF (IPAR(3) .LT. 0) IERR = -1
      END

      SUBROUTINE REBNDO (N, KEV, T, Y, JOB, RPAR, IPAR, IERR)
      INTEGER N, KEV, JOB, IPAR(*), IERR
      DOUBLE PRECISION T, Y(N), RPAR(*)
      Y(2) = -0.8D0*Y(2)
      IPAR(1) = IPAR(1) + 1
      RPAR(1) = T
      JOB = 1
      END

C     Counts all calls, and those behind a bounce
      SUBROUTINE OUT (N, T, Q, V, A, RPAR, IPAR, ISTOP)
      INTEGER N, IPAR(*), ISTOP
      DOUBLE PRECISION T, Q(N), V(N), A(N), RPAR(*)
      IPAR(2) = IPAR(2) + 1
      IF (T .EQ. RPAR(1) .AND. V(1) .GT. 0.0D0) IPAR(5) = IPAR(5) + 1
      END

      SUBROUTINE OUTO (N, T, Y, YP, RPAR, IPAR, ISTOP)
      INTEGER N, IPAR(*), ISTOP
      DOUBLE PRECISION T, Y(N), YP(N), RPAR(*)
      IPAR(2) = IPAR(2) + 1
      END

      SUBROUTINE CHECK (OK, NAME, NPASS, NFAIL)
      LOGICAL OK
      CHARACTER*(*) NAME
      INTEGER NPASS, NFAIL
      IF (OK) THEN
         NPASS = NPASS + 1
      ELSE
         NFAIL = NFAIL + 1
         WRITE (*,1000) NAME
      END IF
 1000 FORMAT ('FAIL ', A)
      END

C     A NaN without an operation that traps
      SUBROUTINE NAN (X)
      DOUBLE PRECISION X, Y
      CHARACTER*3 WORD
      DATA WORD /'NaN'/
      READ (WORD,'(F3.0)') Y
      X = Y
      END
