/*
  The discretized equations (9) and their matrix (10).

  Unknowns X: algorithmic accelerations a (coordinates), derivatives w (states), and lambda, V, F themselves. With

    q_{n+1} = (2a),  q'_{n+1} = (2b),  q''_{n+1} = ca a + (average with t_n)

  the application's F(t,U,U',U'') gives the residual row by row:

    motion          F                                    second-order form
                    F(.., q''=ca a) - alpha/(1+alpha) f_n  paper form, (9a)
    Phi             F / (beta h^2)                       (9b)
    Psi             F / (gamma h)
    states, V, F    F                                    (9c), (9d)

  and its Jacobian, D_r J(sigma_v, sigma_a) D_c, is the matrix (10) with the same row factors in D_r and the derivative of U
  by X in D_c. Nothing is divided by h: for h -> 0 it tends to [M Phi_q^T; Phi_q 0].
*/
#include "impl.h"

namespace hht3
{

namespace
{

/* Shifts of the application's Jacobian and diagonal scalings that make it the Newton matrix */
struct Scales {
  PetscReal sv, sa;             /* d U'/dU, d U''/dU */
  PetscReal coordinate, state;  /* columns */
  PetscReal holonomic, velocity; /* rows */
};

Scales CurrentScales(const Integrator &I)
{
  const PetscReal h = I.h;
  if (I.mode == Mode::Start) return {1 / h, 1 / (h * h), h * h, h, 1 / (h * h), 1 / h};
  const Parameters &p = I.p;
  return {ShiftV(p, h),       ShiftA(p, h), ScalePosition(p, h), ScaleState(p, h), 1 / ScalePosition(p, h),
          1 / ScaleVelocity(p, h)};
}

/* U1, V1, A1 in the start: q, q', s are given; a, s', lambda, V, F are the unknowns */
void StartStage(const Integrator &I, PetscInt n, const PetscScalar *x, PetscScalar *u, PetscScalar *v, PetscScalar *a)
{
  for (PetscInt i = 0; i < n; i++) {
    switch (RoleOf(I, i)) {
    case TSHHT3_COORDINATE: a[i] = x[i]; break;
    case TSHHT3_STATE: v[i] = x[i]; break;
    default: u[i] = x[i]; break;
    }
  }
}

struct Ends { /* of the step, read-only */
  const PetscScalar *u0, *v0, *a0, *x0, *dv = nullptr, *bend = nullptr;
};

/* The parts of U1, V1, A1 that do not depend on X, from (2) and from the average that the form asks for. a_n and w_n were made
   by a step of length h_last; their lag behind the true values is stretched to the present h, without which a change of h
   costs an order (Bruels, Arnold 2008). In the paper's form a_n is itself what counts as the true value, so that nothing
   changes. */
void StepBase(const Integrator &I, PetscInt n, const Ends &e, PetscScalar *u, PetscScalar *v, PetscScalar *a)
{
  const Parameters &p = I.p;
  const PetscReal   h = I.h, r = I.h_last > 0 ? h / I.h_last : 1;
  const bool        paper = I.form == TSHHT3_FORM_PAPER;
  const PetscReal   bent = I.p.bend() * h * h;
  const PetscReal   cn = paper ? 0 : p.am / (1 - p.af), c0 = paper ? 0 : p.af / (1 - p.af);
  for (PetscInt i = 0; i < n; i++) {
    const TSHHT3Role role = RoleOf(I, i);
    if (role == TSHHT3_COORDINATE) {
      const PetscScalar an = e.a0[i] + r * (e.x0[i] - e.a0[i]);
      PetscScalar       v0 = e.dv ? e.v0[i] - I.misfit * e.dv[i] : e.v0[i];
      if (e.bend) v0 -= bent * e.bend[i];
      u[i]                 = NewmarkPosition(p, h, e.u0[i], v0, an, 0);
      v[i]                 = NewmarkVelocity(p, h, v0, an, 0);
      a[i]                 = cn * an - c0 * e.a0[i];
    } else if (role == TSHHT3_STATE) {
      const PetscScalar wn = e.v0[i] + r * (e.x0[i] - e.v0[i]);
      u[i]                 = e.u0[i] + h * (1 - p.gamma_s) * wn;
      v[i]                 = (p.am_s * wn - p.af_s * e.v0[i]) / (1 - p.af_s);
      a[i]                 = 0;
    } else u[i] = v[i] = a[i] = 0;
  }
}

/* y = base + slope x, entry by entry or with one slope for all */
void Line(PetscInt n, const PetscScalar *PETSC_RESTRICT base, const PetscScalar *PETSC_RESTRICT slope, PetscReal one, const PetscScalar *PETSC_RESTRICT x, PetscScalar *PETSC_RESTRICT y)
{
  if (slope)
    for (PetscInt i = 0; i < n; i++) y[i] = base[i] + slope[i] * x[i];
  else
    for (PetscInt i = 0; i < n; i++) y[i] = base[i] + one * x[i];
}

/* (9a): what the average takes from t_n. f_n is evaluated once per step, at the end of the last one */
PetscErrorCode AddOldForces(const Integrator &I, Vec F)
{
  const PetscReal    w = -I.alpha / (1 + I.alpha);
  const PetscScalar *f0;
  PetscScalar       *f;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(F, &n));
  PetscCall(VecGetArrayRead(I.F0, &f0));
  PetscCall(VecGetArray(F, &f));
  for (PetscInt i = 0; i < n; i++)
    if (RoleOf(I, i) == TSHHT3_COORDINATE) f[i] += w * f0[i];
  PetscCall(VecRestoreArray(F, &f));
  PetscCall(VecRestoreArrayRead(I.F0, &f0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Definitions of V and F that use q'' need the true one, where (9a) evaluates at q''/(1+alpha): a second evaluation, made
   only for problems that have such definitions */
PetscErrorCode TrueAccelerationRows(TS ts, Vec X, Vec F)
{
  Integrator        &I = Get(ts);
  const PetscScalar *g;
  PetscScalar       *f;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, X, I.work));
  PetscCall(VecGetLocalSize(F, &n));
  PetscCall(VecGetArrayRead(I.work, &g));
  PetscCall(VecGetArray(F, &f));
  for (PetscInt i = 0; i < n; i++)
    if (RoleOf(I, i) != TSHHT3_COORDINATE) f[i] = g[i];
  PetscCall(VecRestoreArray(F, &f));
  PetscCall(VecRestoreArrayRead(I.work, &g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (6b), (6c): in the start the constraint rows read Phi_q q'' + gamma = 0; the matrix holds Phi_q */
PetscErrorCode AccelerationConstraintRows(TS ts, Vec X, Vec F)
{
  Integrator        &I = Get(ts);
  const PetscScalar *g, *c;
  PetscScalar       *f;
  PetscInt           n;
  Mat                P;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(MatMult(P, X, I.work));
  PetscCall(VecGetLocalSize(F, &n));
  PetscCall(VecGetArrayRead(I.work, &g));
  PetscCall(VecGetArrayRead(I.gamma, &c));
  PetscCall(VecGetArray(F, &f));
  for (PetscInt i = 0; i < n; i++)
    if (I.role[i] == TSHHT3_HOLONOMIC || I.role[i] == TSHHT3_NONHOLONOMIC) f[i] = g[i] + c[i];
  PetscCall(VecRestoreArray(F, &f));
  PetscCall(VecRestoreArrayRead(I.gamma, &c));
  PetscCall(VecRestoreArrayRead(I.work, &g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D_r, D_c = dU/dX and, in a step, dU'/dX and dU''/dX. Kept while h and the mode stay. */
PetscErrorCode FillScalings(Integrator &I)
{
  const Scales      s     = CurrentScales(I);
  const Parameters &p     = I.p;
  const PetscReal   cv    = ScaleVelocity(p, I.h), cs = (1 - p.am_s) / (1 - p.af_s), ca = p.ca();
  Vec               to[4] = {I.row, I.col, I.slope[0], I.slope[1]};
  PetscScalar      *x[4];
  PetscInt          n;

  PetscFunctionBegin;
  if (I.scaled_h == I.h && I.scaled_mode == I.mode) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(I.row, &n));
  for (int k = 0; k < 4; k++) PetscCall(VecGetArrayWrite(to[k], &x[k]));
  for (PetscInt i = 0; i < n; i++) {
    const unsigned char role = I.role[i];
    x[0][i] = role == TSHHT3_HOLONOMIC ? s.holonomic : role == TSHHT3_NONHOLONOMIC ? s.velocity : 1;
    x[1][i] = role == TSHHT3_COORDINATE ? s.coordinate : role == TSHHT3_STATE ? s.state : 1;
    x[2][i] = role == TSHHT3_COORDINATE ? cv : role == TSHHT3_STATE ? cs : 0;
    x[3][i] = role == TSHHT3_COORDINATE ? ca : 0;
  }
  for (int k = 0; k < 4; k++) PetscCall(VecRestoreArrayWrite(to[k], &x[k]));
  I.scaled_h    = I.h;
  I.scaled_mode = I.mode;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D_r A D_c, in place; matrix-free operators that PETSc makes from our own residual are in these units already */
PetscErrorCode ScaleMatrix(Integrator &I, Mat A)
{
  PetscBool mffd;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)A, &mffd, MATMFFD, MATSHELL, ""));
  if (mffd) PetscFunctionReturn(PETSC_SUCCESS);
  if (I.coordinatesAlone()) PetscCall(MatScale(A, CurrentScales(I).coordinate));
  else PetscCall(MatDiagonalScale(A, I.row, I.col));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of definitions that use q'', in the paper's form: d q''/d a is 1 there and ca in the equations of motion */
PetscErrorCode TrueAccelerationMatrix(TS ts, Vec X, Mat P)
{
  Integrator     &I = Get(ts);
  const Scales    s = CurrentScales(I);
  const PetscReal sa = 1 / ScalePosition(I.p, I.h);
  PetscScalar    *r;
  PetscInt        n;

  PetscFunctionBegin;
  if (!I.second) PetscCall(MatDuplicate(P, MAT_DO_NOT_COPY_VALUES, &I.second));
  PetscCall(EvaluateJacobian(ts, I.t1, I.U1, I.V1, X, s.sv, sa, I.second, I.second));
  PetscCall(VecGetLocalSize(I.work, &n));
  for (int motion = 1; motion >= 0; motion--) { /* keep the rows of motion of P, the others of I.second */
    PetscCall(VecGetArrayWrite(I.work, &r));
    for (PetscInt i = 0; i < n; i++) r[i] = ((RoleOf(I, i) == TSHHT3_COORDINATE) == (motion == 1)) ? 1 : 0;
    PetscCall(VecRestoreArrayWrite(I.work, &r));
    PetscCall(MatDiagonalScale(motion ? P : I.second, I.work, NULL));
  }
  PetscCall(MatAXPY(P, 1, I.second, SAME_NONZERO_PATTERN));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A factor that failed on a matrix with NaN keeps its error, and PETSc would not try another matrix with it: PCSetUp_LU() forgives
   zero pivots alone */
PetscErrorCode ForgiveFactor(KSP ksp)
{
  PC             pc;
  Mat            F;
  MatFactorError error;
  PCFailedReason reason;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetFailedReason(pc, &reason));
  if (reason != PC_FACTOR_OTHER) PetscFunctionReturn(PETSC_SUCCESS); /* so there is a factor */
  PetscCall(PCFactorGetMatrix(pc, &F));
  PetscCall(MatFactorGetError(F, &error));
  if (error == MAT_FACTOR_OTHER) PetscCall(MatFactorClearError(F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Some packages report a singular matrix as an error, others as a failed preconditioner: both become a failed correction */
PetscErrorCode Factor(TS ts, KSP ksp, Mat J, Mat P)
{
  Integrator    &I = Get(ts);
  PetscErrorCode ierr;

  PetscFunctionBegin;
  PetscCall(KSPSetOperators(ksp, J, P));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  ierr = ForgiveFactor(ksp);
  if (!ierr) ierr = KSPSetUp(ksp);
  PetscCall(PetscPopErrorHandler());
  I.singular = (PetscBool)(ierr != 0);
  if (ierr) PetscCall(PetscInfo(ts, "the factorization failed with PETSc error %d\n", (int)ierr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode MatrixHasNumbers(Mat P, PetscBool *numbers)
{
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(MatNorm(P, NORM_FROBENIUS, &norm));
  *numbers = (PetscBool)!PetscIsInfOrNanReal(norm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode EvaluateResidual(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F)
{
  PetscFunctionBegin;
  Get(ts).stat.residuals++;
  PetscCall(TSComputeI2Function(ts, t, U, V, A, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode EvaluateJacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P)
{
  PetscFunctionBegin;
  Get(ts).stat.jacobians++;
  if (Get(ts).differences) PetscCall(DifferencesJacobian(ts, t, U, V, A, sv, sa, P));
  else PetscCall(TSComputeI2Jacobian(ts, t, U, V, A, sv, sa, J, P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U1, V1, A1 = base + X times the derivatives by X */
PetscErrorCode StageVectors(TS ts, Vec X)
{
  Integrator        &I        = Get(ts);
  const PetscReal    one[3]   = {ScalePosition(I.p, I.h), ScaleVelocity(I.p, I.h), I.p.ca()};
  Vec                slope[3] = {I.col, I.slope[0], I.slope[1]}, to[3] = {I.U1, I.V1, I.A1};
  const PetscScalar *x, *base, *s = nullptr;
  PetscScalar       *y[3];
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(X, &n));
  PetscCall(VecGetArrayRead(X, &x));
  for (int k = 0; k < 3; k++) PetscCall(VecGetArray(to[k], &y[k]));
  if (I.mode == Mode::Start) StartStage(I, n, x, y[0], y[1], y[2]);
  else
    for (int k = 0; k < 3; k++) {
      PetscCall(VecGetArrayRead(I.base[k], &base));
      if (!I.coordinatesAlone()) PetscCall(VecGetArrayRead(slope[k], &s));
      Line(n, base, s, one[k], x, y[k]);
      if (!I.coordinatesAlone()) PetscCall(VecRestoreArrayRead(slope[k], &s));
      PetscCall(VecRestoreArrayRead(I.base[k], &base));
    }
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArray(to[k], &y[k]));
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* To be called when h, t_n's state or the misfit of its velocities have changed, before the first residual */
PetscErrorCode PrepareStage(TS ts)
{
  Integrator  &I = Get(ts);
  Ends         e;
  PetscScalar *b[3];
  PetscInt     n;

  PetscFunctionBegin;
  if (!I.coordinatesAlone()) PetscCall(FillScalings(I));
  PetscCall(VecGetLocalSize(I.U0, &n));
  PetscCall(VecGetArrayRead(I.U0, &e.u0));
  PetscCall(VecGetArrayRead(I.V0, &e.v0));
  PetscCall(VecGetArrayRead(I.A0, &e.a0));
  PetscCall(VecGetArrayRead(I.X0, &e.x0));
  if (I.misfit != 0) PetscCall(VecGetArrayRead(I.dV, &e.dv));
  if (I.bent == Bend::Velocities) PetscCall(VecGetArrayRead(I.bend, &e.bend));
  for (int k = 0; k < 3; k++) PetscCall(VecGetArrayWrite(I.base[k], &b[k]));
  StepBase(I, n, e, b[0], b[1], b[2]);
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArrayWrite(I.base[k], &b[k]));
  if (I.bent == Bend::Velocities) PetscCall(VecRestoreArrayRead(I.bend, &e.bend));
  if (I.misfit != 0) PetscCall(VecRestoreArrayRead(I.dV, &e.dv));
  PetscCall(VecRestoreArrayRead(I.X0, &e.x0));
  PetscCall(VecRestoreArrayRead(I.A0, &e.a0));
  PetscCall(VecRestoreArrayRead(I.V0, &e.v0));
  PetscCall(VecRestoreArrayRead(I.U0, &e.u0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FormFunction(SNES, Vec X, Vec F, TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(StageVectors(ts, X));
  PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, I.A1, F));
  if (I.mode == Mode::Start) {
    if (I.constraints()) PetscCall(AccelerationConstraintRows(ts, X, F));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (I.F0) {
    if (I.definitions_use_acceleration) PetscCall(TrueAccelerationRows(ts, X, F));
    PetscCall(AddOldForces(I, F));
  }
  if (I.constraints()) PetscCall(VecPointwiseMult(F, F, I.row)); /* (9b) and its velocity-level sibling */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* SNES asks for it only when the reuse ladder (corrector.cpp) or the user's -snes_lag_jacobian says so */
PetscErrorCode FormJacobian(SNES snes, Vec X, Mat J, Mat P, TS ts)
{
  Integrator      &I = Get(ts);
  const Scales     s = CurrentScales(I);
  PetscObjectState state;
  KSP              ksp;
  PetscBool        symmetric;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.matrix, ts, 0, 0, 0));
  PetscCall(StageVectors(ts, X));
  PetscCall(EvaluateJacobian(ts, I.t1, I.U1, I.V1, I.A1, s.sv, s.sa, J, P));
  PetscCall(PetscObjectStateGet((PetscObject)P, &state));
  if (state != I.scaled_state) { /* an application whose matrix never changes may have left our scaled one in place */
    if (I.mode == Mode::Step && I.F0 && I.definitions_use_acceleration) PetscCall(TrueAccelerationMatrix(ts, X, P));
    if (!I.coordinatesAlone()) PetscCall(FillScalings(I));
    PetscCall(ScaleMatrix(I, P));
    if (J != P) PetscCall(ScaleMatrix(I, J));
    PetscCall(PetscObjectStateGet((PetscObject)P, &I.scaled_state));
  }
  I.corrector.h_matrix    = I.h;
  I.corrector.have_matrix = (PetscBool)(I.mode == Mode::Step);
  I.corrector.fresh       = PETSC_TRUE;
  I.corrector.rate        = -1;
  I.stat.factorizations++;

  PetscCall(SNESGetKSP(snes, &ksp));
  if (!I.linear_chosen || I.linear.cholesky) {
    PetscCall(LinearIsSymmetric(P, &symmetric));
    PetscBool numbers = PETSC_TRUE; /* NaN is not symmetric, but no reason to choose another solver */
    if (I.linear_chosen && !symmetric) PetscCall(MatrixHasNumbers(P, &numbers));
    if (!I.linear_chosen || (!symmetric && numbers)) PetscCall(LinearChoose(ksp, P, symmetric, &I.linear));
    I.linear_chosen = PETSC_TRUE;
  }
  PetscCall(Factor(ts, ksp, J, P));
  if (I.singular) {
    I.corrector.have_matrix = PETSC_FALSE; /* there is nothing to solve with */
    PetscCall(SNESSetJacobianDomainError(snes));
  }
  PetscCall(PetscLogEventEnd(events.matrix, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
