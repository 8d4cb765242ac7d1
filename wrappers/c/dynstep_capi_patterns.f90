! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: patterns of the Jacobians of constraints, order of the unknowns.  `dynstep.h`
!> describes each function.  C counts rows, columns and entries from 0, the library and its messages from 1.
module dynstep_capi_patterns
   use, intrinsic :: iso_c_binding, only: c_associated, c_f_pointer, c_int, c_intptr_t, c_ptr
   use dynstep_c_handle, only: change, integrator_type, reach_mechanical
   use dynstep_jacobian, only: pattern_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, dynstep_success, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_set_pattern, dynstep_set_constraint_order

   !> `which` of dynstep_set_pattern, as in dynstep.h
   integer, parameter :: which_constraint = 1, which_velocity = 2
   character(len=*), parameter :: names(2) = [character(len=19) :: 'constraint_jacobian', 'velocity_jacobian']

contains

   recursive function dynstep_set_pattern(handle, which, rows, first, column) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: which, rows
      type(c_ptr), value :: first, column
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(pattern_type) :: pattern

      code = reach_mechanical(handle, 'dynstep_set_pattern', s)
      if (code /= dynstep_success) return
      if (which < which_constraint .or. which > which_velocity) then
         call s%status%set(dynstep_invalid_input, 'which = '//text(which)//' must be 1 (G of the constraints) or 2 (K of ' &
            & //'those on velocities)')
      else if (rows < 0 .or. rows > s%n) then
         call s%status%set(dynstep_invalid_input, 'rows = '//text(rows)//' must lie between 0 (dense) and n = '//text(s%n))
      else if (rows > 0) then
         call take_pattern(rows, first, column, pattern, s%status)
         call pattern%check(trim(names(which)), int(rows), s%n, s%status)
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      if (which == which_constraint) then
         s%general%constraints%g = pattern
      else
         s%general%constraints%k = pattern
      end if
      call change(s)
   end function dynstep_set_pattern

   !> Copy a pattern; `column` is read where `first` tells of entries
   recursive subroutine take_pattern(rows, first, column, pattern, status)
      integer(c_int), intent(in) :: rows
      type(c_ptr), intent(in) :: first, column
      type(pattern_type), intent(inout) :: pattern
      type(status_type), intent(inout) :: status
      integer(c_int), pointer :: from(:)
      integer :: i, stat

      if (.not. c_associated(first)) then
         call status%set(dynstep_invalid_input, 'first is NULL')
         return
      end if
      call c_f_pointer(first, from, [int(rows) + 1])
      if (from(1) /= 0) then
         call status%set(dynstep_invalid_input, 'first[0] = '//text(from(1))//' must be 0')
         return
      end if
      do i = 1, rows
         if (from(i + 1) >= from(i)) cycle
         call status%set(dynstep_invalid_input, 'first['//text(i)//'] = '//text(from(i + 1))//' must not be less than first[' &
            & //text(i - 1)//'] = '//text(from(i)))
         return
      end do
      allocate (pattern%first(rows + 1), pattern%column(from(rows + 1)), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for a pattern of '//text(from(rows + 1))//' entries')
         return
      end if
      pattern%first = from + 1
      if (size(pattern%column) == 0) return
      if (.not. c_associated(column)) then
         call status%set(dynstep_invalid_input, 'column is NULL')
         return
      end if
      call c_f_pointer(column, from, [size(pattern%column)])
      do i = 1, size(from)
         if (from(i) == huge(from)) then
            call status%set(dynstep_invalid_input, 'column['//text(i - 1)//'] = '//text(from(i))//' is too large')
            return
         end if
         pattern%column(i) = from(i) + 1
      end do
   end subroutine take_pattern

   recursive function dynstep_set_constraint_order(handle, count, order) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: count
      type(c_ptr), value :: order
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      integer(c_int), pointer :: from(:)
      integer, allocatable :: own(:)

      code = reach_mechanical(handle, 'dynstep_set_constraint_order', s)
      if (code /= dynstep_success) return
      if (count < 0) then
         call s%status%set(dynstep_invalid_input, 'count = '//text(count)//' must be 0 or more')
      else if (count > 0 .and. .not. c_associated(order)) then
         call s%status%set(dynstep_invalid_input, 'order is NULL')
      else if (count > 0) then
         call c_f_pointer(order, from, [count])
         call check_permutation(from, s%status)
         if (.not. s%status%failed()) own = from + 1
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      call move_alloc(own, s%general%constraints%order)
      call change(s)
   end function dynstep_set_constraint_order

   !> Each of 0 .. count - 1 comes once
   recursive subroutine check_permutation(order, status)
      integer(c_int), intent(in) :: order(:)
      type(status_type), intent(inout) :: status
      logical, allocatable :: seen(:)
      integer :: i, stat
      allocate (seen(0:size(order) - 1), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for an order of '//text(size(order))//' unknowns')
         return
      end if
      seen = .false.
      do i = 1, size(order)
         if (order(i) < 0 .or. order(i) >= size(order)) then
            call status%set(dynstep_invalid_input, 'order['//text(i - 1)//'] = '//text(order(i)) &
               & //' must lie between 0 and count - 1 = '//text(size(order) - 1))
            return
         else if (seen(order(i))) then
            call status%set(dynstep_invalid_input, 'order['//text(i - 1)//'] = '//text(order(i)) &
               & //' comes twice; each unknown comes once')
            return
         end if
         seen(order(i)) = .true.
      end do
   end subroutine check_permutation
end module dynstep_capi_patterns
