! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: handles, messages, codes.  `dynstep.h` describes each function.
module dynstep_capi_handles
   use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int, c_intptr_t, c_associated, c_ptr
   use dynstep_c_handle, only: create_handle, destroy_handle, integrator_of, integrator_type, reach
   use dynstep_c_text, only: put_text
   use dynstep_status, only: dynstep_in_use, dynstep_invalid_handle, dynstep_invalid_input, dynstep_success, &
      & status_text
   implicit none
   private

   public :: dynstep_version, dynstep_new, dynstep_new_ode, dynstep_delete, dynstep_message, dynstep_status_text

   !> 10000*major + 100*minor + patch
   integer(c_int), parameter :: version = 100
   !> A state has 2 n numbers, which an int counts
   integer(c_int), parameter :: most_coordinates = shiftr(huge(0_c_int), 1)

contains

   pure function dynstep_version() result(number) bind(c)
      integer(c_int) :: number
      number = version
   end function dynstep_version

   recursive function dynstep_new(n) result(handle) bind(c)
      integer(c_int), value :: n
      integer(c_intptr_t) :: handle
      handle = 0
      if (n >= 1 .and. n <= most_coordinates) handle = create_handle(int(n), .false.)
   end function dynstep_new

   recursive function dynstep_new_ode(n) result(handle) bind(c)
      integer(c_int), value :: n
      integer(c_intptr_t) :: handle
      handle = 0
      if (n >= 1) handle = create_handle(int(n), .true.)
   end function dynstep_new_ode

   recursive function dynstep_delete(handle) result(code) bind(c)
      type(c_ptr), value :: handle
      integer(c_int) :: code
      integer(c_intptr_t), pointer :: number
      type(integrator_type), pointer :: s

      code = dynstep_invalid_input
      if (.not. c_associated(handle)) return
      call c_f_pointer(handle, number)
      code = dynstep_success
      if (number == 0) return
      code = reach(number, s)
      if (code == dynstep_success) call destroy_handle(number)
   end function dynstep_delete

   recursive function dynstep_message(handle, length, buffer) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: length
      type(c_ptr), value :: buffer
      integer(c_int) :: code
      type(integrator_type), pointer :: s

      s => integrator_of(handle)
      if (.not. associated(s)) then
         code = dynstep_invalid_handle
         call put_text('the handle is not valid: it was deleted, or never came from dynstep_new or dynstep_new_ode', length, buffer)
      else if (s%busy) then
         code = dynstep_in_use
         call put_text('the integrator is in use: a function that it calls must not call it', length, buffer)
      else
         code = dynstep_success
         call put_text(trim(s%status%message), length, buffer)
      end if
   end function dynstep_message

   recursive function dynstep_status_text(code, length, buffer) result(outcome) bind(c)
      integer(c_int), value :: code, length
      type(c_ptr), value :: buffer
      integer(c_int) :: outcome
      outcome = dynstep_success
      call put_text(trim(status_text(int(code))), length, buffer)
   end function dynstep_status_text
end module dynstep_capi_handles
