! SPDX-License-Identifier: BSD-3-Clause
!> What is kept over steps, to a text file and back: one procedure of a type visits its components in both directions.
!>
!> PROGRAMMING INTERFACE
!>
!>   type(archive_type) :: file
!>   call file%begin_writing(path, status)     or  call file%begin_reading(path, status)
!>   call file%section('newton')               until  call file%end_section()
!>   call file%item('rate', x)                 written, or read
!>   call file%entries('value', x)             an array that is there in its right shape
!>   call file%expect('beta', x)               an option: written, or compared with the one in the file
!>   call file%refuse('sentence')              what was read does not fit
!>   file%is_reading, file%failed()
!>   call file%finish(status)                  always: closes the file, tells what failed
!>
!>   ITEM takes scalars (logical, integer, integer(long), real, character) and allocatable arrays (integer of rank 1, real of
!>   rank 1 to 3); an array comes back allocated or not, as it was.  One that is allocated here must have the shape of the
!>   file.  After a failure every call does nothing, so that a visit need not ask.  FINISH returns it in STATUS.
!>
!>   Numbers come back to the last bit, those of the sign of zero, subnormals, infinities and NaN too.  The format is told
!>   in docs/howto/restarting.md; it is that of IEEE binary64.
module dynstep_archive
   use dynstep_archive_lines, only: archive_lines, line_length
   use dynstep_archive_values, only: integer_of, integers, real_of, reals, word_length, word_of
   use dynstep_kinds, only: long, wp
   use dynstep_status, only: status_type
   use dynstep_text, only: text
   implicit none
   private

   type, public :: archive_type
      logical :: is_reading = .false.
      type(archive_lines), private :: lines
   contains
      procedure :: begin_writing => archive_begin_writing
      procedure :: begin_reading => archive_begin_reading
      procedure :: finish => archive_finish
      procedure :: failed => archive_failed
      procedure :: refuse => archive_refuse
      procedure :: section => archive_section
      procedure :: end_section => archive_end_section
      generic :: item => item_logical, item_integer, item_long, item_real, item_text, item_integers, item_reals, &
         & item_reals_2, item_reals_3
      generic :: entries => entries_reals, entries_reals_2
      generic :: expect => expect_logical, expect_integer, expect_real, expect_text, expect_integers
      procedure, private :: item_logical, item_integer, item_long, item_real, item_text, item_integers, item_reals, &
         & item_reals_2, item_reals_3, entries_reals, entries_reals_2, expect_logical, expect_integer, expect_real, &
         & expect_text, expect_integers
   end type archive_type

contains

   !> A new file; one of this name is replaced
   subroutine archive_begin_writing(self, path, status)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      self%is_reading = .false.
      self%lines%path = ''
      call self%lines%create(path)
      status = self%lines%status
   end subroutine archive_begin_writing

   !> A file that is whole and unchanged, or a sentence that says why not
   subroutine archive_begin_reading(self, path, status)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      self%is_reading = .true.
      self%lines%path = ''
      call self%lines%open(path)
      status = self%lines%status
   end subroutine archive_begin_reading

   !> Close the file, also after a failure, which is told in `status`
   subroutine archive_finish(self, status)
      class(archive_type), intent(inout) :: self
      type(status_type), intent(inout) :: status
      call self%lines%finish()
      if (.not. status%failed() .and. self%lines%status%failed()) status = self%lines%status
   end subroutine archive_finish

   !> Nothing is read or written any more
   pure logical function archive_failed(self)
      class(archive_type), intent(in) :: self
      archive_failed = self%lines%status%failed() .or. .not. self%lines%is_open
   end function archive_failed

   !> Give up: the file does not fit what it is read into
   subroutine archive_refuse(self, what)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: what          !! begin of a sentence after "file, line n: "
      call self%lines%refuse(what)
   end subroutine archive_refuse

   !> What follows belongs to `name`
   subroutine archive_section(self, name)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name           !! without blanks
      character(len=line_length) :: words
      if (self%failed()) return
      if (self%lines%path == '') then
         self%lines%path = name
      else
         self%lines%path = trim(self%lines%path)//'/'//name
      end if
      words = 'begin '//name
      call mark(self, words)
   end subroutine archive_section

   subroutine archive_end_section(self)
      class(archive_type), intent(inout) :: self
      character(len=line_length) :: words
      integer :: slash
      if (self%failed()) return
      slash = index(self%lines%path, '/', back=.true.)
      words = 'end '//self%lines%path(slash + 1:)
      call mark(self, words)
      if (.not. self%failed()) self%lines%path(max(1, slash):) = ''
   end subroutine archive_end_section

   !> A line of words alone
   subroutine mark(self, words)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: words
      if (self%is_reading) then
         call self%lines%get()
         if (self%failed()) return
         if (self%lines%buffer /= words) call self%refuse('"'//trim(words)//'" was expected, not "' &
            & //trim(self%lines%buffer(:48))//'": it belongs to another method, system or option')
      else
         call self%lines%put(words)
      end if
   end subroutine mark

   ! Scalars: name type = value

   !> Name and type of a scalar, the file's value in `word`
   subroutine read_scalar(self, name, kind, word)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name, kind
      character(len=*), intent(out) :: word
      word = ''
      call expect_words(self, name, kind, '=')
      if (self%failed()) return
      call self%lines%word(word)
      if (word == '' .or. self%lines%has_more()) call self%refuse('one value of '//trim(name)//' was expected')
   end subroutine read_scalar

   !> The next line begins with name and kind, and for a scalar with `=`
   subroutine expect_words(self, name, kind, sign)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name, kind
      character(len=*), intent(in) :: sign            !! '=', or blank for an array
      character(len=word_length) :: word(3)
      call self%lines%get()
      if (self%failed()) return
      call self%lines%word(word(1))
      call self%lines%word(word(2))
      word(3) = ''
      if (sign /= '') call self%lines%word(word(3))
      if (word(1) /= name .or. word(2) /= kind .or. word(3) /= sign) call self%refuse('"'//trim(name//' '//kind//' '//sign) &
         & //'" was expected, not "'//trim(self%lines%buffer(:48))//'": it belongs to another method, system or option')
   end subroutine expect_words

   subroutine item_logical(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name           !! without blanks
      logical, intent(inout) :: x
      character(len=word_length) :: word
      if (self%failed()) return
      if (self%is_reading) then
         call read_scalar(self, name, 'logical', word)
         if (self%failed()) return
         if (word /= 'true' .and. word /= 'false') call self%refuse(name//' must be true or false, not '//trim(word))
         if (.not. self%failed()) x = word == 'true'
      else
         call self%lines%put(name//' logical = '//trim(merge('true ', 'false', x)))
      end if
   end subroutine item_logical

   subroutine item_integer(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: x
      integer(long) :: y
      y = x
      call item_long(self, name, y)
      if (self%failed()) return
      if (abs(y) > huge(x)) call self%refuse(name//' is too large for an integer')
      if (.not. self%failed()) x = int(y)
   end subroutine item_integer

   subroutine item_long(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(long), intent(inout) :: x
      character(len=word_length) :: word
      if (self%failed()) return
      if (self%is_reading) then
         call read_scalar(self, name, 'integer', word)
         call integer_of(self%lines, word, x)
      else
         call self%lines%put(name//' integer = '//text(x))
      end if
   end subroutine item_long

   subroutine item_real(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: x
      character(len=word_length) :: word
      if (self%failed()) return
      if (self%is_reading) then
         call read_scalar(self, name, 'real', word)
         call real_of(self%lines, word, x)
      else
         call word_of(x, word)
         call self%lines%put(name//' real = '//trim(adjustl(word)))
      end if
   end subroutine item_real

   !> Text without blanks at its ends, on one line
   subroutine item_text(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=*), intent(inout) :: x
      if (self%failed()) return
      if (self%is_reading) then
         call expect_words(self, name, 'text', '=')
         if (.not. self%failed()) call self%lines%rest(x)
      else
         call self%lines%put(name//' text = '//trim(adjustl(x)))
      end if
   end subroutine item_text

   ! Options: compared with what is here

   subroutine expect_logical(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: x
      logical :: y
      y = x
      call self%item(name, y)
      if (y .neqv. x) call differ(self, name, trim(merge('true ', 'false', y)), trim(merge('true ', 'false', x)))
   end subroutine expect_logical

   subroutine expect_integer(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: x
      integer :: y
      y = x
      call self%item(name, y)
      if (y /= x) call differ(self, name, text(y), text(x))
   end subroutine expect_integer

   subroutine expect_real(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: x
      real(wp) :: y
      y = x
      call self%item(name, y)
      if (transfer(y, 1_long) /= transfer(x, 1_long)) call differ(self, name, text(y), text(x))
   end subroutine expect_real

   subroutine expect_text(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name, x
      character(len=line_length) :: y
      y = x
      call self%item(name, y)
      if (y /= adjustl(x)) call differ(self, name, trim(y(:48)), trim(x))
   end subroutine expect_text

   subroutine expect_integers(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: x(:)
      integer, allocatable :: y(:)
      integer :: i
      allocate (y, source=x)
      call self%item(name, y)
      if (self%failed() .or. .not. allocated(y)) return
      do i = 1, size(x)
         if (y(i) /= x(i)) call differ(self, name//'('//text(i)//')', text(y(i)), text(x(i)))
      end do
   end subroutine expect_integers

   subroutine differ(self, name, there, here)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name, there, here
      if (.not. self%failed()) call self%refuse(name//' is '//there//' in the file and '//here//' here')
   end subroutine differ

   ! Arrays: name type and the shape or `none`, then values in the order of storage

   !> The line before an array.  On reading `shape` and `is_there` come from the file.
   subroutine head(self, name, kind, shape, is_there)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name, kind
      integer, intent(inout) :: shape(:)           !! of what is allocated here
      logical, intent(inout) :: is_there           !! it is
      character(len=word_length) :: word
      character(len=3*word_length) :: words
      integer(long) :: length
      integer :: i

      if (self%failed()) return
      if (.not. self%is_reading) then
         words = 'none'
         if (is_there) call shape_words(shape, words)
         call self%lines%put(name//' '//kind//' '//words)
         return
      end if
      call expect_words(self, name, kind, '')
      do i = 1, size(shape)
         call self%lines%word(word)
         if (i == 1 .and. word == 'none') then
            is_there = .false.
            exit
         end if
         call integer_of(self%lines, word, length)
         if (self%failed()) return
         if (length < 0 .or. length > huge(1)) call self%refuse('the shape of '//name//' is out of range')
         if (is_there .and. length /= shape(i)) call self%refuse('dimension '//text(i)//' of '//name//' has length ' &
            & //text(length)//' in the file and '//text(shape(i))//' here: it belongs to another system or option')
         if (self%failed()) return
         shape(i) = int(length)
         if (i == size(shape)) is_there = .true.
      end do
      if (self%lines%has_more()) call self%refuse(name//' has more than '//text(size(shape))//' dimensions')
   end subroutine head

   subroutine shape_words(shape, words)
      integer, intent(in) :: shape(:)
      character(len=*), intent(out) :: words
      integer :: i
      words = ''
      do i = 1, size(shape)
         words = trim(words)//' '//text(shape(i))
      end do
      words = adjustl(words)
   end subroutine shape_words

   !> An allocation that failed
   subroutine check_memory(self, name, stat)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: stat
      if (stat /= 0) call self%refuse('no memory for '//name)
   end subroutine check_memory

   subroutine item_integers(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout) :: x(:)
      integer :: n(1), stat
      logical :: is_there
      n = 0
      stat = 0
      is_there = allocated(x)
      if (is_there) n = shape(x)
      call head(self, name, 'integer', n, is_there)
      if (self%failed()) return
      if (allocated(x) .and. .not. is_there) deallocate (x)
      if (is_there .and. .not. allocated(x)) allocate (x(n(1)), stat=stat)
      call check_memory(self, name, stat)
      if (is_there) call integers(self%lines, product(n), x)
   end subroutine item_integers

   subroutine item_reals(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: x(:)
      integer :: n(1), stat
      logical :: is_there
      n = 0
      stat = 0
      is_there = allocated(x)
      if (is_there) n = shape(x)
      call head(self, name, 'real', n, is_there)
      if (self%failed()) return
      if (allocated(x) .and. .not. is_there) deallocate (x)
      if (is_there .and. .not. allocated(x)) allocate (x(n(1)), stat=stat)
      call check_memory(self, name, stat)
      if (is_there) call reals(self%lines, product(n), x)
   end subroutine item_reals

   subroutine item_reals_2(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: x(:, :)
      integer :: n(2), stat
      logical :: is_there
      n = 0
      stat = 0
      is_there = allocated(x)
      if (is_there) n = shape(x)
      call head(self, name, 'real', n, is_there)
      if (self%failed()) return
      if (allocated(x) .and. .not. is_there) deallocate (x)
      if (is_there .and. .not. allocated(x)) allocate (x(n(1), n(2)), stat=stat)
      call check_memory(self, name, stat)
      if (is_there) call reals(self%lines, product(n), x)
   end subroutine item_reals_2

   subroutine item_reals_3(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: x(:, :, :)
      integer :: n(3), stat
      logical :: is_there
      n = 0
      stat = 0
      is_there = allocated(x)
      if (is_there) n = shape(x)
      call head(self, name, 'real', n, is_there)
      if (self%failed()) return
      if (allocated(x) .and. .not. is_there) deallocate (x)
      if (is_there .and. .not. allocated(x)) allocate (x(n(1), n(2), n(3)), stat=stat)
      call check_memory(self, name, stat)
      if (is_there) call reals(self%lines, product(n), x)
   end subroutine item_reals_3

   subroutine entries_reals(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), contiguous, intent(inout) :: x(:)
      integer :: n(1)
      logical :: is_there
      n = shape(x)
      is_there = .true.
      call head(self, name, 'real', n, is_there)
      if (.not. is_there) call self%refuse(name//' is missing')
      if (.not. self%failed()) call reals(self%lines, size(x), x)
   end subroutine entries_reals

   subroutine entries_reals_2(self, name, x)
      class(archive_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), contiguous, intent(inout) :: x(:, :)
      integer :: n(2)
      logical :: is_there
      n = shape(x)
      is_there = .true.
      call head(self, name, 'real', n, is_there)
      if (.not. is_there) call self%refuse(name//' is missing')
      if (.not. self%failed()) call reals(self%lines, size(x), x)
   end subroutine entries_reals_2
end module dynstep_archive
