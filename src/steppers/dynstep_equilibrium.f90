! SPDX-License-Identifier: BSD-3-Clause
!> Newton's iteration for the equilibrium of an implicit step.
!>
!> Newmark's method and the midpoint rule both look for the acceleration a at which
!>
!>     r = f(t, q, v) - M(t, q, v) a = 0,   q = q_p + c_q d,  v = v_p + c_v d,  a = a_p + d
!>
!> with a predictor (q_p, v_p, a_p) and coefficients c_q, c_v of the method (Austin 1991,
!> eqs. (51)-(59)).  The unknown is the increment d; q, v and a each take it up on their
!> own, so none of them is a difference of larger numbers.  The iteration matrix is
!> S = M + c_v C + c_q K.
!>
!> It is kept as long as the iteration contracts well, over steps too.  A correction after
!> which the norm of r is larger is first tried with a fresh matrix and then halved
!> (section 7.3 of the paper).  The iteration ends when the next correction would be lost in
!> the rounding of q and v, or when rounding stops its progress; extrapolation rests on that
!> (a loose stop turns an extrapolated error of 7e-10 into 2e-5 on the two-body problem).
module dynstep_equilibrium
   use dynstep_accelerations, only: check_callback, check_finite
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: long, wp
   use dynstep_matrix, only: kind_banded, kind_dense, kind_diagonal, kind_identity, kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_converged, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   type, public :: newton_options
      integer :: limit = 25                !! corrections per step, >= 1
      integer :: halvings = 20             !! halvings of one correction, >= 0
      real(wp) :: tolerance = 0.0_wp       !! of the correction of q and v, relative to their
                                           !! largest component; 0: to round-off
   end type newton_options

   !> Rate of convergence above which the next step starts with a new matrix, and above which
   !> one is made inside a step.  Measured on the two-body problem of the paper (1000 base
   !> steps of 0.03, Romberg, P = 4), forces with those of the difference tangents: 0.1 133 k,
   !> 0.03 114 k, 0.01 118 k, 0.003 130 k
   real(wp), parameter :: keep_below = 0.03_wp
   real(wp), parameter :: renew_above = 0.03_wp

   type, public :: equilibrium_solver
      type(newton_options) :: options
      real(wp) :: stiffness_ratio = 0.0_wp        !! largest c_q |K| / M and c_v |C| / M of the rows
      type(matrix_type), private :: m, k, c, s
      type(factorization_type), private :: factor
      real(wp), private :: c_q = 0.0_wp, c_v = 0.0_wp    ! that s was made with
      logical, private :: matrices_known = .false.       ! k, c (and m) are constant and known
      logical, private :: factored = .false.             ! s is factorized for c_q, c_v
      logical, private :: fresh = .false.                ! s was made at the present iterate
      real(wp), allocatable, private :: r(:), d(:), q0(:), v0(:), a0(:)
   contains
      procedure :: init => equilibrium_init
      procedure :: forget => equilibrium_forget
      procedure :: prepare => equilibrium_prepare
      procedure :: solve => equilibrium_solve
      procedure :: scalar_inverse => equilibrium_scalar_inverse
   end type equilibrium_solver

contains

   !> Storage; the structure of S is the smallest that holds M, C and K
   recursive subroutine equilibrium_init(self, sys, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer :: kind, kl, ku
      logical :: symmetric

      if (status%failed()) return
      if (self%options%limit < 1 .or. self%options%halvings < 0 .or. .not. self%options%tolerance >= 0.0_wp) then
         call status%set(dynstep_invalid_input, 'Newton options: limit >= 1, halvings >= 0 and tolerance >= 0 ' &
            & //'are needed, not '//text(self%options%limit)//', '//text(self%options%halvings)//', ' &
            & //text(self%options%tolerance))
         return
      end if
      associate (s => sys%structure, n => sys%n)
         kind = max(kind_diagonal, s%mass, s%tangent)
         kl = 0
         ku = 0
         if (s%mass == kind_banded) then
            kl = s%mass_kl
            ku = s%mass_ku
         end if
         if (s%tangent == kind_banded) then
            kl = max(kl, s%kl)
            ku = max(ku, s%ku)
         end if
         symmetric = s%mass_is_symmetric .and. s%tangent_is_symmetric
         call self%m%init(s%mass, n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         call self%k%init(s%tangent, n, s%kl, s%ku, s%tangent_is_symmetric, status)
         call self%c%init(merge(kind_zero, s%tangent, s%velocity_free), n, s%kl, s%ku, &
            & s%tangent_is_symmetric, status)
         call self%s%init(kind, n, kl, ku, symmetric, status)
         call self%factor%init(kind, n, kl, ku, symmetric, status)
         if (allocated(self%r)) deallocate (self%r, self%d, self%q0, self%v0, self%a0)
         allocate (self%r(n), self%d(n), self%q0(n), self%v0(n), self%a0(n))
      end associate
      call self%forget()
   end subroutine equilibrium_init

   !> Drop what is known of the matrices
   pure subroutine equilibrium_forget(self)
      class(equilibrium_solver), intent(inout) :: self
      self%matrices_known = .false.
      self%factored = .false.
   end subroutine equilibrium_forget

   !> Have S factorized for these coefficients; the point is where it is made if it has to be
   recursive subroutine equilibrium_prepare(self, sys, t, c_q, c_v, q, v, a, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t, c_q, c_v
      real(wp), intent(in) :: q(sys%n), v(sys%n), a(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      self%fresh = .false.
      if (self%factored .and. .not. (abs(c_q - self%c_q) > 0.0_wp .or. abs(c_v - self%c_v) > 0.0_wp)) return
      self%c_q = c_q
      self%c_v = c_v
      call make_matrix(self, sys, t, q, v, a, count, status)
   end subroutine equilibrium_prepare

   !> 1/S of a system with one coordinate
   pure real(wp) function equilibrium_scalar_inverse(self)
      class(equilibrium_solver), intent(in) :: self
      real(wp) :: x(1)
      x = 1.0_wp
      call self%factor%solve(x)
      equilibrium_scalar_inverse = x(1)
   end function equilibrium_scalar_inverse

   !> S at (t, q, v, a), factorized
   recursive subroutine make_matrix(self, sys, t, q, v, a, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n), a(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer(long) :: before
      integer :: ierr

      self%factored = .false.
      if (.not. self%matrices_known) then
         call evaluate_mass(self, sys, t, q, v, count, status)
         if (status%failed()) return
         call self%k%set_zero()
         call self%c%set_zero()
         before = sys%difference_forces
         call sys%tangent(t, q, v, a, self%k, self%c, ierr)
         count%tangents = count%tangents + 1
         count%forces = count%forces + (sys%difference_forces - before)
         call check_callback('tangent', ierr, t, status)
         if (status%failed()) return
         self%matrices_known = sys%structure%tangent_is_constant .and. sys%structure%mass_is_constant
      end if
      call self%s%set_zero()
      call self%m%add_to(1.0_wp, self%s)
      call self%c%add_to(self%c_v, self%s)
      call self%k%add_to(self%c_q, self%s)
      call self%factor%factorize(self%s, status, t, 'the iteration matrix M + c_v C + c_q K')
      count%factorizations = count%factorizations + 1
      if (status%failed()) then
         status%retry = .true.
         return
      end if
      self%factored = .true.
      self%fresh = .true.
      call compare_rows(self)
   end subroutine make_matrix

   !> How much stiffness and damping outweigh the mass, by rows
   pure subroutine compare_rows(self)
      class(equilibrium_solver), intent(inout) :: self
      integer :: i
      real(wp) :: largest
      call self%k%absolute_row_sums(self%d)
      call self%c%absolute_row_sums(self%r)
      largest = 0.0_wp
      do i = 1, size(self%d)
         associate (row => max(abs(self%c_q)*self%d(i), abs(self%c_v)*self%r(i)), mass => abs(self%m%entry(i, i)))
            if (row > largest*mass) largest = row/max(mass, tiny(1.0_wp))
         end associate
      end do
      self%stiffness_ratio = largest
   end subroutine compare_rows

   recursive subroutine evaluate_mass(self, sys, t, q, v, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr
      if (sys%structure%mass == kind_identity) return
      call self%m%set_zero()
      call sys%mass(t, q, v, self%m, ierr)
      count%masses = count%masses + 1
      call check_callback('mass', ierr, t, status)
   end subroutine evaluate_mass

   !> r = f - M a and its norm
   recursive subroutine residual(self, sys, t, q, v, a, norm, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n), a(sys%n)
      real(wp), intent(out) :: norm
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr
      norm = 0.0_wp
      call sys%force(t, q, v, self%r, ierr)
      count%forces = count%forces + 1
      call check_callback('force', ierr, t, status)
      if (status%failed()) return
      call check_finite('force', self%r, t, status)
      if (status%failed()) return
      if (.not. sys%structure%mass_is_constant) then
         call evaluate_mass(self, sys, t, q, v, count, status)
         if (status%failed()) return
      end if
      call self%m%multiply_add(-1.0_wp, a, self%r)
      if (.not. sys%structure%mass_is_constant) call check_finite('mass', self%r, t, status)
      if (.not. status%failed()) norm = maxval(abs(self%r))
   end subroutine residual

   !> From the predictor in q, v, a to the equilibrium, in place; `prepare` was called
   recursive subroutine equilibrium_solve(self, sys, t, q, v, a, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t                                  !! time of the equilibrium
      real(wp), intent(inout) :: q(sys%n), v(sys%n), a(sys%n)    !! predictor, then solution
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: norm, length, previous, rate
      integer :: iteration

      if (status%failed()) return
      call residual(self, sys, t, q, v, a, norm, count, status)
      previous = huge(1.0_wp)         ! no correction to compare with
      do iteration = 1, self%options%limit
         if (status%failed()) return
         self%d = self%r
         call self%factor%solve(self%d)
         count%solves = count%solves + 1
         count%newton_iterations = count%newton_iterations + 1
         length = correction_length(self, q, v, a)
         rate = 1.0_wp
         if (previous < huge(1.0_wp)) rate = length/previous
         if (sys%structure%force_is_linear .or. done(self, length, rate)) then
            call take(self, 1.0_wp, q, v, a)
            if (rate > keep_below .and. length > rounding_noise(self)) self%factored = self%matrices_known
            return
         end if
         if (rate > renew_above .and. previous < huge(1.0_wp) .and. may_renew(self)) then
            call renew(self, sys, t, q, v, a, norm, count, status)
            previous = huge(1.0_wp)
            cycle
         end if
         previous = length
         call damped_correction(self, sys, t, q, v, a, norm, previous, count, status)
      end do
      if (status%failed()) return
      call status%set(dynstep_not_converged, 'the Newton iteration did not converge in ' &
         & //text(self%options%limit)//' corrections at t = '//text(t)//', the last one was ' &
         & //text(length)//' of the state; reduce h', retry=.true.)
      self%factored = self%matrices_known
   end subroutine equilibrium_solve

   !> The next correction, about rate times this one, is below the tolerance, or this one is
   !> of the size of rounding errors and no longer shrinks
   pure logical function done(self, length, rate)
      class(equilibrium_solver), intent(in) :: self
      real(wp), intent(in) :: length, rate
      real(wp) :: tolerance
      ! a tenth of a unit round-off, so that an extrapolation may multiply it by ten
      tolerance = max(self%options%tolerance, 0.1_wp*epsilon(1.0_wp))
      done = min(rate, 1.0_wp)*length <= tolerance .or. &
         & (rate > 0.5_wp .and. length <= rounding_noise(self))
   end function done

   !> Size of a correction that rounding errors of f and M a make: their relative size is
   !> epsilon, S weighs them by up to the stiffness ratio, and a row adds many terms
   pure real(wp) function rounding_noise(self)
      class(equilibrium_solver), intent(in) :: self
      rounding_noise = 100.0_wp*epsilon(1.0_wp)*(1.0_wp + self%stiffness_ratio)
   end function rounding_noise

   !> The correction of q and v, relative to their largest components
   pure real(wp) function correction_length(self, q, v, a)
      class(equilibrium_solver), intent(in) :: self
      real(wp), intent(in) :: q(:), v(:), a(:)
      real(wp) :: d, all_a
      d = maxval(abs(self%d))
      all_a = maxval(abs(a)) + d
      correction_length = max(d*abs(self%c_v)/max(maxval(abs(v)), abs(self%c_v)*all_a, tiny(d)), &
         & d*abs(self%c_q)/max(maxval(abs(q)), abs(self%c_q)*all_a, tiny(d)))
   end function correction_length

   !> Add a multiple of the correction to q, v and a
   pure subroutine take(self, factor, q, v, a)
      class(equilibrium_solver), intent(in) :: self
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: q(:), v(:), a(:)
      q = q + (factor*self%c_q)*self%d
      v = v + (factor*self%c_v)*self%d
      a = a + factor*self%d
   end subroutine take

   !> A new matrix would differ from the present one
   pure logical function may_renew(self)
      class(equilibrium_solver), intent(in) :: self
      may_renew = .not. (self%fresh .or. self%matrices_known)
   end function may_renew

   !> New matrix and residual at the present iterate
   recursive subroutine renew(self, sys, t, q, v, a, norm, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n), a(sys%n)
      real(wp), intent(out) :: norm
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      norm = 0.0_wp
      call make_matrix(self, sys, t, q, v, a, count, status)
      if (.not. status%failed()) call residual(self, sys, t, q, v, a, norm, count, status)
   end subroutine renew

   !> Take the correction; where the residual grows, or cannot be had, go back and take a
   !> fresh matrix or half the correction (Austin 1991, end of section 7.3).  `previous` is
   !> the length of what was taken, for the next rate.
   recursive subroutine damped_correction(self, sys, t, q, v, a, norm, previous, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(inout) :: q(sys%n), v(sys%n), a(sys%n)
      real(wp), intent(inout) :: norm, previous
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: factor, norm_before
      integer :: halving

      self%q0 = q
      self%v0 = v
      self%a0 = a
      norm_before = norm
      factor = 1.0_wp
      do halving = 0, self%options%halvings
         call take(self, factor, q, v, a)
         call residual(self, sys, t, q, v, a, norm, count, status)
         if (.not. status%failed() .and. (norm <= norm_before .or. previous <= rounding_noise(self))) then
            self%fresh = .false.
            return
         end if
         q = self%q0
         v = self%v0
         a = self%a0
         if (status%failed() .and. .not. status%retry) return
         if (may_renew(self)) then
            call status%clear()
            call renew(self, sys, t, q, v, a, norm, count, status)
            previous = huge(1.0_wp)
            return
         end if
         if (halving == self%options%halvings) exit
         call status%clear()
         factor = 0.5_wp*factor
         previous = 0.5_wp*previous
         count%halvings = count%halvings + 1
      end do
      self%factored = self%matrices_known
      if (status%failed()) return
      call status%set(dynstep_not_converged, 'the residual of Newton''s iteration grows at t = '//text(t) &
         & //' even after '//text(self%options%halvings)//' halvings of the correction; reduce h', retry=.true.)
   end subroutine damped_correction
end module dynstep_equilibrium
