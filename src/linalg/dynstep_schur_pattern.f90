! SPDX-License-Identifier: BSD-3-Clause
!> Where the entries of S = B D B^T come from, D diagonal, B = [G; K] with the patterns of G and K.
!>
!> PROGRAMMING INTERFACE
!>
!>   call pattern%init(n, m, p, g, k, order, stat)
!>
!>   Rows of B are put in an order that keeps S near its diagonal: the user's order of the unknowns, without the
!>   coordinates, or the best of the rows as they are and reverse Cuthill-McKee from both ends, on the graph whose
!>   neighbours are rows with a coordinate in common.  S is stored as a band (its lower triangle, as dpbtrf
!>   wants it) or dense, and each entry of S has a list of the pairs of entries of B whose products make it up.
!>
!>   Rows that share a coordinate are at most 2 kl apart in an order in which the whole matrix [D^-1 B^T; B 0] has kl
!>   subdiagonals, so that factors of S never cost more than those of the whole.
module dynstep_schur_pattern
   use dynstep_band_ldl, only: widest_band
   use dynstep_jacobian, only: pattern_type
   use dynstep_kinds, only: long, wp
   use dynstep_ordering, only: reverse_cuthill_mckee
   implicit none
   private

   type, public :: schur_pattern_type
      integer :: rows = 0                      !! m + p
      integer :: width = 0                     !! subdiagonals of S in the order chosen
      logical :: is_banded = .false.           !! S is stored as a band, or dense
      logical :: has_pairs = .false.           !! the lists are there; without them, B is dense
      integer :: height = 0                    !! rows of the storage of S: width + 1 or rows
      integer, allocatable :: position(:)      !! place of each constraint [rows]
      integer, allocatable :: first(:)         !! first entry of each row in order, and one past the last [rows + 1]
      integer, allocatable :: column(:)        !! of each entry, in the order of S [entries]
      integer, allocatable :: place(:)         !! of each entry of G, then K, among those [entries]
      integer, allocatable :: column_first(:)  !! the same entries by columns: first of each, and one past the last [n + 1]
      integer, allocatable :: row(:)           !! row of each, in the order of S [entries]
      integer, allocatable :: entry(:)         !! and which of the entries it is [entries]
      integer, allocatable :: target(:)        !! places in the storage of S that are not zero [targets]
      integer, allocatable :: first_pair(:)    !! first pair of each, and one past the last [targets + 1]
      integer, allocatable :: left(:), right(:)   !! entries of B in the pairs [pairs]
   contains
      procedure :: init => pattern_init
   end type schur_pattern_type

   !> More pairs than this for an entry of B: B is as good as dense, and a product of matrices is faster than lists
   integer, parameter :: most_pairs = 16

contains

   !> Order, storage, lists
   recursive subroutine pattern_init(self, n, m, p, g, k, order, stat)
      class(schur_pattern_type), intent(inout) :: self
      integer, intent(in) :: n, m, p
      type(pattern_type), intent(in) :: g, k       !! that passed their checks
      integer, allocatable, intent(in) :: order(:) !! of all unknowns, see dynstep_saddle_point; or not allocated
      integer, intent(out) :: stat                 !! not 0: no memory
      integer, allocatable :: first(:), column(:), row_first(:), row(:)
      integer(long) :: pairs
      integer :: j, entries

      self%rows = m + p
      entries = count_entries(m, n, g) + count_entries(p, n, k)
      allocate (first(m + p + 1), column(entries), row_first(n + 1), row(entries), stat=stat)
      if (stat /= 0) return
      first(1) = 1
      call append(m, n, g, first(:m + 1), column)
      call append(p, n, k, first(m + 1:), column)
      call transpose_pattern(m + p, n, first, column, row_first, row)
      pairs = 0
      do j = 1, n
         pairs = pairs + (int(row_first(j + 1) - row_first(j), long)*(row_first(j + 1) - row_first(j) + 1))/2
      end do
      self%has_pairs = pairs <= most_pairs*int(entries, long) .or. m + p <= widest_band + 1
      call choose_order(self, n, first, column, row_first, row, order)
      self%is_banded = self%width <= widest_band .or. (self%has_pairs .and. 2*self%width <= m + p)
      self%height = merge(self%width + 1, m + p, self%is_banded)
      call put_in_order(self, n, first, column, stat)
      if (stat == 0 .and. self%has_pairs) call list_pairs(self, n, int(pairs), stat)
   end subroutine pattern_init

   pure integer function count_entries(rows, n, pattern)
      integer, intent(in) :: rows, n
      type(pattern_type), intent(in) :: pattern
      count_entries = rows*n
      if (rows > 0 .and. .not. pattern%is_dense()) count_entries = size(pattern%column)
   end function count_entries

   !> Rows of a pattern behind what is there; first(1) is set
   pure subroutine append(rows, n, pattern, first, column)
      integer, intent(in) :: rows, n
      type(pattern_type), intent(in) :: pattern
      integer, intent(inout) :: first(rows + 1), column(:)
      integer :: i, j
      do i = 1, rows
         if (pattern%is_dense()) then
            first(i + 1) = first(i) + n
            column(first(i):first(i + 1) - 1) = [(j, j=1, n)]
         else
            first(i + 1) = first(i) + pattern%first(i + 1) - pattern%first(i)
            column(first(i):first(i + 1) - 1) = pattern%column(pattern%first(i):pattern%first(i + 1) - 1)
         end if
      end do
   end subroutine append

   !> Rows of each column, rising
   pure subroutine transpose_pattern(rows, n, first, column, row_first, row)
      integer, intent(in) :: rows, n
      integer, intent(in) :: first(rows + 1), column(:)
      integer, intent(out) :: row_first(n + 1), row(:)
      integer :: next(n), i, e
      row_first = 0
      do e = 1, size(column)
         row_first(column(e) + 1) = row_first(column(e) + 1) + 1
      end do
      row_first(1) = 1
      do i = 1, n
         row_first(i + 1) = row_first(i) + row_first(i + 1)
      end do
      next = row_first(:n)
      do i = 1, rows
         do e = first(i), first(i + 1) - 1
            row(next(column(e))) = i
            next(column(e)) = next(column(e)) + 1
         end do
      end do
   end subroutine transpose_pattern

   recursive subroutine choose_order(self, n, first, column, row_first, row, order)
      class(schur_pattern_type), intent(inout) :: self
      integer, intent(in) :: n
      integer, intent(in) :: first(self%rows + 1), column(:), row_first(n + 1), row(:)
      integer, allocatable, intent(in) :: order(:)
      integer :: candidate(self%rows), position(self%rows), j, way, width
      integer, allocatable :: graph_first(:), neighbour(:)

      self%position = [(j, j=1, self%rows)]
      self%width = max(0, self%rows - 1)
      if (.not. self%has_pairs) return
      if (allocated(order)) then
         candidate = pack(order, order > n) - n
         self%position(candidate) = [(j, j=1, self%rows)]
      end if
      self%width = width_of(n, self%rows, row_first, row, self%position)
      if (allocated(order)) return
      call row_graph(self%rows, n, first, column, row_first, row, graph_first, neighbour)
      do way = 1, 2
         call reverse_cuthill_mckee(self%rows, graph_first, neighbour, way == 2, candidate)
         position(candidate) = [(j, j=1, self%rows)]
         width = width_of(n, self%rows, row_first, row, position)
         if (width >= self%width) cycle
         self%width = width
         self%position = position
      end do
   end subroutine choose_order

   !> Largest distance of two rows with a column in common
   pure integer function width_of(n, rows, row_first, row, position) result(width)
      integer, intent(in) :: n, rows
      integer, intent(in) :: row_first(n + 1), row(:), position(rows)
      integer :: j
      width = 0
      do j = 1, n
         if (row_first(j + 1) == row_first(j)) cycle
         associate (places => position(row(row_first(j):row_first(j + 1) - 1)))
            width = max(width, maxval(places) - minval(places))
         end associate
      end do
   end function width_of

   !> Graph of the rows for dynstep_ordering, each neighbour once
   pure subroutine row_graph(rows, n, first, column, row_first, row, graph_first, neighbour)
      integer, intent(in) :: rows, n
      integer, intent(in) :: first(rows + 1), column(:), row_first(n + 1), row(:)
      integer, allocatable, intent(out) :: graph_first(:), neighbour(:)
      integer :: seen_by(rows), sweep, i, e, c, entries

      allocate (graph_first(rows + 1), neighbour(0))
      do sweep = 1, 2      ! count, then write
         seen_by = 0
         entries = 0
         do i = 1, rows
            graph_first(i) = entries + 1
            seen_by(i) = i
            do e = first(i), first(i + 1) - 1
               do c = row_first(column(e)), row_first(column(e) + 1) - 1
                  if (seen_by(row(c)) == i) cycle
                  seen_by(row(c)) = i
                  entries = entries + 1
                  if (sweep == 2) neighbour(entries) = row(c)
               end do
            end do
         end do
         graph_first(rows + 1) = entries + 1
         if (sweep == 1) then
            deallocate (neighbour)
            allocate (neighbour(entries))
         end if
      end do
   end subroutine row_graph

   !> Rows of B in the order chosen
   pure subroutine put_in_order(self, n, first, column, stat)
      class(schur_pattern_type), intent(inout) :: self
      integer, intent(in) :: n
      integer, intent(in) :: first(self%rows + 1), column(:)
      integer, intent(out) :: stat
      integer :: next(n), i, e, to
      if (allocated(self%first)) deallocate (self%first, self%column, self%place, self%column_first, self%row, self%entry)
      allocate (self%first(self%rows + 1), self%column(size(column)), self%place(size(column)), self%column_first(n + 1), &
         & self%row(size(column)), self%entry(size(column)), stat=stat)
      if (stat /= 0) return
      self%first(1) = 1
      do i = 1, self%rows
         self%first(self%position(i) + 1) = first(i + 1) - first(i)
      end do
      do i = 1, self%rows
         self%first(i + 1) = self%first(i) + self%first(i + 1)
      end do
      do i = 1, self%rows
         to = self%first(self%position(i))
         do e = first(i), first(i + 1) - 1
            self%column(to) = column(e)
            self%place(e) = to
            to = to + 1
         end do
      end do
      call transpose_pattern(self%rows, n, self%first, self%column, self%column_first, self%row)
      next = self%column_first(:n)
      do e = 1, size(column)
         self%entry(next(self%column(e))) = e
         next(self%column(e)) = next(self%column(e)) + 1
      end do
   end subroutine put_in_order

   !> Pairs of entries of a column, sorted by their place in S
   pure subroutine list_pairs(self, n, pairs, stat)
      class(schur_pattern_type), intent(inout) :: self
      integer, intent(in) :: n, pairs
      integer, intent(out) :: stat
      integer, allocatable :: next(:)
      integer :: i, j, c, d, place, sweep, total

      if (allocated(self%target)) deallocate (self%target, self%first_pair, self%left, self%right)
      allocate (self%left(pairs), self%right(pairs), next(self%height*self%rows), stat=stat)
      if (stat /= 0) return
      next = 0
      do sweep = 1, 2      ! count, then write
         do j = 1, n
            do c = self%column_first(j), self%column_first(j + 1) - 1
               do d = c, self%column_first(j + 1) - 1
                  place = (self%row(c) - 1)*self%height + self%row(d)
                  if (self%is_banded) place = place + 1 - self%row(c)
                  if (sweep == 1) then
                     next(place) = next(place) + 1
                  else
                     self%left(next(place)) = self%entry(c)
                     self%right(next(place)) = self%entry(d)
                     next(place) = next(place) + 1
                  end if
               end do
            end do
         end do
         if (sweep == 2) exit
         allocate (self%target(count(next > 0)), self%first_pair(count(next > 0) + 1), stat=stat)
         if (stat /= 0) return
         total = 1
         i = 0
         do place = 1, size(next)
            if (next(place) == 0) cycle
            i = i + 1
            self%target(i) = place
            self%first_pair(i) = total
            total = total + next(place)
            next(place) = self%first_pair(i)
         end do
         self%first_pair(i + 1) = total
      end do
   end subroutine list_pairs
end module dynstep_schur_pattern
