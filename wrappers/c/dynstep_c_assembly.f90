! SPDX-License-Identifier: BSD-3-Clause
!> System and method of a handle, made from what was set, and their start.
module dynstep_c_assembly
   use dynstep_c_handle, only: integrator_type
   use dynstep_flat_method, only: build_method
   use dynstep_jacobian, only: pattern_type
   use dynstep_linear_system, only: load_none
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_zero
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_stepper, only: allocate_state, clock_type
   use dynstep_text, only: text
   implicit none
   private

   public :: assemble, assemble_system, start_at

contains

   !> Make s%sys, s%stepper and room for the state; no work where they fit the settings already.  A stepper that was prepared
   !> for the tolerances of a run is made anew.
   recursive subroutine assemble(s)
      type(integrator_type), intent(inout), target :: s
      if (s%assembled .and. .not. s%is_tuned) return
      call assemble_system(s)
      if (s%status%failed()) return
      call build_method(s%method, s%stepper)
      call s%stepper%init(s%sys, s%status)
      call allocate_state(s%sys, s%state, s%status)
      s%assembled = .not. s%status%failed()
      s%is_tuned = .false.
      s%restored_steps = 0
   end subroutine assemble

   !> Start at time t, from s%state%y
   recursive subroutine start_at(s, t)
      type(integrator_type), intent(inout) :: s
      real(wp), intent(in) :: t
      s%started = .false.
      s%running = .false.
      s%state%t = t
      s%busy = .true.
      call s%stepper%start(s%sys, s%state, s%status)
      s%busy = .false.
      s%started = .not. s%status%failed()
      s%step_clock = clock_type(t0=t, h=0.0_wp, k=0)
   end subroutine start_at

   recursive subroutine assemble_system(s)
      type(integrator_type), intent(inout), target :: s
      if (s%status%failed()) return
      s%sys => null()
      if (s%first_order) then
         call assemble_first_order(s)
      else
         call assemble_mechanical(s)
      end if
   end subroutine assemble_system

   !> A right-hand side makes a general system, a matrix a linear one
   recursive subroutine assemble_first_order(s)
      type(integrator_type), intent(inout), target :: s
      if (associated(s%ode%rhs_function)) then
         if (allocated(s%a)) then
            call s%status%set(dynstep_invalid_input, 'set a right-hand side or the matrix of a linear system, not both; ' &
               & //'add A y to the right-hand side')
         else if (s%linear_ode%source_kind /= load_none) then
            call s%status%set(dynstep_invalid_input, 'set a right-hand side or a source, not both; add the source to the ' &
               & //'right-hand side')
         else
            s%sys => s%ode
         end if
      else if (s%ode%switches > 0) then
         call s%status%set(dynstep_invalid_input, 'set a right-hand side: switches go with one')
      else if (associated(s%ode%jacobian_function)) then
         call s%status%set(dynstep_invalid_input, 'set a right-hand side: its Jacobian goes with one, a linear system has ' &
            & //'a matrix instead')
      else if (.not. allocated(s%a)) then
         call s%status%set(dynstep_invalid_input, 'set a right-hand side (dynstep_set_rhs), or the matrix of a linear ' &
            & //'system (dynstep_set_system_matrix)')
      else
         call s%linear_ode%set(s%a, s%status)
         if (.not. s%status%failed()) s%sys => s%linear_ode
      end if
   end subroutine assemble_first_order

   !> A force makes a general system, matrices and loads make a linear one
   recursive subroutine assemble_mechanical(s)
      type(integrator_type), intent(inout), target :: s
      if (associated(s%general%force_function)) then
         if (s%c%kind /= kind_zero .or. s%k%kind /= kind_zero) then
            call s%status%set(dynstep_invalid_input, 'set a force or the matrices C and K, not both; add ' &
               & //'-C v - K q to the force')
         else if (s%linear%load_kind /= load_none) then
            call s%status%set(dynstep_invalid_input, 'set a force or a load, not both; add the load to the force')
         else if (allocated(s%coupling)) then
            call s%status%set(dynstep_invalid_input, 'set a force or a coupling, not both; add -b (k.q + c.v) to the force')
         else
            call assemble_mass(s)
            call check_constraints(s)
            ! difference tangents are good to 1e-8, too little for a single correction
            s%general%structure%force_is_linear = s%declared_linear .and. associated(s%general%tangent_function)
            s%sys => s%general
         end if
      else if (associated(s%general%mass_function) .or. associated(s%general%tangent_function) .or. &
         & associated(s%general%energy_function)) then
         call s%status%set(dynstep_invalid_input, 'set a force: functions of mass, tangent and energy go with one, ' &
            & //'a linear system has matrices instead')
      else if (associated(s%general%g_function) .or. associated(s%general%k_function)) then
         call s%status%set(dynstep_invalid_input, 'set a force: constraints go with one; add -C v - K q and the load of ' &
            & //'a linear system to it, and give its mass by dynstep_set_matrix')
      else if (s%general%switches > 0) then
         call s%status%set(dynstep_invalid_input, 'set a force: switches go with one; add -C v - K q and the load of a ' &
            & //'linear system to it')
      else if (.not. s%has_matrices .and. s%linear%load_kind == load_none .and. .not. allocated(s%coupling)) then
         call s%status%set(dynstep_invalid_input, 'set a force, or the matrices of a linear system')
      else
         call s%linear%set(s%m, s%c, s%k, s%status)
         if (allocated(s%coupling)) call s%linear%set_coupling(s%coupling(:, 1), s%coupling(:, 2), s%coupling(:, 3), s%status)
         if (.not. s%status%failed()) s%sys => s%linear
      end if
   end subroutine assemble_mechanical

   !> What belongs to constraints goes with them, and has their number
   recursive subroutine check_constraints(s)
      type(integrator_type), intent(inout) :: s
      integer :: unknowns
      associate (sys => s%general, status => s%status)
         if (.not. associated(sys%g_function) .and. (associated(sys%g_jacobian_function) .or. &
            & associated(sys%g_curvature_function) .or. .not. sys%constraints%g%is_dense())) then
            call status%set(dynstep_invalid_input, 'set a constraint: its Jacobian, curvature and pattern go with one')
         else if (.not. associated(sys%k_function) .and. (associated(sys%k_jacobian_function) .or. &
            & associated(sys%k_curvature_function) .or. .not. sys%constraints%k%is_dense())) then
            call status%set(dynstep_invalid_input, 'set a velocity constraint: its Jacobian, curvature and pattern go with one')
         else if (associated(sys%r_jacobian_function) .and. .not. associated(sys%r_function)) then
            call status%set(dynstep_invalid_input, 'set a reaction: its Jacobian goes with one')
         else if (sys%holonomic + sys%nonholonomic == 0 .and. (associated(sys%r_function) .or. &
            & associated(sys%r_tangent_function))) then
            call status%set(dynstep_invalid_input, 'set a constraint: reactions and their tangents go with one')
         end if
         call check_rows('constraint_jacobian', sys%constraints%g, sys%holonomic, status)
         call check_rows('velocity_jacobian', sys%constraints%k, sys%nonholonomic, status)
         if (status%failed() .or. .not. allocated(sys%constraints%order)) return
         unknowns = sys%n + sys%holonomic + sys%nonholonomic
         if (size(sys%constraints%order) /= unknowns) call status%set(dynstep_invalid_input, &
            & 'the constraint order has '//text(size(sys%constraints%order))//' unknowns, but n + m + p = '//text(unknowns))
      end associate
   end subroutine check_constraints

   recursive subroutine check_rows(name, pattern, rows, status)
      character(len=*), intent(in) :: name
      type(pattern_type), intent(in) :: pattern
      integer, intent(in) :: rows                  !! constraints that there are
      type(status_type), intent(inout) :: status
      if (status%failed() .or. pattern%is_dense()) return
      if (size(pattern%first) /= rows + 1) call status%set(dynstep_invalid_input, 'the pattern of '//name//' has ' &
         & //text(size(pattern%first) - 1)//' rows, but there are '//text(rows)//' constraints')
   end subroutine check_rows

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
