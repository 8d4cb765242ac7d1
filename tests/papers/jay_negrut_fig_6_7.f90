! SPDX-License-Identifier: BSD-3-Clause
!> Jay & Negrut's Figs. 6 and 7: velocity of the pin that holds the crank to the ground, by HHT-I3 and by HHT-SOI2,
!> alpha = -0.3, h = 2^-10; how the drift falls with h; with gravity; and without damping.
program jay_negrut_fig_6_7
   use dynstep_kinds, only: wp
   use dynstep_soi2, only: variant_index3, variant_soi2
   use dynstep_status, only: status_type
   use paper_table, only: jay_negrut_2008, last_digit, paper_table_type, value_of
   use pin_velocities, only: drive, pi, pin_recorder
   implicit none

   !> Where Newton's iteration stops, each velocity is left with at most 32 eps of the largest one, and the velocity of
   !> the pin is the sum of two of them
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)
   integer, parameter :: first = 7, last = 13
   character(len=*), parameter :: of_index3(first:last) = [character(len=7) :: '7.7e-5', '1.9e-5', '4.8e-6', '1.20e-6', &
      & '3.0e-7', '7.5e-8', '1.9e-8']
   real(wp), parameter :: earth = 9.81_wp
   type(paper_table_type) :: table
   type(pin_recorder) :: pin
   type(status_type) :: status
   real(wp) :: drift(first:last)
   character(len=32) :: item
   integer :: k

   call table%open_figure(jay_negrut_2008, 'Figs. 6, 7', 'largest velocity of pin O of the slider-crank, t in [0, 4]')
   call table%section('HHT-I3, Fig. 6: the paper shows a closed curve of the size 1e-6 for h = 2^-10')
   do k = first, last
      call drive(variant_index3, -0.3_wp, 0.0_wp, pi, 4.0_wp, 2.0_wp**(-k), pin, status)
      call stop_if_failed()
      drift(k) = pin%largest
      write (item, '("h = 2^-", i0)') k
      call compare(trim(item), of_index3(k), pin%largest)
      if (k == 10) call table%holds('of the second half over that of all', pin%late/pin%largest, 1.0_wp, 0.01_wp, &
         & 'it neither grows nor falls')
   end do
   do k = first + 1, last
      write (item, '("order from 2^-", i0, " to 2^-", i0)') k - 1, k
      call table%holds(trim(item), log(drift(k - 1)/drift(k))/log(2.0_wp), 2.0_wp, 0.05_wp)
   end do

   call table%section('HHT-SOI2, Fig. 7: the paper shows points within machine precision')
   call drive(variant_soi2, -0.3_wp, 0.0_wp, pi, 4.0_wp, 2.0_wp**(-10), pin, status)
   call stop_if_failed()
   call table%rounding('h = 2^-10', '3.7e-16', pin%largest, 0.0_wp, rounding*pin%fastest, &
      & 'what Newton''s iteration leaves')

   call table%section('With gravity, from a rate of 6 pi, t in [0, 2], h = 2^-10')
   call drive(variant_index3, -0.3_wp, earth, 6.0_wp*pi, 2.0_wp, 2.0_wp**(-10), pin, status)
   call stop_if_failed()
   call compare('HHT-I3', '2.7e-4', pin%largest)
   call drive(variant_soi2, -0.3_wp, earth, 6.0_wp*pi, 2.0_wp, 2.0_wp**(-10), pin, status)
   call stop_if_failed()
   call table%rounding('HHT-SOI2', '6.8e-15', pin%largest, 0.0_wp, rounding*pin%fastest, &
      & 'what Newton''s iteration leaves')

   call table%section('alpha = 0, no damping')
   call drive(variant_index3, 0.0_wp, 0.0_wp, pi, 4.0_wp, 2.0_wp**(-10), pin, status)
   call stop_if_failed()
   call compare('HHT-I3', '7.7e-5', pin%largest)
   call drive(variant_soi2, 0.0_wp, 0.0_wp, pi, 4.0_wp, 2.0_wp**(-10), pin, status)
   call stop_if_failed()
   call table%rounding('HHT-SOI2', '3.7e-16', pin%largest, 0.0_wp, rounding*pin%fastest, 'stable')
   call drive(variant_soi2, 0.0_wp, earth, 6.0_wp*pi, 2.0_wp, 2.0_wp**(-10), pin, status)
   call stop_if_failed()
   call table%rounding('HHT-SOI2, with gravity', '6.8e-15', pin%largest, 0.0_wp, rounding*pin%fastest, 'stable')
   call drive(variant_index3, 0.0_wp, earth, 6.0_wp*pi, 2.0_wp, 2.0_wp**(-10), pin, status)
   call table%holds('HHT-I3, with gravity, fails', merge(1.0_wp, 0.0_wp, status%failed()), 1.0_wp, 0.0_wp, &
      & 'the index-3 form without damping is unstable: '//trim(status%message))
   call table%close()

contains

   !> To 2 %, or half a unit of a reference with two digits
   subroutine compare(what, reference, computed)
      character(len=*), intent(in) :: what, reference
      real(wp), intent(in) :: computed
      call table%agrees(what, reference, computed, accept=max(0.02_wp*value_of(reference), 0.5_wp*last_digit(reference)))
   end subroutine compare

   subroutine stop_if_failed()
      if (.not. status%failed()) return
      print '(a)', 'the run failed: '//trim(status%message)
      stop 1
   end subroutine stop_if_failed
end program jay_negrut_fig_6_7
