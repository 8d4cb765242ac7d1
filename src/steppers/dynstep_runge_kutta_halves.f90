! SPDX-License-Identifier: BSD-3-Clause
!> The half-steps of backinterpolation (Xie 1995, sections 2.3-2.5): explicit Runge-Kutta steps of order 1 to 5, over
!> any h, forward or backward in time.
!>
!> PROGRAMMING INTERFACE
!>
!>   call half%init(formula, state_size, status)          1 .. 5: that order, formula_fehlberg
!>   call half%run(sys, t, y, h, solver, d, count, status, [f0])    d = y(t + h) - y; f0 = y'(t) saves an evaluation
!>   call half%end_derivative(f)                          y'(t + h), where needs_end
!>   call half%add_end_derivative(factor, x)              x = x + factor*(that)
!>   call half%add_terms(x)                               x = x + sizes of the terms of d, for a bound of rounding errors
!>   call half%add_error(factor, x)                       x = x + factor*(fifth minus fourth order, and so on) of the last run
!>   call half%add_error_size(x)                          x = x + |that|
!>   half%order, %error_order, %stages, %needs_end
!>
!> On y' = l y a run of order p gives the Taylor polynomial of degree p, P_p(h l).  For p = 5 that wants one stage more
!> than the degree: of the formulas with six stages, Nystroem's (1925; E. Hairer, S. P. Norsett, G. Wanner, Solving
!> Ordinary Differential Equations I, 1993, table II.1.1) has no term of degree 6.  RKF45's fifth order, which the thesis's
!> listings take, has z^6/2080 (formula_fehlberg).
module dynstep_runge_kutta_halves
   use dynstep_accelerations, only: acceleration_solver
   use dynstep_kinds, only: wp
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_no_memory, dynstep_not_finite, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   integer, parameter, public :: formula_fehlberg = 6     !! RKF45's fifth-order weights, error by its fourth order
   integer, parameter :: most_stages = 6

   type, public :: runge_kutta_half
      integer :: stages = 0
      integer :: order = 0                             !! 1 .. 5
      integer :: error_order = 0                       !! of the embedded formula
      logical :: needs_end = .false.                   !! its error, or the look at the whole step, reads y' at the end
      logical :: is_blind = .false.                    !! its error is zero for y' = f(t) (order 4), or y' = J y (order 5)
      real(wp), private :: a(most_stages, most_stages) = 0.0_wp
      real(wp), private :: b(most_stages) = 0.0_wp     ! weights
      real(wp), private :: c(most_stages) = 0.0_wp     ! times
      real(wp), private :: e(most_stages + 1) = 0.0_wp ! weights minus those of the embedded formula, the last of y' at the end
      real(wp), private :: h = 0.0_wp                  ! of the last run
      real(wp), allocatable, private :: k(:, :)        ! derivatives [state_size, stages + 1]
      real(wp), allocatable, private :: point(:)       ! [state_size]
   contains
      procedure :: init => half_init
      procedure :: run => half_run
      procedure :: end_derivative => half_end_derivative
      procedure :: add_end_derivative => half_add_end_derivative
      procedure :: add_terms => half_add_terms
      procedure :: add_error => half_add_error
      procedure :: add_error_size => half_add_error_size
   end type runge_kutta_half

   !> |h y'| of a stage beyond this ends a run: squares of it are numbers still
   real(wp), parameter :: largest = 1.0e150_wp

contains

   !> Coefficients and workspace
   pure subroutine half_init(self, formula, state_size, status)
      class(runge_kutta_half), intent(inout) :: self
      integer, intent(in) :: formula                   !! 1 .. 5 or formula_fehlberg
      integer, intent(in) :: state_size
      type(status_type), intent(inout) :: status
      integer :: i, stat

      if (status%failed()) return
      self%a = 0.0_wp
      self%b = 0.0_wp
      self%e = 0.0_wp
      self%needs_end = .false.
      self%is_blind = .false.
      self%stages = formula
      self%order = formula
      self%error_order = formula - 1
      select case (formula)
      case (1)
         call euler(self)
      case (2)
         call heun(self)
      case (3)
         call kutta(self)
      case (4)
         call classical(self)
      case (5)
         call nystroem(self)
      case default
         call fehlberg(self)
      end select
      do i = 1, self%stages
         self%c(i) = sum(self%a(i, :i - 1))
      end do
      if (allocated(self%k)) deallocate (self%k, self%point)
      allocate (self%k(state_size, self%stages + 1), self%point(state_size), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for the stages of a state of '//text(state_size)//' numbers')
         return
      end if
      self%k = 0.0_wp
      self%point = 0.0_wp
   end subroutine half_init

   !> The error of order 1 itself, by the trapezoid
   pure subroutine euler(self)
      class(runge_kutta_half), intent(inout) :: self
      self%b(1) = 1.0_wp
      self%e(1) = -0.5_wp
      self%e(2) = 0.5_wp
      self%error_order = 1
      self%needs_end = .true.
   end subroutine euler

   !> Compared with Euler's formula
   pure subroutine heun(self)
      class(runge_kutta_half), intent(inout) :: self
      self%a(2, 1) = 1.0_wp
      self%b(:2) = 0.5_wp
      self%e(:2) = [-0.5_wp, 0.5_wp]
   end subroutine heun

   !> Compared with the midpoint formula
   pure subroutine kutta(self)
      class(runge_kutta_half), intent(inout) :: self
      self%a(2, 1) = 0.5_wp
      self%a(3, :2) = [-1.0_wp, 2.0_wp]
      self%b(:3) = [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp
      self%e(:3) = [1.0_wp, -2.0_wp, 1.0_wp]/6.0_wp
   end subroutine kutta

   !> Four stages embed order 2 at most; with y' at the end in the place of the fourth it is order 3
   pure subroutine classical(self)
      class(runge_kutta_half), intent(inout) :: self
      self%a(2, 1) = 0.5_wp
      self%a(3, 2) = 0.5_wp
      self%a(4, 3) = 1.0_wp
      self%b(:4) = [1.0_wp, 2.0_wp, 2.0_wp, 1.0_wp]/6.0_wp
      self%e(4) = 1.0_wp/6.0_wp
      self%e(5) = -1.0_wp/6.0_wp
      self%needs_end = .true.
      self%is_blind = .true.
   end subroutine classical

   !> The conditions of order 4 leave one direction free, (-3, 0, 25, -16, -81, 75); here in the multiple that makes the last
   !> weight of the embedded formula zero, and the others positive
   pure subroutine nystroem(self)
      class(runge_kutta_half), intent(inout) :: self
      self%stages = 6
      self%a(2, 1) = 1.0_wp/3.0_wp
      self%a(3, :2) = [4.0_wp, 6.0_wp]/25.0_wp
      self%a(4, :3) = [1.0_wp, -12.0_wp, 15.0_wp]/4.0_wp
      self%a(5, :4) = [6.0_wp, 90.0_wp, -50.0_wp, 8.0_wp]/81.0_wp
      self%a(6, :4) = [6.0_wp, 36.0_wp, 10.0_wp, 8.0_wp]/75.0_wp
      self%b = [23.0_wp, 0.0_wp, 125.0_wp, 0.0_wp, -81.0_wp, 125.0_wp]/192.0_wp
      self%e(:6) = [-15.0_wp, 0.0_wp, 125.0_wp, -80.0_wp, -405.0_wp, 375.0_wp]/576.0_wp
      self%needs_end = .true.
      self%is_blind = .true.
   end subroutine nystroem

   !> Appendix A of the thesis, listing bi45
   pure subroutine fehlberg(self)
      class(runge_kutta_half), intent(inout) :: self
      self%order = 5
      self%error_order = 4
      self%a(2, 1) = 0.25_wp
      self%a(3, :2) = [3.0_wp, 9.0_wp]/32.0_wp
      self%a(4, :3) = [1932.0_wp, -7200.0_wp, 7296.0_wp]/2197.0_wp
      self%a(5, :4) = [8341.0_wp, -32832.0_wp, 29440.0_wp, -845.0_wp]/4104.0_wp
      self%a(6, :5) = [-6080.0_wp, 41040.0_wp, -28352.0_wp, 9295.0_wp, -5643.0_wp]/20520.0_wp
      self%b = [902880.0_wp, 0.0_wp, 3953664.0_wp, 3855735.0_wp, -1371249.0_wp, 277020.0_wp]/7618050.0_wp
      self%e(:6) = [2090.0_wp, 0.0_wp, -22528.0_wp, -21970.0_wp, 15048.0_wp, 27360.0_wp]/752400.0_wp
   end subroutine fehlberg

   !> d = y(t + h) - y by one step of the formula
   recursive subroutine half_run(self, sys, t, y, h, solver, d, count, status, f0)
      class(runge_kutta_half), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)                     !! [state_size]
      real(wp), intent(in) :: h                        !! of either sign
      type(acceleration_solver), intent(inout) :: solver   !! for y' of sys
      real(wp), intent(inout) :: d(:)                  !! [state_size]; of no meaning where the call fails
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: f0(:)          !! y' at (t, y)
      integer :: i, j

      if (status%failed()) return
      self%h = h
      do i = 1, self%stages
         if (i == 1 .and. present(f0)) then
            self%k(:, 1) = f0
         else
            self%point = 0.0_wp
            do j = 1, i - 1
               self%point = self%point + self%a(i, j)*self%k(:, j)
            end do
            self%point = y + h*self%point
            call solver%derivative(sys, t + self%c(i)*h, self%point, self%k(:, i), count, status)
            if (status%failed()) return
         end if
         if (maxval(abs(self%k(:, i))) > largest/max(1.0_wp, abs(h))) then
            call status%set(dynstep_not_finite, 'y'' reaches '//text(maxval(abs(self%k(:, i))))//' in stage '//text(i) &
               & //' of the half-step from t = '//text(t)//' over '//text(h)//'; a smaller step may help', retry=.true.)
            return
         end if
      end do
      d = 0.0_wp
      do i = 1, self%stages
         d = d + self%b(i)*self%k(:, i)
      end do
      d = h*d
   end subroutine half_run

   !> y' at the end of the last run, for its error
   pure subroutine half_end_derivative(self, f)
      class(runge_kutta_half), intent(inout) :: self
      real(wp), intent(in) :: f(:)                     !! [state_size]
      self%k(:, self%stages + 1) = f
   end subroutine half_end_derivative

   !> x = x + factor*y' at the end of the last run
   pure subroutine half_add_end_derivative(self, factor, x)
      class(runge_kutta_half), intent(in) :: self
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: x(:)                  !! [state_size]
      x = x + factor*self%k(:, self%stages + 1)
   end subroutine half_add_end_derivative

   !> x = x + |h b_1 y'_1| + |h b_2 y'_2| + ...
   pure subroutine half_add_terms(self, x)
      class(runge_kutta_half), intent(in) :: self
      real(wp), intent(inout) :: x(:)                  !! [state_size]
      integer :: i
      do i = 1, self%stages
         x = x + abs(self%h*self%b(i))*abs(self%k(:, i))
      end do
   end subroutine half_add_terms

   !> x = x + factor*(d of the last run minus that of the embedded formula)
   pure subroutine half_add_error(self, factor, x)
      class(runge_kutta_half), intent(in) :: self
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: x(:)                  !! [state_size]
      integer :: i
      do i = 1, size(x)
         x(i) = x(i) + factor*error_of(self, i)
      end do
   end subroutine half_add_error

   !> x = x + |d of the last run minus that of the embedded formula|
   pure subroutine half_add_error_size(self, x)
      class(runge_kutta_half), intent(in) :: self
      real(wp), intent(inout) :: x(:)                  !! [state_size]
      integer :: i
      do i = 1, size(x)
         x(i) = x(i) + abs(error_of(self, i))
      end do
   end subroutine half_add_error_size

   pure real(wp) function error_of(self, component)
      class(runge_kutta_half), intent(in) :: self
      integer, intent(in) :: component
      integer :: i
      error_of = 0.0_wp
      do i = 1, self%stages + merge(1, 0, self%needs_end)
         error_of = error_of + self%e(i)*self%k(component, i)
      end do
      error_of = self%h*error_of
   end function error_of
end module dynstep_runge_kutta_halves
