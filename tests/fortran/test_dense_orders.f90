! SPDX-License-Identifier: BSD-3-Clause
!> Dense output has the order of the method in q, v and a at any time: Newmark and the midpoint rule, alone and
!> extrapolated to orders up to 12, forward and backward.  In quadruple precision, as TEST_ORDERS.
module test_dense_orders
   use dynstep_dense_output, only: dense_output_type
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_hermite, only: hermite_type
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
   use dynstep_status, only: status_type
   use dynstep_stepper, only: allocate_state, method_properties, state_type, stepper_type
   use reference_problems, only: new_problem, problem_names, reference, start_q, start_v
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_dense_orders

   !> Steps over [0, 1] or [0, -1] of the two runs whose errors are compared: few for extrapolations
   integer, parameter :: few(2) = [16, 24], more(2) = [48, 72]

   !> The motion of a problem at the places inside the steps of two runs
   type :: motion_type
      integer :: problem = 0
      integer :: steps(2) = 0                           !! < 0: backward in time
      real(wp), allocatable :: times(:, :)              !! [size(places)*steps, 2]
      real(wp), allocatable :: states(:, :, :)          !! q, v, a [6, size(places)*steps, 2]
   end type motion_type

   !> Places inside a step
   real(wp), parameter :: places(4) = [0.13_wp, 0.38_wp, 0.61_wp, 0.87_wp]

contains

   subroutine collect_dense_orders(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('hermite', test_hermite), &
         & new_unittest('plain', test_plain), &
         & new_unittest('extrapolated', test_extrapolated)]
   end subroutine collect_dense_orders

   !> Through m + 2 nodes of e^(t/2): errors h^(2m + 4) and h^(2m + 3), and polynomials of degree 2m + 3 exactly
   subroutine test_hermite(error)
      type(error_type), allocatable, intent(out) :: error
      type(hermite_type) :: curve
      type(status_type) :: status
      real(wp) :: y(2), a(2), errors(2, 2), slopes(2), h, s
      integer :: i, j, k, m, nodes

      do m = 0, 5
         nodes = m + 2
         call curve%reserve(2, 2, nodes, status)
         do i = 1, 2
            h = -0.5_wp**i
            call curve%begin(nodes, h)
            do k = 0, m + 1
               s = real(k, wp)/(m + 1)
               s = s*(0.9_wp + 0.1_wp*s)
               call curve%put(k + 1, s, [exp(s*h/2), power(s, nodes)], [exp(s*h/2)/2, slope(s, nodes)/h])
            end do
            call curve%tabulate()
            errors(:, i) = 0.0_wp
            do j = 1, size(places)
               s = places(j)
               call curve%value(s, y)
               call curve%derivative(s, a)
               errors(:, i) = max(errors(:, i), [abs(y(1) - exp(s*h/2)), abs(a(1) - exp(s*h/2)/2)])
               call check(error, abs(y(2) - power(s, nodes)) <= 1.0e3_wp*epsilon(1.0_wp) .and. &
                  & abs(h*a(2) - slope(s, nodes)) <= 1.0e5_wp*epsilon(1.0_wp), 'a polynomial is not reproduced')
            end do
         end do
         slopes = log(errors(:, 1)/errors(:, 2))/log(2.0_wp)
         call check(error, all(abs(slopes - [2*nodes, 2*nodes - 1]) < 0.25_wp), describe(slopes))
      end do
      call check(error, .not. status%failed(), trim(status%message))

   contains

      pure real(wp) function power(x, n)
         real(wp), intent(in) :: x
         integer, intent(in) :: n
         power = 1.0_wp + 2.0_wp*x - x**(2*n - 1)
      end function power

      pure real(wp) function slope(x, n)
         real(wp), intent(in) :: x
         integer, intent(in) :: n
         slope = 2.0_wp - (2*n - 1)*x**(2*n - 2)
      end function slope
   end subroutine test_hermite

   subroutine test_plain(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: betas(4) = [0.0_wp, 1.0_wp/12, 1.0_wp/6, 0.25_wp]
      type(motion_type) :: motion
      integer :: i, problem, direction
      do problem = 1, size(problem_names)
         do direction = 1, -1, -2
            call get_motion(problem, direction*more, motion)
            do i = 1, size(betas)
               call check_order(error, motion, newmark_stepper(beta=betas(i)))
            end do
            call check_order(error, motion, newmark_stepper(beta=0.3025_wp, gamma=0.6_wp))
            call check_order(error, motion, midpoint_stepper())
         end do
      end do
   end subroutine test_plain

   subroutine test_extrapolated(error)
      type(error_type), allocatable, intent(out) :: error
      type(extrapolation_stepper) :: stepper
      type(motion_type) :: motion
      integer :: base, problem, direction, levels
      do problem = 1, size(problem_names)
         do direction = 1, -1, -2
            call get_motion(problem, direction*few, motion)
            do base = 1, 3
               if (allocated(stepper%base)) deallocate (stepper%base)
               select case (base)
               case (1)
                  allocate (stepper%base, source=newmark_stepper(beta=0.25_wp))
               case (2)
                  allocate (stepper%base, source=newmark_stepper(beta=0.0_wp))
               case default
                  allocate (midpoint_stepper :: stepper%base)
               end select
               do levels = 1, 6
                  stepper%levels = levels
                  call check_order(error, motion, stepper)
               end do
            end do
         end do
      end do
   end subroutine test_extrapolated

   subroutine get_motion(problem, steps, motion)
      integer, intent(in) :: problem, steps(2)
      type(motion_type), intent(out) :: motion
      integer :: i, j, k, many
      motion%problem = problem
      motion%steps = steps
      many = size(places)*maxval(abs(steps))
      allocate (motion%times(many, 2), motion%states(6, many, 2))
      do k = 1, 2
         do i = 0, abs(steps(k)) - 1
            do j = 1, size(places)
               motion%times(size(places)*i + j, k) = (i + places(j))/steps(k)
            end do
         end do
         many = size(places)*abs(steps(k))
         call reference(problem, motion%times(:many, k), motion%states(:, :many, k))
      end do
   end subroutine get_motion

   !> Slopes between two step lengths in q, v and a are the stated order at least
   subroutine check_order(error, motion, method)
      type(error_type), allocatable, intent(inout) :: error
      type(motion_type), intent(in) :: motion
      class(stepper_type), intent(in) :: method
      type(method_properties) :: facts
      real(wp) :: errors(3, 2), slopes(3)
      integer :: k

      if (allocated(error)) return
      facts = method%properties()
      do k = 1, 2
         call run_errors(error, motion, k, method, errors(:, k))
      end do
      if (allocated(error)) return
      slopes = log(errors(:, 1)/errors(:, 2))/log(real(motion%steps(2), wp)/motion%steps(1))
      if (all(slopes >= facts%order - 0.25_wp)) return
      call test_failed(error, trim(facts%name)//', order'//trim(describe([real(facts%order, wp)]))//', ' &
         & //trim(problem_names(motion%problem))//', measured in q, v, a'//describe(slopes))
   end subroutine check_order

   !> Largest errors inside the steps of run k
   subroutine run_errors(error, motion, k, method, errors)
      type(error_type), allocatable, intent(inout) :: error
      type(motion_type), intent(in) :: motion
      integer, intent(in) :: k
      class(stepper_type), intent(in) :: method
      real(wp), intent(out) :: errors(3)
      class(stepper_type), allocatable :: stepper
      class(mechanical_system), allocatable :: sys
      type(dense_output_type) :: dense
      type(method_properties) :: facts
      type(state_type) :: state, trial, point
      type(status_type) :: status
      real(wp) :: h
      integer :: i, number

      h = 1.0_wp/motion%steps(k)
      allocate (stepper, source=method)
      facts = stepper%properties()
      call new_problem(motion%problem, sys)
      call stepper%init(sys, status)
      state%y = [start_q, start_v]
      call stepper%start(sys, state, status)
      call dense%begin(stepper, sys, status)
      call allocate_state(sys, trial, status)
      call allocate_state(sys, point, status)
      errors = 0.0_wp
      do i = 0, abs(motion%steps(k)) - 1
         call stepper%try_step(sys, state, h, (i + 1)*h, trial, status)
         call dense%build(sys, state, trial, facts%order, status)
         if (status%failed()) exit
         do number = size(places)*i + 1, size(places)*(i + 1)
            call dense%evaluate(sys, motion%times(number, k), point)
            associate (exact => motion%states(:, number, k))
               errors(1) = max(errors(1), maxval(abs(point%y(1:2) - exact(1:2))))
               errors(2) = max(errors(2), maxval(abs(point%y(3:4) - exact(3:4))))
               errors(3) = max(errors(3), maxval(abs(point%a - exact(5:6))))
            end associate
         end do
         call stepper%accept(state, trial)
      end do
      call check(error, .not. status%failed(), trim(facts%name)//': '//trim(status%message))
   end subroutine run_errors

   function describe(slopes) result(words)
      real(wp), intent(in) :: slopes(:)
      character(len=40) :: words
      write (words, '(*(f7.2))') slopes
   end function describe
end module test_dense_orders
