! SPDX-License-Identifier: BSD-3-Clause
!> Broyden's method for G(x) = 0 that remembers nothing but its own steps (C. T. Kelley, Iterative Methods for Linear
!> and Nonlinear Equations, SIAM 1995, section 7.3).
!>
!> B_{k+1} = B_k + (dG - B_k s) s'/(s's) makes B s = dG.  Its inverse is
!>
!>   B_{k+1}^-1 = B_k^-1 + (s - B_k^-1 dG) s' B_k^-1/(s' B_k^-1 dG) = (I + s_{k+1} s_k'/(s_k's_k)) B_k^-1
!>
!> where s_k are full steps, so that the steps themselves are the whole of B^-1 but for B_0^-1, which the caller applies.
!> (The update B^-1 + (dG - B^-1 s) s' of Xie 1995, chapter 6, has s and dG in each other's place.)
!>
!> PROGRAMMING INTERFACE
!>
!>   call b%init(n, most, status)        room for `most` steps
!>   call b%forget()                     B = B_0: at the start, and after a step that was not taken in full
!>   call b%next(z)                      z = -B_0^-1 G(x) becomes the step to take, which is remembered
!>
!> With no room left, or where the next B would be nearly singular, the method starts again from B_0.
module dynstep_broyden
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   type, public :: broyden_type
      integer :: count = 0                           !! steps that are remembered
      real(wp), allocatable, private :: s(:, :)      ! steps [n, most]
      real(wp), allocatable, private :: length(:)    ! their Euclidean norms [most]
   contains
      procedure :: init => broyden_init
      procedure :: forget => broyden_forget
      procedure :: next => broyden_next
   end type broyden_type

   !> 1 - s'z/s's is 0 where B_{k+1} is singular; a step that this makes ten times as long is not trusted
   real(wp), parameter :: least_divisor = 0.1_wp

contains

   pure subroutine broyden_init(self, n, most, status)
      class(broyden_type), intent(inout) :: self
      integer, intent(in) :: n                       !! unknowns
      integer, intent(in) :: most                    !! steps, >= 1
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      if (allocated(self%s)) deallocate (self%s, self%length)
      allocate (self%s(n, most), self%length(most), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for '//text(most)//' steps of '//text(n)//' unknowns')
      self%count = 0
   end subroutine broyden_init

   pure subroutine broyden_forget(self)
      class(broyden_type), intent(inout) :: self
      self%count = 0
   end subroutine broyden_forget

   !> From -B_0^-1 G at the point that the last step led to, the next step
   pure subroutine broyden_next(self, z)
      class(broyden_type), intent(inout) :: self
      real(wp), intent(inout) :: z(:)                !! [n]; no larger than the root of huge()
      real(wp) :: divisor
      integer :: j

      if (self%count == size(self%length)) self%count = 0
      if (self%count > 0) then
         associate (m => self%count, s => self%s, length => self%length)
            ! column m + 1 is free: z is kept there for a new start
            s(:, m + 1) = z
            do j = 1, m - 1
               z = z + s(:, j + 1)*(dot_product(s(:, j)/length(j), z)/length(j))
            end do
            divisor = 1.0_wp - dot_product(s(:, m)/length(m), z)/length(m)
            if (abs(divisor) >= least_divisor) then
               z = z/divisor
            else
               z = s(:, m + 1)
               self%count = 0
            end if
         end associate
      end if
      self%s(:, self%count + 1) = z
      self%length(self%count + 1) = norm2(z)
      ! a step of no length at all teaches nothing
      if (self%length(self%count + 1) > sqrt(tiny(1.0_wp))) then
         self%count = self%count + 1
      else
         self%count = 0
      end if
   end subroutine broyden_next
end module dynstep_broyden
