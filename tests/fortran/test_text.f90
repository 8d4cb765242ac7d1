! SPDX-License-Identifier: BSD-3-Clause
!> Numbers as texts.
module test_text
   use, intrinsic :: ieee_arithmetic, only: ieee_negative_inf, ieee_quiet_nan, ieee_value
   use dynstep_kinds, only: long, wp
   use dynstep_text, only: text
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_text

contains

   subroutine collect_text(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('integers', test_integers), &
         & new_unittest('reals', test_reals), &
         & new_unittest('not-finite', test_not_finite)]
   end subroutine collect_text

   subroutine test_integers(error)
      type(error_type), allocatable, intent(out) :: error
      call check(error, '['//text(0)//text(-12)//']', '[0-12]')
      call check(error, text(huge(1_long)), '9223372036854775807')
   end subroutine test_integers

   subroutine test_reals(error)
      type(error_type), allocatable, intent(out) :: error
      call check(error, '['//text(0.0_wp)//']', '[0]')
      call check(error, '['//text(100.0_wp)//']', '[100]')
      call check(error, text(-0.5_wp), '-0.5')
      call check(error, text(123456.789_wp), '123456.789')
      call check(error, text(1.0e-7_wp), '1.00000E-07')
      call check(error, text(-2.0e30_wp), '-2.00000E+30')
      call check(error, text(1.0e100_wp), '1.00000E+100')
      call check(error, text(-3.0e-308_wp), '-3.00000E-308')
   end subroutine test_reals

   subroutine test_not_finite(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: x
      x = 0.0_wp
      call check(error, text(ieee_value(x, ieee_quiet_nan)), 'NaN')
      call check(error, text(ieee_value(x, ieee_negative_inf)), '-Infinity')
   end subroutine test_not_finite

end module test_text
