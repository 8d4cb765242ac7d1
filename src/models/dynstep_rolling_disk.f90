! SPDX-License-Identifier: BSD-3-Clause
!> An upright disk that rolls on a plane without slipping; see A. M. Bloch, Nonholonomic Mechanics
!> and Control (2003), section 1.4.
!>
!>   q = (x, y, theta, phi): point of contact, angle of rolling, heading from the x axis
!>   M = diag(m, m, I, J),   f = (0, 0, torque, 0)
!>   k = (x' - R theta' cos(phi),  y' - R theta' sin(phi)) = 0
!>
!> Free of torque it runs on a circle; with a constant torque of rolling on a spiral: `exact`.
module dynstep_rolling_disk
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_diagonal, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   implicit none
   private

   type, extends(mechanical_system), public :: rolling_disk
      real(wp) :: m = 2.0_wp             !! mass > 0
      real(wp) :: r = 0.5_wp             !! radius > 0
      real(wp) :: i_rolling = 0.25_wp    !! moment of inertia about the axis (m R^2/2) > 0
      real(wp) :: i_heading = 0.125_wp   !! about a diameter (m R^2/4) > 0
      real(wp) :: torque = 0.0_wp        !! about the axis, constant
   contains
      procedure :: setup => disk_setup
      procedure :: force => disk_force
      procedure :: mass => disk_mass
      procedure :: tangent => disk_tangent
      procedure :: energy => disk_energy
      procedure :: velocity_constraint => disk_velocity_constraint
      procedure :: velocity_jacobian => disk_velocity_jacobian
      procedure :: velocity_curvature => disk_velocity_curvature
      procedure :: exact => disk_exact
   end type rolling_disk

contains

   !> Fill n, the number of constraints, and what is declared
   subroutine disk_setup(self)
      class(rolling_disk), intent(inout) :: self
      self%n = 4
      self%nonholonomic = 2
      self%structure%mass = kind_diagonal
      self%structure%tangent = kind_diagonal
      self%structure%tangent_is_symmetric = .true.
      self%structure%tangent_is_constant = .true.
      self%structure%velocity_free = .true.
      self%structure%has_energy = .true.
      self%constraints%k%first = [1, 3, 5]
      self%constraints%k%column = [1, 3, 2, 3]
   end subroutine disk_setup

   recursive subroutine disk_force(self, t, q, v, f, ierr)
      class(rolling_disk), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = [0.0_wp, 0.0_wp, self%torque, 0.0_wp]
   end subroutine disk_force

   recursive subroutine disk_mass(self, t, q, v, mass, ierr)
      class(rolling_disk), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = [self%m, self%m, self%i_rolling, self%i_heading]
   end subroutine disk_mass

   !> The force is constant: no entries
   recursive subroutine disk_tangent(self, t, q, v, a, k, c, ierr)
      class(rolling_disk), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
   end subroutine disk_tangent

   !> Of the motion, less the work of the torque: conserved
   recursive subroutine disk_energy(self, t, q, v, energy, ierr)
      class(rolling_disk), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      ierr = 0
      energy = 0.5_wp*(self%m*(v(1)**2 + v(2)**2) + self%i_rolling*v(3)**2 + self%i_heading*v(4)**2) - self%torque*q(3)
   end subroutine disk_energy

   recursive subroutine disk_velocity_constraint(self, t, q, v, k, ierr)
      class(rolling_disk), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      k = [v(1) - self%r*v(3)*cos(q(4)), v(2) - self%r*v(3)*sin(q(4))]
   end subroutine disk_velocity_constraint

   recursive subroutine disk_velocity_jacobian(self, t, q, v, kv, ierr)
      class(rolling_disk), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      ierr = 0
      kv%value = [1.0_wp, -self%r*cos(q(4)), 1.0_wp, -self%r*sin(q(4))]
   end subroutine disk_velocity_jacobian

   recursive subroutine disk_velocity_curvature(self, t, q, v, c, ierr)
      class(rolling_disk), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      c = self%r*v(3)*v(4)*[sin(q(4)), -cos(q(4))]
   end subroutine disk_velocity_curvature

   !> The motion from q = 0 at t = 0, with rates of rolling and of the heading (w /= 0).  Rolling is that
   !> of an inertia I + m R^2, the heading turns at a constant rate, and m x'' = -psi(1), m y'' = -psi(2).
   pure subroutine disk_exact(self, rolling_rate, rate, t, q, v, a, psi)
      class(rolling_disk), intent(in) :: self
      real(wp), intent(in) :: rolling_rate, rate   !! theta' and w = phi' at t = 0
      real(wp), intent(in) :: t
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: psi(self%nonholonomic)
      real(wp) :: s, c, gain, rolling, arc, bend
      s = sin(rate*t)
      c = cos(rate*t)
      gain = self%torque/(self%i_rolling + self%m*self%r**2)      ! theta''
      rolling = rolling_rate + gain*t                             ! theta'
      arc = self%r/rate
      bend = arc*gain/rate
      q = [arc*rolling*s + bend*(c - 1.0_wp), arc*(rolling_rate - rolling*c) + bend*s, &
         & rolling_rate*t + 0.5_wp*gain*t**2, rate*t]
      v = [self%r*rolling*c, self%r*rolling*s, rolling, rate]
      a = [self%r*(gain*c - rolling*rate*s), self%r*(gain*s + rolling*rate*c), gain, 0.0_wp]
      psi = -self%m*a(1:2)
   end subroutine disk_exact
end module dynstep_rolling_disk
