! SPDX-License-Identifier: BSD-3-Clause
!> The slider-crank with a motor that turns the crank as prescribed: a constraint that depends on time.
!>
!>   g(9) = theta1 - angle(t),   angle(t) = phi0 + omega t + amplitude sin(drive t),   dg(9)/dt = -angle'(t)
!>
!> Nine constraints on nine coordinates leave nothing free: the motion is known, and lambda, among it the
!> torque -lambda(9) of the motor, follows from the equations of motion body by body: `exact`.
module dynstep_driven_crank
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_slider_crank, only: slider_crank
   use dynstep_status, only: status_type
   implicit none
   private

   type, extends(slider_crank), public :: driven_crank
      real(wp) :: phi0 = 0.3_wp          !! angle of the crank at t = 0
      real(wp) :: omega = 3.0_wp         !! its mean rate
      real(wp) :: amplitude = 0.2_wp     !! of the swing about the mean
      real(wp) :: drive = 5.0_wp         !! circular frequency of the swing
   contains
      procedure :: setup => driven_setup
      procedure :: constraint => driven_constraint
      procedure :: constraint_jacobian => driven_constraint_jacobian
      procedure :: constraint_curvature => driven_constraint_curvature
      procedure :: angle => driven_angle
      procedure :: exact => driven_exact
   end type driven_crank

contains

   !> Fill n, the number of constraints, and what is declared
   subroutine driven_setup(self)
      class(driven_crank), intent(inout) :: self
      call self%slider_crank%setup()
      self%holonomic = 9
      self%constraints%g%first = [self%constraints%g%first, 22]
      self%constraints%g%column = [self%constraints%g%column, 3]
   end subroutine driven_setup

   !> Angle of the crank and its first two derivatives
   pure function driven_angle(self, t) result(angle)
      class(driven_crank), intent(in) :: self
      real(wp), intent(in) :: t
      real(wp) :: angle(3)
      associate (b => self%amplitude, w => self%drive)
         angle = [self%phi0 + self%omega*t + b*sin(w*t), self%omega + b*w*cos(w*t), -b*w**2*sin(w*t)]
      end associate
   end function driven_angle

   recursive subroutine driven_constraint(self, t, q, g, ierr)
      class(driven_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: angle(3)
      call self%slider_crank%constraint(t, q, g, ierr)
      angle = self%angle(t)
      g(9) = q(3) - angle(1)
   end subroutine driven_constraint

   recursive subroutine driven_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(driven_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: angle(3)
      call self%slider_crank%constraint_jacobian(t, q, gq, gt, ierr)
      angle = self%angle(t)
      gq%value(21) = 1.0_wp
      gt(9) = -angle(2)
   end subroutine driven_constraint_jacobian

   recursive subroutine driven_constraint_curvature(self, t, q, v, c, ierr)
      class(driven_crank), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: angle(3)
      call self%slider_crank%constraint_curvature(t, q, v, c, ierr)
      angle = self%angle(t)
      c(9) = -angle(3)
   end subroutine driven_constraint_curvature

   !> The motion and its multipliers, from the slider back to the motor.  Rows of M a = f - G^T lambda that are
   !> solved are beside them.  cos(theta2) must not vanish: l2 > l1, or a crank that keeps away from upright.
   recursive subroutine driven_exact(self, t, q, v, a, lambda, status)
      class(driven_crank), intent(in) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic)
      type(status_type), intent(inout) :: status      !! dynstep_invalid_input where the rod is too short
      real(wp) :: angle(3), j(3), difference, total
      lambda = 0.0_wp
      angle = self%angle(t)
      call self%angle_motion(angle(1), angle(2), angle(3), q, v, a, status)
      if (status%failed()) return
      j = self%inertias()
      associate (m => self%m, g => self%gravity, l1 => self%l1, l2 => self%l2)
         lambda(5) = m(3)*a(7)                                        ! x3
         lambda(3) = m(2)*a(4) + lambda(5)                            ! x2
         difference = m(2)*(a(5) + g)                                 ! y2: lambda(4) - lambda(6)
         total = (sin(q(6))*(lambda(3) + lambda(5)) - 2.0_wp*j(2)*a(6)/l2)/cos(q(6))   ! theta2: lambda(4) + lambda(6)
         lambda(4) = 0.5_wp*(total + difference)
         lambda(6) = 0.5_wp*(total - difference)
         lambda(7) = lambda(6) - m(3)*g                               ! y3
         lambda(1) = -m(1)*a(1) - lambda(3)                           ! x1
         lambda(2) = -m(1)*(a(2) + g) - lambda(4)                     ! y1
         lambda(9) = -j(1)*a(3) - 0.5_wp*l1*(sin(q(3))*(lambda(1) - lambda(3)) - cos(q(3))*(lambda(2) - lambda(4)))
      end associate
   end subroutine driven_exact
end module dynstep_driven_crank
