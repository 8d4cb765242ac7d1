! SPDX-License-Identifier: BSD-3-Clause
!> The runs of Austin's Tables 4-6: x'' + 16 x = 0 over 3000 s, 100000 base steps of 0.03 s.
module oscillator_areas
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_newmark, only: newmark_stepper
   use dynstep_oscillator, only: free_oscillator
   use dynstep_sequences, only: sequence_romberg
   use dynstep_status, only: status_type
   use dynstep_stepper, only: stepper_type
   use error_areas, only: free_area, run
   use paper_table, only: paper_table_type
   implicit none
   private

   public :: standard_areas, extrapolated_areas, standard_rows, extrapolated_rows

   real(wp), parameter, public :: base_step = 0.03_wp
   integer, parameter, public :: base_steps = 100000

   character(len=*), parameter :: names(3) = [character(len=12) :: 'displacement', 'velocity', 'acceleration']

contains

   !> Standard Newmark with 15 steps in each base step; the sum is over the base points and is
   !> weighted with the base step: eq. (42)
   function standard_areas(beta) result(area)
      real(wp), intent(in) :: beta
      real(wp) :: area(4)
      type(newmark_stepper) :: stepper
      type(free_area) :: recorder
      type(linear_system) :: sys
      type(status_type) :: status
      stepper%beta = beta
      recorder%spacing = base_step
      call free_oscillator(sys, 1.0_wp, 16.0_wp, status)
      call run(stepper, sys, [1.0_wp], [0.0_wp], base_step/15, 15*base_steps, 15, recorder)
      area = recorder%area()
   end function standard_areas

   !> Four levels with Romberg's numbers of a base method
   function extrapolated_areas(base) result(area)
      class(stepper_type), intent(in) :: base
      real(wp) :: area(4)
      type(extrapolation_stepper) :: stepper
      type(free_area) :: recorder
      type(linear_system) :: sys
      type(status_type) :: status
      allocate (stepper%base, source=base)
      stepper%sequence = sequence_romberg
      stepper%levels = 4
      recorder%spacing = base_step
      call free_oscillator(sys, 1.0_wp, 16.0_wp, status)
      call run(stepper, sys, [1.0_wp], [0.0_wp], base_step, base_steps, 1, recorder)
      area = recorder%area()
   end function extrapolated_areas

   !> Displacement, velocity and acceleration by standard Newmark: as printed, and by eq. (42)
   subroutine standard_rows(table, printed, area, exact)
      type(paper_table_type), intent(inout) :: table
      character(len=*), intent(in) :: printed(3)
      real(wp), intent(in) :: area(4)               !! by eq. (42)
      real(wp), intent(in) :: exact(3)              !! in exact arithmetic, with the paper's weight
      integer :: i
      call table%section('Standard Newmark, h = dt/15, with the paper''s weight')
      do i = 1, 3
         call table%explained(trim(names(i)), printed(i), printed(i), area(i)/15, accept=1.0e-3_wp*exact(i), &
            & exact=exact(i), accept_exact=1.0e-9_wp*exact(i), reason='the sum over the base points was ' &
            & //'multiplied by the substep dt/15; eq. (42) says by their distance dt: 15 times the figure')
      end do
      call table%section('Standard Newmark by eq. (42)')
      do i = 1, 3
         call table%holds(trim(names(i)), area(i), 15*exact(i), 15*1.0e-9_wp*exact(i))
      end do
   end subroutine standard_rows

   !> Displacement, velocity and acceleration by an extrapolation
   subroutine extrapolated_rows(table, printed, area, exact, accept)
      type(paper_table_type), intent(inout) :: table
      character(len=*), intent(in) :: printed(:)
      real(wp), intent(in) :: area(4), exact(3)
      real(wp), intent(in) :: accept                !! relative, of the printed and the exact figure
      integer :: i
      do i = 1, size(printed)
         call table%agrees(trim(names(i)), printed(i), area(i), accept=accept*exact(i), &
            & exact=exact(i), accept_exact=accept*exact(i))
      end do
   end subroutine extrapolated_rows
end module oscillator_areas
