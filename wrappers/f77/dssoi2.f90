! SPDX-License-Identifier: BSD-3-Clause
!> DSSOI2 solves mechanical systems with constraints,
!>
!>      M(T,Q,V) Q'' = F(T,Q,V) - G' LAMBDA - K' PSI,   g(T,Q) = 0,   k(T,Q,V) = 0,
!>
!> G = dg/dQ and K = dk/dV, from T to TEND with steps of one length, by generalized-alpha-SOI2 (Jay & Negrut 2008),
!> of order 2 in Q, V, A, LAMBDA and PSI.  g = 0, its derivative, and k = 0 hold up to rounding.  For FORTRAN 77
!> programs; nothing is kept between calls.
!>
!>      SUBROUTINE DSSOI2 (N, M, P, FORCE, MASS, TANG, GCON, GJAC, KCON,
!>     1                   KJAC, OUT, T, Q, V, A, LAMBDA, PSI, TEND, H,
!>     2                   IOPT, ROPT, RPAR, IPAR, ICNT, IDID, TEXT)
!>      EXTERNAL         FORCE, MASS, TANG, GCON, GJAC, KCON, KJAC, OUT
!>      INTEGER          N, M, P, IOPT(30), IPAR(*), ICNT(11), IDID
!>      DOUBLE PRECISION T, Q(N), V(N), A(N), LAMBDA(M), PSI(P), TEND, H,
!>     1                 ROPT(10), RPAR(*)
!>      CHARACTER*(*)    TEXT
!>
!> Arguments, subroutines, options and codes are those of DSNEWM, whose prologue describes them.  More, or other, are
!>
!>   M       number of constraints g, 0 to N
!>   P       number of constraints k, 0 to N
!>   GCON    subroutine, g; not called where M = 0
!>   GJAC    subroutine, G and dg/dT; not called where IOPT(24) = 0
!>   KCON    subroutine, k; not called where P = 0
!>   KJAC    subroutine, K; not called where IOPT(25) = 0
!>   Q, V    in: need not fulfil the constraints, see IOPT(6)
!>   LAMBDA, PSI   out: multipliers at the last T
!>   ICNT    (11): evaluations of the constraints, together with their Jacobians
!>
!> DSNONE stands for what is not called.
!>
!>      SUBROUTINE GCON (N, M, T, Q, G, RPAR, IPAR, IERR)
!>           set G(M)
!>      SUBROUTINE GJAC (N, M, T, Q, GQ, GT, RPAR, IPAR, IERR)
!>           set GQ(M,N), GQ(I,J) = dg(I)/dQ(J), and GT(M) = dg/dT, which are zero on entry
!>      SUBROUTINE KCON (N, P, T, Q, V, C, RPAR, IPAR, IERR)
!>           set C(P) = k
!>      SUBROUTINE KJAC (N, P, T, Q, V, CV, RPAR, IPAR, IERR)
!>           set CV(P,N), CV(I,J) = dk(I)/dV(J), which is zero on entry
!>      SUBROUTINE OUT (N, M, P, T, Q, V, A, LAMBDA, PSI, RPAR, IPAR, ISTOP)
!>           as in DSNEWM
!>
!> IOPT    0 is the default
!>   (5)   1 SOI2                                                            (the default)
!>         2 reduced: one PSI for both of its stages (section 6 of the paper)
!>         3 index 3: without the derivative of g, a baseline to compare with
!>   (6)   Q and V that are off the constraints
!>         1 are moved onto them, as little as the mass allows               (the default)
!>         2 are refused, IDID = -7
!>         3 are taken as they are
!>   (7)   mass at the begin of a step: 1 as the step before left it         (the default)
!>                                      2 evaluated anew
!>   (8)   coefficients: 0 those of RHO = 0.8, 1 of RHO = ROPT(1), 2 ROPT(4) to ROPT(7)
!>   (9)   1: the first step is made once, and not repeated for order 2 of A, LAMBDA and PSI
!>   (24)  1: GJAC gives G and dg/dT                                        (differences do)
!>   (25)  1: KJAC gives K                                                  (differences do)
!>
!> ROPT    0.0D0 is the default
!>   (1)          RHO, the spectral radius at infinite frequency, 0 to 1, read where IOPT(8) = 1
!>   (4) to (7)   ALPHAM, ALPHAF, BETA > 0, GAMMA > 0, read where IOPT(8) = 2; HHT-alpha is
!>                0, -ALPHA, (1 - ALPHA)**2/4, 1/2 - ALPHA with ALPHA from -1/3 to 0
!>
!> IDID    also
!>    -7  the start is off the constraints, or they contradict each other
recursive subroutine dssoi2(n, m, p, force, mass, tang, gcon, gjac, kcon, kjac, out, t, q, v, a, lambda, psi, tend, h, &
   & iopt, ropt, rpar, ipar, icnt, idid, text)
   use dynstep_f77_alpha, only: run_soi2
   use dynstep_f77_constraints, only: f77_constrained_out, f77_constraint, f77_constraint_jacobian, &
      & f77_velocity_constraint, f77_velocity_jacobian
   use dynstep_f77_systems, only: f77_force, f77_mass, f77_tangent
   use dynstep_kinds, only: wp
   implicit none
   integer, intent(in) :: n, m, p
   procedure(f77_force) :: force
   procedure(f77_mass) :: mass
   procedure(f77_tangent) :: tang
   procedure(f77_constraint) :: gcon
   procedure(f77_constraint_jacobian) :: gjac
   procedure(f77_velocity_constraint) :: kcon
   procedure(f77_velocity_jacobian) :: kjac
   procedure(f77_constrained_out) :: out
   real(wp), intent(inout) :: t, q(*), v(*), a(*), lambda(*), psi(*)
   real(wp), intent(in) :: tend, h
   integer, intent(in) :: iopt(*)
   real(wp), intent(in) :: ropt(*)
   real(wp), intent(inout) :: rpar(*)
   integer, intent(inout) :: ipar(*)
   integer, intent(inout) :: icnt(*)
   integer, intent(out) :: idid
   character(len=*), intent(out) :: text
   call run_soi2(n, m, p, force, mass, tang, gcon, gjac, kcon, kjac, out, t, q, v, a, lambda, psi, tend, h, iopt, ropt, &
      & rpar, ipar, icnt, idid, text)
end subroutine dssoi2
