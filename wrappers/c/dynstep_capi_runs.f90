! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: runs over an interval, whole or in pieces.  `dynstep.h` describes each
!> function.
module dynstep_capi_runs
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_f_procpointer, c_int, c_intptr_t, &
      & c_null_funptr, c_null_ptr, c_ptr
   use dynstep_c_events, only: c_events
   use dynstep_c_handle, only: check_started, integrator_type, reach, tell_sides
   use dynstep_c_points, only: point_buffer
   use dynstep_c_text, only: put_text
   use dynstep_c_systems, only: c_observer, c_observer_function
   use dynstep_controlled_run, only: controlled_run_type
   use dynstep_integrate, only: control_type, integration_type
   use dynstep_kinds, only: long, wp
   use dynstep_status, only: dynstep_invalid_input, dynstep_more, dynstep_success, status_type
   use dynstep_step_control, only: controller_pi, controller_standard, step_control_type
   use dynstep_stepper, only: multiplier_counts
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_set_observer, dynstep_set_dense, run_whole, dynstep_begin, dynstep_begin_within, dynstep_begin_controlled
   public :: dynstep_proceed, dynstep_point_kinds, dynstep_get_warning

contains

   recursive function dynstep_set_observer(handle, fun, ctx) result(code) bind(c)
      integer(c_intptr_t), value :: handle, fun, ctx
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      procedure(c_observer_function), pointer :: p
      code = reach(handle, s)
      if (code /= dynstep_success) return
      p => null()
      if (fun /= 0) call c_f_procpointer(transfer(fun, c_null_funptr), p)
      s%observer%observer_function => p
      s%observer%context = transfer(ctx, c_null_ptr)
   end function dynstep_set_observer

   recursive function dynstep_set_dense(handle, on) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: on
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code == dynstep_success) s%wants_nodes = on /= 0
   end function dynstep_set_dense

   recursive function dynstep_point_kinds(handle, count, kinds) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: count
      type(c_ptr), value :: kinds
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      integer(c_int), pointer :: to(:)

      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (.not. s%running) then
         call s%status%set(dynstep_invalid_input, 'call dynstep_begin and dynstep_proceed first, and again after start and ' &
            & //'single steps')
      else if (count /= s%points%count) then
         call s%status%set(dynstep_invalid_input, 'count = '//text(count)//', but the last dynstep_proceed wrote ' &
            & //text(s%points%count)//' points')
      else if (count > 0 .and. .not. c_associated(kinds)) then
         call s%status%set(dynstep_invalid_input, 'kinds is NULL')
      else if (count > 0) then
         call c_f_pointer(kinds, to, [count])
         to = 0
         if (s%run%keeps_nodes) to = merge(1, 0, s%points%is_inner(:count))
      end if
      code = s%status%code
   end function dynstep_point_kinds

   recursive function dynstep_get_warning(handle, length, buffer) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: length
      type(c_ptr), value :: buffer
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (allocated(s%run)) then
         call put_text(trim(s%run%monitor%warning), length, buffer)
      else
         call put_text('', length, buffer)
      end if
   end function dynstep_get_warning

   !> Of another name than its label, which is also that of a module
   recursive function run_whole(handle, t_end, h) result(code) bind(c, name='dynstep_run')
      integer(c_intptr_t), value :: handle
      real(c_double), value :: t_end, h
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(control_type) :: control
      code = reach(handle, s)
      if (code /= dynstep_success) return
      control%h = h
      control%every = 0
      call begin(s, t_end, control)
      do while (s%running)
         call go_on(s, huge(0), .false.)
         s%running = s%status%code == dynstep_more
         if (s%running) call s%status%clear()
      end do
      code = s%status%code
   end function run_whole

   recursive function dynstep_begin(handle, t_end, h, every, n_eval, t_eval) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      real(c_double), value :: t_end, h
      integer(c_int), value :: every, n_eval
      type(c_ptr), value :: t_eval
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(control_type) :: control

      code = reach(handle, s)
      if (code /= dynstep_success) return
      control%h = h
      control%every = every
      call take_numbers('t_eval', n_eval, t_eval, control%t_eval, s%status)
      if (allocated(control%t_eval)) control%every = 1
      call begin(s, t_end, control)
      code = s%status%code
   end function dynstep_begin

   recursive function dynstep_begin_controlled(handle, t_end, tolerance, controller, safety_place, h_first, h_max, n_eval, &
      & t_eval) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      real(c_double), value :: t_end, tolerance
      integer(c_int), value :: controller, safety_place
      real(c_double), value :: h_first, h_max
      integer(c_int), value :: n_eval
      type(c_ptr), value :: t_eval
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(step_control_type) :: control

      code = reach(handle, s)
      if (code /= dynstep_success) return
      control%tolerance = tolerance
      control%controller = controller
      control%safety_place = safety_place
      call check_thesis_control(tolerance, controller, s%status)
      control%h_first = h_first
      control%h_max = h_max
      call take_numbers('t_eval', n_eval, t_eval, control%t_eval, s%status)
      call begin_controlled(s, t_end, control)
      code = s%status%code
   end function dynstep_begin_controlled

   recursive function dynstep_begin_within(handle, t_end, rtol, n_atol, atol, atol_lambda, atol_psi, h_first, h_max, h_min, &
      & n_eval, t_eval) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      real(c_double), value :: t_end, rtol
      integer(c_int), value :: n_atol
      type(c_ptr), value :: atol
      real(c_double), value :: atol_lambda, atol_psi, h_first, h_max, h_min
      integer(c_int), value :: n_eval
      type(c_ptr), value :: t_eval
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      type(step_control_type) :: control

      code = reach(handle, s)
      if (code /= dynstep_success) return
      control%rtol = rtol
      control%atol_lambda = atol_lambda
      control%atol_psi = atol_psi
      control%h_first = h_first
      control%h_max = h_max
      control%h_min = h_min
      call take_numbers('atol', n_atol, atol, control%atol, s%status)
      call take_numbers('t_eval', n_eval, t_eval, control%t_eval, s%status)
      call begin_controlled(s, t_end, control)
      code = s%status%code
   end function dynstep_begin_within

   !> What means something else in a step_control_type; that checks the rest
   recursive subroutine check_thesis_control(tolerance, controller, status)
      real(c_double), intent(in) :: tolerance
      integer(c_int), intent(in) :: controller
      type(status_type), intent(inout) :: status
      logical :: is_good
      is_good = ieee_is_finite(tolerance)
      if (is_good) is_good = tolerance > 0.0_wp
      if (.not. is_good) call status%set(dynstep_invalid_input, 'tolerance = '//text(tolerance)//' must be positive')
      if (controller < controller_standard .or. controller > controller_pi) call status%set(dynstep_invalid_input, &
         & 'controller = '//text(controller)//' must be 1 (standard) or 2 (PI)')
   end subroutine check_thesis_control

   !> Numbers of the caller; not allocated where there are none
   recursive subroutine take_numbers(name, count, from, numbers, status)
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: count
      type(c_ptr), intent(in) :: from
      real(wp), allocatable, intent(out) :: numbers(:)
      type(status_type), intent(inout) :: status
      real(c_double), pointer :: given(:)
      if (status%failed()) return
      if (count < 0) then
         call status%set(dynstep_invalid_input, 'n_'//name(max(1, index(name, '_') + 1):)//' = '//text(count) &
            & //' must be 0 or more')
      else if (count > 0 .and. .not. c_associated(from)) then
         call status%set(dynstep_invalid_input, name//' is NULL')
      else if (count > 0) then
         call c_f_pointer(from, given, [count])
         numbers = given
      end if
   end subroutine take_numbers

   !> A run with steps that follow the error estimate
   recursive subroutine begin_controlled(s, t_end, control)
      type(integrator_type), intent(inout) :: s
      real(wp), intent(in) :: t_end
      type(step_control_type), intent(in) :: control
      type(controlled_run_type), allocatable :: run
      call check_started(s)
      if (s%status%failed()) return
      allocate (run)
      call tell_sides(s)
      s%busy = .true.
      s%is_tuned = .true.
      call run%begin(s%stepper, s%sys, s%state, t_end, control, s%status)
      s%busy = .false.
      call move_alloc(run, s%run)
      call make_ready(s)
   end subroutine begin_controlled

   !> A run with steps of one length
   recursive subroutine begin(s, t_end, control)
      type(integrator_type), intent(inout) :: s
      real(wp), intent(in) :: t_end
      type(control_type), intent(in) :: control
      type(integration_type), allocatable :: run
      call check_started(s)
      if (s%status%failed()) return
      allocate (run)
      call run%begin(s%sys, s%state, t_end, control, s%status)
      call move_alloc(run, s%run)
      call make_ready(s)
   end subroutine begin

   !> s%run was begun, or could not be
   recursive subroutine make_ready(s)
      type(integrator_type), intent(inout) :: s
      s%running = .not. s%status%failed()
      s%run%keeps_nodes = s%wants_nodes
      s%recording = 0
      call s%points%clear()
      s%held%code = dynstep_more
   end subroutine make_ready

   recursive function dynstep_proceed(handle, max_steps, capacity, count, t_out, q_out, v_out, a_out) &
      & result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: max_steps, capacity
      type(c_ptr), value :: count, t_out, q_out, v_out, a_out
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      integer(c_int), pointer :: written

      code = reach(handle, s)
      if (code /= dynstep_success) return
      written => null()
      if (c_associated(count)) then
         call c_f_pointer(count, written)
         written = 0
      end if
      if (.not. s%running) then
         call s%status%set(dynstep_invalid_input, 'call dynstep_begin first, and again after start and single steps')
      else if (max_steps < 1) then
         call s%status%set(dynstep_invalid_input, 'max_steps = '//text(max_steps)//' must be 1 or more')
      else if (capacity < 0) then
         call s%status%set(dynstep_invalid_input, 'capacity = '//text(capacity)//' must be 0 or more')
      else if (capacity > 0 .and. .not. associated(written)) then
         call s%status%set(dynstep_invalid_input, 'count is NULL')
      else if (s%recording*merge(1, -1, capacity > 0) < 0) then
         call s%status%set(dynstep_invalid_input, 'capacity must be 0 in all calls of a run, or in none')
      end if
      code = s%status%code
      if (code /= dynstep_success) return
      if (capacity > 0) then
         call attach(s, int(capacity), t_out, q_out, v_out, a_out)
         code = s%status%code
         if (code /= dynstep_success) return
      end if
      s%recording = merge(1, -1, capacity > 0)
      if (capacity == 0) then
         call go_on(s, int(max_steps), .false.)
      else
         call go_on_recording(s, int(max_steps))
         written = s%points%count
      end if
      code = s%status%code
   end function dynstep_proceed

   !> Let the points go into the caller's arrays
   recursive subroutine attach(s, capacity, t_out, q_out, v_out, a_out)
      type(integrator_type), intent(inout) :: s
      integer, intent(in) :: capacity
      type(c_ptr), intent(in) :: t_out, q_out, v_out, a_out
      integer :: m, p
      s%points%capacity = capacity
      s%points%t => null()
      s%points%q => null()
      s%points%v => null()
      s%points%a => null()
      if (c_associated(t_out)) call c_f_pointer(t_out, s%points%t, [capacity])
      if (c_associated(q_out)) call c_f_pointer(q_out, s%points%q, [s%n, capacity])
      if (c_associated(v_out) .and. .not. s%first_order) call c_f_pointer(v_out, s%points%v, [s%n, capacity])
      if (c_associated(a_out)) call c_f_pointer(a_out, s%points%a, [s%n, capacity])
      call multiplier_counts(s%sys, m, p)
      call s%points%reserve(m, p, s%run%keeps_nodes, s%status)
   end subroutine attach

   !> First the points that found no room before and the code that came with them, if it was
   !> another one than dynstep_more; then new steps
   recursive subroutine go_on_recording(s, max_steps)
      type(integrator_type), intent(inout) :: s
      integer, intent(in) :: max_steps
      integer(long) :: steps_before, made, steps, room

      call s%points%deliver()
      if (s%points%holds_back()) then
         call say_full(s)
         return
      end if
      if (s%held%code /= dynstep_more) then
         s%status = s%held
         s%held%code = dynstep_more
         return
      end if
      steps_before = s%stepper%count%steps
      made = 0
      do
         room = s%points%capacity - s%points%count
         steps = 0
         if (room > 0) steps = min(max_steps - made, s%run%steps_for(s%state, s%points%total, s%points%room_for_ends()))
         call go_on(s, int(steps), .true.)
         made = s%stepper%count%steps - steps_before
         if (s%status%code /= dynstep_more .or. s%points%holds_back() .or. s%points%count == s%points%capacity .or. &
            & made >= max_steps) exit
      end do
      if (s%points%holds_back() .and. s%status%code /= dynstep_more) s%held = s%status
      if (s%points%holds_back() .or. (s%status%code == dynstep_more .and. s%points%count == s%points%capacity)) &
         & call say_full(s)
   end subroutine go_on_recording

   recursive subroutine say_full(s)
      type(integrator_type), intent(inout) :: s
      call s%status%set(dynstep_more, 'the room for '//text(s%points%capacity)//' points is used up at t = ' &
         & //text(s%state%t)//'; call again to go on')
   end subroutine say_full

   !> Steps of a run; user functions may be called
   recursive subroutine go_on(s, max_steps, record)
      type(integrator_type), intent(inout), target :: s
      integer, intent(in) :: max_steps       !! 0: record the start, where that is not done
      logical, intent(in) :: record
      type(point_buffer), pointer :: points
      type(c_observer), pointer :: observer
      type(c_events), pointer :: events
      ! one that is null is an argument that is not there
      points => null()
      observer => null()
      events => null()
      if (record) points => s%points
      if (associated(s%observer%observer_function)) observer => s%observer
      if (associated(s%events%event_function)) events => s%events
      call tell_sides(s)
      s%busy = .true.
      call s%run%proceed(s%stepper, s%sys, s%state, s%status, points, observer, max_steps, events)
      s%busy = .false.
   end subroutine go_on
end module dynstep_capi_runs
