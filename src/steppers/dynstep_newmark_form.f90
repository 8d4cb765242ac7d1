! SPDX-License-Identifier: BSD-3-Clause
!> The form in which Newmark's formulas (Austin 1991, eqs. (24) and (25)) are evaluated for a
!> linear system.  All forms are the same in exact arithmetic; they differ in their rounding
!> errors.  S = M + gamma h C + beta h^2 K, z = omega h.
!>
!>   increment    beta = 1/4, gamma = 1/2:  S dv = h (P - C v - K (q + h/2 v)),
!>                P the mean load, dq = h (v + dv/2).  Three shears of the phase plane: any
!>                error of S^-1 that keeps it symmetric gives a neighbouring oscillator, never
!>                a drift of the energy.  One step of a mode errs by eps*z.
!>   reflected    the same for z > 2, where q1 is near -q: u = v + 2q/h,
!>                S sum = h (M u + C q + h/2 P), q1 = sum - q, v1 = 2 q1/h - u.  Three shears
!>                again, and accurate for any z > 2; errs by eps/z below.
!>   two_solves   dv as in `increment`, dq = h w, S w = M v + h/2 (P - K q).  Accurate for any
!>                z, but the energy drifts: by eps per step of an oscillator, and of the soft
!>                modes of a stiff system by the error of S against M.
!>   predicted    any beta and gamma, the acceleration is carried: from a predictor
!>                q_p, v_p, a_p that satisfies both formulas, S d = p1 - M a_p - C v_p - K q_p,
!>                then q = q_p + beta h^2 d, v = v_p + gamma h d, a = a_p + d.
module dynstep_newmark_form
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_diagonal, matrix_type
   implicit none
   private

   public :: choose_form, frequency_bounds

   integer, parameter, public :: form_increment = 1
   integer, parameter, public :: form_reflected = 2
   integer, parameter, public :: form_two_solves = 3
   integer, parameter, public :: form_predicted = 4

   type, public :: newmark_form
      integer :: form = form_predicted           !! one of the forms above
      integer :: predictor = 0                   !! 0..2, how `predicted` starts
      real(wp) :: h = 0.0_wp                     !! step length
      real(wp) :: half = 0.0_wp                  !! h/2
      real(wp) :: damping = 0.0_wp               !! gamma h,   factor of C in S
      real(wp) :: stiffness = 0.0_wp             !! beta h^2,  factor of K in S
      real(wp) :: q_v = 0.0_wp, q_a = 0.0_wp     !! q_p = q + q_v v + q_a a
      real(wp) :: v_v = 0.0_wp, v_a = 0.0_wp     !! v_p = v + v_v v + v_a a
      real(wp) :: a_v = 0.0_wp, a_a = 1.0_wp     !! a_p = a_v v + a_a a
   end type newmark_form

   !> Systems with modes on both sides of z = 2 use `increment` up to this z of the stiffest
   !> mode, `two_solves` above.  Chain of 1000 masses, lowest or highest mode excited, relative
   !> energy error after 1e5 steps:
   !>        z of the highest   lowest: increment, two_solves   highest: increment, two_solves
   !>        1e2                3e-14   4e-11                   7e-14    5e-11
   !>        1e4                5e-10   1e-6                    1e-9     3e-11
   !>        1e6                5e-8    3e-8                    2e-6     2e-11
   !> Near z = 1e8 rounding of S makes `increment` unstable: growth by 2e-8 in a step.
   real(wp), parameter :: increment_limit = 1.0e6_wp

   !> Where damping alone turns each velocity round (dv near -2v) its energy cannot drift, and
   !> `increment` would lose digits of q for nothing: eps h c/m of the way that is left.
   real(wp), parameter :: damping_limit = 20.0_wp

   !> `predicted` starts from a_p = a, v_p = v or q_p = q.  Error of q in one step: eps z^2, eps z,
   !> eps; of a: eps, eps, eps/z, with a drift of v at small z.  So q_p = q where all modes have
   !> z > 2.  Else v_p = v above this sqrt(beta) z of the stiffest mode or gamma h c/m of the most
   !> damped one, and q_p = q above the second sqrt(beta) z, as for other systems (dynstep_newmark).
   real(wp), parameter :: predict_velocity_above = sqrt(2.0_wp)
   real(wp), parameter :: predict_position_above = sqrt(2.0e5_wp)

   integer, parameter :: predict_acceleration = 0   ! a_p = a
   integer, parameter :: predict_velocity = 1       ! v_p = v
   integer, parameter :: predict_position = 2       ! q_p = q

contains

   !> Form and coefficients for one step length
   pure subroutine choose_form(self, beta, gamma, h, trapezoidal, softest, stiffest, slowest, fastest)
      type(newmark_form), intent(out) :: self
      real(wp), intent(in) :: beta, gamma, h
      logical, intent(in) :: trapezoidal        !! beta = 1/4 and gamma = 1/2
      real(wp), intent(in) :: softest           !! lower bound of omega, all modes (0: not known)
      real(wp), intent(in) :: stiffest          !! upper bound of omega, all modes
      real(wp), intent(in) :: slowest, fastest  !! bounds of the damping rate c/m, all modes
      real(wp) :: z

      self%h = h
      self%half = 0.5_wp*h
      self%damping = gamma*h
      self%stiffness = beta*h*h
      if (trapezoidal) then
         if (abs(h)*softest > 2.0_wp) then
            self%form = form_reflected
         else if (abs(h)*stiffest > increment_limit .or. abs(h)*slowest > damping_limit) then
            self%form = form_two_solves
         else
            self%form = form_increment
         end if
         return
      end if
      self%form = form_predicted
      self%predictor = predict_acceleration
      z = sqrt(beta)*(abs(h)*stiffest)
      if (beta > 0.0_wp .and. (abs(h)*softest > 2.0_wp .or. z > predict_position_above)) then
         self%predictor = predict_position
         self%a_v = -1.0_wp/(beta*h)
         self%a_a = -(0.5_wp - beta)/beta
         self%v_v = -gamma/beta
         self%v_a = h*(1.0_wp - 0.5_wp*gamma/beta)
      else if (gamma > 0.0_wp .and. max(z, gamma*abs(h)*fastest) > predict_velocity_above) then
         self%predictor = predict_velocity
         self%a_a = (gamma - 1.0_wp)/gamma
         self%q_v = h
         self%q_a = h*h*(0.5_wp - beta/gamma)
      else
         self%q_v = h
         self%q_a = 0.5_wp*h*h
         self%v_a = h
      end if
   end subroutine choose_form

   !> Gershgorin's bounds of the eigenvalues of M^-1 A, A = K or C.  The upper one is a guess where
   !> M has off-diagonals, the lower one needs a diagonal M and a symmetric A, and is 0 without.
   pure subroutine frequency_bounds(m, a, lower, upper)
      type(matrix_type), intent(in) :: m, a
      real(wp), intent(out) :: lower, upper      !! >= 0
      real(wp) :: sums(m%n), diagonal
      integer :: i

      call a%absolute_row_sums(sums)
      lower = huge(lower)
      upper = 0.0_wp
      do i = 1, m%n
         diagonal = abs(m%entry(i, i))
         if (diagonal > sums(i)*tiny(diagonal)) then
            upper = max(upper, sums(i)/diagonal)
            lower = min(lower, max(0.0_wp, 2.0_wp*a%entry(i, i) - sums(i))/diagonal)
         else
            upper = huge(upper)
            lower = 0.0_wp
         end if
      end do
      if ((m%kind > kind_diagonal .or. .not. a%symmetric) .and. m%n > 1) lower = 0.0_wp
   end subroutine frequency_bounds
end module dynstep_newmark_form
