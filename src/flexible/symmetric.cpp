#include "flexible/symmetric.h"
#include <Eigen/Eigenvalues>

namespace hhtdae
{

SymmetricEigen::SymmetricEigen(const Eigen::MatrixXd &A)
{
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(A);
  values  = solver.eigenvalues();
  vectors = solver.eigenvectors();
  found   = solver.info() == Eigen::Success;
}

} // namespace hhtdae
