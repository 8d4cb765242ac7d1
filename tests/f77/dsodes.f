C     SPDX-License-Identifier: BSD-3-Clause
C     DSBINT: Jacobians of all kinds, orders, output, control of the
C     step, what is refused;
C     and DSPADE against DSNEXL.
      PROGRAM DSODES
      EXTERNAL F, JAC, OUT, LOAD, DSNONE
      INTEGER IOPT(30), IPAR(3), ICNT(10), IDID, NPASS, NFAIL, I, K
      INTEGER NSTEPS(5)
      DOUBLE PRECISION T, Y(3), YP(3), YR(3), ROPT(14), RPAR(200), E
      DOUBLE PRECISION AMD(3), AKB(3,3), Q(3), V(3), A(3), QR(3)
      CHARACTER*160 TEXT
      DATA NPASS, NFAIL /0, 0/
      DATA AMD /2.0D0, 1.0D0, 1.0D0/
      DATA AKB /0.0D0, 3.0D0, -1.0D0, -1.0D0, 2.0D0, -1.0D0,
     1          -1.0D0, 2.0D0, 0.0D0/

C     Orders: 6 of the halves (5,5), here the reference of the others
      CALL CLEAR (IOPT, ROPT, IPAR, T, YR)
      IOPT(6) = 5
      IOPT(7) = 5
      CALL DSBINT (3, F, DSNONE, DSNONE, T, YR, YP, 2.0D0, 0.02D0,
     1             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. TEXT .EQ. ' ' .AND. T .EQ. 2.0D0
     1            .AND. ICNT(1) .EQ. 100, 'reference', NPASS, NFAIL)
      CALL F (3, T, YR, Y, RPAR, IPAR, IDID)
      CALL CHECK (ABS(Y(1) - YP(1)) .EQ. 0.0D0, 'YP', NPASS, NFAIL)

C     K = 1, 2: differences dense, band; 4 to 6: JAC dense, band, and
C     diagonal, which leaves entries out: more iterations
      DO 20 K = 1, 6
         IF (K .EQ. 3) GO TO 20
         CALL CLEAR (IOPT, ROPT, IPAR, T, Y)
         IOPT(16) = 3 - MOD(K - 1, 3)
         IPAR(1) = IOPT(16)
         IF (IOPT(16) .EQ. 2) THEN
            IOPT(17) = 1
            IOPT(18) = 1
         END IF
         IF (K .GT. 3) IOPT(20) = 1
         CALL DSBINT (3, F, JAC, DSNONE, T, Y, YP, 2.0D0, 0.05D0,
     1                IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
         E = ABS(Y(1) - YR(1)) + ABS(Y(2) - YR(2)) + ABS(Y(3) - YR(3))
         CALL CHECK (IDID .EQ. 0 .AND. E .LT. 2.0D-6, 'Jacobians',
     1               NPASS, NFAIL)
         CALL CHECK ((IPAR(3) .GT. 0) .EQV. (K .GT. 3), 'JAC is called',
     1               NPASS, NFAIL)
   20 CONTINUE

C     Fehlberg's halves, and back to the start with another ALPHA
      CALL CLEAR (IOPT, ROPT, IPAR, T, Y)
      IOPT(5) = 1
      CALL DSBINT (3, F, DSNONE, DSNONE, T, Y, YP, 2.0D0, 0.05D0,
     1             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Y(1) - YR(1)) .LT. 1.0D-8,
     1            'Fehlberg', NPASS, NFAIL)
      IOPT(8) = 1
      ROPT(1) = 0.4D0
      CALL DSBINT (3, F, DSNONE, DSNONE, T, Y, YP, 0.0D0, -0.05D0,
     1             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Y(1) - 1.0D0) .LT. 1.0D-5,
     1            'there and back', NPASS, NFAIL)

C     Output at each second step, at times, and its stop
      CALL CLEAR (IOPT, ROPT, IPAR, T, Y)
      IOPT(1) = 2
      CALL DSBINT (3, F, DSNONE, OUT, T, Y, YP, 1.0D0, 0.1D0,
     1             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. IPAR(1) .EQ. 6 .AND. RPAR(11) .EQ.
     1            1.0D0 .AND. RPAR(12) .EQ. Y(1), 'OUT', NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, IPAR, T, Y)
      IOPT(2) = 2
      ROPT(11) = 0.25D0
      ROPT(12) = 0.75D0
      IPAR(2) = 2
      CALL DSBINT (3, F, DSNONE, OUT, T, Y, YP, 1.0D0, 0.1D0,
     1             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 1 .AND. IPAR(1) .EQ. 2 .AND. RPAR(3) .EQ.
     1            0.75D0 .AND. ABS(T - 0.8D0) .LT. 1.0D-15, 'stop',
     2            NPASS, NFAIL)

C     A subroutine that gives up: T, Y are those of the last good step
      CALL CLEAR (IOPT, ROPT, IPAR, T, Y)
      IPAR(2) = -7
      CALL DSBINT (3, F, DSNONE, DSNONE, T, Y, YP, 2.0D0, 0.1D0,
     1             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -2 .AND. T .GT. 0.7D0 .AND. T .LE. 1.0D0
     1            .AND. INDEX(TEXT, 'rhs') .GT. 0, 'gives up', NPASS,
     2            NFAIL)

C     Steps that follow the error: standard, PI, PI as listed, with
C     either estimate of Fehlberg's halves; each has its own steps
      DO 25 K = 1, 5
         CALL CLEAR (IOPT, ROPT, IPAR, T, Y)
         IOPT(1) = 1
         IOPT(9) = 1
         IF (K .EQ. 2 .OR. K .EQ. 3) IOPT(9) = 2
         IF (K .EQ. 3) IOPT(10) = 1
         IF (K .GT. 3) IOPT(5) = 1
         IF (K .EQ. 5) IOPT(11) = 1
         ROPT(2) = 1.0D-7
         ROPT(4) = 1.0D0
         CALL DSBINT (3, F, DSNONE, OUT, T, Y, YP, 2.0D0, 1.0D0,
     1                IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
         E = ABS(Y(1) - YR(1)) + ABS(Y(2) - YR(2)) + ABS(Y(3) - YR(3))
         CALL CHECK (IDID .EQ. 0 .AND. T .EQ. 2.0D0 .AND. IPAR(1) .EQ.
     1               ICNT(1) + 1, 'control', NPASS, NFAIL)
         CALL CHECK (K .EQ. 5 .OR. (E .LT. 1.0D-7*ICNT(1) .AND.
     1               ICNT(3) .GT. 0), 'its error', NPASS, NFAIL)
         NSTEPS(K) = ICNT(1)
   25 CONTINUE
      CALL CHECK (NSTEPS(1) .NE. NSTEPS(2) .AND. NSTEPS(2) .NE.
     1            NSTEPS(3) .AND. NSTEPS(5) .LT. NSTEPS(4),
     2            'ways to control', NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, IPAR, T, Y)
      IOPT(2) = 2
      IOPT(9) = 1
      ROPT(2) = 1.0D-7
      ROPT(11) = 0.25D0
      ROPT(12) = 0.75D0
      CALL DSBINT (3, F, DSNONE, OUT, T, Y, YP, 2.0D0, 0.0D0,
     1             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. IPAR(1) .EQ. 2 .AND. RPAR(3) .EQ.
     1            0.75D0 .AND. ICNT(1) .GE. 16, 'times', NPASS, NFAIL)

C     What is out of range is named
      DO 30 K = 1, 13
         CALL CLEAR (IOPT, ROPT, IPAR, T, Y)
         I = 3
         IF (K .EQ. 1) IOPT(5) = 2
         IF (K .EQ. 2) IOPT(6) = 6
         IF (K .EQ. 3) IOPT(7) = -1
         IF (K .EQ. 4) IOPT(8) = 1
         IF (K .EQ. 4) ROPT(1) = 1.5D0
         IF (K .EQ. 5) IOPT(16) = 2
         IF (K .EQ. 5) IOPT(17) = 3
         IF (K .EQ. 6) ROPT(3) = -1.0D0
         IF (K .EQ. 7) I = 0
         IF (K .GE. 8) IOPT(9) = 1
         IF (K .GE. 9) ROPT(2) = 1.0D-6
         IF (K .EQ. 9) IOPT(9) = 3
         IF (K .EQ. 10) IOPT(10) = 2
         IF (K .EQ. 11) IOPT(11) = -1
         IF (K .EQ. 12) ROPT(4) = -1.0D0
         IF (K .EQ. 13) IOPT(1) = 2
         CALL DSBINT (I, F, DSNONE, DSNONE, T, Y, YP, 2.0D0, 0.1D0,
     1                IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
         CALL CHECK (IDID .EQ. -1 .AND. T .EQ. 0.0D0 .AND.
     1      (INDEX(TEXT, 'OPT(') .GT. 0 .OR. INDEX(TEXT, 'N = 0') .GT.
     2      0), TEXT, NPASS, NFAIL)
   30 CONTINUE

C     DSPADE: a chain with a load, against the extrapolation
      CALL CLEAR (IOPT, ROPT, IPAR, T, Q)
      CALL CHAIN (IOPT, V)
      IOPT(6) = 5
      CALL DSNEXL (3, AMD, A, AKB, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0, 'DSNEXL', NPASS, NFAIL)
      DO 40 I = 1, 3
         QR(I) = Q(I)
   40 CONTINUE
      DO 50 K = 0, 2
         CALL CLEAR (IOPT, ROPT, IPAR, T, Q)
         CALL CHAIN (IOPT, V)
         IF (K .EQ. 1) IOPT(6) = 3
         IF (K .EQ. 2) IOPT(7) = 6
         CALL DSPADE (3, AMD, A, AKB, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1                0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     2                TEXT)
         E = ABS(Q(1) - QR(1)) + ABS(Q(2) - QR(2)) + ABS(Q(3) - QR(3))
         CALL CHECK (IDID .EQ. 0 .AND. T .EQ. 2.0D0 .AND. E .LT.
     1               1.0D-11, 'DSPADE', NPASS, NFAIL)
   50 CONTINUE
      CALL CLEAR (IOPT, ROPT, IPAR, T, Q)
      CALL CHAIN (IOPT, V)
      IOPT(7) = 9
      CALL DSPADE (3, AMD, A, AKB, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(7) = 9') .GT. 0,
     1            'degree', NPASS, NFAIL)

      WRITE (*,'(I0, A, I0, A)') NPASS, ' passed, ', NFAIL, ' failed'
      IF (NFAIL .GT. 0) STOP 1
      END

      SUBROUTINE CLEAR (IOPT, ROPT, IPAR, T, Y)
      INTEGER IOPT(30), IPAR(3), I
      DOUBLE PRECISION ROPT(14), T, Y(3)
      DO 10 I = 1, 30
         IOPT(I) = 0
   10 CONTINUE
      DO 20 I = 1, 14
         ROPT(I) = 0.0D0
   20 CONTINUE
      IPAR(1) = 0
      IPAR(2) = 0
      IPAR(3) = 0
      T = 0.0D0
      Y(1) = 1.0D0
      Y(2) = 0.0D0
      Y(3) = -0.5D0
      END

      SUBROUTINE CHAIN (IOPT, V)
      INTEGER IOPT(30)
      DOUBLE PRECISION V(3)
      IOPT(11) = 1
      IOPT(19) = 2
      IOPT(20) = 1
      IOPT(21) = 1
      IOPT(23) = 1
      V(1) = 0.0D0
      V(2) = 0.25D0
      V(3) = 0.0D0
      END

C     Gives up after T = 1 where IPAR(2) = -7
      SUBROUTINE F (N, T, Y, YP, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Y(N), YP(N), RPAR(*)
      YP(1) = -2.0D0*Y(1) - Y(1)**3 + Y(2)
      YP(2) = Y(1) - 2.0D0*Y(2) + Y(3)
      YP(3) = Y(2) - 2.0D0*Y(3) + SIN(T)
      IF (IPAR(2) .EQ. -7 .AND. T .GT. 1.0D0) IERR = -7
      END

      SUBROUTINE JAC (N, T, Y, AJ, LD, RPAR, IPAR, IERR)
      INTEGER N, LD, IPAR(*), IERR, I, J, L
      DOUBLE PRECISION T, Y(N), AJ(LD,N), RPAR(*), D
      IPAR(3) = IPAR(3) + 1
      DO 20 J = 1, N
         DO 10 I = 1, N
            D = 0.0D0
            IF (ABS(I - J) .EQ. 1) D = 1.0D0
            IF (I .EQ. J) D = -2.0D0
            IF (I .EQ. J .AND. I .EQ. 1) D = D - 3.0D0*Y(1)**2
            L = 0
            IF (IPAR(1) .EQ. 3) L = I
            IF (IPAR(1) .EQ. 2) L = 2 + I - J
            IF (IPAR(1) .EQ. 1 .AND. I .EQ. J) L = 1
            IF (L .GE. 1 .AND. L .LE. LD) AJ(L,J) = D
   10    CONTINUE
   20 CONTINUE
      END

C     Keeps T and Y(1) in RPAR, stops at point number IPAR(2)
      SUBROUTINE OUT (N, T, Y, YP, RPAR, IPAR, ISTOP)
      INTEGER N, IPAR(*), ISTOP
      DOUBLE PRECISION T, Y(N), YP(N), RPAR(*)
      IPAR(1) = IPAR(1) + 1
      RPAR(2*IPAR(1)-1) = T
      RPAR(2*IPAR(1)) = Y(1)
      IF (IPAR(1) .EQ. IPAR(2)) ISTOP = 1
      END

      SUBROUTINE LOAD (N, T, P, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR, I
      DOUBLE PRECISION T, P(N), RPAR(*)
      DO 10 I = 1, N
         P(I) = I*SIN(T)
   10 CONTINUE
      END

      SUBROUTINE CHECK (OK, WHAT, NPASS, NFAIL)
      LOGICAL OK
      CHARACTER*(*) WHAT
      INTEGER NPASS, NFAIL
      IF (OK) THEN
         NPASS = NPASS + 1
      ELSE
         NFAIL = NFAIL + 1
         WRITE (*,*) 'FAIL ', WHAT
      END IF
      END
