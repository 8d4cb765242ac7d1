! SPDX-License-Identifier: BSD-3-Clause
!> The papers' models: invariants, tangents, exact solutions, frequencies, printed numbers.
module test_models
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use dynstep_bilinear_spring, only: bilinear_spring, law_literal, law_odd
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_dense, kind_diagonal, matrix_type
   use dynstep_oscillator, only: free_oscillator, loaded_oscillator
   use dynstep_shear_building, only: shear_building
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_two_body, only: two_body_system
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_models

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   subroutine collect_models(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('free-oscillator', test_free_oscillator), &
         & new_unittest('loaded-oscillator', test_loaded_oscillator), &
         & new_unittest('two-body-start', test_two_body_start), &
         & new_unittest('two-body-invariants', test_two_body_invariants), &
         & new_unittest('two-body-tangent', test_two_body_tangent), &
         & new_unittest('spring-law', test_spring_law), &
         & new_unittest('spring-crossings', test_spring_crossings), &
         & new_unittest('spring-exact', test_spring_exact), &
         & new_unittest('spring-start-on-an-edge', test_spring_edge), &
         & new_unittest('building-frequencies', test_building_frequencies), &
         & new_unittest('building-damping', test_building_damping), &
         & new_unittest('building-load', test_building_load), &
         & new_unittest('building-refuses', test_building_refuses)]
   end subroutine collect_models

   subroutine test_free_oscillator(error)
      type(error_type), allocatable, intent(out) :: error
      type(linear_system) :: sys
      type(status_type) :: status
      real(wp) :: f(1), energy
      integer :: ierr
      call free_oscillator(sys, 2.0_wp, 16.0_wp, status)
      call sys%force(0.0_wp, [0.5_wp], [3.0_wp], f, ierr)
      call check(error, f(1), -8.0_wp)
      call sys%energy(0.0_wp, [0.5_wp], [3.0_wp], energy, ierr)
      call check(error, energy, 11.0_wp)
      call check(error, .not. status%failed() .and. ierr == 0)
   end subroutine test_free_oscillator

   !> Equation (47) solves (46), has the right start, and derivatives that fit each other
   subroutine test_loaded_oscillator(error)
      type(error_type), allocatable, intent(out) :: error
      type(loaded_oscillator) :: sys
      type(status_type) :: status
      real(wp) :: t, x, v, a, f(1), left(3), right(3)
      real(wp), parameter :: h = 1.0e-5_wp
      integer :: i, ierr
      call sys%setup(status)
      call check(error, .not. status%failed(), trim(status%message))
      call sys%exact(0.0_wp, x, v, a)
      call check(error, x, 1.0_wp)
      call check(error, v, -2.0_wp)
      do i = 0, 20
         t = 0.3_wp*i
         call sys%exact(t, x, v, a)
         call sys%force(t, [x], [v], f, ierr)
         call check(error, a, f(1), 'the equation of motion', thr=1.0e-14_wp)
         call sys%exact(t - h, left(1), left(2), left(3))
         call sys%exact(t + h, right(1), right(2), right(3))
         call check(error, (right(1) - left(1))/(2*h), v, 'velocity', thr=1.0e-8_wp)
         call check(error, (right(2) - left(2))/(2*h), a, 'acceleration', thr=1.0e-8_wp)
      end do
   end subroutine test_loaded_oscillator

   subroutine paper_bodies(sys)
      type(two_body_system), intent(out) :: sys
      call sys%setup(m1=1.0_wp, m2=2.0_wp, d1=1.0_wp, d2=1.5_wp, i1=1.0_wp, i2=3.0_wp)
   end subroutine paper_bodies

   !> Accelerations from the equations of motion
   subroutine accelerations(sys, q, v, a)
      type(two_body_system), intent(inout) :: sys
      real(wp), intent(in) :: q(2), v(2)
      real(wp), intent(out) :: a(2)
      real(wp) :: f(4)
      integer :: ierr
      call sys%rhs(0.0_wp, [q, v], f, ierr)
      a = f(3:4)
   end subroutine accelerations

   !> Numbers of the paper, and their further digits
   subroutine test_two_body_start(error)
      type(error_type), allocatable, intent(out) :: error
      type(two_body_system) :: sys
      real(wp) :: a(2)
      call paper_bodies(sys)
      call accelerations(sys, [0.0_wp, 1.0_wp], [0.0_wp, 5.0_wp], a)
      call check(error, a(1), 13.133257709459068111_wp, thr=1.0e-14_wp)
      call check(error, a(2), -1.576873205329168320_wp, thr=1.0e-14_wp)
      call check(error, sys%momentum([0.0_wp, 1.0_wp], [0.0_wp, 5.0_wp]), 25.201511529340698587_wp)
      call check(error, sys%lagrangian([0.0_wp, 1.0_wp], [0.0_wp, 5.0_wp]), 56.25_wp)
   end subroutine test_two_body_start

   !> Along the motion both invariants stand still: their differences over +-h vanish with h^3
   subroutine test_two_body_invariants(error)
      type(error_type), allocatable, intent(out) :: error
      type(two_body_system) :: sys
      real(wp), parameter :: q(2) = [0.3_wp, 1.7_wp], v(2) = [-1.1_wp, 2.3_wp], h = 1.0e-5_wp
      real(wp) :: a(2), energy
      integer :: ierr
      call paper_bodies(sys)
      call accelerations(sys, q, v, a)
      associate (q0 => q - h*v + 0.5_wp*h**2*a, v0 => v - h*a, q1 => q + h*v + 0.5_wp*h**2*a, v1 => v + h*a)
         call check(error, (sys%momentum(q1, v1) - sys%momentum(q0, v0))/(2*h), 0.0_wp, 'momentum', thr=1.0e-8_wp)
         call check(error, (sys%lagrangian(q1, v1) - sys%lagrangian(q0, v0))/(2*h), 0.0_wp, 'Lagrangian', thr=1.0e-8_wp)
      end associate
      call sys%energy(0.0_wp, q, v, energy, ierr)
      call check(error, energy, sys%lagrangian(q, v))
      call check(error, sys%structure%has_energy)
   end subroutine test_two_body_invariants

   subroutine test_two_body_tangent(error)
      type(error_type), allocatable, intent(out) :: error
      type(two_body_system) :: sys
      type(matrix_type) :: k, c, k_difference, c_difference
      type(status_type) :: status
      real(wp), parameter :: q(2) = [0.3_wp, 1.7_wp], v(2) = [-1.1_wp, 2.3_wp], a(2) = [4.0_wp, -0.7_wp]
      integer :: ierr
      call paper_bodies(sys)
      call k%init(kind_dense, 2, 0, 0, .false., status)
      call c%init(kind_dense, 2, 0, 0, .false., status)
      k_difference = k
      c_difference = c
      call sys%tangent(0.0_wp, q, v, a, k, c, ierr)
      call sys%difference_tangent(0.0_wp, q, v, a, k_difference, c_difference, ierr)
      call check(error, maxval(abs(k%a - k_difference%a)), 0.0_wp, 'K', thr=1.0e-6_wp)
      call check(error, maxval(abs(c%a - c_difference%a)), 0.0_wp, 'C', thr=1.0e-6_wp)
      call check(error, maxval(abs(k%a)) > 1.0_wp .and. maxval(abs(c%a)) > 1.0_wp)
   end subroutine test_two_body_tangent

   !> Force, its integral and its derivative, in all zones of both laws
   subroutine test_spring_law(error)
      type(error_type), allocatable, intent(out) :: error
      type(bilinear_spring) :: sys
      type(matrix_type) :: k, c
      type(status_type) :: status
      real(wp), parameter :: places(5) = [-2.5_wp, -1.25_wp, 0.4_wp, 1.25_wp, 2.5_wp], h = 1.0e-5_wp
      real(wp) :: f(1), left(1), right(1), energy(2)
      integer :: law, i, ierr
      call sys%setup()
      call k%init(kind_diagonal, 1, 0, 0, .true., status)
      do law = law_odd, law_literal
         sys%law = law
         do i = 1, size(places)
            associate (x => places(i:i))
               call sys%force(0.0_wp, x, [0.0_wp], f, ierr)
               call sys%force(0.0_wp, x - h, [0.0_wp], left, ierr)
               call sys%force(0.0_wp, x + h, [0.0_wp], right, ierr)
               call sys%tangent(0.0_wp, x, [0.0_wp], [0.0_wp], k, c, ierr)
               call check(error, -(right(1) - left(1))/(2*h), k%a(1, 1), 'tangent', thr=1.0e-9_wp)
               call sys%energy(0.0_wp, x - h, [3.0_wp], energy(1), ierr)
               call sys%energy(0.0_wp, x + h, [3.0_wp], energy(2), ierr)
               call check(error, -(energy(2) - energy(1))/(2*h), f(1), 'energy', thr=1.0e-8_wp)
               if (x(1) > 1.0_wp) call check(error, f(1), -10.0_wp*(1.0_wp + 0.5_wp*(x(1) - 1.0_wp)), 'as printed')
            end associate
         end do
      end do
      call sys%force(0.0_wp, [-3.0_wp], [0.0_wp], f, ierr)
      call check(error, f(1), 10.0_wp, 'literal law: -5 (x + 1)')
      sys%law = law_odd
      call sys%force(0.0_wp, [-3.0_wp], [0.0_wp], f, ierr)
      call check(error, f(1), 20.0_wp, 'odd law')
   end subroutine test_spring_law

   !> Times at which the motion from x = 2 at rest passes a zone's end
   subroutine test_spring_crossings(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: odd(7) = [ &
         & 0.37613734422705374073_wp, 0.73280598750526671633_wp, 1.4850806759593741978_wp, 1.8417493192375871734_wp, &
         & 2.5940240076916946548_wp, 2.9506926509699076305_wp, 3.7029673394240151119_wp]
      real(wp), parameter :: literal(6) = [ &
         & 0.37613734422705374073_wp, 0.73280598750526671633_wp, 2.137768933713411995_wp, &
         & 2.4944375769916249706_wp, 3.246712265445732452_wp, 3.6033809087239454276_wp]
      type(bilinear_spring) :: sys
      call sys%setup()
      call compare_crossings(odd)
      sys%law = law_literal
      call compare_crossings(literal)

   contains

      subroutine compare_crossings(times)
         real(wp), intent(in) :: times(:)
         real(wp) :: t, step, edge, x, v, a
         integer :: i
         t = 0.0_wp
         x = 2.0_wp
         v = 0.0_wp
         do i = 1, size(times)
            call sys%next_crossing(x, v, step, edge)
            t = t + step
            call check(error, t, times(i), 'crossing', thr=1.0e-14_wp)
            call sys%exact(2.0_wp, 0.0_wp, t, x, v, a)
            call check(error, x, edge, 'place', thr=1.0e-13_wp)
            x = edge
         end do
      end subroutine compare_crossings
   end subroutine test_spring_crossings

   subroutine test_spring_exact(error)
      type(error_type), allocatable, intent(out) :: error
      type(bilinear_spring) :: sys
      integer :: law, i
      real(wp) :: x, v, a, energy
      integer :: ierr
      call sys%setup()
      call compare(10, 0.87795414150754929962_wp, -5.2241712504566139079_wp, -8.7795414150754929962_wp)
      call compare(20, -1.3121746526819256703_wp, -4.2742533707626741467_wp, 11.560873263409628351_wp)
      call compare(100, 0.68585476986634829731_wp, 5.5041831679655959789_wp, -6.8585476986634829731_wp)
      sys%law = law_literal
      call compare(10, 0.87795414150754929962_wp, -5.2241712504566139079_wp, -8.7795414150754929962_wp)
      call compare(20, -1.3347073913204755620_wp, -4.9436681534036252707_wp, 1.6735369566023778099_wp)
      call compare(100, -2.7331676729569743117_wp, -3.1592165305791454527_wp, 8.6658383647848715586_wp)
      do law = law_odd, law_literal
         sys%law = law
         do i = 0, 100
            call sys%exact(2.0_wp, 0.0_wp, 0.07_wp*i, x, v, a)
            call sys%energy(0.0_wp, [x], [v], energy, ierr)
            call check(error, energy, 17.5_wp, 'energy', thr=1.0e-12_wp)
         end do
      end do

   contains

      subroutine compare(step, x_exact, v_exact, a_exact)
         integer, intent(in) :: step
         real(wp), intent(in) :: x_exact, v_exact, a_exact
         call sys%exact(2.0_wp, 0.0_wp, step*0.04_wp, x, v, a)
         call check(error, x, x_exact, 'x', thr=1.0e-13_wp)
         call check(error, v, v_exact, 'v', thr=1.0e-13_wp)
         call check(error, a, a_exact, 'a', thr=1.0e-12_wp)
      end subroutine compare
   end subroutine test_spring_exact

   !> A start on an edge: entering a zone, leaving it, touching it, at rest in the middle
   subroutine test_spring_edge(error)
      type(error_type), allocatable, intent(out) :: error
      type(bilinear_spring) :: sys
      real(wp) :: x, v, a
      call sys%setup()
      call sys%exact(1.0_wp, 3.0_wp, 1.0e-3_wp, x, v, a)
      call check(error, x > 1.0_wp .and. abs(a + 10.0_wp) < 0.1_wp, 'outwards')
      call sys%exact(1.0_wp, -3.0_wp, 1.0e-3_wp, x, v, a)
      call check(error, x < 1.0_wp .and. abs(a + 10.0_wp) < 0.1_wp, 'inwards')
      call sys%exact(1.0_wp, 0.0_wp, 2.0_wp*pi/sqrt(10.0_wp), x, v, a)
      call check(error, x, 1.0_wp, 'touching', thr=1.0e-13_wp)
      call sys%exact(0.0_wp, 0.0_wp, 5.0_wp, x, v, a)
      call check(error, abs(x) + abs(v) + abs(a), 0.0_wp, 'at rest')
   end subroutine test_spring_edge

   !> A uniform chain, one end fixed and one free: 2 sqrt(k/m) sin((2j-1) pi/(2 (2n+1)))
   subroutine test_building_frequencies(error)
      type(error_type), allocatable, intent(out) :: error
      type(shear_building) :: sys
      type(status_type) :: status
      real(wp) :: expected
      integer :: n, j
      do n = 2, 30, 4
         call sys%setup([(1.0e5_wp, j=1, n)], [(1.8e8_wp, j=1, n)], [0.05_wp, 0.05_wp], status)
         call check(error, .not. status%failed(), trim(status%message))
         call check(error, size(sys%omega), n)
         do j = 1, n
            expected = 2.0_wp*sqrt(1800.0_wp)*sin((2*j - 1)*pi/(2*(2*n + 1)))
            call check(error, sys%omega(j), expected, 'omega', thr=1.0e-12_wp, rel=.true.)
         end do
      end do
      ! two unlike storeys: m1 m2 w^4 - (m1 k2 + m2 (k1 + k2)) w^2 + k1 k2 = 0
      call sys%setup([2.0_wp, 1.0_wp], [3.0_wp, 1.0_wp], [0.02_wp, 0.1_wp], status)
      do j = 1, 2
         expected = 2.0_wp*sys%omega(j)**4 - 6.0_wp*sys%omega(j)**2 + 3.0_wp
         call check(error, expected, 0.0_wp, 'unlike storeys', thr=1.0e-13_wp)
      end do
   end subroutine test_building_frequencies

   !> With K phi = omega^2 M phi:  C phi = 2 xi omega M phi
   subroutine test_building_damping(error)
      type(error_type), allocatable, intent(out) :: error
      type(shear_building) :: sys
      type(status_type) :: status
      integer, parameter :: n = 10
      real(wp), parameter :: ratios(2) = [0.03_wp, 0.07_wp]
      real(wp) :: phi(n), damping(n), inertia(n), stiffness(n)
      integer :: j, floor
      call sys%setup([(1.0e5_wp, j=1, n)], [(1.8e8_wp, j=1, n)], ratios, status)
      do j = 1, 2
         phi = [(sin((2*j - 1)*pi*floor/(2*n + 1)), floor=1, n)]
         damping = 0.0_wp
         inertia = 0.0_wp
         stiffness = 0.0_wp
         call sys%c%multiply_add(1.0_wp, phi, damping)
         call sys%m%multiply_add(1.0_wp, phi, inertia)
         call sys%k%multiply_add(1.0_wp, phi, stiffness)
         associate (modal_mass => dot_product(phi, inertia))
            call check(error, dot_product(phi, stiffness)/modal_mass, sys%omega(j)**2, 'omega', &
               & thr=1.0e-12_wp, rel=.true.)
            call check(error, dot_product(phi, damping)/modal_mass, 2.0_wp*ratios(j)*sys%omega(j), 'xi', &
               & thr=1.0e-12_wp, rel=.true.)
            call check(error, maxval(abs(damping - 2.0_wp*ratios(j)*sys%omega(j)*inertia))/maxval(abs(damping)), &
               & 0.0_wp, 'C phi', thr=1.0e-12_wp)
         end associate
      end do
   end subroutine test_building_damping

   subroutine test_building_load(error)
      type(error_type), allocatable, intent(out) :: error
      type(shear_building) :: sys
      type(status_type) :: status
      real(wp) :: p(3), drift(3)
      integer :: ierr
      call sys%setup([3.0_wp, 2.0_wp, 1.0_wp], [9.0_wp, 8.0_wp, 7.0_wp], [0.05_wp, 0.05_wp], status)
      call sys%shake(0.1_wp, [0.0_wp, 2.0_wp, -1.0_wp], status)
      call check(error, .not. status%failed(), trim(status%message))
      call sys%load(0.15_wp, p, ierr)
      call check(error, maxval(abs(p + 0.5_wp*[3.0_wp, 2.0_wp, 1.0_wp])), 0.0_wp, 'between samples', thr=1.0e-14_wp)
      call sys%load(0.3_wp, p, ierr)
      call check(error, maxval(abs(p)), 0.0_wp, 'after the record', thr=0.0_wp)
      call sys%storey_drifts([1.0_wp, 4.0_wp, 2.0_wp], drift)
      call check(error, all(abs(drift - [1.0_wp, 3.0_wp, -2.0_wp]) <= 0.0_wp), 'drifts')
   end subroutine test_building_load

   subroutine test_building_refuses(error)
      type(error_type), allocatable, intent(out) :: error
      type(shear_building) :: sys
      real(wp), parameter :: xi(2) = 0.05_wp
      call refuse([1.0_wp], [1.0_wp])
      call refuse([1.0_wp, 1.0_wp], [1.0_wp, 1.0_wp, 1.0_wp])
      call refuse([1.0_wp, 0.0_wp], [1.0_wp, 1.0_wp])
      call refuse([1.0_wp, 1.0_wp], [1.0_wp, -1.0_wp])
      call refuse([1.0_wp, ieee_value(1.0_wp, ieee_quiet_nan)], [1.0_wp, 1.0_wp])

   contains

      subroutine refuse(mass, stiffness)
         real(wp), intent(in) :: mass(:), stiffness(:)
         type(status_type) :: status
         call sys%setup(mass, stiffness, xi, status)
         call check(error, status%code, dynstep_invalid_input, trim(status%message))
      end subroutine refuse
   end subroutine test_building_refuses
end module test_models
