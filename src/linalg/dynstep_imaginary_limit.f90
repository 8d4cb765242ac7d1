! SPDX-License-Identifier: BSD-3-Clause
!> How far |R| stays at most 1 on the imaginary axis: E(y^2) = |D(i y)|^2 - |N(i y)|^2 is a polynomial.
module dynstep_imaginary_limit
   use dynstep_kinds, only: wp
   use dynstep_positive_zeros, only: positive_zeros
   use dynstep_rational, only: most_degree, rational_type
   implicit none
   private

   public :: imaginary_limit

contains

   !> Where |R(i y)| exceeds 1 first, y > 0: where E becomes negative; 0 where it does from 0 on, huge() where it never does
   recursive function imaginary_limit(r) result(limit)
      type(rational_type), intent(in) :: r
      real(wp) :: limit
      real(wp) :: c(0:most_degree), noise(0:most_degree)
      real(wp), allocatable :: crossings(:), touched(:)
      integer :: first_sign
      c = 0.0_wp
      noise = 0.0_wp
      call add_square(1.0_wp, r%den, c, noise)
      call add_square(-1.0_wp, r%num, c, noise)
      call positive_zeros(c, 64.0_wp*epsilon(1.0_wp)*noise, crossings, touched, first_sign)
      limit = huge(limit)
      if (size(crossings) > 0) limit = sqrt(crossings(1))
      if (first_sign < 0) limit = 0.0_wp
   end function imaginary_limit

   !> c = c + factor*|a(i y)|^2 as a polynomial in y^2
   pure subroutine add_square(factor, a, c, noise)
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: a(0:)
      real(wp), intent(inout) :: c(0:), noise(0:)    !! coefficients, and the sums of the sizes of their terms
      integer :: j, k
      do j = 0, ubound(a, 1)
         do k = mod(j, 2), ubound(a, 1), 2
            c((j + k)/2) = c((j + k)/2) + factor*(-1)**((j - k)/2)*a(j)*a(k)
            noise((j + k)/2) = noise((j + k)/2) + abs(a(j)*a(k))
         end do
      end do
   end subroutine add_square
end module dynstep_imaginary_limit
