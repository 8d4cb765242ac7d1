! SPDX-License-Identifier: BSD-3-Clause
!> Does a system do what it declares?  Compares the tangents, the derivatives of constraints and the
!> declared structure of a mechanical system with differences of its own procedures at one point.
!>
!> PROGRAMMING INTERFACE
!>
!>     character(len=finding_length), allocatable :: report(:)
!>     call check_system(sys, t, q, v, report, status)
!>     if (status%failed()) print '(a)', report
!>
!>   Choose a general point: at a point of symmetry mistakes may not show.  Costs 4n + 20
!>   evaluations of force and mass, and some ten evaluations of constraints and reactions for each
!>   coordinate; meant for the day on which a model is written.
module dynstep_check_system
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_check_constraints, only: check_constraints
   use dynstep_check_structure, only: check_structure
   use dynstep_differences, only: motion_sizes
   use dynstep_factorization, only: factorization_type
   use dynstep_findings, only: add, check_symmetry, compare_matrices, compare_vectors, finding_length, look, others, row_terms
   use dynstep_kinds, only: long, wp
   use dynstep_linear_system, only: linear_system, load_none
   use dynstep_matrix, only: kind_identity, kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_system, finding_length

   !> Central differences with the step delta = eps^(1/3) size leave delta^2 f'''/6, about 4e-11
   !> of a smooth f, and eps |f|/delta, about 4e-11 too; what is left of the digits of a tangent
   !> is far more than this, unless f is rough at the point
   real(wp), parameter :: tolerance = 1.0e-5_wp
   !> The library's own tangents are one-sided differences, which lose digits where a component
   !> is small; of them only the declared structure is in question
   real(wp), parameter :: tolerance_of_differences = 1.0e-2_wp
   real(wp), parameter :: relative_step = epsilon(1.0_wp)**(1.0_wp/3.0_wp)

   !> Equal values computed in two ways: rounding of some hundred terms
   real(wp), parameter :: rounding = 1.0e3_wp*epsilon(1.0_wp)

   !> What is known of the system at the point
   type :: point_type
      real(wp) :: t
      real(wp), allocatable :: q(:), v(:), a(:)        ! [n]
      real(wp), allocatable :: other_q(:), other_v(:)  ! another point near by [n]
      real(wp), allocatable :: f(:), r(:, :)           ! force; work [n, 3]
      type(matrix_type) :: m, k, c, other
      real(wp), allocatable :: q_size(:), v_size(:)    ! lengths to move them by [n]
      real(wp) :: tolerance                            ! of the tangents
   end type point_type

contains

   !> status is dynstep_invalid_input with the first finding where something does not fit
   recursive subroutine check_system(sys, t, q, v, report, status)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(:), v(:)                                       !! [n]
      character(len=finding_length), allocatable, intent(out) :: report(:)     !! findings, [0] where all fits
      type(status_type), intent(inout) :: status
      type(point_type) :: p

      allocate (report(0))
      if (status%failed()) return
      call check_declarations(sys, t, q, v, status)
      if (status%failed()) return
      call look_at_point(sys, t, q, v, p, report, status)
      if (.not. status%failed()) then
         select type (sys)
         class is (linear_system)
            call check_linear(sys, p, report, status)   ! the matrices were checked when they were set
         class default
            call check_mass(sys, p, report, status)
            call check_tangents(sys, p, report, status)
            call check_force(sys, p, report, status)
         end select
         call check_energy(sys, p, report, status)
         ! curvatures vanish at rest
         if (.not. any(abs(p%v) > 0.0_wp)) p%v = p%other_v
         call check_constraints(sys, t, p%q, p%v, p%q_size, p%v_size, maxval(abs(p%f)), report, status)
      end if
      if (.not. status%failed() .and. size(report) > 0) call status%set(dynstep_invalid_input, trim(report(1)))
   end subroutine check_system

   !> Sizes and kinds that make no sense, before anything is called
   recursive subroutine check_declarations(sys, t, q, v, status)
      class(mechanical_system), intent(in) :: sys
      real(wp), intent(in) :: t, q(:), v(:)
      type(status_type), intent(inout) :: status

      call check_structure(sys, status)
      if (status%failed()) return
      associate (n => sys%n)
         if (size(q) /= n .or. size(v) /= n) then
            call refuse('q and v must have n = '//text(n)//' components, not '//text(size(q))//' and '//text(size(v)))
         else if (.not. (ieee_is_finite(t) .and. all(ieee_is_finite(q)) .and. all(ieee_is_finite(v)))) then
            call refuse('t, q and v must be finite')
         end if
      end associate

   contains

      recursive subroutine refuse(why)
         character(len=*), intent(in) :: why
         call status%set(dynstep_invalid_input, why)
      end subroutine refuse
   end subroutine check_declarations

   !> Force, mass, tangents and accelerations at the point, and a second point near by
   recursive subroutine look_at_point(sys, t, q, v, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t, q(:), v(:)
      type(point_type), intent(out) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      type(factorization_type) :: factor
      integer :: j

      p%t = t
      p%q = q
      p%v = v
      allocate (p%f(sys%n), p%a(sys%n), p%r(sys%n, 3), p%q_size(sys%n), p%v_size(sys%n))
      p%a = 0.0_wp
      call motion_sizes(q, v, p%a, p%q_size, p%v_size)
      ! a direction without symmetry: fractional parts of the golden ratio
      p%other_q = q + p%q_size*[(0.1_wp + 0.1_wp*modulo(0.6180339887_wp*j, 1.0_wp), j=1, size(q))]
      p%other_v = v - p%v_size*[(0.1_wp + 0.1_wp*modulo(0.3819660113_wp*j, 1.0_wp), j=1, size(v))]
      associate (s => sys%structure)
         call p%m%init(s%mass, sys%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         call p%other%init(s%mass, sys%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         call p%k%init(s%tangent, sys%n, s%kl, s%ku, s%tangent_is_symmetric, status)
         call p%c%init(merge(kind_zero, s%tangent, s%velocity_free), sys%n, s%kl, s%ku, s%tangent_is_symmetric, status)
         call factor%init(s%mass, sys%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
      end associate
      call force_at(sys, t, q, v, p%f, status)
      call mass_at(sys, t, q, v, p%m, status)
      if (status%failed()) return
      p%a = p%f
      call factor%factorize(p%m, status, t, 'mass matrix')
      if (status%failed()) then
         ! constraints may hold what has no mass
         if (sys%holonomic + sys%nonholonomic == 0) call add(report, status%message)
         call status%clear()
         p%a = 0.0_wp
         return
      end if
      call factor%solve(p%a)
   end subroutine look_at_point

   !> A load that the steppers leave out, a force that they do not call
   recursive subroutine check_linear(sys, p, report, status)
      class(linear_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      integer :: ierr
      associate (f => p%r(:, 1), terms => p%r(:, 3))
         call sys%load(p%t, f, ierr)
         call look('load', ierr, all(ieee_is_finite(f)), status)
         if (status%failed()) return
         if (sys%load_kind == load_none .and. any(abs(f) > 0.0_wp)) &
            & call add(report, 'there is a load, but load_kind = load_none leaves it out; set load_kind = load_procedure')
         call sys%c%multiply_add(-1.0_wp, p%v, f)
         call sys%k%multiply_add(-1.0_wp, p%q, f)
         call row_terms(sys%k, abs(p%q), terms)
         call compare_vectors('a linear system is stepped with p - C v - K q, not with a force that differs', p%f, f, &
            & terms, rounding, report)
      end associate
   end subroutine check_linear

   recursive subroutine force_at(sys, t, q, v, f, status)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(out) :: f(sys%n)
      type(status_type), intent(inout) :: status
      integer :: ierr
      f = 0.0_wp
      if (status%failed()) return
      call sys%force(t, q, v, f, ierr)
      call look('force', ierr, all(ieee_is_finite(f)), status)
   end subroutine force_at

   recursive subroutine mass_at(sys, t, q, v, m, status)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(matrix_type), intent(inout) :: m
      type(status_type), intent(inout) :: status
      integer :: ierr, row, column
      if (status%failed() .or. sys%structure%mass == kind_identity) return
      call m%set_zero()
      call sys%mass(t, q, v, m, ierr)
      call m%first_not_finite(row, column)
      call look('mass', ierr, row == 0, status)
   end subroutine mass_at

   !> r = f - M a at fixed a
   recursive subroutine residual_at(sys, p, q, v, r, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(out) :: r(sys%n)
      type(status_type), intent(inout) :: status
      call force_at(sys, p%t, q, v, r, status)
      if (status%failed() .or. sys%structure%mass == kind_identity) return
      call mass_at(sys, p%t, q, v, p%other, status)
      call p%other%multiply_add(-1.0_wp, p%a, r)
   end subroutine residual_at

   !> Symmetry, and what M is declared not to depend on
   recursive subroutine check_mass(sys, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status

      if (status%failed() .or. sys%structure%mass == kind_identity) return
      if (sys%structure%mass_is_symmetric) call check_symmetry('M', p%m, rounding, report)
      if (sys%structure%mass_is_constant) then
         call mass_at(sys, p%t + 0.1_wp*max(abs(p%t), 1.0_wp), p%other_q, p%other_v, p%other, status)
         call compare_matrices('M is declared constant, but M', p%m, p%other, rounding, report)
      else if (sys%structure%force_is_linear) then
         call mass_at(sys, p%t, p%other_q, p%other_v, p%other, status)
         call compare_matrices('the system is declared linear, but M', p%m, p%other, rounding, report)
      else if (sys%structure%velocity_free) then
         call mass_at(sys, p%t, p%q, p%other_v, p%other, status)
         call compare_matrices('the system is declared velocity-free, but M', p%m, p%other, rounding, report)
      end if
   end subroutine check_mass

   !> Same arguments, same result; what f is declared not to depend on; linearity
   recursive subroutine check_force(sys, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status

      associate (f1 => p%r(:, 1), f2 => p%r(:, 2), terms => p%r(:, 3))
         terms = 0.0_wp
         call force_at(sys, p%t, p%q, p%v, f1, status)
         if (status%failed()) return
         call compare_vectors('force gives two results for the same arguments', p%f, f1, terms, 0.0_wp, report)
         if (sys%structure%velocity_free) then
            call force_at(sys, p%t, p%q, p%other_v, f1, status)
            call compare_vectors('the system is declared velocity-free, but the force changes with v', p%f, f1, &
               & terms, rounding, report)
         end if
         if (.not. sys%structure%force_is_linear) return
         ! f(x + 2 d) - 2 f(x + d) + f(x) vanishes for a linear f
         call force_at(sys, p%t, p%other_q, p%other_v, f1, status)
         call force_at(sys, p%t, 2.0_wp*p%other_q - p%q, 2.0_wp*p%other_v - p%v, f2, status)
         if (status%failed()) return
         f2 = f2 + p%f
         f1 = 2.0_wp*f1
         ! rounding of the terms of a component is no bend
         call row_terms(p%k, p%q_size, terms)
         call compare_vectors('the force is declared linear, but bends between three points of a line', f1, f2, &
            & terms, 1.0e-9_wp, report)
      end associate
   end subroutine check_force

   !> K and C against central differences of f - M a, column by column
   recursive subroutine check_tangents(sys, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      type(matrix_type) :: k, c
      integer(long) :: before

      before = sys%difference_forces
      call tangents_at(sys, p, p%t, p%q, p%v, p%k, p%c, status)
      if (status%failed()) return
      p%tolerance = merge(tolerance_of_differences, tolerance, sys%difference_forces > before)
      call check_columns(sys, p, 'K', p%k, .true., report, status)
      if (.not. sys%structure%velocity_free) call check_columns(sys, p, 'C', p%c, .false., report, status)
      if (sys%structure%tangent_is_symmetric) then
         call check_symmetry('K', p%k, p%tolerance, report)
         call check_symmetry('C', p%c, p%tolerance, report)
      end if
      if (.not. sys%structure%tangent_is_constant .or. status%failed()) return
      k = p%k
      c = p%c
      call tangents_at(sys, p, p%t + 0.1_wp*max(abs(p%t), 1.0_wp), p%other_q, p%other_v, k, c, status)
      if (status%failed()) return
      call compare_matrices('the tangents are declared constant, but K', p%k, k, p%tolerance, report)
      call compare_matrices('the tangents are declared constant, but C', p%c, c, p%tolerance, report)
   end subroutine check_tangents

   recursive subroutine tangents_at(sys, p, t, q, v, k, c, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(in) :: p
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(matrix_type), intent(inout) :: k, c
      type(status_type), intent(inout) :: status
      integer :: ierr, row, column, row_c, column_c
      call k%set_zero()
      call c%set_zero()
      call sys%tangent(t, q, v, p%a, k, c, ierr)
      call k%first_not_finite(row, column)
      call c%first_not_finite(row_c, column_c)
      call look('tangent', ierr, row + row_c == 0, status)
   end subroutine tangents_at

   !> Each column of one tangent; the worst entry is told
   recursive subroutine check_columns(sys, p, name, tangent, of_q, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      character(len=*), intent(in) :: name
      type(matrix_type), intent(in) :: tangent
      logical, intent(in) :: of_q                       !! columns of q, else of v
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      real(wp) :: sums(sys%n), sizes(sys%n)
      real(wp) :: delta, found, given, excess, worst, allowed, worst_found, worst_given
      integer :: i, j, row, column, wrong

      sizes = merge(p%q_size, p%v_size, of_q)
      call row_terms(tangent, sizes, sums)
      worst = 0.0_wp
      worst_found = 0.0_wp
      worst_given = 0.0_wp
      row = 0
      column = 0
      wrong = 0
      do j = 1, sys%n
         delta = relative_step*sizes(j)
         call residual_beside(sys, p, j, delta, of_q, p%r(:, 1), status)
         call residual_beside(sys, p, j, -delta, of_q, p%r(:, 2), status)
         if (status%failed()) return
         do i = 1, sys%n
            found = -(p%r(i, 1) - p%r(i, 2))/(2.0_wp*delta)
            given = tangent%entry(i, j)
            ! what the row makes of the sizes of its columns, and the rounding of its force
            allowed = p%tolerance*max(abs(given), 1.0e-2_wp*sums(i)/sizes(j)) &
               & + rounding*(abs(p%f(i)) + abs(p%r(i, 1)))/delta
            excess = (abs(found - given) - allowed)*sizes(j)
            if (.not. excess > 0.0_wp) cycle
            wrong = wrong + 1
            if (excess <= worst) cycle
            worst = excess
            row = i
            column = j
            worst_found = found
            worst_given = given
         end do
      end do
      if (wrong == 0) return
      call add(report, name//'('//text(row)//','//text(column)//'): tangent gives '//text(worst_given) &
         & //', differences of f - M a give '//text(worst_found)//others(wrong - 1))
   end subroutine check_columns

   !> f - M a with component j of q or of v moved by delta
   recursive subroutine residual_beside(sys, p, j, delta, of_q, r, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(inout) :: p
      integer, intent(in) :: j
      real(wp), intent(in) :: delta
      logical, intent(in) :: of_q
      real(wp), intent(out) :: r(sys%n)
      type(status_type), intent(inout) :: status
      associate (moved => p%r(:, 3))
         moved = merge(p%q, p%v, of_q)
         moved(j) = moved(j) + delta
         if (of_q) then
            call residual_at(sys, p, moved, p%v, r, status)
         else
            call residual_at(sys, p, p%q, moved, r, status)
         end if
      end associate
   end subroutine residual_beside

   recursive subroutine check_energy(sys, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(in) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(in) :: status
      real(wp) :: energy
      integer :: ierr
      if (status%failed() .or. .not. sys%structure%has_energy) return
      call sys%energy(p%t, p%q, p%v, energy, ierr)
      if (ierr /= 0) then
         call add(report, 'the system declares an energy, but energy returned ierr = '//text(ierr))
      else if (.not. ieee_is_finite(energy)) then
         call add(report, 'energy returned '//text(energy))
      end if
   end subroutine check_energy
end module dynstep_check_system
