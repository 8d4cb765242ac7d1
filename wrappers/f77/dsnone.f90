! SPDX-License-Identifier: BSD-3-Clause
!> DSNONE stands for an EXTERNAL subroutine that is not called: FORCE, MASS, TANG, LOAD, GCON, GJAC, KCON,
!> KJAC, OUT, JAC, EVENT, ACTION.
recursive subroutine dsnone()
   implicit none
end subroutine dsnone
