! SPDX-License-Identifier: BSD-3-Clause
!> Numbers as short texts, for the sentences of a status.
module dynstep_text
   use dynstep_kinds, only: long, wp
   implicit none
   private

   public :: text

   !> Shortest readable form of a number, without blanks around it
   interface text
      module procedure :: text_of_integer, text_of_long, text_of_real
   end interface text

contains

   pure function text_of_integer(i) result(word)
      integer, intent(in) :: i
      character(len=:), allocatable :: word
      word = text_of_long(int(i, long))
   end function text_of_integer

   pure function text_of_long(i) result(word)
      integer(long), intent(in) :: i
      character(len=:), allocatable :: word
      character(len=24) :: buffer
      write (buffer, '(i0)') i
      word = trim(buffer)
   end function text_of_long

   !> Six significant digits; NaN and Infinity as they are
   pure function text_of_real(x) result(word)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: word
      character(len=24) :: buffer
      if (abs(x) >= 1.0e-3_wp .and. abs(x) < 1.0e6_wp) then
         write (buffer, '(f0.6)') x
         word = trim(adjustl(buffer))
         do while (word(len(word):) == '0')
            word = word(:len(word) - 1)
         end do
         if (word(len(word):) == '.') word = word(:len(word) - 1)
         if (word(1:1) == '.') word = '0'//word
         if (index(word, '-.') == 1) word = '-0'//word(2:)
      else if (.not. abs(x) > 0.0_wp .and. x > -1.0_wp) then
         word = '0'
      else
         write (buffer, '(es12.5)') x
         word = trim(adjustl(buffer))
      end if
   end function text_of_real
end module dynstep_text
