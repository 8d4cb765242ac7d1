! SPDX-License-Identifier: BSD-3-Clause
!> Stability of extrapolated Newmark against an independent computation (binary128 scan with 1500
!> points a decade, bisection, checked with 40-digit arithmetic on both sides of each limit).
module test_stability
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_extrapolation_limit, only: extrapolation_limit
   use dynstep_extrapolation_stability, only: growth_per_step, safe_step, small_step_growth, stability_limit
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: diagonal_matrix, zero_matrix
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
   use dynstep_sequences, only: extrapolation_weights, sequence_bulirsch, sequence_custom, sequence_double_harmonic, &
      & sequence_harmonic, sequence_name, sequence_romberg, substep_numbers
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_stepper, only: clock_type, state_type
   use testing, only: check, error_type, new_unittest, unittest_type
   implicit none
   private

   public :: collect_stability

   real(wp), parameter :: none = huge(1.0_wp)
   real(wp), parameter :: quarter = 0.25_wp, sixth = 1.0_wp/6.0_wp, twelfth = 1.0_wp/12.0_wp

contains

   subroutine collect_stability(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('limits-undamped', test_undamped), &
         & new_unittest('limits-damping-0.02', test_damped_2), &
         & new_unittest('limits-damping-0.05', test_damped_5), &
         & new_unittest('limits-fox-goodwin', test_fox_goodwin), &
         & new_unittest('thresholds', test_thresholds), &
         & new_unittest('growth', test_growth), &
         & new_unittest('small-steps', test_small_steps), &
         & new_unittest('growth-of-a-run', test_run), &
         & new_unittest('safe-steps', test_safe_steps), &
         & new_unittest('stepper', test_stepper)]
   end subroutine collect_stability

   !> Limits of 1 to 8 levels of the three sequences
   subroutine check_limits(error, beta, damping_ratio, digits, romberg, bulirsch, double_harmonic)
      type(error_type), allocatable, intent(inout) :: error
      real(wp), intent(in) :: beta, damping_ratio
      integer, intent(in) :: digits                   !! of the reference
      real(wp), intent(in) :: romberg(8), bulirsch(8), double_harmonic(8)
      real(wp) :: expected(8, 3)
      integer, parameter :: sequences(3) = [sequence_romberg, sequence_bulirsch, sequence_double_harmonic]
      integer :: levels, i
      character(len=60) :: what

      expected = reshape([romberg, bulirsch, double_harmonic], [8, 3])
      do i = 1, 3
         do levels = 1, 8
            write (what, '("beta ", f7.5, " xi ", f5.3, " ", a, " P ", i0)') beta, damping_ratio, &
               & trim(sequence_name(sequences(i))), levels
            call check(error, stability_limit(numbers_of(sequences(i), levels), beta, damping_ratio), &
               & expected(levels, i), what, thr=10.0_wp**(1 - digits), rel=.true.)
            if (allocated(error)) return
         end do
      end do
   end subroutine check_limits

   function numbers_of(sequence, levels) result(numbers)
      integer, intent(in) :: sequence, levels
      integer, allocatable :: numbers(:), custom(:)
      type(status_type) :: status
      call substep_numbers(sequence, levels, custom, numbers, status)
   end function numbers_of

   subroutine test_undamped(error)
      type(error_type), allocatable, intent(out) :: error
      call check_limits(error, quarter, 0.0_wp, 10, &
         & [none, 0.0323795296_wp, 0.1255569569_wp, 0.3315968646_wp, &
         & 0.7197433047_wp, 1.41324157_wp, 2.673499257_wp, 24.9526177_wp], &
         & [none, 0.0323795296_wp, 0.1255569569_wp, 0.3129439682_wp, &
         & 0.6089882119_wp, 1.050051093_wp, 1.664174171_wp, 2.55457302_wp], &
         & [none, 0.05139805314_wp, 0.1964602979_wp, 0.4737977538_wp, &
         & 0.8908878975_wp, 1.447056625_wp, 2.147815675_wp, 3.028320818_wp])
      call check_limits(error, sixth, 0.0_wp, 10, &
         & [3.464101615_wp, 3.120874568_wp, 0.1514938289_wp, 0.4170212806_wp, &
         & 0.8802772474_wp, 1.73529036_wp, 3.272668162_wp, 6.634623983_wp], &
         & [3.464101615_wp, 3.120874568_wp, 0.1514938289_wp, 0.3936038501_wp, &
         & 0.7453678641_wp, 1.290960419_wp, 2.034785768_wp, 3.125833152_wp], &
         & [6.92820323_wp, 0.1527293706_wp, 0.2370643046_wp, 0.5943104513_wp, &
         & 1.089613859_wp, 1.774167727_wp, 2.629033229_wp, 3.693258183_wp])
   end subroutine test_undamped

   subroutine test_damped_2(error)
      type(error_type), allocatable, intent(out) :: error
      call check_limits(error, quarter, 0.02_wp, 10, &
         & [none, 2.488135667_wp, 4.039578537_wp, 6.737963968_wp, &
         & 11.22533038_wp, 18.92753118_wp, 330.7891324_wp, 1675.781305_wp], &
         & [none, 2.488135667_wp, 4.039578537_wp, 6.031329839_wp, &
         & 8.271689864_wp, 11.15273098_wp, 14.47573589_wp, 18.74454317_wp], &
         & [none, 4.081641769_wp, 6.00154373_wp, 8.239002282_wp, &
         & 10.64875557_wp, 13.17492278_wp, 15.77404643_wp, 18.40167937_wp])
      call check_limits(error, sixth, 0.02_wp, 10, &
         & [3.464101615_wp, 3.123459317_wp, 6.15390398_wp, 9.403432372_wp, &
         & 15.6649071_wp, 28.42028863_wp, 40.7126769_wp, 60.03190921_wp], &
         & [3.464101615_wp, 3.123459317_wp, 6.15390398_wp, 9.344557421_wp, &
         & 10.9341573_wp, 14.05166851_wp, 18.42228956_wp, 23.54257063_wp], &
         & [6.92820323_wp, 6.307821006_wp, 9.415812054_wp, 10.92629106_wp, &
         & 13.59993841_wp, 16.80499033_wp, 21.20178332_wp, 24.14556818_wp])
   end subroutine test_damped_2

   subroutine test_damped_5(error)
      type(error_type), allocatable, intent(out) :: error
      call check_limits(error, quarter, 0.05_wp, 10, &
         & [none, 3.456796704_wp, 5.326378442_wp, 8.731888106_wp, &
         & 15.37992237_wp, 284.3586037_wp, 1158.115015_wp, 4652.930147_wp], &
         & [none, 3.456796704_wp, 5.326378442_wp, 7.564273803_wp, &
         & 9.945890671_wp, 13.04667459_wp, 16.57191939_wp, 21.28235886_wp], &
         & [none, 5.61517348_wp, 7.61504708_wp, 9.951032037_wp, &
         & 12.40256958_wp, 14.90460112_wp, 17.41842022_wp, 19.91475591_wp])
      call check_limits(error, sixth, 0.05_wp, 10, &
         & [3.464101615_wp, 3.178641568_wp, 6.216365521_wp, 12.77940895_wp, &
         & 18.68543602_wp, 30.97401915_wp, 45.9620142_wp, 61.906829_wp], &
         & [3.464101615_wp, 3.178641568_wp, 6.216365521_wp, 9.481494579_wp, &
         & 12.93941206_wp, 15.73627707_wp, 20.85980276_wp, 29.24614754_wp], &
         & [6.92820323_wp, 6.394770765_wp, 9.565088448_wp, 12.95540344_wp, &
         & 15.35887265_wp, 19.16991213_wp, 22.69991046_wp, 26.23778802_wp])
   end subroutine test_damped_5

   !> The reference prints 6.956949 for the last entry; 50-digit arithmetic gives a growth of 1.2e-11
   !> there and of 1.0e-12 at 6.956749.  At omega h = pi and 2 pi there are windows of growth that
   !> are narrower than 1e-6 (Romberg P = 6: 4.6e-9 over a width of 1.2e-8); they do not count.
   subroutine test_fox_goodwin(error)
      type(error_type), allocatable, intent(out) :: error
      call check_limits(error, twelfth, 0.0_wp, 6, &
         & [2.449490_wp, 2.807330_wp, 0.135077_wp, 3.140293_wp, &
         & 0.806376_wp, 3.508781_wp, 7.346433_wp, 5.528880_wp], &
         & [2.449490_wp, 2.807330_wp, 0.135077_wp, 3.139246_wp, &
         & 0.682979_wp, 3.505846_wp, 1.891627_wp, 3.464546_wp], &
         & [4.898979_wp, 2.947192_wp, 0.211680_wp, 2.622649_wp, &
         & 1.025505_wp, 2.580675_wp, 3.381609_wp, 6.956749_wp])
   end subroutine test_fox_goodwin

   !> Softer thresholds, beta = 1/4 without damping
   subroutine test_thresholds(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: soft = 1.0e-6_wp, softer = 1.0e-3_wp
      call compare([1, 2], 0.3259095_wp, 1.09587_wp)
      call compare([1, 2, 4], 0.7202523_wp, 1.873151_wp)
      call compare([1, 2, 4, 8], 1.388152_wp, 3.169796_wp)
      call compare([1, 2, 4, 6], 1.303956_wp, 2.948352_wp)
      call compare([2, 4, 6, 8, 10, 12], 4.297628_wp, 8.060065_wp)

   contains

      subroutine compare(numbers, at_soft, at_softer)
         integer, intent(in) :: numbers(:)
         real(wp), intent(in) :: at_soft, at_softer
         call check(error, stability_limit(numbers, quarter, 0.0_wp, soft), at_soft, thr=1.0e-6_wp, rel=.true.)
         call check(error, stability_limit(numbers, quarter, 0.0_wp, softer), at_softer, thr=1.0e-6_wp, rel=.true.)
      end subroutine compare
   end subroutine test_thresholds

   !> Far out: |1 - 2 w(1)| where n(1) = 1, and the worst places of the reference
   subroutine test_growth(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp) :: w(6)
      integer :: levels
      do levels = 2, 6
         w(:levels) = extrapolation_weights(numbers_of(sequence_romberg, levels))
         call check(error, growth_per_step(numbers_of(sequence_romberg, levels), quarter, 0.0_wp, 1.0e8_wp), &
            & abs(1.0_wp - 2.0_wp*w(1)) - 1.0_wp, 'z = 1e8', thr=1.0e-7_wp)
      end do
      call check(error, growth_per_step([1, 2, 4, 8], quarter, 0.0_wp, 14.13_wp), 0.9486_wp, thr=1.0e-4_wp)
      call check(error, growth_per_step([1, 2, 4, 6, 8], quarter, 0.0_wp, 29.47_wp), 5.287_wp, thr=1.0e-3_wp)
      call check(error, growth_per_step([2, 4, 6, 8], quarter, 0.0_wp, 29.51_wp), 5.141_wp, thr=1.0e-3_wp)
      call check(error, growth_per_step([2, 4], quarter, 0.0_wp, 1.0e8_wp), 5.12e-14_wp, thr=1.0e-3_wp, rel=.true.)
      ! the trapezoid turns, it does not grow; the paper's run grows by 4e-17 a step
      call check(error, growth_per_step([1], quarter, 0.0_wp, 0.7_wp), 0.0_wp, thr=1.0e-30_wp)
      call check(error, growth_per_step([1, 2, 4, 8], quarter, 0.0_wp, 0.12_wp), 3.974e-17_wp, &
         & thr=1.0e-3_wp, rel=.true.)
      call check(error, growth_per_step([(2**levels, levels=0, 7)], sixth, 0.0_wp, 1.0e8_wp), 2.0e73_wp, &
         & thr=0.5_wp, rel=.true.)
   end subroutine test_growth

   !> Exact values of C, and the growth of small steps with every kind of sequence
   subroutine test_small_steps(error)
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: z = 0.01_wp
      integer :: levels, sequence
      real(wp) :: c
      real(wp), parameter :: expected(2:6, 4) = reshape([ &
         & 1/144.0_wp, 1/480.0_wp, 71/134400.0_wp, 31/241920.0_wp, 3043/99348480.0_wp, &
         & 0.0_wp, 1/2160.0_wp, 1/18900.0_wp, 1/90720.0_wp, 101/62868960.0_wp, &
         & -1/144.0_wp, 1/864.0_wp, -11/57600.0_wp, 67/2177280.0_wp, -3593/731566080.0_wp, &
         & -1/72.0_wp, 1/240.0_wp, -3/2800.0_wp, 1/3780.0_wp, -5/77616.0_wp], [5, 4])
      do levels = 2, 6
         call check(error, small_step_growth(levels, quarter), expected(levels, 1), thr=1.0e-14_wp, rel=.true.)
         call check(error, small_step_growth(levels, sixth), expected(levels, 2), thr=1.0e-17_wp)
         call check(error, small_step_growth(levels, twelfth), expected(levels, 3), thr=1.0e-14_wp, rel=.true.)
         call check(error, small_step_growth(levels, 0.0_wp), expected(levels, 4), thr=1.0e-14_wp, rel=.true.)
         do sequence = sequence_romberg, sequence_double_harmonic
            associate (numbers => numbers_of(sequence, levels))
               c = expected(levels, 1)*z**(2*levels + 2)/product(real(numbers, wp)**2)
               if (c < 1.0e-29_wp) cycle              ! lost in twice the precision, too
               call check(error, 2.0_wp*growth_per_step(numbers, quarter, 0.0_wp, z), c, sequence_name(sequence), &
                  & thr=1.0e-3_wp, rel=.true.)
            end associate
         end do
      end do
      ! beta = 1/6, P = 2: no growth at all with 1, 2 up to 3.12
      call check(error, growth_per_step([1, 2], sixth, 0.0_wp, 3.0_wp), 0.0_wp, thr=1.0e-15_wp)   ! 1/6 is rounded
      call check(error, growth_per_step([2, 4], sixth, 0.0_wp, 0.5_wp) > 1.0e-12_wp, '2, 4 grows')
   end subroutine test_small_steps

   !> The energy of a run of the library grows as the theory says.  With beta = 1/4 the map is a
   !> turn and a stretch, so each step multiplies the energy by (1 + growth)^2.
   subroutine test_run(error)
      type(error_type), allocatable, intent(out) :: error
      type(extrapolation_stepper) :: stepper
      type(linear_system) :: sys
      type(state_type) :: state
      type(clock_type) :: clock
      type(status_type) :: status
      integer, parameter :: steps = 1000
      real(wp), parameter :: omega = 4.0_wp, h = 0.125_wp
      real(wp) :: expected

      call sys%set(diagonal_matrix([1.0_wp]), zero_matrix(1), diagonal_matrix([omega**2]), status)
      allocate (newmark_stepper :: stepper%base)
      stepper%levels = 2
      call stepper%init(sys, status)
      state%y = [1.0_wp, 0.0_wp]
      call stepper%start(sys, state, status)
      clock%h = h
      call stepper%advance(sys, state, clock, steps, status, complete=.true.)
      call check(error, .not. status%failed(), status%message)
      if (allocated(error)) return
      expected = (1.0_wp + growth_per_step([1, 2], quarter, 0.0_wp, omega*h))**(2*steps)
      call check(error, expected > 1.02_wp, 'the growth can be seen')
      call check(error, state%y(1)**2 + (state%y(2)/omega)**2, expected, thr=1.0e-11_wp)
   end subroutine test_run

   !> The limit of a stepper as it is set, and what is refused
   subroutine test_stepper(error)
      type(error_type), allocatable, intent(out) :: error
      type(extrapolation_stepper) :: stepper
      type(status_type) :: status
      real(wp) :: limit

      allocate (midpoint_stepper :: stepper%base)
      stepper%sequence = sequence_custom
      stepper%custom = [1, 2, 4]
      stepper%levels = 3
      call extrapolation_limit(stepper, 0.02_wp, limit, status)
      call check(error, limit, 4.039578537_wp, 'midpoint', thr=1.0e-8_wp)

      deallocate (stepper%base)
      allocate (stepper%base, source=newmark_stepper(beta=0.0_wp))
      stepper%sequence = sequence_harmonic
      stepper%levels = 1
      call extrapolation_limit(stepper, 0.0_wp, limit, status)
      call check(error, limit, 2.0_wp, 'central differences', thr=1.0e-5_wp)
      call check(error, .not. status%failed(), status%message)

      call extrapolation_limit(stepper, -0.1_wp, limit, status)
      call check(error, status%code, dynstep_invalid_input, 'negative damping')
      call status%clear()
      deallocate (stepper%base)
      call extrapolation_limit(stepper, 0.0_wp, limit, status)
      call check(error, status%code, dynstep_invalid_input, 'no base')
      call status%clear()
      allocate (stepper%base, source=newmark_stepper(gamma=0.6_wp))
      call extrapolation_limit(stepper, 0.0_wp, limit, status)
      call check(error, status%code, dynstep_invalid_input, 'gamma')
   end subroutine test_stepper

   !> A step that is called safe lies below the limit
   subroutine test_safe_steps(error)
      type(error_type), allocatable, intent(out) :: error
      integer, parameter :: sequences(4) = [sequence_romberg, sequence_bulirsch, sequence_harmonic, sequence_double_harmonic]
      real(wp), parameter :: betas(5) = [0.0_wp, twelfth, sixth, 0.2_wp, quarter], growths(2) = [1.0e-12_wp, 1.0e-4_wp]
      integer, allocatable :: numbers(:), custom(:)
      type(status_type) :: status
      integer :: i, j, k, levels
      do i = 1, size(sequences)
         do levels = 2, merge(8, 12, i <= 2), 2
            if (allocated(numbers)) deallocate (numbers)
            call substep_numbers(sequences(i), levels, custom, numbers, status)
            do j = 1, size(betas)
               do k = 1, size(growths)
                  associate (z => safe_step(numbers, betas(j), growths(k)))
                     call check(error, stability_limit(numbers, betas(j), 0.0_wp, growths(k)) >= z, 'safe step')
                     call check(error, growth_per_step(numbers, betas(j), 0.0_wp, z) <= growths(k), 'growth there')
                     call check(error, z > 1.0e-3_wp, 'no needless work')
                  end associate
               end do
            end do
            if (allocated(error)) return
         end do
      end do
   end subroutine test_safe_steps
end module test_stability
