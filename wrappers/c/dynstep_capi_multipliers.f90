! SPDX-License-Identifier: BSD-3-Clause
!> Flat C interface: multipliers, and how well the constraints hold.  `dynstep.h` describes each function.
module dynstep_capi_multipliers
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_intptr_t, c_ptr
   use dynstep_c_assembly, only: assemble_system
   use dynstep_c_handle, only: check_started, integrator_type, reach, reach_mechanical
   use dynstep_c_text, only: give, take_point
   use dynstep_jacobian, only: jacobian_type
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input, dynstep_not_finite, dynstep_success, &
      & status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: dynstep_get_multipliers, dynstep_record_multipliers, dynstep_residuals

contains

   recursive function dynstep_get_multipliers(handle, m, lambda, p, psi) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: m
      type(c_ptr), value :: lambda
      integer(c_int), value :: p
      type(c_ptr), value :: psi
      integer(c_int) :: code
      type(integrator_type), pointer :: s

      code = reach(handle, s)
      if (code /= dynstep_success) return
      call check_numbers(s, m, p, s%status)
      call check_started(s)
      code = s%status%code
      if (code /= dynstep_success) return
      call give(s%state%lambda, lambda)
      call give(s%state%psi, psi)
   end function dynstep_get_multipliers

   recursive function dynstep_record_multipliers(handle, count, m, lambda_out, p, psi_out) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: count, m
      type(c_ptr), value :: lambda_out
      integer(c_int), value :: p
      type(c_ptr), value :: psi_out
      integer(c_int) :: code
      type(integrator_type), pointer :: s

      code = reach(handle, s)
      if (code /= dynstep_success) return
      call check_numbers(s, m, p, s%status)
      if (.not. s%status%failed() .and. .not. s%running) call s%status%set(dynstep_invalid_input, &
         & 'call dynstep_begin and dynstep_proceed first, and again after start and single steps')
      if (.not. s%status%failed() .and. count /= s%points%count) call s%status%set(dynstep_invalid_input, &
         & 'count = '//text(count)//', but the last dynstep_proceed wrote '//text(s%points%count)//' points')
      code = s%status%code
      if (code /= dynstep_success .or. count == 0) return
      if (m > 0) call give_points(s%points%lambda, lambda_out)
      if (p > 0) call give_points(s%points%psi, psi_out)

   contains

      recursive subroutine give_points(from, to)
         real(wp), intent(in) :: from(:, :)
         type(c_ptr), intent(in) :: to
         real(c_double), pointer :: x(:, :)
         if (.not. c_associated(to)) return
         call c_f_pointer(to, x, [size(from, 1), int(count)])
         x = from(:, :count)
      end subroutine give_points
   end function dynstep_record_multipliers

   !> The caller knows the system
   recursive subroutine check_numbers(s, m, p, status)
      type(integrator_type), intent(in) :: s
      integer(c_int), intent(in) :: m, p
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (m /= s%general%holonomic) then
         call status%set(dynstep_invalid_input, 'm = '//text(m)//', but the system has '//text(s%general%holonomic) &
            & //' holonomic constraints')
      else if (p /= s%general%nonholonomic) then
         call status%set(dynstep_invalid_input, 'p = '//text(p)//', but the system has '//text(s%general%nonholonomic) &
            & //' constraints on velocities')
      end if
   end subroutine check_numbers

   recursive function dynstep_residuals(handle, n, t, q, v, m, g, gv, p, k) result(code) bind(c)
      integer(c_intptr_t), value :: handle
      integer(c_int), value :: n
      real(c_double), value :: t
      type(c_ptr), value :: q, v
      integer(c_int), value :: m
      type(c_ptr), value :: g, gv
      integer(c_int), value :: p
      type(c_ptr), value :: k
      integer(c_int) :: code
      type(integrator_type), pointer :: s
      real(c_double), pointer :: q0(:), v0(:)

      code = reach_mechanical(handle, 'dynstep_residuals', s)
      if (code /= dynstep_success) return
      call take_point(s%n, n, t, q, v, q0, v0, s%status)
      call check_numbers(s, m, p, s%status)
      if (.not. s%assembled) call assemble_system(s)
      if (.not. s%status%failed()) then
         s%busy = .true.
         select type (sys => s%sys)
         class is (mechanical_system)
            call residuals(sys, t, q0, v0, g, gv, k, s%status)
         end select
         s%busy = .false.
      end if
      code = s%status%code
   end function dynstep_residuals

   !> g, G v + dg/dt and k; what is not wanted is not evaluated
   recursive subroutine residuals(sys, t, q, v, g, gv, k, status)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t, q(:), v(:)
      type(c_ptr), intent(in) :: g, gv, k
      type(status_type), intent(inout) :: status
      type(jacobian_type) :: jacobian
      real(wp), allocatable :: x(:), gt(:)
      integer :: ierr
      if (sys%holonomic > 0 .and. c_associated(g)) then
         allocate (x(sys%holonomic))
         call sys%constraint(t, q, x, ierr)
         call give_checked('constraint', x, ierr, t, g, status)
         deallocate (x)
      end if
      if (sys%holonomic > 0 .and. c_associated(gv) .and. .not. status%failed()) then
         allocate (x(sys%holonomic), gt(sys%holonomic))
         call jacobian%init(sys%holonomic, sys%n, sys%constraints%g, status)
         gt = 0.0_wp
         x = 0.0_wp
         ierr = 0
         if (.not. status%failed()) call sys%constraint_jacobian(t, q, jacobian, gt, ierr)
         if (.not. status%failed() .and. ierr == 0) call jacobian%multiply(v, x)
         call give_checked('constraint_jacobian', x + gt, ierr, t, gv, status)
         deallocate (x)
      end if
      if (sys%nonholonomic > 0 .and. c_associated(k) .and. .not. status%failed()) then
         allocate (x(sys%nonholonomic))
         call sys%velocity_constraint(t, q, v, x, ierr)
         call give_checked('velocity_constraint', x, ierr, t, k, status)
      end if
   end subroutine residuals

   recursive subroutine give_checked(name, x, ierr, t, to, status)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: x(:)
      integer, intent(in) :: ierr
      real(wp), intent(in) :: t
      type(c_ptr), intent(in) :: to
      type(status_type), intent(inout) :: status
      integer :: i
      if (status%failed()) return
      if (ierr /= 0) then
         call status%set(dynstep_callback_failed, name//' gave up at t = '//text(t)//' (ierr = '//text(ierr)//')')
         return
      end if
      do i = 1, size(x)
         if (ieee_is_finite(x(i))) cycle
         call status%set(dynstep_not_finite, name//' returned '//text(x(i))//' in row '//text(i)//' at t = '//text(t))
         return
      end do
      call give(x, to)
   end subroutine give_checked
end module dynstep_capi_multipliers
