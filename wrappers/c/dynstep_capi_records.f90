! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: files of ground motions.  `dynstep.h` describes the function.
module dynstep_capi_records
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_ptr
   use dynstep_c_text, only: get_text, length_of_text, put_text
   use dynstep_ground_motion, only: read_at2
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   implicit none
   private

   public :: dynstep_read_at2

   !> A path that is longer than that is none
   integer, parameter :: longest_path = 4096

contains

   recursive function dynstep_read_at2(path, capacity, dt, count, values, length, message) result(code) bind(c)
      type(c_ptr), value :: path
      integer(c_int), value :: capacity
      type(c_ptr), value :: dt, count, values
      integer(c_int), value :: length
      type(c_ptr), value :: message
      integer(c_int) :: code
      type(status_type) :: status
      real(c_double), pointer :: interval, to(:)
      integer(c_int), pointer :: number
      character(len=:), allocatable :: name
      real(wp), allocatable :: samples(:)
      real(wp) :: step

      interval => null()
      number => null()
      if (.not. (c_associated(path) .and. c_associated(dt) .and. c_associated(count))) then
         call status%set(dynstep_invalid_input, 'path, dt or count is NULL')
      else if (capacity < 0 .or. (capacity > 0 .and. .not. c_associated(values))) then
         call status%set(dynstep_invalid_input, 'capacity must be 0 or more, and values not NULL where it is more')
      end if
      if (.not. status%failed()) then
         call c_f_pointer(dt, interval)
         call c_f_pointer(count, number)
         interval = 0.0_wp
         number = 0
         allocate (character(len=length_of_text(path, longest_path)) :: name)
         call get_text(path, name)
         call read_at2(name, step, samples, status)
      end if
      if (.not. status%failed()) then
         interval = step
         number = size(samples)
         if (capacity > 0) then
            call c_f_pointer(values, to, [capacity])
            to(:min(number, capacity)) = samples(:min(number, capacity))
         end if
      end if
      call put_text(trim(status%message), length, message)
      code = status%code
   end function dynstep_read_at2
end module dynstep_capi_records
