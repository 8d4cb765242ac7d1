! SPDX-License-Identifier: BSD-3-Clause
!> The rules by which Xie's runs with `ode45` chose their steps: Fehlberg's pair with local extrapolation, the first step
!> a hundredth of the interval and the longest a fifth, h' = 0.8 h (tau/err)^(1/5), tau = tol max(|y|, 1), maximum norms.
!> (The shortest step of that time, 1/20000 of the interval, is left out: the counts of the thesis need steps below it.)
module ode45_1987
   use dynstep, only: ode_system, wp
   implicit none
   private

   public :: integrate_ode45

   real(wp), parameter :: c(6) = [0.0_wp, 0.25_wp, 0.375_wp, 12.0_wp/13.0_wp, 1.0_wp, 0.5_wp]
   !> Row i has the weights of stage i
   real(wp), parameter :: a(6, 5) = reshape([ &
      & 0.0_wp, 1.0_wp/4.0_wp, 3.0_wp/32.0_wp, 1932.0_wp/2197.0_wp, 8341.0_wp/4104.0_wp, -6080.0_wp/20520.0_wp, &
      & 0.0_wp, 0.0_wp, 9.0_wp/32.0_wp, -7200.0_wp/2197.0_wp, -32832.0_wp/4104.0_wp, 41040.0_wp/20520.0_wp, &
      & 0.0_wp, 0.0_wp, 0.0_wp, 7296.0_wp/2197.0_wp, 29440.0_wp/4104.0_wp, -28352.0_wp/20520.0_wp, &
      & 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, -845.0_wp/4104.0_wp, 9295.0_wp/20520.0_wp, &
      & 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, -5643.0_wp/20520.0_wp], [6, 5])
   real(wp), parameter :: b(6) = [902880.0_wp, 0.0_wp, 3953664.0_wp, 3855735.0_wp, -1371249.0_wp, 277020.0_wp]/7618050.0_wp
   real(wp), parameter :: e(6) = [-2090.0_wp, 0.0_wp, 22528.0_wp, 21970.0_wp, -15048.0_wp, -27360.0_wp]/752400.0_wp

contains

   !> From t0 to t1
   subroutine integrate_ode45(sys, t0, t1, y0, tol, t, y, rejected, evaluations)
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t0, t1, y0(:), tol
      real(wp), allocatable, intent(out) :: t(:), y(:, :)    !! all points, the start with them
      integer, intent(out) :: rejected, evaluations
      integer, parameter :: most = 20000
      real(wp), allocatable :: points(:, :), time(:)
      real(wp) :: f(size(y0), 6), now(size(y0)), h, delta, tau
      integer :: count, ierr, j
      allocate (points(size(y0), 0:most), time(0:most))
      count = 0
      rejected = 0
      evaluations = 0
      time(0) = t0
      points(:, 0) = y0
      now = y0
      h = (t1 - t0)/100.0_wp
      do while (time(count) < t1 .and. count < most)
         if (time(count) + h > t1) h = t1 - time(count)
         do j = 1, 6
            call sys%rhs(time(count) + c(j)*h, now + h*matmul(f(:, :j - 1), a(j, :j - 1)), f(:, j), ierr)
         end do
         evaluations = evaluations + 6
         delta = h*maxval(abs(matmul(f, e)))
         tau = tol*max(maxval(abs(now)), 1.0_wp)
         if (delta <= tau) then
            now = now + h*matmul(f, b)
            time(count + 1) = time(count) + h
            count = count + 1
            points(:, count) = now
         else
            rejected = rejected + 1
         end if
         if (delta > 0.0_wp) h = min((t1 - t0)/5.0_wp, 0.8_wp*h*(tau/delta)**0.2_wp)
      end do
      t = time(:count)
      y = points(:, :count)
   end subroutine integrate_ode45
end module ode45_1987
