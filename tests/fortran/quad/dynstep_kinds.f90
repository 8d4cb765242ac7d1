! SPDX-License-Identifier: BSD-3-Clause
!> The library's kinds with 34 digits instead of 16, for tests that need room between
!> truncation and rounding errors.  The library's other files are compiled unchanged.
module dynstep_kinds
   use, intrinsic :: iso_fortran_env, only: int64, real128
   implicit none
   private

   integer, parameter, public :: wp = real128
   integer, parameter, public :: long = int64
end module dynstep_kinds
