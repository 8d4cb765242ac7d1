! SPDX-License-Identifier: BSD-3-Clause
!> Stages of rational steps R(hA) of chains: linear systems M q'' + C q' + K q = P whose matrices
!> are symmetric and at most pentadiagonal.
!>
!> PROGRAMMING INTERFACE
!>
!>   width = pole_sweeps_width(m, c, k)                  1 or 2; 0: these kernels do not serve
!>   call s%init(n, width, most_poles, status)           1 to 4 poles
!>   call s%factorize(m, c, k, h, poles, trouble)        S_j = p_j^2 M + p_j h C + h^2 K, all j
!>   call s%increment(tau, w, q, v, dq, dv [, load])     one stage with the matrices of `factorize`
!>   call s%solve(j, x)                                  x = S_j^-1 x
!>
!> A stage is the increment
!>
!>   dq = sum_j w_j Re(tau_j x_qj),   S_j x_qj = h^2 (K q - P_j) - p_j h M v
!>   dv = sum_j w_j Re(tau_j x_vj),   S_j x_vj = h^2 K v + p_j h (K q + C v - P_j)
!>
!> with w_j = 2 for one of a pair of conjugate poles and 1 for a real pole.  Two right-hand sides
!> instead of one keep positions and velocities both accurate relative to themselves for all h
!> (from one, the other loses its digits at h omega = 1e-8 or 1e8).
!>
!> The real products are formed for a block of rows, vectorised along the rows; then the block is
!> eliminated with one SIMD lane per pole, both sides together.  Substitution is a second
!> sweep.  Up to two poles run from both ends of the chain at once towards `rows` rows in the
!> middle, so that one pole fills two lanes and two poles fill four; three and four run from one end.
!> Each row of L is read once for both sides and once per sweep.
!>
!> Why no pivoting.  For Re p > 0 and h > 0, M positive definite, C and K positive semidefinite,
!> T = S/p = p M + h C + (h^2/p) K has the positive definite real part
!> H = Re(p) M + h C + h^2 Re(1/p) K, and |x* Im(T) x| <= tan(a) x* H x with a = |arg p|.  The same
!> holds for every leading block T_k and every Schur complement.  So
!>
!>   |d_k| >= Re d_k >= the pivot of H,      |d_k| = 1/|(T_k^-1)_kk| <= H_kk/cos(a)^2,
!>
!> the latter since Re(T_k^-1) = (H + Im(T) H^-1 Im(T))^-1 >= cos(a)^2 H^-1: no pivot vanishes, and
!> none grows by more than 1/cos(a)^2.  (N. J. Higham, Math. Comp. 67 (1998), and A. George, Kh. D. Ikramov
!> and A. B. Kucherov, Numer. Linear Algebra Appl. 9 (2002), have the constants 3 and 3 sqrt(2) for
!> a <= pi/4.)  Pade's poles stay below a = 66 degrees up to (8,8).
!>
!> Other poles and matrices may work: `factorize` compares pivots and subtrahends with the size of
!> the diagonal in each row and refuses growth above most_growth, so that nothing depends on the
!> sufficient conditions.
module dynstep_pole_sweeps
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_diagonal, kind_identity, kind_zero, matrix_type
   use dynstep_pole_kernels, only: backward, factor, fill, forward, gather
   use dynstep_pole_middle, only: factor_middle, solve_middle
   use dynstep_pole_systems, only: add_load, arrays, c0, d, inwards, k0, l, m0, outwards, products, set_middle, set_systems, z
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: pole_sweeps_width

   !> Most poles of one object
   integer, parameter, public :: most_lanes = 4

   !> Rows whose products are formed before they are eliminated
   integer, parameter :: block = 64

   type, public :: pole_sweeps_type
      integer :: n = 0
      integer :: width = 0                        !! off-diagonals, 1 or 2
      integer :: most_poles = 0
      integer :: poles = 0                        !! of the last factorization
      real(wp) :: weakest(most_lanes) = 1.0_wp    !! its least pivots / size of their diagonal entries, at most 1
      integer, private :: lanes = 0               ! of one end: poles, or the next of 1, 2, 4
      integer, private :: ends = 2
      integer, private :: half = 0                ! rows eliminated from each end
      integer, private :: rows = 0                ! rows in the middle, 1..3, 0 from one end
      complex(wp), private :: middle(3, 3, most_lanes) = (0.0_wp, 0.0_wp)   ! inverse of each pole
      integer, private :: width_k = 0, width_c = -1, width_m = 0   ! -1: zero
      real(wp), private :: h = 0.0_wp
      complex(wp), private :: p(most_lanes) = (0.0_wp, 0.0_wp)
      integer, private :: at(arrays) = 1          ! where they begin
      real(wp), allocatable, private :: pool(:)
   contains
      procedure :: init => sweeps_init
      procedure :: factorize => sweeps_factorize
      procedure :: increment => sweeps_increment
      procedure :: solve => sweeps_solve
   end type pole_sweeps_type

contains

   !> Off-diagonals of the widest matrix, at least 1; 0 where one is dense, unsymmetric or wider than 2
   pure integer function pole_sweeps_width(m, c, k)
      type(matrix_type), intent(in) :: m, c, k
      pole_sweeps_width = max(1, width_of(m), width_of(c), width_of(k))
      if (pole_sweeps_width > 2) pole_sweeps_width = 0
   end function pole_sweeps_width

   !> Off-diagonals of a symmetric band, -1 of zero, many where it is none
   pure integer function width_of(a)
      type(matrix_type), intent(in) :: a
      select case (a%kind)
      case (kind_zero)
         width_of = -1
      case (kind_identity, kind_diagonal)
         width_of = 0
      case (kind_banded)
         width_of = merge(a%kl, huge(a%kl), a%symmetric .and. a%kl == a%ku)
      case default
         width_of = huge(a%kl)
      end select
   end function width_of

   !> Allocate
   recursive subroutine sweeps_init(self, n, width, most_poles, status)
      class(pole_sweeps_type), intent(inout) :: self
      integer, intent(in) :: n                !! order >= 1
      integer, intent(in) :: width            !! off-diagonals: 1 or 2
      integer, intent(in) :: most_poles       !! 1..4
      type(status_type), intent(inout) :: status
      integer, parameter :: line = 8          ! numbers in 64 bytes
      integer, parameter :: page = 512        ! numbers in 4096 bytes
      integer, parameter :: stagger = 56      ! 7 lines of cache
      integer :: sizes(arrays), i, lanes, next, stat

      if (status%failed()) return
      if (n < 1 .or. width < 1 .or. width > 2 .or. most_poles < 1 .or. most_poles > most_lanes) then
         call status%set(dynstep_invalid_input, 'pole sweeps of order '//text(n)//' with '//text(width) &
            & //' off-diagonals and '//text(most_poles)//' poles; they serve n >= 1, 1 or 2 off-diagonals, 1 to 4 poles')
         return
      end if
      self%n = n
      self%width = width
      self%most_poles = most_poles
      self%poles = 0
      lanes = lanes_of(most_poles)
      sizes = n + 2
      sizes(d) = 2*lanes*n
      sizes(l) = 2*width*lanes*(n + width)
      sizes(z) = 4*lanes*n
      next = 1
      do i = 1, arrays
         self%at(i) = next
         next = next + line*((sizes(i) + line - 1)/line)
         ! arrays that begin at the same offset of a page compete for one set of the cache
         if (n >= page) next = next + modulo(i*stagger - (next - 1), page)
      end do
      if (allocated(self%pool)) deallocate (self%pool)
      allocate (self%pool(next), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory to factorize '//text(n)//' rows for '//text(most_poles)//' poles')
         return
      end if
      self%pool = 0.0_wp
   end subroutine sweeps_init

   !> Lanes of the kernels that serve so many poles
   pure integer function lanes_of(poles)
      integer, intent(in) :: poles
      lanes_of = merge(most_lanes, poles, poles > 2)
   end function lanes_of

   !> Read the matrices, S_j = L_j D_j L_j^T
   pure subroutine sweeps_factorize(self, m, c, k, h, poles, trouble)
      class(pole_sweeps_type), intent(inout) :: self
      type(matrix_type), intent(in) :: m, c, k   !! symmetric, finite, at most `width` off-diagonals
      real(wp), intent(in) :: h                  !! step
      complex(wp), intent(in) :: poles(:)        !! one of each conjugate pair [1..most_poles]
      integer, intent(out) :: trouble            !! j: pivots of S_j too small or growing, which another factorization
                                                 !! has to judge; 0: none
      real(wp) :: failed(most_lanes)
      integer :: j

      self%poles = size(poles)
      self%lanes = lanes_of(self%poles)
      self%ends = merge(2, 1, self%lanes < most_lanes)
      self%half = self%n
      if (self%ends == 2) self%half = (self%n - self%width)/2
      self%rows = self%n - self%ends*self%half
      self%h = h
      self%width_m = width_of(m)
      self%width_c = width_of(c)
      self%width_k = width_of(k)
      self%p = (0.0_wp, 0.0_wp)
      do j = 1, self%lanes
         self%p(j) = poles(min(j, self%poles))
      end do
      call read_diagonals(self, m, m0)
      call read_diagonals(self, c, c0)
      call read_diagonals(self, k, k0)
      call set_systems(self%lanes, self%ends, self%width, self%n, self%half, h, self%p, self%at, self%pool, &
         & self%pool(self%at(d)), self%pool(self%at(l)), self%pool(self%at(z)))
      call factor_all(self, failed)
      do trouble = 1, self%poles
         if (failed(trouble) > 0.0_wp) return
      end do
      trouble = 0
   end subroutine sweeps_factorize

   !> Copy the diagonals of a matrix to arrays first, first + 1, first + 2, zeros beyond the corners
   pure subroutine read_diagonals(self, a, first)
      class(pole_sweeps_type), intent(inout) :: self
      type(matrix_type), intent(in) :: a
      integer, intent(in) :: first
      integer :: i, off, start

      do off = 0, 2
         start = self%at(first + off) - 1
         if (a%kind == kind_banded .and. off <= a%kl) then
            do i = 1, off
               self%pool(start + i) = 0.0_wp
            end do
            do i = off + 1, self%n
               self%pool(start + i) = a%a(a%ku + 1 + off, i - off)
            end do
         else if (off == 0 .and. a%kind == kind_diagonal) then
            self%pool(start + 1:start + self%n) = a%a(:, 1)
         else
            self%pool(start + 1:start + self%n) = merge(1.0_wp, 0.0_wp, off == 0 .and. a%kind == kind_identity)
         end if
      end do
   end subroutine read_diagonals

   !> Both ends, then the middle
   pure subroutine factor_all(self, failed)
      class(pole_sweeps_type), intent(inout) :: self
      real(wp), intent(out) :: failed(most_lanes)
      real(wp), dimension(most_lanes) :: bad, least, beside
      real(wp) :: s(6*most_lanes), natural(3)
      complex(wp) :: a(3, 3)
      integer :: j, end, lane

      bad = 0.0_wp
      least = 1.0_wp
      beside = 1.0_wp
      s = 0.0_wp
      call factor(self%ends*self%lanes, self%width, self%half, self%pool(self%at(z)), self%pool(self%at(d)), &
         & self%pool(self%at(l)), s, bad, least, beside)
      failed = 0.0_wp
      self%weakest = 1.0_wp
      do j = 1, self%poles
         do end = 1, self%ends
            lane = j + (end - 1)*self%lanes
            failed(j) = max(failed(j), bad(lane))
            self%weakest(j) = min(self%weakest(j), least(lane)/beside(lane))
         end do
         if (failed(j) > 0.0_wp .or. self%ends == 1) cycle
         call set_middle(self%n, self%half, self%rows, self%h, self%p(j), self%at, self%pool, a, natural)
         call factor_middle(j, self%lanes, self%width, self%half, self%rows, self%pool(self%at(d)), &
            & self%pool(self%at(l)), a, natural, self%middle(:, :, j), failed(j), self%weakest(j))
      end do
   end subroutine factor_all

   !> One stage; factors and matrices are those of `factorize`
   pure subroutine sweeps_increment(self, tau, w, q, v, dq, dv, load)
      class(pole_sweeps_type), intent(inout) :: self
      complex(wp), intent(in) :: tau(self%poles)        !! weights of the poles
      real(wp), intent(in) :: w(self%poles)             !! 2: one of a conjugate pair, 1: a real pole
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: dq(self%n), dv(self%n)   !! increments of q and v
      real(wp), intent(in), optional :: load(2, self%poles, self%n)   !! Re, Im of P_j
      real(wp) :: s(8*most_lanes), p(2*most_lanes), c(2*most_lanes), y(2*most_lanes*block)
      integer :: end, first, j, lane, lanes, low, rows

      lanes = self%ends*self%lanes
      c = 0.0_wp
      do end = 1, self%ends
         do j = 1, self%poles
            lane = j + (end - 1)*self%lanes
            c(lane) = w(j)*real(tau(j), wp)
            c(lanes + lane) = w(j)*aimag(tau(j))
         end do
      end do
      do j = 1, self%lanes
         p(j) = real(self%p(j), wp)
         p(self%lanes + j) = aimag(self%p(j))
      end do
      s = 0.0_wp
      do first = 1, self%half, block
         rows = min(block, self%half + 1 - first)
         do end = 1, self%ends
            low = merge(first, self%n + 2 - first - rows, end == 1)
            call fill_end(self, end, low, rows, p, q, v, self%pool, self%pool(self%at(z) + (first - 1)*4*lanes))
            if (present(load)) call add_load(self%poles, self%lanes, self%ends, rows, end, self%h, self%p, &
               & load(:, :, low:low + rows - 1), self%pool(self%at(z) + (first - 1)*4*lanes))
         end do
         call forward(lanes, self%width, rows, self%pool(self%at(d) + (first - 1)*2*lanes), &
            & self%pool(self%at(l) + (first - 1)*2*self%width*lanes), s, self%pool(self%at(z) + (first - 1)*4*lanes))
      end do
      if (self%ends == 2) then
         call stage_middle(self, tau, w, q, v, s, dq, dv, load)
      else
         s = 0.0_wp
      end if
      do first = 1 + block*((self%half + block - 1)/block - 1), 1, -block
         rows = min(block, self%half + 1 - first)
         call backward(lanes, self%width, rows, c, self%pool(self%at(l) + (first - 1)*2*self%width*lanes), &
            & self%pool(self%at(z) + (first - 1)*4*lanes), s, y)
         do end = 1, self%ends
            low = merge(first, self%n + 2 - first - rows, end == 1)
            call gather(self%lanes, self%ends, rows, end, y, dq(low), dv(low))
         end do
      end do
   end subroutine sweeps_increment

   !> Right-hand sides of some rows without their load
   pure subroutine fill_end(self, end, low, rows, p, q, v, pool, z)
      class(pole_sweeps_type), intent(in) :: self
      integer, intent(in) :: end, low, rows             !! rows low..low+rows-1
      real(wp), intent(in) :: p(2*self%lanes), q(self%n), v(self%n), pool(*)
      real(wp), intent(inout) :: z(*)
      real(wp) :: x(5*block)
      call products(self%n, low, rows, self%h, self%width_m, self%width_c, self%width_k, self%at, pool, q, v, x)
      call fill(self%lanes, self%ends, rows, end, x, p, z)
   end subroutine fill_end

   !> x of the middle rows, their increments, and the state with which the substitution begins
   pure subroutine stage_middle(self, tau, w, q, v, s, dq, dv, load)
      class(pole_sweeps_type), intent(in) :: self
      complex(wp), intent(in) :: tau(self%poles)
      real(wp), intent(in) :: w(self%poles), q(self%n), v(self%n)
      real(wp), intent(inout) :: s(self%lanes, 2, 2, 2, 2)   !! (pole, end, Re and Im, side, row)
      real(wp), intent(inout) :: dq(self%n), dv(self%n)
      real(wp), intent(in), optional :: load(2, self%poles, self%n)
      real(wp) :: x(15)
      complex(wp) :: u(3, 2), g(3)
      integer :: end, i, j, row, side

      associate (rows => self%rows, half => self%half)
         call products(self%n, half + 1, rows, self%h, self%width_m, self%width_c, self%width_k, self%at, self%pool, &
            & q, v, x)
         dq(half + 1:half + rows) = 0.0_wp
         dv(half + 1:half + rows) = 0.0_wp
         do j = 1, self%poles
            g = (0.0_wp, 0.0_wp)
            do i = 1, rows
               if (present(load)) g(i) = self%h*cmplx(load(1, j, half + i), load(2, j, half + i), wp)
               u(i, 1) = (x(i) - self%h*g(i)) + self%p(j)*x(rows + i)
               u(i, 2) = x(2*rows + i) + self%p(j)*(x(3*rows + i) - g(i))
            end do
            do side = 1, 2
               call solve_middle(j, self%lanes, self%width, half, rows, self%pool(self%at(l)), self%middle(:, :, j), &
                  & cmplx(s(j, :, 1, side, 1), s(j, :, 2, side, 1), wp), &
                  & cmplx(s(j, :, 1, side, 2), s(j, :, 2, side, 2), wp), u(1:rows, side))
            end do
            do i = 1, rows
               dq(half + i) = dq(half + i) + w(j)*real(tau(j)*u(i, 1), wp)
               dv(half + i) = dv(half + i) + w(j)*real(tau(j)*u(i, 2), wp)
            end do
            do i = 1, self%width
               do end = 1, 2
                  row = merge(i, rows + 1 - i, end == 1)
                  if (half < 1) cycle
                  s(j, end, 1, :, i) = real(u(row, :), wp)
                  s(j, end, 2, :, i) = aimag(u(row, :))
               end do
            end do
         end do
      end associate
   end subroutine stage_middle

   !> x = S_j^-1 x
   pure subroutine sweeps_solve(self, j, x)
      class(pole_sweeps_type), intent(in) :: self
      integer, intent(in) :: j                     !! number of the pole
      complex(wp), intent(inout) :: x(self%n)      !! right side in, solution out
      complex(wp) :: s1(2), s2(2)
      call inwards(self%lanes, self%ends, self%width, self%n, self%half, j, self%pool(self%at(d)), self%pool(self%at(l)), &
         & x, s1, s2)
      if (self%ends == 2) call solve_middle(j, self%lanes, self%width, self%half, self%rows, self%pool(self%at(l)), &
         & self%middle(:, :, j), s1, s2, x(self%half + 1:self%half + self%rows))
      call outwards(self%lanes, self%ends, self%width, self%n, self%half, j, self%pool(self%at(l)), x)
   end subroutine sweeps_solve
end module dynstep_pole_sweeps
