! SPDX-License-Identifier: BSD-3-Clause
!> The stability limit of an extrapolation as it is set, or the sentence that says why there is none to tell.
module dynstep_extrapolation_limit
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_kinds, only: wp
   use dynstep_sequences, only: substep_numbers
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_stepper, only: method_properties
   implicit none
   private

   public :: extrapolation_limit

contains

   !> `stability_limit` of dynstep_extrapolation_stability for a stepper
   recursive subroutine extrapolation_limit(stepper, damping_ratio, limit, status)
      type(extrapolation_stepper), intent(in) :: stepper      !! base Newmark (gamma = 1/2) or midpoint
      real(wp), intent(in) :: damping_ratio                   !! xi >= 0
      real(wp), intent(out) :: limit                          !! omega h; huge() where there is none
      type(status_type), intent(inout) :: status
      type(method_properties) :: facts
      integer, allocatable :: numbers(:)

      limit = 0.0_wp
      if (status%failed()) return
      if (allocated(stepper%base)) facts = stepper%base%properties()
      if (.not. (facts%newmark_beta >= 0.0_wp .and. damping_ratio >= 0.0_wp)) then
         call status%set(dynstep_invalid_input, 'the stability limit is known for extrapolations of Newmark with ' &
            & //'beta >= 0 and gamma = 1/2, or midpoint, and damping ratios >= 0')
         return
      end if
      call substep_numbers(stepper%sequence, stepper%levels, stepper%custom, numbers, status)
      if (.not. status%failed()) limit = stepper%stable_limit(damping_ratio, 1.0e-12_wp)
   end subroutine extrapolation_limit
end module dynstep_extrapolation_limit
