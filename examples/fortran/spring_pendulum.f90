! SPDX-License-Identifier: BSD-3-Clause
!> A system with constraints of one's own: the pendulum (16) of Jay & Negrut (2008), a rod on a pin with a
!> spring and a damper, q = (x, y, theta) of its centre.
module spring_pendulum_model
   use dynstep
   implicit none
   private

   real(wp), parameter, public :: hanging = 1.5_wp*acos(-1.0_wp)

   type, extends(mechanical_system), public :: spring_pendulum
      real(wp) :: m = 5.0_wp, l = 2.0_wp                 !! mass, half of the length
      real(wp) :: k = 3000.0_wp, c = 100.0_wp            !! spring and damper
   contains
      procedure :: mass => pendulum_mass
      procedure :: force => pendulum_force
      procedure :: constraint => pendulum_constraint
      procedure :: constraint_jacobian => pendulum_constraint_jacobian
   end type spring_pendulum

contains

   recursive subroutine pendulum_mass(self, t, q, v, mass, ierr)
      class(spring_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = self%m*[1.0_wp, 1.0_wp, self%l**2/3.0_wp]
   end subroutine pendulum_mass

   !> All forces but those of the pin
   recursive subroutine pendulum_force(self, t, q, v, f, ierr)
      class(spring_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = [0.0_wp, -9.81_wp*self%m, -self%c*v(3) - self%k*(q(3) - hanging)]
   end subroutine pendulum_force

   !> The end of the rod stays at the origin
   recursive subroutine pendulum_constraint(self, t, q, g, ierr)
      class(spring_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g = [q(1) - self%l*cos(q(3)), q(2) - self%l*sin(q(3))]
   end subroutine pendulum_constraint

   !> Optional: G = dg/dq and dg/dt, both zero on entry.  Without it they are taken by differences.
   recursive subroutine pendulum_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(spring_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      call gq%set_entry(1, 1, 1.0_wp)
      call gq%set_entry(1, 3, self%l*sin(q(3)))
      call gq%set_entry(2, 2, 1.0_wp)
      call gq%set_entry(2, 3, -self%l*cos(q(3)))
   end subroutine pendulum_constraint_jacobian
end module spring_pendulum_model

program spring_pendulum_example
   use dynstep
   use spring_pendulum_model, only: hanging, spring_pendulum
   implicit none
   type(spring_pendulum) :: sys
   type(soi2_stepper) :: stepper                        ! rho_inf = 0.8
   type(state_type) :: state
   type(status_type) :: status
   character(len=finding_length), allocatable :: report(:)
   real(wp), parameter :: theta = 4.727778699883551140_wp, lambda(2) = [10.452452281527414_wp, -49.281944209304489_wp]
   real(wp) :: g(2), gv(2), drift, error(2, 2)
   integer :: i, j, ierr

   sys%n = 3
   sys%holonomic = 2
   sys%structure%mass = kind_diagonal
   call check_system(sys, 0.0_wp, [0.3_wp, -1.0_wp, 4.0_wp], [1.0_wp, 2.0_wp, 3.0_wp], report, status)
   if (status%failed()) print '(a)', report             ! each line names an entry
   drift = 0.0_wp
   do j = 1, 2                                          ! h = 1/500, then half of it
      call stepper%init(sys, status)
      state%t = 0.0_wp
      state%y = [0.0_wp, -sys%l, hanging, 10.0_wp*sys%l, 0.0_wp, 10.0_wp]
      call stepper%start(sys, state, status)            ! a0, lambda0; moves q and v onto the constraints
      if (j == 1) print '(a5, a12, 2a13, 2a10)', 't', 'theta', 'lambda(1)', 'lambda(2)', '|g|', '|G v|'
      do i = 0, 10
         if (i > 0) call integrate(stepper, sys, state, 0.2_wp*i, control_type(h=0.004_wp/2**j, every=0), status)
         if (status%failed()) then
            print '(a)', trim(status%message)
            stop 1
         end if
         associate (q => state%y(:3), v => state%y(4:))
            call sys%constraint(state%t, q, g, ierr)
            gv = [v(1) + sys%l*sin(q(3))*v(3), v(2) - sys%l*cos(q(3))*v(3)]
            drift = max(drift, maxval(abs(g)), maxval(abs(gv)))
            if (j == 1) print '(f5.1, f12.6, 2f13.6, 2es10.1)', state%t, q(3), state%lambda, maxval(abs(g)), maxval(abs(gv))
         end associate
      end do
      error(:, j) = [abs(state%y(3) - theta), maxval(abs(state%lambda - lambda))]
      print '(a, f10.7, a, 2es9.1)', 'h =', 0.004_wp/2**j, ': errors of theta and lambda', error(:, j)
   end do
   ! second order: half the step, a fourth of the error; g and G v at round-off
   if (any(error(:, 2) > error(:, 1)/3.8_wp) .or. drift > 1.0e-13_wp) stop 1
end program spring_pendulum_example
