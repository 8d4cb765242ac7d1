! SPDX-License-Identifier: BSD-3-Clause
!> What the one-call drivers of FORTRAN 77 have in common: options, run, results.
!>
!> The drivers are external procedures, which F77 programs call without an interface; the
!> procedures here have one, as dummy arguments with TARGET need.
module dynstep_f77_run
   use dynstep_controlled_run, only: controlled_run_type
   use dynstep_events, only: event_type
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_f77_options, only: check_levels, check_span, describe_external, describe_levels, describe_linear, &
      & describe_method, describe_output, describe_pade
   use dynstep_f77_systems, only: f77_force, f77_linear_system, f77_load, f77_mass, f77_out, f77_output, &
      & f77_system, f77_tangent
   use dynstep_integrate, only: control_type, integrate, integration_type
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_run, only: run_type
   use dynstep_status, only: dynstep_stopped, dynstep_success, status_type
   use dynstep_step_control, only: step_control_type
   use dynstep_stepper, only: allocate_state, state_type, step_counters, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: run_external, run_linear, table_external, advance, start_and_integrate, give_counts

   integer, parameter, public :: method_plain = 0           !! Newmark's method or the midpoint rule
   integer, parameter, public :: method_extrapolated = 1    !! their extrapolation
   integer, parameter, public :: method_pade = 2

contains

   !> DSNEWM and DSNEXT
   recursive subroutine run_external(method, n, force, mass, tang, out, t, q, v, a, tend, h, iopt, ropt, &
      & rpar, ipar, icnt, idid, message)
      integer, intent(in) :: method              !! method_plain, method_extrapolated or method_pade
      integer, intent(in) :: n
      procedure(f77_force) :: force
      procedure(f77_mass) :: mass
      procedure(f77_tangent) :: tang
      procedure(f77_out) :: out
      real(wp), intent(inout) :: t, q(*), v(*), a(*)
      real(wp), intent(in) :: tend, h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(inout) :: icnt(*)
      integer, intent(out) :: idid
      character(len=*), intent(out) :: message
      type(f77_system) :: sys
      type(status_type) :: status

      call describe_external(n, force, mass, tang, iopt, rpar, ipar, sys, status)
      call run(sys, method, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, status)
      idid = status%code
      message = status%message
   end subroutine run_external

   !> DSNEWL, DSNEXL and DSPADE
   recursive subroutine run_linear(method, n, am, ac, ak, load, out, t, q, v, a, tend, h, iopt, ropt, &
      & rpar, ipar, icnt, idid, message)
      integer, intent(in) :: method              !! method_plain, method_extrapolated or method_pade
      integer, intent(in) :: n
      real(wp), intent(in) :: am(*), ac(*), ak(*)
      procedure(f77_load) :: load
      procedure(f77_out) :: out
      real(wp), intent(inout) :: t, q(*), v(*), a(*)
      real(wp), intent(in) :: tend, h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(inout) :: icnt(*)
      integer, intent(out) :: idid
      character(len=*), intent(out) :: message
      type(f77_linear_system) :: sys
      type(status_type) :: status

      call describe_linear(n, am, ac, ak, load, iopt, rpar, ipar, sys, status)
      call run(sys, method, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, status)
      idid = status%code
      message = status%message
   end subroutine run_linear

   !> DSTABL
   recursive subroutine table_external(n, force, mass, tang, t, q, v, h, iopt, ropt, rpar, ipar, p, table, number, &
      & idid, message)
      integer, intent(in) :: n
      procedure(f77_force) :: force
      procedure(f77_mass) :: mass
      procedure(f77_tangent) :: tang
      real(wp), intent(in) :: t, q(*), v(*), h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(in) :: p
      real(wp), intent(inout) :: table(*)        !! [2n, p, p]
      integer, intent(inout) :: number(*)        !! [p]
      integer, intent(out) :: idid
      character(len=*), intent(out) :: message
      type(f77_system) :: sys
      type(status_type) :: status
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(control_type) :: control
      real(wp), allocatable :: entries(:, :, :)
      integer, allocatable :: numbers(:)

      call describe_external(n, force, mass, tang, iopt, rpar, ipar, sys, status)
      call check_levels('P', p, status)
      call describe_method(p, iopt, ropt, stepper, status)
      call check_span(t, t, h, status)
      if (.not. status%failed()) call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      if (.not. status%failed()) then
         state%t = t
         state%y(1:n) = q(1:n)
         state%y(n + 1:) = v(1:n)
         call stepper%start(sys, state, status)
         control%h = h
         call integrate(stepper, sys, state, t + h, control, status)
      end if
      if (.not. status%failed()) then
         select type (stepper)
         class is (extrapolation_stepper)
            call stepper%get_tableau(entries, numbers)
            table(:size(entries)) = reshape(entries, [size(entries)])
            number(:p) = numbers
         end select
      end if
      idid = status%code
      message = status%message
   end subroutine table_external

   !> From T to TEND
   recursive subroutine run(sys, method, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, status)
      class(mechanical_system), intent(inout) :: sys
      integer, intent(in) :: method
      procedure(f77_out) :: out
      real(wp), intent(inout) :: t, q(*), v(*), a(*)
      real(wp), intent(in) :: tend, h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(inout) :: icnt(*)
      type(status_type), intent(inout) :: status
      class(stepper_type), allocatable :: stepper
      type(f77_output) :: output
      type(state_type) :: state
      integer :: levels

      icnt(:10) = 0
      levels = 0
      if (method == method_extrapolated) call describe_levels(iopt, levels, status)
      if (method == method_pade) then
         call describe_pade(iopt, stepper, status)
      else
         call describe_method(levels, iopt, ropt, stepper, status)
      end if
      output%out_external => out
      call advance(sys, stepper, output, state, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, status)
      if (allocated(stepper)) call give_counts(stepper%count, icnt)
   end subroutine run

   !> Start at T, Q, V and integrate to TEND; T, Q, V, A are changed where the start could be made, and
   !> `state` has its arrays then
   recursive subroutine advance(sys, stepper, output, state, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, status)
      class(mechanical_system), intent(inout) :: sys
      class(stepper_type), allocatable, intent(inout) :: stepper
      class(f77_output), intent(inout) :: output          !! with the subroutine OUT
      type(state_type), intent(inout) :: state
      real(wp), intent(inout) :: t, q(*), v(*), a(*)
      real(wp), intent(in) :: tend, h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      type(status_type), intent(inout) :: status
      type(control_type) :: control
      logical :: wanted

      call describe_output(t, tend, h, iopt, ropt, control, wanted, status)
      if (status%failed()) return
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      if (status%failed()) return
      associate (n => sys%n)
         state%t = t
         state%y(1:n) = q(1:n)
         state%y(n + 1:) = v(1:n)
         call start_and_integrate(sys, stepper, output, state, tend, control, wanted, rpar, ipar, status)
         if (.not. stepper%is_started) return
         t = state%t
         q(1:n) = state%y(1:n)
         v(1:n) = state%y(n + 1:)
         a(1:n) = state%a
      end associate
   end subroutine advance

   !> From `state`, which has t and y, to TEND, by a stepper that is initialised
   recursive subroutine start_and_integrate(sys, stepper, output, state, tend, control, wanted, rpar, ipar, status, &
      & step_control, events)
      class(ode_system), intent(inout) :: sys
      class(stepper_type), intent(inout) :: stepper
      class(f77_output), intent(inout), target :: output  !! with the subroutine OUT
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: tend
      type(control_type), intent(in) :: control
      logical, intent(in) :: wanted                       !! OUT is called
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      type(status_type), intent(inout) :: status
      type(step_control_type), intent(in), optional :: step_control   !! steps follow the error estimate; else `control`
      class(event_type), intent(inout), optional :: events
      type(integration_type), allocatable :: even
      type(controlled_run_type), allocatable :: controlled
      class(run_type), allocatable :: run
      class(f77_output), pointer :: recorder
      call stepper%start(sys, state, status)
      if (.not. stepper%is_started) return
      if (present(step_control)) then
         allocate (controlled)
         call controlled%begin(stepper, sys, state, tend, step_control, status)
         call move_alloc(controlled, run)
      else
         allocate (even)
         call even%begin(sys, state, tend, control, status)
         call move_alloc(even, run)
      end if
      output%n = sys%n
      output%rpar => rpar(1:1)
      output%ipar => ipar(1:1)
      ! one that is null is an argument that is not there
      recorder => null()
      if (wanted) recorder => output
      call run%proceed(stepper, sys, state, status, recorder, events=events)
      if (status%code == dynstep_success) status%message = run%monitor%warning
      if (output%stopped) call status%set(dynstep_stopped, 'OUT asked to stop; the run ended at t = '//text(state%t))
   end subroutine start_and_integrate

   !> The counters in the order of the prologue, cut to what an INTEGER holds
   recursive subroutine give_counts(count, icnt)
      type(step_counters), intent(in) :: count
      integer, intent(inout) :: icnt(*)
      icnt(:10) = int(min(int(huge(0), kind(count%steps)), [count%steps, count%substeps, count%rejections, &
         & count%forces, count%masses, count%tangents, count%factorizations, count%solves, &
         & count%newton_iterations, count%halvings]))
   end subroutine give_counts
end module dynstep_f77_run
