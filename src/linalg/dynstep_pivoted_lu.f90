! SPDX-License-Identifier: BSD-3-Clause
!> LAPACK's LU with row interchanges of a banded or dense matrix, equilibrated where needed.
!>
!>   P R A C = L U, R and C diagonal powers of two (1 where rows and columns are alike in size)
!>
!> PROGRAMMING INTERFACE
!>
!>   call lu%init(banded, n, kl, ku, stat)                      allocates
!>   call lu%factorize(matrix, failed, weakest, ratio, empty)
!>   call lu%solve('N' or 'T', x)                               x = A^-1 x or A^-T x
!>   k = lu%equation_of(pivot)
module dynstep_pivoted_lu
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: wp
   use dynstep_lapack, only: dgbtrf, dgbtrs, dgetrf, dgetrs
   use dynstep_matrix, only: matrix_type
   use dynstep_scaling, only: row_column_scales, suspicious_pivot
   implicit none
   private

   public :: pivoted_lu_type

   type :: pivoted_lu_type
      integer :: n = 0                         !! order
      integer :: kl = 0, ku = 0                !! bandwidths
      integer :: diagonal = 0                  !! row of `factor` that holds the diagonal of U, 0 for a dense matrix
      logical :: equilibrated = .false.        !! R and C are in the factors
      real(wp), allocatable :: factor(:, :)    !! L and U: dense [n,n], banded [2kl+ku+1,n]
      integer, allocatable :: interchange(:)   !! row that was exchanged with row k [n]
      real(wp), allocatable :: r(:), c(:)      !! scales, see dynstep_scaling [n]
   contains
      procedure :: init => lu_init
      procedure :: factorize => lu_factorize
      procedure :: solve => lu_solve
      procedure :: equation_of => lu_equation_of
      procedure :: archive => lu_archive
   end type pivoted_lu_type

contains

   !> Allocate for a structure
   pure subroutine lu_init(self, banded, n, kl, ku, stat)
      class(pivoted_lu_type), intent(inout) :: self
      logical, intent(in) :: banded
      integer, intent(in) :: n                 !! order
      integer, intent(in) :: kl, ku            !! bandwidths, n - 1 for a dense matrix
      integer, intent(out) :: stat             !! not 0: no memory
      integer :: rows

      self%n = n
      self%kl = kl
      self%ku = ku
      self%diagonal = merge(kl + ku + 1, 0, banded)
      rows = merge(2*kl + ku + 1, n, banded)
      if (allocated(self%factor)) deallocate (self%factor, self%interchange, self%r, self%c)
      allocate (self%factor(rows, n), self%interchange(n), self%r(n), self%c(n), stat=stat)
   end subroutine lu_init

   !> Scale, copy, factorize, and look at the pivots
   pure subroutine lu_factorize(self, matrix, failed, weakest, ratio, empty)
      class(pivoted_lu_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix  !! finite, of the structure given to init
      integer, intent(out) :: failed           !! first pivot that is zero, or 0
      integer, intent(out) :: weakest          !! the smallest suspicious pivot, or 0
      real(wp), intent(out) :: ratio           !! its size in R A C
      integer, intent(out) :: empty            !! i > 0: row i is zero, j < 0: column -j is zero
      real(wp) :: size_of_pivot, unit
      integer :: k, d

      failed = 0
      weakest = 0
      ratio = suspicious_pivot
      call row_column_scales(matrix, self%r, self%c, self%equilibrated, empty)
      if (empty /= 0) return
      d = self%diagonal
      if (d > 0) then
         call fill_band(self, matrix)
         call dgbtrf(self%n, self%n, self%kl, self%ku, self%factor, size(self%factor, 1), self%interchange, failed)
      else
         call fill_dense(self, matrix)
         call dgetrf(self%n, self%n, self%factor, self%n, self%interchange, failed)
      end if
      unit = factor_unit(self)
      do k = 1, self%n
         size_of_pivot = abs(self%factor(merge(d, k, d > 0), k))*unit
         if (size_of_pivot < ratio) then
            weakest = k
            ratio = size_of_pivot
         end if
      end do
   end subroutine lu_factorize

   !> What brings the entries of `factor` to the size of those of R A C
   pure real(wp) function factor_unit(self)
      class(pivoted_lu_type), intent(in) :: self
      factor_unit = 1.0_wp
      if (.not. self%equilibrated) factor_unit = self%r(1)*self%c(1)
   end function factor_unit

   pure subroutine fill_dense(self, matrix)
      class(pivoted_lu_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      integer :: j
      if (self%equilibrated) then
         do j = 1, self%n
            self%factor(:, j) = self%r*matrix%a(:, j)*self%c(j)
         end do
      else
         self%factor = matrix%a
      end if
   end subroutine fill_dense

   pure subroutine fill_band(self, matrix)
      class(pivoted_lu_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      integer :: i, j, up, down
      up = self%ku + 1
      down = self%diagonal
      do j = 1, self%n
         self%factor(:, j) = 0.0_wp
         if (self%equilibrated) then
            do i = max(1, j - self%ku), min(self%n, j + self%kl)
               self%factor(down + i - j, j) = self%r(i)*matrix%a(up + i - j, j)*self%c(j)
            end do
         else
            do i = max(1, j - self%ku), min(self%n, j + self%kl)
               self%factor(down + i - j, j) = matrix%a(up + i - j, j)
            end do
         end if
      end do
   end subroutine fill_band

   !> x = A^-1 x or A^-T x
   pure subroutine lu_solve(self, trans, x)
      class(pivoted_lu_type), intent(in) :: self
      character(len=1), intent(in) :: trans    !! 'N', or 'T' for the transposed matrix
      real(wp), intent(inout) :: x(self%n)     !! right side in, solution out
      integer :: info

      if (self%equilibrated) call multiply(self, trans == 'N', x)
      if (self%diagonal > 0) then
         call dgbtrs(trans, self%n, self%kl, self%ku, 1, self%factor, size(self%factor, 1), &
            & self%interchange, x, self%n, info)
      else
         call dgetrs(trans, self%n, 1, self%factor, self%n, self%interchange, x, self%n, info)
      end if
      if (self%equilibrated) call multiply(self, trans /= 'N', x)
   end subroutine lu_solve

   !> x = R x or C x
   pure subroutine multiply(self, rows, x)
      class(pivoted_lu_type), intent(in) :: self
      logical, intent(in) :: rows
      real(wp), intent(inout) :: x(self%n)
      if (rows) then
         x = self%r*x
      else
         x = self%c*x
      end if
   end subroutine multiply

   !> Equation (row of A) that a vanished pivot belongs to.  Where the whole row of U vanished,
   !> it is the row of A that came to stand there; where only the column did, so that some
   !> row had to take its place, it is the equation of the coordinate of that column.
   pure integer function lu_equation_of(self, k)
      class(pivoted_lu_type), intent(in) :: self
      integer, intent(in) :: k                 !! pivot
      real(wp), parameter :: noise = 1.0e-10_wp
      real(wp) :: largest
      integer :: j

      largest = 0.0_wp
      if (self%diagonal > 0) then
         do j = k + 1, min(self%n, k + self%kl + self%ku)
            largest = max(largest, abs(self%factor(self%diagonal + k - j, j)))
         end do
      else
         do j = k + 1, self%n
            largest = max(largest, abs(self%factor(k, j)))
         end do
      end if
      lu_equation_of = k
      if (largest*factor_unit(self) > noise) return
      lu_equation_of = self%interchange(k)
      do j = k - 1, 1, -1
         if (lu_equation_of == j) then
            lu_equation_of = self%interchange(j)
         else if (lu_equation_of == self%interchange(j)) then
            lu_equation_of = j
         end if
      end do
   end function lu_equation_of

   !> Factors, interchanges and scales, where there are some
   recursive subroutine lu_archive(self, name, file)
      class(pivoted_lu_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('n', self%n)
      call file%item('kl', self%kl)
      call file%item('ku', self%ku)
      call file%item('diagonal', self%diagonal)
      call file%item('equilibrated', self%equilibrated)
      call file%item('factor', self%factor)
      call file%item('interchange', self%interchange)
      call file%item('r', self%r)
      call file%item('c', self%c)
      call file%end_section()
   end subroutine lu_archive
end module dynstep_pivoted_lu
