! SPDX-License-Identifier: BSD-3-Clause
!> Planar point masses that attract each other, and a fixed centre at the origin that attracts them all:
!>
!>   q_i'' = sum over j /= i of m_j (q_j - q_i)/|q_j - q_i|^3 - m_0 q_i/|q_i|^3
!>
!> The forces depend on the positions alone.  Two examples of the literature (E. Hairer, S. P. Norsett, G. Wanner,
!> Solving Ordinary Differential Equations I, section II.10 and II.0):
!>
!>   pleiades(sys, y)               seven masses 1, ..., 7 with close encounters, t = 0 to 3
!>   kepler(sys, y, eccentricity)   one mass about a fixed centre from the pericentre; period 2 pi
module dynstep_point_masses
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   implicit none
   private

   public :: kepler, pleiades

   !> q = [x_1, ..., x_N, y_1, ..., y_N], n = 2N
   type, extends(mechanical_system), public :: point_masses_system
      real(wp), allocatable :: m(:)      !! masses [N], gravity's constant in them
      real(wp) :: centre = 0.0_wp        !! m_0
   contains
      procedure :: setup => point_masses_setup
      procedure :: force => point_masses_force
      procedure :: energy => point_masses_energy
      procedure :: exact_kepler => point_masses_exact_kepler
   end type point_masses_system

contains

   subroutine point_masses_setup(self, m, centre)
      class(point_masses_system), intent(inout) :: self
      real(wp), intent(in) :: m(:)       !! [N], > 0
      real(wp), intent(in) :: centre     !! >= 0
      self%m = m
      self%centre = centre
      self%n = 2*size(m)
      self%structure%velocity_free = .true.
      self%structure%tangent_is_symmetric = size(m) == 1
      self%structure%has_energy = .true.
   end subroutine point_masses_setup

   !> Accelerations: the mass matrix is the identity.  ierr = 1 where two masses are at one place.
   recursive subroutine point_masses_force(self, t, q, v, f, ierr)
      class(point_masses_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      real(wp) :: dx, dy, r2, c
      integer :: i, j, n
      n = self%n/2
      f = 0.0_wp
      ierr = 1
      do i = 1, n
         if (self%centre > 0.0_wp) then
            r2 = q(i)**2 + q(n + i)**2
            if (.not. r2 > 0.0_wp) return
            c = self%centre/(r2*sqrt(r2))
            f(i) = f(i) - c*q(i)
            f(n + i) = f(n + i) - c*q(n + i)
         end if
         do j = i + 1, n
            dx = q(j) - q(i)
            dy = q(n + j) - q(n + i)
            r2 = dx**2 + dy**2
            if (.not. r2 > 0.0_wp) return
            c = 1.0_wp/(r2*sqrt(r2))
            f(i) = f(i) + (c*self%m(j))*dx
            f(n + i) = f(n + i) + (c*self%m(j))*dy
            f(j) = f(j) - (c*self%m(i))*dx
            f(n + j) = f(n + j) - (c*self%m(i))*dy
         end do
      end do
      ierr = 0
   end subroutine point_masses_force

   recursive subroutine point_masses_energy(self, t, q, v, energy, ierr)
      class(point_masses_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      integer :: i, j, n
      n = self%n/2
      ierr = 0
      energy = 0.0_wp
      do i = 1, n
         energy = energy + 0.5_wp*self%m(i)*(v(i)**2 + v(n + i)**2)
         if (self%centre > 0.0_wp) energy = energy - self%centre*self%m(i)/sqrt(q(i)**2 + q(n + i)**2)
         do j = i + 1, n
            energy = energy - self%m(i)*self%m(j)/sqrt((q(j) - q(i))**2 + (q(n + j) - q(n + i))**2)
         end do
      end do
   end subroutine point_masses_energy

   !> The seven stars, and their state at t = 0
   subroutine pleiades(sys, y)
      type(point_masses_system), intent(inout) :: sys
      real(wp), intent(out) :: y(28)                !! [x; y; x'; y']
      integer :: i
      call sys%setup([(real(i, wp), i=1, 7)], 0.0_wp)
      y(1:7) = [3.0_wp, 3.0_wp, -1.0_wp, -3.0_wp, 2.0_wp, -2.0_wp, 2.0_wp]
      y(8:14) = [3.0_wp, -3.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, -4.0_wp, 4.0_wp]
      y(15:21) = [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.75_wp, -1.5_wp]
      y(22:28) = [0.0_wp, 0.0_wp, 0.0_wp, -1.25_wp, 1.0_wp, 0.0_wp, 0.0_wp]
   end subroutine pleiades

   !> A unit mass about a unit centre, large semi-axis 1, and its state at the pericentre
   subroutine kepler(sys, y, eccentricity)
      type(point_masses_system), intent(inout) :: sys
      real(wp), intent(out) :: y(4)                 !! [x, y, x', y']
      real(wp), intent(in) :: eccentricity          !! 0 <= e < 1
      call sys%setup([1.0_wp], 1.0_wp)
      y = [1.0_wp - eccentricity, 0.0_wp, 0.0_wp, sqrt((1.0_wp + eccentricity)/(1.0_wp - eccentricity))]
   end subroutine kepler

   !> State of `kepler` at time t: eccentric anomaly E - e sin E = t, x = cos E - e, y = sqrt(1 - e^2) sin E
   pure subroutine point_masses_exact_kepler(self, eccentricity, t, y)
      class(point_masses_system), intent(in) :: self
      real(wp), intent(in) :: eccentricity, t
      real(wp), intent(out) :: y(4)
      real(wp), parameter :: turn = 8.0_wp*atan(1.0_wp)
      real(wp) :: mean, low, high, anomaly, rate
      integer :: i
      ! bisection between M - e and M + e: Newton's iteration from M can miss at e near 1
      mean = modulo(t, turn)
      low = mean - eccentricity
      high = mean + eccentricity
      do i = 1, 60
         anomaly = 0.5_wp*(low + high)
         if (anomaly - eccentricity*sin(anomaly) > mean) then
            high = anomaly
         else
            low = anomaly
         end if
      end do
      associate (c => cos(anomaly), s => sin(anomaly), b => sqrt(1.0_wp - eccentricity**2))
         rate = sqrt(self%centre)/(1.0_wp - eccentricity*c)
         y = [c - eccentricity, b*s, -s*rate, b*c*rate]
      end associate
   end subroutine point_masses_exact_kepler
end module dynstep_point_masses
