! SPDX-License-Identifier: BSD-3-Clause
!> Loads given by samples: p(t) = B s(t), s piecewise linear between its samples.
!>
!> A ground motion is one sampled signal and the pattern B = -M e (e: the coordinates that
!> move with the ground); measured forces are a signal for each coordinate and no pattern.
!> The signal has a kink at each sample: a step that ends on samples keeps the order of the
!> method, a step across a sample does not.
module dynstep_load_table
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: load_table_type

   integer, parameter, public :: outside_zero = 0   !! no load before the first and after the last sample
   integer, parameter, public :: outside_hold = 1   !! the first and the last sample go on

   !> How far, in sampling intervals, a time may lie outside the table by rounding
   real(wp), parameter :: rounding = 1.0e-6_wp

   type :: load_table_type
      real(wp) :: t0 = 0.0_wp                    !! time of the first sample
      real(wp) :: dt = 0.0_wp                    !! sampling interval > 0; read where `times` is not given
      real(wp), allocatable :: times(:)          !! [ns] increasing, or not allocated
      real(wp), allocatable :: samples(:, :)     !! [signals, ns]
      real(wp), allocatable :: pattern(:, :)     !! B [n, signals], or not allocated: the identity
      integer :: outside = outside_zero          !! outside_zero or outside_hold
   contains
      procedure :: check => table_check
      procedure :: evaluate => table_evaluate
   end type load_table_type

contains

   !> Shapes fit a system of n coordinates, times increase, values are finite
   subroutine table_check(self, n, status)
      class(load_table_type), intent(in) :: self
      integer, intent(in) :: n
      type(status_type), intent(inout) :: status
      integer :: i

      if (status%failed()) return
      if (.not. allocated(self%samples)) then
         call refuse('has no samples')
      else if (size(self%samples, 2) < 2) then
         call refuse('needs at least two samples')
      else if (.not. all(ieee_is_finite(self%samples))) then
         call refuse('has a sample that is not finite: sample ' &
            & //text(first_bad_sample(self%samples)))
      else if (self%outside /= outside_zero .and. self%outside /= outside_hold) then
         call refuse('has the unknown rule '//text(self%outside)//' for times outside it')
      else if (allocated(self%pattern)) then
         if (size(self%pattern, 1) /= n .or. size(self%pattern, 2) /= size(self%samples, 1)) then
            call refuse('has a pattern of shape ('//text(size(self%pattern, 1))//', ' &
               & //text(size(self%pattern, 2))//'), expected ('//text(n)//', ' &
               & //text(size(self%samples, 1))//')')
         else if (.not. all(ieee_is_finite(self%pattern))) then
            call refuse('has a pattern with an entry that is not finite')
         end if
      else if (size(self%samples, 1) /= n) then
         call refuse('has '//text(size(self%samples, 1))//' signals for '//text(n) &
            & //' coordinates and no pattern')
      end if
      if (status%failed()) return
      if (.not. allocated(self%times)) then
         if (.not. (ieee_is_finite(self%dt) .and. ieee_is_finite(self%t0))) then
            call refuse('needs a finite t0 and a finite dt > 0')
         else if (self%dt <= 0.0_wp) then
            call refuse('needs dt > 0, not '//text(self%dt))
         end if
         return
      end if
      if (size(self%times) /= size(self%samples, 2)) then
         call refuse('has '//text(size(self%times))//' times for ' &
            & //text(size(self%samples, 2))//' samples')
         return
      end if
      do i = 1, size(self%times)
         if (.not. ieee_is_finite(self%times(i))) then
            call refuse('has a time that is not finite: number '//text(i))
            return
         end if
         if (i == 1) cycle
         if (self%times(i) > self%times(i - 1)) cycle
         call refuse('has times that do not increase at number '//text(i))
         return
      end do

   contains

      subroutine refuse(what)
         character(len=*), intent(in) :: what
         call status%set(dynstep_invalid_input, 'the load table '//what)
      end subroutine refuse
   end subroutine table_check

   pure integer function first_bad_sample(samples)
      real(wp), intent(in) :: samples(:, :)
      do first_bad_sample = 1, size(samples, 2) - 1
         if (.not. all(ieee_is_finite(samples(:, first_bad_sample)))) return
      end do
   end function first_bad_sample

   !> p = B s(t)
   pure subroutine table_evaluate(self, t, p)
      class(load_table_type), intent(in) :: self
      real(wp), intent(in) :: t
      real(wp), intent(out) :: p(:)     !! [n]
      integer :: i, j
      real(wp) :: fraction, s

      call locate(self, t, i, fraction)
      p = 0.0_wp
      if (i == 0) return
      do j = 1, size(self%samples, 1)
         s = self%samples(j, i) + fraction*(self%samples(j, i + 1) - self%samples(j, i))
         if (allocated(self%pattern)) then
            p = p + s*self%pattern(:, j)
         else
            p(j) = s
         end if
      end do
   end subroutine table_evaluate

   !> Interval i and the place in it, 0 <= fraction <= 1; i = 0 where there is no load
   pure subroutine locate(self, t, i, fraction)
      class(load_table_type), intent(in) :: self
      real(wp), intent(in) :: t
      integer, intent(out) :: i
      real(wp), intent(out) :: fraction
      integer :: ns, low, high, middle
      real(wp) :: x

      ns = size(self%samples, 2)
      if (allocated(self%times)) then
         low = 1
         high = ns
         do while (high - low > 1)
            middle = (low + high)/2
            if (t < self%times(middle)) then
               high = middle
            else
               low = middle
            end if
         end do
         x = low - 1 + (t - self%times(low))/(self%times(low + 1) - self%times(low))
      else
         x = (t - self%t0)/self%dt
      end if
      i = 0
      fraction = 0.0_wp
      if (self%outside == outside_zero .and. (x < -rounding .or. x > ns - 1 + rounding)) return
      x = min(max(x, 0.0_wp), real(ns - 1, wp))
      i = min(int(x), ns - 2) + 1
      fraction = x - (i - 1)
   end subroutine locate
end module dynstep_load_table
