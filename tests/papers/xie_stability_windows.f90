! SPDX-License-Identifier: BSD-3-Clause
!> Xie's sections 3.1 to 3.3: the windows of alpha claimed for BI45 and BI55 against the exact ones, the search that gave
!> them done again, |R(infinity)|, and points of the accuracy domains (Figs. 3.7, 3.10) and of the damping and frequency
!> plots (Figs. 3.13, 3.17, 3.18, 3.22) against an independent study.
program xie_stability_windows
   use dynstep_accuracy_domain, only: accuracy_limit, damping_frequency
   use dynstep_kinds, only: wp
   use dynstep_rational, only: rational_type, taylor_rational
   use dynstep_stability_facts, only: find_facts, ray_crossings, stability_facts_type
   use dynstep_stability_windows, only: alpha_windows, property_a_stable, property_f_stable, property_i_stable, &
      & property_l_stable
   use dynstep_status, only: status_type
   use paper_table, only: paper_table_type, xie_1995
   implicit none

   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp
   type(paper_table_type) :: table
   type(rational_type) :: r
   type(status_type) :: status

   call table%open_figure(xie_1995, 'Sections 3.1-3.3', 'stability, accuracy and damping of BI45 and BI55')
   call windows_of_45
   call windows_of_55
   call search
   call accuracy
   call damping
   if (status%failed()) error stop 1
   call table%close()

contains

   subroutine windows_of_45
      type(stability_facts_type) :: facts
      real(wp), allocatable :: windows(:, :)
      call table%section('BI45, (3.2) with 1/120: "0.3 <= alpha <= 0.47 to maintain the L-stability"')
      call alpha_windows(4, 5, property_i_stable, windows, status)
      call table%holds('windows with |R(iy)| <= 1', real(size(windows, 2), wp), 1.0_wp, 0.0_wp)
      call table%explained('from alpha', '0.3', '0.4362200210', windows(1, 1), exact=0.4362200209669922_wp, &
         & accept_exact=1.0e-10_wp, reason='rays 5 degrees apart do not see the growth on the imaginary axis below it')
      call table%explained('to alpha', '0.47', '0.4486146148', windows(2, 1), exact=0.4486146148450476_wp, &
         & accept_exact=1.0e-10_wp, reason='at 0.47 motions with h omega = 6.07 grow by 74 per cent a step')
      call alpha_windows(4, 5, property_a_stable, windows, status)
      call table%explained('windows of A-stability, so of L-stability', '1', '0', real(size(windows, 2), wp), &
         & accept=0.0_wp, reason='the Taylor polynomial of degree 5 has zeros with Re > 0: poles of R with Re < 0, any alpha')
      call taylor_rational(4, 5, 0.47_wp, r, status)
      call find_facts(r, facts, status)
      call table%holds('Re of the pole at alpha 0.47', real(facts%left_poles(1), wp), -0.452465_wp, 1.0e-6_wp)
      call table%holds('Im of it', aimag(facts%left_poles(1)), 5.902519_wp, 1.0e-6_wp)
      call table%explained('degrees of A(phi) at the recommended 0.47', '90', '81.491', facts%angle, reason='as above')
      call taylor_rational(4, 5, 0.4486_wp, r, status)
      call find_facts(r, facts, status)
      call table%holds('degrees of A(phi) at 0.4486, near the best', facts%angle, 84.867452371_wp, 1.0e-9_wp)
   end subroutine windows_of_45

   subroutine windows_of_55
      type(stability_facts_type) :: facts
      real(wp), allocatable :: windows(:, :)
      call table%section('BI55, (3.3) with 1/120: "to maintain the L-stability, 0.3 <= alpha < 0.5"; "when alpha = 0.5, F-stable"')
      call alpha_windows(5, 5, property_i_stable, windows, status)
      call table%explained('|R(iy)| <= 1 from alpha', '0.3', '0.5', windows(1, 1), accept=1.0e-10_wp, &
         & reason='for all other alpha there is growth on the imaginary axis')
      call alpha_windows(5, 5, property_l_stable, windows, status)
      call table%explained('windows of L-stability', '1', '0', real(size(windows, 2), wp), accept=0.0_wp, &
         & reason='poles with Re < 0, and R(infinity) = (alpha/(1 - alpha))^5 is not 0')
      call alpha_windows(5, 5, property_f_stable, windows, status)
      call table%explained('F-stable alphas', '1', '0', real(size(windows, 2), wp), accept=0.0_wp, &
         & reason='|R(iy)| = 1 at 0.5, but R has the poles -0.4796 +- 6.2567i')
      call taylor_rational(5, 5, 0.47_wp, r, status)
      call find_facts(r, facts, status)
      call table%explained('|R(infinity)| at 0.47, for L-stability', '0', '0.54842', facts%r_infinity, reason='as above')
      call taylor_rational(5, 5, 0.3_wp, r, status)
      call find_facts(r, facts, status)
      call table%explained('|R(infinity)| at 0.3', '0', '0.01446', facts%r_infinity, reason='as above')
   end subroutine windows_of_55

   !> What the listings Stab and CalMaxH find on the ray at 95 degrees
   subroutine search
      real(wp), parameter :: of_45(9) = [3.81_wp, 4.28_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 7.77_wp, 8.86_wp, 10.26_wp]
      real(wp), parameter :: of_55(9) = [3.81_wp, 4.28_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      real(wp), parameter :: alphas(9) = [0.1_wp, 0.2_wp, 0.3_wp, 0.4_wp, 0.44_wp, 0.47_wp, 0.48_wp, 0.49_wp, 0.5_wp]
      character(len=46) :: item
      real(wp), allocatable :: crossings(:), touched(:)
      integer :: i, q, first_sign
      do q = 4, 5
         call table%section('The search again, degrees (p, 5): h_max on the ray at 95 degrees; 0 was read as stable')
         do i = 1, size(alphas)
            if (q == 5 .and. i == size(alphas)) cycle       ! |R| = 1 on the axis: any bracket is kept
            call taylor_rational(q, 5, alphas(i), r, status)
            write (item, '("BI", i0, "5, alpha = ", f4.2)') q, alphas(i)
            call table%holds(item, h_max_at_95(r), merge(of_45(i), of_55(i), q == 4), 0.005_wp)
         end do
      end do
      call table%section('What is there: bisection between 0 and 1.5 times the value of the ray before steps over it')
      do i = 3, 6
         call taylor_rational(4, 5, alphas(i), r, status)
         call ray_crossings(r, 95.0_wp*degree, crossings, touched, first_sign)
         write (item, '("BI45, alpha = ", f4.2, ": crossings")') alphas(i)
         call table%holds(item, real(size(crossings), wp), 2.0_wp, 0.0_wp, 'into a pocket and out of it')
      end do
   end subroutine search

   !> Listing Stab: theta = 0, 5, ..., 95, each with the bracket 0, 1.5 times the last result
   real(wp) function h_max_at_95(r) result(h)
      type(rational_type), intent(in) :: r
      real(wp) :: upper
      integer :: theta
      upper = 100.0_wp
      theta = 0
      do while (theta <= 95)
         h = h_max(r, theta*degree, upper)
         if (h >= 0.0_wp) then
            upper = 1.5_wp*h
            theta = theta + 5
         else
            upper = 2.5_wp*upper
         end if
      end do
   end function h_max_at_95

   !> Listing CalMaxH: bisection on |R| - 1, to 1e-6
   real(wp) function h_max(r, theta, upper) result(h)
      type(rational_type), intent(in) :: r
      real(wp), intent(in) :: theta, upper
      real(wp) :: low, high, err
      low = 0.0_wp
      high = upper
      do
         h = 0.5_wp*(low + high)
         err = abs(r%value(h*cmplx(cos(theta), sin(theta), wp))) - 1.0_wp
         if (err > 0.0_wp) then
            low = h
         else
            high = h
         end if
         if (abs(err) <= 1.0e-6_wp) return
         if (high - low >= 1.0e-6_wp) cycle
         h = -10.0_wp
         return
      end do
   end function h_max

   !> Points with tol = 1e-4, x0 = (1, 0), at 90, 120, 150, 180 degrees.  (BI55, 0.3, 90: the study has 0.57527; with 18 steps
   !> the error passes the tolerance from 0.56982 to 10/17.5 already, then 17 steps have less.)
   subroutine accuracy
      real(wp), parameter :: of_45(4, 5) = reshape([ &
         & 0.42204_wp, 0.73449_wp, 0.72740_wp, 0.63742_wp, 0.48500_wp, 0.85938_wp, 0.84146_wp, 0.73014_wp, &
         & 0.55871_wp, 0.96884_wp, 0.95544_wp, 0.81517_wp, 0.55402_wp, 0.96394_wp, 0.89714_wp, 0.76206_wp, &
         & 0.43991_wp, 0.79511_wp, 0.71367_wp, 0.61807_wp], [4, 5])
      real(wp), parameter :: of_55(4, 4) = reshape([ &
         & 0.42205_wp, 0.73451_wp, 0.72745_wp, 0.63746_wp, 0.56982_wp, 1.00210_wp, 1.00463_wp, 0.86607_wp, &
         & 0.70117_wp, 1.23678_wp, 1.23731_wp, 1.15021_wp, 0.90624_wp, 1.33315_wp, 1.43667_wp, 1.10464_wp], [4, 4])
      real(wp), parameter :: alphas_55(4) = [0.1_wp, 0.3_wp, 0.4_wp, 0.5_wp]
      real(wp) :: largest(2)
      integer :: i
      call table%section('Figs. 3.7, 3.10: accuracy domain, x0 = (1,0), tolerance 1e-4 (the captions; the listing has 10e-6)')
      do i = 1, 5
         call accuracy_points(4, 0.1_wp*i, of_45(:, i))
      end do
      do i = 1, 4
         call accuracy_points(5, alphas_55(i), of_55(:, i))
      end do
      do i = 1, 2
         call taylor_rational(4, 5, merge(0.3_wp, 0.5_wp, i == 1), r, status)
         call accuracy_limit(r, 120.0_wp*degree, [1.0_wp, 0.0_wp], 1.0e-4_wp, largest(i), status)
      end do
      call table%holds('BI45: alpha 0.5 over alpha 0.3, at 120 degrees', largest(2)/largest(1), 0.79511_wp/0.96884_wp, 2.0e-5_wp, &
         & '"the accuracy domains become larger as alpha increases" ends at alpha = 0.3 for BI45')
   end subroutine accuracy

   subroutine accuracy_points(p, alpha, expected)
      integer, intent(in) :: p
      real(wp), intent(in) :: alpha, expected(4)
      character(len=46) :: item
      real(wp) :: h
      integer :: i
      call taylor_rational(p, 5, alpha, r, status)
      do i = 1, 4
         call accuracy_limit(r, (60 + 30*i)*degree, [1.0_wp, 0.0_wp], 1.0e-4_wp, h, status)
         write (item, '("BI", i0, "5, alpha = ", f3.1, ", ", i0, " degrees")') p, alpha, 60 + 30*i
         call table%holds(item, h, expected(i), 1.0e-5_wp)
      end do
   end subroutine accuracy_points

   !> Section 3.3: sigma and omega of R at alpha = 0.4; theta from the negative real axis
   subroutine damping
      real(wp), parameter :: of_45(4) = [0.99984_wp, 1.99316_wp, 3.67153_wp, 3.76769_wp]
      real(wp), parameter :: of_55(4) = [0.99997_wp, 1.99923_wp, 4.06184_wp, 4.40280_wp]
      character(len=46) :: item
      real(wp) :: sigma, omega
      integer :: i, p
      call table%section('Figs. 3.13, 3.17, 3.18, 3.22: damping and frequency, alpha = 0.4 ("good for r < 4 only": so it is)')
      do p = 4, 5
         call taylor_rational(p, 5, 0.4_wp, r, status)
         do i = 1, 4
            call damping_frequency(r, cmplx(-2.0_wp**(i - 1), 0.0_wp, wp), sigma, omega)
            write (item, '("BI", i0, "5, damping, theta = 0, r = ", i0)') p, 2**(i - 1)
            call table%holds(item, sigma, merge(of_45(i), of_55(i), p == 4), 1.0e-5_wp)
         end do
         call damping_frequency(r, (0.0_wp, 4.0_wp), sigma, omega)
         write (item, '("BI", i0, "5, damping, theta = 90, r = 4")') p
         call table%holds(item, sigma, merge(-0.01022_wp, -0.10120_wp, p == 4), 1.0e-5_wp, 'negative: a motion that grows')
         write (item, '("BI", i0, "5, frequency, theta = 90, r = 4")') p
         call table%holds(item, omega, merge(-2.55407_wp, -2.55472_wp, p == 4), 1.0e-5_wp, 'exact: 4 - 2 pi = -2.28319')
      end do
   end subroutine damping
end program xie_stability_windows
