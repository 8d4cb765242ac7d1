! SPDX-License-Identifier: BSD-3-Clause
!> The next step length from an error estimate (Xie 1995, section 3.4).
!>
!>   (3.15)   h' = 0.8 h (tau/err)^k                                     standard,  k = 1/(q + 1)
!>   (3.16)   h' = 0.8 h (tau/err)^(0.3 k) (err_before/err)^(0.4 k)      PI
!>
!> with tau = tol max(|y|, 1) and an estimate of order q + 1 in h; k is 1/5 in the thesis.  Its listings have the 0.8 of
!> (3.16) inside the power, h (0.8 tau/err)^(0.3 k), a factor of 0.987, and call the two equations (3.14) and (3.15).
!>
!> The standard one is the default.  On the marginal problem of the thesis at tol = 1e-6 and alpha = 0.1 it takes 92
!> steps without a rejection, PI by the listing 81 and 27 rejections, PI by the text 152; PI saves accepted steps, not
!> work, and its errors are about twice as large.
module dynstep_step_control
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   integer, parameter, public :: controller_standard = 1       !! (3.15)
   integer, parameter, public :: controller_pi = 2             !! (3.16)
   integer, parameter, public :: safety_in_front = 1           !! 0.8 h (...)^..., as the text has it
   integer, parameter, public :: safety_inside = 2             !! h (0.8 ...)^..., as the listing of (3.16) has it

   real(wp), parameter :: safety = 0.8_wp
   !> Shares of the exponent in (3.16)
   real(wp), parameter :: integral_share = 0.3_wp, proportional_share = 0.4_wp

   type, public :: step_control_type
      real(wp) :: tolerance = 1.0e-6_wp                !! tol > 0: error of a step beside max(|y|, 1)
      integer :: controller = controller_standard
      integer :: safety_place = safety_in_front        !! read for controller_pi
      real(wp) :: h_first = 0.0_wp                     !! length of the first step; 0: (t_end - t)/128
      real(wp) :: h_max = 0.0_wp                       !! longest step > 0; 0: |t_end - t|/16
      real(wp) :: h_min = 0.0_wp                       !! shortest step; 0: rounding of t
      real(wp), allocatable :: t_eval(:)               !! times to record, in the order of the run; else every step
   contains
      procedure :: check => control_check
      procedure :: next => control_next
   end type step_control_type

contains

   !> Ranges
   pure subroutine control_check(self, status)
      class(step_control_type), intent(in) :: self
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (.not. is_positive(self%tolerance)) then
         call status%set(dynstep_invalid_input, 'tolerance = '//text(self%tolerance)//' must be positive')
      else if (self%controller /= controller_standard .and. self%controller /= controller_pi) then
         call status%set(dynstep_invalid_input, 'controller = '//text(self%controller)//' is neither standard (1) nor PI (2)')
      else if (self%safety_place /= safety_in_front .and. self%safety_place /= safety_inside) then
         call status%set(dynstep_invalid_input, 'safety_place = '//text(self%safety_place) &
            & //' is neither in front (1) nor inside (2)')
      else if (.not. ieee_is_finite(self%h_first)) then
         call status%set(dynstep_invalid_input, 'h_first = '//text(self%h_first)//' is not finite')
      else if (.not. is_zero_or_positive(self%h_max)) then
         call status%set(dynstep_invalid_input, 'h_max = '//text(self%h_max)//' must be positive, or 0 for |t_end - t|/16')
      else if (.not. is_zero_or_positive(self%h_min)) then
         call status%set(dynstep_invalid_input, 'h_min = '//text(self%h_min)//' must be 0 or more')
      end if
   end subroutine control_check

   !> No comparison with a NaN, which may trap
   pure logical function is_positive(x)
      real(wp), intent(in) :: x
      is_positive = ieee_is_finite(x)
      if (is_positive) is_positive = x > 0.0_wp
   end function is_positive

   pure logical function is_zero_or_positive(x)
      real(wp), intent(in) :: x
      is_zero_or_positive = ieee_is_finite(x)
      if (is_zero_or_positive) is_zero_or_positive = x >= 0.0_wp
   end function is_zero_or_positive

   !> Length of the next step, accepted or not, before its limits
   pure real(wp) function control_next(self, h, tau, error, error_before, exponent)
      class(step_control_type), intent(in) :: self
      real(wp), intent(in) :: h                        !! of the step that was tried
      real(wp), intent(in) :: tau                      !! what its error may be
      real(wp), intent(in) :: error                    !! estimate >= 0
      real(wp), intent(in) :: error_before             !! of the trial before; < 0: there was none
      real(wp), intent(in) :: exponent                 !! k
      real(wp) :: ratio
      ! far below the tolerance is none at all, and the quotient might overflow
      if (.not. error > 1.0e-30_wp*tau) then
         control_next = sign(huge(1.0_wp), h)
         return
      end if
      ratio = tau/error
      if (self%controller == controller_standard .or. .not. error_before >= 0.0_wp) then
         control_next = safety*h*ratio**exponent
      else if (self%safety_place == safety_in_front) then
         control_next = safety*h*ratio**(integral_share*exponent)*(error_before/error)**(proportional_share*exponent)
      else
         control_next = h*(safety*ratio)**(integral_share*exponent)*(error_before/error)**(proportional_share*exponent)
      end if
   end function control_next
end module dynstep_step_control
