! SPDX-License-Identifier: BSD-3-Clause
!> The runs behind Jay & Negrut's Figs. 1, 2 and 4: errors at the end of the test problem (15) and of the
!> pendulum (16), with steps h/3, 2h/3, h/3, ... or of one length, from a_alpha = a0.
!>
!> Errors are 2-norms: of y, z, lambda, psi at t_end, and of a_{n+alpha} from a(t_end + alpha h_n).
module constrained_runs
   use dynstep_jay_negrut_problem, only: jay_negrut_problem
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_rod_pendulum, only: rod_pendulum
   use dynstep_soi2, only: soi2_stepper
   use dynstep_status, only: status_type
   use dynstep_stepper, only: allocate_state, state_type
   use paper_table, only: paper_table_type, value_of
   implicit none
   private

   public :: end_of_pendulum, first_steps, print_errors, compare_errors, observed_order, sweep, turn

   integer, parameter, public :: coarsest = 2, finest = 12       !! h = 2^-2 ... 2^-12
   character(len=*), parameter, public :: names(5) = [character(len=6) :: 'y', 'z', 'a', 'lambda', 'psi']

   integer, parameter, public :: test_problem = 1, pendulum = 2

   real(wp), parameter :: thirds(2) = [1.0_wp, 3.0_wp]/3.0_wp    ! ends of the steps, as parts of h
   real(wp), parameter :: whole(1) = [1.0_wp]

contains

   !> Errors of one problem for h = 2^-first ... 2^-finest
   subroutine sweep(problem, stepper, first, alternating, errors)
      integer, intent(in) :: problem                             !! test_problem or pendulum
      type(soi2_stepper), intent(in) :: stepper                  !! its options
      integer, intent(in) :: first
      logical, intent(in) :: alternating
      real(wp), intent(out) :: errors(5, coarsest:finest)
      integer :: k
      errors = 0.0_wp
      do k = first, finest
         if (problem == pendulum) then
            call pendulum_errors(stepper, 2.0_wp**(-k), alternating, errors(:, k))
         else
            call test_problem_errors(stepper, 2.0_wp**(-k), alternating, errors(:, k))
         end if
      end do
   end subroutine sweep

   !> (15) at t = 1
   subroutine test_problem_errors(stepper, h, alternating, errors)
      type(soi2_stepper), intent(in) :: stepper
      real(wp), intent(in) :: h
      logical, intent(in) :: alternating
      real(wp), intent(out) :: errors(5)
      type(jay_negrut_problem) :: sys
      type(state_type) :: state
      real(wp) :: a_alpha(2), t_alpha, q(2), v(2), a(2), unused(2), lambda(1), psi(1)
      call sys%setup()
      call run(stepper, sys, [1.0_wp, 1.0_wp, 1.0_wp, -2.0_wp], 1.0_wp, 1.0_wp, h, alternating, state, a_alpha, t_alpha)
      call sys%exact(1.0_wp, q, v, unused, lambda, psi)
      errors(1) = norm2(state%y(1:2) - q)
      errors(2) = norm2(state%y(3:4) - v)
      errors(4) = norm2(state%lambda - lambda)
      errors(5) = norm2(state%psi - psi)
      call sys%exact(t_alpha, q, v, a, lambda, psi)
      errors(3) = norm2(a_alpha - a)
   end subroutine test_problem_errors

   !> (16) at t = 2
   subroutine pendulum_errors(stepper, h, alternating, errors)
      type(soi2_stepper), intent(in) :: stepper
      real(wp), intent(in) :: h
      logical, intent(in) :: alternating
      real(wp), intent(out) :: errors(5)
      type(rod_pendulum) :: sys
      type(state_type) :: state
      real(wp) :: a_alpha(3), t_alpha, q(3), v(3), a(3), lambda(2), theta, rate
      call sys%setup()
      call sys%start(1.5_wp*acos(-1.0_wp), 10.0_wp, q, v)
      call run(stepper, sys, [q, v], 0.0_wp, 2.0_wp, h, alternating, state, a_alpha, t_alpha)
      call end_of_pendulum(theta, rate)
      call sys%angle_motion(theta, rate, q, v, a, lambda)
      errors(1) = norm2(state%y(1:3) - q)
      errors(2) = norm2(state%y(4:6) - v)
      errors(4) = norm2(state%lambda - lambda)
      errors(5) = 0.0_wp
      call turn(sys, t_alpha - 2.0_wp, 200, theta, rate)
      call sys%angle_motion(theta, rate, q, v, a, lambda)
      errors(3) = norm2(a_alpha - a)
   end subroutine pendulum_errors

   !> Errors of a and lambda of (16) after a few steps of one length
   subroutine first_steps(stepper, h, steps, error_a, error_lambda)
      type(soi2_stepper), intent(in) :: stepper
      real(wp), intent(in) :: h
      integer, intent(in) :: steps
      real(wp), intent(out) :: error_a, error_lambda
      type(rod_pendulum) :: sys
      type(state_type) :: state
      real(wp) :: a_alpha(3), t_alpha, q(3), v(3), a(3), lambda(2), at(2), x(2), q0(3), v0(3)
      call sys%setup()
      x = [1.5_wp*acos(-1.0_wp), 10.0_wp]
      call sys%start(x(1), x(2), q0, v0)
      call run(stepper, sys, [q0, v0], 0.0_wp, steps*h, h, .false., state, a_alpha, t_alpha)
      at = x
      call turn(sys, t_alpha, 200, at(1), at(2))
      call sys%angle_motion(at(1), at(2), q, v, a, lambda)
      error_a = norm2(a_alpha - a)
      at = x
      call turn(sys, steps*h, 200, at(1), at(2))
      call sys%angle_motion(at(1), at(2), q, v, a, lambda)
      error_lambda = norm2(state%lambda - lambda)
   end subroutine first_steps

   !> The motion of (16) at t = 2: the equation of the angle and the index-1 form of (16), solved with 40 digits,
   !> agree in 31
   pure subroutine end_of_pendulum(theta, rate)
      real(wp), intent(out) :: theta, rate
      theta = 4.727778699883551140468382_wp
      rate = -0.1981844347038809697476881_wp
   end subroutine end_of_pendulum

   !> The angle a time s later, by Kutta's rule; to 1e-13 with 200 steps for the s of last steps, at most 0.03
   pure subroutine turn(sys, s, steps, theta, rate)
      type(rod_pendulum), intent(in) :: sys
      real(wp), intent(in) :: s
      integer, intent(in) :: steps
      real(wp), intent(inout) :: theta, rate
      real(wp) :: x(2), k(2, 4), h
      integer :: i
      h = s/steps
      x = [theta, rate]
      do i = 1, steps
         k(:, 1) = slope(x)
         k(:, 2) = slope(x + 0.5_wp*h*k(:, 1))
         k(:, 3) = slope(x + 0.5_wp*h*k(:, 2))
         k(:, 4) = slope(x + h*k(:, 3))
         x = x + h/6.0_wp*(k(:, 1) + 2.0_wp*(k(:, 2) + k(:, 3)) + k(:, 4))
      end do
      theta = x(1)
      rate = x(2)
   contains
      pure function slope(at) result(rates)
         real(wp), intent(in) :: at(2)
         real(wp) :: rates(2), q(3), v(3), a(3), lambda(2)
         call sys%angle_motion(at(1), at(2), q, v, a, lambda)
         rates = [at(2), a(3)]
      end function slope
   end subroutine turn

   !> From t = 0 to t_end, and the a_{n+alpha} of the last step with its time
   subroutine run(options, sys, y0, guess, t_end, h, alternating, state, a_alpha, t_alpha)
      type(soi2_stepper), intent(in) :: options
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: y0(:)
      real(wp), intent(in) :: guess                              !! of all multipliers at the start
      real(wp), intent(in) :: t_end, h
      logical, intent(in) :: alternating
      type(state_type), intent(out) :: state
      real(wp), intent(out) :: a_alpha(:), t_alpha
      type(soi2_stepper) :: stepper
      type(status_type) :: status

      stepper = options
      stepper%second_order_start = .false.
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      if (.not. status%failed()) then
         state%y = y0
         state%lambda = guess
         state%psi = guess
      end if
      call stepper%start(sys, state, status)
      if (alternating) then
         call march(stepper, sys, state, h, thirds, nint(t_end/h), status)
         t_alpha = t_end + stepper%coefficients%alpha()*(2.0_wp*h/3.0_wp)
      else
         call march(stepper, sys, state, h, whole, nint(t_end/h), status)
         t_alpha = t_end + stepper%coefficients%alpha()*h
      end if
      if (status%failed()) then
         print '(a)', 'the run failed: '//trim(status%message)
         stop 1
      end if
      call stepper%last_a_alpha(a_alpha)
   end subroutine run

   !> Steps that end at t = h (k + ends), k = 0, 1, ...
   subroutine march(stepper, sys, state, h, ends, blocks, status)
      type(soi2_stepper), intent(inout) :: stepper
      class(mechanical_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      real(wp), intent(in) :: h, ends(:)
      integer, intent(in) :: blocks
      type(status_type), intent(inout) :: status
      type(state_type) :: trial
      real(wp) :: last
      integer :: block, i
      call allocate_state(sys, trial, status)
      do block = 0, blocks - 1
         last = 0.0_wp
         do i = 1, size(ends)
            call stepper%try_step(sys, state, (ends(i) - last)*h, (block + ends(i))*h, trial, status)
            if (status%failed()) return
            call stepper%accept(state, trial)
            last = ends(i)
         end do
      end do
   end subroutine march

   !> log2 of the error at 2h over the error at h = 2^-k
   pure real(wp) function observed_order(errors, component, k)
      real(wp), intent(in) :: errors(5, coarsest:finest)
      integer, intent(in) :: component, k
      observed_order = log(errors(component, k - 1)/errors(component, k))/log(2.0_wp)
   end function observed_order

   !> All errors with the orders between one h and the next
   subroutine print_errors(title, errors, first, components)
      character(len=*), intent(in) :: title
      real(wp), intent(in) :: errors(5, coarsest:finest)
      integer, intent(in) :: first, components
      integer :: i, k
      print '(a)', title
      print '(4x, a8, *(a14, 5x))', 'h', (trim(names(i))//' (order)', i=1, components)
      do k = first, finest
         if (k == first) then
            print '(4x, a5, i3, *(es11.3, 8x))', '2^', -k, errors(:components, k)
         else
            print '(4x, a5, i3, *(es11.3, " (", f5.2, ")"))', '2^', -k, &
               & (errors(i, k), observed_order(errors, i, k), i=1, components)
         end if
      end do
   end subroutine print_errors

   !> Errors for one h against the reference, to 2 %, and at 2^-finest the orders to 0.05
   subroutine compare_errors(table, errors, k, reference, orders, reason)
      type(paper_table_type), intent(inout) :: table
      real(wp), intent(in) :: errors(5, coarsest:finest)
      integer, intent(in) :: k
      character(len=*), intent(in) :: reference(:)               !! of y, z, a, lambda, psi; blank: none
      real(wp), intent(in), optional :: orders(:)                !! expected at 2^-finest
      character(len=*), intent(in), optional :: reason
      character(len=32) :: item
      real(wp) :: accept
      integer :: i
      do i = 1, size(reference)
         if (len_trim(reference(i)) == 0) cycle
         write (item, '("error of ", a, ", h = 2^-", i0)') trim(names(i)), k
         accept = 0.02_wp*value_of(reference(i))
         call table%agrees(item, trim(adjustl(reference(i))), errors(i, k), accept=accept)
      end do
      if (.not. present(orders)) return
      do i = 1, size(orders)
         item = 'order of '//names(i)
         if (i < size(orders)) then
            call table%holds(item, observed_order(errors, i, finest), orders(i), 0.05_wp)
         else
            call table%holds(item, observed_order(errors, i, finest), orders(i), 0.05_wp, reason)
         end if
      end do
   end subroutine compare_errors
end module constrained_runs
