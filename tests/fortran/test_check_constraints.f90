! SPDX-License-Identifier: BSD-3-Clause
!> check_system finds each kind of wrong constraint, names it, and raises no false alarm; so does
!> check_structure with declarations that make no sense.
module test_check_constraints
   use constraint_cases, only: arm, bar, bare_type, chain, drive, edge, given_type
   use dynstep, only: check_system, finding_length, kind_diagonal, matrix_type, mechanical_system, status_type, wp
   use dynstep_check_structure, only: check_structure
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input
   use mechanism_cases, only: general_point, make, models, names, point_type
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_check_constraints

   !> r = -G^T lambda - K^T psi + [.., 0.1 q(1)^2 sum of lambda^2 and psi^2, ..], with its derivatives
   type, extends(given_type) :: general_type
      logical :: adds = .true.
      real(wp) :: slip_r = 0.0_wp, slip_tangent = 0.0_wp
   contains
      procedure :: reaction => general_reaction
      procedure :: reaction_jacobian => general_reaction_jacobian
      procedure :: reaction_tangent => general_reaction_tangent
   end type general_type

   !> Two constraints that are one, or none
   type, extends(bare_type) :: double_type
      real(wp) :: factor = 2.0_wp
   contains
      procedure :: constraint => double_constraint
      procedure :: velocity_constraint => double_velocity_constraint
   end type double_type

   real(wp), parameter :: q3(3) = [1.0_wp, 2.0_wp, 0.3_wp], v3(3) = [0.5_wp, 0.2_wp, 0.3_wp]
   real(wp), parameter :: q4(4) = [1.2_wp, 0.9_wp, 0.3_wp, -0.8_wp], v4(4) = [0.3_wp, 2.0_wp, 1.0_wp, 0.5_wp]

contains

   subroutine collect_check_constraints(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('no-false-alarm', test_no_false_alarm), &
         & new_unittest('models', test_models), &
         & new_unittest('units', test_units), &
         & new_unittest('wrong-derivatives', test_wrong_derivatives), &
         & new_unittest('wrong-patterns', test_wrong_patterns), &
         & new_unittest('rows', test_rows), &
         & new_unittest('reactions', test_reactions), &
         & new_unittest('refusals', test_refusals), &
         & new_unittest('structure', test_structure)]
   end subroutine collect_check_constraints

   recursive subroutine general_reaction(self, t, q, v, lambda, psi, r, ierr)
      class(general_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr
      call self%lagrange_reaction(t, q, v, lambda, psi, r, ierr)
      if (self%adds) r(1) = r(1) + 0.1_wp*q(1)**2*(sum(lambda**2) + sum(psi**2))*(1.0_wp + v(1))
   end subroutine general_reaction

   recursive subroutine general_reaction_jacobian(self, t, q, v, lambda, psi, rl, rp, ierr)
      class(general_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(inout) :: rl(self%n, self%holonomic)
      real(wp), intent(inout) :: rp(self%n, self%nonholonomic)
      integer, intent(out) :: ierr
      real(wp) :: g(self%holonomic, self%n), gt(self%holonomic), k(self%nonholonomic, self%n)
      ierr = 0
      call self%exact_jacobian(t, q, g, gt)
      call self%exact_velocity_jacobian(t, q, v, k)
      rl = -transpose(g)
      rp = -transpose(k)
      rl(1, :) = rl(1, :) + 0.2_wp*q(1)**2*lambda*(1.0_wp + v(1))
      rp(1, :) = rp(1, :) + 0.2_wp*q(1)**2*psi*(1.0_wp + v(1))
      if (self%holonomic > 0) rl(2, 1) = rl(2, 1) + self%slip_r
      if (self%nonholonomic > 0) rp(2, 1) = rp(2, 1) + self%slip_r
   end subroutine general_reaction_jacobian

   !> Of the edge at rate 0: r1 = -psi1 sin q3 - psi2 v1/|v| + .., r2 = psi1 cos q3 - .., r3 = 2 q1^2 psi2
   recursive subroutine general_reaction_tangent(self, t, q, v, lambda, psi, k, c, ierr)
      class(general_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      real(wp) :: s, speed
      ierr = 0
      if (self%problem /= edge .or. .not. self%constraints%has_reaction_tangent .and. abs(self%slip_tangent) <= 0.0_wp) return
      s = sum(psi**2)
      speed = sqrt(v(1)**2 + v(2)**2)
      call k%set_entry(1, 1, -0.2_wp*q(1)*s*(1.0_wp + v(1)) + self%slip_tangent)
      call k%set_entry(1, 3, psi(1)*cos(q(3)))
      call k%set_entry(2, 3, psi(1)*sin(q(3)))
      call k%set_entry(3, 1, -4.0_wp*q(1)*psi(2))
      call c%set_entry(1, 1, -0.1_wp*q(1)**2*s + psi(2)*(1.0_wp/speed - v(1)**2/speed**3))
      call c%set_entry(1, 2, -psi(2)*v(1)*v(2)/speed**3)
      call c%set_entry(2, 1, -psi(2)*v(1)*v(2)/speed**3)
      call c%set_entry(2, 2, psi(2)*(1.0_wp/speed - v(2)**2/speed**3) + self%slip_tangent)
   end subroutine general_reaction_tangent

   recursive subroutine double_constraint(self, t, q, g, ierr)
      class(double_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      if (self%holonomic == 0) return
      g(1) = q(1)**2 + q(2)**2 - 1.0_wp
      g(2) = self%factor*g(1) + 1.0_wp
   end subroutine double_constraint

   !> On coordinates alone
   recursive subroutine double_velocity_constraint(self, t, q, v, k, ierr)
      class(double_type), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr
      ierr = 0
      k = q(1) - q(3)
   end subroutine double_velocity_constraint

   !> All problems, with and without derivatives of their own, at rest too
   subroutine test_no_false_alarm(error)
      type(error_type), allocatable, intent(out) :: error
      type(given_type) :: given
      type(bare_type) :: bare
      type(general_type) :: general
      real(wp) :: q(12)
      integer :: i
      q = [(0.3_wp*i + sin(3.0_wp*i), i=1, 12)]
      do i = arm, edge
         call given%setup(i, 5)
         call given%setup(i, 5)
         call given_is_right(given%n)
         given%rate = 300.0_wp
         call given_is_right(given%n)
         given%rate = 1.0_wp
         bare = given%bare_type
         call all_right(error, 'bare', bare, 0.4_wp, q(:bare%n), cos(q(:bare%n)))
         if (allocated(given%constraints%g%first)) then
            deallocate (given%constraints%g%first, given%constraints%g%column)
            call given_is_right(given%n)
         end if
      end do
      general%rate = 0.0_wp
      general%constraints%reaction_is_general = .true.
      call general%setup(drive)
      call all_right(error, 'general', general, 0.4_wp, q3, v3)
      call general%setup(edge)
      general%constraints%has_reaction_tangent = .true.
      call all_right(error, 'general', general, 0.4_wp, q3, v3)
      ! velocity constraints do not make a force depend on velocities
      general%structure%velocity_free = .true.
      call all_right(error, 'velocity-free', general, 0.4_wp, q3, v3)

   contains

      subroutine given_is_right(n)
         integer, intent(in) :: n
         call all_right(error, 'given', given, 0.4_wp, q(:n), cos(q(:n)))
         call all_right(error, 'at rest', given, 0.4_wp, q(:n), 0.0_wp*q(:n))
      end subroutine given_is_right
   end subroutine test_no_false_alarm

   !> The models of the library, at general points
   subroutine test_models(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(point_type) :: p
      integer :: i
      do i = 1, models
         call make(i, sys)
         p = general_point(sys)
         call all_right(error, trim(names(i)), sys, p%t, p%q, p%v)
      end do
   end subroutine test_models

   !> Millimetres, kilometres, far from the origin
   subroutine test_units(error)
      type(error_type), allocatable, intent(out) :: error
      type(given_type) :: sys
      call sys%setup(arm)
      sys%length = 1.0e-3_wp
      call all_right(error, 'short', sys, 0.7_wp, [1.0e-3_wp, 1.0e-3_wp, 1.0_wp, 1.0_wp]*q4, &
         & [1.0e-3_wp, 1.0e-3_wp, 1.0_wp, 1.0_wp]*v4)
      sys%length = 1.0e3_wp
      call all_right(error, 'long', sys, 0.7_wp, [1.0e3_wp, 1.0e3_wp, 1.0_wp, 1.0_wp]*q4, &
         & [1.0e3_wp, 1.0e3_wp, 1.0_wp, 1.0_wp]*v4)
      call sys%setup(bar)
      sys%length = 1.0_wp
      call all_right(error, 'far away', sys, 0.7_wp, 1.0e3_wp + [0.1_wp, 0.2_wp, 0.7_wp, 1.0_wp], v4)
   end subroutine test_units

   !> Each derivative off by a little, with its name
   subroutine test_wrong_derivatives(error)
      type(error_type), allocatable, intent(out) :: error
      type(given_type) :: sys
      call sys%setup(arm)
      sys%slip_g = 1.0e-4_wp
      call one_finding(error, sys, q4, v4, 'G(2,4) at t = 0.4: constraint_jacobian gives -0.61', ', differences give -0.61')
      sys%slip_g = 0.0_wp
      sys%slip_t = 1.0e-4_wp
      call one_finding(error, sys, q4, v4, 'dg/dt of constraint_jacobian, constraint 2 of g at t = 0.4: ', &
         & 'differences give 0')
      sys%slip_t = 0.0_wp
      sys%slip_c = 1.0e-4_wp
      call one_finding(error, sys, q4, v4, 'constraint_curvature, constraint 2 of g at t = 0.4: ', 'differences give ')
      sys%gives_curvature = .false.
      call one_finding(error, sys, q4, v4, 'constraint_curvature, constraint 2 of g at t = 0.4: ', 'differences give ')
      call sys%setup(chain, 2)
      sys%slip_c = 0.0_wp
      sys%slip_g = 1.0e-4_wp
      call one_finding(error, sys, [q4, 2.0_wp, 3.0_wp], [v4, 0.0_wp, 1.0_wp], 'G(2,6) at t = 0.4: ', '')
      sys%slip_g = 0.0_wp
      call sys%setup(edge)
      deallocate (sys%constraints%g%first, sys%constraints%g%column)
      sys%gives_curvature = .true.
      sys%slip_k = 1.0e-4_wp
      call one_finding(error, sys, q3, v3, 'K(1,1) at t = 0.4: velocity_jacobian gives 0.644', ', differences give 0.644')
      sys%slip_k = 0.0_wp
      sys%slip_kc = 1.0e-4_wp
      call one_finding(error, sys, q3, v3, 'velocity_curvature, constraint 1 of k at t = 0.4: ', 'differences give ')
   end subroutine test_wrong_derivatives

   !> Entries that a pattern leaves out, of given derivatives and of differences
   subroutine test_wrong_patterns(error)
      type(error_type), allocatable, intent(out) :: error
      type(given_type) :: given
      type(bare_type) :: bare
      call given%setup(arm)
      given%constraints%g%first = [1, 3, 6]
      given%constraints%g%column = [1, 3, 2, 3, 4]
      call one_finding(error, given, q4, v4, 'constraint 1 of g changes with q(4) by -0.33', &
         & ' at t = 0.4, but its pattern has no such entry')
      bare = given%bare_type
      call first_finding(error, bare, q4, v4, 'constraint 1 of g changes with q(4) by ')
      given%constraints%g%first = [1, 4, 7]
      given%constraints%g%column = [1, 3, 4, 2, 3, 4]
      call all_right(error, 'the right pattern', given, 0.4_wp, q4, v4)
      call given%setup(edge)
      deallocate (given%constraints%g%first, given%constraints%g%column)
      given%constraints%k%first = [1, 3, 5]
      given%constraints%k%column = [1, 2, 1, 3]
      call one_finding(error, given, q3, v3, 'constraint 2 of k changes with v(2) by ', 'no such entry')
      given%constraints%k%first = [1, 3, 6]
      given%constraints%k%column = [1, 2, 1, 2, 3]
      call all_right(error, 'the right pattern', given, 0.4_wp, q3, v3)
   end subroutine test_wrong_patterns

   !> Rows that depend on others, and rows of zeros
   subroutine test_rows(error)
      type(error_type), allocatable, intent(out) :: error
      type(double_type) :: sys
      sys%n = 3
      sys%holonomic = 2
      call one_finding(error, sys, q3, v3, 'constraint 2 of g depends on constraint 1 of g', ' at t = 0.4')
      sys%factor = 0.0_wp
      call first_finding(error, sys, q3, v3, 'constraint 2 of g does not change with any component of q at t = 0.4')
      sys%holonomic = 0
      sys%nonholonomic = 1
      call first_finding(error, sys, q3, v3, 'constraint 1 of k does not change with any component of v at t = 0.4')
   end subroutine test_rows

   subroutine test_reactions(error)
      type(error_type), allocatable, intent(out) :: error
      type(general_type) :: sys
      sys%rate = 0.0_wp
      call sys%setup(edge)
      call one_finding(error, sys, q3, v3, 'reaction gives ', '; set constraints%reaction_is_general')
      sys%adds = .false.
      call all_right(error, 'a reaction of the usual form', sys, 0.4_wp, q3, v3)
      sys%adds = .true.
      sys%constraints%reaction_is_general = .true.
      call all_right(error, 'declared', sys, 0.4_wp, q3, v3)
      sys%slip_r = 1.0e-4_wp
      call one_finding(error, sys, q3, v3, 'dr(2)/dpsi(1) at t = 0.4: reaction_jacobian gives ', ', differences give ')
      call sys%setup(drive)
      call one_finding(error, sys, q3, v3, 'dr(2)/dlambda(1) at t = 0.4: reaction_jacobian gives ', ', differences give ')
      call sys%setup(edge)
      sys%slip_r = 0.0_wp
      sys%slip_tangent = 1.0e-3_wp
      call one_finding(error, sys, q3, v3, 'reaction_tangent gives tangents that no step uses; ', '')
      sys%constraints%has_reaction_tangent = .true.
      sys%structure%velocity_free = .true.
      call one_finding(error, sys, q3, v3, '-dr(1)/dq(1) at t = 0.4: reaction_tangent gives ', ', differences give ')
      sys%structure%velocity_free = .false.
      call first_finding(error, sys, q3, v3, '-dr(1)/dq(1) at t = 0.4: reaction_tangent gives ')
      ! what the declared storage has no place for is left out on purpose
      sys%slip_tangent = 0.0_wp
      sys%structure%tangent = kind_diagonal
      call all_right(error, 'a diagonal of it', sys, 0.4_wp, q3, v3)
   end subroutine test_reactions

   !> Outside the domain nothing can be told
   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(given_type) :: sys
      character(len=finding_length), allocatable :: report(:)
      type(status_type) :: status
      call sys%setup(arm)
      sys%least = 2.0_wp
      call check_system(sys, 0.4_wp, q4, v4, report, status)
      call check(error, status%code, dynstep_callback_failed)
      call check(error, index(status%message, 'constraint returned ierr = 1 while the system was checked') > 0, &
         & trim(status%message))
      call status%clear()
      call sys%setup(edge)
      call check_system(sys, 0.4_wp, q3, v3, report, status)
      call check(error, index(status%message, 'velocity_constraint returned ierr = 1') > 0, trim(status%message))
      call status%clear()
      sys%least = -huge(1.0_wp)
      sys%holonomic = -1
      call check_system(sys, 0.4_wp, q3, v3, report, status)
      call check(error, status%code, dynstep_invalid_input)
   end subroutine test_refusals

   !> Declarations that make no sense
   subroutine test_structure(error)
      type(error_type), allocatable, intent(out) :: error
      type(bare_type) :: sys
      call sys%setup(arm)
      call structure_is('')
      sys%holonomic = -1
      call structure_is('-1 holonomic and 0 nonholonomic constraints; neither may be negative')
      sys%holonomic = 2
      sys%nonholonomic = -2
      call structure_is('2 holonomic and -2 nonholonomic constraints; neither may be negative')
      sys%nonholonomic = 3
      call structure_is('has 2 + 3 constraints g and k on n = 4 coordinates')
      sys%nonholonomic = 1
      call structure_is('')
      sys%constraints%g%first = [1, 3]
      sys%constraints%g%column = [1, 2]
      call structure_is('the pattern of constraint_jacobian needs first(3)')
      sys%constraints%g%first = [1, 3, 4]
      call structure_is('the pattern of constraint_jacobian must have first(1) = 1 and first(3) = size(column) + 1 = 3')
      sys%constraints%g%first = [1, 4, 3]
      call structure_is('the pattern of constraint_jacobian has first(2) = 4, which does not follow first(1)')
      sys%constraints%g%first = [1, 3, 4]
      sys%constraints%g%column = [1, 5, 2]
      call structure_is('the pattern of constraint_jacobian has column 5 in row 1, outside 1 to 4')
      sys%constraints%g%column = [3, 1, 2]
      call structure_is('the columns of the pattern of constraint_jacobian do not increase in row 1')
      sys%constraints%g%column = [1, 3, 2]
      call structure_is('')
      sys%constraints%k%first = [1, 2]
      call structure_is('the pattern of velocity_jacobian needs first(2) and column(:)')
      sys%constraints%k%column = [0]
      call structure_is('the pattern of velocity_jacobian has column 0 in row 1')
      sys%constraints%k%column = [4]
      call structure_is('')
      sys%constraints%order = [1, 2, 3, 4]
      call structure_is('constraints%order must name each of 1 to n + m + p = 7 once')
      sys%constraints%order = [1, 2, 3, 4, 5, 6, 6]
      call structure_is('constraints%order must name each of 1 to n + m + p = 7 once')
      sys%constraints%order = [7, 6, 5, 4, 3, 2, 1]
      call structure_is('')

   contains

      subroutine structure_is(words)
         character(len=*), intent(in) :: words      !! of the sentence; none where all is well
         type(status_type) :: status
         call check_structure(sys, status)
         call check(error, status%failed() .neqv. words == '', words//' | '//trim(status%message))
         if (words /= '') call check(error, index(status%message, words) > 0, words//' | '//trim(status%message))
      end subroutine structure_is
   end subroutine test_structure

   subroutine all_right(error, what, sys, t, q, v)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: what
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t, q(:), v(:)
      character(len=finding_length), allocatable :: report(:)
      type(status_type) :: status
      call check_system(sys, t, q, v, report, status)
      call check(error, .not. status%failed(), what//': '//trim(status%message))
      call check(error, size(report), 0, what)
   end subroutine all_right

   !> Exactly one, with these words
   subroutine one_finding(error, sys, q, v, start, part)
      type(error_type), allocatable, intent(inout) :: error
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: q(:), v(:)
      character(len=*), intent(in) :: start, part
      character(len=finding_length), allocatable :: report(:)
      type(status_type) :: status
      call check_system(sys, 0.4_wp, q, v, report, status)
      call check(error, status%code, dynstep_invalid_input, 'one finding: '//start)
      call check(error, size(report), 1, 'one finding: '//start//' | '//trim(status%message))
      if (size(report) < 1) return
      call check(error, report(1) (:len(start)), start)
      call check(error, index(report(1), trim(part)) > 0, trim(report(1)))
      if (len_trim(report(1)) == finding_length) call test_failed(error, 'cut off: '//report(1))
   end subroutine one_finding

   subroutine first_finding(error, sys, q, v, start)
      type(error_type), allocatable, intent(inout) :: error
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: q(:), v(:)
      character(len=*), intent(in) :: start
      character(len=finding_length), allocatable :: report(:)
      type(status_type) :: status
      call check_system(sys, 0.4_wp, q, v, report, status)
      call check(error, status%code, dynstep_invalid_input, 'first finding: '//start)
      if (size(report) < 1) return
      call check(error, report(1) (:len(start)), start)
   end subroutine first_finding
end module test_check_constraints
