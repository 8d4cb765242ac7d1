! SPDX-License-Identifier: BSD-3-Clause
!> The lines of a checkpoint: a text file that says what it is in its first line and sums itself up in its last one.
!>
!>   dynstep checkpoint 1
!>   ...
!>   checksum 3141592653
!>
!> The number is Adler-32 (RFC 1950) of all lines before, each without blanks at its end and with one line feed.  A file is
!> read twice: first for this sum, so that one that is cut off or was changed is refused before anything is taken from it.
module dynstep_archive_lines
   use dynstep_kinds, only: long
   use dynstep_status, only: dynstep_file_error, status_type
   use dynstep_text, only: text
   implicit none
   private

   !> Longest line, and the longest file name that sentences show in full
   integer, parameter, public :: line_length = 512
   integer, parameter :: shown = 100

   character(len=*), parameter :: title = 'dynstep checkpoint'
   integer, parameter :: version = 1
   character(len=*), parameter :: last_word = 'checksum'

   integer(long), parameter :: adler = 65521_long      ! the largest prime below 2**16

   type, public :: archive_lines
      logical :: is_reading = .false.
      logical :: is_open = .false.
      type(status_type) :: status                     !! of the file; nothing is done any more after a failure
      character(len=line_length) :: buffer = ''       !! line that was read last
      integer :: line = 0                             !! its number
      integer, private :: next = 1                    ! first character that no word was taken from
      integer, private :: unit = -1
      integer(long), private :: a = 1, b = 0          ! Adler-32 is 2**16 b + a
      integer(long), private :: bytes = 0             ! that were written
      character(len=shown) :: name = ''               !! of the file, or its end
      character(len=160) :: path = ''                 !! section that the lines belong to, for sentences
   contains
      procedure :: create => lines_create
      procedure :: open => lines_open
      procedure :: put => lines_put
      procedure :: get => lines_get
      procedure :: word => lines_word
      procedure :: has_more => lines_has_more
      procedure :: rest => lines_rest
      procedure :: refuse => lines_refuse
      procedure :: finish => lines_finish
      procedure :: leave => lines_leave
      procedure :: is_done => lines_is_done
   end type archive_lines

contains

   !> A new file, or an old one anew
   subroutine lines_create(self, path)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(in) :: path
      character(len=80) :: reason
      integer :: stat
      call start(self, path, .false.)
      call to_begin(self)
      reason = ''
      open (newunit=self%unit, file=path, status='replace', action='readwrite', form='formatted', iostat=stat, iomsg=reason)
      self%is_open = stat == 0
      if (stat /= 0) call self%refuse('cannot be written: '//trim(reason))
      call self%put(title//' '//text(version))
   end subroutine lines_create

   !> A file that is there, whole and unchanged
   subroutine lines_open(self, path)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(in) :: path
      character(len=80) :: reason
      integer :: stat
      call start(self, path, .true.)
      call to_begin(self)
      reason = ''
      open (newunit=self%unit, file=path, status='old', action='read', form='formatted', iostat=stat, iomsg=reason)
      self%is_open = stat == 0
      if (stat /= 0) call self%refuse('cannot be read: '//trim(reason))
      call check_title(self)
      call check_sum(self)
      call to_begin(self)
      call self%get()
      self%buffer = ''
   end subroutine lines_open

   !> A file that was open is closed
   subroutine start(self, path, is_reading)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: is_reading
      call close_unit(self)
      call self%status%clear()
      self%is_reading = is_reading
      self%bytes = 0
      self%path = ''
      self%name = path
      if (len_trim(path) > shown) self%name = '...'//path(len_trim(path) - shown + 4:)
   end subroutine start

   !> Nothing is read or summed up yet
   subroutine to_begin(self)
      class(archive_lines), intent(inout) :: self
      integer :: stat
      self%buffer = ''
      self%line = 0
      self%next = 1
      self%a = 1
      self%b = 0
      if (self%is_done()) return
      rewind (self%unit, iostat=stat)
      if (stat /= 0) call self%refuse('cannot be read from its begin')
   end subroutine to_begin

   subroutine close_unit(self, stat)
      class(archive_lines), intent(inout) :: self
      integer, intent(out), optional :: stat
      integer :: own
      own = 0
      if (self%is_open) close (self%unit, iostat=own)
      self%is_open = .false.
      if (present(stat)) stat = own
   end subroutine close_unit

   subroutine check_title(self)
      class(archive_lines), intent(inout) :: self
      call self%get()
      if (self%status%failed()) return
      if (self%buffer(:len(title)) /= title) then
         call self%refuse('is no checkpoint: its first line is "'//self%buffer(:24)//'", not "'//title//' ' &
            & //text(version)//'"')
      else if (self%buffer /= title//' '//text(version)) then
         call self%refuse('is a checkpoint of version '//trim(self%buffer(len(title) + 2:len(title) + 10)) &
            & //', and this library reads version '//text(version)//': continue with the library that wrote it')
      end if
   end subroutine check_title

   !> To the last line, which must be the right sum
   subroutine check_sum(self)
      class(archive_lines), intent(inout) :: self
      character(len=line_length) :: last
      character(len=24) :: sum
      logical :: ends
      sum = ''
      last = ''
      do
         if (self%status%failed()) return
         last = self%buffer
         sum = text(ishft(self%b, 16) + self%a)
         call add(self, last)
         call self%get(ends)
         if (ends) exit
      end do
      if (last(:len(last_word) + 1) /= last_word//' ') then
         call self%refuse('is the last, and not the '//last_word//': the checkpoint was cut off, or not written to its end')
      else if (last /= last_word//' '//sum) then
         call self%refuse('says '//trim(last(:len(last_word) + 24))//', but the lines before it give '//trim(sum) &
            & //': the checkpoint was changed after it was written')
      end if
   end subroutine check_sum

   !> Take a line into the sum
   pure subroutine add(self, line)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(in) :: line
      integer :: i
      do i = 1, len_trim(line)
         self%a = modulo(self%a + iand(ichar(line(i:i)), 255), adler)
         self%b = modulo(self%b + self%a, adler)
      end do
      self%a = modulo(self%a + 10, adler)
      self%b = modulo(self%b + self%a, adler)
   end subroutine add

   subroutine lines_put(self, line)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(in) :: line
      character(len=80) :: reason
      integer :: stat
      if (self%status%failed() .or. .not. self%is_open) return
      reason = ''
      write (self%unit, '(a)', iostat=stat, iomsg=reason) trim(line)
      self%line = self%line + 1
      self%bytes = self%bytes + len_trim(line) + 1
      call add(self, line)
      if (stat /= 0) call self%refuse('cannot be written: '//trim(reason))
   end subroutine lines_put

   !> The next line into the buffer
   subroutine lines_get(self, ends)
      class(archive_lines), intent(inout) :: self
      logical, intent(out), optional :: ends       !! there was none; without this argument that is a failure
      integer :: i, stat
      if (present(ends)) ends = .false.
      self%next = 1
      self%buffer = ''
      if (self%status%failed() .or. .not. self%is_open) return
      read (self%unit, '(a)', iostat=stat) self%buffer
      if (is_iostat_end(stat) .and. present(ends)) then
         ends = .true.
         return
      end if
      self%line = self%line + 1
      if (stat /= 0) call self%refuse(trim(merge('ends before it should', 'cannot be read       ', is_iostat_end(stat))))
      i = max(1, len_trim(self%buffer))
      if (ichar(self%buffer(i:i)) == 13) self%buffer(i:i) = ' '
   end subroutine lines_get

   !> Nothing is read or written any more
   pure logical function lines_is_done(self)
      class(archive_lines), intent(in) :: self
      lines_is_done = self%status%failed() .or. .not. self%is_open
   end function lines_is_done

   !> There is another word in the line
   pure logical function lines_has_more(self)
      class(archive_lines), intent(in) :: self
      lines_has_more = self%next <= len_trim(self%buffer)
   end function lines_has_more

   !> The next word of the line; blank at its end
   pure subroutine lines_word(self, word)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(out) :: word
      integer :: first, length
      word = ''
      if (.not. self%has_more()) return
      first = self%next + verify(self%buffer(self%next:), ' ') - 1
      length = scan(self%buffer(first:)//' ', ' ') - 1
      word = self%buffer(first:first + length - 1)
      self%next = first + length + 1
   end subroutine lines_word

   !> What no word was taken from
   pure subroutine lines_rest(self, rest)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(out) :: rest
      rest = ''
      if (self%has_more()) rest = self%buffer(self%next:)
      self%next = line_length + 1
   end subroutine lines_rest

   !> Give up, with a sentence that begins with the file and the line, and close the file
   subroutine lines_refuse(self, what)
      class(archive_lines), intent(inout) :: self
      character(len=*), intent(in) :: what
      if (self%status%failed()) return
      if (self%line > 0 .and. self%is_reading .and. self%path /= '') then
         call self%status%set(dynstep_file_error, trim(self%name)//', line '//text(self%line)//', in '//trim(self%path)//': ' &
            & //what)
      else if (self%line > 0 .and. self%is_reading) then
         call self%status%set(dynstep_file_error, trim(self%name)//', line '//text(self%line)//': '//what)
      else if (self%name == '') then
         call self%status%set(dynstep_file_error, 'a checkpoint without a file name '//what)
      else
         call self%status%set(dynstep_file_error, trim(self%name)//' '//what)
      end if
      call close_unit(self)
   end subroutine lines_refuse

   !> Write the sum, or see that it is next; close
   subroutine lines_finish(self)
      class(archive_lines), intent(inout) :: self
      integer :: stat
      if (self%is_done()) return
      if (self%is_reading) then
         call self%get()
         if (.not. self%is_done() .and. self%buffer(:len(last_word) + 1) /= last_word//' ') &
            & call self%refuse('has "'//trim(self%buffer(:40))//'" where the end of the checkpoint was expected')
      else
         call self%put(last_word//' '//text(ishft(self%b, 16) + self%a))
         call look_again(self)
      end if
      call close_unit(self, stat)
      if (stat /= 0) call self%refuse('could not be closed')
   end subroutine lines_finish

   !> Close a file of which no more is to be read
   subroutine lines_leave(self)
      class(archive_lines), intent(inout) :: self
      if (.not. self%is_done()) call close_unit(self)
   end subroutine lines_leave

   !> Is all of it there?  gfortran 12 tells neither in WRITE nor in FLUSH or CLOSE that a disk is full.  The length comes
   !> first: a device may have no end.
   subroutine look_again(self)
      class(archive_lines), intent(inout) :: self
      character(len=80) :: reason
      integer(long) :: bytes
      integer :: stat
      if (self%is_done()) return
      reason = ''
      bytes = 0
      flush (self%unit, iostat=stat, iomsg=reason)
      if (stat /= 0) call self%refuse('could not be written to its end: '//trim(reason))
      if (self%is_done()) return
      inquire (unit=self%unit, size=bytes, iostat=stat)
      if (stat /= 0 .or. bytes < self%bytes) then
         call self%refuse('has '//text(max(0_long, bytes))//' bytes of '//text(self%bytes)//': could not be written to its ' &
            & //'end, the disk may be full')
         return
      end if
      call to_begin(self)
      call check_title(self)
      call check_sum(self)
   end subroutine look_again
end module dynstep_archive_lines
