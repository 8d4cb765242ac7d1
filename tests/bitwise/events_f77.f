C     SPDX-License-Identifier: BSD-3-Clause
C     The problem with events of README.md by the FORTRAN 77 driver.
C     IPAR(1) = 1: OUT prints the points, 2: ACTION prints the events
      PROGRAM EVENTS
      EXTERNAL FORCE, OUT, EVENT, ACTION, DSNONE
      INTEGER IOPT(30), IPAR(1), ICNT(10), IDIR(2), KEV, IDID, I, J, K
      DOUBLE PRECISION T, Q(2), V(2), A(2), ROPT(10), RPAR(1), ATOL(4)
      CHARACTER*160 TEXT
      DATA IDIR /-1, 0/, ATOL /1.0D-9, 1.0D-9, 1.0D-7, 1.0D-8/
      DO 30 K = 0, 1
         DO 20 J = 1, 2
            DO 10 I = 1, 30
               IOPT(I) = 0
   10       CONTINUE
            DO 15 I = 1, 10
               ROPT(I) = 0.0D0
   15       CONTINUE
            IOPT(10) = K
            IOPT(24) = 1
            IOPT(25) = 1
            IPAR(1) = J
            IF (J .EQ. 1) IOPT(1) = 1
            T = 0.0D0
            Q(1) = 1.0D0
            Q(2) = 0.0D0
            V(1) = 0.0D0
            V(2) = 0.5D0
            CALL DSADAP (2, FORCE, DSNONE, DSNONE, OUT, T, Q, V, A,
     1                   6.0D0, 1.0D-8, ATOL, 0.0D0, 2, EVENT, ACTION,
     2                   IDIR, KEV, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     3                   TEXT)
            IF (IDID .NE. 0) STOP 1
   20    CONTINUE
   30 CONTINUE
      END

      SUBROUTINE FORCE (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      F(1) = ((0.0D0 - Q(1)*(1.0D0 + Q(1)*Q(1))) + 0.5D0*(Q(2) - Q(1)))
     1       - 0.125D0*V(1)
      F(2) = (0.0D0 - 2.0D0*Q(2)) - 0.5D0*(Q(2) - Q(1))
      END

      SUBROUTINE EVENT (N, NEV, T, Q, V, S, RPAR, IPAR, IERR)
      INTEGER N, NEV, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), S(NEV), RPAR(*)
      S(1) = Q(1) + 0.25D0
      S(2) = V(2)
      END

      SUBROUTINE ACTION (N, KEV, T, Q, V, JOB, RPAR, IPAR, IERR)
      INTEGER N, KEV, JOB, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), RPAR(*)
      IF (IPAR(1) .EQ. 2) WRITE (*,1000) KEV, T, Q, V
      IF (KEV .NE. 1) RETURN
      V(1) = -(0.5D0*V(1))
      JOB = 1
 1000 FORMAT ('f event', I1, 99(1X, Z16.16))
      END

      SUBROUTINE OUT (N, T, Q, V, A, RPAR, IPAR, ISTOP)
      INTEGER N, IPAR(*), ISTOP
      DOUBLE PRECISION T, Q(N), V(N), A(N), RPAR(*)
      WRITE (*,1000) T, Q, V, A
 1000 FORMAT ('f point', 99(1X, Z16.16))
      END
