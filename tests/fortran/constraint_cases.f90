! SPDX-License-Identifier: BSD-3-Clause
!> Constraints whose Jacobians and curvatures are known in closed form, with and without giving them.
module constraint_cases
   use dynstep, only: jacobian_type, matrix_type, mechanical_system, wp
   implicit none
   private

   integer, parameter, public :: arm = 1, bar = 2, drive = 3, chain = 4, edge = 5

   !> Only g and k are overridden; no force
   type, extends(mechanical_system), public :: bare_type
      integer :: problem = arm
      real(wp) :: length = 1.0_wp           !! of arms and bars
      real(wp) :: origin = 0.0_wp           !! of x
      real(wp) :: rate = 1.0_wp             !! of the drive, in rad per unit of time
      real(wp) :: least = -huge(1.0_wp)     !! ierr = 1 where q(1) is less
      real(wp) :: most = huge(1.0_wp)       !! or more
      integer :: refusal = 1                !! value of ierr there
      integer :: calls = 0
   contains
      procedure :: setup => bare_setup
      procedure :: force => bare_force
      procedure :: constraint => bare_constraint
      procedure :: velocity_constraint => bare_velocity_constraint
      procedure :: exact_jacobian => bare_exact_jacobian
      procedure :: exact_curvature => bare_exact_curvature
      procedure :: exact_velocity_jacobian => bare_exact_velocity_jacobian
      procedure :: exact_velocity_curvature => bare_exact_velocity_curvature
   end type bare_type

   !> Gives its Jacobians and curvatures, each with an error of its own
   type, extends(bare_type), public :: given_type
      logical :: gives_curvature = .true.
      real(wp) :: slip_g = 0.0_wp, slip_t = 0.0_wp, slip_c = 0.0_wp, slip_k = 0.0_wp, slip_kc = 0.0_wp
   contains
      procedure :: constraint_jacobian => given_constraint_jacobian
      procedure :: constraint_curvature => given_constraint_curvature
      procedure :: velocity_jacobian => given_velocity_jacobian
      procedure :: velocity_curvature => given_velocity_curvature
   end type given_type

contains

   !> A chain has links; the other problems have a size of their own
   subroutine bare_setup(self, problem, links)
      class(bare_type), intent(inout) :: self
      integer, intent(in) :: problem
      integer, intent(in), optional :: links
      integer :: i
      self%problem = problem
      self%holonomic = 0
      self%nonholonomic = 0
      select case (problem)
      case (arm)
         self%n = 4
         self%holonomic = 2
      case (bar)
         self%n = 4
         self%holonomic = 1
      case (drive)
         self%n = 3
         self%holonomic = 2
      case (chain)
         self%n = 2*links + 2
         self%holonomic = links
         self%constraints%g%first = [(4*i + 1, i=0, links)]
         self%constraints%g%column = [(i + 2*((i - 1)/4) - 4*((i - 1)/4), i=1, 4*links)]
      case (edge)
         self%n = 3
         self%nonholonomic = 2
      end select
   end subroutine bare_setup

   recursive subroutine bare_force(self, t, q, v, f, ierr)
      class(bare_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = 0.0_wp
   end subroutine bare_force

   !> arm: a tip on two turning arms; bar: two points, with a root; drive: an angle and a crank that follow
   !> the time; chain: points with bars, without roots
   recursive subroutine bare_constraint(self, t, q, g, ierr)
      class(bare_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      integer :: i
      self%calls = self%calls + 1
      ierr = merge(self%refusal, 0, q(1) < self%least .or. q(1) > self%most)
      g = 0.0_wp
      if (ierr /= 0) return
      associate (l => self%length, o => self%origin, w => self%rate)
         select case (self%problem)
         case (arm)
            g(1) = q(1) - o - l*cos(q(3)) - 0.7_wp*l*cos(q(3) + q(4))
            g(2) = q(2) - l*sin(q(3)) - 0.7_wp*l*sin(q(3) + q(4))
         case (bar)
            g(1) = sqrt((q(3) - q(1))**2 + (q(4) - q(2))**2) - l
         case (drive)
            g(1) = q(3) - 0.3_wp*sin(w*t)
            g(2) = q(1) - l*cos(q(3) + w*t)
         case (chain)
            do i = 1, self%holonomic
               g(i) = (q(2*i + 1) - q(2*i - 1))**2 + (q(2*i + 2) - q(2*i))**2 - l**2
            end do
         end select
      end associate
   end subroutine bare_constraint

   !> edge: no motion across the heading q(3), which the time turns too; speed on a sphere of its own
   recursive subroutine bare_velocity_constraint(self, t, q, v, k, ierr)
      class(bare_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      self%calls = self%calls + 1
      ierr = merge(self%refusal, 0, q(1) < self%least .or. q(1) > self%most)
      k = 0.0_wp
      if (ierr /= 0 .or. self%nonholonomic == 0) return
      associate (angle => q(3) + self%rate*t)
         k(1) = v(1)*sin(angle) - v(2)*cos(angle)
         k(2) = sqrt(v(1)**2 + v(2)**2) - 2.0_wp*v(3)*q(1)**2
      end associate
   end subroutine bare_velocity_constraint

   subroutine bare_exact_jacobian(self, t, q, g, gt)
      class(bare_type), intent(in) :: self
      real(wp), intent(in) :: t, q(:)
      real(wp), intent(out) :: g(:, :), gt(:)
      real(wp) :: r
      integer :: i
      g = 0.0_wp
      gt = 0.0_wp
      associate (l => self%length, w => self%rate)
         select case (self%problem)
         case (arm)
            g(1, :) = [1.0_wp, 0.0_wp, l*sin(q(3)) + 0.7_wp*l*sin(q(3) + q(4)), 0.7_wp*l*sin(q(3) + q(4))]
            g(2, :) = [0.0_wp, 1.0_wp, -l*cos(q(3)) - 0.7_wp*l*cos(q(3) + q(4)), -0.7_wp*l*cos(q(3) + q(4))]
         case (bar)
            r = sqrt((q(3) - q(1))**2 + (q(4) - q(2))**2)
            g(1, :) = [q(1) - q(3), q(2) - q(4), q(3) - q(1), q(4) - q(2)]/r
         case (drive)
            g(1, 3) = 1.0_wp
            g(2, 1) = 1.0_wp
            g(2, 3) = l*sin(q(3) + w*t)
            gt = [-0.3_wp*w*cos(w*t), w*l*sin(q(3) + w*t)]
         case (chain)
            do i = 1, self%holonomic
               g(i, 2*i - 1) = -2.0_wp*(q(2*i + 1) - q(2*i - 1))
               g(i, 2*i) = -2.0_wp*(q(2*i + 2) - q(2*i))
               g(i, 2*i + 1:2*i + 2) = -g(i, 2*i - 1:2*i)
            end do
         end select
      end associate
   end subroutine bare_exact_jacobian

   subroutine bare_exact_curvature(self, t, q, v, c)
      class(bare_type), intent(in) :: self
      real(wp), intent(in) :: t, q(:), v(:)
      real(wp), intent(out) :: c(:)
      real(wp) :: d(2), u(2), r
      integer :: i
      c = 0.0_wp
      associate (l => self%length, w => self%rate)
         select case (self%problem)
         case (arm)
            c(1) = l*cos(q(3))*v(3)**2 + 0.7_wp*l*cos(q(3) + q(4))*(v(3) + v(4))**2
            c(2) = l*sin(q(3))*v(3)**2 + 0.7_wp*l*sin(q(3) + q(4))*(v(3) + v(4))**2
         case (bar)
            d = q(3:4) - q(1:2)
            u = v(3:4) - v(1:2)
            r = sqrt(dot_product(d, d))
            c(1) = (d(1)*u(2) - d(2)*u(1))**2/r**3
         case (drive)
            c(1) = 0.3_wp*w**2*sin(w*t)
            c(2) = l*cos(q(3) + w*t)*(v(3) + w)**2
         case (chain)
            do i = 1, self%holonomic
               c(i) = 2.0_wp*(v(2*i + 1) - v(2*i - 1))**2 + 2.0_wp*(v(2*i + 2) - v(2*i))**2
            end do
         end select
      end associate
   end subroutine bare_exact_curvature

   subroutine bare_exact_velocity_jacobian(self, t, q, v, k)
      class(bare_type), intent(in) :: self
      real(wp), intent(in) :: t, q(:), v(:)
      real(wp), intent(out) :: k(:, :)
      real(wp) :: angle
      k = 0.0_wp
      if (self%problem /= edge) return
      angle = q(3) + self%rate*t
      k(1, :) = [sin(angle), -cos(angle), 0.0_wp]
      k(2, :) = [v(1:2)/sqrt(v(1)**2 + v(2)**2), -2.0_wp*q(1)**2]
   end subroutine bare_exact_velocity_jacobian

   subroutine bare_exact_velocity_curvature(self, t, q, v, c)
      class(bare_type), intent(in) :: self
      real(wp), intent(in) :: t, q(:), v(:)
      real(wp), intent(out) :: c(:)
      real(wp) :: angle
      c = 0.0_wp
      if (self%problem /= edge) return
      angle = q(3) + self%rate*t
      c(1) = (v(1)*cos(angle) + v(2)*sin(angle))*(v(3) + self%rate)
      c(2) = -4.0_wp*v(3)*q(1)*v(1)
   end subroutine bare_exact_velocity_curvature

   !> slip_g is added to the last entry that the last row has
   recursive subroutine given_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(given_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: g(self%holonomic, self%n)
      integer :: i, j
      ierr = merge(self%refusal, 0, q(1) < self%least .or. q(1) > self%most)
      if (ierr /= 0) return
      call self%exact_jacobian(t, q, g, gt)
      do j = 1, self%n
         do i = 1, self%holonomic
            call gq%set_entry(i, j, g(i, j))
         end do
      end do
      associate (last => gq%value(size(gq%value)))
         last = last + self%slip_g
      end associate
      gt(self%holonomic) = gt(self%holonomic) + self%slip_t
   end subroutine given_constraint_jacobian

   recursive subroutine given_constraint_curvature(self, t, q, v, c, ierr)
      class(given_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      if (self%gives_curvature) then
         call self%exact_curvature(t, q, v, c)
      else
         call self%difference_constraint_curvature(t, q, v, c, ierr)
      end if
      c(self%holonomic) = c(self%holonomic) + self%slip_c
   end subroutine given_constraint_curvature

   recursive subroutine given_velocity_jacobian(self, t, q, v, kv, ierr)
      class(given_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      real(wp) :: k(self%nonholonomic, self%n)
      integer :: i, j
      ierr = 0
      call self%exact_velocity_jacobian(t, q, v, k)
      do j = 1, self%n
         do i = 1, self%nonholonomic
            call kv%set_entry(i, j, k(i, j))
         end do
      end do
      call kv%set_entry(1, 1, k(1, 1) + self%slip_k)
   end subroutine given_velocity_jacobian

   recursive subroutine given_velocity_curvature(self, t, q, v, c, ierr)
      class(given_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      if (self%gives_curvature) then
         call self%exact_velocity_curvature(t, q, v, c)
      else
         call self%difference_velocity_curvature(t, q, v, c, ierr)
      end if
      c(1) = c(1) + self%slip_kc
   end subroutine given_velocity_curvature
end module constraint_cases
