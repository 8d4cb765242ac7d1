! SPDX-License-Identifier: BSD-3-Clause
!> Stages of rational steps allocate nothing after init: counted by this program's own malloc (counting_malloc.c).
program pole_allocations
   use, intrinsic :: iso_c_binding, only: c_long
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: banded_matrix, identity_matrix, matrix_type
   use dynstep_pole_sweeps, only: pole_sweeps_type
   use dynstep_status, only: status_type
   implicit none
   interface
      function allocator_calls() bind(c)
         import :: c_long
         integer(c_long) :: allocator_calls
      end function allocator_calls
   end interface
   integer, parameter :: n = 1000
   type(pole_sweeps_type) :: s
   type(status_type) :: status
   type(matrix_type) :: m, c, k
   complex(wp) :: poles(4), tau(4), x(n)
   real(wp) :: w(4), q(n), v(n), dq(n), dv(n), load(2*4*n), band(5, n)
   integer(c_long) :: before, calls
   integer :: i, passed, trouble

   do i = 1, n
      band(:, i) = [1.0_wp, -4.0_wp, 6.0_wp, -4.0_wp, 1.0_wp]
   end do
   m = identity_matrix(n)
   k = banded_matrix(band, 2, 2, .true.)
   c = k
   poles = [((i + 1.0_wp)*(1.0_wp, 0.7_wp), i=1, 4)]
   tau = poles
   w = 2.0_wp
   q = 1.0_wp
   v = 0.0_wp
   load = 1.0_wp
   x = (1.0_wp, 0.0_wp)
   call s%init(n, 2, 4, status)
   before = allocator_calls()
   do i = 1, 4
      call s%factorize(m, c, k, 0.1_wp, poles(:i), trouble)
      call s%increment(tau(:i), w(:i), q, v, dq, dv)
      call s%increment(tau(:i), w(:i), q, v, dq, dv, load)
      call s%solve(i, x)
   end do
   calls = allocator_calls() - before
   passed = 0
   if (before > 0_c_long) passed = passed + 1
   if (calls == 0_c_long) passed = passed + 1
   if (passed < 2) print '(a, i0)', 'FAIL calls of malloc in stages: ', calls
   print '(i0, " passed, ", i0, " failed")', passed, 2 - passed
   if (passed < 2) stop 1
end program pole_allocations
