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
#include "start.h"
#include "still.h"
#include <algorithm>
#include <iterator>
#include <numeric>

namespace hhtdae
{

namespace
{

constexpr int    equilibrium_iterations = 2000;
constexpr double balanced       = 1e-10; /* of forces, times the largest of the scene; of constraints, times its size */
constexpr double largest_growth = 8;  /* of h in one step */
constexpr double downhill_growth = 2; /* of h in one step on the way down a hollow */
constexpr double at_rest = 1e-9;        /* a step that moves no more than this */
constexpr double noise   = 10;          /* times the forces that rounding of the coordinates makes: no step comes nearer (Equilibrium.AMeshFarFromTheOrigin) */
constexpr double exhausted = 1e-7;                 /* of the way in the metric of energy: what a last step of a mesh may leave (Beam.test_reactions_to_small_loads) */
constexpr int    most_finishing = 4;               /* steps more of forces that count as balanced */
constexpr double slow = 1e-6;                      /* part of a step's velocities at which damping is taken */
constexpr int    most_corrections = 6;             /* in one step after the first; they end when */
constexpr double settled = 1e-8;                     /* what states, variables and motions of velocities would still do in the last step, parts of themselves */
constexpr double state_floor = 1e-6;               /* of states that are zero: their rounding is that of numbers of one */
constexpr double solved = 0.3, corrected = 0.05;   /* this part of the forces is left, or of the step was the last */

struct Equilibrium : StillSystem {
  Vec      start = nullptr, undamped = nullptr;
  double   scale = 0; /* of forces */
  double   h = 0;     /* of the last step */
  double   work = 0;  /* most of a step */
  std::vector<double> most; /* of own unknowns on the way */
  PetscInt iterations = 0;

  using StillSystem::StillSystem;
  ~Equilibrium()
  {
    for (Vec *x : {&start, &undamped}) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(x));
  }
};

/* What became of a step: how far it went, and the work over it of the forces that were left before and after it */
struct Attempt {
  bool   good        = false;
  int    corrections = 0; /* after the first */
  double reach = INFINITY, work[2] = {0, 0};
  double at_the_states_before = INFINITY; /* the second work, as if states had not changed */
};

/* The forces that rounding makes of the coordinates, and of places of bodies, which are held against those of markers (Stops.ALoadOnAStopAnywhere) */
PetscErrorCode Rounding(Equilibrium &E, double *force)
{
  Unbalanced    at;
  PetscRandom   random;
  const double *u;
  double       *d;
  PetscFunctionBegin;
  PetscCall(PetscRandomCreate(E.R.scene.comm, &random));
  PetscCall(PetscRandomSetInterval(random, -PETSC_MACHINE_EPSILON, PETSC_MACHINE_EPSILON));
  PetscCall(VecSetRandom(E.d, random));
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(VecGetArrayRead(E.U, &u));
  std::vector<double> size(u, u + E.R.n);
  PetscCall(VecRestoreArrayRead(E.U, &u));
  for (PetscInt b = 0; b < E.R.bodies.own; b++) {
    const LocalBody &k = E.R.bodies.body[b];
    for (int c = 0; c < std::min(PlanarScene(k.kind) ? 2 : 3, Coordinates(k.kind)); c++) size[k.first + c] = std::max(std::abs(size[k.first + c]), E.size);
  }
  PetscCall(VecGetArray(E.d, &d));
  for (PetscInt i = 0; i < E.R.n; i++) d[i] *= size[i];
  PetscCall(VecRestoreArray(E.d, &d));
  PetscCall(VecWAXPY(E.next, 1, E.d, E.U));
  PetscCall(Residual(E.R, E.t, E.next, E.zero, E.zero, E.start));
  PetscCall(VecAXPY(E.start, -1, E.F));
  PetscCall(E.measure(E.start, at));
  *force = at.force;
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
  PetscCall(E.residual(E.U));
  PetscCall(E.measure(E.F, at));
  E.scale = at.force;
  for (const BodyData &b : s.bodies) {
    E.scale  = std::max(E.scale, b.mass * s.gravity.norm());
    if (b.mass > 0 && !b.massless) lightest = std::min(lightest, b.mass);
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

/* What states that are read have changed is no stiffness: the work of the forces after a step where they are as before, and with them variables and force
   states, by one correction */
PetscErrorCode WorkAtStatesBefore(Equilibrium &E, double *work)
{
  const Runtime  &R = E.R;
  const PetscInt *i;
  PetscInt        all, n;
  const double   *from, *f;
  double         *to;
  PetscFunctionBegin;
  PetscCall(ISGetSize(R.roles[TSHHT3_STATE], &all));
  if (!all) PetscFunctionReturn(0);
  PetscCall(VecCopy(E.next, E.A));
  const auto replace = [&](TSHHT3Role role) -> PetscErrorCode { /* states by those of U; others less their rows */
    PetscFunctionBegin;
    PetscCall(ISGetLocalSize(R.roles[role], &n));
    PetscCall(ISGetIndices(R.roles[role], &i));
    PetscCall(VecGetArrayRead(E.U, &from));
    PetscCall(VecGetArrayRead(E.F, &f));
    PetscCall(VecGetArray(E.A, &to));
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt own = i[k] - R.start;
      to[own]            = role == TSHHT3_STATE ? from[own] : to[own] - f[own];
    }
    PetscCall(VecRestoreArray(E.A, &to));
    PetscCall(VecRestoreArrayRead(E.F, &f));
    PetscCall(VecRestoreArrayRead(E.U, &from));
    PetscCall(ISRestoreIndices(R.roles[role], &i));
    PetscFunctionReturn(0);
  };
  PetscCall(replace(TSHHT3_STATE));
  PetscCall(E.residual(E.A));
  for (TSHHT3Role role : {TSHHT3_VARIABLE, TSHHT3_FORCE}) PetscCall(replace(role));
  PetscCall(E.residual(E.A));
  PetscCall(Work(E, E.F, E.d, work));
  PetscCall(E.residual(E.next));
  PetscFunctionReturn(0);
}

/* d = J^-1 F, next less d; the reach of d is infinite if there is none */
PetscErrorCode Newton(Equilibrium &E, double *reach)
{
  KSPConvergedReason reason;
  PetscFunctionBegin;
  E.iterations++;
  *reach = INFINITY;
  PetscCall(KSPSolve(E.ksp, E.F, E.d));
  PetscCall(KSPGetConvergedReason(E.ksp, &reason));
  if (reason < 0) PetscFunctionReturn(0);
  PetscCall(E.reach(E.d, reach));
  if (*reach <= 1) PetscCall(VecAXPY(E.next, -1, E.d));
  PetscFunctionReturn(0);
}

/* What rolls does not slip on the way from U to next: the rows of velocities along the straight line, integrated (SceneEquilibrium.AnEccentricWheelRolls) */
PetscErrorCode RollAlong(Equilibrium &E, double h)
{
  constexpr double at[3] = {0.1127016653792583, 0.5, 0.8872983346207417}, weight[3] = {5. / 18, 8. / 18, 5. / 18}; /* Gauss, Legendre */
  const IS         rows = E.R.roles[TSHHT3_NONHOLONOMIC];
  const PetscInt  *i;
  PetscInt         all, own;
  double           slip;
  PetscFunctionBegin;
  PetscCall(ISGetSize(rows, &all));
  if (!all) PetscFunctionReturn(0);
  PetscCall(ISGetLocalSize(rows, &own));
  for (int round = 0; round < 30; round++) {
    PetscCall(VecWAXPY(E.V, -1, E.U, E.next));
    PetscCall(VecScale(E.V, 1 / h));
    PetscCall(VecSet(E.undamped, 0));
    for (int k = 0; k < 3; k++) {
      PetscCall(VecWAXPY(E.A, at[k] * h, E.V, E.U));
      PetscCall(Residual(E.R, E.t, E.A, E.V, E.zero, E.F));
      PetscCall(VecAXPY(E.undamped, weight[k], E.F));
      PetscCall(Residual(E.R, E.t, E.A, E.zero, E.zero, E.F)); /* motions of velocities stand still */
      PetscCall(VecAXPY(E.undamped, -weight[k], E.F));
    }
    const PetscScalar *v;
    PetscScalar       *f;
    PetscCall(VecSet(E.F, 0));
    PetscCall(ISGetIndices(rows, &i));
    PetscCall(VecGetArrayRead(E.undamped, &v));
    PetscCall(VecGetArray(E.F, &f));
    for (PetscInt k = 0; k < own; k++) f[i[k] - E.R.start] = v[i[k] - E.R.start];
    PetscCall(VecRestoreArray(E.F, &f));
    PetscCall(VecRestoreArrayRead(E.undamped, &v));
    PetscCall(ISRestoreIndices(rows, &i));
    PetscCall(VecNorm(E.F, NORM_INFINITY, &slip));
    if (!(slip * h > 1e-12 * E.size)) break;
    PetscCall(KSPSolve(E.ksp, E.F, E.d));
    PetscCall(VecAXPY(E.next, -1, E.d));
  }
  PetscFunctionReturn(0);
}

/* F: what is left of the equations of the step from U to next. Damping is that of slow motion: dry friction, which saturates, would throw back every
   step but those of its slip velocity, and does not move equilibrium (SceneEquilibrium.ALeverOnRoughGround). */
PetscErrorCode StepResidual(Equilibrium &E, double h, Unbalanced &left)
{
  PetscFunctionBegin;
  PetscCall(VecWAXPY(E.A, -1, E.U, E.next));
  PetscCall(VecScale(E.A, 1 / (h * h)));
  PetscCall(VecCopy(E.A, E.V));
  PetscCall(VecScale(E.V, slow * h));
  PetscCall(Residual(E.R, E.t, E.next, E.zero, E.A, E.undamped));
  PetscCall(Residual(E.R, E.t, E.next, E.V, E.A, E.F));
  PetscCall(VecAXPBY(E.F, 1 - 1 / slow, 1 / slow, E.undamped));
  PetscCall(E.measure(E.F, left));
  PetscFunctionReturn(0);
}

/*
  More corrections where the first has raised the unbalanced forces. It moves thin parts along straight lines, which
  stretches them: forces that say nothing of how far equilibrium is and would only make h fall.
*/
PetscErrorCode Correct(Equilibrium &E, double h, double before, Attempt &a, Unbalanced &after)
{
  double     last = a.reach;
  Unbalanced left;
  PetscFunctionBegin;
  for (a.corrections = 0;; a.corrections++) {
    PetscCall(E.residual(E.next));
    PetscCall(E.measure(E.F, after));
    if (!std::isfinite(after.force + after.misfit + after.other)) PetscFunctionReturn(0);
    if (after.force <= before || a.reach * largest_turn <= at_rest || last <= corrected * a.reach) break;
    PetscCall(StepResidual(E, h, left));
    if (left.force <= solved * before) break;
    if (a.corrections == most_corrections) PetscFunctionReturn(0);
    PetscCall(Jacobian(E.R, E.t, E.next, E.zero, E.A, 1 / h, 1 / (h * h), E.J));
    PetscCall(Newton(E, &last));
    if (!(last <= a.reach)) PetscFunctionReturn(0);
  }
  a.good = true;
  PetscFunctionReturn(0);
}

/* One step from forces before; not good if it would go too far or cannot be computed */
PetscErrorCode Step(Equilibrium &E, double h, double before, Attempt &a, Unbalanced &after)
{
  PetscFunctionBegin;
  a = Attempt();
  PetscCall(E.residual(E.U));
  PetscCall(VecCopy(E.F, E.start));
  PetscCall(Jacobian(E.R, E.t, E.U, E.zero, E.zero, 1 / h, 1 / (h * h), E.J));
  PetscCall(VecCopy(E.U, E.next));
  PetscCall(Newton(E, &a.reach));
  if (!(a.reach <= 1)) PetscFunctionReturn(0);
  PetscCall(RollAlong(E, h));
  PetscCall(Correct(E, h, before, a, after));
  if (!a.good) PetscFunctionReturn(0);
  if (a.corrections > 0) PetscCall(RollAlong(E, h));
  PetscCall(VecWAXPY(E.d, -1, E.next, E.U));
  PetscCall(E.reach(E.d, &a.reach));
  PetscCall(E.residual(E.next));
  PetscCall(Work(E, E.start, E.d, &a.work[0]));
  PetscCall(Work(E, E.F, E.d, &a.work[1]));
  PetscCall(WorkAtStatesBefore(E, &a.at_the_states_before));
  E.h = h;
  PetscCall(VecCopy(E.next, E.U));
  after.step = a.reach * largest_turn;
  PetscFunctionReturn(0);
}

/*
  Of h: as the forces fall. Where they fall along the step as in a hollow, slowly where damping is strong (SceneEquilibrium.StrongDamping), h need
  not wait for that, as long as the next step does not go too far: steps go as h^2 at most. Where they rise on the way down, next to a saddle, h stays. A step
  against the forces has been Newton's towards a saddle. Where states take balanced bodies along, what their change does to the forces is left out, and where
  no work is done but that of forces that count as balanced, only time goes on (SceneEquilibrium.SlowStates).
*/
double Growth(const Equilibrium &E, const Attempt &a, double before, const Unbalanced &after)
{
  const double falling = std::min(largest_growth, std::max(0.5, before / std::max(after.force, 1e-300)));
  const bool   idle    = std::abs(a.work[0]) <= balanced * E.scale * after.step * E.size;
  if (!idle && a.work[0] < 0) return 0.25;
  const bool in_hollow = idle || (a.work[1] > 0 && std::min(a.work[1], a.at_the_states_before) < a.work[0]);
  return std::max(falling, in_hollow ? std::max(1.0, std::min(downhill_growth, 1 / std::sqrt(a.reach))) : 1.0);
}

/* What is left in F of rows that are no forces, each as a part of what it is of: of definitions of the value, of rates of states and of velocities what they
   would do in the last, longest step, which knows the scene's own time (SceneEquilibrium.SlowStates, SceneEquilibrium.AMotionOfASmallVelocity) */
PetscErrorCode Unsettled(const Equilibrium &E, Vec F, double *part)
{
  const Runtime &R = E.R;
  const double  *f;
  double         mine = 0;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(F, &f));
  for (TSHHT3Role role : {TSHHT3_NONHOLONOMIC, TSHHT3_VARIABLE, TSHHT3_FORCE, TSHHT3_STATE}) {
    const PetscInt *i;
    PetscInt        n;
    PetscCall(ISGetLocalSize(R.roles[role], &n));
    PetscCall(ISGetIndices(R.roles[role], &i));
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt own  = i[k] - R.start;
      const double   size = E.most[own];
      if (std::binary_search(E.unread.begin(), E.unread.end(), i[k])) continue;
      const double x = role == TSHHT3_NONHOLONOMIC ? f[own] * E.h / E.size : role == TSHHT3_VARIABLE ? f[own] / std::max(1., size) : role == TSHHT3_FORCE ? f[own] / std::max({1., E.scale, size}) :
                                                                                                       f[own] * E.h / std::max(state_floor, size);
      mine = std::max(mine, std::isnan(x) ? INFINITY : std::abs(x));
    }
    PetscCall(ISRestoreIndices(R.roles[role], &i));
  }
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCallMPI(MPI_Allreduce(&mine, part, 1, MPI_DOUBLE, MPI_MAX, R.scene.comm));
  PetscFunctionReturn(0);
}

/* Stiff springs and meshes leave rounding that is no small part of the weights: what it makes of the forces where the scene stands is as good as zero.
   F: what is left at U */
PetscErrorCode Balanced(Equilibrium &E, const Unbalanced &at, bool *found)
{
  double unsettled, rounded = 0, rounded_rest = 0;
  PetscFunctionBegin;
  *found = false;
  PetscCall(Unsettled(E, E.F, &unsettled));
  if (at.misfit > balanced * E.size) PetscFunctionReturn(0);
  if (at.force > balanced * E.scale || unsettled > settled) {
    PetscCall(Rounding(E, &rounded));
    PetscCall(Unsettled(E, E.start, &rounded_rest));
  }
  *found = at.force <= std::max(balanced * E.scale, noise * rounded) && unsettled <= std::max(settled, noise * rounded_rest);
  PetscFunctionReturn(0);
}

/* States without a column in the equations at rest: integrals for later use, of power or of a deviation */
PetscErrorCode FindUnread(Equilibrium &E)
{
  const IS        states = E.R.roles[TSHHT3_STATE];
  const PetscInt *i;
  PetscInt        n, all;
  PetscFunctionBegin;
  PetscCall(ISGetSize(states, &all));
  if (!all) PetscFunctionReturn(0);
  PetscCall(MatGetSize(E.J, nullptr, &n));
  std::vector<PetscReal> column(n);
  PetscCall(Jacobian(E.R, E.t, E.U, E.zero, E.zero, 0, 0, E.J));
  PetscCall(MatGetColumnNorms(E.J, NORM_INFINITY, column.data()));
  PetscCall(ISGetLocalSize(states, &n));
  PetscCall(ISGetIndices(states, &i));
  E.unread.clear();
  std::copy_if(i, i + n, std::back_inserter(E.unread), [&](PetscInt s) { return column[s] == 0; });
  PetscCall(ISRestoreIndices(states, &i));
  std::sort(E.unread.begin(), E.unread.end());
  PetscFunctionReturn(0);
}

PetscErrorCode NoteLargest(Equilibrium &E)
{
  const double *u;
  PetscFunctionBegin;
  E.most.resize(E.R.n);
  PetscCall(VecGetArrayRead(E.U, &u));
  for (PetscInt i = 0; i < E.R.n; i++) E.most[i] = std::max(E.most[i], std::abs(u[i]));
  PetscCall(VecRestoreArrayRead(E.U, &u));
  PetscFunctionReturn(0);
}

/* These as they were in `begin` */
PetscErrorCode KeepUnread(Equilibrium &E, Vec begin)
{
  const double *before;
  double       *now;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(begin, &before));
  PetscCall(VecGetArray(E.U, &now));
  for (PetscInt i : E.unread) now[i - E.R.start] = before[i - E.R.start];
  PetscCall(VecRestoreArray(E.U, &now));
  PetscCall(VecRestoreArrayRead(begin, &before));
  PetscFunctionReturn(0);
}

/* Of a mesh forces may be small at every node, below what rounding makes there, and still add up, as those of inertia do after a step that was not yet Newton's. What is
   left of the way is w_1/sqrt(w_0 w) by the work of the forces after and before this step, and of those before the longest one. Steps that grow are drift of rounding where nothing
   holds the body. */
bool Unfinished(Equilibrium &E, const Attempt &a, double reach_before)
{
  if (E.R.scene.extensions.empty()) return false;
  return std::abs(a.work[1]) > exhausted * std::sqrt(std::abs(a.work[0]) * E.work) && a.reach < 4 * reach_before;
}

PetscErrorCode Relax(Equilibrium &E, bool *found, Unbalanced &at)
{
  double  h = 0, first, before, reach = INFINITY;
  int     finishing = 0;
  Attempt a;
  PetscFunctionBegin;
  PetscCall(Scales(E, &h));
  PetscCall(NoteLargest(E));
  first  = h;
  before = at.force = E.scale;
  *found = false;
  while (E.iterations < equilibrium_iterations && !*found && h > 1e-12 * first) {
    PetscCall(Step(E, h, before, a, at));
    PetscCall(PetscInfo(nullptr, "scene: equilibrium %d: h = %g%s, unbalanced %g of %g, constraints %g, step %g with %d corrections more\n",
                        (int)E.iterations, h, a.good ? "" : " refused", at.force, E.scale, at.misfit, a.reach * largest_turn,
                        a.corrections));
    if (!a.good) {
      h /= 4;
      continue;
    }
    PetscCall(NoteLargest(E));
    E.scale = std::max(E.scale, at.force); /* variables that carry loads may begin at zero (SceneEquilibrium.ALoopThroughAVariable) */
    PetscCall(Balanced(E, at, found));
    E.work = std::max(E.work, std::abs(a.work[0]));
    if (*found && finishing < most_finishing && Unfinished(E, a, reach)) {
      *found = false;
      finishing++;
      h *= largest_growth;
    } else h *= Growth(E, a, before, at);
    before = at.force;
    reach  = a.reach;
    PetscCall(Remember(E.R, E.U, E.zero));
    PetscCall(RenewAxes(E.R, E.U, E.zero));
  }
  PetscFunctionReturn(0);
}

/* A column that is zero at the start may be that of a factor that is: x of the stiffness x at no displacement (SceneEquilibrium.AStateThatIsAFactor). States
   stay as they were in `begin` where nothing reads them at the end either, and the end is balanced with them so. */
PetscErrorCode RelaxAndKeep(Equilibrium &E, Vec begin, bool *found, Unbalanced &at)
{
  PetscFunctionBegin;
  PetscCall(FindUnread(E));
  PetscCall(Relax(E, found, at));
  while (*found) {
    const std::vector<PetscInt> before = E.unread;
    const PetscInt              own    = (PetscInt)before.size();
    PetscInt                    unread;
    PetscCallMPI(MPI_Allreduce(&own, &unread, 1, MPIU_INT, MPI_SUM, E.R.scene.comm));
    if (!unread) PetscFunctionReturn(0);
    PetscCall(FindUnread(E));
    std::vector<PetscInt> both;
    std::set_intersection(before.begin(), before.end(), E.unread.begin(), E.unread.end(), std::back_inserter(both));
    E.unread = both;
    PetscCall(VecCopy(E.U, E.A));
    PetscCall(KeepUnread(E, begin));
    PetscCall(E.residual(E.U));
    PetscCall(E.measure(E.F, at));
    PetscCall(Balanced(E, at, found));
    if (*found) PetscFunctionReturn(0);
    PetscCall(VecCopy(E.A, E.U));
    E.unread.clear();
    PetscCall(Relax(E, found, at));
  }
  PetscFunctionReturn(0);
}

} // namespace

/* U: where it begins and ends; of no use after an error */
PetscErrorCode RelaxAt(Runtime &R, double t, Vec U, PetscInt *iterations)
{
  Equilibrium E(R, t);
  Unbalanced  at;
  bool        found = false;
  PetscFunctionBegin;
  PetscCall(E.create(U, "scene_equilibrium_"));
  PetscCall(VecDuplicate(U, &E.start));
  PetscCall(VecDuplicate(U, &E.undamped));
  PetscCall(RelaxAndKeep(E, U, &found, at));
  PetscCheck(found, R.scene.comm, PETSC_ERR_CONV_FAILED,
             "no static equilibrium found in %d corrections: a force of %g (moments over the scene's size) is left on %s, "
             "constraints are violated by %g, motions of velocities, rates of states and definitions by %g.\n"
             "Start nearer to it, hold what is free to move for ever, or stop what never rests: a motion of constant velocity, a state with a constant rate",
             (int)E.iterations, at.force, R.scene.bodyName(at.body).c_str(), at.misfit, at.other);
  PetscCall(VecCopy(E.U, U));
  *iterations = E.iterations;
  PetscFunctionReturn(0);
}

static PetscErrorCode MoveToEquilibrium(Model &M, Runtime &R, Vec U, Vec V)
{
  SceneData              &s      = M.scene;
  const std::vector<Pose> before = Poses(s);
  PetscFunctionBegin;
  PetscCall(InitialState(R, U, V));
  PetscCall(RelaxAt(R, s.start.time, U, &s.started.equilibrium_iterations));
  M.turned.resize(Memories(R)); /* the run begins with the turns made on the way (SceneEquilibrium.TurnsOnTheWay) */
  CopyMemories(R, M.turned.data(), false);
  PetscCall(WriteState(M, R, U, nullptr));
  PetscCall(ReportMoves(s, before, "equilibrium"));
  PetscFunctionReturn(0);
}

PetscErrorCode FindEquilibrium(const std::shared_ptr<Model> &M)
{
  SceneData &s = M->scene;
  Runtime    R(M);
  Vec        U, V;
  PetscFunctionBegin;
  PetscCall(Layout(R));
  PetscCall(VecCreate(s.comm, &U));
  PetscCall(VecSetSizes(U, R.n, PETSC_DETERMINE));
  PetscCall(VecSetType(U, VECSTANDARD));
  PetscCall(VecDuplicate(U, &V));
  const PetscErrorCode failed = MoveToEquilibrium(*M, R, U, V);
  PetscCall(VecDestroy(&V));
  PetscCall(VecDestroy(&U));
  PetscCall(failed);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
