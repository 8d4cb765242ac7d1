! SPDX-License-Identifier: BSD-3-Clause
!> Extrapolation of a symmetric method to any even order (Austin 1991, sections 4 and 6).
!>
!> A base step of length h is made with n(1) < n(2) < ... < n(P) substeps of a symmetric
!> method.  The errors of the results have expansions in even powers of h/n(j), eq. (13), so
!> the table of eq. (19) - for any sequence: Neville's table in (h/n)^2 - removes P - 1 of
!> them: order 2P.  Over a base of an even order r the terms start with h^r: order r + 2(P - 1).
!> Accelerations follow by back-substitution, step [1d].
!>
!> PROGRAMMING INTERFACE
!>
!>     type(extrapolation_stepper) :: stepper
!>     allocate (newmark_stepper :: stepper%base)      ! or any stepper with symmetric = .true.
!>     stepper%levels = 4                              ! order 8
!>     stepper%sequence = sequence_romberg             ! default: harmonic, 1, 2, 3, ...
!>     call stepper%get_tableau(table, numbers)        ! after a step: Table [1] of the paper
!>
!>     stepper%vary_order = .true.                     ! runs under error control choose the levels step by step
!>     stepper%max_levels = 9                          ! at most
!>
!>   `init` reads all of these; after a change it is called again.  Each level owns a copy of
!>   the base, so a linear system is factorized once for each level.  What is extrapolated are
!>   the increments over the base step.
!>
!>   The harmonic sequence is the default: 1, 2, 3, 4 has order 8 with 10 substeps, Romberg's
!>   numbers with 15.  An extrapolated trapezoid is not unconditionally stable; see
!>   docs/theory/newmark-extrapolation.md for the limits.
!>
!>   With vary_order a trial under control, `try_within`, makes row after row until the error is small enough, see
!>   DYNSTEP_ORDER_CONTROL; `try_step` makes as many as the last of these trials had.  A run of fixed steps has `levels`.
!>   `prepare_control` is for one run: the next `start` after its trials, or a fixed step before the first of them, ends
!>   the control, and what follows has the bits of a method that was never controlled.  `restart` goes on with it.
module dynstep_extrapolation
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: acceleration_solver
   use dynstep_extrapolation_stability, only: first_growth, stability_limit
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_kinds, only: long, wp
   use dynstep_matrix, only: kind_banded, kind_dense
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_order_control, only: order_control, tolerance_of
   use dynstep_sequences, only: extrapolation_weights, most_levels, sequence_automatic, sequence_double_harmonic, &
      & sequence_harmonic, substep_numbers
   use dynstep_start_check, only: check_size, check_start
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, dynstep_not_finite, status_type
   use dynstep_stepper, only: allocate_state, clock_type, method_properties, prepare_estimate, restart_with_counts, &
      & state_type, step_counters, stepper_type, try_by_estimate, verdict_type
   use dynstep_text, only: text
   implicit none
   private

   type :: level_type
      class(stepper_type), allocatable :: stepper
   end type level_type

   type, extends(stepper_type), public :: extrapolation_stepper
      class(stepper_type), allocatable :: base    !! method that is extrapolated, with its coefficients
      integer :: sequence = sequence_harmonic     !! see dynstep_sequences
      integer :: levels = 4                       !! P, 1 .. 12; the order is 2 P
      integer, allocatable :: custom(:)           !! numbers of sequence_custom
      logical :: vary_order = .false.             !! levels chosen by the error, in runs under control
      integer :: max_levels = 9                   !! of these, 2 .. 12; memory and work of `init` are for all of them
      integer, private :: base_order = 2                ! r: the errors of the base have h^r, h^(r+2), ...
      integer, private :: used = 0                      ! levels of the last trial, and of the next fixed one
      integer, allocatable, private :: numbers(:)       ! substeps of each level [made]
      real(wp), allocatable, private :: weights(:, :)   ! (:k, k) of the result of k levels [made, made]
      real(wp), allocatable, private :: weights_error(:, :)   ! of that result - T(k, k-1) [made, made]
      real(wp), allocatable, private :: increments(:, :)! first column of the table, minus y0
      real(wp), allocatable, private :: y0(:)           ! start of the last trial
      type(level_type), allocatable, private :: level(:)
      type(state_type), private :: work, other
      type(acceleration_solver), private :: end_solver
      type(step_counters), private :: own               ! work outside the levels
      logical, private :: base_reads_a = .true.
      logical, private :: is_controlled = .false.       ! prepare_control was called for the present run
      logical, private :: has_tried = .false.           ! and trials were made under its control
      logical, private :: is_restarting = .false.       ! `start` is called by `restart`
      logical, private :: is_tight = .false.            ! and its tolerance is below tight_below
      type(order_control), private :: control           ! of vary_order
      real(wp), allocatable, private :: error(:)        ! estimate of a column
      real(wp), private :: factorization_work = 1.0_wp  ! of one factorization, in forces
   contains
      procedure :: properties => extrapolation_properties
      procedure :: init => extrapolation_init
      procedure :: reset => extrapolation_reset
      procedure :: start => extrapolation_start
      procedure :: restart => extrapolation_restart
      procedure :: try_step => extrapolation_try_step
      procedure :: advance => extrapolation_advance
      procedure :: estimate_error => extrapolation_estimate_error
      procedure :: needs_acceleration => extrapolation_needs_acceleration
      procedure :: stable_limit => extrapolation_stable_limit
      procedure :: column_growth => extrapolation_column_growth
      procedure :: prepare_control => extrapolation_prepare_control
      procedure :: try_within => extrapolation_try_within
      procedure :: carry => extrapolation_carry
      procedure :: get_tableau => extrapolation_get_tableau
      procedure :: archive_parts => extrapolation_archive_parts
   end type extrapolation_stepper

   !> Tolerance below which the automatic sequence is 2, 4, 6, ...  Measured on Kepler's problem (e = 0.9) and Pleiades:
   !> down to errors of 1e-10, at tolerances near 1e-13, 1, 2, 3, ... takes 0.71 to 0.81 of the forces of 2, 4, 6, ...; at
   !> 3e-14 it ends with 1.6 to 1.7 times the errors of rounding alone
   real(wp), parameter :: tight_below = 1.0e-13_wp

   !> Differences of columns below this part of the state are rounding errors: a ball that falls, which every column follows
   !> exactly, has some 10 epsilon, and seemed to diverge without this
   real(wp), parameter :: most_noise = 1000.0_wp*epsilon(1.0_wp)

   !> Part of the tolerance that the iterations of all substeps of one row may leave.  Measured on the two-body pair: with
   !> 0.1 the errors at rtol = 1e-12 are five times those of iterations to rounding; 0.001 takes 6 % more forces for 1e-6
   real(wp), parameter :: iteration_share = 0.01_wp

contains

   recursive function extrapolation_properties(self) result(facts)
      class(extrapolation_stepper), intent(in) :: self
      type(method_properties) :: facts
      integer, allocatable :: numbers(:)
      type(status_type) :: status
      integer :: levels

      levels = self%levels
      if (self%is_controlled .and. self%vary_order) levels = self%used
      facts%source = 'Austin 1991, sections 4 and 6, eq. (19)'
      facts%name = 'extrapolation'
      if (allocated(self%base)) then
         facts = self%base%properties()
         facts%source = 'Austin 1991, sections 4 and 6, eq. (19)'
         facts%name = trim(facts%name)//'-extrapolation'
      end if
      call substep_numbers(self%sequence, levels, self%custom, numbers, status)
      if (status%failed()) return
      if (self%is_controlled .and. self%vary_order) facts%highest_order = max(2, facts%order) + 2*(self%max_levels - 1)
      facts%order = max(2, facts%order) + 2*(levels - 1)
      facts%acceleration_order = facts%order
      facts%error_order = merge(facts%order - 2, 0, levels > 1)
      facts%stages = sum(numbers)*facts%stages
      facts%symmetric = .false.
      if (levels > 1) then
         facts%stability_limit = -1.0_wp
         facts%newmark_beta = -1.0_wp
      end if
   end function extrapolation_properties

   recursive subroutine extrapolation_init(self, sys, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      integer, allocatable :: numbers(:)

      if (status%failed()) return
      call self%note_init()
      self%is_controlled = .false.
      self%has_tried = .false.
      call check_size(sys, status)
      call check_base(self, status)
      call substep_numbers(self%sequence, self%levels, self%custom, numbers, status)
      if (status%failed()) return
      self%base_order = order_of_base(self)
      call make_levels(self, sys, numbers, status)
      call allocate_state(sys, self%work, status)
      call allocate_state(sys, self%other, status)
      call self%end_solver%init(sys, status)
      if (status%failed()) return
      self%base_reads_a = self%level(1)%stepper%needs_acceleration()
      call self%note_init(sys)
   end subroutine extrapolation_init

   !> A copy of the base for each row, and the weights of all numbers of levels
   recursive subroutine make_levels(self, sys, numbers, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      integer, intent(in) :: numbers(:)
      type(status_type), intent(inout) :: status
      integer :: j, k, stat

      if (status%failed()) return
      if (allocated(self%level)) deallocate (self%level, self%increments, self%y0, self%error, self%weights, self%weights_error)
      self%numbers = numbers
      self%used = size(numbers)
      associate (levels => size(numbers), n => sys%state_size())
         allocate (self%level(levels), self%increments(n, levels), self%y0(n), self%error(n), self%weights(levels, levels), &
            & self%weights_error(levels, levels), stat=stat)
         if (stat /= 0) then
            call status%set(dynstep_no_memory, 'no memory for '//text(levels)//' levels of '//text(n)//' numbers')
            return
         end if
      end associate
      self%increments = 0.0_wp
      self%y0 = 0.0_wp
      self%weights = 0.0_wp
      self%weights_error = 0.0_wp
      do k = 1, size(numbers)
         self%weights(:k, k) = extrapolation_weights(numbers(:k), self%base_order)
         self%weights_error(:k, k) = self%weights(:k, k)
         if (k > 1) self%weights_error(2:k, k) = self%weights(2:k, k) - extrapolation_weights(numbers(2:k), self%base_order)
      end do
      do j = 1, size(numbers)
         allocate (self%level(j)%stepper, source=self%base)
         call self%level(j)%stepper%init(sys, status)
      end do
   end subroutine make_levels

   !> Of the leading term of its error
   recursive integer function order_of_base(self)
      class(extrapolation_stepper), intent(in) :: self
      type(method_properties) :: facts
      facts = self%base%properties()
      order_of_base = max(2, facts%order)
   end function order_of_base

   !> The expansion in even powers, eq. (13), is that of a symmetric method
   recursive subroutine check_base(self, status)
      class(extrapolation_stepper), intent(in) :: self
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (.not. allocated(self%base)) then
         call status%set(dynstep_invalid_input, 'the extrapolation has no base method: allocate one before init')
         return
      end if
      associate (facts => self%base%properties())
         if (.not. facts%symmetric) call status%set(dynstep_invalid_input, 'the base of an extrapolation must be ' &
            & //'symmetric, and this '//trim(facts%name)//' is not; Newmark''s method is with gamma = 1/2')
      end associate
   end subroutine check_base

   pure subroutine extrapolation_reset(self)
      class(extrapolation_stepper), intent(inout) :: self
      integer :: j
      call self%count%zero()
      call self%own%zero()
      call self%end_solver%forget()
      call self%control%begin()
      if (.not. allocated(self%level)) return
      do j = 1, size(self%level)
         call self%level(j)%stepper%reset()
      end do
   end subroutine extrapolation_reset

   recursive subroutine extrapolation_start(self, sys, state, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      call check_start(self, sys, state, status)
      if (status%failed()) return
      if (self%has_tried .and. .not. self%is_restarting) call end_control(self, sys, status)
      call check_numbers(self, status)
      if (status%failed()) return
      call self%reset()
      call self%end_solver%complete(sys, state, self%own, status)
      call gather_counts(self)
      self%is_started = .not. status%failed()
   end subroutine extrapolation_start

   !> Inside a run, which goes on under its control
   recursive subroutine extrapolation_restart(self, sys, state, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      self%is_restarting = .true.
      call restart_with_counts(self, sys, state, status)
      self%is_restarting = .false.
   end subroutine extrapolation_restart

   !> Levels as they are set, made anew: without what a run under control aimed their iterations at
   recursive subroutine end_control(self, sys, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      integer, allocatable :: numbers(:)
      if (status%failed() .or. .not. self%is_controlled) return
      call substep_numbers(self%sequence, self%levels, self%custom, numbers, status)
      if (status%failed()) return
      self%is_controlled = .false.
      self%has_tried = .false.
      call keep_counts(self)
      call make_levels(self, sys, numbers, status)
   end subroutine end_control

   !> Substeps of the rows by the present settings
   recursive subroutine choose_numbers(self, numbers, status)
      class(extrapolation_stepper), intent(in) :: self
      integer, allocatable, intent(out) :: numbers(:)
      type(status_type), intent(inout) :: status
      integer :: sequence
      sequence = self%sequence
      if (sequence == sequence_automatic) sequence = merge(sequence_double_harmonic, sequence_harmonic, self%is_controlled &
         & .and. self%is_tight)
      call substep_numbers(sequence, merge(self%max_levels, self%levels, self%is_controlled .and. self%vary_order), &
         & self%custom, numbers, status)
   end subroutine choose_numbers

   !> Levels, sequence and custom numbers are those that the workspace was made for
   recursive subroutine check_numbers(self, status)
      class(extrapolation_stepper), intent(in) :: self
      type(status_type), intent(inout) :: status
      integer, allocatable :: numbers(:)
      call choose_numbers(self, numbers, status)
      if (status%failed()) return
      if (size(numbers) /= size(self%numbers)) then
         call status%set(dynstep_invalid_input, 'levels = '//text(size(numbers))//' were '//text(size(self%numbers)) &
            & //' at init; call init after a change')
      else if (any(numbers /= self%numbers)) then
         call status%set(dynstep_invalid_input, 'sequence or custom are others than at init; call init after a change')
      end if
   end subroutine check_numbers

   !> Numbers of substeps that suit the tolerance; with vary_order all of the levels.  After `init`, before or after `start`.
   recursive subroutine extrapolation_prepare_control(self, sys, norm, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(error_norm_type), intent(in) :: norm
      type(status_type), intent(inout) :: status
      integer, allocatable :: numbers(:)

      if (status%failed()) return
      if (.not. self%fits(sys)) then
         call status%set(dynstep_invalid_input, 'call init with this system before prepare_control')
         return
      end if
      call norm%check(sys%state_size(), status)
      if (self%vary_order .and. (self%max_levels < 2 .or. self%max_levels > most_levels)) &
         & call status%set(dynstep_invalid_input, 'max_levels = '//text(self%max_levels)//' must be 2 to '//text(most_levels))
      if (status%failed()) return
      self%is_controlled = .true.
      self%has_tried = .false.
      self%is_tight = tolerance_of(norm) < tight_below
      call choose_numbers(self, numbers, status)
      if (status%failed()) return
      call keep_counts(self)
      call make_levels(self, sys, numbers, status)
      if (status%failed()) return
      call aim_rows(self, norm)
      if (.not. self%vary_order) then
         call prepare_estimate(self, sys, norm, status)
         return
      end if
      call self%control%prepare(numbers, self%weights, self%base_order, norm)
      self%used = self%control%target
      self%factorization_work = work_of_factorization(sys)
   end subroutine extrapolation_prepare_control

   !> The work of levels that are made anew is not forgotten
   pure subroutine keep_counts(self)
      class(extrapolation_stepper), intent(inout) :: self
      integer :: j
      do j = 1, size(self%level)
         call self%own%add(self%level(j)%stepper%count)
         self%own%substeps = self%own%substeps + self%level(j)%stepper%count%steps
      end do
   end subroutine keep_counts

   !> The errors that the substeps of a row may leave add up, and are weighted in the results
   recursive subroutine aim_rows(self, norm)
      class(extrapolation_stepper), intent(inout) :: self
      type(error_norm_type), intent(in) :: norm
      integer :: j
      do j = 1, size(self%level)
         call self%level(j)%stepper%aim(norm, &
            & iteration_share/(real(self%numbers(j), wp)*maxval(abs(self%weights(j, j:)))), self%numbers(j))
      end do
   end subroutine aim_rows

   !> A factorization of the matrix of a step beside a solve with it, which counts as one
   pure real(wp) function work_of_factorization(sys) result(work)
      class(ode_system), intent(in) :: sys
      integer :: kind, width
      kind = sys%jacobian_kind
      width = sys%jacobian_kl + sys%jacobian_ku
      select type (sys)
      class is (mechanical_system)
         kind = max(sys%structure%mass, sys%structure%tangent)
         width = max(sys%structure%mass_kl + sys%structure%mass_ku, sys%structure%kl + sys%structure%ku)
      end select
      work = 1.0_wp
      if (kind == kind_banded) work = 1.0_wp + 0.5_wp*real(width, wp)
      if (kind == kind_dense) work = 1.0_wp + real(sys%n, wp)/3.0_wp
   end function work_of_factorization

   !> Row after row until an entry of the diagonal is good enough, or is not likely to become so.  In the latter case
   !> `trial` is no more than begun, and its acceleration is not that of its end.
   recursive subroutine extrapolation_try_within(self, sys, state, h, t1, norm, trial, verdict, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(error_norm_type), intent(in) :: norm
      type(state_type), intent(inout) :: trial
      type(verdict_type), intent(out) :: verdict
      type(status_type), intent(inout) :: status
      integer :: k
      real(wp) :: before

      if (status%failed()) return
      self%has_tried = self%is_controlled
      if (.not. (self%vary_order .and. self%is_controlled)) then
         call try_by_estimate(self, sys, state, h, t1, norm, trial, verdict, status)
         return
      end if
      call self%control%open_trial(state%t, h, norm%rounding(state%y), status)
      if (status%failed()) return
      self%y0 = state%y
      do k = 1, self%control%last
         before = work_of(self, k)
         call make_row(self, sys, state, h, k, status)
         if (status%failed()) exit
         self%control%work(k) = work_of(self, k) - before
         if (k == 1) self%control%work(k) = self%control%work(k) + 1.0_wp    ! the acceleration at the end
         if (k == 1) cycle
         self%used = k
         call take_result(self, state, h, t1, trial, status)
         if (status%failed()) exit
         call self%estimate_error(self%error)
         self%control%error(k) = norm%measure(self%error, state%y, trial%y)
         if (self%control%is_good(k) .or. self%control%is_hopeless(k)) exit
      end do
      if (.not. status%failed()) then
         verdict%error = self%control%error(k)
         verdict%order = self%control%order_of(k)
         verdict%error_order = verdict%order - 2
         verdict%is_converged = verdict%error <= 1.0_wp
         if (verdict%is_converged) call self%end_solver%complete(sys, trial, self%own, status)
      end if
      call gather_counts(self)
      if (status%failed()) then
         call self%control%give_up()
         return
      end if
      call self%control%close_trial(k, verdict%h_next, status)
      verdict%h_next = sign(verdict%h_next, h)
   end subroutine extrapolation_try_within

   !> Work of a row up to now: forces, solves with each of them, tangents, factorizations
   pure real(wp) function work_of(self, j)
      class(extrapolation_stepper), intent(in) :: self
      integer, intent(in) :: j
      associate (c => self%level(j)%stepper%count)
         work_of = real(c%forces + c%solves + c%tangents, wp) + self%factorization_work*real(c%factorizations, wp)
      end associate
   end function work_of

   recursive subroutine extrapolation_try_step(self, sys, state, h, t1, trial, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status
      call base_step(self, sys, state, h, t1, .true., trial, status)
      call gather_counts(self)
   end subroutine extrapolation_try_step

   !> As the stepper's own `advance`; the acceleration between two steps is left out where the
   !> base does not read it
   recursive subroutine extrapolation_advance(self, sys, state, clock, steps, status, complete)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps
      type(status_type), intent(inout) :: status
      logical, intent(in) :: complete
      integer :: i

      if (status%failed()) return
      do i = 1, steps
         call base_step(self, sys, state, clock%h, clock%time(1), &
            & self%base_reads_a .or. (complete .and. i == steps), self%other, status)
         if (status%failed()) exit
         call self%accept(state, self%other)
         clock%k = clock%k + 1
         self%own%steps = self%own%steps + 1
      end do
      call gather_counts(self)
      if (status%failed() .and. i > 1 .and. complete) call complete_last(self, sys, state)
   end subroutine extrapolation_advance

   !> A failed run ends on a state whose acceleration may have been left out
   recursive subroutine complete_last(self, sys, state)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type) :: own_status
      if (.not. self%base_reads_a) call self%end_solver%complete(sys, state, self%own, own_status)
   end subroutine complete_last

   !> Steps [3] to [1d] of section 6
   recursive subroutine base_step(self, sys, state, h, t1, complete, trial, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      logical, intent(in) :: complete                !! trial%a is wanted
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status
      integer :: j

      if (self%is_controlled .and. .not. self%has_tried) call end_control(self, sys, status)
      if (status%failed()) return
      do j = 1, self%used
         call make_row(self, sys, state, h, j, status)
         if (status%failed()) return
      end do
      self%y0 = state%y
      call take_result(self, state, h, t1, trial, status)
      if (complete) call self%end_solver%complete(sys, trial, self%own, status)
   end subroutine base_step

   !> Row j of the first column: the base step in numbers(j) substeps
   recursive subroutine make_row(self, sys, state, h, j, status)
      class(extrapolation_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h
      integer, intent(in) :: j
      type(status_type), intent(inout) :: status
      type(clock_type) :: clock
      self%work%t = state%t
      self%work%y = state%y
      if (self%base_reads_a) self%work%a = state%a
      clock = clock_type(t0=state%t, h=h/self%numbers(j), k=0)
      if (self%is_controlled .and. j > 1) call self%level(j)%stepper%follow(self%level(j - 1)%stepper)
      call self%level(j)%stepper%advance(sys, self%work, clock, self%numbers(j), status, complete=.false.)
      if (.not. status%failed()) self%increments(:, j) = self%work%y - state%y
   end subroutine make_row

   !> T(P,P) of the rows that are in use
   recursive subroutine take_result(self, state, h, t1, trial, status)
      class(extrapolation_stepper), intent(inout) :: self
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status
      associate (k => self%used)
         call extrapolate(size(state%y), k, self%weights(:k, k), self%increments(:, :k), state%y, trial%y)
      end associate
      trial%t = t1
      if (.not. all(ieee_is_finite(trial%y))) &
         & call status%set(dynstep_not_finite, 'the step from t = '//text(state%t)//' leaves the range of numbers; the motion ' &
         & //'grows, or h = '//text(h)//' is beyond the stability limit of the method', retry=.true.)
   end subroutine take_result

   !> y1 = y0 + T(P) + sum of w(j) (T(j) - T(P)): the weights add up to 1, and differences
   !> of the columns are small where the table converges
   pure subroutine extrapolate(n, levels, weights, increments, y0, y1)
      integer, intent(in) :: n, levels
      real(wp), intent(in) :: weights(levels), increments(n, levels), y0(n)
      real(wp), intent(out) :: y1(n)
      real(wp) :: correction
      integer :: i, j
      do i = 1, n
         correction = 0.0_wp
         do j = 1, levels - 1
            correction = correction + weights(j)*(increments(i, j) - increments(i, levels))
         end do
         y1(i) = y0(i) + (increments(i, levels) + correction)
      end do
   end subroutine extrapolate

   !> count = own work + work of the levels; steps and rejections are counted by who asks for steps
   pure subroutine gather_counts(self)
      class(extrapolation_stepper), intent(inout) :: self
      integer :: j
      integer(long) :: rejections
      associate (c => self%count)
         rejections = c%rejections
         c%forces = self%own%forces
         c%masses = self%own%masses
         c%tangents = self%own%tangents
         c%factorizations = self%own%factorizations
         c%solves = self%own%solves
         c%newton_iterations = self%own%newton_iterations
         c%halvings = self%own%halvings
         c%substeps = self%own%substeps
         do j = 1, size(self%level)
            call c%add(self%level(j)%stepper%count)
            c%substeps = c%substeps + self%level(j)%stepper%count%steps
         end do
         c%rejections = rejections
      end associate
   end subroutine gather_counts

   !> count = count + before: `own` takes up what the sums above are made of
   recursive subroutine extrapolation_carry(self, before)
      class(extrapolation_stepper), intent(inout) :: self
      type(step_counters), intent(in) :: before
      call self%own%add(before)
      self%own%substeps = self%own%substeps + before%substeps
      self%count%steps = self%count%steps + before%steps
      self%count%rejections = self%count%rejections + before%rejections
      call gather_counts(self)
   end subroutine extrapolation_carry

   !> T(P,P) - T(P,P-1), the error of the second best entry of the table
   recursive subroutine extrapolation_estimate_error(self, error)
      class(extrapolation_stepper), intent(in) :: self
      real(wp), intent(out) :: error(:)      !! [state_size]
      integer :: j
      error = 0.0_wp
      associate (k => self%used)
         do j = 1, k - 1
            error = error + self%weights_error(j, k)*(self%increments(:, j) - self%increments(:, k))
         end do
      end associate
   end subroutine extrapolation_estimate_error

   pure logical function extrapolation_needs_acceleration(self)
      class(extrapolation_stepper), intent(in) :: self
      extrapolation_needs_acceleration = self%base_reads_a
   end function extrapolation_needs_acceleration

   !> Of a base that is Newmark's method on linear systems, see dynstep_extrapolation_stability
   recursive real(wp) function extrapolation_stable_limit(self, damping_ratio, growth, z) result(limit)
      class(extrapolation_stepper), intent(in) :: self
      real(wp), intent(in) :: damping_ratio
      real(wp), intent(in) :: growth
      real(wp), intent(in), optional :: z
      type(method_properties) :: facts
      type(status_type) :: status
      integer, allocatable :: numbers(:)
      limit = -1.0_wp
      if (.not. allocated(self%base)) return
      facts = self%base%properties()
      call substep_numbers(self%sequence, self%levels, self%custom, numbers, status)
      if (status%failed() .or. .not. facts%newmark_beta >= 0.0_wp) return
      if (self%is_controlled) numbers = self%numbers(:self%used)
      if (present(z)) then
         limit = first_growth(numbers, facts%newmark_beta, damping_ratio, growth, z)
      else
         limit = stability_limit(numbers, facts%newmark_beta, damping_ratio, growth)
      end if
   end function extrapolation_stable_limit

   !> |T(P,1) - T(P-1,1)| over |T(2,1) - T(1,1)|, largest components; 0 where they are rounding errors
   pure real(wp) function extrapolation_column_growth(self) result(growth)
      class(extrapolation_stepper), intent(in) :: self
      real(wp) :: first, last, size_of_state
      growth = 0.0_wp
      if (self%used < 3 .or. .not. allocated(self%increments)) return
      associate (x => self%increments, p => self%used)
         first = maxval(abs(x(:, 2) - x(:, 1)))
         last = maxval(abs(x(:, p) - x(:, p - 1)))
      end associate
      size_of_state = max(maxval(abs(self%y0)), maxval(abs(self%increments(:, :self%used))))
      if (last > most_noise*size_of_state) growth = last/max(first, tiny(1.0_wp))
   end function extrapolation_column_growth

   !> The table of the last step (Table [1] of the paper): table(:, j, k) is the state of row
   !> j, column k <= j, of order r + 2(k - 1); entries above the diagonal are zero
   recursive subroutine extrapolation_get_tableau(self, table, numbers)
      class(extrapolation_stepper), intent(in) :: self
      real(wp), allocatable, intent(out) :: table(:, :, :)     !! [state_size, levels, levels]
      integer, allocatable, intent(out) :: numbers(:)          !! substeps of the rows [levels]
      integer :: i, j, k, levels

      levels = self%used
      allocate (table(size(self%y0), levels, levels), source=0.0_wp)
      numbers = self%numbers(:levels)
      if (self%base_order == 2) then
         call neville(numbers, self%increments(:, :levels), table)
      else
         do k = 1, levels
            do j = k, levels
               associate (w => extrapolation_weights(numbers(j - k + 1:j), self%base_order))
                  do i = 1, k
                     table(:, j, k) = table(:, j, k) + w(i)*self%increments(:, j - k + i)
                  end do
               end associate
            end do
         end do
      end if
      do k = 1, levels
         do j = k, levels
            table(:, j, k) = self%y0 + table(:, j, k)
         end do
      end do
   end subroutine extrapolation_get_tableau

   !> Eq. (19) for any numbers of substeps
   pure subroutine neville(numbers, increments, table)
      integer, intent(in) :: numbers(:)
      real(wp), intent(in) :: increments(:, :)
      real(wp), intent(inout) :: table(:, :, :)
      real(wp) :: ratio
      integer :: j, k
      table(:, :, 1) = increments
      do k = 2, size(numbers)
         do j = k, size(numbers)
            ratio = (real(numbers(j), wp)/real(numbers(j - k + 1), wp))**2 - 1.0_wp
            table(:, j, k) = table(:, j, k - 1) + (table(:, j, k - 1) - table(:, j - 1, k - 1))/ratio
         end do
      end do
   end subroutine neville

   !> The levels' steppers and what is counted outside them; the table is of one step
   recursive subroutine extrapolation_archive_parts(self, file)
      class(extrapolation_stepper), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      integer :: j
      call file%expect('numbers', self%numbers)
      call file%expect('base_order', self%base_order)
      call file%item('used', self%used)
      ! a checkpoint is read behind prepare_control and goes on with the trials of its run
      if (file%is_reading) self%has_tried = self%is_controlled
      call self%control%archive('control', file)
      call self%own%archive('own', file)
      call self%end_solver%archive('end_solver', file)
      do j = 1, size(self%level)
         call file%section('level_'//text(j))
         call self%level(j)%stepper%archive(file)
         call file%end_section()
      end do
   end subroutine extrapolation_archive_parts
end module dynstep_extrapolation
