! SPDX-License-Identifier: BSD-3-Clause
!> Events, actions and switch functions that are C functions with a context pointer.
!>
!>   c_events      what is watched for in a run, and what is done there
!>   c_switching   switch functions of a system, and the caller's copy of the sides
module dynstep_c_events
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_loc, c_null_ptr, c_ptr
   use dynstep_events, only: event_type
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_stepper, only: state_type
   implicit none
   private

   abstract interface
      !> dynstep_event_function and dynstep_switch_function of dynstep.h
      function c_event_function(n, count, t, q, v, s, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n, count
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*)
         type(c_ptr), value :: v                     !! null for a first-order system
         real(c_double), intent(inout) :: s(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_event_function

      !> dynstep_event_action
      function c_action_function(n, which, t, q, v, ctx) result(outcome) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n, which
         real(c_double), value :: t
         real(c_double), intent(inout) :: q(*)
         type(c_ptr), value :: v                     !! null for a first-order system
         type(c_ptr), value :: ctx
         integer(c_int) :: outcome
      end function c_action_function
   end interface
   public :: c_event_function, c_action_function

   type, extends(event_type), public :: c_events
      integer :: n = 0                                       !! coordinates, or unknowns of a first-order system
      procedure(c_event_function), pointer, nopass :: event_function => null()     !! null: there are no events
      procedure(c_action_function), pointer, nopass :: action_function => null()
      type(c_ptr) :: event_context = c_null_ptr
      type(c_ptr) :: action_context = c_null_ptr
      real(wp), allocatable, private :: y(:)                 ! what an action writes
   contains
      procedure :: values => events_values
      procedure :: act => events_act
   end type c_events

   type, public :: c_switching
      procedure(c_event_function), pointer, nopass :: switch_function => null()
      type(c_ptr) :: context = c_null_ptr
      integer(c_int), pointer, contiguous :: side(:) => null()    !! of the caller, [switches]; null: not wanted
   contains
      procedure :: values => switching_values
      procedure :: tell => switching_tell
   end type c_switching

contains

   recursive subroutine events_values(self, t, y, s, ierr)
      class(c_events), intent(inout) :: self
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = call_function(self%event_function, self%n, t, y, s, self%event_context)
   end subroutine events_values

   !> The function may write without saying that it has: then nothing is changed
   recursive subroutine events_act(self, i, sys, state, changed, ierr)
      class(c_events), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: changed
      integer, intent(out) :: ierr
      ierr = 0
      if (.not. associated(self%action_function)) return
      self%y = state%y
      ierr = call_action(self%action_function, self%n, i - 1, state%t, self%y, self%action_context)
      changed = ierr > 0
      if (changed) state%y = self%y
      ierr = min(ierr, 0)
   end subroutine events_act

   recursive subroutine switching_values(self, n, t, y, s, ierr)
      class(c_switching), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = call_function(self%switch_function, n, t, y, s, self%context)
   end subroutine switching_values

   !> Let the caller know
   recursive subroutine switching_tell(self, side)
      class(c_switching), intent(in) :: self
      integer, intent(in) :: side(:)
      if (associated(self%side)) self%side = side
   end subroutine switching_tell

   !> The address of an array can be had where it is a target
   recursive function call_function(fun, n, t, y, s, context) result(ierr)
      procedure(c_event_function) :: fun
      integer, intent(in) :: n
      real(wp), intent(in) :: t
      real(wp), intent(in), target, contiguous :: y(:)       !! [n], or [q; v]
      real(wp), intent(inout) :: s(:)
      type(c_ptr), intent(in) :: context
      integer :: ierr
      type(c_ptr) :: v
      v = c_null_ptr
      if (size(y) > n) v = c_loc(y(n + 1))
      ierr = fun(n, size(s), t, y, v, s, context)
   end function call_function

   recursive function call_action(fun, n, which, t, y, context) result(outcome)
      procedure(c_action_function) :: fun
      integer, intent(in) :: n, which
      real(wp), intent(in) :: t
      real(wp), intent(inout), target, contiguous :: y(:)
      type(c_ptr), intent(in) :: context
      integer :: outcome
      type(c_ptr) :: v
      v = c_null_ptr
      if (size(y) > n) v = c_loc(y(n + 1))
      outcome = fun(n, which, t, y, v, context)
   end function call_action
end module dynstep_c_events
