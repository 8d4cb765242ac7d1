! SPDX-License-Identifier: BSD-3-Clause
!> Steps y1 = R(hA) y + forcing of linear systems, for any rational R: y' = A y + b(t) and, at the size of q,
!> M q'' + C q' + K q = p(t), with a coupling or without.
!>
!> With z = hA each stage of dynstep_pole_stages adds sum w Re(tau x), (z - p) x = z y + h b_j.  At second order that is
!>
!>   S x_q = h^2 (K q - P_j) - p h M v
!>   S x_v = h^2 K v + p h (K q + C v - P_j),     S = p^2 M + p h C + h^2 K,
!>
!> two right-hand sides for each factorization, so that the increments of q and v come out to full relative accuracy
!> for any h: the velocity alone would lose damped positions at large steps, the position alone velocities at small
!> ones.  No power of hA is formed, and M is not inverted (but for explicit factors, where p > q).
!>
!> Chains, symmetric and at most pentadiagonal, have kernels of their own (dynstep_rational_chain); other matrices, and
!> chains whose pivots want interchanges, go through LAPACK.  Systems of up to `most_dense` unknowns in the state get the
!> matrix of a step, y1 = y + D y + G p, when a step length is used for the third time: made from the stages in product form,
!> column by column.
!>
!> Roundings of coefficients and factors are the same in each step.  In 1e6 steps of undamped chains of 16 and 30 masses by
!> Pade(4,4) they make the energy drift, linearly: at h omega_max = 2 by 3e-9 in parallel form, 3e-10 in product form and
!> 1.5e-10 by the matrix of a step, at 0.2 by 1e-11, 1e-12 and 6e-12, at 0.02 by 1e-13.  The refined form corrects each solve once
!> by its residual, at twice the work: 6e-13, 2e-13 and 1e-13.
!>
!> PROGRAMMING INTERFACE
!>
!>   call engine%init(sys, r, form, status)                    allocates; sys is a linear_system or linear_ode
!>   call engine%forget()                                      factors and loads that are known
!>   call engine%step(sys, t, h, t1, y, dy, count, status)     y1 = y + dy
module dynstep_rational_engine
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: long, wp
   use dynstep_linear_load, only: evaluate_load, evaluate_source
   use dynstep_linear_ode, only: linear_ode
   use dynstep_linear_system, only: linear_system, load_none
   use dynstep_matrix, only: kind_zero, matrix_type
   use dynstep_ode_system, only: ode_system
   use dynstep_pole_stages, only: form_product, pole_stages_type, stage_type
   use dynstep_rational, only: rational_type
   use dynstep_rational_chain, only: rational_chain, serves
   use dynstep_shifted_systems, only: shifted_systems_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_no_memory, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   public :: is_linear

   type, public :: rational_engine
      type(rational_type) :: r
      type(pole_stages_type), private :: stages            ! the form in use
      type(pole_stages_type), allocatable, private :: product   ! product form, for the matrix of a step; poles in the
                                                           ! same order.  Allocatable, since gfortran 12 frees
                                                           ! one component of a type alone
      type(shifted_systems_type), private :: systems
      type(rational_chain), allocatable, private :: chain  ! where its kernels serve
      logical, private :: on_chain = .false.               ! and do so for this h
      type(factorization_type), private :: mass            ! where explicit factors need M^-1
      logical, private :: second = .false.                 ! second order: a linear_system
      logical, private :: has_load = .false.
      integer, private :: n = 0                            ! order of the matrices
      real(wp), private :: h = 0.0_wp                      ! of the factors, 0: none
      integer(long), private :: uses = 0                   ! steps of this length
      logical, private :: mass_known = .false.
      real(wp), allocatable, private :: loads(:, :)        ! at the nodes of a step [n, nodes]
      real(wp), private :: load_time = 0.0_wp              ! of the last one
      logical, private :: load_known = .false.
      real(wp), allocatable, private :: dense(:, :)        ! D and G side by side [size, size + n*nodes]
      logical, private :: dense_known = .false.
      complex(wp), allocatable, private :: x(:, :)         ! right-hand sides of a pole [n, 1 or 2]
      complex(wp), allocatable, private :: pj(:)           ! P_j [n]
      real(wp), allocatable, private :: y(:), d(:)         ! state of the stages, increment of one [size]
      real(wp), allocatable, private :: products(:, :)     ! K q, K v, M v, C v, or A y [n, 4]
      complex(wp), allocatable, private :: residual(:, :)  ! of the refined form, like x
      real(wp), allocatable, private :: parts(:, :)        ! real and imaginary parts of x, and products with them [n, 4]
   contains
      procedure :: init => engine_init
      procedure :: forget => engine_forget
      procedure :: step => engine_step
   end type rational_engine

   !> Up to this many unknowns in the state the matrix of a step is faster than banded solves
   integer, parameter :: most_dense = 40
   !> Uses of a step length from which on its matrix pays: it costs as much as so many steps as it has columns, so that a
   !> length that is used three times is taken for one that stays
   integer, parameter :: uses_before_dense = 2

contains

   !> True for the systems that this engine steps
   pure logical function is_linear(sys)
      class(ode_system), intent(in) :: sys
      is_linear = .false.
      select type (sys)
      class is (linear_system)
         is_linear = .true.
      class is (linear_ode)
         is_linear = .true.
      end select
   end function is_linear

   !> Stages of R, and room
   recursive subroutine engine_init(self, sys, r, form, status)
      class(rational_engine), intent(inout) :: self
      class(ode_system), intent(in) :: sys             !! linear_system or linear_ode
      type(rational_type), intent(in) :: r
      integer, intent(in) :: form                      !! form_automatic, form_parallel, form_product or form_refined
      type(status_type), intent(inout) :: status
      integer :: size, nodes, stat

      if (status%failed()) return
      self%r = r
      call self%stages%set(r, form, status)
      if (.not. allocated(self%product)) allocate (self%product)
      call self%product%set(r, form_product, status)
      if (status%failed()) return
      self%n = sys%n
      size = sys%state_size()
      nodes = ubound(self%stages%nodes, 1)
      call self%forget()
      if (allocated(self%x)) deallocate (self%x, self%pj)
      select type (sys)
      class is (linear_system)
         self%second = .true.
         if (allocated(self%chain)) deallocate (self%chain)
         if (size > most_dense .and. .not. self%stages%is_refined .and. serves(sys, self%stages)) then
            allocate (self%chain)
            call self%chain%init(sys, self%stages, status)
         else
            call make_systems(self, sys, status)
         end if
         call self%mass%init(sys%m%kind, sys%n, sys%m%kl, sys%m%ku, sys%m%symmetric, status)
      class is (linear_ode)
         self%second = .false.
         call make_systems(self, sys, status)
      class default
         call status%set(dynstep_invalid_input, 'the system is not linear')
      end select
      if (status%failed()) return
      if (allocated(self%loads)) deallocate (self%loads, self%y, self%d, self%products)
      if (allocated(self%dense)) deallocate (self%dense)
      allocate (self%loads(self%n, nodes), self%y(size), self%d(size), self%products(self%n, 4), stat=stat)
      if (stat == 0 .and. size <= most_dense .and. .not. self%stages%is_refined) &
         & allocate (self%dense(size, size + self%n*nodes), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a step of '//text(self%n)//' unknowns')
   end subroutine engine_init

   !> Room for the way through LAPACK; a chain asks for it when its own kernels cannot factorize
   recursive subroutine make_systems(self, sys, status)
      class(rational_engine), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      select type (sys)
      class is (linear_system)
         call self%systems%init_second(sys%m, sys%c, sys%k, max(1, self%stages%poles), status, sys%structure%is_coupled)
      class is (linear_ode)
         call self%systems%init_first(sys%a, max(1, self%stages%poles), status)
      end select
      if (status%failed()) return
      if (allocated(self%residual)) deallocate (self%residual, self%parts)
      allocate (self%x(sys%n, merge(2, 1, self%second)), self%pj(sys%n), stat=stat)
      if (stat == 0 .and. self%stages%is_refined) allocate (self%residual(sys%n, merge(2, 1, self%second)), &
         & self%parts(sys%n, 4), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a step of '//text(sys%n)//' unknowns')
   end subroutine make_systems

   !> Matrices and loads may have changed
   pure subroutine engine_forget(self)
      class(rational_engine), intent(inout) :: self
      self%h = 0.0_wp
      self%uses = 0
      self%mass_known = .false.
      self%load_known = .false.
      self%dense_known = .false.
      self%on_chain = .false.
   end subroutine engine_forget

   !> One step of length h from t to t1 = t + h up to rounding: dy = R(hA) y - y + forcing
   recursive subroutine engine_step(self, sys, t, h, t1, y, dy, count, status)
      class(rational_engine), intent(inout) :: self
      class(ode_system), intent(inout) :: sys          !! that of init
      real(wp), intent(in) :: t, h, t1
      real(wp), intent(in) :: y(:)                     !! state at t [state_size]
      real(wp), intent(out) :: dy(:)                   !! increment [state_size]
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      if (abs(h - self%h) > 0.0_wp) then
         self%uses = 0
         self%dense_known = .false.
      end if
      call note_load(self, sys, status)
      call take_loads(self, sys, t, h, t1, count, status)
      if (status%failed()) return
      if (allocated(self%dense)) then
         if (.not. self%dense_known .and. self%uses >= uses_before_dense) call make_dense(self, sys, t, h, count, status)
         if (status%failed()) return
         if (self%dense_known) then
            call dense_step(size(y), size(self%loads), self%has_load, self%dense, y, self%loads, dy)
            self%uses = self%uses + 1
            return
         end if
      end if
      call by_stages(self, self%stages, sys, t, h, y, dy, count, status)
      if (.not. status%failed()) self%uses = self%uses + 1
   end subroutine engine_step

   !> A load that appears or goes away between steps changes the matrix of a step
   recursive subroutine note_load(self, sys, status)
      class(rational_engine), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      logical :: has_load
      has_load = .false.
      select type (sys)
      class is (linear_system)
         has_load = sys%load_kind /= load_none
         if ((has_load .neqv. self%has_load) .and. allocated(self%chain)) call self%chain%note_load(sys, self%stages, status)
      class is (linear_ode)
         has_load = sys%source_kind /= load_none
      end select
      if (has_load .eqv. self%has_load) return
      self%has_load = has_load
      self%load_known = .false.
      self%dense_known = .false.
   end subroutine note_load

   !> Loads at the nodes; that at the end of a step is that at the begin of the next
   recursive subroutine take_loads(self, sys, t, h, t1, count, status)
      class(rational_engine), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t, h, t1
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: i, last
      if (.not. self%has_load) return
      last = size(self%stages%nodes)
      if (self%load_known .and. .not. abs(t - self%load_time) > 0.0_wp) then
         self%loads(:, 1) = self%loads(:, last)
      else
         call take_load(self, sys, 1, t, count, status)
      end if
      self%load_known = .false.
      do i = 2, last - 1
         call take_load(self, sys, i, t + self%stages%nodes(i)*h, count, status)
      end do
      call take_load(self, sys, last, t1, count, status)
      self%load_time = t1
      self%load_known = .not. status%failed()
   end subroutine take_loads

   recursive subroutine take_load(self, sys, i, t, count, status)
      class(rational_engine), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      integer, intent(in) :: i
      real(wp), intent(in) :: t
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      select type (sys)
      class is (linear_system)
         call evaluate_load(sys, self%n, t, self%loads(:, i), status, count)
      class is (linear_ode)
         call evaluate_source(sys, self%n, t, self%loads(:, i), status, count)
      end select
   end subroutine take_load

   !> dy = D y + G p
   pure subroutine dense_step(size, many, has_load, dense, y, loads, dy)
      integer, intent(in) :: size, many
      logical, intent(in) :: has_load
      real(wp), intent(in) :: dense(size, size + many)
      real(wp), intent(in) :: y(size), loads(many)
      real(wp), intent(out) :: dy(size)
      integer :: j
      dy = dense(:, 1)*y(1)
      do j = 2, size
         dy = dy + dense(:, j)*y(j)
      end do
      if (.not. has_load) return
      do j = 1, many
         dy = dy + dense(:, size + j)*loads(j)
      end do
   end subroutine dense_step

   !> Columns of D and G, from unit states and unit loads
   recursive subroutine make_dense(self, sys, t, h, count, status)
      class(rational_engine), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t, h
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: kept(self%n, size(self%loads, 2)), unit(size(self%y))
      integer :: i, j, n_state
      kept = self%loads
      n_state = size(unit)
      self%loads = 0.0_wp
      do j = 1, n_state
         unit = 0.0_wp
         unit(j) = 1.0_wp
         call by_stages(self, self%product, sys, t, h, unit, self%dense(:, j), count, status)
      end do
      unit = 0.0_wp
      if (self%has_load) then
         do j = 1, size(kept, 2)
            do i = 1, self%n
               self%loads(i, j) = 1.0_wp
               call by_stages(self, self%product, sys, t, h, unit, self%dense(:, n_state + i + (j - 1)*self%n), &
                  & count, status)
               self%loads(i, j) = 0.0_wp
            end do
         end do
      end if
      self%loads = kept
      self%dense_known = .not. status%failed()
   end subroutine make_dense

   !> The stages one after the other
   recursive subroutine by_stages(self, stages, sys, t, h, y, dy, count, status)
      class(rational_engine), intent(inout) :: self
      type(pole_stages_type), intent(in) :: stages
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t, h
      real(wp), intent(in) :: y(:)
      real(wp), intent(out) :: dy(:)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: k

      if (status%failed()) return
      select type (sys)
      class is (linear_system)
         call prepare_second(self, stages, sys, t, h, count, status)
      class is (linear_ode)
         call prepare_first(self, stages, sys, t, h, count, status)
      end select
      if (status%failed()) return
      self%y = y
      dy = 0.0_wp
      do k = 1, size(stages%stage) + size(stages%factor)
         select type (sys)
         class is (linear_system)
            if (k <= size(stages%stage)) then
               call stage_second(self, stages, k, sys, h, count)
            else
               call factor_second(self, stages, k - size(stages%stage), sys, h, count)
            end if
         class is (linear_ode)
            if (k <= size(stages%stage)) then
               call stage_first(self, stages, k, sys, h, count)
            else
               call factor_first(self, stages, k - size(stages%stage), sys, h)
            end if
         end select
         dy = dy + self%d
         if (k < size(stages%stage) + size(stages%factor)) self%y = y + dy
      end do
   end subroutine by_stages

   !> Factors of all poles, and M where explicit factors need it
   recursive subroutine prepare_second(self, stages, sys, t, h, count, status)
      class(rational_engine), intent(inout) :: self
      type(pole_stages_type), intent(in) :: stages
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: t, h
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: trouble
      if (size(stages%factor) > 0 .and. .not. self%mass_known) then
         call self%mass%factorize(sys%m, status, t, 'mass matrix')
         count%factorizations = count%factorizations + 1
         self%mass_known = .not. status%failed()
      end if
      if (status%failed() .or. stages%poles == 0) return
      if (.not. abs(h - self%h) > 0.0_wp) return
      self%h = 0.0_wp
      if (allocated(self%chain)) then
         call self%chain%factorize(sys, stages, h, trouble)
         count%factorizations = count%factorizations + stages%poles
         self%on_chain = trouble == 0
         if (self%on_chain .and. .not. self%chain%is_doubtful) then
            self%h = h
            return
         end if
         ! pivots nearly vanish: a rigid mode, or a pole on the spectrum, which the other factorization tells apart
         if (.not. allocated(self%x)) call make_systems(self, sys, status)
      end if
      if (status%failed()) return
      if (sys%structure%is_coupled) then
         call self%systems%factorize_second(sys%m, sys%c, sys%k, h, stages%pole, status, t, sys%coupling%b, &
            & sys%coupling%k, sys%coupling%c)
      else
         call self%systems%factorize_second(sys%m, sys%c, sys%k, h, stages%pole, status, t)
      end if
      count%factorizations = count%factorizations + stages%poles
      if (.not. status%failed()) self%h = h
   end subroutine prepare_second

   recursive subroutine prepare_first(self, stages, sys, t, h, count, status)
      class(rational_engine), intent(inout) :: self
      type(pole_stages_type), intent(in) :: stages
      class(linear_ode), intent(in) :: sys
      real(wp), intent(in) :: t, h
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      if (stages%poles == 0) return
      if (.not. abs(h - self%h) > 0.0_wp) return
      self%h = 0.0_wp
      call self%systems%factorize_first(sys%a, h, stages%pole, status, t)
      count%factorizations = count%factorizations + stages%poles
      if (status%failed()) return
      self%h = h
   end subroutine prepare_first

   !> d = sum of w Re(tau x) over the poles of stage k, at second order
   recursive subroutine stage_second(self, stages, k, sys, h, count)
      class(rational_engine), intent(inout) :: self
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: h
      type(step_counters), intent(inout) :: count
      complex(wp) :: p
      integer :: j
      if (self%on_chain) then
         call self%chain%stage(sys, stages, k, self%loads, self%y(:self%n), self%y(self%n + 1:), self%d(:self%n), &
            & self%d(self%n + 1:))
         count%solves = count%solves + 2*stages%stage(k)%count
         return
      end if
      associate (n => self%n, stage => stages%stage(k), kq => self%products(:, 1), kv => self%products(:, 2), &
         & mv => self%products(:, 3), cv => self%products(:, 4), d => self%d)
         call multiply(sys, n, self%y(:n), self%y(n + 1:), kq, kv, mv, cv)
         d = 0.0_wp
         do j = 1, stage%count
            p = stage%pole(j)
            self%x(:, 1) = h**2*kq - (p*h)*mv
            self%x(:, 2) = h**2*kv + (p*h)*(kq + cv)
            if (self%has_load) then
               call combine(n, size(self%loads, 2), self%loads, stage%omega(:, j), self%pj)
               self%x(:, 1) = self%x(:, 1) - h**2*self%pj
               self%x(:, 2) = self%x(:, 2) - (p*h)*self%pj
            end if
            call self%systems%solve(stage%first + j - 1, self%x)
            count%solves = count%solves + 2
            if (stages%is_refined) call refine_second(self, sys, stage%first + j - 1, p, h, kq, kv, mv, cv, count)
            call add_weighted(n, stage, j, self%x(:, 1), d(:n))
            call add_weighted(n, stage, j, self%x(:, 2), d(n + 1:))
         end do
      end associate
   end subroutine stage_second

   !> x = x + S^-1 (right-hand side - S x) for both right-hand sides.  h^2, p^2 and p h are multiplied one factor after
   !> the other, so that rounding errors depend on x: that of a coefficient, or of a factor of S, would be the same in
   !> each step and add up.
   recursive subroutine refine_second(self, sys, j, p, h, kq, kv, mv, cv, count)
      class(rational_engine), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      integer, intent(in) :: j                         !! place of the pole
      complex(wp), intent(in) :: p
      real(wp), intent(in) :: h, kq(:), kv(:), mv(:), cv(:)
      type(step_counters), intent(inout) :: count
      integer :: i, side
      associate (n => self%n, r => self%residual, re => self%parts(:, 1), im => self%parts(:, 2), are => self%parts(:, 3), &
         & aim => self%parts(:, 4))
         do i = 1, n
            r(i, 1) = h*(h*kq(i)) - p*(h*mv(i))
            r(i, 2) = h*(h*kv(i)) + p*(h*(kq(i) + cv(i)))
         end do
         if (self%has_load) then
            do i = 1, n
               r(i, 1) = r(i, 1) - h*(h*self%pj(i))
               r(i, 2) = r(i, 2) - p*(h*self%pj(i))
            end do
         end if
         do side = 1, 2
            re = real(self%x(:, side), wp)
            im = aimag(self%x(:, side))
            call multiply_both(sys%k, re, im, are, aim)
            if (sys%structure%is_coupled) then
               are = are + sys%coupling%b*dot_product(sys%coupling%k, re)
               aim = aim + sys%coupling%b*dot_product(sys%coupling%k, im)
            end if
            do i = 1, n
               r(i, side) = r(i, side) - h*(h*cmplx(are(i), aim(i), wp))
            end do
            call multiply_both(sys%c, re, im, are, aim)
            if (sys%structure%is_coupled) then
               are = are + sys%coupling%b*dot_product(sys%coupling%c, re)
               aim = aim + sys%coupling%b*dot_product(sys%coupling%c, im)
            end if
            do i = 1, n
               r(i, side) = r(i, side) - p*(h*cmplx(are(i), aim(i), wp))
            end do
            call multiply_both(sys%m, re, im, are, aim)
            do i = 1, n
               r(i, side) = r(i, side) - p*(p*cmplx(are(i), aim(i), wp))
            end do
         end do
         call self%systems%solve(j, r)
         self%x = self%x + r
         count%solves = count%solves + 2
      end associate
   end subroutine refine_second

   !> x = x + S^-1 (right-hand side - S x), S = h A - p
   recursive subroutine refine_first(self, sys, j, p, h, ay, count)
      class(rational_engine), intent(inout) :: self
      class(linear_ode), intent(in) :: sys
      integer, intent(in) :: j
      complex(wp), intent(in) :: p
      real(wp), intent(in) :: h, ay(:)
      type(step_counters), intent(inout) :: count
      integer :: i
      associate (n => self%n, r => self%residual, re => self%parts(:, 1), im => self%parts(:, 2), are => self%parts(:, 3), &
         & aim => self%parts(:, 4))
         re = real(self%x(:, 1), wp)
         im = aimag(self%x(:, 1))
         call multiply_both(sys%a, re, im, are, aim)
         do i = 1, n
            r(i, 1) = h*cmplx(ay(i) - are(i), -aim(i), wp) + p*self%x(i, 1)
         end do
         if (self%has_load) then
            do i = 1, n
               r(i, 1) = r(i, 1) + h*self%pj(i)
            end do
         end if
         call self%systems%solve(j, r)
         self%x = self%x + r
         count%solves = count%solves + 1
      end associate
   end subroutine refine_first

   !> A times both parts of a complex vector
   pure subroutine multiply_both(a, re, im, are, aim)
      type(matrix_type), intent(in) :: a
      real(wp), intent(in) :: re(:), im(:)
      real(wp), intent(out) :: are(:), aim(:)
      are = 0.0_wp
      aim = 0.0_wp
      if (a%kind == kind_zero) return
      call a%multiply_add(1.0_wp, re, are)
      call a%multiply_add(1.0_wp, im, aim)
   end subroutine multiply_both

   !> d = d + w Re(tau x).  Where a pair of zeros mirrors the poles, tau = -2 i Re(p)/Im(p): as a product and a quotient it
   !> has no rounding error of its own, which would be the same in each step.
   pure subroutine add_weighted(n, stage, j, x, d)
      integer, intent(in) :: n
      type(stage_type), intent(in) :: stage
      integer, intent(in) :: j
      complex(wp), intent(in) :: x(n)
      real(wp), intent(inout) :: d(n)
      if (stage%is_mirrored .and. stage%w(j) > 1.0_wp) then
         d = d + (4.0_wp*real(stage%pole(j), wp))*aimag(x)/aimag(stage%pole(j))
      else
         d = d + stage%w(j)*real(stage%tau(j)*x, wp)
      end if
   end subroutine add_weighted

   !> K q, K v, M v and C v, with a coupling in K and C
   pure subroutine multiply(sys, n, q, v, kq, kv, mv, cv)
      class(linear_system), intent(in) :: sys
      integer, intent(in) :: n
      real(wp), intent(in) :: q(n), v(n)
      real(wp), intent(out) :: kq(n), kv(n), mv(n), cv(n)
      kq = 0.0_wp
      kv = 0.0_wp
      mv = 0.0_wp
      cv = 0.0_wp
      call sys%k%multiply_add(1.0_wp, q, kq)
      call sys%k%multiply_add(1.0_wp, v, kv)
      call sys%m%multiply_add(1.0_wp, v, mv)
      if (sys%c%kind /= kind_zero) call sys%c%multiply_add(1.0_wp, v, cv)
      if (.not. sys%structure%is_coupled) return
      kq = kq + sys%coupling%b*dot_product(sys%coupling%k, q)
      kv = kv + sys%coupling%b*dot_product(sys%coupling%k, v)
      cv = cv + sys%coupling%b*dot_product(sys%coupling%c, v)
   end subroutine multiply

   !> d = z (a y + b z y), by M^-1
   recursive subroutine factor_second(self, stages, k, sys, h, count)
      class(rational_engine), intent(inout) :: self
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: h
      type(step_counters), intent(inout) :: count
      associate (n => self%n, f => stages%factor(k))
         if (abs(f%b) > 0.0_wp) then
            call apply_z(self, sys, h, f%inner, self%y, self%d, count)
            self%y = f%a*self%y + f%b*self%d
         else
            self%y = f%a*self%y
         end if
         call apply_z(self, sys, h, f%outer, self%y, self%d, count)
      end associate
   end subroutine factor_second

   !> d = z y + the source in it: (h v, h M^-1 (P - K q - C v))
   recursive subroutine apply_z(self, sys, h, weights, y, d, count)
      class(rational_engine), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: h
      real(wp), intent(in) :: weights(:)               !! of the loads [nodes]
      real(wp), intent(in) :: y(2*self%n)
      real(wp), intent(out) :: d(2*self%n)
      type(step_counters), intent(inout) :: count
      integer :: i
      associate (n => self%n, kq => self%products(:, 1), kv => self%products(:, 2), mv => self%products(:, 3), &
         & cv => self%products(:, 4))
         call multiply(sys, n, y(:n), y(n + 1:), kq, kv, mv, cv)
         kq = -(kq + cv)
         if (self%has_load) then
            do i = 1, size(weights)
               kq = kq + weights(i)*self%loads(:, i)
            end do
         end if
         call self%mass%solve(kq)
         d(:n) = h*y(n + 1:)
         d(n + 1:) = h*kq
         count%solves = count%solves + 1
      end associate
   end subroutine apply_z

   !> d = sum of w Re(tau x) over the poles of stage k, at first order
   recursive subroutine stage_first(self, stages, k, sys, h, count)
      class(rational_engine), intent(inout) :: self
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      class(linear_ode), intent(in) :: sys
      real(wp), intent(in) :: h
      type(step_counters), intent(inout) :: count
      integer :: j
      associate (n => self%n, stage => stages%stage(k), ay => self%products(:, 1), d => self%d)
         ay = 0.0_wp
         call sys%a%multiply_add(1.0_wp, self%y, ay)
         d = 0.0_wp
         do j = 1, stage%count
            self%x(:, 1) = h*ay
            if (self%has_load) then
               call combine(n, size(self%loads, 2), self%loads, stage%omega(:, j), self%pj)
               self%x(:, 1) = self%x(:, 1) + h*self%pj
            end if
            call self%systems%solve(stage%first + j - 1, self%x)
            count%solves = count%solves + 1
            if (stages%is_refined) call refine_first(self, sys, stage%first + j - 1, stage%pole(j), h, ay, count)
            call add_weighted(n, stage, j, self%x(:, 1), d)
         end do
      end associate
   end subroutine stage_first

   recursive subroutine factor_first(self, stages, k, sys, h)
      class(rational_engine), intent(inout) :: self
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      class(linear_ode), intent(in) :: sys
      real(wp), intent(in) :: h
      associate (f => stages%factor(k), ay => self%products(:, 1))
         if (abs(f%b) > 0.0_wp) then
            call derivative_of(self, sys, f%inner, self%y, ay)
            self%y = f%a*self%y + (f%b*h)*ay
         else
            self%y = f%a*self%y
         end if
         call derivative_of(self, sys, f%outer, self%y, ay)
         self%d = h*ay
      end associate
   end subroutine factor_first

   !> A y + the source by its weights
   recursive subroutine derivative_of(self, sys, weights, y, ay)
      class(rational_engine), intent(in) :: self
      class(linear_ode), intent(in) :: sys
      real(wp), intent(in) :: weights(:), y(:)
      real(wp), intent(out) :: ay(:)
      integer :: i
      ay = 0.0_wp
      call sys%a%multiply_add(1.0_wp, y, ay)
      if (.not. self%has_load) return
      do i = 1, size(weights)
         ay = ay + weights(i)*self%loads(:, i)
      end do
   end subroutine derivative_of

   !> x = loads*weights
   pure subroutine combine(n, nodes, loads, weights, x)
      integer, intent(in) :: n, nodes
      real(wp), intent(in) :: loads(n, nodes)
      complex(wp), intent(in) :: weights(nodes)
      complex(wp), intent(out) :: x(n)
      integer :: j
      x = weights(1)*loads(:, 1)
      do j = 2, nodes
         x = x + weights(j)*loads(:, j)
      end do
   end subroutine combine
end module dynstep_rational_engine
