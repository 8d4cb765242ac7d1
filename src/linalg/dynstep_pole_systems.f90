! SPDX-License-Identifier: BSD-3-Clause
!> The matrices of dynstep_pole_sweeps and what does not run in lanes: entries of S, real products, loads,
!> and the solution of one complex system.
!>
!> Diagonals of K, C and M lie in one pool of numbers x from at(k0), at(k1), ... on: A(i,i), A(i,i-1) and
!> A(i,i-2) in element i, zeros beyond the corners up to i = n + 2.
module dynstep_pole_systems
   use dynstep_kinds, only: wp
   use dynstep_pole_kernels, only: band_product
   implicit none
   private

   public :: set_systems, set_middle, products, add_load, inwards, outwards

   ! arrays in the pool: diagonals (main, first and second below) of K, C and M, factors, right-hand sides
   integer, parameter, public :: k0 = 1, k1 = 2, k2 = 3, c0 = 4, c1 = 5, c2 = 6, m0 = 7, m1 = 8, m2 = 9
   integer, parameter, public :: d = 10, l = 11, z = 12, arrays = 12

contains

   !> Entries of S from both ends, and the sizes of the diagonal ones
   pure subroutine set_systems(poles, ends, width, n, half, h, p, at, x, d, l, natural)
      integer, intent(in) :: poles, ends, width, n, half, at(arrays)
      real(wp), intent(in) :: h
      complex(wp), intent(in) :: p(poles)
      real(wp), intent(in) :: x(*)                       !! the pool
      real(wp), intent(inout) :: d(poles, ends, 2, half)
      real(wp), intent(inout) :: l(poles, ends, 2, width, half + width)
      real(wp), intent(inout) :: natural(poles, ends, half)
      real(wp), dimension(4) :: ar, ai, br, bi, size_a, size_b
      real(wp) :: h2
      integer :: end, i, j, off, row, place

      h2 = h*h
      do j = 1, poles
         ar(j) = (real(p(j), wp) - aimag(p(j)))*(real(p(j), wp) + aimag(p(j)))
         ai(j) = 2.0_wp*real(p(j), wp)*aimag(p(j))
         br(j) = h*real(p(j), wp)
         bi(j) = h*aimag(p(j))
         size_a(j) = abs(ar(j)) + abs(ai(j))
         size_b(j) = abs(br(j)) + abs(bi(j))
      end do
      do end = 1, ends
         do i = 1, half
            row = merge(i, n + 1 - i, end == 1) - 1
            do j = 1, poles
               d(j, end, 1, i) = ar(j)*x(at(m0) + row) + (br(j)*x(at(c0) + row) + h2*x(at(k0) + row))
               d(j, end, 2, i) = ai(j)*x(at(m0) + row) + bi(j)*x(at(c0) + row)
               natural(j, end, i) = size_a(j)*abs(x(at(m0) + row)) + (size_b(j)*abs(x(at(c0) + row)) + h2*abs(x(at(k0) + row)))
            end do
         end do
         do i = 1, half + width
            do off = 1, width
               ! A(row,row-off) is kept at `row`; rows past the middle of one end have none
               place = merge(i, n + 1 - i + off, end == 1)
               if (ends == 1 .and. i > half .or. i - off > half .or. place < 1) place = n + 1
               place = place - 1
               do j = 1, poles
                  l(j, end, 1, off, i) = ar(j)*x(at(m0 + off) + place) + (br(j)*x(at(c0 + off) + place) &
                     & + h2*x(at(k0 + off) + place))
                  l(j, end, 2, off, i) = ai(j)*x(at(m0 + off) + place) + bi(j)*x(at(c0 + off) + place)
               end do
            end do
         end do
      end do
   end subroutine set_systems

   !> S of the middle rows, filled up by the identity, and the sizes of its diagonal entries
   pure subroutine set_middle(n, half, rows, h, p, at, x, a, natural)
      integer, intent(in) :: n, half, rows, at(arrays)
      real(wp), intent(in) :: h, x(*)
      complex(wp), intent(in) :: p
      complex(wp), intent(out) :: a(3, 3)
      real(wp), intent(out) :: natural(3)
      integer :: i, off, row
      a = (0.0_wp, 0.0_wp)
      natural = 1.0_wp
      do i = 1, 3
         a(i, i) = (1.0_wp, 0.0_wp)
      end do
      do i = 1, rows
         row = half + i - 1
         do off = 0, i - 1
            a(i, i - off) = (p*p)*x(at(m0 + off) + row) + ((p*h)*x(at(c0 + off) + row) + (h*h)*x(at(k0 + off) + row))
            a(i - off, i) = a(i, i - off)
         end do
         natural(i) = abs(p)**2*abs(x(at(m0) + row)) + (abs(p*h)*abs(x(at(c0) + row)) + h*h*abs(x(at(k0) + row)))
      end do
   end subroutine set_middle

   !> h^2 K q, -h M v, h^2 K v and h (K q + C v) of some rows
   pure subroutine products(n, first, rows, h, width_m, width_c, width_k, at, a, q, v, x)
      integer, intent(in) :: n, first, rows, width_m, width_c, width_k, at(arrays)
      real(wp), intent(in) :: h, a(*), q(n), v(n)
      real(wp), intent(out) :: x(rows, 5)                !! the last one is scratch
      integer :: i
      call band_product(width_k, n, a(at(k0)), a(at(k1)), a(at(k2)), q, first, rows, x(:, 4))
      call band_product(width_k, n, a(at(k0)), a(at(k1)), a(at(k2)), v, first, rows, x(:, 3))
      call band_product(width_m, n, a(at(m0)), a(at(m1)), a(at(m2)), v, first, rows, x(:, 2))
      do i = 1, rows
         x(i, 1) = (h*h)*x(i, 4)
         x(i, 2) = -h*x(i, 2)
         x(i, 3) = (h*h)*x(i, 3)
      end do
      if (width_c >= 0) then
         call band_product(width_c, n, a(at(c0)), a(at(c1)), a(at(c2)), v, first, rows, x(:, 5))
         do i = 1, rows
            x(i, 4) = x(i, 4) + x(i, 5)
         end do
      end if
      do i = 1, rows
         x(i, 4) = h*x(i, 4)
      end do
   end subroutine products

   !> Subtract h^2 P and p h P of some rows of one end
   pure subroutine add_load(poles, lanes, ends, rows, end, h, p, load, z)
      integer, intent(in) :: poles, lanes, ends, rows, end
      real(wp), intent(in) :: h
      complex(wp), intent(in) :: p(lanes)
      real(wp), intent(in) :: load(2, poles, rows)
      real(wp), intent(inout) :: z(lanes, ends, 4, rows)
      real(wp) :: pr, pi
      integer :: i, j, row
      do j = 1, poles
         pr = h*real(p(j), wp)
         pi = h*aimag(p(j))
         do i = 1, rows
            row = merge(i, rows + 1 - i, end == 1)
            z(j, end, 1, i) = z(j, end, 1, i) - (h*h)*load(1, j, row)
            z(j, end, 2, i) = z(j, end, 2, i) - (h*h)*load(2, j, row)
            z(j, end, 3, i) = z(j, end, 3, i) - (pr*load(1, j, row) - pi*load(2, j, row))
            z(j, end, 4, i) = z(j, end, 4, i) - (pr*load(2, j, row) + pi*load(1, j, row))
         end do
      end do
   end subroutine add_load

   pure subroutine inwards(lanes, ends, width, n, half, j, d, l, x, s1, s2)
      integer, intent(in) :: lanes, ends, width, n, half, j
      real(wp), intent(in) :: d(lanes, ends, 2, half), l(lanes, ends, 2, width, half + width)
      complex(wp), intent(inout) :: x(n)
      complex(wp), intent(out) :: s1(2), s2(2)     !! last rows of each end
      complex(wp) :: s
      integer :: end, i, row

      s1 = (0.0_wp, 0.0_wp)
      s2 = (0.0_wp, 0.0_wp)
      do end = 1, ends
         do i = 1, half
            row = merge(i, n + 1 - i, end == 1)
            s = x(row)
            if (width == 2) s = s - cmplx(l(j, end, 1, width, i), l(j, end, 2, width, i), wp)*s2(end)
            s = s - cmplx(l(j, end, 1, 1, i), l(j, end, 2, 1, i), wp)*s1(end)
            x(row) = s*cmplx(d(j, end, 1, i), d(j, end, 2, i), wp)
            s2(end) = s1(end)
            s1(end) = s
         end do
      end do
   end subroutine inwards

   pure subroutine outwards(lanes, ends, width, n, half, j, l, x)
      integer, intent(in) :: lanes, ends, width, n, half, j
      real(wp), intent(in) :: l(lanes, ends, 2, width, half + width)
      complex(wp), intent(inout) :: x(n)
      complex(wp) :: s, s1, s2
      integer :: end, i, row, step

      if (half < 1) return
      do end = 1, ends
         step = merge(1, -1, end == 1)
         row = merge(half, n + 1 - half, end == 1)
         s1 = (0.0_wp, 0.0_wp)
         s2 = (0.0_wp, 0.0_wp)
         if (ends == 2) s1 = x(row + step)
         if (ends == 2 .and. width == 2) s2 = x(row + 2*step)
         do i = half, 1, -1
            s = x(row)
            if (width == 2) s = s - cmplx(l(j, end, 1, width, i + width), l(j, end, 2, width, i + width), wp)*s2
            s = s - cmplx(l(j, end, 1, 1, i + 1), l(j, end, 2, 1, i + 1), wp)*s1
            x(row) = s
            s2 = s1
            s1 = s
            row = row - step
         end do
      end do
   end subroutine outwards
end module dynstep_pole_systems
