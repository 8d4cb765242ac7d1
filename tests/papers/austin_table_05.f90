! SPDX-License-Identifier: BSD-3-Clause
!> Austin's Table 5: error areas after 3000 s of the free oscillator, beta = 1/6.
program austin_table_05
   use dynstep_kinds, only: wp
   use dynstep_newmark, only: newmark_stepper
   use newmark_as_printed, only: printed_areas
   use oscillator_areas, only: extrapolated_areas, extrapolated_rows, standard_areas, standard_rows
   use paper_table, only: austin_1991, paper_table_type
   implicit none

   real(wp), parameter :: beta = 1.0_wp/6.0_wp
   real(wp), parameter :: exact_energy = 4.266864435187e-3_wp
   type(paper_table_type) :: table
   real(wp) :: standard(4), extrapolated(4)

   call table%open(austin_1991, 'Table 5', 'error area after 3000 s, gamma = 1/2, beta = 1/6')
   standard = standard_areas(beta)
   call standard_rows(table, ['2.037e0', '8.148e0', '3.259e1'], standard, &
      & [2.037253258416_wp, 8.148123114141_wp, 32.59605213465_wp])
   call table%section('Standard Newmark, energy')
   call table%explained('energy', '4.267e-3', '4.267e-3', standard(4)/15, accept=1.0e-3_wp*exact_energy, &
      & exact=exact_energy, accept_exact=1.0e-6_wp*exact_energy, reason='the weight, as above')
   call table%holds('energy, by eq. (42)', standard(4), 15*exact_energy, 15*1.0e-6_wp*exact_energy)

   extrapolated = extrapolated_areas(newmark_stepper(beta=beta))
   call table%section('Newmark-extrapolation, base step dt = 0.03 (rounding errors are 8 % of the paper''s figures)')
   call extrapolated_rows(table, ['8.474e-9', '3.389e-8', '1.356e-7'], extrapolated, &
      & [9.252073637928e-9_wp, 3.700422604432e-8_wp, 1.480331782068e-7_wp], 0.12_wp)
   call table%rounding('energy', '1.186e-8', extrapolated(4), 3.0e-9_wp, 1.5e-8_wp, &
      & 'exact arithmetic has 9.574e-9; rounding errors are a third of that')

   call printed_areas(beta, standard, extrapolated)
   call table%section('The paper''s own order of operations, step [4d], in IEEE double: all digits as printed')
   call table%holds('standard, energy', standard(4), 4.266864391e-3_wp, 1.0e-12_wp)
   call table%holds('extrapolation, displacement', extrapolated(1), 8.474002e-9_wp, 1.0e-15_wp)
   call table%holds('extrapolation, velocity', extrapolated(2), 3.389247e-8_wp, 1.0e-14_wp)
   call table%holds('extrapolation, acceleration', extrapolated(3), 1.355840e-7_wp, 1.0e-13_wp)
   call table%holds('extrapolation, energy', extrapolated(4), 1.185763e-8_wp, 1.0e-14_wp)
   call table%close()
end program austin_table_05
