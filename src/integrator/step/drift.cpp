/*
  Velocities when h changes.

  The method satisfies Phi = 0, but Phi_q q' + Phi_t = 0 only up to a drift C h^2. While h is constant, so is this drift of the
  velocities, and it does no harm. When h changes from h_n to h, the drift has to become C h^2 within one step, which takes
  accelerations of C (h_n^2 - h^2)/h normal to the constraints: a spike of first order in q'' and lambda. It shows in all that depends
  on these (outputs, states driven by accelerations), and in the error test of such states as an error that does not decrease with h
  as it should.

  So the part 1 - (h/h_n)^2 of the drift is subtracted from q'_n before a step of a new length. The drift dV follows from
  [M^ Phi_q^T; Phi_q 0] [dV; mu] = [0; Phi_q q' + Phi_t], with the present Newton matrix, since it need not be exact, and the right-hand side
  from a central difference of Phi along the motion. A change of h costs two residuals and one solve. The reported
  q'_n does not change.

  Consistent velocities of a start have no drift: SetDriftOfStart() adds it.

  The drift is -k h^2 (q''')_normal: (2a) misses q by k h^3 q''', which Phi = 0 does not allow in the directions normal to the constraints.
  (k is jerk_factor() of formulas.h.) A change of coordinates maps velocities as tangents, Q'_n = T q'_n, but the third
  derivative gets additional terms, Q''' = T q''' + d (history.cpp), so that the drift has to grow by -k h^2 d_normal; otherwise there is a
  spike again. d_normal follows from d as dV does from q'_n, with Phi_q d by a central difference along d.
*/
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "estimate.h"
#include "integrator/equations/solver.h"
#include "stage.h"
#include "integrator/start/start.h"

namespace hht3
{

namespace
{

/* The smallest relative change of h for which velocities are corrected. A smaller one is needed with first-order states, whose error
   test shows the spike; at the end of a run, where multipliers are read (Analyses.KinematicsOfAFourBar); and with little damping,
   where the multipliers' oscillation amplifies the spike by 1/(1-rho). */
PetscReal LeastChangeOfStep(TS ts)
{
  const Integrator &I     = Get(ts);
  const PetscReal   least = 1e-3;
  const bool        last  = ts->exact_final_time == TS_EXACTFINALTIME_MATCHSTEP && HHT3StopAfter(ts, ts->ptime) - ts->ptime <= (equal_last_steps + 0.5) * I.h;

  return I.count[TSHHT3_STATE] || last ? least : PetscMax(least, 0.1 * RelativeDamping(I.p.rho));
}

/* dV: the coordinates' part of the solution for the right-hand side gamma, zero if the solve fails. The present factors are used even
   though the matrix has changed since: after a start it is that of the rates (Statistics.FactorizationsOfAStart). If they are the
   factors of a singular matrix, with which the last correction failed, the matrix of a start at t_n is factored. */
PetscErrorCode SolveNormal(TS ts, Vec dV)
{
  Integrator &I = Get(ts);
  KSP         ksp;
  PetscBool   ok, reuse; /* reuse: the user's setting */

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetReusePreconditioner(ksp, &reuse));
  PetscCall(KSPSetReusePreconditioner(ksp, PETSC_TRUE));
  const PetscErrorCode failed = SolveOfTheRun(ts, I.gamma, dV, &ok);
  PetscCall(KSPSetReusePreconditioner(ksp, reuse));
  PetscCall(failed);
  if (!ok) {
    PetscCall(StartMatrix(ts));
    PetscCall(SolveOfTheRun(ts, I.gamma, dV, &ok));
  }
  if (!ok) PetscCall(VecZeroEntries(dV));
  else PetscCall(TakeRoles(I, dV, {TSHHT3_COORDINATE}, dV));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gamma: the derivative of the holonomic constraints at t_n along `direction`, with_time also that with respect to time, as a central
   difference over tau */
PetscErrorCode ChangeOfConstraints(TS ts, Vec direction, PetscReal tau, bool with_time)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(VecZeroEntries(I.gamma));
  PetscCall(VecZeroEntries(I.A1));
  for (int sign = -1; sign <= 1; sign += 2) {
    const PetscReal scale = sign / (2 * tau);
    PetscCall(VecWAXPY(I.U1, sign * tau, direction, I.U0));
    PetscCall(EvaluateResidual(ts, with_time ? ts->ptime + sign * tau : ts->ptime, I.U1, I.V0, I.A1, I.work));
    PetscCall(ForEntries([&](PetscInt i, PetscScalar f, PetscScalar &g) { if (I.role[i] == TSHHT3_HOLONOMIC) g += scale * f; }, Read(I.work), Write(I.gamma)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces d in normal_jerk by its normal part. The difference of Phi is over a length that is well above rounding. */
PetscErrorCode MakeJerkNormal(TS ts)
{
  Integrator &I = Get(ts);
  PetscReal   d, u;

  PetscFunctionBegin;
  I.jerk = Jerk::None;
  PetscCall(VecNorm(I.normal_jerk, NORM_INFINITY, &d));
  PetscCall(VecNorm(I.U0, NORM_INFINITY, &u));
  if (!(d > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  const PetscReal tau = 1e-5 * PetscClipInterval(u, 1e-3, 1) / d;
  PetscCall(ChangeOfConstraints(ts, I.normal_jerk, tau, false));
  PetscCall(SolveNormal(ts, I.normal_jerk));
  I.jerk = Jerk::Normal;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Measures dV at t_n. Uses U1, A1, gamma and work as work space, and so must not be called during the iteration. */
PetscErrorCode MeasureDrift(TS ts)
{
  Integrator     &I   = Get(ts);
  const PetscReal tau = SpanFrom(ts->ptime, 0.1 * I.h_last);

  PetscFunctionBegin;
  if (!I.dV) PetscCall(VecDuplicate(I.U0, &I.dV));
  PetscCall(ChangeOfConstraints(ts, I.V0, tau, true));
  PetscCall(SolveNormal(ts, I.dV));
  I.have_drift = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A consistent start has no drift, but the method's is -k h^2 (q''')_normal. The first step would produce it by an
   oscillation of the multipliers, which with little damping takes many steps to decay. `rate` is q'''; the factors are those of the start. */
PetscErrorCode SetDriftOfStart(TS ts, Vec rate)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (!I.count[TSHHT3_HOLONOMIC] || ts->snes->mf_operator) PetscFunctionReturn(PETSC_SUCCESS);
  if (!I.normal_jerk) PetscCall(VecDuplicate(I.U0, &I.normal_jerk));
  PetscCall(TakeRoles(I, rate, {TSHHT3_COORDINATE}, I.normal_jerk));
  PetscCall(MakeJerkNormal(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AdaptVelocities(TS ts)
{
  Integrator     &I = Get(ts);
  const PetscReal r = I.h_last > 0 ? I.h / I.h_last : 1;

  PetscFunctionBegin;
  I.drift_removed = 0;
  if (I.order.now > 2) PetscFunctionReturn(PETSC_SUCCESS);
  if (I.jerk == Jerk::Whole && I.corrector.matrix.have) PetscCall(MakeJerkNormal(ts));
  if (!I.count[TSHHT3_HOLONOMIC] || PetscAbsReal(r - 1) < LeastChangeOfStep(ts) || !I.corrector.matrix.have) PetscFunctionReturn(PETSC_SUCCESS);
  if (!I.have_drift) PetscCall(MeasureDrift(ts));
  I.drift_removed = 1 - r * r;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
