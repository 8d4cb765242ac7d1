! SPDX-License-Identifier: BSD-3-Clause
!> DSTABL makes one extrapolated step and gives its table (Austin 1991, Table 1).  For FORTRAN
!> 77 programs; nothing is kept between calls.
!>
!>      SUBROUTINE DSTABL (N, FORCE, MASS, TANG, T, Q, V, H, IOPT, ROPT,
!>     1                   RPAR, IPAR, P, TABLE, NUMBER, IDID, TEXT)
!>      INTEGER          N, P, IOPT(30), IPAR(*), NUMBER(P), IDID
!>      DOUBLE PRECISION T, Q(N), V(N), H, ROPT(10), RPAR(*), TABLE(2*N,P,P)
!>
!>   T, Q, V   where the step begins, not changed
!>   H         length of the base step
!>   P         levels, 1 to 12; IOPT(6) is not read
!>   TABLE     out: TABLE(I,J,K) is coordinate I (velocity I - N where I > N) after the step,
!>             in row J and column K <= J, of order 2*K; 0 where K > J.  TABLE(I,P,P) is the
!>             result
!>   NUMBER    out: steps of the base in row J
!>
!> The other arguments are those of DSNEXT.
recursive subroutine dstabl(n, force, mass, tang, t, q, v, h, iopt, ropt, rpar, ipar, p, table, number, idid, text)
   use dynstep_f77_run, only: table_external
   use dynstep_f77_systems, only: f77_force, f77_mass, f77_tangent
   use dynstep_kinds, only: wp
   implicit none
   integer, intent(in) :: n
   procedure(f77_force) :: force
   procedure(f77_mass) :: mass
   procedure(f77_tangent) :: tang
   real(wp), intent(in) :: t, q(*), v(*), h
   integer, intent(in) :: iopt(*)
   real(wp), intent(in) :: ropt(*)
   real(wp), intent(inout) :: rpar(*)
   integer, intent(inout) :: ipar(*)
   integer, intent(in) :: p
   real(wp), intent(inout) :: table(*)
   integer, intent(inout) :: number(*)
   integer, intent(out) :: idid
   character(len=*), intent(out) :: text
   call table_external(n, force, mass, tang, t, q, v, h, iopt, ropt, rpar, ipar, p, table, number, idid, text)
end subroutine dstabl
