! SPDX-License-Identifier: BSD-3-Clause
!> Constraints and reactions of a system at one point (t, q, v), with what the equations need of them
!> (Jay & Negrut 2008, eqs. (11)): g, G, dg/dt, g' = G v + dg/dt, k, K, and reactions.
!>
!>     call motion%init(sys, status)
!>     call motion%evaluate(sys, t, q, v, count, status)      g, gq, gt, gv, k, kv
!>     call motion%add_reaction(sys, t, q, v, factor, lambda, psi, f, status)   there
!>
!> Without constraints these do nothing.
module dynstep_constrained_motion
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: check_callback, check_finite
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_no_memory, dynstep_not_finite, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   type, public :: constrained_motion
      integer :: n = 0, m = 0, p = 0              !! coordinates, constraints g, constraints k
      type(jacobian_type) :: gq, kv               !! G [m, n], K [p, n]
      real(wp), allocatable :: g(:), gt(:)        !! g, dg/dt [m]
      real(wp), allocatable :: gv(:)              !! g' = G v + dg/dt [m]
      real(wp), allocatable :: k(:)               !! k [p]
      real(wp), allocatable :: rl(:, :), rp(:, :) !! dr/dlambda [n, m], dr/dpsi [n, p] of a general reaction
      real(wp), allocatable, private :: r(:)      ! [n] of a general reaction
   contains
      procedure :: init => motion_init
      procedure :: evaluate => motion_evaluate
      procedure :: evaluate_holonomic => motion_evaluate_holonomic
      procedure :: evaluate_nonholonomic => motion_evaluate_nonholonomic
      procedure :: velocity_residual => motion_velocity_residual
      procedure :: add_reaction => motion_add_reaction
      procedure :: differentiate_reaction => motion_differentiate_reaction
      procedure :: curvatures => motion_curvatures
   end type constrained_motion

contains

   recursive subroutine motion_init(self, sys, status)
      class(constrained_motion), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      self%n = sys%n
      self%m = sys%holonomic
      self%p = sys%nonholonomic
      call self%gq%init(self%m, self%n, sys%constraints%g, status)
      call self%kv%init(self%p, self%n, sys%constraints%k, status)
      if (allocated(self%g)) deallocate (self%g, self%gt, self%gv, self%k, self%rl, self%rp, self%r)
      stat = 0
      associate (ng => merge(self%n, 0, sys%constraints%reaction_is_general))
         allocate (self%g(self%m), self%gt(self%m), self%gv(self%m), self%k(self%p), self%rl(ng, self%m), &
            & self%rp(ng, self%p), self%r(ng), source=0.0_wp, stat=stat)
      end associate
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the constraints of '//text(self%n)//' coordinates')
   end subroutine motion_init

   !> Everything at (t, q, v)
   recursive subroutine motion_evaluate(self, sys, t, q, v, count, status)
      class(constrained_motion), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      call self%evaluate_holonomic(sys, t, q, count, status)
      if (status%failed()) return
      call self%velocity_residual(v)
      call self%evaluate_nonholonomic(sys, t, q, v, count, status)
   end subroutine motion_evaluate

   !> g, G and dg/dt
   recursive subroutine motion_evaluate_holonomic(self, sys, t, q, count, status)
      class(constrained_motion), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr
      if (status%failed() .or. self%m == 0) return
      count%constraints = count%constraints + 1
      call sys%constraint(t, q, self%g, ierr)
      call check_callback('constraint', ierr, t, status)
      if (.not. status%failed()) call check_finite('constraint', self%g, t, status)
      if (status%failed()) return
      call self%gq%set_zero()
      self%gt = 0.0_wp
      call sys%constraint_jacobian(t, q, self%gq, self%gt, ierr)
      call check_callback('constraint_jacobian', ierr, t, status)
      call check_jacobian('constraint_jacobian', self%gq, t, status)
      if (.not. status%failed()) call check_finite('constraint_jacobian, in dg/dt,', self%gt, t, status)
   end subroutine motion_evaluate_holonomic

   !> g' = G v + dg/dt
   pure subroutine motion_velocity_residual(self, v)
      class(constrained_motion), intent(inout) :: self
      real(wp), intent(in) :: v(self%n)
      if (self%m == 0) return
      call self%gq%multiply(v, self%gv)
      self%gv = self%gv + self%gt
   end subroutine motion_velocity_residual

   !> k and K
   recursive subroutine motion_evaluate_nonholonomic(self, sys, t, q, v, count, status)
      class(constrained_motion), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr
      if (status%failed() .or. self%p == 0) return
      count%constraints = count%constraints + 1
      call sys%velocity_constraint(t, q, v, self%k, ierr)
      call check_callback('velocity_constraint', ierr, t, status)
      if (.not. status%failed()) call check_finite('velocity_constraint', self%k, t, status)
      if (status%failed()) return
      call self%kv%set_zero()
      call sys%velocity_jacobian(t, q, v, self%kv, ierr)
      call check_callback('velocity_jacobian', ierr, t, status)
      call check_jacobian('velocity_jacobian', self%kv, t, status)
   end subroutine motion_evaluate_nonholonomic

   !> f = f + factor r(lambda, psi) at the point of the last evaluation
   recursive subroutine motion_add_reaction(self, sys, t, q, v, factor, lambda, psi, f, status)
      class(constrained_motion), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: lambda(self%m), psi(self%p)
      real(wp), intent(inout) :: f(sys%n)
      type(status_type), intent(inout) :: status
      integer :: ierr
      if (status%failed() .or. self%m + self%p == 0) return
      if (.not. sys%constraints%reaction_is_general) then
         if (self%m > 0) call self%gq%transposed_add(-factor, lambda, f)
         if (self%p > 0) call self%kv%transposed_add(-factor, psi, f)
         return
      end if
      call sys%reaction(t, q, v, lambda, psi, self%r, ierr)
      call check_callback('reaction', ierr, t, status)
      if (.not. status%failed()) call check_finite('reaction', self%r, t, status)
      f = f + factor*self%r
   end subroutine motion_add_reaction

   !> dr/dlambda and dr/dpsi of a general reaction
   recursive subroutine motion_differentiate_reaction(self, sys, t, q, v, lambda, psi, status)
      class(constrained_motion), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(in) :: lambda(self%m), psi(self%p)
      type(status_type), intent(inout) :: status
      integer :: ierr
      if (status%failed() .or. .not. sys%constraints%reaction_is_general) return
      self%rl = 0.0_wp
      self%rp = 0.0_wp
      call sys%reaction_jacobian(t, q, v, lambda, psi, self%rl, self%rp, ierr)
      call check_callback('reaction_jacobian', ierr, t, status)
      if (status%failed()) return
      if (.not. (all(ieee_is_finite(self%rl)) .and. all(ieee_is_finite(self%rp)))) call status%set(dynstep_not_finite, &
         & 'reaction_jacobian returned a number that is not finite at t = '//text(t)//'; a smaller step may keep it in its ' &
         & //'domain', retry=.true.)
   end subroutine motion_differentiate_reaction

   !> g'' - G q'' and k' - K q'' (the hidden constraints of the consistent start, section 6)
   recursive subroutine motion_curvatures(self, sys, t, q, v, cg, ck, status)
      class(constrained_motion), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(out) :: cg(self%m), ck(self%p)
      type(status_type), intent(inout) :: status
      integer :: ierr
      cg = 0.0_wp
      ck = 0.0_wp
      if (status%failed()) return
      if (self%m > 0) then
         call sys%constraint_curvature(t, q, v, cg, ierr)
         call check_callback('constraint_curvature', ierr, t, status)
         if (.not. status%failed()) call check_finite('constraint_curvature', cg, t, status)
      end if
      if (status%failed() .or. self%p == 0) return
      call sys%velocity_curvature(t, q, v, ck, ierr)
      call check_callback('velocity_curvature', ierr, t, status)
      if (.not. status%failed()) call check_finite('velocity_curvature', ck, t, status)
   end subroutine motion_curvatures

   !> A status where a Jacobian has an entry that is NaN or infinite
   pure subroutine check_jacobian(name, jacobian, t, status)
      character(len=*), intent(in) :: name
      type(jacobian_type), intent(in) :: jacobian
      real(wp), intent(in) :: t
      type(status_type), intent(inout) :: status
      integer :: i, e
      if (status%failed()) return
      do e = 1, size(jacobian%value)
         if (.not. ieee_is_finite(jacobian%value(e))) exit
      end do
      if (e > size(jacobian%value)) return
      i = count(jacobian%first <= e)
      call status%set(dynstep_not_finite, name//' returned '//text(jacobian%value(e))//' in row '//text(i)//', column ' &
         & //text(jacobian%column(e))//' at t = '//text(t)//'; a smaller step may keep it in its domain', retry=.true.)
   end subroutine check_jacobian
end module dynstep_constrained_motion
