! SPDX-License-Identifier: BSD-3-Clause
!> A mathematical test problem with everything at once: L. O. Jay and D. Negrut (2008), eqs. (15).
!>
!>   [ y1              y2 - exp(-2t) ] [z1']   [ exp(t)(y1 z2 + 2 y2 z1) - 2                      ]
!>   [ sin(y1-exp(t))  y1 y2         ] [z2'] = [ exp(-t)(y2 z2/2 - 2 y1 z1 y2 z2) + exp(3t)       ] + r
!>
!>   r = [ exp(2t) y1 lambda - y1 z2 psi ;  exp(-t) y2 lambda^2 - y1 y2 z1 psi^3 ]
!>   g = y1^2 y2 - 1 = 0,    k = y1 z1 z2 + 2 = 0
!>
!> The mass matrix is not constant and not symmetric, the reactions are not linear in the multipliers
!> and not of the form -G^T lambda - K^T psi.  (In print the two rows of (15b) are scrambled; this
!> reading has the exact solution that the paper gives.)  The constraints alone fix the velocities:
!> a, lambda and psi show what y and z hide.
module dynstep_jay_negrut_problem
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_dense, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   implicit none
   private

   type, extends(mechanical_system), public :: jay_negrut_problem
   contains
      procedure :: setup => problem_setup
      procedure :: force => problem_force
      procedure :: mass => problem_mass
      procedure :: tangent => problem_tangent
      procedure :: constraint => problem_constraint
      procedure :: constraint_jacobian => problem_constraint_jacobian
      procedure :: constraint_curvature => problem_constraint_curvature
      procedure :: velocity_constraint => problem_velocity_constraint
      procedure :: velocity_jacobian => problem_velocity_jacobian
      procedure :: velocity_curvature => problem_velocity_curvature
      procedure :: reaction => problem_reaction
      procedure :: reaction_jacobian => problem_reaction_jacobian
      procedure :: reaction_tangent => problem_reaction_tangent
      procedure :: exact => problem_exact
   end type jay_negrut_problem

contains

   !> Fill n, the numbers of constraints, and what is declared
   subroutine problem_setup(self)
      class(jay_negrut_problem), intent(inout) :: self
      self%n = 2
      self%holonomic = 1
      self%nonholonomic = 1
      self%structure%mass = kind_dense
      self%structure%mass_is_constant = .false.
      self%structure%mass_is_symmetric = .false.
      self%structure%tangent = kind_dense
      self%constraints%reaction_is_general = .true.
      self%constraints%has_reaction_tangent = .true.
   end subroutine problem_setup

   !> (15b) without the terms of the multipliers
   recursive subroutine problem_force(self, t, q, v, f, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = exp(t)*(q(1)*v(2) + 2.0_wp*q(2)*v(1)) - 2.0_wp
      f(2) = exp(-t)*(0.5_wp*q(2)*v(2) - 2.0_wp*q(1)*v(1)*q(2)*v(2)) + exp(3.0_wp*t)
   end subroutine problem_force

   recursive subroutine problem_mass(self, t, q, v, mass, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      call mass%set_entry(1, 1, q(1))
      call mass%set_entry(1, 2, q(2) - exp(-2.0_wp*t))
      call mass%set_entry(2, 1, sin(q(1) - exp(t)))
      call mass%set_entry(2, 2, q(1)*q(2))
   end subroutine problem_mass

   recursive subroutine problem_tangent(self, t, q, v, a, k, c, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      real(wp) :: grows, falls
      ierr = 0
      grows = exp(t)
      falls = exp(-t)
      call k%set_entry(1, 1, a(1) - grows*v(2))
      call k%set_entry(1, 2, a(2) - 2.0_wp*grows*v(1))
      call k%set_entry(2, 1, cos(q(1) - grows)*a(1) + q(2)*a(2) + 2.0_wp*falls*v(1)*q(2)*v(2))
      call k%set_entry(2, 2, q(1)*a(2) - falls*v(2)*(0.5_wp - 2.0_wp*q(1)*v(1)))
      call c%set_entry(1, 1, -2.0_wp*grows*q(2))
      call c%set_entry(1, 2, -grows*q(1))
      call c%set_entry(2, 1, 2.0_wp*falls*q(1)*q(2)*v(2))
      call c%set_entry(2, 2, -falls*q(2)*(0.5_wp - 2.0_wp*q(1)*v(1)))
   end subroutine problem_tangent

   !> (15c)
   recursive subroutine problem_constraint(self, t, q, g, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g(1) = q(1)**2*q(2) - 1.0_wp
   end subroutine problem_constraint

   recursive subroutine problem_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      gq%value(1) = 2.0_wp*q(1)*q(2)
      gq%value(2) = q(1)**2
   end subroutine problem_constraint_jacobian

   recursive subroutine problem_constraint_curvature(self, t, q, v, c, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      c(1) = 2.0_wp*v(1)*(q(2)*v(1) + 2.0_wp*q(1)*v(2))
   end subroutine problem_constraint_curvature

   !> (15e)
   recursive subroutine problem_velocity_constraint(self, t, q, v, k, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      k(1) = q(1)*v(1)*v(2) + 2.0_wp
   end subroutine problem_velocity_constraint

   recursive subroutine problem_velocity_jacobian(self, t, q, v, kv, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      ierr = 0
      kv%value(1) = q(1)*v(2)
      kv%value(2) = q(1)*v(1)
   end subroutine problem_velocity_jacobian

   recursive subroutine problem_velocity_curvature(self, t, q, v, c, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      c(1) = v(1)**2*v(2)
   end subroutine problem_velocity_curvature

   !> The terms of the multipliers in (15b)
   recursive subroutine problem_reaction(self, t, q, v, lambda, psi, r, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      r(1) = exp(2.0_wp*t)*q(1)*lambda(1) - q(1)*v(2)*psi(1)
      r(2) = exp(-t)*q(2)*lambda(1)**2 - q(1)*q(2)*v(1)*psi(1)**3
   end subroutine problem_reaction

   recursive subroutine problem_reaction_jacobian(self, t, q, v, lambda, psi, rl, rp, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(inout) :: rl(self%n, self%holonomic)
      real(wp), intent(inout) :: rp(self%n, self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      rl(1, 1) = exp(2.0_wp*t)*q(1)
      rl(2, 1) = 2.0_wp*exp(-t)*q(2)*lambda(1)
      rp(1, 1) = -q(1)*v(2)
      rp(2, 1) = -3.0_wp*q(1)*q(2)*v(1)*psi(1)**2
   end subroutine problem_reaction_jacobian

   recursive subroutine problem_reaction_tangent(self, t, q, v, lambda, psi, k, c, ierr)
      class(jay_negrut_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      k%a(1, 1) = k%a(1, 1) - exp(2.0_wp*t)*lambda(1) + v(2)*psi(1)
      k%a(2, 1) = k%a(2, 1) + q(2)*v(1)*psi(1)**3
      k%a(2, 2) = k%a(2, 2) - exp(-t)*lambda(1)**2 + q(1)*v(1)*psi(1)**3
      c%a(1, 2) = c%a(1, 2) + q(1)*psi(1)
      c%a(2, 1) = c%a(2, 1) + q(1)*q(2)*psi(1)**3
   end subroutine problem_reaction_tangent

   !> The solution from q = (1, 1), v = (1, -2) at t = 0
   pure subroutine problem_exact(self, t, q, v, a, lambda, psi)
      class(jay_negrut_problem), intent(in) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      q = [exp(t), exp(-2.0_wp*t)]
      v = [exp(t), -2.0_wp*exp(-2.0_wp*t)]
      a = [exp(t), 4.0_wp*exp(-2.0_wp*t)]
      lambda = exp(-t)
      psi = exp(t)
   end subroutine problem_exact
end module dynstep_jay_negrut_problem
