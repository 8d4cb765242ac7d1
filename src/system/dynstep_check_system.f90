! SPDX-License-Identifier: BSD-3-Clause
!> Does a system do what it declares?  Compares the tangents and the declared structure of a
!> mechanical system with differences of its own procedures at one point.
!>
!> PROGRAMMING INTERFACE
!>
!>     character(len=finding_length), allocatable :: report(:)
!>     call check_system(sys, t, q, v, report, status)
!>     if (status%failed()) print '(a)', report
!>
!>   Choose a general point: at a point of symmetry mistakes may not show.  Costs 4n + 20
!>   evaluations of force and mass; meant for the day on which a model is written.
module dynstep_check_system
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: long, wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_identity, kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_callback_failed, dynstep_invalid_input, dynstep_not_finite, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_system

   integer, parameter, public :: finding_length = 160

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
      real(wp) :: q_size, v_size                       ! lengths to move q and v by
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
            continue                     ! the matrices were checked when they were set
         class default
            call check_mass(sys, p, report, status)
            call check_force(sys, p, report, status)
            call check_tangents(sys, p, report, status)
         end select
         call check_energy(sys, p, report, status)
      end if
      if (.not. status%failed() .and. size(report) > 0) call status%set(dynstep_invalid_input, trim(report(1)))
   end subroutine check_system

   recursive subroutine add(report, finding)
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      character(len=*), intent(in) :: finding
      character(len=finding_length), allocatable :: longer(:)
      allocate (longer(size(report) + 1))
      longer(:size(report)) = report
      longer(size(longer)) = finding
      call move_alloc(longer, report)
   end subroutine add

   !> Sizes and kinds that make no sense, before anything is called
   recursive subroutine check_declarations(sys, t, q, v, status)
      class(mechanical_system), intent(in) :: sys
      real(wp), intent(in) :: t, q(:), v(:)
      type(status_type), intent(inout) :: status

      associate (s => sys%structure, n => sys%n)
         if (n < 1) then
            call refuse('n = '//text(n)//' must be 1 or more')
         else if (size(q) /= n .or. size(v) /= n) then
            call refuse('q and v must have n = '//text(n)//' components, not '//text(size(q))//' and '//text(size(v)))
         else if (.not. (ieee_is_finite(t) .and. all(ieee_is_finite(q)) .and. all(ieee_is_finite(v)))) then
            call refuse('t, q and v must be finite')
         else if (s%mass < kind_identity .or. s%mass > kind_dense) then
            call refuse('structure%mass = '//text(s%mass)//' is not identity, diagonal, banded or dense')
         else if (s%tangent < kind_diagonal .or. s%tangent > kind_dense) then
            call refuse('structure%tangent = '//text(s%tangent)//' is not diagonal, banded or dense')
         else if (s%mass == kind_banded .and. (min(s%mass_kl, s%mass_ku) < 0 .or. max(s%mass_kl, s%mass_ku) >= n)) then
            call refuse('structure%mass_kl and mass_ku must lie between 0 and n - 1')
         else if (s%tangent == kind_banded .and. (min(s%kl, s%ku) < 0 .or. max(s%kl, s%ku) >= n)) then
            call refuse('structure%kl and ku must lie between 0 and n - 1')
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
      p%q_size = length_of(q)
      p%v_size = length_of(v)
      ! a direction without symmetry: fractional parts of the golden ratio
      p%other_q = q + p%q_size*[(0.1_wp + 0.1_wp*modulo(0.6180339887_wp*j, 1.0_wp), j=1, size(q))]
      p%other_v = v - p%v_size*[(0.1_wp + 0.1_wp*modulo(0.3819660113_wp*j, 1.0_wp), j=1, size(v))]
      allocate (p%f(sys%n), p%a(sys%n), p%r(sys%n, 3))
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
         call add(report, status%message)
         call status%clear()
         p%a = 0.0_wp
         return
      end if
      call factor%solve(p%a)
   end subroutine look_at_point

   !> A length that is a change of x and not its rounding
   pure real(wp) function length_of(x)
      real(wp), intent(in) :: x(:)
      length_of = maxval(abs(x))
      if (.not. length_of > 0.0_wp) length_of = 1.0_wp
   end function length_of

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

   recursive subroutine look(name, ierr, is_finite, status)
      character(len=*), intent(in) :: name
      integer, intent(in) :: ierr
      logical, intent(in) :: is_finite
      type(status_type), intent(inout) :: status
      if (ierr /= 0) then
         call status%set(dynstep_callback_failed, name//' returned ierr = '//text(ierr) &
            & //' while the system was checked; choose a point inside its domain')
      else if (.not. is_finite) then
         call status%set(dynstep_not_finite, name//' returned a value that is not finite while the system was checked')
      end if
   end subroutine look

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

      associate (f1 => p%r(:, 1), f2 => p%r(:, 2))
         call force_at(sys, p%t, p%q, p%v, f1, status)
         if (status%failed()) return
         call compare_vectors('force gives two results for the same arguments', p%f, f1, 0.0_wp, report)
         if (sys%structure%velocity_free) then
            call force_at(sys, p%t, p%q, p%other_v, f1, status)
            call compare_vectors('the system is declared velocity-free, but the force changes with v', p%f, f1, &
               & rounding, report)
         end if
         if (.not. sys%structure%force_is_linear) return
         ! f(x + 2 d) - 2 f(x + d) + f(x) vanishes for a linear f
         call force_at(sys, p%t, p%other_q, p%other_v, f1, status)
         call force_at(sys, p%t, 2.0_wp*p%other_q - p%q, 2.0_wp*p%other_v - p%v, f2, status)
         if (status%failed()) return
         f2 = f2 + p%f
         f1 = 2.0_wp*f1
         call compare_vectors('the force is declared linear, but bends between three points of a line', f1, f2, &
            & 1.0e-9_wp, report)
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
      real(wp), allocatable :: sums(:)
      real(wp) :: delta, found, given, excess, worst, allowed, worst_found, worst_given
      integer :: i, j, row, column, wrong

      allocate (sums(sys%n))
      call tangent%absolute_row_sums(sums)
      worst = 0.0_wp
      worst_found = 0.0_wp
      worst_given = 0.0_wp
      row = 0
      column = 0
      wrong = 0
      do j = 1, sys%n
         delta = relative_step*merge(p%q_size, p%v_size, of_q)
         call residual_beside(sys, p, j, delta, of_q, p%r(:, 1), status)
         call residual_beside(sys, p, j, -delta, of_q, p%r(:, 2), status)
         if (status%failed()) return
         do i = 1, sys%n
            found = -(p%r(i, 1) - p%r(i, 2))/(2.0_wp*delta)
            given = tangent%entry(i, j)
            ! entries of the row, and the rounding of its force, set the scale
            allowed = p%tolerance*max(abs(given), 1.0e-2_wp*sums(i)) &
               & + rounding*(abs(p%f(i)) + abs(p%r(i, 1)))/delta
            excess = abs(found - given) - allowed
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

   pure function others(wrong) result(words)
      integer, intent(in) :: wrong
      character(len=40) :: words
      words = ''
      if (wrong > 0) words = ' ('//text(wrong)//' more like this)'
   end function others

   recursive subroutine check_symmetry(name, a, allowed, report)
      character(len=*), intent(in) :: name
      type(matrix_type), intent(in) :: a
      real(wp), intent(in) :: allowed                !! difference, relative to the largest entry of both rows
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      real(wp) :: sums(a%n)
      integer :: i, j
      if (a%kind < kind_banded) return
      call a%absolute_row_sums(sums)
      do j = 1, a%n
         do i = j + 1, a%n
            if (abs(a%entry(i, j) - a%entry(j, i)) <= allowed*max(sums(i), sums(j))) cycle
            call add(report, name//' is declared symmetric, but '//name//'('//text(i)//','//text(j)//') = ' &
               & //text(a%entry(i, j))//' and '//name//'('//text(j)//','//text(i)//') = '//text(a%entry(j, i)))
            return
         end do
      end do
   end subroutine check_symmetry

   recursive subroutine compare_matrices(what, a, b, allowed, report)
      character(len=*), intent(in) :: what
      type(matrix_type), intent(in) :: a, b
      real(wp), intent(in) :: allowed                !! difference, relative to the row
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      real(wp) :: sums(a%n)
      integer :: i, j
      call a%absolute_row_sums(sums)
      do j = 1, a%n
         do i = 1, a%n
            if (abs(a%entry(i, j) - b%entry(i, j)) <= allowed*sums(i)) cycle
            call add(report, what//'('//text(i)//','//text(j)//') is '//text(a%entry(i, j)) &
               & //' here and '//text(b%entry(i, j))//' near by')
            return
         end do
      end do
   end subroutine compare_matrices

   recursive subroutine compare_vectors(what, a, b, allowed, report)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: a(:), b(:)
      real(wp), intent(in) :: allowed                !! difference, relative to the largest component
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      integer :: i
      do i = 1, size(a)
         if (abs(a(i) - b(i)) <= allowed*max(maxval(abs(a)), maxval(abs(b)))) cycle
         call add(report, what//': component '//text(i)//' is '//text(a(i))//' and '//text(b(i)))
         return
      end do
   end subroutine compare_vectors

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
