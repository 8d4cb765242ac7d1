! SPDX-License-Identifier: BSD-3-Clause
!> Errors that follow the tolerance, in every family: the slope of log error over log tolerance in two decades.
!>
!> A run keeps the estimate of each step, O(h^(e + 1)), at a share of the tolerance: h ~ tol^(1/(e + 1)).  The error of the
!> motion, O(h^p), is then
!>
!>   error ~ tol^(p/(e + 1))
!>
!> with p and e from the facts of the method.  Where the error chooses the order, h hardly follows the tolerance and the
!> errors of so many steps do: the slope is 1.
module test_proportionality
   use dynstep, only: allocate_state, backinterpolation_stepper, extrapolation_stepper, integrate_controlled, mechanical_system, &
      & method_properties, new_method, state_type, status_type, step_control_type, stepper_type, wp
   use reference_problems, only: new_problem, problem_cubic, problem_linear, problem_mass, qp, reference, start_q, start_v
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_proportionality

   real(wp), parameter :: t_end = 40.0_wp

contains

   subroutine collect_proportionality(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('newmark-extrapolation', test_newmark), &
         & new_unittest('midpoint-extrapolation', test_midpoint), &
         & new_unittest('orders-by-error', test_varied), &
         & new_unittest('soi2', test_soi2), &
         & new_unittest('generalized-alpha', test_alpha), &
         & new_unittest('backinterpolation', test_backinterpolation), &
         & new_unittest('orders-of-backinterpolation', test_halves), &
         & new_unittest('pade', test_pade)]
   end subroutine collect_proportionality

   !> Error at the end of a run, largest component of q and v, and its steps
   subroutine run(problem, stepper, tolerance, exact, missed, steps, status)
      integer, intent(in) :: problem
      class(stepper_type), intent(inout) :: stepper          !! with its options
      real(wp), intent(in) :: tolerance
      real(qp), intent(in) :: exact(4)
      real(wp), intent(out) :: missed
      integer, intent(out) :: steps
      type(status_type), intent(inout) :: status
      class(mechanical_system), allocatable :: sys
      type(state_type) :: state
      type(step_control_type) :: control
      call new_problem(problem, sys)
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      state%y = [start_q, start_v]
      call stepper%start(sys, state, status)
      control%rtol = tolerance
      control%atol = [tolerance]
      call integrate_controlled(stepper, sys, state, t_end, control, status)
      missed = real(maxval(abs(real(state%y, qp) - exact)), wp)
      steps = int(stepper%count%steps)
   end subroutine run

   !> Least squares through runs at a quarter of a decade from each other, over two decades from `loosest`
   subroutine check_slope(problem, stepper, loosest, expected, name, error)
      integer, intent(in) :: problem
      class(stepper_type), intent(inout) :: stepper
      real(wp), intent(in) :: loosest                        !! its log10
      real(wp), intent(in) :: expected
      character(len=*), intent(in) :: name
      type(error_type), allocatable, intent(inout) :: error
      integer, parameter :: runs = 9
      type(status_type) :: status
      real(wp) :: x(runs), y(runs), slope, missed
      character(len=100) :: words
      real(qp) :: exact(6, 1)
      integer :: i, steps(runs)
      call reference(problem, [t_end], exact)
      do i = 1, runs
         x(i) = loosest - 0.25_wp*(i - 1)
         call run(problem, stepper, 10.0_wp**x(i), exact(:4, 1), missed, steps(i), status)
         call check(error, .not. status%failed(), name//': '//trim(status%message))
         if (status%failed()) return
         y(i) = log10(missed)
      end do
      x = x - sum(x)/runs
      slope = sum(x*y)/sum(x**2)
      write (words, '(a, " on ", i1, ": slope ", f6.3, ", expected ", f6.3, ", steps ", i0, " to ", i0)') name, problem, slope, &
         & expected, steps(1), steps(runs)
      call check(error, abs(slope - expected) <= 0.25_wp, trim(words))
      call check(error, steps(1) > 8, trim(words)//': too few steps to tell')
   end subroutine check_slope

   !> A method by its name, on a problem for all and, where it takes them, on nonlinear ones
   subroutine check_method(name, loosest, error)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: loosest
      type(error_type), allocatable, intent(inout) :: error
      class(stepper_type), allocatable :: stepper
      type(method_properties) :: facts
      type(status_type) :: status
      integer :: problem
      do problem = problem_linear, problem_mass
         call new_method(name, stepper, status)
         call check(error, .not. status%failed(), trim(status%message))
         if (status%failed()) return
         facts = stepper%properties()
         if (facts%linear .and. problem /= problem_linear) cycle
         call check_slope(problem, stepper, loosest, real(facts%order, wp)/real(facts%error_order + 1, wp), name, error)
      end do
   end subroutine check_method

   subroutine test_newmark(error)
      type(error_type), allocatable, intent(out) :: error
      call check_method('newmark-extrapolation', -6.0_wp, error)
   end subroutine test_newmark

   subroutine test_midpoint(error)
      type(error_type), allocatable, intent(out) :: error
      call check_method('midpoint-extrapolation', -6.0_wp, error)
   end subroutine test_midpoint

   !> Each tolerance has orders of its own
   subroutine test_varied(error)
      type(error_type), allocatable, intent(out) :: error
      class(stepper_type), allocatable :: stepper
      type(status_type) :: status
      integer :: problem
      do problem = problem_linear, problem_mass
         call new_method('newmark-extrapolation', stepper, status)
         select type (stepper)
         class is (extrapolation_stepper)
            stepper%vary_order = .true.
         end select
         call check_slope(problem, stepper, -6.0_wp, 1.0_wp, 'varied orders', error)
      end do
   end subroutine test_varied

   subroutine test_soi2(error)
      type(error_type), allocatable, intent(out) :: error
      call check_method('soi2', -4.0_wp, error)
   end subroutine test_soi2

   subroutine test_alpha(error)
      type(error_type), allocatable, intent(out) :: error
      call check_method('generalized-alpha', -4.0_wp, error)
   end subroutine test_alpha

   subroutine test_backinterpolation(error)
      type(error_type), allocatable, intent(out) :: error
      call check_method('bi', -5.0_wp, error)
      call check_method('bi45', -5.0_wp, error)
      call check_method('bi-extrapolation', -7.0_wp, error)
   end subroutine test_backinterpolation

   subroutine test_halves(error)
      type(error_type), allocatable, intent(out) :: error
      type(backinterpolation_stepper), allocatable :: stepper
      type(method_properties) :: facts
      integer :: p, problem
      do p = 1, 5
         do problem = problem_linear, problem_mass
            allocate (stepper)
            stepper%p = p
            stepper%q = p
            facts = stepper%properties()
            call check_slope(problem, stepper, merge(-2.0_wp, -5.0_wp, p < 3), &
               & real(facts%order, wp)/real(facts%error_order + 1, wp), 'halves of order '//achar(48 + p), error)
            deallocate (stepper)
         end do
      end do
   end subroutine test_halves

   subroutine test_pade(error)
      type(error_type), allocatable, intent(out) :: error
      call check_method('pade', -6.0_wp, error)
   end subroutine test_pade
end module test_proportionality
