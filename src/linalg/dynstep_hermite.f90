! SPDX-License-Identifier: BSD-3-Clause
!> Hermite interpolation of a vector and its derivative at several points of one interval, by divided differences with
!> double nodes (J. Stoer, R. Bulirsch, Introduction to Numerical Analysis, section 2.1.5).
!>
!>   y(s) = y_1 + s h f_1 + sum of c_j w_j(s),  j = 3 .. 2 nodes,  w_j = product of (s - z_i), i < j,
!>   z = (0, 0, s_2, s_2, s_3, s_3, ...),  t = t_1 + s h
!>
!> The c_j are differences of what the tangent at the left end misses, so that a motion that is nearly straight
!> keeps the accuracy of its increments.  The error is h^(2 nodes) in y and h^(2 nodes - 1) in y'.
!>
!> PROGRAMMING INTERFACE
!>
!>     call hermite%reserve(size_y, size_a, most_nodes, status)     allocates
!>     call hermite%begin(nodes, h)
!>     call hermite%put(k, s, y, a)            node k = 1 .. nodes, s = 0 of the first one
!>     call hermite%tabulate()                 the c_j
!>     call hermite%value(s, y)                many times
!>     call hermite%derivative(s, a)
!>
!>   A state of mechanics is y = [q; v] with a = q'': its derivative is [v; a].
module dynstep_hermite
   use dynstep_kinds, only: wp
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_text, only: text
   implicit none
   private

   type, public :: hermite_type
      integer, private :: nodes = 0
      integer, private :: size_y = 0, size_a = 0
      real(wp), private :: h = 0.0_wp
      real(wp), allocatable, private :: s(:)           ! nodes [most_nodes]
      real(wp), allocatable, private :: c(:, :)        ! c_j [size_y, 2 most_nodes]; y_k and f_k before `tabulate`
      real(wp), allocatable, private :: tangent(:, :)  ! y_1 and h f_1 [size_y, 2]
      real(wp), allocatable, private :: w(:, :)        ! w_j and w_j' [2 most_nodes, 2]
   contains
      procedure :: reserve => hermite_reserve
      procedure :: begin => hermite_begin
      procedure :: put => hermite_put
      procedure :: tabulate => hermite_tabulate
      procedure :: value => hermite_value
      procedure :: derivative => hermite_derivative
   end type hermite_type

contains

   !> Room for so many nodes
   pure subroutine hermite_reserve(self, size_y, size_a, most_nodes, status)
      class(hermite_type), intent(inout) :: self
      integer, intent(in) :: size_y              !! of y
      integer, intent(in) :: size_a              !! of a: size_y, or half of it where y = [q; v] and a = q''
      integer, intent(in) :: most_nodes          !! 2 or more
      type(status_type), intent(inout) :: status
      integer :: stat
      if (status%failed()) return
      if (allocated(self%c)) deallocate (self%s, self%c, self%tangent, self%w)
      self%size_y = size_y
      self%size_a = size_a
      self%nodes = 0
      allocate (self%s(most_nodes), self%c(size_y, 2*most_nodes), self%tangent(size_y, 2), self%w(2*most_nodes, 2), stat=stat)
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for the interpolation of '//text(size_y) &
         & //' numbers through '//text(most_nodes)//' points')
   end subroutine hermite_reserve

   !> An interval of length h with so many nodes, which `put` gives
   pure subroutine hermite_begin(self, nodes, h)
      class(hermite_type), intent(inout) :: self
      integer, intent(in) :: nodes               !! 2 .. most_nodes
      real(wp), intent(in) :: h                  !! of either sign
      self%nodes = nodes
      self%h = h
   end subroutine hermite_begin

   !> Node k
   pure subroutine hermite_put(self, k, s, y, a)
      class(hermite_type), intent(inout) :: self
      integer, intent(in) :: k                   !! 1 .. nodes
      real(wp), intent(in) :: s                  !! its place (t - t_1)/h; 0 for k = 1, no two alike
      real(wp), intent(in) :: y(:)               !! [size_y]
      real(wp), intent(in) :: a(:)               !! [size_a]
      integer :: i, tail
      tail = self%size_y - self%size_a
      self%s(k) = s
      do i = 1, self%size_y
         self%c(i, 2*k - 1) = y(i)
      end do
      do i = 1, tail
         self%c(i, 2*k) = y(self%size_a + i)
      end do
      do i = 1, self%size_a
         self%c(tail + i, 2*k) = a(i)
      end do
   end subroutine hermite_put

   !> Divided differences of what the tangent misses, in place
   pure subroutine hermite_tabulate(self)
      class(hermite_type), intent(inout) :: self
      integer :: i, j, k
      do i = 1, self%size_y
         self%tangent(i, 1) = self%c(i, 1)
         self%tangent(i, 2) = self%h*self%c(i, 2)
         self%c(i, 1:2) = 0.0_wp
      end do
      do k = 2, self%nodes
         do i = 1, self%size_y
            self%c(i, 2*k - 1) = (self%c(i, 2*k - 1) - self%tangent(i, 1)) - self%s(k)*self%tangent(i, 2)
            self%c(i, 2*k) = self%h*self%c(i, 2*k) - self%tangent(i, 2)
         end do
      end do
      ! of first order; those of a double node are the derivatives, which are there
      do k = self%nodes, 2, -1
         do i = 1, self%size_y
            self%c(i, 2*k - 1) = (self%c(i, 2*k - 1) - self%c(i, 2*k - 3))/(self%s(k) - self%s(k - 1))
         end do
      end do
      do j = 2, 2*self%nodes - 1
         do k = 2*self%nodes, j + 1, -1
            do i = 1, self%size_y
               self%c(i, k) = (self%c(i, k) - self%c(i, k - 1))/(self%s((k + 1)/2) - self%s((k - j + 1)/2))
            end do
         end do
      end do
   end subroutine hermite_tabulate

   !> y at s
   pure subroutine hermite_value(self, s, y)
      class(hermite_type), intent(inout) :: self
      real(wp), intent(in) :: s                  !! 0 .. 1 inside the interval
      real(wp), intent(out) :: y(:)              !! [size_y]
      integer :: i, j
      call products(self, s)
      y = 0.0_wp
      do j = 2*self%nodes, 3, -1
         do i = 1, self%size_y
            y(i) = y(i) + self%w(j, 1)*self%c(i, j)
         end do
      end do
      do i = 1, self%size_y
         y(i) = self%tangent(i, 1) + (s*self%tangent(i, 2) + y(i))
      end do
   end subroutine hermite_value

   !> The last size_a components of y' at s
   pure subroutine hermite_derivative(self, s, a)
      class(hermite_type), intent(inout) :: self
      real(wp), intent(in) :: s
      real(wp), intent(out) :: a(:)              !! [size_a]
      integer :: i, j, tail
      call products(self, s)
      tail = self%size_y - self%size_a
      a = 0.0_wp
      do j = 2*self%nodes, 3, -1
         do i = 1, self%size_a
            a(i) = a(i) + self%w(j, 2)*self%c(tail + i, j)
         end do
      end do
      do i = 1, self%size_a
         a(i) = (self%tangent(tail + i, 2) + a(i))/self%h
      end do
   end subroutine hermite_derivative

   !> w_j and w_j'
   pure subroutine products(self, s)
      class(hermite_type), intent(inout) :: self
      real(wp), intent(in) :: s
      real(wp) :: d
      integer :: j
      self%w(1, :) = [1.0_wp, 0.0_wp]
      do j = 2, 2*self%nodes
         d = s - self%s(j/2)
         self%w(j, 2) = self%w(j - 1, 2)*d + self%w(j - 1, 1)
         self%w(j, 1) = self%w(j - 1, 1)*d
      end do
   end subroutine products
end module dynstep_hermite
