! SPDX-License-Identifier: BSD-3-Clause
!> Runs that are broken off, written, read by another run with a method of its own, and go on: all bits and counters are those
!> of the run that was not broken off.  Steps of one length and steps by error, with events, switches, times inside steps.
module test_restore
   use dynstep, only: backinterpolation_stepper, bilinear_spring, control_type, controlled_run_type, dynstep_file_error, &
      & dynstep_invalid_input, dynstep_more, event_type, extrapolation_stepper, integration_type, long, lotka_volterra, &
      & midpoint_stepper, newmark_stepper, ode_system, pade_stepper, rod_pendulum, run_type, shear_building, soi2_stepper, &
      & state_type, status_type, step_control_type, stepper_type, trajectory_type, two_body_system, wp
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_restore

   character(len=*), parameter :: path = 'test_restore.checkpoint'

   !> y(1) = level; the action turns the rate round, where it is to
   type, extends(event_type) :: level_event
      real(wp) :: level = 0.0_wp
      logical :: turns = .false.
   contains
      procedure :: values => level_values
      procedure :: act => level_act
   end type level_event

   !> A family: what makes a system, a method, a state
   integer, parameter :: families(11) = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]
   character(len=24), parameter :: names(11) = [character(len=24) :: 'extrapolated Newmark', 'orders that vary', 'explicit', &
      & 'midpoint', 'bilinear spring', 'linear building', 'SOI2', 'backinterpolation', 'bi45', 'Pade', 'bi-extrapolation']

contains

   subroutine collect_restore(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('controlled', test_controlled), &
         & new_unittest('controlled-times', test_controlled_times), &
         & new_unittest('controlled-events', test_controlled_events), &
         & new_unittest('fixed', test_fixed), &
         & new_unittest('fixed-times', test_fixed_times), &
         & new_unittest('fixed-events', test_fixed_events), &
         & new_unittest('refusals', test_refusals)]
   end subroutine collect_restore

   recursive subroutine level_values(self, t, y, s, ierr)
      class(level_event), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      s = y(1) - self%level
   end subroutine level_values

   recursive subroutine level_act(self, i, sys, state, changed, ierr)
      class(level_event), intent(inout) :: self
      integer, intent(in) :: i
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(inout) :: changed
      integer, intent(out) :: ierr
      ierr = 0
      changed = self%turns
      if (self%turns) state%y(size(state%y)/2 + 1:) = -0.9_wp*state%y(size(state%y)/2 + 1:)
   end subroutine level_act

   !> System, method and start of a family
   subroutine prepare(family, sys, stepper, state, status)
      integer, intent(in) :: family
      class(ode_system), allocatable, intent(out) :: sys
      class(stepper_type), allocatable, intent(out) :: stepper
      type(state_type), intent(out) :: state
      type(status_type), intent(inout) :: status
      select case (family)
      case (1, 2)
         call new_two_body(sys, state)
      case (3, 5)
         call new_spring(sys, state, family == 5)
      case (4)
         call new_two_body(sys, state)
      case (6, 10)
         call new_building(sys, state, status)
      case (7)
         call new_pendulum(sys, state)
      case default
         call new_predators(sys, state)
      end select
      call new_method(family, stepper)
      call stepper%init(sys, status)
   end subroutine prepare

   subroutine new_two_body(sys, state)
      class(ode_system), allocatable, intent(out) :: sys
      type(state_type), intent(inout) :: state
      type(two_body_system), allocatable :: made
      allocate (made)
      call made%setup(m1=1.0_wp, m2=2.0_wp, d1=1.0_wp, d2=1.5_wp, i1=1.0_wp, i2=3.0_wp)
      state%y = [0.3_wp, -0.2_wp, 0.4_wp, 0.5_wp]
      call move_alloc(made, sys)
   end subroutine new_two_body

   subroutine new_spring(sys, state, zones_declared)
      class(ode_system), allocatable, intent(out) :: sys
      type(state_type), intent(inout) :: state
      logical, intent(in) :: zones_declared
      type(bilinear_spring), allocatable :: made
      allocate (made)
      made%zones_declared = zones_declared
      call made%setup()
      state%y = [2.0_wp, 0.0_wp]
      call move_alloc(made, sys)
   end subroutine new_spring

   subroutine new_building(sys, state, status)
      class(ode_system), allocatable, intent(out) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      type(shear_building), allocatable :: made
      integer :: i
      allocate (made)
      call made%setup([(1.0_wp, i=1, 5)], [(20.0_wp, i=1, 5)], [0.02_wp, 0.02_wp], status)
      state%y = [(0.01_wp*i, i=1, 5), 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      call move_alloc(made, sys)
   end subroutine new_building

   subroutine new_pendulum(sys, state)
      class(ode_system), allocatable, intent(out) :: sys
      type(state_type), intent(inout) :: state
      type(rod_pendulum), allocatable :: made
      allocate (made)
      call made%setup()
      allocate (state%y(2*made%n))
      call made%start(0.3_wp, 1.0_wp, state%y(1:made%n), state%y(made%n + 1:))
      call move_alloc(made, sys)
   end subroutine new_pendulum

   subroutine new_predators(sys, state)
      class(ode_system), allocatable, intent(out) :: sys
      type(state_type), intent(inout) :: state
      type(lotka_volterra), allocatable :: made
      allocate (made)
      call made%setup()
      state%y = [2.0_wp, 3.0_wp]
      call move_alloc(made, sys)
   end subroutine new_predators

   subroutine new_method(family, stepper)
      integer, intent(in) :: family
      class(stepper_type), allocatable, intent(out) :: stepper
      type(extrapolation_stepper), allocatable :: extrapolation
      type(newmark_stepper), allocatable :: newmark
      type(backinterpolation_stepper), allocatable :: bi
      select case (family)
      case (7)
         allocate (soi2_stepper :: stepper)
      case (8, 9)
         allocate (bi)
         if (family == 9) then
            bi%q = 5
            bi%alpha = 0.44_wp
         end if
         call move_alloc(bi, stepper)
      case (10)
         allocate (pade_stepper :: stepper)
      case default
         allocate (extrapolation, newmark)
         if (family == 3) newmark%beta = 0.0_wp
         if (family == 4) then
            allocate (midpoint_stepper :: extrapolation%base)
         else if (family == 11) then
            allocate (backinterpolation_stepper :: extrapolation%base)
            extrapolation%levels = 2
         else
            call move_alloc(newmark, extrapolation%base)
         end if
         extrapolation%vary_order = family == 2
         call move_alloc(extrapolation, stepper)
      end select
   end subroutine new_method

   subroutine test_controlled(error)
      type(error_type), allocatable, intent(out) :: error
      call all_families(error, .true., .false., .false.)
   end subroutine test_controlled

   subroutine test_controlled_times(error)
      type(error_type), allocatable, intent(out) :: error
      call all_families(error, .true., .true., .false.)
   end subroutine test_controlled_times

   subroutine test_controlled_events(error)
      type(error_type), allocatable, intent(out) :: error
      call all_families(error, .true., .false., .true.)
   end subroutine test_controlled_events

   subroutine test_fixed(error)
      type(error_type), allocatable, intent(out) :: error
      call all_families(error, .false., .false., .false.)
   end subroutine test_fixed

   subroutine test_fixed_times(error)
      type(error_type), allocatable, intent(out) :: error
      call all_families(error, .false., .true., .false.)
   end subroutine test_fixed_times

   subroutine test_fixed_events(error)
      type(error_type), allocatable, intent(out) :: error
      call all_families(error, .false., .true., .true.)
   end subroutine test_fixed_events

   subroutine all_families(error, is_controlled, has_times, has_events)
      type(error_type), allocatable, intent(inout) :: error
      logical, intent(in) :: is_controlled, has_times, has_events
      integer :: i, broken_off
      do i = 1, size(families)
         do broken_off = 0, 17
            if (broken_off > 3 .and. mod(broken_off, 7) /= 3) cycle
            call one(error, families(i), is_controlled, has_times, has_events, broken_off)
            if (allocated(error)) return
         end do
      end do
   end subroutine all_families

   subroutine one(error, family, is_controlled, has_times, has_events, broken_off)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: family
      logical, intent(in) :: is_controlled, has_times, has_events
      integer, intent(in) :: broken_off                     !! after so many steps
      class(ode_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      class(run_type), allocatable :: whole, first, second
      type(trajectory_type) :: all_points, points, more
      type(state_type) :: state, end_state
      type(status_type) :: status
      type(level_event) :: event
      integer(long) :: work(5)
      character(len=:), allocatable :: name

      name = trim(names(family))//', '//merge('by error  ', 'one by one', is_controlled)
      event%level = merge(0.5_wp, 1.5_wp, family < 8)
      if (family == 6 .or. family == 10) event%level = 0.005_wp
      event%turns = family < 7
      call prepare(family, sys, stepper, state, status)
      call begin(family, is_controlled, has_times, sys, stepper, state, whole, status)
      call go_on(whole, stepper, sys, state, all_points, event, has_events, huge(1), status)
      call check(error, status%code, 0, name//': '//trim(status%message))
      if (allocated(error)) return
      end_state = state

      call prepare(family, sys, stepper, state, status)
      call begin(family, is_controlled, has_times, sys, stepper, state, first, status)
      call go_on(first, stepper, sys, state, points, event, has_events, broken_off, status)
      call check(error, status%code, dynstep_more, name//': broken off')
      call first%checkpoint(path, stepper, sys, state, status)
      call check(error, status%code, 0, name//': '//trim(status%message))
      more = points
      call go_on(first, stepper, sys, state, more, event, has_events, huge(1), status)
      work = work_of(stepper)

      call prepare(family, sys, stepper, state, status)
      if (is_controlled) then
         allocate (controlled_run_type :: second)
      else
         allocate (integration_type :: second)
      end if
      call second%restore(path, stepper, sys, state, status)
      call check(error, status%code, 0, name//': '//trim(status%message))
      call go_on(second, stepper, sys, state, points, event, has_events, huge(1), status)
      call check(error, status%code, 0, name//': '//trim(status%message))
      if (allocated(error)) return
      call check(error, all(abs(state%y - end_state%y) <= 0.0_wp) .and. all(abs(state%a - end_state%a) <= 0.0_wp), &
         & name//': the end')
      call check(error, points%count, all_points%count, name//': number of points')
      if (allocated(error)) return
      call check(error, all(abs(points%t(:points%count) - all_points%t(:points%count)) <= 0.0_wp), name//': times')
      call check(error, all(abs(points%y(:, :points%count) - all_points%y(:, :points%count)) <= 0.0_wp), name//': points')
      call check(error, all(abs(points%a(:, :points%count) - all_points%a(:, :points%count)) <= 0.0_wp), name//': a')
      call check(error, second%log%count, whole%log%count, name//': events')
      ! the factors of linear engines are made again, and not counted a second time
      call check(error, all(work_of(stepper) == work), name//': work')
   end subroutine one

   function work_of(stepper) result(work)
      class(stepper_type), intent(in) :: stepper
      integer(long) :: work(5)
      work = [stepper%count%steps, stepper%count%substeps, stepper%count%rejections, stepper%count%forces, &
         & stepper%count%newton_iterations]
   end function work_of

   subroutine begin(family, is_controlled, has_times, sys, stepper, state, run, status)
      integer, intent(in) :: family
      logical, intent(in) :: is_controlled, has_times
      class(ode_system), intent(inout) :: sys
      class(stepper_type), intent(inout) :: stepper
      type(state_type), intent(inout) :: state
      class(run_type), allocatable, intent(out) :: run
      type(status_type), intent(inout) :: status
      type(controlled_run_type), allocatable :: controlled
      type(integration_type), allocatable :: fixed
      type(step_control_type) :: step_control
      type(control_type) :: control
      real(wp) :: t_end
      t_end = 4.0_wp
      call stepper%start(sys, state, status)
      if (is_controlled) then
         allocate (controlled)
         step_control%rtol = merge(1.0e-4_wp, 1.0e-7_wp, family == 7)
         step_control%atol = [step_control%rtol]
         step_control%h_max = 0.2_wp
         if (has_times) step_control%t_eval = [0.01_wp, 0.5_wp, 0.51_wp, 2.0_wp, 2.3_wp, 3.9_wp]
         call controlled%begin(stepper, sys, state, t_end, step_control, status)
         call move_alloc(controlled, run)
      else
         allocate (fixed)
         control%h = 0.13_wp
         if (has_times) control%t_eval = [0.01_wp, 0.5_wp, 0.51_wp, 2.0_wp, 2.3_wp, 3.9_wp]
         call fixed%begin(sys, state, t_end, control, status)
         call move_alloc(fixed, run)
      end if
   end subroutine begin

   subroutine go_on(run, stepper, sys, state, points, event, has_events, steps, status)
      class(run_type), intent(inout) :: run
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(trajectory_type), intent(inout) :: points
      type(level_event), intent(inout) :: event
      logical, intent(in) :: has_events
      integer, intent(in) :: steps
      type(status_type), intent(inout) :: status
      if (has_events) then
         call run%proceed(stepper, sys, state, status, points, max_steps=steps, events=event)
      else
         call run%proceed(stepper, sys, state, status, points, max_steps=steps)
      end if
   end subroutine go_on

   !> Other events, another kind of run, no file
   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      class(ode_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      class(run_type), allocatable :: run
      type(integration_type) :: other
      type(controlled_run_type) :: same
      type(trajectory_type) :: points
      type(state_type) :: state
      type(status_type) :: status
      type(level_event) :: event
      call prepare(1, sys, stepper, state, status)
      call begin(1, .true., .false., sys, stepper, state, run, status)
      call go_on(run, stepper, sys, state, points, event, .true., 3, status)
      call run%checkpoint(path, stepper, sys, state, status)
      call check(error, status%code, 0, trim(status%message))
      call prepare(1, sys, stepper, state, status)
      call other%restore(path, stepper, sys, state, status)
      call check(error, status%code, dynstep_file_error, trim(status%message))
      status = status_type()
      call prepare(1, sys, stepper, state, status)
      call same%restore(path, stepper, sys, state, status)
      call check(error, status%code, 0, trim(status%message))
      call go_on(same, stepper, sys, state, points, event, .false., 3, status)
      call check(error, status%code, dynstep_invalid_input, trim(status%message))
      call check(error, index(status%message, 'events') > 0, trim(status%message))
      status = status_type()
      call same%restore('no such file', stepper, sys, state, status)
      call check(error, status%code, dynstep_file_error, trim(status%message))
   end subroutine test_refusals
end module test_restore
