/*
  Analyses that move a run which has not begun. Positions that meet the constraints and motions of a time, by Newton's method on the scene's own matrix with rates of zero,

    (F_u + r F_u' + s F_u'') d = (0, Phi),   s large: the smallest d in the metric of the masses,

  cut short where bodies would go far. Velocities, accelerations and multipliers are those of a consistent start from there.
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

constexpr double heavy = 1099511627776.; /* 2^40: masses against stiffnesses */
constexpr double rates = 0.7310585786300049; /* 1/s, of states: the row of one that integrates what it does not change would be zero without; no round number, which a rate
                                               might be (Analyses.KinematicsBesideIntegrators) */
constexpr int    most_iterations = 100, most_cuts = 6;
constexpr double longest_way = 1e4; /* in moves, between two assemblies */
constexpr double largest_part = 1; /* rad, of a motion between two assemblies: far enough from half a turn; CountedAngles.KinematicsOverManyTurns */
constexpr double still = 1e-13; /* parts of the scene's size, radians: a move that is rounding */

struct Assembling : StillSystem {
  using StillSystem::StillSystem;
  std::vector<unsigned char> role; /* of own unknowns */
  double                     misfit = INFINITY;

  /* all entries but those of one role to zero */
  PetscErrorCode keep(TSHHT3Role r, Vec x) const
  {
    double *y;
    PetscFunctionBegin;
    PetscCall(VecGetArray(x, &y));
    for (PetscInt i = 0; i < R.n; i++)
      if (role[i] != r) y[i] = 0;
    PetscCall(VecRestoreArray(x, &y));
    PetscFunctionReturn(0);
  }
  /* misfit at u, its rows in F */
  PetscErrorCode look(Vec u)
  {
    Unbalanced at;
    PetscFunctionBegin;
    PetscCall(residual(u));
    PetscCall(keep(TSHHT3_HOLONOMIC, F));
    PetscCall(measure(F, at));
    misfit = at.misfit;
    PetscFunctionReturn(0);
  }
  /* the move x that meets the rows in F as the matrix has them; part: how far that is, infinite if there is none */
  PetscErrorCode move(Vec x, double *part)
  {
    KSPConvergedReason reason;
    PetscFunctionBegin;
    *part = INFINITY;
    PetscCall(KSPSolve(ksp, F, x));
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    if (reason < 0) PetscFunctionReturn(0);
    PetscCall(keep(TSHHT3_COORDINATE, x));
    PetscCall(reach(x, part));
    PetscFunctionReturn(0);
  }
  PetscErrorCode direction(double *part)
  {
    PetscFunctionBegin;
    PetscCall(Jacobian(R, t, U, zero, zero, rates, heavy, J));
    PetscCall(move(d, part));
    PetscFunctionReturn(0);
  }
};

/*
  As far along d, a move by `part`, as it brings the constraints nearer. Rows are lengths, sines and what users give, which cannot be told to have
  fallen together; how far the bodies would have to move next, by the same matrix, can (Deuflhard's natural monotonicity test,
  Analyses.KinematicsInAnyUnitsOfLength).
*/
PetscErrorCode Advance(Assembling &E, double part, bool *nearer)
{
  double factor = std::min(1.0, 1 / part), left;
  PetscFunctionBegin;
  *nearer = false;
  for (int cut = 0; cut <= most_cuts && !*nearer; cut++, factor /= 2) {
    PetscCall(VecWAXPY(E.next, -factor, E.d, E.U));
    PetscCall(E.look(E.next));
    if (!std::isfinite(E.misfit)) continue;
    PetscCall(E.move(E.A, &left));
    *nearer = left < part;
  }
  PetscFunctionReturn(0);
}

/* Of the constraints at U, for messages; none where they are no numbers */
PetscErrorCode WorstRow(Assembling &E, std::string *name)
{
  const double misfit = E.misfit;
  PetscReal    most;
  PetscInt     row;
  PetscFunctionBegin;
  PetscCall(E.look(E.U));
  E.misfit = misfit;
  PetscCall(VecAbs(E.F));
  PetscCall(VecMax(E.F, &row, &most));
  if (row >= 0 && std::isfinite(misfit)) *name = ", most in " + UnknownName(*E.R.model, row);
  PetscFunctionReturn(0);
}

/* From U, V to the nearest positions that meet the constraints at t; velocities go along with the axes of angles */
PetscErrorCode MeetConstraints(Runtime &R, double t, Vec U, Vec V)
{
  Assembling E(R, t);
  double     part = INFINITY;
  bool       nearer;
  PetscFunctionBegin;
  PetscCall(E.create(U, "scene_assembly_"));
  PetscCall(RolesOf(E.R, E.role));
  PetscCall(VecCopy(V, E.V));
  PetscCall(E.look(E.U));
  double allowed = most_iterations;
  for (int it = 0; it < allowed && E.misfit > 0; it++) {
    const double before = E.misfit;
    PetscCall(E.direction(&part));
    if (it == 0) allowed += std::min(2 * part, longest_way); /* a slow motion may turn what it drives by far (Analyses.KinematicsOfWhatIsGearedUp) */
    if (!std::isfinite(part) || part * largest_turn <= still) break;
    PetscCall(Advance(E, part, &nearer));
    PetscCall(PetscInfo(nullptr, "scene: assembly at t = %g, %d: misfit %g, a step of %g\n", E.t, it, E.misfit, part * largest_turn));
    if (!nearer) {
      E.misfit = before;
      break;
    }
    PetscCall(VecCopy(E.next, E.U));
    PetscCall(Remember(E.R, E.U, E.zero));
    PetscCall(RenewAxes(E.R, E.U, E.V));
  }
  /* Rows are within the tolerance as lengths and as sines (Analyses.AssemblyThatFallsShort); or bodies are within it of where the rows are met, as in scenes
     so large that lengths are rounded by more (Analyses.KinematicsInAnyUnitsOfLength) */
  const double tolerance = E.R.scene.start.tolerance;
  const bool   met       = E.misfit <= tolerance * std::min(1.0, E.size) || part * largest_turn <= tolerance;
  if (!met) {
    std::string worst;
    PetscCall(WorstRow(E, &worst));
    SETERRQ(E.R.scene.comm, PETSC_ERR_CONV_FAILED,
            "the scene cannot be assembled at t = %g: constraints or motions are violated by %g%s.\nTake smaller steps in time, or start nearer to where they are met", E.t,
            E.misfit, worst.c_str());
  }
  PetscCall(VecCopy(E.U, U));
  PetscCall(VecCopy(E.V, V));
  PetscFunctionReturn(0);
}

/* The most that a motion turns an angle by between two times */
double TurnOfMotions(const SceneData &s, double from, double to)
{
  double most = 0, a = 0, b = 0;
  for (const StoreBase *store : s.order)
    for (PetscInt e = 0; e < store->size(); e++)
      if (store->drivenAngle(e, from, &a) && store->drivenAngle(e, to, &b) && store->unknowns(e)) most = std::max(most, std::abs(b - a));
  return most;
}

/* The same in parts in which no motion turns far: the nearest positions that meet a motion are right up to full turns, and count fewer */
PetscErrorCode FollowMotions(Runtime &R, double from, double t, Vec U, Vec V)
{
  PetscFunctionBegin;
  for (double at = from; at != t;) {
    double next = t, middle = at + (t - at) / 2;
    while (TurnOfMotions(R.scene, at, next) > largest_part && middle != at && middle != next) {
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

/* Motions may have taken bodies far from where they were: these go there first */
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
  PetscCall(KeepStart(ts, V)); /* accelerations are zero as velocities are */
  PetscCall(StartWithMotions(ts));
  PetscFunctionReturn(0);
}

/* Calls move(run, U, V), which takes ts to another state; after an error the run is where it was */
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
  const std::vector<CountedAngle> asked  = R->asked;
  const PetscErrorCode            failed = Guarded([&] {
    PetscReal t;
    PetscFunctionBegin;
    PetscCall(move(*R, now[0], now[1]));
    PetscCall(TSGetTime(ts, &t));
    PetscCall(CheckDropped(*R, t, now[0], now[1]));
    PetscFunctionReturn(PetscErrorCode(0));
  });
  if (failed) {
    R->asked = asked;
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
