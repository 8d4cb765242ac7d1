! SPDX-License-Identifier: BSD-3-Clause
!> Pade's approximations R(hA) of the exponential as steps of linear systems (Xie 1995, eqs. (2.14)-(2.19)).
!>
!>   p = q          order 2 p, F-stable: undamped modes keep their amplitude, whatever h is
!>   p = q - 1, q - 2   order p + q, L-stable: stiff modes are damped at once
!>
!> PROGRAMMING INTERFACE
!>
!>     type(pade_stepper) :: stepper
!>     stepper%p = 3                 ! degrees of numerator and denominator, 0 .. 8
!>     stepper%q = 4
!>     stepper%form = form_product   ! see dynstep_pole_stages; default: automatic
!>
!>   form_refined is for very long runs without damping: twice the work, and an energy without a linear drift.
!>
!> Steps that are chosen by their error have a companion of the same order beside them, R~ = Pade(p - 1, q + 1), with a pole
!> more: by the remainders of Pade's approximations,
!>
!>   e^z - R(z) = (-1)^q p! q!/((p + q)! (p + q + 1)!) z^(p + q + 1) + ...      (Hairer & Wanner, theorem IV.3.11)
!>
!> R~ errs with the opposite sign and (q + 1)/p times as much, so that |R - R~| is 1 + (q + 1)/p times the error of R as h -> 0.
!> Where R(hA) leaves stiff components, R~ removes them, so that the estimate is what R leaves.  For p = 0 it is Pade(1, q - 1),
!> with 1 + 1/q; for p + q = 1 Pade(1,1) and for q = 8 Pade(p - 1, 8), whose orders are one higher and one lower.
!>
!> Steps linear_system and linear_ode, the forcing to full order, also where they are stiff.
module dynstep_pade
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_ode_system, only: ode_system
   use dynstep_pole_stages, only: form_automatic
   use dynstep_rational, only: most_pade, pade_rational, rational_type
   use dynstep_rational_stepper, only: check_linear, rational_stepper
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_stepper, only: method_properties, state_type
   implicit none
   private

   type, extends(rational_stepper), public :: pade_stepper
      integer :: p = 4                           !! degree of the numerator, 0 .. 8
      integer :: q = 4                           !! degree of the denominator, 0 .. 8
      integer :: form = form_automatic           !! form_automatic, form_parallel, form_product or form_refined
      integer, private :: made_for(3) = -1       ! p, q, form at `init`
   contains
      procedure :: properties => pade_properties
      procedure :: init => pade_init
      procedure :: start => pade_start
      procedure :: archive_parts => pade_archive_parts
      procedure :: prepare_control => pade_prepare_control
   end type pade_stepper

contains

   recursive function pade_properties(self) result(facts)
      class(pade_stepper), intent(in) :: self
      type(method_properties) :: facts
      facts%name = 'pade'
      facts%source = 'Xie 1995, eqs. (2.14), (2.15)'
      facts%order = self%p + self%q
      facts%acceleration_order = facts%order
      facts%error_order = facts%order
      if (facts%order > 1 .and. self%p > 0 .and. self%q >= most_pade) facts%error_order = facts%order - 1
      facts%stages = (self%q + 1)/2
      facts%symmetric = self%p == self%q
      facts%linear = .true.
      ! Pade's approximations on and beside the diagonal are A-stable (E. Hairer, G. Wanner, Solving Ordinary
      ! Differential Equations II, theorem IV.4.12)
      if (self%p <= self%q .and. self%p >= self%q - 2) facts%stability_limit = huge(1.0_wp)
   end function pade_properties

   recursive subroutine pade_init(self, sys, status)
      class(pade_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(status_type), intent(inout) :: status
      type(rational_type) :: r
      if (status%failed()) return
      call self%note_init()
      call check_linear('pade', sys, status)
      if (.not. status%failed() .and. self%p == 0 .and. self%q == 0) call status%set(dynstep_invalid_input, &
         & 'p and q must not both be 0')
      call pade_rational(self%p, self%q, r, status)
      call self%init_rational(sys, r, self%form, status)
      self%made_for = [self%p, self%q, self%form]
   end subroutine pade_init

   !> The companion
   recursive subroutine pade_prepare_control(self, sys, norm, status)
      class(pade_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(error_norm_type), intent(in) :: norm
      type(status_type), intent(inout) :: status
      type(rational_type) :: r
      if (self%p + self%q == 1) then
         call pade_rational(1, 1, r, status)
      else if (self%p == 0) then
         call pade_rational(1, self%q - 1, r, status)
      else
         call pade_rational(self%p - 1, min(self%q + 1, most_pade), r, status)
      end if
      ! One node of loads more: the velocity of a stiff forced mode is as wrong as the slope of the interpolated load, in the
      ! same way in both with the same nodes (estimate 0.05 of the error).  Stiff systems of first order do not need it.
      select type (sys)
      class is (linear_system)
         r%order = max(r%order, self%p + self%q) + 1
      end select
      call self%prepare_companion(sys, r, self%form, norm, status)
   end subroutine pade_prepare_control

   recursive subroutine pade_start(self, sys, state, status)
      class(pade_stepper), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (any([self%p, self%q, self%form] /= self%made_for) .and. self%made_for(1) >= 0) then
         call status%set(dynstep_invalid_input, 'p, q or form were changed after init; call init again')
         return
      end if
      call self%start_rational(sys, state, status)
   end subroutine pade_start

   recursive subroutine pade_archive_parts(self, file)
      class(pade_stepper), intent(inout) :: self
      type(archive_type), intent(inout) :: file
      call file%expect('p', self%p)
      call file%expect('q', self%q)
      call file%expect('form', self%form)
      call self%archive_rational(file)
   end subroutine pade_archive_parts
end module dynstep_pade
