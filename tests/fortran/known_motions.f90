! SPDX-License-Identifier: BSD-3-Clause
!> Systems with constraints of every kind whose motion is known, that are in neither paper: by the method of
!> manufactured solutions, or from an equation in the fewest coordinates, integrated by Runge and Kutta's
!> rule of order 4 with steps of 2^-10 at most (errors near 1e-12).
module known_motions
   use dynstep, only: jacobian_type, kind_dense, kind_diagonal, matrix_type, mechanical_system, wp
   implicit none
   private

   public :: new_motion

   integer, parameter, public :: motions = 7
   character(len=24), parameter, public :: motion_names(motions) = [character(len=24) :: 'double pendulum', &
      & 'chaplygin sleigh', 'manufactured', 'shaken pendulum', 'mass of t and q', 'mass of t, q and v', 'skate on a surface']

   type, abstract, extends(mechanical_system), public :: known_motion
   contains
      !> Coordinates, velocities, accelerations and multipliers of the motion at time t
      procedure(at_interface), deferred :: at
   end type known_motion

   abstract interface
      subroutine at_interface(self, t, q, v, a, lambda, psi)
         import :: known_motion, wp
         class(known_motion), intent(inout) :: self
         real(wp), intent(in) :: t
         real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
         real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      end subroutine at_interface
   end interface

   !> Known by x' = slope(t, x) with few unknowns
   type, abstract, extends(known_motion) :: reduced_motion
      real(wp) :: now = 0.0_wp
      real(wp), allocatable :: x(:)
   contains
      procedure :: at => reduced_at
      procedure(slope_interface), deferred :: slope
      procedure(expand_interface), deferred :: expand
   end type reduced_motion

   abstract interface
      subroutine slope_interface(self, t, x, dx)
         import :: reduced_motion, wp
         class(reduced_motion), intent(in) :: self
         real(wp), intent(in) :: t, x(:)
         real(wp), intent(out) :: dx(:)
      end subroutine slope_interface

      subroutine expand_interface(self, t, x, dx, q, v, a, lambda, psi)
         import :: reduced_motion, wp
         class(reduced_motion), intent(in) :: self
         real(wp), intent(in) :: t, x(:), dx(:)
         real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
         real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      end subroutine expand_interface
   end interface

   real(wp), parameter :: gravity = 9.81_wp

   !> Point masses at (x1, y1) and (x2, y2), the first one tied to the origin, the second one to the first:
   !> 2 g = r1^2 - l1^2, (r2 - r1)^2 - l2^2.  x = two angles from the vertical and their rates.  All derivatives
   !> of g are those of the library.
   type, extends(reduced_motion) :: double_pendulum
      real(wp) :: m(2) = [1.0_wp, 0.7_wp], l(2) = [1.0_wp, 0.8_wp]
   contains
      procedure :: slope => pendulum_slope
      procedure :: expand => pendulum_expand
      procedure :: force => pendulum_force
      procedure :: mass => pendulum_mass
      procedure :: constraint => pendulum_constraint
   end type double_pendulum

   !> Chaplygin's sleigh: q = (x, y, phi), the blade stands d behind the centre of mass and does not move sideways,
   !> k = y' cos(phi) - x' sin(phi) - d phi'.  x = (x, y, phi, speed of the blade, phi').
   type, extends(reduced_motion) :: chaplygin_sleigh
      real(wp) :: m = 1.4_wp, j = 0.3_wp, d = 0.5_wp
   contains
      procedure :: slope => sleigh_slope
      procedure :: expand => sleigh_expand
      procedure :: force => sleigh_force
      procedure :: mass => sleigh_mass
      procedure :: velocity_constraint => sleigh_velocity_constraint
      procedure :: velocity_jacobian => sleigh_velocity_jacobian
   end type chaplygin_sleigh

   !> A pendulum whose pivot is moved: 2 g = (x - sin(2t)/4)^2 + (y - cos(3t)/5)^2 - 1, derivatives by the library
   type, extends(reduced_motion) :: shaken_pendulum
   contains
      procedure :: slope => shaken_slope
      procedure :: expand => shaken_expand
      procedure :: force => shaken_force
      procedure :: constraint => shaken_constraint
   end type shaken_pendulum

   !> q = (x, y, z, phi): a skate on the surface z = x^2/4 + x y/5 + y^2/3 - y/2, which turns at a constant rate;
   !> g = z - surface, k = x' sin(phi) - y' cos(phi).  x = (x, y, phi, speed in the plane).
   type, extends(reduced_motion) :: surface_skate
      real(wp) :: m = 1.3_wp, j = 0.4_wp, rate = 2.1_wp
   contains
      procedure :: slope => skate_slope
      procedure :: expand => skate_expand
      procedure :: force => skate_force
      procedure :: mass => skate_mass
      procedure :: constraint => skate_constraint
      procedure :: constraint_jacobian => skate_constraint_jacobian
      procedure :: velocity_constraint => skate_velocity_constraint
      procedure :: velocity_jacobian => skate_velocity_jacobian
   end type surface_skate

   !> Made from its solution: four coordinates, a mass matrix that is neither constant nor symmetric, one constraint
   !> of each kind, reactions that are linear in neither multiplier
   type, extends(known_motion) :: manufactured_motion
   contains
      procedure :: at => made_at
      procedure :: force => made_force
      procedure :: mass => made_mass
      procedure :: constraint => made_constraint
      procedure :: constraint_jacobian => made_constraint_jacobian
      procedure :: velocity_constraint => made_velocity_constraint
      procedure :: velocity_jacobian => made_velocity_jacobian
      procedure :: reaction => made_reaction
      procedure :: reaction_jacobian => made_reaction_jacobian
   end type manufactured_motion

   !> Two coordinates without constraints, a mass matrix of t, q and, if asked for, v
   type, extends(known_motion) :: free_motion
      real(wp) :: of_velocity = 0.0_wp
   contains
      procedure :: at => free_at
      procedure :: force => free_force
      procedure :: mass => free_mass
   end type free_motion

contains

   !> A motion, at t = 0
   subroutine new_motion(number, sys)
      integer, intent(in) :: number
      class(known_motion), allocatable, intent(out) :: sys
      select case (number)
      case (1)
         allocate (double_pendulum :: sys)
         call describe(sys, 4, 2, 0, kind_diagonal)
      case (2)
         allocate (chaplygin_sleigh :: sys)
         call describe(sys, 3, 0, 1, kind_diagonal)
      case (3)
         allocate (manufactured_motion :: sys)
         call describe(sys, 4, 1, 1, kind_dense)
         sys%constraints%reaction_is_general = .true.
      case (4)
         allocate (shaken_pendulum :: sys)
         call describe(sys, 2, 1, 0, sys%structure%mass)
      case (5, 6)
         allocate (free_motion :: sys)
         call describe(sys, 2, 0, 0, kind_dense)
      case default
         allocate (surface_skate :: sys)
         call describe(sys, 4, 1, 1, kind_diagonal)
         sys%constraints%g%first = [1, 4]
         sys%constraints%g%column = [1, 2, 3]
         sys%constraints%k%first = [1, 3]
         sys%constraints%k%column = [1, 2]
      end select
      sys%structure%mass_is_constant = number /= 3 .and. number /= 5 .and. number /= 6
      sys%structure%mass_is_symmetric = sys%structure%mass_is_constant
      select type (sys)
      type is (free_motion)
         sys%of_velocity = merge(0.4_wp, 0.0_wp, number == 6)
      type is (double_pendulum)
         sys%x = [0.8_wp, -0.4_wp, 0.4_wp, 0.9_wp]
      type is (chaplygin_sleigh)
         sys%x = [0.0_wp, 0.0_wp, 0.2_wp, -0.8_wp, 2.5_wp]
      type is (shaken_pendulum)
         sys%x = [1.2_wp, -0.5_wp]
      type is (surface_skate)
         sys%x = [0.4_wp, -0.3_wp, 0.5_wp, 1.5_wp]
      end select
   end subroutine new_motion

   subroutine describe(sys, n, m, p, mass)
      class(known_motion), intent(inout) :: sys
      integer, intent(in) :: n, m, p, mass
      sys%n = n
      sys%holonomic = m
      sys%nonholonomic = p
      sys%structure%mass = mass
      sys%structure%tangent = kind_dense
   end subroutine describe

   !> From where it is to time t, forward or backward
   subroutine reduced_at(self, t, q, v, a, lambda, psi)
      class(reduced_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), dimension(size(self%x)) :: k1, k2, k3, k4
      real(wp) :: h
      integer :: i, steps
      steps = ceiling(1024.0_wp*abs(t - self%now))
      h = (t - self%now)/max(steps, 1)
      do i = 0, steps - 1
         associate (s => self%now + i*h, x => self%x)
            call self%slope(s, x, k1)
            call self%slope(s + 0.5_wp*h, x + 0.5_wp*h*k1, k2)
            call self%slope(s + 0.5_wp*h, x + 0.5_wp*h*k2, k3)
            call self%slope(s + h, x + h*k3, k4)
            x = x + (h/6.0_wp)*(k1 + 2.0_wp*(k2 + k3) + k4)
         end associate
      end do
      self%now = t
      call self%slope(t, self%x, k1)
      call self%expand(t, self%x, k1, q, v, a, lambda, psi)
   end subroutine reduced_at

   subroutine pendulum_slope(self, t, x, dx)
      class(double_pendulum), intent(in) :: self
      real(wp), intent(in) :: t, x(:)
      real(wp), intent(out) :: dx(:)
      real(wp) :: m11, m12, m22, f1, f2, s
      associate (m => self%m, l => self%l)
         ! (m1 + m2) l1^2 a1 + m2 l1 l2 cos(d) a2 = ..., angles from the downward vertical
         m11 = (m(1) + m(2))*l(1)**2
         m12 = m(2)*l(1)*l(2)*cos(x(1) - x(2))
         m22 = m(2)*l(2)**2
         s = m(2)*l(1)*l(2)*sin(x(1) - x(2))
         f1 = -s*x(4)**2 - (m(1) + m(2))*gravity*l(1)*sin(x(1))
         f2 = s*x(3)**2 - m(2)*gravity*l(2)*sin(x(2))
      end associate
      dx = [x(3), x(4), (m22*f1 - m12*f2)/(m11*m22 - m12**2), (m11*f2 - m12*f1)/(m11*m22 - m12**2)]
   end subroutine pendulum_slope

   !> m r'' = m g - G^T lambda: first the second rod, then the first one
   subroutine pendulum_expand(self, t, x, dx, q, v, a, lambda, psi)
      class(double_pendulum), intent(in) :: self
      real(wp), intent(in) :: t, x(:), dx(:)
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp) :: e(2, 2), n(2, 2), down(2)
      integer :: i
      down = [0.0_wp, -gravity]
      do i = 1, 2
         e(:, i) = self%l(i)*[sin(x(i)), -cos(x(i))]
         n(:, i) = self%l(i)*[cos(x(i)), sin(x(i))]
      end do
      q(1:2) = e(:, 1)
      v(1:2) = n(:, 1)*x(3)
      a(1:2) = n(:, 1)*dx(3) - e(:, 1)*x(3)**2
      q(3:4) = q(1:2) + e(:, 2)
      v(3:4) = v(1:2) + n(:, 2)*x(4)
      a(3:4) = a(1:2) + n(:, 2)*dx(4) - e(:, 2)*x(4)**2
      lambda(2) = dot_product(e(:, 2), self%m(2)*(down - a(3:4)))/self%l(2)**2
      lambda(1) = dot_product(e(:, 1), self%m(1)*(down - a(1:2)) + lambda(2)*e(:, 2))/self%l(1)**2
      psi = t
   end subroutine pendulum_expand

   recursive subroutine pendulum_force(self, t, q, v, f, ierr)
      class(double_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -gravity*[0.0_wp, self%m(1), 0.0_wp, self%m(2)]
   end subroutine pendulum_force

   recursive subroutine pendulum_mass(self, t, q, v, mass, ierr)
      class(double_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = self%m([1, 1, 2, 2])
   end subroutine pendulum_mass

   recursive subroutine pendulum_constraint(self, t, q, g, ierr)
      class(double_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g = 0.5_wp*[q(1)**2 + q(2)**2 - self%l(1)**2, (q(3) - q(1))**2 + (q(4) - q(2))**2 - self%l(2)**2]
   end subroutine pendulum_constraint

   subroutine sleigh_slope(self, t, x, dx)
      class(chaplygin_sleigh), intent(in) :: self
      real(wp), intent(in) :: t, x(:)
      real(wp), intent(out) :: dx(:)
      associate (m => self%m, d => self%d, s => sin(x(3)), c => cos(x(3)), u => x(4), w => x(5))
         dx = [u*c - d*w*s, u*s + d*w*c, w, d*w**2, -m*d*u*w/(self%j + m*d**2)]
      end associate
   end subroutine sleigh_slope

   !> j phi'' = d psi
   subroutine sleigh_expand(self, t, x, dx, q, v, a, lambda, psi)
      class(chaplygin_sleigh), intent(in) :: self
      real(wp), intent(in) :: t, x(:), dx(:)
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp) :: along(2), across(2)
      along = [cos(x(3)), sin(x(3))]
      across = [-sin(x(3)), cos(x(3))]
      q = x(1:3)
      v = dx(1:3)
      a(1:2) = (dx(4) - self%d*x(5)**2)*along + (x(4)*x(5) + self%d*dx(5))*across
      a(3) = dx(5)
      psi = self%j*dx(5)/self%d
      lambda = t
   end subroutine sleigh_expand

   recursive subroutine sleigh_force(self, t, q, v, f, ierr)
      class(chaplygin_sleigh), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = 0.0_wp
   end subroutine sleigh_force

   recursive subroutine sleigh_mass(self, t, q, v, mass, ierr)
      class(chaplygin_sleigh), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = [self%m, self%m, self%j]
   end subroutine sleigh_mass

   recursive subroutine sleigh_velocity_constraint(self, t, q, v, k, ierr)
      class(chaplygin_sleigh), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      k(1) = v(2)*cos(q(3)) - v(1)*sin(q(3)) - self%d*v(3)
   end subroutine sleigh_velocity_constraint

   recursive subroutine sleigh_velocity_jacobian(self, t, q, v, kv, ierr)
      class(chaplygin_sleigh), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      ierr = 0
      kv%value = [-sin(q(3)), cos(q(3)), -self%d]
   end subroutine sleigh_velocity_jacobian

   !> Place, velocity and acceleration of the pivot
   pure subroutine pivot(t, p, dp, ddp)
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(2), dp(2), ddp(2)
      p = [0.25_wp*sin(2.0_wp*t), 0.2_wp*cos(3.0_wp*t)]
      dp = [0.5_wp*cos(2.0_wp*t), -0.6_wp*sin(3.0_wp*t)]
      ddp = [-sin(2.0_wp*t), -1.8_wp*cos(3.0_wp*t)]
   end subroutine pivot

   subroutine shaken_slope(self, t, x, dx)
      class(shaken_pendulum), intent(in) :: self
      real(wp), intent(in) :: t, x(:)
      real(wp), intent(out) :: dx(:)
      real(wp) :: p(2), dp(2), ddp(2)
      call pivot(t, p, dp, ddp)
      dx = [x(2), -dot_product([cos(x(1)), sin(x(1))], ddp + [0.0_wp, gravity])]
   end subroutine shaken_slope

   subroutine shaken_expand(self, t, x, dx, q, v, a, lambda, psi)
      class(shaken_pendulum), intent(in) :: self
      real(wp), intent(in) :: t, x(:), dx(:)
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp) :: p(2), dp(2), ddp(2), e(2), n(2)
      call pivot(t, p, dp, ddp)
      e = [sin(x(1)), -cos(x(1))]
      n = [cos(x(1)), sin(x(1))]
      q = p + e
      v = dp + n*x(2)
      a = ddp + n*dx(2) - e*x(2)**2
      lambda = dot_product(e, [0.0_wp, -gravity] - a)
      psi = 0.0_wp
   end subroutine shaken_expand

   recursive subroutine shaken_force(self, t, q, v, f, ierr)
      class(shaken_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = [0.0_wp, -gravity]
   end subroutine shaken_force

   recursive subroutine shaken_constraint(self, t, q, g, ierr)
      class(shaken_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: p(2), dp(2), ddp(2)
      ierr = 0
      call pivot(t, p, dp, ddp)
      g(1) = 0.5_wp*(sum((q - p)**2) - 1.0_wp)
   end subroutine shaken_constraint

   pure real(wp) function height(x, y)
      real(wp), intent(in) :: x, y
      height = x**2/4 + x*y/5 + y**2/3 - y/2
   end function height

   pure function slopes(x, y) result(s)
      real(wp), intent(in) :: x, y
      real(wp) :: s(2)
      s = [x/2 + y/5, x/5 + 2*y/3 - 0.5_wp]
   end function slopes

   !> The direction of motion d = (c, s, sigma): u' d.d + u d.d' = -g sigma
   subroutine skate_slope(self, t, x, dx)
      class(surface_skate), intent(in) :: self
      real(wp), intent(in) :: t, x(:)
      real(wp), intent(out) :: dx(:)
      real(wp) :: sigma, bend
      call skate_direction(self, x, sigma, bend)
      dx = [x(4)*cos(x(3)), x(4)*sin(x(3)), self%rate, -(gravity*sigma + x(4)*sigma*bend)/(1.0_wp + sigma**2)]
   end subroutine skate_slope

   !> sigma and its derivative
   subroutine skate_direction(self, x, sigma, bend)
      class(surface_skate), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp), intent(out) :: sigma, bend
      real(wp) :: s(2), e(2)
      s = slopes(x(1), x(2))
      e = [cos(x(3)), sin(x(3))]
      sigma = dot_product(s, e)
      bend = x(4)*(e(1)**2/2 + 2*e(1)*e(2)/5 + 2*e(2)**2/3) + self%rate*(s(2)*e(1) - s(1)*e(2))
   end subroutine skate_direction

   subroutine skate_expand(self, t, x, dx, q, v, a, lambda, psi)
      class(surface_skate), intent(in) :: self
      real(wp), intent(in) :: t, x(:), dx(:)
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp) :: sigma, bend, s(2), c1, s1
      call skate_direction(self, x, sigma, bend)
      s = slopes(x(1), x(2))
      c1 = cos(x(3))
      s1 = sin(x(3))
      q = [x(1), x(2), height(x(1), x(2)), x(3)]
      v = [dx(1), dx(2), x(4)*sigma, self%rate]
      a = [dx(4)*c1 - x(4)*self%rate*s1, dx(4)*s1 + x(4)*self%rate*c1, dx(4)*sigma + x(4)*bend, 0.0_wp]
      lambda = -self%m*(a(3) + gravity)
      psi = c1*(self%m*a(2) - s(2)*lambda(1)) - s1*(self%m*a(1) - s(1)*lambda(1))
   end subroutine skate_expand

   recursive subroutine skate_force(self, t, q, v, f, ierr)
      class(surface_skate), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = [0.0_wp, 0.0_wp, -self%m*gravity, 0.0_wp]
   end subroutine skate_force

   recursive subroutine skate_mass(self, t, q, v, mass, ierr)
      class(surface_skate), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = [self%m, self%m, self%m, self%j]
   end subroutine skate_mass

   recursive subroutine skate_constraint(self, t, q, g, ierr)
      class(surface_skate), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g(1) = q(3) - height(q(1), q(2))
   end subroutine skate_constraint

   recursive subroutine skate_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(surface_skate), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      gq%value = [-slopes(q(1), q(2)), 1.0_wp]
   end subroutine skate_constraint_jacobian

   recursive subroutine skate_velocity_constraint(self, t, q, v, k, ierr)
      class(surface_skate), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      k(1) = v(1)*sin(q(4)) - v(2)*cos(q(4))
   end subroutine skate_velocity_constraint

   recursive subroutine skate_velocity_jacobian(self, t, q, v, kv, ierr)
      class(surface_skate), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      ierr = 0
      kv%value = [sin(q(4)), -cos(q(4))]
   end subroutine skate_velocity_jacobian

   !> q1 and q2 turn, q4 drifts, and q3 = 3/2 - q1^2 q2
   subroutine made_at(self, t, q, v, a, lambda, psi)
      class(manufactured_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      q = [cos(1.3_wp*t + 0.4_wp), 1.0_wp + 0.5_wp*sin(t), 0.0_wp, 0.5_wp*t + 0.3_wp*sin(2.0_wp*t)]
      v = [-1.3_wp*sin(1.3_wp*t + 0.4_wp), 0.5_wp*cos(t), 0.0_wp, 0.5_wp + 0.6_wp*cos(2.0_wp*t)]
      a = [-1.69_wp*q(1), -0.5_wp*sin(t), 0.0_wp, -1.2_wp*sin(2.0_wp*t)]
      q(3) = 1.5_wp - q(1)**2*q(2)
      v(3) = -2.0_wp*q(1)*v(1)*q(2) - q(1)**2*v(2)
      a(3) = -2.0_wp*((v(1)**2 + q(1)*a(1))*q(2) + 2.0_wp*q(1)*v(1)*v(2)) - q(1)**2*a(2)
      lambda = 1.0_wp + 0.3_wp*sin(1.7_wp*t)
      psi = 0.8_wp*cos(t) - 0.2_wp
   end subroutine made_at

   recursive subroutine made_force(self, t, q, v, f, ierr)
      class(manufactured_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      real(wp), dimension(4) :: q1, v1, a1, r
      real(wp) :: lambda(1), psi(1)
      call self%at(t, q1, v1, a1, lambda, psi)
      call self%reaction(t, q1, v1, lambda, psi, r, ierr)
      f = matmul(made_matrix(t, q1), a1) - r - sin(q - q1) - 0.3_wp*(v - v1)
      f(1) = f(1) + 0.2_wp*(q(1)*v(4) - q1(1)*v1(4))
   end subroutine made_force

   pure function made_matrix(t, q) result(m)
      real(wp), intent(in) :: t, q(4)
      real(wp) :: m(4, 4)
      m = 0.0_wp
      m(1, :) = [2.0_wp + 0.3_wp*sin(q(2)), 0.1_wp*q(3), 0.0_wp, 0.2_wp*cos(t)]
      m(2, :) = [0.4_wp*q(1), 1.5_wp, 0.2_wp*sin(q(4)), 0.0_wp]
      m(3, :) = [0.0_wp, 0.1_wp, 1.0_wp + 0.2_wp*q(1)**2, 0.1_wp*t]
      m(4, :) = [0.2_wp*q(4), 0.0_wp, 0.3_wp, 1.2_wp + 0.2_wp*q(2)]
   end function made_matrix

   recursive subroutine made_mass(self, t, q, v, mass, ierr)
      class(manufactured_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a = made_matrix(t, q)
   end subroutine made_mass

   recursive subroutine made_constraint(self, t, q, g, ierr)
      class(manufactured_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g(1) = q(1)**2*q(2) + q(3) - 1.5_wp
   end subroutine made_constraint

   recursive subroutine made_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(manufactured_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      gq%value = [2.0_wp*q(1)*q(2), q(1)**2, 1.0_wp, 0.0_wp]
   end subroutine made_constraint_jacobian

   pure real(wp) function made_k(q, v)
      real(wp), intent(in) :: q(4), v(4)
      made_k = v(1)*v(4) + q(2)*v(3) + (2.0_wp + sin(q(4)))*v(2)
   end function made_k

   recursive subroutine made_velocity_constraint(self, t, q, v, k, ierr)
      class(manufactured_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      real(wp) :: q1(4), v1(4), a1(4), lambda(1), psi(1)
      ierr = 0
      call self%at(t, q1, v1, a1, lambda, psi)
      k(1) = made_k(q, v) - made_k(q1, v1)
   end subroutine made_velocity_constraint

   recursive subroutine made_velocity_jacobian(self, t, q, v, kv, ierr)
      class(manufactured_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      ierr = 0
      kv%value = [v(4), 2.0_wp + sin(q(4)), q(2), v(1)]
   end subroutine made_velocity_jacobian

   recursive subroutine made_reaction(self, t, q, v, lambda, psi, r, ierr)
      class(manufactured_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      r = -(lambda(1) + 0.3_wp*lambda(1)**2)*[2.0_wp*q(1)*q(2), q(1)**2, 1.0_wp, 0.0_wp] &
         & - (psi(1) + 0.2_wp*psi(1)**3)*[v(4), 2.0_wp + sin(q(4)), q(2), v(1)] &
         & + (0.1_wp*lambda(1)*psi(1))*[q(2), 0.0_wp, 1.0_wp, v(3)]
   end subroutine made_reaction

   recursive subroutine made_reaction_jacobian(self, t, q, v, lambda, psi, rl, rp, ierr)
      class(manufactured_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(inout) :: rl(self%n, self%holonomic), rp(self%n, self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      rl(:, 1) = -(1.0_wp + 0.6_wp*lambda(1))*[2.0_wp*q(1)*q(2), q(1)**2, 1.0_wp, 0.0_wp] &
         & + (0.1_wp*psi(1))*[q(2), 0.0_wp, 1.0_wp, v(3)]
      rp(:, 1) = -(1.0_wp + 0.6_wp*psi(1)**2)*[v(4), 2.0_wp + sin(q(4)), q(2), v(1)] &
         & + (0.1_wp*lambda(1))*[q(2), 0.0_wp, 1.0_wp, v(3)]
   end subroutine made_reaction_jacobian

   subroutine free_at(self, t, q, v, a, lambda, psi)
      class(free_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: q(self%n), v(self%n), a(self%n)
      real(wp), intent(out) :: lambda(self%holonomic), psi(self%nonholonomic)
      q = [sin(1.4_wp*t + 0.3_wp), cos(t) + 0.2_wp*t]
      v = [1.4_wp*cos(1.4_wp*t + 0.3_wp), -sin(t) + 0.2_wp]
      a = [-1.96_wp*q(1), -cos(t)]
      lambda = 0.0_wp
      psi = 0.0_wp
   end subroutine free_at

   pure function free_matrix(t, q, v, of_velocity) result(m)
      real(wp), intent(in) :: t, q(2), v(2), of_velocity
      real(wp) :: m(2, 2)
      m(1, :) = [2.0_wp + 0.5_wp*sin(q(2) + t) + of_velocity*v(1)**2, 0.3_wp*q(1)]
      m(2, :) = [0.5_wp*q(2), 1.5_wp + 0.4_wp*cos(q(1)) + of_velocity*sin(v(2))]
   end function free_matrix

   recursive subroutine free_force(self, t, q, v, f, ierr)
      class(free_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      real(wp) :: q1(2), v1(2), a1(2), no_lambda(0), no_psi(0)
      ierr = 0
      call self%at(t, q1, v1, a1, no_lambda, no_psi)
      f = matmul(free_matrix(t, q1, v1, self%of_velocity), a1) - 3.0_wp*sin(q - q1) - 0.3_wp*(v - v1)
   end subroutine free_force

   recursive subroutine free_mass(self, t, q, v, mass, ierr)
      class(free_motion), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a = free_matrix(t, q, v, self%of_velocity)
   end subroutine free_mass
end module known_motions
