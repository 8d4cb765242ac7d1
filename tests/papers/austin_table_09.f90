! SPDX-License-Identifier: BSD-3-Clause
!> Austin's Table 9: the bilinear spring at the end of time step 9, t = 0.36 s, all of it in
!> one zone.
program austin_table_09
   use bilinear_runs, only: exact_components, extrapolated_components, names
   use dynstep_kinds, only: wp
   use paper_table, only: austin_1991, last_digit, paper_table_type, value_of
   implicit none

   character(len=*), parameter :: printed_analytic(4) = [character(len=19) :: &
      & '1.079367284205931', '-4.835406755059004', '-10.396836421029658', '17.500000000000000']
   character(len=*), parameter :: printed_numerical(4) = [character(len=19) :: &
      & '1.079367284205930', '-4.835406755059001', '-10.396836421029651', '17.49999999999972']
   character(len=*), parameter :: printed_error(4) = [character(len=19) :: &
      & '0.0000000000000001', '-0.0000000000000003', '-0.0000000000000007', '0.000000000000028']
   real(wp), parameter :: exact(4) = [ &
      & 1.0793672842059312_wp, -4.8354067550590042_wp, -10.396836421029657_wp, 17.5_wp]
   real(wp), parameter :: exact_numerical(4) = [ &
      & 1.0793672842059320952_wp, -4.8354067550590026668_wp, -10.396836421029660476_wp, 17.5_wp]
   real(wp), parameter :: accept(4) = [2.0e-14_wp, 2.0e-14_wp, 2.0e-14_wp, 1.0e-13_wp]
   type(paper_table_type) :: table
   real(wp) :: analytic(4), numerical(4)
   integer :: i

   analytic = exact_components(9)
   numerical = extrapolated_components(9)
   call table%open(austin_1991, 'Table 9', 'system components at the end of time step 9 (x > 1 throughout)')
   call table%section('Analytic')
   do i = 1, 4
      call table%agrees(trim(names(i)), printed_analytic(i), analytic(i), exact=exact(i), accept_exact=1.0e-14_wp)
   end do
   call table%section('Numerical, Newmark-extrapolation')
   do i = 1, 3
      call table%agrees(trim(names(i)), printed_numerical(i), numerical(i), &
         & exact=exact_numerical(i), accept_exact=accept(i))
   end do
   call table%explained(trim(names(4)), printed_numerical(4), '17.499999999999972', numerical(4), accept=accept(4), &
      & exact=exact_numerical(4), accept_exact=accept(4), &
      & reason='a digit 9 is lost: 17.499999999999972 goes with the printed error 2.8e-14')
   call table%holds('analytic less numerical, as corrected', 17.5_wp - 17.499999999999972_wp, 2.8e-14_wp, 2.0e-15_wp)

   call table%section('Error, analytic less numerical: rounding errors, whose bounds are those of the numerical column')
   do i = 1, 3
      call table%rounding(trim(names(i)), printed_error(i), analytic(i) - numerical(i), -accept(i), accept(i), &
         & 'one zero too many in print: the difference of the printed columns is ten times the printed error', &
         & misprint=.true.)
      call table%holds('   difference of the printed columns', &
         & value_of(printed_analytic(i)) - value_of(printed_numerical(i)), 10*value_of(printed_error(i)), &
         & 0.9_wp*last_digit(printed_analytic(i)))
   end do
   call table%rounding(trim(names(4)), printed_error(4), analytic(4) - numerical(4), -accept(4), accept(4), &
      & 'rounding errors of 17.5')
   call table%close()
end program austin_table_09
