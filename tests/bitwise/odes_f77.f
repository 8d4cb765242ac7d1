C     SPDX-License-Identifier: BSD-3-Clause
C     The first-order problem of README.md by the FORTRAN 77 driver.
      PROGRAM ODES
      EXTERNAL F, OUT, DSNONE
      INTEGER IOPT(30), IPAR(1), ICNT(10), IDID, I, K
      DOUBLE PRECISION T, Y(2), YP(2), ROPT(14), RPAR(1), H
      CHARACTER*160 TEXT
      DO 30 K = 1, 4
         DO 10 I = 1, 30
            IOPT(I) = 0
   10    CONTINUE
         DO 20 I = 1, 10
            ROPT(I) = 0.0D0
   20    CONTINUE
         ROPT(11) = 0.1D0
         ROPT(12) = 0.11D0
         ROPT(13) = 0.5D0
         ROPT(14) = 1.99D0
         IPAR(1) = K
         IOPT(1) = 1
         IF (K .EQ. 2) IOPT(2) = 4
         H = 0.03125D0
         IF (K .EQ. 3) THEN
            IOPT(9) = 2
            ROPT(2) = 1.0D-6
            H = 0.125D0
         END IF
         IF (K .EQ. 4) THEN
            IOPT(7) = 5
            IOPT(8) = 1
            ROPT(1) = 0.44D0
         END IF
         T = 0.0D0
         Y(1) = 2.0D0
         Y(2) = 3.0D0
         CALL DSBINT (2, F, DSNONE, OUT, T, Y, YP, 2.0D0, H,
     1                IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
         IF (IDID .NE. 0) STOP 1
   30 CONTINUE
      END

      SUBROUTINE F (N, T, Y, YP, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Y(N), YP(N), RPAR(*)
      YP(1) = Y(1)*(1.0D0 - Y(2))
      YP(2) = Y(2)*(Y(1) - 1.0D0) + 0.125D0*T
      END

      SUBROUTINE OUT (N, T, Y, YP, RPAR, IPAR, ISTOP)
      INTEGER N, IPAR(*), ISTOP, L(4)
      DOUBLE PRECISION T, Y(N), YP(N), RPAR(*)
      CHARACTER*7 RUN(4)
      DATA RUN /'bi', 'times', 'control', 'bi45'/, L /2, 5, 7, 4/
      WRITE (*,1000) RUN(IPAR(1))(1:L(IPAR(1))), T, Y, YP
 1000 FORMAT ('e ', A, 99(1X, Z16.16))
      END
