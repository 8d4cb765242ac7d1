! SPDX-License-Identifier: BSD-3-Clause
!> Plane chains of rods in Cartesian coordinates (x, y and angle of each), with two constraints at each joint: the
!> systems whose equations have a narrow band.
module rod_chains
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_jacobian, only: pattern_type
   use random_matrices, only: random
   implicit none
   private

   public :: body_order, rod_pattern, shuffled

contains

   !> Pattern of G: joint i is between rods i - 1 and i; the first holds rod 1 to the ground, or to the last rod of a
   !> closed chain
   subroutine rod_pattern(rods, closed, coordinate, pattern)
      integer, intent(in) :: rods
      logical, intent(in) :: closed
      integer, intent(in) :: coordinate(:)              !! number of the coordinate, 3i - 2, 3i - 1, 3i of rod i [3 rods]
      type(pattern_type), intent(out) :: pattern
      integer :: columns(4), i, j, before, e, entries
      allocate (pattern%first(2*rods + 1), pattern%column(8*rods))
      pattern%first(1) = 1
      e = 0
      do i = 1, rods
         before = i - 1
         if (closed .and. i == 1) before = rods
         do j = 1, 2
            entries = 2
            columns(:2) = [coordinate(3*i - 3 + j), coordinate(3*i)]
            if (before > 0 .and. before /= i) then
               entries = 4
               columns(3:) = [coordinate(3*before - 3 + j), coordinate(3*before)]
            end if
            call sort(columns(:entries))
            pattern%column(e + 1:e + entries) = columns(:entries)
            e = e + entries
            pattern%first(2*i - 2 + j + 1) = e + 1
         end do
      end do
      pattern%column = pattern%column(:e)
   end subroutine rod_pattern

   !> The order (lambda of joint i, coordinates of rod i) of the unknowns, rods numbered along the chain
   pure function body_order(rods) result(order)
      integer, intent(in) :: rods
      integer :: order(5*rods), i
      do i = 1, rods
         order(5*i - 4:5*i) = [3*rods + 2*i - 1, 3*rods + 2*i, 3*i - 2, 3*i - 1, 3*i]
      end do
   end function body_order

   !> A random permutation of 1 .. n
   function shuffled(n, seed) result(list)
      integer, intent(in) :: n
      integer(int64), intent(inout) :: seed
      integer :: list(n), i, j, held
      list = [(i, i=1, n)]
      do i = n, 2, -1
         j = 1 + modulo(int(0.5e6*(random(seed) + 1)), i)
         held = list(i)
         list(i) = list(j)
         list(j) = held
      end do
   end function shuffled

   pure subroutine sort(list)
      integer, intent(inout) :: list(:)
      integer :: i, j, held
      do i = 2, size(list)
         held = list(i)
         do j = i - 1, 1, -1
            if (list(j) <= held) exit
            list(j + 1) = list(j)
         end do
         list(j + 1) = held
      end do
   end subroutine sort
end module rod_chains
