! SPDX-License-Identifier: BSD-3-Clause
!> DSNEWL solves the linear system M Q'' + C Q' + K Q = P(T) from T to TEND with steps of one
!> length, by Newmark's method.  For FORTRAN 77 programs; nothing is kept between calls.
!>
!>      SUBROUTINE DSNEWL (N, AM, AC, AK, LOAD, OUT, T, Q, V, A, TEND, H,
!>     1                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>      EXTERNAL         LOAD, OUT
!>      INTEGER          N, IOPT(30), IPAR(*), ICNT(10), IDID
!>      DOUBLE PRECISION AM(*), AC(*), AK(*), T, Q(N), V(N), A(N), TEND, H,
!>     1                 ROPT(10), RPAR(*)
!>      CHARACTER*(*)    TEXT
!>
!>   AM, AC, AK   the matrices M, C and K, not changed:
!>           diagonal   AM(N)            AM(J)          = M(J,J)
!>           band       AM(KL+KU+1,N)    AM(KU+1+I-J,J) = M(I,J)    as in LAPACK
!>           dense      AM(N,N)          AM(I,J)        = M(I,J)
!>           A symmetric matrix is stored whole.
!>   LOAD    subroutine, the load; not called where IOPT(23) = 0.  DSINTP interpolates in
!>           samples, such as those of a ground motion
!>
!>      SUBROUTINE LOAD (N, T, P, RPAR, IPAR, IERR)
!>           set P(N), which is zero on entry; IERR as in FORCE of DSNEWM
!>
!> The other arguments, OUT, and IDID are those of DSNEWM, and so are IOPT(1) to IOPT(10) and
!> ROPT.  The others are
!>
!> IOPT    0 is the default
!>   (11)  M: 0 identity (AM is not read), 1 diagonal, 2 band, 3 dense
!>   (12), (13)   KL and KU of M
!>   (14)  1: M is not symmetric
!>   (15), (16), (17), (18)   the same of C, with 0 for C = 0
!>   (19), (20), (21), (22)   the same of K, with 0 for K = 0
!>   (23)  1: LOAD gives P                                                         (P = 0)
recursive subroutine dsnewl(n, am, ac, ak, load, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
   use dynstep_f77_run, only: method_plain, run_linear
   use dynstep_f77_systems, only: f77_load, f77_out
   use dynstep_kinds, only: wp
   implicit none
   integer, intent(in) :: n
   real(wp), intent(in) :: am(*), ac(*), ak(*)
   procedure(f77_load) :: load
   procedure(f77_out) :: out
   real(wp), intent(inout) :: t, q(*), v(*), a(*)
   real(wp), intent(in) :: tend, h
   integer, intent(in) :: iopt(*)
   real(wp), intent(in) :: ropt(*)
   real(wp), intent(inout) :: rpar(*)
   integer, intent(inout) :: ipar(*)
   integer, intent(inout) :: icnt(*)
   integer, intent(out) :: idid
   character(len=*), intent(out) :: text
   call run_linear(method_plain, n, am, ac, ak, load, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
end subroutine dsnewl
