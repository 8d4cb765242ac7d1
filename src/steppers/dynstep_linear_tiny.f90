! SPDX-License-Identifier: BSD-3-Clause
!> Newmark steps of linear systems with n <= 8 coordinates, many in one call.
!>
!> The forms are those of dynstep_newmark_form.  S^-1 is applied as a matrix, which shortens
!> the chain of dependent operations; for a symmetric positive definite S it is built as
!> W^T D^-1 W, W = L^-1, so that it is symmetric to the last bit and multiplies the residual
!> as accurately as substitution does.  S^-1 K is never formed for n > 1: it would not be
!> similar to a symmetric matrix, and modes of equal frequency would grow.
!> For n = 1 it is formed, since there each coefficient belongs to some oscillator.  (For n = 4
!> it would save a third of the time; errors after 1e6 steps were 2 to 10 times larger, and a
!> free body would feel its own displacement.)
!>
!> n = 1 to 4 are written out in dynstep_linear_unrolled.  The others, and the rarer forms,
!> work on vectors of eight numbers, padded with zeros: loops of a fixed length become vector
!> instructions without remainders (33 ns for a step of n = 8 against 95 with loops to n).
module dynstep_linear_tiny
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_linear_unrolled, only: advance_unrolled, predicted_1, tiny_order
   use dynstep_matrix, only: kind_zero, matrix_type
   use dynstep_newmark_form, only: form_increment, form_predicted, form_reflected, form_two_solves, newmark_form
   implicit none
   private

   public :: invert_definite, tiny_order

   type, public :: linear_tiny
      integer :: n = 0
      logical :: damped = .false.                    !! there is a C
      real(wp) :: m(tiny_order, tiny_order) = 0.0_wp
      real(wp) :: c(tiny_order, tiny_order) = 0.0_wp
      real(wp) :: k(tiny_order, tiny_order) = 0.0_wp
      real(wp) :: s(tiny_order, tiny_order) = 0.0_wp !! scale S^-1
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

   !> Keep S^-1 of a matrix that has been factorized, scaled as the form wants it
   pure subroutine tiny_invert(self, form, matrix, factor)
      class(linear_tiny), intent(inout) :: self
      type(newmark_form), intent(in) :: form
      type(matrix_type), intent(in) :: matrix
      type(factorization_type), intent(in) :: factor
      real(wp) :: x(self%n)
      logical :: ok
      integer :: j

      ok = .false.
      if (factor%positive_definite) then
         call copy(matrix, self%s)
         call invert_definite(self%n, self%s, ok)
      end if
      if (.not. ok) then
         do j = 1, self%n
            x = 0.0_wp
            x(j) = 1.0_wp
            call factor%solve(x)
            self%s(1:self%n, j) = x
         end do
      end if
      if (form%form == form_increment) self%s = -form%half*self%s
      if (form%form == form_reflected) self%s = form%h*self%s
   end subroutine tiny_invert

   !> S = L D L^T, then S^-1 = W^T D^-1 W with W = L^-1; reads the lower triangle
   pure subroutine invert_definite(n, s, ok)
      integer, intent(in) :: n
      real(wp), intent(inout) :: s(tiny_order, tiny_order)
      logical, intent(out) :: ok               !! all pivots are positive
      real(wp) :: l(tiny_order, tiny_order), w(tiny_order, tiny_order), d(tiny_order)
      integer :: i, j, k

      do j = 1, n
         d(j) = s(j, j)
         do k = 1, j - 1
            d(j) = d(j) - l(j, k)*(d(k)*l(j, k))
         end do
         ok = d(j) > 0.0_wp
         if (.not. ok) return
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

      real(wp), dimension(tiny_order) :: q8, v8, a8

      if (form%form == form_increment .and. self%n <= 4) then
         call advance_unrolled(self%n, form%h, steps, loaded, p, self%damped, self%c, self%k, self%s, q, v)
         return
      end if
      if (form%form == form_predicted .and. self%n == 1) then
         call predicted_1(form, steps, loaded, p, self%damped, self%m(1, 1), self%c(1, 1), self%k(1, 1), self%s(1, 1), &
            & q(1), v(1), a(1))
         return
      end if
      q8 = 0.0_wp
      v8 = 0.0_wp
      q8(1:self%n) = q
      v8(1:self%n) = v
      select case (form%form)
      case (form_increment)
         call increment_8(self, form, steps, loaded, p, q8, v8)
      case (form_reflected)
         call reflected(self, form, steps, loaded, p, q8, v8)
      case (form_two_solves)
         call two_solves(self, form, steps, loaded, p, q8, v8)
      case (form_predicted)
         a8 = 0.0_wp
         a8(1:self%n) = a
         call predicted(self, form, steps, loaded, p, q8, v8, a8)
         a = a8(1:self%n)
      end select
      q = q8(1:self%n)
      v = v8(1:self%n)
   end subroutine tiny_advance

   !> n = 5..8
   pure subroutine increment_8(self, form, steps, loaded, p, q, v)
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(self%n, 0:*)
      real(wp), intent(inout) :: q(tiny_order), v(tiny_order)
      real(wp), dimension(tiny_order) :: r, x, w, load
      integer :: i

      load = 0.0_wp
      do i = 1, steps
         x = q + form%half*v
         call multiply(self%k, x, r)
         if (self%damped) then
            call multiply(self%c, v, w)
            r = r + w
         end if
         if (loaded) then
            load(1:self%n) = 0.5_wp*(p(:, i - 1) + p(:, i))
            r = r - load
         end if
         call multiply(self%s, r, x)
         q = q + form%h*(v + x)
         v = v + (x + x)
      end do
   end subroutine increment_8

   pure subroutine reflected(self, form, steps, loaded, p, q, v)
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(self%n, 0:*)
      real(wp), intent(inout) :: q(tiny_order), v(tiny_order)
      real(wp), dimension(tiny_order) :: r, x, u, load
      real(wp) :: rate
      integer :: i

      rate = 2.0_wp/form%h
      load = 0.0_wp
      do i = 1, steps
         u = v + rate*q
         call multiply(self%m, u, r)
         if (self%damped) then
            call multiply(self%c, q, x)
            r = r + x
         end if
         if (loaded) load(1:self%n) = 0.5_wp*(p(:, i - 1) + p(:, i))
         r = r + form%half*load
         call multiply(self%s, r, x)
         q = x - q
         v = rate*q - u
      end do
   end subroutine reflected

   pure subroutine two_solves(self, form, steps, loaded, p, q, v)
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(self%n, 0:*)
      real(wp), intent(inout) :: q(tiny_order), v(tiny_order)
      real(wp), dimension(tiny_order) :: r, x, w, u, load
      integer :: i

      load = 0.0_wp
      do i = 1, steps
         if (loaded) load(1:self%n) = 0.5_wp*(p(:, i - 1) + p(:, i))
         call multiply(self%k, q, u)
         call multiply(self%m, v, w)
         w = w + form%half*(load - u)
         x = q + form%half*v
         call multiply(self%k, x, r)
         call multiply(self%c, v, x)
         r = form%h*((load - x) - r)
         call multiply(self%s, w, u)
         call multiply(self%s, r, x)
         q = q + form%h*u
         v = v + x
      end do
   end subroutine two_solves

   pure subroutine predicted(self, form, steps, loaded, p, q, v, a)
      type(linear_tiny), intent(in) :: self
      type(newmark_form), intent(in) :: form
      integer, intent(in) :: steps
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p(self%n, 0:*)
      real(wp), intent(inout) :: q(tiny_order), v(tiny_order), a(tiny_order)
      real(wp), dimension(tiny_order) :: r, x, dq, dv, load
      integer :: i

      load = 0.0_wp
      do i = 1, steps
         if (loaded) load(1:self%n) = p(:, i)
         dq = form%q_v*v + form%q_a*a
         dv = form%v_v*v + form%v_a*a
         a = form%a_v*v + form%a_a*a
         call multiply(self%m, a, r)
         r = load - r
         x = q + dq
         call multiply(self%k, x, load)
         r = r - load
         if (self%damped) then
            x = v + dv
            call multiply(self%c, x, load)
            r = r - load
         end if
         load = 0.0_wp
         call multiply(self%s, r, x)
         q = q + (dq + form%stiffness*x)
         v = v + (dv + form%damping*x)
         a = a + x
      end do
   end subroutine predicted

   !> y = A x
   pure subroutine multiply(a, x, y)
      real(wp), intent(in) :: a(tiny_order, tiny_order), x(tiny_order)
      real(wp), intent(out) :: y(tiny_order)
      integer :: i
      do i = 1, tiny_order
         y(i) = ((a(i, 1)*x(1) + a(i, 2)*x(2)) + (a(i, 3)*x(3) + a(i, 4)*x(4))) &
            & + ((a(i, 5)*x(5) + a(i, 6)*x(6)) + (a(i, 7)*x(7) + a(i, 8)*x(8)))
      end do
   end subroutine multiply
end module dynstep_linear_tiny
