! SPDX-License-Identifier: BSD-3-Clause
!> Rows of a paper's table: printed, computed, difference, verdict, reason.
!>
!>   call table%open(austin_1991, 'Table 4', 'Error area after 3000 s')
!>   call table%open_figure(jay_negrut_2008, 'Fig. 1', 'global errors')   figures have no numbers: see below
!>   call table%section('Standard Newmark')
!>   call table%agrees(item, printed, computed, [accept, exact, accept_exact, reason])
!>   call table%explained(item, printed, should_be, computed, [...])     the print is wrong
!>   call table%rounding(item, printed, computed, lowest, highest, reason, [misprint])
!>   call table%holds(item, computed, expected, accept, reason)          no figure of the table
!>   call table%close()                                                  stops with 1 on a failure
!>
!> `printed` is the figure as the paper has it; without `accept` the computed one may differ
!> from it by one unit of its last digit (the paper cuts as often as it rounds).  `exact` is
!> the value in exact arithmetic, from an independent study of the paper.
!>
!> Figures are printed as curves alone.  Their numbers come from an independent study, and stand where a
!> table has the printed ones.
module paper_table
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: value_of, last_digit

   character(len=*), parameter, public :: austin_1991 = 'Austin 1991'
   character(len=*), parameter, public :: jay_negrut_2008 = 'Jay & Negrut 2008'
   character(len=*), parameter, public :: xie_1995 = 'Xie 1995'

   type, public :: paper_table_type
      character(len=24), private :: name = '' ! of the table or figure in the paper
      integer, private :: agreed = 0          ! figures that are what the library gives
      integer, private :: explained_count = 0 ! figures that are wrong in print, and known why
      integer, private :: rounded = 0         ! figures that are nothing but rounding errors
      integer, private :: held = 0            ! further checks that hold
      integer, private :: failed = 0          ! rows outside their tolerance
      integer, private :: failed_figures = 0
   contains
      procedure :: open => table_open
      procedure :: open_figure => table_open_figure
      procedure :: section => table_section
      procedure :: agrees => table_agrees
      procedure :: explained => table_explained
      procedure :: rounding => table_rounding
      procedure :: holds => table_holds
      procedure :: close => table_close
   end type paper_table_type

contains

   !> A table with printed numbers
   subroutine table_open(self, paper, name, title)
      class(paper_table_type), intent(out) :: self
      character(len=*), intent(in) :: paper, name, title
      self%name = name
      print '(a, ", ", a, ": ", a)', paper, name, title
      call print_header('     printed')
   end subroutine table_open

   !> A figure, with the numbers of an independent study
   subroutine table_open_figure(self, paper, name, title)
      class(paper_table_type), intent(out) :: self
      character(len=*), intent(in) :: paper, name, title
      self%name = name
      print '(a, ", ", a, ": ", a)', paper, name, title
      call print_header('   reference')
   end subroutine table_open_figure

   subroutine print_header(source)
      character(len=*), intent(in) :: source
      print '(2x, a, t46, a, t71, a, t95, a, t107, a)', 'item', source, '      computed', 'difference', 'verdict'
   end subroutine print_header

   subroutine table_section(self, title)
      class(paper_table_type), intent(in) :: self
      character(len=*), intent(in) :: title
      print '(a)', title
   end subroutine table_section

   !> The paper's figure is what the library computes
   subroutine table_agrees(self, item, printed, computed, accept, exact, accept_exact, reason)
      class(paper_table_type), intent(inout) :: self
      character(len=*), intent(in) :: item, printed
      real(wp), intent(in) :: computed
      real(wp), intent(in), optional :: accept              !! |computed - printed|
      real(wp), intent(in), optional :: exact
      real(wp), intent(in), optional :: accept_exact        !! |computed - exact|
      character(len=*), intent(in), optional :: reason
      logical :: ok
      ok = within(computed, value_of(printed), printed, accept, exact, accept_exact)
      call count_figure(self, ok, self%agreed)
      call print_row(item, printed, computed, merge('agrees', 'FAILS ', ok), reason)
   end subroutine table_agrees

   !> The paper's figure is wrong; `should_be` is what it has to be, to as many digits
   subroutine table_explained(self, item, printed, should_be, computed, accept, exact, accept_exact, reason)
      class(paper_table_type), intent(inout) :: self
      character(len=*), intent(in) :: item, printed, should_be
      real(wp), intent(in) :: computed
      real(wp), intent(in), optional :: accept              !! |computed - should_be|
      real(wp), intent(in), optional :: exact
      real(wp), intent(in), optional :: accept_exact        !! |computed - exact|
      character(len=*), intent(in) :: reason
      logical :: ok
      ok = within(computed, value_of(should_be), should_be, accept, exact, accept_exact)
      call count_figure(self, ok, self%explained_count)
      call print_row(item, printed, computed, merge('explained', 'FAILS    ', ok), reason)
   end subroutine table_explained

   !> The paper's figure is what rounding errors left; so is ours, between two bounds
   subroutine table_rounding(self, item, printed, computed, lowest, highest, reason, misprint)
      class(paper_table_type), intent(inout) :: self
      character(len=*), intent(in) :: item, printed
      real(wp), intent(in) :: computed, lowest, highest
      character(len=*), intent(in) :: reason
      logical, intent(in), optional :: misprint             !! and the print is wrong
      logical :: ok, wrong
      wrong = .false.
      if (present(misprint)) wrong = misprint
      ok = ieee_is_finite(computed)
      if (ok) ok = computed >= lowest .and. computed <= highest
      if (wrong) then
         call count_figure(self, ok, self%explained_count)
      else
         call count_figure(self, ok, self%rounded)
      end if
      call print_row(item, printed, computed, &
         & merge('FAILS    ', merge('explained', 'round-off', wrong), .not. ok), reason)
   end subroutine table_rounding

   !> A further check, of a value that is no figure of the table
   subroutine table_holds(self, item, computed, expected, accept, reason)
      class(paper_table_type), intent(inout) :: self
      character(len=*), intent(in) :: item
      real(wp), intent(in) :: computed, expected
      real(wp), intent(in) :: accept                        !! |computed - expected|
      character(len=*), intent(in), optional :: reason
      character(len=25) :: shown
      logical :: ok
      ok = within(computed, expected, '', accept)
      if (ok) then
         self%held = self%held + 1
      else
         self%failed = self%failed + 1
      end if
      write (shown, '(g0.15)') expected
      call print_row(item, '('//trim(shown)//')', computed, merge('holds', 'FAILS', ok), reason, expected)
   end subroutine table_holds

   !> The last two lines: a verdict, and counts for the test runner
   subroutine table_close(self)
      class(paper_table_type), intent(in) :: self
      print '(a, ": ", i0, " figures, ", i0, " agree, ", i0, " within round-off, ", i0, &
         & " wrong in print and explained, ", i0, " fail")', trim(self%name), &
         & self%agreed + self%rounded + self%explained_count + self%failed_figures, &
         & self%agreed, self%rounded, self%explained_count, self%failed_figures
      print '(i0, " passed, ", i0, " failed")', &
         & self%agreed + self%rounded + self%explained_count + self%held, self%failed
      if (self%failed > 0) stop 1
   end subroutine table_close

   subroutine count_figure(self, ok, counter)
      class(paper_table_type), intent(inout) :: self
      logical, intent(in) :: ok
      integer, intent(inout) :: counter
      if (ok) then
         counter = counter + 1
      else
         self%failed = self%failed + 1
         self%failed_figures = self%failed_figures + 1
      end if
   end subroutine count_figure

   logical function within(computed, target, shown, accept, exact, accept_exact)
      real(wp), intent(in) :: computed, target
      character(len=*), intent(in) :: shown
      real(wp), intent(in), optional :: accept, exact, accept_exact
      real(wp) :: allowed
      within = ieee_is_finite(computed)
      if (.not. within) return
      if (present(accept)) then
         allowed = accept
      else
         allowed = last_digit(shown)
         if (present(accept_exact)) allowed = allowed + accept_exact
      end if
      within = abs(computed - target) <= allowed
      if (present(exact)) within = within .and. abs(computed - exact) <= accept_exact
   end function within

   subroutine print_row(item, printed, computed, verdict, reason, expected)
      character(len=*), intent(in) :: item, printed
      real(wp), intent(in) :: computed
      character(len=*), intent(in) :: verdict
      character(len=*), intent(in), optional :: reason
      real(wp), intent(in), optional :: expected     !! where nothing is printed in the paper
      character(len=23) :: figure
      real(wp) :: difference
      figure = printed
      if (present(expected)) then
         difference = computed - expected
      else
         difference = computed - value_of(printed)
      end if
      print '(2x, a, t46, a, t71, es23.15, t95, es10.2, t107, a)', item, adjustr(figure), computed, difference, verdict
      if (present(reason)) print '(6x, a)', reason
   end subroutine print_row

   !> The number that a figure stands for
   pure real(wp) function value_of(figure)
      character(len=*), intent(in) :: figure
      read (figure, *) value_of
   end function value_of

   !> One unit of the last printed digit
   pure real(wp) function last_digit(figure)
      character(len=*), intent(in) :: figure
      integer :: mantissa, point, exponent
      mantissa = scan(figure, 'eE') - 1
      exponent = 0
      if (mantissa < 0) then
         mantissa = len_trim(figure)
      else
         read (figure(mantissa + 2:), *) exponent
      end if
      point = index(figure(:mantissa), '.')
      if (point > 0) exponent = exponent - (mantissa - point)
      last_digit = 10.0_wp**exponent
   end function last_digit
end module paper_table
