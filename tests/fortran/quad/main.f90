! SPDX-License-Identifier: BSD-3-Clause
!> The suites that run the library in quadruple precision.
program quad_tester
   use test_orders, only: collect_orders
   use test_rational_orders, only: collect_rational_orders
   use testing, only: new_testsuite, run_tests
   implicit none
   call run_tests([ &
      & new_testsuite('orders', collect_orders), &
      & new_testsuite('rational_orders', collect_rational_orders)])
end program quad_tester
