! SPDX-License-Identifier: BSD-3-Clause
!> A small test harness: named tests in named suites, one program.
!>
!> PROGRAMMING INTERFACE (names and argument order of the test-drive package)
!>
!>   A suite is a module test_<name> with one public procedure that lists its tests:
!>
!>     subroutine collect_<name>(testsuite)
!>        type(unittest_type), allocatable, intent(out) :: testsuite(:)
!>        testsuite = [new_unittest('order', test_order), ...]
!>     end subroutine
!>
!>   A test is a subroutine with the argument `error`, which a CHECK that fails allocates.
!>   After the first failure of a test its further checks do nothing, so a test need not
!>   return early unless going on would crash.
!>
!>   call check(error, condition, message)
!>   call check(error, actual, expected, message)                 integer, character
!>   call check(error, actual, expected, message, thr, rel)       real; a NaN fails
!>   call test_failed(error, message)
module testing
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use, intrinsic :: iso_fortran_env, only: real64
   implicit none
   private

   public :: error_type, unittest_type, testsuite_type
   public :: new_unittest, new_testsuite, check, test_failed, run_tests

   integer, parameter :: wp = real64

   !> Names have a fixed length, as gfortran loses allocatable ones in array constructors
   integer, parameter :: name_length = 64

   !> Allocated where a test has failed
   type :: error_type
      character(len=:), allocatable :: message
   end type error_type

   type :: unittest_type
      character(len=name_length) :: name = ''
      procedure(test_interface), pointer, nopass :: test => null()
   end type unittest_type

   type :: testsuite_type
      character(len=name_length) :: name = ''
      procedure(collect_interface), pointer, nopass :: collect => null()
   end type testsuite_type

   abstract interface
      subroutine test_interface(error)
         import :: error_type
         type(error_type), allocatable, intent(out) :: error
      end subroutine test_interface

      subroutine collect_interface(testsuite)
         import :: unittest_type
         type(unittest_type), allocatable, intent(out) :: testsuite(:)
      end subroutine collect_interface
   end interface

   interface check
      module procedure :: check_logical, check_integer, check_real, check_text
   end interface check

contains

   function new_unittest(name, test) result(self)
      character(len=*), intent(in) :: name
      procedure(test_interface) :: test
      type(unittest_type) :: self
      self%name = name
      self%test => test
   end function new_unittest

   function new_testsuite(name, collect) result(self)
      character(len=*), intent(in) :: name
      procedure(collect_interface) :: collect
      type(testsuite_type) :: self
      self%name = name
      self%collect => collect
   end function new_testsuite

   !> Run the suite named by the first command argument, or all; end with 1 where a test
   !> failed or none ran
   subroutine run_tests(suites)
      type(testsuite_type), intent(in) :: suites(:)
      type(unittest_type), allocatable :: tests(:)
      type(error_type), allocatable :: error
      character(len=name_length) :: wanted
      integer :: i, j, passed, failed
      call get_command_argument(1, wanted)
      passed = 0
      failed = 0
      do i = 1, size(suites)
         if (wanted /= '' .and. wanted /= suites(i)%name) cycle
         call suites(i)%collect(tests)
         do j = 1, size(tests)
            call tests(j)%test(error)
            if (allocated(error)) then
               failed = failed + 1
               print '(a)', 'FAIL '//trim(suites(i)%name)//'/'//trim(tests(j)%name)//': '//error%message
            else
               passed = passed + 1
               print '(a)', 'ok   '//trim(suites(i)%name)//'/'//trim(tests(j)%name)
            end if
         end do
      end do
      print '(i0, " passed, ", i0, " failed")', passed, failed
      if (failed > 0 .or. passed == 0) stop 1
   end subroutine run_tests

   !> Fail, unless the test has failed before
   subroutine test_failed(error, message, detail)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: message
      character(len=*), intent(in), optional :: detail
      if (allocated(error)) return
      allocate (error)
      error%message = message
      if (present(detail)) error%message = message//': '//detail
   end subroutine test_failed

   subroutine check_logical(error, condition, message)
      type(error_type), allocatable, intent(inout) :: error
      logical, intent(in) :: condition
      character(len=*), intent(in), optional :: message
      if (.not. condition) call differs(error, 'condition does not hold', message)
   end subroutine check_logical

   subroutine check_integer(error, actual, expected, message)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: actual, expected
      character(len=*), intent(in), optional :: message
      character(len=60) :: text
      write (text, '("got ", i0, ", expected ", i0)') actual, expected
      if (actual /= expected) call differs(error, trim(text), message)
   end subroutine check_integer

   subroutine check_text(error, actual, expected, message)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: actual, expected
      character(len=*), intent(in), optional :: message
      if (actual /= expected) call differs(error, 'got "'//actual//'", expected "'//expected//'"', message)
   end subroutine check_text

   !> NaN is sorted out first: `<=` with a NaN would trap where exceptions are trapped
   subroutine check_real(error, actual, expected, message, thr, rel)
      type(error_type), allocatable, intent(inout) :: error
      real(wp), intent(in) :: actual, expected
      character(len=*), intent(in), optional :: message
      real(wp), intent(in), optional :: thr      !! allowed difference, default 100*epsilon
      logical, intent(in), optional :: rel       !! `thr` is relative to `expected`
      character(len=100) :: text
      real(wp) :: allowed, difference
      if (actual == expected) return             ! infinities, too
      allowed = 100*epsilon(1.0_wp)
      if (present(thr)) allowed = thr
      if (present(rel)) then
         if (rel) allowed = allowed*abs(expected)
      end if
      difference = abs(actual - expected)
      if (.not. (ieee_is_nan(difference) .or. ieee_is_nan(allowed))) then
         if (difference <= allowed) return
      end if
      write (text, '("got ", es23.16, ", expected ", es23.16, ", off by ", es9.2, " > ", es9.2)') &
         & actual, expected, difference, allowed
      call differs(error, trim(text), message)
   end subroutine check_real

   subroutine differs(error, detail, message)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: detail
      character(len=*), intent(in), optional :: message
      if (present(message)) then
         call test_failed(error, message, detail)
      else
         call test_failed(error, detail)
      end if
   end subroutine differs

end module testing
