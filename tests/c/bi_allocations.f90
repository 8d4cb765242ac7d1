! SPDX-License-Identifier: BSD-3-Clause
!> Backinterpolation allocates nothing in a step: counted by this program's own malloc (counting_malloc.c).
module bi_problem
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   implicit none
   private

   !> y_i' = d (y_{i-1} - 2 y_i + y_{i+1}) + y_i (1 - y_i) cos t
   type, extends(ode_system), public :: reacting_chain
   contains
      procedure :: rhs => chain_rhs
   end type reacting_chain

contains

   recursive subroutine chain_rhs(self, t, y, f, ierr)
      class(reacting_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      integer :: i
      ierr = 0
      do i = 1, size(y)
         f(i) = -20*y(i) + y(i)*(1 - y(i))*cos(t)
         if (i > 1) f(i) = f(i) + 10*y(max(1, i - 1))
         if (i < size(y)) f(i) = f(i) + 10*y(min(size(y), i + 1))
      end do
   end subroutine chain_rhs
end module bi_problem

program bi_allocations
   use, intrinsic :: iso_c_binding, only: c_long
   use bi_problem, only: reacting_chain
   use dynstep_backinterpolation, only: backinterpolation_stepper
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_dense
   use dynstep_status, only: status_type
   use dynstep_stepper, only: clock_type, state_type
   implicit none
   interface
      function allocator_calls() bind(c)
         import :: c_long
         integer(c_long) :: allocator_calls
      end function allocator_calls
   end interface
   real(wp), parameter :: alphas(4) = [0.0_wp, 0.44_wp, 0.5_wp, 1.0_wp]
   integer :: passed, failed, i, kind, p
   passed = 0
   failed = 0
   do i = 1, 4
      do kind = kind_banded, kind_dense
         do p = 1, 6
            call count_calls(alphas(i), kind, p)
         end do
      end do
   end do
   print '(i0, " passed, ", i0, " failed")', passed, failed
   if (failed > 0) stop 1

contains

   subroutine count_calls(alpha, kind, p)
      real(wp), intent(in) :: alpha
      integer, intent(in) :: kind
      integer, intent(in) :: p                     !! order of both halves, 6: Fehlberg's
      integer, parameter :: n = 20
      type(reacting_chain) :: sys
      type(backinterpolation_stepper) :: stepper
      type(state_type) :: state
      type(clock_type) :: clock
      type(status_type) :: status
      integer(c_long) :: before, calls
      real(wp) :: error(n)
      integer :: k
      sys%n = n
      sys%jacobian_kind = kind
      sys%jacobian_kl = 1
      sys%jacobian_ku = 1
      stepper%p = min(p, 5)
      stepper%q = min(p, 5)
      stepper%halves = merge(2, 1, p == 6)
      stepper%alpha = alpha
      call stepper%init(sys, status)
      state%y = [(0.05_wp*k, k=1, n)]
      call stepper%start(sys, state, status)
      clock = clock_type(h=0.02_wp, k=0)
      call stepper%advance(sys, state, clock, 3, status, complete=.true.)     ! what is allocated once, is by now
      before = allocator_calls()
      call stepper%advance(sys, state, clock, 40, status, complete=.true.)
      call stepper%estimate_error(error)
      clock = clock_type(t0=clock%time(), h=0.05_wp, k=0)
      call stepper%advance(sys, state, clock, 20, status, complete=.false.)
      calls = allocator_calls() - before
      if (calls == 0 .and. .not. status%failed() .and. allocator_calls() > 0) then
         passed = passed + 1
      else
         failed = failed + 1
         print '(a, i0, a, f5.2, a, i0, a, i0)', 'FAIL ', calls, ' calls, alpha ', alpha, ', kind ', kind, ', p ', p
         if (status%failed()) print '(a)', trim(status%message)
      end if
   end subroutine count_calls
end program bi_allocations
