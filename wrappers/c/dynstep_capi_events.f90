! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: events of runs, and switches of the right side.  `dynstep.h` describes each function.
module dynstep_capi_events
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_f_procpointer, c_int, c_intptr_t, &
      & c_null_funptr, c_null_ptr, c_ptr
   use dynstep_c_events, only: c_action_function, c_event_function, c_switching
   use dynstep_c_handle, only: change, integrator_type, reach
   use dynstep_status, only: dynstep_invalid_input, dynstep_success, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_set_switches, dynstep_set_events, dynstep_set_event_action, dynstep_event_count, dynstep_get_events

contains

   recursive function dynstep_set_switches(handle, count, fun, ctx, side) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: count
      integer(c_intptr_t), value :: fun, ctx
      type(c_ptr), value :: side
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(c_switching) :: switching
      procedure(c_event_function), pointer :: p
      integer :: switches

      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (fun /= 0) call check_count(count, s%status)
      code = s%status%code
      if (code /= dynstep_success) return
      switches = 0
      if (fun /= 0) then
         switches = count
         call c_f_procpointer(transfer(fun, c_null_funptr), p)
         switching%switch_function => p
         switching%context = transfer(ctx, c_null_ptr)
         if (c_associated(side)) call c_f_pointer(side, switching%side, [switches])
      end if
      if (s%first_order) then
         s%ode%switches = switches
         s%ode%switching = switching
      else
         s%general%switches = switches
         s%general%switching = switching
      end if
      call change(s)
   end function dynstep_set_switches

   recursive function dynstep_set_events(handle, count, fun, ctx, direction, terminal) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: count
      integer(c_intptr_t), value :: fun, ctx
      type(c_ptr), value :: direction, terminal
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      integer(c_int), pointer :: given(:)
      procedure(c_event_function), pointer :: p
      integer :: i

      code = reach(handle, s)
      if (code /= dynstep_success) return
      p => null()
      given => null()
      if (fun /= 0) then
         call check_count(count, s%status)
         if (c_associated(direction)) call c_f_pointer(direction, given, [max(0, count)])
         if (associated(given)) then
            do i = 1, size(given)
               if (abs(given(i)) > 1) call s%status%set(dynstep_invalid_input, 'direction of event '//text(i)//' is ' &
                  & //text(given(i))//'; it must be -1, 0 or 1')
            end do
         end if
         code = s%status%code
         if (code /= dynstep_success) return
         call c_f_procpointer(transfer(fun, c_null_funptr), p)
      end if
      associate (events => s%events)
         events%event_function => p
         events%event_context = transfer(ctx, c_null_ptr)
         events%count = max(1, int(count))
         if (allocated(events%direction)) deallocate (events%direction)
         if (allocated(events%terminal)) deallocate (events%terminal)
         if (associated(given)) events%direction = given
         if (fun /= 0 .and. c_associated(terminal)) then
            call c_f_pointer(terminal, given, [count])
            events%terminal = given /= 0
         end if
      end associate
      s%running = .false.
   end function dynstep_set_events

   recursive subroutine check_count(count, status)
      integer(c_int), intent(in) :: count
      type(status_type), intent(inout) :: status
      if (count < 1) call status%set(dynstep_invalid_input, 'count = '//text(count)//' functions; 1 or more are needed')
   end subroutine check_count

   recursive function dynstep_set_event_action(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_action_function), pointer :: p
      code = reach(handle, s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%events%action_function => p
      s%events%action_context = transfer(ctx, c_null_ptr)
   end function dynstep_set_event_action

   recursive function dynstep_event_count(handle, count) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      type(c_ptr), value :: count
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      integer(c_int), pointer :: number
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (.not. c_associated(count)) call s%status%set(dynstep_invalid_input, 'count is NULL')
      code = s%status%code
      if (code /= dynstep_success) return
      call c_f_pointer(count, number)
      number = met(s)
   end function dynstep_event_count

   !> Events since the last run was begun
   pure integer function met(s)
      type(integrator_type), intent(in) :: s
      met = 0
      if (allocated(s%run)) met = s%run%log%count
   end function met

   recursive function dynstep_get_events(handle, first, count, which, t, q, v) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: first, count
      type(c_ptr), value :: which, t, q, v
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      integer(c_int), pointer :: number(:)
      real(c_double), pointer :: x(:), points(:, :)
      integer :: last

      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (first < 0 .or. count < 0 .or. count > met(s) - max(0, first)) call s%status%set(dynstep_invalid_input, &
         & 'first = '//text(first)//' and count = '//text(count)//' lead beyond the '//text(met(s))//' events of the run')
      code = s%status%code
      if (code /= dynstep_success .or. count == 0) return
      last = first + count
      associate (log => s%run%log)
         if (c_associated(which)) then
            call c_f_pointer(which, number, [count])
            number = log%which(first + 1:last) - 1
         end if
         if (c_associated(t)) then
            call c_f_pointer(t, x, [count])
            x = log%t(first + 1:last)
         end if
         if (c_associated(q)) then
            call c_f_pointer(q, points, [s%n, int(count)])
            points = log%y(:s%n, first + 1:last)
         end if
         if (c_associated(v) .and. .not. s%first_order) then
            call c_f_pointer(v, points, [s%n, int(count)])
            points = log%y(s%n + 1:, first + 1:last)
         end if
      end associate
   end function dynstep_get_events
end module dynstep_capi_events
