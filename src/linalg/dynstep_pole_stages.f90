! SPDX-License-Identifier: BSD-3-Clause
!> A rational function as stages of poles, in which a step y1 = R(z) y is made without powers of z = hA.
!>
!>   stage     y <- y + sum_j w_j Re(tau_j x_j),   (z - p_j) x_j = z y + h b_j            (w = 2 for a pair, 1 for a real pole)
!>   explicit  y <- y + z (a y + b z y)                                   zeros that no pole takes, where p > q
!>
!> The weights belong to R(z) - 1 = z sum tau_j/(z - p_j), so that what is added vanishes with h to full relative
!> accuracy; tau_j = N(p_j)/(p_j D'(p_j)).  One stage with all poles is the parallel form, a sum of partial fractions;
!> one stage for each pair is the product form.  A sum loses a factor of sum |tau|, a product the largest |tau| alone,
!> but its stages wait for each other.
!>
!> A source b(t) that is known at nodes t + c_i h comes in as b_j = sum_i omega_ij b(t + c_i h).  The weights are
!> those of the linear system y' = A y + b whose source is a polynomial, made autonomous by the derivatives of
!> Legendre polynomials: a step is exact for polynomial solutions whatever A is (strictly accurate: P. Brenner, M. Crouzeix,
!> V. Thomee, RAIRO Anal. Numer. 16 (1982) 5-26), so stiff systems keep the order.
!>
!> PROGRAMMING INTERFACE
!>
!>   call s%set(r, form, status)
!>   s%stage(k)%pole, %tau, %w, %omega;  s%nodes [m];  s%factor(k)%a, %b, ...
module dynstep_pole_stages
   use dynstep_kinds, only: wp
   use dynstep_rational, only: rational_type
   use dynstep_status, only: dynstep_invalid_input, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: most_nodes

   integer, parameter, public :: form_automatic = 0
   integer, parameter, public :: form_parallel = 1
   integer, parameter, public :: form_product = 2
   integer, parameter, public :: form_refined = 3     !! product form, each solve corrected by its residual

   !> Poles of which one stands for a pair of conjugates
   type, public :: stage_type
      integer :: count = 0                            !! poles
      integer :: first = 0                            !! place of the first one among those of all stages
      complex(wp), allocatable :: pole(:)             !! [count], Im >= 0
      complex(wp), allocatable :: tau(:)              !! weights [count]
      real(wp), allocatable :: w(:)                   !! 2 for a pair, 1 for a real pole [count]
      logical :: is_mirrored = .false.                !! one pole or pair p, and the zeros -conjg(p)
      complex(wp), allocatable :: omega(:, :)         !! of the source [nodes, count]
   end type stage_type

   !> A factor 1 + a z + b z^2 of N that has no pole beside it
   type, public :: explicit_factor_type
      real(wp) :: a = 0.0_wp, b = 0.0_wp
      real(wp), allocatable :: inner(:)               !! of the source in z y [nodes]
      real(wp), allocatable :: outer(:)               !! of the source in z (a y + b z y) [nodes]
   end type explicit_factor_type

   type, public :: pole_stages_type
      integer :: poles = 0                            !! of all stages
      logical :: is_refined = .false.                 !! form_refined
      type(stage_type), allocatable :: stage(:)
      type(explicit_factor_type), allocatable :: factor(:)   !! after the stages
      real(wp), allocatable :: nodes(:)               !! c, from 0 to 1 [max(2, order)]
      complex(wp), allocatable :: pole(:)             !! of all stages in a row [poles]
   contains
      procedure :: set => stages_set
   end type pole_stages_type

   !> The automatic form is parallel where sum w |tau| is at most this.  It is the factor by which rounding errors of
   !> what is added grow: 7 for Pade(2,2), 76 for (4,4), 14 for Taylor (4,5), 29 for the Fehlberg halves, 900 for Pade(6,6),
   !> 1.1e4 for (8,8); in product form 14 for (4,4) and 26 for (8,8).
   real(wp), parameter :: most_cancellation = 100.0_wp

   !> A zero this many times nearer to 0 than the pole is left to an explicit factor, as with alpha next to 1: together they would
   !> lose the square of this
   real(wp), parameter :: most_distance = 1.0e3_wp

   !> Zeros of N or D that stay together: a pair, or a real one
   type :: group_type
      complex(wp) :: z = (0.0_wp, 0.0_wp)             ! Im >= 0
      integer :: size = 0                             ! 2 or 1
   end type group_type

contains

   !> Nodes of the source for an order: as many as the order, with both ends of the step
   pure integer function most_nodes(order)
      integer, intent(in) :: order
      most_nodes = max(2, order)
   end function most_nodes

   !> Stages, weights and nodes of R
   pure subroutine stages_set(self, r, form, status)
      class(pole_stages_type), intent(inout) :: self
      type(rational_type), intent(in) :: r
      integer, intent(in) :: form                     !! form_automatic, form_parallel, form_product or form_refined
      type(status_type), intent(inout) :: status
      integer :: k
      if (status%failed()) return
      if (form < form_automatic .or. form > form_refined) then
         call status%set(dynstep_invalid_input, 'form = '//text(form)//' is none of automatic (0), parallel (1), product (2), ' &
            & //'refined (3)')
         return
      else if (form == form_parallel .and. r%p > r%q) then
         call status%set(dynstep_invalid_input, 'a numerator of degree '//text(r%p)//' over '//text(r%q) &
            & //' has no partial fractions: choose the product form')
         return
      end if
      self%is_refined = form == form_refined
      if (form <= form_parallel .and. r%p <= r%q) then
         call set_parallel(self, r)
         ! not <=: the weights of a double pole are not numbers
         if (form == form_automatic .and. .not. cancellation(self%stage) <= most_cancellation) call set_product(self, r)
      else
         call set_product(self, r)
      end if
      self%poles = 0
      do k = 1, size(self%stage)
         self%stage(k)%first = self%poles + 1
         self%poles = self%poles + self%stage(k)%count
      end do
      self%pole = [(self%stage(k)%pole, k=1, size(self%stage))]
      call set_source_weights(self, most_nodes(r%order))
   end subroutine stages_set

   !> One stage with all poles
   pure subroutine set_parallel(self, r)
      class(pole_stages_type), intent(inout) :: self
      type(rational_type), intent(in) :: r
      type(group_type) :: poles(r%q)
      integer :: count, j
      call group(r%poles, poles, count)
      if (allocated(self%stage)) deallocate (self%stage)
      if (allocated(self%factor)) deallocate (self%factor)
      allocate (self%factor(0))
      allocate (self%stage(merge(1, 0, count > 0)))
      if (count == 0) return
      self%stage(1) = new_stage(poles(:count))
      do j = 1, count
         self%stage(1)%tau(j) = -product(1.0_wp - poles(j)%z/r%zeros)/product_without(r%poles, poles(j)%z)
      end do
   end subroutine set_parallel

   !> Product of 1 - p/p_i over the other poles
   pure complex(wp) function product_without(all_poles, p)
      complex(wp), intent(in) :: all_poles(:), p
      integer :: i
      logical :: is_left_out
      product_without = (1.0_wp, 0.0_wp)
      is_left_out = .false.
      do i = 1, size(all_poles)
         if (.not. is_left_out .and. .not. abs(all_poles(i) - p) > 0.0_wp) then
            is_left_out = .true.
         else
            product_without = product_without*(1.0_wp - p/all_poles(i))
         end if
      end do
   end function product_without

   !> A stage for each pair of poles and each real one, with the zeros that lie best to it: those next to the mirror
   !> image of the pole, which makes the factors of symmetric members of modulus 1 on the imaginary axis
   pure subroutine set_product(self, r)
      class(pole_stages_type), intent(inout) :: self
      type(rational_type), intent(in) :: r
      type(group_type) :: poles(r%q), zeros(r%p)
      logical :: is_taken(r%p)
      complex(wp) :: ratio
      integer :: count, zero_count, i, j, room
      call group(r%poles, poles, count)
      call group(r%zeros, zeros, zero_count)
      is_taken = .false.
      if (allocated(self%stage)) deallocate (self%stage)
      if (allocated(self%factor)) deallocate (self%factor)
      allocate (self%stage(count))
      do j = 1, count
         self%stage(j) = new_stage(poles(j:j))
         room = poles(j)%size
         self%stage(j)%is_mirrored = .false.
         ratio = (1.0_wp, 0.0_wp)
         do
            i = best_zero(zeros(:zero_count), is_taken, -conjg(poles(j)%z), room)
            if (i == 0) exit
            is_taken(i) = .true.
            if (zeros(i)%size == poles(j)%size) self%stage(j)%is_mirrored = .not. abs(zeros(i)%z + conjg(poles(j)%z)) > 0.0_wp
            room = room - zeros(i)%size
            ratio = ratio*(1.0_wp - poles(j)%z/zeros(i)%z)
            if (zeros(i)%size == 2) ratio = ratio*(1.0_wp - poles(j)%z/conjg(zeros(i)%z))
         end do
         if (poles(j)%size == 2) ratio = ratio/(1.0_wp - poles(j)%z/conjg(poles(j)%z))
         self%stage(j)%tau(1) = -ratio
      end do
      allocate (self%factor(zero_count - count_true(is_taken(:zero_count))))
      j = 0
      do i = 1, zero_count
         if (is_taken(i)) cycle
         j = j + 1
         self%factor(j)%a = -real(zeros(i)%size, wp)*real(1.0_wp/zeros(i)%z, wp)
         if (zeros(i)%size == 2) self%factor(j)%b = 1.0_wp/abs(zeros(i)%z)**2
      end do
   end subroutine set_product

   pure integer function count_true(x)
      logical, intent(in) :: x(:)
      count_true = count(x)
   end function count_true

   !> The free zero next to a point, of at most `room` zeros; a pair before single ones.  0: none
   pure integer function best_zero(zeros, is_taken, point, room)
      type(group_type), intent(in) :: zeros(:)
      logical, intent(in) :: is_taken(:)
      complex(wp), intent(in) :: point
      integer, intent(in) :: room
      integer :: i, wanted
      best_zero = 0
      do wanted = room, 1, -1
         do i = 1, size(zeros)
            if (is_taken(i) .or. zeros(i)%size /= wanted) cycle
            if (abs(point) > most_distance*abs(zeros(i)%z)) cycle
            if (best_zero == 0) then
               best_zero = i
            else if (abs(zeros(i)%z - point) < abs(zeros(best_zero)%z - point)) then
               best_zero = i
            end if
         end do
         if (best_zero > 0) return
      end do
   end function best_zero

   pure function new_stage(poles) result(stage)
      type(group_type), intent(in) :: poles(:)
      type(stage_type) :: stage
      stage%count = size(poles)
      allocate (stage%pole(size(poles)), stage%tau(size(poles)), stage%w(size(poles)))
      stage%pole = poles%z
      stage%w = real(poles%size, wp)
      stage%tau = (0.0_wp, 0.0_wp)
   end function new_stage

   !> Pairs and real ones of a list in which conjugates stand together; pairs first
   pure subroutine group(points, groups, count)
      complex(wp), intent(in) :: points(:)
      type(group_type), intent(out) :: groups(:)
      integer, intent(out) :: count
      integer :: i
      count = 0
      do i = 1, size(points)
         if (.not. aimag(points(i)) > 0.0_wp) cycle
         count = count + 1
         groups(count) = group_type(points(i), 2)
      end do
      do i = 1, size(points)
         if (abs(aimag(points(i))) > 0.0_wp) cycle
         count = count + 1
         groups(count) = group_type(points(i), 1)
      end do
   end subroutine group

   pure real(wp) function cancellation(stages)
      type(stage_type), intent(in) :: stages(:)
      integer :: k
      cancellation = 0.0_wp
      do k = 1, size(stages)
         cancellation = max(cancellation, sum(stages(k)%w*abs(stages(k)%tau)))
      end do
   end function cancellation

   !> omega of all stages and factors: the Legendre polynomials of the source run through the stages as the state
   !> does.  u = w - x with (J - p) x = J w, where dL/ds = J L, is what the source of one pole sees.
   pure subroutine set_source_weights(self, count)
      class(pole_stages_type), intent(inout) :: self
      integer, intent(in) :: count                    !! nodes
      real(wp) :: w(count), jw(count), to_legendre(count, count)
      complex(wp) :: u(count), x(count)
      real(wp) :: added(count)
      integer :: i, j, k
      real(wp), parameter :: pi = acos(-1.0_wp)
      if (allocated(self%nodes)) deallocate (self%nodes)
      ! Chebyshev's extremal points
      self%nodes = [(sin(0.5_wp*pi*real(i, wp)/real(count - 1, wp))**2, i=0, count - 1)]
      self%nodes(count) = 1.0_wp
      call legendre_transform(self%nodes, to_legendre)
      w = [((-1.0_wp)**i, i=0, count - 1)]
      do k = 1, size(self%stage)
         associate (stage => self%stage(k))
            if (allocated(stage%omega)) deallocate (stage%omega)
            allocate (stage%omega(count, stage%count))
            added = 0.0_wp
            do j = 1, stage%count
               call resolvent(stage%pole(j), w, u)
               x = w - u
               stage%omega(:, j) = matmul(u, to_legendre)
               added = added + stage%w(j)*real(stage%tau(j)*x, wp)
            end do
            w = w + added
         end associate
      end do
      do k = 1, size(self%factor)
         associate (f => self%factor(k))
            f%inner = matmul(w, to_legendre)
            jw = derivative(w)
            added = f%a*w + f%b*jw
            f%outer = matmul(added, to_legendre)
            w = w + derivative(added)
         end associate
      end do
   end subroutine set_source_weights

   !> u = w + J u/p, by rows: J has entries before the diagonal alone
   pure subroutine resolvent(p, w, u)
      complex(wp), intent(in) :: p
      real(wp), intent(in) :: w(0:)
      complex(wp), intent(out) :: u(0:)
      integer :: j, k
      do k = 0, size(w) - 1
         u(k) = (0.0_wp, 0.0_wp)
         do j = k - 1, 0, -2
            u(k) = u(k) + real(2*(2*j + 1), wp)*u(j)
         end do
         u(k) = w(k) + u(k)/p
      end do
   end subroutine resolvent

   !> J w: L_k' = sum of 2 (2 j + 1) L_j over j = k - 1, k - 3, ..., for Legendre polynomials of [0, 1]
   pure function derivative(w) result(jw)
      real(wp), intent(in) :: w(0:)
      real(wp) :: jw(0:size(w) - 1)
      integer :: j, k
      do k = 0, size(w) - 1
         jw(k) = 0.0_wp
         do j = k - 1, 0, -2
            jw(k) = jw(k) + real(2*(2*j + 1), wp)*w(j)
         end do
      end do
   end function derivative

   !> Coefficients of Legendre polynomials from values at the nodes, c = T b: the inverse of the matrix of values, by
   !> Gauss and Jordan with interchanges (at most 16 x 16, of condition below 30)
   pure subroutine legendre_transform(nodes, t)
      real(wp), intent(in) :: nodes(:)
      real(wp), intent(out) :: t(:, :)
      real(wp) :: v(size(nodes), size(nodes)), row(size(nodes)), s, pivot
      integer :: i, k, m, best
      m = size(nodes)
      t = 0.0_wp
      do i = 1, m
         t(i, i) = 1.0_wp
         s = 2.0_wp*nodes(i) - 1.0_wp
         v(i, 1) = 1.0_wp
         if (m > 1) v(i, 2) = s
         do k = 3, m
            v(i, k) = (real(2*k - 3, wp)*s*v(i, k - 1) - real(k - 2, wp)*v(i, k - 2))/real(k - 1, wp)
         end do
      end do
      do k = 1, m
         best = k - 1 + maxloc(abs(v(k:, k)), 1)
         row = v(k, :); v(k, :) = v(best, :); v(best, :) = row
         row = t(k, :); t(k, :) = t(best, :); t(best, :) = row
         pivot = v(k, k)
         v(k, :) = v(k, :)/pivot
         t(k, :) = t(k, :)/pivot
         do i = 1, m
            if (i == k) cycle
            s = v(i, k)
            v(i, :) = v(i, :) - s*v(k, :)
            t(i, :) = t(i, :) - s*t(k, :)
         end do
      end do
   end subroutine legendre_transform
end module dynstep_pole_stages
