! SPDX-License-Identifier: BSD-3-Clause
!> Austin's algorithm for x'' + 16 x = 0 to the letter (section 6, steps [3a] to [1d]), in
!> the order of operations of step [4d].
!>
!> The paper's figures at the level of rounding errors belong to this order of operations, and
!> come out of it digit for digit.  The library works with increments and has other, not
!> larger, rounding errors.  Compile it without fused multiply-add.
module newmark_as_printed
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: printed_tableau, printed_areas

   real(wp), parameter :: m = 1.0_wp, k = 16.0_wp, gamma = 0.5_wp, dt = 0.03_wp

contains

   !> Extrapolation tableau of the first step: table(:, i, j) = [x, v] of row i, order 2j
   pure function printed_tableau(beta) result(table)
      real(wp), intent(in) :: beta
      real(wp) :: table(2, 4, 4)
      call base_step(beta, 1.0_wp, 0.0_wp, table)
   end function printed_tableau

   !> Error areas of displacement, velocity, acceleration and energy after 3000 s, all sums
   !> over the 100000 base points: of standard Newmark with 15 steps in each base step, times
   !> its own step length dt/15, and of the extrapolation, times dt
   pure subroutine printed_areas(beta, standard, extrapolated)
      real(wp), intent(in) :: beta
      real(wp), intent(out) :: standard(4), extrapolated(4)
      real(wp) :: x, v, a, table(2, 4, 4)
      integer :: q

      standard = 0.0_wp
      x = 1.0_wp
      v = 0.0_wp
      a = -k*x/m
      do q = 1, 100000
         call newmark(beta, dt/15, 15, x, v, a)
         standard = standard + errors(q*dt, x, v, a)
      end do
      standard = (dt/15)*standard

      extrapolated = 0.0_wp
      x = 1.0_wp
      v = 0.0_wp
      do q = 1, 100000
         call base_step(beta, x, v, table)
         x = table(1, 4, 4)
         v = table(2, 4, 4)
         extrapolated = extrapolated + errors(q*dt, x, v, -k*x/m)
      end do
      extrapolated = dt*extrapolated
   end subroutine printed_areas

   pure function errors(t, x, v, a)
      real(wp), intent(in) :: t, x, v, a
      real(wp) :: errors(4)
      errors(1) = abs(cos(4*t) - x)
      errors(2) = abs(-4*sin(4*t) - v)
      errors(3) = abs(-16*cos(4*t) - a)
      errors(4) = abs(8 - (0.5_wp*v**2 + 8*x**2))
   end function errors

   !> Steps [3a] to [1c]: Romberg's numbers, eq. (19)
   pure subroutine base_step(beta, x0, v0, table)
      real(wp), intent(in) :: beta, x0, v0
      real(wp), intent(out) :: table(2, 4, 4)
      real(wp) :: a
      integer :: i, j
      table = 0.0_wp
      do i = 1, 4
         table(:, i, 1) = [x0, v0]
         a = -k*x0/m
         call newmark(beta, dt/2**(i - 1), 2**(i - 1), table(1, i, 1), table(2, i, 1), a)
      end do
      do j = 2, 4
         do i = j, 4
            table(:, i, j) = (4.0_wp**(j - 1)*table(:, i, j - 1) - table(:, i - 1, j - 1))/(4.0_wp**(j - 1) - 1)
         end do
      end do
   end subroutine base_step

   !> Steps [4a] to [4e]
   pure subroutine newmark(beta, h, steps, x, v, a)
      real(wp), intent(in) :: beta, h
      integer, intent(in) :: steps
      real(wp), intent(inout) :: x, v, a
      real(wp) :: v0, a1
      integer :: i
      do i = 1, steps
         a1 = -k*(x + h*v + (h*h/2)*((1 - 2*beta)*a))/(m + beta*h*h*k)
         v0 = v
         v = v + h*((1 - gamma)*a + gamma*a1)
         x = x + h*v0 + (h*h/2)*((1 - 2*beta)*a + 2*beta*a1)
         a = a1
      end do
   end subroutine newmark
end module newmark_as_printed
