! SPDX-License-Identifier: BSD-3-Clause
!> Models with constraints: Jacobians and curvatures against differences, declared patterns, exact solutions in the
!> equations of motion, starts, energy against the work of reactions, printed values.
module test_constrained_models
   use mechanism_cases, only: at, complete, consistent_point, difference_error, difference_step, differentiate, evaluate, &
      & exact_at, general_point, jacobians_at, make, models, names, no_direction, of_f, of_g, of_gv, of_k, of_r, &
      & point_type, weight
   use dynstep_check_system, only: check_system, finding_length
   use dynstep_jacobian, only: jacobian_type
   use dynstep_jay_negrut_problem, only: jay_negrut_problem
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_dense, kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_rod_chain, only: rod_chain
   use dynstep_rod_pendulum, only: rod_pendulum
   use dynstep_slider_crank, only: slider_crank
   use dynstep_status, only: dynstep_invalid_input, status_type
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_constrained_models

   real(wp), parameter :: pi = acos(-1.0_wp)

   !> Sums of some ten terms that cancel
   real(wp), parameter :: rounding = 1.0e-14_wp

contains

   subroutine collect_constrained_models(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('jacobians', test_jacobians), &
         & new_unittest('curvatures', test_curvatures), &
         & new_unittest('tangents', test_tangents), &
         & new_unittest('reactions', test_reactions), &
         & new_unittest('patterns', test_patterns), &
         & new_unittest('check-system', test_check_system), &
         & new_unittest('exact-solutions', test_exact_solutions), &
         & new_unittest('exact-derivatives', test_exact_derivatives), &
         & new_unittest('energy', test_energy), &
         & new_unittest('starts', test_starts), &
         & new_unittest('paper-starts', test_paper_starts), &
         & new_unittest('pendulum-angle', test_pendulum_angle), &
         & new_unittest('chain-angles', test_chain_angles), &
         & new_unittest('chain-band', test_chain_band), &
         & new_unittest('refusals', test_refusals)]
   end subroutine collect_constrained_models

   !> G, dg/dt and K, also where the pattern has no entry
   subroutine test_jacobians(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p, d
      type(jacobian_type) :: gq, kv
      real(wp), allocatable :: gt(:), y(:)
      real(wp) :: allowed
      integer :: number, i, j
      do number = 1, models
         call make(number, sys)
         p = general_point(sys)
         call jacobians_at(sys, p, gq, gt, kv)
         do j = 1, sys%n
            d = no_direction(sys)
            d%q(j) = 1.0_wp
            call differentiate(sys, of_g, p, d, y, allowed)
            do i = 1, sys%holonomic
               call check(error, gq%entry(i, j), y(i), 'G of '//names(number), thr=allowed)
            end do
            d = no_direction(sys)
            d%v(j) = 1.0_wp
            call differentiate(sys, of_k, p, d, y, allowed)
            do i = 1, sys%nonholonomic
               call check(error, kv%entry(i, j), y(i), 'K of '//names(number), thr=allowed)
            end do
         end do
         d = no_direction(sys)
         d%t = 1.0_wp
         call differentiate(sys, of_g, p, d, y, allowed)
         do i = 1, sys%holonomic
            call check(error, gt(i), y(i), 'dg/dt of '//names(number), thr=allowed)
         end do
      end do
   end subroutine test_jacobians

   !> (G v + g_t)' - G a and k' - K a along a motion, whatever its accelerations
   subroutine test_curvatures(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p, d
      type(jacobian_type) :: gq, kv
      real(wp), allocatable :: gt(:), y(:), c(:), ga(:)
      real(wp) :: allowed
      integer :: number, i, ierr
      do number = 1, models
         call make(number, sys)
         p = general_point(sys)
         d = no_direction(sys)
         d%t = 1.0_wp
         d%q = p%v
         d%v = p%a
         call jacobians_at(sys, p, gq, gt, kv)
         if (sys%holonomic > 0) then
            c = gt
            ga = gt
            call differentiate(sys, of_gv, p, d, y, allowed)
            call sys%constraint_curvature(p%t, p%q, p%v, c, ierr)
            call gq%multiply(p%a, ga)
            do i = 1, sys%holonomic
               call check(error, c(i), y(i) - ga(i), 'curvature of g of '//names(number), thr=allowed)
            end do
         end if
         if (sys%nonholonomic == 0) cycle
         c = p%psi
         ga = p%psi
         call differentiate(sys, of_k, p, d, y, allowed)
         call sys%velocity_curvature(p%t, p%q, p%v, c, ierr)
         call kv%multiply(p%a, ga)
         do i = 1, sys%nonholonomic
            call check(error, c(i), y(i) - ga(i), 'curvature of k of '//names(number), thr=allowed)
         end do
      end do
   end subroutine test_curvatures

   !> K and C of f - M a and of the reactions, also outside the declared structure
   subroutine test_tangents(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p
      type(matrix_type) :: k, c
      type(status_type) :: status
      integer :: number, ierr
      do number = 1, models
         call make(number, sys)
         p = general_point(sys)
         associate (s => sys%structure)
            call k%init(s%tangent, sys%n, 0, 0, s%tangent_is_symmetric, status)
            call c%init(merge(kind_zero, s%tangent, s%velocity_free), sys%n, 0, 0, s%tangent_is_symmetric, status)
         end associate
         call sys%tangent(p%t, p%q, p%v, p%a, k, c, ierr)
         call compare_tangents(of_f, 'f of '//names(number))
         if (.not. sys%constraints%has_reaction_tangent) cycle
         call k%set_zero()
         call c%set_zero()
         if (k%kind == kind_dense) k%a = 1.0_wp
         call sys%reaction_tangent(p%t, p%q, p%v, p%lambda, p%psi, k, c, ierr)
         if (k%kind == kind_dense) k%a = k%a - 1.0_wp     ! it is added
         call compare_tangents(of_r, 'r of '//names(number))
      end do

   contains

      subroutine compare_tangents(what, name)
         integer, intent(in) :: what
         character(len=*), intent(in) :: name
         type(point_type) :: d
         real(wp), allocatable :: y(:)
         real(wp) :: allowed
         integer :: i, j
         do j = 1, sys%n
            d = no_direction(sys)
            d%q(j) = 1.0_wp
            call differentiate(sys, what, p, d, y, allowed)
            do i = 1, sys%n
               call check(error, k%entry(i, j), -y(i), 'K of '//name, thr=allowed)
            end do
            d = no_direction(sys)
            d%v(j) = 1.0_wp
            call differentiate(sys, what, p, d, y, allowed)
            do i = 1, sys%n
               call check(error, c%entry(i, j), -y(i), 'C of '//name, thr=allowed)
            end do
         end do
      end subroutine compare_tangents
   end subroutine test_tangents

   !> dr/dlambda and dr/dpsi of the general reactions of (15)
   subroutine test_reactions(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p, d
      real(wp), allocatable :: y(:)
      real(wp) :: rl(2, 1), rp(2, 1), allowed
      integer :: i, ierr
      call make(1, sys)
      p = general_point(sys)
      rl = 0.0_wp
      rp = 0.0_wp
      call sys%reaction_jacobian(p%t, p%q, p%v, p%lambda, p%psi, rl, rp, ierr)
      d = no_direction(sys)
      d%lambda = 1.0_wp
      call differentiate(sys, of_r, p, d, y, allowed)
      do i = 1, 2
         call check(error, rl(i, 1), y(i), 'dr/dlambda', thr=allowed)
      end do
      d%lambda = 0.0_wp
      d%psi = 1.0_wp
      call differentiate(sys, of_r, p, d, y, allowed)
      do i = 1, 2
         call check(error, rp(i, 1), y(i), 'dr/dpsi', thr=allowed)
      end do
   end subroutine test_reactions

   !> Patterns that fit n and m, without an entry that is zero at a general point
   subroutine test_patterns(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p
      type(jacobian_type) :: gq, kv
      type(status_type) :: status
      real(wp), allocatable :: gt(:)
      integer :: number
      do number = 1, models
         call make(number, sys)
         p = general_point(sys)
         call sys%constraints%g%check('constraint_jacobian', sys%holonomic, sys%n, status)
         call sys%constraints%k%check('velocity_jacobian', sys%nonholonomic, sys%n, status)
         call check(error, .not. status%failed(), trim(status%message))
         if (status%failed()) return
         call jacobians_at(sys, p, gq, gt, kv)
         if (.not. sys%constraints%g%is_dense()) call check(error, all(abs(gq%value) > 0.0_wp), 'G of '//names(number))
         if (.not. sys%constraints%k%is_dense()) call check(error, all(abs(kv%value) > 0.0_wp), 'K of '//names(number))
      end do
   end subroutine test_patterns

   subroutine test_check_system(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p
      type(status_type) :: status
      character(len=finding_length), allocatable :: report(:)
      integer :: number
      do number = 1, models
         call make(number, sys)
         p = general_point(sys)
         call check_system(sys, p%t, p%q, p%v, report, status)
         call check(error, .not. status%failed(), trim(names(number))//': '//trim(status%message))
      end do
   end subroutine test_check_system

   !> f + r - M a = 0 and all levels of both kinds of constraints, at round-off
   subroutine test_exact_solutions(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p
      logical :: has_one
      integer :: number, i, found
      found = 0
      do number = 1, models
         call make(number, sys)
         do i = 0, 8
            call exact_at(sys, 0.25_wp*i, p, has_one)
            if (.not. has_one) exit
            call solves_equations(error, sys, p, trim(names(number)))
            found = found + 1
         end do
      end do
      call check(error, found, 4*9, 'exact solutions')
   end subroutine test_exact_solutions

   subroutine solves_equations(error, sys, p, name)
      type(error_type), allocatable, intent(inout) :: error
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(in) :: p
      character(len=*), intent(in) :: name
      type(point_type) :: without
      type(jacobian_type) :: gq, kv
      real(wp), allocatable :: gt(:), c(:), ga(:), f(:), r(:), y(:)
      integer :: i, ierr
      without = p
      without%a = 0.0_wp
      call evaluate(sys, of_f, without, f)
      call evaluate(sys, of_r, p, r)
      call evaluate(sys, of_f, p, y)
      call check_zero(y + r, sum(abs(f)) + sum(abs(r)), 'motion')
      call jacobians_at(sys, p, gq, gt, kv)
      if (sys%holonomic > 0) then
         call evaluate(sys, of_g, p, y)
         call check_zero(y, sum(abs(p%q)), 'g')
         call evaluate(sys, of_gv, p, y)
         call check_zero(y, sum(abs(p%v)), 'G v + g_t')
         c = gt
         ga = gt
         call sys%constraint_curvature(p%t, p%q, p%v, c, ierr)
         call gq%multiply(p%a, ga)
         call check_zero(ga + c, sum(abs(c)), 'second derivative of g')
      end if
      if (sys%nonholonomic > 0) then
         call evaluate(sys, of_k, p, y)
         call check_zero(y, sum(abs(p%v)), 'k')
         c = p%psi
         ga = p%psi
         call sys%velocity_curvature(p%t, p%q, p%v, c, ierr)
         call kv%multiply(p%a, ga)
         call check_zero(ga + c, sum(abs(c)), 'derivative of k')
      end if

   contains

      subroutine check_zero(x, scale, what)
         real(wp), intent(in) :: x(:), scale
         character(len=*), intent(in) :: what
         do i = 1, size(x)
            call check(error, x(i), 0.0_wp, what//' of '//name, thr=rounding*(1.0_wp + scale))
         end do
      end subroutine check_zero
   end subroutine solves_equations

   !> v = q', a = v'
   subroutine test_exact_derivatives(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p, x
      real(wp), allocatable :: dq(:), dv(:)
      logical :: has_one
      integer :: number, i, j
      do number = 1, 6
         call make(number, sys)
         call exact_at(sys, 0.9_wp, p, has_one)
         if (.not. has_one) cycle
         dq = 0.0_wp*p%q
         dv = dq
         do i = 1, 6
            call exact_at(sys, 0.9_wp + at(i)*difference_step, x, has_one)
            dq = dq + (weight(i)/difference_step)*x%q
            dv = dv + (weight(i)/difference_step)*x%v
         end do
         do j = 1, sys%n
            call check(error, p%v(j), dq(j), 'v of '//names(number), thr=difference_error*(1.0_wp + sum(abs(p%q))))
            call check(error, p%a(j), dv(j), 'a of '//names(number), thr=difference_error*(1.0_wp + sum(abs(p%v))))
         end do
      end do
   end subroutine test_exact_derivatives

   !> E' = -lambda . (G v) - psi . (K v) - c theta'^2 = lambda . g_t - psi . (K v) - c theta'^2
   subroutine test_energy(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p
      type(jacobian_type) :: gq, kv
      real(wp), allocatable :: gt(:), held(:)
      real(wp) :: energy, power, expected, s, largest
      integer :: number, i, ierr
      do number = 2, models
         call make(number, sys)
         call check(error, sys%structure%has_energy, 'has_energy of '//names(number))
         call consistent_point(sys, p)
         call complete(sys, p)
         call jacobians_at(sys, p, gq, gt, kv)
         power = 0.0_wp
         largest = 0.0_wp
         do i = 1, 6
            s = at(i)*difference_step
            call sys%energy(p%t + s, p%q + s*p%v, p%v + s*p%a, energy, ierr)
            power = power + (weight(i)/difference_step)*energy
            largest = max(largest, abs(energy))
         end do
         held = p%psi
         call kv%multiply(p%v, held)
         expected = dot_product(p%lambda, gt) - dot_product(p%psi, held)
         select type (sys)
         type is (rod_pendulum)
            expected = expected - sys%c*p%v(3)**2
         end select
         call check(error, power, expected, 'power of '//names(number), thr=difference_error*(1.0_wp + largest))
      end do
   end subroutine test_energy

   !> Starts lie on both levels of the constraints
   subroutine test_starts(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(slider_crank) :: crank
      type(point_type) :: p
      type(status_type) :: status
      real(wp), allocatable :: gv(:)
      real(wp) :: velocity(2)
      integer :: number, i
      do number = 2, models
         call make(number, sys)
         call consistent_point(sys, p)
         call complete(sys, p)
         call solves_equations(error, sys, p, trim(names(number)))
      end do
      call crank%setup()
      p = no_direction(crank)
      do i = 0, 12                                        ! all round, the dead centres among them
         call crank%start(i*pi/6.0_wp, pi, p%q, p%v, status)
         call complete(crank, p)
         call solves_equations(error, crank, p, 'slider_crank all round')
      end do
      p%v = p%v + [(0.1_wp*i, i=1, 9)]
      velocity = crank%pin_velocity(p%q, p%v)
      call evaluate(crank, of_gv, p, gv)
      call check(error, velocity(1), gv(1), 'pin O, x')
      call check(error, velocity(2), gv(2), 'pin O, y')
      call check(error, .not. status%failed(), trim(status%message))
   end subroutine test_starts

   !> Initial values in section 8 of the paper, and those that belong to them
   subroutine test_paper_starts(error)
      type(error_type), allocatable, intent(out) :: error
      type(jay_negrut_problem) :: problem
      type(rod_pendulum) :: pendulum
      type(point_type) :: p
      integer :: i
      call problem%setup()
      p = no_direction(problem)
      call problem%exact(0.0_wp, p%q, p%v, p%a, p%lambda, p%psi)
      call compare([p%q, p%v, p%a, p%lambda, p%psi], [1.0_wp, 1.0_wp, 1.0_wp, -2.0_wp, 1.0_wp, 4.0_wp, 1.0_wp, 1.0_wp])
      call pendulum%setup()
      p = no_direction(pendulum)
      call pendulum%angle_motion(1.5_wp*pi, 10.0_wp, p%q, p%v, p%a, p%lambda)
      call compare([p%q, p%v, p%a, p%lambda], [0.0_wp, -2.0_wp, 1.5_wp*pi, 20.0_wp, 0.0_wp, 10.0_wp, &
         & -75.0_wp, 200.0_wp, -37.5_wp, 375.0_wp, -1049.05_wp])

   contains

      subroutine compare(x, expected)
         real(wp), intent(in) :: x(:), expected(:)
         do i = 1, size(expected)
            call check(error, x(i), expected(i), 'start', thr=rounding*maxval(abs(expected)))
         end do
      end subroutine compare
   end subroutine test_paper_starts

   !> The equation of the angle gives what the constrained equations give
   subroutine test_pendulum_angle(error)
      type(error_type), allocatable, intent(out) :: error
      type(rod_pendulum) :: sys
      type(point_type) :: p, x
      integer :: i, j
      call sys%setup()
      p = no_direction(sys)
      x = p
      do i = 1, 7
         call sys%angle_motion(0.9_wp*i, 4.0_wp - i, p%q, p%v, p%a, p%lambda)
         x%q = p%q
         x%v = p%v
         call complete(sys, x)
         do j = 1, 3
            call check(error, x%a(j), p%a(j), 'a', thr=rounding*sum(abs(p%a)))
         end do
         do j = 1, 2
            call check(error, x%lambda(j), p%lambda(j), 'lambda', thr=rounding*sum(abs(p%lambda)))
         end do
      end do
   end subroutine test_pendulum_angle

   !> One rod: theta'' = -(3 g/(2 l)) cos(theta).  Two: Lagrange's equations in both angles,
   !>   (4/3) theta1'' + (1/2) cos(d) theta2'' = -(1/2) sin(d) theta2'^2 - (3/2) (g/l) cos(theta1),   d = theta1 - theta2
   !>   (1/2) cos(d) theta1'' + (1/3) theta2'' =  (1/2) sin(d) theta1'^2 - (1/2) (g/l) cos(theta2)
   subroutine test_chain_angles(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p
      real(wp) :: ratio, d, left(2)
      call make(7, sys)
      ratio = 9.81_wp/0.8_wp
      call consistent_point(sys, p)
      call complete(sys, p)
      call check(error, p%a(3), -1.5_wp*ratio*cos(p%q(3)), 'one rod', thr=rounding*ratio)
      call make(8, sys)
      call consistent_point(sys, p)
      call complete(sys, p)
      d = p%q(3) - p%q(6)
      left = [4.0_wp/3.0_wp*p%a(3) + 0.5_wp*cos(d)*p%a(6), 0.5_wp*cos(d)*p%a(3) + p%a(6)/3.0_wp]
      call check(error, left(1), -0.5_wp*sin(d)*p%v(6)**2 - 1.5_wp*ratio*cos(p%q(3)), 'first rod', thr=10*rounding*ratio)
      call check(error, left(2), 0.5_wp*sin(d)*p%v(3)**2 - 0.5_wp*ratio*cos(p%q(6)), 'second rod', thr=10*rounding*ratio)
   end subroutine test_chain_angles

   !> In the declared order no entry of the equations is more than four places from the diagonal
   subroutine test_chain_band(error)
      type(error_type), allocatable, intent(out) :: error
      type(rod_chain) :: sys
      type(status_type) :: status
      integer, allocatable :: place(:)
      integer :: i, e, band
      call sys%setup(40, status)
      call check(error, .not. status%failed(), trim(status%message))
      call check(error, size(sys%constraints%order), 5*40)
      allocate (place(5*40))
      place = 0
      do i = 1, size(place)
         place(sys%constraints%order(i)) = i
      end do
      call check(error, all(place > 0), 'a permutation')
      band = 0
      associate (g => sys%constraints%g)
         do i = 1, sys%holonomic
            do e = g%first(i), g%first(i + 1) - 1
               band = max(band, abs(place(sys%n + i) - place(g%column(e))))
            end do
         end do
      end associate
      call check(error, band, 4, 'band')
   end subroutine test_chain_band

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(slider_crank) :: crank
      type(rod_chain) :: chain
      type(status_type) :: status
      real(wp) :: q(9), v(9)
      crank%l2 = 0.25_wp
      call crank%setup()
      call crank%start(0.1_wp, 1.0_wp, q, v, status)
      call check(error, .not. status%failed(), 'in reach')
      call crank%start(0.5_wp*pi, 1.0_wp, q, v, status)
      call check(error, status%code, dynstep_invalid_input, trim(status%message))
      call status%clear()
      call chain%setup(0, status)
      call check(error, status%code, dynstep_invalid_input, trim(status%message))
   end subroutine test_refusals
end module test_constrained_models
