! SPDX-License-Identifier: BSD-3-Clause
!> Stages of a rational step of y' = A y + b(t): of each pole p
!>
!>   d = sum w Re(tau x),   S x = h (A y + b_j),   S = h A - p,
!>
!> and of an explicit factor d = z (a y + b z y), z = hA.
!>
!> PROGRAMMING INTERFACE
!>
!>   call first%init(sys, stages, status)                    allocates
!>   call first%forget()                                     the factors
!>   call first%prepare(sys, stages, t, h, count, status)    factors of all poles; no work for the same h
!>   call first%stage(sys, stages, k, h, has_load, loads, y, d, count)     d of stage k at y, with the h of `prepare`
!>   call first%factor(sys, stages, k, h, has_load, loads, y, d)           d of explicit factor k
module dynstep_rational_first
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: wp
   use dynstep_linear_ode, only: linear_ode
   use dynstep_pole_stages, only: pole_stages_type
   use dynstep_rational_terms, only: add_loads, add_weighted, combine, multiply_both
   use dynstep_shifted_systems, only: shifted_systems_type
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   type, public :: rational_first
      type(shifted_systems_type), private :: systems
      real(wp), private :: h = 0.0_wp                      ! of the factors, 0: none
      real(wp), private :: remade_h = 0.0_wp               ! that of a run that goes on here, 0: none
      real(wp), allocatable, private :: ay(:)              ! A y [n]
      real(wp), allocatable, private :: inner(:)           ! a y + b z y of an explicit factor [n]
      complex(wp), allocatable, private :: x(:, :)         ! right-hand side of a pole [n, 1]
      complex(wp), allocatable, private :: bj(:)           ! b_j [n]
      complex(wp), allocatable, private :: residual(:, :)  ! of the refined form, like x
      real(wp), allocatable, private :: parts(:, :)        ! real and imaginary parts of x, and of A x [n, 4]
   contains
      procedure :: init => first_init
      procedure :: forget => first_forget
      procedure :: prepare => first_prepare
      procedure :: stage => first_stage
      procedure :: factor => first_factor
      procedure :: archive => first_archive
   end type rational_first

contains

   !> Room, in an object that is new
   recursive subroutine first_init(self, sys, stages, status)
      class(rational_first), intent(inout) :: self
      class(linear_ode), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      type(status_type), intent(inout) :: status
      integer :: stat
      call self%systems%init_first(sys%a, max(1, stages%poles), status)
      if (status%failed()) return
      allocate (self%ay(sys%n), self%inner(sys%n), self%x(sys%n, 1), self%bj(sys%n), stat=stat)
      if (stat == 0 .and. stages%is_refined) allocate (self%residual(sys%n, 1), self%parts(sys%n, 4), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a step of '//text(sys%n)//' unknowns')
   end subroutine first_init

   !> The matrix may have changed
   pure subroutine first_forget(self)
      class(rational_first), intent(inout) :: self
      self%h = 0.0_wp
      self%remade_h = 0.0_wp
   end subroutine first_forget

   !> Factors of all poles
   recursive subroutine first_prepare(self, sys, stages, t, h, count, status)
      class(rational_first), intent(inout) :: self
      class(linear_ode), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages     !! those of init, or others with the same poles in the same order
      real(wp), intent(in) :: t                        !! for sentences
      real(wp), intent(in) :: h
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      if (status%failed() .or. stages%poles == 0) return
      if (.not. abs(h - self%h) > 0.0_wp) return
      self%h = 0.0_wp
      call self%systems%factorize_first(sys%a, h, stages%pole, status, t)
      if (abs(h - self%remade_h) > 0.0_wp) count%factorizations = count%factorizations + stages%poles
      self%remade_h = 0.0_wp
      if (.not. status%failed()) self%h = h
   end subroutine first_prepare

   !> d = sum of w Re(tau x) over the poles of stage k
   recursive subroutine first_stage(self, sys, stages, k, h, has_load, loads, y, d, count)
      class(rational_first), intent(inout) :: self
      class(linear_ode), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      real(wp), intent(in) :: h
      logical, intent(in) :: has_load
      real(wp), intent(in), contiguous :: loads(:, :)  !! b at the nodes [n, nodes]
      real(wp), intent(in) :: y(sys%n)
      real(wp), intent(out) :: d(sys%n)
      type(step_counters), intent(inout) :: count
      integer :: j
      associate (n => sys%n, stage => stages%stage(k))
         self%ay = 0.0_wp
         call sys%a%multiply_add(1.0_wp, y, self%ay)
         if (has_load) self%ay = self%ay + loads(:, 1)
         d = 0.0_wp
         do j = 1, stage%count
            self%x(:, 1) = h*self%ay
            if (has_load) then
               call combine(n, size(loads, 2), loads, stage%omega(:, j), self%bj)
               self%x(:, 1) = self%x(:, 1) + h*self%bj
            end if
            call self%systems%solve(stage%first + j - 1, self%x)
            count%solves = count%solves + 1
            if (stages%is_refined) call refine(self, sys, stage%first + j - 1, stage%pole(j), h, has_load, count)
            call add_weighted(n, stage, j, self%x(:, 1), d)
         end do
      end associate
   end subroutine first_stage

   !> x = x + S^-1 (right-hand side - S x)
   recursive subroutine refine(self, sys, j, p, h, has_load, count)
      class(rational_first), intent(inout) :: self
      class(linear_ode), intent(in) :: sys
      integer, intent(in) :: j                         !! place of the pole
      complex(wp), intent(in) :: p
      real(wp), intent(in) :: h
      logical, intent(in) :: has_load
      type(step_counters), intent(inout) :: count
      integer :: i
      associate (n => sys%n, r => self%residual, re => self%parts(:, 1), im => self%parts(:, 2), are => self%parts(:, 3), &
         & aim => self%parts(:, 4))
         re = real(self%x(:, 1), wp)
         im = aimag(self%x(:, 1))
         call multiply_both(sys%a, re, im, are, aim)
         do i = 1, n
            r(i, 1) = h*cmplx(self%ay(i) - are(i), -aim(i), wp) + p*self%x(i, 1)
         end do
         if (has_load) then
            do i = 1, n
               r(i, 1) = r(i, 1) + h*self%bj(i)
            end do
         end if
         call self%systems%solve(j, r)
         self%x = self%x + r
         count%solves = count%solves + 1
      end associate
   end subroutine refine

   !> d = z (a y + b z y) with the source in both
   recursive subroutine first_factor(self, sys, stages, k, h, has_load, loads, y, d)
      class(rational_first), intent(inout) :: self
      class(linear_ode), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      real(wp), intent(in) :: h
      logical, intent(in) :: has_load
      real(wp), intent(in), contiguous :: loads(:, :)
      real(wp), intent(in) :: y(sys%n)
      real(wp), intent(out) :: d(sys%n)
      associate (f => stages%factor(k))
         if (abs(f%b) > 0.0_wp) then
            call derivative(sys, f%inner, has_load, loads, y, self%ay)
            self%inner = f%a*y + (f%b*h)*self%ay
         else
            self%inner = f%a*y
         end if
         call derivative(sys, f%outer, has_load, loads, self%inner, self%ay)
         d = h*self%ay
      end associate
   end subroutine first_factor

   !> A y + the source by its weights
   recursive subroutine derivative(sys, weights, has_load, loads, y, ay)
      class(linear_ode), intent(in) :: sys
      real(wp), intent(in) :: weights(:)               !! of the nodes
      logical, intent(in) :: has_load
      real(wp), intent(in), contiguous :: loads(:, :)
      real(wp), intent(in) :: y(sys%n)
      real(wp), intent(out) :: ay(sys%n)
      ay = 0.0_wp
      call sys%a%multiply_add(1.0_wp, y, ay)
      if (has_load) call add_loads(sys%n, size(weights), loads, weights, ay)
   end subroutine derivative

   !> The step length in force.  The factors follow from it and from the system, to the last bit; they are made at the next
   !> use, and not counted again.
   recursive subroutine first_archive(self, name, file)
      class(rational_first), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      real(wp) :: h
      call file%section(name)
      h = self%h
      if (abs(self%remade_h) > 0.0_wp) h = self%remade_h
      call file%item('h', h)
      call file%end_section()
      if (.not. file%is_reading) return
      call self%forget()
      if (.not. file%failed()) self%remade_h = h
   end subroutine first_archive
end module dynstep_rational_first
