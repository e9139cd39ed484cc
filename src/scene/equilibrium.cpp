/*
  Static equilibrium: Q(q, 0) - Phi_q^T lambda = 0, Phi = 0 with all velocities, accelerations and rates of states zero.

  Implicit Euler steps from rest, one Newton correction each, with velocities set to zero after every step:

    (M/h^2 + C/h + K) dq + Phi_q^T dlambda = -F,   Phi_q dq = -Phi

  which is the scene's Jacobian with sigma_v = 1/h and sigma_a = 1/h^2. Small steps slide downhill however far from
  equilibrium, large ones are Newton's method; h grows as the unbalanced forces fall and shrinks where a step would go
  too far.
*/
#include "extension.h"
#include "start.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

namespace
{

constexpr int    most_iterations = 2000;
constexpr double balanced       = 1e-10; /* of forces, times the largest of the scene; of constraints, times its size */
constexpr double largest_turn   = 0.25;  /* in one step: radians, parts of the scene's size */
constexpr double largest_growth = 8, longest = 1e6; /* of h: in one step, and from its first value */

/* The largest force that nothing balances, and on which body; moments as forces at the scene's size */
struct Unbalanced {
  double   force = 0, misfit = 0, other = 0;
  double   step = INFINITY; /* the last one: radians, parts of the scene's size */
  PetscInt body = -1;
};

struct Equilibrium {
  Runtime &R;
  Vec      U = nullptr, V = nullptr, zero = nullptr, F = nullptr, d = nullptr, next = nullptr;
  Mat      J   = nullptr;
  KSP      ksp = nullptr;
  double   size, scale = 0; /* of lengths, of forces */

  explicit Equilibrium(Runtime &r) : R(r), size(SceneSize(r.scene)) {}
  ~Equilibrium()
  {
    PetscCallAbort(PETSC_COMM_SELF, KSPDestroy(&ksp));
    PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&J));
    for (Vec *x : {&U, &V, &zero, &F, &d, &next}) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(x));
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

/* As the integrator would: KLU where it is there, which it is on one rank alone */
PetscErrorCode ChoosePackage(Mat J, PC pc)
{
  PetscFunctionBegin;
  for (const char *package : {"klupair", MATSOLVERKLU, MATSOLVERMUMPS, MATSOLVERSUPERLU_DIST}) {
    PetscBool is;
    PetscCall(MatGetFactorAvailable(J, package, MAT_FACTOR_LU, &is));
    if (!is) continue;
    PetscCall(PCFactorSetMatSolverType(pc, package));
    break;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Create(Equilibrium &E)
{
  Runtime  &R = E.R;
  PC        pc;
  PetscFunctionBegin;
  PetscCall(VecCreate(R.scene.comm, &E.U));
  PetscCall(VecSetSizes(E.U, R.n, PETSC_DETERMINE));
  PetscCall(VecSetType(E.U, VECSTANDARD));
  for (Vec *x : {&E.V, &E.zero, &E.F, &E.d, &E.next}) PetscCall(VecDuplicate(E.U, x));
  PetscCall(InitialState(R, E.U, E.V));
  PetscCall(VecSet(E.V, 0));
  PetscCall(VecSet(E.zero, 0));
  PetscCall(MatDuplicate(R.J, MAT_DO_NOT_COPY_VALUES, &E.J));
  PetscCall(KSPCreate(R.scene.comm, &E.ksp));
  PetscCall(KSPSetOptionsPrefix(E.ksp, "scene_equilibrium_"));
  PetscCall(KSPSetType(E.ksp, KSPPREONLY));
  PetscCall(KSPSetOperators(E.ksp, E.J, E.J));
  PetscCall(KSPGetPC(E.ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(ChoosePackage(E.J, pc));
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

/* The deformation of flexible bodies, from their owners to every rank */
PetscErrorCode WriteBackModes(Runtime &R, const PetscScalar *u)
{
  SceneData &s = R.scene;
  PetscFunctionBegin;
  for (std::size_t b = 0; b < s.bodies.size(); b++) {
    if (!s.bodies[b].flexible) continue;
    auto              f     = std::make_shared<FlexibleData>(*s.bodies[b].flexible);
    const PetscMPIInt owner = R.number.owner.empty() ? 0 : R.number.owner[b];
    if (owner == R.rank) {
      const PetscScalar *eta = u + R.number.body[b] - R.start + 6;
      std::copy(eta, eta + f->deformation.size(), f->deformation.begin());
    }
    PetscCallMPI(MPI_Bcast(f->deformation.data(), (PetscMPIInt)f->deformation.size(), MPI_DOUBLE, owner, s.comm));
    std::fill(f->deformation_rate.begin(), f->deformation_rate.end(), 0.0);
    s.bodies[b].flexible = f;
  }
  PetscFunctionReturn(0);
}

/* Poses out of U into the description of every rank, at rest; initial values of variables and states too */
PetscErrorCode WriteBack(Equilibrium &E)
{
  Runtime                 &R     = E.R;
  SceneData               &s     = R.scene;
  const int                width = 13; /* body, position, attitude */
  const PetscScalar       *u, *v;
  const double            *local[3];
  std::vector<double>      mine, all;
  std::vector<PetscMPIInt> count(R.size), from(R.size + 1, 0);
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(E.U, &u));
  PetscCall(VecGetArrayRead(E.zero, &v));
  PetscCall(LocalState(R, u, v, v, local));
  R.bodies.move(local[0], local[1]);
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const BodyMotion &m = R.bodies.now[b];
    mine.push_back((double)R.bodies.body[b].id);
    mine.insert(mine.end(), m.r.data(), m.r.data() + 3);
    const BodyKind kind  = R.bodies.body[b].kind;
    const bool     turns = HasEulerAngles(kind) || kind == BodyKind::Planar;
    const Matrix3  A     = turns ? m.A : s.bodies[R.bodies.body[b].id].A;
    mine.insert(mine.end(), A.data(), A.data() + 9);
  }
  std::vector<double> scalars(s.variables.size() + s.states.size(), 0), sum(scalars.size());
  for (std::size_t i = 0; i < s.variables.size(); i++)
    if (R.number.variable_owner[i] == R.rank) scalars[i] = u[R.number.variable[i] - R.start];
  for (std::size_t i = 0; i < s.states.size(); i++)
    if (R.number.state_owner[i] == R.rank) scalars[s.variables.size() + i] = u[R.number.state[i] - R.start];
  PetscCall(WriteBackModes(R, u));
  for (auto &x : s.extensions) x->rest(u + x->start[R.rank] - R.start);
  PetscCall(VecRestoreArrayRead(E.zero, &v));
  PetscCall(VecRestoreArrayRead(E.U, &u));
  const PetscMPIInt n = (PetscMPIInt)mine.size();
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, count.data(), 1, MPI_INT, s.comm));
  for (PetscMPIInt r = 0; r < R.size; r++) from[r + 1] = from[r] + count[r];
  all.resize(from[R.size]);
  PetscCallMPI(MPI_Allgatherv(mine.data(), n, MPI_DOUBLE, all.data(), count.data(), from.data(), MPI_DOUBLE, s.comm));
  for (std::size_t k = 0; k < all.size(); k += width) {
    BodyData &b = s.bodies[(std::size_t)all[k]];
    b.r         = Eigen::Map<const Vector3>(&all[k + 1]);
    b.A         = Eigen::Map<const Matrix3>(&all[k + 4]);
    b.v.setZero();
    b.w.setZero();
  }
  if (!sum.empty())
    PetscCallMPI(MPI_Allreduce(scalars.data(), sum.data(), (PetscMPIInt)sum.size(), MPI_DOUBLE, MPI_SUM, s.comm));
  for (std::size_t i = 0; i < s.variables.size(); i++) s.variables[i].initial = sum[i];
  for (std::size_t i = 0; i < s.states.size(); i++) s.states[i].initial = sum[s.variables.size() + i];
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
  PetscCall(WriteBack(E));
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

/* One step; false if it would go too far or cannot be computed */
PetscErrorCode Step(Equilibrium &E, double h, bool *good, Unbalanced &after)
{
  const double       t = E.R.scene.start.time;
  KSPConvergedReason reason;
  double             reach;
  PetscFunctionBegin;
  *good = false;
  PetscCall(Residual(E.R, t, E.U, E.zero, E.zero, E.F));
  PetscCall(Jacobian(E.R, t, E.U, E.zero, E.zero, 1 / h, 1 / (h * h), E.J));
  PetscCall(KSPSolve(E.ksp, E.F, E.d));
  PetscCall(KSPGetConvergedReason(E.ksp, &reason));
  if (reason < 0) PetscFunctionReturn(0);
  PetscCall(Reach(E, E.d, &reach));
  if (!(reach <= 1)) PetscFunctionReturn(0);
  PetscCall(VecWAXPY(E.next, -1, E.d, E.U));
  PetscCall(Residual(E.R, t, E.next, E.zero, E.zero, E.F));
  PetscCall(MeasureForces(E, E.F, after));
  if (!std::isfinite(after.force + after.misfit + after.other)) PetscFunctionReturn(0);
  PetscCall(VecCopy(E.next, E.U));
  after.step = reach * largest_turn;
  *good      = true;
  PetscFunctionReturn(0);
}

/* Stiff springs leave rounding that is no small part of the weights: there it is the step that has to vanish. */
bool Balanced(const Equilibrium &E, const Unbalanced &at, double h)
{
  if (!(at.misfit <= balanced * E.size && at.other <= 1e-8 * std::max(1.0, E.scale))) return false;
  return at.force <= balanced * E.scale || (at.force <= 1e-5 * E.scale && at.step <= 1e-12 && h >= 1e3);
}

PetscErrorCode Relax(Equilibrium &E, bool *found, Unbalanced &at)
{
  SceneData &s = E.R.scene;
  double     h = 0, first;
  bool       good;
  PetscFunctionBegin;
  PetscCall(Scales(E, &h));
  first    = h;
  at.force = E.scale;
  *found   = false;
  for (int it = 0; it < most_iterations && !*found && h > 1e-12 * first; it++) {
    const double before = at.force;
    PetscCall(Step(E, h, &good, at));
    s.started.equilibrium_iterations++;
    if (!good) {
      h /= 4;
      continue;
    }
    PetscCall(PetscInfo(nullptr, "scene: equilibrium %d: h = %g, unbalanced %g of %g, constraints %g\n", it, h,
                        at.force, E.scale, at.misfit));
    *found = Balanced(E, at, h / first);
    h = std::min(longest * first, h * std::min(largest_growth, std::max(0.5, before / std::max(at.force, 1e-300))));
    PetscCall(RenewAxes(E));
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FindEquilibrium(Runtime &R)
{
  SceneData              &s         = R.scene;
  const std::vector<Pose> before    = Poses(s);
  const auto              variables = s.variables, states = s.states;
  Equilibrium             E(R);
  Unbalanced              at;
  bool                    found     = false;
  PetscFunctionBegin;
  PetscCall(Create(E));
  PetscCall(Relax(E, &found, at));
  if (!found) {
    SetPoses(s, before);
    s.variables = variables;
    s.states    = states;
    SETERRQ(s.comm, PETSC_ERR_CONV_FAILED,
            "no static equilibrium found in %d steps: a force of %g (moments over the scene's size) is left on %s, "
            "constraints are violated by %g.\n"
            "Start nearer to it, or hold what is free to move for ever",
            (int)s.started.equilibrium_iterations, at.force, s.bodyName(at.body).c_str(), at.misfit);
  }
  PetscCall(WriteBack(E));
  PetscCall(ReportMoves(s, before, "equilibrium"));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
