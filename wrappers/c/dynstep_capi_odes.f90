! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: first-order systems.  `dynstep.h` describes each function.
module dynstep_capi_odes
   use, intrinsic :: iso_c_binding, only: c_double, c_f_procpointer, c_int, c_intptr_t, c_null_funptr, c_null_ptr, c_ptr
   use dynstep_c_assembly, only: assemble, start_at
   use dynstep_c_handle, only: change, check_started, integrator_type, reach_first_order
   use dynstep_c_matrices, only: check_storage, take_matrix
   use dynstep_c_odes, only: c_rhs_function
   use dynstep_c_systems, only: c_load_function
   use dynstep_c_text, only: give, take_state
   use dynstep_linear_system, only: load_none, load_procedure
   use dynstep_matrix, only: kind_banded, kind_diagonal, matrix_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_success
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_set_rhs, dynstep_set_jacobian, dynstep_set_system_matrix, dynstep_set_source
   public :: dynstep_start_ode, dynstep_get_ode

contains

   recursive function dynstep_set_rhs(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_rhs_function), pointer :: p
      code = reach_first_order(handle, 'dynstep_set_rhs', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%ode%rhs_function => p
      s%ode%rhs_context = transfer(ctx, c_null_ptr)
      call change(s)
   end function dynstep_set_rhs

   recursive function dynstep_set_jacobian(handle, fun, ctx, kind, kl, ku) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int), value :: kind, kl, ku
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_rhs_function), pointer :: p
      code = reach_first_order(handle, 'dynstep_set_jacobian', s)
      if (code /= dynstep_success) return
      call check_storage(s%n, kind, kl, ku, 0_c_int, kind_diagonal, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%ode%jacobian_function => p
      s%ode%jacobian_context = transfer(ctx, c_null_ptr)
      s%ode%jacobian_kind = kind
      s%ode%jacobian_kl = merge(kl, 0, kind == kind_banded)
      s%ode%jacobian_ku = merge(ku, 0, kind == kind_banded)
      call change(s)
   end function dynstep_set_jacobian

   recursive function dynstep_set_system_matrix(handle, kind, kl, ku, a) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: kind, kl, ku
      type(c_ptr), value :: a
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(matrix_type) :: matrix
      code = reach_first_order(handle, 'dynstep_set_system_matrix', s)
      if (code /= dynstep_success) return
      call take_matrix('A', s%n, kind, kl, ku, 0_c_int, a, matrix, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      s%a = matrix
      call change(s)
   end function dynstep_set_system_matrix

   recursive function dynstep_set_source(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_load_function), pointer :: p
      code = reach_first_order(handle, 'dynstep_set_source', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      associate (sys => s%linear_ode)
         sys%source_function => p
         sys%source_context = transfer(ctx, c_null_ptr)
         if (fun /= 0) then
            sys%source_kind = load_procedure
         else if (sys%source_kind == load_procedure) then
            sys%source_kind = load_none
         end if
      end associate
      call change(s)
   end function dynstep_set_source

   recursive function dynstep_start_ode(handle, n, t, y) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: n
      real(c_double), value :: t
      type(c_ptr), value :: y
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      real(c_double), pointer :: y0(:)
      code = reach_first_order(handle, 'dynstep_start_ode', s)
      if (code /= dynstep_success) return
      call take_state(s%n, n, t, y, y0, s%status)
      call assemble(s)
      code = s%status%code
      if (code /= dynstep_success) return
      s%state%y = y0
      call start_at(s, t)
      code = s%status%code
   end function dynstep_start_ode

   recursive function dynstep_get_ode(handle, n, t, y, yp) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: n
      type(c_ptr), value :: t, y, yp
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach_first_order(handle, 'dynstep_get_ode', s)
      if (code /= dynstep_success) return
      if (n /= s%n) call s%status%set(dynstep_invalid_input, 'n = '//text(n)//', but the system has '//text(s%n) &
         & //' unknowns')
      call check_started(s)
      code = s%status%code
      if (code /= dynstep_success) return
      call give([s%state%t], t)
      call give(s%state%y, y)
      call give(s%state%a, yp)
   end function dynstep_get_ode
end module dynstep_capi_odes
