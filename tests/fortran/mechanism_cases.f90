! SPDX-License-Identifier: BSD-3-Clause
!> The models with constraints, points of them, and what tests ask of a system at a point: its functions,
!> their derivatives by differences, the accelerations and multipliers that belong to q and v.
module mechanism_cases
   use dynstep_driven_crank, only: driven_crank
   use dynstep_factorization, only: factorization_type
   use dynstep_jacobian, only: jacobian_type
   use dynstep_jay_negrut_problem, only: jay_negrut_problem
   use dynstep_kinds, only: wp
   use dynstep_knife_edge, only: knife_edge
   use dynstep_matrix, only: kind_dense, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_rod_chain, only: rod_chain
   use dynstep_rod_pendulum, only: rod_pendulum
   use dynstep_rolling_disk, only: rolling_disk
   use dynstep_slider_crank, only: slider_crank
   use dynstep_status, only: status_type
   implicit none
   private

   public :: make, general_point, no_direction, consistent_point, exact_at
   public :: jacobians_at, mass_at, evaluate, differentiate, complete

   integer, parameter, public :: models = 9
   character(len=16), parameter, public :: names(models) = [character(len=16) :: 'jay_negrut', 'rod_pendulum', 'slider_crank', &
      & 'driven_crank', 'knife_edge', 'rolling_disk', 'chain of 1', 'chain of 2', 'chain of 5']

   !> Differences with six points and d = 2^-8 leave d^6/140 = 3e-17 of the seventh derivative (up to 2e4 of the
   !> driven angle) and rounding of 1.9 eps/d = 1e-13 of the function
   real(wp), parameter, public :: difference_step = 2.0_wp**(-8), difference_error = 2.0e-12_wp

   integer, parameter, public :: at(6) = [-3, -2, -1, 1, 2, 3]
   real(wp), parameter, public :: weight(6) = [-1.0_wp, 9.0_wp, -45.0_wp, 45.0_wp, -9.0_wp, 1.0_wp]/60.0_wp

   ! what `evaluate` gives
   integer, parameter, public :: of_g = 1       ! g
   integer, parameter, public :: of_gv = 2      ! dg/dt along the motion, G v + g_t
   integer, parameter, public :: of_k = 3       ! k
   integer, parameter, public :: of_f = 4       ! f - M a
   integer, parameter, public :: of_r = 5       ! reaction

   !> A point of a motion, or a direction
   type, public :: point_type
      real(wp) :: t = 0.0_wp
      real(wp), allocatable :: q(:), v(:), a(:), lambda(:), psi(:)
   end type point_type

contains

   !> The models, with parameters that are no special case
   subroutine make(number, sys)
      integer, intent(in) :: number
      class(mechanical_system), allocatable, intent(out) :: sys
      type(status_type) :: status
      select case (number)
      case (1)
         allocate (jay_negrut_problem :: sys)
      case (2)
         allocate (rod_pendulum :: sys)
      case (3)
         allocate (slider_crank :: sys)
      case (4)
         allocate (driven_crank :: sys)
      case (5)
         allocate (knife_edge :: sys)
      case (6)
         allocate (rolling_disk :: sys)
      case default
         allocate (rod_chain :: sys)
      end select
      select type (sys)
      type is (jay_negrut_problem)
         call sys%setup()
      type is (rod_pendulum)
         call sys%setup()
      class is (slider_crank)
         sys%gravity = 9.81_wp
         call sys%setup()
      type is (knife_edge)
         call sys%setup()
      type is (rolling_disk)
         sys%torque = 0.7_wp
         call sys%setup()
      type is (rod_chain)
         sys%m = 1.3_wp
         sys%l = 0.8_wp
         call sys%setup(merge(5, number - 6, number == 9), status)
      end select
   end subroutine make

   !> A point off the constraints, without symmetry: fractional parts of multiples of the golden ratio
   function general_point(sys) result(p)
      class(mechanical_system), intent(in) :: sys
      type(point_type) :: p
      integer :: i
      p = no_direction(sys)
      p%t = 0.37_wp
      p%q = [(0.4_wp + modulo(0.6180339887_wp*i, 1.0_wp), i=1, sys%n)]
      p%v = [(modulo(0.3819660113_wp*i, 1.0_wp) - 1.2_wp, i=1, sys%n)]
      p%a = [(1.7_wp - 2.0_wp*modulo(0.6180339887_wp*(i + 3), 1.0_wp), i=1, sys%n)]
      p%lambda = [(modulo(0.6180339887_wp*(i + 5), 1.0_wp) + 0.5_wp, i=1, sys%holonomic)]
      p%psi = [(modulo(0.6180339887_wp*(i + 7), 1.0_wp) - 1.5_wp, i=1, sys%nonholonomic)]
   end function general_point

   function no_direction(sys) result(p)
      class(mechanical_system), intent(in) :: sys
      type(point_type) :: p
      allocate (p%q(sys%n), p%v(sys%n), p%a(sys%n), p%lambda(sys%holonomic), p%psi(sys%nonholonomic))
      p%q = 0.0_wp
      p%v = 0.0_wp
      p%a = 0.0_wp
      p%lambda = 0.0_wp
      p%psi = 0.0_wp
   end function no_direction

   subroutine jacobians_at(sys, p, gq, gt, kv)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(in) :: p
      type(jacobian_type), intent(out) :: gq, kv
      real(wp), allocatable, intent(out) :: gt(:)
      type(status_type) :: status
      integer :: ierr
      call gq%init(sys%holonomic, sys%n, sys%constraints%g, status)
      call kv%init(sys%nonholonomic, sys%n, sys%constraints%k, status)
      allocate (gt(sys%holonomic))
      gt = 0.0_wp
      if (sys%holonomic > 0) call sys%constraint_jacobian(p%t, p%q, gq, gt, ierr)
      if (sys%nonholonomic > 0) call sys%velocity_jacobian(p%t, p%q, p%v, kv, ierr)
   end subroutine jacobians_at

   subroutine mass_at(sys, p, m)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(in) :: p
      type(matrix_type), intent(out) :: m
      type(status_type) :: status
      integer :: ierr
      call m%init(sys%structure%mass, sys%n, 0, 0, sys%structure%mass_is_symmetric, status)
      call sys%mass(p%t, p%q, p%v, m, ierr)
   end subroutine mass_at

   subroutine evaluate(sys, what, p, y)
      class(mechanical_system), intent(inout) :: sys
      integer, intent(in) :: what
      type(point_type), intent(in) :: p
      real(wp), allocatable, intent(out) :: y(:)
      type(jacobian_type) :: gq, kv
      type(matrix_type) :: m
      real(wp), allocatable :: gt(:)
      integer :: ierr
      select case (what)
      case (of_g)
         allocate (y(sys%holonomic))
         call sys%constraint(p%t, p%q, y, ierr)
      case (of_gv)
         allocate (y(sys%holonomic))
         call jacobians_at(sys, p, gq, gt, kv)
         call gq%multiply(p%v, y)
         y = y + gt
      case (of_k)
         allocate (y(sys%nonholonomic))
         call sys%velocity_constraint(p%t, p%q, p%v, y, ierr)
      case (of_f)
         allocate (y(sys%n))
         call sys%force(p%t, p%q, p%v, y, ierr)
         call mass_at(sys, p, m)
         call m%multiply_add(-1.0_wp, p%a, y)
      case default
         allocate (y(sys%n))
         y = 0.0_wp
         if (sys%constraints%reaction_is_general) then
            call sys%reaction(p%t, p%q, p%v, p%lambda, p%psi, y, ierr)
         else
            call jacobians_at(sys, p, gq, gt, kv)
            call gq%transposed_add(-1.0_wp, p%lambda, y)
            call kv%transposed_add(-1.0_wp, p%psi, y)
         end if
      end select
   end subroutine evaluate

   !> Derivative along a direction, and how far it may be off
   subroutine differentiate(sys, what, p, direction, derivative, allowed)
      class(mechanical_system), intent(inout) :: sys
      integer, intent(in) :: what
      type(point_type), intent(in) :: p, direction
      real(wp), allocatable, intent(out) :: derivative(:)
      real(wp), intent(out) :: allowed
      real(wp), allocatable :: y(:)
      type(point_type) :: x
      real(wp) :: s
      integer :: i
      call evaluate(sys, what, p, y)
      allowed = difference_error*(1.0_wp + sum(abs(y)))
      allocate (derivative(size(y)))
      derivative = 0.0_wp
      do i = 1, 6
         s = at(i)*difference_step
         x = p
         x%t = p%t + s*direction%t
         x%q = p%q + s*direction%q
         x%v = p%v + s*direction%v
         x%lambda = p%lambda + s*direction%lambda
         x%psi = p%psi + s*direction%psi
         call evaluate(sys, what, x, y)
         derivative = derivative + (weight(i)/difference_step)*y
      end do
   end subroutine differentiate

   !> The exact solution of a model that has one
   subroutine exact_at(sys, t, p, has_one)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      type(point_type), intent(out) :: p
      logical, intent(out) :: has_one
      type(status_type) :: status
      p = no_direction(sys)
      p%t = t
      has_one = .true.
      select type (sys)
      type is (jay_negrut_problem)
         call sys%exact(t, p%q, p%v, p%a, p%lambda, p%psi)
      type is (driven_crank)
         call sys%exact(t, p%q, p%v, p%a, p%lambda, status)
      type is (knife_edge)
         call sys%exact(0.8_wp, 1.7_wp, t, p%q, p%v, p%a, p%psi)
      type is (rolling_disk)
         call sys%exact(3.0_wp, -1.1_wp, t, p%q, p%v, p%a, p%psi)
      class default
         has_one = .false.
      end select
      has_one = has_one .and. .not. status%failed()
   end subroutine exact_at

   !> A point on the constraints
   subroutine consistent_point(sys, p)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(out) :: p
      type(point_type) :: x
      type(status_type) :: status
      logical :: has_one
      integer :: i
      call exact_at(sys, 0.6_wp, p, has_one)
      if (has_one) return
      x = no_direction(sys)
      select type (sys)
      type is (rod_pendulum)
         call sys%start(4.1_wp, -7.0_wp, x%q, x%v)
      type is (slider_crank)
         call sys%start(0.8_wp, 2.5_wp, x%q, x%v, status)
      type is (rod_chain)
         call sys%start([(-1.0_wp + 0.7_wp*i, i=1, sys%rods)], [(2.0_wp - 0.9_wp*i, i=1, sys%rods)], x%q, x%v)
      end select
      x%t = 0.6_wp
      p = x
   end subroutine consistent_point

   !> a, lambda and psi of r = -G^T lambda - K^T psi from the equations of motion and the hidden constraints
   subroutine complete(sys, p)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      type(matrix_type) :: m, whole
      type(factorization_type) :: factor
      type(jacobian_type) :: gq, kv
      type(status_type) :: status
      real(wp), allocatable :: gt(:), x(:)
      integer :: n, i, j, ierr
      n = sys%n
      associate (size_g => sys%holonomic, size_k => sys%nonholonomic)
         allocate (x(n + size_g + size_k))
         call mass_at(sys, p, m)
         call jacobians_at(sys, p, gq, gt, kv)
         call whole%init(kind_dense, size(x), 0, 0, .false., status)
         do j = 1, n
            do i = 1, n
               call whole%set_entry(i, j, m%entry(i, j))
            end do
            do i = 1, size_g
               call whole%set_entry(n + i, j, gq%entry(i, j))
               call whole%set_entry(j, n + i, gq%entry(i, j))
            end do
            do i = 1, size_k
               call whole%set_entry(n + size_g + i, j, kv%entry(i, j))
               call whole%set_entry(j, n + size_g + i, kv%entry(i, j))
            end do
         end do
         call sys%force(p%t, p%q, p%v, x(1:n), ierr)
         if (size_g > 0) call sys%constraint_curvature(p%t, p%q, p%v, x(n + 1:n + size_g), ierr)
         if (size_k > 0) call sys%velocity_curvature(p%t, p%q, p%v, x(n + size_g + 1:), ierr)
         x(n + 1:) = -x(n + 1:)
         call factor%init(kind_dense, size(x), 0, 0, .false., status)
         call factor%factorize(whole, status, p%t, 'matrix of the constrained system')
         call factor%solve(x)
         p%a = x(1:n)
         p%lambda = x(n + 1:n + size_g)
         p%psi = x(n + size_g + 1:)
      end associate
   end subroutine complete
end module mechanism_cases
