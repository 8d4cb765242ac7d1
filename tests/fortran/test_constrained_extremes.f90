! SPDX-License-Identifier: BSD-3-Clause
!> Constrained motion at its limits: steps, springs and masses of extreme size, rest, redundant and contradicting
!> constraints, starts off the constraints, trials that are thrown away, procedures that fail.
module test_constrained_extremes
   use dynstep, only: control_type, integrate, kind_diagonal, matrix_type, mechanical_system, state_type, status_type, wp
   use dynstep_rod_chain, only: rod_chain
   use dynstep_rod_pendulum, only: rod_pendulum
   use dynstep_slider_crank, only: slider_crank
   use dynstep_soi2, only: soi2_stepper
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_constrained_extremes

   real(wp), parameter :: eps = epsilon(1.0_wp)
   real(wp), parameter :: pi = acos(-1.0_wp)

   !> (2 + sin 3t) q'' = -(1 + t) q + load, whose solution is sin(t)
   type, extends(mechanical_system) :: heavier_system
   contains
      procedure :: force => heavier_force
      procedure :: mass => heavier_mass
      procedure :: tangent => heavier_tangent
   end type heavier_system

contains

   subroutine collect_constrained_extremes(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('mechanisms at rest', test_rest), &
         & new_unittest('linear forces, mass of time', test_linear_mass)]
   end subroutine collect_constrained_extremes

   recursive subroutine heavier_force(self, t, q, v, f, ierr)
      class(heavier_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = (1.0_wp + t)*(sin(t) - q) - (2.0_wp + sin(3.0_wp*t))*sin(t)
   end subroutine heavier_force

   recursive subroutine heavier_mass(self, t, q, v, mass, ierr)
      class(heavier_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a = 2.0_wp + sin(3.0_wp*t)
   end subroutine heavier_mass

   recursive subroutine heavier_tangent(self, t, q, v, a, k, c, ierr)
      class(heavier_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      k%a = 1.0_wp + t
   end subroutine heavier_tangent

   !> Steps of one length from y at t = 0
   subroutine run(stepper, sys, y, h, t_end, state, status)
      type(soi2_stepper), intent(inout) :: stepper
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: y(:), h, t_end
      type(state_type), intent(out) :: state
      type(status_type), intent(inout) :: status
      type(control_type) :: control
      allocate (state%y, source=y)
      control%h = h
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, t_end, control, status)
   end subroutine run

   !> Hanging straight down: velocities are rounding errors, and corrections of them need not shrink
   subroutine test_rest(error)
      type(error_type), allocatable, intent(out) :: error
      type(rod_pendulum) :: pendulum
      type(rod_chain) :: chain
      type(slider_crank) :: crank
      real(wp) :: y(120)
      integer :: i
      call pendulum%setup()
      call pendulum%start(1.5_wp*pi, 0.0_wp, y(1:3), y(4:6))
      call stays('pendulum', pendulum, y(1:6))
      y(1:6) = [0.0_wp, -2.0_wp, 1.5_wp*pi, 0.0_wp, 0.0_wp, 0.0_wp]
      call stays('pendulum, rounded', pendulum, y(1:6))
      do i = 1, 20, 3
         call hang(i)
      end do
      crank%gravity = 9.81_wp
      call crank%setup()
      call start_crank()
      call stays('slider-crank', crank, y(1:18))

   contains

      subroutine hang(rods)
         integer, intent(in) :: rods
         type(status_type) :: status
         call chain%setup(rods, status)
         call chain%start(spread(-0.5_wp*pi, 1, rods), spread(0.0_wp, 1, rods), y(1:3*rods), y(3*rods + 1:6*rods))
         call stays('chain', chain, y(1:6*rods))
      end subroutine hang

      subroutine start_crank()
         type(status_type) :: status
         call crank%start(-0.5_wp*pi, 0.0_wp, y(1:9), y(10:18), status)
      end subroutine start_crank

      !> Gravity turned by the rounding of the angle, 10 eps, moves by less than g t^2/2 of that
      subroutine stays(name, sys, y)
         character(len=*), intent(in) :: name
         class(mechanical_system), intent(inout) :: sys
         real(wp), intent(in) :: y(:)
         type(soi2_stepper) :: stepper
         type(state_type) :: state
         type(status_type) :: status
         real(wp) :: h
         integer :: k
         do k = 1, 3
            h = 10.0_wp**(-k)
            call status%clear()
            call run(stepper, sys, y, h, 1.0_wp, state, status)
            call check(error, status%code, 0, name//': '//trim(status%message))
            call check(error, maxval(abs(state%y - y)) <= 50.0_wp*eps*maxval(abs(y)), name//' moves')
         end do
      end subroutine stays
   end subroutine test_rest

   !> Declared linear or not, the same steps: matrices of an earlier step are not taken for exact ones
   subroutine test_linear_mass(error)
      type(error_type), allocatable, intent(out) :: error
      type(heavier_system) :: sys
      type(soi2_stepper) :: stepper
      type(state_type) :: linear, general
      type(status_type) :: status
      sys%n = 1
      sys%structure%mass = kind_diagonal
      sys%structure%mass_is_constant = .false.
      sys%structure%tangent = kind_diagonal
      call run(stepper, sys, [0.0_wp, 1.0_wp], 1.0_wp/16, 2.0_wp, general, status)
      sys%structure%force_is_linear = .true.
      call run(stepper, sys, [0.0_wp, 1.0_wp], 1.0_wp/16, 2.0_wp, linear, status)
      call check(error, status%code, 0, trim(status%message))
      call check(error, maxval(abs(linear%y - general%y)), 0.0_wp, 'y', thr=100*eps)
      call check(error, linear%a(1), general%a(1), 'a', thr=1.0e4_wp*eps)
   end subroutine test_linear_mass
end module test_constrained_extremes
