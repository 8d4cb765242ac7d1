! SPDX-License-Identifier: BSD-3-Clause
!> Newmark steps of linear systems of any structure: products and solves vector by vector, in
!> all forms of dynstep_newmark_form.
!>
!> Chains have their own products and solves, and fused sweeps for the increment form.
module dynstep_linear_vector
   use dynstep_factorization, only: factorization_type
   use dynstep_kinds, only: wp
   use dynstep_linear_chain, only: is_chain, linear_chain, matrix_c, matrix_k, matrix_m
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_banded, kind_zero, matrix_type
   use dynstep_newmark_form, only: form_increment, form_predicted, form_reflected, form_two_solves, newmark_form
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   type, public :: linear_vector
      integer :: n = 0
      logical :: damped = .false.                  !! there is a C
      logical, private :: has_chain = .false.      ! the matrices are those of a chain
      logical, private :: chain_solves = .false.   ! and S is factorized there
      type(linear_chain), private :: chain
      real(wp), allocatable, private :: r(:), x(:), w(:), u(:)   ! [n]
   contains
      procedure :: init => vector_init
      procedure :: read_matrices => vector_read_matrices
      procedure :: prepare => vector_prepare
      procedure :: step => vector_step
   end type linear_vector

contains

   recursive subroutine vector_init(self, sys, status)
      class(linear_vector), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer :: stat

      if (status%failed()) return
      self%n = sys%n
      self%damped = sys%c%kind /= kind_zero
      self%has_chain = is_chain(sys)
      self%chain_solves = .false.
      if (self%has_chain) call self%chain%init(sys, status)
      if (allocated(self%r)) deallocate (self%r, self%x, self%w, self%u)
      allocate (self%r(sys%n), self%x(sys%n), self%w(sys%n), self%u(sys%n), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory to step '//text(sys%n)//' coordinates')
   end subroutine vector_init

   pure subroutine vector_read_matrices(self, sys)
      class(linear_vector), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      if (self%has_chain) call self%chain%read_matrices(sys)
   end subroutine vector_read_matrices

   !> Take over the factorization of S, where there is a faster one for its structure
   pure subroutine vector_prepare(self, form, s, factor)
      class(linear_vector), intent(inout) :: self
      type(newmark_form), intent(in) :: form
      type(matrix_type), intent(in) :: s
      type(factorization_type), intent(in) :: factor
      self%chain_solves = self%has_chain .and. factor%positive_definite
      if (self%chain_solves) &
         & call self%chain%factorize(s, merge(-form%h, 1.0_wp, form%form == form_increment), self%chain_solves)
   end subroutine vector_prepare

   !> One step
   pure subroutine vector_step(self, sys, form, factor, loaded, p0, p1, q, v, a)
      class(linear_vector), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      type(newmark_form), intent(in) :: form
      type(factorization_type), intent(in) :: factor      !! of S
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p0(self%n), p1(self%n)      !! loads, read where `loaded`
      real(wp), intent(inout) :: q(self%n), v(self%n)
      real(wp), intent(inout) :: a(self%n)                !! read and written by form_predicted only

      select case (form%form)
      case (form_increment)
         if (self%chain_solves) then
            call self%chain%step(form, loaded, p0, p1, q, v)
         else
            call increment(self, sys, form, factor, loaded, p0, p1, q, v, self%r, self%x)
         end if
      case (form_reflected)
         call reflected(self, sys, form, factor, loaded, p0, p1, q, v, self%r, self%x)
      case (form_two_solves)
         call two_solves(self, sys, form, factor, loaded, p0, p1, q, v, self%r, self%x, self%w)
      case (form_predicted)
         call predicted(self, sys, form, factor, loaded, p1, q, v, a, self%r, self%x, self%w, self%u)
      end select
   end subroutine vector_step

   pure subroutine increment(self, sys, form, factor, loaded, p0, p1, q, v, r, x)
      type(linear_vector), intent(in) :: self
      class(linear_system), intent(in) :: sys
      type(newmark_form), intent(in) :: form
      type(factorization_type), intent(in) :: factor
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(self%n) :: p0, p1
      real(wp), intent(inout), dimension(self%n) :: q, v, r, x
      x = q + form%half*v
      call mean_load(self%n, loaded, p0, p1, r)
      call multiply_add(self, matrix_k, sys%k, -1.0_wp, x, r)
      if (self%damped) call multiply_add(self, matrix_c, sys%c, -1.0_wp, v, r)
      r = form%h*r
      call solve(self, factor, r)
      q = q + form%h*(v + 0.5_wp*r)
      v = v + r
   end subroutine increment

   pure subroutine reflected(self, sys, form, factor, loaded, p0, p1, q, v, r, u)
      type(linear_vector), intent(in) :: self
      class(linear_system), intent(in) :: sys
      type(newmark_form), intent(in) :: form
      type(factorization_type), intent(in) :: factor
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(self%n) :: p0, p1
      real(wp), intent(inout), dimension(self%n) :: q, v, r, u
      real(wp) :: rate
      rate = 2.0_wp/form%h
      u = v + rate*q
      call mean_load(self%n, loaded, p0, p1, r)
      r = form%half*r
      call multiply_add(self, matrix_m, sys%m, 1.0_wp, u, r)
      if (self%damped) call multiply_add(self, matrix_c, sys%c, 1.0_wp, q, r)
      r = form%h*r
      call solve(self, factor, r)
      q = r - q
      v = rate*q - u
   end subroutine reflected

   pure subroutine two_solves(self, sys, form, factor, loaded, p0, p1, q, v, r, x, w)
      type(linear_vector), intent(in) :: self
      class(linear_system), intent(in) :: sys
      type(newmark_form), intent(in) :: form
      type(factorization_type), intent(in) :: factor
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(self%n) :: p0, p1
      real(wp), intent(inout), dimension(self%n) :: q, v, r, x, w
      call mean_load(self%n, loaded, p0, p1, r)
      w = r
      call multiply_add(self, matrix_k, sys%k, -1.0_wp, q, w)
      w = form%half*w
      call multiply_add(self, matrix_m, sys%m, 1.0_wp, v, w)
      call solve(self, factor, w)
      x = q + form%half*v
      call multiply_add(self, matrix_k, sys%k, -1.0_wp, x, r)
      if (self%damped) call multiply_add(self, matrix_c, sys%c, -1.0_wp, v, r)
      r = form%h*r
      call solve(self, factor, r)
      q = q + form%h*w
      v = v + r
   end subroutine two_solves

   pure subroutine predicted(self, sys, form, factor, loaded, p1, q, v, a, r, x, w, u)
      type(linear_vector), intent(in) :: self
      class(linear_system), intent(in) :: sys
      type(newmark_form), intent(in) :: form
      type(factorization_type), intent(in) :: factor
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(self%n) :: p1
      real(wp), intent(inout), dimension(self%n) :: q, v, a, r, x, w, u
      real(wp) :: dq, dv
      integer :: i

      do i = 1, self%n
         x(i) = q(i) + (form%q_v*v(i) + form%q_a*a(i))
         w(i) = v(i) + (form%v_v*v(i) + form%v_a*a(i))
         u(i) = form%a_v*v(i) + form%a_a*a(i)
      end do
      r = 0.0_wp
      if (loaded) r = p1
      call multiply_add(self, matrix_m, sys%m, -1.0_wp, u, r)
      call multiply_add(self, matrix_k, sys%k, -1.0_wp, x, r)
      if (self%damped) call multiply_add(self, matrix_c, sys%c, -1.0_wp, w, r)
      call solve(self, factor, r)
      do i = 1, self%n
         dq = form%q_v*v(i) + form%q_a*a(i)
         dv = form%v_v*v(i) + form%v_a*a(i)
         q(i) = q(i) + (dq + form%stiffness*r(i))
         v(i) = v(i) + (dv + form%damping*r(i))
         a(i) = u(i) + r(i)
      end do
   end subroutine predicted

   !> r = mean load of the step
   pure subroutine mean_load(n, loaded, p0, p1, r)
      integer, intent(in) :: n
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p0(n), p1(n)
      real(wp), intent(out) :: r(n)
      if (loaded) then
         r = 0.5_wp*(p0 + p1)
      else
         r = 0.0_wp
      end if
   end subroutine mean_load

   !> y = y + alpha A x
   pure subroutine multiply_add(self, which, a, alpha, x, y)
      type(linear_vector), intent(in) :: self
      integer, intent(in) :: which                  !! matrix_m, matrix_c or matrix_k: the name of A
      type(matrix_type), intent(in) :: a
      real(wp), intent(in) :: alpha
      real(wp), intent(in) :: x(self%n)
      real(wp), intent(inout) :: y(self%n)
      if (self%has_chain .and. a%kind == kind_banded) then
         call self%chain%multiply_add(which, alpha, x, y)
      else
         call a%multiply_add(alpha, x, y)
      end if
   end subroutine multiply_add

   !> x = S^-1 x
   pure subroutine solve(self, factor, x)
      type(linear_vector), intent(in) :: self
      type(factorization_type), intent(in) :: factor
      real(wp), intent(inout) :: x(self%n)
      if (self%chain_solves) then
         call self%chain%solve(x)
      else
         call factor%solve(x)
      end if
   end subroutine solve
end module dynstep_linear_vector
