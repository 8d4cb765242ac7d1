! SPDX-License-Identifier: BSD-3-Clause
!> The rod of bench_constraints.py in Fortran (Jay & Negrut 2008, eqs. (16)): seconds of so many steps of SOI2 with
!> the last point kept.  System and method are made each time.
program bench_rod
   use bench_clock, only: thread_seconds
   use dynstep
   use dynstep_rod_pendulum, only: rod_pendulum
   implicit none
   integer, parameter :: steps = 20000
   real(wp), parameter :: h = 1.0e-3_wp
   integer :: r
   real(wp) :: best, start

   best = huge(best)
   do r = 1, 7
      start = thread_seconds()
      call run()
      best = min(best, thread_seconds() - start)
   end do
   print '(es15.7)', best

contains

   subroutine run()
      type(rod_pendulum) :: rod
      type(status_type) :: status
      type(state_type) :: state
      class(stepper_type), allocatable :: stepper

      call rod%setup()
      call new_method('soi2', stepper, status)
      call stepper%init(rod, status)
      allocate (state%y(6))
      call rod%start(1.5_wp*acos(-1.0_wp), 10.0_wp, state%y(:3), state%y(4:))
      call stepper%start(rod, state, status)
      call integrate(stepper, rod, state, steps*h, control_type(h=h, every=0), status)
      if (status%failed()) print '(a)', status%message
      if (stepper%count%steps /= steps) print '(a)', 'the number of steps is not that of the comparison'
   end subroutine run
end program bench_rod
