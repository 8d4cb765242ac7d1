! SPDX-License-Identifier: BSD-3-Clause
!> Declarations of a mechanical system that make no sense, by their names, before anything is
!> called or allocated for them.
module dynstep_check_structure
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_identity
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_structure

contains

   !> n >= 1, known kinds, bands inside the matrix, and symmetric ones with kl = ku
   pure subroutine check_structure(sys, status)
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      associate (s => sys%structure, n => sys%n)
         if (n < 1) then
            call status%set(dynstep_invalid_input, 'the system has n = '//text(n)//' unknowns; set n >= 1 before init')
         else if (s%mass < kind_identity .or. s%mass > kind_dense) then
            call status%set(dynstep_invalid_input, 'structure%mass = '//text(s%mass) &
               & //' is none of identity (0), diagonal (1), banded (2), dense (3)')
         else if (s%tangent < kind_diagonal .or. s%tangent > kind_dense) then
            call status%set(dynstep_invalid_input, 'structure%tangent = '//text(s%tangent) &
               & //' is none of diagonal (1), banded (2), dense (3)')
         end if
         if (status%failed()) return
         if (sys%holonomic < 0 .or. sys%nonholonomic < 0) then
            call status%set(dynstep_invalid_input, 'the system has '//text(sys%holonomic) &
               & //' holonomic and '//text(sys%nonholonomic)//' nonholonomic constraints; neither may be negative')
         else if (sys%holonomic + sys%nonholonomic > n) then
            call status%set(dynstep_invalid_input, 'the system has '//text(sys%holonomic)//' + '//text(sys%nonholonomic) &
               & //' constraints g and k on n = '//text(n)//' coordinates; there may be as many as coordinates at most')
         end if
         call sys%constraints%g%check('constraint_jacobian', sys%holonomic, n, status)
         call sys%constraints%k%check('velocity_jacobian', sys%nonholonomic, n, status)
         call check_order(sys, status)
         if (s%mass == kind_banded) call check_band('mass_', n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         if (s%tangent == kind_banded) call check_band('', n, s%kl, s%ku, s%tangent_is_symmetric, status)
      end associate
   end subroutine check_structure

   !> constraints%order is a permutation of the unknowns
   pure subroutine check_order(sys, status)
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      logical :: is_there(sys%n + max(0, sys%holonomic) + max(0, sys%nonholonomic))
      integer :: i
      if (status%failed() .or. .not. allocated(sys%constraints%order)) return
      associate (order => sys%constraints%order)
         is_there = .false.
         if (size(order) == size(is_there)) then
            do i = 1, size(order)
               if (order(i) >= 1 .and. order(i) <= size(order)) is_there(order(i)) = .true.
            end do
         end if
         if (.not. all(is_there)) call status%set(dynstep_invalid_input, 'constraints%order must name each of 1 to n + m + p = ' &
            & //text(size(is_there))//' once')
      end associate
   end subroutine check_order

   pure subroutine check_band(prefix, n, kl, ku, is_symmetric, status)
      character(len=*), intent(in) :: prefix     !! of the names kl and ku
      integer, intent(in) :: n, kl, ku
      logical, intent(in) :: is_symmetric
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (min(kl, ku) < 0 .or. max(kl, ku) >= n) then
         call status%set(dynstep_invalid_input, 'structure%'//prefix//'kl = '//text(kl)//' and '//prefix//'ku = ' &
            & //text(ku)//' do not fit a matrix of order '//text(n)//': 0 <= kl, ku < n')
      else if (is_symmetric .and. kl /= ku) then
         call status%set(dynstep_invalid_input, 'structure%'//prefix//'kl = '//text(kl)//' and '//prefix//'ku = ' &
            & //text(ku)//' differ, but the matrix is declared symmetric')
      end if
   end subroutine check_band
end module dynstep_check_structure
