! SPDX-License-Identifier: BSD-3-Clause
!> Rational approximations of e^z: coefficients, orders, poles, values from |z| = 1e-12 to 1e12, stages; zeros of polynomials.
module test_rational
   use dynstep, only: dynstep_invalid_input, fehlberg_rational, form_automatic, form_parallel, form_product, form_refined, &
      & pade_rational, rational_of, rational_type, status_type, taylor_rational, wp
   use dynstep_pole_stages, only: pole_stages_type
   use dynstep_polynomial, only: polynomial_zeros
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_rational

   real(wp), parameter :: eps = epsilon(1.0_wp)
   complex(wp), parameter :: imag = (0.0_wp, 1.0_wp)

contains

   subroutine collect_rational(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('coefficients', test_coefficients), &
         & new_unittest('printed-variants', test_printed), &
         & new_unittest('orders', test_orders), &
         & new_unittest('measured-orders', test_measured_orders), &
         & new_unittest('poles', test_poles), &
         & new_unittest('mirror-images', test_mirror), &
         & new_unittest('modulus-on-the-imaginary-axis', test_modulus), &
         & new_unittest('values-on-the-real-axis', test_real_axis), &
         & new_unittest('stages', test_stages), &
         & new_unittest('sums-of-weights', test_sums), &
         & new_unittest('zeros-of-polynomials', test_zeros), &
         & new_unittest('zeros-far-apart', test_zeros_apart), &
         & new_unittest('alpha-at-its-ends', test_alpha), &
         & new_unittest('refusals', test_refusals)]
   end subroutine collect_rational

   !> Small cases by hand
   subroutine test_coefficients(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      real(wp), parameter :: a = 0.25_wp
      call pade_rational(1, 1, r, status)
      call check_coefficients(error, r, [1.0_wp, 0.5_wp], [1.0_wp, -0.5_wp], 'Pade(1,1)')
      call pade_rational(0, 2, r, status)
      call check_coefficients(error, r, [1.0_wp], [1.0_wp, -1.0_wp, 0.5_wp], 'Pade(0,2)')
      call pade_rational(1, 2, r, status)
      call check_coefficients(error, r, [1.0_wp, 1/3.0_wp], [1.0_wp, -2/3.0_wp, 1/6.0_wp], 'Pade(1,2)')
      call pade_rational(3, 0, r, status)
      call check_coefficients(error, r, [1.0_wp, 1.0_wp, 0.5_wp, 1/6.0_wp], [1.0_wp], 'Pade(3,0)')
      call pade_rational(2, 2, r, status)
      call check_coefficients(error, r, [1.0_wp, 0.5_wp, 1/12.0_wp], [1.0_wp, -0.5_wp, 1/12.0_wp], 'Pade(2,2)')
      call pade_rational(3, 3, r, status)
      call check_coefficients(error, r, [1.0_wp, 0.5_wp, 0.1_wp, 1/120.0_wp], [1.0_wp, -0.5_wp, 0.1_wp, -1/120.0_wp], 'Pade(3,3)')
      call pade_rational(4, 4, r, status)
      call check_coefficients(error, r, [1.0_wp, 0.5_wp, 3/28.0_wp, 1/84.0_wp, 1/1680.0_wp], &
         & [1.0_wp, -0.5_wp, 3/28.0_wp, -1/84.0_wp, 1/1680.0_wp], 'Pade(4,4)')
      call taylor_rational(2, 3, a, r, status)
      call check_coefficients(error, r, [1.0_wp, a, a**2/2], [1.0_wp, -(1 - a), (1 - a)**2/2, -(1 - a)**3/6], 'BI(2,3)')
      call fehlberg_rational(0.5_wp, r, status)
      call check_coefficients(error, r, 0.5_wp**[0, 1, 2, 3, 4, 5, 6]/[1, 1, 2, 6, 24, 120, 2080], &
         & (-0.5_wp)**[0, 1, 2, 3, 4, 5, 6]/[1, 1, 2, 6, 24, 120, 2080], 'Fehlberg halves')
      call check(error, .not. status%failed(), 'status')
   end subroutine test_coefficients

   subroutine check_coefficients(error, r, num, den, what)
      type(error_type), allocatable, intent(inout) :: error
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: num(0:), den(0:)
      character(len=*), intent(in) :: what
      call check(error, r%p, size(num) - 1, what//', p')
      call check(error, r%q, size(den) - 1, what//', q')
      if (allocated(error)) return
      call check(error, all(abs(r%num(:r%p) - num) <= 4*eps*abs(num)), what//', numerator')
      call check(error, all(abs(r%den(:r%q) - den) <= 4*eps*abs(den)), what//', denominator')
      call check(error, .not. any(abs(r%num(r%p + 1:)) > 0) .and. .not. any(abs(r%den(r%q + 1:)) > 0), what//', the rest')
   end subroutine check_coefficients

   !> What the thesis prints beside what is right: (2.19) has 22, 24, 1620 for 28, 84, 1680, (2.22) a term (alpha z)^3/48
   !> too many, (3.2) 125 for 120
   subroutine test_printed(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      real(wp), parameter :: a = 0.44_wp, b = 1 - a
      real(wp) :: num(0:5)
      num = [1.0_wp, 1/2.0_wp, 3/22.0_wp, 1/24.0_wp, 1/1620.0_wp, 0.0_wp]
      call rational_of(num(:4), num(:4)*(-1)**[0, 1, 2, 3, 4], r, status)
      call check_order(error, r, 2, '(2.19) as printed')
      call check(error, r%is_symmetric(), '(2.19) is symmetric, misprints and all')
      num = [1.0_wp, 1/2.0_wp, 3/28.0_wp, 1/84.0_wp, 1/1680.0_wp, 0.0_wp]
      call rational_of(num(:4), num(:4)*(-1)**[0, 1, 2, 3, 4], r, status)
      call check_order(error, r, 8, '(2.19)')

      num(:3) = [1.0_wp, a, a**2/2, a**3/6 + a**3/48]
      call rational_of(num(:3), [1.0_wp, -b, b**2/2, -b**3/6], r, status)
      call check_order(error, r, 2, '(2.22) with the third-order term too many')
      num(3) = a**3/6
      call rational_of(num(:3), [1.0_wp, -b, b**2/2, -b**3/6], r, status)
      call check_order(error, r, 3, '(2.22)')

      num(:4) = [1.0_wp, a, a**2/2, a**3/6, a**4/24]
      call rational_of(num(:4), [1.0_wp, -b, b**2/2, -b**3/6, b**4/24, -b**5/125], r, status)
      call check_order(error, r, 4, '(3.2) as printed, which does not cost an order')
      call check(error, abs(rightmost(-b*r%poles) - (0.19913400194365900_wp, 3.1270017042032951_wp)) < 1.0e-12_wp, &
         & '(3.2) as printed, poles')
      num(5) = a**5/125
      call rational_of(num(:5), [1.0_wp, -b, b**2/2, -b**3/6, b**4/24, -b**5/125], r, status)
      call check_order(error, r, 4, '(3.3) as printed')
      num(5) = a**5/120
      call rational_of(num(:5), [1.0_wp, -b, b**2/2, -b**3/6, b**4/24, -b**5/120], r, status)
      call check_order(error, r, 5, '(3.3)')
      call check(error, .not. status%failed(), 'status')
   end subroutine test_printed

   subroutine check_order(error, r, expected, what)
      type(error_type), allocatable, intent(inout) :: error
      type(rational_type), intent(in) :: r
      integer, intent(in) :: expected
      character(len=*), intent(in) :: what
      real(wp) :: measured
      call check(error, r%order, expected, what)
      measured = measured_order(r)
      call check(error, measured, real(expected, wp), what//', measured', thr=0.3_wp)
   end subroutine check_order

   !> From the errors at two z on a ray, as small as rounding allows
   real(wp) function measured_order(r)
      type(rational_type), intent(in) :: r
      complex(wp), parameter :: ray = (0.6_wp, 0.8_wp)
      real(wp) :: e(2), z
      integer :: k
      z = 4.0_wp
      measured_order = 0.0_wp
      do k = 1, 40
         e = [abs(r%value(z*ray) - exp(z*ray)), abs(r%value(0.7_wp*z*ray) - exp(0.7_wp*z*ray))]
         if (e(2) < 1000*eps) return
         measured_order = log(e(1)/e(2))/log(1/0.7_wp) - 1
         z = 0.7_wp*z
      end do
   end function measured_order

   !> Order p + q of Pade; min(p, q) of the others, one more at alpha = 1/2 where that is odd and p = q, at the ends that of
   !> the half that runs
   subroutine test_orders(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      real(wp), parameter :: alphas(7) = [0.0_wp, 0.1_wp, 0.3_wp, 0.44_wp, 0.47_wp, 0.5_wp, 1.0_wp]
      integer :: i, p, q, expected
      character(len=40) :: what
      do p = 0, 8
         do q = 0, 8
            call pade_rational(p, q, r, status)
            write (what, '("Pade(", i0, ",", i0, ")")') p, q
            call check(error, r%order, p + q, what)
            call check(error, r%is_symmetric() .eqv. p == q, trim(what)//' is symmetric where p = q')
         end do
      end do
      do p = 0, 6
         do q = 0, 6
            do i = 1, size(alphas)
               call taylor_rational(p, q, alphas(i), r, status)
               write (what, '("BI(", i0, ",", i0, "), alpha ", f4.2)') p, q, alphas(i)
               expected = min(p, q)
               if (p == q .and. i == 6 .and. mod(p, 2) == 1) expected = p + 1
               if (i == 1) expected = q
               if (i == 7) expected = p
               call check(error, r%order, expected, what)
               call check(error, r%is_symmetric() .eqv. (i == 6 .and. p == q .or. r%p + r%q == 0), &
                  & trim(what)//' is symmetric at 1/2 where p = q')
            end do
         end do
      end do
      do i = 1, size(alphas)
         call fehlberg_rational(alphas(i), r, status)
         write (what, '("Fehlberg halves, alpha ", f4.2)') alphas(i)
         call check(error, r%order, merge(6, 5, i == 6), what)
      end do
      call check(error, .not. status%failed(), 'status')
   end subroutine test_orders

   !> The same orders from errors: those below 9, which double precision shows
   subroutine test_measured_orders(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      real(wp) :: measured
      integer :: i, p, q
      character(len=60) :: what
      do p = 0, 6
         do q = 0, 6
            do i = 0, 4
               if (i == 0 .and. p + q > 8) cycle
               if (i == 0) call pade_rational(p, q, r, status)
               if (i > 0) call taylor_rational(p, q, 0.25_wp*(i - 1), r, status)
               ! the term of the lower order would be too small to be seen
               if (i == 2 .and. p < q .or. i == 4 .and. p > q) cycle
               measured = measured_order(r)
               write (what, '("p, q, case ", 3i3, ": got ", f6.2, ", expected", i3)') p, q, i, measured, r%order
               if (abs(measured - r%order) > 0.4_wp) call test_failed(error, what)
            end do
         end do
      end do
   end subroutine test_measured_orders

   !> Poles that are known: zeros of Taylor polynomials and of Pade's denominators
   subroutine test_poles(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      real(wp), parameter :: b = 0.56_wp
      complex(wp) :: w
      call taylor_rational(4, 5, 0.44_wp, r, status)
      w = rightmost(-b*r%poles)
      call check_point(error, w, (0.23980639375340803_wp, 3.1283350259707102_wp), 'P_5')
      call taylor_rational(3, 4, 0.44_wp, r, status)
      call check_point(error, rightmost(-b*r%poles), (-0.27055576893229454_wp, 2.5047759043624345_wp), 'P_4')
      call taylor_rational(3, 3, 0.44_wp, r, status)
      call check_point(error, rightmost(-b*r%poles), (-0.70196418100833924_wp, 1.8073394944520219_wp), 'P_3')
      call taylor_rational(6, 6, 0.44_wp, r, status)
      call check_point(error, rightmost(-b*r%poles), (0.80361157103184664_wp, 3.6977017536291523_wp), 'P_6')
      call fehlberg_rational(0.44_wp, r, status)
      call check_point(error, rightmost(-b*r%poles), (0.28656523887298098_wp, 3.3474839465926018_wp), 'P of Fehlberg')
      call pade_rational(2, 2, r, status)
      call check_point(error, r%poles(1), cmplx(3.0_wp, sqrt(3.0_wp), wp), 'Pade(2,2)')
      call pade_rational(1, 2, r, status)
      call check_point(error, r%poles(1), cmplx(2.0_wp, sqrt(2.0_wp), wp), 'Pade(1,2)')
      call taylor_rational(5, 5, 0.5_wp, r, status)
      call check(error, minval(real(r%poles, wp)) < 0, 'BI(5,5) has poles in the left half-plane')
      call check(error, .not. status%failed(), 'status')
   end subroutine test_poles

   complex(wp) function rightmost(w)
      complex(wp), intent(in) :: w(:)
      rightmost = w(maxloc(real(w, wp), 1))
      rightmost = cmplx(real(rightmost, wp), abs(aimag(rightmost)), wp)
   end function rightmost

   subroutine check_point(error, w, expected, what)
      type(error_type), allocatable, intent(inout) :: error
      complex(wp), intent(in) :: w, expected
      character(len=*), intent(in) :: what
      call check(error, real(w, wp), real(expected, wp), what//', real part', thr=1.0e-12_wp)
      call check(error, aimag(w), aimag(expected), what//', imaginary part', thr=1.0e-12_wp)
   end subroutine check_point

   !> Poles are zeros of D, zeros of N, to rounding times their condition; conjugates together; poles and zeros of symmetric
   !> functions are mirror images to the last bit
   subroutine test_mirror(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      integer :: k
      do k = 1, 8
         call pade_rational(k, k, r, status)
         call check_pairs(error, r, 'Pade')
         call check(error, .not. any(abs(r%poles + conjg(r%zeros)) > 0), 'Pade: mirror images')
         call check(error, all(real(r%poles, wp) > 0), 'Pade: poles in the right half-plane')
         if (k > 6) cycle
         call taylor_rational(k, k, 0.5_wp, r, status)
         call check_pairs(error, r, 'BI')
         call check(error, .not. any(abs(r%poles + conjg(r%zeros)) > 0), 'BI: mirror images')
         call taylor_rational(k, k, 0.3_wp, r, status)
         call check_pairs(error, r, 'BI at alpha = 0.3')
      end do
      call fehlberg_rational(0.5_wp, r, status)
      call check_pairs(error, r, 'Fehlberg')
      call check(error, .not. any(abs(r%poles + conjg(r%zeros)) > 0), 'Fehlberg: mirror images')
   end subroutine test_mirror

   subroutine check_pairs(error, r, what)
      type(error_type), allocatable, intent(inout) :: error
      type(rational_type), intent(in) :: r
      character(len=*), intent(in) :: what
      integer :: k
      call check(error, size(r%poles) == r%q .and. size(r%zeros) == r%p, what//': how many')
      if (allocated(error)) return
      k = 1
      do while (k <= r%q)
         call check(error, residual(r%den(:r%q), r%poles(k)) < 32*eps, what//': a pole')
         if (abs(aimag(r%poles(k))) > 0) then
            call check(error, k < r%q .and. aimag(r%poles(k)) > 0, what//': the upper one first')
            if (k < r%q) call check(error, .not. abs(r%poles(k + 1) - conjg(r%poles(k))) > 0, what//': conjugates')
            k = k + 1
         end if
         k = k + 1
      end do
      do k = 1, r%p
         call check(error, residual(r%num(:r%p), r%zeros(k)) < 32*eps, what//': a zero')
      end do
   end subroutine check_pairs

   !> |c(z)| in units of its terms
   real(wp) function residual(c, z)
      real(wp), intent(in) :: c(0:)
      complex(wp), intent(in) :: z
      complex(wp) :: p
      real(wp) :: terms
      integer :: k
      p = 0
      terms = 0
      do k = size(c) - 1, 0, -1
         p = p*z + c(k)
         terms = terms*abs(z) + abs(c(k))
      end do
      residual = abs(p)/terms
   end function residual

   !> Symmetric functions: 1 to 1e-14 from 1e-12 to 1e12; those of other forms at infinity
   subroutine test_modulus(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      integer :: i, k
      do k = 1, 8
         call pade_rational(k, k, r, status)
         call check_modulus(error, r, 'Pade')
         call pade_rational(k - 1, k, r, status)
         call check(error, r%at_infinity(), 0.0_wp, 'L-stable')
         do i = -24, 24
            call check(error, abs(r%value(imag*10.0_wp**(0.5_wp*i))) <= 1 + 1.0e-14_wp, 'Pade(k-1,k) on the axis')
         end do
         if (k > 6) cycle
         call taylor_rational(k, k, 0.5_wp, r, status)
         call check_modulus(error, r, 'BI')
         call taylor_rational(k, k, 0.3_wp, r, status)
         call check(error, r%at_infinity(), (0.3_wp/0.7_wp)**k, 'BI(k,k) at infinity', thr=1.0e-14_wp)
         call check(error, abs(r%value((-1.0e12_wp, 0.0_wp))), (0.3_wp/0.7_wp)**k, 'BI(k,k) far out', thr=1.0e-9_wp)
      end do
      call fehlberg_rational(0.5_wp, r, status)
      call check_modulus(error, r, 'Fehlberg')
      call pade_rational(3, 2, r, status)
      call check(error, r%at_infinity(), huge(1.0_wp), 'an improper one at infinity')
   end subroutine test_modulus

   subroutine check_modulus(error, r, what)
      type(error_type), allocatable, intent(inout) :: error
      type(rational_type), intent(in) :: r
      character(len=*), intent(in) :: what
      integer :: i
      do i = -120, 120
         call check(error, abs(r%value(imag*10.0_wp**(0.1_wp*i))), 1.0_wp, what//' on the imaginary axis', thr=1.0e-14_wp)
      end do
      call check(error, r%at_infinity(), 1.0_wp, what//' at infinity', thr=1.0e-14_wp)
   end subroutine check_modulus

   !> R(z) R(-z) = 1 of symmetric ones, R = e^z for small z, to rounding times the condition of N and D on the negative axis
   subroutine test_real_axis(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      real(wp) :: z
      integer :: i, k
      do k = 1, 8
         call pade_rational(k, k, r, status)
         do i = -24, 24
            z = 10.0_wp**(0.5_wp*i)
            call check(error, real(r%value(cmplx(z, 0.0_wp, wp))*r%value(cmplx(-z, 0.0_wp, wp)), wp), 1.0_wp, 'R(z) R(-z)', &
               & thr=4.0e-13_wp)
            if (z < 1.0e-3_wp) call check(error, real(r%value(cmplx(-z, 0.0_wp, wp)), wp), exp(-z), 'e^z', &
               & thr=merge(z**3, 4*eps, k == 1) + 4*eps)
         end do
      end do
   end subroutine test_real_axis

   !> R again from its stages
   complex(wp) function by_stages(stages, z)
      type(pole_stages_type), intent(in) :: stages
      complex(wp), intent(in) :: z
      complex(wp) :: added
      integer :: j, k
      by_stages = 1
      do k = 1, size(stages%stage)
         added = 0
         associate (s => stages%stage(k))
            do j = 1, s%count
               added = added + s%tau(j)*z/(z - s%pole(j))
               if (s%w(j) > 1.5_wp) added = added + conjg(s%tau(j))*z/(z - conjg(s%pole(j)))
            end do
         end associate
         by_stages = by_stages*(1 + added)
      end do
      do k = 1, size(stages%factor)
         by_stages = by_stages*(1 + z*(stages%factor(k)%a + stages%factor(k)%b*z))
      end do
   end function by_stages

   subroutine test_stages(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(status_type) :: status
      integer :: p, q
      do p = 0, 8
         do q = 0, 8
            call pade_rational(p, q, r, status)
            call check_stages(error, r, 'Pade')
            if (max(p, q) > 6) cycle
            call taylor_rational(p, q, 0.3_wp, r, status)
            call check_stages(error, r, 'BI')
            call taylor_rational(p, q, 0.5_wp, r, status)
            call check_stages(error, r, 'BI')
         end do
      end do
      call fehlberg_rational(0.47_wp, r, status)
      call check_stages(error, r, 'Fehlberg')
   end subroutine test_stages

   !> Both forms at many z: 100 units of rounding times the factor by which each grows
   subroutine check_stages(error, r, name)
      type(error_type), allocatable, intent(inout) :: error
      type(rational_type), intent(in) :: r
      character(len=*), intent(in) :: name
      type(pole_stages_type) :: s
      type(status_type) :: status
      complex(wp) :: z, exact
      real(wp) :: growth
      integer :: form, i, j, k
      character(len=60) :: what
      if (allocated(error)) return
      do form = form_automatic, form_refined
         if (form == form_parallel .and. r%p > r%q) cycle
         call s%set(r, form, status)
         write (what, '(a, "(", i0, ",", i0, "), form ", i0)') name, r%p, r%q, form
         call check(error, .not. status%failed(), what)
         call check(error, s%poles == size(s%pole) .and. sum([(nint(sum(s%stage(k)%w)), k=1, size(s%stage))]) == r%q, &
            & trim(what)//': every pole')
         do k = 1, size(s%stage)
            call check(error, all(aimag(s%stage(k)%pole) >= 0), trim(what)//': upper half-plane')
            call check(error, .not. any(abs(s%stage(k)%pole - s%pole(s%stage(k)%first:s%stage(k)%first + s%stage(k)%count - 1)) &
               & > 0), trim(what)//': places of poles')
         end do
         do i = -4, 6
            do j = 0, 8
               z = 10.0_wp**i*exp(imag*(1.9_wp + 0.3_wp*j))
               exact = r%value(z)
               growth = 1 + abs(exact)
               do k = 1, size(s%factor)
                  growth = growth*(1 + abs(s%factor(k)%a*z) + s%factor(k)%b*abs(z)**2)
               end do
               do k = 1, size(s%stage)
                  growth = growth*(1 + sum(s%stage(k)%w*abs(s%stage(k)%tau)*abs(z)/min(abs(z - s%stage(k)%pole), &
                     & abs(z - conjg(s%stage(k)%pole)))))
               end do
               if (abs(by_stages(s, z) - exact) > 100*eps*growth) call test_failed(error, trim(what)//': R by stages')
            end do
         end do
      end do
   end subroutine check_stages

   !> sum w |tau|, by which rounding errors of the parallel form grow; that of the product form is that of one stage
   subroutine test_sums(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: degrees(4) = [2, 4, 6, 8]
      real(wp), parameter :: parallel(4) = [6.93_wp, 76.0_wp, 900.0_wp, 1.1e4_wp]
      real(wp), parameter :: product_form(4) = [6.93_wp, 14.0_wp, 20.0_wp, 26.0_wp]
      type(rational_type) :: r
      type(pole_stages_type) :: s
      type(status_type) :: status
      integer :: i, k
      do i = 1, size(degrees)
         call pade_rational(degrees(i), degrees(i), r, status)
         call s%set(r, form_parallel, status)
         call check(error, size(s%stage), 1, 'one stage')
         call check(error, sum(s%stage(1)%w*abs(s%stage(1)%tau)), parallel(i), 'parallel', thr=0.05_wp, rel=.true.)
         call s%set(r, form_product, status)
         call check(error, size(s%stage), degrees(i)/2, 'a stage for each pair')
         call check(error, maxval([(s%stage(k)%w(1)*abs(s%stage(k)%tau(1)), k=1, size(s%stage))]), product_form(i), 'product', &
            & thr=0.05_wp, rel=.true.)
         call check(error, all([(s%stage(k)%is_mirrored, k=1, size(s%stage))]), 'zeros mirror the poles')
         call s%set(r, form_automatic, status)
         call check(error, size(s%stage) == 1 .eqv. degrees(i) <= 4, 'the automatic form is parallel up to (4,4)')
      end do
   end subroutine test_sums

   !> Simple, multiple, at 0, real and not, of degree 16
   subroutine test_zeros(error)
      type(error_type), allocatable, intent(out) :: error
      complex(wp) :: z(16)
      integer :: k
      call check_zeros(error, [(cmplx(k, 0, wp), k=1, 8)], 1.0e-11_wp, '1 .. 8')
      call check_zeros(error, [(cmplx(1, 0, wp), k=1, 2)], 1.0e-7_wp, 'a double one')
      call check_zeros(error, [(cmplx(-2, 0, wp), k=1, 4)], 2.0e-3_wp, 'a fourfold one')
      call check_zeros(error, [(1.0_wp, 1.0_wp), (1.0_wp, -1.0_wp), (1.0_wp, 1.0_wp), (1.0_wp, -1.0_wp)], 1.0e-6_wp, &
         & 'a double pair')
      call check_zeros(error, [(cmplx(0, 0, wp), k=1, 3), (cmplx(k, 0, wp), k=1, 2)], 1.0e-14_wp, 'zeros at 0')
      call check_zeros(error, [(cmplx(0, 0, wp), k=1, 5)], 0.0_wp, 'z^5')
      z = [(exp(imag*acos(-1.0_wp)*(2*k - 1)/16), k=1, 16)]
      call check_zeros(error, z, 4.0e-14_wp, 'z^16 + 1')
      call check_zeros(error, [(cmplx(0.9_wp**k, 0, wp)*imag**(2*k), k=1, 16)], 1.0e-6_wp, 'degree 16, real')
      call check_zeros(error, [(cmplx(-1, k, wp), cmplx(-1, -k, wp), k=1, 8)], 1.0e-9_wp, 'degree 16, pairs')
      call check_zeros(error, [(2.0_wp, 1.0e-6_wp), (2.0_wp, -1.0e-6_wp), (1.0_wp, 0.0_wp)], 1.0e-8_wp, 'beside the axis')
   end subroutine test_zeros

   !> Sizes from 1e-20 to 1e18 in one polynomial, and all far from 1: errors relative to each zero
   subroutine test_zeros_apart(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: k
      call check_zeros(error, [(cmplx((-1)**k*10.0_wp**(2*k), 0, wp), k=-10, 5)], 1.0e-14_wp, '1e-20 .. 1e10')
      call check_zeros(error, [(cmplx(10.0_wp**(6*k), 10.0_wp**(6*k), wp), cmplx(10.0_wp**(6*k), -10.0_wp**(6*k), wp), &
         & k=-3, 3)], 1.0e-14_wp, 'pairs from 1e-18 to 1e18')
      call check_zeros(error, [(cmplx(k*1.0e18_wp, 0, wp), k=1, 6)], 1.0e-12_wp, 'all near 1e18')
      call check_zeros(error, [(cmplx(k*1.0e-40_wp, 0, wp), k=1, 6)], 1.0e-12_wp, 'all near 1e-40')
   end subroutine test_zeros_apart

   subroutine check_zeros(error, zeros, tolerance, what)
      type(error_type), allocatable, intent(inout) :: error
      complex(wp), intent(in) :: zeros(:)
      real(wp), intent(in) :: tolerance               !! relative to each zero
      character(len=*), intent(in) :: what
      complex(wp), allocatable :: found(:)
      complex(wp) :: c(0:size(zeros))
      logical :: converged, is_taken(size(zeros))
      integer :: i, j, best
      if (allocated(error)) return
      c = 0
      c(0) = 1
      do i = 1, size(zeros)
         c(1:i) = c(0:i - 1) - zeros(i)*c(1:i)
         c(0) = -zeros(i)*c(0)
         if (i == 1) c(0) = -zeros(1)
      end do
      call polynomial_zeros(real(c, wp), found, converged)
      call check(error, converged, what//': converged')
      call check(error, size(found), size(zeros), what//': how many')
      if (allocated(error)) return
      is_taken = .false.
      do i = 1, size(zeros)
         best = 0
         do j = 1, size(zeros)
            if (is_taken(j)) cycle
            if (best == 0) best = j
            if (abs(found(j) - zeros(i)) < abs(found(best) - zeros(i))) best = j
         end do
         is_taken(best) = .true.
         call check(error, abs(found(best) - zeros(i)), 0.0_wp, what, thr=tolerance*abs(zeros(i)))
      end do
      i = 1
      do while (i <= size(found))
         if (abs(aimag(found(i))) > 0) then
            call check(error, i < size(found) .and. aimag(found(i)) > 0, what//': the upper one first')
            if (i < size(found)) call check(error, .not. abs(found(i + 1) - conjg(found(i))) > 0, what//': conjugates')
            i = i + 1
         end if
         i = i + 1
      end do
   end subroutine check_zeros

   !> At 0 and 1 and next to them and to 1/2: finite, and near its neighbour
   subroutine test_alpha(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r, beside
      type(pole_stages_type) :: s
      type(status_type) :: status
      real(wp), parameter :: limits(3) = [0.0_wp, 0.5_wp, 1.0_wp]
      complex(wp), parameter :: z = (-0.5_wp, 1.0_wp)
      real(wp) :: alpha
      integer :: i, j
      do i = 1, 3
         call taylor_rational(4, 5, limits(i), r, status)
         do j = 1, 5
            alpha = limits(i) + (0.5_wp - limits(i))*10.0_wp**(-3*j)
            if (i == 2) alpha = 0.5_wp - 10.0_wp**(-3*j)
            call taylor_rational(4, 5, alpha, beside, status)
            call check(error, abs(r%value(z) - beside%value(z)), 0.0_wp, 'near a limit', thr=10.0_wp**(1 - 3*j) + 10*eps)
            call s%set(beside, form_automatic, status)
            call check(error, abs(by_stages(s, z) - beside%value(z)), 0.0_wp, 'near a limit, by stages', thr=1000*eps)
         end do
         alpha = nearest(limits(i), 0.5_wp - limits(i))
         if (i == 2) alpha = nearest(0.5_wp, 1.0_wp)
         call taylor_rational(4, 5, alpha, beside, status)
         call s%set(beside, form_automatic, status)
         call check(error, .not. status%failed(), status%message)
         call check(error, abs(r%value(z) - beside%value(z)), 0.0_wp, 'next to a limit', thr=10*eps)
      end do
      call taylor_rational(5, 5, 0.0_wp, r, status)
      call check(error, r%p == 0 .and. r%q == 5, 'alpha = 0: the backward half alone')
      call taylor_rational(5, 5, 1.0_wp, r, status)
      call check(error, r%p == 5 .and. r%q == 0, 'alpha = 1: the forward half alone')
      call check(error, abs(r%value(z) - (1 + z + z**2/2 + z**3/6 + z**4/24 + z**5/120)), 0.0_wp, 'alpha = 1', thr=4*eps)
   end subroutine test_alpha

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(rational_type) :: r
      type(pole_stages_type) :: s
      type(status_type) :: status
      real(wp), parameter :: bad(4) = [-1.0e-9_wp, 1.0000001_wp, huge(1.0_wp), -huge(1.0_wp)]
      real(wp) :: many(18)
      integer :: i
      call taylor_rational(7, 1, 0.5_wp, r, status)
      call expect(error, status, 'p = 7 must lie between 0 and 6')
      call taylor_rational(1, -1, 0.5_wp, r, status)
      call expect(error, status, 'q = -1 must lie between 0 and 6')
      call pade_rational(9, 1, r, status)
      call expect(error, status, 'p = 9 must lie between 0 and 8')
      call pade_rational(2, 9, r, status)
      call expect(error, status, 'q = 9 must lie between 0 and 8')
      do i = 1, size(bad)
         call taylor_rational(4, 4, bad(i), r, status)
         call expect(error, status, 'alpha = ')
         call fehlberg_rational(bad(i), r, status)
         call expect(error, status, 'alpha = ')
      end do
      many = 1
      call rational_of(many, [1.0_wp], r, status)
      call expect(error, status, '1 to 17 coefficients')
      call rational_of(many(:0), [1.0_wp], r, status)
      call expect(error, status, '1 to 17 coefficients')
      call rational_of([2.0_wp, 1.0_wp], [1.0_wp], r, status)
      call expect(error, status, 'N(0) = D(0) = 1')
      call rational_of([1.0_wp, 1.0_wp], [0.0_wp, 1.0_wp], r, status)
      call expect(error, status, 'N(0) = D(0) = 1')
      call pade_rational(3, 2, r, status)
      call s%set(r, form_parallel, status)
      call expect(error, status, 'choose the product form')
      call s%set(r, 4, status)
      call expect(error, status, 'form = 4')
      call s%set(r, -1, status)
      call expect(error, status, 'form = -1')
   end subroutine test_refusals

   subroutine expect(error, status, words)
      type(error_type), allocatable, intent(inout) :: error
      type(status_type), intent(inout) :: status
      character(len=*), intent(in) :: words
      call check(error, status%code, dynstep_invalid_input, words)
      call check(error, index(status%message, words) > 0, words//' / '//trim(status%message))
      call status%clear()
   end subroutine expect
end module test_rational
