! SPDX-License-Identifier: BSD-3-Clause
!> Austin's Table 6: the midpoint rule as base of the extrapolation, eq. (45), against Table 4.
program austin_table_06
   use dynstep_kinds, only: wp
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
   use oscillator_areas, only: extrapolated_areas, extrapolated_rows
   use paper_table, only: austin_1991, paper_table_type
   implicit none

   !> Both rules are the same map in exact arithmetic
   real(wp), parameter :: exact(3) = [5.207433812713e-8_wp, 2.082747862691e-7_wp, 8.331894100341e-7_wp]
   real(wp), parameter :: exact_energy = 9.537573760864e-8_wp
   type(paper_table_type) :: table
   type(newmark_stepper) :: trapezoid
   type(midpoint_stepper) :: midpoint
   real(wp) :: area(4)

   call table%open(austin_1991, 'Table 6', 'error area after 3000 s; the figures differ by rounding errors alone')
   area = extrapolated_areas(trapezoid)
   call table%section('Newmark-extrapolation, beta = 1/4 (Table 4 again)')
   call extrapolated_rows(table, ['5.304e-8', '2.121e-7'], area, exact, 0.03_wp)
   call table%agrees('energy', '9.514e-8', area(4), accept=0.12_wp*exact_energy, &
      & exact=exact_energy, accept_exact=0.12_wp*exact_energy)
   area = extrapolated_areas(midpoint)
   call table%section('Midpoint-extrapolation')
   call extrapolated_rows(table, ['5.222e-8', '2.089e-7'], area, exact, 0.03_wp)
   call table%agrees('energy', '9.498e-8', area(4), accept=0.12_wp*exact_energy, &
      & exact=exact_energy, accept_exact=0.12_wp*exact_energy)
   call table%close()
end program austin_table_06
