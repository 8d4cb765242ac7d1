! SPDX-License-Identifier: BSD-3-Clause
!> Orders of the unknowns of constrained motion: permutations, and how narrow the band becomes.
module test_ordering
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_jacobian, only: pattern_type
   use dynstep_ordering, only: reverse_cuthill_mckee, saddle_bandwidth, saddle_order
   use random_matrices, only: random
   use rod_chains, only: rod_pattern, shuffled
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_ordering

contains

   subroutine collect_ordering(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('path, ring, star, grid, nothing', test_graphs), &
         & new_unittest('chains of rods', test_chains)]
   end subroutine collect_ordering

   !> Graph of a list of edges
   subroutine graph_of(nodes, edges, first, neighbour)
      integer, intent(in) :: nodes
      integer, intent(in) :: edges(:, :)              ! [2, edges]
      integer, allocatable, intent(out) :: first(:), neighbour(:)
      integer :: i, j
      allocate (first(nodes + 1), neighbour(2*size(edges, 2)))
      first(1) = 1
      do i = 1, nodes
         first(i + 1) = first(i)
         do j = 1, size(edges, 2)
            if (all(edges(:, j) /= i)) cycle
            neighbour(first(i + 1)) = sum(edges(:, j)) - i
            first(i + 1) = first(i + 1) + 1
         end do
      end do
   end subroutine graph_of

   !> Largest distance of neighbours in the order; -1 where it is not a permutation
   integer function bandwidth(nodes, edges, from_other_end)
      integer, intent(in) :: nodes
      integer, intent(in) :: edges(:, :)
      logical, intent(in) :: from_other_end
      integer, allocatable :: first(:), neighbour(:)
      integer :: order(nodes), position(nodes), j
      call graph_of(nodes, edges, first, neighbour)
      call reverse_cuthill_mckee(nodes, first, neighbour, from_other_end, order)
      bandwidth = -1
      position = 0
      do j = 1, nodes
         if (order(j) < 1 .or. order(j) > nodes) return
         position(order(j)) = j
      end do
      if (any(position == 0)) return
      bandwidth = 0
      do j = 1, size(edges, 2)
         bandwidth = max(bandwidth, abs(position(edges(1, j)) - position(edges(2, j))))
      end do
   end function bandwidth

   !> Graphs numbered at random.  Path and ring: the least bandwidth, 1 and 2.  Star of s rays: the centre comes second,
   !> s - 1.  Grid of 5 x 12: 5 is the least; levels are diagonals, and where they begin to shrink, one more.  Two paths.
   subroutine test_graphs(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: nodes = 60
      integer(int64) :: seed
      integer :: number(nodes), band, i, j, way
      integer, allocatable :: edges(:, :)
      logical :: end
      seed = 1
      do way = 0, 1
         end = way == 1
         number = shuffled(nodes, seed)
         edges = reshape([(number(i), number(i + 1), i=1, nodes - 1)], [2, nodes - 1])
         call check(error, bandwidth(nodes, edges, end), 1, 'path')
         edges = reshape([(number(i), number(modulo(i, nodes) + 1), i=1, nodes)], [2, nodes])
         call check(error, bandwidth(nodes, edges, end), 2, 'ring')
         edges = reshape([(number(1), number(i), i=2, 10)], [2, 9])
         call check(error, bandwidth(nodes, edges, end), 8, 'star of nine rays')
         ! 5 x 12
         edges = reshape([((number(5*i + j), number(5*i + j + 5), i=0, 10), j=1, 5)], [2, 55])
         edges = reshape([reshape(edges, [110]), ((number(5*i + j), number(5*i + j + 1), i=0, 11), j=1, 4)], [2, 103])
         band = bandwidth(nodes, edges, end)
         call check(error, band == 5 .or. band == 6, 'grid')
         edges = reshape([(number(i), number(i + 1), i=1, 29), (number(i), number(i + 1), i=31, 59)], [2, 58])
         call check(error, bandwidth(nodes, edges, end), 1, 'two paths')
         edges = reshape([integer ::], [2, 0])
         call check(error, bandwidth(nodes, edges, end), 0, 'no edges')
      end do
   end subroutine test_graphs

   !> A chain of rods can have kl = ku = 4, a closed one 8 (it folds into two); numbered along the chain or at random
   subroutine test_chains(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: lengths(4) = [2, 10, 101, 1000]
      type(pattern_type) :: g, none
      integer(int64) :: seed
      integer :: i, way, closed, kl, ku
      integer, allocatable :: coordinate(:), order(:), position(:)
      integer :: n, m, j
      seed = 2
      do i = 1, size(lengths)
         do way = 0, 1
            do closed = 0, 1
               n = 3*lengths(i)
               m = 2*lengths(i)
               coordinate = [(j, j=1, n)]
               if (way == 1) coordinate = shuffled(n, seed)
               call rod_pattern(lengths(i), closed == 1, coordinate, g)
               if (allocated(order)) deallocate (order, position)
               allocate (order(n + m), position(n + m))
               call saddle_order(n, 0, 0, m, g, 0, none, order)
               position = 0
               do j = 1, n + m
                  position(order(j)) = j
               end do
               call check(error, all(position > 0), 'a permutation')
               call saddle_bandwidth(n, 0, 0, m, g, 0, none, position, kl, ku)
               call check(error, kl, ku, 'symmetric')
               ! one more than the least
               call check(error, kl <= merge(9, 5, closed == 1), 'narrow')
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine test_chains
end module test_ordering
