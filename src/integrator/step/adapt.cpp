/*
  The default type of TSAdapt, "hhtdae": PETSc's basic controller, which with the order of the estimate is (41), and rules that change the h
  it chooses. Any other type replaces it, as by -ts_adapt_type basic.
*/
#include "estimate.h"
#include "order.h"
#include "integrator/start/start.h"

namespace hht3
{

namespace
{

using ChooseFunction = PetscErrorCode (*)(TSAdapt, TS, PetscReal, PetscInt *, PetscReal *, PetscBool *, PetscReal *, PetscReal *, PetscReal *);

struct Basic {
  ChooseFunction choose = nullptr;
};

/* After a failed correction the controller would raise h at once to the value at which it failed: h_limit makes it do so slowly. And
   growth of h by less than a factor `hold` costs more in matrices than it saves in steps. */
PetscErrorCode HoldStep(TS ts, PetscReal h, PetscReal *next)
{
  const Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (I.h_limit > 0 && *next > I.h_limit) *next = PetscMax(h, I.h_limit);
  if (*next <= h || *next >= I.corrector.hold * h) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "h stays at %g: growth to %g is not worth a new matrix\n", (double)h, (double)*next));
  *next = h;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error estimate below this part of the tolerance: nothing moves, or everything moves evenly */
constexpr PetscReal negligible_error = 1e-3;
/* Then h grows by no more than this factor: a load that lasts as long as the time before it is not stepped over
   (Excitation.WhatSetsInLater) ... */
constexpr PetscReal waiting_growth   = 2;
/* ... but freely up to this part of h_regular, so that steps recover from a failure (jumps of velocities in the table of stability) */
constexpr PetscReal regular_fraction = 0.1;

/* Where nothing moves, the error estimate says nothing about loads and motions that set in later: limits the growth of h if there are any */
PetscErrorCode WaitForLoads(TS ts, PetscReal h, PetscReal *next)
{
  Integrator     &I        = Get(ts);
  const PetscReal furthest = PetscMin(PetscMax(waiting_growth * h, regular_fraction * I.h_regular), coasting_fraction * (ts->max_time - I.t_begin));

  PetscFunctionBegin;
  if (*next <= furthest) PetscFunctionReturn(PETSC_SUCCESS);
  if (I.fastest >= PETSC_MAX_REAL && (I.ahead == Ahead::Unknown || (I.ahead == Ahead::Nothing && ts->max_time > I.ahead_to))) PetscCall(LookAhead(ts, I.t1, I.U1, I.V1));
  if (I.fastest < PETSC_MAX_REAL || I.ahead == Ahead::Loads) *next = furthest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If only the last step before a given time were shortened, this change of h would leave an error in the multipliers for as many
   steps as the history has. So the last steps before such a time share the remainder in equal parts (LastSteps.AreOfOneLength). */
PetscErrorCode ShareTheRest(TS ts, PetscReal h, PetscReal *next)
{
  const PetscReal rest = HHT3StopAfter(ts, ts->ptime + h) - (ts->ptime + h), equal = 1e-6; /* but for rounding */

  PetscFunctionBegin;
  if (ts->exact_final_time != TS_EXACTFINALTIME_MATCHSTEP || rest < (1 - equal) * *next || rest > equal_last_steps * *next) PetscFunctionReturn(PETSC_SUCCESS);
  const PetscReal steps = PetscCeilReal(rest / *next - equal);
  if (steps * *next - rest > equal * rest) PetscCall(PetscInfo(ts, "the last %g steps before a given time are of one length, %g in place of %g\n", (double)steps, (double)(rest / steps), (double)*next));
  *next = rest / steps;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* wlte < 0: a step too short for the corrector has no error estimate, so that the controller does not let h grow */
PetscErrorCode TSAdaptChoose_HHT(TSAdapt adapt, TS ts, PetscReal h, PetscInt *scheme, PetscReal *next, PetscBool *accept, PetscReal *wlte, PetscReal *wltea, PetscReal *wlter)
{
  PetscBool ours;

  PetscFunctionBegin;
  PetscCall((*static_cast<Basic *>(adapt->data)->choose)(adapt, ts, h, scheme, next, accept, wlte, wltea, wlter));
  PetscCall(PetscObjectTypeCompare((PetscObject)ts, TSHHT3, &ours)); /* the TSAdapt stays when the type of the TS is changed */
  if (!ours || !*accept) PetscFunctionReturn(PETSC_SUCCESS);
  if (*wlte >= 0) PetscCall(ChooseOrder(ts, next));
  if (*wlte >= 0 && *wlte < negligible_error) PetscCall(WaitForLoads(ts, h, next));
  if (*wlte >= 0) PetscCall(HoldStep(ts, h, next));
  else *next = PetscMax(*next, PetscMin(Get(ts).h_regular > 0 ? Get(ts).h_regular : 10 * h, adapt->dt_max));
  PetscCall(ShareTheRest(ts, h, next));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TSAdaptDestroy_HHT(TSAdapt adapt)
{
  PetscFunctionBegin;
  delete static_cast<Basic *>(adapt->data);
  adapt->data = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* The last search for loads and motions has found none up to the end of the run at that time, and now the run goes on beyond it
   (Excitation.InARunThatGoesOn). They are looked for at once only if the step is long and nothing moves; otherwise WaitForLoads()
   does it before h grows. */
PetscErrorCode LookAheadAgain(TS ts)
{
  Integrator &I = Get(ts);
  PetscBool   ours;

  PetscFunctionBegin;
  if (I.ahead != Ahead::Nothing || !(ts->max_time > I.ahead_to)) PetscFunctionReturn(PETSC_SUCCESS);
  if (ts->time_step <= coasting_fraction * (ts->max_time - I.t_begin) || I.corrector.wlte >= negligible_error) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompare((PetscObject)ts->adapt, TSHHT3, &ours));
  if (!ours) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LookAhead(ts, ts->ptime, I.U0, I.V0));
  if (I.ahead == Ahead::Loads) ts->time_step = PetscMin(ts->time_step, coasting_fraction * (ts->max_time - I.t_begin));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TSADAPTBASIC with its choose() wrapped by TSAdaptChoose_HHT() */
PetscErrorCode TSAdaptCreate_HHT(TSAdapt adapt)
{
  PetscFunctionBegin;
  PetscCall(TSAdaptSetType(adapt, TSADAPTBASIC));
  adapt->data         = new Basic{adapt->ops->choose};
  adapt->ops->choose  = TSAdaptChoose_HHT;
  adapt->ops->destroy = TSAdaptDestroy_HHT;
  PetscCall(PetscObjectChangeTypeName((PetscObject)adapt, TSHHT3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
