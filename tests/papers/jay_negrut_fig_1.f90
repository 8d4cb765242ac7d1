! SPDX-License-Identifier: BSD-3-Clause
!> Jay & Negrut's Fig. 1: global errors of SOI2 at t = 1 of the test problem (15), rho_inf = 0.2, steps of h/3
!> and 2h/3 by turns with the adjustments (14); and the same by M_alpha recomputed, by the reduced variant of
!> section 6, and with steps of one length.
program jay_negrut_fig_1
   use constrained_runs, only: coarsest, compare_errors, finest, print_errors, sweep, test_problem
   use dynstep_alpha_coefficients, only: coefficients_of
   use dynstep_kinds, only: wp
   use dynstep_soi2, only: mass_recomputed, soi2_stepper, variant_reduced
   use dynstep_status, only: status_type
   use paper_table, only: jay_negrut_2008, paper_table_type
   implicit none

   character(len=*), parameter :: reference(5, 6) = reshape([character(len=8) :: &
      & '3.197e-2', '3.242e-2', '7.186e-2', '4.073e-3', '1.175e-3', &
      & '1.779e-3', '1.805e-3', '4.467e-3', '4.258e-4', '9.977e-5', &
      & '1.088e-4', '1.104e-4', '2.812e-4', '2.965e-5', '6.533e-6', &
      & '6.765e-6', '6.864e-6', '1.761e-5', '1.902e-6', '4.125e-7', &
      & '4.223e-7', '4.285e-7', '1.101e-6', '1.197e-7', '2.584e-8', &
      & '2.639e-8', '2.677e-8', '6.885e-8', '7.491e-9', '1.616e-9'], [5, 6])
   real(wp), parameter :: second(5) = 2.0_wp
   type(paper_table_type) :: table
   type(soi2_stepper) :: stepper
   type(status_type) :: status
   real(wp) :: errors(5, coarsest:finest)
   integer :: i

   call table%open_figure(jay_negrut_2008, 'Fig. 1', &
      & 'errors at t = 1 of the test problem (15), rho_inf = 0.2, with (14)')
   call coefficients_of(0.2_wp, stepper%coefficients, status)
   call sweep(test_problem, stepper, coarsest, .true., errors)
   call print_errors('Steps h/3, 2h/3, with (14a) and (14b), M_alpha stored', errors, coarsest, 5)
   do i = 1, 5
      call compare_errors(table, errors, 2*i, reference(:, i))
   end do
   call compare_errors(table, errors, finest, reference(:, 6), second)

   stepper%mass_at = mass_recomputed
   call sweep(test_problem, stepper, coarsest, .true., errors)
   call print_errors('M_alpha recomputed, with (14a): no (14b) is needed', errors, coarsest, 5)
   call compare_errors(table, errors, finest, [character(len=8) :: '2.639e-8', '2.677e-8', '6.885e-8', '7.427e-9', &
      & '2.690e-9'], second)

   stepper = soi2_stepper(coefficients=stepper%coefficients, variant=variant_reduced)
   call sweep(test_problem, stepper, coarsest, .true., errors)
   call print_errors('Reduced variant of section 6: psi for psi~, without (13b) and (13h)', errors, coarsest, 5)
   call compare_errors(table, errors, finest, [character(len=8) :: '3.326e-8', '3.374e-8', '9.124e-8', '3.461e-9', &
      & '2.493e-9'], second, 'what the paper leaves to be investigated is of second order here as well')

   stepper = soi2_stepper(coefficients=stepper%coefficients)
   call sweep(test_problem, stepper, coarsest, .false., errors)
   call print_errors('Steps of one length h', errors, coarsest, 5)
   call compare_errors(table, errors, finest, [character(len=8) :: '7.916e-8', '8.032e-8', '1.800e-7', '1.295e-8', &
      & '6.565e-9'], second)
   call table%close()
end program jay_negrut_fig_1
