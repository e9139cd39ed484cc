/* Inertia invariants in nodal form. */
#include "invariants.h"
#include "modes.h"
#include <algorithm>

namespace hhtdae
{

constexpr PetscInt nodes_at_a_time = 4096; /* nodes of a block whose components are copied to separate matrices */

static constexpr int first_component[6] = {0, 1, 2, 0, 1, 2}, second_component[6] = {0, 1, 2, 1, 2, 0};

/* Component c of the nodes [from, from + count) */
static MatrixXd Component(const MatrixXd &x, PetscInt from, PetscInt count, int c)
{
  MatrixXd part(count, x.cols());
  for (PetscInt k = 0; k < x.cols(); k++)
    for (PetscInt i = 0; i < count; i++) part(i, k) = x(3 * (from + i) + c, k);
  return part;
}

/* Sums over own nodes, one column per mode: rows 0-2 first, 3-11 moment, then the six blocks of quadratic */
static PetscErrorCode LocalSums(const FeModel &model, const BodyScales &scales, const MatrixXd &x, const MatrixXd &Mx,
                                MatrixXd *sums)
{
  const PetscInt n = (PetscInt)x.cols();
  MatrixXd       product, part[3], Mpart[3];

  PetscFunctionBegin;
  sums->setZero(12 + 6 * n, n);
  for (PetscInt from = 0; from < model.own; from += nodes_at_a_time) {
    const PetscInt count = std::min(nodes_at_a_time, model.own - from);
    MatrixXd       X(count, 3);
    for (PetscInt i = 0; i < count; i++) X.row(i) = (NodePosition(model, from + i) - scales.center).transpose();
    for (int c = 0; c < 3; c++) {
      part[c]  = Component(x, from, count, c);
      Mpart[c] = Component(Mx, from, count, c);
      sums->row(c) += Mpart[c].colwise().sum();
    }
    for (int d = 0; d < 3; d++) {
      product = X.transpose() * Mpart[d];
      for (int c = 0; c < 3; c++) sums->row(3 + 3 * c + d) += product.row(c);
    }
    for (int p = 0; p < 6; p++) {
      product = part[first_component[p]].transpose() * Mpart[second_component[p]];
      sums->middleRows(12 + p * n, n) += product;
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode ComputeInvariants(const FeModel &model, const BodyScales &scales, const Eigen::MatrixXd &x,
                                 ModalBody *body)
{
  const PetscInt n = (PetscInt)x.cols();
  MatrixXd       Mx, sums;

  PetscFunctionBegin;
  PetscCall(Multiply(model.M, x, &Mx));
  PetscCall(LocalSums(model, scales, x, Mx, &sums));
  PetscCall(SumOverRanks(model.comm, &sums));
  body->mass    = scales.mass;
  body->center  = scales.center;
  body->moments = scales.moments;
  body->first   = sums.topRows(3);
  for (int c = 0; c < 3; c++) body->moment[c] = sums.middleRows(3 + 3 * c, 3);
  for (int p = 0; p < 6; p++) {
    body->quadratic[p] = sums.middleRows(12 + p * n, n);
    if (p < 3) body->quadratic[p] = 0.5 * (body->quadratic[p] + body->quadratic[p].transpose()).eval();
  }
  PetscFunctionReturn(0);
}

} // namespace hhtdae
