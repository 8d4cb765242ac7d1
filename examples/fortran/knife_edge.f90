! SPDX-License-Identifier: BSD-3-Clause
!> A constraint on velocities: a knife edge that turns on a slope, against its exact solution.  It starts at rest
!> but for the turning, and drifts across the slope; the method is of second order in q, v and psi.
program knife_edge_example
   use dynstep
   implicit none
   type(knife_edge) :: sys
   type(soi2_stepper) :: stepper
   type(state_type) :: state
   type(status_type) :: status
   real(wp), parameter :: rate = 2.0_wp, span = 3.0_wp
   real(wp) :: q(3), v(3), a(3), psi(1), k(1), error(3, 4), drift
   integer :: i, level, ierr

   call sys%setup()
   drift = 0.0_wp
   print '(4a12, a11)', 't', 'x', 'y', 'psi', '|k|'
   do level = 1, 4                                       ! h = 1/20, 1/40, 1/80, 1/160
      call stepper%init(sys, status)
      state%t = 0.0_wp
      state%y = [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, rate]
      call stepper%start(sys, state, status)
      do i = 1, 6
         call integrate(stepper, sys, state, i*span/6.0_wp, control_type(h=0.1_wp/2**level, every=0), status)
         if (status%failed()) then
            print '(a)', trim(status%message)
            stop 1
         end if
         call sys%velocity_constraint(state%t, state%y(:3), state%y(4:), k, ierr)
         drift = max(drift, abs(k(1)))
         if (level == 1) print '(f12.2, 3f12.6, es11.1)', state%t, state%y(:2), state%psi, abs(k)
      end do
      call sys%exact(0.0_wp, rate, state%t, q, v, a, psi)
      error(:, level) = [norm2(state%y(:3) - q), norm2(state%y(4:) - v), abs(state%psi(1) - psi(1))]
   end do

   print '(/, 4a12)', 'h', 'error of q', 'of v', 'of psi'
   print '(f12.4, 3es12.2)', (0.1_wp/2**level, error(:, level), level=1, 4)
   ! second order: half the step, a fourth of the error; the next term of the error is of size h
   if (any(error(:, 4) > error(:, 3)/3.8_wp) .or. drift > 1.0e-13_wp) stop 1
end program knife_edge_example
