! SPDX-License-Identifier: BSD-3-Clause
!> The size of an error beside what is tolerated: 1 or less is good.
!>
!>   norm_weighted   sqrt(mean of (e(i)/(atol(i) + rtol max(|y0(i)|, |y1(i)|)))^2), over all components of the state
!>                   (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, eq. (II.4.11))
!>   norm_largest    max |e(i)|/(tolerance max(|y1|, 1)), |y1| the largest component (Xie 1995, section 3.4)
!>
!> Multipliers are not part of it unless they have a tolerance of their own.
module dynstep_error_norm
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   integer, parameter, public :: norm_weighted = 1
   integer, parameter, public :: norm_largest = 2

   type, public :: error_norm_type
      integer :: kind = norm_weighted
      real(wp) :: rtol = 1.0e-6_wp              !! relative tolerance >= 0 (norm_weighted)
      real(wp), allocatable :: atol(:)          !! absolute ones [state_size] or [1], >= 0, beside rtol (norm_weighted)
      real(wp) :: tolerance = 1.0e-6_wp         !! > 0 (norm_largest)
      real(wp) :: atol_lambda = 0.0_wp          !! of the multipliers of g beside rtol; 0: they are not looked at
      real(wp) :: atol_psi = 0.0_wp             !! of the multipliers of k
   contains
      procedure :: check => norm_check
      procedure :: measure => norm_measure
      procedure :: rounding => norm_rounding
   end type error_norm_type

contains

   !> Ranges, and the length of atol
   pure subroutine norm_check(self, state_size, status)
      class(error_norm_type), intent(in) :: self
      integer, intent(in) :: state_size
      type(status_type), intent(inout) :: status
      integer :: i
      if (status%failed()) return
      if (self%kind == norm_largest) then
         if (.not. is_at_least_zero(self%tolerance) .or. .not. abs(self%tolerance) > 0.0_wp) &
            & call status%set(dynstep_invalid_input, 'tolerance = '//text(self%tolerance)//' must be positive')
         return
      else if (self%kind /= norm_weighted) then
         call status%set(dynstep_invalid_input, 'kind = '//text(self%kind)//' of the norm is neither weighted (1) nor ' &
            & //'largest (2)')
      else if (.not. is_at_least_zero(self%rtol)) then
         call status%set(dynstep_invalid_input, 'rtol = '//text(self%rtol)//' must be 0 or more')
      else if (.not. allocated(self%atol)) then
         call status%set(dynstep_invalid_input, 'atol is not set: give one value, or one for each component of the state')
      else if (size(self%atol) /= 1 .and. size(self%atol) /= state_size) then
         call status%set(dynstep_invalid_input, 'atol has '//text(size(self%atol))//' values; give one, or ' &
            & //text(state_size)//', one for each component of the state')
      else if (.not. is_at_least_zero(self%atol_lambda)) then
         call status%set(dynstep_invalid_input, 'atol_lambda = '//text(self%atol_lambda)//' must be 0 or more')
      else if (.not. is_at_least_zero(self%atol_psi)) then
         call status%set(dynstep_invalid_input, 'atol_psi = '//text(self%atol_psi)//' must be 0 or more')
      end if
      if (status%failed()) return
      do i = 1, size(self%atol)
         if (.not. is_at_least_zero(self%atol(i))) then
            call status%set(dynstep_invalid_input, 'atol('//text(i)//') = '//text(self%atol(i))//' must be 0 or more')
         else if (.not. self%atol(i) + self%rtol > 0.0_wp) then
            call status%set(dynstep_invalid_input, 'rtol = 0 and atol('//text(i)//') = 0: one of them must be positive')
         end if
         if (status%failed()) return
      end do
   end subroutine norm_check

   !> No comparison with a NaN, which may trap
   pure logical function is_at_least_zero(x)
      real(wp), intent(in) :: x
      is_at_least_zero = ieee_is_finite(x)
      if (is_at_least_zero) is_at_least_zero = x >= 0.0_wp
   end function is_at_least_zero

   !> Size of an error, which is finite, of a step from y0 to y1
   pure real(wp) function norm_measure(self, error, y0, y1)
      class(error_norm_type), intent(in) :: self
      real(wp), intent(in) :: error(:), y0(:), y1(:)         !! [state_size] all
      real(wp) :: scale
      integer :: i
      norm_measure = 0.0_wp
      if (self%kind == norm_largest) then
         norm_measure = maxval(abs(error))/(self%tolerance*max(maxval(abs(y1)), 1.0_wp))
         return
      end if
      do i = 1, size(error)
         scale = self%atol(min(i, size(self%atol))) + self%rtol*max(abs(y0(i)), abs(y1(i)))
         norm_measure = norm_measure + (error(i)/max(scale, tiny(scale)))**2
      end do
      norm_measure = sqrt(norm_measure/real(size(error), wp))
   end function norm_measure

   !> Size of the rounding errors of a state, half a unit in each component: no step can have an error much below it
   pure real(wp) function norm_rounding(self, y)
      class(error_norm_type), intent(in) :: self
      real(wp), intent(in) :: y(:)                           !! [state_size]
      real(wp) :: scale
      integer :: i
      norm_rounding = 0.0_wp
      if (self%kind == norm_largest) then
         scale = maxval(abs(y))
         norm_rounding = 0.5_wp*epsilon(1.0_wp)*scale/(self%tolerance*max(scale, 1.0_wp))
         return
      end if
      do i = 1, size(y)
         scale = self%atol(min(i, size(self%atol))) + self%rtol*abs(y(i))
         norm_rounding = norm_rounding + (y(i)/max(scale, tiny(scale)))**2
      end do
      norm_rounding = 0.5_wp*epsilon(1.0_wp)*sqrt(norm_rounding/real(size(y), wp))
   end function norm_rounding
end module dynstep_error_norm
