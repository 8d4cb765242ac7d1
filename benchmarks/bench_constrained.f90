! SPDX-License-Identifier: BSD-3-Clause
!> Constrained motion by SOI2: the pendulum (16) of Jay & Negrut, and a hanging chain of N rods with its band against the
!> same chain whose Jacobian is declared dense.  h = 1e-3, rho_inf = 0.8; corrections and factorizations a step beside the
!> times.
module bench_dense_chain
   use dynstep, only: jacobian_type, rod_chain, status_type, wp
   implicit none
   private

   !> A chain that hides its pattern
   type, extends(rod_chain), public :: dense_chain
      type(jacobian_type) :: sparse
   contains
      procedure :: hide
      procedure :: constraint_jacobian => dense_jacobian
   end type dense_chain

contains

   subroutine hide(self, status)
      class(dense_chain), intent(inout) :: self
      type(status_type), intent(inout) :: status
      call self%sparse%init(self%holonomic, self%n, self%constraints%g, status)
      deallocate (self%constraints%g%first, self%constraints%g%column, self%constraints%order)
   end subroutine hide

   recursive subroutine dense_jacobian(self, t, q, gq, gt, ierr)
      class(dense_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      integer :: i, e
      call self%rod_chain%constraint_jacobian(t, q, self%sparse, gt, ierr)
      do i = 1, self%holonomic
         do e = self%sparse%first(i), self%sparse%first(i + 1) - 1
            call gq%set_entry(i, self%sparse%column(e), self%sparse%value(e))
         end do
      end do
   end subroutine dense_jacobian
end module bench_dense_chain

program bench_constrained
   use bench_clock, only: print_ratio, print_time, print_title, thread_seconds
   use bench_dense_chain, only: dense_chain
   use dynstep
   implicit none
   real(wp), parameter :: h = 1.0e-3_wp
   real(wp) :: per_rod, per_rod_30, banded, dense, corrections, factorizations

   call print_title('Pendulum (16), SOI2, type-bound callbacks', 'us/step')
   call pendulum(banded, corrections, factorizations)
   call print_time('one step (goal 2.5)', banded*1.0e6_wp)
   call print_work(corrections, factorizations)

   call print_title('Chain of N rods, SOI2, band', 'ns/rod')
   call chain(30, 400, per_rod_30, corrections, factorizations)
   call print_time('N = 30 (goal 1500)', per_rod_30*1.0e9_wp)
   call print_work(corrections, factorizations)
   call chain(100, 120, per_rod, corrections, factorizations)
   banded = per_rod
   call print_ratio('N = 100', per_rod*1.0e9_wp, per_rod_30*1.0e9_wp, 'ratio to N = 30 within 20 %')
   call print_work(corrections, factorizations)
   call chain(300, 40, per_rod, corrections, factorizations)
   call print_ratio('N = 300', per_rod*1.0e9_wp, per_rod_30*1.0e9_wp, 'within 20 %')
   call print_work(corrections, factorizations)
   call chain(1000, 20, per_rod, corrections, factorizations)
   call print_ratio('N = 1000', per_rod*1.0e9_wp, per_rod_30*1.0e9_wp, 'within 20 %')
   call print_work(corrections, factorizations)
   call dense_steps(100, 10, dense)
   call print_ratio('N = 100, dense', dense*1.0e9_wp, banded*1.0e9_wp, 'dense/band >= 40')

contains

   subroutine print_work(corrections, factorizations)
      real(wp), intent(in) :: corrections, factorizations
      print '(a, f5.2, a, f5.2, a)', '      ', corrections, ' corrections (goal 2.1), ', factorizations, &
         & ' factorizations a step'
   end subroutine print_work

   !> Least time of a step
   subroutine pendulum(seconds, corrections, factorizations)
      real(wp), intent(out) :: seconds, corrections, factorizations
      type(rod_pendulum) :: sys
      type(soi2_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      integer :: repeat
      call sys%setup()
      seconds = huge(seconds)
      do repeat = 1, 20
         state = state_type()
         allocate (state%y(6))
         call sys%start(6.0_wp*atan(1.0_wp), 10.0_wp, state%y(1:3), state%y(4:6))
         call timed_steps(sys, stepper, state, 2000, seconds, corrections, factorizations, status)
      end do
      if (status%failed()) print '(a)', trim(status%message)
   end subroutine pendulum

   subroutine chain(rods, steps, seconds, corrections, factorizations)
      integer, intent(in) :: rods, steps
      real(wp), intent(out) :: seconds, corrections, factorizations      !! seconds per rod and step
      type(rod_chain) :: sys
      type(soi2_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      integer :: repeat
      call sys%setup(rods, status)
      seconds = huge(seconds)
      do repeat = 1, 8
         call hang(sys, state)
         call timed_steps(sys, stepper, state, steps, seconds, corrections, factorizations, status)
      end do
      seconds = seconds/rods
      if (status%failed()) print '(a)', trim(status%message)
   end subroutine chain

   subroutine dense_steps(rods, steps, seconds)
      integer, intent(in) :: rods, steps
      real(wp), intent(out) :: seconds
      type(dense_chain) :: sys
      type(soi2_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: corrections, factorizations
      call sys%setup(rods, status)
      call sys%hide(status)
      call hang(sys, state)
      seconds = huge(seconds)
      call timed_steps(sys, stepper, state, steps, seconds, corrections, factorizations, status)
      seconds = seconds/rods
      if (status%failed()) print '(a)', trim(status%message)
   end subroutine dense_steps

   !> A wave that runs along a hanging chain
   subroutine hang(sys, state)
      class(rod_chain), intent(in) :: sys
      type(state_type), intent(out) :: state
      integer :: i
      allocate (state%y(2*sys%n))
      associate (n => sys%n)
         call sys%start([(-2.0_wp*atan(1.0_wp) + 0.3_wp*sin(0.3_wp*i), i=1, n/3)], [(0.1_wp*cos(0.2_wp*i), i=1, n/3)], &
            & state%y(:n), state%y(n + 1:))
      end associate
   end subroutine hang

   !> Steps after the first ten, which start the method
   subroutine timed_steps(sys, stepper, state, steps, seconds, corrections, factorizations, status)
      class(mechanical_system), intent(inout) :: sys
      type(soi2_stepper), intent(inout) :: stepper
      type(state_type), intent(inout) :: state
      integer, intent(in) :: steps
      real(wp), intent(inout) :: seconds                 !! less of what it is and of this run
      real(wp), intent(out) :: corrections, factorizations
      type(status_type), intent(inout) :: status
      type(clock_type) :: clock
      type(step_counters) :: before
      real(wp) :: begin
      call stepper%init(sys, status)
      call stepper%start(sys, state, status)
      clock%h = h
      call stepper%advance(sys, state, clock, 10, status, .true.)
      before = stepper%count
      begin = thread_seconds()
      call stepper%advance(sys, state, clock, steps, status, .true.)
      seconds = min(seconds, (thread_seconds() - begin)/steps)
      corrections = real(stepper%count%newton_iterations - before%newton_iterations, wp)/steps
      factorizations = real(stepper%count%factorizations - before%factorizations, wp)/steps
   end subroutine timed_steps
end program bench_constrained
