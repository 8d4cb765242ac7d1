! SPDX-License-Identifier: BSD-3-Clause
!> A fault on purpose: one test of two fails, which the harness must count and end with 1.
module test_failing
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
contains

   subroutine collect_failing(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [new_unittest('passes', passes), new_unittest('fails', fails)]
   end subroutine collect_failing

   subroutine passes(error)
      type(error_type), allocatable, intent(out) :: error
      call check(error, .true.)
   end subroutine passes

   subroutine fails(error)
      type(error_type), allocatable, intent(out) :: error
      call check(error, .false., 'on purpose')
   end subroutine fails

end module test_failing

program planted_failure
   use test_failing, only: collect_failing
   use testing, only: new_testsuite, run_tests
   implicit none
   call run_tests([new_testsuite('failing', collect_failing)])
end program planted_failure
