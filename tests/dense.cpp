#include "dense.h"
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace hhtest
{

using Eigen::MatrixXcd;
using Eigen::MatrixXd;

DenseModes ModesOf(const MatrixXd &K, const MatrixXd &M)
{
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(K, M);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd EigenvaluesOf(const MatrixXd &K, const MatrixXd &M)
{
  return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(K, M, Eigen::EigenvaluesOnly).eigenvalues();
}

Eigen::VectorXd EigenvaluesOf(const MatrixXd &symmetric)
{
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
}

MatrixXd SolveDense(const MatrixXd &A, const MatrixXd &b) { return A.partialPivLu().solve(b); }

MatrixXcd SolveComplex(const MatrixXcd &A, const MatrixXcd &b) { return A.partialPivLu().solve(b); }

MatrixXd LeastSquares(const MatrixXd &A, const MatrixXd &b) { return A.colPivHouseholderQr().solve(b); }

Eigen::Index RankOf(const MatrixXcd &A, double threshold) { return Eigen::FullPivLU<MatrixXcd>(A).setThreshold(threshold).rank(); }

} // namespace hhtest
