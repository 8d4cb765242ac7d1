! SPDX-License-Identifier: BSD-3-Clause
!> The generalized-alpha method for systems without constraints, with constant or nonconstant mass
!> (J. Chung, G. M. Hulbert 1993; Jay & Negrut 2008, eq. (2) and section 3):
!>
!>   y1 = y0 + h z0 + h^2/2 [(1 - 2 beta) a_alpha + 2 beta a_{1+alpha}]                              (2a)
!>   z1 = z0 + h [(1 - gamma) a_alpha + gamma a_{1+alpha}]                                           (2b)
!>   (1 - alpha_m) M_{1+alpha} a_{1+alpha} + alpha_m M_alpha a_alpha = (1 - alpha_f) f1 + alpha_f f0  (2c)
!>
!>     type(generalized_alpha_stepper) :: stepper            ! rho_inf = 0.8
!>     call hht_coefficients(-0.1_wp, stepper%coefficients, status)
!>
!> It is SOI2 with nothing to hold: the same steps, the same options.  Named members: rho_inf by
!> COEFFICIENTS_OF, HHT-alpha, Newmark's family with the trapezoid and Stoermer's rule by NEWMARK_COEFFICIENTS.
module dynstep_generalized_alpha
   use dynstep_ode_system, only: ode_system
   use dynstep_soi2, only: soi2_stepper
   use dynstep_start_check, only: check_mechanical
   use dynstep_status, only: status_type
   use dynstep_stepper, only: method_properties
   implicit none
   private

   type, extends(soi2_stepper), public :: generalized_alpha_stepper
   contains
      procedure :: properties => alpha_properties
      procedure :: init => alpha_init
   end type generalized_alpha_stepper

contains

   recursive function alpha_properties(self) result(facts)
      class(generalized_alpha_stepper), intent(in) :: self
      type(method_properties) :: facts
      facts = self%soi2_stepper%properties()
      facts%name = 'generalized-alpha'
      facts%source = 'Jay & Negrut 2008, eq. (2), section 3'
      facts%multiplier_order = 0
   end function alpha_properties

   recursive subroutine alpha_init(self, sys, status)
      class(generalized_alpha_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      call self%note_init()
      call check_mechanical('generalized-alpha', sys, status)
      call self%soi2_stepper%init(sys, status)
   end subroutine alpha_init
end module dynstep_generalized_alpha
