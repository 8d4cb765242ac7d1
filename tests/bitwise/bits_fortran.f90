! SPDX-License-Identifier: BSD-3-Clause
!> The problems of README.md by the Fortran modules.
module bits_systems
   use dynstep, only: linear_system, matrix_type, mechanical_system, wp
   implicit none
   private

   type, extends(linear_system), public :: chain_type
   contains
      procedure :: load => chain_load
   end type chain_type

   type, extends(mechanical_system), public :: pendulum_type
   contains
      procedure :: force => pendulum_force
      procedure :: mass => pendulum_mass
   end type pendulum_type

contains

   recursive subroutine chain_load(self, t, p, ierr)
      class(chain_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      integer :: i
      ierr = 0
      do i = 1, self%n
         p(i) = i*(t - (0.25_wp*t)*t)
      end do
   end subroutine chain_load

   recursive subroutine pendulum_force(self, t, q, v, f, ierr)
      class(pendulum_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      real(wp) :: d
      ierr = 0
      d = q(1) - q(2)
      f(1) = ((0.0_wp - 4.0_wp*(q(1) - ((q(1)*q(1))*q(1))/6.0_wp)) - ((0.25_wp*d)*v(2))*v(2)) - 0.125_wp*v(1)
      f(2) = ((0.0_wp - 2.0_wp*(q(2) - ((q(2)*q(2))*q(2))/6.0_wp)) + ((0.25_wp*d)*v(1))*v(1)) - 0.125_wp*v(2)
   end subroutine pendulum_force

   recursive subroutine pendulum_mass(self, t, q, v, mass, ierr)
      class(pendulum_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      real(wp) :: c, d
      ierr = 0
      d = q(1) - q(2)
      c = 1.0_wp - (0.5_wp*d)*d
      mass%a = reshape([2.0_wp, c, c, 1.5_wp], [2, 2])
   end subroutine pendulum_mass
end module bits_systems

program bits_fortran
   use bits_systems, only: chain_type, pendulum_type
   use dynstep, only: allocate_state, banded_matrix, control_type, diagonal_matrix, integrate, kind_dense, &
      & load_procedure, mechanical_system, new_method, state_type, status_type, stepper_type, trajectory_type, wp
   implicit none

   real(wp), parameter :: band(3, 3) = reshape([0.0_wp, 3.0_wp, -1.0_wp, -1.0_wp, 2.0_wp, -1.0_wp, -1.0_wp, 2.0_wp, &
      & 0.0_wp], [3, 3])
   type(chain_type) :: chain
   type(pendulum_type) :: pendulum
   type(status_type) :: status

   call chain%set(diagonal_matrix([2.0_wp, 1.0_wp, 1.0_wp]), banded_matrix(0.0625_wp*band, 1, 1, .true.), &
      & banded_matrix(band, 1, 1, .true.), status)
   chain%load_kind = load_procedure
   if (status%failed()) error stop 1
   call all_runs('a', chain, [1.0_wp, 0.0_wp, -0.5_wp, 0.0_wp, 0.25_wp, 0.0_wp])

   pendulum%n = 2
   pendulum%structure%mass = kind_dense
   pendulum%structure%mass_is_constant = .false.
   call all_runs('b', pendulum, [1.0_wp, -0.5_wp, 0.0_wp, 0.25_wp])

contains

   subroutine all_runs(problem, sys, y)
      character(len=*), intent(in) :: problem
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: y(:)
      type(control_type) :: control
      call one_run(problem, 'newmark', 'newmark', sys, y, control)
      call one_run(problem, 'extrapolation', 'newmark-extrapolation', sys, y, control)
      control%t_eval = [0.1_wp, 0.11_wp, 0.5_wp, 1.99_wp]
      call one_run(problem, 'times', 'newmark', sys, y, control)
   end subroutine all_runs

   subroutine one_run(problem, name, method, sys, y, control)
      character(len=*), intent(in) :: problem, name, method
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: y(:)
      type(control_type), intent(inout) :: control
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(trajectory_type) :: points
      integer :: i

      call new_method(method, stepper, status)
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      state%t = 0.0_wp
      state%y = y
      control%h = 1.0_wp/32.0_wp
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, 2.0_wp, control, status, points)
      if (status%failed()) error stop 1
      do i = 1, points%count
         write (*, '(a, 1x, a, 99(1x, z16.16))') problem, name, points%t(i), points%y(:, i), points%a(:, i)
      end do
   end subroutine one_run
end program bits_fortran
