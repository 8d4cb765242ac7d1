! SPDX-License-Identifier: BSD-3-Clause
!> Austin's Table 4: error areas after 3000 s of the free oscillator, beta = 1/4.
program austin_table_04
   use dynstep_kinds, only: wp
   use dynstep_newmark, only: newmark_stepper
   use newmark_as_printed, only: printed_areas
   use oscillator_areas, only: extrapolated_areas, extrapolated_rows, standard_areas, standard_rows
   use paper_table, only: austin_1991, paper_table_type
   implicit none

   real(wp), parameter :: beta = 0.25_wp
   real(wp), parameter :: exact_energy = 9.537573760864e-8_wp
   type(paper_table_type) :: table
   real(wp) :: standard(4), extrapolated(4)

   call table%open(austin_1991, 'Table 4', 'error area after 3000 s, gamma = 1/2, beta = 1/4')
   standard = standard_areas(beta)
   call standard_rows(table, ['4.074e0', '1.629e1', '6.518e1'], standard, &
      & [4.074235333817_wp, 16.29518491514_wp, 65.18776534107_wp])
   call table%section('Standard Newmark, energy')
   call table%rounding('energy', '4.712e-11', standard(4)/15, 0.0_wp, 5.0e-10_wp, &
      & 'zero but for rounding errors, which depend on the order of operations; see the last section')

   extrapolated = extrapolated_areas(newmark_stepper(beta=beta))
   call table%section('Newmark-extrapolation, base step dt = 0.03 (rounding errors are 2 % of these figures)')
   call extrapolated_rows(table, ['5.304e-8', '2.121e-7', '8.487e-7'], extrapolated, &
      & [5.207433812713e-8_wp, 2.082747862691e-7_wp, 8.331894100341e-7_wp], 0.03_wp)
   call table%agrees('energy', '9.514e-8', extrapolated(4), accept=0.12_wp*exact_energy, &
      & exact=exact_energy, accept_exact=0.12_wp*exact_energy)

   call printed_areas(beta, standard, extrapolated)
   call table%section('The paper''s own order of operations, step [4d], in IEEE double: all digits as printed')
   call table%holds('standard, energy', standard(4), 4.712034e-11_wp, 1.0e-17_wp)
   call table%holds('extrapolation, displacement', extrapolated(1), 5.304366e-8_wp, 1.0e-14_wp)
   call table%holds('extrapolation, velocity', extrapolated(2), 2.121519e-7_wp, 1.0e-13_wp)
   call table%holds('extrapolation, acceleration', extrapolated(3), 8.486986e-7_wp, 1.0e-13_wp)
   call table%holds('extrapolation, energy', extrapolated(4), 9.514705e-8_wp, 1.0e-14_wp)
   call table%close()
end program austin_table_04
