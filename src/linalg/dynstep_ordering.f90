! SPDX-License-Identifier: BSD-3-Clause
!> Orders of unknowns that keep the entries of a sparse matrix near its diagonal.
!>
!> PROGRAMMING INTERFACE
!>
!>   call reverse_cuthill_mckee(nodes, first, neighbour, from_other_end, order)     of a graph
!>   call saddle_order(n, kl, ku, m, g, p, k, order)                of the equations of constrained motion
!>   call saddle_bandwidth(n, kl, ku, m, g, p, k, position, lower, upper)
!>
!>   A graph is the pattern of a symmetric matrix without its diagonal, row after row: the neighbours of
!>   node i are neighbour(first(i) : first(i + 1) - 1).  order(j) is the node that comes at place j.
!>
!> E. Cuthill, J. McKee, Reducing the bandwidth of sparse symmetric matrices, 1969; A. George,
!> J. W. H. Liu, An implementation of a pseudoperipheral node finder, ACM Trans. Math. Softw. 5, 1979.
module dynstep_ordering
   use dynstep_jacobian, only: pattern_type
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: reverse_cuthill_mckee, saddle_bandwidth, saddle_order

contains

   !> Order of the unknowns of [A -RL -RP; G 0 0; K 0 0]: 1 .. n coordinates, n + 1 .. n + m multipliers of g, then
   !> p of k.  The best of three: reverse Cuthill-McKee from both ends, and the coordinates as they are numbered with
   !> each constraint amid its own.  Measured kl = ku with 300 rods (x, y, angle; two constraints a joint), numbered
   !> in order and at random: chain 4 and 4 (the best there is), free chain 4 and 5, closed loop 9 and 8 or 9, two chains with
   !> rungs 10 and 9, binary tree 194 and 192; one end alone gives up to 2 more.
   recursive subroutine saddle_order(n, kl, ku, m, g, p, k, order)
      integer, intent(in) :: n, kl, ku, m, p       !! coordinates, bandwidths of A, numbers of constraints
      type(pattern_type), intent(in) :: g, k       !! not dense where there are rows
      integer, intent(out) :: order(n + m + p)
      integer :: position(n + m + p), other(n + m + p), lower, upper, other_lower, other_upper, way
      integer, allocatable :: first(:), neighbour(:)

      call numbered_order(n, m, g, p, k, order)
      call invert(order, position)
      call saddle_bandwidth(n, kl, ku, m, g, p, k, position, lower, upper)
      call saddle_graph(n, max(kl, ku), m, g, p, k, first, neighbour)
      do way = 1, 2
         call reverse_cuthill_mckee(n + m + p, first, neighbour, way == 2, other)
         call invert(other, position)
         call saddle_bandwidth(n, kl, ku, m, g, p, k, position, other_lower, other_upper)
         if (other_lower + other_upper >= lower + upper) cycle
         order = other
         lower = other_lower
         upper = other_upper
      end do
   end subroutine saddle_order

   !> Sub- and superdiagonals of the matrix of constrained motion in an order
   pure subroutine saddle_bandwidth(n, kl, ku, m, g, p, k, position, lower, upper)
      integer, intent(in) :: n, kl, ku, m, p
      type(pattern_type), intent(in) :: g, k
      integer, intent(in) :: position(n + m + p)   !! place of each unknown
      integer, intent(out) :: lower, upper
      integer :: i, j, d, across
      lower = 0
      upper = 0
      do j = 1, n
         do i = max(1, j - ku), min(n, j + kl)
            d = position(i) - position(j)
            lower = max(lower, d)
            upper = max(upper, -d)
         end do
      end do
      across = 0
      if (m > 0) across = reach(m, g, n)
      if (p > 0) across = max(across, reach(p, k, n + m))
      lower = max(lower, across)
      upper = max(upper, across)

   contains

      !> Largest distance of a constraint from one of its coordinates
      pure integer function reach(rows, pattern, offset)
         integer, intent(in) :: rows, offset
         type(pattern_type), intent(in) :: pattern
         integer :: row, e
         reach = 0
         do row = 1, rows
            do e = pattern%first(row), pattern%first(row + 1) - 1
               reach = max(reach, abs(position(offset + row) - position(pattern%column(e))))
            end do
         end do
      end function reach
   end subroutine saddle_bandwidth

   !> Coordinates as they are, each constraint before the one at the mean of its own
   pure subroutine numbered_order(n, m, g, p, k, order)
      integer, intent(in) :: n, m, p
      type(pattern_type), intent(in) :: g, k
      integer, intent(out) :: order(n + m + p)
      integer :: before(m + p), place(0:n + 1), i, j

      do i = 1, m
         before(i) = mean_column(g, i)
      end do
      do i = 1, p
         before(m + i) = mean_column(k, i)
      end do
      ! place(j): free places that come next before coordinate j; its own follows them
      place = 0
      do i = 1, m + p
         place(before(i)) = place(before(i)) + 1
      end do
      j = 1
      do i = 1, n
         j = j + place(i)
         order(j) = i
         place(i) = j - place(i)
         j = j + 1
      end do
      do i = 1, m + p
         order(place(before(i))) = n + i
         place(before(i)) = place(before(i)) + 1
      end do

   contains

      pure integer function mean_column(pattern, row)
         type(pattern_type), intent(in) :: pattern
         integer, intent(in) :: row
         integer :: entries
         entries = pattern%first(row + 1) - pattern%first(row)
         mean_column = 1
         if (entries == 0) return
         mean_column = ceiling(sum(real(pattern%column(pattern%first(row):pattern%first(row + 1) - 1), wp))/entries)
      end function mean_column
   end subroutine numbered_order

   !> Neighbours of each unknown
   recursive subroutine saddle_graph(n, band, m, g, p, k, first, neighbour)
      integer, intent(in) :: n, band, m, p
      type(pattern_type), intent(in) :: g, k
      integer, allocatable, intent(out) :: first(:), neighbour(:)
      integer :: next(n + m + p + 1), i, j, e

      next = 0
      do i = 1, n
         next(i) = min(n, i + band) - max(1, i - band)
      end do
      do i = 1, m
         next(n + i) = g%first(i + 1) - g%first(i)
         do e = g%first(i), g%first(i + 1) - 1
            next(g%column(e)) = next(g%column(e)) + 1
         end do
      end do
      do i = 1, p
         next(n + m + i) = k%first(i + 1) - k%first(i)
         do e = k%first(i), k%first(i + 1) - 1
            next(k%column(e)) = next(k%column(e)) + 1
         end do
      end do
      allocate (first(n + m + p + 1))
      first(1) = 1
      do i = 1, n + m + p
         first(i + 1) = first(i) + next(i)
      end do
      allocate (neighbour(first(n + m + p + 1) - 1))
      next = first
      do i = 1, n
         do j = max(1, i - band), min(n, i + band)
            if (j /= i) call add(i, j)
         end do
      end do
      do i = 1, m
         do e = g%first(i), g%first(i + 1) - 1
            call add(n + i, g%column(e))
            call add(g%column(e), n + i)
         end do
      end do
      do i = 1, p
         do e = k%first(i), k%first(i + 1) - 1
            call add(n + m + i, k%column(e))
            call add(k%column(e), n + m + i)
         end do
      end do

   contains

      recursive subroutine add(from, to)
         integer, intent(in) :: from, to
         neighbour(next(from)) = to
         next(from) = next(from) + 1
      end subroutine add
   end subroutine saddle_graph

   !> Reverse Cuthill-McKee order: breadth first from a node at the rim of its component, neighbours by rising
   !> degree, backwards.  Work proportional to the entries, but for the sorting of neighbours.
   recursive subroutine reverse_cuthill_mckee(nodes, first, neighbour, from_other_end, order)
      integer, intent(in) :: nodes
      integer, intent(in) :: first(nodes + 1)
      integer, intent(in) :: neighbour(*)          !! [first(nodes + 1) - 1]
      logical, intent(in) :: from_other_end        !! start at the far end of each component
      integer, intent(out) :: order(nodes)
      logical :: numbered(nodes)
      integer :: level(nodes), queue(nodes), node, j, e, last, begin

      numbered = .false.
      level = 0
      last = 0
      do node = 1, nodes
         if (numbered(node)) cycle
         last = last + 1
         order(last) = rim_node(node)
         numbered(order(last)) = .true.
         j = last
         do while (j <= last)
            begin = last + 1
            do e = first(order(j)), first(order(j) + 1) - 1
               if (numbered(neighbour(e))) cycle
               last = last + 1
               order(last) = neighbour(e)
               numbered(neighbour(e)) = .true.
            end do
            call sort_by_degree(order(begin:last))
            j = j + 1
         end do
      end do
      order = order(nodes:1:-1)

   contains

      !> George and Liu's pseudo-peripheral node of the component of a node
      recursive integer function rim_node(start)
         integer, intent(in) :: start
         integer :: depth, deeper, candidate
         rim_node = start
         call levels_from(rim_node, depth, candidate)
         do
            call levels_from(candidate, deeper, e)
            if (deeper <= depth) then
               if (from_other_end) rim_node = candidate
               return
            end if
            rim_node = candidate
            depth = deeper
            candidate = e
         end do
      end function rim_node

      !> Levels of a breadth-first search, and a node of least degree in the last one
      recursive subroutine levels_from(root, depth, farthest)
         integer, intent(in) :: root
         integer, intent(out) :: depth, farthest
         integer :: head, tail, i
         head = 1
         tail = 1
         queue(1) = root
         level(root) = 1
         do while (head <= tail)
            do i = first(queue(head)), first(queue(head) + 1) - 1
               if (level(neighbour(i)) > 0) cycle
               tail = tail + 1
               queue(tail) = neighbour(i)
               level(neighbour(i)) = level(queue(head)) + 1
            end do
            head = head + 1
         end do
         depth = level(queue(tail))
         farthest = queue(tail)
         do i = tail, 1, -1
            if (level(queue(i)) < depth) exit
            if (degree(queue(i)) < degree(farthest)) farthest = queue(i)
         end do
         level(queue(:tail)) = 0
      end subroutine levels_from

      pure integer function degree(i)
         integer, intent(in) :: i
         degree = first(i + 1) - first(i)
      end function degree

      !> Heap sort by degree, then number: the same result whatever the order of the entries
      pure subroutine sort_by_degree(list)
         integer, intent(inout) :: list(:)
         integer :: i, n, held
         n = size(list)
         do i = n/2, 1, -1
            call sift(list, i, n)
         end do
         do i = n, 2, -1
            held = list(i)
            list(i) = list(1)
            list(1) = held
            call sift(list, 1, i - 1)
         end do
      end subroutine sort_by_degree

      pure subroutine sift(list, from, n)
         integer, intent(inout) :: list(:)
         integer, intent(in) :: from, n
         integer :: i, child, held
         held = list(from)
         i = from
         do while (2*i <= n)
            child = 2*i
            if (child < n) then
               if (comes_before(list(child), list(child + 1))) child = child + 1
            end if
            if (.not. comes_before(held, list(child))) exit
            list(i) = list(child)
            i = child
         end do
         list(i) = held
      end subroutine sift

      pure logical function comes_before(a, b)
         integer, intent(in) :: a, b
         comes_before = degree(a) < degree(b) .or. (degree(a) == degree(b) .and. a < b)
      end function comes_before
   end subroutine reverse_cuthill_mckee

   !> position(order(j)) = j
   pure subroutine invert(order, position)
      integer, intent(in) :: order(:)
      integer, intent(out) :: position(:)
      integer :: j
      do j = 1, size(order)
         position(order(j)) = j
      end do
   end subroutine invert
end module dynstep_ordering
