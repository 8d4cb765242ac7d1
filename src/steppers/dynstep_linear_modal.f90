! SPDX-License-Identifier: BSD-3-Clause
!> Newmark steps of systems in modal coordinates: M, C and K diagonal.
!>
!> Each mode has the form of dynstep_newmark_form that suits its own frequency.  Neighbours
!> of the same form are one segment, and a segment is one loop of vector instructions.
module dynstep_linear_modal
   use dynstep_kinds, only: wp
   use dynstep_linear_system, only: linear_system
   use dynstep_matrix, only: kind_diagonal
   use dynstep_newmark_form, only: choose_form, form_increment, form_predicted, form_reflected, &
      & form_two_solves, newmark_form
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: is_modal

   type, public :: linear_modal
      integer :: n = 0
      real(wp), allocatable, private :: m(:), c(:), k(:)        ! [n]
      real(wp), allocatable, private :: s(:)                    ! 1/(m + gamma h c + beta h^2 k) [n]
      integer :: segments = 0
      integer, allocatable, private :: last(:)                  ! last mode of each segment [n]
      integer, allocatable, private :: kind(:)                  ! its place in `forms` [n]
      type(newmark_form), private :: forms(form_predicted + 2)  ! three predictors
   contains
      procedure :: init => modal_init
      procedure :: read_matrices => modal_read_matrices
      procedure :: prepare => modal_prepare
      procedure :: step => modal_step
   end type linear_modal

contains

   !> True where these kernels serve
   pure logical function is_modal(sys)
      class(linear_system), intent(in) :: sys
      is_modal = sys%n > 1 .and. max(sys%m%kind, sys%c%kind, sys%k%kind) <= kind_diagonal
   end function is_modal

   recursive subroutine modal_init(self, n, status)
      class(linear_modal), intent(inout) :: self
      integer, intent(in) :: n
      type(status_type), intent(inout) :: status
      integer :: stat

      if (status%failed()) return
      if (allocated(self%m)) deallocate (self%m, self%c, self%k, self%s, self%last, self%kind)
      allocate (self%m(n), self%c(n), self%k(n), self%s(n), self%last(n), self%kind(n), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory to step '//text(n)//' coordinates')
      self%n = n
   end subroutine modal_init

   pure subroutine modal_read_matrices(self, sys)
      class(linear_modal), intent(inout) :: self
      class(linear_system), intent(in) :: sys
      integer :: i
      do i = 1, self%n
         self%m(i) = sys%m%entry(i, i)
         self%c(i) = sys%c%entry(i, i)
         self%k(i) = sys%k%entry(i, i)
      end do
   end subroutine modal_read_matrices

   !> Forms of the modes for a step length
   pure subroutine modal_prepare(self, beta, gamma, h, trapezoidal)
      class(linear_modal), intent(inout) :: self
      real(wp), intent(in) :: beta, gamma, h
      logical, intent(in) :: trapezoidal
      type(newmark_form) :: form
      real(wp) :: omega, damping
      integer :: i, kind

      self%segments = 0
      do i = 1, self%n
         omega = sqrt(abs(self%k(i)/self%m(i)))
         damping = self%c(i)/self%m(i)
         call choose_form(form, beta, gamma, h, trapezoidal, omega, omega, damping, abs(damping))
         kind = form%form + form%predictor
         self%forms(kind) = form
         self%s(i) = 1.0_wp/((self%m(i) + form%damping*self%c(i)) + form%stiffness*self%k(i))
         if (i > 1) then
            if (kind == self%kind(self%segments)) self%segments = self%segments - 1
         end if
         self%segments = self%segments + 1
         self%kind(self%segments) = kind
         self%last(self%segments) = i
      end do
   end subroutine modal_prepare

   !> One step
   pure subroutine modal_step(self, loaded, p0, p1, q, v, a)
      class(linear_modal), intent(in) :: self
      logical, intent(in) :: loaded
      real(wp), intent(in) :: p0(self%n), p1(self%n)     !! loads, read where `loaded`
      real(wp), intent(inout) :: q(self%n), v(self%n)
      real(wp), intent(inout) :: a(self%n)               !! read and written by form_predicted only
      integer :: i, first, last

      first = 1
      do i = 1, self%segments
         last = self%last(i)
         associate (form => self%forms(self%kind(i)), m => self%m(first:last), c => self%c(first:last), &
            & k => self%k(first:last), s => self%s(first:last))
            select case (form%form)
            case (form_increment)
               call increment(last - first + 1, form, loaded, p0(first), p1(first), c, k, s, q(first), v(first))
            case (form_reflected)
               call reflected(last - first + 1, form, loaded, p0(first), p1(first), m, c, s, q(first), v(first))
            case (form_two_solves)
               call two_solves(last - first + 1, form, loaded, p0(first), p1(first), m, c, k, s, q(first), v(first))
            case (form_predicted)
               call predicted(last - first + 1, form, loaded, p1(first), m, c, k, s, q(first), v(first), a(first))
            end select
         end associate
         first = last + 1
      end do
   end subroutine modal_step

   pure subroutine increment(n, form, loaded, p0, p1, c, k, s, q, v)
      integer, intent(in) :: n
      type(newmark_form), intent(in) :: form
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(n) :: p0, p1, c, k, s
      real(wp), intent(inout), dimension(n) :: q, v
      real(wp) :: x
      integer :: i
      do i = 1, n
         x = c(i)*v(i) + k(i)*(q(i) + form%half*v(i))
         if (loaded) x = x - 0.5_wp*(p0(i) + p1(i))
         x = -form%h*(s(i)*x)
         q(i) = q(i) + form%h*(v(i) + 0.5_wp*x)
         v(i) = v(i) + x
      end do
   end subroutine increment

   pure subroutine reflected(n, form, loaded, p0, p1, m, c, s, q, v)
      integer, intent(in) :: n
      type(newmark_form), intent(in) :: form
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(n) :: p0, p1, m, c, s
      real(wp), intent(inout), dimension(n) :: q, v
      real(wp) :: rate, u, x
      integer :: i
      rate = 2.0_wp/form%h
      do i = 1, n
         u = v(i) + rate*q(i)
         x = m(i)*u + c(i)*q(i)
         if (loaded) x = x + form%half*(0.5_wp*(p0(i) + p1(i)))
         q(i) = form%h*(s(i)*x) - q(i)
         v(i) = rate*q(i) - u
      end do
   end subroutine reflected

   pure subroutine two_solves(n, form, loaded, p0, p1, m, c, k, s, q, v)
      integer, intent(in) :: n
      type(newmark_form), intent(in) :: form
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(n) :: p0, p1, m, c, k, s
      real(wp), intent(inout), dimension(n) :: q, v
      real(wp) :: load, w, x
      integer :: i
      load = 0.0_wp
      do i = 1, n
         if (loaded) load = 0.5_wp*(p0(i) + p1(i))
         w = s(i)*(m(i)*v(i) + form%half*(load - k(i)*q(i)))
         x = form%h*(s(i)*((load - c(i)*v(i)) - k(i)*(q(i) + form%half*v(i))))
         q(i) = q(i) + form%h*w
         v(i) = v(i) + x
      end do
   end subroutine two_solves

   pure subroutine predicted(n, form, loaded, p1, m, c, k, s, q, v, a)
      integer, intent(in) :: n
      type(newmark_form), intent(in) :: form
      logical, intent(in) :: loaded
      real(wp), intent(in), dimension(n) :: p1, m, c, k, s
      real(wp), intent(inout), dimension(n) :: q, v, a
      real(wp) :: dq, dv, x
      integer :: i
      do i = 1, n
         dq = form%q_v*v(i) + form%q_a*a(i)
         dv = form%v_v*v(i) + form%v_a*a(i)
         a(i) = form%a_v*v(i) + form%a_a*a(i)
         x = -(m(i)*a(i) + (c(i)*(v(i) + dv) + k(i)*(q(i) + dq)))
         if (loaded) x = x + p1(i)
         x = s(i)*x
         q(i) = q(i) + (dq + form%stiffness*x)
         v(i) = v(i) + (dv + form%damping*x)
         a(i) = a(i) + x
      end do
   end subroutine predicted
end module dynstep_linear_modal
