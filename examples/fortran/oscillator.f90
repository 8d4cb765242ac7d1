! SPDX-License-Identifier: BSD-3-Clause
program oscillator
   use dynstep
   implicit none
   type(linear_system) :: sys
   type(extrapolation_stepper) :: stepper
   type(state_type) :: state
   type(status_type) :: status

   ! q'' + 16 q = 0,  q(0) = 1,  q'(0) = 0
   call sys%set(diagonal_matrix([1.0_wp]), zero_matrix(1), diagonal_matrix([16.0_wp]), status)
   allocate (newmark_stepper :: stepper%base)          ! four levels of Newmark: order 8
   call stepper%init(sys, status)
   state%y = [1.0_wp, 0.0_wp]                          ! [q; q']
   call stepper%start(sys, state, status)
   call integrate(stepper, sys, state, 3.0_wp, control_type(h=0.1_wp), status)
   print '(a, f12.9, a, es8.1)', 'q(3) = ', state%y(1), ', error ', state%y(1) - cos(12.0_wp)
   if (status%failed()) print '(a)', trim(status%message)
end program oscillator
