C     SPDX-License-Identifier: BSD-3-Clause
C     DSGALF and DSSOI2: a rod on a pin, a turned knife edge with
C     constraints that depend on time, starts, and what is refused.
C     IPAR(1) says what the subroutines do wrong after T = 0.25.
      PROGRAM DSCONS
      EXTERNAL WEIGHT, MASS, PIN, PINJAC, OUT, EDGE, EDGJAC, TURN
      EXTERNAL TRNJAC, DRIVE, DSNONE
      INTEGER IOPT(30), IPAR(3), ICNT(11), IDID, NPASS, NFAIL, I
      DOUBLE PRECISION T, Q(3), V(3), A(3), L(2), PSI(1), QR(3), LR(2)
      DOUBLE PRECISION ROPT(12), RPAR(2), G(2)
      CHARACTER*160 TEXT
      DATA NPASS, NFAIL /0, 0/

C     the rod from rest: multipliers at the start, energy in the end
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(24) = 1
      CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, PINJAC, DSNONE,
     1             DSNONE, DSNONE, T, Q, V, A, L, PSI, 1.0D0, 0.01D0,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. TEXT .EQ. ' ' .AND. T .EQ. 1.0D0,
     1            'rod', NPASS, NFAIL)
      CALL CHECK (ICNT(1) .EQ. 100 .AND. ICNT(11) .GT. 100, 'counters',
     1            NPASS, NFAIL)
      CALL PIN (3, 2, T, Q, G, RPAR, IPAR, I)
      CALL CHECK (ABS(G(1)) + ABS(G(2)) .LT. 1.0D-14, 'g', NPASS, NFAIL)
C     (4/3) m L**2 w**2/2 = m g L sin(angle) of the fall
      CALL CHECK (ABS(V(3)**2*8.0D0/3.0D0 + 9.81D0*Q(2)) .LT. 1.0D-2,
     1            'energy', NPASS, NFAIL)
C     along the rod L1 cos + L2 sin = -m (L w**2 - g sin(angle))
      CALL CHECK (ABS(L(1)*COS(Q(3)) + L(2)*SIN(Q(3)) - 5.0D0*(2.0D0*
     1            V(3)**2 - 9.81D0*SIN(Q(3)))) .LT. 1.0D-2, 'pin force',
     2            NPASS, NFAIL)
      DO 10 I = 1, 3
         QR(I) = Q(I)
   10 CONTINUE
      LR(1) = L(1)
      LR(2) = L(2)
C     the Jacobian by differences
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, DSNONE, DSNONE,
     1             DSNONE, DSNONE, T, Q, V, A, L, PSI, 1.0D0, 0.01D0,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(3) - QR(3)) .LT. 1.0D-10,
     1            'differences', NPASS, NFAIL)
      CALL CHECK (ABS(L(1) - LR(1)) + ABS(L(2) - LR(2)) .LT. 1.0D-6,
     1            'multipliers by differences', NPASS, NFAIL)
C     coefficients: RHO = 0.8 in both ways is the default
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(24) = 1
      IOPT(8) = 1
      ROPT(1) = 0.8D0
      CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, PINJAC, DSNONE,
     1             DSNONE, DSNONE, T, Q, V, A, L, PSI, 1.0D0, 0.01D0,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(3) - QR(3)) .LT. 1.0D-13,
     1            'RHO', NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(24) = 1
      IOPT(8) = 2
      ROPT(4) = 1.0D0/3.0D0
      ROPT(5) = 4.0D0/9.0D0
      ROPT(6) = 25.0D0/81.0D0
      ROPT(7) = 11.0D0/18.0D0
      CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, PINJAC, DSNONE,
     1             DSNONE, DSNONE, T, Q, V, A, L, PSI, 1.0D0, 0.01D0,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(3) - QR(3)) .LT. 1.0D-13,
     1            'four coefficients', NPASS, NFAIL)
C     variants, mass, first step: another motion, near by
      DO 20 I = 1, 4
         CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
         IOPT(24) = 1
         IF (I .LE. 2) IOPT(5) = I + 1
         IF (I .EQ. 3) IOPT(7) = 2
         IF (I .EQ. 4) IOPT(9) = 1
         CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, PINJAC,
     1                DSNONE, DSNONE, DSNONE, T, Q, V, A, L, PSI, 1.0D0,
     2                0.01D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
         CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(3) - QR(3)) .LT. 1.0D-3,
     1               'variants', NPASS, NFAIL)
   20 CONTINUE
C     output: the start, each 25th step, with multipliers; then a stop
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(24) = 1
      IOPT(1) = 25
      CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, PINJAC, DSNONE,
     1             DSNONE, OUT, T, Q, V, A, L, PSI, 1.0D0, 0.01D0,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. IPAR(2) .EQ. 5, 'output', NPASS,
     1            NFAIL)
      CALL CHECK (RPAR(1) .EQ. L(1) .AND. RPAR(2) .EQ. L(2),
     1            'last multipliers', NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(24) = 1
      IOPT(1) = 25
      IPAR(1) = 9
      CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, PINJAC, DSNONE,
     1             DSNONE, OUT, T, Q, V, A, L, PSI, 1.0D0, 0.01D0,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 1 .AND. ABS(T - 0.5D0) .LT. 1.0D-14,
     1            'stop', NPASS, NFAIL)

C     a knife edge, turned by THETA = T: the lateral force is PSI = -V
C     (x and y free of forces), and the turning force LAMBDA is 0
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      DO 30 I = 1, 3
         Q(I) = 0.0D0
         V(I) = 0.0D0
   30 CONTINUE
      V(1) = 2.0D0
      V(3) = 1.0D0
      IOPT(11) = 0
      IOPT(24) = 1
      IOPT(25) = 1
      CALL DSSOI2 (3, 1, 1, DRIVE, DSNONE, DSNONE, TURN, TRNJAC, EDGE,
     1             EDGJAC, DSNONE, T, Q, V, A, L, PSI, 1.0D0, 1.0D-3,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(1) - 2.0D0*SIN(1.0D0)) .LT.
     1            1.0D-6 .AND. ABS(Q(2) - 2.0D0*(1.0D0 - COS(1.0D0)))
     2            .LT. 1.0D-6, 'knife edge', NPASS, NFAIL)
      CALL CHECK (ABS(Q(3) - 1.0D0) .LT. 1.0D-14 .AND. ABS(L(1)) .LT.
     1            1.0D-10 .AND. ABS(PSI(1) - 2.0D0) .LT. 1.0D-5,
     2            'its multipliers', NPASS, NFAIL)
      T = 0.0D0
      DO 40 I = 1, 3
         Q(I) = 0.0D0
         V(I) = 0.0D0
   40 CONTINUE
      V(1) = 2.0D0
      V(3) = 1.0D0
      IOPT(24) = 0
      IOPT(25) = 0
      CALL DSSOI2 (3, 1, 1, DRIVE, DSNONE, DSNONE, TURN, DSNONE, EDGE,
     1             DSNONE, DSNONE, T, Q, V, A, L, PSI, 1.0D0, 1.0D-3,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(1) - 2.0D0*SIN(1.0D0)) .LT.
     1            1.0D-6, 'knife edge by differences', NPASS, NFAIL)

C     starts off the constraints: moved, refused, kept
      DO 50 I = 1, 3
         CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
         IOPT(24) = 1
         IOPT(6) = I
         Q(1) = 2.01D0
         CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, PINJAC,
     1                DSNONE, DSNONE, DSNONE, T, Q, V, A, L, PSI, 0.0D0,
     2                0.01D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
         IF (I .EQ. 1) CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(1) - 2.0D0)
     1      .LT. 1.0D-14, 'projected', NPASS, NFAIL)
         IF (I .EQ. 2) CALL CHECK (IDID .EQ. -7 .AND. Q(1) .EQ. 2.01D0,
     1      'refused', NPASS, NFAIL)
         IF (I .EQ. 3) CALL CHECK (IDID .EQ. 0 .AND. Q(1) .EQ. 2.01D0,
     1      'kept', NPASS, NFAIL)
   50 CONTINUE

C     subroutines that refuse, or give what is no number
      CALL FAILS (1, -2, 'constraint', NPASS, NFAIL)
      CALL FAILS (2, -10, 'constraint', NPASS, NFAIL)
      CALL FAILS (3, -2, 'constraint_jacobian', NPASS, NFAIL)
      CALL FAILS (4, -10, 'constraint_jacobian', NPASS, NFAIL)

C     arguments out of their range
      CALL REFUSE (5, 4, 'IOPT(5) = 4', NPASS, NFAIL)
      CALL REFUSE (6, -1, 'IOPT(6) = -1', NPASS, NFAIL)
      CALL REFUSE (7, 3, 'IOPT(7) = 3', NPASS, NFAIL)
      CALL REFUSE (8, 3, 'IOPT(8) = 3', NPASS, NFAIL)
      CALL REFUSE (3, -1, 'IOPT(3) = -1', NPASS, NFAIL)
      CALL REFUSE (0, 4, 'M = 4', NPASS, NFAIL)
      CALL REFUSE (0, -1, 'M = -1', NPASS, NFAIL)
      CALL REFUSE (-1, 4, 'P = 4', NPASS, NFAIL)
      CALL REFUSE (-2, 0, 'ROPT(1) = 1.5', NPASS, NFAIL)
      CALL REFUSE (-3, 0, 'alpha_m and alpha_f', NPASS, NFAIL)

C     DSGALF: the same rod without the pin falls
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      CALL DSGALF (3, WEIGHT, MASS, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.01D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ICNT(1) .EQ. 100 .AND. ABS(Q(2) +
     1            0.5D0*9.81D0) .LT. 1.0D-12, 'DSGALF', NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(8) = 1
      ROPT(1) = -0.1D0
      CALL DSGALF (3, WEIGHT, MASS, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.01D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'ROPT(1)') .GT. 0 .AND.
     1            T .EQ. 0.0D0, 'DSGALF refuses', NPASS, NFAIL)

      WRITE (*,*) NPASS, ' passed, ', NFAIL, ' failed'
      IF (NFAIL .GT. 0) STOP 1
      END

      SUBROUTINE CHECK (OK, NAME, NPASS, NFAIL)
      LOGICAL OK
      CHARACTER*(*) NAME
      INTEGER NPASS, NFAIL
      IF (OK) THEN
         NPASS = NPASS + 1
      ELSE
         NFAIL = NFAIL + 1
         WRITE (*,*) 'FAIL ', NAME
      END IF
      END

C     The rod at rest, along the x axis
      SUBROUTINE CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      INTEGER IOPT(30), IPAR(3), I
      DOUBLE PRECISION ROPT(12), RPAR(2), T, Q(3), V(3)
      DO 10 I = 1, 30
         IOPT(I) = 0
   10 CONTINUE
      DO 20 I = 1, 12
         ROPT(I) = 0.0D0
   20 CONTINUE
      DO 30 I = 1, 3
         IPAR(I) = 0
         Q(I) = 0.0D0
         V(I) = 0.0D0
   30 CONTINUE
      Q(1) = 2.0D0
      IOPT(11) = 1
      IOPT(15) = 1
      RPAR(1) = 0.0D0
      RPAR(2) = 0.0D0
      T = 0.0D0
      END

C     A subroutine does what WHAT says; the run ends at 0.25
      SUBROUTINE FAILS (WHAT, CODE, WORD, NPASS, NFAIL)
      INTEGER WHAT, CODE, NPASS, NFAIL
      CHARACTER*(*) WORD
      EXTERNAL WEIGHT, MASS, PIN, PINJAC, DSNONE
      INTEGER IOPT(30), IPAR(3), ICNT(11), IDID
      DOUBLE PRECISION T, Q(3), V(3), A(3), L(2), PSI(1)
      DOUBLE PRECISION ROPT(12), RPAR(2)
      CHARACTER*160 TEXT
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(24) = 1
      IPAR(1) = WHAT
      CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, PINJAC, DSNONE,
     1             DSNONE, DSNONE, T, Q, V, A, L, PSI, 1.0D0,
     2             0.015625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. CODE .AND. INDEX(TEXT, WORD) .GT. 0 .AND.
     1            T .EQ. 0.25D0, WORD, NPASS, NFAIL)
      IF (IDID .NE. CODE) WRITE (*,*) IDID, T, TEXT
      END

C     One option out of its range: nothing is changed
      SUBROUTINE REFUSE (AT, VALUE, WORD, NPASS, NFAIL)
      INTEGER AT, VALUE, NPASS, NFAIL, M, NP
      CHARACTER*(*) WORD
      EXTERNAL WEIGHT, MASS, PIN, PINJAC, DSNONE
      INTEGER IOPT(30), IPAR(3), ICNT(11), IDID
      DOUBLE PRECISION T, Q(3), V(3), A(3), L(4), PSI(4)
      DOUBLE PRECISION ROPT(12), RPAR(2)
      CHARACTER*160 TEXT
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      M = 2
      NP = 0
      L(1) = 7.0D0
      IF (AT .GT. 0) IOPT(AT) = VALUE
      IF (AT .EQ. 0) M = VALUE
      IF (AT .EQ. -1) NP = VALUE
      IF (AT .EQ. -2) THEN
         IOPT(8) = 1
         ROPT(1) = 1.5D0
      END IF
      IF (AT .EQ. -3) THEN
         IOPT(8) = 2
         ROPT(4) = 1.0D0
      END IF
      CALL DSSOI2 (3, M, NP, WEIGHT, MASS, DSNONE, PIN, PINJAC, DSNONE,
     1             DSNONE, DSNONE, T, Q, V, A, L, PSI, 1.0D0,
     2             0.015625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, WORD) .GT. 0 .AND.
     1            T .EQ. 0.0D0 .AND. L(1) .EQ. 7.0D0, WORD, NPASS,
     2            NFAIL)
      IF (INDEX(TEXT, WORD) .EQ. 0) WRITE (*,*) IDID, TEXT
      END

      SUBROUTINE WEIGHT (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      F(1) = 0.0D0
      F(2) = -5.0D0*9.81D0
      F(3) = 0.0D0
      END

      SUBROUTINE MASS (N, T, Q, V, AM, LDM, RPAR, IPAR, IERR)
      INTEGER N, LDM, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), AM(LDM,N), RPAR(*)
      AM(1,1) = 5.0D0
      AM(1,2) = 5.0D0
      AM(1,3) = 20.0D0/3.0D0
      END

      SUBROUTINE PIN (N, M, T, Q, G, RPAR, IPAR, IERR)
      INTEGER N, M, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), G(M), RPAR(*)
      G(1) = Q(1) - 2.0D0*COS(Q(3))
      G(2) = Q(2) - 2.0D0*SIN(Q(3))
      IF (T .LE. 0.25D0) RETURN
      IF (IPAR(1) .EQ. 1) IERR = -1
      IF (IPAR(1) .EQ. 2) CALL NAN (G(2))
      END

      SUBROUTINE PINJAC (N, M, T, Q, GQ, GT, RPAR, IPAR, IERR)
      INTEGER N, M, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), GQ(M,N), GT(M), RPAR(*)
      GQ(1,1) = 1.0D0
      GQ(1,3) = 2.0D0*SIN(Q(3))
      GQ(2,2) = 1.0D0
      GQ(2,3) = -2.0D0*COS(Q(3))
      IF (T .LE. 0.25D0) RETURN
      IF (IPAR(1) .EQ. 3) IERR = 1
      IF (IPAR(1) .EQ. 4) CALL NAN (GQ(1,2))
      END

      SUBROUTINE DRIVE (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR, I
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      DO 10 I = 1, N
         F(I) = 0.0D0
   10 CONTINUE
      END

      SUBROUTINE TURN (N, M, T, Q, G, RPAR, IPAR, IERR)
      INTEGER N, M, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), G(M), RPAR(*)
      G(1) = Q(3) - T
      END

      SUBROUTINE TRNJAC (N, M, T, Q, GQ, GT, RPAR, IPAR, IERR)
      INTEGER N, M, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), GQ(M,N), GT(M), RPAR(*)
      GQ(1,3) = 1.0D0
      GT(1) = -1.0D0
      END

      SUBROUTINE EDGE (N, P, T, Q, V, C, RPAR, IPAR, IERR)
      INTEGER N, P, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), C(P), RPAR(*)
      C(1) = SIN(Q(3))*V(1) - COS(Q(3))*V(2)
      END

      SUBROUTINE EDGJAC (N, P, T, Q, V, CV, RPAR, IPAR, IERR)
      INTEGER N, P, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), CV(P,N), RPAR(*)
      CV(1,1) = SIN(Q(3))
      CV(1,2) = -COS(Q(3))
      END

      SUBROUTINE OUT (N, M, NP, T, Q, V, A, LAMBDA, PSI, RPAR, IPAR,
     1                ISTOP)
      INTEGER N, M, NP, IPAR(*), ISTOP
      DOUBLE PRECISION T, Q(N), V(N), A(N), LAMBDA(M), PSI(*), RPAR(*)
      IPAR(2) = IPAR(2) + 1
      RPAR(1) = LAMBDA(1)
      RPAR(2) = LAMBDA(2)
      IF (IPAR(1) .EQ. 9 .AND. T .GE. 0.495D0) ISTOP = 1
      END

C     A NaN without an operation that traps
      SUBROUTINE NAN (X)
      DOUBLE PRECISION X, Y
      CHARACTER*3 WORD
      DATA WORD /'NaN'/
      READ (WORD,'(F3.0)') Y
      X = Y
      END
