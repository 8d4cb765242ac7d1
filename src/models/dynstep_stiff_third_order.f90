! SPDX-License-Identifier: BSD-3-Clause
!> The stiff problem of W. Xie (1995), section 3.4, Figs. 3.28-3.32: poles -100 and -1 +- i/2,
!>
!>   (s + 100) [(s + 1)^2 + 1/4] = s^3 + 102 s^2 + 201.25 s + 125
!>   y''' + 102 y'' + 201.25 y' + 125 y = 0        state (y, y', y'')
!>
!> The solution splits along the poles, with w = y'' + 2y' + 1.25y = w0 e^-100t:
!>
!>   y = c0 e^-100t + e^-t [c1 cos(t/2) + c2 sin(t/2)]
!>   c0 = w0/9801.25,  c1 = y0 - c0,  c2 = 2 (y0' + 100 c0 + c1)
!>
!> The thesis does not give its initial values; (1, 0, 0) is the natural choice.
module dynstep_stiff_third_order
   use dynstep_kinds, only: wp
   use dynstep_linear_ode, only: linear_ode
   use dynstep_matrix, only: dense_matrix
   use dynstep_status, only: status_type
   implicit none
   private

   type, extends(linear_ode), public :: stiff_third_order
   contains
      procedure :: setup => stiff_setup
      procedure, nopass :: exact => stiff_exact
   end type stiff_third_order

contains

   !> The companion matrix
   subroutine stiff_setup(self, status)
      class(stiff_third_order), intent(inout) :: self
      type(status_type), intent(inout) :: status
      real(wp) :: a(3, 3)
      a = 0.0_wp
      a(1, 2) = 1.0_wp
      a(2, 3) = 1.0_wp
      a(3, :) = [-125.0_wp, -201.25_wp, -102.0_wp]
      call self%set(dense_matrix(a), status)
   end subroutine stiff_setup

   !> (y, y', y'') at time t from y0 at time 0
   pure subroutine stiff_exact(t, y0, y)
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y0(3)
      real(wp), intent(out) :: y(3)
      real(wp) :: c0, c1, c2, d1, d2, fast, cosine, sine
      integer :: i
      c0 = (y0(3) + 2.0_wp*y0(2) + 1.25_wp*y0(1))/9801.25_wp
      c1 = y0(1) - c0
      c2 = 2.0_wp*(y0(2) + 100.0_wp*c0 + c1)
      fast = exp(-100.0_wp*t)
      cosine = exp(-t)*cos(0.5_wp*t)
      sine = exp(-t)*sin(0.5_wp*t)
      do i = 1, 3
         y(i) = c0*fast + c1*cosine + c2*sine
         c0 = -100.0_wp*c0
         d1 = -c1 + 0.5_wp*c2
         d2 = -c2 - 0.5_wp*c1
         c1 = d1
         c2 = d2
      end do
   end subroutine stiff_exact
end module dynstep_stiff_third_order
