! SPDX-License-Identifier: BSD-3-Clause
!> Texts and arrays across the border to C.
module dynstep_c_text
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_null_char, c_ptr
   implicit none
   private

   public :: put_text, length_of_text, get_text

contains

   !> Copy a text to a C buffer, cut to length - 1 characters and ended by zero
   recursive subroutine put_text(text, length, buffer)
      character(len=*), intent(in) :: text
      integer(c_int), intent(in) :: length        !! room of the buffer; < 1: nothing is written
      type(c_ptr), intent(in) :: buffer           !! null: nothing is written
      character(kind=c_char), pointer :: to(:)
      integer :: i, last
      if (length < 1 .or. .not. c_associated(buffer)) return
      call c_f_pointer(buffer, to, [length])
      last = min(len(text), int(length) - 1)
      do i = 1, last
         to(i) = text(i:i)
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

   !> A C text; `text` has the length that length_of_text tells
   recursive subroutine get_text(from, text)
      type(c_ptr), intent(in) :: from
      character(len=*), intent(out) :: text
      character(kind=c_char), pointer :: characters(:)
      integer :: i
      call c_f_pointer(from, characters, [len(text)])
      do i = 1, len(text)
         text(i:i) = characters(i)
      end do
   end subroutine get_text
end module dynstep_c_text
