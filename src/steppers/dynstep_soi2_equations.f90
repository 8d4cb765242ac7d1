! SPDX-License-Identifier: BSD-3-Clause
!> The equations of one step of generalized-alpha-SOI2 (Jay & Negrut 2008, eqs. (13)).
!>
!> Unknowns are a, lambda, psi of the end of the step and the differences delta, mu, nu of the auxiliary
!> variables from them: a~ = a + delta, lambda~ = lambda + mu, psi~ = psi + nu.  With b = beta h^2, c = gamma h,
!>
!>   y1 = y0 + h z0 + h^2 (1/2 - beta) a_alpha + b (a + delta)                            (13a)
!>   z1 = z0 + h (1 - gamma) a_alpha + c a,    z~1 = z1 + c delta                         (13c), (13b)
!>   R  = (1 - alpha_m) M1 a + w - (1 - alpha_f) (f + r(lambda, psi))                     (13e)
!>   D  = (1 - alpha_m) M1 delta + (1 - alpha_f) (r(lambda, psi) - r(lambda~, psi~))      (13d) - (13e)
!>   g(t1, y1),  g'(t1, y1, z1),  k(t1, y1, z1),  k(t1, y1, z~1)                          (13f) - (13i)
!>
!> with w = alpha_m M_alpha a_alpha - alpha_f F0.  The constraints are divided by b (positions) and c
!> (velocities), so that all unknowns are accelerations and forces and the Jacobian tends to a regular
!> limit as h -> 0.  Without constraints R alone is left: generalized-alpha (2); with k alone there are no
!> differences: (10); with g alone no psi: (9).
module dynstep_soi2_equations
   use dynstep_accelerations, only: check_callback, check_finite
   use dynstep_alpha_coefficients, only: alpha_coefficients
   use dynstep_archive, only: archive_type
   use dynstep_constrained_motion, only: constrained_motion
   use dynstep_kinds, only: wp
   use dynstep_matrix, only: matrix_type
   use dynstep_mechanical_system, only: mechanical_system
   use dynstep_status, only: dynstep_no_memory, status_type
   use dynstep_stepper, only: step_counters
   use dynstep_text, only: text
   implicit none
   private

   integer, parameter, public :: variant_soi2 = 1      !! (13)
   integer, parameter, public :: variant_reduced = 2   !! psi for psi~, without (13b) and (13h): section 6
   integer, parameter, public :: variant_index3 = 3    !! (2) with g = 0 and without g' = 0: HHT-I3, a baseline

   type, public :: soi2_equations
      type(alpha_coefficients) :: coefficients
      integer :: variant = variant_soi2
      logical :: has_differences = .false.        !! delta, mu, nu are unknowns
      ! of the step, set by the caller
      real(wp) :: t0 = 0.0_wp, t1 = 0.0_wp, h = 0.0_wp
      real(wp) :: b = 0.0_wp, c = 0.0_wp          !! beta h^2, gamma h
      type(matrix_type) :: m1                     !! M_{1+alpha}
      real(wp) :: mass_size = 1.0_wp              !! largest diagonal entry of M_{1+alpha}
      real(wp), allocatable :: y0(:), dy(:)       !! [n] y0, and what (13a) adds but for b (a + delta)
      real(wp), allocatable :: z0(:), dz(:)       !! [n] z0, and what (13c) adds but for c a
      real(wp), allocatable :: w(:)               !! [n] alpha_m M_alpha a_alpha - alpha_f F0
      ! unknowns: predictor, then solution
      real(wp), allocatable :: a(:), delta(:)     !! [n]
      real(wp), allocatable :: lambda(:), mu(:)   !! [m]
      real(wp), allocatable :: psi(:), nu(:)      !! [p]
      ! what belongs to them after `evaluate`
      real(wp), allocatable :: y1(:), z1(:)       !! [n]
      real(wp), allocatable :: r(:), d(:)         !! [n] R and D
      real(wp), allocatable :: rl(:), dl(:)       !! [m] g'/c (index 3: g/b), and g/b - g'/c
      real(wp), allocatable :: rk(:), dk(:)       !! [p] k/c, and (k~ - k)/c
      type(constrained_motion) :: motion          !! constraints at (t1, y1, z1)
      real(wp) :: moved = 0.0_wp                  !! last correction of y1 and h z1, as a part of y1
      real(wp), allocatable :: old_gq(:)          !! entries of G at (t0, y0)
      real(wp), allocatable, private :: f(:), z_tilde(:), lambda_tilde(:), psi_tilde(:)
   contains
      procedure :: init => equations_init
      procedure :: place => equations_place
      procedure :: evaluate => equations_evaluate
      procedure :: change_of_velocity_residual => equations_change_of_velocity_residual
      procedure :: change_of_nonholonomic => equations_change_of_nonholonomic
      procedure :: unknowns => equations_unknowns
      procedure :: pack_unknowns => equations_pack_unknowns
      procedure :: unpack_unknowns => equations_unpack_unknowns
      procedure :: pack_residuals => equations_pack_residuals
      procedure :: archive => equations_archive
   end type soi2_equations

contains

   recursive subroutine equations_init(self, sys, status)
      class(soi2_equations), intent(inout) :: self
      class(mechanical_system), intent(in) :: sys
      type(status_type), intent(inout) :: status
      integer :: stat

      if (status%failed()) return
      self%has_differences = sys%holonomic > 0 .and. self%variant /= variant_index3
      call self%motion%init(sys, status)
      associate (s => sys%structure, n => sys%n, m => sys%holonomic, p => sys%nonholonomic)
         call self%m1%init(s%mass, n, s%mass_kl, s%mass_ku, s%mass_is_symmetric, status)
         if (status%failed()) return
         if (allocated(self%y0)) deallocate (self%y0, self%dy, self%z0, self%dz, self%w, self%a, self%delta, self%lambda, &
            & self%mu, self%psi, self%nu, self%y1, self%z1, self%r, self%d, self%rl, self%dl, self%rk, self%dk, self%f, &
            & self%z_tilde, self%lambda_tilde, self%psi_tilde, self%old_gq)
         allocate (self%y0(n), self%dy(n), self%z0(n), self%dz(n), self%w(n), self%a(n), self%delta(n), self%y1(n), &
            & self%z1(n), self%r(n), self%d(n), self%f(n), self%z_tilde(n), self%lambda(m), self%mu(m), self%rl(m), &
            & self%dl(m), self%lambda_tilde(m), self%psi(p), self%nu(p), self%rk(p), self%dk(p), self%psi_tilde(p), &
            & self%old_gq(size(self%motion%gq%value)), source=0.0_wp, stat=stat)
      end associate
      if (stat /= 0) call status%set(dynstep_no_memory, 'no memory for a step of '//text(sys%n)//' coordinates')
   end subroutine equations_init

   !> y1 and z1 of the present unknowns
   pure subroutine equations_place(self)
      class(soi2_equations), intent(inout) :: self
      integer :: i
      do i = 1, size(self%a)
         self%y1(i) = self%y0(i) + (self%dy(i) + self%b*(self%a(i) + self%delta(i)))
         self%z1(i) = self%z0(i) + (self%dz(i) + self%c*self%a(i))
      end do
   end subroutine equations_place

   !> All residuals of the present unknowns
   recursive subroutine equations_evaluate(self, sys, count, status)
      class(soi2_equations), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      real(wp) :: c_f
      integer :: ierr

      if (status%failed()) return
      call self%place()
      call sys%force(self%t1, self%y1, self%z1, self%f, ierr)
      count%forces = count%forces + 1
      call check_callback('force', ierr, self%t1, status)
      if (.not. status%failed()) call check_finite('force', self%f, self%t1, status)
      call self%motion%evaluate(sys, self%t1, self%y1, self%z1, count, status)
      call self%motion%add_reaction(sys, self%t1, self%y1, self%z1, 1.0_wp, self%lambda, self%psi, self%f, status)
      if (status%failed()) return
      c_f = 1.0_wp - self%coefficients%alpha_f
      self%r = self%w - c_f*self%f
      call self%m1%multiply_add(1.0_wp - self%coefficients%alpha_m, self%a, self%r)
      if (self%variant == variant_index3) then
         self%rl = self%motion%g/self%b
      else if (self%motion%m > 0) then
         self%rl = self%motion%gv/self%c
      end if
      if (self%motion%p > 0) self%rk = self%motion%k/self%c
      if (self%has_differences) call evaluate_differences(self, sys, c_f, count, status)
   end subroutine equations_evaluate

   !> D, g/b - g'/c and (k~ - k)/c.  Where the reaction is -G^T lambda - K^T psi,
   !> D = (1 - alpha_m) M1 delta + (1 - alpha_f) (G^T mu + K^T nu), as the paper says below (13).
   recursive subroutine evaluate_differences(self, sys, c_f, count, status)
      class(soi2_equations), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: c_f
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: j, ierr

      associate (motion => self%motion)
         self%d = 0.0_wp
         call self%m1%multiply_add(1.0_wp - self%coefficients%alpha_m, self%delta, self%d)
         if (sys%constraints%reaction_is_general .and. differences_are_noise(self)) then
            do j = 1, motion%m
               self%d = self%d - (c_f*self%mu(j))*motion%rl(:, j)
            end do
            do j = 1, motion%p
               self%d = self%d - (c_f*self%nu(j))*motion%rp(:, j)
            end do
         else if (sys%constraints%reaction_is_general) then
            self%lambda_tilde = self%lambda + self%mu
            self%psi_tilde = self%psi + self%nu
            call motion%add_reaction(sys, self%t1, self%y1, self%z1, c_f, self%lambda, self%psi, self%d, status)
            call motion%add_reaction(sys, self%t1, self%y1, self%z1, -c_f, self%lambda_tilde, self%psi_tilde, self%d, status)
         else
            call motion%add_reaction(sys, self%t1, self%y1, self%z1, -c_f, self%mu, self%nu, self%d, status)
         end if
         self%dl = motion%g/self%b - self%rl
         if (motion%p == 0) return
         self%dk = self%nu
         if (status%failed() .or. self%variant == variant_reduced) return
         self%z_tilde = self%z1 + self%c*self%delta
         call sys%velocity_constraint(self%t1, self%y1, self%z_tilde, self%dk, ierr)
         count%constraints = count%constraints + 1
         call check_callback('velocity_constraint', ierr, self%t1, status)
         if (.not. status%failed()) call check_finite('velocity_constraint', self%dk, self%t1, status)
         self%dk = self%dk/self%c - self%rk
      end associate
   end subroutine evaluate_differences

   !> Rounding errors of y1 divided by b show in delta, and so in mu and nu: with h = 1e-8 they are larger than the
   !> multipliers, and r(lambda~, psi~) lies far from r(lambda, psi), or nowhere.  From a thousandth of the accelerations
   !> on D is taken as linear in mu and nu, which leaves out O(h^2) of them.
   pure logical function differences_are_noise(self)
      class(soi2_equations), intent(in) :: self
      differences_are_noise = epsilon(1.0_wp)*maxval(abs(self%y1)) > 1.0e-3_wp*abs(self%b)*maxval(abs(self%a))
   end function differences_are_noise

   !> (b/c) Y u of a change b u of y1, with Y = d(G z)/dy = dG/dt along the motion = (G1 - G0)/h + O(h)
   pure subroutine equations_change_of_velocity_residual(self, u, change)
      class(soi2_equations), intent(in) :: self
      real(wp), intent(in) :: u(:)
      real(wp), intent(out) :: change(:)          !! of g'/c
      real(wp) :: total
      integer :: i, e
      associate (gq => self%motion%gq)
         do i = 1, gq%rows
            total = 0.0_wp
            do e = gq%first(i), gq%first(i + 1) - 1
               total = total + (gq%value(e) - self%old_gq(e))*u(gq%column(e))
            end do
            change(i) = (self%b/(self%c*self%h))*total
         end do
      end associate
   end subroutine equations_change_of_velocity_residual

   !> (k(t1, y1 + b u, z1) - k(t1, y1, z1))/c
   recursive subroutine equations_change_of_nonholonomic(self, sys, u, change, count, status)
      class(soi2_equations), intent(inout) :: self
      class(mechanical_system), intent(inout) :: sys
      real(wp), intent(in) :: u(:)
      real(wp), intent(inout) :: change(:)
      type(step_counters), intent(inout) :: count
      type(status_type), intent(inout) :: status
      integer :: ierr
      if (status%failed() .or. size(change) == 0) return
      self%z_tilde = self%y1 + self%b*u
      call sys%velocity_constraint(self%t1, self%z_tilde, self%z1, change, ierr)
      count%constraints = count%constraints + 1
      call check_callback('velocity_constraint', ierr, self%t1, status)
      if (.not. status%failed()) call check_finite('velocity_constraint', change, self%t1, status)
      change = change/self%c - self%rk
   end subroutine equations_change_of_nonholonomic

   !> How many unknowns there are
   pure integer function equations_unknowns(self)
      class(soi2_equations), intent(in) :: self
      equations_unknowns = merge(2, 1, self%has_differences)*(size(self%a) + size(self%lambda) + size(self%psi))
   end function equations_unknowns

   !> x = [a, lambda, psi, delta, mu, nu], without the differences where there are none
   pure subroutine equations_pack_unknowns(self, x)
      class(soi2_equations), intent(in) :: self
      real(wp), intent(out) :: x(:)
      call join(self%a, self%lambda, self%psi, self%delta, self%mu, self%nu, x)
   end subroutine equations_pack_unknowns

   !> x = [R, g'/c, k/c, D, g/b - g'/c, (k~ - k)/c]
   pure subroutine equations_pack_residuals(self, x)
      class(soi2_equations), intent(in) :: self
      real(wp), intent(out) :: x(:)
      call join(self%r, self%rl, self%rk, self%d, self%dl, self%dk, x)
   end subroutine equations_pack_residuals

   pure subroutine join(a, l, k, b, m, j, x)
      real(wp), intent(in) :: a(:), l(:), k(:), b(:), m(:), j(:)
      real(wp), intent(out) :: x(:)
      integer :: i1, i2, i3
      i1 = size(a)
      i2 = i1 + size(l)
      i3 = i2 + size(k)
      x(1:i1) = a
      x(i1 + 1:i2) = l
      x(i2 + 1:i3) = k
      if (size(x) == i3) return
      x(i3 + 1:i3 + i1) = b
      x(i3 + i1 + 1:i3 + i2) = m
      x(i3 + i2 + 1:) = j
   end subroutine join

   pure subroutine equations_unpack_unknowns(self, x)
      class(soi2_equations), intent(inout) :: self
      real(wp), intent(in) :: x(:)
      integer :: i1, i2, i3
      i1 = size(self%a)
      i2 = i1 + size(self%lambda)
      i3 = i2 + size(self%psi)
      self%a = x(1:i1)
      self%lambda = x(i1 + 1:i2)
      self%psi = x(i2 + 1:i3)
      if (.not. self%has_differences) return
      self%delta = x(i3 + 1:i3 + i1)
      self%mu = x(i3 + i1 + 1:i3 + i2)
      self%nu = x(i3 + i2 + 1:)
   end subroutine equations_unpack_unknowns

   !> A constant M, and derivatives of a general reaction, which are kept as long as the matrices of the iteration; all else
   !> is of one step
   recursive subroutine equations_archive(self, name, knows_mass, file)
      class(soi2_equations), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: knows_mass              !! M is constant, and was evaluated
      type(archive_type), intent(inout) :: file
      call file%section(name)
      call file%expect('entries', size(self%motion%gq%value))
      if (knows_mass) then
         call file%item('mass_size', self%mass_size)
         call self%m1%archive('m1', file)
      end if
      call file%item('rl', self%motion%rl)
      call file%item('rp', self%motion%rp)
      call file%end_section()
   end subroutine equations_archive
end module dynstep_soi2_equations
