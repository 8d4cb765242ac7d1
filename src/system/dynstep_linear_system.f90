! SPDX-License-Identifier: BSD-3-Clause
!> M q'' + C q' + K q = p(t) with constant matrices (Austin 1991, eq. (27)).
!>
!> PROGRAMMING INTERFACE
!>
!>     type(linear_system) :: sys
!>     call sys%set(m, c, k, status)            ! matrix_type each; zero_matrix(n) for none
!>     call sys%set_table(table, status)        ! a load given by samples
!>
!>     call sys%set_coupling(b, k, c, status)   ! feedback, which would fill the band of K and C
!>
!>   With a coupling M q'' + C q' + K q = p(t) - b (k.q + c.q'): one force along b, by gains k and c of any
!>   coordinates.  Methods that solve with the band alone refuse it.
!>
!>   A load given by a procedure: extend LINEAR_SYSTEM, override LOAD, and set
!>   load_kind = load_procedure.  LOAD is all that an extension may change: the steppers read
!>   the matrices, not the force procedure.  The library steps such a system without any callback but
!>   LOAD, and factorizes once for each distinct step length.
module dynstep_linear_system
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_load_table, only: load_table_type
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: linear_system

   integer, parameter, public :: load_none = 0        !! free vibration
   integer, parameter, public :: load_procedure = 1   !! LOAD is overridden
   integer, parameter, public :: load_samples = 2     !! the table is read

   !> The force -b (k.q + c.q')
   type, public :: coupling_type
      real(wp), allocatable :: b(:)                   !! direction of the force [n]
      real(wp), allocatable :: k(:)                   !! gains of q [n]
      real(wp), allocatable :: c(:)                   !! gains of q' [n]
   end type coupling_type

   type, extends(mechanical_system) :: linear_system
      type(matrix_type) :: m, c, k                    !! mass, damping, stiffness
      integer :: load_kind = load_none
      type(load_table_type) :: table
      type(coupling_type) :: coupling                 !! where structure%is_coupled
   contains
      procedure :: set_coupling => linear_set_coupling
      procedure :: set => linear_set
      procedure :: set_table => linear_set_table
      procedure :: load => linear_load
      procedure :: force => linear_force
      procedure :: mass => linear_mass
      procedure :: tangent => linear_tangent
      procedure :: energy => linear_energy
   end type linear_system

contains

   !> Take the matrices and fill `structure` from them
   subroutine linear_set(self, m, c, k, status)
      class(linear_system), intent(inout) :: self
      type(matrix_type), intent(in) :: m, c, k      !! all of one order n >= 1
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (m%n < 1) call status%set(dynstep_invalid_input, 'M must have at least one row')
      if (m%kind == kind_zero) call status%set(dynstep_invalid_input, 'M must not be the zero matrix')
      call m%check('M', m%n, status)
      call c%check('C', m%n, status)
      call k%check('K', m%n, status)
      if (status%failed()) return
      self%n = m%n
      self%m = m
      self%c = c
      self%k = k
      associate (s => self%structure)
         s%mass = m%kind
         s%mass_kl = m%kl
         s%mass_ku = m%ku
         s%mass_is_constant = .true.
         s%mass_is_symmetric = m%symmetric
         s%tangent = max(kind_diagonal, c%kind, k%kind)
         s%kl = 0
         s%ku = 0
         if (s%tangent == kind_banded) then
            s%kl = max(c%kl, k%kl)
            s%ku = max(c%ku, k%ku)
         end if
         s%tangent_is_symmetric = c%symmetric .and. k%symmetric
         s%tangent_is_constant = .true.
         s%force_is_linear = .true.
         s%velocity_free = c%kind == kind_zero
         s%has_energy = m%symmetric .and. k%symmetric
         s%is_coupled = .false.
      end associate
   end subroutine linear_set

   !> Take a coupling; `set` takes it away
   subroutine linear_set_coupling(self, b, k, c, status)
      class(linear_system), intent(inout) :: self
      real(wp), intent(in) :: b(:), k(:), c(:)      !! [n] each, finite
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      call check_vector('b', b, self%n, status)
      call check_vector('k', k, self%n, status)
      call check_vector('c', c, self%n, status)
      if (status%failed()) return
      self%coupling%b = b
      self%coupling%k = k
      self%coupling%c = c
      self%structure%is_coupled = .true.
      self%structure%velocity_free = self%c%kind == kind_zero .and. .not. any(abs(c) > 0.0_wp)
   end subroutine linear_set_coupling

   subroutine check_vector(name, x, n, status)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: x(:)
      integer, intent(in) :: n
      type(status_type), intent(inout) :: status
      integer :: i
      if (status%failed()) return
      if (size(x) /= n) then
         call status%set(dynstep_invalid_input, name//' of the coupling has '//text(size(x)) &
            & //' entries, the system n = '//text(n)//'; call set first')
         return
      end if
      do i = 1, n
         if (ieee_is_finite(x(i))) cycle
         call status%set(dynstep_invalid_input, name//'('//text(i)//') of the coupling is '//text(x(i)))
         return
      end do
   end subroutine check_vector

   !> Take a load given by samples
   subroutine linear_set_table(self, table, status)
      class(linear_system), intent(inout) :: self
      type(load_table_type), intent(in) :: table
      type(status_type), intent(inout) :: status
      call table%check(self%n, status)
      if (status%failed()) return
      self%table = table
      self%load_kind = load_samples
   end subroutine linear_set_table

   !> p(t); an override goes with load_kind = load_procedure
   recursive subroutine linear_load(self, t, p, ierr)
      class(linear_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr           !! 0, > 0 smaller step, < 0 give up
      ierr = 0
      if (self%load_kind == load_samples) then
         call self%table%evaluate(t, p)
      else
         p = 0.0_wp
      end if
   end subroutine linear_load

   !> f = p - C v - K q - b (k.q + c.v)
   recursive subroutine linear_force(self, t, q, v, f, ierr)
      class(linear_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      call self%load(t, f, ierr)
      if (ierr /= 0) return
      call self%c%multiply_add(-1.0_wp, v, f)
      call self%k%multiply_add(-1.0_wp, q, f)
      if (self%structure%is_coupled) f = f - self%coupling%b &
         & *(dot_product(self%coupling%k, q) + dot_product(self%coupling%c, v))
   end subroutine linear_force

   recursive subroutine linear_mass(self, t, q, v, mass, ierr)
      class(linear_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      call self%m%add_to(1.0_wp, mass)
   end subroutine linear_mass

   recursive subroutine linear_tangent(self, t, q, v, a, k, c, ierr)
      class(linear_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      call self%k%add_to(1.0_wp, k)
      call self%c%add_to(1.0_wp, c)
   end subroutine linear_tangent

   !> v^T M v/2 + q^T K q/2, kinetic and strain energy
   recursive subroutine linear_energy(self, t, q, v, energy, ierr)
      class(linear_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      ierr = merge(0, -1, self%structure%has_energy)
      energy = 0.5_wp*(quadratic_form(self%m, v) + quadratic_form(self%k, q))
   end subroutine linear_energy

   !> x^T A x without workspace
   pure real(wp) function quadratic_form(a, x)
      type(matrix_type), intent(in) :: a
      real(wp), intent(in) :: x(a%n)
      integer :: i, j
      quadratic_form = 0.0_wp
      select case (a%kind)
      case (kind_banded, kind_dense)
         do j = 1, a%n
            do i = merge(max(1, j - a%ku), 1, a%kind == kind_banded), &
               & merge(min(a%n, j + a%kl), a%n, a%kind == kind_banded)
               quadratic_form = quadratic_form + x(i)*a%entry(i, j)*x(j)
            end do
         end do
      case default
         do i = 1, a%n
            quadratic_form = quadratic_form + a%entry(i, i)*x(i)**2
         end do
      end select
   end function quadratic_form
end module dynstep_linear_system
