! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: Pade's approximations and backinterpolation.  `dynstep.h` describes each function.
module dynstep_capi_rational
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_intptr_t
   use dynstep_backinterpolation, only: halves_fehlberg, halves_taylor
   use dynstep_c_handle, only: change, integrator_type, reach
   use dynstep_flat_method, only: backinterpolation_settings, base_backinterpolation, base_pade
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, dynstep_success, status_type
   use dynstep_text, only: text
   use dynstep_pole_stages, only: form_automatic, form_parallel, form_refined
   implicit none
   private

   public :: dynstep_set_pade, dynstep_set_backinterpolation, dynstep_set_listing_estimate

   integer, parameter :: most_pade_degree = 8, most_order = 5

contains

   recursive function dynstep_set_pade(handle, p, q, form) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: p, q, form
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call check_range('p', p, 0, most_pade_degree, s%status)
      call check_range('q', q, 0, most_pade_degree, s%status)
      if (p == 0 .and. q == 0) call s%status%set(dynstep_invalid_input, 'p and q must not both be 0')
      call check_range('form', form, form_automatic, form_refined, s%status)
      if (form == form_parallel .and. p > q) call s%status%set(dynstep_invalid_input, &
         & 'form = 1, a sum of partial fractions, wants p <= q')
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%base = base_pade
      s%method%pade_p = p
      s%method%pade_q = q
      s%method%pade_form = form
      call change(s)
   end function dynstep_set_pade

   recursive function dynstep_set_backinterpolation(handle, p, q, alpha, halves) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: p, q
      real(c_double), value :: alpha
      integer(c_int), value :: halves
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (.not. is_share(alpha)) then
         call s%status%set(dynstep_invalid_input, 'alpha = '//text(alpha)//' must lie between 0 and 1')
      else if (halves == halves_taylor) then
         if (alpha > 0.0_wp) call check_range('p', p, 1, most_order, s%status)
         if (alpha < 1.0_wp) call check_range('q', q, 1, most_order, s%status)
      else if (halves /= halves_fehlberg) then
         call s%status%set(dynstep_invalid_input, 'halves = '//text(halves)//' must be 1 (Taylor) or 2 (Fehlberg)')
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%base = base_backinterpolation
      s%method%bi = backinterpolation_settings(p=int(p), q=int(q), alpha=alpha, halves=int(halves))
      call change(s)
   end function dynstep_set_backinterpolation

   recursive function dynstep_set_listing_estimate(handle, listing) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: listing
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call check_range('listing', listing, 0, 1, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      s%method%listing_sign = listing == 1
      call change(s)
   end function dynstep_set_listing_estimate

   !> Between 0 and 1; no comparison with a NaN, which may trap
   pure logical function is_share(x)
      real(wp), intent(in) :: x
      is_share = ieee_is_finite(x)
      if (is_share) is_share = x >= 0.0_wp .and. x <= 1.0_wp
   end function is_share

   recursive subroutine check_range(name, number, least, most, status)
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: number
      integer, intent(in) :: least, most
      type(status_type), intent(inout) :: status
      if (status%failed() .or. (number >= least .and. number <= most)) return
      call status%set(dynstep_invalid_input, name//' = '//text(number)//' must lie between '//text(least)//' and ' &
         & //text(most))
   end subroutine check_range
end module dynstep_capi_rational
