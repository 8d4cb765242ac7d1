! SPDX-License-Identifier: BSD-3-Clause
!> A chain of N equal uniform rods in absolute coordinates, pinned to each other and to the ground at the origin.
!>
!>   q(3i-2:3i) = (x, y, theta) of the centre of rod i, theta from the x axis (-pi/2 hangs down)
!>   M = diag(m, m, m l^2/12, ...),   f = (0, -m g, 0, ...)
!>   g(2i-1:2i) = start of rod i less end of rod i - 1:
!>                x_i - (l/2) cos(theta_i) - x_{i-1} - (l/2) cos(theta_{i-1}),  and so for y with sines
!>
!> 3N coordinates, 2N constraints.  In the order (lambda_i, q_i), rod by rod, the equations have a band of
!> four on each side: the cost of a step is linear in N.
module dynstep_rod_chain
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_diagonal, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   type, extends(mechanical_system), public :: rod_chain
      integer :: rods = 0                !! N, set by `setup`
      real(wp) :: m = 1.0_wp             !! mass of a rod > 0
      real(wp) :: l = 1.0_wp             !! length of a rod > 0
      real(wp) :: gravity = 9.81_wp      !! along -y
   contains
      procedure :: setup => chain_setup
      procedure :: force => chain_force
      procedure :: mass => chain_mass
      procedure :: tangent => chain_tangent
      procedure :: energy => chain_energy
      procedure :: constraint => chain_constraint
      procedure :: constraint_jacobian => chain_constraint_jacobian
      procedure :: constraint_curvature => chain_constraint_curvature
      procedure :: reaction_tangent => chain_reaction_tangent
      procedure :: start => chain_start
   end type rod_chain

contains

   !> Fill n, the number of constraints, and what is declared
   recursive subroutine chain_setup(self, rods, status)
      class(rod_chain), intent(inout) :: self
      integer, intent(in) :: rods                     !! N >= 1
      type(status_type), intent(inout) :: status
      integer :: i, row, entries, stat

      if (status%failed()) return
      if (rods < 1) then
         call status%set(dynstep_invalid_input, 'a chain has one rod at least, not '//text(rods))
         return
      end if
      self%rods = rods
      self%n = 3*rods
      self%holonomic = 2*rods
      self%structure%mass = kind_diagonal
      self%structure%tangent = kind_diagonal
      self%structure%tangent_is_symmetric = .true.
      self%structure%tangent_is_constant = .true.
      self%structure%velocity_free = .true.
      self%structure%has_energy = .true.
      self%constraints%has_reaction_tangent = .true.

      associate (s => self%constraints)
         if (allocated(s%g%first)) deallocate (s%g%first, s%g%column)
         if (allocated(s%order)) deallocate (s%order)
         allocate (s%g%first(2*rods + 1), s%g%column(8*rods - 4), s%order(5*rods), stat=stat)
         if (stat /= 0) then
            call status%set(dynstep_no_memory, 'no memory for a chain of '//text(rods)//' rods')
            return
         end if
         s%g%first(1:3) = [1, 3, 5]
         s%g%column(1:4) = [1, 3, 2, 3]
         do i = 2, rods
            row = 2*i - 1
            entries = 8*(i - 1) - 4
            s%g%first(row + 1:row + 2) = entries + [5, 9]
            s%g%column(entries + 1:entries + 8) = 3*i + [-5, -3, -2, 0, -4, -3, -1, 0]
         end do
         do i = 1, rods
            s%order(5*i - 4:5*i) = [self%n + 2*i - 1, self%n + 2*i, 3*i - 2, 3*i - 1, 3*i]
         end do
      end associate
   end subroutine chain_setup

   recursive subroutine chain_force(self, t, q, v, f, ierr)
      class(rod_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      integer :: i
      ierr = 0
      do i = 1, self%n, 3
         f(i) = 0.0_wp
         f(i + 1) = -self%m*self%gravity
         f(i + 2) = 0.0_wp
      end do
   end subroutine chain_force

   recursive subroutine chain_mass(self, t, q, v, mass, ierr)
      class(rod_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = self%m
      mass%a(3::3, 1) = self%m*self%l**2/12.0_wp
   end subroutine chain_mass

   !> The force is constant: no entries
   recursive subroutine chain_tangent(self, t, q, v, a, k, c, ierr)
      class(rod_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
   end subroutine chain_tangent

   !> Conserved
   recursive subroutine chain_energy(self, t, q, v, energy, ierr)
      class(rod_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      integer :: i
      ierr = 0
      energy = 0.0_wp
      do i = 1, self%n, 3
         energy = energy + self%m*(0.5_wp*(v(i)**2 + v(i + 1)**2 + (self%l*v(i + 2))**2/12.0_wp) + self%gravity*q(i + 1))
      end do
   end subroutine chain_energy

   recursive subroutine chain_constraint(self, t, q, g, ierr)
      class(rod_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: half, x, y, pin_x, pin_y
      integer :: i
      ierr = 0
      half = 0.5_wp*self%l
      pin_x = 0.0_wp
      pin_y = 0.0_wp
      do i = 1, self%rods
         x = half*cos(q(3*i))
         y = half*sin(q(3*i))
         g(2*i - 1) = (q(3*i - 2) - x) - pin_x
         g(2*i) = (q(3*i - 1) - y) - pin_y
         pin_x = q(3*i - 2) + x
         pin_y = q(3*i - 1) + y
      end do
   end subroutine chain_constraint

   !> In the order of the pattern: columns x, theta of rod i - 1 and of rod i, then y, theta of both
   recursive subroutine chain_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(rod_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: half, x, y, x_before, y_before
      integer :: i, e
      ierr = 0
      half = 0.5_wp*self%l
      x = half*cos(q(3))
      y = half*sin(q(3))
      gq%value(1) = 1.0_wp
      gq%value(2) = y
      gq%value(3) = 1.0_wp
      gq%value(4) = -x
      e = 4
      do i = 2, self%rods
         x_before = x
         y_before = y
         x = half*cos(q(3*i))
         y = half*sin(q(3*i))
         gq%value(e + 1) = -1.0_wp
         gq%value(e + 2) = y_before
         gq%value(e + 3) = 1.0_wp
         gq%value(e + 4) = y
         gq%value(e + 5) = -1.0_wp
         gq%value(e + 6) = -x_before
         gq%value(e + 7) = 1.0_wp
         gq%value(e + 8) = -x
         e = e + 8
      end do
   end subroutine chain_constraint_jacobian

   recursive subroutine chain_constraint_curvature(self, t, q, v, c, ierr)
      class(rod_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      real(wp) :: pull, x, y, x_before, y_before
      integer :: i
      ierr = 0
      x_before = 0.0_wp
      y_before = 0.0_wp
      do i = 1, self%rods
         pull = 0.5_wp*self%l*v(3*i)**2
         x = pull*cos(q(3*i))
         y = pull*sin(q(3*i))
         c(2*i - 1) = x + x_before
         c(2*i) = y + y_before
         x_before = x
         y_before = y
      end do
   end subroutine chain_constraint_curvature

   !> The forces of both pins of a rod turn with it: entries of theta alone
   recursive subroutine chain_reaction_tangent(self, t, q, v, lambda, psi, k, c, ierr)
      class(rod_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      real(wp) :: half, x, y
      integer :: i
      ierr = 0
      half = 0.5_wp*self%l
      do i = 1, self%rods
         x = lambda(2*i - 1)
         y = lambda(2*i)
         if (i < self%rods) then
            x = x + lambda(2*i + 1)
            y = y + lambda(2*i + 2)
         end if
         k%a(3*i, 1) = k%a(3*i, 1) + half*(cos(q(3*i))*x + sin(q(3*i))*y)
      end do
   end subroutine chain_reaction_tangent

   !> q and v on both levels of the constraints
   pure subroutine chain_start(self, theta, rate, q, v)
      class(rod_chain), intent(in) :: self
      real(wp), intent(in) :: theta(self%rods), rate(self%rods)   !! angles and their derivatives
      real(wp), intent(out) :: q(self%n), v(self%n)
      real(wp) :: half(2), turn(2), pin(2), pin_v(2)
      integer :: i
      pin = 0.0_wp
      pin_v = 0.0_wp
      do i = 1, self%rods
         half = 0.5_wp*self%l*[cos(theta(i)), sin(theta(i))]
         turn = rate(i)*[-half(2), half(1)]
         q(3*i - 2:3*i) = [pin + half, theta(i)]
         v(3*i - 2:3*i) = [pin_v + turn, rate(i)]
         pin = pin + 2.0_wp*half
         pin_v = pin_v + 2.0_wp*turn
      end do
   end subroutine chain_start
end module dynstep_rod_chain
