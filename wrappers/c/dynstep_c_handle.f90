! SPDX-License-Identifier: BSD-3-Clause
!> What is behind a handle of dynstep.h, and how a handle is told from a number that is none.
!>
!> A handle is the address of a small control block, with a tag in its upper 16 bits (user
!> addresses have 48).  The block has the same tag, a cookie made from its address, and the
!> address of the integrator.  Without any list of handles, which would be a global variable,
!>
!>   a small integer, or a handle cut to 32 bits   has no tag (0 and 65535 are none)
!>   a deleted handle       the cookie is wiped out before the block is freed; the allocator's
!>                          own marks go into the padding in front of it
!>   ... whose place has a new block               has another tag (one of 65534, by the clock)
!>
!> Where an address uses its upper 16 bits (pointer tagging by the operating system), there is
!> no room for a tag and no handle is made.
module dynstep_c_handle
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_int, c_int64_t, c_intptr_t, c_loc, c_null_ptr, c_ptr
   use dynstep_c_events, only: c_events
   use dynstep_c_odes, only: c_linear_ode, c_ode_system
   use dynstep_c_points, only: point_buffer
   use dynstep_c_systems, only: c_linear_system, c_observer, c_system
   use dynstep_flat_method, only: base_backinterpolation, method_settings
   use dynstep_run, only: run_type
   use dynstep_kinds, only: long, wp
   use dynstep_matrix, only: identity_matrix, matrix_type, zero_matrix
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: dynstep_in_use, dynstep_invalid_handle, dynstep_invalid_input, dynstep_success, status_type
   use dynstep_stepper, only: clock_type, state_type, stepper_type
   implicit none
   private

   public :: create_handle, destroy_handle, integrator_of, reach, reach_mechanical, reach_first_order, change
   public :: check_started, tell_sides

   type, public :: integrator_type
      integer :: n = 0
      logical :: first_order = .false.           !! y' = f(t,y), else a mechanical system
      ! settings of a mechanical system
      type(c_system) :: general
      logical :: declared_linear = .false.       !! of the force of `general`
      type(c_linear_system) :: linear
      type(matrix_type) :: m, c, k               !! of a linear system; m also of a general one
      logical :: has_matrices = .false.          !! one of them was set
      real(wp), allocatable :: coupling(:, :)    !! b, k and c of a linear system [n, 3]
      ! settings of a first-order system
      type(c_ode_system) :: ode
      type(c_linear_ode) :: linear_ode
      type(matrix_type), allocatable :: a        !! of the linear one, where it was set
      ! settings of both
      type(method_settings) :: method
      type(c_observer) :: observer
      type(c_events) :: events
      ! what is made from them
      logical :: assembled = .false.             !! the next two fit the settings
      class(ode_system), pointer :: sys => null()   !! to `general` or `linear`, to `ode` or `linear_ode`
      class(stepper_type), allocatable :: stepper
      ! where it stands
      logical :: started = .false.
      type(state_type) :: state
      type(clock_type) :: step_clock             !! of single steps
      logical :: running = .false.               !! a run was begun
      class(run_type), allocatable :: run        !! with steps of one length, or steps that follow an error estimate
      type(point_buffer) :: points
      logical :: wants_nodes = .false.           !! runs that are begun record points inside steps, too
      logical :: is_tuned = .false.              !! the stepper was prepared for tolerances
      integer(long) :: restored_steps = 0        !! that were made before a checkpoint
      integer :: recording = 0                   !! of this run: 1 yes, -1 no, 0 not known yet
      type(status_type) :: held                  !! outcome that waits for its points
      type(status_type) :: status
      logical :: busy = .false.                  !! user functions may be active
   end type integrator_type

   type, bind(c) :: control_block
      integer(c_int64_t) :: padding(4)
      integer(c_int64_t) :: cookie
      integer(c_int64_t) :: tag
      type(c_ptr) :: object
   end type control_block

   integer(c_int64_t), parameter :: magic = 7239876120954471173_c_int64_t
   integer, parameter :: tag_shift = 48
   !> A handle of 32 bits has no tag
   logical, parameter :: handles_are_wide = digits(1_c_intptr_t) == 63

contains

   !> A new integrator and its handle; 0 where there is no memory
   recursive function create_handle(n, first_order) result(handle)
      integer, intent(in) :: n
      logical, intent(in) :: first_order
      integer(c_intptr_t) :: handle
      type(integrator_type), pointer :: s
      type(control_block), pointer :: block
      integer(c_intptr_t) :: address
      integer :: stat

      handle = 0
      s => null()
      allocate (block, stat=stat)
      if (stat /= 0) return
      address = transfer(c_loc(block), address)
      if (.not. handles_are_wide .or. shiftr(address, tag_shift) == 0) allocate (s, stat=stat)
      if (stat /= 0 .or. .not. associated(s)) then
         deallocate (block)
         return
      end if
      s%n = n
      s%first_order = first_order
      s%observer%n = n
      s%points%n = n
      s%events%n = n
      if (first_order) then
         s%method%base = base_backinterpolation
         s%ode%n = n
         s%linear_ode%n = n
      else
         s%general%n = n
         s%linear%n = n
         s%m = identity_matrix(n)
         s%c = zero_matrix(n)
         s%k = zero_matrix(n)
      end if
      block%padding = 0
      block%cookie = cookie_of(address)
      block%tag = 0
      block%object = c_loc(s)
      if (handles_are_wide) block%tag = new_tag()
      handle = address
      if (handles_are_wide) handle = ior(address, shiftl(int(block%tag, c_intptr_t), tag_shift))
   end function create_handle

   !> Between 1 and 65534, by the clock
   recursive function new_tag() result(tag)
      integer(c_int64_t) :: tag
      integer(c_int64_t) :: ticks
      call system_clock(ticks)
      tag = 1 + modulo(ieor(ticks, shiftr(ticks, 16)), 65534_c_int64_t)
   end function new_tag

   pure integer(c_int64_t) function cookie_of(address)
      integer(c_intptr_t), intent(in) :: address
      cookie_of = ieor(magic, int(address, c_int64_t))
   end function cookie_of

   !> The control block of a handle, or null
   recursive function block_of(handle) result(block)
      integer(c_intptr_t), intent(in) :: handle
      type(control_block), pointer :: block
      integer(c_intptr_t) :: address
      integer(c_int64_t) :: tag

      block => null()
      tag = 0
      address = handle
      if (handles_are_wide) then
         address = ibits(handle, 0, tag_shift)
         tag = shiftr(handle, tag_shift)
         if (tag == 0 .or. tag == 65535) return
      end if
      ! the first page is never there, and allocated memory is aligned to two addresses
      if (shiftr(address, 12) == 0 .or. modulo(address, int(2*storage_size(address)/8, c_intptr_t)) /= 0) return
      call c_f_pointer(transfer(address, c_null_ptr), block)
      if (block%cookie /= cookie_of(address) .or. block%tag /= tag) block => null()
   end function block_of

   !> The integrator of a handle, or null
   recursive function integrator_of(handle) result(s)
      integer(c_intptr_t), intent(in) :: handle
      type(integrator_type), pointer :: s
      type(control_block), pointer :: block
      s => null()
      block => block_of(handle)
      if (associated(block)) call c_f_pointer(block%object, s)
   end function integrator_of

   !> Free the integrator of a valid handle, and make the handle invalid
   recursive subroutine destroy_handle(handle)
      integer(c_intptr_t), intent(inout) :: handle
      type(integrator_type), pointer :: s
      type(control_block), pointer :: block
      s => integrator_of(handle)
      block => block_of(handle)
      deallocate (s)
      call wipe(block)
      deallocate (block)
      handle = 0
   end subroutine destroy_handle

   !> Volatile, or an optimiser would leave out stores to memory that is freed next
   recursive subroutine wipe(block)
      type(control_block), intent(inout), volatile :: block
      block%cookie = 0
      block%tag = 0
   end subroutine wipe

   !> The integrator of a handle for a call that may do work; its status is cleared.  Another
   !> code than success says why not, and the integrator is left alone.
   recursive function reach(handle, s) result(code)
      integer(c_intptr_t), intent(in) :: handle
      type(integrator_type), pointer, intent(out) :: s
      integer(c_int) :: code
      code = dynstep_invalid_handle
      s => integrator_of(handle)
      if (.not. associated(s)) return
      code = dynstep_in_use
      if (s%busy) return
      code = dynstep_success
      call s%status%clear()
   end function reach

   !> The same for functions that only mechanical systems have
   recursive function reach_mechanical(handle, name, s, instead) result(code)
      integer(c_intptr_t), intent(in) :: handle
      character(len=*), intent(in) :: name                !! of the function, for the sentence
      type(integrator_type), pointer, intent(out) :: s
      character(len=*), intent(in), optional :: instead   !! the function that first-order systems have
      integer(c_int) :: code
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (.not. s%first_order) return
      if (present(instead)) then
         call s%status%set(dynstep_invalid_input, name//' is for mechanical systems, and this handle is one of ' &
            & //'dynstep_new_ode: call '//instead)
      else
         call s%status%set(dynstep_invalid_input, name//' is for mechanical systems, and this handle is one of ' &
            & //'dynstep_new_ode')
      end if
      code = s%status%code
   end function reach_mechanical

   !> The same for functions that only first-order systems have
   recursive function reach_first_order(handle, name, s) result(code)
      integer(c_intptr_t), intent(in) :: handle
      character(len=*), intent(in) :: name
      type(integrator_type), pointer, intent(out) :: s
      integer(c_int) :: code
      code = reach(handle, s)
      if (code /= dynstep_success) return
      if (s%first_order) return
      call s%status%set(dynstep_invalid_input, name//' is for first-order systems, and this handle is one of dynstep_new: ' &
         & //'make it by dynstep_new_ode')
      code = s%status%code
   end function reach_first_order

   !> There is a state to go on from
   recursive subroutine check_started(s)
      type(integrator_type), intent(inout) :: s
      if (s%status%failed() .or. s%started) return
      if (s%first_order) then
         call s%status%set(dynstep_invalid_input, 'call dynstep_start_ode first, and again after a set function')
      else
         call s%status%set(dynstep_invalid_input, 'call dynstep_start first, and again after a set function')
      end if
   end subroutine check_started

   !> The caller's copy of the sides fits this integrator: another one may have written there since
   recursive subroutine tell_sides(s)
      type(integrator_type), intent(inout) :: s
      if (s%sys%switches > 0) call s%sys%sides_changed()
   end subroutine tell_sides

   !> Settings are changed: what was made from them does not fit any more
   recursive subroutine change(s)
      type(integrator_type), intent(inout) :: s
      s%assembled = .false.
      s%started = .false.
      s%running = .false.
   end subroutine change
end module dynstep_c_handle
