! SPDX-License-Identifier: BSD-3-Clause
!> Coefficients of the generalized-alpha methods (Jay & Negrut 2008, section 1; J. Chung,
!> G. M. Hulbert, J. Appl. Mech. 60 (1993) 371-375):
!>
!>   alpha_m = (2 rho - 1)/(1 + rho)    alpha_f = rho/(1 + rho)    alpha = alpha_m - alpha_f
!>   beta = (1 - alpha)^2/4             gamma = 1/2 - alpha
!>
!> with rho = rho_inf in [0, 1], the spectral radius at infinite frequency: 1 keeps all oscillations,
!> 0 removes the fastest ones in one step.
module dynstep_alpha_coefficients
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: coefficients_of, hht_coefficients, newmark_coefficients

   !> Coefficients of one method; those of rho_inf = 0.8 unless set
   type, public :: alpha_coefficients
      real(wp) :: alpha_m = 1.0_wp/3.0_wp      !! weight of the old inertia forces, not 1
      real(wp) :: alpha_f = 4.0_wp/9.0_wp      !! weight of the old forces, not 1
      real(wp) :: beta = 25.0_wp/81.0_wp       !! of a_{1+alpha} in y1, >= 0
      real(wp) :: gamma = 11.0_wp/18.0_wp      !! of a_{1+alpha} in z1, >= 0
   contains
      procedure :: alpha => coefficients_alpha
      procedure :: check => coefficients_check
      procedure :: order => coefficients_order
      procedure :: stability_limit => coefficients_stability_limit
      procedure :: growth_limit => coefficients_growth_limit
   end type alpha_coefficients

contains

   !> Coefficients of rho_inf in [0, 1]
   pure subroutine coefficients_of(rho_inf, coefficients, status)
      real(wp), intent(in) :: rho_inf
      type(alpha_coefficients), intent(inout) :: coefficients
      type(status_type), intent(inout) :: status
      logical :: in_range
      if (status%failed()) return
      in_range = ieee_is_finite(rho_inf)
      if (in_range) in_range = rho_inf >= 0.0_wp .and. rho_inf <= 1.0_wp
      if (.not. in_range) then
         call status%set(dynstep_invalid_input, 'rho_inf = '//text(rho_inf)//' must lie between 0 and 1')
         return
      end if
      coefficients%alpha_m = (2.0_wp*rho_inf - 1.0_wp)/(1.0_wp + rho_inf)
      coefficients%alpha_f = rho_inf/(1.0_wp + rho_inf)
      call of_second_order((rho_inf - 1.0_wp)/(1.0_wp + rho_inf), coefficients)
   end subroutine coefficients_of

   !> HHT-alpha: alpha_m = 0, alpha_f = -alpha, alpha in [-1/3, 0]
   pure subroutine hht_coefficients(alpha, coefficients, status)
      real(wp), intent(in) :: alpha
      type(alpha_coefficients), intent(inout) :: coefficients
      type(status_type), intent(inout) :: status
      logical :: in_range
      if (status%failed()) return
      in_range = ieee_is_finite(alpha)
      ! 1/3 has no exact number: the user's -1/3 may lie half a unit beyond ours
      if (in_range) in_range = alpha >= -(1.0_wp + epsilon(1.0_wp))/3.0_wp .and. alpha <= 0.0_wp
      if (.not. in_range) then
         call status%set(dynstep_invalid_input, 'alpha = '//text(alpha)//' of HHT must lie between -1/3 and 0')
         return
      end if
      coefficients%alpha_m = 0.0_wp
      coefficients%alpha_f = -alpha
      call of_second_order(alpha, coefficients)
   end subroutine hht_coefficients

   !> Newmark's family: alpha_m = alpha_f = 0; (1/4, 1/2) is the trapezoid, (0, 1/2) Stoermer's rule
   pure subroutine newmark_coefficients(beta, gamma, coefficients, status)
      real(wp), intent(in) :: beta, gamma
      type(alpha_coefficients), intent(inout) :: coefficients
      type(status_type), intent(inout) :: status
      type(alpha_coefficients) :: wanted
      if (status%failed()) return
      wanted = alpha_coefficients(0.0_wp, 0.0_wp, beta, gamma)
      call wanted%check(status)
      if (.not. status%failed()) coefficients = wanted
   end subroutine newmark_coefficients

   pure subroutine of_second_order(alpha, coefficients)
      real(wp), intent(in) :: alpha
      type(alpha_coefficients), intent(inout) :: coefficients
      coefficients%beta = 0.25_wp*(1.0_wp - alpha)**2
      coefficients%gamma = 0.5_wp - alpha
   end subroutine of_second_order

   !> a_{n+alpha} belongs to t_n + alpha h (section 2)
   pure real(wp) function coefficients_alpha(self)
      class(alpha_coefficients), intent(in) :: self
      coefficients_alpha = self%alpha_m - self%alpha_f
   end function coefficients_alpha

   !> Finite, alpha_m and alpha_f not 1, beta and gamma not negative
   pure subroutine coefficients_check(self, status)
      class(alpha_coefficients), intent(in) :: self
      type(status_type), intent(inout) :: status
      logical :: in_range
      if (status%failed()) return
      in_range = all(ieee_is_finite([self%alpha_m, self%alpha_f, self%beta, self%gamma]))
      if (in_range) in_range = min(abs(self%alpha_m - 1.0_wp), abs(self%alpha_f - 1.0_wp)) > 0.0_wp &
         & .and. min(self%beta, self%gamma) >= 0.0_wp
      if (.not. in_range) call status%set(dynstep_invalid_input, 'generalized-alpha needs alpha_m and alpha_f other than 1, ' &
         & //'beta >= 0 and gamma >= 0, not '//text(self%alpha_m)//', '//text(self%alpha_f)//', '//text(self%beta) &
         & //', '//text(self%gamma))
   end subroutine coefficients_check

   !> 2 where gamma = 1/2 - alpha, else 1
   pure integer function coefficients_order(self)
      class(alpha_coefficients), intent(in) :: self
      coefficients_order = 1
      ! each of the three coefficients may be rounded
      if (abs(self%gamma - 0.5_wp + self%alpha()) <= 4.0_wp*epsilon(1.0_wp)) coefficients_order = 2
   end function coefficients_order

   !> Largest omega h of an undamped oscillator: huge() under the condition of Chung & Hulbert (1993),
   !> alpha_m <= alpha_f <= 1/2 and beta >= 1/4 + (alpha_f - alpha_m)/2 at order 2; Newmark's own limit where
   !> alpha_m = alpha_f = 0; else -1, not known
   pure real(wp) function coefficients_stability_limit(self) result(limit)
      class(alpha_coefficients), intent(in) :: self
      real(wp), parameter :: rounding = 4.0_wp*epsilon(1.0_wp)
      limit = -1.0_wp
      if (.not. all(ieee_is_finite([self%alpha_m, self%alpha_f, self%beta, self%gamma]))) return
      if (self%order() == 2 .and. self%alpha_m <= self%alpha_f .and. self%alpha_f <= 0.5_wp &
         & .and. self%beta >= 0.25_wp - 0.5_wp*self%alpha() - rounding) then
         limit = huge(limit)
      else if (max(abs(self%alpha_m), abs(self%alpha_f)) <= 0.0_wp) then
         if (self%gamma < 0.5_wp) then
            limit = 0.0_wp
         else if (2.0_wp*self%beta >= self%gamma) then
            limit = huge(limit)
         else
            limit = sqrt(2.0_wp/(self%gamma - 2.0_wp*self%beta))
         end if
      end if
   end function coefficients_stability_limit

   !> Steps may grow by less than 1 + 1/|alpha| = 2/(1 - rho_inf), many times over: with the ratio
   !> q of two steps the adjusted recursion (14a) has an eigenvalue that is larger than 1 where
   !> |alpha| (q - 1) > 1
   pure real(wp) function coefficients_growth_limit(self) result(limit)
      class(alpha_coefficients), intent(in) :: self
      limit = huge(limit)
      if (abs(self%alpha()) > 1.0e-6_wp) limit = 1.0_wp + 1.0_wp/abs(self%alpha())
   end function coefficients_growth_limit
end module dynstep_alpha_coefficients
