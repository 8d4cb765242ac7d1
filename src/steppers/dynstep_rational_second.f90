! SPDX-License-Identifier: BSD-3-Clause
!> Stages of a rational step of M q'' + C q' + K q = P, with a coupling or without: of each pole p
!>
!>   d = sum w Re(tau x),   S x_q = h^2 (K q - P_j) - p h M v
!>                          S x_v = h^2 K v + p h (K q + C v - P_j),     S = p^2 M + p h C + h^2 K,
!>
!> two right-hand sides for each factorization, so that the increments of q and v come out to full relative accuracy
!> for any h: the velocity alone would lose damped positions at large steps, the position alone velocities at small
!> ones.  No power of hA is formed, and M is not inverted (but for explicit factors, where p > q):
!> d = z (a y + b z y), z y = (h v, h M^-1 (P - K q - C v)).
!>
!> Chains, symmetric and at most pentadiagonal, have kernels of their own (dynstep_rational_chain); other matrices, and
!> chains whose pivots want interchanges, go through LAPACK.
!>
!> PROGRAMMING INTERFACE
!>
!>   call second%init(sys, stages, takes_chain, has_factors, status)        allocates
!>   call second%note_load(sys, stages, status)               a load has come, or gone
!>   call second%forget()                                     the factors
!>   call second%prepare(sys, stages, t, h, count, status)    factors of all poles, no work for the same h; M
!>   call second%stage(sys, stages, k, h, has_load, loads, y, d, count)     d of stage k at y, with the h of `prepare`
!>   call second%factor(sys, stages, k, h, has_load, loads, y, d, count)    d of explicit factor k
module dynstep_rational_second
   use dynstep_archive, only: archive_type
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_zero
   use dynstep_pole_stages, only: pole_stages_type
   use dynstep_rational_chain, only: rational_chain, serves
   use dynstep_rational_terms, only: add_loads, add_weighted, combine, multiply_both
   use dynstep_shifted_systems, only: shifted_systems_type
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   type, public :: rational_second
      type(shifted_systems_type), private :: systems
      type(rational_chain), allocatable, private :: chain  ! where its kernels serve
      logical, private :: on_chain = .false.               ! and do so for this h
      type(factorization_type), private :: mass            ! where explicit factors need M^-1
      logical, private :: mass_known = .false.
      real(wp), private :: h = 0.0_wp                      ! of the factors, 0: none
      real(wp), private :: remade_h = 0.0_wp               ! that of a run that goes on here, 0: none
      logical, private :: remakes_mass = .false.           ! whose M was factorized
      real(wp), allocatable, private :: products(:, :)     ! K q, K v, M v, C v [n, 4]
      real(wp), allocatable, private :: inner(:)           ! a y + b z y of an explicit factor [2 n]
      complex(wp), allocatable, private :: x(:, :)         ! right-hand sides of a pole [n, 2]
      complex(wp), allocatable, private :: pj(:)           ! P_j - P_1 [n]
      complex(wp), allocatable, private :: residual(:, :)  ! of the refined form, like x
      real(wp), allocatable, private :: parts(:, :)        ! real and imaginary parts of x, and of products with it [n, 4]
   contains
      procedure :: init => second_init
      procedure :: note_load => second_note_load
      procedure :: forget => second_forget
      procedure :: prepare => second_prepare
      procedure :: stage => second_stage
      procedure :: factor => second_factor
      procedure :: archive => second_archive
   end type rational_second

contains

   !> Room, in an object that is new
   recursive subroutine second_init(self, sys, stages, takes_chain, has_factors, status)
      class(rational_second), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      logical, intent(in) :: takes_chain               !! the kernels of chains where they serve
      logical, intent(in) :: has_factors               !! explicit factors will come
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      if (takes_chain .and. .not. stages%is_refined .and. serves(sys, stages)) then
         allocate (self%chain)
         call self%chain%init(sys, stages, status)
      else
         call make_systems(self, sys, stages, status)
      end if
      if (has_factors) call self%mass%init(sys%m%kind, sys%n, sys%m%kl, sys%m%ku, sys%m%symmetric, status)
      if (status%failed() .or. .not. has_factors) return
      stat = 0
      if (.not. allocated(self%products)) allocate (self%products(sys%n, 4), stat=stat)
      if (stat == 0) allocate (self%inner(2*sys%n), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a step of '//text(sys%n)//' unknowns')
   end subroutine second_init

   !> Room for the way through LAPACK; a chain asks for it when its own kernels cannot factorize
   recursive subroutine make_systems(self, sys, stages, status)
      class(rational_second), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      type(status_type), intent(inout) :: status
      integer :: stat
      call self%systems%init_second(sys%m, sys%c, sys%k, max(1, stages%poles), status, sys%structure%is_coupled)
      if (status%failed()) return
      stat = 0
      if (.not. allocated(self%products)) allocate (self%products(sys%n, 4), stat=stat)
      if (stat == 0) allocate (self%x(sys%n, 2), self%pj(sys%n), stat=stat)
      if (stat == 0 .and. stages%is_refined) allocate (self%residual(sys%n, 2), self%parts(sys%n, 4), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a step of '//text(sys%n)//' unknowns')
   end subroutine make_systems

   !> A load has come, or gone
   recursive subroutine second_note_load(self, sys, stages, status)
      class(rational_second), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      type(status_type), intent(inout) :: status
      if (allocated(self%chain)) call self%chain%note_load(sys, stages, status)
   end subroutine second_note_load

   !> Matrices may have changed
   pure subroutine second_forget(self)
      class(rational_second), intent(inout) :: self
      self%h = 0.0_wp
      self%remade_h = 0.0_wp
      self%remakes_mass = .false.
      self%mass_known = .false.
      self%on_chain = .false.
   end subroutine second_forget

   !> Factors of all poles, and M where explicit factors need it
   recursive subroutine second_prepare(self, sys, stages, t, h, count, status)
      class(rational_second), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages     !! those of init, or others with the same poles in the same order
      real(wp), intent(in) :: t                        !! for sentences
      real(wp), intent(in) :: h
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: trouble, new_factors
      if (size(stages%factor) > 0 .and. .not. self%mass_known) then
         call self%mass%factorize(sys%m, status, t, 'mass matrix')
         if (.not. self%remakes_mass) count%factorizations = count%factorizations + 1
         self%remakes_mass = .false.
         self%mass_known = .not. status%failed()
      end if
      if (status%failed() .or. stages%poles == 0) return
      if (.not. abs(h - self%h) > 0.0_wp) return
      self%h = 0.0_wp
      new_factors = merge(stages%poles, 0, abs(h - self%remade_h) > 0.0_wp)
      self%remade_h = 0.0_wp
      if (allocated(self%chain)) then
         call self%chain%factorize(sys, stages, h, trouble)
         count%factorizations = count%factorizations + new_factors
         self%on_chain = trouble == 0
         if (self%on_chain .and. .not. self%chain%is_doubtful) then
            self%h = h
            return
         end if
         ! pivots nearly vanish: a rigid mode, or a pole on the spectrum, which the other factorization tells apart
         if (.not. allocated(self%x)) call make_systems(self, sys, stages, status)
      end if
      if (status%failed()) return
      if (sys%structure%is_coupled) then
         call self%systems%factorize_second(sys%m, sys%c, sys%k, h, stages%pole, status, t, sys%coupling%b, &
            & sys%coupling%k, sys%coupling%c)
      else
         call self%systems%factorize_second(sys%m, sys%c, sys%k, h, stages%pole, status, t)
      end if
      count%factorizations = count%factorizations + new_factors
      if (.not. status%failed()) self%h = h
   end subroutine second_prepare

   !> d = sum of w Re(tau x) over the poles of stage k
   recursive subroutine second_stage(self, sys, stages, k, h, has_load, loads, y, d, count)
      class(rational_second), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      real(wp), intent(in) :: h
      logical, intent(in) :: has_load
      real(wp), intent(in), contiguous :: loads(:, :)  !! at the nodes [n, nodes]
      real(wp), intent(in) :: y(2*sys%n)
      real(wp), intent(out) :: d(2*sys%n)
      type(step_counters), intent(inout) :: count
      complex(wp) :: p
      integer :: j
      if (self%on_chain) then
         call self%chain%stage(sys, stages, k, loads, y(:sys%n), y(sys%n + 1:), d(:sys%n), d(sys%n + 1:))
         count%solves = count%solves + 2*stages%stage(k)%count
         return
      end if
      associate (n => sys%n, stage => stages%stage(k), kq => self%products(:, 1), kv => self%products(:, 2), &
         & mv => self%products(:, 3), cv => self%products(:, 4))
         call multiply(sys, n, y(:n), y(n + 1:), kq, kv, mv, cv)
         if (has_load) kq = kq - loads(:, 1)
         d = 0.0_wp
         do j = 1, stage%count
            p = stage%pole(j)
            self%x(:, 1) = h**2*kq - (p*h)*mv
            self%x(:, 2) = h**2*kv + (p*h)*(kq + cv)
            if (has_load) then
               call combine(n, size(loads, 2), loads, stage%omega(:, j), self%pj)
               self%x(:, 1) = self%x(:, 1) - h**2*self%pj
               self%x(:, 2) = self%x(:, 2) - (p*h)*self%pj
            end if
            call self%systems%solve(stage%first + j - 1, self%x)
            count%solves = count%solves + 2
            if (stages%is_refined) call refine(self, sys, stage%first + j - 1, p, h, has_load, count)
            call add_weighted(n, stage, j, self%x(:, 1), d(:n))
            call add_weighted(n, stage, j, self%x(:, 2), d(n + 1:))
         end do
      end associate
   end subroutine second_stage

   !> x = x + S^-1 (right-hand side - S x) for both right-hand sides.  h^2, p^2 and p h are multiplied one factor after
   !> the other, so that rounding errors depend on x: that of a coefficient, or of a factor of S, would be the same in
   !> each step and add up.
   recursive subroutine refine(self, sys, j, p, h, has_load, count)
      class(rational_second), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      integer, intent(in) :: j                         !! place of the pole
      complex(wp), intent(in) :: p
      real(wp), intent(in) :: h
      logical, intent(in) :: has_load
      type(step_counters), intent(inout) :: count
      integer :: i, side
      associate (n => sys%n, r => self%residual, kq => self%products(:, 1), kv => self%products(:, 2), &
         & mv => self%products(:, 3), cv => self%products(:, 4), re => self%parts(:, 1), im => self%parts(:, 2), &
         & are => self%parts(:, 3), aim => self%parts(:, 4))
         do i = 1, n
            r(i, 1) = h*(h*kq(i)) - p*(h*mv(i))
            r(i, 2) = h*(h*kv(i)) + p*(h*(kq(i) + cv(i)))
         end do
         if (has_load) then
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
   end subroutine refine

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
   recursive subroutine second_factor(self, sys, stages, k, h, has_load, loads, y, d, count)
      class(rational_second), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(pole_stages_type), intent(in) :: stages
      integer, intent(in) :: k
      real(wp), intent(in) :: h
      logical, intent(in) :: has_load
      real(wp), intent(in), contiguous :: loads(:, :)
      real(wp), intent(in) :: y(2*sys%n)
      real(wp), intent(out) :: d(2*sys%n)
      type(step_counters), intent(inout) :: count
      associate (f => stages%factor(k))
         if (abs(f%b) > 0.0_wp) then
            call apply_z(self, sys, h, f%inner, has_load, loads, y, d, count)
            self%inner = f%a*y + f%b*d
         else
            self%inner = f%a*y
         end if
         call apply_z(self, sys, h, f%outer, has_load, loads, self%inner, d, count)
      end associate
   end subroutine second_factor

   !> d = z y + the source in it
   recursive subroutine apply_z(self, sys, h, weights, has_load, loads, y, d, count)
      class(rational_second), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      real(wp), intent(in) :: h
      real(wp), intent(in) :: weights(:)               !! of the loads [nodes]
      logical, intent(in) :: has_load
      real(wp), intent(in), contiguous :: loads(:, :)
      real(wp), intent(in) :: y(2*sys%n)
      real(wp), intent(out) :: d(2*sys%n)
      type(step_counters), intent(inout) :: count
      associate (n => sys%n, kq => self%products(:, 1), kv => self%products(:, 2), mv => self%products(:, 3), &
         & cv => self%products(:, 4))
         call multiply(sys, n, y(:n), y(n + 1:), kq, kv, mv, cv)
         kq = -(kq + cv)
         if (has_load) call add_loads(n, size(weights), loads, weights, kq)
         call self%mass%solve(kq)
         d(:n) = h*y(n + 1:)
         d(n + 1:) = h*kq
         count%solves = count%solves + 1
      end associate
   end subroutine apply_z

   !> The step length in force.  The factors follow from it and from the system, to the last bit; they are made at the next
   !> use, and not counted again.
   recursive subroutine second_archive(self, name, file)
      class(rational_second), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      real(wp) :: h
      logical :: mass_known
      call file%section(name)
      h = self%h
      if (abs(self%remade_h) > 0.0_wp) h = self%remade_h
      mass_known = self%mass_known .or. self%remakes_mass
      call file%item('h', h)
      call file%item('mass_known', mass_known)
      call file%end_section()
      if (.not. file%is_reading) return
      call self%forget()
      if (file%failed()) return
      self%remade_h = h
      self%remakes_mass = mass_known
   end subroutine second_archive
end module dynstep_rational_second
