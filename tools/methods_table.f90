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
         & trim(merge('yes', 'no ', facts%symmetric)), ' | ', limit(stepper, facts%stability_limit)//' |'
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

   !> What properties tell, or what the analysis finds for an extrapolation, without damping
   function limit(stepper, known) result(words)
      class(stepper_type), intent(in) :: stepper
      real(wp), intent(in) :: known
      character(len=:), allocatable :: words
      real(wp) :: omega_h
      omega_h = known
      select type (stepper)
      type is (extrapolation_stepper)
         call extrapolation_limit(stepper, 0.0_wp, omega_h, status)
         words = figures(omega_h)//' (growth < 1e-12)'
      class default
         words = figures(omega_h)
         if (omega_h >= huge(omega_h)) words = 'any'
      end select
   end function limit

   function figures(x) result(words)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: words
      character(len=12) :: buffer
      write (buffer, '(f12.4)') x
      words = trim(adjustl(buffer))
   end function figures
end program methods_table
