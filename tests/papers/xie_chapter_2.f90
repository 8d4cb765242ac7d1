! SPDX-License-Identifier: BSD-3-Clause
!> Figs. 2.1 to 2.6 of Xie (1995): Euler's methods, Runge-Kutta and backinterpolation on x' = a x and on x" + w^2 x = 0.
!> The figures are curves; what can be told from them in numbers is checked.
program xie_chapter_2
   use dynstep, only: backinterpolation_stepper, clock_type, dense_matrix, linear_ode, rational_type, state_type, status_type, &
      & taylor_rational, wp
   use paper_table, only: paper_table_type, xie_1995
   implicit none

   type(paper_table_type) :: table
   type(status_type) :: status

   call table%open_figure(xie_1995, 'Figs. 2.1-2.6', 'stability of simple methods')
   call table%section('Figs. 2.1, 2.2: |R| = 1 of Euler''s methods on circles of radius 1 about -1 and 1')
   call table%holds('forward, at -1 + exp(2i)', modulus(1, 0, 1.0_wp, (-1.0_wp, 0.0_wp) + point(2.0_wp)), 1.0_wp, 4.0e-16_wp)
   call table%holds('backward, at 1 + exp(2i)', modulus(0, 1, 0.0_wp, (1.0_wp, 0.0_wp) + point(2.0_wp)), 1.0_wp, 4.0e-16_wp)
   call table%section('Figs. 2.3, 2.4: a = -5, factor of a step')
   call table%holds('forward, h = 0.05', growth(1, 0, 1.0_wp, 0.05_wp), 0.75_wp, 1.0e-15_wp)
   call table%holds('forward, h = 0.5: grows', growth(1, 0, 1.0_wp, 0.5_wp), 1.5_wp, 1.0e-15_wp)
   call table%holds('backward, h = 0.5: decays', growth(0, 1, 0.0_wp, 0.5_wp), 1.0_wp/3.5_wp, 1.0e-15_wp)
   call table%section('Fig. 2.5: w = 10, h = 0.01, growth of the amplitude in a step')
   call table%holds('F_4 forward', modulus(4, 0, 1.0_wp, (0.0_wp, 0.1_wp)) - 1.0_wp, -6.9358e-9_wp, 1.0e-12_wp, &
      & 'the figure shows growth, which is that of Euler''s method, 0.5 % a step')
   call table%holds('F_1 forward', modulus(1, 0, 1.0_wp, (0.0_wp, 0.1_wp)) - 1.0_wp, sqrt(1.01_wp) - 1.0_wp, 1.0e-15_wp)
   call table%section('Fig. 2.6: alpha = 1/2, h = 0.05, amplitude after 1000 steps - 1, and lag in a step')
   call table%holds('F_1', amplitude(1) - 1.0_wp, 0.0_wp, 1.0e-12_wp)
   call table%holds('F_4', amplitude(4) - 1.0_wp, 0.0_wp, 1.0e-12_wp)
   call table%holds('F_1, lag', lag(1), 0.5_wp - 2.0_wp*atan(0.25_wp), 1.0e-15_wp)
   ! R = e^z (1 - z^5/1920 + O(z^7)), see docs/theory/backinterpolation.md; the next term is 2 % at z = i/2
   call table%holds('F_4, lag', lag(4), 0.5_wp**5/1920.0_wp, 0.03_wp*0.5_wp**5/1920.0_wp)
   call table%close()

contains

   pure complex(wp) function point(angle)
      real(wp), intent(in) :: angle
      point = cmplx(cos(angle), sin(angle), wp)
   end function point

   real(wp) function modulus(p, q, alpha, z)
      integer, intent(in) :: p, q
      real(wp), intent(in) :: alpha
      complex(wp), intent(in) :: z
      type(rational_type) :: r
      call taylor_rational(p, q, alpha, r, status)
      modulus = abs(r%value(z))
   end function modulus

   !> |x(t + h)/x(t)| of x' = -5 x by the stepper
   real(wp) function growth(p, q, alpha, h)
      integer, intent(in) :: p, q
      real(wp), intent(in) :: alpha, h
      type(linear_ode) :: sys
      type(state_type) :: state
      type(clock_type) :: clock
      type(backinterpolation_stepper) :: stepper
      call sys%set(dense_matrix(reshape([-5.0_wp], [1, 1])), status)
      stepper%p = p
      stepper%q = q
      stepper%alpha = alpha
      state%y = [1.0_wp]
      clock%h = h
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call stepper%advance(sys, state, clock, 20, status, complete=.false.)
      growth = abs(state%y(1))**(1.0_wp/20.0_wp)
      if (status%failed()) print '(a)', trim(status%message)
   end function growth

   !> Of x" + 100 x = 0 from (1, 0) after 1000 steps of 0.05
   real(wp) function amplitude(p)
      integer, intent(in) :: p
      type(linear_ode) :: sys
      type(state_type) :: state
      type(clock_type) :: clock
      type(backinterpolation_stepper) :: stepper
      call sys%set(dense_matrix(reshape([0.0_wp, -100.0_wp, 1.0_wp, 0.0_wp], [2, 2])), status)
      stepper%p = p
      stepper%q = p
      state%y = [1.0_wp, 0.0_wp]
      clock%h = 0.05_wp
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call stepper%advance(sys, state, clock, 1000, status, complete=.false.)
      amplitude = hypot(state%y(1), state%y(2)/10.0_wp)
   end function amplitude

   !> Phase that a step of h w = 1/2 lacks
   real(wp) function lag(p)
      integer, intent(in) :: p
      type(rational_type) :: r
      complex(wp) :: turn
      call taylor_rational(p, p, 0.5_wp, r, status)
      turn = r%value((0.0_wp, 0.5_wp))
      lag = 0.5_wp - atan2(aimag(turn), real(turn, wp))
   end function lag
end program xie_chapter_2
