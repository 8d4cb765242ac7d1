! SPDX-License-Identifier: BSD-3-Clause
!> Systems of constrained motion by the complement of a diagonal block A whose entries are all > 0 or all < 0.
!> With sigma that sign, D = |A|^-1 and B = [G; K],
!>
!>   S = B D B^T + sigma eps diag(B D B^T),   S l = B D b - sigma c,   x = sigma D b - sigma D B^T l
!>
!>   solve [A B^T; B -eps diag(B D B^T)] (x, l) = (b, c).
!>
!> PROGRAMMING INTERFACE
!>
!>   call schur%init(n, m, p, is_identity, g_pattern, k_pattern, order, stat)
!>   call schur%factorize(a, g, k, without_psi, eps, done)
!>   call schur%solve(x, lambda, psi)
!>   call schur%reciprocal_condition(rcond, stat)
!>
!>   done = .false.: this is a matrix for LU with pivoting, since an entry of A is zero or of another sign, something is
!>   not finite, or S has a pivot that is too small a part of its diagonal entry: digits are lost there, and whether
!>   the matrix is singular is LU's to judge.
module dynstep_saddle_schur
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_band_ldl, only: band_ldl_factorize, band_ldl_solve, widest_band
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: wp
   use dynstep_lapack, only: dlacn2, dpbtrf, dpbtrs, dpotrf, dpotrs, dsyrk
   use dynstep_matrix, only: matrix_type
   use dynstep_scaling, only: absolute_sum
   use dynstep_schur_pattern, only: schur_pattern_type
   implicit none
   private

   !> Smallest part of S(k,k) that a pivot may be.  A body that is lighter by r than the two it connects makes a pivot of
   !> about r S(k,k), and the heavy masses lose as many digits in S.  Errors of x, of l, and |B x - c| as a part of |B| |x|,
   !> largest of 400 systems each against 33 digits, with 0.1: dense and random 7e-15, 8e-15, 2e-15; masses
   !> 10**(-3 ... 3) at random 3e-13, 2e-14, 2e-13; chains of rods 4e-15, 5e-15, 2e-14, with such masses 9e-14, 1e-14, 7e-14, with
   !> one rod 10**(-6 ... 6) times the others 7e-15, 8e-15, 2e-13.  With 1e-3 these reach 4e-11, 1e-11, 1e-11; LU has
   !> 1e-14, 1e-14, 1e-15 throughout.  Pivots of chains and random rows are above 0.1; a try that fails adds a tenth to
   !> the time of LU.
   real(wp), parameter :: least_part = 0.1_wp

   type, public :: saddle_schur_type
      type(schur_pattern_type) :: pattern
      integer, private :: n = 0, m = 0, p = 0
      logical, private :: is_identity = .false.
      logical, private :: holds_psi = .false.
      real(wp), private :: sigma = 1.0_wp                !! sign of A
      real(wp), private :: eps = 0.0_wp                  !! regularization in force
      real(wp), allocatable, private :: d(:)             !! D [n]
      real(wp), allocatable, private :: b(:)             !! B [entries]
      real(wp), allocatable, private :: w(:)             !! B D [entries]
      real(wp), allocatable, private :: dense(:, :)      !! B D^(1/2) [m + p, n], where there are no lists of pairs
      real(wp), allocatable, private :: root(:)          !! D^(1/2) [n], likewise
      real(wp), allocatable, private :: s(:)             !! S, then its factors [height*(rows + width) or rows^2]
      real(wp), allocatable, private :: original(:)      !! diagonal of S [rows], for LAPACK's factors
      real(wp), allocatable, private :: l(:)             !! multipliers in the order of S, zeros behind them [rows + width]
   contains
      procedure :: init => schur_init
      procedure :: factorize => schur_factorize
      procedure :: solve => schur_solve
      procedure :: reciprocal_condition => schur_reciprocal_condition
      procedure :: archive => schur_archive
   end type saddle_schur_type

contains

   recursive subroutine schur_init(self, n, m, p, is_identity, g, k, order, stat)
      class(saddle_schur_type), intent(inout) :: self
      integer, intent(in) :: n, m, p                     !! m + p > 0
      logical, intent(in) :: is_identity                 !! A is
      type(pattern_type), intent(in) :: g, k             !! that passed their checks
      integer, allocatable, intent(in) :: order(:)       !! of all unknowns, or not allocated
      integer, intent(out) :: stat                       !! not 0: no memory
      integer :: entries, padding

      self%n = n
      self%m = m
      self%p = p
      self%is_identity = is_identity
      if (allocated(self%d)) deallocate (self%d, self%b, self%w, self%s, self%original, self%l)
      if (allocated(self%dense)) deallocate (self%dense, self%root)
      call self%pattern%init(n, m, p, g, k, order, stat)
      if (stat /= 0) return
      entries = size(self%pattern%column)
      padding = merge(self%pattern%width, 0, self%pattern%is_banded)
      allocate (self%d(n), self%b(entries), self%w(entries), self%s(self%pattern%height*(m + p + padding)), &
         & self%original(m + p), self%l(m + p + padding), stat=stat)
      if (stat == 0 .and. .not. self%pattern%has_pairs) allocate (self%dense(m + p, n), self%root(n), stat=stat)
      if (stat /= 0) return
      self%d = 1.0_wp
      self%l = 0.0_wp
      self%s = 0.0_wp
   end subroutine schur_init

   !> Form S and factorize it
   pure subroutine schur_factorize(self, a, g, k, without_psi, eps, done)
      class(saddle_schur_type), intent(inout) :: self
      type(matrix_type), intent(in) :: a                 !! identity or diagonal
      type(jacobian_type), intent(in) :: g, k            !! of the patterns given to init
      logical, intent(in) :: without_psi                 !! leave K out, psi = -b_psi
      real(wp), intent(in) :: eps                        !! >= 0, see dynstep_saddle_point
      logical, intent(out) :: done                       !! .false.: by LU, please
      integer :: entries_of_g, failed

      self%holds_psi = without_psi
      self%eps = eps
      done = .false.
      if (self%m > 0) then
         if (.not. ieee_is_finite(absolute_sum(size(g%value), g%value))) return
      end if
      if (self%p > 0 .and. .not. without_psi) then
         if (.not. ieee_is_finite(absolute_sum(size(k%value), k%value))) return
      end if
      if (.not. self%is_identity) then
         call invert(self%n, a%a, self%sigma, self%d, done)
         if (.not. done) return
      end if
      associate (pattern => self%pattern)
         entries_of_g = 0
         if (self%m > 0) then
            entries_of_g = size(g%value)
            call take_entries(entries_of_g, g%value, pattern%place, pattern%column, self%d, self%b, self%w)
         end if
         if (without_psi) then
            call clear_entries(size(pattern%place) - entries_of_g, pattern%place(entries_of_g + 1:), self%b, self%w)
         else if (self%p > 0) then
            call take_entries(size(k%value), k%value, pattern%place(entries_of_g + 1:), pattern%column, self%d, &
               & self%b, self%w)
         end if
         if (pattern%has_pairs) then
            self%s = 0.0_wp
            call multiply_pairs(size(pattern%target), pattern%target, pattern%first_pair, pattern%left, pattern%right, &
               & self%b, self%w, self%s)
         else
            call multiply_dense(self)
         end if
         if (without_psi .or. eps > 0.0_wp) call change_diagonal(self)
         if (pattern%is_banded .and. pattern%width <= widest_band) then
            call band_ldl_factorize(pattern%rows, pattern%width, least_part, self%s, failed)
            done = failed == 0
         else
            call factorize_by_lapack(self, done)
         end if
      end associate
   end subroutine schur_factorize

   !> D and the sign of A
   pure subroutine invert(n, a, sigma, d, done)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n)
      real(wp), intent(out) :: sigma
      real(wp), intent(out) :: d(n)
      logical, intent(out) :: done       !! no entry is zero, of another sign, or not finite; products do not overflow
      real(wp), parameter :: largest = 1.0e100_wp
      integer :: others, j
      done = ieee_is_finite(absolute_sum(n, a))
      if (.not. done) return
      sigma = sign(1.0_wp, a(1))
      others = 0
      do j = 1, n
         if (sigma*a(j) < 1.0_wp/largest .or. sigma*a(j) > largest) others = others + 1
      end do
      done = others == 0
      if (.not. done) return
      do j = 1, n
         d(j) = sigma/a(j)
      end do
   end subroutine invert

   !> Entries of a Jacobian into B and B D
   pure subroutine take_entries(entries, value, place, column, d, b, w)
      integer, intent(in) :: entries
      real(wp), intent(in) :: value(entries)
      integer, intent(in) :: place(entries), column(*)
      real(wp), intent(in) :: d(*)
      real(wp), intent(inout) :: b(*), w(*)
      integer :: e
      do e = 1, entries
         b(place(e)) = value(e)
         w(place(e)) = value(e)*d(column(place(e)))
      end do
   end subroutine take_entries

   pure subroutine clear_entries(entries, place, b, w)
      integer, intent(in) :: entries
      integer, intent(in) :: place(entries)
      real(wp), intent(inout) :: b(*), w(*)
      integer :: e
      do e = 1, entries
         b(place(e)) = 0.0_wp
         w(place(e)) = 0.0_wp
      end do
   end subroutine clear_entries

   !> Entries of S from their lists
   pure subroutine multiply_pairs(targets, target, first_pair, left, right, b, w, s)
      integer, intent(in) :: targets
      integer, intent(in) :: target(targets), first_pair(targets + 1), left(*), right(*)
      real(wp), intent(in) :: b(*), w(*)
      real(wp), intent(inout) :: s(*)
      real(wp) :: x
      integer :: i, c
      do i = 1, targets
         x = b(left(first_pair(i)))*w(right(first_pair(i)))
         do c = first_pair(i) + 1, first_pair(i + 1) - 1
            x = x + b(left(c))*w(right(c))
         end do
         s(target(i)) = x
      end do
   end subroutine multiply_pairs

   !> S of a dense B
   pure subroutine multiply_dense(self)
      class(saddle_schur_type), intent(inout) :: self
      integer :: i, e
      self%root = sqrt(self%d)
      self%dense = 0.0_wp
      associate (pattern => self%pattern)
         do i = 1, pattern%rows
            do e = pattern%first(i), pattern%first(i + 1) - 1
               self%dense(i, pattern%column(e)) = self%b(e)*self%root(pattern%column(e))
            end do
         end do
         call dsyrk('L', 'N', pattern%rows, self%n, 1.0_wp, self%dense, pattern%rows, 0.0_wp, self%s, pattern%rows)
      end associate
   end subroutine multiply_dense

   !> Place of the diagonal entry of row i in the storage of S
   pure integer function diagonal_place(self, i)
      class(saddle_schur_type), intent(in) :: self
      integer, intent(in) :: i
      diagonal_place = (i - 1)*self%pattern%height + merge(1, i, self%pattern%is_banded)
   end function diagonal_place

   !> 1 for rows of K that are held, 1 + sigma eps times what it was for the others
   pure subroutine change_diagonal(self)
      class(saddle_schur_type), intent(inout) :: self
      integer :: i, at
      do i = 1, self%m + self%p
         at = diagonal_place(self, self%pattern%position(i))
         if (i > self%m .and. self%holds_psi) then
            self%s(at) = 1.0_wp
         else
            self%s(at) = self%s(at)*(1.0_wp + self%sigma*self%eps)
         end if
      end do
   end subroutine change_diagonal

   pure subroutine factorize_by_lapack(self, done)
      class(saddle_schur_type), intent(inout) :: self
      logical, intent(out) :: done
      real(wp) :: pivot
      integer :: i, info
      associate (pattern => self%pattern)
         do i = 1, pattern%rows
            self%original(i) = self%s(diagonal_place(self, i))
         end do
         if (pattern%is_banded) then
            call dpbtrf('L', pattern%rows, pattern%width, self%s, pattern%height, info)
         else
            call dpotrf('L', pattern%rows, self%s, pattern%rows, info)
         end if
         done = info == 0
         do i = 1, pattern%rows
            if (.not. done) return
            pivot = self%s(diagonal_place(self, i))**2
            done = pivot >= least_part*self%original(i) .and. pivot >= tiny(pivot) .and. pivot <= huge(pivot)
         end do
      end associate
   end subroutine factorize_by_lapack

   !> Solution in place of the right sides
   pure subroutine schur_solve(self, x, lambda, psi)
      class(saddle_schur_type), intent(inout) :: self
      real(wp), intent(inout) :: x(self%n), lambda(self%m), psi(self%p)
      real(wp) :: s
      integer :: i, e, info

      associate (pattern => self%pattern, l => self%l, w => self%w)
         do i = 1, self%m
            l(pattern%position(i)) = -self%sigma*lambda(i)
         end do
         do i = 1, self%p
            l(pattern%position(self%m + i)) = -self%sigma*psi(i)
         end do
         do i = 1, pattern%rows
            s = l(i)
            do e = pattern%first(i), pattern%first(i + 1) - 1
               s = s + w(e)*x(pattern%column(e))
            end do
            l(i) = s
         end do
         if (pattern%is_banded .and. pattern%width <= widest_band) then
            call band_ldl_solve(pattern%rows, pattern%width, self%s, l)
         else if (pattern%is_banded) then
            call dpbtrs('L', pattern%rows, pattern%width, 1, self%s, pattern%height, l, pattern%rows, info)
         else
            call dpotrs('L', pattern%rows, 1, self%s, pattern%rows, l, pattern%rows, info)
         end if
         do i = 1, self%n
            s = self%d(i)*x(i)
            do e = pattern%column_first(i), pattern%column_first(i + 1) - 1
               s = s - w(pattern%entry(e))*l(pattern%row(e))
            end do
            x(i) = self%sigma*s
         end do
         do i = 1, self%m
            lambda(i) = l(pattern%position(i))
         end do
         do i = 1, self%p
            psi(i) = l(pattern%position(self%m + i))
         end do
         ! held: S is 1 there whatever the sign
         if (self%holds_psi) psi = self%sigma*psi
      end associate
   end subroutine schur_solve

   !> Estimate of the reciprocal condition of the whole matrix in the 1-norm; it allocates
   pure subroutine schur_reciprocal_condition(self, rcond, stat)
      class(saddle_schur_type), intent(inout) :: self
      real(wp), intent(out) :: rcond
      integer, intent(out) :: stat             !! not 0: no memory
      real(wp), allocatable :: v(:), x(:)
      integer, allocatable :: signs(:)
      real(wp) :: norm, inverse_norm
      integer :: i, e, total, kase, isave(3)

      rcond = 0.0_wp
      total = self%n + self%m + self%p
      allocate (v(total), x(total), signs(total), stat=stat)
      if (stat /= 0) return
      ! columns of the whole matrix
      v(:self%n) = 1.0_wp/self%d
      associate (pattern => self%pattern)
         do e = 1, size(pattern%column)
            v(pattern%column(e)) = v(pattern%column(e)) + abs(self%b(e))
         end do
         do i = 1, pattern%rows
            v(self%n + i) = self%eps*dot_product(self%b(pattern%first(i):pattern%first(i + 1) - 1), &
               & self%w(pattern%first(i):pattern%first(i + 1) - 1))
            v(self%n + i) = v(self%n + i) + sum(abs(self%b(pattern%first(i):pattern%first(i + 1) - 1)))
         end do
      end associate
      norm = maxval(v)
      if (self%holds_psi) norm = max(norm, 1.0_wp)
      v = 0.0_wp
      x = 0.0_wp
      signs = 0
      isave = 0
      kase = 0
      inverse_norm = 0.0_wp
      do
         call dlacn2(total, v, x, signs, inverse_norm, kase, isave)
         if (kase == 0) exit
         ! symmetric: kase 1 and 2 ask for the same
         call self%solve(x(:self%n), x(self%n + 1:self%n + self%m), x(self%n + self%m + 1:))
      end do
      rcond = (1.0_wp/norm)/inverse_norm
   end subroutine schur_reciprocal_condition

   !> Everything that a solution reads; the pattern is that of `init`
   recursive subroutine schur_archive(self, name, file)
      class(saddle_schur_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%expect('rows', self%pattern%rows)
      call file%expect('width', self%pattern%width)
      call file%expect('position', self%pattern%position)
      call file%item('holds_psi', self%holds_psi)
      call file%item('sigma', self%sigma)
      call file%item('eps', self%eps)
      call file%item('d', self%d)
      call file%item('b', self%b)
      call file%item('w', self%w)
      call file%item('s', self%s)
      call file%end_section()
   end subroutine schur_archive
end module dynstep_saddle_schur
