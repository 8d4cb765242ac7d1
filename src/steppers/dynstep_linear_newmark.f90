! SPDX-License-Identifier: BSD-3-Clause
!> Newmark's method for M q'' + C q' + K q = p(t) with constant matrices (Austin 1991,
!> eqs. (27), (28)): one factorization for each step length, no iteration, no callback but LOAD.
!>
!> PROGRAMMING INTERFACE
!>
!>   type(linear_newmark) :: engine
!>   call engine%init(sys, beta, gamma, status)             chooses structure and kernel, allocates
!>   call engine%reset(sys)                                 reads the matrices again
!>   call engine%start(sys, t, y, a, status, count)         a = M^-1 (p - C v - K q), eq. (20)
!>   call engine%prepare(sys, h, t, status, count)          factorizes S where h is a new one
!>   call engine%advance(sys, clock, y, a, steps, complete, status, count)
!>   call engine%step(sys, t, h, t1, y, a, complete, status, count)     one step
!>   engine%needs_acceleration()
!>
!>   y = [q; v].  ADVANCE makes `steps` steps of length clock%h in place and counts them in
!>   clock%k; how a run is cut into calls does not change a bit.  On failure y, a, clock are those
!>   of the last step that was made.  Where needs_acceleration() is false (beta = 1/4,
!>   gamma = 1/2), a is computed from y at the end, if `complete` asks for it or a step fails;
!>   else it is part of the state.  ADVANCE and STEP call PREPARE themselves.
!>   COUNT gets forces (evaluations of the load), factorizations and solves, not steps.
!>
!>   The load is evaluated once at each new time, some steps ahead of the state for n <= 8,
!>   and again at the begin of each call (an input that the caller changes between two calls
!>   acts from there on).  The matrices are those that `init` or `reset` saw; `reset` allows
!>   other entries, not another structure.
module dynstep_linear_newmark
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: wp
   use dynstep_linear_load, only: evaluate_load
   use dynstep_linear_modal, only: is_modal, linear_modal
   use dynstep_linear_system, only: linear_system, load_none
   use dynstep_linear_tiny, only: linear_tiny, tiny_order
   use dynstep_linear_vector, only: linear_vector
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_identity, kind_zero, matrix_type
   use dynstep_newmark_form, only: choose_form, form_two_solves, frequency_bounds, newmark_form
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, dynstep_singular_matrix, status_type
   use dynstep_stepper, only: clock_type, step_counters
   use dynstep_text, only: text
   implicit none
   private

   integer, parameter :: kernel_tiny = 1      ! n <= 8: many steps in a call
   integer, parameter :: kernel_modal = 2     ! all diagonal
   integer, parameter :: kernel_vector = 3    ! any structure

   !> Steps for which loads are evaluated ahead, n <= 8: enough to hide the call of a kernel
   integer, parameter :: block_length = 32

   !> Halvings of the step in search of one that a growing mode allows
   integer, parameter :: halvings = 40

   type, public :: linear_newmark
      private
      integer :: n = 0
      real(wp) :: beta = 0.25_wp, gamma = 0.5_wp
      logical :: trapezoidal = .true.            ! beta = 1/4, gamma = 1/2
      logical :: damped = .false.                ! there is a C
      logical :: mass_is_plain = .true.          ! identity or diagonal
      logical :: mass_is_ready = .false.         ! `mass` is factorized
      logical :: same_as_mass = .false.          ! S = M for any h
      integer :: kernel = kernel_vector
      real(wp) :: softest = 0.0_wp, stiffest = 0.0_wp  ! bounds of frequencies,
      real(wp) :: slowest = 0.0_wp, fastest = 0.0_wp   ! and damping rates
      real(wp) :: h = 0.0_wp                     ! step length that all is prepared for, 0: none
      real(wp) :: remade_h = 0.0_wp              ! that of a run that goes on here, prepared without being counted, 0: none
      logical :: remakes_mass = .false.          ! `mass` was factorized in that run
      type(newmark_form) :: form
      type(matrix_type) :: s                     ! M + gamma h C + beta h^2 K
      type(factorization_type) :: factor, mass   ! of S, of M
      type(linear_tiny) :: tiny
      type(linear_modal) :: modal
      type(linear_vector) :: vector
      real(wp), allocatable :: p(:, :)           ! loads [n, 0:block]
   contains
      procedure :: init => engine_init
      procedure :: reset => engine_reset
      procedure :: start => engine_start
      procedure :: prepare => engine_prepare
      procedure :: advance => engine_advance
      procedure :: step => engine_step
      procedure :: needs_acceleration => engine_needs_acceleration
      procedure :: archive => engine_archive
   end type linear_newmark

contains

   !> Choose structure of S and kernel; allocate
   recursive subroutine engine_init(self, sys, beta, gamma, status)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: beta, gamma           !! beta >= 0
      type(status_type), intent(inout) :: status
      integer :: n, stat

      if (status%failed()) return
      if (.not. (ieee_is_finite(beta) .and. ieee_is_finite(gamma))) then
         call status%set(dynstep_invalid_input, 'beta and gamma must be finite')
      else if (beta < 0.0_wp .or. gamma < 0.0_wp) then
         call status%set(dynstep_invalid_input, 'beta = '//text(beta)//', gamma = '//text(gamma) &
            & //': both must be >= 0')
      else if (sys%n < 1 .or. sys%m%n /= sys%n) then
         call status%set(dynstep_invalid_input, 'the linear system has no matrices yet; call set first')
      end if
      if (status%failed()) return
      n = sys%n
      self%n = n
      self%beta = beta
      self%gamma = gamma
      self%trapezoidal = abs(beta - 0.25_wp) <= 0.0_wp .and. abs(gamma - 0.5_wp) <= 0.0_wp
      self%damped = sys%c%kind /= kind_zero
      self%mass_is_plain = sys%m%kind <= kind_diagonal
      self%same_as_mass = .not. beta > 0.0_wp .and. .not. (self%damped .and. gamma > 0.0_wp)
      if (.not. self%same_as_mass) call init_matrix(self, sys, status)
      call self%mass%init(sys%m%kind, n, sys%m%kl, sys%m%ku, sys%m%symmetric, status)
      if (status%failed()) return

      self%kernel = kernel_vector
      if (n <= tiny_order) self%kernel = kernel_tiny
      if (is_modal(sys)) self%kernel = kernel_modal
      if (self%kernel == kernel_modal) call self%modal%init(n, status)
      if (self%kernel == kernel_vector) call self%vector%init(sys, status)
      if (status%failed()) return
      if (allocated(self%p)) deallocate (self%p)
      allocate (self%p(n, 0:merge(block_length, 1, self%kernel == kernel_tiny)), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory to step '//text(n)//' coordinates')
         return
      end if
      call self%reset(sys)
   end subroutine engine_init

   !> Read the entries of the matrices again; their structure is that of `init`
   recursive subroutine engine_reset(self, sys)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      self%h = 0.0_wp
      self%remade_h = 0.0_wp
      self%mass_is_ready = .false.
      self%remakes_mass = .false.
      call frequency_bounds(sys%m, sys%k, self%softest, self%stiffest)
      self%softest = sqrt(self%softest)
      self%stiffest = sqrt(self%stiffest)
      call frequency_bounds(sys%m, sys%c, self%slowest, self%fastest)
      if (self%kernel == kernel_tiny) call self%tiny%init(sys)
      if (self%kernel == kernel_modal) call self%modal%read_matrices(sys)
      if (self%kernel == kernel_vector) call self%vector%read_matrices(sys)
   end subroutine engine_reset

   !> Kind and bandwidths of S
   recursive subroutine init_matrix(self, sys, status)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer :: kind, kl, ku
      logical :: symmetric

      kind = kind_diagonal
      kl = 0
      ku = 0
      symmetric = .true.
      call include_matrix(sys%m)
      if (self%damped .and. self%gamma > 0.0_wp) call include_matrix(sys%c)
      if (self%beta > 0.0_wp) call include_matrix(sys%k)
      call self%s%init(kind, self%n, kl, ku, symmetric, status)
      call self%factor%init(kind, self%n, kl, ku, symmetric, status)

   contains

      recursive subroutine include_matrix(a)
         type(matrix_type), intent(in) :: a
         kind = max(kind, a%kind)
         if (a%kind == kind_banded) then
            kl = max(kl, a%kl)
            ku = max(ku, a%ku)
         end if
         symmetric = symmetric .and. a%symmetric
      end subroutine include_matrix
   end subroutine init_matrix

   !> True where a step reads the acceleration of its begin
   pure logical function engine_needs_acceleration(self)
      class(linear_newmark), intent(in) :: self
      engine_needs_acceleration = .not. self%trapezoidal
   end function engine_needs_acceleration

   !> Acceleration of a start
   recursive subroutine engine_start(self, sys, t, y, a, status, count)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(2*self%n)
      real(wp), intent(out) :: a(self%n)
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count

      a = 0.0_wp
      if (status%failed()) return
      call factorize_mass(self, sys, t, status, count)
      call evaluate_load(sys, self%n, t, self%p(:, 0), status, count)
      if (status%failed()) return
      call accelerate(self, sys, self%p(:, 0), y, a, count)
   end subroutine engine_start

   recursive subroutine factorize_mass(self, sys, t, status, count)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: t
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count

      if (status%failed() .or. self%mass_is_ready) return
      call self%mass%factorize(sys%m, status, t, 'mass matrix')
      if (.not. (self%mass_is_plain .or. self%remakes_mass)) count%factorizations = count%factorizations + 1
      self%remakes_mass = .false.
      if (status%failed()) then
         if (self%mass%singular_equation > 0) &
            & call status%set(dynstep_singular_matrix, trim(status%message)//'; condense coordinates that ' &
            & //'have no mass, or give them one')
         return
      end if
      self%mass_is_ready = .true.
   end subroutine factorize_mass

   !> a = M^-1 (p - C v - K q), eq. (20); M has been factorized
   recursive subroutine accelerate(self, sys, p, y, a, count)
      class(linear_newmark), intent(in) :: self
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: p(self%n)
      real(wp), intent(in) :: y(2*self%n)
      real(wp), intent(out) :: a(self%n)
      type(step_counters), intent(inout) :: count
      a = 0.0_wp
      if (sys%load_kind /= load_none) a = p
      call sys%c%multiply_add(-1.0_wp, y(self%n + 1:), a)
      call sys%k%multiply_add(-1.0_wp, y, a)
      call self%mass%solve(a)
      if (.not. self%mass_is_plain) count%solves = count%solves + 1
   end subroutine accelerate

   !> Factorize S = M + gamma h C + beta h^2 K where h is not the one in force
   recursive subroutine engine_prepare(self, sys, h, t, status, count)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: h                       !! /= 0, of either sign
      real(wp), intent(in) :: t                       !! time, for the sentence
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      type(step_counters) :: uncounted
      logical :: growing, is_remade

      if (status%failed() .or. h == self%h .and. self%h /= 0.0_wp) return
      if (.not. (ieee_is_finite(h) .and. abs(h) > 0.0_wp)) then
         call status%set(dynstep_invalid_input, 'the step length h = '//text(h)//' must be finite and not 0')
         return
      end if
      self%h = 0.0_wp
      is_remade = abs(self%remade_h) > 0.0_wp .and. .not. abs(h - self%remade_h) > 0.0_wp
      self%remade_h = 0.0_wp
      call choose_form(self%form, self%beta, self%gamma, h, self%trapezoidal, self%softest, self%stiffest, &
         & self%slowest, self%fastest)
      if (self%same_as_mass) then
         call factorize_mass(self, sys, t, status, count)
         if (status%failed()) return
         if (self%kernel == kernel_tiny) call self%tiny%invert(self%form, sys%m, self%mass)
      else
         if (is_remade) then
            call factorize(self, sys, h, growing, status, uncounted, t)
         else
            call factorize(self, sys, h, growing, status, count, t)
         end if
         if (growing) call refuse_growing(self, sys, h, t, status, count)
         if (status%failed()) then
            status%retry = .true.
            return
         end if
         if (self%kernel == kernel_tiny) call self%tiny%invert(self%form, self%s, self%factor)
         if (self%kernel == kernel_vector) call self%vector%prepare(self%form, self%s, self%factor)
      end if
      if (self%kernel == kernel_modal) call self%modal%prepare(self%beta, self%gamma, h, self%trapezoidal)
      self%h = h
   end subroutine engine_prepare

   !> Form and factorize S; `growing` where it is indefinite while M is positive definite:
   !> h lies beyond the pole of a growing mode, and the step would turn its sign
   recursive subroutine factorize(self, sys, h, growing, status, count, t)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: h
      logical, intent(out) :: growing
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      real(wp), intent(in) :: t
      type(status_type) :: mass_status

      growing = .false.
      call self%s%set_zero()
      call sys%m%add_to(1.0_wp, self%s)
      if (self%damped) call sys%c%add_to(self%gamma*h, self%s)
      if (self%beta > 0.0_wp) call sys%k%add_to(self%beta*h*h, self%s)
      call self%factor%factorize(self%s, status, t, 'matrix M + gamma h C + beta h^2 K')
      count%factorizations = count%factorizations + 1
      if (self%factor%positive_definite .or. .not. self%s%symmetric) return
      call factorize_mass(self, sys, t, mass_status, count)
      growing = self%mass%positive_definite
   end subroutine factorize

   !> The sentence for a step that is too long, with one that is not
   recursive subroutine refuse_growing(self, sys, h, t, status, count)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: h, t
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      type(status_type) :: trial_status
      real(wp) :: shorter
      logical :: growing
      integer :: i

      shorter = h
      do i = 1, halvings
         shorter = 0.5_wp*shorter
         call trial_status%clear()
         call factorize(self, sys, shorter, growing, trial_status, count, t)
         if (.not. growing) exit
      end do
      call status%set(dynstep_singular_matrix, 'M + gamma h C + beta h^2 K is indefinite at t = '//text(t) &
         & //', h = '//text(h)//': the step is too long for a growing mode (negative stiffness or damping), use |h| <= ' &
         & //text(abs(shorter)), retry=.true.)
   end subroutine refuse_growing

   !> `steps` steps of length clock%h in place
   recursive subroutine engine_advance(self, sys, clock, y, a, steps, complete, status, count)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(inout) :: sys
      type(clock_type), intent(inout) :: clock
      real(wp), intent(inout) :: y(2*self%n)
      real(wp), intent(inout) :: a(self%n)
      integer, intent(in) :: steps                    !! >= 0
      logical, intent(in) :: complete                 !! a is wanted after the last step
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      integer :: done, made, now

      if (status%failed()) return
      call begin(self, sys, clock%time(), clock%h, complete, status, count)
      if (status%failed()) return
      now = 0
      done = 0
      do while (done < steps .and. .not. status%failed())
         call make_steps(self, sys, clock, steps - done, y(1:self%n), y(self%n + 1:), a, made, now, status, count)
         clock%k = clock%k + made
         done = done + made
      end do
      if (self%trapezoidal .and. self%mass_is_ready .and. (complete .or. status%failed())) &
         & call accelerate(self, sys, self%p(:, now), y, a, count)
   end subroutine engine_advance

   !> What steps from time t on need: S, M for the acceleration at the end, the load at t
   recursive subroutine begin(self, sys, t, h, complete, status, count)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: t, h
      logical, intent(in) :: complete
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      if (h /= self%h .or. abs(h) <= 0.0_wp) call self%prepare(sys, h, t, status, count)
      if (.not. self%trapezoidal) return
      if (complete .and. .not. self%mass_is_ready) call factorize_mass(self, sys, t, status, count)
      if (sys%load_kind /= load_none) call evaluate_load(sys, self%n, t, self%p(:, 0), status, count)
   end subroutine begin

   !> Some steps, at most `most` and as many as there is room for loads
   recursive subroutine make_steps(self, sys, clock, most, q, v, a, made, now, status, count)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(inout) :: sys
      type(clock_type), intent(in) :: clock
      integer, intent(in) :: most
      real(wp), intent(inout) :: q(self%n), v(self%n), a(self%n)
      integer, intent(out) :: made                    !! steps made
      integer, intent(inout) :: now                   !! column of p for the present time
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      logical :: loaded

      loaded = sys%load_kind /= load_none
      if (self%kernel == kernel_tiny) then
         if (.not. loaded) then
            made = most
         else
            do made = 1, min(most, block_length)
               call evaluate_load(sys, self%n, clock%time(made), self%p(:, made), status, count)
               if (status%failed()) exit
            end do
            made = made - 1
         end if
         call self%tiny%advance(self%form, made, loaded, self%p, q, v, a)
         if (loaded) self%p(:, 0) = self%p(:, made)
      else
         made = 0
         call evaluate_load(sys, self%n, clock%time(1), self%p(:, 1 - now), status, count)
         if (status%failed()) return
         made = 1
         call one_step(self, sys, loaded, self%p(:, now), self%p(:, 1 - now), q, v, a)
         now = 1 - now
      end if
      call count_solves(self, made, count)
   end subroutine make_steps

   pure subroutine count_solves(self, steps, count)
      class(linear_newmark), intent(in) :: self
      integer, intent(in) :: steps
      type(step_counters), intent(inout) :: count
      if (self%same_as_mass .and. self%mass_is_plain) return
      count%solves = count%solves + steps
      if (self%kernel /= kernel_modal .and. self%form%form == form_two_solves) count%solves = count%solves + steps
   end subroutine count_solves

   !> One step of length h from t to t1, which is t + h up to rounding
   recursive subroutine engine_step(self, sys, t, h, t1, y, a, complete, status, count)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: t, h, t1
      real(wp), intent(inout) :: y(2*self%n)
      real(wp), intent(inout) :: a(self%n)
      logical, intent(in) :: complete                 !! a is wanted after the step
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count

      if (status%failed()) return
      call begin(self, sys, t, h, complete, status, count)
      call evaluate_load(sys, self%n, t1, self%p(:, 1), status, count)
      if (status%failed()) return
      associate (loaded => sys%load_kind /= load_none)
         if (self%kernel == kernel_tiny) then
            call self%tiny%advance(self%form, 1, loaded, self%p, y(1:self%n), y(self%n + 1:), a)
         else
            call one_step(self, sys, loaded, self%p(:, 0), self%p(:, 1), y(1:self%n), y(self%n + 1:), a)
         end if
      end associate
      call count_solves(self, 1, count)
      if (self%trapezoidal .and. complete) call accelerate(self, sys, self%p(:, 1), y, a, count)
   end subroutine engine_step

   !> One step, n > 8
   pure subroutine one_step(self, sys, loaded, p0, p1, q, v, a)
      class(linear_newmark), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p0(self%n), p1(self%n)
      real(wp), intent(inout) :: q(self%n), v(self%n), a(self%n)
      if (self%kernel == kernel_modal) then
         call self%modal%step(loaded, p0, p1, q, v, a)
      else if (self%same_as_mass) then
         call self%vector%step(sys, self%form, self%mass, loaded, p0, p1, q, v, a)
      else
         call self%vector%step(sys, self%form, self%factor, loaded, p0, p1, q, v, a)
      end if
   end subroutine one_step

   !> The step length in force.  What belongs to it follows from the system, to the last bit, and is made at the next use:
   !> S and its factors, kernels, forms.  That work is not counted again.
   recursive subroutine engine_archive(self, name, file)
      class(linear_newmark), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      real(wp) :: h
      logical :: mass_is_ready
      call file%section(name)
      call file%expect('n', self%n)
      call file%expect('kernel', self%kernel)
      h = self%h
      if (abs(self%remade_h) > 0.0_wp) h = self%remade_h
      mass_is_ready = self%mass_is_ready .or. self%remakes_mass
      call file%item('h', h)
      call file%item('mass_is_ready', mass_is_ready)
      call file%end_section()
      if (.not. file%is_reading) return
      self%h = 0.0_wp
      self%mass_is_ready = .false.
      self%remade_h = 0.0_wp
      self%remakes_mass = mass_is_ready .and. .not. file%failed()
      if (.not. file%failed()) self%remade_h = h
   end subroutine engine_archive
end module dynstep_linear_newmark
