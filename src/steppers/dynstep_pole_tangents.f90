! SPDX-License-Identifier: BSD-3-Clause
!> Rational functions of z = h J applied to vectors, pole by pole, with the Jacobian J of a system at some point:
!>
!>   x = sum_j w_j (z - p_j)^-1 g
!>
!> For M q'' = f, J = [0, I; -M^-1 K, -M^-1 C] and the systems have the size of q (S as in DYNSTEP_SHIFTED_SYSTEMS):
!>
!>   S x_q = -(h C + p M) g_q - h M g_v,   x_v = (g_q + p x_q)/h
!>
!> PROGRAMMING INTERFACE
!>
!>   call tangents%init(sys, poles, status)               all poles, conjugates too
!>   call tangents%evaluate(sys, t, y, a, count, status)  J there; no work where it is constant and known
!>   call tangents%factorize(h, t, count, status)         no work for the same J and h
!>   call tangents%apply(weights, g, x, count)            a weight for each pole
!>   tangents%stiffness(h)                                about |h J|
!>   tangents%is_known, %is_constant
module dynstep_pole_tangents
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_accelerations, only: check_callback
   use dynstep_archive, only: archive_type
   use dynstep_kinds, only: long, wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_identity, kind_banded, kind_dense, kind_diagonal, kind_zero, matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_ode_system, only: ode_system
   use dynstep_shifted_systems, only: shifted_systems_type
   use dynstep_status, only: dynstep_invalid_input, dynstep_not_finite, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   public :: check_jacobian_kind

   type, public :: pole_tangents
      logical :: is_known = .false.                  !! J was evaluated
      logical :: is_constant = .false.               !! and needs not be again
      logical, private :: is_mechanical = .false.
      logical, private :: is_factorized = .false.    ! for h and J
      real(wp), private :: h = 0.0_wp
      integer, private :: n = 0
      type(matrix_type), private :: j                ! df/dy
      type(matrix_type), private :: m, c, k          ! or those of a mechanical system
      type(shifted_systems_type), private :: systems
      complex(wp), allocatable, private :: poles(:)  ! one of each pair
      integer, allocatable, private :: place(:)      ! of these among all poles
      real(wp), allocatable, private :: gain_b(:), gain_k(:), gain_c(:)   ! coupling of a linear_system
      complex(wp), allocatable, private :: x(:)      ! [n]
      real(wp), allocatable, private :: re(:), im(:) ! [n]
   contains
      procedure :: init => tangents_init
      procedure :: forget => tangents_forget
      procedure :: evaluate => tangents_evaluate
      procedure :: factorize => tangents_factorize
      procedure :: apply => tangents_apply
      procedure :: stiffness => tangents_stiffness
      procedure :: archive => tangents_archive
   end type pole_tangents

contains

   !> The declared storage of df/dy makes sense
   pure subroutine check_jacobian_kind(sys, status)
      class(ode_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      if (status%failed()) return
      if (sys%jacobian_kind < kind_diagonal .or. sys%jacobian_kind > kind_dense) then
         call status%set(dynstep_invalid_input, 'jacobian_kind = '//text(sys%jacobian_kind) &
            & //' is none of diagonal (1), banded (2), dense (3)')
      else if (sys%jacobian_kind == kind_banded) then
         if (min(sys%jacobian_kl, sys%jacobian_ku) < 0 .or. max(sys%jacobian_kl, sys%jacobian_ku) >= sys%n) &
            & call status%set(dynstep_invalid_input, 'jacobian_kl = '//text(sys%jacobian_kl)//' and jacobian_ku = ' &
            & //text(sys%jacobian_ku)//' do not fit a matrix of order '//text(sys%n)//': 0 <= kl, ku < n')
      end if
   end subroutine check_jacobian_kind

   !> Storage for the declared structure of the system, whose declarations have been checked
   recursive subroutine tangents_init(self, sys, poles, status)
      class(pole_tangents), intent(inout) :: self
      class(ode_system), intent(in) :: sys
      complex(wp), intent(in) :: poles(:)            !! conjugates together
      type(status_type), intent(inout) :: status
      integer :: i

      if (status%failed()) return
      call self%forget()
      self%n = sys%n
      self%place = pack([(i, i=1, size(poles))], aimag(poles) >= 0.0_wp)
      self%poles = poles(self%place)
      if (allocated(self%x)) deallocate (self%x, self%re, self%im)
      allocate (self%x(sys%n), self%re(sys%n), self%im(sys%n))
      if (allocated(self%gain_b)) deallocate (self%gain_b, self%gain_k, self%gain_c)
      select type (sys)
      class is (mechanical_system)
         self%is_mechanical = .true.
         associate (s => sys%structure)
            call self%m%init(s%mass, sys%n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
            call self%k%init(s%tangent, sys%n, s%kl, s%ku, s%tangent_is_symmetric, status)
            call self%c%init(merge(kind_zero, s%tangent, s%velocity_free), sys%n, s%kl, s%ku, s%tangent_is_symmetric, status)
         end associate
         call self%systems%init_second(self%m, self%c, self%k, size(self%poles), status, sys%structure%is_coupled)
         if (sys%structure%is_coupled) allocate (self%gain_b(sys%n), self%gain_k(sys%n), self%gain_c(sys%n))
      class default
         self%is_mechanical = .false.
         call self%j%init(sys%jacobian_kind, sys%n, sys%jacobian_kl, sys%jacobian_ku, .false., status)
         call self%systems%init_first(self%j, size(self%poles), status)
      end select
   end subroutine tangents_init

   !> A new run may have other matrices
   pure subroutine tangents_forget(self)
      class(pole_tangents), intent(inout) :: self
      self%is_known = .false.
      self%is_constant = .false.
      self%is_factorized = .false.
   end subroutine tangents_forget

   !> J at a point
   recursive subroutine tangents_evaluate(self, sys, t, y, a, count, status)
      class(pole_tangents), intent(inout) :: self
      class(ode_system), intent(inout) :: sys
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)                   !! [state_size]
      real(wp), intent(in) :: a(:)                   !! q'' there, of a mechanical system [n]
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer(long) :: before
      integer :: ierr

      if (status%failed() .or. self%is_constant) return
      self%is_known = .false.
      self%is_factorized = .false.
      select type (sys)
      class is (mechanical_system)
         associate (n => sys%n, s => sys%structure)
            if (s%mass /= kind_identity) then
               call self%m%set_zero()
               call sys%mass(t, y(1:n), y(n + 1:2*n), self%m, ierr)
               count%masses = count%masses + 1
               call check_callback('mass', ierr, t, status)
               call check_matrix('mass', self%m, t, status)
               if (status%failed()) return
            end if
            call self%k%set_zero()
            call self%c%set_zero()
            before = sys%difference_forces
            call sys%tangent(t, y(1:n), y(n + 1:2*n), a, self%k, self%c, ierr)
            count%forces = count%forces + (sys%difference_forces - before)
            call check_callback('tangent', ierr, t, status)
            call check_matrix('tangent', self%k, t, status)
            call check_matrix('tangent', self%c, t, status)
            self%is_constant = s%mass_is_constant .and. s%tangent_is_constant .and. .not. status%failed()
         end associate
         call take_coupling(self, sys)
      class default
         call self%j%set_zero()
         before = sys%difference_rhs
         call sys%jacobian(t, y, self%j, ierr)
         count%forces = count%forces + (sys%difference_rhs - before)
         call check_callback('jacobian', ierr, t, status)
         call check_matrix('jacobian', self%j, t, status)
      end select
      count%tangents = count%tangents + 1
      self%is_known = .not. status%failed()
   end subroutine tangents_evaluate

   recursive subroutine take_coupling(self, sys)
      class(pole_tangents), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      if (.not. sys%structure%is_coupled) return
      select type (sys)
      class is (linear_system)
         self%gain_b = sys%coupling%b
         self%gain_k = sys%coupling%k
         self%gain_c = sys%coupling%c
      end select
   end subroutine take_coupling

   pure subroutine check_matrix(name, matrix, t, status)
      character(len=*), intent(in) :: name           !! of the procedure that filled it
      type(matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: t
      type(status_type), intent(inout) :: status
      integer :: row, column
      if (status%failed()) return
      call matrix%first_not_finite(row, column)
      if (row > 0) call status%set(dynstep_not_finite, name//' returned '//text(matrix%entry(row, column))//' in row ' &
         & //text(row)//', column '//text(column)//' at t = '//text(t)//'; a smaller step may keep it in its domain', &
         & retry=.true.)
   end subroutine check_matrix

   !> The matrices z - p_j for h
   recursive subroutine tangents_factorize(self, h, t, count, status)
      class(pole_tangents), intent(inout) :: self
      real(wp), intent(in) :: h
      real(wp), intent(in) :: t                      !! time, for sentences
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status

      if (status%failed()) return
      if (self%is_factorized .and. .not. abs(h - self%h) > 0.0_wp) return
      self%h = h
      if (.not. self%is_mechanical) then
         call self%systems%factorize_first(self%j, h, self%poles, status, t)
      else if (allocated(self%gain_b)) then
         call self%systems%factorize_second(self%m, self%c, self%k, h, self%poles, status, t, self%gain_b, self%gain_k, &
            & self%gain_c)
      else
         call self%systems%factorize_second(self%m, self%c, self%k, h, self%poles, status, t)
      end if
      count%factorizations = count%factorizations + size(self%poles)
      self%is_factorized = .not. status%failed()
   end subroutine tangents_factorize

   !> x = sum_j w_j (z - p_j)^-1 g, where weights of conjugate poles are conjugate
   recursive subroutine tangents_apply(self, weights, g, x, count)
      class(pole_tangents), intent(inout) :: self
      complex(wp), intent(in) :: weights(:)          !! in the order of the poles of `init`
      real(wp), intent(in) :: g(:)                   !! [state_size]
      real(wp), intent(inout) :: x(:)                !! [state_size]
      type(step_counters), intent(inout) :: count
      complex(wp) :: w
      integer :: i

      x = 0.0_wp
      do i = 1, size(self%poles)
         w = weights(self%place(i))
         if (aimag(self%poles(i)) > 0.0_wp) w = 2.0_wp*w
         if (self%is_mechanical) then
            call add_second(self, i, w, self%n, g, x)
         else
            self%x = g
            call self%systems%solve(i, self%x)
            x = x + real(w*self%x, wp)
         end if
      end do
      count%solves = count%solves + size(self%poles)
   end subroutine tangents_apply

   !> x = x + Re(w (z - p)^-1 g) of a mechanical system
   recursive subroutine add_second(self, i, w, n, g, x)
      class(pole_tangents), intent(inout) :: self
      integer, intent(in) :: i, n
      complex(wp), intent(in) :: w
      real(wp), intent(in) :: g(2*n)
      real(wp), intent(inout) :: x(2*n)
      associate (p => self%poles(i), h => self%h)
         self%re = 0.0_wp
         call self%m%multiply_add(1.0_wp, g(1:n), self%re)
         self%im = 0.0_wp
         call self%c%multiply_add(-h, g(1:n), self%im)
         call self%m%multiply_add(-h, g(n + 1:), self%im)
         self%x = self%im - p*self%re
         if (allocated(self%gain_c)) self%x = self%x - self%gain_b*(h*dot_product(self%gain_c, g(1:n)))
         call self%systems%solve(i, self%x)
         x(1:n) = x(1:n) + real(w*self%x, wp)
         x(n + 1:) = x(n + 1:) + real(w*((g(1:n) + p*self%x)/h), wp)
      end associate
   end subroutine add_second

   !> About |h J|: its row sums, or h times the highest frequency and damping that rows of M, C and K tell of
   recursive function tangents_stiffness(self, h) result(stiffness)
      class(pole_tangents), intent(inout) :: self
      real(wp), intent(in) :: h
      real(wp) :: stiffness
      integer :: i
      if (self%is_mechanical) then
         stiffness = 0.0_wp
         call self%k%absolute_row_sums(self%re)
         call self%c%absolute_row_sums(self%im)
         do i = 1, self%n
            associate (mass => abs(self%m%entry(i, i)))
               stiffness = max(stiffness, sqrt(ratio(h**2*self%re(i), mass)), ratio(abs(h)*self%im(i), mass))
            end associate
         end do
      else
         call self%j%absolute_row_sums(self%re)
         stiffness = abs(h)*maxval(self%re)
      end if
   end function tangents_stiffness

   !> x/y of numbers >= 0, or 1e100 where that is more
   pure real(wp) function ratio(x, y)
      real(wp), intent(in) :: x, y
      real(wp), parameter :: most = 1.0e100_wp
      ratio = most
      if (x < most*min(y, 1.0e100_wp)) ratio = x/y
   end function ratio

   !> J, or M, C and K.  The factors follow from them and from h, to the last bit: they are made again at once, uncounted.
   recursive subroutine tangents_archive(self, name, file)
      class(pole_tangents), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      type(step_counters) :: uncounted
      type(status_type) :: status
      logical :: is_factorized
      call file%section(name)
      call file%expect('n', self%n)
      call file%expect('poles', size(self%poles))
      is_factorized = self%is_factorized
      call file%item('is_known', self%is_known)
      call file%item('is_constant', self%is_constant)
      call file%item('is_factorized', is_factorized)
      call file%item('h', self%h)
      if (self%is_known .and. self%is_mechanical) then
         call self%m%archive('m', file)
         call self%c%archive('c', file)
         call self%k%archive('k', file)
         call file%item('gain_b', self%gain_b)
         call file%item('gain_k', self%gain_k)
         call file%item('gain_c', self%gain_c)
      else if (self%is_known) then
         call self%j%archive('j', file)
      end if
      call file%end_section()
      if (.not. file%is_reading) return
      self%is_factorized = .false.
      if (is_factorized .and. .not. file%failed()) call self%factorize(self%h, 0.0_wp, uncounted, status)
      if (status%failed()) call file%refuse('the matrices of the file cannot be factorized, '//trim(status%message))
      if (file%failed()) call self%forget()
   end subroutine tangents_archive
end module dynstep_pole_tangents
