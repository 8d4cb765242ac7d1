! SPDX-License-Identifier: BSD-3-Clause
!> A knife edge (a skate) on an inclined plane: the classic nonholonomic system, see
!> Ju. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems (1972), and A. M. Bloch,
!> Nonholonomic Mechanics and Control (2003), section 1.6.
!>
!>   q = (x, y, phi): x down the plane, y across, phi the heading from x
!>   M = diag(m, m, J),   f = (m g sin(alpha), 0, 0)
!>   k = x' sin(phi) - y' cos(phi) = 0:  it moves along its heading only
!>
!> Turning at a constant rate it does not slide down, but drifts across on a cycloid: `exact`.
module dynstep_knife_edge
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_diagonal, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   implicit none
   private

   type, extends(mechanical_system), public :: knife_edge
      real(wp) :: m = 1.0_wp           !! mass > 0
      real(wp) :: j = 0.5_wp           !! moment of inertia > 0
      real(wp) :: slope = 0.3_wp       !! alpha, rad
      real(wp) :: gravity = 9.81_wp
   contains
      procedure :: setup => knife_setup
      procedure :: force => knife_force
      procedure :: mass => knife_mass
      procedure :: tangent => knife_tangent
      procedure :: energy => knife_energy
      procedure :: velocity_constraint => knife_velocity_constraint
      procedure :: velocity_jacobian => knife_velocity_jacobian
      procedure :: velocity_curvature => knife_velocity_curvature
      procedure :: exact => knife_exact
   end type knife_edge

contains

   !> Fill n, the number of constraints, and what is declared
   subroutine knife_setup(self)
      class(knife_edge), intent(inout) :: self
      self%n = 3
      self%nonholonomic = 1
      self%structure%mass = kind_diagonal
      self%structure%tangent = kind_diagonal
      self%structure%tangent_is_symmetric = .true.
      self%structure%tangent_is_constant = .true.
      self%structure%velocity_free = .true.
      self%structure%has_energy = .true.
      self%constraints%k%first = [1, 3]
      self%constraints%k%column = [1, 2]
   end subroutine knife_setup

   recursive subroutine knife_force(self, t, q, v, f, ierr)
      class(knife_edge), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = [self%m*self%gravity*sin(self%slope), 0.0_wp, 0.0_wp]
   end subroutine knife_force

   recursive subroutine knife_mass(self, t, q, v, mass, ierr)
      class(knife_edge), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = [self%m, self%m, self%j]
   end subroutine knife_mass

   !> The force is constant: no entries
   recursive subroutine knife_tangent(self, t, q, v, a, k, c, ierr)
      class(knife_edge), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
   end subroutine knife_tangent

   !> Conserved
   recursive subroutine knife_energy(self, t, q, v, energy, ierr)
      class(knife_edge), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      ierr = 0
      energy = 0.5_wp*(self%m*(v(1)**2 + v(2)**2) + self%j*v(3)**2) - self%m*self%gravity*sin(self%slope)*q(1)
   end subroutine knife_energy

   recursive subroutine knife_velocity_constraint(self, t, q, v, k, ierr)
      class(knife_edge), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      k(1) = v(1)*sin(q(3)) - v(2)*cos(q(3))
   end subroutine knife_velocity_constraint

   recursive subroutine knife_velocity_jacobian(self, t, q, v, kv, ierr)
      class(knife_edge), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      ierr = 0
      kv%value = [sin(q(3)), -cos(q(3))]
   end subroutine knife_velocity_jacobian

   recursive subroutine knife_velocity_curvature(self, t, q, v, c, ierr)
      class(knife_edge), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      c(1) = v(3)*(v(1)*cos(q(3)) + v(2)*sin(q(3)))
   end subroutine knife_velocity_curvature

   !> The motion from q = 0 at t = 0, with a speed along the heading and a rate w /= 0 of the heading:
   !> phi = w t and, with b = g sin(alpha), the speed is u = u0 + (b/w) sin(phi).  The edge holds
   !> the load b sin(phi) and turns the motion by u w, so psi = m (u w + b sin(phi)).
   pure subroutine knife_exact(self, speed, rate, t, q, v, a, psi)
      class(knife_edge), intent(in) :: self
      real(wp), intent(in) :: speed, rate          !! u0 and w at t = 0
      real(wp), intent(in) :: t
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: psi(self%nonholonomic)
      real(wp) :: phi, s, c, b, u
      phi = rate*t
      s = sin(phi)
      c = cos(phi)
      b = self%gravity*sin(self%slope)
      u = speed + (b/rate)*s
      q = [(speed/rate)*s + 0.5_wp*b*(s/rate)**2, &
         & (speed/rate)*(1.0_wp - c) + 0.5_wp*b*(phi - s*c)/rate**2, phi]
      v = [u*c, u*s, rate]
      a = [b*c**2 - u*rate*s, b*c*s + u*rate*c, 0.0_wp]
      psi = self%m*(u*rate + b*s)
   end subroutine knife_exact
end module dynstep_knife_edge
