! SPDX-License-Identifier: BSD-3-Clause
!> A flexible arm turns from 90 degrees to 0 by feedback of hub and tip (Xie 1995, section 4.5): 20 segments, stiff, and
!> the feedback couples the first coordinate with the last.
program flexible_arm_example
   use dynstep
   implicit none
   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp
   type(flexible_arm) :: arm
   type(pade_stepper) :: stepper
   type(state_type) :: state
   type(status_type) :: status
   integer :: i

   call arm%setup(20, status)
   call arm%close_loop(status)
   stepper%p = 3                                         ! order 7; stiff modes are damped at once
   stepper%q = 4
   call stepper%init(arm, status)
   allocate (state%y(2*arm%n), source=0.0_wp)            ! [q; q'], at rest
   call arm%straight(90.0_wp*degree, state%y(:arm%n))
   call stepper%start(arm, state, status)
   print '(a4, 2a16)', 't', 'hub [degrees]', 'tip deflection'
   do i = 0, 8
      call integrate(stepper, arm, state, real(i, wp), control_type(h=0.01_wp, every=0), status)
      associate (q => state%y(:arm%n))
         print '(f4.0, f16.8, f16.10)', state%t, arm%hub_angle(q)/degree, arm%tip_deflection(q)
      end associate
   end do
   if (status%failed()) print '(a)', trim(status%message)
   print '(i0, a, i0, a)', stepper%count%steps, ' steps, ', stepper%count%factorizations, ' factorizations'
   if (status%failed() .or. abs(arm%hub_angle(state%y(:arm%n))) > 1.0e-2_wp) stop 1
end program flexible_arm_example
