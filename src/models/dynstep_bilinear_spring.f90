! SPDX-License-Identifier: BSD-3-Clause
!> A mass on a bilinear spring: M. Austin (1991), Counter Example 4.
!>
!>   m x'' + F(x) = 0,   F = k x                        |x| <= 1   (zone 0)
!>                       F = k (1 + p (x - 1))           x  >  1   (zone 1)
!>
!> For x < -1 (zone -1) the paper prints the second line, too: `law_literal`, where the force
!> jumps at x = -1 (from -k to k (1 - 2p)).  A spring that is the same in tension and compression is `law_odd`,
!> F(x) = -F(-x).  In each zone the motion is harmonic, so the exact solution is a chain of
!> cosines: `exact`.  F has a kink (or a jump) at a zone's end, where extrapolation fails - unless the zones are declared
!> (`zones_declared`): then a run starts anew at each end of a zone.
module dynstep_bilinear_spring
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_diagonal, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   implicit none
   private

   integer, parameter, public :: law_odd = 0       !! F(x) = -F(-x)
   integer, parameter, public :: law_literal = 1   !! as printed, for all |x| > 1

   type, extends(mechanical_system), public :: bilinear_spring
      real(wp) :: m = 1.0_wp        !! mass > 0
      real(wp) :: k = 10.0_wp       !! stiffness > 0 of zone 0
      real(wp) :: p = 0.5_wp        !! strain hardening: stiffness p k > 0 of the other zones
      integer :: law = law_odd
      logical :: zones_declared = .false.   !! the ends of the zones are switch functions, x - 1 and x + 1
   contains
      procedure :: setup => spring_setup
      procedure :: force => spring_force
      procedure :: mass => spring_mass
      procedure :: tangent => spring_tangent
      procedure :: energy => spring_energy
      procedure :: switch_values => spring_switch_values
      procedure :: zone => spring_zone
      procedure :: zone_law => spring_zone_law
      procedure :: next_crossing => spring_next_crossing
      procedure :: exact => spring_exact
   end type bilinear_spring

contains

   !> Fill n and `structure`; the components have the paper's values by default
   subroutine spring_setup(self)
      class(bilinear_spring), intent(inout) :: self
      self%n = 1
      self%structure%mass = kind_diagonal
      self%structure%tangent = kind_diagonal
      self%structure%tangent_is_symmetric = .true.
      self%structure%velocity_free = .true.
      self%structure%has_energy = .true.
      self%switches = merge(2, 0, self%zones_declared)
   end subroutine spring_setup

   !> x - 1 and x + 1
   recursive subroutine spring_switch_values(self, t, y, s, ierr)
      class(bilinear_spring), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: s(:)
      integer, intent(out) :: ierr
      ierr = 0
      s = [y(1) - 1.0_wp, y(1) + 1.0_wp]
   end subroutine spring_switch_values

   !> Where the right side is taken: the side of the declared ends, else by x and v
   pure integer function present_zone(self, x, v) result(zone)
      class(bilinear_spring), intent(in) :: self
      real(wp), intent(in) :: x, v
      if (self%zones_declared .and. allocated(self%side)) then
         zone = 0
         if (self%side(1) > 0) zone = 1
         if (self%side(2) < 0) zone = -1
      else
         zone = self%zone(x, v)
      end if
   end function present_zone

   !> -1, 0 or 1; on a zone's end the velocity tells which zone the motion enters
   pure integer function spring_zone(self, x, v)
      class(bilinear_spring), intent(in) :: self
      real(wp), intent(in) :: x, v
      spring_zone = 0
      if (x > 1.0_wp .or. (x >= 1.0_wp .and. v > 0.0_wp)) spring_zone = 1
      if (x < -1.0_wp .or. (x <= -1.0_wp .and. v < 0.0_wp)) spring_zone = -1
   end function spring_zone

   !> The force of a zone, F = stiffness (x - centre)
   pure subroutine spring_zone_law(self, zone, stiffness, centre)
      class(bilinear_spring), intent(in) :: self
      integer, intent(in) :: zone
      real(wp), intent(out) :: stiffness, centre
      stiffness = self%k
      centre = 0.0_wp
      if (zone == 0) return
      stiffness = self%p*self%k
      centre = 1.0_wp - 1.0_wp/self%p
      if (zone < 0 .and. self%law == law_odd) centre = -centre
   end subroutine spring_zone_law

   recursive subroutine spring_force(self, t, q, v, f, ierr)
      class(bilinear_spring), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      real(wp) :: stiffness, centre
      ierr = 0
      call self%zone_law(present_zone(self, q(1), v(1)), stiffness, centre)
      f(1) = -stiffness*(q(1) - centre)
   end subroutine spring_force

   recursive subroutine spring_mass(self, t, q, v, mass, ierr)
      class(bilinear_spring), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      ierr = 0
      call mass%set_entry(1, 1, self%m)
   end subroutine spring_mass

   recursive subroutine spring_tangent(self, t, q, v, a, k, c, ierr)
      class(bilinear_spring), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      real(wp) :: stiffness, centre
      ierr = 0
      call self%zone_law(present_zone(self, q(1), v(1)), stiffness, centre)
      call k%set_entry(1, 1, stiffness)
   end subroutine spring_tangent

   !> m v^2/2 and the integral of F from 0 to x
   recursive subroutine spring_energy(self, t, q, v, energy, ierr)
      class(bilinear_spring), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: energy
      integer, intent(out) :: ierr
      real(wp) :: stiffness, centre, edge
      ierr = 0
      edge = min(max(q(1), -1.0_wp), 1.0_wp)
      energy = 0.5_wp*(self%m*v(1)**2 + self%k*edge**2)
      if (abs(q(1)) <= 1.0_wp) return
      call self%zone_law(self%zone(q(1), v(1)), stiffness, centre)
      energy = energy + 0.5_wp*stiffness*(q(1) - edge)*((q(1) - centre) + (edge - centre))
   end subroutine spring_energy

   !> Time until the motion from x, v leaves its zone, and the end of the zone where it does;
   !> huge() where it does not
   pure subroutine spring_next_crossing(self, x, v, time, edge)
      class(bilinear_spring), intent(in) :: self
      real(wp), intent(in) :: x, v
      real(wp), intent(out) :: time, edge
      real(wp) :: stiffness, centre, omega, lower_time
      integer :: zone

      zone = self%zone(x, v)
      call self%zone_law(zone, stiffness, centre)
      omega = sqrt(stiffness/self%m)
      time = huge(time)
      edge = real(2*zone + 1, wp)
      if (zone <= 0) time = passage(omega, x - centre, v, edge - centre, -1.0_wp)
      if (zone < 0) return
      lower_time = passage(omega, x - centre, v, real(2*zone - 1, wp) - centre, 1.0_wp)
      if (lower_time >= time) return
      time = lower_time
      edge = real(2*zone - 1, wp)
   end subroutine spring_next_crossing

   !> First time at which x'' + omega^2 x = 0 passes a place upwards or downwards; huge() where
   !> it does not.  x = r cos(theta), v = -r omega sin(theta), theta = omega t - phi: the
   !> place is passed upwards at theta = -acos(place/r), downwards at theta = +acos(place/r).
   pure real(wp) function passage(omega, x, v, place, sign)
      real(wp), intent(in) :: omega, x, v
      real(wp), intent(in) :: place
      real(wp), intent(in) :: sign       !! -1 upwards, +1 downwards
      real(wp), parameter :: turn = 2.0_wp*acos(-1.0_wp)
      real(wp) :: r
      passage = huge(passage)
      r = hypot(x, v/omega)
      if (abs(place) >= r) return
      passage = modulo(atan2(v/omega, x) + sign*acos(place/r), turn)/omega
   end function passage

   !> Displacement, velocity and acceleration at a time t >= 0 after the start x0, v0
   pure subroutine spring_exact(self, x0, v0, t, x, v, a)
      class(bilinear_spring), intent(in) :: self
      real(wp), intent(in) :: x0, v0
      real(wp), intent(in) :: t
      real(wp), intent(out) :: x, v, a
      real(wp) :: left, crossing, edge, stiffness, centre

      x = x0
      v = v0
      left = t
      do
         call self%next_crossing(x, v, crossing, edge)
         call self%zone_law(self%zone(x, v), stiffness, centre)
         call harmonic(sqrt(stiffness/self%m), centre, min(left, crossing), x, v)
         if (left <= crossing) exit
         left = left - crossing
         x = edge
      end do
      a = -stiffness*(x - centre)/self%m
   end subroutine spring_exact

   !> x'' + omega^2 (x - centre) = 0 over a time t, in place
   pure subroutine harmonic(omega, centre, t, x, v)
      real(wp), intent(in) :: omega, centre, t
      real(wp), intent(inout) :: x, v
      real(wp) :: x0, v0
      x0 = x - centre
      v0 = v
      x = centre + x0*cos(omega*t) + v0/omega*sin(omega*t)
      v = v0*cos(omega*t) - omega*x0*sin(omega*t)
   end subroutine harmonic
end module dynstep_bilinear_spring
