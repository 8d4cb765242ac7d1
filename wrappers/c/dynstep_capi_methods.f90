! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: the method of a handle.  `dynstep.h` describes each function.
module dynstep_capi_methods
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_positive_inf, ieee_value
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_intptr_t, c_ptr
   use dynstep_c_handle, only: change, integrator_type, reach
   use dynstep_c_text, only: put_text
   use dynstep_equilibrium, only: newton_options
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_extrapolation_limit, only: extrapolation_limit
   use dynstep_flat_method, only: base_midpoint, base_newmark, build_method
   use dynstep_kinds, only: wp
   use dynstep_sequences, only: most_levels, sequence_custom, substep_numbers
   use dynstep_status, only: dynstep_invalid_input, dynstep_success
   use dynstep_stepper, only: method_properties, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_set_newmark, dynstep_set_midpoint, dynstep_set_extrapolation, dynstep_set_order_control
   public :: dynstep_set_newton
   public :: dynstep_properties, dynstep_stability_limit, dynstep_tableau

   !> DYNSTEP_FACTS of dynstep.h
   integer, parameter :: number_of_facts = 7

contains

   recursive function dynstep_set_newmark(handle, beta, gamma) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      real(c_double), value :: beta, gamma
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (.not. is_not_negative(beta)) then
         call s%status%set(dynstep_invalid_input, 'beta = '//text(beta)//' must be 0 or more')
      else if (.not. is_not_negative(gamma)) then
         call s%status%set(dynstep_invalid_input, 'gamma = '//text(gamma)//' must be 0 or more')
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%base = base_newmark
      s%method%beta = beta
      s%method%gamma = gamma
      call change(s)
   end function dynstep_set_newmark

   !> Finite and >= 0; no comparison with a NaN, which may trap
   pure logical function is_not_negative(x)
      real(wp), intent(in) :: x
      is_not_negative = ieee_is_finite(x)
      if (is_not_negative) is_not_negative = x >= 0.0_wp
   end function is_not_negative

   recursive function dynstep_set_midpoint(handle) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      s%method%base = base_midpoint
      call change(s)
   end function dynstep_set_midpoint

   recursive function dynstep_set_extrapolation(handle, levels, sequence, ncustom, custom) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: levels, sequence, ncustom
      type(c_ptr), value :: custom
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      integer(c_int), pointer :: given(:)
      integer, allocatable :: own(:), numbers(:)

      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (levels > 0 .and. sequence == sequence_custom) then
         if (.not. c_associated(custom)) then
            call s%status%set(dynstep_invalid_input, 'custom is NULL')
         else if (ncustom < levels) then
            call s%status%set(dynstep_invalid_input, 'ncustom = '//text(ncustom)//' numbers are not enough for levels = ' &
               & //text(levels))
         else if (levels <= most_levels) then
            ! no more than may be used are read
            call c_f_pointer(custom, given, [min(ncustom, most_levels)])
            own = given
         end if
      end if
      if (levels /= 0) call substep_numbers(int(sequence), int(levels), own, numbers, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%levels = levels
      s%method%sequence = sequence
      call move_alloc(own, s%method%custom)
      call change(s)
   end function dynstep_set_extrapolation

   recursive function dynstep_set_order_control(handle, vary, max_levels) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: vary, max_levels
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (vary /= 0 .and. (max_levels < 2 .or. max_levels > most_levels)) call s%status%set(dynstep_invalid_input, &
         & 'max_levels = '//text(max_levels)//' must be 2 to '//text(most_levels))
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%vary_order = vary /= 0
      if (vary /= 0) s%method%max_levels = max_levels
      call change(s)
   end function dynstep_set_order_control

   recursive function dynstep_set_newton(handle, limit, halvings, tolerance) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: limit, halvings
      real(c_double), value :: tolerance
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (limit < 1) then
         call s%status%set(dynstep_invalid_input, 'limit = '//text(limit)//' must be 1 or more')
      else if (halvings < 0) then
         call s%status%set(dynstep_invalid_input, 'halvings = '//text(halvings)//' must be 0 or more')
      else if (.not. is_not_negative(tolerance)) then
         call s%status%set(dynstep_invalid_input, 'tolerance = '//text(tolerance)//' must be 0 or more')
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%newton = newton_options(limit=limit, halvings=halvings, tolerance=tolerance)
      call change(s)
   end function dynstep_set_newton

   recursive function dynstep_properties(handle, length, name, source, integers, stability_limit) &
      & result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: length
      type(c_ptr), value :: name, source, integers, stability_limit
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      class(stepper_type), allocatable :: stepper
      type(method_properties) :: facts
      integer(c_int), pointer :: i(:)
      real(c_double), pointer :: limit

      code = reach(handle, s)
      if (code /= dynstep_success) return
      call build_method(s%method, stepper)
      facts = stepper%properties()
      call put_text(trim(facts%name), length, name)
      call put_text(trim(facts%source), length, source)
      if (c_associated(integers)) then
         call c_f_pointer(integers, i, [number_of_facts])
         i = [facts%order, facts%acceleration_order, facts%multiplier_order, facts%error_order, facts%stages, &
            & merge(1, 0, facts%symmetric), merge(1, 0, facts%mechanical)]
      end if
      if (c_associated(stability_limit)) then
         call c_f_pointer(stability_limit, limit)
         limit = facts%stability_limit
         if (facts%stability_limit >= huge(limit)) limit = ieee_value(limit, ieee_positive_inf)
      end if
   end function dynstep_properties

   recursive function dynstep_stability_limit(handle, damping_ratio, limit) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      real(c_double), value :: damping_ratio
      type(c_ptr), value :: limit
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      class(stepper_type), allocatable :: stepper
      type(extrapolation_stepper) :: extrapolated
      real(c_double), pointer :: found

      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (.not. c_associated(limit)) call s%status%set(dynstep_invalid_input, 'limit is NULL')
      call build_method(s%method, stepper)
      select type (stepper)
      class is (extrapolation_stepper)
         extrapolated = stepper
      class default
         extrapolated%levels = 1
         call move_alloc(stepper, extrapolated%base)
      end select
      if (.not. s%status%failed()) then
         call c_f_pointer(limit, found)
         call extrapolation_limit(extrapolated, damping_ratio, found, s%status)
         if (found >= huge(found)) found = ieee_value(found, ieee_positive_inf)
      end if
      code = s%status%code
   end function dynstep_stability_limit

   recursive function dynstep_tableau(handle, size, levels, table, numbers) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: size, levels
      type(c_ptr), value :: table, numbers
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      real(c_double), pointer :: to_table(:, :, :)
      integer(c_int), pointer :: to_numbers(:)
      real(wp), allocatable :: t(:, :, :)
      integer, allocatable :: k(:)
      integer :: rows

      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (.not. s%started .or. s%method%levels < 1) then
         call s%status%set(dynstep_invalid_input, 'there is no table: set an extrapolation, start, and make a step')
      else if (s%stepper%count%steps <= s%restored_steps) then
         call s%status%set(dynstep_invalid_input, 'there is no table before the first step')
      else if (size /= s%sys%state_size()) then
         call s%status%set(dynstep_invalid_input, 'size = '//text(size)//' must be '//text(s%sys%state_size()) &
            & //', the length of the state')
      else if (levels /= s%method%levels .and. .not. s%method%vary_order .or. levels < 1) then
         call s%status%set(dynstep_invalid_input, 'levels = '//text(levels)//', but the extrapolation has ' &
            & //text(s%method%levels))
      else if (.not. (c_associated(table) .and. c_associated(numbers))) then
         call s%status%set(dynstep_invalid_input, 'table or numbers is NULL')
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      call c_f_pointer(table, to_table, [size, levels, levels])
      call c_f_pointer(numbers, to_numbers, [levels])
      select type (stepper => s%stepper)
      class is (extrapolation_stepper)
         call stepper%get_tableau(t, k)
         rows = ubound(k, 1)
         if (rows > levels) then
            call s%status%set(dynstep_invalid_input, 'levels = '//text(levels)//', but the last step has '//text(rows))
         else
            to_table = 0.0_wp
            to_table(:, :rows, :rows) = t
            to_numbers = 0
            to_numbers(:rows) = k
         end if
      end select
      code = s%status%code
   end function dynstep_tableau
end module dynstep_capi_methods
