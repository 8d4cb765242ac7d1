! SPDX-License-Identifier: BSD-3-Clause
!> What goes wrong in a system: each failure gives a code, and a sentence that names the procedure,
!> the time, the equation; the state stays.  And the right-hand sides that systems provide.
module test_systems
   use, intrinsic :: ieee_arithmetic, only: ieee_negative_inf, ieee_quiet_nan, ieee_value
   use dynstep
   use run_cases, only: equal, new_state, takes_forces
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_systems

   !> Two coordinates, M full, with a fault in one of the procedures from a time on
   type, extends(mechanical_system) :: faulty_system
      character(len=7) :: where = ''          !! force, mass, tangent
      character(len=8) :: fault = ''          !! nan, infinity, smaller, give-up
      real(wp) :: from = huge(1.0_wp)
   contains
      procedure :: force => faulty_force
      procedure :: mass => faulty_mass
      procedure :: tangent => faulty_tangent
   end type faulty_system

   !> A linear system whose load has the fault
   type, extends(linear_system) :: faulty_load
      character(len=8) :: fault = ''
      real(wp) :: from = huge(1.0_wp)
   contains
      procedure :: load => faulty_load_load
   end type faulty_load

   !> y' = -y
   type, extends(ode_system) :: decay
   contains
      procedure :: rhs => decay_rhs
   end type decay

   !> Masses of any matrix, f = -q + v/2
   type, extends(mechanical_system) :: any_mass
      type(matrix_type) :: given
   contains
      procedure :: force => any_force
      procedure :: mass => any_mass_mass
   end type any_mass

   character(len=8), parameter :: faults(4) = [character(len=8) :: 'nan', 'infinity', 'smaller', 'give-up']

contains

   subroutine collect_systems(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('faults-at-start', test_start), &
         & new_unittest('faults-in-a-step', test_step), &
         & new_unittest('faults-of-a-load', test_load), &
         & new_unittest('singular-mass', test_singular_mass), &
         & new_unittest('first-order', test_first_order), &
         & new_unittest('wrong-methods', test_wrong_methods), &
         & new_unittest('subnormal-states', test_subnormal), &
         & new_unittest('wrong-structure', test_wrong_structure), &
         & new_unittest('wrong-matrices', test_wrong_matrices), &
         & new_unittest('rhs', test_rhs), &
         & new_unittest('energy', test_energy)]
   end subroutine collect_systems

   !> Make x and ierr faulty at and after a time
   recursive subroutine spoil(fault, from, t, x, ierr)
      character(len=*), intent(in) :: fault
      real(wp), intent(in) :: from, t
      real(wp), intent(inout) :: x
      integer, intent(out) :: ierr
      ierr = 0
      if (t < from) return
      if (fault == 'nan') x = ieee_value(x, ieee_quiet_nan)
      if (fault == 'infinity') x = ieee_value(x, ieee_negative_inf)
      if (fault == 'smaller') ierr = 3
      if (fault == 'give-up') ierr = -4
   end subroutine spoil

   recursive subroutine faulty_force(self, t, q, v, f, ierr)
      class(faulty_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -sin(q) - 0.125_wp*v
      if (self%where == 'force') call spoil(self%fault, self%from, t, f(2), ierr)
   end subroutine faulty_force

   recursive subroutine faulty_mass(self, t, q, v, mass, ierr)
      class(faulty_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      real(wp) :: m
      ierr = 0
      m = 2.0_wp
      if (self%where == 'mass') call spoil(self%fault, self%from, t, m, ierr)
      mass%a(:, 1) = [2.0_wp, 0.5_wp]
      mass%a(:, 2) = [0.5_wp, m]
   end subroutine faulty_mass

   recursive subroutine faulty_tangent(self, t, q, v, a, k, c, ierr)
      class(faulty_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      k%a(1, 1) = cos(q(1))
      k%a(2, 2) = cos(q(2))
      c%a(1, 1) = 0.125_wp
      c%a(2, 2) = 0.125_wp
      if (self%where == 'tangent') call spoil(self%fault, self%from, t, k%a(1, 2), ierr)
   end subroutine faulty_tangent

   recursive subroutine faulty_load_load(self, t, p, ierr)
      class(faulty_load), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      p = 1.0_wp
      call spoil(self%fault, self%from, t, p(2), ierr)
   end subroutine faulty_load_load

   recursive subroutine decay_rhs(self, t, y, f, ierr)
      class(decay), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      f = -y
   end subroutine decay_rhs

   recursive subroutine any_force(self, t, q, v, f, ierr)
      class(any_mass), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -q + 0.5_wp*v
   end subroutine any_force

   recursive subroutine any_mass_mass(self, t, q, v, mass, ierr)
      class(any_mass), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a = self%given%a
   end subroutine any_mass_mass

   subroutine make_faulty(where, fault, from, constant_mass, sys)
      character(len=*), intent(in) :: where, fault
      real(wp), intent(in) :: from
      logical, intent(in) :: constant_mass
      type(faulty_system), intent(out) :: sys
      sys%n = 2
      sys%structure%mass = kind_dense
      sys%structure%mass_is_constant = constant_mass
      sys%where = where
      sys%fault = fault
      sys%from = from
   end subroutine make_faulty

   !> Code and words that belong to a fault
   subroutine check_words(error, status, where, fault, time)
      type(error_type), allocatable, intent(inout) :: error
      type(status_type), intent(in) :: status
      character(len=*), intent(in) :: where, fault, time
      integer :: code
      code = dynstep_callback_failed
      if (fault == 'nan' .or. fault == 'infinity') code = dynstep_not_finite
      call check(error, status%code, code, where//', '//fault//': '//trim(status%message))
      call check(error, index(status%message, where) > 0, where//' is not in: '//trim(status%message))
      call check(error, index(status%message, 't = '//time) > 0, 't = '//time//' is not in: '//trim(status%message))
      call check(error, status%retry .eqv. fault /= 'give-up', 'whether a smaller step may help')
      if (fault == 'smaller') call check(error, index(status%message, 'ierr = 3') > 0, trim(status%message))
      if (fault == 'give-up') call check(error, index(status%message, 'ierr = -4') > 0, trim(status%message))
      if (fault == 'nan') call check(error, index(status%message, 'NaN') + index(status%message, 'not finite') > 0, &
         & trim(status%message))
   end subroutine check_words

   !> Force and mass are asked at the start: nothing but the acceleration may change
   subroutine test_start(error)
      type(error_type), allocatable, intent(out) :: error
      character(len=5), parameter :: places(2) = [character(len=5) :: 'force', 'mass']
      class(stepper_type), allocatable :: stepper
      type(faulty_system) :: sys
      type(state_type) :: state
      type(status_type) :: status
      integer :: i, j, k
      do i = 1, size(method_names)
         if (.not. takes_forces(method_names(i))) cycle
         do j = 1, size(places)
            do k = 1, size(faults)
               call make_faulty(trim(places(j)), trim(faults(k)), -1.0_wp, .true., sys)
               if (allocated(stepper)) deallocate (stepper)
               call status%clear()
               call new_method(trim(method_names(i)), stepper, status)
               call stepper%init(sys, status)
               state = new_state([0.5_wp, 0.25_wp, 0.0_wp, 1.0_wp])
               state%t = 2.5_wp
               call stepper%start(sys, state, status)
               status%retry = trim(faults(k)) /= 'give-up'        ! no step, so nothing is promised
               call check_words(error, status, trim(places(j)), trim(faults(k)), '2.5')
               call check(error, equal(state%y, [0.5_wp, 0.25_wp, 0.0_wp, 1.0_wp]), 'the state')
            end do
         end do
      end do
   end subroutine test_start

   !> A fault from a time on ends a run before it: state, clock and acceleration are those of the
   !> last step
   subroutine test_step(error)
      type(error_type), allocatable, intent(out) :: error
      character(len=7), parameter :: places(3) = [character(len=7) :: 'force', 'mass', 'tangent']
      class(stepper_type), allocatable :: stepper
      type(faulty_system) :: sys
      type(state_type) :: state, before
      type(clock_type) :: clock
      type(status_type) :: status
      integer :: i, j, k
      do i = 1, size(method_names)
         if (.not. takes_forces(method_names(i))) cycle
         do j = 1, size(places)
            do k = 1, size(faults)
               ! a good step, then the fault in the middle of the next one
               call make_faulty(trim(places(j)), trim(faults(k)), 0.3_wp, .false., sys)
               if (allocated(stepper)) deallocate (stepper)
               call status%clear()
               call new_method(trim(method_names(i)), stepper, status)
               call stepper%init(sys, status)
               state = new_state([0.5_wp, 0.25_wp, 0.0_wp, 1.0_wp])
               call stepper%start(sys, state, status)
               clock = clock_type(h=0.25_wp, k=0)
               call stepper%advance(sys, state, clock, 1, status, complete=.true.)
               call check(error, .not. status%failed(), trim(status%message))
               before = state
               call stepper%advance(sys, state, clock, 5, status, complete=.true.)
               if (places(j) == 'tangent' .and. .not. status%failed()) cycle   ! an old one still served
               if (places(j) == 'tangent' .and. index(status%message, 'matrix') > 0) then
                  call check(error, status%code, dynstep_not_finite, trim(status%message))
               else
                  call check_words(error, status, trim(places(j)), trim(faults(k)), '0.')
               end if
               call check(error, int(clock%k), 1, trim(method_names(i))//': the clock')
               call check(error, equal([state%t, state%y, state%a], [before%t, before%y, before%a]), 'the state')
            end do
         end do
      end do
   end subroutine test_step

   subroutine test_load(error)
      type(error_type), allocatable, intent(out) :: error
      class(stepper_type), allocatable :: stepper
      type(faulty_load) :: sys
      type(state_type) :: state, before
      type(clock_type) :: clock
      type(status_type) :: status
      integer :: i, k
      call sys%set(identity_matrix(2), zero_matrix(2), diagonal_matrix([1.0_wp, 2.0_wp]), status)
      sys%load_kind = load_procedure
      do i = 1, size(method_names)
         do k = 1, size(faults)
            sys%fault = faults(k)
            sys%from = 0.6_wp
            call status%clear()
            if (allocated(stepper)) deallocate (stepper)
            call new_method(trim(method_names(i)), stepper, status)
            call stepper%init(sys, status)
            state = new_state([0.5_wp, 0.25_wp, 0.0_wp, 1.0_wp])
            call stepper%start(sys, state, status)
            clock = clock_type(h=0.25_wp, k=0)
            call stepper%advance(sys, state, clock, 2, status, complete=.true.)
            call check(error, .not. status%failed(), trim(status%message))
            before = state
            call stepper%advance(sys, state, clock, 5, status, complete=.true.)
            if (index(status%message, 'force') > 0) then       ! the force that adds the load
               call check_words(error, status, 'force', trim(faults(k)), '0.')
            else
               call check_words(error, status, 'load', trim(faults(k)), '0.')
            end if
            call check(error, int(clock%k), 2, trim(method_names(i))//': the clock')
            call check(error, equal([state%t, state%y, state%a], [before%t, before%y, before%a]), 'the state')
         end do
      end do
   end subroutine test_load

   !> A mass that cannot be divided by is refused at the start, with the equation
   subroutine test_singular_mass(error)
      type(error_type), allocatable, intent(out) :: error
      class(stepper_type), allocatable :: stepper
      type(any_mass) :: sys
      type(state_type) :: state
      type(status_type) :: status
      integer :: i, kind
      do i = 1, size(method_names)
         if (.not. takes_forces(method_names(i))) cycle
         do kind = kind_diagonal, kind_dense
            sys%n = 3
            sys%structure%mass = kind
            sys%structure%mass_kl = 1
            sys%structure%mass_ku = 1
            select case (kind)
            case (kind_diagonal)
               sys%given = diagonal_matrix([1.0_wp, 0.0_wp, 2.0_wp])
            case (kind_banded)
               sys%given = banded_matrix(reshape([0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp], &
                  & [3, 3]), 1, 1, .true.)
            case (kind_dense)
               sys%given = dense_matrix(reshape([1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 2.0_wp], &
                  & [3, 3]), .true.)
            end select
            call status%clear()
            if (allocated(stepper)) deallocate (stepper)
            call new_method(trim(method_names(i)), stepper, status)
            call stepper%init(sys, status)
            state = new_state([1.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
            state%t = 1.5_wp
            call stepper%start(sys, state, status)
            call check(error, status%code, dynstep_singular_matrix, trim(status%message))
            call check(error, index(status%message, 'the mass matrix is singular at t = 1.5, equation') > 0 &
               & .and. index(status%message, ' 2: ') > 0, &
               & trim(status%message))
         end do
      end do
   end subroutine test_singular_mass

   !> A system of first order is refused by the methods of mechanics, in words, and one without unknowns by all
   subroutine test_first_order(error)
      type(error_type), allocatable, intent(out) :: error
      class(stepper_type), allocatable :: stepper
      type(decay) :: sys
      type(method_properties) :: facts
      type(status_type) :: status
      integer :: i
      do i = 1, size(method_names)
         sys%n = 2
         call status%clear()
         if (allocated(stepper)) deallocate (stepper)
         call new_method(trim(method_names(i)), stepper, status)
         facts = stepper%properties()
         call stepper%init(sys, status)
         if (facts%mechanical .or. facts%linear) then
            call check(error, status%code, dynstep_invalid_input)
            if (facts%mechanical) call check(error, index(status%message, 'first order') > 0, trim(status%message))
         else
            call check(error, .not. status%failed(), trim(status%message))
         end if
         sys%n = 0
         call status%clear()
         call stepper%init(sys, status)
         call check(error, index(status%message, 'n = 0') > 0, trim(status%message))
      end do
   end subroutine test_first_order

   !> Coefficients, levels, sequences and bases out of range
   subroutine test_wrong_methods(error)
      type(error_type), allocatable, intent(out) :: error
      type(any_mass) :: sys
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      type(extrapolation_stepper) :: extrapolation
      real(wp) :: nan
      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      sys%n = 1
      call refused(newmark_stepper(beta=-0.1_wp), 'beta')
      call refused(newmark_stepper(beta=nan), 'beta')
      call refused(newmark_stepper(gamma=-0.5_wp), 'gamma')
      call refused(newmark_stepper(gamma=nan), 'gamma')
      newmark%newton%limit = 0
      call refused(newmark, 'limit')
      midpoint%newton%halvings = -1
      call refused(midpoint, 'halvings')
      midpoint%newton%halvings = 5
      midpoint%newton%tolerance = nan
      call refused(midpoint, 'tolerance')

      call refused(extrapolation, 'no base')
      allocate (extrapolation%base, source=newmark_stepper(gamma=0.6_wp))
      call refused(extrapolation, 'gamma = 1/2')
      deallocate (extrapolation%base)
      allocate (midpoint_stepper :: extrapolation%base)
      extrapolation%levels = 0
      call refused(extrapolation, 'levels = 0')
      extrapolation%levels = 13
      call refused(extrapolation, 'levels = 13')
      extrapolation%levels = 3
      extrapolation%sequence = 0
      call refused(extrapolation, 'sequence = 0')
      extrapolation%sequence = 7
      call refused(extrapolation, 'sequence = 7')
      extrapolation%sequence = sequence_custom
      call refused(extrapolation, 'no numbers')
      extrapolation%custom = [1, 2]
      call refused(extrapolation, '2 numbers for 3 levels')
      extrapolation%custom = [1, 3, 2]
      call refused(extrapolation, 'must increase, and number 3, 2')
      extrapolation%custom = [0, 1, 2]
      call refused(extrapolation, 'number 1 of the custom sequence, 0')
      extrapolation%custom = [1, 2, 40000]
      call refused(extrapolation, 'number 3 of the custom sequence, 40000')

   contains

      subroutine refused(method, words)
         class(stepper_type), intent(in) :: method
         character(len=*), intent(in) :: words
         class(stepper_type), allocatable :: stepper
         type(status_type) :: status
         allocate (stepper, source=method)
         call stepper%init(sys, status)
         call check(error, status%code, dynstep_invalid_input, words)
         call check(error, index(status%message, words) > 0, words//' is not in: '//trim(status%message))
      end subroutine refused
   end subroutine test_wrong_methods

   !> Declarations that make no sense, by their names
   subroutine test_wrong_structure(error)
      type(error_type), allocatable, intent(out) :: error
      type(any_mass) :: sys
         sys%n = 3
      call refused(structure_type(mass=7), 'mass = 7')
      call refused(structure_type(mass=kind_zero), 'mass = -1')
      call refused(structure_type(mass=kind_banded, mass_kl=3), 'mass_kl = 3')
      call refused(structure_type(mass=kind_banded, mass_ku=-1), 'mass_ku = -1')
      call refused(structure_type(mass=kind_banded, mass_kl=1), 'mass_kl = 1')      ! symmetric, mass_ku = 0
      call refused(structure_type(tangent=4), 'tangent = 4')
      call refused(structure_type(tangent=kind_identity), 'tangent = 0')
      call refused(structure_type(tangent=kind_banded, kl=-1), 'kl = -1')
      call refused(structure_type(tangent=kind_banded, ku=5), 'ku = 5')
      call refused(structure_type(tangent=kind_banded, ku=1, tangent_is_symmetric=.true.), 'ku = 1')

   contains

      subroutine refused(structure, words)
         type(structure_type), intent(in) :: structure
         character(len=*), intent(in) :: words
         class(stepper_type), allocatable :: stepper
         type(status_type) :: status
         integer :: i
         sys%structure = structure
         do i = 1, size(method_names)
            call status%clear()
            if (allocated(stepper)) deallocate (stepper)
            call new_method(trim(method_names(i)), stepper, status)
            call stepper%init(sys, status)
            call check(error, status%code, dynstep_invalid_input, trim(method_names(i))//', '//words)
            call check(error, index(status%message, words) > 0, words//' is not in: '//trim(status%message))
         end do
      end subroutine refused
   end subroutine test_wrong_structure

   !> Matrices of a linear system, by name and entry
   subroutine test_wrong_matrices(error)
      type(error_type), allocatable, intent(out) :: error
      type(matrix_type) :: ok
      real(wp) :: nan
      nan = ieee_value(1.0_wp, ieee_quiet_nan)
      ok = diagonal_matrix([1.0_wp, 2.0_wp])
      call refused(zero_matrix(2), ok, ok, 'M must not be the zero matrix')
      call refused(diagonal_matrix([real(wp) ::]), ok, ok, 'M must have at least one row')
      call refused(ok, diagonal_matrix([1.0_wp]), ok, 'C has order 1, the system has 2')
      call refused(ok, ok, diagonal_matrix([1.0_wp, 2.0_wp, 3.0_wp]), 'K has order 3')
      call refused(diagonal_matrix([1.0_wp, nan]), ok, ok, 'M(2,2) is not finite')
      call refused(ok, ok, dense_matrix(reshape([1.0_wp, nan, 0.0_wp, 1.0_wp], [2, 2])), 'K(2,1) is not finite')
      call refused(ok, dense_matrix(reshape([1.0_wp, 2.0_wp, 0.5_wp, 1.0_wp], [2, 2]), .true.), ok, &
         & 'C is declared symmetric, but C(2,1) = 2 and C(1,2) = 0.5')
      call refused(ok, ok, banded_matrix(reshape([1.0_wp, 0.5_wp, 1.0_wp, 0.0_wp], [2, 2]), 1, 0, .true.), &
         & 'K is declared symmetric with kl = 1 and ku = 0')
      call refused(ok, ok, banded_matrix(reshape([1.0_wp, 0.5_wp, 1.0_wp, 0.0_wp], [2, 2]), 1, 1), &
         & 'K has storage that does not fit its kind')
      call refused(ok, dense_matrix(reshape([1.0_wp, 0.5_wp], [2, 1])), ok, 'C has storage')

   contains

      subroutine refused(m, c, k, words)
         type(matrix_type), intent(in) :: m, c, k
         character(len=*), intent(in) :: words
         type(linear_system) :: sys
         type(status_type) :: status
         call sys%set(m, c, k, status)
         call check(error, status%code, dynstep_invalid_input, words)
         call check(error, index(status%message, words) > 0, words//' is not in: '//trim(status%message))
         call check(error, sys%n, 0, 'nothing is taken')
      end subroutine refused
   end subroutine test_wrong_matrices

   !> y' = [v; M^-1 f] for every kind of mass
   subroutine test_rhs(error)
      type(error_type), allocatable, intent(out) :: error
      type(any_mass) :: sys
      real(wp) :: m(3, 3), y(6), f(6)
      integer :: kind, ierr
      y = [1.0_wp, -2.0_wp, 0.5_wp, 0.25_wp, 3.0_wp, -1.0_wp]
      m = 0.0_wp
      m(1, 1) = 2.0_wp
      m(2, 2) = 3.0_wp
      m(3, 3) = 4.0_wp
      do kind = kind_identity, kind_dense
         sys%n = 3
         sys%structure%mass = kind
         sys%structure%mass_kl = 0
         sys%structure%mass_ku = 0
         sys%structure%mass_is_symmetric = .true.
         select case (kind)
         case (kind_diagonal)
            sys%given = diagonal_matrix([2.0_wp, 3.0_wp, 4.0_wp])
         case (kind_banded)
            m(2, 1) = 0.5_wp
            sys%structure%mass_kl = 1
            sys%structure%mass_is_symmetric = .false.
            sys%given = banded_matrix(reshape([2.0_wp, 0.5_wp, 3.0_wp, 0.0_wp, 4.0_wp, 0.0_wp], [2, 3]), 1, 0)
         case (kind_dense)
            sys%structure%mass_is_symmetric = .false.
            m(1, 3) = -1.0_wp
            sys%given = dense_matrix(m)
         end select
         call sys%rhs(0.0_wp, y, f, ierr)
         call check(error, ierr, 0)
         call check(error, equal(f(1:3), y(4:6)), 'q'' = v')
         if (kind == kind_identity) then
            call check(error, equal(f(4:6), -y(1:3) + 0.5_wp*y(4:6)), 'v'' = f')
         else
            call check(error, maxval(abs(matmul(m, f(4:6)) - (-y(1:3) + 0.5_wp*y(4:6)))), 0.0_wp, thr=1.0e-14_wp)
         end if
      end do
      sys%given%a = 0.0_wp
      call sys%rhs(0.0_wp, y, f, ierr)
      call check(error, ierr < 0, 'a singular mass')
      call check(error, sys%state_size(), 6)
   end subroutine test_rhs

   !> Jacobians by differences at rest, and where a state is so small that a part of it in 1e8 is zero: f = -q + v/2, y' = -y.
   !> With and without velocities and accelerations, which give other sizes
   subroutine test_subnormal(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: lengths(6) = [0.0_wp, 1.0e-318_wp, 1.0e-310_wp, 1.0e-300_wp, 1.0e-280_wp, 1.0_wp]
      type(any_mass) :: sys
      type(decay) :: first_order
      type(matrix_type) :: k, c
      integer :: i, j, ierr
      sys%n = 2
      sys%structure%mass_is_constant = .true.
      first_order%n = 2
      k = dense_matrix(reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [2, 2]))
      c = k
      do i = 1, size(lengths)
         associate (q => [lengths(i), 0.5_wp*lengths(i)], rest => [0.0_wp, 0.0_wp])
            do j = 1, 4
               call sys%difference_tangent(0.0_wp, merge(q, rest, j /= 4), merge(q, rest, j >= 2), merge(q, rest, j >= 3), &
                  & k, c, ierr)
               call check(error, ierr, 0)
               call check(error, is_near(k, 1.0_wp), 'K')
               call check(error, is_near(c, -0.5_wp), 'C')
            end do
            call first_order%jacobian(0.0_wp, q, k, ierr)
            call check(error, ierr, 0)
            call check(error, is_near(k, -1.0_wp), 'df/dy')
         end associate
      end do
   end subroutine test_subnormal

   !> x times the identity: linear functions, whose differences have rounding errors alone, of f: epsilon/2 each beside a
   !> change by sqrt(epsilon) times the size, a hundredth of q's where v is zero
   pure logical function is_near(matrix, x)
      type(matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: x
      integer :: i, j
      is_near = .true.
      do j = 1, matrix%n
         do i = 1, matrix%n
            is_near = is_near .and. abs(matrix%entry(i, j) - merge(x, 0.0_wp, i == j)) <= 100.0_wp*sqrt(epsilon(x))
         end do
      end do
   end function is_near

   !> v^T M v/2 + q^T K q/2 where M and K are symmetric, in each storage; an error code where not
   subroutine test_energy(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(faulty_system) :: without
      type(status_type) :: status
      type(matrix_type) :: k
      real(wp) :: energy
      real(wp), parameter :: full(2, 2) = reshape([2.0_wp, -0.5_wp, -0.5_wp, 1.0_wp], [2, 2])
      integer :: i, ierr
      do i = 1, 2
         k = dense_matrix(full, .true.)
         if (i == 2) k = banded_matrix(reshape([0.0_wp, 2.0_wp, -0.5_wp, -0.5_wp, 1.0_wp, 0.0_wp], [3, 2]), 1, 1, .true.)
         call sys%set(diagonal_matrix([1.0_wp, 4.0_wp]), zero_matrix(2), k, status)
         call check(error, sys%structure%has_energy, 'symmetric matrices')
         call sys%energy(0.0_wp, [1.0_wp, 2.0_wp], [3.0_wp, 0.5_wp], energy, ierr)
         call check(error, ierr, 0)
         call check(error, energy, 0.5_wp*(9.0_wp + 1.0_wp) + 0.5_wp*(2.0_wp - 2.0_wp + 4.0_wp), thr=1.0e-15_wp)
      end do
      call sys%set(identity_matrix(2), zero_matrix(2), dense_matrix(full), status)
      call check(error, .not. sys%structure%has_energy, 'K may be unsymmetric')
      call sys%energy(0.0_wp, [1.0_wp, 2.0_wp], [3.0_wp, 0.5_wp], energy, ierr)
      call check(error, ierr /= 0, 'no energy')
      without%n = 1
      call without%energy(0.0_wp, [1.0_wp], [0.0_wp], energy, ierr)
      call check(error, ierr /= 0 .and. .not. without%structure%has_energy, 'no energy')
   end subroutine test_energy
end module test_systems
