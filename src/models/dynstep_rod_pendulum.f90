! SPDX-License-Identifier: BSD-3-Clause
!> A rod on a pin, with a spring and a damper that turn it: L. O. Jay and D. Negrut (2008), eqs. (16).
!>
!>   q = (x, y, theta) of the centre of a uniform rod of length 2L, theta from the x axis
!>   M = diag(m, m, m L^2/3),   f = (0, -m g, -c theta' - k (theta - 3 pi/2))
!>   0 = x - L cos(theta),      0 = y - L sin(theta)
!>
!> In the angle alone:  (4/3) m L^2 theta'' = -c theta' - k (theta - 3 pi/2) - m g L cos(theta).
module dynstep_rod_pendulum
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_diagonal, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   implicit none
   private

   real(wp), parameter :: hanging = 1.5_wp*acos(-1.0_wp)     !! angle at which the spring is relaxed

   type, extends(mechanical_system), public :: rod_pendulum
      real(wp) :: m = 5.0_wp           !! mass > 0, kg
      real(wp) :: l = 2.0_wp           !! half of the length > 0, m
      real(wp) :: k = 3000.0_wp        !! stiffness of the spring, N m/rad
      real(wp) :: c = 100.0_wp         !! damping, N m s/rad
      real(wp) :: gravity = 9.81_wp    !! along -y, m/s^2
   contains
      procedure :: setup => pendulum_setup
      procedure :: force => pendulum_force
      procedure :: mass => pendulum_mass
      procedure :: tangent => pendulum_tangent
      procedure :: energy => pendulum_energy
      procedure :: constraint => pendulum_constraint
      procedure :: constraint_jacobian => pendulum_constraint_jacobian
      procedure :: constraint_curvature => pendulum_constraint_curvature
      procedure :: reaction_tangent => pendulum_reaction_tangent
      procedure :: start => pendulum_start
      procedure :: angle_motion => pendulum_angle_motion
   end type rod_pendulum

contains

   !> Fill n, the number of constraints, and `structure`; the components have the paper's values by default
   subroutine pendulum_setup(self)
      class(rod_pendulum), intent(inout) :: self
      self%n = 3
      self%holonomic = 2
      self%structure%mass = kind_diagonal
      self%structure%tangent = kind_diagonal
      self%structure%tangent_is_symmetric = .true.
      self%structure%tangent_is_constant = .true.
      self%structure%has_energy = .true.
      self%constraints%has_reaction_tangent = .true.
   end subroutine pendulum_setup

   recursive subroutine pendulum_force(self, t, q, v, f, ierr)
      class(rod_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = [0.0_wp, -self%m*self%gravity, -self%c*v(3) - self%k*(q(3) - hanging)]
   end subroutine pendulum_force

   recursive subroutine pendulum_mass(self, t, q, v, mass, ierr)
      class(rod_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = self%m*[1.0_wp, 1.0_wp, self%l**2/3.0_wp]
   end subroutine pendulum_mass

   recursive subroutine pendulum_tangent(self, t, q, v, a, k, c, ierr)
      class(rod_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      call k%set_entry(3, 3, self%k)
      call c%set_entry(3, 3, self%c)
   end subroutine pendulum_tangent

   !> Of the motion, the height and the spring; the damper takes c theta'^2 of it per time
   recursive subroutine pendulum_energy(self, t, q, v, energy, ierr)
      class(rod_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      ierr = 0
      energy = self%m*(0.5_wp*(v(1)**2 + v(2)**2 + (self%l*v(3))**2/3.0_wp) + self%gravity*q(2)) &
         & + 0.5_wp*self%k*(q(3) - hanging)**2
   end subroutine pendulum_energy

   !> (16c)
   recursive subroutine pendulum_constraint(self, t, q, g, ierr)
      class(rod_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g = [q(1) - self%l*cos(q(3)), q(2) - self%l*sin(q(3))]
   end subroutine pendulum_constraint

   recursive subroutine pendulum_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(rod_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      gq%value = [1.0_wp, 0.0_wp, self%l*sin(q(3)), 0.0_wp, 1.0_wp, -self%l*cos(q(3))]
   end subroutine pendulum_constraint_jacobian

   recursive subroutine pendulum_constraint_curvature(self, t, q, v, c, ierr)
      class(rod_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      c = self%l*v(3)**2*[cos(q(3)), sin(q(3))]
   end subroutine pendulum_constraint_curvature

   recursive subroutine pendulum_reaction_tangent(self, t, q, v, lambda, psi, k, c, ierr)
      class(rod_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      k%a(3, 1) = k%a(3, 1) + self%l*(cos(q(3))*lambda(1) + sin(q(3))*lambda(2))
   end subroutine pendulum_reaction_tangent

   !> q and v on both levels of the constraints; (16) starts from theta = 3 pi/2, rate = 10
   pure subroutine pendulum_start(self, theta, rate, q, v)
      class(rod_pendulum), intent(in) :: self
      real(wp), intent(in) :: theta, rate             !! angle and its derivative
      real(wp), intent(out) :: q(self%n), v(self%n)
      q = [self%l*cos(theta), self%l*sin(theta), theta]
      v = rate*[-q(2), q(1), 1.0_wp]
   end subroutine pendulum_start

   !> All that belongs to an angle and its derivative: q, v, and a, lambda from the equation of the angle.
   !> a(3) is the right-hand side of that equation, for a reference solution with two unknowns.
   pure subroutine pendulum_angle_motion(self, theta, rate, q, v, a, lambda)
      class(rod_pendulum), intent(in) :: self
      real(wp), intent(in) :: theta, rate
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic)
      call self%start(theta, rate, q, v)
      a(3) = -(self%c*rate + self%k*(theta - hanging) + self%m*self%gravity*q(1))/(4.0_wp*self%m*self%l**2/3.0_wp)
      a(1) = -q(2)*a(3) - q(1)*rate**2
      a(2) = q(1)*a(3) - q(2)*rate**2
      lambda = [-self%m*a(1), -self%m*(a(2) + self%gravity)]
   end subroutine pendulum_angle_motion
end module dynstep_rod_pendulum
