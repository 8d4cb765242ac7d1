! SPDX-License-Identifier: BSD-3-Clause
!> Newmark's average acceleration of linear systems: the library against loops written by
!> hand for one purpose.
program bench_linear
   use bench_clock, only: print_ratio, print_time, print_title, thread_seconds
   use bench_newmark_by_hand, only: newmark_by_hand
   use dynstep_kinds, only: long, wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: banded_matrix, dense_matrix, diagonal_matrix, identity_matrix, zero_matrix
   use dynstep_newmark, only: newmark_stepper
   use dynstep_status, only: status_type
   use dynstep_stepper, only: clock_type, state_type, allocate_state
   implicit none

   integer, parameter :: repeats = 15
   real(wp) :: chain

   chain = dependent_operation()
   call print_title('yardsticks of this machine', 'ns')
   call print_time('multiplication and addition, dependent', chain)
   call one_equation()
   call small_systems(chain)
   call band(1, 'tridiagonal chain', '<= 0.15, or <= 3 ns')
   call band(2, 'pentadiagonal beam', '<= 0.4')

contains

   !> x = a x + b
   real(wp) function dependent_operation()
      real(wp), volatile :: kept          ! so that the loop stays between the two times
      real(wp) :: x, start
      integer :: i, r
      dependent_operation = huge(1.0_wp)
      kept = 1.0_wp
      do r = 1, repeats
         start = thread_seconds()
         x = kept
         do i = 1, 1000000
            x = 0.999999_wp*x + 1.0e-6_wp
         end do
         kept = x
         dependent_operation = min(dependent_operation, 1.0e3_wp*(thread_seconds() - start))
      end do
   end function dependent_operation

   !> x'' + 16 x = 0, h = 0.002
   subroutine one_equation()
      real(wp) :: by_hand, blocks(3), q
      integer :: i, r
      integer, parameter :: lengths(3) = [1000, 10, 1]
      character(len=40) :: what

      by_hand = huge(1.0_wp)
      blocks = huge(1.0_wp)
      do r = 1, repeats
         by_hand = min(by_hand, newmark_by_hand(q))
         do i = 1, 3
            blocks(i) = min(blocks(i), library(lengths(i), q))
         end do
      end do
      call print_title('one equation', 'ns/step')
      call print_time('loop by hand', by_hand)
      do i = 1, 3
         write (what, '("library, ", i0, " steps per call")') lengths(i)
         call print_ratio(trim(what), blocks(i), by_hand, merge('<= 1.0', '      ', i == 1))
      end do
   end subroutine one_equation

   real(wp) function library(length, check)
      integer, intent(in) :: length               !! steps per call
      real(wp), intent(inout) :: check            !! result of newmark_by_hand
      integer, parameter :: steps = 200000
      type(linear_system) :: sys
      type(status_type) :: status
      call sys%set(identity_matrix(1), zero_matrix(1), dense_matrix(reshape([16.0_wp], [1, 1]), .true.), status)
      library = run(sys, 0.002_wp, steps/length, length, [1.0_wp, 0.0_wp], status, check)
   end function library

   !> ns per step
   real(wp) function run(sys, h, calls, length, y, status, check)
      type(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: h, y(:)
      integer, intent(in) :: calls, length
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: check     !! q(1) that is expected
      type(newmark_stepper) :: stepper
      type(state_type) :: state
      type(clock_type) :: clock
      real(wp) :: start
      integer :: i

      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      state%y = y
      call stepper%start(sys, state, status)
      clock = clock_type(t0=0.0_wp, h=h, k=0_long)
      call stepper%advance(sys, state, clock, 0, status, .false.)
      start = thread_seconds()
      do i = 1, calls
         call stepper%advance(sys, state, clock, length, status, .false.)
      end do
      run = 1.0e9_wp*(thread_seconds() - start)/(real(calls, wp)*length)
      if (status%failed()) print *, trim(status%message)
      if (present(check)) then
         if (abs(state%y(1) - check) > 1.0e-9_wp) print *, 'the library differs', state%y(1), check
      end if
   end function run

   !> Masses on a line, dense matrices
   subroutine small_systems(chain)
      real(wp), intent(in) :: chain
      integer, parameter :: orders(4) = [2, 3, 4, 8]
      real(wp) :: times(4, 2)
      character(len=40) :: what
      integer :: i, r

      times = huge(1.0_wp)
      do r = 1, repeats
         do i = 1, 4
            times(i, 1) = min(times(i, 1), small(orders(i), .false.))
            times(i, 2) = min(times(i, 2), small(orders(i), .true.))
         end do
      end do
      call print_title('small systems, 1000 steps per call (ratio: to the dependent operation)', 'ns/step')
      do i = 1, 4
         write (what, '("n = ", i0)') orders(i)
         call print_ratio(trim(what), times(i, 1), chain, merge('<= 12 ns', '        ', orders(i) < 5))
         call print_ratio(trim(what)//', damped', times(i, 2), chain, '')
      end do
   end subroutine small_systems

   real(wp) function small(n, damped)
      integer, intent(in) :: n
      logical, intent(in) :: damped
      type(linear_system) :: sys
      type(status_type) :: status
      real(wp) :: k(n, n)
      integer :: i

      k = 0.0_wp
      do i = 1, n
         k(i, i) = 32.0_wp
      end do
      do i = 2, n
         k(i, i - 1) = -16.0_wp
         k(i - 1, i) = -16.0_wp
      end do
      call sys%set(identity_matrix(n), dense_matrix(0.01_wp*k, .true.), dense_matrix(k, .true.), status)
      if (.not. damped) call sys%set(identity_matrix(n), zero_matrix(n), dense_matrix(k, .true.), status)
      small = run(sys, 0.002_wp, 20, 1000, [(1.0_wp, i=1, 2*n)], status)
   end function small

   !> Uniform bar (width 1) or beam (width 2) with lumped masses
   subroutine band(width, title, goal)
      integer, intent(in) :: width
      character(len=*), intent(in) :: title, goal
      integer, parameter :: work = 300000          ! rows times steps in a repeat
      real(wp) :: times(3)
      integer :: n, power, r, steps
      character(len=20) :: name

      call print_title(title//', loops and dgbtrs against the library', 'ns/row')
      do power = 3, 5
         n = 10**power
         steps = max(20, work/n)
         times = huge(1.0_wp)
         do r = 1, repeats
            times(1) = min(times(1), band_by_hand(width, n, steps))
            times(2) = min(times(2), band_by_library(width, n, steps, .false.))
            times(3) = min(times(3), band_by_library(width, n, steps, .true.))
         end do
         write (name, '("n = ", i0)') n
         call print_time(trim(name)//', loops and dgbtrs', times(1))
         call print_ratio(trim(name)//', library', times(2), times(1), goal)
         call print_ratio(trim(name)//', library, damped', times(3), times(1), '')
      end do
   end subroutine band

   pure subroutine stencil(width, n, ab)
      integer, intent(in) :: width, n
      real(wp), intent(out) :: ab(2*width + 1, n)
      integer :: i
      do i = 1, n
         if (width == 1) ab(:, i) = [-1.0_wp, 2.0_wp, -1.0_wp]
         if (width == 2) ab(:, i) = [1.0_wp, -4.0_wp, 6.0_wp, -4.0_wp, 1.0_wp]
      end do
   end subroutine stencil

   real(wp) function band_by_library(width, n, steps, damped)
      integer, intent(in) :: width, n, steps
      logical, intent(in) :: damped
      type(linear_system) :: sys
      type(status_type) :: status
      real(wp), allocatable :: k(:, :), y(:)
      integer :: i

      allocate (k(2*width + 1, n))
      call stencil(width, n, k)
      y = [(sin(0.3_wp*i), i=1, 2*n)]
      call sys%set(diagonal_matrix([(1.0_wp, i=1, n)]), banded_matrix(0.01_wp*k, width, width, .true.), &
         & banded_matrix(k, width, width, .true.), status)
      if (.not. damped) sys%c = zero_matrix(n)
      band_by_library = run(sys, 0.5_wp, 1, steps, y, status)/n
   end function band_by_library

   !> The acceleration form, undamped: loops for the updates and K q, dgbtrs for S
   real(wp) function band_by_hand(width, n, steps)
      integer, intent(in) :: width, n, steps
      interface
         subroutine dgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
            import :: wp
            integer, intent(in) :: m, n, kl, ku, ldab
            real(wp), intent(inout) :: ab(ldab, *)
            integer, intent(out) :: ipiv(*), info
         end subroutine dgbtrf
         subroutine dgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
            import :: wp
            character(len=1), intent(in) :: trans
            integer, intent(in) :: n, kl, ku, nrhs, ldab, ipiv(*), ldb
            real(wp), intent(in) :: ab(ldab, *)
            real(wp), intent(inout) :: b(ldb, *)
            integer, intent(out) :: info
         end subroutine dgbtrs
      end interface
      real(wp), parameter :: h = 0.5_wp
      real(wp), allocatable :: k(:, :), s(:, :), q(:), v(:), a(:)
      integer, allocatable :: pivots(:)
      real(wp) :: start
      integer :: i, info, step

      allocate (k(2*width + 1, n))
      call stencil(width, n, k)
      allocate (s(3*width + 1, n), pivots(n), a(n))
      s = 0.0_wp
      s(width + 1:, :) = 0.25_wp*h*h*k
      s(2*width + 1, :) = s(2*width + 1, :) + 1.0_wp
      call dgbtrf(n, n, width, width, s, 3*width + 1, pivots, info)
      q = [(sin(0.3_wp*i), i=1, n)]
      v = [(sin(0.3_wp*i), i=n + 1, 2*n)]
      call minus_k_q(width, n, k, q, a)
      start = thread_seconds()
      do step = 1, steps
         do i = 1, n
            q(i) = q(i) + h*v(i) + 0.25_wp*h*h*a(i)
            v(i) = v(i) + 0.5_wp*h*a(i)
         end do
         call minus_k_q(width, n, k, q, a)
         call dgbtrs('N', n, width, width, 1, s, 3*width + 1, pivots, a, n, info)
         do i = 1, n
            q(i) = q(i) + 0.25_wp*h*h*a(i)
            v(i) = v(i) + 0.5_wp*h*a(i)
         end do
      end do
      band_by_hand = 1.0e9_wp*(thread_seconds() - start)/(real(steps, wp)*n)
      if (info /= 0 .or. abs(q(n/2)) > 1.0e3_wp) print *, 'wrong', info, q(n/2)
   end function band_by_hand

   !> a = -K q, the rows of the inside written out
   subroutine minus_k_q(width, n, k, q, a)
      integer, intent(in) :: width, n
      real(wp), intent(in) :: k(2*width + 1, n), q(n)
      real(wp), intent(out) :: a(n)
      integer :: i, j

      if (width == 1) then
         do i = 2, n - 1
            a(i) = -(k(3, i - 1)*q(i - 1) + k(2, i)*q(i) + k(1, i + 1)*q(i + 1))
         end do
      else
         do i = 3, n - 2
            a(i) = -(k(5, i - 2)*q(i - 2) + k(4, i - 1)*q(i - 1) + k(3, i)*q(i) + k(2, i + 1)*q(i + 1) &
               & + k(1, i + 2)*q(i + 2))
         end do
      end if
      do i = 1, n
         if (i > width .and. i <= n - width) cycle
         a(i) = 0.0_wp
         do j = max(1, i - width), min(n, i + width)
            a(i) = a(i) - k(width + 1 + i - j, j)*q(j)
         end do
      end do
   end subroutine minus_k_q
end program bench_linear
