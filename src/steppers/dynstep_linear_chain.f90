! SPDX-License-Identifier: BSD-3-Clause
!> Chains: linear systems whose matrices are symmetric and tri- or pentadiagonal.
!>
!> PROGRAMMING INTERFACE
!>
!>   call chain%init(sys, status)                    where is_chain(sys)
!>   call chain%read_matrices(sys)
!>   call chain%factorize(s, scale, ok)              S = M + gamma h C + beta h^2 K
!>   call chain%step(form, loaded, p0, p1, q, v)     Newmark's increment form, scale = -h
!>   call chain%solve(x)                             x = S^-1 x, scale = 1
!>   call chain%multiply_add(matrix_k, alpha, x, y)  y = y + alpha K x
!>
!> S is eliminated from both ends at once towards `rows` rows in the middle, which are solved
!> as a small dense system.  A step of the increment form is two sweeps:
!>
!>   inwards    g(i) = (C v + K (q + h/2 v) - P)(i) - l1 g(i-1) - l2 g(i-2),  z(i) = -h g(i)/D(i)
!>   outwards   x(i) = z(i) - l1(i) x(i+1) - l2(i) x(i+2),   q = q + h (v + x/2),   v = v + x
!>
!> (i-1, i-2 and i+1, i+2 are counted from the nearer end).  One multiplication and one
!> addition per row and sweep depend on those of the row before, and the two ends do not
!> depend on each other; residual and update hide behind them.  Measured for 1000 masses at
!> 2.2 GHz: 2.4 ns a row; from one end only 8 cycles would be 3.6 ns (4.1 measured).
!> K is kept as it is, and h scales the pivots: a change of -h/D leaves S^-1 symmetric, so the
!> energy does not drift; rounding errors of h K would offset it.
!>
!> The arrays are columns of one pool whose starts differ modulo 4096 bytes: arrays that
!> begin at the same offset of a page compete for one set of the first-level cache.
module dynstep_linear_chain
   use dynstep_chain_sweeps, only: free_inwards, pentadiagonal_inwards, pentadiagonal_outwards, residual, &
      & tridiagonal_inwards, tridiagonal_outwards
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

   ! columns of the pool: diagonal, first and second off-diagonals of K, C and M, factors, right side
   integer, parameter :: k0 = 1, k1 = 2, k2 = 3, c0 = 4, c1 = 5, c2 = 6
   integer, parameter :: d = 7, l1 = 8, l2 = 9, z = 10, m0 = 11, columns = 13

   integer, parameter, public :: matrix_k = k0, matrix_c = c0, matrix_m = m0

   type, public :: linear_chain
      integer :: n = 0
      integer :: width = 0                        !! off-diagonals: 1 or 2
      logical :: damped = .false.                 !! there is a C
      integer :: half = 0                         !! rows eliminated from each end
      integer :: rows = 0                         !! rows in the middle, 1..3
      real(wp) :: middle(3, 3) = 0.0_wp           !! scale times the inverse of their matrix
      real(wp), allocatable, private :: pool(:, :)   ! [stride, columns]
   contains
      procedure :: init => chain_init
      procedure :: read_matrices => chain_read_matrices
      procedure :: factorize => chain_factorize
      procedure :: step => chain_step
      procedure :: solve => chain_solve
      procedure :: multiply_add => chain_multiply_add
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

   !> Copy the diagonals of the matrices
   pure subroutine chain_read_matrices(self, sys)
      class(linear_chain), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      integer :: off
      do off = 0, self%width
         call copy_diagonal(sys%k, off, self%pool(:, k0 + off))
         call copy_diagonal(sys%c, off, self%pool(:, c0 + off))
         call copy_diagonal(sys%m, off, self%pool(:, m0 + off))
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

   !> S = L D L^T from both ends, keeping scale/D; `ok` is false where a pivot is not positive
   pure subroutine chain_factorize(self, s, scale, ok)
      class(linear_chain), intent(inout) :: self
      type(matrix_type), intent(in) :: s
      real(wp), intent(in) :: scale              !! -h for `step`, 1 for `solve`
      logical, intent(out) :: ok
      integer :: off
      do off = 0, self%width
         call copy_diagonal(s, off, self%pool(:, d + off))
      end do
      if (self%width == 1) self%pool(:, l2) = 0.0_wp
      call twisted_factorize(self%n, self%half, self%rows, scale, self%pool(:, d), self%pool(:, l1), &
         & self%pool(:, l2), self%middle, ok)
   end subroutine chain_factorize

   !> In place: diagonal to scale/D, off-diagonals to those of L, counted from the nearer end
   pure subroutine twisted_factorize(n, half, rows, scale, d, l1, l2, middle, ok)
      integer, intent(in) :: n, half, rows
      real(wp), intent(in) :: scale
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
         d(i) = scale/d(i)
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
         d(i) = scale/d(i)
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
      middle = scale*a(1:3, 1:3)
   end subroutine twisted_factorize

   !> One step of the increment form
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

   !> x of the middle rows, left in z
   pure subroutine solve_middle(self, form, loaded, p0, p1, k0, k1, k2, c0, c1, c2, l1, l2, q, v, edge, z)
      type(linear_chain), intent(in) :: self
      type(newmark_form), intent(in) :: form
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(self%n) :: p0, p1, k0, k1, k2, c0, c1, c2, l1, l2, q, v
      real(wp), intent(in) :: edge(2, 2)                 !! eliminated residuals beside the middle
      real(wp), intent(inout) :: z(self%n)
      real(wp) :: r(3)
      integer :: i

      r = 0.0_wp
      do i = 1, self%rows
         r(i) = residual(self%half + i, self%n, self%width, form%half, self%damped, loaded, p0, p1, &
            & k0, k1, k2, c0, c1, c2, q, v)
      end do
      call pass_edges(self%n, self%half, self%rows, l1, l2, edge, r)
      do i = 1, self%rows
         z(self%half + i) = self%middle(i, 1)*r(1) + (self%middle(i, 2)*r(2) + self%middle(i, 3)*r(3))
      end do
   end subroutine solve_middle

   !> x = S^-1 x, where the scale of `factorize` is 1
   pure subroutine chain_solve(self, x)
      class(linear_chain), intent(in) :: self
      real(wp), intent(inout) :: x(self%n)
      associate (f => self%pool)
         call twisted_solve(self%n, self%half, self%rows, f(:, d), f(:, l1), f(:, l2), self%middle, x)
      end associate
   end subroutine chain_solve

   pure subroutine twisted_solve(n, half, rows, d, l1, l2, middle, x)
      integer, intent(in) :: n, half, rows
      real(wp), intent(in) :: d(n), l1(n), l2(n), middle(3, 3)
      real(wp), intent(inout) :: x(n)
      real(wp) :: f, f1, g, g1, s, r(3)
      integer :: i, j

      f1 = x(1)
      g1 = x(n)
      f = x(2) - l1(1)*f1
      g = x(n - 1) - l1(n)*g1
      x(1) = f1*d(1)
      x(n) = g1*d(n)
      x(2) = f*d(2)
      x(n - 1) = g*d(n - 1)
      do i = 3, half
         j = n + 1 - i
         s = (x(i) - l2(i - 2)*f1) - l1(i - 1)*f
         f1 = f
         f = s
         s = (x(j) - l2(j + 2)*g1) - l1(j + 1)*g
         g1 = g
         g = s
         x(i) = f*d(i)
         x(j) = g*d(j)
      end do
      r = 0.0_wp
      r(1:rows) = x(half + 1:half + rows)
      call pass_edges(n, half, rows, l1, l2, reshape([f, f1, g, g1], [2, 2]), r)
      do i = 1, rows
         x(half + i) = middle(i, 1)*r(1) + (middle(i, 2)*r(2) + middle(i, 3)*r(3))
      end do
      do i = half, 1, -1
         j = n + 1 - i
         x(i) = (x(i) - l2(i)*x(i + 2)) - l1(i)*x(i + 1)
         x(j) = (x(j) - l2(j)*x(j - 2)) - l1(j)*x(j - 1)
      end do
   end subroutine twisted_solve

   !> What the eliminated rows beside the middle leave there
   pure subroutine pass_edges(n, half, rows, l1, l2, edge, r)
      integer, intent(in) :: n, half, rows
      real(wp), intent(in) :: l1(n), l2(n)
      real(wp), intent(in) :: edge(2, 2)           !! residuals of the last rows of each end
      real(wp), intent(inout) :: r(3)
      integer :: i, j
      i = half
      j = n + 1 - half
      r(1) = (r(1) - l1(i)*edge(1, 1)) - l2(i - 1)*edge(2, 1)
      r(rows) = (r(rows) - l1(j)*edge(1, 2)) - l2(j + 1)*edge(2, 2)
      if (rows == 1) return
      r(2) = r(2) - l2(i)*edge(1, 1)
      r(rows - 1) = r(rows - 1) - l2(j)*edge(1, 2)
   end subroutine pass_edges

   !> y = y + alpha A x, A = M, C or K
   pure subroutine chain_multiply_add(self, which, alpha, x, y)
      class(linear_chain), intent(in) :: self
      integer, intent(in) :: which                 !! matrix_m, matrix_c or matrix_k
      real(wp), intent(in) :: alpha
      real(wp), intent(in) :: x(self%n)
      real(wp), intent(inout) :: y(self%n)
      integer :: i
      associate (n => self%n, a0 => self%pool(:, which), a1 => self%pool(:, which + 1), &
         & a2 => self%pool(:, which + 2))
         if (self%width == 1) then
            y(1) = y(1) + alpha*(a0(1)*x(1) + a1(1)*x(2))
            do i = 2, n - 1
               y(i) = y(i) + alpha*((a1(i - 1)*x(i - 1) + a0(i)*x(i)) + a1(i)*x(i + 1))
            end do
            y(n) = y(n) + alpha*(a1(n - 1)*x(n - 1) + a0(n)*x(n))
         else
            do i = 1, 2
               y(i) = y(i) + alpha*((a0(i)*x(i) + a1(i)*x(i + 1)) + a2(i)*x(i + 2))
            end do
            y(2) = y(2) + alpha*(a1(1)*x(1))
            do i = 3, n - 2
               y(i) = y(i) + alpha*(((a2(i - 2)*x(i - 2) + a1(i - 1)*x(i - 1)) + a0(i)*x(i)) &
                  & + (a1(i)*x(i + 1) + a2(i)*x(i + 2)))
            end do
            do i = n - 1, n
               y(i) = y(i) + alpha*((a0(i)*x(i) + a1(i - 1)*x(i - 1)) + a2(i - 2)*x(i - 2))
            end do
            y(n - 1) = y(n - 1) + alpha*(a1(n - 1)*x(n))
         end if
      end associate
   end subroutine chain_multiply_add
end module dynstep_linear_chain
