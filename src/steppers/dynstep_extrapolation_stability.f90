! SPDX-License-Identifier: BSD-3-Clause
!> Stability of extrapolated Newmark, gamma = 1/2, on q'' + 2 xi omega q' + omega^2 q = 0.
!>
!> One base step with omega h = z multiplies u = [q; q'/omega] by
!>
!>   R(z) = sum over j of w(j) A(z/n(j))^n(j),   w of eq. (19) for any sequence n
!>
!> where A is Newmark's map, eq. (37) of Austin 1991 with epsilon (the paper prints gamma) in A1(1,2):
!>
!>   A1 = [1 + beta z^2    2 beta xi z^2]     A2 = [1 - b z^2   z - 2 b xi z^2]
!>        [z/2             1 + xi z     ]          [-z/2        1 - xi z      ]    b = 1/2 - beta
!>
!> PROGRAMMING INTERFACE
!>
!>   stability_limit(numbers, beta, damping_ratio)        first z at which a motion grows
!>   growth_per_step(numbers, beta, damping_ratio, z)     spectral radius of R(z), minus 1
!>   safe_step(numbers, beta, growth)                     a z below that limit, at once
!>   first_growth(numbers, beta, damping_ratio, growth, z)  where growth begins below a given z, by a few looks
!>   small_step_growth(levels, beta)                      C in |R|^2 = 1 + C z^(2P+2)/prod(n^2) + ...
!>
!>   Implicit midpoint is Newmark's method with beta = 1/4 here: the maps of a linear system
!>   are the same.  Theory and tables: docs/theory/newmark-extrapolation.md.
module dynstep_extrapolation_stability
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: first_growth, growth_per_step, safe_step, small_step_growth, stability_limit

   !> Twice the working precision: without damping, |R| - 1 is far below the rounding errors of
   !> R in working precision (4e-17 a step in Austin's long run).  Only + - * / are used, which
   !> need no further library.
   integer, parameter :: qp = selected_real_kind(30)

   !> |R| > 1 + threshold counts as growth: 1e-12 a step makes a motion 1e-6 larger after 1e6
   real(wp), parameter :: default_threshold = 1.0e-12_wp

   !> Where the search begins and ends.  Below 1e-3, growth is below 1e-20.
   real(wp), parameter :: first_z = 1.0e-3_wp, last_z = 1.0e8_wp

   !> Points of the search in each decade of z; peaks between them are climbed.  30 find all 168
   !> limits of the tests, 20 miss one.
   integer, parameter :: points_per_decade = 150

   !> Windows of growth narrower than this part of z do not count.  For beta /= 1/4 there are such
   !> windows at omega h = pi, 2 pi, ..., down to a width of 1e-12.
   real(wp), parameter :: narrowest = 1.0e-6_wp

contains

   !> Smallest z at which a motion grows by more than `threshold` a step; huge() where none is
   !> found up to 1e8
   pure function stability_limit(numbers, beta, damping_ratio, threshold) result(limit)
      integer, intent(in) :: numbers(:)               !! substeps of the levels, increasing
      real(wp), intent(in) :: beta                    !! of Newmark's method, >= 0
      real(wp), intent(in) :: damping_ratio           !! xi >= 0
      real(wp), intent(in), optional :: threshold     !! > 0, default 1e-12
      real(wp) :: limit, z(3), peak
      real(qp) :: e(2, 3), r
      integer :: i, k

      r = 1.0_qp + real(default_threshold, qp)
      if (present(threshold)) r = 1.0_qp + real(threshold, qp)
      limit = huge(limit)
      z = first_z
      e = spread(excess(numbers, beta, damping_ratio, first_z, r), 2, 3)
      do i = 1, nint(points_per_decade*log10(last_z/first_z))
         z = [z(2:), first_z*10.0_wp**(real(i, wp)/points_per_decade)]
         e(:, :2) = e(:, 2:)
         e(:, 3) = excess(numbers, beta, damping_ratio, z(3), r)
         do k = 1, 2
            if (.not. may_peak(e(k, :))) cycle
            peak = climb(numbers, beta, damping_ratio, r, k, z(1), z(3))
            if (any(excess(numbers, beta, damping_ratio, peak*(1.0_wp - narrowest), r) > 0.0_qp) .or. &
               & any(excess(numbers, beta, damping_ratio, peak*(1.0_wp + narrowest), r) > 0.0_qp)) &
               & limit = min(limit, first_crossing(numbers, beta, damping_ratio, r, z(1), peak))
         end do
         if (limit < huge(limit)) return
         if (all(e(:, 3) <= 0.0_qp)) cycle
         limit = first_crossing(numbers, beta, damping_ratio, r, z(2), z(3))
         return
      end do
   end function stability_limit

   !> Both positive parts tell of a root of x^2 - T x + D, the characteristic polynomial of R,
   !> outside |x| <= r
   pure function excess(numbers, beta, damping_ratio, z, r)
      integer, intent(in) :: numbers(:)
      real(wp), intent(in) :: beta, damping_ratio, z
      real(qp), intent(in) :: r
      real(qp) :: excess(2), t, d
      call invariants(numbers, beta, damping_ratio, z, t, d)
      excess = [abs(d) - r**2, abs(t) - r - d/r]
   end function excess

   !> True where the middle one of three values is the largest, and the parabola through them,
   !> which rises above it by less than a quarter of its height over the lowest, might reach zero
   pure logical function may_peak(e)
      real(qp), intent(in) :: e(3)
      may_peak = e(2) >= e(1) .and. e(2) >= e(3) .and. e(2) + (e(2) - min(e(1), e(3))) > 0.0_qp
   end function may_peak

   !> Where part k of the excess is largest between two points, by golden sections
   pure function climb(numbers, beta, damping_ratio, r, k, low, high) result(peak)
      integer, intent(in) :: numbers(:)
      real(wp), intent(in) :: beta, damping_ratio, low, high
      real(qp), intent(in) :: r
      integer, intent(in) :: k
      real(wp) :: peak, a, b, c, d
      real(qp) :: at_c(2), at_d(2)
      real(wp), parameter :: golden = 0.6180339887498949_wp
      a = low
      b = high
      do
         c = b - golden*(b - a)
         d = a + golden*(b - a)
         at_c = excess(numbers, beta, damping_ratio, c, r)
         at_d = excess(numbers, beta, damping_ratio, d, r)
         if (at_c(k) > at_d(k)) then
            peak = c
            b = d
         else
            peak = d
            a = c
         end if
         if (max(at_c(k), at_d(k)) > 0.0_qp .or. b - a <= 0.1_wp*narrowest*b) return
      end do
   end function climb

   !> Bisection down to neighbouring numbers; no excess at `low`, excess at `high`
   pure function first_crossing(numbers, beta, damping_ratio, r, low, high) result(z)
      integer, intent(in) :: numbers(:)
      real(wp), intent(in) :: beta, damping_ratio, low, high
      real(qp), intent(in) :: r
      real(wp) :: z, left, middle
      left = low
      z = high
      do
         middle = 0.5_wp*(left + z)
         if (.not. (middle > left .and. middle < z)) exit
         if (any(excess(numbers, beta, damping_ratio, middle, r) > 0.0_qp)) then
            z = middle
         else
            left = middle
         end if
      end do
   end function first_crossing

   !> Spectral radius of R(z), minus 1, with nearly all its digits also where it is tiny;
   !> huge() where it overflows
   pure function growth_per_step(numbers, beta, damping_ratio, z)
      integer, intent(in) :: numbers(:)               !! substeps of the levels, increasing
      real(wp), intent(in) :: beta, damping_ratio
      real(wp), intent(in) :: z                       !! omega h of the base step
      real(wp) :: growth_per_step
      real(qp) :: t, d, discriminant, radius_1

      call invariants(numbers, beta, damping_ratio, z, t, d)
      discriminant = 0.25_qp*t**2 - d
      if (discriminant < 0.0_qp) then
         radius_1 = (d - 1.0_qp)/(1.0_qp + root(d))           ! conjugate pair: |x|^2 = D
      else
         radius_1 = abs(0.5_qp*t) + root(discriminant) - 1.0_qp
      end if
      growth_per_step = real(min(radius_1, real(huge(1.0_wp), qp)), wp)
   end function growth_per_step

   !> Square root: a Newton step from the one in working precision.  0 below 1e-300, where the
   !> radius is of no interest, and huge above 1e300
   pure function root(x)
      real(qp), intent(in) :: x     !! >= 0
      real(qp) :: root
      if (x < 1.0e-300_qp) then
         root = 0.0_qp
      else if (x > 1.0e300_qp) then
         root = real(huge(1.0_wp), qp)
      else
         root = real(sqrt(real(x, wp)), qp)
         root = 0.5_qp*(root + x/root)
      end if
   end function root

   !> Trace and determinant of R(z)
   pure subroutine invariants(numbers, beta, damping_ratio, z, trace, determinant)
      integer, intent(in) :: numbers(:)
      real(wp), intent(in) :: beta, damping_ratio, z
      real(qp), intent(out) :: trace, determinant
      real(qp) :: r(2, 2)
      integer :: j

      r = 0.0_qp
      do j = 1, size(numbers)
         r = r + weight(numbers, j)*power(newmark_map(beta, damping_ratio, real(z, qp)/numbers(j)), numbers(j))
      end do
      trace = r(1, 1) + r(2, 2)
      determinant = r(1, 1)*r(2, 2) - r(1, 2)*r(2, 1)
   end subroutine invariants

   !> Weight of a level, as in dynstep_sequences, in twice the precision
   pure function weight(numbers, j)
      integer, intent(in) :: numbers(:), j
      real(qp) :: weight
      integer :: i
      weight = 1.0_qp
      do i = 1, size(numbers)
         if (i /= j) weight = weight*(real(numbers(j)**2, qp)/real(numbers(j)**2 - numbers(i)**2, qp))
      end do
   end function weight

   !> A = A1^-1 A2
   pure function newmark_map(beta, damping_ratio, z) result(a)
      real(wp), intent(in) :: beta, damping_ratio
      real(qp), intent(in) :: z
      real(qp) :: a(2, 2), a1(2, 2), a2(2, 2), b, xi
      b = 0.5_qp - beta
      xi = damping_ratio
      a1 = reshape([1.0_qp + beta*z**2, 0.5_qp*z, 2.0_qp*beta*xi*z**2, 1.0_qp + xi*z], [2, 2])
      a2 = reshape([1.0_qp - b*z**2, -0.5_qp*z, z - 2.0_qp*b*xi*z**2, 1.0_qp - xi*z], [2, 2])
      a(1, :) = (a1(2, 2)*a2(1, :) - a1(1, 2)*a2(2, :))/(a1(1, 1)*a1(2, 2) - a1(1, 2)*a1(2, 1))
      a(2, :) = (a1(1, 1)*a2(2, :) - a1(2, 1)*a2(1, :))/(a1(1, 1)*a1(2, 2) - a1(1, 2)*a1(2, 1))
   end function newmark_map

   !> A^n by squaring
   pure function power(a, n) result(product)
      real(qp), intent(in) :: a(2, 2)
      integer, intent(in) :: n      !! >= 1
      real(qp) :: product(2, 2), square(2, 2)
      integer :: left
      product = reshape([1.0_qp, 0.0_qp, 0.0_qp, 1.0_qp], [2, 2])
      square = a
      left = n
      do
         if (mod(left, 2) == 1) product = matmul(square, product)
         left = left/2
         if (left == 0) exit
         square = matmul(square, square)
      end do
   end function power

   !> C of P levels without damping, the same for every sequence:
   !>
   !>   |R(z)|^2 = 1 + C z^(2P+2)/(n(1)^2 ... n(P)^2) + ...
   !>   C = (-1)^P [x^P] {(g - 1)^2 - 2 g e},  [x^P]: the coefficient of x^P
   !>
   !> where x = z^2 of a substep, g(x) its phase over z, and 1 + e(x) the mean of its ellipse's
   !> axis ratio and the inverse of that.  Positive: growth.
   pure function small_step_growth(levels, beta) result(c)
      integer, intent(in) :: levels       !! P >= 1
      real(wp), intent(in) :: beta        !! of Newmark's method
      real(wp) :: c, g(0:levels), e(0:levels)
      integer :: k

      g = phase_series(levels, beta)
      e = ellipse_series(levels, beta)
      c = -2.0_wp*e(levels)
      do k = 1, levels - 1
         c = c + g(k)*g(levels - k) - 2.0_wp*g(k)*e(levels - k)
      end do
      c = (-1)**levels*c
   end function small_step_growth

   !> A z below which no undamped motion grows by more than `growth` a step, in no time: half of what the leading term of
   !> `small_step_growth` gives, and 1/2 at most.  Tested against the limits of all sequences of up to 12 levels.
   pure real(wp) function safe_step(numbers, beta, growth)
      integer, intent(in) :: numbers(:)
      real(wp), intent(in) :: beta
      real(wp), intent(in) :: growth                  !! > 0
      real(wp) :: c
      integer :: levels
      levels = size(numbers)
      safe_step = 0.5_wp
      ! where it vanishes (beta = 1/6, two levels) the next term counts, and 1e-3 stands for it
      c = max(small_step_growth(levels, beta), 1.0e-3_wp)
      safe_step = min(safe_step, 0.5_wp*(sqrt(2.0_wp*growth/c)*product(real(numbers, wp)))**(1.0_wp/real(levels + 1, wp)))
   end function safe_step

   !> Where a motion grows by more than `growth` a step first, on a coarse grid below z; huge() where it does at none of its
   !> points.  Some 20 microseconds where `stability_limit`, which misses no window, takes 10 milliseconds and more.
   pure real(wp) function first_growth(numbers, beta, damping_ratio, growth, z) result(limit)
      integer, intent(in) :: numbers(:)
      real(wp), intent(in) :: beta, damping_ratio
      real(wp), intent(in) :: growth                  !! > 0
      real(wp), intent(in) :: z                       !! omega h of the highest frequency
      integer, parameter :: looks = 12, halvings = 12
      real(wp) :: low, high, middle
      integer :: k
      limit = huge(limit)
      low = safe_step(numbers, beta, growth)
      if (z <= low) return
      do k = 1, looks
         high = z*(safe_step(numbers, beta, growth)/z)**(real(looks - k, wp)/looks)
         if (growth_per_step(numbers, beta, damping_ratio, high) > growth) exit
         low = high
      end do
      if (k > looks) return
      do k = 1, halvings
         middle = 0.5_wp*(low + high)
         if (growth_per_step(numbers, beta, damping_ratio, middle) > growth) then
            high = middle
         else
            low = middle
         end if
      end do
      limit = low
   end function first_growth

   !> g(x) = 2 arcsin(u)/sqrt(x), u = sqrt(x)/2/sqrt(1 + beta x): the series of the arcsine, in each
   !> term the binomial series of (1 + beta x)^-(m+1/2)
   pure function phase_series(terms, beta) result(g)
      integer, intent(in) :: terms
      real(wp), intent(in) :: beta
      real(wp) :: g(0:terms), s, binomial
      integer :: m, j
      g = 0.0_wp
      s = 1.0_wp                                   ! (2m)!/(16^m m!^2)
      do m = 0, terms
         binomial = 1.0_wp
         do j = 0, terms - m
            g(m + j) = g(m + j) + s/(2*m + 1)*binomial
            binomial = -binomial*beta*(m + 0.5_wp + j)/(j + 1)
         end do
         s = s*(2*m + 1)/(8.0_wp*(m + 1))
      end do
   end function phase_series

   !> e(x) = (kappa + 1/kappa)/2 - 1 = (1 + y/2) (1 + y)^-1/2 - 1,  y = (beta - 1/4) x
   pure function ellipse_series(terms, beta) result(e)
      integer, intent(in) :: terms
      real(wp), intent(in) :: beta
      real(wp) :: e(0:terms), y, binomial
      integer :: k
      y = beta - 0.25_wp
      e = 0.0_wp
      binomial = 1.0_wp                            ! coefficient of x^k in (1 + y)^-1/2
      do k = 1, terms
         e(k) = 0.5_wp*y*binomial
         binomial = -binomial*y*(k - 0.5_wp)/k
         e(k) = e(k) + binomial
      end do
   end function ellipse_series
end module dynstep_extrapolation_stability
