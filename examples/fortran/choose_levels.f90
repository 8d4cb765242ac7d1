! SPDX-License-Identifier: BSD-3-Clause
!> Which sequence and how many levels are cheapest?  q'' + 16 q = 0 over 30 s: for each choice the
!> substeps (solves of one equation) of the longest base step that reaches an accuracy.
program choose_levels
   use dynstep
   implicit none
   real(wp), parameter :: omega = 4.0_wp, t_end = 30.0_wp, accuracy(3) = [1.0e-6_wp, 1.0e-9_wp, 1.0e-12_wp]
   integer, parameter :: sequences(4) = [sequence_harmonic, sequence_double_harmonic, sequence_bulirsch, &
      & sequence_romberg]
   character(len=15), parameter :: names(4) = [character(len=15) :: 'harmonic', 'double harmonic', 'bulirsch', &
      & 'romberg']
   integer :: i, j, levels
   integer(long) :: work(3)

   print '(a, 3es10.0)', 'substeps for an error of', accuracy
   do i = 1, size(sequences)
      do levels = 3, 8
         work = [(least_work(sequences(i), levels, accuracy(j)), j=1, 3)]
         print '(a, ", P = ", i0, t25, 3i10)', trim(names(i)), levels, work
      end do
   end do
   if (any(work == 0)) stop 1

contains

   !> Substeps of the first of ever shorter base steps that is accurate enough; 0: none is
   integer(long) function least_work(sequence, levels, accuracy)
      integer, intent(in) :: sequence, levels
      real(wp), intent(in) :: accuracy
      real(wp) :: error
      integer :: steps
      steps = 10
      do while (steps < 100000)
         call run(sequence, levels, t_end/steps, error, least_work)
         if (error <= accuracy) return
         steps = steps + max(1, steps/50)
      end do
      least_work = 0
   end function least_work

   subroutine run(sequence, levels, h, error, substeps)
      integer, intent(in) :: sequence, levels
      real(wp), intent(in) :: h
      real(wp), intent(out) :: error             !! of q and v/omega at the end
      integer(long), intent(out) :: substeps
      type(linear_system) :: sys
      type(extrapolation_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status

      call sys%set(diagonal_matrix([1.0_wp]), zero_matrix(1), diagonal_matrix([omega**2]), status)
      allocate (newmark_stepper :: stepper%base)
      stepper%sequence = sequence
      stepper%levels = levels
      call stepper%init(sys, status)
      state%y = [1.0_wp, 0.0_wp]
      call stepper%start(sys, state, status)
      call integrate(stepper, sys, state, t_end, control_type(h=h), status)
      error = max(abs(state%y(1) - cos(omega*t_end)), abs(state%y(2)/omega + sin(omega*t_end)))
      if (status%failed()) error = huge(error)
      substeps = stepper%count%substeps
   end subroutine run
end program choose_levels
