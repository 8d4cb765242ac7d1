! SPDX-License-Identifier: BSD-3-Clause
!> y' = A y + b(t) with a constant matrix (Xie 1995, eq. (2.1), with a source).
!>
!> PROGRAMMING INTERFACE
!>
!>     type(linear_ode) :: sys
!>     call sys%set(a, status)                  ! matrix_type
!>     call sys%set_table(table, status)        ! a source given by samples
!>
!>   A source given by a procedure: extend LINEAR_ODE, override SOURCE, and set
!>   source_kind = load_procedure.  SOURCE is all that an extension may change: the steppers read the matrix.
module dynstep_linear_ode
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: load_none, load_samples
   use dynstep_load_table, only: load_table_type
   use dynstep_matrix, only: kind_diagonal, matrix_type
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, status_type
   implicit none
   private

   type, extends(ode_system), public :: linear_ode
      type(matrix_type) :: a                     !! [n,n]
      integer :: source_kind = load_none         !! load_none, load_procedure or load_samples
      type(load_table_type) :: table
   contains
      procedure :: set => linear_ode_set
      procedure :: set_table => linear_ode_set_table
      procedure :: source => linear_ode_source
      procedure :: rhs => linear_ode_rhs
      procedure :: jacobian => linear_ode_jacobian
   end type linear_ode

contains

   !> Take the matrix
   subroutine linear_ode_set(self, a, status)
      class(linear_ode), intent(inout) :: self
      type(matrix_type), intent(in) :: a            !! of order n >= 1
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (a%n < 1) call status%set(dynstep_invalid_input, 'A must have at least one row')
      call a%check('A', a%n, status)
      if (status%failed()) return
      self%n = a%n
      self%a = a
      self%jacobian_kind = max(kind_diagonal, a%kind)
      self%jacobian_kl = a%kl
      self%jacobian_ku = a%ku
   end subroutine linear_ode_set

   !> Take a source given by samples
   subroutine linear_ode_set_table(self, table, status)
      class(linear_ode), intent(inout) :: self
      type(load_table_type), intent(in) :: table
      type(status_type), intent(inout) :: status
      call table%check(self%n, status)
      if (status%failed()) return
      self%table = table
      self%source_kind = load_samples
   end subroutine linear_ode_set_table

   !> b(t); an override goes with source_kind = load_procedure
   recursive subroutine linear_ode_source(self, t, b, ierr)
      class(linear_ode), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: b(self%n)
      integer, intent(out) :: ierr           !! 0, > 0 smaller step, < 0 give up
      ierr = 0
      if (self%source_kind == load_samples) then
         call self%table%evaluate(t, b)
      else
         b = 0.0_wp
      end if
   end subroutine linear_ode_source

   !> f = A y + b
   recursive subroutine linear_ode_rhs(self, t, y, f, ierr)
      class(linear_ode), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      call self%source(t, f, ierr)
      if (ierr == 0) call self%a%multiply_add(1.0_wp, y, f)
   end subroutine linear_ode_rhs

   recursive subroutine linear_ode_jacobian(self, t, y, jac, ierr)
      class(linear_ode), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(self%n)
      type(matrix_type), intent(inout) :: jac
      integer, intent(out) :: ierr
      ierr = 0
      call self%a%add_to(1.0_wp, jac)
   end subroutine linear_ode_jacobian
end module dynstep_linear_ode
