! SPDX-License-Identifier: BSD-3-Clause
!> Matrices that a C caller gives.
module dynstep_c_matrices
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_ptr
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_zero, matrix_type
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_storage, take_matrix

contains

   !> A matrix of order n, copied; entries are finite
   recursive subroutine take_matrix(name, n, kind, kl, ku, symmetric, a, matrix, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: n
      integer(c_int), intent(in) :: kind, kl, ku, symmetric
      type(c_ptr), intent(in) :: a                   !! read where the kind has entries
      type(matrix_type), intent(inout) :: matrix
      type(status_type), intent(inout) :: status
      real(c_double), pointer :: entries(:, :)

      call check_storage(n, kind, kl, ku, symmetric, kind_zero, status)
      if (kind >= kind_diagonal .and. .not. status%failed() .and. .not. c_associated(a)) &
         & call status%set(dynstep_invalid_input, 'a is NULL, but a matrix of kind '//text(kind)//' has entries')
      call matrix%init(kind, n, kl, ku, symmetric /= 0, status)
      if (status%failed()) return
      if (kind >= kind_diagonal) then
         call c_f_pointer(a, entries, shape(matrix%a))
         matrix%a = entries
      end if
      call matrix%check(name, n, status)
   end subroutine take_matrix

   !> Kind and bandwidths that a caller gives are ones that there are
   recursive subroutine check_storage(n, kind, kl, ku, symmetric, least, status)
      integer, intent(in) :: n
      integer(c_int), intent(in) :: kind, kl, ku, symmetric
      integer, intent(in) :: least               !! first of the kinds that are allowed
      type(status_type), intent(inout) :: status
      if (kind < least .or. kind > kind_dense) then
         call status%set(dynstep_invalid_input, 'kind = '//text(kind)//' must be one of '//text(least)//' to ' &
            & //text(kind_dense)//' of enum dynstep_kind')
      else if (kind == kind_banded) then
         if (kl < 0 .or. ku < 0 .or. kl >= n .or. ku >= n) then
            call status%set(dynstep_invalid_input, 'kl = '//text(kl)//' and ku = '//text(ku) &
               & //' must lie between 0 and n - 1 = '//text(n - 1))
         else if (symmetric /= 0 .and. kl /= ku) then
            call status%set(dynstep_invalid_input, 'kl = '//text(kl)//' and ku = '//text(ku) &
               & //' must be equal in a symmetric band')
         end if
      end if
   end subroutine check_storage
end module dynstep_c_matrices
