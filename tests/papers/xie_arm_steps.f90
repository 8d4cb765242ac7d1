! SPDX-License-Identifier: BSD-3-Clause
!> Tables 1 and 2 of Xie (1995) and the counts of sections 4.5 and 5.5: steps for the flexible arm, open loop to t = 2 and
!> closed loop, tol = 1e-6.
program xie_arm_steps
   use backinterpolation_runs, only: integrate_backinterpolation
   use dynstep, only: arm_consistent, arm_listing, clock_type, controller_pi, controller_standard, flexible_arm, &
      & input_none, input_pulse, input_ramp, input_step, pade_stepper, safety_inside, state_type, status_type, step_control_type, &
      & step_counters, trajectory_type, wp
   use ode45_1987, only: integrate_ode45
   use paper_table, only: paper_table_type, xie_1995
   implicit none

   integer, parameter :: inputs(3) = [input_pulse, input_step, input_ramp]
   character(len=5), parameter :: names(3) = ['pulse', 'step ', 'ramp ']
   character(len=3), parameter :: printed_ode45(3) = ['358', '338', '125'], printed_bi(3) = ['151', '112', '39 ']
   character(len=3), parameter :: timoshenko_ode45(3) = ['342', '313', '195']
   integer, parameter :: consistent(3) = [336, 324, 123]
   !> Backinterpolation with alpha = 1/2 on the listing's arm by the reference: PI, PI with the true sign, standard
   integer, parameter :: pi_steps(3) = [180, 166, 57], signed_steps(3) = [156, 128, 59], standard_steps(3) = [199, 189, 70]
   integer, parameter :: timoshenko_10(3) = [738, 695, 272], timoshenko_5(3) = [523, 483, 198]

   type(paper_table_type) :: table
   integer :: i

   call table%open(xie_1995, 'Table 1', 'steps, open loop, n = 10')
   call table%section('Euler-Bernoulli with the listing''s K')
   do i = 1, 3
      call table%agrees('ode45, '//names(i), printed_ode45(i), ode45_steps(arm(10, 1, arm_listing, inputs(i)), 2.0_wp), &
         & accept=0.5_wp)
   end do
   do i = 1, 3
      call table%explained('BI55, '//names(i), printed_bi(i), shown(signed_steps(i)), &
         & bi_steps(arm(10, 1, arm_listing, inputs(i)), 2.0_wp, 0.5_wp, controller_pi, .true.), accept=0.1_wp*signed_steps(i), &
         & reason='bi55 is not listed; RKF45 both ways with the true sign of the estimate gives '//shown(signed_steps(i)))
      call table%holds('  with the listing''s sign', bi_steps(arm(10, 1, arm_listing, inputs(i)), 2.0_wp, 0.5_wp, controller_pi, &
         & .false.), real(pi_steps(i), wp), 0.05_wp*pi_steps(i))
      call table%holds('  with standard control', bi_steps(arm(10, 1, arm_listing, inputs(i)), 2.0_wp, 0.5_wp, &
         & controller_standard, .false.), real(standard_steps(i), wp), 0.05_wp*standard_steps(i))
   end do
   call table%section('Euler-Bernoulli, consistent')
   do i = 1, 3
      call table%holds('ode45, '//names(i), ode45_steps(arm(10, 1, arm_consistent, inputs(i)), 2.0_wp), &
         & real(consistent(i), wp), 0.5_wp)
   end do
   call table%section('Hub angle at t = 2 under a step of 0.1')
   call table%holds('consistent', hub_angle(arm_consistent), 0.655736783452_wp, 1.0e-11_wp)
   call table%holds('listing', hub_angle(arm_listing), 0.049911371219_wp, 1.0e-11_wp, &
      & 'the lost sign of the listing pins the tip: figs. 4.2 to 4.5 show another arm')
   call table%close()

   call table%open(xie_1995, 'Table 2', 'steps, open loop, Timoshenko')
   do i = 1, 3
      call table%explained('ode45, n = 10, '//names(i), timoshenko_ode45(i), shown(timoshenko_10(i)), &
         & ode45_steps(arm(10, 2, arm_consistent, inputs(i)), 2.0_wp), accept=0.5_wp, &
         & reason='the printed arm is not that of (5.12) to (5.18): its poles imply another stiffness')
      call table%holds('ode45, n = 5, '//names(i), ode45_steps(arm(5, 2, arm_consistent, inputs(i)), 2.0_wp), &
         & real(timoshenko_5(i), wp), 0.5_wp)
   end do
   call table%section('Closed loop to t = 5: steps of ode45 and of backinterpolation, alpha = 0.47')
   call closed_loop('Euler-Bernoulli, listing, n = 10', arm(10, 1, arm_listing, input_none), 4242, 2053)
   call closed_loop('Euler-Bernoulli, listing, n = 5', arm(5, 1, arm_listing, input_none), 1204, 592)
   call closed_loop('Euler-Bernoulli, consistent, n = 10', arm(10, 1, arm_consistent, input_none), 1575, 830)
   call closed_loop('Timoshenko, n = 5', arm(5, 2, arm_consistent, input_none), 2218, 1115)
   print '(a)', '  printed: 1367 and 853 (Euler-Bernoulli), 1273 and 784 (Timoshenko); final time and number of elements are', &
      & '  not told, and no choice of them gives these; their ratio of 0.6 is that of all the rows'
   call table%close()

contains

   pure function shown(count) result(words)
      integer, intent(in) :: count
      character(len=4) :: words
      write (words, '(i0)') count
   end function shown

   function arm(segments, beam, variant, input) result(sys)
      integer, intent(in) :: segments, beam, variant, input
      type(flexible_arm) :: sys
      type(status_type) :: status
      sys%beam = beam
      sys%variant = variant
      call sys%setup(segments, status)
      call sys%set_input(input, status)
      if (status%failed()) print '(a)', trim(status%message)
   end function arm

   !> Points, the start with them, as the thesis counts
   real(wp) function ode45_steps(sys, t_end, y0)
      type(flexible_arm), intent(in) :: sys
      real(wp), intent(in) :: t_end
      real(wp), intent(in), optional :: y0(:)
      type(flexible_arm) :: own
      real(wp), allocatable :: t(:), y(:, :)
      real(wp) :: start(2*sys%n)
      integer :: rejected, evaluations
      own = sys
      start = 0.0_wp
      if (present(y0)) start = y0
      call integrate_ode45(own, 0.0_wp, t_end, start, 1.0e-6_wp, t, y, rejected, evaluations)
      ode45_steps = real(size(t), wp)
   end function ode45_steps

   real(wp) function bi_steps(sys, t_end, alpha, controller, true_sign, y0)
      type(flexible_arm), intent(in) :: sys
      real(wp), intent(in) :: t_end, alpha
      integer, intent(in) :: controller
      logical, intent(in) :: true_sign
      real(wp), intent(in), optional :: y0(:)
      type(step_control_type) :: control
      type(trajectory_type) :: points
      type(step_counters) :: count
      type(status_type) :: status
      real(wp) :: start(2*sys%n)
      start = 0.0_wp
      if (present(y0)) start = y0
      control%tolerance = 1.0e-6_wp
      control%controller = controller
      control%safety_place = safety_inside
      call integrate_backinterpolation(sys, 0.0_wp, t_end, start, alpha, control, points, count, status, true_sign)
      if (status%failed()) print '(a)', trim(status%message)
      bi_steps = real(count%steps, wp)
   end function bi_steps

   subroutine closed_loop(name, sys, ode45, bi)
      character(len=*), intent(in) :: name
      type(flexible_arm), intent(in) :: sys
      integer, intent(in) :: ode45, bi
      type(flexible_arm) :: closed
      type(status_type) :: status
      real(wp) :: y0(2*sys%n)
      closed = sys
      call closed%close_loop(status)
      y0 = 0.0_wp
      call closed%straight(acos(-1.0_wp)/2.0_wp, y0(:sys%n))
      call table%holds(name//', ode45', ode45_steps(closed, 5.0_wp, y0), real(ode45, wp), 0.01_wp*ode45)
      call table%holds(name//', BI', bi_steps(closed, 5.0_wp, 0.47_wp, controller_standard, .false., y0), real(bi, wp), &
         & 0.05_wp*bi)
   end subroutine closed_loop

   real(wp) function hub_angle(variant)
      integer, intent(in) :: variant
      type(flexible_arm) :: sys
      type(pade_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      integer, parameter :: steps = 400
      sys = arm(10, 1, variant, input_step)
      allocate (state%y(2*sys%n), source=0.0_wp)
      clock%h = 2.0_wp/steps
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call stepper%advance(sys, state, clock, steps, status, complete=.false.)
      hub_angle = sys%hub_angle(state%y(:sys%n))
   end function hub_angle
end program xie_arm_steps
