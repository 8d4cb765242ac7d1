! SPDX-License-Identifier: BSD-3-Clause
!> The engine for linear systems: bits, work, failures.
module test_linear_newmark
   use dynstep_kinds, only: long, wp
   use dynstep_linear_newmark, only: linear_newmark
   use dynstep_linear_system, only: linear_system, load_none, load_procedure, load_samples
   use dynstep_matrix, only: dense_matrix, diagonal_matrix, identity_matrix, zero_matrix
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input, dynstep_not_finite, &
      & dynstep_singular_matrix, status_type
   use dynstep_stepper, only: clock_type, step_counters
   use linear_cases, only: engine_run, loaded_system, make_load, make_system, members, start_state, structures
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_linear_newmark

   !> K q = p for q = 1
   type, extends(linear_system) :: rest_system
   contains
      procedure :: load => rest_load
   end type rest_system

contains

   subroutine collect_linear_newmark(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('calls do not change a bit', test_chunks), &
         & new_unittest('work', test_work), &
         & new_unittest('a step beyond a growing mode', test_growing), &
         & new_unittest('singular mass', test_singular_mass), &
         & new_unittest('loads that fail', test_bad_loads), &
         & new_unittest('backward in time', test_backward), &
         & new_unittest('rest under a constant load', test_rest), &
         & new_unittest('copies', test_copy), &
         & new_unittest('wrong arguments', test_arguments)]
   end subroutine collect_linear_newmark

   recursive subroutine rest_load(self, t, p, ierr)
      class(rest_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      p = 3.0_wp + 0.0_wp*t
      ierr = 0
   end subroutine rest_load

   !> The same run in calls of other lengths, to the last bit
   subroutine test_chunks(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: orders(5) = [1, 2, 4, 7, 21], chunks(5) = [1, 2, 7, 31, 33], steps = 70
      type(loaded_system) :: sys
      type(status_type) :: status
      type(clock_type) :: clock
      type(step_counters) :: count
      real(wp), allocatable :: y(:), a(:), y1(:), a1(:)
      integer :: i, j, l, n, load, member

      do j = 1, size(orders)
         n = orders(j)
         if (allocated(y)) deallocate (y, a, y1, a1)
         allocate (y(2*n), a(n), y1(2*n), a1(n))
         do i = 1, size(structures)
            call make_system(structures(i), n, modulo(i + j, 2) == 0, sys, status)
            do load = load_none, load_samples
               call make_load(load, sys, status)
               do member = 1, 2
                  call start_state(n, y)
                  clock = clock_type(t0=0.1_wp, h=0.1_wp, k=0_long)
                  call engine_run(sys, members(1, member), members(2, member), clock, steps, steps, y, a, status, count)
                  do l = 1, size(chunks)
                     call start_state(n, y1)
                     clock = clock_type(t0=0.1_wp, h=0.1_wp, k=0_long)
                     call engine_run(sys, members(1, member), members(2, member), clock, steps, chunks(l), y1, a1, &
                        & status, count)
                     call check(error, all(y1 == y) .and. all(a1 == a), trim(structures(i))//' in calls')
                  end do
               end do
            end do
         end do
      end do
      call check(error,.not. status%failed(), trim(status%message))
   end subroutine test_chunks

   !> One factorization for each step length, none that a diagonal spares
   subroutine test_work(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 12
      type(loaded_system) :: sys
      type(linear_newmark) :: engine
      type(status_type) :: status
      type(clock_type) :: clock
      type(step_counters) :: count
      real(wp) :: y(2*n), a(n)
      integer :: i

      call make_system('tridiagonal', n, .true., sys, status)
      call start_state(n, y)
      call engine%init(sys, 0.25_wp, 0.5_wp, status)
      call engine%start(sys, 0.0_wp, y, a, status, count)
      call check(error, int(count%factorizations), 0, 'an identity is not factorized')
      clock%h = 0.1_wp
      do i = 1, 3
         call engine%advance(sys, clock, y, a, 10, .true., status, count)
      end do
      call check(error, int(count%factorizations), 1, 'one step length')
      call check(error, int(count%solves), 30, 'one solve a step')
      call check(error, int(count%forces), 0, 'no load, no evaluation')
      clock = clock_type(t0=clock%time(), h=-0.1_wp, k=0_long)
      call engine%advance(sys, clock, y, a, 10, .true., status, count)
      call check(error, int(count%factorizations), 2, 'two step lengths')

      call make_system('tri M', n, .true., sys, status)
      call make_load(load_procedure, sys, status)
      call count%zero()
      call engine%init(sys, 0.25_wp, 0.5_wp, status)
      call engine%start(sys, 0.0_wp, y, a, status, count)
      call engine%advance(sys, clock, y, a, 5, .true., status, count)
      call engine%advance(sys, clock, y, a, 5, .true., status, count)
      call check(error, int(count%factorizations), 2, 'M and S')
      call check(error, int(count%forces), 13, 'loads: start, and new times of each call')

      call make_system('dense', n, .false., sys, status)
      call make_load(load_none, sys, status)
      call count%zero()
      call engine%init(sys, 0.0_wp, 0.5_wp, status)
      call engine%start(sys, 0.0_wp, y, a, status, count)
      clock%h = 0.01_wp
      call engine%advance(sys, clock, y, a, 5, .true., status, count)
      clock%h = 0.02_wp
      call engine%advance(sys, clock, y, a, 5, .true., status, count)
      call check(error, int(count%factorizations + count%solves), 0, 'explicit with a diagonal M')
      call check(error,.not. status%failed(), trim(status%message))
   end subroutine test_work

   !> q'' = q: S = 1 - h^2/4 changes its sign at h = 2
   subroutine test_growing(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(linear_newmark) :: engine
      type(status_type) :: status
      type(clock_type) :: clock
      type(step_counters) :: count
      real(wp) :: y(4), a(2)
      integer :: sign

      call sys%set(identity_matrix(2), zero_matrix(2), &
         & dense_matrix(reshape([1.0_wp, 2.0_wp, 2.0_wp, 1.0_wp], [2, 2]), .true.), status)
      call engine%init(sys, 0.25_wp, 0.5_wp, status)
      do sign = -1, 1, 2
         y = [1.0_wp, -1.0_wp, 0.0_wp, 0.0_wp]
         call engine%start(sys, 0.0_wp, y, a, status, count)
         clock = clock_type(t0=0.0_wp, h=3.0_wp*sign, k=0_long)
         call engine%advance(sys, clock, y, a, 10, .true., status, count)
         call check(error, status%code, dynstep_singular_matrix, 'h beyond the pole')
         call check(error, status%retry, 'a smaller step helps')
         call check(error, index(status%message, '|h| <= 1.5') > 0, trim(status%message))
         call check(error, all(y == [1.0_wp, -1.0_wp, 0.0_wp, 0.0_wp]) .and. clock%k == 0, 'state untouched')
         call status%clear()
         clock%h = 1.5_wp*sign
         call engine%advance(sys, clock, y, a, 1, .true., status, count)
         call check(error,.not. status%failed(), trim(status%message))
         call check(error, y(1), (1.0_wp + 0.5625_wp)/(1.0_wp - 0.5625_wp), 'growth')
      end do
   end subroutine test_growing

   subroutine test_singular_mass(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(linear_newmark) :: engine
      type(status_type) :: status
      type(step_counters) :: count
      real(wp) :: y(6), a(3)

      call sys%set(diagonal_matrix([1.0_wp, 0.0_wp, 2.0_wp]), zero_matrix(3), diagonal_matrix([1.0_wp, 1.0_wp, 1.0_wp]), &
         & status)
      y = 0.0_wp
      call engine%init(sys, 0.25_wp, 0.5_wp, status)
      call engine%start(sys, 0.0_wp, y, a, status, count)
      call check(error, status%code, dynstep_singular_matrix, 'M is singular')
      call check(error, index(status%message, 'condense coordinates that have no mass') > 0, trim(status%message))
   end subroutine test_singular_mass

   !> The run stops at the last step before the failure, with the bits of a run to there
   subroutine test_bad_loads(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: orders(3) = [1, 3, 12], codes(3) = [0, 1, -1]
      type(loaded_system) :: sys
      type(linear_newmark) :: engine
      type(status_type) :: status
      type(clock_type) :: clock
      type(step_counters) :: count
      real(wp), allocatable :: y(:), a(:), y1(:), a1(:)
      integer :: i, j, n, member

      do i = 1, size(orders)
         n = orders(i)
         if (allocated(y)) deallocate (y, a, y1, a1)
         allocate (y(2*n), a(n), y1(2*n), a1(n))
         do member = 1, 2
            do j = 1, size(codes)
               call status%clear()
               call make_system('tridiagonal', n, .false., sys, status)
               call make_load(load_procedure, sys, status)
               call start_state(n, y)
               y1 = y
               clock = clock_type(t0=0.0_wp, h=0.125_wp, k=0_long)
               call engine_run(sys, members(1, member), members(2, member), clock, 19, 19, y1, a1, status, count)
               sys%bad_time = 20*0.125_wp
               sys%ierr = codes(j)
               clock%k = 0
               call engine_run(sys, members(1, member), members(2, member), clock, 30, 30, y, a, status, count)
               call check(error, status%code, merge(dynstep_not_finite, dynstep_callback_failed, j == 1), 'code')
               call check(error, status%retry .eqv. j < 3, 'retry')
               call check(error, index(status%message, 't = 2.5') > 0, trim(status%message))
               call check(error, int(clock%k), 19, 'steps made')
               call check(error, all(y == y1) .and. all(a == a1), 'state of the last step')
               call status%clear()
               call engine%init(sys, members(1, member), members(2, member), status)
               call engine%start(sys, 2.5_wp, y, a, status, count)
               call check(error, status%failed(), 'start at a bad load')
               sys%bad_time = huge(1.0_wp)
            end do
         end do
      end do
   end subroutine test_bad_loads

   !> gamma = 1/2 is symmetric: -h leads back
   subroutine test_backward(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 12
      type(loaded_system) :: sys
      type(status_type) :: status
      type(clock_type) :: clock
      type(step_counters) :: count
      real(wp) :: y(2*n), y0(2*n), a(n)
      integer :: i, member

      do i = 1, size(structures)
         call make_system(structures(i), n, .false., sys, status)
         call make_load(load_procedure, sys, status)
         do member = 1, 4
            call start_state(n, y)
            y0 = y
            clock = clock_type(t0=0.0_wp, h=0.05_wp, k=0_long)
            call engine_run(sys, members(1, member), members(2, member), clock, 40, 40, y, a, status, count)
            clock = clock_type(t0=2.0_wp, h=-0.05_wp, k=0_long)
            call engine_run(sys, members(1, member), members(2, member), clock, 40, 40, y, a, status, count)
            call check(error, maxval(abs(y - y0)), 0.0_wp, trim(structures(i)), thr=1.0e-12_wp)
         end do
      end do
   end subroutine test_backward

   !> K q = p, v = 0 is kept to the last bit where the arithmetic is exact
   subroutine test_rest(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: orders(3) = [1, 4, 12]
      type(rest_system) :: sys
      type(status_type) :: status
      type(clock_type) :: clock
      type(step_counters) :: count
      real(wp), allocatable :: y(:), a(:)
      integer :: i, n

      do i = 1, size(orders)
         n = orders(i)
         y = [spread(1.0_wp, 1, n), spread(0.0_wp, 1, n)]
         a = y(1:n)
         call sys%set(diagonal_matrix(spread(0.3_wp, 1, n)), zero_matrix(n), diagonal_matrix(spread(3.0_wp, 1, n)), status)
         sys%load_kind = load_procedure
         clock = clock_type(t0=0.0_wp, h=0.1_wp, k=0_long)
         call engine_run(sys, 0.25_wp, 0.5_wp, clock, 100, 100, y, a, status, count)
         call check(error, all(y(1:n) == 1.0_wp) .and. all(y(n + 1:) == 0.0_wp) .and. all(a == 0.0_wp), 'at rest')
      end do
   end subroutine test_rest

   !> A copy goes on by itself
   subroutine test_copy(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 12
      type(loaded_system) :: sys
      type(linear_newmark) :: engine, copy
      type(status_type) :: status
      type(clock_type) :: clock, clock1
      type(step_counters) :: count
      real(wp) :: y(2*n), a(n), y1(2*n), a1(n)
      integer :: i

      do i = 1, size(structures)
         call make_system(structures(i), n, .true., sys, status)
         call start_state(n, y)
         clock = clock_type(t0=0.0_wp, h=0.05_wp, k=0_long)
         call engine%init(sys, 0.25_wp, 0.5_wp, status)
         call engine%start(sys, 0.0_wp, y, a, status, count)
         call engine%advance(sys, clock, y, a, 5, .true., status, count)
         copy = engine
         y1 = y
         a1 = a
         clock1 = clock
         call engine%advance(sys, clock, y, a, 5, .true., status, count)
         call engine%prepare(sys, 0.01_wp, 0.0_wp, status, count)
         call copy%advance(sys, clock1, y1, a1, 5, .true., status, count)
         call check(error, all(y == y1) .and. all(a == a1), trim(structures(i)))
      end do
      call check(error,.not. status%failed(), trim(status%message))
   end subroutine test_copy

   subroutine test_arguments(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(linear_newmark) :: engine
      type(status_type) :: status
      type(step_counters) :: count

      call engine%init(sys, 0.25_wp, 0.5_wp, status)
      call check(error, status%code, dynstep_invalid_input, 'no matrices')
      call status%clear()
      call sys%set(identity_matrix(1), zero_matrix(1), identity_matrix(1), status)
      call engine%init(sys, -0.25_wp, 0.5_wp, status)
      call check(error, status%code, dynstep_invalid_input, 'beta < 0')
      call status%clear()
      call engine%init(sys, 0.25_wp, 0.5_wp, status)
      call engine%prepare(sys, 0.0_wp, 0.0_wp, status, count)
      call check(error, status%code, dynstep_invalid_input, 'h = 0')
   end subroutine test_arguments
end module test_linear_newmark
