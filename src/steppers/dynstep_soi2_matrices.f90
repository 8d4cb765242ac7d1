! SPDX-License-Identifier: BSD-3-Clause
!> The two block matrices of a step of generalized-alpha-SOI2, and one correction with them.
!>
!> With the unknowns of DYNSTEP_SOI2_EQUATIONS, c_m = 1 - alpha_m, c_f = 1 - alpha_f, and the tangents Kq, Cv of the
!> forces, the sum of R and D is an equation for u = da + ddelta, the change of y1 / b, and D one for ddelta:
!>
!>   [S,  G^T, K^T; G, 0, 0; K, 0, 0] (u, ...)      = -((R + D - c_f c Cv ddelta)/c_m, g/b, k~/c)
!>   [M1, G^T, K^T; G, 0, 0; K, 0, 0] (ddelta, ...) = -(D/c_m, g/b - g'/c - (b/c) Y u, (k~ - k(y1 + b u))/c)
!>
!> with S = M1 + (c_f/c_m) (b Kq + c Cv) and Y = d(G z)/dy, and multipliers times c_f/c_m (lambda + mu and psi + nu in the
!> first, mu and nu in the second system).  Second derivatives commute: Y is the derivative of G along the motion, which
!> (G1 - G0)/h gives with an error of O(h).  What is left out is O(h^2) for any stiffness of the forces: the change of
!> G^T lambda with y1, unless the system has a `reaction_tangent`.  Where the forces are not stiff S is replaced by M1, and
!> one factorization serves both.  Without differences (no g, or index 3) a correction is one solve with S.
module dynstep_soi2_matrices
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: check_callback
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: long, wp
   use dynstep_matrix, only: kind_banded, kind_diagonal, kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_saddle_point, only: saddle_point_type
   use dynstep_soi2_equations, only: soi2_equations
   use dynstep_status, only: dynstep_not_finite, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   public :: correction_length, position_part

   type, public :: soi2_matrices
      logical :: is_made = .false.                       !! factors are there
      logical :: is_exact = .false.                      !! one correction solves the equations
      logical :: knows_tangents = .false.                !! Kq and Cv are there
      real(wp) :: regularization = 0.0_wp                !! of redundant constraints, see dynstep_consistent_start
      real(wp) :: made_b = 0.0_wp, made_c = 0.0_wp       !! b and c of the factors
      logical :: is_stiff = .false.                      !! Kq and Cv take part in S
      logical, private :: has_mass_factors = .false.     ! saddle_m of the last `renew`
      logical, private :: has_stiff_factors = .false.    ! saddle_s
      logical, private :: tangents_are_given = .false.   ! by the user, so that they cost little
      type(matrix_type), private :: k, c, s
      type(saddle_point_type), allocatable, private :: saddle_m, saddle_s
      real(wp), allocatable, private :: zero(:), k_rows(:), c_rows(:), x(:), ddelta(:), l(:), q(:)
      real(wp), allocatable, private :: dmu(:), dnu(:)
   contains
      procedure :: init => matrices_init
      procedure :: forget => matrices_forget
      procedure :: renew => matrices_renew
      procedure :: correct => matrices_correct
      procedure :: prepare_projection => matrices_prepare_projection
      procedure :: can_project => matrices_can_project
      procedure :: project => matrices_project
      procedure :: reduce_multipliers => matrices_reduce_multipliers
      procedure :: archive => matrices_archive
   end type soi2_matrices

   !> Stiffness ratio b |Kq|/M, c |Cv|/M from which on the tangents take part in S: without them the iteration
   !> contracts by about this ratio, and 1e-4 does not cost a third correction
   real(wp), parameter :: stiff_above = 1.0e-4_wp

contains

   recursive subroutine matrices_init(self, sys, status)
      class(soi2_matrices), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer :: kind_s, kl, ku

      if (status%failed()) return
      if (allocated(self%saddle_m)) deallocate (self%saddle_m, self%saddle_s, self%zero, self%k_rows, self%c_rows, &
         & self%x, self%ddelta, self%l, self%q, self%dmu, self%dnu)
      allocate (self%saddle_m, self%saddle_s)
      associate (s => sys%structure, n => sys%n, m => sys%holonomic, p => sys%nonholonomic, con => sys%constraints)
         call self%k%init(s%tangent, n, s%kl, s%ku, s%tangent_is_symmetric, status)
         call self%c%init(merge(kind_zero, s%tangent, s%velocity_free), n, s%kl, s%ku, s%tangent_is_symmetric, status)
         kind_s = max(s%mass, s%tangent, kind_diagonal)
         kl = max(merge(s%mass_kl, 0, s%mass == kind_banded), merge(s%kl, 0, s%tangent == kind_banded))
         ku = max(merge(s%mass_ku, 0, s%mass == kind_banded), merge(s%ku, 0, s%tangent == kind_banded))
         call self%s%init(kind_s, n, kl, ku, s%mass_is_symmetric .and. s%tangent_is_symmetric, status)
         call self%saddle_m%init(n, m, p, s%mass, s%mass_kl, s%mass_ku, s%mass_is_symmetric, con%g, con%k, &
            & con%reaction_is_general, con%order, status)
         call self%saddle_s%init(n, m, p, kind_s, kl, ku, s%mass_is_symmetric .and. s%tangent_is_symmetric, con%g, con%k, &
            & con%reaction_is_general, con%order, status)
         if (status%failed()) return
         allocate (self%zero(n), self%k_rows(n), self%c_rows(n), self%x(n), self%ddelta(n), self%l(m), self%q(p), &
            & self%dmu(m), self%dnu(p), source=0.0_wp)
      end associate
      call self%forget()
   end subroutine matrices_init

   pure subroutine matrices_forget(self)
      class(soi2_matrices), intent(inout) :: self
      self%is_made = .false.
      self%knows_tangents = .false.
      self%regularization = 0.0_wp
      self%has_mass_factors = .false.
      self%has_stiff_factors = .false.
   end subroutine matrices_forget

   !> New factors at the point of the last evaluation
   recursive subroutine matrices_renew(self, sys, eqs, count, status)
      class(soi2_matrices), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(soi2_equations), intent(inout) :: eqs
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      self%is_made = .false.
      self%has_mass_factors = .false.
      self%has_stiff_factors = .false.
      call eqs%motion%differentiate_reaction(sys, eqs%t1, eqs%y1, eqs%z1, eqs%lambda, eqs%psi, status)
      call take_tangents(self, sys, eqs, count, status)
      if (status%failed()) return
      self%is_stiff = self%is_exact
      if (.not. self%is_exact) self%is_stiff = stiffness_ratio(self, eqs) > stiff_above
      if (eqs%has_differences .or. .not. self%is_stiff .or. self%regularization > 0.0_wp) then
         call factorize(self, sys, eqs, eqs%m1, self%saddle_m, count, status)
         self%has_mass_factors = .not. status%failed()
      end if
      if (self%is_stiff .and. .not. status%failed()) then
         associate (ratio => multiplier_scale(eqs))
            call self%s%set_zero()
            call eqs%m1%add_to(1.0_wp, self%s)
            call self%k%add_to(ratio*eqs%b, self%s)
            call self%c%add_to(ratio*eqs%c, self%s)
         end associate
         call factorize(self, sys, eqs, self%s, self%saddle_s, count, status)
         self%has_stiff_factors = .not. status%failed()
      end if
      status%retry = status%failed()
      self%is_made = .not. status%failed()
      self%made_b = eqs%b
      self%made_c = eqs%c
   end subroutine matrices_renew

   !> (1 - alpha_f)/(1 - alpha_m)
   pure real(wp) function multiplier_scale(eqs)
      type(soi2_equations), intent(in) :: eqs
      multiplier_scale = (1.0_wp - eqs%coefficients%alpha_f)/(1.0_wp - eqs%coefficients%alpha_m)
   end function multiplier_scale

   recursive subroutine factorize(self, sys, eqs, block, saddle, count, status)
      class(soi2_matrices), intent(in) :: self
      class(mechanical_system), intent(in) :: sys
      type(soi2_equations), intent(in) :: eqs
      type(matrix_type), intent(in) :: block
      type(saddle_point_type), intent(inout) :: saddle
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      character(len=*), parameter :: name = 'matrix of Newton''s iteration'
      count%factorizations = count%factorizations + 1
      associate (motion => eqs%motion)
         if (sys%constraints%reaction_is_general) then
            call saddle%factorize(block, motion%gq, motion%kv, status, eqs%t1, name, motion%rl, motion%rp, &
               & regularization=self%regularization)
         else
            call saddle%factorize(block, motion%gq, motion%kv, status, eqs%t1, name, regularization=self%regularization)
         end if
      end associate
   end subroutine factorize

   !> Kq and Cv of the forces and, where the system has it, of the reactions.  Those by differences are kept until
   !> the iteration contracts poorly.
   recursive subroutine take_tangents(self, sys, eqs, count, status)
      class(soi2_matrices), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(soi2_equations), intent(in) :: eqs
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer(long) :: before
      integer :: ierr

      if (status%failed()) return
      associate (s => sys%structure, con => sys%constraints)
         if (self%knows_tangents) then
            if (.not. (self%is_stiff .and. self%tangents_are_given)) return
            if (s%tangent_is_constant .and. .not. con%has_reaction_tangent) return
         end if
         call self%k%set_zero()
         call self%c%set_zero()
         before = sys%difference_forces
         call sys%tangent(eqs%t1, eqs%y1, eqs%z1, self%zero, self%k, self%c, ierr)
         count%tangents = count%tangents + 1
         count%forces = count%forces + (sys%difference_forces - before)
         call check_callback('tangent', ierr, eqs%t1, status)
         if (status%failed()) return
         self%tangents_are_given = sys%difference_forces == before
         call check_tangents(self, 'tangent', eqs%t1, status)
         if (status%failed()) return
         if (con%has_reaction_tangent) then
            call sys%reaction_tangent(eqs%t1, eqs%y1, eqs%z1, eqs%lambda, eqs%psi, self%k, self%c, ierr)
            call check_callback('reaction_tangent', ierr, eqs%t1, status)
            call check_tangents(self, 'reaction_tangent', eqs%t1, status)
            if (status%failed()) return
         end if
         ! old matrices would be wrong where M or the tangents change
         self%is_exact = s%force_is_linear .and. s%mass_is_constant .and. s%tangent_is_constant .and. &
            & self%tangents_are_given .and. sys%holonomic + sys%nonholonomic == 0
      end associate
      self%knows_tangents = .true.
      call self%k%absolute_row_sums(self%k_rows)
      call self%c%absolute_row_sums(self%c_rows)
   end subroutine take_tangents

   !> A status where Kq or Cv has an entry that is NaN or infinite
   pure subroutine check_tangents(self, name, t, status)
      class(soi2_matrices), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: t
      type(status_type), intent(inout) :: status
      integer :: row, column
      if (status%failed()) return
      call self%k%first_not_finite(row, column)
      if (row == 0 .and. self%c%kind /= kind_zero) call self%c%first_not_finite(row, column)
      if (row > 0) call status%set(dynstep_not_finite, name//' returned a number that is not finite in row '//text(row) &
         & //', column '//text(column)//' at t = '//text(t)//'; a smaller step may keep it in its domain', retry=.true.)
   end subroutine check_tangents

   !> How much stiffness and damping of the step outweigh the mass, by rows; huge() where they act on no mass
   pure real(wp) function stiffness_ratio(self, eqs) result(ratio)
      class(soi2_matrices), intent(in) :: self
      type(soi2_equations), intent(in) :: eqs
      real(wp) :: row, mass
      integer :: i
      ratio = 0.0_wp
      do i = 1, size(self%k_rows)
         row = abs(multiplier_scale(eqs))*max(eqs%b*self%k_rows(i), abs(eqs%c)*self%c_rows(i))
         mass = abs(eqs%m1%entry(i, i))
         if (row <= ratio*mass) cycle
         if (mass <= row*tiny(mass)) then
            ratio = huge(ratio)
            return
         end if
         ratio = row/mass
      end do
   end function stiffness_ratio

   !> One correction of all unknowns
   recursive subroutine matrices_correct(self, sys, eqs, length, count, status)
      class(soi2_matrices), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(soi2_equations), intent(inout) :: eqs
      real(wp), intent(out) :: length           !! of the correction, as a part of y, z and multipliers
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: c_m, scale

      length = huge(length)
      c_m = 1.0_wp - eqs%coefficients%alpha_m
      scale = 1.0_wp/multiplier_scale(eqs)
      if (eqs%has_differences) then
         call correct_sum(self, eqs, c_m, count)
         call correct_differences(self, sys, eqs, c_m, count, status)
         if (status%failed()) return
         eqs%delta = eqs%delta + self%ddelta
         eqs%mu = eqs%mu + scale*self%dmu
         eqs%nu = eqs%nu + scale*self%dnu
         self%x = self%x - self%ddelta
         self%l = self%l - self%dmu
         self%q = self%q - self%dnu
      else
         self%x = -eqs%r/c_m
         self%l = -eqs%rl
         self%q = -eqs%rk
         call solve_with_s(self, count)
      end if
      eqs%a = eqs%a + self%x
      self%l = scale*self%l
      self%q = scale*self%q
      eqs%lambda = eqs%lambda + self%l
      eqs%psi = eqs%psi + self%q
      length = correction_length(eqs, self%x, self%ddelta, self%l, self%q)
      eqs%moved = position_part(eqs, self%x, self%ddelta)
   end subroutine matrices_correct

   !> u and the changes of lambda + mu, psi + nu.  Strong damping acts on da = u - ddelta, for which a first ddelta is
   !> good enough.
   recursive subroutine correct_sum(self, eqs, c_m, count)
      class(soi2_matrices), intent(inout) :: self
      type(soi2_equations), intent(inout) :: eqs
      real(wp), intent(in) :: c_m
      type(step_counters), intent(inout) :: count
      self%x = eqs%r + eqs%d
      if (self%is_stiff .and. self%c%kind /= kind_zero) then
         self%ddelta = -eqs%d/c_m
         self%dmu = -eqs%dl
         self%dnu = -eqs%dk
         call self%saddle_m%solve(self%ddelta, self%dmu, self%dnu)
         count%solves = count%solves + 1
         call self%c%multiply_add(-(1.0_wp - eqs%coefficients%alpha_f)*eqs%c, self%ddelta, self%x)
      end if
      self%x = -self%x/c_m
      self%l = -(eqs%rl + eqs%dl)
      self%q = -(eqs%rk + eqs%dk)
      call solve_with_s(self, count)
   end subroutine correct_sum

   !> ddelta, dmu, dnu, with what the change b u of y1 does to g' and k
   recursive subroutine correct_differences(self, sys, eqs, c_m, count, status)
      class(soi2_matrices), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(soi2_equations), intent(inout) :: eqs
      real(wp), intent(in) :: c_m
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      self%ddelta = -eqs%d/c_m
      call eqs%change_of_velocity_residual(self%x, self%dmu)
      self%dmu = self%dmu - eqs%dl
      call eqs%change_of_nonholonomic(sys, self%x, self%dnu, count, status)
      if (status%failed()) return
      self%dnu = self%dnu - eqs%dk
      call self%saddle_m%solve(self%ddelta, self%dmu, self%dnu)
      count%solves = count%solves + 1
   end subroutine correct_differences

   pure subroutine solve_with_s(self, count)
      class(soi2_matrices), intent(inout) :: self
      type(step_counters), intent(inout) :: count
      if (self%is_stiff) then
         call self%saddle_s%solve(self%x, self%l, self%q)
      else
         call self%saddle_m%solve(self%x, self%l, self%q)
      end if
      count%solves = count%solves + 1
   end subroutine solve_with_s

   !> Factors for `project`: those of the iteration, or where it had none, as with the whole Jacobian alone, new ones
   recursive subroutine matrices_prepare_projection(self, sys, eqs, count, status)
      class(soi2_matrices), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(soi2_equations), intent(inout) :: eqs
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      if (status%failed() .or. self%can_project()) return
      call eqs%motion%differentiate_reaction(sys, eqs%t1, eqs%y1, eqs%z1, eqs%lambda, eqs%psi, status)
      call factorize(self, sys, eqs, eqs%m1, self%saddle_m, count, status)
      self%has_mass_factors = .not. status%failed()
   end subroutine matrices_prepare_projection

   !> There are factors for `project`
   pure logical function matrices_can_project(self)
      class(soi2_matrices), intent(in) :: self
      matrices_can_project = self%has_mass_factors .or. self%has_stiff_factors
   end function matrices_can_project

   !> x without its part across the constraints, G x = 0 and K x = psi; M times that part is G^T lambda + K^T psi.  Where the
   !> iteration has factors of S alone, S stands for M.
   pure subroutine matrices_project(self, eqs, x, lambda, psi)
      class(soi2_matrices), intent(inout) :: self
      type(soi2_equations), intent(in) :: eqs
      real(wp), intent(inout) :: x(:)           !! [n]
      real(wp), intent(out) :: lambda(:)        !! [m]
      real(wp), intent(inout) :: psi(:)         !! [p] K x that is wanted; the multipliers
      lambda = 0.0_wp
      self%x = 0.0_wp
      if (self%has_mass_factors) then
         call eqs%m1%multiply_add(1.0_wp, x, self%x)
         call self%saddle_m%solve(self%x, lambda, psi)
      else
         call self%s%multiply_add(1.0_wp, x, self%x)
         call self%saddle_s%solve(self%x, lambda, psi)
      end if
      x = self%x
   end subroutine matrices_project

   !> Among the multipliers of redundant constraints that give the same reaction, those of least norm (each weighed by
   !> its row's G M^-1 G^T); twice, because the regularized matrix takes a part of 1e-8 of all away.  Without this, rounding
   !> errors divided by 1e-8 gather in what no equation fixes: 7e4 instead of 50 on the pendulum with a row (g1 + g2)/3.
   pure subroutine matrices_reduce_multipliers(self, eqs)
      class(soi2_matrices), intent(inout) :: self
      type(soi2_equations), intent(inout) :: eqs
      integer :: pass
      if (self%regularization <= 0.0_wp .or. .not. self%is_made) return
      self%dmu = 0.0_wp
      self%dnu = 0.0_wp
      do pass = 1, 2
         self%x = 0.0_wp
         self%l = eqs%lambda - self%dmu
         self%q = eqs%psi - self%dnu
         call eqs%motion%gq%transposed_add(1.0_wp, self%l, self%x)
         call eqs%motion%kv%transposed_add(1.0_wp, self%q, self%x)
         self%l = 0.0_wp
         self%q = 0.0_wp
         call self%saddle_m%solve(self%x, self%l, self%q)
         self%dmu = self%dmu + self%l
         self%dnu = self%dnu + self%q
      end do
      eqs%lambda = self%dmu
      eqs%psi = self%dnu
   end subroutine matrices_reduce_multipliers

   !> The correction as a part of y1, z1 and the multipliers, each by its largest component; not finite where one
   !> of them is not.  Rounding errors of z1 are c a, and those of a are those of multipliers: as a part of the
   !> multipliers a thousandth of the correction counts, and less where z1/c is larger than the accelerations.
   pure real(wp) function correction_length(eqs, da, ddelta, dlambda, dpsi) result(length)
      type(soi2_equations), intent(in) :: eqs
      real(wp), intent(in) :: da(:), ddelta(:)
      real(wp), intent(in) :: dlambda(:), dpsi(:)
      real(wp) :: y, z, a, dy, dz, total, force
      integer :: i
      total = 0.0_wp
      y = 0.0_wp
      z = 0.0_wp
      a = 0.0_wp
      dy = 0.0_wp
      dz = 0.0_wp
      do i = 1, size(da)
         y = max(y, abs(eqs%y1(i)))
         z = max(z, abs(eqs%z1(i)))
         a = max(a, abs(eqs%a(i)))
         dz = max(dz, abs(da(i)))
         dy = max(dy, abs(da(i) + ddelta(i)))
         total = total + (da(i) + ddelta(i))
      end do
      length = total
      if (.not. ieee_is_finite(total)) return
      dy = abs(eqs%b)*dy
      dz = abs(eqs%c)*dz
      z = max(z, abs(eqs%h)*a)
      y = max(y, abs(eqs%h)*z)
      length = max(part(dy, y), part(dz, z))
      if (size(dlambda) + size(dpsi) == 0) return
      force = eqs%mass_size*z/max(abs(eqs%c), tiny(z))
      length = max(length, multiplier_part(dlambda, eqs%lambda, force), multiplier_part(dpsi, eqs%psi, force))
   end function correction_length

   !> The correction of y1 and of h z1 as a part of y1: what it is where z1 and a themselves are rounding errors,
   !> as in a mechanism at rest
   pure real(wp) function position_part(eqs, da, ddelta)
      type(soi2_equations), intent(in) :: eqs
      real(wp), intent(in) :: da(:), ddelta(:)
      real(wp) :: change
      change = max(abs(eqs%b)*maxval(abs(da + ddelta)), abs(eqs%h*eqs%c)*maxval(abs(da)))
      position_part = part(change, maxval(abs(eqs%y1)))
   end function position_part

   pure real(wp) function multiplier_part(change, multipliers, force) result(change_part)
      real(wp), intent(in) :: change(:), multipliers(:)
      real(wp), intent(in) :: force        !! that changes z1 by its own size in a step
      change_part = 0.0_wp
      if (size(change) > 0) change_part = part(maxval(abs(change)), max(1.0e3_wp*maxval(abs(multipliers)), force))
   end function multiplier_part

   pure real(wp) function part(change, whole)
      real(wp), intent(in) :: change, whole
      part = change/max(whole, change, tiny(change))
   end function part

   !> Tangents that are known, and the factors that RENEW made
   recursive subroutine matrices_archive(self, name, has_differences, file)
      class(soi2_matrices), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: has_differences         !! of the equations
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('is_made', self%is_made)
      call file%item('is_exact', self%is_exact)
      call file%item('is_stiff', self%is_stiff)
      call file%item('knows_tangents', self%knows_tangents)
      call file%item('tangents_are_given', self%tangents_are_given)
      call file%item('regularization', self%regularization)
      call file%item('made_b', self%made_b)
      call file%item('made_c', self%made_c)
      if (self%is_made .or. self%knows_tangents) then
         call self%k%archive('k', file)
         call self%c%archive('c', file)
         call file%item('k_rows', self%k_rows)
         call file%item('c_rows', self%c_rows)
      end if
      if (self%is_made) then
         if (has_differences .or. .not. self%is_stiff .or. self%regularization > 0.0_wp) &
            & call self%saddle_m%archive('saddle_m', file)
         if (self%is_stiff) call self%saddle_s%archive('saddle_s', file)
      end if
      call file%end_section()
      if (file%failed()) call self%forget()
   end subroutine matrices_archive
end module dynstep_soi2_matrices
