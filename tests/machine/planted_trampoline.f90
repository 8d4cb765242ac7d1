! SPDX-License-Identifier: BSD-3-Clause
!> A fault on purpose: an internal procedure that uses its host's variable is passed as an
!> argument, for which gfortran writes code onto the stack; tools/check_stack.py must find it.
recursive subroutine planted_trampoline(work, x)
   implicit none
   external :: work
   real, intent(inout) :: x
   call work(inner)
contains
   subroutine inner()
      x = x + 1.0
   end subroutine inner
end subroutine planted_trampoline
