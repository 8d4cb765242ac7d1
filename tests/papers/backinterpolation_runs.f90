! SPDX-License-Identifier: BSD-3-Clause
!> Runs by the listings of Xie (1995): both half-steps by Fehlberg's weights, the estimate and the rules of section 3.4.
module backinterpolation_runs
   use dynstep, only: backinterpolation_stepper, halves_fehlberg, integrate_controlled, ode_system, state_type, &
      & status_type, step_control_type, step_counters, trajectory_type, wp
   implicit none
   private

   public :: general_system, integrate_backinterpolation

   !> A system seen by its right side alone, as the listings see it: a linear one is not stepped as such
   type, extends(ode_system) :: general_system
      class(ode_system), allocatable :: inner
   contains
      procedure :: rhs => general_rhs
   end type general_system

contains

   recursive subroutine general_rhs(self, t, y, f, ierr)
      class(general_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      call self%inner%rhs(t, y, f, ierr)
   end subroutine general_rhs

   !> From t0 to t1, all points recorded
   subroutine integrate_backinterpolation(inner, t0, t1, y0, alpha, control, points, count, status, true_sign)
      class(ode_system), intent(in) :: inner
      real(wp), intent(in) :: t0, t1, y0(:)
      real(wp), intent(in) :: alpha
      type(step_control_type), intent(in) :: control
      type(trajectory_type), intent(out) :: points
      type(step_counters), intent(out) :: count
      type(status_type), intent(inout) :: status
      logical, intent(in), optional :: true_sign         !! of the estimate; default: that of the listing
      type(general_system) :: sys
      type(backinterpolation_stepper) :: stepper
      type(state_type) :: state
      allocate (sys%inner, source=inner)
      sys%n = inner%state_size()
      stepper%halves = halves_fehlberg
      stepper%alpha = alpha
      stepper%listing_sign = .true.
      if (present(true_sign)) stepper%listing_sign = .not. true_sign
      ! Iterated to round-off, as is the default.  The thesis stops at the tolerance of the step, which spoils the estimate:
      ! the stiff problem then takes 72 steps at tol = 1e-6 instead of 34
      state%t = t0
      state%y = y0
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call integrate_controlled(stepper, sys, state, t1, control, status, points)
      count = stepper%count
   end subroutine integrate_backinterpolation
end module backinterpolation_runs
