! SPDX-License-Identifier: BSD-3-Clause
!> What every method offers to the drivers: facts about itself, a start, steps.
!>
!> PROGRAMMING INTERFACE
!>
!>   call stepper%init(sys, status)                    check coefficients, size the workspace
!>   call stepper%start(sys, state, status)            make the state complete, forget history
!>   call stepper%reset()                              forget history alone, zero the counters
!>   call stepper%try_step(sys, state, h, t1, trial, status)   `state` is not touched
!>   call stepper%accept(state, trial)                 the trial becomes the state
!>   call stepper%advance(sys, state, clock, steps, status, complete)   many equal steps
!>   call stepper%interpolate(left, right, t, point)   inside an accepted step
!>   call stepper%estimate_error(error)                of the last trial, where there is one
!>   call stepper%prepare_control(sys, norm, status)   before steps that are chosen by their error
!>   call stepper%try_within(sys, state, h, t1, norm, trial, verdict, status)   try_step, and what its error is
!>   call stepper%restart(sys, state, status)          `start` inside a run: counters go on
!>   call stepper%archive(file)                        what later steps depend on, to a checkpoint or from it
!>   stepper%properties(), stepper%count
!>
!>   A stepper owns its coefficients, workspace, history and counters, never a system: the
!>   same system is passed to each call.  It can be copied by assignment (a checkpoint, a
!>   second thread).  `init` allocates, steps do not.
module dynstep_stepper
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_kinds, only: long, wp
   use dynstep_linear_ode, only: linear_ode
   use dynstep_linear_system, only: linear_system
   use dynstep_mechanical_system, only: mechanical_system, structure_type
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, dynstep_not_finite, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: advance_by_trials, allocate_state, copy_state, has_shape, hermite_point, multiplier_counts, swap_states
   public :: prepare_estimate, restart_with_counts, try_by_estimate

   !> A point of the trajectory
   type, public :: state_type
      real(wp) :: t = 0.0_wp
      real(wp), allocatable :: y(:)       !! state [state_size]; [q; v] of a mechanical system
      real(wp), allocatable :: a(:)       !! highest derivative that the equations give:
                                          !! q'' [n] of a mechanical system, else y' [n]
      real(wp), allocatable :: lambda(:)  !! multipliers of g = 0, [0] without constraints
      real(wp), allocatable :: psi(:)     !! multipliers of k = 0, [0] without constraints
   contains
      procedure :: archive => state_archive
   end type state_type

   !> Time without accumulated rounding: t0 + k h
   type, public :: clock_type
      real(wp) :: t0 = 0.0_wp             !! origin
      real(wp) :: h = 0.0_wp              !! step length, of either sign
      integer(long) :: k = 0              !! steps made
   contains
      !> Time after k + ahead steps
      procedure :: time => clock_time
      procedure :: archive => clock_archive
   end type clock_type

   !> Work done since `start`
   type, public :: step_counters
      integer(long) :: steps = 0              !! accepted steps (base steps of an extrapolation)
      integer(long) :: substeps = 0           !! steps of the base method of an extrapolation
      integer(long) :: rejections = 0         !! trial steps that were thrown away
      integer(long) :: forces = 0             !! evaluations of f, or of the load of a linear system
      integer(long) :: masses = 0             !! evaluations of M
      integer(long) :: tangents = 0           !! evaluations of K and C
      integer(long) :: constraints = 0        !! evaluations of g, k and their Jacobians, together
      integer(long) :: factorizations = 0
      integer(long) :: solves = 0             !! right-hand sides solved for
      integer(long) :: newton_iterations = 0
      integer(long) :: halvings = 0           !! halved Newton corrections
   contains
      procedure :: add => counters_add
      procedure :: zero => counters_zero
      procedure :: archive => counters_archive
   end type step_counters

   !> Facts about a method, for drivers, tables in the documents, and tests of order
   type, public :: method_properties
      character(len=32) :: name = ''
      character(len=64) :: source = ''        !! paper and equation
      integer :: order = 0                    !! of q and v (of y)
      integer :: highest_order = 0            !! of a method that chooses it step by step; 0: it has one order
      integer :: acceleration_order = 0       !! of a
      integer :: multiplier_order = 0         !! of lambda and psi; 0: takes no constraints
      integer :: error_order = 0              !! of the embedded error estimate; 0: none
      integer :: stages = 1                   !! implicit solves (or force evaluations) a step
      logical :: symmetric = .false.          !! may be the base of an extrapolation
      logical :: mechanical = .false.         !! needs a mechanical system
      logical :: linear = .false.             !! needs a linear_system or linear_ode
      !> Largest omega*h at which an undamped oscillator does not grow: huge() if there is
      !> none, 0 if it grows at every step, -1 if not known
      real(wp) :: stability_limit = -1.0_wp
      !> On linear systems the method does what Newmark's with this beta and gamma = 1/2 does; -1: it does not
      real(wp) :: newmark_beta = -1.0_wp
      !> A step may be longer than the one before it by less than this factor, many times over;
      !> huge() where the method has no memory of the step length
      real(wp) :: step_growth_limit = huge(1.0_wp)
   end type method_properties

   !> What is said of a trial step that is chosen by its error
   type, public :: verdict_type
      real(wp) :: error = 0.0_wp         !! estimate in the norm of the run; the step is good where it is 1 or less
      integer :: error_order = 0         !! the estimate is O(h^(error_order + 1))
      integer :: order = 0               !! of the step, which the method may choose
      real(wp) :: h_next = 0.0_wp        !! length that the method proposes for the next trial, before limits; 0: the run's
                                         !! controller chooses
      logical :: is_converged = .true.   !! .false.: the method gave up before the trial was complete
   end type verdict_type

   type, abstract, public :: stepper_type
      type(step_counters) :: count            !! work since `start`
      logical :: is_started = .false.         !! `start` was called after the last `init`
      integer, private :: seen_n = 0          ! of the system that `init` saw, 0 before
      integer, private :: seen_m = 0          ! constraints g of that system
      integer, private :: seen_p = 0          ! constraints k
      integer, private :: seen_jacobian(3) = 0     ! kind and band of its df/dy
      integer, private :: seen_kind = 0       ! of that system, see kind_of
      type(structure_type), private :: structure   ! of that system
      type(state_type), private :: spare      ! second state of `advance`
      real(wp), allocatable, private :: trial_error(:) ! of try_within [state_size]
      integer, private :: estimate_order = 0          ! error_order of the properties
      integer, private :: step_order = 0              ! order
   contains
      procedure, non_overridable :: note_init
      procedure, non_overridable :: fits
      procedure(properties_interface), deferred :: properties
      procedure(init_interface), deferred :: init
      procedure(start_interface), deferred :: start
      procedure :: reset => reset_counters
      procedure(try_interface), deferred :: try_step
      procedure :: accept => swap_states
      procedure :: advance => advance_by_trials
      procedure :: interpolate => interpolate_by_hermite
      procedure :: estimate_error => no_error_estimate
      procedure :: prepare_control => prepare_estimate
      procedure :: try_within => try_by_estimate
      procedure :: restart => restart_with_counts
      procedure :: stable_limit => limit_of_properties
      procedure :: column_growth => no_columns
      procedure :: carry => carry_counts
      procedure :: aim => ignore_aim
      procedure :: follow => ignore_row
      procedure :: needs_acceleration => acceleration_is_needed
      procedure, non_overridable :: archive => stepper_archive
      procedure :: archive_parts
   end type stepper_type

   abstract interface
      recursive function properties_interface(self) result(facts)
         import :: stepper_type, method_properties
         class(stepper_type), intent(in) :: self
         type(method_properties) :: facts
      end function properties_interface

      !> Check the coefficients and that the method can take this system; size the workspace
      recursive subroutine init_interface(self, sys, status)
         import :: stepper_type, ode_system, status_type
         class(stepper_type), intent(inout) :: self
         class(ode_system), intent(inout) :: sys
         type(status_type), intent(inout) :: status
      end subroutine init_interface

      !> Check t and y of `state`, reset, and compute what belongs to them (a, lambda, psi)
      recursive subroutine start_interface(self, sys, state, status)
         import :: stepper_type, ode_system, state_type, status_type
         class(stepper_type), intent(inout) :: self
         class(ode_system), intent(inout) :: sys
         type(state_type), intent(inout) :: state
         type(status_type), intent(inout) :: status
      end subroutine start_interface

      !> One trial step of length h to the time t1 = state%t + h up to rounding
      recursive subroutine try_interface(self, sys, state, h, t1, trial, status)
         import :: stepper_type, ode_system, state_type, status_type, wp
         class(stepper_type), intent(inout) :: self
         class(ode_system), intent(inout) :: sys
         type(state_type), intent(in) :: state
         real(wp), intent(in) :: h                   !! of either sign
         real(wp), intent(in) :: t1                  !! time that the trial is given
         type(state_type), intent(inout) :: trial    !! its arrays are allocated
         type(status_type), intent(inout) :: status
      end subroutine try_interface
   end interface

contains

   !> To be called by `init` with the system whose workspace is made, or without one where it is not
   recursive subroutine note_init(self, sys)
      class(stepper_type), intent(inout) :: self
      class(ode_system), intent(in), optional :: sys
      self%is_started = .false.
      self%seen_n = 0
      self%structure = structure_type()
      if (.not. present(sys)) return
      self%seen_n = sys%n
      self%seen_jacobian = [sys%jacobian_kind, sys%jacobian_kl, sys%jacobian_ku]
      call multiplier_counts(sys, self%seen_m, self%seen_p)
      self%seen_kind = kind_of(sys)
      select type (sys)
      class is (mechanical_system)
         self%structure = sys%structure
      end select
   end subroutine note_init

   !> True where the workspace that `init` made is that for this system
   pure logical function fits(self, sys)
      class(stepper_type), intent(in) :: self
      class(ode_system), intent(in) :: sys
      integer :: m, p
      call multiplier_counts(sys, m, p)
      fits = self%seen_n == sys%n .and. self%seen_n > 0 .and. self%seen_m == m .and. self%seen_p == p &
         & .and. self%seen_kind == kind_of(sys)
      select type (sys)
      class is (mechanical_system)
         fits = fits .and. same_structure(self%structure, sys%structure)
      class default
         fits = fits .and. all(self%seen_jacobian == [sys%jacobian_kind, sys%jacobian_kl, sys%jacobian_ku])
      end select
   end function fits

   !> 1: linear_system, 2: linear_ode, 0: another, which steppers treat in the same way
   pure integer function kind_of(sys)
      class(ode_system), intent(in) :: sys
      kind_of = 0
      select type (sys)
      class is (linear_system)
         kind_of = 1
      class is (linear_ode)
         kind_of = 2
      end select
   end function kind_of

   pure logical function same_structure(x, y)
      type(structure_type), intent(in) :: x, y
      same_structure = all([x%mass, x%mass_kl, x%mass_ku, x%tangent, x%kl, x%ku] &
         & == [y%mass, y%mass_kl, y%mass_ku, y%tangent, y%kl, y%ku]) .and. all( &
         & [x%mass_is_constant, x%mass_is_symmetric, x%tangent_is_symmetric, x%tangent_is_constant, &
         & x%force_is_linear, x%velocity_free, x%is_coupled] .eqv. &
         & [y%mass_is_constant, y%mass_is_symmetric, y%tangent_is_symmetric, y%tangent_is_constant, &
         & y%force_is_linear, y%velocity_free, y%is_coupled])
   end function same_structure

   pure real(wp) function clock_time(self, ahead)
      class(clock_type), intent(in) :: self
      integer, intent(in), optional :: ahead
      if (present(ahead)) then
         clock_time = self%t0 + real(self%k + ahead, wp)*self%h
      else
         clock_time = self%t0 + real(self%k, wp)*self%h
      end if
   end function clock_time

   !> self = self + other, but for `steps` and `substeps`, which mean other things one
   !> level down
   pure subroutine counters_add(self, other)
      class(step_counters), intent(inout) :: self
      class(step_counters), intent(in) :: other
      self%rejections = self%rejections + other%rejections
      self%forces = self%forces + other%forces
      self%masses = self%masses + other%masses
      self%tangents = self%tangents + other%tangents
      self%constraints = self%constraints + other%constraints
      self%factorizations = self%factorizations + other%factorizations
      self%solves = self%solves + other%solves
      self%newton_iterations = self%newton_iterations + other%newton_iterations
      self%halvings = self%halvings + other%halvings
   end subroutine counters_add

   pure subroutine counters_zero(self)
      class(step_counters), intent(inout) :: self
      select type (self)
      type is (step_counters)
         self = step_counters()
      end select
   end subroutine counters_zero

   !> Arrays of the lengths that belong to a system; no work where they fit already
   recursive subroutine allocate_state(sys, state, status)
      class(ode_system), intent(in) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      integer :: m, p, stat

      if (status%failed()) return
      if (sys%n < 1) then
         call status%set(dynstep_invalid_input, 'the system has n = '//text(sys%n) &
            & //' unknowns; set n >= 1 before init')
         return
      end if
      if (has_shape(sys, state)) return
      if (allocated(state%y)) deallocate (state%y)
      if (allocated(state%a)) deallocate (state%a)
      if (allocated(state%lambda)) deallocate (state%lambda)
      if (allocated(state%psi)) deallocate (state%psi)
      call multiplier_counts(sys, m, p)
      allocate (state%y(sys%state_size()), state%a(sys%n), state%lambda(m), state%psi(p), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for a state of '//text(sys%state_size())//' numbers')
         return
      end if
      state%y = 0.0_wp
      state%a = 0.0_wp
      state%lambda = 0.0_wp
      state%psi = 0.0_wp
   end subroutine allocate_state

   !> How many multipliers a system has
   pure subroutine multiplier_counts(sys, m, p)
      class(ode_system), intent(in) :: sys
      integer, intent(out) :: m, p         !! of g and of k
      m = 0
      p = 0
      select type (sys)
      class is (mechanical_system)
         m = sys%holonomic
         p = sys%nonholonomic
      end select
   end subroutine multiplier_counts

   !> True where the arrays of a state are there and have the lengths that belong to a system
   pure logical function has_shape(sys, state)
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: state
      integer :: m, p
      has_shape = allocated(state%y) .and. allocated(state%a) .and. allocated(state%lambda) .and. allocated(state%psi)
      if (.not. has_shape) return
      call multiplier_counts(sys, m, p)
      has_shape = size(state%y) == sys%state_size() .and. size(state%a) == sys%n .and. size(state%lambda) == m &
         & .and. size(state%psi) == p
   end function has_shape

   !> All of a state into another one.  The arrays of both have the same lengths: nothing is allocated.
   pure subroutine copy_state(from, to)
      type(state_type), intent(in) :: from
      type(state_type), intent(inout) :: to
      to%t = from%t
      to%y(:) = from%y
      to%a(:) = from%a
      to%lambda(:) = from%lambda
      to%psi(:) = from%psi
   end subroutine copy_state

   !> The trial becomes the state and the state the trial: arrays are exchanged, not copied.
   !> A multistep method overrides this to shift its history.
   recursive subroutine swap_states(self, state, trial)
      class(stepper_type), intent(inout) :: self
      type(state_type), intent(inout) :: state, trial
      real(wp) :: t
      t = state%t
      state%t = trial%t
      trial%t = t
      call swap(state%y, trial%y)
      call swap(state%a, trial%a)
      call swap(state%lambda, trial%lambda)
      call swap(state%psi, trial%psi)
      self%count%steps = self%count%steps + 1
   end subroutine swap_states

   pure subroutine swap(x, y)
      real(wp), allocatable, intent(inout) :: x(:), y(:)
      real(wp), allocatable :: z(:)
      call move_alloc(x, z)
      call move_alloc(y, x)
      call move_alloc(z, y)
   end subroutine swap

   !> `steps` steps of length clock%h in place.  On failure `state` and `clock` are those of
   !> the last step that was made.  Where complete = .false. the caller does not need
   !> state%a; a method may then save the work.  Methods with a cheaper way override this.
   recursive subroutine advance_by_trials(self, sys, state, clock, steps, status, complete)
      class(stepper_type), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state       !! state%t = clock%time()
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps                   !! >= 0
      type(status_type), intent(inout) :: status
      logical, intent(in) :: complete                !! state%a is wanted after the last step
      integer :: i

      if (status%failed()) return
      call allocate_state(sys, self%spare, status)
      do i = 1, steps
         call self%try_step(sys, state, clock%h, clock%time(1), self%spare, status)
         if (status%failed()) return
         call self%accept(state, self%spare)
         clock%k = clock%k + 1
      end do
   end subroutine advance_by_trials

   !> The point at time t between two accepted states of one step
   recursive subroutine interpolate_by_hermite(self, sys, left, right, t, point)
      class(stepper_type), intent(in) :: self
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: left, right    !! begin and end of the step
      real(wp), intent(in) :: t                      !! between left%t and right%t
      type(state_type), intent(inout) :: point       !! its arrays are allocated
      call hermite_point(sys, left, right, t, point)
   end subroutine interpolate_by_hermite

   !> Hermite interpolation: of q, v, a at both ends (degree 5, error h^6 in q, h^5 in v, h^4
   !> in a) for a mechanical system, with lambda and psi on a straight line (error h^2); of y, y'
   !> (degree 3, error h^4) for another
   recursive subroutine hermite_point(sys, left, right, t, point)
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: left, right
      real(wp), intent(in) :: t
      type(state_type), intent(inout) :: point
      real(wp) :: h, s

      h = right%t - left%t
      s = (t - left%t)/h
      point%t = t
      select type (sys)
      class is (mechanical_system)
         associate (n => sys%n)
            call quintic(n, h, s, left%y(1:n), left%y(n + 1:), left%a, right%y(1:n), right%y(n + 1:), &
               & right%a, point%y(1:n), point%y(n + 1:), point%a)
         end associate
         call straight_line(s, left%lambda, right%lambda, point%lambda)
         call straight_line(s, left%psi, right%psi, point%psi)
      class default
         call cubic(sys%n, h, s, left%y, left%a, right%y, right%a, point%y, point%a)
      end select
   end subroutine hermite_point

   !> Multipliers, where there are any
   pure subroutine straight_line(s, x0, x1, x)
      real(wp), intent(in) :: s
      real(wp), allocatable, intent(in) :: x0(:), x1(:)
      real(wp), allocatable, intent(inout) :: x(:)
      if (allocated(x) .and. allocated(x0) .and. allocated(x1)) x = x0 + s*(x1 - x0)
   end subroutine straight_line

   !> q(s) = q0 + s h v0 + s^2 h^2 a0/2 + s^3 [c0 + s c1 + s^2 c2] with c from the right end;
   !> the differences d keep a motion that is nearly straight at full accuracy
   pure subroutine quintic(n, h, s, q0, v0, a0, q1, v1, a1, q, v, a)
      integer, intent(in) :: n
      real(wp), intent(in) :: h, s
      real(wp), intent(in) :: q0(n), v0(n), a0(n), q1(n), v1(n), a1(n)
      real(wp), intent(out) :: q(n), v(n), a(n)
      real(wp) :: d0, d1, d2, c0, c1, c2
      integer :: i
      do i = 1, n
         d0 = (q1(i) - q0(i)) - h*(v0(i) + 0.5_wp*h*a0(i))    ! what the parabola misses in q,
         d1 = h*((v1(i) - v0(i)) - h*a0(i))                   ! in h v,
         d2 = h**2*(a1(i) - a0(i))                            ! in h^2 a
         c0 = 10.0_wp*d0 - 4.0_wp*d1 + 0.5_wp*d2
         c1 = -15.0_wp*d0 + 7.0_wp*d1 - d2
         c2 = 6.0_wp*d0 - 3.0_wp*d1 + 0.5_wp*d2
         q(i) = q0(i) + s*(h*v0(i) + s*(0.5_wp*h**2*a0(i) + s*(c0 + s*(c1 + s*c2))))
         v(i) = v0(i) + s*(h*a0(i) + s*(3.0_wp*c0 + s*(4.0_wp*c1 + s*5.0_wp*c2))/h)
         a(i) = a0(i) + s*(6.0_wp*c0 + s*(12.0_wp*c1 + s*20.0_wp*c2))/h**2
      end do
   end subroutine quintic

   pure subroutine cubic(n, h, s, y0, f0, y1, f1, y, f)
      integer, intent(in) :: n
      real(wp), intent(in) :: h, s
      real(wp), intent(in) :: y0(n), f0(n), y1(n), f1(n)
      real(wp), intent(out) :: y(n), f(n)
      real(wp) :: d0, d1, c0, c1
      integer :: i
      do i = 1, n
         d0 = (y1(i) - y0(i)) - h*f0(i)
         d1 = h*(f1(i) - f0(i))
         c0 = 3.0_wp*d0 - d1
         c1 = d1 - 2.0_wp*d0
         y(i) = y0(i) + s*(h*f0(i) + s*(c0 + s*c1))
         f(i) = f0(i) + s*(2.0_wp*c0 + s*3.0_wp*c1)/h
      end do
   end subroutine cubic

   !> Forget the history and what is known of the system's matrices, zero the counters
   pure subroutine reset_counters(self)
      class(stepper_type), intent(inout) :: self
      call self%count%zero()
   end subroutine reset_counters

   !> Estimate of the local error of the last trial, [state_size]; properties()%error_order
   !> tells whether there is one, else it is zero
   recursive subroutine no_error_estimate(self, error)
      class(stepper_type), intent(in) :: self
      real(wp), intent(out) :: error(:)
      error = 0.0_wp
   end subroutine no_error_estimate

   !> Get ready for `try_within`; a method that prepares more for its estimate, or for a choice of its order, overrides this.
   !> To be called after `init`, before `start`.
   recursive subroutine prepare_estimate(self, sys, norm, status)
      class(stepper_type), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(error_norm_type), intent(in) :: norm          !! its tolerances may choose what is prepared
      type(status_type), intent(inout) :: status
      type(method_properties) :: facts
      integer :: stat

      if (status%failed()) return
      facts = self%properties()
      self%estimate_order = facts%error_order
      self%step_order = facts%order
      if (facts%error_order < 1) then
         call status%set(dynstep_invalid_input, trim(facts%name)//' has no error estimate to choose steps by: give h, or ' &
            & //'take a method that has one')
         return
      end if
      if (allocated(self%trial_error)) deallocate (self%trial_error)
      allocate (self%trial_error(sys%state_size()), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for the estimate of '//text(sys%state_size())//' errors')
         return
      end if
      call norm%check(sys%state_size(), status)
   end subroutine prepare_estimate

   !> A trial step and its error.  A method that chooses its order overrides this.
   recursive subroutine try_by_estimate(self, sys, state, h, t1, norm, trial, verdict, status)
      class(stepper_type), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(error_norm_type), intent(in) :: norm
      type(state_type), intent(inout) :: trial
      type(verdict_type), intent(out) :: verdict
      type(status_type), intent(inout) :: status

      call self%try_step(sys, state, h, t1, trial, status)
      if (status%failed()) return
      call self%estimate_error(self%trial_error)
      verdict%error_order = self%estimate_order
      verdict%order = self%step_order
      if (.not. (all(ieee_is_finite(self%trial_error)) .and. all(ieee_is_finite(trial%y)))) then
         call status%set(dynstep_not_finite, 'the step from t = '//text(state%t)//' leaves the range of numbers', retry=.true.)
         return
      end if
      verdict%error = norm%measure(self%trial_error, state%y, trial%y)
   end subroutine try_by_estimate

   !> `start` at a point inside a run, after a jump of the state, of parameters or of the right side.  The history is
   !> forgotten; the counters go on, and the sides of switch functions are those that the caller has set.
   recursive subroutine restart_with_counts(self, sys, state, status)
      class(stepper_type), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      type(step_counters) :: before
      if (status%failed()) return
      before = self%count
      sys%keeps_sides = .true.
      call self%start(sys, state, status)
      sys%keeps_sides = .false.
      call self%carry(before)
   end subroutine restart_with_counts

   !> count = count + before, all of it; a method that sums its counters up from parts overrides this
   recursive subroutine carry_counts(self, before)
      class(stepper_type), intent(inout) :: self
      type(step_counters), intent(in) :: before
      call self%count%add(before)
      self%count%steps = self%count%steps + before%steps
      self%count%substeps = self%count%substeps + before%substeps
   end subroutine carry_counts

   !> Smallest omega h at which an oscillator with a damping ratio grows by more than `growth` (as a part of 1) in a step;
   !> huge() where there is none, or none below `z` that matters; -1 where it is not known
   recursive real(wp) function limit_of_properties(self, damping_ratio, growth, z) result(limit)
      class(stepper_type), intent(in) :: self
      real(wp), intent(in) :: damping_ratio              !! >= 0; not read where only the limit without damping is known
      real(wp), intent(in) :: growth                     !! > 0
      real(wp), intent(in), optional :: z                !! omega h of the highest frequency: a few looks below it are enough
      type(method_properties) :: facts
      facts = self%properties()
      limit = facts%stability_limit
   end function limit_of_properties

   !> Of the last step of an extrapolation: the difference of the last two results of its base over that of the first two.
   !> Above 1 the columns do not converge.  0 for other methods.
   pure real(wp) function no_columns(self)
      class(stepper_type), intent(in) :: self
      no_columns = 0.0_wp
   end function no_columns

   !> The base of an extrapolation under error control may solve its equations with an error of `allowed` in each
   !> substep, no more; 0: to rounding.  After `init`, which forgets it.  A method that iterates overrides this.
   recursive subroutine ignore_aim(self, norm, allowed, steps)
      class(stepper_type), intent(inout) :: self
      type(error_norm_type), intent(in) :: norm
      real(wp), intent(in) :: allowed                    !! >= 0, in the norm
      integer, intent(in) :: steps                       !! substeps that one `advance` makes at most
   end subroutine ignore_aim

   !> The last `advance` of `other` made the same base step as the next one of this stepper will, in fewer substeps: first
   !> guesses may be taken from it.  For those that `aim` was called for.
   recursive subroutine ignore_row(self, other)
      class(stepper_type), intent(inout) :: self
      class(stepper_type), intent(in) :: other
   end subroutine ignore_row

   !> True where a step reads state%a of its start
   pure logical function acceleration_is_needed(self)
      class(stepper_type), intent(in) :: self
      acceleration_is_needed = .true.
   end function acceleration_is_needed

   !> All that the next steps depend on, written or read.  A stepper that reads has the options of the one that wrote, and its
   !> `init` (and `prepare_control`, where steps are chosen by their error) was called with the same system; what does not fit
   !> is refused in `file`, and the stepper counts as not started then.
   recursive subroutine stepper_archive(self, file)
      class(stepper_type), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      type(method_properties) :: facts
      logical :: is_started

      if (file%failed()) return
      facts = self%properties()
      call file%section(trim(facts%name))
      if (self%seen_n == 0) call file%refuse('the method knows no system yet; call init before')
      is_started = self%is_started
      if (file%is_reading) self%is_started = .false.
      call expect_system(self, file)
      call self%count%archive('count', file)
      if (.not. file%failed()) call self%archive_parts(file)
      call file%item('is_started', is_started)
      call file%end_section()
      if (.not. file%failed()) self%is_started = is_started
   end subroutine stepper_archive

   !> What `fits` compares
   recursive subroutine expect_system(self, file)
      class(stepper_type), intent(in) :: self
      type(archive_type), intent(inout) :: file
      call file%section('system')
      call file%expect('n', self%seen_n)
      call file%expect('m', self%seen_m)
      call file%expect('p', self%seen_p)
      call file%expect('jacobian', self%seen_jacobian)
      call file%expect('kind', self%seen_kind)
      associate (s => self%structure)
         call file%expect('mass', s%mass)
         call file%expect('mass_kl', s%mass_kl)
         call file%expect('mass_ku', s%mass_ku)
         call file%expect('mass_is_constant', s%mass_is_constant)
         call file%expect('mass_is_symmetric', s%mass_is_symmetric)
         call file%expect('tangent', s%tangent)
         call file%expect('kl', s%kl)
         call file%expect('ku', s%ku)
         call file%expect('tangent_is_symmetric', s%tangent_is_symmetric)
         call file%expect('tangent_is_constant', s%tangent_is_constant)
         call file%expect('force_is_linear', s%force_is_linear)
         call file%expect('velocity_free', s%velocity_free)
         call file%expect('is_coupled', s%is_coupled)
      end associate
      call file%end_section()
   end subroutine expect_system

   !> Options, to be compared, and what is kept over steps.  A method that keeps anything overrides this.
   recursive subroutine archive_parts(self, file)
      class(stepper_type), intent(inout) :: self
      type(archive_type), intent(inout) :: file
   end subroutine archive_parts

   !> A point of the trajectory; arrays that are allocated must have the lengths of the file
   recursive subroutine state_archive(self, name, file)
      class(state_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('t', self%t)
      call file%item('y', self%y)
      call file%item('a', self%a)
      call file%item('lambda', self%lambda)
      call file%item('psi', self%psi)
      call file%end_section()
   end subroutine state_archive

   recursive subroutine clock_archive(self, name, file)
      class(clock_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('t0', self%t0)
      call file%item('h', self%h)
      call file%item('k', self%k)
      call file%end_section()
   end subroutine clock_archive

   recursive subroutine counters_archive(self, name, file)
      class(step_counters), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('steps', self%steps)
      call file%item('substeps', self%substeps)
      call file%item('rejections', self%rejections)
      call file%item('forces', self%forces)
      call file%item('masses', self%masses)
      call file%item('tangents', self%tangents)
      call file%item('constraints', self%constraints)
      call file%item('factorizations', self%factorizations)
      call file%item('solves', self%solves)
      call file%item('newton_iterations', self%newton_iterations)
      call file%item('halvings', self%halvings)
      call file%end_section()
   end subroutine counters_archive
end module dynstep_stepper
