! SPDX-License-Identifier: BSD-3-Clause
!> What methods y1 = R(hA) y of linear systems have in common: start, trial steps, many steps in place.
!>
!> An extension gives `properties` and `init`, which calls `init_rational` with its R.
module dynstep_rational_stepper
   use dynstep_accelerations, only: acceleration_solver
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_rational, only: rational_type
   use dynstep_rational_engine, only: is_linear, rational_engine
   use dynstep_start_check, only: check_mechanical, check_size, check_start
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_stepper, only: clock_type, state_type, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_linear

   type, abstract, extends(stepper_type), public :: rational_stepper
      type(rational_engine), private :: engine
      type(acceleration_solver), private :: end_solver
      real(wp), allocatable, private :: dy(:)              ! increment of a step [state_size]
   contains
      procedure, non_overridable :: init_rational
      procedure :: start => rational_start
      procedure, non_overridable :: start_rational => rational_start
      procedure :: reset => rational_reset
      procedure :: try_step => rational_try_step
      procedure :: advance => rational_advance
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
   end subroutine rational_archive_parts
end module dynstep_rational_stepper
