! SPDX-License-Identifier: BSD-3-Clause
!> Ground motions from files in the .AT2 text layout of the PEER strong motion database.
!>
!>   line 1..3   title, event and station, units (g): not read
!>   line 4      "NPTS=  1559, DT= .02000 SEC" or, newer, "  4000    0.0100   NPTS, DT"
!>   line 5...   NPTS accelerations in g, any number of them in a line
!>
!> The load of a building on moving ground is -M e a_g(t): see load_table_type.
module dynstep_ground_motion
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_file_error, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: read_at2

   !> m/s^2, the value by which accelerations in g are converted (CGPM 1901)
   real(wp), parameter, public :: standard_gravity = 9.80665_wp

   integer, parameter :: header_lines = 4
   !> Longer lines are not those of a record.  PEER writes 76 characters.
   integer, parameter :: longest_line = 1024
   !> A day of motion at 100 samples a second; more is a misread header
   integer, parameter :: most_samples = 8640000
   !> Limits of a sampling interval in seconds; beyond them the header is misread
   real(wp), parameter :: shortest_interval = 1.0e-5_wp, longest_interval = 1.0_wp

   !> The file while it is read
   type :: reader_type
      integer :: unit = -1
      integer :: line = 0                         !! number of the line in `buffer`
      integer :: next = 1                         !! first character that is not read
      logical :: ended = .false.                  !! there is no further line
      character(len=longest_line) :: buffer = ''
   end type reader_type

contains

   !> Read a record.  On failure `values` is not allocated, dt = 0, and the message names
   !> the file, the line, and what is expected there.
   subroutine read_at2(path, dt, values, status)
      character(len=*), intent(in) :: path
      real(wp), intent(out) :: dt                        !! sampling interval [s]
      real(wp), allocatable, intent(out) :: values(:)    !! accelerations [g]
      type(status_type), intent(inout) :: status
      type(reader_type) :: reader
      integer :: i, npts, stat

      dt = 0.0_wp
      if (status%failed()) return
      open (newunit=reader%unit, file=path, status='old', action='read', form='formatted', iostat=stat)
      if (stat /= 0) then
         call refuse(path, 0, 'cannot be opened for reading', status)
         return
      end if
      do i = 1, header_lines
         call next_line(reader, path, status)
         if (reader%ended) exit
      end do
      if (reader%ended .and. reader%line == 0) then
         call refuse(path, 0, 'is empty or no file; an AT2 file has four header lines and then values', status)
      else if (reader%ended) then
         call refuse(path, reader%line, 'is the last; an AT2 file has four header lines and then values', status)
      end if
      call read_size(reader, path, npts, dt, status)
      if (.not. status%failed()) then
         allocate (values(npts), stat=stat)
         if (stat /= 0) call refuse(path, reader%line, 'announces '//text(npts)//' values: no memory', status)
      end if
      if (.not. status%failed()) call read_values(reader, path, values, status)
      close (reader%unit, iostat=stat)
      if (.not. status%failed()) return
      dt = 0.0_wp
      if (allocated(values)) deallocate (values)
   end subroutine read_at2

   !> NPTS and DT from the header's last line: its two numbers, in this order in both layouts
   subroutine read_size(reader, path, npts, dt, status)
      type(reader_type), intent(inout) :: reader
      character(len=*), intent(in) :: path
      integer, intent(out) :: npts
      real(wp), intent(out) :: dt
      type(status_type), intent(inout) :: status
      character(len=*), parameter :: expected = &
         & 'NPTS and DT, as "NPTS=  1559, DT= .02000 SEC" or "  4000    0.0100   NPTS, DT"'
      real(wp) :: numbers(2), x
      integer :: first, last, found, i
      logical :: good, names

      npts = 0
      dt = 0.0_wp
      if (status%failed()) return
      associate (line => reader%buffer)
         do i = 1, len(line)
            if (line(i:i) >= 'a' .and. line(i:i) <= 'z') line(i:i) = achar(iachar(line(i:i)) - 32)
            if (line(i:i) == '=' .or. line(i:i) == ',') line(i:i) = ' '
         end do
         i = index(line, 'SEC')
         if (i > 0) line(i:i + 2) = ''
         names = index(line, 'NPTS') > 0 .and. index(line, 'DT') > 0
         found = 0
         numbers = 0.0_wp
         do
            call next_word(reader, first, last)
            if (first > last) exit
            call number_of(line(first:last), x, good)
            if (.not. good) cycle
            found = found + 1
            if (found <= 2) numbers(found) = x
         end do
      end associate
      if (.not. names .or. found < 2) then
         call refuse(path, reader%line, 'is not AT2: '//expected//' is expected', status)
      else if (.not. (numbers(1) >= 2.0_wp .and. numbers(1) <= most_samples) &
         & .or. abs(numbers(1) - anint(numbers(1))) > 0.0_wp) then
         call refuse(path, reader%line, 'says NPTS = '//text(numbers(1))//'; a whole number from 2 to ' &
            & //text(most_samples)//' is expected', status)
      else if (.not. (numbers(2) >= shortest_interval .and. numbers(2) <= longest_interval)) then
         call refuse(path, reader%line, 'says DT = '//text(numbers(2))//' s; a value from ' &
            & //text(shortest_interval)//' to '//text(longest_interval)//' is expected', status)
      end if
      if (status%failed()) return
      npts = nint(numbers(1))
      dt = numbers(2)
   end subroutine read_size

   !> As many numbers as `values` takes, and then nothing but blank lines
   subroutine read_values(reader, path, values, status)
      type(reader_type), intent(inout) :: reader
      character(len=*), intent(in) :: path
      real(wp), intent(out) :: values(:)
      type(status_type), intent(inout) :: status
      integer :: count, first, last
      real(wp) :: x
      logical :: good

      count = 0
      values = 0.0_wp
      do
         call next_line(reader, path, status)
         if (status%failed()) return
         if (reader%ended) exit
         do
            call next_word(reader, first, last)
            if (first > last) exit
            call number_of(reader%buffer(first:last), x, good)
            if (.not. good) then
               call refuse(path, reader%line, 'has "'//reader%buffer(first:min(last, first + 23)) &
                  & //'" where an acceleration in g is expected', status)
               return
            end if
            if (count == size(values)) then
               call refuse(path, reader%line, 'goes on after '//text(count) &
                  & //' values; NPTS in line 4 is wrong', status)
               return
            end if
            count = count + 1
            values(count) = x
         end do
      end do
      if (count < size(values)) call refuse(path, reader%line, 'is the last, after '//text(count)//' of ' &
         & //text(size(values))//' values; the file is truncated, or NPTS in line 4 is wrong', status)
   end subroutine read_values

   !> The next line into the buffer, or `ended`; carriage returns and tabs become blanks
   subroutine next_line(reader, path, status)
      type(reader_type), intent(inout) :: reader
      character(len=*), intent(in) :: path
      type(status_type), intent(inout) :: status
      integer :: i, length, stat

      if (status%failed()) return
      reader%next = 1
      reader%buffer = ''
      read (reader%unit, '(a)', advance='no', size=length, iostat=stat) reader%buffer
      reader%ended = is_iostat_end(stat)
      if (reader%ended) return
      reader%line = reader%line + 1
      if (stat == 0) then
         call refuse(path, reader%line, 'has more than '//text(longest_line - 1) &
            & //' characters: this is no text file in AT2 layout', status)
      else if (.not. is_iostat_eor(stat)) then
         call refuse(path, reader%line, 'cannot be read', status)
      end if
      do i = 1, len(reader%buffer)
         if (iachar(reader%buffer(i:i)) < 32) reader%buffer(i:i) = ' '
      end do
   end subroutine next_line

   !> buffer(first:last) is the next word of the line; first > last where there is none
   pure subroutine next_word(reader, first, last)
      type(reader_type), intent(inout) :: reader
      integer, intent(out) :: first, last
      integer :: blank

      last = 0
      first = verify(reader%buffer(reader%next:), ' ') + reader%next - 1
      if (first < reader%next) then
         first = 1
         return
      end if
      blank = index(reader%buffer(first:), ' ')
      last = merge(first + blank - 2, len(reader%buffer), blank > 0)
      reader%next = min(last + 1, len(reader%buffer))
   end subroutine next_word

   !> A finite decimal number and nothing else
   pure subroutine number_of(word, x, good)
      character(len=*), intent(in) :: word
      real(wp), intent(out) :: x
      logical, intent(out) :: good
      character(len=32) :: field
      integer :: stat

      x = 0.0_wp
      good = len(word) <= len(field) .and. verify(word, '0123456789+-.eEdD') == 0 &
         & .and. scan(word, '0123456789') > 0
      if (.not. good) return
      field = word
      read (field, '(f32.0)', iostat=stat) x
      good = stat == 0
      if (good) good = ieee_is_finite(x)
   end subroutine number_of

   !> "RECORD.AT2, line 4, ...": the end of a long path is what tells files apart
   subroutine refuse(path, line, what, status)
      character(len=*), intent(in) :: path
      integer, intent(in) :: line              !! 0 for the file as a whole
      character(len=*), intent(in) :: what
      type(status_type), intent(inout) :: status
      character(len=:), allocatable :: where
      integer, parameter :: shown = 100

      where = trim(path)
      if (len(where) == 0) where = 'a file without a name'
      if (len(where) > shown) where = '...'//where(len(where) - shown + 4:)
      if (line > 0) where = where//', line '//text(line)//','
      call status%set(dynstep_file_error, where//' '//what)
   end subroutine refuse
end module dynstep_ground_motion
