! SPDX-License-Identifier: BSD-3-Clause
!> Constraints that depend on each other: rank, rows, partners, coefficients, sentences.
module test_rank
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int64
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: wp
   use dynstep_rank, only: default_rank_tolerance, dependence_type, find_dependent_rows, largest_rank_problem
   use dynstep_status, only: dynstep_no_memory, dynstep_not_finite, status_type
   use random_matrices, only: random
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_rank

contains

   subroutine collect_rank(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('independent constraints', test_independent), &
         & new_unittest('a combination', test_combination), &
         & new_unittest('across g and k', test_across), &
         & new_unittest('several relations', test_several), &
         & new_unittest('errors of differences', test_differences), &
         & new_unittest('near the tolerance', test_tolerance), &
         & new_unittest('long lists', test_long_list), &
         & new_unittest('refusals', test_refusals)]
   end subroutine collect_rank

   !> A dense Jacobian of random entries
   subroutine random_jacobian(jacobian, rows, columns, seed)
      type(jacobian_type), intent(inout) :: jacobian
      integer, intent(in) :: rows, columns
      integer(int64), intent(inout) :: seed
      type(pattern_type) :: pattern
      type(status_type) :: status
      integer :: e
      call jacobian%init(rows, columns, pattern, status)
      do e = 1, rows*columns
         jacobian%value(e) = random(seed)
      end do
   end subroutine random_jacobian

   !> Row `to` = row `to` + factor row `from`
   subroutine add_row(factor, from, source, to, jacobian)
      real(wp), intent(in) :: factor
      integer, intent(in) :: from, to
      type(jacobian_type), intent(in) :: source
      type(jacobian_type), intent(inout) :: jacobian
      integer :: j
      do j = 1, jacobian%columns
         call jacobian%set_entry(to, j, jacobian%entry(to, j) + factor*source%entry(from, j))
      end do
   end subroutine add_row

   subroutine clear_row(row, jacobian)
      integer, intent(in) :: row
      type(jacobian_type), intent(inout) :: jacobian
      jacobian%value(jacobian%first(row):jacobian%first(row + 1) - 1) = 0.0_wp
   end subroutine clear_row

   subroutine test_independent(error)
      type(error_type), allocatable, intent(out) :: error
      type(jacobian_type) :: g, k, none
      type(dependence_type) :: found
      type(status_type) :: status
      integer(int64) :: seed
      seed = 1
      call random_jacobian(g, 4, 9, seed)
      call random_jacobian(k, 5, 9, seed)
      g%value = 1.0e-9_wp*g%value
      call find_dependent_rows(g, k, default_rank_tolerance, found, status)
      call check(error, found%rank, 9, 'rank')
      call check(error, size(found%rows), 0, 'no rows')
      call check(error, size(found%partner), 0, 'no partners')
      call find_dependent_rows(none, none, default_rank_tolerance, found, status)
      call check(error, found%rank, 0, 'rank of nothing')
      call check(error, size(found%rows), 0, 'no rows of nothing')
      call check(error, status%code, 0, trim(status%message))
   end subroutine test_independent

   !> The coefficients come out for the rows as they are, whatever their units
   subroutine test_combination(error)
      type(error_type), allocatable, intent(out) :: error
      type(jacobian_type) :: g, none
      type(dependence_type) :: found
      type(status_type) :: status
      integer(int64) :: seed
      seed = 2
      call random_jacobian(g, 5, 9, seed)
      g%value(:9) = 1.0e6_wp*g%value(:9)
      call clear_row(4, g)
      call add_row(2.0_wp, 1, g, 4, g)
      call add_row(-3.0e6_wp, 3, g, 4, g)
      call find_dependent_rows(g, none, default_rank_tolerance, found, status)
      call check(error, found%rank, 4, 'rank')
      call check(error, size(found%rows), 1, 'one row')
      if (allocated(error)) return
      call check(error, found%rows(1), 4, 'row')
      call check(error, size(found%partner), 2, 'two partners')
      if (allocated(error)) return
      call check(error, all(found%partner == [1, 3]), 'partners')
      call check(error, found%coefficient(1), 2.0_wp, 'first coefficient', thr=1.0e-13_wp)
      call check(error, found%coefficient(2), -3.0e6_wp, 'second coefficient', thr=1.0e-13_wp, rel=.true.)
      call check(error, trim(found%sentence(1)), 'constraint 4 of g depends on constraints 1 and 3 of g')
   end subroutine test_combination

   subroutine test_across(error)
      type(error_type), allocatable, intent(out) :: error
      type(jacobian_type) :: g, k, none
      type(dependence_type) :: found
      type(status_type) :: status
      integer(int64) :: seed
      seed = 3
      call random_jacobian(g, 4, 12, seed)
      call random_jacobian(k, 3, 12, seed)
      call clear_row(3, k)
      call add_row(1.0_wp, 2, g, 3, k)
      call add_row(1.0_wp, 4, g, 3, k)
      call add_row(1.0_wp, 1, k, 3, k)
      call find_dependent_rows(g, k, default_rank_tolerance, found, status)
      call check(error, size(found%rows), 1, 'one row')
      if (allocated(error)) return
      call check(error, trim(found%sentence(1)), &
         & 'constraint 3 of k depends on constraints 2 and 4 of g and on constraint 1 of k')
      call find_dependent_rows(none, k, default_rank_tolerance, found, status)
      call check(error, found%rank, 3, 'k alone')
      call clear_row(2, k)
      call find_dependent_rows(none, k, default_rank_tolerance, found, status)
      call check(error, found%rank, 2, 'a row of zeros')
      call check(error, trim(found%sentence(1)), 'constraint 2 of k has a Jacobian of zeros')
   end subroutine test_across

   !> Three relations that share rows, and more rows than columns: each relation holds, each has a row of its own
   subroutine test_several(error)
      type(error_type), allocatable, intent(out) :: error
      type(jacobian_type) :: g, k, none
      type(dependence_type) :: found
      type(status_type) :: status
      integer(int64) :: seed
      real(wp) :: row(10)
      integer :: i, e, j, rows
      seed = 4
      do rows = 9, 14, 5
         call random_jacobian(g, rows, 10, seed)
         if (rows == 9) then
            do i = 7, 9
               call clear_row(i, g)
               call add_row(real(i, wp), i - 6, g, i, g)
               call add_row(-1.0_wp, i - 5, g, i, g)
            end do
         end if
         call find_dependent_rows(g, none, default_rank_tolerance, found, status)
         call check(error, found%rank, merge(6, 10, rows == 9), 'rank')
         call check(error, size(found%rows), rows - found%rank, 'rows')
         if (allocated(error)) return
         do i = 1, size(found%rows)
            if (rows == 9) call check(error, found%rows(i), 6 + i, 'the last rows')
            row = [(g%entry(found%rows(i), j), j=1, 10)]
            do e = found%first(i), found%first(i + 1) - 1
               call check(error, all(found%rows /= found%partner(e)), 'partners are independent')
               row = row - found%coefficient(e)*[(g%entry(found%partner(e), j), j=1, 10)]
            end do
            ! the coefficients are below 100 here
            call check(error, maxval(abs(row)), 0.0_wp, 'relation', thr=1.0e-12_wp)
         end do
      end do
      ! a copy: the later row is named
      call random_jacobian(g, 3, 10, seed)
      call random_jacobian(k, 1, 10, seed)
      call clear_row(1, k)
      call add_row(5.0_wp, 1, g, 1, k)
      call find_dependent_rows(g, k, default_rank_tolerance, found, status)
      call check(error, trim(found%sentence(1)), 'constraint 1 of k depends on constraint 1 of g')
   end subroutine test_several

   !> Errors of 1e-12 of the largest entry in each row: the same rows, relations and sentences
   subroutine test_differences(error)
      type(error_type), allocatable, intent(out) :: error
      type(jacobian_type) :: g, none
      type(dependence_type) :: found
      type(status_type) :: status
      integer(int64) :: seed
      integer :: trial, i, e
      real(wp) :: size_of_row
      seed = 5
      do trial = 1, 200
         call random_jacobian(g, 8, 15, seed)
         do i = 1, 7
            size_of_row = 10.0_wp**(3*random(seed))
            do e = g%first(i), g%first(i + 1) - 1
               g%value(e) = size_of_row*g%value(e)
            end do
         end do
         call clear_row(8, g)
         call add_row(1.0_wp/maxval(abs(g%value(:15))), 1, g, 8, g)
         call add_row(0.5_wp/maxval(abs(g%value(61:75))), 5, g, 8, g)
         call add_row(-0.7_wp/maxval(abs(g%value(91:105))), 7, g, 8, g)
         do i = 1, 8
            size_of_row = maxval(abs(g%value(g%first(i):g%first(i + 1) - 1)))
            do e = g%first(i), g%first(i + 1) - 1
               g%value(e) = g%value(e) + 1.0e-12_wp*size_of_row*random(seed)
            end do
         end do
         call find_dependent_rows(g, none, default_rank_tolerance, found, status)
         call check(error, found%rank, 7, 'rank')
         if (allocated(error)) return
         call check(error, trim(found%sentence(1)), 'constraint 8 of g depends on constraints 1, 5 and 7 of g')
      end do
   end subroutine test_differences

   !> Two rows of length 1 at an angle: independent above the tolerance, and only there
   subroutine test_tolerance(error)
      type(error_type), allocatable, intent(out) :: error
      type(jacobian_type) :: g, none
      type(pattern_type) :: pattern
      type(dependence_type) :: found
      type(status_type) :: status
      call g%init(2, 3, pattern, status)
      g%value = [1.0e5_wp, 0.0_wp, 0.0_wp, 1.0e-3_wp, 0.0_wp, 3.0e-13_wp]
      call find_dependent_rows(g, none, 1.0e-10_wp, found, status)
      call check(error, found%rank, 2, 'angle 3e-10')
      g%value(6) = 3.0e-14_wp
      call find_dependent_rows(g, none, 1.0e-10_wp, found, status)
      call check(error, found%rank, 1, 'angle 3e-11')
      call find_dependent_rows(g, none, 1.0e-11_wp, found, status)
      call check(error, found%rank, 2, 'angle 3e-11, smaller tolerance')
   end subroutine test_tolerance

   subroutine test_long_list(error)
      type(error_type), allocatable, intent(out) :: error
      type(jacobian_type) :: g, none
      type(dependence_type) :: found
      type(status_type) :: status
      integer(int64) :: seed
      integer :: i
      seed = 6
      call random_jacobian(g, 12, 20, seed)
      call clear_row(12, g)
      do i = 1, 8
         call add_row(1.0_wp, i, g, 12, g)
      end do
      call find_dependent_rows(g, none, default_rank_tolerance, found, status)
      call check(error, trim(found%sentence(1)), 'constraint 12 of g depends on constraints 1, 2, 3, 4, 5, 6, 7 and 8 of g')
      call add_row(1.0_wp, 9, g, 12, g)
      call find_dependent_rows(g, none, default_rank_tolerance, found, status)
      call check(error, trim(found%sentence(1)), &
         & 'constraint 12 of g depends on constraints 1, 2, 3, 4, 5, 6, 7 and 2 more of g')
   end subroutine test_long_list

   subroutine test_refusals(error)
      type(error_type), allocatable, intent(out) :: error
      type(jacobian_type) :: g, k, none
      type(pattern_type) :: pattern
      type(dependence_type) :: found
      type(status_type) :: status
      integer(int64) :: seed
      integer :: i
      seed = 7
      call random_jacobian(g, 3, 5, seed)
      call random_jacobian(k, 2, 5, seed)
      k%value(7) = ieee_value(1.0_wp, ieee_quiet_nan)
      call find_dependent_rows(g, k, default_rank_tolerance, found, status)
      call check(error, status%code, dynstep_not_finite, 'code')
      call check(error, trim(status%message), 'the Jacobian of constraint 2 of k is not finite')
      call status%clear()
      call random_jacobian(k, 2, 6, seed)
      call find_dependent_rows(g, k, default_rank_tolerance, found, status)
      call check(error, trim(status%message), 'the Jacobian of g has 5 columns, that of k 6')
      call status%clear()
      allocate (pattern%first(2002), pattern%column(2001))
      pattern%first = [(i, i=1, 2002)]
      pattern%column = 1
      call g%init(2001, 2000, pattern, status)
      call check(error, 2001*2000 > largest_rank_problem, 'too large')
      call find_dependent_rows(g, none, default_rank_tolerance, found, status)
      call check(error, status%code, dynstep_no_memory, 'too large')
   end subroutine test_refusals
end module test_rank
