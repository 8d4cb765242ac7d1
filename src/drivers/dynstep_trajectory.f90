! SPDX-License-Identifier: BSD-3-Clause
!> Where the points of a run go.
!>
!>   recorder_type      what a driver calls for each point that is to be kept; extend it to
!>                      write to a file, a plot, a caller's buffer
!>   trajectory_type    keeps the points in arrays that grow
module dynstep_trajectory
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_stepper, only: state_type
   use dynstep_text, only: text
   implicit none
   private

   type, abstract, public :: recorder_type
   contains
      procedure(record_interface), deferred :: record
      procedure :: record_inner => leave_inner_out
   end type recorder_type

   abstract interface
      !> Keep one point; a failed status ends the run
      recursive subroutine record_interface(self, state, status)
         import :: recorder_type, state_type, status_type
         class(recorder_type), intent(inout) :: self
         type(state_type), intent(in) :: state
         type(status_type), intent(inout) :: status
      end subroutine record_interface
   end interface

   type, extends(recorder_type), public :: trajectory_type
      integer :: count = 0                !! points kept; the arrays may be longer
      real(wp), allocatable :: t(:)       !! [count] times
      real(wp), allocatable :: y(:, :)    !! [state_size, count] states, [q; v] in mechanics
      real(wp), allocatable :: a(:, :)    !! [n, count] accelerations, or y' [state_size, count]
      real(wp), allocatable :: lambda(:, :)   !! [m, count] multipliers of g = 0, [0, count] without constraints
      real(wp), allocatable :: psi(:, :)      !! [p, count] multipliers of k = 0
   contains
      procedure :: record => trajectory_record
      procedure :: reserve => trajectory_reserve
   end type trajectory_type

contains

   !> A point inside a step, through which the motion is interpolated (runs with keeps_nodes); the end of the step follows.
   !> Recorders that keep none leave it out.
   recursive subroutine leave_inner_out(self, state, status)
      class(recorder_type), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
   end subroutine leave_inner_out

   recursive subroutine trajectory_record(self, state, status)
      class(trajectory_type), intent(inout) :: self
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      integer :: room
      if (status%failed()) return
      room = 0
      if (allocated(self%t)) room = size(self%t)
      if (self%count >= room) then
         call self%reserve(max(64, 2*room), size(state%y), size(state%a), status, size(state%lambda), size(state%psi))
      else if (self%count == 0) then
         ! room that was made before, perhaps without multipliers
         if (size(self%lambda, 1) /= size(state%lambda) .or. size(self%psi, 1) /= size(state%psi)) &
            & call self%reserve(room, size(state%y), size(state%a), status, size(state%lambda), size(state%psi))
      end if
      if (status%failed()) return
      self%count = self%count + 1
      self%t(self%count) = state%t
      self%y(:, self%count) = state%y
      self%a(:, self%count) = state%a
      if (size(state%lambda) > 0) self%lambda(:, self%count) = state%lambda
      if (size(state%psi) > 0) self%psi(:, self%count) = state%psi
   end subroutine trajectory_record

   !> Room for `points` points in all, so that recording them allocates nothing
   recursive subroutine trajectory_reserve(self, points, state_size, n, status, m, p)
      class(trajectory_type), intent(inout) :: self
      integer, intent(in) :: points, state_size, n
      type(status_type), intent(inout) :: status
      integer, intent(in), optional :: m, p           !! constraints g and k of the system, 0 by default
      real(wp), allocatable :: t(:), y(:, :), a(:, :), lambda(:, :), psi(:, :)
      integer :: stat, holonomic, nonholonomic
      if (status%failed()) return
      holonomic = 0
      nonholonomic = 0
      if (present(m)) holonomic = m
      if (present(p)) nonholonomic = p
      allocate (t(points), y(state_size, points), a(n, points), lambda(holonomic, points), psi(nonholonomic, points), &
         & stat=stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for '//text(points)//' points of ' &
            & //text(state_size + n + holonomic + nonholonomic)//' numbers; record every k-th step only')
         return
      end if
      if (self%count > 0) then
         t(:self%count) = self%t(:self%count)
         y(:, :self%count) = self%y(:, :self%count)
         a(:, :self%count) = self%a(:, :self%count)
         lambda(:, :self%count) = self%lambda(:, :self%count)
         psi(:, :self%count) = self%psi(:, :self%count)
      end if
      call move_alloc(t, self%t)
      call move_alloc(y, self%y)
      call move_alloc(a, self%a)
      call move_alloc(lambda, self%lambda)
      call move_alloc(psi, self%psi)
   end subroutine trajectory_reserve
end module dynstep_trajectory
