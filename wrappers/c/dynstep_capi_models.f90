! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: the matrices of models.  `dynstep.h` describes each function.
module dynstep_capi_models
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_ptr
   use dynstep_c_text, only: give, put_text
   use dynstep_flexible_arm, only: flexible_arm
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_arm_matrices, dynstep_arm_straight

   ! DYNSTEP_ARM_PARAMETERS, DYNSTEP_ARM_GAINS of dynstep.h
   integer, parameter :: number_of_parameters = 8, number_of_gains = 4

contains

   recursive function dynstep_arm_matrices(beam, variant, segments, parameters, gains, capacity, n, m, k, b, gain_q, &
      & gain_v, length, message) result(code) bind(c)
      integer(c_int), value :: beam, variant, segments
      type(c_ptr), value :: parameters, gains
      integer(c_int), value :: capacity
      type(c_ptr), value :: n, m, k, b, gain_q, gain_v
      integer(c_int), value :: length
      type(c_ptr), value :: message
      integer(c_int) :: code
      type(status_type) :: status
      type(flexible_arm) :: arm
      real(c_double), pointer :: given(:)
      integer(c_int), pointer :: order

      if (.not. c_associated(n)) call status%set(dynstep_invalid_input, 'n is NULL')
      if (capacity < 0) call status%set(dynstep_invalid_input, 'capacity = '//text(int(capacity))//' must be 0 or more')
      if (.not. status%failed()) then
         call c_f_pointer(n, order)
         order = 0
         arm%beam = beam
         arm%variant = variant
         if (c_associated(parameters)) then
            call c_f_pointer(parameters, given, [number_of_parameters])
            arm%eta = given(1)
            arm%mu = given(2)
            arm%kappa = given(3)
            arm%zeta = given(4)
            arm%alpha = given(5)
            arm%beta = given(6)
            arm%delta = given(7)
            arm%gamma = given(8)
         end if
         call arm%setup(int(segments), status)
         if (c_associated(gains)) then
            call c_f_pointer(gains, given, [number_of_gains])
            call arm%close_loop(status, given)
         else
            call arm%close_loop(status)
         end if
      end if
      if (.not. status%failed()) then
         order = arm%n
         if (capacity >= arm%n) then
            call give(reshape(arm%m%a, [size(arm%m%a)]), m)
            call give(reshape(arm%k%a, [size(arm%k%a)]), k)
            call give(arm%coupling%b, b)
            call give(arm%coupling%k, gain_q)
            call give(arm%coupling%c, gain_v)
         end if
      end if
      call put_text(trim(status%message), length, message)
      code = status%code
   end function dynstep_arm_matrices

   recursive function dynstep_arm_straight(beam, segments, angle, n, q, length, message) result(code) bind(c)
      integer(c_int), value :: beam, segments
      real(c_double), value :: angle
      integer(c_int), value :: n
      type(c_ptr), value :: q
      integer(c_int), value :: length
      type(c_ptr), value :: message
      integer(c_int) :: code
      type(status_type) :: status
      type(flexible_arm) :: arm
      real(c_double), pointer :: to(:)

      arm%beam = beam
      call arm%setup(int(segments), status)
      if (.not. status%failed() .and. n /= arm%n) then
         call status%set(dynstep_invalid_input, 'n = '//text(int(n))//', but this arm has '//text(arm%n)//' coordinates')
      else if (.not. c_associated(q)) then
         call status%set(dynstep_invalid_input, 'q is NULL')
      end if
      if (.not. status%failed()) then
         call c_f_pointer(q, to, [arm%n])
         call arm%straight(angle, to)
      end if
      call put_text(trim(status%message), length, message)
      code = status%code
   end function dynstep_arm_straight
end module dynstep_capi_models
