! SPDX-License-Identifier: BSD-3-Clause
!> The models of Xie (1995): exact solutions, Jacobians, invariants; the flexible arm's matrices against the
!> thesis's equations, its frequencies and poles against an independent study, its feedback, inputs, refusals.
module test_arms
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use dynstep_check_system, only: check_system, finding_length
   use dynstep_flexible_arm
   use dynstep_kinds, only: wp
   use dynstep_lotka_volterra, only: lotka_volterra
   use dynstep_marginal_problem, only: marginal_problem
   use dynstep_matrix, only: dense_matrix, kind_dense, matrix_type
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_stiff_third_order, only: stiff_third_order
   use eigenvalues, only: poles_of, squared_frequencies, symmetric_squares
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_arms

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   subroutine collect_arms(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('lotka-volterra', test_lotka_volterra), &
         & new_unittest('marginal-problem', test_marginal), &
         & new_unittest('stiff-third-order', test_stiff), &
         & new_unittest('euler-bernoulli-rows', test_euler_bernoulli_rows), &
         & new_unittest('timoshenko-rows', test_timoshenko_rows), &
         & new_unittest('symmetry-and-rigid-mode', test_symmetry), &
         & new_unittest('euler-bernoulli-frequencies', test_frequencies), &
         & new_unittest('euler-bernoulli-closed-loop', test_closed_loop), &
         & new_unittest('euler-bernoulli-fine', test_fine), &
         & new_unittest('timoshenko-frequencies', test_timoshenko), &
         & new_unittest('feedback', test_feedback), &
         & new_unittest('inputs', test_inputs), &
         & new_unittest('check-system', test_check), &
         & new_unittest('refuses', test_refuses)]
   end subroutine collect_arms

   !> Jacobian against differences, H constant along f, and the fixed point
   subroutine test_lotka_volterra(error)
      type(error_type), allocatable, intent(out) :: error
      type(lotka_volterra) :: sys
      type(matrix_type) :: given, differences
      real(wp) :: y(2), f(2)
      real(wp), parameter :: h = 1.0e-4_wp
      integer :: i, ierr
      call sys%setup()
      call sys%rhs(0.0_wp, [10.0_wp, 10.0_wp], f, ierr)
      call check(error, all(abs(f - [0.0_wp, -90.0_wp]) <= 1.0e-14_wp), 'the thesis''s start')
      sys%a = 0.7_wp
      sys%b = 1.3_wp
      sys%c = 1.9_wp
      sys%k = 0.4_wp
      call sys%rhs(0.0_wp, [sys%c/sys%b, sys%a/(sys%b*sys%k)], f, ierr)
      call check(error, maxval(abs(f)), 0.0_wp, 'the fixed point', thr=1.0e-15_wp)
      do i = 1, 5
         y = [0.5_wp*i, 3.0_wp/i]
         given = dense_matrix(reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [2, 2]))
         differences = given
         call sys%jacobian(0.0_wp, y, given, ierr)
         call check(error, ierr, 0)
         call sys%difference_jacobian(0.0_wp, y, differences, ierr)
         ! f is quadratic, forward differences err by their step, 1e-8 of y, times df/dx1dx2 = b
         call check(error, maxval(abs(given%a - differences%a)), 0.0_wp, 'Jacobian', thr=2.0e-7_wp)
         call sys%rhs(0.0_wp, y, f, ierr)
         ! the terms of dH/dt are as large as 10, H''' h^2/6 as 1e-7
         call check(error, (sys%conserved(y + h*f) - sys%conserved(y - h*f))/(2*h), 0.0_wp, 'H', thr=2.0e-6_wp)
      end do
   end subroutine test_lotka_volterra

   !> f(t, exact(t)) against the derivative of the exact solution, to `accept` of the largest component
   subroutine check_derivative(error, sys, t, left2, left, at, right, right2, h, accept)
      type(error_type), allocatable, intent(inout) :: error
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t, h, accept
      real(wp), intent(in), dimension(:) :: left2, left, at, right, right2    !! at t - 2h, ..., t + 2h
      real(wp) :: f(size(at)), derivative(size(at))
      integer :: ierr
      call sys%rhs(t, at, f, ierr)
      call check(error, ierr, 0)
      derivative = (8*(right - left) - (right2 - left2))/(12*h)
      call check(error, maxval(abs(f - derivative)), 0.0_wp, 'derivative', thr=accept*maxval(abs(f)))
   end subroutine check_derivative

   !> The exact solution from any start, and its closed form from the thesis's
   subroutine test_marginal(error)
      type(error_type), allocatable, intent(out) :: error
      type(marginal_problem) :: sys
      type(status_type) :: status
      real(wp), parameter :: h = 1.0e-3_wp, any_start(4) = [0.3_wp, -1.2_wp, 0.4_wp, 0.9_wp]
      real(wp) :: y0(4), y(4, -2:2), t
      integer :: i, j
      call sys%setup(status)
      call check(error, .not. status%failed(), trim(status%message))
      call sys%exact(0.0_wp, any_start, y(:, 0))
      call check(error, maxval(abs(y(:, 0) - any_start)), 0.0_wp)
      do i = 0, 10
         t = 0.9_wp*i
         do j = -2, 2
            call sys%exact(t + j*h, any_start, y(:, j))
         end do
         ! y^(5) h^4/30 = 1e-12 y
         call check_derivative(error, sys, t, y(:, -2), y(:, -1), y(:, 0), y(:, 1), y(:, 2), h, 3.0e-12_wp)
         call sys%start(y0)
         call sys%exact(t, y0, y(:, 0))
         call check(error, maxval(abs(y(:, 0) - [2*sin(2*t), cos(t), 1 + cos(2*t), sin(t)/4])), 0.0_wp, &
            & 'closed form', thr=1.0e-15_wp)
      end do
   end subroutine test_marginal

   subroutine test_stiff(error)
      type(error_type), allocatable, intent(out) :: error
      type(stiff_third_order) :: sys
      type(status_type) :: status
      real(wp) :: starts(3, 3), y(3, -2:2), re(3), t, h
      integer :: i, j, k
      call sys%setup(status)
      call check(error, .not. status%failed(), trim(status%message))
      ! the poles, as zeros of the characteristic polynomial
      re = sys%a%a(3, :)
      call check(error, -100.0_wp**3 - (re(3)*100.0_wp**2 - re(2)*100.0_wp + re(1)), 0.0_wp, 'pole -100')
      call check(error, abs(cubic(cmplx(-1.0_wp, 0.5_wp, wp), re)), 0.0_wp, 'poles -1 +- i/2')
      starts = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.3_wp, -2.0_wp, 500.0_wp], [3, 3])
      do k = 1, 3
         call sys%exact(0.0_wp, starts(:, k), y(:, 0))
         ! w = y'' + 2y' + 1.25y cancels into c0, c0 100^2 is y'' again
         call check(error, maxval(abs(y(:, 0) - starts(:, k))), 0.0_wp, 'start', thr=2.0e-13_wp)
         do i = 0, 8
            ! from the fast phase to the slow one; there, the slow solution is all
            t = 0.002_wp*2.0_wp**i
            h = merge(1.0e-5_wp, 1.0e-3_wp, t < 0.3_wp)
            do j = -2, 2
               call sys%exact(t + j*h, starts(:, k), y(:, j))
            end do
            call check_derivative(error, sys, t, y(:, -2), y(:, -1), y(:, 0), y(:, 1), y(:, 2), h, 2.0e-9_wp)
         end do
      end do

   contains

      pure complex(wp) function cubic(s, last_row)
         complex(wp), intent(in) :: s
         real(wp), intent(in) :: last_row(3)
         cubic = ((s - last_row(3))*s - last_row(2))*s - last_row(1)
      end function cubic
   end subroutine test_stiff

   subroutine ready(error, arm, segments, beam, variant)
      type(error_type), allocatable, intent(inout) :: error
      type(flexible_arm), intent(inout) :: arm
      integer, intent(in) :: segments, beam
      integer, intent(in), optional :: variant
      type(status_type) :: status
      arm%beam = beam
      if (present(variant)) arm%variant = variant
      call arm%setup(segments, status)
      call check(error, .not. status%failed(), trim(status%message))
   end subroutine ready

   !> Eight parameters, no two alike
   subroutine other_parameters(arm)
      type(flexible_arm), intent(inout) :: arm
      arm%eta = 0.23_wp
      arm%mu = 0.31_wp
      arm%kappa = 0.17_wp
      arm%zeta = 0.29_wp
      arm%alpha = 1.3_wp
      arm%beta = 0.7_wp
      arm%delta = 0.019_wp
      arm%gamma = 57.0_wp
   end subroutine other_parameters

   subroutine check_rows(error, arm, m, k)
      type(error_type), allocatable, intent(inout) :: error
      type(flexible_arm), intent(in) :: arm
      real(wp), intent(in) :: m(:, :), k(:, :)        !! expected [n,n]
      real(wp), dimension(size(m, 1), size(m, 1)) :: m_arm, c_arm, k_arm
      character(len=40) :: row
      integer :: i
      call arm%dense_matrices(m_arm, c_arm, k_arm)
      do i = 1, size(m, 1)
         write (row, '("row ", i0, " of n = ", i0)') i, arm%segments
         call check(error, maxval(abs(m_arm(i, :) - m(i, :))), 0.0_wp, 'M, '//trim(row), thr=1.0e-15_wp*maxval(abs(m)))
         call check(error, maxval(abs(k_arm(i, :) - k(i, :))), 0.0_wp, 'K, '//trim(row), thr=1.0e-15_wp*maxval(abs(k)))
      end do
      call check(error, maxval(abs(c_arm)), 0.0_wp, 'C')
   end subroutine check_rows

   !> Eqs. (4.24)-(4.32) row by row, corrected as the page on the arm says, inner rows divided by n
   subroutine test_euler_bernoulli_rows(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm
      real(wp), allocatable :: m(:, :), k(:, :)
      real(wp) :: d
      integer :: n, i

      do n = 4, 9
         call other_parameters(arm)
         call ready(error, arm, n, beam_euler_bernoulli, arm_consistent)
         if (allocated(error)) return
         if (allocated(m)) deallocate (m, k)
         allocate (m(0:n, 0:n), k(0:n, 0:n), source=0.0_wp)
         associate (b => arm%beta, a => arm%alpha, ka => arm%kappa, zm => arm%zeta*arm%mu, x => real(n, wp))
            d = a*arm%delta
            ! (4.24)
            m(0, 0) = arm%eta
            k(0, 0:1) = [x*b, -x**2*b]
            ! (4.25), with - b theta/n
            k(1, 0:3) = x**3*b*[-1/x, 6.0_wp, -4.0_wp, 1.0_wp]
            m(1, 1:2) = [a/x + 2*x*d, -x*d]
            ! (4.26)
            k(2, 1:4) = x**3*b*[-4.0_wp, 6.0_wp, -4.0_wp, 1.0_wp]
            ! (4.27)
            do i = 2, n - 1
               if (i > 2 .and. i + 2 <= n) k(i, i - 2:i + 2) = x**3*b*[1.0_wp, -4.0_wp, 6.0_wp, -4.0_wp, 1.0_wp]
               m(i, i - 1:i + 1) = [-x*d, a/x + 2*x*d, -x*d]
            end do
            ! (4.31), with -2 (b(n-1) + b(n-2)) z(n-2) and -2 b(n-1) zn
            k(n - 1, :) = 0.0_wp
            k(n - 1, n - 3:n) = x**3*b*[1.0_wp, -4.0_wp, 5.0_wp, -2.0_wp]
            m(n - 1, n - 2:n) = [-x*d, a/x + x*(2*d + x*ka), -x*(x*ka + zm + d)]
            ! (4.32)
            k(n, n - 2:n) = x**3*b*[1.0_wp, -2.0_wp, 1.0_wp]
            m(n, n - 1:n) = [-x*(x*ka + x*d/x + zm), x*(x*ka + 2*zm + d) + arm%mu]
            call check_rows(error, arm, m, k)
            call ready(error, arm, n, beam_euler_bernoulli, arm_listing)
            k(n, n - 2:n) = x**3*b*[1.0_wp, 2.0_wp, 1.0_wp]
            call check_rows(error, arm, m, k)
            call check(error, arm%m%symmetric .and. .not. arm%k%symmetric, 'declared symmetry')
         end associate
      end do
   end subroutine test_euler_bernoulli_rows

   !> Eqs. (5.12)-(5.18) row by row, signs turned where M would be negative, inner rows divided by n
   subroutine test_timoshenko_rows(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm
      real(wp), allocatable :: m(:, :), k(:, :)
      integer :: n, i

      do n = 2, 6
         call other_parameters(arm)
         call ready(error, arm, n, beam_timoshenko, arm_consistent)
         if (allocated(error)) return
         if (allocated(m)) deallocate (m, k)
         allocate (m(2*n + 1, 2*n + 1), k(2*n + 1, 2*n + 1), source=0.0_wp)
         associate (b => arm%beta, g => arm%gamma, x => real(n, wp))
            m(1, 1) = arm%eta
            call add(1, 1, x*b)                                   ! (5.12)
            call add(1, phi(1), -x*b)
            do i = 1, n - 1
               m(phi(i), phi(i)) = arm%alpha*arm%delta/x          ! (5.13), (5.15)
               call add(phi(i), phi(i + 1), -x*b)
               call add(phi(i), phi(i), x*(2*b + g/x**2))
               call add(phi(i), phi(i - 1), -x*b)
               call add(phi(i), 2*i + 1, -g)
               if (i > 1) call add(phi(i), 2*i - 1, g)
               m(2*i + 1, 2*i + 1) = arm%alpha/x                  ! (5.14), (5.16)
               call add(2*i + 1, phi(i + 1), g)
               call add(2*i + 1, phi(i), -g)
               call add(2*i + 1, 2*i + 3, -x*g)
               call add(2*i + 1, 2*i + 1, 2*x*g)
               if (i > 1) call add(2*i + 1, 2*i - 1, -x*g)
            end do
            m(2*n, 2*n:2*n + 1) = [arm%kappa, arm%zeta*arm%mu]    ! (5.17), zeta for xi
            call add(2*n, 2*n, x*b)
            call add(2*n, phi(n - 1), -x*b)
            m(2*n + 1, 2*n:2*n + 1) = [arm%zeta*arm%mu, arm%mu]   ! (5.18)
            call add(2*n + 1, 2*n, -g)
            call add(2*n + 1, 2*n + 1, x*g)
            call add(2*n + 1, 2*n - 1, -x*g)
            call check_rows(error, arm, m, k)
            call check(error, arm%m%symmetric .and. .not. arm%k%symmetric, 'declared symmetry')
            ! the shear term of the energy
            call add(2*n, 2*n, g/x)
            call add(2*n, 2*n + 1, -g)
            call add(2*n, 2*n - 1, g)
            call ready(error, arm, n, beam_timoshenko, arm_symmetric)
            call check_rows(error, arm, m, k)
            call check(error, arm%m%symmetric .and. arm%k%symmetric, 'declared symmetry')
         end associate
      end do

   contains

      pure integer function phi(i)
         integer, intent(in) :: i
         phi = max(1, 2*i)
      end function phi

      subroutine add(i, j, value)
         integer, intent(in) :: i, j
         real(wp), intent(in) :: value
         k(i, j) = k(i, j) + value
      end subroutine add
   end subroutine test_timoshenko_rows

   !> M and K exactly symmetric, M positive definite, K positive but for the rigid mode
   subroutine test_symmetry(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm
      real(wp), allocatable :: m(:, :), c(:, :), k(:, :), squares(:), rigid(:)
      integer, parameter :: segments(6) = [4, 7, 10, 20, 33, 100]
      integer :: i, beam, info, set

      do set = 1, 2
         if (set == 2) call other_parameters(arm)
         do beam = beam_euler_bernoulli, beam_timoshenko
            do i = 1, size(segments)
               call ready(error, arm, segments(i), beam, arm_symmetric)
               if (allocated(error)) return
               associate (n => arm%n)
                  allocate (m(n, n), c(n, n), k(n, n), squares(n), rigid(n))
                  call arm%dense_matrices(m, c, k)
                  call check(error, arm%m%symmetric .and. arm%k%symmetric, 'declared')
                  call check(error, maxval(abs(m - transpose(m))), 0.0_wp, 'M', thr=0.0_wp)
                  call check(error, maxval(abs(k - transpose(k))), 0.0_wp, 'K', thr=0.0_wp)
                  call symmetric_squares(m, k, squares, info)
                  call check(error, info, 0, 'M is positive definite')
                  call check(error, abs(squares(1)) <= n*epsilon(1.0_wp)*squares(n), 'one rigid mode')
                  call check(error, squares(2) > 1.0_wp, 'one rigid mode alone')
                  call arm%straight(1.0_wp, rigid)
                  call check_rigid(error, k, rigid)
                  if (beam == beam_timoshenko) then
                     ! the thesis's own rows have the rigid mode, too
                     call ready(error, arm, segments(i), beam, arm_consistent)
                     call arm%dense_matrices(m, c, k)
                     call check_rigid(error, k, rigid)
                  end if
                  deallocate (m, c, k, squares, rigid)
               end associate
            end do
         end do
      end do
   end subroutine test_symmetry

   !> K r = 0, each row to a few units of rounding of its terms
   subroutine check_rigid(error, k, rigid)
      type(error_type), allocatable, intent(inout) :: error
      real(wp), intent(in) :: k(:, :), rigid(:)
      real(wp) :: terms(size(rigid))
      integer :: i
      do i = 1, size(rigid)
         terms = k(i, :)*rigid
         call check(error, abs(sum(terms)) <= 4*epsilon(1.0_wp)*sum(abs(terms)), 'K times rigid mode')
      end do
   end subroutine check_rigid

   !> Frequencies, the square roots of the eigenvalues of M^-1 K
   subroutine frequencies(error, arm, omega)
      type(error_type), allocatable, intent(inout) :: error
      type(flexible_arm), intent(in) :: arm
      real(wp), intent(out) :: omega(:)
      real(wp), dimension(arm%n, arm%n) :: m, c, k
      real(wp) :: im(arm%n)
      integer :: info
      call arm%dense_matrices(m, c, k)
      call squared_frequencies(m, k, omega, im, info)
      call check(error, info, 0, 'eigenvalues')
      call check(error, maxval(abs(im)), 0.0_wp, 'poles on the imaginary axis', thr=1.0e-9_wp*maxval(abs(omega)))
      omega = sign(sqrt(abs(omega)), omega)
   end subroutine frequencies

   !> n = 20, eq. (4.37)
   subroutine test_frequencies(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm
      real(wp) :: omega(21)
      real(wp), parameter :: expected(2:7) = [10.1386_wp, 20.6687_wp, 35.5307_wp, 60.9669_wp, 92.3043_wp, 124.5055_wp]
      integer :: i
      call ready(error, arm, 20, beam_euler_bernoulli)
      call frequencies(error, arm, omega)
      call check(error, abs(omega(1)), 0.0_wp, 'rigid mode', thr=1.0e-4_wp)
      do i = 2, 7
         call check(error, omega(i), expected(i), 'frequency', thr=6.0e-5_wp)
      end do
      call check(error, omega(21), 386.7767_wp, 'highest frequency', thr=6.0e-5_wp)
      ! the lost sign: no rigid mode, a spurious pair
      call ready(error, arm, 20, beam_euler_bernoulli, arm_listing)
      call frequencies(error, arm, omega)
      call check(error, omega(1), 8.30_wp, 'listing, lowest', thr=5.1e-3_wp)
      call check(error, omega(21), 494.55_wp, 'listing, spurious', thr=5.1e-3_wp)
   end subroutine test_frequencies

   !> n = 20 under the feedback (4.38)
   subroutine test_closed_loop(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm
      type(status_type) :: status
      real(wp), dimension(21, 21) :: m, c, k
      real(wp) :: re(42), im(42), real_poles(2)
      integer :: info, variant, i
      do variant = arm_consistent, arm_listing
         call ready(error, arm, 20, beam_euler_bernoulli, variant)
         call arm%close_loop(status)
         call check(error, .not. status%failed(), trim(status%message))
         call arm%dense_matrices(m, c, k)
         call poles_of(m, c, k, re, im, info)
         call check(error, info, 0, 'eigenvalues')
         call check(error, count(re > 0.0_wp), merge(0, 2, variant == arm_consistent), 'unstable poles')
         call check(error, count(abs(im) < 1.0e-6_wp), 2, 'two real poles')
         real_poles = pack(re, abs(im) < 1.0e-6_wp)
         call check(error, minval(real_poles), -545.7863_wp, 'fast real pole', thr=6.0e-5_wp)
         call check(error, maxval(real_poles), merge(-3.6098_wp, -3.6852_wp, variant == arm_consistent), &
            & 'slow real pole', thr=6.0e-5_wp)
         i = findloc_above(im, 1.0e-6_wp)
         if (variant == arm_consistent) then
            call check(error, re(i), -0.0755_wp, 'first pair', thr=6.0e-5_wp)
            call check(error, im(i), 3.1686_wp, 'first pair', thr=6.0e-5_wp)
            call check(error, re(i + 1), -0.1649_wp, 'second pair', thr=6.0e-5_wp)
            call check(error, im(i + 1), 13.3363_wp, 'second pair', thr=6.0e-5_wp)
         else
            ! the spurious pair is unstable, with 40 digits, too; eigenvalues of size 500 leave 1e-11 of rounding
            call check(error, re(42), 2.25135571e-7_wp, 'spurious pair', thr=1.0e-10_wp)
            call check(error, im(42), 494.548501071_wp, 'spurious pair', thr=1.0e-8_wp)
         end if
      end do
   end subroutine test_closed_loop

   !> First of ascending numbers above a bound
   pure integer function findloc_above(x, bound) result(i)
      real(wp), intent(in) :: x(:), bound
      do i = 1, size(x)
         if (x(i) > bound) return
      end do
   end function findloc_above

   !> First order towards the frequencies of the beam (4.15)-(4.18): 9.9344, 20.7707, 36.5485
   subroutine test_fine(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm
      real(wp), parameter :: exact(3) = [9.9344_wp, 20.7707_wp, 36.5485_wp]
      real(wp), parameter :: expected(3) = [9.9408_wp, 20.7702_wp, 36.5237_wp]
      real(wp) :: omega(3, 2)
      integer :: i
      call lowest(640, omega(:, 2))
      do i = 1, 3
         call check(error, omega(i, 2), expected(i), 'n = 640', thr=6.0e-5_wp)
      end do
      call lowest(320, omega(:, 1))
      ! 9.9344 and 36.5485 have errors of 5e-5, against differences of 0.006 and 0.02
      call check(error, (omega(1, 1) - exact(1))/(omega(1, 2) - exact(1)), 2.0_wp, 'first order', thr=0.05_wp)
      call check(error, (omega(3, 1) - exact(3))/(omega(3, 2) - exact(3)), 2.0_wp, 'first order', thr=0.05_wp)

   contains

      subroutine lowest(n, frequency)
         integer, intent(in) :: n
         real(wp), intent(out) :: frequency(3)
         real(wp), allocatable :: m(:, :), c(:, :), k(:, :), squares(:)
         integer :: info
         call ready(error, arm, n, beam_euler_bernoulli)
         allocate (m(n + 1, n + 1), c(n + 1, n + 1), k(n + 1, n + 1), squares(n + 1))
         call arm%dense_matrices(m, c, k)
         call symmetric_squares(m, k, squares, info)
         call check(error, info, 0, 'eigenvalues')
         frequency = sqrt(squares(2:4))
      end subroutine lowest
   end subroutine test_fine

   !> n = 10, eq. (5.23); and the same limit from the symmetric variant
   subroutine test_timoshenko(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm
      real(wp), allocatable :: omega(:)
      real(wp), parameter :: expected(2:8) = [10.4657_wp, 19.8450_wp, 30.5413_wp, 49.4786_wp, 72.7140_wp, &
         & 95.1285_wp, 108.3677_wp]
      real(wp), parameter :: limit = 9.8140_wp        !! lowest frequency of the beam (5.7)-(5.10)
      real(wp) :: off
      integer :: i, variant
      allocate (omega(21))
      call ready(error, arm, 10, beam_timoshenko)
      call frequencies(error, arm, omega)
      call check(error, abs(omega(1)), 0.0_wp, 'rigid mode', thr=1.0e-4_wp)
      do i = 2, 8
         call check(error, omega(i), expected(i), 'frequency', thr=6.0e-5_wp)
      end do
      call check(error, omega(20), 253.5620_wp, 'frequency 20', thr=6.0e-5_wp)
      call check(error, omega(21), 333.6453_wp, 'highest frequency', thr=6.0e-5_wp)
      do variant = arm_consistent, arm_symmetric, arm_symmetric
         do i = 40, 80, 40
            deallocate (omega)
            allocate (omega(2*i + 1))
            call ready(error, arm, i, beam_timoshenko, variant)
            call frequencies(error, arm, omega)
            if (i == 80) then
               call check(error, off/(omega(2) - limit), 2.0_wp, 'first order', thr=0.05_wp)
            end if
            off = omega(2) - limit
         end do
      end do
   end subroutine test_timoshenko

   !> The closed loop's force is that of u in (4.38) along B, and the dense matrices say the same
   subroutine test_feedback(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: open, closed
      type(status_type) :: status
      real(wp), allocatable :: q(:), v(:), f_open(:), f_closed(:), m(:, :), c(:, :), k(:, :)
      real(wp), parameter :: gains(4) = [3.0_wp, 0.7_wp, -1.1_wp, 0.2_wp]
      real(wp) :: u
      integer :: beam, ierr, i
      call closed%close_loop(status)
      call check(error, status%code, dynstep_invalid_input, 'no arm yet')
      call status%clear()
      do beam = beam_euler_bernoulli, beam_timoshenko
         call ready(error, open, 6, beam)
         call ready(error, closed, 6, beam)
         call closed%close_loop(status, gains)
         associate (n => open%n)
            allocate (q(n), v(n), f_open(n), f_closed(n), m(n, n), c(n, n), k(n, n))
            q = [(sin(1.0_wp*i), i=1, n)]
            v = [(cos(2.0_wp*i), i=1, n)]
            call open%force(0.0_wp, q, v, f_open, ierr)
            call closed%force(0.0_wp, q, v, f_closed, ierr)
            u = -gains(1)*open%hub_angle(q) - gains(2)*open%hub_angle(v) - gains(3)*open%tip_deflection(q) &
               & - gains(4)*open%tip_deflection(v)
            call check(error, open%tip_deflection(q), q(n) - q(1), thr=0.0_wp)
            call check(error, f_closed(1) - f_open(1), u, 'u', thr=1.0e-13_wp)
            call check(error, maxval(abs(f_closed(2:) - f_open(2:))), 0.0_wp, 'B', thr=0.0_wp)
            call closed%dense_matrices(m, c, k)
            f_open = matmul(c, v)
            f_closed = f_closed + f_open
            f_open = matmul(k, q)
            call check(error, maxval(abs(f_closed + f_open)), 0.0_wp, 'dense', thr=1.0e-14_wp*maxval(abs(k)))
            deallocate (q, v, f_open, f_closed, m, c, k)
         end associate
         ! the thesis's gains by default; setup opens the loop
         call closed%close_loop(status)
         u = merge(18.6550_wp - 1.5000_wp, 16.3225_wp - 1.4012_wp, beam == beam_euler_bernoulli)
         call check(error, closed%coupling%k(1), u, 'default gains')
         u = merge(5.5285_wp - 0.0050_wp, 4.2234_wp - 0.0061_wp, beam == beam_euler_bernoulli)
         call check(error, closed%coupling%c(1), u, 'default gains')
         call ready(error, closed, 6, beam)
         call check(error, .not. closed%structure%is_coupled, 'setup opens the loop')
      end do
      call check(error, .not. status%failed(), trim(status%message))
   end subroutine test_feedback

   !> u(t) of the open loops, and the straight arm
   subroutine test_inputs(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm
      type(status_type) :: status
      real(wp) :: p(5), q(9)
      real(wp), parameter :: times(4) = [0.0_wp, 0.49_wp, 0.5_wp, 2.0_wp]
      real(wp), parameter :: expected(4, 0:3) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         & 0.1_wp, 0.1_wp, 0.0_wp, 0.0_wp,  0.1_wp, 0.1_wp, 0.1_wp, 0.1_wp,  0.0_wp, 0.049_wp, 0.05_wp, 0.2_wp], [4, 4])
      integer :: input, i, ierr
      call ready(error, arm, 4, beam_euler_bernoulli)
      do input = input_none, input_ramp
         call arm%set_input(input, status)
         do i = 1, 4
            call arm%load(times(i), p, ierr)
            call check(error, p(1), expected(i, input), 'u')
            call check(error, maxval(abs(p(2:))), 0.0_wp, 'B', thr=0.0_wp)
         end do
      end do
      call check(error, .not. status%failed(), trim(status%message))
      call arm%straight(0.5_wp*pi, p)
      call check(error, maxval(abs(p - 0.5_wp*pi*[1.0_wp, 0.25_wp, 0.5_wp, 0.75_wp, 1.0_wp])), 0.0_wp, 'straight')
      call ready(error, arm, 4, beam_timoshenko)
      call arm%straight(2.0_wp, q)
      call check(error, maxval(abs(q - [2.0_wp, 2.0_wp, 0.5_wp, 2.0_wp, 1.0_wp, 2.0_wp, 1.5_wp, 2.0_wp, 2.0_wp])), &
         & 0.0_wp, 'straight', thr=0.0_wp)
   end subroutine test_inputs

   !> The library's own check finds nothing, with input and feedback
   subroutine test_check(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm
      type(status_type) :: status
      character(len=finding_length), allocatable :: report(:)
      real(wp) :: q(13), v(13)
      integer :: beam, variant
      do beam = beam_euler_bernoulli, beam_timoshenko
         do variant = arm_consistent, arm_symmetric
            if (beam == beam_timoshenko .and. variant == arm_listing) cycle
            call ready(error, arm, 6, beam, variant)
            call arm%set_input(input_ramp, status)
            call arm%straight(0.3_wp, q(:arm%n))
            v(:arm%n) = 0.1_wp*q(:arm%n)
            call check_system(arm, 0.7_wp, q(:arm%n), v(:arm%n), report, status)
            call check(error, .not. status%failed(), trim(status%message))
            if (size(report) > 0) call test_failed(error, trim(report(1)))
         end do
      end do
   end subroutine test_check

   !> Each refusal names what is wrong, and leaves the arm as it was
   subroutine test_refuses(error)
      type(error_type), allocatable, intent(out) :: error
      type(flexible_arm) :: arm, good
      type(status_type) :: status
      call refused(good, 3, '4 segments or more')
      call refused(good, 0, '4 segments or more')
      call refused(good, huge(1), 'segments or more')
      arm = good
      arm%beam = beam_timoshenko
      call refused(arm, 1, '2 segments or more')
      arm%variant = arm_listing
      call refused(arm, 4, 'arm_listing is a variant')
      arm%variant = 3
      call refused(arm, 4, 'variant 3')
      arm%variant = arm_consistent
      arm%beam = 3
      call refused(arm, 4, 'beam 3')
      arm = good
      arm%eta = 0.0_wp
      call refused(arm, 4, 'eta of the arm must be positive')
      arm = good
      arm%beta = -1.0_wp
      call refused(arm, 4, 'beta of the arm must be positive')
      arm = good
      arm%alpha = ieee_value(1.0_wp, ieee_quiet_nan)
      call refused(arm, 4, 'alpha of the arm must be positive and finite')
      arm = good
      arm%mu = -0.01_wp
      call refused(arm, 4, 'must not be negative')
      arm%mu = ieee_value(1.0_wp, ieee_quiet_nan)
      call refused(arm, 4, 'must be finite')
      ! the tip's mass centre beyond its radius of gyration
      arm = good
      arm%delta = 0.0_wp
      arm%zeta = -4.0_wp
      call refused(arm, 4, 'not positive definite')
      ! no mass at the tip at all
      arm = good
      arm%delta = 0.0_wp
      arm%mu = 0.0_wp
      arm%kappa = 0.0_wp
      call refused(arm, 4, 'not positive definite')
      arm = good
      arm%beam = beam_timoshenko
      arm%delta = 0.0_wp
      call refused(arm, 4, 'delta of the arm must be positive')
      arm = good
      arm%beam = beam_timoshenko
      arm%gamma = 0.0_wp
      call refused(arm, 4, 'gamma of the arm must be positive')
      call ready(error, good, 5, beam_euler_bernoulli)
      call good%set_input(4, status)
      call check(error, index(status%message, 'input 4') > 0, 'input: '//trim(status%message))
      call status%clear()
      call good%setup(2, status)
      call check(error, status%failed() .and. good%segments == 5 .and. good%n == 6, 'the arm stays')

   contains

      subroutine refused(candidate, segments, words)
         type(flexible_arm), intent(in) :: candidate
         integer, intent(in) :: segments
         character(len=*), intent(in) :: words
         type(flexible_arm) :: copy
         copy = candidate
         call status%clear()
         call copy%setup(segments, status)
         call check(error, status%code, dynstep_invalid_input, words)
         call check(error, index(status%message, words) > 0, words//': '//trim(status%message))
         call check(error, copy%n, 0, 'the arm is set up')
         call status%clear()
      end subroutine refused
   end subroutine test_refuses
end module test_arms
