! SPDX-License-Identifier: BSD-3-Clause
!> DSNEXL solves the linear system M Q'' + C Q' + K Q = P(T) from T to TEND with steps of one
!> length, by Newmark's method extrapolated to order 2*P.  For FORTRAN 77 programs; nothing
!> is kept between calls.
!>
!>      SUBROUTINE DSNEXL (N, AM, AC, AK, LOAD, OUT, T, Q, V, A, TEND, H,
!>     1                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>
!> Arguments are those of DSNEWL; IOPT(5), IOPT(6), IOPT(7) and IOPT(31), ... those of DSNEXT.
recursive subroutine dsnexl(n, am, ac, ak, load, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
   use dynstep_f77_run, only: method_extrapolated, run_linear
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
   call run_linear(method_extrapolated, n, am, ac, ak, load, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
end subroutine dsnexl
