C     SPDX-License-Identifier: BSD-3-Clause
C     DSNEWM, DSNEXT, DSTABL and the small ones: a double pendulum with
C     EXTERNAL force, mass and tangents, and what is refused.
      PROGRAM DSFORC
      INTEGER N
      PARAMETER (N = 2)
      EXTERNAL FORCE, MASSD, MASSF, TANG, OUT, NESTED, DSNONE
      INTEGER IOPT(42), IPAR(4), ICNT(10), IDID, NPASS, NFAIL, I
      INTEGER NUMBER(3), NS
      DOUBLE PRECISION T, Q(N), V(N), A(N), QR(N), E, S(10), DT, X
      DOUBLE PRECISION ROPT(20), RPAR(4), TABLE(2*N,3,3)
      CHARACTER*160 TEXT
      CHARACTER*8 SHORT
      DATA NPASS, NFAIL /0, 0/

C     identity mass, tangents by differences
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      CALL DSNEWM (N, FORCE, DSNONE, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. TEXT .EQ. ' ' .AND. T .EQ. 1.0D0,
     1            'differences', NPASS, NFAIL)
      CALL CHECK (ICNT(1) .EQ. 16 .AND. ICNT(4) .GT. 16, 'counters',
     1            NPASS, NFAIL)
      QR(1) = Q(1)
      QR(2) = Q(2)
C     tangents by TANG, in dense storage
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(20) = 1
      CALL DSNEWM (N, FORCE, DSNONE, TANG, DSNONE, T, Q, V, A, 1.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(1) - QR(1)) .LT. 1.0D-13,
     1            'tangents', NPASS, NFAIL)
C     without damping: velocity-free, TANG leaves AC alone
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      RPAR(1) = 0.0D0
      IOPT(20) = 1
      IOPT(23) = 1
      IPAR(3) = 1
      CALL DSNEWM (N, FORCE, DSNONE, TANG, DSNONE, T, Q, V, A, 1.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0, 'velocity-free', NPASS, NFAIL)
C     central differences: beta = 0, explicit
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      RPAR(1) = 0.0D0
      IOPT(8) = 1
      ROPT(1) = 0.0D0
      ROPT(2) = 0.5D0
      IOPT(23) = 1
      CALL DSNEWM (N, FORCE, DSNONE, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ICNT(4) .EQ. 17 .AND.
     1            ICNT(8) .EQ. 0, 'explicit', NPASS, NFAIL)
C     midpoint rule
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(5) = 1
      CALL DSNEWM (N, FORCE, DSNONE, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(1) - QR(1)) .LT. 1.0D-2 .AND.
     1            Q(1) .NE. QR(1), 'midpoint', NPASS, NFAIL)

C     mass matrices: diagonal and constant, dense and moving; order 8
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(11) = 1
      IOPT(15) = 1
      CALL DSNEXT (N, FORCE, MASSD, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ICNT(5) .LE. 12, 'constant mass',
     1            NPASS, NFAIL)
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(11) = 3
      CALL DSNEXT (N, FORCE, MASSF, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.0625D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ICNT(2) .EQ. 160, 'dense mass',
     1            NPASS, NFAIL)
      QR(1) = Q(1)
      QR(2) = Q(2)
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(6) = 3
      IOPT(7) = 5
      IOPT(11) = 3
      IOPT(31) = 1
      IOPT(32) = 3
      IOPT(33) = 5
      CALL DSNEXT (N, FORCE, MASSF, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.03125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(1) - QR(1)) .LT. 1.0D-10,
     1            'custom sequence', NPASS, NFAIL)
C     and backward to where it came from
      IOPT(6) = 4
      IOPT(7) = 1
      CALL DSNEXT (N, FORCE, MASSF, DSNONE, DSNONE, T, Q, V, A, 0.0D0,
     1             -0.03125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. ABS(Q(1) - 1.0D0) .LT. 1.0D-9,
     1            'backward', NPASS, NFAIL)

C     the table of one step: its last entry is the step
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(11) = 3
      CALL DSTABL (N, FORCE, MASSF, DSNONE, T, Q, V, 0.125D0, IOPT,
     1             ROPT, RPAR, IPAR, 3, TABLE, NUMBER, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. NUMBER(3) .EQ. 3 .AND.
     1            Q(1) .EQ. 1.0D0, 'table', NPASS, NFAIL)
      CALL CHECK (TABLE(1,1,2) .EQ. 0.0D0, 'upper half', NPASS, NFAIL)
      IOPT(6) = 3
      CALL DSNEXT (N, FORCE, MASSF, DSNONE, DSNONE, T, Q, V, A, 0.125D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      E = ABS(TABLE(1,3,3) - Q(1)) + ABS(TABLE(4,3,3) - V(2))
      CALL CHECK (E .LT. 1.0D-14, 'table ends in the step', NPASS,
     1            NFAIL)
      CALL DSTABL (N, FORCE, MASSF, DSNONE, T, Q, V, 0.125D0, IOPT,
     1             ROPT, RPAR, IPAR, 0, TABLE, NUMBER, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'P = 0') .GT. 0,
     1            'no levels', NPASS, NFAIL)

C     a FORCE that calls DSNEWM itself
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      CALL DSNEWM (N, NESTED, DSNONE, DSNONE, DSNONE, T, Q, V, A,
     1             0.25D0, 0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT,
     2             IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. IPAR(4) .GT. 2, 'nested', NPASS,
     1            NFAIL)

C     refusals and values that are not finite, with time and place
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IPAR(1) = 1
      RPAR(2) = 0.45D0
      CALL DSNEWM (N, FORCE, DSNONE, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -2 .AND. T .EQ. 0.375D0 .AND.
     1            INDEX(TEXT, 't = 0.5') .GT. 0, 'refusal', NPASS,
     2            NFAIL)
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IPAR(1) = 2
      RPAR(2) = 0.45D0
      CALL DSNEXT (N, FORCE, DSNONE, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -10 .AND. T .EQ. 0.375D0 .AND.
     1            INDEX(TEXT, 'component 2') .GT. 0, 'not finite',
     2            NPASS, NFAIL)
      CALL DSNEWM (N, FORCE, DSNONE, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, SHORT)
      CALL CHECK (IDID .EQ. -10 .AND. SHORT .NE. ' ', 'short text',
     1            NPASS, NFAIL)

C     options out of range
      CALL CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      IOPT(11) = -1
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(11)') .GT. 0,
     1            'kind of M', NPASS, NFAIL)
      IOPT(11) = 0
      IOPT(5) = 2
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(5)') .GT. 0,
     1            'method', NPASS, NFAIL)
      IOPT(5) = 0
      IOPT(8) = 1
      ROPT(1) = 0.3D0
      ROPT(2) = 0.6D0
      CALL DSNEXT (N, FORCE, MASSD, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'gamma') .GT. 0,
     1            'gamma', NPASS, NFAIL)
      IOPT(8) = 0
      IOPT(7) = 9
      CALL DSNEXT (N, FORCE, MASSD, DSNONE, DSNONE, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(7)') .GT. 0,
     1            'sequence', NPASS, NFAIL)
      IOPT(7) = 0
      IOPT(2) = 1
      ROPT(11) = 7.0D0
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'ROPT(11)') .GT. 0,
     1            'time outside', NPASS, NFAIL)
      IOPT(2) = -1
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(2)') .GT. 0,
     1            'number of times', NPASS, NFAIL)
      IOPT(2) = 0
      IOPT(3) = -1
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(3)') .GT. 0,
     1            'Newton limit', NPASS, NFAIL)
      IOPT(3) = 0
      IOPT(7) = 5
      IOPT(6) = 2
      IOPT(31) = 3
      IOPT(32) = 3
      CALL DSNEXT (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(32)') .GT. 0,
     1            'numbers of a sequence', NPASS, NFAIL)
      IOPT(7) = 0
      IOPT(8) = 1
      ROPT(1) = -0.25D0
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'ROPT(1)') .GT. 0,
     1            'BETA', NPASS, NFAIL)
      IOPT(8) = 0
      CALL NAN (ROPT(3))
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'ROPT(3)') .GT. 0,
     1            'tolerance', NPASS, NFAIL)
      ROPT(3) = 0.0D0
      IOPT(2) = 2
      ROPT(11) = 0.5D0
      ROPT(12) = 0.25D0
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'ROPT(12)') .GT. 0,
     1            'order of times', NPASS, NFAIL)
      CALL NAN (ROPT(12))
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'ROPT(12)') .GT. 0,
     1            'time that is none', NPASS, NFAIL)
      IOPT(2) = 0
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             -0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'TEND = 1') .GT. 0,
     1            'sign of H', NPASS, NFAIL)
      CALL DSTABL (N, FORCE, MASSD, DSNONE, T, Q, V, ROPT(12), IOPT,
     1             ROPT, RPAR, IPAR, 2, TABLE, NUMBER, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'H = NaN') .GT. 0,
     1            'H of a table', NPASS, NFAIL)
      CALL DSNEWM (2147483647, FORCE, MASSD, DSNONE, OUT, T, Q, V, A,
     1             1.0D0, 0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID,
     2             TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'N = ') .GT. 0,
     1            'size', NPASS, NFAIL)
      IOPT(11) = 2
      IOPT(12) = 1
      CALL DSNEWM (N, FORCE, MASSD, DSNONE, OUT, T, Q, V, A, 1.0D0,
     1             0.125D0, IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      CALL CHECK (IDID .EQ. -1 .AND. INDEX(TEXT, 'IOPT(14)') .GT. 0,
     1            'symmetric band', NPASS, NFAIL)
      CALL CHECK (T .EQ. 0.0D0 .AND. Q(1) .EQ. 1.0D0, 'nothing changed',
     1            NPASS, NFAIL)

C     words, samples, records
      CALL DSMESG (-2, TEXT)
      CALL CHECK (INDEX(TEXT, 'user procedure') .GT. 0, 'words', NPASS,
     1            NFAIL)
      DO 10 I = 1, 10
         S(I) = 2.0D0*I
   10 CONTINUE
      CALL DSINTP (1.25D0, 1.0D0, 0.5D0, 10, S, X)
      CALL CHECK (X .EQ. 3.0D0, 'between samples', NPASS, NFAIL)
      CALL DSINTP (5.5D0, 1.0D0, 0.5D0, 10, S, X)
      CALL CHECK (X .EQ. 20.0D0, 'last sample', NPASS, NFAIL)
      CALL DSINTP (5.6D0, 1.0D0, 0.5D0, 10, S, X)
      CALL CHECK (X .EQ. 0.0D0, 'after the samples', NPASS, NFAIL)
      CALL DSINTP (0.9D0, 1.0D0, 0.5D0, 10, S, X)
      CALL CHECK (X .EQ. 0.0D0, 'before the samples', NPASS, NFAIL)
      OPEN (UNIT=17, FILE='dsforc.AT2', STATUS='UNKNOWN')
      WRITE (17,'(A)') 'A', 'B', 'C', 'NPTS=    3, DT= .02000 SEC',
     1                 ' .5 -.25', ' 1.0'
      CLOSE (17)
      CALL DSRAT2 ('dsforc.AT2', 2, DT, NS, S, IDID, TEXT)
      CALL CHECK (IDID .EQ. 0 .AND. NS .EQ. 3 .AND. DT .EQ. 0.02D0 .AND.
     1            S(2) .EQ. -0.25D0 .AND. S(3) .EQ. 6.0D0, 'record',
     2            NPASS, NFAIL)
      OPEN (UNIT=17, FILE='dsforc.AT2', STATUS='OLD')
      CLOSE (17, STATUS='DELETE')
      CALL DSRAT2 ('dsforc.AT2', 2, DT, NS, S, IDID, TEXT)
      CALL CHECK (IDID .EQ. -11 .AND. INDEX(TEXT, 'dsforc') .GT. 0,
     1            'no record', NPASS, NFAIL)

      WRITE (*,1000) NPASS, NFAIL
 1000 FORMAT (I0, ' passed, ', I0, ' failed')
      IF (NFAIL .GT. 0) STOP 1
      END

      SUBROUTINE CLEAR (IOPT, ROPT, RPAR, IPAR, T, Q, V)
      INTEGER IOPT(42), IPAR(4), I
      DOUBLE PRECISION ROPT(20), RPAR(4), T, Q(2), V(2)
      DO 10 I = 1, 42
         IOPT(I) = 0
   10 CONTINUE
      DO 20 I = 1, 20
         ROPT(I) = 0.0D0
   20 CONTINUE
      DO 30 I = 1, 4
         IPAR(I) = 0
         RPAR(I) = 0.0D0
   30 CONTINUE
      RPAR(1) = 0.1D0
      T = 0.0D0
      Q(1) = 1.0D0
      Q(2) = -0.5D0
      V(1) = 0.0D0
      V(2) = 0.25D0
      END

C     Two pendulums and a spring; damping RPAR(1).  After T = RPAR(2),
C     IPAR(1) = 1 asks for a refusal, 2 for a value that is not finite
      SUBROUTINE FORCE (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      F(1) = -SIN(Q(1)) - 0.5D0*(Q(1) - Q(2)) - RPAR(1)*V(1)
      F(2) = -SIN(Q(2)) + 0.5D0*(Q(1) - Q(2)) - RPAR(1)*V(2)
      IF (IPAR(1) .EQ. 1 .AND. T .GT. RPAR(2)) IERR = 4
      IF (IPAR(1) .EQ. 2 .AND. T .GT. RPAR(2)) THEN
         CALL NAN (F(2))
      END IF
      END

C     A NaN without an operation that traps
      SUBROUTINE NAN (X)
      DOUBLE PRECISION X, Y
      CHARACTER*3 WORD
      DATA WORD /'NaN'/
      READ (WORD,'(F3.0)') Y
      X = Y
      END

      SUBROUTINE TANG (N, T, Q, V, A, AK, AC, LD, RPAR, IPAR, IERR)
      INTEGER N, LD, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), A(N), AK(LD,*), AC(LD,*), RPAR(*)
      AK(1,1) = COS(Q(1)) + 0.5D0
      AK(2,1) = -0.5D0
      AK(1,2) = -0.5D0
      AK(2,2) = COS(Q(2)) + 0.5D0
      IF (IPAR(3) .EQ. 1) RETURN
      AC(1,1) = RPAR(1)
      AC(2,2) = RPAR(1)
      END

      SUBROUTINE MASSD (N, T, Q, V, AM, LDM, RPAR, IPAR, IERR)
      INTEGER N, LDM, IPAR(*), IERR, J
      DOUBLE PRECISION T, Q(N), V(N), AM(LDM,N), RPAR(*)
      IF (LDM .NE. 1) IERR = -1
      DO 10 J = 1, N
         AM(1,J) = 1.0D0 + J
   10 CONTINUE
      END

      SUBROUTINE MASSF (N, T, Q, V, AM, LDM, RPAR, IPAR, IERR)
      INTEGER N, LDM, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), AM(LDM,N), RPAR(*)
      AM(1,1) = 2.0D0
      AM(2,1) = COS(Q(1) - Q(2))
      AM(1,2) = AM(2,1)
      AM(2,2) = 1.5D0
      END

      SUBROUTINE OUT (N, T, Q, V, A, RPAR, IPAR, ISTOP)
      INTEGER N, IPAR(*), ISTOP
      DOUBLE PRECISION T, Q(N), V(N), A(N), RPAR(*)
      IPAR(2) = IPAR(2) + 1
      END

C     A force that is found by a run of its own
      SUBROUTINE NESTED (N, T, Q, V, F, RPAR, IPAR, IERR)
      EXTERNAL FORCE, DSNONE
      INTEGER N, IPAR(*), IERR, IOPT(30), ICNT(10), JPAR(4), IDID, I
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*), S, X(2), Y(2), Z(2)
      DOUBLE PRECISION ROPT(20)
      CHARACTER*80 TEXT
      DO 10 I = 1, 30
         IOPT(I) = 0
   10 CONTINUE
      DO 20 I = 1, 20
         ROPT(I) = 0.0D0
   20 CONTINUE
      JPAR(1) = 0
      S = T
      X(1) = Q(1)
      X(2) = Q(2)
      Y(1) = V(1)
      Y(2) = V(2)
      CALL DSNEWM (2, FORCE, DSNONE, DSNONE, DSNONE, S, X, Y, Z,
     1             T + 0.01D0, 0.01D0, IOPT, ROPT, RPAR, JPAR, ICNT,
     2             IDID, TEXT)
      F(1) = X(1) - 2.0D0*Q(1)
      F(2) = X(2) - 2.0D0*Q(2)
      IERR = IDID
      IPAR(4) = IPAR(4) + 1
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
