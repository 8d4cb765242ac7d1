C     SPDX-License-Identifier: BSD-3-Clause
C     The problems of README.md by the FORTRAN 77 drivers.
      PROGRAM BITS
      EXTERNAL LOAD, FORCE, MASS, OUT, DSNONE
      INTEGER IOPT(30), IPAR(2), ICNT(10), IDID, K
      DOUBLE PRECISION AM(3), AC(3,3), AK(3,3), T, Q(3), V(3), A(3)
      DOUBLE PRECISION ROPT(14), RPAR(1)
      CHARACTER*160 TEXT
      INTEGER I, J
      DATA AM /2.0D0, 1.0D0, 1.0D0/
      DATA AK /0.0D0, 3.0D0, -1.0D0, -1.0D0, 2.0D0, -1.0D0,
     1         -1.0D0, 2.0D0, 0.0D0/
      DO 20 J = 1, 3
         DO 10 I = 1, 3
            AC(I,J) = 0.0625D0*AK(I,J)
   10    CONTINUE
   20 CONTINUE
      RPAR(1) = 0.0D0

C     IPAR(1): problem 1 (a) or 2 (b); IPAR(2): run 1, 2 or 3
      DO 30 K = 1, 3
         CALL PREP (K, IOPT, ROPT, IPAR)
         IPAR(1) = 1
         IOPT(11) = 1
         IOPT(15) = 2
         IOPT(16) = 1
         IOPT(17) = 1
         IOPT(19) = 2
         IOPT(20) = 1
         IOPT(21) = 1
         IOPT(23) = 1
         T = 0.0D0
         Q(1) = 1.0D0
         Q(2) = 0.0D0
         Q(3) = -0.5D0
         V(1) = 0.0D0
         V(2) = 0.25D0
         V(3) = 0.0D0
         IF (K .EQ. 2) THEN
            CALL DSNEXL (3, AM, AC, AK, LOAD, OUT, T, Q, V, A, 2.0D0,
     1                   0.03125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     2                   TEXT)
         ELSE
            CALL DSNEWL (3, AM, AC, AK, LOAD, OUT, T, Q, V, A, 2.0D0,
     1                   0.03125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     2                   TEXT)
         END IF
         IF (IDID .NE. 0) STOP 1
   30 CONTINUE

      DO 40 K = 1, 3
         CALL PREP (K, IOPT, ROPT, IPAR)
         IPAR(1) = 2
         IOPT(11) = 3
         T = 0.0D0
         Q(1) = 1.0D0
         Q(2) = -0.5D0
         V(1) = 0.0D0
         V(2) = 0.25D0
         IF (K .EQ. 2) THEN
            CALL DSNEXT (2, FORCE, MASS, DSNONE, OUT, T, Q, V, A, 2.0D0,
     1                   0.03125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     2                   TEXT)
         ELSE
            CALL DSNEWM (2, FORCE, MASS, DSNONE, OUT, T, Q, V, A, 2.0D0,
     1                   0.03125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     2                   TEXT)
         END IF
         IF (IDID .NE. 0) STOP 1
   40 CONTINUE
      END

      SUBROUTINE PREP (K, IOPT, ROPT, IPAR)
      INTEGER K, IOPT(30), IPAR(2), I
      DOUBLE PRECISION ROPT(14)
      DO 10 I = 1, 30
         IOPT(I) = 0
   10 CONTINUE
      DO 20 I = 1, 10
         ROPT(I) = 0.0D0
   20 CONTINUE
      ROPT(11) = 0.1D0
      ROPT(12) = 0.11D0
      ROPT(13) = 0.5D0
      ROPT(14) = 1.99D0
      IPAR(2) = K
      IOPT(1) = 1
      IF (K .EQ. 3) IOPT(2) = 4
      END

      SUBROUTINE LOAD (N, T, P, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR, I
      DOUBLE PRECISION T, P(N), RPAR(*)
      DO 10 I = 1, N
         P(I) = I*(T - (0.25D0*T)*T)
   10 CONTINUE
      END

      SUBROUTINE FORCE (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*), D
      D = Q(1) - Q(2)
      F(1) = ((0.0D0 - 4.0D0*(Q(1) - ((Q(1)*Q(1))*Q(1))/6.0D0))
     1       - ((0.25D0*D)*V(2))*V(2)) - 0.125D0*V(1)
      F(2) = ((0.0D0 - 2.0D0*(Q(2) - ((Q(2)*Q(2))*Q(2))/6.0D0))
     1       + ((0.25D0*D)*V(1))*V(1)) - 0.125D0*V(2)
      END

      SUBROUTINE MASS (N, T, Q, V, AM, LDM, RPAR, IPAR, IERR)
      INTEGER N, LDM, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), AM(LDM,N), RPAR(*), D
      D = Q(1) - Q(2)
      AM(1,1) = 2.0D0
      AM(2,1) = 1.0D0 - (0.5D0*D)*D
      AM(1,2) = AM(2,1)
      AM(2,2) = 1.5D0
      END

      SUBROUTINE OUT (N, T, Q, V, A, RPAR, IPAR, ISTOP)
      INTEGER N, IPAR(*), ISTOP, I
      DOUBLE PRECISION T, Q(N), V(N), A(N), RPAR(*)
      CHARACTER*1 PROB(2)
      CHARACTER*13 RUN(3)
      INTEGER L(3)
      DATA PROB /'a', 'b'/
      DATA RUN /'newmark', 'extrapolation', 'times'/, L /7, 13, 5/
      WRITE (*,1000) PROB(IPAR(1)), RUN(IPAR(2))(1:L(IPAR(2))), T,
     1               (Q(I), I = 1, N), (V(I), I = 1, N),
     2               (A(I), I = 1, N)
 1000 FORMAT (A, 1X, A, 99(1X, Z16.16))
      END
