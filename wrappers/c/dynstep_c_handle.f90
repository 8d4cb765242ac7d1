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
   use dynstep_c_points, only: point_buffer
   use dynstep_c_systems, only: c_linear_system, c_observer, c_system
   use dynstep_flat_method, only: method_settings
   use dynstep_integrate, only: integration_type
   use dynstep_kinds, only: long
   use dynstep_matrix, only: identity_matrix, matrix_type, zero_matrix
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_in_use, dynstep_invalid_handle, dynstep_success, status_type
   use dynstep_stepper, only: clock_type, state_type, stepper_type
   implicit none
   private

   public :: create_handle, destroy_handle, integrator_of, reach, change

   type, public :: integrator_type
      integer :: n = 0
      ! settings
      type(c_system) :: general
      logical :: declared_linear = .false.       !! of the force of `general`
      type(c_linear_system) :: linear
      type(matrix_type) :: m, c, k               !! of a linear system; m also of a general one
      logical :: has_matrices = .false.          !! one of them was set
      type(method_settings) :: method
      type(c_observer) :: observer
      ! what is made from them
      logical :: assembled = .false.             !! the next two fit the settings
      class(mechanical_system), pointer :: sys => null()    !! to `general` or `linear`
      class(stepper_type), allocatable :: stepper
      ! where it stands
      logical :: started = .false.
      type(state_type) :: state
      type(clock_type) :: step_clock             !! of single steps
      logical :: running = .false.               !! a run was begun
      type(integration_type) :: run
      type(point_buffer) :: points
      integer :: recording = 0                   !! of this run: 1 yes, -1 no, 0 not known yet
      integer(long) :: steps_before = 0          !! steps made when the run was begun
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
   recursive function create_handle(n) result(handle)
      integer, intent(in) :: n
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
      s%general%n = n
      s%linear%n = n
      s%observer%n = n
      s%points%n = n
      s%m = identity_matrix(n)
      s%c = zero_matrix(n)
      s%k = zero_matrix(n)
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

   !> Settings are changed: what was made from them does not fit any more
   recursive subroutine change(s)
      type(integrator_type), intent(inout) :: s
      s%assembled = .false.
      s%started = .false.
      s%running = .false.
   end subroutine change
end module dynstep_c_handle
