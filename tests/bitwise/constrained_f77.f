C     SPDX-License-Identifier: BSD-3-Clause
C     Problem c of README.md by DSSOI2.
      PROGRAM CONSTR
      EXTERNAL FORCE, MASS, TANG, PIN, PINJAC, OUT, DSNONE
      INTEGER IOPT(30), IPAR(1), ICNT(11), IDID, K, I
      DOUBLE PRECISION T, Q(3), V(3), A(3), LAMBDA(2), PSI(1)
      DOUBLE PRECISION ROPT(14), RPAR(1)
      CHARACTER*160 TEXT
      RPAR(1) = 0.0D0
      DO 40 K = 1, 2
         DO 10 I = 1, 30
            IOPT(I) = 0
   10    CONTINUE
         DO 20 I = 1, 10
            ROPT(I) = 0.0D0
   20    CONTINUE
         IOPT(8) = 1
         ROPT(1) = 0.8D0
         ROPT(11) = 0.1D0
         ROPT(12) = 0.11D0
         ROPT(13) = 0.5D0
         ROPT(14) = 0.99D0
         IPAR(1) = K
         IOPT(1) = 1
         IF (K .EQ. 2) IOPT(2) = 4
         IOPT(11) = 1
         IOPT(15) = 1
         IOPT(16) = 1
         IOPT(19) = 1
         IOPT(20) = 1
         IOPT(21) = 1
         IOPT(24) = 1
         T = 0.0D0
         Q(1) = 0.0D0
         Q(2) = -2.0D0
         Q(3) = 4.71238898038469D0
         V(1) = 20.0D0
         V(2) = 0.0D0
         V(3) = 10.0D0
         CALL DSSOI2 (3, 2, 0, FORCE, MASS, TANG, PIN, PINJAC, DSNONE,
     1                DSNONE, OUT, T, Q, V, A, LAMBDA, PSI, 1.0D0,
     2                0.015625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     3                TEXT)
         IF (IDID .NE. 0) STOP 1
   40 CONTINUE
      END

      SUBROUTINE FORCE (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      F(1) = 0.0D0
      F(2) = -49.05D0
      F(3) = -(100.0D0*V(3) + 3000.0D0*(Q(3) - 4.71238898038469D0))
      END

      SUBROUTINE MASS (N, T, Q, V, AM, LDM, RPAR, IPAR, IERR)
      INTEGER N, LDM, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), AM(LDM,N), RPAR(*)
      AM(1,1) = 5.0D0
      AM(1,2) = 5.0D0
      AM(1,3) = 6.666666666666667D0
      END

      SUBROUTINE TANG (N, T, Q, V, A, AK, AC, LD, RPAR, IPAR, IERR)
      INTEGER N, LD, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), A(N), AK(LD,N), AC(LD,N), RPAR(*)
      AK(1,3) = 3000.0D0
      AC(1,3) = 100.0D0
      END

      SUBROUTINE PIN (N, M, T, Q, G, RPAR, IPAR, IERR)
      INTEGER N, M, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), G(M), RPAR(*)
      G(1) = Q(1) - 2.0D0*COS(Q(3))
      G(2) = Q(2) - 2.0D0*SIN(Q(3))
      END

      SUBROUTINE PINJAC (N, M, T, Q, GQ, GT, RPAR, IPAR, IERR)
      INTEGER N, M, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), GQ(M,N), GT(M), RPAR(*)
      GQ(1,1) = 1.0D0
      GQ(1,3) = 2.0D0*SIN(Q(3))
      GQ(2,2) = 1.0D0
      GQ(2,3) = -(2.0D0*COS(Q(3)))
      END

      SUBROUTINE OUT (N, M, NP, T, Q, V, A, LAMBDA, PSI, RPAR, IPAR,
     1                ISTOP)
      INTEGER N, M, NP, IPAR(*), ISTOP, I
      DOUBLE PRECISION T, Q(N), V(N), A(N), LAMBDA(M), PSI(*), RPAR(*)
      CHARACTER*5 RUN(2)
      INTEGER L(2)
      DATA RUN /'soi2', 'times'/, L /4, 5/
      WRITE (*,1000) RUN(IPAR(1))(1:L(IPAR(1))), T, (Q(I), I = 1, N),
     1               (V(I), I = 1, N), (A(I), I = 1, N),
     2               (LAMBDA(I), I = 1, M)
 1000 FORMAT ('c ', A, 99(1X, Z16.16))
      END
