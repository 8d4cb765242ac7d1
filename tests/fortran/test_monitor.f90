! SPDX-License-Identifier: BSD-3-Clause
!> Warnings of steps that are longer than a method bears.
module test_monitor
   use dynstep, only: control_type, controlled_run_type, diagonal_matrix, extrapolation_stepper, &
      & identity_matrix, integration_type, kind_banded, linear_system, matrix_type, newmark_stepper, pade_stepper, state_type, &
      & status_type, step_control_type, stepper_type, wp, zero_matrix
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_monitor

contains

   subroutine collect_monitor(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('highest-frequency', test_frequency), &
         & new_unittest('linear', test_linear), &
         & new_unittest('damped', test_damped), &
         & new_unittest('explicit', test_explicit), &
         & new_unittest('no-limit', test_no_limit), &
         & new_unittest('controlled', test_controlled)]
   end subroutine collect_monitor

   !> n masses of 1 between springs of 1, both ends fixed: omega = 2 sin(pi n/(2n + 2))
   subroutine new_chain(n, is_banded_mass, damping, sys, status)
      integer, intent(in) :: n
      logical, intent(in) :: is_banded_mass                  !! the mass is 1, stored as a band
      real(wp), intent(in) :: damping                        !! C = damping K
      type(linear_system), intent(out) :: sys
      type(status_type), intent(inout) :: status
      type(matrix_type) :: m, c, k
      integer :: i
      call k%init(kind_banded, n, 1, 1, .true., status)
      call c%init(kind_banded, n, 1, 1, .true., status)
      call m%init(kind_banded, n, 1, 1, .true., status)
      call k%set_zero()
      call c%set_zero()
      call m%set_zero()
      do i = 1, n
         call k%set_entry(i, i, 2.0_wp)
         call c%set_entry(i, i, 2.0_wp*damping)
         call m%set_entry(i, i, 1.0_wp)
         if (i == n) exit
         call k%set_entry(i, i + 1, -1.0_wp)
         call k%set_entry(i + 1, i, -1.0_wp)
         call c%set_entry(i, i + 1, -damping)
         call c%set_entry(i + 1, i, -damping)
      end do
      if (.not. is_banded_mass) m = identity_matrix(n)
      if (damping > 0.0_wp) then
         call sys%set(m, c, k, status)
      else
         call sys%set(m, zero_matrix(n), k, status)
      end if
   end subroutine new_chain

   subroutine new_extrapolation(levels, beta, stepper)
      integer, intent(in) :: levels
      real(wp), intent(in) :: beta
      class(stepper_type), allocatable, intent(out) :: stepper
      type(extrapolation_stepper), allocatable :: made
      type(newmark_stepper), allocatable :: base
      allocate (made, base)
      base%beta = beta
      made%levels = levels
      call move_alloc(base, made%base)
      call move_alloc(made, stepper)
   end subroutine new_extrapolation

   !> A run of `steps` steps, and its monitor
   subroutine run_chain(sys, stepper, h, steps, run, largest, status)
      type(linear_system), intent(inout) :: sys
      class(stepper_type), intent(inout) :: stepper
      real(wp), intent(in) :: h
      integer, intent(in) :: steps
      type(integration_type), intent(out) :: run
      real(wp), intent(out) :: largest                       !! entry of q at the end
      type(status_type), intent(inout) :: status
      type(state_type) :: state
      integer :: i
      allocate (state%y(2*sys%n), source=0.0_wp)
      ! the highest mode
      do i = 1, sys%n
         state%y(i) = sin(acos(-1.0_wp)*sys%n*i/(sys%n + 1.0_wp))
      end do
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call run%begin(sys, state, steps*h, control_type(h=h), status)
      call run%proceed(stepper, sys, state, status)
      largest = maxval(abs(state%y(:sys%n)))
   end subroutine run_chain

   subroutine test_frequency(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(status_type) :: status
      real(wp) :: largest, omega
      integer :: n
      do n = 3, 303, 100
         omega = 2.0_wp*sin(acos(-1.0_wp)*n/(2*n + 2.0_wp))
         call new_chain(n, .true., 0.0_wp, sys, status)
         call new_extrapolation(4, 0.25_wp, stepper)
         call run_chain(sys, stepper, 20.0_wp, 10, run, largest, status)
         ! from below, and the highest modes of long chains lie close to one another
         call check(error, run%monitor%omega, omega, 'omega by iteration', thr=0.03_wp)
         call check(error, run%monitor%omega <= omega*(1.0_wp + 1.0e-12_wp), 'from below')
         call new_chain(n, .false., 0.0_wp, sys, status)
         call new_extrapolation(4, 0.25_wp, stepper)
         call run_chain(sys, stepper, 0.1_wp, 10, run, largest, status)
         call check(error, run%monitor%omega, 2.0_wp, 'omega by circles', thr=1.0e-14_wp)
         call check(error, len_trim(run%monitor%warning), 0)
      end do
   end subroutine test_frequency

   !> Beyond the limit there is a warning with numbers and the motion grows, below there are neither
   subroutine test_linear(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(status_type) :: status
      real(wp) :: largest, limit
      call new_chain(20, .false., 0.0_wp, sys, status)
      call new_extrapolation(4, 0.25_wp, stepper)
      limit = stepper%stable_limit(0.0_wp, 1.0e-4_wp)
      call run_chain(sys, stepper, 0.9_wp*limit/2.0_wp, 100, run, largest, status)
      call check(error, len_trim(run%monitor%warning), 0, trim(run%monitor%warning))
      call check(error, largest <= 1.011_wp, 'no growth')
      call run_chain(sys, stepper, 20.0_wp, 100, run, largest, status)
      call check(error, index(run%monitor%warning, 'omega h = 39.') > 0, trim(run%monitor%warning))
      call check(error, index(run%monitor%warning, 'Pade') > 0, trim(run%monitor%warning))
      call check(error, largest > 2.0_wp, 'growth')
   end subroutine test_linear

   !> Damping of the highest mode is taken into account
   subroutine test_damped(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: run
      type(status_type) :: status
      real(wp) :: largest, undamped, damped, h
      call new_extrapolation(2, 0.25_wp, stepper)
      undamped = stepper%stable_limit(0.0_wp, 1.0e-4_wp)
      damped = stepper%stable_limit(0.05_wp, 1.0e-4_wp)
      call check(error, damped > 1.2_wp*undamped, 'damping helps')
      h = 0.5_wp*(1.1_wp*undamped + damped)/2.0_wp
      ! xi = damping omega/2
      call new_chain(20, .false., 0.05_wp, sys, status)
      call run_chain(sys, stepper, h, 100, run, largest, status)
      call check(error, len_trim(run%monitor%warning), 0, trim(run%monitor%warning))
      call check(error, largest <= 1.0_wp, 'no growth')
   end subroutine test_damped

   !> Methods with a limit of their own: omega h = 2 of the central difference
   subroutine test_explicit(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(newmark_stepper) :: stepper
      type(integration_type) :: run
      type(status_type) :: status
      real(wp) :: largest
      stepper%beta = 0.0_wp
      call new_chain(20, .false., 0.0_wp, sys, status)
      call run_chain(sys, stepper, 0.99_wp, 100, run, largest, status)
      call check(error, len_trim(run%monitor%warning), 0, trim(run%monitor%warning))
      call run_chain(sys, stepper, 1.05_wp, 100, run, largest, status)
      call check(error, index(run%monitor%warning, 'is beyond 2.0') > 0, trim(run%monitor%warning))
      call check(error, largest > 10.0_wp, 'growth')
   end subroutine test_explicit

   !> No warning, and no frequency looked for, where a method has no limit
   subroutine test_no_limit(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(pade_stepper) :: pade
      type(newmark_stepper) :: newmark
      type(integration_type) :: run
      type(status_type) :: status
      real(wp) :: largest
      call new_chain(20, .false., 0.0_wp, sys, status)
      call run_chain(sys, pade, 100.0_wp, 10, run, largest, status)
      call check(error, len_trim(run%monitor%warning), 0)
      call check(error, run%monitor%omega, 0.0_wp, thr=tiny(1.0_wp))
      call run_chain(sys, newmark, 100.0_wp, 10, run, largest, status)
      call check(error, len_trim(run%monitor%warning), 0)
      call check(error, run%monitor%omega, 0.0_wp, thr=tiny(1.0_wp))
   end subroutine test_no_limit

   !> Steps that follow tolerances, of a motion that is slow beside the highest frequency
   subroutine test_controlled(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      class(stepper_type), allocatable :: stepper
      type(controlled_run_type) :: run
      type(step_control_type) :: control
      type(state_type) :: state
      type(status_type) :: status
      call sys%set(identity_matrix(2), zero_matrix(2), diagonal_matrix([1.0_wp, 1.0e6_wp]), status)
      call new_extrapolation(3, 0.25_wp, stepper)
      allocate (state%y(4), source=[1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call run%begin(stepper, sys, state, 10.0_wp, control, status)
      call run%proceed(stepper, sys, state, status)
      call check(error, status%code, 0, trim(status%message))
      call check(error, state%y(1), cos(10.0_wp), thr=1.0e-4_wp)
      call check(error, index(run%monitor%warning, 'beyond') > 0, 'a warning')
      call check(error, run%monitor%omega, 1000.0_wp, 'omega', thr=1.0e-9_wp)
   end subroutine test_controlled
end module test_monitor
