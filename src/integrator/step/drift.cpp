/*
  Velocities when h changes.

  The method satisfies Phi = 0, and Phi_q q' + Phi_t = 0 only to C h^2. While h is constant so is that drift of the velocities, and nobody
  notices. When h changes from h_n to h it has to become C h^2 within one step, which takes normal accelerations of
  C (h_n^2 - h^2)/h: a spike of first order in q'' and lambda, seen by whatever depends on them (outputs, states driven by
  accelerations), and by the error test of such states as an error that does not fall as it should.

  So the part 1 - (h/h_n)^2 of the drift is taken out of q'_n before a step of a new length: dV from
  [M^ Phi_q^T; Phi_q 0] [dV; mu] = [0; Phi_q q' + Phi_t], with the matrix at hand, since it need not be exact, and the right-hand side
  from a central difference of Phi along the motion. Two residuals and one solve per change of h; nothing else. The reported
  q'_n stays as it is.

  A start, SetDriftOfStart(), puts in that drift, which consistent velocities do not have.

  A change of coordinates bends the motion: (2a) misses q by k h^3 q''', which Phi = 0 does not allow in the normals' directions,
  and that is the drift, -k h^2 (q''')_normal. While velocities follow the new coordinates Q as tangents, Q'_n = T q'_n, the third
  derivative has terms of its own, Q''' = T q''' + d (history.cpp), and the drift has to grow by -k h^2 d_normal, or there is the
  spike again. d_normal comes from d as dV does from q'_n, with Phi_q d by a central difference along d.
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

/* Relative changes of h that are worth it. First-order states in the error test see the spike of smaller ones, as does whoever reads the multipliers where a run
   ends (Analyses.KinematicsOfAFourBar), and without damping the multipliers' oscillation is a spike that grows by 1/(1-rho). */
PetscReal LeastChangeOfStep(TS ts)
{
  const Integrator &I     = Get(ts);
  const PetscReal   least = 1e-3;
  const bool        last  = ts->exact_final_time == TS_EXACTFINALTIME_MATCHSTEP && HHT3StopAfter(ts, ts->ptime) - ts->ptime <= (equal_last_steps + 0.5) * I.h;

  return I.count[TSHHT3_STATE] || last ? least : PetscMax(least, 0.1 * RelativeDamping(I.p.rho));
}

/* The solution's part in the coordinates for a right-hand side gamma, zero where it cannot be had. The factors at hand serve, though those of a start have met
   the matrix of its rates since (Statistics.FactorizationsOfAStart); they may be those with which the last correction failed, as the matrix was singular: then others. */
PetscErrorCode SolveNormal(TS ts, Vec dV)
{
  Integrator &I = Get(ts);
  KSP         ksp;
  PetscBool   ok, reuse; /* the user's */

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetReusePreconditioner(ksp, &reuse));
  PetscCall(KSPSetReusePreconditioner(ksp, PETSC_TRUE));
  const PetscErrorCode failed = SolveOfTheRun(ts, I.gamma, dV, &ok);
  PetscCall(KSPSetReusePreconditioner(ksp, reuse));
  PetscCall(failed);
  if (!ok) {
    PetscCall(StartMatrix(ts, ts->ptime, I.U0, I.V0));
    PetscCall(SolveOfTheRun(ts, I.gamma, dV, &ok));
  }
  if (!ok) PetscCall(VecZeroEntries(dV));
  else PetscCall(TakeRoles(I, dV, {TSHHT3_COORDINATE}, dV));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gamma: the derivative of holonomic constraints at t_n along a direction, and by time where it is that of the motion, as a central difference over tau */
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

/* From d to its normal part, in place. Phi is followed over a length that shows above its rounding. */
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

/* dV at t_n. U1, A1, gamma and work serve as work space; the correction has not begun. */
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

/* A consistent start has no drift where the method wants -k h^2 (q''')_normal: the first step would make it good by an
   oscillation of the multipliers, which at little damping takes many steps to die out. With the matrix of the start. */
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

/* For a step of length I.h after one of h_last */
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
