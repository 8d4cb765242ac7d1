! SPDX-License-Identifier: BSD-3-Clause
!> Points of a run, written straight into the caller's arrays.
!>
!> A call of `proceed` has room for so many points.  The run tells how many steps may be made so that they fit.  Where
!> many times t_eval or nodes lie inside one step they may not: the rest waits, and `deliver` brings it with the next call, so
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

   !> Nodes in a step of order 12 or less, for a first guess
   integer, parameter :: usual_nodes = 4

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
      logical, allocatable :: is_inner(:)                   !! [capacity or more] of those points, where nodes are recorded
      type(trajectory_type), private :: waiting             ! points that found no room
      logical, allocatable, private :: waits_inner(:)       ! [waiting%count or more]
      logical, private :: is_dense = .false.                ! nodes are recorded
      integer, private :: run_of_nodes = 0                  ! since the last end of a step
      integer, private :: most_nodes = usual_nodes          ! in one step of this run
      integer, private :: delivered = 0                     ! how many of them have been handed over
   contains
      procedure :: reserve => buffer_reserve
      procedure :: record => buffer_record
      procedure :: record_inner => buffer_record_inner
      procedure :: room_for_ends => buffer_room_for_ends
      procedure :: clear => buffer_clear
      procedure :: deliver => buffer_deliver
      procedure :: holds_back => buffer_holds_back
   end type point_buffer

contains

   !> Room for the multipliers and kinds of `capacity` points; no work where there is room, or none is needed
   recursive subroutine buffer_reserve(self, m, p, is_dense, status)
      class(point_buffer), intent(inout) :: self
      integer, intent(in) :: m, p
      logical, intent(in) :: is_dense                       !! points inside steps are recorded, too
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      self%is_dense = is_dense
      if (is_dense) call reserve_kinds(self%is_inner, 0, self%capacity, status)
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
      self%most_nodes = max(self%most_nodes, self%run_of_nodes)
      self%run_of_nodes = 0
      call take(self, state, .false., status)
   end subroutine buffer_record

   recursive subroutine buffer_record_inner(self, state, status)
      class(point_buffer), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      self%run_of_nodes = self%run_of_nodes + 1
      call take(self, state, .true., status)
   end subroutine buffer_record_inner

   !> A point, to the caller or to those that wait
   recursive subroutine take(self, state, inner, status)
      class(point_buffer), intent(inout) :: self
      type(state_type), intent(in) :: state
      logical, intent(in) :: inner
      type(status_type), intent(inout) :: status
      if (self%count < self%capacity) then
         call write_point(self, inner, state%t, state%y, state%a, state%lambda, state%psi)
         return
      end if
      call self%waiting%record(state, status)
      if (.not. self%is_dense .or. status%failed()) return
      call reserve_kinds(self%waits_inner, self%waiting%count - 1, size(self%waiting%t), status)
      if (.not. status%failed()) self%waits_inner(self%waiting%count) = inner
   end subroutine take

   !> Room for `length` kinds, the first `count` of which are kept
   recursive subroutine reserve_kinds(kinds, count, length, status)
      logical, allocatable, intent(inout) :: kinds(:)
      integer, intent(in) :: count, length
      type(status_type), intent(inout) :: status
      logical, allocatable :: longer(:)
      integer :: stat
      if (allocated(kinds)) then
         if (size(kinds) >= length) return
      end if
      allocate (longer(length), stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for the kinds of '//text(length)//' points; call with a smaller capacity')
         return
      end if
      if (count > 0) longer(:count) = kinds(:count)
      call move_alloc(longer, kinds)
   end subroutine reserve_kinds

   !> Ends of steps for which there is room, 1 or more: as many nodes come before each as before any other one of this run
   pure integer(long) function buffer_room_for_ends(self)
      class(point_buffer), intent(in) :: self
      buffer_room_for_ends = self%capacity - self%count
      if (self%is_dense) buffer_room_for_ends = max(1_long, buffer_room_for_ends/(1 + self%most_nodes))
   end function buffer_room_for_ends

   recursive subroutine write_point(self, inner, t, y, a, lambda, psi)
      class(point_buffer), intent(inout) :: self
      logical, intent(in) :: inner
      real(wp), intent(in) :: t, y(:), a(:), lambda(:), psi(:)
      self%count = self%count + 1
      if (self%is_dense) self%is_inner(self%count) = inner
      if (associated(self%t)) self%t(self%count) = t
      if (associated(self%q)) self%q(:, self%count) = y(:self%n)
      if (associated(self%v)) self%v(:, self%count) = y(self%n + 1:)
      if (associated(self%a)) self%a(:, self%count) = a
      if (size(lambda) > 0) self%lambda(:, self%count) = lambda
      if (size(psi) > 0) self%psi(:, self%count) = psi
   end subroutine write_point

   !> Forget what waits and what was written; a new run begins, or one goes on behind `before` points
   recursive subroutine buffer_clear(self, before)
      class(point_buffer), intent(inout) :: self
      integer(long), intent(in), optional :: before
      self%count = 0
      self%total = 0
      if (present(before)) self%total = before
      self%run_of_nodes = 0
      self%most_nodes = usual_nodes
      self%waiting%count = 0
      self%delivered = 0
   end subroutine buffer_clear

   !> Points that wait, as many as there is room for
   recursive subroutine buffer_deliver(self)
      class(point_buffer), intent(inout) :: self
      logical :: inner
      self%count = 0
      associate (w => self%waiting)
         do while (self%delivered < w%count .and. self%count < self%capacity)
            self%delivered = self%delivered + 1
            inner = .false.
            if (self%is_dense) inner = self%waits_inner(self%delivered)
            call write_point(self, inner, w%t(self%delivered), w%y(:, self%delivered), w%a(:, self%delivered), &
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
