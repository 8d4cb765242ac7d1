! SPDX-License-Identifier: BSD-3-Clause
!> Consistent values at one time (Jay & Negrut 2008, section 6, the conditions at t0):
!>
!>   project   q on g(t,q) = 0 and v on g' = 0, k(t,q,v) = 0, each by the smallest change in the
!>             norm of M, with Newton's iteration
!>   solve     a, lambda, psi from  M a = f + r,  G a + (g'' - G a) = 0,  K a + (k' - K a) = 0
!>
!>   Rows of [G; K] that depend on others are found here and named in the report; the equations are
!>   then solved with a small negative multiple of the identity in the block of the multipliers and
!>   iterative refinement, which tends to the multipliers of least norm.
module dynstep_consistent_start
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: check_callback, check_finite
   use dynstep_archive, only: archive_type
   use dynstep_constrained_motion, only: constrained_motion
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: kind_identity, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_rank, only: default_rank_tolerance, dependence_type, find_dependent_rows
   use dynstep_saddle_point, only: saddle_point_type
   use dynstep_status, only: dynstep_inconsistent_start, dynstep_not_finite, dynstep_singular_matrix, message_length, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   integer, parameter, public :: start_project = 1   !! move q and v onto the constraints
   integer, parameter, public :: start_refuse = 2    !! refuse a start that is off the constraints
   integer, parameter, public :: start_keep = 3      !! take q and v as they are

   !> What the block matrix is factorized for
   integer, parameter :: for_positions = 1, for_velocities = 2, for_accelerations = 3

   !> What a start found and what it moved
   type, public :: start_report
      real(wp) :: g = 0.0_wp          !! largest |g| of the start as it was given
      real(wp) :: gv = 0.0_wp         !! largest |g'|, at the projected q where q is projected
      real(wp) :: k = 0.0_wp          !! largest |k|, there too
      real(wp) :: moved_q = 0.0_wp    !! largest change of a coordinate
      real(wp) :: moved_v = 0.0_wp    !! largest change of a velocity
      logical :: is_redundant = .false.                 !! constraints depend on each other
      integer, allocatable :: redundant_rows(:)         !! those that do: 1 .. m of g, m + 1 .. m + p of k
      character(len=message_length) :: redundant = ''   !! which depend on which, in words
   contains
      procedure :: archive => report_archive
   end type start_report

   !> Negative multiple of the (scaled) identity in the multiplier block where constraints are redundant.
   !> With 1e-4 Newton's iteration takes half as many steps again, with 1e-12 the split of the multipliers
   !> among equal rows drifts; 1e-8 costs nothing (pendulum with a repeated row, h = 2^-8).
   real(wp), parameter, public :: regularization_of_redundant = 1.0e-8_wp

   !> A start whose projection moves it by less than this part of its size is consistent up to rounding
   real(wp), parameter :: rounding = 100.0_wp*epsilon(1.0_wp)

   !> Largest number of Newton corrections of a projection.  From a tenth of the size of a mechanism it takes 3 to 6.
   integer, parameter :: most_corrections = 30

   !> Multiplications of a rank decision that a start may cost: a tenth of a second
   real(wp), parameter :: most_rank_work = 1.0e8_wp

   type, public :: consistent_start
      type(constrained_motion) :: motion
      real(wp) :: regularization = 0.0_wp               !! 0, or regularization_of_redundant
      type(matrix_type), allocatable, private :: mass
      type(saddle_point_type), allocatable, private :: saddle
      real(wp), allocatable, private :: f(:), x(:), rest(:), l(:), s(:), cg(:), ck(:)
   contains
      procedure :: init => start_init
      procedure :: look_for_dependence => start_look_for_dependence
      procedure :: project => start_project_state
      procedure :: solve => start_solve
   end type consistent_start

contains

   recursive subroutine start_init(self, sys, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (allocated(self%mass)) deallocate (self%mass, self%saddle, self%f, self%x, self%rest, self%l, self%s, self%cg, self%ck)
      allocate (self%mass, self%saddle)
      self%regularization = 0.0_wp
      call self%motion%init(sys, status)
      associate (s => sys%structure, n => sys%n, m => sys%holonomic, p => sys%nonholonomic, c => sys%constraints)
         call self%mass%init(s%mass, n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         call self%saddle%init(n, m, p, s%mass, s%mass_kl, s%mass_ku, s%mass_is_symmetric, c%g, c%k, &
            & c%reaction_is_general, c%order, status)
         allocate (self%f(n), self%x(n), self%rest(n), self%l(m), self%s(p), self%cg(m), self%ck(p), source=0.0_wp)
      end associate
   end subroutine start_init

   !> Move q and v onto the constraints, or find that they are off
   recursive subroutine start_project_state(self, sys, mode, t, q, v, report, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      integer, intent(in) :: mode                        !! start_keep fills in the report alone
      real(wp), intent(in) :: t
      real(wp), intent(inout) :: q(sys%n), v(sys%n)
      type(start_report), intent(inout) :: report
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: q0(sys%n), v0(sys%n)

      if (status%failed() .or. self%motion%m + self%motion%p == 0) return
      if (mode == start_keep) then
         call self%motion%evaluate(sys, t, q, v, count, status)
         report%g = largest(self%motion%g)
         report%gv = largest(self%motion%gv)
         report%k = largest(self%motion%k)
         return
      end if
      call evaluate_mass(self, sys, t, q, v, count, status)
      q0 = q
      if (self%motion%m > 0) call project_positions(self, sys, t, q, report, count, status)
      v0 = v
      call project_velocities(self, sys, t, q, v, report, count, status)
      if (status%failed()) return
      report%moved_q = maxval(abs(q - q0))
      report%moved_v = maxval(abs(v - v0))
      if (mode /= start_refuse) return
      if (report%moved_q <= rounding*maxval(abs(q)) .and. report%moved_v <= rounding*maxval(abs(v))) then
         q = q0
         v = v0
         return
      end if
      call status%set(dynstep_inconsistent_start, 'the start at t = '//text(t)//' is off the constraints: |g| = ' &
         & //text(report%g)//', |g''| = '//text(report%gv)//', |k| = '//text(report%k)//'; q has to move by ' &
         & //text(report%moved_q)//' and v by '//text(report%moved_v)//': correct them, or let the start project them')
      q = q0
      v = v0
   end subroutine start_project_state

   !> The nearest q with g(t, q) = 0: M (q - q0) + G^T x = 0, by Newton's iteration without the derivative of G^T x, which
   !> contracts by about the distance over the radius of curvature
   recursive subroutine project_positions(self, sys, t, q, report, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(inout) :: q(sys%n)
      type(start_report), intent(inout) :: report
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: length, previous
      real(wp) :: q0(sys%n), force(self%motion%m)
      integer :: i

      previous = huge(previous)
      q0 = q
      force = 0.0_wp
      associate (motion => self%motion)
         do i = 1, most_corrections
            call motion%evaluate_holonomic(sys, t, q, count, status)
            if (status%failed()) return
            if (i == 1) report%g = largest(motion%g)
            motion%kv%value = 0.0_wp
            call factorize(self, sys, t, for_positions, report, count, status)
            if (status%failed()) return
            call aim_back(i, q0, q, force)
            self%x = 0.0_wp
            call self%mass%multiply_add(1.0_wp, q0 - q, self%x)
            call motion%gq%transposed_add(-1.0_wp, force, self%x)
            self%l = -motion%g
            self%s = 0.0_wp
            call self%saddle%solve(self%x, self%l, self%s)
            count%solves = count%solves + 1
            force = force + self%l
            length = largest(self%x)
            if (length <= rounding*largest(q) .and. i == 1) then
               call check_conflict(self, sys, t, q, count, status)
               return
            end if
            if (.not. ieee_is_finite(length)) exit
            q = q + self%x
            if (length <= rounding*largest(q) .or. (length >= 0.5_wp*previous .and. length <= 1.0e-8_wp*largest(q))) then
               call check_conflict(self, sys, t, q, count, status)
               return
            end if
            previous = length
         end do
      end associate
      call status%set(dynstep_inconsistent_start, 'no q near the start at t = '//text(t)//' fulfils the constraints g = 0: ' &
         & //'after '//text(min(i, most_corrections))//' corrections |g| = '//text(largest(self%motion%g)) &
         & //'; start nearer to them, look for constraints that contradict each other, or count coordinates from the origin ' &
         & //'of the lengths in g')
   end subroutine project_positions

   !> Constraints that depend on each other may contradict each other
   recursive subroutine check_conflict(self, sys, t, q, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: reach
      integer :: i
      if (self%regularization <= 0.0_wp) return
      call self%motion%evaluate_holonomic(sys, t, q, count, status)
      if (status%failed()) return
      do i = 1, self%motion%m
         associate (row => self%motion%gq%value(self%motion%gq%first(i):self%motion%gq%first(i + 1) - 1))
            reach = largest(row)*largest(q)
         end associate
         if (abs(self%motion%g(i)) <= 1.0e-8_wp*max(reach, tiny(reach))) cycle
         call status%set(dynstep_inconsistent_start, 'constraint '//text(i)//' of g contradicts others at t = '//text(t) &
            & //': g('//text(i)//') = '//text(self%motion%g(i))//' cannot be brought to zero, since it ' &
            & //'depends on constraints that fix it')
         return
      end do
   end subroutine check_conflict

   !> The nearest v with g'(t, q, v) = 0 and k(t, q, v) = 0: M (v - v0) + G^T x + K^T y = 0, likewise
   recursive subroutine project_velocities(self, sys, t, q, v, report, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n)
      real(wp), intent(inout) :: v(sys%n)
      type(start_report), intent(inout) :: report
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: length, previous, size_v
      real(wp) :: v0(sys%n), force(self%motion%m), force_k(self%motion%p)
      integer :: i

      previous = huge(previous)
      v0 = v
      force = 0.0_wp
      force_k = 0.0_wp
      associate (motion => self%motion)
         call motion%evaluate_holonomic(sys, t, q, count, status)
         do i = 1, most_corrections
            call motion%velocity_residual(v)
            call motion%evaluate_nonholonomic(sys, t, q, v, count, status)
            if (status%failed()) return
            if (i == 1) then
               report%gv = largest(motion%gv)
               report%k = largest(motion%k)
            end if
            call factorize(self, sys, t, for_velocities, report, count, status)
            if (status%failed()) return
            call aim_back(i, v0, v, force, force_k)
            self%x = 0.0_wp
            call self%mass%multiply_add(1.0_wp, v0 - v, self%x)
            call motion%gq%transposed_add(-1.0_wp, force, self%x)
            call motion%kv%transposed_add(-1.0_wp, force_k, self%x)
            self%l = -motion%gv
            self%s = -motion%k
            call self%saddle%solve(self%x, self%l, self%s)
            count%solves = count%solves + 1
            force = force + self%l
            force_k = force_k + self%s
            length = largest(self%x)
            if (.not. ieee_is_finite(length)) exit
            size_v = largest(v)
            if (length <= rounding*size_v .and. i == 1) then
               call check_velocity_conflict(self, sys, t, q, v, count, status)
               return
            end if
            v = v + self%x
            ! the residuals of v = 0 may be rounding errors alone
            if (length <= rounding*max(size_v, largest(v)) .or. (length >= 0.5_wp*previous .and. &
               & length <= 1.0e-8_wp*largest(v)) .or. .not. largest(v) > tiny(length)) then
               call check_velocity_conflict(self, sys, t, q, v, count, status)
               return
            end if
            previous = length
         end do
      end associate
      call status%set(dynstep_inconsistent_start, 'no v near the start at t = '//text(t)//' fulfils g'' = 0 and k = 0: ' &
         & //'after '//text(min(i, most_corrections))//' corrections |g''| = '//text(largest(self%motion%gv)) &
         & //', |k| = '//text(largest(self%motion%k))//'; look for constraints that contradict each other')
   end subroutine project_velocities

   !> The same for g' = 0 and k = 0.  Differences leave about 1e-12 of what moves G and g in a unit of time.
   recursive subroutine check_velocity_conflict(self, sys, t, q, v, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      character(len=*), parameter :: remedy = ' cannot be brought to zero by velocities, since it depends on constraints ' &
         & //'that fix it'
      real(wp) :: size_v
      integer :: i
      if (self%regularization <= 0.0_wp) return
      size_v = max(1.0e-8_wp*largest(v), 1.0e-10_wp*largest(q))
      associate (motion => self%motion)
         call motion%velocity_residual(v)
         call motion%evaluate_nonholonomic(sys, t, q, v, count, status)
         if (status%failed()) return
         do i = 1, motion%m
            if (abs(motion%gv(i)) <= size_v*largest(motion%gq%value(motion%gq%first(i):motion%gq%first(i + 1) - 1))) cycle
            call status%set(dynstep_inconsistent_start, 'constraint '//text(i)//' of g contradicts others at t = '//text(t) &
               & //': g''('//text(i)//') = '//text(motion%gv(i))//remedy)
            return
         end do
         do i = 1, motion%p
            if (abs(motion%k(i)) <= size_v*largest(motion%kv%value(motion%kv%first(i):motion%kv%first(i + 1) - 1))) cycle
            call status%set(dynstep_inconsistent_start, 'constraint '//text(i)//' of k contradicts others at t = '//text(t) &
               & //': k('//text(i)//') = '//text(motion%k(i))//remedy)
            return
         end do
      end associate
   end subroutine check_velocity_conflict

   !> After two thirds of the corrections the nearest point is given up: from then on each one is the shortest way to
   !> the constraints, which contracts quadratically
   pure subroutine aim_back(i, x0, x, force, force_k)
      integer, intent(in) :: i
      real(wp), intent(inout) :: x0(:)
      real(wp), intent(in) :: x(:)
      real(wp), intent(inout) :: force(:)
      real(wp), intent(inout), optional :: force_k(:)
      if (i <= (2*most_corrections)/3) return
      x0 = x
      force = 0.0_wp
      if (present(force_k)) force_k = 0.0_wp
   end subroutine aim_back

   !> a, lambda, psi at (t, q, v).  On entry lambda and psi are guesses for a reaction that is not
   !> linear in them.  f returns the forces with the reactions.
   recursive subroutine start_solve(self, sys, t, q, v, a, lambda, psi, f, report, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(out) :: a(sys%n)
      real(wp), intent(inout) :: lambda(self%motion%m), psi(self%motion%p)
      real(wp), intent(out) :: f(sys%n)
      type(start_report), intent(inout) :: report
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr

      a = 0.0_wp
      f = 0.0_wp
      if (status%failed()) return
      call evaluate_mass(self, sys, t, q, v, count, status)
      call self%motion%evaluate(sys, t, q, v, count, status)
      call self%motion%curvatures(sys, t, q, v, self%cg, self%ck, status)
      if (status%failed()) return
      call sys%force(t, q, v, self%f, ierr)
      count%forces = count%forces + 1
      call check_callback('force', ierr, t, status)
      if (.not. status%failed()) call check_finite('force', self%f, t, status)
      if (status%failed()) return
      if (.not. sys%constraints%reaction_is_general) then
         lambda = 0.0_wp
         psi = 0.0_wp
      end if
      call iterate(self, sys, t, q, v, a, lambda, psi, report, count, status)
      if (sys%constraints%reaction_is_general .and. (status%code == dynstep_inconsistent_start .or. &
         & status%code == dynstep_singular_matrix)) then
         ! multipliers of zero are a singular point of many reactions
         call status%clear()
         a = 0.0_wp
         lambda = 1.0_wp
         psi = 1.0_wp
         call iterate(self, sys, t, q, v, a, lambda, psi, report, count, status)
      end if
      if (status%failed()) return
      f = self%f
      call self%motion%add_reaction(sys, t, q, v, 1.0_wp, lambda, psi, f, status)
   end subroutine start_solve

   !> Newton's iteration for a, lambda, psi; one correction, and a second one that refines it, where the
   !> reaction is linear
   recursive subroutine iterate(self, sys, t, q, v, a, lambda, psi, report, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(inout) :: a(sys%n), lambda(self%motion%m), psi(self%motion%p)
      type(start_report), intent(inout) :: report
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: length, previous
      integer :: i

      previous = huge(previous)
      do i = 1, most_corrections
         associate (motion => self%motion)
            if (i == 1 .or. sys%constraints%reaction_is_general) then
               call motion%differentiate_reaction(sys, t, q, v, lambda, psi, status)
               call factorize(self, sys, t, for_accelerations, report, count, status)
               if (status%failed()) return
            end if
            self%x = self%f
            call motion%add_reaction(sys, t, q, v, 1.0_wp, lambda, psi, self%x, status)
            if (status%failed()) return
            call self%mass%multiply_add(-1.0_wp, a, self%x)
            call motion%gq%multiply(a, self%l)
            call motion%kv%multiply(a, self%s)
            self%l = -(self%l + self%cg)
            self%s = -(self%s + self%ck)
            call self%saddle%solve(self%x, self%l, self%s)
            count%solves = count%solves + 1
         end associate
         a = a + self%x
         lambda = lambda + self%l
         psi = psi + self%s
         length = max(part(self%x, a), part(self%l, lambda), part(self%s, psi))
         if (.not. ieee_is_finite(length)) exit
         if (length <= rounding .or. (i > 2 .and. length >= 0.5_wp*previous .and. length <= 1.0e-6_wp)) return
         if (i >= 2 .and. self%motion%m + self%motion%p == 0) return
         previous = length
      end do
      call status%set(dynstep_inconsistent_start, 'no accelerations and multipliers fulfil the equations of motion and the ' &
         & //'hidden constraints at t = '//text(t)//'; give a guess of the multipliers, or look for constraints that ' &
         & //'contradict each other')
   end subroutine iterate

   recursive subroutine evaluate_mass(self, sys, t, q, v, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr, row, column
      if (status%failed() .or. sys%structure%mass == kind_identity) return
      call self%mass%set_zero()
      call sys%mass(t, q, v, self%mass, ierr)
      count%masses = count%masses + 1
      call check_callback('mass', ierr, t, status)
      if (status%failed()) return
      call self%mass%first_not_finite(row, column)
      if (row > 0) call status%set(dynstep_not_finite, 'mass returned '//text(self%mass%entry(row, column))//' in row ' &
         & //text(row)//', column '//text(column)//' at t = '//text(t), retry=.true.)
   end subroutine evaluate_mass

   !> Factors of matrix (12) at the point of the last evaluation; where constraints turn out to depend on
   !> each other they are named, and the regularized matrix is taken from then on
   recursive subroutine factorize(self, sys, t, purpose, report, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      real(wp), intent(in) :: t
      integer, intent(in) :: purpose                  !! for_positions, for_velocities, for_accelerations
      type(start_report), intent(inout) :: report
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      call one_factorization(self, sys, t, purpose, count, status)
      if (status%code /= dynstep_singular_matrix .or. self%regularization > 0.0_wp) return
      if (self%motion%m + self%motion%p == 0) call status%set(dynstep_singular_matrix, trim(status%message) &
         & //'; condense coordinates that have no mass, or give them one')
      if (self%saddle%singular_equation <= sys%n .or. sys%constraints%reaction_is_general) return
      report%is_redundant = .true.
      report%redundant = status%message
      self%regularization = regularization_of_redundant
      call status%clear()
      call one_factorization(self, sys, t, purpose, count, status)
   end subroutine factorize

   !> A projection moves along M^-1 G^T and M^-1 K^T, whatever the reaction
   recursive subroutine one_factorization(self, sys, t, purpose, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      real(wp), intent(in) :: t
      integer, intent(in) :: purpose
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      character(len=40) :: name
      integer :: i, j
      count%factorizations = count%factorizations + 1
      name = 'matrix of accelerations and multipliers'
      if (self%motion%m + self%motion%p == 0) name = 'mass matrix'
      associate (motion => self%motion)
         if (sys%constraints%reaction_is_general) then
            if (purpose /= for_accelerations) then
               do i = 1, sys%n
                  motion%rl(i, :) = [(-motion%gq%entry(j, i), j=1, motion%m)]
                  motion%rp(i, :) = [(-motion%kv%entry(j, i), j=1, motion%p)]
               end do
            end if
            call self%saddle%factorize(self%mass, motion%gq, motion%kv, status, t, trim(name), &
               & motion%rl, motion%rp, purpose == for_positions, self%regularization)
         else
            call self%saddle%factorize(self%mass, motion%gq, motion%kv, status, t, trim(name), &
               & hold_psi=purpose == for_positions, regularization=self%regularization)
         end if
      end associate
   end subroutine one_factorization

   !> Name the constraints that depend on others at (t, q, v), and take the regularized matrix where there are some.
   !> Larger systems are left to the factorization, which finds exact dependence alone.
   recursive subroutine start_look_for_dependence(self, sys, t, q, v, report, count, status)
      class(consistent_start), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      type(start_report), intent(inout) :: report
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      type(dependence_type) :: found
      real(wp) :: rows

      self%regularization = 0.0_wp
      rows = real(self%motion%m + self%motion%p, wp)
      if (status%failed() .or. rows**2*real(sys%n, wp) > most_rank_work) return
      if (rows < 2.0_wp .or. sys%constraints%reaction_is_general) return
      call self%motion%evaluate(sys, t, q, v, count, status)
      call find_dependent_rows(self%motion%gq, self%motion%kv, default_rank_tolerance, found, status)
      if (status%failed()) return
      if (size(found%rows) == 0) return
      report%is_redundant = .true.
      report%redundant_rows = found%rows
      report%redundant = found%sentence(1)
      if (size(found%rows) > 1) report%redundant = trim(report%redundant)//', and ' &
         & //text(size(found%rows) - 1)//' more of them on others'
      self%regularization = regularization_of_redundant
   end subroutine start_look_for_dependence

   pure real(wp) function largest(x)
      real(wp), intent(in) :: x(:)
      largest = 0.0_wp
      if (size(x) > 0) largest = maxval(abs(x))
   end function largest

   !> |dx| as a part of |x|
   pure real(wp) function part(dx, x)
      real(wp), intent(in) :: dx(:), x(:)
      part = largest(dx)
      if (part > 0.0_wp) part = part/max(largest(x), part)
   end function part

   !> What a user may ask for
   recursive subroutine report_archive(self, name, file)
      class(start_report), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      if (file%is_reading .and. allocated(self%redundant_rows)) deallocate (self%redundant_rows)
      call file%section(name)
      call file%item('g', self%g)
      call file%item('gv', self%gv)
      call file%item('k', self%k)
      call file%item('moved_q', self%moved_q)
      call file%item('moved_v', self%moved_v)
      call file%item('is_redundant', self%is_redundant)
      call file%item('redundant_rows', self%redundant_rows)
      call file%item('redundant', self%redundant)
      call file%end_section()
   end subroutine report_archive
end module dynstep_consistent_start
