! SPDX-License-Identifier: BSD-3-Clause
!> A method as numbers, the way C and F77 callers give it, and the stepper that it makes.
module dynstep_flat_method
   use dynstep_equilibrium, only: newton_options
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_kinds, only: wp
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
   use dynstep_stepper, only: stepper_type
   implicit none
   private

   public :: build_method

   integer, parameter, public :: base_newmark = 0, base_midpoint = 1

   type, public :: method_settings
      integer :: base = base_newmark
      real(wp) :: beta = 0.25_wp, gamma = 0.5_wp
      type(newton_options) :: newton
      integer :: levels = 0                      !! 0: no extrapolation
      integer :: sequence = 0                    !! see dynstep_sequences
      integer, allocatable :: custom(:)          !! numbers of sequence_custom
   end type method_settings

contains

   !> The stepper that the settings describe
   recursive subroutine build_method(settings, stepper)
      type(method_settings), intent(in) :: settings
      class(stepper_type), allocatable, intent(out) :: stepper
      type(extrapolation_stepper), allocatable :: extrapolation

      if (settings%levels < 1) then
         call build_base(settings, stepper)
         return
      end if
      allocate (extrapolation)
      call build_base(settings, extrapolation%base)
      extrapolation%levels = settings%levels
      extrapolation%sequence = settings%sequence
      if (allocated(settings%custom)) extrapolation%custom = settings%custom
      call move_alloc(extrapolation, stepper)
   end subroutine build_method

   recursive subroutine build_base(settings, stepper)
      type(method_settings), intent(in) :: settings
      class(stepper_type), allocatable, intent(out) :: stepper
      type(newmark_stepper), allocatable :: newmark
      type(midpoint_stepper), allocatable :: midpoint

      if (settings%base == base_midpoint) then
         allocate (midpoint)
         midpoint%newton = settings%newton
         call move_alloc(midpoint, stepper)
      else
         allocate (newmark)
         newmark%beta = settings%beta
         newmark%gamma = settings%gamma
         newmark%newton = settings%newton
         call move_alloc(newmark, stepper)
      end if
   end subroutine build_base
end module dynstep_flat_method
