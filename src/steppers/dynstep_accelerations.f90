! SPDX-License-Identifier: BSD-3-Clause
!> Accelerations by back-substitution: M(t,q,v) a = f(t,q,v)  (Austin 1991, eq. (20), and
!> step [1d] of section 6).
!>
!> A constant mass matrix is asked for and factorized once; an identity is no matrix at all.
module dynstep_accelerations
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_identity, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_callback_failed, dynstep_not_finite, dynstep_singular_matrix, status_type
   use dynstep_stepper, only: state_type, step_counters
   use dynstep_text, only: text
   implicit none
   private

   public :: check_callback, check_finite

   type, public :: acceleration_solver
      type(matrix_type) :: m                       !! M at the last call
      type(factorization_type) :: factor           !! its factors
      logical, private :: known = .false.          ! a constant M is factorized
   contains
      procedure :: init => solver_init
      procedure :: forget => solver_forget
      procedure :: solve => solver_solve
      procedure :: complete => solver_complete
      procedure :: derivative => solver_derivative
      procedure :: prepare_mass => solver_prepare_mass
      procedure :: archive => solver_archive
   end type acceleration_solver

contains

   !> Storage for the declared structure of M
   recursive subroutine solver_init(self, sys, status)
      class(acceleration_solver), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      self%known = .false.
      select type (sys)
      class is (mechanical_system)
         associate (s => sys%structure)
            call self%m%init(s%mass, sys%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
            call self%factor%init(s%mass, sys%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         end associate
      end select
   end subroutine solver_init

   !> A new run may have another constant mass
   pure subroutine solver_forget(self)
      class(acceleration_solver), intent(inout) :: self
      self%known = .false.
   end subroutine solver_forget

   !> a = M^-1 f at (t, q, v)
   recursive subroutine solver_solve(self, sys, t, q, v, a, count, status)
      class(acceleration_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(out) :: a(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr

      if (status%failed()) return
      call sys%force(t, q, v, a, ierr)
      count%forces = count%forces + 1
      call check_callback('force', ierr, t, status)
      if (status%failed()) return
      call check_finite('force', a, t, status)
      if (status%failed() .or. sys%structure%mass == kind_identity) return
      call self%prepare_mass(sys, t, q, v, count, status)
      if (status%failed()) return
      call self%factor%solve(a)
      count%solves = count%solves + 1
   end subroutine solver_solve

   !> state%a of any system: accelerations, or y' of a system of first order
   recursive subroutine solver_complete(self, sys, state, count, status)
      class(acceleration_solver), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      select type (sys)
      class is (mechanical_system)
         call self%solve(sys, state%t, state%y(1:sys%n), state%y(sys%n + 1:), state%a, count, status)
      class default
         call self%derivative(sys, state%t, state%y, state%a, count, status)
      end select
   end subroutine solver_complete

   !> y' of any system, [v; M^-1 f] of one of mechanics
   recursive subroutine solver_derivative(self, sys, t, y, f, count, status)
      class(acceleration_solver), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)                   !! [state_size]
      real(wp), intent(inout) :: f(:)                !! [state_size]
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr

      if (status%failed()) return
      select type (sys)
      class is (mechanical_system)
         associate (n => sys%n)
            f(1:n) = y(n + 1:2*n)
            call self%solve(sys, t, y(1:n), y(n + 1:2*n), f(n + 1:2*n), count, status)
         end associate
      class default
         call sys%rhs(t, y, f, ierr)
         count%forces = count%forces + 1
         call check_callback('rhs', ierr, t, status)
         if (.not. status%failed()) call check_finite('rhs', f, t, status)
      end select
   end subroutine solver_derivative

   !> Factorize M(t, q, v); no work where M is the identity, or constant and known
   recursive subroutine solver_prepare_mass(self, sys, t, q, v, count, status)
      class(acceleration_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr

      if (status%failed() .or. self%known .or. sys%structure%mass == kind_identity) return
      call self%m%set_zero()
      call sys%mass(t, q, v, self%m, ierr)
      count%masses = count%masses + 1
      call check_callback('mass', ierr, t, status)
      if (status%failed()) return
      call self%factor%factorize(self%m, status, t, 'mass matrix')
      count%factorizations = count%factorizations + 1
      self%known = sys%structure%mass_is_constant .and. .not. status%failed()
      if (status%code == dynstep_not_finite) status%retry = .true.
      if (status%code == dynstep_singular_matrix) call status%set(dynstep_singular_matrix, trim(status%message) &
         & //'; condense coordinates that have no mass, or give them one')
   end subroutine solver_prepare_mass

   !> A status from the return code of a user procedure
   pure subroutine check_callback(name, ierr, t, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: ierr
      real(wp), intent(in) :: t
      type(status_type), intent(inout) :: status
      if (ierr == 0) return
      if (ierr > 0) then
         call status%set(dynstep_callback_failed, name//' refused its arguments at t = '//text(t) &
            & //' (ierr = '//text(ierr)//'); a smaller step may help', retry=.true.)
      else
         call status%set(dynstep_callback_failed, name//' gave up at t = '//text(t) &
            & //' (ierr = '//text(ierr)//')')
      end if
   end subroutine check_callback

   !> A status where a vector has an entry that is NaN or infinite
   pure subroutine check_finite(name, x, t, status)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: x(:)
      real(wp), intent(in) :: t
      type(status_type), intent(inout) :: status
      integer :: i
      ! the comparison abs(x) <= huge(x) would trap at a NaN where a program has set that up
      do i = 1, size(x)
         if (.not. ieee_is_finite(x(i))) exit
      end do
      if (i > size(x)) return
      call status%set(dynstep_not_finite, name//' returned '//text(x(i))//' in component ' &
         & //text(i)//' at t = '//text(t)//'; a smaller step may keep it in its domain', retry=.true.)
   end subroutine check_finite

   !> A constant M and its factors; any other is made at each use
   recursive subroutine solver_archive(self, name, file)
      class(acceleration_solver), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('known', self%known)
      if (self%known) then
         call self%m%archive('m', file)
         call self%factor%archive('factor', file)
      end if
      call file%end_section()
      if (file%failed()) self%known = .false.
   end subroutine solver_archive
end module dynstep_accelerations
