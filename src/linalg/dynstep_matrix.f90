! SPDX-License-Identifier: BSD-3-Clause
!> Square matrices in the storage that their structure deserves.
!>
!> PROGRAMMING INTERFACE
!>
!>   kind             stored in a            entry A(i,j)
!>   kind_zero        nothing                0
!>   kind_identity    nothing                1 on the diagonal
!>   kind_diagonal    a(n,1)                 a(i,1) where i = j
!>   kind_banded      a(kl+ku+1,n)           a(ku+1+i-j,j), LAPACK's band storage
!>   kind_dense       a(n,n)                 a(i,j)
!>
!>   A symmetric matrix is stored whole (both triangles); `symmetric` is what the user
!>   declares, and `check` verifies it.  Constructors: zero_matrix(n), identity_matrix(n),
!>   diagonal_matrix(d), banded_matrix(ab, kl, ku, symmetric), dense_matrix(a, symmetric).
module dynstep_matrix
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: matrix_type
   public :: zero_matrix, identity_matrix, diagonal_matrix, banded_matrix, dense_matrix

   integer, parameter, public :: kind_zero = -1
   integer, parameter, public :: kind_identity = 0
   integer, parameter, public :: kind_diagonal = 1
   integer, parameter, public :: kind_banded = 2
   integer, parameter, public :: kind_dense = 3

   type :: matrix_type
      integer :: kind = kind_zero       !! one of the kinds above
      integer :: n = 0                  !! order
      integer :: kl = 0                 !! subdiagonals (banded)
      integer :: ku = 0                 !! superdiagonals (banded)
      logical :: symmetric = .true.     !! declared symmetry
      real(wp), allocatable :: a(:, :)  !! the entries, see above
   contains
      procedure :: init => matrix_init
      procedure :: set_zero => matrix_set_zero
      procedure :: entry => matrix_entry
      procedure :: set_entry => matrix_set_entry
      procedure :: multiply_add => matrix_multiply_add
      procedure :: add_to => matrix_add_to
      procedure :: absolute_row_sums => matrix_absolute_row_sums
      procedure :: first_not_finite => matrix_first_not_finite
      procedure :: check => matrix_check
      procedure :: archive => matrix_archive
   end type matrix_type

contains

   !> Order, kind and bandwidths; entries zero.  No work where the storage fits already.
   subroutine matrix_init(self, kind, n, kl, ku, symmetric, status)
      class(matrix_type), intent(inout) :: self
      integer, intent(in) :: kind               !! kind_zero ... kind_dense
      integer, intent(in) :: n                  !! order >= 1
      integer, intent(in) :: kl, ku             !! bandwidths, read for kind_banded
      logical, intent(in) :: symmetric
      type(status_type), intent(inout) :: status
      integer :: rows, columns, stat

      if (status%failed()) return
      self%kind = kind
      self%n = n
      self%kl = merge(kl, 0, kind == kind_banded)
      self%ku = merge(ku, 0, kind == kind_banded)
      self%symmetric = symmetric .or. kind <= kind_diagonal
      rows = 0
      columns = 0
      select case (kind)
      case (kind_diagonal)
         rows = n
         columns = 1
      case (kind_banded)
         rows = kl + ku + 1
         columns = n
      case (kind_dense)
         rows = n
         columns = n
      end select
      if (allocated(self%a)) then
         if (any(shape(self%a) /= [rows, columns])) deallocate (self%a)
      end if
      if (.not. allocated(self%a)) then
         allocate (self%a(rows, columns), stat=stat)
         if (stat /= 0) then
            call status%set(dynstep_no_memory, 'no memory for a matrix of order '//text(n) &
               & //'; declare a band or a diagonal where the problem has one')
            return
         end if
      end if
      self%a = 0.0_wp
   end subroutine matrix_init

   !> All stored entries to zero
   pure subroutine matrix_set_zero(self)
      class(matrix_type), intent(inout) :: self
      if (allocated(self%a)) self%a = 0.0_wp
   end subroutine matrix_set_zero

   !> A(i,j), zero outside the stored structure
   pure real(wp) function matrix_entry(self, i, j)
      class(matrix_type), intent(in) :: self
      integer, intent(in) :: i, j    !! row and column, 1..n
      matrix_entry = 0.0_wp
      select case (self%kind)
      case (kind_identity)
         if (i == j) matrix_entry = 1.0_wp
      case (kind_diagonal)
         if (i == j) matrix_entry = self%a(i, 1)
      case (kind_banded)
         if (i - j <= self%kl .and. j - i <= self%ku) matrix_entry = self%a(self%ku + 1 + i - j, j)
      case (kind_dense)
         matrix_entry = self%a(i, j)
      end select
   end function matrix_entry

   !> A(i,j) = value; entries outside the stored structure are left alone
   pure subroutine matrix_set_entry(self, i, j, value)
      class(matrix_type), intent(inout) :: self
      integer, intent(in) :: i, j    !! row and column, 1..n
      real(wp), intent(in) :: value
      select case (self%kind)
      case (kind_diagonal)
         if (i == j) self%a(i, 1) = value
      case (kind_banded)
         if (i - j <= self%kl .and. j - i <= self%ku) self%a(self%ku + 1 + i - j, j) = value
      case (kind_dense)
         self%a(i, j) = value
      end select
   end subroutine matrix_set_entry

   !> y = y + alpha A x
   pure subroutine matrix_multiply_add(self, alpha, x, y)
      class(matrix_type), intent(in) :: self
      real(wp), intent(in) :: alpha
      real(wp), intent(in) :: x(self%n)
      real(wp), intent(inout) :: y(self%n)
      integer :: i, j
      select case (self%kind)
      case (kind_identity)
         y = y + alpha*x
      case (kind_diagonal)
         y = y + alpha*(self%a(:, 1)*x)
      case (kind_banded)
         do j = 1, self%n
            do i = max(1, j - self%ku), min(self%n, j + self%kl)
               y(i) = y(i) + alpha*x(j)*self%a(self%ku + 1 + i - j, j)
            end do
         end do
      case (kind_dense)
         do j = 1, self%n
            do i = 1, self%n
               y(i) = y(i) + alpha*x(j)*self%a(i, j)
            end do
         end do
      end select
   end subroutine matrix_multiply_add

   !> S = S + alpha A, where the structure of S contains that of A
   pure subroutine matrix_add_to(self, alpha, s)
      class(matrix_type), intent(in) :: self
      real(wp), intent(in) :: alpha
      type(matrix_type), intent(inout) :: s
      integer :: i, j
      if (self%kind == kind_zero) return
      if (self%kind == s%kind .and. self%kl == s%kl .and. self%ku == s%ku) then
         s%a = s%a + alpha*self%a
         return
      end if
      if (self%kind == kind_banded .and. s%kind == kind_banded) then
         do j = 1, self%n
            do i = max(1, j - min(self%ku, s%ku)), min(self%n, j + min(self%kl, s%kl))
               s%a(s%ku + 1 + i - j, j) = s%a(s%ku + 1 + i - j, j) + alpha*self%a(self%ku + 1 + i - j, j)
            end do
         end do
      else if (self%kind == kind_banded .and. s%kind == kind_dense) then
         do j = 1, self%n
            do i = max(1, j - self%ku), min(self%n, j + self%kl)
               s%a(i, j) = s%a(i, j) + alpha*self%a(self%ku + 1 + i - j, j)
            end do
         end do
      else
         do j = 1, self%n
            do i = first_row(self, j), last_row(self, j)
               call s%set_entry(i, j, s%entry(i, j) + alpha*self%entry(i, j))
            end do
         end do
      end if
   end subroutine matrix_add_to

   !> sums(i) = sum over j of |A(i,j)|
   pure subroutine matrix_absolute_row_sums(self, sums)
      class(matrix_type), intent(in) :: self
      real(wp), intent(out) :: sums(self%n)
      integer :: i, j
      sums = 0.0_wp
      select case (self%kind)
      case (kind_identity)
         sums = 1.0_wp
      case (kind_diagonal)
         sums = abs(self%a(:, 1))
      case (kind_banded)
         do j = 1, self%n
            do i = max(1, j - self%ku), min(self%n, j + self%kl)
               sums(i) = sums(i) + abs(self%a(self%ku + 1 + i - j, j))
            end do
         end do
      case (kind_dense)
         do j = 1, self%n
            sums = sums + abs(self%a(:, j))
         end do
      end select
   end subroutine matrix_absolute_row_sums

   !> Row and column of the first entry that is NaN or infinite; (0,0) where there is none.
   !> Unused corners of a band are not looked at.
   pure subroutine matrix_first_not_finite(self, row, column)
      class(matrix_type), intent(in) :: self
      integer, intent(out) :: row, column
      integer :: i, j
      row = 0
      column = 0
      select case (self%kind)
      case (kind_diagonal)
         do i = 1, self%n
            if (ieee_is_finite(self%a(i, 1))) cycle
            row = i
            column = i
            return
         end do
      case (kind_banded, kind_dense)
         do j = 1, self%n
            do i = first_row(self, j), last_row(self, j)
               if (ieee_is_finite(matrix_entry(self, i, j))) cycle
               row = i
               column = j
               return
            end do
         end do
      end select
   end subroutine matrix_first_not_finite

   !> First and last row that column j may use (the diagonal where nothing else is stored)
   pure integer function first_row(self, j)
      class(matrix_type), intent(in) :: self
      integer, intent(in) :: j
      first_row = merge(1, j, self%kind == kind_dense)
      if (self%kind == kind_banded) first_row = max(1, j - self%ku)
   end function first_row

   pure integer function last_row(self, j)
      class(matrix_type), intent(in) :: self
      integer, intent(in) :: j
      last_row = merge(self%n, j, self%kind == kind_dense)
      if (self%kind == kind_banded) last_row = min(self%n, j + self%kl)
   end function last_row

   !> Storage fits the kind, entries are finite, declared symmetry holds to the last bit
   subroutine matrix_check(self, name, n, status)
      class(matrix_type), intent(in) :: self
      character(len=*), intent(in) :: name       !! of the argument, for the sentence
      integer, intent(in) :: n                   !! order that it must have
      type(status_type), intent(inout) :: status
      integer :: row, column, i, j

      if (status%failed()) return
      if (self%kind < kind_zero .or. self%kind > kind_dense) then
         call status%set(dynstep_invalid_input, name//' has the unknown kind '//text(self%kind))
      else if (self%n /= n) then
         call status%set(dynstep_invalid_input, name//' has order '//text(self%n) &
            & //', the system has '//text(n)//' coordinates')
      else if (.not. storage_fits(self)) then
         call status%set(dynstep_invalid_input, name//' has storage that does not fit its kind: ' &
            & //'diagonal a(n,1), banded a(kl+ku+1,n) with 0 <= kl, ku < n, dense a(n,n)')
      end if
      if (status%failed()) return
      call self%first_not_finite(row, column)
      if (row > 0) then
         call status%set(dynstep_invalid_input, name//'('//text(row)//','//text(column) &
            & //') is not finite')
         return
      end if
      if (.not. self%symmetric) return
      if (self%kind == kind_banded .and. self%kl /= self%ku) then
         call status%set(dynstep_invalid_input, name//' is declared symmetric with kl = ' &
            & //text(self%kl)//' and ku = '//text(self%ku))
         return
      end if
      if (self%kind < kind_banded) return
      do j = 1, n
         do i = j + 1, last_row(self, j)
            if (abs(self%entry(i, j) - self%entry(j, i)) > 0.0_wp) then
               call status%set(dynstep_invalid_input, name//' is declared symmetric, but ' &
                  & //name//'('//text(i)//','//text(j)//') = '//text(self%entry(i, j))//' and ' &
                  & //name//'('//text(j)//','//text(i)//') = '//text(self%entry(j, i)))
               return
            end if
         end do
      end do
   end subroutine matrix_check

   pure logical function storage_fits(self)
      class(matrix_type), intent(in) :: self
      storage_fits = self%kind <= kind_identity
      if (storage_fits .or. .not. allocated(self%a)) return
      select case (self%kind)
      case (kind_diagonal)
         storage_fits = all(shape(self%a) == [self%n, 1])
      case (kind_banded)
         storage_fits = self%kl >= 0 .and. self%ku >= 0 .and. self%kl < max(self%n, 1) &
            & .and. self%ku < max(self%n, 1) .and. all(shape(self%a) == [self%kl + self%ku + 1, self%n])
      case (kind_dense)
         storage_fits = all(shape(self%a) == self%n)
      end select
   end function storage_fits

   !> The zero matrix of order n, which costs nothing
   pure function zero_matrix(n) result(matrix)
      integer, intent(in) :: n
      type(matrix_type) :: matrix
      matrix%kind = kind_zero
      matrix%n = n
   end function zero_matrix

   !> The identity of order n, which costs nothing
   pure function identity_matrix(n) result(matrix)
      integer, intent(in) :: n
      type(matrix_type) :: matrix
      matrix%kind = kind_identity
      matrix%n = n
   end function identity_matrix

   !> diag(d)
   pure function diagonal_matrix(d) result(matrix)
      real(wp), intent(in) :: d(:)     !! the diagonal [n]
      type(matrix_type) :: matrix
      matrix%kind = kind_diagonal
      matrix%n = size(d)
      allocate (matrix%a(size(d), 1))
      matrix%a(:, 1) = d
   end function diagonal_matrix

   !> Matrix from LAPACK's band storage, A(i,j) = ab(ku+1+i-j, j)
   pure function banded_matrix(ab, kl, ku, symmetric) result(matrix)
      real(wp), intent(in) :: ab(:, :)         !! [kl+ku+1, n]
      integer, intent(in) :: kl, ku            !! sub- and superdiagonals
      logical, intent(in), optional :: symmetric   !! default .false.
      type(matrix_type) :: matrix
      matrix%kind = kind_banded
      matrix%n = size(ab, 2)
      matrix%kl = kl
      matrix%ku = ku
      matrix%symmetric = .false.
      if (present(symmetric)) matrix%symmetric = symmetric
      allocate (matrix%a(size(ab, 1), size(ab, 2)), source=ab)
   end function banded_matrix

   !> Matrix from all its entries
   pure function dense_matrix(a, symmetric) result(matrix)
      real(wp), intent(in) :: a(:, :)              !! [n, n]
      logical, intent(in), optional :: symmetric   !! default .false.
      type(matrix_type) :: matrix
      matrix%kind = kind_dense
      matrix%n = size(a, 1)
      matrix%symmetric = .false.
      if (present(symmetric)) matrix%symmetric = symmetric
      allocate (matrix%a(size(a, 1), size(a, 2)), source=a)
   end function dense_matrix

   !> Structure, which must be the same, and entries
   recursive subroutine matrix_archive(self, name, file)
      class(matrix_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%expect('kind', self%kind)
      call file%expect('n', self%n)
      call file%expect('kl', self%kl)
      call file%expect('ku', self%ku)
      call file%expect('symmetric', self%symmetric)
      call file%item('a', self%a)
      call file%end_section()
   end subroutine matrix_archive
end module dynstep_matrix
