! SPDX-License-Identifier: BSD-3-Clause
!> A fault on purpose: data kept between calls, which tools/check_globals.py must find.
module planted_save
   implicit none
contains
   integer function count_calls()
      integer, save :: calls = 0
      calls = calls + 1
      count_calls = calls
   end function count_calls
end module planted_save
