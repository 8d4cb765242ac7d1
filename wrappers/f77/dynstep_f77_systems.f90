! SPDX-License-Identifier: BSD-3-Clause
!> Systems and output whose procedures are EXTERNAL subroutines of FORTRAN 77 form.
!>
!> RPAR and IPAR are the caller's arrays, passed through; only their addresses are kept, and
!> only during a call.
module dynstep_f77_systems
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system, load_procedure
   use dynstep_matrix, only: matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_callback_failed, status_type
   use dynstep_stepper, only: state_type
   use dynstep_trajectory, only: recorder_type
   implicit none
   private

   abstract interface
      subroutine f77_force(n, t, q, v, f, rpar, ipar, ierr)
         import :: wp
         integer :: n, ipar(*), ierr
         real(wp) :: t, q(n), v(n), f(n), rpar(*)
      end subroutine f77_force

      subroutine f77_mass(n, t, q, v, am, ldm, rpar, ipar, ierr)
         import :: wp
         integer :: n, ldm, ipar(*), ierr
         real(wp) :: t, q(n), v(n), am(ldm, n), rpar(*)
      end subroutine f77_mass

      subroutine f77_tangent(n, t, q, v, a, ak, ac, ld, rpar, ipar, ierr)
         import :: wp
         integer :: n, ld, ipar(*), ierr
         real(wp) :: t, q(n), v(n), a(n), ak(ld, *), ac(ld, *), rpar(*)
      end subroutine f77_tangent

      subroutine f77_load(n, t, p, rpar, ipar, ierr)
         import :: wp
         integer :: n, ipar(*), ierr
         real(wp) :: t, p(n), rpar(*)
      end subroutine f77_load

      subroutine f77_out(n, t, q, v, a, rpar, ipar, istop)
         import :: wp
         integer :: n, ipar(*), istop
         real(wp) :: t, q(n), v(n), a(n), rpar(*)
      end subroutine f77_out
   end interface
   public :: f77_force, f77_mass, f77_tangent, f77_load, f77_out

   type, extends(mechanical_system), public :: f77_system
      procedure(f77_force), pointer, nopass :: force_external => null()
      procedure(f77_mass), pointer, nopass :: mass_external => null()
      procedure(f77_tangent), pointer, nopass :: tangent_external => null()   !! null: by differences
      real(wp), pointer, contiguous :: rpar(:) => null()
      integer, pointer, contiguous :: ipar(:) => null()
   contains
      procedure :: force => system_force
      procedure :: mass => system_mass
      procedure :: tangent => system_tangent
   end type f77_system

   type, extends(linear_system), public :: f77_linear_system
      procedure(f77_load), pointer, nopass :: load_external => null()
      real(wp), pointer, contiguous :: rpar(:) => null()
      integer, pointer, contiguous :: ipar(:) => null()
   contains
      procedure :: load => linear_load
   end type f77_linear_system

   !> Output through a subroutine, which may end the run
   type, extends(recorder_type), public :: f77_output
      integer :: n = 0
      logical :: stopped = .false.
      procedure(f77_out), pointer, nopass :: out_external => null()
      real(wp), pointer, contiguous :: rpar(:) => null()
      integer, pointer, contiguous :: ipar(:) => null()
   contains
      procedure :: record => output_record
   end type f77_output

contains

   recursive subroutine system_force(self, t, q, v, f, ierr)
      class(f77_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      call self%force_external(self%n, t, q, v, f, self%rpar, self%ipar, ierr)
   end subroutine system_force

   recursive subroutine system_mass(self, t, q, v, mass, ierr)
      class(f77_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      call self%mass_external(self%n, t, q, v, mass%a, size(mass%a)/self%n, self%rpar, self%ipar, ierr)
   end subroutine system_mass

   recursive subroutine system_tangent(self, t, q, v, a, k, c, ierr)
      class(f77_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      if (associated(self%tangent_external)) then
         call self%tangent_external(self%n, t, q, v, a, k%a, c%a, size(k%a)/self%n, self%rpar, self%ipar, ierr)
      else
         call self%difference_tangent(t, q, v, a, k, c, ierr)
      end if
   end subroutine system_tangent

   recursive subroutine linear_load(self, t, p, ierr)
      class(f77_linear_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      p = 0.0_wp
      if (self%load_kind == load_procedure) &
         & call self%load_external(self%n, t, p, self%rpar, self%ipar, ierr)
   end subroutine linear_load

   !> A stop is passed on as a failure, since that ends a run
   recursive subroutine output_record(self, state, status)
      class(f77_output), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      integer :: stop_asked
      if (status%failed() .or. self%stopped) return
      stop_asked = 0
      call self%out_external(self%n, state%t, state%y(:self%n), state%y(self%n + 1:), state%a, self%rpar, &
         & self%ipar, stop_asked)
      self%stopped = stop_asked /= 0
      if (self%stopped) call status%set(dynstep_callback_failed, 'OUT asked to stop')
   end subroutine output_record
end module dynstep_f77_systems
