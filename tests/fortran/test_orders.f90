! SPDX-License-Identifier: BSD-3-Clause
!> Observed orders against the facts in method_properties: Newmark and the midpoint rule, alone
!> and extrapolated by every sequence to orders 2 to 12, forward and backward in time, in q, v
!> and a; error estimates; interpolation.
!>
!> This suite runs the library compiled in quadruple precision: an order of 12 cannot be seen in
!> double precision, where its errors are below rounding once the step is short enough for
!> the leading term to prevail (at omega h = 0.6, harmonic numbers: 1e-12, and the slope is still
!> off by 0.7).
module test_orders
   use dynstep, only: clock_type, extrapolation_stepper, mechanical_system, method_properties, midpoint_stepper, &
      & newmark_stepper, sequence_bulirsch, sequence_custom, sequence_double_harmonic, sequence_harmonic, &
      & sequence_romberg, state_type, status_type, stepper_type, wp
   use reference_problems, only: new_problem, problem_cubic, problem_linear, problem_mass, reference, start_q, start_v
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_orders

   !> Steps over the interval [0, 1] (or [0, -1]) of the two runs whose errors are compared,
   !> few for extrapolations, more for plain methods
   integer, parameter :: few(2) = [10, 16], more(2) = [64, 100]

   integer, parameter :: sequences(5) = [sequence_romberg, sequence_bulirsch, sequence_harmonic, &
      & sequence_double_harmonic, sequence_custom]
   real(wp), parameter :: betas(4) = [0.0_wp, 1.0_wp/12, 1.0_wp/6, 0.25_wp]

contains

   subroutine collect_orders(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('extrapolated-linear', test_linear), &
         & new_unittest('extrapolated-nonlinear', test_nonlinear), &
         & new_unittest('extrapolated-mass', test_mass), &
         & new_unittest('plain', test_plain), &
         & new_unittest('error-estimates', test_error_estimates), &
         & new_unittest('interpolation', test_interpolation)]
   end subroutine collect_orders

   subroutine test_linear(error)
      type(error_type), allocatable, intent(out) :: error
      call all_extrapolations(error, problem_linear)
   end subroutine test_linear

   subroutine test_nonlinear(error)
      type(error_type), allocatable, intent(out) :: error
      call all_extrapolations(error, problem_cubic)
   end subroutine test_nonlinear

   subroutine test_mass(error)
      type(error_type), allocatable, intent(out) :: error
      call all_extrapolations(error, problem_mass)
   end subroutine test_mass

   !> Every sequence, P = 1 to 6, over Newmark with four beta and the midpoint rule
   subroutine all_extrapolations(error, problem)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: problem
      type(extrapolation_stepper) :: stepper
      real(wp) :: exact(6, 2)
      integer :: i, direction
      do direction = 1, -1, -2
         call reference(problem, [0.5_wp, 1.0_wp]*direction, exact)
         do i = 1, size(betas)
            if (allocated(stepper%base)) deallocate (stepper%base)
            allocate (stepper%base, source=newmark_stepper(beta=betas(i)))
            call all_sequences(error, problem, direction, exact, stepper)
         end do
         deallocate (stepper%base)
         allocate (midpoint_stepper :: stepper%base)
         call all_sequences(error, problem, direction, exact, stepper)
      end do
   end subroutine all_extrapolations

   subroutine all_sequences(error, problem, direction, exact, stepper)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: problem, direction
      real(wp), intent(in) :: exact(6, 2)
      type(extrapolation_stepper), intent(inout) :: stepper
      integer :: i, levels
      stepper%custom = [1, 3, 4, 5, 7, 9]
      do i = 1, size(sequences)
         stepper%sequence = sequences(i)
         do levels = 1, 6
            stepper%levels = levels
            call check_order(error, problem, direction, exact, stepper, few)
         end do
      end do
   end subroutine all_sequences

   !> Newmark with and without gamma = 1/2, and the midpoint rule
   subroutine test_plain(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: pairs(2, 10) = reshape([ &
         & 0.0_wp, 0.5_wp, 1.0_wp/12, 0.5_wp, 1.0_wp/6, 0.5_wp, 0.25_wp, 0.5_wp, 1.0_wp, 0.5_wp, &
         & 0.3025_wp, 0.6_wp, 0.0_wp, 0.75_wp, 0.5_wp, 1.0_wp, 0.25_wp, 0.25_wp, 0.125_wp, 0.0_wp], [2, 10])
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      real(wp) :: exact(6, 2)
      integer :: i, problem, direction
      do problem = 1, 3
         do direction = 1, -1, -2
            call reference(problem, [0.5_wp, 1.0_wp]*direction, exact)
            do i = 1, size(pairs, 2)
               newmark%beta = pairs(1, i)
               newmark%gamma = pairs(2, i)
               call check_order(error, problem, direction, exact, newmark, more)
            end do
            call check_order(error, problem, direction, exact, midpoint, more)
         end do
      end do
   end subroutine test_plain

   !> Slope between two step lengths, in q, v and a, within 0.25 of the stated orders
   subroutine check_order(error, problem, direction, exact, method, steps)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: problem, direction
      real(wp), intent(in) :: exact(6, 2)              !! states in the middle and at the end
      class(stepper_type), intent(in) :: method
      integer, intent(in) :: steps(2)                  !! of the two runs
      class(stepper_type), allocatable :: stepper
      type(method_properties) :: facts
      real(wp) :: errors(3, 2), slopes(3), stated(3)

      if (allocated(error)) return
      allocate (stepper, source=method)
      facts = stepper%properties()
      stated = real([facts%order, facts%order, facts%acceleration_order], wp)
      call run_errors(error, problem, direction*steps(1), exact, stepper, errors(:, 1))
      call run_errors(error, problem, direction*steps(2), exact, stepper, errors(:, 2))
      if (allocated(error)) return
      slopes = log(errors(:, 1)/errors(:, 2))/log(real(steps(2), wp)/steps(1))
      if (all(abs(slopes - stated) <= 0.25_wp)) return
      call test_failed(error, trim(name_of(method)), trim(name_of_run(problem, direction))//describe(slopes, stated))
   end subroutine check_order

   !> Largest errors in q, v and a in the middle and at the end of the interval
   subroutine run_errors(error, problem, steps, exact, stepper, errors)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: problem, steps            !! steps < 0: backward in time
      real(wp), intent(in) :: exact(6, 2)
      class(stepper_type), intent(inout) :: stepper
      real(wp), intent(out) :: errors(3)
      class(mechanical_system), allocatable :: sys
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      integer :: half

      call new_problem(problem, sys)
      call stepper%init(sys, status)
      state%y = [start_q, start_v]
      call stepper%start(sys, state, status)
      clock%h = 1.0_wp/steps
      errors = 0.0_wp
      do half = 1, 2
         call stepper%advance(sys, state, clock, abs(steps)/2, status, complete=.true.)
         if (status%failed()) exit
         errors(1) = max(errors(1), maxval(abs(state%y(1:2) - exact(1:2, half))))
         errors(2) = max(errors(2), maxval(abs(state%y(3:4) - exact(3:4, half))))
         errors(3) = max(errors(3), maxval(abs(state%a - exact(5:6, half))))
      end do
      call check(error, .not. status%failed(), trim(name_of(stepper))//': '//trim(status%message))
   end subroutine run_errors

   !> The estimate after one step is an error of order error_order: it falls like its power + 1
   subroutine test_error_estimates(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(extrapolation_stepper) :: stepper
      type(method_properties) :: facts
      type(state_type) :: state, trial
      type(status_type) :: status
      real(wp) :: estimate(4), sizes(2)
      integer :: i, j, levels

      allocate (newmark_stepper :: stepper%base)
      call new_problem(problem_mass, sys)
      do j = 1, 4
         stepper%sequence = sequences(j)
         do levels = 1, 6
            stepper%levels = levels
            call stepper%init(sys, status)
            state%y = [start_q, start_v]
            call stepper%start(sys, state, status)
            trial = state
            do i = 1, 2
               call stepper%try_step(sys, state, 0.1_wp/i, 0.1_wp/i, trial, status)
               call stepper%estimate_error(estimate)
               sizes(i) = maxval(abs(estimate))
            end do
            call check(error, .not. status%failed(), trim(status%message))
            facts = stepper%properties()
            if (stepper%levels == 1) then
               call check(error, facts%error_order == 0 .and. all(abs(sizes) <= 0.0_wp), 'there is no estimate')
            else
               call check(error, abs(log(sizes(1)/sizes(2))/log(2.0_wp) - (facts%error_order + 1)) <= 0.25_wp, &
                  & trim(name_of(stepper)))
            end if
         end do
      end do
   end subroutine test_error_estimates

   !> Errors of Hermite interpolation fall like h^6 in q, h^5 in v and h^4 in a
   subroutine test_interpolation(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(extrapolation_stepper) :: stepper
      type(state_type) :: state, trial, point
      type(status_type) :: status
      real(wp) :: exact(6, 1), sizes(3, 2), h, slopes(3)
      integer :: i

      allocate (newmark_stepper :: stepper%base)
      call new_problem(problem_cubic, sys)
      call stepper%init(sys, status)
      state%y = [start_q, start_v]
      call stepper%start(sys, state, status)
      trial = state
      point = state
      do i = 1, 2
         h = -0.05_wp/i
         call stepper%try_step(sys, state, h, h, trial, status)
         call stepper%interpolate(sys, state, trial, 0.3_wp*h, point)
         call reference(problem_cubic, [0.3_wp*h], exact)
         sizes(1, i) = maxval(abs(point%y(1:2) - exact(1:2, 1)))
         sizes(2, i) = maxval(abs(point%y(3:4) - exact(3:4, 1)))
         sizes(3, i) = maxval(abs(point%a - exact(5:6, 1)))
      end do
      call check(error, .not. status%failed(), trim(status%message))
      slopes = log(sizes(:, 1)/sizes(:, 2))/log(2.0_wp)
      call check(error, all(abs(slopes - [6, 5, 4]) <= 0.25_wp), describe(slopes, [6.0_wp, 5.0_wp, 4.0_wp]))
   end subroutine test_interpolation

   function name_of(stepper) result(name)
      class(stepper_type), intent(in) :: stepper
      character(len=100) :: name
      type(method_properties) :: facts
      facts = stepper%properties()
      name = facts%name
      select type (stepper)
      type is (newmark_stepper)
         write (name, '(a, ", beta ", f7.5, ", gamma ", f7.5)') trim(facts%name), stepper%beta, stepper%gamma
      type is (extrapolation_stepper)
         write (name, '(a, ", sequence ", i0, ", P ", i0)') trim(facts%name), stepper%sequence, stepper%levels
         select type (base => stepper%base)
         type is (newmark_stepper)
            write (name, '(a, ", sequence ", i0, ", P ", i0, ", beta ", f7.5)') trim(facts%name), &
               & stepper%sequence, stepper%levels, base%beta
         end select
      end select
   end function name_of

   function name_of_run(problem, direction) result(name)
      integer, intent(in) :: problem, direction
      character(len=32) :: name
      write (name, '("problem ", i0, ", direction ", i0)') problem, direction
   end function name_of_run

   function describe(slopes, stated) result(words)
      real(wp), intent(in) :: slopes(3), stated(3)
      character(len=64) :: words
      write (words, '(", orders", 3f7.2, " in q, v, a, stated", 3f5.0)') slopes, stated
   end function describe
end module test_orders
