! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: coefficients of generalized-alpha from its spectral radius.  `dynstep.h` describes the function.
!>
!> The C name is also that of a module of the library.  Where a file defines the one and calls procedures of the other,
!> gfortran takes the C function for these procedures; hence this file, which uses no procedure of that module.
module dynstep_capi_coefficients
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_ptr
   use dynstep_flat_method, only: coefficients_of_radius
   use dynstep_status, only: dynstep_invalid_input, dynstep_success, status_type
   implicit none
   private

   public :: alpha_coefficients_of_radius

contains

   recursive function alpha_coefficients_of_radius(rho_inf, coefficients) result(code) &
      & bind(c, name='dynstep_alpha_coefficients')
      real(c_double), value :: rho_inf
      type(c_ptr), value :: coefficients
      integer(c_int) :: code
      real(c_double), pointer :: to(:)
      real(c_double) :: found(4)
      type(status_type) :: status
      if (.not. c_associated(coefficients)) call status%set(dynstep_invalid_input, 'coefficients is NULL')
      call coefficients_of_radius(rho_inf, found, status)
      code = status%code
      if (code /= dynstep_success) return
      call c_f_pointer(coefficients, to, [4])
      to = found
   end function alpha_coefficients_of_radius
end module dynstep_capi_coefficients
