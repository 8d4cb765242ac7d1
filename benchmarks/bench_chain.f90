! SPDX-License-Identifier: BSD-3-Clause
!> The chain of bench_python.py in Fortran: seconds of 1000 steps of n masses, for each method
!> with the last point kept, and with all points kept.  System and method are made each time.
program bench_chain
   use bench_clock, only: thread_seconds
   use dynstep
   implicit none
   integer, parameter :: n = 1000, steps = 1000
   integer :: method, every, r
   real(wp) :: best, start

   do method = 1, 2
      do every = 0, 1
         best = huge(best)
         do r = 1, 5
            start = thread_seconds()
            call run(method, every)
            best = min(best, thread_seconds() - start)
         end do
         print '(es15.7)', best
      end do
   end do

contains

   subroutine run(method, every)
      integer, intent(in) :: method, every
      type(linear_system) :: chain
      type(status_type) :: status
      type(state_type) :: state
      type(trajectory_type) :: points
      class(stepper_type), allocatable :: stepper
      real(wp) :: k(3, n)
      integer :: i

      k(1, :) = -1.0_wp
      k(2, :) = 2.0_wp
      k(3, :) = -1.0_wp
      call chain%set(diagonal_matrix([(1.0_wp, i=1, n)]), zero_matrix(n), banded_matrix(k, 1, 1, symmetric=.true.), status)
      if (method == 1) then
         call new_method('newmark', stepper, status)
      else
         call new_method('newmark-extrapolation', stepper, status)
      end if
      call stepper%init(chain, status)
      state%y = [(sin(0.01_wp*i), i=1, n), (0.0_wp, i=1, n)]
      call stepper%start(chain, state, status)
      call integrate(stepper, chain, state, 100.0_wp, control_type(h=0.1_wp, every=every), status, points)
      if (status%failed()) print '(a)', status%message
   end subroutine run
end program bench_chain
