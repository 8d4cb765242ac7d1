! SPDX-License-Identifier: BSD-3-Clause
!> Whole runs of linear systems by rational steps: what an accuracy costs on the closed-loop arm and on a beam with feedback,
!> and what a step costs by the stepper, next to Newmark's method.
program bench_arm
   use bench_clock, only: print_ratio, print_time, print_title, thread_seconds
   use dynstep
   implicit none

   integer, parameter :: repeats = 5

   call arm_to_accuracy()
   call beam_to_accuracy()
   call step_of_a_beam()

contains

   !> Euler-Bernoulli, n = 20, PD loop, from 90 degrees to t = 10 at an error of 1e-6
   subroutine arm_to_accuracy()
      type(flexible_arm) :: sys
      type(status_type) :: status
      real(wp), allocatable :: y0(:)
      call sys%setup(20, status)
      call sys%close_loop(status)
      allocate (y0(2*sys%n), source=0.0_wp)
      call sys%straight(acos(-1.0_wp)/2.0_wp, y0(:sys%n))
      call to_accuracy('closed-loop arm, n = 20, t = 10, error 1e-6', sys, y0, 10.0_wp, 1.0e-6_wp, 5.0_wp)
   end subroutine arm_to_accuracy

   !> Clamped beam of 100 nodes with stiff PD feedback of its tip at a node near the clamp, to t = 2 at 1e-5
   subroutine beam_to_accuracy()
      type(linear_system) :: sys
      type(status_type) :: status
      integer, parameter :: n = 100
      real(wp) :: y0(2*n), b(n), k(n), c(n)
      integer :: i
      call set_beam(n, sys)
      b = 0.0_wp
      k = 0.0_wp
      c = 0.0_wp
      b(n) = real(n, wp)
      k(n) = 100.0_wp
      k(n/2) = 20.0_wp
      c(n) = 5.0_wp
      call sys%set_coupling(b, k, c, status)
      y0 = 0.0_wp
      do i = 1, n
         y0(i) = (real(i, wp)/n)**2*(1.5_wp - 0.5_wp*real(i, wp)/n)
      end do
      call to_accuracy('beam with feedback, 100 nodes, t = 2, error 1e-5', sys, y0, 2.0_wp, 1.0e-5_wp, 20.0_wp)
   end subroutine beam_to_accuracy

   !> Clamped-free Euler-Bernoulli beam by differences, mass 1, length 1, rigidity 1
   subroutine set_beam(n, sys)
      integer, intent(in) :: n
      type(linear_system), intent(out) :: sys
      type(status_type) :: status
      real(wp) :: band(5, n), r
      r = real(n, wp)**4
      band(1, :) = r
      band(5, :) = r
      band(2, :) = -4.0_wp*r
      band(4, :) = -4.0_wp*r
      band(3, :) = 6.0_wp*r
      band(3, 1) = 7.0_wp*r
      band(3, n - 1) = 5.0_wp*r
      band(3, n) = r
      band(4, n - 1) = -2.0_wp*r
      band(2, n) = -2.0_wp*r
      band(1, :2) = 0.0_wp
      band(2, 1) = 0.0_wp
      band(4, n) = 0.0_wp
      band(5, n - 1:) = 0.0_wp
      call sys%set(identity_matrix(n), zero_matrix(n), banded_matrix(band, 2, 2, .true.), status)
      if (status%failed()) print '(a)', trim(status%message)
   end subroutine set_beam

   !> Steps are doubled until the error beside the largest coordinate of the reference, at the end, is small enough
   subroutine to_accuracy(name, sys, y0, t_end, accuracy, goal)
      character(len=*), intent(in) :: name
      class(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: y0(:), t_end, accuracy
      real(wp), intent(in) :: goal                          !! milliseconds
      real(wp) :: reference(size(y0)), y(size(y0)), seconds, error
      integer, parameter :: orders(2, 4) = reshape([2, 3, 3, 4, 4, 4, 8, 8], [2, 4])
      integer :: i, steps
      character(len=60) :: what
      character(len=8) :: shown
      call run(pade_stepper(p=8, q=8), sys, y0, t_end, 16384, reference, seconds)
      write (shown, '("<= ", f0.0)') goal
      call print_title(name, 'ms')
      do i = 1, size(orders, 2)
         steps = 16
         do
            call run(pade_stepper(p=orders(1, i), q=orders(2, i)), sys, y0, t_end, steps, y, seconds)
            error = maxval(abs(y(:sys%n) - reference(:sys%n)))/maxval(abs(y0(:sys%n)))
            if (error <= accuracy .or. steps > 100000) exit
            steps = 2*steps
         end do
         write (what, '("Pade(", i0, ",", i0, "), ", i0, " steps, error ", es7.1)') orders(:, i), steps, error
         call print_ratio(trim(what), 1.0e3_wp*seconds, goal, shown//'ms')
      end do
   end subroutine to_accuracy

   !> Start and run, the least of some times
   subroutine run(method, sys, y0, t_end, steps, y, seconds)
      type(pade_stepper), intent(in) :: method
      class(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: y0(:), t_end
      integer, intent(in) :: steps
      real(wp), intent(out) :: y(:), seconds
      type(pade_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      real(wp) :: start
      integer :: r
      seconds = huge(1.0_wp)
      do r = 1, merge(repeats, 1, steps < 16384)
         stepper = method
         state%t = 0.0_wp
         state%y = y0
         start = thread_seconds()
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         clock = clock_type(t0=0.0_wp, h=t_end/steps, k=0_long)
         call stepper%advance(sys, state, clock, steps, status, complete=.true.)
         seconds = min(seconds, thread_seconds() - start)
         if (status%failed()) print '(a)', trim(status%message)
      end do
      y = state%y
   end subroutine run

   !> ns per coordinate and step, beside Newmark's linear engine on the same beam
   subroutine step_of_a_beam()
      integer, parameter :: sizes(4) = [100, 1000, 10000, 100000]
      type(linear_system) :: sys
      type(newmark_stepper) :: newmark
      real(wp) :: yardstick
      integer :: i
      character(len=24) :: shown
      do i = 1, size(sizes)
         call set_beam(sizes(i), sys)
         write (shown, '(i0, " coordinates")') sizes(i)
         call print_title('a step of the clamped beam, '//trim(shown), 'ns/n')
         yardstick = cost(newmark, sys)
         call print_time('Newmark, average acceleration', yardstick)
         call print_ratio('Pade(2,2)', cost(pade_stepper(p=2, q=2), sys), yardstick, '<= 12 ns')
         call print_ratio('Pade(4,4)', cost(pade_stepper(p=4, q=4), sys), yardstick, '<= 12 ns')
         call print_ratio('Pade(4,4), product', cost(pade_stepper(p=4, q=4, form=form_product), sys), yardstick, '')
         call print_ratio('Pade(8,8)', cost(pade_stepper(p=8, q=8), sys), yardstick, '')
      end do
   end subroutine step_of_a_beam

   real(wp) function cost(method, sys)
      class(stepper_type), intent(in) :: method
      class(linear_system), intent(inout) :: sys
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      real(wp) :: start
      integer :: r, steps
      allocate (stepper, source=method)
      allocate (state%y(2*sys%n), source=0.0_wp)
      state%y(sys%n/2) = 1.0e-3_wp
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      clock = clock_type(t0=0.0_wp, h=0.5_wp/real(sys%n, wp)**2, k=0_long)
      steps = max(4, 200000/sys%n)
      call stepper%advance(sys, state, clock, 4, status, complete=.false.)
      cost = huge(1.0_wp)
      do r = 1, repeats
         start = thread_seconds()
         call stepper%advance(sys, state, clock, steps, status, complete=.false.)
         cost = min(cost, 1.0e9_wp*(thread_seconds() - start)/(real(steps, wp)*sys%n))
      end do
      if (status%failed()) print '(a)', trim(status%message)
   end function cost
end program bench_arm
