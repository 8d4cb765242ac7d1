! SPDX-License-Identifier: BSD-3-Clause
!> First-order systems whose procedures are C functions with a context pointer.
!>
!>   c_ode_system     general: y' = f(t,y), with a Jacobian by a C function or by differences
!>   c_linear_ode     y' = A y + b(t), with b by a C function where there is one
module dynstep_c_odes
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_null_ptr, c_ptr
   use dynstep_c_events, only: c_switching
   use dynstep_c_systems, only: c_load_function
   use dynstep_kinds, only: wp
   use dynstep_linear_ode, only: linear_ode
   use dynstep_matrix, only: matrix_type
   use dynstep_ode_system, only: ode_system
   implicit none
   private

   abstract interface
      !> dynstep_rhs of dynstep.h; dynstep_jacobian_function has it too, the matrix in the place of f
      function c_rhs_function(n, t, y, f, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n
         real(c_double), value :: t
         real(c_double), intent(in) :: y(*)
         real(c_double), intent(inout) :: f(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_rhs_function
   end interface
   public :: c_rhs_function

   type, extends(ode_system), public :: c_ode_system
      procedure(c_rhs_function), pointer, nopass :: rhs_function => null()
      procedure(c_rhs_function), pointer, nopass :: jacobian_function => null()   !! null: by differences
      type(c_ptr) :: rhs_context = c_null_ptr
      type(c_ptr) :: jacobian_context = c_null_ptr
      type(c_switching) :: switching
   contains
      procedure :: rhs => system_rhs
      procedure :: jacobian => system_jacobian
      procedure :: switch_values => system_switch_values
      procedure :: sides_changed => system_sides_changed
   end type c_ode_system

   !> dynstep_load is the form of a source, too
   type, extends(linear_ode), public :: c_linear_ode
      procedure(c_load_function), pointer, nopass :: source_function => null()
      type(c_ptr) :: source_context = c_null_ptr
   contains
      procedure :: source => linear_source
   end type c_linear_ode

contains

   recursive subroutine system_rhs(self, t, y, f, ierr)
      class(c_ode_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = self%rhs_function(self%n, t, y, f, self%rhs_context)
   end subroutine system_rhs

   recursive subroutine system_jacobian(self, t, y, jac, ierr)
      class(c_ode_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(self%n)
      type(matrix_type), intent(inout) :: jac
      integer, intent(out) :: ierr
      if (associated(self%jacobian_function)) then
         ierr = self%jacobian_function(self%n, t, y, jac%a, self%jacobian_context)
      else
         call self%difference_jacobian(t, y, jac, ierr)
      end if
   end subroutine system_jacobian

   recursive subroutine system_switch_values(self, t, y, s, ierr)
      class(c_ode_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      call self%switching%values(self%n, t, y, s, ierr)
   end subroutine system_switch_values

   recursive subroutine system_sides_changed(self)
      class(c_ode_system), intent(inout) :: self
      call self%switching%tell(self%side)
   end subroutine system_sides_changed

   recursive subroutine linear_source(self, t, b, ierr)
      class(c_linear_ode), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: b(self%n)
      integer, intent(out) :: ierr
      if (associated(self%source_function)) then
         ierr = self%source_function(self%n, t, b, self%source_context)
      else
         call self%linear_ode%source(t, b, ierr)
      end if
   end subroutine linear_source
end module dynstep_c_odes
