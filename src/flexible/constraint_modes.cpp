/* Factorization of the interior stiffness, and constraint modes: static displacements for a unit motion of one attachment, the others being
   held. */
#include "interior.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

/* ---- a singular interior ---- */

/* A null vector of the interior stiffness, by inverse iteration on K + tau M with small tau */
static PetscErrorCode NullVector(const FeModel &model, const Interior &in, const BodyScales &scales, VectorXd *u)
{
  ScopedSolver solver;
  Mat          S;
  Vec          x, y;
  PetscBool    singular;
  PetscInt     negative;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(in.pencil.K, MAT_COPY_VALUES, &S));
  PetscCall(MatAXPY(S, std::max(1e-6 * scales.soft, 1e-12 * scales.stiff), in.pencil.M, DIFFERENT_NONZERO_PATTERN));
  PetscCall(CreateSolver(model.comm, &solver.ksp));
  PetscCall(Factor(solver.ksp, S, &singular, &negative));
  PetscCall(MatDestroy(&S));
  PetscCheck(!singular, model.comm, PETSC_ERR_MAT_LU_ZRPVT,
             "The attachments of the FE model depend on each other: averages over the same few nodes, or over fewer "
             "nodes than they hold motions");
  PetscCall(MatCreateVecs(in.pencil.K, &x, &y));
  PetscCall(VecGetArray(x, &v));
  for (PetscInt i = 0; i < in.rows; i++) v[i] = std::sin(1.7 * (double)(3 * model.first + i) + 0.4);
  PetscCall(VecRestoreArray(x, &v));
  for (int k = 0; k < 6; k++) {
    PetscCall(MatMult(in.pencil.M, x, y));
    PetscCall(KSPSolve(solver.ksp, y, x));
    PetscCall(VecNormalize(x, nullptr));
  }
  u->setZero(3 * model.own);
  PetscCall(VecGetArray(x, &v));
  for (std::size_t i = 0; i < in.dof.size(); i++) (*u)[in.dof[i]] = v[i];
  PetscCall(VecRestoreArray(x, &v));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(0);
}

PetscErrorCode FactorInterior(const FeModel &model, const Interior &in, const BodyScales &scales, KSP *ksp)
{
  PetscBool singular;
  PetscInt  negative;

  PetscFunctionBegin;
  PetscCall(CreateSolver(model.comm, ksp));
  PetscCall(Factor(*ksp, in.pencil.K, &singular, &negative));
  if (singular) {
    VectorXd u;
    PetscCall(KSPDestroy(ksp));
    PetscCall(NullVector(model, in, scales, &u));
    PetscCall(MechanismError(model, u, "K with the attachments held"));
  }
  PetscCheck(negative <= in.pencil.multipliers, model.comm, PETSC_ERR_ARG_WRONG,
             "K with the attachments held has %" PetscInt_FMT
             " negative eigenvalues: it is not a stiffness matrix. Are elements inside out, or are some of reduced integration (C3D20R, C3D8R) free to take the shapes that "
             "have no strain at its points?",
             negative - in.pencil.multipliers);
  PetscFunctionReturn(0);
}

/* ---- constraint modes ---- */

/* Displacements of the nodes of rigid attachments for unit motions of the attachments' dofs [from, from + count) */
static void UnitMotions(const FeModel &model, const std::vector<Tied> &tied, PetscInt from, PetscInt count, MatrixXd *u)
{
  u->setZero(3 * model.own, count);
  for (PetscInt j = from; j < from + count; j++) {
    const Tied &t = tied[j / 6];
    for (PetscInt i : t.node)
      if (t.tie == Tie::Rigid)
        u->block<3, 1>(3 * i, j - from) = RigidMotion(NodePosition(model, i), t.position).col(j % 6);
  }
}

static PetscErrorCode RightHandSides(const FeModel &model, const std::vector<Tied> &tied, const Interior &in,
                                     PetscInt from, const MatrixXd &u, MatrixXd *f)
{
  MatrixXd Ku;
  PetscInt average = 0;

  PetscFunctionBegin;
  PetscCall(Multiply(model.K, u, &Ku));
  f->setZero(in.rows, u.cols());
  for (std::size_t i = 0; i < in.dof.size(); i++) f->row(i) = -Ku.row(in.dof[i]);
  for (std::size_t a = 0; a < tied.size(); a++) {
    if (tied[a].tie != Tie::Average) continue;
    for (int k = 0; k < 6; k++) {
      const PetscInt col = 6 * (PetscInt)a + k - from, row = in.row[6 * average + k];
      if (col >= 0 && col < u.cols() && row >= 0) (*f)(row, col) = in.scale[6 * average + k];
    }
    average++;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode ConstraintModes(const FeModel &model, const std::vector<Tied> &tied, const Interior &in, KSP ksp,
                               MatrixXd *modes)
{
  const PetscInt n = 6 * (PetscInt)tied.size();
  MatrixXd       u, f, x;

  PetscFunctionBegin;
  for (PetscInt from = 0; from < n; from += block_columns) {
    const PetscInt count = std::min(block_columns, n - from);
    UnitMotions(model, tied, from, count, &u);
    PetscCall(RightHandSides(model, tied, in, from, u, &f));
    PetscCall(SolveBlock(ksp, f, &x));
    for (std::size_t i = 0; i < in.dof.size(); i++) u.row(in.dof[i]) = x.row(i);
    modes->middleCols(from, count) = u;
  }
  int finite = modes->leftCols(n).allFinite();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &finite, 1, MPI_INT, MPI_MIN, model.comm));
  PetscCheck(finite, model.comm, PETSC_ERR_FP,
             "Reduce(): constraint modes are not finite; the solver of -" REDUCE_PREFIX "pc_type failed");
  PetscFunctionReturn(0);
}

} // namespace hhtdae
