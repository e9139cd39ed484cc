/*
  Analyses that move a run which has not begun: AssembleAt(), Kinematics() and StaticEquilibrium(). Positions that satisfy the constraints and motions of a time t are found by
  damped Newton iterations on the scene's own matrix, with all velocities and accelerations zero:

    (F_u + r F_u' + s F_u'') d = (0, Phi),   s large: d is the smallest step in the metric of the mass matrix.

  Steps are limited to largest_turn (still.h). Velocities, accelerations and multipliers then follow from a consistent start at these positions.
*/
#include "hhtdae/analyses.h"
#include "guard.h"
#include "still.h"
#include <algorithm>
#include <string>
#include <vector>

namespace hhtdae
{

namespace
{

/* s in 1/s^2: 2^40, so that stiffnesses are negligible compared with the masses in the metric of a step; as a power of two it adds no rounding */
constexpr double mass_shift = 1099511627776.;
/* r in 1/s: with r = 0 the row of a first-order state whose rate does not depend on the state would be zero and the
   matrix singular. It is not a round number, since the rate constant of a user's state might be equal to a round number
   and cancel it (Analyses.KinematicsBesideIntegrators). */
constexpr double state_shift       = 0.7310585786300049;
constexpr int    newton_iterations = 100, max_step_halvings = 6; /* largest numbers: of iterations in an assembly, and of halvings of a step */
/* Limit on iterations beyond newton_iterations, which are allowed in proportion to the length of the first step (Analyses.KinematicsOfWhatIsGearedUp) */
constexpr double max_extra_iterations = 1e4;
/* Largest change of an angle that a motion prescribes between two assemblies, rad: well below half a turn, beyond which
   full turns of angles would be lost (CountedAngles.KinematicsOverManyTurns) */
constexpr double max_motion_angle = 1;
/* Newton steps shorter than this, in radians or parts of the scene's size, are rounding and end the iteration */
constexpr double negligible_step = 1e-13;

struct AssemblySystem : StillSystem {
  using StillSystem::StillSystem;
  std::vector<unsigned char> role;              /* TSHHT3Role of this rank's unknowns */
  double                     misfit = INFINITY; /* largest violation of a holonomic constraint, in the unit of its row */

  /* Sets all entries of x to zero but those of role r */
  PetscErrorCode keepRole(TSHHT3Role r, Vec x) const
  {
    double *y;
    PetscFunctionBegin;
    PetscCall(VecGetArray(x, &y));
    for (PetscInt i = 0; i < R.n; i++)
      if (role[i] != r) y[i] = 0;
    PetscCall(VecRestoreArray(x, &y));
    PetscFunctionReturn(0);
  }
  /* Sets misfit and F, the violations of the holonomic constraints, at u */
  PetscErrorCode evaluateConstraints(Vec u)
  {
    Unbalanced at;
    PetscFunctionBegin;
    PetscCall(residual(u));
    PetscCall(keepRole(TSHHT3_HOLONOMIC, F));
    PetscCall(measure(F, at));
    misfit = at.misfit;
    PetscFunctionReturn(0);
  }
  /* x: the Newton step for the violations in F; part: its length in units of largest_turn, infinite if the solve fails */
  PetscErrorCode solveStep(Vec x, double *part)
  {
    KSPConvergedReason reason;
    PetscFunctionBegin;
    *part = INFINITY;
    PetscCall(KSPSolve(ksp, F, x));
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    if (reason < 0) PetscFunctionReturn(0);
    PetscCall(keepRole(TSHHT3_COORDINATE, x));
    PetscCall(reach(x, part));
    PetscFunctionReturn(0);
  }
  PetscErrorCode newtonStep(double *part)
  {
    PetscFunctionBegin;
    PetscCall(Jacobian(R, t, U, zero, zero, state_shift, mass_shift, J));
    PetscCall(solveStep(d, part));
    PetscFunctionReturn(0);
  }
};

/*
  Adds the step d, whose length is `part` in units of largest_turn, halved until it reduces the violation. Rows have different
  units (lengths, sines, those of users), so that a norm of the violations does not measure progress. The length of the next
  simplified Newton step, with the same matrix, does: Deuflhard's natural monotonicity test
  (Analyses.KinematicsInAnyUnitsOfLength).
*/
PetscErrorCode DampedStep(AssemblySystem &E, double part, bool *improved)
{
  double fraction = std::min(1.0, 1 / part), left;
  PetscFunctionBegin;
  *improved = false;
  for (int cut = 0; cut <= max_step_halvings && !*improved; cut++, fraction /= 2) {
    PetscCall(VecWAXPY(E.next, -fraction, E.d, E.U));
    PetscCall(E.evaluateConstraints(E.next));
    if (!std::isfinite(E.misfit)) continue;
    PetscCall(E.solveStep(E.A, &left));
    *improved = left < part;
  }
  PetscFunctionReturn(0);
}

/* name: the most violated constraint at U, for messages; empty if the violation is infinite or NaN */
PetscErrorCode WorstRow(AssemblySystem &E, std::string *name)
{
  const double misfit = E.misfit;
  PetscReal    worst;
  PetscInt     row;
  PetscFunctionBegin;
  PetscCall(E.evaluateConstraints(E.U));
  E.misfit = misfit;
  PetscCall(VecAbs(E.F));
  PetscCall(VecMax(E.F, &row, &worst));
  if (row >= 0 && std::isfinite(misfit)) *name = ", most in " + UnknownName(*E.R.model, row);
  PetscFunctionReturn(0);
}

/* Moves U to the nearest positions that satisfy the constraints at t; V is transformed where the axes of Euler angles change */
PetscErrorCode MeetConstraints(Runtime &R, double t, Vec U, Vec V)
{
  AssemblySystem E(R, t);
  double     part = INFINITY;
  bool           improved;
  PetscFunctionBegin;
  PetscCall(E.create(U, "scene_assembly_"));
  PetscCall(RolesOf(E.R, E.role));
  PetscCall(VecCopy(V, E.V));
  PetscCall(E.evaluateConstraints(E.U));
  double allowed = newton_iterations;
  for (int it = 0; it < allowed && E.misfit > 0; it++) {
    const double before = E.misfit;
    PetscCall(E.newtonStep(&part));
    if (it == 0) allowed += std::min(2 * part, max_extra_iterations); /* a small motion can drive a large one through gears (Analyses.KinematicsOfWhatIsGearedUp) */
    if (!std::isfinite(part) || part * largest_turn <= negligible_step) break;
    PetscCall(DampedStep(E, part, &improved));
    PetscCall(PetscInfo(nullptr, "scene: assembly at t = %g, %d: misfit %g, a step of %g\n", E.t, it, E.misfit, part * largest_turn));
    if (!improved) {
      E.misfit = before;
      break;
    }
    PetscCall(VecCopy(E.next, E.U));
    PetscCall(Remember(E.R, E.U, E.zero));
    PetscCall(RenewAxes(E.R, E.U, E.V));
  }
  /* Success if the violations are within the tolerance, both as lengths and as sines (Analyses.AssemblyThatFallsShort),
     or if the last Newton step is, in scenes so large that rounding of lengths exceeds the tolerance
     (Analyses.KinematicsInAnyUnitsOfLength) */
  const double tolerance = E.R.scene.start.tolerance;
  const bool   met       = E.misfit <= tolerance * std::min(1.0, E.size) || part * largest_turn <= tolerance;
  if (!met) {
    std::string worst;
    PetscCall(WorstRow(E, &worst));
    SETERRQ(E.R.scene.comm, PETSC_ERR_CONV_FAILED,
            "the scene cannot be assembled at t = %g: constraints or motions are violated by %g%s.\nTake smaller steps in time, or start nearer to positions that satisfy them", E.t,
            E.misfit, worst.c_str());
  }
  PetscCall(VecCopy(E.U, U));
  PetscCall(VecCopy(E.V, V));
  PetscFunctionReturn(0);
}

/* Largest change of an angle, rad, that a motion prescribes between two times */
double TurnOfMotions(const SceneData &s, double from, double to)
{
  double worst = 0, a = 0, b = 0;
  for (const StoreBase *store : s.order)
    for (PetscInt e = 0; e < store->size(); e++)
      if (store->drivenAngle(e, from, &a) && store->drivenAngle(e, to, &b) && store->unknowns(e)) worst = std::max(worst, std::abs(b - a));
  return worst;
}

/* Calls MeetConstraints() at the ends of intervals of time in which no motion turns by more than max_motion_angle, since
   the nearest positions that satisfy a motion determine its angle only up to full turns */
PetscErrorCode FollowMotions(Runtime &R, double from, double t, Vec U, Vec V)
{
  PetscFunctionBegin;
  for (double at = from; at != t;) {
    double next = t, middle = at + (t - at) / 2;
    while (TurnOfMotions(R.scene, at, next) > max_motion_angle && middle != at && middle != next) {
      next   = middle;
      middle = at + (next - at) / 2;
    }
    if (next != t) PetscCall(MeetConstraints(R, next, U, V));
    at = next;
  }
  PetscCall(MeetConstraints(R, t, U, V));
  PetscFunctionReturn(0);
}

PetscErrorCode Assembled(TS ts, PetscReal t, Runtime &R, Vec U, Vec V)
{
  PetscReal from;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &from));
  PetscCall(FollowMotions(R, from, t, U, V));
  PetscCall(TSSetTime(ts, t));
  PetscCall(ToNearestConsistent(ts));
  PetscFunctionReturn(0);
}

/* Moves the run to static equilibrium at t, after its positions have followed the motions to t */
PetscErrorCode AtRest(TS ts, PetscReal t, Runtime &R, Vec U, Vec V)
{
  PetscInt  iterations;
  PetscReal from;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &from));
  PetscCall(VecZeroEntries(V));
  PetscCall(FollowMotions(R, from, t, U, V));
  PetscCall(RelaxAt(R, t, U, &iterations));
  PetscCall(TSSetTime(ts, t));
  PetscCall(KeepStart(ts, V)); /* V is zero and also serves as the accelerations, which are zero */
  PetscCall(StartWithMotions(ts));
  PetscFunctionReturn(0);
}

/* Calls move(run, U, V), which takes ts to another state; after an error the state of the run is restored */
template <class Move> PetscErrorCode MoveRun(TS ts, const char *call, const Move &move)
{
  Runtime  *R;
  PetscReal before;
  Vec       now[3], kept[3];
  PetscFunctionBegin;
  PetscCall(NotBegun(ts, call, &R));
  PetscCall(TSGetTime(ts, &before));
  PetscCall(TS2GetSolution(ts, &now[0], &now[1]));
  now[2] = R->axes;
  for (int k = 0; k < 3; k++) {
    PetscCall(VecDuplicate(now[k], &kept[k]));
    PetscCall(VecCopy(now[k], kept[k]));
  }
  const std::vector<CountedAngle> queried = R->queried_angles;
  const PetscErrorCode            failed = Guarded([&] {
    PetscReal t;
    PetscFunctionBegin;
    PetscCall(move(*R, now[0], now[1]));
    PetscCall(TSGetTime(ts, &t));
    PetscCall(CheckDropped(*R, t, now[0], now[1]));
    PetscFunctionReturn(PetscErrorCode(0));
  });
  if (failed) {
    R->queried_angles = queried;
    for (int k = 0; k < 3; k++) PetscCall(VecCopy(kept[k], now[k]));
    PetscCall(UseAxes(*R));
    PetscCall(TSSetTime(ts, before));
  }
  for (Vec &x : kept) PetscCall(VecDestroy(&x));
  PetscCall(failed);
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode StaticEquilibrium(TS ts, PetscReal t)
{
  PetscFunctionBegin;
  PetscCall(MoveRun(ts, "StaticEquilibrium()", [&](Runtime &R, Vec U, Vec V) { return AtRest(ts, t, R, U, V); }));
  PetscFunctionReturn(0);
}

PetscErrorCode AssembleAt(TS ts, PetscReal t)
{
  PetscFunctionBegin;
  PetscCall(MoveRun(ts, "AssembleAt()", [&](Runtime &R, Vec U, Vec V) { return Assembled(ts, t, R, U, V); }));
  PetscFunctionReturn(0);
}

PetscErrorCode Kinematics(TS ts, PetscReal t)
{
  Runtime *R;
  PetscInt velocities;
  PetscFunctionBegin;
  PetscCall(NotBegun(ts, "Kinematics()", &R));
  const PetscInt freedoms = R->scene.started.degreesOfFreedom();
  PetscCheck(freedoms <= 0 && R->scene.extensions.empty(), R->scene.comm, PETSC_ERR_ARG_WRONGSTATE,
             "Kinematics(): motions and joints leave %d degrees of freedom, must leave none; give more motions, or take AssembleAt(), StaticEquilibrium() or a run in time",
             (int)freedoms);
  PetscCall(ISGetSize(R->roles[TSHHT3_NONHOLONOMIC], &velocities));
  PetscCheck(!velocities, R->scene.comm, PETSC_ERR_ARG_WRONGSTATE,
             "Kinematics(): %d constraints or motions of velocities do not say where bodies are; give motions of displacements, or take a run in time", (int)velocities);
  PetscCall(AssembleAt(ts, t));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
