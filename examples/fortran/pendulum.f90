! SPDX-License-Identifier: BSD-3-Clause
!> A model of one's own: the plane pendulum q'' = -(g/l) sin q - c q'.
module pendulum_model
   use dynstep
   implicit none
   private

   type, extends(mechanical_system), public :: pendulum
      real(wp) :: g = 9.81_wp            !! gravity, m/s^2
      real(wp) :: l = 1.0_wp             !! length, m
      real(wp) :: c = 0.0_wp             !! damping, 1/s
   contains
      procedure :: force => pendulum_force
      procedure :: tangent => pendulum_tangent
      procedure :: energy => pendulum_energy
   end type pendulum

contains

   !> All that has to be given.  The names of the arguments are those of the library.
   recursive subroutine pendulum_force(self, t, q, v, f, ierr)
      class(pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = -(self%g/self%l)*sin(q(1)) - self%c*v(1)
   end subroutine pendulum_force

   !> Optional: K = -df/dq and C = -df/dv.  Without it they are taken by differences.
   recursive subroutine pendulum_tangent(self, t, q, v, a, k, c, ierr)
      class(pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      call k%set_entry(1, 1, (self%g/self%l)*cos(q(1)))
      call c%set_entry(1, 1, self%c)
   end subroutine pendulum_tangent

   !> Optional: here per mass and length squared
   recursive subroutine pendulum_energy(self, t, q, v, energy, ierr)
      class(pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      ierr = 0
      energy = 0.5_wp*v(1)**2 + (self%g/self%l)*(1.0_wp - cos(q(1)))
   end subroutine pendulum_energy
end module pendulum_model

program pendulum_example
   use dynstep
   use pendulum_model, only: pendulum
   implicit none
   type(pendulum) :: sys
   type(extrapolation_stepper) :: stepper
   type(state_type) :: state
   type(trajectory_type) :: path
   type(status_type) :: status
   character(len=finding_length), allocatable :: report(:)
   real(wp) :: energy
   integer :: i, ierr

   sys%n = 1
   sys%structure%tangent = kind_diagonal
   sys%structure%has_energy = .true.
   call check_system(sys, 0.0_wp, [1.0_wp], [0.5_wp], report, status)
   if (status%failed()) print '(a)', report        ! each line names an entry
   allocate (newmark_stepper :: stepper%base)
   call stepper%init(sys, status)
   state%y = [3.0_wp, 0.0_wp]                      ! nearly upright, at rest
   call stepper%start(sys, state, status)
   call integrate(stepper, sys, state, 4.0_wp, control_type(h=0.05_wp, every=10), status, path)

   print '(4a12)', 't', 'q', 'v', 'a'
   print '(4f12.7)', (path%t(i), path%y(:, i), path%a(:, i), i=1, path%count)
   call sys%energy(state%t, state%y(:1), state%y(2:), energy, ierr)
   print '(a, es8.1)', 'change of energy: ', energy - 9.81_wp*(1.0_wp - cos(3.0_wp))
   print '(i0, a, i0, a)', stepper%count%forces, ' forces, ', stepper%count%factorizations, ' factorizations'
   if (status%failed()) print '(a)', trim(status%message)
   if (status%failed() .or. abs(energy - 9.81_wp*(1.0_wp - cos(3.0_wp))) > 1.0e-8_wp) stop 1
end program pendulum_example
