! SPDX-License-Identifier: BSD-3-Clause
!> The stability domain |R(z)| <= 1 of a rational approximation in the whole plane, with no part of it missed.
!>
!>   rays       On each ray from 0 all r with |R(r e^(i theta))| = 1, as positive zeros of a polynomial
!>              (dynstep_stability_facts), on equidistant rays and through each pole and each zero of R.  A bounded
!>              unstable region has a pole in it, a bounded stable one a zero (maximum principle, for R and for 1/R),
!>              so each of them, however small, is crossed by a ray.
!>   boundary   |R| = 1 means R(z) = e^(i phi).  The zeros of N - D, where R = 1, are followed as phi goes round from 0
!>              to 2 pi: dz/dphi = i R/R'.  Round each closed curve R goes round the unit circle at least once (else log R
!>              or its inverse would be analytic within, and R constant), so each curve has such a zero on it.
!>
!>     call find_domain(r, rays, domain, status)
!>
!> The upper half-plane alone: R of the conjugate is the conjugate of R.  The curves are given whole.
module dynstep_stability_domain
   use dynstep_kinds, only: wp
   use dynstep_polynomial, only: polynomial_zeros
   use dynstep_rational, only: most_degree, rational_type
   use dynstep_stability_facts, only: find_facts, ray_crossings, stability_facts_type
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: find_domain

   real(wp), parameter :: pi = acos(-1.0_wp)

   type, public :: stability_domain_type
      type(stability_facts_type) :: facts
      real(wp), allocatable :: angle(:)           !! [rays] radians from the positive real axis, 0 .. pi, ascending
      integer, allocatable :: begins(:)           !! +1 stable near 0, -1 unstable, 0: |R| = 1 all along the ray
      integer, allocatable :: first(:)            !! [rays + 1] ray i has crossing(first(i):first(i + 1) - 1)
      real(wp), allocatable :: crossing(:)        !! r where |R| passes through 1, ascending on each ray
      integer, allocatable :: first_point(:)      !! [curves + 1] curve i is point(first_point(i):first_point(i + 1) - 1)
      complex(wp), allocatable :: point(:)        !! on |R| = 1, closed curves: the last point of each is its first again.
                                                  !! None where |R| = 1 is the imaginary axis
      logical :: is_whole = .true.                !! all curves have been closed
   end type stability_domain_type

contains

   !> Facts, rays and boundary
   pure subroutine find_domain(r, rays, domain, status)
      type(rational_type), intent(in) :: r
      integer, intent(in) :: rays                 !! equidistant ones, 0 to pi, >= 2; those of poles, zeros in addition
      type(stability_domain_type), intent(out) :: domain
      type(status_type), intent(inout) :: status
      real(wp), allocatable :: crossings(:), touched(:)
      integer :: i

      if (status%failed()) return
      if (rays < 2) call status%set(dynstep_invalid_input, 'rays = '//text(rays)//' must be 2 or more')
      call find_facts(r, domain%facts, status)
      if (status%failed()) return
      call choose_angles(r, rays, domain%angle)
      allocate (domain%first(size(domain%angle) + 1), domain%begins(size(domain%angle)), domain%crossing(0))
      domain%first(1) = 1
      do i = 1, size(domain%angle)
         call ray_crossings(r, domain%angle(i), crossings, touched, domain%begins(i))
         domain%crossing = [domain%crossing, crossings]
         domain%first(i + 1) = size(domain%crossing) + 1
      end do
      call trace_boundary(r, domain, status)
   end subroutine find_domain

   !> Equidistant angles and those of poles and zeros, ascending, each once
   pure subroutine choose_angles(r, rays, angle)
      type(rational_type), intent(in) :: r
      integer, intent(in) :: rays
      real(wp), allocatable, intent(out) :: angle(:)
      complex(wp), allocatable :: places(:)
      real(wp) :: all_of(rays + 2*most_degree), x
      integer :: i, j, count

      allocate (places(size(r%poles) + size(r%zeros)))
      places(:) = [r%poles, r%zeros]
      count = 0
      do i = 1, rays + size(places)
         if (i <= rays) then
            x = pi*(real(i - 1, wp)/real(rays - 1, wp))
         else
            x = abs(atan2(aimag(places(i - rays)), real(places(i - rays), wp)))
         end if
         if (any(abs(all_of(:count) - x) <= 4.0_wp*epsilon(1.0_wp))) cycle
         j = count
         do while (j > 0)
            if (all_of(max(j, 1)) < x) exit
            all_of(j + 1) = all_of(j)
            j = j - 1
         end do
         all_of(j + 1) = x
         count = count + 1
      end do
      angle = all_of(:count)
   end subroutine choose_angles

   !> Follow R(z) = e^(i phi) from all zeros of N - D until back there
   pure subroutine trace_boundary(r, domain, status)
      type(rational_type), intent(in) :: r
      type(stability_domain_type), intent(inout) :: domain
      type(status_type), intent(inout) :: status
      complex(wp), allocatable :: start(:), points(:)
      complex(wp) :: z
      logical, allocatable :: is_used(:)
      logical :: good
      integer :: d, i, j, k, next, turns

      allocate (domain%first_point(1), domain%point(0))
      domain%first_point = 1
      if (domain%facts%axis%is_unit) then
         ! the axis is no closed curve; those round poles in the left half-plane and their mirror images are left out
         domain%is_whole = domain%is_whole .and. .not. any(real(r%poles, wp) < 0.0_wp)
         return
      end if
      d = max(r%p, r%q)
      call starting_points(r, d, start, status)
      if (status%failed()) return
      allocate (is_used(size(start)))
      is_used = .false.
      do i = 1, size(start)
         if (is_used(i)) cycle
         points = [start(i)]
         j = i
         do turns = 1, size(start)
            is_used(j) = .true.
            z = start(j)
            call follow(r, z, points, good)
            domain%is_whole = domain%is_whole .and. good
            if (.not. good) exit
            next = 1
            do k = 2, size(start)
               if (abs(start(k) - z) < abs(start(next) - z)) next = k
            end do
            if (abs(start(next) - z) > 1.0e-6_wp*(1.0_wp + abs(z)) .or. (is_used(next) .and. next /= i)) then
               domain%is_whole = .false.
               exit
            end if
            points(size(points)) = start(next)
            j = next
            if (j == i) exit
         end do
         domain%point = [domain%point, points]
         domain%first_point = [domain%first_point, size(domain%point) + 1]
      end do
   end subroutine trace_boundary

   !> Zeros of N - D: 0 and the others, polished
   pure subroutine starting_points(r, d, start, status)
      type(rational_type), intent(in) :: r
      integer, intent(in) :: d
      complex(wp), allocatable, intent(out) :: start(:)
      type(status_type), intent(inout) :: status
      real(wp) :: c(0:d)
      complex(wp) :: step
      logical :: converged
      integer :: i, sweep
      c = r%num(:d) - r%den(:d)
      where (abs(c) <= 64.0_wp*epsilon(1.0_wp)*(abs(r%num(:d)) + abs(r%den(:d)))) c = 0.0_wp
      call polynomial_zeros(c, start, converged)
      do i = 1, size(start)
         if (.not. abs(start(i)) > 0.0_wp) cycle
         do sweep = 1, 3
            step = log(r%value(start(i)))/slope_of_log(r, start(i))
            if (abs(step) > 0.1_wp*abs(start(i))) exit
            start(i) = start(i) - step
         end do
      end do
      if (.not. converged) call status%set(dynstep_invalid_input, 'the points with R(z) = 1 were not found')
   end subroutine starting_points

   !> From R = 1 once round the unit circle; z and the new points
   pure subroutine follow(r, z, points, good)
      type(rational_type), intent(in) :: r
      complex(wp), intent(inout) :: z
      complex(wp), allocatable, intent(inout) :: points(:)
      logical, intent(out) :: good
      complex(wp) :: guess, step, middle
      complex(wp), allocatable :: new(:)
      real(wp) :: phi, d_phi, far, reach
      integer :: sweep, count, trials
      integer, parameter :: most = 4000

      far = 1.0e8_wp*(1.0_wp + sum(abs(r%poles)) + sum(abs(r%zeros)))
      allocate (new(most))
      phi = 0.0_wp
      d_phi = 0.02_wp
      count = 0
      good = .false.
      do trials = 1, 10*most
         if (count == most .or. abs(z) > far) exit
         d_phi = min(d_phi, 0.2_wp, 2.0_wp*pi - phi)
         middle = z + (0.0_wp, 0.5_wp)*d_phi/slope_of_log(r, z)
         guess = z + (0.0_wp, 1.0_wp)*d_phi/slope_of_log(r, middle)
         reach = abs(guess - z)
         step = huge(1.0_wp)
         do sweep = 1, 6
            step = log(r%value(guess)*exp((0.0_wp, -1.0_wp)*(phi + d_phi)))/slope_of_log(r, guess)
            ! a long way to the curve: it bends, or another one is near
            if (sweep == 1 .and. abs(step) > 0.02_wp*reach) exit
            guess = guess - step
            if (abs(step) <= 1.0e-13_wp*(abs(guess) + reach)) exit
         end do
         if (abs(step) > 1.0e-9_wp*(abs(guess) + reach) .or. reach > 0.05_wp*(0.5_wp + abs(z))) then
            d_phi = 0.5_wp*d_phi
            if (d_phi < 1.0e-10_wp) exit
            cycle
         end if
         z = guess
         phi = phi + d_phi
         count = count + 1
         new(count) = z
         good = phi >= 2.0_wp*pi - 1.0e-9_wp
         if (good) exit
         d_phi = 1.5_wp*d_phi
      end do
      points = [points, new(:count)]
   end subroutine follow

   !> R'/R
   pure complex(wp) function slope_of_log(r, z)
      type(rational_type), intent(in) :: r
      complex(wp), intent(in) :: z
      slope_of_log = sum(1.0_wp/(z - r%zeros)) - sum(1.0_wp/(z - r%poles))
   end function slope_of_log
end module dynstep_stability_domain
