! SPDX-License-Identifier: BSD-3-Clause
!> Numbers of substeps of an extrapolation, and its weights (Austin 1991, section 4).
module dynstep_sequences
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: substep_numbers, extrapolation_weights, sequence_name

   integer, parameter, public :: sequence_romberg = 1           !! 1, 2, 4, 8, 16, ...
   integer, parameter, public :: sequence_bulirsch = 2          !! 1, 2, 4, 6, 8, 12, 16, 24, ...
   integer, parameter, public :: sequence_harmonic = 3          !! 1, 2, 3, 4, ...
   integer, parameter, public :: sequence_double_harmonic = 4   !! 2, 4, 6, 8, ...
   integer, parameter, public :: sequence_custom = 5            !! the user's own
   integer, parameter, public :: sequence_automatic = 6         !! harmonic; double harmonic under a tight tolerance
   integer, parameter, public :: most_levels = 12

   !> Largest number of substeps: squares and their differences stay exact in an integer
   integer, parameter, public :: most_substeps = 30000

contains

   !> The first `levels` numbers of a sequence
   recursive subroutine substep_numbers(sequence, levels, custom, numbers, status)
      integer, intent(in) :: sequence                   !! one of the constants above
      integer, intent(in) :: levels                     !! 1 .. most_levels
      integer, allocatable, intent(in) :: custom(:)     !! read for sequence_custom
      integer, allocatable, intent(out) :: numbers(:)   !! [levels]
      type(status_type), intent(inout) :: status
      integer :: j

      if (status%failed()) return
      if (levels < 1 .or. levels > most_levels) then
         call status%set(dynstep_invalid_input, 'levels = '//text(levels)//' must be 1 to '//text(most_levels))
         return
      end if
      allocate (numbers(levels))
      select case (sequence)
      case (sequence_romberg)
         numbers = [(2**(j - 1), j=1, levels)]
      case (sequence_bulirsch)
         ! powers of two, and from 6 on three halves of each between them
         do j = 1, levels
            numbers(j) = merge(3*2**(j/2 - 1), 2**((j + 1)/2), mod(j, 2) == 0)
         end do
         numbers(:min(2, levels)) = [(j, j=1, min(2, levels))]
      case (sequence_harmonic, sequence_automatic)
         numbers = [(j, j=1, levels)]
      case (sequence_double_harmonic)
         numbers = [(2*j, j=1, levels)]
      case (sequence_custom)
         call take_custom(levels, custom, numbers, status)
      case default
         call status%set(dynstep_invalid_input, 'sequence = '//text(sequence)//' is not one of romberg (1), ' &
            & //'bulirsch (2), harmonic (3), double harmonic (4), custom (5), automatic (6)')
      end select
   end subroutine substep_numbers

   recursive subroutine take_custom(levels, custom, numbers, status)
      integer, intent(in) :: levels
      integer, allocatable, intent(in) :: custom(:)
      integer, intent(out) :: numbers(levels)
      type(status_type), intent(inout) :: status
      integer :: j

      numbers = 1
      if (.not. allocated(custom)) then
         call status%set(dynstep_invalid_input, 'the custom sequence has no numbers')
         return
      end if
      if (size(custom) < levels) then
         call status%set(dynstep_invalid_input, 'the custom sequence has '//text(size(custom)) &
            & //' numbers for '//text(levels)//' levels')
         return
      end if
      numbers = custom(:levels)
      do j = 1, levels
         if (numbers(j) < 1 .or. numbers(j) > most_substeps) then
            call status%set(dynstep_invalid_input, 'number '//text(j)//' of the custom sequence, ' &
               & //text(numbers(j))//', must be 1 to '//text(most_substeps))
            return
         end if
         if (all(numbers(j) > numbers(:j - 1))) cycle
         call status%set(dynstep_invalid_input, 'the custom sequence must increase, and number '//text(j)//', ' &
            & //text(numbers(j))//', does not')
         return
      end do
   end subroutine take_custom

   !> Weights w of the column sums that the Neville table of even powers ends in:
   !> result = sum of w(j) u(j), w(j) = product over i /= j of n(j)^2/(n(j)^2 - n(i)^2).
   !> Equation (19) of the paper for Romberg's numbers, this for any.  Where the errors of the base begin with h^r,
   !> the powers to be removed are n^-r, n^-(r+2), ...: the same weights times n^(r-2), scaled to a sum of 1.
   pure function extrapolation_weights(numbers, base_order) result(weights)
      integer, intent(in) :: numbers(:)
      integer, intent(in), optional :: base_order        !! r, even; default 2
      real(wp) :: weights(size(numbers))
      integer :: i, j
      weights = 1.0_wp
      do j = 1, size(numbers)
         do i = 1, size(numbers)
            if (i /= j) weights(j) = weights(j)*(real(numbers(j)**2, wp)/real(numbers(j)**2 - numbers(i)**2, wp))
         end do
      end do
      if (.not. present(base_order)) return
      if (base_order <= 2) return
      weights = weights*(real(numbers, wp)/real(maxval(numbers), wp))**(base_order - 2)
      weights = weights/sum(weights)
   end function extrapolation_weights

   pure function sequence_name(sequence) result(name)
      integer, intent(in) :: sequence
      character(len=15) :: name
      select case (sequence)
      case (sequence_romberg); name = 'romberg'
      case (sequence_bulirsch); name = 'bulirsch'
      case (sequence_harmonic); name = 'harmonic'
      case (sequence_double_harmonic); name = 'double-harmonic'
      case (sequence_custom); name = 'custom'
      case (sequence_automatic); name = 'automatic'
      case default; name = 'unknown'
      end select
   end function sequence_name
end module dynstep_sequences
