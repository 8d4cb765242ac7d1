! SPDX-License-Identifier: BSD-3-Clause
!> Constrained systems, and output with multipliers, by EXTERNAL subroutines of FORTRAN 77 form.
module dynstep_f77_constraints
   use dynstep_f77_systems, only: f77_output, f77_system
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_callback_failed, status_type
   use dynstep_stepper, only: state_type
   implicit none
   private

   abstract interface
      subroutine f77_constraint(n, m, t, q, g, rpar, ipar, ierr)
         import :: wp
         integer :: n, m, ipar(*), ierr
         real(wp) :: t, q(n), g(m), rpar(*)
      end subroutine f77_constraint

      subroutine f77_constraint_jacobian(n, m, t, q, gq, gt, rpar, ipar, ierr)
         import :: wp
         integer :: n, m, ipar(*), ierr
         real(wp) :: t, q(n), gq(m, n), gt(m), rpar(*)
      end subroutine f77_constraint_jacobian

      subroutine f77_velocity_constraint(n, p, t, q, v, c, rpar, ipar, ierr)
         import :: wp
         integer :: n, p, ipar(*), ierr
         real(wp) :: t, q(n), v(n), c(p), rpar(*)
      end subroutine f77_velocity_constraint

      subroutine f77_velocity_jacobian(n, p, t, q, v, cv, rpar, ipar, ierr)
         import :: wp
         integer :: n, p, ipar(*), ierr
         real(wp) :: t, q(n), v(n), cv(p, n), rpar(*)
      end subroutine f77_velocity_jacobian

      subroutine f77_constrained_out(n, m, p, t, q, v, a, lambda, psi, rpar, ipar, istop)
         import :: wp
         integer :: n, m, p, ipar(*), istop
         real(wp) :: t, q(n), v(n), a(n), lambda(m), psi(p), rpar(*)
      end subroutine f77_constrained_out
   end interface
   public :: f77_constraint, f77_constraint_jacobian, f77_velocity_constraint, f77_velocity_jacobian, f77_constrained_out

   type, extends(f77_system), public :: f77_constrained_system
      procedure(f77_constraint), pointer, nopass :: g_external => null()
      procedure(f77_constraint_jacobian), pointer, nopass :: g_jacobian_external => null()   !! null: by differences
      procedure(f77_velocity_constraint), pointer, nopass :: k_external => null()
      procedure(f77_velocity_jacobian), pointer, nopass :: k_jacobian_external => null()     !! null: by differences
      real(wp), allocatable :: g_columns(:, :)   !! what the Jacobian subroutines fill [m, n]
      real(wp), allocatable :: k_columns(:, :)   !! [p, n]
   contains
      procedure :: constraint => system_constraint
      procedure :: constraint_jacobian => system_constraint_jacobian
      procedure :: velocity_constraint => system_velocity_constraint
      procedure :: velocity_jacobian => system_velocity_jacobian
   end type f77_constrained_system

   type, extends(f77_output), public :: f77_constrained_output
      procedure(f77_constrained_out), pointer, nopass :: constrained_external => null()
   contains
      procedure :: record => constrained_record
   end type f77_constrained_output

contains

   recursive subroutine system_constraint(self, t, q, g, ierr)
      class(f77_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      call self%g_external(self%n, self%holonomic, t, q, g, self%rpar, self%ipar, ierr)
   end subroutine system_constraint

   recursive subroutine system_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(f77_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      if (.not. associated(self%g_jacobian_external)) then
         call self%difference_constraint_jacobian(t, q, gq, gt, ierr)
         return
      end if
      ierr = 0
      self%g_columns = 0.0_wp
      call self%g_jacobian_external(self%n, self%holonomic, t, q, self%g_columns, gt, self%rpar, self%ipar, ierr)
      call by_rows(self%g_columns, gq)
   end subroutine system_constraint_jacobian

   recursive subroutine system_velocity_constraint(self, t, q, v, k, ierr)
      class(f77_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      call self%k_external(self%n, self%nonholonomic, t, q, v, k, self%rpar, self%ipar, ierr)
   end subroutine system_velocity_constraint

   recursive subroutine system_velocity_jacobian(self, t, q, v, kv, ierr)
      class(f77_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      if (.not. associated(self%k_jacobian_external)) then
         call self%difference_velocity_jacobian(t, q, v, kv, ierr)
         return
      end if
      ierr = 0
      self%k_columns = 0.0_wp
      call self%k_jacobian_external(self%n, self%nonholonomic, t, q, v, self%k_columns, self%rpar, self%ipar, ierr)
      call by_rows(self%k_columns, kv)
   end subroutine system_velocity_jacobian

   !> A dense Jacobian keeps its entries row after row
   pure subroutine by_rows(columns, jacobian)
      real(wp), intent(in) :: columns(:, :)
      type(jacobian_type), intent(inout) :: jacobian
      integer :: i, j
      do i = 1, jacobian%rows
         do j = 1, jacobian%columns
            jacobian%value((i - 1)*jacobian%columns + j) = columns(i, j)
         end do
      end do
   end subroutine by_rows

   !> As f77_output does it, with the multipliers
   recursive subroutine constrained_record(self, state, status)
      class(f77_constrained_output), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      integer :: stop_asked
      if (status%failed() .or. self%stopped) return
      stop_asked = 0
      call self%constrained_external(self%n, size(state%lambda), size(state%psi), state%t, state%y(:self%n), &
         & state%y(self%n + 1:), state%a, state%lambda, state%psi, self%rpar, self%ipar, stop_asked)
      self%stopped = stop_asked /= 0
      if (self%stopped) call status%set(dynstep_callback_failed, 'OUT asked to stop')
   end subroutine constrained_record
end module dynstep_f77_constraints
