! SPDX-License-Identifier: BSD-3-Clause
!> Outcome of a library call: a code for programs, a sentence for people.
!>
!> No procedure of the library stops the program or prints.  Each one that can fail
!> has a last argument `status` (intent inout); a call on a failed status returns at
!> once, so that a caller may make several calls and look once.
!>
!>   code = 0   done
!>   code > 0   done, with news (an observer's stop, a step allowance used up)
!>   code < 0   failed; the state is that of the last accepted step
module dynstep_status
   implicit none
   private

   public :: status_type, status_text

   integer, parameter, public :: dynstep_success = 0
   integer, parameter, public :: dynstep_stopped = 1            !! an observer asked to stop
   integer, parameter, public :: dynstep_more = 2               !! allowance of steps used up, call again
   integer, parameter, public :: dynstep_event = 3              !! a terminal event was met
   integer, parameter, public :: dynstep_invalid_input = -1     !! an argument is out of its range
   integer, parameter, public :: dynstep_callback_failed = -2   !! a user procedure refused
   integer, parameter, public :: dynstep_not_converged = -3     !! Newton's iteration did not converge
   integer, parameter, public :: dynstep_singular_matrix = -4   !! a matrix is singular or indefinite
   integer, parameter, public :: dynstep_step_too_small = -5    !! the step length reached its lower limit
   integer, parameter, public :: dynstep_no_memory = -6         !! an allocation failed
   integer, parameter, public :: dynstep_inconsistent_start = -7!! the start does not fit the equations
   integer, parameter, public :: dynstep_too_many_steps = -8    !! a limit on steps was reached
   integer, parameter, public :: dynstep_in_use = -9            !! an integrator called from its own callback
   integer, parameter, public :: dynstep_not_finite = -10       !! a user procedure gave NaN or infinity
   integer, parameter, public :: dynstep_file_error = -11       !! a file cannot be read or is not what it should be
   integer, parameter, public :: dynstep_invalid_handle = -12   !! not a handle, or one that was deleted

   integer, parameter, public :: dynstep_too_many_events = -13  !! events one after the other without a step between
   integer, parameter, public :: dynstep_tolerance_too_small = -14   !! round-off does not allow the accuracy asked for

   !> Length of a status message
   integer, parameter, public :: message_length = 320

   !> Code, whether a smaller step may help, and a sentence that says what happened,
   !> where (time, step, equation) and what helps
   type :: status_type
      integer :: code = dynstep_success             !! one of the codes above
      logical :: retry = .false.                    !! true where a smaller step may succeed
      character(len=message_length) :: message = '' !! blank on success
   contains
      !> True where the call did not do its work
      procedure :: failed => status_failed
      !> Set code and sentence
      procedure :: set => status_set
      !> Back to success
      procedure :: clear => status_clear
   end type status_type

contains

   pure logical function status_failed(self)
      class(status_type), intent(in) :: self
      status_failed = self%code < 0
   end function status_failed

   pure subroutine status_set(self, code, message, retry)
      class(status_type), intent(inout) :: self
      integer, intent(in) :: code
      character(len=*), intent(in) :: message
      logical, intent(in), optional :: retry   !! default .false.
      self%code = code
      self%message = message
      self%retry = .false.
      if (present(retry)) self%retry = retry
   end subroutine status_set

   pure subroutine status_clear(self)
      class(status_type), intent(inout) :: self
      self%code = dynstep_success
      self%retry = .false.
      self%message = ''
   end subroutine status_clear

   !> A few words for a code, the same in every language (padded: a deferred length would be static data)
   pure function status_text(code) result(words)
      integer, intent(in) :: code
      character(len=56) :: words
      select case (code)
      case (dynstep_success); words = 'success'
      case (dynstep_stopped); words = 'stopped by an observer'
      case (dynstep_more); words = 'the allowance of steps of this call is used up'
      case (dynstep_event); words = 'a terminal event was met'
      case (dynstep_invalid_input); words = 'an argument is invalid'
      case (dynstep_callback_failed); words = 'a user procedure failed'
      case (dynstep_not_converged); words = 'the Newton iteration did not converge'
      case (dynstep_singular_matrix); words = 'a matrix is singular or indefinite'
      case (dynstep_step_too_small); words = 'the step length became too small'
      case (dynstep_no_memory); words = 'out of memory'
      case (dynstep_inconsistent_start); words = 'the start is not consistent'
      case (dynstep_too_many_steps); words = 'too many steps'
      case (dynstep_in_use); words = 'the integrator is in use'
      case (dynstep_not_finite); words = 'a user procedure returned a value that is not finite'
      case (dynstep_file_error); words = 'a file cannot be used'
      case (dynstep_invalid_handle); words = 'the handle is not valid'
      case (dynstep_too_many_events); words = 'too many events in a row'
      case (dynstep_tolerance_too_small); words = 'the tolerance is below round-off'
      case default; words = 'unknown status code'
      end select
   end function status_text
end module dynstep_status
