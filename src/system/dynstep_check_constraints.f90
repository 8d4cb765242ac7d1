! SPDX-License-Identifier: BSD-3-Clause
!> The part of CHECK_SYSTEM that looks at constraints: what a user gives of G, dg/dt, K and curvatures is
!> compared with differences of g and k; rows, patterns and ranks are looked at.
!> How far g and k are from zero at the point is no matter of declarations: the start of a stepper tells.
module dynstep_check_constraints
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_check_reactions, only: check_reactions
   use dynstep_findings, only: add, finding_length, look, others
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: long, wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_rank, only: default_rank_tolerance, dependence_type, find_dependent_rows
   use dynstep_status, only: status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_constraints

   !> Differences are good to 1e-10 where the functions are smooth: what differs by more than this part of a
   !> value, or than a part of all terms of its row, is another function
   real(wp), parameter :: tolerance = 1.0e-6_wp, tolerance_of_terms = 1.0e-8_wp

   !> What is known of the constraints at the point
   type :: point_type
      real(wp) :: t
      real(wp), allocatable :: q(:), v(:), q_size(:), v_size(:)     ! [n]
      type(jacobian_type) :: gq, kv                                 ! as the system gives them
      type(jacobian_type) :: g_found, k_found                       ! by differences, all entries
      real(wp), allocatable :: gt(:), gt_found(:)                   ! [m]
      logical :: fits = .true.                                      ! G and K agree with the differences
   end type point_type

contains

   !> Findings about the constraints at t, q, v; velocities that are zero would hide curvatures
   recursive subroutine check_constraints(sys, t, q, v, q_size, v_size, load, report, status)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(in) :: q_size(sys%n), v_size(sys%n)     !! lengths to move them by
      real(wp), intent(in) :: load                             !! size of the forces
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      type(point_type) :: p

      if (status%failed() .or. sys%holonomic + sys%nonholonomic == 0) return
      p%t = t
      p%q = q
      p%v = v
      p%q_size = q_size
      p%v_size = v_size
      allocate (p%gt(sys%holonomic), p%gt_found(sys%holonomic), source=0.0_wp)
      call p%gq%init(sys%holonomic, sys%n, sys%constraints%g, status)
      call p%kv%init(sys%nonholonomic, sys%n, sys%constraints%k, status)
      call p%g_found%init(sys%holonomic, sys%n, pattern_type(), status)
      call p%k_found%init(sys%nonholonomic, sys%n, pattern_type(), status)
      if (sys%holonomic > 0) call check_holonomic(sys, p, report, status)
      if (sys%nonholonomic > 0) call check_nonholonomic(sys, p, report, status)
      call check_rank(p, report, status)
      if (p%fits) call check_reactions(sys, t, q, v, q_size, v_size, &
         & load, max(largest(p%g_found%value), largest(p%k_found%value)), report, status)
   end subroutine check_constraints

   !> G and dg/dt, and the curvature where they are right
   recursive subroutine check_holonomic(sys, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      real(wp), dimension(sys%holonomic) :: g, terms, c, c_found
      integer(long) :: before
      integer :: ierr, i

      if (status%failed()) return
      call sys%constraint(p%t, p%q, g, ierr)
      call look('constraint', ierr, all(ieee_is_finite(g)), status)
      if (status%failed()) return
      call sys%difference_constraint_jacobian(p%t, p%q, p%g_found, p%gt_found, ierr)
      call look('constraint', ierr, all(ieee_is_finite(p%g_found%value)), status)
      before = sys%difference_constraints
      if (.not. status%failed()) call sys%constraint_jacobian(p%t, p%q, p%gq, p%gt, ierr)
      call look('constraint_jacobian', ierr, all(ieee_is_finite(p%gq%value)) .and. all(ieee_is_finite(p%gt)), status)
      if (status%failed()) return
      call check_rows('g', 'q', p%g_found, p%t, p%q_size, report)
      call check_places('g', 'q', p%gq, p%g_found, p%t, p%q_size, report, p%fits)
      if (sys%difference_constraints == before) then
         call compare_entries('G', 'constraint_jacobian', p%gq, p%g_found, p%t, p%q_size, report, p%fits)
         terms = 0.0_wp
         do i = 1, sys%holonomic
            terms(i) = row_terms(p%g_found, i, p%q_size) + row_terms(p%g_found, i, abs(p%v))
         end do
         call compare_rows('dg/dt of constraint_jacobian', 'g', p%gt, p%gt_found, terms, p%t, report, p%fits)
      end if
      if (.not. p%fits) return
      call sys%constraint_curvature(p%t, p%q, p%v, c, ierr)
      call look('constraint_curvature', ierr, all(ieee_is_finite(c)), status)
      if (status%failed()) return
      call sys%difference_constraint_curvature(p%t, p%q, p%v, c_found, ierr)
      call look('constraint', ierr, all(ieee_is_finite(c_found)), status)
      if (status%failed()) return
      do i = 1, sys%holonomic
         terms(i) = maxval(abs(p%v)/p%q_size)*row_terms(p%g_found, i, abs(p%v))
      end do
      call compare_rows('constraint_curvature', 'g', c, c_found, terms, p%t, report)
   end subroutine check_holonomic

   !> K, and the curvature where it is right
   recursive subroutine check_nonholonomic(sys, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      real(wp), dimension(sys%nonholonomic) :: k, terms, c, c_found
      logical :: fits
      integer(long) :: before
      integer :: ierr, i

      if (status%failed()) return
      call sys%velocity_constraint(p%t, p%q, p%v, k, ierr)
      call look('velocity_constraint', ierr, all(ieee_is_finite(k)), status)
      if (status%failed()) return
      call sys%difference_velocity_jacobian(p%t, p%q, p%v, p%k_found, ierr)
      call look('velocity_constraint', ierr, all(ieee_is_finite(p%k_found%value)), status)
      before = sys%difference_constraints
      if (.not. status%failed()) call sys%velocity_jacobian(p%t, p%q, p%v, p%kv, ierr)
      call look('velocity_jacobian', ierr, all(ieee_is_finite(p%kv%value)), status)
      if (status%failed()) return
      call check_rows('k', 'v', p%k_found, p%t, p%v_size, report)
      fits = .true.
      call check_places('k', 'v', p%kv, p%k_found, p%t, p%v_size, report, fits)
      if (sys%difference_constraints == before) call compare_entries('K', 'velocity_jacobian', p%kv, p%k_found, p%t, &
         & p%v_size, report, fits)
      p%fits = p%fits .and. fits
      if (.not. fits) return
      call sys%velocity_curvature(p%t, p%q, p%v, c, ierr)
      call look('velocity_curvature', ierr, all(ieee_is_finite(c)), status)
      if (status%failed()) return
      call sys%difference_velocity_curvature(p%t, p%q, p%v, c_found, ierr)
      call look('velocity_constraint', ierr, all(ieee_is_finite(c_found)), status)
      if (status%failed()) return
      do i = 1, sys%nonholonomic
         terms(i) = maxval(abs(p%v)/p%q_size)*row_terms(p%k_found, i, abs(p%v))
      end do
      call compare_rows('velocity_curvature', 'k', c, c_found, terms, p%t, report)
   end subroutine check_nonholonomic

   !> Size of what row i makes of changes of its columns
   pure real(wp) function row_terms(a, i, sizes)
      type(jacobian_type), intent(in) :: a
      integer, intent(in) :: i
      real(wp), intent(in) :: sizes(:)
      integer :: e
      row_terms = 0.0_wp
      do e = a%first(i), a%first(i + 1) - 1
         row_terms = row_terms + abs(a%value(e))*sizes(a%column(e))
      end do
   end function row_terms

   !> Constraints that constrain nothing
   recursive subroutine check_rows(name, variable, found, t, sizes, report)
      character(len=*), intent(in) :: name, variable
      type(jacobian_type), intent(in) :: found
      real(wp), intent(in) :: t, sizes(:)
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      integer :: i
      do i = 1, found%rows
         if (row_terms(found, i, sizes) > 0.0_wp) cycle
         call add(report, 'constraint '//text(i)//' of '//name//' does not change with any component of '//variable &
            & //' at t = '//text(t))
      end do
   end subroutine check_rows

   !> Entries that a pattern leaves out
   recursive subroutine check_places(name, variable, given, found, t, sizes, report, fits)
      character(len=*), intent(in) :: name, variable
      type(jacobian_type), intent(in) :: given, found
      real(wp), intent(in) :: t, sizes(:)
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      logical, intent(inout) :: fits
      logical :: is_stored(found%columns)
      real(wp) :: terms
      integer :: i, j, row, column, wrong
      if (size(given%value) == size(found%value)) return
      wrong = 0
      row = 0
      column = 0
      do i = 1, found%rows
         is_stored = .false.
         is_stored(given%column(given%first(i):given%first(i + 1) - 1)) = .true.
         terms = row_terms(found, i, sizes)
         do j = 1, found%columns
            if (is_stored(j) .or. .not. abs(found%entry(i, j))*sizes(j) > tolerance_of_terms*terms) cycle
            wrong = wrong + 1
            if (wrong > 1) cycle
            row = i
            column = j
         end do
      end do
      if (wrong == 0) return
      fits = .false.
      call add(report, 'constraint '//text(row)//' of '//name//' changes with '//variable//'('//text(column) &
         & //') by '//text(found%entry(row, column))//' at t = '//text(t)//', but its pattern has no such entry' &
         & //others(wrong - 1))
   end subroutine check_places

   !> The worst entry that differs
   recursive subroutine compare_entries(letter, name, given, found, t, sizes, report, fits)
      character(len=*), intent(in) :: letter, name
      type(jacobian_type), intent(in) :: given, found
      real(wp), intent(in) :: t, sizes(:)
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      logical, intent(inout) :: fits
      real(wp) :: terms, excess, worst
      integer :: i, j, e, row, column, wrong
      worst = 0.0_wp
      row = 0
      column = 0
      wrong = 0
      do i = 1, given%rows
         terms = row_terms(found, i, sizes)
         do e = given%first(i), given%first(i + 1) - 1
            j = given%column(e)
            excess = (abs(given%value(e) - found%entry(i, j)) - tolerance*max(abs(given%value(e)), abs(found%entry(i, j)))) &
               & *sizes(j) - tolerance_of_terms*terms
            if (.not. excess > 0.0_wp) cycle
            wrong = wrong + 1
            if (terms > 0.0_wp) excess = excess/terms
            if (excess <= worst) cycle
            worst = excess
            row = i
            column = j
         end do
      end do
      if (wrong == 0) return
      fits = .false.
      call add(report, letter//'('//text(row)//','//text(column)//') at t = '//text(t)//': '//name//' gives ' &
         & //text(given%entry(row, column))//', differences give '//text(found%entry(row, column))//others(wrong - 1))
   end subroutine compare_entries

   !> The first constraint whose value differs
   recursive subroutine compare_rows(name, letter, given, found, terms, t, report, fits)
      character(len=*), intent(in) :: name, letter
      real(wp), intent(in) :: given(:), found(:), terms(:), t
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      logical, intent(inout), optional :: fits
      integer :: i
      do i = 1, size(given)
         if (abs(given(i) - found(i)) <= tolerance*max(abs(given(i)), abs(found(i))) + tolerance_of_terms*terms(i)) cycle
         call add(report, name//', constraint '//text(i)//' of '//letter//' at t = '//text(t)//': '//text(given(i)) &
            & //', differences give '//text(found(i)))
         if (present(fits)) fits = .false.
         return
      end do
   end subroutine compare_rows

   !> Constraints that depend on others here
   recursive subroutine check_rank(p, report, status)
      type(point_type), intent(in) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(in) :: status
      type(dependence_type) :: found
      type(status_type) :: own
      integer :: i
      if (status%failed()) return
      call find_dependent_rows(p%g_found, p%k_found, default_rank_tolerance, found, own)
      if (own%failed()) return    ! too large to look at
      do i = 1, size(found%rows)
         call add(report, trim(found%sentence(i))//' at t = '//text(p%t))
      end do
   end subroutine check_rank

   pure real(wp) function largest(x)
      real(wp), intent(in) :: x(:)
      largest = 0.0_wp
      if (size(x) > 0) largest = maxval(abs(x))
   end function largest
end module dynstep_check_constraints
