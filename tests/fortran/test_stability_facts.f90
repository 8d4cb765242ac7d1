! SPDX-License-Identifier: BSD-3-Clause
!> Stability of rational approximations: against an independent study (60 digits), against theory for Pade's, and
!> against looking at many points.
module test_stability_facts
   use dynstep_kinds, only: wp
   use dynstep_positive_zeros, only: positive_zeros
   use dynstep_rational, only: fehlberg_rational, most_pade, most_taylor, pade_rational, rational_of, rational_type, &
      & taylor_rational
   use dynstep_stability_domain, only: find_domain, stability_domain_type
   use dynstep_stability_facts, only: find_facts, stability_facts_type
   use dynstep_stability_windows, only: alpha_windows, family_fehlberg, property_a_stable, property_f_stable, &
      & property_i_stable, property_l_stable
   use dynstep_status, only: dynstep_invalid_input, status_type
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_stability_facts

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   subroutine collect_stability_facts(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('positive-zeros', test_positive_zeros), &
         & new_unittest('taylor-4-5', test_taylor_4_5), &
         & new_unittest('taylor-5-5', test_taylor_5_5), &
         & new_unittest('fehlberg', test_fehlberg), &
         & new_unittest('windows', test_windows), &
         & new_unittest('windows-of-all', test_windows_of_all), &
         & new_unittest('pade', test_pade), &
         & new_unittest('literal-125', test_literal), &
         & new_unittest('any-rational', test_any_rational), &
         & new_unittest('pocket', test_pocket), &
         & new_unittest('boundaries', test_boundaries), &
         & new_unittest('refusals', test_refusals)]
   end subroutine collect_stability_facts

   !> (x - 1)^2 (x - 2) (x - 1e3) (x^2 + 1) and friends
   subroutine test_positive_zeros(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), allocatable :: crossings(:), touched(:), c(:)
      integer :: first_sign
      allocate (c(0:6))
      c(:) = times(times([1.0_wp, -2.0_wp, 1.0_wp], [-2.0_wp, 1.0_wp]), times([-1.0e3_wp, 1.0_wp], [1.0_wp, 0.0_wp, 1.0_wp]))
      call positive_zeros(c, 8*epsilon(1.0_wp)*abs(c), crossings, touched, first_sign)
      call check(error, first_sign, 1, 'sign near 0')
      call check(error, size(crossings), 2, 'crossings')
      call check(error, size(touched), 1, 'touched')
      if (allocated(error)) return
      call check(error, touched(1), 1.0_wp, 'double zero', thr=1.0e-6_wp)       ! the root of the rounding error
      call check(error, crossings(1), 2.0_wp, 'simple zero', thr=1.0e-12_wp)
      call check(error, crossings(2), 1.0e3_wp, 'far zero', thr=1.0e-9_wp)
      ! -x^3 times the same, and zeros that are near but not within the rounding error
      deallocate (c)
      allocate (c(0:5))
      c(:) = times([0.0_wp, 0.0_wp, 0.0_wp, -1.0_wp], times([-1.0_wp, 1.0_wp], [-1.0_wp - 1.0e-5_wp, 1.0_wp]))
      call positive_zeros(c, 8*epsilon(1.0_wp)*abs(c), crossings, touched, first_sign)
      call check(error, first_sign, -1, 'sign near 0 after x^3')
      call check(error, size(crossings), 2, 'two near zeros')
      if (allocated(error)) return
      call check(error, crossings(2) - crossings(1), 1.0e-5_wp, 'their distance', thr=1.0e-9_wp)
      ! x^2 - 2 x + 1 - d: a crossing or a touch as d is above the error or not
      c(0:2) = [1.0_wp, -2.0_wp, 1.0_wp]
      call positive_zeros(c(0:2), [1.0e-3_wp, 0.0_wp, 0.0_wp], crossings, touched, first_sign)
      call check(error, size(touched) == 1 .and. size(crossings) == 0, 'touched within the error')
      c(0) = 1.0_wp - 1.0e-2_wp
      call positive_zeros(c(0:2), [1.0e-3_wp, 0.0_wp, 0.0_wp], crossings, touched, first_sign)
      call check(error, size(touched) == 0 .and. size(crossings) == 2, 'crossings beyond the error')
      call positive_zeros(times([-1.0e-30_wp, 1.0_wp], [-1.0e30_wp, 1.0_wp]), [0.0_wp, 0.0_wp, 0.0_wp], crossings, touched, &
         & first_sign)
      call check(error, size(crossings), 2, 'zeros of very different sizes')
      if (allocated(error)) return
      call check(error, crossings(1), 1.0e-30_wp, 'the small one', thr=1.0e-15_wp, rel=.true.)
      call check(error, crossings(2), 1.0e30_wp, 'the large one', thr=1.0e-15_wp, rel=.true.)
      call positive_zeros([0.0_wp, 1.0e-20_wp], [1.0_wp, 1.0_wp], crossings, touched, first_sign)
      call check(error, first_sign, 0, 'zero polynomial')
   end subroutine test_positive_zeros

   pure function times(a, b) result(c)
      real(wp), intent(in) :: a(0:), b(0:)
      real(wp) :: c(0:size(a) + size(b) - 2)
      integer :: i, j
      c = 0.0_wp
      do i = 0, size(a) - 1
         do j = 0, size(b) - 1
            c(i + j) = c(i + j) + a(i)*b(j)
         end do
      end do
   end function times

   !> A(phi) by Newton's method with 30 digits, max |R(iy)| - 1 to 0.001, |R(infinity)| and where |R| = 1 on the
   !> positive real axis as the study prints them
   subroutine check_row(error, r, angle, growth, at_infinity, positive)
      type(error_type), allocatable, intent(inout) :: error
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: angle
      real(wp), intent(in), optional :: growth, at_infinity, positive
      type(stability_facts_type) :: facts
      type(status_type) :: status
      call find_facts(r, facts, status)
      call check(error, .not. status%failed(), status%message)
      call check(error, facts%angle, angle, 'angle', thr=2.0e-10_wp)
      if (present(growth)) call check(error, facts%axis%growth, growth, 'growth', thr=0.0005001_wp)
      if (present(at_infinity)) call check(error, facts%r_infinity, at_infinity, 'R(infinity)', thr=0.000005001_wp)
      if (present(positive)) call check(error, facts%positive_limit, positive, 'on the real axis', thr=0.000005001_wp)
      call check(error, .not. (facts%is_a_stable .or. facts%is_l_stable .or. facts%is_f_stable), 'not A-stable')
   end subroutine check_row

   !> alpha, angle, growth (-1: not told), |R(infinity)|, positive limit (-1: not told)
   subroutine check_table(error, p, q, rows)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: p, q              !! 0, 0: the pair of Fehlberg
      real(wp), intent(in) :: rows(:, :)
      type(rational_type) :: r
      type(status_type) :: status
      integer :: i
      do i = 1, size(rows, 2)
         if (p > 0) call taylor_rational(p, q, rows(1, i), r, status)
         if (p == 0) call fehlberg_rational(rows(1, i), r, status)
         call check_row(error, r, rows(2, i), at_infinity=rows(4, i))
         if (rows(3, i) >= 0.0_wp) call check_row(error, r, rows(2, i), growth=rows(3, i))
         if (rows(5, i) >= 0.0_wp) call check_row(error, r, rows(2, i), positive=rows(5, i))
      end do
   end subroutine check_table

   subroutine test_taylor_4_5(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(stability_facts_type) :: facts
      type(status_type) :: status
      call check_table(error, 4, 5, reshape([ &
         & 0.1_wp, 79.488607741032_wp, 0.923_wp, 0.0_wp, 3.81187_wp, &
         & 0.3_wp, 80.388481382136_wp, 0.867_wp, 0.0_wp, 6.35580_wp, &
         & 0.4_wp, 82.031443158251_wp, 0.389_wp, 0.0_wp, 10.05727_wp, &
         & 0.44_wp, 84.749969706936_wp, 0.0_wp, 0.0_wp, -1.0_wp, &
         & 0.4486_wp, 84.867452370935_wp, 0.0_wp, 0.0_wp, -1.0_wp, &
         & 0.47_wp, 81.491279691260_wp, 0.738_wp, 0.0_wp, 16.61666_wp, &
         & 0.5_wp, 75.163690962294_wp, 2.857_wp, 0.0_wp, 22.01371_wp], [5, 7]))
      call taylor_rational(4, 5, 0.47_wp, r, status)
      call find_facts(r, facts, status)
      call check(error, facts%axis%growth_at, 6.07_wp, 'where it grows most', thr=0.005_wp)
      call check(error, size(facts%left_poles), 1, 'a pair of poles on the left')
      if (allocated(error)) return
      call check(error, abs(facts%left_poles(1) - (-0.2398064_wp, 3.1283350_wp)/0.53_wp), 0.0_wp, 'the pole', thr=2.0e-7_wp)
      call check(error, facts%real_limit, huge(1.0_wp), 'stable on the negative real axis')
      call taylor_rational(4, 5, 0.44_wp, r, status)
      call find_facts(r, facts, status)
      call check(error, facts%is_i_stable .and. .not. facts%is_a_stable, 'stable on the axis, but not left of it')
      call taylor_rational(4, 5, 0.2_wp, r, status)
      call find_facts(r, facts, status)
      call check(error, facts%positive_limit, 4.72636_wp, 'alpha 0.2 on the real axis', thr=0.000005001_wp)
   end subroutine test_taylor_4_5

   subroutine test_taylor_5_5(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(stability_facts_type) :: facts
      type(status_type) :: status
      call check_table(error, 5, 5, reshape([ &
         & 0.1_wp, 79.488727487088_wp, 0.923_wp, 1.7e-5_wp, 3.81190_wp, &
         & 0.3_wp, 80.313739430554_wp, 0.929_wp, 0.01446_wp, 6.41057_wp, &
         & 0.4_wp, 80.470088277402_wp, 0.896_wp, 0.13169_wp, 11.14641_wp, &
         & 0.44_wp, 80.259737817205_wp, 0.740_wp, 0.29945_wp, -1.0_wp, &
         & 0.4486_wp, 80.161580040610_wp, 0.674_wp, 0.35642_wp, -1.0_wp, &
         & 0.47_wp, 79.713650321643_wp, 0.442_wp, 0.54842_wp, 33.79419_wp, &
         & 0.5_wp, 77.711833475384_wp, 0.0_wp, 1.0_wp, -1.0_wp], [5, 7]))
      call taylor_rational(5, 5, 0.5_wp, r, status)
      call find_facts(r, facts, status)
      call check(error, facts%axis%is_unit .and. facts%is_i_stable, '|R(iy)| = 1 at alpha 1/2')
      call check(error, .not. facts%is_f_stable, 'but a pole on the left')
   end subroutine test_taylor_5_5

   subroutine test_fehlberg(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(stability_facts_type) :: facts
      type(status_type) :: status
      call check_table(error, 0, 0, reshape([ &
         & 0.1_wp, 79.410002429745_wp, -1.0_wp, 2.0e-6_wp, -1.0_wp, &
         & 0.3_wp, 80.225371039200_wp, -1.0_wp, 0.00620_wp, -1.0_wp, &
         & 0.4_wp, 80.387886763228_wp, -1.0_wp, 0.08779_wp, -1.0_wp, &
         & 0.44_wp, 80.173640495530_wp, -1.0_wp, 0.23528_wp, -1.0_wp, &
         & 0.4486_wp, 80.073208618059_wp, -1.0_wp, 0.28997_wp, -1.0_wp, &
         & 0.47_wp, 79.628984971966_wp, -1.0_wp, 0.48633_wp, -1.0_wp, &
         & 0.5_wp, 77.858558680511_wp, 0.0_wp, 1.0_wp, -1.0_wp], [5, 7]))
      call fehlberg_rational(0.499_wp, r, status)
      call find_facts(r, facts, status)
      call check(error, facts%axis%growth, 1.1e-2_wp, 'growth at 0.499', thr=0.5e-3_wp)
      call fehlberg_rational(0.5_wp - 1.0e-6_wp, r, status)
      call find_facts(r, facts, status)
      call check(error, facts%axis%growth, 1.1e-5_wp, 'growth at 1/2 - 1e-6', thr=0.5e-6_wp)
   end subroutine test_fehlberg

   !> The windows of alpha of the study
   subroutine test_windows(error)
      type(error_type), allocatable, intent(out) :: error
      call check_windows(error, 1, 1, property_i_stable, [0.0_wp, 0.5_wp])
      call check_windows(error, 1, 1, property_a_stable, [0.0_wp, 0.5_wp])
      call check_windows(error, 1, 1, property_f_stable, [0.5_wp, 0.5_wp])
      call check_windows(error, 1, 1, property_l_stable, [0.0_wp, 0.0_wp])
      call check_windows(error, 2, 2, property_a_stable, [0.0_wp, 0.5_wp])
      call check_windows(error, 2, 2, property_l_stable, [0.0_wp, 0.0_wp])
      call check_windows(error, 3, 3, property_a_stable, [0.5_wp, 0.5_wp])
      call check_windows(error, 4, 4, property_a_stable, [0.5_wp, 0.5_wp])
      call check_windows(error, 4, 4, property_f_stable, [0.5_wp, 0.5_wp])
      call check_windows(error, 3, 3, property_l_stable, [real(wp) ::])
      call check_windows(error, 4, 5, property_i_stable, [0.4362200209669922_wp, 0.4486146148450476_wp])
      call check_windows(error, 4, 5, property_a_stable, [real(wp) ::])
      call check_windows(error, 5, 5, property_i_stable, [0.5_wp, 0.5_wp])
      call check_windows(error, 5, 5, property_a_stable, [real(wp) ::])
      call check_windows(error, 5, 5, property_f_stable, [real(wp) ::])
      call check_windows(error, 6, 6, property_i_stable, [0.0_wp, 0.5_wp])
      call check_windows(error, 6, 6, property_a_stable, [real(wp) ::])
      call check_windows(error, 0, 0, property_i_stable, [0.5_wp, 0.5_wp], family_fehlberg)
      call check_windows(error, 0, 0, property_a_stable, [real(wp) ::], family_fehlberg)
      ! not for any alpha > 0; at 0 (1,2) is the backward method
      call check_windows(error, 1, 2, property_i_stable, [0.0_wp, 0.0_wp])
      call check_windows(error, 2, 3, property_i_stable, [real(wp) ::])
      call check_windows(error, 3, 4, property_i_stable, [real(wp) ::])
   end subroutine test_windows

   subroutine check_windows(error, p, q, property, expected, halves)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: p, q, property
      real(wp), intent(in) :: expected(:)
      integer, intent(in), optional :: halves
      real(wp), allocatable :: windows(:, :)
      type(status_type) :: status
      character(len=40) :: what
      integer :: i
      write (what, '("(", i0, ",", i0, "), property ", i0)') p, q, property
      call alpha_windows(p, q, property, windows, status, halves)
      call check(error, .not. status%failed(), status%message)
      call check(error, size(windows), size(expected), trim(what)//' has other windows')
      if (allocated(error)) return
      do i = 1, size(expected)
         call check(error, windows(1 + modulo(i - 1, 2), (i + 1)/2), expected(i), what, thr=1.0e-10_wp)
      end do
   end subroutine check_windows

   !> All (p, q): stable on the axis at alpha within a window and not beside it, looking at 400 points
   subroutine test_windows_of_all(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      type(stability_facts_type) :: facts
      real(wp), parameter :: alphas(4) = [0.0625_wp, 0.375_wp, 0.4425_wp, 0.875_wp]
      real(wp) :: largest
      character(len=40) :: what
      integer :: p, q, i, k
      do p = 0, most_taylor
         do q = 0, most_taylor
            do i = 1, size(alphas)
               call taylor_rational(p, q, alphas(i), r, status)
               call find_facts(r, facts, status)
               largest = 0.0_wp
               do k = -200, 200
                  largest = max(largest, abs(r%value(cmplx(0.0_wp, 10.0_wp**(k/100.0_wp), wp))) - 1.0_wp)
               end do
               write (what, '("(", i0, ",", i0, ") at alpha ", f7.4)') p, q, alphas(i)
               ! round-off may pass for growth where there is none; a smaller one than at the points, never
               call check(error, largest - facts%axis%growth <= 1.0e-12_wp*largest + 1.0e-14_wp, trim(what)//': grows more')
               call check(error, .not. (facts%is_i_stable .and. largest > 1.0e-14_wp), trim(what)//' is not stable')
               if (p <= q) call check(error, largest >= 0.9_wp*facts%axis%growth - 2.0e-7_wp .or. &
                  & facts%axis%growth_at > 100.0_wp, trim(what)//': grows less')
            end do
         end do
      end do
   end subroutine test_windows_of_all

   !> Pade's (p, q) is A-stable for q = p, p + 1, p + 2 and for no other; F-stable for q = p, L-stable for the rest
   subroutine test_pade(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(stability_facts_type) :: facts
      type(status_type) :: status
      character(len=20) :: what
      integer :: p, q
      do p = 0, most_pade
         do q = 0, most_pade
            call pade_rational(p, q, r, status)
            call find_facts(r, facts, status)
            write (what, '("Pade(", i0, ",", i0, ")")') p, q
            call check(error, .not. status%failed(), trim(what)//': '//status%message)
            call check(error, facts%is_a_stable .eqv. (q >= p .and. q <= p + 2), trim(what)//': A-stable')
            call check(error, facts%is_f_stable .eqv. (q == p .and. p > 0), trim(what)//': F-stable')
            call check(error, facts%is_l_stable .eqv. (q > p .and. q <= p + 2), trim(what)//': L-stable')
            call check(error, abs(facts%angle - 90.0_wp) <= 0.0_wp .eqv. facts%is_a_stable, trim(what)//': angle')
            if (q > p) call check(error, facts%angle > 88.0_wp .or. q > p + 3, trim(what)//': nearly A-stable')
         end do
      end do
      ! Pade(0,3): E = x^2 (x - 3)/36
      call pade_rational(0, 3, r, status)
      call find_facts(r, facts, status)
      call check(error, size(facts%axis%intervals, 2), 1, 'one interval')
      if (allocated(error)) return
      call check(error, facts%axis%intervals(1, 1), sqrt(3.0_wp), 'where it begins', thr=1.0e-15_wp)
      call check(error, facts%axis%intervals(2, 1), huge(1.0_wp), 'and does not end')
      ! RK4: [0, 2 sqrt 2] on the imaginary axis, -2.785293563405282 on the real one
      call pade_rational(4, 0, r, status)
      call find_facts(r, facts, status)
      call check(error, facts%axis%intervals(2, 1), sqrt(8.0_wp), 'RK4 on the imaginary axis', thr=1.0e-14_wp)
      call check(error, facts%real_limit, 2.785293563405282_wp, 'RK4 on the real axis', thr=1.0e-14_wp)
   end subroutine test_pade

   !> (4,5) with 1/125, as (3.2) is printed: its poles are elsewhere, and so are all facts
   subroutine test_literal(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r, printed
      type(stability_facts_type) :: facts
      type(status_type) :: status
      call taylor_rational(4, 5, 0.44_wp, r, status)
      call rational_of(r%num(:4), [r%den(:4), r%den(5)*(120.0_wp/125.0_wp)], printed, status)
      call find_facts(printed, facts, status)
      call check(error, size(facts%left_poles), 1, 'a pair on the left')
      if (allocated(error)) return
      call check(error, abs(facts%left_poles(1) - (-0.1991340_wp, 3.1270017_wp)/0.56_wp), 0.0_wp, 'pole', thr=2.0e-7_wp)
      call check(error, .not. facts%is_i_stable, 'no window')
   end subroutine test_literal

   !> Intervals, angle and crossings of any R, against signs at many points
   subroutine test_any_rational(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(stability_facts_type) :: facts
      type(stability_domain_type) :: domain
      type(status_type) :: status
      real(wp) :: num(0:6), den(0:6), y, size_of_r, threshold
      logical :: inside
      integer :: case, i, j, k, p, q, compared
      threshold = 1.0e-9_wp
      compared = 0
      do case = 1, 40
         p = modulo(case, 6)
         q = 1 + modulo(3*case, 6)
         num = 0.0_wp
         den = 0.0_wp
         num(0) = 1.0_wp
         den(0) = 1.0_wp
         do k = 1, 6
            if (k <= p) num(k) = num(k - 1)*0.5_wp/k*(1.0_wp + 0.8_wp*sin(7.0_wp*case + 3.0_wp*k))
            if (k <= q) den(k) = -den(k - 1)*0.5_wp/k*(1.0_wp + 0.8_wp*cos(5.0_wp*case + 2.0_wp*k))
         end do
         call rational_of(num(:p), den(:q), r, status)
         call find_facts(r, facts, status)
         call find_domain(r, 5, domain, status)
         call check(error, .not. status%failed(), status%message)
         if (allocated(error)) return
         do k = -150, 250
            y = 10.0_wp**(k/100.0_wp)
            size_of_r = abs(r%value(cmplx(0.0_wp, y, wp))) - 1.0_wp
            if (abs(size_of_r) < threshold) cycle
            inside = any(facts%axis%intervals(1, :) <= y .and. y <= facts%axis%intervals(2, :))
            call check(error, inside .eqv. size_of_r < 0.0_wp, 'imaginary axis')
            compared = compared + 1
            do i = 1, size(domain%angle)
               size_of_r = abs(r%value(y*exp(cmplx(0.0_wp, domain%angle(i), wp)))) - 1.0_wp
               if (abs(size_of_r) < threshold) cycle
               j = count(domain%crossing(domain%first(i):domain%first(i + 1) - 1) < y)
               call check(error, (domain%begins(i)*(-1)**j > 0) .eqv. size_of_r < 0.0_wp, 'ray')
            end do
         end do
         call check(error, all(abs(abs([(r%value(domain%point(i)), i=1, size(domain%point))]) - 1.0_wp) < 1.0e-10_wp), 'boundary')
         call check(error, domain%is_whole, 'curves are closed')
      end do
      call check(error, compared > 15000, 'points that tell something')
   end subroutine test_any_rational

   !> (4,5) at 0.47: rays 5 degrees apart meet the pocket at one angle that is no multiple of them, and one curve is
   !> the boundary of everything
   subroutine test_pocket(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(stability_domain_type) :: domain
      type(status_type) :: status
      real(wp) :: phi
      integer :: i, j
      call taylor_rational(4, 5, 0.47_wp, r, status)
      call find_domain(r, 4, domain, status)             ! 0, 60, 120, 180 degrees
      call check(error, size(domain%angle), 4 + 2 + 2, 'rays of the poles and zeros')
      if (allocated(error)) return
      j = 0
      phi = atan2(5.902519_wp, -0.452465_wp)
      do i = 1, size(domain%angle)
         if (abs(domain%angle(i) - phi) < 1.0e-6_wp .and. domain%first(i + 1) > domain%first(i)) j = i
      end do
      call check(error, j > 0, 'the pocket is met on the ray of its pole')
      if (allocated(error)) return
      call check(error, domain%first(j + 1) - domain%first(j), 2, 'in and out')
      call check(error, domain%crossing(domain%first(j)) < 5.92_wp .and. domain%crossing(domain%first(j) + 1) > 5.92_wp, &
         & 'round the pole')
   end subroutine test_pocket

   !> Each curve closes and turns R round the circle; a small method has the boundary one knows: (0,1) |1 - z| = 1
   subroutine test_boundaries(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(stability_domain_type) :: domain
      type(status_type) :: status
      complex(wp), allocatable :: value(:)
      real(wp) :: turned
      integer :: p, q, i, k
      call taylor_rational(0, 1, 0.0_wp, r, status)
      call find_domain(r, 2, domain, status)
      call check(error, all(abs(abs(1.0_wp - domain%point) - 1.0_wp) < 1.0e-12_wp), 'circle of backward Euler')
      do p = 0, most_taylor
         do q = 0, most_taylor
            if (p + q == 0) cycle
            call taylor_rational(p, q, 0.3_wp, r, status)
            call find_domain(r, 2, domain, status)
            call check(error, domain%is_whole, 'curves are closed')
            turned = 0.0_wp
            do i = 1, size(domain%first_point) - 1
               value = [(r%value(domain%point(k)), k=domain%first_point(i), domain%first_point(i + 1) - 1)]
               turned = turned + sum([(arg(value(k + 1)/value(k)), k=1, size(value) - 1)])
            end do
            ! all zeros of N - e^(i phi) D together
            call check(error, turned, 2.0_wp*pi*max(p, q), 'turns of R', thr=1.0e-8_wp)
         end do
      end do
   end subroutine test_boundaries

   elemental real(wp) function arg(z)
      complex(wp), intent(in) :: z
      arg = atan2(aimag(z), real(z, wp))
   end function arg

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(stability_facts_type) :: facts
      type(stability_domain_type) :: domain
      type(status_type) :: status
      real(wp), allocatable :: windows(:, :)
      call find_facts(r, facts, status)
      call check(error, status%code, dynstep_invalid_input, 'R not made')
      call status%clear()
      call pade_rational(1, 1, r, status)
      call find_domain(r, 1, domain, status)
      call check(error, status%code, dynstep_invalid_input, 'one ray')
      call status%clear()
      call alpha_windows(1, 1, 0, windows, status)
      call check(error, status%code, dynstep_invalid_input, 'no such property')
      call status%clear()
      call alpha_windows(7, 1, property_i_stable, windows, status)
      call check(error, status%code, dynstep_invalid_input, 'p = 7')
      call status%clear()
      call alpha_windows(1, 1, property_i_stable, windows, status, 3)
      call check(error, status%code, dynstep_invalid_input, 'no such family')
   end subroutine test_refusals
end module test_stability_facts
