! SPDX-License-Identifier: BSD-3-Clause
!> Points of a run, written straight into the caller's arrays.
!>
!> A call of `proceed` has room for so many points.  The run tells how many steps may be made so that they fit.  Where
!> many times t_eval lie inside one step they may not: the rest waits, and `deliver` brings it with the next call, so
!> that no point is lost.  Multipliers are kept here for those points that were written last, and the caller may ask for
!> them.
module dynstep_c_points
   use dynstep_kinds, only: long, wp
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_stepper, only: state_type
   use dynstep_text, only: text
   use dynstep_trajectory, only: recorder_type, trajectory_type
   implicit none
   private

   type, extends(recorder_type), public :: point_buffer
      integer :: n = 0                                      !! coordinates, or unknowns of a first-order system
      integer :: capacity = 0                               !! points for which there is room
      integer :: count = 0                                  !! points written since `deliver`
      integer(long) :: total = 0                            !! points recorded since `clear`
      real(wp), pointer, contiguous :: t(:) => null()       !! [capacity], or null: not wanted
      real(wp), pointer, contiguous :: q(:, :) => null()    !! [n, capacity], or null
      real(wp), pointer, contiguous :: v(:, :) => null()    !! always null where there are no velocities
      real(wp), pointer, contiguous :: a(:, :) => null()
      real(wp), allocatable :: lambda(:, :)                 !! [m, capacity or more] of those points; m, p as in
      real(wp), allocatable :: psi(:, :)                    !! [p, capacity or more]  `reserve`
      type(trajectory_type), private :: waiting             ! points that found no room
      integer, private :: delivered = 0                     ! how many of them have been handed over
   contains
      procedure :: reserve => buffer_reserve
      procedure :: record => buffer_record
      procedure :: clear => buffer_clear
      procedure :: deliver => buffer_deliver
      procedure :: holds_back => buffer_holds_back
   end type point_buffer

contains

   !> Room for the multipliers of `capacity` points; no work where there is room, or m = p = 0
   recursive subroutine buffer_reserve(self, m, p, status)
      class(point_buffer), intent(inout) :: self
      integer, intent(in) :: m, p
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      if (allocated(self%lambda) .and. allocated(self%psi)) then
         if (all([size(self%lambda, 1), size(self%psi, 1)] == [m, p]) .and. (m + p == 0 .or. &
            & size(self%lambda, 2) >= self%capacity)) return
         deallocate (self%lambda, self%psi)
      end if
      allocate (self%lambda(m, self%capacity), self%psi(p, self%capacity), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the multipliers of '//text(self%capacity) &
         & //' points; call with a smaller capacity')
   end subroutine buffer_reserve

   recursive subroutine buffer_record(self, state, status)
      class(point_buffer), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      self%total = self%total + 1
      if (self%count < self%capacity) then
         call write_point(self, state%t, state%y, state%a, state%lambda, state%psi)
      else
         call self%waiting%record(state, status)
      end if
   end subroutine buffer_record

   recursive subroutine write_point(self, t, y, a, lambda, psi)
      class(point_buffer), intent(inout) :: self
      real(wp), intent(in) :: t, y(:), a(:), lambda(:), psi(:)
      self%count = self%count + 1
      if (associated(self%t)) self%t(self%count) = t
      if (associated(self%q)) self%q(:, self%count) = y(:self%n)
      if (associated(self%v)) self%v(:, self%count) = y(self%n + 1:)
      if (associated(self%a)) self%a(:, self%count) = a
      if (size(lambda) > 0) self%lambda(:, self%count) = lambda
      if (size(psi) > 0) self%psi(:, self%count) = psi
   end subroutine write_point

   !> Forget what waits and what was written; a new run begins
   recursive subroutine buffer_clear(self)
      class(point_buffer), intent(inout) :: self
      self%count = 0
      self%total = 0
      self%waiting%count = 0
      self%delivered = 0
   end subroutine buffer_clear

   !> Points that wait, as many as there is room for
   recursive subroutine buffer_deliver(self)
      class(point_buffer), intent(inout) :: self
      self%count = 0
      associate (w => self%waiting)
         do while (self%delivered < w%count .and. self%count < self%capacity)
            self%delivered = self%delivered + 1
            call write_point(self, w%t(self%delivered), w%y(:, self%delivered), w%a(:, self%delivered), &
               & w%lambda(:, self%delivered), w%psi(:, self%delivered))
         end do
         if (self%delivered < w%count) return
         w%count = 0
         self%delivered = 0
      end associate
   end subroutine buffer_deliver

   !> True where points wait
   pure logical function buffer_holds_back(self)
      class(point_buffer), intent(in) :: self
      buffer_holds_back = self%waiting%count > 0
   end function buffer_holds_back
end module dynstep_c_points
