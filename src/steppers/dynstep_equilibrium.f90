! SPDX-License-Identifier: BSD-3-Clause
!> Newton's iteration for the equilibrium of an implicit step.
!>
!> Newmark's method and the midpoint rule both look for the acceleration a at which
!>
!>     r = f(t, q, v) - M(t, q, v) a = 0,   q = q_p + c_q d,  v = v_p + c_v d,  a = a_p + d
!>
!> with a predictor (q_p, v_p, a_p) and coefficients c_q, c_v of the method (Austin 1991,
!> eqs. (51)-(59)).  The unknown is the increment d; q, v and a each take it up on their
!> own, so none of them is a difference of larger numbers.
!>
!> The matrix S = M + c_v C + c_q K is kept as long as the iteration contracts well, over
!> steps too.  A correction after which the norm of r is larger is first tried with a fresh
!> matrix and then halved (section 7.3 of the paper).
!>
!> The iteration ends when the next correction would be lost in the rounding of q and v, each
!> component by itself, or when r is nothing but rounding errors; extrapolation rests on that
!> (a loose stop turns an extrapolated error of 7e-10 into 2e-5 on the two-body problem).  Where the steps are chosen
!> by their error, `aim_at` tells how small the error of the solution has to be in the norm of the run, and the
!> iteration ends where it is.
module dynstep_equilibrium
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type
   use dynstep_iteration_matrix, only: iteration_matrix
   use dynstep_kinds, only: wp
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_converged, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   type, public :: newton_options
      integer :: limit = 25                !! corrections per step, >= 1
      integer :: halvings = 20             !! halvings of one correction, >= 0
      real(wp) :: tolerance = 0.0_wp       !! of the correction of q and v, relative to each
                                           !! component; 0: to round-off
   contains
      procedure :: check => options_check
      procedure :: archive => options_archive
   end type newton_options

   !> Rate of convergence above which the next step starts with a new matrix, and above which
   !> one is made inside a step.  Measured on the two-body problem of the paper (1000 base
   !> steps of 0.03, Romberg, P = 4), forces with those of the difference tangents: 0.1 136 k,
   !> 0.03 115 k, 0.01 114 k, 0.003 119 k
   real(wp), parameter :: keep_below = 0.03_wp
   real(wp), parameter :: renew_above = 0.03_wp

   !> Rates of corrections below this one are those of rounding errors
   real(wp), parameter :: telling = 100.0_wp*epsilon(1.0_wp)

   !> A tenth of a unit round-off, so that an extrapolation may multiply what is left by ten
   real(wp), parameter :: finest = 0.1_wp*epsilon(1.0_wp)

   !> A backward error below this one is nothing but rounding: a row of f with m terms rounds by up
   !> to m/2 eps; the linear oscillator and the two-body problem give up to 2 eps
   real(wp), parameter :: rounding = 100.0_wp*epsilon(1.0_wp)

   !> First corrections below this one are looked at for being rounding; larger ones seldom are
   real(wp), parameter :: worth_judging = 1.0e6_wp*epsilon(1.0_wp)

   !> Where f is a small difference of larger terms its rounding errors are larger than the
   !> judgement of r can know.  A correction below this one that no longer shrinks, with a
   !> new matrix, is taken for that.
   real(wp), parameter :: stagnated_below = 1.0e5_wp*epsilon(1.0_wp)

   !> Iterations to an error that is allowed: how many, the rate from which on they are left to the other ones, and by
   !> what the rate may be larger than that of the substep before
   integer, parameter :: most_approaches = 8
   real(wp), parameter :: diverging = 0.5_wp, doubt = 1.5_wp

   character(len=*), parameter :: advice = &
      & '; reduce h, or raise the tolerance of Newton''s iteration where the force is less accurate'

   type, public :: equilibrium_solver
      type(newton_options) :: options
      type(iteration_matrix) :: matrix
      logical, private :: is_fresh = .false.     ! the matrix was made at the present iterate
      logical, private :: is_renewed = .false.   ! it was made near the solution of this step
      real(wp), allocatable, private :: r(:), d(:), r0(:), q0(:), v0(:), a0(:)
      real(wp) :: allowed = 0.0_wp               !! error of the solution in `norm`; 0: to rounding
      type(error_norm_type), private :: norm
      real(wp), allocatable, private :: y(:), e(:)     ! [q; v] and its correction
      logical, private :: has_followed = .false. ! `slope` is that of another row of this base step
      real(wp), private :: slope = -1.0_wp       ! rate of convergence by the age of the matrix; < 0: not known
   contains
      procedure :: init => equilibrium_init
      procedure :: solve => equilibrium_solve
      procedure :: archive => equilibrium_archive
      procedure :: aim_at => equilibrium_aim_at
      procedure :: begin_row => equilibrium_begin_row
      procedure :: follow => equilibrium_follow
      procedure :: unknowns => equilibrium_unknowns
   end type equilibrium_solver

contains

   !> limit >= 1, halvings >= 0, a finite tolerance >= 0
   pure subroutine options_check(self, status)
      class(newton_options), intent(in) :: self
      type(status_type), intent(inout) :: status
      logical :: in_range
      if (status%failed()) return
      in_range = self%limit >= 1 .and. self%halvings >= 0 .and. ieee_is_finite(self%tolerance)
      if (in_range) in_range = self%tolerance >= 0.0_wp
      if (.not. in_range) call status%set(dynstep_invalid_input, 'Newton options: limit >= 1, halvings >= 0 and a finite ' &
         & //'tolerance >= 0 are needed, not '//text(self%limit)//', '//text(self%halvings)//', '//text(self%tolerance))
   end subroutine options_check

   recursive subroutine equilibrium_init(self, sys, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      call self%options%check(status)
      if (status%failed()) return
      self%allowed = 0.0_wp
      call self%matrix%init(sys, status)
      if (allocated(self%r)) deallocate (self%r, self%d, self%r0, self%q0, self%v0, self%a0)
      associate (n => sys%n)
         allocate (self%r(n), self%d(n), self%r0(n), self%q0(n), self%v0(n), self%a0(n))
      end associate
   end subroutine equilibrium_init

   !> Let an error of the solution be, as large as `allowed` in the norm
   pure subroutine equilibrium_aim_at(self, norm, allowed)
      class(equilibrium_solver), intent(inout) :: self
      type(error_norm_type), intent(in) :: norm
      real(wp), intent(in) :: allowed
      self%norm = norm
      self%allowed = allowed
      if (allocated(self%y)) deallocate (self%y, self%e)
      allocate (self%y(2*size(self%r)), self%e(2*size(self%r)))
   end subroutine equilibrium_aim_at

   !> n
   pure integer function equilibrium_unknowns(self)
      class(equilibrium_solver), intent(in) :: self
      equilibrium_unknowns = size(self%r)
   end function equilibrium_unknowns

   !> A row of substeps begins.  With an error allowed, nothing is taken over but what `follow` gave: the bits of a base
   !> step are then those of its state and length alone.
   pure subroutine equilibrium_begin_row(self)
      class(equilibrium_solver), intent(inout) :: self
      if (.not. self%allowed > 0.0_wp) return
      call self%matrix%drop()
      if (.not. self%has_followed) self%slope = -1.0_wp
      self%has_followed = .false.
   end subroutine equilibrium_begin_row

   !> What another row of the same base step found of the convergence
   pure subroutine equilibrium_follow(self, other)
      class(equilibrium_solver), intent(inout) :: self
      class(equilibrium_solver), intent(in) :: other
      self%slope = other%slope
      self%has_followed = .true.
   end subroutine equilibrium_follow

   !> The iteration of `solve` to the error that is allowed.  How fast it converges is known from the substeps before:
   !> the rate grows with the age of the matrix.  Where it does not converge well, the rest is left to `solve`.
   recursive subroutine approach(self, sys, t, q, v, a, is_done, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(inout) :: q(sys%n), v(sys%n), a(sys%n)
      logical, intent(out) :: is_done
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: length, previous, rate, age, off, h
      integer :: iteration

      is_done = .false.
      previous = 0.0_wp
      h = abs(self%matrix%c_v)
      age = max(abs(t - self%matrix%t_made), h)
      do iteration = 1, most_approaches
         call self%matrix%residual(sys, t, q, v, a, self%r, count, status)
         if (status%failed()) return
         self%d = self%r
         call self%matrix%solve(self%d, count)
         count%newton_iterations = count%newton_iterations + 1
         call measure_correction(self, q, v, length)
         if (.not. ieee_is_finite(length)) return
         if (iteration > 1) then
            rate = length/previous
            if (rate > diverging .and. length > self%allowed) return
            self%slope = max(rate/off, 0.5_wp*self%slope)
         end if
         if (self%slope*age > renew_above .and. .not. self%matrix%is_constant) then
            call self%matrix%renew(sys, t, q, v, a, count, status)
            if (status%failed()) return
            age = 0.0_wp
            self%d = self%r
            call self%matrix%solve(self%d, count)
            call measure_correction(self, q, v, length)
         end if
         call take(self, 1.0_wp, q, v, a)
         off = age + h*change(self%d, a)
         rate = diverging
         if (self%slope >= 0.0_wp) rate = min(diverging, doubt*self%slope*off)
         is_done = rate*length <= (1.0_wp - rate)*self%allowed
         if (is_done) exit
         previous = length
      end do
   end subroutine approach

   !> Size of a correction beside the acceleration: by that part of a step is the iterate off the motion
   pure real(wp) function change(d, a)
      real(wp), intent(in) :: d(:), a(:)
      change = maxval(abs(d))/max(maxval(abs(a)), maxval(abs(d)), tiny(1.0_wp))
   end function change

   !> The correction in the norm of the run
   pure subroutine measure_correction(self, q, v, length)
      class(equilibrium_solver), intent(inout) :: self
      real(wp), intent(in) :: q(:), v(:)
      real(wp), intent(out) :: length
      associate (n => size(q))
         self%y(1:n) = q
         self%y(n + 1:) = v
         self%e(1:n) = self%matrix%c_q*self%d
         self%e(n + 1:) = self%matrix%c_v*self%d
      end associate
      length = self%norm%measure(self%e, self%y, self%y)
   end subroutine measure_correction

   !> From the predictor in q, v, a to the equilibrium, in place; the matrix is prepared
   recursive subroutine equilibrium_solve(self, sys, t, q, v, a, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t                                  !! time of the equilibrium
      real(wp), intent(inout) :: q(sys%n), v(sys%n), a(sys%n)    !! predictor, then solution
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: length, previous, rate, error
      integer :: iteration
      logical :: is_measured, is_rounding

      self%is_fresh = .false.
      self%is_renewed = .false.
      is_measured = .false.
      previous = 0.0_wp
      if (self%allowed > 0.0_wp .and. .not. self%matrix%is_exact) then
         call approach(self, sys, t, q, v, a, is_measured, count, status)
         if (status%failed() .or. is_measured) return
      end if
      call self%matrix%residual(sys, t, q, v, a, self%r, count, status)
      do iteration = 1, self%options%limit
         if (status%failed()) return
         self%d = self%r
         call self%matrix%solve(self%d, count)
         count%newton_iterations = count%newton_iterations + 1
         length = correction_length(self, q, v, a)
         rate = 1.0_wp
         if (is_measured .and. length < previous) rate = length/previous
         if (self%matrix%is_exact .or. rate*length <= max(self%options%tolerance, finest)) then
            call take(self, 1.0_wp, q, v, a)
            if (is_measured .and. rate > keep_below .and. length > telling) call self%matrix%drop()
            return
         end if
         if (rate > 0.5_wp .and. (is_measured .or. length <= worth_judging)) then
            call self%matrix%backward_error(self%r, q, v, a, error)
            is_rounding = error <= rounding
            if (is_measured .and. length <= stagnation(self)) &
               & is_rounding = is_rounding .or. self%is_renewed .or. self%matrix%is_constant
            if (is_rounding) then
               call take(self, 1.0_wp, q, v, a)
               return
            end if
         end if
         if (is_measured .and. rate > merge(renew_above, 0.5_wp, length > telling) .and. may_renew(self)) then
            self%is_renewed = length <= worth_judging
            call renew(self, sys, t, q, v, a, count, status)
            is_measured = .false.
            cycle
         end if
         call damped_correction(self, sys, t, q, v, a, length, previous, is_measured, count, status)
      end do
      call self%matrix%drop()
      if (status%failed()) return
      call status%set(dynstep_not_converged, 'the Newton iteration did not converge in ' &
         & //text(self%options%limit)//' corrections at t = '//text(t)//', the last one was ' &
         & //text(length)//' of the state'//advice, retry=.true.)
   end subroutine equilibrium_solve

   !> The correction of q and v, relative to each component.  Where a component passes through
   !> zero it is compared with what it changes by in a step, unless the system is stiff: there
   !> h v and h a can be much larger than any change.
   pure real(wp) function correction_length(self, q, v, a)
      class(equilibrium_solver), intent(in) :: self
      real(wp), intent(in) :: q(:), v(:), a(:)
      real(wp) :: c_q, c_v, h, d, largest
      integer :: i
      c_q = abs(self%matrix%c_q)
      c_v = abs(self%matrix%c_v)
      h = 0.0_wp
      if (self%matrix%stiffness_ratio <= 1.0_wp) h = c_v
      largest = 0.0_wp
      do i = 1, size(q)
         d = abs(self%d(i))
         if (.not. d > 0.0_wp) cycle
         largest = max(largest, c_q*d/max(abs(q(i)), h*abs(v(i)), c_q*d, tiny(d)), &
            & c_v*d/max(abs(v(i)), h*abs(a(i)), c_v*d, tiny(d)))
      end do
      correction_length = largest
   end function correction_length

   !> Corrections below this one may end the iteration though they no longer shrink
   pure real(wp) function stagnation(self)
      class(equilibrium_solver), intent(in) :: self
      stagnation = max(stagnated_below, self%options%tolerance)
   end function stagnation

   !> Add a multiple of the correction to q, v and a
   pure subroutine take(self, factor, q, v, a)
      class(equilibrium_solver), intent(in) :: self
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: q(:), v(:), a(:)
      q = q + (factor*self%matrix%c_q)*self%d
      v = v + (factor*self%matrix%c_v)*self%d
      a = a + factor*self%d
   end subroutine take

   !> A new matrix would differ from the present one
   pure logical function may_renew(self)
      class(equilibrium_solver), intent(in) :: self
      may_renew = .not. (self%is_fresh .or. self%is_renewed .or. self%matrix%is_constant)
   end function may_renew

   !> New matrix at the present iterate
   recursive subroutine renew(self, sys, t, q, v, a, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n), a(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      call self%matrix%renew(sys, t, q, v, a, count, status)
      self%is_fresh = .true.
   end subroutine renew

   !> True where r is not larger than r0: the largest component, or the largest in proportion to
   !> the size of its terms at r0 (components of different sizes), or where it is but rounding
   pure subroutine compare_residuals(self, q, v, a, is_better)
      class(equilibrium_solver), intent(inout) :: self     !! with r of (q, v, a) and r0 of (q0, v0, a0)
      real(wp), intent(in) :: q(:), v(:), a(:)
      logical, intent(out) :: is_better
      real(wp) :: error, error0
      is_better = maxval(abs(self%r)) <= maxval(abs(self%r0))
      if (is_better) return
      call self%matrix%backward_error(self%r, self%q0, self%v0, self%a0, error)
      call self%matrix%backward_error(self%r0, self%q0, self%v0, self%a0, error0)
      is_better = error <= error0
      if (is_better) return
      call self%matrix%backward_error(self%r, q, v, a, error)
      is_better = error <= rounding
   end subroutine compare_residuals

   !> Take the correction; where the residual grows, or cannot be had, go back and take a
   !> fresh matrix or half the correction (Austin 1991, end of section 7.3).  `previous` is
   !> the length of what was taken, for the next rate.
   recursive subroutine damped_correction(self, sys, t, q, v, a, length, previous, is_measured, count, status)
      class(equilibrium_solver), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(inout) :: q(sys%n), v(sys%n), a(sys%n)
      real(wp), intent(in) :: length                  !! of the whole correction
      real(wp), intent(out) :: previous
      logical, intent(out) :: is_measured             !! a correction was taken
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: factor
      integer :: halving

      self%r0 = self%r
      self%q0 = q
      self%v0 = v
      self%a0 = a
      factor = 1.0_wp
      do halving = 0, self%options%halvings
         previous = factor*length
         call take(self, factor, q, v, a)
         call self%matrix%residual(sys, t, q, v, a, self%r, count, status)
         if (.not. status%failed()) then
            call compare_residuals(self, q, v, a, is_measured)
            is_measured = is_measured .or. previous <= stagnation(self)
            if (is_measured) self%is_fresh = .false.
            if (is_measured) return
         end if
         self%r = self%r0
         q = self%q0
         v = self%v0
         a = self%a0
         is_measured = .false.
         if (status%failed() .and. .not. status%retry) return
         if (may_renew(self)) then
            call status%clear()
            call renew(self, sys, t, q, v, a, count, status)
            return
         end if
         if (halving == self%options%halvings) exit
         call status%clear()
         factor = 0.5_wp*factor
         count%halvings = count%halvings + 1
      end do
      call self%matrix%drop()
      if (status%failed()) return
      call status%set(dynstep_not_converged, 'the residual of Newton''s iteration grows at t = '//text(t) &
         & //' even after '//text(self%options%halvings)//' halvings of the correction'//advice, retry=.true.)
   end subroutine damped_correction

   !> Options must be the same: they decide how far each iteration goes
   recursive subroutine options_archive(self, name, file)
      class(newton_options), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%expect('limit', self%limit)
      call file%expect('halvings', self%halvings)
      call file%expect('tolerance', self%tolerance)
      call file%end_section()
   end subroutine options_archive

   !> The matrix; all else is of one iteration
   recursive subroutine equilibrium_archive(self, name, file)
      class(equilibrium_solver), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call self%options%archive('options', file)
      call self%matrix%archive('matrix', file)
      call file%end_section()
   end subroutine equilibrium_archive
end module dynstep_equilibrium
