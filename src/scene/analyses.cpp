/*
  Analyses that change the state of a run before its first step: AssembleAt(), Kinematics() and StaticEquilibrium().
  Damped Newton iterations with the scene's Jacobian, with all velocities and accelerations zero, find positions that
  satisfy the constraints and motions at a time t:

    (F_u + r F_u' + s F_u'') d = (0, Phi),   s large: d is the smallest step in the metric of the mass matrix.

  Steps are shortened to largest_turn (still.h). A consistent start from these positions then gives velocities,
  accelerations and multipliers.

  If several positions satisfy the constraints, as of a four-bar linkage with two assembly modes, the one is wanted to
  which the motion leads continuously. FollowMotions() therefore divides the time into steps of at most largest_turn, in
  which the first Newton iteration is a prediction along the velocities. A step is too long if the inverse of the
  constraints' derivatives changes so much within it that Newton iterations with the old and with the new inverse
  differ: if a singular value has changed its sign, the step has reached another branch. Where branches cross, a
  singular value changes its sign in steps of any length; StepAcross() then takes the branch on which the velocities
  continue.
*/
#include "hhtdae/analyses.h"
#include "extension.h"
#include "guard.h"
#include "still.h"
#include <algorithm>
#include <string>
#include <vector>

namespace hhtdae
{

namespace
{

/* s in 1/s^2: 2^40, so that stiffnesses are negligible compared with s times the masses in the metric of a step; a
   power of two adds no rounding */
constexpr double mass_shift = 1099511627776.;
/* r in 1/s: with r = 0 the row of a first-order state whose rate does not depend on the state would be zero and the
   matrix singular. It is not a round number, since the rate constant of a user's state might be equal to a round number
   and cancel it (Analyses.KinematicsBesideIntegrators). */
constexpr double state_shift       = 0.7310585786300049;
constexpr int    newton_iterations = 100, max_step_halvings = 6; /* largest number of iterations of an assembly, and of halvings of a step */
/* Limit on iterations beyond newton_iterations, which are allowed in proportion to the length of the first step (Analyses.KinematicsOfWhatIsGearedUp) */
constexpr double max_extra_iterations = 1e4;
/* Largest change of an angle that a motion prescribes between two assemblies, rad: well below half a turn, beyond which
   full turns of angles would be lost (CountedAngles.KinematicsOverManyTurns) */
constexpr double max_motion_angle = 1;
/* Largest relative change of the second iteration of a step that the change of the constraints' derivatives within the
   step may cause; if a singular value changes its sign it is more than 1 (CompareIterations()) */
constexpr double largest_change = 0.5;
/* If a step is too long although its prediction is shorter than this, in units of largest_turn, branches cross there
   (Analyses.KinematicsThroughChangePoints) */
constexpr double shortest_step = 1. / 1024;
/* Smallest factor by which a step is shortened at once, so that no step is as short as rounding of the time
   (Analyses.AssemblyOfWhatIsNoNumber) */
constexpr double most_shortening = 1. / 16;
/* Lengths of the steps tried across such a point, in units of the step that was too long; and the largest change of
   velocities over them, relative to the largest velocity */
constexpr double steps_across[] = {4, 8, 16}, largest_bend = 0.1;
/* Newton steps shorter than this, in radians or relative to the scene's size, are rounding and end the iteration */
constexpr double negligible_step = 1e-13;
/* A second iteration shorter than this is not compared, since near change points it is rounding of the constraints
   times the inverse of their derivatives */
constexpr double negligible_bend = 1e-11;
/* Largest last Newton iteration of an accepted step of Follower: far less than the distance between branches */
constexpr double accurate_step = 1e-9;
/* Growth of the speed, relative to the slowest step so far, at which a motion cannot go on because the linkage locks.
   Only steps longer than long_step, in units of largest_turn, are compared, since in a start from rest the speed grows by any
   factor */
constexpr double locked_speed = 100, long_step = 0.1;

/* |Phi_q^T lambda| relative to |Phi_q| |lambda|, with lengths relative to the scene's size, up to which a notice says that constraints nearly depend on one another. Rounding of the
   constraints' derivatives in time, over its square, is the relative error of accelerations and loads (Analyses.KinematicsAtADeadCentre) */
constexpr double nearly_dependent = 1e-5;

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

/* Result of MeetConstraints() */
struct Approach {
  double first   = 0;        /* length of the first step, in units of largest_turn */
  double last    = INFINITY; /* length of the last step, likewise */
  bool   regular = true;     /* the step in time from the positions before is not too long */
};

/* Compares the second Newton iteration d, made with the derivatives after the first one, with A, the same iteration
   with the derivatives before the first one */
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

/* Newton's iteration from E.U towards the nearest positions that satisfy the constraints at E.t; Met() tells whether it
   has reached them. E.V is transformed if the axes of Euler angles change. following: the iteration ends as soon as the
   step in time from the positions before proves too long. */
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

/* Whether the constraints are satisfied: the violations, lengths or sines, are within the tolerance
   (Analyses.AssemblyThatFallsShort), or else the last Newton step is, as in scenes so large that rounding of lengths
   exceeds the tolerance (Analyses.KinematicsInAnyUnitsOfLength) */
bool Met(const AssemblySystem &E, const Approach &by)
{
  const double tolerance = E.R.scene.start.tolerance;
  return E.misfit <= tolerance * std::min(1.0, E.size) || by.last * largest_turn <= tolerance;
}

/* Raises the error that positions at E.t cannot be found; t: the requested time; where: part of the message that says
   how far the motion leads */
PetscErrorCode NotAssembled(AssemblySystem &E, double t, const std::string &where)
{
  std::string worst;
  PetscFunctionBegin;
  PetscCall(WorstRow(E, &worst));
  SETERRQ(E.R.scene.comm, PETSC_ERR_CONV_FAILED,
          "the scene cannot be assembled at t = %g: %sconstraints or motions are violated by %g%s.\nTake smaller steps in time, or start nearer to where they are met", t, where.c_str(),
          E.misfit, worst.c_str());
}

/* MeetConstraints() without division into steps; error if the constraints are not satisfied */
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

/* Keeps positions, velocities, axes and counted angles of a run, to restore them if an attempt fails */
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
    R.accepted_move = -1; /* the bodies still have the poses of the attempt */
    PetscFunctionReturn(0);
  }

private:
  Runtime                  &R;
  Vec                       now_[3], kept_[3] = {};
  std::vector<CountedAngle> queried_;
};

/* v: displacement of E.U within the time dt around E.t that the motions prescribe; infinite if the constraints are
   dependent */
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

/* Steps from the time `at` across a point where branches of the motion cross, which is at most about dt away. *across:
   positions were found, at t at the latest, at which the velocities are those at `at`, up to largest_bend */
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

/* The end of the longest interval from `at` towards `next`, found by halving, in which no motion turns by more than
   max_motion_angle: positions that satisfy a motion determine its angle only up to full turns */
double WithoutFullTurns(const SceneData &s, double at, double next)
{
  for (double middle; TurnOfMotions(s, at, next) > max_motion_angle; next = middle) {
    middle = at + (next - at) / 2;
    if (middle == at || middle == next) break;
  }
  return next;
}

/* Follows the motions from the time E.t, at which E.U satisfies the constraints, to `end` */
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
  double          at_, step_, slowest_ = INFINITY; /* slowest_: smallest mean speed of the steps longer than long_step, largest_turn per time */
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

  /* Steps across a point where branches cross. If that fails and the speed has grown without bounds, the motion cannot
     go on, which is an error. If the speed has not, the constraints are not smooth there, and the positions that
     Newton's iteration finds are taken. */
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

/* The length that is 1 in the metric of TellDependent(), for each own unknown: coordinates of bodies as in reach() */
std::vector<double> Units(const StillSystem &E)
{
  const Runtime      &R = E.R;
  std::vector<double> unit(R.n, 1.0);
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k          = R.bodies.body[b];
    const int        directions = PlanarScene(k.kind) ? 2 : 3, whole = Coordinates(k.kind);
    for (int c = 0; c < R.bodies.coordinates(b); c++) unit[k.first + c] = c < directions ? E.size : c < whole ? 1 : E.size * std::sqrt(R.scene.bodies[k.id].mass);
  }
  for (const auto &e : R.scene.extensions)
    for (PetscInt i = 0; i < e->coordinates(); i++) unit[e->start[R.rank] - R.start + i] = E.size;
  return unit;
}

/* P: [1 Phi_q^T; Phi_q 0] at E.U, with coordinates in their units */
PetscErrorCode GeometryOfConstraints(AssemblySystem &E, Mat *P)
{
  const Runtime            &R    = E.R;
  const std::vector<double> unit = Units(E);
  std::vector<PetscInt>     others;
  Mat                       B;
  double                   *x;
  PetscFunctionBegin;
  PetscCall(Jacobian(E.R, E.t, E.U, E.zero, E.zero, state_shift, mass_shift, E.J));
  PetscCall(VecGetArrayWrite(E.d, &x));
  std::copy(unit.begin(), unit.end(), x);
  PetscCall(VecRestoreArrayWrite(E.d, &x));
  for (PetscInt i = 0; i < R.n; i++)
    if (E.role[i] != TSHHT3_HOLONOMIC) others.push_back(R.start + i);
  PetscCall(MatDuplicate(E.J, MAT_COPY_VALUES, &B));
  PetscCall(MatDiagonalScale(B, nullptr, E.d));
  PetscCall(MatSetOption(B, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatZeroRows(B, (PetscInt)others.size(), others.data(), 0.5, nullptr, nullptr));
  PetscCall(MatTranspose(B, MAT_INITIAL_MATRIX, P));
  PetscCall(MatAXPY(*P, 1, B, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&B));
  PetscFunctionReturn(0);
}

/* A notice where constraints nearly depend on one another at the positions U, to which a run has been moved */
PetscErrorCode TellDependent(TS ts, Runtime &R, double t, Vec U)
{
  AssemblySystem E(R, t);
  PetscErrorCode (*name)(TS, Mat, IS, PetscReal, PetscInt, PetscInt *, PetscInt *);
  constexpr PetscInt max_rows = 4;
  Mat                P;
  PetscInt           n, row[max_rows + 1];
  std::string        names;
  PetscFunctionBegin;
  PetscCall(PetscObjectQueryFunction((PetscObject)ts, "TSHHT3NameDependent_C", &name));
  PetscCall(ISGetSize(R.roles[TSHHT3_HOLONOMIC], &n));
  if (!n || !name) PetscFunctionReturn(0); /* no name: a TS of another type */
  PetscCall(E.create(U, "scene_assembly_"));
  PetscCall(RolesOf(R, E.role));
  PetscCall(GeometryOfConstraints(E, &P));
  PetscCall((*name)(ts, P, R.roles[TSHHT3_HOLONOMIC], nearly_dependent, max_rows + 1, &n, row));
  PetscCall(MatDestroy(&P));
  for (PetscInt i = 0; i < std::min(n, max_rows); i++) names += (i ? ", " : "") + UnknownName(*R.model, row[i]);
  if (n)
    PetscCall(PetscPrintf(R.scene.comm, "scene: at t = %g constraints nearly depend on one another, as at a dead centre (%s%s): velocities, accelerations and loads have few digits there, or none\n", t,
                          names.c_str(), n > max_rows ? ", ..." : ""));
  PetscFunctionReturn(0);
}

/* Follows the motions from `from` to t. Positions that violate the constraints, since the scene was not assembled at
   the start, are first moved to the nearest ones that satisfy them. */
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
  PetscCall(TellDependent(ts, R, t, U));
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

/* Calls move(run, U, V), which changes the state of ts; after an error the state from before is restored */
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
