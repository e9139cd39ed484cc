/* Eigenvalues of symmetric matrices in ascending order, and their vectors. Eigen's solver takes seconds to compile, which is done once. */
#ifndef HHTDAE_FLEXIBLE_SYMMETRIC_H
#define HHTDAE_FLEXIBLE_SYMMETRIC_H

#include "scene/small_matrix.h"
#include <Eigen/Core>

namespace hhtdae
{

struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
  bool            found; /* not where entries are no numbers */

  /* The lower triangle of A is read. */
  explicit SymmetricEigen(const Eigen::MatrixXd &A);
};

} // namespace hhtdae

#endif
