! SPDX-License-Identifier: BSD-3-Clause
!> Local errors of a step of generalized-alpha and of generalized-alpha-SOI2, from what the step leaves in its history.
!>
!> With s = a'' and a_{n+alpha} = a(t_n + alpha h) + kappa h^2 s, as dynstep_soi2_history tells kappa, (13a) and (13c) of
!> Jay & Negrut 2008 have the errors
!>
!>   e_y = (beta + alpha/2 - 1/6) h^2 (a_{1+alpha} - a_alpha)            = (1/12 + alpha^2/4) h^3 y''' at order 2
!>   e_z = (gamma + alpha - 1/2) h (a_{1+alpha} - a_alpha)               0 at order 2
!>       + [d + (1 - gamma) kappa_alpha + gamma kappa_{1+alpha}] h^3 s,  d = 1/12 - alpha^2/2 at order 2
!>
!> With steps of one length the bracket is d + (alpha/2) (alpha_m + alpha_f - 1).
!>
!> These hold along the constraints.  Across them the step ends right, but a_{1+alpha} has other errors.  The projected estimate
!> is the part of e_y in the kernel of G, with the K e_y that (13h) leaves it, and that of e_z in the kernel of G and K,
!> orthogonal in the sense of M: one solve each with factors that the step has made.
!>
!> Errors of multipliers: across the constraints (13c) makes a_{n+alpha} wrong by -d h^2 s, and what (13e) then lacks,
!> M s h^2 (d + (alpha/2) (alpha_m + alpha_f - 1)), the reactions make up for.  M s across the constraints is what the
!> multipliers of the projection of s are.  This holds for steps of one length.  What steps that vary add to it fades by rho_inf a
!> step, whatever the length of the next one, so that no choice of it can help: it is left out.
module dynstep_soi2_estimate
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_alpha_coefficients, only: alpha_coefficients
   use dynstep_error_norm, only: error_norm_type, norm_largest
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_soi2_equations, only: soi2_equations
   use dynstep_soi2_history, only: balance_defect, history_type, velocity_defect
   use dynstep_soi2_matrices, only: soi2_matrices
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: raw_errors, multiplier_part

   integer, parameter, public :: estimate_larger = 1      !! projected, but at least a part of the raw one
   integer, parameter, public :: estimate_projected = 2   !! onto the constraints
   integer, parameter, public :: estimate_raw = 3         !! e_y and e_z as they are

   !> Work arrays and results
   type, public :: soi2_estimate
      real(wp), allocatable :: raw(:)                     !! [e_y; e_z]
      real(wp), allocatable :: projected(:)               !! the same along the constraints
      real(wp), allocatable :: lambda(:), psi(:)          !! errors of the multipliers
      real(wp), allocatable :: bend(:)                    !! a'' [n]
      real(wp), allocatable :: middle(:), f(:)            !! [n] of a first step
      real(wp), allocatable, private :: x(:), l(:), q(:), kind(:)
   contains
      procedure :: are_finite => estimate_are_finite
      procedure :: larger_kind => estimate_larger_kind
      procedure :: init => estimate_init
      procedure :: measure => estimate_measure
   end type soi2_estimate

contains

   recursive subroutine estimate_init(self, sys, status)
      class(soi2_estimate), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      if (allocated(self%raw)) deallocate (self%raw, self%projected, self%lambda, self%psi, self%x, self%l, self%q, &
         & self%bend, self%middle, self%f, self%kind)
      associate (n => sys%n, m => sys%holonomic, p => sys%nonholonomic)
         allocate (self%raw(2*n), self%projected(2*n), self%kind(2*n), self%x(n), self%bend(n), self%middle(n), self%f(n), &
            & self%lambda(m), self%l(m), self%psi(p), self%q(p), source=0.0_wp, stat=stat)
      end associate
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the estimate of the errors of '//text(sys%n) &
         & //' coordinates')
   end subroutine estimate_init

   !> [e_y; e_z] of the step whose history this is
   pure subroutine raw_errors(c, step, s, error)
      type(alpha_coefficients), intent(in) :: c
      type(history_type), intent(in) :: step
      real(wp), intent(in) :: s(:)                        !! a'' along the constraints [n]
      real(wp), intent(out) :: error(:)                   !! [2 n]
      integer :: n
      n = size(s)
      error(1:n) = ((c%beta + 0.5_wp*c%alpha() - 1.0_wp/6.0_wp)*step%h**2)*(step%a - step%a_used)
      error(n + 1:) = (bend_weight(c, step)*step%h**3)*s
      if (c%order() < 2) error(n + 1:) = error(n + 1:) + ((c%gamma + c%alpha() - 0.5_wp)*step%h)*(step%a - step%a_used)
   end subroutine raw_errors

   !> Of h^3 a'' in e_z
   pure real(wp) function bend_weight(c, step)
      type(alpha_coefficients), intent(in) :: c
      type(history_type), intent(in) :: step
      bend_weight = velocity_defect(c) + (1.0_wp - c%gamma)*step%kappa_used + c%gamma*step%kappa
   end function bend_weight

   !> `raw` and `projected`, and the multipliers' errors
   pure subroutine estimate_measure(self, eqs, step, matrices, solves)
      class(soi2_estimate), intent(inout) :: self         !! bend is set
      type(soi2_equations), intent(in) :: eqs
      type(history_type), intent(in) :: step
      type(soi2_matrices), intent(inout) :: matrices      !! with factors
      integer, intent(out) :: solves
      real(wp) :: weight
      integer :: n
      n = size(self%x)
      call raw_errors(eqs%coefficients, step, self%bend, self%raw)
      self%projected = self%raw
      solves = 0
      if (size(self%l) + size(self%q) == 0) return
      if (size(self%l) > 0) then
         self%x = self%raw(1:n)
         self%q = 0.0_wp
         if (size(self%q) > 0) call eqs%motion%kv%multiply(self%x, self%q)
         call matrices%project(eqs, self%x, self%l, self%q)
         self%projected(1:n) = self%x
         solves = 1
      end if
      self%x = step%h**3*self%bend
      self%q = 0.0_wp
      call matrices%project(eqs, self%x, self%l, self%q)
      weight = bend_weight(eqs%coefficients, step)
      self%projected(n + 1:) = weight*self%x
      if (eqs%coefficients%order() < 2) self%projected(n + 1:) = self%raw(n + 1:) + weight*(self%x - step%h**3*self%bend)
      weight = (velocity_defect(eqs%coefficients) + balance_defect(eqs%coefficients))/step%h
      self%lambda = weight*self%l
      self%psi = weight*self%q
      solves = solves + 1
   end subroutine estimate_measure

   pure logical function estimate_are_finite(self)
      class(soi2_estimate), intent(in) :: self
      estimate_are_finite = all(ieee_is_finite(self%raw)) .and. all(ieee_is_finite(self%projected)) &
         & .and. all(ieee_is_finite(self%lambda)) .and. all(ieee_is_finite(self%psi))
   end function estimate_are_finite

   !> Size of an error: that of positions or that of velocities, whichever is larger.  In one mean of both a motion whose
   !> velocities have small errors would be allowed 1.4 times as much in its positions.
   pure subroutine estimate_larger_kind(self, norm, error, y0, y1, largest)
      class(soi2_estimate), intent(inout) :: self
      type(error_norm_type), intent(in) :: norm
      real(wp), intent(in) :: error(:), y0(:), y1(:)      !! [2 n]
      real(wp), intent(out) :: largest
      integer :: n
      n = size(error)/2
      self%kind(1:n) = error(1:n)
      self%kind(n + 1:) = 0.0_wp
      largest = norm%measure(self%kind, y0, y1)
      self%kind(1:n) = 0.0_wp
      self%kind(n + 1:) = error(n + 1:)
      largest = max(largest, norm%measure(self%kind, y0, y1))
      ! a mean over 2 n numbers, n of which are zero
      if (norm%kind /= norm_largest) largest = sqrt(2.0_wp)*largest
   end subroutine estimate_larger_kind

   !> Size of the errors of multipliers beside what is tolerated, to the power 3/2: they are O(h^2), those of the state
   !> O(h^3), and a step that is good for both has 1 in both.  rtol goes with the largest of them: they are solved for
   !> together, and one that passes zero has the rounding errors of the others.
   pure real(wp) function multiplier_part(norm, atol, error, before, after)
      type(error_norm_type), intent(in) :: norm
      real(wp), intent(in) :: atol                        !! 0: no tolerance is set
      real(wp), intent(in) :: error(:), before(:), after(:)
      real(wp) :: relative, scale
      multiplier_part = 0.0_wp
      if (.not. atol > 0.0_wp .or. size(error) == 0) return
      relative = merge(norm%tolerance, norm%rtol, norm%kind == norm_largest)
      scale = atol + relative*max(maxval(abs(before)), maxval(abs(after)))
      multiplier_part = sum((error/scale)**2)
      multiplier_part = (multiplier_part/real(size(error), wp))**0.75_wp
   end function multiplier_part
end module dynstep_soi2_estimate
