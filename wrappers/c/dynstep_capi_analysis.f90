! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: stability, accuracy and damping of methods.  `dynstep.h` describes each function.
!>
!> The handle gives a place for the message, and to dynstep_spectral_radii the method; R(z) comes by its coefficients.
module dynstep_capi_analysis
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_value
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_intptr_t, c_ptr
   use dynstep_accuracy_domain, only: accuracy_limit
   use dynstep_amplification, only: spectral_radii
   use dynstep_c_handle, only: integrator_type, reach
   use dynstep_c_text, only: give
   use dynstep_flat_method, only: build_method
   use dynstep_kinds, only: wp
   use dynstep_rational, only: fehlberg_rational, most_degree, pade_rational, rational_of, rational_type, taylor_rational
   use dynstep_stability_domain, only: find_domain, stability_domain_type
   use dynstep_stability_facts, only: find_facts, stability_facts_type
   use dynstep_stability_windows, only: alpha_windows, family_fehlberg, family_taylor
   use dynstep_status, only: dynstep_invalid_input, dynstep_success, status_type
   use dynstep_stepper, only: stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_rational_coefficients, dynstep_stability_facts_of, dynstep_stability_rays, dynstep_stability_boundary
   public :: dynstep_rational_values, dynstep_spectral_radii, dynstep_accuracy_limits, dynstep_alpha_windows

   ! enum dynstep_family of dynstep.h; the first two are those of dynstep_stability_windows
   integer, parameter :: family_pade = 3
   ! DYNSTEP_STABILITY_FLAGS, DYNSTEP_STABILITY_NUMBERS of dynstep.h
   integer, parameter :: number_of_flags = 8, number_of_numbers = 6

contains

   recursive function dynstep_rational_coefficients(handle, family, p, q, alpha, num, den) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: family, p, q
      real(c_double), value :: alpha
      type(c_ptr), value :: num, den
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(rational_type) :: r
      code = reach(handle, s)
      if (code /= dynstep_success) return
      select case (family)
      case (family_taylor); call taylor_rational(int(p), int(q), alpha, r, s%status)
      case (family_fehlberg); call fehlberg_rational(alpha, r, s%status)
      case (family_pade); call pade_rational(int(p), int(q), r, s%status)
      case default; call s%status%set(dynstep_invalid_input, 'family = '//text(family)//' must be 1, 2 or 3')
      end select
      code = s%status%code
      if (code /= dynstep_success) return
      call give(r%num, num)
      call give(r%den, den)
   end function dynstep_rational_coefficients

   recursive function dynstep_stability_facts_of(handle, nnum, num, nden, den, flags, numbers, intervals, poles, zeros) &
      & result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: nnum, nden
      type(c_ptr), value :: num, den, flags, numbers, intervals, poles, zeros
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(rational_type) :: r
      type(stability_facts_type) :: facts
      integer(c_int), pointer :: i(:)
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call take_rational(nnum, num, nden, den, r, s%status)
      call find_facts(r, facts, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      if (c_associated(flags)) then
         call c_f_pointer(flags, i, [number_of_flags])
         i = [r%p, r%q, r%order, size(facts%axis%intervals, 2), merge(1, 0, facts%is_i_stable), &
            & merge(1, 0, facts%is_a_stable), merge(1, 0, facts%is_f_stable), merge(1, 0, facts%is_l_stable)]
      end if
      call give([facts%angle, infinite(facts%r_infinity), infinite(facts%axis%growth), infinite(facts%axis%growth_at), &
         & infinite(facts%real_limit), infinite(facts%positive_limit)], numbers)
      call give(infinite(reshape(facts%axis%intervals, [2*size(facts%axis%intervals, 2)])), intervals)
      call give(parts(r%poles), poles)
      call give(parts(r%zeros), zeros)
   end function dynstep_stability_facts_of

   recursive function dynstep_stability_rays(handle, nnum, num, nden, den, rays, nangles, angles, begins, first, &
      & ncrossings, crossings, counts) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: nnum, nden, rays, nangles, ncrossings
      type(c_ptr), value :: num, den, angles, begins, first, crossings, counts
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(rational_type) :: r
      type(stability_domain_type) :: domain
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call take_rational(nnum, num, nden, den, r, s%status)
      call find_domain(r, int(rays), domain, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      call give_integers([size(domain%angle), size(domain%crossing)], counts)
      if (nangles < size(domain%angle) .or. ncrossings < size(domain%crossing)) return
      call give(domain%angle, angles)
      call give_integers(domain%begins, begins)
      call give_integers(domain%first - 1, first)
      call give(domain%crossing, crossings)
   end function dynstep_stability_rays

   recursive function dynstep_stability_boundary(handle, nnum, num, nden, den, nfirst, first, npoints, points, counts) &
      & result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: nnum, nden, nfirst, npoints
      type(c_ptr), value :: num, den, first, points, counts
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(rational_type) :: r
      type(stability_domain_type) :: domain
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call take_rational(nnum, num, nden, den, r, s%status)
      call find_domain(r, 2, domain, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      call give_integers([size(domain%first_point) - 1, size(domain%point), merge(1, 0, domain%is_whole)], counts)
      if (nfirst < size(domain%first_point) .or. npoints < size(domain%point)) return
      call give_integers(domain%first_point - 1, first)
      call give(parts(domain%point), points)
   end function dynstep_stability_boundary

   recursive function dynstep_rational_values(handle, nnum, num, nden, den, nz, z, values) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: nnum, nden, nz
      type(c_ptr), value :: num, den, z, values
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(rational_type) :: r
      real(c_double), pointer :: at(:, :), to(:, :)
      complex(wp) :: x
      integer :: i
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call take_rational(nnum, num, nden, den, r, s%status)
      call check_points(nz, z, values, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      call c_f_pointer(z, at, [2, int(nz)])
      call c_f_pointer(values, to, [2, int(nz)])
      do i = 1, nz
         x = cmplx(at(1, i), at(2, i), wp)
         if (any(abs(x - r%poles) <= 0.0_wp)) then
            to(:, i) = ieee_value(1.0_wp, ieee_positive_inf)
         else
            x = r%value(x)
            to(:, i) = [real(x, wp), aimag(x)]
            if (.not. abs(at(2, i)) > 0.0_wp) to(2, i) = 0.0_wp      ! no rounding errors of conjugate poles
         end if
      end do
   end function dynstep_rational_values

   recursive function dynstep_spectral_radii(handle, nz, z, radii) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: nz
      type(c_ptr), value :: z, radii
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      class(stepper_type), allocatable :: stepper
      real(c_double), pointer :: at(:, :), to(:)
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call check_points(nz, z, radii, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      call c_f_pointer(z, at, [2, int(nz)])
      call c_f_pointer(radii, to, [nz])
      call build_method(s%method, stepper)
      call spectral_radii(stepper, cmplx(at(1, :), at(2, :), wp), to, s%status)
      to = infinite(to)
      code = s%status%code
   end function dynstep_spectral_radii

   recursive function dynstep_accuracy_limits(handle, nnum, num, nden, den, nangles, angles, x0, tolerance, t_end, limits) &
      & result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: nnum, nden, nangles
      type(c_ptr), value :: num, den, angles, x0, limits
      real(c_double), value :: tolerance, t_end
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(rational_type) :: r
      real(c_double), pointer :: theta(:), start(:), h(:)
      integer :: i
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call take_rational(nnum, num, nden, den, r, s%status)
      call check_points(nangles, angles, limits, s%status)
      if (.not. s%status%failed() .and. .not. c_associated(x0)) call s%status%set(dynstep_invalid_input, 'x0 is NULL')
      code = s%status%code
      if (code /= dynstep_success) return
      call c_f_pointer(angles, theta, [nangles])
      call c_f_pointer(x0, start, [2])
      call c_f_pointer(limits, h, [nangles])
      do i = 1, nangles
         call accuracy_limit(r, theta(i), start, tolerance, h(i), s%status, t_end)
      end do
      code = s%status%code
   end function dynstep_accuracy_limits

   recursive function dynstep_alpha_windows(handle, family, p, q, property, nwindows, windows, count) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: family, p, q, property, nwindows
      type(c_ptr), value :: windows, count
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      real(wp), allocatable :: found(:, :)
      code = reach(handle, s)
      if (code /= dynstep_success) return
      call alpha_windows(int(p), int(q), int(property), found, s%status, int(family))
      code = s%status%code
      if (code /= dynstep_success) return
      call give_integers([size(found, 2)], count)
      if (nwindows >= size(found, 2)) call give(reshape(found, [size(found)]), windows)
   end function dynstep_alpha_windows

   !> R(z) from the coefficients that a caller gives
   recursive subroutine take_rational(nnum, num, nden, den, r, status)
      integer(c_int), intent(in) :: nnum, nden
      type(c_ptr), intent(in) :: num, den
      type(rational_type), intent(out) :: r
      type(status_type), intent(inout) :: status
      real(c_double), pointer :: n(:), d(:)
      if (nnum < 1 .or. nden < 1 .or. .not. (c_associated(num) .and. c_associated(den))) then
         call status%set(dynstep_invalid_input, 'num or den is NULL, or has less than one coefficient')
         return
      end if
      call c_f_pointer(num, n, [nnum])
      call c_f_pointer(den, d, [nden])
      call rational_of(n, d, r, status)
   end subroutine take_rational

   recursive subroutine check_points(count, from, to, status)
      integer(c_int), intent(in) :: count
      type(c_ptr), intent(in) :: from, to
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (count < 0) then
         call status%set(dynstep_invalid_input, 'the number of points is negative')
      else if (.not. (c_associated(from) .and. c_associated(to))) then
         call status%set(dynstep_invalid_input, 'an array of points or results is NULL')
      end if
   end subroutine check_points

   recursive subroutine give_integers(from, to)
      integer, intent(in) :: from(:)
      type(c_ptr), intent(in) :: to
      integer(c_int), pointer :: i(:)
      if (.not. c_associated(to)) return
      call c_f_pointer(to, i, [size(from)])
      i = from
   end subroutine give_integers

   !> huge() stands for infinity in the library
   elemental real(wp) function infinite(x)
      real(wp), intent(in) :: x
      infinite = x
      if (x >= huge(x)) infinite = ieee_value(x, ieee_positive_inf)
   end function infinite

   !> Real and imaginary parts by turns, as C99 and numpy store complex numbers
   pure function parts(z) result(x)
      complex(wp), intent(in) :: z(:)
      real(wp) :: x(2*size(z))
      x(1::2) = real(z, wp)
      x(2::2) = aimag(z)
   end function parts
end module dynstep_capi_analysis
