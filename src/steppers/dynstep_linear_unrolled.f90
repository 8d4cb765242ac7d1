! SPDX-License-Identifier: BSD-3-Clause
!> Newmark steps of one to four linear equations, in registers.
!>
!> Increment form of dynstep_newmark_form, written out for dv/2; sums are paired so that the
!> chain of dependent operations is short.  Vectors of two or four numbers would have to be taken apart
!> for each product, so the loops are kept scalar.
module dynstep_linear_unrolled
   use dynstep_kinds, only: wp
   use dynstep_newmark_form, only: newmark_form
   implicit none
   private

   public :: advance_unrolled, predicted_1

   integer, parameter, public :: tiny_order = 8   !! order of the arrays that hold small matrices

contains

   !> `steps` steps in place, n <= 4
   pure subroutine advance_unrolled(n, h, steps, loaded, p, damped, c, k, s, q, v)
      integer, intent(in) :: n
      real(wp), intent(in) :: h
      integer, intent(in) :: steps
      logical, intent(in) :: loaded, damped                     !! p, c is read
      real(wp), intent(in) :: p(n, 0:*)                         !! loads at the begin of each step and the end
      real(wp), intent(in), dimension(tiny_order, tiny_order) :: c, k, s      !! s = -h/2 S^-1
      real(wp), intent(inout) :: q(n), v(n)
      select case (n)
      case (1)
         call increment_1(h, steps, loaded, p, damped, c(1, 1), k(1, 1), s(1, 1), q(1), v(1))
      case (2)
         call increment_2(h, steps, loaded, p, damped, c, k, s, q, v)
      case (3)
         call increment_3(h, steps, loaded, p, damped, c, k, s, q, v)
      case (4)
         call increment_4(h, steps, loaded, p, damped, c, k, s, q, v)
      end select
   end subroutine advance_unrolled

   pure subroutine increment_1(h, steps, loaded, p, damped, c, k, s, q, v)
      real(wp), intent(in) :: h
      integer, intent(in) :: steps
      logical, intent(in) :: loaded, damped
      real(wp), intent(in) :: p(0:*)
      real(wp), intent(in) :: c, k, s              !! s = -h/2 S^-1
      real(wp), intent(inout) :: q, v
      real(wp) :: q1, v1, dv, half, sk
      integer :: i

      half = 0.5_wp*h
      q1 = q
      v1 = v
      if (loaded) then
         do i = 1, steps
            dv = s*((c*v1 - 0.5_wp*(p(i - 1) + p(i))) + k*(q1 + half*v1))
            q1 = q1 + h*(v1 + dv)
            v1 = v1 + (dv + dv)
         end do
      else if (damped) then
         do i = 1, steps
            dv = s*(c*v1 + k*(q1 + half*v1))
            q1 = q1 + h*(v1 + dv)
            v1 = v1 + (dv + dv)
         end do
      else
         sk = s*k
         do i = 1, steps
            dv = sk*(q1 + half*v1)
            q1 = q1 + h*(v1 + dv)
            v1 = v1 + (dv + dv)
         end do
      end if
      q = q1
      v = v1
   end subroutine increment_1

   pure subroutine increment_2(h, steps, loaded, p, damped, c, k, s, q, v)
      real(wp), intent(in) :: h
      integer, intent(in) :: steps
      logical, intent(in) :: loaded, damped
      real(wp), intent(in) :: p(2, 0:*)
      real(wp), intent(in), dimension(tiny_order, 2) :: c, k, s     !! s = -h/2 S^-1
      real(wp), intent(inout) :: q(2), v(2)
      real(wp) :: q1, q2, v1, v2, r1, r2, x1, x2, half
      integer :: i

      half = 0.5_wp*h
      q1 = q(1)
      q2 = q(2)
      v1 = v(1)
      v2 = v(2)
!GCC$ novector
      do i = 1, steps
         x1 = q1 + half*v1
         x2 = q2 + half*v2
         r1 = k(1, 1)*x1 + k(1, 2)*x2
         r2 = k(2, 1)*x1 + k(2, 2)*x2
         if (damped) then
            r1 = r1 + (c(1, 1)*v1 + c(1, 2)*v2)
            r2 = r2 + (c(2, 1)*v1 + c(2, 2)*v2)
         end if
         if (loaded) then
            r1 = r1 - 0.5_wp*(p(1, i - 1) + p(1, i))
            r2 = r2 - 0.5_wp*(p(2, i - 1) + p(2, i))
         end if
         x1 = s(1, 1)*r1 + s(1, 2)*r2
         x2 = s(2, 1)*r1 + s(2, 2)*r2
         q1 = q1 + h*(v1 + x1)
         q2 = q2 + h*(v2 + x2)
         v1 = v1 + (x1 + x1)
         v2 = v2 + (x2 + x2)
      end do
      q(1) = q1
      q(2) = q2
      v(1) = v1
      v(2) = v2
   end subroutine increment_2

   pure subroutine increment_3(h, steps, loaded, p, damped, c, k, s, q, v)
      real(wp), intent(in) :: h
      integer, intent(in) :: steps
      logical, intent(in) :: loaded, damped
      real(wp), intent(in) :: p(3, 0:*)
      real(wp), intent(in), dimension(tiny_order, 3) :: c, k, s     !! s = -h/2 S^-1
      real(wp), intent(inout) :: q(3), v(3)
      real(wp) :: q1, q2, q3, v1, v2, v3, r1, r2, r3, x1, x2, x3, half
      integer :: i

      half = 0.5_wp*h
      q1 = q(1)
      q2 = q(2)
      q3 = q(3)
      v1 = v(1)
      v2 = v(2)
      v3 = v(3)
!GCC$ novector
      do i = 1, steps
         x1 = q1 + half*v1
         x2 = q2 + half*v2
         x3 = q3 + half*v3
         r1 = (k(1, 1)*x1 + k(1, 2)*x2) + k(1, 3)*x3
         r2 = (k(2, 1)*x1 + k(2, 2)*x2) + k(2, 3)*x3
         r3 = (k(3, 1)*x1 + k(3, 2)*x2) + k(3, 3)*x3
         if (damped) then
            r1 = r1 + ((c(1, 1)*v1 + c(1, 2)*v2) + c(1, 3)*v3)
            r2 = r2 + ((c(2, 1)*v1 + c(2, 2)*v2) + c(2, 3)*v3)
            r3 = r3 + ((c(3, 1)*v1 + c(3, 2)*v2) + c(3, 3)*v3)
         end if
         if (loaded) then
            r1 = r1 - 0.5_wp*(p(1, i - 1) + p(1, i))
            r2 = r2 - 0.5_wp*(p(2, i - 1) + p(2, i))
            r3 = r3 - 0.5_wp*(p(3, i - 1) + p(3, i))
         end if
         x1 = (s(1, 1)*r1 + s(1, 2)*r2) + s(1, 3)*r3
         x2 = (s(2, 1)*r1 + s(2, 2)*r2) + s(2, 3)*r3
         x3 = (s(3, 1)*r1 + s(3, 2)*r2) + s(3, 3)*r3
         q1 = q1 + h*(v1 + x1)
         q2 = q2 + h*(v2 + x2)
         q3 = q3 + h*(v3 + x3)
         v1 = v1 + (x1 + x1)
         v2 = v2 + (x2 + x2)
         v3 = v3 + (x3 + x3)
      end do
      q(1) = q1
      q(2) = q2
      q(3) = q3
      v(1) = v1
      v(2) = v2
      v(3) = v3
   end subroutine increment_3

   pure subroutine increment_4(h, steps, loaded, p, damped, c, k, s, q, v)
      real(wp), intent(in) :: h
      integer, intent(in) :: steps
      logical, intent(in) :: loaded, damped
      real(wp), intent(in) :: p(4, 0:*)
      real(wp), intent(in), dimension(tiny_order, 4) :: c, k, s     !! s = -h/2 S^-1
      real(wp), intent(inout) :: q(4), v(4)
      real(wp) :: q1, q2, q3, q4, v1, v2, v3, v4, r1, r2, r3, r4, x1, x2, x3, x4, half
      integer :: i

      half = 0.5_wp*h
      q1 = q(1)
      q2 = q(2)
      q3 = q(3)
      q4 = q(4)
      v1 = v(1)
      v2 = v(2)
      v3 = v(3)
      v4 = v(4)
!GCC$ novector
      do i = 1, steps
         x1 = q1 + half*v1
         x2 = q2 + half*v2
         x3 = q3 + half*v3
         x4 = q4 + half*v4
         r1 = (k(1, 1)*x1 + k(1, 2)*x2) + (k(1, 3)*x3 + k(1, 4)*x4)
         r2 = (k(2, 1)*x1 + k(2, 2)*x2) + (k(2, 3)*x3 + k(2, 4)*x4)
         r3 = (k(3, 1)*x1 + k(3, 2)*x2) + (k(3, 3)*x3 + k(3, 4)*x4)
         r4 = (k(4, 1)*x1 + k(4, 2)*x2) + (k(4, 3)*x3 + k(4, 4)*x4)
         if (damped) then
            r1 = r1 + ((c(1, 1)*v1 + c(1, 2)*v2) + (c(1, 3)*v3 + c(1, 4)*v4))
            r2 = r2 + ((c(2, 1)*v1 + c(2, 2)*v2) + (c(2, 3)*v3 + c(2, 4)*v4))
            r3 = r3 + ((c(3, 1)*v1 + c(3, 2)*v2) + (c(3, 3)*v3 + c(3, 4)*v4))
            r4 = r4 + ((c(4, 1)*v1 + c(4, 2)*v2) + (c(4, 3)*v3 + c(4, 4)*v4))
         end if
         if (loaded) then
            r1 = r1 - 0.5_wp*(p(1, i - 1) + p(1, i))
            r2 = r2 - 0.5_wp*(p(2, i - 1) + p(2, i))
            r3 = r3 - 0.5_wp*(p(3, i - 1) + p(3, i))
            r4 = r4 - 0.5_wp*(p(4, i - 1) + p(4, i))
         end if
         x1 = (s(1, 1)*r1 + s(1, 2)*r2) + (s(1, 3)*r3 + s(1, 4)*r4)
         x2 = (s(2, 1)*r1 + s(2, 2)*r2) + (s(2, 3)*r3 + s(2, 4)*r4)
         x3 = (s(3, 1)*r1 + s(3, 2)*r2) + (s(3, 3)*r3 + s(3, 4)*r4)
         x4 = (s(4, 1)*r1 + s(4, 2)*r2) + (s(4, 3)*r3 + s(4, 4)*r4)
         q1 = q1 + h*(v1 + x1)
         q2 = q2 + h*(v2 + x2)
         q3 = q3 + h*(v3 + x3)
         q4 = q4 + h*(v4 + x4)
         v1 = v1 + (x1 + x1)
         v2 = v2 + (x2 + x2)
         v3 = v3 + (x3 + x3)
         v4 = v4 + (x4 + x4)
      end do
      q(1) = q1
      q(2) = q2
      q(3) = q3
      q(4) = q4
      v(1) = v1
      v(2) = v2
      v(3) = v3
      v(4) = v4
   end subroutine increment_4

   !> Any beta and gamma, n = 1
   pure subroutine predicted_1(form, steps, loaded, p, damped, m, c, k, s, q, v, a)
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded, damped
      real(wp), intent(in) :: p(0:*)
      real(wp), intent(in) :: m, c, k, s           !! s = S^-1
      real(wp), intent(inout) :: q, v, a
      real(wp) :: q1, v1, a1, r, dq, dv
      integer :: i

      q1 = q
      v1 = v
      a1 = a
      do i = 1, steps
         dq = form%q_v*v1 + form%q_a*a1
         dv = form%v_v*v1 + form%v_a*a1
         a1 = form%a_v*v1 + form%a_a*a1
         r = -m*a1 - k*(q1 + dq)
         if (damped) r = r - c*(v1 + dv)
         if (loaded) r = r + p(i)
         r = s*r
         q1 = q1 + (dq + form%stiffness*r)
         v1 = v1 + (dv + form%damping*r)
         a1 = a1 + r
      end do
      q = q1
      v = v1
      a = a1
   end subroutine predicted_1
end module dynstep_linear_unrolled
