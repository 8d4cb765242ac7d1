! SPDX-License-Identifier: BSD-3-Clause
!> The complex systems of a rational step, one for each pole p of R: with z = hA
!>
!>   (z - p) x = b,  S = h A - p I                      of y' = A y,
!>   S = p^2 M + p h C + h^2 K                          of M q'' + C q' + K q = 0, at its own size n.
!>
!> Poles come one of each pair of conjugates.  A coupling, K + b k' and C + b c', does not enter the band: with
!> w = S^-1 b the solution follows from that without it (Sherman and Morrison, Ann. Math. Stat. 21 (1950) 124-127).
!>
!> PROGRAMMING INTERFACE
!>
!>   call s%init_first(a, most, status)                  structure of A; room for `most` poles
!>   call s%init_second(m, c, k, most, status, coupled)  structures of M, C, K
!>   call s%factorize_first(a, h, poles, status, t)
!>   call s%factorize_second(m, c, k, h, poles, status, t, [b, k, c of a coupling])
!>   call s%solve(j, x)                                  x = S_j^-1 x, x(n) or x(n, columns)
!>
!> Diagonal matrices are divided, narrow bands go to LAPACK's band LU, the rest to its dense LU, all with row
!> interchanges and with rows scaled by powers of two.  A pole on the spectrum is found where pivots nearly vanish:
!> the terms of S x then cancel on a vector of inverse iteration.  A stiff system with a rigid mode has such pivots,
!> too, but there nothing cancels.
module dynstep_shifted_systems
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   use dynstep_lapack, only: zgbtrf, zgbtrs, zgetrf, zgetrs
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_zero, matrix_type
   use dynstep_status, only: dynstep_no_memory, dynstep_not_finite, dynstep_singular_matrix, status_type
   use dynstep_text, only: text
   implicit none
   private

   type, public :: shifted_systems_type
      integer :: n = 0                               !! order
      integer :: count = 0                           !! poles that are factorized
      integer, private :: kind = kind_dense          ! kind_diagonal, kind_banded or kind_dense
      integer, private :: kl = 0, ku = 0
      integer, private :: diagonal = 0               ! row of the band storage that holds the diagonal
      complex(wp), allocatable, private :: lu(:, :, :)     ! factors [rows, n, most]
      integer, allocatable, private :: order(:, :)         ! row interchanges [n, most]
      real(wp), allocatable, private :: scales(:, :)       ! of rows [n, most]
      logical, private :: coupled = .false.
      complex(wp), allocatable, private :: w(:, :)         ! S^-1 b [n, most], where coupled
      complex(wp), allocatable, private :: gain(:, :)      ! g = h^2 k + p h c, over 1 + g.w [n, most]
      complex(wp), allocatable, private :: x(:), sx(:)     ! for the search for a null vector [n]
      real(wp), allocatable, private :: sizes(:)           ! of the terms of S x [n]
   contains
      procedure :: init_first => shifted_init_first
      procedure :: init_second => shifted_init_second
      procedure :: factorize_first => shifted_factorize_first
      procedure :: factorize_second => shifted_factorize_second
      generic :: solve => solve_one, solve_many
      procedure, private :: solve_one => shifted_solve_one
      procedure, private :: solve_many => shifted_solve_many
   end type shifted_systems_type

   !> A pivot of a scaled matrix below this starts the search for a null vector
   real(wp), parameter :: small_pivot = sqrt(epsilon(1.0_wp))

contains

   !> Room for S = h A - p I
   pure subroutine shifted_init_first(self, a, most, status)
      class(shifted_systems_type), intent(inout) :: self
      type(matrix_type), intent(in) :: a             !! its structure is read
      integer, intent(in) :: most                    !! poles, >= 1
      type(status_type), intent(inout) :: status
      call make_room(self, a%n, max(kind_diagonal, a%kind), a%kl, a%ku, most, .false., status)
   end subroutine shifted_init_first

   !> Room for S = p^2 M + p h C + h^2 K
   pure subroutine shifted_init_second(self, m, c, k, most, status, coupled)
      class(shifted_systems_type), intent(inout) :: self
      type(matrix_type), intent(in) :: m, c, k       !! their structures are read
      integer, intent(in) :: most
      type(status_type), intent(inout) :: status
      logical, intent(in) :: coupled                 !! a coupling will come
      call make_room(self, m%n, max(kind_diagonal, m%kind, c%kind, k%kind), max(m%kl, c%kl, k%kl), &
         & max(m%ku, c%ku, k%ku), most, coupled, status)
   end subroutine shifted_init_second

   pure subroutine make_room(self, n, kind, kl, ku, most, coupled, status)
      class(shifted_systems_type), intent(inout) :: self
      integer, intent(in) :: n, kind, kl, ku, most
      logical, intent(in) :: coupled
      type(status_type), intent(inout) :: status
      integer :: rows, columns, stat
      if (status%failed()) return
      self%n = n
      self%count = 0
      self%coupled = .false.
      self%kind = kind
      self%kl = merge(kl, 0, kind == kind_banded)
      self%ku = merge(ku, 0, kind == kind_banded)
      ! a band with its room for interchanges as tall as the matrix is no band
      if (kind == kind_banded .and. 2*kl + ku + 1 >= n) self%kind = kind_dense
      self%diagonal = self%kl + self%ku + 1
      rows = 1
      if (self%kind == kind_banded) rows = 2*kl + ku + 1
      if (self%kind == kind_dense) rows = n
      columns = merge(most, 0, coupled)
      if (allocated(self%lu)) deallocate (self%lu, self%order, self%scales, self%w, self%gain, self%x, self%sx, self%sizes)
      allocate (self%lu(rows, n, most), self%order(n, most), self%scales(n, most), self%w(n, columns), self%gain(n, columns), &
         & self%x(n), self%sx(n), self%sizes(n), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the factors of '//text(most)//' complex matrices of ' &
         & //'order '//text(n)//'; give bands where the problem has them')
   end subroutine make_room

   !> S_j = h A - p_j I for all poles
   subroutine shifted_factorize_first(self, a, h, poles, status, t)
      class(shifted_systems_type), intent(inout) :: self
      type(matrix_type), intent(in) :: a
      real(wp), intent(in) :: h
      complex(wp), intent(in) :: poles(:)
      type(status_type), intent(inout) :: status
      real(wp), intent(in) :: t                      !! time, for the sentence
      complex(wp), parameter :: one = (1.0_wp, 0.0_wp)
      integer :: i, j
      if (status%failed()) return
      self%coupled = .false.
      self%count = size(poles)
      do j = 1, size(poles)
         self%lu(:, :, j) = (0.0_wp, 0.0_wp)
         self%sizes = abs(poles(j))
         call add_matrix(self, j, cmplx(h, 0.0_wp, wp), a)
         do i = 1, self%n
            call add_entry(self, i, i, j, -poles(j)*one)
         end do
         call factorize_one(self, j, poles(j), h, t, status)
         if (status%failed()) return
         if (weakest_pivot(self, j) > small_pivot) cycle
         call null_vector(self, j)
         self%sx = -poles(j)*self%x
         self%sizes = abs(self%sx)
         call add_product(a, h*one, self%x, self%sx, self%sizes)
         call refuse_cancelled(self, poles(j), h, t, status)
         if (status%failed()) return
      end do
   end subroutine shifted_factorize_first

   !> S_j = p_j^2 M + p_j h C + h^2 K for all poles
   subroutine shifted_factorize_second(self, m, c, k, h, poles, status, t, coupling_b, coupling_k, coupling_c)
      class(shifted_systems_type), intent(inout) :: self
      type(matrix_type), intent(in) :: m, c, k
      real(wp), intent(in) :: h
      complex(wp), intent(in) :: poles(:)
      type(status_type), intent(inout) :: status
      real(wp), intent(in) :: t
      real(wp), intent(in), optional :: coupling_b(:), coupling_k(:), coupling_c(:)   !! [n], all of them or none
      complex(wp) :: of_m, of_c, of_k
      integer :: j
      if (status%failed()) return
      self%coupled = .false.
      self%count = size(poles)
      of_k = cmplx(h**2, 0.0_wp, wp)
      do j = 1, size(poles)
         of_m = poles(j)**2
         of_c = poles(j)*h
         self%lu(:, :, j) = (0.0_wp, 0.0_wp)
         self%sizes = 0.0_wp
         call add_matrix(self, j, of_m, m)
         call add_matrix(self, j, of_c, c)
         call add_matrix(self, j, of_k, k)
         call factorize_one(self, j, poles(j), h, t, status)
         if (status%failed()) return
         if (weakest_pivot(self, j) > small_pivot) cycle
         call null_vector(self, j)
         self%sx = (0.0_wp, 0.0_wp)
         self%sizes = 0.0_wp
         call add_product(m, of_m, self%x, self%sx, self%sizes)
         call add_product(c, of_c, self%x, self%sx, self%sizes)
         call add_product(k, of_k, self%x, self%sx, self%sizes)
         call refuse_cancelled(self, poles(j), h, t, status)
         if (status%failed()) return
      end do
      if (.not. present(coupling_b)) return
      do j = 1, size(poles)
         self%w(:, j) = coupling_b
         call solve_uncoupled(self, j, 1, self%w(:, j))
         self%gain(:, j) = h**2*coupling_k + (poles(j)*h)*coupling_c
         of_k = 1.0_wp + sum(self%gain(:, j)*self%w(:, j))
         if (.not. abs(of_k) > 8.0_wp*epsilon(1.0_wp)*(1.0_wp + sum(abs(self%gain(:, j)*self%w(:, j))))) then
            call pole_on_spectrum(poles(j), h, t, status)
            return
         end if
         self%gain(:, j) = self%gain(:, j)/of_k
      end do
      self%coupled = .true.
   end subroutine shifted_factorize_second

   !> S_j = S_j + factor*matrix; sizes = the largest term in each row
   pure subroutine add_matrix(self, j, factor, matrix)
      class(shifted_systems_type), intent(inout) :: self
      integer, intent(in) :: j
      complex(wp), intent(in) :: factor
      type(matrix_type), intent(in) :: matrix
      integer :: row, column
      select case (matrix%kind)
      case (kind_zero)
         return
      case (kind_banded)
         do column = 1, self%n
            do row = max(1, column - matrix%ku), min(self%n, column + matrix%kl)
               call add_entry(self, row, column, j, factor*matrix%a(matrix%ku + 1 + row - column, column))
               self%sizes(row) = max(self%sizes(row), abs(factor)*abs(matrix%a(matrix%ku + 1 + row - column, column)))
            end do
         end do
      case (kind_dense)
         self%lu(:, :, j) = self%lu(:, :, j) + factor*matrix%a
         do column = 1, self%n
            self%sizes = max(self%sizes, abs(factor)*abs(matrix%a(:, column)))
         end do
      case default
         do row = 1, self%n
            call add_entry(self, row, row, j, factor*matrix%entry(row, row))
            self%sizes(row) = max(self%sizes(row), abs(factor)*abs(matrix%entry(row, row)))
         end do
      end select
   end subroutine add_matrix

   pure subroutine add_entry(self, row, column, j, value)
      class(shifted_systems_type), intent(inout) :: self
      integer, intent(in) :: row, column, j
      complex(wp), intent(in) :: value
      integer :: i
      select case (self%kind)
      case (kind_diagonal)
         i = 1
      case (kind_banded)
         i = self%diagonal + row - column
      case default
         i = row
      end select
      self%lu(i, column, j) = self%lu(i, column, j) + value
   end subroutine add_entry

   !> Scale the rows of S_j, and factorize
   subroutine factorize_one(self, j, pole, h, t, status)
      class(shifted_systems_type), intent(inout) :: self
      integer, intent(in) :: j
      complex(wp), intent(in) :: pole
      real(wp), intent(in) :: h, t
      type(status_type), intent(inout) :: status
      integer :: column, failed, i, low, high, row
      logical :: is_finite
      failed = 0
      is_finite = .true.
      self%scales(:, j) = 0.0_wp
      do column = 1, self%n
         call rows_of(self, column, low, high)
         do i = low, high
            row = row_of(self, i, column)
            is_finite = is_finite .and. ieee_is_finite(real(self%lu(i, column, j), wp)) &
               & .and. ieee_is_finite(aimag(self%lu(i, column, j)))
            if (.not. is_finite) exit
            self%scales(row, j) = max(self%scales(row, j), abs(real(self%lu(i, column, j), wp)), abs(aimag(self%lu(i, column, j))))
         end do
      end do
      if (.not. is_finite) then
         call status%set(dynstep_not_finite, 'the matrix of the step of length h = '//text(h)//' at t = '//text(t) &
            & //' is not finite; a smaller step may help', retry=.true.)
         return
      end if
      do row = 1, self%n
         if (self%scales(row, j) > 0.0_wp) then
            self%scales(row, j) = scale(1.0_wp, -exponent(self%scales(row, j)))
         else
            failed = row
         end if
      end do
      if (failed == 0) then
         do column = 1, self%n
            call rows_of(self, column, low, high)
            do i = low, high
               self%lu(i, column, j) = self%lu(i, column, j)*self%scales(row_of(self, i, column), j)
            end do
         end do
         select case (self%kind)
         case (kind_banded)
            call zgbtrf(self%n, self%n, self%kl, self%ku, self%lu(:, :, j), size(self%lu, 1), self%order(:, j), failed)
         case (kind_dense)
            call zgetrf(self%n, self%n, self%lu(:, :, j), self%n, self%order(:, j), failed)
         end select
      end if
      if (failed /= 0) call pole_on_spectrum(pole, h, t, status)
   end subroutine factorize_one

   !> Stored rows of a column
   pure subroutine rows_of(self, column, low, high)
      class(shifted_systems_type), intent(in) :: self
      integer, intent(in) :: column
      integer, intent(out) :: low, high
      low = 1
      high = size(self%lu, 1)
      if (self%kind /= kind_banded) return
      low = self%diagonal - min(self%ku, column - 1)
      high = self%diagonal + min(self%kl, self%n - column)
   end subroutine rows_of

   !> Row of the matrix that is stored in row i of a column
   pure integer function row_of(self, i, column)
      class(shifted_systems_type), intent(in) :: self
      integer, intent(in) :: i, column
      select case (self%kind)
      case (kind_diagonal)
         row_of = column
      case (kind_banded)
         row_of = column + i - self%diagonal
      case default
         row_of = i
      end select
   end function row_of

   !> Size of the smallest pivot, where the rows of the matrix have entries between 1/2 and 1, or of what is left of the
   !> terms of a row
   pure real(wp) function weakest_pivot(self, j)
      class(shifted_systems_type), intent(in) :: self
      integer, intent(in) :: j
      integer :: i
      weakest_pivot = 1.0_wp/maxval(self%sizes*self%scales(:, j))
      if (self%kind == kind_diagonal) return
      do i = 1, self%n
         weakest_pivot = min(weakest_pivot, abs(self%lu(merge(self%diagonal, i, self%kind == kind_banded), i, j)))
      end do
   end function weakest_pivot

   !> x = S^-1 S^-1 of a vector of ones with changing signs, of length 1 in the maximum norm
   subroutine null_vector(self, j)
      class(shifted_systems_type), intent(inout) :: self
      integer, intent(in) :: j
      real(wp) :: largest
      integer :: i, sweep
      do i = 1, self%n
         self%x(i) = cmplx(1.0_wp + real(mod(7*i, 11), wp)/11.0_wp, real(mod(5*i, 13), wp)/13.0_wp, wp)*(-1)**i
      end do
      do sweep = 1, 2
         call solve_uncoupled(self, j, 1, self%x)
         largest = maxval(abs(self%x))
         if (largest > 0.0_wp) self%x = self%x/largest
      end do
   end subroutine null_vector

   !> sx = sx + factor A x, sizes = sizes + |factor A x|, row by row
   subroutine add_product(a, factor, x, sx, sizes)
      type(matrix_type), intent(in) :: a
      complex(wp), intent(in) :: factor
      complex(wp), intent(in) :: x(:)
      complex(wp), intent(inout) :: sx(:)
      real(wp), intent(inout) :: sizes(:)
      real(wp) :: re(size(x)), im(size(x))
      if (a%kind == kind_zero) return
      re = 0.0_wp
      im = 0.0_wp
      call a%multiply_add(1.0_wp, real(x, wp), re)
      call a%multiply_add(1.0_wp, aimag(x), im)
      sx = sx + factor*cmplx(re, im, wp)
      sizes = sizes + abs(factor)*abs(cmplx(re, im, wp))
   end subroutine add_product

   !> Terms of S x that cancel to a few units of rounding: a change of these terms by their rounding errors makes
   !> S singular
   subroutine refuse_cancelled(self, pole, h, t, status)
      class(shifted_systems_type), intent(in) :: self
      complex(wp), intent(in) :: pole
      real(wp), intent(in) :: h, t
      type(status_type), intent(inout) :: status
      if (maxval(abs(self%sx)) > 16.0_wp*epsilon(1.0_wp)*maxval(self%sizes)) return
      call pole_on_spectrum(pole, h, t, status)
   end subroutine refuse_cancelled

   subroutine pole_on_spectrum(pole, h, t, status)
      complex(wp), intent(in) :: pole
      real(wp), intent(in) :: h, t
      type(status_type), intent(inout) :: status
      call status%set(dynstep_singular_matrix, 'the pole '//text(real(pole, wp))//' +- '//text(abs(aimag(pole))) &
         & //'i of the method lies on the spectrum of h A with h = '//text(h)//' at t = '//text(t) &
         & //'; take another step length, or a method without poles there, such as Pade''s', retry=.true.)
   end subroutine pole_on_spectrum

   !> x = S_j^-1 x
   subroutine shifted_solve_one(self, j, x)
      class(shifted_systems_type), intent(in) :: self
      integer, intent(in) :: j
      complex(wp), intent(inout), contiguous :: x(:)          !! [n]
      call solve_uncoupled(self, j, 1, x)
      if (self%coupled) x = x - self%w(:, j)*sum(self%gain(:, j)*x)
   end subroutine shifted_solve_one

   !> X = S_j^-1 X
   subroutine shifted_solve_many(self, j, x)
      class(shifted_systems_type), intent(in) :: self
      integer, intent(in) :: j
      complex(wp), intent(inout), contiguous :: x(:, :)       !! [n, columns]
      integer :: column
      call solve_uncoupled(self, j, size(x, 2), x)
      if (.not. self%coupled) return
      do column = 1, size(x, 2)
         x(:, column) = x(:, column) - self%w(:, j)*sum(self%gain(:, j)*x(:, column))
      end do
   end subroutine shifted_solve_many

   subroutine solve_uncoupled(self, j, columns, x)
      class(shifted_systems_type), intent(in) :: self
      integer, intent(in) :: j, columns
      complex(wp), intent(inout) :: x(self%n, columns)
      integer :: column, info
      do column = 1, columns
         x(:, column) = self%scales(:, j)*x(:, column)
      end do
      select case (self%kind)
      case (kind_diagonal)
         do column = 1, columns
            x(:, column) = x(:, column)/self%lu(1, :, j)
         end do
      case (kind_banded)
         call zgbtrs('N', self%n, self%kl, self%ku, columns, self%lu(:, :, j), size(self%lu, 1), self%order(:, j), x, self%n, &
            & info)
      case default
         call zgetrs('N', self%n, columns, self%lu(:, :, j), self%n, self%order(:, j), x, self%n, info)
      end select
   end subroutine solve_uncoupled
end module dynstep_shifted_systems
