! SPDX-License-Identifier: BSD-3-Clause
!> What methods y1 = R(hA) y of linear systems have in common: start, trial steps, many steps in place.
!>
!> An extension gives `properties` and `init`, which calls `init_rational` with its R, and `prepare_control`, which calls
!> `prepare_companion` with the R~ of a companion: the estimate of the error is (R - R~)(hA) y + forcing.
module dynstep_rational_stepper
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: acceleration_solver
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_rational, only: rational_type
   use dynstep_rational_engine, only: is_linear, rational_engine
   use dynstep_start_check, only: check_mechanical, check_size, check_start
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, dynstep_not_finite, status_type
   use dynstep_stepper, only: clock_type, method_properties, prepare_estimate, state_type, stepper_type, verdict_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_linear

   type, abstract, extends(stepper_type), public :: rational_stepper
      type(rational_engine), private :: engine
      type(acceleration_solver), private :: end_solver
      real(wp), allocatable, private :: dy(:)              ! increment of a step [state_size]
      type(rational_engine), allocatable, private :: companion   ! for the estimate of the error
      real(wp), allocatable, private :: error(:)           ! estimate of the last controlled trial [state_size]
      real(wp), private :: last_h = 0.0_wp                 ! length of that trial
   contains
      procedure, non_overridable :: prepare_companion
      procedure, non_overridable :: init_rational
      procedure :: start => rational_start
      procedure, non_overridable :: start_rational => rational_start
      procedure :: reset => rational_reset
      procedure :: try_step => rational_try_step
      procedure :: advance => rational_advance
      procedure :: try_within => rational_try_within
      procedure :: estimate_error => rational_estimate_error
      procedure :: needs_acceleration => rational_needs_acceleration
      procedure :: archive_parts => rational_archive_parts
      procedure, non_overridable :: archive_rational => rational_archive_parts
   end type rational_stepper

contains

   !> The system is a linear one, and what it declares makes sense
   recursive subroutine check_linear(method, sys, status)
      character(len=*), intent(in) :: method           !! name, for the sentence
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      call check_size(sys, status)
      select type (sys)
      class is (mechanical_system)
         call check_mechanical(method, sys, status, takes_coupling=.true.)
      end select
      if (status%failed() .or. is_linear(sys)) return
      call status%set(dynstep_invalid_input, method//' steps linear systems, M q" + C q'' + K q = p(t) or y'' = A y + b(t): ' &
         & //'choose bi for others of first order, newmark-extrapolation in mechanics')
   end subroutine check_linear

   !> To be called by `init` with R
   recursive subroutine init_rational(self, sys, r, form, status)
      class(rational_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys          !! linear_system or linear_ode
      type(rational_type), intent(in) :: r
      integer, intent(in) :: form                      !! see dynstep_pole_stages
      type(status_type), intent(inout) :: status
      integer :: stat
      call self%note_init()
      call self%engine%init(sys, r, form, status)
      call self%end_solver%init(sys, status)
      if (status%failed()) return
      if (allocated(self%dy)) deallocate (self%dy)
      if (allocated(self%companion)) deallocate (self%companion, self%error)
      allocate (self%dy(sys%state_size()), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for a state of '//text(sys%state_size())//' numbers')
         return
      end if
      call self%note_init(sys)
   end subroutine init_rational

   recursive subroutine rational_start(self, sys, state, status)
      class(rational_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      call check_start(self, sys, state, status)
      if (status%failed()) return
      call self%reset()
      call self%end_solver%complete(sys, state, self%count, status)
      self%is_started = .not. status%failed()
   end subroutine rational_start

   pure subroutine rational_reset(self)
      class(rational_stepper), intent(inout) :: self
      call self%count%zero()
      call self%engine%forget()
      self%last_h = 0.0_wp
      if (allocated(self%companion)) call self%companion%forget()
      call self%end_solver%forget()
   end subroutine rational_reset

   recursive subroutine rational_try_step(self, sys, state, h, t1, trial, status)
      class(rational_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      call self%engine%step(sys, state%t, h, t1, state%y, self%dy, self%count, status)
      if (status%failed()) return
      trial%t = t1
      trial%y = state%y + self%dy
      call self%end_solver%complete(sys, trial, self%count, status)
   end subroutine rational_try_step

   !> To be called by `prepare_control` with the R of the companion
   recursive subroutine prepare_companion(self, sys, r, form, norm, status)
      class(rational_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(rational_type), intent(in) :: r
      integer, intent(in) :: form
      type(error_norm_type), intent(in) :: norm
      type(status_type), intent(inout) :: status
      integer :: stat
      call prepare_estimate(self, sys, norm, status)
      if (status%failed()) return
      if (allocated(self%companion)) deallocate (self%companion, self%error)
      allocate (self%companion)
      call self%companion%init(sys, r, form, status)
      allocate (self%error(sys%state_size()), source=0.0_wp, stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the estimate of '//text(sys%state_size())//' errors')
   end subroutine prepare_companion

   !> The step, and that of the companion
   recursive subroutine rational_try_within(self, sys, state, h, t1, norm, trial, verdict, status)
      class(rational_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(error_norm_type), intent(in) :: norm
      type(state_type), intent(inout) :: trial
      type(verdict_type), intent(out) :: verdict
      type(status_type), intent(inout) :: status
      type(method_properties) :: facts

      if (status%failed()) return
      if (.not. allocated(self%companion)) then
         call status%set(dynstep_invalid_input, 'steps are to be chosen by their error, but prepare_control was not called')
         return
      end if
      ! the rounding of a time is no reason for new factors
      if (abs(h - self%last_h) > min(2.0_wp*spacing(max(abs(state%t), abs(t1))), 1.0e-3_wp*abs(h))) self%last_h = h
      call self%try_step(sys, state, self%last_h, t1, trial, status)
      call self%companion%step(sys, state%t, self%last_h, t1, state%y, self%error, self%count, status)
      if (status%failed()) return
      self%error = self%dy - self%error
      if (.not. (all(ieee_is_finite(self%error)) .and. all(ieee_is_finite(trial%y)))) then
         call status%set(dynstep_not_finite, 'the step from t = '//text(state%t)//' leaves the range of numbers', retry=.true.)
         return
      end if
      facts = self%properties()
      verdict%order = facts%order
      verdict%error_order = facts%error_order
      verdict%error = norm%measure(self%error, state%y, trial%y)
   end subroutine rational_try_within

   !> Of the last controlled trial; `try_step` alone makes none
   recursive subroutine rational_estimate_error(self, error)
      class(rational_stepper), intent(in) :: self
      real(wp), intent(out) :: error(:)
      error = 0.0_wp
      if (allocated(self%error)) error = self%error
   end subroutine rational_estimate_error

   !> Steps in place; state%a after the last one alone.  On failure `state` is that of the last good step.
   recursive subroutine rational_advance(self, sys, state, clock, steps, status, complete)
      class(rational_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps
      type(status_type), intent(inout) :: status
      logical, intent(in) :: complete
      type(status_type) :: own
      integer :: i

      if (status%failed()) return
      do i = 1, steps
         call self%engine%step(sys, state%t, clock%h, clock%time(1), state%y, self%dy, self%count, status)
         if (status%failed()) exit
         state%y = state%y + self%dy
         state%t = clock%time(1)
         clock%k = clock%k + 1
         self%count%steps = self%count%steps + 1
      end do
      if (.not. complete) return
      if (status%failed()) then
         if (i > 1) call self%end_solver%complete(sys, state, self%count, own)
      else
         call self%end_solver%complete(sys, state, self%count, status)
      end if
   end subroutine rational_advance

   !> A step reads y alone
   pure logical function rational_needs_acceleration(self)
      class(rational_stepper), intent(in) :: self
      rational_needs_acceleration = .false.
   end function rational_needs_acceleration

   !> The engine, and a constant M
   recursive subroutine rational_archive_parts(self, file)
      class(rational_stepper), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call self%engine%archive('engine', file)
      call self%end_solver%archive('end_solver', file)
      call file%expect('has_companion', allocated(self%companion))
      if (allocated(self%companion)) call self%companion%archive('companion', file)
      call file%item('last_h', self%last_h)
   end subroutine rational_archive_parts
end module dynstep_rational_stepper
