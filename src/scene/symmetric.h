/* Eigenvalues of symmetric matrices, in ascending order, and their eigenvectors, by LAPACK: Eigen's solver takes seconds to compile. */
#ifndef HHTDAE_SCENE_SYMMETRIC_H
#define HHTDAE_SCENE_SYMMETRIC_H

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <petscblaslapack.h>

namespace hhtdae
{

struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
  bool            found; /* false if entries of A are not finite or LAPACK fails; values and vectors are then NaN */

  /* Reads the lower triangle of A only */
  explicit SymmetricEigen(const Eigen::MatrixXd &A) : values(A.rows()), vectors(A), found(true)
  {
    PetscBLASInt    n = (PetscBLASInt)A.rows(), size = std::max<PetscBLASInt>(1, 34 * n), info = 0;
    Eigen::VectorXd work(size);
    if (!n) return;
    found = A.template triangularView<Eigen::Lower>().toDenseMatrix().allFinite();
    if (found) LAPACKsyev_("V", "L", &n, vectors.data(), &n, values.data(), work.data(), &size, &info);
    found = found && !info;
    if (found) return;
    values.setConstant(std::numeric_limits<double>::quiet_NaN());
    vectors.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
};

} // namespace hhtdae

#endif
