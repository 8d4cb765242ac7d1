! SPDX-License-Identifier: BSD-3-Clause
!> All methods of the library by name; the one file that lists them.
!>
!>     call new_method('newmark-extrapolation', stepper, status)
!>
!> gives a stepper with its default coefficients, ready for `init`.  A new method is named here
!> twice, in METHOD_NAMES and in NEW_METHOD; the table of the README runs over METHOD_NAMES.
module dynstep_methods
   use dynstep_alpha_coefficients, only: hht_coefficients
   use dynstep_backinterpolation, only: backinterpolation_stepper
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_generalized_alpha, only: generalized_alpha_stepper
   use dynstep_kinds, only: wp
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
   use dynstep_pade, only: pade_stepper
   use dynstep_soi2, only: soi2_stepper, variant_index3, variant_soi2
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_stepper, only: stepper_type
   implicit none
   private

   public :: new_method

   integer, parameter :: name_length = 24

   !> alpha of the methods named hht: the value that structural codes use most
   real(wp), parameter :: hht_alpha = -0.1_wp

   character(len=name_length), parameter, public :: method_names(*) = [character(len=name_length) :: &
      & 'newmark', &
      & 'linear-acceleration', &
      & 'fox-goodwin', &
      & 'central-difference', &
      & 'midpoint', &
      & 'newmark-extrapolation', &
      & 'midpoint-extrapolation', &
      & 'generalized-alpha', &
      & 'hht', &
      & 'soi2', &
      & 'hht-soi2', &
      & 'hht-i3', &
      & 'pade', &
      & 'bi', &
      & 'bi45', &
      & 'bi-extrapolation']

contains

   !> The method of a name, with default coefficients; not allocated where the call fails
   recursive subroutine new_method(name, stepper, status)
      character(len=*), intent(in) :: name                         !! one of method_names
      class(stepper_type), allocatable, intent(out) :: stepper
      type(status_type), intent(inout) :: status
      class(stepper_type), allocatable :: base
      type(generalized_alpha_stepper), allocatable :: alpha

      if (status%failed()) return
      select case (name)
      case ('newmark')
         call new_newmark(0.25_wp, stepper)
      case ('linear-acceleration')
         call new_newmark(1.0_wp/6.0_wp, stepper)
      case ('fox-goodwin')
         call new_newmark(1.0_wp/12.0_wp, stepper)
      case ('central-difference')
         call new_newmark(0.0_wp, stepper)
      case ('midpoint')
         allocate (midpoint_stepper :: stepper)
      case ('newmark-extrapolation')
         call new_newmark(0.25_wp, base)
         call new_extrapolation(base, stepper)
      case ('midpoint-extrapolation')
         allocate (midpoint_stepper :: base)
         call new_extrapolation(base, stepper)
      case ('generalized-alpha')
         allocate (generalized_alpha_stepper :: stepper)
      case ('hht')
         allocate (alpha)
         call hht_coefficients(hht_alpha, alpha%coefficients, status)
         call move_alloc(alpha, stepper)
      case ('soi2')
         allocate (soi2_stepper :: stepper)
      case ('hht-soi2')
         call new_hht(variant_soi2, stepper, status)
      case ('hht-i3')
         call new_hht(variant_index3, stepper, status)
      case ('pade')
         allocate (pade_stepper :: stepper)
      case ('bi')
         allocate (backinterpolation_stepper :: stepper)
      case ('bi45')
         call new_bi45(stepper)
      case ('bi-extrapolation')
         allocate (backinterpolation_stepper :: base)
         call new_extrapolation(base, stepper)
      case default
         call status%set(dynstep_invalid_input, 'there is no method '''//trim(name)//'''; there are ' &
            & //trim(all_names()))
      end select
   end subroutine new_method

   !> Newmark's method with gamma = 1/2
   recursive subroutine new_newmark(beta, stepper)
      real(wp), intent(in) :: beta
      class(stepper_type), allocatable, intent(out) :: stepper
      type(newmark_stepper), allocatable :: newmark
      allocate (newmark)
      newmark%beta = beta
      call move_alloc(newmark, stepper)
   end subroutine new_newmark

   !> HHT-alpha on systems with constraints
   recursive subroutine new_hht(variant, stepper, status)
      integer, intent(in) :: variant
      class(stepper_type), allocatable, intent(out) :: stepper
      type(status_type), intent(inout) :: status
      type(soi2_stepper), allocatable :: soi2
      allocate (soi2)
      soi2%variant = variant
      call hht_coefficients(hht_alpha, soi2%coefficients, status)
      call move_alloc(soi2, stepper)
   end subroutine new_hht

   !> Orders 4 and 5 with the alpha in the middle of [0.43622, 0.44861], where |R| <= 1 on the imaginary axis
   recursive subroutine new_bi45(stepper)
      class(stepper_type), allocatable, intent(out) :: stepper
      type(backinterpolation_stepper), allocatable :: bi
      allocate (bi)
      bi%q = 5
      bi%alpha = 0.44_wp
      call move_alloc(bi, stepper)
   end subroutine new_bi45

   !> Extrapolation with the default levels and sequence; `base` is used up
   recursive subroutine new_extrapolation(base, stepper)
      class(stepper_type), allocatable, intent(inout) :: base
      class(stepper_type), allocatable, intent(out) :: stepper
      type(extrapolation_stepper), allocatable :: extrapolation
      allocate (extrapolation)
      call move_alloc(base, extrapolation%base)
      call move_alloc(extrapolation, stepper)
   end subroutine new_extrapolation

   !> The names with commas between them
   pure function all_names() result(words)
      character(len=(name_length + 2)*size(method_names)) :: words
      integer :: i
      words = method_names(1)
      do i = 2, size(method_names)
         words = trim(words)//', '//method_names(i)
      end do
   end function all_names
end module dynstep_methods
