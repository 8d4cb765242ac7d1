! SPDX-License-Identifier: BSD-3-Clause
!> Events and actions that are EXTERNAL subroutines of FORTRAN 77 form.
!>
!> The run ends at each event, or where IOPT(24) = 1 an action decides: JOB = 0 goes on, 1 goes on with what it has
!> changed, 2 ends the run, 3 ends it with what it has changed.
module dynstep_f77_events
   use dynstep_events, only: event_type
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_stepper, only: state_type
   use dynstep_text, only: text
   implicit none
   private

   abstract interface
      subroutine f77_event(n, nev, t, q, v, s, rpar, ipar, ierr)
         import :: wp
         integer :: n, nev, ipar(*), ierr
         real(wp) :: t, q(n), v(n), s(nev), rpar(*)
      end subroutine f77_event

      subroutine f77_action(n, kev, t, q, v, job, rpar, ipar, ierr)
         import :: wp
         integer :: n, kev, job, ipar(*), ierr
         real(wp) :: t, q(n), v(n), rpar(*)
      end subroutine f77_action

      subroutine f77_ode_event(n, nev, t, y, s, rpar, ipar, ierr)
         import :: wp
         integer :: n, nev, ipar(*), ierr
         real(wp) :: t, y(n), s(nev), rpar(*)
      end subroutine f77_ode_event

      subroutine f77_ode_action(n, kev, t, y, job, rpar, ipar, ierr)
         import :: wp
         integer :: n, kev, job, ipar(*), ierr
         real(wp) :: t, y(n), rpar(*)
      end subroutine f77_ode_action
   end interface
   public :: f77_event, f77_action, f77_ode_event, f77_ode_action

   !> Events of any system; an extension calls the subroutines
   type, abstract, extends(event_type), public :: f77_any_events
      integer :: n = 0
      integer :: last = 0                                    !! event that was met last
      logical :: has_action = .false.
      real(wp), pointer, contiguous :: rpar(:) => null()
      integer, pointer, contiguous :: ipar(:) => null()
      real(wp), allocatable :: y(:)                          !! what an action writes
   contains
      procedure :: act => events_act
      procedure :: describe => events_describe
      procedure(call_action_interface), deferred :: call_action
   end type f77_any_events

   abstract interface
      !> The subroutine ACTION, on self%y
      recursive subroutine call_action_interface(self, i, t, job, ierr)
         import :: f77_any_events, wp
         class(f77_any_events), intent(inout) :: self
         integer, intent(in) :: i
         real(wp), intent(in) :: t
         integer, intent(inout) :: job, ierr
      end subroutine call_action_interface
   end interface

   !> Of mechanical systems
   type, extends(f77_any_events), public :: f77_events
      procedure(f77_event), pointer, nopass :: event_external => null()
      procedure(f77_action), pointer, nopass :: action_external => null()
   contains
      procedure :: values => events_values
      procedure :: call_action => events_call_action
   end type f77_events

   !> Of first-order systems
   type, extends(f77_any_events), public :: f77_ode_events
      procedure(f77_ode_event), pointer, nopass :: event_external => null()
      procedure(f77_ode_action), pointer, nopass :: action_external => null()
   contains
      procedure :: values => ode_events_values
      procedure :: call_action => ode_events_call_action
   end type f77_ode_events

   ! Place in IOPT, see the prologue of DSADAP
   integer, parameter :: at_action = 24

contains

   !> What the arguments of a driver say of its events
   recursive subroutine events_describe(self, n, nev, idir, iopt, rpar, ipar, status)
      class(f77_any_events), intent(inout) :: self
      integer, intent(in) :: n, nev                          !! nev = 0: none
      integer, intent(in) :: idir(*)                         !! [nev]
      integer, intent(in) :: iopt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      type(status_type), intent(inout) :: status
      integer :: i
      if (status%failed()) return
      if (nev < 0) then
         call status%set(dynstep_invalid_input, 'NEV = '//text(nev)//', the events, must not be negative')
      else if (iopt(at_action) < 0 .or. iopt(at_action) > 1) then
         call status%set(dynstep_invalid_input, 'IOPT('//text(at_action)//') = '//text(iopt(at_action)) &
            & //' must be 0 (the run ends at each event) or 1 (ACTION is called)')
      end if
      do i = 1, nev
         if (abs(idir(i)) > 1) call status%set(dynstep_invalid_input, 'IDIR('//text(i)//') = '//text(idir(i)) &
            & //', the direction of an event, must be -1, 0 or 1')
      end do
      if (status%failed()) return
      self%n = n
      self%count = max(1, nev)
      self%direction = idir(:nev)
      self%has_action = iopt(at_action) /= 0
      allocate (self%terminal(nev), source=.not. self%has_action)
      self%rpar => rpar(1:1)
      self%ipar => ipar(1:1)
   end subroutine events_describe

   recursive subroutine events_act(self, i, sys, state, changed, ierr)
      class(f77_any_events), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: changed
      integer, intent(out) :: ierr
      integer :: job
      ierr = 0
      self%last = i
      if (.not. self%has_action) return
      job = 0
      self%y = state%y
      call self%call_action(i, state%t, job, ierr)
      if (ierr == 0 .and. (job < 0 .or. job > 3)) ierr = -1
      if (ierr /= 0) return
      changed = modulo(job, 2) == 1
      self%terminal(i) = job >= 2
      if (changed) state%y = self%y
   end subroutine events_act

   recursive subroutine events_values(self, t, y, s, ierr)
      class(f77_events), intent(inout) :: self
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      call self%event_external(self%n, size(s), t, y(:self%n), y(self%n + 1:), s, self%rpar, self%ipar, ierr)
   end subroutine events_values

   recursive subroutine events_call_action(self, i, t, job, ierr)
      class(f77_events), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: t
      integer, intent(inout) :: job, ierr
      call self%action_external(self%n, i, t, self%y(:self%n), self%y(self%n + 1:), job, self%rpar, self%ipar, ierr)
   end subroutine events_call_action

   recursive subroutine ode_events_values(self, t, y, s, ierr)
      class(f77_ode_events), intent(inout) :: self
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      call self%event_external(self%n, size(s), t, y, s, self%rpar, self%ipar, ierr)
   end subroutine ode_events_values

   recursive subroutine ode_events_call_action(self, i, t, job, ierr)
      class(f77_ode_events), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: t
      integer, intent(inout) :: job, ierr
      call self%action_external(self%n, i, t, self%y, job, self%rpar, self%ipar, ierr)
   end subroutine ode_events_call_action
end module dynstep_f77_events
