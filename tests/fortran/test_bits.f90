! SPDX-License-Identifier: BSD-3-Clause
!> What docs/howto/reproducibility.md says of single steps, copies and pieces of a run, for all
!> methods, matrices and forces.
module test_bits
   use dynstep
   use run_cases, only: takes_forces
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_bits

   real(wp), parameter :: h = 0.07_wp
   integer, parameter :: steps = 60

   !> Pendula in a row, damped and driven
   type, extends(mechanical_system) :: pendula
   contains
      procedure :: force => pendula_force
   end type pendula

contains

   subroutine collect_bits(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('matrices', test_matrices), &
         & new_unittest('forces', test_forces)]
   end subroutine collect_bits

   subroutine test_matrices(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: orders(5) = [1, 2, 3, 8, 12]
      integer :: i, j
      do j = 1, size(orders)
         do i = 1, size(method_names)
            call compare(error, trim(method_names(i)), chain(orders(j), .false.))
            call compare(error, trim(method_names(i)), chain(orders(j), .true.))
         end do
      end do
   end subroutine test_matrices

   !> A chain of n masses, its matrices stored as bands or dense
   function chain(n, dense) result(sys)
      integer, intent(in) :: n
      logical, intent(in) :: dense
      type(linear_system) :: sys
      type(status_type) :: status
      real(wp) :: k(n, n), c(n, n), band(3, n)
      integer :: i
      k = 0.0_wp
      band = 0.0_wp
      do i = 1, n
         k(i, i) = 2.0_wp + 0.1_wp*i
         band(2, i) = k(i, i)
         if (i == n) exit
         k(i, i + 1) = -1.0_wp
         k(i + 1, i) = -1.0_wp
         band(3, i) = -1.0_wp
         band(1, i + 1) = -1.0_wp
      end do
      c = 0.01_wp*k
      if (dense .or. n == 1) then
         call sys%set(diagonal_matrix([(1.0_wp + 0.05_wp*i, i=1, n)]), dense_matrix(c, .true.), &
            & dense_matrix(k, .true.), status)
      else
         call sys%set(identity_matrix(n), zero_matrix(n), banded_matrix(band, 1, 1, .true.), status)
      end if
      if (status%failed()) sys%n = 0
   end function chain

   subroutine test_forces(error)
      type(error_type), allocatable, intent(out) :: error
      type(pendula) :: sys
      integer, parameter :: orders(3) = [1, 2, 12]
      integer :: i, j
      do j = 1, size(orders)
         sys%n = orders(j)
         do i = 1, size(method_names)
            if (.not. takes_forces(method_names(i))) cycle
            call compare(error, trim(method_names(i)), sys)
         end do
      end do
   end subroutine test_forces

   recursive subroutine pendula_force(self, t, q, v, f, ierr)
      class(pendula), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = -sin(q) - 0.05_wp*v
      f(1) = f(1) + 0.1_wp*cos(t)
      f(2:) = f(2:) - 0.2_wp*(q(2:) - q(:self%n - 1))
      f(:self%n - 1) = f(:self%n - 1) + 0.2_wp*(q(2:) - q(:self%n - 1))
   end subroutine pendula_force

   !> The same run in one call, step by step, in pieces, and with a copy from its middle on
   subroutine compare(error, method, problem)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: method
      class(mechanical_system), intent(in) :: problem
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper, copy
      type(state_type) :: start, whole, single, continued, pieces, trial
      type(clock_type) :: clock
      type(integration_type) :: run
      type(status_type) :: status
      character(len=40) :: what
      integer :: i

      if (allocated(error)) return
      write (what, '(a, ", n = ", i0)') method, problem%n
      allocate (sys, source=problem)
      call new_method(method, stepper, status)
      call stepper%init(sys, status)
      start%y = [(0.3_wp*cos(1.0_wp*i), i=1, 2*sys%n)]

      whole = start
      call stepper%start(sys, whole, status)
      clock%h = h
      call stepper%advance(sys, whole, clock, steps, status, complete=.true.)

      single = start
      call stepper%start(sys, single, status)
      call allocate_state(sys, trial, status)
      do i = 1, steps
         call stepper%try_step(sys, single, h, i*h, trial, status)
         if (status%failed()) exit
         call stepper%accept(single, trial)
         if (i /= steps/2) cycle
         allocate (copy, source=stepper)
         continued = single
      end do
      call check(error, .not. status%failed(), trim(what)//': '//status%message)
      if (allocated(error)) return
      call check(error, same(single, whole), trim(what)//': single steps')

      do i = steps/2 + 1, steps
         call copy%try_step(sys, continued, h, i*h, trial, status)
         call copy%accept(continued, trial)
      end do
      call check(error, same(continued, whole), trim(what)//': a copy goes on')

      pieces = start
      call stepper%start(sys, pieces, status)
      call run%begin(sys, pieces, steps*h, control_type(h=h), status)
      do
         call run%proceed(stepper, sys, pieces, status, max_steps=7)
         if (status%code /= dynstep_more) exit
         call status%clear()
      end do
      call check(error, same(pieces, whole), trim(what)//': in pieces')
   end subroutine compare

   pure logical function same(a, b)
      type(state_type), intent(in) :: a, b
      same = all(abs(a%y - b%y) <= 0.0_wp) .and. all(abs(a%a - b%a) <= 0.0_wp)
   end function same
end module test_bits
