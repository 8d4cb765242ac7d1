! SPDX-License-Identifier: BSD-3-Clause
!> The suites that run the library in quadruple precision.
program quad_tester
   use test_dense_orders, only: collect_dense_orders
   use test_orders, only: collect_orders
   use test_rational_orders, only: collect_rational_orders
   use testing, only: new_testsuite, run_tests
   implicit none
   call run_tests([ &
      & new_testsuite('orders', collect_orders), &
      & new_testsuite('rational_orders', collect_rational_orders), &
      & new_testsuite('dense_orders', collect_dense_orders)])
end program quad_tester
