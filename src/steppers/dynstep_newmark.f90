! SPDX-License-Identifier: BSD-3-Clause
!> Newmark's method (Austin 1991, eqs. (20)-(25)):
!>
!>   v1 = v0 + h [(1 - gamma) a0 + gamma a1]                                       (24)
!>   q1 = q0 + h v0 + h^2/2 [(1 - 2 beta) a0 + 2 beta a1]                          (25)
!>   M(t1,q1,v1) a1 = f(t1,q1,v1)                                                  (21)
!>
!> PROGRAMMING INTERFACE
!>
!>     type(newmark_stepper) :: stepper          ! beta = 1/4, gamma = 1/2: the trapezoid
!>     stepper%beta = 1.0_wp/6.0_wp
!>
!>   gamma = 1/2 is of order 2 and symmetric for any beta (section 6.2).  Named members:
!>   beta = 1/4 average acceleration, 1/6 linear acceleration, 1/12 Fox and Goodwin, 0 central
!>   differences.  With beta = 0 and a velocity-free system the step is explicit: one force,
!>   and one solve with M unless M is the identity.  A linear_system is stepped by
!>   DYNSTEP_LINEAR_NEWMARK: constant matrices, no force procedure, no iteration.
module dynstep_newmark
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_acceleration_guess, only: acceleration_guess
   use dynstep_accelerations, only: acceleration_solver, check_callback, check_finite
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_equilibrium, only: equilibrium_solver, newton_options
   use dynstep_kinds, only: long, wp
   use dynstep_linear_newmark, only: linear_newmark
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_identity
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_finite, status_type
   use dynstep_start_check, only: check_mechanical, check_start
   use dynstep_stepper, only: advance_by_trials, clock_type, method_properties, state_type, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: newton_options

   integer, parameter :: way_newton = 0     ! implicit, general force
   integer, parameter :: way_explicit = 1   ! beta = 0, no velocities in f and M
   integer, parameter :: way_scalar = 2     ! as way_newton, for one linear equation with M = 1
   integer, parameter :: way_linear = 3     ! linear_system

   type, extends(stepper_type), public :: newmark_stepper
      real(wp) :: beta = 0.25_wp               !! any value >= 0
      real(wp) :: gamma = 0.5_wp               !! any value >= 0; 1/2: no numerical damping
      type(newton_options) :: newton           !! limits and tolerance of Newton's iteration
      integer, private :: way = way_newton
      real(wp), private :: made_for(2) = -1.0_wp  ! beta and gamma at `init`
      logical, private :: reads_again = .false.   ! way_linear: the matrices may have new entries
      ! allocatable: a system pays for one of them only, and gfortran 12 loses the matrices
      ! inside a plain component when a class(stepper_type) is deallocated
      type(linear_newmark), allocatable, private :: linear           ! way_linear
      type(equilibrium_solver), allocatable, private :: equilibrium  ! way_newton, way_scalar
      type(acceleration_solver), allocatable, private :: start_solver! all but way_linear
      type(acceleration_guess), private :: guess             ! way_newton, where errors are allowed
   contains
      procedure :: properties => newmark_properties
      procedure :: init => newmark_init
      procedure :: reset => newmark_reset
      procedure :: start => newmark_start
      procedure :: try_step => newmark_try_step
      procedure :: advance => newmark_advance
      procedure :: needs_acceleration => newmark_needs_acceleration
      procedure :: archive_parts => newmark_archive_parts
      procedure :: aim => newmark_aim
      procedure :: follow => newmark_follow
   end type newmark_stepper

   !> Stiffness ratio c_q |K|/M above which dv = 0, and then dq = 0, predict better than
   !> a1 = a0.  The predictor a1 = a0 puts an error of epsilon (omega h)^2 into q, dv = 0 one of
   !> epsilon omega h, dq = 0 none, but it makes v1 a difference of larger numbers at small
   !> omega h, which drifts (see docs/theory/newmark-extrapolation.md).
   real(wp), parameter :: predict_velocity_above = 2.0_wp
   real(wp), parameter :: predict_position_above = 2.0e5_wp

contains

   recursive function newmark_properties(self) result(facts)
      class(newmark_stepper), intent(in) :: self
      type(method_properties) :: facts
      facts%name = 'newmark'
      facts%source = 'Austin 1991, eqs. (20)-(25)'
      facts%order = 1
      if (ieee_is_finite(self%gamma)) facts%order = merge(1, 2, abs(self%gamma - 0.5_wp) > 0.0_wp)
      facts%acceleration_order = facts%order
      facts%stages = 1
      facts%symmetric = facts%order == 2
      facts%mechanical = .true.
      facts%stability_limit = stability_limit(self%beta, self%gamma)
      if (facts%symmetric) facts%newmark_beta = self%beta
   end function newmark_properties

   !> Largest omega*h of an undamped oscillator with |eigenvalues| <= 1 (T. J. R. Hughes, The
   !> Finite Element Method, 1987, section 9.1: unconditional for 2 beta >= gamma >= 1/2)
   pure real(wp) function stability_limit(beta, gamma)
      real(wp), intent(in) :: beta, gamma
      if (.not. (ieee_is_finite(beta) .and. ieee_is_finite(gamma))) then
         stability_limit = -1.0_wp
      else if (gamma < 0.5_wp) then
         stability_limit = 0.0_wp
      else if (2.0_wp*beta >= gamma) then
         stability_limit = huge(1.0_wp)
      else
         ! the eigenvalue -1 of the undamped map; at gamma = 1/2: 2/sqrt(1 - 4 beta)
         stability_limit = sqrt(2.0_wp/(gamma - 2.0_wp*beta))
      end if
   end function stability_limit

   recursive subroutine newmark_init(self, sys, status)
      class(newmark_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      logical :: in_range

      if (status%failed()) return
      call self%note_init()
      in_range = ieee_is_finite(self%beta) .and. ieee_is_finite(self%gamma)
      if (in_range) in_range = min(self%beta, self%gamma) >= 0.0_wp
      if (.not. in_range) then
         call status%set(dynstep_invalid_input, 'Newmark needs beta >= 0 and gamma >= 0, not ' &
            & //text(self%beta)//' and '//text(self%gamma))
         return
      end if
      call check_mechanical('Newmark', sys, status)
      if (status%failed()) return
      if (allocated(self%linear)) deallocate (self%linear)
      if (allocated(self%equilibrium)) deallocate (self%equilibrium)
      if (allocated(self%start_solver)) deallocate (self%start_solver)
      select type (sys)
      class is (linear_system)
         self%way = way_linear
         allocate (self%linear)
         call self%linear%init(sys, self%beta, self%gamma, status)
         self%reads_again = .false.
      class is (mechanical_system)
         self%way = choose_way(self, sys)
         allocate (self%start_solver)
         call self%start_solver%init(sys, status)
         if (self%way /= way_explicit) then
            allocate (self%equilibrium)
            self%equilibrium%options = self%newton
            call self%equilibrium%init(sys, status)
         end if
      end select
      if (.not. status%failed()) call self%note_init(sys)
      self%made_for = [self%beta, self%gamma]
   end subroutine newmark_init

   !> The least work that the declared structure allows
   pure integer function choose_way(self, sys) result(way)
      class(newmark_stepper), intent(in) :: self
      class(mechanical_system), intent(in) :: sys
      associate (s => sys%structure)
         way = way_newton
         if (self%beta <= 0.0_wp .and. s%velocity_free) then
            way = way_explicit
         else if (sys%n == 1 .and. s%force_is_linear .and. s%tangent_is_constant .and. s%mass == kind_identity) then
            way = way_scalar
         end if
      end associate
   end function choose_way

   !> a0 from (20)
   recursive subroutine newmark_start(self, sys, state, status)
      class(newmark_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      logical :: is_changed

      call check_start(self, sys, state, status)
      if (status%failed()) return
      is_changed = .not. (ieee_is_finite(self%beta) .and. ieee_is_finite(self%gamma))
      if (.not. is_changed) is_changed = any(abs([self%beta, self%gamma] - self%made_for) > 0.0_wp)
      if (is_changed) then
         call status%set(dynstep_invalid_input, 'beta or gamma was changed after init; call init again')
         return
      end if
      call self%reset()
      select type (sys)
      class is (linear_system)
         call read_again(self, sys)
         call self%linear%start(sys, state%t, state%y, state%a, status, self%count)
      class is (mechanical_system)
         call self%start_solver%solve(sys, state%t, state%y(1:sys%n), state%y(sys%n + 1:), state%a, &
            & self%count, status)
      end select
      self%is_started = .not. status%failed()
   end subroutine newmark_start

   pure subroutine newmark_reset(self)
      class(newmark_stepper), intent(inout) :: self
      call self%count%zero()
      if (allocated(self%start_solver)) call self%start_solver%forget()
      if (allocated(self%equilibrium)) call self%equilibrium%matrix%forget()
      self%reads_again = .true.
   end subroutine newmark_reset

   !> What the linear engine made of the matrices, made again where `reset` was called
   recursive subroutine read_again(self, sys)
      class(newmark_stepper), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      if (self%reads_again) call self%linear%reset(sys)
      self%reads_again = .false.
   end subroutine read_again

   recursive subroutine newmark_try_step(self, sys, state, h, t1, trial, status)
      class(newmark_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      trial%t = t1
      select type (sys)
      class is (linear_system)
         trial%y = state%y
         trial%a = state%a
         call read_again(self, sys)
         call self%linear%step(sys, state%t, h, t1, trial%y, trial%a, .true., status, self%count)
         if (.not. (status%failed() .or. all(ieee_is_finite(trial%y)))) call status%set(dynstep_not_finite, &
            & 'the step from t = '//text(state%t)//' leaves the range of numbers; the motion grows, or h = ' &
            & //text(h)//' is beyond the stability limit of the method', retry=.true.)
      class is (mechanical_system)
         associate (n => sys%n)
            if (self%way == way_explicit) then
               call explicit_step(self, sys, t1, h, state%y(1:n), state%y(n + 1:), state%a, &
                  & trial%y(1:n), trial%y(n + 1:), trial%a, status)
            else
               call implicit_step(self, sys, state%t, t1, h, state%y(1:n), state%y(n + 1:), state%a, &
                  & trial%y(1:n), trial%y(n + 1:), trial%a, status)
            end if
         end associate
      end select
   end subroutine newmark_try_step

   !> beta = 0: q1 is known, a1 needs no velocity, v1 follows
   recursive subroutine explicit_step(self, sys, t1, h, q0, v0, a0, q1, v1, a1, status)
      class(newmark_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t1, h
      real(wp), intent(in) :: q0(sys%n), v0(sys%n), a0(sys%n)
      real(wp), intent(out) :: q1(sys%n), v1(sys%n), a1(sys%n)
      type(status_type), intent(inout) :: status
      q1 = q0 + h*(v0 + (0.5_wp*h)*a0)
      call self%start_solver%solve(sys, t1, q1, v0, a1, self%count, status)
      v1 = v0 + h*((1.0_wp - self%gamma)*a0 + self%gamma*a1)
   end subroutine explicit_step

   !> (21), (24) and (25) by Newton's iteration for the increment of a1
   recursive subroutine implicit_step(self, sys, t0, t1, h, q0, v0, a0, q1, v1, a1, status)
      class(newmark_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t0, t1, h
      real(wp), intent(in) :: q0(sys%n), v0(sys%n), a0(sys%n)
      real(wp), intent(out) :: q1(sys%n), v1(sys%n), a1(sys%n)
      type(status_type), intent(inout) :: status
      real(wp) :: c_q, c_v

      c_q = self%beta*h**2
      c_v = self%gamma*h
      associate (matrix => self%equilibrium%matrix)
         call matrix%prepare(sys, t0, t1, c_q, c_v, q0, v0, a0, self%count, status)
         if (status%failed()) return
         call predict(self%beta, self%gamma, h, matrix%stiffness_ratio, q0, v0, a0, q1, v1, a1)
      end associate
      if (self%equilibrium%allowed > 0.0_wp) call guess_further(self, h, q0, v0, a0, q1, v1, a1)
      call self%equilibrium%solve(sys, t1, q1, v1, a1, self%count, status)
      if (self%equilibrium%allowed > 0.0_wp) call self%guess%note(a1)
   end subroutine implicit_step

   !> A predictor with the accelerations of the substeps before, where the system is not stiff
   pure subroutine guess_further(self, h, q0, v0, a0, q1, v1, a1)
      class(newmark_stepper), intent(inout) :: self
      real(wp), intent(in) :: h, q0(:), v0(:), a0(:)
      real(wp), intent(inout) :: q1(:), v1(:), a1(:)
      if (self%guess%is_empty()) call self%guess%note(a0)
      if (self%equilibrium%matrix%stiffness_ratio > predict_velocity_above) return
      call self%guess%extrapolate(a1)
      v1 = v0 + h*((1.0_wp - self%gamma)*a0 + self%gamma*a1)
      q1 = q0 + h*(v0 + h*((0.5_wp - self%beta)*a0 + self%beta*a1))
   end subroutine guess_further

   !> Newton's iteration may end earlier
   recursive subroutine newmark_aim(self, norm, allowed, steps)
      class(newmark_stepper), intent(inout) :: self
      type(error_norm_type), intent(in) :: norm
      real(wp), intent(in) :: allowed
      integer, intent(in) :: steps
      if (.not. allocated(self%equilibrium)) return
      call self%equilibrium%aim_at(norm, allowed)
      call self%guess%init(self%equilibrium%unknowns(), steps, 0.0_wp)
   end subroutine newmark_aim

   !> Accelerations of another row of substeps, for the predictor
   recursive subroutine newmark_follow(self, other)
      class(newmark_stepper), intent(inout) :: self
      class(stepper_type), intent(in) :: other
      select type (other)
      class is (newmark_stepper)
         call self%guess%follow(other%guess)
         if (allocated(self%equilibrium)) call self%equilibrium%follow(other%equilibrium)
      end select
   end subroutine newmark_follow

   !> A predictor that fulfils (24) and (25) with one of a1 = a0, v1 = v0, q1 = q0
   pure subroutine predict(beta, gamma, h, stiffness_ratio, q0, v0, a0, q1, v1, a1)
      real(wp), intent(in) :: beta, gamma, h
      real(wp), intent(in) :: stiffness_ratio       !! c_q |K|/M at its largest
      real(wp), intent(in) :: q0(:), v0(:), a0(:)
      real(wp), intent(out) :: q1(:), v1(:), a1(:)
      if (stiffness_ratio > predict_position_above .and. beta > 0.0_wp) then
         q1 = q0
         v1 = (1.0_wp - gamma/beta)*v0 + (h*(1.0_wp - 0.5_wp*gamma/beta))*a0
         a1 = (-1.0_wp/(beta*h))*v0 + (1.0_wp - 0.5_wp/beta)*a0
      else if (stiffness_ratio > predict_velocity_above .and. gamma > 0.0_wp) then
         a1 = ((gamma - 1.0_wp)/gamma)*a0
         v1 = v0
         q1 = q0 + h*(v0 + (h*(0.5_wp - beta/gamma))*a0)
      else
         a1 = a0
         v1 = v0 + h*a0
         q1 = q0 + h*(v0 + (0.5_wp*h)*a0)
      end if
   end subroutine predict

   recursive subroutine newmark_advance(self, sys, state, clock, steps, status, complete)
      class(newmark_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps
      type(status_type), intent(inout) :: status
      logical, intent(in) :: complete
      integer(long) :: k

      if (status%failed()) return
      k = clock%k
      select type (sys)
      class is (linear_system)
         call read_again(self, sys)
         call self%linear%advance(sys, clock, state%y, state%a, steps, complete, status, self%count)
      class is (mechanical_system)
         if (self%way == way_newton) call self%equilibrium%begin_row()
         call self%guess%forget()
         if (.not. may_use_scalars(self, sys, state, clock, status)) then
            call advance_by_trials(self, sys, state, clock, steps, status, complete)
            return
         end if
         call scalar_steps(self, sys, state%y, state%a, clock, steps, status)
      end select
      self%count%steps = self%count%steps + (clock%k - k)
      if (clock%k > k) state%t = clock%time()
   end subroutine newmark_advance

   !> The trapezoid of a linear system needs no acceleration, all else does
   pure logical function newmark_needs_acceleration(self)
      class(newmark_stepper), intent(in) :: self
      newmark_needs_acceleration = .true.
      if (self%way == way_linear) newmark_needs_acceleration = self%linear%needs_acceleration()
   end function newmark_needs_acceleration

   !> One equation whose tangent the user gives: then one correction is exact
   recursive logical function may_use_scalars(self, sys, state, clock, status)
      class(newmark_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      type(clock_type), intent(in) :: clock
      type(status_type), intent(inout) :: status
      may_use_scalars = self%way == way_scalar
      if (.not. may_use_scalars) return
      associate (matrix => self%equilibrium%matrix, h => clock%h)
         call matrix%prepare(sys, clock%time(), clock%time(1), self%beta*h**2, self%gamma*h, &
            & state%y(1:1), state%y(2:2), state%a, self%count, status)
         may_use_scalars = matrix%is_exact
      end associate
   end function may_use_scalars

   !> The same operations as implicit_step with q, v, a in registers: one force and one
   !> correction a step.  This is what a user's own oscillator is stepped with.
   recursive subroutine scalar_steps(self, sys, y, a, clock, steps, status)
      class(newmark_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(inout) :: y(2), a(1)
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps
      type(status_type), intent(inout) :: status
      real(wp), dimension(1) :: q, v, q1, v1, a1, f
      real(wp) :: h, c_q, c_v, inverse, d
      integer :: i, ierr

      h = clock%h
      c_q = self%beta*h**2
      c_v = self%gamma*h
      q = y(1)
      v = y(2)
      if (status%failed()) return
      inverse = self%equilibrium%matrix%scalar_inverse()
      do i = 1, steps
         call predict(self%beta, self%gamma, h, self%equilibrium%matrix%stiffness_ratio, q, v, a, q1, v1, a1)
         call sys%force(clock%time(i), q1, v1, f, ierr)
         if (ierr /= 0) exit
         if (.not. ieee_is_finite(f(1))) exit
         d = (f(1) - a1(1))*inverse
         q = q1 + c_q*d
         v = v1 + c_v*d
         a = a1 + d
      end do
      y(1) = q(1)
      y(2) = v(1)
      clock%k = clock%k + (i - 1)
      self%count%forces = self%count%forces + min(i, steps)
      self%count%solves = self%count%solves + (i - 1)
      self%count%newton_iterations = self%count%newton_iterations + (i - 1)
      if (i > steps) return
      call check_callback('force', ierr, clock%time(1), status)
      if (.not. status%failed()) call check_finite('force', f, clock%time(1), status)
   end subroutine scalar_steps

   !> The matrices of the way that the system is stepped in
   recursive subroutine newmark_archive_parts(self, file)
      class(newmark_stepper), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%expect('beta', self%beta)
      call file%expect('gamma', self%gamma)
      call file%expect('way', self%way)
      call self%newton%archive('newton', file)
      call file%item('reads_again', self%reads_again)
      if (allocated(self%linear)) call self%linear%archive('linear', file)
      if (allocated(self%equilibrium)) call self%equilibrium%archive('equilibrium', file)
      if (allocated(self%start_solver)) call self%start_solver%archive('start_solver', file)
   end subroutine newmark_archive_parts
end module dynstep_newmark
