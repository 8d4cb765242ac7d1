! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: the system of a handle.  `dynstep.h` describes each function.
module dynstep_capi_systems
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_f_procpointer, c_int, &
      & c_intptr_t, c_null_funptr, c_null_ptr, c_ptr
   use dynstep_c_handle, only: change, integrator_type, reach, reach_mechanical
   use dynstep_c_matrices, only: check_storage, take_matrix
   use dynstep_c_systems, only: c_energy_function, c_force_function, c_load_function, c_tangent_function
   use dynstep_c_text, only: take_vector
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: load_none, load_procedure, load_samples
   use dynstep_load_table, only: load_table_type
   use dynstep_matrix, only: identity_matrix, kind_banded, kind_diagonal, kind_zero, matrix_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_success, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_set_force, dynstep_set_mass, dynstep_set_tangent, dynstep_set_structure, dynstep_set_energy
   public :: dynstep_set_matrix, dynstep_set_load, dynstep_set_load_table, dynstep_set_coupling

   !> `which` of dynstep_set_matrix, as in dynstep.h
   integer, parameter :: which_mass = 1, which_damping = 2, which_stiffness = 3

contains

   recursive function dynstep_set_force(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_force_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_force', s, 'dynstep_set_rhs')
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%general%force_function => p
      s%general%force_context = transfer(ctx, c_null_ptr)
      call change(s)
   end function dynstep_set_force

   recursive function dynstep_set_mass(handle, fun, ctx, kind, kl, ku, symmetric, constant) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int), value :: kind, kl, ku, symmetric, constant
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_force_function), pointer :: p

      code = reach_mechanical(handle, 'dynstep_set_mass', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) then
         call check_storage(s%n, kind, kl, ku, symmetric, kind_diagonal, s%status)
         code = s%status%code
         if (code /= dynstep_success) return
         call c_f_procpointer(transfer(fun, c_null_funptr), p)
         associate (structure => s%general%structure)
            structure%mass = kind
            structure%mass_kl = merge(kl, 0, kind == kind_banded)
            structure%mass_ku = merge(ku, 0, kind == kind_banded)
            structure%mass_is_symmetric = symmetric /= 0 .or. kind == kind_diagonal
            structure%mass_is_constant = constant /= 0
         end associate
      end if
      s%general%mass_function => p
      s%general%mass_context = transfer(ctx, c_null_ptr)
      s%m = identity_matrix(s%n)
      call change(s)
   end function dynstep_set_mass

   recursive function dynstep_set_tangent(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_tangent_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_tangent', s, 'dynstep_set_jacobian')
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%general%tangent_function => p
      s%general%tangent_context = transfer(ctx, c_null_ptr)
      call change(s)
   end function dynstep_set_tangent

   recursive function dynstep_set_structure(handle, kind, kl, ku, symmetric, constant, linear, velocity_free) &
      & result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: kind, kl, ku, symmetric, constant, linear, velocity_free
      integer(c_int) :: code
      type(integrator_type), pointer :: s

      code = reach_mechanical(handle, 'dynstep_set_structure', s, 'dynstep_set_jacobian')
      if (code /= dynstep_success) return
      call check_storage(s%n, kind, kl, ku, symmetric, kind_diagonal, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      associate (structure => s%general%structure)
         structure%tangent = kind
         structure%kl = merge(kl, 0, kind == kind_banded)
         structure%ku = merge(ku, 0, kind == kind_banded)
         structure%tangent_is_symmetric = symmetric /= 0 .or. kind == kind_diagonal
         structure%tangent_is_constant = constant /= 0
         structure%velocity_free = velocity_free /= 0
      end associate
      s%declared_linear = linear /= 0
      call change(s)
   end function dynstep_set_structure

   recursive function dynstep_set_energy(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_energy_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_energy', s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%general%energy_function => p
      s%general%energy_context = transfer(ctx, c_null_ptr)
      s%general%structure%has_energy = fun /= 0
      call change(s)
   end function dynstep_set_energy

   recursive function dynstep_set_matrix(handle, which, kind, kl, ku, symmetric, a) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: which, kind, kl, ku, symmetric
      type(c_ptr), value :: a
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(matrix_type) :: matrix

      code = reach_mechanical(handle, 'dynstep_set_matrix', s, 'dynstep_set_system_matrix')
      if (code /= dynstep_success) return
      if (which < which_mass .or. which > which_stiffness) then
         call s%status%set(dynstep_invalid_input, 'which = '//text(which)//' must be 1 (mass), 2 (damping) or 3 ' &
            & //'(stiffness)')
      else if (which == which_mass .and. kind == kind_zero) then
         call s%status%set(dynstep_invalid_input, 'kind: the mass matrix must not be zero')
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      call take_matrix(name_of(which), s%n, kind, kl, ku, symmetric, a, matrix, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      select case (which)
      case (which_mass)
         s%m = matrix
         s%general%mass_function => null()
      case (which_damping)
         s%c = matrix
      case (which_stiffness)
         s%k = matrix
      end select
      s%has_matrices = .true.
      call change(s)
   end function dynstep_set_matrix

   pure function name_of(which) result(name)
      integer(c_int), intent(in) :: which
      character(len=1) :: name
      character(len=1), parameter :: names(3) = ['M', 'C', 'K']
      name = names(which)
   end function name_of

   recursive function dynstep_set_load(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_load_function), pointer :: p
      code = reach_mechanical(handle, 'dynstep_set_load', s, 'dynstep_set_source')
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%linear%load_function => p
      s%linear%load_context = transfer(ctx, c_null_ptr)
      if (fun /= 0) then
         s%linear%load_kind = load_procedure
      else if (s%linear%load_kind == load_procedure) then
         s%linear%load_kind = load_none
      end if
      call change(s)
   end function dynstep_set_load

   recursive function dynstep_set_coupling(handle, b, k, c) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      type(c_ptr), value :: b, k, c
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      real(wp), allocatable :: coupling(:, :)

      code = reach_mechanical(handle, 'dynstep_set_coupling', s)
      if (code /= dynstep_success) return
      allocate (coupling(s%n, 3))
      if (c_associated(b)) then
         call take_gains('b', b, coupling(:, 1), s%status)
         call take_gains('k', k, coupling(:, 2), s%status)
         call take_gains('c', c, coupling(:, 3), s%status)
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      if (allocated(s%coupling)) deallocate (s%coupling)
      if (c_associated(b)) call move_alloc(coupling, s%coupling)
      call change(s)
   end function dynstep_set_coupling

   recursive subroutine take_gains(name, from, gains, status)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from                !! null: zeros
      real(wp), intent(out) :: gains(:)
      type(status_type), intent(inout) :: status
      real(c_double), pointer :: x(:)
      gains = 0.0_wp
      if (.not. c_associated(from)) return
      call take_vector(name, size(gains, kind=c_int), from, x, status)
      if (.not. status%failed()) gains = x
   end subroutine take_gains

   recursive function dynstep_set_load_table(handle, signals, ns, t0, dt, times, samples, pattern, outside) &
      & result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: signals, ns
      real(c_double), value :: t0, dt
      type(c_ptr), value :: times, samples, pattern
      integer(c_int), value :: outside
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(load_table_type) :: table
      real(c_double), pointer :: vector(:), array(:, :)

      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (ns == 0) then
         if (s%linear%load_kind == load_samples) s%linear%load_kind = load_none
         if (s%linear_ode%source_kind == load_samples) s%linear_ode%source_kind = load_none
         s%linear%table = table
         s%linear_ode%table = table
         call change(s)
         return
      end if
      if (signals < 1 .or. ns < 2) then
         call s%status%set(dynstep_invalid_input, 'signals = '//text(signals)//' and ns = '//text(ns) &
            & //': a load table needs at least one signal and two samples')
      else if (signals /= s%n .and. .not. c_associated(pattern)) then
         call s%status%set(dynstep_invalid_input, 'signals = '//text(signals)//' must be n = '//text(s%n) &
            & //' where pattern is NULL')
      else if (.not. c_associated(samples)) then
         call s%status%set(dynstep_invalid_input, 'samples is NULL')
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      table%t0 = t0
      table%dt = dt
      table%outside = outside
      call c_f_pointer(samples, array, [signals, ns])
      table%samples = array
      if (c_associated(times)) then
         call c_f_pointer(times, vector, [ns])
         table%times = vector
      end if
      if (c_associated(pattern)) then
         call c_f_pointer(pattern, array, [s%n, int(signals)])
         table%pattern = array
      end if
      if (s%first_order) then
         call s%linear_ode%set_table(table, s%status)
         if (.not. s%status%failed()) s%linear_ode%source_function => null()
      else
         call s%linear%set_table(table, s%status)
         if (.not. s%status%failed()) s%linear%load_function => null()
      end if
      code = s%status%code
      if (code == dynstep_success) call change(s)
   end function dynstep_set_load_table
end module dynstep_capi_systems
