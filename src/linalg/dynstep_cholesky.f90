! SPDX-License-Identifier: BSD-3-Clause
!> LAPACK's Cholesky factorization of a banded or dense matrix, A = L L^T.
!>
!> PROGRAMMING INTERFACE
!>
!>   call cholesky%init(banded, n, kd, stat)                       allocates
!>   call cholesky%factorize(matrix, failed, weakest, ratio)       reads the lower triangle
!>   call cholesky%solve(x)                                        x = A^-1 x
module dynstep_cholesky
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: wp
   use dynstep_lapack, only: dpbtrf, dpbtrs, dpotrf, dpotrs
   use dynstep_matrix, only: matrix_type
   use dynstep_scaling, only: suspicious_pivot
   implicit none
   private

   public :: cholesky_type

   type :: cholesky_type
      integer :: n = 0                         !! order
      integer :: kd = 0                        !! subdiagonals
      logical :: banded = .false.
      real(wp), allocatable :: factor(:, :)    !! L: dense [n,n], banded [kd+1,n]
   contains
      procedure :: init => cholesky_init
      procedure :: factorize => cholesky_factorize
      procedure :: solve => cholesky_solve
      procedure :: archive => cholesky_archive
   end type cholesky_type

contains

   !> Allocate for a structure
   pure subroutine cholesky_init(self, banded, n, kd, stat)
      class(cholesky_type), intent(inout) :: self
      logical, intent(in) :: banded
      integer, intent(in) :: n                 !! order
      integer, intent(in) :: kd                !! subdiagonals
      integer, intent(out) :: stat             !! not 0: no memory

      self%banded = banded
      self%n = n
      self%kd = kd
      if (allocated(self%factor)) deallocate (self%factor)
      allocate (self%factor(merge(kd + 1, n, banded), n), stat=stat)
   end subroutine cholesky_init

   !> Copy, factorize, and look at the pivots
   pure subroutine cholesky_factorize(self, matrix, failed, weakest, ratio)
      class(cholesky_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix  !! finite, of the structure given to init
      integer, intent(out) :: failed           !! first pivot that is not positive, or 0
      integer, intent(out) :: weakest          !! the smallest suspicious pivot, or 0
      real(wp), intent(out) :: ratio           !! that pivot / A(k,k)
      real(wp) :: l, d
      integer :: j

      weakest = 0
      ratio = suspicious_pivot
      if (self%banded) then
         do j = 1, self%n
            self%factor(:, j) = matrix%a(self%kd + 1:2*self%kd + 1, j)
         end do
         call dpbtrf('L', self%n, self%kd, self%factor, self%kd + 1, failed)
      else
         self%factor = matrix%a
         call dpotrf('L', self%n, self%factor, self%n, failed)
      end if
      if (failed > 0) return
      do j = 1, self%n
         if (self%banded) then
            l = self%factor(1, j)
            d = matrix%a(self%kd + 1, j)
         else
            l = self%factor(j, j)
            d = matrix%a(j, j)
         end if
         if (l*l < ratio*d) then
            weakest = j
            ratio = l*l/d
         end if
      end do
   end subroutine cholesky_factorize

   !> x = A^-1 x
   pure subroutine cholesky_solve(self, x)
      class(cholesky_type), intent(in) :: self
      real(wp), intent(inout) :: x(self%n)     !! right side in, solution out
      integer :: info
      if (self%banded) then
         call dpbtrs('L', self%n, self%kd, 1, self%factor, self%kd + 1, x, self%n, info)
      else
         call dpotrs('L', self%n, 1, self%factor, self%n, x, self%n, info)
      end if
   end subroutine cholesky_solve

   !> The factor, where there is one
   recursive subroutine cholesky_archive(self, name, file)
      class(cholesky_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('n', self%n)
      call file%item('kd', self%kd)
      call file%item('banded', self%banded)
      call file%item('factor', self%factor)
      call file%end_section()
   end subroutine cholesky_archive
end module dynstep_cholesky
