! SPDX-License-Identifier: BSD-3-Clause
!> Steps of SOI2 that are too long for Newton's iteration: made of shorter ones, or refused with everything as it was.
module test_divided_steps
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use dynstep, only: clock_type, dynstep_not_converged, dynstep_not_finite, jacobian_type, matrix_type, rod_pendulum, &
      & slider_crank, soi2_stepper, state_type, status_type, wp
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_divided_steps

   real(wp), parameter :: eps = epsilon(1.0_wp)

   !> The pendulum whose geometric stiffness fails from a time on
   type, extends(rod_pendulum) :: failing_pendulum
      real(wp) :: from = 0.0_wp
   contains
      procedure :: reaction_tangent => failing_reaction_tangent
   end type failing_pendulum

contains

   subroutine collect_divided_steps(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('divided', test_divided), &
         & new_unittest('refused', test_refused), &
         & new_unittest('tangent-not-finite', test_tangent_not_finite)]
   end subroutine collect_divided_steps

   recursive subroutine failing_reaction_tangent(self, t, q, v, lambda, psi, k, c, ierr)
      class(failing_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      call self%rod_pendulum%reaction_tangent(t, q, v, lambda, psi, k, c, ierr)
      if (t >= self%from) call k%set_entry(2, 2, ieee_value(1.0_wp, ieee_quiet_nan))
   end subroutine failing_reaction_tangent

   !> Slider-crank at 18 rad/s, and six corrections a step: enough for 2e-3 s, not for 0.1 s, in which the crank turns by
   !> 1.8 rad
   subroutine start_crank(sys, stepper, state, status)
      type(slider_crank), intent(out) :: sys
      type(soi2_stepper), intent(inout) :: stepper
      type(state_type), intent(out) :: state
      type(status_type), intent(inout) :: status
      stepper%newton%limit = 6
      call sys%setup()
      allocate (state%y(2*sys%n))
      call sys%start(0.3_wp, 18.0_wp, state%y(1:sys%n), state%y(sys%n + 1:), status)
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
   end subroutine start_crank

   subroutine test_divided(error)
      type(error_type), allocatable, intent(out) :: error
      type(slider_crank) :: sys
      type(soi2_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(jacobian_type) :: gq
      type(clock_type) :: clock
      real(wp), allocatable :: g(:), gt(:), gv(:)
      integer :: ierr

      call start_crank(sys, stepper, state, status)
      clock%h = 0.1_wp
      call stepper%advance(sys, state, clock, 10, status, .true.)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, int(clock%k), 10)
      call check(error, abs(state%t - 1.0_wp) <= 0.0_wp, 'steps end on the clock')
      call check(error, int(stepper%count%steps), 10, 'steps are those of the clock')
      call check(error, stepper%count%rejections > 0 .and. stepper%count%substeps > stepper%count%rejections, &
         & 'steps were divided')
      ! the constraints at round-off: lengths of 1 m, 30 eps of a sum of a few terms
      if (status%failed()) return
      allocate (g(sys%holonomic), gt(sys%holonomic), gv(sys%holonomic), source=0.0_wp)
      call gq%init(sys%holonomic, sys%n, sys%constraints%g, status)
      call sys%constraint(state%t, state%y(1:sys%n), g, ierr)
      call sys%constraint_jacobian(state%t, state%y(1:sys%n), gq, gt, ierr)
      call gq%multiply(state%y(sys%n + 1:), gv)
      call check(error, maxval(abs(g)), 0.0_wp, thr=30*eps*maxval(abs(state%y(1:sys%n))), message='g')
      ! what is left of Newton's iteration: 32 eps of the largest velocity
      call check(error, maxval(abs(gv + gt)), 0.0_wp, thr=64*eps*maxval(abs(state%y(sys%n + 1:))), message='g''')
   end subroutine test_divided

   !> Without halvings the step fails and says so; state, clock and history are as before, so that steps of another length
   !> go on with the same bits
   subroutine test_refused(error)
      type(error_type), allocatable, intent(out) :: error
      type(slider_crank) :: sys
      type(soi2_stepper) :: stepper
      type(state_type) :: state, before
      real(wp) :: untouched(18)
      type(status_type) :: status
      type(clock_type) :: clock
      integer :: pass
      stepper%newton%halvings = 0
      do pass = 1, 3
         call status%clear()
         if (pass == 3) stepper%newton%halvings = 1
         call start_crank(sys, stepper, state, status)
         clock = clock_type(h=1.0e-3_wp)
         call stepper%advance(sys, state, clock, 20, status, .true.)
         if (pass > 1) then
            before = state
            clock = clock_type(t0=state%t, h=0.5_wp)
            call stepper%advance(sys, state, clock, 1, status, .true.)
            call check(error, status%code, dynstep_not_converged, trim(status%message))
            call check(error, status%retry .and. index(status%message, 't = 0.02') > 0 .and. &
               & index(status%message, 'reduce h') > 0, trim(status%message))
            call check(error, (index(status%message, 'parts of a step of 0.5') > 0) .eqv. pass == 3, trim(status%message))
            call check(error, int(clock%k), 0)
            call check(error, same(state, before), 'the state is as before')
            call check(error, int(stepper%count%steps), 20)
            call status%clear()
         end if
         clock = clock_type(t0=state%t, h=2.0e-3_wp)
         call stepper%advance(sys, state, clock, 10, status, .true.)
         call check(error, .not. status%failed(), trim(status%message))
         if (pass == 1) untouched = state%y
         ! Newton's matrices are made anew after a failure: the next steps differ by what the iteration leaves
         call check(error, maxval(abs(state%y - untouched)), 0.0_wp, thr=100*32*eps*maxval(abs(state%y)), &
            & message='the next steps')
      end do
   end subroutine test_refused

   logical function same(x, y)
      type(state_type), intent(in) :: x, y
      same = all(abs([x%y - y%y, x%a - y%a, x%lambda - y%lambda, x%t - y%t]) <= 0.0_wp)
   end function same

   subroutine test_tangent_not_finite(error)
      type(error_type), allocatable, intent(out) :: error
      type(failing_pendulum) :: sys
      type(soi2_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(clock_type) :: clock
      call sys%setup()
      sys%from = 0.05_wp
      allocate (state%y(6))
      call sys%start(4.0_wp, 10.0_wp, state%y(1:3), state%y(4:6))
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      clock%h = 0.01_wp
      call stepper%advance(sys, state, clock, 20, status, .true.)
      call check(error, status%code, dynstep_not_finite, trim(status%message))
      call check(error, index(status%message, 'reaction_tangent') > 0 .and. index(status%message, 'row 2, column 2') > 0 &
         & .and. index(status%message, 't = 0.05') > 0, trim(status%message))
      call check(error, int(clock%k), 4)
   end subroutine test_tangent_not_finite
end module test_divided_steps
