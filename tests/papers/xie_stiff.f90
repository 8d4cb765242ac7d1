! SPDX-License-Identifier: BSD-3-Clause
!> Figs. 3.28 to 3.32 of Xie (1995): steps and largest errors on the stiff problem of third order, poles -100 and -1 +- i/2,
!> over [0, 10].  The thesis does not tell the start; (1, 0, 0) is taken, as in the independent study that the numbers
!> come from.
program xie_stiff
   use backinterpolation_runs, only: integrate_backinterpolation
   use dynstep, only: status_type, step_control_type, step_counters, stiff_third_order, trajectory_type, wp
   use ode45_1987, only: integrate_ode45
   use paper_table, only: paper_table_type, xie_1995
   implicit none

   real(wp), parameter :: tolerances(5) = [1.0e-2_wp, 1.0e-4_wp, 1.0e-6_wp, 1.0e-7_wp, 1.0e-8_wp]
   character(len=5), parameter :: names(5) = [character(len=5) :: '1e-2', '1e-4', '1e-6', '1e-7', '1e-8']
   integer, parameter :: ode45_steps(5) = [276, 282, 300, 315, 341], bi_steps(5) = [26, 28, 35, 45, 64]
   real(wp), parameter :: ode45_errors(3) = [1.2e-10_wp, 2.1e-9_wp, 2.1e-7_wp], bi_errors(3) = [7.1e-8_wp, 1.0e-7_wp, 4.0e-7_wp]
   real(wp), parameter :: y0(3) = [1.0_wp, 0.0_wp, 0.0_wp]
   character(len=3), parameter :: components(3) = ['y  ', 'y'' ', 'y" ']

   type(stiff_third_order) :: sys
   type(paper_table_type) :: table
   type(status_type) :: status
   type(step_control_type) :: control
   type(trajectory_type) :: points
   type(step_counters) :: count
   real(wp), allocatable :: t(:), y(:, :)
   real(wp) :: errors(3)
   integer :: i, k, rejected, evaluations

   call sys%setup(status)
   call table%open_figure(xie_1995, 'Figs. 3.28-3.32', 'steps and largest errors, stiff problem')
   do i = 1, 5
      call table%section('tol = '//names(i))
      call integrate_ode45(sys, 0.0_wp, 10.0_wp, y0, tolerances(i), t, y, rejected, evaluations)
      call table%holds('ode45, points', real(size(t), wp), real(ode45_steps(i), wp), 0.5_wp)
      if (i == 3) then
         errors = largest_errors(t, y)
         do k = 1, 3
            call table%holds('ode45, error of '//components(k), errors(k), ode45_errors(k), 0.06_wp*ode45_errors(k))
         end do
      end if
      control%tolerance = tolerances(i)
      call integrate_backinterpolation(sys, 0.0_wp, 10.0_wp, y0, 0.47_wp, control, points, count, status)
      if (status%failed()) print '(a)', trim(status%message)
      call table%holds('backinterpolation, alpha = 0.47, steps', real(count%steps, wp), real(bi_steps(i), wp), &
         & merge(4.0_wp, 0.05_wp*bi_steps(i), i < 3), 'errors of the inner iteration add to the estimate; here there are none')
      if (i == 3) then
         errors = largest_errors(points%t(:points%count), points%y(:, :points%count))
         do k = 1, 3
            call table%holds('backinterpolation, error of '//components(k), errors(k), bi_errors(k), 0.7_wp*bi_errors(k), &
               & 'the step sequence of the study is another one')
         end do
      end if
   end do
   call table%close()

contains

   function largest_errors(t, y) result(largest)
      real(wp), intent(in) :: t(:), y(:, :)
      real(wp) :: largest(3), exact(3)
      integer :: k
      largest = 0.0_wp
      do k = 1, size(t)
         call sys%exact(t(k), y0, exact)
         largest = max(largest, abs(y(:, k) - exact))
      end do
   end function largest_errors
end program xie_stiff
