! SPDX-License-Identifier: BSD-3-Clause
!> Positive zeros of a real polynomial whose coefficients are known up to given errors, and its signs between them.
!>
!> By the chain of derivatives: between two neighbouring zeros of p' (and 0, and a bound of all zeros) p is monotone, so
!> it has one zero there where its signs at both ends differ, else none.  The zeros of p' are found in the same way, down
!> to a straight line.  No zero can be missed, however near to each other they are, except two that are nearer than the
!> errors of the coefficients tell: those count as one that is touched without a change of sign.
module dynstep_positive_zeros
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: positive_zeros

contains

   !> The zeros that p(x) = c(0) + c(1) x + ... + c(d) x^d has for x > 0
   pure subroutine positive_zeros(c, noise, crossings, touched, first_sign)
      real(wp), intent(in) :: c(0:)                          !! d <= a few dozens
      real(wp), intent(in) :: noise(0:)                      !! error of each coefficient, >= 0; rounding errors of p(x) are
                                                             !! not added to them
      real(wp), allocatable, intent(out) :: crossings(:)     !! where the sign changes, ascending
      real(wp), allocatable, intent(out) :: touched(:)       !! where p is zero up to its error, and does not change sign
      integer, intent(out) :: first_sign                     !! for small x: +1, -1; 0 where p is zero up to its error
      real(wp) :: p(0:size(c) - 1), q(0:size(c) - 1), error(0:size(c) - 1)
      real(wp) :: breaks(0:size(c)), inner(size(c)), bound, left, pending, x
      integer :: d, i, j, k, low, count, sign_left, sign_here
      logical :: is_pending

      allocate (crossings(0), touched(0))
      first_sign = 0
      p = merge(c, 0.0_wp, abs(c) > noise)
      d = size(c) - 1
      do while (d > 0 .and. .not. abs(p(max(d, 0))) > 0.0_wp)
         d = d - 1
      end do
      if (.not. abs(p(d)) > 0.0_wp) return
      low = 0
      do while (.not. abs(p(low)) > 0.0_wp)
         low = low + 1
      end do
      d = d - low
      p(:d) = p(low:low + d)
      error(:d) = noise(low:low + d)
      first_sign = nint(sign(1.0_wp, p(0)))
      if (d == 0) return

      ! Fujiwara's bound of all zeros, which by Gauss and Lucas holds for the derivatives, too
      bound = 0.0_wp
      do k = 1, d
         if (abs(p(d - k)) > 0.0_wp) bound = max(bound, 2.0_wp*exp(log(abs(p(d - k)/p(d)))/k))
      end do
      bound = 2.0_wp*bound

      count = 0
      do k = d - 1, 0, -1
         do i = 0, d - k
            q(i) = p(i + k)
            do j = 1, k
               q(i) = q(i)*(real(i + j, wp)/real(j, wp))      ! the k-th derivative over k!
            end do
         end do
         breaks(0) = 0.0_wp
         breaks(1:count) = inner(1:count)
         breaks(count + 1) = bound
         if (k == 0) exit
         j = 0
         do i = 0, count
            if (sign_of(q(:d - k), breaks(i))*sign_of(q(:d - k), breaks(i + 1)) > 0) cycle
            x = zero_between(q(:d - k), breaks(i), breaks(i + 1))
            if (.not. x > 0.0_wp) cycle
            j = j + 1
            inner(j) = x
         end do
         count = j
      end do

      left = 0.0_wp
      sign_left = first_sign
      is_pending = .false.
      pending = 0.0_wp
      do i = 1, count + 1
         sign_here = nint(sign(1.0_wp, q(d)))
         if (i <= count) then
            sign_here = sign_of(q(:d), breaks(i))
            if (abs(value_of(q(:d), breaks(i))) <= value_of(error(:d), breaks(i))) sign_here = 0
         end if
         if (sign_here == 0) then
            if (.not. is_pending) pending = breaks(i)
            is_pending = .true.
            cycle
         else if (is_pending) then
            if (sign_here == sign_left) touched = [touched, pending]
            if (sign_here /= sign_left) crossings = [crossings, pending]
         else if (sign_here /= sign_left) then
            crossings = [crossings, zero_between(q(:d), left, breaks(i))]
         end if
         is_pending = .false.
         left = breaks(i)
         sign_left = sign_here
      end do
   end subroutine positive_zeros

   pure real(wp) function value_of(c, x)
      real(wp), intent(in) :: c(0:), x
      integer :: k
      value_of = 0.0_wp
      do k = size(c) - 1, 0, -1
         value_of = value_of*x + c(k)
      end do
   end function value_of

   pure integer function sign_of(c, x)
      real(wp), intent(in) :: c(0:), x
      real(wp) :: y
      y = value_of(c, x)
      sign_of = 0
      if (abs(y) > 0.0_wp) sign_of = nint(sign(1.0_wp, y))
   end function sign_of

   !> The zero between two points with different signs: Newton's steps while they stay inside and shrink the
   !> interval, else halves; ends where it stands still
   pure real(wp) function zero_between(c, a, b) result(x)
      real(wp), intent(in) :: c(0:), a, b
      real(wp) :: low, high, y, slope, next
      integer :: k, sign_low, sweep
      low = a
      high = b
      sign_low = sign_of(c, a)
      if (sign_low == 0) sign_low = -sign_of(c, b)
      x = between(a, b)
      do sweep = 1, 4*digits(1.0_wp) + 200
         y = 0.0_wp
         slope = 0.0_wp
         do k = size(c) - 1, 0, -1
            slope = slope*x + y
            y = y*x + c(k)
         end do
         if (.not. abs(y) > 0.0_wp) return
         if ((y > 0.0_wp) .eqv. (sign_low > 0)) then
            low = x
         else
            high = x
         end if
         next = between(low, high)
         if (modulo(sweep, 3) /= 0 .and. abs(slope) > 0.0_wp) then
            if (abs(y) < abs(slope)*(high - low)) next = x - y/slope
            if (.not. (next >= low .and. next <= high)) next = between(low, high)
         end if
         if (abs(next - x) <= 0.5_wp*epsilon(1.0_wp)*abs(x)) return
         x = next
      end do
   end function zero_between

   !> A point halfway, in the logarithm where the two are of different sizes
   pure real(wp) function between(low, high)
      real(wp), intent(in) :: low, high          !! 0 <= low < high
      if (high <= 4.0_wp*low) then
         between = 0.5_wp*(low + high)
      else
         between = sqrt(max(low, 1.0e-6_wp*high))*sqrt(high)
      end if
   end function between
end module dynstep_positive_zeros
