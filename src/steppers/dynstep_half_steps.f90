! SPDX-License-Identifier: BSD-3-Clause
!> Both halves of a step of backinterpolation.  The forward one leads to y_a; the backward one is solved for the increment
!> D = Y - y, with
!>
!>   G(D) = D - (y_a - y) + (RK_q(t + h, y + D, -(1 - alpha) h) - (y + D)) = 0
!>
!> by Broyden's method from B0 = P_q(-(1 - alpha) h J), J = df/dy, whose inverse is a sum over the poles of R; with another
!> J than that of the solution the updates make up for the difference.  J is kept over steps while that goes well.  The
!> stopping test is that of a Newton step, component by component: |G| itself cannot be made smaller than its rounding
!> errors, which grow like (h |J|)^q.
!>
!> PROGRAMMING INTERFACE
!>
!>   halves%forward, %backward                     the formulas
!>   call halves%init(alpha, forward, backward, state_size, status)     allocates
!>   call halves%init_iteration(sys, r, status)    allocates; where D is to be found
!>   call halves%forget()                          J
!>   call halves%find(sys, state, h, t1, solver, newton, count, status)     %d, from %f0 and %da
!>   call halves%look(h, d, f0, f1)                %bend, where both halves were run and one of them is blind
module dynstep_half_steps
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: acceleration_solver
   use dynstep_archive, only: archive_type
   use dynstep_broyden, only: broyden_type
   use dynstep_equilibrium, only: newton_options
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_pole_tangents, only: pole_tangents
   use dynstep_polynomial, only: polynomial_value
   use dynstep_rational, only: rational_type
   use dynstep_runge_kutta_halves, only: runge_kutta_half
   use dynstep_status, only: dynstep_no_memory, dynstep_not_converged, status_type
   use dynstep_stepper, only: state_type, step_counters
   use dynstep_text, only: text
   implicit none
   private

   type, public :: half_steps
      real(wp) :: alpha = 0.5_wp                       !! part of the step that runs forward
      type(runge_kutta_half) :: forward
      type(runge_kutta_half), allocatable :: backward  !! allocatable, since gfortran 12 frees one component of a type alone
      real(wp), allocatable :: f0(:)                   !! y' at the start of the step [state_size]
      real(wp), allocatable :: da(:)                   !! y_a - y
      real(wp), allocatable :: ya(:)                   !! y_a, and points of the iteration
      real(wp), allocatable :: f1(:)                   !! y' at y_a, then sizes of the components
      real(wp), allocatable :: d(:)                    !! D
      real(wp), allocatable :: bend(:)                 !! of the step, see `look`
      type(pole_tangents), allocatable, private :: tangents
      type(broyden_type), private :: broyden
      complex(wp), allocatable, private :: rho(:)      ! 1/D(z) = sum of rho_j/(z - p_j)
      complex(wp), allocatable, private :: tau(:)      ! R(z) - 1 = sum of tau_j z/(z - p_j)
      logical, private :: renews = .false.             ! J is to be made anew at the next step
      integer, private :: best = 0                     ! iterations that a step took with a J of its own
      real(wp), allocatable, private :: g(:)           ! increment of the backward half, residual
      real(wp), allocatable, private :: z(:)           ! step of the iteration
      real(wp), allocatable, private :: sizes(:)       ! of the components
   contains
      procedure :: init => halves_init
      procedure :: init_iteration => halves_init_iteration
      procedure :: forget => halves_forget
      procedure :: find => halves_find
      procedure :: look => halves_look
      procedure :: archive => halves_archive
   end type half_steps

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

   !> A step of the iteration that is so much longer than the first one leads nowhere
   real(wp), parameter :: divergence = 10.0_wp

   !> See `look`
   real(wp), parameter :: least_half = 0.1_wp

   character(len=*), parameter :: advice = 'Stiff nonlinear problems: backinterpolation bears |h J| of some tens; p = q = 1 ' &
      & //'bears more, for mechanical systems take soi2'

contains

   !> Formulas of the halves that there are, and room for what they lead to
   recursive subroutine halves_init(self, alpha, forward, backward, state_size, status)
      class(half_steps), intent(inout) :: self
      real(wp), intent(in) :: alpha                    !! 0 .. 1
      integer, intent(in) :: forward, backward         !! formulas, see DYNSTEP_RUNGE_KUTTA_HALVES
      integer, intent(in) :: state_size
      type(status_type), intent(inout) :: status
      integer :: stat

      if (status%failed()) return
      self%alpha = alpha
      if (.not. allocated(self%backward)) allocate (self%backward)
      if (alpha > 0.0_wp) call self%forward%init(forward, state_size, status)
      if (alpha < 1.0_wp) call self%backward%init(backward, state_size, status)
      if (status%failed()) return
      if (allocated(self%tangents)) deallocate (self%tangents, self%rho, self%tau)
      if (allocated(self%g)) deallocate (self%g, self%z, self%sizes)
      if (allocated(self%f0)) deallocate (self%f0, self%da, self%ya, self%f1, self%d, self%bend)
      associate (n => state_size)
         allocate (self%f0(n), self%da(n), self%ya(n), self%f1(n), self%d(n), self%bend(n), source=0.0_wp, &
            & stat=stat)
         if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the steps of a state of '//text(n)//' numbers')
      end associate
   end subroutine halves_init

   !> Coefficients and workspace of the iteration for D, alpha < 1; `init` before it
   recursive subroutine halves_init_iteration(self, sys, r, status)
      class(half_steps), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      type(rational_type), intent(in) :: r             !! R(z)
      type(status_type), intent(inout) :: status
      integer :: n, stat

      if (status%failed()) return
      n = sys%state_size()
      allocate (self%tangents)
      call set_fractions(self, r)
      call self%tangents%init(sys, r%poles, status)
      call self%broyden%init(n, most_updates, status)
      if (status%failed()) return
      allocate (self%g(n), self%z(n), self%sizes(n), source=0.0_wp, stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the iterations of a state of '//text(n)//' numbers')
   end subroutine halves_init_iteration

   !> Partial fractions of 1/D(z) and of R(z) - 1, where the predictor has no polynomial part
   pure subroutine set_fractions(self, r)
      class(half_steps), intent(inout) :: self
      type(rational_type), intent(in) :: r
      complex(wp) :: slope, numerator
      integer :: j, k
      allocate (self%rho(r%q), self%tau(r%q))
      do j = 1, r%q
         associate (poles => r%poles)
            slope = -1.0_wp/poles(j)
            do k = 1, r%q
               if (k /= j) slope = slope*((poles(k) - poles(j))/poles(k))
            end do
            numerator = polynomial_value(r%num(:min(r%p, r%q)), poles(j))
            self%rho(j) = 1.0_wp/slope
            self%tau(j) = numerator/(poles(j)*slope)
         end associate
      end do
   end subroutine set_fractions

   !> J may have changed
   pure subroutine halves_forget(self)
      class(half_steps), intent(inout) :: self
      if (allocated(self%tangents)) call self%tangents%forget()
      self%renews = .false.
      self%best = 0
   end subroutine halves_forget

   !> D, with a J that is at hand, or else one of this step
   recursive subroutine halves_find(self, sys, state, h, t1, solver, newton, count, status)
      class(half_steps), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state            !! at the begin of the step
      real(wp), intent(in) :: h, t1
      type(acceleration_solver), intent(inout) :: solver
      type(newton_options), intent(in) :: newton
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      logical :: is_new
      integer :: iterations

      if (status%failed()) return
      is_new = .false.
      if (self%renews .or. .not. self%tangents%is_known) then
         call self%tangents%evaluate(sys, state%t, state%y, state%a, count, status)
         is_new = .true.
      end if
      do
         call self%tangents%factorize(h, state%t, count, status)
         call predict(self, sys, state, h, t1, solver, count, status)
         call iterate(self, sys, state%y, h, t1, solver, newton, count, iterations, status)
         if (.not. status%failed()) exit
         self%renews = .true.
         if (is_new .or. .not. status%retry .or. self%tangents%is_constant) return
         call status%clear()
         call self%tangents%evaluate(sys, state%t, state%y, state%a, count, status)
         is_new = .true.
      end do
      if (is_new) self%best = iterations
      self%renews = iterations > self%best + patience .and. .not. self%tangents%is_constant
   end subroutine halves_find

   !> A first D.  Where |h J| is small, by a step of the backward half's formula from y_a on; else by
   !> R(z) y - y = sum of tau_j (z - p_j)^-1 z y with h y' for z y, which is exact where y' = J y.
   recursive subroutine predict(self, sys, state, h, t1, solver, count, status)
      class(half_steps), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(acceleration_solver), intent(inout) :: solver
      type(step_counters), intent(inout) :: count
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
            call solver%derivative(sys, t_a, self%ya, self%f1, count, status)
         else
            self%ya = state%y
            self%f1 = self%f0
         end if
         if (status%failed()) return
         if (self%alpha > 0.0_wp .and. self%forward%needs_end) call self%forward%end_derivative(self%f1)
         if (self%backward%needs_end) call self%backward%end_derivative(self%f1)
      end if
      if (is_needed) then
         call self%backward%run(sys, t_a, self%ya, rest, solver, self%d, count, status, self%f1)
         self%d = self%da + self%d
      else
         self%g = h*self%f0
         call self%tangents%apply(self%tau, self%g, self%d, count)
      end if
      if (.not. status%failed()) call take_sizes(sys%n, state%y, self%d, self%f0, merge(h, 0.0_wp, is_needed), self%sizes)
   end subroutine predict

   !> Broyden's iteration for D from the predicted one
   recursive subroutine iterate(self, sys, y, h, t1, solver, newton, count, iterations, status)
      class(half_steps), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: y(:)
      real(wp), intent(in) :: h, t1
      type(acceleration_solver), intent(inout) :: solver
      type(newton_options), intent(in) :: newton
      type(step_counters), intent(inout) :: count
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
      do while (iterations < newton%limit)
         call residual(self, sys, y, h, t1, solver, count, status)
         if (status%failed()) then
            ! out of the domain: half of the way there
            if (.not. status%retry .or. halvings == newton%halvings) return
            call status%clear()
            halvings = halvings + 1
            count%halvings = count%halvings + 1
            self%z = 0.5_wp*self%z
            self%d = self%d - self%z
            call self%broyden%forget()
            is_measured = .false.
            cycle
         end if
         iterations = iterations + 1
         count%newton_iterations = count%newton_iterations + 1
         call self%tangents%apply(self%rho, self%g, self%z, count)
         self%z = -self%z/self%sizes
         if (.not. is_moderate(self%z)) exit
         call self%broyden%next(self%z)
         self%z = self%z*self%sizes
         length = maxval(abs(self%z)/max(abs(self%d), self%sizes))
         rate = 1.0_wp
         if (is_measured .and. length < previous) rate = length/previous
         if (rate > stagnant) then
            call rounding_of_step(self, sys%n, y, h, count, noise)
            if (noise > 0.0_wp) then
               ! where a unit is many eps, the step may be worse than what there is
               if (noise <= rounding*epsilon(1.0_wp)) self%d = self%d + self%z
               if (noise <= max(most_rounding, newton%tolerance)) return
               ! h |y'| is far below the rounding errors of y: the unit, eps |y|/h, is felt by no component
               if (length <= rounding*epsilon(1.0_wp)) return
               call status%set(dynstep_not_converged, 'rounding errors of the backward half-step to t = '//text(t1) &
                  & //' over h = '//text(h)//' are '//text(noise)//' of the state; reduce h.  '//trim(advice), retry=.true.)
               return
            end if
         end if
         self%d = self%d + self%z
         if (rate*length <= max(newton%tolerance, finest)) return
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
   recursive subroutine rounding_of_step(self, n, y, h, count, noise)
      class(half_steps), intent(inout) :: self
      integer, intent(in) :: n                       !! length of a block of components
      real(wp), intent(in) :: y(:), h
      type(step_counters), intent(inout) :: count
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
      call self%tangents%apply(self%rho, self%g, self%ya, count)
      unit = max(least, largest_of_block(n, self%ya, self%f1))
      if (length <= rounding*unit) noise = unit
   end subroutine rounding_of_step

   !> g = G(D)
   recursive subroutine residual(self, sys, y, h, t1, solver, count, status)
      class(half_steps), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: y(:)
      real(wp), intent(in) :: h, t1
      type(acceleration_solver), intent(inout) :: solver
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      self%ya = y + self%d
      call self%backward%run(sys, t1, self%ya, (self%alpha - 1.0_wp)*h, solver, self%g, count, status)
      self%g = (self%d - self%da) + self%g
   end subroutine residual

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

   !> What the errors of the halves do not see: that of the classical formula is zero where y' = f(t), that of Nystroem's where
   !> y' = J y.  The fifth divided difference of y, y' at the ends of the step and between its halves is h^5 y^(5)/120, in
   !> whatever way y came about;
   !>
   !>   bend = y[0, 0, alpha, alpha, 1, 1]/24,     at alpha = 1/2   -(D - h (f0 + 4 f_a + f1)/6)
   !>
   !> the error of Simpson's formula over the whole step, 16 times that over its halves.  O(h^5), at most the order of the
   !> errors of the halves.  Where one half is less than `least_half` of the step, rounding errors of D would
   !> be felt a hundred times, and bend is zero.
   pure subroutine halves_look(self, h, d, f0, f1)
      class(half_steps), intent(inout) :: self
      real(wp), intent(in) :: h
      real(wp), intent(in) :: d(:)                     !! D [state_size]
      real(wp), intent(in) :: f0(:), f1(:)             !! y' at the begin and at the end of the step [state_size]
      real(wp) :: rest
      self%bend = 0.0_wp
      rest = 1.0_wp - self%alpha
      if (min(self%alpha, rest) < least_half) return
      if (.not. (self%forward%is_blind .or. self%backward%is_blind)) return
      associate (alpha => self%alpha)
         self%bend = h*(f0/alpha**2 + f1/rest**2) - ((4.0_wp - 2.0_wp*alpha)/rest**3)*d &
            & + ((4.0_wp*alpha - 2.0_wp)/(alpha*rest)**3)*self%da
         if (self%forward%needs_end) then
            call self%forward%add_end_derivative(h/(alpha*rest)**2, self%bend)
         else
            call self%backward%add_end_derivative(h/(alpha*rest)**2, self%bend)
         end if
      end associate
      self%bend = self%bend/24.0_wp
   end subroutine halves_look

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

   !> J of the iteration, and how well it has served.  Broyden's updates are those of one step; the stages of the halves are
   !> read by the estimate of the last trial alone.
   recursive subroutine halves_archive(self, name, file)
      class(half_steps), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%expect('iterates', allocated(self%tangents))
      call file%item('renews', self%renews)
      call file%item('best', self%best)
      if (allocated(self%tangents)) call self%tangents%archive('tangents', file)
      call file%end_section()
      if (file%failed()) call self%forget()
   end subroutine halves_archive
end module dynstep_half_steps
