! SPDX-License-Identifier: BSD-3-Clause
!> The file of a checkpoint: every kind of item comes back to the last bit, every kind of damage is refused with a
!> sentence, and a stepper that was refused counts as not started.
module test_archive
   use, intrinsic :: ieee_arithmetic, only: ieee_negative_inf, ieee_positive_inf, ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep, only: allocate_state, archive_type, clock_type, dynstep_file_error, long, mechanical_system, new_method, &
      & newmark_stepper, state_type, status_type, stepper_type, wp
   use reference_problems, only: new_problem, start_q, start_v
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_archive

   character(len=*), parameter :: path = 'test_archive.tmp'
   integer, parameter :: most_lines = 2000

   !> A file in memory
   type :: page_type
      integer :: lines = 0
      character(len=512) :: line(most_lines) = ''
   end type page_type

contains

   subroutine collect_archive(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('scalars', test_scalars), &
         & new_unittest('reals to the last bit', test_reals), &
         & new_unittest('arrays', test_arrays), &
         & new_unittest('sections and texts', test_sections), &
         & new_unittest('the format as it is documented', test_format), &
         & new_unittest('options are compared', test_expect), &
         & new_unittest('shapes are compared', test_shapes), &
         & new_unittest('files that are none', test_no_files), &
         & new_unittest('a full disk', test_full), &
         & new_unittest('every line damaged', test_damage), &
         & new_unittest('other values with a right sum', test_forged), &
         & new_unittest('another method or system', test_others), &
         & new_unittest('refused steppers are not started', test_refused), &
         & new_unittest('units are closed', test_units)]
   end subroutine collect_archive

   !> 1, .true. and so on, in both directions
   subroutine visit_scalars(file, l1, l2, i, k, x, word)
      type(archive_type), intent(inout) :: file
      logical, intent(inout) :: l1, l2
      integer, intent(inout) :: i
      integer(long), intent(inout) :: k
      real(wp), intent(inout) :: x
      character(len=*), intent(inout) :: word
      call file%item('l1', l1)
      call file%item('l2', l2)
      call file%item('i', i)
      call file%item('k', k)
      call file%item('x', x)
      call file%item('word', word)
   end subroutine visit_scalars

   subroutine test_scalars(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      logical :: l1, l2
      integer :: i
      integer(long) :: k
      real(wp) :: x
      character(len=40) :: word
      l1 = .true.
      l2 = .false.
      i = -huge(i)
      k = huge(k)
      x = 0.1_wp
      word = 'two words = 3'
      call file%begin_writing(path, status)
      call visit_scalars(file, l1, l2, i, k, x, word)
      call file%finish(status)
      l1 = .false.
      l2 = .true.
      i = 0
      k = 0
      x = 0.0_wp
      word = 'none'
      call file%begin_reading(path, status)
      call visit_scalars(file, l1, l2, i, k, x, word)
      call file%finish(status)
      call check(error, status%code, 0, trim(status%message))
      call check(error, l1 .and. .not. l2, 'logicals')
      call check(error, i, -huge(i), 'integer')
      call check(error, k == huge(k), 'long integer')
      call check(error, same_bits(x, 0.1_wp), 'real')
      call check(error, word, 'two words = 3', 'text')
      call remove()
   end subroutine test_scalars

   !> Zeros of both signs, subnormals, the largest and the least, infinities, NaN of all sorts, and 20000 patterns of bits
   subroutine test_reals(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      real(wp), allocatable :: x(:), y(:)
      integer(int64) :: bits
      real(wp) :: scalar
      integer, parameter :: special = 16, many = 20000
      integer :: i
      allocate (x(special + many))
      x(:12) = [0.0_wp, -0.0_wp, tiny(1.0_wp), -tiny(1.0_wp), huge(1.0_wp), -huge(1.0_wp), 1.0_wp/3.0_wp, &
         & nearest(1.0_wp, 1.0_wp), nearest(1.0_wp, -1.0_wp), ieee_value(1.0_wp, ieee_positive_inf), &
         & ieee_value(1.0_wp, ieee_negative_inf), ieee_value(1.0_wp, ieee_quiet_nan)]
      ! the least subnormal, the largest, a signalling NaN, one with a payload and a sign
      x(13:16) = [transfer(1_int64, 1.0_wp), transfer(4503599627370495_int64, 1.0_wp), &
         & transfer(9218868437227405313_int64, 1.0_wp), transfer(-1234567_int64, 1.0_wp)]
      bits = 88172645463325252_int64
      do i = special + 1, special + many
         bits = ieor(bits, ishft(bits, 13))
         bits = ieor(bits, ishft(bits, -7))
         bits = ieor(bits, ishft(bits, 17))
         x(i) = transfer(bits, 1.0_wp)
      end do
      call file%begin_writing(path, status)
      call file%item('x', x)
      do i = 1, special
         scalar = x(i)
         call file%item('scalar', scalar)
      end do
      call file%finish(status)
      call file%begin_reading(path, status)
      call file%item('x', y)
      do i = 1, special
         call file%item('scalar', scalar)
         call check(error, same_bits(scalar, x(i)), 'a scalar')
      end do
      call file%finish(status)
      call check(error, status%code, 0, trim(status%message))
      if (allocated(error)) return
      do i = 1, size(x)
         if (.not. same_bits(x(i), y(i))) call test_failed(error, 'bits differ')
      end do
      call remove()
   end subroutine test_reals

   !> Ranks, lengths around the ends of lines, no entries, not allocated
   subroutine test_arrays(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      real(wp), allocatable :: x1(:), x2(:, :), x3(:, :, :), none(:), empty(:, :), y1(:), y2(:, :), y3(:, :, :), &
         & other(:), none_either(:, :)
      real(wp) :: fixed(2, 3), fixed_1(3)
      integer, allocatable :: i1(:), j1(:), no_integers(:)
      integer :: n, k
      do n = 0, 9
         if (allocated(x1)) deallocate (x1, x2, x3, i1)
         if (allocated(y1)) deallocate (y1, y2, y3, j1)
         if (allocated(empty)) deallocate (empty)
         allocate (x1(n), x2(2, n), x3(n, 2, 3), i1(n), empty(0, n))
         x1 = [(sqrt(real(k, wp)), k=1, n)]
         x2 = reshape([(sin(real(k, wp)), k=1, 2*n)], [2, n])
         x3 = reshape([(cos(real(k, wp)), k=1, 6*n)], [n, 2, 3])
         i1 = [(k - 5, k=1, n)]
         fixed = reshape([(1.0_wp/k, k=1, 6)], [2, 3])
         fixed_1 = [1.0_wp, 2.0_wp, 3.0_wp]
         call file%begin_writing(path, status)
         call file%item('x1', x1)
         call file%item('x2', x2)
         call file%item('x3', x3)
         call file%item('i1', i1)
         call file%item('none', none)
         call file%item('empty', empty)
         call file%item('none_either', none_either)
         call file%item('no_integers', no_integers)
         call file%entries('fixed', fixed)
         call file%entries('fixed_1', fixed_1)
         call file%finish(status)
         deallocate (empty)
         fixed = 0.0_wp
         fixed_1 = 0.0_wp
         if (allocated(other)) deallocate (other)
         allocate (other(4), none_either(1, 1))
         call file%begin_reading(path, status)
         call file%item('x1', y1)
         call file%item('x2', y2)
         call file%item('x3', y3)
         call file%item('i1', j1)
         call file%item('none', other)
         call file%item('empty', empty)
         call file%item('none_either', none_either)
         call file%item('no_integers', no_integers)
         call file%entries('fixed', fixed)
         call file%entries('fixed_1', fixed_1)
         call file%finish(status)
         call check(error, status%code, 0, trim(status%message))
         if (allocated(error)) return
         call check(error, all(shape(y2) == [2, n]) .and. all(shape(y3) == [n, 2, 3]) .and. size(j1) == n, 'shapes')
         call check(error, all(shape(empty) == [0, n]), 'shape without entries')
         call check(error, .not. (allocated(other) .or. allocated(none_either) .or. allocated(no_integers)), &
            & 'an array that was not allocated')
         call check(error, all(abs(x1 - y1) <= 0.0_wp) .and. all(abs(x2 - y2) <= 0.0_wp) .and. all(abs(x3 - y3) <= 0.0_wp) &
            & .and. all(i1 == j1), 'values')
         call check(error, abs(fixed(2, 3) - 1.0_wp/6.0_wp) <= 0.0_wp .and. abs(fixed_1(3) - 3.0_wp) <= 0.0_wp, 'entries')
      end do
      call remove()
   end subroutine test_arrays

   !> Names of sections come back in sentences; a long text, an empty one
   subroutine test_sections(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      character(len=320) :: long_text, empty
      real(wp) :: x
      integer :: i
      x = 1.5_wp
      long_text = ' '//repeat('a sentence that goes on, ', 12)//'and ends.'
      empty = ''
      call file%begin_writing(path, status)
      call file%section('outer')
      call file%section('inner')
      call file%item('text', long_text)
      call file%item('empty', empty)
      call file%end_section()
      call file%item('x', x)
      call file%end_section()
      call file%finish(status)
      do i = 1, 2
         call status%clear()
         long_text = ''
         empty = 'not empty'
         call file%begin_reading(path, status)
         call file%section('outer')
         call file%section('inner')
         call file%item('text', long_text)
         call file%item('empty', empty)
         if (i == 2) call file%item('missing', x)
         call file%end_section()
         call file%item('x', x)
         call file%end_section()
         call file%finish(status)
         if (i == 1) call check(error, status%code, 0, trim(status%message))
         call check(error, long_text, repeat('a sentence that goes on, ', 12)//'and ends.', 'long text')
         call check(error, empty, '', 'empty text')
      end do
      call check(error, status%code, dynstep_file_error, 'code')
      call check(error, status%message, path//', line 6, in outer/inner: "missing real =" was expected, not "end inner": it ' &
         & //'belongs to another method, system or option', 'sentence')
      call remove()
   end subroutine test_sections

   !> The lines that docs/howto/restarting.md shows, with the sum that zlib gives
   subroutine test_format(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      type(page_type), allocatable :: page
      logical :: l
      integer :: i
      real(wp) :: x
      real(wp), allocatable :: y(:, :), none(:)
      allocate (page)
      l = .true.
      i = -12
      x = 0.1_wp
      y = reshape([1.0_wp, -0.0_wp, 3.0e300_wp, 4.0e-310_wp, ieee_value(x, ieee_positive_inf), &
         & transfer(9221120237041090561_int64, x)], [2, 3])
      call file%begin_writing(path, status)
      call file%section('example')
      call file%item('is_there', l)
      call file%item('count', i)
      call file%item('h', x)
      call file%item('y', y)
      call file%item('z', none)
      call file%end_section()
      call file%finish(status)
      call check(error, status%code, 0, trim(status%message))
      call load(page)
      call check(error, page%lines, 11, 'lines')
      call check(error, page%line(1), 'dynstep checkpoint 1', 'title')
      call check(error, page%line(2), 'begin example', 'section')
      call check(error, page%line(3), 'is_there logical = true', 'logical')
      call check(error, page%line(4), 'count integer = -12', 'integer')
      call check(error, page%line(5), 'h real = 1.0000000000000001E-001', 'real')
      call check(error, page%line(6), 'y real 2 3', 'array')
      call check(error, page%line(7), '1.0000000000000000E+000 -0.0000000000000000E+000 3.0000000000000002E+300 ' &
         & //'3.9999999999999878E-310', 'values')
      call check(error, page%line(8), 'Infinity NaN:7FF8000000000001', 'more values')
      call check(error, page%line(9), 'z real none', 'not allocated')
      call check(error, page%line(10), 'end example', 'end of section')
      call check(error, page%line(11), 'checksum 2667792548', 'sum')
      call remove()
   end subroutine test_format

   subroutine test_expect(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      integer :: i, wrong
      character(len=80), parameter :: words(6) = [character(len=80) :: '', 'l is true in the file and false here', &
         & 'i is 3 in the file and 4 here', 'x is 0.25 in the file and 0.3 here', 'w is soi2 in the file and newmark here', &
         & 'n(2) is 2 in the file and 5 here']
      do wrong = 0, 5
         call status%clear()
         do i = 1, 2
            if (i == 1) call file%begin_writing(path, status)
            if (i == 2) call file%begin_reading(path, status)
            associate (w => merge(wrong, 0, i == 2))
               call file%expect('l', w /= 1)
               call file%expect('i', merge(4, 3, w == 2))
               call file%expect('x', merge(0.3_wp, 0.25_wp, w == 3))
               if (w == 4) then
                  call file%expect('w', 'newmark')
               else
                  call file%expect('w', 'soi2')
               end if
               call file%expect('n', [1, merge(5, 2, w == 5), 4])
            end associate
            call file%finish(status)
         end do
         if (wrong == 0) call check(error, status%code, 0, trim(status%message))
         if (wrong == 0) cycle
         call check(error, status%code, dynstep_file_error, 'code')
         call check(error, index(status%message, trim(words(wrong + 1))) > 0, trim(status%message))
      end do
      call remove()
   end subroutine test_expect

   subroutine test_shapes(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      real(wp), allocatable :: x(:, :), y(:)
      real(wp) :: fixed(3)
      integer, allocatable :: numbers(:)
      integer :: i
      allocate (x(2, 3), source=1.0_wp)
      call file%begin_writing(path, status)
      call file%item('x', x)
      call file%finish(status)
      call check(error, status%code, 0, trim(status%message))
      do i = 1, 4
         call status%clear()
         call file%begin_reading(path, status)
         select case (i)
         case (1)
            deallocate (x)
            allocate (x(2, 4), source=7.0_wp)
            call file%item('x', x)
            call check(error, all(abs(x - 7.0_wp) <= 0.0_wp), 'what was there is changed')
         case (2)
            call file%item('x', y)
         case (3)
            call file%item('x', numbers)
         case (4)
            call file%entries('x', fixed)
         end select
         call file%finish(status)
         call check(error, status%code, dynstep_file_error, 'a wrong shape')
         call check(error, index(status%message, ', line 2: ') > 0, trim(status%message))
      end do
      call check(error, .not. (allocated(y) .or. allocated(numbers)), 'something was allocated')
      call remove()
   end subroutine test_shapes

   subroutine test_no_files(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      type(page_type), allocatable :: page
      character(len=32), parameter :: first(5) = [character(len=32) :: 'dynstep checkpoint 2', 'dynstep checkpoint', &
         & 'hello', '', 'dynstep checkpoint 1 x']
      integer :: i
      allocate (page)
      call file%begin_reading('there/is/no/such/file', status)
      call check(error, status%code, dynstep_file_error, 'no file')
      call check(error, index(status%message, 'there/is/no/such/file cannot be read: ') == 1, trim(status%message))
      call status%clear()
      call file%begin_writing('there/is/no/such/folder', status)
      call check(error, status%code, dynstep_file_error, 'no folder')
      call check(error, index(status%message, 'there/is/no/such/folder cannot be written: ') == 1, trim(status%message))
      call file%finish(status)
      call status%clear()
      call file%begin_reading('.', status)
      call check(error, status%code, dynstep_file_error, 'a folder')
      call status%clear()
      call file%begin_writing('', status)
      call file%finish(status)
      call status%clear()
      call file%begin_reading('', status)
      call check(error, status%code, dynstep_file_error, 'no name')
      do i = 1, size(first)
         page%lines = 1
         page%line(1) = first(i)
         if (i == 4) page%lines = 0
         call store(page, seal=i /= 4)
         call status%clear()
         call file%begin_reading(path, status)
         call check(error, status%code, dynstep_file_error, 'first line '//trim(first(i)))
         if (i == 1) call check(error, index(status%message, 'is a checkpoint of version 2, and this library reads version 1') &
            & > 0, trim(status%message))
         if (i == 3) call check(error, index(status%message, 'is no checkpoint') > 0, trim(status%message))
         call check(error, file%failed(), 'file is open')
         call file%finish(status)
      end do
      call remove()
   end subroutine test_no_files

   !> What is written to a device that is full
   subroutine test_full(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      real(wp), allocatable :: x(:)
      integer :: length
      logical :: there
      inquire (file='/dev/full', exist=there)
      if (.not. there) return
      do length = 0, 100000, 100000
         if (allocated(x)) deallocate (x)
         allocate (x(length), source=1.0_wp)
         call status%clear()
         call file%begin_writing('/dev/full', status)
         call file%item('x', x)
         call file%finish(status)
         call check(error, status%code, dynstep_file_error, 'a full device is not noticed')
         call check(error, index(status%message, '/dev/full') == 1, trim(status%message))
      end do
   end subroutine test_full

   !> A stepper in the middle of a run
   subroutine prepare(method, problem, sys, stepper, state, steps)
      character(len=*), intent(in) :: method
      integer, intent(in) :: problem
      class(mechanical_system), allocatable, intent(out) :: sys
      class(stepper_type), allocatable, intent(out) :: stepper
      type(state_type), intent(out) :: state
      integer, intent(in) :: steps
      type(state_type) :: trial
      type(status_type) :: status
      integer :: i
      call new_problem(problem, sys)
      call new_method(method, stepper, status)
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      call allocate_state(sys, trial, status)
      state%y = [start_q, start_v]
      call stepper%start(sys, state, status)
      do i = 1, steps
         call stepper%try_step(sys, state, 0.1_wp, state%t + 0.1_wp, trial, status)
         call stepper%accept(state, trial)
      end do
   end subroutine prepare

   subroutine write_stepper(stepper, status)
      class(stepper_type), intent(inout) :: stepper
      type(status_type), intent(inout) :: status
      type(archive_type) :: file
      call file%begin_writing(path, status)
      call stepper%archive(file)
      call file%finish(status)
   end subroutine write_stepper

   subroutine read_stepper(stepper, status)
      class(stepper_type), intent(inout) :: stepper
      type(status_type), intent(inout) :: status
      type(archive_type) :: file
      call file%begin_reading(path, status)
      call stepper%archive(file)
      call file%finish(status)
   end subroutine read_stepper

   !> Cut off after each line; each line left out, doubled, with one character changed: refused before anything is read
   subroutine test_damage(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state, before, trial
      type(status_type) :: status
      type(page_type), allocatable :: page, damaged
      integer :: i, j, kind
      allocate (page, damaged)
      call prepare('soi2', 3, sys, stepper, state, 3)
      call write_stepper(stepper, status)
      call load(page)
      call check(error, page%lines > 100 .and. page%lines < most_lines, 'lines of the file')
      call prepare('soi2', 3, sys, stepper, before, 1)
      do kind = 1, 4
         do i = 1, page%lines - 1
            if (allocated(error)) exit
            damaged = page
            select case (kind)
            case (1)
               damaged%lines = i
            case (2)
               damaged%line(i:page%lines - 1) = page%line(i + 1:page%lines)
               damaged%lines = page%lines - 1
            case (3)
               damaged%line(i + 1:page%lines + 1) = page%line(i:page%lines)
               damaged%lines = page%lines + 1
            case (4)
               j = 1 + modulo(7*i, len_trim(page%line(i)))
               damaged%line(i) (j:j) = achar(ieor(iachar(page%line(i) (j:j)), 1))
            end select
            call store(damaged)
            call status%clear()
            call read_stepper(stepper, status)
            call check(error, status%code, dynstep_file_error, 'damage is not noticed')
            call check(error, index(status%message, path) == 1, trim(status%message))
         end do
      end do
      ! it is still as it was before
      call check(error, stepper%is_started .and. stepper%count%steps == 1, 'a refused file has changed the stepper')
      call status%clear()
      trial = before
      call stepper%try_step(sys, before, 0.1_wp, before%t + 0.1_wp, trial, status)
      call check(error, status%code, 0, trim(status%message))
      call stepper%accept(before, trial)
      call prepare('soi2', 3, sys, stepper, state, 2)
      call check(error, all(abs(state%y - before%y) <= 0.0_wp), 'a refused file has changed a step')
      call remove()
   end subroutine test_damage

   !> Words that make no sense behind a right sum: names, types, numbers, shapes
   subroutine test_forged(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(page_type), allocatable :: page, forged
      integer :: i, blank
      allocate (page, forged)
      call prepare('newmark', 3, sys, stepper, state, 3)
      call write_stepper(stepper, status)
      call load(page)
      do i = 2, page%lines - 1
         forged = page
         forged%lines = page%lines - 1
         blank = index(trim(page%line(i)), ' ', back=.true.)
         forged%line(i) (blank + 1:) = '?'
         call store(forged, seal=.true.)
         call status%clear()
         call read_stepper(stepper, status)
         call check(error, status%code, dynstep_file_error, 'taken: '//trim(forged%line(i)))
         call check(error, .not. stepper%is_started, 'started')
         forged%line(i) = trim(page%line(i))//' 1.0'
         call store(forged, seal=.true.)
         call status%clear()
         call read_stepper(stepper, status)
         call check(error, status%code, dynstep_file_error, 'taken: '//trim(forged%line(i)))
      end do
      ! the true one is taken after all that
      call store(page)
      call status%clear()
      call read_stepper(stepper, status)
      call check(error, status%code, 0, trim(status%message))
      call check(error, stepper%is_started, 'not started')
      call remove()
   end subroutine test_forged

   subroutine test_others(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(newmark_stepper) :: other, empty
      type(state_type) :: state
      type(status_type) :: status
      call prepare('newmark', 2, sys, stepper, state, 3)
      call write_stepper(stepper, status)
      call prepare('midpoint', 2, sys, stepper, state, 3)
      call read_stepper(stepper, status)
      call check(error, status%code, dynstep_file_error, 'another method')
      call check(error, index(status%message, '"begin midpoint" was expected, not "begin newmark"') > 0, trim(status%message))
      call status%clear()
      call prepare('newmark', 3, sys, stepper, state, 3)
      call read_stepper(stepper, status)
      call check(error, status%code, dynstep_file_error, 'another system')
      call check(error, index(status%message, 'in newmark/system: ') > 0, trim(status%message))
      call status%clear()
      call new_problem(2, sys)
      other%newton%tolerance = 1.0e-9_wp
      call other%init(sys, status)
      call read_stepper(other, status)
      call check(error, status%code, dynstep_file_error, 'another tolerance')
      call check(error, index(status%message, 'tolerance is 0 in the file and 1.00000E-09 here') > 0, trim(status%message))
      call status%clear()
      other%newton%tolerance = 0.0_wp
      other%beta = 0.3_wp
      call other%init(sys, status)
      call read_stepper(other, status)
      call check(error, index(status%message, 'beta is 0.25 in the file and 0.3 here') > 0, trim(status%message))
      call status%clear()
      call read_stepper(empty, status)
      call check(error, index(status%message, 'call init') > 0, trim(status%message))
      call remove()
   end subroutine test_others

   !> A stepper that took a part of a file says so when it is asked for a step of a driver: it is not started
   subroutine test_refused(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(page_type), allocatable :: page
      character(len=22), parameter :: names(6) = [character(len=22) :: 'newmark', 'midpoint', 'soi2', 'bi', &
         & 'newmark-extrapolation', 'generalized-alpha']
      integer :: i, cut
      allocate (page)
      do i = 1, size(names)
         call status%clear()
         call prepare(trim(names(i)), 3, sys, stepper, state, 3)
         call write_stepper(stepper, status)
         call load(page)
         ! all is right but the last line but two, is_started
         cut = page%lines - 2
         page%line(cut) = 'is_started logical = maybe'
         page%lines = page%lines - 1
         call store(page, seal=.true.)
         call read_stepper(stepper, status)
         call check(error, status%code, dynstep_file_error, trim(names(i)))
         call check(error, .not. stepper%is_started, trim(names(i))//' counts as started')
         ! and it can be started anew
         call status%clear()
         call stepper%start(sys, state, status)
         call check(error, stepper%is_started .and. status%code == 0, trim(names(i))//' cannot be started any more')
      end do
      call remove()
   end subroutine test_refused

   !> Thousands of files that fail leave no unit open
   subroutine test_units(error)
      type(error_type), allocatable, intent(out) :: error
      type(archive_type) :: file
      type(status_type) :: status
      type(page_type), allocatable :: page
      real(wp) :: x
      integer :: i, before, unit
      allocate (page)
      x = 1.0_wp
      before = 0
      do i = 1, 300
         call status%clear()
         call file%begin_writing(path, status)
         call file%item('x', x)
         call file%begin_writing(path, status)      ! the first one was not finished
         call file%item('x', x)
         call file%finish(status)
         call file%begin_reading(path, status)
         call file%item('y', x)
         call file%finish(status)
         call status%clear()
         page%lines = 1
         page%line(1) = 'dynstep checkpoint 1'
         call store(page)
         call file%begin_reading(path, status)
         call file%finish(status)
         open (newunit=unit, status='scratch')
         close (unit)
         if (i == 1) before = unit
         call check(error, unit, before, 'a unit was left open')
      end do
      call remove()
   end subroutine test_units

   ! Files as pages

   subroutine load(page)
      type(page_type), intent(inout) :: page
      integer :: unit, stat
      open (newunit=unit, file=path, action='read', status='old')
      page%lines = 0
      do
         read (unit, '(a)', iostat=stat) page%line(min(page%lines + 1, most_lines))
         if (stat /= 0) exit
         page%lines = page%lines + 1
      end do
      close (unit)
   end subroutine load

   !> With a right checksum behind the lines, where asked for
   subroutine store(page, seal)
      type(page_type), intent(in) :: page
      logical, intent(in), optional :: seal
      integer(int64) :: a, b
      integer :: i, j, unit
      open (newunit=unit, file=path, action='write', status='replace')
      a = 1
      b = 0
      do i = 1, page%lines
         write (unit, '(a)') trim(page%line(i))
         do j = 1, len_trim(page%line(i)) + 1
            if (j <= len_trim(page%line(i))) a = a + iachar(page%line(i) (j:j))
            if (j > len_trim(page%line(i))) a = a + 10
            a = mod(a, 65521_int64)
            b = mod(b + a, 65521_int64)
         end do
      end do
      if (present(seal)) then
         if (seal) write (unit, '("checksum ", i0)') 65536*b + a
      end if
      close (unit)
   end subroutine store

   subroutine remove()
      integer :: unit, stat
      open (newunit=unit, file=path, iostat=stat)
      if (stat == 0) close (unit, status='delete', iostat=stat)
   end subroutine remove

   pure logical function same_bits(x, y)
      real(wp), intent(in) :: x, y
      same_bits = transfer(x, 1_int64) == transfer(y, 1_int64)
   end function same_bits
end module test_archive
