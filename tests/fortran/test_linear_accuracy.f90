! SPDX-License-Identifier: BSD-3-Clause
!> The engine for linear systems against quadruple precision, known solutions and energies.
module test_linear_accuracy
   use dynstep_kinds, only: long, wp
   use dynstep_linear_newmark, only: linear_newmark
   use dynstep_linear_system, only: linear_system, load_none, load_samples
   use dynstep_matrix, only: dense_matrix, diagonal_matrix, identity_matrix, zero_matrix
   use dynstep_status, only: status_type
   use dynstep_stepper, only: clock_type, step_counters
   use linear_cases, only: engine_run, loaded_system, make_load, make_system, members, qp, reference_run, &
      & start_state, structures
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_linear_accuracy

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   subroutine collect_linear_accuracy(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('reference, small systems', test_small), &
         & new_unittest('reference, large systems', test_large), &
         & new_unittest('reference, long steps', test_long_steps), &
         & new_unittest('order', test_order), &
         & new_unittest('accuracy from omega h = 1e-6 to 1e8', test_extremes), &
         & new_unittest('modes far apart', test_far_apart), &
         & new_unittest('energy of a long run', test_energy), &
         & new_unittest('energy of coupled masses', test_coupled_energy)]
   end subroutine collect_linear_accuracy

   subroutine test_small(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: i, n
      do n = 1, 9
         do i = 1, size(structures)
            call compare(trim(structures(i)), n, 0.2_wp, size(members, 2), error)
         end do
      end do
   end subroutine test_small

   subroutine test_large(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: i, n
      do n = 13, 23, 5
         do i = 1, size(structures)
            call compare(trim(structures(i)), n, 0.2_wp, size(members, 2), error)
         end do
      end do
   end subroutine test_large

   !> All modes stiff: the trapezoid in its two other forms
   subroutine test_long_steps(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: orders(4) = [1, 3, 8, 14]
      integer :: i, n
      do n = 1, size(orders)
         do i = 1, size(structures)
            call compare(trim(structures(i)), orders(n), 20.0_wp, 1, error)
            call compare(trim(structures(i)), orders(n), 1.0e7_wp, 1, error)
         end do
      end do
   end subroutine test_long_steps

   !> Members, loads and signs of h against the reference
   subroutine compare(name, n, h, last, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      real(wp), intent(in) :: h
      integer, intent(in) :: last           !! last member
      type(error_type), allocatable, intent(inout) :: error
      integer, parameter :: steps = 5
      type(loaded_system) :: sys
      type(status_type) :: status
      type(clock_type) :: clock, end_clock
      type(step_counters) :: count
      real(wp) :: y(2*n), a(n)
      real(qp) :: y_exact(2*n), a_exact(n)
      integer :: member, load, damped
      real(wp) :: allowed                   ! `increment` errs by eps*omega*h in a step
      character(len=120) :: what

      allowed = 200*eps*max(1.0_wp, min(abs(h), 20.0_wp))
      do damped = 0, 1
         call make_system(name, n, damped == 1, sys, status)
         do load = load_none, load_samples
            call make_load(load, sys, status)
            call check(error,.not. status%failed(), trim(name)//': '//trim(status%message))
            if (allocated(error)) return
            do member = 1, last
               clock = clock_type(t0=0.3_wp, h=merge(h, -h, modulo(n + member, 3) > 0), k=0_long)
               call start_state(n, y)
               y_exact = y
               call reference_run(sys, members(1, member), members(2, member), clock, steps, y_exact, a_exact)
               end_clock = clock
               call engine_run(sys, members(1, member), members(2, member), end_clock, steps, steps, y, a, status, count)
               write (what, '(a, ", n = ", i0, ", h = ", f0.1, ", C ", i0, ", load ", i0, ", member ", i0)') &
                  & trim(name), n, h, damped, load, member
               call check(error,.not. status%failed(), trim(what)//': '//trim(status%message))
               call check(error, relative(y(1:n), y_exact(1:n)), 0.0_wp, trim(what)//': q', thr=allowed)
               call check(error, relative(y(n + 1:), y_exact(n + 1:)), 0.0_wp, trim(what)//': v', thr=allowed)
               call check(error, relative(a, a_exact), 0.0_wp, trim(what)//': a', thr=2*allowed)
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

   !> Modes of equal frequency (K - 1 has rank 1) and chains: rounding errors of S^-1 keep it
   !> symmetric, so no pair of modes grows
   subroutine test_coupled_energy(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: m(3) = [1.1_wp, 0.7_wp, 1.9_wp]
      type(linear_system) :: sys
      type(status_type) :: status
      real(wp) :: k(3, 3)
      integer :: i, j, n

      do j = 1, 3
         do i = 1, 3
            k(i, j) = sqrt(m(i)*m(j))*merge(2, 1, i == j)
         end do
      end do
      call sys%set(diagonal_matrix(m), zero_matrix(3), dense_matrix(k, .true.), status)
      call check_energy(sys, 200000, error)
      do n = 30, 31
         do i = 2, 5
            call make_system(structures(i), n, .false., sys, status)
            call check_energy(sys, 40000, error)
         end do
      end do
   end subroutine test_coupled_energy

   subroutine check_energy(sys, steps, error)
      type(linear_system), intent(inout) :: sys
      integer, intent(in) :: steps
      type(error_type), allocatable, intent(inout) :: error
      type(status_type) :: status
      type(clock_type) :: clock
      type(step_counters) :: count
      real(wp) :: y(2*sys%n), a(sys%n), before, after
      integer :: ierr

      associate (n => sys%n)
         call start_state(n, y)
         call sys%energy(0.0_wp, y(1:n), y(n + 1:), before, ierr)
         clock = clock_type(t0=0.0_wp, h=0.56_wp, k=0_long)
         call engine_run(sys, 0.25_wp, 0.5_wp, clock, steps, steps, y, a, status, count)
         call sys%energy(0.0_wp, y(1:n), y(n + 1:), after, ierr)
         call check(error, after, before, 'energy', thr=5.0e-13_wp, rel=.true.)
      end associate
   end subroutine check_energy
end module test_linear_accuracy
