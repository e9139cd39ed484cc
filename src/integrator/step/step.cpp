/*
  One step: begin, predict, correct, estimate, accept or reject.

  The state at t_n is U0, V0, A0 with the unknowns X0. An accepted step stays in U1, V1, A1, X until the next one begins, so
  that TSInterpolate() and TSRollBack() find both ends. vec_sol and vec_dot hold the last accepted state, except while TSAdapt
  decides on a new one.
*/
#include "integrator/coordinates/change.h"
#include "integrator/checkpoint/checkpoint.h"
#include "corrector.h"
#include "dense.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "estimate.h"
#include "integrator/equations/jacobian.h"
#include "order.h"
#include "predictor.h"
#include "integrator/coordinates/rotations.h"
#include "integrator/type/settings.h"
#include "stage.h"
#include "integrator/start/start.h"
#include "step.h"
#include "integrator/work_vec.h"
#include <string>
#include <utility>

namespace hht3
{

namespace
{

/* With each accepted step h_regular is multiplied by the first and h_limit, which a failed correction has set, by the second. h_limit
   is dropped when it exceeds the third times h: otherwise creep at v_s = 1e-6 and a release of friction at 1e10 in the table of
   stability fail. */
constexpr PetscReal regular_decay = 0.9, limit_growth = 1.02, limit_forgotten = 4;

/* Shortest h for which (vanishing_step h)^2 = (1e-28 h)^2 does not underflow (FrontDoor.RunsOfNoLength) */
constexpr PetscReal shortest_step = 1e-120;

/* What an attempt has failed for tells something of the model only if its h is longer than so many roundings of the time
   (JointRuns.AMotionBeyondReach, which ends with such steps and is told of a wrong Jacobian otherwise) */
constexpr PetscReal telling_roundings = 1e4;

/* The run ends after so many failures for which wrong_jacobian.cpp blames the application's Jacobian; each accepted step takes
   fault_decay off their number. A single one proves nothing, as a correct model may have places where it happens; with a wrong
   Jacobian it happens again and again. */
constexpr PetscReal max_jacobian_faults = 3, fault_decay = 0.01;

/* With -ts_exact_final_time interpolate, TSSolve() leaves the solution at the final time in the user's vector, although the last step
   ends later. When it is called again with this vector, it takes the vector for the solution at the end of that step. *yes: vec_sol
   is such a vector (BetweenRuns.GoOnFromInterpolatedEnds). */
PetscErrorCode IsInterpolatedEnd(TS ts, PetscBool *yes)
{
  WorkVec x;

  PetscFunctionBegin;
  *yes = PETSC_FALSE;
  if (ts->exact_final_time != TS_EXACTFINALTIME_INTERPOLATE || !(ts->solvetime > Get(ts).t0 && ts->solvetime < Get(ts).t1)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(x.like(ts->vec_sol));
  PetscCall(Interpolate(ts, ts->solvetime, x, NULL, NULL));
  PetscCall(VecEqual(ts->vec_sol, x, yes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether someone other than the integrator has changed the time or the solution since the last step: an event, a post-step function,
   a second TSSolve() with other values */
PetscErrorCode StateWasChanged(TS ts, PetscReal t, Vec U, Vec V, PetscBool *changed)
{
  Integrator &I        = Get(ts);
  PetscInt    other[2] = {0, 0};
  PetscBool   same;

  PetscFunctionBegin;
  *changed = (PetscBool)!IsEndOf(ts, t);
  if (*changed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ForEntries(
    [&](PetscInt, PetscScalar x, PetscScalar u, PetscScalar y, PetscScalar v) {
      if (x != u) other[0] = 1;
      if (y != v) other[1] = 1;
    },
    Read(ts->vec_sol), Read(U), Read(ts->vec_dot), Read(V)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, other, 2, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)ts)));
  if (other[0] && I.have_step) {
    PetscCall(IsInterpolatedEnd(ts, &same));
    if (same) PetscCall(VecCopy(U, ts->vec_sol));
    if (same) other[0] = 0;
  }
  *changed = (PetscBool)(other[0] || other[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The accepted step becomes history: its end is the new t_n */
PetscErrorCode CommitStep(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(PredictorUpdate(ts));
  CommitOrder(I);
  std::swap(I.X, I.X0);
  std::swap(I.U1, I.U0);
  std::swap(I.V1, I.V0);
  std::swap(I.A1, I.A0);
  I.have_step   = PETSC_FALSE;
  I.at_begin    = PETSC_TRUE;
  I.h_last      = I.h;
  I.have_drift = PETSC_FALSE;
  I.jerk        = Jerk::None;
  PetscCall(HistoryForces(ts, I.t1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prepares the state at t_n: the end of the last step, its beginning after a roll-back, or a consistent start from vec_sol and vec_dot */
PetscErrorCode BeginStep(TS ts)
{
  Integrator &I       = Get(ts);
  PetscBool   changed = PETSC_FALSE;

  PetscFunctionBegin;
  if (!ts->steprestart) {
    if (I.have_step) PetscCall(StateWasChanged(ts, I.t1, I.U1, I.V1, &changed));
    else if (I.at_begin) PetscCall(StateWasChanged(ts, I.t0, I.U0, I.V0, &changed));
    else changed = PETSC_TRUE;
    if (changed) PetscCall(PetscInfo(ts, "the solution or the time was changed from outside: restart\n"));
    if (!changed && HHT3IsLocated(ts)) {
      PetscCall(PetscInfo(ts, "an event was located at t = %g, which may have changed forces: restart\n", (double)ts->ptime));
      changed = PETSC_TRUE;
    }
  }
  if (HHT3IsLocated(ts)) HHT3TakeLocatedForZero(ts);
  I.own_start = PETSC_FALSE;
  if (ts->steprestart || changed) {
    if (I.have_step) PetscCall(IsOwnState(ts, I.t1, I.U1, I.V1, &I.own_start));
    else if (ts->steps && I.at_begin) PetscCall(IsOwnState(ts, I.t0, I.U0, I.V0, &I.own_start));
    I.have_step = I.at_begin = PETSC_FALSE;
    PetscCall(StartFromSolution(ts));
    I.at_begin    = PETSC_TRUE;
    I.was_changed = PETSC_FALSE;
  } else if (I.have_step) {
    PetscCall(CommitStep(ts));
    if (I.change.test) PetscCall(ChangeCoordinates(ts, false));
    PetscCall(ReferToState(ts));
  }
  if (!ts->steprestart && !changed) PetscCall(FollowTolerances(ts, I.U0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether t is the time `stop` but for rounding: t_n + (stop - t_n) may miss it by a rounding error, and another step over this
   remainder makes no sense */
bool EndsAt(const Integrator &I, PetscReal t, PetscReal stop) { return PetscAbsReal(t - stop) < PetscMax(1e-10 * I.h, 8 * PETSC_MACHINE_EPSILON * PetscAbsReal(stop)); }

PetscErrorCode AcceptStep(TS ts, PetscBool tiny, PetscReal next)
{
  Integrator     &I    = Get(ts);
  const PetscReal h    = I.h;
  const PetscReal stop = HHT3StopAfter(ts, ts->ptime);

  PetscFunctionBegin;
  /* In the paper's form q'' at t_{n+1} is the unknown itself; until here A1 was X/(1 + alpha), as (9a) needs it */
  if (I.form == TSHHT3_FORM_PAPER) PetscCall(ForEntries([&](PetscInt i, PetscScalar x, PetscScalar &a) { if (IsCoordinate(I, i)) a = x; }, Read(I.X), Write(I.A1)));
  PetscCall(UpdateWeights(ts, I.U1));
  ts->ptime = I.t1;
  if (ts->exact_final_time == TS_EXACTFINALTIME_MATCHSTEP && EndsAt(I, ts->ptime, stop)) ts->ptime = stop;
  ts->time_step = I.h_next = next;
  if (I.h_chosen && !HHT3EventActive(ts)) HHT3StepAfterEvent(ts, {unset_step, petsc_default_step, I.h_after_event}, next);
  if (I.h_chosen && !HHT3EventActive(ts)) I.h_after_event = next;
  /* time_step was cut to reach `stop`; the user's step size holds again after it */
  if (I.fixed_h && ts->ptime == stop && I.h_given > 0) {
    const PetscReal rest = HHT3StopAfter(ts, stop) - stop;
    I.h_next = ts->time_step = I.h_given;
    if (rest > 0 && ts->exact_final_time == TS_EXACTFINALTIME_MATCHSTEP) ts->time_step = PetscMin(I.h_given, rest); /* BetweenRuns.FixedStepsInATimeSpan */
  }
  if (!tiny) I.h_regular = PetscMax(h, regular_decay * I.h_regular);
  if (I.h_limit > 0) I.h_limit = I.h_limit > limit_forgotten * h ? 0 : limit_growth * I.h_limit;
  I.corrector.jacobian_faults = PetscMax(0, I.corrector.jacobian_faults - fault_decay);
  I.stat.steps++;
  I.stat.of_order[I.order.now]++;
  I.stat.h_min = I.stat.steps == 1 ? h : PetscMin(I.stat.h_min, h);
  I.stat.h_max = PetscMax(I.stat.h_max, h);
  I.have_step  = PETSC_TRUE;
  PetscCall(WarnOfUnfollowedLoads(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With fixed steps, notes a step size that the user has set since the last step. The size is not the user's where TSSolve() has cut
   it to the rest of the run, and while TSEvent makes the steps on the way to a zero. */
void NoteGivenStep(TS ts)
{
  Integrator     &I    = Get(ts);
  const PetscReal rest = HHT3StopAfter(ts, ts->ptime) - ts->ptime;

  if (HHT3EventActive(ts)) return;
  if (ts->time_step != I.h_next && PetscAbsReal(ts->time_step - rest) > 1e-10 * rest) I.h_given = ts->time_step;
}

/* Sets t0, t1 and h for an attempt from t_n with the step size of the TS */
PetscErrorCode BeginStage(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  I.h  = ts->time_step;
  I.t0 = ts->ptime;
  I.t1 = ts->ptime + I.h;
  if (I.t1 > I.t0 && PetscAbsReal(I.t1 - I.t0 - I.h) > 1e-9 * I.h) I.h = SpanFrom(I.t0, I.h);
  PetscCall(TSPreStage(ts, I.t1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttemptStep(TS ts, PetscBool *tiny, PetscBool *ok)
{
  Integrator &I = Get(ts);
  PetscBool   stage, restart = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(ForgetForeignMatrix(ts));
  PetscCall(ApplyStepLimit(ts));
  PetscCall(IsTinyStep(ts, ts->time_step, tiny));
  if (*tiny) {
    PetscCall(BeginStage(ts));
    PetscCall(TinyStep(ts, tiny, ok));
  }
  if (!*tiny) {
    PetscCall(NeedsRestart(ts, ts->time_step, &restart));
    if (restart) PetscCall(RestartConsistently(ts));
    if (I.change.stale) PetscCall(StepAfterChange(ts));
    PetscCall(BeginStage(ts));
    PetscCall(UseOrder(ts));
    if (I.change.stale) PetscCall(MatrixAfterChange(ts));
    PetscCall(AdaptVelocities(ts));
    PetscCall(PrepareStage(ts));
    PetscCall(Predict(ts, I.X));
    PetscCall(RunCorrector(ts, ok));
    PetscCall(NoteMatrices(ts));
  }
  PetscCall(TSPostStage(ts, I.t1, 0, &I.U1));
  /* TSAdaptCheckStage() judges by the last SNESConvergedReason, and so misses a failure before SNESSolve(): then time_step is cut here */
  PetscCall(TSAdaptCheckStage(ts->adapt, ts, I.t1, I.U1, &stage));
  if (!*ok && stage) ts->time_step *= ts->adapt->scale_solve_failed;
  if (*ok && !stage) PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "TSAdapt, or the function of TSSetFunctionDomainError(), rejects the state at t = %g", (double)I.t1));
  *ok = (PetscBool)(*ok && stage);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* While TSEvent looks for a zero, and for the step from the event to the end of the step that contained it, TSAdaptChoose() accepts
   every step. As the event may have switched on forces that such a step does not follow, the choose() of the TSAdapt is called, which
   applies the error test. */
PetscErrorCode AskAdapt(TS ts, PetscReal *next, PetscBool *accept)
{
  Integrator &I = Get(ts);
  PetscInt    scheme = 0;
  PetscReal   wlte[3];

  /* Where the attempt ends the run but for rounding, TSAdaptChoose() would cut the next step to this rounding; so it is called as if
     the run went on (BetweenRuns.SolvedInParts) */
  const TSExactFinalTimeOption exact = ts->exact_final_time;
  const bool                   last  = exact == TS_EXACTFINALTIME_MATCHSTEP && EndsAt(I, I.t1, ts->max_time);

  PetscFunctionBegin;
  const auto ask = [&]() -> PetscErrorCode {
    PetscFunctionBegin;
    if (HHT3EventActive(ts) && !I.fixed_h) PetscUseTypeMethod(ts->adapt, choose, ts, I.h, &scheme, next, accept, &wlte[0], &wlte[1], &wlte[2]);
    else PetscCall(TSAdaptChoose(ts->adapt, ts, I.h, NULL, next, accept));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  if (last) ts->exact_final_time = TS_EXACTFINALTIME_STEPOVER;
  const PetscErrorCode failed = ask();
  ts->exact_final_time        = exact;
  PetscCall(failed);
  if (*next <= 0 || (HHT3EventActive(ts) && *accept)) *next = I.h;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* vec_sol and vec_dot hold the new state while TSAdapt decides on it, and the old one again if it is rejected */
PetscErrorCode AcceptOrReject(TS ts, PetscBool tiny, PetscReal *next, PetscBool *accept)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  I.status       = tiny ? TS_STEP_INCOMPLETE : TS_STEP_PENDING; /* a tiny step has no error estimate */
  I.wlte_pending = -1;
  I.order.chosen = PETSC_FALSE;
  PetscCall(VecCopy(I.U1, ts->vec_sol));
  PetscCall(VecCopy(I.V1, ts->vec_dot));
  PetscCall(AskAdapt(ts, next, accept));
  if (!*accept) {
    PetscCall(VecCopy(I.U0, ts->vec_sol));
    PetscCall(VecCopy(I.V0, ts->vec_dot));
    I.stat.rejected++;
    if (I.wlte_pending < 0) PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "TSAdapt has not accepted the step to t = %g, h = %g", (double)I.t1, (double)I.h));
    else PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "the error test at t = %g, h = %g (error %g of the tolerance)", (double)I.t1, (double)I.h, (double)I.wlte_pending));
    PetscCall(PetscInfo(ts, "step of %g from t = %g rejected by the error test, next %g\n", (double)I.h, (double)I.t0, (double)*next));
  } else if (!tiny) {
    PetscCall(NoteError(ts));
    PetscCall(ChooseOrder(ts, NULL)); /* does nothing if TSAdaptChoose_HHT() has chosen the order together with h */
  }
  I.order.accepted = tiny ? 0 : I.order.now;
  I.status = *accept ? TS_STEP_COMPLETE : TS_STEP_INCOMPLETE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ends the run with the last accepted state in vec_sol and vec_dot: by an error or, with -ts_error_if_step_fails 0, by a TSConvergedReason */
PetscErrorCode FailStep(TS ts, const char *what)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  std::string hint = I.constraints() && RelativeDamping(I.p.rho) < 0.1 ? " At this alpha or spectral radius hardly anything damps the multipliers' oscillation, which may be the cause: -ts_hhtdae_alpha -0.05." : "";
  if (hint.empty()) PetscCall(ExplainLock(ts, &hint));
  if (!ts->reason) ts->reason = TS_DIVERGED_STEP_REJECTED;
  ts->steprestart = PETSC_TRUE; /* if the run goes on from here, it does so with a consistent start */
  PetscCall(VecCopy(I.U0, ts->vec_sol));
  PetscCall(VecCopy(I.V0, ts->vec_dot));
  PetscCheck(!ts->errorifstepfailed, PetscObjectComm((PetscObject)ts), PETSC_ERR_NOT_CONVERGED,
             "No step from t = %g succeeded: %s; last h = %g. Last cause: %s. The solution holds the last accepted state, at t = %g "
             "(-ts_error_if_step_fails 0 returns it with a TSConvergedReason).%s",
             (double)ts->ptime, what, (double)I.h, I.cause, (double)ts->ptime, hint.c_str());
  PetscCall(PetscInfo(ts, "no step from t = %g succeeded: %s; last cause: %s.%s\n", (double)ts->ptime, what, I.cause, hint.c_str()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a rejected or failed attempt: ends the run if there is no point in another one */
PetscErrorCode CheckRejections(TS ts, PetscInt rejections)
{
  const Integrator &I = Get(ts);

  PetscFunctionBegin;
  ts->reject++;
  if (I.corrector.jacobian_faults >= max_jacobian_faults) PetscCall(FailStep(ts, "the application's Jacobian is wrong"));
  else if (ts->reason) PetscCall(FailStep(ts, "too many corrections failed (-ts_max_snes_failures)"));
  else if (ts->max_reject >= 0 && rejections > ts->max_reject) PetscCall(FailStep(ts, "the step was rejected too often"));
  else if (ts->max_reject >= 0 && I.tiny_row > ts->max_reject) PetscCall(FailStep(ts, "failures have made many steps in a row too short for the corrector"));
  else if (ts->time_step <= 4 * PETSC_MACHINE_EPSILON * PetscAbsReal(ts->ptime)) PetscCall(FailStep(ts, "the step size fell below rounding of the time"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TSSolve() cuts the step to the time left until the next stop. This is zero if TSSolve() is called at the end of a run, and negative
   if points of a time span, or the end of an earlier run, lie before the time at which a run begins, goes on or is resumed. Then the
   step size from before the cut is restored. */
PetscErrorCode PassStops(TS ts)
{
  const Integrator &I       = Get(ts);
  const bool        resumed = (I.have_step || I.at_begin) && I.stat.steps == I.checkpoint_steps;
  PetscBool         passed;

  PetscFunctionBegin;
  PetscCall(HHT3PassStops(ts, &passed));
  /* PETSc 3.18 does this with any integrator (Events.ThatGoBackAreRefused) */
  PetscCheck(ts->time_step > 0 || !HHT3EventActive(ts), PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP,
             "TSEvent asks for a step of %g at t = %g, as it does in some versions of PETSc where a function with a direction crosses zero the other way: set direction 0, and let the event handler tell the direction",
             (double)ts->time_step, (double)ts->ptime);
  const bool cut = ts->time_step < 0 && I.stat.steps > 0 && ts->exact_final_time == TS_EXACTFINALTIME_MATCHSTEP; /* by a TSSolve() to a time in the past */
  if (ts->time_step != 0 && !cut && !(ts->time_step < 0 && (passed || resumed))) PetscFunctionReturn(PETSC_SUCCESS);
  if (I.h_next > 0) ts->time_step = I.h_next;
  else ts->time_step = I.auto_h ? unset_step : I.h_given;
  if (ts->exact_final_time == TS_EXACTFINALTIME_MATCHSTEP) ts->time_step = PetscMin(ts->time_step, HHT3StopAfter(ts, ts->ptime) - ts->ptime);
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode TSStep_HHT(TS ts)
{
  Integrator &I          = Get(ts);
  PetscInt    rejections = 0;
  PetscBool   ok, tiny, accept = PETSC_TRUE;
  PetscReal   next;

  PetscFunctionBegin;
  StartClocks(I);
  PetscCall(PassStops(ts));
  next = ts->time_step;
  PetscCheck(ts->time_step > 0 && !PetscIsInfReal(ts->time_step), PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "The time step %g must be positive and finite: TSHHT3 integrates forward in time (-ts_dt, TSSetTimeStep())", (double)ts->time_step);
  PetscCheck(ts->time_step > shortest_step, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "The time step %g (the run ends at %g) is so short that 1/h^2, by which constraints are scaled, is no number: choose a smaller unit of time", (double)ts->time_step, (double)ts->max_time);
  I.failure[0] = 0;
  bool another;
  PetscCall(HooksBorrowDM(ts));
  PetscCall(IsAnotherSNES(ts, &another));
  if (another) PetscCall(TakeSNES(ts));
  PetscCall(PetscObjectTypeCompare((PetscObject)ts->adapt, TSADAPTNONE, &I.fixed_h));
  PetscCall(CheckpointIfDue(ts));
  if (HHT3BehindEvent(ts) && !I.fixed_h && ts->exact_final_time == TS_EXACTFINALTIME_MATCHSTEP) ts->time_step = PetscMin(ts->time_step, (ts->max_time - ts->ptime) / 2); /* Events.TwoInOneStep */
  PetscCall(BeginStep(ts));
  if (I.fixed_h) NoteGivenStep(ts);
  PetscCall(LookAheadAgain(ts));
  I.status = TS_STEP_INCOMPLETE;
  while (!ts->reason && I.status != TS_STEP_COMPLETE) {
    PetscCall(AttemptStep(ts, &tiny, &ok));
    if (ok) {
      PetscCall(AcceptOrReject(ts, tiny, &next, &accept));
      if (accept) {
        PetscCall(AcceptStep(ts, tiny, next));
        I.tiny_row = !tiny ? 0 : I.tiny_row + (rejections > 0);
      } else ts->time_step = next;
    }
    if (!ok || !accept) {
      accept = PETSC_FALSE;
      PetscCall(HistoryForces(ts, ts->ptime)); /* f_n again: if the application has failed to evaluate it, every attempt from t_n fails */
      if (!rejections || I.h > telling_roundings * PETSC_MACHINE_EPSILON * PetscAbsReal(ts->ptime)) PetscCall(PetscStrncpy(I.cause, I.failure, sizeof(I.cause)));
      PetscCall(CheckRejections(ts, ++rejections));
      if (!ok) PetscCall(LowerAfterFailure(ts));
    }
  }
  PetscCall(HooksReturnDM(ts));
  if (ts->reason || ts->ptime >= ts->max_time || ts->steps + 1 >= ts->max_steps) StopClocks(I, true);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns to t_n: the accepted step has not been committed, so that U0, V0 and the history still belong to t_n */
PetscErrorCode TSRollBack_HHT(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCheck(I.have_step, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE, "There is no step to take back, at t = %g", (double)ts->ptime);
  PetscCall(VecCopy(I.U0, ts->vec_sol));
  PetscCall(VecCopy(I.V0, ts->vec_dot));
  I.have_step = PETSC_FALSE;
  I.stat.steps--;
  I.stat.of_order[I.order.now]--;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
