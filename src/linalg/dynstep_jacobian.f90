! SPDX-License-Identifier: BSD-3-Clause
!> Jacobian of constraints: a rectangular matrix, stored row after row, with or without a pattern.
!>
!> PROGRAMMING INTERFACE
!>
!>   A user procedure fills one that is zero on entry, by
!>
!>     call gq%set_entry(i, j, x)          entry of row i (constraint) and column j (coordinate)
!>
!>   or, faster with a pattern, by its values in the order of the pattern:
!>
!>     gq%value(1:4) = [1.0_wp, L*sin(q(3)), 1.0_wp, -L*cos(q(3))]
!>
!>   Without a pattern all entries are stored: entry (i, j) is value((i - 1)*columns + j).
!>   With one, entry number e of row i, first(i) <= e < first(i + 1), is that of column(e).
module dynstep_jacobian
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   !> Places of the entries that may differ from zero; not allocated: all of them
   type, public :: pattern_type
      integer, allocatable :: first(:)    !! first entry of each row, and one past the last [rows + 1]
      integer, allocatable :: column(:)   !! column of each entry, increasing in a row [entries]
   contains
      procedure :: is_dense => pattern_is_dense
      procedure :: check => pattern_check
      procedure :: is_that_of => pattern_is_that_of
   end type pattern_type

   type, public :: jacobian_type
      integer :: rows = 0, columns = 0
      integer, allocatable :: first(:)    !! as in pattern_type, filled for a dense one too
      integer, allocatable :: column(:)
      real(wp), allocatable :: value(:)   !! entries, row after row
   contains
      procedure :: init => jacobian_init
      procedure :: set_zero => jacobian_set_zero
      procedure :: set_entry => jacobian_set_entry
      procedure :: entry => jacobian_entry
      procedure :: multiply => jacobian_multiply
      procedure :: transposed_add => jacobian_transposed_add
   end type jacobian_type

contains

   pure logical function pattern_is_dense(self)
      class(pattern_type), intent(in) :: self
      pattern_is_dense = .not. allocated(self%first)
   end function pattern_is_dense

   !> The pattern belongs to a matrix of rows x columns
   pure subroutine pattern_check(self, name, rows, columns, status)
      class(pattern_type), intent(in) :: self
      character(len=*), intent(in) :: name       !! for the sentence, such as 'constraint_jacobian'
      integer, intent(in) :: rows, columns
      type(status_type), intent(inout) :: status
      integer :: i, e
      if (status%failed() .or. self%is_dense()) return
      if (.not. allocated(self%column) .or. size(self%first) /= rows + 1) then
         call status%set(dynstep_invalid_input, 'the pattern of '//name//' needs first('//text(rows + 1) &
            & //') and column(:) for '//text(rows)//' rows')
         return
      end if
      if (self%first(1) /= 1 .or. self%first(rows + 1) /= size(self%column) + 1) then
         call status%set(dynstep_invalid_input, 'the pattern of '//name//' must have first(1) = 1 and first(' &
            & //text(rows + 1)//') = size(column) + 1 = '//text(size(self%column) + 1))
         return
      end if
      do i = 1, rows
         if (self%first(i + 1) < self%first(i) .or. self%first(i + 1) > size(self%column) + 1) then
            call status%set(dynstep_invalid_input, 'the pattern of '//name//' has first(' &
               & //text(i + 1)//') = '//text(self%first(i + 1))//', which does not follow first('//text(i)//')')
            return
         end if
         do e = self%first(i), self%first(i + 1) - 1
            if (self%column(e) < 1 .or. self%column(e) > columns) then
               call status%set(dynstep_invalid_input, 'the pattern of '//name//' has column '//text(self%column(e)) &
                  & //' in row '//text(i)//', outside 1 to '//text(columns))
               return
            end if
            if (e == self%first(i)) cycle
            if (self%column(e) <= self%column(e - 1)) then
               call status%set(dynstep_invalid_input, 'the columns of the pattern of '//name//' do not increase in row ' &
                  & //text(i))
               return
            end if
         end do
      end do
   end subroutine pattern_check

   !> True where `init` with this pattern made the Jacobian
   pure logical function pattern_is_that_of(self, jacobian, rows, columns) result(fits)
      class(pattern_type), intent(in) :: self
      type(jacobian_type), intent(in) :: jacobian
      integer, intent(in) :: rows, columns
      fits = .false.
      if (.not. allocated(jacobian%value) .or. jacobian%rows /= rows .or. jacobian%columns /= columns) return
      if (self%is_dense()) then
         fits = size(jacobian%value) == rows*columns
      else if (size(self%first) == size(jacobian%first) .and. size(self%column) == size(jacobian%column)) then
         fits = all(self%first == jacobian%first)
         if (fits) fits = all(self%column == jacobian%column)
      end if
   end function pattern_is_that_of

   !> Storage for a pattern that was checked; the entries are zero
   recursive subroutine jacobian_init(self, rows, columns, pattern, status)
      class(jacobian_type), intent(inout) :: self
      integer, intent(in) :: rows, columns
      type(pattern_type), intent(in) :: pattern
      type(status_type), intent(inout) :: status
      integer :: entries, stat, i, j
      if (status%failed()) return
      self%rows = rows
      self%columns = columns
      if (allocated(self%first)) deallocate (self%first)
      if (allocated(self%column)) deallocate (self%column)
      if (allocated(self%value)) deallocate (self%value)
      entries = rows*columns
      if (.not. pattern%is_dense()) entries = size(pattern%column)
      allocate (self%first(rows + 1), self%column(entries), self%value(entries), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for a Jacobian of '//text(entries)//' entries; declare its pattern')
         return
      end if
      self%value = 0.0_wp
      if (pattern%is_dense()) then
         self%first = [(1 + (i - 1)*columns, i=1, rows + 1)]
         do i = 1, rows
            do j = 1, columns
               self%column((i - 1)*columns + j) = j
            end do
         end do
      else
         self%first = pattern%first
         self%column = pattern%column
      end if
   end subroutine jacobian_init

   pure subroutine jacobian_set_zero(self)
      class(jacobian_type), intent(inout) :: self
      self%value = 0.0_wp
   end subroutine jacobian_set_zero

   !> Entry (i, j) = value; left alone where it is outside the pattern
   pure subroutine jacobian_set_entry(self, i, j, value)
      class(jacobian_type), intent(inout) :: self
      integer, intent(in) :: i, j
      real(wp), intent(in) :: value
      integer :: e
      e = place(self, i, j)
      if (e > 0) self%value(e) = value
   end subroutine jacobian_set_entry

   pure real(wp) function jacobian_entry(self, i, j)
      class(jacobian_type), intent(in) :: self
      integer, intent(in) :: i, j
      integer :: e
      e = place(self, i, j)
      jacobian_entry = 0.0_wp
      if (e > 0) jacobian_entry = self%value(e)
   end function jacobian_entry

   !> Number of the entry (i, j), 0 where there is none
   pure integer function place(self, i, j)
      class(jacobian_type), intent(in) :: self
      integer, intent(in) :: i, j
      place = 0
      if (min(i, j) < 1 .or. i > self%rows .or. j > self%columns) return
      if (self%first(i + 1) - self%first(i) == self%columns) then
         place = self%first(i) + j - 1
         return
      end if
      do place = self%first(i), self%first(i + 1) - 1
         if (self%column(place) == j) return
      end do
      place = 0
   end function place

   !> y = A x
   pure subroutine jacobian_multiply(self, x, y)
      class(jacobian_type), intent(in) :: self
      real(wp), intent(in) :: x(self%columns)
      real(wp), intent(out) :: y(self%rows)
      real(wp) :: s
      integer :: i, e
      do i = 1, self%rows
         s = 0.0_wp
         do e = self%first(i), self%first(i + 1) - 1
            s = s + self%value(e)*x(self%column(e))
         end do
         y(i) = s
      end do
   end subroutine jacobian_multiply

   !> y = y + alpha A^T x
   pure subroutine jacobian_transposed_add(self, alpha, x, y)
      class(jacobian_type), intent(in) :: self
      real(wp), intent(in) :: alpha
      real(wp), intent(in) :: x(self%rows)
      real(wp), intent(inout) :: y(self%columns)
      integer :: i, e
      do i = 1, self%rows
         do e = self%first(i), self%first(i + 1) - 1
            y(self%column(e)) = y(self%column(e)) + (alpha*x(i))*self%value(e)
         end do
      end do
   end subroutine jacobian_transposed_add
end module dynstep_jacobian
