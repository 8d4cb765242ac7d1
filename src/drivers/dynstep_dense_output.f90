! SPDX-License-Identifier: BSD-3-Clause
!> The motion inside an accepted step, to the order of the method.
!>
!> A copy of the stepper makes m real steps of length h/(m + 1) from the left end of the step; y and y' at their ends and
!> at both ends of the step give a Hermite interpolant (DYNSTEP_HERMITE) with 2 (m + 2) conditions:
!>
!>   mechanics     y = [q; v], y' = [v; a]    error h^(2m + 4) in q and v, h^(2m + 3) in a     2m + 3 >= order
!>   first order   y, y'                      error h^(2m + 4) in y, h^(2m + 3) in y'          2m + 4 >= order
!>
!> q'' at the nodes is no condition on q: a step leaves an error h^(order + 1) in q, which a second derivative of the
!> interpolant of q would turn into h^(order - 1) in a.  Measured on two nonlinear oscillators: by the second derivative of
!> the quintic order 1.0 with Newmark's trapezoid and 3.0 with its extrapolation of order 4, by the first derivative of the
!> curve through v and a 2.0 and 4.0.
!>
!> For m = 0, q and v (or y) are those of `hermite_point`.  lambda and psi lie on straight lines.  m = 0 too where the system
!> has constraints, and for a method that takes them, which has a history: it is of order 2.
!>
!> PROGRAMMING INTERFACE
!>
!>     call stepper%start(sys, state, status)
!>     call dense%begin(stepper, sys, status)               copies the stepper, allocates
!>     call dense%build(sys, left, right, order, status)    after a step from `left` to `right`, both complete
!>     call dense%evaluate(sys, t, point)                   as often as wanted
!>     dense%last(), dense%node(k)                          nodes 0 .. last() for who keeps them
!>     dense%work                                           what `build` took
!>     call dense%forget()                                  after a jump, a change of parameters, a restart
!>
!>   `right` is what the step led to, before a jump of the state or of the right side there.
!>   The stepper of the run is not touched.  Where an inner step fails, `build` says so in `status`, and `evaluate` gives what
!>   both ends of the step alone determine.
module dynstep_dense_output
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_hermite, only: hermite_type
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, dynstep_not_converged, status_type
   use dynstep_stepper, only: allocate_state, copy_state, hermite_point, method_properties, multiplier_counts, state_type, &
      & step_counters, stepper_type, verdict_type
   use dynstep_text, only: text
   implicit none
   private

   !> m is not larger, which serves up to order 17 (18 of a first-order system).  Equidistant double nodes amplify rounding
   !> errors: measured on sin t, h = 1/4, with m = 3, 5, 7, 9, 11 to 0.5, 1.1, 5, 43, 530 eps in y and 4, 22, 220, 2800,
   !> 30000 eps/h in y'.  Higher orders are below rounding errors at any useful h.
   integer, parameter :: most_inner_steps = 7

   !> Trials of one inner step that a method with its own choice of order may take
   integer, parameter :: most_parts = 64      ! of a step inside that does not meet the tolerance
   integer, parameter :: most_trials = 4

   type, public :: dense_output_type
      type(step_counters) :: work                      !! of the last `build`; no steps and rejections
      class(stepper_type), allocatable, private :: helper
      type(hermite_type), private :: curve
      type(state_type), allocatable, private :: nodes(:)   ! 0 .. m + 1, and a trial as the last one
      integer, private :: m = 0                        ! inner steps of the last build
      integer, private :: most = 0                     ! inner steps that there is room for
      real(wp), private :: h = 0.0_wp                  ! of the last inner steps
      logical, private :: is_tabulated = .false.
   contains
      procedure :: begin => dense_begin
      procedure :: forget => dense_forget
      procedure :: build => dense_build
      procedure :: evaluate => dense_evaluate
      procedure :: last => dense_last
      procedure :: node => dense_node
      procedure :: archive => dense_archive
   end type dense_output_type

contains

   !> Number m of inner steps for a result of an order, without constraints
   pure integer function inner_steps(sys, order)
      class(ode_system), intent(in) :: sys
      integer, intent(in) :: order
      select type (sys)
      class is (mechanical_system)
         inner_steps = (order - 2)/2
      class default
         inner_steps = (order - 3)/2
      end select
      inner_steps = min(max(0, inner_steps), most_inner_steps)
   end function inner_steps

   !> Copy a stepper that is started on `sys` (and prepared, where steps are chosen by a norm).  Allocates for the highest
   !> order that the method may choose.
   recursive subroutine dense_begin(self, stepper, sys, status)
      class(dense_output_type), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      type(method_properties) :: facts
      integer :: k, m, p, stat

      if (status%failed()) return
      if (.not. (stepper%is_started .and. stepper%fits(sys))) then
         call status%set(dynstep_invalid_input, 'dense output needs a method that is started on its system: call start before')
         return
      end if
      if (allocated(self%nodes)) deallocate (self%nodes)
      if (allocated(self%helper)) deallocate (self%helper)
      facts = stepper%properties()
      call multiplier_counts(sys, m, p)
      self%most = 0
      if (m + p == 0 .and. facts%multiplier_order == 0) self%most = inner_steps(sys, max(facts%order, facts%highest_order))
      self%m = 0
      self%h = 0.0_wp
      self%is_tabulated = .false.
      call self%work%zero()
      allocate (self%nodes(0:self%most + 2), stat=stat)
      if (stat == 0 .and. self%most > 0) allocate (self%helper, source=stepper, stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for the dense output of a state of '//text(sys%state_size())//' numbers')
         return
      end if
      do k = 0, self%most + 2
         call allocate_state(sys, self%nodes(k), status)
      end do
      call self%curve%reserve(sys%state_size(), sys%n, self%most + 2, status)
   end subroutine dense_begin

   !> What the copy knows of the system's matrices and parameters holds no longer
   recursive subroutine dense_forget(self)
      class(dense_output_type), intent(inout) :: self
      if (allocated(self%helper)) call self%helper%reset()
   end subroutine dense_forget

   !> The interpolant of a step.  On a failed status it is there too, through both ends alone.
   recursive subroutine dense_build(self, sys, left, right, order, status, norm)
      class(dense_output_type), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left, right      !! accepted states, with their accelerations
      integer, intent(in) :: order                     !! of the step
      type(status_type), intent(inout) :: status
      type(error_norm_type), intent(in), optional :: norm   !! of a run that chooses its steps by it
      type(status_type) :: cause

      call self%work%zero()
      self%is_tabulated = .false.
      self%m = 0
      call copy_state(left, self%nodes(0))
      if (self%most > 0) then
         self%m = min(inner_steps(sys, order), self%most)
         call step_inside(self, sys, right, cause, norm)
      end if
      if (cause%failed()) self%m = 0
      call copy_state(right, self%nodes(self%m + 1))
      if (cause%failed() .and. .not. status%failed()) call status%set(cause%code, 'dense output from t = '//text(left%t) &
         & //' to '//text(right%t)//' is of lower order, for a step inside failed: '//trim(cause%message), retry=cause%retry)
   end subroutine dense_build

   !> States 1 .. m by the helper, whose counters go on
   recursive subroutine step_inside(self, sys, right, status, norm)
      class(dense_output_type), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: right
      type(status_type), intent(inout) :: status
      type(error_norm_type), intent(in), optional :: norm
      type(step_counters) :: before
      real(wp) :: h
      integer :: k

      before = self%helper%count
      h = (right%t - self%nodes(0)%t)/real(self%m + 1, wp)
      ! steps of one length, whose ends t are rounded, share their factors
      if (abs(h - self%h) <= 2.0_wp*spacing(max(abs(right%t), abs(self%nodes(0)%t)))) h = self%h
      self%h = h
      associate (trial => self%nodes(self%most + 2))
         do k = 1, self%m
            associate (t1 => self%nodes(0)%t + real(k, wp)*h)
               if (present(norm)) then
                  call step_within(self%helper, sys, self%nodes(k - 1), t1, norm, self%nodes(k), trial, status)
               else
                  call copy_state(self%nodes(k - 1), self%nodes(k))
                  call self%helper%try_step(sys, self%nodes(k), h, t1, trial, status)
                  if (.not. status%failed()) call self%helper%accept(self%nodes(k), trial)
               end if
            end associate
            if (status%failed()) exit
         end do
      end associate
      self%work = difference(self%helper%count, before)
   end subroutine step_inside

   !> From `left` to t1 within the tolerance: in halves, quarters, ... where one step does not meet it.  An order that was
   !> chosen for other steps may be too low for one of this length.
   recursive subroutine step_within(helper, sys, left, t1, norm, state, trial, status)
      class(stepper_type), intent(inout) :: helper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: left
      real(wp), intent(in) :: t1
      type(error_norm_type), intent(in) :: norm
      type(state_type), intent(inout) :: state, trial     !! its end, workspace
      type(status_type), intent(inout) :: status
      real(wp) :: h, t
      integer :: parts, i
      parts = 1
      do
         call copy_state(left, state)
         h = (t1 - left%t)/real(parts, wp)
         do i = 1, parts
            t = t1 - real(parts - i, wp)*h
            call try_inside(helper, sys, state, h, t, norm, trial, status)
            if (status%failed()) exit
            call helper%accept(state, trial)
         end do
         if (.not. (status%failed() .and. status%retry) .or. parts >= most_parts) return
         call status%clear()
         parts = 2*parts
      end do
   end subroutine step_within

   !> A step whose length is given: the method may raise its order from trial to trial.  Where it does not, one that is
   !> complete is taken with an estimate above 1, as the step that contains it was good.
   recursive subroutine try_inside(helper, sys, state, h, t1, norm, trial, status)
      class(stepper_type), intent(inout) :: helper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(error_norm_type), intent(in) :: norm
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status
      type(verdict_type) :: verdict
      integer :: trials, order
      order = 0
      do trials = 1, most_trials
         call helper%try_within(sys, state, h, t1, norm, trial, verdict, status)
         if (status%failed()) return
         if (verdict%is_converged .and. (verdict%error <= 1.0_wp .or. verdict%order == order)) return
         order = verdict%order
      end do
      if (.not. verdict%is_converged) call status%set(dynstep_not_converged, 'the step from t = '//text(state%t)//' of length ' &
         & //text(h)//' does not meet the tolerance', retry=.true.)
   end subroutine try_inside

   !> after - before, without what counts steps of a run
   pure function difference(after, before) result(work)
      type(step_counters), intent(in) :: after, before
      type(step_counters) :: work
      work%forces = after%forces - before%forces
      work%masses = after%masses - before%masses
      work%tangents = after%tangents - before%tangents
      work%constraints = after%constraints - before%constraints
      work%factorizations = after%factorizations - before%factorizations
      work%solves = after%solves - before%solves
      work%newton_iterations = after%newton_iterations - before%newton_iterations
      work%halvings = after%halvings - before%halvings
   end function difference

   !> q, v, a, lambda, psi (y and y') at time t inside the step; at a node they are those of the node
   recursive subroutine dense_evaluate(self, sys, t, point)
      class(dense_output_type), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      real(wp), intent(in) :: t
      type(state_type), intent(inout) :: point         !! its arrays are allocated
      real(wp) :: s
      integer :: k

      associate (left => self%nodes(0), right => self%nodes(self%m + 1))
         call hermite_point(sys, left, right, t, point)
         if (.not. self%is_tabulated) call tabulate(self)
         s = (t - left%t)/(right%t - left%t)
         if (self%m > 0) call self%curve%value(s, point%y)
         if (self%m > 0 .or. size(point%a) < size(point%y)) call self%curve%derivative(s, point%a)
      end associate
      do k = 0, self%m + 1
         if (abs(t - self%nodes(k)%t) > 0.0_wp) cycle
         point%y(:) = self%nodes(k)%y
         point%a(:) = self%nodes(k)%a
      end do
   end subroutine dense_evaluate

   !> Nodes are where the helper's steps of equal lengths end, whatever a large t rounds them to
   recursive subroutine tabulate(self)
      class(dense_output_type), intent(inout) :: self
      integer :: k
      call self%curve%begin(self%m + 2, self%nodes(self%m + 1)%t - self%nodes(0)%t)
      do k = 0, self%m + 1
         call self%curve%put(k + 1, real(k, wp)/real(self%m + 1, wp), self%nodes(k)%y, self%nodes(k)%a)
      end do
      call self%curve%tabulate()
      self%is_tabulated = .true.
   end subroutine tabulate

   !> Number m + 1 of the node at the right end
   pure integer function dense_last(self)
      class(dense_output_type), intent(in) :: self
      dense_last = self%m + 1
   end function dense_last

   !> Node k = 0 (left end) .. last() (right end); the multipliers of inner nodes are not set
   recursive subroutine dense_node(self, k, state)
      class(dense_output_type), intent(in) :: self
      integer, intent(in) :: k
      type(state_type), intent(inout) :: state         !! its arrays are allocated
      call copy_state(self%nodes(k), state)
   end subroutine dense_node

   !> What later interpolants depend on, to a checkpoint or from it; `begin` was called before
   recursive subroutine dense_archive(self, file)
      class(dense_output_type), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%section('dense output')
      call file%expect('has_helper', allocated(self%helper))
      call file%item('h', self%h)
      if (allocated(self%helper)) call self%helper%archive(file)
      call file%end_section()
   end subroutine dense_archive
end module dynstep_dense_output
