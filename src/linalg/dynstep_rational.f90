! SPDX-License-Identifier: BSD-3-Clause
!> Rational approximations R(z) = N(z)/D(z) of e^z, by coefficients, poles and zeros.
!>
!> PROGRAMMING INTERFACE
!>
!>   call taylor_rational(p, q, alpha, r, status)   P_p(alpha z)/P_q(-(1 - alpha) z), with P_p the Taylor polynomial of
!>                                          e^z: backinterpolation (Xie 1995, eqs. (2.8)-(2.11), (2.20)-(2.23),
!>                                          (3.2), (3.3)); q = 0 with alpha = 1: explicit, p = 0 with alpha = 0: backward
!>   call pade_rational(p, q, r, status)    Pade's, of order p + q (Xie 1995, eq. (2.15))
!>   call fehlberg_rational(alpha, r, status)  both half-steps by the six stages of RKF45's fifth order, as the
!>                                          thesis's listings have it: the polynomial with z^6/2080
!>   call rational_of(num, den, r, status)  any other coefficients
!>   r%value(z)  r%at_infinity()
!>
!> Poles and zeros of the first three are mirror images of each other to the last bit where R(z) R(-z) = 1,
!> which keeps |R(iy)| = 1 in floating point.
module dynstep_rational
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_polynomial, only: polynomial_degree, polynomial_value, polynomial_zeros
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_converged, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: fehlberg_rational, pade_rational, rational_of, taylor_polynomial, taylor_rational

   integer, parameter, public :: most_taylor = 6      !! highest p and q of taylor_rational
   integer, parameter, public :: most_pade = 8        !! highest p and q of pade_rational
   integer, parameter, public :: most_degree = 16     !! of rational_of

   !> Below it alpha is taken for 0: N = 1 wherever z is a number, and its zeros might not be
   real(wp), parameter :: least_alpha = sqrt(tiny(1.0_wp))

   type, public :: rational_type
      integer :: p = 0                                !! degree of N
      integer :: q = 0                                !! degree of D
      integer :: order = 0                            !! R(z) - e^z = O(z^(order + 1))
      real(wp) :: num(0:most_degree) = 0.0_wp         !! N(z) = num(0) + num(1) z + ..., num(0) = 1
      real(wp) :: den(0:most_degree) = 0.0_wp         !! D(z), den(0) = 1
      complex(wp), allocatable :: poles(:)            !! zeros of D [q], conjugates together, Im > 0 first
      complex(wp), allocatable :: zeros(:)            !! zeros of N [p], in the same way
   contains
      procedure :: value => rational_value
      procedure :: at_infinity => rational_at_infinity
      procedure :: is_symmetric => rational_is_symmetric
   end type rational_type

contains

   !> P_p(alpha z)/P_q(-(1 - alpha) z)
   pure subroutine taylor_rational(p, q, alpha, r, status)
      integer, intent(in) :: p, q                     !! 0 .. most_taylor
      real(wp), intent(in) :: alpha                   !! 0 .. 1
      type(rational_type), intent(out) :: r
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      call check_degree('p', p, most_taylor, status)
      call check_degree('q', q, most_taylor, status)
      call check_alpha(alpha, status)
      if (status%failed()) return
      call from_halves(taylor_polynomial(p), taylor_polynomial(q), alpha, r, status)
   end subroutine taylor_rational

   !> Both half-steps with the polynomial of RKF45's fifth-order weights (reference in docs/theory)
   pure subroutine fehlberg_rational(alpha, r, status)
      real(wp), intent(in) :: alpha                   !! 0 .. 1
      type(rational_type), intent(out) :: r
      type(status_type), intent(inout) :: status
      real(wp) :: c(0:6)
      if (status%failed()) return
      call check_alpha(alpha, status)
      if (status%failed()) return
      c(0:5) = taylor_polynomial(5)
      c(6) = 1.0_wp/2080.0_wp
      call from_halves(c, c, alpha, r, status)
   end subroutine fehlberg_rational

   !> 1 + z + z^2/2 + ... + z^p/p!
   pure function taylor_polynomial(p) result(c)
      integer, intent(in) :: p
      real(wp) :: c(0:p)
      integer :: k
      c(0) = 1.0_wp
      do k = 1, p
         c(k) = c(k - 1)/k
      end do
   end function taylor_polynomial

   !> forward(alpha z)/backward(-(1 - alpha) z)
   pure subroutine from_halves(forward, backward, alpha, r, status)
      real(wp), intent(in) :: forward(0:), backward(0:)     !! polynomials of the half-steps
      real(wp), intent(in) :: alpha
      type(rational_type), intent(out) :: r
      type(status_type), intent(inout) :: status
      complex(wp), allocatable :: w(:)
      integer :: k
      do k = 0, size(forward) - 1
         r%num(k) = forward(k)*alpha**k
      end do
      do k = 0, size(backward) - 1
         r%den(k) = backward(k)*(alpha - 1.0_wp)**k
      end do
      r%p = merge(size(forward) - 1, 0, alpha > least_alpha)
      r%num(r%p + 1:) = 0.0_wp
      r%q = merge(size(backward) - 1, 0, alpha < 1.0_wp)
      call zeros_of(forward, w, status)
      r%zeros = w(:r%p)
      if (r%p > 0) r%zeros = w/alpha
      call zeros_of(backward, w, status)
      r%poles = w(:r%q)
      if (r%q > 0) r%poles = conjg(w/(alpha - 1.0_wp))
      r%order = order_of(r)
   end subroutine from_halves

   !> Pade's approximation, of order p + q
   pure subroutine pade_rational(p, q, r, status)
      integer, intent(in) :: p, q                     !! 0 .. most_pade
      type(rational_type), intent(out) :: r
      type(status_type), intent(inout) :: status
      integer :: j
      if (status%failed()) return
      call check_degree('p', p, most_pade, status)
      call check_degree('q', q, most_pade, status)
      if (status%failed()) return
      r%p = p
      r%q = q
      r%num(0) = 1.0_wp
      r%den(0) = 1.0_wp
      do j = 1, p
         r%num(j) = r%num(j - 1)*real(p - j + 1, wp)/real((p + q - j + 1)*j, wp)
      end do
      do j = 1, q
         r%den(j) = -r%den(j - 1)*real(q - j + 1, wp)/real((p + q - j + 1)*j, wp)
      end do
      call zeros_of(r%num(:p), r%zeros, status)
      if (p == q) then
         r%poles = conjg(-r%zeros)
      else
         call zeros_of(r%den(:q), r%poles, status)
      end if
      r%order = order_of(r)
   end subroutine pade_rational

   !> By its coefficients, with num(0) = den(0) = 1
   pure subroutine rational_of(num, den, r, status)
      real(wp), intent(in) :: num(0:), den(0:)        !! finite, at most most_degree + 1 each
      type(rational_type), intent(out) :: r
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (size(num) < 1 .or. size(den) < 1 .or. max(size(num), size(den)) > most_degree + 1) then
         call status%set(dynstep_invalid_input, 'numerator and denominator have 1 to '//text(most_degree + 1) &
            & //' coefficients, not '//text(size(num))//' and '//text(size(den)))
      else if (.not. (all(ieee_is_finite(num)) .and. all(ieee_is_finite(den)))) then
         call status%set(dynstep_invalid_input, 'a coefficient of R(z) is not finite')
      else if (abs(num(0) - 1.0_wp) > 0.0_wp .or. abs(den(0) - 1.0_wp) > 0.0_wp) then
         call status%set(dynstep_invalid_input, 'R(z) = N(z)/D(z) must have N(0) = D(0) = 1')
      end if
      if (status%failed()) return
      r%p = polynomial_degree(num)
      r%q = polynomial_degree(den)
      r%num(:r%p) = num(:r%p)
      r%den(:r%q) = den(:r%q)
      call zeros_of(num, r%zeros, status)
      call zeros_of(den, r%poles, status)
      r%order = order_of(r)
   end subroutine rational_of

   pure subroutine check_degree(name, degree, most, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: degree, most
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (degree < 0 .or. degree > most) call status%set(dynstep_invalid_input, name//' = '//text(degree) &
         & //' must lie between 0 and '//text(most))
   end subroutine check_degree

   pure subroutine check_alpha(alpha, status)
      real(wp), intent(in) :: alpha
      type(status_type), intent(inout) :: status
      logical :: good
      if (status%failed()) return
      good = ieee_is_finite(alpha)
      if (good) good = alpha >= 0.0_wp .and. alpha <= 1.0_wp
      if (.not. good) call status%set(dynstep_invalid_input, 'alpha = '//text(alpha)//' must lie between 0 and 1: the part ' &
         & //'of a step that runs forward')
   end subroutine check_alpha

   pure subroutine zeros_of(c, zeros, status)
      real(wp), intent(in) :: c(0:)
      complex(wp), allocatable, intent(out) :: zeros(:)
      type(status_type), intent(inout) :: status
      logical :: converged
      call polynomial_zeros(c, zeros, converged)
      if (.not. converged .and. .not. status%failed()) call status%set(dynstep_not_converged, &
         & 'the zeros of a polynomial of degree '//text(polynomial_degree(c))//' were not found')
   end subroutine zeros_of

   !> Largest k with R(z) - e^z = O(z^(k+1)).  A coefficient of N - e^z D below 64 units of rounding of its terms
   !> is none: the coefficients have been rounded a few times each.
   pure integer function order_of(r)
      type(rational_type), intent(in) :: r
      real(wp) :: c, largest, term, factorial
      integer :: k, l
      do k = 1, 2*most_degree + 1
         c = coefficient(r%num, k)
         largest = abs(c)
         factorial = 1.0_wp
         do l = k, 0, -1
            term = coefficient(r%den, l)/factorial
            c = c - term
            largest = largest + abs(term)
            factorial = factorial*real(k - l + 1, wp)
         end do
         if (abs(c) > 64.0_wp*epsilon(1.0_wp)*largest) exit
      end do
      order_of = k - 1
   end function order_of

   pure real(wp) function coefficient(c, k)
      real(wp), intent(in) :: c(0:)
      integer, intent(in) :: k
      coefficient = 0.0_wp
      if (k < size(c)) coefficient = c(k)
   end function coefficient

   !> R(z), by poles and zeros: a product of factors loses no digits, however large z is
   pure complex(wp) function rational_value(self, z)
      class(rational_type), intent(in) :: self
      complex(wp), intent(in) :: z
      integer :: k
      rational_value = (1.0_wp, 0.0_wp)
      if (abs(z) <= 1.0_wp) then
         rational_value = polynomial_value(self%num(:self%p), z)/polynomial_value(self%den(:self%q), z)
         return
      end if
      ! numerator and denominator side by side, so that no product overflows
      do k = 1, max(self%p, self%q)
         if (k <= self%p) rational_value = rational_value*((self%zeros(k) - z)/self%zeros(k))
         if (k <= self%q) rational_value = rational_value/((self%poles(k) - z)/self%poles(k))
      end do
   end function rational_value

   !> |R| at infinity: huge() where N has the higher degree
   pure real(wp) function rational_at_infinity(self)
      class(rational_type), intent(in) :: self
      rational_at_infinity = 0.0_wp
      if (self%p > self%q) rational_at_infinity = huge(1.0_wp)
      if (self%p == self%q) rational_at_infinity = abs(self%num(self%p)/self%den(self%q))
   end function rational_at_infinity

   !> R(z) R(-z) = 1: the numbers of N and D differ in the signs of odd powers alone
   pure logical function rational_is_symmetric(self)
      class(rational_type), intent(in) :: self
      integer :: k
      rational_is_symmetric = self%p == self%q
      do k = 1, self%p
         rational_is_symmetric = rational_is_symmetric .and. .not. &
            & abs(self%num(k) - (-1)**k*self%den(k)) > 8.0_wp*epsilon(1.0_wp)*abs(self%num(k))
      end do
   end function rational_is_symmetric
end module dynstep_rational
