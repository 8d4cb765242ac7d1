! SPDX-License-Identifier: BSD-3-Clause
!> A block on a spring, on a belt that moves.  It sticks to the belt until the spring is stronger than static friction, slips
!> back against the weaker kinetic one, and sticks again.  What the force is depends on the phase, and events change it.
module stick_slip_model
   use dynstep
   implicit none
   private

   type, extends(mechanical_system), public :: block
      real(wp) :: spring = 1.0_wp, belt = 0.5_wp, static = 1.0_wp, kinetic = 0.6_wp     ! mass 1
      integer :: slip = 0                     !! sign of the velocity on the belt; 0: it sticks
   contains
      procedure :: force => block_force
   end type block

   !> 1: the block has the speed of the belt; 2: the spring is as strong as static friction
   type, extends(event_type), public :: phases
      type(block) :: now                      !! what the functions need to know of the block
   contains
      procedure :: values => phase_values
      procedure :: act => phase_change
   end type phases

contains

   recursive subroutine block_force(self, t, q, v, f, ierr)
      class(block), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = 0.0_wp                              ! with the belt, at constant speed
      if (self%slip /= 0) f = -self%spring*q - self%slip*self%kinetic
   end subroutine block_force

   !> Each phase watches for its own end; a constant is never zero
   recursive subroutine phase_values(self, t, y, s, ierr)
      class(phases), intent(inout) :: self
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      s = 1.0_wp
      if (self%now%slip /= 0) then
         s(1) = y(2) - self%now%belt
      else
         s(2) = self%now%static - abs(self%now%spring*y(1))
      end if
   end subroutine phase_values

   recursive subroutine phase_change(self, i, sys, state, changed, ierr)
      class(phases), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: changed
      integer, intent(out) :: ierr
      ierr = 0
      changed = .true.
      associate (pull => self%now%spring*state%y(1), slip => self%now%slip)
         if (i == 1 .and. abs(pull) < self%now%static) then
            slip = 0
         else                                 ! the spring wins: against its pull
            slip = -nint(sign(1.0_wp, pull))
         end if
      end associate
      state%y(2) = self%now%belt              ! within rounding it is that already
      select type (sys)
      type is (block)
         sys%slip = self%now%slip
      end select
   end subroutine phase_change
end module stick_slip_model

program stick_slip
   use dynstep
   use stick_slip_model, only: block, phases
   implicit none
   type(block) :: sys
   type(phases) :: events
   type(extrapolation_stepper) :: stepper
   type(step_control_type) :: control
   type(controlled_run_type) :: run
   type(state_type) :: state
   type(status_type) :: status
   real(wp) :: excess, period, error
   integer :: i

   sys%n = 1
   sys%slip = -1                                        ! at rest, slower than the belt
   events%now = sys
   events%count = 2
   allocate (newmark_stepper :: stepper%base)
   call stepper%init(sys, status)
   state%y = [0.0_wp, 0.0_wp]
   call stepper%start(sys, state, status)
   control%rtol = 1.0e-10_wp
   control%atol = [1.0e-12_wp]
   call run%begin(stepper, sys, state, 40.0_wp, control, status)
   call run%proceed(stepper, sys, state, status, events=events)
   if (status%failed()) then
      print '(a)', trim(status%message)
      stop 1
   end if

   ! omega = 1: it slips on a circle about (kinetic, 0), from (static, belt) to (2 kinetic - static, belt)
   excess = sys%static - sys%kinetic
   period = 2.0_wp*excess/sys%belt + 2.0_wp*(acos(-1.0_wp) - atan(excess/sys%belt))
   error = 0.0_wp
   print '(3a12)', 't', 'q', 'then it'
   do i = 1, run%log%count
      if (i <= 6) print '(2f12.7, a12)', run%log%t(i), run%log%y(1, i), merge('sticks', 'slips ', run%log%which(i) == 1)
      if (i > 3) error = max(error, abs(run%log%t(i) - run%log%t(i - 2) - period))
      if (i > 1) error = max(error, abs(run%log%y(1, i) - merge(2.0_wp*sys%kinetic - sys%static, sys%static, &
         & run%log%which(i) == 1)))
   end do
   print '(a, f12.9, a, es8.1, a, i0, a)', 'period', period, ', largest error', error, ' in ', run%log%count, ' phases'
   if (error > 1.0e-10_wp .or. run%log%count /= 12) stop 1
end program stick_slip
