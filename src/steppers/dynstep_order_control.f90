! SPDX-License-Identifier: BSD-3-Clause
!> Choice of order and step length of an extrapolation (P. Deuflhard, Numer. Math. 41 (1983) 399 and SIAM Review 27
!> (1985) 505; E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.9).
!>
!> Column k of the table has the error e(k) = |T(k,k) - T(k,k-1)|, in the norm of the run, and the work A(k) of rows 1
!> to k.  With the order p(k) = r + 2(k - 1) of the column, r that of the base,
!>
!>   e(k) = O(h^(p(k) - 1)),     h(k) = h safety (within/e(k))^(1/(p(k) - 1)),     W(k) = A(k)/h(k)
!>
!> The columns k-1, k, k+1 about a target k are looked at, and the first good one, e <= 1, ends the trial.  It ends too
!> where the columns that are left are not likely to be good:
!>
!>   e(k-1) > (n(k+1) n(k)/n(1)^2)^2,     e(k) > (n(k+1)/n(1))^2,     e(k+1) > 1
!>
!> The next target is the neighbour whose work per unit of time W is least.
!>
!> PROGRAMMING INTERFACE
!>
!>     call control%prepare(numbers, weights, base_order, norm)      data, and the first guess of the target
!>     call control%begin()                                          a new run: forget what was chosen
!>     call control%open_trial(t, h, rounding, status)               columns first to last are to be looked at
!>     do k = 1, control%last:  control%work(k) = ...;  control%error(k) = ...
!>        if (control%is_good(k)) or (control%is_hopeless(k)) leave
!>     call control%close_trial(k, h_next, status)                   the target and the length of the next trial
!>
!>   Trials may follow each other from one state.  One that is shorter than what was proposed (the end of the run, an
!>   event, a limit) looks at all columns from the second one on and, where it is good, leaves the proposal as it was.
module dynstep_order_control
   use dynstep_archive, only: archive_type
   use dynstep_error_norm, only: error_norm_type, norm_largest
   use dynstep_kinds, only: wp
   use dynstep_sequences, only: most_levels
   use dynstep_status, only: dynstep_tolerance_too_small, status_type
   use dynstep_text, only: text
   implicit none
   private

   public :: tolerance_of

   !> Measured on Pleiades and Kepler's problem: with 0.65 and 0.94, the usual pair, 10 to 20 % of the trials are
   !> rejected; 0.8 in place of 0.94 avoids half of them and saves 5 to 20 % of the forces
   real(wp), parameter :: safety = 0.8_wp, within = 0.65_wp

   !> The order is changed only where it pays: down for 20 %, up for 10 % less work per unit of time
   real(wp), parameter :: lower_below = 0.8_wp, raise_below = 0.9_wp

   !> h(k)/h is between shrink^(1/(p-1))/growth and growth/shrink^(1/(p-1))
   real(wp), parameter :: shrink = 0.02_wp, growth = 4.0_wp

   !> A trial is a shortened one below this part of the length that was proposed
   real(wp), parameter :: shortened_below = 0.9_wp

   !> Share of the tolerance that the rounding errors of a result may have by their estimate, which limits the number of
   !> levels.  A tolerance is out of reach where those of a result of `fewest` levels are more than `reach`.  Measured on
   !> Kepler's problem (e = 0.9): rtol = atol = 3e-14 takes 178 steps, 1e-14 1800, 3e-15 42000; the limit is 1.5e-14.
   real(wp), parameter :: rounding_share = 0.3_wp, reach = 0.03_wp
   integer, parameter :: fewest = 4

   !> A column that does not improve on the one before it, at less than this multiple of its rounding errors, is noise.  Larger
   !> ones that do not fall are those of a stiff system, which a shorter step mends; what the iterations leave is less than 1
   real(wp), parameter :: noise_below = 100.0_wp

   type, public :: order_control
      integer :: most = 0                       !! levels that may be used
      integer :: target = 0                     !! k, where the next trial is expected to be good
      integer :: first = 0, last = 0            !! columns that the present trial looks at
      real(wp) :: error(most_levels) = 0.0_wp   !! e(k) of the present trial
      real(wp) :: work(most_levels) = 0.0_wp    !! of row k of the present trial, > 0
      integer, private :: numbers(most_levels) = 0
      integer, private :: base_order = 2
      integer, private :: guess = 2             ! first target
      real(wp), private :: noise(most_levels) = 0.0_wp   ! rounding errors of T(k,k) beside those of the state
      real(wp), private :: tolerance = 0.0_wp   ! what it is guessed from
      real(wp), private :: t = 0.0_wp, h = 0.0_wp, rounding = 0.0_wp    ! of the present trial
      real(wp), private :: proposed = 0.0_wp    ! |h| that belongs to the target; 0: none
      logical, private :: is_short = .false.    ! the present trial is shorter than that
      logical, private :: was_rejected = .false.
      real(wp), private :: stuck_error = 0.0_wp, stuck_h = 0.0_wp       ! of a rejected trial that ended in noise
   contains
      procedure :: prepare => control_prepare
      procedure :: begin => control_begin
      procedure :: open_trial => control_open
      procedure :: is_good => control_is_good
      procedure :: is_hopeless => control_is_hopeless
      procedure :: close_trial => control_close
      procedure :: give_up => control_give_up
      procedure :: order_of => control_order_of
      procedure :: archive => control_archive
   end type order_control

contains

   !> Tables of a sequence, and a target from the tolerance: 3 for 1e-3, 5 for 1e-6, 6 for 1e-9, 8 for 1e-12
   pure subroutine control_prepare(self, numbers, weights, base_order, norm)
      class(order_control), intent(inout) :: self
      integer, intent(in) :: numbers(:)                  !! substeps of the rows [most]
      real(wp), intent(in) :: weights(:, :)              !! weights(:k, k) of T(k,k) [most, most]
      integer, intent(in) :: base_order
      type(error_norm_type), intent(in) :: norm
      integer :: k
      self%most = size(numbers)
      self%numbers(:self%most) = numbers
      self%base_order = base_order
      do k = 1, self%most
         ! a row of n substeps rounds the state n times, as a random walk
         self%noise(k) = sqrt(sum(weights(:k, k)**2*real(numbers(:k), wp)))
      end do
      self%tolerance = tolerance_of(norm)
      self%guess = min(max(2, int(1.5_wp - 0.6_wp*log10(max(self%tolerance, epsilon(1.0_wp))))), max(2, self%most))
      call self%begin()
   end subroutine control_prepare

   !> The relative tolerance, or the absolute one where there is no other
   pure real(wp) function tolerance_of(norm)
      type(error_norm_type), intent(in) :: norm
      tolerance_of = norm%tolerance
      if (norm%kind == norm_largest) return
      tolerance_of = norm%rtol
      if (.not. norm%rtol > 0.0_wp) tolerance_of = maxval(norm%atol)
   end function tolerance_of

   pure subroutine control_begin(self)
      class(order_control), intent(inout) :: self
      self%target = self%guess
      self%proposed = 0.0_wp
      self%was_rejected = .false.
      self%stuck_h = 0.0_wp
   end subroutine control_begin

   !> p(k)
   pure integer function control_order_of(self, k) result(order)
      class(order_control), intent(in) :: self
      integer, intent(in) :: k
      order = self%base_order + 2*(k - 1)
   end function control_order_of

   !> Columns of a trial of length h from time t.  Fails where the rounding errors of so few levels as `fewest` are more
   !> than the tolerance allows.
   pure subroutine control_open(self, t, h, rounding, status)
      class(order_control), intent(inout) :: self
      real(wp), intent(in) :: t, h
      real(wp), intent(in) :: rounding                   !! norm%rounding(y)
      type(status_type), intent(inout) :: status
      integer :: cap
      if (status%failed()) return
      if (abs(t - self%t) > 0.0_wp) self%stuck_h = 0.0_wp
      self%t = t
      self%h = abs(h)
      self%rounding = rounding
      if (self%noise(min(fewest, self%most))*rounding > reach) then
         call unattainable(self, self%noise(min(fewest, self%most))*rounding/reach, status)
         return
      end if
      do cap = self%most, 3, -1
         if (self%noise(cap)*rounding <= rounding_share) exit
      end do
      self%target = min(self%target, cap)
      self%last = min(self%target + 1, cap)
      self%is_short = self%h < shortened_below*self%proposed .or. .not. self%proposed > 0.0_wp
      self%first = merge(2, max(2, self%target - 1), self%is_short)
      self%error = 0.0_wp
      self%work = 0.0_wp
   end subroutine control_open

   pure subroutine unattainable(self, ratio, status)
      class(order_control), intent(in) :: self
      real(wp), intent(in) :: ratio                      !! by what the tolerance is too small
      type(status_type), intent(inout) :: status
      call status%set(dynstep_tolerance_too_small, 'the tolerance '//text(self%tolerance)//' cannot be met at t = '//text(self%t) &
         & //': rounding errors leave '//text(ratio*self%tolerance)//' within reach of an extrapolation; give that or more')
   end subroutine unattainable

   pure logical function control_is_good(self, k)
      class(order_control), intent(in) :: self
      integer, intent(in) :: k
      control_is_good = k >= self%first .and. self%error(k) <= 1.0_wp
   end function control_is_good

   !> The columns after k are not likely to be good, or k is the last one.  A table whose errors grow by four from
   !> column to column does not converge.
   pure logical function control_is_hopeless(self, k) result(is_hopeless)
      class(order_control), intent(in) :: self
      integer, intent(in) :: k
      integer :: j
      real(wp) :: gain
      is_hopeless = k >= self%last
      if (is_hopeless .or. k < 2) return
      if (k >= 3) is_hopeless = self%error(k) > max(4.0_wp*self%error(k - 1), 1.0_wp)
      if (is_hopeless .or. k < self%target - 1) return
      gain = 1.0_wp
      do j = k + 1, self%last
         gain = gain*real(self%numbers(j), wp)/real(self%numbers(1), wp)
      end do
      is_hopeless = self%error(k) > gain**2
   end function control_is_hopeless

   !> The trial ended at column k; h_next > 0
   pure subroutine control_close(self, k, h_next, status)
      class(order_control), intent(inout) :: self
      integer, intent(in) :: k
      real(wp), intent(out) :: h_next
      type(status_type), intent(inout) :: status
      real(wp) :: length(most_levels), total(most_levels), w(most_levels)
      integer :: j
      length = 0.0_wp
      total = 0.0_wp
      w = huge(1.0_wp)
      do j = 1, k
         total(j) = sum(self%work(:j))
         if (j == 1) cycle
         length(j) = self%h*factor(self, j)
         w(j) = total(j)/length(j)
      end do
      if (self%error(k) <= 1.0_wp) then
         call after_good(self, k, length, total, w, h_next)
      else
         call after_bad(self, k, length, w, h_next)
         call watch_noise(self, k, status)
      end if
   end subroutine control_close

   !> h(k)/h
   pure real(wp) function factor(self, k)
      class(order_control), intent(in) :: self
      integer, intent(in) :: k
      real(wp) :: exponent, least
      exponent = 1.0_wp/real(self%order_of(k) - 1, wp)
      least = shrink**exponent
      factor = growth/least
      if (self%error(k) > tiny(1.0_wp)) factor = min(factor, safety*(within/self%error(k))**exponent)
      factor = max(factor, least/growth)
   end function factor

   pure subroutine after_good(self, k, length, total, w, h_next)
      class(order_control), intent(inout) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: length(:), total(:), w(:)
      real(wp), intent(out) :: h_next
      integer :: best
      self%stuck_h = 0.0_wp
      if (self%is_short .and. self%proposed > 0.0_wp) then
         h_next = self%proposed
         return
      end if
      if (k <= self%target) then
         best = k
         if (k > 2) then
            if (w(k - 1) < lower_below*w(k)) best = k - 1
            if (w(k) < raise_below*w(k - 1)) best = k + 1
         else
            best = k + 1
         end if
      else
         best = k - 1
         if (k > 3) then
            if (w(k - 2) < lower_below*w(k - 1)) best = k - 2
         end if
         if (w(k) < raise_below*w(best)) best = k
      end if
      best = max(2, min(best, self%most))
      if (self%was_rejected) then
         best = min(best, k)
         h_next = min(length(best), self%h)
      else if (best <= k) then
         h_next = length(best)
      else
         h_next = length(k)*((total(k) + next_row(self, k))/total(k))
      end if
      self%was_rejected = .false.
      self%target = best
      self%proposed = h_next
   end subroutine after_good

   !> Work of row k + 1, which was not made
   pure real(wp) function next_row(self, k)
      class(order_control), intent(in) :: self
      integer, intent(in) :: k
      next_row = self%work(k)*real(self%numbers(min(k + 1, self%most)), wp)/real(self%numbers(k), wp)
   end function next_row

   pure subroutine after_bad(self, k, length, w, h_next)
      class(order_control), intent(inout) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: length(:), w(:)
      real(wp), intent(out) :: h_next
      integer :: best
      best = max(2, min(self%target, k))
      if (best > 2) then
         if (w(best - 1) < lower_below*w(best)) best = best - 1
      end if
      ! columns whose errors grow tell nothing of the length
      h_next = min(length(best), 0.9_wp*self%h)
      if (k >= 3) then
         if (self%error(k) > max(4.0_wp*self%error(k - 1), 1.0_wp)) h_next = min(h_next, 0.5_wp*self%h)
      end if
      self%was_rejected = .true.
      self%target = best
      self%proposed = h_next
   end subroutine after_bad

   !> A rejected trial whose last columns are noise is made again with fewer levels; if half the length does not help
   !> either, nothing will
   pure subroutine watch_noise(self, k, status)
      class(order_control), intent(inout) :: self
      integer, intent(in) :: k
      type(status_type), intent(inout) :: status
      if (k < 3) return
      if (self%error(k) < 0.5_wp*self%error(k - 1)) return
      if (self%error(k) > noise_below*self%noise(k)*self%rounding) return
      if (self%stuck_h > 0.0_wp .and. self%h <= 0.55_wp*self%stuck_h .and. self%error(k) > 0.5_wp*self%stuck_error) then
         call unattainable(self, 3.0_wp*self%error(k), status)
      else if (.not. self%stuck_h > 0.0_wp) then
         self%stuck_h = self%h
         self%stuck_error = self%error(k)
      end if
   end subroutine watch_noise

   !> The trial failed before its end, and the run chooses the length of the next one
   pure subroutine control_give_up(self)
      class(order_control), intent(inout) :: self
      self%was_rejected = .true.
      self%proposed = 0.0_wp
   end subroutine control_give_up

   !> What is kept from trial to trial; the tables are those of `prepare`
   recursive subroutine control_archive(self, name, file)
      class(order_control), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('target', self%target)
      call file%item('t', self%t)
      call file%item('proposed', self%proposed)
      call file%item('was_rejected', self%was_rejected)
      call file%item('stuck_error', self%stuck_error)
      call file%item('stuck_h', self%stuck_h)
      call file%end_section()
   end subroutine control_archive
end module dynstep_order_control
