C     SPDX-License-Identifier: BSD-3-Clause
C     A frame of five storeys on shaken ground: matrices in LAPACK band
C     storage, a record in a file, results every second.
C          quake RECORD.AT2
      PROGRAM QUAKE
      INTEGER N, MAXNS
      PARAMETER (N = 5, MAXNS = 100000)
      EXTERNAL SHAKE, SHOW
      INTEGER IOPT(30), IPAR(1), ICNT(10), IDID, I, NS
      DOUBLE PRECISION AM(N), AC(3,N), AK(3,N), T, Q(N), V(N), A(N)
      DOUBLE PRECISION ROPT(10), RPAR(MAXNS+2), H
      CHARACTER*160 TEXT, FILE
      DATA IOPT /30*0/, ROPT /10*0.0D0/
C     RPAR: sampling interval, peak of the roof, samples [g]
      CALL GETARG (1, FILE)
      CALL DSRAT2 (FILE, MAXNS, H, NS, RPAR(3), IDID, TEXT)
      IF (IDID .LT. 0) GO TO 90
      RPAR(1) = H
      RPAR(2) = 0.0D0
      IPAR(1) = MIN(NS, MAXNS)
C     50 t and 60 kN/mm a storey, in kN, m, s; damping of stiffness
      DO 10 I = 1, N
         AM(I) = 50.0D0
         AK(1,I) = -6.0D4
         AK(2,I) = 12.0D4
         AK(3,I) = -6.0D4
         Q(I) = 0.0D0
         V(I) = 0.0D0
   10 CONTINUE
      AK(2,N) = 6.0D4
      DO 20 I = 1, N
         AC(1,I) = 0.004D0*AK(1,I)
         AC(2,I) = 0.004D0*AK(2,I)
         AC(3,I) = 0.004D0*AK(3,I)
   20 CONTINUE
C     results each NINT(1/H)-th step; M diagonal; C and K banded; a load
      IOPT(1) = NINT(1.0D0/H)
      IOPT(11) = 1
      IOPT(15) = 2
      IOPT(16) = 1
      IOPT(17) = 1
      IOPT(19) = 2
      IOPT(20) = 1
      IOPT(21) = 1
      IOPT(23) = 1
      T = 0.0D0
C     base steps that end on samples keep their order
      CALL DSNEXL (N, AM, AC, AK, SHAKE, SHOW, T, Q, V, A,
     1             (IPAR(1) - 1)*H, H, IOPT, ROPT, RPAR, IPAR, ICNT,
     2             IDID, TEXT)
      IF (IDID .LT. 0) GO TO 90
      PRINT '(A, F8.2, A)', 'largest of these ', 1.0D3*RPAR(2), ' mm'
      PRINT '(I6, A, I8, A)', ICNT(1), ' base steps,', ICNT(8),
     1      ' solutions'
      STOP
   90 PRINT '(A)', TEXT
      STOP 1
      END
C     P = -M e a(t)
      SUBROUTINE SHAKE (N, T, P, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR, I
      DOUBLE PRECISION T, P(N), RPAR(*), G
      CALL DSINTP (T, 0.0D0, RPAR(1), IPAR(1), RPAR(3), G)
      DO 10 I = 1, N
         P(I) = -50.0D0*9.80665D0*G
   10 CONTINUE
      END
      SUBROUTINE SHOW (N, T, Q, V, A, RPAR, IPAR, ISTOP)
      INTEGER N, IPAR(*), ISTOP
      DOUBLE PRECISION T, Q(N), V(N), A(N), RPAR(*)
      RPAR(2) = MAX(RPAR(2), ABS(Q(N)))
      PRINT '(A, F7.3, A, F8.2, A)', 't =', T, ' s   roof', 1.0D3*Q(N),
     1      ' mm'
      END
