! SPDX-License-Identifier: BSD-3-Clause
!> The problem in its most general form: y' = f(t, y).
!>
!> PROGRAMMING INTERFACE
!>
!>   A user extends ODE_SYSTEM, sets N, and gives the deferred procedure RHS.  Data of the
!>   model are components of the extension, so a model needs no module variables, and two
!>   models of one type can be integrated at once.
!>
!>   JACOBIAN has a default, differences of RHS; JACOBIAN_KIND tells its storage, and KL and KU
!>   its band, which makes the differences cheap.  A mechanical system has tangents instead.
!>
!>   A right side that is smooth on each side of surfaces alone - a contact, a dead zone, dry friction - declares them:
!>   SWITCHES is their number, SWITCH_VALUES gives functions that change their sign there.  A run ends a step at each
!>   crossing and starts anew behind it.  The right side may ask SIDE(i), +1 or -1, in place of the sign of function i:
!>   it does not change inside a step, so that the right side is smooth there, and it must be asked where the right
!>   side jumps at the surface.  SIDES_CHANGED tells an extension that keeps something of its own by SIDE.
!>
!>   Every user procedure ends with IERR:  0 fine,  > 0 outside the model's domain, a
!>   smaller step may help,  < 0 give up and return to the caller.
module dynstep_ode_system
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use dynstep_differences, only: collect, difference_groups, perturb, state_sizes
   use dynstep_kinds, only: long, wp
   use dynstep_matrix, only: kind_dense, matrix_type
   implicit none
   private

   type, abstract, public :: ode_system
      !> Number of unknowns of the system, >= 1; a mechanical system counts coordinates
      integer :: n = 0
      integer :: jacobian_kind = kind_dense      !! of df/dy: kind_diagonal, kind_banded or kind_dense
      integer :: jacobian_kl = 0                 !! subdiagonals of a banded df/dy
      integer :: jacobian_ku = 0                 !! superdiagonals
      integer(long) :: difference_rhs = 0        !! evaluations of f for difference Jacobians
      integer :: switches = 0                    !! number of switch functions of the right side
      integer, allocatable :: side(:)            !! [switches] +1 or -1: the side of each that the right side is taken on;
                                                 !! set by `start` of a stepper from the signs, and by runs
      logical :: keeps_sides = .false.           !! `start` leaves them as they are (runs say so behind a crossing)
      real(wp), allocatable, private :: dynstep_differences(:, :)   ! workspace [n, 4]
   contains
      !> Length of the state vector y
      procedure :: state_size => ode_state_size
      !> f(t, y)
      procedure(rhs_interface), deferred :: rhs
      !> df/dy
      procedure :: jacobian => difference_jacobian
      procedure, non_overridable :: difference_jacobian
      !> Switch functions of the right side
      procedure :: switch_values => no_switch_values
      !> `side` has new values
      procedure :: sides_changed => no_news
      procedure, non_overridable :: find_sides
   end type ode_system

   abstract interface
      recursive subroutine rhs_interface(self, t, y, f, ierr)
         import :: ode_system, wp
         class(ode_system), intent(inout) :: self
         real(wp), intent(in) :: t             !! time
         real(wp), intent(in) :: y(:)          !! state [state_size]
         real(wp), intent(out) :: f(:)         !! y' [state_size]
         integer, intent(out) :: ierr          !! 0, > 0 try a smaller step, < 0 give up
      end subroutine rhs_interface
   end interface

contains

   pure integer function ode_state_size(self)
      class(ode_system), intent(in) :: self
      ode_state_size = self%n
   end function ode_state_size

   !> Functions s(t, y) of the surfaces where the right side is not smooth; an override fills all of them
   recursive subroutine no_switch_values(self, t, y, s, ierr)
      class(ode_system), intent(inout) :: self
      real(wp), intent(in) :: t                     !! time
      real(wp), intent(in) :: y(:)                  !! state [state_size], [q; v] of a mechanical system
      real(wp), intent(out) :: s(:)                 !! values [switches]
      integer, intent(out) :: ierr                  !! 0, > 0 smaller step, < 0 give up
      ierr = -1
      s = 0.0_wp
   end subroutine no_switch_values

   !> `side` from the signs of the switch functions; +1 where one is zero
   recursive subroutine find_sides(self, t, y, ierr)
      class(ode_system), intent(inout) :: self
      real(wp), intent(in) :: t
      real(wp), intent(in) :: y(:)                  !! [state_size]
      integer, intent(out) :: ierr                  !! /= 0: a value is not to be had, or not a number
      real(wp) :: s(self%switches)
      integer :: i
      ierr = 0
      if (self%switches < 1) return
      if (allocated(self%side)) then
         if (size(self%side) /= self%switches) deallocate (self%side)
      end if
      if (.not. allocated(self%side)) allocate (self%side(self%switches), source=1)
      if (self%keeps_sides) return
      call self%switch_values(t, y, s, ierr)
      if (ierr /= 0) return
      do i = 1, self%switches
         if (.not. ieee_is_finite(s(i))) then
            ierr = 1
            return
         end if
         self%side(i) = merge(-1, 1, s(i) < 0.0_wp)
      end do
      call self%sides_changed()
   end subroutine find_sides

   !> Called where `side` was set anew, at a start and behind a crossing, before the right side is asked for there.  An
   !> override may change what belongs to it alone: its parameters, its copies of `side`.
   recursive subroutine no_news(self)
      class(ode_system), intent(inout) :: self
   end subroutine no_news

   !> df/dy by differences.  An override fills `jac`, whose kind and bandwidths are those declared and
   !> whose entries are zero on entry.
   recursive subroutine difference_jacobian(self, t, y, jac, ierr)
      class(ode_system), intent(inout) :: self
      real(wp), intent(in) :: t                     !! time
      real(wp), intent(in) :: y(self%n)             !! state
      type(matrix_type), intent(inout) :: jac       !! df/dy
      integer, intent(out) :: ierr                  !! 0, > 0 smaller step, < 0 give up
      integer :: group, attempt, i

      if (allocated(self%dynstep_differences)) then
         if (size(self%dynstep_differences, 1) /= self%n) deallocate (self%dynstep_differences)
      end if
      if (.not. allocated(self%dynstep_differences)) allocate (self%dynstep_differences(self%n, 4))
      associate (f0 => self%dynstep_differences(:, 1), f1 => self%dynstep_differences(:, 2), &
         & moved => self%dynstep_differences(:, 3), sizes => self%dynstep_differences(:, 4))
         call self%rhs(t, y, f0, ierr)
         self%difference_rhs = self%difference_rhs + 1
         if (ierr /= 0) return
         do i = 1, self%n
            ! the matrix tells of a value that is not finite; a comparison with it could trap
            if (.not. ieee_is_finite(f0(i))) call jac%set_entry(i, i, f0(i))
            if (.not. ieee_is_finite(f0(i))) return
         end do
         call state_sizes(y, f0, sizes)
         do group = 1, difference_groups(jac)
            ! a group that leaves the domain of f moves the other way
            do attempt = 1, 2
               call perturb(group, jac, y, sizes, moved)
               call self%rhs(t, moved, f1, ierr)
               self%difference_rhs = self%difference_rhs + 1
               if (ierr <= 0) exit
               sizes = -sizes
            end do
            if (ierr /= 0) return
            call collect(group, y, moved, f0, f1, 1.0_wp, jac)
         end do
      end associate
   end subroutine difference_jacobian
end module dynstep_ode_system
