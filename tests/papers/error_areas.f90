! SPDX-License-Identifier: BSD-3-Clause
!> Error areas (Austin 1991, eq. (42)): the spacing of the points times the sum of the errors
!> at all points but the start.
!>
!> The time of a point is formed as q*spacing.  Adding up the spacing instead makes the error
!> area of 100000 steps 160 times larger, by the rounding of the time alone.
module error_areas
   use dynstep_integrate, only: control_type, integrate
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_oscillator, only: loaded_oscillator
   use dynstep_status, only: status_type
   use dynstep_stepper, only: allocate_state, state_type, stepper_type
   use dynstep_trajectory, only: recorder_type
   use dynstep_two_body, only: two_body_system
   implicit none
   private

   public :: run

   type, abstract, extends(recorder_type), public :: error_area_type
      real(wp) :: spacing = 0.0_wp         !! time between the points
      integer :: points = 0                !! recorded so far
      real(wp) :: sums(4) = 0.0_wp         !! of the absolute errors
   contains
      procedure :: record => area_record
      procedure :: area => area_area
      procedure(errors_interface), deferred :: errors
   end type error_area_type

   abstract interface
      pure function errors_interface(self, t, state) result(errors)
         import :: error_area_type, state_type, wp
         class(error_area_type), intent(in) :: self
         real(wp), intent(in) :: t
         type(state_type), intent(in) :: state
         real(wp) :: errors(4)
      end function errors_interface
   end interface

   !> x = cos(4t): displacement, velocity, acceleration, energy
   type, extends(error_area_type), public :: free_area
   contains
      procedure :: errors => free_errors
   end type free_area

   !> Equation (47): displacement, velocity, acceleration
   type, extends(error_area_type), public :: loaded_area
   contains
      procedure :: errors => loaded_errors
   end type loaded_area

   !> Lagrangian and angular momentum of the two bodies
   type, extends(error_area_type), public :: two_body_area
      type(two_body_system) :: bodies
      real(wp) :: lagrangian = 0.0_wp      !! at the start
      real(wp) :: momentum = 0.0_wp
   contains
      procedure :: errors => two_body_errors
   end type two_body_area

contains

   !> `steps` steps of length h from q0, v0 at t = 0; every `every`-th point is recorded
   subroutine run(stepper, sys, q0, v0, h, steps, every, recorder, state)
      class(stepper_type), intent(inout) :: stepper
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: q0(:), v0(:), h
      integer, intent(in) :: steps, every
      class(recorder_type), intent(inout), optional :: recorder
      type(state_type), intent(out), optional :: state      !! the end
      type(state_type) :: point
      type(control_type) :: control
      type(status_type) :: status

      control%h = h
      control%every = every
      call stepper%init(sys, status)
      call allocate_state(sys, point, status)
      if (.not. status%failed()) point%y = [q0, v0]
      call stepper%start(sys, point, status)
      call integrate(stepper, sys, point, steps*h, control, status, recorder)
      if (status%failed()) then
         print '(a)', 'the run failed: '//trim(status%message)
         stop 1
      end if
      if (present(state)) state = point
   end subroutine run

   recursive subroutine area_record(self, state, status)
      class(error_area_type), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      if (self%points > 0) self%sums = self%sums + self%errors(self%points*self%spacing, state)
      self%points = self%points + 1
   end subroutine area_record

   pure function area_area(self) result(area)
      class(error_area_type), intent(in) :: self
      real(wp) :: area(4)
      area = self%spacing*self%sums
   end function area_area

   pure function free_errors(self, t, state) result(errors)
      class(free_area), intent(in) :: self
      real(wp), intent(in) :: t
      type(state_type), intent(in) :: state
      real(wp) :: errors(4)
      associate (x => state%y(1), v => state%y(2), a => state%a(1))
         errors(1) = abs(cos(4.0_wp*t) - x)
         errors(2) = abs(-4.0_wp*sin(4.0_wp*t) - v)
         errors(3) = abs(-16.0_wp*cos(4.0_wp*t) - a)
         errors(4) = abs(8.0_wp - (0.5_wp*v**2 + 8.0_wp*x**2))
      end associate
   end function free_errors

   pure function loaded_errors(self, t, state) result(errors)
      class(loaded_area), intent(in) :: self
      real(wp), intent(in) :: t
      type(state_type), intent(in) :: state
      real(wp) :: errors(4)
      type(loaded_oscillator) :: sys
      real(wp) :: x, v, a
      call sys%exact(t, x, v, a)
      errors = abs([x - state%y(1), v - state%y(2), a - state%a(1), 0.0_wp])
   end function loaded_errors

   pure function two_body_errors(self, t, state) result(errors)
      class(two_body_area), intent(in) :: self
      real(wp), intent(in) :: t
      type(state_type), intent(in) :: state
      real(wp) :: errors(4)
      errors = 0.0_wp
      associate (q => state%y(1:2), v => state%y(3:4))
         errors(1) = abs(self%lagrangian - self%bodies%lagrangian(q, v))
         errors(2) = abs(self%momentum - self%bodies%momentum(q, v))
      end associate
   end function two_body_errors
end module error_areas
