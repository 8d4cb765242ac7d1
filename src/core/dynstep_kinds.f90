! SPDX-License-Identifier: BSD-3-Clause
!> Kinds of numbers, used by every other file.
module dynstep_kinds
   use, intrinsic :: iso_fortran_env, only: int64, real64
   implicit none
   private

   !> Working precision: IEEE binary64
   integer, parameter, public :: wp = real64
   !> Kind of step numbers and counters, which outgrow 32 bits in long runs
   integer, parameter, public :: long = int64
end module dynstep_kinds
