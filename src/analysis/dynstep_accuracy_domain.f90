! SPDX-License-Identifier: BSD-3-Clause
!> How long a step may be for a given accuracy, and how a method damps and turns (Xie 1995, sections 3.2, 3.3), for methods
!> with a stability function R(z).
!>
!>   call accuracy_limit(r, angle, x0, tolerance, h, status)         a point of the accuracy domain
!>   error = accuracy_error(r, angle, x0, h)
!>   call damping_frequency(r, z, damping, frequency)
!>
!> Test problem, eq. (3.1) with the sign of the listings: x' = A x, A = [0 1; -1 2 cos theta], eigenvalues e^(+-i theta),
!> theta from the positive real axis.  Error, eq. (3.5) as the listing FindMaxH has it: the largest Euclidean norm of
!> x_k - x(k h), k = 1 .. nint(t_end/h).  As R(hA)^k - e^(khA) = u I + w A, with u and w from the eigenvalues, no matrix is
!> multiplied.
module dynstep_accuracy_domain
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_rational, only: rational_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_converged, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: accuracy_error, accuracy_limit, damping_frequency

   real(wp), parameter :: default_end = 10.0_wp

contains

   !> Smallest step length at which the error passes the tolerance.  As nint(t_end/h) falls, so does the error, by jumps;
   !> between two jumps it grows with h.  So the ends of these intervals are looked at, from a step that is accurate to a
   !> tenth of the tolerance on (each of them below 200 steps, else one in 1/2 per cent), then bisection in one of
   !> them.  A longer step may be accurate again.
   pure subroutine accuracy_limit(r, angle, x0, tolerance, h, status, t_end)
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: angle                     !! theta of the eigenvalue, radians from the positive real axis
      real(wp), intent(in) :: x0(2)                     !! start
      real(wp), intent(in) :: tolerance                 !! of the error, > 0
      real(wp), intent(out) :: h                        !! t_end where no step that is shorter has a larger error
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t_end           !! > 0, default 10
      real(wp) :: last, low, middle
      logical :: good
      integer :: n

      h = 0.0_wp
      if (status%failed()) return
      last = default_end
      if (present(t_end)) last = t_end
      good = ieee_is_finite(tolerance) .and. ieee_is_finite(last) .and. all(ieee_is_finite(x0)) .and. ieee_is_finite(angle)
      if (good) good = tolerance > 0.0_wp .and. last > 0.0_wp
      if (.not. good) then
         call status%set(dynstep_invalid_input, 'accuracy needs finite angle and x0, tolerance > 0 and t_end > 0')
         return
      end if
      low = last
      do while (accuracy_error(r, angle, x0, low, last) > 0.1_wp*tolerance)
         low = 0.5_wp*low
         if (low >= 1.0e-6_wp*last) cycle
         call status%set(dynstep_not_converged, 'no step longer than t_end/1e6 has an error of tolerance/10 = ' &
            & //text(0.1_wp*tolerance)//': ask for less')
         return
      end do
      n = nint(last/low)
      do
         h = min(last/(n - 0.5_wp), last)
         if (worst_error(r, angle, x0, h, n) > tolerance) exit
         if (h >= last) return
         low = h
         n = min(n - 1, ceiling(n/1.005_wp))
      end do
      do while (h - low > 4.0_wp*epsilon(1.0_wp)*h)
         middle = 0.5_wp*(low + h)
         if (worst_error(r, angle, x0, middle, n) > tolerance) then
            h = middle
         else
            low = middle
         end if
      end do
   end subroutine accuracy_limit

   !> Largest error of steps of length h; huge() where it is not finite
   pure real(wp) function accuracy_error(r, angle, x0, h, t_end)
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: angle, x0(2), h
      real(wp), intent(in), optional :: t_end           !! default 10
      real(wp) :: last
      last = default_end
      if (present(t_end)) last = t_end
      accuracy_error = worst_error(r, angle, x0, h, nint(last/h))
   end function accuracy_error

   !> Largest error of n steps
   pure real(wp) function worst_error(r, angle, x0, h, n) result(worst)
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: angle, x0(2), h
      integer, intent(in) :: n
      complex(wp) :: lambda, step_of_r, step_exact, numerical, exact, slope
      real(wp) :: u, w, ax0(2)
      integer :: k
      lambda = cmplx(cos(angle), sin(angle), wp)
      ! nearer to the real axis w below would lose more digits than the difference makes
      if (abs(aimag(lambda)) < 1.0e-4_wp) lambda = cmplx(sign(1.0_wp, real(lambda, wp)), 0.0_wp, wp)
      ax0 = [x0(2), -x0(1) + 2.0_wp*real(lambda, wp)*x0(2)]
      step_of_r = r%value(h*lambda)
      step_exact = exp(h*lambda)
      slope = (0.0_wp, 0.0_wp)
      if (.not. abs(aimag(lambda)) > 0.0_wp) slope = sum(1.0_wp/(h*lambda - r%zeros)) - sum(1.0_wp/(h*lambda - r%poles))
      numerical = (1.0_wp, 0.0_wp)
      exact = (1.0_wp, 0.0_wp)
      worst = 0.0_wp
      do k = 1, n
         numerical = numerical*step_of_r
         exact = exact*step_exact
         if (abs(aimag(lambda)) > 0.0_wp) then
            w = aimag(numerical - exact)/aimag(lambda)
         else
            w = k*h*real(numerical*slope - exact, wp)     ! derivative with respect to lambda of a double eigenvalue
         end if
         u = real(numerical - exact, wp) - w*real(lambda, wp)
         worst = max(worst, norm2(u*x0 + w*ax0))
         if (worst < 1.0e100_wp) cycle
         worst = huge(1.0_wp)
         exit
      end do
   end function worst_error

   !> Eqs. (3.12), (3.13): R(z) = exp(-damping + i frequency), to be compared with -Re z and Im z
   elemental subroutine damping_frequency(r, z, damping, frequency)
      type(rational_type), intent(in) :: r
      complex(wp), intent(in) :: z
      real(wp), intent(out) :: damping         !! -log |R(z)|; huge() where R = 0, -huge() at a pole
      real(wp), intent(out) :: frequency       !! arg R(z), -pi .. pi
      complex(wp) :: value
      damping = -huge(1.0_wp)
      frequency = 0.0_wp
      if (any(abs(z - r%poles) <= epsilon(1.0_wp)*abs(z))) return
      value = r%value(z)
      if (.not. abs(aimag(z)) > 0.0_wp) value = real(value, wp)
      damping = huge(1.0_wp)
      if (.not. abs(value) > 0.0_wp) return
      damping = -log(abs(value))
      frequency = atan2(aimag(value), real(value, wp))
   end subroutine damping_frequency
end module dynstep_accuracy_domain
