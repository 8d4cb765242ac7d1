! SPDX-License-Identifier: BSD-3-Clause
!> A method as numbers, the way C and F77 callers give it, and the stepper that it makes.
module dynstep_flat_method
   use dynstep_alpha_coefficients, only: alpha_coefficients, coefficients_of
   use dynstep_backinterpolation, only: backinterpolation_stepper, halves_taylor
   use dynstep_equilibrium, only: newton_options
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_generalized_alpha, only: generalized_alpha_stepper
   use dynstep_kinds, only: wp
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
   use dynstep_pade, only: pade_stepper
   use dynstep_pole_stages, only: form_automatic
   use dynstep_soi2, only: estimate_larger, mass_stored, soi2_stepper, start_project, variant_soi2
   use dynstep_status, only: status_type
   use dynstep_stepper, only: stepper_type
   implicit none
   private

   public :: build_method, coefficients_of_radius

   integer, parameter, public :: base_newmark = 0, base_midpoint = 1, base_generalized_alpha = 2, base_soi2 = 3, &
      & base_pade = 4, base_backinterpolation = 5

   !> Options of generalized-alpha and SOI2, see soi2_stepper
   type, public :: alpha_settings
      type(alpha_coefficients) :: coefficients
      integer :: variant = variant_soi2
      integer :: mass_at = mass_stored
      logical :: adjust_acceleration = .true., adjust_momentum = .true., second_order_start = .true.
      integer :: start_mode = start_project
      integer :: estimate = estimate_larger
   end type alpha_settings

   !> Options of backinterpolation, see backinterpolation_stepper
   type, public :: backinterpolation_settings
      integer :: p = 4, q = 4
      real(wp) :: alpha = 0.5_wp
      integer :: halves = halves_taylor
   end type backinterpolation_settings

   type, public :: method_settings
      integer :: base = base_newmark
      real(wp) :: beta = 0.25_wp, gamma = 0.5_wp
      type(alpha_settings) :: alpha
      integer :: pade_p = 4, pade_q = 4          !! degrees of numerator and denominator
      integer :: pade_form = form_automatic      !! see dynstep_pole_stages
      type(backinterpolation_settings) :: bi
      logical :: listing_sign = .false.          !! of the error estimate of backinterpolation
      type(newton_options) :: newton
      integer :: levels = 0                      !! 0: no extrapolation
      integer :: sequence = 0                    !! see dynstep_sequences
      integer, allocatable :: custom(:)          !! numbers of sequence_custom
      logical :: vary_order = .false.            !! levels chosen by the error, in runs under control
      integer :: max_levels = 9                  !! of these
   end type method_settings

contains

   !> The stepper that the settings describe
   recursive subroutine build_method(settings, stepper)
      type(method_settings), intent(in) :: settings
      class(stepper_type), allocatable, intent(out) :: stepper
      type(extrapolation_stepper), allocatable :: extrapolation

      if (settings%levels < 1) then
         call build_base(settings, stepper)
         return
      end if
      allocate (extrapolation)
      call build_base(settings, extrapolation%base)
      extrapolation%levels = settings%levels
      extrapolation%sequence = settings%sequence
      extrapolation%vary_order = settings%vary_order
      extrapolation%max_levels = settings%max_levels
      if (allocated(settings%custom)) extrapolation%custom = settings%custom
      call move_alloc(extrapolation, stepper)
   end subroutine build_method

   recursive subroutine build_base(settings, stepper)
      type(method_settings), intent(in) :: settings
      class(stepper_type), allocatable, intent(out) :: stepper
      type(newmark_stepper), allocatable :: newmark
      type(midpoint_stepper), allocatable :: midpoint
      type(generalized_alpha_stepper), allocatable :: generalized_alpha
      type(soi2_stepper), allocatable :: soi2
      type(pade_stepper), allocatable :: pade
      type(backinterpolation_stepper), allocatable :: bi

      select case (settings%base)
      case (base_midpoint)
         allocate (midpoint)
         midpoint%newton = settings%newton
         call move_alloc(midpoint, stepper)
      case (base_generalized_alpha)
         allocate (generalized_alpha)
         call set_options(settings, generalized_alpha)
         generalized_alpha%variant = variant_soi2
         call move_alloc(generalized_alpha, stepper)
      case (base_soi2)
         allocate (soi2)
         call set_options(settings, soi2)
         call move_alloc(soi2, stepper)
      case (base_pade)
         allocate (pade)
         pade%p = settings%pade_p
         pade%q = settings%pade_q
         pade%form = settings%pade_form
         call move_alloc(pade, stepper)
      case (base_backinterpolation)
         allocate (bi)
         bi%p = settings%bi%p
         bi%q = settings%bi%q
         bi%alpha = settings%bi%alpha
         bi%halves = settings%bi%halves
         bi%listing_sign = settings%listing_sign
         bi%newton = settings%newton
         call move_alloc(bi, stepper)
      case default
         allocate (newmark)
         newmark%beta = settings%beta
         newmark%gamma = settings%gamma
         newmark%newton = settings%newton
         call move_alloc(newmark, stepper)
      end select
   end subroutine build_base

   !> alpha_m, alpha_f, beta, gamma as an array
   recursive subroutine coefficients_of_radius(rho_inf, coefficients, status)
      real(wp), intent(in) :: rho_inf
      real(wp), intent(out) :: coefficients(4)
      type(status_type), intent(inout) :: status
      type(alpha_coefficients) :: found
      call coefficients_of(rho_inf, found, status)
      coefficients = [found%alpha_m, found%alpha_f, found%beta, found%gamma]
   end subroutine coefficients_of_radius

   recursive subroutine set_options(settings, stepper)
      type(method_settings), intent(in) :: settings
      class(soi2_stepper), intent(inout) :: stepper
      associate (options => settings%alpha)
         stepper%coefficients = options%coefficients
         stepper%variant = options%variant
         stepper%mass_at = options%mass_at
         stepper%adjust_acceleration = options%adjust_acceleration
         stepper%adjust_momentum = options%adjust_momentum
         stepper%second_order_start = options%second_order_start
         stepper%start_mode = options%start_mode
         stepper%estimate = options%estimate
         stepper%newton = settings%newton
      end associate
   end subroutine set_options
end module dynstep_flat_method
