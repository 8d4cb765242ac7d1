! SPDX-License-Identifier: BSD-3-Clause
!> The list of methods.
module test_methods
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: diagonal_matrix, zero_matrix
   use dynstep_methods, only: method_names, new_method
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_stepper, only: allocate_state, method_properties, state_type, stepper_type
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_methods

contains

   subroutine collect_methods(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('all-step', test_all_step), &
         & new_unittest('facts', test_facts), &
         & new_unittest('unknown', test_unknown)]
   end subroutine collect_methods

   !> Each name gives a method that steps q'' + q = 0
   subroutine test_all_step(error)
      type(error_type), allocatable, intent(out) :: error
      class(stepper_type), allocatable :: stepper
      type(linear_system) :: sys
      type(state_type) :: state, trial
      type(status_type) :: status
      integer :: i
      real(wp), parameter :: h = 0.1_wp

      call sys%set(diagonal_matrix([1.0_wp]), zero_matrix(1), diagonal_matrix([1.0_wp]), status)
      do i = 1, size(method_names)
         call new_method(trim(method_names(i)), stepper, status)
         call check(error, .not. status%failed(), status%message)
         if (allocated(error)) return
         call stepper%init(sys, status)
         state%t = 0.0_wp
         state%y = [1.0_wp, 0.0_wp]
         call stepper%start(sys, state, status)
         call allocate_state(sys, trial, status)
         call stepper%try_step(sys, state, h, h, trial, status)
         call check(error, .not. status%failed(), trim(method_names(i))//': '//status%message)
         call check(error, trial%y(1), cos(h), method_names(i), thr=h**4)
      end do
   end subroutine test_all_step

   !> Each method tells an order and a source; names are told once
   subroutine test_facts(error)
      type(error_type), allocatable, intent(out) :: error
      class(stepper_type), allocatable :: stepper
      type(method_properties) :: facts
      type(status_type) :: status
      integer :: i
      do i = 1, size(method_names)
         call new_method(method_names(i), stepper, status)
         if (status%failed()) exit
         facts = stepper%properties()
         call check(error, facts%order >= 1 .and. facts%source /= '' .and. facts%name /= '', method_names(i))
         call check(error, count(method_names == method_names(i)), 1, method_names(i))
      end do
      call check(error, .not. status%failed(), status%message)
   end subroutine test_facts

   subroutine test_unknown(error)
      type(error_type), allocatable, intent(out) :: error
      class(stepper_type), allocatable :: stepper
      type(status_type) :: status
      integer :: i
      call new_method('simpson', stepper, status)
      call check(error, status%code, dynstep_invalid_input)
      call check(error, .not. allocated(stepper), 'nothing is allocated')
      call check(error, index(status%message, '''simpson''') > 0, 'the message names the wrong name')
      do i = 1, size(method_names)
         call check(error, index(status%message, trim(method_names(i))) > 0, 'the message lists all names')
      end do
   end subroutine test_unknown
end module test_methods
