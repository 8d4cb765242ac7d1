! SPDX-License-Identifier: BSD-3-Clause
!> Prints tables of the pages, from what the library knows of itself:
!>
!>   tables methods            facts about all methods
!>   tables limits BETA XI     stability limits of extrapolations, 1 to 8 levels; BETA 1/4, 1/6, 1/12, 0
!>   tables sums               substeps and sums of |weights|, 1 to 8 levels
program tables
   use dynstep
   use dynstep_sequences, only: extrapolation_weights, sequence_name, substep_numbers
   implicit none
   integer, parameter :: sequences(4) = [sequence_harmonic, sequence_double_harmonic, sequence_bulirsch, &
      & sequence_romberg]
   integer, parameter :: levels = 8

   select case (argument(1))
   case ('methods')
      call print_methods()
   case ('limits')
      call print_limits(ratio(argument(2)), ratio(argument(3)))
   case ('sums')
      call print_sums()
   case default
      error stop 'there is no such table'
   end select

contains

   subroutine print_methods()
      class(stepper_type), allocatable :: stepper
      type(method_properties) :: facts
      type(status_type) :: status
      integer :: i
      print '(a)', '| method | source | order of q, v | of a | of lambda, psi | of error estimate | solves a step ' &
         & //'| symmetric | stable up to omega h |', '| --- | --- | --- | --- | --- | --- | --- | --- | --- |'
      do i = 1, size(method_names)
         call new_method(method_names(i), stepper, status)
         if (status%failed()) error stop 'a name of the list is unknown to new_method'
         facts = stepper%properties()
         print '(*(a))', '| `', trim(method_names(i)), '` | ', trim(facts%source), ' | ', number(facts%order), &
            & ' | ', number(facts%acceleration_order), ' | ', number(facts%multiplier_order), ' | ', &
            & number(facts%error_order), ' | ', number(facts%stages), ' | ', trim(merge('yes', 'no ', facts%symmetric)), &
            & ' | ', limit_of(stepper, facts%stability_limit), ' |'
      end do
   end subroutine print_methods

   !> What properties tell, or what the analysis finds for an extrapolation, without damping
   function limit_of(stepper, known) result(words)
      class(stepper_type), intent(in) :: stepper
      real(wp), intent(in) :: known
      character(len=:), allocatable :: words
      type(status_type) :: status
      real(wp) :: limit
      limit = known
      select type (stepper)
      type is (extrapolation_stepper)
         call extrapolation_limit(stepper, 0.0_wp, limit, status)
         words = figures(limit, 4)//' (growth < 1e-12)'
         if (status%failed()) words = '-'
      class default
         words = figures(limit, 4)
         if (limit < 0.0_wp) words = '-'
      end select
   end function limit_of

   subroutine print_limits(beta, damping_ratio)
      real(wp), intent(in) :: beta, damping_ratio
      integer :: p, i
      call print_heading(1)
      do p = 1, levels
         print '(*(a))', '| ', number(p), (' | '//figures(stability_limit(numbers(sequences(i), p), &
            & beta, damping_ratio), 4), i=1, size(sequences)), ' |'
      end do
   end subroutine print_limits

   subroutine print_sums()
      integer :: p, i
      call print_heading(2)
      do p = 1, levels
         print '(*(a))', '| ', number(p), (' | '//number(sum(numbers(sequences(i), p)))//' | ' &
            & //figures(sum(abs(extrapolation_weights(numbers(sequences(i), p)))), 1), i=1, size(sequences)), ' |'
      end do
   end subroutine print_sums

   !> One or two columns for each sequence
   subroutine print_heading(columns)
      integer, intent(in) :: columns
      character(len=28) :: names(2, size(sequences))
      integer :: i
      do i = 1, size(sequences)
         names(1, i) = sequence_name(sequences(i))
      end do
      names(2, :) = names(1, :)
      if (columns == 2) then
         do i = 1, size(sequences)
            names(:, i) = [character(len=28) :: trim(names(1, i))//': substeps', 'sum of abs(w)']
         end do
      end if
      print '(*(a))', '| P', (' | '//trim(names(1 + mod(i, columns), 1 + i/columns)), i=0, columns*size(sequences) - 1), ' |'
      print '(*(a))', '| ---', (' | ---', i=1, columns*size(sequences)), ' |'
   end subroutine print_heading

   function numbers(sequence, p)
      integer, intent(in) :: sequence, p
      integer, allocatable :: numbers(:), custom(:)
      type(status_type) :: status
      call substep_numbers(sequence, p, custom, numbers, status)
   end function numbers

   function argument(i) result(word)
      integer, intent(in) :: i
      character(len=16) :: word
      call get_command_argument(i, word)
   end function argument

   !> The value of 'a/b' or 'a'
   function ratio(word) result(value)
      character(len=*), intent(in) :: word
      real(wp) :: value, denominator
      integer :: slash
      slash = index(word, '/')
      denominator = 1.0_wp
      if (slash > 0) read (word(slash + 1:), *) denominator
      if (slash == 0) slash = len(word) + 1
      read (word(:slash - 1), *) value
      value = value/denominator
   end function ratio

   function number(n) result(words)
      integer, intent(in) :: n
      character(len=:), allocatable :: words
      character(len=12) :: buffer
      write (buffer, '(i0)') n
      words = trim(buffer)
      if (n == 0) words = '-'
   end function number

   function figures(x, decimals) result(words)
      real(wp), intent(in) :: x
      integer, intent(in) :: decimals
      character(len=:), allocatable :: words
      character(len=16) :: buffer, form
      write (form, '("(f16.", i0, ")")') decimals
      words = 'any'
      if (x >= huge(x)) return
      write (buffer, form) x
      words = trim(adjustl(buffer))
   end function figures
end program tables
