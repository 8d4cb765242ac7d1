! SPDX-License-Identifier: BSD-3-Clause
!> First or second derivative of a vector function f(s) at s = 0 by extrapolated differences
!> (C. J. F. Ridders, Adv. Eng. Software 4 (1982) 75-76): a Neville table of central differences with
!> the steps s1, s1/2, s1/3, s1/4, s1/6, s1/8, ..., nearly, of which each component keeps the entry of the smallest error.  Its
!> first two levels are the four-point difference  (f(-2d) - 8 f(-d) + 8 f(d) - f(2d))/(12 d).
!>
!> A step that turns out too long (the table does not settle) or too short (rounding) starts the table
!> again with another one.  At the edge of the domain of f the differences become one-sided.
!>
!> The caller evaluates its own function, so that no procedure is passed:
!>
!>     call d%resize(m)
!>     call d%begin(order, step, unit, four_points=.true.)
!>     do while (d%is_running)
!>        s = d%point()
!>        (d%f = f(s), ierr)
!>        call d%give(ierr)
!>     end do
!>     (d%ierr tells, d%value is the derivative)
module dynstep_line_derivative
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   implicit none
   private

   integer, parameter :: levels = 10
   !> Steps of a table.  Halving alone would take a fast oscillation for a slow one, as the phase of its
   !> step, less full turns, is halved too; with these a whole number of turns in the first step is not
   !> one in all.  They have few bits: x + s is exact most of the time.
   real(wp), parameter :: sequence(levels) = [1.0_wp, 0.5_wp, 0.34375_wp, 0.25_wp, 0.171875_wp, 0.125_wp, 0.0859375_wp, &
      & 0.0625_wp, 0.04296875_wp, 0.03125_wp]
   integer, parameter :: longest = 3, shortest = 8     ! changes of the step, of 16 each
   real(wp), parameter :: change = 16.0_wp

   !> The error estimate of the four-point difference is that of a two-point one, e = delta^2/6 with
   !> the step delta relative to the length on which f varies; its true error is 0.075 e^2.  Up to
   !> 4e-6 this is 1e-12 and less; under 1e-8 rounding, eps/delta, is more than that, unless it
   !> is rounding that the estimate shows, and that is small.
   real(wp), parameter :: four_point_error = 4.0e-6_wp, too_short = 1.0e-8_wp, rounding = 2.0e-12_wp
   !> A table with errors above `unsettled` at its second level has steps as long as f varies on
   real(wp), parameter :: unsettled = 0.2_wp, never_settled = 1.0e-7_wp
   real(wp), parameter :: tolerance = 1.0e-13_wp       ! more levels bring nothing
   real(wp), parameter :: noisy = 1.0e-10_wp           ! rounding that a longer step may reduce

   type, public :: line_derivative
      logical :: is_running = .false.        !! f(point()) is asked for
      real(wp), allocatable :: f(:)          !! function at the point, to be filled [m]
      real(wp), allocatable :: value(:)      !! derivative [m]
      real(wp), allocatable :: rates(:)      !! least sizes of the derivative that matter [m]; set after `begin`
      integer :: ierr = 0                    !! 0, or what the function returned
      integer, private :: order = 1, level = 0, stage = 1, side = 0, ups = 0, downs = 0, refusals = 0, idle = 0
      logical, private :: four_points = .false., knows_zero = .false.
      real(wp), private :: step = 1.0_wp, reach = 1.0_wp
      real(wp), allocatable, private :: table(:, :)                      ! [m, levels]
      real(wp), allocatable, private :: error(:), least(:), most(:)      ! [m]
      real(wp), allocatable, private :: ratio(:)          ! error relative to size_of [m]
      real(wp), allocatable, private :: kept_value(:), kept_ratio(:)     ! of tables before [m]
      real(wp), allocatable, private :: f0(:), f1(:), even(:), bend(:)   ! [m]
   contains
      procedure :: resize => derivative_resize
      procedure :: begin => derivative_begin
      procedure :: point => derivative_point
      procedure :: give => derivative_give
   end type line_derivative

contains

   !> Storage for functions of m components; no work where it is there
   pure subroutine derivative_resize(self, m)
      class(line_derivative), intent(inout) :: self
      integer, intent(in) :: m
      if (allocated(self%f)) then
         if (size(self%f) == m) return
         deallocate (self%f, self%value, self%rates, self%table, self%error, self%least, self%most, self%f0, self%f1, &
            & self%even, self%bend, self%ratio, self%kept_value, &
            & self%kept_ratio)
      end if
      allocate (self%f(m), self%value(m), self%rates(m), self%table(m, levels), self%error(m), self%least(m), &
         & self%most(m), self%f0(m), self%f1(m), self%even(m), self%bend(m), self%ratio(m), &
         & self%kept_value(m), self%kept_ratio(m))
   end subroutine derivative_resize

   pure subroutine derivative_begin(self, order, step, unit, four_points)
      class(line_derivative), intent(inout) :: self
      integer, intent(in) :: order           !! 1 or 2
      real(wp), intent(in) :: step           !! first one, the longest of the table
      real(wp), intent(in) :: unit           !! length of s on which f is thought to vary
      logical, intent(in) :: four_points     !! two levels will do where the error allows
      self%order = order
      self%reach = unit/step
      self%four_points = four_points
      self%side = 0
      self%ups = 0
      self%downs = 0
      self%refusals = 0
      self%knows_zero = .false.
      self%ierr = 0
      self%rates = 0.0_wp
      self%kept_ratio = huge(1.0_wp)
      self%kept_value = 0.0_wp
      self%is_running = size(self%f) > 0
      call restart(self, step)
   end subroutine derivative_begin

   pure subroutine restart(self, step)
      class(line_derivative), intent(inout) :: self
      real(wp), intent(in) :: step
      self%step = step
      self%level = 0
      self%idle = 0
      self%stage = merge(0, 1, (self%order == 2 .or. self%side /= 0) .and. .not. self%knows_zero)
      self%error = huge(1.0_wp)
      self%value = 0.0_wp
      self%bend = 0.0_wp
      self%least = huge(1.0_wp)
      self%most = -huge(1.0_wp)
   end subroutine restart

   !> Where the function is asked for
   pure real(wp) function derivative_point(self) result(s)
      class(line_derivative), intent(in) :: self
      s = self%step*sequence(self%level + 1)
      if (self%stage == 0) then
         s = 0.0_wp
      else if (self%side == 0) then
         if (self%stage == 2) s = -s
      else
         s = self%side*s
         if (self%order == 2 .and. self%stage == 1) s = 2.0_wp*s
      end if
   end function derivative_point

   !> Take f at the point; ierr > 0, or a value that is not finite, lies outside the domain
   pure subroutine derivative_give(self, ierr)
      class(line_derivative), intent(inout) :: self
      integer, intent(in) :: ierr
      real(wp) :: s
      if (ierr < 0) then
         self%ierr = ierr
         self%is_running = .false.
         return
      end if
      if (ierr > 0 .or. .not. all(ieee_is_finite(self%f))) then
         call avoid(self, max(ierr, 1))
         return
      end if
      if (self%stage == 0) then
         self%f0 = self%f
         self%knows_zero = .true.
         self%stage = 1
         return
      end if
      self%least = min(self%least, self%f)
      self%most = max(self%most, self%f)
      if (self%stage == 1 .and. (self%side == 0 .or. self%order == 2)) then
         self%f1 = self%f
         self%stage = 2
         return
      end if
      s = abs(self%point())
      if (self%side /= 0 .and. self%order == 1) then
         self%f = (self%f - self%f0)/(self%side*s)
      else if (self%side /= 0) then
         self%f = ((self%f1 - self%f) - (self%f - self%f0))/s**2
      else
         call note_bend(self)
         if (self%order == 1) then
            self%f = (self%f1 - self%f)/(2.0_wp*s)
         else
            self%f = ((self%f1 - self%f0) + (self%f - self%f0))/s**2
         end if
      end if
      call add_level(self, s)
   end subroutine derivative_give

   !> Second derivative from the even parts of f at the first two levels: a size for the first one
   !> where that passes through zero
   pure subroutine note_bend(self)
      class(line_derivative), intent(inout) :: self
      if (self%level == 0) then
         self%even = self%f1 + self%f
      else if (self%level == 1) then
         self%bend = abs(self%even - (self%f1 + self%f))/(0.75_wp*self%step**2)
      end if
   end subroutine note_bend

   !> A shorter step, then one side, then the other
   pure subroutine avoid(self, ierr)
      class(line_derivative), intent(inout) :: self
      integer, intent(in) :: ierr
      self%refusals = self%refusals + 1
      if (self%refusals == 1 .and. self%stage > 0) then
         call restart(self, self%step/change)
      else if (self%refusals == 2 .and. self%stage > 0) then
         self%side = 1
         call restart(self, self%step)
      else if (self%refusals == 3 .and. self%stage > 0) then
         self%side = -1
         call restart(self, self%step)
      else
         self%ierr = ierr
         self%is_running = .false.
      end if
   end subroutine avoid

   !> A difference of step s, in f, into the table
   pure subroutine add_level(self, s)
      class(line_derivative), intent(inout) :: self
      real(wp), intent(in) :: s
      real(wp) :: new, better, old, error, floor, weight
      logical :: has_improved
      integer :: i, j, power
      self%level = self%level + 1
      self%stage = 1
      has_improved = .false.
      power = merge(2, 1, self%side == 0)
      do i = 1, size(self%f)
         new = self%f(i)
         floor = epsilon(1.0_wp)*max(abs(self%least(i)), abs(self%most(i)))/s**self%order
         do j = 1, self%level - 1
            old = self%table(i, j)
            self%table(i, j) = new
            weight = (sequence(self%level - j)/sequence(self%level))**power
            better = new + (new - old)/(weight - 1.0_wp)
            error = max(abs(better - new), abs(better - old), floor)
            if (error < self%error(i)) then
               if (error < 0.5_wp*self%error(i)) has_improved = has_improved .or. error > tolerance*size_of(self, i)
               self%value(i) = better
               self%error(i) = error
            end if
            new = better
         end do
         self%table(i, self%level) = new
      end do
      if (self%level >= 2) call judge(self, has_improved)
   end subroutine add_level

   !> What the error of component i is compared with
   pure real(wp) function size_of(self, i)
      class(line_derivative), intent(in) :: self
      integer, intent(in) :: i
      size_of = max(abs(self%value(i)), self%rates(i))
      if (self%order == 1) size_of = max(size_of, self%bend(i)*self%step*self%reach, &
         & (self%most(i) - self%least(i))/(2.0_wp*self%step))
   end function size_of

   !> Enough, another level, or another step
   pure subroutine judge(self, has_improved)
      class(line_derivative), intent(inout) :: self
      logical, intent(in) :: has_improved
      real(wp) :: worst
      logical :: may_grow, may_shrink
      integer :: i
      ! no change is exact, unless an earlier table has seen one
      worst = -huge(1.0_wp)
      do i = 1, size(self%f)
         if (self%most(i) > self%least(i)) then
            self%ratio(i) = min(self%error(i), size_of(self, i))/max(size_of(self, i), tiny(1.0_wp))
            worst = max(worst, self%ratio(i))
         else
            self%ratio(i) = merge(1.0_wp, 0.0_wp, abs(self%kept_value(i)) > 0.0_wp)
         end if
      end do
      self%idle = merge(0, self%idle + 1, has_improved)
      may_grow = self%ups < longest .and. self%downs == 0 .and. self%refusals == 0
      may_shrink = self%downs < shortest .and. self%ups == 0 .and. self%side == 0
      if (self%level == 2) then
         if (worst > unsettled .and. may_shrink) then
            self%downs = self%downs + 1
            call change_step(self, self%step/change)
         else if (self%four_points .and. self%side == 0 .and. worst <= four_point_error) then
            if (worst > rounding .and. worst < too_short .and. may_grow) then
               self%ups = self%ups + 1
               call change_step(self, self%step*change)
            else
               if (worst >= too_short) then
                  self%value = self%table(:, 2)
                  self%ratio = worst*self%ratio
               end if
               call finish(self)
            end if
         end if
      else if (worst <= tolerance) then
         call finish(self)
      else if (self%idle >= 2 .or. self%level == levels) then
         if (worst > never_settled .and. may_shrink) then
            self%downs = self%downs + 1
            call change_step(self, self%step/change)
         else if (worst > noisy .and. may_grow) then
            self%ups = self%ups + 1
            call change_step(self, self%step*change)
         else
            call finish(self)
         end if
      end if
   end subroutine judge

   !> Another table
   pure subroutine change_step(self, step)
      class(line_derivative), intent(inout) :: self
      real(wp), intent(in) :: step
      call keep_better(self)
      self%kept_value = self%value
      self%kept_ratio = self%ratio
      call restart(self, step)
   end subroutine change_step

   pure subroutine finish(self)
      class(line_derivative), intent(inout) :: self
      call keep_better(self)
      self%is_running = .false.
   end subroutine finish

   !> What an earlier table had better
   pure subroutine keep_better(self)
      class(line_derivative), intent(inout) :: self
      integer :: i
      do i = 1, size(self%f)
         if (.not. self%kept_ratio(i) < self%ratio(i)) cycle
         self%value(i) = self%kept_value(i)
         self%ratio(i) = self%kept_ratio(i)
      end do
   end subroutine keep_better
end module dynstep_line_derivative
