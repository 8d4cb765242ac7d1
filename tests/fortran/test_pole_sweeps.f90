! SPDX-License-Identifier: BSD-3-Clause
!> Stages of rational steps by own kernels, against dense complex systems; small complex LU.
!>
!> x = S^-1 r by L D L^T with bounded growth, and by LU with pivoting, have backward errors of a few
!> eps.  Matrices with condition numbers below 100 then agree to a few hundred eps of the largest element.
module test_pole_sweeps
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: banded_matrix, dense_matrix, diagonal_matrix, identity_matrix, kind_banded, kind_diagonal, &
      & kind_identity, kind_zero, matrix_type, zero_matrix
   use dynstep_pole_sweeps, only: pole_sweeps_type, pole_sweeps_width
   use dynstep_small_complex, only: complex_factorize, complex_solve
   use dynstep_status, only: status_type
   use random_matrices, only: full, random, random_matrix
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_pole_sweeps

   real(wp), parameter :: eps = epsilon(1.0_wp)

   !> Poles of Pade's (4,4), one further out, a real one
   complex(wp), parameter :: poles(4) = [(5.79242120564_wp, 1.73446825787_wp), (4.20757879436_wp, 5.31483608371_wp), &
      & (3.1_wp, 0.0_wp), (2.0_wp, 9.0_wp)]
   complex(wp), parameter :: tau(4) = [(0.7_wp, -0.4_wp), (-0.3_wp, 1.1_wp), (0.2_wp, 0.0_wp), (0.5_wp, 0.6_wp)]
   real(wp), parameter :: w(4) = [2.0_wp, 2.0_wp, 1.0_wp, 2.0_wp]

contains

   subroutine collect_pole_sweeps(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('stages against dense systems', test_stages), &
         & new_unittest('long chains', test_long), &
         & new_unittest('stiff and soft', test_extremes), &
         & new_unittest('growth of pivots', test_growth), &
         & new_unittest('bits', test_bits), &
         & new_unittest('refusals', test_refusals), &
         & new_unittest('small complex systems', test_small)]
   end subroutine collect_pole_sweeps

   !> Symmetric positive definite; kind_banded of `width` off-diagonals below 1/2 in sum
   function definite(seed, kind, n, width) result(a)
      integer(int64), intent(inout) :: seed
      integer, intent(in) :: kind, n, width
      type(matrix_type) :: a
      integer :: kl
      kl = min(width, n - 1)
      a = random_matrix(seed, kind, n, kl, kl, .true., 4.5_wp)
      if (kind == kind_zero) a = zero_matrix(n)
   end function definite

   subroutine test_stages(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: orders(7) = [1, 2, 3, 4, 5, 50, 131]
      integer, parameter :: kinds_m(4) = [kind_identity, kind_diagonal, kind_banded, kind_banded]
      integer, parameter :: kinds_c(4) = [kind_zero, kind_diagonal, kind_banded, kind_zero]
      integer, parameter :: kinds_k(4) = [kind_banded, kind_banded, kind_banded, kind_diagonal]
      integer :: i, kinds, width, count
      integer(int64) :: seed
      seed = 11
      do i = 1, size(orders)
         do kinds = 1, 4
            do width = 1, 2
               do count = 1, merge(4, 2, orders(i) < 100)
                  call compare_stage(error, seed, orders(i), kinds_m(kinds), kinds_c(kinds), kinds_k(kinds), width, count, &
                     & .false.)
                  call compare_stage(error, seed, orders(i), kinds_m(kinds), kinds_c(kinds), kinds_k(kinds), width, count, &
                     & .true.)
               end do
            end do
         end do
      end do
   end subroutine test_stages

   subroutine compare_stage(error, seed, n, kind_m, kind_c, kind_k, width, count, loaded)
      type(error_type), allocatable, intent(inout) :: error
      integer(int64), intent(inout) :: seed
      integer, intent(in) :: n, kind_m, kind_c, kind_k, width, count
      logical, intent(in) :: loaded
      real(wp), parameter :: h = 0.7_wp
      type(matrix_type) :: m, c, k
      type(pole_sweeps_type) :: s
      type(status_type) :: status
      real(wp), dimension(n) :: q, v, dq, dv, expected_q, expected_v, r, columns
      real(wp) :: load(2, count, n), of_m(n, n), of_c(n, n), of_k(n, n), sizes
      complex(wp) :: a(n, n), p, p_j(n), x(n), y(n), z(n)
      integer :: i, j, order(n), singular, trouble
      real(wp) :: weakest
      character(len=80) :: what

      write (what, '("n = ", i0, ", kinds", 3(1x, i0), ", width ", i0, ", ", i0, " poles, load ", l1)') n, kind_m, kind_c, kind_k, &
         & width, count, loaded
      m = definite(seed, kind_m, n, width)
      c = definite(seed, kind_c, n, width)
      k = definite(seed, kind_k, n, width)
      of_m = full(m)
      of_c = full(c)
      of_k = full(k)
      do i = 1, n
         q(i) = random(seed)
         v(i) = random(seed)
         do j = 1, count
            load(:, j, i) = [random(seed), random(seed)]
         end do
      end do
      if (.not. loaded) load = 0.0_wp
      call s%init(n, max(1, min(width, n - 1)), 4, status)
      call check(error,.not. status%failed(), what)
      call s%factorize(m, c, k, h, poles(:count), trouble)
      call check(error, trouble, 0, trim(what)//': trouble')
      if (loaded) then
         call s%increment(tau, w, q, v, dq, dv, load)
      else
         call s%increment(tau, w, q, v, dq, dv)
      end if
      expected_q = 0.0_wp
      expected_v = 0.0_wp
      sizes = 0.0_wp
      do j = 1, count
         p = poles(j)
         a = p*p*of_m + p*h*of_c + h*h*of_k
         p_j = cmplx(load(1, j, :), load(2, j, :), wp)
         x = h*h*(matmul(of_k, q) - p_j) - p*h*matmul(of_m, v)
         y = h*h*matmul(of_k, v) + p*h*(matmul(of_k, q) + matmul(of_c, v) - p_j)
         z = x
         call complex_factorize(n, a, order, r, columns, singular, weakest)
         call check(error, singular, 0, trim(what)//': singular')
         call complex_solve(n, a, order, x)
         call complex_solve(n, a, order, y)
         call s%solve(j, z)
         call check(error, maxval(abs(z - x)), 0.0_wp, trim(what)//': solve', thr=300*eps*maxval(abs(x)))
         expected_q = expected_q + w(j)*real(tau(j)*x, wp)
         expected_v = expected_v + w(j)*real(tau(j)*y, wp)
         sizes = sizes + 2*abs(tau(j))*max(maxval(abs(x)), maxval(abs(y)))
      end do
      call check(error, maxval(abs(dq - expected_q)), 0.0_wp, trim(what)//': dq', thr=300*eps*sizes)
      call check(error, maxval(abs(dv - expected_v)), 0.0_wp, trim(what)//': dv', thr=300*eps*sizes)
   end subroutine compare_stage

   !> Uniform beam or bar with n masses, its highest frequency 4 or 2
   subroutine uniform(width, n, m, k)
      integer, intent(in) :: width, n
      type(matrix_type), intent(out) :: m, k
      real(wp) :: band(2*width + 1, n), mass(3, n)
      integer :: i
      do i = 1, n
         if (width == 1) band(:, i) = [-1.0_wp, 2.0_wp, -1.0_wp]
         if (width == 2) band(:, i) = [1.0_wp, -4.0_wp, 6.0_wp, -4.0_wp, 1.0_wp]
         mass(:, i) = [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp
      end do
      m = banded_matrix(mass, 1, 1, .true.)
      k = banded_matrix(band, width, width, .true.)
   end subroutine uniform

   !> Real and imaginary parts of S x - r, and the sum of sizes of its terms
   subroutine residual_of(m, c, k, h, p, x, r, residual, sizes)
      type(matrix_type), intent(in) :: m, c, k
      real(wp), intent(in) :: h
      complex(wp), intent(in) :: p, x(:), r(:)
      real(wp), intent(out) :: residual, sizes
      complex(wp) :: s, t
      integer :: i, j
      residual = 0.0_wp
      sizes = tiny(1.0_wp)
      do i = 1, size(x)
         s = -r(i)
         do j = max(1, i - 2), min(size(x), i + 2)
            t = (p*p*m%entry(i, j) + p*h*c%entry(i, j) + h*h*k%entry(i, j))*x(j)
            s = s + t
            sizes = max(sizes, abs(t))
         end do
         residual = max(residual, abs(s))
         sizes = max(sizes, abs(r(i)))
      end do
   end subroutine residual_of

   !> Backward errors of both sides at n = 1000, poles alone and together
   subroutine test_long(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 1000
      type(matrix_type) :: m, c, k
      type(pole_sweeps_type) :: s
      type(status_type) :: status
      complex(wp) :: x(n), r(n)
      real(wp) :: q(n), v(n), dq(n), dv(n), sum_q(n), sum_v(n), residual, sizes
      integer :: width, i, j, trouble
      integer(int64) :: seed
      seed = 5
      do width = 1, 2
         call uniform(width, n, m, k)
         c = k
         c%a = 0.01_wp*k%a
         do i = 1, n
            q(i) = random(seed)
            v(i) = random(seed)
            r(i) = cmplx(random(seed), random(seed), wp)
         end do
         call s%init(n, width, 4, status)
         call s%factorize(m, c, k, 2.0_wp, poles, trouble)
         call check(error, trouble, 0, 'trouble')
         call s%increment(tau, w, q, v, dq, dv)
         do j = 1, 4
            x = r
            call s%solve(j, x)
            call residual_of(m, c, k, 2.0_wp, poles(j), x, r, residual, sizes)
            call check(error, residual, 0.0_wp, 'backward error', thr=20*eps*sizes)
         end do
         sum_q = dq
         sum_v = dv
         do j = 1, 4
            call s%factorize(m, c, k, 2.0_wp, poles(j:j), trouble)
            call s%increment(tau(j:j), w(j:j), q, v, dq, dv)
            sum_q = sum_q - dq
            sum_v = sum_v - dv
         end do
         ! increments are of size 1
         call check(error, maxval(abs(sum_q)), 0.0_wp, 'poles one by one, q', thr=100*eps)
         call check(error, maxval(abs(sum_v)), 0.0_wp, 'poles one by one, v', thr=100*eps)
      end do
   end subroutine test_long

   !> h omega = 1e-8 ... 1e8 in one system of equations that do not depend on each other: each of
   !> them to rounding errors; and in coupled ones: backward errors
   subroutine test_extremes(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 33
      type(matrix_type) :: m, c, k
      type(pole_sweeps_type) :: s
      type(status_type) :: status
      real(wp), dimension(n) :: q, v, dq, dv, omega
      real(wp) :: expected_q, expected_v, size_q, size_v, h, residual, sizes
      complex(wp) :: x, y, z, r(n), u(n)
      integer :: i, j, power, trouble, width
      integer(int64) :: seed
      seed = 8
      omega = [(10.0_wp**(0.5_wp*(i - 17)), i=1, n)]
      m = diagonal_matrix([(1.0_wp + 0.1_wp*random(seed), i=1, n)])
      k = diagonal_matrix(omega**2)
      c = diagonal_matrix(0.1_wp*omega)
      q = [(random(seed), i=1, n)]
      v = [(random(seed), i=1, n)]*omega
      h = 1.0_wp
      call s%init(n, 2, 4, status)
      call s%factorize(m, c, k, h, poles, trouble)
      call check(error, trouble, 0, 'trouble')
      call s%increment(tau, w, q, v, dq, dv)
      do i = 1, n
         expected_q = 0.0_wp
         expected_v = 0.0_wp
         size_q = 0.0_wp
         size_v = 0.0_wp
         do j = 1, 4
            z = poles(j)**2*m%a(i, 1) + poles(j)*h*c%a(i, 1) + h*h*k%a(i, 1)
            x = tau(j)*(h*h*k%a(i, 1)*q(i) - poles(j)*h*m%a(i, 1)*v(i))/z
            y = tau(j)*(h*h*k%a(i, 1)*v(i) + poles(j)*h*(k%a(i, 1)*q(i) + c%a(i, 1)*v(i)))/z
            expected_q = expected_q + w(j)*real(x, wp)
            expected_v = expected_v + w(j)*real(y, wp)
            size_q = size_q + abs(x) + abs(tau(j)*poles(j)*h*m%a(i, 1)*v(i)/z)
            size_v = size_v + abs(y) + abs(tau(j)*h*h*k%a(i, 1)*v(i)/z)
         end do
         call check(error, dq(i), expected_q, 'q alone', thr=20*eps*size_q)
         call check(error, dv(i), expected_v, 'v alone', thr=20*eps*size_v)
      end do
      do width = 1, 2
         call uniform(width, n, m, k)
         do power = -8, 8
            do i = 0, 1
               c = zero_matrix(n)
               if (i == 1) c = k
               h = 10.0_wp**power
               call s%init(n, width, 4, status)
               call s%factorize(m, c, k, h, poles, trouble)
               call check(error, trouble, 0, 'trouble in a coupled chain')
               do j = 1, 4
                  u = [(cmplx(random(seed), random(seed), wp), trouble=1, n)]
                  r = u
                  call s%solve(j, u)
                  call residual_of(m, c, k, h, poles(j), u, r, residual, sizes)
                  call check(error, residual, 0.0_wp, 'backward error of a coupled chain', thr=20*eps*sizes)
               end do
            end do
         end do
      end do
   end subroutine test_extremes

   !> Directions of Re p > 0, in which growth is bounded; singular and growing ones are told
   subroutine test_growth(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 40
      type(matrix_type) :: m, c, k
      type(pole_sweeps_type) :: s
      type(status_type) :: status
      complex(wp) :: p(1), p_of(4), x(n), r(n)
      real(wp) :: h, residual, sizes
      integer :: angle, count, i, power, trouble, width
      integer(int64) :: seed
      seed = 3
      do width = 1, 2
         call s%init(n, width, 1, status)
         do angle = 0, 85, 5
            p = 5.0_wp*cmplx(cos(angle*acos(-1.0_wp)/180), sin(angle*acos(-1.0_wp)/180), wp)
            do power = -4, 4
               h = 10.0_wp**power
               call uniform(width, n, m, k)
               c = definite(seed, kind_banded, n, width)
               call s%factorize(m, c, k, h, p, trouble)
               call check(error, trouble, 0, 'definite matrices')
               r = [(cmplx(random(seed), random(seed), wp), i=1, n)]
               x = r
               call s%solve(1, x)
               call residual_of(m, c, k, h, p(1), x, r, residual, sizes)
               call check(error, residual, 0.0_wp, 'backward error', thr=40*eps*sizes)
            end do
         end do
      end do
      ! the pole 2i of one oscillator, and a leading entry that vanishes
      call s%init(1, 1, 1, status)
      call s%factorize(identity_matrix(1), zero_matrix(1), diagonal_matrix([4.0_wp]), 1.0_wp, [(0.0_wp, 2.0_wp)], trouble)
      call check(error, trouble, 1, 'pole on the spectrum')
      ! rows of a chain that are eliminated one by one, whatever the number of poles
      do width = 1, 2
         call s%init(n, width, 4, status)
         k = diagonal_matrix([4.0_wp, (9.0_wp, i=2, n)])
         call s%factorize(identity_matrix(n), zero_matrix(n), k, 1.0_wp, [(1.0_wp, 2.0_wp), (0.0_wp, 2.0_wp)], trouble)
         call check(error, trouble, 2, 'pole on the spectrum of a chain')
         call uniform(width, n, m, k)
         k%a(width + 1, :) = 9.0_wp
         k%a(width + 1, 1) = 4.0_wp
         do count = 1, 4
            p_of = (1.0_wp, 2.0_wp)
            p_of(count) = (0.0_wp, 2.0_wp)
            call s%factorize(identity_matrix(n), zero_matrix(n), k, 1.0_wp, p_of(:count), trouble)
            call check(error, trouble, count, 'vanishing leading entry')
            p_of(count) = (1.0e-5_wp, 2.0_wp)
            call s%factorize(identity_matrix(n), zero_matrix(n), k, 1.0_wp, p_of(:count), trouble)
            call check(error, trouble, count, 'growth')
            call check(error, s%weakest(count) < 1.0e-4_wp, 'weakest pivot')
            if (count > 1) call check(error, s%weakest(1) > 0.1_wp, 'weakest pivot of another pole')
            p_of = (1.0_wp, 2.0_wp)
            call s%factorize(identity_matrix(n), zero_matrix(n), k, 1.0_wp, p_of(:count), trouble)
            call check(error, trouble, 0, 'and after that another pole')
         end do
      end do
   end subroutine test_growth

   !> The same numbers give the same bits: repeated, in a copy, in an object made for more poles
   subroutine test_bits(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 777
      type(matrix_type) :: m, k
      type(pole_sweeps_type) :: s, t, larger
      type(status_type) :: status
      real(wp), dimension(n) :: q, v, dq, dv, again_q, again_v
      integer :: count, i, trouble, width
      integer(int64) :: seed
      seed = 21
      q = [(random(seed), i=1, n)]
      v = [(random(seed), i=1, n)]
      do width = 1, 2
         call uniform(width, n, m, k)
         do count = 1, 4
            call s%init(n, width, count, status)
            call s%factorize(m, zero_matrix(n), k, 0.5_wp, poles(:count), trouble)
            call s%increment(tau, w, q, v, dq, dv)
            t = s
            call s%increment(tau, w, q, v, again_q, again_v)
            call check(error, all(abs(again_q - dq) + abs(again_v - dv) <= 0.0_wp), 'repeated')
            call t%increment(tau, w, q, v, again_q, again_v)
            call check(error, all(abs(again_q - dq) + abs(again_v - dv) <= 0.0_wp), 'in a copy')
            call larger%init(n, width, 4, status)
            call larger%factorize(m, zero_matrix(n), k, 0.5_wp, poles, trouble)
            call larger%factorize(m, zero_matrix(n), k, 0.5_wp, poles(:count), trouble)
            call larger%increment(tau, w, q, v, again_q, again_v)
            call check(error, all(abs(again_q - dq) + abs(again_v - dv) <= 0.0_wp), 'in a larger object')
         end do
      end do
   end subroutine test_bits

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(pole_sweeps_type) :: s
      type(status_type) :: status
      type(matrix_type) :: tri, penta, one
      integer :: i
      call uniform(2, 9, tri, penta)
      one = identity_matrix(9)
      call check(error, pole_sweeps_width(one, zero_matrix(9), one), 1, 'diagonal')
      call check(error, pole_sweeps_width(one, one, tri), 1, 'tridiagonal')
      call check(error, pole_sweeps_width(tri, penta, one), 2, 'pentadiagonal')
      call check(error, pole_sweeps_width(one, zero_matrix(9), dense_matrix(full(tri), .true.)), 0, 'dense')
      tri%symmetric = .false.
      call check(error, pole_sweeps_width(one, penta, tri), 0, 'unsymmetric')
      call check(error, pole_sweeps_width(one, one, banded_matrix(reshape([(1.0_wp, i=1, 63)], [7, 9]), 3, 3, .true.)), 0, 'wide')
      call refused(0, 1, 1)
      call refused(1, 0, 1)
      call refused(1, 3, 1)
      call refused(1, 1, 0)
      call refused(1, 1, 5)
   contains
      subroutine refused(n, width, most)
         integer, intent(in) :: n, width, most
         type(status_type) :: fresh
         status = fresh
         call s%init(n, width, most, status)
         call check(error, status%failed(), 'wrong arguments')
      end subroutine refused
   end subroutine test_refusals

   !> Backward errors, units, singular matrices
   subroutine test_small(error)
      type(error_type), allocatable, intent(out) :: error
      complex(wp), allocatable :: a(:, :), f(:, :), x(:), b(:)
      real(wp), allocatable :: r(:), c(:)
      real(wp) :: scales_r(40), scales_c(40)
      real(wp) :: weakest, residual, sizes
      integer, allocatable :: order(:)
      integer :: i, j, n, singular, units
      integer(int64) :: seed
      seed = 77
      do n = 1, 40
         do units = 0, 1
            allocate (a(n, n), x(n), order(n))
            r = [(10.0_wp**(units*4*random(seed)), i=1, n)]
            c = [(10.0_wp**(units*4*random(seed)), i=1, n)]
            do j = 1, n
               do i = 1, n
                  a(i, j) = r(i)*c(j)*cmplx(random(seed), random(seed), wp)
               end do
            end do
            b = [(r(i)*cmplx(random(seed), random(seed), wp), i=1, n)]
            f = a
            x = b
            call complex_factorize(n, f, order, scales_r, scales_c, singular, weakest)
            call check(error, singular, 0, 'random matrix')
            call complex_solve(n, f, order, x)
            residual = 0.0_wp
            sizes = 0.0_wp
            do i = 1, n
               residual = max(residual, abs(sum(a(i, :)*x) - b(i))/r(i))
               sizes = max(sizes, sum(abs(a(i, :)*x))/r(i))
            end do
            call check(error, residual, 0.0_wp, 'backward error', thr=10*n*eps*sizes)
            if (n > 1) then
               f = a
               f(:, n) = 0.0_wp
               do j = 1, n - 1
                  f(:, n) = f(:, n) + f(:, j)*(c(n)/c(j))*merge(1.0_wp, 0.0_wp, j < 3)
               end do
               call complex_factorize(n, f, order, scales_r, scales_c, singular, weakest)
               call check(error, singular > 0 .or. weakest < 10*n*eps, 'dependent columns')
            end if
            f = a
            f(:, (n + 1)/2) = 0.0_wp
            call complex_factorize(n, f, order, scales_r, scales_c, singular, weakest)
            call check(error, singular > 0, 'a column of zeros')
            f = a
            f((n + 1)/2, :) = 0.0_wp
            call complex_factorize(n, f, order, scales_r, scales_c, singular, weakest)
            call check(error, singular > 0, 'a row of zeros')
            deallocate (a, x, order)
         end do
      end do
   end subroutine test_small
end module test_pole_sweeps
