! SPDX-License-Identifier: BSD-3-Clause
!> Defaults of a system that gives g or k alone: derivatives by differences, and reactions.
module test_constraints
   use constraint_cases, only: arm, bar, bare_type, chain, drive, edge, given_type
   use dynstep, only: jacobian_type, long, status_type, wp
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_constraints

   !> A reaction that is nonlinear in one multiplier, r = -G^T lambda - K^T psi + [0, ..., 0, psi(1)^3]
   type, extends(given_type) :: general_type
   contains
      procedure :: reaction => general_reaction
   end type general_type

contains

   subroutine collect_constraints(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('units', test_units), &
         & new_unittest('drives', test_drives), &
         & new_unittest('groups', test_groups), &
         & new_unittest('velocities', test_velocities), &
         & new_unittest('reactions', test_reactions), &
         & new_unittest('edge-of-domain', test_edge_of_domain), &
         & new_unittest('refusals', test_refusals), &
         & new_unittest('other-sizes', test_other_sizes)]
   end subroutine collect_constraints

   !> Lengths of 1 mm to 1 km, near and far from the origin, angles of 0 to 3000 rad
   subroutine test_units(error)
      type(error_type), allocatable, intent(out) :: error
      type(bare_type) :: sys
      call sys%setup(arm)
      call look('an arm', [1.2_wp, 0.9_wp, 0.3_wp, -0.8_wp], [0.3_wp, 2.0_wp, 1.0_wp, 0.5_wp])
      call look('stretched', [1.7_wp, 0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 2.0_wp, 1.0_wp, 0.5_wp])
      call look('many turns', [1.2_wp, 0.9_wp, 3000.3_wp, -0.8_wp], [0.3_wp, 2.0_wp, 10.0_wp, 0.5_wp])
      call look('fast', [1.2_wp, 0.9_wp, 0.3_wp, -0.8_wp], [0.3_wp, 2.0_wp, 1.0e6_wp, 0.5_wp])
      call look('slow', [1.2_wp, 0.9_wp, 0.3_wp, -0.8_wp], 1.0e-7_wp*[0.3_wp, 2.0_wp, 1.0_wp, 0.5_wp])
      sys%origin = 1.0e3_wp
      call look('far away', [1001.2_wp, 0.9_wp, 0.3_wp, -0.8_wp], [0.3_wp, 2.0_wp, 1.0_wp, 0.5_wp])
      sys%origin = 0.0_wp
      sys%length = 1.0e3_wp
      call look('long', [1.2e3_wp, 0.9e3_wp, 0.3_wp, -0.8_wp], [300.0_wp, 200.0_wp, 1.0_wp, 0.5_wp])
      sys%length = 1.0e-3_wp
      call look('short', [1.2e-3_wp, 0.9e-3_wp, 0.3_wp, -0.8_wp], [0.3e-3_wp, 2.0e-3_wp, 1.0_wp, 0.5_wp])
      call look('short, stretched', [1.7e-3_wp, 0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 2.0e-3_wp, 1.0_wp, 0.5_wp])
      call sys%setup(bar)
      call look('short bar', 1.0e-3_wp*[0.1_wp, 0.2_wp, 0.7_wp, 1.0_wp], 1.0e-3_wp*[1.0_wp, 0.2_wp, -0.3_wp, 0.4_wp])
      call look('short bar away', 1.0_wp + 1.0e-3_wp*[0.1_wp, 0.2_wp, 0.7_wp, 1.0_wp], &
         & 1.0e-3_wp*[1.0_wp, 0.2_wp, -0.3_wp, 0.4_wp])
      sys%length = 1.0_wp
      call look('bar', [0.1_wp, 0.2_wp, 0.7_wp, 1.0_wp], [1.0_wp, 0.2_wp, -0.3_wp, 0.4_wp])
      call look('bar far away', 1.0e3_wp + [0.1_wp, 0.2_wp, 0.7_wp, 1.0_wp], [1.0_wp, 0.2_wp, -0.3_wp, 0.4_wp])
      sys%length = 1.0e3_wp
      call look('long bar', 1.0e3_wp*[0.1_wp, 0.2_wp, 0.7_wp, 1.0_wp], [1.0_wp, 0.2_wp, -0.3_wp, 0.4_wp])

   contains

      subroutine look(what, q, v)
         character(len=*), intent(in) :: what
         real(wp), intent(in) :: q(:), v(:)
         call compare(error, what, sys, 0.7_wp, q, v, 1.0e-12_wp, 5.0e-11_wp)
      end subroutine look
   end subroutine test_units

   !> Drives of 0.03 to 3e5 rad/s, whose time scale nothing tells.  At 1e5 rad rounding of the phase, 1e-11,
   !> is what is left of the second derivative, times 1/delta^2.
   subroutine test_drives(error)
      type(error_type), allocatable, intent(out) :: error
      type(bare_type) :: sys
      real(wp) :: allowed
      character(len=20) :: what
      integer :: i
      call sys%setup(drive)
      do i = -2, 5
         sys%rate = 3.0_wp*10.0_wp**i
         write (what, '(es8.1, " rad/s")') sys%rate
         allowed = 5.0e-11_wp + 3.0e4_wp*epsilon(1.0_wp)*(sys%rate*0.37_wp)
         call compare(error, what, sys, 0.37_wp, [0.3_wp, 0.1_wp, 0.2_wp], [1.0_wp, 0.2_wp, -0.3_wp], 1.0e-12_wp, allowed)
      end do
      sys%rate = 300.0_wp
      call compare(error, 'at rest', sys, 0.0_wp, [0.3_wp, 0.1_wp, 0.2_wp], [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-12_wp, 5.0e-11_wp)
      call compare(error, 'nearly', sys, 0.0_wp, [0.3_wp, 0.1_wp, 0.2_wp], [1.0e-15_wp, 0.0_wp, 0.0_wp], 1.0e-12_wp, &
         & 5.0e-11_wp)
      ! an orbit in seconds
      sys%rate = 2.0e-7_wp
      call compare(error, 'a year', sys, 5.0e7_wp, [0.3_wp, 0.1_wp, 0.2_wp], [2.0e-7_wp, 4.0e-8_wp, -6.0e-8_wp], 5.0e-10_wp, &
         & 5.0e-10_wp)
   end subroutine test_drives

   !> G, dg/dt and both curvatures against those in closed form
   subroutine compare(error, what, sys, t, q, v, allowed_g, allowed_c)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: what
      type(bare_type), intent(inout) :: sys
      real(wp), intent(in) :: t, q(:), v(:)
      real(wp), intent(in) :: allowed_g          !! relative to the largest entry of the column
      real(wp), intent(in) :: allowed_c
      type(jacobian_type) :: gq
      type(given_type) :: given
      type(status_type) :: status
      real(wp) :: g(sys%holonomic, sys%n), gt(sys%holonomic), found(sys%holonomic), c(sys%holonomic)
      integer :: i, j, ierr
      call gq%init(sys%holonomic, sys%n, sys%constraints%g, status)
      found = 0.0_wp
      call sys%constraint_jacobian(t, q, gq, found, ierr)
      call check(error, ierr, 0, what)
      call sys%exact_jacobian(t, q, g, gt)
      do j = 1, sys%n
         do i = 1, sys%holonomic
            call check(error, gq%entry(i, j), g(i, j), what//': G', thr=allowed_g*maxval(abs(g(:, j))))
         end do
      end do
      do i = 1, sys%holonomic
         call check(error, found(i), gt(i), what//': dg/dt', thr=allowed_g*maxval(abs(gt)))
      end do
      call sys%exact_curvature(t, q, v, c)
      call sys%constraint_curvature(t, q, v, found, ierr)
      call check(error, ierr, 0, what)
      do i = 1, sys%holonomic
         call check(error, found(i), c(i), what//': curvature', thr=allowed_c*maxval(abs(c)))
      end do
      given%bare_type = sys
      given%gives_curvature = .false.
      call given%constraint_curvature(t, q, v, found, ierr)
      call check(error, ierr, 0, what)
      do i = 1, sys%holonomic
         call check(error, found(i), c(i), what//': curvature by G', thr=allowed_c*maxval(abs(c)))
      end do
   end subroutine compare

   !> 200 bars with four columns each: four groups serve them all, and G does not change with t
   subroutine test_groups(error)
      type(error_type), allocatable, intent(out) :: error
      type(bare_type) :: sys, dense
      type(jacobian_type) :: gq, full
      type(status_type) :: status
      real(wp), allocatable :: g(:, :)
      real(wp) :: q(402), gt(200), found(200)
      integer(long) :: before
      integer :: i, ierr
      ! of coordinates up to 5, whose squares lose 25 eps, over steps of 2 to 4 thousandths and entries of 2 and more
      real(wp), parameter :: rounding = 1.0e-11_wp
      allocate (g(200, 402))
      q = [(0.01_wp*i + sin(3.0_wp*i), i=1, 402)]
      call sys%setup(chain, 200)
      dense = sys
      deallocate (dense%constraints%g%first, dense%constraints%g%column)
      call gq%init(200, 402, sys%constraints%g, status)
      call full%init(200, 402, dense%constraints%g, status)
      call check(error, .not. status%failed(), trim(status%message))
      call sys%exact_jacobian(0.0_wp, q, g, gt)
      do i = 1, 2
         before = sys%difference_constraints
         sys%calls = 0
         call sys%constraint_jacobian(0.0_wp, q, gq, found, ierr)
         call check(error, ierr, 0)
         call check(error, sys%calls, 4*4 + 2, 'four points for each group, two for the time')
         call check(error, int(sys%difference_constraints - before), sys%calls, 'counted')
         call check(error, maxval(abs(found)), 0.0_wp, 'no change with t', thr=0.0_wp)
      end do
      call dense%constraint_jacobian(0.0_wp, q, full, found, ierr)
      call check(error, dense%calls, 4*402 + 2, 'each column by itself')
      call check(error, largest_error(gq, g), 0.0_wp, 'groups', thr=rounding)
      call check(error, largest_error(full, g), 0.0_wp, 'columns', thr=rounding)
      ! a Jacobian that stores all entries is filled with none of them mixed up
      call sys%constraint_jacobian(0.0_wp, q, full, found, ierr)
      call check(error, largest_error(full, g), 0.0_wp, 'a dense Jacobian of a system with a pattern', thr=rounding)

   contains

      real(wp) function largest_error(jacobian, exact)
         type(jacobian_type), intent(in) :: jacobian
         real(wp), intent(in) :: exact(:, :)
         integer :: row, column
         largest_error = 0.0_wp
         do column = 1, size(exact, 2)
            do row = 1, size(exact, 1)
               largest_error = max(largest_error, abs(jacobian%entry(row, column) - exact(row, column)) &
                  & /maxval(abs(exact(row, :))))
            end do
         end do
      end function largest_error
   end subroutine test_groups

   !> K, with one constraint that is not linear in v, and its curvature
   subroutine test_velocities(error)
      type(error_type), allocatable, intent(out) :: error
      type(bare_type) :: sys
      call sys%setup(edge)
      call look('edge', 1.0_wp, [1.0_wp, 2.0_wp, 0.3_wp], [0.5_wp, 0.2_wp, 0.3_wp])
      call look('slow', 1.0_wp, [1.0e-3_wp, 2.0_wp, 0.3_wp], [0.5e-3_wp, 0.2e-3_wp, 0.3_wp])
      call look('far away', 1.0_wp, [1.0e3_wp, 2.0e3_wp, 0.3_wp], [5.0_wp, 2.0_wp, 0.3_wp])
      call look('driven', 300.0_wp, [1.0_wp, 2.0_wp, 0.3_wp], [0.5_wp, 0.2_wp, 0.3_wp])

   contains

      subroutine look(what, rate, q, v)
         character(len=*), intent(in) :: what
         real(wp), intent(in) :: rate, q(3), v(3)
         type(jacobian_type) :: kv
         type(status_type) :: status
         real(wp) :: k(2, 3), c(2), found(2)
         integer :: i, j, ierr
         sys%rate = rate
         call kv%init(2, 3, sys%constraints%k, status)
         call sys%velocity_jacobian(0.4_wp, q, v, kv, ierr)
         call check(error, ierr, 0, what)
         call sys%exact_velocity_jacobian(0.4_wp, q, v, k)
         do j = 1, 3
            do i = 1, 2
               call check(error, kv%entry(i, j), k(i, j), what//': K', thr=1.0e-12_wp*maxval(abs(k(i, :))))
            end do
         end do
         call sys%exact_velocity_curvature(0.4_wp, q, v, c)
         call sys%velocity_curvature(0.4_wp, q, v, found, ierr)
         call check(error, ierr, 0, what)
         do i = 1, 2
            call check(error, found(i), c(i), what//': curvature', thr=1.0e-12_wp*maxval(abs(c)))
         end do
      end subroutine look
   end subroutine test_velocities

   recursive subroutine general_reaction(self, t, q, v, lambda, psi, r, ierr)
      class(general_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr
      call self%lagrange_reaction(t, q, v, lambda, psi, r, ierr)
      if (self%nonholonomic > 0) r(self%n) = r(self%n) + psi(1)**3
   end subroutine general_reaction

   !> -G^T lambda - K^T psi, and derivatives by multipliers of any size, one of them cubic
   subroutine test_reactions(error)
      type(error_type), allocatable, intent(out) :: error
      type(bare_type) :: sys
      type(general_type) :: general
      real(wp), parameter :: q(3) = [1.0_wp, 2.0_wp, 0.3_wp], v(3) = [0.5_wp, 0.2_wp, 0.3_wp]
      real(wp) :: g(2, 3), gt(2), k(2, 3), r(3), expected(3), rl(3, 2), rp(3, 2), none(3, 0), lambda(2), psi(2)
      integer :: i, j, ierr
      do i = -3, 6, 3
         lambda = [3.0_wp, -2.0_wp]*10.0_wp**i
         call sys%setup(drive)
         call sys%reaction(0.4_wp, q, v, lambda, psi(:0), r, ierr)
         call check(error, ierr, 0)
         call sys%exact_jacobian(0.4_wp, q, g, gt)
         expected = -matmul(transpose(g), lambda)
         call check(error, maxval(abs(r - expected)), 0.0_wp, 'reaction by lambda', thr=1.0e-12_wp*maxval(abs(expected)))
         rl = 0.0_wp
         call sys%reaction_jacobian(0.4_wp, q, v, lambda, psi(:0), rl, none, ierr)
         call check(error, ierr, 0)
         call check(error, maxval(abs(rl + transpose(g))), 0.0_wp, 'by lambda', thr=5.0e-12_wp)

         psi = [0.5_wp, 2.0_wp]*10.0_wp**i
         call general%setup(edge)
         call general%reaction(0.4_wp, q, v, lambda(:0), psi, r, ierr)
         call check(error, ierr, 0)
         call general%exact_velocity_jacobian(0.4_wp, q, v, k)
         expected = -matmul(transpose(k), psi) + [0.0_wp, 0.0_wp, psi(1)**3]
         call check(error, maxval(abs(r - expected)), 0.0_wp, 'reaction by psi', thr=1.0e-14_wp*maxval(abs(expected)))
         rp = 0.0_wp
         call general%reaction_jacobian(0.4_wp, q, v, lambda(:0), psi, none, rp, ierr)
         call check(error, ierr, 0)
         k(1, 3) = k(1, 3) - 3.0_wp*psi(1)**2
         do j = 1, 2
            call check(error, maxval(abs(rp(:, j) + k(j, :))), 0.0_wp, 'by psi', thr=1.0e-12_wp*max(1.0_wp, maxval(abs(k))))
         end do
      end do
   end subroutine test_reactions

   !> Near the edge of the domain the steps become shorter, on it one-sided
   subroutine test_edge_of_domain(error)
      type(error_type), allocatable, intent(out) :: error
      type(bare_type) :: sys
      real(wp), parameter :: q(4) = [1.2_wp, 0.9_wp, 0.3_wp, -0.8_wp], v(4) = [0.3_wp, 2.0_wp, 1.0_wp, 0.5_wp]
      call sys%setup(arm)
      sys%least = q(1) - 1.0e-3_wp
      call compare(error, 'near the edge', sys, 0.0_wp, q, v, 1.0e-11_wp, 1.0e-8_wp)
      sys%least = q(1)
      call compare(error, 'on the left edge', sys, 0.0_wp, q, v, 1.0e-11_wp, 1.0e-8_wp)
      sys%least = -huge(1.0_wp)
      sys%most = q(1)
      call compare(error, 'on the right edge', sys, 0.0_wp, q, v, 1.0e-11_wp, 1.0e-8_wp)
   end subroutine test_edge_of_domain

   !> Outside the domain the procedures say so, and give up at once where the user does
   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(bare_type) :: sys
      type(jacobian_type) :: gq, kv
      type(status_type) :: status
      real(wp) :: gt(2), c(2), r(4), rl(4, 2), none(4, 0), q(4), q3(3)
      integer :: ierr, i
      q = 0.5_wp
      q3 = 0.5_wp
      do i = -1, 1, 2
         call sys%setup(arm)
         sys%least = 2.0_wp
         sys%refusal = 7*i
         call gq%init(2, 4, sys%constraints%g, status)
         sys%calls = 0
         call sys%constraint_jacobian(0.0_wp, q, gq, gt, ierr)
         call check(error, ierr, 7*i, 'G')
         if (i < 0) call check(error, sys%calls, 1, 'one call is enough to give up')
         call sys%constraint_curvature(0.0_wp, q, q, c, ierr)
         call check(error, ierr, 7*i, 'curvature')
         call sys%reaction(0.0_wp, q, q, c, c(:0), r, ierr)
         call check(error, ierr, 7*i, 'reaction')
         call sys%reaction_jacobian(0.0_wp, q, q, c, c(:0), rl, none, ierr)
         call check(error, ierr, 7*i, 'reaction_jacobian')
         call sys%setup(edge)
         call kv%init(2, 3, sys%constraints%k, status)
         call sys%velocity_jacobian(0.0_wp, q3, q3, kv, ierr)
         call check(error, ierr, 7*i, 'K')
         call sys%velocity_curvature(0.0_wp, q3, q3, c, ierr)
         call check(error, ierr, 7*i, 'curvature of k')
      end do
   end subroutine test_refusals

   !> One system with another number of coordinates and constraints, and another pattern
   subroutine test_other_sizes(error)
      type(error_type), allocatable, intent(out) :: error
      type(bare_type) :: sys
      real(wp) :: q(12)
      integer :: i
      q = [(0.3_wp*i + sin(3.0_wp*i), i=1, 12)]
      call sys%setup(chain, 5)
      call compare(error, 'five bars', sys, 0.0_wp, q, cos(q), 1.0e-12_wp, 5.0e-11_wp)
      call sys%setup(chain, 3)
      call compare(error, 'three bars', sys, 0.0_wp, q(:8), cos(q(:8)), 1.0e-12_wp, 5.0e-11_wp)
      deallocate (sys%constraints%g%first, sys%constraints%g%column)
      call compare(error, 'three bars, no pattern', sys, 0.0_wp, q(:8), cos(q(:8)), 1.0e-12_wp, 5.0e-11_wp)
      call sys%setup(arm)
      call compare(error, 'an arm', sys, 0.0_wp, q(:4), cos(q(:4)), 1.0e-12_wp, 5.0e-11_wp)
   end subroutine test_other_sizes
end module test_constraints
