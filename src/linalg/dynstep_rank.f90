! SPDX-License-Identifier: BSD-3-Clause
!> Which constraints depend on the others: rows of [G; K] that are combinations of other rows.
!>
!>   P [G; K]^T = Q R with column pivoting, rows of G and K scaled to norm 1.  The first rows whose diagonal entry
!>   is above the tolerance are independent; R11 C = R12 gives the others as combinations of them.
!>
!> PROGRAMMING INTERFACE
!>
!>   call find_dependent_rows(g, k, tolerance, found, status)
!>   found%rank, found%rows, found%first, found%partner, found%coefficient
!>   found%sentence(i)           such as 'constraint 3 of g depends on constraints 1 and 2 of g'
!>
!> For a start, a report or the explanation of a failure: it allocates, and its matrix is dense.
!>
!> G. H. Golub, C. F. Van Loan, Matrix Computations, section 5.4 (QR with column pivoting).
module dynstep_rank
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_lapack, only: dgeqp3
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, dynstep_not_finite, message_length, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: constraint_name, find_dependent_rows

   !> Part of the length of a row that is too little to be independent.  Jacobians by differences have errors near 1e-12.
   !> Measured on 2000 combinations of one to ten rows of lengths 1e-3 to 1e3 with such errors: all are found with
   !> 1e-11, two in three with 1e-12, none with 1e-13.  Constraints closer than 1e-10 are called dependent wrongly.
   real(wp), parameter, public :: default_rank_tolerance = 1.0e-10_wp

   !> Entries of the dense matrix that are still looked at: 32 MB, and about a second of work for 2000 by 2000
   integer, parameter, public :: largest_rank_problem = 4000000

   !> Rows that depend on others.  Of the rows of a relation the last one is called the dependent one (of those with at
   !> least a tenth of the largest coefficient).
   type, public :: dependence_type
      integer :: m = 0, p = 0                      !! rows of G and of K
      integer :: rank = 0                          !! independent rows
      integer, allocatable :: rows(:)              !! dependent rows, rising, 1 .. m of G, m + 1 .. m + p of K [m + p - rank]
      integer, allocatable :: first(:)             !! first partner of each, and one past the last [m + p - rank + 1]
      integer, allocatable :: partner(:)           !! independent rows, rising for each dependent one
      real(wp), allocatable :: coefficient(:)      !! dependent row = sum of coefficient times partner
   contains
      procedure :: sentence => dependence_sentence
   end type dependence_type

contains

   !> Rank of [G; K], rows that depend on others, and on which
   recursive subroutine find_dependent_rows(g, k, tolerance, found, status)
      type(jacobian_type), intent(in) :: g               !! G [m, n], empty (as declared) where there is none
      type(jacobian_type), intent(in) :: k               !! K [p, n], empty where there is none
      real(wp), intent(in) :: tolerance                  !! least independent part of a row of norm 1
      type(dependence_type), intent(out) :: found
      type(status_type), intent(inout) :: status         !! refused: too large, not finite
      real(wp), allocatable :: a(:, :), tau(:), work(:), norms(:), relation(:, :)
      integer, allocatable :: pivot(:), dependent(:)
      real(wp) :: query(1)
      integer :: n, rows, steps, i, j, stat, info

      if (status%failed()) return
      found%m = g%rows
      found%p = k%rows
      rows = g%rows + k%rows
      n = max(g%columns, k%columns)
      if (min(g%rows, k%rows) > 0 .and. g%columns /= k%columns) then
         call status%set(dynstep_invalid_input, 'the Jacobian of g has '//text(g%columns)//' columns, that of k ' &
            & //text(k%columns))
         return
      end if
      if (rows > 0) then
         if (n > largest_rank_problem/rows) then
            call status%set(dynstep_no_memory, 'which of '//text(rows)//' constraints on '//text(n) &
               & //' coordinates depend on others is not looked for: the dense matrix would be too large')
            return
         end if
      end if
      stat = 0
      if (rows > 0) allocate (a(n, rows), tau(rows), norms(rows), pivot(rows), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for the rank of '//text(rows)//' constraints')
         return
      end if
      if (rows == 0) then
         allocate (found%rows(0), found%first(1), found%partner(0), found%coefficient(0))
         found%first = 1
         return
      end if

      a = 0.0_wp
      call copy_rows(g, 0)
      call copy_rows(k, g%rows)
      do i = 1, rows
         if (.not. all(ieee_is_finite(a(:, i)))) then
            call status%set(dynstep_not_finite, 'the Jacobian of '//trim(constraint_name(g%rows, i))//' is not finite')
            return
         end if
         norms(i) = norm2(a(:, i))
         if (norms(i) > 0.0_wp) a(:, i) = a(:, i)/norms(i)
      end do

      pivot = 0
      call dgeqp3(n, rows, a, n, pivot, tau, query, -1, info)
      allocate (work(int(query(1))))
      call dgeqp3(n, rows, a, n, pivot, tau, work, size(work), info)
      steps = min(n, rows)
      found%rank = 0
      do i = 1, steps
         if (abs(a(i, i)) <= tolerance*max(1.0_wp, abs(a(1, 1)))) exit
         found%rank = i
      end do

      ! relations between the rows of norm 1, one a column
      allocate (relation(rows, rows - found%rank), dependent(rows - found%rank))
      relation = 0.0_wp
      do j = 1, rows - found%rank
         call back_substitution(found%rank, n, a, a(:, found%rank + j))
         relation(pivot(:found%rank), j) = a(:found%rank, found%rank + j)
         relation(pivot(found%rank + j), j) = -1.0_wp
      end do
      call prefer_late_rows(relation, dependent)
      call collect(found, relation, dependent, norms, sqrt(tolerance))

   contains

      recursive subroutine copy_rows(jacobian, offset)
         type(jacobian_type), intent(in) :: jacobian
         integer, intent(in) :: offset
         integer :: row, e
         do row = 1, jacobian%rows
            do e = jacobian%first(row), jacobian%first(row + 1) - 1
               a(jacobian%column(e), offset + row) = jacobian%value(e)
            end do
         end do
      end subroutine copy_rows
   end subroutine find_dependent_rows

   !> x = R11^-1 x, R11 the first rows and columns of a
   pure subroutine back_substitution(rank, n, a, x)
      integer, intent(in) :: rank, n
      real(wp), intent(in) :: a(n, rank)
      real(wp), intent(inout) :: x(n)
      integer :: i
      do i = rank, 1, -1
         x(i) = x(i)/a(i, i)
         x(:i - 1) = x(:i - 1) - x(i)*a(:i - 1, i)
      end do
   end subroutine back_substitution

   !> Gauss and Jordan's elimination in the relations, so that each has a row of its own that is a late one; entries
   !> grow ten times at most in each step
   pure subroutine prefer_late_rows(relation, dependent)
      real(wp), intent(inout) :: relation(:, :)      !! [rows, relations]
      integer, intent(out) :: dependent(:)           !! row of each relation, where it has -1 and the others have 0
      real(wp) :: largest
      integer :: i, j, l
      do j = 1, size(relation, 2)
         largest = maxval(abs(relation(:, j)))
         do i = size(relation, 1), 1, -1
            if (abs(relation(i, j)) >= largest/10) exit
         end do
         dependent(j) = i
         relation(:, j) = relation(:, j)/(-relation(i, j))
         do l = 1, size(relation, 2)
            if (l == j) cycle
            relation(:, l) = relation(:, l) + relation(i, l)*relation(:, j)
            relation(i, l) = 0.0_wp
         end do
      end do
   end subroutine prefer_late_rows

   !> Relations by rising dependent row, coefficients for the rows as they are
   pure subroutine collect(found, relation, dependent, norms, least)
      type(dependence_type), intent(inout) :: found
      real(wp), intent(in) :: relation(:, :)
      integer, intent(in) :: dependent(:)
      real(wp), intent(in) :: norms(:)
      real(wp), intent(in) :: least                  !! smaller coefficients are rounding errors
      logical :: is_partner(size(norms), size(dependent))
      integer :: owner(size(norms)), i, j, l, e, relations

      relations = size(dependent)
      owner = 0
      is_partner = abs(relation) > least
      do j = 1, relations
         owner(dependent(j)) = j
         is_partner(dependent(j), j) = .false.
      end do
      allocate (found%rows(relations), found%first(relations + 1), found%partner(count(is_partner)), &
         & found%coefficient(count(is_partner)))
      e = 0
      l = 0
      do i = 1, size(norms)
         j = owner(i)
         if (j == 0) cycle
         l = l + 1
         found%rows(l) = i
         found%first(l) = e + 1
         call list_partners(is_partner(:, j), e, found%partner)
         found%coefficient(found%first(l):e) = relation(found%partner(found%first(l):e), j)*norms(i) &
            & /norms(found%partner(found%first(l):e))
      end do
      found%first(relations + 1) = e + 1
   end subroutine collect

   !> Append the numbers of the rows that are partners
   pure subroutine list_partners(is_partner, last, list)
      logical, intent(in) :: is_partner(:)
      integer, intent(inout) :: last                 !! of the list
      integer, intent(inout) :: list(:)
      integer :: i
      do i = 1, size(is_partner)
         if (.not. is_partner(i)) cycle
         last = last + 1
         list(last) = i
      end do
   end subroutine list_partners

   !> 'constraint 3 of g depends on constraints 1 and 2 of g': the words for rows(i)
   pure function dependence_sentence(self, i) result(words)
      class(dependence_type), intent(in) :: self
      integer, intent(in) :: i                       !! 1 .. size(rows)
      character(len=message_length) :: words
      integer :: in_g, in_k

      words = constraint_name(self%m, self%rows(i))
      associate (partner => self%partner(self%first(i):self%first(i + 1) - 1))
         in_g = count(partner <= self%m)
         in_k = size(partner) - in_g
         if (size(partner) == 0) then
            words = trim(words)//' has a Jacobian of zeros'
            return
         end if
         words = trim(words)//' depends on'
         if (in_g > 0) words = trim(words)//' '//trim(list_of(partner(:in_g), 0, 'g'))
         if (min(in_g, in_k) > 0) words = trim(words)//' and on'
         if (in_k > 0) words = trim(words)//' '//trim(list_of(partner(in_g + 1:), self%m, 'k'))
      end associate
   end function dependence_sentence

   !> 'constraints 1, 2 and 5 of g'; the first seven of a longer list, and how many more
   pure function list_of(rows, offset, block) result(words)
      integer, intent(in) :: rows(:)
      integer, intent(in) :: offset                  !! rows before the block
      character(len=1), intent(in) :: block          !! g or k
      integer, parameter :: most = 7
      character(len=message_length) :: words
      integer :: j, shown

      shown = size(rows)
      if (shown > most + 1) shown = most
      words = 'constraint'
      if (size(rows) > 1) words = 'constraints'
      do j = 1, shown
         if (j > 1 .and. j == size(rows)) then
            words = trim(words)//' and'
         else if (j > 1) then
            words = trim(words)//','
         end if
         words = trim(words)//' '//text(rows(j) - offset)
      end do
      if (shown < size(rows)) words = trim(words)//' and '//text(size(rows) - shown)//' more'
      words = trim(words)//' of '//block
   end function list_of

   !> 'constraint 2 of k': row of [G; K] where G has m rows
   pure function constraint_name(m, row) result(words)
      integer, intent(in) :: m
      integer, intent(in) :: row                     !! 1 .. m + p
      character(len=40) :: words
      if (row <= m) then
         words = 'constraint '//text(row)//' of g'
      else
         words = 'constraint '//text(row - m)//' of k'
      end if
   end function constraint_name
end module dynstep_rank
