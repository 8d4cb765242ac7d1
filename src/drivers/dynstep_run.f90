! SPDX-License-Identifier: BSD-3-Clause
!> What all runs over an interval have in common: they can be left and taken up again, record points, show them to an
!> observer, and meet events.  How steps are chosen is left to extensions.
!>
!> PROGRAMMING INTERFACE (an extension gives `begin`)
!>
!>     call run%begin(...)
!>     do
!>        call run%proceed(stepper, sys, state, status, recorder, observer, max_steps, events)
!>        if (status%code /= dynstep_more) exit
!>     end do
!>
!>   Recorded are the times t_eval where they are given (inside a step to the order of the method, see
!>   DYNSTEP_DENSE_OUTPUT), else steps, and with `keeps_nodes` points inside them for an interpolant of that order.  Where
!>   an event changes the state, both are recorded, before and after it.  Where the steps are longer than the method bears,
!>   run%monitor%warning says so with numbers.
!>
!>   A step in which a function of the events, or a switch function of the system, goes through zero is made again, up to
!>   the zero: real steps are made to times that a secant gives, until the zero is within rounding.  Behind a switch, or an
!>   action that has changed something, the method starts anew.  Events are in `run%log`.
module dynstep_run
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_dense_output, only: dense_output_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_event_watch, only: event_watch
   use dynstep_events, only: event_log, event_type
   use dynstep_kinds, only: long, wp
   use dynstep_ode_system, only: ode_system
   use dynstep_stability_monitor, only: stability_monitor
   use dynstep_start_check, only: check_state
   use dynstep_status, only: dynstep_callback_failed, dynstep_event, dynstep_invalid_input, dynstep_more, dynstep_not_converged, &
      & dynstep_not_finite, dynstep_stopped, dynstep_too_many_events, status_type
   use dynstep_stepper, only: allocate_state, has_shape, state_type, stepper_type
   use dynstep_text, only: text
   use dynstep_trajectory, only: recorder_type
   implicit none
   private

   public :: check_times, copy_point, steps_before_time

   !> Sees every accepted state; may end the run
   type, abstract, public :: observer_type
   contains
      procedure(observe_interface), deferred :: observe
   end type observer_type

   !> A run that can be left and taken up again
   type, abstract, public :: run_type
      real(wp) :: t_end = 0.0_wp
      type(event_log) :: log                             !! events that were met since `begin`
      real(wp), allocatable :: t_eval(:)                 !! times to record
      type(state_type) :: left                           !! begin of the last step; before it is accepted, the trial
      logical :: keeps_nodes = .false.                   !! the recorder gets points inside steps, too; set before `proceed`
      integer :: step_order = 0                          !! of the last step
      type(error_norm_type), allocatable :: norm         !! of a run that chooses its steps
      logical :: is_recorded = .false.                   !! the present state is recorded
      integer :: which = 0                               !! function that is zero at the end of the step; 0: none
      type(event_watch) :: watch
      type(stability_monitor) :: monitor                 !! monitor%warning tells of steps that are too long for the method
      logical, private :: fresh = .true.                 ! nothing done since `begin`
      logical, private :: is_restored = .false.          ! from a checkpoint, and not taken up yet
      logical, private :: has_dense = .false.            ! self%dense is begun
      integer, private :: next = 1                       ! first t_eval that is not recorded
      real(wp), private :: t_begin = 0.0_wp              ! of the run
      real(wp), allocatable, private :: last_time(:)     ! [watch%count] of each function's last event
      integer, allocatable, private :: quick_events(:)   ! [watch%count] so many of its events lie too close to one another
      logical, private :: has_changed = .false.          ! at the last event
      logical, private :: is_broken = .false.            ! a checkpoint could be taken over in parts only
      type(state_type), private :: point                 ! inside a step
      type(dense_output_type), private :: dense
   contains
      procedure :: proceed => run_proceed
      procedure :: begin_common => run_begin_common
      procedure :: cut_at_zero => run_cut_at_zero
      procedure :: next_time => run_next_time
      procedure :: checkpoint => run_checkpoint
      procedure :: restore => run_restore
      procedure :: recorded_points => run_recorded_points
      procedure(archive_interface), deferred :: archive_parts
      procedure(make_steps_interface), deferred :: make_steps
      procedure(try_interface), deferred :: try
      procedure(restarted_interface), deferred :: restarted
      procedure(wants_interface), deferred :: wants_point
      procedure(finished_interface), deferred :: finished
      procedure(steps_for_interface), deferred :: steps_for
   end type run_type

   abstract interface
      !> stop = .true. ends the run with status dynstep_stopped
      recursive subroutine observe_interface(self, stepper, state, stop)
         import :: observer_type, state_type, stepper_type
         class(observer_type), intent(inout) :: self
         class(stepper_type), intent(in) :: stepper      !! for its counters
         type(state_type), intent(in) :: state
         logical, intent(inout) :: stop
      end subroutine observe_interface

      !> One accepted step, or several where nothing is to be seen between them.  self%left is the begin of the last one where
      !> that is needed; self%which tells of a zero at its end (then `cut_at_zero` was called).
      recursive subroutine make_steps_interface(self, stepper, sys, state, steps, is_recording, is_observed, status, events)
         import :: event_type, ode_system, run_type, state_type, status_type, stepper_type
         class(run_type), intent(inout) :: self
         class(stepper_type), intent(inout) :: stepper
         class(ode_system), intent(inout) :: sys
         type(state_type), intent(inout) :: state
         integer, intent(inout) :: steps                 !! most that may be made, then those that were made
         logical, intent(in) :: is_recording, is_observed
         type(status_type), intent(inout) :: status
         class(event_type), intent(inout), optional :: events
      end subroutine make_steps_interface

      !> A trial step to t1, in self%left
      recursive subroutine try_interface(self, stepper, sys, state, t1, status)
         import :: ode_system, run_type, state_type, status_type, stepper_type, wp
         class(run_type), intent(inout) :: self
         class(stepper_type), intent(inout) :: stepper
         class(ode_system), intent(inout) :: sys
         type(state_type), intent(in) :: state
         real(wp), intent(in) :: t1
         type(status_type), intent(inout) :: status
      end subroutine try_interface

      !> The method was started anew at `state`
      recursive subroutine restarted_interface(self, stepper, sys, state, status)
         import :: ode_system, run_type, state_type, status_type, stepper_type
         class(run_type), intent(inout) :: self
         class(stepper_type), intent(inout) :: stepper
         class(ode_system), intent(inout) :: sys
         type(state_type), intent(in) :: state
         type(status_type), intent(inout) :: status
      end subroutine restarted_interface

      !> True where the end of the last step is to be recorded, without t_eval
      pure logical function wants_interface(self)
         import :: run_type
         class(run_type), intent(in) :: self
      end function wants_interface

      !> What the extension keeps, and the control, to a checkpoint or from it
      recursive subroutine archive_interface(self, file)
         import :: archive_type, run_type
         class(run_type), intent(inout) :: self
         type(archive_type), intent(inout) :: file
      end subroutine archive_interface

      !> True where t_end is reached
      pure logical function finished_interface(self, state)
         import :: run_type, state_type
         class(run_type), intent(in) :: self
         type(state_type), intent(in) :: state
      end function finished_interface

      !> How many steps record no more points than there is room for, but perhaps in the last of them, where t_eval has
      !> many inside one step, or an event records two; 0: the start alone.  The end of a run, planned or not, records one
      !> point more, and it does so before the last of the points counted on here.
      pure integer(long) function steps_for_interface(self, state, recorded, room)
         import :: long, run_type, state_type
         class(run_type), intent(in) :: self
         type(state_type), intent(in) :: state
         integer(long), intent(in) :: recorded               !! points since `begin`
         integer(long), intent(in) :: room                   !! points, >= 1
      end function steps_for_interface
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

   !> What `begin` of an extension does for all: times, checks, storage
   recursive subroutine run_begin_common(self, sys, state, t_end, t_eval, status)
      class(run_type), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: state               !! the start
      real(wp), intent(in) :: t_end
      real(wp), allocatable, intent(in) :: t_eval(:)
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      if (.not. ieee_is_finite(state%t)) then
         call status%set(dynstep_invalid_input, 'the time of the state is '//text(state%t))
      else if (.not. ieee_is_finite(t_end)) then
         call status%set(dynstep_invalid_input, 't_end = '//text(t_end)//' is not finite')
      end if
      if (allocated(t_eval)) call check_times(t_eval, state%t, t_end, status)
      if (status%failed()) return
      self%t_end = t_end
      if (allocated(self%t_eval)) deallocate (self%t_eval)
      if (allocated(t_eval)) self%t_eval = t_eval
      self%next = 1
      self%fresh = .true.
      self%is_recorded = .false.
      self%which = 0
      self%t_begin = state%t
      self%is_broken = .false.
      self%log%count = 0
      self%has_dense = .false.
      self%is_restored = .false.
      call allocate_state(sys, self%left, status)
      call allocate_state(sys, self%point, status)
   end subroutine run_begin_common

   !> Go on to t_end, or for max_steps accepted steps and then say dynstep_more.  News of an earlier call in `status` are
   !> cleared.  The same events are given in each call of a run.
   recursive subroutine run_proceed(self, stepper, sys, state, status, recorder, observer, max_steps, events)
      class(run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(observer_type), intent(inout), optional :: observer
      integer, intent(in), optional :: max_steps          !! >= 0; 0 records the start, no more
      class(event_type), intent(inout), optional :: events
      integer :: allowed, steps
      logical :: stop_asked

      if (status%failed()) return
      call status%clear()
      if (self%is_broken) call status%set(dynstep_invalid_input, 'the run could not take over its checkpoint; begin it, or ' &
         & //'restore it from another one')
      if (self%fresh .and. .not. status%failed()) call check_started(stepper, sys, state, status)
      if (status%failed()) return
      allowed = huge(allowed)
      if (present(max_steps)) allowed = max_steps
      if (allowed < 0) then
         call status%set(dynstep_invalid_input, 'max_steps = '//text(allowed)//' must be 0 or more')
         return
      end if
      if (self%is_restored) call take_up(self, stepper, sys, state, status, recorder, events)
      if (status%failed()) return
      if (self%fresh) call open_run(self, stepper, sys, state, status, recorder, events)
      do while (.not. self%finished(state) .and. .not. status%failed())
         if (allowed <= 0) then
            call status%set(dynstep_more, 'the allowance of steps of this call is used up at t = ' &
               & //text(state%t)//'; call again to go on')
            return
         end if
         steps = allowed
         call self%make_steps(stepper, sys, state, steps, present(recorder), present(observer), status, events)
         call self%monitor%look_at_columns(stepper)
         allowed = allowed - steps
         if (status%failed()) exit
         if (steps > 0) call record_point(self, stepper, sys, state, status, recorder)
         if (self%which > 0) call meet_events(self, stepper, sys, state, steps > 0, status, recorder, events)
         if (status%code == dynstep_event .or. status%failed()) exit
         if (.not. present(observer)) cycle
         stop_asked = .false.
         call observer%observe(stepper, state, stop_asked)
         if (.not. stop_asked) cycle
         call status%set(dynstep_stopped, 'an observer asked to stop at t = '//text(state%t))
         exit
      end do
      call record_last(self, state, status, recorder)
   end subroutine run_proceed

   !> First call of a run
   recursive subroutine open_run(self, stepper, sys, state, status, recorder, events)
      class(run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(event_type), intent(inout), optional :: events
      self%fresh = .false.
      call self%monitor%begin(stepper, sys)
      call self%watch%begin(sys, status, events)
      if (allocated(self%last_time)) deallocate (self%last_time, self%quick_events)
      allocate (self%last_time(self%watch%count), source=huge(1.0_wp))
      allocate (self%quick_events(self%watch%count), source=0)
      call self%watch%look_at_state(sys, state, status, events)
      if (status%failed()) return
      if (.not. present(recorder)) return
      self%has_dense = self%keeps_nodes .or. allocated(self%t_eval)
      if (self%has_dense) call self%dense%begin(stepper, sys, status)
      if (.not. allocated(self%t_eval)) then
         if (.not. self%wants_point() .or. status%failed()) return
         call recorder%record(state, status)
         self%is_recorded = .true.
         return
      end if
      do while (self%next <= size(self%t_eval))
         if (abs(self%t_eval(self%next) - state%t) > 0.0_wp) exit
         call recorder%record(state, status)
         self%next = self%next + 1
      end do
   end subroutine open_run

   !> First call behind `restore`.  A run that recorded nothing before may record now: times of t_eval that lie behind it are
   !> left out then.
   recursive subroutine take_up(self, stepper, sys, state, status, recorder, events)
      class(run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(event_type), intent(inout), optional :: events
      self%is_restored = .false.
      call self%watch%resume(sys, status, events)
      if (status%failed() .or. self%fresh) return
      call self%monitor%begin(stepper, sys)
      if (self%has_dense .or. .not. present(recorder)) return
      self%has_dense = self%keeps_nodes .or. allocated(self%t_eval)
      if (self%has_dense) call self%dense%begin(stepper, sys, status)
      if (.not. allocated(self%t_eval)) return
      do while (self%next <= size(self%t_eval))
         if ((self%t_eval(self%next) - state%t)*sign(1.0_wp, self%t_end - state%t) > 0.0_wp) exit
         self%next = self%next + 1
      end do
   end subroutine take_up

   !> Points that were recorded, as `steps_for` wants them; without t_eval 1 stands for any number
   pure integer(long) function run_recorded_points(self)
      class(run_type), intent(in) :: self
      run_recorded_points = merge(0, 1, self%fresh)
      if (allocated(self%t_eval)) run_recorded_points = self%next - 1
   end function run_recorded_points

   !> The first of t_eval that is not recorded; the end of the run where there is none
   pure real(wp) function run_next_time(self)
      class(run_type), intent(in) :: self
      run_next_time = self%t_end
      if (.not. allocated(self%t_eval)) return
      if (self%next <= size(self%t_eval)) run_next_time = self%t_eval(self%next)
   end function run_next_time

   !> What the step from self%left to `state` has to give to the recorder
   recursive subroutine record_point(self, stepper, sys, state, status, recorder)
      class(run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder

      self%is_recorded = .false.
      if (.not. present(recorder)) return
      if (allocated(self%t_eval)) then
         call record_times(self, stepper, sys, state, status, recorder)
         return
      end if
      if (.not. self%wants_point()) return
      if (self%keeps_nodes) call record_nodes(self, stepper, sys, state, status, recorder)
      if (status%failed()) return
      call recorder%record(state, status)
      self%is_recorded = .true.
   end subroutine record_point

   !> Points inside the step that an interpolant goes through
   recursive subroutine record_nodes(self, stepper, sys, state, status, recorder)
      class(run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout) :: recorder
      integer :: k
      call build_dense(self, stepper, sys, state, status)
      do k = 1, self%dense%last() - 1
         if (status%failed()) return
         call self%dense%node(k, self%point)
         call recorder%record_inner(self%point, status)
      end do
   end subroutine record_nodes

   !> The times of t_eval that the step holds
   recursive subroutine record_times(self, stepper, sys, state, status, recorder)
      class(run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout) :: recorder
      logical :: is_built
      is_built = .false.
      do while (self%next <= size(self%t_eval))
         associate (te => self%t_eval(self%next))
            if ((te - state%t)*sign(1.0_wp, state%t - self%left%t) > 0.0_wp) return
            if (abs(te - state%t) > 0.0_wp) then
               if (.not. is_built) call build_dense(self, stepper, sys, state, status)
               if (status%failed()) return
               is_built = .true.
               call self%dense%evaluate(sys, te, self%point)
               call recorder%record(self%point, status)
            else
               call recorder%record(state, status)
            end if
         end associate
         self%next = self%next + 1
      end do
   end subroutine record_times

   !> The interpolant of the last step, whose work counts
   recursive subroutine build_dense(self, stepper, sys, state, status)
      class(run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      call self%dense%build(sys, self%left, state, self%step_order, status, self%norm)
      call stepper%carry(self%dense%work)
   end subroutine build_dense

   !> The point where the run ended, unless t_eval says what is wanted
   recursive subroutine record_last(self, state, status, recorder)
      class(run_type), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      type(status_type) :: own
      if (.not. present(recorder) .or. self%is_recorded .or. allocated(self%t_eval)) return
      call recorder%record(state, own)
      self%is_recorded = .true.
      if (own%failed() .and. .not. status%failed()) status = own
   end subroutine record_last

   !> The trial in self%left is good.  Where a function goes through zero in it, it is made anew up to there and self%which
   !> tells the function.  `no_step`: the zero is at `state` itself, and no step is to be accepted.
   recursive subroutine run_cut_at_zero(self, stepper, sys, state, order, no_step, status, events)
      class(run_type), intent(inout) :: self
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
   end subroutine run_cut_at_zero

   !> The zero of an event that was noted at this state and changed nothing: steps lead to within the resolution of it
   pure logical function is_met(self, state, t, t1)
      class(run_type), intent(in) :: self
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
      class(run_type), intent(inout) :: self
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
      class(run_type), intent(inout) :: self
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
   recursive subroutine meet_events(self, stepper, sys, state, has_step, status, recorder, events)
      class(run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(in) :: has_step                    !! from self%left to `state`
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(event_type), intent(inout), optional :: events
      logical :: is_changed
      integer :: i, last

      last = 0
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
            call meet_one(self, i - self%watch%switches, sys, state, is_changed, last, status, events)
         end if
         if (status%failed()) return
      end do
      self%has_changed = is_changed
      if (is_changed) then
         call stepper%restart(sys, state, status)
         call self%restarted(stepper, sys, state, status)
         call self%dense%forget()
         if (status%failed()) return
         self%is_recorded = .false.
      end if
      call self%watch%look_at_state(sys, state, status, events)
      if (status%failed()) return
      if (is_changed .and. present(recorder) .and. .not. allocated(self%t_eval)) then
         self%is_recorded = self%wants_point()
         if (self%is_recorded) call recorder%record(state, status)
      end if
      if (last > 0 .and. .not. status%failed()) call status%set(dynstep_event, 'event '//text(last)//' ended the run at t = ' &
         & //text(state%t))
   end subroutine meet_events

   !> Events that come too quickly one after the other end the run, else it would go on for ever
   recursive subroutine look_for_chatter(self, t, status)
      class(run_type), intent(inout) :: self
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
   recursive subroutine meet_one(self, i, sys, state, is_changed, last, status, events)
      class(run_type), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: is_changed
      integer, intent(inout) :: last                      !! terminal event, where there is one
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      logical :: changed
      integer :: ierr
      if (.not. present(events)) return
      call self%log%add(i, state, status)
      if (status%failed()) return
      self%point%t = state%t
      self%point%y = state%y
      changed = .false.
      call events%act(i, sys, state, changed, ierr)
      state%t = self%point%t
      if (ierr /= 0) then
         call status%set(dynstep_callback_failed, 'the action at event '//text(i)//' gave up at t = '//text(state%t) &
            & //' (ierr = '//text(ierr)//')')
         state%y = self%point%y
         return
      end if
      call check_state('the state behind event '//text(i)//' at t = '//text(state%t), sys, state, status)
      if (status%failed()) then
         if (size(state%y) == size(self%point%y)) status%code = dynstep_not_finite
         state%y = self%point%y
         return
      end if
      ! an action may forget to say so
      is_changed = is_changed .or. changed .or. any(abs(state%y - self%point%y) > 0.0_wp)
      if (.not. allocated(events%terminal)) return
      if (events%terminal(i)) last = i
   end subroutine meet_one

   !> Write all that the rest of the run depends on: state, method, run, sides of switches.  The system's own parameters,
   !> events and recorders are the program's.  docs/howto/restarting.md tells the format.
   recursive subroutine run_checkpoint(self, path, stepper, sys, state, status)
      class(run_type), intent(inout) :: self
      character(len=*), intent(in) :: path                !! of the file; one of this name is replaced
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      type(archive_type) :: file
      if (status%failed()) return
      call status%clear()
      call file%begin_writing(path, status)
      call visit(self, file, stepper, sys, state, status)
      call file%finish(status)
   end subroutine run_checkpoint

   !> Read it: `proceed` then goes on with the same bits.  The stepper has the same options and `init` was called with the same
   !> system, which has the parameters that it had; the run needs no `begin`.
   recursive subroutine run_restore(self, path, stepper, sys, state, status)
      class(run_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      type(archive_type) :: file
      type(state_type) :: before
      if (status%failed()) return
      call status%clear()
      before = state
      call file%begin_reading(path, status)
      if (.not. status%failed()) then
         self%is_broken = .true.
         call allocate_state(sys, self%left, status)
         call allocate_state(sys, self%point, status)
         call allocate_state(sys, state, status)
      end if
      call visit(self, file, stepper, sys, state, status)
      call file%finish(status)
      if (status%failed()) then
         state = before
         return
      end if
      self%is_broken = .false.
      self%is_restored = .true.
   end subroutine run_restore

   !> Everything in one order
   recursive subroutine visit(self, file, stepper, sys, state, status)
      class(run_type), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status

      if (status%failed() .or. file%failed()) return
      call state%archive('state', file)
      call file%expect('switches', sys%switches)
      if (file%failed()) return
      call file%item('side', sys%side)
      if (file%is_reading .and. .not. file%failed()) call sys%sides_changed()
      call file%section('run')
      call file%item('t_end', self%t_end)
      if (file%failed()) return
      if (file%is_reading .and. allocated(self%t_eval)) deallocate (self%t_eval)
      call file%item('t_eval', self%t_eval)
      call file%item('next', self%next)
      call file%item('fresh', self%fresh)
      call file%item('keeps_nodes', self%keeps_nodes)
      call file%item('has_dense', self%has_dense)
      call file%item('is_recorded', self%is_recorded)
      call file%item('step_order', self%step_order)
      call file%item('t_begin', self%t_begin)
      call file%item('has_changed', self%has_changed)
      if (file%is_reading .and. allocated(self%last_time)) deallocate (self%last_time, self%quick_events)
      call file%item('last_time', self%last_time)
      call file%item('quick_events', self%quick_events)
      call self%log%archive(file)
      call self%watch%archive(file)
      call self%archive_parts(file)
      call file%end_section()
      if (file%failed()) return
      if (file%is_reading .and. allocated(self%norm)) call stepper%prepare_control(sys, self%norm, status)
      if (status%failed()) return
      call stepper%archive(file)
      if (.not. self%has_dense .or. file%failed()) return
      if (file%is_reading) call self%dense%begin(stepper, sys, status)
      if (.not. status%failed()) call self%dense%archive(file)
   end subroutine visit

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

   !> All of a state, into arrays of the same lengths
   recursive subroutine copy_point(from, to)
      type(state_type), intent(in) :: from
      type(state_type), intent(inout) :: to
      to%t = from%t
      to%y = from%y
      to%a = from%a
      to%lambda = from%lambda
      to%psi = from%psi
   end subroutine copy_point
end module dynstep_run
