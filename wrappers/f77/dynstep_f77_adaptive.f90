! SPDX-License-Identifier: BSD-3-Clause
!> DSADAP and DSADAO: runs within RTOL and ATOL, with events.
module dynstep_f77_adaptive
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_f77_events, only: f77_action, f77_any_events, f77_event, f77_events, f77_ode_action, f77_ode_event, &
      & f77_ode_events
   use dynstep_f77_odes, only: describe_backinterpolation, describe_ode, f77_jacobian, f77_ode, f77_ode_out, f77_ode_output, &
      & f77_rhs
   use dynstep_f77_options, only: check_not_negative, describe_external, describe_levels, describe_method, describe_output
   use dynstep_f77_run, only: give_counts, start_and_integrate
   use dynstep_f77_systems, only: f77_force, f77_mass, f77_out, f77_output, f77_system, f77_tangent
   use dynstep_integrate, only: control_type
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_event, dynstep_invalid_input, status_type
   use dynstep_step_control, only: step_control_type
   use dynstep_stepper, only: allocate_state, state_type, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: run_adaptive, run_adaptive_ode

   ! Places in IOPT and ROPT, see the prologue of DSADAP
   integer, parameter :: at_every = 1, at_levels = 6, at_vary = 9, at_method = 10, at_mass = 11, at_atol = 25
   integer, parameter :: at_longest = 4, at_shortest = 5
   integer, parameter :: options = 30
   !> Levels that the error may choose where none are told
   integer, parameter :: default_most_levels = 9

contains

   !> DSADAP
   recursive subroutine run_adaptive(n, force, mass, tang, out, t, q, v, a, tend, rtol, atol, h, nev, event, action, idir, &
      & kev, iopt, ropt, rpar, ipar, icnt, idid, message)
      integer, intent(in) :: n
      procedure(f77_force) :: force
      procedure(f77_mass) :: mass
      procedure(f77_tangent) :: tang
      procedure(f77_out) :: out
      real(wp), intent(inout) :: t, q(*), v(*), a(*)
      real(wp), intent(in) :: tend, rtol, atol(*), h
      integer, intent(in) :: nev
      procedure(f77_event) :: event
      procedure(f77_action) :: action
      integer, intent(in) :: idir(*)
      integer, intent(out) :: kev
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(inout) :: icnt(*)
      integer, intent(out) :: idid
      character(len=*), intent(out) :: message
      type(f77_system) :: sys
      type(f77_output) :: output
      type(f77_events) :: events
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(status_type) :: status

      call describe_external(n, force, mass, tang, iopt, rpar, ipar, sys, status)
      call describe_either(iopt, ropt, stepper, status)
      output%out_external => out
      events%event_external => event
      events%action_external => action
      if (.not. status%failed()) call put_start(t, [q(:n), v(:n)], state)
      call run(sys, stepper, output, events, state, tend, rtol, atol, h, nev, idir, kev, iopt, ropt, rpar, ipar, icnt, &
         & status)
      if (is_started(stepper)) then
         t = state%t
         q(:n) = state%y(:n)
         v(:n) = state%y(n + 1:)
         a(:n) = state%a
      end if
      idid = status%code
      message = status%message
   end subroutine run_adaptive

   !> DSADAO
   recursive subroutine run_adaptive_ode(n, f, jac, out, t, y, yp, tend, rtol, atol, h, nev, event, action, idir, kev, &
      & iopt, ropt, rpar, ipar, icnt, idid, message)
      integer, intent(in) :: n
      procedure(f77_rhs) :: f
      procedure(f77_jacobian) :: jac
      procedure(f77_ode_out) :: out
      real(wp), intent(inout) :: t, y(*), yp(*)
      real(wp), intent(in) :: tend, rtol, atol(*), h
      integer, intent(in) :: nev
      procedure(f77_ode_event) :: event
      procedure(f77_ode_action) :: action
      integer, intent(in) :: idir(*)
      integer, intent(out) :: kev
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(inout) :: icnt(*)
      integer, intent(out) :: idid
      character(len=*), intent(out) :: message
      type(f77_ode) :: sys
      type(f77_ode_output) :: output
      type(f77_ode_events) :: events
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(status_type) :: status

      call describe_ode(n, f, jac, iopt, rpar, ipar, sys, status)
      call describe_backinterpolation(iopt, ropt, stepper, status)
      output%ode_out_external => out
      events%event_external => event
      events%action_external => action
      if (.not. status%failed()) call put_start(t, y(:n), state)
      call run(sys, stepper, output, events, state, tend, rtol, atol, h, nev, idir, kev, iopt, ropt, rpar, ipar, icnt, &
         & status)
      if (is_started(stepper)) then
         t = state%t
         y(:n) = state%y
         yp(:n) = state%a
      end if
      idid = status%code
      message = status%message
   end subroutine run_adaptive_ode

   !> An extrapolation as in DSNEXT, or backinterpolation as in DSBINT
   recursive subroutine describe_either(iopt, ropt, stepper, status)
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      class(stepper_type), allocatable, intent(out) :: stepper
      type(status_type), intent(inout) :: status
      integer :: levels, most
      if (status%failed()) return
      if (iopt(at_method) == 0) then
         call describe_levels(iopt, levels, status)
         most = 0
         if (iopt(at_vary) < 0 .or. iopt(at_vary) > 1) then
            call status%set(dynstep_invalid_input, 'IOPT('//text(at_vary)//') = '//text(iopt(at_vary)) &
               & //' must be 0 (as many levels as told) or 1 (levels by the error)')
         else if (iopt(at_vary) == 1) then
            most = merge(default_most_levels, levels, iopt(at_levels) == 0)
            if (most < 2) call status%set(dynstep_invalid_input, 'IOPT('//text(at_levels)//') = '//text(most) &
               & //', the most levels, must be 2 or more')
            levels = max(2, most)
         end if
         call describe_method(levels, iopt, ropt, stepper, status, most)
      else if (iopt(at_method) == 1) then
         ! the kind of the mass has the place of the sign of the estimate
         call describe_backinterpolation([iopt(:at_mass - 1), 0, iopt(at_mass + 1:options)], ropt, stepper, status)
      else
         call status%set(dynstep_invalid_input, 'IOPT('//text(at_method)//') = '//text(iopt(at_method))//', the family, ' &
            & //'must be 0 (extrapolation) or 1 (backinterpolation)')
      end if
   end subroutine describe_either

   recursive subroutine put_start(t, y, state)
      real(wp), intent(in) :: t, y(:)
      type(state_type), intent(inout) :: state
      state%t = t
      state%y = y
   end subroutine put_start

   pure logical function is_started(stepper)
      class(stepper_type), allocatable, intent(in) :: stepper
      is_started = allocated(stepper)
      if (is_started) is_started = stepper%is_started
   end function is_started

   !> What both have in common: from `state`, which has t and y, to TEND
   recursive subroutine run(sys, stepper, output, events, state, tend, rtol, atol, h, nev, idir, kev, iopt, ropt, rpar, ipar, &
      & icnt, status)
      class(ode_system), intent(inout) :: sys
      class(stepper_type), allocatable, intent(inout) :: stepper
      class(f77_output), intent(inout) :: output
      class(f77_any_events), intent(inout), target :: events
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: tend, rtol, atol(*), h
      integer, intent(in) :: nev, idir(*)
      integer, intent(out) :: kev                         !! event that ended the run, or 0
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(inout) :: icnt(*)
      type(status_type), intent(inout) :: status
      type(step_control_type) :: step_control
      type(control_type) :: control
      class(f77_any_events), pointer :: watched
      real(wp), allocatable :: start(:)
      logical :: wanted

      kev = 0
      icnt(:10) = 0
      if (status%failed()) return
      call describe_tolerances(state%t, size(state%y), tend, rtol, atol, h, iopt, ropt, step_control, control, wanted, status)
      call events%describe(sys%n, nev, idir, iopt, rpar, ipar, status)
      if (status%failed()) return
      start = state%y
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      if (status%failed()) return
      state%y = start
      watched => null()
      if (nev > 0) watched => events
      call start_and_integrate(sys, stepper, output, state, tend, control, wanted, rpar, ipar, status, step_control, watched)
      if (status%code == dynstep_event) kev = events%last
      call give_counts(stepper%count, icnt)
   end subroutine run

   !> Tolerances, limits of the step, and where OUT is called
   recursive subroutine describe_tolerances(t, state_size, tend, rtol, atol, h, iopt, ropt, step_control, control, wanted, status)
      real(wp), intent(in) :: t
      integer, intent(in) :: state_size
      real(wp), intent(in) :: tend, rtol, atol(*), h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      type(step_control_type), intent(inout) :: step_control
      type(control_type), intent(inout) :: control
      logical, intent(out) :: wanted
      type(status_type), intent(inout) :: status
      real(wp) :: span_h

      span_h = h
      ! the first step may be left to the library
      if (ieee_is_finite(h)) then
         if (abs(h) <= 0.0_wp) span_h = sign(1.0_wp, tend - t)
      end if
      call describe_output(t, tend, span_h, iopt, ropt, control, wanted, status)
      call check_not_negative(at_longest, 'the longest step', ropt, status)
      call check_not_negative(at_shortest, 'the shortest step', ropt, status)
      if (status%failed()) return
      if (iopt(at_every) > 1) then
         call status%set(dynstep_invalid_input, 'IOPT('//text(at_every)//') = '//text(iopt(at_every)) &
            & //': OUT is called at each step, 1, or at times, IOPT(2)')
      else if (iopt(at_atol) < 0 .or. iopt(at_atol) > 1) then
         call status%set(dynstep_invalid_input, 'IOPT('//text(at_atol)//') = '//text(iopt(at_atol)) &
            & //' must be 0 (one ATOL) or 1 (one for each component)')
      end if
      step_control%rtol = rtol
      step_control%atol = atol(:merge(1, state_size, iopt(at_atol) == 0))
      step_control%h_first = h
      step_control%h_max = ropt(at_longest)
      step_control%h_min = ropt(at_shortest)
      if (allocated(control%t_eval)) step_control%t_eval = control%t_eval
   end subroutine describe_tolerances
end module dynstep_f77_adaptive
