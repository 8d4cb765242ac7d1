! SPDX-License-Identifier: BSD-3-Clause
!> Austin's Table 8: error areas of the invariants of two bodies on a joint, eqs. (48)-(50),
!> after 1000 steps of 0.03 s; and the initial values that the text gives.
program austin_table_08
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_kinds, only: wp
   use dynstep_newmark, only: newmark_stepper
   use dynstep_sequences, only: sequence_romberg
   use dynstep_two_body, only: two_body_system
   use error_areas, only: run, two_body_area
   use paper_table, only: austin_1991, paper_table_type
   use dynstep_stepper, only: state_type
   implicit none

   real(wp), parameter :: dt = 0.03_wp
   real(wp), parameter :: q0(2) = [0.0_wp, 1.0_wp], v0(2) = [0.0_wp, 5.0_wp]
   real(wp), parameter :: exact(2) = [4.421653490e-3_wp, 1.350535080e-3_wp]
   character(len=*), parameter :: noise = &
      & 'rounding errors and the end of the iteration, over a truncation error of '
   type(paper_table_type) :: table
   type(newmark_stepper) :: newmark
   type(extrapolation_stepper) :: extrapolation
   type(two_body_system) :: sys
   type(two_body_area) :: standard, extrapolated
   type(state_type) :: start
   real(wp) :: area(4)

   call sys%setup(m1=1.0_wp, m2=2.0_wp, d1=1.0_wp, d2=1.5_wp, i1=1.0_wp, i2=3.0_wp)
   standard%bodies = sys
   standard%lagrangian = sys%lagrangian(q0, v0)
   standard%momentum = sys%momentum(q0, v0)
   extrapolated = standard
   standard%spacing = dt/15
   extrapolated%spacing = dt
   call run(newmark, sys, q0, v0, dt/15, 15*1000, 1, standard)
   allocate (newmark_stepper :: extrapolation%base)
   extrapolation%sequence = sequence_romberg
   call run(extrapolation, sys, q0, v0, dt, 1000, 1, extrapolated)
   call run(newmark, sys, q0, v0, dt, 0, 1, state=start)

   call table%open(austin_1991, 'Table 8', 'error area after 1000 time steps of the two bodies')
   call table%section('Text: initial values')
   call table%agrees('angular acceleration 1', '13.133', start%a(1), &
      & exact=13.133257709459068111_wp, accept_exact=1.0e-14_wp)
   call table%agrees('angular acceleration 2', '-1.5768', start%a(2), &
      & exact=-1.576873205329168320_wp, accept_exact=1.0e-14_wp)
   call table%agrees('angular momentum', '25.20151152934070', standard%momentum, &
      & exact=25.201511529340698587_wp, accept_exact=1.0e-14_wp)
   call table%agrees('Lagrangian', '56.25', standard%lagrangian, exact=56.25_wp, accept_exact=1.0e-14_wp)

   area = standard%area()
   call table%section('Standard Newmark, h = dt/15, eq. (42) over all 15000 steps')
   call table%agrees('Lagrangian', '4.421e-3', area(1), exact=exact(1), accept_exact=1.0e-7_wp*exact(1))
   call table%agrees('momentum norm', '1.351e-3', area(2), exact=exact(2), accept_exact=1.0e-7_wp*exact(2))
   area = extrapolated%area()
   call table%section('Newmark-extrapolation')
   call table%rounding('Lagrangian', '9.309e-10', area(1), 0.0_wp, 1.5e-9_wp, &
      & noise//'7.189e-10; 400 variants give 2.8e-10 to 9.9e-10')
   call table%rounding('momentum norm', '2.293e-10', area(2), 0.0_wp, 4.0e-10_wp, &
      & noise//'9.440e-11; 400 variants give 2.7e-11 to 2.3e-10')
   call table%close()
end program austin_table_08
