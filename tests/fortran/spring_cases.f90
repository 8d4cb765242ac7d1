! SPDX-License-Identifier: BSD-3-Clause
!> Springs as mechanical systems, and one step of Newmark's method or the midpoint rule on them
!> in quadruple precision to compare with.
module spring_cases
   use, intrinsic :: iso_fortran_env, only: real128
   use dynstep, only: matrix_type, mechanical_system, wp
   implicit none
   private

   public :: newmark_in_quad, midpoint_in_quad, pair_in_quad

   integer, parameter, public :: qp = real128

   !> M q'' = P - C v - K (q + E q^3), each coordinate by itself; tangents by differences
   type, extends(mechanical_system), public :: spring_system
      real(wp), allocatable :: k(:), e(:), c(:), p(:)     !! [n]
      logical :: gives_tangent = .false.
   contains
      procedure :: setup => spring_setup
      procedure :: force => spring_force
      procedure :: tangent => spring_tangent
   end type spring_system

   !> Two unit masses with a spring between them, each with a spring and a dashpot to the ground
   type, extends(mechanical_system), public :: pair_system
      real(wp) :: between = 0.0_wp, ground(2) = 0.0_wp, c(2) = 0.0_wp
   contains
      procedure :: force => pair_force
   end type pair_system

   !> q'' = -stiffness atan(q): Newton's iteration diverges from far away; refuses |q| > bound
   type, extends(mechanical_system), public :: bounded_system
      real(wp) :: stiffness = 1.0_wp
      real(wp) :: bound = huge(1.0_wp)
   contains
      procedure :: force => bounded_force
   end type bounded_system

   !> n unit masses in a row with stretching springs of law s + s^3 and dashpots, the first to
   !> a wall; springs of strength `second` to the second neighbour make the lower band wider
   type, extends(mechanical_system), public :: chain_system
      real(wp) :: second = 0.0_wp
      logical :: gives_tangent = .false.
   contains
      procedure :: force => chain_force
      procedure :: tangent => chain_tangent
   end type chain_system

   !> Linear in q and v with coefficients that depend on time where rate /= 0:
   !> (2 + sin(rate t)) q1'' = -(3 + cos(rate t)) q1 + q2 - v1/4,  3 q2'' = q1 - 2 q2 - v2/8
   type, extends(mechanical_system), public :: cranked_system
      real(wp) :: rate = 0.0_wp
      logical :: gives_tangent = .false.
   contains
      procedure :: force => cranked_force
      procedure :: mass => cranked_mass
      procedure :: tangent => cranked_tangent
   end type cranked_system

   !> q'' = -sin q with errors of size `fuzz` that change from one q to the next
   type, extends(mechanical_system), public :: fuzzy_system
      real(wp) :: fuzz = 0.0_wp
   contains
      procedure :: force => fuzzy_force
   end type fuzzy_system

contains

   subroutine spring_setup(self, k, e, c, p)
      class(spring_system), intent(inout) :: self
      real(wp), intent(in) :: k(:), e(:), c(:), p(:)
      self%n = size(k)
      self%k = k
      self%e = e
      self%c = c
      self%p = p
   end subroutine spring_setup

   recursive subroutine spring_force(self, t, q, v, f, ierr)
      class(spring_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = self%p - self%c*v - self%k*(q + self%e*q**3)
   end subroutine spring_force

   recursive subroutine spring_tangent(self, t, q, v, a, k, c, ierr)
      class(spring_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      integer :: i
      if (.not. self%gives_tangent) then
         call self%difference_tangent(t, q, v, a, k, c, ierr)
         return
      end if
      ierr = 0
      do i = 1, self%n
         call k%set_entry(i, i, self%k(i)*(1.0_wp + 3.0_wp*self%e(i)*q(i)**2))
         call c%set_entry(i, i, self%c(i))
      end do
   end subroutine spring_tangent

   recursive subroutine pair_force(self, t, q, v, f, ierr)
      class(pair_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -self%ground*q - self%c*v - self%between*(q(1) - q(2))*[1, -1]
   end subroutine pair_force

   recursive subroutine bounded_force(self, t, q, v, f, ierr)
      class(bounded_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = merge(1, 0, any(abs(q) > self%bound))
      f = -self%stiffness*atan(q)
   end subroutine bounded_force

   recursive subroutine chain_force(self, t, q, v, f, ierr)
      class(chain_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      real(wp) :: s
      integer :: i
      ierr = 0
      f = -0.125_wp*v
      f(1) = f(1) - (q(1) + q(1)**3)
      do i = 2, self%n
         s = q(i) - q(i - 1)
         f(i - 1) = f(i - 1) + (s + s**3)
         f(i) = f(i) - (s + s**3)
      end do
      do i = 3, self%n
         f(i) = f(i) - self%second*sin(q(i - 2))
      end do
   end subroutine chain_force

   recursive subroutine chain_tangent(self, t, q, v, a, k, c, ierr)
      class(chain_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      real(wp) :: s
      integer :: i
      if (.not. self%gives_tangent) then
         call self%difference_tangent(t, q, v, a, k, c, ierr)
         return
      end if
      ierr = 0
      call k%set_entry(1, 1, 1.0_wp + 3.0_wp*q(1)**2)
      do i = 2, self%n
         s = 1.0_wp + 3.0_wp*(q(i) - q(i - 1))**2
         call k%set_entry(i - 1, i - 1, k%entry(i - 1, i - 1) + s)
         call k%set_entry(i, i, s)
         call k%set_entry(i, i - 1, -s)
         call k%set_entry(i - 1, i, -s)
      end do
      do i = 3, self%n
         call k%set_entry(i, i - 2, self%second*cos(q(i - 2)))
      end do
      do i = 1, self%n
         call c%set_entry(i, i, 0.125_wp)
      end do
   end subroutine chain_tangent

   recursive subroutine cranked_force(self, t, q, v, f, ierr)
      class(cranked_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f(1) = -(3.0_wp + cos(self%rate*t))*q(1) + q(2)
      f(2) = q(1) - 2.0_wp*q(2)
      if (.not. self%structure%velocity_free) f = f - [0.25_wp, 0.125_wp]*v
   end subroutine cranked_force

   recursive subroutine cranked_mass(self, t, q, v, mass, ierr)
      class(cranked_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      call mass%set_entry(1, 1, 2.0_wp + sin(self%rate*t))
      call mass%set_entry(2, 2, 3.0_wp)
   end subroutine cranked_mass

   recursive subroutine cranked_tangent(self, t, q, v, a, k, c, ierr)
      class(cranked_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      if (.not. self%gives_tangent) then
         call self%difference_tangent(t, q, v, a, k, c, ierr)
         return
      end if
      ierr = 0
      call k%set_entry(1, 1, 3.0_wp + cos(self%rate*t))
      call k%set_entry(1, 2, -1.0_wp)
      call k%set_entry(2, 1, -1.0_wp)
      call k%set_entry(2, 2, 2.0_wp)
      call c%set_entry(1, 1, 0.25_wp)
      call c%set_entry(2, 2, 0.125_wp)
   end subroutine cranked_tangent

   recursive subroutine fuzzy_force(self, t, q, v, f, ierr)
      class(fuzzy_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -sin(q) + self%fuzz*cos(1.0e17_wp*q)
   end subroutine fuzzy_force

   !> Coordinate i of one Newmark step of a spring_system, by Newton's iteration for q1
   pure subroutine newmark_in_quad(sys, i, beta, h, q0, v0, a0, q1, v1, a1)
      type(spring_system), intent(in) :: sys
      integer, intent(in) :: i
      real(wp), intent(in) :: beta, h              !! beta > 0, gamma = 1/2
      real(wp), intent(in) :: q0, v0, a0
      real(qp), intent(out) :: q1, v1, a1
      real(qp) :: d, s
      real(qp) :: hq
      integer :: iteration
      hq = h
      q1 = q0
      d = 0
      do iteration = 1, 300
         q1 = q1 + d
         a1 = (q1 - q0 - hq*v0)/(beta*hq**2) - (0.5_qp - beta)/beta*a0
         v1 = v0 + hq*(a0 + a1)/2
         if (iteration > 1 .and. abs(d) <= 1.0e-33_qp*abs(q1)) exit
         d = sys%p(i) - sys%c(i)*v1 - sys%k(i)*(q1 + sys%e(i)*q1**3) - a1
         s = 1/(beta*hq**2) + sys%c(i)*0.5_qp/(beta*hq) + sys%k(i)*(1 + 3*sys%e(i)*q1**2)
         d = d/s
      end do
   end subroutine newmark_in_quad

   !> Coordinate i of one midpoint step: the trapezoid between the midpoints, by Newton's
   !> iteration for the q of the middle; a1 belongs to the end
   pure subroutine midpoint_in_quad(sys, i, h, q0, v0, q1, v1, a1)
      type(spring_system), intent(in) :: sys
      integer, intent(in) :: i
      real(wp), intent(in) :: h, q0, v0
      real(qp), intent(out) :: q1, v1, a1
      real(qp) :: q, v, a, d, half
      integer :: iteration
      half = real(h, qp)/2
      q = q0
      do iteration = 1, 300
         v = (q - q0)/half
         a = (v - v0)/half
         d = (sys%p(i) - sys%c(i)*v - sys%k(i)*(q + sys%e(i)*q**3) - a) &
            & /(1/half**2 + sys%c(i)/half + sys%k(i)*(1 + 3*sys%e(i)*q**2))
         q = q + d
         if (abs(d) <= 1.0e-33_qp*abs(q)) exit
      end do
      q1 = 2*q - q0
      v1 = 2*(q - q0)/half - v0
      a1 = sys%p(i) - sys%c(i)*v1 - sys%k(i)*(q1 + sys%e(i)*q1**3)
   end subroutine midpoint_in_quad

   !> One trapezoidal step of a pair_system: S d = f(q0 + h v0 + h^2/4 a0, v0 + h/2 a0) for a1
   pure subroutine pair_in_quad(sys, h, y0, a0, y1, a1)
      type(pair_system), intent(in) :: sys
      real(wp), intent(in) :: h, y0(4), a0(2)
      real(qp), intent(out) :: y1(4), a1(2)
      real(qp) :: s(2, 2), q(2), v(2), r(2), hq, k
      hq = h
      q = y0(1:2) + hq*y0(3:4) + hq**2/4*a0
      v = y0(3:4) + hq/2*a0
      k = hq**2/4*sys%between
      s(:, 1) = [1 + hq/2*sys%c(1) + hq**2/4*sys%ground(1) + k, -k]
      s(:, 2) = [-k, 1 + hq/2*sys%c(2) + hq**2/4*sys%ground(2) + k]
      r = -sys%ground*q - sys%c*v - sys%between*(q(1) - q(2))*[1, -1]
      a1(1) = (s(2, 2)*r(1) - s(1, 2)*r(2))/(s(1, 1)*s(2, 2) - s(1, 2)*s(2, 1))
      a1(2) = (s(1, 1)*r(2) - s(2, 1)*r(1))/(s(1, 1)*s(2, 2) - s(1, 2)*s(2, 1))
      y1(1:2) = q + hq**2/4*a1
      y1(3:4) = v + hq/2*a1
   end subroutine pair_in_quad
end module spring_cases
