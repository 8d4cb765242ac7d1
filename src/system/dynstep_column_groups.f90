! SPDX-License-Identifier: BSD-3-Clause
!> Columns of a sparse Jacobian that one difference serves together: no two of a group have an entry
!> in the same row (A. R. Curtis, M. J. D. Powell, J. K. Reid, J. Inst. Maths Applics 13 (1974)
!> 117-119).  They are coloured one after the other with the first colour that is free, which a
!> constraint between neighbours makes about as many as a row has entries.
module dynstep_column_groups
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: coordinate_sizes

   !> Coordinates that are all smaller than this are at rest in their origin, not small machines: the
   !> longer step is the safe one
   real(wp), parameter :: nothing = 1.0e-4_wp

   type, public :: column_groups
      integer :: number = 0                               !! groups, of one column each where all entries are stored
      integer, allocatable :: of_column(:)                !! group of each column, 0: no entry [n]
      integer, allocatable, private :: first(:), column(:)  ! pattern that they were made for
   contains
      procedure :: fit => groups_fit
   end type column_groups

contains

   !> Make the groups of a Jacobian's pattern, where they are not there
   pure subroutine groups_fit(self, jacobian)
      class(column_groups), intent(inout) :: self
      type(jacobian_type), intent(in) :: jacobian
      integer :: j
      if (has_pattern(self, jacobian)) return
      if (allocated(self%of_column)) deallocate (self%of_column)
      allocate (self%of_column(jacobian%columns))
      self%first = jacobian%first
      self%column = jacobian%column
      if (size(jacobian%column) == jacobian%rows*jacobian%columns) then
         self%of_column = [(j, j=1, jacobian%columns)]
      else
         call colour(jacobian%rows, jacobian%columns, jacobian%first, jacobian%column, self%of_column)
      end if
      self%number = maxval(self%of_column)
   end subroutine groups_fit

   pure logical function has_pattern(self, jacobian)
      type(column_groups), intent(in) :: self
      type(jacobian_type), intent(in) :: jacobian
      has_pattern = .false.
      if (.not. allocated(self%of_column)) return
      if (size(self%of_column) /= jacobian%columns .or. size(self%first) /= size(jacobian%first)) return
      if (size(self%column) /= size(jacobian%column)) return
      has_pattern = all(self%first == jacobian%first)
      if (has_pattern) has_pattern = all(self%column == jacobian%column)
   end function has_pattern

   pure subroutine colour(rows, columns, first, column, group)
      integer, intent(in) :: rows, columns
      integer, intent(in) :: first(rows + 1), column(:)
      integer, intent(out) :: group(columns)
      integer :: start(columns + 1), next(columns), row(size(column)), taken(0:columns)
      integer :: i, j, e, r
      start = 0
      do e = 1, size(column)
         start(column(e) + 1) = start(column(e) + 1) + 1
      end do
      start(1) = 1
      do j = 1, columns
         start(j + 1) = start(j + 1) + start(j)
      end do
      next = start(:columns)
      do i = 1, rows
         do e = first(i), first(i + 1) - 1
            row(next(column(e))) = i
            next(column(e)) = next(column(e)) + 1
         end do
      end do
      group = 0
      taken = 0
      do j = 1, columns
         if (start(j + 1) == start(j)) cycle
         do r = start(j), start(j + 1) - 1
            do e = first(row(r)), first(row(r) + 1) - 1
               taken(group(column(e))) = j
            end do
         end do
         group(j) = 1
         do while (taken(group(j)) == j)
            group(j) = group(j) + 1
         end do
      end do
   end subroutine colour

   !> Sizes of coordinates (velocities, multipliers) to move them by, powers of two so that x + size/2^k
   !> is exact: their own, and at least that of the largest or 1 (an angle that is zero now).
   pure subroutine coordinate_sizes(x, sizes)
      real(wp), intent(in) :: x(:)
      real(wp), intent(out) :: sizes(:)
      real(wp) :: largest
      integer :: j
      largest = 0.0_wp
      if (size(x) > 0) largest = maxval(abs(x))
      if (largest < nothing .or. largest > 1.0_wp) largest = 1.0_wp
      do j = 1, size(x)
         sizes(j) = 2.0_wp**(exponent(max(abs(x(j)), largest)) - 1)
      end do
   end subroutine coordinate_sizes
end module dynstep_column_groups
