C     SPDX-License-Identifier: BSD-3-Clause
C     A ball that bounces until it rests: each bounce keeps RPAR(1) of
C     the speed, and one that is slower than RPAR(2) is the last one.
      PROGRAM BOUNCE
      EXTERNAL FALL, FLOOR, REBND, DSNONE
      INTEGER IOPT(30), ICNT(10), IPAR(1), IDIR(1), KEV, IDID
      DOUBLE PRECISION T, Q(1), V(1), A(1), ATOL(1), ROPT(10), RPAR(2)
      DOUBLE PRECISION REST
      CHARACTER*160 TEXT
      DATA IOPT /30*0/, ROPT /10*0.0D0/, IDIR /-1/, ATOL /1.0D-8/
      DATA T, Q, V /0.0D0, 1.0D0, 0.0D0/, RPAR /0.75D0, 1.0D-3/
      IPAR(1) = 0
C     forces without velocities; REBND is called at events
      IOPT(23) = 1
      IOPT(24) = 1
      CALL DSADAP (1, FALL, DSNONE, DSNONE, DSNONE, T, Q, V, A, 5.0D0,
     1             1.0D-6, ATOL, 0.0D0, 1, FLOOR, REBND, IDIR, KEV,
     2             IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
      IF (IDID .LT. 0) WRITE (*,*) TEXT
      WRITE (*,'(I3,A,F9.6)') IPAR(1), ' bounces to t =', T
C     in closed form: the flights before the last bounce
      REST = SQRT(2.0D0/9.81D0)*(1.0D0 + 2.0D0*RPAR(1)
     1       *(1.0D0 - RPAR(1)**(IPAR(1) - 1))/(1.0D0 - RPAR(1)))
      WRITE (*,'(A,1PE9.1)') 'error', T - REST
      IF (IDID .NE. 3 .OR. IPAR(1) .NE. 30) STOP 1
      IF (ABS(T - REST) .GT. 1.0D-13 .OR. V(1) .NE. 0.0D0) STOP 1
      END

      SUBROUTINE FALL (N, T, Q, V, F, RPAR, IPAR, IERR)
      INTEGER N, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), F(N), RPAR(*)
      F(1) = -9.81D0
      END

      SUBROUTINE FLOOR (N, NEV, T, Q, V, S, RPAR, IPAR, IERR)
      INTEGER N, NEV, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), S(NEV), RPAR(*)
      S(1) = Q(1)
      END

      SUBROUTINE REBND (N, KEV, T, Q, V, JOB, RPAR, IPAR, IERR)
      INTEGER N, KEV, JOB, IPAR(*), IERR
      DOUBLE PRECISION T, Q(N), V(N), RPAR(*)
      IPAR(1) = IPAR(1) + 1
      V(1) = -RPAR(1)*V(1)
      JOB = 1
      IF (V(1) .GE. RPAR(2)) RETURN
C     it lies on the floor: end the run
      Q(1) = 0.0D0
      V(1) = 0.0D0
      JOB = 3
      END
