/*
  A consistent start: q''_0, s'_0, lambda_0, V_0, F_0 from given q_0, q'_0, s_0 (consistent.cpp).

  Then a second solve a little later gives q'''_0. From it come the first step (first_step.cpp), when the user gave none, and the start
  value of the algorithmic acceleration, a_0 = q''(t_0 + lag h): with a_0 = q''_0 the first steps excite an oscillation of
  the multipliers and an error of second order in q' (Arnold, Bruels 2007).
*/
#include "integrator/coordinates/change.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "integrator/step/estimate.h"
#include "integrator/step/order.h"
#include "integrator/step/predictor.h"
#include "integrator/proofs/proofs.h"
#include "integrator/coordinates/rotations.h"
#include "integrator/equations/rows.h"
#include "integrator/type/settings.h"
#include "integrator/equations/solver.h"
#include "integrator/step/stage.h"
#include "start.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal rate_accuracy = 1e-4; /* of the rates */
constexpr PetscReal least_run     = 16;   /* rounding errors of the time that a run takes: AcceptStep() takes half of that for nothing (FrontDoor.RunsOfNoLength) */

/* In the vectors, the matrix and the solver of the run. A matrix-free operator has nothing to differentiate before SNESSolve(): P alone. */
PetscErrorCode ConsistentOfRun(TS ts, PetscReal t, Vec U, Vec V, Consistent *c)
{
  Integrator &I = Get(ts);
  PetscBool   mffd;

  PetscFunctionBegin;
  PetscCall(SNESSetUp(ts->snes));
  PetscCall(SNESGetJacobian(ts->snes, &c->J, &c->P, NULL, NULL));
  PetscCall(PetscObjectTypeCompare((PetscObject)c->J, MATMFFD, &mffd));
  if (mffd) c->J = NULL;
  PetscCall(SNESGetKSP(ts->snes, &c->ksp));
  PetscCall(TimeScale(ts, &c->tiny));
  c->tiny = vanishing_step * PetscMin(c->tiny, 1);
  c->t      = t;
  c->U      = I.U1;
  c->V      = I.V1;
  c->A      = I.A1;
  c->X      = I.X;
  c->linear = &I.linear;
  I.stage_id = 0; /* U1, V1, A1 belong to no stage from now on */
  PetscCall(VecCopy(U, I.U1));
  PetscCall(VecCopy(V, I.V1));
  PetscCall(VecZeroEntries(I.A1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whose unknown stands in U, so that X knows of it before the accelerations are known */
constexpr std::initializer_list<TSHHT3Role> algebraic_roles = {TSHHT3_HOLONOMIC, TSHHT3_NONHOLONOMIC, TSHHT3_VARIABLE, TSHHT3_FORCE};

/* The rates of all unknowns (q''', s'', lambda', ...) by a second consistent solve, d later; zero where it cannot be had.
   Leaves X as it was. */
PetscErrorCode RatesOfStart(TS ts, Prepared have, Vec rate)
{
  Integrator &I = Get(ts);
  PetscReal   T, Ta, rate_of_motion;
  PetscBool   ok, rest;
  WorkVec     X0, U, V;

  PetscFunctionBegin;
  PetscCall(TimeScale(ts, &T));
  PetscCall(IsAtRest(I, I.V0, &rest));
  PetscCall(TimeScaleOfAccelerations(ts, I.X, &Ta));
  PetscCall(RelativeRate(ts, I.V0, &rate_of_motion));
  if (!rest && Ta < PETSC_MAX_REAL) T = rate_of_motion > 0 ? PetscMax(T, 1 / rate_of_motion) : PETSC_MAX_REAL; /* what has just begun to move has no time scale of a short run: its rates would be rounding (BetweenRuns.ShortRunsHaveTheirMultipliers) */
  const PetscReal d = SpanFrom(ts->ptime, PetscMin(PetscMin(1e-5 * T, 1e-2 * Ta), rate_accuracy * I.fastest)); /* of what is at rest T may be a run without end: Units.LongRuns */
  PetscCall(X0.like(I.X));
  PetscCall(U.like(I.X));
  PetscCall(V.like(I.X));
  PetscCall(VecCopy(I.X, X0));
  PetscCall(Advance(I, d, U, V));
  /* from rest gamma and the matrix change with d^2, so that they have no part in the rates */
  have.matrix = have.gamma = rest;
  have.near                = true;
  PetscCall(ConsistentAccelerations(ts, ts->ptime + d, 0, U, V, have, &ok));
  PetscCall(VecZeroEntries(rate));
  if (ok) {
    PetscCall(VecWAXPY(rate, -1, X0, I.X));
    PetscCall(VecScale(rate, 1 / d));
  } else PetscCall(PetscInfo(ts, "start: no consistent accelerations at t_0 + %g, the start goes without q'''\n", (double)d));
  PetscCall(VecCopy(X0, I.X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The history that a step of length h would have left: a_0 and w_0 with their lag, and what the rates tell of values a little earlier. Rates that are too wild to be believed are left out, but for those of states: without them the error of the first step would not know these
   (FirstStep.StatesAfterARestart). */
PetscErrorCode MakeHistory(TS ts, Vec rate)
{
  Integrator        &I = Get(ts);
  Predictor         &p = I.predictor;
  const PetscReal    h = ts->time_step;
  PetscReal          T, e;

  PetscFunctionBegin;
  PetscCall(PredictorReset(ts));
  I.h          = h;
  I.h_last     = h;
  I.have_drift = PETSC_FALSE;
  I.jerk       = Jerk::None;
  PetscCall(ErrorOfStart(ts, rate, h, &e));
  I.corrector.wlte = e;
  PetscCall(TimeScaleOfAccelerations(ts, rate, &T));
  const bool believed = I.fixed_h ? h * h * h <= T * T : e <= 100; /* fixed steps know no tolerance: of the coordinates */
  if (believed) {
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar j, PetscScalar &x, PetscScalar &d) {
        const TSHHT3Role r = RoleOf(I, i);
        if (IsDifferential(r)) x += (r == TSHHT3_STATE ? I.p.lagState() : I.p.lag()) * h * j;
        if (r == TSHHT3_COORDINATE) d = x;
      },
      Read(rate), Write(I.X0), Write(p.X[0])));
    if (e > 0) PetscCall(SetDriftOfStart(ts, rate));
  } else PetscCall(PetscInfo(ts, "start: q''' h exceeds the tolerance %g times, a_0 = q''_0\n", (double)e));
  const bool follows = believed && e > 0 && p.degree_max > 0;
  if (follows || I.count[TSHHT3_STATE]) {
    if (!p.X[1]) PetscCall(VecDuplicate(rate, &p.X[1]));
    p.available = 1;
    p.degree    = follows ? 1 : 0;
    p.t[1]      = p.t[0] - SpanFrom(p.t[0], slope_fraction * h);
    PetscCall(VecWAXPY(p.X[1], p.t[1] - p.t[0], rate, p.X[0]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X holds the accelerations, derivatives and algebraic unknowns at U0, V0 */
PetscErrorCode TakeStartValues(Integrator &I)
{
  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar x, PetscScalar &u, PetscScalar &v, PetscScalar &a) {
      a                                = 0;
      UnknownOf(RoleOf(I, i), u, v, a) = x;
    },
    Read(I.X), Write(I.U0), Write(I.V0), Write(I.A0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode Advance(const Integrator &I, PetscReal d, Vec U, Vec V)
{
  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar u0, PetscScalar v0, PetscScalar a0, PetscScalar &u, PetscScalar &v) {
      const TSHHT3Role r = RoleOf(I, i);
      u                  = u0 + (r == TSHHT3_COORDINATE ? d * (v0 + d / 2 * a0) : r == TSHHT3_STATE ? d * v0 : 0);
      v                  = v0 + (r == TSHHT3_COORDINATE ? d * a0 : 0);
    },
    Read(I.U0), Read(I.V0), Read(I.A0), Write(U), Write(V)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With the multipliers of U0: a failed correction may have left others in X, of any size, which would stand in the matrix beside the inertia
   (Failures.MultipliersOfAFailedCorrection) */
PetscErrorCode StartMatrix(TS ts)
{
  Integrator &I = Get(ts);
  Consistent  c;
  const char *why;
  PetscBool   ok;

  PetscFunctionBegin;
  PetscCall(TakeRoles(I, I.U0, algebraic_roles, I.X));
  PetscCall(ConsistentOfRun(ts, ts->ptime, I.U0, I.V0, &c));
  PetscCall(TakeUnknowns(I, c));
  PetscCall(ConsistentMatrix(ts, c, &ok, &why));
  PetscCall(NoteInertia(ts, c.P));
  I.corrector.matrix.forget();
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{

PetscErrorCode SolveAt(TS ts, PetscReal t, PetscReal h, Vec U, Vec V, Prepared &have, Consistent &c, PetscBool *ok, const char **why)
{
  Integrator &I = Get(ts);
  WorkVec     F, d;

  PetscFunctionBegin;
  c.h        = h;
  c.begin[0] = I.base[0];
  c.begin[1] = I.base[1];
  if (h > 0) PetscCall(VecWAXPY(c.begin[0], h, V, U));
  if (h > 0) PetscCall(VecCopy(V, c.begin[1]));
  if (I.constraints()) {
    c.gamma  = I.gamma;
    c.levels = &have.levels;
    PetscCall(TimeScaleOfConstraints(ts, I.V0, &c.T));
    if (!have.gamma) PetscCall(ConstraintDerivatives(ts, t, c.U, c.V, c.T, c.levels, NULL, c.gamma));
  }
  if (!I.count[TSHHT3_STATE]) c.T = 0;
  PetscCall(F.like(I.X));
  PetscCall(d.like(I.X));
  c.F = F;
  c.d = d;
  PetscCall(SolveConsistent(ts, c, have.matrix, ok, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Reference and factors are left as they were after an error of the application too, which may go on */
PetscErrorCode ConsistentAccelerations(TS ts, PetscReal t, PetscReal h, Vec U, Vec V, Prepared &have, PetscBool *ok)
{
  Integrator &I = Get(ts);
  Consistent  c;
  const char *why;
  PetscBool   reuse; /* the user's */
  WorkVec     before;

  PetscFunctionBegin;
  PetscCall(ConsistentOfRun(ts, t, U, V, &c));
  PetscCall(KSPGetReusePreconditioner(c.ksp, &reuse));
  c.near   = have.near && !reuse;
  c.enough = have.near ? rate_accuracy : 0;
  if (c.near) PetscCall(KSPSetReusePreconditioner(c.ksp, PETSC_TRUE));
  if (h == 0) PetscCall(ReferTo(ts, c.U, before));
  const PetscErrorCode failed = SolveAt(ts, t, h, U, V, have, c, ok, &why);
  PetscCall(KSPSetReusePreconditioner(c.ksp, reuse));
  if (!failed && !have.matrix && !have.near && h == 0) PetscCall(NoteInertia(ts, c.P));
  PetscCall(ReferBack(ts, c.U, before));
  PetscCall(failed);
  I.corrector.matrix.forget();
  ts->snes_its += c.its;
  ts->ksp_its += c.ksp_its;
  I.corrector.no_solve = (PetscBool)(I.linear.failed != PC_NOERROR);
  if (I.linear.failed) PetscCall(ExplainLinearFailure(ts, t, 0));
  else if (!*ok && why != I.failure) PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "%s in the search for accelerations and multipliers at t = %g", why, (double)t));
  PetscCall(SNESSetConvergedReason(ts->snes, *ok ? SNES_CONVERGED_SNORM_RELATIVE : SNES_DIVERGED_INNER)); /* for TSAdapt */
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{

constexpr int max_transients = 30; /* one within the other; each time a tenth of one is left */

/* Accelerations, multipliers and their rates from U0, V0. What was prepared is used up, and the differences of gamma are known. */
PetscErrorCode ConsistentWithRates(TS ts, Prepared &have, Vec rate)
{
  Integrator &I = Get(ts);
  PetscBool   ok;

  PetscFunctionBegin;
  PetscCall(TakeRoles(I, I.U0, algebraic_roles, I.X));
  PetscCall(ConsistentAccelerations(ts, ts->ptime, 0, I.U0, I.V0, have, &ok));
  if (!ok) {
    if (I.linear.failed) PetscCall(NameRedundant(ts));
    SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_NOT_CONVERGED, "No consistent accelerations and multipliers were found at t = %g: %s", (double)ts->ptime, I.failure);
  }
  PetscCall(NoteDriven(ts));
  PetscCall(TakeStartValues(I));
  PetscCall(VecCopy(I.X, I.X0));
  PetscCall(VecCopy(I.X, I.predictor.X[0]));
  have.matrix = have.gamma = false;
  PetscCall(RatesOfStart(ts, have, rate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A consistent start from U0, V0, and the first step. Transients that are over long before its end are taken out of V0, one after the other, as
   long as that takes their accelerations away. */
PetscErrorCode ConsistentStart(TS ts, Prepared &have, Vec rate)
{
  Integrator     &I      = Get(ts);
  const PetscReal given  = ts->time_step;
  const PetscBool auto_h = I.auto_h;
  PetscReal       before, after, tau;
  PetscBool       gone = PETSC_TRUE;
  WorkVec         V;

  PetscFunctionBegin;
  PetscCall(ConsistentWithRates(ts, have, rate));
  PetscCall(ChooseFirstStep(ts, rate));
  PetscCall(V.like(I.V0));
  for (int k = 0; gone && k < max_transients; k++) {
    PetscCall(VecCopy(I.V0, V));
    PetscCall(VecNorm(I.A0, NORM_2, &before));
    PetscCall(RemoveTransient(ts, ts->time_step, rate, have, &tau, &gone));
    if (tau <= 0) break;
    if (gone) {
      ts->time_step = given;
      I.auto_h      = auto_h;
      PetscCall(ConsistentWithRates(ts, have, rate));
      PetscCall(VecNorm(I.A0, NORM_2, &after));
      gone = (PetscBool)(after < 0.5 * before);
      if (gone) PetscCall(PetscInfo(ts, "start: what moves is held within %g, far less than the step, and starts with the velocities that this leaves\n", (double)tau));
      else {
        PetscCall(VecCopy(V, I.V0));
        PetscCall(ConsistentWithRates(ts, have, rate));
      }
      PetscCall(ChooseFirstStep(ts, rate));
    }
    if (!gone && k) PetscCall(VecZeroEntries(rate)); /* those of what rounding leaves of the transient */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode StartFromState(TS ts, Prepared &have)
{
  Integrator &I = Get(ts);
  WorkVec     rate;

  PetscFunctionBegin;
  PetscCall(rate.like(I.X));
  PetscCall(ConsistentStart(ts, have, rate));
  PetscCall(VecCopy(I.U0, ts->vec_sol));
  PetscCall(VecCopy(I.V0, ts->vec_dot));
  PetscCall(LimitStepByEvents(ts));
  PetscCall(MakeHistory(ts, rate));
  PetscCall(HistoryForces(ts, ts->ptime));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Initial values that are no numbers end up in a matrix, where nobody can tell where they came from */
static PetscErrorCode CheckInitialNumbers(TS ts, Vec x, const char what[])
{
  PetscScalar value;
  PetscInt    row;
  RowLabel    label;

  PetscFunctionBegin;
  PetscCall(FirstWhere([](PetscInt, PetscScalar v) { return PetscIsInfOrNanScalar(v); }, &row, Read(x)));
  if (row < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(EntryOf(x, row, &value));
  PetscCall(LabelRow(ts, row, &label));
  SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_FP, "The initial %s of unknown %s is %s at t = %g: set it (TS2SetSolution())", what, label.text,
          PetscIsNanScalar(value) ? "not a number (NaN)" : PetscRealPart(value) > 0 ? "infinite" : "minus infinite", (double)ts->ptime);
}

PetscErrorCode StartFromSolution(TS ts)
{
  Integrator &I = Get(ts);
  Prepared    have;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.start, ts, 0, 0, 0));
  PetscCall(PetscInfo(ts, "start: consistent accelerations at t = %g\n", (double)ts->ptime));
  PetscCall(CheckSettings(ts));
  I.stat.restarts++;
  ResetOrder(ts);
  I.tiny_row = 0;
  PetscCall(VecCopy(ts->vec_sol, I.U0));
  PetscCall(TakeRoles(I, ts->vec_dot, {TSHHT3_COORDINATE, TSHHT3_STATE}, I.V0));
  PetscCall(CheckInitialNumbers(ts, I.U0, "value"));
  PetscCall(CheckInitialNumbers(ts, I.V0, "velocity"));
  if (I.change.test) PetscCall(ChangeCoordinates(ts, true));
  PetscCall(ReferToState(ts));
  if (!ts->steps || ts->ptime <= I.t_begin) { /* a new run does not remember how large its coordinates once were, nor its steps (Excitation.WhatSetsInLaterInANewRun) */
    PetscCheck(ts->max_time - ts->ptime >= least_run * PETSC_MACHINE_EPSILON * PetscAbsReal(ts->ptime), PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
               "The run from t = %.16g to %.16g is so short that rounding of the time leaves no room for steps: let the time begin nearer to zero (TSSetTime())", (double)ts->ptime, (double)ts->max_time);
    I.t_begin   = ts->ptime;
    I.norm_size = 0;
    I.h_regular = I.h_rounded = I.h_limit = 0;
    I.corrector.jacobian_faults = 0;
    I.told             = PETSC_FALSE;
    for (Vec v : {I.ymax, I.weight}) PetscCall(VecZeroEntries(v));
  }
  PetscCall(FollowTolerances(ts, I.U0));
  PetscCall(UpdateWeights(ts, I.U0));
  PetscCall(FindExcitation(ts));
  PetscCall(CheckInitialState(ts, &have));
  if (I.rotations.refer && I.start_policy == TSHHT3_START_PROJECT) {
    PetscCall(ReferToState(ts));
    have = {};
  }
  PetscCall(StartFromState(ts, have));
  PetscCall(PetscLogEventEnd(events.start, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
