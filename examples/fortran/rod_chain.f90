! SPDX-License-Identifier: BSD-3-Clause
!> A hanging chain of rods whose free end is pushed: 3 N coordinates, 2 N constraints.  The model declares which
!> entries of G may differ from zero and an order of the unknowns, so that the equations of a step have a band of four
!> places on each side and the work of a step grows like N.
program rod_chain_example
   use dynstep
   implicit none
   integer, parameter :: rods = 100
   real(wp), parameter :: span = 0.5_wp
   type(rod_chain) :: sys
   type(soi2_stepper) :: stepper
   type(state_type) :: state
   type(status_type) :: status
   real(wp) :: q(3*rods), v(3*rods), g(2*rods), energy(2), change(2), drift
   integer :: i, level, ierr

   sys%l = 1.0_wp/rods
   sys%m = 1.0_wp/rods
   call sys%setup(rods, status)
   call sys%start(spread(-0.5_wp*acos(-1.0_wp), 1, rods), [(4.0_wp*i/rods, i=1, rods)], q, v)
   drift = 0.0_wp
   print '(a10, 2a14, a12, a14)', 't', 'x of the end', 'y of the end', 'pull', 'energy'
   do level = 1, 2                                       ! h = 1/1000, 1/2000
      call stepper%init(sys, status)
      state%t = 0.0_wp
      state%y = [q, v]
      call sys%energy(state%t, q, v, energy(1), ierr)
      call stepper%start(sys, state, status)
      do i = 1, 5
         call integrate(stepper, sys, state, i*span/5.0_wp, control_type(h=0.002_wp/2**level, every=0), status)
         if (status%failed()) then
            print '(a)', trim(status%message)
            stop 1
         end if
         call sys%constraint(state%t, state%y(:3*rods), g, ierr)
         drift = max(drift, maxval(abs(g)))
         call sys%energy(state%t, state%y(:3*rods), state%y(3*rods + 1:), energy(2), ierr)
         associate (last => state%y(3*rods - 2:3*rods))
            if (level == 1) print '(f10.2, 2f14.6, f12.6, f14.9)', state%t, last(1) + 0.5_wp*sys%l*cos(last(3)), &
               & last(2) + 0.5_wp*sys%l*sin(last(3)), norm2(state%lambda(1:2)), energy(2)
         end associate
      end do
      change(level) = abs(energy(2) - energy(1))
   end do

   print '(/, a, 2es10.2)', 'change of the energy, h = 1/1000 and 1/2000:', change
   print '(a, es10.2)', 'largest |g|:', drift
   print '(a, f6.3)', 'Newton iterations a step:', real(stepper%count%newton_iterations)/real(stepper%count%steps)
   ! a method of second order: half the step, a fourth of the change
   if (change(2) > change(1)/3.8_wp .or. drift > 1.0e-13_wp) stop 1
end program rod_chain_example
