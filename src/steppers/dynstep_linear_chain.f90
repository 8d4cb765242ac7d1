! SPDX-License-Identifier: BSD-3-Clause
!> Newmark steps of chains: symmetric tridiagonal and pentadiagonal systems, in the increment
!> form of dynstep_newmark_form.
!>
!> S = M + gamma h C + beta h^2 K is eliminated from both ends at once towards `rows` rows in
!> the middle, which are solved as a small dense system.  A step is two sweeps:
!>
!>   inwards    g(i) = (C v + K (q + h/2 v) - P)(i) - l1 g(i-1) - l2 g(i-2),  z(i) = -h g(i)/D(i)
!>   outwards   x(i) = z(i) - l1(i) x(i+1) - l2(i) x(i+2),   q = q + h (v + x/2),   v = v + x
!>
!> (i-1, i-2 and i+1, i+2 are counted from the nearer end).  One multiplication and one
!> addition per row and sweep depend on those of the row before, and the two ends do not
!> depend on each other; residual and update hide behind them.  Measured for 1000 masses:
!> 3.0 ns a row, 4.1 from one end only; 8 cycles would be 3.6 ns.
!> K is kept as it is, and h scales the pivots: a change of -h/D leaves S^-1 symmetric, so the
!> energy does not drift; rounding errors of h K would offset it.
!>
!> The arrays are columns of one pool whose starts differ modulo 4096 bytes: arrays that
!> begin at the same offset of a page compete for one set of the first-level cache.
module dynstep_linear_chain
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_linear_tiny, only: invert_definite, tiny_order
   use dynstep_matrix, only: kind_banded, kind_zero, matrix_type
   use dynstep_newmark_form, only: newmark_form
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: is_chain

   ! columns of the pool: diagonal, first and second off-diagonals of K and C, factors, right side
   integer, parameter :: k0 = 1, k1 = 2, k2 = 3, c0 = 4, c1 = 5, c2 = 6
   integer, parameter :: d = 7, l1 = 8, l2 = 9, z = 10, columns = 10

   type, public :: linear_chain
      integer :: n = 0
      integer :: width = 0                        !! off-diagonals: 1 or 2
      logical :: damped = .false.                 !! there is a C
      integer :: half = 0                         !! rows eliminated from each end
      integer :: rows = 0                         !! rows in the middle, 1..3
      real(wp) :: middle(3, 3) = 0.0_wp           !! -h times the inverse of their matrix
      real(wp), allocatable, private :: pool(:, :)   ! [stride, columns]
   contains
      procedure :: init => chain_init
      procedure :: read_matrices => chain_read_matrices
      procedure :: factorize => chain_factorize
      procedure :: step => chain_step
   end type linear_chain

contains

   !> True where these kernels serve
   pure logical function is_chain(sys)
      class(linear_system), intent(in) :: sys
      integer :: width
      width = max(width_of(sys%m), width_of(sys%c), width_of(sys%k))
      is_chain = (width == 1 .or. width == 2) .and. sys%n > tiny_order
   end function is_chain

   !> Off-diagonals of a symmetric band, many where it is none
   pure integer function width_of(a)
      type(matrix_type), intent(in) :: a
      width_of = 0
      if (a%kind >= kind_banded) width_of = a%n
      if (a%kind == kind_banded .and. a%symmetric) width_of = a%kl
   end function width_of

   !> Allocate
   recursive subroutine chain_init(self, sys, status)
      class(linear_chain), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer, parameter :: page = 512        ! numbers in 4096 bytes
      integer, parameter :: stagger = 56      ! 7 lines of cache
      integer :: stat, stride

      if (status%failed()) return
      self%n = sys%n
      self%width = max(width_of(sys%m), width_of(sys%c), width_of(sys%k))
      self%damped = sys%c%kind /= kind_zero
      self%half = (sys%n - self%width)/2
      self%rows = sys%n - 2*self%half
      stride = 8*((sys%n + 7)/8)
      if (sys%n >= page) stride = page*((sys%n - stagger + page - 1)/page) + stagger
      if (allocated(self%pool)) deallocate (self%pool)
      allocate (self%pool(stride, columns), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory to step '//text(sys%n)//' coordinates')
         return
      end if
      self%pool = 0.0_wp
   end subroutine chain_init

   !> Copy the diagonals of K and C
   pure subroutine chain_read_matrices(self, sys)
      class(linear_chain), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      integer :: off
      do off = 0, self%width
         call copy_diagonal(sys%k, off, self%pool(:, k0 + off))
         call copy_diagonal(sys%c, off, self%pool(:, c0 + off))
      end do
   end subroutine chain_read_matrices

   !> x(i) = A(i+off,i)
   pure subroutine copy_diagonal(a, off, x)
      type(matrix_type), intent(in) :: a
      integer, intent(in) :: off
      real(wp), intent(inout) :: x(:)
      integer :: i
      x = 0.0_wp
      do i = 1, a%n - off
         x(i) = a%entry(i + off, i)
      end do
   end subroutine copy_diagonal

   !> S = L D L^T from both ends; `ok` is false where a pivot is not positive
   pure subroutine chain_factorize(self, s, h, ok)
      class(linear_chain), intent(inout) :: self
      type(matrix_type), intent(in) :: s
      real(wp), intent(in) :: h
      logical, intent(out) :: ok
      integer :: off
      do off = 0, self%width
         call copy_diagonal(s, off, self%pool(:, d + off))
      end do
      if (self%width == 1) self%pool(:, l2) = 0.0_wp
      call twisted_factorize(self%n, self%half, self%rows, h, self%pool(:, d), self%pool(:, l1), &
         & self%pool(:, l2), self%middle, ok)
   end subroutine chain_factorize

   !> In place: diagonal to -h/D, off-diagonals to those of L, counted from the nearer end
   pure subroutine twisted_factorize(n, half, rows, h, d, l1, l2, middle, ok)
      integer, intent(in) :: n, half, rows
      real(wp), intent(in) :: h
      real(wp), intent(inout) :: d(n), l1(n), l2(n)
      real(wp), intent(out) :: middle(3, 3)
      logical, intent(out) :: ok
      real(wp) :: a(tiny_order, tiny_order), m1, m2
      integer :: i, j

      ok = .false.
      do i = 1, half
         if (.not. d(i) > 0.0_wp) return
         m1 = l1(i)/d(i)
         m2 = l2(i)/d(i)
         d(i + 1) = d(i + 1) - m1*l1(i)
         l1(i + 1) = l1(i + 1) - m1*l2(i)
         d(i + 2) = d(i + 2) - m2*l2(i)
         d(i) = -h/d(i)
         l1(i) = m1
         l2(i) = m2
      end do
      do i = n, n + 1 - half, -1
         if (.not. d(i) > 0.0_wp) return
         m1 = l1(i - 1)/d(i)
         m2 = l2(i - 2)/d(i)
         d(i - 1) = d(i - 1) - m1*l1(i - 1)
         l1(i - 2) = l1(i - 2) - m1*l2(i - 2)
         d(i - 2) = d(i - 2) - m2*l2(i - 2)
         d(i) = -h/d(i)
         l1(i) = m1
         l2(i) = m2
      end do
      a = 0.0_wp
      do j = 1, rows
         a(j, j) = d(half + j)
         if (j < rows) a(j + 1, j) = l1(half + j)
         if (j < rows - 1) a(j + 2, j) = l2(half + j)
      end do
      call invert_definite(rows, a, ok)
      middle = -h*a(1:3, 1:3)
   end subroutine twisted_factorize

   !> One step
   pure subroutine chain_step(self, form, loaded, p0, p1, q, v)
      class(linear_chain), intent(inout) :: self
      type(newmark_form), intent(in) :: form
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p0(self%n), p1(self%n)     !! loads, read where `loaded`
      real(wp), intent(inout) :: q(self%n), v(self%n)
      real(wp) :: edge(2, 2)

      associate (x => self%pool, n => self%n)
         if (self%width == 1) then
            if (loaded .or. self%damped) then
               call tridiagonal_inwards(n, self%half, form%half, self%damped, loaded, p0, p1, x(:, k0), x(:, k1), &
                  & x(:, c0), x(:, c1), x(:, d), x(:, l1), q, v, edge, x(:, z))
            else
               call free_inwards(n, self%half, form%half, x(:, k0), x(:, k1), x(:, d), x(:, l1), q, v, edge, &
                  & x(:, z))
            end if
         else
            call pentadiagonal_inwards(n, self%half, form%half, self%damped, loaded, p0, p1, x(:, k0), x(:, k1), &
               & x(:, k2), x(:, c0), x(:, c1), x(:, c2), x(:, d), x(:, l1), x(:, l2), q, v, edge, x(:, z))
         end if
         call solve_middle(self, form, loaded, p0, p1, x(:, k0), x(:, k1), x(:, k2), x(:, c0), x(:, c1), &
            & x(:, c2), x(:, l1), x(:, l2), q, v, edge, x(:, z))
         if (self%width == 1) then
            call tridiagonal_outwards(n, self%half, form%h, x(:, l1), x(:, z), q, v)
         else
            call pentadiagonal_outwards(n, self%half, form%h, x(:, l1), x(:, l2), x(:, z), q, v)
         end if
      end associate
   end subroutine chain_step

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

   !> x of the middle rows, left in z
   pure subroutine solve_middle(self, form, loaded, p0, p1, k0, k1, k2, c0, c1, c2, l1, l2, q, v, edge, z)
      type(linear_chain), intent(in) :: self
      type(newmark_form), intent(in) :: form
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(self%n) :: p0, p1, k0, k1, k2, c0, c1, c2, l1, l2, q, v
      real(wp), intent(in) :: edge(2, 2)                 !! eliminated residuals beside the middle
      real(wp), intent(inout) :: z(self%n)
      real(wp) :: r(3)
      integer :: i, j, last

      do i = 1, self%rows
         r(i) = residual(self%half + i, self%n, self%width, form%half, self%damped, loaded, p0, p1, &
            & k0, k1, k2, c0, c1, c2, q, v)
      end do
      i = self%half
      j = self%n + 1 - self%half
      last = self%rows
      r(1) = (r(1) - l1(i)*edge(1, 1)) - l2(i - 1)*edge(2, 1)
      r(last) = (r(last) - l1(j)*edge(1, 2)) - l2(j + 1)*edge(2, 2)
      if (last > 1) then
         r(2) = r(2) - l2(i)*edge(1, 1)
         r(last - 1) = r(last - 1) - l2(j)*edge(1, 2)
      end if
      do i = 1, last
         z(self%half + i) = self%middle(i, 1)*r(1)
         do j = 2, last
            z(self%half + i) = z(self%half + i) + self%middle(i, j)*r(j)
         end do
      end do
   end subroutine solve_middle

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
end module dynstep_linear_chain
