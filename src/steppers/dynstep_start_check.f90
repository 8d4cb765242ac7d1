! SPDX-License-Identifier: BSD-3-Clause
!> What every method asks of a system and of a start, with the sentences for what is wrong.
module dynstep_start_check
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_check_structure, only: check_structure
   use dynstep_kinds, only: wp
   use dynstep_linear_ode, only: linear_ode
   use dynstep_linear_system, only: linear_system, load_samples
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input, status_type
   use dynstep_stepper, only: multiplier_counts, state_type, stepper_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_mechanical, check_size, check_start, check_state

contains

   !> The system has unknowns
   recursive subroutine check_size(sys, status)
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (sys%n < 1) call status%set(dynstep_invalid_input, 'the system has n = '//text(sys%n) &
         & //' unknowns; set n >= 1 before init')
   end subroutine check_size

   !> The system is one of mechanics, its declarations make sense, and the method takes its
   !> constraints where it has some
   recursive subroutine check_mechanical(method, sys, status, takes_constraints, takes_coupling)
      character(len=*), intent(in) :: method     !! name, for the sentence
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      logical, intent(in), optional :: takes_constraints   !! default .false.
      logical, intent(in), optional :: takes_coupling      !! of a linear_system, default .false.
      logical :: allowed
      call check_size(sys, status)
      if (status%failed()) return
      select type (sys)
      class is (mechanical_system)
         call check_structure(sys, status)
         allowed = .false.
         if (present(takes_coupling)) allowed = takes_coupling
         if (.not. (status%failed() .or. allowed) .and. sys%structure%is_coupled) call status%set(dynstep_invalid_input, method &
            & //' takes no coupling: choose pade or bi, or add b k'' and b c'' to K and C')
         allowed = .false.
         if (present(takes_constraints)) allowed = takes_constraints
         if (status%failed() .or. allowed .or. sys%holonomic + sys%nonholonomic == 0) return
         call status%set(dynstep_invalid_input, method//' takes no constraints, and this system has ' &
            & //text(sys%holonomic)//' of g and '//text(sys%nonholonomic)//' of k: choose soi2')
      class default
         call status%set(dynstep_invalid_input, method//' steps mechanical systems M q" = f; this system ' &
            & //'is of first order: choose a method for those')
      end select
   end subroutine check_mechanical

   !> The method fits the system, and the start is one of it.  What else a state holds gets the
   !> size that belongs to the system; the switch functions of the system tell its sides.
   recursive subroutine check_start(stepper, sys, state, status)
      class(stepper_type), intent(in) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state
      type(status_type), intent(inout) :: status
      integer :: m, p, ierr

      if (status%failed()) return
      if (.not. stepper%fits(sys)) then
         call status%set(dynstep_invalid_input, 'the method has not been prepared for this system of n = ' &
            & //text(sys%n)//' unknowns and its structure; call init before start, and again after changes of these')
         return
      end if
      call check_state('the start', sys, state, status)
      call check_samples(sys, status)
      if (status%failed()) return
      if (allocated(state%a)) then
         if (size(state%a) /= sys%n) deallocate (state%a)
      end if
      if (.not. allocated(state%a)) allocate (state%a(sys%n), source=0.0_wp)
      call multiplier_counts(sys, m, p)
      call resize(state%lambda, m)
      call resize(state%psi, p)
      call sys%find_sides(state%t, state%y, ierr)
      if (ierr /= 0) call status%set(dynstep_callback_failed, 'switch_values refused the start at t = '//text(state%t) &
         & //', or returned a value that is not finite')
   end subroutine check_start

   !> A load by samples is one of this system: its matrices may have been set again with another order
   recursive subroutine check_samples(sys, status)
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      select type (sys)
      class is (linear_system)
         if (sys%load_kind == load_samples) call sys%table%check(sys%n, status)
      class is (linear_ode)
         if (sys%source_kind == load_samples) call sys%table%check(sys%n, status)
      end select
   end subroutine check_samples

   !> x [n], zero where it had another length
   pure subroutine resize(x, n)
      real(wp), allocatable, intent(inout) :: x(:)
      integer, intent(in) :: n
      if (allocated(x)) then
         if (size(x) /= n) deallocate (x)
      end if
      if (.not. allocated(x)) allocate (x(n), source=0.0_wp)
   end subroutine resize

   !> t and y have the shape and the values of a state
   recursive subroutine check_state(name, sys, state, status)
      character(len=*), intent(in) :: name       !! for the sentence
      class(ode_system), intent(in) :: sys
      type(state_type), intent(in) :: state
      type(status_type), intent(inout) :: status
      integer :: i
      if (status%failed()) return
      if (.not. allocated(state%y)) then
         call status%set(dynstep_invalid_input, name//' has no state vector: set y = [q; v]')
         return
      end if
      if (size(state%y) /= sys%state_size()) then
         call status%set(dynstep_invalid_input, name//' has '//text(size(state%y))//' numbers in y, the system ' &
            & //text(sys%state_size()))
         return
      end if
      if (.not. ieee_is_finite(state%t)) then
         call status%set(dynstep_invalid_input, 'the time of '//name//' is '//text(state%t))
         return
      end if
      do i = 1, size(state%y)
         if (ieee_is_finite(state%y(i))) cycle
         call status%set(dynstep_invalid_input, name//' has '//text(state%y(i))//' in component '//text(i) &
            & //' of y = [q; v]')
         return
      end do
   end subroutine check_state
end module dynstep_start_check
