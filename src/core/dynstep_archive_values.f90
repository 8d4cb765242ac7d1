! SPDX-License-Identifier: BSD-3-Clause
!> Numbers of a checkpoint as words, and lists of them over lines.
!>
!>   integer    decimal
!>   real       17 significant digits, from which all 64 bits come back; Infinity, -Infinity; NaN:7FF8000000000000, which
!>              are its bits in hexadecimal digits
module dynstep_archive_values
   use dynstep_archive_lines, only: archive_lines, line_length
   use dynstep_kinds, only: long, wp
   use dynstep_text, only: text
   implicit none
   private

   public :: integer_of, integers, real_of, reals, word_of

   integer, parameter, public :: word_length = 40
   integer, parameter :: reals_of_line = 4
   integer, parameter :: integers_of_line = 8
   character(len=*), parameter :: real_format = '(es24.16e3)'
   integer(long), parameter :: minus_infinity = -4503599627370496_long   ! bits of -Infinity

contains

   !> Values in the order of storage, written or read
   subroutine reals(self, n, x)
      class(archive_lines), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(inout) :: x(n)
      character(len=word_length) :: word
      character(len=line_length) :: line
      integer :: i
      line = ''
      do i = 1, n
         if (self%is_done()) return
         if (self%is_reading) then
            call next_value(self, word)
            call real_of(self, word, x(i))
         else
            call word_of(x(i), word)
            call put_value(self, i, n, reals_of_line, word, line)
         end if
      end do
      call end_of_values(self)
   end subroutine reals

   subroutine integers(self, n, x)
      class(archive_lines), intent(inout) :: self
      integer, intent(in) :: n
      integer, intent(inout) :: x(n)
      character(len=word_length) :: word
      character(len=line_length) :: line
      integer(long) :: y
      integer :: i
      line = ''
      do i = 1, n
         if (self%is_done()) return
         if (self%is_reading) then
            call next_value(self, word)
            call integer_of(self, word, y)
            if (self%is_done()) return
            x(i) = int(y)
         else
            word = text(x(i))
            call put_value(self, i, n, integers_of_line, word, line)
         end if
      end do
      call end_of_values(self)
   end subroutine integers

   !> Value i of n, so many of them on a line
   subroutine put_value(self, i, n, most, word, line)
      class(archive_lines), intent(inout) :: self
      integer, intent(in) :: i, n, most
      character(len=*), intent(in) :: word
      character(len=*), intent(inout) :: line
      line = trim(line)//' '//trim(adjustl(word))
      if (mod(i, most) /= 0 .and. i < n) return
      call self%put(line(2:))
      line = ''
   end subroutine put_value

   !> The next one, on this line or the one after it
   subroutine next_value(self, word)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(out) :: word
      if (.not. self%has_more()) call self%get()
      call self%word(word)
   end subroutine next_value

   !> Nothing is left on the line
   subroutine end_of_values(self)
      class(archive_lines), intent(inout) :: self
      if (self%is_reading .and. .not. self%is_done() .and. self%has_more()) &
         & call self%refuse('there are more values than the shape has places')
   end subroutine end_of_values

   !> 17 significant digits, from which the bits come back; NaN with its bits in hexadecimal digits.  By bits, since a
   !> comparison with a signalling NaN would trap where a program has set that up.
   pure subroutine word_of(x, word)
      real(wp), intent(in) :: x
      character(len=*), intent(out) :: word
      integer(long) :: bits
      bits = transfer(x, 1_long)
      if (ibits(bits, 52, 11) < 2047) then
         write (word, real_format) x
      else if (ibits(bits, 0, 52) == 0) then
         word = 'Infinity'
         if (bits < 0) word = '-Infinity'
      else
         write (word, '("NaN:", z16.16)') bits
      end if
   end subroutine word_of

   !> The number that a word of the file is
   subroutine real_of(self, word, x)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(in) :: word
      real(wp), intent(inout) :: x
      integer(long) :: bits
      integer :: stat
      if (self%is_done()) return
      stat = 1
      if (word == '-Infinity') then
         x = transfer(minus_infinity, x)
         stat = 0
      else if (word == 'Infinity') then
         x = transfer(ibclr(minus_infinity, 63), x)
         stat = 0
      else if (word(:4) == 'NaN:' .and. verify(trim(word(5:)), '0123456789ABCDEF') == 0) then
         read (word(5:), '(z16)', iostat=stat) bits
         if (stat == 0) x = transfer(bits, x)
      else if (verify(trim(word), '0123456789.+-E') == 0 .and. index(word, '.') > 0) then
         read (word, '(f40.0)', iostat=stat) x
      end if
      if (stat /= 0) call self%refuse('a real number was expected, not "'//trim(word)//'"')
   end subroutine real_of

   subroutine integer_of(self, word, x)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(in) :: word
      integer(long), intent(inout) :: x
      integer :: stat
      if (self%is_done()) return
      stat = 1
      if (word /= '' .and. verify(trim(word), '0123456789-') == 0) read (word, '(i40)', iostat=stat) x
      if (stat /= 0) call self%refuse('an integer was expected, not "'//trim(word)//'"')
   end subroutine integer_of
end module dynstep_archive_values
