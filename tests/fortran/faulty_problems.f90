! SPDX-License-Identifier: BSD-3-Clause
!> Problem (15) with a fault in one of its procedures from some time on.
module faulty_problems
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use dynstep, only: jacobian_type, jay_negrut_problem, matrix_type, wp
   implicit none
   private

   integer, parameter, public :: procedures = 11
   character(len=20), parameter, public :: procedure_names(procedures) = [character(len=20) :: &
      & 'force', 'mass', 'tangent', 'constraint', &
      & 'constraint_jacobian', 'constraint_curvature', 'velocity_constraint', 'velocity_jacobian', &
      & 'velocity_curvature', 'reaction', 'reaction_jacobian']

   type, extends(jay_negrut_problem), public :: faulty_problem
      integer :: which = 0               !! number of the procedure
      integer :: answer = 0              !! its ierr; 0: it gives a NaN
      real(wp) :: from = 0.0_wp          !! from this time on
   contains
      procedure :: force => faulty_force
      procedure :: mass => faulty_mass
      procedure :: tangent => faulty_tangent
      procedure :: constraint => faulty_constraint
      procedure :: constraint_jacobian => faulty_constraint_jacobian
      procedure :: constraint_curvature => faulty_constraint_curvature
      procedure :: velocity_constraint => faulty_velocity_constraint
      procedure :: velocity_jacobian => faulty_velocity_jacobian
      procedure :: velocity_curvature => faulty_velocity_curvature
      procedure :: reaction => faulty_reaction
      procedure :: reaction_jacobian => faulty_reaction_jacobian
      procedure :: fails => fails_at
   end type faulty_problem

contains

   pure logical function fails_at(self, which, t)
      class(faulty_problem), intent(in) :: self
      integer, intent(in) :: which
      real(wp), intent(in) :: t
      fails_at = self%which == which .and. t >= self%from
   end function fails_at

   pure subroutine spoil(self, x, ierr)
      class(faulty_problem), intent(in) :: self
      real(wp), intent(inout) :: x
      integer, intent(inout) :: ierr
      ierr = self%answer
      if (self%answer == 0) x = ieee_value(1.0_wp, ieee_quiet_nan)
   end subroutine spoil

   recursive subroutine faulty_force(self, t, q, v, f, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%force(t, q, v, f, ierr)
      if (self%fails(1, t)) call spoil(self, f(1), ierr)
   end subroutine faulty_force

   recursive subroutine faulty_mass(self, t, q, v, mass, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%mass(t, q, v, mass, ierr)
      if (self%fails(2, t)) call spoil(self, mass%a(1, 1), ierr)
   end subroutine faulty_mass

   recursive subroutine faulty_tangent(self, t, q, v, a, k, c, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%tangent(t, q, v, a, k, c, ierr)
      if (self%fails(3, t)) call spoil(self, k%a(1, 1), ierr)
   end subroutine faulty_tangent

   recursive subroutine faulty_constraint(self, t, q, g, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%constraint(t, q, g, ierr)
      if (self%fails(4, t)) call spoil(self, g(1), ierr)
   end subroutine faulty_constraint

   recursive subroutine faulty_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%constraint_jacobian(t, q, gq, gt, ierr)
      if (self%fails(5, t)) call spoil(self, gq%value(1), ierr)
   end subroutine faulty_constraint_jacobian

   recursive subroutine faulty_constraint_curvature(self, t, q, v, c, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%constraint_curvature(t, q, v, c, ierr)
      if (self%fails(6, t)) call spoil(self, c(1), ierr)
   end subroutine faulty_constraint_curvature

   recursive subroutine faulty_velocity_constraint(self, t, q, v, k, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%velocity_constraint(t, q, v, k, ierr)
      if (self%fails(7, t)) call spoil(self, k(1), ierr)
   end subroutine faulty_velocity_constraint

   recursive subroutine faulty_velocity_jacobian(self, t, q, v, kv, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%velocity_jacobian(t, q, v, kv, ierr)
      if (self%fails(8, t)) call spoil(self, kv%value(1), ierr)
   end subroutine faulty_velocity_jacobian

   recursive subroutine faulty_velocity_curvature(self, t, q, v, c, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%nonholonomic)
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%velocity_curvature(t, q, v, c, ierr)
      if (self%fails(9, t)) call spoil(self, c(1), ierr)
   end subroutine faulty_velocity_curvature

   recursive subroutine faulty_reaction(self, t, q, v, lambda, psi, r, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%reaction(t, q, v, lambda, psi, r, ierr)
      if (self%fails(10, t)) call spoil(self, r(1), ierr)
   end subroutine faulty_reaction

   recursive subroutine faulty_reaction_jacobian(self, t, q, v, lambda, psi, rl, rp, ierr)
      class(faulty_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(inout) :: rl(self%n, self%holonomic), rp(self%n, self%nonholonomic)
      integer, intent(out) :: ierr
      call self%jay_negrut_problem%reaction_jacobian(t, q, v, lambda, psi, rl, rp, ierr)
      if (self%fails(11, t)) call spoil(self, rl(1, 1), ierr)
   end subroutine faulty_reaction_jacobian
end module faulty_problems
