! SPDX-License-Identifier: BSD-3-Clause
!> Smooth problems in double precision for the library, and the same problems, written down
!> a second time, in quadruple precision for references that the library has no part in.
!>
!>   forced_pair    linear, damped, forced by a load procedure, dense symmetric matrices
!>   cubic_pair     nonlinear, driven, f(t,q) without velocities
!>   moving_mass    M(q,v) and a force with products of velocities
!>
!> `reference` integrates y' = [v; M^-1 f] by Gragg's method of order 16.
module reference_problems
   use, intrinsic :: iso_fortran_env, only: real128
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system, load_procedure
   use dynstep_matrix, only: dense_matrix, kind_dense, kind_identity, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: status_type
   implicit none
   private

   public :: new_problem, reference

   integer, parameter, public :: qp = real128
   integer, parameter, public :: problem_linear = 1, problem_cubic = 2, problem_mass = 3
   character(len=*), parameter, public :: problem_names(3) = ['linear   ', 'nonlinear', 'mass     ']

   type, extends(linear_system), public :: forced_pair
   contains
      procedure :: load => forced_load
   end type forced_pair

   type, extends(mechanical_system), public :: cubic_pair
   contains
      procedure :: force => cubic_force
   end type cubic_pair

   type, extends(mechanical_system), public :: moving_mass
   contains
      procedure :: force => moving_force
      procedure :: mass => moving_mass_matrix
   end type moving_mass

   !> Start of all three
   real(wp), parameter, public :: start_q(2) = [0.5_wp, -0.25_wp], start_v(2) = [0.25_wp, 0.5_wp]

contains

   !> One of the problems by its number
   subroutine new_problem(problem, sys)
      integer, intent(in) :: problem
      class(mechanical_system), allocatable, intent(out) :: sys
      type(forced_pair), allocatable :: pair
      type(status_type) :: status
      select case (problem)
      case (problem_linear)
         allocate (pair)
         call pair%set(dense_matrix(reshape([2.0_wp, 0.5_wp, 0.5_wp, 1.0_wp], [2, 2]), .true.), &
            & dense_matrix(reshape([0.125_wp, -0.0625_wp, -0.0625_wp, 0.0625_wp], [2, 2]), .true.), &
            & dense_matrix(reshape([3.0_wp, 0.25_wp, 0.25_wp, 1.0_wp], [2, 2]), .true.), status)
         pair%load_kind = load_procedure
         call move_alloc(pair, sys)
      case (problem_cubic)
         allocate (cubic_pair :: sys)
         sys%n = 2
         sys%structure%velocity_free = .true.
      case (problem_mass)
         allocate (moving_mass :: sys)
         sys%n = 2
         sys%structure%mass = kind_dense
         sys%structure%mass_is_constant = .false.
      end select
      if (.not. allocated(sys) .or. status%failed()) error stop 'no such problem'
   end subroutine new_problem

   recursive subroutine forced_load(self, t, p, ierr)
      class(forced_pair), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      p = [sin(0.5_wp*t), 0.5_wp + 0.25_wp*cos(0.25_wp*t)]
   end subroutine forced_load

   recursive subroutine cubic_force(self, t, q, v, f, ierr)
      class(cubic_pair), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = -sin(q(1)) + 0.125_wp*(q(2) - q(1))
      f(2) = 0.125_wp*(q(1) - q(2)) - q(2)*(1.0_wp + 0.125_wp*q(2)**2) + 0.25_wp*cos(0.5_wp*t)
   end subroutine cubic_force

   recursive subroutine moving_force(self, t, q, v, f, ierr)
      class(moving_mass), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = -2.0_wp*sin(q(1)) - 0.125_wp*v(1)*v(2) + 0.25_wp*cos(0.5_wp*t)
      f(2) = -q(2) - 0.0625_wp*v(2)*(1.0_wp + v(1)**2)
   end subroutine moving_force

   recursive subroutine moving_mass_matrix(self, t, q, v, mass, ierr)
      class(moving_mass), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(1, 1) = 2.0_wp + 0.125_wp*cos(q(2)) + 0.125_wp*v(2)**2
      mass%a(2, 1) = 0.125_wp*sin(q(1))
      mass%a(1, 2) = 0.125_wp*sin(q(1))
      mass%a(2, 2) = 1.0_wp + 0.0625_wp*v(1)**2
   end subroutine moving_mass_matrix

   !> y' of a problem in quadruple precision
   pure function quad_rhs(problem, t, y) result(f)
      integer, intent(in) :: problem
      real(qp), intent(in) :: t, y(4)
      real(qp) :: f(4), m(2, 2), p(2), det
      associate (q => y(1:2), v => y(3:4))
         m = reshape([1, 0, 0, 1], [2, 2])
         select case (problem)
         case (problem_linear)
            m = reshape([2.0_qp, 0.5_qp, 0.5_qp, 1.0_qp], [2, 2])
            p(1) = sin(t/2) - (v(1)/8 - v(2)/16) - (3*q(1) + q(2)/4)
            p(2) = 0.5_qp + cos(t/4)/4 - (-v(1) + v(2))/16 - (q(1)/4 + q(2))
         case (problem_cubic)
            p(1) = -sin(q(1)) + (q(2) - q(1))/8
            p(2) = (q(1) - q(2))/8 - q(2) - q(2)**3/8 + cos(t/2)/4
         case default
            m(1, 1) = 2 + cos(q(2))/8 + v(2)**2/8
            m(2, 1) = sin(q(1))/8
            m(1, 2) = m(2, 1)
            m(2, 2) = 1 + v(1)**2/16
            p(1) = -2*sin(q(1)) - v(1)*v(2)/8 + cos(t/2)/4
            p(2) = -q(2) - v(2)*(1 + v(1)**2)/16
         end select
         det = m(1, 1)*m(2, 2) - m(1, 2)*m(2, 1)
         f(1:2) = v
         f(3) = (m(2, 2)*p(1) - m(1, 2)*p(2))/det
         f(4) = (m(1, 1)*p(2) - m(2, 1)*p(1))/det
      end associate
   end function quad_rhs

   !> States [q; v; a] of the motion that starts at time 0, at times in the order of the run
   subroutine reference(problem, times, states)
      integer, intent(in) :: problem
      real(wp), intent(in) :: times(:)
      real(qp), intent(out) :: states(6, size(times))
      integer, parameter :: levels = 10
      real(qp), parameter :: longest = 0.1_qp
      real(qp) :: y(4), f(4), t, h, table(4, levels)
      integer :: i, j, k, number, steps

      y = [real(start_q, qp), real(start_v, qp)]
      t = 0
      do number = 1, size(times)
         steps = ceiling(abs(times(number) - t)/longest)
         h = (times(number) - t)/steps
         do i = 0, steps - 1
            do j = 1, levels
               table(:, j) = gragg(problem, t + i*h, h, 2*j, y)
               do k = j - 1, 1, -1
                  table(:, k) = table(:, k + 1) + (table(:, k + 1) - table(:, k))/((real(j, qp)/k)**2 - 1)
               end do
            end do
            y = table(:, 1)
         end do
         t = times(number)
         f = quad_rhs(problem, t, y)
         states(:, number) = [y, f(3:4)]
      end do
   end subroutine reference

   !> The explicit midpoint rule with an Euler start, n even, no smoothing step
   pure function gragg(problem, t, h, n, y) result(y1)
      integer, intent(in) :: problem, n
      real(qp), intent(in) :: t, h, y(4)
      real(qp) :: y1(4), y0(4), y2(4)
      integer :: i
      y0 = y
      y1 = y + (h/n)*quad_rhs(problem, t, y)
      do i = 1, n - 1
         y2 = y0 + (2*h/n)*quad_rhs(problem, t + i*(h/n), y1)
         y0 = y1
         y1 = y2
      end do
   end function gragg
end module reference_problems
