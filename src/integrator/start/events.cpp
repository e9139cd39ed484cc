/*
  The first step behind an event. TSEvent compares the signs of a function at both ends of a step, and knows nothing of it where the step begins within the function's
  tolerance, as it does behind the event: a ball that has been thrown back and falls through the floor within this step is lost. Of free flight the error is zero and allows any step; so
  the Taylor series from the start says how long the function keeps the sign with which it leaves its zero.
*/
#include "start.h"
#include "integrator/work_vec.h"
#include <vector>

namespace hht3
{

namespace
{

constexpr int max_halvings = 30; /* halvings of the step: a sign that a function keeps for less than 1e-9 of it is not seen (Events.ABallIsNotLost) */

/* What is known of a function that begins at its zero, from long steps to short ones */
struct Leaving {
  PetscInt  event;
  PetscReal sign = 0; /* of the last sample beyond the tolerance */
  PetscReal keeps;    /* step in which there is no other one */
};

/* The event functions a time d from the start; as TSEvent asks for them, with the state in the solution of the TS */
PetscErrorCode FunctionsAfter(TS ts, PetscReal d, std::vector<PetscScalar> &f)
{
  Integrator     &I = Get(ts);
  const PetscReal t = ts->ptime;

  PetscFunctionBegin;
  PetscCall(Advance(I, d, ts->vec_sol, ts->vec_dot));
  ts->ptime     = t + d;
  I.event_ahead = PETSC_TRUE;
  const PetscErrorCode failed = HHT3EventFunctions(ts, ts->ptime, ts->vec_sol, f);
  I.event_ahead = PETSC_FALSE;
  ts->ptime     = t;
  PetscCall(VecCopy(I.U0, ts->vec_sol));
  PetscCall(VecCopy(I.V0, ts->vec_dot));
  PetscCall(failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those that begin at their zero, f0 */
std::vector<Leaving> AtZero(TS ts, const std::vector<PetscScalar> &f0)
{
  std::vector<Leaving> list;
  for (PetscInt i = 0; i < ts->event->nevents; i++)
    if (PetscAbsScalar(f0[i]) < ts->event->vtol[i] || HHT3IsLocated(ts, i)) list.push_back({i, 0, ts->time_step});
  return list;
}

} // namespace

PetscErrorCode LimitStepByEvents(TS ts)
{
  std::vector<PetscScalar> f0, f;
  std::vector<Leaving>     list;
  MPI_Comm                 comm = PetscObjectComm((PetscObject)ts);

  PetscFunctionBegin;
  if (!ts->event || Get(ts).fixed_h || (HHT3EventActive(ts) && !HHT3BehindEvent(ts))) PetscFunctionReturn(PETSC_SUCCESS);
  PetscReal h = ts->time_step;
  PetscCall(FunctionsAfter(ts, 0, f0));
  list         = AtZero(ts, f0);
  PetscInt any = !list.empty();
  for (int k = 0; k <= max_halvings; k++) {
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPIU_INT, MPI_MAX, comm));
    if (!any) break;
    const PetscReal d = PetscPowRealInt(0.5, k) * h;
    PetscCall(FunctionsAfter(ts, d, f));
    any = k == 0; /* a function may happen to be at its zero at the end of the step */
    for (Leaving &l : list) {
      const PetscReal change = PetscRealPart(f[l.event] - f0[l.event]); /* not f: where TSEvent has found the zero, f0 may be more than the tolerance */
      if (!(PetscAbsReal(change) >= ts->event->vtol[l.event])) continue;
      any = 1;
      if (change * l.sign < 0) l.keeps = d;
      l.sign = change;
    }
  }
  for (const Leaving &l : list) h = PetscMin(h, l.keeps);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &h, 1, MPIU_REAL, MPIU_MIN, comm));
  if (h == ts->time_step) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "a function of an event comes back to its zero within the step of %g: %g\n", (double)ts->time_step, (double)h));
  /* nor is the second step longer: TSEvent takes thousands on its way to a zero that is near the beginning of a step (Events.BouncesThatAccumulate) */
  if (Get(ts).h_chosen) {
    HHT3StepAfterEvent(ts, {unset_step, petsc_default_step, Get(ts).h_after_event}, h);
    Get(ts).h_after_event = h;
  }
  ts->time_step = h;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
