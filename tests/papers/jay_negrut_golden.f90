! SPDX-License-Identifier: BSD-3-Clause
!> Steps of SOI2 and of the index-3 baseline against data/jay_negrut_golden.txt, the values of an independent
!> 40-digit evaluation of the step equations (Jay & Negrut 2008, eqs. (13), (14), (17)).
!>
!>   jay_negrut_golden FILE
!>
!> Differences are relative to max(1, |value|), component by component: y and z to 1e-13, a_{1+alpha}, lambda, psi
!> to 1e-11.  Besides:
!>   a_used    a_alpha of the step, as state%a = a_{1+alpha} - alpha (a_{1+alpha} - a_alpha) tells it, to 1e-11
!>   ma_used   M_alpha a_alpha of the step, as (13e) tells it when all else in it is evaluated anew:
!>             alpha_m M_alpha a_alpha = (1 - alpha_f) F1 + alpha_f F0 - (1 - alpha_m) M_{1+alpha} a_{1+alpha}.
!>             Multipliers that are right to 1e-11 give it to 1e-11 (|dr/dlambda| |lambda| + |dr/dpsi| |psi|)/|alpha_m|.
program jay_negrut_golden
   use dynstep_alpha_coefficients, only: coefficients_of, hht_coefficients
   use dynstep_constrained_motion, only: constrained_motion
   use dynstep_jay_negrut_problem, only: jay_negrut_problem
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_rod_pendulum, only: rod_pendulum
   use dynstep_soi2, only: mass_recomputed, mass_stored, soi2_stepper, start_refuse, variant_index3, variant_soi2
   use dynstep_status, only: status_type
   use dynstep_stepper, only: allocate_state, state_type, step_counters
   implicit none

   character(len=*), parameter :: names(7) = [character(len=7) :: 'y', 'z', 'a', 'lambda', 'psi', 'a_used', 'ma_used']
   real(wp), parameter :: of_y = 1.0e-13_wp, of_a = 1.0e-11_wp
   class(mechanical_system), allocatable :: sys
   type(soi2_stepper) :: stepper
   type(constrained_motion) :: motion
   type(step_counters) :: count
   type(state_type) :: state, trial
   type(status_type) :: status
   character(len=512) :: line
   character(len=16) :: word
   real(wp) :: times(2), largest(7), accept(7)
   real(wp), allocatable :: a(:), ma(:), a_used(:)
   integer :: unit, ios, passed, failed, step, values

   call get_command_argument(1, line)
   open (newunit=unit, file=trim(line), status='old', action='read')
   passed = 0
   failed = 0
   step = 0
   values = 0
   largest = 0.0_wp
   do
      read (unit, '(a)', iostat=ios) line
      if (ios /= 0) exit
      if (line(1:1) == '#') cycle
      read (line, *) word
      select case (word)
      case ('case')
         call close_step()
         call begin(trim(line))
      case ('step')
         call close_step()
         read (line, *) word, times
         call take_step(times(1), times(2))
      case default
         call compare(trim(word), trim(line))
      end select
   end do
   call close_step()
   close (unit)
   print '(i0, " passed, ", i0, " failed")', passed, failed
   ! three cases of 6 steps with 12 numbers, one of 6 with 17, two of 5 with 14
   if (failed > 0 .or. values /= 458) stop 1

contains

   !> A case: its problem, its method, its start
   subroutine begin(text)
      character(len=*), intent(in) :: text
      character(len=16) :: words(7)
      real(wp) :: parameter
      read (text, *) words
      read (words(5), *) parameter
      print '(a)', text
      print '(2x, a4, 7a12)', 'step', names
      step = 0
      if (allocated(sys)) deallocate (sys)
      state%t = 0.0_wp
      stepper = soi2_stepper(second_order_start=.false., start_mode=start_refuse)
      if (words(4) == 'soi2') then
         call coefficients_of(parameter, stepper%coefficients, status)
      else
         call hht_coefficients(parameter, stepper%coefficients, status)
      end if
      stepper%variant = merge(variant_index3, variant_soi2, words(4) == 'hht-i3')
      stepper%mass_at = merge(mass_recomputed, mass_stored, words(6) == 'recomputed')
      stepper%adjust_acceleration = words(7) == 'adjusted'
      stepper%adjust_momentum = stepper%adjust_acceleration
      if (words(3) == 'pendulum') then
         call begin_pendulum()
      else
         call begin_test_problem()
      end if
      call stepper%start(sys, state, status)
      call allocate_state(sys, trial, status)
      call motion%init(sys, status)
      call stop_if_failed()
      if (allocated(a)) deallocate (a, ma, a_used)
      allocate (a(sys%n), ma(sys%n), a_used(sys%n))
   end subroutine begin

   subroutine begin_test_problem()
      type(jay_negrut_problem) :: problem
      call problem%setup()
      allocate (sys, source=problem)
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      call stop_if_failed()
      state%y = [1.0_wp, 1.0_wp, 1.0_wp, -2.0_wp]
      state%lambda = 1.0_wp
      state%psi = 1.0_wp
   end subroutine begin_test_problem

   subroutine begin_pendulum()
      type(rod_pendulum) :: pendulum
      real(wp) :: q(3), v(3)
      call pendulum%setup()
      call pendulum%start(1.5_wp*acos(-1.0_wp), 10.0_wp, q, v)
      allocate (sys, source=pendulum)
      call stepper%init(sys, status)
      call allocate_state(sys, state, status)
      call stop_if_failed()
      state%t = 0.0_wp
      state%y = [q, v]
   end subroutine begin_pendulum

   !> One step, with a_{1+alpha} and what a_alpha and M_alpha a_alpha it was made with
   subroutine take_step(h, t1)
      real(wp), intent(in) :: h, t1
      type(matrix_type) :: mass
      real(wp) :: alpha
      integer :: ierr
      step = step + 1
      call stepper%try_step(sys, state, h, t1, trial, status)
      call stop_if_failed()
      call stepper%accept(state, trial)        ! now `trial` is the state before it
      call stepper%last_a_alpha(a)
      alpha = stepper%coefficients%alpha()
      a_used = a - (a - state%a)/alpha
      associate (n => sys%n, s => sys%structure, c => stepper%coefficients, y0 => trial%y)
         call mass%init(s%mass, n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         call stop_if_failed()
         call mass%set_zero()
         call sys%mass(trial%t + (1.0_wp + alpha)*h, y0(1:n) + ((1.0_wp + alpha)*h)*y0(n + 1:), y0(n + 1:), mass, ierr)
         ma = (1.0_wp - c%alpha_f)*forces(state) + c%alpha_f*forces(trial)
         call mass%multiply_add(c%alpha_m - 1.0_wp, a, ma)
         accept = [of_y, of_y, of_a, of_a, of_a, of_a, of_a]
         if (abs(c%alpha_m) > 0.0_wp) then
            ma = ma/c%alpha_m
            accept(7) = max(1.0_wp, size_of_reactions()/abs(c%alpha_m))*of_a
         end if
      end associate
      largest = 0.0_wp
   end subroutine take_step

   !> f + r
   function forces(point) result(f)
      type(state_type), intent(in) :: point
      real(wp) :: f(sys%n)
      integer :: ierr
      associate (n => sys%n)
         call sys%force(point%t, point%y(1:n), point%y(n + 1:), f, ierr)
         call motion%evaluate(sys, point%t, point%y(1:n), point%y(n + 1:), count, status)
         call motion%add_reaction(sys, point%t, point%y(1:n), point%y(n + 1:), 1.0_wp, point%lambda, point%psi, f, status)
      end associate
      call stop_if_failed()
   end function forces

   !> What relative errors of the multipliers do to r, where r is not linear in them; else 1
   function size_of_reactions() result(largest_row)
      real(wp) :: largest_row
      largest_row = 1.0_wp
      if (.not. sys%constraints%reaction_is_general) return
      associate (n => sys%n)
         call motion%differentiate_reaction(sys, state%t, state%y(1:n), state%y(n + 1:), state%lambda, state%psi, status)
      end associate
      call stop_if_failed()
      largest_row = maxval(matmul(abs(motion%rl), abs(state%lambda)) + matmul(abs(motion%rp), abs(state%psi)))
   end function size_of_reactions

   !> Values of the file against those of the step
   subroutine compare(name, text)
      character(len=*), intent(in) :: name, text
      associate (n => sys%n)
         select case (name)
         case ('y')
            call measure(1, text, state%y(1:n))
         case ('z')
            call measure(2, text, state%y(n + 1:))
         case ('a')
            call measure(3, text, a)
         case ('lambda')
            call measure(4, text, state%lambda)
         case ('psi')
            call measure(5, text, state%psi)
         case ('a_used')
            call measure(6, text, a_used)
         case ('ma_used')
            ! with alpha_m = 0 it has no part in the step
            if (abs(stepper%coefficients%alpha_m) > 0.0_wp) call measure(7, text, ma)
         case default
            print '(a)', 'the file has an unknown word: '//name
            stop 1
         end select
      end associate
   end subroutine compare

   subroutine measure(place, text, computed)
      integer, intent(in) :: place
      character(len=*), intent(in) :: text
      real(wp), intent(in) :: computed(:)
      real(wp) :: golden(size(computed))
      character(len=16) :: key
      read (text, *) key, golden
      values = values + size(golden)
      largest(place) = maxval(abs(computed - golden)/max(1.0_wp, abs(golden)))
   end subroutine measure

   !> The verdict on the step before
   subroutine close_step()
      logical :: ok
      if (step == 0) return
      ok = all(largest <= accept)
      if (ok) then
         passed = passed + 1
      else
         failed = failed + 1
      end if
      print '(2x, i4, 7es12.2, 2x, a)', step, largest, merge('agrees', 'FAILS ', ok)
   end subroutine close_step

   subroutine stop_if_failed()
      if (.not. status%failed()) return
      print '(a)', 'the run failed: '//trim(status%message)
      stop 1
   end subroutine stop_if_failed
end program jay_negrut_golden
