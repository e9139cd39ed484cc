#include "still.h"
#include "extension.h"
#include "start.h"
#include <algorithm>

namespace hhtdae
{

StillSystem::StillSystem(Runtime &r, double time) : R(r), t(time), size(SceneSize(r.scene)) {}

StillSystem::~StillSystem()
{
  PetscCallAbort(PETSC_COMM_SELF, KSPDestroy(&ksp));
  PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&J));
  for (Vec *x : {&U, &V, &A, &zero, &F, &d, &next}) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(x));
}

/* The packages are chosen in the same order as in the integrator: KLU on one rank, else MUMPS through "mumpsnd", which
   enlarges its workspace when pivots change with the length of a step (AnalysesRanks.HangingChain) */
PetscErrorCode ChoosePackage(Mat J, PC pc)
{
  PetscFunctionBegin;
  for (const char *package : {"klupair", MATSOLVERKLU, "mumpsnd", MATSOLVERMUMPS, MATSOLVERSUPERLU_DIST}) {
    PetscBool is;
    PetscCall(MatGetFactorAvailable(J, package, MAT_FACTOR_LU, &is));
    if (!is) continue;
    PetscCall(PCFactorSetMatSolverType(pc, package));
    break;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode StillSystem::create(Vec begin, const char *prefix)
{
  PC pc;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(begin, &U));
  PetscCall(VecCopy(begin, U));
  for (Vec *x : {&V, &A, &zero, &F, &d, &next}) PetscCall(VecDuplicate(U, x));
  PetscCall(VecSet(zero, 0));
  PetscCall(MatDuplicate(R.J, MAT_DO_NOT_COPY_VALUES, &J));
  PetscCall(KSPCreate(R.scene.comm, &ksp));
  PetscCall(KSPSetOptionsPrefix(ksp, prefix));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPSetOperators(ksp, J, J));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(ChoosePackage(J, pc));
  PetscCall(KSPSetFromOptions(ksp));
  PetscFunctionReturn(0);
}

/* |x|, or infinity for NaN, so that maxima are defined */
static double Size(double x) { return std::isnan(x) ? INFINITY : std::abs(x); }

PetscErrorCode StillSystem::measure(Vec x, Unbalanced &out) const
{
  const PetscScalar *f;
  struct {
    double value;
    int    body;
  } mine{0, -1}, worst;
  double rest[2] = {0, 0}, most[2];
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(x, &f));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k          = R.bodies.body[b];
    const int        directions = PlanarScene(k.kind) ? 2 : 3, whole = Coordinates(k.kind);
    const double     modal = std::sqrt(R.scene.bodies[k.id].mass); /* modes have unit modal mass: a modal force times sqrt(m) is the force on the whole mass (SmallBodies.Equilibrium) */
    for (int c = 0; c < R.bodies.coordinates(b); c++) {
      const double y = Size(f[k.first + c]) * (c < directions ? 1 : c < whole ? 1 / size : modal);
      if (y > mine.value) mine = {y, (int)k.id};
    }
  }
  for (const auto &e : R.scene.extensions) {
    const PetscScalar *g = f + e->start[R.rank] - R.start;
    for (PetscInt i = 0; i < e->coordinates(); i++)
      if (Size(g[i]) > mine.value) mine = {Size(g[i]), -1};
  }
  for (TSHHT3Role r : {TSHHT3_HOLONOMIC, TSHHT3_NONHOLONOMIC, TSHHT3_VARIABLE, TSHHT3_FORCE, TSHHT3_STATE}) {
    const PetscInt *i;
    PetscInt        n;
    PetscCall(ISGetLocalSize(R.roles[r], &n));
    PetscCall(ISGetIndices(R.roles[r], &i));
    double &largest = rest[r == TSHHT3_HOLONOMIC ? 0 : 1];
    for (PetscInt k = 0; k < n; k++)
      if (!std::binary_search(unread.begin(), unread.end(), i[k])) largest = std::max(largest, Size(f[i[k] - R.start]));
    PetscCall(ISRestoreIndices(R.roles[r], &i));
  }
  PetscCall(VecRestoreArrayRead(x, &f));
  PetscCallMPI(MPI_Allreduce(&mine, &worst, 1, MPI_DOUBLE_INT, MPI_MAXLOC, R.scene.comm));
  PetscCallMPI(MPI_Allreduce(rest, most, 2, MPI_DOUBLE, MPI_MAX, R.scene.comm));
  out.force  = worst.value;
  out.body   = worst.body;
  out.misfit = most[0];
  out.other  = most[1];
  PetscFunctionReturn(0);
}

PetscErrorCode StillSystem::reach(Vec v, double *part) const
{
  const PetscScalar *x;
  double             mine = 0;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(v, &x));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k          = R.bodies.body[b];
    const int        directions = PlanarScene(k.kind) ? 2 : 3;
    for (int c = 0; c < Coordinates(k.kind); c++) mine = std::max(mine, Size(x[k.first + c]) / (c < directions ? size : 1) / largest_turn);
  }
  for (const auto &e : R.scene.extensions) {
    const PetscScalar *g = x + e->start[R.rank] - R.start;
    for (PetscInt i = 0; i < e->coordinates(); i++) mine = std::max(mine, Size(g[i]) / size / largest_turn);
  }
  PetscCall(VecRestoreArrayRead(v, &x));
  PetscCallMPI(MPI_Allreduce(&mine, part, 1, MPI_DOUBLE, MPI_MAX, R.scene.comm));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
