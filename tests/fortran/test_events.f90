! SPDX-License-Identifier: BSD-3-Clause
!> Events and switches: where they are met, in which order, what is done there, and what ends a run.
module test_events
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use dynstep, only: bilinear_spring, control_type, controlled_run_type, dynstep_callback_failed, &
      & dynstep_event, dynstep_invalid_input, dynstep_more, dynstep_not_finite, dynstep_too_many_events, event_type, &
      & extrapolation_stepper, integration_type, law_literal, law_odd, mechanical_system, newmark_stepper, ode_system, &
      & sequence_romberg, soi2_stepper, state_type, status_type, step_control_type, stepper_type, trajectory_type, wp
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_events

   real(wp), parameter :: eps = epsilon(1.0_wp), gravity = 9.81_wp

   !> x'' = -gravity, or x'' = -x (omega = 1) where is_spring
   type, extends(mechanical_system) :: point_mass
      logical :: is_spring = .false.
   contains
      procedure :: force => point_force
   end type point_mass

   !> A mass on a belt: x'' = -x - sign(s) friction, s = v - belt, and x'' = 0 where it sticks
   type, extends(mechanical_system) :: slider
      real(wp) :: friction = 1.0_wp
      real(wp) :: belt = 0.0_wp
   contains
      procedure :: force => slider_force
      procedure :: switch_values => slider_switch_values
   end type slider

   !> Functions of one unknown q = y(1) and time, chosen by `kind`
   type, extends(event_type) :: watcher
      integer :: kind = 1
      real(wp) :: level = 0.0_wp, restitution = 1.0_wp
      integer :: calls = 0
   contains
      procedure :: values => watcher_values
      procedure :: act => watcher_act
   end type watcher

contains

   subroutine collect_events(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('zones', test_zones), &
         & new_unittest('zones-controlled', test_zones_controlled), &
         & new_unittest('zones-undeclared', test_zones_undeclared), &
         & new_unittest('bouncing', test_bouncing), &
         & new_unittest('bounces-end', test_bounces_end), &
         & new_unittest('directions', test_directions), &
         & new_unittest('order-of-time', test_order_of_time), &
         & new_unittest('one-time', test_one_time), &
         & new_unittest('two-zeros-in-a-step', test_two_zeros), &
         & new_unittest('tangent', test_tangent), &
         & new_unittest('terminal', test_terminal), &
         & new_unittest('at-the-start', test_at_start), &
         & new_unittest('backward', test_backward), &
         & new_unittest('order-at-events', test_order), &
         & new_unittest('dry-friction', test_dry_friction), &
         & new_unittest('sliding', test_sliding), &
         & new_unittest('pieces', test_pieces), &
         & new_unittest('moved-level', test_moved_level), &
         & new_unittest('many', test_many), &
         & new_unittest('close-with-a-history', test_close), &
         & new_unittest('faults', test_faults), &
         & new_unittest('refusals', test_refusals), &
         & new_unittest('work', test_work)]
   end subroutine collect_events

   recursive subroutine point_force(self, t, q, v, f, ierr)
      class(point_mass), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      if (self%is_spring) then
         f = -q
      else
         f = -gravity
      end if
   end subroutine point_force

   recursive subroutine slider_force(self, t, q, v, f, ierr)
      class(slider), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -q - self%friction*self%side(1)
   end subroutine slider_force

   recursive subroutine slider_switch_values(self, t, y, s, ierr)
      class(slider), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      s(1) = y(2) - self%belt
   end subroutine slider_switch_values

   recursive subroutine watcher_values(self, t, y, s, ierr)
      class(watcher), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      self%calls = self%calls + 1
      ierr = 0
      select case (self%kind)
      case (2)
         s = [y(1) - self%level, 2.0_wp*(y(1) - self%level), t - 0.55_wp]
      case (3)
         s = y(1) - self%level
         if (t > 0.3_wp) s = ieee_value(1.0_wp, ieee_quiet_nan)
      case (4)
         s = y(1) - self%level
         if (t > 0.3_wp) ierr = -3
      case (5)
         s = y(1) - self%level
         if (t > 0.25_wp) ierr = 1
      case (9)
         s = y(1) - self%level
         if (y(1) < self%level - 1.0e-3_wp) ierr = 1
      case (10)
         s = sin(2.0_wp*acos(-1.0_wp)*t)
      case (11)
         s = [t - 0.5_wp, t - (0.5_wp + self%level)]
      case (13)
         s = [t - 0.5_wp, 0.5_wp - t, y(1) - self%level]
      case default
         s = y(1) - self%level
      end select
   end subroutine watcher_values

   recursive subroutine watcher_act(self, i, sys, state, changed, ierr)
      class(watcher), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: changed
      integer, intent(out) :: ierr
      ierr = 0
      if (self%kind == 6) state%y(2) = -self%restitution*state%y(2)
      if (self%kind == 7) ierr = 5
      if (self%kind == 12) self%level = self%level + 0.004_wp
      if (self%kind == 8) state%y(1) = ieee_value(1.0_wp, ieee_quiet_nan)
      changed = self%kind == 6 .or. self%kind == 8
   end subroutine watcher_act

   subroutine new_point(sys, is_spring)
      type(point_mass), intent(out) :: sys
      logical, intent(in) :: is_spring
      sys%n = 1
      sys%is_spring = is_spring
      sys%structure%velocity_free = .true.
   end subroutine new_point

   !> Newmark's method extrapolated
   subroutine new_method(stepper, levels, sequence)
      class(stepper_type), allocatable, intent(out) :: stepper
      integer, intent(in) :: levels
      integer, intent(in), optional :: sequence
      type(extrapolation_stepper), allocatable :: made
      allocate (made)
      allocate (newmark_stepper :: made%base)
      made%levels = levels
      if (present(sequence)) made%sequence = sequence
      call move_alloc(made, stepper)
   end subroutine new_method

   subroutine start(sys, stepper, state, q, v, status)
      class(mechanical_system), intent(inout) :: sys
      class(stepper_type), intent(inout) :: stepper
      type(state_type), intent(out) :: state
      real(wp), intent(in) :: q, v
      type(status_type), intent(inout) :: status
      state%y = [q, v]
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
   end subroutine start

   !> Counter example 4 of Austin 1991 with the zones declared: errors at steps 10, 20 and 100 are those of rounding and of
   !> order 8, whose truncation over 100 steps of Romberg's sequence is 5.7e-14 in exact arithmetic (reference study)
   subroutine test_zones(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: laws(2) = [law_odd, law_literal]
      integer :: i
      do i = 1, 2
         call one_law(error, laws(i))
         if (allocated(error)) return
      end do
   end subroutine test_zones

   subroutine one_law(error, law)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: law
      type(bilinear_spring) :: spring
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(trajectory_type) :: points
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: x, v, a, energy, energy0
      integer :: i, ierr
      spring%law = law
      spring%zones_declared = .true.
      call spring%setup()
      call new_method(stepper, 4, sequence_romberg)
      call start(spring, stepper, state, 2.0_wp, 0.0_wp, status)
      call run%begin(spring, state, 4.0_wp, control_type(h=0.04_wp, t_eval=[0.4_wp, 0.8_wp, 4.0_wp]), status)
      call run%proceed(stepper, spring, state, status, points)
      call check(error, status%code, 0, trim(status%message))
      call check(error, points%count, 3)
      if (allocated(error)) return
      do i = 1, 3
         call spring%exact(2.0_wp, 0.0_wp, points%t(i), x, v, a)
         call check(error, points%y(1, i), x, 'x', thr=1.0e-13_wp)
         call check(error, points%y(2, i), v, 'v', thr=2.0e-13_wp)
         call check(error, points%a(1, i), a, 'a', thr=2.0e-12_wp)
         call spring%energy(points%t(i), points%y(1:1, i), points%y(2:2, i), energy, ierr)
         call spring%energy(0.0_wp, [2.0_wp], [0.0_wp], energy0, ierr)
         call check(error, energy, energy0, 'energy', thr=1.0e-12_wp)
      end do
      ! switches are no events of the user
      call check(error, run%log%count, 0)
   end subroutine one_law

   !> The same by tolerances: the error follows them to the end
   subroutine test_zones_controlled(error)
      type(error_type), allocatable, intent(out) :: error
      type(bilinear_spring) :: spring
      class(stepper_type), allocatable :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: x, v, a
      integer :: k
      do k = 6, 12, 3
         spring%law = law_literal
         spring%zones_declared = .true.
         call spring%setup()
         call new_method(stepper, 5)
         call start(spring, stepper, state, 2.0_wp, 0.0_wp, status)
         control%rtol = 10.0_wp**(-k)
         control%atol = [control%rtol]
         call run%begin(stepper, spring, state, 4.0_wp, control, status)
         call run%proceed(stepper, spring, state, status)
         call check(error, status%code, 0, trim(status%message))
         call spring%exact(2.0_wp, 0.0_wp, 4.0_wp, x, v, a)
         ! seven zones, errors of steps add up: some tens of tolerances, of amplitudes of 3 and 7
         call check(error, state%y(1), x, 'x', thr=100.0_wp*control%rtol)
         call check(error, state%y(2), v, 'v', thr=300.0_wp*control%rtol)
      end do
   end subroutine test_zones_controlled

   !> Without the declaration order 8 is lost: the kinks are not seen
   subroutine test_zones_undeclared(error)
      type(error_type), allocatable, intent(out) :: error
      type(bilinear_spring) :: spring
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: x, v, a
      call spring%setup()
      call new_method(stepper, 4, sequence_romberg)
      call start(spring, stepper, state, 2.0_wp, 0.0_wp, status)
      call run%begin(spring, state, 4.0_wp, control_type(h=0.04_wp), status)
      call run%proceed(stepper, spring, state, status)
      call spring%exact(2.0_wp, 0.0_wp, 4.0_wp, x, v, a)
      call check(error, abs(state%y(1) - x) > 1.0e-6_wp, 'the error of undeclared kinks')
   end subroutine test_zones_undeclared

   !> A ball that loses a fifth of its speed at each bounce: times and speeds in closed form
   subroutine test_bouncing(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: way
      do way = 1, 2
         call bounce(error, way)
         if (allocated(error)) return
      end do
   end subroutine test_bouncing

   subroutine bounce(error, way)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: way                      !! 1: steps of one length, 2: by tolerances
      type(point_mass) :: ball
      type(watcher) :: floor
      class(stepper_type), allocatable :: stepper
      type(integration_type), target :: fixed
      type(controlled_run_type), target :: controlled
      type(step_control_type) :: control
      type(trajectory_type) :: points
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: t, v
      integer :: i

      call new_point(ball, .false.)
      call new_method(stepper, 2)
      call start(ball, stepper, state, 1.0_wp, 0.0_wp, status)
      floor%kind = 6
      floor%restitution = 0.8_wp
      floor%direction = [-1]
      if (way == 1) then
         call fixed%begin(ball, state, 3.0_wp, control_type(h=0.07_wp), status)
         call fixed%proceed(stepper, ball, state, status, points, events=floor)
         controlled%log = fixed%log
      else
         call controlled%begin(stepper, ball, state, 3.0_wp, control, status)
         call controlled%proceed(stepper, ball, state, status, points, events=floor)
      end if
      call check(error, status%code, 0, trim(status%message))
      call check(error, controlled%log%count, 6)
      if (allocated(error)) return
      t = sqrt(2.0_wp/gravity)
      v = gravity*t
      do i = 1, 6
         call check(error, controlled%log%t(i), t, 'time of a bounce', thr=10.0_wp*eps)
         call check(error, controlled%log%y(1, i), 0.0_wp, 'height', thr=10.0_wp*eps)
         call check(error, controlled%log%y(2, i), -v, 'speed', thr=100.0_wp*eps)
         v = 0.8_wp*v
         t = t + 2.0_wp*v/gravity
      end do
      call check(error, all(points%y(1, :points%count) >= -10.0_wp*eps), 'above the floor')
      call check(error, points%t(points%count), 3.0_wp, 'the end is recorded', thr=eps)
      ! both sides of the jump
      i = minloc(abs(points%t(:points%count) - controlled%log%t(1)), 1)
      call check(error, points%t(i + 1), points%t(i), 'two points at a bounce', thr=tiny(1.0_wp))
      call check(error, points%y(2, i + 1), -0.8_wp*points%y(2, i), 'speeds there', thr=1.0e-14_wp)
      if (way == 1) call check(error, any(abs(points%t(:points%count) - 10*0.07_wp) <= eps), 'times k h behind a bounce')
   end subroutine bounce

   !> Bounces that come closer and closer end the run
   subroutine test_bounces_end(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: ball
      type(watcher) :: floor
      class(stepper_type), allocatable :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      call new_point(ball, .false.)
      call new_method(stepper, 2)
      call start(ball, stepper, state, 1.0_wp, 0.0_wp, status)
      floor%kind = 6
      floor%restitution = 0.5_wp
      floor%direction = [-1]
      call run%begin(stepper, ball, state, 9.0_wp, control, status)
      call run%proceed(stepper, ball, state, status, events=floor)
      call check(error, status%code, dynstep_too_many_events, trim(status%message))
      ! the sum of all flights: t1 (1 + 2 (0.5 + 0.25 + ...)) = 3 t1
      call check(error, state%t, 3.0_wp*sqrt(2.0_wp/gravity), 'time of rest', thr=1.0e-11_wp)
      call check(error, maxval(abs(state%y)), 0.0_wp, 'at rest', thr=1.0e-10_wp)
   end subroutine test_bounces_end

   !> cos(t) = 1/2 upwards, downwards, both
   subroutine test_directions(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: turn = 2.0_wp*acos(-1.0_wp)
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      integer :: direction
      do direction = -1, 1
         call new_point(sys, .true.)
         call new_method(stepper, 6)
         call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
         event%level = 0.5_wp
         event%direction = [direction]
         call run%begin(sys, state, turn, control_type(h=0.3_wp), status)
         call run%proceed(stepper, sys, state, status, events=event)
         call check(error, status%code, 0, trim(status%message))
         call check(error, run%log%count, merge(2, 1, direction == 0), 'number of events')
         if (allocated(error)) return
         call check(error, run%log%t(1), merge(5.0_wp, 1.0_wp, direction == 1)*turn/6.0_wp, 'first', thr=1.0e-11_wp)
         call check(error, run%log%t(run%log%count), merge(1.0_wp, 5.0_wp, direction == -1)*turn/6.0_wp, 'last', &
            & thr=1.0e-11_wp)
         call check(error, state%y(1), 1.0_wp, 'behind a turn', thr=1.0e-11_wp)
      end do
   end subroutine test_directions

   !> Two functions with one zero, and a third function earlier in the same step: each is met once
   subroutine test_order_of_time(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      call new_point(sys, .true.)
      call new_method(stepper, 6)
      call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
      event%kind = 2
      event%count = 3
      event%level = cos(0.7_wp)
      call run%begin(sys, state, 1.5_wp, control_type(h=0.5_wp), status)
      call run%proceed(stepper, sys, state, status, events=event)
      call check(error, status%code, 0, trim(status%message))
      call check(error, run%log%count, 3, 'events')
      if (allocated(error)) return
      call check(error, run%log%which(1), 3, 'first')
      call check(error, run%log%t(1), 0.55_wp, 'first', thr=4.0_wp*eps)
      call check(error, sum(run%log%which(2:3)), 3, 'both of one time')
      call check(error, run%log%t(2), 0.7_wp, 'second', thr=1.0e-9_wp)
      call check(error, run%log%t(3), run%log%t(2), 'third', thr=4.0_wp*eps)
   end subroutine test_order_of_time

   !> Functions that are zero at one time within rounding, on either side: each is met, and a terminal one ends the run
   subroutine test_one_time(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      integer :: k
      do k = 1, 40
         call new_point(sys, .true.)
         call new_method(stepper, 6)
         call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
         event%kind = 13
         event%count = 3
         event%level = cos(0.5_wp)
         event%terminal = [.false., .true., .false.]
         call run%begin(sys, state, 1.0_wp, control_type(h=0.02_wp*k), status)
         call run%proceed(stepper, sys, state, status, events=event)
         call check(error, status%code, dynstep_event, trim(status%message))
         call check(error, count(run%log%which(:run%log%count) < 3), 2, 'both')
         if (allocated(error)) return
      end do
   end subroutine test_one_time

   !> A level just below the top of a flight is passed twice within a part of one step
   subroutine test_two_zeros(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: ball
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: width
      integer :: k
      do k = 1, 12
         width = 0.7_wp*2.0_wp**(-k)
         call new_point(ball, .false.)
         call new_method(stepper, 2)
         call start(ball, stepper, state, 0.0_wp, 5.0_wp, status)
         event%level = 12.5_wp/gravity - 0.5_wp*gravity*(0.5_wp*width)**2
         call run%begin(ball, state, 1.0_wp, control_type(h=1.0_wp), status)
         call run%proceed(stepper, ball, state, status, events=event)
         call check(error, run%log%count, 2, 'both zeros')
         if (allocated(error)) return
         call check(error, run%log%t(1), 5.0_wp/gravity - 0.5_wp*width, 'first', thr=4.0_wp*eps/width)
         call check(error, run%log%t(2), 5.0_wp/gravity + 0.5_wp*width, 'second', thr=4.0_wp*eps/width)
      end do
   end subroutine test_two_zeros

   !> A level that is only touched, or missed by rounding: no event or two, and the run goes on
   subroutine test_tangent(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      integer :: k
      do k = -2, 2
         call new_point(sys, .false.)
         call new_method(stepper, 2)
         call start(sys, stepper, state, 0.0_wp, 5.0_wp, status)
         event%level = 12.5_wp/gravity + k*eps
         call run%begin(sys, state, 1.0_wp, control_type(h=0.3_wp), status)
         call run%proceed(stepper, sys, state, status, events=event)
         call check(error, status%code, 0, trim(status%message))
         call check(error, run%log%count <= 3, 'few events')
         call check(error, state%y(1), 5.0_wp - 0.5_wp*gravity, 'the end', thr=1.0e-14_wp)
      end do
   end subroutine test_tangent

   subroutine test_terminal(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(trajectory_type) :: points
      type(state_type) :: state
      type(status_type) :: status
      call new_point(sys, .true.)
      call new_method(stepper, 5)
      call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
      event%terminal = [.true.]
      control%rtol = 1.0e-10_wp
      control%atol = [1.0e-10_wp]
      call run%begin(stepper, sys, state, 4.0_wp, control, status)
      call run%proceed(stepper, sys, state, status, points, events=event)
      call check(error, status%code, dynstep_event)
      call check(error, state%t, 0.5_wp*acos(-1.0_wp), 'time', thr=1.0e-8_wp)
      ! times are resolved to 2 eps t_end
      call check(error, state%y(1), 0.0_wp, 'zero', thr=8.0_wp*eps)
      call check(error, points%t(points%count), state%t, 'the last point', thr=tiny(1.0_wp))
      ! and on
      call run%proceed(stepper, sys, state, status, points, events=event)
      call check(error, status%code, 0, trim(status%message))
      call check(error, state%y(1), cos(4.0_wp), 'the end', thr=1.0e-8_wp)
      call check(error, run%log%count, 1)
   end subroutine test_terminal

   !> A function that is zero at the begin is no event there, and its next zero is one
   subroutine test_at_start(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: ball
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: v
      integer :: k
      do k = 0, 6
         v = 10.0_wp**(1 - k)
         call new_point(ball, .false.)
         call new_method(stepper, 2)
         call start(ball, stepper, state, 0.0_wp, v, status)
         call run%begin(ball, state, 3.0_wp, control_type(h=1.5_wp), status)
         call run%proceed(stepper, ball, state, status, events=event)
         call check(error, run%log%count, 1)
         if (allocated(error)) return
         call check(error, run%log%t(1), 2.0_wp*v/gravity, 'the end of the flight', thr=10.0_wp*eps)
      end do
   end subroutine test_at_start

   !> Backward in time a ball meets the floor where it came from
   subroutine test_backward(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: ball
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      call new_point(ball, .false.)
      call new_method(stepper, 2)
      call start(ball, stepper, state, 1.0_wp, 0.0_wp, status)
      event%direction = [-1]
      event%terminal = [.true.]
      call run%begin(stepper, ball, state, -2.0_wp, control, status)
      call run%proceed(stepper, ball, state, status, events=event)
      call check(error, status%code, dynstep_event, trim(status%message))
      call check(error, state%t, -sqrt(2.0_wp/gravity), 'time', thr=10.0_wp*eps)
      call check(error, state%y(2), gravity*sqrt(2.0_wp/gravity), 'speed', thr=100.0_wp*eps)
   end subroutine test_backward

   !> Error of time and state at an event, and behind a change there: the order of the method
   subroutine test_order(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: errors(3, 2), slopes(3)
      integer :: levels, k
      do levels = 1, 4
         do k = 1, 2
            call new_point(sys, .true.)
            call new_method(stepper, levels)
            call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
            event%kind = 6
            event%level = 0.3_wp
            event%restitution = 1.0_wp
            event%direction = [-1]
            call run%begin(sys, state, 2.5_wp, control_type(h=0.5_wp/2**(k - 1)), status)
            call run%proceed(stepper, sys, state, status, events=event)
            call check(error, status%code, 0, trim(status%message))
            call check(error, run%log%count, 1)
            if (allocated(error)) return
            ! it comes back the way it went: q(t) = cos(2 t_event - t)
            errors(:, k) = abs([run%log%t(1) - acos(0.3_wp), state%y(1) - cos(2.0_wp*acos(0.3_wp) - 2.5_wp), &
               & state%a(1) + cos(2.0_wp*acos(0.3_wp) - 2.5_wp)])
         end do
         slopes = log(errors(:, 1)/errors(:, 2))/log(2.0_wp)
         call check(error, all(slopes > 2*levels - 0.5_wp), 'order of time, q and a with events')
         if (allocated(error)) return
      end do
   end subroutine test_order

   !> Dry friction, whose force jumps: amplitudes fall by 2 friction each half turn, until the spring is too weak
   subroutine test_dry_friction(error)
      type(error_type), allocatable, intent(out) :: error
      type(slider) :: sys
      class(stepper_type), allocatable :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      real(wp), parameter :: pi = acos(-1.0_wp)
      sys%n = 1
      sys%switches = 1
      sys%friction = 0.1_wp
      call new_method(stepper, 6)
      ! at rest on the surface: the side is that of the motion that begins
      call start(sys, stepper, state, 1.0_wp, -1.0e-3_wp, status)
      call check(error, sys%side(1), -1)
      control%rtol = 1.0e-11_wp
      control%atol = [1.0e-11_wp]
      call run%begin(stepper, sys, state, 3.0_wp*pi, control, status)
      call run%proceed(stepper, sys, state, status)
      call check(error, status%code, 0, trim(status%message))
      ! q - c = r cos(t + phase) with c = 0.1, -0.1, 0.1; the amplitude r falls by 0.2 at each turn
      call check(error, state%y(1), friction_motion(3.0_wp*pi), 'the motion behind three turns', thr=1.0e-9_wp)
      call check(error, sys%side(1), 1)
   end subroutine test_dry_friction

   !> q of q'' = -q - 0.1 sign(q'), q(0) = 1, q'(0) = -1e-3
   real(wp) function friction_motion(t) result(q)
      real(wp), intent(in) :: t
      real(wp), parameter :: pi = acos(-1.0_wp)
      real(wp) :: r, phase
      integer :: turns
      r = hypot(0.9_wp, 1.0e-3_wp)
      phase = atan(1.0e-3_wp/0.9_wp)
      turns = int((t + phase)/pi)
      q = (-1)**turns*0.1_wp + (r - 0.2_wp*turns)*cos(t + phase)
   end function friction_motion

   !> Where both sides push back to the surface there is no motion that leaves it
   subroutine test_sliding(error)
      type(error_type), allocatable, intent(out) :: error
      type(slider) :: sys
      class(stepper_type), allocatable :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      sys%n = 1
      sys%switches = 1
      sys%friction = 2.0_wp
      call new_method(stepper, 3)
      call start(sys, stepper, state, 1.0_wp, -0.5_wp, status)
      call run%begin(stepper, sys, state, 10.0_wp, control, status)
      call run%proceed(stepper, sys, state, status)
      call check(error, status%code, dynstep_too_many_events, trim(status%message))
      call check(error, state%y(2), 0.0_wp, 'at rest', thr=1.0e-9_wp)
      call check(error, state%t < 1.0_wp, 'time')
   end subroutine test_sliding

   !> Pieces of a run with events have the bits of the whole
   subroutine test_pieces(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: ball
      type(watcher) :: floor
      class(stepper_type), allocatable :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: y(2, 2), t(2)
      integer :: way, calls
      do way = 1, 2
         call new_point(ball, .false.)
         call new_method(stepper, 2)
         call start(ball, stepper, state, 1.0_wp, 0.0_wp, status)
         floor%kind = 6
         floor%restitution = 0.8_wp
         call run%begin(stepper, ball, state, 3.0_wp, control, status)
         do calls = 1, 10000
            if (way == 1) call run%proceed(stepper, ball, state, status, events=floor)
            if (way == 2) call run%proceed(stepper, ball, state, status, max_steps=1, events=floor)
            if (status%code /= dynstep_more) exit
         end do
         call check(error, status%code, 0, trim(status%message))
         y(:, way) = state%y
         t(way) = run%log%t(run%log%count)
      end do
      call check(error, all(abs(y(:, 1) - y(:, 2)) <= 0.0_wp), 'states')
      call check(error, t(1), t(2), 'last event', thr=tiny(1.0_wp))
   end subroutine test_pieces

   !> An action may move the level of its own event, by much less than a step
   subroutine test_moved_level(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      call new_point(sys, .true.)
      call new_method(stepper, 4)
      call start(sys, stepper, state, 0.0_wp, 1.0_wp, status)
      event%kind = 12
      event%level = 0.01_wp
      call run%begin(sys, state, 0.2_wp, control_type(h=0.1_wp), status)
      call run%proceed(stepper, sys, state, status, events=event)
      call check(error, status%code, 0, trim(status%message))
      ! sin(0.2) = 0.19867: levels 0.01, 0.014, ..., 0.198
      call check(error, run%log%count, 48)
      if (allocated(error)) return
      call check(error, run%log%t(48), asin(0.198_wp), 'the last one', thr=1.0e-12_wp)
   end subroutine test_moved_level

   !> Two events in each of a hundred time units, whatever the steps are
   subroutine test_many(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      call new_point(sys, .true.)
      call new_method(stepper, 6)
      call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
      event%kind = 10
      control%h_max = 2.0_wp
      call run%begin(stepper, sys, state, 100.0_wp, control, status)
      call run%proceed(stepper, sys, state, status, events=event)
      call check(error, status%code, 0, trim(status%message))
      ! the zero at the end lies on either side of it
      call check(error, run%log%count == 199 .or. run%log%count == 200, 'number')
      if (allocated(error)) return
      do i = 1, 199
         call check(error, run%log%t(i), 0.5_wp*i, 'time', thr=1.0e-13_wp)
      end do
   end subroutine test_many

   !> Two events 1e-15 to 1e-5 apart, by a method with a memory: what is behind the short step is as good as without it
   subroutine test_close(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      type(soi2_stepper) :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      integer :: k
      do k = 5, 15
         call new_point(sys, .true.)
         state%t = 0.0_wp
         state%y = [1.0_wp, 0.0_wp]
         call stepper%init(sys, status)
         call stepper%start(sys, state, status)
         event%kind = 11
         event%count = 2
         event%level = 10.0_wp**(-k)
         call run%begin(stepper, sys, state, 2.0_wp, control, status)
         call run%proceed(stepper, sys, state, status, events=event)
         call check(error, status%code, 0, trim(status%message))
         call check(error, run%log%count, 2)
         if (allocated(error)) return
         ! rtol = 1e-6, atol = 1e-8: 2/3 of the digits
         call check(error, state%y(1), cos(2.0_wp), 'q', thr=2.0e-4_wp)
      end do
   end subroutine test_close

   !> What a function or an action may do wrong: a sentence, and the state that was reached
   subroutine test_faults(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: kinds(5) = [3, 4, 5, 7, 8]
      integer, parameter :: codes(5) = [dynstep_not_finite, dynstep_callback_failed, dynstep_callback_failed, &
         & dynstep_callback_failed, dynstep_not_finite]
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      integer :: i
      do i = 1, size(kinds)
         call new_point(sys, .true.)
         call new_method(stepper, 6)
         call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
         event%kind = kinds(i)
         event%level = merge(0.9_wp, -2.0_wp, kinds(i) > 6)
         call run%begin(sys, state, 2.0_wp, control_type(h=0.1_wp), status)
         call run%proceed(stepper, sys, state, status, events=event)
         call check(error, status%code, codes(i), trim(status%message))
         call check(error, index(status%message, 'event') > 0 .and. index(status%message, 't = 0') > 0, trim(status%message))
         call check(error, state%t > 0.15_wp .and. state%t < 0.46_wp, 'time reached')
         call check(error, state%y(1), cos(state%t), 'the state that was reached', thr=1.0e-11_wp)
         status = status_type()
      end do
      event%kind = 1
      event%direction = [1, 1]
      call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
      call run%begin(sys, state, 2.0_wp, control_type(h=0.1_wp), status)
      call run%proceed(stepper, sys, state, status, events=event)
      call check(error, status%code, dynstep_invalid_input)
      call check(error, index(status%message, 'direction') > 0, trim(status%message))
   end subroutine test_faults

   !> A function that refuses its arguments close behind its zero is asked again with shorter steps
   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: fixed
      type(controlled_run_type) :: controlled
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      integer :: way
      call new_point(sys, .true.)
      call new_method(stepper, 6)
      event%kind = 9
      event%level = 0.3_wp
      event%terminal = [.true.]
      control%rtol = 1.0e-10_wp
      control%atol = [1.0e-10_wp]
      do way = 1, 2
         call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
         if (way == 1) then
            call fixed%begin(sys, state, 2.0_wp, control_type(h=0.25_wp), status)
            call fixed%proceed(stepper, sys, state, status, events=event)
         else
            call controlled%begin(stepper, sys, state, 2.0_wp, control, status)
            call controlled%proceed(stepper, sys, state, status, events=event)
         end if
         call check(error, status%code, dynstep_event, trim(status%message))
         call check(error, state%t, acos(0.3_wp), 'time', thr=1.0e-9_wp)
         if (allocated(error)) return
      end do
   end subroutine test_refusals

   !> An event costs a few steps, and a run without events none
   subroutine test_work(error)
      type(error_type), allocatable, intent(out) :: error
      type(point_mass) :: sys
      type(watcher) :: event
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(state_type) :: state
      type(status_type) :: status
      integer :: forces(2), way
      do way = 1, 2
         call new_point(sys, .true.)
         call new_method(stepper, 4)
         call start(sys, stepper, state, 1.0_wp, 0.0_wp, status)
         event%level = merge(5.0_wp, 0.3_wp, way == 1)
         call run%begin(sys, state, 2.0_wp, control_type(h=0.1_wp), status)
         call run%proceed(stepper, sys, state, status, events=event)
         forces(way) = int(stepper%count%forces)
      end do
      ! 20 steps; the one with the zero is made again by at most four of a secant, and its rest is one more
      call check(error, 20*(forces(2) - forces(1)) <= 6*forces(1), 'work of an event')
      call check(error, int(stepper%count%steps), 21)
   end subroutine test_work
end module test_events
