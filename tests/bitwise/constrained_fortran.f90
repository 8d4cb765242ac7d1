! SPDX-License-Identifier: BSD-3-Clause
!> The constrained problems of README.md by the Fortran modules; with an argument problem c alone.
module constrained_systems
   use dynstep, only: jacobian_type, matrix_type, mechanical_system, wp
   implicit none
   private

   !> Problem c
   type, extends(mechanical_system), public :: rod_type
   contains
      procedure :: force => rod_force
      procedure :: mass => rod_mass
      procedure :: tangent => rod_tangent
      procedure :: constraint => rod_constraint
      procedure :: constraint_jacobian => rod_constraint_jacobian
   end type rod_type

   !> Problem d
   type, extends(mechanical_system), public :: edge_type
   contains
      procedure :: force => edge_force
      procedure :: mass => edge_mass
      procedure :: constraint => edge_constraint
      procedure :: constraint_jacobian => edge_constraint_jacobian
      procedure :: constraint_curvature => edge_constraint_curvature
      procedure :: velocity_constraint => edge_velocity_constraint
      procedure :: velocity_jacobian => edge_velocity_jacobian
      procedure :: velocity_curvature => edge_velocity_curvature
      procedure :: reaction => edge_reaction
      procedure :: reaction_jacobian => edge_reaction_jacobian
   end type edge_type

contains

   recursive subroutine rod_force(self, t, q, v, f, ierr)
      class(rod_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = [0.0_wp, -49.05_wp, -(100.0_wp*v(3) + 3000.0_wp*(q(3) - 4.71238898038469_wp))]
   end subroutine rod_force

   recursive subroutine rod_mass(self, t, q, v, mass, ierr)
      class(rod_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = [5.0_wp, 5.0_wp, 6.666666666666667_wp]
   end subroutine rod_mass

   recursive subroutine rod_tangent(self, t, q, v, a, k, c, ierr)
      class(rod_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      call k%set_entry(3, 3, 3000.0_wp)
      call c%set_entry(3, 3, 100.0_wp)
   end subroutine rod_tangent

   recursive subroutine rod_constraint(self, t, q, g, ierr)
      class(rod_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g = [q(1) - 2.0_wp*cos(q(3)), q(2) - 2.0_wp*sin(q(3))]
   end subroutine rod_constraint

   recursive subroutine rod_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(rod_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      gq%value = [1.0_wp, 0.0_wp, 2.0_wp*sin(q(3)), 0.0_wp, 1.0_wp, -(2.0_wp*cos(q(3)))]
   end subroutine rod_constraint_jacobian

   recursive subroutine edge_force(self, t, q, v, f, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = [1.0_wp - 0.125_wp*q(1), 0.0_wp - 0.5_wp*v(2), 0.0_wp]
   end subroutine edge_force

   recursive subroutine edge_mass(self, t, q, v, mass, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      mass%a(:, 1) = [1.0_wp, 1.0_wp + (0.25_wp*q(3))*q(3), 0.5_wp]
   end subroutine edge_mass

   recursive subroutine edge_constraint(self, t, q, g, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g(1) = q(3) - t*(1.0_wp + 0.25_wp*t)
   end subroutine edge_constraint

   recursive subroutine edge_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      call gq%set_entry(1, 3, 1.0_wp)
      gt(1) = -(1.0_wp + 0.5_wp*t)
   end subroutine edge_constraint_jacobian

   recursive subroutine edge_constraint_curvature(self, t, q, v, c, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      c = -0.5_wp
   end subroutine edge_constraint_curvature

   recursive subroutine edge_velocity_constraint(self, t, q, v, k, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      k(1) = sin(q(3))*v(1) - cos(q(3))*v(2)
   end subroutine edge_velocity_constraint

   recursive subroutine edge_velocity_jacobian(self, t, q, v, kv, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv
      integer, intent(out) :: ierr
      ierr = 0
      kv%value = [sin(q(3)), -cos(q(3))]
   end subroutine edge_velocity_jacobian

   recursive subroutine edge_velocity_curvature(self, t, q, v, c, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      c(1) = (cos(q(3))*v(1) + sin(q(3))*v(2))*v(3)
   end subroutine edge_velocity_curvature

   recursive subroutine edge_reaction(self, t, q, v, lambda, psi, r, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr
      real(wp) :: s
      ierr = 0
      s = psi(1) + ((0.125_wp*psi(1))*psi(1))*psi(1)
      r = [-(sin(q(3))*s), cos(q(3))*s, -lambda(1)]
   end subroutine edge_reaction

   recursive subroutine edge_reaction_jacobian(self, t, q, v, lambda, psi, rl, rp, ierr)
      class(edge_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(inout) :: rl(self%n, self%holonomic)
      real(wp), intent(inout) :: rp(self%n, self%nonholonomic)
      integer, intent(out) :: ierr
      real(wp) :: s
      ierr = 0
      s = 1.0_wp + (0.375_wp*psi(1))*psi(1)
      rl(3, 1) = -1.0_wp
      rp(1, 1) = -(sin(q(3))*s)
      rp(2, 1) = cos(q(3))*s
   end subroutine edge_reaction_jacobian
end module constrained_systems

program constrained_fortran
   use constrained_systems, only: edge_type, rod_type
   use dynstep, only: allocate_state, coefficients_of, control_type, integrate, kind_diagonal, mass_recomputed, &
      & mechanical_system, pattern_type, soi2_stepper, state_type, status_type, trajectory_type, variant_reduced, wp
   implicit none
   type(rod_type) :: rod
   type(edge_type) :: edge

   rod%n = 3
   rod%holonomic = 2
   rod%structure%mass = kind_diagonal
   rod%structure%tangent = kind_diagonal
   rod%structure%tangent_is_symmetric = .true.
   rod%structure%tangent_is_constant = .true.
   call one_run('c', 'soi2', 0.8_wp, rod, [0.0_wp, -2.0_wp, 4.71238898038469_wp, 20.0_wp, 0.0_wp, 10.0_wp])
   call one_run('c', 'times', 0.8_wp, rod, [0.0_wp, -2.0_wp, 4.71238898038469_wp, 20.0_wp, 0.0_wp, 10.0_wp])
   if (command_argument_count() > 0) stop

   edge%n = 3
   edge%holonomic = 1
   edge%nonholonomic = 1
   edge%structure%mass = kind_diagonal
   edge%structure%mass_is_constant = .false.
   edge%constraints%k = pattern_type([1, 3], [1, 2])
   edge%constraints%reaction_is_general = .true.
   call one_run('d', 'soi2', 0.8_wp, edge, [0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp])
   call one_run('d', 'reduced', 0.5_wp, edge, [0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp])

contains

   subroutine one_run(problem, name, rho_inf, sys, y)
      character(len=*), intent(in) :: problem, name
      real(wp), intent(in) :: rho_inf
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: y(:)
      type(control_type) :: control
      type(soi2_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      type(trajectory_type) :: points
      integer :: i

      call coefficients_of(rho_inf, stepper%coefficients, status)
      if (name == 'reduced') then
         stepper%variant = variant_reduced
         stepper%mass_at = mass_recomputed
      end if
      if (name == 'times') control%t_eval = [0.1_wp, 0.11_wp, 0.5_wp, 0.99_wp]
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      state%t = 0.0_wp
      state%y = y
      control%h = 1.0_wp/64.0_wp
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, 1.0_wp, control, status, points)
      if (status%failed()) error stop 1
      do i = 1, points%count
         write (*, '(a, 1x, a, 99(1x, z16.16))') problem, name, points%t(i), points%y(:, i), points%a(:, i), &
            & points%lambda(:, i), points%psi(:, i)
      end do
   end subroutine one_run
end program constrained_fortran
