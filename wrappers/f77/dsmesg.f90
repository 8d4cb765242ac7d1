! SPDX-License-Identifier: BSD-3-Clause
!> DSMESG gives a few words for a code IDID of the other subroutines; they give whole sentences
!> themselves.
!>
!>      SUBROUTINE DSMESG (IDID, TEXT)
!>      INTEGER IDID
!>      CHARACTER*(*) TEXT
recursive subroutine dsmesg(idid, text)
   use dynstep_status, only: status_text
   implicit none
   integer, intent(in) :: idid
   character(len=*), intent(out) :: text
   text = status_text(idid)
end subroutine dsmesg
