! SPDX-License-Identifier: BSD-3-Clause
!> The sweeps of a Newmark step of a tri- or pentadiagonal system, from both ends inwards and
!> back outwards; see dynstep_linear_chain.
!>
!> Arrays hold the diagonals of symmetric matrices, a0(i) = A(i,i), a1(i) = A(i+1,i),
!> a2(i) = A(i+2,i), except L: l1(i) and l2(i) couple row i to the next two rows inwards.
module dynstep_chain_sweeps
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: free_inwards, tridiagonal_inwards, pentadiagonal_inwards, residual
   public :: tridiagonal_outwards, pentadiagonal_outwards

contains

   !> Undamped and unloaded
   pure subroutine free_inwards(n, rows, half, k0, k1, d, l1, q, v, edge, z)
      integer, intent(in) :: n, rows
      real(wp), intent(in) :: half                 !! h/2
      real(wp), intent(in) :: k0(n), k1(n), d(n), l1(n), q(n), v(n)
      real(wp), intent(out) :: edge(2, 2)          !! eliminated residuals beside the middle
      real(wp), intent(inout) :: z(n)
      real(wp) :: f, g                             ! residuals, eliminated, of the two ends
      real(wp) :: u, u1, w, w1                     ! q + h/2 v in rows i, i+1 and j, j-1
      real(wp) :: u0, w0                           ! K times those in rows i-1 and j+1
      integer :: i, j

      u = q(1) + half*v(1)
      w = q(n) + half*v(n)
      u1 = q(2) + half*v(2)
      w1 = q(n - 1) + half*v(n - 1)
      f = k0(1)*u + k1(1)*u1
      g = k0(n)*w + k1(n - 1)*w1
      z(1) = f*d(1)
      z(n) = g*d(n)
      do i = 2, rows
         j = n + 1 - i
         u0 = k1(i - 1)*u
         w0 = k1(j)*w
         u = u1
         w = w1
         u1 = q(i + 1) + half*v(i + 1)
         w1 = q(j - 1) + half*v(j - 1)
         f = ((k0(i)*u + k1(i)*u1) + u0) - l1(i - 1)*f
         g = ((k0(j)*w + k1(j - 1)*w1) + w0) - l1(j + 1)*g
         z(i) = f*d(i)
         z(j) = g*d(j)
      end do
      edge = reshape([f, 0.0_wp, g, 0.0_wp], [2, 2])
   end subroutine free_inwards

   !> Row i of C v + K (q + h/2 v) - P
   pure real(wp) function residual(i, n, width, half, damped, loaded, p0, p1, k0, k1, k2, c0, c1, c2, q, v)
      integer, intent(in) :: i, n, width
      real(wp), intent(in) :: half
      logical, intent(in) :: damped, loaded
      real(wp), intent(in), dimension(n) :: p0, p1, k0, k1, k2, c0, c1, c2, q, v
      residual = k0(i)*(q(i) + half*v(i))
      if (i > 1) residual = residual + k1(i - 1)*(q(i - 1) + half*v(i - 1))
      if (i < n) residual = residual + k1(i)*(q(i + 1) + half*v(i + 1))
      if (damped) then
         residual = residual + c0(i)*v(i)
         if (i > 1) residual = residual + c1(i - 1)*v(i - 1)
         if (i < n) residual = residual + c1(i)*v(i + 1)
      end if
      if (width == 2) then
         if (i > 2) residual = residual + k2(i - 2)*(q(i - 2) + half*v(i - 2))
         if (i < n - 1) residual = residual + k2(i)*(q(i + 2) + half*v(i + 2))
         if (damped .and. i > 2) residual = residual + c2(i - 2)*v(i - 2)
         if (damped .and. i < n - 1) residual = residual + c2(i)*v(i + 2)
      end if
      if (loaded) residual = residual - 0.5_wp*(p0(i) + p1(i))
   end function residual

   pure subroutine tridiagonal_inwards(n, rows, half, damped, loaded, p0, p1, k0, k1, c0, c1, d, l1, q, v, edge, z)
      integer, intent(in) :: n, rows
      real(wp), intent(in) :: half
      logical, intent(in) :: damped, loaded
      real(wp), intent(in), dimension(n) :: p0, p1, k0, k1, c0, c1, d, l1, q, v
      real(wp), intent(out) :: edge(2, 2)
      real(wp), intent(inout) :: z(n)
      real(wp) :: f, g, u, u1, w, w1, u0, w0
      integer :: i, j

      f = residual(1, n, 1, half, damped, loaded, p0, p1, k0, k1, k1, c0, c1, c1, q, v)
      g = residual(n, n, 1, half, damped, loaded, p0, p1, k0, k1, k1, c0, c1, c1, q, v)
      z(1) = f*d(1)
      z(n) = g*d(n)
      u = q(1) + half*v(1)
      w = q(n) + half*v(n)
      u1 = q(2) + half*v(2)
      w1 = q(n - 1) + half*v(n - 1)
      do i = 2, rows
         j = n + 1 - i
         u0 = k1(i - 1)*u
         w0 = k1(j)*w
         u = u1
         w = w1
         u1 = q(i + 1) + half*v(i + 1)
         w1 = q(j - 1) + half*v(j - 1)
         u0 = (k0(i)*u + k1(i)*u1) + u0
         w0 = (k0(j)*w + k1(j - 1)*w1) + w0
         if (damped) then
            u0 = u0 + ((c0(i)*v(i) + c1(i)*v(i + 1)) + c1(i - 1)*v(i - 1))
            w0 = w0 + ((c0(j)*v(j) + c1(j - 1)*v(j - 1)) + c1(j)*v(j + 1))
         end if
         if (loaded) then
            u0 = u0 - 0.5_wp*(p0(i) + p1(i))
            w0 = w0 - 0.5_wp*(p0(j) + p1(j))
         end if
         f = u0 - l1(i - 1)*f
         g = w0 - l1(j + 1)*g
         z(i) = f*d(i)
         z(j) = g*d(j)
      end do
      edge = reshape([f, 0.0_wp, g, 0.0_wp], [2, 2])
   end subroutine tridiagonal_inwards

   pure subroutine pentadiagonal_inwards(n, rows, half, damped, loaded, p0, p1, k0, k1, k2, c0, c1, c2, d, l1, l2, q, v, &
      & edge, z)
      integer, intent(in) :: n, rows
      real(wp), intent(in) :: half
      logical, intent(in) :: damped, loaded
      real(wp), intent(in), dimension(n) :: p0, p1, k0, k1, k2, c0, c1, c2, d, l1, l2, q, v
      real(wp), intent(out) :: edge(2, 2)
      real(wp), intent(inout) :: z(n)
      real(wp) :: f, g, f1, g1, r, s
      real(wp) :: ua, ub, u, u1, u2, wa, wb, w, w1, w2
      integer :: i, j

      f1 = residual(1, n, 2, half, damped, loaded, p0, p1, k0, k1, k2, c0, c1, c2, q, v)
      g1 = residual(n, n, 2, half, damped, loaded, p0, p1, k0, k1, k2, c0, c1, c2, q, v)
      z(1) = f1*d(1)
      z(n) = g1*d(n)
      f = residual(2, n, 2, half, damped, loaded, p0, p1, k0, k1, k2, c0, c1, c2, q, v) - l1(1)*f1
      g = residual(n - 1, n, 2, half, damped, loaded, p0, p1, k0, k1, k2, c0, c1, c2, q, v) - l1(n)*g1
      z(2) = f*d(2)
      z(n - 1) = g*d(n - 1)
      ub = q(1) + half*v(1)
      u = q(2) + half*v(2)
      u1 = q(3) + half*v(3)
      u2 = q(4) + half*v(4)
      wb = q(n) + half*v(n)
      w = q(n - 1) + half*v(n - 1)
      w1 = q(n - 2) + half*v(n - 2)
      w2 = q(n - 3) + half*v(n - 3)
      do i = 3, rows
         j = n + 1 - i
         ua = ub
         ub = u
         u = u1
         u1 = u2
         u2 = q(i + 2) + half*v(i + 2)
         wa = wb
         wb = w
         w = w1
         w1 = w2
         w2 = q(j - 2) + half*v(j - 2)
         r = ((k0(i)*u + k1(i)*u1) + (k2(i)*u2 + k1(i - 1)*ub)) + k2(i - 2)*ua
         s = ((k0(j)*w + k1(j - 1)*w1) + (k2(j - 2)*w2 + k1(j)*wb)) + k2(j)*wa
         if (damped) then
            r = r + (((c0(i)*v(i) + c1(i)*v(i + 1)) + (c2(i)*v(i + 2) + c1(i - 1)*v(i - 1))) + c2(i - 2)*v(i - 2))
            s = s + (((c0(j)*v(j) + c1(j - 1)*v(j - 1)) + (c2(j - 2)*v(j - 2) + c1(j)*v(j + 1))) + c2(j)*v(j + 2))
         end if
         if (loaded) then
            r = r - 0.5_wp*(p0(i) + p1(i))
            s = s - 0.5_wp*(p0(j) + p1(j))
         end if
         r = (r - l2(i - 2)*f1) - l1(i - 1)*f
         s = (s - l2(j + 2)*g1) - l1(j + 1)*g
         f1 = f
         g1 = g
         f = r
         g = s
         z(i) = f*d(i)
         z(j) = g*d(j)
      end do
      edge = reshape([f, f1, g, g1], [2, 2])
   end subroutine pentadiagonal_inwards

   pure subroutine tridiagonal_outwards(n, rows, h, l1, z, q, v)
      integer, intent(in) :: n, rows
      real(wp), intent(in) :: h
      real(wp), intent(in), dimension(n) :: l1, z
      real(wp), intent(inout), dimension(n) :: q, v
      real(wp) :: x, y
      integer :: i, j

      do i = rows + 1, n - rows
         q(i) = q(i) + h*(v(i) + 0.5_wp*z(i))
         v(i) = v(i) + z(i)
      end do
      x = z(rows + 1)
      y = z(n - rows)
      do i = rows, 1, -1
         j = n + 1 - i
         x = z(i) - l1(i)*x
         y = z(j) - l1(j)*y
         q(i) = q(i) + h*(v(i) + 0.5_wp*x)
         q(j) = q(j) + h*(v(j) + 0.5_wp*y)
         v(i) = v(i) + x
         v(j) = v(j) + y
      end do
   end subroutine tridiagonal_outwards

   pure subroutine pentadiagonal_outwards(n, rows, h, l1, l2, z, q, v)
      integer, intent(in) :: n, rows
      real(wp), intent(in) :: h
      real(wp), intent(in), dimension(n) :: l1, l2, z
      real(wp), intent(inout), dimension(n) :: q, v
      real(wp) :: x, x1, y, y1, s
      integer :: i, j

      do i = rows + 1, n - rows
         q(i) = q(i) + h*(v(i) + 0.5_wp*z(i))
         v(i) = v(i) + z(i)
      end do
      x = z(rows + 1)
      x1 = z(rows + 2)
      y = z(n - rows)
      y1 = z(n - rows - 1)
      do i = rows, 1, -1
         j = n + 1 - i
         s = (z(i) - l2(i)*x1) - l1(i)*x
         x1 = x
         x = s
         s = (z(j) - l2(j)*y1) - l1(j)*y
         y1 = y
         y = s
         q(i) = q(i) + h*(v(i) + 0.5_wp*x)
         q(j) = q(j) + h*(v(j) + 0.5_wp*y)
         v(i) = v(i) + x
         v(j) = v(j) + y
      end do
   end subroutine pentadiagonal_outwards
end module dynstep_chain_sweeps
