! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: constraints and reactions of a handle.  `dynstep.h` describes each function.
module dynstep_capi_constraints
   use, intrinsic :: iso_c_binding, only: c_f_procpointer, c_int, c_intptr_t, c_null_funptr, c_null_ptr
   use dynstep_c_constraints, only: c_constraint_function, c_constraint_jacobian_function, c_motion_function, &
      & c_reaction_function, c_reaction_jacobian_function, c_reaction_tangent_function
   use dynstep_c_handle, only: change, integrator_type, reach_mechanical
   use dynstep_jacobian, only: pattern_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_success, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_set_constraint, dynstep_set_constraint_jacobian, dynstep_set_constraint_curvature
   public :: dynstep_set_velocity_constraint, dynstep_set_velocity_jacobian, dynstep_set_velocity_curvature
   public :: dynstep_set_reaction, dynstep_set_reaction_jacobian, dynstep_set_reaction_tangent

contains

   recursive function dynstep_set_constraint(handle, m, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: m
      integer(c_intptr_t), value :: fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_constraint_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_constraint', s)
      if (code /= dynstep_success) return
      if (fun /= 0) call check_number('m', m, s%n, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      p => null()
      associate (sys => s%general)
         if (fun /= 0) then
            call c_f_procpointer(transfer(fun, c_null_funptr), p)
            sys%holonomic = m
         else
            sys%holonomic = 0
            sys%g_jacobian_function => null()
            sys%g_curvature_function => null()
            sys%constraints%g = pattern_type()
         end if
         sys%g_function => p
         sys%g_context = transfer(ctx, c_null_ptr)
      end associate
      call change(s)
   end function dynstep_set_constraint

   !> No more constraints than coordinates
   recursive subroutine check_number(name, number, n, status)
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: number
      integer, intent(in) :: n
      type(status_type), intent(inout) :: status
      if (number >= 1 .and. number <= n) return
      call status%set(dynstep_invalid_input, name//' = '//text(number)//' must lie between 1 and n = '//text(n) &
         & //': more constraints than coordinates depend on each other')
   end subroutine check_number

   recursive function dynstep_set_constraint_jacobian(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_constraint_jacobian_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_constraint_jacobian', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%general%g_jacobian_function => p
      s%general%g_jacobian_context = transfer(ctx, c_null_ptr)
      call change(s)
   end function dynstep_set_constraint_jacobian

   recursive function dynstep_set_constraint_curvature(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_motion_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_constraint_curvature', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%general%g_curvature_function => p
      s%general%g_curvature_context = transfer(ctx, c_null_ptr)
      call change(s)
   end function dynstep_set_constraint_curvature

   recursive function dynstep_set_velocity_constraint(handle, p, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: p
      integer(c_intptr_t), value :: fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_motion_function), pointer :: k
      code = reach_mechanical(handle, 'dynstep_set_velocity_constraint', s)
      if (code /= dynstep_success) return
      if (fun /= 0) call check_number('p', p, s%n, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      k => null()
      associate (sys => s%general)
         if (fun /= 0) then
            call c_f_procpointer(transfer(fun, c_null_funptr), k)
            sys%nonholonomic = p
         else
            sys%nonholonomic = 0
            sys%k_jacobian_function => null()
            sys%k_curvature_function => null()
            sys%constraints%k = pattern_type()
         end if
         sys%k_function => k
         sys%k_context = transfer(ctx, c_null_ptr)
      end associate
      call change(s)
   end function dynstep_set_velocity_constraint

   recursive function dynstep_set_velocity_jacobian(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_motion_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_velocity_jacobian', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%general%k_jacobian_function => p
      s%general%k_jacobian_context = transfer(ctx, c_null_ptr)
      call change(s)
   end function dynstep_set_velocity_jacobian

   recursive function dynstep_set_velocity_curvature(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_motion_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_velocity_curvature', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%general%k_curvature_function => p
      s%general%k_curvature_context = transfer(ctx, c_null_ptr)
      call change(s)
   end function dynstep_set_velocity_curvature

   recursive function dynstep_set_reaction(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_reaction_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_reaction', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) then
         call c_f_procpointer(transfer(fun, c_null_funptr), p)
      else
         s%general%r_jacobian_function => null()
      end if
      s%general%r_function => p
      s%general%r_context = transfer(ctx, c_null_ptr)
      s%general%constraints%reaction_is_general = fun /= 0
      call change(s)
   end function dynstep_set_reaction

   recursive function dynstep_set_reaction_jacobian(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_reaction_jacobian_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_reaction_jacobian', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%general%r_jacobian_function => p
      s%general%r_jacobian_context = transfer(ctx, c_null_ptr)
      call change(s)
   end function dynstep_set_reaction_jacobian

   recursive function dynstep_set_reaction_tangent(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_reaction_tangent_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_reaction_tangent', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%general%r_tangent_function => p
      s%general%r_tangent_context = transfer(ctx, c_null_ptr)
      s%general%constraints%has_reaction_tangent = fun /= 0
      call change(s)
   end function dynstep_set_reaction_tangent
end module dynstep_capi_constraints
