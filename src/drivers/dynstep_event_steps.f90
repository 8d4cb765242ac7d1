! SPDX-License-Identifier: BSD-3-Clause
!> Steps that end where a function is zero, and what is done there.
!>
!> A step in which a function of the events, or a switch function of the system, goes through zero on the interpolant
!> (DYNSTEP_EVENT_WATCH) is made again, up to the zero: real steps are made to times that a secant gives, until the zero is
!> within the resolution of t.  There sides of switches change, events are noted and acted upon, and behind a switch, or an
!> action that has changed something, the method starts anew.
!>
!> PROGRAMMING INTERFACE, for runs (DYNSTEP_RUN), which extend this and give TRY and RESTARTED
!>
!>     call self%allocate_events(sys, status)                         storage
!>     call self%begin_events(sys, state, status, events)             functions and their signs at the start
!>     call self%cut_at_zero(stepper, sys, state, order, no_step, status, events)     a good trial in self%left: which = 0, or
!>                                                                    the function that is zero at its end
!>     call self%meet_events(...)                                     where which > 0, after the trial was accepted
module dynstep_event_steps
   use dynstep_archive, only: archive_type
   use dynstep_event_watch, only: event_watch
   use dynstep_events, only: event_log, event_type
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_start_check, only: check_state
   use dynstep_status, only: dynstep_callback_failed, dynstep_not_converged, dynstep_not_finite, dynstep_too_many_events, &
      & status_type
   use dynstep_stepper, only: allocate_state, state_type, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   type, abstract, public :: event_steps_type
      type(event_log) :: log                             !! events that were met since the begin
      type(event_watch) :: watch
      type(state_type) :: left                           !! begin of the last step; before it is accepted, the trial
      integer :: which = 0                               !! function that is zero at the end of the step; 0: none
      real(wp), private :: t_begin = 0.0_wp              ! of the run
      real(wp), allocatable, private :: last_time(:)     ! [watch%count] of each function's last event
      integer, allocatable, private :: quick_events(:)   ! [watch%count] so many of its events lie too close to one another
      logical, private :: has_changed = .false.          ! something, at the last event
      type(state_type), private :: before                ! an action
   contains
      procedure :: allocate_events => steps_allocate_events
      procedure :: begin_events => steps_begin_events
      procedure :: cut_at_zero => steps_cut_at_zero
      procedure :: meet_events => steps_meet_events
      procedure :: archive_events => steps_archive_events
      procedure(try_interface), deferred :: try
      procedure(restarted_interface), deferred :: restarted
   end type event_steps_type

   abstract interface
      !> A trial step to t1, in self%left
      recursive subroutine try_interface(self, stepper, sys, state, t1, status)
         import :: ode_system, event_steps_type, state_type, status_type, stepper_type, wp
         class(event_steps_type), intent(inout) :: self
         class(stepper_type), intent(inout) :: stepper
         class(ode_system), intent(inout) :: sys
         type(state_type), intent(in) :: state
         real(wp), intent(in) :: t1
         type(status_type), intent(inout) :: status
      end subroutine try_interface

      !> The method was started anew at `state`
      recursive subroutine restarted_interface(self, stepper, sys, state, status)
         import :: ode_system, event_steps_type, state_type, status_type, stepper_type
         class(event_steps_type), intent(inout) :: self
         class(stepper_type), intent(inout) :: stepper
         class(ode_system), intent(inout) :: sys
         type(state_type), intent(in) :: state
         type(status_type), intent(inout) :: status
      end subroutine restarted_interface
   end interface

   !> Events of one function that are nearer to each other than this part of the time, so many times one after the other, are
   !> bounces that come to an end, or chatter: with shorter ones the resolution of t is used up
   real(wp), parameter :: quick = 1.0e5_wp*epsilon(1.0_wp)
   integer, parameter :: most_quick_events = 3

   !> Most real steps to one zero: bisection of any step needs 52
   integer, parameter :: most_trials = 60

   !> Zeros of one function that are nearer to each other than so many resolutions of t are one, unless something changed there:
   !> rounding errors of sin(2 pi t) near t = 1e6 have several
   real(wp), parameter :: same_zero = 32.0_wp

   !> Halvings of a step before a zero that does not succeed; of one in which a function refuses its arguments, as it may do
   !> close behind its zero: where it does so 1e-3 behind it, steps of 1.6 take more than 10
   integer, parameter :: most_halvings = 10, most_refusals = 30

contains

   !> Storage; the log is emptied
   recursive subroutine steps_allocate_events(self, sys, status)
      class(event_steps_type), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      self%which = 0
      self%log%count = 0
      call allocate_state(sys, self%left, status)
      call allocate_state(sys, self%before, status)
   end subroutine steps_allocate_events

   !> Which functions there are, and their signs at the start
   recursive subroutine steps_begin_events(self, sys, state, status, events)
      class(event_steps_type), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      self%t_begin = state%t
      self%has_changed = .false.
      call self%watch%begin(sys, status, events)
      if (allocated(self%last_time)) deallocate (self%last_time, self%quick_events)
      allocate (self%last_time(self%watch%count), source=huge(1.0_wp))
      allocate (self%quick_events(self%watch%count), source=0)
      call self%watch%look_at_state(sys, state, status, events)
   end subroutine steps_begin_events

   !> The trial in self%left is good.  Where a function goes through zero in it, it is made anew up to there and self%which
   !> tells the function.  `no_step`: the zero is at `state` itself, and no step is to be accepted.
   recursive subroutine steps_cut_at_zero(self, stepper, sys, state, order, no_step, status, events)
      class(event_steps_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      integer, intent(in) :: order                        !! of the method in the trial
      logical, intent(out) :: no_step
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      real(wp) :: t, t1
      integer :: trial

      self%which = 0
      no_step = .false.
      if (status%failed() .or. self%watch%count == 0) return
      do trial = 0, most_refusals
         t1 = self%left%t
         call self%watch%first_zero(stepper, sys, state, self%left, order, self%which, t, status, events)
         if (status%failed() .and. status%retry .and. trial < most_refusals) then
            ! a function refuses the end of the step: half of it
            call status%clear()
            t1 = state%t + 0.5_wp*(t1 - state%t)
         else
            if (status%failed()) return
            if (self%which > 0) call step_to_zero(self, stepper, sys, state, t, t1, no_step, status, events)
            if (status%failed()) return
            if (.not. is_met(self, state, t, t1)) exit
            call self%watch%pass_zero(self%which)
            no_step = .false.
         end if
         call self%try(stepper, sys, state, t1, status)
         if (status%failed()) return
      end do
      if (self%which == 0) call self%watch%pass()
   end subroutine steps_cut_at_zero

   !> The zero of an event that was noted at this state and changed nothing: steps lead to within the resolution of it
   pure logical function is_met(self, state, t, t1)
      class(event_steps_type), intent(in) :: self
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: t, t1
      is_met = .false.
      if (self%which <= self%watch%switches .or. self%has_changed) return
      is_met = max(abs(state%t - self%last_time(self%which)), abs(t - state%t)) <= same_zero*resolution_of(state%t, t1)
   end function is_met

   !> Of times in a step
   pure real(wp) function resolution_of(t, t1)
      real(wp), intent(in) :: t, t1
      resolution_of = 2.0_wp*epsilon(1.0_wp)*max(abs(t), abs(t1), abs(t1 - t))
   end function resolution_of

   !> Real steps from `state`, to the zero of function `which` that the interpolant has at t, between state and t1: a secant
   !> inside a bracket.  Where the real steps have no zero, the step to t1 is made anew and `which` is 0.
   recursive subroutine step_to_zero(self, stepper, sys, state, t, t1, no_step, status, events)
      class(event_steps_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(inout) :: t
      real(wp), intent(in) :: t1
      logical, intent(out) :: no_step
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      real(wp) :: before, behind, slope, resolution, next, value, last_t, last_value
      logical :: has_behind
      integer :: trial

      resolution = resolution_of(state%t, t1)
      before = state%t
      behind = t1
      has_behind = self%watch%ends_behind(self%which)
      slope = self%watch%slope(stepper, sys, state, self%left, self%which, t, status, events)
      no_step = .false.
      last_t = t1
      last_value = 0.0_wp
      do trial = 1, most_trials
         if (status%failed()) return
         no_step = abs(t - state%t) <= resolution
         if (no_step) then
            call self%watch%evaluate(sys, state%t, state%y, status, events)
            return
         end if
         call self%try(stepper, sys, state, t, status)
         if (status%failed() .and. status%retry) then
            call step_before(self, stepper, sys, state, t, status, events)
            return
         end if
         call self%watch%evaluate(sys, t, self%left%y, status, events)
         if (status%failed()) return
         value = self%watch%value(self%which)
         if (.not. abs(value) > 0.0_wp) return
         if (self%watch%has_crossed(self%which)) then
            behind = t
            has_behind = .true.
         else
            before = t
         end if
         if (trial > 1 .and. abs(t - last_t) > 0.0_wp) slope = (value - last_value)/(t - last_t)
         last_t = t
         last_value = value
         next = t1 + 2.0_wp*(t1 - state%t)
         if (abs(slope)*abs(t1 - state%t) > abs(value)) next = t - value/slope
         if (.not. (next - before)*(next - behind) < 0.0_wp) then
            if (.not. has_behind .and. abs(next - state%t) >= abs(t1 - state%t)) exit
            ! within the resolution of an end of the bracket this is the zero
            if (abs(next - t) <= resolution .or. abs(behind - before) <= resolution) return
            next = before + 0.5_wp*(behind - before)
         end if
         if (abs(next - t) <= resolution) return
         t = next
      end do
      if (trial > most_trials) then
         call status%set(dynstep_not_converged, 'the zero of a switch or event function near t = '//text(t)//' was not found in ' &
            & //text(most_trials)//' steps; is the function continuous?')
         return
      end if
      self%which = 0
      call self%try(stepper, sys, state, t1, status)
      call self%watch%evaluate(sys, t1, self%left%y, status, events)
      call self%watch%take_end()
   end subroutine step_to_zero

   !> A step to t, before a zero, failed though a longer one did not (an iteration that just converges): half the way is made
   !> first, without a zero at its end
   recursive subroutine step_before(self, stepper, sys, state, t, status, events)
      class(event_steps_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: t
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      real(wp) :: part
      integer :: trial
      self%which = 0
      part = 1.0_wp
      do trial = 1, most_halvings
         part = 0.5_wp*part
         call status%clear()
         call self%try(stepper, sys, state, state%t + part*(t - state%t), status)
         if (.not. (status%failed() .and. status%retry)) exit
      end do
      call self%watch%evaluate(sys, self%left%t, self%left%y, status, events)
      if (.not. status%failed()) call self%watch%take_end()
   end subroutine step_before

   !> At a state where functions are zero: sides change, events are noted and acted upon, and where something changed the
   !> method starts anew
   recursive subroutine steps_meet_events(self, stepper, sys, state, has_step, is_changed, terminal, status, events)
      class(event_steps_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(in) :: has_step                    !! from self%left to `state`
      logical, intent(out) :: is_changed                 !! the method was started anew
      integer, intent(out) :: terminal                   !! event that is to end the run, 0: none
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      integer :: i

      terminal = 0
      is_changed = .false.
      if (has_step) then
         call self%watch%fire(stepper, sys, self%left, state, self%which, resolution_of(self%left%t, state%t), status, events)
      else
         call self%watch%fire(stepper, sys, state, state, self%which, 0.0_wp, status, events)
      end if
      if (status%failed()) return
      self%which = 0
      call look_for_chatter(self, state%t, status)
      if (status%failed()) return
      do i = 1, self%watch%count
         if (.not. self%watch%fired(i)) cycle
         if (i <= self%watch%switches) then
            sys%side(i) = -sys%side(i)
            call sys%sides_changed()
            is_changed = .true.
         else
            call meet_one(self, i - self%watch%switches, sys, state, is_changed, terminal, status, events)
         end if
         if (status%failed()) return
      end do
      self%has_changed = is_changed
      if (is_changed) then
         call stepper%restart(sys, state, status)
         call self%restarted(stepper, sys, state, status)
      end if
      call self%watch%look_at_state(sys, state, status, events)
   end subroutine steps_meet_events

   !> Events that come too quickly one after the other end the run, else it would go on for ever
   recursive subroutine look_for_chatter(self, t, status)
      class(event_steps_type), intent(inout) :: self
      real(wp), intent(in) :: t
      type(status_type), intent(inout) :: status
      integer :: i
      do i = 1, self%watch%count
         if (.not. self%watch%fired(i)) cycle
         if (abs(t - self%last_time(i)) <= quick*max(abs(t), abs(t - self%t_begin))) then
            self%quick_events(i) = self%quick_events(i) + 1
         else
            self%quick_events(i) = 0
         end if
         self%last_time(i) = t
      end do
      if (maxval(self%quick_events) <= most_quick_events) return
      call status%set(dynstep_too_many_events, 'events come one after the other up to t = '//text(t)//': the motion chatters, ' &
         & //'bounces to an end, or slides along a surface; give the motion behind it equations of its own, or end the run at ' &
         & //'this event')
   end subroutine look_for_chatter

   !> Note event i and act
   recursive subroutine meet_one(self, i, sys, state, is_changed, terminal, status, events)
      class(event_steps_type), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: is_changed
      integer, intent(inout) :: terminal                  !! event that is to end the run, where there is one
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      logical :: changed
      integer :: ierr
      if (.not. present(events)) return
      call self%log%add(i, state, status)
      if (status%failed()) return
      self%before%t = state%t
      self%before%y = state%y
      changed = .false.
      call events%act(i, sys, state, changed, ierr)
      state%t = self%before%t
      if (ierr /= 0) then
         call status%set(dynstep_callback_failed, 'the action at event '//text(i)//' gave up at t = '//text(state%t) &
            & //' (ierr = '//text(ierr)//')')
         state%y = self%before%y
         return
      end if
      call check_state('the state behind event '//text(i)//' at t = '//text(state%t), sys, state, status)
      if (status%failed()) then
         if (size(state%y) == size(self%before%y)) status%code = dynstep_not_finite
         state%y = self%before%y
         return
      end if
      ! an action may forget to say so
      is_changed = is_changed .or. changed .or. any(abs(state%y - self%before%y) > 0.0_wp)
      if (.not. allocated(events%terminal)) return
      if (events%terminal(i)) terminal = i
   end subroutine meet_one

   !> To a checkpoint or from it
   recursive subroutine steps_archive_events(self, file)
      class(event_steps_type), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      if (file%failed()) return
      call file%item('t_begin', self%t_begin)
      call file%item('has_changed', self%has_changed)
      if (file%is_reading .and. allocated(self%last_time)) deallocate (self%last_time, self%quick_events)
      call file%item('last_time', self%last_time)
      call file%item('quick_events', self%quick_events)
      call self%log%archive(file)
      call self%watch%archive(file)
   end subroutine steps_archive_events
end module dynstep_event_steps
