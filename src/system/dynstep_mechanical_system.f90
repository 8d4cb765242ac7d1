! SPDX-License-Identifier: BSD-3-Clause
!> The problem of mechanics: M(t,q,v) q'' = f(t,q,v), v = q'  (Austin 1991, eq. (1), with
!> F and P of the paper on the right-hand side: f = P - F).  With constraints, which it inherits
!> from CONSTRAINED_SYSTEM: M q'' = f + r,  g(t,q) = 0,  k(t,q,v) = 0  (Jay & Negrut 2008, eqs. (11)).
!>
!> PROGRAMMING INTERFACE
!>
!>   A user extends MECHANICAL_SYSTEM, sets N and STRUCTURE, and gives the deferred
!>   procedure FORCE.  Everything else has a default:
!>
!>     mass      identity
!>     tangent   -d(f - M a)/dq and -d(f - M a)/dv by differences (banded ones by groups)
!>     energy    none (set structure%has_energy where the system has one)
!>
!>   STRUCTURE tells what the library may rely on; nothing is guessed, and CHECK_SYSTEM
!>   compares what is declared with what the procedures do.  The state vector of a
!>   mechanical system is y = [q; v], and RHS is provided: y' = [v; M^-1 f].
module dynstep_mechanical_system
   use dynstep_constrained_system, only: constrained_system
   use dynstep_differences, only: collect, difference_groups, motion_sizes, perturb
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: long, wp
   use dynstep_matrix, only: kind_dense, kind_identity, kind_zero, matrix_type
   use dynstep_status, only: status_type
   implicit none
   private

   !> What the library may assume of a system; set once, before `init` of a stepper
   type, public :: structure_type
      integer :: mass = kind_identity            !! kind of M
      integer :: mass_kl = 0, mass_ku = 0        !! bandwidths of a banded M
      logical :: mass_is_constant = .true.       !! M depends on nothing: asked for once
      logical :: mass_is_symmetric = .true.
      integer :: tangent = kind_dense            !! kind of K and C
      integer :: kl = 0, ku = 0                  !! bandwidths of banded K and C
      logical :: tangent_is_symmetric = .false.  !! K and C are symmetric
      logical :: tangent_is_constant = .false.   !! K and C depend on nothing: asked for once
      logical :: force_is_linear = .false.       !! f is linear in q and v and M depends on t at
                                                 !! most: one Newton correction is exact
      logical :: velocity_free = .false.         !! f and M do not depend on v: no C
      logical :: has_energy = .false.            !! `energy` is given
      logical :: is_coupled = .false.            !! a linear_system has a coupling beside K and C
   end type structure_type

   type :: workspace_type
      type(structure_type) :: made_for
      type(matrix_type) :: m
      type(factorization_type) :: m_factor
      real(wp), allocatable :: vectors(:, :)     ! [n, 5]
   end type workspace_type

   type, abstract, extends(constrained_system), public :: mechanical_system
      type(structure_type) :: structure
      integer(long) :: difference_forces = 0     !! forces evaluated for difference tangents
      type(workspace_type), private :: dynstep_workspace   ! of rhs and of differences
   contains
      procedure(force_interface), deferred :: force
      procedure :: mass => identity_mass
      procedure :: tangent => difference_tangent
      procedure :: energy => no_energy
      procedure :: state_size => mechanical_state_size
      procedure :: rhs => mechanical_rhs
      procedure, non_overridable :: difference_tangent
   end type mechanical_system

   abstract interface
      !> f(t,q,v): all forces on the right-hand side
      recursive subroutine force_interface(self, t, q, v, f, ierr)
         import :: mechanical_system, wp
         class(mechanical_system), intent(inout) :: self
         real(wp), intent(in) :: t                            !! time
         real(wp), intent(in) :: q(self%n), v(self%n)         !! coordinates, velocities
         real(wp), intent(out) :: f(self%n)                   !! forces
         integer, intent(out) :: ierr                         !! 0, > 0 smaller step, < 0 give up
      end subroutine force_interface
   end interface

   public :: force_interface

contains

   pure integer function mechanical_state_size(self)
      class(mechanical_system), intent(in) :: self
      mechanical_state_size = 2*self%n
   end function mechanical_state_size

   !> M = identity.  An override fills `mass`, whose kind and bandwidths are those of
   !> `structure` and whose entries are zero on entry.
   recursive subroutine identity_mass(self, t, q, v, mass, ierr)
      class(mechanical_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass      !! M(t,q,v)
      integer, intent(out) :: ierr                  !! 0, > 0 smaller step, < 0 give up
      integer :: i
      ierr = 0
      do i = 1, self%n
         call mass%set_entry(i, i, 1.0_wp)
      end do
   end subroutine identity_mass

   !> Tangents of the residual f - M a at fixed a:  K = -d(f - M a)/dq, C = -d(f - M a)/dv.
   !> An override fills K and C, whose kind and bandwidths are those of `structure` and whose
   !> entries are zero on entry; C is of kind_zero where the system is velocity-free.
   recursive subroutine difference_tangent(self, t, q, v, a, k, c, ierr)
      class(mechanical_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)   !! coordinates, velocities
      real(wp), intent(in) :: a(self%n)              !! accelerations
      type(matrix_type), intent(inout) :: k, c       !! stiffness and damping
      integer, intent(out) :: ierr                   !! 0, > 0 smaller step, < 0 give up
      type(status_type) :: status

      call prepare_workspace(self, status)
      ierr = -1
      if (status%failed()) return
      associate (r0 => self%dynstep_workspace%vectors(:, 1), q_size => self%dynstep_workspace%vectors(:, 4), &
         & v_size => self%dynstep_workspace%vectors(:, 5))
         call residual(self, t, q, v, a, r0, ierr)
         if (ierr /= 0) return
         call motion_sizes(q, v, a, q_size, v_size)
         call difference_columns(self, .false., t, q, v, a, r0, q_size, k, ierr)
         if (ierr == 0 .and. c%kind /= kind_zero) call difference_columns(self, .true., t, q, v, a, r0, v_size, c, ierr)
      end associate
   end subroutine difference_tangent

   !> -dr/dq or -dr/dv; a group that leaves the domain of the force moves the other way
   recursive subroutine difference_columns(self, by_velocity, t, q, v, a, r0, sizes, jacobian, ierr)
      class(mechanical_system), intent(inout) :: self
      logical, intent(in) :: by_velocity
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(in) :: r0(self%n)               !! residual there
      real(wp), intent(inout) :: sizes(self%n)         !! of the components that are changed
      type(matrix_type), intent(inout) :: jacobian
      integer, intent(out) :: ierr
      integer :: group, attempt
      ierr = 0
      associate (r1 => self%dynstep_workspace%vectors(:, 2), moved => self%dynstep_workspace%vectors(:, 3))
         do group = 1, difference_groups(jacobian)
            do attempt = 1, 2
               if (by_velocity) then
                  call perturb(group, jacobian, v, sizes, moved)
                  call residual(self, t, q, moved, a, r1, ierr)
               else
                  call perturb(group, jacobian, q, sizes, moved)
                  call residual(self, t, moved, v, a, r1, ierr)
               end if
               if (ierr <= 0) exit
               sizes = -sizes
            end do
            if (ierr /= 0) return
            if (by_velocity) then
               call collect(group, v, moved, r0, r1, -1.0_wp, jacobian)
            else
               call collect(group, q, moved, r0, r1, -1.0_wp, jacobian)
            end if
         end do
      end associate
   end subroutine difference_columns

   !> r = f - M a, or r = f where M is constant (its differences vanish)
   recursive subroutine residual(self, t, q, v, a, r, ierr)
      class(mechanical_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr
      call self%force(t, q, v, r, ierr)
      self%difference_forces = self%difference_forces + 1
      if (ierr /= 0 .or. self%structure%mass_is_constant) return
      associate (m => self%dynstep_workspace%m)
         call m%set_zero()
         call self%mass(t, q, v, m, ierr)
         if (ierr == 0) call m%multiply_add(-1.0_wp, a, r)
      end associate
   end subroutine residual

   !> No work where the workspace fits n and the structure of M, which a user may have changed
   recursive subroutine prepare_workspace(self, status)
      class(mechanical_system), intent(inout) :: self
      type(status_type), intent(inout) :: status
      associate (w => self%dynstep_workspace, s => self%structure)
         if (allocated(w%vectors)) then
            if (size(w%vectors, 1) == self%n .and. same_mass(w%made_for, s)) return
            deallocate (w%vectors)
         end if
         w%made_for = s
         allocate (w%vectors(self%n, 5))
         call w%m%init(s%mass, self%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         call w%m_factor%init(s%mass, self%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
      end associate
   end subroutine prepare_workspace

   pure logical function same_mass(x, y)
      type(structure_type), intent(in) :: x, y
      same_mass = x%mass == y%mass .and. x%mass_kl == y%mass_kl .and. x%mass_ku == y%mass_ku .and. &
         & (x%mass_is_symmetric .eqv. y%mass_is_symmetric)
   end function same_mass

   !> Energy, conserved or not; a system that has one sets structure%has_energy
   recursive subroutine no_energy(self, t, q, v, energy, ierr)
      class(mechanical_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr                  !! 0, or /= 0 where it cannot be told
      ierr = -1
      energy = 0.0_wp
   end subroutine no_energy

   !> y' = [v; M^-1 f] of the state y = [q; v]  (Austin 1991, eq. (2)); a system with constraints is no
   !> such equation
   recursive subroutine mechanical_rhs(self, t, y, f, ierr)
      class(mechanical_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)          !! [2n]
      real(wp), intent(out) :: f(:)         !! [2n]
      integer, intent(out) :: ierr
      type(status_type) :: status
      ierr = -1
      f = 0.0_wp
      if (self%holonomic + self%nonholonomic > 0) return
      associate (n => self%n, w => self%dynstep_workspace)
         f(1:n) = y(n + 1:2*n)
         call self%force(t, y(1:n), y(n + 1:2*n), f(n + 1:2*n), ierr)
         if (ierr /= 0 .or. self%structure%mass == kind_identity) return
         call prepare_workspace(self, status)
         call w%m%set_zero()
         call self%mass(t, y(1:n), y(n + 1:2*n), w%m, ierr)
         if (ierr /= 0) return
         call w%m_factor%factorize(w%m, status, t)
         ierr = merge(-1, 0, status%failed())
         if (ierr == 0) call w%m_factor%solve(f(n + 1:2*n))
      end associate
   end subroutine mechanical_rhs
end module dynstep_mechanical_system
