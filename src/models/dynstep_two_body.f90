! SPDX-License-Identifier: BSD-3-Clause
!> Two planar rigid bodies on a frictionless joint, free of gravity:
!> M. Austin (1991), Example 3, eqs. (48)-(50).
!>
!>   [ J1          s cos(d) ] [theta1'']                [ theta2'^2 ]
!>   [ s cos(d)    J2       ] [theta2'']  =  s sin(d) * [-theta1'^2 ],   d = theta2 - theta1
!>
!>   epsilon = m1 m2/(m1 + m2),  s = epsilon d1 d2,  J1 = I1 + epsilon d1^2,  J2 = I2 + epsilon d2^2
!>
!> Angular momentum and the Lagrangian (all of it kinetic energy) are constant.
module dynstep_two_body
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_dense, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   implicit none
   private

   type, extends(mechanical_system), public :: two_body_system
      real(wp) :: j1 = 0.0_wp     !! augmented inertia of body 1
      real(wp) :: j2 = 0.0_wp     !! augmented inertia of body 2
      real(wp) :: s = 0.0_wp      !! coupling, epsilon d1 d2
   contains
      procedure :: setup => two_body_setup
      procedure :: force => two_body_force
      procedure :: mass => two_body_mass
      procedure :: tangent => two_body_tangent
      procedure :: energy => two_body_energy
      procedure :: lagrangian => two_body_lagrangian
      procedure :: momentum => two_body_momentum
   end type two_body_system

contains

   !> Masses, distances from the joint to the centres of mass, moments of inertia about them
   subroutine two_body_setup(self, m1, m2, d1, d2, i1, i2)
      class(two_body_system), intent(inout) :: self
      real(wp), intent(in) :: m1, m2, d1, d2, i1, i2
      real(wp) :: reduced_mass      ! epsilon of the paper
      reduced_mass = m1*m2/(m1 + m2)
      self%j1 = i1 + reduced_mass*d1**2
      self%j2 = i2 + reduced_mass*d2**2
      self%s = reduced_mass*d1*d2
      self%n = 2
      self%structure%mass = kind_dense
      self%structure%mass_is_constant = .false.
      self%structure%mass_is_symmetric = .true.
      self%structure%tangent = kind_dense
      self%structure%has_energy = .true.
   end subroutine two_body_setup

   !> Eq. (50), the velocity terms brought to the right-hand side
   recursive subroutine two_body_force(self, t, q, v, f, ierr)
      class(two_body_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = self%s*sin(q(2) - q(1))*[v(2)**2, -v(1)**2]
   end subroutine two_body_force

   recursive subroutine two_body_mass(self, t, q, v, mass, ierr)
      class(two_body_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      real(wp) :: coupling
      ierr = 0
      coupling = self%s*cos(q(2) - q(1))
      call mass%set_entry(1, 1, self%j1)
      call mass%set_entry(1, 2, coupling)
      call mass%set_entry(2, 1, coupling)
      call mass%set_entry(2, 2, self%j2)
   end subroutine two_body_mass

   !> With r = f - M a and d = theta2 - theta1:  dr/dtheta2 = -dr/dtheta1 = dr/dd
   recursive subroutine two_body_tangent(self, t, q, v, a, k, c, ierr)
      class(two_body_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      real(wp) :: sine, cosine, dr(2)
      ierr = 0
      sine = self%s*sin(q(2) - q(1))
      cosine = self%s*cos(q(2) - q(1))
      dr(1) = cosine*v(2)**2 + sine*a(2)
      dr(2) = -cosine*v(1)**2 + sine*a(1)
      call k%set_entry(1, 1, dr(1))
      call k%set_entry(2, 1, dr(2))
      call k%set_entry(1, 2, -dr(1))
      call k%set_entry(2, 2, -dr(2))
      call c%set_entry(1, 2, -2.0_wp*sine*v(2))
      call c%set_entry(2, 1, 2.0_wp*sine*v(1))
   end subroutine two_body_tangent

   recursive subroutine two_body_energy(self, t, q, v, energy, ierr)
      class(two_body_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      ierr = 0
      energy = self%lagrangian(q, v)
   end subroutine two_body_energy

   !> Eq. (49)
   pure real(wp) function two_body_lagrangian(self, q, v)
      class(two_body_system), intent(in) :: self
      real(wp), intent(in) :: q(self%n), v(self%n)
      associate (coupling => self%s*cos(q(2) - q(1)))
         two_body_lagrangian = 0.5_wp*(self%j1*v(1)**2 + self%j2*v(2)**2 + 2.0_wp*v(1)*v(2)*coupling)
      end associate
   end function two_body_lagrangian

   !> Eq. (48)
   pure real(wp) function two_body_momentum(self, q, v)
      class(two_body_system), intent(in) :: self
      real(wp), intent(in) :: q(self%n), v(self%n)
      associate (coupling => self%s*cos(q(2) - q(1)))
         two_body_momentum = (self%j1 + coupling)*v(1) + (self%j2 + coupling)*v(2)
      end associate
   end function two_body_momentum
end module dynstep_two_body
