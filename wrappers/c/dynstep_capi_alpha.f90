! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: generalized-alpha and SOI2, and their start.  `dynstep.h` describes each function.
module dynstep_capi_alpha
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_intptr_t, c_ptr
   use dynstep_alpha_coefficients, only: alpha_coefficients
   use dynstep_c_handle, only: change, check_started, integrator_type, reach
   use dynstep_c_text, only: put_text
   use dynstep_flat_method, only: base_generalized_alpha, base_soi2
   use dynstep_soi2, only: estimate_larger, estimate_raw, mass_recomputed, mass_stored, soi2_stepper, start_keep, &
      & start_project, start_report, variant_index3, variant_soi2
   use dynstep_status, only: dynstep_invalid_input, dynstep_success
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_set_generalized_alpha, dynstep_set_soi2, dynstep_set_alpha_options
   public :: dynstep_set_estimate, dynstep_set_start, dynstep_start_report, dynstep_redundant_constraints

contains

   recursive function dynstep_set_generalized_alpha(handle, alpha_m, alpha_f, beta, gamma) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      real(c_double), value :: alpha_m, alpha_f, beta, gamma
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(alpha_coefficients) :: coefficients
      code = reach(handle, s)
      if (code /= dynstep_success) return
      coefficients = alpha_coefficients(alpha_m, alpha_f, beta, gamma)
      call coefficients%check(s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%base = base_generalized_alpha
      s%method%alpha%coefficients = coefficients
      call change(s)
   end function dynstep_set_generalized_alpha

   recursive function dynstep_set_soi2(handle, alpha_m, alpha_f, beta, gamma, variant) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      real(c_double), value :: alpha_m, alpha_f, beta, gamma
      integer(c_int), value :: variant
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(alpha_coefficients) :: coefficients
      code = reach(handle, s)
      if (code /= dynstep_success) return
      coefficients = alpha_coefficients(alpha_m, alpha_f, beta, gamma)
      call coefficients%check(s%status)
      if (.not. s%status%failed() .and. (variant < variant_soi2 .or. variant > variant_index3)) &
         & call s%status%set(dynstep_invalid_input, 'variant = '//text(variant)//' must be 1 (SOI2), 2 (reduced) or 3 ' &
         & //'(index 3)')
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%base = base_soi2
      s%method%alpha%coefficients = coefficients
      s%method%alpha%variant = variant
      call change(s)
   end function dynstep_set_soi2

   recursive function dynstep_set_alpha_options(handle, mass_at, adjust_acceleration, adjust_momentum, &
      & second_order_start) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: mass_at, adjust_acceleration, adjust_momentum, second_order_start
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (mass_at < mass_stored .or. mass_at > mass_recomputed) call s%status%set(dynstep_invalid_input, &
         & 'mass_at = '//text(mass_at)//' must be 1 (stored) or 2 (recomputed)')
      code = s%status%code
      if (code /= dynstep_success) return
      associate (options => s%method%alpha)
         options%mass_at = mass_at
         options%adjust_acceleration = adjust_acceleration /= 0
         options%adjust_momentum = adjust_momentum /= 0
         options%second_order_start = second_order_start /= 0
      end associate
      call change(s)
   end function dynstep_set_alpha_options

   recursive function dynstep_set_estimate(handle, estimate) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: estimate
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (estimate < estimate_larger .or. estimate > estimate_raw) call s%status%set(dynstep_invalid_input, 'estimate = ' &
         & //text(estimate)//' must be 1 (larger), 2 (projected) or 3 (raw)')
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%alpha%estimate = estimate
      call change(s)
   end function dynstep_set_estimate

   recursive function dynstep_set_start(handle, mode) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: mode
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (mode < start_project .or. mode > start_keep) call s%status%set(dynstep_invalid_input, 'mode = '//text(mode) &
         & //' must be 1 (project), 2 (refuse) or 3 (keep)')
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%alpha%start_mode = mode
      call change(s)
   end function dynstep_set_start

   recursive function dynstep_start_report(handle, report) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      type(c_ptr), value :: report
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(start_report) :: found
      real(c_double), pointer :: to(:)
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (.not. c_associated(report)) call s%status%set(dynstep_invalid_input, 'report is NULL')
      call take_report(s, found)
      code = s%status%code
      if (code /= dynstep_success) return
      call c_f_pointer(report, to, [5])
      to = [found%g, found%gv, found%k, found%moved_q, found%moved_v]
   end function dynstep_start_report

   recursive function dynstep_redundant_constraints(handle, length, buffer) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: length
      type(c_ptr), value :: buffer
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(start_report) :: found
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call take_report(s, found)
      call put_text(trim(found%redundant), length, buffer)
      code = s%status%code
   end function dynstep_redundant_constraints

   !> Report of the last start, also of one that failed
   recursive subroutine take_report(s, found)
      type(integrator_type), intent(inout) :: s
      type(start_report), intent(out) :: found
      if (s%status%failed()) return
      if (.not. s%assembled) then
         call check_started(s)
         return
      end if
      select type (stepper => s%stepper)
      class is (soi2_stepper)
         found = stepper%report
      class default
         call s%status%set(dynstep_invalid_input, 'there is no report: it belongs to the start of generalized-alpha and SOI2')
      end select
   end subroutine take_report
end module dynstep_capi_alpha
