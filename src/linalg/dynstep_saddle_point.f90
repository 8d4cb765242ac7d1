! SPDX-License-Identifier: BSD-3-Clause
!> Linear systems of constrained motion (Jay & Negrut 2008, eq. (12)):
!>
!>   [ A  -RL  -RP ] [ x      ]   [ b_x      ]
!>   [ G    0    0 ] [ lambda ] = [ b_lambda ]        RL = dr/dlambda, by default -G^T
!>   [ K    0    0 ] [ psi    ]   [ b_psi    ]        RP = dr/dpsi,    by default -K^T
!>
!> PROGRAMMING INTERFACE
!>
!>   call s%init(n, m, p, kind, kl, ku, symmetric, g_pattern, k_pattern, general_reaction, order, status)
!>   call s%factorize(a, g, k, status, [t], [name], [rl], [rp], [hold_psi], [regularization])
!>   call s%solve(x, lambda, psi)                          right sides in, solutions out
!>   call s%reciprocal_condition(rcond, status)
!>   s%by_schur, s%is_banded, s%kl, s%ku, s%order, s%singular_equation
!>
!>   Two ways: LU with pivoting of the whole (dynstep_saddle_lu), for every structure; and the complement of A
!>   (dynstep_saddle_schur) where A is the identity or diagonal and the reaction is not general, which takes a
!>   fifth to a tenth of the time.  The second one declines matrices that it would not solve as well: entries of A that are zero
!>   or of both signs, constraints that are close to dependent.  Those go to LU, which also says what is singular.  Storage for
!>   both is there from init on: nothing is allocated after it (but see dynstep_factorization for symmetric A without
!>   constraints).
!>
!> An object may be copied by assignment.
module dynstep_saddle_point
   use dynstep_archive, only: archive_type
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_diagonal, kind_identity, matrix_type
   use dynstep_saddle_lu, only: saddle_lu_type
   use dynstep_saddle_schur, only: saddle_schur_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   type, public :: saddle_point_type
      integer :: n = 0, m = 0, p = 0           !! coordinates, constraints g, constraints k
      logical :: by_schur = .false.            !! the factors in force are those of the complement of A
      logical :: is_banded = .false.           !! LU is that of a band
      integer :: kl = 0, ku = 0                !! bandwidths of LU, 0 when dense
      integer :: singular_equation = 0         !! equation that factorize refused: of motion 1 .. n, of g, of k; or 0
      integer, allocatable :: order(:)         !! unknown at each place of the matrix of LU [n + m + p]
      logical, private :: is_made = .false.
      logical, private :: has_schur = .false.  ! init chose the complement
      logical, private :: general_reaction = .false.
      integer, private :: kind = kind_identity, a_kl = 0, a_ku = 0      ! structure of A
      integer, private :: g_entries = 0, k_entries = 0
      type(saddle_schur_type), private :: schur
      type(saddle_lu_type), private :: lu
   contains
      procedure :: init => saddle_init
      procedure :: factorize => saddle_factorize
      procedure :: solve => saddle_solve
      procedure :: reciprocal_condition => saddle_reciprocal_condition
      procedure :: archive => saddle_archive
   end type saddle_point_type

contains

   !> Choose the ways, allocate
   recursive subroutine saddle_init(self, n, m, p, kind, kl, ku, symmetric, g_pattern, k_pattern, general_reaction, &
      & order, status)
      class(saddle_point_type), intent(inout) :: self
      integer, intent(in) :: n                          !! coordinates, >= 1
      integer, intent(in) :: m, p                       !! constraints g and k
      integer, intent(in) :: kind, kl, ku               !! structure of A, see dynstep_matrix
      logical, intent(in) :: symmetric                  !! of A
      type(pattern_type), intent(in) :: g_pattern       !! of G, dense where not allocated
      type(pattern_type), intent(in) :: k_pattern       !! of K
      logical, intent(in) :: general_reaction           !! factorize will get RL and RP
      !> Unknowns in band order: 1 .. n coordinates, n + 1 .. n + m, n + m + 1 .. n + m + p.  Not allocated: found here.
      integer, allocatable, intent(in) :: order(:)
      type(status_type), intent(inout) :: status
      integer :: total, stat

      if (status%failed()) return
      total = n + m + p
      if (n < 1 .or. min(m, p) < 0) then
         call status%set(dynstep_invalid_input, 'a system of constrained motion needs n >= 1 and m, p >= 0, not n = ' &
            & //text(n)//', m = '//text(m)//', p = '//text(p))
      end if
      call g_pattern%check('the Jacobian of g', m, n, status)
      call k_pattern%check('the Jacobian of k', p, n, status)
      if (allocated(order)) call check_order(total, order, status)
      if (status%failed()) return
      self%n = n
      self%m = m
      self%p = p
      self%kind = kind
      self%a_kl = merge(kl, 0, kind == kind_banded)
      self%a_ku = merge(ku, 0, kind == kind_banded)
      self%g_entries = entries(m, n, g_pattern)
      self%k_entries = entries(p, n, k_pattern)
      self%general_reaction = general_reaction
      self%singular_equation = 0
      self%by_schur = .false.
      self%is_made = .false.
      call self%lu%init(n, m, p, kind, kl, ku, symmetric, g_pattern, k_pattern, general_reaction, order, status)
      if (status%failed()) return
      self%is_banded = self%lu%is_banded
      self%kl = self%lu%kl
      self%ku = self%lu%ku
      self%order = self%lu%order
      self%has_schur = (kind == kind_identity .or. kind == kind_diagonal) .and. m + p > 0 .and. .not. general_reaction
      if (self%has_schur) then
         call self%schur%init(n, m, p, kind == kind_identity, g_pattern, k_pattern, order, stat)
         if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a system of constrained motion with ' &
            & //text(total)//' unknowns; declare the patterns of the Jacobians')
      end if
      self%is_made = .not. status%failed()
   end subroutine saddle_init

   pure integer function entries(rows, n, pattern)
      integer, intent(in) :: rows, n
      type(pattern_type), intent(in) :: pattern
      entries = rows*n
      if (rows > 0 .and. .not. pattern%is_dense()) entries = size(pattern%column)
   end function entries

   !> Each number from 1 to total once
   pure subroutine check_order(total, order, status)
      integer, intent(in) :: total
      integer, intent(in) :: order(:)
      type(status_type), intent(inout) :: status
      logical :: seen(total)
      integer :: j
      if (status%failed()) return
      if (size(order) /= total) then
         call status%set(dynstep_invalid_input, 'the order of the unknowns has '//text(size(order)) &
            & //' entries, not n + m + p = '//text(total))
         return
      end if
      seen = .false.
      do j = 1, total
         if (order(j) < 1 .or. order(j) > total) then
            call status%set(dynstep_invalid_input, 'the order of the unknowns has '//text(order(j))//' at place ' &
               & //text(j)//', outside 1 to n + m + p = '//text(total))
            return
         end if
         if (seen(order(j))) then
            call status%set(dynstep_invalid_input, 'the order of the unknowns has '//text(order(j))//' twice')
            return
         end if
         seen(order(j)) = .true.
      end do
   end subroutine check_order

   !> Fill in and factorize.  A singular matrix is refused with dynstep_singular_matrix and the equation that depends
   !> on the others.
   pure subroutine saddle_factorize(self, a, g, k, status, t, name, rl, rp, hold_psi, regularization)
      class(saddle_point_type), intent(inout) :: self
      type(matrix_type), intent(in) :: a                !! of the structure given to init
      type(jacobian_type), intent(in) :: g              !! G [m, n], not looked at where m = 0
      type(jacobian_type), intent(in) :: k              !! K [p, n], not looked at where p = 0
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t               !! time, for the sentence
      character(len=*), intent(in), optional :: name    !! for the sentence, default 'matrix of constrained motion'
      real(wp), intent(in), optional :: rl(:, :)        !! dr/dlambda [n, m], where the reaction is general
      real(wp), intent(in), optional :: rp(:, :)        !! dr/dpsi [n, p], where the reaction is general
      !> Rows and columns of K are left out, -1 on their diagonal: psi = -b_psi, x and lambda as with p = 0.  Default .false.
      logical, intent(in), optional :: hold_psi
      !> eps > 0: -eps s(i) on the diagonal of the multipliers, s(i) = sum over j of G(i,j)^2/|A(j,j)| (|A| at its
      !> largest where A(j,j) is 0), for constraints that depend on each other.  Default 0.
      real(wp), intent(in), optional :: regularization
      logical :: without_psi
      real(wp) :: eps

      if (status%failed()) return
      self%singular_equation = 0
      self%by_schur = .false.
      if (self%m + self%p > 0) call check_arguments(self, a, g, k, status, rl, rp)
      if (status%failed()) return
      without_psi = .false.
      if (present(hold_psi)) without_psi = hold_psi
      eps = 0.0_wp
      if (present(regularization)) eps = max(0.0_wp, regularization)

      if (self%has_schur) then
         call self%schur%factorize(a, g, k, without_psi, eps, self%by_schur)
         if (self%by_schur) return
      end if
      if (present(name) .or. self%m + self%p == 0) then
         call self%lu%factorize(a, g, k, without_psi, eps, status, t, name, rl, rp)
      else
         call self%lu%factorize(a, g, k, without_psi, eps, status, t, 'matrix of constrained motion', rl, rp)
      end if
      self%singular_equation = self%lu%singular_equation
   end subroutine saddle_factorize

   !> What would lead out of bounds
   pure subroutine check_arguments(self, a, g, k, status, rl, rp)
      class(saddle_point_type), intent(in) :: self
      type(matrix_type), intent(in) :: a
      type(jacobian_type), intent(in) :: g, k
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: rl(:, :), rp(:, :)
      logical :: fits

      fits = self%is_made .and. a%kind == self%kind .and. a%n == self%n
      if (fits .and. self%kind == kind_banded) fits = a%kl == self%a_kl .and. a%ku == self%a_ku
      if (fits .and. self%m > 0) fits = allocated(g%value)
      if (fits .and. self%p > 0) fits = allocated(k%value)
      if (fits .and. self%m > 0) fits = size(g%value) == self%g_entries
      if (fits .and. self%p > 0) fits = size(k%value) == self%k_entries
      if (.not. fits) then
         call status%set(dynstep_invalid_input, 'the system of constrained motion was made for matrices of another structure')
         return
      end if
      if (.not. self%general_reaction) then
         if (present(rl) .or. present(rp)) call status%set(dynstep_invalid_input, &
            & 'derivatives of the reaction were given, but it was not declared general')
         return
      end if
      if (present(rl)) fits = all(shape(rl) == [self%n, self%m])
      if (present(rp)) fits = fits .and. all(shape(rp) == [self%n, self%p])
      if (.not. fits) call status%set(dynstep_invalid_input, 'the derivatives of the reaction need the shapes n x m = ' &
         & //text(self%n)//' x '//text(self%m)//' and n x p = '//text(self%n)//' x '//text(self%p))
   end subroutine check_arguments

   !> Solution in place of the right sides; they are left alone where factorize did not succeed
   pure subroutine saddle_solve(self, x, lambda, psi)
      class(saddle_point_type), intent(inout) :: self
      real(wp), intent(inout) :: x(self%n)
      real(wp), intent(inout) :: lambda(self%m)
      real(wp), intent(inout) :: psi(self%p)
      if (self%by_schur) then
         call self%schur%solve(x, lambda, psi)
      else
         call self%lu%solve(x, lambda, psi)
      end if
   end subroutine saddle_solve

   !> Estimate of 1/(|S| |S^-1|) in the 1-norm, S the whole matrix; 0 before factorize
   pure subroutine saddle_reciprocal_condition(self, rcond, status)
      class(saddle_point_type), intent(inout) :: self
      real(wp), intent(out) :: rcond
      type(status_type), intent(inout) :: status
      integer :: stat
      rcond = 0.0_wp
      if (status%failed()) return
      if (.not. self%by_schur) then
         call self%lu%factorization%reciprocal_condition(rcond, status)
         return
      end if
      call self%schur%reciprocal_condition(rcond, stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a condition estimate of order ' &
         & //text(self%n + self%m + self%p))
   end subroutine saddle_reciprocal_condition

   !> The factors in force
   recursive subroutine saddle_archive(self, name, file)
      class(saddle_point_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%expect('n', self%n)
      call file%expect('m', self%m)
      call file%expect('p', self%p)
      call file%expect('has_schur', self%has_schur)
      call file%item('by_schur', self%by_schur)
      call file%item('singular_equation', self%singular_equation)
      if (self%by_schur .and. .not. self%has_schur) call file%refuse('there is no complement of A here')
      if (self%by_schur .and. .not. file%failed()) then
         call self%schur%archive('schur', file)
      else
         call self%lu%archive('lu', file)
      end if
      call file%end_section()
   end subroutine saddle_archive
end module dynstep_saddle_point
