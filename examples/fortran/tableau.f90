! SPDX-License-Identifier: BSD-3-Clause
!> The extrapolation tableau of one step: Austin's Table 2, and its errors.
program tableau
   use dynstep
   implicit none
   type(linear_system) :: sys
   type(extrapolation_stepper) :: stepper
   type(state_type) :: state, trial
   type(status_type) :: status
   real(wp), allocatable :: table(:, :, :)
   integer, allocatable :: numbers(:)
   real(wp), parameter :: h = 0.03_wp
   integer :: j, k

   call free_oscillator(sys, m=1.0_wp, k=16.0_wp, status=status)     ! x = cos 4t
   allocate (newmark_stepper :: stepper%base)
   stepper%sequence = sequence_romberg
   stepper%levels = 4
   call stepper%init(sys, status)
   state%y = [1.0_wp, 0.0_wp]
   call stepper%start(sys, state, status)
   call allocate_state(sys, trial, status)
   call stepper%try_step(sys, state, h, state%t + h, trial, status)
   if (status%failed()) then
      print '(a)', trim(status%message)
      stop 1
   end if

   call stepper%get_tableau(table, numbers)                          ! [q; v] of row j, column k
   print '(a, 4i20)', 'steps', [(2*k, k=1, 4)]
   do j = 1, 4
      print '(i5, 4f20.15)', numbers(j), table(1, j, :j)
   end do
   print '(/, a)', 'errors of the displacement'
   do j = 1, 4
      print '(i5, 4es20.2)', numbers(j), table(1, j, :j) - cos(4.0_wp*h)
   end do
end program tableau
