! SPDX-License-Identifier: BSD-3-Clause
!> One equation whose force is a user's own procedure, x'' + 16 x = 0, h = 0.002: as a type
!> that extends mechanical_system, and as an EXTERNAL subroutine of FORTRAN 77, against a loop
!> written by hand.  The tangent is given, constant and without velocities, as in a model that
!> tells the library what it knows.
module bench_oscillator
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_diagonal, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   implicit none
   private

   public :: external_force, external_tangent

   type, extends(mechanical_system), public :: oscillator_type
      real(wp) :: stiffness = 16.0_wp
   contains
      procedure :: force => oscillator_force
      procedure :: tangent => oscillator_tangent
      procedure :: describe
   end type oscillator_type

contains

   subroutine describe(self)
      class(oscillator_type), intent(inout) :: self
      self%n = 1
      associate (s => self%structure)
         s%tangent = kind_diagonal
         s%tangent_is_constant = .true.
         s%tangent_is_symmetric = .true.
         s%force_is_linear = .true.
         s%velocity_free = .true.
      end associate
   end subroutine describe

   recursive subroutine oscillator_force(self, t, q, v, f, ierr)
      class(oscillator_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      f(1) = -self%stiffness*q(1)
      ierr = 0
   end subroutine oscillator_force

   recursive subroutine oscillator_tangent(self, t, q, v, a, k, c, ierr)
      class(oscillator_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      call k%set_entry(1, 1, self%stiffness)
      ierr = 0
   end subroutine oscillator_tangent

   recursive subroutine external_force(n, t, q, v, f, rpar, ipar, ierr)
      integer :: n, ipar(*), ierr
      real(wp) :: t, q(n), v(n), f(n), rpar(*)
      f(1) = -rpar(1)*q(1)
   end subroutine external_force

   recursive subroutine external_tangent(n, t, q, v, a, ak, ac, ld, rpar, ipar, ierr)
      integer :: n, ld, ipar(*), ierr
      real(wp) :: t, q(n), v(n), a(n), ak(ld, *), ac(ld, *), rpar(*)
      ak(1, 1) = rpar(1)
   end subroutine external_tangent
end module bench_oscillator

program bench_callbacks
   use bench_clock, only: print_ratio, print_time, print_title, thread_seconds
   use bench_newmark_by_hand, only: newmark_by_hand
   use bench_oscillator, only: external_force, external_tangent, oscillator_type
   use dynstep_integrate, only: control_type, integrate
   use dynstep_kinds, only: wp
   use dynstep_newmark, only: newmark_stepper
   use dynstep_status, only: status_type
   use dynstep_stepper, only: allocate_state, state_type
   implicit none

   integer, parameter :: repeats = 15
   integer, parameter :: steps = 200000
   real(wp), parameter :: h = 0.002_wp
   real(wp) :: by_hand, by_type, by_external, q
   integer :: r

   interface
      subroutine dsnewm(n, force, mass, tang, out, t, q, v, a, tend, h, iopt, ropt, rpar, ipar, icnt, idid, text)
         import :: wp
         integer :: n, iopt(*), ipar(*), icnt(*), idid
         external :: force, mass, tang, out
         real(wp) :: t, q(*), v(*), a(*), tend, h, ropt(*), rpar(*)
         character(len=*) :: text
      end subroutine dsnewm
   end interface
   external :: dsnone

   by_hand = huge(1.0_wp)
   by_type = huge(1.0_wp)
   by_external = huge(1.0_wp)
   do r = 1, repeats
      by_hand = min(by_hand, newmark_by_hand(q))
      by_type = min(by_type, extended_type(q))
      by_external = min(by_external, external_subroutine(q))
   end do
   call print_title('one equation, force by the user', 'ns/step')
   call print_time('loop by hand', by_hand)
   call print_ratio('type that extends mechanical_system', by_type, by_hand, '<= 2.0')
   call print_ratio('FORTRAN 77 EXTERNAL, by DSNEWM', by_external, by_hand, '')
   call print_title('type-bound against EXTERNAL', 'ns/step')
   call print_time('FORTRAN 77 EXTERNAL, by DSNEWM', by_external)
   call print_ratio('type that extends mechanical_system', by_type, by_external, '<= 1.1')

contains

   real(wp) function extended_type(check)
      real(wp), intent(in) :: check
      type(oscillator_type) :: sys
      type(newmark_stepper) :: stepper
      type(state_type) :: state
      type(status_type) :: status
      real(wp) :: start

      call sys%describe()
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      state%y = [1.0_wp, 0.0_wp]
      call stepper%start(sys, state, status)
      start = thread_seconds()
      call integrate(stepper, sys, state, steps*h, control_type(h=h, every=0), status)
      extended_type = 1.0e9_wp*(thread_seconds() - start)/steps
      if (status%failed() .or. abs(state%y(1) - check) > 1.0e-9_wp) print *, 'wrong', state%y, status%message
   end function extended_type

   real(wp) function external_subroutine(check)
      real(wp), intent(in) :: check
      real(wp) :: t, q(1), v(1), a(1), ropt(10), rpar(1), start
      integer :: iopt(30), ipar(1), icnt(10), idid
      character(len=160) :: text

      iopt = 0
      iopt([16, 19, 20, 21, 22, 23]) = 1
      ropt = 0.0_wp
      rpar = 16.0_wp
      ipar = 0
      t = 0.0_wp
      q = 1.0_wp
      v = 0.0_wp
      start = thread_seconds()
      call dsnewm(1, external_force, dsnone, external_tangent, dsnone, t, q, v, a, steps*h, h, iopt, ropt, rpar, ipar, &
         & icnt, idid, text)
      external_subroutine = 1.0e9_wp*(thread_seconds() - start)/steps
      if (idid /= 0 .or. abs(q(1) - check) > 1.0e-9_wp) print *, 'wrong', q, idid, text
   end function external_subroutine
end program bench_callbacks
