/* The length of the first step, where the user gives none: from the accelerations and rates of a consistent start. */
#include "consistent.h"
#include "integrator/entries.h"
#include "integrator/step/estimate.h"
#include "integrator/work_vec.h"
#include "start.h"

namespace hht3
{

namespace
{

/* Local errors in units of the tolerance that steps from the start leave, by its rates: of coordinates |k| h^3 q''', of states k_s h^3 s''' with |s''|^2/|s'| in place of
   s''', or |s''|^1.5/|s|^0.5 where s' passes through 0, but no more than s changes by s'', gamma_s h^2 s'' (FirstStep.StatesInAnyUnitOfTime, BetweenRuns.RestartsOfStates) */
struct StartErrors {
  PetscReal coordinates = 0, states = 0; /* over h^3 */
  PetscReal change = 0;                  /* of states, over h^2 */
  PetscReal at(PetscReal h) const { return PetscSqrtReal(PetscSqr(coordinates * h * h * h) + (change > 0 ? PetscSqr(PetscMin(states * h * h * h, change * h * h)) : 0)); }
  PetscReal step(PetscReal e) const /* that leaves no more of either */
  {
    const PetscReal q = coordinates > 0 ? PetscPowReal(e / coordinates, (PetscReal)1 / 3) : PETSC_MAX_REAL;
    return change > 0 ? PetscMin(q, PetscMax(PetscPowReal(e / states, (PetscReal)1 / 3), PetscSqrtReal(e / change))) : q;
  }
};

PetscErrorCode ErrorsOfStart(TS ts, Vec rate, StartErrors *e)
{
  Integrator &I           = Get(ts);
  PetscReal   sum[3]      = {0, 0, 0}; /* squares of s', s'' and of how large s has been */
  Vec         coordinates = rate;
  WorkVec     x;

  PetscFunctionBegin;
  *e = {};
  if (I.count[TSHHT3_STATE]) {
    PetscCall(x.like(rate));
    PetscCall(VecCopy(rate, x));
    coordinates = x;
    PetscCall(ForSome(
      I.states,
      [&](PetscInt, PetscScalar s2, PetscScalar s1, PetscScalar y, PetscScalar w, PetscScalar &q) {
        sum[0] += PetscSqr(PetscRealPart(s1 * w));
        sum[1] += PetscSqr(PetscRealPart(s2 * w));
        sum[2] += PetscSqr(PetscRealPart(y * w));
        q = 0;
      },
      Read(rate), Read(I.V0), Read(I.ymax), Read(I.weight), Write(x)));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  }
  PetscCall(CorrectionNorm(ts, coordinates, 1, &e->coordinates));
  const PetscReal s = PetscSqrtReal(sum[1] / PetscMax(I.norm_size, 1));
  e->change         = I.p.gamma_s * s;
  const PetscReal by_rate = sum[0] > 0 ? PetscSqrtReal(sum[1] / sum[0]) : PETSC_MAX_REAL, by_size = sum[2] > 0 ? PetscPowReal(sum[1] / sum[2], 0.25) : PETSC_MAX_REAL;
  const PetscReal faster  = PetscMin(by_rate, by_size);
  e->states               = faster < PETSC_MAX_REAL ? PetscAbsReal(I.p.k_s) * s * faster : PETSC_MAX_REAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first h: a local error of an eighth of the tolerance from q''' and from what q'' itself tells of its second derivative; without these, the length of the run. Not longer than loads and motions allow
   that depend on time alone: of their period the error of a longer one might know nothing (Excitation.TheFirstStepFollowsTheLoad). */
PetscErrorCode FirstStep(TS ts, Vec rate, PetscReal *h)
{
  Integrator &I = Get(ts);
  StartErrors e;
  PetscReal   e2, T;

  PetscFunctionBegin;
  PetscCall(ErrorsOfStart(ts, rate, &e));
  PetscCall(CorrectionNorm(ts, I.A0, 1, &e2));
  const PetscReal span = HHT3StopAfter(ts, ts->ptime) < PETSC_MAX_REAL / 2 ? HHT3StopAfter(ts, ts->ptime) - ts->ptime : 1;
  PetscReal       h3 = e.step(0.125);
  PetscCall(TimeScaleOfAccelerations(ts, I.A0, &T));
  if (e2 > 0 && T < PETSC_MAX_REAL) h3 = PetscMin(h3, PetscPowReal(0.125 * T * T / e2, 0.25)); /* q'''' as large as q''/T^2: from rest q''' is rounding (FirstStep.FromRest) */
  *h = PetscMin(h3, PetscMin(span / 10, I.fastest));
  *h = PetscClipInterval(*h, ts->adapt->dt_min, ts->adapt->dt_max);
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode ErrorOfStart(TS ts, Vec rate, PetscReal h, PetscReal *e)
{
  StartErrors errors;

  PetscFunctionBegin;
  PetscCall(ErrorsOfStart(ts, rate, &errors));
  *e = errors.at(h);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the user has set none, also not since the set-up; TSSolve() may have cut what stood there to the length of the run */
PetscErrorCode ChooseFirstStep(TS ts, Vec rate)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  const bool unset = ts->time_step == unset_step || ts->time_step == HHT3StopAfter(ts, ts->ptime) - ts->ptime;
  if (I.auto_h && unset && I.fixed_h) ts->time_step = PetscMin(petsc_default_step, HHT3StopAfter(ts, ts->ptime) - ts->ptime);
  else if (I.auto_h && unset) {
    PetscCall(FirstStep(ts, rate, &ts->time_step));
    PetscCall(PetscInfo(ts, "start: first step %g\n", (double)ts->time_step));
    I.h_chosen = PETSC_TRUE;
  }
  I.auto_h = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
