! SPDX-License-Identifier: BSD-3-Clause
!> Dense output: its nodes, what it costs by counters, that the run itself does not notice it, and what happens where a step
!> inside fails.  Its orders are in TEST_DENSE_ORDERS and TEST_DENSE_FAMILIES.
module test_dense_output
   use dynstep, only: allocate_state, backinterpolation_stepper, dense_output_type, diagonal_matrix, dynstep_callback_failed, &
      & extrapolation_stepper, identity_matrix, linear_system, mechanical_system, method_names, new_method, newmark_stepper, &
      & pade_stepper, state_type, status_type, step_counters, stepper_type, wp
   use dynstep_error_norm, only: error_norm_type
   use reference_problems, only: new_problem, problem_cubic, problem_linear, start_q, start_v
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_dense_output

   !> q" = -q^3, which refuses where it is told to
   type, extends(mechanical_system) :: hard_spring
      logical :: refuses = .false.
   contains
      procedure :: force => spring_force
   end type hard_spring

contains

   subroutine collect_dense_output(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('nodes', test_nodes), &
         & new_unittest('run untouched', test_untouched), &
         & new_unittest('work', test_work_inside), &
         & new_unittest('norm', test_norm), &
         & new_unittest('failing step', test_failing), &
         & new_unittest('forget', test_forget), &
         & new_unittest('not started', test_not_started)]
   end subroutine collect_dense_output

   recursive subroutine spring_force(self, t, q, v, f, ierr)
      class(hard_spring), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      f = -q**3
      ierr = merge(1, 0, self%refuses)
   end subroutine spring_force

   !> Nodes are the ends and equal steps between them; the interpolant goes through them to the last bit
   subroutine test_nodes(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(dense_output_type) :: dense
      type(state_type) :: state, trial, point, node
      type(status_type) :: status
      integer :: k

      call one_step(problem_cubic, 'newmark-extrapolation', sys, stepper, dense, state, trial, status)
      call dense%build(sys, state, trial, 8, status)
      call allocate_state(sys, point, status)
      call allocate_state(sys, node, status)
      call check(error, dense%last(), 4, 'nodes of order 8')
      do k = 0, dense%last()
         call dense%node(k, node)
         call check(error, node%t, 1.0_wp + 0.25_wp*(0.5_wp*k), 'times of the nodes')
         call dense%evaluate(sys, node%t, point)
         call check(error, all(abs(point%y - node%y) <= 0.0_wp) .and. all(abs(point%a - node%a) <= 0.0_wp), 'at a node')
      end do
      call check(error, all(abs(point%y - trial%y) <= 0.0_wp), 'the last node is the right end')
      call dense%node(0, node)
      call check(error, all(abs(node%y - state%y) <= 0.0_wp), 'the first node is the left end')
      call dense%build(sys, state, trial, 4, status)
      call check(error, dense%last(), 2, 'nodes of order 4')
      call dense%build(sys, state, trial, 99, status)
      call check(error, dense%last(), 4, 'no more than those of the method''s order')
      call check(error, .not. status%failed(), trim(status%message))
   end subroutine test_nodes

   !> A method that is ready for a problem, and a trial of length 1/2 from t = 1
   subroutine one_step(problem, method, sys, stepper, dense, state, trial, status)
      integer, intent(in) :: problem
      character(len=*), intent(in) :: method
      class(mechanical_system), allocatable, intent(out) :: sys
      class(stepper_type), allocatable, intent(out) :: stepper
      type(dense_output_type), intent(inout) :: dense
      type(state_type), intent(out) :: state, trial
      type(status_type), intent(inout) :: status
      call new_problem(problem, sys)
      call new_method(method, stepper, status)
      state%t = 1.0_wp
      state%y = [start_q, start_v]
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call dense%begin(stepper, sys, status)
      call allocate_state(sys, trial, status)
      call stepper%try_step(sys, state, 0.5_wp, 1.5_wp, trial, status)
   end subroutine one_step

   !> With and without dense output a run has the same bits and the same counters
   subroutine test_untouched(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(dense_output_type) :: dense
      type(state_type) :: state, trial, plain
      type(step_counters) :: count
      type(status_type) :: status
      integer :: method, i, way

      do method = 1, size(method_names)
         do way = 1, 2
            call one_step(problem_linear, trim(method_names(method)), sys, stepper, dense, state, trial, status)
            do i = 1, 5
               if (way == 2) call dense%build(sys, state, trial, 8, status)
               if (i == 3) call stepper%try_step(sys, state, 0.25_wp, state%t + 0.25_wp, trial, status)
               call stepper%accept(state, trial)
               call stepper%try_step(sys, state, 0.5_wp, state%t + 0.5_wp, trial, status)
            end do
            if (way == 1) then
               plain = trial
               count = stepper%count
            end if
         end do
         call check(error, .not. status%failed(), trim(status%message))
         call check(error, all(abs(plain%y - trial%y) <= 0.0_wp) .and. all(abs(plain%a - trial%a) <= 0.0_wp), &
            & trim(method_names(method))//' has other bits')
         call check(error, count%forces == stepper%count%forces .and. count%solves == stepper%count%solves .and. &
            & count%factorizations == stepper%count%factorizations .and. count%steps == stepper%count%steps, &
            & trim(method_names(method))//' has other counters')
      end do
   end subroutine test_untouched

   !> m more steps, and one factorization of each level for a step length
   subroutine test_work_inside(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      type(dense_output_type) :: dense
      type(state_type) :: state, trial, point
      type(step_counters) :: one
      type(status_type) :: status
      integer :: i

      call one_step(problem_cubic, 'newmark', sys, stepper, dense, state, trial, status)
      call dense%build(sys, state, trial, 2, status)
      call check(error, int(dense%work%forces), 0, 'order 2 costs nothing')

      call one_step(problem_linear, 'newmark-extrapolation', sys, stepper, dense, state, trial, status)
      one = stepper%count
      call allocate_state(sys, point, status)
      do i = 1, 3
         call dense%build(sys, state, trial, 8, status)
         call check(error, int(dense%work%factorizations), merge(4, 0, i == 1), 'one matrix for each level')
         call check(error, int(dense%work%solves), 3*(10 + 1), 'three steps of ten substeps and an acceleration')
         call check(error, int(dense%work%steps + dense%work%substeps), 0, 'they are no steps of the run')
         call dense%evaluate(sys, state%t + 0.1_wp, point)
         call stepper%accept(state, trial)
         call stepper%try_step(sys, state, 0.5_wp, state%t + 0.5_wp, trial, status)
      end do
      call check(error, .not. status%failed(), trim(status%message))
   end subroutine test_work_inside

   !> With a norm the same nodes are made by try_within
   subroutine test_norm(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(backinterpolation_stepper) :: stepper
      type(dense_output_type) :: dense
      type(error_norm_type) :: norm
      type(state_type) :: state, trial, points(2)
      type(status_type) :: status
      integer :: way

      stepper%p = 5
      stepper%q = 5
      call new_problem(problem_cubic, sys)
      norm%atol = [1.0e-6_wp]
      state%y = [start_q, start_v]
      call stepper%init(sys, status)
      call stepper%prepare_control(sys, norm, status)
      call stepper%start(sys, state, status)
      call allocate_state(sys, trial, status)
      call stepper%try_step(sys, state, 0.1_wp, 0.1_wp, trial, status)
      do way = 1, 2
         call dense%begin(stepper, sys, status)
         if (way == 1) call dense%build(sys, state, trial, 6, status)
         if (way == 2) call dense%build(sys, state, trial, 6, status, norm)
         call allocate_state(sys, points(way), status)
         call dense%node(2, points(way))
         call check(error, dense%last(), 3, 'two steps inside')
      end do
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, maxval(abs(points(1)%y - points(2)%y)) <= 0.0_wp, 'by try_within')
   end subroutine test_norm

   !> The status says so; points are those of both ends
   subroutine test_failing(error)
      type(error_type), allocatable, intent(out) :: error
      type(hard_spring) :: sys
      type(extrapolation_stepper) :: stepper
      type(dense_output_type) :: dense
      type(state_type) :: state, trial, point, quintic
      type(status_type) :: status, own

      sys%n = 1
      sys%structure%velocity_free = .true.
      allocate (stepper%base, source=newmark_stepper(beta=0.0_wp))
      state%y = [1.0_wp, 0.0_wp]
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call dense%begin(stepper, sys, status)
      call allocate_state(sys, trial, status)
      call allocate_state(sys, point, status)
      call allocate_state(sys, quintic, status)
      call stepper%try_step(sys, state, 0.25_wp, 0.25_wp, trial, status)
      call check(error, .not. status%failed(), trim(status%message))
      sys%refuses = .true.
      call dense%build(sys, state, trial, 8, own)
      call check(error, own%code, dynstep_callback_failed, 'the code')
      call check(error, index(own%message, 'dense output from t = 0') == 1, trim(own%message))
      call check(error, dense%last(), 1, 'both ends are left')
      call dense%evaluate(sys, 0.1_wp, point)
      call stepper%interpolate(sys, state, trial, 0.1_wp, quintic)
      call check(error, all(abs(point%y - quintic%y) <= 0.0_wp), 'the quintic')
      sys%refuses = .false.
      call own%clear()
      call dense%build(sys, state, trial, 8, own)
      call check(error, .not. own%failed() .and. dense%last() == 4, 'the next one is good again')
   end subroutine test_failing

   !> After `forget` the copy reads the matrices again
   subroutine test_forget(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(pade_stepper) :: stepper
      type(dense_output_type) :: dense
      type(state_type) :: state, trial, point
      type(status_type) :: status
      integer :: i

      do i = 1, 2
         call sys%set(identity_matrix(1), diagonal_matrix([0.0_wp]), diagonal_matrix([1.0_wp*i**2]), status)
         if (i == 1) then
            call stepper%init(sys, status)
            state%y = [1.0_wp, 0.0_wp]
            call stepper%start(sys, state, status)
            call dense%begin(stepper, sys, status)
            call allocate_state(sys, trial, status)
            call allocate_state(sys, point, status)
         else
            call stepper%restart(sys, state, status)
            call dense%forget()
         end if
         call stepper%try_step(sys, state, 0.25_wp, 0.25_wp, trial, status)
         call dense%build(sys, state, trial, 8, status)
         call dense%evaluate(sys, 0.1_wp, point)
         call check(error, point%y(1), cos(0.1_wp*i), 'the motion of these matrices', thr=1.0e-12_wp)
      end do
      call check(error, .not. status%failed(), trim(status%message))
   end subroutine test_forget

   subroutine test_not_started(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(newmark_stepper) :: stepper
      type(dense_output_type) :: dense
      type(status_type) :: status
      call new_problem(problem_cubic, sys)
      call stepper%init(sys, status)
      call dense%begin(stepper, sys, status)
      call check(error, status%failed() .and. index(status%message, 'call start') > 0, trim(status%message))
   end subroutine test_not_started
end module test_dense_output
