C     SPDX-License-Identifier: BSD-3-Clause
C     A rod of mass RPAR(1) and length 2 RPAR(2) swings on a pin, in the
C     coordinates (x, y, angle) of its centre: the force in the pin.
      PROGRAM PENDUL
      EXTERNAL WEIGHT, MASS, PIN, PINJAC, PRINT, DSNONE
      INTEGER IOPT(30), ICNT(11), IPAR(1), IDID
      DOUBLE PRECISION T, Q(3), V(3), A(3), LAMBDA(2), PSI(1), ROPT(10)
      DOUBLE PRECISION RPAR(2)
      CHARACTER*160 TEXT
      DATA IOPT /30*0/, ROPT /10*0.0D0/
      DATA T /0.0D0/, Q /2.0D0, 0.0D0, 0.0D0/, V /3*0.0D0/
      RPAR(1) = 5.0D0
      RPAR(2) = 2.0D0
C     the mass is diagonal and constant, PINJAC gives the Jacobian, and
C     PRINT is called at every 50th step
      IOPT(11) = 1
      IOPT(15) = 1
      IOPT(24) = 1
      IOPT(1) = 50
      WRITE (*,*) '     t    angle     force in the pin     |g|'
      CALL DSSOI2 (3, 2, 0, WEIGHT, MASS, DSNONE, PIN, PINJAC, DSNONE,
     1             DSNONE, PRINT, T, Q, V, A, LAMBDA, PSI, 2.0D0,
     2             0.005D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      IF (IDID .NE. 0) WRITE (*,*) TEXT
      IF (IDID .LT. 0) STOP 1
      END

      SUBROUTINE WEIGHT (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      F(1) = 0.0D0
      F(2) = -9.81D0*RPAR(1)
      F(3) = 0.0D0
      END

      SUBROUTINE MASS (N, T, Q, V, AM, LDM, RPAR, IPAR, IERR)
      INTEGER N, LDM, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), AM(LDM,N), RPAR(*)
      AM(1,1) = RPAR(1)
      AM(1,2) = RPAR(1)
      AM(1,3) = RPAR(1)*RPAR(2)**2/3.0D0
      END

      SUBROUTINE PIN (N, M, T, Q, G, RPAR, IPAR, IERR)
      INTEGER N, M, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), G(M), RPAR(*)
      G(1) = Q(1) - RPAR(2)*COS(Q(3))
      G(2) = Q(2) - RPAR(2)*SIN(Q(3))
      END

C     GQ(I,J) = dg(I)/dQ(J), zero on entry
      SUBROUTINE PINJAC (N, M, T, Q, GQ, GT, RPAR, IPAR, IERR)
      INTEGER N, M, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), GQ(M,N), GT(M), RPAR(*)
      GQ(1,1) = 1.0D0
      GQ(2,2) = 1.0D0
      GQ(1,3) = RPAR(2)*SIN(Q(3))
      GQ(2,3) = -RPAR(2)*COS(Q(3))
      END

C     LAMBDA is the force of the rod on the pin
      SUBROUTINE PRINT (N, M, NP, T, Q, V, A, LAMBDA, PSI, RPAR, IPAR,
     1                  ISTOP)
      INTEGER N, M, NP, IPAR(*), ISTOP, IERR
      DOUBLE PRECISION T, Q(N), V(N), A(N), LAMBDA(M), PSI(*), RPAR(*)
      DOUBLE PRECISION G(2)
      CALL PIN (N, M, T, Q, G, RPAR, IPAR, IERR)
      WRITE (*,1000) T, Q(3), SQRT(LAMBDA(1)**2 + LAMBDA(2)**2),
     1               ABS(G(1)) + ABS(G(2))
 1000 FORMAT (1X, F6.2, F10.5, F15.4, 1P, E17.1)
      END
