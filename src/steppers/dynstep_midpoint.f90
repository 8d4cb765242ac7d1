! SPDX-License-Identifier: BSD-3-Clause
!> The implicit midpoint rule (Austin 1991, eqs. (14) and (45)) for M q'' = f:
!>
!>   M(t,q,v) a = f(t,q,v)   at t = t0 + h/2, q = q0 + h/2 v, v = v0 + h/2 a
!>   v1 = v0 + h a,  q1 = q0 + h v
!>
!> Symmetric and of order 2; one Newton iteration for the increment of the acceleration at
!> the midpoint.  Quadratic invariants of the motion are kept.
module dynstep_midpoint
   use dynstep_acceleration_guess, only: acceleration_guess
   use dynstep_accelerations, only: acceleration_solver
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_equilibrium, only: equilibrium_solver, newton_options
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_start_check, only: check_mechanical, check_start
   use dynstep_status, only: status_type
   use dynstep_stepper, only: clock_type, method_properties, state_type, stepper_type
   implicit none
   private

   type, extends(stepper_type), public :: midpoint_stepper
      type(newton_options) :: newton           !! limits and tolerance of Newton's iteration
      ! allocatable, since gfortran 12 loses the matrices inside a plain component when a
      ! class(stepper_type) is deallocated
      type(equilibrium_solver), allocatable, private :: equilibrium
      type(acceleration_solver), private :: end_solver
      real(wp), allocatable, private :: q(:), v(:), a(:)   ! at the midpoint of the last step
      type(acceleration_guess), private :: guess           ! where errors are allowed
      real(wp), private :: t_end = 0.0_wp                  ! where that step ended
      logical, private :: has_guess = .false.              ! a and t_end are of this run
   contains
      procedure :: properties => midpoint_properties
      procedure :: init => midpoint_init
      procedure :: reset => midpoint_reset
      procedure :: start => midpoint_start
      procedure :: try_step => midpoint_try_step
      procedure :: advance => midpoint_advance
      procedure :: archive_parts => midpoint_archive_parts
      procedure :: aim => midpoint_aim
      procedure :: follow => midpoint_follow
   end type midpoint_stepper

   !> Stiffness ratio above which a = 0 predicts better than a = a0; see dynstep_newmark
   real(wp), parameter :: predict_velocity_above = 2.0_wp

contains

   recursive function midpoint_properties(self) result(facts)
      class(midpoint_stepper), intent(in) :: self
      type(method_properties) :: facts
      facts%name = 'midpoint'
      facts%source = 'Austin 1991, eqs. (14), (45)'
      facts%order = 2
      facts%acceleration_order = 2
      facts%stages = 1
      facts%symmetric = .true.
      facts%mechanical = .true.
      facts%stability_limit = huge(1.0_wp)
      facts%newmark_beta = 0.25_wp
   end function midpoint_properties

   recursive subroutine midpoint_init(self, sys, status)
      class(midpoint_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      call self%note_init()
      call check_mechanical('the midpoint rule', sys, status)
      if (status%failed()) return
      if (.not. allocated(self%equilibrium)) allocate (self%equilibrium)
      self%equilibrium%options = self%newton
      select type (sys)
      class is (mechanical_system)
         call self%equilibrium%init(sys, status)
      end select
      call self%end_solver%init(sys, status)
      if (allocated(self%q)) deallocate (self%q, self%v, self%a)
      allocate (self%q(sys%n), self%v(sys%n), self%a(sys%n))
      if (.not. status%failed()) call self%note_init(sys)
   end subroutine midpoint_init

   pure subroutine midpoint_reset(self)
      class(midpoint_stepper), intent(inout) :: self
      call self%count%zero()
      self%has_guess = .false.
      if (allocated(self%equilibrium)) call self%equilibrium%matrix%forget()
      call self%end_solver%forget()
   end subroutine midpoint_reset

   recursive subroutine midpoint_start(self, sys, state, status)
      class(midpoint_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      call check_start(self, sys, state, status)
      if (status%failed()) return
      call self%reset()
      call self%end_solver%complete(sys, state, self%count, status)
      self%is_started = .not. status%failed()
   end subroutine midpoint_start

   recursive subroutine midpoint_try_step(self, sys, state, h, t1, trial, status)
      class(midpoint_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: h, t1
      type(state_type), intent(inout) :: trial
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      trial%t = t1
      trial%y = state%y
      select type (sys)
      class is (mechanical_system)
         call midpoint_step(self, sys, state%t, h, t1, state%a, trial%y, status)
      end select
      call self%end_solver%complete(sys, trial, self%count, status)
   end subroutine midpoint_try_step

   !> One step of y = [q; v] in place; on failure nothing is changed.  The first guess of the
   !> acceleration is that of the midpoint of the step before, else `a0`.
   recursive subroutine midpoint_step(self, sys, t0, h, t1, a0, y, status)
      class(midpoint_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t0, h, t1
      real(wp), intent(in) :: a0(sys%n)               !! acceleration at t0
      real(wp), intent(inout) :: y(2*sys%n)
      type(status_type), intent(inout) :: status
      real(wp) :: half

      if (status%failed()) return
      half = 0.5_wp*h
      if (abs(self%t_end - t0) > 0.0_wp) self%has_guess = .false.
      if (.not. self%has_guess) self%a = a0
      associate (n => sys%n, q => self%q, v => self%v, a => self%a)
         call self%equilibrium%matrix%prepare(sys, t0, t0 + half, half**2, half, y(1:n), y(n + 1:), a, self%count, &
            & status)
         if (status%failed()) self%has_guess = .false.
         if (status%failed()) return
         if (self%equilibrium%allowed > 0.0_wp) call self%guess%extrapolate(a)
         if (self%equilibrium%matrix%stiffness_ratio > predict_velocity_above) a = 0.0_wp
         v = y(n + 1:) + half*a
         q = y(1:n) + half*v
         self%has_guess = .false.
         call self%equilibrium%solve(sys, t0 + half, q, v, a, self%count, status)
         if (status%failed()) return
         if (self%equilibrium%allowed > 0.0_wp) call self%guess%note(a)
         y(1:n) = y(1:n) + h*v
         y(n + 1:) = y(n + 1:) + h*a
      end associate
      self%has_guess = .true.
      self%t_end = t1
   end subroutine midpoint_step

   !> Newton's iteration may end earlier
   recursive subroutine midpoint_aim(self, norm, allowed, steps)
      class(midpoint_stepper), intent(inout) :: self
      type(error_norm_type), intent(in) :: norm
      real(wp), intent(in) :: allowed
      integer, intent(in) :: steps
      if (.not. allocated(self%equilibrium)) return
      call self%equilibrium%aim_at(norm, allowed)
      call self%guess%init(self%equilibrium%unknowns(), steps, 0.5_wp)
   end subroutine midpoint_aim

   !> Accelerations of another row of substeps, for the predictor
   recursive subroutine midpoint_follow(self, other)
      class(midpoint_stepper), intent(inout) :: self
      class(stepper_type), intent(in) :: other
      select type (other)
      class is (midpoint_stepper)
         call self%guess%follow(other%guess)
         if (allocated(self%equilibrium)) call self%equilibrium%follow(other%equilibrium)
      end select
   end subroutine midpoint_follow

   !> Steps in place; only the last one needs the acceleration at its end
   recursive subroutine midpoint_advance(self, sys, state, clock, steps, status, complete)
      class(midpoint_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps
      type(status_type), intent(inout) :: status
      logical, intent(in) :: complete
      type(status_type) :: end_status
      integer :: i

      if (status%failed()) return
      select type (sys)
      class is (mechanical_system)
         call self%equilibrium%begin_row()
         if (self%equilibrium%allowed > 0.0_wp) self%has_guess = .false.
         call self%guess%forget()
         do i = 1, steps
            call midpoint_step(self, sys, state%t, clock%h, clock%time(1), state%a, state%y, status)
            if (status%failed()) exit
            clock%k = clock%k + 1
            state%t = clock%time()
            self%count%steps = self%count%steps + 1
         end do
         if (.not. complete .or. i == 1) return
         call self%end_solver%complete(sys, state, self%count, end_status)
         if (.not. status%failed()) status = end_status
      end select
   end subroutine midpoint_advance

   !> The guess of the acceleration, and the matrices
   recursive subroutine midpoint_archive_parts(self, file)
      class(midpoint_stepper), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call self%newton%archive('newton', file)
      call file%item('has_guess', self%has_guess)
      if (self%has_guess) then
         call file%item('t_end', self%t_end)
         call file%item('a', self%a)
      end if
      call self%equilibrium%archive('equilibrium', file)
      call self%end_solver%archive('end_solver', file)
   end subroutine midpoint_archive_parts
end module dynstep_midpoint
