/*
  The state at a time within the last step, with accelerations and multipliers as accurate as the positions there.

  Between the ends of a step q, q' and s come from Hermite polynomials (dense.cpp). Linear interpolation of q'', lambda, V and F
  misses them by h^2/8 times their second derivatives, which in a long step may be as large as they are. So they are solved for at
  the interpolated (q, q', s, t), see consistent.cpp.

  At the ends of the step the values of the step itself are returned. These satisfy the differentiated constraints to O(h^2) only, so
  that the two differ by the error of the step.

  The matrix and the KSP are of their own: a run with samples goes on bit for bit like one without. What the solver takes over from one sample to the next
  (order, pivots) makes most of a sample's cost where it is made anew; checkpoints have it, so that samples of a resumed run are those of the whole one.
  Residuals and matrices of samples are not counted in the statistics; -log_view shows them as HHT3Sample.
*/
#include "consistent.h"
#include "integrator/step/dense.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "integrator/equations/roles.h"
#include "integrator/coordinates/rotations.h"
#include "integrator/equations/solver.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* Points of Phi from which its derivatives in time are taken, over the step: errors of third order and more, far below those of the
   method. Over less than this part of the motion's time scale rounding of Phi would show (5e-14 |q| over the length squared). */
constexpr int       time_points   = 5;
constexpr PetscReal shortest_span = 1e-4;

/* A part of the step within which t is one of its ends: sums of steps and multiples of an interval differ by their rounding (EvaluateAt.OnAGridOfSteps) */
constexpr PetscReal end_fraction = 1e-8;

/* With the options of the run's KSP. What the program has set there is not taken over: preconditioners of functions or parts cannot be had twice, those that options name are
   replaced by a factor. */
PetscErrorCode CreateSolver(TS ts, Sampler &S)
{
  KSP         run;
  PC          pc;
  PetscBool   parts;
  const char *prefix;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &run));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)ts), &S.at.ksp));
  PetscCall(PetscObjectSetOptions((PetscObject)S.at.ksp, ((PetscObject)run)->options));
  PetscCall(KSPGetOptionsPrefix(run, &prefix));
  PetscCall(KSPSetOptionsPrefix(S.at.ksp, prefix));
  PetscCall(KSPSetOperators(S.at.ksp, S.at.P, S.at.P));
  PetscCall(LinearDefaults(S.at.ksp, &S.linear));
  PetscCall(KSPSetFromOptions(S.at.ksp));
  PetscCall(KSPGetPC(S.at.ksp, &pc));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &parts, PCSHELL, PCFIELDSPLIT, PCCOMPOSITE, ""));
  if (parts) {
    PetscCall(PCSetType(pc, PCLU));
    S.linear.user_pc = S.linear.user_package = PETSC_FALSE;
  }
  S.linear.may_be_rough = Get(ts).linear.iterative; /* where the run has no factor its samples make none */
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* *S: null where the run's matrix is no assembled one, or where the application has a product beside it: that one belongs to the run, and whoever looks into it would not find it in another matrix */
PetscErrorCode GetSampler(TS ts, Sampler **S)
{
  Integrator &I = Get(ts);
  Mat         J, P;
  PetscBool   shell, product;

  PetscFunctionBegin;
  *S = I.sampler;
  if (*S) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetJacobian(ts->snes, &J, &P, NULL, NULL));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)P, &shell, MATMFFD, MATSHELL, ""));
  PetscCall(PetscObjectTypeCompare((PetscObject)J, MATSHELL, &product));
  if (shell || product) PetscFunctionReturn(PETSC_SUCCESS);
  *S = I.sampler = new Sampler;
  Consistent &c = I.sampler->at;
  PetscCall(MatDuplicate(P, MAT_DO_NOT_COPY_VALUES, &c.P));
  PetscCall(CopyNodes(P, c.P));
  for (Vec *v : {&c.U, &c.V, &c.A, &c.X, &c.F, &c.d}) PetscCall(VecDuplicate(I.U0, v));
  if (I.constraints()) PetscCall(VecDuplicate(I.U0, &c.gamma));
  c.linear = &I.sampler->linear;
  PetscCall(CreateSolver(ts, *I.sampler));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{

/* Weights of values at z_k for the value at 0 of the polynomial through them, and for its first and second derivative */
void DerivativeWeights(const PetscReal z[time_points], PetscReal weight[time_points][3])
{
  for (int k = 0; k < time_points; k++) {
    PetscReal *w = weight[k];
    w[0] = 1;
    w[1] = w[2] = 0;
    for (int i = 0; i < time_points; i++) { /* times (x - z_i)/(z_k - z_i) */
      if (i == k) continue;
      const PetscReal slope = 1 / (z[k] - z[i]), value = -z[i] * slope;
      w[2] = value * w[2] + 2 * slope * w[1];
      w[1] = value * w[1] + slope * w[0];
      w[0] *= value;
    }
  }
}

/* gamma: second derivatives of Phi and first ones of Psi in time along U + (t_k - t) V, from t_k within the step where it is long
   enough: what happens before or after it is not seen */
PetscErrorCode ConstraintTerms(TS ts, Consistent &c)
{
  Integrator &I = Get(ts);
  PetscReal   T, z[time_points], weight[time_points][3];

  PetscFunctionBegin;
  PetscCall(TimeScale(ts, &T));
  const PetscReal apart = SpanFrom(I.t0, PetscMax(I.h, shortest_span * T) / (time_points - 1));
  for (int k = 0; k < time_points; k++) z[k] = I.t0 - c.t + k * apart;
  DerivativeWeights(z, weight);
  PetscCall(VecZeroEntries(c.gamma));
  for (int k = 0; k < time_points; k++) {
    PetscCall(VecWAXPY(c.d, z[k], c.V, c.U));
    PetscCall(ResidualAlong(ts, c.t + z[k], c.d, c.V, c.A, c.F));
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar f, PetscScalar &g) {
        if (IsConstraint(I, i)) g += weight[k][I.role[i] == TSHHT3_HOLONOMIC ? 2 : 1] * f;
      },
      Read(c.F), Write(c.gamma)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the sampler's U, V, A, which are the first guess; derivatives() makes gamma. The run is not changed, also not where the application ends it with an error, after which it may go on. */
template <class Derivatives>
PetscErrorCode SolveSample(TS ts, Sampler &S, Derivatives derivatives, PetscBool *ok, const char **why)
{
  Integrator            &I     = Get(ts);
  const TSHHT3Statistics saved = I.stat;
  WorkVec                before;

  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar u, PetscScalar v, PetscScalar a, PetscScalar &x) { x = UnknownOf(RoleOf(I, i), u, v, a); },
    Read(S.at.U), Read(S.at.V), Read(S.at.A), Write(S.at.X)));
  PetscCall(ReferTo(ts, S.at.U, before));
  PetscErrorCode failed = S.at.gamma ? derivatives() : PETSC_SUCCESS;
  if (!failed) failed = SolveConsistent(ts, S.at, false, ok, why);
  PetscCall(ReferBack(ts, S.at.U, before));
  I.stat = saved;
  PetscCall(failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Between the ends of the step */
PetscErrorCode SampleInside(TS ts, Sampler &S, PetscReal t, PetscBool *ok)
{
  const char *why;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.sample, ts, 0, 0, 0));
  S.at.t    = t;
  S.at.tiny = vanishing_step * Get(ts).h;
  S.at.T    = 0;
  PetscCall(SolveSample(ts, S, [&] { return ConstraintTerms(ts, S.at); }, ok, &why));
  if (!*ok) PetscCall(PetscInfo(ts, "sample at t = %g: %s; accelerations and multipliers by linear interpolation\n", (double)t, why));
  PetscCall(PetscLogEventEnd(events.sample, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode EvaluateAt(TS ts, PetscReal t, Vec U, Vec V, Vec A)
{
  Integrator &I  = Get(ts);
  PetscBool   ok = PETSC_FALSE;
  Sampler    *S  = NULL;

  PetscFunctionBegin;
  const PetscReal x = StepFraction(I, t);
  if (I.have_step && x > end_fraction && x < 1 - end_fraction) PetscCall(GetSampler(ts, &S));
  if (S) {
    PetscCall(Interpolate(ts, t, S->at.U, S->at.V, S->at.A));
    PetscCall(SampleInside(ts, *S, t, &ok));
  }
  if (ok) {
    if (U) PetscCall(VecCopy(S->at.U, U));
    if (V) PetscCall(VecCopy(S->at.V, V));
    if (A) PetscCall(VecCopy(S->at.A, A));
  } else PetscCall(Interpolate(ts, t, U, V, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{

/* Whether positions, velocities or states are others than those of the last step at this time */
PetscErrorCode SolutionWasSet(TS ts, bool *set)
{
  Integrator &I     = Get(ts);
  bool        other = false;
  WorkVec     U, V;

  PetscFunctionBegin;
  PetscCall(U.like(I.U0));
  PetscCall(V.like(I.U0));
  PetscCall(Interpolate(ts, ts->ptime, U, V, NULL));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar u, PetscScalar v, PetscScalar x, PetscScalar y) {
      if (IsDifferential(RoleOf(I, i)) && u != x) other = true;
      if (IsCoordinate(I, i) && v != y) other = true;
    },
    Read(ts->vec_sol), Read(ts->vec_dot), Read(U), Read(V)));
  PetscCall(OnAnyRank(ts, other, set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the present time, as a start from there would find them */
PetscErrorCode SolveAsStart(TS ts, Sampler &S, PetscBool *ok, const char **why)
{
  const Integrator &I = Get(ts);
  PetscReal         T;
  Levels            levels;

  PetscFunctionBegin;
  PetscCall(TimeScaleOfConstraints(ts, S.at.V, &T));
  S.at.t      = ts->ptime;
  S.at.tiny   = vanishing_step * PetscMin(T, 1);
  S.at.T      = I.constraints() && I.count[TSHHT3_STATE] ? T : 0;
  S.at.levels = &levels;
  PetscCall(SolveSample(ts, S, [&] { return ConstraintDerivatives(ts, S.at.t, S.at.U, S.at.V, T, &levels, NULL, S.at.gamma); }, ok, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode EvaluatePresent(TS ts, PetscBool changed, Vec U, Vec V, Vec A, PetscBool *done)
{
  Integrator     &I      = Get(ts);
  const PetscReal t      = ts->ptime;
  const bool      begin  = IsBeginOfStep(ts, t);
  const bool      within = begin || (I.have_step && t >= I.t0 && t <= I.t1);
  Sampler        *S      = NULL;
  PetscBool       ok     = PETSC_FALSE;
  bool            set    = false;
  const char     *why    = "";

  PetscFunctionBegin;
  *done = PETSC_FALSE;
  if (!I.have_step && !I.at_begin) PetscFunctionReturn(PETSC_SUCCESS);
  if (within) PetscCall(SolutionWasSet(ts, &set));
  const bool other = changed || set || !within, due = ts->steprestart && ts->reason >= 0; /* after a failed step one is due, but nothing is new */
  if (!other && !due) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetSampler(ts, &S));
  if (!S) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecCopy(ts->vec_sol, S->at.U));
  PetscCall(TakeRoles(I, ts->vec_dot, {TSHHT3_COORDINATE, TSHHT3_STATE}, S->at.V));
  PetscCall(VecCopy(begin ? I.A0 : I.A1, S->at.A));
  PetscCall(SolveAsStart(ts, *S, &ok, &why));
  PetscCheck(ok || !other, PetscObjectComm((PetscObject)ts), PETSC_ERR_NOT_CONVERGED,
             "The solution, or what forces depend on, was changed since the last step, and no consistent accelerations and multipliers were found at t = %g: %s", (double)t, why);
  if (!ok) PetscCall(PetscInfo(ts, "state at t = %g, where a restart is due: %s; accelerations and multipliers are those of the last step\n", (double)t, why));
  if (!ok) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecCopy(S->at.U, U));
  PetscCall(VecCopy(S->at.V, V));
  PetscCall(VecCopy(S->at.A, A));
  *done = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SamplerDestroy(Integrator &I)
{
  PetscFunctionBegin;
  if (!I.sampler) PetscFunctionReturn(PETSC_SUCCESS);
  Sampler &S = *I.sampler;
  PetscCall(MatDestroy(&S.at.P));
  PetscCall(KSPDestroy(&S.at.ksp));
  for (Vec *v : {&S.at.U, &S.at.V, &S.at.A, &S.at.X, &S.at.gamma, &S.at.F, &S.at.d}) PetscCall(VecDestroy(v));
  delete I.sampler;
  I.sampler = nullptr;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@
  TSHHT3EvaluateAt - State at a time within the last accepted step, with accelerations and multipliers that satisfy the equations
  of motion there

  Collective

  Input Parameters:
+ ts - the `TS` context
- t  - a time between the ends of the last step

  Output Parameters:
+ U - coordinates and states as by `TSHHT3Interpolate()`; multipliers, variables and force states from the equations, or `NULL`
. V - velocities as by `TSHHT3Interpolate()`; derivatives of states from the equations, or `NULL`
- A - accelerations from the equations, or `NULL`

  Level: intermediate

  Notes:
  Between the ends it solves for accelerations, derivatives of states, multipliers, variables and force states at the interpolated
  positions and velocities: one Jacobian, one factorization and
  two residuals as a rule, five more with constraints, where `TSHHT3Interpolate()` costs none.
  They are then as accurate as the positions, in long steps, too. Its matrix and factors are made at the first call and kept. The
  solver is chosen as for the run, by the same options; what the program has set in the `KSP` of the run is the run's alone.

  At both ends of the step, and within 1e-8 of its length beside them, the values of the step itself are returned, at the ends to the last bit. The run is not changed, and nothing is
  added to its counters; -log_view shows the samples as HHT3Sample. Where a step was rolled back, or ended by an error, only the
  state that it began with is known, at the present time.

  Where the equations cannot be solved (a singular position, a Jacobian without an assembled matrix, or with a `MATSHELL` of the application's
  as its operator), accelerations and multipliers are those of `TSHHT3Interpolate()`, linear in a step of order two, and -info says so.

.seealso: `TSHHT3`, `TSHHT3Interpolate()`, `TSHHT3GetAcceleration()`
@*/
PetscErrorCode TSHHT3EvaluateAt(TS ts, PetscReal t, Vec U, Vec V, Vec A)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscUseMethod(ts, "TSHHT3EvaluateAt_C", (TS, PetscReal, Vec, Vec, Vec), (ts, t, U, V, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}
