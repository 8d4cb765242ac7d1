! SPDX-License-Identifier: BSD-3-Clause
!> Constraints and reactions that are C functions with a context pointer (Jay & Negrut 2008, eqs. (11)).
!>
!>   c_constrained_system   g, k, r and what belongs to them; what is no C function keeps the library's default
!>
!> The Jacobians go to C as the values of a jacobian_type: row after row, in the order of the pattern.
module dynstep_c_constraints
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_loc, c_null_ptr, c_ptr
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   implicit none
   private

   abstract interface
      !> dynstep_constraint of dynstep.h
      function c_constraint_function(n, m, t, q, g, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n, m
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*)
         real(c_double), intent(inout) :: g(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_constraint_function

      !> dynstep_constraint_jacobian
      function c_constraint_jacobian_function(n, m, t, q, gq, gt, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n, m
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*)
         real(c_double), intent(inout) :: gq(*), gt(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_constraint_jacobian_function

      !> dynstep_constraint_curvature, dynstep_velocity_constraint, _velocity_jacobian, _velocity_curvature
      function c_motion_function(n, rows, t, q, v, x, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n, rows            !! rows: m or p
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*), v(*)
         real(c_double), intent(inout) :: x(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_motion_function

      !> dynstep_reaction
      function c_reaction_function(n, m, p, t, q, v, lambda, psi, r, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n, m, p
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*), v(*), lambda(*), psi(*)
         real(c_double), intent(inout) :: r(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_reaction_function

      !> dynstep_reaction_jacobian
      function c_reaction_jacobian_function(n, m, p, t, q, v, lambda, psi, rl, rp, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n, m, p
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*), v(*), lambda(*), psi(*)
         real(c_double), intent(inout) :: rl(*), rp(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_reaction_jacobian_function

      !> dynstep_reaction_tangent
      function c_reaction_tangent_function(n, m, p, t, q, v, lambda, psi, k, c, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n, m, p
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*), v(*), lambda(*), psi(*)
         real(c_double), intent(inout) :: k(*)
         type(c_ptr), value :: c                     !! null where the system is velocity-free
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_reaction_tangent_function
   end interface
   public :: c_constraint_function, c_constraint_jacobian_function, c_motion_function
   public :: c_reaction_function, c_reaction_jacobian_function, c_reaction_tangent_function

   !> Functions of a user and their contexts; null where there is none
   type, abstract, extends(mechanical_system), public :: c_constrained_system
      procedure(c_constraint_function), pointer, nopass :: g_function => null()
      procedure(c_constraint_jacobian_function), pointer, nopass :: g_jacobian_function => null()
      procedure(c_motion_function), pointer, nopass :: g_curvature_function => null()
      procedure(c_motion_function), pointer, nopass :: k_function => null()
      procedure(c_motion_function), pointer, nopass :: k_jacobian_function => null()
      procedure(c_motion_function), pointer, nopass :: k_curvature_function => null()
      procedure(c_reaction_function), pointer, nopass :: r_function => null()
      procedure(c_reaction_jacobian_function), pointer, nopass :: r_jacobian_function => null()
      procedure(c_reaction_tangent_function), pointer, nopass :: r_tangent_function => null()
      type(c_ptr) :: g_context = c_null_ptr
      type(c_ptr) :: g_jacobian_context = c_null_ptr
      type(c_ptr) :: g_curvature_context = c_null_ptr
      type(c_ptr) :: k_context = c_null_ptr
      type(c_ptr) :: k_jacobian_context = c_null_ptr
      type(c_ptr) :: k_curvature_context = c_null_ptr
      type(c_ptr) :: r_context = c_null_ptr
      type(c_ptr) :: r_jacobian_context = c_null_ptr
      type(c_ptr) :: r_tangent_context = c_null_ptr
      real(wp), allocatable, private :: own_tangent(:, :, :)   ! what r_tangent_function fills, [rows, n, 2]
   contains
      procedure :: constraint => system_constraint
      procedure :: constraint_jacobian => system_constraint_jacobian
      procedure :: constraint_curvature => system_constraint_curvature
      procedure :: velocity_constraint => system_velocity_constraint
      procedure :: velocity_jacobian => system_velocity_jacobian
      procedure :: velocity_curvature => system_velocity_curvature
      procedure :: reaction => system_reaction
      procedure :: reaction_jacobian => system_reaction_jacobian
      procedure :: reaction_tangent => system_reaction_tangent
   end type c_constrained_system

contains

   recursive subroutine system_constraint(self, t, q, g, ierr)
      class(c_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      if (associated(self%g_function)) ierr = self%g_function(self%n, self%holonomic, t, q, g, self%g_context)
   end subroutine system_constraint

   recursive subroutine system_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(c_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      if (associated(self%g_jacobian_function)) then
         ierr = self%g_jacobian_function(self%n, self%holonomic, t, q, gq%value, gt, self%g_jacobian_context)
      else
         call self%difference_constraint_jacobian(t, q, gq, gt, ierr)
      end if
   end subroutine system_constraint_jacobian

   recursive subroutine system_constraint_curvature(self, t, q, v, c, ierr)
      class(c_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      if (associated(self%g_curvature_function)) then
         ierr = self%g_curvature_function(self%n, self%holonomic, t, q, v, c, self%g_curvature_context)
      else
         call self%difference_constraint_curvature(t, q, v, c, ierr)
      end if
   end subroutine system_constraint_curvature

   recursive subroutine system_velocity_constraint(self, t, q, v, k, ierr)
      class(c_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      if (associated(self%k_function)) ierr = self%k_function(self%n, self%nonholonomic, t, q, v, k, self%k_context)
   end subroutine system_velocity_constraint

   recursive subroutine system_velocity_jacobian(self, t, q, v, kv, ierr)
      class(c_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      if (associated(self%k_jacobian_function)) then
         ierr = self%k_jacobian_function(self%n, self%nonholonomic, t, q, v, kv%value, self%k_jacobian_context)
      else
         call self%difference_velocity_jacobian(t, q, v, kv, ierr)
      end if
   end subroutine system_velocity_jacobian

   recursive subroutine system_velocity_curvature(self, t, q, v, c, ierr)
      class(c_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%nonholonomic)
      integer, intent(out) :: ierr
      if (associated(self%k_curvature_function)) then
         ierr = self%k_curvature_function(self%n, self%nonholonomic, t, q, v, c, self%k_curvature_context)
      else
         call self%difference_velocity_curvature(t, q, v, c, ierr)
      end if
   end subroutine system_velocity_curvature

   recursive subroutine system_reaction(self, t, q, v, lambda, psi, r, ierr)
      class(c_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr
      if (associated(self%r_function)) then
         ierr = self%r_function(self%n, self%holonomic, self%nonholonomic, t, q, v, lambda, psi, r, self%r_context)
      else
         call self%lagrange_reaction(t, q, v, lambda, psi, r, ierr)
      end if
   end subroutine system_reaction

   recursive subroutine system_reaction_jacobian(self, t, q, v, lambda, psi, rl, rp, ierr)
      class(c_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(inout) :: rl(self%n, self%holonomic)
      real(wp), intent(inout) :: rp(self%n, self%nonholonomic)
      integer, intent(out) :: ierr
      if (associated(self%r_jacobian_function)) then
         ierr = self%r_jacobian_function(self%n, self%holonomic, self%nonholonomic, t, q, v, lambda, psi, rl, rp, &
            & self%r_jacobian_context)
      else
         call self%difference_reaction_jacobian(t, q, v, lambda, psi, rl, rp, ierr)
      end if
   end subroutine system_reaction_jacobian

   !> The function fills matrices that are zero, which are then added
   recursive subroutine system_reaction_tangent(self, t, q, v, lambda, psi, k, c, ierr)
      class(c_constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      if (.not. associated(self%r_tangent_function)) return
      if (allocated(self%own_tangent)) then
         if (size(self%own_tangent, 1) /= size(k%a, 1)) deallocate (self%own_tangent)
      end if
      if (.not. allocated(self%own_tangent)) allocate (self%own_tangent(size(k%a, 1), size(k%a, 2), 2))
      self%own_tangent = 0.0_wp
      call call_reaction_tangent(self, t, q, v, lambda, psi, c%kind == kind_zero, self%own_tangent(:, :, 1), &
         & self%own_tangent(:, :, 2), ierr)
      if (ierr /= 0) return
      k%a = k%a + self%own_tangent(:, :, 1)
      if (c%kind /= kind_zero) c%a = c%a + self%own_tangent(:, :, 2)
   end subroutine system_reaction_tangent

   !> The address of an array can be had where it is a target
   recursive subroutine call_reaction_tangent(self, t, q, v, lambda, psi, velocity_free, k, c, ierr)
      class(c_constrained_system), intent(in) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      logical, intent(in) :: velocity_free
      real(wp), intent(inout), contiguous :: k(:, :)
      real(wp), intent(inout), target, contiguous :: c(:, :)
      integer, intent(out) :: ierr
      type(c_ptr) :: address
      address = c_loc(c)
      if (velocity_free) address = c_null_ptr
      ierr = self%r_tangent_function(self%n, self%holonomic, self%nonholonomic, t, q, v, lambda, psi, k, address, &
         & self%r_tangent_context)
   end subroutine call_reaction_tangent
end module dynstep_c_constraints
