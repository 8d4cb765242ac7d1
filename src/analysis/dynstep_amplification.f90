! SPDX-License-Identifier: BSD-3-Clause
!> What one step of any method does to q'' + 2 zeta omega q' + omega^2 q = 0, whose eigenvalues times h are z and its
!> conjugate: h omega = |z|, zeta = -cos(arg z).
!>
!>   call amplification(stepper, z, a, status)           matrix of a step
!>   call spectral_radii(stepper, z, radius, status)     its spectral radius for many z
!>
!> The matrix comes from a step of a copy of the stepper itself, from two unit starts in (q, h v/s), s = max(1, |z|), or,
!> for generalized-alpha and SOI2 with their memory, in (q, h v/s, h^2 a/s^2) from their formulas (Jay & Negrut 2008,
!> eq. (2)).  Such a method has no R(z) whose domain could be found exactly: what is told of it is told at the z asked
!> for, not between them.
module dynstep_amplification
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: diagonal_matrix
   use dynstep_polynomial, only: polynomial_zeros
   use dynstep_soi2, only: soi2_stepper
   use dynstep_status, only: dynstep_singular_matrix, status_type
   use dynstep_stepper, only: allocate_state, state_type, stepper_type
   implicit none
   private

   public :: amplification, spectral_radii, spectral_radius

contains

   !> Matrix of one step
   recursive subroutine amplification(stepper, z, a, status)
      class(stepper_type), intent(in) :: stepper        !! is not changed
      complex(wp), intent(in) :: z                      !! h lambda
      real(wp), allocatable, intent(out) :: a(:, :)     !! [2, 2], or [3, 3] with the acceleration kept from step to step
      type(status_type), intent(inout) :: status
      class(stepper_type), allocatable :: work
      if (status%failed()) return
      select type (stepper)
      class is (soi2_stepper)
         allocate (a(3, 3))
         call alpha_matrix(stepper, z, a)
      class default
         allocate (work, source=stepper)
         allocate (a(2, 2))
         call stepped_matrix(work, z, a, status)
      end select
   end subroutine amplification

   !> Spectral radius at each z
   recursive subroutine spectral_radii(stepper, z, radius, status)
      class(stepper_type), intent(in) :: stepper
      complex(wp), intent(in) :: z(:)
      real(wp), intent(out) :: radius(:)                !! [size(z)]; huge() where the method refuses the step (its matrix
                                                        !! is singular or indefinite: growing modes, long steps)
      type(status_type), intent(inout) :: status
      class(stepper_type), allocatable :: work
      real(wp) :: a2(2, 2), a3(3, 3)
      integer :: i
      radius = 0.0_wp
      if (status%failed()) return
      allocate (work, source=stepper)
      do i = 1, size(z)
         select type (work)
         class is (soi2_stepper)
            call alpha_matrix(work, z(i), a3)
            radius(i) = spectral_radius(a3)
         class default
            call stepped_matrix(work, z(i), a2, status)
            radius(i) = huge(1.0_wp)
            if (status%code == dynstep_singular_matrix) then
               call status%clear()
               cycle
            end if
            if (status%failed()) return
            radius(i) = spectral_radius(a2)
         end select
      end do
   end subroutine spectral_radii

   !> Largest size of an eigenvalue of a matrix of order 2 or 3, by its characteristic polynomial
   pure real(wp) function spectral_radius(a)
      real(wp), intent(in) :: a(:, :)
      complex(wp), allocatable :: zeros(:)
      real(wp) :: half, determinant, discriminant, minors
      logical :: converged
      if (size(a, 1) == 2) then
         ! ((a11 - a22)/2)^2 + a12 a21 loses less than (trace/2)^2 - determinant
         half = 0.5_wp*(a(1, 1) + a(2, 2))
         discriminant = (0.5_wp*(a(1, 1) - a(2, 2)))**2 + a(1, 2)*a(2, 1)
         spectral_radius = abs(half) + sqrt(max(0.0_wp, discriminant))
         if (discriminant < 0.0_wp) spectral_radius = sqrt(half**2 - discriminant)
         return
      end if
      minors = a(1, 1)*a(2, 2) - a(1, 2)*a(2, 1) + a(1, 1)*a(3, 3) - a(1, 3)*a(3, 1) + a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)
      determinant = a(1, 1)*(a(2, 2)*a(3, 3) - a(2, 3)*a(3, 2)) - a(1, 2)*(a(2, 1)*a(3, 3) - a(2, 3)*a(3, 1)) &
         & + a(1, 3)*(a(2, 1)*a(3, 2) - a(2, 2)*a(3, 1))
      call polynomial_zeros([-determinant, minors, -(a(1, 1) + a(2, 2) + a(3, 3)), 1.0_wp], zeros, converged)
      spectral_radius = maxval(abs(zeros))
   end function spectral_radius

   !> By steps of length 1 from unit starts
   recursive subroutine stepped_matrix(work, z, a, status)
      class(stepper_type), intent(inout) :: work
      complex(wp), intent(in) :: z
      real(wp), intent(out) :: a(2, 2)
      type(status_type), intent(inout) :: status
      type(linear_system) :: sys
      type(state_type) :: state, trial
      real(wp) :: scale
      integer :: j
      a = 0.0_wp
      scale = max(1.0_wp, abs(z))
      call sys%set(diagonal_matrix([1.0_wp]), diagonal_matrix([-2.0_wp*real(z, wp)]), diagonal_matrix([abs(z)**2]), status)
      call work%init(sys, status)
      call allocate_state(sys, state, status)
      call allocate_state(sys, trial, status)
      if (status%failed()) return
      do j = 1, 2
         state%t = 0.0_wp
         state%y = 0.0_wp
         state%y(j) = merge(1.0_wp, scale, j == 1)
         call work%start(sys, state, status)
         call work%try_step(sys, state, 1.0_wp, 1.0_wp, trial, status)
         if (status%failed()) return
         a(:, j) = [trial%y(1), trial%y(2)/scale]
      end do
   end subroutine stepped_matrix

   !> (2a)-(2c) with f = -2 zeta |z| v - |z|^2 q and steps of length 1
   pure subroutine alpha_matrix(stepper, z, a)
      class(soi2_stepper), intent(in) :: stepper
      complex(wp), intent(in) :: z
      real(wp), intent(out) :: a(3, 3)
      real(wp) :: c, k, s, new(3)
      k = abs(z)**2
      c = -2.0_wp*real(z, wp)
      s = max(1.0_wp, abs(z))
      associate (m => stepper%coefficients%alpha_m, f => stepper%coefficients%alpha_f, &
            & beta => stepper%coefficients%beta, gamma => stepper%coefficients%gamma)
         ! a_{1+alpha} = new . (q, v, a_alpha)
         new = -[k, c + (1.0_wp - f)*k, m + (1.0_wp - f)*(c*(1.0_wp - gamma) + k*(0.5_wp - beta))]
         new = new/(1.0_wp - m + (1.0_wp - f)*(c*gamma + k*beta))
         a(1, :) = [1.0_wp, 1.0_wp, 0.5_wp - beta] + beta*new
         a(2, :) = [0.0_wp, 1.0_wp, 1.0_wp - gamma] + gamma*new
         a(3, :) = new
      end associate
      a(1, :) = a(1, :)*[1.0_wp, s, s**2]
      a(2, :) = a(2, :)*[1.0_wp/s, 1.0_wp, s]
      a(3, :) = a(3, :)*[1.0_wp/s**2, 1.0_wp/s, 1.0_wp]
   end subroutine alpha_matrix
end module dynstep_amplification
