! SPDX-License-Identifier: BSD-3-Clause
!> A ten-storey building in an earthquake: Newmark-extrapolation against plain Newmark.
!>
!>     earthquake RECORD.AT2
!>
!> Peaks of the roof displacement and of the storey drifts at the samples of the record, with
!> two errors each: an estimate that needs no better solution, and the true one, against a
!> refined run. Both methods make the same number of substeps; the extrapolation solves once
!> more in each base step, for the acceleration at its end.
!>
!> The ground motion is piecewise linear between its samples. A base step that ends on samples
!> sees a smooth load and keeps its order 8; a longer one would fall back to order 2.
program earthquake
   use dynstep
   implicit none
   integer, parameter :: n = 10, substeps = 10             ! harmonic sequence: 1 + 2 + 3 + 4
   real(wp), parameter :: height = 3.5_wp                  ! of a storey, m
   real(wp), parameter :: pi = acos(-1.0_wp)
   type(shear_building) :: building
   type(status_type) :: status
   type(newmark_stepper) :: newmark
   real(wp), allocatable :: motion(:)                      ! of the ground, g
   real(wp), dimension(0:n) :: plain, finer, high, higher, reference   ! peaks, see peaks_of
   real(wp) :: dt
   character(len=256) :: path
   integer(long) :: solves(2), other
   integer :: i

   call get_command_argument(1, path)
   if (path == '') then
      print '(a)', 'usage: earthquake RECORD.AT2, for example examples/data/synthetic.AT2'
      stop 1
   end if
   call read_at2(path, dt, motion, status)
   call building%setup(mass=[(1.0e5_wp, i=1, n)], stiffness=[(1.8e8_wp, i=1, n)], &
      & damping=[0.05_wp, 0.05_wp], status=status)
   if (.not. status%failed()) call building%shake(dt, standard_gravity*motion, status)
   call stop_on_failure()
   print '(2a)', 'Ground motion  ', trim(path)
   print '(a, i0, a, f6.4, a, f5.3, a)', '               ', size(motion), ' samples, one every ', dt, ' s, peak ', &
      & maxval(abs(motion)), ' g'
   print '(a, 3f6.3, a)', 'Building       10 storeys of 100 t and 180 kN/mm, periods', 2*pi/building%omega(1:3), &
      & ' ... s, damping 5 %'

   plain = peaks_of(newmark, substeps, solves(1))                        ! h = dt/10
   finer = peaks_of(newmark, 2*substeps, other)                          ! h = dt/20, for the estimate
   high = peaks_of(extrapolation(4, sequence_harmonic), 1, solves(2))    ! base step dt, order 8
   higher = peaks_of(extrapolation(5, sequence_harmonic), 1, other)      ! order 10, for the estimate
   reference = peaks_of(extrapolation(8, sequence_double_harmonic), 2, other)   ! order 16, base step dt/2

   print '(/, t28, a, t46, a, t72, a)', 'peak', 'plain Newmark, h = dt/10', 'extrapolation, base step dt'
   print '(t28, a, t46, a, t58, a, t72, a, t84, a)', '[mm]', 'estimate', 'true error', 'estimate', 'true error'
   call print_row('roof displacement', 0)
   do i = n, 1, -1
      call print_row('drift of storey', i)
   end do
   print '(/, a, f5.2, a)', 'Largest drift: ', 100*maxval(reference(1:))/height, ' % of the storey height'
   print '(a, i0, a, i0)', 'Linear solves: plain Newmark ', solves(1), ', extrapolation ', solves(2)
   print '(a, es7.1, a, es7.1, a)', 'Largest error: plain Newmark ', 1.0e3_wp*maxval(abs(plain - reference)), &
      & ' mm, extrapolation ', 1.0e3_wp*maxval(abs(high - reference)), ' mm'

contains

   !> Newmark's method with beta = 1/4, extrapolated
   function extrapolation(levels, sequence) result(stepper)
      integer, intent(in) :: levels, sequence
      type(extrapolation_stepper) :: stepper
      allocate (newmark_stepper :: stepper%base)
      stepper%levels = levels
      stepper%sequence = sequence
   end function extrapolation

   !> Largest roof displacement (0) and storey drifts (1..n) at the samples, by steps dt/parts
   function peaks_of(method, parts, linear_solves) result(peaks)
      class(stepper_type), intent(in) :: method
      integer, intent(in) :: parts
      integer(long), intent(out) :: linear_solves
      real(wp) :: peaks(0:n), drift(n)
      class(stepper_type), allocatable :: stepper
      type(state_type) :: state
      type(trajectory_type) :: response
      integer :: k

      stepper = method
      call stepper%init(building, status)
      state%y = [(0.0_wp, k=1, 2*n)]                       ! at rest: displacements, then velocities
      call stepper%start(building, state, status)
      call integrate(stepper, building, state, (size(motion) - 1)*dt, control_type(h=dt/parts, every=parts), &
         & status, response)
      call stop_on_failure()
      linear_solves = stepper%count%solves
      peaks = 0.0_wp
      do k = 1, response%count
         call building%storey_drifts(response%y(1:n, k), drift)
         peaks = max(peaks, abs([response%y(n, k), drift]))
      end do
   end function peaks_of

   !> Halving h takes 3/4 of an error of order 2; a further level takes nearly all of one of order 8
   subroutine print_row(what, which)
      character(len=*), intent(in) :: what
      integer, intent(in) :: which
      character(len=24) :: label
      label = what
      if (which > 0) write (label, '(a, i3)') what, which
      print '(a, t22, f12.6, t44, es10.1, t58, es10.1, t70, es10.1, t84, es10.1)', label, &
         & 1.0e3_wp*[reference(which), 4*(plain(which) - finer(which))/3, plain(which) - reference(which), &
         & high(which) - higher(which), high(which) - reference(which)]
   end subroutine print_row

   subroutine stop_on_failure()
      if (.not. status%failed()) return
      print '(a)', 'earthquake: '//trim(status%message)
      stop 1
   end subroutine stop_on_failure
end program earthquake
