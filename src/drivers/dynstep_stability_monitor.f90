! SPDX-License-Identifier: BSD-3-Clause
!> Warns where steps are longer than a method bears.
!>
!> Extrapolated Newmark is stable up to a limit of omega h only (docs/theory/newmark-extrapolation.md), explicit methods, too.
!> Of a linear system the highest frequency is bounded by Gershgorin's circles where M is diagonal; where that is too
!> much, and elsewhere, a power iteration with M^-1 K finds it, from below, with the damping ratio of its mode.  The limit
!> is that for a growth of `most_growth` over all steps of the run.  Of other systems the columns of the extrapolation are
!> looked at: where the results of more substeps differ more than those of few, step after step, nothing converges.
!>
!>     call monitor%begin(stepper, sys)
!>     call monitor%look(stepper, sys, h, steps)        before steps of length h
!>     call monitor%look_at_columns(stepper)            after them
!>     monitor%warning                                  a sentence with numbers, or blank
module dynstep_stability_monitor
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: long, wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_diagonal, kind_identity, kind_zero
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: message_length, status_type
   use dynstep_stepper, only: method_properties, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   !> Growth of a motion over the whole run that does no harm
   real(wp), parameter :: most_growth = 0.01_wp

   !> Rounding errors of a mode grow, too: nothing above this growth in a step is let pass in short runs
   real(wp), parameter :: largest_growth = 1.0e-4_wp

   !> Steps of the power iteration: the highest frequency of chains of 10 to 1000 masses to 2 per cent
   integer, parameter :: iterations = 40

   !> The columns must diverge in so many steps one after the other
   integer, parameter :: patience = 3

   type, public :: stability_monitor
      character(len=message_length) :: warning = ''    !! blank: nothing to warn of
      real(wp) :: omega = 0.0_wp                       !! highest frequency that was found; 0: none was looked for
      real(wp) :: limit = -1.0_wp                      !! of omega h; -1: not known
      logical, private :: is_on = .false.              ! a linear system and a method that may have a limit
      logical, private :: is_exact = .false.           ! omega is that of the power iteration
      real(wp), private :: damping = 0.0_wp            ! ratio of its mode
      real(wp), private :: checked = 0.0_wp            ! longest step that was looked at
      integer, private :: diverging = 0                ! steps in a row
   contains
      procedure :: begin => monitor_begin
      procedure :: look => monitor_look
      procedure :: look_at_columns => monitor_look_at_columns
   end type stability_monitor

contains

   !> Work is done where a method may be unstable
   recursive subroutine monitor_begin(self, stepper, sys)
      class(stability_monitor), intent(out) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(in) :: sys
      type(method_properties) :: facts
      select type (sys)
      class is (linear_system)
         facts = stepper%properties()
         self%is_on = facts%stability_limit < huge(1.0_wp) .and. .not. sys%structure%is_coupled .and. sys%k%kind /= kind_zero
      end select
   end subroutine monitor_begin

   !> Is a step of length h stable?
   recursive subroutine monitor_look(self, stepper, sys, h, steps)
      class(stability_monitor), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(in) :: sys
      real(wp), intent(in) :: h
      integer(long), intent(in) :: steps                !! of this length in the run, or a guess

      real(wp) :: growth

      if (.not. self%is_on .or. abs(h) <= self%checked) return
      self%checked = abs(h)
      select type (sys)
      class is (linear_system)
         if (.not. self%omega > 0.0_wp) call bound_frequency(self, sys)
         growth = min(largest_growth, most_growth/real(max(1_long, steps), wp))
         self%limit = stepper%stable_limit(0.0_wp, growth, self%omega*abs(h))
         if (self%limit < 0.0_wp .or. self%omega*abs(h) <= self%limit) return
         if (.not. self%is_exact) call find_frequency(self, sys)
         self%limit = stepper%stable_limit(self%damping, growth, self%omega*abs(h))
         if (self%limit < 0.0_wp .or. self%omega*abs(h) <= self%limit) return
         self%warning = 'omega h = '//trim(short(self%omega*abs(h)))//' of the highest frequency is beyond ' &
            & //trim(short(self%limit))//', where the method begins to grow: use fewer levels, h <= ' &
            & //trim(short(self%limit/self%omega))//', or Pade'
      end select
      self%is_on = .false.
   end subroutine monitor_look

   !> Three digits are enough for a sentence
   pure function short(x)
      real(wp), intent(in) :: x
      character(len=12) :: short
      if (x >= 1.0e-2_wp .and. x < 1.0e4_wp) then
         write (short, '(g12.3)') x
      else
         write (short, '(es10.2)') x
      end if
      short = adjustl(short)
   end function short

   !> omega^2 <= largest sum of |K| over a row, over M there
   recursive subroutine bound_frequency(self, sys)
      type(stability_monitor), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      real(wp), allocatable :: sums(:)
      integer :: i
      if (sys%m%kind /= kind_diagonal .and. sys%m%kind /= kind_identity) then
         call find_frequency(self, sys)
         return
      end if
      allocate (sums(sys%n))
      call sys%k%absolute_row_sums(sums)
      if (sys%m%kind == kind_diagonal) then
         do i = 1, sys%n
            sums(i) = sums(i)/abs(sys%m%entry(i, i))
         end do
      end if
      self%omega = sqrt(maxval(sums))
   end subroutine bound_frequency

   !> Power iteration x = M^-1 K x from a vector that changes its sign from entry to entry, as high modes do
   recursive subroutine find_frequency(self, sys)
      type(stability_monitor), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(factorization_type) :: factor
      type(status_type) :: status
      real(wp), allocatable :: x(:), y(:), z(:)
      real(wp) :: quotient, size_of_x
      integer :: i

      self%is_exact = .true.
      associate (s => sys%structure)
         call factor%init(s%mass, sys%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         if (sys%m%kind /= kind_identity) call factor%factorize(sys%m, status)
      end associate
      if (status%failed()) return
      x = [((1.0_wp + 0.1_wp*sin(real(i, wp)))*(-1)**i, i=1, sys%n)]
      allocate (y(sys%n), z(sys%n))
      quotient = 0.0_wp
      do i = 1, iterations
         y = 0.0_wp
         call sys%k%multiply_add(1.0_wp, x, y)
         z = y
         if (sys%m%kind /= kind_identity) call factor%solve(z)
         ! Rayleigh's quotient of M^-1 K in the metric of K: never above the largest eigenvalue
         quotient = dot_product(y, z)/dot_product(x, y)
         size_of_x = maxval(abs(z))
         if (.not. (ieee_is_finite(size_of_x) .and. size_of_x > 0.0_wp)) return
         x = z/size_of_x
      end do
      if (.not. ieee_is_finite(quotient)) return
      if (.not. quotient > 0.0_wp) return
      self%omega = sqrt(quotient)
      if (sys%c%kind == kind_zero) return
      y = 0.0_wp
      z = 0.0_wp
      call sys%c%multiply_add(1.0_wp, x, y)
      call sys%k%multiply_add(1.0_wp, x, z)
      ! xi = x'Cx/(2 omega x'Mx), with x'Mx = x'Kx/omega^2
      self%damping = max(0.0_wp, 0.5_wp*self%omega*dot_product(x, y)/dot_product(x, z))
   end subroutine find_frequency

   !> Growth in the columns of an extrapolation
   pure subroutine monitor_look_at_columns(self, stepper)
      class(stability_monitor), intent(inout) :: self
      class(stepper_type), intent(in) :: stepper
      ! where the limit is known, `look` has told
      if (self%diverging >= patience .or. self%limit >= 0.0_wp) return
      if (stepper%column_growth() > 1.0_wp) then
         self%diverging = self%diverging + 1
      else
         self%diverging = 0
      end if
      if (self%diverging >= patience .and. len_trim(self%warning) == 0) self%warning = 'the results of more substeps differ ' &
         & //'more than those of few, step after step: h is beyond the stability limit of the extrapolation or too long for ' &
         & //'the motion; use a shorter h or fewer levels'
   end subroutine monitor_look_at_columns
end module dynstep_stability_monitor
