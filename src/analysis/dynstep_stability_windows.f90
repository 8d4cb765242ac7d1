! SPDX-License-Identifier: BSD-3-Clause
!> For which alpha a family of backinterpolation methods has a property: intervals of alpha, their ends by bisection on
!> the facts of dynstep_stability_facts.
!>
!>   call alpha_windows(p, q, property_i_stable, windows, status)          R = P_p(alpha z)/P_q(-(1 - alpha) z)
!>   call alpha_windows(p, q, property_a_stable, windows, status, halves=family_fehlberg)
!>
!> The windows are looked for at 0, 1/200, ..., 1 (so 1/2, the symmetric members, is met), and where the growth on the
!> imaginary axis is smallest between three of these points, so that a window that is narrower is found as well unless
!> the growth has more than one minimum there.  The ends are right to some 1e-12: there the growth is as small as its
!> rounding errors.  An end that is nearer than 1e-11 to one of the points is that point.
module dynstep_stability_windows
   use dynstep_kinds, only: wp
   use dynstep_rational, only: fehlberg_rational, rational_type, taylor_rational
   use dynstep_stability_facts, only: imaginary_axis, imaginary_axis_type, is_left
   use dynstep_status, only: dynstep_invalid_input, status_type
   implicit none
   private

   public :: alpha_windows

   integer, parameter, public :: family_taylor = 1      !! taylor_rational(p, q, alpha)
   integer, parameter, public :: family_fehlberg = 2    !! fehlberg_rational(alpha); p and q are not read

   integer, parameter, public :: property_i_stable = 1  !! |R(iy)| <= 1 for all y
   integer, parameter, public :: property_a_stable = 2
   integer, parameter, public :: property_f_stable = 3
   integer, parameter, public :: property_l_stable = 4

   integer, parameter :: points = 200
   real(wp), parameter :: same = 1.0e-11_wp

contains

   !> Intervals of alpha in 0 .. 1
   pure subroutine alpha_windows(p, q, property, windows, status, halves)
      integer, intent(in) :: p, q                         !! as in taylor_rational
      integer, intent(in) :: property                     !! property_i_stable ... property_l_stable
      real(wp), allocatable, intent(out) :: windows(:, :) !! [2, number]: from (1, i) to (2, i), ascending
      type(status_type), intent(inout) :: status
      integer, intent(in), optional :: halves             !! family_taylor (default) or family_fehlberg
      real(wp) :: growth(0:points), found(2, points + 1), low, high, peak
      logical :: holds(0:points)
      integer :: family, i, count

      allocate (windows(2, 0))
      if (status%failed()) return
      family = family_taylor
      if (present(halves)) family = halves
      if (property < property_i_stable .or. property > property_l_stable) &
         & call status%set(dynstep_invalid_input, 'property must be property_i_stable, property_a_stable, property_f_stable' &
         & //' or property_l_stable')
      if (family /= family_taylor .and. family /= family_fehlberg) &
         & call status%set(dynstep_invalid_input, 'halves must be family_taylor or family_fehlberg')
      do i = 0, points
         call look(family, p, q, property, real(i, wp)/points, holds(i), growth(i), status)
      end do
      if (status%failed()) return

      count = 0
      i = 0
      do while (i <= points)
         if (.not. holds(i)) then
            ! a dip of the growth between three points that are all outside?
            if (i > 0 .and. i < points) then
               if (.not. (holds(i - 1) .or. holds(i + 1)) .and. growth(i) <= growth(i - 1) .and. growth(i) <= growth(i + 1)) then
                  call descend(family, p, q, property, real(i - 1, wp)/points, real(i + 1, wp)/points, peak, status)
                  if (peak >= 0.0_wp) then
                     count = count + 1
                     found(:, count) = [edge(family, p, q, property, peak, real(i - 1, wp)/points), &
                        & edge(family, p, q, property, peak, real(i + 1, wp)/points)]
                  end if
               end if
            end if
            i = i + 1
            cycle
         end if
         low = real(i, wp)/points
         if (i > 0) low = edge(family, p, q, property, low, real(i - 1, wp)/points)
         do while (i < points)
            if (.not. holds(i + 1)) exit
            i = i + 1
         end do
         high = real(i, wp)/points
         if (i < points) high = edge(family, p, q, property, high, real(i + 1, wp)/points)
         count = count + 1
         found(:, count) = [low, high]
         i = i + 1
      end do
      do i = 1, count
         if (abs(found(1, i) - grid(found(1, i))) < same .and. holds(nint(found(1, i)*points))) found(1, i) = grid(found(1, i))
         if (abs(found(2, i) - grid(found(2, i))) < same .and. holds(nint(found(2, i)*points))) found(2, i) = grid(found(2, i))
      end do
      windows = found(:, :count)
   end subroutine alpha_windows

   !> Nearest of the points
   elemental real(wp) function grid(alpha)
      real(wp), intent(in) :: alpha
      grid = real(nint(alpha*points), wp)/points
   end function grid

   !> Has R the property, and how much does it grow on the imaginary axis
   pure subroutine look(family, p, q, property, alpha, holds, growth, status)
      integer, intent(in) :: family, p, q, property
      real(wp), intent(in) :: alpha
      logical, intent(out) :: holds
      real(wp), intent(out) :: growth
      type(status_type), intent(inout) :: status
      type(rational_type) :: r
      type(imaginary_axis_type) :: axis
      holds = .false.
      growth = huge(1.0_wp)
      if (family == family_taylor) call taylor_rational(p, q, alpha, r, status)
      if (family == family_fehlberg) call fehlberg_rational(alpha, r, status)
      if (status%failed()) return
      call imaginary_axis(r, axis)
      growth = axis%growth
      holds = axis%is_stable
      if (property >= property_a_stable) holds = holds .and. r%p <= r%q .and. .not. any(is_left(r%poles))
      if (property == property_f_stable) holds = holds .and. axis%is_unit .and. r%q > 0
      if (property == property_l_stable) holds = holds .and. r%p < r%q
   end subroutine look

   !> Last alpha with the property, from one that has it towards one that has not
   pure real(wp) function edge(family, p, q, property, inside, outside)
      integer, intent(in) :: family, p, q, property
      real(wp), intent(in) :: inside, outside
      type(status_type) :: status
      real(wp) :: beyond, middle, growth
      logical :: holds
      edge = inside
      beyond = outside
      do while (abs(beyond - edge) > 8.0_wp*epsilon(1.0_wp))
         middle = 0.5_wp*(edge + beyond)
         call look(family, p, q, property, middle, holds, growth, status)
         if (holds) then
            edge = middle
         else
            beyond = middle
         end if
      end do
   end function edge

   !> An alpha with the property where the growth is smallest between two, by golden sections; -1: there is none
   pure subroutine descend(family, p, q, property, low, high, peak, status)
      integer, intent(in) :: family, p, q, property
      real(wp), intent(in) :: low, high
      real(wp), intent(out) :: peak
      type(status_type), intent(inout) :: status
      real(wp), parameter :: golden = 0.6180339887498949_wp
      real(wp) :: a, b, c, d, at_c, at_d
      logical :: holds_c, holds_d
      a = low
      b = high
      peak = -1.0_wp
      do while (b - a > 1.0e-9_wp)
         c = b - golden*(b - a)
         d = a + golden*(b - a)
         call look(family, p, q, property, c, holds_c, at_c, status)
         call look(family, p, q, property, d, holds_d, at_d, status)
         if (holds_c) peak = c
         if (holds_d) peak = d
         if (peak >= 0.0_wp) return
         if (at_c < at_d) then
            b = d
         else
            a = c
         end if
      end do
   end subroutine descend
end module dynstep_stability_windows
