! SPDX-License-Identifier: BSD-3-Clause
!> The problem in its most general form: y' = f(t, y).
!>
!> PROGRAMMING INTERFACE
!>
!>   A user extends ODE_SYSTEM, sets N, and gives the deferred procedure RHS.  Data of the
!>   model are components of the extension, so a model needs no module variables, and two
!>   models of one type can be integrated at once.
!>
!>   Every user procedure ends with IERR:  0 fine,  > 0 outside the model's domain, a
!>   smaller step may help,  < 0 give up and return to the caller.
module dynstep_ode_system
   use dynstep_kinds, only: wp
   implicit none
   private

   type, abstract, public :: ode_system
      !> Number of unknowns of the system, >= 1; a mechanical system counts coordinates
      integer :: n = 0
   contains
      !> Length of the state vector y
      procedure :: state_size => ode_state_size
      !> f(t, y)
      procedure(rhs_interface), deferred :: rhs
   end type ode_system

   abstract interface
      recursive subroutine rhs_interface(self, t, y, f, ierr)
         import :: ode_system, wp
         class(ode_system), intent(inout) :: self
         real(wp), intent(in) :: t             !! time
         real(wp), intent(in) :: y(:)          !! state [state_size]
         real(wp), intent(out) :: f(:)         !! y' [state_size]
         integer, intent(out) :: ierr          !! 0, > 0 try a smaller step, < 0 give up
      end subroutine rhs_interface
   end interface

contains

   pure integer function ode_state_size(self)
      class(ode_system), intent(in) :: self
      ode_state_size = self%n
   end function ode_state_size
end module dynstep_ode_system
