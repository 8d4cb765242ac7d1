! SPDX-License-Identifier: BSD-3-Clause
!> The implicit midpoint rule (Austin 1991, eqs. (14) and (45)) for M q'' = f:
!>
!>   M(t,q,v) a = f(t,q,v)   at t = t0 + h/2, q = q0 + h/2 v, v = v0 + h/2 a
!>   v1 = v0 + h a,  q1 = q0 + h v
!>
!> Symmetric and of order 2; one Newton iteration for the increment of the acceleration at
!> the midpoint.  Quadratic invariants of the motion are kept.
module dynstep_midpoint
   use dynstep_accelerations, only: acceleration_solver
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
      type(equilibrium_solver), private :: equilibrium
      type(acceleration_solver), private :: end_solver
      real(wp), allocatable, private :: q(:), v(:), a(:)   ! at the midpoint
   contains
      procedure :: properties => midpoint_properties
      procedure :: init => midpoint_init
      procedure :: reset => midpoint_reset
      procedure :: start => midpoint_start
      procedure :: try_step => midpoint_try_step
      procedure :: advance => midpoint_advance
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
   end function midpoint_properties

   recursive subroutine midpoint_init(self, sys, status)
      class(midpoint_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status

      call check_mechanical('the midpoint rule', sys, status)
      if (status%failed()) return
      self%equilibrium%options = self%newton
      select type (sys)
      class is (mechanical_system)
         call self%equilibrium%init(sys, status)
      end select
      call self%end_solver%init(sys, status)
      if (allocated(self%q)) deallocate (self%q, self%v, self%a)
      allocate (self%q(sys%n), self%v(sys%n), self%a(sys%n))
   end subroutine midpoint_init

   pure subroutine midpoint_reset(self)
      class(midpoint_stepper), intent(inout) :: self
      call self%count%zero()
      call self%equilibrium%forget()
      call self%end_solver%forget()
   end subroutine midpoint_reset

   recursive subroutine midpoint_start(self, sys, state, status)
      class(midpoint_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      call check_start(sys, state, status)
      if (status%failed()) return
      call self%reset()
      call self%end_solver%complete(sys, state, self%count, status)
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
      trial%a = state%a
      select type (sys)
      class is (mechanical_system)
         associate (n => sys%n)
            call midpoint_step(self, sys, state%t, h, trial%y(1:n), trial%y(n + 1:), trial%a, status)
         end associate
      end select
      call self%end_solver%complete(sys, trial, self%count, status)
   end subroutine midpoint_try_step

   !> q, v: of the begin, then of the end.  a: a guess, then the acceleration at the midpoint.
   !> On failure nothing is changed.
   recursive subroutine midpoint_step(self, sys, t0, h, q, v, a, status)
      class(midpoint_stepper), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t0, h
      real(wp), intent(inout) :: q(sys%n), v(sys%n), a(sys%n)
      type(status_type), intent(inout) :: status
      real(wp) :: half

      half = 0.5_wp*h
      call self%equilibrium%prepare(sys, t0, half**2, half, q, v, a, self%count, status)
      if (status%failed()) return
      self%a = a
      if (self%equilibrium%stiffness_ratio > predict_velocity_above) self%a = 0.0_wp
      self%v = v + half*self%a
      self%q = q + half*self%v
      call self%equilibrium%solve(sys, t0 + half, self%q, self%v, self%a, self%count, status)
      if (status%failed()) return
      q = q + h*self%v
      v = v + h*self%a
      a = self%a
   end subroutine midpoint_step

   !> Steps in place.  Inside a base step of an extrapolation (complete = .false.) the
   !> acceleration at the end of a step is not computed, and that of the midpoint is the guess
   !> for the next one.
   recursive subroutine midpoint_advance(self, sys, state, clock, steps, status, complete)
      class(midpoint_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(clock_type), intent(inout) :: clock
      integer, intent(in) :: steps
      type(status_type), intent(inout) :: status
      logical, intent(in) :: complete
      integer :: i

      if (status%failed()) return
      select type (sys)
      class is (mechanical_system)
         associate (n => sys%n)
            do i = 1, steps
               call midpoint_step(self, sys, state%t, clock%h, state%y(1:n), state%y(n + 1:), state%a, status)
               if (status%failed()) return
               clock%k = clock%k + 1
               state%t = clock%time()
               self%count%steps = self%count%steps + 1
               if (complete) call self%end_solver%complete(sys, state, self%count, status)
            end do
         end associate
      end select
   end subroutine midpoint_advance
end module dynstep_midpoint
