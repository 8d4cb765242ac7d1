! SPDX-License-Identifier: BSD-3-Clause
!> A run that is archived and goes on in a new stepper, on a new copy of its system, gives the bits and the counters of
!> one that was never interrupted: every family, every way through its steps, varied lengths, rejected trials.
module test_continuation
   use dynstep, only: allocate_state, archive_type, backinterpolation_stepper, beam_timoshenko, clock_type, &
      & extrapolation_stepper, flexible_arm, form_parallel, form_product, form_refined, halves_fehlberg, &
      & hht_coefficients, input_none, input_ramp, jacobian_type, kind_banded, kind_dense, kind_diagonal, &
      & load_none, load_procedure, load_samples, lotka_volterra, marginal_problem, mass_recomputed, matrix_type, &
      & mechanical_system, method_names, midpoint_stepper, new_method, newmark_stepper, ode_system, pade_stepper, &
      & rod_chain, rod_pendulum, soi2_stepper, state_type, status_type, step_counters, stepper_type, stiff_third_order, &
      & timoshenko_gains, variant_index3, variant_reduced, wp
   use known_motions, only: known_motion, motion_names, motions, new_motion
   use linear_cases, only: loaded_system, make_load, make_system, members, start_state, structures
   use mechanism_cases, only: consistent_point, make, models, names, point_type
   use reference_problems, only: new_problem, problem_names, start_q, start_v
   use testing, only: check, error_type, new_unittest, test_failed, unittest_type
   implicit none
   private

   public :: collect_continuation

   character(len=*), parameter :: path = 'test_continuation.tmp'

   !> Steps of a run, in units of its length: long enough alike for what is made at the third one, then varied
   real(wp), parameter :: lengths(14) = [1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 0.5_wp, 0.75_wp, 0.75_wp, 1.0_wp, 1.0_wp, &
      & 1.0_wp, 0.25_wp, 0.25_wp, 1.0_wp]

   !> Steps after which a run is archived
   integer, parameter :: breaks(5) = [0, 1, 4, 7, 12]

   !> Own oscillator with one coordinate
   type, extends(mechanical_system) :: scalar_oscillator
   contains
      procedure :: force => scalar_force
      procedure :: tangent => scalar_tangent
   end type scalar_oscillator

   !> y_i' = c (y_(i-1) - 2 y_i + y_(i+1)) + y_i (1 - y_i^2) + cos(t)/10, banded, by differences
   type, extends(ode_system) :: reacting_chain
      real(wp) :: c = 3.0_wp
   contains
      procedure :: rhs => reacting_rhs
   end type reacting_chain

   !> M q'' = p(t) - q^3 - K q, K a band of springs; tangents by differences, in any storage that holds the band
   type, extends(mechanical_system) :: spring_chain
   contains
      procedure :: force => spring_force
      procedure :: mass => spring_mass
   end type spring_chain

   !> y'' = 10 (1 - y^2) y' - y, whose J changes much in a step
   type, extends(ode_system) :: van_der_pol
   contains
      procedure :: rhs => van_der_pol_rhs
   end type van_der_pol

   !> A pendulum whose rod is fixed by two constraints, one of them (1/3) of the sum of those of the model
   type, extends(rod_pendulum) :: redundant_pendulum
   contains
      procedure :: constraint => redundant_constraint
      procedure :: constraint_jacobian => redundant_jacobian
      procedure :: constraint_curvature => redundant_curvature
   end type redundant_pendulum

   !> The chain with a stiff spring between the ends of neighbours' angles, whose tangent is given: S with K is factorized
   type, extends(rod_chain) :: sprung_chain
      real(wp) :: stiffness = 50.0_wp, damping = 0.5_wp
   contains
      procedure :: force => sprung_force
      procedure :: tangent => sprung_tangent
   end type sprung_chain

contains

   subroutine collect_continuation(testsuite)
      type(unittest_type), allocatable, intent(out) :: testsuite(:)
      testsuite = [ &
         & new_unittest('every method', test_every_method), &
         & new_unittest('linear newmark', test_linear_newmark), &
         & new_unittest('newmark on forces', test_newmark), &
         & new_unittest('factors', test_factors), &
         & new_unittest('extrapolations', test_extrapolations), &
         & new_unittest('soi2 on mechanisms', test_mechanisms), &
         & new_unittest('soi2 on known motions', test_known_motions), &
         & new_unittest('soi2 options', test_soi2_options), &
         & new_unittest('soi2 sparse and stiff', test_sparse), &
         & new_unittest('soi2 redundant', test_redundant), &
         & new_unittest('backinterpolation', test_backinterpolation), &
         & new_unittest('pade and linear backinterpolation', test_rational), &
         & new_unittest('advance', test_advance), &
         & new_unittest('twice archived', test_twice), &
         & new_unittest('what is kept matters', test_matters)]
   end subroutine collect_continuation

   ! Runs

   !> Trials of other lengths, then the step itself
   subroutine one_step(stepper, sys, state, trial, h, rejects, status)
      class(stepper_type), intent(inout) :: stepper
      class(ode_system), intent(inout) :: sys
      type(state_type), intent(inout) :: state, trial
      real(wp), intent(in) :: h
      logical, intent(in) :: rejects
      type(status_type), intent(inout) :: status
      type(status_type) :: own
      if (rejects) then
         call stepper%try_step(sys, state, 1.5_wp*h, state%t + 1.5_wp*h, trial, own)
         stepper%count%rejections = stepper%count%rejections + 1
      end if
      call stepper%try_step(sys, state, h, state%t + h, trial, status)
      if (.not. status%failed()) call stepper%accept(state, trial)
   end subroutine one_step

   subroutine write_archive(stepper, state, clock, status)
      class(stepper_type), intent(inout) :: stepper
      type(state_type), intent(inout) :: state
      type(clock_type), intent(inout) :: clock
      type(status_type), intent(inout) :: status
      type(archive_type) :: file
      call file%begin_writing(path, status)
      call stepper%archive(file)
      call state%archive('state', file)
      call clock%archive('clock', file)
      call file%finish(status)
   end subroutine write_archive

   subroutine read_archive(stepper, state, clock, status)
      class(stepper_type), intent(inout) :: stepper
      type(state_type), intent(inout) :: state
      type(clock_type), intent(inout) :: clock
      type(status_type), intent(inout) :: status
      type(archive_type) :: file
      call file%begin_reading(path, status)
      call stepper%archive(file)
      call state%archive('state', file)
      call clock%archive('clock', file)
      call file%finish(status)
   end subroutine read_archive

   subroutine remove_archive()
      integer :: unit, stat
      open (newunit=unit, file=path, iostat=stat)
      if (stat == 0) close (unit, status='delete', iostat=stat)
   end subroutine remove_archive

   !> Archive the run of `method` on `system` after so many steps as `breaks` tells, and go on in a new stepper
   subroutine check_continuation(error, label, method, system, t0, y0, h, tried)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: label
      class(stepper_type), intent(in) :: method           !! with its options, no init yet
      class(ode_system), intent(in) :: system             !! not touched yet
      real(wp), intent(in) :: t0, y0(:), h
      integer, intent(inout), optional :: tried           !! runs that were compared
      class(stepper_type), allocatable :: stepper, other
      class(ode_system), allocatable :: sys, other_sys
      type(state_type) :: state, trial, other_state, other_trial
      type(status_type) :: status, own
      type(clock_type) :: clock
      integer :: b, i
      logical :: rejects

      do b = 1, size(breaks)
         if (allocated(error)) return
         call status%clear()
         if (allocated(stepper)) deallocate (stepper, other, sys, other_sys)
         allocate (stepper, source=method)
         allocate (other, source=method)
         allocate (sys, source=system)
         allocate (other_sys, source=system)
         call stepper%init(sys, status)
         call allocate_state(sys, state, status)
         call allocate_state(sys, trial, status)
         state%t = t0
         state%y = y0
         call stepper%start(sys, state, status)
         if (status%failed()) call test_failed(error, label//': '//trim(status%message))
         if (allocated(error)) return
         do i = 1, size(lengths)
            if (i > breaks(b)) exit
            call one_step(stepper, sys, state, trial, lengths(i)*h, mod(i, 3) == 2, status)
         end do
         ! a trial that is thrown away before the run is archived
         call stepper%try_step(sys, state, 0.7_wp*h, state%t + 0.7_wp*h, trial, own)
         if (status%failed()) call test_failed(error, label//': '//trim(status%message))
         clock = clock_type(t0=t0, h=h, k=b)
         call write_archive(stepper, state, clock, status)
         if (status%failed()) call test_failed(error, label//': '//trim(status%message))

         call other%init(other_sys, status)
         call allocate_state(other_sys, other_trial, status)
         clock = clock_type()
         if (allocated(other_state%y)) deallocate (other_state%y, other_state%a, other_state%lambda, other_state%psi)
         call read_archive(other, other_state, clock, status)
         if (status%failed()) call test_failed(error, label//': '//trim(status%message))
         if (allocated(error)) return
         call check(error, int(clock%k), b, label//': clock')
         call same(error, label, breaks(b), stepper, state, other, other_state)
         do i = breaks(b) + 1, size(lengths)
            rejects = mod(i, 3) == 2
            call one_step(stepper, sys, state, trial, lengths(i)*h, rejects, status)
            if (status%failed()) call test_failed(error, label//': '//trim(status%message))
            call one_step(other, other_sys, other_state, other_trial, lengths(i)*h, rejects, status)
            if (status%failed()) call test_failed(error, label//', continued: '//trim(status%message))
            call same(error, label, i, stepper, state, other, other_state)
            if (allocated(error)) return
         end do
         if (present(tried)) tried = tried + 1
      end do
      call remove_archive()
   end subroutine check_continuation

   !> All bits of the states, all counters
   subroutine same(error, label, step, stepper, state, other, other_state)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: label
      integer, intent(in) :: step
      class(stepper_type), intent(in) :: stepper, other
      type(state_type), intent(in) :: state, other_state
      character(len=12) :: number
      write (number, '(i0)') step
      associate (where => label//', step '//trim(number)//': ')
         call check(error, bits_equal([state%t], [other_state%t]), where//'t')
         call check(error, bits_equal(state%y, other_state%y), where//'y')
         call check(error, bits_equal(state%a, other_state%a), where//'a')
         call check(error, bits_equal(state%lambda, other_state%lambda), where//'lambda')
         call check(error, bits_equal(state%psi, other_state%psi), where//'psi')
         call check(error, stepper%is_started .and. other%is_started, where//'started')
         call same_counts(error, where, stepper%count, other%count)
      end associate
   end subroutine same

   subroutine same_counts(error, where, x, y)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: where
      type(step_counters), intent(in) :: x, y
      call check(error, int(y%steps), int(x%steps), where//'steps')
      call check(error, int(y%substeps), int(x%substeps), where//'substeps')
      call check(error, int(y%rejections), int(x%rejections), where//'rejections')
      call check(error, int(y%forces), int(x%forces), where//'forces')
      call check(error, int(y%masses), int(x%masses), where//'masses')
      call check(error, int(y%tangents), int(x%tangents), where//'tangents')
      call check(error, int(y%constraints), int(x%constraints), where//'constraints')
      call check(error, int(y%factorizations), int(x%factorizations), where//'factorizations')
      call check(error, int(y%solves), int(x%solves), where//'solves')
      call check(error, int(y%newton_iterations), int(x%newton_iterations), where//'newton_iterations')
      call check(error, int(y%halvings), int(x%halvings), where//'halvings')
   end subroutine same_counts

   pure logical function bits_equal(x, y)
      real(wp), intent(in) :: x(:), y(:)
      bits_equal = size(x) == size(y)
      if (bits_equal) bits_equal = all(transfer(x, [0]) == transfer(y, [0]))
   end function bits_equal

   ! Systems

   recursive subroutine scalar_force(self, t, q, v, f, ierr)
      class(scalar_oscillator), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      ierr = 0
      f = sin(t) - 0.1_wp*v - 3.0_wp*q
   end subroutine scalar_force

   recursive subroutine scalar_tangent(self, t, q, v, a, k, c, ierr)
      class(scalar_oscillator), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      call k%set_entry(1, 1, 3.0_wp)
      call c%set_entry(1, 1, 0.1_wp)
   end subroutine scalar_tangent

   recursive subroutine reacting_rhs(self, t, y, f, ierr)
      class(reacting_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      integer :: i
      ierr = 0
      do i = 1, size(y)
         f(i) = y(i)*(1.0_wp - y(i)**2) + 0.1_wp*cos(t) + self%c*(y(max(1, i - 1)) - 2.0_wp*y(i) + y(min(size(y), i + 1)))
      end do
   end subroutine reacting_rhs

   recursive subroutine spring_force(self, t, q, v, f, ierr)
      class(spring_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      integer :: i, j
      ierr = 0
      f = 0.1_wp*cos(t) - q**3 - 0.05_wp*v
      do i = 1, self%n
         do j = max(1, i - 3), min(self%n, i + 3)
            f(i) = f(i) - (q(i) - q(j))/(1 + abs(i - j))
         end do
      end do
   end subroutine spring_force

   recursive subroutine spring_mass(self, t, q, v, mass, ierr)
      class(spring_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      type(matrix_type), intent(inout) :: mass
      integer, intent(out) :: ierr
      integer :: i
      ierr = 0
      do i = 1, self%n
         call mass%set_entry(i, i, 2.0_wp + 0.1_wp*i)
         if (i > 1 .and. mass%kind >= kind_banded) call mass%set_entry(i, i - 1, 0.25_wp)
         if (i < self%n .and. mass%kind >= kind_banded) call mass%set_entry(i, i + 1, 0.25_wp)
      end do
   end subroutine spring_mass

   recursive subroutine van_der_pol_rhs(self, t, y, f, ierr)
      class(van_der_pol), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: f(:)
      integer, intent(out) :: ierr
      ierr = 0
      f = [y(2), 10.0_wp*(1.0_wp - y(1)**2)*y(2) - y(1)]
   end subroutine van_der_pol_rhs

   recursive subroutine redundant_constraint(self, t, q, g, ierr)
      class(redundant_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      real(wp), intent(out) :: g(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      g(1:2) = [q(1) - self%l*cos(q(3)), q(2) - self%l*sin(q(3))]
      g(3) = (g(1) + g(2))/3.0_wp
   end subroutine redundant_constraint

   recursive subroutine redundant_jacobian(self, t, q, gq, gt, ierr)
      class(redundant_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n)
      type(jacobian_type), intent(inout) :: gq
      real(wp), intent(inout) :: gt(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      gq%value(1:6) = [1.0_wp, 0.0_wp, self%l*sin(q(3)), 0.0_wp, 1.0_wp, -self%l*cos(q(3))]
      gq%value(7:9) = (gq%value(1:3) + gq%value(4:6))/3.0_wp
   end subroutine redundant_jacobian

   recursive subroutine redundant_curvature(self, t, q, v, c, ierr)
      class(redundant_pendulum), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: c(self%holonomic)
      integer, intent(out) :: ierr
      ierr = 0
      c(1:2) = self%l*v(3)**2*[cos(q(3)), sin(q(3))]
      c(3) = (c(1) + c(2))/3.0_wp
   end subroutine redundant_curvature

   !> Springs and dampers between the angles of neighbours
   recursive subroutine sprung_force(self, t, q, v, f, ierr)
      class(sprung_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n)
      real(wp), intent(out) :: f(self%n)
      integer, intent(out) :: ierr
      real(wp) :: moment
      integer :: i
      call self%rod_chain%force(t, q, v, f, ierr)
      do i = 6, self%n, 3
         moment = self%stiffness*(q(i) - q(i - 3)) + self%damping*(v(i) - v(i - 3))
         f(i) = f(i) - moment
         f(i - 3) = f(i - 3) + moment
      end do
   end subroutine sprung_force

   recursive subroutine sprung_tangent(self, t, q, v, a, k, c, ierr)
      class(sprung_chain), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: q(self%n), v(self%n), a(self%n)
      type(matrix_type), intent(inout) :: k, c
      integer, intent(out) :: ierr
      ierr = 0
      call fill(k, self%stiffness)
      call fill(c, self%damping)
   contains
      recursive subroutine fill(m, x)
         type(matrix_type), intent(inout) :: m
         real(wp), intent(in) :: x
         integer :: i
         do i = 6, self%n, 3
            call m%set_entry(i, i, m%entry(i, i) + x)
            call m%set_entry(i - 3, i - 3, m%entry(i - 3, i - 3) + x)
            call m%set_entry(i, i - 3, -x)
            call m%set_entry(i - 3, i, -x)
         end do
      end subroutine fill
   end subroutine sprung_tangent

   ! Tests

   !> All names on the three reference problems, where the method takes them
   subroutine test_every_method(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper, trial
      type(status_type) :: status
      integer :: i, j, tried
      tried = 0
      do i = 1, size(method_names)
         do j = 1, 3
            call status%clear()
            call new_method(trim(method_names(i)), stepper, status)
            call new_problem(j, sys)
            if (allocated(trial)) deallocate (trial)
            allocate (trial, source=stepper)
            call trial%init(sys, status)
            if (status%failed()) cycle
            call new_problem(j, sys)
            call check_continuation(error, trim(method_names(i))//' '//trim(problem_names(j)), stepper, sys, 0.3_wp, &
               & [start_q, start_v], 0.2_wp, tried)
         end do
      end do
      ! pade takes the linear problem alone
      call check(error, tried, size(breaks)*(3*size(method_names) - 2), 'runs')
   end subroutine test_every_method

   !> Structures, orders for each kernel, members of the family, loads
   subroutine test_linear_newmark(error)
      type(error_type), allocatable, intent(out) :: error
      type(loaded_system), allocatable :: sys
      type(newmark_stepper) :: stepper
      type(status_type) :: status
      real(wp), allocatable :: y(:)
      integer, parameter :: orders(4) = [1, 3, 8, 13]
      integer :: i, j, k, n
      do k = 1, size(members, 2)
         stepper%beta = members(1, k)
         stepper%gamma = members(2, k)
         do i = 1, size(structures)
            do j = 1, size(orders)
               if (modulo(i + j + k, 2) == 1) cycle
               n = orders(j)
               if (allocated(sys)) deallocate (sys)
               allocate (sys)
               call make_system(trim(structures(i)), n, modulo(i, 2) == 0, sys, status)
               call make_load(merge(load_none, merge(load_procedure, load_samples, modulo(k, 2) == 0), modulo(i, 3) == 0), &
                  & sys, status)
               if (status%failed()) call test_failed(error, trim(status%message))
               if (allocated(y)) deallocate (y)
               allocate (y(2*n))
               call start_state(n, y)
               call check_continuation(error, 'linear '//trim(structures(i))//char(48 + n), stepper, sys, 0.0_wp, y, 0.1_wp)
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine test_linear_newmark

   !> One coordinate in registers; tangents that are constant; all kept over steps
   subroutine test_newmark(error)
      type(error_type), allocatable, intent(out) :: error
      type(scalar_oscillator) :: sys
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      sys%n = 1
      call check_continuation(error, 'nothing declared', newmark, sys, 0.0_wp, [1.0_wp, 0.5_wp], 0.1_wp)
      call check_continuation(error, 'midpoint', midpoint, sys, 0.0_wp, [1.0_wp, 0.5_wp], 0.1_wp)
      sys%structure%tangent_is_constant = .true.
      call check_continuation(error, 'constant', newmark, sys, 0.0_wp, [1.0_wp, 0.5_wp], 0.1_wp)
      sys%structure%force_is_linear = .true.
      call check_continuation(error, 'scalar', newmark, sys, 0.0_wp, [1.0_wp, 0.5_wp], 0.1_wp)
      call check_continuation(error, 'midpoint of a linear force', midpoint, sys, 0.0_wp, [1.0_wp, 0.5_wp], 0.1_wp)
   end subroutine test_newmark

   !> Factors of every kind: small, Cholesky's and LU's of bands and dense matrices
   subroutine test_factors(error)
      type(error_type), allocatable, intent(out) :: error
      type(spring_chain) :: sys
      type(newmark_stepper) :: newmark
      type(midpoint_stepper) :: midpoint
      type(soi2_stepper) :: soi2
      integer, parameter :: orders(2) = [6, 20]
      real(wp), allocatable :: y(:)
      integer :: i, j, tangent, mass
      logical :: symmetric
      do i = 1, size(orders)
         sys%n = orders(i)
         if (allocated(y)) deallocate (y)
         y = [(sin(real(j, wp)), j=1, 2*sys%n)]
         do tangent = kind_banded, kind_dense
            do mass = kind_diagonal, kind_dense
               symmetric = modulo(tangent + mass, 2) == 0
               sys%structure%tangent = tangent
               sys%structure%tangent_is_symmetric = symmetric
               sys%structure%kl = 3
               sys%structure%ku = 3
               sys%structure%mass = mass
               sys%structure%mass_kl = 1
               sys%structure%mass_ku = 1
               sys%structure%mass_is_symmetric = symmetric
               call check_continuation(error, 'newmark', newmark, sys, 0.0_wp, y, 0.1_wp)
               call check_continuation(error, 'midpoint', midpoint, sys, 0.0_wp, y, 0.1_wp)
               call check_continuation(error, 'soi2', soi2, sys, 0.0_wp, y, 0.1_wp)
            end do
         end do
      end do
   end subroutine test_factors

   !> Levels of bases that keep matrices
   subroutine test_extrapolations(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(extrapolation_stepper), allocatable :: stepper
      type(flexible_arm) :: arm
      type(status_type) :: status
      integer :: base, j, levels
      call arm%setup(6, status)
      do base = 1, 3
         do levels = 1, 5, 2
            if (allocated(stepper)) deallocate (stepper)
            allocate (stepper)
            stepper%levels = levels
            select case (base)
            case (1)
               allocate (newmark_stepper :: stepper%base)
            case (2)
               allocate (midpoint_stepper :: stepper%base)
            case (3)
               allocate (backinterpolation_stepper :: stepper%base)
            end select
            do j = 1, 3
               call new_problem(j, sys)
               call check_continuation(error, 'base '//char(48 + base)//' '//trim(problem_names(j)), stepper, sys, 0.0_wp, &
                  & [start_q, start_v], 0.3_wp)
            end do
            call check_continuation(error, 'base '//char(48 + base)//' arm', stepper, arm, 0.0_wp, arm_start(arm%n), 0.1_wp)
         end do
      end do
   end subroutine test_extrapolations

   function arm_start(n) result(y)
      integer, intent(in) :: n
      real(wp) :: y(2*n)
      integer :: i
      y = [(0.01_wp*i, i=1, n), (0.02_wp*(n - i), i=1, n)]
   end function arm_start

   !> All models of the papers, by SOI2, HHT-SOI2, the reduced variant and index 3
   subroutine test_mechanisms(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(soi2_stepper) :: stepper
      type(point_type) :: point
      type(status_type) :: status
      integer :: i, variant, tried
      tried = 0
      do i = 1, models
         do variant = 1, 3
            call make(i, sys)
            call consistent_point(sys, point)
            call make(i, sys)
            stepper%variant = variant
            if (variant == variant_index3) call hht_coefficients(-0.1_wp, stepper%coefficients, status)
            call check_continuation(error, trim(names(i)), stepper, sys, point%t, [point%q, point%v], 0.01_wp, tried)
         end do
      end do
      call check(error, tried, size(breaks)*models*3, 'runs')
   end subroutine test_mechanisms

   !> Masses of t, q and v, general reactions, differences
   subroutine test_known_motions(error)
      type(error_type), allocatable, intent(out) :: error
      class(known_motion), allocatable :: sys
      type(soi2_stepper) :: stepper
      real(wp), allocatable :: q(:), v(:), a(:), lambda(:), psi(:)
      integer :: i, variant
      do i = 1, motions
         do variant = 1, 3
            call new_motion(i, sys)
            if (allocated(q)) deallocate (q, v, a, lambda, psi)
            allocate (q(sys%n), v(sys%n), a(sys%n), lambda(sys%holonomic), psi(sys%nonholonomic))
            call sys%at(0.2_wp, q, v, a, lambda, psi)
            call new_motion(i, sys)
            stepper%variant = variant
            call check_continuation(error, trim(motion_names(i)), stepper, sys, 0.2_wp, [q, v], 0.02_wp)
         end do
      end do
   end subroutine test_known_motions

   subroutine test_soi2_options(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      type(soi2_stepper) :: stepper
      type(point_type) :: point
      integer :: i, model
      do i = 1, 6
         do model = 1, 5, 2
            stepper = soi2_stepper()
            select case (i)
            case (1)
               stepper%mass_at = mass_recomputed
            case (2)
               stepper%adjust_acceleration = .false.
            case (3)
               stepper%adjust_momentum = .false.
            case (4)
               stepper%second_order_start = .false.
            case (5)
               stepper%newton%tolerance = 1.0e-6_wp
            case (6)
               stepper%variant = variant_reduced
               stepper%mass_at = mass_recomputed
            end select
            call make(model, sys)
            call consistent_point(sys, point)
            call make(model, sys)
            call check_continuation(error, trim(names(model)), stepper, sys, point%t, [point%q, point%v], 0.02_wp)
         end do
      end do
   end subroutine test_soi2_options

   !> Chains: the complement of a diagonal mass in a band, LU of a band with stiff springs, dense ones
   subroutine test_sparse(error)
      type(error_type), allocatable, intent(out) :: error
      type(rod_chain), allocatable :: plain
      type(sprung_chain), allocatable :: sprung
      type(soi2_stepper) :: stepper
      type(status_type) :: status
      integer, parameter :: rods(3) = [2, 9, 20]
      integer :: i, k
      do i = 1, size(rods)
         if (allocated(plain)) deallocate (plain, sprung)
         allocate (plain, sprung)
         call plain%setup(rods(i), status)
         call check_continuation(error, 'chain', stepper, plain, 0.0_wp, chain_start(plain), 0.01_wp)
         do k = 1, 2
            call sprung%setup(rods(i), status)
            sprung%constraints%has_reaction_tangent = .false.
            sprung%structure%tangent = merge(kind_dense, kind_banded, k == 1)
            sprung%structure%kl = 3
            sprung%structure%ku = 3
            sprung%structure%velocity_free = .false.
            sprung%structure%tangent_is_constant = .true.
            sprung%structure%force_is_linear = .true.
            call check_continuation(error, 'sprung chain', stepper, sprung, 0.0_wp, chain_start(sprung), 0.01_wp)
            sprung%structure%tangent_is_constant = .false.
            sprung%stiffness = 300.0_wp
            stepper%variant = variant_index3
            call check_continuation(error, 'stiff chain', stepper, sprung, 0.0_wp, chain_start(sprung), 0.01_wp)
            stepper%variant = variant_reduced
            call check_continuation(error, 'reduced stiff chain', stepper, sprung, 0.0_wp, chain_start(sprung), 0.01_wp)
            stepper%variant = 1
         end do
      end do
   end subroutine test_sparse

   function chain_start(sys) result(y)
      class(rod_chain), intent(inout) :: sys
      real(wp) :: y(2*sys%n)
      integer :: i
      call sys%start([(-1.0_wp + 0.1_wp*i, i=1, sys%rods)], [(0.5_wp - 0.1_wp*mod(i, 4), i=1, sys%rods)], y(:sys%n), &
         & y(sys%n + 1:))
   end function chain_start

   !> Regularized matrices and multipliers of least norm
   subroutine test_redundant(error)
      type(error_type), allocatable, intent(out) :: error
      type(redundant_pendulum) :: sys
      type(soi2_stepper) :: stepper
      real(wp) :: y(6)
      integer :: variant
      call sys%setup()
      call sys%start(1.1_wp, -2.0_wp, y(:3), y(4:))
      sys%holonomic = 3
      sys%constraints%has_reaction_tangent = .false.
      do variant = 1, 3
         stepper%variant = variant
         call check_continuation(error, 'redundant', stepper, sys, 0.0_wp, y, 0.01_wp)
      end do
   end subroutine test_redundant

   !> Both halves on systems of first order and of mechanics, dense, banded and diagonal Jacobians
   subroutine test_backinterpolation(error)
      type(error_type), allocatable, intent(out) :: error
      type(backinterpolation_stepper) :: stepper
      type(lotka_volterra) :: foxes
      type(reacting_chain) :: chain
      type(van_der_pol) :: pol
      class(mechanical_system), allocatable :: sys
      integer :: i, j
      pol%n = 2
      call foxes%setup()
      chain%n = 25
      chain%jacobian_kind = kind_banded
      chain%jacobian_kl = 1
      chain%jacobian_ku = 1
      do i = 1, 6
         stepper = backinterpolation_stepper()
         select case (i)
         case (2)
            stepper%q = 5
            stepper%alpha = 0.44_wp
         case (3)
            stepper%halves = halves_fehlberg
         case (4)
            stepper%alpha = 0.0_wp
            stepper%q = 1
         case (5)
            stepper%alpha = 1.0_wp
         case (6)
            stepper%p = 2
            stepper%q = 3
            stepper%newton%tolerance = 1.0e-8_wp
         end select
         call check_continuation(error, 'lotka-volterra', stepper, foxes, 0.0_wp, [2.0_wp, 1.5_wp], 0.1_wp)
         call check_continuation(error, 'van der pol', stepper, pol, 0.0_wp, [1.3_wp, -1.0_wp], 0.04_wp)
         call check_continuation(error, 'reacting chain', stepper, chain, 0.0_wp, [(0.5_wp*sin(0.7_wp*j), j=1, 25)], 0.05_wp)
         chain%jacobian_kind = kind_diagonal
         chain%c = 1.0e-3_wp
         call check_continuation(error, 'reactions', stepper, chain, 0.0_wp, [(0.5_wp*sin(0.7_wp*j), j=1, 25)], 0.05_wp)
         chain%jacobian_kind = kind_banded
         chain%c = 3.0_wp
         do j = 2, 3
            call new_problem(j, sys)
            call check_continuation(error, trim(problem_names(j)), stepper, sys, 0.0_wp, [start_q, start_v], 0.2_wp)
         end do
      end do
   end subroutine test_backinterpolation

   !> Forms, degrees, systems of first and second order, small ones and chains, closed loops, loads
   subroutine test_rational(error)
      type(error_type), allocatable, intent(out) :: error
      type(pade_stepper) :: pade
      type(backinterpolation_stepper) :: bi
      integer, parameter :: degrees(2, 4) = reshape([4, 4, 0, 2, 2, 0, 3, 2], [2, 4])
      integer, parameter :: forms(4) = [0, form_parallel, form_product, form_refined]
      integer :: i, j
      do i = 1, size(degrees, 2)
         do j = 1, size(forms)
            ! partial fractions need a denominator of the higher degree
            if (degrees(1, i) > degrees(2, i) .and. j == 2) cycle
            pade = pade_stepper()
            pade%p = degrees(1, i)
            pade%q = degrees(2, i)
            if (j > 1) pade%form = forms(j)
            call check_on_linear_systems(error, 'pade '//char(48 + i)//char(48 + j), pade)
         end do
      end do
      call check_on_linear_systems(error, 'bi', bi)
      bi%halves = halves_fehlberg
      call check_on_linear_systems(error, 'bi45', bi)
      bi%halves = 1
      bi%alpha = 1.0_wp
      call check_on_linear_systems(error, 'runge-kutta', bi)
   end subroutine test_rational

   subroutine check_on_linear_systems(error, label, stepper)
      type(error_type), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: label
      class(stepper_type), intent(in) :: stepper
      type(flexible_arm), allocatable :: arm
      type(loaded_system), allocatable :: sys
      type(stiff_third_order) :: stiff
      type(marginal_problem) :: marginal
      type(status_type) :: status
      real(wp) :: y(4)
      real(wp), allocatable :: y0(:)
      integer, parameter :: segments(2) = [6, 30]
      integer :: i, loop, input
      call stiff%setup(status)
      call marginal%setup(status)
      call marginal%start(y)
      call check_continuation(error, label//' stiff', stepper, stiff, 0.0_wp, [1.0_wp, 0.0_wp, -1.0_wp], 0.002_wp)
      call check_continuation(error, label//' marginal', stepper, marginal, 0.0_wp, y, 0.1_wp)
      do i = 1, size(segments)
         do loop = 1, 2
            do input = input_none, input_ramp, input_ramp
               if (allocated(arm)) deallocate (arm)
               allocate (arm)
               arm%beam = beam_timoshenko
               call arm%setup(segments(i), status)
               if (loop == 2) call arm%close_loop(status, timoshenko_gains)
               call arm%set_input(input, status)
               if (status%failed()) call test_failed(error, trim(status%message))
               call check_continuation(error, label//' arm', stepper, arm, 0.0_wp, arm_start(arm%n), 1.0e-4_wp)
            end do
         end do
      end do
      do i = 1, size(structures)
         if (allocated(sys)) deallocate (sys, y0)
         allocate (sys, y0(26))
         call make_system(trim(structures(i)), 13, modulo(i, 2) == 0, sys, status)
         call make_load(load_samples, sys, status)
         call start_state(13, y0)
         call check_continuation(error, label//' '//trim(structures(i)), stepper, sys, 0.0_wp, y0, 0.1_wp)
      end do
   end subroutine check_on_linear_systems

   !> Runs by `advance`, with and without accelerations between its calls
   subroutine test_advance(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys, other_sys
      class(stepper_type), allocatable :: stepper, other
      type(state_type) :: state, other_state
      type(clock_type) :: clock, other_clock
      type(status_type) :: status
      integer :: i, j
      logical :: complete
      do i = 1, 2*size(method_names)
         complete = i > size(method_names)
         do j = 1, 3
            call status%clear()
            if (allocated(stepper)) deallocate (stepper)
            if (allocated(other)) deallocate (other)
            call new_method(trim(method_names(modulo(i - 1, size(method_names)) + 1)), stepper, status)
            allocate (other, source=stepper)
            call new_problem(j, sys)
            call new_problem(j, other_sys)
            call stepper%init(sys, status)
            if (status%failed()) cycle
            call allocate_state(sys, state, status)
            state%t = 0.0_wp
            state%y = [start_q, start_v]
            clock = clock_type(t0=0.0_wp, h=0.1_wp)
            call stepper%start(sys, state, status)
            call stepper%advance(sys, state, clock, 7, status, complete)
            call write_archive(stepper, state, clock, status)
            call other%init(other_sys, status)
            call read_archive(other, other_state, other_clock, status)
            if (status%failed()) call test_failed(error, trim(status%message))
            if (allocated(error)) return
            call stepper%advance(sys, state, clock, 9, status, .true.)
            call other%advance(other_sys, other_state, other_clock, 9, status, .true.)
            if (status%failed()) call test_failed(error, trim(status%message))
            call same(error, trim(method_names(modulo(i - 1, size(method_names)) + 1))//' '//trim(problem_names(j)), 16, &
               & stepper, state, other, other_state)
            call check(error, int(other_clock%k), 16, 'clock')
         end do
      end do
      call remove_archive()
   end subroutine test_advance

   !> A run that was continued is archived once more before its next step: nothing that waits to be made is lost
   subroutine test_twice(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper, other, third
      type(state_type) :: state, other_state, third_state, trial
      type(clock_type) :: clock
      type(status_type) :: status
      integer :: i, k
      do i = 1, size(method_names)
         call status%clear()
         if (allocated(stepper)) deallocate (stepper)
         if (allocated(other)) deallocate (other)
         if (allocated(third)) deallocate (third)
         call new_method(trim(method_names(i)), stepper, status)
         allocate (other, source=stepper)
         allocate (third, source=stepper)
         call new_problem(1, sys)
         call stepper%init(sys, status)
         call allocate_state(sys, state, status)
         call allocate_state(sys, trial, status)
         state%t = 0.0_wp
         state%y = [start_q, start_v]
         call stepper%start(sys, state, status)
         do k = 1, 5
            call one_step(stepper, sys, state, trial, 0.1_wp, .false., status)
         end do
         call write_archive(stepper, state, clock, status)
         call other%init(sys, status)
         call read_archive(other, other_state, clock, status)
         call write_archive(other, other_state, clock, status)
         call third%init(sys, status)
         call read_archive(third, third_state, clock, status)
         do k = 1, 5
            call one_step(stepper, sys, state, trial, 0.1_wp, k == 2, status)
            call one_step(third, sys, third_state, trial, 0.1_wp, k == 2, status)
            if (status%failed()) call test_failed(error, trim(status%message))
            call same(error, trim(method_names(i)), k, stepper, state, third, third_state)
         end do
      end do
      call remove_archive()
   end subroutine test_twice

   !> Without the archive a stepper that starts at the state that was reached makes other bits: the comparison sees it
   subroutine test_matters(error)
      type(error_type), allocatable, intent(out) :: error
      class(mechanical_system), allocatable :: sys
      class(stepper_type), allocatable :: stepper, other
      type(state_type) :: state, other_state, trial
      type(status_type) :: status
      character(len=8), parameter :: kept(4) = [character(len=8) :: 'newmark', 'midpoint', 'soi2', 'bi']
      integer :: i, k
      logical :: differs
      do i = 1, size(kept)
         if (allocated(stepper)) deallocate (stepper)
         if (allocated(other)) deallocate (other)
         call new_method(trim(kept(i)), stepper, status)
         allocate (other, source=stepper)
         call new_problem(3, sys)
         call stepper%init(sys, status)
         call other%init(sys, status)
         call allocate_state(sys, state, status)
         call allocate_state(sys, trial, status)
         state%t = 0.0_wp
         state%y = [start_q, start_v]
         call stepper%start(sys, state, status)
         do k = 1, 4
            call one_step(stepper, sys, state, trial, 0.6_wp, .false., status)
         end do
         other_state = state
         call other%start(sys, other_state, status)
         differs = .false.
         do k = 1, 4
            call one_step(stepper, sys, state, trial, 0.6_wp, .false., status)
            call one_step(other, sys, other_state, trial, 0.6_wp, .false., status)
            differs = differs .or. .not. bits_equal(state%y, other_state%y)
         end do
         if (status%failed()) call test_failed(error, trim(status%message))
         call check(error, differs, trim(kept(i))//' keeps nothing')
      end do
   end subroutine test_matters
end module test_continuation
