! SPDX-License-Identifier: BSD-3-Clause
!> Runs with steps of one length: times, what is recorded, pieces.
module test_drivers
   use dynstep
   use dynstep_dense_output, only: dense_output_type
   use reference_problems, only: problem_cubic, problem_linear
   use run_cases, only: equal, prepare, run, same_points, takes_forces
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_drivers

contains

   subroutine collect_drivers(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('times', test_times), &
         & new_unittest('shorter-last-step', test_shorter_last_step), &
         & new_unittest('every', test_every), &
         & new_unittest('t-eval', test_t_eval), &
         & new_unittest('t-eval-backward', test_t_eval_backward), &
         & new_unittest('pieces', test_pieces)]
   end subroutine collect_drivers

   !> t0 + k h to the last bit, and t_end itself, in both directions
   subroutine test_times(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: lengths(4) = [0.1_wp, -0.1_wp, 1.0_wp/3, -0.7_wp]
      real(wp), parameter :: starts(3) = [0.0_wp, 0.3_wp, -1.0e6_wp]
      type(trajectory_type) :: points
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: t_end
      integer :: i, j, k, steps
      do i = 1, size(lengths)
         do j = 1, size(starts)
            do steps = 1, 40, 13
               ! the user's own way to the end, with its rounding
               t_end = nearest(starts(j) + steps*lengths(i), real(mod(steps, 3) - 1.5_wp, wp))
               call run(problem_cubic, 'central-difference', starts(j), t_end, control_type(h=lengths(i)), &
                  & points, state, status)
               call check(error, .not. status%failed(), trim(status%message))
               call check(error, points%count, steps + 1, 'points')
               if (points%count /= steps + 1) return
               call check(error, equal(points%t(:steps), [(starts(j) + real(k, wp)*lengths(i), k=0, steps - 1)]), &
                  & 't0 + k h')
               call check(error, equal(points%t(steps + 1:steps + 1), [t_end]) .and. equal([state%t], [t_end]), 't_end')
            end do
         end do
      end do
   end subroutine test_times

   !> The rest of the interval is one shorter step
   subroutine test_shorter_last_step(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(trajectory_type) :: points
      type(state_type) :: state, by_hand
      type(status_type) :: status
      type(clock_type) :: clock
      integer :: i
      do i = 1, size(method_names)
         if (.not. takes_forces(method_names(i))) cycle
         call run(problem_cubic, trim(method_names(i)), 0.5_wp, 1.5625_wp, control_type(h=0.125_wp, every=2), &
            & points, state, status)
         call check(error, .not. status%failed(), trim(status%message))
         call check(error, equal(points%t(:points%count), [0.5_wp, 0.75_wp, 1.0_wp, 1.25_wp, 1.5_wp, 1.5625_wp]))
         call prepare(problem_cubic, trim(method_names(i)), 0.5_wp, sys, stepper, by_hand, status)
         clock = clock_type(t0=0.5_wp, h=0.125_wp, k=0)
         call stepper%advance(sys, by_hand, clock, 8, status, complete=.true.)
         clock = clock_type(t0=1.5_wp, h=0.0625_wp, k=0)
         call stepper%advance(sys, by_hand, clock, 1, status, complete=.true.)
         call check(error, equal(state%y, by_hand%y) .and. equal(state%a, by_hand%a), trim(method_names(i)))
      end do
      ! an interval shorter than a step
      call run(problem_cubic, 'newmark', 0.0_wp, -0.03_wp, control_type(h=-0.125_wp), points, state, status)
      call check(error, equal(points%t(:points%count), [0.0_wp, -0.03_wp]))
   end subroutine test_shorter_last_step

   subroutine test_every(error)
      type(error_type), allocatable, intent(out) :: error
      type(trajectory_type) :: all_points, points
      type(state_type) :: state
      type(status_type) :: status
      integer :: i, every
      call run(problem_linear, 'newmark-extrapolation', 0.0_wp, 1.0_wp, control_type(h=0.1_wp), all_points, state, status)
      call check(error, all_points%count, 11)
      do every = 2, 12
         call run(problem_linear, 'newmark-extrapolation', 0.0_wp, 1.0_wp, control_type(h=0.1_wp, every=every), &
            & points, state, status)
         call check(error, points%count, 1 + (10 + every - 1)/every, 'start, every k-th step, end')
         do i = 1, points%count
            call check(error, equal(points%y(:, i), all_points%y(:, min(1 + (i - 1)*every, 11))), 'the same points')
            call check(error, equal(points%a(:, i), all_points%a(:, min(1 + (i - 1)*every, 11))), 'the same points')
         end do
      end do
      call run(problem_linear, 'newmark-extrapolation', 0.0_wp, 1.0_wp, control_type(h=0.1_wp, every=0), points, state, &
         & status)
      call check(error, points%count, 1, 'the last point only')
      call check(error, equal(points%y(:, 1), all_points%y(:, 11)) .and. equal(points%t(:1), [1.0_wp]))
      call check(error, .not. status%failed(), trim(status%message))
   end subroutine test_every

   subroutine test_t_eval(error)
      type(error_type), allocatable, intent(out) :: error
      call t_eval_in_direction(error, 1.0_wp)
   end subroutine test_t_eval

   subroutine test_t_eval_backward(error)
      type(error_type), allocatable, intent(out) :: error
      call t_eval_in_direction(error, -1.0_wp)
   end subroutine test_t_eval_backward

   !> On step ends the steps' own bits, between them the dense output's to rounding; begin, end, repeated times, many
   !> in one step, none in many
   subroutine t_eval_in_direction(error, direction)
      type(error_type), allocatable, intent(inout) :: error
      real(wp), intent(in) :: direction
      real(wp), parameter :: h = 0.1_wp, t_end = 2.05_wp
      type(trajectory_type) :: all_points, points
      type(state_type) :: state, left, right, point
      type(status_type) :: status
      type(control_type) :: control
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(dense_output_type) :: dense
      type(state_type) :: begin
      integer :: i, step
      call run(problem_cubic, 'midpoint-extrapolation', 0.0_wp, direction*t_end, control_type(h=direction*h), &
         & all_points, state, status)
      control%h = direction*h
      control%t_eval = direction*[0.0_wp, 0.0_wp, 0.01_wp, 0.05_wp, 0.05_wp, 0.09_wp, 3*h, 0.35_wp, 4*h, 4*h, 17*h, &
         & 1.96_wp, 2.04_wp, 2.05_wp, 2.05_wp]
      call run(problem_cubic, 'midpoint-extrapolation', 0.0_wp, direction*t_end, control, points, state, status)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, equal(points%t(:points%count), control%t_eval), 'the times asked for')
      if (allocated(error)) return
      call prepare(problem_cubic, 'midpoint-extrapolation', 0.0_wp, sys, stepper, begin, status)
      call dense%begin(stepper, sys, status)
      call allocate_state(sys, point, status)
      do i = 1, points%count
         step = 1
         do while (direction*(all_points%t(step + 1) - points%t(i)) < 0.0_wp)
            step = step + 1
         end do
         call take_point(all_points, step, left)
         call take_point(all_points, step + 1, right)
         if (.not. abs(points%t(i) - left%t) > 0.0_wp) then
            point = left
         else if (.not. abs(points%t(i) - right%t) > 0.0_wp) then
            point = right
         else
            ! other matrices were kept for Newton's iteration, which goes to rounding; y' over h
            call dense%build(sys, left, right, 8, status)
            call dense%evaluate(sys, points%t(i), point)
            call check(error, maxval(abs(points%y(:, i) - point%y)), 0.0_wp, 'the point between', thr=2.0e-14_wp)
            call check(error, maxval(abs(points%a(:, i) - point%a)), 0.0_wp, 'a between', thr=2.0e-12_wp)
            cycle
         end if
         call check(error, equal(points%y(:, i), point%y) .and. equal(points%a(:, i), point%a), 'the point at a step''s end')
      end do
      call check(error, equal(state%y, all_points%y(:, all_points%count)), 'the end of the run')

      deallocate (control%t_eval)
      allocate (control%t_eval(0))
      call run(problem_cubic, 'midpoint-extrapolation', 0.0_wp, direction*t_end, control, points, state, status)
      call check(error, points%count, 0, 'no times, no points')
      call check(error, equal(state%y, all_points%y(:, all_points%count)), 'the end of the run')
   end subroutine t_eval_in_direction

   subroutine take_point(points, i, state)
      type(trajectory_type), intent(in) :: points
      integer, intent(in) :: i
      type(state_type), intent(inout) :: state
      state%t = points%t(i)
      state%y = points%y(:, i)
      state%a = points%a(:, i)
      state%lambda = points%lambda(:, i)
      state%psi = points%psi(:, i)
   end subroutine take_point

   !> Pieces of 1, 2, 7 or any number of steps, with every kind of recording, for all methods
   subroutine test_pieces(error)
      type(error_type), allocatable, intent(out) :: error
      type(control_type) :: control
      integer :: i, problem, way
      do problem = 1, 3
         do i = 1, size(method_names)
            if (.not. takes_forces(method_names(i))) cycle
            do way = 1, 3
               control = control_type(h=0.15_wp, every=merge(0, 3, way == 1))
               if (way == 3) control%t_eval = [0.02_wp, 0.3_wp, 0.31_wp, 1.5_wp, 3.17_wp]
               call pieces(error, problem, trim(method_names(i)), control)
            end do
         end do
      end do
   end subroutine test_pieces

   subroutine pieces(error, problem, method, control)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: problem
      character(len=*), intent(in) :: method
      type(control_type), intent(in) :: control
      real(wp), parameter :: t_end = 3.2_wp
      integer, parameter :: lengths(4) = [1, 2, 7, 0]
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(integration_type) :: in_pieces
      type(trajectory_type) :: whole, points
      type(state_type) :: at_end, state
      type(status_type) :: status
      integer :: way, calls, seed, most
      call run(problem, method, 0.0_wp, t_end, control, whole, at_end, status)
      seed = 7
      do way = 1, 4
         call prepare(problem, method, 0.0_wp, sys, stepper, state, status)
         points%count = 0
         call in_pieces%begin(sys, state, t_end, control, status)
         do calls = 1, 100
            seed = mod(seed*75 + 74, 65537)
            most = lengths(way)
            if (way == 4) most = 1 + mod(seed, 5)
            call in_pieces%proceed(stepper, sys, state, status, points, max_steps=most)
            if (status%code /= dynstep_more) exit
         end do
         call check(error, status%code, dynstep_success, method//': '//trim(status%message))
         call check(error, in_pieces%finished(state), method//' is finished')
         call check(error, equal(state%y, at_end%y) .and. equal(state%a, at_end%a), method//': the end of a run in pieces')
         call check(error, same_points(points, whole), method//': the points of a run in pieces')
      end do
   end subroutine pieces
end module test_drivers
