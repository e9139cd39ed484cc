/* Makes modes unique, independent of the number of ranks: the combination of modes of equal frequencies, and signs. */
#include "craig_bampton.h"
#include "scene/symmetric.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

/* ---- equal frequencies ---- */

/* A weight that decreases with the distance from an off-centre point and differs by component, so that it has none of the body's symmetries */
static double AsymmetricWeight(const Vector3 &X, const BodyScales &scales, int c)
{
  static const double direction[3] = {1, 0.37, 0.11};
  return direction[c] / (1 + 2 * ((X - scales.center) / scales.length - Vector3(0.9, 0.5, 0.2)).squaredNorm());
}

/* Orthogonalizes the modes in the asymmetric weight as well, which leaves their signs undetermined only */
PetscErrorCode TurnEqual(const FeModel &model, const BodyScales &scales, PetscInt from, PetscInt to, MatrixXd *X,
                         MatrixXd *Y)
{
  const PetscInt n = to - from;
  MatrixXd       G = MatrixXd::Zero(n, n);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < 3 * model.own; i++) {
    const VectorXd row = X->block(i, from, 1, n).transpose();
    G += AsymmetricWeight(NodePosition(model, i / 3), scales, i % 3) * row * row.transpose();
  }
  PetscCall(SumOverRanks(model.comm, &G));
  const SymmetricEigen turn(0.5 * (G + G.transpose()));
  X->middleCols(from, n) = (X->middleCols(from, n) * turn.vectors).eval();
  Y->middleCols(from, n) = (Y->middleCols(from, n) * turn.vectors).eval();
  PetscFunctionReturn(0);
}

/* ---- signs ---- */

PetscErrorCode FixSigns(const FeModel &model, MatrixXd *X, MatrixXd *Y)
{
  const PetscInt        n = (PetscInt)X->cols();
  std::vector<double>   largest(n, 0.), value(n, 0.);
  std::vector<PetscInt> first(n, PETSC_MAX_INT);

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n && X->rows(); k++) largest[k] = X->col(k).cwiseAbs().maxCoeff();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, largest.data(), (PetscMPIInt)n, MPI_DOUBLE, MPI_MAX, model.comm));
  for (PetscInt k = 0; k < n; k++)
    for (PetscInt i = 0; i < X->rows(); i++)
      if (std::abs((*X)(i, k)) > (1 - 1e-4) * largest[k])
        first[k] = std::min(first[k], 3 * NodeLabel(model, i / 3) + i % 3);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, first.data(), (PetscMPIInt)n, MPIU_INT, MPI_MIN, model.comm));
  for (PetscInt k = 0; k < n; k++)
    for (PetscInt i = 0; i < X->rows(); i++)
      if (std::abs((*X)(i, k)) > (1 - 1e-4) * largest[k] && first[k] == 3 * NodeLabel(model, i / 3) + i % 3)
        value[k] = (*X)(i, k);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value.data(), (PetscMPIInt)n, MPI_DOUBLE, MPI_SUM, model.comm));
  for (PetscInt k = 0; k < n; k++)
    if (value[k] < 0) {
      X->col(k) *= -1;
      Y->col(k) *= -1;
    }
  PetscFunctionReturn(0);
}

} // namespace hhtdae
