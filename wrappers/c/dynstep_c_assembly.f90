! SPDX-License-Identifier: BSD-3-Clause
!> System and method of a handle, made from what was set.
module dynstep_c_assembly
   use dynstep_c_handle, only: integrator_type
   use dynstep_flat_method, only: build_method
   use dynstep_linear_system, only: load_none
   use dynstep_matrix, only: kind_zero
   use dynstep_status, only: dynstep_invalid_input
   use dynstep_stepper, only: allocate_state
   implicit none
   private

   public :: assemble, assemble_system

contains

   !> Make s%sys, s%stepper and room for the state; no work where they fit the settings already
   recursive subroutine assemble(s)
      type(integrator_type), intent(inout), target :: s
      if (s%assembled) return
      call assemble_system(s)
      if (s%status%failed()) return
      call build_method(s%method, s%stepper)
      call s%stepper%init(s%sys, s%status)
      call allocate_state(s%sys, s%state, s%status)
      s%assembled = .not. s%status%failed()
   end subroutine assemble

   !> A force makes a general system, matrices and loads make a linear one
   recursive subroutine assemble_system(s)
      type(integrator_type), intent(inout), target :: s

      if (s%status%failed()) return
      s%sys => null()
      if (associated(s%general%force_function)) then
         if (s%c%kind /= kind_zero .or. s%k%kind /= kind_zero) then
            call s%status%set(dynstep_invalid_input, 'set a force or the matrices C and K, not both; add ' &
               & //'-C v - K q to the force')
         else if (s%linear%load_kind /= load_none) then
            call s%status%set(dynstep_invalid_input, 'set a force or a load, not both; add the load to the force')
         else
            call assemble_mass(s)
            ! difference tangents are good to 1e-8, too little for a single correction
            s%general%structure%force_is_linear = s%declared_linear .and. associated(s%general%tangent_function)
            s%sys => s%general
         end if
      else if (associated(s%general%mass_function) .or. associated(s%general%tangent_function) .or. &
         & associated(s%general%energy_function)) then
         call s%status%set(dynstep_invalid_input, 'set a force: functions of mass, tangent and energy go with one, ' &
            & //'a linear system has matrices instead')
      else if (.not. s%has_matrices .and. s%linear%load_kind == load_none) then
         call s%status%set(dynstep_invalid_input, 'set a force, or the matrices of a linear system')
      else
         call s%linear%set(s%m, s%c, s%k, s%status)
         if (.not. s%status%failed()) s%sys => s%linear
      end if
   end subroutine assemble_system

   !> A mass that is a matrix tells its own structure
   recursive subroutine assemble_mass(s)
      type(integrator_type), intent(inout) :: s
      if (associated(s%general%mass_function)) return
      s%general%m = s%m
      associate (structure => s%general%structure)
         structure%mass = s%m%kind
         structure%mass_kl = s%m%kl
         structure%mass_ku = s%m%ku
         structure%mass_is_symmetric = s%m%symmetric
         structure%mass_is_constant = .true.
      end associate
   end subroutine assemble_mass
end module dynstep_c_assembly
