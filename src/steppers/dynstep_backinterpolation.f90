! SPDX-License-Identifier: BSD-3-Clause
!> Backinterpolation (Xie 1995, sections 2.3-2.5 and 3.5): a step of length h runs an explicit Runge-Kutta half-step forward
!> over alpha h, and looks for the state Y at its end from which another one, run backward over (1 - alpha) h, leads to the
!> same point.
!>
!>   y_a = RK_p(t, y, alpha h),   RK_q(t + h, Y, -(1 - alpha) h) = y_a
!>
!> On y' = l y: R(z) = P_p(alpha z)/P_q(-(1 - alpha) z), z = h l.
!>
!> PROGRAMMING INTERFACE
!>
!>     type(backinterpolation_stepper) :: stepper           ! p = q = 4, alpha = 1/2: symmetric, |R| = 1 on the imaginary axis
!>     stepper%q = 5
!>     stepper%alpha = 0.44_wp
!>
!>   alpha = 1 is explicit, alpha = 0 has no forward half.  p = q = 1 with alpha = 1/2 is the trapezoid, q = 1 with alpha = 0
!>   Euler's implicit formula.
!>
!>   Systems linear_system and linear_ode are stepped by DYNSTEP_RATIONAL_ENGINE: R(hA) y, no iteration, the forcing to full
!>   order.  There the estimate of the error costs the evaluations of both halves, and `advance` leaves it out.
!>
!>   Elsewhere Y is found by DYNSTEP_HALF_STEPS: Broyden's method with a Jacobian that is kept over steps.
module dynstep_backinterpolation
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: acceleration_solver
   use dynstep_archive, only: archive_type
   use dynstep_equilibrium, only: newton_options
   use dynstep_half_steps, only: half_steps
   use dynstep_imaginary_limit, only: imaginary_limit
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_pole_tangents, only: check_jacobian_kind
   use dynstep_pole_stages, only: form_automatic
   use dynstep_rational, only: fehlberg_rational, rational_type, taylor_rational
   use dynstep_rational_engine, only: is_linear, rational_engine
   use dynstep_runge_kutta_halves, only: formula_fehlberg
   use dynstep_start_check, only: check_mechanical, check_size, check_start
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_stepper, only: allocate_state, clock_type, method_properties, state_type, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   integer, parameter, public :: halves_taylor = 1      !! orders p forward and q backward
   integer, parameter, public :: halves_fehlberg = 2    !! RKF45's fifth order both ways, as in the thesis's listings

   type, extends(stepper_type), public :: backinterpolation_stepper
      integer :: p = 4                         !! order of the forward half, 1 .. 5; not read for alpha = 0
      integer :: q = 4                         !! order of the backward half, 1 .. 5; not read for alpha = 1
      real(wp) :: alpha = 0.5_wp               !! part of the step that runs forward, 0 .. 1
      integer :: halves = halves_taylor        !! or halves_fehlberg, where p and q are not read
      type(newton_options) :: newton           !! limit of iterations, halvings of one that leads out of the domain, tolerance
      logical :: listing_sign = .false.        !! halves_fehlberg: error as printed, |forward - backward|, which nearly
                                               !! vanishes at alpha = 1/2; else the sum, which is the error
      type(rational_type), private :: r        ! R(z)
      real(wp), private :: made_for(4) = -1.0_wp   ! p, q, alpha, halves at `init`
      type(half_steps), private :: half                ! both halves, and the iteration for Y
      type(rational_engine), allocatable, private :: linear    ! of a linear system, unless alpha = 1
      logical, private :: is_estimated = .true.                ! its last trial has an estimate
      type(acceleration_solver), allocatable, private :: solver
      type(state_type), private :: trial               ! of `advance`
   contains
      procedure :: properties => bi_properties
      procedure :: init => bi_init
      procedure :: reset => bi_reset
      procedure :: start => bi_start
      procedure :: try_step => bi_try_step
      procedure :: advance => bi_advance
      procedure :: estimate_error => bi_estimate_error
      procedure :: needs_acceleration => bi_needs_acceleration
      procedure :: archive_parts => bi_archive_parts
   end type backinterpolation_stepper

   !> Estimate of a linear step whose halves leave the range of numbers: a controlled run takes a shorter one
   real(wp), parameter :: no_estimate = 1.0e100_wp

contains

   recursive function bi_properties(self) result(facts)
      class(backinterpolation_stepper), intent(in) :: self
      type(method_properties) :: facts
      integer :: p, q
      p = self%p
      q = self%q
      facts%name = 'backinterpolation'
      facts%source = 'Xie 1995, sections 2.4 and 2.5'
      if (self%halves == halves_fehlberg) then
         p = 5
         q = 5
         facts%source = 'Xie 1995, appendix A, listing bi45'
      end if
      if (.not. ieee_is_finite(self%alpha)) return
      if (.not. self%alpha < 1.0_wp) q = p
      if (.not. self%alpha > 0.0_wp) p = q
      facts%symmetric = p == q .and. .not. abs(self%alpha - 0.5_wp) > 0.0_wp
      facts%order = min(p, q)
      ! a symmetric method has an even order
      if (facts%symmetric) facts%order = facts%order + mod(facts%order, 2)
      facts%acceleration_order = facts%order
      facts%error_order = max(1, min(p, q) - 1)
      facts%stages = 0
      if (self%alpha > 0.0_wp) facts%stages = stages_of(p)
      if (self%alpha < 1.0_wp) facts%stages = facts%stages + stages_of(q)
      facts%stability_limit = limit_of(self)
   end function bi_properties

   !> Where |R(i y)| exceeds 1 first
   recursive function limit_of(self) result(limit)
      class(backinterpolation_stepper), intent(in) :: self
      real(wp) :: limit
      type(rational_type) :: r
      type(status_type) :: status
      limit = -1.0_wp
      call check_options(self, status)
      call set_rational(self, r, status)
      if (.not. status%failed()) limit = imaginary_limit(r)
   end function limit_of

   !> R of the options, which have been checked
   recursive subroutine set_rational(self, r, status)
      class(backinterpolation_stepper), intent(in) :: self
      type(rational_type), intent(out) :: r
      type(status_type), intent(inout) :: status
      if (self%halves == halves_fehlberg) then
         call fehlberg_rational(self%alpha, r, status)
      else
         call taylor_rational(merge(self%p, 0, self%alpha > 0.0_wp), merge(self%q, 0, self%alpha < 1.0_wp), self%alpha, &
            & r, status)
      end if
   end subroutine set_rational

   pure integer function stages_of(order)
      integer, intent(in) :: order
      stages_of = order
      if (order == 5) stages_of = 6
   end function stages_of

   recursive subroutine bi_init(self, sys, status)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      call self%note_init()
      call check_options(self, status)
      call check_system_kind(sys, status)
      if (status%failed()) return
      call set_coefficients(self, sys%state_size(), status)
      if (allocated(self%solver)) deallocate (self%solver)
      if (allocated(self%linear)) deallocate (self%linear)
      allocate (self%solver)
      call self%solver%init(sys, status)
      if (is_linear(sys) .and. self%alpha < 1.0_wp) then
         allocate (self%linear)
         call self%linear%init(sys, self%r, form_automatic, status)
      else if (self%alpha < 1.0_wp .and. .not. status%failed()) then
         call self%half%init_iteration(sys, self%r, status)
      end if
      if (.not. status%failed()) call self%note_init(sys)
      self%made_for = options_of(self)
      call self%reset()
   end subroutine bi_init

   pure function options_of(self) result(options)
      class(backinterpolation_stepper), intent(in) :: self
      real(wp) :: options(4)
      options = [real(self%p, wp), real(self%q, wp), self%alpha, real(self%halves, wp)]
   end function options_of

   recursive subroutine check_options(self, status)
      class(backinterpolation_stepper), intent(in) :: self
      type(status_type), intent(inout) :: status
      logical :: in_range
      if (status%failed()) return
      in_range = ieee_is_finite(self%alpha)
      if (in_range) in_range = self%alpha >= 0.0_wp .and. self%alpha <= 1.0_wp
      if (.not. in_range) then
         call status%set(dynstep_invalid_input, 'alpha = '//text(self%alpha)//' must lie between 0 and 1: the part ' &
            & //'of a step that runs forward')
      else if (self%halves /= halves_taylor .and. self%halves /= halves_fehlberg) then
         call status%set(dynstep_invalid_input, 'halves = '//text(self%halves)//' must be 1 (Taylor, orders p and q) or 2 ' &
            & //'(Fehlberg)')
      else if (self%halves == halves_taylor) then
         if (self%alpha > 0.0_wp .and. (self%p < 1 .or. self%p > 5)) call status%set(dynstep_invalid_input, 'p = ' &
            & //text(self%p)//' must lie between 1 and 5: the order of the forward half')
         if (self%alpha < 1.0_wp .and. (self%q < 1 .or. self%q > 5)) call status%set(dynstep_invalid_input, 'q = ' &
            & //text(self%q)//' must lie between 1 and 5: the order of the backward half')
      end if
      call self%newton%check(status)
   end subroutine check_options

   recursive subroutine check_system_kind(sys, status)
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      call check_size(sys, status)
      select type (sys)
      class is (mechanical_system)
         call check_mechanical('backinterpolation', sys, status, takes_coupling=.true.)
      class default
         call check_jacobian_kind(sys, status)
      end select
   end subroutine check_system_kind

   !> R and the half-steps
   recursive subroutine set_coefficients(self, state_size, status)
      class(backinterpolation_stepper), intent(inout) :: self
      integer, intent(in) :: state_size
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      if (self%halves == halves_fehlberg) then
         call self%half%init(self%alpha, formula_fehlberg, formula_fehlberg, state_size, status)
      else
         call self%half%init(self%alpha, self%p, self%q, state_size, status)
      end if
      call set_rational(self, self%r, status)
   end subroutine set_coefficients

   pure subroutine bi_reset(self)
      class(backinterpolation_stepper), intent(inout) :: self
      call self%count%zero()
      if (allocated(self%solver)) call self%solver%forget()
      call self%half%forget()
      if (allocated(self%linear)) call self%linear%forget()
      self%is_estimated = .true.
   end subroutine bi_reset

   recursive subroutine bi_start(self, sys, state, status)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      logical :: is_changed

      call check_start(self, sys, state, status)
      call check_options(self, status)
      if (status%failed()) return
      is_changed = any(abs(options_of(self) - self%made_for) > 0.0_wp)
      if (is_changed) then
         call status%set(dynstep_invalid_input, 'p, q, alpha or halves were changed after init; call init again')
         return
      end if
      call self%reset()
      call self%solver%complete(sys, state, self%count, status)
      self%is_started = .not. status%failed()
   end subroutine bi_start

   recursive subroutine bi_try_step(self, sys, state, h, t1, trial, status)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status
      call one_step(self, sys, state, h, t1, trial, status)
      call self%solver%complete(sys, trial, self%count, status)
      if (.not. status%failed() .and. self%alpha >= 1.0_wp .and. self%half%forward%needs_end) then
         call derivative_of(sys, trial, self%half%f1)
         call self%half%forward%end_derivative(self%half%f1)
      end if
      if (status%failed()) return
      if (allocated(self%linear)) call estimate_linear(self, sys, state, h, trial, status)
      if (self%alpha > 0.0_wp .and. self%alpha < 1.0_wp .and. self%is_estimated .and. .not. status%failed()) then
         call derivative_of(sys, state, self%half%f0)
         call derivative_of(sys, trial, self%half%f1)
         if (allocated(self%linear)) self%half%d = trial%y - state%y
         call self%half%look(h, self%half%d, self%half%f0, self%half%f1)
      end if
   end subroutine bi_try_step

   !> Both halves of a linear step, for the estimate of its error.  Where they leave the range of numbers, there is none.
   recursive subroutine estimate_linear(self, sys, state, h, trial, status)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state, trial
      real(wp), intent(in) :: h
      type(status_type), intent(inout) :: status         !! failed where a load refuses
      type(status_type) :: own
      associate (half => self%half, forward => self%half%forward, backward => self%half%backward)
         half%da = 0.0_wp
         if (self%alpha > 0.0_wp) call forward%run(sys, state%t, state%y, self%alpha*h, self%solver, half%da, self%count, own)
         call backward%run(sys, trial%t, trial%y, (self%alpha - 1.0_wp)*h, self%solver, half%d, self%count, own)
         half%ya = state%y + half%da
         if (backward%needs_end .or. forward%needs_end) call self%solver%derivative(sys, state%t + self%alpha*h, half%ya, &
            & half%f1, self%count, own)
         self%is_estimated = .not. own%failed()
         if (own%code == dynstep_callback_failed) status = own
         if (own%failed()) return
         if (self%alpha > 0.0_wp .and. forward%needs_end) call forward%end_derivative(half%f1)
         if (backward%needs_end) call backward%end_derivative(half%f1)
      end associate
   end subroutine estimate_linear

   !> y' of a state that is complete
   recursive subroutine derivative_of(sys, state, f)
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(inout) :: f(:)                !! [state_size]
      select type (sys)
      class is (mechanical_system)
         f(1:sys%n) = state%y(sys%n + 1:)
         f(sys%n + 1:) = state%a
      class default
         f = state%a
      end select
   end subroutine derivative_of

   !> Time and y of the trial
   recursive subroutine one_step(self, sys, state, h, t1, trial, status)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      trial%t = t1
      associate (half => self%half)
         if (allocated(self%linear)) then
            call self%linear%step(sys, state%t, h, t1, state%y, half%d, self%count, status)
         else
            call derivative_of(sys, state, half%f0)
            half%da = 0.0_wp
            if (self%alpha > 0.0_wp) call half%forward%run(sys, state%t, state%y, self%alpha*h, self%solver, half%da, &
               & self%count, status, half%f0)
            if (self%alpha < 1.0_wp) then
               call half%find(sys, state, h, t1, self%solver, self%newton, self%count, status)
            else
               half%d = half%da
            end if
         end if
         if (.not. status%failed()) trial%y = state%y + half%d
      end associate
   end subroutine one_step

   !> `steps` steps of length clock%h; y' at the end of the last one where it is wanted
   recursive subroutine bi_advance(self, sys, state, clock, steps, status, complete)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps
      type(status_type), intent(inout) :: status
      logical, intent(in) :: complete
      type(status_type) :: own
      integer :: i

      if (status%failed()) return
      call allocate_state(sys, self%trial, status)
      do i = 1, steps
         if (allocated(self%linear)) then
            call one_step(self, sys, state, clock%h, clock%time(1), self%trial, status)
            if (complete .and. i == steps) call self%solver%complete(sys, self%trial, self%count, status)
         else if (complete .or. i < steps) then
            call self%try_step(sys, state, clock%h, clock%time(1), self%trial, status)
         else
            call one_step(self, sys, state, clock%h, clock%time(1), self%trial, status)
         end if
         if (status%failed()) exit
         call self%accept(state, self%trial)
         clock%k = clock%k + 1
      end do
      ! a failed run ends on a state whose acceleration was left out
      if (status%failed() .and. i > 1 .and. complete .and. allocated(self%linear)) &
         & call self%solver%complete(sys, state, self%count, own)
   end subroutine bi_advance

   !> Of the last trial.  Fehlberg's halves: the sum (or, as listed, the difference) of what their fourth orders differ by.
   !> Others: the sum of the sizes of both, as those of odd embedded orders would cancel at alpha = 1/2, and of what they do
   !> not see.
   recursive subroutine bi_estimate_error(self, error)
      class(backinterpolation_stepper), intent(in) :: self
      real(wp), intent(out) :: error(:)              !! [state_size]
      error = merge(0.0_wp, no_estimate, self%is_estimated)
      if (.not. self%is_estimated) return
      if (self%halves == halves_taylor) then
         if (self%alpha > 0.0_wp) call self%half%forward%add_error_size(error)
         if (self%alpha < 1.0_wp) call self%half%backward%add_error_size(error)
         error = error + abs(self%half%bend)
      else
         if (self%alpha > 0.0_wp) call self%half%forward%add_error(1.0_wp, error)
         ! the backward half ran over -(1 - alpha) h
         if (self%alpha < 1.0_wp) call self%half%backward%add_error(merge(1.0_wp, -1.0_wp, self%listing_sign), error)
         if (self%listing_sign) error = abs(error)
      end if
   end subroutine bi_estimate_error

   !> A linear step reads y alone
   pure logical function bi_needs_acceleration(self)
      class(backinterpolation_stepper), intent(in) :: self
      bi_needs_acceleration = .not. allocated(self%linear)
   end function bi_needs_acceleration

   recursive subroutine bi_archive_parts(self, file)
      class(backinterpolation_stepper), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%expect('p', self%p)
      call file%expect('q', self%q)
      call file%expect('alpha', self%alpha)
      call file%expect('halves', self%halves)
      call file%expect('is_linear', allocated(self%linear))
      call self%newton%archive('newton', file)
      call self%half%archive('half', file)
      if (allocated(self%linear)) call self%linear%archive('linear', file)
      call self%solver%archive('solver', file)
   end subroutine bi_archive_parts
end module dynstep_backinterpolation
