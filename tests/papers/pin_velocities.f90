! SPDX-License-Identifier: BSD-3-Clause
!> The runs of Jay & Negrut's Figs. 6 and 7: how fast pin O of the slider-crank moves, which should stand still.
!>
!> The paper takes its model and its start from a conference paper of 2007 that is not at hand.  Here they are those of
!> DYNSTEP_SLIDER_CRANK, and the rate of the crank was chosen so that the drift of HHT-I3 has the size of Fig. 6.
module pin_velocities
   use dynstep_alpha_coefficients, only: hht_coefficients
   use dynstep_integrate, only: control_type, integrate
   use dynstep_kinds, only: wp
   use dynstep_slider_crank, only: slider_crank
   use dynstep_soi2, only: soi2_stepper
   use dynstep_status, only: status_type
   use dynstep_stepper, only: allocate_state, state_type
   use dynstep_trajectory, only: recorder_type
   implicit none
   private

   public :: drive

   real(wp), parameter, public :: pi = acos(-1.0_wp)

   !> What the pin did
   type, extends(recorder_type), public :: pin_recorder
      real(wp) :: largest = 0.0_wp               !! component of its velocity
      real(wp) :: late = 0.0_wp                  !! of the second half of the run
      real(wp) :: fastest = 0.0_wp               !! velocity of any coordinate
      real(wp) :: t = 0.0_wp                     !! last point reached
      type(slider_crank), private :: sys
      real(wp), private :: middle = 0.0_wp
   contains
      procedure :: record => pin_record
   end type pin_recorder

contains

   !> A run from angle 0 of the crank to t_end with steps h, from a_alpha = a0
   subroutine drive(variant, alpha, gravity, rate, t_end, h, pin, status)
      integer, intent(in) :: variant             !! of soi2_stepper
      real(wp), intent(in) :: alpha              !! of HHT
      real(wp), intent(in) :: gravity, rate, t_end, h
      type(pin_recorder), intent(out) :: pin
      type(status_type), intent(inout) :: status !! failed where the run ended early
      type(slider_crank) :: sys
      type(soi2_stepper) :: stepper
      type(state_type) :: state
      real(wp) :: q(9), v(9)

      sys%gravity = gravity
      call sys%setup()
      call sys%start(0.0_wp, rate, q, v, status)
      pin%sys = sys
      pin%middle = 0.5_wp*t_end
      stepper%variant = variant
      stepper%second_order_start = .false.
      call hht_coefficients(alpha, stepper%coefficients, status)
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      if (status%failed()) return
      state%y = [q, v]
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, t_end, control_type(h=h), status, pin)
   end subroutine drive

   recursive subroutine pin_record(self, state, status)
      class(pin_recorder), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      real(wp) :: velocity
      if (status%failed()) return
      velocity = maxval(abs(self%sys%pin_velocity(state%y(1:9), state%y(10:18))))
      self%largest = max(self%largest, velocity)
      if (state%t > self%middle) self%late = max(self%late, velocity)
      self%fastest = max(self%fastest, maxval(abs(state%y(10:18))))
      self%t = state%t
   end subroutine pin_record
end module pin_velocities
