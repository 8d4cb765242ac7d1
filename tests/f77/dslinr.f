C     SPDX-License-Identifier: BSD-3-Clause
C     DSNEWL and DSNEXL: a chain of three masses with M, C and K as
C     arrays in every storage, a load, output, and what is refused.
      PROGRAM DSLINR
      INTEGER N
      PARAMETER (N = 3)
      EXTERNAL LOAD, OUT, DSNONE
      INTEGER IOPT(42), IPAR(3), ICNT(10), IDID, NPASS, NFAIL, I, J, L
      DOUBLE PRECISION AMD(N), AMB(3,N), AMF(N,N)
      DOUBLE PRECISION ACB(3,N), AKB(3,N), AKF(N,N)
      DOUBLE PRECISION T, Q(N), V(N), A(N), QR(N), VR(N), AR(N)
      DOUBLE PRECISION ROPT(20), RPAR(200), E, ONE(1), C2, C4
      CHARACTER*160 TEXT
      DATA NPASS, NFAIL /0, 0/
      DATA AMD /2.0D0, 1.0D0, 1.0D0/
      DATA AKB /0.0D0, 3.0D0, -1.0D0, -1.0D0, 2.0D0, -1.0D0,
     1          -1.0D0, 2.0D0, 0.0D0/

      IPAR(1) = 0
      IPAR(2) = 0
      IPAR(3) = 0
      DO 20 J = 1, N
         DO 10 I = 1, 3
            ACB(I,J) = 0.0625D0*AKB(I,J)
            AMB(I,J) = 0.0D0
            AMF(I,J) = 0.0D0
            AKF(I,J) = 0.0D0
            L = 2 + I - J
            IF (L .GE. 1 .AND. L .LE. 3) AKF(I,J) = AKB(L,J)
   10    CONTINUE
         AMB(2,J) = AMD(J)
         AMF(J,J) = AMD(J)
   20 CONTINUE

C     M diagonal, C and K bands: the reference of what follows
      CALL CLEAR (IOPT, ROPT, T, Q, V, A)
      IOPT(11) = 1
      IOPT(15) = 2
      IOPT(16) = 1
      IOPT(17) = 1
      IOPT(19) = 2
      IOPT(20) = 1
      IOPT(21) = 1
      IOPT(23) = 1
      CALL DSNEWL (N, AMD, ACB, AKB, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. TEXT .EQ. ' ', 'diagonal and bands',
     1            NPASS, NFAIL)
      CALL CHECK (T .EQ. 2.0D0, 'ends at TEND', NPASS, NFAIL)
      CALL CHECK (ICNT(1) .EQ. 32 .AND. ICNT(7) .GE. 1 .AND.
     1            ICNT(7) .LE. 2, 'one factorization', NPASS, NFAIL)
      DO 30 I = 1, N
         QR(I) = Q(I)
         VR(I) = V(I)
         AR(I) = A(I)
   30 CONTINUE
C     the equation of motion holds at the end
      E = 0.0D0
      DO 50 I = 1, N
         E = E + ABS(AMD(I)*A(I) - 2.0D0*I)
   50 CONTINUE
      CALL CHECK (E .GT. 0.1D0, 'accelerations move', NPASS, NFAIL)
      E = ABS(AMD(2)*A(2) + 0.0625D0*(2.0D0*V(2) - V(1) - V(3))
     1        + (2.0D0*Q(2) - Q(1) - Q(3)) - 4.0D0)
      CALL CHECK (E .LT. 1.0D-13, 'equation of motion', NPASS, NFAIL)

C     M as a band, K dense
      CALL CLEAR (IOPT, ROPT, T, Q, V, A)
      IOPT(11) = 2
      IOPT(12) = 1
      IOPT(13) = 1
      IOPT(15) = 2
      IOPT(16) = 1
      IOPT(17) = 1
      IOPT(19) = 3
      IOPT(23) = 1
      CALL DSNEWL (N, AMB, ACB, AKF, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0, 'band and dense', NPASS, NFAIL)
      CALL CHECK (ABS(Q(1) - QR(1)) + ABS(V(2) - VR(2)) .LT. 1.0D-13,
     1            'band and dense agree', NPASS, NFAIL)

C     all dense, M declared not symmetric
      CALL CLEAR (IOPT, ROPT, T, Q, V, A)
      IOPT(11) = 3
      IOPT(14) = 1
      IOPT(15) = 2
      IOPT(16) = 1
      IOPT(17) = 1
      IOPT(19) = 3
      IOPT(22) = 1
      IOPT(23) = 1
      CALL DSNEWL (N, AMF, ACB, AKF, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(3) - QR(3)) .LT. 1.0D-13,
     1            'dense', NPASS, NFAIL)

C     output every fifth step through OUT, which counts in IPAR(1)
      CALL CLEAR (IOPT, ROPT, T, Q, V, A)
      IOPT(1) = 5
      IOPT(11) = 1
      IOPT(19) = 2
      IOPT(20) = 1
      IOPT(21) = 1
      IPAR(1) = 0
      IPAR(2) = 0
      CALL DSNEWL (N, AMD, ACB, AKB, DSNONE, OUT, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. IPAR(1) .EQ. 8, 'every 5th step',
     1            NPASS, NFAIL)
      CALL CHECK (RPAR(1) .EQ. 0.0D0 .AND. RPAR(3) .EQ. 0.3125D0 .AND.
     1            RPAR(15) .EQ. 2.0D0 .AND. RPAR(16) .EQ. Q(1),
     2            'their times', NPASS, NFAIL)

C     output at times, and a stop at the second
      CALL CLEAR (IOPT, ROPT, T, Q, V, A)
      IOPT(2) = 3
      ROPT(11) = 0.1D0
      ROPT(12) = 0.11D0
      ROPT(13) = 1.5D0
      IOPT(11) = 1
      IOPT(19) = 2
      IOPT(20) = 1
      IOPT(21) = 1
      IPAR(1) = 0
      CALL DSNEWL (N, AMD, ACB, AKB, DSNONE, OUT, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. IPAR(1) .EQ. 3 .AND.
     1            RPAR(3) .EQ. 0.11D0 .AND. T .EQ. 2.0D0, 'times',
     2            NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, T, Q, V, A)
      IOPT(2) = 3
      ROPT(11) = 0.1D0
      ROPT(12) = 0.11D0
      ROPT(13) = 1.5D0
      IOPT(19) = 2
      IOPT(20) = 1
      IOPT(21) = 1
      IPAR(1) = 0
      IPAR(2) = 2
      CALL DSNEWL (N, AMD, ACB, AKB, DSNONE, OUT, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 1 .AND. IPAR(1) .EQ. 2 .AND.
     1            T .EQ. 0.125D0 .AND. INDEX(TEXT, 'OUT') .GT. 0,
     2            'OUT stops', NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, T, Q, V, A)
      IOPT(1) = 1
      IOPT(19) = 2
      IOPT(20) = 1
      IOPT(21) = 1
      IPAR(1) = 0
      IPAR(2) = 1
      CALL DSNEWL (N, AMD, ACB, AKB, DSNONE, OUT, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 1 .AND. IPAR(1) .EQ. 1 .AND. T .EQ. 0.0D0
     1            .AND. ICNT(1) .EQ. 0, 'OUT stops at once', NPASS,
     2            NFAIL)
      IPAR(2) = 0

C     orders: Q'' = -Q to T = 1 by Newmark's method and extrapolated
      ONE(1) = 1.0D0
      CALL SDOF (0, 1, ONE, C2)
      CALL CHECK (ABS(C2 - 2.0D0) .LT. 0.1D0, 'order 2', NPASS, NFAIL)
      CALL SDOF (1, 2, ONE, C4)
      CALL CHECK (ABS(C4 - 4.0D0) .LT. 0.1D0, 'order 4', NPASS, NFAIL)
      CALL SDOF (1, 3, ONE, C4)
      CALL CHECK (ABS(C4 - 6.0D0) .LT. 0.2D0, 'order 6', NPASS, NFAIL)

C     what is refused: the place is named, and nothing is changed
      CALL CLEAR (IOPT, ROPT, T, Q, V, A)
      CALL DSNEWL (0, AMD, ACB, AKB, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'N = 0') .GT. 0,
     1            'N = 0', NPASS, NFAIL)
      IOPT(15) = 7
      CALL DSNEWL (N, AMD, ACB, AKB, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(15)') .GT. 0,
     1            'unknown kind', NPASS, NFAIL)
      IOPT(15) = 2
      IOPT(17) = 3
      CALL DSNEWL (N, AMD, ACB, AKB, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(17)') .GT. 0,
     1            'bandwidth', NPASS, NFAIL)
      IOPT(15) = 0
      IOPT(19) = 3
      AKF(1,2) = -1.5D0
      CALL DSNEWL (N, AMD, ACB, AKF, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'K(2,1)') .GT. 0,
     1            'symmetry', NPASS, NFAIL)
      IOPT(19) = 1
      CALL DSNEWL (N, AMD, ACB, AMD, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             -0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'H = ') .GT. 0,
     1            'sign of H', NPASS, NFAIL)
      IOPT(6) = 13
      CALL DSNEXL (N, AMD, ACB, AMD, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(6)') .GT. 0,
     1            'levels', NPASS, NFAIL)
      CALL CHECK (T .EQ. 0.0D0 .AND. Q(1) .EQ. 1.0D0, 'nothing changed',
     1            NPASS, NFAIL)
C     a load that refuses: the state is that of the last good step
      IOPT(6) = 0
      IOPT(23) = 1
      IPAR(3) = 1
      CALL DSNEWL (N, AMD, ACB, AMD, LOAD, DSNONE, T, Q, V, A, 2.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -2 .AND. T .EQ. 1.0D0 .AND.
     1            ICNT(1) .EQ. 16, 'load refuses', NPASS, NFAIL)

      WRITE (*,1000) NPASS, NFAIL
 1000 FORMAT (I0, ' passed, ', I0, ' failed')
      IF (NFAIL .GT. 0) STOP 1
      END

      SUBROUTINE CLEAR (IOPT, ROPT, T, Q, V, A)
      INTEGER IOPT(42), I
      DOUBLE PRECISION ROPT(20), T, Q(3), V(3), A(3)
      DO 10 I = 1, 42
         IOPT(I) = 0
   10 CONTINUE
      DO 20 I = 1, 20
         ROPT(I) = 0.0D0
   20 CONTINUE
      T = 0.0D0
      DO 30 I = 1, 3
         Q(I) = 0.0D0
         V(I) = 0.0D0
         A(I) = 0.0D0
   30 CONTINUE
      Q(1) = 1.0D0
      V(2) = 0.25D0
      END

C     P = T*(1, 2, 3); refuses after T = 1 where IPAR(3) = 1
      SUBROUTINE LOAD (N, T, P, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR, I
      DOUBLE PRECISION T, P(N), RPAR(*)
      DO 10 I = 1, N
         P(I) = T*I
   10 CONTINUE
      IF (IPAR(3) .EQ. 1 .AND. T .GT. 1.0D0) IERR = -5
      END

C     Keeps T and Q(1) in RPAR, stops at point number IPAR(2)
      SUBROUTINE OUT (N, T, Q, V, A, RPAR, IPAR, ISTOP)
      INTEGER N, IPAR(*), ISTOP
      DOUBLE PRECISION T, Q(N), V(N), A(N), RPAR(*)
      IPAR(1) = IPAR(1) + 1
      RPAR(2*IPAR(1)-1) = T
      RPAR(2*IPAR(1)) = Q(1)
      IF (IPAR(1) .EQ. IPAR(2)) ISTOP = 1
      END

C     Observed order for Q'' = -Q from two step lengths
      SUBROUTINE SDOF (MODE, LEVELS, ONE, ORDER)
      EXTERNAL DSNONE
      INTEGER MODE, LEVELS, IOPT(42), ICNT(10), IPAR(1), IDID, I, J
      DOUBLE PRECISION ONE(1), ORDER, T, Q(1), V(1), A(1), H, E(2)
      DOUBLE PRECISION ROPT(20), RPAR(1)
      CHARACTER*80 TEXT
      H = 0.5D0
      DO 30 I = 1, 2
         H = 0.5D0*H
         DO 10 J = 1, 42
            IOPT(J) = 0
   10    CONTINUE
         DO 20 J = 1, 20
            ROPT(J) = 0.0D0
   20    CONTINUE
         IOPT(6) = LEVELS
         IOPT(19) = 1
         T = 0.0D0
         Q(1) = 1.0D0
         V(1) = 0.0D0
         IF (MODE .EQ. 0) THEN
            CALL DSNEWL (1, ONE, ONE, ONE, DSNONE, DSNONE, T, Q, V, A,
     1                   1.0D0, H, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     2                   TEXT)
         ELSE
            CALL DSNEXL (1, ONE, ONE, ONE, DSNONE, DSNONE, T, Q, V, A,
     1                   1.0D0, H, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     2                   TEXT)
         END IF
         E(I) = ABS(Q(1) - COS(1.0D0))
   30 CONTINUE
      ORDER = LOG(E(1)/E(2))/LOG(2.0D0)
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
