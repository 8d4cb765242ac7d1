! SPDX-License-Identifier: BSD-3-Clause
!> A plane frame with stiff floors: one mass and one horizontal coordinate (relative to the
!> ground) per storey, storeys acting as springs in series, and Rayleigh damping.
!>
!>   M q'' + C q' + K q = -M e a_g(t),   C = alpha M + beta K,   e = (1, ..., 1)
!>
!>   K(i,i) = k(i) + k(i+1),  K(i,i+1) = -k(i+1)       (k(n+1) = 0: the roof is free)
!>   xi(omega) = alpha/(2 omega) + beta omega/2        damping ratio of a mode
!>
!> PROGRAMMING INTERFACE
!>
!>   call building%setup(mass, stiffness, damping, status)    damping ratios of modes 1 and 2
!>   call building%shake(dt, acceleration, status)            samples of the ground motion
!>   building%omega                                           natural frequencies, ascending
!>   call building%storey_drifts(q, drift)
module dynstep_shear_building
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_lapack, only: dsterf
   use dynstep_linear_system, only: linear_system
   use dynstep_load_table, only: load_table_type
   use dynstep_matrix, only: banded_matrix, diagonal_matrix
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_converged, status_type
   use dynstep_text, only: text
   implicit none
   private

   type, extends(linear_system), public :: shear_building
      real(wp), allocatable :: omega(:)     !! natural frequencies [n], ascending, rad per time
      real(wp) :: alpha = 0.0_wp            !! C = alpha M + beta K
      real(wp) :: beta = 0.0_wp
   contains
      procedure :: setup => building_setup
      procedure :: shake => building_shake
      procedure, nopass :: storey_drifts => building_storey_drifts
   end type shear_building

contains

   !> Matrices, natural frequencies and Rayleigh damping
   subroutine building_setup(self, mass, stiffness, damping, status)
      class(shear_building), intent(inout) :: self
      real(wp), intent(in) :: mass(:)          !! of the floors, from below [n], n >= 2
      real(wp), intent(in) :: stiffness(:)     !! of the storeys, from below [n]
      real(wp), intent(in) :: damping(2)       !! damping ratios of modes 1 and 2
      type(status_type), intent(inout) :: status
      real(wp) :: k(3, size(mass)), c(3, size(mass)), ratio
      integer :: n, j

      if (status%failed()) return
      n = size(mass)
      if (n < 2 .or. size(stiffness) /= n) then
         call status%set(dynstep_invalid_input, 'a shear building needs two storeys or more, and a mass and a ' &
            & //'stiffness for each; got '//text(n)//' masses and '//text(size(stiffness))//' stiffnesses')
      else if (.not. all(ieee_is_finite(mass) .and. ieee_is_finite(stiffness))) then
         call status%set(dynstep_invalid_input, 'masses and stiffnesses must be finite')
      else if (any(mass <= 0.0_wp) .or. any(stiffness <= 0.0_wp)) then
         call status%set(dynstep_invalid_input, 'masses and stiffnesses must be positive')
      end if
      if (status%failed()) return

      k = 0.0_wp
      do j = 1, n
         k(2, j) = stiffness(j)
         if (j == n) exit
         k(2, j) = k(2, j) + stiffness(j + 1)
         k(3, j) = -stiffness(j + 1)
         k(1, j + 1) = -stiffness(j + 1)
      end do
      call natural_frequencies(mass, k, self%omega, status)
      if (status%failed()) return

      ! alpha/omega_j + beta omega_j = 2 xi_j,  j = 1, 2
      associate (w1 => self%omega(1), w2 => self%omega(2))
         ratio = 2.0_wp/((w2 - w1)*(w2 + w1))
         self%alpha = ratio*w1*w2*(damping(1)*w2 - damping(2)*w1)
         self%beta = ratio*(damping(2)*w2 - damping(1)*w1)
      end associate
      c = self%beta*k
      c(2, :) = c(2, :) + self%alpha*mass
      call self%set(diagonal_matrix(mass), banded_matrix(c, 1, 1, symmetric=.true.), &
         & banded_matrix(k, 1, 1, symmetric=.true.), status)
   end subroutine building_setup

   !> Roots of det(K - omega^2 M) = 0, from the symmetric tridiagonal M^-1/2 K M^-1/2
   subroutine natural_frequencies(mass, k, omega, status)
      real(wp), intent(in) :: mass(:), k(:, :)            !! [n], [3, n]
      real(wp), allocatable, intent(out) :: omega(:)      !! [n]
      type(status_type), intent(inout) :: status
      real(wp) :: below(size(mass))
      integer :: n, j, info

      n = size(mass)
      omega = k(2, :)/mass
      below = 0.0_wp
      do j = 1, n - 1
         below(j) = k(3, j)/sqrt(mass(j)*mass(j + 1))
      end do
      call dsterf(n, omega, below, info)
      if (info /= 0 .or. omega(1) <= 0.0_wp) then
         call status%set(dynstep_not_converged, 'the natural frequencies of the building cannot be computed;' &
            & //' masses or stiffnesses differ too much in size')
         return
      end if
      omega = sqrt(omega)
   end subroutine natural_frequencies

   !> The load -M e a_g(t), a_g piecewise linear between its samples and zero after them
   subroutine building_shake(self, dt, acceleration, status)
      class(shear_building), intent(inout) :: self
      real(wp), intent(in) :: dt                 !! sampling interval
      real(wp), intent(in) :: acceleration(:)    !! of the ground at t = 0, dt, 2 dt, ...
      type(status_type), intent(inout) :: status
      type(load_table_type) :: table

      if (status%failed()) return
      table%dt = dt
      allocate (table%samples(1, size(acceleration)), table%pattern(self%n, 1))
      table%samples(1, :) = acceleration
      table%pattern(:, 1) = -self%m%a(:, 1)
      call self%set_table(table, status)
   end subroutine building_shake

   !> Displacement of each floor relative to the floor below
   pure subroutine building_storey_drifts(q, drift)
      real(wp), intent(in) :: q(:)         !! [n]
      real(wp), intent(out) :: drift(:)    !! [n]
      drift = q
      drift(2:) = q(2:) - q(:size(q) - 1)
   end subroutine building_storey_drifts
end module dynstep_shear_building
