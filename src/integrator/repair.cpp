/* Steps so short that the corrector could not make them from where the last one ended, or not at all. */
#include "consistent.h"
#include "corrector.h"
#include "equations.h"
#include "estimate.h"
#include "events.h"
#include "formulas.h"
#include "order.h"
#include "start.h"
#include "work_vec.h"

namespace hht3
{

/*
  When h has to shrink by much. A step of length h satisfies Phi_q q' + Phi_t = 0 to O(h^2) only; a far shorter one that
  starts from there turns this misfit into accelerations of O(h_old^2/h_new), which no further reduction of h mends. So the
  velocities of t_n are projected on the constraints and the step starts afresh, consistently, at the new h.
*/
PetscErrorCode Repair(TS ts)
{
  Integrator &I = Get(ts);
  Prepared    have;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.start, ts, 0, 0, 0));
  PetscCall(PetscInfo(ts, "h falls from %g to %g at t = %g: velocities projected, consistent start\n", (double)I.h_last, (double)ts->time_step, (double)ts->ptime));
  I.stat.restarts++;
  ResetOrder(ts);
  if (!I.repaired) {
    Vec now[2] = {I.U0, I.V0};
    for (int k = 0; k < 2; k++) {
      if (!I.accepted[k]) PetscCall(VecDuplicate(now[k], &I.accepted[k]));
      PetscCall(VecCopy(now[k], I.accepted[k]));
    }
    I.repaired = PETSC_TRUE;
  }
  PetscCall(ProjectVelocities(ts, &have));
  PetscCall(StartFromState(ts, have));
  PetscCall(PetscLogEventEnd(events.start, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A step so short that rounding of Phi, eps |q|/(beta h^2), would drown the accelerations: TSEvent may ask for one, or the
  final time. q and q' advance by Taylor series, whose error is far below rounding of the corrector's, and accelerations
  and multipliers are made consistent anew.
*/
PetscErrorCode IsTinyStep(TS ts, PetscReal h, PetscBool *tiny)
{
  Integrator &I = Get(ts);
  PetscReal   T, e;

  PetscFunctionBegin;
  *tiny = PETSC_FALSE;
  if (!I.count[TSHHT3_HOLONOMIC] || h > 1e-4 * I.h_regular) {
    /* the common case is decided without a reduction: no step of regular size is tiny */
    if (!I.count[TSHHT3_HOLONOMIC] || I.h_regular > 0) PetscFunctionReturn(PETSC_SUCCESS);
  }
  const PetscReal h0 = I.h;
  I.h                = 1;
  PetscCall(CorrectionNorm(ts, I.A0, &e));
  I.h = h0;
  PetscCall(TimeScale(ts, &T));
  const PetscReal eps = PetscMax(ts->rtol, PETSC_SQRT_MACHINE_EPSILON), a = PetscMax(e / PetscAbsReal(I.p.k) * eps, eps / (T * T));
  const PetscReal noise = PETSC_MACHINE_EPSILON / ScalePosition(I.p, h);
  *tiny                 = (PetscBool)(noise > 0.01 * a);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From U0, V0, A0 over h: leaves U1, V1, A1 and X as a corrected step would */
PetscErrorCode TinyStep(TS ts, PetscBool *ok)
{
  Integrator &I = Get(ts);
  WorkVec     U, V;

  PetscFunctionBegin;
  PetscCall(PetscInfo(ts, "step of %g is below what rounding of q allows the corrector: Taylor series\n", (double)I.h));
  I.stat.tiny_steps++;
  PetscCall(U.like(I.U0));
  PetscCall(V.like(I.U0));
  PetscCall(Advance(I, I.h, U, V));
  PetscCall(VecCopy(I.predictor.D[0], I.X));
  PetscCall(ConsistentAccelerations(ts, I.t1, 0, U, V, {}, ok));
  if (*ok) {
    /* the start has differentiated the constraints at times around t1: it need not have seen their values there */
    PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, I.A1, U));
    PetscCall(CheckNumbers(ts, I.t1, {U, I.U1, I.V1, I.A1}, ok));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
