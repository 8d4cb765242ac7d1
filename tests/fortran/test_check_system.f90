! SPDX-License-Identifier: BSD-3-Clause
!> check_system finds each kind of wrong declaration, names it, and raises no false alarm.
module test_check_system
   use dynstep, only: bilinear_spring, check_system, diagonal_matrix, finding_length, identity_matrix, kind_banded, &
      & kind_dense, kind_diagonal, kind_identity, linear_system, load_procedure, matrix_type, mechanical_system, &
      & status_type, two_body_system, wp, zero_matrix
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input
   use spring_cases, only: cranked_system, spring_system
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_check_system

   !> A chain with cubic springs, a mass that may depend on q, and what can be wrong about it
   type, extends(mechanical_system) :: chain_type
      real(wp) :: scale = 1.0_wp            !! length of the coordinates
      real(wp) :: cubic = 0.3_wp, damping = 0.1_wp, mass_growth = 0.0_wp
      logical :: tangent_is_given = .true.
      real(wp) :: slip = 0.0_wp             !! error of K(2,1)
      integer :: ierr = 0
      integer :: calls = 0
      logical :: forgets = .false.          !! the force depends on the number of calls
   contains
      procedure :: force => chain_force
      procedure :: mass => chain_mass
      procedure :: tangent => chain_tangent
   end type chain_type

   !> A load that load_kind may forget
   type, extends(linear_system) :: forgetful_load
   contains
      procedure :: load => forgetful_load_load
   end type forgetful_load

   !> A force of its own, which no stepper calls
   type, extends(linear_system) :: own_force
   contains
      procedure :: force => own_force_force
   end type own_force

contains

   subroutine collect_check_system(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('no-false-alarm', test_no_false_alarm), &
         & new_unittest('wrong-tangent', test_wrong_tangent), &
         & new_unittest('wrong-declarations', test_wrong_declarations), &
         & new_unittest('units', test_units), &
         & new_unittest('linear-systems', test_linear_systems), &
         & new_unittest('refusals', test_refusals)]
   end subroutine collect_check_system

   recursive subroutine chain_force(self, t, q, v, f, ierr)
      class(chain_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      real(wp) :: x(self%n)
      x = q/self%scale
      f = -2.0_wp*x - self%cubic*x**3 - self%damping*v/self%scale
      f(2:) = f(2:) + x(:self%n - 1)
      f(:self%n - 1) = f(:self%n - 1) + x(2:)
      self%calls = self%calls + 1
      if (self%forgets) f(1) = f(1) + self%calls
      ierr = self%ierr
   end subroutine chain_force

   recursive subroutine chain_mass(self, t, q, v, mass, ierr)
      class(chain_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      integer :: i
      ierr = 0
      do i = 1, self%n
         call mass%set_entry(i, i, 2.0_wp + self%mass_growth*(q(i)/self%scale)**2)
      end do
   end subroutine chain_mass

   recursive subroutine chain_tangent(self, t, q, v, a, k, c, ierr)
      class(chain_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      integer :: i
      if (.not. self%tangent_is_given) then
         call self%difference_tangent(t, q, v, a, k, c, ierr)
         return
      end if
      ierr = 0
      do i = 1, self%n
         call k%set_entry(i, i, (2.0_wp + 3.0_wp*self%cubic*(q(i)/self%scale)**2)/self%scale &
            & + 2.0_wp*self%mass_growth*q(i)*a(i)/self%scale**2)
         call c%set_entry(i, i, self%damping/self%scale)
         if (i == 1) cycle
         call k%set_entry(i, i - 1, -1.0_wp/self%scale)
         call k%set_entry(i - 1, i, -1.0_wp/self%scale)
      end do
      if (self%n > 1) call k%set_entry(2, 1, (self%slip - 1.0_wp)/self%scale)
   end subroutine chain_tangent

   function make_chain(n, scale) result(sys)
      integer, intent(in) :: n
      real(wp), intent(in) :: scale
      type(chain_type) :: sys
      sys%n = n
      sys%scale = scale
      sys%structure%mass = kind_diagonal
      sys%structure%tangent = kind_banded
      sys%structure%kl = min(1, n - 1)
      sys%structure%ku = min(1, n - 1)
      sys%structure%tangent_is_symmetric = .true.
   end function make_chain

   !> What the report says of a system at a general point
   subroutine examine(sys, scale, report, status)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: scale
      character(len=finding_length), allocatable, intent(out) :: report(:)
      type(status_type), intent(out) :: status
      integer :: i
      call check_system(sys, 0.3_wp, scale*[(sin(1.0_wp + 1.7_wp*i), i=1, sys%n)], &
         & scale*[(cos(0.4_wp + 2.3_wp*i), i=1, sys%n)], report, status)
   end subroutine examine

   subroutine test_no_false_alarm(error)
      type(error_type), allocatable, intent(out) :: error
      type(chain_type) :: sys
      type(two_body_system) :: bodies
      type(bilinear_spring) :: spring
      type(status_type) :: status
      character(len=finding_length), allocatable :: report(:)
      integer, parameter :: orders(5) = [1, 2, 7, 20, 50]
      integer :: i, k, given
      do i = 1, size(orders)
         do k = -6, 6, 3
            do given = 0, 1
               sys = make_chain(orders(i), 10.0_wp**k)
               sys%tangent_is_given = given == 1
               call examine(sys, sys%scale, report, status)
               call check(error, .not. status%failed(), status%message)
               sys%mass_growth = 0.5_wp
               sys%structure%mass_is_constant = .false.
               call examine(sys, sys%scale, report, status)
               call check(error, .not. status%failed() .and. size(report) == 0, status%message)
            end do
         end do
      end do
      sys = make_chain(6, 1.0_wp)
      sys%cubic = 0.0_wp
      sys%damping = 0.0_wp
      sys%structure%force_is_linear = .true.
      sys%structure%tangent_is_constant = .true.
      sys%structure%velocity_free = .true.
      call examine(sys, 1.0_wp, report, status)
      call check(error, .not. status%failed(), status%message)
      call bodies%setup(m1=1.0_wp, m2=2.0_wp, d1=1.0_wp, d2=1.5_wp, i1=1.0_wp, i2=3.0_wp)
      call examine(bodies, 1.0_wp, report, status)
      call check(error, .not. status%failed(), 'two bodies: '//status%message)
      call spring%setup()
      call examine(spring, 0.5_wp, report, status)
      call check(error, .not. status%failed(), 'bilinear spring: '//status%message)
   end subroutine test_no_false_alarm

   subroutine test_wrong_tangent(error)
      type(error_type), allocatable, intent(out) :: error
      type(chain_type) :: sys
      type(status_type) :: status
      character(len=finding_length), allocatable :: report(:)
      sys = make_chain(5, 1.0_wp)
      sys%slip = 0.01_wp
      call examine(sys, 1.0_wp, report, status)
      call check(error, status%code, dynstep_invalid_input)
      call check(error, index(status%message, 'K(2,1): tangent gives -0.99, differences of f - M a give -1') == 1, &
         & status%message)
      call check(error, any(index(report, 'K is declared symmetric') == 1), 'asymmetry is told')
      sys = make_chain(5, 1.0_wp)
      sys%mass_growth = 0.5_wp                     ! dM/dq left out of the tangent of a user is found, too
      sys%structure%mass_is_constant = .true.
      call examine(sys, 1.0_wp, report, status)
      call check(error, any(index(report, 'M is declared constant') == 1), 'constant mass')
   end subroutine test_wrong_tangent

   subroutine test_wrong_declarations(error)
      type(error_type), allocatable, intent(out) :: error
      type(chain_type) :: sys
      integer :: which
      character(len=*), parameter :: words(5) = [character(len=40) :: 'is declared linear', &
         & 'declared velocity-free', 'are declared constant', 'differences of f - M a', &
         & 'two results for the same arguments']
      type(status_type) :: status
      character(len=finding_length), allocatable :: report(:)
      do which = 1, size(words)
         sys = make_chain(4, 1.0_wp)
         select case (which)
         case (1)
            sys%structure%force_is_linear = .true.
         case (2)
            sys%structure%velocity_free = .true.
         case (3)
            sys%structure%tangent_is_constant = .true.
         case (4)
            sys%structure%tangent = kind_diagonal      ! the couplings are left out
         case (5)
            sys%forgets = .true.
         end select
         call examine(sys, 1.0_wp, report, status)
         call check(error, status%code, dynstep_invalid_input, words(which))
         call check(error, any(index(report, trim(words(which))) > 0), words(which))
      end do
      ! a band that is too narrow, with tangents by differences
      sys = make_chain(6, 1.0_wp)
      sys%tangent_is_given = .false.
      sys%structure%tangent_is_symmetric = .false.
      sys%structure%ku = 0
      call examine(sys, 1.0_wp, report, status)
      call check(error, any(index(report, 'K(') == 1), 'narrow band')
   end subroutine test_wrong_declarations

   !> Coordinates of sizes 1e6 to 1e-6 side by side: no false alarm, and the slip of the smallest
   !> is found
   subroutine test_units(error)
      type(error_type), allocatable, intent(out) :: error
      type(spring_system) :: sys
      type(status_type) :: status
      character(len=finding_length), allocatable :: report(:)
      real(wp), parameter :: sizes(4) = [1.0e6_wp, 1.0e-6_wp, 1.0_wp, 1.0e-3_wp]
      call sys%setup([1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp], 1.0_wp/sizes**2, [0.5_wp, 0.0_wp, 0.0_wp, 1.0_wp], 0.0_wp*sizes)
      sys%structure%tangent = kind_diagonal
      sys%gives_tangent = .true.
      call check_system(sys, 0.0_wp, sizes, 0.3_wp*sizes, report, status)
      call check(error, .not. status%failed(), status%message)
      sys%structure%force_is_linear = .true.
      sys%e = [0.0_wp, 1.0e10_wp, 0.0_wp, 0.0_wp]
      call check_system(sys, 0.0_wp, sizes, 0.3_wp*sizes, report, status)
      call check(error, index(status%message, 'is declared linear') > 0 .and. index(status%message, 'component 2') > 0, &
         & status%message)
   end subroutine test_units

   recursive subroutine forgetful_load_load(self, t, p, ierr)
      class(forgetful_load), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      p = 1.0_wp + t
   end subroutine forgetful_load_load

   recursive subroutine own_force_force(self, t, q, v, f, ierr)
      class(own_force), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -q**3
   end subroutine own_force_force

   !> What the steppers would not do for a linear system, or for one that is declared linear
   subroutine test_linear_systems(error)
      type(error_type), allocatable, intent(out) :: error
      type(forgetful_load) :: loaded
      type(own_force) :: forced
      type(cranked_system) :: cranked
      type(status_type) :: status
      character(len=finding_length), allocatable :: report(:)
      call loaded%set(identity_matrix(2), zero_matrix(2), diagonal_matrix([1.0_wp, 2.0_wp]), status)
      call check_system(loaded, 0.5_wp, [1.0_wp, 2.0_wp], [0.0_wp, 1.0_wp], report, status)
      call check(error, index(status%message, 'load_kind = load_none leaves it out') > 0, status%message)
      call status%clear()
      loaded%load_kind = load_procedure
      call check_system(loaded, 0.5_wp, [1.0_wp, 2.0_wp], [0.0_wp, 1.0_wp], report, status)
      call check(error, .not. status%failed(), status%message)
      call forced%set(identity_matrix(2), zero_matrix(2), diagonal_matrix([1.0_wp, 2.0_wp]), status)
      call check_system(forced, 0.5_wp, [1.0_wp, 2.0_wp], [0.0_wp, 1.0_wp], report, status)
      call check(error, index(status%message, 'stepped with p - C v - K q') > 0, status%message)

      call status%clear()
      cranked%n = 2
      cranked%rate = 1.5_wp
      cranked%gives_tangent = .true.
      cranked%structure%mass = kind_diagonal
      cranked%structure%mass_is_constant = .false.
      cranked%structure%force_is_linear = .true.
      call examine(cranked, 1.0_wp, report, status)
      call check(error, .not. status%failed(), status%message)
   end subroutine test_linear_systems

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(chain_type) :: sys
      type(status_type) :: status
      character(len=finding_length), allocatable :: report(:)
      sys = make_chain(3, 1.0_wp)
      sys%ierr = 7
      call examine(sys, 1.0_wp, report, status)
      call check(error, status%code, dynstep_callback_failed)
      call check(error, index(status%message, 'force returned ierr = 7') == 1, status%message)
      call status%clear()
      call check_system(sys, 0.0_wp, [1.0_wp], [1.0_wp], report, status)
      call check(error, status%code, dynstep_invalid_input)
      sys%structure%tangent = kind_identity
      call examine(sys, 1.0_wp, report, status)
      call check(error, index(status%message, 'structure%tangent') == 1, status%message)
      sys%structure%tangent = kind_dense
      sys%n = 0
      call check_system(sys, 0.0_wp, [real(wp) ::], [real(wp) ::], report, status)
      call check(error, status%failed(), 'n = 0')
   end subroutine test_refusals
end module test_check_system
