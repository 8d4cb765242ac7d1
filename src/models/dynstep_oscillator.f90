! SPDX-License-Identifier: BSD-3-Clause
!> Oscillators with one degree of freedom: M. Austin (1991), Examples 1 and 2.
!>
!>   free_oscillator(sys, m, k, status)   m x'' + k x = 0                      eq. (43)
!>   loaded_oscillator                    x'' + 4 x' + 13 x = e^-2t sin(3t)/3  eq. (46)
module dynstep_oscillator
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system, load_procedure
   use dynstep_matrix, only: diagonal_matrix, zero_matrix
   use dynstep_status, only: status_type
   implicit none
   private

   public :: free_oscillator

   !> The damped oscillator under a load; it starts at x = 1, x' = -2
   type, extends(linear_system), public :: loaded_oscillator
   contains
      procedure :: setup => loaded_setup
      procedure :: load => loaded_load
      procedure, nopass :: exact => loaded_exact
   end type loaded_oscillator

contains

   !> m x'' + k x = 0 as a linear system of one unknown
   subroutine free_oscillator(sys, m, k, status)
      type(linear_system), intent(inout) :: sys
      real(wp), intent(in) :: m, k                !! mass, stiffness
      type(status_type), intent(inout) :: status
      call sys%set(diagonal_matrix([m]), zero_matrix(1), diagonal_matrix([k]), status)
   end subroutine free_oscillator

   !> The left-hand side of eq. (46)
   subroutine loaded_setup(self, status)
      class(loaded_oscillator), intent(inout) :: self
      type(status_type), intent(inout) :: status
      call self%set(diagonal_matrix([1.0_wp]), diagonal_matrix([4.0_wp]), diagonal_matrix([13.0_wp]), status)
      self%load_kind = load_procedure
   end subroutine loaded_setup

   !> The right-hand side of eq. (46)
   recursive subroutine loaded_load(self, t, p, ierr)
      class(loaded_oscillator), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      p(1) = exp(-2.0_wp*t)*sin(3.0_wp*t)/3.0_wp
   end subroutine loaded_load

   !> Eq. (47): x = e^-2t g,  g = cos 3t + (sin 3t - 3t cos 3t)/54, and its derivatives
   pure subroutine loaded_exact(t, x, v, a)
      real(wp), intent(in) :: t
      real(wp), intent(out) :: x, v, a            !! displacement, velocity, acceleration
      real(wp) :: c, s, g, g1, g2
      c = cos(3.0_wp*t)
      s = sin(3.0_wp*t)
      g = c + (s - 3.0_wp*t*c)/54.0_wp
      g1 = -3.0_wp*s + t*s/6.0_wp                      ! g'
      g2 = -9.0_wp*c + s/6.0_wp + 0.5_wp*t*c           ! g''
      x = exp(-2.0_wp*t)*g
      v = exp(-2.0_wp*t)*(g1 - 2.0_wp*g)
      a = exp(-2.0_wp*t)*(g2 - 4.0_wp*g1 + 4.0_wp*g)
   end subroutine loaded_exact
end module dynstep_oscillator
