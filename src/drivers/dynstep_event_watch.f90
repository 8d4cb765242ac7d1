! SPDX-License-Identifier: BSD-3-Clause
!> Finds the first zero of the functions that a run watches inside a step: the switch functions of the system, then the
!> user's events.
!>
!> Each function has a sign just behind the present state.  A step is sampled on its interpolant at interior points - as
!> many as its order, since steps of a higher order are longer beside the time scales of the motion - and at its end.
!> Where the smallest of three neighbours may hide two zeros, its parabola tells where to look.  The interpolant only
!> tells where zeros are; the run then makes real steps to find when.
!>
!> A function that is zero at the present state, as behind an event, has the sign that it takes on within a small part of
!> the next step.
module dynstep_event_watch
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: check_callback
   use dynstep_archive, only: archive_type
   use dynstep_events, only: event_type
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_finite, status_type
   use dynstep_stepper, only: allocate_state, state_type, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   !> Fewest and most interior samples of a step
   integer, parameter :: fewest_samples = 3, most_samples = 20

   !> The sign of a function that is zero at the begin of a step is looked for behind so many units of rounding of t, ten times
   !> as many, and so on, up to this part of the step; the first place counts at which it has grown by this factor over what
   !> rounding left of the zero
   real(wp), parameter :: first_probe = 16.0_wp, last_probe = 1.0e-2_wp, above_rounding = 4.0_wp

   !> A function that is not zero by this part of its largest value in the step before was moved by the action
   real(wp), parameter :: moved = 1.0e-10_wp

   !> Rounding errors of a function beside its largest value in the step
   real(wp), parameter :: at_zero = 64.0_wp*epsilon(1.0_wp)

   !> A bracket on the interpolant is halved so often; real steps do the rest
   integer, parameter :: halvings = 24

   !> A parabola through three samples hides no zero that it keeps above this part of the middle one
   real(wp), parameter :: near_zero = 0.5_wp

   type, public :: event_watch
      integer :: switches = 0                       !! functions 1 .. switches are those of the system
      integer :: count = 0                          !! all functions; 0: nothing is watched
      integer, allocatable :: sign_now(:)           !! [count] at the present state: -1, +1; 0: not known
      logical, allocatable :: fired(:)              !! [count] functions that went through zero at the end of the last step
      real(wp), allocatable :: value(:)             !! [count] work, values of the last call of `evaluate`
      integer, allocatable, private :: direction(:)
      integer, allocatable, private :: bracket_sign(:)      ! [count] just before the zero that was found
      real(wp), allocatable, private :: begin_value(:)      ! [count] at the begin of the step
      real(wp), allocatable, private :: end_value(:)        ! [count] at its end, of the last call of `first_zero`
      real(wp), allocatable, private :: event_value(:)      ! [count] at the last event
      real(wp), allocatable, private :: sample(:, :)        ! [count, 0:most_samples + 1]
      real(wp), allocatable, private :: place(:)            ! [0:most_samples + 1] parts of the step
      type(state_type), private :: point
   contains
      procedure :: begin => watch_begin
      procedure :: resume => watch_resume
      procedure :: archive => watch_archive
      procedure, private :: clear => watch_clear
      procedure :: evaluate => watch_evaluate
      procedure :: look_at_state => watch_look_at_state
      procedure :: first_zero => watch_first_zero
      procedure :: take_end => watch_take_end
      procedure :: pass => watch_pass
      procedure :: fire => watch_fire
      procedure :: has_crossed => watch_has_crossed
      procedure :: ends_behind => watch_ends_behind
      procedure :: pass_zero => watch_pass_zero
      procedure :: slope => watch_slope
   end type event_watch

contains

   !> Which functions there are
   recursive subroutine watch_begin(self, sys, status, events)
      class(event_watch), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      class(event_type), intent(in), optional :: events

      if (status%failed()) return
      self%switches = sys%switches
      self%count = sys%switches
      if (present(events)) then
         call events%check(status)
         if (status%failed()) return
         self%count = self%count + events%count
      end if
      if (self%count == 0) return
      call self%clear()
      allocate (self%sign_now(self%count), self%direction(self%count), self%bracket_sign(self%count), source=0)
      allocate (self%fired(self%count), source=.false.)
      allocate (self%value(self%count), self%begin_value(self%count), self%end_value(self%count), &
         & self%event_value(self%count), self%sample(self%count, 0:most_samples + 1), self%place(0:most_samples + 1), source=0.0_wp)
      if (present(events)) then
         if (allocated(events%direction)) self%direction(self%switches + 1:) = events%direction
      end if
      call allocate_state(sys, self%point, status)
   end subroutine watch_begin

   !> `begin` behind a restore: the signs are those of the checkpoint
   recursive subroutine watch_resume(self, sys, status, events)
      class(event_watch), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      class(event_type), intent(in), optional :: events
      integer, allocatable :: sign_now(:)
      real(wp), allocatable :: begin_value(:)
      integer :: count
      if (status%failed()) return
      count = self%count
      if (allocated(self%sign_now)) sign_now = self%sign_now
      if (allocated(self%begin_value)) begin_value = self%begin_value
      call self%begin(sys, status, events)
      if (status%failed()) return
      if (self%count /= count) then
         call status%set(dynstep_invalid_input, 'the run that was restored watches '//text(count)//' switch and event ' &
            & //'functions, and here are '//text(self%count)//'; give the events that it had')
         return
      end if
      if (count == 0) return
      self%sign_now = sign_now
      self%begin_value = begin_value
   end subroutine watch_resume

   pure subroutine watch_clear(self)
      class(event_watch), intent(inout) :: self
      if (allocated(self%sign_now)) deallocate (self%sign_now)
      if (allocated(self%begin_value)) deallocate (self%begin_value)
      if (allocated(self%value)) deallocate (self%value, self%direction, self%sample, self%place, self%fired, &
         & self%bracket_sign, self%end_value, self%event_value)
   end subroutine watch_clear

   !> To a checkpoint or from it
   recursive subroutine watch_archive(self, file)
      class(event_watch), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%section('watch')
      if (file%failed()) return
      if (file%is_reading) call self%clear()
      call file%item('count', self%count)
      call file%item('sign_now', self%sign_now)
      call file%item('begin_value', self%begin_value)
      call file%end_section()
   end subroutine watch_archive

   !> self%value at (t, y)
   recursive subroutine watch_evaluate(self, sys, t, y, status, events)
      class(event_watch), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      integer :: ierr, i

      if (status%failed()) return
      if (self%switches > 0) then
         call sys%switch_values(t, y, self%value(1:self%switches), ierr)
         call check_callback('switch_values', ierr, t, status)
      end if
      if (present(events) .and. .not. status%failed()) then
         call events%values(t, y, self%value(self%switches + 1:), ierr)
         call check_callback('the event function', ierr, t, status)
      end if
      if (status%failed()) return
      do i = 1, self%count
         if (ieee_is_finite(self%value(i))) cycle
         if (i <= self%switches) then
            call status%set(dynstep_not_finite, 'switch function '//text(i)//' is '//text(self%value(i))//' at t = '//text(t))
         else
            call status%set(dynstep_not_finite, 'event function '//text(i - self%switches)//' is '//text(self%value(i)) &
               & //' at t = '//text(t))
         end if
         return
      end do
   end subroutine watch_evaluate

   !> Signs at a state that a run begins with, or goes on from behind an event.  Those of switches are the sides; those of
   !> functions that fired are found in the next step.
   recursive subroutine watch_look_at_state(self, sys, state, status, events)
      class(event_watch), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      integer :: i
      if (self%count == 0) return
      call self%evaluate(sys, state%t, state%y, status, events)
      if (status%failed()) return
      self%begin_value = self%value
      do i = 1, self%count
         if (i <= self%switches) then
            self%sign_now(i) = sys%side(i)
         else if (is_off_zero(self, i)) then
            self%sign_now(i) = sign_of(self%value(i))
         else
            self%sign_now(i) = 0
         end if
      end do
      self%fired = .false.
   end subroutine watch_look_at_state

   !> A function that fired is zero there, unless the action has moved it by more than rounding, beside its last values
   pure logical function is_off_zero(self, i)
      class(event_watch), intent(in) :: self
      integer, intent(in) :: i
      is_off_zero = abs(self%value(i)) > 0.0_wp
      if (self%fired(i)) is_off_zero = abs(self%value(i)) > moved*maxval(abs(self%sample(i, :)))
   end function is_off_zero

   pure integer function sign_of(x)
      real(wp), intent(in) :: x
      sign_of = merge(-1, 1, x < 0.0_wp)
   end function sign_of

   !> The first zero between two ends of a step, on the interpolant.  Signs that are not known are found.
   recursive subroutine watch_first_zero(self, stepper, sys, left, right, order, which, t, status, events)
      class(event_watch), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right        !! ends of a step
      integer, intent(in) :: order                       !! of the method in that step
      integer, intent(out) :: which                      !! function, 0: none
      real(wp), intent(out) :: t                         !! time of the zero
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      integer :: i, samples
      real(wp) :: a, b

      which = 0
      t = right%t
      if (status%failed() .or. self%count == 0) return
      call take_samples(self, stepper, sys, left, right, min(max(order, fewest_samples), most_samples), samples, status, events)
      do i = 1, self%count
         if (self%sign_now(i) == 0) call find_sign(self, stepper, sys, left, right, i, status, events)
         if (status%failed()) return
         call find_bracket(self, stepper, sys, left, right, i, samples, a, b, status, events)
         if (status%failed()) return
         if (b < 0.0_wp) cycle
         call halve(self, stepper, sys, left, right, i, a, b, status, events)
         if (status%failed()) return
         ! of two at one time the first one wins; the other is met at once behind it
         if (which > 0 .and. .not. abs(left%t + b*(right%t - left%t) - left%t) < abs(t - left%t)) cycle
         which = i
         t = left%t + b*(right%t - left%t)
         if (b >= 1.0_wp) t = right%t
      end do
   end subroutine watch_first_zero

   !> Values at the begin, at `count` interior points and at the end
   recursive subroutine take_samples(self, stepper, sys, left, right, count, last, status, events)
      class(event_watch), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right
      integer, intent(in) :: count
      integer, intent(out) :: last
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      integer :: k
      last = count + 1
      self%place(0) = 0.0_wp
      self%sample(:, 0) = self%begin_value
      do k = 1, last
         self%place(k) = real(k, wp)/real(last, wp)
         if (k < last) then
            call evaluate_at(self, stepper, sys, left, right, self%place(k), status, events)
         else
            call self%evaluate(sys, right%t, right%y, status, events)
         end if
         if (status%failed()) return
         self%sample(:, k) = self%value
      end do
      self%end_value = self%value
   end subroutine take_samples

   !> Values at a part c of a step
   recursive subroutine evaluate_at(self, stepper, sys, left, right, c, status, events)
      class(event_watch), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right
      real(wp), intent(in) :: c
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      if (status%failed()) return
      call stepper%interpolate(sys, left, right, left%t + c*(right%t - left%t), self%point)
      call self%evaluate(sys, self%point%t, self%point%y, status, events)
   end subroutine evaluate_at

   !> Sign that function i takes on behind a zero at the begin of the step
   recursive subroutine find_sign(self, stepper, sys, left, right, i, status, events)
      class(event_watch), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right
      integer, intent(in) :: i
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      real(wp) :: c
      c = first_probe*spacing(max(abs(left%t), abs(right%t)))/abs(right%t - left%t)
      do while (c <= last_probe)
         call evaluate_at(self, stepper, sys, left, right, c, status, events)
         if (status%failed()) return
         if (abs(self%value(i)) > above_rounding*abs(self%begin_value(i))) then
            self%sign_now(i) = sign_of(self%value(i))
            return
         end if
         c = 10.0_wp*c
      end do
   end subroutine find_sign

   !> Parts a < b of the step between which function i has its first zero of the wanted direction; b < 0: none
   recursive subroutine find_bracket(self, stepper, sys, left, right, i, last, a, b, status, events)
      class(event_watch), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right
      integer, intent(in) :: i, last
      real(wp), intent(out) :: a, b
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      integer :: k, sign
      real(wp) :: dip

      a = 0.0_wp
      b = -1.0_wp
      sign = self%sign_now(i)
      do k = 1, last
         if (sign == 0) then
            if (abs(self%sample(i, k)) > 0.0_wp) sign = sign_of(self%sample(i, k))
         else if (.not. sign*self%sample(i, k) > 0.0_wp) then
            if (self%direction(i)*sign <= 0) then
               a = self%place(k - 1)
               b = self%place(k)
               self%bracket_sign(i) = sign
               return
            end if
            sign = -sign
         else if (k < last) then
            call look_for_dip(self, stepper, sys, left, right, i, k, sign, dip, status, events)
            if (status%failed()) return
            if (dip < 0.0_wp) cycle
            ! two zeros: down to the dip, and up again
            if (self%direction(i)*sign <= 0) then
               a = self%place(k - 1)
               b = dip
               self%bracket_sign(i) = sign
            else
               a = dip
               b = self%place(k + 1)
               self%bracket_sign(i) = -sign
            end if
            return
         end if
      end do
   end subroutine find_bracket

   !> A place between samples k - 1 and k + 1, all of one sign, where function i has the other one; < 0: none found
   recursive subroutine look_for_dip(self, stepper, sys, left, right, i, k, sign, dip, status, events)
      class(event_watch), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right
      integer, intent(in) :: i, k, sign
      real(wp), intent(out) :: dip
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      real(wp) :: before, here, behind, bend, lowest
      integer :: trial
      dip = -1.0_wp
      before = sign*self%sample(i, k - 1)
      here = sign*self%sample(i, k)
      behind = sign*self%sample(i, k + 1)
      if (.not. (here < before .and. here <= behind)) return
      bend = before - 2.0_wp*here + behind
      lowest = here - (behind - before)**2/(8.0_wp*bend)
      if (lowest > near_zero*here) return
      associate (spacing => self%place(k + 1) - self%place(k), shift => -(behind - before)/(2.0_wp*bend))
         do trial = 1, 3
            ! the parabola's lowest place, and to both sides of it
            dip = self%place(k) + spacing*(shift + merge(0.0_wp, merge(0.1_wp, -0.1_wp, trial == 2), trial == 1))
            call evaluate_at(self, stepper, sys, left, right, dip, status, events)
            if (status%failed()) return
            if (.not. sign*self%value(i) > 0.0_wp) return
         end do
      end associate
      dip = -1.0_wp
   end subroutine look_for_dip

   !> Make a bracket narrower; the sign at a is bracket_sign
   recursive subroutine halve(self, stepper, sys, left, right, i, a, b, status, events)
      class(event_watch), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right
      integer, intent(in) :: i
      real(wp), intent(inout) :: a, b
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      real(wp) :: middle
      integer :: k
      do k = 1, halvings
         middle = 0.5_wp*(a + b)
         call evaluate_at(self, stepper, sys, left, right, middle, status, events)
         if (status%failed()) return
         if (self%bracket_sign(i)*self%value(i) > 0.0_wp) then
            a = middle
         else
            b = middle
         end if
      end do
   end subroutine halve

   !> The values of the last call of `evaluate` are those at the end of the step
   pure subroutine watch_take_end(self)
      class(event_watch), intent(inout) :: self
      self%end_value = self%value
   end subroutine watch_take_end

   !> The zero of function i at the present state was met before: its sign is that behind it
   pure subroutine watch_pass_zero(self, i)
      class(event_watch), intent(inout) :: self
      integer, intent(in) :: i
      self%sign_now(i) = -self%bracket_sign(i)
   end subroutine watch_pass_zero

   !> A step was accepted in which no function went through zero: signs at its end, where they are known there
   pure subroutine watch_pass(self)
      class(event_watch), intent(inout) :: self
      integer :: i
      self%begin_value = self%end_value
      do i = self%switches + 1, self%count
         if (abs(self%end_value(i)) > 0.0_wp) self%sign_now(i) = sign_of(self%end_value(i))
      end do
   end subroutine watch_pass

   !> A step from `left` to `right` was accepted that ends at a zero of function `which`, where self%value are the values: others
   !> that went through zero up to there, or are zero at the same time within rounding and on the way through it, are noted
   recursive subroutine watch_fire(self, stepper, sys, left, right, which, resolution, status, events)
      class(event_watch), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right        !! of one time where there was no step
      integer, intent(in) :: which
      real(wp), intent(in) :: resolution                 !! of times
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      real(wp) :: value, slope
      integer :: i
      self%fired = .false.
      self%fired(which) = .true.
      self%event_value = self%value
      do i = 1, self%count
         if (i == which .or. self%sign_now(i) == 0 .or. self%direction(i)*self%sign_now(i) > 0) cycle
         value = self%sign_now(i)*self%event_value(i)
         self%fired(i) = value < 0.0_wp
         if (self%fired(i) .or. self%sign_now(i)*self%end_value(i) > 0.0_wp) cycle
         self%fired(i) = .not. value > 0.0_wp
         if (self%fired(i) .or. value > at_zero*maxval(abs(self%sample(i, :))) .or. .not. abs(right%t - left%t) > 0.0_wp) cycle
         slope = self%slope(stepper, sys, left, right, i, right%t, status, events)
         if (status%failed()) return
         self%fired(i) = value <= 8.0_wp*resolution*abs(slope)
      end do
      self%value = self%event_value
   end subroutine watch_fire

   !> True where function i has left the sign before its zero at the end of the step, too
   pure logical function watch_ends_behind(self, i)
      class(event_watch), intent(in) :: self
      integer, intent(in) :: i
      watch_ends_behind = .not. self%bracket_sign(i)*self%end_value(i) > 0.0_wp
   end function watch_ends_behind

   !> True where function i has left the sign that it had before the zero that was found, by its last value
   pure logical function watch_has_crossed(self, i)
      class(event_watch), intent(in) :: self
      integer, intent(in) :: i
      watch_has_crossed = .not. self%bracket_sign(i)*self%value(i) > 0.0_wp
   end function watch_has_crossed

   !> ds/dt of function i on the interpolant, near time t
   recursive real(wp) function watch_slope(self, stepper, sys, left, right, i, t, status, events) result(slope)
      class(event_watch), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right
      integer, intent(in) :: i
      real(wp), intent(in) :: t
      type(status_type), intent(inout) :: status
      class(event_type), intent(inout), optional :: events
      real(wp), parameter :: apart = 1.0e-4_wp         ! of the step: errors 1e-8 and eps/1e-4, a secant needs few digits
      real(wp) :: c, above
      c = (t - left%t)/(right%t - left%t)
      call evaluate_at(self, stepper, sys, left, right, c + apart, status, events)
      above = self%value(i)
      call evaluate_at(self, stepper, sys, left, right, c - apart, status, events)
      slope = (above - self%value(i))/(2.0_wp*apart*(right%t - left%t))
   end function watch_slope
end module dynstep_event_watch
