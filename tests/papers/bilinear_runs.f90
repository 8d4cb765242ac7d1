! SPDX-License-Identifier: BSD-3-Clause
!> The run of Austin's Tables 9 and 10: the bilinear spring from x = 2, v = 0 with steps of
!> 0.04 s, extrapolated from a trapezoid that is split at the ends of the zones.
module bilinear_runs
   use bilinear_trapezoid, only: bilinear_trapezoid_stepper
   use dynstep_bilinear_spring, only: bilinear_spring
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_kinds, only: wp
   use dynstep_sequences, only: sequence_romberg
   use dynstep_stepper, only: state_type, stepper_type
   use error_areas, only: run
   implicit none
   private

   public :: extrapolated_components, exact_components, energy_of

   character(len=*), parameter, public :: names(4) = [character(len=12) :: &
      & 'displacement', 'velocity', 'acceleration', 'energy']
   real(wp), parameter :: x0 = 2.0_wp, v0 = 0.0_wp, dt = 0.04_wp

contains

   !> Displacement, velocity, acceleration and energy after some steps
   function extrapolated_components(steps) result(components)
      integer, intent(in) :: steps
      real(wp) :: components(4)
      type(extrapolation_stepper) :: stepper
      type(bilinear_spring) :: sys
      type(state_type) :: state
      allocate (bilinear_trapezoid_stepper :: stepper%base)
      stepper%sequence = sequence_romberg
      stepper%levels = 4
      call sys%setup()
      call run(stepper, sys, [x0], [v0], dt, steps, 1, state=state)
      components(1:2) = state%y
      components(3) = state%a(1)
      components(4) = energy_of(components)
   end function extrapolated_components

   !> The same of the true motion
   function exact_components(steps) result(components)
      integer, intent(in) :: steps
      real(wp) :: components(4)
      type(bilinear_spring) :: sys
      call sys%setup()
      call sys%exact(x0, v0, steps*dt, components(1), components(2), components(3))
      components(4) = energy_of(components)
   end function exact_components

   !> Energy of x = components(1), v = components(2)
   real(wp) function energy_of(components)
      real(wp), intent(in) :: components(:)
      type(bilinear_spring) :: sys
      integer :: ierr
      call sys%setup()
      call sys%energy(0.0_wp, components(1:1), components(2:2), energy_of, ierr)
   end function energy_of
end module bilinear_runs
