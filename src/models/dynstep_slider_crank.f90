! SPDX-License-Identifier: BSD-3-Clause
!> A plane slider-crank in absolute coordinates: the mechanism of Figs. 5 to 7 of L. O. Jay and
!> D. Negrut (2008), whose data are not in print; the values here are chosen.
!>
!>   q = (x1, y1, theta1,  x2, y2, theta2,  x3, y3, theta3): centres and angles of crank, rod, slider
!>   g(1:2) pin O that holds the crank to the ground     x1 - (L1/2) cos(theta1),  y1 - (L1/2) sin(theta1)
!>   g(3:4) pin of crank and rod                         x1 + (L1/2) cos(theta1) - x2 + (L2/2) cos(theta2), ...
!>   g(5:6) pin of rod and slider                        x2 + (L2/2) cos(theta2) - x3, ...
!>   g(7:8) guide of the slider                          y3,  theta3
!>
!> With L2 > L1 the crank turns all the way round.  At L2 = L1 the rod stands on the guide when the crank is
!> upright: there G loses a rank.
module dynstep_slider_crank
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_diagonal, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_invalid_input, status_type
   implicit none
   private

   type, extends(mechanical_system), public :: slider_crank
      real(wp) :: l1 = 0.3_wp                            !! length of the crank > 0
      real(wp) :: l2 = 0.6_wp                            !! length of the rod > 0
      real(wp) :: m(3) = [0.36_wp, 0.72_wp, 1.0_wp]      !! masses > 0 of crank, rod and slider
      real(wp) :: slider_inertia = 0.01_wp               !! > 0; the other two are uniform rods
      real(wp) :: gravity = 0.0_wp                       !! along -y
   contains
      procedure :: setup => crank_setup
      procedure :: force => crank_force
      procedure :: mass => crank_mass
      procedure :: tangent => crank_tangent
      procedure :: energy => crank_energy
      procedure :: constraint => crank_constraint
      procedure :: constraint_jacobian => crank_constraint_jacobian
      procedure :: constraint_curvature => crank_constraint_curvature
      procedure :: reaction_tangent => crank_reaction_tangent
      procedure :: start => crank_start
      procedure :: angle_motion => crank_angle_motion
      procedure :: pin_velocity => crank_pin_velocity
      procedure :: inertias => crank_inertias
   end type slider_crank

contains

   !> Fill n, the number of constraints, and what is declared
   subroutine crank_setup(self)
      class(slider_crank), intent(inout) :: self
      self%n = 9
      self%holonomic = 8
      self%structure%mass = kind_diagonal
      self%structure%tangent = kind_diagonal
      self%structure%tangent_is_symmetric = .true.
      self%structure%tangent_is_constant = .true.
      self%structure%velocity_free = .true.
      self%structure%has_energy = .true.
      self%constraints%g%first = [1, 3, 5, 9, 13, 16, 19, 20, 21]
      self%constraints%g%column = [1, 3, 2, 3, 1, 3, 4, 6, 2, 3, 5, 6, 4, 6, 7, 5, 6, 8, 8, 9]
      self%constraints%has_reaction_tangent = .true.
   end subroutine crank_setup

   recursive subroutine crank_force(self, t, q, v, f, ierr)
      class(slider_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = 0.0_wp
      f(2:8:3) = -self%gravity*self%m
   end subroutine crank_force

   recursive subroutine crank_mass(self, t, q, v, mass, ierr)
      class(slider_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(1:7:3, 1) = self%m
      mass%a(2:8:3, 1) = self%m
      mass%a(3:9:3, 1) = self%inertias()
   end subroutine crank_mass

   !> About the centres of crank, rod and slider
   pure function crank_inertias(self) result(inertias)
      class(slider_crank), intent(in) :: self
      real(wp) :: inertias(3)
      inertias = [self%m(1)*self%l1**2/12.0_wp, self%m(2)*self%l2**2/12.0_wp, self%slider_inertia]
   end function crank_inertias

   !> The force is constant: no entries
   recursive subroutine crank_tangent(self, t, q, v, a, k, c, ierr)
      class(slider_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
   end subroutine crank_tangent

   !> Conserved while nothing drives the crank
   recursive subroutine crank_energy(self, t, q, v, energy, ierr)
      class(slider_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      ierr = 0
      energy = 0.5_wp*sum(self%m*(v(1:7:3)**2 + v(2:8:3)**2) + self%inertias()*v(3:9:3)**2) &
         & + self%gravity*sum(self%m*q(2:8:3))
   end subroutine crank_energy

   recursive subroutine crank_constraint(self, t, q, g, ierr)
      class(slider_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: half1(2), half2(2)
      ierr = 0
      half1 = 0.5_wp*self%l1*[cos(q(3)), sin(q(3))]
      half2 = 0.5_wp*self%l2*[cos(q(6)), sin(q(6))]
      g(1:2) = q(1:2) - half1
      g(3:4) = (q(1:2) + half1) - (q(4:5) - half2)
      g(5:6) = (q(4:5) + half2) - q(7:8)
      g(7:8) = q(8:9)
   end subroutine crank_constraint

   recursive subroutine crank_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(slider_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: s1, c1, s2, c2
      ierr = 0
      s1 = 0.5_wp*self%l1*sin(q(3))
      c1 = 0.5_wp*self%l1*cos(q(3))
      s2 = 0.5_wp*self%l2*sin(q(6))
      c2 = 0.5_wp*self%l2*cos(q(6))
      gq%value(1:4) = [1.0_wp, s1, 1.0_wp, -c1]
      gq%value(5:12) = [1.0_wp, -s1, -1.0_wp, -s2, 1.0_wp, c1, -1.0_wp, c2]
      gq%value(13:18) = [1.0_wp, -s2, -1.0_wp, 1.0_wp, c2, -1.0_wp]
      gq%value(19:20) = 1.0_wp
   end subroutine crank_constraint_jacobian

   recursive subroutine crank_constraint_curvature(self, t, q, v, c, ierr)
      class(slider_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: pull1(2), pull2(2)
      ierr = 0
      pull1 = 0.5_wp*self%l1*v(3)**2*[cos(q(3)), sin(q(3))]
      pull2 = 0.5_wp*self%l2*v(6)**2*[cos(q(6)), sin(q(6))]
      c(1:2) = pull1
      c(3:4) = -pull1 - pull2
      c(5:6) = -pull2
      c(7:8) = 0.0_wp
   end subroutine crank_constraint_curvature

   recursive subroutine crank_reaction_tangent(self, t, q, v, lambda, psi, k, c, ierr)
      class(slider_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      k%a(3, 1) = k%a(3, 1) + 0.5_wp*self%l1*(cos(q(3))*(lambda(1) - lambda(3)) + sin(q(3))*(lambda(2) - lambda(4)))
      k%a(6, 1) = k%a(6, 1) - 0.5_wp*self%l2*(cos(q(6))*(lambda(3) + lambda(5)) + sin(q(6))*(lambda(4) + lambda(6)))
   end subroutine crank_reaction_tangent

   !> q and v on both levels of the constraints, the slider to the right of the rod; the chosen run starts
   !> from angle 0, rate pi
   recursive subroutine crank_start(self, angle, rate, q, v, status)
      class(slider_crank), intent(in) :: self
      real(wp), intent(in) :: angle, rate             !! theta1 and theta1'
      real(wp), intent(out) :: q(self%n), v(self%n)
      type(status_type), intent(inout) :: status      !! dynstep_invalid_input where the rod is too short
      real(wp) :: a(self%n)
      call self%angle_motion(angle, rate, 0.0_wp, q, v, a, status)
   end subroutine crank_start

   !> Places, velocities and accelerations that belong to those of the crank:  L2 sin(theta2) = -L1 sin(theta1)
   recursive subroutine crank_angle_motion(self, angle, rate, acceleration, q, v, a, status)
      class(slider_crank), intent(in) :: self
      real(wp), intent(in) :: angle, rate, acceleration   !! theta1, theta1', theta1''
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      type(status_type), intent(inout) :: status
      real(wp) :: s1, c1, s2, c2, rate2, acceleration2, p(2, 3), r(2, 3)

      q = 0.0_wp
      v = 0.0_wp
      a = 0.0_wp
      if (status%failed()) return
      s1 = sin(angle)
      c1 = cos(angle)
      s2 = -self%l1*s1/self%l2
      if (abs(s2) >= 1.0_wp) then
         call status%set(dynstep_invalid_input, 'the rod of the slider-crank does not reach its guide from this angle &
            &of the crank; choose l2 > l1')
         return
      end if
      c2 = sqrt((1.0_wp - s2)*(1.0_wp + s2))
      rate2 = -self%l1*c1*rate/(self%l2*c2)
      acceleration2 = (s2*rate2**2 - self%l1/self%l2*(c1*acceleration - s1*rate**2))/c2
      p = turned(s1, c1, rate, acceleration)*self%l1      ! end of the crank
      r = turned(s2, c2, rate2, acceleration2)*self%l2    ! from there to the end of the rod
      q(1:3) = [0.5_wp*p(:, 1), angle]
      v(1:3) = [0.5_wp*p(:, 2), rate]
      a(1:3) = [0.5_wp*p(:, 3), acceleration]
      q(4:6) = [p(:, 1) + 0.5_wp*r(:, 1), asin(s2)]
      v(4:6) = [p(:, 2) + 0.5_wp*r(:, 2), rate2]
      a(4:6) = [p(:, 3) + 0.5_wp*r(:, 3), acceleration2]
      q(7) = p(1, 1) + r(1, 1)
      v(7) = p(1, 2) + r(1, 2)
      a(7) = p(1, 3) + r(1, 3)
   end subroutine crank_angle_motion

   !> The unit vector (c, s) of an angle and its first two derivatives
   pure function turned(s, c, rate, acceleration) result(e)
      real(wp), intent(in) :: s, c, rate, acceleration
      real(wp) :: e(2, 3)
      e(:, 1) = [c, s]
      e(:, 2) = [-s, c]*rate
      e(:, 3) = [-s, c]*acceleration - [c, s]*rate**2
   end function turned

   !> Velocity of pin O of the crank, which would be zero: what Figs. 6 and 7 show
   pure function crank_pin_velocity(self, q, v) result(velocity)
      class(slider_crank), intent(in) :: self
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp) :: velocity(2)
      velocity = v(1:2) + 0.5_wp*self%l1*v(3)*[sin(q(3)), -cos(q(3))]
   end function crank_pin_velocity
end module dynstep_slider_crank
