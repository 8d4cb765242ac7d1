! SPDX-License-Identifier: BSD-3-Clause
!> Systems of constrained motion allocate nothing after init: counted by this program's own malloc (counting_malloc.c).
program saddle_allocations
   use, intrinsic :: iso_c_binding, only: c_long
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_identity, matrix_type
   use dynstep_saddle_point, only: saddle_point_type
   use dynstep_status, only: status_type
   implicit none
   interface
      function allocator_calls() bind(c)
         import :: c_long
         integer(c_long) :: allocator_calls
      end function allocator_calls
   end interface
   integer, parameter :: kinds(4) = [kind_identity, kind_diagonal, kind_banded, kind_dense]
   integer :: passed, failed, i, general
   passed = 0
   failed = 0
   call count_one(allocator_calls() > 0_c_long, 'this program''s malloc is the one in force')
   do i = 1, 4
      do general = 0, 1
         call count_calls(kinds(i), 3, 2, 1, .true., general == 1)
         call count_calls(kinds(i), 90, 40, 5, .false., general == 1)
         call count_calls(kinds(i), 90, 40, 5, .true., general == 1)
      end do
   end do
   print '(i0, " passed, ", i0, " failed")', passed, failed
   if (failed > 0) stop 1

contains

   subroutine count_one(holds, what)
      logical, intent(in) :: holds
      character(len=*), intent(in) :: what
      if (holds) then
         passed = passed + 1
      else
         failed = failed + 1
         print '(a)', 'FAIL '//what
      end if
   end subroutine count_one

   !> Every way of factorize and solve, a singular system too
   subroutine count_calls(kind, n, m, p, patterned, general)
      integer, intent(in) :: kind, n, m, p
      logical, intent(in) :: patterned, general
      type(saddle_point_type) :: saddle
      type(matrix_type) :: a
      type(pattern_type) :: g_pattern, k_pattern
      type(jacobian_type) :: g, k
      type(status_type) :: status
      integer, allocatable :: order(:)
      real(wp) :: x(n), lambda(m), psi(p), rl(n, m), rp(n, p)
      integer(c_long) :: before, calls
      integer :: i, j
      character(len=80) :: what
      if (patterned) then
         g_pattern%first = [(2*i - 1, i=1, m + 1)]
         g_pattern%column = [((2*n*(i - 1))/(2*m + 1) + 1, (2*n*(i - 1))/(2*m + 1) + 2, i=1, m)]
         k_pattern%first = [(i, i=1, p + 1)]
         k_pattern%column = [(g_pattern%column(2*i*(m/p)), i=1, p)]
      end if
      call a%init(kind, n, 1, 1, .true., status)
      do i = 1, n
         call a%set_entry(i, i, 2.0_wp)
      end do
      call g%init(m, n, g_pattern, status)
      call k%init(p, n, k_pattern, status)
      g%value = [(sin(real(i*i, wp)), i=1, size(g%value))]
      k%value = [(cos(real(i*i, wp)), i=1, size(k%value))]
      do j = 1, n
         do i = 1, m
            rl(j, i) = -g%entry(i, j)
         end do
         do i = 1, p
            rp(j, i) = -k%entry(i, j)
         end do
      end do
      call saddle%init(n, m, p, kind, 1, 1, .true., g_pattern, k_pattern, general, order, status)
      x = 1.0_wp
      lambda = 1.0_wp
      psi = 1.0_wp
      before = allocator_calls()
      do i = 1, 10
         call saddle%factorize(a, g, k, status, 1.0_wp, 'iteration matrix')
         call saddle%solve(x, lambda, psi)
         call saddle%factorize(a, g, k, status, 1.0_wp, hold_psi=.true., regularization=1.0e-8_wp)
         call saddle%solve(x, lambda, psi)
         if (general) call saddle%factorize(a, g, k, status, 1.0_wp, rl=rl, rp=rp)
         call saddle%solve(x, lambda, psi)
      end do
      if (kind == kind_diagonal) then
         ! not for the complement of A
         call a%set_entry(1, 1, -2.0_wp)
         call saddle%factorize(a, g, k, status, 1.0_wp)
         call saddle%solve(x, lambda, psi)
      end if
      calls = allocator_calls() - before
      write (what, '("kind ", i0, ", n = ", i0, ", patterned: ", l1, ", general: ", l1)') kind, n, patterned, general
      call count_one(.not. status%failed(), trim(what)//trim(status%message))
      call count_one(calls == 0_c_long, trim(what)//': factorize or solve allocates')
      call count_one(saddle%is_banded .eqv. (n > 50 .and. patterned .and. kind /= kind_dense .and. .not. general), &
         & trim(what)//': banded or not')
   end subroutine count_calls
end program saddle_allocations
