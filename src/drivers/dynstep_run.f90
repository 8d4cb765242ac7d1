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
!>   Events and switches are met by DYNSTEP_EVENT_STEPS; `run%log` has the events.
module dynstep_run
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_dense_output, only: dense_output_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_event_steps, only: event_steps_type
   use dynstep_events, only: event_type
   use dynstep_kinds, only: long, wp
   use dynstep_ode_system, only: ode_system
   use dynstep_record_times, only: check_times
   use dynstep_stability_monitor, only: stability_monitor
   use dynstep_start_check, only: check_state
   use dynstep_status, only: dynstep_event, dynstep_invalid_input, dynstep_more, dynstep_stopped, status_type
   use dynstep_stepper, only: allocate_state, has_shape, state_type, stepper_type
   use dynstep_text, only: text
   use dynstep_trajectory, only: recorder_type
   implicit none
   private

   !> Sees every accepted state; may end the run
   type, abstract, public :: observer_type
   contains
      procedure(observe_interface), deferred :: observe
   end type observer_type

   !> A run that can be left and taken up again
   type, abstract, extends(event_steps_type), public :: run_type
      real(wp) :: t_end = 0.0_wp
      real(wp), allocatable :: t_eval(:)                 !! times to record
      logical :: keeps_nodes = .false.                   !! the recorder gets points inside steps, too; set before `proceed`
      integer :: step_order = 0                          !! of the last step
      type(error_norm_type), allocatable :: norm         !! of a run that chooses its steps
      logical :: is_recorded = .false.                   !! the present state is recorded
      type(stability_monitor) :: monitor                 !! monitor%warning tells of steps that are too long for the method
      logical, private :: fresh = .true.                 ! nothing done since `begin`
      logical, private :: is_restored = .false.          ! from a checkpoint, and not taken up yet
      logical, private :: has_dense = .false.            ! self%dense is begun
      integer, private :: next = 1                       ! first t_eval that is not recorded
      logical, private :: is_broken = .false.            ! a checkpoint could be taken over in parts only
      type(state_type), private :: point                 ! inside a step
      type(dense_output_type), private :: dense
   contains
      procedure :: proceed => run_proceed
      procedure :: begin_common => run_begin_common
      procedure :: next_time => run_next_time
      procedure :: checkpoint => run_checkpoint
      procedure :: restore => run_restore
      procedure :: recorded_points => run_recorded_points
      procedure(archive_interface), deferred :: archive_parts
      procedure(make_steps_interface), deferred :: make_steps
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
      self%is_broken = .false.
      self%has_dense = .false.
      self%is_restored = .false.
      call self%allocate_events(sys, status)
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
         if (self%which > 0) call meet(self, stepper, sys, state, steps > 0, status, recorder, events)
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
      call self%begin_events(sys, state, status, events)
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

   !> Events at the end of a step.  Where they change something, the recorder gets the state behind them, too.
   recursive subroutine meet(self, stepper, sys, state, has_step, status, recorder, events)
      class(run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(in) :: has_step                    !! from self%left to `state`
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(event_type), intent(inout), optional :: events
      logical :: is_changed
      integer :: terminal
      call self%meet_events(stepper, sys, state, has_step, is_changed, terminal, status, events)
      if (is_changed) call self%dense%forget()
      if (status%failed()) return
      if (is_changed) self%is_recorded = .false.
      if (is_changed .and. present(recorder) .and. .not. allocated(self%t_eval)) then
         self%is_recorded = self%wants_point()
         if (self%is_recorded) call recorder%record(state, status)
      end if
      if (terminal > 0 .and. .not. status%failed()) call status%set(dynstep_event, 'event '//text(terminal) &
         & //' ended the run at t = '//text(state%t))
   end subroutine meet

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
         call self%allocate_events(sys, status)
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
      call self%archive_events(file)
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

end module dynstep_run
