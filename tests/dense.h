/* Dense linear algebra that results are compared with, by LAPACK and compiled once: each of Eigen's solvers takes seconds in every source that names it. */
#pragma once
#include <Eigen/Core>

namespace hhtest
{

/* K x = l M x with symmetric matrices, M positive definite: l in ascending order, and x with x^T M x = 1 as columns */
struct DenseModes {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
DenseModes      ModesOf(const Eigen::MatrixXd &K, const Eigen::MatrixXd &M);
Eigen::VectorXd EigenvaluesOf(const Eigen::MatrixXd &K, const Eigen::MatrixXd &M);
Eigen::VectorXd EigenvaluesOf(const Eigen::MatrixXd &symmetric);

/* A x = b for each column of b; LeastSquares() where A has more rows than columns */
Eigen::MatrixXd  SolveDense(const Eigen::MatrixXd &A, const Eigen::MatrixXd &b);
Eigen::MatrixXcd SolveComplex(const Eigen::MatrixXcd &A, const Eigen::MatrixXcd &b);
Eigen::MatrixXd  LeastSquares(const Eigen::MatrixXd &A, const Eigen::MatrixXd &b);

/* Singular values above threshold times the largest */
int RankOf(const Eigen::MatrixXcd &A, double threshold);

} // namespace hhtest
