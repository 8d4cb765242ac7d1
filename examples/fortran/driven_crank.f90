! SPDX-License-Identifier: BSD-3-Clause
!> A constraint that depends on time: a motor turns the crank of a slider-crank by a law, angle(t).  The motion is
!> prescribed; what is to be found is the torque of the motor, and the forces in the pins.
program driven_crank_example
   use dynstep
   implicit none
   type(driven_crank) :: sys
   type(soi2_stepper) :: stepper
   type(state_type) :: state
   type(status_type) :: status
   real(wp), parameter :: span = 2.0_wp
   real(wp) :: q(9), v(9), a(9), lambda(9), error(3, 2), bound
   integer :: i, level

   sys%gravity = 9.81_wp
   call sys%setup()
   print '(5a13)', 't', 'crank', 'slider', 'torque', 'exact'
   do level = 1, 2                                       ! h = 1/100, 1/200
      call stepper%init(sys, status)
      call sys%exact(0.0_wp, q, v, a, lambda, status)
      state%t = 0.0_wp
      state%y = [q, v]
      call stepper%start(sys, state, status)
      do i = 1, 8
         call integrate(stepper, sys, state, i*span/8.0_wp, control_type(h=0.02_wp/2**level, every=0), status)
         call sys%exact(state%t, q, v, a, lambda, status)
         if (status%failed()) then
            print '(a)', trim(status%message)
            stop 1
         end if
         ! the reaction is -G^T lambda, and row 9 of G is 1 at the angle of the crank
         if (level == 1) print '(5f13.6)', state%t, state%y(3), state%y(7), -state%lambda(9), -lambda(9)
      end do
      error(:, level) = [maxval(abs(state%y(:9) - q)), maxval(abs(state%y(10:) - v)), maxval(abs(state%lambda - lambda))]
   end do

   print '(/, 4a13)', 'h', 'error of q', 'of v', 'of lambda'
   print '(f13.4, 3es13.2)', (0.02_wp/2**level, error(:, level), level=1, 2)
   ! q and v lie on constraints that leave nothing free: they are exact up to rounding.  lambda is of second
   ! order: half the step, a fourth of the error.
   bound = 100.0_wp*epsilon(1.0_wp)*maxval(abs([q, v]))
   if (any(error(:2, :) > bound) .or. error(3, 2) > error(3, 1)/3.8_wp) stop 1
end program driven_crank_example
