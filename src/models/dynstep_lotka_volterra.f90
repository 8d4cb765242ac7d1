! SPDX-License-Identifier: BSD-3-Clause
!> Predator and prey, W. Xie (1995), eq. (3.17):
!>
!>   x1' = -a x1 + k b x1 x2         predators
!>   x2' =  c x2 - b x1 x2           prey
!>
!> Solutions with x1, x2 > 0 are periodic around (c/b, a/(k b)) on a level line of
!>
!>   H = b x1 - c ln x1 + k b x2 - a ln x2
!>
!> The thesis takes a = b = c = 1, k = 0.1, the defaults, and starts at (10, 10).
module dynstep_lotka_volterra
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_dense, matrix_type
   use dynstep_ode_system, only: ode_system
   implicit none
   private

   type, extends(ode_system), public :: lotka_volterra
      real(wp) :: a = 1.0_wp      !! rate at which predators die
      real(wp) :: b = 1.0_wp      !! prey eaten per predator and prey
      real(wp) :: c = 1.0_wp      !! rate at which prey is born
      real(wp) :: k = 0.1_wp      !! predators born per prey eaten
   contains
      procedure :: setup => lotka_volterra_setup
      procedure :: rhs => lotka_volterra_rhs
      procedure :: jacobian => lotka_volterra_jacobian
      procedure :: conserved => lotka_volterra_conserved
   end type lotka_volterra

contains

   !> Two unknowns and a dense Jacobian; the rates are components, to be set before or after
   pure subroutine lotka_volterra_setup(self)
      class(lotka_volterra), intent(inout) :: self
      self%n = 2
      self%jacobian_kind = kind_dense
   end subroutine lotka_volterra_setup

   !> Eq. (3.17)
   recursive subroutine lotka_volterra_rhs(self, t, y, f, ierr)
      class(lotka_volterra), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)           !! predators, prey [2]
      real(wp), intent(out) :: f(:)          !! [2]
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = -self%a*y(1) + self%k*self%b*y(1)*y(2)
      f(2) = self%c*y(2) - self%b*y(1)*y(2)
   end subroutine lotka_volterra_rhs

   recursive subroutine lotka_volterra_jacobian(self, t, y, jac, ierr)
      class(lotka_volterra), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(self%n)
      type(matrix_type), intent(inout) :: jac
      integer, intent(out) :: ierr
      ierr = 0
      call jac%set_entry(1, 1, -self%a + self%k*self%b*y(2))
      call jac%set_entry(1, 2, self%k*self%b*y(1))
      call jac%set_entry(2, 1, -self%b*y(2))
      call jac%set_entry(2, 2, self%c - self%b*y(1))
   end subroutine lotka_volterra_jacobian

   !> H, constant along a solution; for y > 0
   pure real(wp) function lotka_volterra_conserved(self, y)
      class(lotka_volterra), intent(in) :: self
      real(wp), intent(in) :: y(2)
      lotka_volterra_conserved = self%b*y(1) - self%c*log(y(1)) + self%k*self%b*y(2) - self%a*log(y(2))
   end function lotka_volterra_conserved
end module dynstep_lotka_volterra
