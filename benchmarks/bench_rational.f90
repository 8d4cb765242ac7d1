! SPDX-License-Identifier: BSD-3-Clause
!> One stage of a rational step R(hA) of a beam (M tridiagonal, K pentadiagonal, no C), two right-hand
!> sides for each pole: the library's kernels, LAPACK's complex band LU with loops for the
!> rest, and the real matrix R(hA) of order 2n.
program bench_rational
   use bench_clock, only: print_ratio, print_time, print_title, thread_seconds
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: banded_matrix, matrix_type, zero_matrix
   use dynstep_pole_sweeps, only: pole_sweeps_type
   use dynstep_rational, only: pade_rational, rational_type
   use dynstep_status, only: status_type
   implicit none

   interface
      subroutine dgemv(trans, m, n, alpha, a, lda, x, incx, beta, y, incy)
         import :: wp
         character(len=1), intent(in) :: trans
         integer, intent(in) :: m, n, lda, incx, incy
         real(wp), intent(in) :: alpha, beta, a(lda, *), x(*)
         real(wp), intent(inout) :: y(*)
      end subroutine dgemv
      subroutine zgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
         import :: wp
         integer, intent(in) :: m, n, kl, ku, ldab
         complex(wp), intent(inout) :: ab(ldab, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine zgbtrf
      subroutine zgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
         import :: wp
         character(len=1), intent(in) :: trans
         integer, intent(in) :: n, kl, ku, nrhs, ldab, ipiv(*), ldb
         complex(wp), intent(in) :: ab(ldab, *)
         complex(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine zgbtrs
   end interface

   integer, parameter :: repeats = 21
   integer, parameter :: work = 30000           ! rows times stages in a repeat
   real(wp), parameter :: h = 0.5_wp

   !> A beam of n elements; everything that one of the ways needs
   type :: beam_type
      integer :: n = 0
      integer :: pairs = 0
      complex(wp), allocatable :: poles(:), tau(:)
      real(wp), allocatable :: w(:), q(:), v(:), dq(:), dv(:)
      type(matrix_type) :: m, c, k
      type(pole_sweeps_type) :: sweeps
      complex(wp), allocatable :: lu(:, :, :), x(:, :)
      integer, allocatable :: order(:, :)
      real(wp), allocatable :: kq(:), kv(:), mv(:)
   end type beam_type

   call print_title('yardstick of this machine', 'ns')
   call print_time('multiplication and addition, dependent', dependent_operation())
   call own_and_lapack()
   call own_and_dense()

contains

   !> x = a x + b
   real(wp) function dependent_operation()
      real(wp), volatile :: kept
      real(wp) :: x, start
      integer :: i, r
      dependent_operation = huge(1.0_wp)
      kept = 1.0_wp
      do r = 1, repeats
         start = thread_seconds()
         x = kept
         do i = 1, 100000
            x = 0.999999_wp*x + 1.0e-6_wp
         end do
         kept = x
         dependent_operation = min(dependent_operation, 1.0e4_wp*(thread_seconds() - start))
      end do
   end function dependent_operation

   subroutine own_and_lapack()
      type(beam_type) :: beam
      real(wp) :: times(5)
      integer :: pairs, power, r
      character(len=40) :: name

      do power = 2, 5
         write (name, '("beam, n = ", i0)') 10**power
         call print_title(trim(name)//', complex band LU and loops against the library', 'ns/row')
         do pairs = 1, 4
            call make_beam(10**power, pairs, beam)
            times = huge(1.0_wp)
            do r = 1, repeats
               times(1) = min(times(1), lapack_factors(beam))
               times(2) = min(times(2), own_factors(beam, .false.))
               times(3) = min(times(3), lapack_stage(beam))
               times(4) = min(times(4), own_stage(beam))
               times(2) = min(times(2), own_factors(beam, .true.))
               times(5) = min(times(5), own_stage(beam))
            end do
            if (pairs == 1) then
               call print_time('factors, 1 pair, zgbtrf', times(1))
               call print_ratio('factors, 1 pair, library', times(2), times(1), '')
            end if
            write (name, '("stage, ", i0, " pairs")') pairs
            call print_time(trim(name)//', zgbtrs', times(3))
            call print_ratio(trim(name)//', library', times(4), times(3), merge('<= 0.15, <= 12 ns', '<= 0.15          ', &
               & pairs < 3))
            call print_ratio(trim(name)//', library, damped', times(5), times(3), '')
         end do
      end do
   end subroutine own_and_lapack

   subroutine own_and_dense()
      integer, parameter :: orders(3) = [20, 100, 1000]
      character(len=7), parameter :: goals(3) = ['       ', '<= 0.33', '<= 0.01']
      type(beam_type) :: beam
      real(wp), allocatable :: matrix(:, :), x(:), y(:)
      real(wp) :: times(2), start
      integer :: i, n, r, step, steps
      character(len=40) :: name

      call print_title('one matrix of order 2n and dgemv against a stage of 2 pairs', 'ns/row')
      do i = 1, 3
         n = orders(i)
         call make_beam(n, 2, beam)
         steps = max(2, work/n**2)
         allocate (matrix(2*n, 2*n), x(2*n), y(2*n))
         matrix = 1.0e-3_wp
         x = 1.0_wp
         times = huge(1.0_wp)
         times(1) = own_factors(beam, .false.)
         times = huge(1.0_wp)
         do r = 1, repeats
            start = thread_seconds()
            do step = 1, steps
               call dgemv('N', 2*n, 2*n, 1.0_wp, matrix, 2*n, x, 1, 0.0_wp, y, 1)
            end do
            times(1) = min(times(1), 1.0e9_wp*(thread_seconds() - start)/(real(steps, wp)*n))
            times(2) = min(times(2), own_stage(beam))
         end do
         write (name, '("n = ", i0)') n
         call print_time(trim(name)//', dgemv', times(1))
         call print_ratio(trim(name)//', library', times(2), times(1), goals(i))
         deallocate (matrix, x, y)
      end do
   end subroutine own_and_dense

   !> Pade's method of so many pairs of poles, its weights, and states
   subroutine make_beam(n, pairs, beam)
      integer, intent(in) :: n, pairs
      type(beam_type), intent(out) :: beam
      type(rational_type) :: rational
      type(status_type) :: status
      real(wp) :: k(5, n), m(3, n)
      complex(wp) :: numerator, slope
      integer :: i, j
      do i = 1, n
         k(:, i) = [1.0_wp, -4.0_wp, 6.0_wp, -4.0_wp, 1.0_wp]
         m(:, i) = [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp
      end do
      beam%n = n
      beam%pairs = pairs
      beam%m = banded_matrix(m, 1, 1, .true.)
      beam%k = banded_matrix(k, 2, 2, .true.)
      beam%c = zero_matrix(n)
      call pade_rational(2*pairs, 2*pairs, rational, status)
      beam%poles = rational%poles(1::2)
      allocate (beam%tau(pairs))
      do j = 1, pairs
         numerator = sum([(rational%num(i)*beam%poles(j)**i, i=0, 2*pairs)])
         slope = sum([(i*rational%den(i)*beam%poles(j)**(i - 1), i=1, 2*pairs)])
         beam%tau(j) = numerator/(beam%poles(j)*slope)
      end do
      beam%w = [(2.0_wp, j=1, pairs)]
      beam%q = [(sin(0.3_wp*i), i=1, n)]
      beam%v = [(cos(0.2_wp*i), i=1, n)]
      allocate (beam%dq(n), beam%dv(n), beam%lu(7, n, pairs), beam%x(n, 2), beam%order(n, pairs), beam%kq(n), beam%kv(n), &
         & beam%mv(n))
      call beam%sweeps%init(n, 2, pairs, status)
      if (status%failed()) print *, trim(status%message)
   end subroutine make_beam

   real(wp) function own_factors(beam, damped)
      type(beam_type), intent(inout) :: beam
      logical, intent(in) :: damped
      real(wp) :: start
      integer :: step, steps, trouble
      steps = max(1, work/(4*beam%n))
      start = thread_seconds()
      do step = 1, steps
         if (damped) then
            call beam%sweeps%factorize(beam%m, beam%k, beam%k, h, beam%poles, trouble)
         else
            call beam%sweeps%factorize(beam%m, beam%c, beam%k, h, beam%poles, trouble)
         end if
         if (trouble /= 0) print *, 'trouble', trouble
      end do
      own_factors = 1.0e9_wp*(thread_seconds() - start)/(real(steps, wp)*beam%n)
   end function own_factors

   real(wp) function own_stage(beam)
      type(beam_type), intent(inout) :: beam
      real(wp) :: start
      integer :: step, steps
      steps = max(2, work/beam%n)
      start = thread_seconds()
      do step = 1, steps
         call beam%sweeps%increment(beam%tau, beam%w, beam%q, beam%v, beam%dq, beam%dv)
      end do
      own_stage = 1.0e9_wp*(thread_seconds() - start)/(real(steps, wp)*beam%n)
   end function own_stage

   real(wp) function lapack_factors(beam)
      type(beam_type), intent(inout) :: beam
      real(wp) :: start
      integer :: i, info, j
      complex(wp) :: p
      start = thread_seconds()
      do j = 1, beam%pairs
         p = beam%poles(j)
         do i = 1, beam%n
            beam%lu(1:2, i, j) = (0.0_wp, 0.0_wp)
            beam%lu(3:7, i, j) = h*h*beam%k%a(:, i)
            beam%lu(4:6, i, j) = beam%lu(4:6, i, j) + p*p*beam%m%a(:, i)
         end do
         call zgbtrf(beam%n, beam%n, 2, 2, beam%lu(:, :, j), 7, beam%order(:, j), info)
         if (info /= 0) print *, 'zgbtrf', info
      end do
      lapack_factors = 1.0e9_wp*(thread_seconds() - start)/beam%n
   end function lapack_factors

   !> The same increments as own_stage, undamped
   real(wp) function lapack_stage(beam)
      type(beam_type), intent(inout) :: beam
      real(wp), parameter :: agreement = 1.0e-9_wp
      real(wp) :: start, difference
      integer :: i, info, j, step, steps
      complex(wp) :: p
      steps = max(1, work/(8*beam%n))
      call beam%sweeps%increment(beam%tau, beam%w, beam%q, beam%v, beam%dq, beam%dv)
      difference = maxval(abs(beam%dv))
      start = thread_seconds()
      do step = 1, steps
         call product_5(beam%n, beam%k%a, beam%q, beam%kq)
         call product_5(beam%n, beam%k%a, beam%v, beam%kv)
         call product_3(beam%n, beam%m%a, beam%v, beam%mv)
         beam%dq = 0.0_wp
         beam%dv = 0.0_wp
         do j = 1, beam%pairs
            p = beam%poles(j)
            do i = 1, beam%n
               beam%x(i, 1) = h*h*beam%kq(i) - (p*h)*beam%mv(i)
               beam%x(i, 2) = h*h*beam%kv(i) + (p*h)*beam%kq(i)
            end do
            call zgbtrs('N', beam%n, 2, 2, 2, beam%lu(:, :, j), 7, beam%order(:, j), beam%x, beam%n, info)
            do i = 1, beam%n
               beam%dq(i) = beam%dq(i) + beam%w(j)*real(beam%tau(j)*beam%x(i, 1), wp)
               beam%dv(i) = beam%dv(i) + beam%w(j)*real(beam%tau(j)*beam%x(i, 2), wp)
            end do
         end do
      end do
      lapack_stage = 1.0e9_wp*(thread_seconds() - start)/(real(steps, wp)*beam%n)
      if (abs(difference - maxval(abs(beam%dv))) > agreement) print *, 'the library differs', difference, maxval(abs(beam%dv))
   end function lapack_stage

   subroutine product_5(n, a, x, y)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(5, n), x(n)
      real(wp), intent(out) :: y(n)
      integer :: i, j
      do i = 3, n - 2
         y(i) = a(5, i - 2)*x(i - 2) + a(4, i - 1)*x(i - 1) + a(3, i)*x(i) + a(2, i + 1)*x(i + 1) + a(1, i + 2)*x(i + 2)
      end do
      do i = 1, n
         if (i > 2 .and. i < n - 1) cycle
         y(i) = 0.0_wp
         do j = max(1, i - 2), min(n, i + 2)
            y(i) = y(i) + a(3 + i - j, j)*x(j)
         end do
      end do
   end subroutine product_5

   subroutine product_3(n, a, x, y)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(3, n), x(n)
      real(wp), intent(out) :: y(n)
      integer :: i
      y(1) = a(2, 1)*x(1) + a(1, 2)*x(2)
      do i = 2, n - 1
         y(i) = a(3, i - 1)*x(i - 1) + a(2, i)*x(i) + a(1, i + 1)*x(i + 1)
      end do
      y(n) = a(3, n - 1)*x(n - 1) + a(2, n)*x(n)
   end subroutine product_3
end program bench_rational
