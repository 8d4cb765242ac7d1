! SPDX-License-Identifier: BSD-3-Clause
!> Constraints of a mechanical system and the reactions that hold them (Jay & Negrut 2008, eqs. (11)):
!>
!>   g(t,q) = 0      holonomic, m of them, with G = dg/dq and multipliers lambda
!>   k(t,q,v) = 0    on velocities (nonholonomic), p of them, with K = dk/dv and multipliers psi
!>   r = -G^T lambda - K^T psi, or a user's r(t,q,v,lambda,psi), nonlinear in the multipliers
!>
!> PROGRAMMING INTERFACE
!>
!>   A system with constraints sets HOLONOMIC or NONHOLONOMIC, and overrides CONSTRAINT or VELOCITY_CONSTRAINT.  The
!>   rest has a default:
!>
!>     constraint_jacobian    G and dg/dt by differences
!>     constraint_curvature   g'' - G q'' by differences along the motion
!>     velocity_jacobian      K by differences
!>     velocity_curvature     k' - K q'' by differences along the motion
!>     reaction               -G^T lambda - K^T psi
!>     reaction_jacobian      dr/dlambda, dr/dpsi by differences
!>     reaction_tangent       -dr/dq, -dr/dv are left out of the iteration matrix
!>
!>   Measured on arms (sines), bars (roots) and drives (sines of time) of 1 mm to 1 km, with angles of 0 to
!>   3000 rad, at origins of up to 1 km, relative to the largest entry of a column or vector: G 1e-14 to 4e-13
!>   (4e-11 where all coordinates are of 1e-3, some of them angles); dg/dt 1e-15 to 1e-13 for drives of 0.03 to
!>   3e5 rad per unit of time, 1e-10 for 1e-7; K 1e-14, and 4e-13 where terms of 1e6 hide entries of 1;
!>   curvature by a user's G 1e-16 to 4e-12, without it 2e-14 to 1e-11, and 1e-8 at phases
!>   of 1e5 rad, which rounding of t leaves.
!>
!>   CONSTRAINTS tells what the library may rely on.  A system with m = p = 0 pays for none of this.
module dynstep_constrained_system
   use dynstep_column_groups, only: column_groups, coordinate_sizes
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_kinds, only: long, wp
   use dynstep_line_derivative, only: line_derivative
   use dynstep_matrix, only: matrix_type
   use dynstep_ode_system, only: ode_system
   use dynstep_status, only: status_type
   implicit none
   private

   !> What the library may assume of the constraints; set once, before `init` of a stepper
   type, public :: constraint_structure_type
      type(pattern_type) :: g                     !! places of G that may differ from zero; dense if none
      type(pattern_type) :: k                     !! places of K
      logical :: reaction_is_general = .false.    !! REACTION is overridden
      logical :: has_reaction_tangent = .false.   !! REACTION_TANGENT is overridden
      !> Order of the unknowns in the band of the equations, body by body: a permutation of 1 .. n
      !> (coordinates), n + 1 .. n + m (lambda), n + m + 1 .. n + m + p (psi).  Not allocated: the library
      !> looks for one where G, K, M and the tangents have patterns or bands.
      integer, allocatable :: order(:)
   end type constraint_structure_type

   !> A line through the unknowns, and a derivative along it
   type :: line_type
      type(line_derivative) :: d
      real(wp), allocatable :: x(:), direction(:)   ! [n], of reactions [m + p]
      type(column_groups) :: groups
   end type line_type

   !> Storage of the defaults, made at their first call.  Each kind of difference has its own line, as
   !> one may lie inside another.
   type :: workspace_type
      type(line_type) :: g, k, along_g, along_k, reaction
      type(jacobian_type) :: gq, kv              ! for curvatures and reactions
      real(wp), allocatable :: gt(:), r(:, :)    ! [m], [n, m + p]
   end type workspace_type

   type, abstract, extends(ode_system), public :: constrained_system
      integer :: holonomic = 0                           !! m, number of constraints g
      integer :: nonholonomic = 0                        !! p, number of constraints k
      type(constraint_structure_type) :: constraints
      integer(long) :: difference_constraints = 0        !! g, k and r evaluated for differences
      type(workspace_type), private :: dynstep_constraint_workspace
   contains
      procedure :: constraint => no_constraint
      procedure :: constraint_jacobian => difference_constraint_jacobian
      procedure :: constraint_curvature => difference_constraint_curvature
      procedure :: velocity_constraint => no_velocity_constraint
      procedure :: velocity_jacobian => difference_velocity_jacobian
      procedure :: velocity_curvature => difference_velocity_curvature
      procedure :: reaction => lagrange_reaction
      procedure :: reaction_jacobian => difference_reaction_jacobian
      procedure :: reaction_tangent => no_reaction_tangent
      procedure, non_overridable :: difference_constraint_jacobian
      procedure, non_overridable :: difference_constraint_curvature
      procedure, non_overridable :: difference_velocity_jacobian
      procedure, non_overridable :: difference_velocity_curvature
      procedure, non_overridable :: difference_reaction_jacobian
      procedure, non_overridable :: lagrange_reaction
   end type constrained_system

   !> First steps of the tables, relative to the sizes of what is moved: the four-point difference for g,
   !> where the four evaluations are what counts; longer ones where the function is most often linear
   real(wp), parameter :: step_of_g = 2.0_wp**(-9), step_of_k = 2.0_wp**(-5), step_of_reaction = 0.25_wp
   !> In time and along the motion: long, as the table settles at 1e-10 of the time scale from there, and
   !> not a simple part of the period of a drive
   real(wp), parameter :: step_in_time = 1.25_wp/16.0_wp, step_of_motion = 0.125_wp
   !> Longest time scale of a motion, in units of the user's time
   real(wp), parameter :: longest_unit = 2.0_wp**20

contains

   !> g(t,q) = 0: an override fills g
   recursive subroutine no_constraint(self, t, q, g, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      ierr = merge(0, -1, self%holonomic == 0)
      g = 0.0_wp
   end subroutine no_constraint

   !> G = dg/dq and dg/dt.  An override fills both, which are zero on entry.
   !>
   !> By differences: four evaluations of g for each group of columns of which no two meet in a row, more
   !> where they turn out too inaccurate; two for dg/dt where g does not change with t, else about ten.
   recursive subroutine difference_constraint_jacobian(self, t, q, gq, gt, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq        !! G [m, n], in the pattern constraints%g
      real(wp), intent(inout) :: gt(self%holonomic)   !! dg/dt
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      integer :: group

      call fit_line(self%dynstep_constraint_workspace%g, self%n, self%holonomic)
      associate (w => self%dynstep_constraint_workspace%g)
         call w%groups%fit(gq)
         ierr = 0
         do group = 1, w%groups%number
            call set_direction(w, q, group)
            call w%d%begin(1, step_of_g, 1.0_wp, four_points=.true.)
            do while (w%d%is_running)
               w%x = q + w%d%point()*w%direction
               call self%constraint(t, w%x, w%d%f, ierr)
               self%difference_constraints = self%difference_constraints + 1
               call w%d%give(ierr)
            end do
            ierr = w%d%ierr
            if (ierr /= 0) return
            call collect(w, group, gq)
         end do
      end associate
      call difference_by_time(self, t, q, gt, ierr)
   end subroutine difference_constraint_jacobian

   !> dg/dt; zero where g is the same, to the bit, at two other times
   recursive subroutine difference_by_time(self, t, q, gt, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      associate (w => self%dynstep_constraint_workspace%g)
         call self%constraint(t + step_in_time, q, w%d%f, ierr)
         self%difference_constraints = self%difference_constraints + 1
         if (ierr == 0) then
            gt = w%d%f
            call self%constraint(t - 0.5_wp*step_in_time, q, w%d%f, ierr)
            self%difference_constraints = self%difference_constraints + 1
            if (ierr == 0) then
               gt = abs(gt - w%d%f)
               if (.not. any(gt > 0.0_wp)) return
            end if
         end if
         gt = 0.0_wp
         if (ierr < 0) return
         call w%d%begin(1, step_in_time, 1.0_wp, four_points=.false.)
         do while (w%d%is_running)
            call self%constraint(t + w%d%point(), q, w%d%f, ierr)
            self%difference_constraints = self%difference_constraints + 1
            call w%d%give(ierr)
         end do
         ierr = w%d%ierr
         if (ierr == 0) gt = w%d%value
      end associate
   end subroutine difference_by_time

   !> c = g_tt + 2 g_tq v + g_qq(v, v), so that g'' = G q'' + c.  An override fills c.
   !>
   !> With s the time along the motion (t + s, q + s v) this is d(G v + g_t)/ds where the user gives G,
   !> and d^2 g/ds^2, which needs fewer evaluations and has less rounding, where G comes by differences.
   recursive subroutine difference_constraint_curvature(self, t, q, v, c, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      integer(long) :: before
      logical :: by_differences
      real(wp) :: unit

      c = 0.0_wp
      before = self%difference_constraints
      call fit_jacobians(self, ierr)
      if (ierr == 0) call jacobian_at(self, t, q, ierr)
      if (ierr /= 0) return
      by_differences = self%difference_constraints > before
      call fit_line(self%dynstep_constraint_workspace%along_g, self%n, self%holonomic)
      associate (w => self%dynstep_constraint_workspace%along_g, gq => self%dynstep_constraint_workspace%gq, &
         & gt => self%dynstep_constraint_workspace%gt)
         unit = time_of_motion(q, v)
         call w%d%begin(merge(2, 1, by_differences), step_of_motion*unit, unit, four_points=.false.)
         call row_sizes(gq, v, w%d%rates)
         w%d%rates = (w%d%rates + abs(gt))/unit
         do while (w%d%is_running)
            w%x = q + w%d%point()*v
            if (by_differences) then
               call self%constraint(t + w%d%point(), w%x, w%d%f, ierr)
               self%difference_constraints = self%difference_constraints + 1
            else
               call jacobian_at(self, t + w%d%point(), w%x, ierr)
               if (ierr == 0) call gq%multiply(v, w%d%f)
               if (ierr == 0) w%d%f = w%d%f + gt
            end if
            call w%d%give(ierr)
         end do
         ierr = w%d%ierr
         if (ierr == 0) c = w%d%value
      end associate
   end subroutine difference_constraint_curvature

   !> k(t,q,v) = 0: an override fills k
   recursive subroutine no_velocity_constraint(self, t, q, v, k, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: k(self%nonholonomic)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      ierr = merge(0, -1, self%nonholonomic == 0)
      k = 0.0_wp
   end subroutine no_velocity_constraint

   !> K = dk/dv.  An override fills it; it is zero on entry.
   !>
   !> By differences: four evaluations of k for each group of columns, more where k is not linear in v
   recursive subroutine difference_velocity_jacobian(self, t, q, v, kv, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(jacobian_type), intent(inout) :: kv        !! K [p, n], in the pattern constraints%k
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      integer :: group

      call fit_line(self%dynstep_constraint_workspace%k, self%n, self%nonholonomic)
      associate (w => self%dynstep_constraint_workspace%k)
         call w%groups%fit(kv)
         ierr = 0
         do group = 1, w%groups%number
            call set_direction(w, v, group)
            call w%d%begin(1, step_of_k, 1.0_wp, four_points=.true.)
            do while (w%d%is_running)
               w%x = v + w%d%point()*w%direction
               call self%velocity_constraint(t, q, w%x, w%d%f, ierr)
               self%difference_constraints = self%difference_constraints + 1
               call w%d%give(ierr)
            end do
            ierr = w%d%ierr
            if (ierr /= 0) return
            call collect(w, group, kv)
         end do
      end associate
   end subroutine difference_velocity_jacobian

   !> c = k_t + k_q v, so that k' = K q'' + c.  An override fills c.
   !>
   !> By differences: dk/ds of k(t + s, q + s v, v)
   recursive subroutine difference_velocity_curvature(self, t, q, v, c, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%nonholonomic)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      real(wp) :: unit

      c = 0.0_wp
      call fit_jacobians(self, ierr)
      if (ierr == 0) call velocity_jacobian_at(self, t, q, v, ierr)
      if (ierr /= 0) return
      call fit_line(self%dynstep_constraint_workspace%along_k, self%n, self%nonholonomic)
      associate (w => self%dynstep_constraint_workspace%along_k, kv => self%dynstep_constraint_workspace%kv)
         unit = time_of_motion(q, v)
         call w%d%begin(1, step_of_motion*unit, unit, four_points=.false.)
         call row_sizes(kv, v, w%d%rates)
         w%d%rates = w%d%rates/unit
         do while (w%d%is_running)
            w%x = q + w%d%point()*v
            call self%velocity_constraint(t + w%d%point(), w%x, v, w%d%f, ierr)
            self%difference_constraints = self%difference_constraints + 1
            call w%d%give(ierr)
         end do
         ierr = w%d%ierr
         if (ierr == 0) c = w%d%value
      end associate
   end subroutine difference_velocity_curvature

   !> r = -G^T lambda - K^T psi.  An override goes with constraints%reaction_is_general, and may call
   !> self%lagrange_reaction for this part of it; the library does not call this procedure without it.
   recursive subroutine lagrange_reaction(self, t, q, v, lambda, psi, r, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(out) :: r(self%n)
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      r = 0.0_wp
      call fit_jacobians(self, ierr)
      if (ierr == 0) call jacobian_at(self, t, q, ierr)
      if (ierr == 0) call velocity_jacobian_at(self, t, q, v, ierr)
      if (ierr /= 0) return
      call self%dynstep_constraint_workspace%gq%transposed_add(-1.0_wp, lambda, r)
      call self%dynstep_constraint_workspace%kv%transposed_add(-1.0_wp, psi, r)
   end subroutine lagrange_reaction

   !> dr/dlambda and dr/dpsi.  An override fills both, which are zero on entry.
   !>
   !> By differences of the reaction: four evaluations for each multiplier in which it is linear
   recursive subroutine difference_reaction_jacobian(self, t, q, v, lambda, psi, rl, rp, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      real(wp), intent(inout) :: rl(self%n, self%holonomic)      !! dr/dlambda
      real(wp), intent(inout) :: rp(self%n, self%nonholonomic)   !! dr/dpsi
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      integer :: j

      ierr = 0
      associate (m => self%holonomic, p => self%nonholonomic, w => self%dynstep_constraint_workspace%reaction)
         call fit_line(w, m + p, self%n)
         do j = 1, m + p
            ! sizes of the multipliers of each kind, which differ in their units
            call coordinate_sizes(lambda, w%direction(:m))
            call coordinate_sizes(psi, w%direction(m + 1:))
            call w%d%begin(1, step_of_reaction, 1.0_wp, four_points=.true.)
            do while (w%d%is_running)
               w%x(:m) = lambda
               w%x(m + 1:) = psi
               w%x(j) = w%x(j) + w%d%point()*w%direction(j)
               call self%reaction(t, q, v, w%x(:m), w%x(m + 1:), w%d%f, ierr)
               self%difference_constraints = self%difference_constraints + 1
               call w%d%give(ierr)
            end do
            ierr = w%d%ierr
            if (ierr /= 0) return
            if (j <= m) rl(:, j) = w%d%value/w%direction(j)
            if (j > m) rp(:, j - m) = w%d%value/w%direction(j)
         end do
      end associate
   end subroutine difference_reaction_jacobian

   !> Tangents of the reactions, -dr/dq and -dr/dv (geometric stiffness), in the storage of
   !> structure%tangent, to be added to K and C.  Only the speed of Newton's iteration depends on
   !> them.  An override goes with constraints%has_reaction_tangent.
   recursive subroutine no_reaction_tangent(self, t, q, v, lambda, psi, k, c, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(in) :: lambda(self%holonomic), psi(self%nonholonomic)
      type(matrix_type), intent(inout) :: k           !! -dr/dq is added
      type(matrix_type), intent(inout) :: c           !! -dr/dv is added; of kind_zero without velocities
      integer, intent(out) :: ierr                    !! 0, > 0 smaller step, < 0 give up
      ierr = 0
   end subroutine no_reaction_tangent

   !> G and dg/dt in the workspace
   recursive subroutine jacobian_at(self, t, q, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t, q(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      if (self%holonomic == 0) return
      call self%dynstep_constraint_workspace%gq%set_zero()
      self%dynstep_constraint_workspace%gt = 0.0_wp
      call self%constraint_jacobian(t, q, self%dynstep_constraint_workspace%gq, self%dynstep_constraint_workspace%gt, ierr)
   end subroutine jacobian_at

   !> K in the workspace
   recursive subroutine velocity_jacobian_at(self, t, q, v, ierr)
      class(constrained_system), intent(inout) :: self
      real(wp), intent(in) :: t, q(self%n), v(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      if (self%nonholonomic == 0) return
      call self%dynstep_constraint_workspace%kv%set_zero()
      call self%velocity_jacobian(t, q, v, self%dynstep_constraint_workspace%kv, ierr)
   end subroutine velocity_jacobian_at

   !> Storage of G, K, dg/dt in the workspace; no work where it is there
   recursive subroutine fit_jacobians(self, ierr)
      class(constrained_system), intent(inout) :: self
      integer, intent(out) :: ierr
      type(status_type) :: status
      associate (w => self%dynstep_constraint_workspace, m => self%holonomic, p => self%nonholonomic)
         if (.not. self%constraints%g%is_that_of(w%gq, m, self%n)) call w%gq%init(m, self%n, self%constraints%g, status)
         if (.not. self%constraints%k%is_that_of(w%kv, p, self%n)) call w%kv%init(p, self%n, self%constraints%k, status)
         if (allocated(w%gt)) then
            if (size(w%gt) /= m) deallocate (w%gt)
         end if
         if (.not. allocated(w%gt)) allocate (w%gt(m))
      end associate
      ierr = merge(-1, 0, status%failed())
   end subroutine fit_jacobians

   pure subroutine fit_line(line, n, m)
      type(line_type), intent(inout) :: line
      integer, intent(in) :: n               !! unknowns that are moved
      integer, intent(in) :: m               !! components of the function
      call line%d%resize(m)
      if (allocated(line%x)) then
         if (size(line%x) == n) return
         deallocate (line%x, line%direction)
      end if
      allocate (line%x(n), line%direction(n))
   end subroutine fit_line

   !> The coordinates of one group move by their sizes
   pure subroutine set_direction(line, x, group)
      type(line_type), intent(inout) :: line
      real(wp), intent(in) :: x(:)
      integer, intent(in) :: group
      call coordinate_sizes(x, line%direction)
      where (line%groups%of_column /= group) line%direction = 0.0_wp
   end subroutine set_direction

   !> Entries of the columns of one group
   pure subroutine collect(line, group, jacobian)
      type(line_type), intent(in) :: line
      integer, intent(in) :: group
      type(jacobian_type), intent(inout) :: jacobian
      integer :: i, e
      do i = 1, jacobian%rows
         do e = jacobian%first(i), jacobian%first(i + 1) - 1
            if (line%groups%of_column(jacobian%column(e)) /= group) cycle
            jacobian%value(e) = line%d%value(i)/line%direction(jacobian%column(e))
         end do
      end do
   end subroutine collect

   !> sizes(i) = sum over j of |A(i,j) x(j)|
   pure subroutine row_sizes(a, x, sizes)
      type(jacobian_type), intent(in) :: a
      real(wp), intent(in) :: x(:)
      real(wp), intent(out) :: sizes(:)
      integer :: i, e
      do i = 1, a%rows
         sizes(i) = 0.0_wp
         do e = a%first(i), a%first(i + 1) - 1
            sizes(i) = sizes(i) + abs(a%value(e)*x(a%column(e)))
         end do
      end do
   end subroutine row_sizes

   !> Time in which the fastest coordinate moves by its size, or by 1 where it is smaller.  A time that is
   !> too long costs evaluations, one that is too short costs digits.  A power of two, for the sake of t.
   pure real(wp) function time_of_motion(q, v) result(time)
      real(wp), intent(in) :: q(:), v(:)
      real(wp) :: rate
      integer :: j
      rate = 0.0_wp
      do j = 1, size(q)
         rate = max(rate, abs(v(j))/max(abs(q(j)), 1.0_wp))
      end do
      time = 1.0_wp
      if (rate > 1.0_wp/longest_unit) then
         time = 2.0_wp**(1 - exponent(rate))
      else if (rate > 0.0_wp) then
         time = longest_unit
      end if
   end function time_of_motion
end module dynstep_constrained_system
