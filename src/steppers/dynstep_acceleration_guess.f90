! SPDX-License-Identifier: BSD-3-Clause
!> A first guess of the acceleration at the next substep of a row of an extrapolation.
!>
!> The row before, of fewer substeps, has accelerations a' over the whole base step; those of this row differ from them
!> by d(s) = a(s) - a'(s), small and smooth, of the order of H^2 (1/n^2 - 1/n'^2).  The guess is a'(s), interpolated
!> by a polynomial through the nearest points, plus d continued from the substeps that are made; without a row before,
!> a' = 0.
module dynstep_acceleration_guess
   use dynstep_kinds, only: wp
   implicit none
   private

   !> Substeps that d is continued from, points that a' is interpolated by
   integer, parameter :: depth = 4, half = 3, points = 2*half + 1

   type, public :: acceleration_guess
      real(wp), private :: shift = 0.0_wp            ! point i is at s = (i + shift)/steps of the base step
      integer, private :: steps = 0                  ! of this row; 0: no guesses are made
      integer, private :: known = 0                  ! points of this row that are known
      integer, private :: steps_before = 0           ! of the row before; 0: there is none
      integer, private :: known_before = 0
      real(wp), allocatable, private :: a(:, :)      ! accelerations at the points [n, steps + 1]
      real(wp), allocatable, private :: d(:, :)      ! the last differences [n, depth], newest first
      real(wp), allocatable, private :: before(:, :) ! accelerations of the row before [n, most]
   contains
      procedure :: init => guess_init
      procedure :: forget => guess_forget
      procedure :: follow => guess_follow
      procedure :: note => guess_note
      procedure :: extrapolate => guess_extrapolate
      procedure :: is_empty => guess_is_empty
   end type acceleration_guess

contains

   pure subroutine guess_init(self, n, steps, shift)
      class(acceleration_guess), intent(inout) :: self
      integer, intent(in) :: n                       !! length of an acceleration
      integer, intent(in) :: steps                   !! substeps of this row >= 1; those before have fewer
      real(wp), intent(in) :: shift                  !! 0: points are ends of substeps and the start, 1/2: midpoints
      if (allocated(self%a)) deallocate (self%a, self%d, self%before)
      allocate (self%a(n, steps + 1), self%d(n, depth), self%before(n, steps + 1))
      self%a = 0.0_wp
      self%d = 0.0_wp
      self%before = 0.0_wp
      self%steps = steps
      self%shift = shift
      self%known = 0
      self%steps_before = 0
   end subroutine guess_init

   !> Nothing is known of this row
   pure logical function guess_is_empty(self)
      class(acceleration_guess), intent(in) :: self
      guess_is_empty = self%known == 0
   end function guess_is_empty

   !> A new row begins
   pure subroutine guess_forget(self)
      class(acceleration_guess), intent(inout) :: self
      self%known = 0
   end subroutine guess_forget

   !> Take the row that was made before in the same base step
   pure subroutine guess_follow(self, other)
      class(acceleration_guess), intent(inout) :: self
      class(acceleration_guess), intent(in) :: other
      self%steps_before = 0
      if (self%steps == 0 .or. other%steps == 0 .or. other%steps >= self%steps) return
      self%steps_before = other%steps
      self%known_before = other%known
      self%before(:, :other%known) = other%a(:, :other%known)
   end subroutine guess_follow

   !> The acceleration at the next point of this row
   pure subroutine guess_note(self, a)
      class(acceleration_guess), intent(inout) :: self
      real(wp), intent(in) :: a(:)                   !! [n]
      integer :: k
      if (self%known > self%steps) return
      self%known = self%known + 1
      self%a(:, self%known) = a
      do k = depth, 2, -1
         self%d(:, k) = self%d(:, k - 1)
      end do
      self%d(:, 1) = a
      call add_before(self, self%known, -1.0_wp, self%d(:, 1))
   end subroutine guess_note

   !> At the point after the last one that is known; `a` is left as it is where nothing is known
   pure subroutine guess_extrapolate(self, a)
      class(acceleration_guess), intent(in) :: self
      real(wp), intent(inout) :: a(:)                !! [n]
      select case (min(self%known, depth))
      case (0)
         if (self%steps_before == 0) return
         a = 0.0_wp
      case (1)
         a = self%d(:, 1)
      case (2)
         a = self%d(:, 1) + (self%d(:, 1) - self%d(:, 2))
      case (3)
         a = self%d(:, 1) + (2.0_wp*self%d(:, 1) - 3.0_wp*self%d(:, 2) + self%d(:, 3))
      case (4)
         a = self%d(:, 1) + (3.0_wp*self%d(:, 1) - 6.0_wp*self%d(:, 2) + 4.0_wp*self%d(:, 3) - self%d(:, 4))
      end select
      call add_before(self, self%known + 1, 1.0_wp, a)
   end subroutine guess_extrapolate

   !> x = x + factor a' at point i of this row, by Lagrange's polynomial
   pure subroutine add_before(self, i, factor, x)
      class(acceleration_guess), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: x(:)
      real(wp) :: position, weight
      integer :: first, last, j, k
      if (self%steps_before == 0) return
      ! in points of the row before, the first one of which is at 1
      position = (real(i - 1, wp) + self%shift)*(real(self%steps_before, wp)/real(self%steps, wp)) - self%shift + 1.0_wp
      first = max(1, min(nint(position) - half, self%known_before - points + 1))
      last = min(self%known_before, first + points - 1)
      do j = first, last
         weight = factor
         do k = first, last
            if (k /= j) weight = weight*((position - real(k, wp))/real(j - k, wp))
         end do
         x = x + weight*self%before(:, j)
      end do
   end subroutine add_before
end module dynstep_acceleration_guess
