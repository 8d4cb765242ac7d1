! SPDX-License-Identifier: BSD-3-Clause
!> What a step of generalized-alpha-SOI2 leaves to the next one: a_alpha and M_alpha a_alpha before the adjustments
!> (14) of Jay & Negrut 2008, forces, and slopes for a predictor.
module dynstep_soi2_history
   use dynstep_archive, only: archive_type
   use dynstep_alpha_coefficients, only: alpha_coefficients
   use dynstep_kinds, only: wp
   use dynstep_soi2_equations, only: soi2_equations
   use dynstep_stepper, only: state_type
   implicit none
   private

   public :: balance_defect, velocity_defect

   type, public :: history_type
      logical :: is_there = .false.                    !! there was a step; else f and gq of the start alone
      real(wp) :: h = 0.0_wp                           !! length of the step
      real(wp), allocatable :: a(:), a_used(:)         !! [n] a_{1+alpha} and a_alpha of it
      real(wp), allocatable :: ma(:), ma_used(:)       !! [n] M_{1+alpha} a_{1+alpha} and M_alpha a_alpha
      real(wp), allocatable :: f(:)                    !! [n] f + r at its end
      real(wp), allocatable :: gq(:)                   !! entries of G at its end
      ! a_{n+alpha} - a(t_n + alpha h) is kappa h^2 a'' + O(h^3) along the constraints
      real(wp) :: kappa = 0.0_wp, kappa_used = 0.0_wp  !! of a_{1+alpha} and of a_alpha
      real(wp), allocatable, private :: delta(:), mu(:), nu(:)   ! differences of its auxiliary variables
      ! slopes over the step, x' of a straight line, and what their change gives for x''
      real(wp), allocatable, private :: a_slope(:), lambda_slope(:), psi_slope(:)
      real(wp), allocatable, private :: a_bend(:), lambda_bend(:), psi_bend(:)
      logical :: has_bend = .false.                    !! there was a step before it
      real(wp), private :: bend_factor = 1.0_wp        ! of a'' in a_bend
      logical, private :: bends_better = .false.       ! parabolas predicted it better than straight lines
   contains
      procedure :: init => history_init
      procedure :: adjusted_acceleration => history_adjusted_acceleration
      procedure :: predict => history_predict
      procedure :: take => history_take
      procedure :: archive => history_archive
      procedure :: second_derivative => history_second_derivative
   end type history_type

   !> Rounding errors of a'' are not divided by less, whatever lengths follow each other: 0.5 is the least from the second
   !> step on for steps of one length, at rho = 0
   real(wp), parameter :: least_factor = 0.25_wp

contains

   pure subroutine history_init(self, n, m, p, entries)
      class(history_type), intent(inout) :: self
      integer, intent(in) :: n, m, p
      integer, intent(in) :: entries           !! of G
      if (allocated(self%a)) deallocate (self%a, self%a_used, self%ma, self%ma_used, self%f, self%gq, self%delta, self%mu, &
         & self%nu, self%a_slope, self%lambda_slope, self%psi_slope, self%a_bend, self%lambda_bend, self%psi_bend)
      allocate (self%a(n), self%a_used(n), self%ma(n), self%ma_used(n), self%f(n), self%delta(n), self%a_slope(n), &
         & self%a_bend(n), self%mu(m), self%lambda_slope(m), self%lambda_bend(m), self%nu(p), self%psi_slope(p), &
         & self%psi_bend(p), self%gq(entries), source=0.0_wp)
      self%is_there = .false.
   end subroutine history_init

   !> (14a): a_alpha of a step of length h
   pure subroutine history_adjusted_acceleration(self, alpha, h, a_alpha)
      class(history_type), intent(in) :: self
      real(wp), intent(in) :: alpha, h
      real(wp), intent(out) :: a_alpha(:)
      a_alpha = self%a + (alpha*(h/self%h - 1.0_wp))*(self%a - self%a_used)
   end subroutine history_adjusted_acceleration

   !> Predictor of a step of length h: a, lambda, psi by extrapolation, by parabolas where these served better in the
   !> step before, the differences as they were in proportion to h^2
   pure subroutine history_predict(self, alpha, h, state, a_alpha, eqs)
      class(history_type), intent(in) :: self
      real(wp), intent(in) :: alpha, h
      type(state_type), intent(in) :: state
      real(wp), intent(in) :: a_alpha(:)       !! taken where there was no step
      type(soi2_equations), intent(inout) :: eqs
      real(wp) :: ahead, ratio

      if (.not. self%is_there) then
         eqs%a = a_alpha
         eqs%lambda = state%lambda
         eqs%psi = state%psi
         eqs%delta = 0.0_wp
         eqs%mu = 0.0_wp
         eqs%nu = 0.0_wp
         return
      end if
      ahead = h + alpha*(h - self%h)
      eqs%a = self%a + ahead*self%a_slope
      eqs%lambda = state%lambda + h*self%lambda_slope
      eqs%psi = state%psi + h*self%psi_slope
      if (self%has_bend .and. self%bends_better) then
         eqs%a = eqs%a + (0.5_wp*ahead*(ahead + self%h))*self%a_bend
         eqs%lambda = eqs%lambda + (0.5_wp*h*(h + self%h))*self%lambda_bend
         eqs%psi = eqs%psi + (0.5_wp*h*(h + self%h))*self%psi_bend
      end if
      ratio = (h/self%h)**2
      eqs%delta = ratio*self%delta
      eqs%mu = ratio*self%mu
      eqs%nu = ratio*self%nu
   end subroutine history_predict

   !> a'' from three accelerations, as it is along the constraints; has_bend tells whether there are so many
   pure subroutine history_second_derivative(self, s)
      class(history_type), intent(in) :: self
      real(wp), intent(out) :: s(:)            !! [n]
      s = self%a_bend/self%bend_factor
   end subroutine history_second_derivative

   !> What the solved step leaves.  f + r at its end follows from (13e) itself.
   pure subroutine history_take(self, past, state, a_alpha, ma_alpha, eqs, start_is_second)
      class(history_type), intent(inout) :: self
      type(history_type), intent(in) :: past             !! of the step before
      type(state_type), intent(in) :: state              !! begin of the step
      real(wp), intent(in) :: a_alpha(:), ma_alpha(:)    !! a_alpha and M_alpha a_alpha of the step
      type(soi2_equations), intent(in) :: eqs
      logical, intent(in) :: start_is_second             !! a_alpha of a first step is on the line from a(t0) to a(t1)
      associate (c => eqs%coefficients)
         self%is_there = .true.
         self%h = eqs%h
         self%a = eqs%a
         self%a_used = a_alpha
         self%ma = 0.0_wp
         call eqs%m1%multiply_add(1.0_wp, eqs%a, self%ma)
         self%ma_used = ma_alpha
         self%f = ((1.0_wp - c%alpha_m)*self%ma + eqs%w)/(1.0_wp - c%alpha_f)
         self%gq = eqs%motion%gq%value
         self%delta = eqs%delta
         self%mu = eqs%mu
         self%nu = eqs%nu
         self%a_slope = (self%a - self%a_used)/self%h
         self%lambda_slope = (eqs%lambda - state%lambda)/self%h
         self%psi_slope = (eqs%psi - state%psi)/self%h
         call take_defects(self, past, c, start_is_second)
         call take_bends(self, past, c%alpha())
      end associate
   end subroutine history_take

   !> kappa of both: a_alpha is on a straight line, by (14a) or by the start; a_{1+alpha} follows from (2c)
   pure subroutine take_defects(self, past, c, start_is_second)
      type(history_type), intent(inout) :: self
      type(history_type), intent(in) :: past
      type(alpha_coefficients), intent(in) :: c
      logical, intent(in) :: start_is_second
      real(wp) :: ratio, moved
      associate (alpha => c%alpha(), used => self%kappa_used)
         if (past%is_there) then
            ratio = self%h/past%h
            moved = alpha*(ratio - 1.0_wp)
            used = (past%kappa + moved*(past%kappa - past%kappa_used) - 0.5_wp*moved*(moved + 1.0_wp))/ratio**2
         else
            used = merge(0.5_wp*alpha*(1.0_wp - alpha), 0.0_wp, start_is_second)
         end if
         self%kappa = (balance_defect(c) - c%alpha_m*used)/(1.0_wp - c%alpha_m)
      end associate
   end subroutine take_defects

   !> What (2c) with a at t + alpha h lacks, in h^2 a'': kappa of steps of one length
   pure real(wp) function balance_defect(c)
      type(alpha_coefficients), intent(in) :: c
      balance_defect = 0.5_wp*c%alpha()*(c%alpha_m + c%alpha_f - 1.0_wp)
   end function balance_defect

   !> What (13c) with a at t + alpha h makes wrong in z, in h^3 a'': 1/12 - alpha^2/2 at order 2
   pure real(wp) function velocity_defect(c)
      type(alpha_coefficients), intent(in) :: c
      velocity_defect = 0.5_wp*c%alpha()**2 + c%gamma*(0.5_wp + c%alpha()) - 1.0_wp/6.0_wp
   end function velocity_defect

   !> Second derivatives from the change of the slopes, between the middles of the two steps, and whether they would
   !> have predicted this step better
   pure subroutine take_bends(self, past, alpha)
      type(history_type), intent(inout) :: self
      type(history_type), intent(in) :: past
      real(wp), intent(in) :: alpha
      real(wp) :: apart, ahead, straight, bent, miss
      integer :: i
      ! where the direction of time was turned, the middles of the two steps may coincide
      self%has_bend = past%is_there .and. self%h*sign(1.0_wp, past%h) > 0.0_wp
      self%bends_better = .false.
      if (.not. self%has_bend) return
      apart = (0.5_wp + alpha)*self%h + (0.5_wp - alpha)*past%h
      self%a_bend = (self%a_slope - past%a_slope)/apart
      self%bend_factor = max(least_factor, 1.0_wp + ((self%kappa - self%kappa_used)*self%h &
         & - (past%kappa - past%kappa_used)*past%h)/apart)
      apart = 0.5_wp*(self%h + past%h)
      self%lambda_bend = (self%lambda_slope - past%lambda_slope)/apart
      self%psi_bend = (self%psi_slope - past%psi_slope)/apart
      self%bends_better = .true.
      if (.not. past%has_bend) return
      ahead = self%h + alpha*(self%h - past%h)
      straight = 0.0_wp
      bent = 0.0_wp
      do i = 1, size(self%a)
         miss = self%a(i) - (past%a(i) + ahead*past%a_slope(i))
         straight = max(straight, abs(miss))
         bent = max(bent, abs(miss - (0.5_wp*ahead*(ahead + past%h))*past%a_bend(i)))
      end do
      self%bends_better = bent < straight
   end subroutine take_bends

   recursive subroutine history_archive(self, name, file)
      class(history_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%item('is_there', self%is_there)
      call file%item('has_bend', self%has_bend)
      call file%item('bends_better', self%bends_better)
      call file%item('h', self%h)
      call file%item('a', self%a)
      call file%item('a_used', self%a_used)
      call file%item('ma', self%ma)
      call file%item('ma_used', self%ma_used)
      call file%item('f', self%f)
      call file%item('gq', self%gq)
      call file%item('delta', self%delta)
      call file%item('mu', self%mu)
      call file%item('nu', self%nu)
      call file%item('a_slope', self%a_slope)
      call file%item('lambda_slope', self%lambda_slope)
      call file%item('psi_slope', self%psi_slope)
      call file%item('a_bend', self%a_bend)
      call file%item('lambda_bend', self%lambda_bend)
      call file%item('psi_bend', self%psi_bend)
      call file%item('kappa', self%kappa)
      call file%item('kappa_used', self%kappa_used)
      call file%item('bend_factor', self%bend_factor)
      call file%end_section()
      if (file%failed()) self%is_there = .false.
   end subroutine history_archive
end module dynstep_soi2_history
