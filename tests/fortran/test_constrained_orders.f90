! SPDX-License-Identifier: BSD-3-Clause
!> Order 2 of generalized-alpha-SOI2 in every component, on motions that are in neither paper (known_motions).
!>
!> An error is the root of the mean square over a run, or over its second half where the start is of first order.  Errors are
!> C h^2 (1 + c h + ...): with 512 and 1024 steps, c h <= 0.1 leaves orders
!> between 1.9 and 2.1.
module test_constrained_orders
   use dynstep, only: allocate_state, coefficients_of, generalized_alpha_stepper, mass_recomputed, mass_stored, soi2_stepper, &
      & state_type, status_type, variant_reduced, variant_soi2, wp
   use known_motions, only: known_motion, motion_names, motions, new_motion
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_constrained_orders

   integer, parameter :: components = 6
   character(len=7), parameter :: component_names(components) = [character(len=7) :: 'q', 'v', 'a', 'a_alpha', 'lambda', 'psi']

   integer, parameter :: constant = 1, alternating = 2, irregular = 3
   character(len=11), parameter :: pattern_names(3) = [character(len=11) :: 'constant', 'alternating', 'irregular']

   real(wp), parameter :: rho_inf(5) = [0.0_wp, 0.2_wp, 0.5_wp, 0.8_wp, 0.9_wp]

   integer, parameter :: steps = 512

   !> What a run is made with
   type :: way_type
      real(wp) :: rho_inf = 0.8_wp
      integer :: pattern = constant
      integer :: variant = variant_soi2
      integer :: mass_at = mass_stored
      logical :: adjusts = .true.
      logical :: second_order_start = .true.
      real(wp) :: t_end = 1.0_wp
   end type way_type

contains

   subroutine collect_constrained_orders(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('forward', test_forward), &
         & new_unittest('backward', test_backward), &
         & new_unittest('mass evaluated anew', test_recomputed), &
         & new_unittest('start of first order', test_plain_start), &
         & new_unittest('reduced variant', test_reduced), &
         & new_unittest('without (14)', test_unadjusted), &
         & new_unittest('rho_inf = 1', test_no_damping)]
   end subroutine collect_constrained_orders

   !> Lengths of n steps over an interval of length 1.  Irregular ones repeat 32 random lengths, so that
   !> halved steps follow each other in the same way; ratios are at most 1.1/0.6, below the limit 2 of rho_inf = 0.
   pure function lengths(pattern, n) result(h)
      integer, intent(in) :: pattern, n
      real(wp) :: h(n)
      integer :: i, state
      h = 1.0_wp
      if (pattern == alternating) h(1::2) = 0.5_wp
      if (pattern == irregular) then
         state = 12345
         do i = 1, n
            if (modulo(i, 32) == 1) state = 12345
            state = modulo(state*1103 + 12347, 65536)
            h(i) = 0.6_wp + 0.5_wp*real(state, wp)/65536.0_wp
         end do
      end if
      h = h/sum(h)
   end function lengths

   !> Errors of a run
   subroutine measure(number, way, n, errors, status)
      integer, intent(in) :: number
      type(way_type), intent(in) :: way
      integer, intent(in) :: n
      real(wp), intent(out) :: errors(components)
      type(status_type), intent(inout) :: status
      class(known_motion), allocatable :: sys
      class(soi2_stepper), allocatable :: stepper
      type(state_type) :: state, trial
      real(wp), allocatable :: q(:), v(:), a(:), lambda(:), psi(:), a_alpha(:)
      real(wp) :: h(n)
      integer :: i

      call new_motion(number, sys)
      if (sys%holonomic + sys%nonholonomic > 0) then
         allocate (soi2_stepper :: stepper)
      else
         allocate (generalized_alpha_stepper :: stepper)
      end if
      call coefficients_of(way%rho_inf, stepper%coefficients, status)
      stepper%variant = way%variant
      stepper%mass_at = way%mass_at
      stepper%adjust_acceleration = way%adjusts
      stepper%adjust_momentum = way%adjusts
      stepper%second_order_start = way%second_order_start
      allocate (q(sys%n), v(sys%n), a(sys%n), a_alpha(sys%n), lambda(sys%holonomic), psi(sys%nonholonomic))
      call sys%at(0.0_wp, q, v, a, lambda, psi)
      state%y = [q, v]
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      call allocate_state(sys, trial, status)
      errors = 0.0_wp
      h = way%t_end*lengths(way%pattern, n)
      do i = 1, n
         call stepper%try_step(sys, state, h(i), state%t + h(i), trial, status)
         if (status%failed()) return
         call stepper%accept(state, trial)
         if (.not. way%second_order_start .and. 2*i < n) cycle
         call sys%at(state%t, q, v, a, lambda, psi)
         errors(1) = errors(1) + abs(h(i))*sum((state%y(:sys%n) - q)**2)
         errors(2) = errors(2) + abs(h(i))*sum((state%y(sys%n + 1:) - v)**2)
         errors(3) = errors(3) + abs(h(i))*sum((state%a - a)**2)
         errors(5) = errors(5) + abs(h(i))*sum((state%lambda - lambda)**2)
         errors(6) = errors(6) + abs(h(i))*sum((state%psi - psi)**2)
         call sys%at(state%t + stepper%coefficients%alpha()*h(i), q, v, a, lambda, psi)
         call stepper%last_a_alpha(a_alpha)
         errors(4) = errors(4) + abs(h(i))*sum((a_alpha - a)**2)
      end do
      errors = sqrt(errors)
   end subroutine measure

   !> Orders between two numbers of steps; 0 where a system has no such component
   subroutine find_orders(error, number, way, n, orders)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: number
      type(way_type), intent(in) :: way
      integer, intent(in) :: n
      real(wp), intent(out) :: orders(components)
      real(wp) :: coarse(components), fine(components)
      type(status_type) :: status
      call measure(number, way, n, coarse, status)
      call measure(number, way, 2*n, fine, status)
      call check(error, status%code, 0, trim(motion_names(number))//': '//trim(status%message))
      orders = 0.0_wp
      where (fine > 0.0_wp .and. coarse > 0.0_wp) orders = log(coarse/fine)/log(2.0_wp)
   end subroutine find_orders

   subroutine check_order(error, number, way, n)
      type(error_type), allocatable, intent(inout) :: error
      integer, intent(in) :: number
      type(way_type), intent(in) :: way
      integer, intent(in) :: n
      real(wp) :: orders(components)
      character(len=120) :: name
      integer :: i
      call find_orders(error, number, way, n, orders)
      do i = 1, components
         if (.not. abs(orders(i)) > 0.0_wp) cycle
         write (name, '(5a, f4.1)') trim(motion_names(number)), ', ', trim(component_names(i)), ', ', &
            & trim(pattern_names(way%pattern)), way%rho_inf
         call check(error, orders(i), 2.0_wp, trim(name), thr=0.1_wp)
      end do
   end subroutine check_order

   subroutine test_forward(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: number, i, pattern
      do number = 1, motions
         do i = 1, size(rho_inf)
            do pattern = constant, irregular
               call check_order(error, number, way_type(rho_inf=rho_inf(i), pattern=pattern), steps)
            end do
         end do
      end do
   end subroutine test_forward

   subroutine test_backward(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: number, i
      do number = 1, motions
         do i = 1, size(rho_inf)
            call check_order(error, number, way_type(rho_inf=rho_inf(i), pattern=irregular, t_end=-1.0_wp), steps)
         end do
      end do
   end subroutine test_backward

   subroutine test_recomputed(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: number, i, pattern
      do number = 1, motions
         if (number /= 3 .and. number /= 5 .and. number /= 6) cycle
         do i = 1, size(rho_inf)
            do pattern = constant, irregular
               call check_order(error, number, way_type(rho_inf=rho_inf(i), pattern=pattern, mass_at=mass_recomputed), steps)
            end do
         end do
      end do
   end subroutine test_recomputed

   subroutine test_plain_start(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: number, i
      do number = 1, motions
         do i = 1, size(rho_inf)
            call check_order(error, number, way_type(rho_inf=rho_inf(i), pattern=alternating, second_order_start=.false.), steps)
         end do
      end do
   end subroutine test_plain_start

   !> On systems with both kinds of constraints; with one kind it is SOI2
   subroutine test_reduced(error)
      type(error_type), allocatable, intent(out) :: error
      integer :: i
      do i = 1, size(rho_inf)
         call check_order(error, 3, way_type(rho_inf=rho_inf(i), pattern=irregular, variant=variant_reduced), steps)
         call check_order(error, 7, way_type(rho_inf=rho_inf(i), pattern=alternating, variant=variant_reduced), steps)
      end do
   end subroutine test_reduced

   !> What (14) is for: a_alpha is off by alpha times the change of the step times a' in every step
   subroutine test_unadjusted(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: orders(components)
      integer :: i
      do i = 2, 4
         call find_orders(error, 3, way_type(rho_inf=rho_inf(i), pattern=alternating, adjusts=.false.), steps, orders)
         call check(error, maxval(orders) < 1.3_wp .and. minval(orders) > 0.9_wp, 'alternating steps without (14)')
      end do
   end subroutine test_unadjusted

   !> Nothing damps the error that a change of the step puts into accelerations and multipliers of constraints
   subroutine test_no_damping(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: orders(components)
      integer :: number, i
      do number = 1, motions
         call check_order(error, number, way_type(rho_inf=1.0_wp), steps)
         if (number == 5 .or. number == 6) cycle
         call find_orders(error, number, way_type(rho_inf=1.0_wp, pattern=alternating), steps, orders)
         do i = 1, components
            if (.not. abs(orders(i)) > 0.0_wp) cycle
            call check(error, orders(i), merge(2.0_wp, 1.0_wp, i <= 2), trim(motion_names(number))//', ' &
               & //trim(component_names(i))//', alternating', thr=0.1_wp)
         end do
      end do
   end subroutine test_no_damping
end module test_constrained_orders
