/*
  The state at a time within the last step, with accelerations and multipliers as accurate as the positions there.

  Between the ends of a step q, q' and s come from Hermite polynomials (dense.cpp). Linear interpolation of q'', lambda, V and F
  misses them by h^2/8 times their second derivatives, which in a long step may be as large as they are. So they are solved for at
  the interpolated (q, q', s, t), by the equations of the consistent start:

    M q'' + Phi_q^T lambda = Q,    Phi_q q'' + (Phi_q q')_q q' + 2 Phi_qt q' + Phi_tt = 0,    s', V and F by their own rows

  At the ends of the step the values of the step itself are returned. These satisfy the differentiated constraints to O(h^2) only, so
  that the two differ by the error of the step.

  The matrix is the one of the start, [M Phi_q^T; Phi_q 0], in a Mat and a KSP of its own: a run with samples goes on bit for bit
  like one without. Residuals and matrices of samples are not counted in the statistics; -log_view shows them as HHT3Sample.
*/
#include "impl.h"

namespace hht3
{

struct Sampler {
  Mat          P   = nullptr;
  KSP          ksp = nullptr;
  Vec          U = nullptr, V = nullptr, A = nullptr; /* at the time of the sample */
  Vec          X = nullptr;                           /* the unknowns */
  Vec          gamma = nullptr;                       /* right-hand side of the differentiated constraints; null: none */
  Vec          F = nullptr, d = nullptr;
  LinearChoice linear;
  PetscBool    chosen = PETSC_FALSE;
  PetscReal    t1     = PETSC_NINFINITY; /* end of the step of the last sample */
};

namespace
{

/* Corrections relative to the unknowns: converged; and the largest that may be rounding where they no longer fall */
constexpr PetscReal converged = 1e-13, rounding = 1e-8;
constexpr PetscReal slow      = 0.3; /* rate beyond which the matrix is made again at the iterate */
constexpr PetscInt  max_it    = 20;

/* Points of Phi from which its derivatives in time are taken, over the step: errors of third order and more, far below those of the
   method. Over less than this part of the motion's time scale rounding of Phi would show (5e-14 |q| over the length squared). */
constexpr int       points   = 5;
constexpr PetscReal shortest = 1e-4;

/* The step of the matrix over that of the run: what stiffness and damping leave in [M Phi_q^T; Phi_q 0] is rounding up to
   h omega = 1e6, and slows the iteration beyond */
constexpr PetscReal part = 1e-10;

/* In which of U, U', U'' the unknown of a role is */
int PlaceOf(TSHHT3Role r) { return r == TSHHT3_COORDINATE ? 2 : r == TSHHT3_STATE ? 1 : 0; }

bool IsConstraint(const Integrator &I, PetscInt i)
{
  const TSHHT3Role r = RoleOf(I, i);
  return r == TSHHT3_HOLONOMIC || r == TSHHT3_NONHOLONOMIC;
}

/* The KSP takes what the user has set for the run's, by options or by program. A shell cannot be had twice. */
PetscErrorCode CreateSolver(TS ts, Sampler &S)
{
  const Integrator &I = Get(ts);
  KSP               run;
  PC                from, to;
  KSPType           type;
  PCType            pctype;
  MatSolverType     package;
  PetscBool         shell;
  const char       *prefix;
  PetscReal         rtol, atol, dtol;
  PetscInt          its;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &run));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)ts), &S.ksp));
  PetscCall(PetscObjectSetOptions((PetscObject)S.ksp, ((PetscObject)run)->options));
  PetscCall(KSPGetOptionsPrefix(run, &prefix));
  PetscCall(KSPSetOptionsPrefix(S.ksp, prefix));
  PetscCall(KSPGetType(run, &type));
  if (type) PetscCall(KSPSetType(S.ksp, type));
  PetscCall(KSPGetTolerances(run, &rtol, &atol, &dtol, &its));
  PetscCall(KSPSetTolerances(S.ksp, rtol, atol, dtol, its));
  PetscCall(KSPSetOperators(S.ksp, S.P, S.P));
  PetscCall(KSPGetPC(run, &from));
  PetscCall(KSPGetPC(S.ksp, &to));
  PetscCall(PCGetType(from, &pctype));
  PetscCall(PetscObjectTypeCompare((PetscObject)from, PCSHELL, &shell));
  if (I.linear.user_pc && pctype && !shell) {
    PetscCall(PCSetType(to, pctype));
    if (I.linear.user_package) {
      PetscCall(PCFactorGetMatSolverType(from, &package));
      if (package) PetscCall(PCFactorSetMatSolverType(to, package));
    }
  }
  PetscCall(LinearDefaults(S.ksp, &S.linear));
  PetscCall(KSPSetFromOptions(S.ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *S: null where the run's matrix is no assembled one */
PetscErrorCode GetSampler(TS ts, Sampler **S)
{
  Integrator &I = Get(ts);
  Mat         P;
  PetscBool   shell;

  PetscFunctionBegin;
  *S = I.sampler;
  if (*S) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)P, &shell, MATMFFD, MATSHELL, ""));
  if (shell) PetscFunctionReturn(PETSC_SUCCESS);
  *S = I.sampler = new Sampler;
  PetscCall(MatDuplicate(P, MAT_DO_NOT_COPY_VALUES, &I.sampler->P));
  for (Vec *v : {&I.sampler->U, &I.sampler->V, &I.sampler->A, &I.sampler->X, &I.sampler->F, &I.sampler->d}) PetscCall(VecDuplicate(I.U0, v));
  if (I.constraints()) PetscCall(VecDuplicate(I.U0, &I.sampler->gamma));
  PetscCall(CreateSolver(ts, *I.sampler));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weights of values at z_k for the first and second derivative at 0 of the polynomial through them (Fornberg 1988) */
void DerivativeWeights(const PetscReal z[points], PetscReal weight[points][3])
{
  PetscReal c1 = 1, c4 = z[0];
  for (int k = 0; k < points; k++)
    for (int m = 0; m < 3; m++) weight[k][m] = k == 0 && m == 0;
  for (int i = 1; i < points; i++) {
    const PetscReal c5 = c4;
    PetscReal       c2 = 1;
    c4                 = z[i];
    for (int j = 0; j < i; j++) {
      const PetscReal c3 = z[i] - z[j];
      c2 *= c3;
      if (j == i - 1)
        for (int m = 2; m >= 0; m--) weight[i][m] = c1 * ((m ? m * weight[i - 1][m - 1] : 0) - c5 * weight[i - 1][m]) / c2;
      for (int m = 2; m >= 0; m--) weight[j][m] = (c4 * weight[j][m] - (m ? m * weight[j][m - 1] : 0)) / c3;
    }
    c1 = c2;
  }
}

/* gamma: second derivatives of Phi and first ones of Psi in time along U + (t_k - t) V, from t_k within the step where it is long
   enough: what happens before or after it is not seen */
PetscErrorCode ConstraintTerms(TS ts, Sampler &S, PetscReal t)
{
  Integrator        &I = Get(ts);
  PetscReal          T, z[points], weight[points][3];
  const PetscScalar *f;
  PetscScalar       *g;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(TimeScale(ts, &T));
  const bool      wide   = I.h < shortest * T;
  const PetscReal length = wide ? shortest * T : I.h, begin = wide ? -length / 2 : I.t0 - t;
  for (int k = 0; k < points; k++) z[k] = begin + length * k / (points - 1);
  DerivativeWeights(z, weight);
  PetscCall(VecGetLocalSize(S.U, &n));
  PetscCall(VecZeroEntries(S.gamma));
  for (int k = 0; k < points; k++) {
    PetscCall(VecWAXPY(S.d, z[k], S.V, S.U));
    PetscCall(EvaluateResidual(ts, t + z[k], S.d, S.V, S.A, S.F));
    PetscCall(VecGetArrayRead(S.F, &f));
    PetscCall(VecGetArray(S.gamma, &g));
    for (PetscInt i = 0; i < n; i++)
      if (IsConstraint(I, i)) g[i] += weight[k][I.role[i] == TSHHT3_HOLONOMIC ? 2 : 1] * f[i];
    PetscCall(VecRestoreArray(S.gamma, &g));
    PetscCall(VecRestoreArrayRead(S.F, &f));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X from U, V, A as they were interpolated: the first guess */
PetscErrorCode Collect(const Integrator &I, Sampler &S)
{
  const PetscScalar *y[3];
  PetscScalar       *x;
  Vec                from[3] = {S.U, S.V, S.A};
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(S.X, &n));
  for (int k = 0; k < 3; k++) PetscCall(VecGetArrayRead(from[k], &y[k]));
  PetscCall(VecGetArrayWrite(S.X, &x));
  for (PetscInt i = 0; i < n; i++) x[i] = y[PlaceOf(RoleOf(I, i))][i];
  PetscCall(VecRestoreArrayWrite(S.X, &x));
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArrayRead(from[k], &y[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U, V, A take the unknowns X */
PetscErrorCode Spread(const Integrator &I, Sampler &S)
{
  const PetscScalar *x;
  PetscScalar       *y[3];
  Vec                to[3] = {S.U, S.V, S.A};
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(S.X, &n));
  PetscCall(VecGetArrayRead(S.X, &x));
  for (int k = 0; k < 3; k++) PetscCall(VecGetArray(to[k], &y[k]));
  for (PetscInt i = 0; i < n; i++) y[PlaceOf(RoleOf(I, i))][i] = x[i];
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArray(to[k], &y[k]));
  PetscCall(VecRestoreArrayRead(S.X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Packages keep pivots from one matrix to the next. In a new step the factors are made from nothing, so that samples do not depend
   on those of earlier steps: a resumed run gives the same to the last bit. */
PetscErrorCode ForgetEarlierSteps(const Integrator &I, Sampler &S)
{
  PetscFunctionBegin;
  if (S.t1 != I.t1) PetscCall(KSPReset(S.ksp));
  S.t1 = I.t1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix at U, V, A and its factors; *why: if not *ok. The mode is the start's for the scaling alone. */
PetscErrorCode MakeMatrix(TS ts, Sampler &S, PetscReal t, PetscBool *ok, const char **why)
{
  Integrator      &I = Get(ts);
  const PetscReal  h = I.h, small = part * h;
  PetscObjectState before, after;
  PetscBool        symmetric;

  PetscFunctionBegin;
  *ok = PETSC_FALSE;
  PetscCall(PetscObjectStateGet((PetscObject)S.P, &before));
  PetscCall(EvaluateJacobian(ts, t, S.U, S.V, S.A, 1 / small, 1 / (small * small), S.P, S.P));
  PetscCall(PetscObjectStateGet((PetscObject)S.P, &after));
  *why = "the application fills no matrix but its own";
  if (before == after) PetscFunctionReturn(PETSC_SUCCESS);
  I.mode = Mode::Start;
  I.h    = small;
  PetscCall(ScaleMatrix(I, S.P));
  I.mode = Mode::Step;
  I.h    = h;
  PetscCall(MatrixHasNumbers(S.P, ok));
  *why = "the Jacobian is not a number";
  if (!*ok) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPSetOperators(S.ksp, S.P, S.P));
  if (!S.chosen || S.linear.cholesky) {
    PetscCall(LinearIsSymmetric(S.P, &symmetric));
    if (!S.chosen || !symmetric) PetscCall(LinearChoose(S.ksp, S.P, symmetric, &S.linear));
    S.chosen = PETSC_TRUE;
  }
  PetscCall(KSPSetUp(S.ksp)); /* a factorization that failed shows in the solve */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of constraints of F: Phi_q q'' + gamma */
PetscErrorCode ConstraintRows(const Integrator &I, Sampler &S)
{
  const PetscScalar *p, *g;
  PetscScalar       *f;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecCopy(S.X, S.d));
  PetscCall(VecGetLocalSize(S.d, &n));
  PetscCall(VecGetArray(S.d, &f));
  for (PetscInt i = 0; i < n; i++)
    if (RoleOf(I, i) != TSHHT3_COORDINATE) f[i] = 0;
  PetscCall(VecRestoreArray(S.d, &f));
  PetscCall(MatMult(S.P, S.d, I.work));
  PetscCall(VecGetArrayRead(I.work, &p));
  PetscCall(VecGetArrayRead(S.gamma, &g));
  PetscCall(VecGetArray(S.F, &f));
  for (PetscInt i = 0; i < n; i++)
    if (IsConstraint(I, i)) f[i] = p[i] + g[i];
  PetscCall(VecRestoreArray(S.F, &f));
  PetscCall(VecRestoreArrayRead(S.gamma, &g));
  PetscCall(VecRestoreArrayRead(I.work, &p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One correction of X; its size relative to X, infinity on all ranks if the solve failed on any */
PetscErrorCode CorrectSample(TS ts, Sampler &S, PetscReal t, PetscReal *e)
{
  Integrator        &I = Get(ts);
  KSPConvergedReason reason;
  PetscReal          d, x;
  PetscMPIInt        failed;

  PetscFunctionBegin;
  PetscCall(EvaluateResidual(ts, t, S.U, S.V, S.A, S.F));
  if (S.gamma) PetscCall(ConstraintRows(I, S));
  PetscCall(KSPSolve(S.ksp, S.F, S.d));
  PetscCall(KSPGetConvergedReason(S.ksp, &reason));
  failed = reason < 0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)ts)));
  PetscCall(VecAXPY(S.X, -1, S.d));
  PetscCall(VecNorm(S.d, NORM_2, &d));
  PetscCall(VecNorm(S.X, NORM_2, &x));
  PetscCall(Spread(I, S));
  *e = failed ? PETSC_INFINITY : x > 0 ? d / x : d;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X, and with it U, V, A; *why: what was in the way if not *ok */
PetscErrorCode SolveSample(TS ts, Sampler &S, PetscReal t, PetscBool *ok, const char **why)
{
  PetscReal e = 0, last;
  PetscBool renew = PETSC_TRUE, fresh = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(Collect(Get(ts), S));
  if (S.gamma) PetscCall(ConstraintTerms(ts, S, t));
  for (PetscInt it = 0; it < max_it; it++) {
    if (renew) PetscCall(MakeMatrix(ts, S, t, ok, why));
    if (renew && !*ok) PetscFunctionReturn(PETSC_SUCCESS);
    fresh = renew;
    renew = PETSC_FALSE;
    last  = e;
    *ok   = PETSC_FALSE;
    *why  = "the matrix is singular there, or the solver failed";
    PetscCall(CorrectSample(ts, S, t, &e));
    if (PetscIsInfOrNanReal(e)) PetscFunctionReturn(PETSC_SUCCESS);
    *ok = (PetscBool)(e <= converged || (!fresh && e <= rounding && e > slow * last) || (!fresh && CorrectorError(e / last, e) <= converged));
    if (*ok) PetscFunctionReturn(PETSC_SUCCESS);
    renew = (PetscBool)(it > 0 && e > slow * last);
  }
  *why = "the iteration does not converge";
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SampleInside(TS ts, Sampler &S, PetscReal t, PetscBool *ok)
{
  Integrator            &I     = Get(ts);
  const TSHHT3Statistics saved = I.stat;
  const char            *why;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.sample, ts, 0, 0, 0));
  PetscCall(SolveSample(ts, S, t, ok, &why));
  I.stat = saved;
  if (!*ok) S.t1 = PETSC_NINFINITY; /* a factor that failed may keep its error */
  if (!*ok) PetscCall(PetscInfo(ts, "sample at t = %g: %s; accelerations and multipliers by linear interpolation\n", (double)t, why));
  PetscCall(PetscLogEventEnd(events.sample, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Any of U, V, A may be NULL. t lies between the ends of the last accepted step. */
PetscErrorCode EvaluateAt(TS ts, PetscReal t, Vec U, Vec V, Vec A)
{
  Integrator &I  = Get(ts);
  PetscBool   ok = PETSC_FALSE;
  Sampler    *S  = NULL;

  PetscFunctionBegin;
  PetscCheck(I.have_step, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE, "There is no step to interpolate in: none was accepted since the start, the last restart or roll-back");
  const PetscReal x = StepFraction(I, t);
  if (x > 0 && x < 1) PetscCall(GetSampler(ts, &S));
  if (S) {
    PetscCall(ForgetEarlierSteps(I, *S));
    PetscCall(Interpolate(ts, t, S->U, S->V, S->A));
    PetscCall(SampleInside(ts, *S, t, &ok));
  }
  if (ok) {
    if (U) PetscCall(VecCopy(S->U, U));
    if (V) PetscCall(VecCopy(S->V, V));
    if (A) PetscCall(VecCopy(S->A, A));
  } else PetscCall(Interpolate(ts, t, U, V, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SamplerDestroy(Integrator &I)
{
  PetscFunctionBegin;
  if (!I.sampler) PetscFunctionReturn(PETSC_SUCCESS);
  Sampler &S = *I.sampler;
  PetscCall(MatDestroy(&S.P));
  PetscCall(KSPDestroy(&S.ksp));
  for (Vec *v : {&S.U, &S.V, &S.A, &S.X, &S.gamma, &S.F, &S.d}) PetscCall(VecDestroy(v));
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
  solver is the one chosen for the run, by the same options.

  At both ends of the step, the values of the step itself are returned, to the last bit. The run is not changed, and nothing is
  added to its counters; -log_view shows the samples as HHT3Sample.

  Where the equations cannot be solved (a singular position, a Jacobian without an assembled matrix), accelerations and multipliers
  are interpolated linearly, and -info says so.

.seealso: `TSHHT3`, `TSHHT3Interpolate()`, `TSHHT3GetAcceleration()`
@*/
PetscErrorCode TSHHT3EvaluateAt(TS ts, PetscReal t, Vec U, Vec V, Vec A)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscUseMethod(ts, "TSHHT3EvaluateAt_C", (TS, PetscReal, Vec, Vec, Vec), (ts, t, U, V, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}
