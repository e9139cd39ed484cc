/* The longest step that the application allows, for events within a step that do not show at its ends and so not in the error estimate */
#include "estimate.h"

namespace hht3
{

/* Called before an attempt from t_n. Steps of fixed length are not changed. */
PetscErrorCode ApplyStepLimit(TS ts)
{
  Integrator &I = Get(ts);
  PetscReal   h = PETSC_MAX_REAL;

  PetscFunctionBegin;
  if (!I.limit.limit || I.fixed_h) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall((*I.limit.limit)(ts, ts->ptime, I.U0, I.V0, I.A0, &h, I.limit.ctx));
  PetscCheck(h > 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "The function of TSHHT3SetStepLimit() allows a step of %g at t = %g, must be positive", (double)h,
             (double)ts->ptime);
  h = PetscMax(h, PetscMin(ts->adapt->dt_min, ts->time_step));
  if (h < ts->time_step) {
    PetscCall(PetscInfo(ts, "the application allows a step of %g in place of %g\n", (double)h, (double)ts->time_step));
    ts->time_step = h;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetStepLimit(TS ts, TSHHT3StepLimit limit, void *ctx)
{
  PetscFunctionBegin;
  Get(ts).limit = {limit, ctx};
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@C
  TSHHT3SetStepLimit - Gives a function that says how long the next step may be

  Logically Collective

  Input Parameters:
+ ts    - the `TS` context
. limit - the function, or `NULL` for none
- ctx   - its context

  Calling sequence of limit:
$ PetscErrorCode limit(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal *h, void *ctx)
+ ts    - the `TS` context
. t     - the time of the state
. U     - the solution, read-only
. V     - its first time derivative, read-only
. A     - its second time derivative, read-only
. h     - on entry the largest number, which is no limit; on return the longest step, the same on all ranks
- ctx   - the context

  Level: advanced

  Note:
  The error estimate uses values at the ends of a step. It does not show what begins and ends between them, as when a body flies
through another one. The function is called before every attempt of a step of variable length.

.seealso: `TSHHT3`, `TSHHT3SetCoordinateChange()`
@*/
PetscErrorCode TSHHT3SetStepLimit(TS ts, TSHHT3StepLimit limit, void *ctx)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscTryMethod(ts, "TSHHT3SetStepLimit_C", (TS, TSHHT3StepLimit, void *), (ts, limit, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}
