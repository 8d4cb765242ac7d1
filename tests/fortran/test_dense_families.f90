! SPDX-License-Identifier: BSD-3-Clause
!> Measured orders of dense output in double precision, in every component: Pade, backinterpolation and its extrapolation on
!> linear and nonlinear systems of first order and of mechanics, generalized-alpha, SOI2 with its multipliers.
!> Newmark and its extrapolations are in TEST_DENSE_ORDERS.
module test_dense_families
   use dynstep, only: allocate_state, backinterpolation_stepper, dense_matrix, dense_output_type, extrapolation_stepper, &
      & generalized_alpha_stepper, kind_dense, linear_ode, load_procedure, mechanical_system, method_properties, new_method, &
      & ode_system, pade_stepper, soi2_stepper, state_type, status_type, stepper_type, wp
   use known_motions, only: known_motion, motion_names, motions, new_motion
   use reference_problems, only: new_problem, problem_cubic, problem_linear, problem_names, qp, reference, start_q, start_v
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_dense_families

   !> y = (cos 2t, sin 2t), attracting, nonlinear
   type, extends(ode_system) :: limit_cycle
   contains
      procedure :: rhs => cycle_rhs
   end type limit_cycle

   !> y = (cos 2t, e^-t) by a source
   type, extends(linear_ode) :: forced_decay
   contains
      procedure :: source => decay_source
   end type forced_decay

   !> Places inside a step
   real(wp), parameter :: places(4) = [0.13_wp, 0.38_wp, 0.61_wp, 0.87_wp]

contains

   subroutine collect_dense_families(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('first order', test_first_order), &
         & new_unittest('mechanics', test_mechanics), &
         & new_unittest('constraints', test_constraints)]
   end subroutine collect_dense_families

   recursive subroutine cycle_rhs(self, t, y, f, ierr)
      class(limit_cycle), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = -2.0_wp*y(2) + y(1)*(1.0_wp - y(1)**2 - y(2)**2)
      f(2) = 2.0_wp*y(1) + y(2)*(1.0_wp - y(1)**2 - y(2)**2)
   end subroutine cycle_rhs

   recursive subroutine decay_source(self, t, b, ierr)
      class(forced_decay), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: b(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      b = [0.5_wp*cos(2.0_wp*t) - 2.0_wp*sin(2.0_wp*t), -0.25_wp*exp(-t)]
   end subroutine decay_source

   !> Pade(2,2), (4,4), BI(4,4), BI45 and BI extrapolated: order in y, in y' too or one less
   subroutine test_first_order(error)
      type(error_type), allocatable, intent(out) :: error
      type(forced_decay) :: linear
      type(limit_cycle) :: nonlinear
      type(status_type) :: status
      class(stepper_type), allocatable :: stepper
      integer :: levels

      call linear%set(dense_matrix(reshape([-0.5_wp, 0.0_wp, 0.0_wp, -0.75_wp], [2, 2])), status)
      linear%source_kind = load_procedure
      nonlinear%n = 2
      nonlinear%jacobian_kind = kind_dense
      call check_first_order(error, pade_stepper(p=2, q=2), linear, [8, 16])
      call check_first_order(error, pade_stepper(p=3, q=3), linear, [4, 8])
      call check_first_order(error, pade_stepper(p=4, q=4), linear, [3, 6])
      call check_first_order(error, backinterpolation_stepper(), linear, [8, 16])
      call check_first_order(error, backinterpolation_stepper(), nonlinear, [32, 64])
      call new_method('bi45', stepper, status)
      call check_first_order(error, stepper, linear, [8, 16])
      call check_first_order(error, stepper, nonlinear, [32, 64])
      call new_method('bi-extrapolation', stepper, status)
      select type (stepper)
      type is (extrapolation_stepper)
         do levels = 1, 3
            stepper%levels = levels
            call check_first_order(error, stepper, nonlinear, merge([32, 64], [5, 8], levels == 1))
         end do
      end select
   end subroutine test_first_order

   subroutine check_first_order(error, method, sys, steps)
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), intent(in) :: method
      class(ode_system), intent(inout) :: sys
      integer, intent(in) :: steps(2)
      type(method_properties) :: facts
      real(wp) :: errors(2, 2), slopes(2)
      integer :: k, direction
      facts = method%properties()
      do direction = 1, -1, -2
         do k = 1, 2
            call first_order_errors(error, method, sys, direction*steps(k), errors(:, k))
         end do
         if (allocated(error)) return
         slopes = log(errors(:, 1)/errors(:, 2))/log(real(steps(2), wp)/steps(1))
         call check(error, all(slopes >= [facts%order, facts%order - 1] - 0.25_wp), trim(facts%name)//described(facts, slopes))
      end do
   end subroutine check_first_order

   subroutine first_order_errors(error, method, sys, steps, errors)
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), intent(in) :: method
      class(ode_system), intent(inout) :: sys
      integer, intent(in) :: steps
      real(wp), intent(out) :: errors(2)
      class(stepper_type), allocatable :: stepper
      type(dense_output_type) :: dense
      type(method_properties) :: facts
      type(state_type) :: state, trial, point
      type(status_type) :: status
      real(wp) :: h, t, y(2), f(2)
      integer :: i, j, ierr

      h = 1.0_wp/steps
      allocate (stepper, source=method)
      facts = stepper%properties()
      call stepper%init(sys, status)
      state%y = [1.0_wp, merge(1.0_wp, 0.0_wp, facts%linear .or. has_source(sys))]
      call stepper%start(sys, state, status)
      call dense%begin(stepper, sys, status)
      call allocate_state(sys, trial, status)
      call allocate_state(sys, point, status)
      errors = 0.0_wp
      do i = 0, abs(steps) - 1
         call stepper%try_step(sys, state, h, (i + 1)*h, trial, status)
         call dense%build(sys, state, trial, facts%order, status)
         if (status%failed()) exit
         do j = 1, size(places)
            t = (i + places(j))*h
            call dense%evaluate(sys, t, point)
            y = [cos(2.0_wp*t), merge(exp(-t), sin(2.0_wp*t), has_source(sys))]
            call sys%rhs(t, y, f, ierr)
            errors = max(errors, [maxval(abs(point%y - y)), maxval(abs(point%a - f))])
         end do
         call stepper%accept(state, trial)
      end do
      call check(error, .not. status%failed(), trim(facts%name)//': '//trim(status%message))
   end subroutine first_order_errors

   logical function has_source(sys)
      class(ode_system), intent(in) :: sys
      has_source = .false.
      select type (sys)
      type is (forced_decay)
         has_source = .true.
      end select
   end function has_source

   !> Orders in q, v and a of methods for linear and nonlinear mechanics
   subroutine test_mechanics(error)
      type(error_type), allocatable, intent(out) :: error
      class(stepper_type), allocatable :: stepper
      type(status_type) :: status
      integer :: levels
      call check_mechanics(error, pade_stepper(p=2, q=2), problem_linear, [8, 16])
      call check_mechanics(error, pade_stepper(p=4, q=4), problem_linear, [6, 12])
      call check_mechanics(error, backinterpolation_stepper(), problem_linear, [8, 16])
      call check_mechanics(error, backinterpolation_stepper(), problem_cubic, [8, 16])
      call new_method('bi45', stepper, status)
      call check_mechanics(error, stepper, problem_linear, [16, 32])
      call check_mechanics(error, stepper, problem_cubic, [16, 32])
      call new_method('bi-extrapolation', stepper, status)
      select type (stepper)
      type is (extrapolation_stepper)
         do levels = 1, 2
            stepper%levels = levels
            call check_mechanics(error, stepper, problem_linear, merge([16, 32], [6, 9], levels == 1))
            call check_mechanics(error, stepper, problem_cubic, merge([16, 32], [6, 9], levels == 1))
         end do
      end select
      call check_mechanics(error, generalized_alpha_stepper(), problem_linear, [256, 512])
      call check_mechanics(error, generalized_alpha_stepper(), problem_cubic, [256, 512])
   end subroutine test_mechanics

   subroutine check_mechanics(error, method, problem, steps)
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), intent(in) :: method
      integer, intent(in) :: problem, steps(2)
      type(method_properties) :: facts
      real(wp) :: errors(3, 2), slopes(3)
      integer :: k, direction
      facts = method%properties()
      do direction = 1, -1, -2
         do k = 1, 2
            call mechanics_errors(error, method, problem, direction*steps(k), errors(:, k))
         end do
         if (allocated(error)) return
         slopes = log(errors(:, 1)/errors(:, 2))/log(real(steps(2), wp)/steps(1))
         call check(error, all(slopes >= facts%order - 0.25_wp), trim(facts%name)//', '//trim(problem_names(problem)) &
            & //described(facts, slopes))
      end do
   end subroutine check_mechanics

   subroutine mechanics_errors(error, method, problem, steps, errors)
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), intent(in) :: method
      integer, intent(in) :: problem, steps
      real(wp), intent(out) :: errors(3)
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(dense_output_type) :: dense
      type(method_properties) :: facts
      type(state_type) :: state, trial, point
      type(status_type) :: status
      real(qp) :: exact(6, size(places)*abs(steps))
      real(wp) :: times(size(places)*abs(steps)), h
      integer :: i, j, number

      h = 2.0_wp/steps
      do i = 0, abs(steps) - 1
         times(size(places)*i + 1:size(places)*(i + 1)) = (i + places)*h
      end do
      call reference(problem, times, exact)
      call new_problem(problem, sys)
      allocate (stepper, source=method)
      facts = stepper%properties()
      call stepper%init(sys, status)
      state%y = [start_q, start_v]
      call stepper%start(sys, state, status)
      call dense%begin(stepper, sys, status)
      call allocate_state(sys, trial, status)
      call allocate_state(sys, point, status)
      errors = 0.0_wp
      do i = 0, abs(steps) - 1
         call stepper%try_step(sys, state, h, (i + 1)*h, trial, status)
         call dense%build(sys, state, trial, facts%order, status)
         if (status%failed()) exit
         do j = 1, size(places)
            number = size(places)*i + j
            call dense%evaluate(sys, times(number), point)
            associate (y => real(exact(:, number), wp))
               errors = max(errors, [maxval(abs(point%y(1:2) - y(1:2))), maxval(abs(point%y(3:4) - y(3:4))), &
                  & maxval(abs(point%a - y(5:6)))])
            end associate
         end do
         call stepper%accept(state, trial)
      end do
      call check(error, .not. status%failed(), trim(facts%name)//': '//trim(status%message))
   end subroutine mechanics_errors

   !> SOI2 with holonomic, nonholonomic constraints, both or none: order 2 in q, v, a, lambda and psi
   subroutine test_constraints(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: errors(5, 2), slopes(5)
      integer :: number, k, direction
      do number = 1, motions
         do direction = 1, -1, -2
            do k = 1, 2
               call constrained_errors(error, number, direction*256*k, errors(:, k))
            end do
            if (allocated(error)) return
            slopes = 2.0_wp
            where (errors(:, 2) > 0.0_wp) slopes = log(errors(:, 1)/errors(:, 2))/log(2.0_wp)
            call check(error, all(slopes > 1.85_wp), trim(motion_names(number)))
         end do
      end do
   end subroutine test_constraints

   subroutine constrained_errors(error, number, steps, errors)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: number, steps
      real(wp), intent(out) :: errors(5)
      class(known_motion), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(dense_output_type) :: dense
      type(state_type) :: state, trial, point
      type(status_type) :: status
      real(wp), allocatable :: q(:), v(:), a(:), lambda(:), psi(:)
      real(wp) :: h
      integer :: i, j

      call new_motion(number, sys)
      if (sys%holonomic + sys%nonholonomic > 0) then
         allocate (soi2_stepper :: stepper)
      else
         allocate (generalized_alpha_stepper :: stepper)
      end if
      allocate (q(sys%n), v(sys%n), a(sys%n), lambda(sys%holonomic), psi(sys%nonholonomic))
      call sys%at(0.0_wp, q, v, a, lambda, psi)
      state%y = [q, v]
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call dense%begin(stepper, sys, status)
      call allocate_state(sys, trial, status)
      call allocate_state(sys, point, status)
      h = 1.0_wp/steps
      errors = 0.0_wp
      do i = 0, abs(steps) - 1
         call stepper%try_step(sys, state, h, (i + 1)*h, trial, status)
         call dense%build(sys, state, trial, 2, status)
         if (status%failed()) exit
         do j = 1, size(places)
            call dense%evaluate(sys, (i + places(j))*h, point)
            call sys%at(point%t, q, v, a, lambda, psi)
            errors(1) = errors(1) + sum((point%y(:sys%n) - q)**2)
            errors(2) = errors(2) + sum((point%y(sys%n + 1:) - v)**2)
            errors(3) = errors(3) + sum((point%a - a)**2)
            errors(4) = errors(4) + sum((point%lambda - lambda)**2)
            errors(5) = errors(5) + sum((point%psi - psi)**2)
         end do
         call stepper%accept(state, trial)
      end do
      errors = sqrt(errors/abs(steps))
      call check(error, .not. status%failed(), trim(motion_names(number))//': '//trim(status%message))
   end subroutine constrained_errors

   function described(facts, slopes) result(words)
      type(method_properties), intent(in) :: facts
      real(wp), intent(in) :: slopes(:)
      character(len=80) :: words
      write (words, '(", order ", i0, ", measured", *(f7.2))') facts%order, slopes
   end function described
end module test_dense_families
