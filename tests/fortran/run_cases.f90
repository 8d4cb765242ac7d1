! SPDX-License-Identifier: BSD-3-Clause
!> Runs of the reference problems by the name of a method, and comparisons to the last bit.
module run_cases
   use dynstep, only: control_type, integrate, mechanical_system, method_properties, new_method, state_type, &
      & status_type, stepper_type, trajectory_type, wp
   use reference_problems, only: new_problem, start_q, start_v
   implicit none
   private

   public :: equal, new_state, prepare, run, same_points, takes_forces

contains

   !> False for methods of linear systems alone
   logical function takes_forces(method)
      character(len=*), intent(in) :: method
      class(stepper_type), allocatable :: stepper
      type(method_properties) :: facts
      type(status_type) :: status
      call new_method(trim(method), stepper, status)
      facts = stepper%properties()
      takes_forces = .not. facts%linear
   end function takes_forces

   !> A problem, a method started on it, a state
   subroutine prepare(problem, method, t0, sys, stepper, state, status)
      integer, intent(in) :: problem
      character(len=*), intent(in) :: method
      real(wp), intent(in) :: t0
      class(mechanical_system), allocatable, intent(out) :: sys
      class(stepper_type), allocatable, intent(out) :: stepper
      type(state_type), intent(out) :: state
      type(status_type), intent(inout) :: status
      call new_problem(problem, sys)
      call new_method(method, stepper, status)
      allocate (state%y(4), source=[start_q, start_v])
      state%t = t0
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
   end subroutine prepare

   !> All points of a run
   subroutine run(problem, method, t0, t_end, control, points, state, status)
      integer, intent(in) :: problem
      character(len=*), intent(in) :: method
      real(wp), intent(in) :: t0, t_end
      type(control_type), intent(in) :: control
      type(trajectory_type), intent(out) :: points
      type(state_type), intent(out) :: state
      type(status_type), intent(inout) :: status
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper
      call prepare(problem, method, t0, sys, stepper, state, status)
      call integrate(stepper, sys, state, t_end, control, status, points)
   end subroutine run

   !> A state with y = [q; v] at time 0, not started
   function new_state(y) result(state)
      real(wp), intent(in) :: y(:)
      type(state_type) :: state
      allocate (state%y(size(y)), source=y)
   end function new_state

   pure logical function equal(x, y)
      real(wp), intent(in) :: x(:), y(:)
      equal = size(x) == size(y)
      if (equal) equal = .not. any(abs(x - y) > 0.0_wp)
   end function equal

   pure logical function same_points(left, right)
      type(trajectory_type), intent(in) :: left, right
      integer :: i
      same_points = left%count == right%count
      if (.not. same_points) return
      same_points = equal(left%t(:left%count), right%t(:left%count))
      do i = 1, left%count
         same_points = same_points .and. equal(left%y(:, i), right%y(:, i)) .and. equal(left%a(:, i), right%a(:, i))
      end do
   end function same_points
end module run_cases
