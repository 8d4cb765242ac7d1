! SPDX-License-Identifier: BSD-3-Clause
!> What a user watches for in a run, what is done there, and the list of what was met.
!>
!>   event_type      extend it: functions s(t, y) whose signs are watched, and an action
!>   event_log       the events of a run: which, when, and the state there
!>
!> A function that goes through zero inside a step ends that step: it is made again, for real, up to the zero, so that the
!> state there has the error of the method.  Then ACT may change the state (an impact) or parameters of the system; a run
!> starts anew behind it, with new accelerations, and constraints are made consistent.
module dynstep_events
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_stepper, only: state_type
   use dynstep_text, only: text
   implicit none
   private

   type, abstract, public :: event_type
      integer :: count = 1                        !! number of functions
      integer, allocatable :: direction(:)        !! [count] +1: only from minus to plus, -1: only from plus to minus, 0: both
                                                  !! (in the direction of the run); not allocated: all both
      logical, allocatable :: terminal(:)         !! [count] .true.: the run ends there; not allocated: none
   contains
      procedure(values_interface), deferred :: values
      procedure :: act => no_action
      procedure :: check => event_check
   end type event_type

   abstract interface
      !> The functions s(t, y), smooth where the motion is
      recursive subroutine values_interface(self, t, y, s, ierr)
         import :: event_type, wp
         class(event_type), intent(inout) :: self
         real(wp), intent(in) :: t                !! time
         real(wp), intent(in) :: y(:)             !! state, [q; v] of a mechanical system
         real(wp), intent(out) :: s(:)            !! values [count]
         integer, intent(out) :: ierr             !! 0, > 0 a smaller step may help, < 0 give up
      end subroutine values_interface
   end interface

   !> Events of a run in the order of time
   type, public :: event_log
      integer :: count = 0                        !! events kept; the arrays may be longer
      integer, allocatable :: which(:)            !! [count] function, 1 .. events%count
      real(wp), allocatable :: t(:)               !! [count] times
      real(wp), allocatable :: y(:, :)            !! [state_size, count] states, before the action
   contains
      procedure :: add => log_add
      procedure :: archive => log_archive
   end type event_log

contains

   !> What is done at event i, before the run goes on; the default does nothing.  state%y may be changed (not its time), and
   !> the system, whose dimensions and declared structure must stay.
   recursive subroutine no_action(self, i, sys, state, changed, ierr)
      class(event_type), intent(inout) :: self
      integer, intent(in) :: i                            !! function that went through zero, 1 .. count
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: changed                   !! .false. on entry; .true.: the run starts anew here
      integer, intent(out) :: ierr                        !! /= 0: the run ends without success
      ierr = 0
   end subroutine no_action

   !> Sizes and ranges
   recursive subroutine event_check(self, status)
      class(event_type), intent(in) :: self
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (self%count < 1) then
         call status%set(dynstep_invalid_input, 'events have count = '//text(self%count)//' functions; 1 or more are needed')
         return
      end if
      if (allocated(self%direction)) then
         if (size(self%direction) /= self%count) then
            call status%set(dynstep_invalid_input, 'direction of the events has '//text(size(self%direction)) &
               & //' values for '//text(self%count)//' functions')
            return
         end if
      end if
      if (.not. allocated(self%terminal)) return
      if (size(self%terminal) /= self%count) call status%set(dynstep_invalid_input, 'terminal of the events has ' &
         & //text(size(self%terminal))//' values for '//text(self%count)//' functions')
   end subroutine event_check

   !> One more event
   recursive subroutine log_add(self, which, state, status)
      class(event_log), intent(inout) :: self
      integer, intent(in) :: which
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      integer, allocatable :: longer_which(:)
      real(wp), allocatable :: longer_t(:), longer_y(:, :)
      integer :: room, stat

      if (status%failed()) return
      room = 0
      if (allocated(self%which)) room = size(self%which)
      if (self%count >= room) then
         room = max(16, 2*room)
         allocate (longer_which(room), longer_t(room), longer_y(size(state%y), room), stat=stat)
         if (stat /= 0) then
            call status%set(dynstep_no_memory, 'no memory for '//text(room)//' events')
            return
         end if
         if (self%count > 0) then
            longer_which(:self%count) = self%which(:self%count)
            longer_t(:self%count) = self%t(:self%count)
            longer_y(:, :self%count) = self%y(:, :self%count)
         end if
         call move_alloc(longer_which, self%which)
         call move_alloc(longer_t, self%t)
         call move_alloc(longer_y, self%y)
      end if
      self%count = self%count + 1
      self%which(self%count) = which
      self%t(self%count) = state%t
      self%y(:, self%count) = state%y
   end subroutine log_add

   !> To a checkpoint or from it
   recursive subroutine log_archive(self, file)
      class(event_log), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%section('events')
      call file%item('count', self%count)
      if (file%failed()) return
      if (file%is_reading .and. allocated(self%which)) deallocate (self%which, self%t, self%y)
      call file%item('which', self%which)
      call file%item('t', self%t)
      call file%item('y', self%y)
      call file%end_section()
   end subroutine log_archive
end module dynstep_events
