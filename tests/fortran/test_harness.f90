! SPDX-License-Identifier: BSD-3-Clause
!> The harness itself: a check fails where it should, and only there.
module test_harness
   use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: real64
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_harness

   integer, parameter :: wp = real64

contains

   subroutine collect_harness(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('equal-passes', test_equal_passes), &
         & new_unittest('unequal-fails', test_unequal_fails), &
         & new_unittest('relative', test_relative), &
         & new_unittest('nan-fails', test_nan_fails), &
         & new_unittest('first-failure-stays', test_first_failure_stays)]
   end subroutine collect_harness

   subroutine test_equal_passes(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: infinity
      infinity = ieee_value(infinity, ieee_positive_inf)
      call check(error, .true.)
      call check(error, 2, 2)
      call check(error, 'ab', 'ab')
      call check(error, 1.0_wp, 1.0_wp, thr=0.0_wp)
      call check(error, 1.0_wp + epsilon(1.0_wp), 1.0_wp)
      call check(error, infinity, infinity)
   end subroutine test_equal_passes

   subroutine test_unequal_fails(error)
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: a, b, c, d
      call check(a, .false.)
      call check(b, 2, 3)
      call check(c, 'ab', 'abc')
      call check(d, 1.0_wp + epsilon(1.0_wp), 1.0_wp, thr=0.0_wp)
      call check(error, allocated(a) .and. allocated(b) .and. allocated(c) .and. allocated(d))
      call check(error, b%message, 'got 2, expected 3')
   end subroutine test_unequal_fails

   subroutine test_relative(error)
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: inner
      call check(error, 1.01e6_wp, 1.0e6_wp, thr=0.02_wp, rel=.true.)
      call check(inner, 1.01e6_wp, 1.0e6_wp, thr=0.002_wp, rel=.true.)
      call check(error, allocated(inner))
   end subroutine test_relative

   subroutine test_nan_fails(error)
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: a, b, c
      real(wp) :: nan
      nan = ieee_value(nan, ieee_quiet_nan)
      call check(a, nan, 1.0_wp, thr=huge(1.0_wp))
      call check(b, 1.0_wp, nan)
      call check(c, 1.0_wp, 2.0_wp, thr=nan)
      call check(error, allocated(a) .and. allocated(b) .and. allocated(c))
   end subroutine test_nan_fails

   subroutine test_first_failure_stays(error)
      type(error_type), allocatable, intent(out) :: error
      type(error_type), allocatable :: inner
      call test_failed(inner, 'first')
      call check(inner, .true., 'second')
      call check(inner, .false., 'third')
      call check(error, inner%message, 'first')
   end subroutine test_first_failure_stays

end module test_harness
