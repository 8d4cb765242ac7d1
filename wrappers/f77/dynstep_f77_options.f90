! SPDX-License-Identifier: BSD-3-Clause
!> The options of the FORTRAN 77 drivers: systems, methods and output from IOPT and ROPT.
module dynstep_f77_options
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_equilibrium, only: newton_options
   use dynstep_f77_systems, only: f77_force, f77_linear_system, f77_load, f77_mass, f77_system, f77_tangent
   use dynstep_pole_stages, only: form_automatic, form_refined
   use dynstep_flat_method, only: base_midpoint, base_pade, build_method, method_settings
   use dynstep_integrate, only: control_type
   use dynstep_kinds, only: long, wp
   use dynstep_linear_system, only: load_procedure
   use dynstep_matrix, only: banded_matrix, dense_matrix, diagonal_matrix, identity_matrix, kind_banded, &
      & kind_dense, kind_diagonal, kind_identity, kind_zero, matrix_type, zero_matrix
   use dynstep_sequences, only: most_levels, most_substeps, sequence_automatic, sequence_custom, sequence_harmonic
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_stepper, only: stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: describe_external, describe_linear, describe_levels, check_levels, describe_pade
   public :: describe_method, describe_newton, describe_output, check_span, check_not_negative
   public :: check_size, check_structure

   ! Places in IOPT, see the prologue of DSNEWM
   integer, parameter :: at_every = 1, at_times = 2, at_limit = 3, at_halvings = 4, at_base = 5, at_levels = 6, &
      & at_sequence = 7, at_coefficients = 8, at_mass = 11, at_tangent = 16, at_given = 20, at_constant = 21, &
      & at_linear = 22, at_no_velocities = 23, at_custom = 31
   ! The same of the drivers for matrices, see DSNEWL
   integer, parameter :: at_damping = 15, at_stiffness = 19, at_load = 23
   ! The same of DSPADE
   integer, parameter :: at_numerator = 6, at_denominator = 7, at_form = 8
   ! Places in ROPT
   integer, parameter :: at_beta = 1, at_gamma = 2, at_tolerance = 3, at_first_time = 11

   !> A state has 2 N numbers, which an INTEGER counts
   integer, parameter :: most_coordinates = shiftr(huge(0), 1)
   !> Of DSPADE
   integer, parameter :: most_pade_degree = 8
   !> Levels of DSNEXT and DSNEXL where none are told
   integer, parameter :: default_levels = 4

contains

   !> A system from EXTERNAL subroutines and the options that describe their structure
   recursive subroutine describe_external(n, force, mass, tang, iopt, rpar, ipar, sys, status)
      integer, intent(in) :: n
      procedure(f77_force) :: force
      procedure(f77_mass) :: mass
      procedure(f77_tangent) :: tang
      integer, intent(in) :: iopt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      class(f77_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status

      call check_size(n, status)
      call check_structure('the mass', at_mass, n, iopt, iopt(at_mass + 3) == 0, status)
      call check_structure('the tangents', at_tangent, n, iopt, iopt(at_tangent + 3) /= 0, status)
      if (status%failed()) return
      sys%n = n
      sys%force_external => force
      sys%mass_external => mass
      if (iopt(at_given) /= 0) sys%tangent_external => tang
      sys%rpar => rpar(1:1)
      sys%ipar => ipar(1:1)
      associate (s => sys%structure)
         s%mass = iopt(at_mass)
         s%mass_kl = iopt(at_mass + 1)
         s%mass_ku = iopt(at_mass + 2)
         s%mass_is_symmetric = iopt(at_mass + 3) == 0
         s%mass_is_constant = iopt(at_mass) == kind_identity .or. iopt(at_mass + 4) /= 0
         s%tangent = iopt(at_tangent)
         if (s%tangent == 0) s%tangent = kind_dense
         s%kl = iopt(at_tangent + 1)
         s%ku = iopt(at_tangent + 2)
         s%tangent_is_symmetric = iopt(at_tangent + 3) /= 0
         s%tangent_is_constant = iopt(at_constant) /= 0
         ! difference tangents are good to 1e-8, too little for a single correction
         s%force_is_linear = iopt(at_linear) /= 0 .and. iopt(at_given) /= 0
         s%velocity_free = iopt(at_no_velocities) /= 0
      end associate
   end subroutine describe_external

   !> A linear system from matrices and the options that describe their structure
   recursive subroutine describe_linear(n, am, ac, ak, load, iopt, rpar, ipar, sys, status)
      integer, intent(in) :: n
      real(wp), intent(in) :: am(*), ac(*), ak(*)
      procedure(f77_load) :: load
      integer, intent(in) :: iopt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      type(f77_linear_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      type(matrix_type) :: m, c, k

      call check_size(n, status)
      call take_matrix('M', at_mass, kind_identity, n, iopt, am, m, status)
      call take_matrix('C', at_damping, kind_zero, n, iopt, ac, c, status)
      call take_matrix('K', at_stiffness, kind_zero, n, iopt, ak, k, status)
      call sys%set(m, c, k, status)
      sys%rpar => rpar(1:1)
      sys%ipar => ipar(1:1)
      sys%load_external => load
      if (.not. status%failed() .and. iopt(at_load) /= 0) sys%load_kind = load_procedure
   end subroutine describe_linear

   recursive subroutine check_size(n, status)
      integer, intent(in) :: n
      type(status_type), intent(inout) :: status
      if (n < 1 .or. n > most_coordinates) call status%set(dynstep_invalid_input, 'N = '//text(n) &
         & //' must lie between 1 and '//text(most_coordinates))
   end subroutine check_size

   !> IOPT(at), IOPT(at + 1) and IOPT(at + 2) are a kind of matrix and its bandwidths
   recursive subroutine check_structure(name, at, n, iopt, symmetric, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: at, n
      integer, intent(in) :: iopt(*)
      logical, intent(in) :: symmetric            !! what IOPT(at + 3) says
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      associate (kl => iopt(at + 1), ku => iopt(at + 2))
         if (iopt(at) < 0 .or. iopt(at) > kind_dense) then
            call status%set(dynstep_invalid_input, 'IOPT('//text(at)//') = '//text(iopt(at))//', the kind of ' &
               & //name//', must be 0, 1, 2 or 3')
         else if (iopt(at) == kind_banded .and. (kl < 0 .or. ku < 0 .or. kl >= n .or. ku >= n)) then
            call status%set(dynstep_invalid_input, 'IOPT('//text(at + 1)//') = '//text(kl)//' and IOPT(' &
               & //text(at + 2)//') = '//text(ku)//', the bandwidths of '//name//', must lie between 0 and N - 1 = ' &
               & //text(n - 1))
         else if (iopt(at) == kind_banded .and. symmetric .and. kl /= ku) then
            call status%set(dynstep_invalid_input, 'IOPT('//text(at + 1)//') = '//text(kl)//' and IOPT(' &
               & //text(at + 2)//') = '//text(ku)//', the bandwidths of '//name//', must be equal where IOPT(' &
               & //text(at + 3)//') = '//text(iopt(at + 3))//' says that it is symmetric')
         end if
      end associate
   end subroutine check_structure

   !> The matrix that IOPT(at...) describes
   recursive subroutine take_matrix(name, at, kind_of_none, n, iopt, entries, matrix, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: at
      integer, intent(in) :: kind_of_none         !! what kind 0 stands for
      integer, intent(in) :: n
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: entries(*)          !! [rows, n]
      type(matrix_type), intent(out) :: matrix
      type(status_type), intent(inout) :: status
      integer(long) :: rows

      call check_structure(name, at, n, iopt, iopt(at + 3) == 0, status)
      if (status%failed()) return
      associate (kl => iopt(at + 1), ku => iopt(at + 2), symmetric => iopt(at + 3) == 0)
         select case (iopt(at))
         case (kind_diagonal)
            matrix = diagonal_matrix(entries(:n))
         case (kind_banded)
            rows = kl + ku + 1
            matrix = banded_matrix(reshape(entries(:rows*n), [rows, int(n, long)]), kl, ku, symmetric)
         case (kind_dense)
            rows = n
            matrix = dense_matrix(reshape(entries(:rows*n), [n, n]), symmetric)
         case default
            matrix = zero_matrix(n)
            if (kind_of_none == kind_identity) matrix = identity_matrix(n)
         end select
      end associate
   end subroutine take_matrix

   !> Levels of DSNEXT and DSNEXL
   recursive subroutine describe_levels(iopt, levels, status)
      integer, intent(in) :: iopt(*)
      integer, intent(out) :: levels
      type(status_type), intent(inout) :: status
      levels = iopt(at_levels)
      if (levels == 0) levels = default_levels
      call check_levels('IOPT('//text(at_levels)//')', levels, status)
   end subroutine describe_levels

   recursive subroutine check_levels(name, levels, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: levels
      type(status_type), intent(inout) :: status
      if (status%failed() .or. (levels >= 1 .and. levels <= most_levels)) return
      call status%set(dynstep_invalid_input, name//' = '//text(levels)//', the levels, must be 1 to ' &
         & //text(most_levels))
   end subroutine check_levels

   !> The method that the options tell
   recursive subroutine describe_method(levels, iopt, ropt, stepper, status, most_levels_by_error)
      integer, intent(in) :: levels               !! 0: no extrapolation
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      class(stepper_type), allocatable, intent(out) :: stepper
      type(status_type), intent(inout) :: status
      integer, intent(in), optional :: most_levels_by_error   !! 0: levels are not chosen by the error
      type(method_settings) :: method

      if (status%failed()) return
      if (present(most_levels_by_error)) then
         method%vary_order = most_levels_by_error > 0
         method%max_levels = most_levels_by_error
      end if
      if (iopt(at_base) < 0 .or. iopt(at_base) > base_midpoint) then
         call status%set(dynstep_invalid_input, 'IOPT('//text(at_base)//') = '//text(iopt(at_base))//', the method, ' &
            & //'must be 0 (Newmark) or 1 (midpoint)')
         return
      end if
      method%base = iopt(at_base)
      if (iopt(at_coefficients) /= 0) then
         call check_not_negative(at_beta, 'BETA', ropt, status)
         call check_not_negative(at_gamma, 'GAMMA', ropt, status)
         method%beta = ropt(at_beta)
         method%gamma = ropt(at_gamma)
      end if
      call describe_newton(iopt, ropt, method%newton, status)
      method%levels = levels
      if (levels > 0) call describe_sequence(levels, iopt, method, status)
      if (.not. status%failed()) call build_method(method, stepper)
   end subroutine describe_method

   !> Pade's approximation of the degrees that the options tell
   recursive subroutine describe_pade(iopt, stepper, status)
      integer, intent(in) :: iopt(*)
      class(stepper_type), allocatable, intent(out) :: stepper
      type(status_type), intent(inout) :: status
      type(method_settings) :: method
      integer :: at

      do at = at_numerator, at_denominator
         if (status%failed()) return
         if (iopt(at) < -1 .or. iopt(at) > most_pade_degree) call status%set(dynstep_invalid_input, 'IOPT('//text(at) &
            & //') = '//text(iopt(at))//', a degree, must be -1 to '//text(most_pade_degree))
      end do
      method%base = base_pade
      if (iopt(at_numerator) /= 0) method%pade_p = max(0, iopt(at_numerator))
      if (iopt(at_denominator) /= 0) method%pade_q = max(0, iopt(at_denominator))
      method%pade_form = iopt(at_form)
      if (.not. status%failed() .and. (iopt(at_form) < form_automatic .or. iopt(at_form) > form_refined)) &
         & call status%set(dynstep_invalid_input, 'IOPT('//text(at_form)//') = '//text(iopt(at_form)) &
         & //', the form of a step, must be 0 to '//text(form_refined))
      if (.not. status%failed()) call build_method(method, stepper)
   end subroutine describe_pade

   recursive subroutine describe_newton(iopt, ropt, newton, status)
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      type(newton_options), intent(inout) :: newton
      type(status_type), intent(inout) :: status
      if (iopt(at_limit) < 0) call status%set(dynstep_invalid_input, 'IOPT('//text(at_limit)//') = ' &
         & //text(iopt(at_limit))//', most Newton corrections in a step, must not be negative')
      if (iopt(at_limit) > 0) newton%limit = iopt(at_limit)
      if (iopt(at_halvings) /= 0) newton%halvings = max(0, iopt(at_halvings))
      call check_not_negative(at_tolerance, 'the tolerance of Newton''s iteration', ropt, status)
      newton%tolerance = ropt(at_tolerance)
   end subroutine describe_newton

   !> ROPT(at) is finite and >= 0; no comparison with a NaN, which may trap
   recursive subroutine check_not_negative(at, name, ropt, status)
      integer, intent(in) :: at
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: ropt(*)
      type(status_type), intent(inout) :: status
      logical :: good
      if (status%failed()) return
      good = ieee_is_finite(ropt(at))
      if (good) good = ropt(at) >= 0.0_wp
      if (.not. good) call status%set(dynstep_invalid_input, 'ROPT('//text(at)//') = '//text(ropt(at))//', ' &
         & //name//', must be 0 or more')
   end subroutine check_not_negative

   !> Numbers of steps of the base in the rows of an extrapolation
   recursive subroutine describe_sequence(levels, iopt, method, status)
      integer, intent(in) :: levels               !! 1 to most_levels
      integer, intent(in) :: iopt(*)
      type(method_settings), intent(inout) :: method
      type(status_type), intent(inout) :: status
      integer :: j, last, least

      if (status%failed()) return
      method%sequence = iopt(at_sequence)
      if (method%sequence == 0) method%sequence = sequence_harmonic
      last = merge(sequence_automatic, sequence_custom, method%vary_order)
      if (method%sequence < 1 .or. method%sequence > last) then
         call status%set(dynstep_invalid_input, 'IOPT('//text(at_sequence)//') = '//text(method%sequence) &
            & //', the sequence, must be 0 to '//text(last))
      else if (method%sequence == sequence_custom) then
         method%custom = iopt(at_custom:at_custom + levels - 1)
         least = 1
         do j = 1, levels
            if (method%custom(j) < least .or. method%custom(j) > most_substeps) then
               call status%set(dynstep_invalid_input, 'IOPT('//text(at_custom + j - 1)//') = ' &
                  & //text(method%custom(j))//', number '//text(j)//' of the sequence, must lie between ' &
                  & //text(least)//' and '//text(most_substeps))
               return
            end if
            least = method%custom(j) + 1
         end do
      end if
   end subroutine describe_sequence

   !> Where OUT is called; `wanted` is false where it is not
   recursive subroutine describe_output(t, tend, h, iopt, ropt, control, wanted, status)
      real(wp), intent(in) :: t, tend, h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      type(control_type), intent(inout) :: control
      logical, intent(out) :: wanted
      type(status_type), intent(inout) :: status
      wanted = iopt(at_every) > 0 .or. iopt(at_times) > 0
      if (status%failed()) return
      control%h = h
      control%every = max(0, iopt(at_every))
      if (iopt(at_times) < 0 .or. iopt(at_every) < 0) then
         call status%set(dynstep_invalid_input, 'IOPT(1) = '//text(iopt(at_every))//' and IOPT(2) = ' &
            & //text(iopt(at_times))//' must not be negative')
      else if (iopt(at_times) > 0) then
         control%t_eval = ropt(at_first_time:at_first_time + iopt(at_times) - 1)
      end if
      call check_span(t, tend, h, status)
      if (iopt(at_times) > 0) call check_times(t, tend, control%t_eval, status)
   end subroutine describe_output

   !> T, TEND and H are finite, and H leads from T to TEND
   recursive subroutine check_span(t, tend, h, status)
      real(wp), intent(in) :: t, tend, h
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (.not. ieee_is_finite(t)) then
         call status%set(dynstep_invalid_input, 'T = '//text(t)//' must be finite')
      else if (.not. ieee_is_finite(tend)) then
         call status%set(dynstep_invalid_input, 'TEND = '//text(tend)//' must be finite')
      else if (.not. ieee_is_finite(h)) then
         call status%set(dynstep_invalid_input, 'H = '//text(h)//' must be finite')
      else if (abs(h) <= 0.0_wp) then
         call status%set(dynstep_invalid_input, 'H must not be zero')
      else if ((tend > t .and. h < 0.0_wp) .or. (tend < t .and. h > 0.0_wp)) then
         call status%set(dynstep_invalid_input, 'H = '//text(h)//' points away from TEND = '//text(tend)//' at T = ' &
            & //text(t)//'; change its sign')
      end if
   end subroutine check_span

   !> The times for OUT lie between T and TEND, in the order of the run
   recursive subroutine check_times(t, tend, times, status)
      real(wp), intent(in) :: t, tend, times(:)
      type(status_type), intent(inout) :: status
      real(wp) :: before
      integer :: i
      before = t
      do i = 1, size(times)
         if (status%failed()) return
         associate (name => 'ROPT('//text(at_first_time + i - 1)//') = '//text(times(i)))
            if (.not. ieee_is_finite(times(i))) then
               call status%set(dynstep_invalid_input, name//' must be finite')
            else if (max(t, tend) < times(i) .or. min(t, tend) > times(i)) then
               call status%set(dynstep_invalid_input, name//' lies outside the interval from T = '//text(t) &
                  & //' to TEND = '//text(tend))
            else if ((times(i) < before .and. tend > t) .or. (times(i) > before .and. tend < t)) then
               call status%set(dynstep_invalid_input, name//' is out of order; sort the times in the direction of the run')
            end if
            before = times(i)
         end associate
      end do
   end subroutine check_times
end module dynstep_f77_options
