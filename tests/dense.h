/* Dense linear algebra for references of tests, by LAPACK and compiled once: each of Eigen's solvers would take
   seconds in every source that uses it */
#pragma once
#include <Eigen/Core>

namespace hhtest
{

/* K x = l M x with symmetric K and M, M positive definite: l in ascending order, columns x with x^T M x = 1 */
struct DenseModes {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
DenseModes      ModesOf(const Eigen::MatrixXd &K, const Eigen::MatrixXd &M);
Eigen::VectorXd EigenvaluesOf(const Eigen::MatrixXd &K, const Eigen::MatrixXd &M);
Eigen::VectorXd EigenvaluesOf(const Eigen::MatrixXd &symmetric);

/* A x = b for each column of b; LeastSquares() if A has more rows than columns */
Eigen::MatrixXd  SolveDense(const Eigen::MatrixXd &A, const Eigen::MatrixXd &b);
Eigen::MatrixXcd SolveComplex(const Eigen::MatrixXcd &A, const Eigen::MatrixXcd &b);
Eigen::MatrixXd  LeastSquares(const Eigen::MatrixXd &A, const Eigen::MatrixXd &b);

/* Number of singular values above threshold times the largest */
int RankOf(const Eigen::MatrixXcd &A, double threshold);

} // namespace hhtest
