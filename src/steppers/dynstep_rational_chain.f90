! SPDX-License-Identifier: BSD-3-Clause
!> Stages of a rational step of a chain: M, C and K symmetric and at most pentadiagonal, all poles of a stage side by
!> side (dynstep_pole_sweeps), with a load and with a coupling.
!>
!> With the coupling M q'' + C q' + K q = P - b (k.q + c.q') a system of a pole is S + b g', g = h^2 k + p h c, and its
!> right-hand side has r + b beta more than that of the band alone, so that
!>
!>   x = x0 + W (beta - g.x0)/(1 + g.W),   S x0 = r,   S W = b     (Sherman and Morrison)
!>
!> S is symmetric: g.x0 = u.r with S u = g, and u.(K q) = (K u).q.  So the band stays, x0 is not needed, and the coupling
!> costs some scalar products.
!>
!> PROGRAMMING INTERFACE
!>
!>   call chain%init(sys, stages, status)              allocates; `serves` tells beforehand whether
!>   call chain%note_load(sys, stages, status)         where the system may have got one since
!>   call chain%factorize(sys, stages, h, trouble)     trouble > 0: this pole wants interchanges of rows
!>   call chain%stage(sys, stages, k, loads, q, v, dq, dv)
module dynstep_rational_chain
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system, load_none
   use dynstep_matrix, only: matrix_type
   use dynstep_pole_stages, only: pole_stages_type
   use dynstep_pole_sweeps, only: most_lanes, pole_sweeps_type, pole_sweeps_width
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: serves

   !> A pivot, next to its diagonal entry, from which on S may be singular; that of dynstep_shifted_systems
   real(wp), parameter :: small_pivot = sqrt(epsilon(1.0_wp))

   !> What a coupling needs of one pole
   type :: coupled_pole
      complex(wp), allocatable :: w(:)                !! S^-1 b/(1 + g.S^-1 b) [n]
      complex(wp), allocatable :: u(:)                !! S^-1 g [n]
      complex(wp), allocatable :: ku(:), mu(:), cu(:) !! K u, M u, C u [n]
   end type coupled_pole

   type, public :: rational_chain
      real(wp) :: h = 0.0_wp                                     !! of the factors
      logical :: is_doubtful = .false.                           !! they have pivots that nearly vanish
      type(pole_sweeps_type), allocatable, private :: sweeps(:)  ! one for each stage
      type(coupled_pole), allocatable, private :: coupled(:)     ! one for each pole
      real(wp), allocatable, private :: load(:, :, :)            ! Re, Im of P_j [2, poles of a stage, n]; all stages
                                                                 ! have equally many, or there is one
      logical, private :: has_load = .false.
   contains
      procedure :: init => chain_init
      procedure :: note_load => chain_note_load
      procedure :: factorize => chain_factorize
      procedure :: stage => chain_stage
   end type rational_chain

contains

   !> True where these kernels make the stages
   pure logical function serves(sys, stages)
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      serves = pole_sweeps_width(sys%m, sys%c, sys%k) > 0 .and. most_of_a_stage(stages) <= most_lanes
   end function serves

   pure integer function most_of_a_stage(stages)
      type(pole_stages_type), intent(in) :: stages
      integer :: k
      most_of_a_stage = 0
      do k = 1, size(stages%stage)
         most_of_a_stage = max(most_of_a_stage, stages%stage(k)%count)
      end do
   end function most_of_a_stage

   !> Room for the factors of all stages
   recursive subroutine chain_init(self, sys, stages, status)
      class(rational_chain), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      type(status_type), intent(inout) :: status
      integer :: j, k, stat
      if (status%failed()) return
      self%h = 0.0_wp
      if (allocated(self%sweeps)) deallocate (self%sweeps)
      if (allocated(self%coupled)) deallocate (self%coupled)
      if (allocated(self%load)) deallocate (self%load)
      allocate (self%sweeps(size(stages%stage)), stat=stat)
      do k = 1, size(stages%stage)
         call self%sweeps(k)%init(sys%n, pole_sweeps_width(sys%m, sys%c, sys%k), stages%stage(k)%count, status)
      end do
      if (sys%structure%is_coupled .and. stat == 0) then
         allocate (self%coupled(stages%poles), stat=stat)
         do j = 1, stages%poles
            if (stat /= 0) exit
            allocate (self%coupled(j)%w(sys%n), self%coupled(j)%u(sys%n), self%coupled(j)%ku(sys%n), &
               & self%coupled(j)%mu(sys%n), self%coupled(j)%cu(sys%n), stat=stat)
         end do
      end if
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a step of '//text(sys%n)//' unknowns')
      call self%note_load(sys, stages, status)
   end subroutine chain_init

   !> A load may have come, or gone
   recursive subroutine chain_note_load(self, sys, stages, status)
      class(rational_chain), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      self%has_load = sys%load_kind /= load_none
      if (allocated(self%load) .or. .not. self%has_load) return
      allocate (self%load(2, most_of_a_stage(stages), sys%n), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a load of '//text(sys%n)//' unknowns')
   end subroutine chain_note_load

   !> Factors for a step length
   recursive subroutine chain_factorize(self, sys, stages, h, trouble)
      class(rational_chain), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      real(wp), intent(in) :: h
      integer, intent(out) :: trouble                 !! not 0: these kernels are not to be used for this h
      integer :: j, k
      trouble = 0
      self%h = 0.0_wp
      self%is_doubtful = .false.
      do k = 1, size(stages%stage)
         associate (stage => stages%stage(k))
            call self%sweeps(k)%factorize(sys%m, sys%c, sys%k, h, stage%pole, trouble)
            if (trouble /= 0) return
            self%is_doubtful = self%is_doubtful .or. any(self%sweeps(k)%weakest(:stage%count) <= small_pivot)
            if (.not. allocated(self%coupled)) cycle
            do j = 1, stage%count
               call couple(self%sweeps(k), j, sys, stage%pole(j), h, self%coupled(stage%first + j - 1), trouble)
               if (trouble /= 0) return
            end do
         end associate
      end do
      self%h = h
   end subroutine chain_factorize

   recursive subroutine couple(sweeps, j, sys, p, h, c, trouble)
      type(pole_sweeps_type), intent(in) :: sweeps
      integer, intent(in) :: j
      class(linear_system), intent(in) :: sys
      complex(wp), intent(in) :: p
      real(wp), intent(in) :: h
      type(coupled_pole), intent(inout) :: c
      integer, intent(out) :: trouble
      complex(wp) :: gw
      real(wp) :: terms
      trouble = 0
      c%u = h**2*sys%coupling%k + (p*h)*sys%coupling%c
      c%w = sys%coupling%b
      call sweeps%solve(j, c%w)
      gw = sum(c%u*c%w)
      terms = 1.0_wp + sum(abs(c%u*c%w))
      call sweeps%solve(j, c%u)
      ! a closed loop with a pole of R on its spectrum is judged elsewhere
      if (.not. abs(1.0_wp + gw) > 8.0_wp*epsilon(1.0_wp)*terms) then
         trouble = j
         return
      end if
      c%w = c%w/(1.0_wp + gw)
      call complex_product(sys%k, c%u, c%ku)
      call complex_product(sys%m, c%u, c%mu)
      call complex_product(sys%c, c%u, c%cu)
   end subroutine couple

   !> y = A x
   recursive subroutine complex_product(a, x, y)
      type(matrix_type), intent(in) :: a
      complex(wp), intent(in) :: x(:)
      complex(wp), intent(out) :: y(:)
      real(wp) :: re(size(x)), im(size(x))
      re = 0.0_wp
      im = 0.0_wp
      call a%multiply_add(1.0_wp, real(x, wp), re)
      call a%multiply_add(1.0_wp, aimag(x), im)
      y = cmplx(re, im, wp)
   end subroutine complex_product

   !> dq, dv of stage k
   recursive subroutine chain_stage(self, sys, stages, k, loads, q, v, dq, dv)
      class(rational_chain), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      real(wp), intent(in), contiguous :: loads(:, :) !! at the nodes [n, nodes]
      real(wp), intent(in) :: q(sys%n), v(sys%n)
      real(wp), intent(out) :: dq(sys%n), dv(sys%n)
      integer :: j
      associate (stage => stages%stage(k))
         if (self%has_load) then
            call combine(sys%n, size(loads, 2), stage%count, loads, stage%omega, self%load)
            call self%sweeps(k)%increment(stage%tau, stage%w, q, v, dq, dv, self%load)
         else
            call self%sweeps(k)%increment(stage%tau, stage%w, q, v, dq, dv)
         end if
         if (.not. allocated(self%coupled)) return
         do j = 1, stage%count
            call add_coupling(self, sys, j, stage%pole(j), stage%w(j)*stage%tau(j), self%coupled(stage%first + j - 1), q, v, &
               & dq, dv)
         end do
      end associate
   end subroutine chain_stage

   !> Re, Im of P_j = sum of omega_ij P_i = P_1 + sum of omega_ij (P_i - P_1)
   pure subroutine combine(n, nodes, poles, loads, omega, load)
      integer, intent(in) :: n, nodes, poles
      real(wp), intent(in) :: loads(n, nodes)
      complex(wp), intent(in) :: omega(nodes, poles)
      real(wp), intent(inout), contiguous :: load(:, :, :)
      real(wp) :: change
      integer :: i, j, node
      do j = 1, poles
         load(1, j, :) = loads(:, 1)
         load(2, j, :) = 0.0_wp
      end do
      do node = 2, nodes
         do i = 1, n
            change = loads(i, node) - loads(i, 1)
            do j = 1, poles
               load(1, j, i) = load(1, j, i) + real(omega(node, j), wp)*change
               load(2, j, i) = load(2, j, i) + aimag(omega(node, j))*change
            end do
         end do
      end do
   end subroutine combine

   !> The terms W (beta - g.x0)/(1 + g.W) of one pole
   recursive subroutine add_coupling(self, sys, j, p, weight, c, q, v, dq, dv)
      class(rational_chain), intent(in) :: self
      class(linear_system), intent(in) :: sys
      integer, intent(in) :: j                        !! of the poles of the stage
      complex(wp), intent(in) :: p, weight            !! w tau
      type(coupled_pole), intent(in) :: c
      real(wp), intent(in) :: q(:), v(:)
      real(wp), intent(inout) :: dq(:), dv(:)
      complex(wp) :: gq, gv, up, kuq
      real(wp) :: kq, kv, cv, h
      integer :: i
      h = self%h
      kq = dot_product(sys%coupling%k, q)
      kv = dot_product(sys%coupling%k, v)
      cv = dot_product(sys%coupling%c, v)
      up = (0.0_wp, 0.0_wp)
      if (self%has_load) then
         do i = 1, sys%n
            up = up + c%u(i)*cmplx(self%load(1, j, i), self%load(2, j, i), wp)
         end do
      end if
      kuq = sum(c%ku*q)
      gq = h**2*(kuq - up) - (p*h)*sum(c%mu*v)
      gv = h**2*sum(c%ku*v) + (p*h)*(kuq + sum(c%cu*v) - up)
      gq = weight*(h**2*kq - gq)
      gv = weight*(h**2*kv + (p*h)*(kq + cv) - gv)
      do i = 1, sys%n
         dq(i) = dq(i) + real(gq*c%w(i), wp)
         dv(i) = dv(i) + real(gv*c%w(i), wp)
      end do
   end subroutine add_coupling
end module dynstep_rational_chain
