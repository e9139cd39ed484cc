/* Orthogonal complement of the columns of a matrix, by LAPACK: Eigen's blocked QR takes seconds to compile. */
#ifndef HHTDAE_SCENE_COMPLEMENT_H
#define HHTDAE_SCENE_COMPLEMENT_H

#include <Eigen/Core>
#include <petscsys.h>
#include <petscblaslapack.h>
#include <vector>

namespace hhtdae
{

/* An orthonormal basis, n x (n - m), of the orthogonal complement of the m independent columns of A (n x m, m <= n) */
inline Eigen::MatrixXd OrthogonalComplement(const Eigen::MatrixXd &A)
{
  const PetscBLASInt       n = (PetscBLASInt)A.rows(), m = (PetscBLASInt)A.cols(), size = 64 * PetscMax(n, 1);
  PetscBLASInt             info;
  Eigen::MatrixXd          Q(n, n);
  std::vector<PetscScalar> tau(PetscMax(m, 1)), work(size);
  if (!m || !n) return Eigen::MatrixXd::Identity(n, n);
  Q.leftCols(m) = A;
  LAPACKgeqrf_(&n, &m, Q.data(), &n, tau.data(), work.data(), &size, &info);
  LAPACKorgqr_(&n, &n, &m, Q.data(), &n, tau.data(), work.data(), &size, &info);
  return Q.rightCols(n - m);
}

} // namespace hhtdae

#endif
