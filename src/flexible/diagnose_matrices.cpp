/* Checks whether K and M can be those of solid elements: sizes, symmetry, block structure of M, definiteness of M, diagonals. */
#include "attachments.h"
#include "diagnose_nodes.h"
#include "modes.h"
#include "scene/symmetric.h"
#include <algorithm>
#include <cmath>
#include <map>

namespace hhtdae
{

/* Tolerance, relative to the largest entry of M, for entries of M that have to vanish or to be equal */
constexpr double form_tolerance = 1e-8;

static PetscErrorCode CheckLayout(const FeModel &model, Mat A, const char name[])
{
  PetscInt  begin, end, rows, cols;
  PetscBool aij;

  PetscFunctionBegin;
  PetscCheck(A, model.comm, PETSC_ERR_ARG_WRONGSTATE, "The FE model has no matrix %s: read a mesh or matrices first",
             name);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)A, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCheck(aij, model.comm, PETSC_ERR_ARG_WRONG, "The matrix %s of the FE model has to be AIJ (with both triangles)",
             name);
  PetscCall(MatGetSize(A, &rows, &cols));
  PetscCheck(rows == 3 * model.nodes && cols == rows, model.comm, PETSC_ERR_ARG_SIZ,
             "The matrix %s has %" PetscInt_FMT " rows and %" PetscInt_FMT " columns, but there are %" PetscInt_FMT
             " nodes of three unknowns",
             name, rows, cols, model.nodes);
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  int wrong = begin != 3 * model.first || end != 3 * (model.first + model.own) ||
              (PetscInt)model.coordinates.size() != 3 * model.own;
  for (double x : model.coordinates) wrong = wrong || !std::isfinite(x);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &wrong, 1, MPI_INT, MPI_MAX, model.comm));
  PetscCheck(!wrong, model.comm, PETSC_ERR_ARG_SIZ,
             "The rows of %s are not those of the ranks' own nodes, or there are not three finite coordinates for each "
             "own node",
             name);
  PetscFunctionReturn(0);
}

static double TestVector(PetscInt row, double k) { return std::sin(k * (double)row + 0.3 * k); }

/* Checks y^T A x = x^T A y for two fixed vectors, and that entries are finite */
static PetscErrorCode CheckSymmetric(const FeModel &model, Mat A, const char name[])
{
  MatrixXd  X(3 * model.own, 2), AX;
  double    s[3] = {0, 0, 0};
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(MatNorm(A, NORM_FROBENIUS, &norm)); /* unlike norms by maxima it propagates NaN */
  PetscCheck(std::isfinite(norm), model.comm, PETSC_ERR_FP,
             "The matrix %s of the FE model has entries that are not numbers", name);
  PetscCheck(norm > 0, model.comm, PETSC_ERR_ARG_WRONG, "The matrix %s of the FE model is zero", name);
  for (PetscInt i = 0; i < 3 * model.own; i++)
    X.row(i) << TestVector(3 * model.first + i, 1.1), TestVector(3 * model.first + i, 2.3);
  PetscCall(Multiply(A, X, &AX));
  if (X.rows()) {
    s[0] = X.col(0).dot(AX.col(1));
    s[1] = X.col(1).dot(AX.col(0));
    s[2] = X.squaredNorm();
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, s, 3, MPI_DOUBLE, MPI_SUM, model.comm));
  PetscCheck(std::abs(s[0] - s[1]) <= 1e-10 * norm * std::sqrt(s[2]), model.comm, PETSC_ERR_ARG_WRONG,
             "The matrix %s of the FE model is not symmetric; both triangles have to be given", name);
  PetscFunctionReturn(0);
}

/* The three rows of a node in M: m_ij by the node j of the column; *right: whether the blocks are m_ij times the identity */
static PetscErrorCode MassRow(Mat M, PetscInt node, double tiny, std::map<PetscInt, double> *mass, bool *right)
{
  std::map<PetscInt, Vector3> row;
  PetscInt                    n;
  const PetscInt             *cols;
  const PetscScalar          *v;

  PetscFunctionBegin;
  *right = true;
  for (int r = 0; r < 3; r++) {
    PetscCall(MatGetRow(M, 3 * node + r, &n, &cols, &v));
    for (PetscInt k = 0; k < n; k++) {
      if (cols[k] % 3 == r)
        row.emplace(cols[k] / 3, Vector3::Zero()).first->second[r] = v[k];
      else if (std::abs(v[k]) > tiny)
        *right = false;
    }
    PetscCall(MatRestoreRow(M, 3 * node + r, &n, &cols, &v));
  }
  mass->clear();
  for (const auto &m : row) {
    if (m.second.maxCoeff() - m.second.minCoeff() > tiny) *right = false;
    (*mass)[m.first] = m.second[0];
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckMass(const FeModel &model)
{
  std::vector<PetscInt>      wrong_form, not_positive;
  std::map<PetscInt, double> row;
  double                     largest;
  bool                       right;
  PetscInt                   count;
  std::string                labels;

  PetscFunctionBegin;
  PetscCall(LargestEntry(model.comm, model.M, &largest));
  for (PetscInt i = 0; i < model.own; i++) {
    PetscCall(MassRow(model.M, model.first + i, form_tolerance * largest, &row, &right));
    if (!right) wrong_form.push_back(i);
    const auto diagonal = row.find(model.first + i);
    if (diagonal == row.end() || !(diagonal->second > 0)) not_positive.push_back(i);
  }
  PetscCall(NameNodes(model, not_positive, &count, &labels));
  PetscCheck(
      !count, model.comm, PETSC_ERR_ARG_WRONG,
      "%" PetscInt_FMT
      " node(s) of the FE model have no mass or a negative one on the diagonal of M: %s; give all materials a density",
      count, labels.c_str());
  PetscCall(NameNodes(model, wrong_form, &count, &labels));
  PetscCheck(!count, model.comm, PETSC_ERR_ARG_WRONG,
             "M has to be m_ij times the 3 x 3 identity for all pairs of nodes, which translations of solid elements "
             "give. It is not at %" PetscInt_FMT
             " node(s): %s; are the unknowns in the order x, y, z of node after node, without rotations?",
             count, labels.c_str());
  PetscFunctionReturn(0);
}

/*
  Checks that M is positive definite, by the smallest Ritz value of D^-1/2 M D^-1/2, D being the diagonal, in a Lanczos iteration: a negative Ritz value, converged or not, belongs to
  a velocity of negative kinetic energy. For solid elements all eigenvalues are above some 0.01 (Wathen), so that a negative one is isolated and is found early. The cost, products with M only,
  is small compared with the factorization of K. Since M is m_ij times the identity, the x components stand for all.
*/
static PetscErrorCode CheckPositive(const FeModel &model)
{
  constexpr int    steps = 60, check_interval = 10;
  constexpr double negative_limit = -1e-4; /* files with five digits may shift a zero eigenvalue as far */
  VectorXd         alpha(steps), beta(steps);
  Vec              D, q, last, x, w;
  PetscReal        beta_k = 1, least = 0;
  PetscScalar     *start;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(model.M, &D, &q));
  for (Vec *v : {&last, &x, &w}) PetscCall(VecDuplicate(q, v));
  PetscCall(MatGetDiagonal(model.M, D));
  PetscCall(VecSqrtAbs(D));
  PetscCall(VecReciprocal(D));
  PetscCall(VecSet(last, 0));
  PetscCall(VecSet(q, 0));
  PetscCall(VecGetArray(q, &start));
  for (PetscInt i = 0; i < model.own; i++) start[3 * i] = TestVector(NodeLabel(model, i), 12.9898) + TestVector(NodeLabel(model, i), 1.7);
  PetscCall(VecRestoreArray(q, &start));
  PetscCall(VecNormalize(q, nullptr));
  for (int k = 0; k < steps && least > negative_limit && beta_k > 1e-12; k++) {
    PetscCall(VecPointwiseMult(x, D, q));
    PetscCall(MatMult(model.M, x, w));
    PetscCall(VecPointwiseMult(w, D, w));
    if (k) PetscCall(VecAXPY(w, -beta_k, last));
    PetscCall(VecDot(w, q, &alpha[k]));
    PetscCall(VecAXPY(w, -alpha[k], q));
    PetscCall(VecNormalize(w, &beta_k));
    beta[k] = beta_k;
    PetscCall(VecCopy(q, last));
    PetscCall(VecCopy(w, q));
    if ((k + 1) % check_interval && k + 1 < steps && beta_k > 1e-12) continue;
    MatrixXd T = alpha.head(k + 1).asDiagonal();
    for (int i = 0; i < k; i++) T(i + 1, i) = beta[i];
    least = SymmetricEigen(T).values[0];
  }
  for (Vec *v : {&D, &q, &last, &x, &w}) PetscCall(VecDestroy(v));
  PetscCheck(least > negative_limit, model.comm, PETSC_ERR_ARG_WRONG,
             "M is not positive definite: some velocities have a negative kinetic energy, %.3g of the sum of m_ii v_i^2 / 2. Are entries of it missing or of the wrong sign, or were its parts not "
             "added up?",
             (double)least);
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckStiffness(const FeModel &model)
{
  std::vector<PetscInt> without_stiffness, negative;
  double                largest;
  PetscInt              count, n;
  const PetscInt       *cols;
  const PetscScalar    *v;
  std::string           labels;

  PetscFunctionBegin;
  PetscCall(LargestEntry(model.comm, model.K, &largest));
  for (PetscInt i = 0; i < model.own; i++) {
    double most = 0, least = largest;
    for (int r = 0; r < 3; r++) {
      const PetscInt row      = 3 * (model.first + i) + r;
      double         diagonal = 0;
      PetscCall(MatGetRow(model.K, row, &n, &cols, &v));
      for (PetscInt k = 0; k < n; k++) {
        most = std::max(most, std::abs(v[k]));
        if (cols[k] == row) diagonal = v[k];
      }
      PetscCall(MatRestoreRow(model.K, row, &n, &cols, &v));
      least = std::min(least, diagonal);
    }
    if (most <= coupling_tolerance * largest)
      without_stiffness.push_back(i);
    else if (least < 0)
      negative.push_back(i);
  }
  PetscCall(NameNodes(model, without_stiffness, &count, &labels));
  PetscCheck(!count, model.comm, PETSC_ERR_ARG_WRONG,
             "%" PetscInt_FMT " node(s) of the FE model have no stiffness: %s; no element holds them: remove them",
             count, labels.c_str());
  PetscCall(NameNodes(model, negative, &count, &labels));
  PetscCheck(!count, model.comm, PETSC_ERR_ARG_WRONG,
             "%" PetscInt_FMT
             " node(s) of the FE model have a negative stiffness on the diagonal of K: %s; are elements inside out?",
             count, labels.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode CheckMatrices(const FeModel &model)
{
  PetscFunctionBegin;
  PetscCheck(model.nodes > 0, model.comm, PETSC_ERR_ARG_WRONGSTATE,
             "The FE model has no nodes: read a mesh or matrices first");
  PetscCall(CheckLayout(model, model.K, "K"));
  PetscCall(CheckLayout(model, model.M, "M"));
  PetscCall(CheckSymmetric(model, model.K, "K"));
  PetscCall(CheckSymmetric(model, model.M, "M"));
  PetscCall(CheckMass(model));
  PetscCall(CheckPositive(model));
  PetscCall(CheckStiffness(model));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
