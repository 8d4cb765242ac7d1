! SPDX-License-Identifier: BSD-3-Clause
!> The whole Jacobian of a step of generalized-alpha-SOI2, by differences of all residuals, and one correction
!> with it: the way out where the block matrices of DYNSTEP_SOI2_MATRICES do not contract (a step turns a body
!> by about a radian).  It costs as many evaluations as there are unknowns, and storage that is
!> allocated when it is needed first.
module dynstep_soi2_jacobian
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_dense, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_soi2_equations, only: soi2_equations
   use dynstep_soi2_matrices, only: correction_length, position_part
   use dynstep_status, only: dynstep_not_converged, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   !> Most unknowns that this is tried for: 400 columns by differences take as long as thousands of
   !> ordinary corrections
   integer, parameter, public :: most_unknowns = 400

   type, public :: soi2_jacobian
      type(matrix_type), allocatable, private :: matrix
      type(factorization_type), allocatable, private :: factor
      real(wp), allocatable, private :: x(:), x0(:), r0(:), r1(:)
      real(wp), allocatable, private :: ddelta(:)
   contains
      procedure :: correct => jacobian_correct
   end type soi2_jacobian

   !> Larger ones would overflow in differences and in the factorization
   real(wp), parameter :: largest_number = 1.0e100_wp

   !> Part of y or z that a component is moved by: sqrt(eps) balances truncation and rounding
   real(wp), parameter :: relative_step = sqrt(epsilon(1.0_wp))

contains

   !> One correction from the residuals of the last evaluation, with a new Jacobian
   recursive subroutine jacobian_correct(self, sys, eqs, regularization, length, count, status)
      class(soi2_jacobian), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(soi2_equations), intent(inout) :: eqs
      real(wp), intent(in) :: regularization
      real(wp), intent(out) :: length          !! of the correction, as a part of y and z
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: step
      integer :: j, n

      length = huge(length)
      if (status%failed()) return
      n = eqs%unknowns()
      call prepare(self, eqs, n, status)
      if (sys%constraints%reaction_is_general) then
         ! D may take the reactions as linear
         call eqs%motion%differentiate_reaction(sys, eqs%t1, eqs%y1, eqs%z1, eqs%lambda, eqs%psi, status)
         call eqs%evaluate(sys, count, status)
      end if
      if (status%failed()) return
      call eqs%pack_residuals(self%r0)
      call eqs%pack_unknowns(self%x0)
      call check_sizes(self%x0, eqs, status)
      call check_sizes(self%r0, eqs, status)
      if (status%failed()) return
      do j = 1, n
         self%x = self%x0
         step = max(relative_step*unknown_size(eqs, j), 8.0_wp*spacing(self%x0(j)))
         self%x(j) = self%x0(j) + step
         call eqs%unpack_unknowns(self%x)
         call eqs%evaluate(sys, count, status)
         call eqs%pack_residuals(self%r1)
         call check_sizes(self%r1, eqs, status)
         if (status%failed()) return
         self%matrix%a(:, j) = (self%r1 - self%r0)/(self%x(j) - self%x0(j))
      end do
      call regularize(self, eqs, regularization)
      call eqs%unpack_unknowns(self%x0)
      call eqs%place()
      call self%factor%factorize(self%matrix, status, eqs%t1, 'Jacobian of the step')
      count%factorizations = count%factorizations + 1
      status%retry = status%failed()
      if (status%failed()) return
      self%r1 = -self%r0
      call self%factor%solve(self%r1)
      count%solves = count%solves + 1
      self%x = self%x0 + self%r1
      call eqs%unpack_unknowns(self%x)
      associate (i1 => size(eqs%a), i2 => size(eqs%a) + size(eqs%lambda), i3 => size(eqs%a) + size(eqs%lambda) + size(eqs%psi))
         self%ddelta = 0.0_wp
         if (eqs%has_differences) self%ddelta = self%r1(i3 + 1:i3 + i1)
         length = correction_length(eqs, self%r1(1:i1), self%ddelta, self%r1(i1 + 1:i2), self%r1(i2 + 1:i3))
         eqs%moved = position_part(eqs, self%r1(1:i1), self%ddelta)
      end associate
   end subroutine jacobian_correct

   !> Unknowns and residuals that leave the range of numbers are those of an iteration that diverges
   pure subroutine check_sizes(x, eqs, status)
      real(wp), intent(in) :: x(:)
      type(soi2_equations), intent(in) :: eqs
      type(status_type), intent(inout) :: status
      logical :: is_fine
      if (status%failed()) return
      is_fine = all(ieee_is_finite(x))
      if (is_fine) is_fine = maxval(abs(x)) <= largest_number
      if (.not. is_fine) call status%set(dynstep_not_converged, 'the Newton iteration diverges in the step from t = ' &
         & //text(eqs%t0)//' of length '//text(eqs%h)//'; reduce h', retry=.true.)
   end subroutine check_sizes

   recursive subroutine prepare(self, eqs, n, status)
      class(soi2_jacobian), intent(inout) :: self
      type(soi2_equations), intent(in) :: eqs
      integer, intent(in) :: n
      type(status_type), intent(inout) :: status
      if (allocated(self%x)) then
         if (size(self%x) == n) return
         deallocate (self%matrix, self%factor, self%x, self%x0, self%r0, self%r1, self%ddelta)
      end if
      allocate (self%matrix, self%factor)
      call self%matrix%init(kind_dense, n, 0, 0, .false., status)
      call self%factor%init(kind_dense, n, 0, 0, .false., status)
      allocate (self%x(n), self%x0(n), self%r0(n), self%r1(n), self%ddelta(size(eqs%a)))
   end subroutine prepare

   !> A change of y or z of their own size, as a change of unknown j
   pure real(wp) function unknown_size(eqs, j)
      type(soi2_equations), intent(in) :: eqs
      integer, intent(in) :: j
      real(wp) :: y, z
      integer :: block, n, place
      n = size(eqs%a)
      block = n + size(eqs%lambda) + size(eqs%psi)
      place = modulo(j - 1, block) + 1
      z = max(maxval(abs(eqs%z1)), abs(eqs%h)*maxval(abs(eqs%a)))
      y = max(maxval(abs(eqs%y1)), abs(eqs%h)*z)
      ! at rest z is a rounding error
      z = max(z, relative_step*y/max(abs(eqs%h), tiny(y)))
      if (place <= n) then
         unknown_size = z/max(abs(eqs%c), tiny(z))
         if (j > block) unknown_size = min(unknown_size, y/max(abs(eqs%b), tiny(y)))
      else
         unknown_size = max(maxval(abs(eqs%r)), maxval(abs(eqs%lambda)), maxval(abs(eqs%psi)))
      end if
      if (.not. unknown_size > 0.0_wp) unknown_size = 1.0_wp
   end function unknown_size

   !> Redundant constraints: a small negative diagonal where the constraints are
   pure subroutine regularize(self, eqs, regularization)
      class(soi2_jacobian), intent(inout) :: self
      type(soi2_equations), intent(in) :: eqs
      real(wp), intent(in) :: regularization
      integer :: j, n, block
      if (regularization <= 0.0_wp) return
      n = size(eqs%a)
      block = n + size(eqs%lambda) + size(eqs%psi)
      do j = 1, eqs%unknowns()
         if (modulo(j - 1, block) + 1 > n) self%matrix%a(j, j) = self%matrix%a(j, j) - regularization
      end do
   end subroutine regularize

end module dynstep_soi2_jacobian
