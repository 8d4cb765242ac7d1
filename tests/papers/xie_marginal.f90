! SPDX-License-Identifier: BSD-3-Clause
!> Figs. 3.23 to 3.27 of Xie (1995): steps and largest errors on the marginal problem x = (2 sin 2t, cos t) over [0, 10].
!> The figures have curves alone; the numbers beside them are those of an independent study of the listings.  Its counts come
!> out exactly.  Its errors of backinterpolation are 0.3 to 0.9 of those here, at the same steps; these are checked
!> against the composition of R(2i h) over the steps, which they have to be.
program xie_marginal
   use backinterpolation_runs, only: integrate_backinterpolation
   use dynstep, only: controller_pi, controller_standard, fehlberg_rational, marginal_problem, rational_type, safety_inside, &
      & status_type, step_control_type, step_counters, trajectory_type, wp
   use ode45_1987, only: integrate_ode45
   use paper_table, only: paper_table_type, xie_1995
   implicit none

   real(wp), parameter :: tolerances(5) = [1.0e-2_wp, 1.0e-4_wp, 1.0e-6_wp, 1.0e-7_wp, 1.0e-8_wp]
   character(len=5), parameter :: names(5) = [character(len=5) :: '1e-2', '1e-4', '1e-6', '1e-7', '1e-8']
   real(wp), parameter :: alphas(3) = [0.1_wp, 0.4_wp, 0.5_wp]
   !> Accepted steps and errors of the reference: ode45, then standard with alpha 0.1, 0.4, 0.5, then PI with 0.4, 0.5
   integer, parameter :: steps(5, 6) = reshape([19, 42, 103, 163, 257, 18, 38, 92, 145, 230, 17, 26, 61, 95, 149, &
      & 17, 22, 47, 68, 99, 18, 25, 54, 83, 128, 18, 21, 42, 60, 87], [5, 6])
   real(wp), parameter :: errors(5, 6) = reshape([ &
      & 9.2e-2_wp, 1.0e-3_wp, 1.0e-5_wp, 1.0e-6_wp, 1.1e-7_wp, 2.0e-2_wp, 7.9e-4_wp, 9.2e-6_wp, 9.5e-7_wp, 9.4e-8_wp, &
      & 2.6e-3_wp, 4.9e-4_wp, 6.3e-6_wp, 6.5e-7_wp, 6.6e-8_wp, 4.2e-4_wp, 8.7e-5_wp, 9.3e-7_wp, 9.3e-8_wp, 8.8e-9_wp, &
      & 2.8e-3_wp, 6.3e-4_wp, 1.1e-5_wp, 1.2e-6_wp, 1.4e-7_wp, 4.7e-4_wp, 1.6e-4_wp, 1.8e-6_wp, 1.9e-7_wp, 1.9e-8_wp], [5, 6])

   type(marginal_problem) :: sys
   type(paper_table_type) :: table
   type(status_type) :: status
   real(wp) :: y0(4)
   integer :: i, j

   call sys%setup(status)
   call sys%start(y0)
   call table%open_figure(xie_1995, 'Figs. 3.23-3.27', 'steps and largest errors, marginal problem')
   do i = 1, 5
      call table%section('tol = '//names(i))
      call by_ode45(tolerances(i), steps(i, 1), errors(i, 1))
      do j = 1, 3
         call by_bi('standard', controller_standard, alphas(j), tolerances(i), steps(i, 1 + j), errors(i, 1 + j))
      end do
      do j = 2, 3
         call by_bi('PI', controller_pi, alphas(j), tolerances(i), steps(i, 3 + j), errors(i, 3 + j))
      end do
   end do
   call table%close()

contains

   subroutine by_ode45(tol, expected_steps, expected_error)
      real(wp), intent(in) :: tol, expected_error
      integer, intent(in) :: expected_steps
      real(wp), allocatable :: t(:), y(:, :)
      integer :: rejected, evaluations
      call integrate_ode45(sys, 0.0_wp, 10.0_wp, y0, tol, t, y, rejected, evaluations)
      call table%holds('ode45, points', real(size(t), wp), real(expected_steps, wp), 0.5_wp)
      ! the reference has two digits
      call table%holds('ode45, error', largest_error(t, y), expected_error, 0.06_wp*expected_error)
   end subroutine by_ode45

   subroutine by_bi(name, controller, alpha, tol, expected_steps, expected_error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: controller
      real(wp), intent(in) :: alpha, tol, expected_error
      integer, intent(in) :: expected_steps
      type(step_control_type) :: control
      type(trajectory_type) :: points
      type(step_counters) :: count
      character(len=3) :: shown
      character(len=8) :: study
      control%tolerance = tol
      control%controller = controller
      control%safety_place = safety_inside
      call integrate_backinterpolation(sys, 0.0_wp, 10.0_wp, y0, alpha, control, points, count, status)
      if (status%failed()) print '(a)', trim(status%message)
      write (shown, '(f3.1)') alpha
      call table%holds(name//', alpha = '//shown//', steps', real(count%steps, wp), real(expected_steps, wp), &
         & max(1.0_wp, 0.05_wp*expected_steps))
      associate (t => points%t(:points%count), y => points%y(:, :points%count))
         write (study, '(es8.1)') expected_error
         call table%holds(name//', alpha = '//shown//', error', largest_error(t, y), composed_error(t, alpha), &
            & 1.0e-4_wp*composed_error(t, alpha), 'the study has '//study)
      end associate
   end subroutine by_bi

   !> The same error without the stepper: x3 - 1 + i x1/2 turns by R(2i h) in each step
   real(wp) function composed_error(t, alpha)
      real(wp), intent(in) :: t(:), alpha
      type(rational_type) :: r
      complex(wp) :: w
      integer :: k
      call fehlberg_rational(alpha, r, status)
      w = (1.0_wp, 0.0_wp)
      composed_error = 0.0_wp
      do k = 2, size(t)
         w = w*r%value(cmplx(0.0_wp, 2.0_wp*(t(k) - t(k - 1)), wp))
         composed_error = max(composed_error, abs(2.0_wp*aimag(w) - 2.0_wp*sin(2.0_wp*t(k))))
      end do
   end function composed_error

   !> Of x1 and x2, over all points
   real(wp) function largest_error(t, y)
      real(wp), intent(in) :: t(:), y(:, :)
      real(wp) :: exact(4)
      integer :: k
      largest_error = 0.0_wp
      do k = 1, size(t)
         call sys%exact(t(k), y0, exact)
         largest_error = max(largest_error, maxval(abs(y(:2, k) - exact(:2))))
      end do
   end function largest_error
end program xie_marginal
