! SPDX-License-Identifier: BSD-3-Clause
!> Factorization of a matrix_type, by the method that its structure deserves.
!>
!> PROGRAMMING INTERFACE
!>
!>   call f%init(kind, n, kl, ku, symmetric, status)     once: chooses the method, allocates
!>   call f%factorize(matrix, status, [t], [name])       as often as the entries change
!>   call f%solve(x)                                     x = A^-1 x
!>   call f%solve_transposed(x)                          x = A^-T x
!>   call f%reciprocal_condition(rcond, status)          1 / (|A| |A^-1|) in the 1-norm
!>
!>   structure                                 method
!>   identity, diagonal, banded kl = ku = 0    method_identity, method_diagonal
!>   symmetric banded kl = ku = 1 and 2        method_tridiagonal, method_pentadiagonal
!>   others with n <= 16                       method_small
!>   symmetric, banded and dense               method_band_cholesky, method_dense_cholesky
!>   the others                                method_band_lu, method_dense_lu
!>
!> A symmetric matrix that is not positive definite is factorized again by LU with pivoting,
!> whose storage is allocated when that happens first; `method` is the one in force, and
!> `positive_definite` tells.  Nothing else is allocated after init, except the workspace of
!> the condition estimate of the three narrow methods.
!>
!> A matrix is refused as singular where a pivot vanishes, or where a suspicious pivot
!> (see dynstep_scaling) leads to an estimate 1/|S^-1| < 2 eps for the scaled matrix
!> S = R A C: a change of S by less than its rounding errors makes it singular.  The sentence and
!> `singular_equation` then name an equation that depends on the others.
!>
!> An object may be copied by assignment.
module dynstep_factorization
   use dynstep_archive, only: archive_type
   use dynstep_cholesky, only: cholesky_type
   use dynstep_kinds, only: wp
   use dynstep_lapack, only: dlacn2
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_identity, kind_zero, matrix_type
   use dynstep_narrow_band, only: pentadiagonal_factorize, pentadiagonal_solve, &
      & tridiagonal_factorize, tridiagonal_solve
   use dynstep_pivoted_lu, only: pivoted_lu_type
   use dynstep_scaling, only: one_norm, reciprocal_power, suspicious_pivot, vanished_pivot
   use dynstep_small_factor, only: small_equation_of, small_factorize, small_factorize_symmetric, &
      & small_order, small_solve, small_solve_transposed
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, dynstep_not_finite, &
      & dynstep_singular_matrix, message_length, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: factorization_type

   integer, parameter, public :: method_none = 0
   integer, parameter, public :: method_identity = 1
   integer, parameter, public :: method_diagonal = 2
   integer, parameter, public :: method_small = 3
   integer, parameter, public :: method_tridiagonal = 4
   integer, parameter, public :: method_pentadiagonal = 5
   integer, parameter, public :: method_band_cholesky = 6
   integer, parameter, public :: method_band_lu = 7
   integer, parameter, public :: method_dense_cholesky = 8
   integer, parameter, public :: method_dense_lu = 9

   type :: factorization_type
      integer :: method = method_none            !! method in force, method_none before factorize
      integer :: n = 0                           !! order
      logical :: positive_definite = .false.     !! symmetric positive definite (after factorize)
      integer :: singular_equation = 0           !! equation that a singular matrix was refused for
      real(wp) :: norm = 0.0_wp                  !! 1-norm of the matrix
      real(wp), allocatable :: dinv(:)           !! reciprocal pivots [n]: diagonal, tri-, pentadiagonal
      real(wp), allocatable :: l1(:), l2(:)      !! first and second subdiagonal of L [n], see dynstep_narrow_band
      integer, private :: preferred = method_none          !! method chosen by init
      integer, private :: kind = kind_zero                 !! structure given to init
      integer, private :: kl = 0, ku = 0                   !! bandwidths
      logical, private :: symmetric = .false.              !! declared symmetry
      real(wp), allocatable, private :: factor(:, :)       !! factors (small) [n,n]
      integer, allocatable, private :: order(:)            !! row order (small) [n]
      type(cholesky_type), private :: cholesky             !! LAPACK's Cholesky factors
      type(pivoted_lu_type), private :: lu                 !! LAPACK's LU factors
      real(wp), allocatable, private :: work(:, :)         !! two vectors for the estimate, row and column scales [n,4]
      integer, allocatable, private :: signs(:)            !! for the estimate [n]
   contains
      procedure :: init => factorization_init
      procedure :: factorize => factorization_factorize
      procedure :: solve => factorization_solve
      procedure :: solve_transposed => factorization_solve_transposed
      procedure :: reciprocal_condition => factorization_reciprocal_condition
      procedure :: archive => factorization_archive
   end type factorization_type

   !> A matrix S with entries near 1 is singular where 1/|S^-1| is less than this.  Measured on 7600
   !> singular matrices of order 3 to 300 (products, Laplacians, free chains and beams, equal rows):
   !> at most 0.7 eps, median 0.01 eps.  A clamped beam of 5000 nodes, with a condition of 1e15,
   !> passes; one of 10 000 is singular to working precision and is refused.
   real(wp), parameter :: singular_distance = 2.0_wp*epsilon(1.0_wp)

contains

   !> Choose the method for a structure and allocate what it needs
   pure subroutine factorization_init(self, kind, n, kl, ku, symmetric, status)
      class(factorization_type), intent(inout) :: self
      integer, intent(in) :: kind              !! kind_identity ... kind_dense of dynstep_matrix
      integer, intent(in) :: n                 !! order
      integer, intent(in) :: kl, ku            !! bandwidths, read for kind_banded
      logical, intent(in) :: symmetric         !! declared symmetry
      type(status_type), intent(inout) :: status
      integer :: stat

      if (status%failed()) return
      self%method = method_none
      self%preferred = method_none
      if (kind < kind_identity .or. kind > kind_dense) then
         call status%set(dynstep_invalid_input, 'a matrix of kind '//text(kind)//' has no factorization')
      else if (n < 1) then
         call status%set(dynstep_invalid_input, 'a factorization needs an order n >= 1, not '//text(n))
      else if (kind == kind_banded .and. (min(kl, ku) < 0 .or. max(kl, ku) >= n)) then
         call status%set(dynstep_invalid_input, 'bandwidths kl = '//text(kl)//', ku = '//text(ku) &
            & //' do not fit a matrix of order '//text(n))
      else if (kind == kind_banded .and. symmetric .and. kl /= ku) then
         call status%set(dynstep_invalid_input, 'a symmetric band has kl = ku, not kl = '//text(kl) &
            & //' and ku = '//text(ku))
      end if
      if (status%failed()) return

      self%kind = kind
      self%n = n
      self%kl = merge(kl, n - 1, kind == kind_banded)
      self%ku = merge(ku, n - 1, kind == kind_banded)
      self%symmetric = symmetric
      self%positive_definite = .false.
      self%singular_equation = 0
      self%preferred = method_for(self)
      call allocate_for(self, stat)
      if (stat /= 0) call no_memory(self, status)
   end subroutine factorization_init

   pure integer function method_for(self)
      class(factorization_type), intent(in) :: self
      if (self%kind == kind_identity) then
         method_for = method_identity
      else if (self%kind == kind_diagonal .or. max(self%kl, self%ku) == 0) then
         method_for = method_diagonal
      else if (self%kind == kind_banded .and. self%symmetric .and. self%kl == 1) then
         method_for = method_tridiagonal
      else if (self%kind == kind_banded .and. self%symmetric .and. self%kl == 2) then
         method_for = method_pentadiagonal
      else if (self%n <= small_order) then
         method_for = method_small
      else if (self%kind == kind_banded) then
         method_for = merge(method_band_cholesky, method_band_lu, self%symmetric)
      else
         method_for = merge(method_dense_cholesky, method_dense_lu, self%symmetric)
      end if
   end function method_for

   !> Storage of the preferred method
   pure subroutine allocate_for(self, stat)
      class(factorization_type), intent(inout) :: self
      integer, intent(out) :: stat             !! not 0: no memory
      integer :: n

      n = self%n
      if (allocated(self%dinv)) deallocate (self%dinv)
      if (allocated(self%l1)) deallocate (self%l1)
      if (allocated(self%l2)) deallocate (self%l2)
      if (allocated(self%factor)) deallocate (self%factor)
      if (allocated(self%order)) deallocate (self%order)
      if (allocated(self%work)) deallocate (self%work, self%signs)
      if (allocated(self%cholesky%factor)) deallocate (self%cholesky%factor)
      if (allocated(self%lu%factor)) deallocate (self%lu%factor, self%lu%interchange, self%lu%r, self%lu%c)
      stat = 0
      select case (self%preferred)
      case (method_diagonal)
         allocate (self%dinv(n), stat=stat)
      case (method_tridiagonal)
         allocate (self%dinv(n), self%l1(n), stat=stat)
      case (method_pentadiagonal)
         allocate (self%dinv(n), self%l1(n), self%l2(n), stat=stat)
      case (method_small)
         allocate (self%factor(n, n), self%order(n), stat=stat)
      case (method_band_cholesky, method_dense_cholesky)
         call self%cholesky%init(self%kind == kind_banded, n, self%kl, stat)
      case (method_band_lu, method_dense_lu)
         call self%lu%init(self%kind == kind_banded, n, self%kl, self%ku, stat)
      end select
      if (stat == 0 .and. (self%preferred == method_small .or. self%preferred >= method_band_cholesky)) then
         call reserve_workspace(self, stat)
      end if
   end subroutine allocate_for

   !> Workspace of the condition estimate, where it is not there yet
   pure subroutine reserve_workspace(self, stat)
      class(factorization_type), intent(inout) :: self
      integer, intent(out) :: stat
      stat = 0
      if (.not. allocated(self%work)) allocate (self%work(self%n, 4), self%signs(self%n), stat=stat)
   end subroutine reserve_workspace

   pure subroutine no_memory(self, status)
      class(factorization_type), intent(inout) :: self
      type(status_type), intent(inout) :: status
      self%method = method_none
      call status%set(dynstep_no_memory, 'no memory to factorize a matrix of order '//text(self%n) &
         & //'; declare a band or a diagonal where the problem has one')
   end subroutine no_memory

   !> Factorize a matrix of the structure given to init
   pure subroutine factorization_factorize(self, matrix, status, t, name)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t                !! time, for the sentence
      character(len=*), intent(in), optional :: name     !! such as 'mass matrix', default 'matrix'
      integer :: failed, weakest, row, column
      real(wp) :: ratio
      logical :: fits, finite

      if (status%failed()) return
      self%method = method_none
      self%positive_definite = .false.
      self%singular_equation = 0
      fits = self%preferred /= method_none .and. matrix%kind == self%kind .and. matrix%n == self%n
      if (fits .and. self%kind == kind_banded) fits = matrix%kl == self%kl .and. matrix%ku == self%ku
      if (.not. fits) then
         call complain(dynstep_invalid_input, '', ' has not the structure that its factorization was made for', &
            & status, t, name)
         return
      end if

      finite = .true.
      select case (self%preferred)
      case (method_identity)
         self%norm = 1.0_wp
      case (method_tridiagonal, method_pentadiagonal)
         call factorize_definite(self, matrix, failed, weakest, ratio)
         if (failed > 0) call one_norm(matrix, self%norm, finite)
      case (method_diagonal)
         call matrix%first_not_finite(row, column)
         finite = row == 0
      case default
         call one_norm(matrix, self%norm, finite)
      end select
      if (.not. finite) then
         call matrix%first_not_finite(row, column)
         if (row > 0) then
            call complain(dynstep_not_finite, ' is not finite', ': row '//text(row)//', column '//text(column), &
               & status, t, name)
         else
            call complain(dynstep_not_finite, ' is not finite', ': its norm overflows', status, t, name)
         end if
         return
      end if

      if (self%preferred == method_diagonal) then
         call factorize_diagonal(self, matrix, failed)
         if (failed > 0) call refuse(self, failed, 'its diagonal entry is zero', status, t, name)
         return
      end if
      if (self%symmetric .or. self%preferred == method_identity) then
         if (self%preferred /= method_tridiagonal .and. self%preferred /= method_pentadiagonal) then
            call factorize_definite(self, matrix, failed, weakest, ratio)
         end if
         if (failed == 0) then
            self%method = self%preferred
            self%positive_definite = .true.
            if (weakest > 0) call judge_definite(self, matrix, weakest, ratio, status, t, name)
            return
         end if
      end if
      call factorize_general(self, matrix, status, t, name)
   end subroutine factorization_factorize

   !> Reciprocals of a diagonal
   pure subroutine factorize_diagonal(self, matrix, failed)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      integer, intent(out) :: failed       !! first entry that is zero, or 0
      real(wp) :: d
      integer :: i

      failed = 0
      self%norm = 0.0_wp
      self%positive_definite = .true.
      do i = 1, self%n
         d = matrix%a(merge(1, i, self%kind == kind_banded), merge(1, i, self%kind == kind_diagonal))
         if (abs(d) < tiny(d)) then
            failed = i
            return
         end if
         self%positive_definite = self%positive_definite .and. d > 0.0_wp
         self%norm = max(self%norm, abs(d))
         self%dinv(i) = 1.0_wp/d
      end do
      self%method = method_diagonal
   end subroutine factorize_diagonal

   !> A symmetric matrix without pivoting; narrow ones look for NaN and find the norm by the way
   pure subroutine factorize_definite(self, matrix, failed, weakest, ratio)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      integer, intent(out) :: failed           !! first pivot that is not positive, or 0
      integer, intent(out) :: weakest          !! row of the smallest suspicious pivot, or 0
      real(wp), intent(out) :: ratio           !! that pivot / A(k,k)

      failed = 0
      weakest = 0
      ratio = suspicious_pivot
      select case (self%preferred)
      case (method_tridiagonal)
         call tridiagonal_factorize(self%n, matrix%a, self%dinv, self%l1, self%norm, failed, weakest, ratio)
      case (method_pentadiagonal)
         call pentadiagonal_factorize(self%n, matrix%a, self%dinv, self%l1, self%l2, self%norm, failed, weakest, ratio)
      case (method_small)
         call copy_small(matrix, self%n, self%factor)
         call small_factorize_symmetric(self%n, self%factor, self%order, failed, weakest, ratio)
      case (method_band_cholesky, method_dense_cholesky)
         call self%cholesky%factorize(matrix, failed, weakest, ratio)
      end select
   end subroutine factorize_definite

   !> Suspicious pivots of a positive definite factorization
   pure subroutine judge_definite(self, matrix, weakest, ratio, status, t, name)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      integer, intent(in) :: weakest           !! smallest pivot
      real(wp), intent(in) :: ratio            !! its part of A(k,k)
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t
      character(len=*), intent(in), optional :: name
      integer :: i, stat

      call reserve_workspace(self, stat)
      if (stat /= 0) then
         call no_memory(self, status)
         return
      end if
      do i = 1, self%n
         self%work(i, 3) = reciprocal_power(sqrt(matrix%entry(i, i)))
         self%work(i, 4) = self%work(i, 3)
      end do
      call judge(self, weakest, ratio, status, t, name)
   end subroutine judge_definite

   !> LU with pivoting; the storage for a symmetric matrix comes when it is needed first
   pure subroutine factorize_general(self, matrix, status, t, name)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t
      character(len=*), intent(in), optional :: name
      integer :: failed, weakest, empty, stat
      real(wp) :: ratio

      if (self%preferred == method_small) then
         self%method = method_small
         call copy_small(matrix, self%n, self%factor)
         call small_factorize(self%n, self%factor, self%order, self%work(:, 3), self%work(:, 4), &
            & failed, weakest, ratio, empty)
      else
         self%method = merge(method_band_lu, method_dense_lu, self%kind == kind_banded)
         stat = 0
         if (.not. allocated(self%lu%factor)) then
            call self%lu%init(self%kind == kind_banded, self%n, self%kl, self%ku, stat)
         end if
         if (stat == 0) call reserve_workspace(self, stat)
         if (stat /= 0) then
            call no_memory(self, status)
            return
         end if
         call self%lu%factorize(matrix, failed, weakest, ratio, empty)
      end if
      if (empty > 0) then
         call refuse(self, empty, 'its row is zero', status, t, name)
      else if (empty < 0) then
         call refuse(self, -empty, 'its column is zero', status, t, name)
      else if (failed > 0) then
         call judge(self, failed, 0.0_wp, status, t, name)
      else if (weakest > 0) then
         if (self%method /= method_small) then
            self%work(:, 3) = self%lu%r
            self%work(:, 4) = self%lu%c
         end if
         call judge(self, weakest, ratio, status, t, name)
      end if
   end subroutine factorize_general

   !> A suspicious pivot: singular or not, and which equation is it.  Higham's estimate alone may miss
   !> a null vector that is orthogonal to its first guess (two equal rows); the pivot's own
   !> coordinate takes part in the null vector, so that S^-T e(k) is large as well.
   pure subroutine judge(self, k, ratio, status, t, name)
      class(factorization_type), intent(inout) :: self   !! with scales in work(:,3:4)
      integer, intent(in) :: k                 !! smallest pivot
      real(wp), intent(in) :: ratio            !! its size in R A C
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t
      character(len=*), intent(in), optional :: name
      real(wp), allocatable :: work(:, :)
      real(wp) :: inverse_norm
      integer :: equation

      if (ratio > vanished_pivot) then
         call estimate_inverse(self, .true., inverse_norm)
         call move_alloc(self%work, work)
         work(:, 2) = 0.0_wp
         work(k, 2) = 1.0_wp/work(k, 4)
         call apply(self, 'T', work(:, 2))
         inverse_norm = max(inverse_norm, sum(abs(work(:, 2)/work(:, 3))))
         call move_alloc(work, self%work)
         if (inverse_norm*singular_distance < 1.0_wp) return
      end if
      equation = k
      if (.not. self%positive_definite) then
         if (self%method == method_small) then
            equation = small_equation_of(self%n, self%factor, self%order, self%work(:, 3), self%work(:, 4), k)
         else
            equation = self%lu%equation_of(k)
         end if
      end if
      call refuse(self, equation, 'its row depends on those of the others', status, t, name)
   end subroutine judge

   !> The sentence for a singular matrix
   pure subroutine refuse(self, k, reason, status, t, name)
      class(factorization_type), intent(inout) :: self
      integer, intent(in) :: k
      character(len=*), intent(in) :: reason
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t
      character(len=*), intent(in), optional :: name
      self%method = method_none
      self%positive_definite = .false.
      self%singular_equation = k
      call complain(dynstep_singular_matrix, ' is singular', ', equation '//text(k)//': '//reason, status, t, name)
   end subroutine refuse

   !> Refuse a matrix: 'the mass matrix', words before the time, ' at t = 2.5', words after it
   pure subroutine complain(code, before, after, status, t, name)
      integer, intent(in) :: code
      character(len=*), intent(in) :: before, after
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t
      character(len=*), intent(in), optional :: name
      character(len=message_length) :: words
      words = 'the matrix'
      if (present(name)) words = 'the '//name
      words = trim(words)//before
      if (present(t)) words = trim(words)//' at t = '//text(t)
      call status%set(code, trim(words)//after)
   end subroutine complain

   !> Entries of a matrix as an n by n array
   pure subroutine copy_small(matrix, n, f)
      type(matrix_type), intent(in) :: matrix
      integer, intent(in) :: n
      real(wp), intent(out) :: f(n, n)
      integer :: i, j
      if (matrix%kind == kind_dense) then
         f = matrix%a
      else
         f = 0.0_wp
         do j = 1, n
            do i = max(1, j - matrix%ku), min(n, j + matrix%kl)
               f(i, j) = matrix%a(matrix%ku + 1 + i - j, j)
            end do
         end do
      end if
   end subroutine copy_small

   !> x = A^-1 x; x is left alone where factorize did not succeed
   pure subroutine factorization_solve(self, x)
      class(factorization_type), intent(in) :: self
      real(wp), intent(inout) :: x(self%n)       !! right side in, solution out
      call apply(self, 'N', x)
   end subroutine factorization_solve

   !> x = A^-T x; x is left alone where factorize did not succeed
   pure subroutine factorization_solve_transposed(self, x)
      class(factorization_type), intent(in) :: self
      real(wp), intent(inout) :: x(self%n)       !! right side in, solution out
      call apply(self, 'T', x)
   end subroutine factorization_solve_transposed

   pure subroutine apply(self, trans, x)
      class(factorization_type), intent(in) :: self
      character(len=1), intent(in) :: trans
      real(wp), intent(inout) :: x(self%n)

      select case (self%method)
      case (method_diagonal)
         x = x*self%dinv
      case (method_small)
         if (trans == 'N') then
            call small_solve(self%n, self%factor, self%order, x)
         else
            call small_solve_transposed(self%n, self%factor, self%order, x)
         end if
      case (method_tridiagonal)
         call tridiagonal_solve(self%n, self%dinv, self%l1, x)
      case (method_pentadiagonal)
         call pentadiagonal_solve(self%n, self%dinv, self%l1, self%l2, x)
      case (method_band_cholesky, method_dense_cholesky)
         call self%cholesky%solve(x)
      case (method_band_lu, method_dense_lu)
         call self%lu%solve(trans, x)
      end select
   end subroutine apply

   !> Estimate of |A^-1| or, scaled, of |(R A C)^-1| in the 1-norm
   pure subroutine estimate_inverse(self, scaled, inverse_norm)
      class(factorization_type), intent(inout) :: self   !! with scales in work(:,3:4)
      logical, intent(in) :: scaled
      real(wp), intent(out) :: inverse_norm
      real(wp), allocatable :: work(:, :)
      integer, allocatable :: signs(:)
      integer :: kase, isave(3)

      call move_alloc(self%work, work)
      call move_alloc(self%signs, signs)
      work(:, :2) = 0.0_wp
      signs = 0
      isave = 0
      kase = 0
      inverse_norm = 0.0_wp
      do
         call dlacn2(self%n, work(:, 1), work(:, 2), signs, inverse_norm, kase, isave)
         if (kase == 0) exit
         if (scaled) work(:, 2) = work(:, 2)/work(:, merge(3, 4, kase == 1))
         call apply(self, merge('N', 'T', kase == 1), work(:, 2))
         if (scaled) work(:, 2) = work(:, 2)/work(:, merge(4, 3, kase == 1))
      end do
      call move_alloc(work, self%work)
      call move_alloc(signs, self%signs)
   end subroutine estimate_inverse

   !> Estimate of 1 / (|A| |A^-1|) in the 1-norm; 0 before factorize
   pure subroutine factorization_reciprocal_condition(self, rcond, status)
      class(factorization_type), intent(inout) :: self
      real(wp), intent(out) :: rcond
      type(status_type), intent(inout) :: status
      real(wp) :: inverse_norm
      integer :: stat

      rcond = 0.0_wp
      if (status%failed() .or. self%method == method_none) return
      if (self%method == method_identity) then
         rcond = 1.0_wp
         return
      end if
      if (self%method == method_diagonal) then
         rcond = (1.0_wp/self%norm)/maxval(abs(self%dinv))
         return
      end if
      call reserve_workspace(self, stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for a condition estimate of order '//text(self%n))
         return
      end if
      call estimate_inverse(self, .false., inverse_norm)
      rcond = (1.0_wp/self%norm)/inverse_norm
   end subroutine factorization_reciprocal_condition

   !> Factors in force.  They are kept rather than made again, since the matrix that they are of may be gone.
   recursive subroutine factorization_archive(self, name, file)
      class(factorization_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      integer :: method
      call file%section(name)
      call file%expect('n', self%n)
      call file%expect('kind', self%kind)
      call file%expect('preferred', self%preferred)
      method = self%method
      if (file%is_reading) self%method = method_none
      call file%item('method', method)
      call file%item('positive_definite', self%positive_definite)
      call file%item('singular_equation', self%singular_equation)
      call file%item('norm', self%norm)
      call file%item('dinv', self%dinv)
      call file%item('l1', self%l1)
      call file%item('l2', self%l2)
      call file%item('factor', self%factor)
      call file%item('order', self%order)
      if (method == method_band_cholesky .or. method == method_dense_cholesky) call self%cholesky%archive('cholesky', file)
      if (method == method_band_lu .or. method == method_dense_lu) call self%lu%archive('lu', file)
      call file%end_section()
      if (.not. file%failed()) self%method = method
   end subroutine factorization_archive
end module dynstep_factorization
