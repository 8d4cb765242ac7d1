! SPDX-License-Identifier: BSD-3-Clause
!> Prints the table of methods of the README, from method_properties.
program methods_table
   use dynstep
   implicit none
   class(stepper_type), allocatable :: stepper
   type(method_properties) :: facts
   type(status_type) :: status
   integer :: i

   print '(a)', '| method | Austin 1991 | order of q, v | of a | of error estimate | solves a step | symmetric ' &
      & //'| stable up to omega h |'
   print '(a)', '| --- | --- | --- | --- | --- | --- | --- | --- |'
   do i = 1, size(method_names)
      call new_method(method_names(i), stepper, status)
      if (status%failed()) error stop 'a name of the list is unknown to new_method'
      facts = stepper%properties()
      print '(3a, 4(a, " | "), i0, 4a)', '| `', trim(method_names(i)), '` | ', place(facts%source), &
         & number(facts%order), number(facts%acceleration_order), number(facts%error_order), facts%stages, ' | ', &
         & trim(merge('yes', 'no ', facts%symmetric)), ' | ', trim(limit(facts%stability_limit))//' |'
   end do

contains

   !> Sections and equations of the paper
   function place(source) result(words)
      character(len=*), intent(in) :: source
      character(len=:), allocatable :: words
      character(len=*), parameter :: paper = 'Austin 1991, '
      words = trim(source)
      if (index(words, paper) == 1) words = words(len(paper) + 1:)
   end function place

   function number(n) result(words)
      integer, intent(in) :: n
      character(len=:), allocatable :: words
      character(len=12) :: digits
      write (digits, '(i0)') n
      words = trim(digits)
      if (n == 0) words = '-'
   end function number

   function limit(omega_h) result(words)
      real(wp), intent(in) :: omega_h
      character(len=:), allocatable :: words
      character(len=12) :: digits
      if (omega_h < 0.0_wp) then
         words = 'see below'
      else if (omega_h >= huge(omega_h)) then
         words = 'any'
      else
         write (digits, '(f0.4)') omega_h
         words = trim(digits)
      end if
   end function limit
end program methods_table
