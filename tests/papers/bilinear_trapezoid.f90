! SPDX-License-Identifier: BSD-3-Clause
!> The trapezoidal rule for the bilinear spring, split where the trapezoid itself reaches the
!> end of a zone: the rule behind Austin's Tables 9 and 10, and an example of a user's own
!> method as the base of an extrapolation.
!>
!> In a zone F = s (x - c) is linear, and a step of length h is
!>
!>   (m + h^2/4 s) dx = m (h v0 + h^2/2 a0),  x1 = x0 + dx,  a1 = -s (x1 - c)/m,
!>   v1 = v0 + h/2 (a0 + a1),
!>
!> which keeps the energy of the zone exactly.  Where x1 lies beyond the zone's end e, the
!> part h' of the step that ends on x = e solves the quadratic equation
!>
!>   e - x0 = h' v0 + h'^2/4 (a0 + a(e)),
!>
!> and the rest of the step is made in the next zone.
module bilinear_trapezoid
   use dynstep_bilinear_spring, only: bilinear_spring
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_converged, status_type
   use dynstep_stepper, only: method_properties, state_type, stepper_type
   implicit none
   private

   type, extends(stepper_type), public :: bilinear_trapezoid_stepper
   contains
      procedure :: properties
      procedure :: init
      procedure :: start
      procedure :: try_step
   end type bilinear_trapezoid_stepper

   !> Zones that one step may cross; the paper's run crosses one
   integer, parameter :: most_crossings = 100

contains

   function properties(self) result(facts)
      class(bilinear_trapezoid_stepper), intent(in) :: self
      type(method_properties) :: facts
      facts%name = 'bilinear-trapezoid'
      facts%source = 'Austin 1991, Counter Example 4'
      facts%order = 2
      facts%acceleration_order = 2
      facts%symmetric = .true.
      facts%mechanical = .true.
   end function properties

   recursive subroutine init(self, sys, status)
      class(bilinear_trapezoid_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      select type (sys)
      class is (bilinear_spring)
         return
      class default
         call status%set(dynstep_invalid_input, 'this method steps a bilinear_spring and nothing else')
      end select
   end subroutine init

   recursive subroutine start(self, sys, state, status)
      class(bilinear_trapezoid_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      call self%reset()
      select type (sys)
      class is (bilinear_spring)
         state%a(1) = acceleration(sys, sys%zone(state%y(1), state%y(2)), state%y(1))
      end select
   end subroutine start

   recursive subroutine try_step(self, sys, state, h, t1, trial, status)
      class(bilinear_trapezoid_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      trial%t = t1
      trial%y = state%y
      select type (sys)
      class is (bilinear_spring)
         call split_step(sys, h, trial%y(1), trial%y(2), trial%a(1), status)
      end select
   end subroutine try_step

   !> A step of length h in place, zone by zone
   pure subroutine split_step(sys, h, x, v, a, status)
      type(bilinear_spring), intent(in) :: sys
      real(wp), intent(in) :: h
      real(wp), intent(inout) :: x, v
      real(wp), intent(out) :: a
      type(status_type), intent(inout) :: status
      real(wp) :: left, part, dx, edge, edge_a, stiffness, centre
      integer :: crossing, zone

      left = h
      do crossing = 0, most_crossings
         zone = sys%zone(x, sign(1.0_wp, h)*v)
         call sys%zone_law(zone, stiffness, centre)
         a = acceleration(sys, zone, x)
         dx = (left*v + 0.5_wp*left**2*a)/(1.0_wp + 0.25_wp*left**2*stiffness/sys%m)
         edge = nearest_edge(zone, x + dx)
         if (abs(edge) <= 0.0_wp) then
            v = v + 0.5_wp*left*(2.0_wp*a - stiffness*dx/sys%m)
            x = x + dx
            a = acceleration(sys, zone, x)
            return
         end if
         edge_a = acceleration(sys, zone, edge)
         part = first_root(0.25_wp*(a + edge_a), v, x - edge, left)
         v = v + 0.5_wp*part*(a + edge_a)
         x = edge
         left = left - part
      end do
      call status%set(dynstep_not_converged, 'the spring crosses too many zones in one step; reduce h', retry=.true.)
   end subroutine split_step

   pure real(wp) function acceleration(sys, zone, x)
      type(bilinear_spring), intent(in) :: sys
      integer, intent(in) :: zone
      real(wp), intent(in) :: x
      real(wp) :: stiffness, centre
      call sys%zone_law(zone, stiffness, centre)
      acceleration = -stiffness*(x - centre)/sys%m
   end function acceleration

   !> The end (-1 or 1) of a zone that x lies beyond; 0 where it lies in the zone
   pure real(wp) function nearest_edge(zone, x)
      integer, intent(in) :: zone
      real(wp), intent(in) :: x
      nearest_edge = 0.0_wp
      if (zone <= 0 .and. x > 2*zone + 1) nearest_edge = real(2*zone + 1, wp)
      if (zone >= 0 .and. x < 2*zone - 1) nearest_edge = real(2*zone - 1, wp)
   end function nearest_edge

   !> The first root of a s^2 + b s + c = 0 on the way from 0 to `length`, without cancellation
   pure real(wp) function first_root(a, b, c, length)
      real(wp), intent(in) :: a, b, c, length
      real(wp) :: q, roots(2)
      q = -0.5_wp*(b + sign(sqrt(max(b**2 - 4.0_wp*a*c, 0.0_wp)), b))
      roots = length
      if (abs(q) > 0.0_wp) roots(1) = c/q
      if (abs(a) > 0.0_wp) roots(2) = q/a
      first_root = length
      if (roots(1)/length > 0.0_wp) first_root = roots(1)
      if (roots(2)/length > 0.0_wp .and. abs(roots(2)) < abs(first_root)) first_root = roots(2)
   end function first_root
end module bilinear_trapezoid
