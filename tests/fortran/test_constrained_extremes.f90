! SPDX-License-Identifier: BSD-3-Clause
!> Constrained motion at its limits: steps, springs and masses of extreme size, rest, redundant and contradicting
!> constraints, starts off the constraints, trials that are thrown away, procedures that fail.
module test_constrained_extremes
   use dynstep, only: coefficients_of, control_type, dynstep_inconsistent_start, dynstep_invalid_input, integrate, &
      & kind_diagonal, matrix_type, mechanical_system, start_keep, start_project, start_refuse, state_type, status_type, &
      & variant_index3, wp
   use dynstep_jay_negrut_problem, only: jay_negrut_problem
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
         & new_unittest('linear forces, mass of time', test_linear_mass), &
         & new_unittest('options changed after init', test_changed_options), &
         & new_unittest('starts off the constraints', test_starts_off), &
         & new_unittest('nearest start', test_nearest_start)]
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

   !> `init` takes coefficients, variant and Newton's options over: a change afterwards is refused, as by Newmark
   subroutine test_changed_options(error)
      type(error_type), allocatable, intent(out) :: error
      type(rod_pendulum) :: sys
      type(soi2_stepper) :: fresh, stepper
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      call sys%setup()
      allocate (state%y(6))
      call sys%start(4.0_wp, 1.0_wp, state%y(1:3), state%y(4:6))
      call fresh%init(sys, status)
      do i = 1, 6
         stepper = fresh
         call status%clear()
         select case (i)
         case (1)
            call coefficients_of(0.5_wp, stepper%coefficients, status)
         case (2)
            stepper%variant = variant_index3
         case (3)
            stepper%newton%limit = 7
         case (4)
            stepper%newton%tolerance = 1.0e-6_wp
         case (5)
            stepper%mass_at = 3
         case (6)
            stepper%start_mode = 0
         end select
         call stepper%start(sys, state, status)
         call check(error, status%code, dynstep_invalid_input, 'option '//achar(48 + i)//' '//trim(status%message))
         if (i <= 4) call check(error, index(status%message, 'init') > 0, trim(status%message))
         call check(error, .not. stepper%is_started, 'started')
      end do
   end subroutine test_changed_options

   !> All three ways to take a start that is off both levels of the constraints
   subroutine test_starts_off(error)
      type(error_type), allocatable, intent(out) :: error
      type(rod_pendulum) :: sys
      type(soi2_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: y(6), g(2)
      integer :: mode, ierr
      call sys%setup()
      call sys%start(4.0_wp, 3.0_wp, y(1:3), y(4:6))
      y(1:2) = y(1:2) + [0.01_wp, -0.02_wp]
      y(4:5) = y(4:5) + [0.1_wp, 0.2_wp]
      do mode = start_project, start_keep
         state = state_type()
         allocate (state%y, source=y)
         call status%clear()
         stepper%start_mode = mode
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         call check(error, stepper%report%g, 0.02_wp, 'g', thr=10*eps)
         if (mode == start_refuse) then
            call check(error, status%code, dynstep_inconsistent_start, 'refused')
            call check(error, maxval(abs(state%y - y)), 0.0_wp, 'moved by a refusal', thr=0.0_wp)
            cycle
         end if
         call check(error, status%code, 0, trim(status%message))
         call sys%constraint(0.0_wp, state%y(1:3), g, ierr)
         if (mode == start_keep) then
            ! G does not depend on x and y: g' is off by what was added to v
            call check(error, stepper%report%gv, 0.2_wp, 'g''', thr=50*eps)
            call check(error, maxval(abs(state%y - y)), 0.0_wp, 'moved', thr=0.0_wp)
         else
            call check(error, maxval(abs(g)) <= 10*eps, 'g of the projected start')
            call check(error, stepper%report%moved_q, maxval(abs(state%y(1:3) - y(1:3))), 'moved_q')
            call check(error, stepper%report%moved_v, maxval(abs(state%y(4:6) - y(4:6))), 'moved_v')
         end if
      end do
   end subroutine test_starts_off

   !> The projection is the nearest point in the norm of M: M (q - q0) is normal to the constraints there, M (v - v0)
   !> too.  The pendulum has one direction along them.
   subroutine test_nearest_start(error)
      type(error_type), allocatable, intent(out) :: error
      type(rod_pendulum) :: pendulum
      type(jay_negrut_problem) :: problem
      type(soi2_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: y(6), along(3), m(3)
      integer :: i
      call pendulum%setup()
      m = pendulum%m*[1.0_wp, 1.0_wp, pendulum%l**2/3.0_wp]
      do i = 1, 4
         call pendulum%start(4.0_wp, 3.0_wp, y(1:3), y(4:6))
         y = y + 10.0_wp**(-i)*[3.0_wp, 4.0_wp, -2.0_wp, 5.0_wp, 1.0_wp, -3.0_wp]
         state = state_type()
         allocate (state%y, source=y)
         call stepper%init(pendulum, status)
         call stepper%start(pendulum, state, status)
         call check(error, status%code, 0, trim(status%message))
         along = [-state%y(2), state%y(1), 1.0_wp]
         ! a start ends where corrections are below 100 eps of q
         call check(error, dot_product(along, m*(state%y(1:3) - y(1:3))), 0.0_wp, 'q', thr=1.0e3_wp*eps*maxval(m))
         call check(error, dot_product(along, m*(state%y(4:6) - y(4:6))), 0.0_wp, 'v', thr=1.0e3_wp*eps*maxval(m))
      end do
      ! g and k of (15) are nonlinear in q and v and leave no direction free: on them, and no more
      call problem%setup()
      state = state_type()
      state%y = [1.05_wp, 0.97_wp, 1.1_wp, -2.2_wp]
      call stepper%init(problem, status)
      state%lambda = [1.0_wp]
      state%psi = [1.0_wp]
      call stepper%start(problem, state, status)
      call check(error, status%code, 0, trim(status%message))
      associate (q => state%y(1:2), v => state%y(3:4))
         call check(error, q(1)**2*q(2), 1.0_wp, 'g of (15)')
         call check(error, q(1)*v(1)*v(2), -2.0_wp, 'k of (15)')
         call check(error, 2*q(1)*q(2)*v(1) + q(1)**2*v(2), 0.0_wp, 'g'' of (15)')
      end associate
   end subroutine test_nearest_start
end module test_constrained_extremes
