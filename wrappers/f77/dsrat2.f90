! SPDX-License-Identifier: BSD-3-Clause
!> DSRAT2 reads a ground motion from a file in the .AT2 layout of PEER.
!>
!>      SUBROUTINE DSRAT2 (FILE, MAXNS, DT, NS, S, IDID, TEXT)
!>      INTEGER MAXNS, NS, IDID
!>      DOUBLE PRECISION DT, S(MAXNS)
!>      CHARACTER*(*) FILE, TEXT
!>
!>   FILE    its name
!>   MAXNS   room in S
!>   DT      out: sampling interval [s]
!>   NS      out: samples in the file; the first MIN(NS,MAXNS) are in S
!>   S       out: accelerations [g]
!>   IDID    out: 0 done, -1 MAXNS < 0, -11 the file cannot be used
!>   TEXT    out: blank where IDID = 0, else what is wrong with the file, and in which line
recursive subroutine dsrat2(file, maxns, dt, ns, s, idid, text)
   use dynstep_ground_motion, only: read_at2
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_invalid_input, status_type
   implicit none
   character(len=*), intent(in) :: file
   integer, intent(in) :: maxns
   real(wp), intent(out) :: dt
   integer, intent(out) :: ns
   real(wp), intent(inout) :: s(*)
   integer, intent(out) :: idid
   character(len=*), intent(out) :: text
   real(wp), allocatable :: values(:)
   type(status_type) :: status

   ns = 0
   dt = 0.0_wp
   if (maxns < 0) call status%set(dynstep_invalid_input, 'MAXNS must be 0 or more')
   call read_at2(trim(file), dt, values, status)
   if (.not. status%failed()) then
      ns = size(values)
      s(:min(ns, maxns)) = values(:min(ns, maxns))
   end if
   idid = status%code
   text = status%message
end subroutine dsrat2
