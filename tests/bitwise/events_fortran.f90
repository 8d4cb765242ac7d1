! SPDX-License-Identifier: BSD-3-Clause
!> The problem with events of README.md by the Fortran modules.
module events_systems
   use dynstep, only: event_type, mechanical_system, ode_system, state_type, wp
   implicit none
   private

   type, extends(mechanical_system), public :: springs_type
   contains
      procedure :: force => springs_force
      procedure :: switch_values => springs_switches
   end type springs_type

   !> A wall, and the turning point of the second mass
   type, extends(event_type), public :: wall_type
   contains
      procedure :: values => wall_values
      procedure :: act => wall_act
   end type wall_type

contains

   recursive subroutine springs_force(self, t, q, v, f, ierr)
      class(springs_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = ((0.0_wp - q(1)*(1.0_wp + q(1)*q(1))) + 0.5_wp*(q(2) - q(1))) - 0.125_wp*v(1)
      f(2) = (0.0_wp - 2.0_wp*q(2)) - 0.5_wp*(q(2) - q(1))
      if (self%side(1) > 0) f(2) = f(2) - 4.0_wp*(q(2) - 0.125_wp)
   end subroutine springs_force

   recursive subroutine springs_switches(self, t, y, s, ierr)
      class(springs_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      s(1) = y(2) - 0.125_wp
   end subroutine springs_switches

   recursive subroutine wall_values(self, t, y, s, ierr)
      class(wall_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      s(1) = y(1) + 0.25_wp
      s(2) = y(4)
   end subroutine wall_values

   recursive subroutine wall_act(self, i, sys, state, changed, ierr)
      class(wall_type), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: changed
      integer, intent(out) :: ierr
      ierr = 0
      changed = i == 1
      if (changed) state%y(3) = -(0.5_wp*state%y(3))
   end subroutine wall_act
end module events_systems

program events_fortran
   use dynstep, only: allocate_state, controlled_run_type, new_method, state_type, status_type, step_control_type, stepper_type, &
      & trajectory_type, wp
   use events_systems, only: springs_type, wall_type
   implicit none
   character(len=8) :: argument

   call get_command_argument(1, argument)
   call solve('f', .false., 'newmark-extrapolation')
   call solve('f', .false., 'bi')
   ! FORTRAN 77 has no switches
   if (argument /= 'f') call solve('g', .true., 'newmark-extrapolation')

contains

   subroutine solve(problem, has_switch, method)
      character(len=*), intent(in) :: problem, method
      logical, intent(in) :: has_switch
      type(springs_type) :: sys
      type(wall_type) :: events
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(trajectory_type) :: points
      type(status_type) :: status
      type(step_control_type) :: control
      type(controlled_run_type) :: run
      integer :: i

      sys%n = 2
      sys%side = [-1]
      if (has_switch) sys%switches = 1
      events%count = 2
      events%direction = [-1, 0]
      control%rtol = 1.0e-8_wp
      control%atol = [1.0e-9_wp, 1.0e-9_wp, 1.0e-7_wp, 1.0e-8_wp]
      call new_method(method, stepper, status)
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      state%t = 0.0_wp
      state%y = [1.0_wp, 0.0_wp, 0.0_wp, 0.5_wp]
      call stepper%start(sys, state, status)
      call run%begin(stepper, sys, state, 6.0_wp, control, status)
      call run%proceed(stepper, sys, state, status, points, events=events)
      if (status%failed()) error stop 1
      do i = 1, points%count
         write (*, '(a, 1x, a, 99(1x, z16.16))') problem, 'point', points%t(i), points%y(:, i), points%a(:, i)
      end do
      do i = 1, run%log%count
         write (*, '(a, 1x, a, i0, 99(1x, z16.16))') problem, 'event', run%log%which(i), run%log%t(i), run%log%y(:, i)
      end do
   end subroutine solve
end program events_fortran
