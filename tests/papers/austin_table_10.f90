! SPDX-License-Identifier: BSD-3-Clause
!> Austin's Table 10: the bilinear spring at the end of time step 10, t = 0.40 s, which
!> crosses from x > 1 to x < 1.
program austin_table_10
   use bilinear_runs, only: energy_of, exact_components, extrapolated_components, names
   use dynstep_kinds, only: wp
   use paper_table, only: austin_1991, paper_table_type
   implicit none

   character(len=*), parameter :: printed_analytic(4) = [character(len=18) :: &
      & '0.877842947098626', '-5.227371560478852', '-8.778429470986259', '17.500000000000000']
   character(len=*), parameter :: printed_numerical(4) = [character(len=18) :: &
      & '0.877954601994794', '-5.224170476570483', '-8.779546019947945', '17.499999999954522']
   character(len=*), parameter :: printed_error(4) = [character(len=18) :: &
      & '-0.000111654896169', '-0.003201083908370', '0.001116548961686', '0.000000000045478']
   !> The motion from the state at t = 0.36 on with the spring of |x| <= 1
   character(len=*), parameter :: late_switch(3) = [character(len=18) :: &
      & '0.8778429470986261', '-5.227371560478852', '-8.778429470986261']
   real(wp), parameter :: exact(4) = [0.87795414150754929962_wp, -5.2241712504566139079_wp, &
      & -8.7795414150754929962_wp, 17.5_wp]
   real(wp), parameter :: exact_numerical(4) = [0.877954601994795718_wp, -5.22417047657048645_wp, &
      & -8.77954601994795718_wp, 17.4999999999545525_wp]
   real(wp), parameter :: accept(4) = [1.0e-13_wp, 1.0e-13_wp, 1.0e-13_wp, 2.0e-13_wp]
   real(wp), parameter :: dt = 0.04_wp, k = 10.0_wp, omega = sqrt(k)
   type(paper_table_type) :: table
   real(wp) :: analytic(4), numerical(4), start(4), late(3)
   integer :: i

   analytic = exact_components(10)
   numerical = extrapolated_components(10)
   start = exact_components(9)
   late(1) = start(1)*cos(omega*dt) + start(2)/omega*sin(omega*dt)
   late(2) = start(2)*cos(omega*dt) - start(1)*omega*sin(omega*dt)
   late(3) = -k*late(1)

   call table%open(austin_1991, 'Table 10', &
      & 'system components at the end of time step 10 (x = 1 is crossed at t = 0.3761373)')
   call table%section('Analytic')
   do i = 1, 3
      call table%explained(trim(names(i)), printed_analytic(i), late_switch(i), late(i), accept=2.0e-15_wp*k, &
         & reason='not the solution: the zone with |x| <= 1 was entered at t = 0.36, before the crossing; computed so')
      call table%holds('   the true one', analytic(i), exact(i), 1.0e-14_wp)
   end do
   call table%agrees(trim(names(4)), printed_analytic(4), analytic(4), exact=exact(4), accept_exact=1.0e-14_wp)
   call table%holds('   of the printed x and v', energy_of(late), 17.515747914505563_wp, 1.0e-13_wp, &
      & 'so the printed "analytic" displacement and velocity do not have the energy that is printed below them')

   call table%section('Numerical, Newmark-extrapolation, each substep split where it reaches x = 1')
   do i = 1, 4
      call table%agrees(trim(names(i)), printed_numerical(i), numerical(i), &
         & exact=exact_numerical(i), accept_exact=accept(i))
   end do

   call table%section('Error, analytic less numerical')
   do i = 1, 3
      call table%explained(trim(names(i)), printed_error(i), printed_error(i), late(i) - numerical(i), &
         & accept=accept(i), reason='nearly all of it is the error of the "analytic" column, which it is computed with here')
      call table%holds('   the true one', analytic(i) - numerical(i), exact(i) - exact_numerical(i), 2*accept(i))
   end do
   call table%agrees(trim(names(4)), printed_error(4), analytic(4) - numerical(4), accept=4.0e-14_wp, &
      & exact=4.55e-11_wp, accept_exact=2.0e-13_wp)
   call table%close()
end program austin_table_10
