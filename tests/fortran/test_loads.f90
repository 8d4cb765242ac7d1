! SPDX-License-Identifier: BSD-3-Clause
!> Loads given by samples: interpolation, ends, patterns, refusals, and the order of steps on them.
module test_loads
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
   use dynstep
   use run_cases, only: new_state
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_loads

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   subroutine collect_loads(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('uniform', test_uniform), &
         & new_unittest('times', test_times), &
         & new_unittest('outside', test_outside), &
         & new_unittest('ends-by-rounding', test_ends), &
         & new_unittest('pattern', test_pattern), &
         & new_unittest('refusals', test_refusals), &
         & new_unittest('steps-on-samples', test_steps)]
   end subroutine collect_loads

   !> Two signals with samples at 1, 1.25, 1.5, 1.75
   subroutine make_table(table)
      type(load_table_type), intent(out) :: table
      table%t0 = 1.0_wp
      table%dt = 0.25_wp
      table%samples = reshape([1.0_wp, 10.0_wp, 3.0_wp, 20.0_wp, -1.0_wp, 40.0_wp, 0.5_wp, 80.0_wp], [2, 4])
   end subroutine make_table

   subroutine test_uniform(error)
      type(error_type), allocatable, intent(out) :: error
      type(load_table_type) :: table
      real(wp) :: p(2)
      integer :: i
      call make_table(table)
      do i = 1, 4
         call table%evaluate(1.0_wp + 0.25_wp*(i - 1), p)
         call check(error, all(abs(p - table%samples(:, i)) <= 0.0_wp), 'at a sample: the sample')
      end do
      call table%evaluate(1.125_wp, p)
      call check(error, p(1), 2.0_wp, thr=0.0_wp)
      call check(error, p(2), 15.0_wp, thr=0.0_wp)
      call table%evaluate(1.6875_wp, p)
      call check(error, p(1), -1.0_wp + 0.75_wp*1.5_wp, thr=0.0_wp)
   end subroutine test_uniform

   !> Intervals of any lengths
   subroutine test_times(error)
      type(error_type), allocatable, intent(out) :: error
      type(load_table_type) :: table
      type(status_type) :: status
      real(wp) :: p(2)
      integer :: i
      call make_table(table)
      table%times = [-2.0_wp, 0.0_wp, 0.5_wp, 4.5_wp]
      call table%check(2, status)
      call check(error, .not. status%failed(), trim(status%message))
      do i = 1, 4
         call table%evaluate(table%times(i), p)
         call check(error, all(abs(p - table%samples(:, i)) <= 0.0_wp), 'at a sample: the sample')
      end do
      call table%evaluate(-0.5_wp, p)
      call check(error, p(1), 1.0_wp + 0.75_wp*2.0_wp, thr=0.0_wp)
      call table%evaluate(1.5_wp, p)
      call check(error, p(2), 50.0_wp, thr=0.0_wp)
      table%samples = table%samples(:, :2)
      table%times = table%times(:2)
      call table%evaluate(-1.0_wp, p)
      call check(error, p(1), 2.0_wp, thr=0.0_wp, message='two samples')
   end subroutine test_times

   !> Nothing outside, or the first and the last sample
   subroutine test_outside(error)
      type(error_type), allocatable, intent(out) :: error
      type(load_table_type) :: table
      real(wp) :: p(2)
      integer :: i
      call make_table(table)
      do i = 1, 2
         if (i == 2) table%times = [1.0_wp, 1.25_wp, 1.5_wp, 1.75_wp]
         table%outside = outside_zero
         call table%evaluate(0.99_wp, p)
         call check(error, maxval(abs(p)), 0.0_wp, thr=0.0_wp)
         call table%evaluate(1.0e300_wp, p)
         call check(error, maxval(abs(p)), 0.0_wp, thr=0.0_wp)
         table%outside = outside_hold
         call table%evaluate(-1.0e300_wp, p)
         call check(error, all(abs(p - table%samples(:, 1)) <= 0.0_wp), 'the first goes on')
         call table%evaluate(1.76_wp, p)
         call check(error, all(abs(p - table%samples(:, 4)) <= 0.0_wp), 'the last goes on')
      end do
   end subroutine test_outside

   !> A time that misses an end by rounding is at that end: the step to t0 + k h has its load
   subroutine test_ends(error)
      type(error_type), allocatable, intent(out) :: error
      type(load_table_type) :: table
      real(wp) :: p(2), t
      integer :: i
      call make_table(table)
      table%t0 = 0.1_wp
      table%dt = 0.1_wp
      do i = 1, 2
         if (i == 2) table%times = [0.1_wp, 0.2_wp, 0.3_wp, 0.4_wp]
         t = 0.1_wp + 0.1_wp + 0.1_wp + 0.1_wp
         call table%evaluate(t, p)
         call check(error, p(2), 80.0_wp, thr=1.0e-13_wp, message='the last sample')
         call table%evaluate(nearest(t, 1.0_wp), p)
         call check(error, p(2), 80.0_wp, thr=1.0e-13_wp, message='one rounding later')
         call table%evaluate(nearest(0.1_wp, -1.0_wp), p)
         call check(error, p(2), 10.0_wp, thr=1.0e-13_wp, message='one rounding earlier')
      end do
   end subroutine test_ends

   !> p = B s
   subroutine test_pattern(error)
      type(error_type), allocatable, intent(out) :: error
      type(load_table_type) :: table
      type(status_type) :: status
      real(wp) :: p(3)
      call make_table(table)
      table%pattern = reshape([1.0_wp, 0.0_wp, -2.0_wp, 0.5_wp, 1.0_wp, 0.0_wp], [3, 2])
      call table%check(3, status)
      call check(error, .not. status%failed(), trim(status%message))
      call table%evaluate(1.125_wp, p)
      call check(error, all(abs(p - [9.5_wp, 15.0_wp, -4.0_wp]) <= 0.0_wp), 'B s')
   end subroutine test_pattern

   !> Each fault by a sentence
   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(load_table_type) :: table
      real(wp) :: nan
      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      call refused(table, 'has no samples')
      call make_table(table)
      table%samples = table%samples(:, :1)
      call refused(table, 'at least two samples')
      call make_table(table)
      table%samples(1, 3) = nan
      call refused(table, 'not finite: sample 3')
      call make_table(table)
      table%outside = 7
      call refused(table, 'unknown rule 7')
      call make_table(table)
      table%samples = table%samples(:1, :)
      call refused(table, '1 signals for 2 coordinates')
      call make_table(table)
      table%dt = 0.0_wp
      call refused(table, 'dt > 0')
      table%dt = nan
      call refused(table, 'dt > 0')
      table%dt = ieee_value(1.0_wp, ieee_positive_inf)
      call refused(table, 'dt > 0')
      call make_table(table)
      table%t0 = nan
      call refused(table, 'finite t0')
      call make_table(table)
      table%times = [1.0_wp, 2.0_wp, 3.0_wp]
      call refused(table, '3 times for 4 samples')
      table%times = [1.0_wp, 2.0_wp, 2.0_wp, 3.0_wp]
      call refused(table, 'do not increase at number 3')
      table%times = [nan, 2.0_wp, 2.5_wp, 3.0_wp]
      call refused(table, 'a time that is not finite: number 1')
      table%times = [1.0_wp, nan, 2.5_wp, 3.0_wp]
      call refused(table, 'a time that is not finite: number 2')
      call make_table(table)
      table%pattern = reshape([1.0_wp, 1.0_wp], [2, 1])
      call refused(table, 'pattern of shape (2, 1), expected (2, 2)')
      table%pattern = reshape([1.0_wp, 1.0_wp, nan, 1.0_wp], [2, 2])
      call refused(table, 'a pattern with an entry that is not finite')

   contains

      subroutine refused(table, words)
         type(load_table_type), intent(in) :: table
         character(len=*), intent(in) :: words
         type(linear_system) :: sys
         type(status_type) :: status
         call sys%set(identity_matrix(2), zero_matrix(2), identity_matrix(2), status)
         call sys%set_table(table, status)
         call check(error, status%code, dynstep_invalid_input, words)
         call check(error, index(status%message, words) > 0 .and. index(status%message, 'the load table') == 1, &
            & words//' is not in: '//trim(status%message))
         call check(error, sys%load_kind, load_none, 'the table is not taken')
      end subroutine refused
   end subroutine test_refusals

   !> q'' = p(t), p a hat from 0 over 1 at t = 1 to 0 at t = 2: exact for every method of order 2
   !> and more but for p's kinks, which the steps meet at their ends.  A method that weighs accelerations of
   !> several times (generalized-alpha) has errors of order h^2 from them.
   subroutine test_steps(error)
      type(error_type), allocatable, intent(out) :: error
      class(stepper_type), allocatable :: stepper
      type(linear_system) :: sys
      type(load_table_type) :: table
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      table%dt = 1.0_wp
      table%samples = reshape([0.0_wp, 1.0_wp, 0.0_wp], [1, 3])
      call sys%set(identity_matrix(1), zero_matrix(1), zero_matrix(1), status)
      call sys%set_table(table, status)
      do i = 1, size(method_names)
         if (allocated(stepper)) deallocate (stepper)
         call new_method(trim(method_names(i)), stepper, status)
         state = new_state([0.0_wp, 0.0_wp])
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         call integrate(stepper, sys, state, 4.0_wp, control_type(h=0.125_wp), status)
         call check(error, .not. status%failed(), trim(status%message))
         call check(error, state%y(2), 1.0_wp, thr=tolerance(stepper), message=trim(method_names(i))//': the impulse')
         call check(error, state%a(1), 0.0_wp, thr=tolerance(stepper) - 4*eps, message='no load any more')
         if (index(method_names(i), 'extrapolation') == 0 .and. method_names(i) /= 'linear-acceleration') cycle
         call check(error, state%y(1), 3.0_wp, thr=50*eps, message=trim(method_names(i))//': the way')
      end do
   end subroutine test_steps

   real(wp) function tolerance(stepper)
      class(stepper_type), intent(in) :: stepper
      type(method_properties) :: facts
      facts = stepper%properties()
      tolerance = merge(4*eps, 0.125_wp**2, facts%step_growth_limit >= huge(1.0_wp))
   end function tolerance
end module test_loads
