! SPDX-License-Identifier: BSD-3-Clause
!> DSGALF solves M(T,Q,V) Q'' = F(T,Q,V) from T to TEND with steps of one length, by the generalized-alpha
!> method (Chung & Hulbert 1993; Jay & Negrut 2008), which damps the highest frequencies and is of order 2.  For
!> FORTRAN 77 programs; nothing is kept between calls.
!>
!>      SUBROUTINE DSGALF (N, FORCE, MASS, TANG, OUT, T, Q, V, A, TEND, H,
!>     1                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>
!> Arguments, subroutines and codes are those of DSNEWM, whose prologue describes them, and so are IOPT and ROPT
!> but for
!>
!> IOPT    0 is the default
!>   (5), (6)   not read
!>   (7), (8), (9)   as in DSSOI2
!> ROPT
!>   (1), (4) to (7)   as in DSSOI2
recursive subroutine dsgalf(n, force, mass, tang, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
   use dynstep_f77_alpha, only: run_generalized_alpha
   use dynstep_f77_systems, only: f77_force, f77_mass, f77_out, f77_tangent
   use dynstep_kinds, only: wp
   implicit none
   integer, intent(in) :: n
   procedure(f77_force) :: force
   procedure(f77_mass) :: mass
   procedure(f77_tangent) :: tang
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
   call run_generalized_alpha(n, force, mass, tang, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
end subroutine dsgalf
