! SPDX-License-Identifier: BSD-3-Clause
!> Newmark steps of linear systems with n <= 8 coordinates, many in one call.
!>
!> The forms are those of dynstep_newmark_form.  S^-1 is applied as a matrix, which shortens
!> the chain of dependent operations; for a symmetric positive definite S it is built as
!> W^T D^-1 W, W = L^-1, so that it is symmetric to the last bit and multiplies the residual
!> as accurately as substitution does.  S^-1 K is never formed for n > 1: it would not be
!> similar to a symmetric matrix, and modes of equal frequency would grow.
!> For n = 1 it is formed, since there each coefficient belongs to some oscillator.
!>
!> Loops are kept scalar (novector): vector stores followed by narrower loads stall.
module dynstep_linear_tiny
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_zero, matrix_type
   use dynstep_newmark_form, only: form_increment, form_predicted, form_reflected, form_two_solves, newmark_form
   implicit none
   private

   integer, parameter, public :: tiny_order = 8   !! largest n

   type, public :: linear_tiny
      integer :: n = 0
      logical :: damped = .false.                    !! there is a C
      real(wp) :: m(tiny_order, tiny_order) = 0.0_wp
      real(wp) :: c(tiny_order, tiny_order) = 0.0_wp
      real(wp) :: k(tiny_order, tiny_order) = 0.0_wp
      real(wp) :: s(tiny_order, tiny_order) = 0.0_wp !! S^-1
   contains
      procedure :: init => tiny_init
      procedure :: invert => tiny_invert
      procedure :: advance => tiny_advance
   end type linear_tiny

contains

   !> Copy the matrices
   pure subroutine tiny_init(self, sys)
      class(linear_tiny), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      self%n = sys%n
      self%damped = sys%c%kind /= kind_zero
      call copy(sys%m, self%m)
      call copy(sys%c, self%c)
      call copy(sys%k, self%k)
   end subroutine tiny_init

   pure subroutine copy(matrix, a)
      type(matrix_type), intent(in) :: matrix
      real(wp), intent(out) :: a(tiny_order, tiny_order)
      integer :: i, j
      a = 0.0_wp
      do j = 1, matrix%n
         do i = 1, matrix%n
            a(i, j) = matrix%entry(i, j)
         end do
      end do
   end subroutine copy

   !> Keep S^-1 of a matrix that has been factorized
   pure subroutine tiny_invert(self, matrix, factor)
      class(linear_tiny), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      type(factorization_type), intent(in) :: factor
      real(wp) :: x(self%n)
      integer :: j

      if (factor%positive_definite) then
         call copy(matrix, self%s)
         call invert_definite(self%n, self%s)
      else
         do j = 1, self%n
            x = 0.0_wp
            x(j) = 1.0_wp
            call factor%solve(x)
            self%s(1:self%n, j) = x
         end do
      end if
   end subroutine tiny_invert

   !> S = L D L^T, then S^-1 = W^T D^-1 W with W = L^-1; reads the lower triangle
   pure subroutine invert_definite(n, s)
      integer, intent(in) :: n
      real(wp), intent(inout) :: s(tiny_order, tiny_order)
      real(wp) :: l(tiny_order, tiny_order), w(tiny_order, tiny_order), d(tiny_order)
      integer :: i, j, k

      do j = 1, n
         d(j) = s(j, j)
         do k = 1, j - 1
            d(j) = d(j) - l(j, k)*(d(k)*l(j, k))
         end do
         do i = j + 1, n
            l(i, j) = s(i, j)
            do k = 1, j - 1
               l(i, j) = l(i, j) - l(i, k)*(d(k)*l(j, k))
            end do
            l(i, j) = l(i, j)/d(j)
         end do
      end do
      do j = 1, n
         w(j, j) = 1.0_wp
         do i = j + 1, n
            w(i, j) = -l(i, j)
            do k = j + 1, i - 1
               w(i, j) = w(i, j) - l(i, k)*w(k, j)
            end do
         end do
      end do
      do j = 1, n
         do i = j, n
            s(i, j) = 0.0_wp
            do k = n, i, -1
               s(i, j) = s(i, j) + w(k, i)*w(k, j)/d(k)
            end do
            s(j, i) = s(i, j)
         end do
      end do
   end subroutine invert_definite

   !> `steps` steps in place
   pure subroutine tiny_advance(self, form, steps, loaded, p, q, v, a)
      class(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded                    !! p is read
      real(wp), intent(in) :: p(self%n, 0:*)           !! loads at the begin of each step and the end
      real(wp), intent(inout) :: q(self%n), v(self%n)
      real(wp), intent(inout) :: a(self%n)             !! read and written by form_predicted only

      select case (form%form)
      case (form_increment)
         select case (self%n)
         case (1)
            call increment_1(self, form, steps, loaded, p, q(1), v(1))
         case (2)
            call increment_2(self, form, steps, loaded, p, q, v)
         case (3)
            call increment_3(self, form, steps, loaded, p, q, v)
         case (4)
            call increment_4(self, form, steps, loaded, p, q, v)
         case default
            call increment_n(self%n, self, form, steps, loaded, p, q, v)
         end select
      case (form_reflected)
         call reflected_n(self%n, self, form, steps, loaded, p, q, v)
      case (form_two_solves)
         call two_solves_n(self%n, self, form, steps, loaded, p, q, v)
      case (form_predicted)
         if (self%n == 1) then
            call predicted_1(self, form, steps, loaded, p, q(1), v(1), a(1))
         else
            call predicted_n(self%n, self, form, steps, loaded, p, q, v, a)
         end if
      end select
   end subroutine tiny_advance

   pure subroutine increment_1(self, form, steps, loaded, p, q, v)
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(0:*)
      real(wp), intent(inout) :: q, v
      real(wp) :: q1, v1, dv, h, half, c, k, s
      integer :: i

      q1 = q
      v1 = v
      h = form%h
      half = form%half
      c = self%c(1, 1)
      k = self%k(1, 1)
      s = h*self%s(1, 1)
      if (loaded) then
         do i = 1, steps
            dv = s*((0.5_wp*(p(i - 1) + p(i)) - c*v1) - k*(q1 + half*v1))
            q1 = q1 + h*(v1 + 0.5_wp*dv)
            v1 = v1 + dv
         end do
      else if (self%damped) then
         do i = 1, steps
            dv = -s*(c*v1 + k*(q1 + half*v1))
            q1 = q1 + h*(v1 + 0.5_wp*dv)
            v1 = v1 + dv
         end do
      else
         s = -s*k
         do i = 1, steps
            dv = s*(q1 + half*v1)
            q1 = q1 + h*(v1 + 0.5_wp*dv)
            v1 = v1 + dv
         end do
      end if
      q = q1
      v = v1
   end subroutine increment_1

   pure subroutine increment_2(self, form, steps, loaded, p, q, v)
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(2, 0:*)
      real(wp), intent(inout) :: q(2), v(2)
      real(wp) :: q1, q2, v1, v2, r1, r2, x1, x2, h, half
      real(wp) :: k11, k21, k12, k22, s11, s21, s12, s22
      integer :: i

      h = form%h
      half = form%half
      k11 = self%k(1, 1)
      k21 = self%k(2, 1)
      k12 = self%k(1, 2)
      k22 = self%k(2, 2)
      s11 = h*self%s(1, 1)
      s21 = h*self%s(2, 1)
      s12 = h*self%s(1, 2)
      s22 = h*self%s(2, 2)
      q1 = q(1)
      q2 = q(2)
      v1 = v(1)
      v2 = v(2)
!GCC$ novector
      do i = 1, steps
         x1 = q1 + half*v1
         x2 = q2 + half*v2
         r1 = -(k11*x1 + k12*x2)
         r2 = -(k21*x1 + k22*x2)
         if (self%damped) then
            r1 = r1 - (self%c(1, 1)*v1 + self%c(1, 2)*v2)
            r2 = r2 - (self%c(2, 1)*v1 + self%c(2, 2)*v2)
         end if
         if (loaded) then
            r1 = r1 + 0.5_wp*(p(1, i - 1) + p(1, i))
            r2 = r2 + 0.5_wp*(p(2, i - 1) + p(2, i))
         end if
         x1 = s11*r1 + s12*r2
         x2 = s21*r1 + s22*r2
         q1 = q1 + h*(v1 + 0.5_wp*x1)
         q2 = q2 + h*(v2 + 0.5_wp*x2)
         v1 = v1 + x1
         v2 = v2 + x2
      end do
      q(1) = q1
      q(2) = q2
      v(1) = v1
      v(2) = v2
   end subroutine increment_2

   pure subroutine increment_3(self, form, steps, loaded, p, q, v)
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(3, 0:*)
      real(wp), intent(inout) :: q(3), v(3)
      real(wp) :: q1, q2, q3, v1, v2, v3, r1, r2, r3, x1, x2, x3, h, half
      real(wp) :: k(3, 3), s(3, 3), c(3, 3)
      integer :: i

      h = form%h
      half = form%half
      k = self%k(1:3, 1:3)
      c = self%c(1:3, 1:3)
      s = h*self%s(1:3, 1:3)
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
         r1 = -((k(1, 1)*x1 + k(1, 2)*x2) + k(1, 3)*x3)
         r2 = -((k(2, 1)*x1 + k(2, 2)*x2) + k(2, 3)*x3)
         r3 = -((k(3, 1)*x1 + k(3, 2)*x2) + k(3, 3)*x3)
         if (self%damped) then
            r1 = r1 - ((c(1, 1)*v1 + c(1, 2)*v2) + c(1, 3)*v3)
            r2 = r2 - ((c(2, 1)*v1 + c(2, 2)*v2) + c(2, 3)*v3)
            r3 = r3 - ((c(3, 1)*v1 + c(3, 2)*v2) + c(3, 3)*v3)
         end if
         if (loaded) then
            r1 = r1 + 0.5_wp*(p(1, i - 1) + p(1, i))
            r2 = r2 + 0.5_wp*(p(2, i - 1) + p(2, i))
            r3 = r3 + 0.5_wp*(p(3, i - 1) + p(3, i))
         end if
         x1 = (s(1, 1)*r1 + s(1, 2)*r2) + s(1, 3)*r3
         x2 = (s(2, 1)*r1 + s(2, 2)*r2) + s(2, 3)*r3
         x3 = (s(3, 1)*r1 + s(3, 2)*r2) + s(3, 3)*r3
         q1 = q1 + h*(v1 + 0.5_wp*x1)
         q2 = q2 + h*(v2 + 0.5_wp*x2)
         q3 = q3 + h*(v3 + 0.5_wp*x3)
         v1 = v1 + x1
         v2 = v2 + x2
         v3 = v3 + x3
      end do
      q(1) = q1
      q(2) = q2
      q(3) = q3
      v(1) = v1
      v(2) = v2
      v(3) = v3
   end subroutine increment_3

   pure subroutine increment_4(self, form, steps, loaded, p, q, v)
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(4, 0:*)
      real(wp), intent(inout) :: q(4), v(4)
      real(wp) :: q1, q2, q3, q4, v1, v2, v3, v4, r1, r2, r3, r4, x1, x2, x3, x4, h, half
      real(wp) :: k(4, 4), s(4, 4), c(4, 4)
      integer :: i

      h = form%h
      half = form%half
      k = self%k(1:4, 1:4)
      c = self%c(1:4, 1:4)
      s = h*self%s(1:4, 1:4)
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
         r1 = -((k(1, 1)*x1 + k(1, 2)*x2) + (k(1, 3)*x3 + k(1, 4)*x4))
         r2 = -((k(2, 1)*x1 + k(2, 2)*x2) + (k(2, 3)*x3 + k(2, 4)*x4))
         r3 = -((k(3, 1)*x1 + k(3, 2)*x2) + (k(3, 3)*x3 + k(3, 4)*x4))
         r4 = -((k(4, 1)*x1 + k(4, 2)*x2) + (k(4, 3)*x3 + k(4, 4)*x4))
         if (self%damped) then
            r1 = r1 - ((c(1, 1)*v1 + c(1, 2)*v2) + (c(1, 3)*v3 + c(1, 4)*v4))
            r2 = r2 - ((c(2, 1)*v1 + c(2, 2)*v2) + (c(2, 3)*v3 + c(2, 4)*v4))
            r3 = r3 - ((c(3, 1)*v1 + c(3, 2)*v2) + (c(3, 3)*v3 + c(3, 4)*v4))
            r4 = r4 - ((c(4, 1)*v1 + c(4, 2)*v2) + (c(4, 3)*v3 + c(4, 4)*v4))
         end if
         if (loaded) then
            r1 = r1 + 0.5_wp*(p(1, i - 1) + p(1, i))
            r2 = r2 + 0.5_wp*(p(2, i - 1) + p(2, i))
            r3 = r3 + 0.5_wp*(p(3, i - 1) + p(3, i))
            r4 = r4 + 0.5_wp*(p(4, i - 1) + p(4, i))
         end if
         x1 = (s(1, 1)*r1 + s(1, 2)*r2) + (s(1, 3)*r3 + s(1, 4)*r4)
         x2 = (s(2, 1)*r1 + s(2, 2)*r2) + (s(2, 3)*r3 + s(2, 4)*r4)
         x3 = (s(3, 1)*r1 + s(3, 2)*r2) + (s(3, 3)*r3 + s(3, 4)*r4)
         x4 = (s(4, 1)*r1 + s(4, 2)*r2) + (s(4, 3)*r3 + s(4, 4)*r4)
         q1 = q1 + h*(v1 + 0.5_wp*x1)
         q2 = q2 + h*(v2 + 0.5_wp*x2)
         q3 = q3 + h*(v3 + 0.5_wp*x3)
         q4 = q4 + h*(v4 + 0.5_wp*x4)
         v1 = v1 + x1
         v2 = v2 + x2
         v3 = v3 + x3
         v4 = v4 + x4
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

   pure subroutine increment_n(n, self, form, steps, loaded, p, q, v)
      integer, intent(in) :: n
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(n, 0:*)
      real(wp), intent(inout) :: q(n), v(n)
      real(wp) :: r(tiny_order), x(tiny_order), s(tiny_order, tiny_order)
      integer :: i, j

      s = form%h*self%s
      do i = 1, steps
!GCC$ novector
         do j = 1, n
            x(j) = q(j) + form%half*v(j)
            r(j) = 0.0_wp
         end do
         if (loaded) call mean(n, p(:, i - 1), p(:, i), r)
         call subtract(n, self%k, x, r)
         if (self%damped) call subtract(n, self%c, v, r)
         call multiply(n, s, r, x)
!GCC$ novector
         do j = 1, n
            q(j) = q(j) + form%h*(v(j) + 0.5_wp*x(j))
            v(j) = v(j) + x(j)
         end do
      end do
   end subroutine increment_n

   pure subroutine reflected_n(n, self, form, steps, loaded, p, q, v)
      integer, intent(in) :: n
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(n, 0:*)
      real(wp), intent(inout) :: q(n), v(n)
      real(wp) :: r(tiny_order), x(tiny_order), u(tiny_order), s(tiny_order, tiny_order), rate
      integer :: i, j

      s = form%h*self%s
      rate = 2.0_wp/form%h
      do i = 1, steps
!GCC$ novector
         do j = 1, n
            u(j) = v(j) + rate*q(j)
            r(j) = 0.0_wp
         end do
         if (loaded) call mean(n, p(:, i - 1), p(:, i), r)
         r(1:n) = form%half*r(1:n)
         call add(n, self%m, u, r)
         if (self%damped) call add(n, self%c, q, r)
         call multiply(n, s, r, x)
!GCC$ novector
         do j = 1, n
            q(j) = x(j) - q(j)
            v(j) = rate*q(j) - u(j)
         end do
      end do
   end subroutine reflected_n

   pure subroutine two_solves_n(n, self, form, steps, loaded, p, q, v)
      integer, intent(in) :: n
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(n, 0:*)
      real(wp), intent(inout) :: q(n), v(n)
      real(wp) :: r(tiny_order), x(tiny_order), w(tiny_order)
      integer :: i, j

      do i = 1, steps
!GCC$ novector
         do j = 1, n
            r(j) = 0.0_wp
         end do
         if (loaded) call mean(n, p(:, i - 1), p(:, i), r)
         x(1:n) = r(1:n)
         call subtract(n, self%k, q, x)
         x(1:n) = form%half*x(1:n)
         call add(n, self%m, v, x)
         call multiply(n, self%s, x, w)
         x(1:n) = q + form%half*v
         call subtract(n, self%k, x, r)
         if (self%damped) call subtract(n, self%c, v, r)
         r(1:n) = form%h*r(1:n)
         call multiply(n, self%s, r, x)
         q = q + form%h*w(1:n)
         v = v + x(1:n)
      end do
   end subroutine two_solves_n

   pure subroutine predicted_1(self, form, steps, loaded, p, q, v, a)
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(0:*)
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
         r = -self%m(1, 1)*a1 - self%k(1, 1)*(q1 + dq)
         if (self%damped) r = r - self%c(1, 1)*(v1 + dv)
         if (loaded) r = r + p(i)
         r = self%s(1, 1)*r
         q1 = q1 + (dq + form%stiffness*r)
         v1 = v1 + (dv + form%damping*r)
         a1 = a1 + r
      end do
      q = q1
      v = v1
      a = a1
   end subroutine predicted_1

   pure subroutine predicted_n(n, self, form, steps, loaded, p, q, v, a)
      integer, intent(in) :: n
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(n, 0:*)
      real(wp), intent(inout) :: q(n), v(n), a(n)
      real(wp) :: r(tiny_order), x(tiny_order), dq(tiny_order), dv(tiny_order)
      integer :: i, j

      do i = 1, steps
!GCC$ novector
         do j = 1, n
            r(j) = 0.0_wp
            if (loaded) r(j) = p(j, i)
            dq(j) = form%q_v*v(j) + form%q_a*a(j)
            dv(j) = form%v_v*v(j) + form%v_a*a(j)
            a(j) = form%a_v*v(j) + form%a_a*a(j)
         end do
         call subtract(n, self%m, a, r)
         x(1:n) = q + dq(1:n)
         call subtract(n, self%k, x, r)
         if (self%damped) then
            x(1:n) = v + dv(1:n)
            call subtract(n, self%c, x, r)
         end if
         call multiply(n, self%s, r, x)
!GCC$ novector
         do j = 1, n
            q(j) = q(j) + (dq(j) + form%stiffness*x(j))
            v(j) = v(j) + (dv(j) + form%damping*x(j))
            a(j) = a(j) + x(j)
         end do
      end do
   end subroutine predicted_n

   pure subroutine mean(n, p0, p1, r)
      integer, intent(in) :: n
      real(wp), intent(in) :: p0(n), p1(n)
      real(wp), intent(out) :: r(n)
      integer :: i
!GCC$ novector
      do i = 1, n
         r(i) = 0.5_wp*(p0(i) + p1(i))
      end do
   end subroutine mean

   !> y = y + A x
   pure subroutine add(n, a, x, y)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(tiny_order, tiny_order), x(n)
      real(wp), intent(inout) :: y(n)
      integer :: i, j
      do j = 1, n
!GCC$ novector
         do i = 1, n
            y(i) = y(i) + a(i, j)*x(j)
         end do
      end do
   end subroutine add

   !> y = y - A x
   pure subroutine subtract(n, a, x, y)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(tiny_order, tiny_order), x(n)
      real(wp), intent(inout) :: y(n)
      integer :: i, j
      do j = 1, n
!GCC$ novector
         do i = 1, n
            y(i) = y(i) - a(i, j)*x(j)
         end do
      end do
   end subroutine subtract

   !> y = A x
   pure subroutine multiply(n, a, x, y)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(tiny_order, tiny_order), x(n)
      real(wp), intent(out) :: y(n)
      y = 0.0_wp
      call add(n, a, x, y)
   end subroutine multiply
end module dynstep_linear_tiny
