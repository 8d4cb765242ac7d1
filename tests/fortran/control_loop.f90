! SPDX-License-Identifier: BSD-3-Clause
!> A loop of steps that are chosen by their error, as small as tests of estimates need it, and statistics of what they give.
module control_loop
   use dynstep, only: allocate_state, method_properties, ode_system, state_type, status_type, stepper_type, wp
   use dynstep_error_norm, only: error_norm_type
   use dynstep_stepper, only: verdict_type
   implicit none
   private

   public :: even_norm, quantile, run_within, slope_of

contains

   !> rtol = atol = tolerance
   function even_norm(tolerance) result(norm)
      real(wp), intent(in) :: tolerance
      type(error_norm_type) :: norm
      norm%rtol = tolerance
      allocate (norm%atol(1), source=tolerance)
   end function even_norm

   !> From state%t to t_end with the controller of the study of Jay & Negrut: 0.9 err^(-0.2) (err_old/err)^0.133 at order 2,
   !> after a rejection 0.9 err^(-1/3) and no growth, after a failure a quarter
   recursive subroutine run_within(stepper, sys, state, t_end, norm, h_first, status, rejections)
      class(stepper_type), intent(inout) :: stepper        !! prepared and started
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: t_end, h_first
      type(error_norm_type), intent(in) :: norm
      type(status_type), intent(inout) :: status
      integer, intent(out) :: rejections
      type(method_properties) :: facts
      type(verdict_type) :: verdict
      type(state_type) :: trial
      real(wp) :: h, length, before, now, largest, power
      logical :: is_last, may_grow

      rejections = 0
      if (status%failed()) return
      facts = stepper%properties()
      call allocate_state(sys, trial, status)
      largest = min(2.0_wp, 0.9_wp*facts%step_growth_limit)
      h = h_first
      before = 1.0_wp
      may_grow = .true.
      do
         is_last = abs(t_end - state%t) <= (1.0_wp + 1.0e-6_wp)*abs(h)
         length = merge(t_end - state%t, h, is_last)
         call stepper%try_within(sys, state, length, merge(t_end, state%t + length, is_last), norm, trial, verdict, status)
         power = 1.0_wp/real(verdict%error_order + 1, wp)
         now = max(verdict%error, 1.0e-8_wp)
         if (status%failed() .or. verdict%error > 1.0_wp) then
            if (status%failed() .and. (.not. status%retry .or. abs(length) < 1.0e-10_wp)) return
            h = length*merge(0.25_wp, max(0.2_wp, 0.9_wp*now**(-power)), status%failed())
            call status%clear()
            rejections = rejections + 1
            may_grow = .false.
            cycle
         end if
         call stepper%accept(state, trial)
         if (is_last) return
         h = length*max(0.2_wp, min(merge(largest, 1.0_wp, may_grow), &
            & 0.9_wp*now**(-0.6_wp*power)*(before/now)**(0.4_wp*power)))
         before = now
         may_grow = .true.
      end do
   end subroutine run_within

   !> The value below which this part of x lies
   pure real(wp) function quantile(x, part)
      real(wp), intent(in) :: x(:), part
      real(wp) :: y(size(x)), least
      integer :: i, j
      y = x
      do i = 1, size(y) - 1
         j = i - 1 + minloc(y(i:), 1)
         least = y(j)
         y(j) = y(i)
         y(i) = least
      end do
      quantile = y(max(1, min(size(y), nint(part*size(y)))))
   end function quantile

   !> Exponent of y = c x^slope from the first to the last of several points
   pure real(wp) function slope_of(x, y)
      real(wp), intent(in) :: x(:), y(:)
      slope_of = log(y(size(y))/y(1))/log(x(size(x))/x(1))
   end function slope_of
end module control_loop
