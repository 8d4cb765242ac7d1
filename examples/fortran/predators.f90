! SPDX-License-Identifier: BSD-3-Clause
!> Steps that follow the error, by backinterpolation: predators and prey (Lotka and Volterra) from (10, 10), whose motion
!> keeps H (Xie 1995, eq. (3.17), section 3.4).
program predators_example
   use dynstep
   implicit none
   real(wp), parameter :: tolerances(3) = [1.0e-4_wp, 1.0e-6_wp, 1.0e-8_wp]
   type(lotka_volterra) :: sys
   type(backinterpolation_stepper) :: stepper
   type(state_type) :: state
   type(status_type) :: status
   real(wp) :: change
   integer :: i

   call sys%setup()
   stepper%q = 5                                         ! BI45, and an alpha of its window of stability
   stepper%alpha = 0.44_wp
   print '(a10, 2a8, 2a12, a14)', 'tolerance', 'steps', 'again', 'predators', 'prey', 'change of H'
   do i = 1, size(tolerances)
      call stepper%init(sys, status)
      state%t = 0.0_wp
      state%y = [10.0_wp, 10.0_wp]
      call stepper%start(sys, state, status)
      call integrate_controlled(stepper, sys, state, 10.0_wp, step_control_type(tolerance=tolerances(i)), status)
      if (status%failed()) then
         print '(a)', trim(status%message)
         stop 1
      end if
      change = abs(sys%conserved(state%y) - sys%conserved([10.0_wp, 10.0_wp]))
      print '(es10.0, 2i8, 2f12.7, es14.2)', tolerances(i), stepper%count%steps, stepper%count%rejections, state%y, change
   end do
   if (change > 1.0e-6_wp) stop 1
end program predators_example
