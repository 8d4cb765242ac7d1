C     SPDX-License-Identifier: BSD-3-Clause
      PROGRAM OSCIL
      EXTERNAL SPRING, DSNONE
      INTEGER IOPT(30), ICNT(10), IPAR(1), IDID
      DOUBLE PRECISION T, Q(1), V(1), A(1), ROPT(10), RPAR(1)
      CHARACTER*160 TEXT
      DATA IOPT /30*0/, ROPT /10*0.0D0/
      DATA T, Q, V, RPAR /0.0D0, 1.0D0, 0.0D0, 16.0D0/
C     Q'' = -16 Q to T = 3 in steps of 0.1, four levels: order 8
      CALL DSNEXT (1, SPRING, DSNONE, DSNONE, DSNONE, T, Q, V, A, 3.0D0,
     1             0.1D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      PRINT '(A, F12.9)', 'q(3) = ', Q(1)
      IF (IDID .LT. 0) PRINT '(A)', TEXT
      END
      SUBROUTINE SPRING (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      F(1) = -RPAR(1)*Q(1)
      END
