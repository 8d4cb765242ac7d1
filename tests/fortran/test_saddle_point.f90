! SPDX-License-Identifier: BSD-3-Clause
!> Linear systems of constrained motion: every storage, every block, every refusal.
!>
!> Backward errors are asked to be below 10 N eps, as in test_linalg.  Solutions by two ways differ by the condition times
!> the backward errors; the samples have conditions near 1e3, and solutions agree to 1e-13 (measured, 3e-14 at 5000
!> unknowns) where 1e-12 is asked for.
module test_saddle_point
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_factorization, only: factorization_type
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_banded, kind_diagonal, matrix_type
   use dynstep_saddle_point, only: saddle_point_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_finite, dynstep_singular_matrix, status_type
   use dynstep_text, only: text
   use random_matrices, only: backward_error, cases, full, kinds, kls, kus, random, sample, symmetric
   use rod_chains, only: body_order, rod_pattern, shuffled
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_saddle_point

   real(wp), parameter :: eps = epsilon(1.0_wp)

   !> A system of constrained motion and its right side
   type :: sample_type
      integer :: n = 0, m = 0, p = 0
      type(matrix_type) :: a
      type(pattern_type) :: g_pattern, k_pattern
      type(jacobian_type) :: g, k
      real(wp), allocatable :: whole(:, :)     ! [n + m + p, n + m + p]
      real(wp), allocatable :: b(:)            ! [n + m + p]
   end type sample_type

contains

   subroutine collect_saddle_point(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('solutions in every storage', test_solutions), &
         & new_unittest('without constraints', test_unconstrained), &
         & new_unittest('held psi', test_hold_psi), &
         & new_unittest('general reaction', test_general_reaction), &
         & new_unittest('redundant constraints, regularized', test_regularization), &
         & new_unittest('singular: which equation', test_singular), &
         & new_unittest('chains of rods', test_chains), &
         & new_unittest('refused arguments', test_refusals)]
   end subroutine collect_saddle_point

   !> A system of the structure `number` of random_matrices; patterned: each constraint sees four coordinates near each
   !> other
   subroutine make(s, number, n, m, p, patterned, seed)
      type(sample_type), intent(out) :: s
      integer, intent(in) :: number, n, m, p
      logical, intent(in) :: patterned
      integer(int64), intent(inout) :: seed
      integer :: e, i
      s%n = n
      s%m = m
      s%p = p
      s%a = sample(number, n, seed, 4.0_wp)
      if (patterned) then
         call make_pattern(s%g_pattern, m, n, 0)
         call make_pattern(s%k_pattern, p, n, 2)
      end if
      call fill(s%g, m, s%g_pattern)
      call fill(s%k, p, s%k_pattern)
      allocate (s%whole(n + m + p, n + m + p), s%b(n + m + p))
      call assemble(s)
      do i = 1, n + m + p
         s%b(i) = random(seed)
      end do

   contains

      subroutine fill(jacobian, rows, pattern)
         type(jacobian_type), intent(inout) :: jacobian
         integer, intent(in) :: rows
         type(pattern_type), intent(in) :: pattern
         type(status_type) :: status
         if (rows == 0) return
         call jacobian%init(rows, n, pattern, status)
         do e = 1, size(jacobian%value)
            jacobian%value(e) = random(seed)
         end do
         ! entries of size 3 that no other row has keep the rows far from dependent
         do i = 1, rows
            e = jacobian%first(i) + modulo(7*i, jacobian%first(i + 1) - jacobian%first(i))
            jacobian%value(e) = jacobian%value(e) + 3
         end do
      end subroutine fill
   end subroutine make

   !> Rows spread over the coordinates, four in each
   subroutine make_pattern(pattern, rows, n, shift)
      type(pattern_type), intent(inout) :: pattern
      integer, intent(in) :: rows, n, shift
      integer :: i, j, start
      if (rows == 0) return
      pattern%first = [(1 + 4*(i - 1), i=1, rows + 1)]
      allocate (pattern%column(4*rows))
      do i = 1, rows
         start = min(n - 3, 1 + shift + ((i - 1)*(n - 3))/rows)
         pattern%column(4*i - 3:4*i) = [(start + j, j=0, 3)]
      end do
   end subroutine make_pattern

   !> The whole matrix with r = -G^T lambda - K^T psi
   subroutine assemble(s)
      type(sample_type), intent(inout) :: s
      integer :: i, j
      s%whole = 0.0_wp
      s%whole(:s%n, :s%n) = full(s%a)
      do j = 1, s%n
         do i = 1, s%m
            s%whole(s%n + i, j) = s%g%entry(i, j)
            s%whole(j, s%n + i) = s%g%entry(i, j)
         end do
         do i = 1, s%p
            s%whole(s%n + s%m + i, j) = s%k%entry(i, j)
            s%whole(j, s%n + s%m + i) = s%k%entry(i, j)
         end do
      end do
   end subroutine assemble

   subroutine init(saddle, s, status, general, order)
      type(saddle_point_type), intent(inout) :: saddle
      type(sample_type), intent(in) :: s
      type(status_type), intent(inout) :: status
      logical, intent(in), optional :: general
      integer, intent(in), optional :: order(:)
      integer, allocatable :: given(:)
      logical :: reaction_is_general
      reaction_is_general = .false.
      if (present(general)) reaction_is_general = general
      if (present(order)) given = order
      call saddle%init(s%n, s%m, s%p, s%a%kind, s%a%kl, s%a%ku, s%a%symmetric, s%g_pattern, s%k_pattern, &
         & reaction_is_general, given, status)
   end subroutine init

   !> Solution for the right side s%b
   function solution(saddle, s) result(x)
      type(saddle_point_type), intent(inout) :: saddle
      type(sample_type), intent(in) :: s
      real(wp) :: x(s%n + s%m + s%p)
      x = s%b
      associate (n => s%n, m => s%m)
         call saddle%solve(x(:n), x(n + 1:n + m), x(n + m + 1:))
      end associate
   end function solution

   !> The residual of a solution against a matrix put together entry by entry
   subroutine check_solution(error, saddle, s, what)
      type(error_type), allocatable, intent(inout) :: error
      type(saddle_point_type), intent(inout) :: saddle
      type(sample_type), intent(in) :: s
      character(len=*), intent(in) :: what
      real(wp) :: ones(s%n + s%m + s%p)
      ones = 1.0_wp
      call check(error, backward_error(s%whole, solution(saddle, s), s%b, ones), 0.0_wp, what, thr=10*size(ones)*eps)
   end subroutine check_solution

   !> Structures of A, sizes, patterns; twice with other entries; banded = dense
   subroutine test_solutions(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: ns(7) = [4, 5, 7, 9, 20, 60, 100], ms(7) = [2, 0, 2, 3, 8, 0, 40], ps(7) = [0, 2, 1, 3, 5, 30, 10]
      type(sample_type) :: s, t
      type(saddle_point_type) :: saddle, dense
      type(status_type) :: status
      integer(int64) :: seed
      integer :: number, k, way, bands
      character(len=80) :: what
      seed = 20
      bands = 0
      do number = 1, cases
         do k = 1, size(ns)
            do way = 0, 1
               if (ns(k) == 4 .and. kls(number) > 3) cycle
               if (ns(k) <= kls(number)) cycle
               write (what, '("structure ", i0, ", n = ", i0, ", m = ", i0, ", p = ", i0, ", patterned: ", i0)') &
                  & number, ns(k), ms(k), ps(k), way
               call make(s, number, ns(k), ms(k), ps(k), way == 1, seed)
               call init(saddle, s, status)
               call saddle%factorize(s%a, s%g, s%k, status)
               call check(error, status%code, 0, trim(what)//trim(status%message))
               if (allocated(error)) return
               call check_solution(error, saddle, s, trim(what))
               call make(t, number, ns(k), ms(k), ps(k), way == 1, seed)
               call saddle%factorize(t%a, t%g, t%k, status)
               call check_solution(error, saddle, t, trim(what)//', again')
               if (.not. saddle%is_banded) cycle
               bands = bands + 1
               call dense%init(t%n, t%m, t%p, t%a%kind, t%a%kl, t%a%ku, t%a%symmetric, t%g_pattern, t%k_pattern, &
                  & .true., saddle%order, status)
               call dense%factorize(t%a, t%g, t%k, status)
               call check(error, status%code, 0, trim(what)//trim(status%message))
               call check(error, maxval(abs(solution(saddle, t) - solution(dense, t))), 0.0_wp, &
                  & trim(what)//', banded and dense', thr=1.0e-12_wp*maxval(abs(solution(dense, t))))
               if (allocated(error)) return
            end do
         end do
      end do
      call check(error, bands >= 10, 'some are banded')
   end subroutine test_solutions

   !> m = p = 0: A's own factorization, to the last bit
   subroutine test_unconstrained(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s
      type(saddle_point_type) :: saddle
      type(factorization_type) :: f
      type(status_type) :: status
      real(wp) :: rcond, expected
      real(wp), allocatable :: x(:)
      integer(int64) :: seed
      integer :: number
      seed = 3
      do number = 1, cases
         call make(s, number, 40, 0, 0, .false., seed)
         call init(saddle, s, status)
         call saddle%factorize(s%a, s%g, s%k, status)
         call f%init(s%a%kind, s%n, kls(number), kus(number), symmetric(number), status)
         call f%factorize(s%a, status)
         call check(error, status%code, 0, trim(status%message))
         if (allocated(error)) return
         x = s%b
         call f%solve(x)
         call check(error, maxval(abs(solution(saddle, s) - x)), 0.0_wp, 'the same solution', thr=0.0_wp)
         call saddle%reciprocal_condition(rcond, status)
         call f%reciprocal_condition(expected, status)
         call check(error, rcond, expected, 'condition', thr=0.0_wp)
         call check(error, saddle%is_banded .eqv. kinds(number) == kind_banded, 'is_banded')
         call check(error, saddle%kl, kls(number), 'kl')
      end do
   end subroutine test_unconstrained

   !> x and lambda as without k, psi = -b_psi; then with k again
   subroutine test_hold_psi(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s, without
      type(saddle_point_type) :: saddle, plain
      type(status_type) :: status
      real(wp), allocatable :: x(:), expected(:)
      integer(int64) :: seed
      integer :: k, n, m, p
      seed = 5
      do k = 1, 4
         n = merge(6, 60, k <= 2)
         m = n/3
         p = n/6
         call make(s, merge(2, 6, k /= 4), n, m, p, modulo(k, 2) == 0, seed)
         without = s
         without%p = 0
         deallocate (without%b)
         without%b = s%b(:n + m)
         call init(saddle, s, status)
         if (allocated(without%k_pattern%first)) deallocate (without%k_pattern%first, without%k_pattern%column)
         call init(plain, without, status)
         call plain%factorize(s%a, s%g, s%k, status)
         expected = solution(plain, without)
         call saddle%factorize(s%a, s%g, s%k, status)
         call saddle%factorize(s%a, s%g, s%k, status, hold_psi=.true.)
         call check(error, status%code, 0, trim(status%message))
         if (allocated(error)) return
         x = solution(saddle, s)
         call check(error, maxval(abs(x(:n + m) - expected)), 0.0_wp, 'x and lambda', thr=1.0e-12_wp*maxval(abs(expected)))
         call check(error, maxval(abs(x(n + m + 1:) + s%b(n + m + 1:))), 0.0_wp, 'psi', thr=eps)
         call saddle%factorize(s%a, s%g, s%k, status)
         call check_solution(error, saddle, s, 'with k again')
      end do
   end subroutine test_hold_psi

   !> Any RL and RP; left out, they are -G^T and -K^T again
   subroutine test_general_reaction(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s, general
      type(saddle_point_type) :: saddle
      type(status_type) :: status
      integer(int64) :: seed
      real(wp), allocatable :: rl(:, :), rp(:, :)
      integer :: i, j, k, n, m, p
      seed = 6
      do k = 1, 4
         n = merge(6, 40, k <= 2)
         m = n/3
         p = n/6
         call make(s, merge(2, 12, k /= 4), n, m, p, modulo(k, 2) == 0, seed)
         if (allocated(rl)) deallocate (rl, rp)
         allocate (rl(n, m), source=-s%whole(:n, n + 1:n + m))
         allocate (rp(n, p), source=-s%whole(:n, n + m + 1:))
         do i = 1, n
            do j = 1, m
               rl(i, j) = rl(i, j) + 0.1_wp*random(seed)
            end do
            do j = 1, p
               rp(i, j) = rp(i, j) + 0.1_wp*random(seed)
            end do
         end do
         general = s
         general%whole(:n, n + 1:n + m) = -rl
         general%whole(:n, n + m + 1:) = -rp
         call init(saddle, s, status, general=.true.)
         call saddle%factorize(s%a, s%g, s%k, status, rl=rl, rp=rp)
         call check(error, status%code, 0, trim(status%message))
         call check(error, .not. saddle%is_banded, 'dense')
         call check_solution(error, saddle, general, 'general')
         call saddle%factorize(s%a, s%g, s%k, status, hold_psi=.true., rl=rl, rp=rp)
         general%whole(:, n + m + 1:) = 0.0_wp
         general%whole(n + m + 1:, :) = 0.0_wp
         do i = n + m + 1, n + m + p
            general%whole(i, i) = -1.0_wp
         end do
         call check_solution(error, saddle, general, 'general, psi held')
         call saddle%factorize(s%a, s%g, s%k, status)
         call check_solution(error, saddle, s, 'multipliers by the transposed Jacobians')
      end do
   end subroutine test_general_reaction

   !> A row twice.  With a right side that has it twice, too, the solutions of the system differ by a multiple of
   !> lambda(1) - lambda(copy); the least one halves it.  The regularized one differs from that by O(eps).
   subroutine test_regularization(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: epsilons(2) = [1.0e-6_wp, 1.0e-8_wp]
      type(sample_type) :: s, once
      type(saddle_point_type) :: saddle, plain
      type(status_type) :: status
      real(wp), allocatable :: x(:), expected(:)
      integer(int64) :: seed
      integer :: k, l, n, m, first, second
      seed = 8
      do k = 1, 4
         n = merge(6, 60, k <= 2)
         m = n/3
         call make(s, merge(2, 6, k /= 4), n, m + 1, 0, modulo(k, 2) == 0, seed)
         if (modulo(k, 2) == 0) then
            first = s%g%first(m + 1)
            second = s%g%first(m)
            s%g%column(first:first + 3) = s%g%column(second:second + 3)
            s%g_pattern%column(first:first + 3) = s%g%column(second:second + 3)
            s%g%value(first:first + 3) = s%g%value(second:second + 3)
         else
            s%g%value(m*n + 1:) = s%g%value((m - 1)*n + 1:m*n)
         end if
         s%b(n + m + 1) = s%b(n + m)
         once = s
         once%m = m
         if (modulo(k, 2) == 0) then
            once%g_pattern%first = s%g_pattern%first(:m + 1)
            once%g_pattern%column = s%g_pattern%column(:4*m)
         end if
         once%g%rows = m
         once%g%first = s%g%first(:m + 1)
         once%g%column = s%g%column(:s%g%first(m + 1) - 1)
         once%g%value = s%g%value(:s%g%first(m + 1) - 1)
         once%b = s%b(:n + m)
         call init(plain, once, status)
         call plain%factorize(once%a, once%g, once%k, status)
         call check(error, status%code, 0, trim(status%message))
         if (allocated(error)) return
         expected = [solution(plain, once), 0.0_wp]
         expected(n + m) = expected(n + m)/2
         expected(n + m + 1) = expected(n + m)
         call init(saddle, s, status)
         call saddle%factorize(s%a, s%g, s%k, status)
         call check(error, status%code, dynstep_singular_matrix, 'singular')
         call check(error, saddle%singular_equation == n + m .or. saddle%singular_equation == n + m + 1, 'one of the two rows')
         do l = 1, 2
            call status%clear()
            call saddle%factorize(s%a, s%g, s%k, status, regularization=epsilons(l))
            call check(error, status%code, 0, trim(status%message))
            if (allocated(error)) return
            x = solution(saddle, s)
            ! measured: at most 7 eps on x and lambda; rounding errors are amplified by 1/eps on the difference of the two
            call check(error, maxval(abs(x - expected)), 0.0_wp, 'least solution', &
               & thr=20*epsilons(l)*maxval(abs(expected)))
         end do
      end do
   end subroutine test_regularization

   !> One equation of each block depends on the others
   subroutine test_singular(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s, bad
      type(saddle_point_type) :: saddle
      type(status_type) :: status
      integer(int64) :: seed
      integer :: way, i, e
      seed = 9
      do way = 1, 2
         call make(s, 2, merge(6, 60, way == 1), 3, 2, .true., seed)
         call init(saddle, s, status)
         bad = s
         bad%g%value(s%g%first(3):s%g%first(4) - 1) = 0.0_wp
         call saddle%factorize(bad%a, bad%g, bad%k, status, 2.5_wp, 'iteration matrix')
         call check(error, status%code, dynstep_singular_matrix, 'code')
         call check(error, trim(status%message), &
            & 'the iteration matrix is singular at t = 2.5, constraint 3 of g: its row is zero')
         call check(error, saddle%singular_equation, s%n + 3, 'equation')

         call status%clear()
         bad = s
         bad%k%value(s%k%first(1):s%k%first(2) - 1) = 0.0_wp
         call saddle%factorize(bad%a, bad%g, bad%k, status)
         call check(error, trim(status%message), &
            & 'the matrix of constrained motion is singular, constraint 1 of k: its row is zero')
         call check(error, saddle%singular_equation, s%n + 3 + 1, 'equation')

         call status%clear()
         call saddle%factorize(s%a, s%g, s%k, status)
         call check(error, status%code, 0, 'a success after it')
         call check(error, saddle%singular_equation, 0, 'no equation')
      end do

      ! equations of motion: a coordinate without mass that no constraint sees
      s%a%a(60, 1) = 0.0_wp
      do i = 1, 3
         do e = s%g%first(i), s%g%first(i + 1) - 1
            if (s%g%column(e) == 60) s%g%value(e) = 0.0_wp
         end do
      end do
      do e = 1, size(s%k%column)
         if (s%k%column(e) == 60) s%k%value(e) = 0.0_wp
      end do
      call saddle%factorize(s%a, s%g, s%k, status, 1.0_wp)
      call check(error, trim(status%message), &
         & 'the matrix of constrained motion is singular at t = 1, equation of motion 60: its row is zero')
      call check(error, saddle%singular_equation, 60, 'equation')

      ! without constraints
      call status%clear()
      call make(s, 2, 4, 0, 0, .false., seed)
      s%a%a(2, 1) = 0.0_wp
      call init(saddle, s, status)
      call saddle%factorize(s%a, s%g, s%k, status, name='mass matrix')
      call check(error, trim(status%message), &
         & 'the mass matrix is singular, equation of motion 2: its diagonal entry is zero')

      ! not finite: where
      call status%clear()
      call make(s, 2, 6, 3, 2, .false., seed)
      call init(saddle, s, status)
      s%k%value(8) = ieee_value(1.0_wp, ieee_quiet_nan)
      call saddle%factorize(s%a, s%g, s%k, status, 1.0_wp)
      call check(error, status%code, dynstep_not_finite, 'code')
      call check(error, trim(status%message), &
         & 'the matrix of constrained motion is not finite at t = 1: constraint 2 of k, coordinate '//text(s%k%column(8)))
   end subroutine test_singular

   !> Order of the user = order that is found = dense, up to 20 rods; at 1000 the first two, of open chains.  Work and storage of the
   !> band per rod do not grow.
   subroutine test_chains(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: lengths(4) = [4, 7, 20, 1000]
      type(sample_type) :: s, unpatterned
      type(saddle_point_type) :: given, found, dense
      type(status_type) :: status
      type(pattern_type) :: none
      real(wp), allocatable :: x(:)
      real(wp) :: allowed
      integer(int64) :: seed
      integer :: i, j, e, n, m, way, closed
      integer, allocatable :: coordinate(:), order(:)
      seed = 11
      do i = 1, size(lengths)
         do way = 0, 3
            n = 3*lengths(i)
            m = 2*lengths(i)
            coordinate = [(j, j=1, n)]
            closed = way/2
            if (modulo(way, 2) == 1) coordinate = shuffled(n, seed)
            s = sample_type(n=n, m=m)
            s%a = sample(2, n, seed, 2.0_wp)
            call rod_pattern(lengths(i), closed == 1, coordinate, s%g_pattern)
            call s%g%init(m, n, s%g_pattern, status)
            ! a joint of rods: 1 and -1 at positions, lever arms below 1 at angles
            do j = 1, m
               do e = s%g%first(j), s%g%first(j + 1) - 1
                  s%g%value(e) = 0.5_wp*random(seed)
                  if (any(s%g%column(e) == coordinate(3::3))) cycle
                  s%g%value(e) = merge(1.0_wp, -1.0_wp, any(s%g%column(e) == coordinate(3*((j + 1)/2) - 2:3*((j + 1)/2))))
               end do
            end do
            s%b = [(random(seed), j=1, n + m)]
            order = body_order(lengths(i))
            do j = 1, n + m
               if (order(j) <= n) order(j) = coordinate(order(j))
            end do
            call init(found, s, status)
            call found%factorize(s%a, s%g, s%k, status)
            call check(error, status%code, 0, trim(status%message))
            if (allocated(error)) return
            call check(error, found%is_banded .or. lengths(i)*closed == 4, 'banded')
            call check(error, found%kl <= merge(9, 5, closed == 1), 'bandwidth')
            ! the bodies' order of a closed chain has no band: at 1000 rods its matrix would be dense
            if (lengths(i)*closed > 100) cycle
            call init(given, s, status, order=order)
            call given%factorize(s%a, s%g, s%k, status)
            call check(error, status%code, 0, trim(status%message))
            if (closed == 0) call check(error, given%kl, 4, 'bandwidth of the bodies'' order')
            if (closed == 0) call check(error, given%is_banded, 'banded in the bodies'' order')
            call check(error, all(given%order == merge(order, [(j, j=1, n + m)], given%is_banded)), 'order')
            x = solution(found, s)
            allowed = 1.0e-12_wp*maxval(abs(x))
            call check(error, maxval(abs(solution(given, s) - x)), 0.0_wp, 'given = found', thr=allowed)
            if (lengths(i) > 100) cycle
            unpatterned = s
            unpatterned%g_pattern = none
            call unpatterned%g%init(m, n, none, status)
            do j = 1, m
               do e = s%g%first(j), s%g%first(j + 1) - 1
                  call unpatterned%g%set_entry(j, s%g%column(e), s%g%value(e))
               end do
            end do
            call init(dense, unpatterned, status)
            call dense%factorize(unpatterned%a, unpatterned%g, unpatterned%k, status)
            call check(error, .not. dense%is_banded, 'dense')
            call check(error, maxval(abs(solution(dense, unpatterned) - x)), 0.0_wp, 'dense = found', thr=allowed)
         end do
      end do
   end subroutine test_chains

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(sample_type) :: s
      type(saddle_point_type) :: saddle
      type(status_type) :: status
      integer(int64) :: seed
      integer :: i
      seed = 10
      call make(s, 2, 6, 3, 2, .true., seed)
      call init(saddle, s, status, order=[1, 2, 3])
      call check(error, status%code, dynstep_invalid_input, 'short order')
      call check(error, trim(status%message), 'the order of the unknowns has 3 entries, not n + m + p = 11')
      call status%clear()
      call init(saddle, s, status, order=[(i, i=1, 10), 10])
      call check(error, trim(status%message), 'the order of the unknowns has 10 twice')
      call status%clear()
      call init(saddle, s, status, order=[(i, i=1, 10), 12])
      call check(error, trim(status%message), 'the order of the unknowns has 12 at place 11, outside 1 to n + m + p = 11')
      call status%clear()
      call saddle%init(0, 1, 0, kind_diagonal, 0, 0, .true., s%g_pattern, s%k_pattern, .false., saddle%order, status)
      call check(error, status%code, dynstep_invalid_input, 'n = 0')
      call status%clear()
      call init(saddle, s, status)
      call saddle%factorize(s%a, s%g, s%k, status, rl=reshape([(1.0_wp, i=1, 18)], [6, 3]))
      call check(error, status%code, dynstep_invalid_input, 'rl was not announced')
      call status%clear()
      call saddle%factorize(s%a, s%k, s%g, status)
      call check(error, status%code, dynstep_invalid_input, 'G and K exchanged')
      call status%clear()
      call init(saddle, s, status, general=.true.)
      call saddle%factorize(s%a, s%g, s%k, status, rl=reshape([(1.0_wp, i=1, 18)], [3, 6]))
      call check(error, status%code, dynstep_invalid_input, 'the shape of rl')
   end subroutine test_refusals
end module test_saddle_point
