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
!>   The unknown is the increment D = Y - y.  The residual G(D) = D - (y_a - y) + (RK_q(t + h, y + D, ...) - (y + D)) is
!>   brought to zero by Broyden's method from B0 = P_q(-(1 - alpha) h J), J = df/dy, whose inverse is a sum over the poles of
!>   R; with another J than that of the solution the updates make up for the difference.  J is kept over steps while that
!>   goes well.  The stopping test is that of a Newton step, component by component: |G| itself cannot be made smaller than its
!>   rounding errors, which grow like (h |J|)^q.
module dynstep_backinterpolation
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: acceleration_solver
   use dynstep_broyden, only: broyden_type
   use dynstep_equilibrium, only: newton_options
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_pole_tangents, only: check_jacobian_kind, pole_tangents
   use dynstep_pole_stages, only: form_automatic
   use dynstep_polynomial, only: polynomial_value
   use dynstep_positive_zeros, only: positive_zeros
   use dynstep_rational, only: fehlberg_rational, most_degree, rational_type, taylor_rational
   use dynstep_rational_engine, only: is_linear, rational_engine
   use dynstep_runge_kutta_halves, only: formula_fehlberg, runge_kutta_half
   use dynstep_start_check, only: check_mechanical, check_size, check_start
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, dynstep_not_converged, status_type
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
      type(runge_kutta_half), private :: forward, backward
      type(rational_engine), allocatable, private :: linear    ! of a linear system, unless alpha = 1
      logical, private :: is_estimated = .true.                ! its last trial has an estimate
      type(acceleration_solver), allocatable, private :: solver
      type(pole_tangents), allocatable, private :: tangents
      type(broyden_type), private :: broyden
      type(state_type), private :: trial               ! of `advance`
      complex(wp), allocatable, private :: rho(:)      ! 1/D(z) = sum of rho_j/(z - p_j)
      complex(wp), allocatable, private :: tau(:)      ! R(z) - 1 = sum of tau_j z/(z - p_j)
      logical, private :: renews = .false.             ! J is to be made anew at the next step
      integer, private :: best = 0                     ! iterations that a step took with a J of its own
      real(wp), allocatable, private :: f0(:)          ! y' at the start of the step [state_size]
      real(wp), allocatable, private :: da(:)          ! y_a - y
      real(wp), allocatable, private :: ya(:)          ! y_a, and points of the iteration
      real(wp), allocatable, private :: d(:)           ! D
      real(wp), allocatable, private :: g(:)           ! increment of the backward half, residual
      real(wp), allocatable, private :: z(:)           ! step of the iteration
      real(wp), allocatable, private :: sizes(:)       ! of the components
      real(wp), allocatable, private :: f1(:)          ! y' at y_a, then sizes of the components
   contains
      procedure :: properties => bi_properties
      procedure :: init => bi_init
      procedure :: reset => bi_reset
      procedure :: start => bi_start
      procedure :: try_step => bi_try_step
      procedure :: advance => bi_advance
      procedure :: estimate_error => bi_estimate_error
      procedure :: needs_acceleration => bi_needs_acceleration
   end type backinterpolation_stepper

   !> Steps that Broyden's method remembers
   integer, parameter :: most_updates = 10

   !> A J that costs this many iterations more than a new one did is made anew at the next step
   integer, parameter :: patience = 2

   !> Up to this |h J| of the backward half an explicit half-step predicts Y
   real(wp), parameter :: explicit_below = 1.0_wp

   !> As in DYNSTEP_EQUILIBRIUM: a tenth of a unit round-off, so that an extrapolation may multiply what is left
   real(wp), parameter :: finest = 0.1_wp*epsilon(1.0_wp)

   !> A step of the iteration is rounding where B0^-1 makes one of a unit round-off of each term of G that is no
   !> shorter than this part of it.  Measured on stiff linear systems, h |J| = 200, where the unit gives 1e-8: 0.3 to 6
   real(wp), parameter :: rounding = 30.0_wp

   !> Rates above this one, and those of first steps, ask for that judgement
   real(wp), parameter :: stagnant = 0.9_wp

   !> Rounding errors above this one, relative to the state, are no solution
   real(wp), parameter :: most_rounding = 1.0e-6_wp

   !> Estimate of a linear step whose halves leave the range of numbers: a controlled run takes a shorter one
   real(wp), parameter :: no_estimate = 1.0e100_wp

   character(len=*), parameter :: advice = 'Stiff nonlinear problems: backinterpolation bears |h J| of some tens; p = q = 1 ' &
      & //'bears more, for mechanical systems take soi2'

   !> A step of the iteration that is so much longer than the first one leads nowhere
   real(wp), parameter :: divergence = 10.0_wp

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

   !> Where |R(i y)| exceeds 1 first: E(y^2) = |D(i y)|^2 - |N(i y)|^2 becomes negative
   recursive function limit_of(self) result(limit)
      class(backinterpolation_stepper), intent(in) :: self
      real(wp) :: limit
      type(rational_type) :: r
      type(status_type) :: status
      real(wp) :: c(0:most_degree), noise(0:most_degree)
      real(wp), allocatable :: crossings(:), touched(:)
      integer :: first_sign
      limit = -1.0_wp
      call check_options(self, status)
      call set_rational(self, r, status)
      if (status%failed()) return
      c = 0.0_wp
      noise = 0.0_wp
      call add_square(1.0_wp, r%den, c, noise)
      call add_square(-1.0_wp, r%num, c, noise)
      call positive_zeros(c, 64.0_wp*epsilon(1.0_wp)*noise, crossings, touched, first_sign)
      limit = huge(limit)
      if (size(crossings) > 0) limit = sqrt(crossings(1))
      if (first_sign < 0) limit = 0.0_wp
   end function limit_of

   !> c = c + factor*|a(i y)|^2 as a polynomial in y^2
   pure subroutine add_square(factor, a, c, noise)
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: a(0:)
      real(wp), intent(inout) :: c(0:), noise(0:)    !! coefficients, and the sums of the sizes of their terms
      integer :: j, k
      do j = 0, ubound(a, 1)
         do k = mod(j, 2), ubound(a, 1), 2
            c((j + k)/2) = c((j + k)/2) + factor*(-1)**((j - k)/2)*a(j)*a(k)
            noise((j + k)/2) = noise((j + k)/2) + abs(a(j)*a(k))
         end do
      end do
   end subroutine add_square

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
      if (allocated(self%tangents)) deallocate (self%tangents)
      if (allocated(self%linear)) deallocate (self%linear)
      allocate (self%solver)
      call self%solver%init(sys, status)
      if (is_linear(sys) .and. self%alpha < 1.0_wp) then
         allocate (self%linear)
         call self%linear%init(sys, self%r, form_automatic, status)
      else if (self%alpha < 1.0_wp .and. .not. status%failed()) then
         allocate (self%tangents)
         call self%tangents%init(sys, self%r%poles, status)
         call self%broyden%init(sys%state_size(), most_updates, status)
      end if
      call make_room(self, sys%state_size(), status)
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

   !> R, its partial fractions, and the half-steps
   recursive subroutine set_coefficients(self, state_size, status)
      class(backinterpolation_stepper), intent(inout) :: self
      integer, intent(in) :: state_size
      type(status_type), intent(inout) :: status
      complex(wp) :: slope, numerator
      type(rational_type) :: low
      integer :: j, k

      if (status%failed()) return
      if (self%halves == halves_fehlberg) then
         call self%forward%init(formula_fehlberg, state_size, status)
         call self%backward%init(formula_fehlberg, state_size, status)
      else
         if (self%alpha > 0.0_wp) call self%forward%init(self%p, state_size, status)
         if (self%alpha < 1.0_wp) call self%backward%init(self%q, state_size, status)
      end if
      call set_rational(self, self%r, status)
      ! the predictor has no polynomial part
      low = self%r
      low%p = min(low%p, low%q)
      if (status%failed()) return
      if (allocated(self%rho)) deallocate (self%rho, self%tau)
      allocate (self%rho(self%r%q), self%tau(self%r%q))
      do j = 1, self%r%q
         associate (poles => self%r%poles)
            slope = -1.0_wp/poles(j)
            do k = 1, self%r%q
               if (k /= j) slope = slope*((poles(k) - poles(j))/poles(k))
            end do
            numerator = polynomial_value(low%num(:low%p), poles(j))
            self%rho(j) = 1.0_wp/slope
            self%tau(j) = numerator/(poles(j)*slope)
         end associate
      end do
   end subroutine set_coefficients

   recursive subroutine make_room(self, n, status)
      class(backinterpolation_stepper), intent(inout) :: self
      integer, intent(in) :: n
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      if (allocated(self%f0)) deallocate (self%f0, self%da, self%ya, self%d, self%g, self%z, self%sizes, self%f1)
      allocate (self%f0(n), self%da(n), self%ya(n), self%d(n), self%g(n), self%z(n), self%sizes(n), self%f1(n), &
         & source=0.0_wp, stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the steps of a state of '//text(n)//' numbers')
   end subroutine make_room

   pure subroutine bi_reset(self)
      class(backinterpolation_stepper), intent(inout) :: self
      call self%count%zero()
      if (allocated(self%solver)) call self%solver%forget()
      if (allocated(self%tangents)) call self%tangents%forget()
      if (allocated(self%linear)) call self%linear%forget()
      self%is_estimated = .true.
      self%renews = .false.
      self%best = 0
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
      if (.not. status%failed() .and. self%alpha >= 1.0_wp .and. self%forward%needs_end) then
         call derivative_of(sys, trial, self%f1)
         call self%forward%end_derivative(self%f1)
      end if
      if (.not. status%failed() .and. allocated(self%linear)) call estimate_linear(self, sys, state, h, trial)
   end subroutine bi_try_step

   !> Both halves of a linear step, for the estimate of its error.  Where they leave the range of numbers, there is none.
   recursive subroutine estimate_linear(self, sys, state, h, trial)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state, trial
      real(wp), intent(in) :: h
      type(status_type) :: status
      self%da = 0.0_wp
      if (self%alpha > 0.0_wp) call self%forward%run(sys, state%t, state%y, self%alpha*h, self%solver, self%da, self%count, status)
      call self%backward%run(sys, trial%t, trial%y, (self%alpha - 1.0_wp)*h, self%solver, self%g, self%count, status)
      self%ya = state%y + self%da
      if (self%backward%needs_end .or. self%forward%needs_end) call self%solver%derivative(sys, state%t + self%alpha*h, &
         & self%ya, self%f1, self%count, status)
      self%is_estimated = .not. status%failed()
      if (status%failed()) return
      if (self%alpha > 0.0_wp .and. self%forward%needs_end) call self%forward%end_derivative(self%f1)
      if (self%backward%needs_end) call self%backward%end_derivative(self%f1)
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
      if (allocated(self%linear)) then
         call self%linear%step(sys, state%t, h, t1, state%y, self%d, self%count, status)
         if (.not. status%failed()) trial%y = state%y + self%d
         return
      end if
      call derivative_of(sys, state, self%f0)
      self%da = 0.0_wp
      if (self%alpha > 0.0_wp) call self%forward%run(sys, state%t, state%y, self%alpha*h, self%solver, self%da, self%count, &
         & status, self%f0)
      if (status%failed()) return
      if (self%alpha >= 1.0_wp) then
         self%d = self%da
      else
         call backward_half(self, sys, state, h, t1, status)
      end if
      if (.not. status%failed()) trial%y = state%y + self%d
   end subroutine one_step

   !> D, with a J that is at hand, or else one of this step
   recursive subroutine backward_half(self, sys, state, h, t1, status)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(status_type), intent(inout) :: status
      logical :: is_new
      integer :: iterations

      is_new = .false.
      if (self%renews .or. .not. self%tangents%is_known) then
         call self%tangents%evaluate(sys, state%t, state%y, state%a, self%count, status)
         is_new = .true.
      end if
      do
         call self%tangents%factorize(h, state%t, self%count, status)
         call predict(self, sys, state, h, t1, status)
         call iterate(self, sys, state%y, h, t1, iterations, status)
         if (.not. status%failed()) exit
         self%renews = .true.
         if (is_new .or. .not. status%retry .or. self%tangents%is_constant) return
         call status%clear()
         call self%tangents%evaluate(sys, state%t, state%y, state%a, self%count, status)
         is_new = .true.
      end do
      if (is_new) self%best = iterations
      self%renews = iterations > self%best + patience .and. .not. self%tangents%is_constant
   end subroutine backward_half

   !> A first D.  Where |h J| is small, by a step of the backward half's formula from y_a on; else by
   !> R(z) y - y = sum of tau_j (z - p_j)^-1 z y with h y' for z y, which is exact where y' = J y.
   recursive subroutine predict(self, sys, state, h, t1, status)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(status_type), intent(inout) :: status
      real(wp) :: rest, stiffness, t_a
      logical :: is_needed

      if (status%failed()) return
      rest = (1.0_wp - self%alpha)*h
      stiffness = self%tangents%stiffness(rest)
      t_a = t1 - rest
      is_needed = stiffness <= explicit_below
      if (is_needed .or. self%backward%needs_end .or. (self%alpha > 0.0_wp .and. self%forward%needs_end)) then
         if (self%alpha > 0.0_wp) then
            self%ya = state%y + self%da
            call self%solver%derivative(sys, t_a, self%ya, self%f1, self%count, status)
         else
            self%ya = state%y
            self%f1 = self%f0
         end if
         if (status%failed()) return
         if (self%alpha > 0.0_wp .and. self%forward%needs_end) call self%forward%end_derivative(self%f1)
         if (self%backward%needs_end) call self%backward%end_derivative(self%f1)
      end if
      if (is_needed) then
         call self%backward%run(sys, t_a, self%ya, rest, self%solver, self%d, self%count, status, self%f1)
         self%d = self%da + self%d
      else
         self%g = h*self%f0
         call self%tangents%apply(self%tau, self%g, self%d, self%count)
      end if
      if (.not. status%failed()) call take_sizes(sys%n, state%y, self%d, self%f0, merge(h, 0.0_wp, stiffness <= explicit_below), &
         & self%sizes)
   end subroutine predict

   !> What the steps of the iteration are compared with: y, and what it changes by in a step h that is not stiff, so that
   !> components may pass through zero
   pure subroutine take_sizes(n, y, d, f, h, sizes)
      integer, intent(in) :: n                       !! length of a block of components of one kind
      real(wp), intent(in) :: y(:), d(:), f(:)       !! state, its predicted change, y' [state_size]: one block or two
      real(wp), intent(in) :: h                      !! or 0
      real(wp), intent(out) :: sizes(:)
      real(wp) :: largest
      integer :: first
      do first = 1, size(y), n
         associate (s => sizes(first:first + n - 1))
            s = max(abs(y(first:first + n - 1)), abs(d(first:first + n - 1)), abs(h*f(first:first + n - 1)))
            largest = maxval(s)
            if (largest > tiny(1.0_wp)/epsilon(1.0_wp)**3) then
               s = max(s, 1.0e-30_wp*largest)
            else
               s = 1.0_wp
            end if
         end associate
      end do
   end subroutine take_sizes

   !> Broyden's iteration for D from the predicted one
   recursive subroutine iterate(self, sys, y, h, t1, iterations, status)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: y(:)
      real(wp), intent(in) :: h, t1
      integer, intent(out) :: iterations             !! steps that were taken
      type(status_type), intent(inout) :: status
      real(wp) :: length, first, previous, rate, noise
      integer :: halvings
      logical :: is_measured

      iterations = 0
      if (status%failed()) return
      call self%broyden%forget()
      self%z = self%d
      is_measured = .false.
      halvings = 0
      previous = 0.0_wp
      first = 0.0_wp
      length = 0.0_wp
      do while (iterations < self%newton%limit)
         call residual(self, sys, y, h, t1, status)
         if (status%failed()) then
            ! out of the domain: half of the way there
            if (.not. status%retry .or. halvings == self%newton%halvings) return
            call status%clear()
            halvings = halvings + 1
            self%count%halvings = self%count%halvings + 1
            self%z = 0.5_wp*self%z
            self%d = self%d - self%z
            call self%broyden%forget()
            is_measured = .false.
            cycle
         end if
         iterations = iterations + 1
         self%count%newton_iterations = self%count%newton_iterations + 1
         call self%tangents%apply(self%rho, self%g, self%z, self%count)
         self%z = -self%z/self%sizes
         if (.not. is_moderate(self%z)) exit
         call self%broyden%next(self%z)
         self%z = self%z*self%sizes
         length = maxval(abs(self%z)/max(abs(self%d), self%sizes))
         rate = 1.0_wp
         if (is_measured .and. length < previous) rate = length/previous
         if (rate > stagnant) then
            call rounding_of_step(self, sys%n, y, h, noise)
            if (noise > 0.0_wp) then
               ! where a unit is many eps, the step may be worse than what there is
               if (noise <= rounding*epsilon(1.0_wp)) self%d = self%d + self%z
               if (noise <= max(most_rounding, self%newton%tolerance)) return
               call status%set(dynstep_not_converged, 'rounding errors of the backward half-step to t = '//text(t1) &
                  & //' over h = '//text(h)//' are '//text(noise)//' of the state; reduce h.  '//trim(advice), retry=.true.)
               return
            end if
         end if
         self%d = self%d + self%z
         if (rate*length <= max(self%newton%tolerance, finest)) return
         if (.not. is_measured) first = length
         if (length > divergence*first) exit
         previous = length
         is_measured = .true.
      end do
      call status%set(dynstep_not_converged, 'the backward half-step to t = '//text(t1)//' over h = '//text(h) &
         & //' was not solved in '//text(iterations)//' iterations; reduce h.  '//trim(advice), retry=.true.)
   end subroutine iterate

   !> Where the step z of the iteration is but rounding, of the residual or of the solution of its systems: how much that
   !> is, relative to the state; else 0
   recursive subroutine rounding_of_step(self, n, y, h, noise)
      class(backinterpolation_stepper), intent(inout) :: self
      integer, intent(in) :: n                       !! length of a block of components
      real(wp), intent(in) :: y(:), h
      real(wp), intent(out) :: noise
      real(wp) :: least, length, unit
      integer :: i
      noise = 0.0_wp
      least = epsilon(1.0_wp)*max(1.0_wp, self%tangents%stiffness(h))
      self%g = abs(y) + abs(self%d)
      call self%backward%add_terms(self%g)
      if (self%alpha > 0.0_wp) call self%forward%add_terms(self%g)
      self%g = epsilon(1.0_wp)*self%g
      self%f1 = max(self%sizes, abs(self%d))
      length = largest_of_block(n, self%z, self%f1)
      if (length > rounding*max(least, largest_of_block(n, self%g, self%f1))) return
      ! sizes and signs that no eigenvector is likely to have
      do i = 1, size(self%g)
         self%g(i) = self%g(i)*((-1)**i*(0.5_wp + real(mod(7*i, 11), wp)/11.0_wp))
      end do
      call self%tangents%apply(self%rho, self%g, self%ya, self%count)
      unit = max(least, largest_of_block(n, self%ya, self%f1))
      if (length <= rounding*unit) noise = unit
   end subroutine rounding_of_step

   !> Steps that can be squared
   pure logical function is_moderate(z)
      real(wp), intent(in) :: z(:)
      integer :: i
      is_moderate = .false.
      do i = 1, size(z)
         if (.not. ieee_is_finite(z(i))) return
         if (abs(z(i)) > 1.0e100_wp) return
      end do
      is_moderate = .true.
   end function is_moderate

   !> The largest component of a step in proportion to the largest size of its block
   pure real(wp) function largest_of_block(n, z, sizes) result(largest)
      integer, intent(in) :: n
      real(wp), intent(in) :: z(:), sizes(:)
      integer :: first
      largest = 0.0_wp
      do first = 1, size(z), n
         largest = max(largest, maxval(abs(z(first:first + n - 1)))/maxval(sizes(first:first + n - 1)))
      end do
   end function largest_of_block

   !> g = G(D)
   recursive subroutine residual(self, sys, y, h, t1, status)
      class(backinterpolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: y(:)
      real(wp), intent(in) :: h, t1
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      self%ya = y + self%d
      call self%backward%run(sys, t1, self%ya, (self%alpha - 1.0_wp)*h, self%solver, self%g, self%count, status)
      self%g = (self%d - self%da) + self%g
   end subroutine residual

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
   !> Others: the sum of the sizes of both, as those of odd embedded orders would cancel at alpha = 1/2.
   recursive subroutine bi_estimate_error(self, error)
      class(backinterpolation_stepper), intent(in) :: self
      real(wp), intent(out) :: error(:)              !! [state_size]
      error = merge(0.0_wp, no_estimate, self%is_estimated)
      if (.not. self%is_estimated) return
      if (self%halves == halves_taylor) then
         if (self%alpha > 0.0_wp) call self%forward%add_error_size(error)
         if (self%alpha < 1.0_wp) call self%backward%add_error_size(error)
      else
         if (self%alpha > 0.0_wp) call self%forward%add_error(1.0_wp, error)
         ! the backward half ran over -(1 - alpha) h
         if (self%alpha < 1.0_wp) call self%backward%add_error(merge(1.0_wp, -1.0_wp, self%listing_sign), error)
         if (self%listing_sign) error = abs(error)
      end if
   end subroutine bi_estimate_error

   !> A linear step reads y alone
   pure logical function bi_needs_acceleration(self)
      class(backinterpolation_stepper), intent(in) :: self
      bi_needs_acceleration = .not. allocated(self%linear)
   end function bi_needs_acceleration
end module dynstep_backinterpolation
