! SPDX-License-Identifier: BSD-3-Clause
!> Figs. 3.33 and 3.34 of Xie (1995), Lotka and Volterra's equations: the solution by an independent study, steps and
!> errors of backinterpolation, and the orders of compositions of Runge-Kutta half-steps, which section 2.5 of the thesis
!> says do not rise above those of the halves.
program xie_lotka_volterra
   use backinterpolation_runs, only: integrate_backinterpolation
   use dynstep, only: backinterpolation_stepper, clock_type, lotka_volterra, state_type, status_type, step_control_type, &
      & step_counters, trajectory_type, wp
   use paper_table, only: paper_table_type, xie_1995
   implicit none

   !> From (10, 10) at t = 10 and 30, and from (2, 3) at t = 1
   real(wp), parameter :: at_10(2) = [0.0007104218221780829_wp, 3.259057322389767_wp]
   real(wp), parameter :: at_30(2) = [1.566578777209137_wp, 0.005109599795990055_wp]
   real(wp), parameter :: at_1(2) = [0.9221571071139199211_wp, 2.0045290693667698567_wp]
   !> Orders at alpha = 1/2: the composition is symmetric, so its order is even
   integer, parameter :: orders(5) = [2, 2, 4, 4, 6]

   type(lotka_volterra) :: sys
   type(paper_table_type) :: table
   type(status_type) :: status
   type(step_control_type) :: control
   type(trajectory_type) :: points
   type(step_counters) :: count
   character(len=1) :: shown
   integer :: p

   call sys%setup()
   call table%open_figure(xie_1995, 'Figs. 3.33-3.34', 'Lotka-Volterra, k = 0.1')
   call table%section('From (10, 10), alpha = 0.4, standard control')
   control%tolerance = 1.0e-6_wp
   call integrate_backinterpolation(sys, 0.0_wp, 10.0_wp, [10.0_wp, 10.0_wp], 0.4_wp, control, points, count, status)
   call table%holds('steps to t = 10, tol = 1e-6', real(count%steps, wp), 35.0_wp, 1.75_wp)
   call table%holds('predators at t = 10', points%y(1, points%count), at_10(1), 1.0e-5_wp)
   call table%holds('prey at t = 10', points%y(2, points%count), at_10(2), 1.0e-4_wp)
   call integrate_backinterpolation(sys, 0.0_wp, 30.0_wp, [10.0_wp, 10.0_wp], 0.4_wp, control, points, count, status)
   call table%holds('steps to t = 30, tol = 1e-6', real(count%steps, wp), 133.0_wp, 6.65_wp)
   call table%holds('predators at t = 30', points%y(1, points%count), at_30(1), 1.0e-3_wp)
   control%tolerance = 1.0e-4_wp
   call integrate_backinterpolation(sys, 0.0_wp, 30.0_wp, [10.0_wp, 10.0_wp], 0.4_wp, control, points, count, status)
   call table%holds('tol = 1e-4 reaches t = 30', points%t(points%count), 30.0_wp, 0.0_wp, &
      & 'the listing fails at t = 12.5: it does not shorten a step whose iteration fails')
   call table%section('Order of p-th order half-steps, from (2, 3) to t = 1')
   do p = 1, 5
      write (shown, '(i1)') p
      call table%holds('alpha = 0.3, p = '//shown, order(p, 0.3_wp), real(p, wp), 0.15_wp)
      call table%holds('alpha = 1/2, p = '//shown, order(p, 0.5_wp), real(orders(p), wp), 0.15_wp, &
         & 'the thesis: "no value of alpha will raise the order", but for p = 1')
   end do
   call table%close()

contains

   !> From the errors of two step lengths above round-off
   real(wp) function order(p, alpha)
      integer, intent(in) :: p
      real(wp), intent(in) :: alpha
      integer, parameter :: coarse(5) = [512, 256, 64, 32, 16]
      order = log(error_of(p, alpha, coarse(p))/error_of(p, alpha, 2*coarse(p)))/log(2.0_wp)
   end function order

   real(wp) function error_of(p, alpha, steps)
      integer, intent(in) :: p, steps
      real(wp), intent(in) :: alpha
      type(backinterpolation_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      stepper%p = p
      stepper%q = p
      stepper%alpha = alpha
      allocate (state%y(2), source=[2.0_wp, 3.0_wp])
      clock%h = 1.0_wp/steps
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call stepper%advance(sys, state, clock, steps, status, complete=.false.)
      error_of = maxval(abs(state%y - at_1))
      if (status%failed()) error_of = huge(1.0_wp)
   end function error_of
end program xie_lotka_volterra
