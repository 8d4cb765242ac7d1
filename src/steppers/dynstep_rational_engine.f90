! SPDX-License-Identifier: BSD-3-Clause
!> Steps y1 = R(hA) y + forcing of linear systems, for any rational R: y' = A y + b(t) and, at the size of q,
!> M q'' + C q' + K q = p(t), with a coupling or without.
!>
!> With z = hA each stage of dynstep_pole_stages adds sum w Re(tau x), (z - p) x = z y + h b_j, and each explicit factor
!> z (a y + b z y): dynstep_rational_first and dynstep_rational_second make them.  Here they follow each other, with the
!> loads at their nodes.
!>
!> Systems without loads of up to `most_dense` unknowns in the state get the matrix of a step, y1 = y + D y, when a step
!> length is used for the third time: made from the stages in product form, column by column.
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
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: long, wp
   use dynstep_linear_load, only: evaluate_load, evaluate_source
   use dynstep_linear_ode, only: linear_ode
   use dynstep_linear_system, only: linear_system, load_none
   use dynstep_ode_system, only: ode_system
   use dynstep_pole_stages, only: form_product, pole_stages_type
   use dynstep_rational, only: rational_type
   use dynstep_rational_first, only: rational_first
   use dynstep_rational_second, only: rational_second
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
      type(rational_first), allocatable, private :: first  ! of a linear_ode
      type(rational_second), allocatable, private :: second   ! of a linear_system
      logical, private :: has_load = .false.
      integer, private :: n = 0                            ! order of the matrices
      real(wp), private :: h = 0.0_wp                      ! of the last step, 0: none
      integer(long), private :: uses = 0                   ! steps of this length
      real(wp), allocatable, private :: loads(:, :)        ! at the nodes of a step [n, nodes]
      real(wp), private :: load_time = 0.0_wp              ! of the last one
      logical, private :: load_known = .false.
      real(wp), allocatable, private :: dense(:, :)        ! D of a step without loads, y1 = y + D y [size, size]
      logical, private :: dense_known = .false.
      real(wp), allocatable, private :: y(:), d(:)         ! state of stages after the first, increment of one [size]
   contains
      procedure :: init => engine_init
      procedure :: forget => engine_forget
      procedure :: step => engine_step
      procedure :: archive => engine_archive
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
      logical :: has_factors
      integer :: n_state, nodes, stat

      if (status%failed()) return
      self%r = r
      call self%stages%set(r, form, status)
      if (.not. allocated(self%product)) allocate (self%product)
      call self%product%set(r, form_product, status)
      if (status%failed()) return
      self%n = sys%n
      n_state = sys%state_size()
      nodes = size(self%stages%nodes)
      has_factors = size(self%stages%factor) + size(self%product%factor) > 0
      if (allocated(self%first)) deallocate (self%first)
      if (allocated(self%second)) deallocate (self%second)
      call self%forget()
      select type (sys)
      class is (linear_system)
         allocate (self%second)
         self%has_load = sys%load_kind /= load_none
         call self%second%init(sys, self%stages, n_state > most_dense, has_factors, status)
      class is (linear_ode)
         allocate (self%first)
         self%has_load = sys%source_kind /= load_none
         call self%first%init(sys, self%stages, status)
      class default
         call status%set(dynstep_invalid_input, 'the system is not linear')
      end select
      if (status%failed()) return
      if (allocated(self%loads)) deallocate (self%loads, self%y, self%d)
      if (allocated(self%dense)) deallocate (self%dense)
      allocate (self%loads(self%n, nodes), self%y(n_state), self%d(n_state), stat=stat)
      if (stat == 0 .and. n_state <= most_dense .and. .not. self%stages%is_refined) &
         & allocate (self%dense(n_state, n_state), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a step of '//text(self%n)//' unknowns')
   end subroutine engine_init

   !> Matrices and loads may have changed
   pure subroutine engine_forget(self)
      class(rational_engine), intent(inout) :: self
      self%h = 0.0_wp
      self%uses = 0
      self%load_known = .false.
      self%dense_known = .false.
      if (allocated(self%first)) call self%first%forget()
      if (allocated(self%second)) call self%second%forget()
   end subroutine engine_forget

   !> One step of length h from t to t1 = t + h up to rounding: dy = R(hA) y - y + forcing
   recursive subroutine engine_step(self, sys, t, h, t1, y, dy, count, status)
      class(rational_engine), intent(inout) :: self
      class(ode_system), intent(inout) :: sys          !! that of init
      real(wp), intent(in) :: t, h, t1
      real(wp), intent(in), contiguous :: y(:)         !! state at t [state_size]
      real(wp), intent(out), contiguous :: dy(:)       !! increment [state_size]
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      if (.not. abs(h) > 0.0_wp) then
         dy = 0.0_wp
         return
      end if
      if (abs(h - self%h) > 0.0_wp) then
         self%uses = 0
         self%dense_known = .false.
      end if
      call note_load(self, sys, status)
      call take_loads(self, sys, t, h, t1, count, status)
      if (status%failed()) return
      if (allocated(self%dense) .and. .not. self%has_load) then
         if (.not. self%dense_known .and. self%uses >= uses_before_dense) call make_dense(self, sys, t, h, count, status)
         if (status%failed()) return
         if (self%dense_known) then
            call dense_step(size(y), self%dense, y, dy)
            self%uses = self%uses + 1
            return
         end if
      end if
      call by_stages(self, self%stages, sys, t, h, y, dy, count, status)
      self%h = 0.0_wp
      if (status%failed()) return
      self%h = h
      self%uses = self%uses + 1
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
         if (has_load .neqv. self%has_load) call self%second%note_load(sys, self%stages, status)
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

   !> dy = D y
   pure subroutine dense_step(size, dense, y, dy)
      integer, intent(in) :: size
      real(wp), intent(in) :: dense(size, size)
      real(wp), intent(in) :: y(size)
      real(wp), intent(out) :: dy(size)
      integer :: j
      dy = dense(:, 1)*y(1)
      do j = 2, size
         dy = dy + dense(:, j)*y(j)
      end do
   end subroutine dense_step

   !> Columns of D, from unit states.  Loads have no such matrix: what it gives for a stiff equilibrium, K q = p, would
   !> cancel with D y but for rounding errors eps (h omega)^2 for each stage, while a stage forms K q - p first.
   recursive subroutine make_dense(self, sys, t, h, count, status)
      class(rational_engine), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t, h
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: unit(size(self%y))
      integer :: j
      do j = 1, size(unit)
         unit = 0.0_wp
         unit(j) = 1.0_wp
         call by_stages(self, self%product, sys, t, h, unit, self%dense(:, j), count, status)
      end do
      self%dense_known = .not. status%failed()
   end subroutine make_dense

   !> The stages one after the other, then the explicit factors, each at the state that those before it lead to.  The first
   !> one reads y and writes dy: where it is the only one, as in parallel form, nothing is copied.
   recursive subroutine by_stages(self, stages, sys, t, h, y, dy, count, status)
      class(rational_engine), intent(inout) :: self
      type(pole_stages_type), intent(in) :: stages
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t, h
      real(wp), intent(in), contiguous :: y(:)
      real(wp), intent(out), contiguous :: dy(:)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: k, many

      if (status%failed()) return
      select type (sys)
      class is (linear_system)
         call self%second%prepare(sys, stages, t, h, count, status)
      class is (linear_ode)
         call self%first%prepare(sys, stages, t, h, count, status)
      end select
      if (status%failed()) return
      many = size(stages%stage) + size(stages%factor)
      if (many == 0) then
         dy = 0.0_wp
         return
      end if
      call one_part(self, stages, 1, sys, h, y, dy, count)
      do k = 2, many
         self%y = y + dy
         call one_part(self, stages, k, sys, h, self%y, self%d, count)
         dy = dy + self%d
      end do
   end subroutine by_stages

   !> Increment d of stage k, or of the explicit factor that follows so many after the first stage
   recursive subroutine one_part(self, stages, k, sys, h, y, d, count)
      class(rational_engine), intent(inout) :: self
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      class(ode_system), intent(in) :: sys
      real(wp), intent(in) :: h
      real(wp), intent(in), contiguous :: y(:)
      real(wp), intent(out), contiguous :: d(:)
      type(step_counters), intent(inout) :: count
      associate (many => size(stages%stage))
         select type (sys)
         class is (linear_system)
            if (k <= many) then
               call self%second%stage(sys, stages, k, h, self%has_load, self%loads, y, d, count)
            else
               call self%second%factor(sys, stages, k - many, h, self%has_load, self%loads, y, d, count)
            end if
         class is (linear_ode)
            if (k <= many) then
               call self%first%stage(sys, stages, k, h, self%has_load, self%loads, y, d, count)
            else
               call self%first%factor(sys, stages, k - many, h, self%has_load, self%loads, y, d)
            end if
         end select
      end associate
   end subroutine one_part

   !> The load at the end of the last step, the matrix of a step, and how long h has been the same
   recursive subroutine engine_archive(self, name, file)
      class(rational_engine), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%expect('n', self%n)
      call file%expect('degree', self%r%q)
      call file%item('h', self%h)
      call file%item('uses', self%uses)
      call file%item('load_known', self%load_known)
      call file%item('load_time', self%load_time)
      if (self%load_known) call file%item('loads', self%loads)
      call file%item('dense_known', self%dense_known)
      if (self%dense_known) call file%item('dense', self%dense)
      if (allocated(self%first)) call self%first%archive('first', file)
      if (allocated(self%second)) call self%second%archive('second', file)
      call file%end_section()
      if (file%failed()) call self%forget()
   end subroutine engine_archive
end module dynstep_rational_engine
