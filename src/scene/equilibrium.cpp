/*
  Static equilibrium: Q(q, 0) - Phi_q^T lambda = 0, Phi = 0 with all velocities, accelerations and rates of states zero.

  Implicit Euler steps from rest, one Newton correction each if it is good enough, with velocities set to zero after
  every step:

    (M/h^2 + C/h + K) dq + Phi_q^T dlambda = -F,   Phi_q dq = -Phi

  which is the scene's Jacobian with sigma_v = 1/h and sigma_a = 1/h^2. Small steps slide downhill however far from
  equilibrium, large ones are Newton's method; h grows as the unbalanced forces fall and shrinks where a step would go
  too far or has gone uphill.
*/
#include "extension.h"
#include "runtime.h"
#include "start.h"
#include <algorithm>
#include <cmath>
#include <numeric>

namespace hhtdae
{

namespace
{

constexpr int    most_iterations = 2000;
constexpr double balanced       = 1e-10; /* of forces, times the largest of the scene; of constraints, times its size */
constexpr double largest_turn   = 0.25;  /* in one step: radians, parts of the scene's size */
constexpr double largest_growth = 8, longest = 1e6; /* of h: in one step, and from its first value */
constexpr double downhill_growth = 2, hollow = 0.999; /* of h in a hollow: where forces fall to this part in a step */
constexpr double rounding = 1e-5, at_rest = 1e-9;  /* forces that may be rounding, if a step moves no more than this */
constexpr int    most_corrections = 6;             /* in one step after the first; they end when */
constexpr double solved = 0.3, corrected = 0.05;   /* this part of the forces is left, or of the step was the last */

/* The largest force that nothing balances, and on which body; moments as forces at the scene's size */
struct Unbalanced {
  double   force = 0, misfit = 0, other = 0;
  double   step = INFINITY; /* the last one: radians, parts of the scene's size */
  PetscInt body = -1;
};

/* What became of a step: how far it went, and the work over it of the forces that were left before and after it */
struct Attempt {
  bool   good        = false;
  int    corrections = 0; /* after the first */
  double reach = INFINITY, work[2] = {0, 0};
};

struct Equilibrium {
  Model   &M;
  Runtime &R;
  Vec      U = nullptr, V = nullptr, A = nullptr, zero = nullptr, F = nullptr, start = nullptr, d = nullptr, next = nullptr;
  Mat      J   = nullptr;
  KSP      ksp = nullptr;
  double   size, scale = 0; /* of lengths, of forces */

  Equilibrium(Model &m, Runtime &r) : M(m), R(r), size(SceneSize(m.scene)) {}
  ~Equilibrium()
  {
    PetscCallAbort(PETSC_COMM_SELF, KSPDestroy(&ksp));
    PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&J));
    for (Vec *x : {&U, &V, &A, &zero, &F, &start, &d, &next}) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(x));
  }
};

/* Only bodies' coordinates are compared with forces, only holonomic rows with lengths; what is left are definitions and
 * states */
PetscErrorCode MeasureForces(Equilibrium &E, Vec F, Unbalanced &out)
{
  Runtime           &R = E.R;
  const PetscScalar *f;
  struct {
    double value;
    int    body;
  } mine{0, -1}, worst;
  double rest[2] = {0, 0}, most[2];
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(F, &f));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k          = R.bodies.body[b];
    const int        directions = PlanarScene(k.kind) ? 2 : 3;
    for (int c = 0; c < R.bodies.coordinates(b); c++) {
      const double x = std::abs(f[k.first + c]) / (c < directions ? 1 : E.size);
      if (x > mine.value || std::isnan(x)) mine = {x, (int)k.id};
    }
  }
  for (const auto &e : R.scene.extensions) {
    const PetscScalar *g = f + e->start[R.rank] - R.start;
    for (PetscInt i = 0; i < e->coordinates(); i++)
      if (!(std::abs(g[i]) <= mine.value)) mine = {std::abs(g[i]), -1};
  }
  for (TSHHT3Role r : {TSHHT3_HOLONOMIC, TSHHT3_NONHOLONOMIC, TSHHT3_VARIABLE, TSHHT3_FORCE, TSHHT3_STATE}) {
    const PetscInt *i;
    PetscInt        n;
    PetscCall(ISGetLocalSize(R.roles[r], &n));
    PetscCall(ISGetIndices(R.roles[r], &i));
    double &largest = rest[r == TSHHT3_HOLONOMIC ? 0 : 1];
    for (PetscInt k = 0; k < n; k++) largest = std::max(largest, std::abs(f[i[k] - R.start]));
    PetscCall(ISRestoreIndices(R.roles[r], &i));
  }
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCallMPI(MPI_Allreduce(&mine, &worst, 1, MPI_DOUBLE_INT, MPI_MAXLOC, R.scene.comm));
  PetscCallMPI(MPI_Allreduce(rest, most, 2, MPI_DOUBLE, MPI_MAX, R.scene.comm));
  out.force  = worst.value;
  out.body   = worst.body;
  out.misfit = most[0];
  out.other  = most[1];
  PetscFunctionReturn(0);
}

} // namespace

/* As the integrator would: KLU where it is there, which it is on one rank alone; of one triangle MUMPS, which reads it */
PetscErrorCode ChoosePackage(Mat J, PC pc, bool triangle)
{
  PetscFunctionBegin;
  for (const char *package : {"klupair", MATSOLVERKLU, "mumpsnd", MATSOLVERMUMPS, MATSOLVERSUPERLU_DIST}) {
    PetscBool is, ours;
    PetscCall(PetscStrcmp(package, "mumpsnd", &ours));
    if (ours && !triangle) continue;
    PetscCall(MatGetFactorAvailable(J, package, triangle ? MAT_FACTOR_CHOLESKY : MAT_FACTOR_LU, &is));
    if (!is) continue;
    PetscCall(PCFactorSetMatSolverType(pc, package));
    break;
  }
  PetscFunctionReturn(0);
}

namespace
{

PetscErrorCode Create(Equilibrium &E)
{
  Runtime  &R = E.R;
  PC        pc;
  PetscFunctionBegin;
  PetscCall(VecCreate(R.scene.comm, &E.U));
  PetscCall(VecSetSizes(E.U, R.n, PETSC_DETERMINE));
  PetscCall(VecSetType(E.U, VECSTANDARD));
  for (Vec *x : {&E.V, &E.A, &E.zero, &E.F, &E.start, &E.d, &E.next}) PetscCall(VecDuplicate(E.U, x));
  PetscCall(InitialState(R, E.U, E.V));
  PetscCall(VecSet(E.V, 0));
  PetscCall(VecSet(E.zero, 0));
  PetscCall(MatDuplicate(R.J, MAT_DO_NOT_COPY_VALUES, &E.J));
  PetscCall(KSPCreate(R.scene.comm, &E.ksp));
  PetscCall(KSPSetOptionsPrefix(E.ksp, "scene_equilibrium_"));
  PetscCall(KSPSetType(E.ksp, KSPPREONLY));
  PetscCall(KSPSetOperators(E.ksp, E.J, E.J));
  PetscCall(KSPGetPC(E.ksp, &pc));
  PetscCall(PCSetType(pc, R.triangle ? PCCHOLESKY : PCLU));
  PetscCall(ChoosePackage(E.J, pc, R.triangle));
  PetscCall(KSPSetFromOptions(E.ksp));
  PetscFunctionReturn(0);
}

/* The largest move of a body in d, as a part of what one step may do */
PetscErrorCode Reach(const Equilibrium &E, Vec d, double *reach)
{
  const Runtime     &R = E.R;
  const PetscScalar *x;
  double             mine = 0;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(d, &x));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k          = R.bodies.body[b];
    const int        directions = PlanarScene(k.kind) ? 2 : 3;
    for (int c = 0; c < Coordinates(k.kind); c++) {
      const double y = std::abs(x[k.first + c]) / (c < directions ? E.size : 1) / largest_turn;
      mine           = std::isnan(y) ? INFINITY : std::max(mine, y);
    }
  }
  for (const auto &e : R.scene.extensions) {
    const PetscScalar *g = x + e->start[R.rank] - R.start;
    for (PetscInt i = 0; i < e->coordinates(); i++) {
      const double y = std::abs(g[i]) / E.size / largest_turn;
      mine           = std::isnan(y) ? INFINITY : std::max(mine, y);
    }
  }
  PetscCall(VecRestoreArrayRead(d, &x));
  PetscCallMPI(MPI_Allreduce(&mine, reach, 1, MPI_DOUBLE, MPI_MAX, R.scene.comm));
  PetscFunctionReturn(0);
}

/* New axes for all bodies once one of them nears the singularity; multipliers and force states stay */
PetscErrorCode RenewAxes(Equilibrium &E)
{
  Runtime           &R = E.R;
  const PetscScalar *u;
  PetscScalar       *x;
  PetscBool          mine = PETSC_FALSE, any;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(E.U, &u));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (HasEulerAngles(k.kind) && std::abs(std::sin(u[k.first + 4])) < singular_sine) mine = PETSC_TRUE;
  }
  PetscCall(VecRestoreArrayRead(E.U, &u));
  PetscCallMPI(MPI_Allreduce(&mine, &any, 1, MPIU_BOOL, MPI_LOR, R.scene.comm));
  if (!any) PetscFunctionReturn(0);
  PetscCall(WriteState(E.M, R, E.U, nullptr));
  PetscCall(InitialState(R, E.next, E.V));
  PetscCall(VecSet(E.V, 0));
  PetscCall(VecGetArrayRead(E.next, &u));
  PetscCall(VecGetArray(E.U, &x));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    std::copy(u + k.first, u + k.first + R.bodies.coordinates(b), x + k.first);
  }
  PetscCall(VecRestoreArray(E.U, &x));
  PetscCall(VecRestoreArrayRead(E.next, &u));
  PetscFunctionReturn(0);
}

/* What forces are held against: weights and whatever acts at the start; and a time in which they move things a little
 */
PetscErrorCode Scales(Equilibrium &E, double *h)
{
  const SceneData &s = E.R.scene;
  Unbalanced       at;
  double           lightest = INFINITY;
  PetscFunctionBegin;
  PetscCall(Residual(E.R, s.start.time, E.U, E.zero, E.zero, E.F));
  PetscCall(MeasureForces(E, E.F, at));
  E.scale = at.force;
  for (const BodyData &b : s.bodies) {
    E.scale  = std::max(E.scale, b.mass * s.gravity.norm());
    if (!b.massless) lightest = std::min(lightest, b.mass);
  }
  if (lightest == INFINITY)
    for (const BodyData &b : s.bodies) lightest = std::min(lightest, b.light_mass);
  *h = E.scale > 0 && std::isfinite(lightest) ? 0.1 * std::sqrt(E.size * lightest / E.scale) : 1;
  PetscFunctionReturn(0);
}

/* Work of the forces in F over d, on bodies and on what other libraries add: constraints and definitions have none */
PetscErrorCode Work(const Equilibrium &E, Vec F, Vec d, double *work)
{
  const Runtime     &R = E.R;
  const PetscScalar *f, *x;
  double             mine = 0;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(F, &f));
  PetscCall(VecGetArrayRead(d, &x));
  const auto add = [&](PetscInt first, PetscInt n) { mine += std::inner_product(f + first, f + first + n, x + first, 0.0); };
  for (PetscInt b = 0; b < R.bodies.own; b++) add(R.bodies.body[b].first, R.bodies.coordinates(b));
  for (const auto &e : R.scene.extensions) add(e->start[R.rank] - R.start, e->coordinates());
  PetscCall(VecRestoreArrayRead(d, &x));
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCallMPI(MPI_Allreduce(&mine, work, 1, MPI_DOUBLE, MPI_SUM, R.scene.comm));
  PetscFunctionReturn(0);
}

/* d = J^-1 F, next less d; the reach of d is infinite if there is none */
PetscErrorCode Newton(Equilibrium &E, double *reach)
{
  KSPConvergedReason reason;
  PetscFunctionBegin;
  E.M.scene.started.equilibrium_iterations++;
  *reach = INFINITY;
  PetscCall(KSPSolve(E.ksp, E.F, E.d));
  PetscCall(KSPGetConvergedReason(E.ksp, &reason));
  if (reason < 0) PetscFunctionReturn(0);
  PetscCall(Reach(E, E.d, reach));
  if (*reach <= 1) PetscCall(VecAXPY(E.next, -1, E.d));
  PetscFunctionReturn(0);
}

/* F: what is left of the equations of the step from U to next */
PetscErrorCode StepResidual(Equilibrium &E, double h, Unbalanced &left)
{
  PetscFunctionBegin;
  PetscCall(VecWAXPY(E.V, -1, E.U, E.next));
  PetscCall(VecScale(E.V, 1 / h));
  PetscCall(VecCopy(E.V, E.A));
  PetscCall(VecScale(E.A, 1 / h));
  PetscCall(Residual(E.R, E.R.scene.start.time, E.next, E.V, E.A, E.F));
  PetscCall(MeasureForces(E, E.F, left));
  PetscFunctionReturn(0);
}

/*
  More corrections where the first has raised the unbalanced forces. It moves thin parts along straight lines, which
  stretches them: forces that say nothing of how far equilibrium is and would only make h fall.
*/
PetscErrorCode Correct(Equilibrium &E, double h, double before, Attempt &a, Unbalanced &after)
{
  const double t    = E.R.scene.start.time;
  double       last = a.reach;
  Unbalanced   left;
  PetscFunctionBegin;
  for (a.corrections = 0;; a.corrections++) {
    PetscCall(Residual(E.R, t, E.next, E.zero, E.zero, E.F));
    PetscCall(MeasureForces(E, E.F, after));
    if (!std::isfinite(after.force + after.misfit + after.other)) PetscFunctionReturn(0);
    if (after.force <= before || a.reach * largest_turn <= at_rest || last <= corrected * a.reach) break;
    PetscCall(StepResidual(E, h, left));
    if (left.force <= solved * before) break;
    if (a.corrections == most_corrections) PetscFunctionReturn(0);
    PetscCall(Jacobian(E.R, t, E.next, E.V, E.A, 1 / h, 1 / (h * h), E.J));
    PetscCall(Newton(E, &last));
    if (!(last <= a.reach)) PetscFunctionReturn(0);
  }
  a.good = true;
  PetscFunctionReturn(0);
}

/* One step from forces before; not good if it would go too far or cannot be computed */
PetscErrorCode Step(Equilibrium &E, double h, double before, Attempt &a, Unbalanced &after)
{
  const double t = E.R.scene.start.time;
  PetscFunctionBegin;
  a = Attempt();
  PetscCall(Residual(E.R, t, E.U, E.zero, E.zero, E.F));
  PetscCall(VecCopy(E.F, E.start));
  PetscCall(Jacobian(E.R, t, E.U, E.zero, E.zero, 1 / h, 1 / (h * h), E.J));
  PetscCall(VecCopy(E.U, E.next));
  PetscCall(Newton(E, &a.reach));
  if (!(a.reach <= 1)) PetscFunctionReturn(0);
  PetscCall(Correct(E, h, before, a, after));
  if (!a.good) PetscFunctionReturn(0);
  PetscCall(VecWAXPY(E.d, -1, E.next, E.U));
  PetscCall(Reach(E, E.d, &a.reach));
  PetscCall(Residual(E.R, t, E.next, E.zero, E.zero, E.F));
  PetscCall(Work(E, E.start, E.d, &a.work[0]));
  PetscCall(Work(E, E.F, E.d, &a.work[1]));
  PetscCall(VecCopy(E.next, E.U));
  after.step = a.reach * largest_turn;
  PetscFunctionReturn(0);
}

/*
  Of h: as the forces fall. Where they fall along the step as in a hollow, h need not wait for that, as long as the next
  step does not go too far: steps go as h^2 at most. Where they rise on the way down, next to a saddle, h stays. A step
  against the forces has been Newton's towards a saddle. Nor are forces to be waited for that are rounding.
*/
double Growth(const Equilibrium &E, const Attempt &a, double before, const Unbalanced &after)
{
  const double falling = std::min(largest_growth, std::max(0.5, before / std::max(after.force, 1e-300)));
  if (after.step <= at_rest) return after.force <= rounding * E.scale ? largest_growth : falling;
  if (a.work[0] <= 0) return 0.25;
  const bool in_hollow = a.work[1] > 0 && a.work[1] < hollow * a.work[0];
  return std::max(falling, in_hollow ? std::max(1.0, std::min(downhill_growth, 1 / std::sqrt(a.reach))) : 1.0);
}

/* Stiff springs leave rounding that is no small part of the weights: there it is the step that has to vanish. */
bool Balanced(const Equilibrium &E, const Unbalanced &at, double h)
{
  if (!(at.misfit <= balanced * E.size && at.other <= 1e-8 * std::max(1.0, E.scale))) return false;
  return at.force <= balanced * E.scale || (at.force <= rounding * E.scale && at.step <= 1e-12 && h >= 1e3);
}

PetscErrorCode Relax(Equilibrium &E, bool *found, Unbalanced &at)
{
  const SceneData &s = E.R.scene;
  double     h = 0, first, before;
  Attempt    a;
  PetscFunctionBegin;
  PetscCall(Scales(E, &h));
  first  = h;
  before = at.force = E.scale;
  *found = false;
  while (s.started.equilibrium_iterations < most_iterations && !*found && h > 1e-12 * first) {
    PetscCall(Step(E, h, before, a, at));
    PetscCall(PetscInfo(nullptr, "scene: equilibrium %d: h = %g%s, unbalanced %g of %g, constraints %g, step %g with %d corrections more\n",
                        (int)s.started.equilibrium_iterations, h, a.good ? "" : " refused", at.force, E.scale, at.misfit, a.reach * largest_turn,
                        a.corrections));
    if (!a.good) {
      h /= 4;
      continue;
    }
    *found = Balanced(E, at, h / first);
    h      = std::min(longest * first, h * Growth(E, a, before, at));
    before = at.force;
    PetscCall(RenewAxes(E));
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FindEquilibrium(const std::shared_ptr<Model> &M)
{
  SceneData              &s         = M->scene;
  const std::vector<Pose> before    = Poses(s);
  const auto              variables = s.variables, states = s.states;
  Runtime                 R(M);
  Equilibrium             E(*M, R);
  Unbalanced              at;
  bool                    found     = false;
  PetscFunctionBegin;
  PetscCall(Layout(R));
  PetscCall(StoreTriangle(R));
  PetscCall(Create(E));
  PetscCall(Relax(E, &found, at));
  if (!found) {
    SetPoses(s, before);
    s.variables = variables;
    s.states    = states;
    SETERRQ(s.comm, PETSC_ERR_CONV_FAILED,
            "no static equilibrium found in %d corrections: a force of %g (moments over the scene's size) is left on %s, "
            "constraints are violated by %g.\n"
            "Start nearer to it, or hold what is free to move for ever",
            (int)s.started.equilibrium_iterations, at.force, s.bodyName(at.body).c_str(), at.misfit);
  }
  PetscCall(WriteState(E.M, R, E.U, nullptr));
  PetscCall(ReportMoves(s, before, "equilibrium"));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
