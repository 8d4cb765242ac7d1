! SPDX-License-Identifier: BSD-3-Clause
!> Explicit interfaces of the LAPACK and BLAS routines that the library calls.
!>
!> They are declared pure: with correct arguments none of them prints or stops
!> (XERBLA is reached by wrong arguments only).
module dynstep_lapack
   use dynstep_kinds, only: wp
   implicit none
   private

   public :: dgbtrf, dgbtrs, dgeqp3, dgetrf, dgetrs, dlacn2, dpbtrf, dpbtrs, dpotrf, dpotrs, dsterf, dsyrk
   public :: zgbtrf, zgbtrs, zgetrf, zgetrs

   interface
      !> A = P L U, band storage with kl rows of fill room on top
      pure subroutine dgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
         import :: wp
         integer, intent(in) :: m, n, kl, ku, ldab
         real(wp), intent(inout) :: ab(ldab, *)   !! [2kl+ku+1, n]
         integer, intent(out) :: ipiv(*)          !! [min(m,n)]
         integer, intent(out) :: info             !! k > 0: U(k,k) is zero
      end subroutine dgbtrf

      !> Solve A x = b or A^T x = b from dgbtrf
      pure subroutine dgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
         import :: wp
         character(len=1), intent(in) :: trans
         integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb
         real(wp), intent(in) :: ab(ldab, *)
         integer, intent(in) :: ipiv(*)
         real(wp), intent(inout) :: b(ldb, *)     !! [n, nrhs]
         integer, intent(out) :: info
      end subroutine dgbtrs

      !> A P = Q R with column pivoting
      pure subroutine dgeqp3(m, n, a, lda, jpvt, tau, work, lwork, info)
         import :: wp
         integer, intent(in) :: m, n, lda
         real(wp), intent(inout) :: a(lda, *)     !! [m, n] in, R in its upper triangle out
         integer, intent(inout) :: jpvt(*)        !! 0 in: free; column of A that is column j of A P [n]
         real(wp), intent(out) :: tau(*)          !! [min(m,n)]
         real(wp), intent(out) :: work(*)         !! [lwork]; lwork = -1: the best lwork in work(1)
         integer, intent(in) :: lwork             !! >= 3n + 1
         integer, intent(out) :: info
      end subroutine dgeqp3

      !> A = P L U
      pure subroutine dgetrf(m, n, a, lda, ipiv, info)
         import :: wp
         integer, intent(in) :: m, n, lda
         real(wp), intent(inout) :: a(lda, *)     !! [m, n]
         integer, intent(out) :: ipiv(*)          !! [min(m,n)]
         integer, intent(out) :: info             !! k > 0: U(k,k) is zero
      end subroutine dgetrf

      !> Solve A x = b or A^T x = b from dgetrf
      pure subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         character(len=1), intent(in) :: trans
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(in) :: a(lda, *)
         integer, intent(in) :: ipiv(*)
         real(wp), intent(inout) :: b(ldb, *)     !! [n, nrhs]
         integer, intent(out) :: info
      end subroutine dgetrs

      !> A = L L^T, band storage of one triangle
      pure subroutine dpbtrf(uplo, n, kd, ab, ldab, info)
         import :: wp
         character(len=1), intent(in) :: uplo
         integer, intent(in) :: n, kd, ldab
         real(wp), intent(inout) :: ab(ldab, *)   !! [kd+1, n]
         integer, intent(out) :: info             !! k > 0: pivot k is not positive
      end subroutine dpbtrf

      !> Solve A x = b from dpbtrf
      pure subroutine dpbtrs(uplo, n, kd, nrhs, ab, ldab, b, ldb, info)
         import :: wp
         character(len=1), intent(in) :: uplo
         integer, intent(in) :: n, kd, nrhs, ldab, ldb
         real(wp), intent(in) :: ab(ldab, *)
         real(wp), intent(inout) :: b(ldb, *)     !! [n, nrhs]
         integer, intent(out) :: info
      end subroutine dpbtrs

      !> A = L L^T
      pure subroutine dpotrf(uplo, n, a, lda, info)
         import :: wp
         character(len=1), intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(wp), intent(inout) :: a(lda, *)     !! [n, n]
         integer, intent(out) :: info             !! k > 0: pivot k is not positive
      end subroutine dpotrf

      !> Solve A x = b from dpotrf
      pure subroutine dpotrs(uplo, n, nrhs, a, lda, b, ldb, info)
         import :: wp
         character(len=1), intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(in) :: a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)     !! [n, nrhs]
         integer, intent(out) :: info
      end subroutine dpotrs

      !> Eigenvalues of a symmetric tridiagonal matrix
      pure subroutine dsterf(n, d, e, info)
         import :: wp
         integer, intent(in) :: n
         real(wp), intent(inout) :: d(*)          !! diagonal, then eigenvalues, ascending [n]
         real(wp), intent(inout) :: e(*)          !! off-diagonal [n-1], destroyed
         integer, intent(out) :: info             !! > 0: so many did not converge
      end subroutine dsterf

      !> C = alpha A A^T + beta C (trans = 'N'), one triangle
      pure subroutine dsyrk(uplo, trans, n, k, alpha, a, lda, beta, c, ldc)
         import :: wp
         character(len=1), intent(in) :: uplo, trans
         integer, intent(in) :: n, k, lda, ldc
         real(wp), intent(in) :: alpha, beta
         real(wp), intent(in) :: a(lda, *)        !! [n, k]
         real(wp), intent(inout) :: c(ldc, *)     !! [n, n]
      end subroutine dsyrk

      !> Higham's estimate of the 1-norm of an operator, by reverse communication:
      !> kase = 1 asks for x = B x, kase = 2 for x = B^T x, kase = 0 says done
      pure subroutine dlacn2(n, v, x, isgn, est, kase, isave)
         import :: wp
         integer, intent(in) :: n
         real(wp), intent(inout) :: v(n), x(n)
         integer, intent(inout) :: isgn(n), kase, isave(3)
         real(wp), intent(inout) :: est
      end subroutine dlacn2

      !> dgbtrf of a complex matrix
      pure subroutine zgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
         import :: wp
         integer, intent(in) :: m, n, kl, ku, ldab
         complex(wp), intent(inout) :: ab(ldab, *)
         integer, intent(out) :: ipiv(*)
         integer, intent(out) :: info
      end subroutine zgbtrf

      !> dgbtrs of a complex matrix
      pure subroutine zgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
         import :: wp
         character(len=1), intent(in) :: trans
         integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb
         complex(wp), intent(in) :: ab(ldab, *)
         integer, intent(in) :: ipiv(*)
         complex(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine zgbtrs

      !> dgetrf of a complex matrix
      pure subroutine zgetrf(m, n, a, lda, ipiv, info)
         import :: wp
         integer, intent(in) :: m, n, lda
         complex(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*)
         integer, intent(out) :: info
      end subroutine zgetrf

      !> dgetrs of a complex matrix
      pure subroutine zgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         character(len=1), intent(in) :: trans
         integer, intent(in) :: n, nrhs, lda, ldb
         complex(wp), intent(in) :: a(lda, *)
         integer, intent(in) :: ipiv(*)
         complex(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine zgetrs
   end interface
end module dynstep_lapack
