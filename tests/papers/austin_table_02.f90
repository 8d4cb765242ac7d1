! SPDX-License-Identifier: BSD-3-Clause
!> Austin's Table 2: extrapolation tableau of x'' + 16 x = 0 after one step of 0.03 s.
program austin_table_02
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_newmark, only: newmark_stepper
   use dynstep_oscillator, only: free_oscillator
   use dynstep_sequences, only: sequence_romberg
   use dynstep_status, only: status_type
   use error_areas, only: run
   use paper_table, only: austin_1991, paper_table_type
   implicit none

   !> As printed: the row of n = 1, then of n = 2, 4, 8
   character(len=*), parameter :: printed_x(10) = [character(len=18) :: &
      & '0.99282582702', '0.99281294252', '0.9928086477', '0.99280971308', '0.9928086366', '0.99280863586', &
      & '0.99280890519', '0.9928086359', '0.99280863585', '0.992808635853866']
   character(len=*), parameter :: printed_v(10) = [character(len=18) :: &
      & '-0.47827819849', '-0.47870594155', '-0.47884852258', '-0.47881309285', '-0.47884880995', &
      & '-0.47884882911', '-0.47883989418', '-0.47884882795', '-0.47884882915', '-0.478848829155675']
   real(wp), parameter :: exact_x(10) = [ &
      & 0.992825827022718214_wp, 0.992812942524971606_wp, 0.992808647692389403_wp, 0.992809713078106982_wp, &
      & 0.992808636595818774_wp, 0.992808635856047399_wp, 0.992808905194729494_wp, 0.992808635900270332_wp, &
      & 0.992808635853900436_wp, 0.992808635853866357_wp]
   real(wp), parameter :: exact_v(10) = [ &
      & -0.478278198485452371_wp, -0.478705941553391238_wp, -0.478848522576037526_wp, -0.478813092849673692_wp, &
      & -0.478848809948434510_wp, -0.478848829106594309_wp, -0.478839894178296266_wp, -0.478848827954503790_wp, &
      & -0.478848829154908409_wp, -0.478848829155675299_wp]
   real(wp), parameter :: round_off = 5.0e-15_wp

   type(paper_table_type) :: table
   type(extrapolation_stepper) :: stepper
   type(linear_system) :: sys
   type(status_type) :: status
   real(wp), allocatable :: tableau(:, :, :)
   integer, allocatable :: numbers(:)

   allocate (newmark_stepper :: stepper%base)
   stepper%sequence = sequence_romberg
   stepper%levels = 4
   call free_oscillator(sys, 1.0_wp, 16.0_wp, status)
   call run(stepper, sys, [1.0_wp], [0.0_wp], 0.03_wp, 1, 1)
   call stepper%get_tableau(tableau, numbers)

   call table%open(austin_1991, 'Table 2', 'components after one time step, x(0) = 1, x''(0) = 0, dt = 0.03')
   call table%section('Under the heading "Component x: analytic x(0.03)"; it is the velocity: the headings are swapped')
   call table%agrees('analytic, -4 sin(0.12)', '-0.47884882915567743984', -4.0_wp*sin(0.12_wp), accept=1.0e-16_wp)
   call tableau_rows(2, printed_v, exact_v)
   call table%section('Under the heading "Component x-dot: analytic x-dot(0.03)"; it is the displacement')
   call table%agrees('analytic, cos(0.12)', '0.99280863585386625224', cos(0.12_wp), accept=2.0e-16_wp)
   call tableau_rows(1, printed_x, exact_x)
   call table%close()

contains

   subroutine tableau_rows(component, printed, exact)
      integer, intent(in) :: component       !! 1 displacement, 2 velocity
      character(len=*), intent(in) :: printed(10)
      real(wp), intent(in) :: exact(10)
      character(len=24) :: item
      integer :: row, column, i
      i = 0
      do row = 1, 4
         do column = 1, row
            i = i + 1
            write (item, '("n = ", i0, ", order ", i0)') numbers(row), 2*column
            call table%agrees(item, trim(printed(i)), tableau(component, row, column), &
               & exact=exact(i), accept_exact=round_off)
         end do
      end do
   end subroutine tableau_rows
end program austin_table_02
