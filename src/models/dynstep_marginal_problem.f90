! SPDX-License-Identifier: BSD-3-Clause
!> The marginally stable problem of W. Xie (1995), section 3.4, Figs. 3.23-3.27; its equations are the function
!> fun1 of the C program (Appendix B), y' = A y + b:
!>
!>   x1' = 4 x3 - 4,  x3' = -x1            poles +-2i around (0, 1)
!>   x2' = -4 x4,     x4' = x2/4           poles +-i
!>
!> From the program's start (0, 1, 2, 0):
!>
!>   x1 = 2 sin 2t,  x2 = cos t,  x3 = 1 + cos 2t,  x4 = (sin t)/4
!>
!> The program compares x1 and x2 alone with these.
module dynstep_marginal_problem
   use dynstep_kinds, only: wp
   use dynstep_linear_ode, only: linear_ode
   use dynstep_linear_system, only: load_procedure
   use dynstep_matrix, only: dense_matrix
   use dynstep_status, only: status_type
   implicit none
   private

   type, extends(linear_ode), public :: marginal_problem
   contains
      procedure :: setup => marginal_setup
      procedure :: source => marginal_source
      procedure, nopass :: start => marginal_start
      procedure, nopass :: exact => marginal_exact
   end type marginal_problem

contains

   !> The matrix A of fun1
   subroutine marginal_setup(self, status)
      class(marginal_problem), intent(inout) :: self
      type(status_type), intent(inout) :: status
      real(wp) :: a(4, 4)
      a = 0.0_wp
      a(1, 3) = 4.0_wp
      a(2, 4) = -4.0_wp
      a(3, 1) = -1.0_wp
      a(4, 2) = 0.25_wp
      call self%set(dense_matrix(a), status)
      self%source_kind = load_procedure
   end subroutine marginal_setup

   !> The constant b = (-4, 0, 0, 0)
   recursive subroutine marginal_source(self, t, b, ierr)
      class(marginal_problem), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: b(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      b = [-4.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
   end subroutine marginal_source

   !> The start of the program
   pure subroutine marginal_start(y)
      real(wp), intent(out) :: y(4)
      y = [0.0_wp, 1.0_wp, 2.0_wp, 0.0_wp]
   end subroutine marginal_start

   !> The solution at time t from y0 at time 0
   pure subroutine marginal_exact(t, y0, y)
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y0(4)
      real(wp), intent(out) :: y(4)
      real(wp) :: c1, s1, c2, s2
      c1 = cos(t)
      s1 = sin(t)
      c2 = cos(2.0_wp*t)
      s2 = sin(2.0_wp*t)
      y(1) = y0(1)*c2 + 2.0_wp*(y0(3) - 1.0_wp)*s2
      y(2) = y0(2)*c1 - 4.0_wp*y0(4)*s1
      y(3) = 1.0_wp + (y0(3) - 1.0_wp)*c2 - 0.5_wp*y0(1)*s2
      y(4) = y0(4)*c1 + 0.25_wp*y0(2)*s1
   end subroutine marginal_exact
end module dynstep_marginal_problem
