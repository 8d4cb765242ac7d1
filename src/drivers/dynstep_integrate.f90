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
!>   or in pieces, with the same bits: run%begin(sys, state, t_end, control, status), then run%proceed, see DYNSTEP_RUN.
!>
!>   The times of the steps are t0 + k h, never an accumulated sum.  Where the interval is no
!>   whole number of steps, the last step is shorter.  What is recorded: the times t_eval
!>   where they are given (interpolated inside the step that holds them), else the start,
!>   every `every`-th step, and the last point reached.
!>
!>   A step that is cut at an event is followed by a shorter one to the next of these times, so that all others have the
!>   length h.  Points at events are recorded, too, without t_eval and with every > 0.
module dynstep_integrate
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_events, only: event_type
   use dynstep_kinds, only: long, wp
   use dynstep_ode_system, only: ode_system
   use dynstep_record_times, only: steps_before_time
   use dynstep_run, only: observer_type, run_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_converged, dynstep_not_finite, status_type
   use dynstep_stepper, only: clock_type, copy_state, method_properties, state_type, step_counters, stepper_type
   use dynstep_text, only: text
   use dynstep_trajectory, only: recorder_type
   implicit none
   private

   public :: integrate

   !> Section of a checkpoint
   character(len=*), parameter, public :: steps_of_one_length = 'steps of one length'

   !> What a run with steps of one length is asked to do
   type, public :: control_type
      real(wp) :: h = 0.0_wp                 !! step length, of the sign of t_end - t
      integer :: every = 1                   !! record every so many steps; 0: the last point only
      real(wp), allocatable :: t_eval(:)     !! times to record, in the order of the run
   end type control_type

   !> A run with steps of one length
   type, extends(run_type), public :: integration_type
      type(control_type) :: control
      type(clock_type), private :: clock                 ! of the steps of full length
      integer(long), private :: full_steps = 0           ! how many there are
      real(wp), private :: last_step = 0.0_wp            ! length of the shorter last one, or 0
      integer, private :: longest_block = huge(1)        ! steps that are made at once
      logical, private :: is_cut = .false.               ! the present state lies inside a step
      logical, private :: is_at_event = .false.          ! and there is an event
      real(wp), private :: length = 0.0_wp               ! of the last step, where steps are made one by one
      real(wp), private :: growth_limit = huge(1.0_wp)   ! of the method
   contains
      procedure :: begin => integration_begin
      procedure :: make_steps => integration_make_steps
      procedure :: try => integration_try
      procedure :: restarted => integration_restarted
      procedure :: wants_point => integration_wants_point
      procedure :: steps_for => integration_steps_for
      procedure :: finished => integration_finished
      procedure :: archive_parts => integration_archive_parts
   end type integration_type

   !> A step that is watched is divided into 2**10 parts at most, as `advance` of SOI2 does
   integer, parameter :: most_halvings = 10

contains

   !> From state%t to t_end.  On return `state` is the last accepted state, also on failure.
   recursive subroutine integrate(stepper, sys, state, t_end, control, status, recorder, observer, events)
      class(stepper_type), intent(inout) :: stepper       !! started on `sys` and `state`
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: t_end
      type(control_type), intent(in) :: control
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(observer_type), intent(inout), optional :: observer
      class(event_type), intent(inout), optional :: events
      type(integration_type) :: run
      call run%begin(sys, state, t_end, control, status)
      call run%proceed(stepper, sys, state, status, recorder, observer, events=events)
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
      call self%begin_common(sys, state, t_end, control%t_eval, status)
      if (status%failed()) return
      self%control = control
      self%clock = clock_type(t0=state%t, h=control%h, k=0)
      self%longest_block = huge(1)
      self%is_cut = .false.
      self%is_at_event = .false.
      self%length = 0.0_wp
      self%step_order = 0
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
   end subroutine integration_begin

   recursive subroutine check_control(control, t, t_end, status)
      type(control_type), intent(in) :: control
      real(wp), intent(in) :: t, t_end
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      if (.not. (ieee_is_finite(t) .and. ieee_is_finite(t_end))) return      ! begin_common tells
      if (.not. ieee_is_finite(control%h)) then
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
   end subroutine check_control

   pure integer(long) function integration_steps_for(self, state, recorded, room)
      class(integration_type), intent(in) :: self
      type(state_type), intent(in) :: state
      integer(long), intent(in) :: recorded, room
      integer(long) :: points
      if (allocated(self%t_eval)) then
         integration_steps_for = steps_before_time(self%t_eval, recorded + room + 1, state%t, self%control%h)
      else if (self%control%every > 0) then
         points = room - merge(1, 0, recorded == 0)          ! the start
         integration_steps_for = points*self%control%every - mod(self%clock%k, int(self%control%every, long))
      else
         integration_steps_for = huge(integration_steps_for)
      end if
   end function integration_steps_for

   !> True where t_end is reached
   pure logical function integration_finished(self, state)
      class(integration_type), intent(in) :: self
      type(state_type), intent(in) :: state
      integration_finished = self%clock%k >= self%full_steps .and. .not. abs(self%last_step) > 0.0_wp
      if (self%is_cut) integration_finished = .not. abs(self%t_end - state%t) > 0.0_wp
   end function integration_finished

   pure logical function integration_wants_point(self)
      class(integration_type), intent(in) :: self
      integration_wants_point = self%control%every > 0
      if (.not. integration_wants_point .or. self%is_at_event) return
      integration_wants_point = .not. self%is_cut .and. mod(self%clock%k, int(self%control%every, long)) == 0
   end function integration_wants_point

   recursive subroutine integration_make_steps(self, stepper, sys, state, steps, is_recording, is_observed, status, events)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      integer, intent(inout) :: steps
      logical, intent(in) :: is_recording, is_observed
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      if (self%step_order == 0) call take_facts(self, stepper)
      call self%monitor%look(stepper, sys, self%clock%h, self%full_steps)
      if (self%watch%count > 0) then
         call make_watched_step(self, stepper, sys, state, steps, status, events)
      else
         steps = block_length(self, steps, is_recording, is_observed)
         call make_block(self, stepper, sys, state, steps, status)
      end if
   end subroutine integration_make_steps

   recursive subroutine take_facts(self, stepper)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      type(method_properties) :: facts
      facts = stepper%properties()
      self%step_order = facts%order
      self%growth_limit = facts%step_growth_limit
   end subroutine take_facts

   !> Steps until something is to be recorded or observed.  With t_eval the step that holds
   !> the next time is made alone, since both its ends are needed.
   pure integer function block_length(self, allowed, records, observes)
      class(integration_type), intent(in) :: self
      integer, intent(in) :: allowed
      logical, intent(in) :: records, observes
      integer(long) :: steps
      steps = max(1_long, self%full_steps - self%clock%k)
      if (observes .or. (records .and. self%keeps_nodes)) then
         steps = 1
      else if (.not. records) then
         continue
      else if (allocated(self%t_eval)) then
         associate (ahead => self%next_time() - self%clock%time())
            steps = min(steps, max(1_long, int(ahead/self%clock%h, long) - 1))
         end associate
      else if (self%control%every > 0) then
         steps = min(steps, self%control%every - mod(self%clock%k, int(self%control%every, long)))
      end if
      block_length = int(min(steps, int(min(allowed, self%longest_block), long)))
   end function block_length

   !> `steps` full steps, or the shorter last one.  Where they leave the range of numbers they
   !> are taken back, and fewer are tried, until the last state that is finite is found.
   recursive subroutine make_block(self, stepper, sys, state, steps, status)
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
      call copy_state(state, self%left)
      do
         clock = full_clock
         if (clock%k >= self%full_steps) clock = clock_type(t0=state%t, h=self%last_step, k=0)
         call stepper%advance(sys, state, clock, steps, status, complete=.true.)
         if (all(ieee_is_finite(state%y))) exit
         call copy_state(self%left, state)
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
         if (clock%k > full_clock%k) self%is_recorded = .false.
         self%clock = clock
      else
         if (status%failed()) return
         self%last_step = 0.0_wp
         self%is_recorded = .false.
      end if
      if (self%finished(state)) state%t = self%t_end
   end subroutine make_block

   !> One step to the next time t0 + k h, or to a zero of the functions that are watched before it
   recursive subroutine make_watched_step(self, stepper, sys, state, steps, status, events)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      integer, intent(out) :: steps                      !! 0 where the zero is at `state` itself
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      logical :: is_full, no_step
      real(wp) :: t1

      steps = 0
      is_full = self%clock%k < self%full_steps
      t1 = merge(self%clock%time(1), self%t_end, is_full)
      if (is_full .and. self%clock%k + 1 == self%full_steps .and. .not. abs(self%last_step) > 0.0_wp) t1 = self%t_end
      if (abs(t1 - state%t) > 2.0_wp*spacing(max(abs(t1), abs(state%t)))) then
         call limit_growth(self, stepper, sys, state, t1, status)
         call try_parts(self, stepper, sys, state, t1, status)
         call self%cut_at_zero(stepper, sys, state, self%step_order, no_step, status, events)
         if (status%failed()) return
         if (.not. no_step) then
            self%length = self%left%t - state%t
            call stepper%accept(state, self%left)
            steps = 1
         end if
         self%is_at_event = self%which > 0
         self%is_cut = self%is_at_event .or. abs(t1 - state%t) > 0.0_wp
         if (self%is_cut) return
      end if
      ! the step is complete, or what is left of it is lost in rounding
      state%t = t1
      self%is_cut = .false.
      self%is_at_event = .false.
      if (is_full) then
         self%clock%k = self%clock%k + 1
      else
         self%last_step = 0.0_wp
      end if
   end subroutine make_watched_step

   !> A trial to t1, or to a half, a quarter, ... of the way where Newton's iteration does not converge
   recursive subroutine try_parts(self, stepper, sys, state, t1, status)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: t1
      type(status_type), intent(inout) :: status
      type(status_type) :: cause
      real(wp) :: part
      integer :: halvings
      if (status%failed()) return
      part = 1.0_wp
      do halvings = 0, most_halvings
         call cause%clear()
         call self%try(stepper, sys, state, merge(t1, state%t + part*(t1 - state%t), halvings == 0), cause)
         if (.not. (cause%code == dynstep_not_converged .and. cause%retry)) exit
         stepper%count%rejections = stepper%count%rejections + 1
         part = 0.5_wp*part
      end do
      status = cause
   end subroutine try_parts

   !> Behind a very short step a method with a memory starts anew, as its slopes over that step are rounding errors
   recursive subroutine limit_growth(self, stepper, sys, state, t1, status)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: t1
      type(status_type), intent(inout) :: status
      if (.not. abs(self%length) > 0.0_wp .or. .not. abs(t1 - state%t) > abs(self%length)) return
      if (abs(t1 - state%t)/self%growth_limit > abs(self%length)) call stepper%restart(sys, state, status)
   end subroutine limit_growth

   recursive subroutine integration_try(self, stepper, sys, state, t1, status)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: t1
      type(status_type), intent(inout) :: status
      real(wp) :: h
      h = t1 - state%t
      if (.not. self%is_cut .and. abs(h - self%clock%h) <= 2.0_wp*spacing(max(abs(t1), abs(state%t)))) h = self%clock%h
      call stepper%try_step(sys, state, h, t1, self%left, status)
      if (status%failed()) return
      if (.not. all(ieee_is_finite(self%left%y))) call status%set(dynstep_not_finite, 'the step from t = '//text(state%t) &
         & //' leaves the range of numbers; the motion grows, or h = '//text(h)//' is beyond the stability limit of the method', &
         & retry=.true.)
   end subroutine integration_try

   !> Nothing: the times of the steps stay
   recursive subroutine integration_restarted(self, stepper, sys, state, status)
      class(integration_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      self%length = 0.0_wp
   end subroutine integration_restarted

   recursive subroutine integration_archive_parts(self, file)
      class(integration_type), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%section(steps_of_one_length)
      call file%item('h', self%control%h)
      call file%item('every', self%control%every)
      call self%clock%archive('clock', file)
      call file%item('full_steps', self%full_steps)
      call file%item('last_step', self%last_step)
      call file%item('longest_block', self%longest_block)
      call file%item('is_cut', self%is_cut)
      call file%item('is_at_event', self%is_at_event)
      call file%item('length', self%length)
      call file%item('growth_limit', self%growth_limit)
      call file%end_section()
   end subroutine integration_archive_parts
end module dynstep_integrate
