! SPDX-License-Identifier: BSD-3-Clause
!> Constraints of a mechanical system and the reactions that hold them (Jay & Negrut 2008, eqs. (11)):
!>
!>   g(t,q) = 0      holonomic, m of them, with G = dg/dq and multipliers lambda
!>   k(t,q,v) = 0    on velocities (nonholonomic), p of them, with K = dk/dv and multipliers psi
!>   r = -G^T lambda - K^T psi, or a user's r(t,q,v,lambda,psi), nonlinear in the multipliers
!>
!> PROGRAMMING INTERFACE
!>
!>   A system with constraints sets HOLONOMIC or NONHOLONOMIC, and overrides CONSTRAINT or VELOCITY_CONSTRAINT.  The
!>   rest has a default:
!>
!>     constraint_jacobian    G and dg/dt by differences (errors near 1e-12)
!>     constraint_curvature   g'' - G q'' by differences along the motion
!>     velocity_jacobian      K by differences
!>     velocity_curvature     k' - K q'' by differences along the motion
!>     reaction               -G^T lambda - K^T psi
!>     reaction_jacobian      dr/dlambda, dr/dpsi by differences
!>     reaction_tangent       -dr/dq, -dr/dv are left out of the iteration matrix
!>
!>   CONSTRAINTS tells what the library may rely on.  A system with m = p = 0 pays for none of this.
module dynstep_constrained_system
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: matrix_type
   use dynstep_ode_system, only: ode_system
   implicit none
   private

   !> What the library may assume of the constraints; set once, before `init` of a stepper
   type, public :: constraint_structure_type
      type(pattern_type) :: g                     !! places of G that may differ from zero; dense if none
      type(pattern_type) :: k                     !! places of K
      logical :: reaction_is_general = .false.    !! REACTION is overridden
      logical :: has_reaction_tangent = .false.   !! REACTION_TANGENT is overridden
      !> Order of the unknowns in the band of the equations, body by body: a permutation of 1 .. n
      !> (coordinates), n + 1 .. n + m (lambda), n + m + 1 .. n + m + p (psi).  Not allocated: the library
      !> looks for one where G, K, M and the tangents have patterns or bands.
      integer, allocatable :: order(:)
   end type constraint_structure_type

   type, abstract, extends(ode_system), public :: constrained_system
      integer :: holonomic = 0                           !! m, number of constraints g
      integer :: nonholonomic = 0                        !! p, number of constraints k
      type(constraint_structure_type) :: constraints
   contains
      procedure :: constraint => no_constraint
      procedure :: constraint_jacobian => difference_constraint_jacobian
      procedure :: constraint_curvature => difference_constraint_curvature
      procedure :: velocity_constraint => no_velocity_constraint
      procedure :: velocity_jacobian => difference_velocity_jacobian
      procedure :: velocity_curvature => difference_velocity_curvature
      procedure :: reaction => lagrange_reaction
      procedure :: reaction_jacobian => difference_reaction_jacobian
      procedure :: reaction_tangent => no_reaction_tangent
      procedure, non_overridable :: difference_constraint_jacobian
      procedure, non_overridable :: difference_constraint_curvature
      procedure, non_overridable :: difference_velocity_jacobian
      procedure, non_overridable :: difference_velocity_curvature
      procedure, non_overridable :: difference_reaction_jacobian
   end type constrained_system

   !> eps^(1/5) balances the truncation error of the four-point difference, d^4/30 of the fifth
   !> derivative, against its rounding error 1.5 eps/d
   real(wp), parameter :: four_point_step = 2.0_wp**(-10)

contains

   !> g(t,q) = 0: an override fills g
   recursive subroutine no_constraint(self, t, q, g, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      ierr = merge(0, -1, self%holonomic == 0)
      g = 0.0_wp
   end subroutine no_constraint

   !> G = dg/dq and dg/dt.  An override fills both, which are zero on entry.
   recursive subroutine difference_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq        !! G [m, n], in the pattern constraints%g
      real(wp), intent(inout) :: gt(self%holonomic)           !! dg/dt
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      real(wp) :: x(self%n), column(self%holonomic), d
      integer :: i, j

      ierr = 0
      do j = 1, self%n
         d = four_point_step*difference_size(q, j)
         x = q
         call four_points(column)
         if (ierr /= 0) return
         do i = 1, self%holonomic
            call gq%set_entry(i, j, column(i))
         end do
      end do
      x = q
      d = four_point_step
      j = 0
      call four_points(gt)

   contains

      !> Derivative by coordinate j, or by time where j = 0
      recursive subroutine four_points(derivative)
         real(wp), intent(out) :: derivative(self%holonomic)
         real(wp), parameter :: at(4) = [-2.0_wp, -1.0_wp, 1.0_wp, 2.0_wp]
         real(wp), parameter :: weight(4) = [1.0_wp, -8.0_wp, 8.0_wp, -1.0_wp]/12.0_wp
         real(wp) :: g(self%holonomic)
         integer :: i
         derivative = 0.0_wp
         do i = 1, 4
            if (j > 0) x(j) = q(j) + at(i)*d
            call self%constraint(t + merge(at(i)*d, 0.0_wp, j == 0), x, g, ierr)
            if (ierr /= 0) return
            derivative = derivative + (weight(i)/d)*g
         end do
      end subroutine four_points
   end subroutine difference_constraint_jacobian

   pure real(wp) function difference_size(x, j)
      real(wp), intent(in) :: x(:)
      integer, intent(in) :: j
      difference_size = maxval(abs(x))
      if (.not. difference_size > 0.0_wp) difference_size = 1.0_wp
      difference_size = max(abs(x(j)), min(1.0_wp, difference_size))
   end function difference_size

   !> c = g_tt + 2 g_tq v + g_qq(v, v), so that g'' = G q'' + c.  An override fills c.
   recursive subroutine difference_constraint_curvature(self, t, q, v, c, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      c = 0.0_wp
      ierr = -1
   end subroutine difference_constraint_curvature

   !> k(t,q,v) = 0: an override fills k
   recursive subroutine no_velocity_constraint(self, t, q, v, k, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      ierr = merge(0, -1, self%nonholonomic == 0)
      k = 0.0_wp
   end subroutine no_velocity_constraint

   !> K = dk/dv.  An override fills it; it is zero on entry.
   recursive subroutine difference_velocity_jacobian(self, t, q, v, kv, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv        !! K [p, n], in the pattern constraints%k
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      ierr = -1
   end subroutine difference_velocity_jacobian

   !> c = k_t + k_q v, so that k' = K q'' + c.  An override fills c.
   recursive subroutine difference_velocity_curvature(self, t, q, v, c, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%nonholonomic)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      c = 0.0_wp
      ierr = -1
   end subroutine difference_velocity_curvature

   !> r = -G^T lambda - K^T psi.  An override goes with constraints%reaction_is_general; the library
   !> does not call this procedure without it.
   recursive subroutine lagrange_reaction(self, t, q, v, lambda, psi, r, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      r = 0.0_wp
      ierr = -1
   end subroutine lagrange_reaction

   !> dr/dlambda and dr/dpsi.  An override fills both, which are zero on entry.
   recursive subroutine difference_reaction_jacobian(self, t, q, v, lambda, psi, rl, rp, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(inout) :: rl(self%n, self%holonomic)   !! dr/dlambda
      real(wp), intent(inout) :: rp(self%n, self%nonholonomic)   !! dr/dpsi
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      ierr = -1
   end subroutine difference_reaction_jacobian

   !> Tangents of the reactions, -dr/dq and -dr/dv (geometric stiffness), in the storage of
   !> structure%tangent, to be added to K and C.  Only the speed of Newton's iteration depends on
   !> them.  An override goes with constraints%has_reaction_tangent.
   recursive subroutine no_reaction_tangent(self, t, q, v, lambda, psi, k, c, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      type(matrix_type), intent(inout) :: k           !! -dr/dq is added
      type(matrix_type), intent(inout) :: c           !! -dr/dv is added; of kind_zero without velocities
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      ierr = 0
   end subroutine no_reaction_tangent
end module dynstep_constrained_system
