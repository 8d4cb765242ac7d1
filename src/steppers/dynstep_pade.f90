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
!> Steps linear_system and linear_ode, the forcing to full order, also where they are stiff.
module dynstep_pade
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_pole_stages, only: form_automatic
   use dynstep_rational, only: pade_rational, rational_type
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
   end type pade_stepper

contains

   recursive function pade_properties(self) result(facts)
      class(pade_stepper), intent(in) :: self
      type(method_properties) :: facts
      facts%name = 'pade'
      facts%source = 'Xie 1995, eqs. (2.14), (2.15)'
      facts%order = self%p + self%q
      facts%acceleration_order = facts%order
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
