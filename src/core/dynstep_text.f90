! SPDX-License-Identifier: BSD-3-Clause
!> Numbers as short texts, for the sentences of a status.
!>
!> The results have a declared length: gfortran keeps the length of a deferred-length result in
!> static storage of the caller, which threads would share.
module dynstep_text
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
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
      character(len=len_trim(padded_integer(int(i, long)))) :: word
      word = padded_integer(int(i, long))
   end function text_of_integer

   pure function text_of_long(i) result(word)
      integer(long), intent(in) :: i
      character(len=len_trim(padded_integer(i))) :: word
      word = padded_integer(i)
   end function text_of_long

   !> Six significant digits; NaN and Infinity as they are
   pure function text_of_real(x) result(word)
      real(wp), intent(in) :: x
      character(len=len_trim(padded_real(x))) :: word
      word = padded_real(x)
   end function text_of_real

   pure function padded_integer(i) result(word)
      integer(long), intent(in) :: i
      character(len=24) :: word
      write (word, '(i0)') i
   end function padded_integer

   !> A NaN is sorted out first: comparing it would trap where exceptions are trapped
   pure function padded_real(x) result(word)
      real(wp), intent(in) :: x
      character(len=24) :: word
      integer :: last
      if (.not. ieee_is_finite(x)) then
         write (word, '(es12.5)') x
         word = adjustl(word)
      else if (abs(x) >= 1.0e-3_wp .and. abs(x) < 1.0e6_wp) then
         write (word, '(f0.6)') x
         last = verify(word, '0 ', back=.true.)
         if (word(last:last) == '.') last = last - 1
         word = word(:last)
         if (word(1:1) == '.') word = '0'//word(:23)
         if (word(1:2) == '-.') word = '-0'//word(2:)
      else if (abs(x) > 0.0_wp) then
         ! without its width the exponent of 1e100 has no E
         write (word, '(es13.5e3)') x
         word = adjustl(word)
         last = index(word, 'E') + 2
         if (word(last:last) == '0') word(last:) = word(last + 1:)
      else
         word = '0'
      end if
   end function padded_real
end module dynstep_text
