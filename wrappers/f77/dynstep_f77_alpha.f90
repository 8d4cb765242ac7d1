! SPDX-License-Identifier: BSD-3-Clause
!> DSGALF and DSSOI2: their options, and their runs.
module dynstep_f77_alpha
   use dynstep_alpha_coefficients, only: alpha_coefficients, coefficients_of
   use dynstep_f77_constraints, only: f77_constrained_out, f77_constrained_output, f77_constrained_system, &
      & f77_constraint, f77_constraint_jacobian, f77_velocity_constraint, f77_velocity_jacobian
   use dynstep_f77_options, only: describe_external, describe_newton
   use dynstep_f77_run, only: advance, give_counts
   use dynstep_f77_systems, only: f77_force, f77_mass, f77_out, f77_output, f77_system, f77_tangent
   use dynstep_flat_method, only: base_generalized_alpha, base_soi2, build_method, method_settings
   use dynstep_kinds, only: wp
   use dynstep_soi2, only: mass_recomputed, start_keep, variant_index3
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_stepper, only: state_type, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: run_generalized_alpha, run_soi2

   ! Places in IOPT and ROPT, see the prologue of DSSOI2
   integer, parameter :: at_variant = 5, at_start_mode = 6, at_mass_of_step = 7, at_coefficients = 8, at_first_step = 9, &
      & at_g_jacobian = 24, at_k_jacobian = 25
   integer, parameter :: at_radius = 1, at_first_coefficient = 4

contains

   !> DSGALF
   recursive subroutine run_generalized_alpha(n, force, mass, tang, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, &
      & icnt, idid, message)
      integer, intent(in) :: n
      procedure(f77_force) :: force
      procedure(f77_mass) :: mass
      procedure(f77_tangent) :: tang
      procedure(f77_out) :: out
      real(wp), intent(inout) :: t, q(*), v(*), a(*)
      real(wp), intent(in) :: tend, h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(inout) :: icnt(*)
      integer, intent(out) :: idid
      character(len=*), intent(out) :: message
      type(f77_system) :: sys
      type(f77_output) :: output
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(status_type) :: status

      icnt(:10) = 0
      call describe_external(n, force, mass, tang, iopt, rpar, ipar, sys, status)
      call describe_alpha(base_generalized_alpha, iopt, ropt, stepper, status)
      output%out_external => out
      call advance(sys, stepper, output, state, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, status)
      if (allocated(stepper)) call give_counts(stepper%count, icnt)
      idid = status%code
      message = status%message
   end subroutine run_generalized_alpha

   !> DSSOI2
   recursive subroutine run_soi2(n, m, p, force, mass, tang, gcon, gjac, kcon, kjac, out, t, q, v, a, lambda, psi, tend, &
      & h, iopt, ropt, rpar, ipar, icnt, idid, message)
      integer, intent(in) :: n, m, p
      procedure(f77_force) :: force
      procedure(f77_mass) :: mass
      procedure(f77_tangent) :: tang
      procedure(f77_constraint) :: gcon
      procedure(f77_constraint_jacobian) :: gjac
      procedure(f77_velocity_constraint) :: kcon
      procedure(f77_velocity_jacobian) :: kjac
      procedure(f77_constrained_out) :: out
      real(wp), intent(inout) :: t, q(*), v(*), a(*), lambda(*), psi(*)
      real(wp), intent(in) :: tend, h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(inout) :: icnt(*)
      integer, intent(out) :: idid
      character(len=*), intent(out) :: message
      type(f77_constrained_system) :: sys
      type(f77_constrained_output) :: output
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(status_type) :: status
      integer :: stat

      icnt(:11) = 0
      call describe_external(n, force, mass, tang, iopt, rpar, ipar, sys, status)
      call check_number('M', m, n, status)
      call check_number('P', p, n, status)
      if (.not. status%failed()) then
         sys%holonomic = m
         sys%nonholonomic = p
         sys%g_external => gcon
         sys%k_external => kcon
         if (iopt(at_g_jacobian) /= 0) sys%g_jacobian_external => gjac
         if (iopt(at_k_jacobian) /= 0) sys%k_jacobian_external => kjac
         allocate (sys%g_columns(m, n), sys%k_columns(p, n), stat=stat)
         if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for '//text(m + p)//' constraints of N = '//text(n) &
            & //' coordinates')
      end if
      call describe_alpha(base_soi2, iopt, ropt, stepper, status)
      output%constrained_external => out
      call advance(sys, stepper, output, state, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, status)
      if (allocated(stepper)) then
         call give_counts(stepper%count, icnt)
         icnt(11) = int(min(int(huge(0), kind(stepper%count%constraints)), stepper%count%constraints))
         if (stepper%is_started) then
            lambda(:m) = state%lambda
            psi(:p) = state%psi
         end if
      end if
      idid = status%code
      message = status%message
   end subroutine run_soi2

   recursive subroutine check_number(name, number, n, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: number, n
      type(status_type), intent(inout) :: status
      if (status%failed() .or. (number >= 0 .and. number <= n)) return
      call status%set(dynstep_invalid_input, name//' = '//text(number)//' constraints must lie between 0 and N = '//text(n))
   end subroutine check_number

   !> The method that the options tell
   recursive subroutine describe_alpha(base, iopt, ropt, stepper, status)
      integer, intent(in) :: base                 !! base_generalized_alpha or base_soi2
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      class(stepper_type), allocatable, intent(out) :: stepper
      type(status_type), intent(inout) :: status
      type(method_settings) :: method

      if (status%failed()) return
      method%base = base
      call take_coefficients(iopt, ropt, method%alpha%coefficients, status)
      if (base == base_soi2) then
         call take_choice(at_variant, variant_index3, 'the variant', iopt, method%alpha%variant, status)
         call take_choice(at_start_mode, start_keep, 'the start', iopt, method%alpha%start_mode, status)
      end if
      call take_choice(at_mass_of_step, mass_recomputed, 'the mass at the begin of a step', iopt, method%alpha%mass_at, status)
      method%alpha%second_order_start = iopt(at_first_step) == 0
      call describe_newton(iopt, ropt, method%newton, status)
      if (.not. status%failed()) call build_method(method, stepper)
   end subroutine describe_alpha

   !> IOPT(at) is 0, the default, or one of 1 to `last`
   recursive subroutine take_choice(at, last, name, iopt, choice, status)
      integer, intent(in) :: at, last
      character(len=*), intent(in) :: name
      integer, intent(in) :: iopt(*)
      integer, intent(inout) :: choice
      type(status_type), intent(inout) :: status
      if (status%failed() .or. iopt(at) == 0) return
      choice = iopt(at)
      if (choice < 1 .or. choice > last) call status%set(dynstep_invalid_input, 'IOPT('//text(at)//') = '//text(choice) &
         & //', '//name//', must be 0 to '//text(last))
   end subroutine take_choice

   !> Those of rho_inf = 0.8, or as ROPT tells
   recursive subroutine take_coefficients(iopt, ropt, coefficients, status)
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      type(alpha_coefficients), intent(inout) :: coefficients
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      select case (iopt(at_coefficients))
      case (0)
         continue
      case (1)
         call coefficients_of(ropt(at_radius), coefficients, status)
         if (status%failed()) call status%set(dynstep_invalid_input, 'ROPT('//text(at_radius)//') = ' &
            & //text(ropt(at_radius))//', the spectral radius, must lie between 0 and 1')
      case (2)
         associate (c => ropt(at_first_coefficient:at_first_coefficient + 3))
            coefficients = alpha_coefficients(c(1), c(2), c(3), c(4))
         end associate
         call coefficients%check(status)
      case default
         call status%set(dynstep_invalid_input, 'IOPT('//text(at_coefficients)//') = '//text(iopt(at_coefficients)) &
            & //', the coefficients, must be 0, 1 (RHO) or 2 (all four)')
      end select
   end subroutine take_coefficients
end module dynstep_f77_alpha
