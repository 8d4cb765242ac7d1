! SPDX-License-Identifier: BSD-3-Clause
!> Reading records of ground motions: both layouts, and what is wrong with a file.
module test_ground_motion
   use dynstep_ground_motion, only: read_at2, standard_gravity
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_file_error, dynstep_invalid_input, status_type
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_ground_motion

   character(len=*), parameter :: path = 'test_ground_motion.AT2'
   character(len=*), parameter :: lf = achar(10), crlf = achar(13)//achar(10), tab = achar(9)
   character(len=*), parameter :: old = 'NPTS=  5, DT= .02000 SEC'
   character(len=*), parameter :: new = '     5    0.0200    NPTS, DT'
   real(wp), parameter :: values_written(5) = [0.0063_wp, -0.00364_wp, 0.00099_wp, 1.5_wp, -2.0_wp]
   character(len=*), parameter :: three = '   0.00630  -0.00364   0.00099', two = '  .1500000E+01 -2.D0'

contains

   subroutine collect_ground_motion(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('layouts', test_layouts), &
         & new_unittest('line-ends', test_line_ends), &
         & new_unittest('wrong-header', test_wrong_header), &
         & new_unittest('wrong-values', test_wrong_values), &
         & new_unittest('no-record', test_no_record), &
         & new_unittest('failed-status', test_failed_status)]
   end subroutine collect_ground_motion

   subroutine test_layouts(error)
      type(error_type), allocatable, intent(out) :: error
      call accept(error, 'old', record(old, three//lf//two//lf))
      call accept(error, 'new', record(new, three//lf//two//lf))
      call accept(error, 'one value a line', &
         & record(new, '.0063'//lf//'-3.64e-3'//lf//'+.00099'//lf//'1.5'//lf//'-2'//lf))
      call accept(error, 'lower case, no blanks', record('npts=5,dt=0.02sec', three//lf//two//lf))
      call accept(error, 'more after the numbers', record('    5   .0200   NPTS, DT, T0 0.0', three//lf//two//lf))
      call accept(error, 'tabs', record('5'//tab//'0.02'//tab//'NPTS, DT', three//tab//two//lf))
      call accept(error, 'blank lines', record(old, lf//three//lf//lf//two//lf//'  '//lf//lf))
      call check(error, standard_gravity, 9.80665_wp)
   end subroutine test_layouts

   subroutine test_line_ends(error)
      type(error_type), allocatable, intent(out) :: error
      call accept(error, 'Windows', 'a'//crlf//'b'//crlf//'g'//crlf//old//crlf//three//crlf//two//crlf)
      call accept(error, 'Windows, last line without end', &
         & 'a'//crlf//'b'//crlf//'g'//crlf//new//crlf//three//crlf//two)
      call accept(error, 'last line without end', record(old, three//lf//two))
   end subroutine test_line_ends

   subroutine test_wrong_header(error)
      type(error_type), allocatable, intent(out) :: error
      character(len=*), parameter :: numbers = three//lf//two//lf
      call refuse(error, record('5 0.02', numbers), 'line 4, is not AT2')
      call refuse(error, record('NPTS, DT', numbers), 'line 4, is not AT2')
      call refuse(error, record('NPTS= 5, DT= abc', numbers), 'line 4, is not AT2')
      call refuse(error, record('NPTS= 0, DT= .02', numbers), 'NPTS = 0;')
      call refuse(error, record('NPTS= -5, DT= .02', numbers), 'NPTS = -5;')
      call refuse(error, record('NPTS= 5.5, DT= .02', numbers), 'NPTS = 5.5;')
      call refuse(error, record('NPTS= 99999999999, DT= .02', numbers), 'NPTS = ')
      call refuse(error, record('NPTS= 5, DT= 0.0', numbers), 'DT = 0 s;')
      call refuse(error, record('NPTS= 5, DT= -.02', numbers), 'DT = -0.02 s;')
      call refuse(error, record('NPTS= 5, DT= 20.', numbers), 'DT = 20 s;')
   end subroutine test_wrong_header

   subroutine test_wrong_values(error)
      type(error_type), allocatable, intent(out) :: error
      call refuse(error, record(old, three//lf), 'line 5, is the last, after 3 of 5 values')
      call refuse(error, record(old, three//lf//lf), 'line 6, is the last, after 3 of 5 values')
      call refuse(error, record(old, three//lf//two//' 1.0'//lf), 'line 6, goes on after 5 values')
      call refuse(error, record(old, three//lf//two//lf//lf//'end'//lf), 'line 8, has "end"')
      call refuse(error, record(old, three//lf//'1.0 ******'//lf), 'line 6, has "******"')
      call refuse(error, record(old, three//lf//'1.0,2.0'//lf), 'line 6, has "1.0,2.0"')
      call refuse(error, record(old, three//lf//'3*1.0'//lf), 'line 6, has "3*1.0"')
      call refuse(error, record(old, three//lf//'NaN 1.0'//lf), 'line 6, has "NaN"')
      call refuse(error, record(old, three//lf//'1.0 +.'//lf), 'line 6, has "+."')
      call refuse(error, record(old, three//lf//'1.0 1e5e5'//lf), 'line 6, has "1e5e5"')
      call refuse(error, record(old, three//lf//'1.0 0.1-0.2-0.3'//lf), 'line 6, has "0.1-0.2-0.3"')
   end subroutine test_wrong_values

   subroutine test_no_record(error)
      type(error_type), allocatable, intent(out) :: error
      call refuse(error, '', 'is empty or no file; an AT2 file has four header lines')
      call refuse_file(error, '', 'a file without a name cannot be opened')
      call refuse(error, 'title'//lf//'station'//lf, 'line 2, is the last')
      call refuse(error, 'title'//lf//'station'//lf//'g'//lf//old//lf, 'line 4, is the last, after 0 of 5')
      call refuse(error, repeat(achar(0)//'xyz', 5000), 'line 1, has more than 1023 characters')
      call remove_file()
      call refuse_file(error, path, 'cannot be opened')
      call refuse_file(error, '.', '')
      call refuse_file(error, repeat('long/', 100)//'name.AT2', 'long/name.AT2 cannot be opened')
   end subroutine test_no_record

   subroutine test_failed_status(error)
      type(error_type), allocatable, intent(out) :: error
      type(status_type) :: status
      real(wp), allocatable :: values(:)
      real(wp) :: dt
      call status%set(dynstep_invalid_input, 'before')
      call read_at2(path, dt, values, status)
      call check(error, trim(status%message), 'before')
      call check(error, .not. allocated(values))
   end subroutine test_failed_status

   pure function record(header, rest) result(bytes)
      character(len=*), intent(in) :: header, rest
      character(len=2*len(lf) + 40 + len(header) + len(rest)) :: bytes
      bytes = 'A SMALL RECORD'//lf//'STATION, COMPONENT'//lf//'G'//lf//header//lf//rest
   end function record

   !> The bytes of `bytes` but for blanks at its end
   subroutine write_file(bytes)
      character(len=*), intent(in) :: bytes
      integer :: unit
      open (newunit=unit, file=path, access='stream', form='unformatted', status='replace', action='write')
      if (len_trim(bytes) > 0) write (unit) trim(bytes)
      close (unit)
   end subroutine write_file

   subroutine remove_file()
      integer :: unit
      open (newunit=unit, file=path)
      close (unit, status='delete')
   end subroutine remove_file

   subroutine accept(error, what, bytes)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: what, bytes
      type(status_type) :: status
      real(wp), allocatable :: values(:)
      real(wp) :: dt
      call write_file(bytes)
      call read_at2(path, dt, values, status)
      if (status%failed()) then
         call test_failed(error, what, trim(status%message))
         return
      end if
      call check(error, size(values), 5, what)
      call check(error, maxval(abs(values - values_written)), 0.0_wp, what, thr=0.0_wp)
      call check(error, dt, 0.02_wp, what, thr=0.0_wp)
      call remove_file()
   end subroutine accept

   subroutine refuse(error, bytes, sentence)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: bytes, sentence
      logical :: opened
      call write_file(bytes)
      call refuse_file(error, path, sentence)
      inquire (file=path, opened=opened)
      call check(error, .not. opened, 'the file is left open: '//sentence)
      call remove_file()
   end subroutine refuse

   subroutine refuse_file(error, file, sentence)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: file, sentence
      type(status_type) :: status
      real(wp), allocatable :: values(:)
      real(wp) :: dt
      call read_at2(file, dt, values, status)
      call check(error, status%code, dynstep_file_error, sentence)
      call check(error, index(status%message, sentence) > 0, &
         & 'expected "'//sentence//'" in "'//trim(status%message)//'"')
      call check(error, .not. allocated(values) .and. .not. abs(dt) > 0.0_wp, 'values without success: '//sentence)
   end subroutine refuse_file
end module test_ground_motion
