! SPDX-License-Identifier: BSD-3-Clause
!> Runs over an interval with steps of one length, by any method.
!>
!> PROGRAMMING INTERFACE
!>
!>   The whole interval at once:
!>
!>     control%h = 0.01_wp
!>     call stepper%init(sys, status)
!>     call stepper%start(sys, state, status)
!>     call integrate(stepper, sys, state, t_end, control, status, recorder, observer)
!>
!>   or in pieces, with the same bits:
!>
!>     call run%begin(sys, state, t_end, control, status)
!>     do
!>        call run%proceed(stepper, sys, state, status, recorder, observer, max_steps)
!>        if (status%code /= dynstep_more) exit
!>     end do
!>
!>   The times of the steps are t0 + k h, never an accumulated sum.  Where the interval is no
!>   whole number of steps, the last step is shorter.  What is recorded: the times t_eval
!>   where they are given (interpolated inside the step that holds them), else the start,
!>   every `every`-th step, and the last point reached.
module dynstep_integrate
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: long, wp
   use dynstep_ode_system, only: ode_system
   use dynstep_start_check, only: check_state
   use dynstep_status, only: dynstep_invalid_input, dynstep_more, dynstep_not_finite, dynstep_stopped, status_type
   use dynstep_stepper, only: allocate_state, clock_type, has_shape, state_type, step_counters, stepper_type
   use dynstep_text, only: text
   use dynstep_trajectory, only: recorder_type
   implicit none
   private

   public :: check_started, check_times, integrate, steps_before_time

   !> What a run with steps of one length is asked to do
   type, public :: control_type
      real(wp) :: h = 0.0_wp                 !! step length, of the sign of t_end - t
      integer :: every = 1                   !! record every so many steps; 0: the last point only
      real(wp), allocatable :: t_eval(:)     !! times to record, in the order of the run
   end type control_type

   !> Sees every accepted state; may end the run
   type, abstract, public :: observer_type
   contains
      procedure(observe_interface), deferred :: observe
   end type observer_type

   abstract interface
      !> stop = .true. ends the run with status dynstep_stopped
      recursive subroutine observe_interface(self, stepper, state, stop)
         import :: observer_type, state_type, stepper_type
         class(observer_type), intent(inout) :: self
         class(stepper_type), intent(in) :: stepper      !! for its counters
         type(state_type), intent(in) :: state
         logical, intent(inout) :: stop
      end subroutine observe_interface
   end interface

   !> A run that can be left and taken up again; how it chooses its steps is left to extensions
   type, abstract, public :: run_type
      real(wp) :: t_end = 0.0_wp
   contains
      procedure(proceed_interface), deferred :: proceed
      procedure(steps_for_interface), deferred :: steps_for
   end type run_type

   abstract interface
      !> Go on to t_end, or for max_steps accepted steps and then say dynstep_more.  News of an earlier call in `status`
      !> are cleared.
      recursive subroutine proceed_interface(self, stepper, sys, state, status, recorder, observer, max_steps)
         import :: observer_type, ode_system, recorder_type, run_type, state_type, status_type, stepper_type
         class(run_type), intent(inout) :: self
         class(stepper_type), intent(inout) :: stepper
         class(ode_system), intent(inout) :: sys
         type(state_type), intent(inout) :: state
         type(status_type), intent(inout) :: status
         class(recorder_type), intent(inout), optional :: recorder
         class(observer_type), intent(inout), optional :: observer
         integer, intent(in), optional :: max_steps          !! >= 0; 0 records the start, no more
      end subroutine proceed_interface

      !> How many steps record no more points than there is room for, but perhaps in the last of them, where t_eval has
      !> many inside one step; 0: the start alone.  The end of a run, planned or not, records one point more, and it does
      !> so before the last of the points counted on here.
      pure integer(long) function steps_for_interface(self, state, recorded, room)
         import :: long, run_type, state_type
         class(run_type), intent(in) :: self
         type(state_type), intent(in) :: state
         integer(long), intent(in) :: recorded               !! points since `begin`
         integer(long), intent(in) :: room                   !! points, >= 1
      end function steps_for_interface
   end interface

   !> A run with steps of one length
   type, extends(run_type), public :: integration_type
      type(control_type) :: control
      type(clock_type), private :: clock                 ! of the steps of full length
      integer(long), private :: full_steps = 0           ! how many there are
      real(wp), private :: last_step = 0.0_wp            ! length of the shorter last one, or 0
      integer, private :: next = 1                       ! first t_eval that is not recorded
      logical, private :: fresh = .true.                 ! nothing done since `begin`
      logical, private :: recorded = .false.             ! the present state is recorded
      integer, private :: longest_block = huge(1)        ! steps that are made at once
      type(state_type), private :: left, point           ! begin of a step, point inside it
   contains
      procedure :: begin => integration_begin
      procedure :: proceed => integration_proceed
      procedure :: steps_for => integration_steps_for
      procedure :: finished => integration_finished
   end type integration_type

contains

   !> From state%t to t_end.  On return `state` is the last accepted state, also on failure.
   recursive subroutine integrate(stepper, sys, state, t_end, control, status, recorder, observer)
      class(stepper_type), intent(inout) :: stepper       !! started on `sys` and `state`
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: t_end
      type(control_type), intent(in) :: control
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(observer_type), intent(inout), optional :: observer
      type(integration_type) :: run
      call run%begin(sys, state, t_end, control, status)
      call run%proceed(stepper, sys, state, status, recorder, observer)
   end subroutine integrate

   !> Check the control and count the steps
   recursive subroutine integration_begin(self, sys, state, t_end, control, status)
      class(integration_type), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: state               !! the start
      real(wp), intent(in) :: t_end
      type(control_type), intent(in) :: control
      type(status_type), intent(inout) :: status
      real(wp) :: span, steps

      call check_control(control, state%t, t_end, status)
      if (status%failed()) return
      self%control = control
      self%t_end = t_end
      self%clock = clock_type(t0=state%t, h=control%h, k=0)
      self%next = 1
      self%fresh = .true.
      self%recorded = .false.
      self%longest_block = huge(1)
      span = t_end - state%t
      steps = anint(span/control%h)
      ! h, span and both times carry rounding errors of half a unit each
      if (abs(steps*control%h - span) <= 2.0_wp*epsilon(1.0_wp)*(abs(state%t) + abs(t_end) + abs(span))) then
         self%full_steps = int(steps, long)
         self%last_step = 0.0_wp
      else
         self%full_steps = int(span/control%h, long)
         self%last_step = t_end - self%clock%time() - real(self%full_steps, wp)*control%h
      end if
      call allocate_state(sys, self%left, status)
      call allocate_state(sys, self%point, status)
   end subroutine integration_begin

   recursive subroutine check_control(control, t, t_end, status)
      type(control_type), intent(in) :: control
      real(wp), intent(in) :: t, t_end
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      if (.not. ieee_is_finite(t)) then
         call status%set(dynstep_invalid_input, 'the time of the state is '//text(t))
      else if (.not. ieee_is_finite(t_end)) then
         call status%set(dynstep_invalid_input, 't_end = '//text(t_end)//' is not finite')
      else if (.not. ieee_is_finite(control%h)) then
         call status%set(dynstep_invalid_input, 'h = '//text(control%h)//' is not finite')
      else if (abs(control%h) <= 0.0_wp) then
         call status%set(dynstep_invalid_input, 'h must not be zero')
      else if ((t_end - t)*sign(1.0_wp, control%h) < 0.0_wp) then
         call status%set(dynstep_invalid_input, 'h = '//text(control%h)//' points away from t_end = ' &
            & //text(t_end)//' at t = '//text(t)//'; change its sign')
      else if (abs(control%h) <= spacing(max(abs(t), abs(t_end)))) then
         call status%set(dynstep_invalid_input, 'h = '//text(control%h)//' is lost in the rounding of t = ' &
            & //text(max(abs(t), abs(t_end))))
      else if (control%every < 0) then
         call status%set(dynstep_invalid_input, 'every = '//text(control%every)//' must be 0 or more')
      end if
      if (allocated(control%t_eval)) call check_times(control%t_eval, t, t_end, status)
   end subroutine check_control

   !> Times to record lie inside the interval, in the order of the run
   recursive subroutine check_times(t_eval, t, t_end, status)
      real(wp), intent(in) :: t_eval(:)
      real(wp), intent(in) :: t, t_end               !! begin and end of the run
      type(status_type), intent(inout) :: status
      integer :: i
      real(wp) :: direction

      direction = sign(1.0_wp, t_end - t)
      do i = 1, size(t_eval)
         if (status%failed()) return
         associate (te => t_eval(i))
            if (.not. ieee_is_finite(te)) then
               call refuse('is not finite')
            else if (direction*(te - t) < 0.0_wp .or. direction*(t_end - te) < 0.0_wp) then
               call refuse('lies outside the interval from '//text(t)//' to '//text(t_end))
            else if (direction*(te - t_eval(max(1, i - 1))) < 0.0_wp) then
               call refuse('is out of order; sort t_eval in the direction of the run')
            end if
         end associate
      end do

   contains

      recursive subroutine refuse(why)
         character(len=*), intent(in) :: why
         call status%set(dynstep_invalid_input, 't_eval('//text(i)//') = '//text(t_eval(i))//' '//why)
      end subroutine refuse
   end subroutine check_times

   !> The method was started, on a state of this system
   recursive subroutine check_started(stepper, sys, state, status)
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      if (.not. (stepper%is_started .and. stepper%fits(sys))) then
         call status%set(dynstep_invalid_input, 'the method is not started on this system of n = '//text(sys%n) &
            & //' unknowns; call init and start before a run')
         return
      end if
      call check_state('the state', sys, state, status)
      if (status%failed() .or. has_shape(sys, state)) return
      call status%set(dynstep_invalid_input, 'the state has no accelerations of this system; call start on it before a run')
   end subroutine check_started

   pure integer(long) function integration_steps_for(self, state, recorded, room)
      class(integration_type), intent(in) :: self
      type(state_type), intent(in) :: state
      integer(long), intent(in) :: recorded, room
      integer(long) :: points
      if (allocated(self%control%t_eval)) then
         integration_steps_for = steps_before_time(self%control%t_eval, recorded + room + 1, state%t, self%control%h)
      else if (self%control%every > 0) then
         points = room - merge(1, 0, recorded == 0)          ! the start
         integration_steps_for = points*self%control%every - mod(self%clock%k, int(self%control%every, long))
      else
         integration_steps_for = huge(integration_steps_for)
      end if
   end function integration_steps_for

   !> Steps up to the one that reaches t_eval(i), 1 or more; any number where there is no such time
   pure integer(long) function steps_before_time(t_eval, i, t, longest)
      real(wp), intent(in) :: t_eval(:)
      integer(long), intent(in) :: i
      real(wp), intent(in) :: t                           !! present time
      real(wp), intent(in) :: longest                     !! step, in the direction of the run; 0 where that ends at t
      steps_before_time = huge(steps_before_time)
      if (i > size(t_eval)) return
      steps_before_time = 1
      if (abs(longest) > 0.0_wp) steps_before_time = max(1_long, int(min((t_eval(i) - t)/longest, real(huge(1), wp)), long))
   end function steps_before_time

   !> True where t_end is reached
   pure logical function integration_finished(self)
      class(integration_type), intent(in) :: self
      integration_finished = self%clock%k >= self%full_steps .and. .not. abs(self%last_step) > 0.0_wp
   end function integration_finished

   recursive subroutine integration_proceed(self, stepper, sys, state, status, recorder, observer, max_steps)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(observer_type), intent(inout), optional :: observer
      integer, intent(in), optional :: max_steps          !! >= 0; 0 records the start, no more
      integer :: allowed, steps
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
      do while (.not. self%finished() .and. .not. status%failed())
         if (allowed <= 0) then
            call status%set(dynstep_more, 'the allowance of steps of this call is used up at t = ' &
               & //text(state%t)//'; call again to go on')
            return
         end if
         steps = block_length(self, allowed, present(recorder), present(observer))
         call make_steps(self, stepper, sys, state, steps, status)
         allowed = allowed - steps
         if (status%failed()) exit
         call record_point(self, stepper, sys, state, status, recorder)
         if (status%failed() .or. .not. present(observer)) cycle
         stop_asked = .false.
         call observer%observe(stepper, state, stop_asked)
         if (.not. stop_asked) cycle
         call status%set(dynstep_stopped, 'an observer asked to stop at t = '//text(state%t))
         exit
      end do
      call record_last(self, state, status, recorder)
   end subroutine integration_proceed

   !> Steps until something is to be recorded or observed.  With t_eval the step that holds
   !> the next time is made alone, since both its ends are needed.
   pure integer function block_length(self, allowed, records, observes)
      class(integration_type), intent(in) :: self
      integer, intent(in) :: allowed
      logical, intent(in) :: records, observes
      integer(long) :: steps
      steps = max(1_long, self%full_steps - self%clock%k)
      if (observes) then
         steps = 1
      else if (.not. records) then
         continue
      else if (allocated(self%control%t_eval)) then
         if (self%next <= size(self%control%t_eval)) then
            associate (ahead => self%control%t_eval(self%next) - self%clock%time())
               steps = min(steps, max(1_long, int(ahead/self%clock%h, long) - 1))
            end associate
         end if
      else if (self%control%every > 0) then
         steps = min(steps, self%control%every - mod(self%clock%k, int(self%control%every, long)))
      end if
      block_length = int(min(steps, int(min(allowed, self%longest_block), long)))
   end function block_length

   !> `steps` full steps, or the shorter last one.  Where they leave the range of numbers they
   !> are taken back, and fewer are tried, until the last state that is finite is found.
   recursive subroutine make_steps(self, stepper, sys, state, steps, status)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      integer, intent(inout) :: steps                    !! steps to make, then those that were made
      type(status_type), intent(inout) :: status
      type(clock_type) :: clock, full_clock
      type(step_counters) :: count

      full_clock = self%clock
      count = stepper%count
      call copy_point(state, self%left)
      do
         clock = full_clock
         if (clock%k >= self%full_steps) clock = clock_type(t0=state%t, h=self%last_step, k=0)
         call stepper%advance(sys, state, clock, steps, status, complete=.true.)
         if (all(ieee_is_finite(state%y))) exit
         call copy_point(self%left, state)
         stepper%count = count
         if (steps == 1) then
            call status%set(dynstep_not_finite, 'the step from t = '//text(state%t)//' leaves the range of numbers; the ' &
               & //'motion grows, or h = '//text(clock%h)//' is beyond the stability limit of the method', retry=.true.)
            return
         end if
         call status%clear()
         steps = steps/2
         self%longest_block = steps
      end do
      if (full_clock%k < self%full_steps) then
         if (clock%k > full_clock%k) self%recorded = .false.
         self%clock = clock
      else
         if (status%failed()) return
         self%last_step = 0.0_wp
         self%recorded = .false.
      end if
      if (self%finished()) state%t = self%t_end
   end subroutine make_steps

   recursive subroutine copy_point(from, to)
      type(state_type), intent(in) :: from
      type(state_type), intent(inout) :: to
      to%t = from%t
      to%y = from%y
      to%a = from%a
      to%lambda = from%lambda
      to%psi = from%psi
   end subroutine copy_point

   recursive subroutine record_start(self, state, status, recorder)
      class(integration_type), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      self%fresh = .false.
      if (.not. present(recorder)) return
      if (allocated(self%control%t_eval)) then
         do while (self%next <= size(self%control%t_eval))
            if (abs(self%control%t_eval(self%next) - state%t) > 0.0_wp) exit
            call recorder%record(state, status)
            self%next = self%next + 1
         end do
      else if (self%control%every > 0) then
         call recorder%record(state, status)
         self%recorded = .true.
      end if
   end subroutine record_start

   !> What the steps just made have to give to the recorder
   recursive subroutine record_point(self, stepper, sys, state, status, recorder)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      real(wp) :: te

      if (.not. present(recorder)) return
      if (.not. allocated(self%control%t_eval)) then
         if (self%control%every == 0) return
         if (mod(self%clock%k, int(self%control%every, long)) /= 0) return
         call recorder%record(state, status)
         self%recorded = .true.
         return
      end if
      do while (self%next <= size(self%control%t_eval))
         te = self%control%t_eval(self%next)
         if (sign(1.0_wp, self%clock%h)*(te - state%t) > 0.0_wp) return
         if (abs(te - state%t) > 0.0_wp) then
            call stepper%interpolate(sys, self%left, state, te, self%point)
            call recorder%record(self%point, status)
         else
            call recorder%record(state, status)
         end if
         self%next = self%next + 1
      end do
   end subroutine record_point

   !> The point where the run ended, unless t_eval says what is wanted
   recursive subroutine record_last(self, state, status, recorder)
      class(integration_type), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      type(status_type) :: own
      if (.not. present(recorder) .or. self%recorded .or. allocated(self%control%t_eval)) return
      call recorder%record(state, own)
      self%recorded = .true.
      if (own%failed() .and. .not. status%failed()) status = own
   end subroutine record_last
end module dynstep_integrate
