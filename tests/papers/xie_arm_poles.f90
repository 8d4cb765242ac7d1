! SPDX-License-Identifier: BSD-3-Clause
!> The poles that Xie prints of the flexible arms: sections 4.4, 4.5 (Euler-Bernoulli, n = 20) and 5.4, 5.5
!> (Timoshenko, n = 10), open and closed loop.
!>
!> The first lists are those of the listing MKBmat, to the digits in print: +2 z(n-1) for -2 z(n-1) in the row of
!> the tip.  The poles of the equations stand beside.  The second lists are not poles of the equations, which
!> sums over them tell.
program xie_arm_poles
   use dynstep_flexible_arm, only: arm_consistent, arm_listing, beam_euler_bernoulli, beam_timoshenko, &
      & flexible_arm, timoshenko_gains
   use dynstep_kinds, only: wp
   use dynstep_status, only: status_type
   use eigenvalues, only: poles_of
   use paper_table, only: paper_table_type, value_of, xie_1995
   implicit none

   !> Half a unit of the last printed digit, 0.01 (the lists have four decimals, times 100), and 1e-4 for a tie
   real(wp), parameter :: print_accept = 0.0051_wp
   !> The independent study's values have four decimals
   real(wp), parameter :: study_accept = 6.0e-5_wp

   ! Euler-Bernoulli, n = 20: imaginary parts of the pairs, as printed
   character(len=*), parameter :: open_beam(21) = [character(len=6) :: &
      & '8.30', '20.71', '33.91', '56.43', '87.26', '119.87', '151.84', '182.34', '211.13', '238.05', '263.02', &
      & '285.95', '306.77', '325.39', '341.72', '355.70', '367.25', '376.31', '382.82', '386.75', '494.55']
   character(len=*), parameter :: closed_beam_im(20) = [character(len=6) :: &
      & '12.44', '29.55', '54.15', '86.10', '119.19', '151.40', '182.04', '210.91', '237.89', '262.90', '285.87', &
      & '306.71', '325.34', '341.69', '355.68', '367.24', '376.30', '382.82', '386.74', '494.55']
   character(len=*), parameter :: closed_beam_re(20) = [character(len=5) :: &
      & '-0.21', '-0.17', '-0.19', '-0.17', '-0.14', '-0.12', '-0.10', '-0.08', '-0.07', '-0.05', '-0.04', '-0.03', &
      & '-0.03', '-0.02', '-0.01', '-0.01', '-0.00', '-0.00', '-0.00', '-0.00']
   ! the equations, from the independent study
   real(wp), parameter :: open_study(20) = [10.1386_wp, 20.6687_wp, 35.5307_wp, 60.9669_wp, 92.3043_wp, 124.5055_wp, &
      & 155.8732_wp, 185.8181_wp, 214.1014_wp, 240.5869_wp, 265.1715_wp, 287.7593_wp, 308.2588_wp, 326.5817_wp, &
      & 342.6455_wp, 356.3746_wp, 367.7026_wp, 376.5734_wp, 382.9422_wp, 386.7767_wp]
   real(wp), parameter :: closed_study_im(4) = [3.1686_wp, 13.3363_wp, 30.7546_wp, 58.8987_wp]
   real(wp), parameter :: closed_study_re(4) = [-0.0755_wp, -0.1649_wp, -0.2042_wp, -0.1875_wp]

   ! Timoshenko, n = 10
   character(len=*), parameter :: open_shear(21) = [character(len=6) :: &
      & '7.14', '16.52', '25.90', '35.06', '44.97', '54.37', '64.06', '73.07', '82.04', '90.27', '98.20', '105.38', &
      & '112.07', '117.97', '123.25', '127.71', '131.44', '134.35', '136.45', '137.71', '329.85']
   character(len=*), parameter :: closed_shear_im(20) = [character(len=6) :: &
      & '10.25', '21.36', '31.53', '42.28', '52.28', '62.39', '71.77', '80.97', '89.44', '97.53', '104.87', &
      & '111.66', '117.68', '123.03', '127.57', '131.35', '134.30', '136.43', '137.71', '329.85']
   character(len=*), parameter :: closed_shear_re(20) = [character(len=5) :: &
      & '-0.28', '-0.26', '-0.24', '-0.23', '-0.21', '-0.20', '-0.18', '-0.16', '-0.14', '-0.12', '-0.10', '-0.08', &
      & '-0.06', '-0.05', '-0.03', '-0.02', '-0.01', '-0.01', '-0.00', '-0.00']
   character(len=*), parameter :: closed_shear_real(2) = [character(len=7) :: '-412.43', '-4.54']
   character(len=*), parameter :: open_shear_study(21) = [character(len=8) :: &
      & '0.0000', '10.4657', '19.8450', '30.5413', '49.4786', '72.7140', '95.1285', '108.3677', '115.7721', &
      & '127.6756', '133.5288', '145.6623', '150.9543', '153.8424', '174.4243', '196.8711', '216.9151', '233.5064', &
      & '245.9000', '253.5620', '333.6453']
   character(len=*), parameter :: closed_shear_real_study(2) = [character(len=9) :: '-415.8563', '-4.1873']
   character(len=*), parameter :: closed_shear_im_study(20) = [character(len=8) :: &
      & '3.1266', '12.9406', '27.4372', '48.6869', '72.5085', '95.1045', '108.1706', '115.7625', '127.3860', &
      & '133.4760', '145.6623', '150.7063', '153.8025', '174.2629', '196.7873', '216.8736', '233.4872', '245.8926', &
      & '253.5603', '333.6453']
   character(len=*), parameter :: closed_shear_re_study(20) = [character(len=7) :: &
      & '-0.0753', '-0.1426', '-0.1219', '-0.0707', '-0.0330', '-0.0049', '-0.0499', '-0.0028', '-0.0861', '-0.0154', &
      & '0.0000', '-0.0883', '-0.0130', '-0.0642', '-0.0386', '-0.0206', '-0.0106', '-0.0042', '-0.0010', '0.0000']

   type(paper_table_type) :: table
   real(wp), allocatable :: re(:), im(:)        ! poles with im >= 0, ordered by im

   call table%open(xie_1995, 'Sections 4.4-5.5', 'poles of the flexible arms')
   call open_euler_bernoulli()
   call closed_euler_bernoulli()
   call timoshenko_lists()
   call timoshenko_sums()
   call table%close()

contains

   !> Poles of the upper half-plane, a real one once; the double pole of the rigid mode once
   subroutine poles(beam, variant, segments, closed)
      integer, intent(in) :: beam, variant, segments
      logical, intent(in) :: closed
      type(flexible_arm) :: arm
      type(status_type) :: status
      real(wp), allocatable :: m(:, :), c(:, :), k(:, :), all_re(:), all_im(:)
      logical, allocatable :: kept(:)
      integer :: info
      arm%beam = beam
      arm%variant = variant
      call arm%setup(segments, status)
      if (closed) call arm%close_loop(status)
      if (status%failed()) error stop 'the arm cannot be set up'
      associate (n => arm%n)
         allocate (m(n, n), c(n, n), k(n, n), all_re(2*n), all_im(2*n), kept(2*n))
         call arm%dense_matrices(m, c, k)
         call poles_of(m, c, k, all_re, all_im, info)
         if (info /= 0) error stop 'no eigenvalues'
         kept = .true.
         if (.not. closed .and. variant == arm_consistent) then
            ! rounding splits a double zero into +-1e-4 or less, along either axis
            kept = abs(cmplx(all_re, all_im, wp)) > 1.0e-3_wp
         end if
         kept = kept .and. all_im >= 0.0_wp
         re = pack(all_re, kept)
         im = pack(all_im, kept)
         if (.not. closed .and. variant == arm_consistent) then
            all_re = abs(cmplx(all_re, all_im, wp))
            re = [0.0_wp, re]
            im = [minval(all_re), im]
         end if
      end associate
   end subroutine poles

   subroutine open_euler_bernoulli()
      integer :: i
      call table%section('Open loop, Euler-Bernoulli, n = 20: frequencies (real parts are zero in print)')
      call poles(beam_euler_bernoulli, arm_listing, 20, .false.)
      do i = 1, 21
         call table%agrees(item('listing, pair', i), trim(open_beam(i)), im(i), accept=print_accept)
      end do
      call table%holds('largest real part', maxval(abs(re)), 0.0_wp, accept=1.0e-6_wp)
      call table%section('The same arm by eqs. (4.24)-(4.32)')
      call poles(beam_euler_bernoulli, arm_consistent, 20, .false.)
      call table%holds('rigid mode', im(1), 0.0_wp, accept=1.0e-3_wp, reason='a free arm turns: a double pole zero, &
         &which the listing''s sign takes away')
      do i = 1, 20
         call table%holds(item('equations, pair', i), im(i + 1), open_study(i), accept=study_accept)
      end do
   end subroutine open_euler_bernoulli

   subroutine closed_euler_bernoulli()
      integer :: i
      call table%section('Closed loop, Euler-Bernoulli, n = 20, gains (4.38)')
      call poles(beam_euler_bernoulli, arm_listing, 20, .true.)
      call table%agrees('listing, real pole', '-545.79', re(minloc(re, 1)), accept=print_accept)
      call table%agrees('listing, real pole', '-3.69', maxval(re(:2)), accept=print_accept)
      do i = 1, 20
         call table%agrees(item('listing, real part, pair', i), trim(closed_beam_re(i)), re(i + 2), accept=print_accept)
         call table%agrees(item('listing, frequency, pair', i), trim(closed_beam_im(i)), im(i + 2), accept=print_accept)
      end do
      call table%section('Real parts of the last four pairs in the text')
      call table%explained('pair 17', '-2.1074e-03', '-4.7697e-03', re(19), accept=5.1e-8_wp, &
         & reason='the figures of pairs 17 and 18 are interchanged')
      call table%explained('pair 18', '-4.7697e-03', '-2.1074e-03', re(20), accept=5.1e-8_wp, &
         & reason='the figures of pairs 17 and 18 are interchanged')
      call table%agrees('pair 19', '-5.2912e-04', re(21), accept=5.1e-9_wp)
      call table%explained('pair 20', '-2.2514e-07', '2.2514e-07', re(22), accept=1.0e-10_wp, &
         & reason='the listing''s pair +-494.55i is unstable, 2.25135571e-7 with 40 digits, too')
      call table%agrees('ratio of real parts', '2.4242e+09', abs(re(minloc(re, 1))/re(22)), accept=1.0e6_wp, &
         & reason='of their sizes; eigenvalues of size 500 leave 1e-10, 4e-4 of the last real part')
      call table%explained('ratio of magnitudes', '147.9106', '148.1037', minval(re)/maxval(re(:2)), accept=1.0e-3_wp, &
         & reason='545.79/3.69 of the rounded figures')
      call table%section('The same arm by eqs. (4.24)-(4.32): the list has another slow pair')
      call poles(beam_euler_bernoulli, arm_consistent, 20, .true.)
      call table%holds('equations, real pole', minval(re), -545.7863_wp, accept=study_accept)
      call table%holds('equations, real pole', maxval(re(:2)), -3.6098_wp, accept=study_accept)
      do i = 1, 4
         call table%holds(item('equations, real part, pair', i), re(i + 2), closed_study_re(i), accept=study_accept)
         call table%holds(item('equations, frequency, pair', i), im(i + 2), closed_study_im(i), accept=study_accept)
      end do
      call table%holds('largest real part', maxval(re), -5.08e-4_wp, accept=1.0e-6_wp, reason='stable')
   end subroutine closed_euler_bernoulli

   subroutine timoshenko_lists()
      integer :: i
      character(len=*), parameter :: reason = 'not a pole of (5.12)-(5.18): see the sums'
      call table%section('Open loop, Timoshenko, n = 10: frequencies')
      call poles(beam_timoshenko, arm_consistent, 10, .false.)
      do i = 1, 21
         call table%explained(item('pair', i), trim(open_shear(i)), trim(open_shear_study(i)), im(i), &
            & accept=merge(1.0e-3_wp, study_accept, i == 1), reason=reason)
      end do
      call table%section('Closed loop, Timoshenko, n = 10, gains (5.24)')
      call poles(beam_timoshenko, arm_consistent, 10, .true.)
      call table%explained('real pole', closed_shear_real(1), closed_shear_real_study(1), minval(re), &
         & accept=study_accept, reason=reason)
      call table%explained('real pole', closed_shear_real(2), closed_shear_real_study(2), maxval(re(:2)), &
         & accept=study_accept, reason=reason)
      do i = 1, 20
         if (i < 19) then
            call table%explained(item('real part, pair', i), trim(closed_shear_re(i)), trim(closed_shear_re_study(i)), &
               & re(i + 2), accept=study_accept, reason=reason)
         else
            call table%agrees(item('real part, pair', i), trim(closed_shear_re(i)), re(i + 2), accept=print_accept, &
               & reason='zero to these digits, in both')
         end if
         call table%explained(item('frequency, pair', i), trim(closed_shear_im(i)), trim(closed_shear_im_study(i)), &
            & im(i + 2), accept=study_accept, reason=reason)
      end do
   end subroutine timoshenko_lists

   !> With A = [0 I; -K -C] (M^-1 multiplied in), K with the feedback's stiffness s = (k_theta - k_w)/eta on its first
   !> diagonal entry and C of rank one with trace c = (kdot_theta - kdot_w)/eta:
   !>
   !>   sum lambda = -c,   sum lambda^2 = c^2 - 2 trace K,   sum lambda^3 = 3 c K11 - c^3
   !>
   !> the last because no row but the first two has a first column: C K has the trace c K11.
   subroutine timoshenko_sums()
      real(wp) :: open_trace, closed_trace, k11, c, s, cubes
      complex(wp) :: p(22)
      integer :: i
      call table%section('What the printed Timoshenko lists tell of their plant')
      c = (timoshenko_gains(2) - timoshenko_gains(4))/0.01_wp
      s = (timoshenko_gains(1) - timoshenko_gains(3))/0.01_wp
      open_trace = 0.0_wp
      do i = 1, 21
         open_trace = open_trace + value_of(open_shear(i))**2
      end do
      do i = 1, 20
         p(i) = cmplx(value_of(closed_shear_re(i)), value_of(closed_shear_im(i)), wp)
      end do
      p(21:) = [(value_of(closed_shear_real(i)), i=1, 2)]
      call table%holds('sum of closed-loop poles, printed', total(p, 1), -c, accept=0.21_wp, &
         & reason='-(kdot_theta - kdot_w)/eta with eta = 0.01, to 42 roundings of 0.005')
      closed_trace = (c**2 - total(p, 2))/2 - s
      call table%holds('trace of M^-1 K, open list', open_trace, 291960.0_wp, accept=21.0_wp, &
         & reason='the sum of squares, to roundings of 0.005')
      call table%holds('trace of M^-1 K, closed list', closed_trace, open_trace, accept=21.0_wp, &
         & reason='both lists are of one plant')
      cubes = total(p, 3)
      k11 = (cubes + c**3)/(3*c) - s
      call table%holds('its entry (theta, theta), closed list', k11, 2400.0_wp, accept=10.0_wp, &
         & reason='the roundings leave 2 from the fast pole and up to 7 from the pairs')
      call table%section('and what the equations have')
      call poles(beam_timoshenko, arm_consistent, 10, .false.)
      call table%holds('trace of M^-1 K, equations', sum(im**2), 552010.1010_wp, accept=1.0e-3_wp, &
         & reason='no digits make this 291960')
      call poles(beam_timoshenko, arm_consistent, 10, .true.)
      p(:20) = cmplx(re(3:), im(3:), wp)
      p(21:) = re(:2)
      call table%holds('sum of closed-loop poles, equations', total(p, 1), -c, accept=1.0e-8_wp)
      call table%holds('entry (theta, theta), equations', (total(p, 3) + c**3)/(3*c) - s, 1000.0_wp, accept=1.0e-5_wp, &
         & reason='n beta/eta; the printed lists have 2.4 times it, and no rigid mode')
   end subroutine timoshenko_sums

   !> Sum of powers of all poles, the last two of p real, the others one of a pair
   pure real(wp) function total(p, power)
      complex(wp), intent(in) :: p(22)
      integer, intent(in) :: power
      total = 2*sum(real(p(:20)**power, wp)) + sum(real(p(21:)**power, wp))
   end function total

   function item(words, number) result(name)
      character(len=*), intent(in) :: words
      integer, intent(in) :: number
      character(len=len(words) + 3) :: name
      write (name, '(a, 1x, i0)') words, number
   end function item
end program xie_arm_poles
