! SPDX-License-Identifier: BSD-3-Clause
!> One-link flexible arm on a hub, with a tip load: W. Xie (1995), chapters 4 and 5, by the method of lines.
!>
!>   M Z'' + K Z = B u(t),  B = (1, 0, ..., 0)       eqs. (4.33), (5.19)
!>
!>   beam_euler_bernoulli   Z = (theta, z1, ..., zn)                      eqs. (4.24)-(4.32), n >= 4
!>   beam_timoshenko        Z = (theta, phi1, z1, ..., phin, zn)          eqs. (5.12)-(5.18), n >= 2
!>
!> theta is the angle of the hub, z the total deflection at i/n of the length, phi the total rotation, all with
!> the hub's rotation in them.  K has the bandwidths 2 and 2, M has 1 and 1.
!>
!> Scaling: the equations of the inner points are divided by n, those of hub and tip are as they stand (the listing
!> divides all by n^2).  Then M and K are those of a kinetic and a strain energy,
!>
!>   2T = eta theta'^2 + sum(i=1..n-1) alpha/n zi'^2 + sum(i=1..n) n alpha delta (zi' - zi-1')^2
!>         + mu zn'^2 + 2 zeta mu zn' s' + kappa s'^2,       s = n (zn - zn-1)
!>   2V = sum(i=0..n-1) n^3 beta (zi+1 - 2 zi + zi-1)^2,     z0 = 0, z-1 = -theta/n
!>
!> for the first beam: exactly symmetric, M positive definite, K singular for the rigid mode (1, 1/n, 2/n, ...,
!> 1) alone.  A scaling of equations does not change the poles.
!>
!> For the second beam M is symmetric, and K is but for the row of phi_n: the tip moment (5.17) has no shear term,
!> where the energy
!>
!>   2V = sum(i=1..n) [n beta (phi_i - phi_i-1)^2 + gamma/n (phi_i - n (zi - zi-1))^2]
!>
!> has (gamma/n) phi_n - gamma (zn - zn-1).  No combination of the two equations of the tip makes both matrices
!> symmetric: to bring the term into K it takes 1/n times (5.18), which puts -mu/n into M.
!> arm_symmetric takes K from the energy; both converge to the same beam.  (The first beam is symmetric anyway.)
!>
!> arm_listing is Appendix A's MKBmat, whose last row has +2 z(n-1) where eqs. (4.30), (4.32) ask for -2: it
!> pins the tip, but it is the plant of the poles printed in the thesis; under (4.38) one pair of them is unstable.
!>
!> PROGRAMMING INTERFACE
!>
!>     arm%beam = beam_timoshenko                   before setup: beam, variant and parameters
!>     call arm%setup(20, status)                   segments
!>     call arm%set_input(input_pulse, status)      u(t): input_none, input_pulse, input_step, input_ramp
!>     call arm%close_loop(status [, gains])        feedback to theta = 0, eqs. (4.38), (5.24)
!>     call arm%straight(angle, q)                  the undeformed arm at an angle
!>     arm%hub_angle(q), arm%tip_deflection(q)      theta, w = zn - theta
module dynstep_flexible_arm
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system, load_none, load_procedure
   use dynstep_matrix, only: kind_banded, matrix_type, zero_matrix
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   integer, parameter, public :: beam_euler_bernoulli = 1   !! rotation is the slope of the deflection
   integer, parameter, public :: beam_timoshenko = 2        !! with shear deformation

   integer, parameter, public :: arm_consistent = 0     !! the equations of the thesis
   integer, parameter, public :: arm_listing = 1        !! Euler-Bernoulli, the sign of the listing
   integer, parameter, public :: arm_symmetric = 2      !! Timoshenko, K from the strain energy

   integer, parameter, public :: input_none = 0
   integer, parameter, public :: input_pulse = 1            !! u = amplitude for t < duration, 0 then
   integer, parameter, public :: input_step = 2             !! u = amplitude
   integer, parameter, public :: input_ramp = 3             !! u = amplitude t

   !> Gains of theta, theta', w, w' under eqs. (4.38) and (5.24)
   real(wp), parameter, public :: euler_bernoulli_gains(4) = [18.6550_wp, 5.5285_wp, 1.5000_wp, 0.0050_wp]
   real(wp), parameter, public :: timoshenko_gains(4) = [16.3225_wp, 4.2234_wp, 1.4012_wp, 0.0061_wp]

   integer, parameter :: most_segments = 500000000          ! so that 2n + 1 is an integer

   type, extends(linear_system), public :: flexible_arm
      integer :: beam = beam_euler_bernoulli
      integer :: variant = arm_consistent
      integer :: segments = 0                 !! n of the thesis
      integer :: input = input_none
      real(wp) :: amplitude = 0.1_wp          !! of the input
      real(wp) :: duration = 0.5_wp           !! of the pulse
      ! Eqs. (4.37), (5.23); dimensionless, eqs. (4.13), (4.14)
      real(wp) :: eta = 0.01_wp               !! inertia of the hub
      real(wp) :: mu = 0.01_wp                !! mass of the tip load
      real(wp) :: kappa = 0.01_wp             !! inertia of the tip load about the arm's end
      real(wp) :: zeta = 0.001_wp             !! distance of its mass centre from the arm's end
      real(wp) :: alpha = 1.0_wp              !! mass of the beam
      real(wp) :: beta = 1.0_wp               !! bending rigidity
      real(wp) :: delta = 0.01_wp             !! rotatory inertia, over alpha
      real(wp) :: gamma = 100.0_wp            !! shear rigidity (Timoshenko)
   contains
      procedure :: setup => arm_setup
      procedure :: set_input => arm_set_input
      procedure :: close_loop => arm_close_loop
      procedure :: straight => arm_straight
      procedure :: hub_angle => arm_hub_angle
      procedure :: tip_deflection => arm_tip_deflection
      procedure :: dense_matrices => arm_dense_matrices
      procedure :: load => arm_load
   end type flexible_arm

contains

   !> Matrices of an arm of `segments` segments, without input and feedback
   subroutine arm_setup(self, segments, status)
      class(flexible_arm), intent(inout) :: self
      integer, intent(in) :: segments         !! n >= 4 (Euler-Bernoulli), n >= 2 (Timoshenko)
      type(status_type), intent(inout) :: status
      type(matrix_type) :: m, k
      integer :: order

      call check_parameters(self, segments, status)
      if (status%failed()) return
      order = merge(2*segments + 1, segments + 1, self%beam == beam_timoshenko)
      call m%init(kind_banded, order, 1, 1, .true., status)
      call k%init(kind_banded, order, 2, 2, .true., status)
      if (status%failed()) return
      if (self%beam == beam_timoshenko) then
         call timoshenko(self, segments, m, k)
      else
         call euler_bernoulli(self, segments, m, k)
      end if
      call m%check('M of the arm', order, status)
      if (status%failed()) return
      if (.not. is_positive_definite(m)) then
         call status%set(dynstep_invalid_input, 'the mass matrix of the arm is not positive definite: the tip load' &
            & //' needs kappa mu > (zeta mu)^2, or less than that on an Euler-Bernoulli beam with delta > 0')
         return
      end if
      call self%set(m, zero_matrix(order), k, status)
      if (status%failed()) return
      self%segments = segments
      self%input = input_none
      self%load_kind = load_none
   end subroutine arm_setup

   !> The input u(t) of the open loop; it adds to the feedback of a closed one
   subroutine arm_set_input(self, input, status)
      class(flexible_arm), intent(inout) :: self
      integer, intent(in) :: input                !! input_none ... input_ramp
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (input < input_none .or. input > input_ramp) then
         call status%set(dynstep_invalid_input, 'input '//text(input)//' of the arm is none of input_none,' &
            & //' input_pulse, input_step, input_ramp')
         return
      end if
      self%input = input
      self%load_kind = merge(load_none, load_procedure, input == input_none)
   end subroutine arm_set_input

   !> Eqs. (4.38), (5.24) with theta_d = 0:  u = -g1 theta - g2 theta' - g3 w - g4 w',  w = zn - theta.
   !> The force acts on one coordinate, so it is a coupling, and K and C keep their bands.
   subroutine arm_close_loop(self, status, gains)
      class(flexible_arm), intent(inout) :: self
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: gains(4)     !! of theta, theta', w, w'; default: the thesis's
      real(wp), allocatable :: b(:), k(:), c(:)
      real(wp) :: g(4)
      if (status%failed()) return
      if (self%segments < 1) then
         call status%set(dynstep_invalid_input, 'the arm has no segments yet; call setup before close_loop')
         return
      end if
      g = euler_bernoulli_gains
      if (self%beam == beam_timoshenko) g = timoshenko_gains
      if (present(gains)) g = gains
      allocate (b(self%n), k(self%n), c(self%n), source=0.0_wp)
      b(1) = 1.0_wp
      k(1) = g(1) - g(3)
      k(self%n) = g(3)
      c(1) = g(2) - g(4)
      c(self%n) = g(4)
      call self%set_coupling(b, k, c, status)
   end subroutine arm_close_loop

   !> The undeformed arm, hub at `angle`; the thesis's closed loops start from pi/2 at rest
   pure subroutine arm_straight(self, angle, q)
      class(flexible_arm), intent(in) :: self
      real(wp), intent(in) :: angle
      real(wp), intent(out) :: q(:)               !! [n of the system]
      integer :: i
      associate (n => self%segments)
         q(1) = angle
         do i = 1, n
            if (self%beam == beam_timoshenko) then
               q(2*i) = angle
               q(2*i + 1) = angle*i/n
            else
               q(i + 1) = angle*i/n
            end if
         end do
      end associate
   end subroutine arm_straight

   !> theta, or its velocity
   pure real(wp) function arm_hub_angle(self, q)
      class(flexible_arm), intent(in) :: self
      real(wp), intent(in) :: q(self%n)           !! coordinates, or their velocities
      arm_hub_angle = q(1)
   end function arm_hub_angle

   !> w = zn - theta, or its velocity
   pure real(wp) function arm_tip_deflection(self, q)
      class(flexible_arm), intent(in) :: self
      real(wp), intent(in) :: q(self%n)           !! coordinates, or their velocities
      arm_tip_deflection = q(self%n) - q(1)
   end function arm_tip_deflection

   !> M, C and K in full, the feedback in C and K
   pure subroutine arm_dense_matrices(self, m, c, k)
      class(flexible_arm), intent(in) :: self
      real(wp), intent(out) :: m(:, :), c(:, :), k(:, :)     !! [n,n] each, n of the system
      integer :: i, j
      do j = 1, self%n
         do i = 1, self%n
            m(i, j) = self%m%entry(i, j)
            k(i, j) = self%k%entry(i, j)
            c(i, j) = 0.0_wp
            if (.not. self%structure%is_coupled) cycle
            k(i, j) = k(i, j) + self%coupling%b(i)*self%coupling%k(j)
            c(i, j) = self%coupling%b(i)*self%coupling%c(j)
         end do
      end do
   end subroutine arm_dense_matrices

   !> B u(t)
   recursive subroutine arm_load(self, t, p, ierr)
      class(flexible_arm), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      p = 0.0_wp
      select case (self%input)
      case (input_pulse)
         if (t < self%duration) p(1) = self%amplitude
      case (input_step)
         p(1) = self%amplitude
      case (input_ramp)
         p(1) = self%amplitude*t
      end select
   end subroutine arm_load

   subroutine check_parameters(self, segments, status)
      class(flexible_arm), intent(in) :: self
      integer, intent(in) :: segments
      type(status_type), intent(inout) :: status
      integer :: least
      if (status%failed()) return
      if (self%beam /= beam_euler_bernoulli .and. self%beam /= beam_timoshenko) then
         call refuse('beam '//text(self%beam)//' of the arm is neither beam_euler_bernoulli nor beam_timoshenko')
         return
      end if
      least = merge(2, 4, self%beam == beam_timoshenko)
      if (segments < least .or. segments > most_segments) then
         call refuse('an arm of this beam has '//text(least)//' segments or more, up to ' &
            & //text(most_segments)//'; got '//text(segments))
      else if (self%variant < arm_consistent .or. self%variant > arm_symmetric) then
         call refuse('variant '//text(self%variant)//' of the arm is none of arm_consistent, arm_listing,' &
            & //' arm_symmetric')
      else if (self%variant == arm_listing .and. self%beam == beam_timoshenko) then
         call refuse('arm_listing is a variant of the Euler-Bernoulli beam; the thesis lists no Timoshenko matrices')
      end if
      call check_positive('eta', self%eta)
      call check_positive('alpha', self%alpha)
      call check_positive('beta', self%beta)
      if (self%beam == beam_timoshenko) then
         call check_positive('delta', self%delta)
         call check_positive('gamma', self%gamma)
      end if
      if (status%failed()) return
      if (.not. all(ieee_is_finite([self%delta, self%mu, self%kappa, self%zeta]))) then
         call refuse('delta, mu, kappa and zeta of the arm must be finite')
      else if (self%delta < 0.0_wp .or. self%mu < 0.0_wp .or. self%kappa < 0.0_wp) then
         call refuse('delta, mu and kappa of the arm must not be negative')
      end if

   contains

      subroutine check_positive(name, value)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: value
         if (status%failed()) return
         if (ieee_is_finite(value)) then
            if (value > 0.0_wp) return
         end if
         call refuse(name//' of the arm must be positive and finite; got '//text(value))
      end subroutine check_positive

      subroutine refuse(why)
         character(len=*), intent(in) :: why
         call status%set(dynstep_invalid_input, why)
      end subroutine refuse
   end subroutine check_parameters

   !> Eqs. (4.24)-(4.32): the energies above, term by term
   pure subroutine euler_bernoulli(arm, n, m, k)
      class(flexible_arm), intent(in) :: arm
      integer, intent(in) :: n                     !! segments
      type(matrix_type), intent(inout) :: m, k     !! zero on entry
      real(wp) :: rn, rotatory, bending
      integer :: i                                 ! z_i is coordinate i + 1

      rn = real(n, wp)
      rotatory = rn*arm%alpha*arm%delta
      bending = rn**3*arm%beta
      call add_square(m, 1, [1.0_wp], arm%eta)
      call add_square(m, 2, [1.0_wp], rotatory)
      do i = 1, n - 1
         call add_square(m, i + 1, [1.0_wp], arm%alpha/rn)
         call add_square(m, i + 1, [-1.0_wp, 1.0_wp], rotatory)
      end do
      call add_square(m, n, [-rn, rn], arm%kappa)
      call add_square(m, n + 1, [1.0_wp], arm%mu)
      ! 2 zn s = s (s/n) - n zn-1^2 + n zn^2
      call add_square(m, n, [-1.0_wp, 1.0_wp], rn*arm%zeta*arm%mu)
      call add_square(m, n, [1.0_wp], -rn*arm%zeta*arm%mu)
      call add_square(m, n + 1, [1.0_wp], rn*arm%zeta*arm%mu)

      call add_square(k, 1, [-1.0_wp/rn, 1.0_wp], bending)
      call add_square(k, 2, [-2.0_wp, 1.0_wp], bending)
      do i = 2, n - 1
         call add_square(k, i, [1.0_wp, -2.0_wp, 1.0_wp], bending)
      end do
      if (arm%variant == arm_listing) then
         call k%set_entry(n + 1, n, -k%entry(n + 1, n))
         k%symmetric = .false.
      end if
   end subroutine euler_bernoulli

   !> Eqs. (5.12)-(5.18)
   pure subroutine timoshenko(arm, n, m, k)
      class(flexible_arm), intent(in) :: arm
      integer, intent(in) :: n                     !! segments
      type(matrix_type), intent(inout) :: m, k     !! zero on entry
      real(wp) :: rn, bending, shear
      integer :: i                                 ! phi_i and z_i are coordinates 2i and 2i + 1

      rn = real(n, wp)
      bending = rn*arm%beta
      shear = arm%gamma/rn
      call add_square(m, 1, [1.0_wp], arm%eta)
      do i = 1, n - 1
         call add_square(m, 2*i, [1.0_wp], arm%alpha*arm%delta/rn)
         call add_square(m, 2*i + 1, [1.0_wp], arm%alpha/rn)
      end do
      call add_square(m, 2*n, [1.0_wp], arm%kappa)
      call add_square(m, 2*n + 1, [1.0_wp], arm%mu)
      call m%set_entry(2*n, 2*n + 1, arm%zeta*arm%mu)
      call m%set_entry(2*n + 1, 2*n, arm%zeta*arm%mu)

      call add_square(k, 1, [-1.0_wp, 1.0_wp], bending)
      call add_square(k, 2, [1.0_wp, -rn], shear)
      do i = 2, n
         call add_square(k, 2*i - 2, [-1.0_wp, 0.0_wp, 1.0_wp], bending)
         call add_square(k, 2*i - 1, [rn, 1.0_wp, -rn], shear)
      end do
      if (arm%variant /= arm_symmetric) then
         ! eq. (5.17)
         call k%set_entry(2*n, 2*n - 1, 0.0_wp)
         call k%set_entry(2*n, 2*n, bending)
         call k%set_entry(2*n, 2*n + 1, 0.0_wp)
         k%symmetric = .false.
      end if
   end subroutine timoshenko

   !> A = A + weight c c^T at coordinates first, first + 1, ...; both triangles get the same number
   pure subroutine add_square(a, first, c, weight)
      type(matrix_type), intent(inout) :: a
      integer, intent(in) :: first
      real(wp), intent(in) :: c(:)
      real(wp), intent(in) :: weight
      integer :: i, j
      do j = 1, size(c)
         do i = 1, size(c)
            associate (entry => a%a(a%ku + 1 + i - j, first + j - 1))
               entry = entry + weight*(c(i)*c(j))
            end associate
         end do
      end do
   end subroutine add_square

   !> By the pivots of a tridiagonal matrix
   pure logical function is_positive_definite(m)
      type(matrix_type), intent(in) :: m
      real(wp) :: pivot
      integer :: i
      pivot = m%a(2, 1)
      is_positive_definite = pivot > 0.0_wp
      do i = 2, m%n
         if (.not. is_positive_definite) return
         pivot = m%a(2, i) - m%a(1, i)*(m%a(1, i)/pivot)
         is_positive_definite = pivot > epsilon(pivot)*abs(m%a(2, i))
      end do
   end function is_positive_definite
end module dynstep_flexible_arm
