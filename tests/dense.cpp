#include "dense.h"
#include <petscsys.h>
#include <petscblaslapack.h>
#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace hhtest
{

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace
{

void Check(const char *routine, PetscBLASInt info)
{
  if (info) throw std::runtime_error(std::string("LAPACK's ") + routine + " has failed with " + std::to_string(info));
}

/* K becomes the vectors, M its factor */
VectorXd Generalized(const char *job, MatrixXd &K, MatrixXd M)
{
  const PetscBLASInt  one = 1;
  PetscBLASInt        n = (PetscBLASInt)K.rows(), size = 8 * n + 8, info;
  VectorXd            values(n);
  std::vector<double> work(size);
  LAPACKsygv_(&one, job, "L", &n, K.data(), &n, M.data(), &n, values.data(), work.data(), &size, &info);
  Check("sygv", info);
  return values;
}

/* Least squares of least length, and the number of singular values above threshold times the largest */
void Least(MatrixXd A, MatrixXd &x, double threshold, PetscBLASInt *rank)
{
  PetscBLASInt        m = (PetscBLASInt)A.rows(), n = (PetscBLASInt)A.cols(), k = (PetscBLASInt)x.cols(), longer = std::max(m, n), size = 8 * (m + n) + k, info;
  VectorXd            singular(std::min(m, n));
  std::vector<double> work(size);
  x.conservativeResize(longer, k);
  LAPACKgelss_(&m, &n, &k, A.data(), &m, x.data(), &longer, singular.data(), &threshold, rank, work.data(), &size, &info);
  Check("gelss", info);
  x.conservativeResize(n, k);
}

/* (a + i b) (x + i y) = (a x - b y) + i (b x + a y) */
MatrixXd RealForm(const MatrixXcd &A)
{
  MatrixXd R(2 * A.rows(), 2 * A.cols());
  R << A.real(), -A.imag(), A.imag(), A.real();
  return R;
}

} // namespace

DenseModes ModesOf(const MatrixXd &K, const MatrixXd &M)
{
  DenseModes modes;
  modes.vectors = K;
  modes.values  = Generalized("V", modes.vectors, M);
  return modes;
}

VectorXd EigenvaluesOf(const MatrixXd &K, const MatrixXd &M)
{
  MatrixXd copy = K;
  return Generalized("N", copy, M);
}

VectorXd EigenvaluesOf(const MatrixXd &symmetric) { return EigenvaluesOf(symmetric, MatrixXd::Identity(symmetric.rows(), symmetric.rows())); }

MatrixXd SolveDense(const MatrixXd &A, const MatrixXd &b)
{
  PetscBLASInt              n = (PetscBLASInt)A.rows(), k = (PetscBLASInt)b.cols(), info;
  std::vector<PetscBLASInt> pivot(n);
  MatrixXd                  lu = A, x = b;
  LAPACKgesv_(&n, &k, lu.data(), &n, pivot.data(), x.data(), &n, &info);
  Check("gesv", info);
  return x;
}

MatrixXcd SolveComplex(const MatrixXcd &A, const MatrixXcd &b)
{
  MatrixXd parts(2 * b.rows(), b.cols());
  parts << b.real(), b.imag();
  const MatrixXd x = SolveDense(RealForm(A), parts);
  MatrixXcd      z(b.rows(), b.cols());
  z.real() = x.topRows(b.rows());
  z.imag() = x.bottomRows(b.rows());
  return z;
}

MatrixXd LeastSquares(const MatrixXd &A, const MatrixXd &b)
{
  PetscBLASInt rank;
  MatrixXd     x = b;
  Least(A, x, 1e-14, &rank);
  return x;
}

int RankOf(const MatrixXcd &A, double threshold)
{
  PetscBLASInt rank;
  MatrixXd     none = MatrixXd::Zero(2 * A.rows(), 1);
  Least(RealForm(A), none, threshold, &rank);
  return rank / 2;
}

} // namespace hhtest
