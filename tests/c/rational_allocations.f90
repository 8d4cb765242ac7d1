! SPDX-License-Identifier: BSD-3-Clause
!> Pade's steps allocate nothing after the first few, in any form and storage: counted by this program's own malloc
!> (counting_malloc.c).
program rational_allocations
   use, intrinsic :: iso_c_binding, only: c_long
   use dynstep, only: allocate_state, banded_matrix, clock_type, dense_matrix, diagonal_matrix, form_automatic, form_refined, &
      & identity_matrix, linear_ode, linear_system, matrix_type, ode_system, pade_stepper, state_type, status_type, wp
   implicit none
   interface
      function allocator_calls() bind(c)
         import :: c_long
         integer(c_long) :: allocator_calls
      end function allocator_calls
   end interface
   integer, parameter :: sizes(4) = [1, 4, 20, 60]
   type(linear_system) :: second
   type(linear_ode) :: first
   type(status_type) :: status
   type(matrix_type) :: k
   real(wp) :: a(60, 60)
   integer :: i, j, n, passed, failed

   passed = 0
   failed = 0
   do i = 1, size(sizes)
      n = sizes(i)
      a = 0.0_wp
      do j = 1, n
         a(j, j) = -2.0_wp
      end do
      do j = 2, n
         a(j - 1, j) = 1.0_wp
         a(j, j - 1) = 1.0_wp
      end do
      k = dense_matrix(-a(:n, :n), .true.)
      call second%set(identity_matrix(n), diagonal_matrix([(0.1_wp, j=1, n)]), k, status)
      call compare(second)
      call second%set_coupling(a(:n, 1), a(:n, 1), a(:n, 1), status)
      call compare(second)
      call first%set(dense_matrix(a(:n, :n), .false.), status)
      call compare(first)
      if (n == 1) cycle
      k = banded_matrix(spread([-1.0_wp, 2.0_wp, -1.0_wp], 2, n), 1, 1, .true.)
      call second%set(identity_matrix(n), diagonal_matrix([(0.1_wp, j=1, n)]), k, status)
      call compare(second)
   end do
   print '(i0, " passed, ", i0, " failed")', passed, failed
   if (failed > 0) stop 1

contains

   subroutine compare(sys)
      class(ode_system), intent(inout) :: sys
      type(pade_stepper) :: stepper
      type(state_type) :: state
      type(clock_type) :: clock
      integer(c_long) :: before, calls
      integer :: form, p
      do form = form_automatic, form_refined
         do p = 2, 6, 2
            stepper%p = p
            stepper%q = 4
            if (p > 4 .and. form == 1) cycle
            stepper%form = form
            call stepper%init(sys, status)
            call allocate_state(sys, state, status)
            state%t = 0.0_wp
            state%y = 1.0_wp
            call stepper%start(sys, state, status)
            clock = clock_type(h=0.01_wp)
            call stepper%advance(sys, state, clock, 5, status, .true.)
            before = allocator_calls()
            call stepper%advance(sys, state, clock, 100, status, .true.)
            calls = allocator_calls() - before
            if (before > 0_c_long .and. calls == 0_c_long .and. .not. status%failed()) then
               passed = passed + 1
            else
               failed = failed + 1
               print '(a, 3(i0, 1x), a)', 'FAIL n, p, form: ', sys%n, p, form, trim(status%message)
               print '(a, i0)', '     calls of malloc in 100 steps: ', calls
            end if
         end do
      end do
   end subroutine compare
end program rational_allocations
