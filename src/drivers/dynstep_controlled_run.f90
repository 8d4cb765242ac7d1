! SPDX-License-Identifier: BSD-3-Clause
!> Runs over an interval whose steps follow the error estimate of the method.
!>
!> PROGRAMMING INTERFACE
!>
!>     control%rtol = 1.0e-8_wp
!>     call stepper%init(sys, status)
!>     call stepper%start(sys, state, status)
!>     call integrate_controlled(stepper, sys, state, t_end, control, status, recorder, observer, events)
!>
!>   or in pieces, with the same bits: run%begin(stepper, sys, state, t_end, control, status), then run%proceed, see
!>   DYNSTEP_RUN.
!>
!>   A trial whose error is above 1 in the norm of the control is thrown away.  One that fails for a reason that a smaller step
!>   may mend - Newton's iteration, a procedure that refuses, a value that is not finite, a pole on the spectrum - is tried
!>   again with a quarter of the step.  A method that chooses its order proposes the next length itself; for others the
!>   controller does.  Recorded are the start and each accepted step, or the times t_eval, interpolated inside a step.
!>
!>   A tolerance that the rounding errors of the state exceed is refused, at the begin and on the way, and so is a step below
!>   h_min; the state is then that of the last accepted step.
module dynstep_controlled_run
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_events, only: event_type
   use dynstep_kinds, only: long, wp
   use dynstep_linear_ode, only: linear_ode
   use dynstep_linear_system, only: linear_system
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_record_times, only: steps_before_time
   use dynstep_run, only: observer_type, run_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_step_too_small, dynstep_tolerance_too_small, status_type
   use dynstep_step_control, only: step_control_type
   use dynstep_stepper, only: method_properties, state_type, stepper_type, verdict_type
   use dynstep_text, only: text
   use dynstep_trajectory, only: recorder_type
   implicit none
   private

   public :: integrate_controlled

   !> Section of a checkpoint
   character(len=*), parameter, public :: steps_by_error = 'steps by error'

   type, extends(run_type), public :: controlled_run_type
      type(step_control_type) :: control
      real(wp) :: h = 0.0_wp                             !! length of the next trial
      type(verdict_type), private :: verdict             ! of the last trial
      real(wp), private :: longest = 0.0_wp              ! step length
      real(wp), private :: growth = huge(1.0_wp)         ! of a step beside the one before, by the method
      real(wp), private :: error_before = -1.0_wp        ! of the last trial; < 0: none
      logical, private :: after_rejection = .false.
      real(wp), private :: length = 0.0_wp               ! of the last step; 0: none since a start
      logical, private :: keeps_factors = .false.        ! a system whose matrices are factorized for each length
      integer, private :: order = 0                      ! of the method, for a first step
   contains
      procedure :: begin => controlled_begin
      procedure :: make_steps => controlled_make_steps
      procedure :: try => controlled_try
      procedure :: restarted => controlled_restarted
      procedure :: wants_point => controlled_wants_point
      procedure :: steps_for => controlled_steps_for
      procedure :: finished => controlled_finished
      procedure :: archive_parts => controlled_archive_parts
   end type controlled_run_type

   !> A state whose rounding errors have more than this size in the norm cannot have errors of 1: sums of some hundred of
   !> them enter a step (the amplification of an extrapolation is up to 119, reference in docs/theory)
   real(wp), parameter :: most_rounding = 0.02_wp

   !> Trials for one step: with a quarter of the length each, from anything to nothing
   integer, parameter :: most_trials = 60

   !> A method with a memory starts anew where so many trials failed: behind a jump of the right side its slopes tell nothing,
   !> and its estimate does not fall with h.  A Newton iteration that needs shorter steps gets them before.
   integer, parameter :: trials_before_restart = 8

   !> A step that might grow by less is kept where each length has factors of its own, which cost as much as some steps
   real(wp), parameter :: worthwhile_growth = 1.2_wp

   !> Part of the growth limit of a method with a memory that steps make use of
   real(wp), parameter :: growth_share = 0.9_wp

contains

   !> From state%t to t_end.  On return `state` is the last accepted state, also on failure.
   recursive subroutine integrate_controlled(stepper, sys, state, t_end, control, status, recorder, observer, events)
      class(stepper_type), intent(inout) :: stepper       !! started on `sys` and `state`, with an error estimate
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: t_end
      type(step_control_type), intent(in) :: control
      type(status_type), intent(inout) :: status
      class(recorder_type), intent(inout), optional :: recorder
      class(observer_type), intent(inout), optional :: observer
      class(event_type), intent(inout), optional :: events
      type(controlled_run_type) :: run
      call run%begin(stepper, sys, state, t_end, control, status)
      call run%proceed(stepper, sys, state, status, recorder, observer, events=events)
   end subroutine integrate_controlled

   !> Check the control, get the method ready, choose the first step.  A method that prepares itself for the tolerances is
   !> started again.
   recursive subroutine controlled_begin(self, stepper, sys, state, t_end, control, status)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: t_end
      type(step_control_type), intent(in) :: control
      type(status_type), intent(inout) :: status
      type(method_properties) :: facts
      logical :: was_started

      call control%check(status)
      call self%begin_common(sys, state, t_end, control%t_eval, status)
      if (status%failed()) return
      if (control%h_first*sign(1.0_wp, t_end - state%t) < 0.0_wp) then
         call status%set(dynstep_invalid_input, 'h_first = '//text(control%h_first)//' points away from t_end = ' &
            & //text(t_end)//' at t = '//text(state%t)//'; change its sign')
         return
      end if
      self%control = control
      self%norm = control%norm()
      was_started = stepper%is_started
      call stepper%prepare_control(sys, self%norm, status)
      if (status%failed()) return
      if (was_started .and. .not. stepper%is_started) call stepper%start(sys, state, status)
      if (status%failed()) return
      facts = stepper%properties()
      self%order = facts%order
      self%growth = facts%step_growth_limit
      if (self%growth < huge(1.0_wp)) self%growth = growth_share*self%growth
      self%keeps_factors = .false.
      select type (sys)
      class is (linear_system)
         self%keeps_factors = control%is_weighted()
      class is (linear_ode)
         self%keeps_factors = control%is_weighted()
      end select
      self%longest = control%h_max
      if (.not. self%longest > 0.0_wp) self%longest = abs(t_end - state%t)*merge(1.0_wp, 1.0_wp/16.0_wp, control%is_weighted())
      self%h = 0.0_wp
      self%after_rejection = .false.
      self%length = 0.0_wp
      self%error_before = -1.0_wp
      call check_tolerance(self, state, status)
   end subroutine controlled_begin

   !> Rounding errors of a state beside what is tolerated
   recursive subroutine check_tolerance(self, state, status)
      class(controlled_run_type), intent(in) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      real(wp) :: rounding
      if (status%failed()) return
      rounding = self%norm%rounding(state%y)
      if (rounding <= most_rounding) return
      call status%set(dynstep_tolerance_too_small, 'the tolerance is below what rounding allows at t = '//text(state%t) &
         & //': tolerances '//text(rounding/most_rounding)//' times as large are the smallest')
   end subroutine check_tolerance

   !> Length of the first step, or of the first one behind a change
   recursive subroutine choose_first(self, stepper, sys, state)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: state
      real(wp), allocatable :: slope(:), second(:)
      real(wp) :: h

      if (.not. self%control%is_weighted()) then
         h = abs(self%control%h_first)
         if (.not. h > 0.0_wp) h = abs(self%t_end - state%t)/128.0_wp
      else
         allocate (slope(size(state%y)), second(size(state%y)))
         select type (sys)
         class is (mechanical_system)
            slope(1:sys%n) = state%y(sys%n + 1:)
            slope(sys%n + 1:) = state%a
            second(1:sys%n) = state%a
            second(sys%n + 1:) = 0.0_wp
            h = self%control%first(self%norm, state%y, slope, second, self%order)
         class default
            slope = state%a
            h = self%control%first(self%norm, state%y, slope, second(1:0), self%order)
         end select
      end if
      self%h = sign(min(h, self%longest), self%t_end - state%t)
   end subroutine choose_first

   !> Steps may be shorter than the longest one, and then it takes more of them to the same time
   pure integer(long) function controlled_steps_for(self, state, recorded, room) result(steps)
      class(controlled_run_type), intent(in) :: self
      type(state_type), intent(in) :: state
      integer(long), intent(in) :: recorded, room
      if (allocated(self%t_eval)) then
         steps = steps_before_time(self%t_eval, recorded + room + 1, state%t, sign(self%longest, self%t_end - state%t))
      else
         steps = room - merge(1, 0, recorded == 0)   ! the start
      end if
   end function controlled_steps_for

   !> True where t_end is reached
   pure logical function controlled_finished(self, state)
      class(controlled_run_type), intent(in) :: self
      type(state_type), intent(in) :: state
      controlled_finished = .not. abs(self%t_end - state%t) > 0.0_wp
   end function controlled_finished

   pure logical function controlled_wants_point(self)
      class(controlled_run_type), intent(in) :: self
      controlled_wants_point = .true.
   end function controlled_wants_point

   recursive subroutine controlled_make_steps(self, stepper, sys, state, steps, is_recording, is_observed, status, events)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      integer, intent(inout) :: steps
      logical, intent(in) :: is_recording, is_observed
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      logical :: no_step

      steps = 0
      if (.not. abs(self%h) > 0.0_wp) call choose_first(self, stepper, sys, state)
      ! slopes over a step that was cut short by an event are rounding errors beside a long one
      if (self%growth < huge(1.0_wp) .and. self%length > 0.0_wp) then
         if (abs(self%h) > self%growth*self%length) call stepper%restart(sys, state, status)
      end if
      self%length = 0.0_wp
      call find_step(self, stepper, sys, state, status)
      call self%monitor%look(stepper, sys, self%left%t - state%t, steps_ahead(self, state))
      call self%cut_at_zero(stepper, sys, state, self%verdict%order, no_step, status, events)
      if (status%failed() .or. no_step) return
      self%step_order = self%verdict%order
      self%length = abs(self%left%t - state%t)
      call stepper%accept(state, self%left)
      steps = 1
   end subroutine controlled_make_steps

   !> Steps of the present length to the end
   pure integer(long) function steps_ahead(self, state)
      class(controlled_run_type), intent(in) :: self
      type(state_type), intent(in) :: state
      steps_ahead = 1
      if (abs(self%left%t - state%t) > 0.0_wp) steps_ahead = int(min(abs((self%t_end - state%t)/(self%left%t - state%t)), &
         & 1.0e10_wp), long)
   end function steps_ahead

   !> Trials until one is good; self%left is that one
   recursive subroutine find_step(self, stepper, sys, state, status)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      type(status_type) :: cause
      real(wp) :: h, t1
      integer :: trial

      if (status%failed()) return
      do trial = 1, most_trials
         if (trial == trials_before_restart .and. self%growth < huge(1.0_wp)) call stepper%restart(sys, state, status)
         if (status%failed()) return
         h = self%h
         t1 = state%t + h
         ! no last step of a few units of rounding
         if (abs(h) >= abs(self%t_end - state%t) - 4.0_wp*spacing(max(abs(state%t), abs(self%t_end)))) then
            t1 = self%t_end
         else if (.not. abs(h) > max(self%control%h_min, 2.0_wp*spacing(state%t))) then
            exit
         end if
         h = t1 - state%t              ! what the rounding of a large t leaves
         call cause%clear()
         call self%try(stepper, sys, state, t1, cause)
         if (cause%failed()) then
            stepper%count%rejections = stepper%count%rejections + 1
            if (.not. cause%retry) then
               status = cause
               return
            end if
            self%h = merge(0.25_wp, 0.5_wp, self%control%is_weighted())*h
            self%after_rejection = .true.
            cycle
         end if
         call choose_next(self, h)
         if (self%verdict%error <= 1.0_wp .and. self%verdict%is_converged) then
            self%after_rejection = .false.
            return
         end if
         self%after_rejection = .true.
         stepper%count%rejections = stepper%count%rejections + 1
         call check_tolerance(self, state, status)
         if (status%failed()) return
      end do
      call too_small(self, state%t, self%h, cause, status)
   end subroutine find_step

   !> self%h behind a trial of length h
   pure subroutine choose_next(self, h)
      class(controlled_run_type), intent(inout) :: self
      real(wp), intent(in) :: h
      real(wp) :: next, longest, scale
      ! (3.16) has the errors themselves, not beside what is tolerated of each
      scale = 1.0_wp
      if (.not. self%control%is_weighted()) scale = max(maxval(abs(self%left%y)), 1.0_wp)
      associate (verdict => self%verdict)
         next = verdict%h_next
         if (.not. abs(next) > 0.0_wp) next = self%control%next(h, verdict%error, self%error_before/scale, &
            & 1.0_wp/real(verdict%error_order + 1, wp), self%after_rejection)
         longest = self%longest
         if (self%growth < huge(1.0_wp)) longest = min(longest, self%growth*abs(h))
         ! where a shorter step led to an end, the length before it is not forgotten
         if (verdict%error <= 1.0_wp .and. abs(h) < 0.9_wp*abs(self%h)) then
            next = sign(max(abs(next), abs(self%h)), h)
         else if (self%keeps_factors .and. .not. abs(verdict%h_next) > 0.0_wp .and. abs(next) > abs(h) &
            & .and. abs(next) < worthwhile_growth*abs(h)) then
            next = h
         end if
         self%h = sign(min(abs(next), longest), h)
         self%error_before = merge(verdict%error*scale, -1.0_wp, verdict%error > 0.0_wp)
      end associate
   end subroutine choose_next

   recursive subroutine controlled_try(self, stepper, sys, state, t1, status)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: t1
      type(status_type), intent(inout) :: status
      call stepper%try_within(sys, state, t1 - state%t, t1, self%norm, self%left, self%verdict, status)
      if (status%failed() .or. ieee_is_finite(self%verdict%error)) return
      self%verdict%error = huge(1.0_wp)
   end subroutine controlled_try

   !> Begin with a short step, but none that is longer than the one that was planned
   recursive subroutine controlled_restarted(self, stepper, sys, state, status)
      class(controlled_run_type), intent(inout) :: self
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      real(wp) :: planned
      if (status%failed()) return
      planned = self%h
      self%length = 0.0_wp
      self%error_before = -1.0_wp
      self%after_rejection = .false.
      call choose_first(self, stepper, sys, state)
      if (abs(planned) > 0.0_wp) self%h = sign(min(abs(planned), abs(self%h)), self%h)
   end subroutine controlled_restarted

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
            & //': the estimated error stays above the tolerance; give a larger one, a smaller h_min, or declare where the ' &
            & //'right side is not smooth')
         if (max(self%control%atol_lambda, self%control%atol_psi) > 0.0_wp) status%message = trim(status%message) &
            & //'; the multipliers have tolerances, too'
      end if
   end subroutine too_small

   recursive subroutine controlled_archive_parts(self, file)
      class(controlled_run_type), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%section(steps_by_error)
      call self%control%archive(file)
      if (file%is_reading) self%norm = self%control%norm()
      call file%item('h', self%h)
      call file%item('longest', self%longest)
      call file%item('growth', self%growth)
      call file%item('error_before', self%error_before)
      call file%item('after_rejection', self%after_rejection)
      call file%item('length', self%length)
      call file%item('keeps_factors', self%keeps_factors)
      call file%item('order', self%order)
      call file%end_section()
   end subroutine controlled_archive_parts
end module dynstep_controlled_run
