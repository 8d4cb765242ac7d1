! SPDX-License-Identifier: BSD-3-Clause
!> Calls in the wrong order, systems that change between calls, motions that leave the range of
!> numbers: each ends in a status, with the last good state, or does what a user expects.
module test_misuse
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
   use, intrinsic :: ieee_exceptions, only: ieee_get_halting_mode, ieee_set_flag, ieee_set_halting_mode, ieee_usual
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_integrate, only: control_type, integrate, integration_type, observer_type
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: diagonal_matrix, identity_matrix, kind_diagonal, matrix_type, zero_matrix
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
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
         & new_unittest('start reads the matrices again', test_new_entries), &
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
