! SPDX-License-Identifier: BSD-3-Clause
!> Texts and arrays across the border to C.
module dynstep_c_text
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_int, c_null_char, c_ptr
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: put_text, length_of_text, get_text, take_point, take_state, take_vector, give

contains

   !> Copy a text to a C buffer, cut to length - 1 characters and ended by zero
   recursive subroutine put_text(words, length, buffer)
      character(len=*), intent(in) :: words
      integer(c_int), intent(in) :: length        !! room of the buffer; < 1: nothing is written
      type(c_ptr), intent(in) :: buffer           !! null: nothing is written
      character(kind=c_char), pointer :: to(:)
      integer :: i, last
      if (length < 1 .or. .not. c_associated(buffer)) return
      call c_f_pointer(buffer, to, [length])
      last = min(len(words), int(length) - 1)
      do i = 1, last
         to(i) = words(i:i)
      end do
      to(last + 1) = c_null_char
   end subroutine put_text

   !> Characters of a C text before its final zero, at most `most` of them
   recursive function length_of_text(from, most) result(length)
      type(c_ptr), intent(in) :: from
      integer, intent(in) :: most
      integer :: length
      character(kind=c_char), pointer :: characters(:)
      call c_f_pointer(from, characters, [most])
      do length = 0, most - 1
         if (characters(length + 1) == c_null_char) return
      end do
      length = most
   end function length_of_text

   !> A C text; `words` has the length that length_of_text tells
   recursive subroutine get_text(from, words)
      type(c_ptr), intent(in) :: from
      character(len=*), intent(out) :: words
      character(kind=c_char), pointer :: characters(:)
      integer :: i
      call c_f_pointer(from, characters, [len(words)])
      do i = 1, len(words)
         words(i:i) = characters(i)
      end do
   end subroutine get_text

   !> Point that a caller gives: right length, there at all, finite
   recursive subroutine take_point(coordinates, n, t, q, v, q0, v0, status)
      integer, intent(in) :: coordinates              !! of the system
      integer(c_int), intent(in) :: n                 !! what the caller says
      real(c_double), intent(in) :: t
      type(c_ptr), intent(in) :: q, v
      real(c_double), pointer, intent(out) :: q0(:), v0(:)
      type(status_type), intent(inout) :: status

      q0 => null()
      v0 => null()
      if (n /= coordinates) call status%set(dynstep_invalid_input, 'n = '//text(n)//', but the system has ' &
         & //text(coordinates)//' coordinates')
      call check_time(t, status)
      call take_vector('q', n, q, q0, status)
      call take_vector('v', n, v, v0, status)
   end subroutine take_point

   !> The same of a first-order system
   recursive subroutine take_state(unknowns, n, t, y, y0, status)
      integer, intent(in) :: unknowns                 !! of the system
      integer(c_int), intent(in) :: n                 !! what the caller says
      real(c_double), intent(in) :: t
      type(c_ptr), intent(in) :: y
      real(c_double), pointer, intent(out) :: y0(:)
      type(status_type), intent(inout) :: status

      y0 => null()
      if (n /= unknowns) call status%set(dynstep_invalid_input, 'n = '//text(n)//', but the system has ' &
         & //text(unknowns)//' unknowns')
      call check_time(t, status)
      call take_vector('y', n, y, y0, status)
   end subroutine take_state

   recursive subroutine check_time(t, status)
      real(c_double), intent(in) :: t
      type(status_type), intent(inout) :: status
      if (status%failed() .or. ieee_is_finite(t)) return
      call status%set(dynstep_invalid_input, 't = '//text(t)//' is not finite')
   end subroutine check_time

   !> Vector that a caller gives: there at all, and finite
   recursive subroutine take_vector(name, n, from, x, status)
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: n
      type(c_ptr), intent(in) :: from
      real(c_double), pointer, intent(out) :: x(:)
      type(status_type), intent(inout) :: status
      integer :: i

      x => null()
      if (status%failed()) return
      if (.not. c_associated(from)) then
         call status%set(dynstep_invalid_input, name//' is NULL')
         return
      end if
      call c_f_pointer(from, x, [n])
      do i = 1, n
         if (ieee_is_finite(x(i))) cycle
         call status%set(dynstep_invalid_input, 'component '//text(i)//' of '//name//' is not finite')
         return
      end do
   end subroutine take_vector

   !> Copy to a C array; null: not wanted
   recursive subroutine give(from, to)
      real(wp), intent(in) :: from(:)
      type(c_ptr), intent(in) :: to
      real(c_double), pointer :: x(:)
      if (.not. c_associated(to)) return
      call c_f_pointer(to, x, [size(from)])
      x = from
   end subroutine give
end module dynstep_c_text
