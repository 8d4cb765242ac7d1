! SPDX-License-Identifier: BSD-3-Clause
!> Where |R(z)| <= 1 for a rational approximation R = N/D of e^z: facts found by the signs of polynomials between their
!> zeros, never by looking at points.
!>
!>   E(theta, r) = |D(z)|^2 - |N(z)|^2,  z = r e^(i theta)      a polynomial in r, of r^2 alone on the imaginary axis
!>   R is stable at z where E >= 0.
!>
!> A-stable (|R| <= 1 for Re z <= 0): no pole with Re z <= 0, and E >= 0 on the imaginary axis, by the maximum principle.
!> L-stable: and R(infinity) = 0.  F-stable (Xie 1995, definition 2.4; stable where Re z <= 0 and nowhere else): no pole
!> with Re z <= 0, and E = 0 on the whole axis.  A(phi): |R| <= 1 for |arg(-z)| <= phi.
!>
!> PROGRAMMING INTERFACE
!>
!>   call find_facts(r, facts, status)                 of a rational_type
!>   call imaginary_axis(r, axis)                      that part alone
!>   call ray_crossings(r, angle, crossings, touched, first_sign)      |R| = 1 on a ray
!>
!> R must have no zero in common with a pole.  A value of E counts as zero where the rounding errors of the
!> coefficients are as large: 64 units of rounding of their terms, of which each has a few.
module dynstep_stability_facts
   use dynstep_kinds, only: wp
   use dynstep_positive_zeros, only: positive_zeros
   use dynstep_rational, only: most_degree, rational_type
   use dynstep_status, only: dynstep_invalid_input, status_type
   implicit none
   private

   public :: find_facts, imaginary_axis, is_left, ray_crossings

   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: pi = acos(-1.0_wp)

   !> |R(iy)| for y >= 0 (and for -y the same)
   type, public :: imaginary_axis_type
      logical :: is_unit = .false.                  !! |R(iy)| = 1 for all y
      logical :: is_stable = .false.                !! |R(iy)| <= 1 for all y
      real(wp), allocatable :: intervals(:, :)      !! [2, number]: |R(iy)| <= 1 from (1, i) to (2, i), huge() for infinity
      real(wp), allocatable :: touched(:)           !! y > 0 with |R(iy)| = 1 within an interval, or alone between two
      real(wp) :: growth = 0.0_wp                   !! largest |R(iy)| - 1; huge() where it is not bounded
      real(wp) :: growth_at = 0.0_wp                !! a y where it is; huge() for infinity
   end type imaginary_axis_type

   type, public :: stability_facts_type
      type(imaginary_axis_type) :: axis
      logical :: is_i_stable = .false.              !! |R(iy)| <= 1 for all y
      logical :: is_a_stable = .false.
      logical :: is_f_stable = .false.
      logical :: is_l_stable = .false.
      real(wp) :: angle = 0.0_wp                    !! phi of A(phi) in degrees, 0 .. 90; 0 where not even the negative
                                                    !! real axis is stable
      real(wp) :: r_infinity = 0.0_wp               !! |R(infinity)|, huge() where it is not bounded
      real(wp) :: real_limit = 0.0_wp               !! |R(x)| <= 1 for -real_limit <= x <= 0; huge() for all
      real(wp) :: positive_limit = 0.0_wp           !! first x > 0 from where |R(x)| <= 1 (the end of the unstable region
                                                    !! on the positive real axis); huge() where there is none
      complex(wp), allocatable :: left_poles(:)     !! those with Re <= 0, Im >= 0
   end type stability_facts_type

contains

   !> All facts
   pure subroutine find_facts(r, facts, status)
      type(rational_type), intent(in) :: r
      type(stability_facts_type), intent(out) :: facts
      type(status_type), intent(inout) :: status
      real(wp), allocatable :: crossings(:), touched(:)
      real(wp) :: low, high, middle
      integer :: first_sign, i

      if (status%failed()) return
      if (.not. (allocated(r%poles) .and. allocated(r%zeros))) then
         call status%set(dynstep_invalid_input, 'R(z) is not made yet: call one of the constructors of dynstep_rational')
         return
      end if
      call imaginary_axis(r, facts%axis)
      facts%r_infinity = r%at_infinity()
      allocate (facts%left_poles(0))
      do i = 1, r%q
         if (is_left(r%poles(i)) .and. aimag(r%poles(i)) >= 0.0_wp) facts%left_poles = [facts%left_poles, r%poles(i)]
      end do
      facts%is_i_stable = facts%axis%is_stable
      facts%is_a_stable = facts%is_i_stable .and. size(facts%left_poles) == 0 .and. r%p <= r%q
      facts%is_f_stable = facts%is_a_stable .and. facts%axis%is_unit .and. r%q > 0
      facts%is_l_stable = facts%is_a_stable .and. r%p < r%q

      call ray_crossings(r, pi, crossings, touched, first_sign)
      facts%real_limit = huge(1.0_wp)
      if (first_sign < 0) then
         facts%real_limit = 0.0_wp
      else if (size(crossings) > 0) then
         facts%real_limit = crossings(1)
      end if
      call ray_crossings(r, 0.0_wp, crossings, touched, first_sign)
      facts%positive_limit = huge(1.0_wp)
      if (first_sign >= 0) facts%positive_limit = 0.0_wp
      if (first_sign < 0 .and. size(crossings) > 0) facts%positive_limit = crossings(1)

      if (facts%is_a_stable) then
         facts%angle = 90.0_wp
      else if (is_stable_sector(r, 0.0_wp)) then
         ! a sector within a stable one is stable: halves down to rounding
         low = 0.0_wp
         high = 90.0_wp
         do
            middle = 0.5_wp*(low + high)
            if (high - low <= 16.0_wp*epsilon(1.0_wp)*90.0_wp) exit
            if (is_stable_sector(r, middle)) then
               low = middle
            else
               high = middle
            end if
         end do
         facts%angle = low
      end if
   end subroutine find_facts

   !> True where |R| <= 1 for |arg(-z)| <= phi: on both rays, and there is no pole between them (maximum principle)
   pure logical function is_stable_sector(r, phi)
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: phi                      !! in degrees, 0 .. 90
      real(wp) :: e(0:2*most_degree), noise(0:2*most_degree)
      real(wp), allocatable :: crossings(:), touched(:)
      integer :: first_sign, i
      is_stable_sector = .false.
      do i = 1, r%q
         if (atan2(abs(aimag(r%poles(i))), -real(r%poles(i), wp)) <= phi*(pi/180.0_wp)) return
      end do
      ! errors of the coefficients must not pass for stability: the angle has an error of 1e-11 degrees, not of 1e-9
      call ray_polynomial(r, cosines_of(pi - phi*(pi/180.0_wp)), e, noise)
      call positive_zeros(e, 0.0_wp*noise, crossings, touched, first_sign)
      is_stable_sector = first_sign >= 0 .and. size(crossings) == 0
   end function is_stable_sector

   !> Re z <= 0 up to rounding
   elemental logical function is_left(z)
      complex(wp), intent(in) :: z
      is_left = real(z, wp) <= rounding*abs(z)
   end function is_left

   !> E on the imaginary axis, its intervals and the maximum of |R(iy)|
   pure subroutine imaginary_axis(r, axis)
      type(rational_type), intent(in) :: r
      type(imaginary_axis_type), intent(out) :: axis
      real(wp), dimension(0:most_degree) :: e, noise, of_n, n_noise, of_d, d_noise
      real(wp) :: edges(2, most_degree + 2), from
      real(wp), allocatable :: crossings(:)
      integer :: i, count, sign_here

      call axis_square(r%num, of_n, n_noise)
      call axis_square(r%den, of_d, d_noise)
      e = of_d - of_n
      noise = d_noise + n_noise
      call positive_zeros(e, noise, crossings, axis%touched, sign_here)
      crossings = sqrt(crossings)
      axis%touched = sqrt(axis%touched)
      axis%is_unit = sign_here == 0
      count = 0
      from = 0.0_wp
      do i = 0, size(crossings)
         if (i > 0) from = crossings(i)
         if (sign_here >= 0) then
            count = count + 1
            edges(:, count) = [from, huge(1.0_wp)]
            if (i < size(crossings)) edges(2, count) = crossings(i + 1)
         end if
         sign_here = -sign_here
      end do
      axis%intervals = edges(:, :count)
      axis%is_stable = size(crossings) == 0 .and. count == 1
      if (.not. axis%is_stable) call find_growth(r, merge(e, 0.0_wp, abs(e) > noise), of_d, axis)
   end subroutine imaginary_axis

   !> Largest |R(iy)|^2 - 1 = -E/|D|^2: where E' |D|^2 - E (|D|^2)' = 0, at a pole, or at infinity
   pure subroutine find_growth(r, e, of_d, axis)
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: e(0:), of_d(0:)           !! E and |D|^2 in x = y^2
      type(imaginary_axis_type), intent(inout) :: axis
      real(wp) :: slope(0:2*most_degree - 1), noise(0:2*most_degree - 1), term, x, f
      real(wp), allocatable :: crossings(:), touched(:)
      integer :: i, j, sign_here

      do i = 1, r%q
         if (abs(real(r%poles(i), wp)) > rounding*abs(r%poles(i))) cycle
         axis%growth = huge(1.0_wp)
         axis%growth_at = abs(r%poles(i))
         return
      end do
      if (r%p > r%q) then
         axis%growth = huge(1.0_wp)
         axis%growth_at = huge(1.0_wp)
         return
      end if
      slope = 0.0_wp
      noise = 0.0_wp
      do i = 0, most_degree
         do j = 0, most_degree
            if (i == j) cycle
            term = real(i - j, wp)*e(i)*of_d(j)
            slope(i + j - 1) = slope(i + j - 1) + term
            noise(i + j - 1) = noise(i + j - 1) + rounding*abs(term)
         end do
      end do
      call positive_zeros(slope, noise, crossings, touched, sign_here)
      do i = 1, size(crossings) + size(touched)
         if (i <= size(crossings)) then
            x = crossings(i)
         else
            x = touched(i - size(crossings))
         end if
         f = -horner(e, x)/horner(of_d, x)
         f = f/(1.0_wp + sqrt(max(0.0_wp, 1.0_wp + f)))
         if (f <= axis%growth) cycle
         axis%growth = f
         axis%growth_at = sqrt(x)
      end do
      if (r%at_infinity() - 1.0_wp <= axis%growth) return
      axis%growth = r%at_infinity() - 1.0_wp
      axis%growth_at = huge(1.0_wp)
   end subroutine find_growth

   pure real(wp) function horner(c, x)
      real(wp), intent(in) :: c(0:), x
      integer :: k
      horner = 0.0_wp
      do k = size(c) - 1, 0, -1
         horner = horner*x + c(k)
      end do
   end function horner

   !> All r > 0 where |R(r e^(i angle))| passes through 1
   pure subroutine ray_crossings(r, angle, crossings, touched, first_sign)
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: angle                          !! radians
      real(wp), allocatable, intent(out) :: crossings(:)     !! ascending
      real(wp), allocatable, intent(out) :: touched(:)       !! where it is 1 without passing through
      integer, intent(out) :: first_sign                     !! near 0: +1 stable, -1 unstable, 0: |R| = 1 all along
      real(wp) :: e(0:2*most_degree), noise(0:2*most_degree)
      call ray_polynomial(r, cosines_of(angle), e, noise)
      call positive_zeros(e, noise, crossings, touched, first_sign)
   end subroutine ray_crossings

   !> cos(m angle)
   pure function cosines_of(angle) result(c)
      real(wp), intent(in) :: angle
      real(wp) :: c(0:most_degree)
      integer :: m
      do m = 0, most_degree
         c(m) = cos(m*angle)
      end do
      if (abs(angle - 0.5_wp*pi) <= epsilon(1.0_wp)) c(1::2) = 0.0_wp
   end function cosines_of

   !> |P(iy)|^2 as a polynomial in y^2.  A coefficient within its rounding errors is zero: so are the first ones of
   !> Taylor polynomials, and E then is exact for alpha near 0, too
   pure subroutine axis_square(p, square, noise)
      real(wp), intent(in) :: p(0:most_degree)
      real(wp), intent(out) :: square(0:most_degree), noise(0:most_degree)
      real(wp) :: term
      integer :: k, m
      square = 0.0_wp
      noise = 0.0_wp
      do m = 0, most_degree
         do k = max(0, 2*m - most_degree), min(2*m, most_degree)
            term = p(k)*p(2*m - k)
            square(m) = square(m) + (-1)**(m - k)*term
            noise(m) = noise(m) + rounding*abs(term)
         end do
         if (abs(square(m)) > noise(m)) cycle
         square(m) = 0.0_wp
         noise(m) = 0.0_wp
      end do
   end subroutine axis_square

   !> |D|^2 - |N|^2 on a ray: sum over j and k of (d(j) d(k) - n(j) n(k)) cos((j - k) theta) r^(j + k)
   pure subroutine ray_polynomial(r, cosines, e, noise)
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: cosines(0:)                    !! cos(m theta)
      real(wp), intent(out) :: e(0:), noise(0:)
      real(wp) :: of_d, of_n
      integer :: j, k
      e = 0.0_wp
      noise = 0.0_wp
      do k = 0, most_degree
         do j = 0, most_degree
            of_d = r%den(j)*r%den(k)
            of_n = r%num(j)*r%num(k)
            e(j + k) = e(j + k) + (of_d - of_n)*cosines(abs(j - k))
            noise(j + k) = noise(j + k) + rounding*(abs(of_d) + abs(of_n))
         end do
      end do
   end subroutine ray_polynomial
end module dynstep_stability_facts
