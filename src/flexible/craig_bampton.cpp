/* The space in which a body moves after reduction: constraint modes of its attachments and normal modes. */
#include "craig_bampton.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

/* ---- the interior problem ---- */

/* K and M of the dofs which no rigid attachment holds, with the multipliers of averages */
struct Interior {
  std::vector<PetscInt> dof; /* own ones, counted from the first own dof; the first rows of the pencil on this rank */
  Pencil                pencil;
  PetscInt              rows = 0; /* of this rank, multipliers included */
  VectorXd              scale;    /* of the rows of averages, 6 each; on all ranks */
  std::vector<PetscInt> row;      /* of the multiplier in this rank's part, -1: on another rank; 6 for each average */

  ~Interior()
  {
    PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&pencil.K));
    PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&pencil.M));
  }
};

static std::vector<PetscInt> FreeDofs(const FeModel &model, const std::vector<Tied> &tied)
{
  std::vector<char>     held(model.own, 0);
  std::vector<PetscInt> dofs;
  for (const Tied &t : tied)
    if (t.tie == Tie::Rigid)
      for (PetscInt i : t.node) held[i] = 1;
  for (PetscInt i = 0; i < model.own; i++)
    for (int c = 0; c < 3 && !held[i]; c++) dofs.push_back(3 * i + c);
  return dofs;
}

static PetscErrorCode SubMatrix(const FeModel &model, Mat A, const std::vector<PetscInt> &dof, Mat *sub)
{
  IS                    is;
  std::vector<PetscInt> global(dof);

  PetscFunctionBegin;
  for (PetscInt &d : global) d += 3 * model.first;
  PetscCall(ISCreateGeneral(model.comm, (PetscInt)global.size(), global.data(), PETSC_COPY_VALUES, &is));
  PetscCall(MatCreateSubMatrix(A, is, is, MAT_INITIAL_MATRIX, sub));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateEmpty(MPI_Comm comm, PetscInt rows, PetscInt cols, Mat *A)
{
  PetscFunctionBegin;
  PetscCall(MatCreate(comm, A));
  PetscCall(MatSetSizes(*A, rows, cols, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscFunctionReturn(0);
}

/* Multipliers stand on the rank with most of their nodes */
static PetscErrorCode PlaceMultipliers(const FeModel &model, const std::vector<Tied> &tied, Interior *in,
                                       PetscInt *mine, std::vector<PetscInt> *global)
{
  PetscMPIInt rank, size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(model.comm, &rank));
  PetscCallMPI(MPI_Comm_size(model.comm, &size));
  std::vector<PetscInt> count(size + 1, 0);
  for (const Tied &t : tied)
    if (t.tie == Tie::Average) count[t.owner + 1] += 6;
  *mine = count[rank + 1];
  for (PetscMPIInt r = 0; r < size; r++) count[r + 1] += count[r];
  std::vector<PetscInt> next(count);
  for (const Tied &t : tied)
    for (int k = 0; k < 6 && t.tie == Tie::Average; k++) {
      in->row.push_back(t.owner == rank ? (PetscInt)in->dof.size() + next[t.owner] - count[t.owner] : -1);
      global->push_back(next[t.owner]++);
    }
  PetscFunctionReturn(0);
}

/* Rows of averages get the size of entries of K, so that pivots can be compared */
static PetscErrorCode ScaleRows(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                                VectorXd *scale)
{
  std::vector<double> squares;
  const double        size = scales.stiff * scales.mass / (double)model.nodes;

  PetscFunctionBegin;
  for (const Tied &t : tied)
    for (int k = 0; k < 6 && t.tie == Tie::Average; k++) {
      squares.push_back(0);
      for (const auto &row : t.row) squares.back() += row.row(k).squaredNorm();
    }
  PetscCallMPI(
      MPI_Allreduce(MPI_IN_PLACE, squares.data(), (PetscMPIInt)squares.size(), MPI_DOUBLE, MPI_SUM, model.comm));
  scale->resize((Eigen::Index)squares.size());
  for (std::size_t k = 0; k < squares.size(); k++) (*scale)[k] = size / std::sqrt(squares[k]);
  PetscFunctionReturn(0);
}

/* C^T for free dofs, scaled: six columns for each average */
static PetscErrorCode CreateCt(const FeModel &model, const std::vector<Tied> &tied, const Interior &in, PetscInt mine,
                               const std::vector<PetscInt> &global, Mat *Ct)
{
  std::vector<PetscInt> place(3 * model.own, -1), entries(in.dof.size(), 0);
  PetscInt              begin, average = 0;

  PetscFunctionBegin;
  for (std::size_t i = 0; i < in.dof.size(); i++) place[in.dof[i]] = (PetscInt)i;
  for (const Tied &t : tied)
    for (PetscInt n : t.node)
      for (int c = 0; c < 3 && t.tie == Tie::Average; c++) entries[place[3 * n + c]] += 6;
  PetscCall(CreateEmpty(model.comm, (PetscInt)in.dof.size(), mine, Ct));
  PetscCall(MatSeqAIJSetPreallocation(*Ct, 0, entries.data()));
  PetscCall(MatMPIAIJSetPreallocation(*Ct, 0, entries.data(), 0, entries.data()));
  PetscCall(MatSetOption(*Ct, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatGetOwnershipRange(*Ct, &begin, nullptr));
  for (const Tied &t : tied) {
    if (t.tie != Tie::Average) continue;
    for (std::size_t i = 0; i < t.node.size(); i++)
      for (int c = 0; c < 3; c++) {
        const PetscInt                    row   = begin + place[3 * t.node[i] + c];
        const Eigen::Matrix<double, 6, 1> value = t.row[i].col(c).cwiseProduct(in.scale.segment<6>(6 * average));
        PetscCall(MatSetValues(*Ct, 1, &row, 6, &global[6 * average], value.data(), INSERT_VALUES));
      }
    average++;
  }
  PetscCall(MatAssemblyBegin(*Ct, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*Ct, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

static PetscErrorCode Bordered(MPI_Comm comm, Mat *A, Mat upper, Mat lower, Mat corner)
{
  Mat blocks[4] = {*A, upper, lower, corner}, nest, all;

  PetscFunctionBegin;
  PetscCall(MatCreateNest(comm, 2, nullptr, 2, nullptr, blocks, &nest));
  PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, &all));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(A));
  *A = all;
  PetscFunctionReturn(0);
}

static PetscErrorCode AddMultipliers(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                                     Interior *in)
{
  PetscInt              mine;
  std::vector<PetscInt> global;
  Mat                   Ct, C, zero;

  PetscFunctionBegin;
  PetscCall(PlaceMultipliers(model, tied, in, &mine, &global));
  in->pencil.multipliers = (PetscInt)global.size();
  in->rows               = (PetscInt)in->dof.size() + mine;
  if (global.empty()) PetscFunctionReturn(0);
  PetscCall(ScaleRows(model, tied, scales, &in->scale));
  PetscCall(CreateCt(model, tied, *in, mine, global, &Ct));
  PetscCall(MatTranspose(Ct, MAT_INITIAL_MATRIX, &C));
  PetscCall(CreateEmpty(model.comm, mine, mine, &zero));
  PetscCall(MatSetUp(zero));
  PetscCall(MatAssemblyBegin(zero, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(zero, MAT_FINAL_ASSEMBLY));
  PetscCall(Bordered(model.comm, &in->pencil.K, Ct, C, zero));
  PetscCall(Bordered(model.comm, &in->pencil.M, nullptr, nullptr, zero));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatDestroy(&C));
  PetscCall(MatDestroy(&zero));
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateInterior(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                                     Interior *in)
{
  PetscInt count;

  PetscFunctionBegin;
  in->dof = FreeDofs(model, tied);
  count   = (PetscInt)in->dof.size();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPIU_INT, MPI_SUM, model.comm));
  PetscCheck(count > 0, model.comm, PETSC_ERR_ARG_WRONG,
             "The attachments hold all nodes of the FE model rigidly: nothing is left to deform");
  PetscCall(SubMatrix(model, model.K, in->dof, &in->pencil.K));
  PetscCall(SubMatrix(model, model.M, in->dof, &in->pencil.M));
  PetscCall(AddMultipliers(model, tied, scales, in));
  in->pencil.modes = count - in->pencil.multipliers;
  PetscCheck(in->pencil.modes >= 0, model.comm, PETSC_ERR_ARG_WRONG,
             "The averages have more degrees of freedom than the nodes of the FE model");
  PetscFunctionReturn(0);
}

/* ---- a singular interior ---- */

/* Inverse iteration on K + tau M: it turns to what K does not resist */
static PetscErrorCode NullVector(const FeModel &model, const Interior &in, const BodyScales &scales, VectorXd *u)
{
  KSP          ksp;
  Mat          S;
  Vec          x, y;
  PetscBool    singular;
  PetscInt     negative;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(in.pencil.K, MAT_COPY_VALUES, &S));
  PetscCall(MatAXPY(S, std::max(1e-6 * scales.soft, 1e-12 * scales.stiff), in.pencil.M, DIFFERENT_NONZERO_PATTERN));
  PetscCall(CreateSolver(model.comm, &ksp));
  PetscCall(Factor(ksp, S, &singular, &negative));
  PetscCheck(!singular, model.comm, PETSC_ERR_MAT_LU_ZRPVT,
             "The attachments of the FE model depend on each other: averages over the same few nodes, or over fewer "
             "nodes than they hold motions");
  PetscCall(MatCreateVecs(in.pencil.K, &x, &y));
  PetscCall(VecGetArray(x, &v));
  for (PetscInt i = 0; i < in.rows; i++) v[i] = std::sin(1.7 * (double)(3 * model.first + i) + 0.4);
  PetscCall(VecRestoreArray(x, &v));
  for (int k = 0; k < 6; k++) {
    PetscCall(MatMult(in.pencil.M, x, y));
    PetscCall(KSPSolve(ksp, y, x));
    PetscCall(VecNormalize(x, nullptr));
  }
  u->setZero(3 * model.own);
  PetscCall(VecGetArray(x, &v));
  for (std::size_t i = 0; i < in.dof.size(); i++) (*u)[in.dof[i]] = v[i];
  PetscCall(VecRestoreArray(x, &v));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(MatDestroy(&S));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(0);
}

static PetscErrorCode FactorInterior(const FeModel &model, const Interior &in, const BodyScales &scales, KSP *ksp)
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
             " negative eigenvalues: it is not a stiffness matrix; are elements inside out?",
             negative - in.pencil.multipliers);
  PetscFunctionReturn(0);
}

/* ---- constraint modes ---- */

/* Displacements of the nodes of rigid attachments, units of dofs [from, from + count) */
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

static PetscErrorCode SolveBlock(KSP ksp, const Interior &in, const MatrixXd &f, MatrixXd *x)
{
  Mat                B, X;
  MPI_Comm           comm = PetscObjectComm((PetscObject)ksp);
  KSPConvergedReason reason;

  PetscFunctionBegin;
  x->setZero(in.rows, f.cols());
  PetscCall(MatCreateDense(comm, in.rows, PETSC_DECIDE, PETSC_DETERMINE, f.cols(), const_cast<double *>(f.data()), &B));
  PetscCall(MatCreateDense(comm, in.rows, PETSC_DECIDE, PETSC_DETERMINE, f.cols(), x->data(), &X));
  for (Mat A : {B, X}) {
    PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(KSPMatSolve(ksp, B, X));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCheck(reason >= 0, comm, PETSC_ERR_CONV_FAILED,
             "Reduce(): the solver of -" REDUCE_PREFIX "ksp_type did not converge (%s) for constraint modes",
             KSPConvergedReasons[reason]);
  PetscCall(MatDestroy(&B));
  PetscCall(MatDestroy(&X));
  PetscFunctionReturn(0);
}

static PetscErrorCode ConstraintModes(const FeModel &model, const std::vector<Tied> &tied, const Interior &in, KSP ksp,
                                      MatrixXd *modes)
{
  const PetscInt n = 6 * (PetscInt)tied.size();
  MatrixXd       u, f, x;

  PetscFunctionBegin;
  for (PetscInt from = 0; from < n; from += block_columns) {
    const PetscInt count = std::min(block_columns, n - from);
    UnitMotions(model, tied, from, count, &u);
    PetscCall(RightHandSides(model, tied, in, from, u, &f));
    PetscCall(SolveBlock(ksp, in, f, &x));
    for (std::size_t i = 0; i < in.dof.size(); i++) u.row(in.dof[i]) = x.row(i);
    modes->middleCols(from, count) = u;
  }
  int finite = modes->leftCols(n).allFinite();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &finite, 1, MPI_INT, MPI_MIN, model.comm));
  PetscCheck(finite, model.comm, PETSC_ERR_FP,
             "Reduce(): constraint modes are not finite; the solver of -" REDUCE_PREFIX "pc_type failed");
  PetscFunctionReturn(0);
}

/* ---- equal frequencies ---- */

/* Falls off from a point beside the body, so that symmetries of the body are none of it */
static double Weight(const Vector3 &X, const BodyScales &scales, int c)
{
  static const double direction[3] = {1, 0.37, 0.11};
  return direction[c] / (1 + 2 * ((X - scales.center) / scales.length - Vector3(0.9, 0.5, 0.2)).squaredNorm());
}

/* Orthogonal in the weight: what is left to choose is the sign */
PetscErrorCode TurnEqual(const FeModel &model, const BodyScales &scales, PetscInt from, PetscInt to, MatrixXd *X,
                         MatrixXd *Y)
{
  const PetscInt n = to - from;
  MatrixXd       G = MatrixXd::Zero(n, n);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < 3 * model.own; i++) {
    const VectorXd row = X->block(i, from, 1, n).transpose();
    G += Weight(NodePosition(model, i / 3), scales, i % 3) * row * row.transpose();
  }
  PetscCall(SumOverRanks(model.comm, &G));
  const Eigen::SelfAdjointEigenSolver<MatrixXd> turn(0.5 * (G + G.transpose()));
  X->middleCols(from, n) = (X->middleCols(from, n) * turn.eigenvectors()).eval();
  Y->middleCols(from, n) = (Y->middleCols(from, n) * turn.eigenvectors()).eval();
  PetscFunctionReturn(0);
}

/* ---- normal modes ---- */

static double Eigenvalue(double frequency) { return std::pow(2 * PETSC_PI * frequency, 2); }

static PetscErrorCode Want(const Pencil &pencil, const Reduction &reduction, MPI_Comm comm, bool print,
                           WantedModes *wanted)
{
  PetscFunctionBegin;
  wanted->count = reduction.modes;
  if (reduction.modes != PETSC_DEFAULT) PetscFunctionReturn(0);
  Phase phase(comm, print);
  PetscCall(phase.begin("count of modes"));
  wanted->below = Eigenvalue(reduction.max_frequency);
  PetscCall(CountBelow(pencil, wanted->below, &wanted->count));
  PetscCheck(wanted->count >= 0, comm, PETSC_ERR_SUP,
             "Reduction::modes = PETSC_DEFAULT needs the inertia of a factorization, which the solver chosen by "
             "options does not give; set the number of modes");
  PetscCall(phase.end(std::to_string(wanted->count) + " modes below " + std::to_string(reduction.max_frequency)));
  PetscFunctionReturn(0);
}

/* Those above the bound are not wanted */
static void CutAbove(double max_frequency, NormalModes *modes)
{
  while (max_frequency > 0 && modes->wanted > 0 && modes->lambda[modes->wanted - 1] > Eigenvalue(max_frequency))
    modes->wanted--;
}

/* The first `wanted` modes of those in the last columns of the space. Where the cut goes through equal frequencies,
   which of their combinations stay must not depend on the ranks. */
static PetscErrorCode CutModes(const FeModel &model, const BodyScales &scales, const NormalModes &modes,
                               ReductionSpace *space)
{
  const PetscInt n = (PetscInt)modes.lambda.size(), before = (PetscInt)space->x.cols() - n;
  PetscInt       from = modes.wanted, to = modes.wanted;

  PetscFunctionBegin;
  if (from == n) PetscFunctionReturn(0);
  while (from > 0 && EqualFrequencies(modes.lambda[from - 1], modes.lambda[from])) from--;
  while (to < n && EqualFrequencies(modes.lambda[to - 1 < from ? from : to - 1], modes.lambda[to])) to++;
  if (from < modes.wanted && to > modes.wanted)
    PetscCall(TurnEqual(model, scales, before + from, before + to, &space->x, &space->motion));
  space->x.conservativeResize(Eigen::NoChange, before + modes.wanted);
  space->motion.conservativeResize(Eigen::NoChange, before + modes.wanted);
  PetscFunctionReturn(0);
}

static PetscErrorCode FindNormalModes(const FeModel &model, const Pencil &pencil, const Reduction &reduction,
                                      WantedModes wanted, KSP *ksp, NormalModes *modes)
{
  Phase phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(phase.begin("normal modes"));
  PetscCall(FindModes(pencil, wanted, ksp, modes));
  CutAbove(reduction.max_frequency, modes);
  PetscCall(phase.end(std::to_string(modes->wanted) + " modes, " + modes->how));
  PetscFunctionReturn(0);
}

PetscErrorCode CraigBamptonSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                                 const BodyScales &scales, ReductionSpace *space)
{
  const PetscInt n = 6 * (PetscInt)tied.size();
  Interior       in;
  WantedModes    wanted;
  NormalModes    normal;
  KSP            ksp;
  Phase          phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(CreateInterior(model, tied, scales, &in));
  if (reduction.method == Method::CraigBampton)
    PetscCall(Want(in.pencil, reduction, model.comm, reduction.progress, &wanted));

  PetscCall(phase.begin("factorization"));
  PetscCall(FactorInterior(model, in, scales, &ksp));
  PetscInt unknowns;
  PetscCall(MatGetSize(in.pencil.K, &unknowns, nullptr));
  PetscCall(phase.end(std::to_string(unknowns) + " unknowns"));

  PetscCall(phase.begin("constraint modes"));
  space->x.resize(3 * model.own, n);
  PetscCall(ConstraintModes(model, tied, in, ksp, &space->x));
  PetscCall(phase.end(std::to_string(n) + " modes"));

  PetscCall(FindNormalModes(model, in.pencil, reduction, wanted, &ksp, &normal));
  const PetscInt m = (PetscInt)normal.lambda.size();
  space->x.conservativeResize(Eigen::NoChange, n + m);
  space->x.rightCols(m).setZero();
  for (PetscInt k = 0; k < m; k++)
    for (std::size_t i = 0; i < in.dof.size(); i++) space->x(in.dof[i], n + k) = normal.x(i, k);
  space->motion.setZero(n, n + m);
  space->motion.leftCols(n).setIdentity();
  PetscCall(CutModes(model, scales, normal, space));
  space->holds_rigid = true;
  PetscFunctionReturn(0);
}

/* ---- free-free ---- */

/* P: displacements of all nodes by free dofs and, at the end of the owner's part, the motions of rigid attachments */
static PetscErrorCode CreateTies(const FeModel &model, const std::vector<Tied> &tied, const std::vector<PetscInt> &dof,
                                 std::vector<PetscInt> *master, Mat *P)
{
  PetscMPIInt rank, size;
  PetscInt    mine, begin;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(model.comm, &rank));
  PetscCallMPI(MPI_Comm_size(model.comm, &size));
  std::vector<PetscInt> held(size, 0), rows(size), next(size);
  for (const Tied &t : tied)
    if (t.tie == Tie::Rigid) held[t.owner] += 6;
  mine = (PetscInt)dof.size();
  PetscCallMPI(MPI_Allgather(&mine, 1, MPIU_INT, rows.data(), 1, MPIU_INT, model.comm));
  for (PetscMPIInt r = 0, start = 0; r < size; r++) {
    next[r] = start + rows[r];
    start += rows[r] + held[r];
  }
  begin = next[rank] - mine;
  PetscCall(CreateEmpty(model.comm, 3 * model.own, mine + held[rank], P));
  PetscCall(MatSeqAIJSetPreallocation(*P, 6, nullptr));
  PetscCall(MatMPIAIJSetPreallocation(*P, 6, nullptr, 6, nullptr));
  for (std::size_t i = 0; i < dof.size(); i++)
    PetscCall(MatSetValue(*P, 3 * model.first + dof[i], begin + (PetscInt)i, 1., INSERT_VALUES));
  for (const Tied &t : tied) {
    master->push_back(t.tie == Tie::Rigid ? next[t.owner] : -1);
    if (t.tie != Tie::Rigid) continue;
    for (PetscInt i : t.node) {
      const Eigen::Matrix<double, 3, 6> u = RigidMotion(NodePosition(model, i), t.position);
      for (int c = 0; c < 3; c++)
        for (int k = 0; k < 6; k++)
          PetscCall(MatSetValue(*P, 3 * (model.first + i) + c, next[t.owner] + k, u(c, k), INSERT_VALUES));
    }
    next[t.owner] += 6;
  }
  PetscCall(MatAssemblyBegin(*P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*P, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

/* The rigid motions in dofs of the tied model */
static void TiedRigid(const FeModel &model, const std::vector<Tied> &tied, const std::vector<PetscInt> &dof,
                      const BodyScales &scales, PetscMPIInt rank, MatrixXd *r)
{
  PetscInt next = (PetscInt)dof.size();
  PetscInt rows = next;
  for (const Tied &t : tied) rows += t.tie == Tie::Rigid && t.owner == rank ? 6 : 0;
  r->resize(rows, 6);
  for (std::size_t i = 0; i < dof.size(); i++) r->row(i) = scales.rigid.row(dof[i]);
  for (const Tied &t : tied) {
    if (t.tie != Tie::Rigid || t.owner != rank) continue;
    r->middleRows(next, 3)     = RigidMotion(t.position, scales.center) * scales.frame;
    r->middleRows(next + 3, 3) = scales.frame.bottomRows<3>();
    next += 6;
  }
  (void)model;
}

static bool AnyRigid(const std::vector<Tied> &tied)
{
  return std::any_of(tied.begin(), tied.end(), [](const Tied &t) { return t.tie == Tie::Rigid; });
}

/* Modes of the tied model to those of all nodes, and the motions of rigid attachments, which the owners have */
static PetscErrorCode Expand(const FeModel &model, const std::vector<Tied> &tied, Mat P,
                             const std::vector<PetscInt> &master, const NormalModes &modes, ReductionSpace *space)
{
  PetscInt begin, end;

  PetscFunctionBegin;
  space->motion.setZero(6 * tied.size(), modes.lambda.size());
  if (!P) {
    space->x = modes.x;
    PetscFunctionReturn(0);
  }
  PetscCall(Multiply(P, modes.x, &space->x));
  PetscCall(MatGetOwnershipRangeColumn(P, &begin, &end));
  for (std::size_t a = 0; a < tied.size(); a++)
    if (master[a] >= begin && master[a] < end)
      space->motion.middleRows(6 * a, 6) = modes.x.middleRows(master[a] - begin, 6);
  PetscCall(SumOverRanks(model.comm, &space->motion));
  PetscFunctionReturn(0);
}

PetscErrorCode FreeFreeSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                             const BodyScales &scales, ReductionSpace *space)
{
  const std::vector<PetscInt> dof = FreeDofs(model, tied);
  std::vector<PetscInt>       master;
  Pencil                      pencil;
  Mat                         P   = nullptr;
  KSP                         ksp = nullptr;
  WantedModes                 wanted;
  NormalModes                 modes;
  PetscMPIInt                 rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(model.comm, &rank));
  pencil.K = model.K;
  pencil.M = model.M;
  if (AnyRigid(tied)) {
    PetscCall(CreateTies(model, tied, dof, &master, &P));
    PetscCall(MatPtAP(model.K, P, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &pencil.K));
    PetscCall(MatPtAP(model.M, P, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &pencil.M));
  }
  TiedRigid(model, tied, dof, scales, rank, &pencil.rigid);
  PetscCall(MatGetSize(pencil.K, &pencil.modes, nullptr));
  PetscCall(Want(pencil, reduction, model.comm, reduction.progress, &wanted));
  wanted.shift = -0.05 * scales.soft;
  PetscCall(FindNormalModes(model, pencil, reduction, wanted, &ksp, &modes));
  PetscCall(Expand(model, tied, P, master, modes, space));
  PetscCall(CutModes(model, scales, modes, space));
  space->holds_rigid = false;
  if (P) {
    PetscCall(MatDestroy(&pencil.K));
    PetscCall(MatDestroy(&pencil.M));
    PetscCall(MatDestroy(&P));
  }
  PetscFunctionReturn(0);
}

/* ---- residuals ---- */

PetscErrorCode TiedNorms(const FeModel &model, const std::vector<Tied> &tied, double length, const MatrixXd &r,
                         VectorXd *norms)
{
  const std::vector<PetscInt> dof = FreeDofs(model, tied);
  MatrixXd resultant = MatrixXd::Zero(6 * tied.size(), r.cols()), squares = MatrixXd::Zero(1, r.cols());

  PetscFunctionBegin;
  for (PetscInt i : dof) squares += r.row(i).cwiseAbs2();
  for (std::size_t a = 0; a < tied.size(); a++)
    for (PetscInt i : tied[a].node)
      if (tied[a].tie == Tie::Rigid)
        resultant.middleRows(6 * a, 6) +=
            RigidMotion(NodePosition(model, i), tied[a].position).transpose() * r.middleRows(3 * i, 3);
  PetscCall(SumOverRanks(model.comm, &squares));
  PetscCall(SumOverRanks(model.comm, &resultant));
  for (std::size_t a = 0; a < tied.size(); a++) resultant.middleRows(6 * a + 3, 3) /= length;
  *norms = (squares + resultant.colwise().squaredNorm()).transpose().cwiseSqrt();
  PetscFunctionReturn(0);
}

} // namespace hhtdae
