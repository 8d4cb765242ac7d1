! SPDX-License-Identifier: BSD-3-Clause
!> generalized-alpha-SOI2 (Jay & Negrut 2008, eqs. (13) and (14)): M(t,q) q'' = f + r with holonomic
!> constraints g = 0 and g' = 0, nonholonomic constraints k = 0, and steps that vary; of second order in
!> positions, velocities, accelerations and multipliers.
!>
!> PROGRAMMING INTERFACE
!>
!>     type(soi2_stepper) :: stepper                         ! rho_inf = 0.8
!>     call coefficients_of(0.5_wp, stepper%coefficients, status)
!>     stepper%start_mode = start_refuse
!>
!>   Any step may have a length of its own.  What a change of length does to a_alpha and M_alpha a_alpha
!>   is (14a) and (14b), from the values that the last accepted step left.  A step may be longer than the one before it
!>   by less than properties()%step_growth_limit = 2/(1 - rho_inf), many times over.
!>
!>   Steps may be chosen by their error: estimate_larger, estimate_projected or estimate_raw, see dynstep_soi2_estimate.
!>
!>   state%a is the acceleration at state%t, to second order: a_{n+alpha} - alpha (a_{n+alpha} - a_{n-1+alpha}).
!>   last_a_alpha() gives a_{n+alpha}, which belongs to t_n + alpha h.
!>
!>   A mass that depends on velocities is taken at v0 + (1 + alpha) h a_alpha, which is an extension of the paper.
module dynstep_soi2
   use dynstep_accelerations, only: check_callback
   use dynstep_alpha_coefficients, only: alpha_coefficients
   use dynstep_archive, only: archive_type
   use dynstep_consistent_start, only: consistent_start, start_keep, start_project, start_refuse, start_report
   use dynstep_equilibrium, only: newton_options
   use dynstep_error_norm, only: error_norm_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_identity, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_soi2_equations, only: soi2_equations, variant_index3, variant_reduced, variant_soi2
   use dynstep_soi2_estimate, only: estimate_larger, estimate_projected, estimate_raw, multiplier_part, raw_errors, &
      & soi2_estimate
   use dynstep_soi2_history, only: history_type
   use dynstep_soi2_iteration, only: soi2_iteration
   use dynstep_start_check, only: check_mechanical, check_start
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_converged, dynstep_not_finite, status_type
   use dynstep_stepper, only: allocate_state, clock_type, method_properties, state_type, stepper_type, swap_states, &
      & verdict_type
   use dynstep_text, only: text
   implicit none
   private

   public :: variant_soi2, variant_reduced, variant_index3
   public :: start_project, start_refuse, start_keep, start_report
   public :: estimate_larger, estimate_projected, estimate_raw

   integer, parameter, public :: mass_stored = 1       !! M_alpha of a step is M_{1+alpha} of the one before, with (14b)
   integer, parameter, public :: mass_recomputed = 2   !! M_alpha = M(t_alpha, y0 + h alpha z0)

   !> A step is divided into 2**10 parts at most: what needs more is not a matter of step length
   integer, parameter :: most_halvings = 10

   type, extends(stepper_type), public :: soi2_stepper
      type(alpha_coefficients) :: coefficients         !! those of rho_inf = 0.8
      integer :: variant = variant_soi2                !! variant_soi2, variant_reduced or variant_index3
      integer :: mass_at = mass_stored                 !! mass_stored or mass_recomputed
      logical :: adjust_acceleration = .true.          !! (14a); .false. shows what it is for (figure 2)
      logical :: adjust_momentum = .true.              !! (14b)
      logical :: second_order_start = .true.           !! a_alpha of the first step to O(h^2); .false.: a_alpha = a0
      integer :: estimate = estimate_larger            !! estimate_larger, estimate_projected or estimate_raw
      integer :: start_mode = start_project            !! what to do with a start that is off the constraints
      type(newton_options) :: newton                   !! limit, tolerance; halvings: of a step of `advance`
      type(start_report) :: report                     !! what `start` found and moved
      type(soi2_equations), allocatable, private :: eqs
      type(soi2_iteration), allocatable, private :: iteration
      type(consistent_start), allocatable, private :: consistency
      type(matrix_type), allocatable, private :: m_alpha
      type(state_type), private :: trial               ! of `advance`
      type(soi2_estimate), allocatable, private :: errors    ! of steps that are chosen by them
      type(history_type), private :: history(2)        ! of the last accepted step and of the last trial
      integer, private :: past = 1                     ! which of the two is that of the last accepted step
      logical, private :: knows_mass = .false.         ! a constant M was evaluated
      real(wp), allocatable, private :: a_alpha(:), ma_alpha(:), q_at(:), v_at(:), lambda_at(:), psi_at(:)
   contains
      procedure :: properties => soi2_properties
      procedure :: init => soi2_init
      procedure :: reset => soi2_reset
      procedure :: start => soi2_start
      procedure :: try_step => soi2_try_step
      procedure :: accept => soi2_accept
      procedure :: advance => soi2_advance
      procedure :: estimate_error => soi2_estimate_error
      procedure :: prepare_control => soi2_prepare_control
      procedure :: try_within => soi2_try_within
      procedure :: last_a_alpha => soi2_last_a_alpha
      procedure :: archive_parts => soi2_archive_parts
   end type soi2_stepper

   !> Nearer to 0 alpha has no digits to divide by
   real(wp), parameter :: smallest_alpha = 1.0e-3_wp

   !> estimate_larger: at least this part of the raw estimate.  Slider-crank with L2 = 1.001 L1, tolerances 1e-3 to 1e-8: with
   !> 0, 1/16, 1/8 and 1/4 steps pass over the nearly singular point onto the wrong branch at 1e-3; 1/2 and more stay.  Pendulum
   !> (16) at 1e-6: 975 steps with 0, 1050 with 1/2, 1112 with 3/4, 1185 with 1; they are worth their errors.
   real(wp), parameter :: part_of_raw = 0.75_wp

contains

   recursive function soi2_properties(self) result(facts)
      class(soi2_stepper), intent(in) :: self
      type(method_properties) :: facts
      select case (self%variant)
      case (variant_reduced)
         facts%name = 'soi2-reduced'
         facts%source = 'Jay & Negrut 2008, section 6'
      case (variant_index3)
         facts%name = 'generalized-alpha-index-3'
         facts%source = 'Negrut, Rampalli, Ottarsson, Sajdak 2007 (baseline)'
      case default
         facts%name = 'soi2'
         facts%source = 'Jay & Negrut 2008, eqs. (13), (14)'
      end select
      facts%order = self%coefficients%order()
      facts%acceleration_order = facts%order
      facts%multiplier_order = facts%order
      facts%error_order = facts%order
      facts%mechanical = .true.
      facts%stability_limit = self%coefficients%stability_limit()
      facts%step_growth_limit = self%coefficients%growth_limit()
   end function soi2_properties

   recursive subroutine soi2_init(self, sys, status)
      class(soi2_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      integer :: i

      if (status%failed()) return
      call self%note_init()
      call check_options(self, status)
      call check_mechanical('SOI2', sys, status, takes_constraints=.true.)
      if (status%failed()) return
      select type (sys)
      class is (mechanical_system)
         call check_for_constraints(self, sys, status)
         if (status%failed()) return
         if (allocated(self%eqs)) deallocate (self%eqs, self%iteration, self%consistency, self%m_alpha)
         allocate (self%eqs, self%iteration, self%consistency, self%m_alpha)
         self%eqs%coefficients = self%coefficients
         self%eqs%variant = self%variant
         self%iteration%limit = self%newton%limit
         self%iteration%tolerance = self%newton%tolerance
         call self%eqs%init(sys, status)
         call self%iteration%init(sys, self%eqs, status)
         call self%consistency%init(sys, status)
         associate (s => sys%structure)
            call self%m_alpha%init(s%mass, sys%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         end associate
         do i = 1, 2
            call self%history(i)%init(sys%n, sys%holonomic, sys%nonholonomic, size(self%eqs%motion%gq%value))
         end do
         if (allocated(self%a_alpha)) deallocate (self%a_alpha, self%ma_alpha, self%q_at, self%v_at, &
            & self%lambda_at, self%psi_at)
         associate (n => sys%n)
            allocate (self%a_alpha(n), self%ma_alpha(n), self%q_at(n), self%v_at(n), self%lambda_at(sys%holonomic), &
               & self%psi_at(sys%nonholonomic), source=0.0_wp)
         end associate
      end select
      if (.not. status%failed()) call self%note_init(sys)
   end subroutine soi2_init

   recursive subroutine check_options(self, status)
      class(soi2_stepper), intent(in) :: self
      type(status_type), intent(inout) :: status
      call self%coefficients%check(status)
      if (status%failed()) return
      if (self%variant < variant_soi2 .or. self%variant > variant_index3) then
         call status%set(dynstep_invalid_input, 'variant = '//text(self%variant)//' must be 1 (SOI2), 2 (reduced) or ' &
            & //'3 (index 3)')
      else if (self%mass_at < mass_stored .or. self%mass_at > mass_recomputed) then
         call status%set(dynstep_invalid_input, 'mass_at = '//text(self%mass_at)//' must be 1 (stored) or 2 (recomputed)')
      else if (self%start_mode < start_project .or. self%start_mode > start_keep) then
         call status%set(dynstep_invalid_input, 'start_mode = '//text(self%start_mode)//' must be 1 (project), 2 (refuse) ' &
            & //'or 3 (keep)')
      else if (self%estimate < estimate_larger .or. self%estimate > estimate_raw) then
         call status%set(dynstep_invalid_input, 'estimate = '//text(self%estimate)//' must be 1 (the larger), 2 (projected) ' &
            & //'or 3 (raw)')
      else
         call self%newton%check(status)
      end if
   end subroutine check_options

   !> beta and gamma carry the constraints (Theorem 1); the index-3 form has a = delta + a only
   recursive subroutine check_for_constraints(self, sys, status)
      class(soi2_stepper), intent(in) :: self
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      if (sys%holonomic + sys%nonholonomic == 0) return
      if (min(self%coefficients%beta, self%coefficients%gamma) <= 0.0_wp) call status%set(dynstep_invalid_input, &
         & 'constraints need beta > 0 and gamma > 0, not '//text(self%coefficients%beta)//' and ' &
         & //text(self%coefficients%gamma))
   end subroutine check_for_constraints

   pure subroutine soi2_reset(self)
      class(soi2_stepper), intent(inout) :: self
      call self%count%zero()
      self%history%is_there = .false.
      self%knows_mass = .false.
      if (.not. allocated(self%iteration)) return
      call self%iteration%forget()
      self%iteration%matrices%regularization = self%consistency%regularization
   end subroutine soi2_reset

   !> q and v onto the constraints, then a0, lambda0, psi0.  On entry state%lambda and state%psi are guesses for a
   !> general reaction that is not linear in them.
   recursive subroutine soi2_start(self, sys, state, status)
      class(soi2_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      real(wp), allocatable :: y(:)

      call check_start(self, sys, state, status)
      call check_options(self, status)
      if (status%failed()) return
      if (was_changed(self)) then
         call status%set(dynstep_invalid_input, 'the coefficients, the variant or the options of Newton''s iteration were ' &
            & //'changed after init; call init again')
         return
      end if
      call self%reset()
      self%is_started = .false.
      self%report = start_report()
      y = state%y
      select type (sys)
      class is (mechanical_system)
         associate (n => sys%n)
            call self%consistency%look_for_dependence(sys, state%t, y(1:n), y(n + 1:), self%report, self%count, status)
            call self%consistency%project(sys, self%start_mode, state%t, y(1:n), y(n + 1:), self%report, self%count, status)
            call self%consistency%solve(sys, state%t, y(1:n), y(n + 1:), state%a, state%lambda, state%psi, &
               & self%history(self%past)%f, self%report, self%count, status)
         end associate
      end select
      if (status%failed()) return
      state%y = y
      self%history(self%past)%gq = self%consistency%motion%gq%value
      self%iteration%matrices%regularization = self%consistency%regularization
      self%is_started = .true.
   end subroutine soi2_start

   !> What `init` took over has other values now
   pure logical function was_changed(self)
      class(soi2_stepper), intent(in) :: self
      associate (old => self%eqs%coefficients, new => self%coefficients)
         was_changed = any(abs([new%alpha_m - old%alpha_m, new%alpha_f - old%alpha_f, new%beta - old%beta, &
            & new%gamma - old%gamma, self%newton%tolerance - self%iteration%tolerance]) > 0.0_wp) &
            & .or. self%variant /= self%eqs%variant .or. self%newton%limit /= self%iteration%limit
      end associate
   end function was_changed

   recursive subroutine soi2_try_step(self, sys, state, h, t1, trial, status)
      class(soi2_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      trial%t = t1
      select type (sys)
      class is (mechanical_system)
         call old_acceleration(self, state, h)
         call one_step(self, sys, state, h, t1, status)
         if (self%second_order_start .and. .not. self%history(self%past)%is_there .and. abs(self%coefficients%alpha()) > 0.0_wp) &
            & call repeat_first_step(self, sys, state, h, t1, status)
         if (.not. status%failed()) call keep(self, state, trial)
      end select
   end subroutine soi2_try_step

   !> a_alpha by (14a)
   pure subroutine old_acceleration(self, state, h)
      class(soi2_stepper), intent(inout) :: self
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h
      associate (past => self%history(self%past))
         if (.not. past%is_there) then
            self%a_alpha = state%a
         else if (self%adjust_acceleration) then
            call past%adjusted_acceleration(self%coefficients%alpha(), h, self%a_alpha)
         else
            self%a_alpha = past%a
         end if
      end associate
   end subroutine old_acceleration

   !> The step with the a_alpha that is set
   recursive subroutine one_step(self, sys, state, h, t1, status)
      class(soi2_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      associate (eqs => self%eqs, c => self%coefficients, n => sys%n)
         eqs%t0 = state%t
         eqs%t1 = t1
         eqs%h = h
         eqs%b = c%beta*h**2
         eqs%c = c%gamma*h
         call take_masses(self, sys, state, h, status)
         if (status%failed()) return
         eqs%y0 = state%y(1:n)
         eqs%z0 = state%y(n + 1:)
         eqs%dy = h*(eqs%z0 + (h*(0.5_wp - c%beta))*self%a_alpha)
         eqs%dz = (h*(1.0_wp - c%gamma))*self%a_alpha
         eqs%w = c%alpha_m*self%ma_alpha - c%alpha_f*self%history(self%past)%f
         eqs%old_gq = self%history(self%past)%gq
         call self%history(self%past)%predict(c%alpha(), h, state, self%a_alpha, eqs)
         call self%iteration%solve(sys, eqs, self%count, status)
         if (status%failed()) return
         call eqs%place()
         call self%iteration%matrices%reduce_multipliers(eqs)
      end associate
   end subroutine one_step

   !> M_{1+alpha} and M_alpha a_alpha, the latter by (14b)
   recursive subroutine take_masses(self, sys, state, h, status)
      class(soi2_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h
      type(status_type), intent(inout) :: status
      real(wp) :: alpha, ratio

      alpha = self%coefficients%alpha()
      associate (past => self%history(self%past))
         if (.not. self%knows_mass) then
            call evaluate_mass(self, sys, state, (1.0_wp + alpha)*h, self%eqs%m1, status)
            if (status%failed()) return
            self%eqs%mass_size = largest_diagonal(self%eqs%m1)
         end if
         self%knows_mass = sys%structure%mass_is_constant
         self%ma_alpha = 0.0_wp
         if (sys%structure%mass_is_constant) then
            call self%eqs%m1%multiply_add(1.0_wp, self%a_alpha, self%ma_alpha)
         else if (self%mass_at == mass_stored .and. past%is_there) then
            ratio = alpha*(h/past%h - 1.0_wp)
            if (.not. self%adjust_momentum) ratio = 0.0_wp
            self%ma_alpha = past%ma + ratio*(past%ma - past%ma_used)
         else
            call evaluate_mass(self, sys, state, alpha*h, self%m_alpha, status)
            call self%m_alpha%multiply_add(1.0_wp, self%a_alpha, self%ma_alpha)
         end if
      end associate
   end subroutine take_masses

   !> M(t0 + s, y0 + s z0, z0 + s a_alpha); an identity is no matrix
   recursive subroutine evaluate_mass(self, sys, state, s, mass, status)
      class(soi2_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: s
      type(matrix_type), intent(inout) :: mass
      type(status_type), intent(inout) :: status
      integer :: ierr, row, column
      if (status%failed() .or. sys%structure%mass == kind_identity) return
      associate (n => sys%n)
         self%q_at = state%y(1:n) + s*state%y(n + 1:)
         self%v_at = state%y(n + 1:) + s*self%a_alpha
      end associate
      call mass%set_zero()
      call sys%mass(state%t + s, self%q_at, self%v_at, mass, ierr)
      self%count%masses = self%count%masses + 1
      call check_callback('mass', ierr, state%t + s, status)
      if (status%failed()) return
      call mass%first_not_finite(row, column)
      if (row > 0) call status%set(dynstep_not_finite, 'mass returned '//text(mass%entry(row, column))//' in row ' &
         & //text(row)//', column '//text(column)//' at t = '//text(state%t + s)//'; a smaller step may keep it in its ' &
         & //'domain', retry=.true.)
   end subroutine evaluate_mass

   pure real(wp) function largest_diagonal(mass)
      type(matrix_type), intent(in) :: mass
      integer :: i
      largest_diagonal = 0.0_wp
      do i = 1, mass%n
         largest_diagonal = max(largest_diagonal, abs(mass%entry(i, i)))
      end do
   end function largest_diagonal

   !> The first step again, with a_alpha = (1 - alpha) a0 + alpha a(t1), where a(t1) is consistent with the first
   !> result: a_alpha is then a(t0 + alpha h) + O(h^2) (section 2, after (8))
   recursive subroutine repeat_first_step(self, sys, state, h, t1, status)
      class(soi2_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(status_type), intent(inout) :: status
      type(start_report) :: report
      if (status%failed()) return
      associate (eqs => self%eqs, next => self%history(3 - self%past), alpha => self%coefficients%alpha())
         self%lambda_at = eqs%lambda
         self%psi_at = eqs%psi
         call self%consistency%solve(sys, t1, eqs%y1, eqs%z1, next%a, self%lambda_at, self%psi_at, next%f, report, &
            & self%count, status)
         self%a_alpha = state%a + alpha*(next%a - state%a)
         call one_step(self, sys, state, h, t1, status)
      end associate
   end subroutine repeat_first_step

   !> The trial point, and what the step would leave to the next one
   pure subroutine keep(self, state, trial)
      class(soi2_stepper), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(state_type), intent(inout) :: trial
      integer :: n
      n = size(self%a_alpha)
      associate (eqs => self%eqs, alpha => self%coefficients%alpha())
         trial%y(1:n) = eqs%y1
         trial%y(n + 1:) = eqs%z1
         trial%a = eqs%a - alpha*(eqs%a - self%a_alpha)
         trial%lambda = eqs%lambda
         trial%psi = eqs%psi
         call self%history(3 - self%past)%take(self%history(self%past), state, self%a_alpha, self%ma_alpha, eqs, &
            & self%second_order_start)
      end associate
   end subroutine keep

   !> e_y and e_z of the last trial as they are, along and across the constraints.  The first step after a start has no e_z.
   recursive subroutine soi2_estimate_error(self, error)
      class(soi2_stepper), intent(in) :: self
      real(wp), intent(out) :: error(:)            !! [2 n]
      real(wp) :: s(size(self%a_alpha))
      s = 0.0_wp
      associate (step => self%history(3 - self%past))
         if (step%has_bend) call step%second_derivative(s)
         call raw_errors(self%coefficients, step, s, error)
      end associate
   end subroutine soi2_estimate_error

   recursive subroutine soi2_prepare_control(self, sys, norm, status)
      class(soi2_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(error_norm_type), intent(in) :: norm
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      call norm%check(sys%state_size(), status)
      if (.not. allocated(self%errors)) allocate (self%errors)
      select type (sys)
      class is (mechanical_system)
         call self%errors%init(sys, status)
      end select
   end subroutine soi2_prepare_control

   recursive subroutine soi2_try_within(self, sys, state, h, t1, norm, trial, verdict, status)
      class(soi2_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(error_norm_type), intent(in) :: norm
      type(state_type), intent(inout) :: trial
      type(verdict_type), intent(out) :: verdict
      type(status_type), intent(inout) :: status
      real(wp) :: raw
      integer :: solves

      verdict%order = self%coefficients%order()
      verdict%error_order = verdict%order
      if (.not. allocated(self%errors)) call status%set(dynstep_invalid_input, 'steps are to be chosen by their error, but ' &
         & //'prepare_control was not called')
      call self%try_step(sys, state, h, t1, trial, status)
      if (status%failed()) return
      associate (step => self%history(3 - self%past), errors => self%errors)
         if (step%has_bend) then
            call step%second_derivative(errors%bend)
         else
            select type (sys)
            class is (mechanical_system)
               call bend_of_first_step(self, sys, state, trial, errors%bend, status)
            end select
         end if
         select type (sys)
         class is (mechanical_system)
            call self%iteration%matrices%prepare_projection(sys, self%eqs, self%count, status)
         end select
         if (status%failed()) return
         call errors%measure(self%eqs, step, self%iteration%matrices, solves)
         self%count%solves = self%count%solves + solves
         if (.not. errors%are_finite()) then
            call status%set(dynstep_not_finite, 'the step from t = '//text(state%t)//' leaves the range of numbers', &
               & retry=.true.)
            return
         end if
         call errors%larger_kind(norm, errors%raw, state%y, trial%y, raw)
         call errors%larger_kind(norm, errors%projected, state%y, trial%y, verdict%error)
         if (self%estimate == estimate_larger) verdict%error = max(verdict%error, raw*part_of_raw)
         if (self%estimate == estimate_raw) verdict%error = raw
         verdict%error = max(verdict%error, &
            & multiplier_part(norm, norm%atol_lambda, errors%lambda, state%lambda, trial%lambda), &
            & multiplier_part(norm, norm%atol_psi, errors%psi, state%psi, trial%psi))
      end associate
   end subroutine soi2_try_within

   !> a'' of a first step from consistent accelerations at its begin, middle and end.  Where the start is of second order
   !> that of the end is known; the middle is that of cubics through both ends.
   recursive subroutine bend_of_first_step(self, sys, state, trial, bend, status)
      class(soi2_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(state_type), intent(in) :: state, trial
      real(wp), intent(inout) :: bend(:)
      type(status_type), intent(inout) :: status
      real(wp) :: h
      if (status%failed()) return
      h = self%eqs%h
      associate (n => sys%n, alpha => self%coefficients%alpha(), x => self%errors)
         if (self%second_order_start .and. abs(alpha) > smallest_alpha) then
            bend = state%a + (self%a_alpha - state%a)/alpha
         else
            call consistent_acceleration(self, sys, trial%t, trial%y(1:n), trial%y(n + 1:), trial, bend, status)
         end if
         self%q_at = 0.5_wp*(state%y(1:n) + trial%y(1:n)) + (0.125_wp*h)*(state%y(n + 1:) - trial%y(n + 1:))
         self%v_at = 0.5_wp*(state%y(n + 1:) + trial%y(n + 1:)) + (0.125_wp*h)*(state%a - bend)
         call consistent_acceleration(self, sys, state%t + 0.5_wp*h, self%q_at, self%v_at, trial, x%middle, status)
         bend = (4.0_wp/h**2)*((state%a - x%middle) + (bend - x%middle))
      end associate
   end subroutine bend_of_first_step

   !> a of the equations of motion at (t, q, v), with the multipliers of a state near it as a guess
   recursive subroutine consistent_acceleration(self, sys, t, q, v, near, a, status)
      class(soi2_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t, q(:), v(:)
      type(state_type), intent(in) :: near
      real(wp), intent(inout) :: a(:)
      type(status_type), intent(inout) :: status
      type(start_report) :: report
      if (status%failed()) return
      self%lambda_at = near%lambda
      self%psi_at = near%psi
      call self%consistency%solve(sys, t, q, v, a, self%lambda_at, self%psi_at, self%errors%f, report, self%count, status)
   end subroutine consistent_acceleration

   recursive subroutine soi2_accept(self, state, trial)
      class(soi2_stepper), intent(inout) :: self
      type(state_type), intent(inout) :: state, trial
      call swap_states(self, state, trial)
      self%past = 3 - self%past
   end subroutine soi2_accept

   !> `steps` steps of length clock%h.  A step whose iteration does not converge is made of shorter ones, with (14) between
   !> them; counters tell: each of them is a sub-step, each refused length a rejection.
   recursive subroutine soi2_advance(self, sys, state, clock, steps, status, complete)
      class(soi2_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps
      type(status_type), intent(inout) :: status
      logical, intent(in) :: complete
      integer :: i

      if (status%failed()) return
      call allocate_state(sys, self%trial, status)
      do i = 1, steps
         call self%try_step(sys, state, clock%h, clock%time(1), self%trial, status)
         if (may_be_divided(self, status)) then
            call divided_step(self, sys, state, clock%h, clock%time(1), status)
         else if (.not. status%failed()) then
            call self%accept(state, self%trial)
         end if
         if (status%failed()) return
         clock%k = clock%k + 1
      end do
   end subroutine soi2_advance

   pure logical function may_be_divided(self, status)
      class(soi2_stepper), intent(in) :: self
      type(status_type), intent(in) :: status
      may_be_divided = status%code == dynstep_not_converged .and. status%retry .and. self%newton%halvings > 0
   end function may_be_divided

   !> One step from state%t to t1 = state%t + h as several shorter ones: halved until the iteration converges, doubled again
   !> where it did so twice, below the growth limit.  On failure everything is as it was.
   recursive subroutine divided_step(self, sys, state, h, t1, status)
      class(soi2_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: h, t1
      type(status_type), intent(inout) :: status
      type(state_type) :: begin
      type(history_type) :: left
      real(wp) :: length, rest
      integer :: successes

      begin = state
      left = self%history(self%past)
      self%count%steps = self%count%steps + 1
      length = h
      rest = h
      successes = 0
      do while (abs(rest) > 0.0_wp)
         if (status%failed()) then
            if (.not. may_be_divided(self, status) .or. &
               & abs(length) < 1.5_wp*abs(h)*0.5_wp**min(self%newton%halvings, most_halvings)) exit
            call status%clear()
            successes = 0
            length = 0.5_wp*length
            self%count%rejections = self%count%rejections + 1
         end if
         if (abs(rest) < 1.5_wp*abs(length)) length = rest
         rest = rest - length
         call self%try_step(sys, state, length, merge(state%t + length, t1, abs(rest) > 0.0_wp), self%trial, status)
         if (status%failed()) then
            rest = rest + length
            cycle
         end if
         call self%accept(state, self%trial)
         self%count%steps = self%count%steps - 1
         self%count%substeps = self%count%substeps + 1
         successes = successes + 1
         if (mod(successes, 2) == 0) length = min(2.0_wp, 0.9_wp*self%coefficients%growth_limit())*length
      end do
      if (.not. status%failed()) return
      state = begin
      self%history(self%past) = left
      self%count%steps = self%count%steps - 1
      status%message = trim(status%message)//' (parts of a step of '//text(h)//')'
   end subroutine divided_step

   !> a_{n+alpha} of the last accepted step, which belongs to t_n + alpha h
   pure subroutine soi2_last_a_alpha(self, a_alpha)
      class(soi2_stepper), intent(in) :: self
      real(wp), intent(out) :: a_alpha(:)
      a_alpha = self%history(self%past)%a
   end subroutine soi2_last_a_alpha

   !> The history of the last accepted step, and what the iteration keeps; that of the last trial is forgotten
   recursive subroutine soi2_archive_parts(self, file)
      class(soi2_stepper), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%expect('alpha_m', self%coefficients%alpha_m)
      call file%expect('alpha_f', self%coefficients%alpha_f)
      call file%expect('beta', self%coefficients%beta)
      call file%expect('gamma', self%coefficients%gamma)
      call file%expect('variant', self%variant)
      call file%expect('mass_at', self%mass_at)
      call file%expect('adjust_acceleration', self%adjust_acceleration)
      call file%expect('adjust_momentum', self%adjust_momentum)
      call file%expect('second_order_start', self%second_order_start)
      call self%newton%archive('newton', file)
      call self%report%archive('report', file)
      call file%item('regularization', self%consistency%regularization)
      call file%item('knows_mass', self%knows_mass)
      call self%history(self%past)%archive('history', file)
      call self%eqs%archive('equations', self%knows_mass, file)
      call self%iteration%archive('iteration', self%eqs%has_differences, file)
   end subroutine soi2_archive_parts
end module dynstep_soi2
