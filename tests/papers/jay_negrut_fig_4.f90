! SPDX-License-Identifier: BSD-3-Clause
!> Jay & Negrut's Fig. 4: global errors of SOI2 at t = 2 of the pendulum (16), rho_inf = 0.2, steps of h/3 and 2h/3
!> by turns with (14a); without it; other rho_inf; and the first steps from a_alpha = a0 (Theorem 1).
program jay_negrut_fig_4
   use constrained_runs, only: coarsest, compare_errors, end_of_pendulum, finest, first_steps, names, observed_order, pendulum, &
      & print_errors, sweep, turn
   use dynstep_alpha_coefficients, only: coefficients_of
   use dynstep_kinds, only: wp
   use dynstep_rod_pendulum, only: rod_pendulum
   use dynstep_soi2, only: soi2_stepper
   use dynstep_status, only: status_type
   use paper_table, only: jay_negrut_2008, last_digit, paper_table_type, value_of
   implicit none

   integer, parameter :: first = 4
   character(len=*), parameter :: reference(4, 5) = reshape([character(len=8) :: &
      & '2.882e-2', '2.739e-1', '3.195', '1.958e1', &
      & '2.487e-3', '3.882e-3', '3.004e-1', '1.358', &
      & '1.568e-4', '1.344e-4', '1.863e-2', '8.370e-2', &
      & '9.813e-6', '7.207e-6', '1.160e-3', '5.218e-3', &
      & '6.135e-7', '4.338e-7', '7.245e-5', '3.259e-4'], [4, 5])
   real(wp), parameter :: second(4) = [2.0_wp, 2.02_wp, 2.0_wp, 2.0_wp]
   character(len=*), parameter :: not_needed = 'the paper says that (14) is not needed for y and z: an error of a_alpha ' &
      & //'that is O(h) in each step adds O(h^2) to z in each'
   real(wp), parameter :: rho_inf(5) = [0.0_wp, 0.5_wp, 0.8_wp, 0.9_wp, 1.0_wp]
   character(len=*), parameter :: swept(4, 5) = reshape([character(len=6) :: &
      & '1.1e-6', '8.2e-7', '1.3e-4', '5.9e-4', &
      & '3.2e-7', '2.1e-7', '3.8e-5', '1.7e-4', &
      & '2.4e-7', '1.5e-7', '2.8e-5', '1.3e-4', &
      & '2.3e-7', '1.5e-7', '2.7e-5', '1.2e-4', &
      & '2.3e-7', '7.9e-8', '3.3e-2', '1.6e-1'], [4, 5])
   character(len=*), parameter :: starts(2, 3) = reshape([character(len=6) :: &
      & '1.6e-2', '1.2e-1', '3.3e-3', '8.0e-2', '6.0e-4', '4.5e-2'], [2, 3])
   type(paper_table_type) :: table
   type(soi2_stepper) :: stepper
   type(status_type) :: status
   type(rod_pendulum) :: sys
   real(wp) :: errors(5, coarsest:finest), theta, rate, x(2), coarse(2), half(2), fine(2)
   character(len=32) :: item
   integer :: i, k

   call table%open_figure(jay_negrut_2008, 'Fig. 4', 'errors at t = 2 of the pendulum (16), rho_inf = 0.2')
   call coefficients_of(0.2_wp, stepper%coefficients, status)
   call sweep(pendulum, stepper, first, .true., errors)
   call print_errors('Steps h/3, 2h/3, with (14a)', errors, first, 4)
   do i = 1, 4
      call compare_errors(table, errors, 2 + 2*i, reference(:, i))
   end do
   call compare_errors(table, errors, finest, reference(:, 5), second)

   stepper%adjust_acceleration = .false.
   stepper%adjust_momentum = .false.
   call sweep(pendulum, stepper, first, .true., errors)
   call print_errors('Without (14a)', errors, first, 4)
   call compare_errors(table, errors, finest, [character(len=8) :: '4.15e-6', '1.94e-4', '5.8e-4', '1.2e-3'])
   call table%explained('order of y', '2', '0.79', observed_order(errors, 1, finest), accept=0.05_wp, reason=not_needed)
   call table%explained('order of z', '2', '1.00', observed_order(errors, 2, finest), accept=0.05_wp, reason=not_needed)

   call table%section('Other rho_inf, with (14a)')
   do i = 1, size(rho_inf)
      call sweep_rho(rho_inf(i), swept(:, i))
   end do

   call table%section('Theorem 1: first steps of h = 1e-4 from a_alpha = a0, rho_inf = 0.5, where r = 0')
   stepper = soi2_stepper()
   call coefficients_of(0.5_wp, stepper%coefficients, status)
   do i = 1, 3
      call first_steps(stepper, 1.0e-4_wp, i, coarse(1), coarse(2))
      call first_steps(stepper, 0.5e-4_wp, i, half(1), half(2))
      call first_steps(stepper, 0.25e-4_wp, i, fine(1), fine(2))
      do k = 1, 2
         write (item, '("error of ", a, " after step ", i0)') trim(names(k + 2)), i
         call table%agrees(item, starts(k, i), coarse(k), accept=0.5_wp*last_digit(starts(k, i)))
         call table%explained('its order', '2', '1.00', log(half(k)/fine(k))/log(2.0_wp), accept=0.05_wp, reason= &
            & 'parts of a across the constraints and multipliers have decay factors of their own, not r')
      end do
   end do

   call table%section('The motion that the errors are measured from, by Kutta''s rule with 40000 steps')
   call end_of_pendulum(theta, rate)
   x = [1.5_wp*acos(-1.0_wp), 10.0_wp]
   call sys%setup()
   call turn(sys, 2.0_wp, 40000, x(1), x(2))
   call table%holds('theta(2)', x(1), theta, 1.0e-12_wp)
   call table%holds('rate of theta(2)', x(2), rate, 1.0e-11_wp)
   call table%close()

contains

   !> Errors at 2^-finest against two digits, and orders
   subroutine sweep_rho(rho, expected)
      real(wp), intent(in) :: rho
      character(len=*), intent(in) :: expected(4)
      character(len=40) :: item
      real(wp) :: order
      integer :: component
      stepper = soi2_stepper()
      call coefficients_of(rho, stepper%coefficients, status)
      call sweep(pendulum, stepper, finest - 1, .true., errors)
      write (item, '("rho_inf = ", f3.1)') rho
      call table%section(trim(item))
      do component = 1, 4
         item = 'error of '//trim(names(component))//', h = 2^-12'
         ! the reference is rounded to two digits
         call table%agrees(item, expected(component), errors(component, finest), accept=max(0.5_wp*last_digit( &
            & expected(component)), 0.02_wp*value_of(expected(component))))
      end do
      do component = 1, 4
         order = 2.0_wp
         if (rho >= 1.0_wp .and. component > 2) order = 1.0_wp
         call table%holds('order of '//names(component), observed_order(errors, component, finest), order, 0.05_wp)
      end do
   end subroutine sweep_rho
end program jay_negrut_fig_4
