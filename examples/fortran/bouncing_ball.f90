! SPDX-License-Identifier: BSD-3-Clause
!> A ball that bounces until it rests.  Each bounce keeps three fourths of the speed, so there are infinitely many of them
!> in a finite time: below a speed that does not matter any more, the ball lies on the floor.
module bouncing_ball_model
   use dynstep
   implicit none
   private

   real(wp), parameter, public :: gravity = 9.81_wp

   type, extends(mechanical_system), public :: ball
      logical :: rests = .false.
   contains
      procedure :: force => ball_force
   end type ball

   type, extends(event_type), public :: floor_event
      real(wp) :: restitution = 0.75_wp
      real(wp) :: slow = 1.0e-3_wp         !! m/s: behind a slower bounce the ball rests
      logical :: is_rest = .false.
   contains
      procedure :: values => floor_height
      procedure :: act => floor_bounce
   end type floor_event

contains

   recursive subroutine ball_force(self, t, q, v, f, ierr)
      class(ball), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = merge(0.0_wp, -gravity, self%rests)
   end subroutine ball_force

   !> The height; where the ball rests there is nothing to watch for
   recursive subroutine floor_height(self, t, y, s, ierr)
      class(floor_event), intent(inout) :: self
      real(wp), intent(in) :: t, y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      s = merge(1.0_wp, y(1), self%is_rest)
   end subroutine floor_height

   recursive subroutine floor_bounce(self, i, sys, state, changed, ierr)
      class(floor_event), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: changed
      integer, intent(out) :: ierr
      ierr = 0
      changed = .true.                                  ! the run starts anew here
      state%y(2) = -self%restitution*state%y(2)
      if (state%y(2) > self%slow) return
      state%y = 0.0_wp
      self%is_rest = .true.
      select type (sys)
      type is (ball)
         sys%rests = .true.
      end select
   end subroutine floor_bounce
end module bouncing_ball_model

program bouncing_ball
   use bouncing_ball_model, only: ball, floor_event, gravity
   use dynstep
   implicit none
   type(ball) :: sys
   type(floor_event) :: floor
   class(stepper_type), allocatable :: stepper
   type(controlled_run_type) :: run
   type(step_control_type) :: control
   type(state_type) :: state
   type(status_type) :: status
   real(wp) :: t, v, error
   integer :: i

   sys%n = 1
   sys%structure%velocity_free = .true.
   floor%direction = [-1]                               ! downwards alone
   call new_method('newmark-extrapolation', stepper, status)
   call stepper%init(sys, status)
   state%y = [1.0_wp, 0.0_wp]                           ! let fall from 1 m
   call stepper%start(sys, state, status)
   call run%begin(stepper, sys, state, 5.0_wp, control, status)
   call run%proceed(stepper, sys, state, status, events=floor)
   if (status%failed()) then
      print '(a)', trim(status%message)
      stop 1
   end if

   t = sqrt(2.0_wp/gravity)                             ! in closed form: the first bounce, and from bounce to bounce
   v = gravity*t
   error = 0.0_wp
   print '(a8, 3a12)', 'bounce', 't', 'speed', 'error of t'
   do i = 1, run%log%count
      error = max(error, abs(run%log%t(i) - t), abs(run%log%y(2, i) + v))
      if (mod(i, 5) == 1) print '(i8, 2f12.6, es12.1)', i, run%log%t(i), -run%log%y(2, i), run%log%t(i) - t
      v = floor%restitution*v
      t = t + 2.0_wp*v/gravity
   end do
   print '(a, f9.6, a, f9.6, a)', 'it rests from t =', run%log%t(run%log%count), ' s; infinitely many bounces end at', &
      & sqrt(2.0_wp/gravity)*(1.0_wp + floor%restitution)/(1.0_wp - floor%restitution), ' s'
   if (error > 1.0e-13_wp .or. v > floor%slow .or. maxval(abs(state%y)) > 0.0_wp) stop 1
end program bouncing_ball
