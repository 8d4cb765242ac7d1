! SPDX-License-Identifier: BSD-3-Clause
!> Findings of check_system: a list of sentences, and comparisons that add to it.
module dynstep_findings
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, matrix_type
   use dynstep_status, only: dynstep_callback_failed, dynstep_not_finite, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: add, check_symmetry, compare_matrices, compare_vectors, look, others, row_terms

   integer, parameter, public :: finding_length = 160

contains

   !> One more finding
   recursive subroutine add(report, finding)
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      character(len=*), intent(in) :: finding
      character(len=finding_length), allocatable :: longer(:)
      allocate (longer(size(report) + 1))
      longer(:size(report)) = report
      longer(size(longer)) = finding
      call move_alloc(longer, report)
   end subroutine add

   !> A procedure that failed while it was checked
   recursive subroutine look(name, ierr, is_finite, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: ierr
      logical, intent(in) :: is_finite
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (ierr /= 0) then
         call status%set(dynstep_callback_failed, name//' returned ierr = '//text(ierr) &
            & //' while the system was checked; choose a point inside its domain')
      else if (.not. is_finite) then
         call status%set(dynstep_not_finite, name//' returned a value that is not finite while the system was checked')
      end if
   end subroutine look

   !> ' (3 more like this)'
   pure function others(wrong) result(words)
      integer, intent(in) :: wrong
      character(len=40) :: words
      words = ''
      if (wrong > 0) words = ' ('//text(wrong)//' more like this)'
   end function others

   !> The first pair of entries that differ
   recursive subroutine check_symmetry(name, a, allowed, report)
      character(len=*), intent(in) :: name
      type(matrix_type), intent(in) :: a
      real(wp), intent(in) :: allowed                !! difference, relative to the largest entry of both rows
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      real(wp) :: sums(a%n)
      integer :: i, j
      if (a%kind < kind_banded) return
      call a%absolute_row_sums(sums)
      do j = 1, a%n
         do i = j + 1, a%n
            if (abs(a%entry(i, j) - a%entry(j, i)) <= allowed*max(sums(i), sums(j))) cycle
            call add(report, name//' is declared symmetric, but '//name//'('//text(i)//','//text(j)//') = ' &
               & //text(a%entry(i, j))//' and '//name//'('//text(j)//','//text(i)//') = '//text(a%entry(j, i)))
            return
         end do
      end do
   end subroutine check_symmetry

   !> The first entry that differs
   recursive subroutine compare_matrices(what, a, b, allowed, report)
      character(len=*), intent(in) :: what
      type(matrix_type), intent(in) :: a, b
      real(wp), intent(in) :: allowed                !! difference, relative to the row
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      real(wp) :: sums(a%n)
      integer :: i, j
      call a%absolute_row_sums(sums)
      do j = 1, a%n
         do i = 1, a%n
            if (abs(a%entry(i, j) - b%entry(i, j)) <= allowed*sums(i)) cycle
            call add(report, what//'('//text(i)//','//text(j)//') is '//text(a%entry(i, j)) &
               & //' here and '//text(b%entry(i, j))//' near by')
            return
         end do
      end do
   end subroutine compare_matrices

   !> The first component that differs
   recursive subroutine compare_vectors(what, a, b, terms, allowed, report)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: a(:), b(:)
      real(wp), intent(in) :: terms(:)               !! sizes of what the components are sums of
      real(wp), intent(in) :: allowed                !! difference, relative to component and terms
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      integer :: i
      do i = 1, size(a)
         if (abs(a(i) - b(i)) <= allowed*max(abs(a(i)), abs(b(i)), terms(i))) cycle
         call add(report, what//': component '//text(i)//' is '//text(a(i))//' and '//text(b(i)))
         return
      end do
   end subroutine compare_vectors

   !> sums(i) = sum over j of |A(i,j)| sizes(j): the size of the terms of a row
   pure subroutine row_terms(a, sizes, sums)
      type(matrix_type), intent(in) :: a
      real(wp), intent(in) :: sizes(:)
      real(wp), intent(out) :: sums(:)
      integer :: i, j
      sums = 0.0_wp
      do j = 1, a%n
         do i = 1, a%n
            sums(i) = sums(i) + abs(a%entry(i, j))*sizes(j)
         end do
      end do
   end subroutine row_terms
end module dynstep_findings
