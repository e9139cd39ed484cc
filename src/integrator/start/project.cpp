/*
  Initial values and the constraints: how far q_0 and q'_0 are from them, and the projection of both.

  The inconsistency is measured as the distance to the nearest consistent state in the metric of the mass matrix, from

    [M Phi_q^T; Phi_q 0] [dq; mu] = [0; Phi],      the same with dq', Phi_q q' + Phi_t (and Psi) for the velocities,

  which has the units of q and so can be held against the tolerances. Time derivatives: differentiate.cpp.
*/
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "integrator/equations/rows.h"
#include "integrator/step/estimate.h"
#include "integrator/type/settings.h"
#include "integrator/equations/solver.h"
#include "start.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* Weighted root mean square of the entries of d that belong to coordinates, times s: in units of the tolerance */
PetscErrorCode CoordinateNorm(TS ts, Vec d, PetscReal s, PetscReal *e)
{
  Integrator &I   = Get(ts);
  PetscReal   sum = 0;

  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar x, PetscScalar w) { if (IsCoordinate(I, i)) sum += PetscSqr(PetscRealPart(x * w) * s); }, Read(d), Read(I.weight)));
  PetscCall(ReduceNorm(ts, NORM_2, sum, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y -= d on coordinates */
PetscErrorCode SubtractCoordinates(const Integrator &I, Vec y, Vec d)
{
  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar x, PetscScalar &z) { if (IsCoordinate(I, i)) z -= x; }, Read(d), Write(y)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SolveStart(TS ts, Vec rhs, Vec d)
{
  KSP       ksp;
  Mat       P;
  PetscBool ok;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  if (Get(ts).linear.failed) PetscCall(NameRedundant(ts));
  PetscCall(KSPSetOperators(ksp, P, P));
  PetscCall(SolveOfTheRun(ts, rhs, d, &ok));
  if (!ok) PetscCall(NameRedundant(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X: what U0 is off the nearest positions that the constraints allow, e of it in units of the tolerance; their violation stands in work */
PetscErrorCode MissOfPositions(TS ts, PetscReal *e)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(StartMatrix(ts)); /* leaves no accelerations */
  PetscCall(EvaluateResidual(ts, ts->ptime, I.U0, I.V0, I.A1, I.gamma));
  PetscCall(TakeRoles(I, I.gamma, {TSHHT3_HOLONOMIC}, I.work));
  PetscCall(SolveStart(ts, I.work, I.X));
  PetscCall(CoordinateNorm(ts, I.X, 1, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The row with the largest violation, for the report */
PetscErrorCode WorstRow(TS ts, Vec R, PetscInt *row, PetscReal *value)
{
  Vec      a = Get(ts).A1;

  PetscFunctionBegin;
  PetscCall(VecCopy(R, a));
  PetscCall(VecAbs(a));
  PetscCall(VecMax(a, row, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReportInconsistency(TS ts, const char *what, const char *unit, PetscReal e, PetscInt row, PetscReal value, PetscBool moved)
{
  Integrator &I = Get(ts);
  RowLabel    label;

  PetscFunctionBegin;
  PetscCall(PetscInfo(ts, "start: %s violate the constraints by %g of the tolerance, most in row %" PetscInt_FMT " (%g)%s\n", what,
                      (double)e, row, (double)value, moved ? "; projected" : ""));
  /* within a run the velocities are consistent to the order of the method only, which is no fault of the user's */
  const bool within = ts->steps > 0;
  if (e > (within ? 100 : 1) && !I.own_start && I.start_policy == TSHHT3_START_REPORT) {
    PetscCall(LabelRow(ts, row, &label));
    PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts),
                          "hhtdae: at t = %g the %s%s violate the constraints: the nearest consistent ones are %.3g "
                          "tolerances away%s; the largest violation is %.3g, in row %s. Give consistent values, or use -ts_hhtdae_start project.\n",
                          (double)ts->ptime, within ? "" : "initial ", what, (double)e, unit, (double)value, label.text));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest violation of constraints that the application has changed with which a run goes on, in tolerances: steps succeed from 2 and less, and
   fail from 5 and more (Parameters.AMotionThatJumps) */
constexpr PetscReal largest_jump = 4;

/* An error where a constraint has jumped and is not to be followed by projecting the positions (Parameters.AMotionThatJumps) */
PetscErrorCode RefuseJump(TS ts, PetscReal e, PetscInt row, PetscReal value)
{
  const Integrator &I = Get(ts);
  RowLabel          label;

  PetscFunctionBegin;
  if (e <= largest_jump || !I.own_start || !I.was_changed || I.start_policy != TSHHT3_START_REPORT) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LabelRow(ts, row, &label));
  SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG,
          "At t = %g the positions violate the constraints, which have been changed since the last step: the nearest consistent ones are %.3g tolerances away; the largest violation is %.3g, in row %s. "
          "Constraints and motions of displacements must not jump, or -ts_hhtdae_start project, TSHHT3SetStart(), moves the positions.",
          (double)ts->ptime, (double)e, (double)value, label.text);
}

PetscErrorCode CheckPositions(TS ts, PetscBool *current)
{
  Integrator     &I = Get(ts);
  PetscReal       e = PETSC_MAX_REAL, last, value = 0;
  PetscInt        row = 0;
  RowLabel        label;
  const PetscBool project = (PetscBool)(I.start_policy == TSHHT3_START_PROJECT);

  PetscFunctionBegin;
  for (int it = 0; it < 20; it++) {
    last = e;
    PetscCall(MissOfPositions(ts, &e));
    PetscCall(WorstRow(ts, I.work, &row, &value));
    if (it == 0) PetscCall(RefuseJump(ts, e, row, value));
    if (it == 0) PetscCall(ReportInconsistency(ts, "positions", "", e, row, value, project));
    *current = PETSC_TRUE;
    if (!project || e == 0 || e >= 0.5 * last) break;
    PetscCall(SubtractCoordinates(I, I.U0, I.X));
    *current = PETSC_FALSE;
  }
  if (!project || e <= 1e-3) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LabelRow(ts, row, &label));
  SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG,
          "The initial positions cannot be projected on the constraints: after the last correction row %s is still violated by %g. Check that the mechanism can be assembled.", label.text,
          (double)value);
}

/* Leaves gamma of the given velocities, and the matrix */
PetscErrorCode CheckVelocities(TS ts, bool project, Prepared *prepared, PetscReal *e, PetscInt *row, PetscReal *value)
{
  Integrator &I = Get(ts);
  PetscReal   T, along;

  PetscFunctionBegin;
  PetscCall(TimeScale(ts, &T));
  PetscCall(TimeScaleOfConstraints(ts, I.V0, &along));
  PetscCall(ConstraintDerivatives(ts, ts->ptime, I.U0, I.V0, along, &prepared->levels, I.work, I.gamma));
  PetscCall(SolveStart(ts, I.work, I.X));
  PetscCall(CoordinateNorm(ts, I.X, T, e));
  PetscCall(WorstRow(ts, I.work, row, value));
  if (project) PetscCall(SubtractCoordinates(I, I.V0, I.X));
  prepared->matrix = !I.count[TSHHT3_NONHOLONOMIC] || !project; /* rows of velocity-level constraints may depend on the velocities */
  prepared->gamma  = !project;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The length of a run says little of one that goes on until something stops it: it is no more than this times what loads and motions take (Units.MotionsInLongRuns) */
constexpr PetscReal longest_time_scale = 1e3;

/* Constraints of what moves are differentiated over what it takes, though the run were so many times shorter: differences over parts of a run of next to nothing are
   rounding (BetweenRuns.ShortRunsHaveTheirMultipliers). What would take more does not move. */
constexpr PetscReal longest_in_runs = 1e9;

/* In a run without end velocities that would take longer are what rounding leaves of zero, which is no time scale: it is that of rest, over which differences are taken of what
   time alone moves (Analyses.KinematicsAtTurningPoints). The unit of time may be a millionth of what things take (Analyses.KinematicsInAnyUnitsOfTime). */
constexpr PetscReal longest_without_end = 1e6;

/* 1/rate, in place of one beyond so many runs the whole run */
PetscReal TimeOf(TS ts, PetscReal rate, PetscReal within)
{
  const Integrator &I       = Get(ts);
  const bool        ends    = ts->max_time < PETSC_MAX_REAL / 2 && ts->max_time > I.t_begin;
  const PetscReal   longest = I.excitation ? longest_time_scale * I.fastest : PETSC_MAX_REAL;
  if (!ends) return PetscMin(rate > 1 / longest_without_end ? 1 / rate : unit_of_time, longest);
  const PetscReal span = PetscMin(ts->max_time - I.t_begin, longest);
  return rate > 0 && 1 / rate < within * span ? 1 / rate : span;
}

} // namespace

PetscErrorCode RelativeRate(TS ts, Vec x, PetscReal *most)
{
  Integrator     &I     = Get(ts);
  const PetscReal least = PetscMax(ts->rtol > 0 && !ts->vatol && !ts->vrtol ? ts->atol / ts->rtol : 1, 1e-8); /* coordinates whose size is less count as of this size */

  PetscFunctionBegin;
  PetscCall(LargestOf([&](PetscInt i, PetscScalar v, PetscScalar y) { return IsCoordinate(I, i) ? PetscAbsScalar(v) / PetscMax(PetscRealPart(y), least) : 0; }, most, Read(x), Read(I.ymax)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TimeScale(TS ts, PetscReal *T)
{
  PetscReal rate;

  PetscFunctionBegin;
  PetscCall(RelativeRate(ts, Get(ts).V0, &rate));
  *T = TimeOf(ts, rate, 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A time in which accelerations alone move q by as much */
PetscErrorCode TimeScaleOfAccelerations(TS ts, Vec A, PetscReal *T)
{
  PetscReal most;

  PetscFunctionBegin;
  PetscCall(RelativeRate(ts, A, &most));
  *T = most > 0 ? 1 / PetscSqrtReal(most) : PETSC_MAX_REAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For differences of constraints: what the motion takes, though the run be `longest_in_runs` times shorter */
PetscErrorCode TimeScaleOfConstraints(TS ts, Vec V, PetscReal *T)
{
  PetscReal rate;

  PetscFunctionBegin;
  PetscCall(RelativeRate(ts, V, &rate));
  *T = TimeOf(ts, rate, longest_in_runs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the solution is what a step has left in t, U, V, but for less than the tolerance: after a roll-back, or where a post-step function has brought attitudes
   to length 1. What it misses of the constraints is not the application's (BetweenRuns.WhatAStepHasLeft). */
PetscErrorCode IsOwnState(TS ts, PetscReal t, Vec U, Vec V, PetscBool *own)
{
  Integrator &I = Get(ts);
  PetscReal   T, u, v;

  PetscFunctionBegin;
  *own = PETSC_FALSE;
  if (!I.constraints() || !IsEndOf(ts, t)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecWAXPY(I.work, -1, U, ts->vec_sol));
  PetscCall(CoordinateNorm(ts, I.work, 1, &u));
  PetscCall(TimeScale(ts, &T));
  PetscCall(VecWAXPY(I.work, -1, V, ts->vec_dot));
  PetscCall(CoordinateNorm(ts, I.work, T, &v));
  *own = (PetscBool)(u <= 1 && v <= 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckInitialState(TS ts, Prepared *prepared)
{
  Integrator &I       = Get(ts);
  const bool  project = I.start_policy == TSHHT3_START_PROJECT || I.own_start; /* own velocities meet the constraints to O(h^2), which would leave O(h) in the multipliers */
  PetscReal   e, value;
  PetscInt    row;
  PetscBool   matrix;

  PetscFunctionBegin;
  *prepared = {};
  if (I.constraints() && I.own_start && I.start_policy != TSHHT3_START_PROJECT && IsFarShorter(I, ts->time_step)) { /* Events.ShortlyBeforeTheEnd */
    PetscCall(ProjectState(ts, prepared));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!I.constraints() || I.start_policy == TSHHT3_START_OFF) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckPositions(ts, &matrix));
  if (!matrix) PetscCall(StartMatrix(ts));
  PetscCall(CheckVelocities(ts, project, prepared, &e, &row, &value));
  PetscCall(ReportInconsistency(ts, "velocities", " (times the time scale of the motion)", e, row, value, (PetscBool)project));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U0 and V0 to the nearest ones that the constraints allow. The corrector has left of the constraints what is nothing in a step of the length of the last one:
   a far shorter one would make it good within that time (BetweenRuns.GrowthFromAShortStepKeepsTheMultipliers). Positions that are off by more than the tolerance are the
   application's, who was told so. */
PetscErrorCode ProjectState(TS ts, Prepared *prepared)
{
  Integrator &I = Get(ts);
  PetscReal   e, value;
  PetscInt    row;

  PetscFunctionBegin;
  PetscCall(MissOfPositions(ts, &e));
  if (e < 1) PetscCall(SubtractCoordinates(I, I.U0, I.X));
  PetscCall(CheckVelocities(ts, true, prepared, &e, &row, &value));
  PetscCall(PetscInfo(ts, "velocities moved by %g of the tolerance\n", (double)e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode NoteChange(TS ts)
{
  PetscFunctionBegin;
  Get(ts).was_changed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
