! SPDX-License-Identifier: BSD-3-Clause
!> Runs over an interval whose step length follows the error estimate of the method (Xie 1995, section 3.4).
!>
!> PROGRAMMING INTERFACE
!>
!>     control%tolerance = 1.0e-6_wp
!>     call stepper%init(sys, status)
!>     call stepper%start(sys, state, status)
!>     call integrate_controlled(stepper, sys, state, t_end, control, status, recorder, observer)
!>
!>   or in pieces, with the same bits, as integration_type is used: run%begin, run%proceed(..., max_steps).
!>
!> A trial whose estimate is above tolerance*max(|y|, 1), |y| the largest component, is thrown away.  One that fails for
!> a reason that a smaller step may mend - Newton's iteration, a procedure that refuses, a value that is not finite, a
!> pole on the spectrum - is tried again with half the step.  Recorded are the start and each accepted step, or the
!> times t_eval, interpolated inside a step.
module dynstep_controlled_run
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_integrate, only: check_started, check_times, observer_type, run_type, steps_before_time
   use dynstep_kinds, only: long, wp
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_more, dynstep_no_memory, dynstep_not_finite, dynstep_step_too_small, &
      & dynstep_stopped, status_type
   use dynstep_step_control, only: step_control_type
   use dynstep_stepper, only: allocate_state, method_properties, state_type, stepper_type
   use dynstep_text, only: text
   use dynstep_trajectory, only: recorder_type
   implicit none
   private

   public :: integrate_controlled

   !> A run that can be left and taken up again
   type, extends(run_type), public :: controlled_run_type
      type(step_control_type) :: control
      real(wp) :: h = 0.0_wp                             !! length of the next trial
      real(wp), private :: longest = 0.0_wp              ! step length
      real(wp), private :: error_before = -1.0_wp        ! of the last trial; < 0: none
      integer, private :: next = 1                       ! first t_eval that is not recorded
      logical, private :: fresh = .true.                 ! nothing done since `begin`
      type(state_type), private :: trial, point
      real(wp), allocatable, private :: error(:)         ! estimate [state_size]
   contains
      procedure :: begin => run_begin
      procedure :: proceed => run_proceed
      procedure :: steps_for => run_steps_for
      procedure :: finished => run_finished
   end type controlled_run_type

contains

   !> From state%t to t_end.  On return `state` is the last accepted state, also on failure.
   recursive subroutine integrate_controlled(stepper, sys, state, t_end, control, status, recorder, observer)
      class(stepper_type), intent(inout) :: stepper       !! started on `sys` and `state`, with an error estimate
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: t_end
      type(step_control_type), intent(in) :: control
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(observer_type), intent(inout), optional :: observer
      type(controlled_run_type) :: run
      call run%begin(stepper, sys, state, t_end, control, status)
      call run%proceed(stepper, sys, state, status, recorder, observer)
   end subroutine integrate_controlled

   !> Check the control, choose the first step
   recursive subroutine run_begin(self, stepper, sys, state, t_end, control, status)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: t_end
      type(step_control_type), intent(in) :: control
      type(status_type), intent(inout) :: status
      type(method_properties) :: facts
      integer :: stat

      call control%check(status)
      if (status%failed()) return
      facts = stepper%properties()
      if (facts%error_order < 1) then
         call status%set(dynstep_invalid_input, trim(facts%name)//' has no error estimate to choose steps by: give h, or ' &
            & //'take a method that has one')
      else if (.not. ieee_is_finite(state%t)) then
         call status%set(dynstep_invalid_input, 'the time of the state is '//text(state%t))
      else if (.not. ieee_is_finite(t_end)) then
         call status%set(dynstep_invalid_input, 't_end = '//text(t_end)//' is not finite')
      else if (control%h_first*sign(1.0_wp, t_end - state%t) < 0.0_wp) then
         call status%set(dynstep_invalid_input, 'h_first = '//text(control%h_first)//' points away from t_end = ' &
            & //text(t_end)//' at t = '//text(state%t)//'; change its sign')
      end if
      if (allocated(control%t_eval)) call check_times(control%t_eval, state%t, t_end, status)
      if (status%failed()) return
      self%control = control
      self%t_end = t_end
      self%longest = control%h_max
      if (.not. self%longest > 0.0_wp) self%longest = abs(t_end - state%t)/16.0_wp
      self%h = control%h_first
      if (.not. abs(self%h) > 0.0_wp) self%h = (t_end - state%t)/128.0_wp
      self%h = sign(min(abs(self%h), self%longest), self%h)
      self%error_before = -1.0_wp
      self%next = 1
      self%fresh = .true.
      call allocate_state(sys, self%trial, status)
      call allocate_state(sys, self%point, status)
      if (allocated(self%error)) deallocate (self%error)
      allocate (self%error(sys%state_size()), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the estimate of '//text(sys%state_size())//' errors')
   end subroutine run_begin

   !> Steps may be shorter than the longest one, and then it takes more of them to the same time
   pure integer(long) function run_steps_for(self, state, recorded, room)
      class(controlled_run_type), intent(in) :: self
      type(state_type), intent(in) :: state
      integer(long), intent(in) :: recorded, room
      if (allocated(self%control%t_eval)) then
         run_steps_for = steps_before_time(self%control%t_eval, recorded + room + 1, state%t, sign(self%longest, self%h))
      else
         run_steps_for = room - merge(1, 0, recorded == 0)   ! the start
      end if
   end function run_steps_for

   !> True where t_end is reached
   pure logical function run_finished(self, state)
      class(controlled_run_type), intent(in) :: self
      type(state_type), intent(in) :: state
      run_finished = .not. abs(self%t_end - state%t) > 0.0_wp
   end function run_finished

   recursive subroutine run_proceed(self, stepper, sys, state, status, recorder, observer, max_steps)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(observer_type), intent(inout), optional :: observer
      integer, intent(in), optional :: max_steps          !! >= 0; 0 records the start, no more
      integer :: allowed
      logical :: stop_asked

      if (status%failed()) return
      call status%clear()
      if (self%fresh) call check_started(stepper, sys, state, status)
      if (status%failed()) return
      allowed = huge(allowed)
      if (present(max_steps)) allowed = max_steps
      if (allowed < 0) then
         call status%set(dynstep_invalid_input, 'max_steps = '//text(allowed)//' must be 0 or more')
         return
      end if
      if (self%fresh) call record_start(self, state, status, recorder)
      do while (.not. self%finished(state) .and. .not. status%failed())
         if (allowed <= 0) then
            call status%set(dynstep_more, 'the allowance of steps of this call is used up at t = ' &
               & //text(state%t)//'; call again to go on')
            return
         end if
         call make_step(self, stepper, sys, state, status)
         if (status%failed()) return
         allowed = allowed - 1
         call record_step(self, stepper, sys, state, status, recorder)
         call stepper%accept(state, self%trial)
         if (status%failed() .or. .not. present(observer)) cycle
         stop_asked = .false.
         call observer%observe(stepper, state, stop_asked)
         if (.not. stop_asked) cycle
         call status%set(dynstep_stopped, 'an observer asked to stop at t = '//text(state%t))
         return
      end do
   end subroutine run_proceed

   !> Trials until one is good; self%trial is that one
   recursive subroutine make_step(self, stepper, sys, state, status)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      type(status_type) :: cause
      type(method_properties) :: facts
      real(wp) :: h, t1, tau, error
      logical :: is_last

      facts = stepper%properties()
      do
         h = self%h
         is_last = abs(h) >= abs(self%t_end - state%t)
         if (is_last) h = self%t_end - state%t
         if (.not. abs(h) > max(self%control%h_min, 2.0_wp*spacing(state%t)) .and. .not. is_last) then
            call too_small(self, state%t, h, cause, status)
            return
         end if
         t1 = state%t + h
         if (is_last) then
            t1 = self%t_end
         else
            h = t1 - state%t              ! what the rounding of a large t leaves
         end if
         cause = status_type()
         call stepper%try_step(sys, state, h, t1, self%trial, cause)
         if (.not. cause%failed()) call stepper%estimate_error(self%error)
         if (.not. cause%failed() .and. .not. (all(ieee_is_finite(self%error)) .and. all(ieee_is_finite(self%trial%y)))) &
            & call cause%set(dynstep_not_finite, 'the step from t = '//text(state%t)//' leaves the range of numbers', retry=.true.)
         if (cause%failed()) then
            stepper%count%rejections = stepper%count%rejections + 1
            self%h = 0.5_wp*h
            if (.not. cause%retry) then
               status = cause
               return
            else if (.not. abs(self%h) > max(self%control%h_min, 2.0_wp*spacing(state%t))) then
               call too_small(self, state%t, self%h, cause, status)
               return
            end if
            cycle
         end if
         error = maxval(abs(self%error))
         tau = self%control%tolerance*max(maxval(abs(self%trial%y)), 1.0_wp)
         self%h = self%control%next(h, tau, error, self%error_before, 1.0_wp/real(facts%error_order + 1, wp))
         self%h = sign(min(abs(self%h), self%longest), h)
         self%error_before = merge(error, -1.0_wp, error > 0.0_wp)
         if (error <= tau) return
         stepper%count%rejections = stepper%count%rejections + 1
      end do
   end subroutine make_step

   recursive subroutine too_small(self, t, h, cause, status)
      class(controlled_run_type), intent(in) :: self
      real(wp), intent(in) :: t, h
      type(status_type), intent(in) :: cause             !! of the last trial, where it failed
      type(status_type), intent(inout) :: status
      if (cause%failed()) then
         call status%set(dynstep_step_too_small, 'the step length fell to '//text(abs(h))//' at t = '//text(t)//': ' &
            & //trim(cause%message))
      else
         call status%set(dynstep_step_too_small, 'the step length fell to '//text(abs(h))//' at t = '//text(t) &
            & //': the estimated error stays above tolerance = '//text(self%control%tolerance)//'; give a larger one')
      end if
   end subroutine too_small

   recursive subroutine record_start(self, state, status, recorder)
      class(controlled_run_type), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      self%fresh = .false.
      if (.not. present(recorder)) return
      if (.not. allocated(self%control%t_eval)) then
         call recorder%record(state, status)
         return
      end if
      do while (self%next <= size(self%control%t_eval))
         if (abs(self%control%t_eval(self%next) - state%t) > 0.0_wp) return
         call recorder%record(state, status)
         self%next = self%next + 1
      end do
   end subroutine record_start

   !> The step from `state` to self%trial
   recursive subroutine record_step(self, stepper, sys, state, status, recorder)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      if (.not. present(recorder)) return
      if (.not. allocated(self%control%t_eval)) then
         call recorder%record(self%trial, status)
         return
      end if
      do while (self%next <= size(self%control%t_eval))
         associate (te => self%control%t_eval(self%next))
            if ((te - self%trial%t)*sign(1.0_wp, self%trial%t - state%t) > 0.0_wp) return
            if (abs(te - self%trial%t) > 0.0_wp) then
               call stepper%interpolate(sys, state, self%trial, te, self%point)
               call recorder%record(self%point, status)
            else
               call recorder%record(self%trial, status)
            end if
         end associate
         self%next = self%next + 1
      end do
   end subroutine record_step
end module dynstep_controlled_run
