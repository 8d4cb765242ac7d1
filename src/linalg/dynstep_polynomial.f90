! SPDX-License-Identifier: BSD-3-Clause
!> Zeros of real polynomials c(0) + c(1) z + ... + c(d) z^d, of degrees up to a few dozens.
!>
!> All zeros at once by the iteration of Ehrlich and Aberth (O. Aberth, Math. Comp. 27 (1973) 339-344), from
!> circles that the Newton polygon of the coefficients gives (D. A. Bini, Numer. Algorithms 13 (1996) 179-200),
!> so that coefficients of very different sizes do no harm.  Done in the working precision of the library,
!> whatever that is, which LAPACK's eigenvalues of the companion matrix are not.
module dynstep_polynomial
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: polynomial_degree, polynomial_value, polynomial_zeros

   integer, parameter :: most_sweeps = 500

contains

   !> Degree without zeros at the end of the coefficients; -1 for the zero polynomial
   pure integer function polynomial_degree(c)
      real(wp), intent(in) :: c(0:)
      do polynomial_degree = size(c) - 1, 0, -1
         if (abs(c(polynomial_degree)) > 0.0_wp) return
      end do
   end function polynomial_degree

   !> c(0) + c(1) z + ..., by Horner's rule
   pure complex(wp) function polynomial_value(c, z)
      real(wp), intent(in) :: c(0:)
      complex(wp), intent(in) :: z
      integer :: k
      polynomial_value = (0.0_wp, 0.0_wp)
      do k = size(c) - 1, 0, -1
         polynomial_value = polynomial_value*z + c(k)
      end do
   end function polynomial_value

   !> All zeros: pairs of conjugates stand together, the one in the upper half-plane first.  A zero
   !> whose imaginary part is below its rounding error is real.  Simple zeros come out to a few units of
   !> rounding times their condition, multiple ones to the corresponding root of it.
   pure subroutine polynomial_zeros(c, zeros, converged)
      real(wp), intent(in) :: c(0:)                        !! finite; c(0) or others may be zero
      complex(wp), allocatable, intent(out) :: zeros(:)    !! [degree]
      logical, intent(out) :: converged                    !! else the zeros are rough
      complex(wp) :: p, dp, step, repulsion
      real(wp) :: size_of_p
      logical :: moves(size(c))
      integer :: d, i, j, low, sweep

      converged = .true.
      d = polynomial_degree(c)
      allocate (zeros(max(0, d)))
      if (d < 1) return
      low = 0
      do while (.not. abs(c(low)) > 0.0_wp)
         low = low + 1
         zeros(low) = (0.0_wp, 0.0_wp)
      end do
      call first_guesses(c(low:d), zeros(low + 1:))
      moves = .true.
      moves(:low) = .false.
      do sweep = 1, most_sweeps
         do i = low + 1, d
            if (.not. moves(i)) cycle
            call value_and_slope(c(low:d), zeros(i), p, dp, size_of_p)
            if (abs(p) <= 2.0_wp*epsilon(1.0_wp)*size_of_p) then
               moves(i) = .false.
               cycle
            end if
            repulsion = (0.0_wp, 0.0_wp)
            do j = low + 1, d
               if (j /= i) repulsion = repulsion + 1.0_wp/(zeros(i) - zeros(j))
            end do
            step = p/(dp - p*repulsion)
            zeros(i) = zeros(i) - step
            if (abs(step) <= 0.25_wp*epsilon(1.0_wp)*abs(zeros(i))) moves(i) = .false.
         end do
         if (.not. any(moves(:d))) exit
      end do
      converged = .not. any(moves(:d))
      call sort_conjugates(c(low:d), zeros(low + 1:))
   end subroutine polynomial_zeros

   !> p(z), p'(z) and the sum of the sizes of the terms of p
   pure subroutine value_and_slope(c, z, p, dp, size_of_p)
      real(wp), intent(in) :: c(0:)
      complex(wp), intent(in) :: z
      complex(wp), intent(out) :: p, dp
      real(wp), intent(out) :: size_of_p
      integer :: k
      p = (0.0_wp, 0.0_wp)
      dp = (0.0_wp, 0.0_wp)
      size_of_p = 0.0_wp
      do k = size(c) - 1, 0, -1
         dp = dp*z + p
         p = p*z + c(k)
         size_of_p = size_of_p*abs(z) + abs(c(k))
      end do
   end subroutine value_and_slope

   !> Points on circles whose radii are the slopes of the upper hull of log |c|
   pure subroutine first_guesses(c, zeros)
      real(wp), intent(in) :: c(0:)               !! first and last not zero
      complex(wp), intent(out) :: zeros(:)        !! [degree]
      real(wp), parameter :: pi = acos(-1.0_wp), turn = 0.7_wp
      real(wp) :: height(0:size(c) - 1), radius, slope, steepest, angle
      integer :: d, i, j, k, next
      d = size(c) - 1
      height = -huge(1.0_wp)
      where (abs(c) > 0.0_wp) height = log(abs(c))
      i = 0
      do while (i < d)
         steepest = -huge(1.0_wp)
         next = d
         do j = i + 1, d
            if (.not. abs(c(j)) > 0.0_wp) cycle
            slope = (height(j) - height(i))/real(j - i, wp)
            if (slope >= steepest) then
               steepest = slope
               next = j
            end if
         end do
         radius = exp(-steepest)
         do k = i + 1, next
            angle = 2.0_wp*pi*real(k - i, wp)/real(next - i, wp) + turn + real(i, wp)
            zeros(k) = radius*cmplx(cos(angle), sin(angle), wp)
         end do
         i = next
      end do
   end subroutine first_guesses

   !> Real zeros become real, the others exact conjugates next to each other
   pure subroutine sort_conjugates(c, zeros)
      real(wp), intent(in) :: c(0:)
      complex(wp), intent(inout) :: zeros(:)
      complex(wp) :: sorted(size(zeros)), p, dp
      real(wp) :: error, size_of_p
      logical :: is_used(size(zeros))
      integer :: count, i, j
      is_used = .false.
      count = 0
      do i = 1, size(zeros)
         if (is_used(i)) cycle
         is_used(i) = .true.
         call value_and_slope(c, zeros(i), p, dp, size_of_p)
         error = 8.0_wp*epsilon(1.0_wp)*(abs(zeros(i)) + size_of_p/max(abs(dp), tiny(1.0_wp)))
         if (abs(aimag(zeros(i))) <= error .and. .not. has_partner(zeros, is_used, i, error)) then
            count = count + 1
            sorted(count) = cmplx(real(zeros(i), wp), 0.0_wp, wp)
            cycle
         end if
         j = closest(zeros, is_used, conjg(zeros(i)))
         if (j == 0) then
            count = count + 1
            sorted(count) = cmplx(real(zeros(i), wp), 0.0_wp, wp)
            cycle
         end if
         is_used(j) = .true.
         p = 0.5_wp*(zeros(i) + conjg(zeros(j)))
         p = cmplx(real(p, wp), abs(aimag(p)), wp)
         sorted(count + 1) = p
         sorted(count + 2) = conjg(p)
         count = count + 2
      end do
      zeros = sorted
   end subroutine sort_conjugates

   !> True where another zero is so near that both may be a pair beside the real axis
   pure logical function has_partner(zeros, is_used, i, error)
      complex(wp), intent(in) :: zeros(:)
      logical, intent(in) :: is_used(:)
      integer, intent(in) :: i
      real(wp), intent(in) :: error
      integer :: j
      has_partner = .false.
      if (.not. abs(aimag(zeros(i))) > 0.0_wp) return
      j = closest(zeros, is_used, conjg(zeros(i)))
      if (j == 0) return
      has_partner = abs(zeros(j) - conjg(zeros(i))) <= error .and. aimag(zeros(j))*aimag(zeros(i)) < 0.0_wp
   end function has_partner

   !> Index of the unused zero next to a point, 0 if there is none
   pure integer function closest(zeros, is_used, point)
      complex(wp), intent(in) :: zeros(:)
      logical, intent(in) :: is_used(:)
      complex(wp), intent(in) :: point
      real(wp) :: distance
      integer :: j
      closest = 0
      distance = huge(1.0_wp)
      do j = 1, size(zeros)
         if (is_used(j)) cycle
         if (abs(zeros(j) - point) > distance) cycle
         closest = j
         distance = abs(zeros(j) - point)
      end do
   end function closest
end module dynstep_polynomial
