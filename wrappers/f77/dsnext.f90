! SPDX-License-Identifier: BSD-3-Clause
!> DSNEXT solves M(T,Q,V) Q'' = F(T,Q,V) from T to TEND with steps of one length, by Newmark's
!> method extrapolated to order 2*P (Austin 1991).  For FORTRAN 77 programs; nothing is kept
!> between calls.
!>
!>      SUBROUTINE DSNEXT (N, FORCE, MASS, TANG, OUT, T, Q, V, A, TEND, H,
!>     1                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>
!> Arguments, subroutines and codes are those of DSNEWM, whose prologue describes them; a step
!> is a base step here, of P passes of the method with N(1) < N(2) < ... < N(P) steps.  More
!> options:
!>
!> IOPT    0 is the default
!>   (5)   method that is extrapolated, 0: Newmark's with GAMMA = 1/2, 1: midpoint rule
!>   (6)   P, 1 to 12                                                               (4)
!>   (7)   sequence N: 1 Romberg       1, 2, 4, 8, ...
!>                     2 Bulirsch      1, 2, 4, 6, 8, 12, 16, ...
!>                     3 harmonic      1, 2, 3, 4, ...                        (the default)
!>                     4 double        2, 4, 6, 8, ...
!>                     5 the user's    IOPT(31), ..., IOPT(30+P), increasing
!>
!> A tolerance of Newton's iteration spoils an extrapolation: leave ROPT(3) = 0.
recursive subroutine dsnext(n, force, mass, tang, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
   use dynstep_f77_run, only: method_extrapolated, run_external
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
   call run_external(method_extrapolated, n, force, mass, tang, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
end subroutine dsnext
