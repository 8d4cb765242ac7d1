! SPDX-License-Identifier: BSD-3-Clause
!> Systems of constrained motion by LU with pivoting of the whole matrix, for every structure (see
!> dynstep_saddle_point, whose words these are).
!>
!> PROGRAMMING INTERFACE
!>
!>   call lu%init(n, m, p, kind, kl, ku, symmetric, g_pattern, k_pattern, general_reaction, order, status)
!>   call lu%factorize(a, g, k, without_psi, eps, status, [t], [name], [rl], [rp])
!>   call lu%solve(x, lambda, psi)
!>   lu%is_banded, lu%kl, lu%ku, lu%order, lu%singular_equation
!>
!>   Without constraints this is A's own factorization.  With them it is dense, or banded where the patterns of G and
!>   K are declared, A is not dense, the reaction is not general and the band saves work.
module dynstep_saddle_lu
   use dynstep_archive, only: archive_type
   use dynstep_factorization, only: factorization_type
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_identity, matrix_type
   use dynstep_ordering, only: saddle_bandwidth, saddle_order
   use dynstep_small_factor, only: small_order
   use dynstep_status, only: dynstep_no_memory, dynstep_not_finite, dynstep_singular_matrix, message_length, status_type
   use dynstep_text, only: text
   implicit none
   private

   type, public :: saddle_lu_type
      integer :: n = 0, m = 0, p = 0           !! coordinates, constraints g, constraints k
      logical :: is_banded = .false.           !! a band is factorized
      integer :: kl = 0, ku = 0                !! bandwidths in force, 0 when dense
      integer :: singular_equation = 0         !! equation that factorize refused: of motion 1 .. n, of g, of k; or 0
      integer, allocatable :: order(:)         !! unknown at each place of the matrix [n + m + p]
      type(factorization_type) :: factorization
      logical, private :: general_reaction = .false.
      integer, private :: kind = kind_identity, a_kl = 0, a_ku = 0      ! structure of A
      type(matrix_type), private :: matrix
      ! Places are linear positions in the storage of the matrix, in the order of the entries
      integer, allocatable, private :: a_from(:), a_place(:)            ! of A (banded: from where in its storage)
      integer, allocatable, private :: g_place(:), gt_place(:)          ! of G and G^T
      integer, allocatable, private :: k_place(:), kt_place(:)          ! of K and K^T
      integer, allocatable, private :: diagonal(:)                      ! of the multipliers' diagonal [m + p]
      real(wp), allocatable, private :: diagonal_of_a(:)                ! [n]
      real(wp), allocatable, private :: work(:)                         ! [n + m + p]
   contains
      procedure :: init => lu_init
      procedure :: factorize => lu_factorize
      procedure :: solve => lu_solve
      procedure :: archive => lu_archive
   end type saddle_lu_type

contains

   !> Choose the storage, find every entry's place in it, allocate; the arguments are dynstep_saddle_point's, checked
   recursive subroutine lu_init(self, n, m, p, kind, kl, ku, symmetric, g_pattern, k_pattern, general_reaction, &
      & order, status)
      class(saddle_lu_type), intent(inout) :: self
      integer, intent(in) :: n, m, p
      integer, intent(in) :: kind, kl, ku               !! structure of A
      logical, intent(in) :: symmetric                  !! of A
      type(pattern_type), intent(in) :: g_pattern, k_pattern
      logical, intent(in) :: general_reaction
      integer, allocatable, intent(in) :: order(:)
      type(status_type), intent(inout) :: status
      integer, allocatable :: position(:)
      integer :: total, j, stat

      if (status%failed()) return
      total = n + m + p
      self%n = n
      self%m = m
      self%p = p
      self%kind = kind
      self%a_kl = merge(kl, 0, kind == kind_banded)
      self%a_ku = merge(ku, 0, kind == kind_banded)
      self%general_reaction = general_reaction
      self%singular_equation = 0
      call free(self)
      if (m + p == 0) then
         self%is_banded = kind == kind_banded
         self%kl = self%a_kl
         self%ku = self%a_ku
         self%order = [(j, j=1, n)]
         call self%factorization%init(kind, n, kl, ku, symmetric, status)
         return
      end if
      ! the factorization refuses what is wrong with A's structure
      call self%factorization%init(kind, n, kl, ku, symmetric, status)
      if (status%failed()) return

      allocate (self%order(total), position(total), self%work(total), self%diagonal_of_a(n), stat=stat)
      if (stat /= 0) then
         call no_memory(total, status)
         return
      end if
      call choose_storage(self, g_pattern, k_pattern, order, position)
      call self%matrix%init(merge(kind_banded, kind_dense, self%is_banded), total, self%kl, self%ku, .false., status)
      call self%factorization%init(self%matrix%kind, total, self%kl, self%ku, .false., status)
      if (status%failed()) return
      call find_places(self, g_pattern, k_pattern, position, stat)
      if (stat /= 0) call no_memory(total, status)
   end subroutine lu_init

   pure subroutine no_memory(total, status)
      integer, intent(in) :: total
      type(status_type), intent(inout) :: status
      call status%set(dynstep_no_memory, 'no memory for a system of constrained motion with '//text(total) &
         & //' unknowns; declare the patterns of the Jacobians')
   end subroutine no_memory

   pure subroutine free(self)
      class(saddle_lu_type), intent(inout) :: self
      if (allocated(self%order)) deallocate (self%order)
      if (allocated(self%work)) deallocate (self%work)
      if (allocated(self%diagonal_of_a)) deallocate (self%diagonal_of_a)
      if (allocated(self%a_from)) deallocate (self%a_from)
      if (allocated(self%a_place)) deallocate (self%a_place)
      if (allocated(self%g_place)) deallocate (self%g_place)
      if (allocated(self%gt_place)) deallocate (self%gt_place)
      if (allocated(self%k_place)) deallocate (self%k_place)
      if (allocated(self%kt_place)) deallocate (self%kt_place)
      if (allocated(self%diagonal)) deallocate (self%diagonal)
   end subroutine free

   !> Dense, or banded in the order that was given or found, where the factors of the band take no more room than the
   !> dense ones.  At that point, kl = ku = (n + m + p)/3, the band takes 0.3 to 0.7 of the time of the dense matrix
   !> (measured for 17 to 400 unknowns with reference LAPACK, which is as fast dense only at 0.7 to 0.9 of their number;
   !> a tuned library gains more on dense matrices).  Up to small_order unknowns the dense kernel has no rival.
   recursive subroutine choose_storage(self, g, k, order, position)
      class(saddle_lu_type), intent(inout) :: self
      type(pattern_type), intent(in) :: g, k
      integer, allocatable, intent(in) :: order(:)
      integer, intent(out) :: position(:)               !! place of each unknown
      integer :: total, j

      total = self%n + self%m + self%p
      self%is_banded = total > small_order .and. self%kind /= kind_dense .and. .not. self%general_reaction &
         & .and. (self%m == 0 .or. .not. g%is_dense()) .and. (self%p == 0 .or. .not. k%is_dense())
      if (self%is_banded) then
         if (allocated(order)) then
            self%order = order
         else
            call saddle_order(self%n, self%a_kl, self%a_ku, self%m, g, self%p, k, self%order)
         end if
         do j = 1, total
            position(self%order(j)) = j
         end do
         call saddle_bandwidth(self%n, self%a_kl, self%a_ku, self%m, g, self%p, k, position, self%kl, self%ku)
         self%is_banded = 2*self%kl + self%ku + 1 <= total
      end if
      if (.not. self%is_banded) then
         self%kl = 0
         self%ku = 0
         do j = 1, total
            self%order(j) = j
            position(j) = j
         end do
      end if
   end subroutine choose_storage

   !> Places of all entries
   pure subroutine find_places(self, g, k, position, stat)
      class(saddle_lu_type), intent(inout) :: self
      type(pattern_type), intent(in) :: g, k
      integer, intent(in) :: position(:)
      integer, intent(out) :: stat                      !! not 0: no memory
      integer :: n, m, p, i, j, e, rows

      n = self%n
      m = self%m
      p = self%p
      e = 0
      if (self%kind <= kind_banded) then
         do j = 1, n
            e = e + min(n, j + self%a_kl) - max(1, j - self%a_ku) + 1
         end do
      end if
      allocate (self%a_from(e), self%a_place(e), self%g_place(entries(m, g)), self%gt_place(entries(m, g)), &
         & self%k_place(entries(p, k)), self%kt_place(entries(p, k)), self%diagonal(m + p), stat=stat)
      if (stat /= 0) return
      rows = self%a_kl + self%a_ku + 1
      e = 0
      if (self%kind <= kind_banded) then
         do j = 1, n
            do i = max(1, j - self%a_ku), min(n, j + self%a_kl)
               e = e + 1
               self%a_from(e) = (j - 1)*rows + self%a_ku + 1 + i - j
               self%a_place(e) = place(position(i), position(j))
            end do
         end do
      end if
      do i = 1, m
         do e = first(g, i), first(g, i + 1) - 1
            j = column(g, e)
            self%g_place(e) = place(position(n + i), position(j))
            self%gt_place(e) = place(position(j), position(n + i))
         end do
      end do
      do i = 1, p
         do e = first(k, i), first(k, i + 1) - 1
            j = column(k, e)
            self%k_place(e) = place(position(n + m + i), position(j))
            self%kt_place(e) = place(position(j), position(n + m + i))
         end do
      end do
      do i = 1, m + p
         self%diagonal(i) = place(position(n + i), position(n + i))
      end do
      if (self%kind == kind_identity) call scatter(n, [(1.0_wp, j=1, n)], self%a_place, self%matrix%a)

   contains

      pure integer function entries(rows, pattern)
         integer, intent(in) :: rows
         type(pattern_type), intent(in) :: pattern
         entries = rows*n
         if (rows > 0 .and. .not. pattern%is_dense()) entries = size(pattern%column)
      end function entries

      pure integer function first(pattern, row)
         type(pattern_type), intent(in) :: pattern
         integer, intent(in) :: row
         if (pattern%is_dense()) then
            first = (row - 1)*n + 1
         else
            first = pattern%first(row)
         end if
      end function first

      pure integer function column(pattern, e)
         type(pattern_type), intent(in) :: pattern
         integer, intent(in) :: e
         if (pattern%is_dense()) then
            column = modulo(e - 1, n) + 1
         else
            column = pattern%column(e)
         end if
      end function column

      pure integer function place(row, column)
         integer, intent(in) :: row, column
         if (self%is_banded) then
            place = (column - 1)*(self%kl + self%ku + 1) + self%ku + 1 + row - column
         else
            place = (column - 1)*(n + m + p) + row
         end if
      end function place
   end subroutine find_places

   !> Fill in and factorize
   pure subroutine lu_factorize(self, a, g, k, without_psi, eps, status, t, name, rl, rp)
      class(saddle_lu_type), intent(inout) :: self
      type(matrix_type), intent(in) :: a
      type(jacobian_type), intent(in) :: g, k
      logical, intent(in) :: without_psi                !! hold_psi
      real(wp), intent(in) :: eps                       !! regularization
      type(status_type), intent(inout) :: status
      real(wp), intent(in), optional :: t
      character(len=*), intent(in), optional :: name
      real(wp), intent(in), optional :: rl(:, :), rp(:, :)

      if (status%failed()) return
      self%singular_equation = 0
      if (self%m + self%p == 0) then
         if (present(name)) then
            call self%factorization%factorize(a, status, t, name)
         else
            call self%factorization%factorize(a, status, t)
         end if
         if (status%failed()) call explain(self, status)
         return
      end if
      select case (self%kind)
      case (kind_diagonal)
         call scatter(self%n, a%a, self%a_place, self%matrix%a)
      case (kind_banded)
         call scatter_from(size(self%a_place), a%a, self%a_from, self%a_place, self%matrix%a)
      case (kind_dense)
         call set_columns(0, 1.0_wp, a%a, self%matrix%a)
      end select
      if (self%m > 0) then
         call scatter(size(g%value), g%value, self%g_place, self%matrix%a)
         if (self%general_reaction .and. present(rl)) then
            call set_columns(self%n, -1.0_wp, rl, self%matrix%a)
         else
            if (self%general_reaction) self%matrix%a(:self%n, self%n + 1:self%n + self%m) = 0.0_wp
            call scatter(size(g%value), g%value, self%gt_place, self%matrix%a)
         end if
         call set_all(self%m, 0.0_wp, self%diagonal, self%matrix%a)
      end if
      if (self%p > 0) then
         if (self%general_reaction) self%matrix%a(:self%n, self%n + self%m + 1:) = 0.0_wp
         if (without_psi) then
            call set_all(size(k%value), 0.0_wp, self%k_place, self%matrix%a)
            call set_all(size(k%value), 0.0_wp, self%kt_place, self%matrix%a)
         else
            call scatter(size(k%value), k%value, self%k_place, self%matrix%a)
            if (self%general_reaction .and. present(rp)) then
               call set_columns(self%n + self%m, -1.0_wp, rp, self%matrix%a)
            else
               call scatter(size(k%value), k%value, self%kt_place, self%matrix%a)
            end if
         end if
         call set_all(self%p, merge(-1.0_wp, 0.0_wp, without_psi), self%diagonal(self%m + 1:), self%matrix%a)
      end if
      if (eps > 0.0_wp) call regularize(self, a, g, k, eps, without_psi)

      if (present(name)) then
         call self%factorization%factorize(self%matrix, status, t, name)
      else
         call self%factorization%factorize(self%matrix, status, t, 'matrix of constrained motion')
      end if
      if (status%failed()) call explain(self, status)
   end subroutine lu_factorize

   !> a(to) = value
   pure subroutine scatter(entries, value, to, a)
      integer, intent(in) :: entries
      real(wp), intent(in) :: value(entries)
      integer, intent(in) :: to(entries)
      real(wp), intent(inout) :: a(*)
      integer :: e
      do e = 1, entries
         a(to(e)) = value(e)
      end do
   end subroutine scatter

   !> a(to) = value(from)
   pure subroutine scatter_from(entries, value, from, to, a)
      integer, intent(in) :: entries
      real(wp), intent(in) :: value(*)
      integer, intent(in) :: from(entries), to(entries)
      real(wp), intent(inout) :: a(*)
      integer :: e
      do e = 1, entries
         a(to(e)) = value(from(e))
      end do
   end subroutine scatter_from

   !> a(to) = value, the same for all
   pure subroutine set_all(entries, value, to, a)
      integer, intent(in) :: entries
      real(wp), intent(in) :: value
      integer, intent(in) :: to(entries)
      real(wp), intent(inout) :: a(*)
      integer :: e
      do e = 1, entries
         a(to(e)) = value
      end do
   end subroutine set_all

   !> Columns behind `before` of the first rows of a dense matrix = factor block
   pure subroutine set_columns(before, factor, block, a)
      integer, intent(in) :: before
      real(wp), intent(in) :: factor               !! 1 or -1
      real(wp), intent(in) :: block(:, :)
      real(wp), intent(inout) :: a(:, :)
      integer :: i, j
      do j = 1, size(block, 2)
         do i = 1, size(block, 1)
            a(i, before + j) = factor*block(i, j)
         end do
      end do
   end subroutine set_columns

   !> The diagonal of the multipliers' block
   pure subroutine regularize(self, a, g, k, eps, without_psi)
      class(saddle_lu_type), intent(inout) :: self
      type(matrix_type), intent(in) :: a
      type(jacobian_type), intent(in) :: g, k
      real(wp), intent(in) :: eps
      logical, intent(in) :: without_psi
      real(wp) :: largest
      integer :: j

      do j = 1, self%n
         self%diagonal_of_a(j) = abs(a%entry(j, j))
      end do
      if (.not. minval(self%diagonal_of_a) > 0.0_wp) then
         largest = 0.0_wp
         if (self%kind >= kind_diagonal) largest = maxval(abs(a%a))
         if (.not. largest > 0.0_wp) largest = 1.0_wp
         where (.not. self%diagonal_of_a > 0.0_wp) self%diagonal_of_a = largest
      end if
      if (self%m > 0) call weigh(g, self%m, self%diagonal, self%matrix%a)
      if (self%p > 0 .and. .not. without_psi) call weigh(k, self%p, self%diagonal(self%m + 1:), self%matrix%a)

   contains

      pure subroutine weigh(jacobian, rows, to, matrix)
         type(jacobian_type), intent(in) :: jacobian
         integer, intent(in) :: rows
         integer, intent(in) :: to(rows)
         real(wp), intent(inout) :: matrix(*)
         real(wp) :: s
         integer :: i, e
         do i = 1, rows
            s = 0.0_wp
            do e = jacobian%first(i), jacobian%first(i + 1) - 1
               s = s + jacobian%value(e)**2/self%diagonal_of_a(jacobian%column(e))
            end do
            matrix(to(i)) = -eps*s
         end do
      end subroutine weigh
   end subroutine regularize

   !> Put the factorization's sentence in the words of constrained motion
   pure subroutine explain(self, status)
      class(saddle_lu_type), intent(inout) :: self
      type(status_type), intent(inout) :: status
      character(len=message_length) :: words
      integer :: at, row, column, equation

      if (status%code == dynstep_singular_matrix) then
         row = self%factorization%singular_equation
         words = ', equation '//text(row)//': '
         at = index(status%message, trim(words), back=.true.)
         equation = self%order(row)
         self%singular_equation = equation
         if (at == 0) return
         if (equation > self%n .and. index(status%message(at:), 'its column is zero') > 0) then
            words = ', '//trim(equation_name(self, equation))//': no equation of motion has its reaction'
         else
            words = ', '//trim(equation_name(self, equation))//status%message(at + len_trim(words) - 1:)
         end if
      else if (status%code == dynstep_not_finite .and. self%m + self%p > 0) then
         at = index(status%message, ': row ', back=.true.)
         call self%matrix%first_not_finite(row, column)
         if (at == 0 .or. row == 0) return
         words = ': '//trim(equation_name(self, self%order(row)))//', '//trim(unknown_name(self, self%order(column)))
      else
         return
      end if
      status%message = status%message(:at - 1)//words
   end subroutine explain

   pure function equation_name(self, equation) result(words)
      class(saddle_lu_type), intent(in) :: self
      integer, intent(in) :: equation               !! 1 .. n + m + p
      character(len=48) :: words
      if (equation <= self%n) then
         words = 'equation of motion '//text(equation)
      else if (equation <= self%n + self%m) then
         words = 'constraint '//text(equation - self%n)//' of g'
      else
         words = 'constraint '//text(equation - self%n - self%m)//' of k'
      end if
   end function equation_name

   pure function unknown_name(self, unknown) result(words)
      class(saddle_lu_type), intent(in) :: self
      integer, intent(in) :: unknown                !! 1 .. n + m + p
      character(len=48) :: words
      if (unknown <= self%n) then
         words = 'coordinate '//text(unknown)
      else if (unknown <= self%n + self%m) then
         words = 'multiplier '//text(unknown - self%n)//' of g'
      else
         words = 'multiplier '//text(unknown - self%n - self%m)//' of k'
      end if
   end function unknown_name

   !> Solution in place of the right sides; they are left alone where factorize did not succeed
   pure subroutine lu_solve(self, x, lambda, psi)
      class(saddle_lu_type), intent(inout) :: self
      real(wp), intent(inout) :: x(self%n)
      real(wp), intent(inout) :: lambda(self%m)
      real(wp), intent(inout) :: psi(self%p)
      integer :: j, unknown

      if (self%m + self%p == 0) then
         call self%factorization%solve(x)
         return
      end if
      if (self%is_banded) then
         do j = 1, self%n + self%m + self%p
            unknown = self%order(j)
            if (unknown <= self%n) then
               self%work(j) = x(unknown)
            else if (unknown <= self%n + self%m) then
               self%work(j) = lambda(unknown - self%n)
            else
               self%work(j) = psi(unknown - self%n - self%m)
            end if
         end do
         call self%factorization%solve(self%work)
         do j = 1, self%n + self%m + self%p
            unknown = self%order(j)
            if (unknown <= self%n) then
               x(unknown) = self%work(j)
            else if (unknown <= self%n + self%m) then
               lambda(unknown - self%n) = self%work(j)
            else
               psi(unknown - self%n - self%m) = self%work(j)
            end if
         end do
      else
         self%work(:self%n) = x
         self%work(self%n + 1:self%n + self%m) = lambda
         self%work(self%n + self%m + 1:) = psi
         call self%factorization%solve(self%work)
         x = self%work(:self%n)
         lambda = self%work(self%n + 1:self%n + self%m)
         psi = self%work(self%n + self%m + 1:)
      end if
   end subroutine lu_solve

   !> The factors
   recursive subroutine lu_archive(self, name, file)
      class(saddle_lu_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%expect('kl', self%kl)
      call file%expect('ku', self%ku)
      call file%expect('order', self%order)
      call file%item('singular_equation', self%singular_equation)
      call self%factorization%archive('factorization', file)
      call file%end_section()
   end subroutine lu_archive
end module dynstep_saddle_lu
