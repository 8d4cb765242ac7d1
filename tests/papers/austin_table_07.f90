! SPDX-License-Identifier: BSD-3-Clause
!> Austin's Table 7: error areas of the damped oscillator under load, eqs. (46) and (47), after
!> 200 steps of 0.03 s.
program austin_table_07
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_kinds, only: wp
   use dynstep_newmark, only: newmark_stepper
   use dynstep_oscillator, only: loaded_oscillator
   use dynstep_sequences, only: sequence_romberg
   use dynstep_status, only: status_type
   use error_areas, only: loaded_area, run
   use paper_table, only: austin_1991, paper_table_type
   implicit none

   real(wp), parameter :: dt = 0.03_wp
   real(wp), parameter :: exact(3) = [2.321111717953e-6_wp, 9.300485861382e-6_wp, 3.367511777764e-5_wp]
   character(len=*), parameter :: exponent = 'misprint in the exponent: the figure is ten times larger'
   type(paper_table_type) :: table
   type(newmark_stepper) :: newmark
   type(extrapolation_stepper) :: extrapolation
   type(loaded_oscillator) :: sys
   type(loaded_area) :: standard, extrapolated
   type(status_type) :: status
   real(wp) :: area(4)

   call sys%setup(status)
   standard%spacing = dt
   call run(newmark, sys, [1.0_wp], [-2.0_wp], dt/15, 15*200, 15, standard)
   allocate (newmark_stepper :: extrapolation%base)
   extrapolation%sequence = sequence_romberg
   extrapolated%spacing = dt
   call run(extrapolation, sys, [1.0_wp], [-2.0_wp], dt, 200, 1, extrapolated)

   call table%open(austin_1991, 'Table 7', 'error area after 200 time steps of the damped oscillator under load')
   area = standard%area()
   call table%section('Standard Newmark, h = dt/15, sum over the base points times dt')
   call table%agrees('displacement', '2.32e-6', area(1), exact=exact(1), accept_exact=1.0e-8_wp*exact(1))
   call table%agrees('velocity', '9.30e-6', area(2), exact=exact(2), accept_exact=1.0e-8_wp*exact(2))
   call table%explained('acceleration', '3.36e-6', '3.36e-5', area(3), exact=exact(3), &
      & accept_exact=1.0e-8_wp*exact(3), reason=exponent)
   area = extrapolated%area()
   call table%section('Newmark-extrapolation: rounding errors, and a truncation error of 1.0e-15, 3.9e-15, 1.5e-14')
   call table%rounding('displacement', '8.067e-16', area(1), 0.0_wp, 3.0e-15_wp, &
      & 'the order of operations decides: 288 variants give 6.9e-16 to 1.6e-15')
   call table%rounding('velocity', '3.223e-16', area(2), 1.5e-15_wp, 1.0e-14_wp, &
      & exponent//'; 288 variants give 2.7e-15 to 5.2e-15', misprint=.true.)
   call table%rounding('acceleration', '1.235e-15', area(3), 5.0e-15_wp, 4.0e-14_wp, &
      & exponent//'; 288 variants give 1.0e-14 to 2.2e-14', misprint=.true.)
   call table%close()
end program austin_table_07
