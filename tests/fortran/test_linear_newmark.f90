! SPDX-License-Identifier: BSD-3-Clause
!> The engine for linear systems with constant matrices.
module test_linear_newmark
   use dynstep_kinds, only: long, wp
   use dynstep_linear_newmark, only: linear_newmark
   use dynstep_linear_system, only: linear_system, load_none, load_procedure, load_samples
   use dynstep_matrix, only: dense_matrix, diagonal_matrix, identity_matrix, zero_matrix
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input, dynstep_not_finite, &
      & dynstep_singular_matrix, status_type
   use dynstep_stepper, only: clock_type, step_counters
   use linear_cases, only: engine_run, loaded_system, make_load, make_system, qp, reference_run, &
      & start_state, structures
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_linear_newmark

   real(wp), parameter :: eps = epsilon(1.0_wp)

   !> K q = p for q = 1
   type, extends(linear_system) :: rest_system
   contains
      procedure :: load => rest_load
   end type rest_system

   !> beta, gamma: trapezoid, linear acceleration, Fox and Goodwin, explicit, damped, backward-like
   real(wp), parameter :: members(2, 6) = reshape([0.25_wp, 0.5_wp, 1.0_wp/6.0_wp, 0.5_wp, 1.0_wp/12.0_wp, 0.5_wp, &
      & 0.0_wp, 0.5_wp, 0.3025_wp, 0.6_wp, 1.0_wp, 1.5_wp], [2, 6])

contains

   recursive subroutine rest_load(self, t, p, ierr)
      class(rest_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      p = 3.0_wp + 0.0_wp*t
      ierr = 0
   end subroutine rest_load

   subroutine collect_linear_newmark(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('reference, small systems', test_small), &
         & new_unittest('reference, large systems', test_large), &
         & new_unittest('order', test_order), &
         & new_unittest('accuracy from omega h = 1e-6 to 1e8', test_extremes), &
         & new_unittest('modes far apart', test_far_apart), &
         & new_unittest('energy of a long run', test_energy), &
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

   subroutine test_small(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: i, n
      do n = 1, 9
         do i = 1, size(structures)
            call compare(trim(structures(i)), n, error)
         end do
      end do
   end subroutine test_small

   subroutine test_large(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: i, n
      do n = 13, 23, 5
         do i = 1, size(structures)
            call compare(trim(structures(i)), n, error)
         end do
      end do
   end subroutine test_large

   !> All members, loads and signs of h against the reference
   subroutine compare(name, n, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      type(error_type), allocatable, intent(inout) :: error
      integer, parameter :: steps = 5
      type(loaded_system) :: sys
      type(status_type) :: status
      type(clock_type) :: clock, end_clock
      type(step_counters) :: count
      real(wp) :: y(2*n), a(n)
      real(qp) :: y_exact(2*n), a_exact(n)
      integer :: member, load, damped
      character(len=120) :: what

      do damped = 0, 1
         call make_system(name, n, damped == 1, sys, status)
         do load = load_none, load_samples
            call make_load(load, sys, status)
            call check(error,.not. status%failed(), trim(name)//': '//trim(status%message))
            if (allocated(error)) return
            do member = 1, size(members, 2)
               clock = clock_type(t0=0.3_wp, h=merge(0.2_wp, -0.2_wp, modulo(n + member, 3) > 0), k=0_long)
               call start_state(n, y)
               y_exact = y
               call reference_run(sys, members(1, member), members(2, member), clock, steps, y_exact, a_exact)
               end_clock = clock
               call engine_run(sys, members(1, member), members(2, member), end_clock, steps, steps, y, a, status, count)
               write (what, '(a, ", n = ", i0, ", C ", i0, ", load ", i0, ", member ", i0)') &
                  & trim(name), n, damped, load, member
               call check(error,.not. status%failed(), trim(what)//': '//trim(status%message))
               call check(error, relative(y, y_exact), 0.0_wp, trim(what)//': y', thr=200*eps)
               call check(error, relative(a, a_exact), 0.0_wp, trim(what)//': a', thr=400*eps)
               call check(error, end_clock%time() == clock%time(steps), trim(what)//': clock')
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine compare

   pure real(wp) function relative(x, exact)
      real(wp), intent(in) :: x(:)
      real(qp), intent(in) :: exact(:)
      relative = real(maxval(abs(x - exact))/maxval(abs(exact)), wp)
   end function relative

   !> Damped oscillation against its formula
   subroutine test_order(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(status_type) :: status
      type(clock_type) :: clock
      type(step_counters) :: count
      real(wp) :: y(2), a(1), errors(2), exact, rate
      integer :: i, member
      real(wp), parameter :: omega = 3.0_wp, decay = 0.2_wp, t_end = 2.0_wp

      call sys%set(identity_matrix(1), diagonal_matrix([2*decay]), diagonal_matrix([omega**2 + decay**2]), status)
      exact = exp(-decay*t_end)*cos(omega*t_end)
      do member = 1, size(members, 2)
         do i = 1, 2
            y = [1.0_wp, -decay]
            clock = clock_type(t0=0.0_wp, h=t_end/(100*i), k=0_long)
            call engine_run(sys, members(1, member), members(2, member), clock, 100*i, 1000, y, a, status, count)
            errors(i) = abs(y(1) - exact)
         end do
         rate = log(errors(1)/errors(2))/log(2.0_wp)
         call check(error, rate, merge(2.0_wp, 1.0_wp, member <= 4), 'order', thr=0.1_wp)
      end do
   end subroutine test_order

   !> One step of an oscillator over 14 decades of omega h; norm of (q, v/omega), 1 at the start.
   !> Where a is part of the state its own rounding error already moves the result.
   subroutine test_extremes(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: unconditional(3) = [1, 5, 6]
      integer :: decade, i, start, damped
      character(len=80) :: what
      real(wp) :: e
      do i = 1, size(unconditional)
         do damped = 0, 1
            do decade = -6, 8
               do start = 1, 24
                  call one_step(unconditional(i), 10.0_wp**decade*(0.5_wp + 0.3_wp*modulo(start, 7)), start, damped, e)
                  write (what, '("member ", i0, ", omega h near 1e", i0, ", start ", i0, ", damped ", i0)') &
                     & unconditional(i), decade, start, damped
                  call check(error, e, 0.0_wp, what, thr=merge(5.0e-15_wp, 2.0e-14_wp, i == 1))
               end do
            end do
         end do
      end do
   end subroutine test_extremes

   subroutine one_step(member, z, start, damped, e)
      integer, intent(in) :: member, start, damped
      real(wp), intent(in) :: z              !! omega h
      real(wp), intent(out) :: e             !! relative error of (q, v/omega)
      real(wp), parameter :: h = 0.7_wp
      type(linear_system) :: sys
      type(status_type) :: status
      type(clock_type) :: clock, end_clock
      type(step_counters) :: count
      real(wp) :: y(2), a(1), m, omega
      real(qp) :: y_exact(2), a_exact(1)

      omega = z/h
      m = 1.0_wp + 0.1_wp*start
      call sys%set(diagonal_matrix([m]), zero_matrix(1), diagonal_matrix([m*omega**2]), status)
      if (damped == 1) call sys%set(diagonal_matrix([m]), diagonal_matrix([0.1_wp*m*omega]), &
         & diagonal_matrix([m*omega**2]), status)
      y = [cos(0.26_wp*start), omega*sin(0.26_wp*start)]
      y_exact = y
      clock = clock_type(t0=0.0_wp, h=h, k=0_long)
      end_clock = clock
      call reference_run(sys, members(1, member), members(2, member), clock, 1, y_exact, a_exact)
      call engine_run(sys, members(1, member), members(2, member), end_clock, 1, 1, y, a, status, count)
      e = real(norm2([real(qp) :: y(1) - y_exact(1), (y(2) - y_exact(2))/omega]) &
         & /max(norm2([real(qp) :: y_exact(1), y_exact(2)/omega]), 1.0_qp), wp)
   end subroutine one_step

   !> Uncoupled modes keep their accuracy beside much stiffer ones
   subroutine test_far_apart(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: n = 15
      type(linear_system) :: sys
      type(status_type) :: status
      type(clock_type) :: clock, end_clock
      type(step_counters) :: count
      real(wp) :: y(2*n), a(n), omega(n)
      real(qp) :: y_exact(2*n), a_exact(n)
      integer :: i

      omega = [(10.0_wp**(i - 7), i=1, n)]
      call sys%set(identity_matrix(n), diagonal_matrix(0.02_wp*omega), diagonal_matrix(omega**2), status)
      y = [(1.0_wp, i=1, n), omega]
      y_exact = y
      clock = clock_type(t0=0.0_wp, h=1.1_wp, k=0_long)
      end_clock = clock
      call reference_run(sys, 0.25_wp, 0.5_wp, clock, 3, y_exact, a_exact)
      call engine_run(sys, 0.25_wp, 0.5_wp, end_clock, 3, 1, y, a, status, count)
      do i = 1, n
         call check(error, y(i), real(y_exact(i), wp), 'q', thr=1.0e-14_wp)
         call check(error, y(n + i)/omega(i), real(y_exact(n + i)/omega(i), wp), 'v/omega', thr=1.0e-14_wp)
      end do
   end subroutine test_far_apart

   !> The trapezoid conserves the energy: 1e6 steps to 5e-13 (40 runs in each half decade of
   !> omega h: rms 1e-13, mean 1e-14), and the second half adds no more than the first.  (At
   !> omega h = 1 and powers of two for h, rounding errors repeat themselves, with a trend of
   !> 1e-18 per step.)
   subroutine test_energy(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: half = 500000
      type(linear_system) :: sys
      type(linear_newmark) :: engine
      type(status_type) :: status
      type(clock_type) :: clock
      type(step_counters) :: count
      real(wp) :: y(2), a(1), energy(0:2), omega
      integer :: i, part

      do i = 1, 4
         omega = 1.37_wp*10.0_wp**(i - 3)
         call sys%set(identity_matrix(1), zero_matrix(1), diagonal_matrix([omega**2]), status)
         y = [1.0_wp, 0.3_wp*omega]
         clock = clock_type(t0=0.0_wp, h=0.73_wp, k=0_long)
         call engine%init(sys, 0.25_wp, 0.5_wp, status)
         energy(0) = (omega*y(1))**2 + y(2)**2
         do part = 1, 2
            call engine%advance(sys, clock, y, a, half, .false., status, count)
            energy(part) = ((omega*y(1))**2 + y(2)**2)/energy(0) - 1.0_wp
         end do
         call check(error, energy(1), 0.0_wp, 'energy, first half', thr=5.0e-13_wp)
         call check(error, energy(2), 0.0_wp, 'energy, second half', thr=5.0e-13_wp)
      end do
   end subroutine test_energy

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
      call check(error, index(status%message, 'coordinate 2 has no mass') > 0, trim(status%message))
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
