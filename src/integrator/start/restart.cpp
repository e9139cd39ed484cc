/* Steps so short that the corrector could not make them from where the last one ended, or not at all. */
#include "integrator/step/corrector.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "integrator/step/estimate.h"
#include "integrator/step/order.h"
#include "start.h"
#include "integrator/work_vec.h"

namespace hht3
{

constexpr PetscReal restart_ratio  = 0.1;  /* h below this times the last one calls for a consistent start, see RestartConsistently() */
constexpr PetscReal grown_rounding = 1e-6; /* part of the accelerations that growth may make of rounding: ten times as much comes by the velocities
                                      (BetweenRuns.GrowthFromAShortStepKeepsTheMultipliers) */

constexpr PetscReal tiny_ratio            = 1e-4; /* of the longest step of late: the common case, decided without a reduction */
constexpr PetscReal rounded_accelerations = 0.01; /* part of the accelerations that may be rounding in a step that goes through the corrector */
constexpr PetscReal rounded_loads         = 1e-10; /* of the loads: accelerations below are what rounding leaves where these are balanced (releases of the table of stability) */

/*
  When h has to shrink by much. A step of length h satisfies Phi_q q' + Phi_t = 0 to O(h^2) only; a far shorter one that
  starts from there turns this drift of the velocities into accelerations of O(h_old^2/h_new), which no further reduction of h mends. So positions and
  velocities of t_n are projected on the constraints and the step starts afresh, consistently, at the new h.
*/
PetscErrorCode RestartConsistently(TS ts)
{
  Integrator &I = Get(ts);
  Prepared    have;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.start, ts, 0, 0, 0));
  PetscCall(PetscInfo(ts, "h changes from %g to %g at t = %g: positions and velocities projected, consistent start\n", (double)I.h_last, (double)ts->time_step, (double)ts->ptime));
  I.stat.restarts++;
  ResetOrder(ts);
  PetscCall(ProjectState(ts, &have));
  PetscCall(StartFromState(ts, have));
  PetscCall(PetscLogEventEnd(events.start, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the step to come is far shorter than those of late, by which the corrector has measured what it leaves of the constraints */
PetscBool IsFarShorter(const Integrator &I, PetscReal h) { return (PetscBool)(h < restart_ratio * I.h_regular); }

/* Whether the accelerations are more than rounding of the loads, which are taken without velocities and forces of constraints: those of a body that a damper lets sink slowly are not */
static PetscErrorCode AreAccelerated(TS ts, PetscBool *yes)
{
  const Integrator &I      = Get(ts);
  PetscReal         sum[2] = {0, 0}; /* squares of loads, and of what the accelerations add */
  WorkVec           U, zero, load, F;

  PetscFunctionBegin;
  for (WorkVec *v : {&U, &zero, &load, &F}) PetscCall(v->like(I.U0));
  PetscCall(VecCopy(I.U0, U));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar &u) { if (IsConstraint(I, i)) u = 0; }, Write(U)));
  PetscCall(EvaluateResidual(ts, ts->ptime, U, zero, zero, load));
  PetscCall(EvaluateResidual(ts, ts->ptime, U, zero, I.A0, F));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar f, PetscScalar all) {
      if (!IsCoordinate(I, i)) return;
      sum[0] += PetscRealPart(f * f);
      sum[1] += PetscRealPart((all - f) * (all - f));
    },
    Read(load), Read(F)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  *yes = (PetscBool)(PetscSqrtReal(sum[1]) > rounded_loads * PetscSqrtReal(sum[0])); /* not where these are no numbers */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What rounding of Phi makes of accelerations in a step of length h, eps |q|/(beta h^2), in parts of the accelerations that there are, and of those that change
   q by its tolerance in the time that the motion takes; where there are none, within the run. In a run of a millionth of that time these are far larger
   (BetweenRuns.ShortRunsHaveTheirMultipliers). */
static PetscErrorCode RoundingOfAccelerations(TS ts, PetscReal h, PetscReal *part)
{
  const Integrator &I     = Get(ts);
  PetscBool         there = PETSC_TRUE;
  PetscReal         run, motion, e;

  PetscFunctionBegin;
  PetscCall(CorrectionNorm(ts, I.A0, 1, &e));
  PetscCall(TimeScale(ts, &run));
  PetscCall(TimeScaleOfConstraints(ts, I.V0, &motion));
  const PetscReal eps = PetscMax(ts->rtol, PETSC_SQRT_MACHINE_EPSILON), rounding = PETSC_MACHINE_EPSILON / ScalePosition(I.p, h);
  const PetscReal least = eps / PetscSqr(run), a = PetscMax(e / PetscAbsReal(I.p.k) * eps, eps / PetscSqr(motion));
  if (a < least && rounding > rounded_accelerations * a) PetscCall(AreAccelerated(ts, &there)); /* else it makes no difference */
  *part = rounding / (there ? a : PetscMax(a, least));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What Taylor's series leaves out of coordinates, h^3/6 q''', and of states, h^2/2 s'', in units of the tolerance, by the slope of the unknowns */
static PetscErrorCode TaylorError(TS ts, PetscReal h, Vec slope, PetscReal *e)
{
  const Integrator &I   = Get(ts);
  PetscReal         sum = 0;

  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar rate, PetscScalar w) { sum += PetscSqr(PetscRealPart(rate * w) * (IsCoordinate(I, i) ? h * h * h / 6 : h * h / 2)); },
    Read(slope), Read(I.weight)));
  PetscCall(ReduceNorm(ts, NORM_2, sum, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A step so short that rounding of Phi would drown the accelerations: TSEvent may ask for one, or the
  final time. q and q' advance by Taylor series, whose error is far below rounding of the corrector's, and accelerations
  and multipliers are made consistent anew. They must not miss more than the corrector leaves: where accelerations are rounding, as at rest, ordinary steps
  look so short (FirstStep.StatesBesideAMechanismAtRest, FirstStep.DrivenFromNoAcceleration).
*/
PetscErrorCode IsTinyStep(TS ts, PetscReal h, PetscBool *tiny)
{
  Integrator &I = Get(ts);
  PetscReal   part;

  PetscFunctionBegin;
  *tiny = PETSC_FALSE;
  if (!I.count[TSHHT3_HOLONOMIC] || (I.h_regular > 0 && h > tiny_ratio * I.h_regular && h > 10 * I.h_rounded)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(RoundingOfAccelerations(ts, h, &part));
  if (part <= rounded_accelerations) PetscFunctionReturn(PETSC_SUCCESS);
  I.h_rounded = h * PetscSqrtReal(part / rounded_accelerations); /* only where a step was drowned: at rest, longer ones would pass for tiny and skip loads that set in (SceneReferences.QuarterCar) */
  *tiny = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether to begin afresh at t_n, for a step of length h: where it is far shorter than the last one, or where growth would amplify what rounding has left in that one
   of the lag of a_n and of the drift of the velocities, which are stretched with h and h^2. At given steps orders above two, whose steps have no such drift, do
   better without (HigherOrder.StepFarShorterThanTheOthers). */
PetscErrorCode NeedsRestart(TS ts, PetscReal h, PetscBool *yes)
{
  const Integrator &I = Get(ts);
  PetscReal         part;

  PetscFunctionBegin;
  *yes = PETSC_FALSE;
  if (I.order.now > 2 && I.fixed_h) PetscFunctionReturn(PETSC_SUCCESS);
  *yes = (PetscBool)(I.constraints() && h < restart_ratio * I.h_last);
  if (*yes || !I.count[TSHHT3_HOLONOMIC] || h <= I.h_last || !I.h_last) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(RoundingOfAccelerations(ts, I.h_last, &part));
  *yes = (PetscBool)(part * h > grown_rounding * I.h_last);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From U0, V0, A0 over h: leaves U1, V1, A1 and X as a corrected step would. Where these tell that the series has missed more than the corrector leaves, as a load that has
   set in, the step is not tiny after all (Excitation.WhereAccelerationsAreNextToNothing). */
PetscErrorCode TinyStep(TS ts, PetscBool *tiny, PetscBool *ok)
{
  Integrator &I = Get(ts);
  PetscReal   missed;
  Prepared    have;
  WorkVec     U, V;

  PetscFunctionBegin;
  PetscCall(PetscInfo(ts, "step of %g is below what rounding of q allows the corrector: Taylor series\n", (double)I.h));
  PetscCall(U.like(I.U0));
  PetscCall(V.like(I.U0));
  PetscCall(Advance(I, I.h, U, V));
  PetscCall(VecCopy(I.predictor.X[0], I.X));
  PetscCall(ConsistentAccelerations(ts, I.t1, 0, U, V, have, ok));
  if (*ok) {
    PetscCall(VecWAXPY(U, -1, I.predictor.X[0], I.X));
    PetscCall(VecScale(U, 1 / I.h));
    PetscCall(TaylorError(ts, I.h, U, &missed));
    *tiny = (PetscBool)(missed <= CorrectorTolerance(I));
    if (!*tiny) PetscCall(PetscInfo(ts, "the series has missed %g times what the corrector leaves: a step of the corrector\n", (double)(missed / CorrectorTolerance(I))));
  }
  if (*tiny) I.stat.tiny_steps++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
