! SPDX-License-Identifier: BSD-3-Clause
!> Calls in the wrong order, systems that change between calls, motions that leave the range of
!> numbers: each ends in a status, with the last good state, or does what a user expects.
module test_misuse
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
   use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_integrate, only: control_type, integrate, integration_type
   use dynstep_run, only: observer_type
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: diagonal_matrix, identity_matrix, kind_diagonal, matrix_type, zero_matrix
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
   use dynstep_sequences, only: sequence_romberg
   use dynstep_status, only: dynstep_invalid_input, dynstep_more, dynstep_not_finite, dynstep_singular_matrix, &
      & dynstep_stopped, dynstep_success, status_type
   use dynstep_stepper, only: allocate_state, state_type, stepper_type
   use dynstep_trajectory, only: trajectory_type
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_misuse

   !> Hardening springs q'' + q + q^3 = 0, with masses of any value
   type, extends(mechanical_system) :: springs
      real(wp) :: last_mass = 1.0_wp
   contains
      procedure :: force => springs_force
      procedure :: mass => springs_mass
   end type springs

   type, extends(observer_type) :: stops_at
      real(wp) :: t = 0.0_wp
   contains
      procedure :: observe => stops_at_observe
   end type stops_at

   type :: method_type
      class(stepper_type), allocatable :: stepper
   end type method_type

contains

   subroutine collect_misuse(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('start before init', test_start_before_init), &
         & new_unittest('run before start', test_run_before_start), &
         & new_unittest('another system than at init', test_another_system), &
         & new_unittest('levels changed after init', test_levels), &
         & new_unittest('coefficients changed after init', test_coefficients), &
         & new_unittest('state of another size', test_state_size), &
         & new_unittest('state that is not finite', test_state_values), &
         & new_unittest('news of an earlier call', test_news), &
         & new_unittest('start reads the matrices again', test_new_entries), &
         & new_unittest('motion beyond the range of numbers', test_range), &
         & new_unittest('coordinate without mass', test_no_mass)]
   end subroutine collect_misuse

   recursive subroutine springs_force(self, t, q, v, f, ierr)
      class(springs), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      f = -q - q**3
      ierr = 0
   end subroutine springs_force

   recursive subroutine springs_mass(self, t, q, v, mass, ierr)
      class(springs), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      integer :: i
      do i = 1, self%n
         call mass%set_entry(i, i, merge(self%last_mass, 1.0_wp, i == self%n))
      end do
      ierr = 0
   end subroutine springs_mass

   recursive subroutine stops_at_observe(self, stepper, state, stop)
      class(stops_at), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      type(state_type), intent(in) :: state
      logical, intent(inout) :: stop
      stop = state%t >= self%t
   end subroutine stops_at_observe

   !> Newmark, midpoint, and the extrapolation of Newmark
   subroutine make_methods(methods)
      type(method_type), intent(out) :: methods(3)
      type(extrapolation_stepper) :: extrapolation
      allocate (newmark_stepper :: extrapolation%base)
      allocate (newmark_stepper :: methods(1)%stepper)
      allocate (midpoint_stepper :: methods(2)%stepper)
      allocate (methods(3)%stepper, source=extrapolation)
   end subroutine make_methods

   !> n oscillators q'' + k q = 0
   subroutine make_oscillators(sys, n, k)
      type(linear_system), intent(inout) :: sys
      integer, intent(in) :: n
      real(wp), intent(in) :: k
      type(status_type) :: status
      call sys%set(identity_matrix(n), zero_matrix(n), diagonal_matrix(spread(k, 1, n)), status)
   end subroutine make_oscillators

   !> q = 1, v = 0
   pure function start_state(n) result(state)
      integer, intent(in) :: n
      type(state_type) :: state
      allocate (state%y, source=[spread(1.0_wp, 1, n), spread(0.0_wp, 1, n)])
   end function start_state

   subroutine test_start_before_init(error)
      type(error_type), allocatable, intent(out) :: error
      type(method_type) :: methods(3)
      type(springs) :: general
      type(linear_system) :: linear
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      general%n = 2
      call make_oscillators(linear, 2, 1.0_wp)
      call make_methods(methods)
      do i = 1, size(methods)
         state = start_state(2)
         call status%clear()
         call methods(i)%stepper%start(general, state, status)
         call check(error, status%code, dynstep_invalid_input, 'general system')
         call check(error, index(status%message, 'init') > 0, trim(status%message))
         call status%clear()
         call methods(i)%stepper%start(linear, state, status)
         call check(error, status%code, dynstep_invalid_input, 'linear system')
      end do
   end subroutine test_start_before_init

   subroutine test_run_before_start(error)
      type(error_type), allocatable, intent(out) :: error
      type(method_type) :: methods(3)
      type(springs) :: general
      type(linear_system) :: linear
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      general%n = 2
      call make_oscillators(linear, 2, 1.0_wp)
      call make_methods(methods)
      do i = 1, size(methods)
         call status%clear()
         state = start_state(2)
         call integrate(methods(i)%stepper, general, state, 1.0_wp, control_type(h=0.1_wp), status)
         call check(error, status%code, dynstep_invalid_input, 'no init')
         call status%clear()
         call methods(i)%stepper%init(linear, status)
         call integrate(methods(i)%stepper, linear, state, 1.0_wp, control_type(h=0.1_wp), status)
         call check(error, status%code, dynstep_invalid_input, 'no start')
         call check(error, index(status%message, 'start') > 0, trim(status%message))
         call check(error, state%t, 0.0_wp, 'time', thr=0.0_wp)
      end do
   end subroutine test_run_before_start

   !> Of another size, of another kind, of another structure; then init makes it good
   subroutine test_another_system(error)
      type(error_type), allocatable, intent(out) :: error
      type(method_type) :: methods(3)
      type(springs) :: general
      type(linear_system) :: linear
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      call make_methods(methods)
      do i = 1, size(methods)
         general = springs()
         general%n = 2
         call make_oscillators(linear, 2, 1.0_wp)
         call status%clear()
         call methods(i)%stepper%init(general, status)
         state = start_state(2)
         call methods(i)%stepper%start(linear, state, status)
         call check(error, status%code, dynstep_invalid_input, 'linear for general')
         call status%clear()
         call methods(i)%stepper%init(linear, status)
         call methods(i)%stepper%start(general, state, status)
         call check(error, status%code, dynstep_invalid_input, 'general for linear')
         call status%clear()
         call methods(i)%stepper%init(general, status)
         general%structure%mass = kind_diagonal
         call methods(i)%stepper%start(general, state, status)
         call check(error, status%code, dynstep_invalid_input, 'another structure')
         call status%clear()
         call methods(i)%stepper%init(general, status)
         general%n = 3
         state = start_state(3)
         call methods(i)%stepper%start(general, state, status)
         call check(error, status%code, dynstep_invalid_input, 'another size')
         call status%clear()
         call methods(i)%stepper%init(general, status)
         call methods(i)%stepper%start(general, state, status)
         call integrate(methods(i)%stepper, general, state, 1.0_wp, control_type(h=0.1_wp), status)
         call check(error, status%code, dynstep_success, trim(status%message))
      end do
   end subroutine test_another_system

   subroutine test_levels(error)
      type(error_type), allocatable, intent(out) :: error
      type(extrapolation_stepper) :: stepper
      type(springs) :: sys
      type(state_type) :: state
      type(status_type) :: status
      sys%n = 1
      allocate (newmark_stepper :: stepper%base)
      call stepper%init(sys, status)
      stepper%levels = 6
      state = start_state(1)
      call stepper%start(sys, state, status)
      call check(error, status%code, dynstep_invalid_input, 'levels')
      call status%clear()
      stepper%levels = 4
      stepper%sequence = sequence_romberg
      call stepper%start(sys, state, status)
      call check(error, status%code, dynstep_invalid_input, 'sequence')
      call check(error, index(status%message, 'sequence or custom') == 1, status%message)
      call status%clear()
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call check(error, .not. status%failed(), 'a new init reads the sequence')
   end subroutine test_levels

   subroutine test_coefficients(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: stepper
      type(springs) :: sys
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      sys%n = 1
      do i = 1, 2
         stepper%beta = 0.25_wp
         call status%clear()
         call stepper%init(sys, status)
         stepper%beta = merge(0.3_wp, ieee_value(1.0_wp, ieee_quiet_nan), i == 1)
         state = start_state(1)
         call stepper%start(sys, state, status)
         call check(error, status%code, dynstep_invalid_input, 'beta')
         call check(error, index(status%message, 'beta or gamma') == 1, status%message)
      end do
   end subroutine test_coefficients

   !> `start` and `allocate_state` give every array its size, whatever was there before
   subroutine test_state_size(error)
      type(error_type), allocatable, intent(out) :: error
      type(method_type) :: methods(3)
      type(springs) :: sys
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      sys%n = 4
      call make_methods(methods)
      do i = 1, size(methods)
         state = start_state(4)
         allocate (state%a(1))
         call methods(i)%stepper%init(sys, status)
         call methods(i)%stepper%start(sys, state, status)
         call check(error, size(state%a), 4, 'a '//trim(status%message))
      end do
      deallocate (state%a)
      call allocate_state(sys, state, status)
      call check(error, size(state%a), 4, 'a is allocated where y was there already')
   end subroutine test_state_size

   subroutine test_state_values(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: stepper
      type(linear_system) :: sys
      type(state_type) :: state
      type(status_type) :: status
      call make_oscillators(sys, 2, 1.0_wp)
      state = start_state(2)
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      state%y(3) = ieee_value(1.0_wp, ieee_quiet_nan)
      call integrate(stepper, sys, state, 1.0_wp, control_type(h=0.1_wp), status)
      call check(error, status%code, dynstep_invalid_input, 'y')
      call check(error, index(status%message, 'component 3') > 0, trim(status%message))
      state%y(3) = 0.0_wp
      state%t = ieee_value(1.0_wp, ieee_quiet_nan)
      call status%clear()
      call integrate(stepper, sys, state, 1.0_wp, control_type(h=0.1_wp), status)
      call check(error, status%code, dynstep_invalid_input, 't')
   end subroutine test_state_values

   !> The loop of the interface block ends, and a run after a stop ends in success
   subroutine test_news(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: stepper
      type(linear_system) :: sys
      type(state_type) :: state
      type(status_type) :: status
      type(integration_type) :: run
      type(stops_at) :: observer
      integer :: calls
      observer%t = 1.45_wp
      call make_oscillators(sys, 1, 16.0_wp)
      state = start_state(1)
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call run%begin(sys, state, 1.0_wp, control_type(h=0.1_wp), status)
      do calls = 1, 20
         call run%proceed(stepper, sys, state, status, max_steps=3)
         if (status%code /= dynstep_more) exit
      end do
      call check(error, calls, 4, 'calls')
      call check(error, status%code, dynstep_success, 'after the last call')
      call check(error, state%t, 1.0_wp, 'end', thr=0.0_wp)
      call integrate(stepper, sys, state, 2.0_wp, control_type(h=0.1_wp), status, observer=observer)
      call check(error, status%code, dynstep_stopped, 'observer')
      call integrate(stepper, sys, state, 2.0_wp, control_type(h=0.1_wp), status)
      call check(error, status%code, dynstep_success, 'after a stop')
   end subroutine test_news

   !> Other entries of K, the same structure: as good as new, with every kernel
   subroutine test_new_entries(error)
      type(error_type), allocatable, intent(out) :: error
      type(method_type) :: methods(3), others(3)
      type(linear_system) :: sys
      type(state_type) :: state, expected
      type(status_type) :: status
      integer :: i, k
      integer, parameter :: orders(4) = [1, 2, 9, 20]
      call make_methods(methods)
      do k = 1, size(orders)
         call make_methods(others)
         do i = 1, size(methods)
            call make_oscillators(sys, orders(k), 100.0_wp)
            call methods(i)%stepper%init(sys, status)
            call run_once(methods(i)%stepper, state)
            sys%k%a = 16.0_wp
            call run_once(methods(i)%stepper, state)
            call others(i)%stepper%init(sys, status)
            call run_once(others(i)%stepper, expected)
            call check(error, status%code, dynstep_success, trim(status%message))
            call check(error, maxval(abs(state%y - expected%y)), 0.0_wp, 'new entries', thr=0.0_wp)
            call check(error, state%y(1), cos(4.0_wp), 'motion', thr=1.0e-3_wp)
         end do
      end do

   contains

      subroutine run_once(stepper, end_state)
         class(stepper_type), intent(inout) :: stepper
         type(state_type), intent(out) :: end_state
         end_state = start_state(sys%n)
         call stepper%start(sys, end_state, status)
         call integrate(stepper, sys, end_state, 1.0_wp, control_type(h=0.01_wp), status)
      end subroutine run_once
   end subroutine test_new_entries

   !> Steps beyond the stability limit end in a status, with the last finite state and what was
   !> recorded before; how the run is cut into blocks does not matter
   subroutine test_range(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: stepper
      type(extrapolation_stepper) :: extrapolation
      type(linear_system) :: sys
      type(state_type) :: state, other
      type(status_type) :: status
      type(trajectory_type) :: trajectory
      logical :: halting(size(ieee_usual))
      call ieee_get_halting_mode(ieee_usual, halting)
      call ieee_set_halting_mode(ieee_usual, .false.)
      call make_oscillators(sys, 2, 1.0e4_wp)
      stepper%beta = 0.0_wp
      call stepper%init(sys, status)
      state = start_state(2)
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, 1000.0_wp, control_type(h=0.1_wp), status)
      call check(error, status%code, dynstep_not_finite, 'one block')
      call check(error, all(ieee_is_finite(state%y)), 'one block: state')
      call check(error, index(status%message, 'stability') > 0, trim(status%message))
      call check(error, nint(state%t/0.1_wp), int(stepper%count%steps), 'one block: steps')
      call status%clear()
      other = start_state(2)
      call stepper%start(sys, other, status)
      call integrate(stepper, sys, other, 1000.0_wp, control_type(h=0.1_wp), status, trajectory)
      call check(error, status%code, dynstep_not_finite, 'recorded')
      call check(error, other%t, state%t, 'recorded: time', thr=0.0_wp)
      call check(error, all(abs(other%y - state%y) <= 0.0_wp), 'recorded: state')
      call check(error, trajectory%t(trajectory%count), other%t, 'recorded: last point', thr=0.0_wp)
      call status%clear()
      allocate (newmark_stepper :: extrapolation%base)
      call extrapolation%init(sys, status)
      state = start_state(2)
      call extrapolation%start(sys, state, status)
      call integrate(extrapolation, sys, state, 1000.0_wp, control_type(h=0.1_wp), status)
      call check(error, status%code, dynstep_not_finite, 'extrapolation')
      call check(error, all(ieee_is_finite(state%y)), 'extrapolation: state')
      call check(error, state%t > 10.0_wp, 'extrapolation: time')
      call ieee_set_flag(ieee_usual, .false.)
      call ieee_set_halting_mode(ieee_usual, halting)
   end subroutine test_range

   subroutine test_no_mass(error)
      type(error_type), allocatable, intent(out) :: error
      type(newmark_stepper) :: stepper
      type(springs) :: sys
      type(state_type) :: state
      type(status_type) :: status
      sys%n = 2
      sys%last_mass = 0.0_wp
      sys%structure%mass = kind_diagonal
      call stepper%init(sys, status)
      state = start_state(2)
      call stepper%start(sys, state, status)
      call check(error, status%code, dynstep_singular_matrix, 'code')
      call check(error, trim(status%message), 'the mass matrix is singular at t = 0, equation 2: its diagonal entry ' &
         & //'is zero; condense coordinates that have no mass, or give them one')
   end subroutine test_no_mass
end module test_misuse
