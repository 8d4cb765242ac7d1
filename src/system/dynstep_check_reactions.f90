! SPDX-License-Identifier: BSD-3-Clause
!> The part of CHECK_SYSTEM that looks at reactions: that a user's own is declared, and that its derivatives
!> by multipliers, coordinates and velocities are those of differences.
module dynstep_check_reactions
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_findings, only: add, finding_length, look, others
   use dynstep_kinds, only: long, wp
   use dynstep_line_derivative, only: line_derivative
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: check_reactions

   !> As in dynstep_check_constraints
   real(wp), parameter :: tolerance = 1.0e-6_wp
   !> Differences of reactions that are made of differences of g: 1e-12 of the reaction, over a step of 2^-6
   !> of a coordinate and less
   real(wp), parameter :: tolerance_of_tangent = 1.0e-5_wp

   type :: point_type
      real(wp) :: t
      real(wp), allocatable :: q(:), v(:), q_size(:), v_size(:)     ! [n]
      real(wp), allocatable :: lambda(:), psi(:)                    ! [m], [p]
      real(wp) :: load                                              ! size of the reactions
   end type point_type

contains

   !> Findings about the reaction at t, q, v, under multipliers that make it as large as the forces
   recursive subroutine check_reactions(sys, t, q, v, q_size, v_size, load, jacobian_size, report, status)
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(in) :: q_size(sys%n), v_size(sys%n)     !! lengths to move them by
      real(wp), intent(in) :: load                             !! size of the forces
      real(wp), intent(in) :: jacobian_size                    !! of G and K
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      type(point_type) :: p
      real(wp) :: scale
      integer :: i

      if (status%failed()) return
      p%t = t
      p%q = q
      p%v = v
      p%q_size = q_size
      p%v_size = v_size
      scale = 1.0_wp
      if (min(load, jacobian_size) > 0.0_wp) scale = load/jacobian_size
      p%load = scale*jacobian_size
      ! no two of the same size
      p%lambda = [(scale*(0.5_wp + modulo(0.6180339887_wp*i, 1.0_wp)), i=1, sys%holonomic)]
      p%psi = [(-scale*(0.5_wp + modulo(0.3819660113_wp*i, 1.0_wp)), i=1, sys%nonholonomic)]
      if (sys%constraints%reaction_is_general) then
         call check_multiplier_derivatives(sys, p, report, status)
      else
         call check_lagrange(sys, p, report, status)
      end if
      call check_reaction_tangent(sys, p, report, status)
   end subroutine check_reactions

   !> A reaction that the steppers do not call
   recursive subroutine check_lagrange(sys, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(in) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      real(wp) :: r(sys%n), r_found(sys%n)
      integer :: ierr, i
      call sys%reaction(p%t, p%q, p%v, p%lambda, p%psi, r, ierr)
      call look('reaction', ierr, all(ieee_is_finite(r)), status)
      if (status%failed()) return
      call sys%lagrange_reaction(p%t, p%q, p%v, p%lambda, p%psi, r_found, ierr)
      call look('constraint_jacobian', ierr, all(ieee_is_finite(r_found)), status)
      if (status%failed()) return
      do i = 1, sys%n
         if (abs(r(i) - r_found(i)) <= tolerance*maxval(abs(r_found))) cycle
         call add(report, 'reaction gives '//text(r(i))//' in equation '//text(i)//', but steps use -G^T lambda - K^T psi, ' &
            & //text(r_found(i))//'; set constraints%reaction_is_general')
         return
      end do
   end subroutine check_lagrange

   !> dr/dlambda and dr/dpsi
   recursive subroutine check_multiplier_derivatives(sys, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(in) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      real(wp) :: given(sys%n, sys%holonomic + sys%nonholonomic), found(sys%n, sys%holonomic + sys%nonholonomic)
      character(len=6) :: multiplier
      integer(long) :: before
      integer :: ierr, i, j
      associate (m => sys%holonomic)
         given = 0.0_wp
         before = sys%difference_constraints
         call sys%reaction_jacobian(p%t, p%q, p%v, p%lambda, p%psi, given(:, :m), given(:, m + 1:), ierr)
         call look('reaction_jacobian', ierr, all(ieee_is_finite(given)), status)
         if (status%failed() .or. sys%difference_constraints > before) return
         found = 0.0_wp
         call sys%difference_reaction_jacobian(p%t, p%q, p%v, p%lambda, p%psi, found(:, :m), found(:, m + 1:), ierr)
         call look('reaction', ierr, all(ieee_is_finite(found)), status)
         if (status%failed()) return
         do j = 1, size(found, 2)
            do i = 1, sys%n
               if (abs(given(i, j) - found(i, j)) <= tolerance*maxval(abs(found(:, j)))) cycle
               multiplier = 'lambda'
               if (j > m) multiplier = 'psi'
               call add(report, 'dr('//text(i)//')/d'//trim(multiplier)//'('//text(merge(j, j - m, j <= m))//') at t = ' &
                  & //text(p%t)//': reaction_jacobian gives '//text(given(i, j))//', differences give '//text(found(i, j)))
               return
            end do
         end do
      end associate
   end subroutine check_multiplier_derivatives

   !> -dr/dq and -dr/dv where they are given, and that they are used
   recursive subroutine check_reaction_tangent(sys, p, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(in) :: p
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      type(matrix_type) :: k, c
      integer :: ierr, row, column, row_c, column_c

      if (status%failed()) return
      associate (s => sys%structure)
         call k%init(s%tangent, sys%n, s%kl, s%ku, s%tangent_is_symmetric, status)
         call c%init(merge(kind_zero, s%tangent, s%velocity_free), sys%n, s%kl, s%ku, s%tangent_is_symmetric, status)
      end associate
      if (status%failed()) return
      call k%set_zero()
      call c%set_zero()
      call sys%reaction_tangent(p%t, p%q, p%v, p%lambda, p%psi, k, c, ierr)
      call k%first_not_finite(row, column)
      call c%first_not_finite(row_c, column_c)
      call look('reaction_tangent', ierr, row + row_c == 0, status)
      if (status%failed()) return
      if (sys%constraints%has_reaction_tangent) then
         call compare_tangent(sys, p, 'q', k, p%q_size, report, status)
         if (c%kind /= kind_zero) call compare_tangent(sys, p, 'v', c, p%v_size, report, status)
      else if (largest_entry(k) > 0.0_wp .or. largest_entry(c) > 0.0_wp) then
         call add(report, 'reaction_tangent gives tangents that no step uses; set constraints%has_reaction_tangent')
      end if
   end subroutine check_reaction_tangent

   pure real(wp) function largest_entry(a)
      type(matrix_type), intent(in) :: a
      integer :: i, j
      largest_entry = 0.0_wp
      if (a%kind == kind_zero) return
      do j = 1, a%n
         do i = 1, a%n
            largest_entry = max(largest_entry, abs(a%entry(i, j)))
         end do
      end do
   end function largest_entry

   !> Column by column; an entry outside the band that is declared is left out on purpose
   recursive subroutine compare_tangent(sys, p, variable, given, sizes, report, status)
      class(mechanical_system), intent(inout) :: sys
      type(point_type), intent(in) :: p
      character(len=*), intent(in) :: variable
      type(matrix_type), intent(in) :: given
      real(wp), intent(in) :: sizes(:)
      character(len=finding_length), allocatable, intent(inout) :: report(:)
      type(status_type), intent(inout) :: status
      type(line_derivative) :: d
      real(wp) :: x(sys%n), found(sys%n, sys%n), terms, excess, worst
      integer :: i, j, row, column, wrong, ierr
      if (status%failed()) return
      call d%resize(sys%n)
      do j = 1, sys%n
         call d%begin(1, 2.0_wp**(-6), 1.0_wp, four_points=.false.)
         do while (d%is_running)
            if (variable == 'q') then
               x = p%q
               x(j) = x(j) + d%point()*sizes(j)
               call sys%reaction(p%t, x, p%v, p%lambda, p%psi, d%f, ierr)
            else
               x = p%v
               x(j) = x(j) + d%point()*sizes(j)
               call sys%reaction(p%t, p%q, x, p%lambda, p%psi, d%f, ierr)
            end if
            call d%give(ierr)
         end do
         call look('reaction', d%ierr, .true., status)
         if (status%failed()) return
         found(:, j) = -d%value/sizes(j)
      end do
      worst = 0.0_wp
      row = 0
      column = 0
      wrong = 0
      do i = 1, sys%n
         terms = sum(abs(found(i, :))*sizes)
         do j = 1, sys%n
            if (.not. is_stored(given, i, j)) cycle
            excess = abs(given%entry(i, j) - found(i, j))*sizes(j) - tolerance_of_tangent*max(terms, tolerance*p%load)
            if (.not. excess > 0.0_wp) cycle
            wrong = wrong + 1
            if (excess <= worst) cycle
            worst = excess
            row = i
            column = j
         end do
      end do
      if (wrong > 0) call add(report, '-dr('//text(row)//')/d'//variable//'('//text(column)//') at t = '//text(p%t) &
         & //': reaction_tangent gives '//text(given%entry(row, column))//', differences give '//text(found(row, column)) &
         & //others(wrong - 1))
   end subroutine compare_tangent

   pure logical function is_stored(a, i, j)
      type(matrix_type), intent(in) :: a
      integer, intent(in) :: i, j
      is_stored = a%kind == kind_dense .or. (a%kind == kind_diagonal .and. i == j) .or. &
         & (a%kind == kind_banded .and. i - j <= a%kl .and. j - i <= a%ku)
   end function is_stored
end module dynstep_check_reactions
