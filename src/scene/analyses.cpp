/*
  Analyses that move a run which has not begun: AssembleAt(), Kinematics() and StaticEquilibrium(). Positions that satisfy the constraints and motions of a time t are found by
  damped Newton iterations on the scene's own matrix, with all velocities and accelerations zero:

    (F_u + r F_u' + s F_u'') d = (0, Phi),   s large: d is the smallest step in the metric of the mass matrix.

  Steps are shortened to largest_turn (still.h). Velocities, accelerations and multipliers are then those of a consistent start from these positions.

  Where there are several positions near by, as in a four-bar that can change from one way of assembly to the other, those that the motion leads to are meant. So time is divided
  (FollowMotions()) into steps of largest_turn at most, whose first Newton iteration is the predictor along the velocities. A step is too long if the inverse of the constraints'
  derivatives has changed in it by so much that iterations with the old and with the new one differ: if one of their singular values has changed its sign, the step has come to another
  branch. Where branches do cross, it does so in steps of any length, and the one is taken whose velocities go on.
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
/* Largest change of the second iteration of a step by the change of the constraints' derivatives within the step, relative: a change of sign of a singular value makes it more than 1 */
constexpr double largest_change = 0.5;
/* A step whose predictor is shorter, in units of largest_turn, and which is too long nevertheless, is at a point where branches cross (Analyses.KinematicsThroughChangePoints) */
constexpr double shortest_step = 1. / 1024;
/* Shortening of a step at once, so that none is as short as rounding of the time (Analyses.AssemblyOfWhatIsNoNumber) */
constexpr double most_shortening = 1. / 16;
/* Steps across such a point, times the one that was too long; largest change of velocities in them, relative to the largest velocity */
constexpr double steps_across[] = {4, 8, 16}, largest_bend = 0.1;
/* Newton steps shorter than this, in radians or parts of the scene's size, are rounding and end the iteration */
constexpr double negligible_step = 1e-13;
/* Second iterations that say nothing of the constraints' derivatives: rounding of the constraints times the inverse of these near change points */
constexpr double negligible_bend = 1e-11;
/* Of the last Newton step of a step that is followed: far less than branches are apart */
constexpr double accurate_step = 1e-9;
/* Growth of the speed at which a motion has come to its end, as where a linkage locks; over steps that are longer than long_step, in units of largest_turn, which a start from rest does not do */
constexpr double locked_speed = 100, long_step = 0.1;

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

/* What Newton's iteration has come to */
struct Approach {
  double first   = 0;        /* length of the first step, in units of largest_turn */
  double last    = INFINITY; /* of the last one */
  bool   regular = true;     /* the step from the positions before it is not too long */
};

/* After the second iteration, with the derivatives at the end of the first one: A is what it would have been with those at its beginning */
PetscErrorCode CompareIterations(AssemblySystem &E, bool *regular)
{
  double change, old;
  PetscFunctionBegin;
  PetscCall(VecWAXPY(E.next, -1, E.A, E.d));
  PetscCall(E.reach(E.next, &change));
  PetscCall(E.reach(E.A, &old));
  *regular = change <= largest_change * old || old * largest_turn <= negligible_bend;
  PetscFunctionReturn(0);
}

/* Moves E.U to the nearest positions that satisfy the constraints at E.t, as far as Newton's iteration gets; E.V is transformed where the axes of Euler angles change. following: it ends where the
   step from the positions before is too long. */
PetscErrorCode MeetConstraints(AssemblySystem &E, bool following, Approach *by)
{
  bool improved;
  PetscFunctionBegin;
  *by = {};
  PetscCall(E.evaluateConstraints(E.U));
  double allowed = newton_iterations;
  for (int it = 0; it < allowed && E.misfit > 0; it++) {
    const double before = E.misfit;
    PetscCall(E.newtonStep(&by->last));
    if (it == 0) by->first = by->last;
    if (it == 0) by->regular = by->first <= 1;
    if (it == 1 && by->regular && std::isfinite(by->last)) PetscCall(CompareIterations(E, &by->regular));
    if (following && !by->regular) break;
    if (it == 0) allowed += std::min(2 * by->first, max_extra_iterations); /* a small motion can drive a large one through gears (Analyses.KinematicsOfWhatIsGearedUp) */
    if (!std::isfinite(by->last) || by->last * largest_turn <= negligible_step) break;
    PetscCall(DampedStep(E, by->last, &improved));
    PetscCall(PetscInfo(nullptr, "scene: assembly at t = %g, %d: misfit %g, a step of %g\n", E.t, it, E.misfit, by->last * largest_turn));
    if (!improved) {
      E.misfit = before;
      break;
    }
    PetscCall(VecCopy(E.next, E.U));
    PetscCall(Remember(E.R, E.U, E.zero));
    PetscCall(RenewAxes(E.R, E.U, E.V));
  }
  PetscFunctionReturn(0);
}

/* Either the violations are within the tolerance, as lengths and as sines (Analyses.AssemblyThatFallsShort), or the last Newton step is, as in scenes so large that rounding of
   lengths exceeds the tolerance (Analyses.KinematicsInAnyUnitsOfLength) */
bool Met(const AssemblySystem &E, const Approach &by)
{
  const double tolerance = E.R.scene.start.tolerance;
  return E.misfit <= tolerance * std::min(1.0, E.size) || by.last * largest_turn <= tolerance;
}

/* The error that E.t cannot be reached; t: the time that was asked for; where: what is known of how far it can be */
PetscErrorCode NotAssembled(AssemblySystem &E, double t, const std::string &where)
{
  std::string worst;
  PetscFunctionBegin;
  PetscCall(WorstRow(E, &worst));
  SETERRQ(E.R.scene.comm, PETSC_ERR_CONV_FAILED,
          "the scene cannot be assembled at t = %g: %sconstraints or motions are violated by %g%s.\nTake smaller steps in time, or start nearer to where they are met", t, where.c_str(),
          E.misfit, worst.c_str());
}

/* MeetConstraints() in one go */
PetscErrorCode MustMeetConstraints(AssemblySystem &E, double t)
{
  Approach by;
  PetscFunctionBegin;
  PetscCall(MeetConstraints(E, false, &by));
  if (!Met(E, by)) PetscCall(NotAssembled(E, t, E.t == t ? "" : "on the way there, at t = " + Show(E.t) + ", "));
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

/* Positions, velocities, axes and memories of a run, to be restored where an attempt fails */
class KeptPositions
{
public:
  KeptPositions(Runtime &run, Vec U, Vec V) : R(run), now_{U, V, run.axes} {}
  ~KeptPositions()
  {
    for (Vec &x : kept_) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&x));
  }
  KeptPositions(const KeptPositions &) = delete;
  PetscErrorCode keep()
  {
    PetscFunctionBegin;
    for (int k = 0; k < 3; k++) {
      if (!kept_[k]) PetscCall(VecDuplicate(now_[k], &kept_[k]));
      PetscCall(VecCopy(now_[k], kept_[k]));
    }
    queried_ = R.queried_angles;
    PetscFunctionReturn(0);
  }
  PetscErrorCode restore()
  {
    PetscFunctionBegin;
    R.queried_angles = queried_;
    for (int k = 0; k < 3; k++) PetscCall(VecCopy(kept_[k], now_[k]));
    PetscCall(UseAxes(R));
    R.accepted_move = -1; /* the bodies are where the attempt has left them */
    PetscFunctionReturn(0);
  }

private:
  Runtime                  &R;
  Vec                       now_[3], kept_[3] = {};
  std::vector<CountedAngle> queried_;
};

/* v: what the motions move in E.U at E.t within the time dt; infinite where constraints depend on each other */
PetscErrorCode DisplacementAlong(AssemblySystem &E, double dt, Vec v)
{
  const double t = E.t;
  double       part;
  PetscFunctionBegin;
  PetscCall(Jacobian(E.R, t, E.U, E.zero, E.zero, state_shift, mass_shift, E.J));
  E.t = t - dt / 2;
  PetscCall(E.evaluateConstraints(E.U));
  PetscCall(VecCopy(E.F, E.A));
  E.t = t + dt / 2;
  PetscCall(E.evaluateConstraints(E.U));
  PetscCall(VecAXPY(E.F, -1, E.A));
  E.t = t;
  PetscCall(E.solveStep(v, &part));
  if (!std::isfinite(part)) PetscCall(VecSet(v, INFINITY));
  PetscFunctionReturn(0);
}

/* From `at` across a point where branches of the motion cross, which is not farther than about dt: to positions, not beyond t, whose velocities go on, if there are some */
PetscErrorCode StepAcross(AssemblySystem &E, KeptPositions &before, double at, double t, double dt, bool *across)
{
  Vec      v[2];
  double   size[2], bend;
  Approach by;
  PetscFunctionBegin;
  *across = false;
  for (Vec &x : v) PetscCall(VecDuplicate(E.U, &x));
  E.t = at;
  PetscCall(DisplacementAlong(E, dt, v[0]));
  for (double factor : steps_across) {
    const bool ends = std::abs(factor * dt) >= std::abs(t - at);
    E.t             = ends ? t : at + factor * dt;
    PetscCall(MeetConstraints(E, false, &by));
    PetscCall(DisplacementAlong(E, dt, v[1]));
    for (int k = 0; k < 2; k++) PetscCall(E.reach(v[k], &size[k]));
    PetscCall(VecAXPY(v[1], -1, v[0]));
    PetscCall(E.reach(v[1], &bend));
    PetscCall(PetscInfo(nullptr, "scene: across a change point at t = %g to %g: velocities change by %g\n", at, E.t, bend / size[0]));
    PetscCall(E.evaluateConstraints(E.U));
    *across = by.first <= 1 && Met(E, by) && bend <= largest_bend * std::max(size[0], size[1]);
    if (*across) break;
    PetscCall(before.restore());
    if (ends) break;
  }
  for (Vec &x : v) PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

/* The end of an interval of time from `at` to `next` in which no motion turns by more than max_motion_angle: the nearest positions that satisfy a motion determine its angle only up to full turns */
double WithoutFullTurns(const SceneData &s, double at, double next)
{
  for (double middle; TurnOfMotions(s, at, next) > max_motion_angle; next = middle) {
    middle = at + (next - at) / 2;
    if (middle == at || middle == next) break;
  }
  return next;
}

/* Follows the motions from the time `at`, where E.U meets the constraints, to t */
class Follower
{
public:
  Follower(AssemblySystem &system, double end) : E(system), t_(end), at_(system.t), step_(end - at_), before_(system.R, system.U, system.V) {}

  PetscErrorCode run()
  {
    PetscFunctionBegin;
    while (at_ != t_) {
      PetscCall(before_.keep());
      PetscCall(step());
    }
    PetscFunctionReturn(0);
  }

private:
  AssemblySystem &E;
  const double    t_;
  double          at_, step_, slowest_ = INFINITY; /* slowest_: the least mean speed of a long step so far, in units of largest_turn */
  KeptPositions   before_;

  PetscErrorCode step()
  {
    Approach by;
    PetscFunctionBegin;
    for (;;) {
      E.t   = WithoutFullTurns(E.R.scene, at_, std::abs(step_) >= std::abs(t_ - at_) ? t_ : at_ + step_);
      step_ = E.t - at_;
      PetscCall(MeetConstraints(E, true, &by));
      if (by.regular && (E.misfit == 0 || by.last * largest_turn <= accurate_step)) break;
      PetscCall(before_.restore());
      const double shorter = by.first > 1 ? std::max(0.9 / by.first, most_shortening) : 0.5;
      if (by.first < shortest_step || at_ + step_ * shorter == at_) {
        PetscCall(cross(by.first / std::abs(step_)));
        PetscFunctionReturn(0);
      }
      step_ *= shorter;
    }
    at_ = E.t;
    if (by.first > long_step) slowest_ = std::min(slowest_, by.first / std::abs(step_));
    step_ *= std::min(2., 0.9 / by.first);
    PetscFunctionReturn(0);
  }

  /* Over a point where branches cross. Where that fails, no positions lead on if the speed has grown beyond bounds; else derivatives are not those of smooth constraints, and the next positions are
     those that Newton's iteration finds. */
  PetscErrorCode cross(double speed)
  {
    const double next = E.t;
    bool         across;
    PetscFunctionBegin;
    PetscCall(StepAcross(E, before_, at_, t_, step_, &across));
    if (!across && speed > locked_speed * slowest_) {
      Approach by;
      E.t = next;
      PetscCall(MeetConstraints(E, false, &by));
      PetscCall(NotAssembled(E, t_, "no motion leads there beyond t = " + Show(at_) + ", where it gets infinitely fast; "));
    }
    if (!across) {
      E.t = WithoutFullTurns(E.R.scene, at_, t_);
      PetscCall(MustMeetConstraints(E, t_));
    }
    at_ = E.t;
    PetscFunctionReturn(0);
  }
};

/* Follows the motions from `from` to t. Positions that do not meet the constraints before, as where they are not asked to at the start, go to the nearest ones first. */
PetscErrorCode FollowMotions(Runtime &R, double from, double t, Vec U, Vec V)
{
  AssemblySystem E(R, from);
  PetscFunctionBegin;
  PetscCall(E.create(U, "scene_assembly_"));
  PetscCall(RolesOf(E.R, E.role));
  PetscCall(VecCopy(V, E.V));
  PetscCall(E.evaluateConstraints(E.U));
  if (!(E.misfit <= R.scene.start.tolerance * std::min(1.0, E.size)) || from == t) {
    E.t = WithoutFullTurns(R.scene, from, t);
    PetscCall(MustMeetConstraints(E, t));
  }
  PetscCall(Follower(E, t).run());
  PetscCall(VecCopy(E.U, U));
  PetscCall(VecCopy(E.V, V));
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
  Vec       U, V;
  PetscFunctionBegin;
  PetscCall(NotBegun(ts, call, &R));
  PetscCall(TSGetTime(ts, &before));
  PetscCall(TS2GetSolution(ts, &U, &V));
  KeptPositions kept(*R, U, V);
  PetscCall(kept.keep());
  const PetscErrorCode failed = Guarded([&] {
    PetscReal t;
    PetscFunctionBegin;
    PetscCall(move(*R, U, V));
    PetscCall(TSGetTime(ts, &t));
    PetscCall(CheckDropped(*R, t, U, V));
    PetscFunctionReturn(PetscErrorCode(0));
  });
  if (failed) {
    PetscCall(kept.restore());
    PetscCall(TSSetTime(ts, before));
  }
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
