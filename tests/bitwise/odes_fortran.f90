! SPDX-License-Identifier: BSD-3-Clause
!> The first-order problem of README.md by the Fortran modules.
module odes_systems
   use dynstep, only: ode_system, wp
   implicit none
   private

   type, extends(ode_system), public :: predators_type
   contains
      procedure :: rhs => predators_rhs
   end type predators_type

contains

   recursive subroutine predators_rhs(self, t, y, f, ierr)
      class(predators_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = y(1)*(1.0_wp - y(2))
      f(self%n) = y(2)*(y(1) - 1.0_wp) + 0.125_wp*t
   end subroutine predators_rhs
end module odes_systems

program odes_fortran
   use dynstep, only: allocate_state, control_type, controller_pi, integrate, integrate_controlled, new_method, &
      & state_type, status_type, step_control_type, stepper_type, trajectory_type, wp
   use odes_systems, only: predators_type
   implicit none
   type(control_type) :: control

   control%h = 1.0_wp/32.0_wp
   call run('bi', 'bi')
   control%t_eval = [0.1_wp, 0.11_wp, 0.5_wp, 1.99_wp]
   call run('times', 'bi')
   deallocate (control%t_eval)
   call run('control', 'bi', step_control_type(tolerance=1.0e-6_wp, controller=controller_pi, &
      & h_first=0.125_wp))
   call run('bi45', 'bi45')

contains

   subroutine run(name, method, step_control)
      character(len=*), intent(in) :: name, method
      type(step_control_type), intent(in), optional :: step_control
      type(predators_type) :: sys
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(trajectory_type) :: points
      type(status_type) :: status
      integer :: i

      sys%n = 2
      call new_method(method, stepper, status)
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      state%t = 0.0_wp
      state%y = [2.0_wp, 3.0_wp]
      call stepper%start(sys, state, status)
      if (present(step_control)) then
         call integrate_controlled(stepper, sys, state, 2.0_wp, step_control, status, points)
      else
         call integrate(stepper, sys, state, 2.0_wp, control, status, points)
      end if
      if (status%failed()) error stop 1
      do i = 1, points%count
         write (*, '(a, 1x, a, 99(1x, z16.16))') 'e', name, points%t(i), points%y(:, i), points%a(:, i)
      end do
   end subroutine run
end program odes_fortran
