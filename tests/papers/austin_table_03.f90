! SPDX-License-Identifier: BSD-3-Clause
!> Austin's Table 3: errors of the energy in the tableau of Table 2.
program austin_table_03
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_newmark, only: newmark_stepper
   use dynstep_oscillator, only: free_oscillator
   use dynstep_sequences, only: sequence_romberg
   use dynstep_status, only: status_type
   use error_areas, only: run
   use newmark_as_printed, only: printed_tableau
   use paper_table, only: austin_1991, paper_table_type
   implicit none

   character(len=*), parameter :: printed(10) = [character(len=9) :: &
      & '0.000000', '1.77e-15', '4.12e-08', '1.77e-15', '2.58e-09', '1.11e-11', &
      & '-3.55e-15', '1.61e-10', '1.66e-13', '-6.21e-15']
   real(wp), parameter :: exact(10) = [ &
      & 0.0_wp, 0.0_wp, 4.1248954818815813e-8_wp, 0.0_wp, 2.5885043395184829e-9_wp, 1.1143980562185278e-11_wp, &
      & 0.0_wp, 1.6194533883580461e-10_wp, 1.747505932841187e-13_wp, 6.3583189240368629e-16_wp]
   !> The energy is 8, whose unit of rounding is 1.8e-15
   real(wp), parameter :: round_off = 2.0e-14_wp

   type(paper_table_type) :: table
   type(extrapolation_stepper) :: stepper
   type(linear_system) :: sys
   type(status_type) :: status
   real(wp), allocatable :: tableau(:, :, :)
   integer, allocatable :: numbers(:)
   character(len=24) :: item
   integer :: row, column, i

   allocate (newmark_stepper :: stepper%base)
   stepper%sequence = sequence_romberg
   stepper%levels = 4
   call free_oscillator(sys, 1.0_wp, 16.0_wp, status)
   call run(stepper, sys, [1.0_wp], [0.0_wp], 0.03_wp, 1, 1)
   call stepper%get_tableau(tableau, numbers)

   call table%open(austin_1991, 'Table 3', &
      & 'energy errors E - 8 at time step 1 (the print cuts digits off, it does not round)')
   call table%section('The library')
   i = 0
   do row = 1, 4
      do column = 1, row
         i = i + 1
         write (item, '("n = ", i0, ", order ", i0)') numbers(row), 2*column
         associate (computed => energy(tableau(:, row, column)) - 8.0_wp)
            if (abs(exact(i)) < round_off) then
               call table%rounding(item, trim(printed(i)), computed, -round_off, round_off, &
                  & 'a rounding error of E = 8; see the last section')
            else
               call table%agrees(item, trim(printed(i)), computed, exact=exact(i), accept_exact=round_off)
            end if
         end associate
      end do
   end do
   call table%section('The paper''s own order of operations, step [4d], in IEEE double: the rounding errors, too')
   tableau = printed_tableau(0.25_wp)
   call table%holds('n = 1, order 2', energy(tableau(:, 1, 1)) - 8.0_wp, 0.0_wp, 0.0_wp)
   call table%holds('n = 2, order 2', energy(tableau(:, 2, 1)) - 8.0_wp, 1.7763568394002505e-15_wp, 0.0_wp)
   call table%holds('n = 4, order 2', energy(tableau(:, 3, 1)) - 8.0_wp, 1.7763568394002505e-15_wp, 0.0_wp)
   call table%holds('n = 8, order 2', energy(tableau(:, 4, 1)) - 8.0_wp, -3.5527136788005009e-15_wp, 0.0_wp)
   call table%holds('n = 8, order 6', energy(tableau(:, 4, 3)) - 8.0_wp, 1.6697754290362354e-13_wp, 0.0_wp)
   call table%holds('n = 8, order 8', energy(tableau(:, 4, 4)) - 8.0_wp, -6.2172489379008766e-15_wp, 0.0_wp)
   call table%close()

contains

   pure real(wp) function energy(state)
      real(wp), intent(in) :: state(2)       !! x, v
      energy = 0.5_wp*state(2)**2 + 8.0_wp*state(1)**2
   end function energy
end program austin_table_03
