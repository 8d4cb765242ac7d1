! SPDX-License-Identifier: BSD-3-Clause
!> Newton's iteration for one step of generalized-alpha-SOI2: when to stop, which matrices to use.
!>
!> The block matrices are made at the predictor, and kept for the next steps as long as two corrections are
!> enough with them.  The iteration stops where what is left, the last correction times the contraction,
!> is round-off in y and z, or where corrections no longer shrink.  Where it contracts poorly it starts again
!> with new matrices, then with the whole Jacobian at each correction, and then asks for a smaller step.
module dynstep_soi2_iteration
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_soi2_equations, only: soi2_equations, variant_reduced
   use dynstep_soi2_jacobian, only: most_unknowns, soi2_jacobian
   use dynstep_soi2_matrices, only: soi2_matrices
   use dynstep_status, only: dynstep_not_converged, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   type, public :: soi2_iteration
      integer :: limit = 25                     !! most corrections
      real(wp) :: tolerance = 0.0_wp            !! of a correction as a part of y and z; 0: round-off
      type(soi2_matrices) :: matrices
      type(soi2_jacobian), private :: jacobian
      integer, private :: wait = 0              ! steps with new matrices before old ones are tried again
      integer, private :: patience = 1          ! the next `wait`
      real(wp), private :: rate = 1.0_wp        ! last contraction
      real(wp), allocatable, private :: predictor(:)
   contains
      procedure :: init => iteration_init
      procedure :: forget => iteration_forget
      procedure :: solve => iteration_solve
      procedure :: archive => iteration_archive
   end type soi2_iteration

   !> What is left may be this part of y and z: of new matrices, whose contraction gets better with each correction,
   !> and of old ones, whose contraction stays as it is.  Both leave |g| <= 10 eps |y| and |g'| <= 20 eps |z| on
   !> pendulum, slider-crank and chain for h = 1e-2 to 1e-5.  256 eps of new ones would save 0.1 corrections at h = 1/256
   !> and none from 1/1024 on, but leave 1e-13 of z and 5e-11 of the multipliers at h = 1/12.
   real(wp), parameter :: finest_of_new = 32.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: finest_of_old = 16.0_wp*epsilon(1.0_wp)

   !> Corrections below this one that no longer shrink, with the block matrices and with the whole Jacobian, are the
   !> rounding errors of the forces: a spring of 3e8 N/m on the pendulum (16) leaves 1e-11
   real(wp), parameter :: stagnated_below = 1.0e-10_wp
   real(wp), parameter :: stagnated_for_good = 1.0e-7_wp

   !> A contraction worse than this asks for better matrices
   real(wp), parameter :: poor = 0.3_wp

contains

   recursive subroutine iteration_init(self, sys, eqs, status)
      class(soi2_iteration), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      type(soi2_equations), intent(in) :: eqs
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      call self%matrices%init(sys, status)
      if (allocated(self%predictor)) deallocate (self%predictor)
      allocate (self%predictor(eqs%unknowns()))
      call self%forget()
   end subroutine iteration_init

   pure subroutine iteration_forget(self)
      class(soi2_iteration), intent(inout) :: self
      call self%matrices%forget()
      self%wait = 0
      self%patience = 1
      self%rate = 1.0_wp
   end subroutine iteration_forget

   !> From the predictor in eqs to the solution, in place
   recursive subroutine iteration_solve(self, sys, eqs, count, status)
      class(soi2_iteration), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(soi2_equations), intent(inout) :: eqs
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: length, previous
      integer :: iteration
      logical :: is_old, is_whole, is_measured, is_done

      if (status%failed()) return
      call eqs%pack_unknowns(self%predictor)
      call choose_matrices(self, eqs)
      is_old = self%matrices%is_made
      is_whole = must_be_whole(eqs)
      is_measured = .false.
      previous = 0.0_wp
      do iteration = 1, self%limit
         call eqs%evaluate(sys, count, status)
         call correct(self, sys, eqs, is_whole, length, count, status)
         if (status%failed()) exit
         call judge(self, length, previous, eqs%moved, is_measured, is_old, &
            & is_whole .or. eqs%unknowns() > most_unknowns, is_done)
         if (is_done) exit
         ! far from the solution Newton's own iteration contracts poorly at first
         if (ieee_is_finite(length) .and. (is_whole .or. .not. (is_measured .and. self%rate > poor))) then
            previous = length
            is_measured = .true.
            cycle
         end if
         call improve(self, eqs, is_old, is_whole, status)
         if (status%failed()) exit
         is_measured = .false.
      end do
      if (iteration > self%limit .and. .not. status%failed()) call status%set(dynstep_not_converged, &
         & 'the Newton iteration did not converge in '//text(self%limit)//' corrections in the step from t = ' &
         & //text(eqs%t0)//' of length '//text(eqs%h)//'; reduce h', retry=.true.)
      if (status%failed()) self%matrices%is_made = .false.
      call remember(self, iteration, is_old, is_whole)
   end subroutine iteration_solve

   !> In the reduced variant psi belongs to both systems of the block correction, which then does not contract
   pure logical function must_be_whole(eqs)
      type(soi2_equations), intent(in) :: eqs
      must_be_whole = eqs%variant == variant_reduced .and. eqs%has_differences .and. size(eqs%psi) > 0
   end function must_be_whole

   !> May the matrices of an earlier step serve once more?
   pure subroutine choose_matrices(self, eqs)
      class(soi2_iteration), intent(inout) :: self
      type(soi2_equations), intent(in) :: eqs
      associate (matrices => self%matrices)
         if (.not. matrices%is_made) return
         if (matrices%regularization > 0.0_wp) then
            ! the regularization is a small part of what the matrix changes by in a step
            matrices%is_made = .false.
         else if (self%wait > 0) then
            self%wait = self%wait - 1
            matrices%is_made = .false.
         else if (matrices%is_stiff) then
            ! S is made for one step length
            matrices%is_made = abs(eqs%c - matrices%made_c) <= 4.0_wp*epsilon(1.0_wp)*abs(eqs%c) &
               & .and. abs(eqs%b - matrices%made_b) <= 8.0_wp*epsilon(1.0_wp)*abs(eqs%b)
         end if
      end associate
   end subroutine choose_matrices

   !> One correction by the block matrices, or by the whole Jacobian
   recursive subroutine correct(self, sys, eqs, is_whole, length, count, status)
      class(soi2_iteration), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(soi2_equations), intent(inout) :: eqs
      logical, intent(in) :: is_whole
      real(wp), intent(out) :: length
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      length = huge(length)
      if (status%failed()) return
      if (is_whole) then
         call self%jacobian%correct(sys, eqs, self%matrices%regularization, length, count, status)
      else
         if (.not. self%matrices%is_made) call self%matrices%renew(sys, eqs, count, status)
         if (.not. status%failed()) call self%matrices%correct(sys, eqs, length, count, status)
      end if
      count%newton_iterations = count%newton_iterations + 1
   end subroutine correct

   !> Is the iteration at its end?
   pure subroutine judge(self, length, previous, moved, is_measured, is_old, is_best, is_done)
      class(soi2_iteration), intent(inout) :: self
      real(wp), intent(in) :: length, previous
      real(wp), intent(in) :: moved                      !! correction as a part of y
      logical, intent(in) :: is_measured                 !! `previous` was with the same matrices
      logical, intent(in) :: is_old                      !! those of an earlier step
      logical, intent(in) :: is_best                     !! there are no better ones
      logical, intent(out) :: is_done
      real(wp) :: goal
      is_done = .false.
      if (.not. ieee_is_finite(length)) return
      goal = max(self%tolerance, merge(finest_of_old, finest_of_new, is_old))
      if (is_measured) self%rate = length/previous
      is_done = self%matrices%is_exact .or. length <= goal
      if (is_done) return
      if (is_measured) is_done = (self%rate < 0.5_wp .and. self%rate*length <= goal) .or. &
         & (self%rate >= 0.5_wp .and. length <= merge(stagnated_for_good, stagnated_below, is_best)) .or. &
         & (self%rate > poor .and. moved <= finest_of_old .and. .not. is_old)
   end subroutine judge

   !> Better matrices, and back to the predictor where the corrections grew
   recursive subroutine improve(self, eqs, is_old, is_whole, status)
      class(soi2_iteration), intent(inout) :: self
      type(soi2_equations), intent(inout) :: eqs
      logical, intent(inout) :: is_old, is_whole
      type(status_type), intent(inout) :: status
      if (.not. self%rate < 1.0_wp) call eqs%unpack_unknowns(self%predictor)
      self%rate = 1.0_wp
      self%matrices%is_made = .false.
      self%matrices%knows_tangents = .false.
      if (is_old) then
         is_old = .false.
      else if (.not. is_whole .and. eqs%unknowns() <= most_unknowns) then
         is_whole = .true.
      else
         call status%set(dynstep_not_converged, 'the Newton iteration does not contract in the step from t = ' &
            & //text(eqs%t0)//' of length '//text(eqs%h)//'; reduce h', retry=.true.)
      end if
   end subroutine improve

   !> Old matrices that cost a third correction are not tried again for a while, twice as long each time
   pure subroutine remember(self, iterations, is_old, is_whole)
      class(soi2_iteration), intent(inout) :: self
      integer, intent(in) :: iterations
      logical, intent(in) :: is_old, is_whole
      if (is_whole) self%rate = 1.0_wp
      if (iterations > 2) then
         if (is_old) self%patience = min(2*self%patience, 1024)
         self%wait = max(self%wait, self%patience)
      else if (is_old) then
         self%patience = 1
      end if
   end subroutine remember

   !> The matrices and how well they have served; the whole Jacobian is made anew at each use
   recursive subroutine iteration_archive(self, name, has_differences, file)
      class(soi2_iteration), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: has_differences         !! of the equations
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('wait', self%wait)
      call file%item('patience', self%patience)
      call file%item('rate', self%rate)
      call self%matrices%archive('matrices', has_differences, file)
      call file%end_section()
   end subroutine iteration_archive
end module dynstep_soi2_iteration
