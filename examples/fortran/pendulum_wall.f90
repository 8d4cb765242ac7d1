! SPDX-License-Identifier: BSD-3-Clause
!> A pendulum in Cartesian coordinates that hits a wall: an impact on a system with a constraint.  The wall pushes with an
!> impulse p along its normal, and the rod answers with another one along G^T, so that the rod keeps its length:
!>
!>    M (v+ - v-) = n p + G^T r,   G v+ = 0,   n.v+ = -e n.v-
module pendulum_wall_model
   use dynstep
   implicit none
   private

   real(wp), parameter, public :: gravity = 9.81_wp, length = 1.0_wp, m = 2.0_wp

   type, extends(mechanical_system), public :: point_pendulum
   contains
      procedure :: mass => pendulum_mass
      procedure :: force => pendulum_force
      procedure :: constraint => pendulum_constraint
   end type point_pendulum

   type, extends(event_type), public :: wall
      real(wp) :: x = -0.3_wp, restitution = 0.8_wp
   contains
      procedure :: values => wall_distance
      procedure :: act => wall_impact
   end type wall

contains

   recursive subroutine pendulum_mass(self, t, q, v, mass, ierr)
      class(point_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = m
   end subroutine pendulum_mass

   recursive subroutine pendulum_force(self, t, q, v, f, ierr)
      class(point_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = [0.0_wp, -m*gravity]
   end subroutine pendulum_force

   recursive subroutine pendulum_constraint(self, t, q, g, ierr)
      class(point_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g = 0.5_wp*(q(1)**2 + q(2)**2 - length**2)        ! G = (x, y)
   end subroutine pendulum_constraint

   recursive subroutine wall_distance(self, t, y, s, ierr)
      class(wall), intent(inout) :: self
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      s = y(1) - self%x
   end subroutine wall_distance

   recursive subroutine wall_impact(self, i, sys, state, changed, ierr)
      class(wall), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: changed
      integer, intent(out) :: ierr
      real(wp), parameter :: normal(2) = [1.0_wp, 0.0_wp]
      real(wp) :: along(2)
      ierr = 0
      changed = .true.
      associate (g => state%y(1:2), v => state%y(3:4))  ! G = q here
         ! v that the impulse of the wall and the answer of the rod make: M^-1 (n + G^T r/p) with G along = 0
         along = (normal - g*dot_product(g, normal/m)/dot_product(g, g/m))/m
         v = v - (1.0_wp + self%restitution)*dot_product(normal, v)/dot_product(normal, along)*along
      end associate
   end subroutine wall_impact
end module pendulum_wall_model

program pendulum_wall
   use dynstep
   use pendulum_wall_model, only: gravity, length, m, point_pendulum, wall
   implicit none
   type(point_pendulum) :: sys
   type(wall) :: event
   type(soi2_stepper) :: stepper
   type(step_control_type) :: control
   type(controlled_run_type) :: run
   type(trajectory_type) :: path
   type(state_type) :: state
   type(status_type) :: status
   real(wp), parameter :: start = acos(-1.0_wp)/3.0_wp, omega = sqrt(gravity/length)
   real(wp) :: k2, wall2, t, drift, errors(3, 2)
   integer :: i, j

   sys%n = 2
   sys%holonomic = 1
   sys%structure%mass = kind_diagonal
   event%direction = [-1]
   wall2 = sin(0.5_wp*asin(event%x/length))**2
   errors = 0.0_wp
   drift = 0.0_wp
   do j = 1, 2
      control%rtol = 100.0_wp**(-2 - j)
      control%atol = [control%rtol]
      path%count = 0
      call stepper%init(sys, status)
      state%t = 0.0_wp
      state%y = [length*sin(start), -length*cos(start), 0.0_wp, 0.0_wp]
      call stepper%start(sys, state, status)
      call run%begin(stepper, sys, state, 6.0_wp, control, status)
      call run%proceed(stepper, sys, state, status, path, events=event)
      if (status%failed()) then
         print '(a)', trim(status%message)
         stop 1
      end if

      k2 = sin(0.5_wp*start)**2                         ! sin(angle/2)^2 at the top
      t = 0.5_wp*flight(k2)
      if (j == 1) print '(a8, 2a12)', 'impact', 't', 'speed'
      do i = 1, run%log%count
         associate (speed => norm2(run%log%y(3:4, i)))
            if (j == 1) print '(i8, 2f12.6)', i, run%log%t(i), speed
            errors(1:2, j) = max(errors(1:2, j), abs([run%log%t(i) - t, speed - 2.0_wp*omega*length*sqrt(k2 - wall2)]))
         end associate
         k2 = wall2 + event%restitution**2*(k2 - wall2) ! an impact leaves e^2 of the energy above the wall
         t = t + flight(k2)
      end do
      errors(3, j) = abs(m*(0.5_wp*sum(state%y(3:4)**2) + gravity*(state%y(2) + length)) - 2.0_wp*m*gravity*length*k2)
      do i = 1, path%count
         associate (q => path%y(1:2, i), v => path%y(3:4, i))
            drift = max(drift, 0.5_wp*abs(sum(q**2) - length**2), abs(dot_product(q, v)))
         end associate
      end do
      print '(a, es7.1, a, i5, a, 3es8.1)', 'rtol = ', control%rtol, ':', path%count, &
         & ' points, errors of times, speeds, energy', errors(:, j)
   end do
   print '(a, es8.1)', 'g and G v up to', drift
   ! order 2 and estimates of order 3: errors fall as rtol^(2/3), here by 21.5; G by differences is right to 1e-12
   if (run%log%count /= 4 .or. any(errors(:, 2) > errors(:, 1)/18.0_wp) .or. drift > 1.0e-12_wp) stop 1

contains

   !> Time from wall to wall: an elliptic integral, by Simpson's rule
   real(wp) function flight(k2)
      real(wp), intent(in) :: k2
      integer, parameter :: n = 200
      real(wp) :: begin, step
      integer :: j
      begin = -asin(sqrt(wall2/k2))
      step = (0.5_wp*acos(-1.0_wp) - begin)/real(n, wp)
      flight = 0.0_wp
      do j = 0, n
         flight = flight + merge(1, merge(2, 4, mod(j, 2) == 0), j == 0 .or. j == n)/sqrt(1.0_wp - k2*sin(begin + j*step)**2)
      end do
      flight = 2.0_wp/omega*flight*step/3.0_wp
   end function flight
end program pendulum_wall
