! SPDX-License-Identifier: BSD-3-Clause
!> The load of a linear system, and the source of a linear equation of first order, at one time, checked.
module dynstep_linear_load
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: check_callback
   use dynstep_kinds, only: wp
   use dynstep_linear_ode, only: linear_ode
   use dynstep_linear_system, only: linear_system, load_none, load_samples
   use dynstep_status, only: dynstep_not_finite, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   public :: evaluate_load, evaluate_source

contains

   !> p(t), checked; nothing where there is no load
   recursive subroutine evaluate_load(sys, n, t, p, status, count)
      class(linear_system), intent(inout) :: sys
      integer, intent(in) :: n
      real(wp), intent(in) :: t
      real(wp), intent(inout) :: p(n)
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      integer :: ierr

      if (status%failed() .or. sys%load_kind == load_none) return
      count%forces = count%forces + 1
      if (sys%load_kind == load_samples) then
         call sys%table%evaluate(t, p)
      else
         call sys%load(t, p, ierr)
         call check_callback('load', ierr, t, status)
         if (status%failed()) return
      end if
      call check_values('load', t, p, status)
   end subroutine evaluate_load

   !> b(t), checked; nothing where there is no source
   recursive subroutine evaluate_source(sys, n, t, b, status, count)
      class(linear_ode), intent(inout) :: sys
      integer, intent(in) :: n
      real(wp), intent(in) :: t
      real(wp), intent(inout) :: b(n)
      type(status_type), intent(inout) :: status
      type(step_counters), intent(inout) :: count
      integer :: ierr

      if (status%failed() .or. sys%source_kind == load_none) return
      count%forces = count%forces + 1
      call sys%source(t, b, ierr)
      call check_callback('source', ierr, t, status)
      if (.not. status%failed()) call check_values('source', t, b, status)
   end subroutine evaluate_source

   recursive subroutine check_values(name, t, p, status)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: t
      real(wp), intent(in), contiguous :: p(:)
      type(status_type), intent(inout) :: status
      integer :: i
      if (count_bad(p) == 0) return
      do i = 1, size(p) - 1
         if (.not. ieee_is_finite(p(i))) exit
      end do
      call status%set(dynstep_not_finite, name//' returned '//text(p(i))//' in component '//text(i) &
         & //' at t = '//text(t)//'; a smaller step may keep it in its domain', retry=.true.)
   end subroutine check_values

   pure integer function count_bad(p)
      real(wp), intent(in), contiguous :: p(:)
      integer :: i
      count_bad = 0
      do i = 1, size(p)
         if (.not. ieee_is_finite(p(i))) count_bad = count_bad + 1
      end do
   end function count_bad
end module dynstep_linear_load
