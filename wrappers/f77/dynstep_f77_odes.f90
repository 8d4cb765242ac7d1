! SPDX-License-Identifier: BSD-3-Clause
!> First-order systems by EXTERNAL subroutines of FORTRAN 77 form, and their driver.
module dynstep_f77_odes
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_backinterpolation, only: halves_fehlberg, halves_taylor
   use dynstep_f77_options, only: check_not_negative, check_size, check_structure, describe_newton, describe_output
   use dynstep_f77_run, only: give_counts, start_and_integrate
   use dynstep_f77_systems, only: f77_output
   use dynstep_flat_method, only: base_backinterpolation, build_method, method_settings
   use dynstep_integrate, only: control_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_dense, matrix_type
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input, status_type
   use dynstep_step_control, only: controller_pi, controller_standard, safety_in_front, safety_inside, step_control_type
   use dynstep_stepper, only: allocate_state, state_type, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: run_ode, describe_ode, describe_backinterpolation

   abstract interface
      subroutine f77_rhs(n, t, y, yp, rpar, ipar, ierr)
         import :: wp
         integer :: n, ipar(*), ierr
         real(wp) :: t, y(n), yp(n), rpar(*)
      end subroutine f77_rhs

      subroutine f77_jacobian(n, t, y, aj, ld, rpar, ipar, ierr)
         import :: wp
         integer :: n, ld, ipar(*), ierr
         real(wp) :: t, y(n), aj(ld, n), rpar(*)
      end subroutine f77_jacobian

      subroutine f77_ode_out(n, t, y, yp, rpar, ipar, istop)
         import :: wp
         integer :: n, ipar(*), istop
         real(wp) :: t, y(n), yp(n), rpar(*)
      end subroutine f77_ode_out
   end interface
   public :: f77_rhs, f77_jacobian, f77_ode_out

   type, extends(ode_system), public :: f77_ode
      procedure(f77_rhs), pointer, nopass :: rhs_external => null()
      procedure(f77_jacobian), pointer, nopass :: jacobian_external => null()   !! null: by differences
      real(wp), pointer, contiguous :: rpar(:) => null()
      integer, pointer, contiguous :: ipar(:) => null()
   contains
      procedure :: rhs => ode_rhs
      procedure :: jacobian => ode_jacobian
   end type f77_ode

   type, extends(f77_output), public :: f77_ode_output
      procedure(f77_ode_out), pointer, nopass :: ode_out_external => null()
   contains
      procedure :: record => ode_output_record
   end type f77_ode_output

   ! Places in IOPT and ROPT, see the prologue of DSBINT
   integer, parameter :: at_halves = 5, at_forward = 6, at_backward = 7, at_share = 8, at_control = 9, &
      & at_safety = 10, at_listing = 11, at_jacobian = 16, at_given = 20
   integer, parameter :: at_every = 1, at_alpha = 1, at_step_tolerance = 2, at_longest = 4
   integer, parameter :: most_order = 5

contains

   recursive subroutine ode_rhs(self, t, y, f, ierr)
      class(f77_ode), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      call self%rhs_external(self%n, t, y, f, self%rpar, self%ipar, ierr)
   end subroutine ode_rhs

   recursive subroutine ode_jacobian(self, t, y, jac, ierr)
      class(f77_ode), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(self%n)
      type(matrix_type), intent(inout) :: jac
      integer, intent(out) :: ierr
      ierr = 0
      if (associated(self%jacobian_external)) then
         call self%jacobian_external(self%n, t, y, jac%a, size(jac%a)/self%n, self%rpar, self%ipar, ierr)
      else
         call self%difference_jacobian(t, y, jac, ierr)
      end if
   end subroutine ode_jacobian

   !> A stop is passed on as a failure, since that ends a run
   recursive subroutine ode_output_record(self, state, status)
      class(f77_ode_output), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      integer :: stop_asked
      if (status%failed() .or. self%stopped) return
      stop_asked = 0
      call self%ode_out_external(self%n, state%t, state%y, state%a, self%rpar, self%ipar, stop_asked)
      self%stopped = stop_asked /= 0
      if (self%stopped) call status%set(dynstep_callback_failed, 'OUT asked to stop')
   end subroutine ode_output_record

   !> DSBINT
   recursive subroutine run_ode(n, f, jac, out, t, y, yp, tend, h, iopt, ropt, rpar, ipar, icnt, idid, message)
      integer, intent(in) :: n
      procedure(f77_rhs) :: f
      procedure(f77_jacobian) :: jac
      procedure(f77_ode_out) :: out
      real(wp), intent(inout) :: t, y(*), yp(*)
      real(wp), intent(in) :: tend, h
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      integer, intent(inout) :: icnt(*)
      integer, intent(out) :: idid
      character(len=*), intent(out) :: message
      type(f77_ode) :: sys
      type(f77_ode_output) :: output
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(control_type) :: control
      type(step_control_type), allocatable :: step_control     ! absent where steps have one length
      type(status_type) :: status
      logical :: wanted
      real(wp) :: span_h

      icnt(:10) = 0
      call describe_ode(n, f, jac, iopt, rpar, ipar, sys, status)
      call describe_backinterpolation(iopt, ropt, stepper, status)
      call describe_control(h, iopt, ropt, step_control, status)
      span_h = h
      ! the first step may be left to the library
      if (allocated(step_control) .and. ieee_is_finite(h)) then
         if (abs(h) <= 0.0_wp) span_h = sign(1.0_wp, tend - t)
      end if
      call describe_output(t, tend, span_h, iopt, ropt, control, wanted, status)
      if (allocated(step_control) .and. allocated(control%t_eval)) step_control%t_eval = control%t_eval
      if (.not. status%failed()) then
         output%ode_out_external => out
         call stepper%init(sys, status)
      end if
      call allocate_state(sys, state, status)
      if (.not. status%failed()) then
         state%t = t
         state%y = y(1:n)
         call start_and_integrate(sys, stepper, output, state, tend, control, wanted, rpar, ipar, status, &
            & step_control)
         if (stepper%is_started) then
            t = state%t
            y(1:n) = state%y
            yp(1:n) = state%a
         end if
      end if
      if (allocated(stepper)) call give_counts(stepper%count, icnt)
      idid = status%code
      message = status%message
   end subroutine run_ode

   !> The system, from subroutines and options
   recursive subroutine describe_ode(n, f, jac, iopt, rpar, ipar, sys, status)
      integer, intent(in) :: n
      procedure(f77_rhs) :: f
      procedure(f77_jacobian) :: jac
      integer, intent(in) :: iopt(*)
      real(wp), intent(inout), target :: rpar(*)
      integer, intent(inout), target :: ipar(*)
      type(f77_ode), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      call check_size(n, status)
      call check_structure('the Jacobian', at_jacobian, n, iopt, .false., status)
      if (status%failed()) return
      sys%n = n
      sys%rhs_external => f
      if (iopt(at_given) /= 0) sys%jacobian_external => jac
      sys%jacobian_kind = merge(kind_dense, iopt(at_jacobian), iopt(at_jacobian) == 0)
      sys%jacobian_kl = iopt(at_jacobian + 1)
      sys%jacobian_ku = iopt(at_jacobian + 2)
      sys%rpar => rpar(1:1)
      sys%ipar => ipar(1:1)
   end subroutine describe_ode

   recursive subroutine describe_backinterpolation(iopt, ropt, stepper, status)
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      class(stepper_type), allocatable, intent(out) :: stepper
      type(status_type), intent(inout) :: status
      type(method_settings) :: method
      logical :: in_range

      method%base = base_backinterpolation
      if (iopt(at_halves) < 0 .or. iopt(at_halves) > 1) call status%set(dynstep_invalid_input, 'IOPT('//text(at_halves) &
         & //') = '//text(iopt(at_halves))//', the halves, must be 0 (Taylor) or 1 (Fehlberg)')
      method%bi%halves = merge(halves_taylor, halves_fehlberg, iopt(at_halves) == 0)
      call take_order(at_forward, 'forward', iopt, method%bi%p, status)
      call take_order(at_backward, 'backward', iopt, method%bi%q, status)
      if (iopt(at_share) /= 0) then
         in_range = ieee_is_finite(ropt(at_alpha))
         if (in_range) in_range = ropt(at_alpha) >= 0.0_wp .and. ropt(at_alpha) <= 1.0_wp
         if (.not. in_range) call status%set(dynstep_invalid_input, 'ROPT('//text(at_alpha)//') = '//text(ropt(at_alpha)) &
            & //', ALPHA, must lie between 0 and 1')
         method%bi%alpha = ropt(at_alpha)
      end if
      call check_option(at_listing, 'the sign of the error estimate', 1, iopt, status)
      method%listing_sign = iopt(at_listing) /= 0
      call describe_newton(iopt, ropt, method%newton, status)
      if (.not. status%failed()) call build_method(method, stepper)
   end subroutine describe_backinterpolation

   !> Steps that follow the error estimate, where IOPT asks for them
   recursive subroutine describe_control(h, iopt, ropt, step_control, status)
      real(wp), intent(in) :: h                    !! first step, or 0
      integer, intent(in) :: iopt(*)
      real(wp), intent(in) :: ropt(*)
      type(step_control_type), allocatable, intent(out) :: step_control
      type(status_type), intent(inout) :: status
      call check_option(at_control, 'the control of the step', controller_pi, iopt, status)
      call check_option(at_safety, 'the place of 0.8', 1, iopt, status)
      if (status%failed() .or. iopt(at_control) == 0) return
      allocate (step_control)
      step_control%controller = merge(controller_standard, controller_pi, iopt(at_control) == controller_standard)
      step_control%safety_place = merge(safety_in_front, safety_inside, iopt(at_safety) == 0)
      step_control%h_first = h
      call check_not_negative(at_step_tolerance, 'the tolerance of steps', ropt, status)
      call check_not_negative(at_longest, 'the longest step', ropt, status)
      if (.not. status%failed() .and. abs(ropt(at_step_tolerance)) <= 0.0_wp) call status%set(dynstep_invalid_input, &
         & 'ROPT('//text(at_step_tolerance)//'), the tolerance of steps, must be given where IOPT('//text(at_control) &
         & //') = '//text(iopt(at_control)))
      step_control%tolerance = ropt(at_step_tolerance)
      step_control%h_max = ropt(at_longest)
      if (iopt(at_every) > 1) call status%set(dynstep_invalid_input, 'IOPT('//text(at_every)//') = '//text(iopt(at_every)) &
         & //': where the step is controlled, OUT is called at each step, 1, or at times, IOPT(2)')
   end subroutine describe_control

   !> 0 <= IOPT(at) <= most
   recursive subroutine check_option(at, name, most, iopt, status)
      integer, intent(in) :: at, most
      character(len=*), intent(in) :: name
      integer, intent(in) :: iopt(*)
      type(status_type), intent(inout) :: status
      if (iopt(at) >= 0 .and. iopt(at) <= most) return
      call status%set(dynstep_invalid_input, 'IOPT('//text(at)//') = '//text(iopt(at))//', '//name//', must be 0 to '//text(most))
   end subroutine check_option

   recursive subroutine take_order(at, direction, iopt, order, status)
      integer, intent(in) :: at
      character(len=*), intent(in) :: direction
      integer, intent(in) :: iopt(*)
      integer, intent(inout) :: order              !! the default on entry
      type(status_type), intent(inout) :: status
      if (iopt(at) < 0 .or. iopt(at) > most_order) then
         call status%set(dynstep_invalid_input, 'IOPT('//text(at)//') = '//text(iopt(at))//', the order of the half ' &
            & //direction//', must be 0 to '//text(most_order))
      else if (iopt(at) > 0) then
         order = iopt(at)
      end if
   end subroutine take_order
end module dynstep_f77_odes
