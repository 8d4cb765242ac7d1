! SPDX-License-Identifier: BSD-3-Clause
!> How runs end: observers, refusals, failures of forces and recorders.
module test_endings
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
   use dynstep
   use reference_problems, only: new_problem, problem_cubic, start_q, start_v
   use run_cases, only: equal, new_state, prepare, run, takes_forces
   use spring_cases, only: bounded_system
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_endings

   !> Asks to stop after some steps, counts what it sees
   type, extends(observer_type) :: stopping_observer
      integer :: seen = 0
      integer :: stop_after = huge(1)
      real(wp) :: last_time = -huge(1.0_wp)
      logical :: in_order = .true.
   contains
      procedure :: observe => stopping_observe
   end type stopping_observer

   !> Keeps two points and fails at the third
   type, extends(recorder_type) :: failing_recorder
      integer :: count = 0
   contains
      procedure :: record => failing_record
   end type failing_recorder

contains

   subroutine collect_endings(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('observer', test_observer), &
         & new_unittest('no-interval', test_no_interval), &
         & new_unittest('wrong-control', test_wrong_control), &
         & new_unittest('not-started', test_not_started), &
         & new_unittest('failing-run', test_failing_run), &
         & new_unittest('failing-recorder', test_failing_recorder), &
         & new_unittest('failed-status', test_failed_status)]
   end subroutine collect_endings

   recursive subroutine stopping_observe(self, stepper, state, stop)
      class(stopping_observer), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      type(state_type), intent(in) :: state
      logical, intent(inout) :: stop
      self%seen = self%seen + 1
      self%in_order = self%in_order .and. state%t > self%last_time .and. int(stepper%count%steps) == self%seen
      self%last_time = state%t
      stop = mod(self%seen, self%stop_after) == 0
   end subroutine stopping_observe

   recursive subroutine failing_record(self, state, status)
      class(failing_recorder), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      if (self%count == 2) then
         call status%set(dynstep_no_memory, 'no room for a third point')
      else
         self%count = self%count + merge(1, 0, size(state%y) > 0)
      end if
   end subroutine failing_record

   !> An observer sees each step once, may stop, and the run can be taken up again
   subroutine test_observer(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(stopping_observer) :: observer
      type(integration_type) :: in_pieces
      type(trajectory_type) :: whole, points
      type(state_type) :: at_end, state
      type(status_type) :: status
      call run(problem_cubic, 'newmark-extrapolation', 0.0_wp, 2.0_wp, control_type(h=0.1_wp, every=4), whole, at_end, &
         & status)
      call prepare(problem_cubic, 'newmark-extrapolation', 0.0_wp, sys, stepper, state, status)
      call in_pieces%begin(sys, state, 2.0_wp, control_type(h=0.1_wp, every=4), status)
      observer%stop_after = 6
      call in_pieces%proceed(stepper, sys, state, status, points, observer)
      call check(error, status%code, dynstep_stopped)
      call check(error, .not. status%failed() .and. index(status%message, 't = 0.6') > 0, trim(status%message))
      call check(error, points%count, 3, 'start, step 4, and where it stopped')
      call check(error, equal(points%t(3:3), [state%t]), 'where it stopped')
      observer%stop_after = huge(1)
      call in_pieces%proceed(stepper, sys, state, status, points, observer)
      call check(error, status%code, dynstep_success)
      call check(error, observer%seen == 20 .and. observer%in_order, 'each step once')
      call check(error, equal(state%y, at_end%y) .and. equal(state%a, at_end%a), 'the end')
      call check(error, points%count, whole%count + 1)
      call in_pieces%proceed(stepper, sys, state, status, points, observer)
      call check(error, status%code == dynstep_success .and. points%count == whole%count + 1, 'nothing more to do')

      call in_pieces%begin(sys, state, 3.0_wp, control_type(h=0.1_wp), status)
      points%count = 0
      call in_pieces%proceed(stepper, sys, state, status, points, max_steps=0)
      call check(error, status%code == dynstep_more .and. points%count == 1, 'no step allowed: the start is recorded')
      call in_pieces%proceed(stepper, sys, state, status, points, max_steps=-1)
      call check(error, status%code, dynstep_invalid_input, 'fewer than none')
      call check(error, index(status%message, 'max_steps = -1') > 0, trim(status%message))
   end subroutine test_observer

   !> t_end = t: the start is recorded, nothing is stepped
   subroutine test_no_interval(error)
      type(error_type), allocatable, intent(out) :: error
      type(trajectory_type) :: points
      type(state_type) :: state
      type(status_type) :: status
      type(control_type) :: control
      control%h = -0.1_wp
      call run(problem_cubic, 'newmark', 0.7_wp, 0.7_wp, control, points, state, status)
      call check(error, status%code, dynstep_success, trim(status%message))
      call check(error, points%count, 1)
      call check(error, equal(state%y, [start_q, start_v]))
      control%t_eval = [0.7_wp, 0.7_wp]
      call run(problem_cubic, 'newmark', 0.7_wp, 0.7_wp, control, points, state, status)
      call check(error, points%count, 2)
      control = control_type(h=0.1_wp, every=0)
      call run(problem_cubic, 'newmark', 0.7_wp, 0.7_wp, control, points, state, status)
      call check(error, points%count, 1)
   end subroutine test_no_interval

   !> Each wrong control is refused with a sentence that names it; nothing happens
   subroutine test_wrong_control(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: nan, infinity
      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      infinity = ieee_value(1.0_wp, ieee_positive_inf)
      call refused(error, control_type(), 1.0_wp, 'h must not be zero')
      call refused(error, control_type(h=nan), 1.0_wp, 'h = NaN is not finite')
      call refused(error, control_type(h=infinity), 1.0_wp, 'h = Infinity is not finite')
      call refused(error, control_type(h=-0.1_wp), 1.0_wp, 'h = -0.1 points away from t_end = 1')
      call refused(error, control_type(h=0.1_wp), -1.0_wp, 'h = 0.1 points away from t_end = -1')
      call refused(error, control_type(h=1.0e-20_wp), 1.0_wp, 'is lost in the rounding of t = 1')
      call refused(error, control_type(h=0.1_wp), nan, 't_end = NaN')
      call refused(error, control_type(h=0.1_wp), infinity, 't_end = Infinity')
      call refused(error, control_type(h=0.1_wp, every=-1), 1.0_wp, 'every = -1')
      call refused(error, control_type(h=0.1_wp, t_eval=[0.5_wp, 1.1_wp]), 1.0_wp, 't_eval(2) = 1.1 lies outside')
      call refused(error, control_type(h=0.1_wp, t_eval=[-0.5_wp]), 1.0_wp, 't_eval(1) = -0.5 lies outside')
      call refused(error, control_type(h=0.1_wp, t_eval=[0.5_wp, nan]), 1.0_wp, 't_eval(2) = NaN is not finite')
      call refused(error, control_type(h=0.1_wp, t_eval=[0.5_wp, 0.4_wp]), 1.0_wp, 't_eval(2) = 0.4 is out of order')
      call refused(error, control_type(h=-0.1_wp, t_eval=[-0.5_wp, -0.4_wp]), -1.0_wp, 'out of order')
   end subroutine test_wrong_control

   subroutine refused(error, control, t_end, words)
      type(error_type), allocatable, intent(inout) :: error
      type(control_type), intent(in) :: control
      real(wp), intent(in) :: t_end
      character(len=*), intent(in) :: words
      type(trajectory_type) :: points
      type(state_type) :: state
      type(status_type) :: status
      call run(problem_cubic, 'newmark', 0.0_wp, t_end, control, points, state, status)
      call check(error, status%code, dynstep_invalid_input, words)
      call check(error, index(status%message, words) > 0, trim(status%message))
      call check(error, points%count, 0, 'nothing is recorded')
      call check(error, equal(state%y, [start_q, start_v]) .and. equal([state%t], [0.0_wp]), 'the state is untouched')
   end subroutine refused

   !> A method without init or start, or of another system, is refused and does not crash
   subroutine test_not_started(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(bounded_system) :: other
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      call new_problem(problem_cubic, sys)
      do i = 1, size(method_names)
         if (.not. takes_forces(method_names(i))) cycle
         if (allocated(stepper)) deallocate (stepper)
         call new_method(trim(method_names(i)), stepper, status)
         call without_start('no init')
         call stepper%init(sys, status)
         call without_start('no start')
         state = new_state([start_q, start_v])
         call stepper%start(sys, state, status)
         call check(error, status%code, dynstep_success, trim(status%message))
         other%n = 1
         state = new_state([0.25_wp, 0.25_wp])
         call integrate(stepper, other, state, 1.0_wp, control_type(h=0.1_wp), status)
         call check(error, status%code, dynstep_invalid_input, 'another system')
         call status%clear()
         state = new_state([start_q, start_v])
         call integrate(stepper, sys, state, 1.0_wp, control_type(h=0.1_wp), status)
         call check(error, status%code, dynstep_invalid_input, 'a state that was not started')
         call status%clear()
      end do

   contains

      subroutine without_start(words)
         character(len=*), intent(in) :: words
         state = new_state([start_q, start_v])
         call integrate(stepper, sys, state, 1.0_wp, control_type(h=0.1_wp), status)
         call check(error, status%code, dynstep_invalid_input, words)
         call check(error, index(status%message, 'start') > 0, trim(status%message))
         call status%clear()
      end subroutine without_start
   end subroutine test_not_started

   !> A force that refuses ends the run: state, clock and points are those of the last good step
   subroutine test_failing_run(error)
      type(error_type), allocatable, intent(out) :: error
      type(bounded_system) :: sys
      class(stepper_type), allocatable :: stepper
      type(trajectory_type) :: points, later
      type(integration_type) :: in_pieces
      type(state_type) :: state, before
      type(status_type) :: status
      integer :: i, last
      sys%n = 1
      do i = 1, size(method_names)
         if (.not. takes_forces(method_names(i))) cycle
         sys%bound = 0.5_wp
         call status%clear()
         if (allocated(stepper)) deallocate (stepper)
         call new_method(trim(method_names(i)), stepper, status)
         points%count = 0
         state = new_state([0.25_wp, 1.0_wp])
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         call in_pieces%begin(sys, state, 10.0_wp, control_type(h=0.125_wp), status)
         call in_pieces%proceed(stepper, sys, state, status, points)
         call check(error, status%code, dynstep_callback_failed, trim(method_names(i)))
         call check(error, status%retry .and. index(status%message, 'force refused') > 0, trim(status%message))
         last = points%count
         call check(error, last > 1 .and. last < 6, 'some steps were made')
         call check(error, int(stepper%count%steps), last - 1, 'the points are the steps and the start')
         call check(error, equal(points%y(:, last), state%y) .and. equal(points%t(last:last), [state%t]), 'the last point')
         call check(error, points%y(1, last) <= 0.5_wp, 'in the domain')
         call check(error, points%a(1, last), -atan(points%y(1, last)), thr=acceleration_error(stepper, 0.125_wp), &
            & message='acceleration')
         before = state
         call in_pieces%proceed(stepper, sys, state, status, points)
         call check(error, points%count == last .and. equal(before%y, state%y), 'a failed status does nothing')
         ! where the reason goes away the run goes on
         call status%clear()
         sys%bound = huge(1.0_wp)
         later%count = 0
         call in_pieces%proceed(stepper, sys, state, status, later)
         call check(error, status%code, dynstep_success, trim(status%message))
         call check(error, later%count, 81 - last, 'the other steps')
         call check(error, equal(state%y, later%y(:, later%count)) .and. equal([state%t], [10.0_wp]), 'the end')
      end do
   end subroutine test_failing_run

   !> Of a method with a memory of accelerations: h^2 a''/2 at most, and |a''| < 2 here; of the others round-off
   real(wp) function acceleration_error(stepper, h)
      class(stepper_type), intent(in) :: stepper
      real(wp), intent(in) :: h
      type(method_properties) :: facts
      facts = stepper%properties()
      acceleration_error = merge(1.0e-15_wp, h**2, facts%step_growth_limit >= huge(1.0_wp))
   end function acceleration_error

   subroutine test_failing_recorder(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(failing_recorder) :: recorder
      type(state_type) :: state
      type(status_type) :: status
      call prepare(problem_cubic, 'newmark', 0.0_wp, sys, stepper, state, status)
      call integrate(stepper, sys, state, 1.0_wp, control_type(h=0.125_wp), status, recorder)
      call check(error, status%code, dynstep_no_memory)
      call check(error, trim(status%message), 'no room for a third point')
      call check(error, equal([state%t], [0.25_wp]), 'the run ended there')
   end subroutine test_failing_recorder

   !> A status that failed before: nothing is done
   subroutine test_failed_status(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(trajectory_type) :: points
      type(state_type) :: state
      type(status_type) :: status
      call prepare(problem_cubic, 'newmark', 0.0_wp, sys, stepper, state, status)
      call status%set(dynstep_file_error, 'something before')
      call integrate(stepper, sys, state, 1.0_wp, control_type(h=0.125_wp), status, points)
      call check(error, trim(status%message), 'something before')
      call check(error, points%count == 0 .and. equal([state%t], [0.0_wp]))
      call check(error, int(stepper%count%steps), 0)
   end subroutine test_failed_status
end module test_endings
