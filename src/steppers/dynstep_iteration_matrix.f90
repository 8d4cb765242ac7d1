! SPDX-License-Identifier: BSD-3-Clause
!> The matrix of Newton's iteration for an implicit step, S = M + c_v C + c_q K, with the
!> coefficients of the method (Austin 1991, eqs. (55)-(59)).
!>
!> PROGRAMMING INTERFACE
!>
!>     call matrix%init(sys, status)                  storage for the declared structure
!>     call matrix%prepare(sys, t0, t1, c_q, c_v, q, v, a, count, status)     as often as wished:
!>                                                    works where S is not at hand
!>     call matrix%renew(sys, t, q, v, a, count, status)      at another point
!>     call matrix%solve(x, count)                         x = S^-1 x
!>     call matrix%residual(sys, t, q, v, a, r, count, status)    r = f - M a
!>     call matrix%backward_error(r, q, v, a, largest)
!>     matrix%is_exact, matrix%is_constant, matrix%stiffness_ratio
module dynstep_iteration_matrix
   use dynstep_accelerations, only: check_callback, check_finite
   use dynstep_archive, only: archive_type
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: long, wp
   use dynstep_matrix, only: kind_banded, kind_diagonal, kind_identity, kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: status_type
   use dynstep_stepper, only: step_counters
   implicit none
   private

   type, public :: iteration_matrix
      real(wp) :: stiffness_ratio = 0.0_wp        !! largest c_q |K| / M and c_v |C| / M of the rows
      logical :: is_constant = .false.            !! M, C and K are constant, and known
      logical :: is_exact = .false.               !! one correction with S is the solution
      real(wp) :: c_q = 0.0_wp, c_v = 0.0_wp      !! that S was made with
      real(wp) :: t_made = 0.0_wp                 !! time of the point it was made at
      logical, private :: is_ready = .false.      ! S is factorized and may be kept
      type(matrix_type), private :: m, k, c, s
      type(factorization_type), private :: factor
      real(wp), allocatable, private :: work(:, :)   ! [n, 2]
   contains
      procedure :: init => matrix_init
      procedure :: forget => matrix_forget
      procedure :: drop => matrix_drop
      procedure :: prepare => matrix_prepare
      procedure :: renew => matrix_renew
      procedure :: solve => matrix_solve
      procedure :: scalar_inverse => matrix_scalar_inverse
      procedure :: residual => matrix_residual
      procedure :: backward_error => matrix_backward_error
      procedure :: archive => matrix_archive
   end type iteration_matrix

contains

   !> Storage; the structure of S is the smallest that holds M, C and K
   recursive subroutine matrix_init(self, sys, status)
      class(iteration_matrix), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer :: kind, kl, ku
      logical :: symmetric

      if (status%failed()) return
      associate (s => sys%structure, n => sys%n)
         kind = max(kind_diagonal, s%mass, s%tangent)
         kl = 0
         ku = 0
         if (s%mass == kind_banded) then
            kl = s%mass_kl
            ku = s%mass_ku
         end if
         if (s%tangent == kind_banded) then
            kl = max(kl, s%kl)
            ku = max(ku, s%ku)
         end if
         symmetric = s%mass_is_symmetric .and. s%tangent_is_symmetric
         call self%m%init(s%mass, n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         call self%k%init(s%tangent, n, s%kl, s%ku, s%tangent_is_symmetric, status)
         call self%c%init(merge(kind_zero, s%tangent, s%velocity_free), n, s%kl, s%ku, &
            & s%tangent_is_symmetric, status)
         call self%s%init(kind, n, kl, ku, symmetric, status)
         call self%factor%init(kind, n, kl, ku, symmetric, status)
         if (allocated(self%work)) deallocate (self%work)
         allocate (self%work(n, 2))
      end associate
      call self%forget()
   end subroutine matrix_init

   !> Drop what is known of the matrices
   pure subroutine matrix_forget(self)
      class(iteration_matrix), intent(inout) :: self
      self%is_constant = .false.
      self%is_exact = .false.
      self%is_ready = .false.
   end subroutine matrix_forget

   !> Make S anew at the next step, unless it is constant
   pure subroutine matrix_drop(self)
      class(iteration_matrix), intent(inout) :: self
      self%is_ready = self%is_ready .and. self%is_constant
   end subroutine matrix_drop

   !> Have S factorized for these coefficients.  The matrices of a linear system depend on
   !> time at most and are made for the end of the step, those of another at its begin.
   recursive subroutine matrix_prepare(self, sys, t0, t1, c_q, c_v, q, v, a, count, status)
      class(iteration_matrix), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t0, t1                 !! begin of the step, time of the equilibrium
      real(wp), intent(in) :: c_q, c_v
      real(wp), intent(in) :: q(sys%n), v(sys%n), a(sys%n)   !! at t0
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      logical :: linear

      if (status%failed()) return
      linear = sys%structure%force_is_linear
      if (self%is_ready .and. (self%is_constant .or. .not. linear)) then
         if (.not. (abs(c_q - self%c_q) > 0.0_wp .or. abs(c_v - self%c_v) > 0.0_wp)) return
      end if
      self%c_q = c_q
      self%c_v = c_v
      call self%renew(sys, merge(t1, t0, linear), q, v, a, count, status)
   end subroutine matrix_prepare

   !> S at (t, q, v, a), factorized
   recursive subroutine matrix_renew(self, sys, t, q, v, a, count, status)
      class(iteration_matrix), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n), a(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      self%is_ready = .false.
      if (.not. self%is_constant) call evaluate_tangents(self, sys, t, q, v, a, count, status)
      if (status%failed()) return
      call self%s%set_zero()
      call self%m%add_to(1.0_wp, self%s)
      call self%c%add_to(self%c_v, self%s)
      call self%k%add_to(self%c_q, self%s)
      call self%factor%factorize(self%s, status, t, 'iteration matrix M + c_v C + c_q K')
      count%factorizations = count%factorizations + 1
      status%retry = status%failed()
      if (status%failed()) return
      self%is_ready = .true.
      self%t_made = t
      call compare_rows(self)
   end subroutine matrix_renew

   !> M, K and C.  Those by differences are never exact.
   recursive subroutine evaluate_tangents(self, sys, t, q, v, a, count, status)
      class(iteration_matrix), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n), a(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer(long) :: before
      integer :: ierr

      call evaluate_mass(self, sys, t, q, v, count, status)
      if (status%failed()) return
      call self%k%set_zero()
      call self%c%set_zero()
      before = sys%difference_forces
      call sys%tangent(t, q, v, a, self%k, self%c, ierr)
      count%tangents = count%tangents + 1
      count%forces = count%forces + (sys%difference_forces - before)
      call check_callback('tangent', ierr, t, status)
      if (status%failed()) return
      associate (s => sys%structure)
         self%is_constant = s%tangent_is_constant .and. s%mass_is_constant
         self%is_exact = s%force_is_linear .and. sys%difference_forces == before
      end associate
   end subroutine evaluate_tangents

   !> How much stiffness and damping outweigh the mass, by rows
   pure subroutine compare_rows(self)
      class(iteration_matrix), intent(inout) :: self
      integer :: i
      real(wp) :: largest
      call self%k%absolute_row_sums(self%work(:, 1))
      call self%c%absolute_row_sums(self%work(:, 2))
      largest = 0.0_wp
      do i = 1, size(self%work, 1)
         associate (row => max(abs(self%c_q)*self%work(i, 1), abs(self%c_v)*self%work(i, 2)), &
            & mass => abs(self%m%entry(i, i)))
            if (row > largest*mass) largest = row/max(mass, tiny(1.0_wp))
         end associate
      end do
      self%stiffness_ratio = largest
   end subroutine compare_rows

   recursive subroutine evaluate_mass(self, sys, t, q, v, count, status)
      class(iteration_matrix), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr
      if (sys%structure%mass == kind_identity) return
      call self%m%set_zero()
      call sys%mass(t, q, v, self%m, ierr)
      count%masses = count%masses + 1
      call check_callback('mass', ierr, t, status)
   end subroutine evaluate_mass

   !> x = S^-1 x
   pure subroutine matrix_solve(self, x, count)
      class(iteration_matrix), intent(in) :: self
      real(wp), intent(inout) :: x(:)
      type(step_counters), intent(inout) :: count
      call self%factor%solve(x)
      count%solves = count%solves + 1
   end subroutine matrix_solve

   !> 1/S of a system with one coordinate
   pure real(wp) function matrix_scalar_inverse(self)
      class(iteration_matrix), intent(in) :: self
      real(wp) :: x(1)
      x = 1.0_wp
      call self%factor%solve(x)
      matrix_scalar_inverse = x(1)
   end function matrix_scalar_inverse

   !> r = f - M a
   recursive subroutine matrix_residual(self, sys, t, q, v, a, r, count, status)
      class(iteration_matrix), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n), a(sys%n)
      real(wp), intent(inout) :: r(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr
      if (status%failed()) return
      call sys%force(t, q, v, r, ierr)
      count%forces = count%forces + 1
      call check_callback('force', ierr, t, status)
      if (status%failed()) return
      call check_finite('force', r, t, status)
      if (status%failed()) return
      if (.not. sys%structure%mass_is_constant) then
         call evaluate_mass(self, sys, t, q, v, count, status)
         if (status%failed()) return
      end if
      call self%m%multiply_add(-1.0_wp, a, r)
      if (.not. sys%structure%mass_is_constant) call check_finite('mass', r, t, status)
   end subroutine matrix_residual

   !> Backward error of (q, v, a): the largest |r| / (|K||q| + |C||v| + |M||a|) of the rows.  A
   !> system whose coefficients differ by no more than this has the solution (q, v, a).
   pure subroutine matrix_backward_error(self, r, q, v, a, largest)
      class(iteration_matrix), intent(inout) :: self
      real(wp), intent(in) :: r(:), q(:), v(:), a(:)
      real(wp), intent(out) :: largest
      integer :: i
      associate (sizes => self%work(:, 1))
         sizes = 0.0_wp
         call add_sizes(self%k, q, sizes)
         call add_sizes(self%c, v, sizes)
         call add_sizes(self%m, a, sizes)
         largest = 0.0_wp
         do i = 1, size(r)
            if (.not. abs(r(i)) > 0.0_wp) cycle
            if (sizes(i) > tiny(1.0_wp)*abs(r(i))) then
               largest = max(largest, abs(r(i))/sizes(i))
            else
               largest = huge(largest)
            end if
         end do
      end associate
   end subroutine matrix_backward_error

   !> y = y + |A||x|
   pure subroutine add_sizes(a, x, y)
      type(matrix_type), intent(in) :: a
      real(wp), intent(in) :: x(a%n)
      real(wp), intent(inout) :: y(a%n)
      integer :: j
      select case (a%kind)
      case (kind_zero)
         return
      case (kind_identity)
         y = y + abs(x)
      case (kind_diagonal)
         y = y + abs(a%a(:, 1)*x)
      case (kind_banded)
         do j = 1, a%n
            associate (first => max(1, j - a%ku), last => min(a%n, j + a%kl))
               y(first:last) = y(first:last) + abs(x(j)*a%a(a%ku + 1 + first - j:a%ku + 1 + last - j, j))
            end associate
         end do
      case default
         do j = 1, a%n
            y = y + abs(x(j)*a%a(:, j))
         end do
      end select
   end subroutine add_sizes

   !> M, C, K where they are known, and the factors in force.  S is not kept, and M is no longer that of S where it varies.
   recursive subroutine matrix_archive(self, name, file)
      class(iteration_matrix), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('is_constant', self%is_constant)
      call file%item('is_exact', self%is_exact)
      call file%item('is_ready', self%is_ready)
      call file%item('c_q', self%c_q)
      call file%item('c_v', self%c_v)
      call file%item('stiffness_ratio', self%stiffness_ratio)
      if (self%is_constant .or. self%is_ready) then
         call self%m%archive('m', file)
         call self%k%archive('k', file)
         call self%c%archive('c', file)
      end if
      if (self%is_ready) call self%factor%archive('factor', file)
      call file%end_section()
      if (file%failed()) call self%forget()
   end subroutine matrix_archive
end module dynstep_iteration_matrix
