! SPDX-License-Identifier: BSD-3-Clause
!> What a run that chooses its steps is asked to do, and the length of the next step.
!>
!> Tolerances rtol and atol: the weighted norm of dynstep_error_norm, and a PI controller
!>
!>   h' = 0.9 h err^(-0.6 k) (err_before/err)^(0.4 k),   k = 1/(q + 1)               (controller_weighted)
!>
!> for an estimate of order q + 1 in h (K. Gustafsson, ACM TOMS 17 (1991) 533; the exponents for q = 2, 0.2 and 0.133, are
!> those of Jay & Negrut's method in docs/theory/generalized-alpha.md).  After a rejection h' = 0.9 h err^(-k), and the step
!> behind it does not grow.
!>
!> `tolerance` alone: the control of Xie 1995, section 3.4, with tau = tolerance max(|y|, 1)
!>
!>   (3.15)   h' = 0.8 h (tau/err)^k                                     controller_standard
!>   (3.16)   h' = 0.8 h (tau/err)^(0.3 k) (err_before/err)^(0.4 k)      controller_pi
!>
!> where k is 1/5 in the thesis.  Its listings have the 0.8 of (3.16) inside the power, h (0.8 tau/err)^(0.3 k), a factor of
!> 0.987, and call the two equations (3.14) and (3.15).  On the marginal problem of the thesis at tol = 1e-6 and alpha = 0.1
!> (3.15) takes 92 steps without a rejection, (3.16) by the listing 81 and 27 rejections, by the text 152; PI saves accepted
!> steps, not work, and its errors are about twice as large.
module dynstep_step_control
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type, norm_largest, norm_weighted
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   integer, parameter, public :: controller_automatic = 0      !! weighted with rtol and atol, standard with tolerance
   integer, parameter, public :: controller_standard = 1       !! (3.15)
   integer, parameter, public :: controller_pi = 2             !! (3.16)
   integer, parameter, public :: controller_weighted = 3       !! with limits, as above
   integer, parameter, public :: safety_in_front = 1           !! 0.8 h (...)^..., as the text has it
   integer, parameter, public :: safety_inside = 2             !! h (0.8 ...)^..., as the listing of (3.16) has it

   !> Xie's safety factor, and shares of the exponent in (3.16)
   real(wp), parameter :: safety = 0.8_wp
   real(wp), parameter :: integral_share = 0.3_wp, proportional_share = 0.4_wp

   !> controller_weighted: safety factor, shares of the exponent, limits of the change of one step
   real(wp), parameter :: weighted_safety = 0.9_wp, weighted_integral = 0.6_wp, weighted_proportional = 0.4_wp
   real(wp), parameter :: least_factor = 0.2_wp, largest_factor = 5.0_wp

   !> A first step has an error of about this part of the tolerance
   real(wp), parameter :: first_error = 0.01_wp

   type, public :: step_control_type
      real(wp) :: rtol = 1.0e-6_wp                     !! relative tolerance of a step >= 0
      real(wp), allocatable :: atol(:)                 !! absolute one beside it >= 0, [1] or one for each component of the
                                                       !! state, [q; v] in mechanics; not allocated: 1e-8
      real(wp) :: atol_lambda = 0.0_wp                 !! of multipliers of g, beside rtol; 0: their errors are not looked at
      real(wp) :: atol_psi = 0.0_wp                    !! of multipliers of k
      real(wp) :: tolerance = 0.0_wp                   !! > 0: the norm of Xie's thesis in place of rtol and atol
      integer :: controller = controller_automatic
      integer :: safety_place = safety_in_front        !! read for controller_pi
      real(wp) :: h_first = 0.0_wp                     !! length of the first step; 0: chosen
      real(wp) :: h_max = 0.0_wp                       !! longest step > 0; 0: |t_end - t|, with `tolerance` 1/16 of it
      real(wp) :: h_min = 0.0_wp                       !! shortest step >= 0, the last one before an end or an event apart
      real(wp), allocatable :: t_eval(:)               !! times to record, in the order of the run; else every step
   contains
      procedure :: check => control_check
      procedure :: norm => control_norm
      procedure :: next => control_next
      procedure :: first => control_first
      procedure :: is_weighted => control_is_weighted
      procedure :: archive => control_archive
   end type step_control_type

contains

   !> Ranges; those of the tolerances are checked with the norm
   pure subroutine control_check(self, status)
      class(step_control_type), intent(in) :: self
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (.not. is_zero_or_positive(self%tolerance)) then
         call status%set(dynstep_invalid_input, 'tolerance = '//text(self%tolerance)//' must be positive, or 0 for rtol and ' &
            & //'atol')
      else if (self%controller < controller_automatic .or. self%controller > controller_weighted) then
         call status%set(dynstep_invalid_input, 'controller = '//text(self%controller)//' is none of automatic (0), ' &
            & //'standard (1), PI (2), weighted (3)')
      else if (self%safety_place /= safety_in_front .and. self%safety_place /= safety_inside) then
         call status%set(dynstep_invalid_input, 'safety_place = '//text(self%safety_place) &
            & //' is neither in front (1) nor inside (2)')
      else if (.not. ieee_is_finite(self%h_first)) then
         call status%set(dynstep_invalid_input, 'h_first = '//text(self%h_first)//' is not finite')
      else if (.not. is_zero_or_positive(self%h_max)) then
         call status%set(dynstep_invalid_input, 'h_max = '//text(self%h_max)//' must be positive, or 0 for none of its own')
      else if (.not. is_zero_or_positive(self%h_min)) then
         call status%set(dynstep_invalid_input, 'h_min = '//text(self%h_min)//' must be 0 or more')
      end if
   end subroutine control_check

   !> No comparison with a NaN, which may trap
   pure logical function is_zero_or_positive(x)
      real(wp), intent(in) :: x
      is_zero_or_positive = ieee_is_finite(x)
      if (is_zero_or_positive) is_zero_or_positive = x >= 0.0_wp
   end function is_zero_or_positive

   !> True where rtol and atol are what counts
   pure logical function control_is_weighted(self)
      class(step_control_type), intent(in) :: self
      control_is_weighted = .not. self%tolerance > 0.0_wp
   end function control_is_weighted

   !> The norm of errors
   pure function control_norm(self) result(norm)
      class(step_control_type), intent(in) :: self
      type(error_norm_type) :: norm
      norm%kind = merge(norm_weighted, norm_largest, self%is_weighted())
      norm%rtol = self%rtol
      norm%tolerance = self%tolerance
      norm%atol_lambda = self%atol_lambda
      norm%atol_psi = self%atol_psi
      if (allocated(self%atol)) then
         norm%atol = self%atol
      else
         norm%atol = [1.0e-8_wp]
      end if
   end function control_norm

   !> Length of the next step, accepted or not, before the limits of the run
   pure real(wp) function control_next(self, h, error, error_before, exponent, after_rejection) result(next)
      class(step_control_type), intent(in) :: self
      real(wp), intent(in) :: h                        !! of the step that was tried
      real(wp), intent(in) :: error                    !! estimate >= 0 in the norm; 1 is what it may be
      real(wp), intent(in) :: error_before             !! of the trial before; < 0: there was none
      real(wp), intent(in) :: exponent                 !! k
      logical, intent(in) :: after_rejection           !! the trial before was thrown away
      ! far below the tolerance is none at all, and the quotient might overflow
      if (self%is_weighted() .and. (self%controller == controller_automatic .or. self%controller == controller_weighted)) then
         next = h*weighted_factor(error, error_before, exponent, after_rejection)
      else if (.not. error > 1.0e-30_wp) then
         next = sign(huge(1.0_wp), h)
      else if (self%controller /= controller_pi .or. .not. error_before >= 0.0_wp) then
         next = safety*h*(1.0_wp/error)**exponent
      else if (self%safety_place == safety_in_front) then
         next = safety*h*(1.0_wp/error)**(integral_share*exponent)*(error_before/error)**(proportional_share*exponent)
      else
         next = h*(safety/error)**(integral_share*exponent)*(error_before/error)**(proportional_share*exponent)
      end if
   end function control_next

   pure real(wp) function weighted_factor(error, error_before, exponent, after_rejection) result(factor)
      real(wp), intent(in) :: error, error_before, exponent
      logical, intent(in) :: after_rejection
      if (.not. error > 1.0e-10_wp) then
         factor = largest_factor
      else if (error > 1.0_wp .or. .not. error_before > 1.0e-10_wp) then
         factor = weighted_safety*error**(-exponent)
      else
         factor = weighted_safety*error**(-weighted_integral*exponent) &
            & *(error_before/error)**(weighted_proportional*exponent)
      end if
      factor = min(max(factor, least_factor), merge(1.0_wp, largest_factor, after_rejection .or. error > 1.0_wp))
   end function weighted_factor

   !> Length of a first step of a method of order p (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential
   !> Equations I, section II.4): a hundredth of y over y', and an error of a hundredth of what is tolerated.  In mechanics
   !> y'' of the coordinates is known without an Euler step, and that is all that is asked for.
   pure real(wp) function control_first(self, norm, y, slope, second, order) result(h)
      class(step_control_type), intent(in) :: self
      type(error_norm_type), intent(in) :: norm
      real(wp), intent(in) :: y(:), slope(:)           !! [state_size] y and y'
      real(wp), intent(in) :: second(:)                !! [state_size] y'', or [0] where it is not known
      integer, intent(in) :: order
      real(wp) :: d0, d1, d2
      h = abs(self%h_first)
      if (h > 0.0_wp) return
      d0 = size_beside(norm, y, y)
      d1 = size_beside(norm, slope, y)
      d2 = 0.0_wp
      if (size(second) == size(y)) d2 = size_beside(norm, second, y)
      h = 1.0e-6_wp
      if (min(d0, d1) > 1.0e-5_wp) h = 0.01_wp*d0/d1
      if (max(d1, d2) > 1.0e-15_wp) then
         h = min(100.0_wp*h, (first_error/max(d1, d2))**(1.0_wp/real(order + 1, wp)))
      else
         h = max(1.0e-6_wp, 1.0e-3_wp*h)
      end if
   end function control_first

   !> The norm of x beside y without the components that have no tolerance there: zeros with atol = 0
   pure real(wp) function size_beside(norm, x, y) result(length)
      type(error_norm_type), intent(in) :: norm
      real(wp), intent(in) :: x(:), y(:)
      real(wp) :: scale
      integer :: i
      length = 0.0_wp
      do i = 1, size(x)
         scale = norm%atol(min(i, size(norm%atol))) + norm%rtol*abs(y(i))
         if (scale > 0.0_wp) length = length + (min(abs(x(i))/scale, 1.0e100_wp))**2
      end do
      length = sqrt(length/real(size(x), wp))
   end function size_beside

   !> To a checkpoint or from it; t_eval is kept by the run
   recursive subroutine control_archive(self, file)
      class(step_control_type), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%section('control')
      if (file%is_reading .and. allocated(self%atol)) deallocate (self%atol)
      call file%item('rtol', self%rtol)
      call file%item('atol', self%atol)
      call file%item('atol_lambda', self%atol_lambda)
      call file%item('atol_psi', self%atol_psi)
      call file%item('tolerance', self%tolerance)
      call file%item('controller', self%controller)
      call file%item('safety_place', self%safety_place)
      call file%item('h_first', self%h_first)
      call file%item('h_max', self%h_max)
      call file%item('h_min', self%h_min)
      call file%end_section()
   end subroutine control_archive
end module dynstep_step_control
