/* Modes of the free body; the nodes of rigid attachments are eliminated by P^T K P and P^T M P. */
#include "craig_bampton.h"
#include "interior.h"
#include <algorithm>

namespace hhtdae
{

/* P maps free dofs and motions of rigid attachments, which are last on their owner, to displacements of all nodes. (*master)[a]: first column of attachment a, or -1 */
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

/* The rigid motions of the body in the columns' dofs of P */
static void TiedRigid(const std::vector<Tied> &tied, const std::vector<PetscInt> &dof, const BodyScales &scales,
                      PetscMPIInt rank, MatrixXd *r)
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
}

static bool AnyRigid(const std::vector<Tied> &tied)
{
  return std::any_of(tied.begin(), tied.end(), [](const Tied &t) { return t.tie == Tie::Rigid; });
}

/* Expands modes to all nodes, and extracts the motions of rigid attachments, on all ranks */
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

/* The pencil of the free body: K and M of the model or, with rigid attachments, P^T K P and P^T M P; Pt is P^T */
struct FreePencil {
  Pencil                pencil;
  Mat                   P = nullptr, Pt = nullptr;
  std::vector<PetscInt> master;

  ~FreePencil()
  {
    if (!P) return;
    for (Mat *A : {&pencil.K, &pencil.M, &P, &Pt}) PetscCallAbort(PETSC_COMM_SELF, MatDestroy(A));
  }
};

static PetscErrorCode CreateFreePencil(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                                       FreePencil *f)
{
  const std::vector<PetscInt> dof = FreeDofs(model, tied);
  PetscMPIInt                 rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(model.comm, &rank));
  f->pencil.K = model.K;
  f->pencil.M = model.M;
  if (AnyRigid(tied)) {
    PetscCall(CreateTies(model, tied, dof, &f->master, &f->P));
    PetscCall(MatTranspose(f->P, MAT_INITIAL_MATRIX, &f->Pt));
    PetscCall(MatPtAP(model.K, f->P, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &f->pencil.K));
    PetscCall(MatPtAP(model.M, f->P, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &f->pencil.M));
  }
  TiedRigid(tied, dof, scales, rank, &f->pencil.rigid);
  PetscCall(MatGetSize(f->pencil.K, &f->pencil.modes, nullptr));
  PetscFunctionReturn(0);
}

static PetscErrorCode FillSpace(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                                const FreePencil &f, const NormalModes &modes, ReductionSpace *space)
{
  PetscFunctionBegin;
  PetscCall(Expand(model, tied, f.P, f.master, modes, space));
  PetscCall(CutModes(model, scales, modes, space));
  PetscFunctionReturn(0);
}

PetscErrorCode FreeFreeSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                             const BodyScales &scales, ReductionSpace *space)
{
  FreePencil   f;
  ScopedSolver solver;
  WantedModes  wanted;
  NormalModes  normal;

  PetscFunctionBegin;
  PetscCall(CreateFreePencil(model, tied, scales, &f));
  PetscCall(Want(f.pencil, reduction, model.comm, &wanted));
  wanted.shift       = -0.05 * scales.soft;
  space->holds_rigid = false;
  const auto rows    = [&f](const MatrixXd &force, MatrixXd *tied_force) {
    PetscFunctionBegin;
    if (f.P)
      PetscCall(Multiply(f.Pt, force, tied_force));
    else
      *tied_force = force;
    PetscFunctionReturn(0);
  };
  const auto use = [&](KSP factored, NormalModes *modes) {
    PetscFunctionBegin;
    PetscCall(FillSpace(model, tied, scales, f, *modes, space));
    PetscCall(SolveSpace(model, reduction, scales, space));
    PetscCall(ModeResiduals(model, reduction, wanted.shift, factored, rows, space));
    space->x.resize(0, 0); /* frees memory for the next factorization */
    PetscFunctionReturn(0);
  };
  PetscCall(FindNormalModes(model, f.pencil, reduction, wanted, use, &solver.ksp, &normal));
  PetscCall(FillSpace(model, tied, scales, f, normal, space));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
