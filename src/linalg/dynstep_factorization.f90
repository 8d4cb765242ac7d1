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
!>   n <= 8                                    method_small
!>   symmetric, banded and dense               method_band_cholesky, method_dense_cholesky
!>   the others                                method_band_lu, method_dense_lu
!>
!> A symmetric matrix that is not positive definite is factorized again by LU with pivoting,
!> whose storage is allocated when that happens first; `method` is the one in force, and
!> `positive_definite` tells.  Nothing else is allocated after init.
!>
!> A matrix is refused as singular where a pivot vanishes, or where a suspicious pivot
!> (see dynstep_scaling) leads to an estimate |S^-1| > 1/(m eps) for the equilibrated matrix
!> S = R A C with largest entries near 1, m entries in a row: a change of S by its rounding
!> errors makes it singular.  LU works on S itself where rows or columns differ in size.
module dynstep_factorization
   use dynstep_kinds, only: wp
   use dynstep_lapack, only: dgbtrf, dgbtrs, dgetrf, dgetrs, dlacn2, dpbtrf, dpbtrs, dpotrf, dpotrs
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_identity, kind_zero, matrix_type
   use dynstep_narrow_band, only: pentadiagonal_factorize, pentadiagonal_solve, &
      & tridiagonal_factorize, tridiagonal_solve
   use dynstep_scaling, only: one_norm, reciprocal_power, row_column_scales, suspicious_pivot, &
      & vanished_pivot
   use dynstep_small_factor, only: small_factorize, small_factorize_symmetric, small_order, &
      & small_solve, small_solve_transposed
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
      integer, private :: kind = kind_zero                 !! structure chosen by init
      integer, private :: kl = 0, ku = 0                   !! bandwidths
      logical, private :: symmetric = .false.              !! declared symmetry
      logical, private :: equilibrated = .false.           !! the factors are those of R A C
      real(wp), allocatable, private :: factor(:, :)       !! small, LAPACK factors
      integer, allocatable, private :: pivot(:)            !! row order (small) or interchanges (LU) [n]
      real(wp), allocatable, private :: r(:), c(:)         !! row and column scales [n]
      real(wp), allocatable, private :: work(:, :)         !! for the estimate [n,2]
      integer, allocatable, private :: signs(:)            !! for the estimate [n]
   contains
      procedure :: init => factorization_init
      procedure :: factorize => factorization_factorize
      procedure :: solve => factorization_solve
      procedure :: solve_transposed => factorization_solve_transposed
      procedure :: reciprocal_condition => factorization_reciprocal_condition
   end type factorization_type

contains

   !> Choose the method for a structure and allocate what it needs
   pure subroutine factorization_init(self, kind, n, kl, ku, symmetric, status)
      class(factorization_type), intent(inout) :: self
      integer, intent(in) :: kind              !! kind_identity ... kind_dense of dynstep_matrix
      integer, intent(in) :: n                 !! order
      integer, intent(in) :: kl, ku            !! bandwidths, read for kind_banded
      logical, intent(in) :: symmetric         !! declared symmetry
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      if (kind < kind_identity .or. kind > kind_dense) then
         call status%set(dynstep_invalid_input, 'a matrix of kind '//text(kind)//' has no factorization')
      else if (n < 1) then
         call status%set(dynstep_invalid_input, 'a factorization needs an order n >= 1, not '//text(n))
      else if (kind == kind_banded .and. (min(kl, ku) < 0 .or. max(kl, ku) > max(n - 1, 0))) then
         call status%set(dynstep_invalid_input, 'bandwidths kl = '//text(kl)//', ku = '//text(ku) &
            & //' do not fit a matrix of order '//text(n))
      else if (kind == kind_banded .and. symmetric .and. kl /= ku) then
         call status%set(dynstep_invalid_input, 'a symmetric band has kl = ku, not kl = '//text(kl) &
            & //' and ku = '//text(ku))
      end if
      if (status%failed()) return

      self%method = method_none
      self%kind = kind
      self%n = n
      self%kl = n - 1
      self%ku = n - 1
      if (kind == kind_banded) then
         self%kl = kl
         self%ku = ku
      end if
      self%symmetric = symmetric
      self%positive_definite = .false.
      self%singular_equation = 0
      if (kind == kind_identity) then
         self%preferred = method_identity
      else if (kind == kind_diagonal .or. max(self%kl, self%ku) == 0) then
         self%preferred = method_diagonal
      else if (kind == kind_banded .and. symmetric .and. kl == 1) then
         self%preferred = method_tridiagonal
      else if (kind == kind_banded .and. symmetric .and. kl == 2) then
         self%preferred = method_pentadiagonal
      else if (n <= small_order) then
         self%preferred = method_small
      else if (kind == kind_banded) then
         self%preferred = merge(method_band_cholesky, method_band_lu, symmetric)
      else
         self%preferred = merge(method_dense_cholesky, method_dense_lu, symmetric)
      end if
      call allocate_for(self, self%preferred, status)
   end subroutine factorization_init

   !> Storage of a method, where it is not there yet
   pure subroutine allocate_for(self, method, status)
      class(factorization_type), intent(inout) :: self
      integer, intent(in) :: method
      type(status_type), intent(inout) :: status
      integer :: rows, stat, n
      logical :: general

      n = self%n
      rows = 0
      select case (method)
      case (method_small, method_dense_cholesky, method_dense_lu)
         rows = n
      case (method_band_cholesky)
         rows = self%kl + 1
      case (method_band_lu)
         rows = 2*self%kl + self%ku + 1
      end select
      stat = 0
      if (allocated(self%factor)) then
         if (any(shape(self%factor) /= [rows, n])) deallocate (self%factor)
      end if
      if (rows > 0 .and. .not. allocated(self%factor)) allocate (self%factor(rows, n), stat=stat)
      general = method == method_small .or. method >= method_band_cholesky
      if (stat == 0 .and. general) call reserve(self, stat)
      if (stat == 0 .and. .not. general .and. method /= method_identity) then
         call reserve_vector(self%dinv, n, stat)
         if (stat == 0 .and. method /= method_diagonal) call reserve_vector(self%l1, n, stat)
         if (stat == 0 .and. method == method_pentadiagonal) call reserve_vector(self%l2, n, stat)
      end if
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory to factorize a matrix of order '//text(n) &
            & //'; declare a band or a diagonal where the problem has one')
      end if
   end subroutine allocate_for

   !> Vectors for scales, pivots and the condition estimate
   pure subroutine reserve(self, stat)
      class(factorization_type), intent(inout) :: self
      integer, intent(out) :: stat
      stat = 0
      if (allocated(self%work)) then
         if (size(self%work, 1) /= self%n) deallocate (self%work, self%signs, self%pivot)
      end if
      call reserve_vector(self%r, self%n, stat)
      if (stat == 0) call reserve_vector(self%c, self%n, stat)
      if (stat == 0 .and. .not. allocated(self%work)) then
         allocate (self%work(self%n, 2), self%signs(self%n), self%pivot(self%n), stat=stat)
      end if
   end subroutine reserve

   pure subroutine reserve_vector(x, n, stat)
      real(wp), allocatable, intent(inout) :: x(:)
      integer, intent(in) :: n
      integer, intent(out) :: stat
      stat = 0
      if (allocated(x)) then
         if (size(x) == n) return
         deallocate (x)
      end if
      allocate (x(n), stat=stat)
   end subroutine reserve_vector

   !> Factorize a matrix of the structure given to init
   pure subroutine factorization_factorize(self, matrix, status, t, name)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t                !! time, for the sentence
      character(len=*), intent(in), optional :: name     !! such as 'mass matrix', default 'matrix'
      integer :: failed, weakest, row, column, info
      real(wp) :: ratio
      logical :: finite

      if (status%failed()) return
      self%method = method_none
      self%positive_definite = .false.
      self%singular_equation = 0
      if (self%preferred == method_none .or. matrix%kind /= self%kind .or. matrix%n /= self%n) then
         call complain(dynstep_invalid_input, '', ' has not the structure that its factorization was made for', &
            & status, t, name)
         return
      end if
      if (matrix%kind == kind_banded) then
         if (matrix%kl /= self%kl .or. matrix%ku /= self%ku) then
            call complain(dynstep_invalid_input, '', ' has not the bandwidths that its factorization was made for', &
               & status, t, name)
            return
         end if
      end if
      if (self%preferred == method_identity) then
         self%method = method_identity
         self%positive_definite = .true.
         self%norm = 1.0_wp
         return
      end if
      if (self%preferred == method_diagonal) then
         call factorize_diagonal(self, matrix, status, t, name)
         return
      end if

      call one_norm(matrix, self%norm, finite)
      if (.not. finite) then
         call matrix%first_not_finite(row, column)
         call complain(dynstep_not_finite, ' is not finite', ': row '//text(row)//', column '//text(column), &
            & status, t, name)
         return
      end if
      failed = 1
      if (self%symmetric) then
         weakest = 0
         select case (self%preferred)
         case (method_tridiagonal)
            call tridiagonal_factorize(self%n, matrix%a, self%dinv, self%l1, failed, weakest, ratio)
         case (method_pentadiagonal)
            call pentadiagonal_factorize(self%n, matrix%a, self%dinv, self%l1, self%l2, failed, weakest, ratio)
         case (method_small)
            call copy_small(matrix, self%n, self%factor)
            call small_factorize_symmetric(self%n, self%factor, self%pivot, failed, weakest, ratio)
         case default
            call cholesky(self, matrix, failed, weakest, ratio)
         end select
      end if
      if (failed == 0) then
         self%method = self%preferred
         self%positive_definite = .true.
         self%equilibrated = .false.
         if (weakest == 0) return
         call reserve(self, info)
         if (info /= 0) return
         call symmetric_scales(matrix, self%r, self%c)
      else
         call lu(self, matrix, failed, weakest, ratio, row, column, status)
         if (status%failed()) return
         if (failed == 0 .and. weakest == 0) return
      end if
      call judge(self, matrix, failed, weakest, ratio, row, column, status, t, name)
   end subroutine factorization_factorize

   !> Reciprocals of a diagonal
   pure subroutine factorize_diagonal(self, matrix, status, t, name)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t
      character(len=*), intent(in), optional :: name
      real(wp) :: d
      integer :: i, row, column

      call matrix%first_not_finite(row, column)
      if (row > 0) then
         call complain(dynstep_not_finite, ' is not finite', ': row '//text(row)//', column '//text(column), &
            & status, t, name)
         return
      end if
      self%norm = 0.0_wp
      self%positive_definite = .true.
      do i = 1, self%n
         if (matrix%kind == kind_diagonal) then
            d = matrix%a(i, 1)
         else if (matrix%kind == kind_banded) then
            d = matrix%a(1, i)
         else
            d = matrix%a(i, i)
         end if
         if (abs(d) < tiny(d)) then
            self%positive_definite = .false.
            call refuse(self, i, 'its diagonal entry is zero', status, t, name)
            return
         end if
         self%positive_definite = self%positive_definite .and. d > 0.0_wp
         self%norm = max(self%norm, abs(d))
         self%dinv(i) = 1.0_wp/d
      end do
      self%method = method_diagonal
   end subroutine factorize_diagonal

   !> LAPACK's Cholesky factorization of the lower triangle
   pure subroutine cholesky(self, matrix, failed, weakest, ratio)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      integer, intent(out) :: failed           !! first pivot that is not positive, or 0
      integer, intent(out) :: weakest          !! row of the smallest suspicious pivot, or 0
      real(wp), intent(out) :: ratio           !! that pivot / A(k,k)
      real(wp) :: l, d
      integer :: j, k, kd

      kd = self%kl
      if (self%preferred == method_band_cholesky) then
         do j = 1, self%n
            self%factor(1:kd + 1, j) = matrix%a(kd + 1:2*kd + 1, j)
         end do
         call dpbtrf('L', self%n, kd, self%factor, size(self%factor, 1), failed)
      else
         self%factor = matrix%a
         call dpotrf('L', self%n, self%factor, self%n, failed)
      end if
      weakest = 0
      ratio = suspicious_pivot
      if (failed > 0) return
      do k = 1, self%n
         if (self%preferred == method_band_cholesky) then
            l = self%factor(1, k)
            d = matrix%a(kd + 1, k)
         else
            l = self%factor(k, k)
            d = matrix%a(k, k)
         end if
         if (l < sqrt(ratio)*sqrt(d)) then
            weakest = k
            ratio = (l/sqrt(d))**2
         end if
      end do
   end subroutine cholesky

   !> LU with pivoting, of R A C where rows or columns differ in size
   pure subroutine lu(self, matrix, failed, weakest, ratio, zero_row, zero_column, status)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      integer, intent(out) :: failed           !! first pivot that is zero, or 0
      integer, intent(out) :: weakest          !! column of the smallest suspicious pivot, or 0
      real(wp), intent(out) :: ratio           !! that pivot, scaled
      integer, intent(out) :: zero_row, zero_column   !! first row and column of zeros, or 0
      type(status_type), intent(inout) :: status
      integer :: j, k, d, first, last
      real(wp) :: unit

      failed = 0
      weakest = 0
      ratio = suspicious_pivot
      if (self%preferred == method_small) then
         self%method = method_small
      else
         self%method = merge(method_band_lu, method_dense_lu, self%kind == kind_banded)
      end if
      call allocate_for(self, self%method, status)
      if (status%failed()) return
      call row_column_scales(matrix, self%r, self%c, zero_row, zero_column)
      if (max(zero_row, zero_column) > 0) then
         failed = max(zero_row, zero_column)
         return
      end if
      self%equilibrated = self%method /= method_small .and. &
         & (minval(self%r) < maxval(self%r)/16 .or. minval(self%c) < maxval(self%c)/16)
      select case (self%method)
      case (method_small)
         call copy_small(matrix, self%n, self%factor)
         call small_factorize(self%n, self%factor, self%pivot, self%r, self%c, failed, weakest, ratio)
         return
      case (method_dense_lu)
         d = 0
         do j = 1, self%n
            if (self%equilibrated) then
               self%factor(:, j) = self%r*matrix%a(:, j)*self%c(j)
            else
               self%factor(:, j) = matrix%a(:, j)
            end if
         end do
         call dgetrf(self%n, self%n, self%factor, self%n, self%pivot, failed)
      case default
         d = self%kl + self%ku + 1
         do j = 1, self%n
            first = max(1, j - self%ku)
            last = min(self%n, j + self%kl)
            self%factor(:, j) = 0.0_wp
            if (self%equilibrated) then
               self%factor(d + first - j:d + last - j, j) = self%r(first:last)*self%c(j) &
                  & *matrix%a(self%ku + 1 + first - j:self%ku + 1 + last - j, j)
            else
               self%factor(d + first - j:d + last - j, j) = &
                  & matrix%a(self%ku + 1 + first - j:self%ku + 1 + last - j, j)
            end if
         end do
         call dgbtrf(self%n, self%n, self%kl, self%ku, self%factor, size(self%factor, 1), self%pivot, failed)
      end select
      unit = 1.0_wp
      if (.not. self%equilibrated) unit = minval(self%r)*minval(self%c)
      do k = 1, self%n
         if (abs(self%factor(merge(d, k, d > 0), k))*unit < ratio) then
            weakest = k
            ratio = abs(self%factor(merge(d, k, d > 0), k))*unit
         end if
      end do
   end subroutine lu

   !> A pivot is zero or suspicious: singular or not, and which equation is it
   pure subroutine judge(self, matrix, failed, weakest, ratio, zero_row, zero_column, status, t, name)
      class(factorization_type), intent(inout) :: self
      type(matrix_type), intent(in) :: matrix
      integer, intent(in) :: failed, weakest          !! zero pivot, smallest pivot
      real(wp), intent(in) :: ratio                   !! smallest pivot, scaled
      integer, intent(in) :: zero_row, zero_column    !! of the matrix, read where failed > 0
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t
      character(len=*), intent(in), optional :: name
      real(wp) :: inverse_norm
      integer :: entries

      if (failed > 0) then
         if (zero_row > 0) then
            call refuse(self, zero_row, 'its row is zero', status, t, name)
            return
         else if (zero_column > 0) then
            call refuse(self, zero_column, 'its column is zero', status, t, name)
            return
         end if
      else if (ratio > vanished_pivot) then
         call estimate(self, .true., inverse_norm)
         entries = min(matrix%n, self%kl + self%ku + 1)
         if (inverse_norm*entries*epsilon(1.0_wp) < 1.0_wp) return
      end if
      call refuse(self, equation_of(self, merge(failed, weakest, failed > 0)), &
         & 'its row depends on those of the others', status, t, name)
   end subroutine judge

   !> Equation that pivot k eliminated.  With row interchanges this is the row of the matrix
   !> where it vanished altogether, and k itself where only its column did.
   pure integer function equation_of(self, k)
      class(factorization_type), intent(in) :: self
      integer, intent(in) :: k
      real(wp), parameter :: noise = 1.0e-10_wp
      real(wp) :: largest
      integer :: j, row, d

      equation_of = k
      if (self%positive_definite) return
      row = k
      if (self%method == method_small) then
         row = self%pivot(k)
         largest = 0.0_wp
         do j = k + 1, self%n
            largest = max(largest, abs(self%factor(k, j))*self%r(row)*self%c(j))
         end do
      else
         row = self%pivot(k)
         do j = k - 1, 1, -1
            if (row == j) then
               row = self%pivot(j)
            else if (row == self%pivot(j)) then
               row = j
            end if
         end do
         largest = 0.0_wp
         d = self%kl + self%ku + 1
         do j = k + 1, self%n
            if (self%method == method_dense_lu) then
               largest = max(largest, abs(self%factor(k, j)))
            else if (j - k <= self%kl + self%ku) then
               largest = max(largest, abs(self%factor(d + k - j, j)))
            end if
         end do
         if (.not. self%equilibrated) largest = largest*maxval(self%r)*maxval(self%c)
      end if
      if (largest < noise) equation_of = row
   end function equation_of

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

   !> r(i) = c(i) = power of two near A(i,i)**(-1/2)
   pure subroutine symmetric_scales(matrix, r, c)
      type(matrix_type), intent(in) :: matrix
      real(wp), intent(out) :: r(matrix%n), c(matrix%n)
      integer :: i
      do i = 1, matrix%n
         r(i) = reciprocal_power(sqrt(matrix%entry(i, i)))
      end do
      c = r
   end subroutine symmetric_scales

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
      integer :: info

      select case (self%method)
      case (method_diagonal)
         x = x*self%dinv
      case (method_small)
         if (trans == 'N') then
            call small_solve(self%n, self%factor, self%pivot, x)
         else
            call small_solve_transposed(self%n, self%factor, self%pivot, x)
         end if
      case (method_tridiagonal)
         call tridiagonal_solve(self%n, self%dinv, self%l1, x)
      case (method_pentadiagonal)
         call pentadiagonal_solve(self%n, self%dinv, self%l1, self%l2, x)
      case (method_band_cholesky)
         call dpbtrs('L', self%n, self%kl, 1, self%factor, size(self%factor, 1), x, self%n, info)
      case (method_dense_cholesky)
         call dpotrs('L', self%n, 1, self%factor, self%n, x, self%n, info)
      case (method_band_lu, method_dense_lu)
         if (self%equilibrated) then
            if (trans == 'N') then
               x = self%r*x
            else
               x = self%c*x
            end if
         end if
         if (self%method == method_band_lu) then
            call dgbtrs(trans, self%n, self%kl, self%ku, 1, self%factor, size(self%factor, 1), self%pivot, x, self%n, info)
         else
            call dgetrs(trans, self%n, 1, self%factor, self%n, self%pivot, x, self%n, info)
         end if
         if (self%equilibrated) then
            if (trans == 'N') then
               x = self%c*x
            else
               x = self%r*x
            end if
         end if
      end select
   end subroutine apply

   !> Estimate of |A^-1| or, scaled, of |(R A C)^-1| in the 1-norm
   pure subroutine estimate(self, scaled, inverse_norm)
      class(factorization_type), intent(inout) :: self
      logical, intent(in) :: scaled
      real(wp), intent(out) :: inverse_norm
      real(wp), allocatable :: work(:, :)
      integer, allocatable :: signs(:)
      integer :: kase, isave(3)

      call move_alloc(self%work, work)
      call move_alloc(self%signs, signs)
      kase = 0
      work = 0.0_wp
      signs = 0
      isave = 0
      inverse_norm = 0.0_wp
      do
         call dlacn2(self%n, work(:, 1), work(:, 2), signs, inverse_norm, kase, isave)
         if (kase == 0) exit
         if (kase == 1) then
            if (scaled) work(:, 2) = work(:, 2)/self%r
            call apply(self, 'N', work(:, 2))
            if (scaled) work(:, 2) = work(:, 2)/self%c
         else
            if (scaled) work(:, 2) = work(:, 2)/self%c
            call apply(self, 'T', work(:, 2))
            if (scaled) work(:, 2) = work(:, 2)/self%r
         end if
      end do
      call move_alloc(work, self%work)
      call move_alloc(signs, self%signs)
   end subroutine estimate

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
      call reserve(self, stat)
      if (stat /= 0) then
         call status%set(dynstep_no_memory, 'no memory for a condition estimate of order '//text(self%n))
         return
      end if
      call estimate(self, .false., inverse_norm)
      rcond = (1.0_wp/self%norm)/inverse_norm
   end subroutine factorization_reciprocal_condition
end module dynstep_factorization
