! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: start, single steps, and what can be asked in between.  `dynstep.h`
!> describes each function.
module dynstep_capi_steps
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_intptr_t, c_long_long, c_ptr
   use dynstep_c_assembly, only: assemble, assemble_system, start_at
   use dynstep_c_handle, only: check_started, integrator_type, reach, reach_mechanical, tell_sides
   use dynstep_c_text, only: give, put_text, take_point
   use dynstep_check_system, only: check_system, finding_length
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input, dynstep_not_finite, dynstep_success, &
      & status_type
   use dynstep_stepper, only: clock_type, state_type
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_check, dynstep_start, dynstep_step, dynstep_get
   public :: dynstep_energy, dynstep_counts, dynstep_count_name

   !> DYNSTEP_COUNTS of dynstep.h
   integer, parameter :: number_of_counts = 11

contains

   recursive function dynstep_check(handle, n, t, q, v, length, report) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: n
      real(c_double), value :: t
      type(c_ptr), value :: q, v
      integer(c_int), value :: length
      type(c_ptr), value :: report
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      real(c_double), pointer :: q0(:), v0(:)
      character(len=finding_length), allocatable :: findings(:)

      code = reach_mechanical(handle, 'dynstep_check', s)
      if (code /= dynstep_success) return
      call put_text('', length, report)
      call take_point(s%n, n, t, q, v, q0, v0, s%status)
      if (.not. s%assembled) call assemble_system(s)
      if (.not. s%status%failed()) then
         s%busy = .true.
         select type (sys => s%sys)
         class is (mechanical_system)
            call check_system(sys, t, q0, v0, findings, s%status)
         end select
         s%busy = .false.
      end if
      if (.not. allocated(findings)) allocate (findings(0))
      call put_lines(findings, s%status%message, length, report)
      code = s%status%code
   end function dynstep_check

   !> All findings, a line each, or the message where there are none
   recursive subroutine put_lines(findings, message, length, report)
      character(len=*), intent(in) :: findings(:), message
      integer(c_int), intent(in) :: length
      type(c_ptr), intent(in) :: report
      character(len=max(len(findings) + 1, 1)*size(findings) + len(message)) :: lines
      integer :: i
      lines = message
      if (size(findings) > 0) lines = findings(1)
      do i = 2, size(findings)
         lines = trim(lines)//new_line('a')//findings(i)
      end do
      call put_text(trim(lines), length, report)
   end subroutine put_lines

   recursive function dynstep_start(handle, n, t, q, v) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: n
      real(c_double), value :: t
      type(c_ptr), value :: q, v
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      real(c_double), pointer :: q0(:), v0(:)

      code = reach_mechanical(handle, 'dynstep_start', s, 'dynstep_start_ode')
      if (code /= dynstep_success) return
      call take_point(s%n, n, t, q, v, q0, v0, s%status)
      call assemble(s)
      code = s%status%code
      if (code /= dynstep_success) return
      s%state%y(1:n) = q0
      s%state%y(n + 1:) = v0
      call start_at(s, t)
      code = s%status%code
   end function dynstep_start

   !> h is finite and not lost in the rounding of t; a NaN is not compared, which may trap
   pure logical function moves(h, t)
      real(wp), intent(in) :: h, t
      moves = ieee_is_finite(h)
      if (moves) moves = abs(h) > spacing(t)
   end function moves

   recursive function dynstep_step(handle, h) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      real(c_double), value :: h
      integer(c_int) :: code
      type(integrator_type), pointer :: s

      code = reach(handle, s)
      if (code /= dynstep_success) return
      call check_started(s)
      if (.not. s%status%failed() .and. .not. moves(h, s%state%t)) call s%status%set(dynstep_invalid_input, &
         & 'h = '//text(h)//' must be finite and not vanish beside t = '//text(s%state%t))
      code = s%status%code
      if (code /= dynstep_success) return
      s%running = .false.
      ! the clock goes on where the last step was one of this length
      if (abs(s%step_clock%h - h) > 0.0_wp .or. abs(s%step_clock%time() - s%state%t) > 0.0_wp) &
         & s%step_clock = clock_type(t0=s%state%t, h=h, k=0)
      call tell_sides(s)
      s%busy = .true.
      call s%stepper%advance(s%sys, s%state, s%step_clock, 1, s%status, complete=.true.)
      s%busy = .false.
      code = s%status%code
   end function dynstep_step

   recursive function dynstep_get(handle, n, t, q, v, a) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: n
      type(c_ptr), value :: t, q, v, a
      integer(c_int) :: code
      type(integrator_type), pointer :: s

      code = reach_mechanical(handle, 'dynstep_get', s, 'dynstep_get_ode')
      if (code /= dynstep_success) return
      if (n /= s%n) call s%status%set(dynstep_invalid_input, 'n = '//text(n)//', but the system has '//text(s%n) &
         & //' coordinates')
      call check_started(s)
      code = s%status%code
      if (code /= dynstep_success) return
      call give([s%state%t], t)
      call give(s%state%y(1:n), q)
      call give(s%state%y(n + 1:), v)
      call give(s%state%a, a)
   end function dynstep_get

   recursive function dynstep_energy(handle, energy) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      type(c_ptr), value :: energy
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      real(c_double), pointer :: e

      code = reach_mechanical(handle, 'dynstep_energy', s)
      if (code /= dynstep_success) return
      if (.not. c_associated(energy)) call s%status%set(dynstep_invalid_input, 'energy is NULL')
      call check_started(s)
      if (.not. s%status%failed()) then
         call c_f_pointer(energy, e)
         s%busy = .true.
         select type (sys => s%sys)
         class is (mechanical_system)
            call evaluate_energy(sys, s%state, e, s%status)
         end select
         s%busy = .false.
      end if
      code = s%status%code
   end function dynstep_energy

   recursive subroutine evaluate_energy(sys, state, energy, status)
      class(mechanical_system), intent(inout) :: sys
      type(state_type), intent(in) :: state
      real(wp), intent(inout) :: energy
      type(status_type), intent(inout) :: status
      integer :: ierr
      if (.not. sys%structure%has_energy) then
         call status%set(dynstep_invalid_input, 'the system has no energy: give a function by dynstep_set_energy, ' &
            & //'or symmetric M and K of a linear system')
         return
      end if
      call sys%energy(state%t, state%y(:sys%n), state%y(sys%n + 1:), energy, ierr)
      if (ierr /= 0) then
         call status%set(dynstep_callback_failed, 'energy gave up at t = '//text(state%t)//' (ierr = '//text(ierr)//')')
      else if (.not. ieee_is_finite(energy)) then
         call status%set(dynstep_not_finite, 'energy returned '//text(energy)//' at t = '//text(state%t))
      end if
   end subroutine evaluate_energy

   recursive function dynstep_counts(handle, counts) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      type(c_ptr), value :: counts
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      integer(c_long_long), pointer :: numbers(:)

      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (.not. c_associated(counts)) then
         call s%status%set(dynstep_invalid_input, 'counts is NULL')
         code = s%status%code
         return
      end if
      call c_f_pointer(counts, numbers, [number_of_counts])
      numbers = 0
      if (.not. allocated(s%stepper)) return
      associate (c => s%stepper%count)
         numbers = [c%steps, c%substeps, c%rejections, c%forces, c%masses, c%tangents, c%factorizations, c%solves, &
            & c%newton_iterations, c%halvings, c%constraints]
      end associate
   end function dynstep_counts

   recursive function dynstep_count_name(i, length, buffer) result(code) bind(c)
      integer(c_int), value :: i, length
      type(c_ptr), value :: buffer
      integer(c_int) :: code
      character(len=17), parameter :: names(0:number_of_counts - 1) = [character(len=17) :: 'steps', 'substeps', &
         & 'rejections', 'forces', 'masses', 'tangents', 'factorizations', 'solves', 'newton_iterations', 'halvings', &
         & 'constraints']
      code = dynstep_invalid_input
      call put_text('', length, buffer)
      if (i < 0 .or. i >= number_of_counts) return
      call put_text(trim(names(i)), length, buffer)
      code = dynstep_success
   end function dynstep_count_name
end module dynstep_capi_steps
