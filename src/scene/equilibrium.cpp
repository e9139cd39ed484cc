/*
  Static equilibrium: Q(q, 0) - Phi_q^T lambda = 0, Phi = 0 with all velocities, accelerations and rates of states zero.

  Pseudo-transient continuation: implicit Euler steps from rest, with velocities set to zero after each, and usually one Newton
  correction per step:

    (M/h^2 + C/h + K) dq + Phi_q^T dlambda = -F,   Phi_q dq = -Phi

  which is the scene's Jacobian with sigma_v = 1/h and sigma_a = 1/h^2. Small steps follow the gradient of the potential energy from any
  position, large ones approach Newton's method; h grows as the unbalanced forces decrease, and shrinks if a step would be
  too long or the forces have done negative work.
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

constexpr int    equilibrium_iterations = 2000; /* largest number of Newton corrections in all steps */
/* Unbalanced forces relative to the largest force of the scene, and violations of constraints relative to its size, that count as zero */
constexpr double force_tolerance = 1e-10;
/* Largest factor by which h grows from one step to the next: in general, and while the work of the forces decreases (StepGrowth()) */
constexpr double max_growth            = 8;
constexpr double max_growth_converging = 2;
/* Steps shorter than this, in radians or relative to the scene's size, are accepted without further corrections */
constexpr double negligible_step_length = 1e-9;
/* Forces below this multiple of the forces caused by rounding of the coordinates count as zero, since no iteration
   reduces them (Equilibrium.AMeshFarFromTheOrigin) */
constexpr double rounding_factor = 10;
/* Distance to equilibrium in the energy norm, relative to the longest step, above which meshes need further steps although all forces are balanced
   (test_reactions_to_small_loads of tests/python), and the largest number of these steps */
constexpr double remaining_distance  = 1e-7;
constexpr int    max_finishing_steps = 4;
/* Damping forces are evaluated at this part of the velocities of a step, StepResidual() */
constexpr double damping_velocity_factor = 1e-6;
constexpr int    max_corrections         = 6; /* Newton corrections of a step beyond the first */
/* Relative changes over the last step of states, variables, force states and motions at velocity level that count as zero; states are compared with at least state_floor, since the
   rounding of a state that tends to zero is that of terms of order one */
constexpr double rate_tolerance = 1e-8;
constexpr double state_floor    = 1e-6;
/* Corrections of a step end when the forces left in its equations are below residual_reduction of those before the step, or when a correction is shorter than
   correction_reduction of the step */
constexpr double residual_reduction = 0.3, correction_reduction = 0.05;

struct Equilibrium : StillSystem {
  /* residual before a step, and after it with zero velocities; both are also used as work vectors */
  Vec                 residual_at_start = nullptr, residual_at_rest = nullptr;
  double              force_scale  = 0;                                        /* largest force so far, moments divided by the scene's size */
  double              longest_h    = 0;                                        /* longest step so far, s */
  double              largest_work = 0;                                        /* largest |work[0]| of a step so far */
  std::vector<double> largest_value;                                           /* largest magnitude so far of each unknown of this rank */
  PetscInt iterations = 0;

  using StillSystem::StillSystem;
  ~Equilibrium()
  {
    for (Vec *x : {&residual_at_start, &residual_at_rest}) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(x));
  }
};

/* good: the step is accepted; reach: its length in units of largest_turn; work: work of the unbalanced forces before (0)
   and after (1) the step over its displacements */
struct StepResult {
  bool   good        = false;
  int    corrections = 0; /* number of corrections after the first */
  double reach = INFINITY, work[2] = {0, 0};
  double work_at_old_states = INFINITY; /* work[1] with the first-order states before the step */
};

/* *force: change of the residual's forces by random relative changes of the unknowns of machine precision. Positions of bodies are changed relative to at least the scene's size, since
   elements take differences of positions of markers (Stops.ALoadOnAStopAnywhere) */
PetscErrorCode RoundingForce(Equilibrium &E, double *force)
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
  PetscCall(Residual(E.R, E.t, E.next, E.zero, E.zero, E.residual_at_start));
  PetscCall(VecAXPY(E.residual_at_start, -1, E.F));
  PetscCall(E.measure(E.residual_at_start, at));
  *force = at.force;
  PetscFunctionReturn(0);
}

/* Sets force_scale from weights and the unbalanced forces at the start, and *h, s, to a time in which such a force moves the lightest body by about 1 % of the scene's size */
PetscErrorCode ChooseScales(Equilibrium &E, double *h)
{
  const SceneData &s = E.R.scene;
  Unbalanced       at;
  double           lightest = INFINITY;
  PetscFunctionBegin;
  PetscCall(E.residual(E.U));
  PetscCall(E.measure(E.F, at));
  E.force_scale = at.force;
  for (const BodyData &b : s.bodies) {
    E.force_scale = std::max(E.force_scale, b.mass * s.gravity.norm());
    if (b.mass > 0 && !b.massless) lightest = std::min(lightest, b.mass);
  }
  if (lightest == INFINITY)
    for (const BodyData &b : s.bodies) lightest = std::min(lightest, b.light_mass);
  *h = E.force_scale > 0 && std::isfinite(lightest) ? 0.1 * std::sqrt(E.size * lightest / E.force_scale) : 1;
  PetscFunctionReturn(0);
}

/* Work of the forces in F over the displacements d of bodies and extensions; other rows of F are not forces */
PetscErrorCode WorkOf(const Equilibrium &E, Vec F, Vec d, double *work)
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

/* Work of the forces after a step if first-order states had not changed, because the effect of states on forces is not a
   stiffness. Variables and force states are updated by one substitution */
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
  /* First-order states are those of U; variables and force states are reduced by their residuals */
  const auto replace = [&](TSHHT3Role role) -> PetscErrorCode {
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
  PetscCall(WorkOf(E, E.F, E.d, work));
  PetscCall(E.residual(E.next));
  PetscFunctionReturn(0);
}

/* d = J^-1 F, next -= d unless d is too long; *reach is infinite if the solve fails */
PetscErrorCode NewtonCorrection(Equilibrium &E, double *reach)
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

/* Corrects next so that constraints at velocity level, such as rolling, hold over the straight path from U to next: their integral over the path vanishes
   (SceneEquilibrium.AnEccentricWheelRolls) */
PetscErrorCode CorrectRolling(Equilibrium &E, double h)
{
  constexpr double at[3] = {0.1127016653792583, 0.5, 0.8872983346207417}, weight[3] = {5. / 18, 8. / 18, 5. / 18}; /* Gauss-Legendre quadrature on [0, 1] */
  const IS         rows = E.R.roles[TSHHT3_NONHOLONOMIC];
  const PetscInt  *i;
  PetscInt         all, own;
  double           slip_rate;
  PetscFunctionBegin;
  PetscCall(ISGetSize(rows, &all));
  if (!all) PetscFunctionReturn(0);
  PetscCall(ISGetLocalSize(rows, &own));
  for (int round = 0; round < 30; round++) {
    PetscCall(VecWAXPY(E.V, -1, E.U, E.next));
    PetscCall(VecScale(E.V, 1 / h));
    PetscCall(VecSet(E.residual_at_rest, 0));
    for (int k = 0; k < 3; k++) {
      PetscCall(VecWAXPY(E.A, at[k] * h, E.V, E.U));
      PetscCall(Residual(E.R, E.t, E.A, E.V, E.zero, E.F));
      PetscCall(VecAXPY(E.residual_at_rest, weight[k], E.F));
      PetscCall(Residual(E.R, E.t, E.A, E.zero, E.zero, E.F)); /* the part that motions prescribe */
      PetscCall(VecAXPY(E.residual_at_rest, -weight[k], E.F));
    }
    const PetscScalar *v;
    PetscScalar       *f;
    PetscCall(VecSet(E.F, 0));
    PetscCall(ISGetIndices(rows, &i));
    PetscCall(VecGetArrayRead(E.residual_at_rest, &v));
    PetscCall(VecGetArray(E.F, &f));
    for (PetscInt k = 0; k < own; k++) f[i[k] - E.R.start] = v[i[k] - E.R.start];
    PetscCall(VecRestoreArray(E.F, &f));
    PetscCall(VecRestoreArrayRead(E.residual_at_rest, &v));
    PetscCall(ISRestoreIndices(rows, &i));
    PetscCall(VecNorm(E.F, NORM_INFINITY, &slip_rate));
    if (!(slip_rate * h > 1e-12 * E.size)) break;
    PetscCall(KSPSolve(E.ksp, E.F, E.d));
    PetscCall(VecAXPY(E.next, -1, E.d));
  }
  PetscFunctionReturn(0);
}

/* F: residual of the equations of the step from U to next. Damping forces are linearized at damping_velocity_factor times the velocities of the step: saturated dry friction would
   otherwise dominate the residual, although it does not change equilibrium (SceneEquilibrium.ALeverOnRoughGround). */
PetscErrorCode StepResidual(Equilibrium &E, double h, Unbalanced &left)
{
  PetscFunctionBegin;
  PetscCall(VecWAXPY(E.A, -1, E.U, E.next));
  PetscCall(VecScale(E.A, 1 / (h * h)));
  PetscCall(VecCopy(E.A, E.V));
  PetscCall(VecScale(E.V, damping_velocity_factor * h));
  PetscCall(Residual(E.R, E.t, E.next, E.zero, E.A, E.residual_at_rest));
  PetscCall(Residual(E.R, E.t, E.next, E.V, E.A, E.F));
  PetscCall(VecAXPBY(E.F, 1 - 1 / damping_velocity_factor, 1 / damping_velocity_factor, E.residual_at_rest));
  PetscCall(E.measure(E.F, left));
  PetscFunctionReturn(0);
}

/*
  Corrects a step further if the first correction has increased the unbalanced forces. A linearized rotation stretches thin
  flexible parts; without these corrections the resulting axial forces would reduce h although equilibrium is nearer.
*/
PetscErrorCode CorrectStep(Equilibrium &E, double h, double before, StepResult &a, Unbalanced &after)
{
  double     last = a.reach;
  Unbalanced left;
  PetscFunctionBegin;
  for (a.corrections = 0;; a.corrections++) {
    PetscCall(E.residual(E.next));
    PetscCall(E.measure(E.F, after));
    if (!std::isfinite(after.force + after.misfit + after.other)) PetscFunctionReturn(0);
    if (after.force <= before || a.reach * largest_turn <= negligible_step_length || last <= correction_reduction * a.reach) break;
    PetscCall(StepResidual(E, h, left));
    if (left.force <= residual_reduction * before) break;
    if (a.corrections == max_corrections) PetscFunctionReturn(0);
    PetscCall(Jacobian(E.R, E.t, E.next, E.zero, E.A, 1 / h, 1 / (h * h), E.J));
    PetscCall(NewtonCorrection(E, &last));
    if (!(last <= a.reach)) PetscFunctionReturn(0);
  }
  a.good = true;
  PetscFunctionReturn(0);
}

/* One step of size h; before: unbalanced force at U. a.good is false if the step would be too long or cannot be computed */
PetscErrorCode EquilibriumStep(Equilibrium &E, double h, double before, StepResult &a, Unbalanced &after)
{
  PetscFunctionBegin;
  a = StepResult();
  PetscCall(E.residual(E.U));
  PetscCall(VecCopy(E.F, E.residual_at_start));
  PetscCall(Jacobian(E.R, E.t, E.U, E.zero, E.zero, 1 / h, 1 / (h * h), E.J));
  PetscCall(VecCopy(E.U, E.next));
  PetscCall(NewtonCorrection(E, &a.reach));
  if (!(a.reach <= 1)) PetscFunctionReturn(0);
  PetscCall(CorrectRolling(E, h));
  PetscCall(CorrectStep(E, h, before, a, after));
  if (!a.good) PetscFunctionReturn(0);
  if (a.corrections > 0) PetscCall(CorrectRolling(E, h));
  PetscCall(VecWAXPY(E.d, -1, E.next, E.U));
  PetscCall(E.reach(E.d, &a.reach));
  PetscCall(E.residual(E.next));
  PetscCall(WorkOf(E, E.residual_at_start, E.d, &a.work[0]));
  PetscCall(WorkOf(E, E.F, E.d, &a.work[1]));
  PetscCall(WorkAtStatesBefore(E, &a.work_at_old_states));
  E.longest_h = std::max(E.longest_h, h);
  PetscCall(VecCopy(E.next, E.U));
  after.step = a.reach * largest_turn;
  PetscFunctionReturn(0);
}

/*
  Factor of the next h. It is the ratio by which the forces have decreased. While their work decreases along the step, as in a minimum of the energy, h grows even if the forces
  decrease slowly, as under strong damping (SceneEquilibrium.StrongDamping); the length of a step grows at most as h^2. If the work increases, as near a saddle point, h does not grow
  beyond that ratio. Negative work means that Newton's method converges to a saddle point: h shrinks. The effect of states on the forces is excluded, and a step in which only forces within
  the tolerance do work counts as converging, since only states still move (SceneEquilibrium.SlowStates).
*/
double StepGrowth(const Equilibrium &E, const StepResult &a, double before, const Unbalanced &after)
{
  const double force_decrease = std::min(max_growth, std::max(0.5, before / std::max(after.force, 1e-300)));
  const bool   does_no_work   = std::abs(a.work[0]) <= force_tolerance * E.force_scale * after.step * E.size;
  if (!does_no_work && a.work[0] < 0) return 0.25;
  const bool converging = does_no_work || (a.work[1] > 0 && std::min(a.work[1], a.work_at_old_states) < a.work[0]);
  return std::max(force_decrease, converging ? std::max(1.0, std::min(max_growth_converging, 1 / std::sqrt(a.reach))) : 1.0);
}

/* *part: largest relative residual in F of rows other than forces and holonomic constraints. Residuals of variables and force states are divided by their values; rates of states and
   velocities are first multiplied by the longest step, which gives the change over it (SceneEquilibrium.SlowStates, SceneEquilibrium.AMotionOfASmallVelocity): the last one may be as short as
   rounding has made it (test_equilibrium_on_a_driven_hub of tests/python) */
PetscErrorCode RateResidual(const Equilibrium &E, Vec F, double *part)
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
      const double   size = E.largest_value[own];
      if (std::binary_search(E.unread.begin(), E.unread.end(), i[k])) continue;
      const double x = role == TSHHT3_NONHOLONOMIC ? f[own] * E.longest_h / E.size : role == TSHHT3_VARIABLE ? f[own] / std::max(1., size) : role == TSHHT3_FORCE ? f[own] / std::max({1., E.force_scale, size}) :
                                                                                                      f[own] * E.longest_h / std::max(state_floor, size);
      mine = std::max(mine, std::isnan(x) ? INFINITY : std::abs(x));
    }
    PetscCall(ISRestoreIndices(R.roles[role], &i));
  }
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCallMPI(MPI_Allreduce(&mine, part, 1, MPI_DOUBLE, MPI_MAX, R.scene.comm));
  PetscFunctionReturn(0);
}

/* Whether U is in equilibrium; E.F: residual at U. With stiff springs and meshes, rounding of the coordinates causes
   forces above the tolerance; these also count as zero. */
PetscErrorCode TestEquilibrium(Equilibrium &E, const Unbalanced &at, bool *found)
{
  double rate_residual, rounding_force = 0, rounding_rate_residual = 0;
  PetscFunctionBegin;
  *found = false;
  PetscCall(RateResidual(E, E.F, &rate_residual));
  if (at.misfit > force_tolerance * E.size) PetscFunctionReturn(0);
  if (at.force > force_tolerance * E.force_scale || rate_residual > rate_tolerance) {
    PetscCall(RoundingForce(E, &rounding_force));
    PetscCall(RateResidual(E, E.residual_at_start, &rounding_rate_residual));
  }
  *found = at.force <= std::max(force_tolerance * E.force_scale, rounding_factor * rounding_force) && rate_residual <= std::max(rate_tolerance, rounding_factor * rounding_rate_residual);
  PetscFunctionReturn(0);
}

/* Finds states that no equation at rest reads, whose columns of the Jacobian are zero: for example an integral of power or of a control deviation */
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

PetscErrorCode UpdateLargestValues(Equilibrium &E)
{
  const double *u;
  PetscFunctionBegin;
  E.largest_value.resize(E.R.n);
  PetscCall(VecGetArrayRead(E.U, &u));
  for (PetscInt i = 0; i < E.R.n; i++) E.largest_value[i] = std::max(E.largest_value[i], std::abs(u[i]));
  PetscCall(VecRestoreArrayRead(E.U, &u));
  PetscFunctionReturn(0);
}

/* Resets the unread states to their values in `begin` */
PetscErrorCode RestoreUnread(Equilibrium &E, Vec begin)
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

/* Whether a mesh needs a further step although its forces are balanced. The forces may be within rounding at every node
   and still sum up to a load, as the inertia forces of a step with finite h do. The distance to equilibrium relative to
   the longest step is estimated as |w_1|/sqrt(w_0 w), where w_1 and w_0 are the work of the forces after and before this
   step, and w the work before the longest step. Steps that grow are the drift, caused by rounding, of a body that nothing
   holds; then no further step is needed. */
bool NeedsFinishing(Equilibrium &E, const StepResult &a, double reach_before)
{
  if (E.R.scene.extensions.empty()) return false;
  return std::abs(a.work[1]) > remaining_distance * std::sqrt(std::abs(a.work[0]) * E.largest_work) && a.reach < 4 * reach_before;
}

PetscErrorCode StepToEquilibrium(Equilibrium &E, bool *found, Unbalanced &at)
{
  double  h = 0, first, before, reach = INFINITY;
  int     finishing = 0;
  StepResult a;
  PetscFunctionBegin;
  PetscCall(ChooseScales(E, &h));
  PetscCall(UpdateLargestValues(E));
  first  = h;
  before = at.force = E.force_scale;
  *found = false;
  while (E.iterations < equilibrium_iterations && !*found && h > 1e-12 * first) {
    PetscCall(EquilibriumStep(E, h, before, a, at));
    PetscCall(PetscInfo(nullptr, "scene: equilibrium %d: h = %g%s, unbalanced %g of %g, constraints %g, step %g with %d corrections more\n",
                        (int)E.iterations, h, a.good ? "" : " refused", at.force, E.force_scale, at.misfit, a.reach * largest_turn,
                        a.corrections));
    if (!a.good) {
      h /= 4;
      continue;
    }
    PetscCall(UpdateLargestValues(E));
    E.force_scale = std::max(E.force_scale, at.force); /* loads through variables may be zero at first (SceneEquilibrium.ALoopThroughAVariable) */
    PetscCall(TestEquilibrium(E, at, found));
    E.largest_work = std::max(E.largest_work, std::abs(a.work[0]));
    if (*found && finishing < max_finishing_steps && NeedsFinishing(E, a, reach)) {
      *found = false;
      finishing++;
      h *= max_growth;
    } else h *= StepGrowth(E, a, before, at);
    before = at.force;
    reach  = a.reach;
    PetscCall(Remember(E.R, E.U, E.zero));
    PetscCall(RenewAxes(E.R, E.U, E.zero));
  }
  PetscFunctionReturn(0);
}

/* A state that multiplies a force which is zero at the start, such as a stiffness at zero displacement, has a zero column
   there although an equation reads it (SceneEquilibrium.AStateThatIsAFactor). So states are reset to their values in
   `begin` only if no equation reads them at the end either, and equilibrium is tested again with these values. */
PetscErrorCode FindEquilibriumState(Equilibrium &E, Vec begin, bool *found, Unbalanced &at)
{
  PetscFunctionBegin;
  PetscCall(FindUnread(E));
  PetscCall(StepToEquilibrium(E, found, at));
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
    PetscCall(RestoreUnread(E, begin));
    PetscCall(E.residual(E.U));
    PetscCall(E.measure(E.F, at));
    PetscCall(TestEquilibrium(E, at, found));
    if (*found) PetscFunctionReturn(0);
    PetscCall(VecCopy(E.A, E.U));
    E.unread.clear();
    PetscCall(StepToEquilibrium(E, found, at));
  }
  PetscFunctionReturn(0);
}

/* Names the row with the largest residual in F of those other than forces and holonomic constraints */
PetscErrorCode WorstRate(const Equilibrium &E, std::string *name)
{
  struct {
    double value;
    int    row;
  } mine{0, -1}, worst;
  std::vector<unsigned char> role;
  const double              *f;
  PetscFunctionBegin;
  PetscCall(RolesOf(E.R, role));
  PetscCall(VecGetArrayRead(E.F, &f));
  for (PetscInt i = 0; i < E.R.n; i++) {
    if (role[i] == TSHHT3_COORDINATE || role[i] == TSHHT3_HOLONOMIC || std::binary_search(E.unread.begin(), E.unread.end(), i + E.R.start)) continue;
    if (std::abs(f[i]) > mine.value) mine = {std::abs(f[i]), (int)(i + E.R.start)};
  }
  PetscCall(VecRestoreArrayRead(E.F, &f));
  PetscCallMPI(MPI_Allreduce(&mine, &worst, 1, MPI_DOUBLE_INT, MPI_MAXLOC, E.R.scene.comm));
  *name = worst.row < 0 ? "none" : UnknownName(*E.R.model, worst.row);
  PetscFunctionReturn(0);
}

/* text: which equations of equilibrium U violates, for the message if none was found */
PetscErrorCode DescribeRest(Equilibrium &E, std::string *text)
{
  Unbalanced at;
  char       part[200];
  double     rounding_force;
  PetscFunctionBegin;
  PetscCall(E.residual(E.U));
  PetscCall(E.measure(E.F, at));
  PetscCall(RoundingForce(E, &rounding_force));
  const bool balanced = at.other > 0 && at.force <= std::max(force_tolerance * E.force_scale, rounding_factor * rounding_force) && at.misfit <= force_tolerance * E.size;
  PetscCall(PetscSNPrintf(part, sizeof(part), "a force of %g (moments over the scene's size) is left on %s, constraints are violated by %g", at.force, E.R.scene.bodyName(at.body).c_str(), at.misfit));
  *text = balanced ? "forces are balanced" : part;
  if (at.other > 0) {
    std::string worst;
    PetscCall(WorstRate(E, &worst));
    PetscCall(PetscSNPrintf(part, sizeof(part), ", %smotions of velocities, rates of states and definitions%s by %g, most in ", balanced ? "but " : "", balanced ? " are violated" : "", at.other));
    *text += part + worst;
  }
  PetscFunctionReturn(0);
}

} // namespace

/* U: start of the iteration and result; undefined after an error */
PetscErrorCode RelaxAt(Runtime &R, double t, Vec U, PetscInt *iterations)
{
  Equilibrium E(R, t);
  Unbalanced  at;
  bool        found = false;
  PetscFunctionBegin;
  PetscCall(E.create(U, "scene_equilibrium_"));
  PetscCall(VecDuplicate(U, &E.residual_at_start));
  PetscCall(VecDuplicate(U, &E.residual_at_rest));
  PetscCall(FindEquilibriumState(E, U, &found, at));
  if (!found) {
    std::string what;
    PetscCall(DescribeRest(E, &what));
    SETERRQ(R.scene.comm, PETSC_ERR_CONV_FAILED,
            "no static equilibrium found in %d corrections: %s.\n"
            "Start nearer to it, hold what is free to move for ever (friction holds nothing, since it is zero at rest), or stop what never rests: a motion of constant velocity, a state with a constant rate",
            (int)E.iterations, what.c_str());
  }
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
  M.start_memories.resize(Memories(R)); /* full turns of angles on the way count (SceneEquilibrium.TurnsOnTheWay) */
  CopyMemories(R, M.start_memories.data(), false);
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
