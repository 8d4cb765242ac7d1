! SPDX-License-Identifier: BSD-3-Clause
!> Systems and observers whose procedures are C functions with a context pointer.
!>
!>   c_system          general: M(t,q,v) q'' = f(t,q,v), with the constraints of c_constrained_system
!>   c_linear_system   M q'' + C q' + K q = p(t), with p by a C function where there is one
!>   c_observer        sees each step of a run
module dynstep_c_systems
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_loc, c_null_ptr, c_ptr
   use dynstep_c_constraints, only: c_constrained_system
   use dynstep_c_events, only: c_switching
   use dynstep_run, only: observer_type
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_zero, matrix_type
   use dynstep_stepper, only: state_type, stepper_type
   implicit none
   private

   abstract interface
      !> dynstep_force of dynstep.h
      function c_force_function(n, t, q, v, f, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*), v(*)
         real(c_double), intent(inout) :: f(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_force_function

      !> dynstep_tangent
      function c_tangent_function(n, t, q, v, a, k, c, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*), v(*), a(*)
         real(c_double), intent(inout) :: k(*)
         type(c_ptr), value :: c                     !! null where the system is velocity-free
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_tangent_function

      !> dynstep_energy_function
      function c_energy_function(n, t, q, v, energy, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*), v(*)
         real(c_double), intent(inout) :: energy
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_energy_function

      !> dynstep_load
      function c_load_function(n, t, p, ctx) result(ierr) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n
         real(c_double), value :: t
         real(c_double), intent(inout) :: p(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: ierr
      end function c_load_function

      !> dynstep_observer
      function c_observer_function(n, t, q, v, a, ctx) result(stop) bind(c)
         import :: c_double, c_int, c_ptr
         integer(c_int), value :: n
         real(c_double), value :: t
         real(c_double), intent(in) :: q(*)
         type(c_ptr), value :: v                     !! null for a first-order system
         real(c_double), intent(in) :: a(*)
         type(c_ptr), value :: ctx
         integer(c_int) :: stop
      end function c_observer_function
   end interface
   public :: c_force_function, c_tangent_function, c_energy_function, c_load_function, c_observer_function

   !> dynstep_mass has the interface of dynstep_force, the matrix in the place of f
   type, extends(c_constrained_system), public :: c_system
      procedure(c_force_function), pointer, nopass :: force_function => null()
      procedure(c_force_function), pointer, nopass :: mass_function => null()
      procedure(c_tangent_function), pointer, nopass :: tangent_function => null()
      procedure(c_energy_function), pointer, nopass :: energy_function => null()
      type(c_ptr) :: force_context = c_null_ptr
      type(c_ptr) :: mass_context = c_null_ptr
      type(c_ptr) :: tangent_context = c_null_ptr
      type(c_ptr) :: energy_context = c_null_ptr
      type(matrix_type) :: m                 !! the mass where it is no function
      type(c_switching) :: switching
   contains
      procedure :: force => system_force
      procedure :: mass => system_mass
      procedure :: tangent => system_tangent
      procedure :: energy => system_energy
      procedure :: switch_values => system_switch_values
      procedure :: sides_changed => system_sides_changed
   end type c_system

   type, extends(linear_system), public :: c_linear_system
      procedure(c_load_function), pointer, nopass :: load_function => null()
      type(c_ptr) :: load_context = c_null_ptr
   contains
      procedure :: load => linear_load
   end type c_linear_system

   type, extends(observer_type), public :: c_observer
      integer :: n = 0
      procedure(c_observer_function), pointer, nopass :: observer_function => null()
      type(c_ptr) :: context = c_null_ptr
   contains
      procedure :: observe => observer_observe
   end type c_observer

contains

   recursive subroutine system_force(self, t, q, v, f, ierr)
      class(c_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = self%force_function(self%n, t, q, v, f, self%force_context)
   end subroutine system_force

   recursive subroutine system_mass(self, t, q, v, mass, ierr)
      class(c_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      if (associated(self%mass_function)) then
         ierr = self%mass_function(self%n, t, q, v, mass%a, self%mass_context)
      else
         ierr = 0
         call self%m%add_to(1.0_wp, mass)
      end if
   end subroutine system_mass

   recursive subroutine system_tangent(self, t, q, v, a, k, c, ierr)
      class(c_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      if (.not. associated(self%tangent_function)) then
         call self%difference_tangent(t, q, v, a, k, c, ierr)
      else if (c%kind == kind_zero) then
         ierr = self%tangent_function(self%n, t, q, v, a, k%a, c_null_ptr, self%tangent_context)
      else
         call with_damping(self, t, q, v, a, k%a, c%a, ierr)
      end if
   end subroutine system_tangent

   !> The address of an array can be had where it is a target
   recursive subroutine with_damping(self, t, q, v, a, k, c, ierr)
      class(c_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(inout), contiguous :: k(:, :)
      real(wp), intent(inout), target, contiguous :: c(:, :)
      integer, intent(out) :: ierr
      ierr = self%tangent_function(self%n, t, q, v, a, k, c_loc(c), self%tangent_context)
   end subroutine with_damping

   recursive subroutine system_energy(self, t, q, v, energy, ierr)
      class(c_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      energy = 0.0_wp
      ierr = -1
      if (associated(self%energy_function)) &
         & ierr = self%energy_function(self%n, t, q, v, energy, self%energy_context)
   end subroutine system_energy

   recursive subroutine system_switch_values(self, t, y, s, ierr)
      class(c_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      call self%switching%values(self%n, t, y, s, ierr)
   end subroutine system_switch_values

   recursive subroutine system_sides_changed(self)
      class(c_system), intent(inout) :: self
      call self%switching%tell(self%side)
   end subroutine system_sides_changed

   recursive subroutine linear_load(self, t, p, ierr)
      class(c_linear_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      if (associated(self%load_function)) then
         ierr = self%load_function(self%n, t, p, self%load_context)
      else
         call self%linear_system%load(t, p, ierr)
      end if
   end subroutine linear_load

   recursive subroutine observer_observe(self, stepper, state, stop)
      class(c_observer), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      type(state_type), intent(in) :: state
      logical, intent(inout) :: stop
      if (size(state%y) == self%n) then
         stop = self%observer_function(self%n, state%t, state%y, c_null_ptr, state%a, self%context) /= 0
      else
         call observe_motion(self, state%t, state%y(:self%n), state%y(self%n + 1:), state%a, stop)
      end if
   end subroutine observer_observe

   !> The address of an array can be had where it is a target
   recursive subroutine observe_motion(self, t, q, v, a, stop)
      class(c_observer), intent(inout) :: self
      real(wp), intent(in) :: t, q(self%n)
      real(wp), intent(in), target :: v(self%n)
      real(wp), intent(in) :: a(self%n)
      logical, intent(inout) :: stop
      stop = self%observer_function(self%n, t, q, c_loc(v), a, self%context) /= 0
   end subroutine observe_motion
end module dynstep_c_systems
