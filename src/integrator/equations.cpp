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
#include "sweeps.h"

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
  const PetscScalar *u0, *v0, *a0, *x0;
};

/* The parts of U1, V1, A1 that do not depend on X, from (2) and from the average that the form asks for. a_n and w_n were made
   by a step of length h_last; their lag behind the true values is stretched to the present h, without which a change of h
   costs an order (Bruels, Arnold 2008). In the paper's form a_n is itself what counts as the true value, so that nothing
   changes. v0 is q'_n as the step takes it, see VelocitiesAtBegin(). */
template <bool all>
struct BaseOfCoordinates {
  Parameters         p;
  PetscReal          h, r, cn, c0;
  Ends               e;
  const float       *moves;
  PetscScalar       *u, *v, *a;

  template <class At>
  HHT3_INLINE void operator()(const At &at) const
  {
    const Four zero = {0, 0, 0, 0}, a0 = at.get(e.a0), an = a0 + r * (at.get(e.x0) - a0), v0 = at.get(e.v0);
    Four       u1 = at.get(e.u0) + h * (v0 + h * ((PetscReal)0.5 - p.beta) * an), v1 = v0 + h * (1 - p.gamma) * an, a1 = cn * an - c0 * a0;
    if (!all) {
      const auto moving = at.get(moves) != 0;
      u1                = moving ? u1 : zero;
      v1                = moving ? v1 : zero;
      a1                = moving ? a1 : zero;
    }
    at.put(u, u1);
    at.put(v, v1);
    at.put(a, a1);
  }
};

void BaseOfStates(const Integrator &I, const Ends &e, PetscScalar *const b[])
{
  const Parameters &p = I.p;
  const PetscReal   h = I.h, r = I.h_last > 0 ? h / I.h_last : 1;
  for (PetscInt i : I.states) {
    const PetscScalar wn = e.v0[i] + r * (e.x0[i] - e.v0[i]);
    b[0][i]              = e.u0[i] + h * (1 - p.gamma_s) * wn;
    b[1][i]              = (p.am_s * wn - p.af_s * e.v0[i]) / (1 - p.af_s);
  }
}

/* q'_n less its misfit and what a change of coordinates has bent, misfit.cpp */
PetscErrorCode VelocitiesAtBegin(const Integrator &I, Vec v)
{
  PetscFunctionBegin;
  if (I.misfit != 0) PetscCall(VecWAXPY(v, -I.misfit, I.dV, I.V0));
  else PetscCall(VecCopy(I.V0, v));
  if (I.bent == Bend::Velocities) PetscCall(VecAXPY(v, -I.p.bend() * I.h * I.h, I.bend));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U1, V1, A1 = base + X times their derivatives by X; of what is no coordinate U1 is X itself */
template <bool all>
struct Stage {
  PetscReal          kq, kv, ka;
  const PetscScalar *x, *base[3];
  const float       *moves;
  PetscScalar       *to[3];

  template <class At>
  HHT3_INLINE void set(const At &at, const Four &given) const
  {
    const Four c = all ? given : given * at.get(moves);
    Four       u = at.get(base[0]) + kq * c;
    if (!all) u += given - c;
    at.put(to[0], u);
    at.put(to[1], at.get(base[1]) + kv * c);
    at.put(to[2], at.get(base[2]) + ka * c);
  }
  template <class At>
  HHT3_INLINE void operator()(const At &at) const { set(at, at.get(x)); }
};

/* The same after X = X - d, and the squares of d by the weights */
template <bool all>
struct CorrectedStage {
  Stage<all>         stage;
  const PetscScalar *d, *w;
  PetscScalar       *x;
  Four               sum = {0, 0, 0, 0};

  template <class At>
  HHT3_INLINE void operator()(const At &at)
  {
    const Four correction = at.get(d), weighted = correction * at.get(w), now = at.get(x) - correction;
    sum += weighted * weighted;
    at.put(x, now);
    stage.set(at, now);
  }
};

void StageOfStates(const Integrator &I, const PetscScalar *x, const PetscScalar *const base[], PetscScalar *const to[])
{
  const Parameters &p = I.p;
  const PetscReal   ks = ScaleState(p, I.h), cs = (1 - p.am_s) / (1 - p.af_s);
  for (PetscInt i : I.states) {
    to[0][i] = base[0][i] + ks * x[i];
    to[1][i] = base[1][i] + cs * x[i];
  }
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

/* d[i] = value of the role of i */
PetscErrorCode FillByRole(const Integrator &I, const PetscReal value[], Vec d)
{
  const PetscInt n = (PetscInt)I.role.size();
  PetscScalar   *x;

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(d, &x));
  for (PetscInt i = 0; i < n; i++) x[i] = value[I.role[i]];
  PetscCall(VecRestoreArrayWrite(d, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D_r; kept while h and the mode stay */
PetscErrorCode FillRows(Integrator &I)
{
  const Scales s = CurrentScales(I);
  PetscReal    value[TSHHT3_NUM_ROLES];

  PetscFunctionBegin;
  if (I.scaled_h == I.h && I.scaled_mode == I.mode) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscReal &v : value) v = 1;
  value[TSHHT3_HOLONOMIC]    = s.holonomic;
  value[TSHHT3_NONHOLONOMIC] = s.velocity;
  PetscCall(FillByRole(I, value, I.row));
  I.scaled_h    = I.h;
  I.scaled_mode = I.mode;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D_c = dU/dX */
PetscErrorCode FillColumns(Integrator &I)
{
  const Scales s = CurrentScales(I);
  PetscReal    value[TSHHT3_NUM_ROLES];

  PetscFunctionBegin;
  for (PetscReal &v : value) v = 1;
  value[TSHHT3_COORDINATE] = s.coordinate;
  value[TSHHT3_STATE]      = s.state;
  PetscCall(FillByRole(I, value, I.col));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (9b) and its velocity-level sibling: F times D_r, which has one value in the rows of all constraints where there is nothing but
   coordinates and holonomic ones */
struct ScaledRows {
  const PetscScalar *row;
  PetscScalar       *f;

  template <class At>
  HHT3_INLINE void operator()(const At &at) const { at.put(f, at.get(f) * at.get(row)); }
};

struct ScaledConstraints {
  const float *moves;
  PetscReal    factor;
  PetscScalar *f;

  template <class At>
  HHT3_INLINE void operator()(const At &at) const
  {
    const Four x = at.get(f);
    at.put(f, at.get(moves) != 0 ? x : factor * x);
  }
};

PetscErrorCode ScaleResidual(Integrator &I, Vec F)
{
  const PetscScalar *row;
  PetscScalar       *f;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(F, &n));
  PetscCall(VecGetArray(F, &f));
  if (I.coordinatesAnd(TSHHT3_HOLONOMIC)) Sweep(n, ScaledConstraints{I.moves.data(), CurrentScales(I).holonomic, f});
  else {
    PetscCall(FillRows(I));
    PetscCall(VecGetArrayRead(I.row, &row));
    Sweep(n, ScaledRows{row, f});
    PetscCall(VecRestoreArrayRead(I.row, &row));
  }
  PetscCall(VecRestoreArray(F, &f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D_r A D_c, in place; matrix-free operators that PETSc makes from our own residual are in these units already */
PetscErrorCode ScaleMatrix(Integrator &I, Mat A)
{
  PetscBool mffd, triangle;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)A, &mffd, MATMFFD, MATSHELL, ""));
  if (mffd) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LinearStoresTriangle(A, &triangle));
  if (I.coordinatesAlone()) PetscCall(MatScale(A, CurrentScales(I).coordinate));
  else {
    PetscCall(FillRows(I));
    PetscCall(FillColumns(I));
    if (triangle) PetscCall(ScaleTriangle(I, A));
    else PetscCall(MatDiagonalScale(A, I.row, I.col));
  }
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

/* The arrays of a stage but X */
struct StageArrays {
  const PetscScalar *base[3];
  PetscScalar       *to[3];
  PetscInt           n;
};

static PetscErrorCode GetStage(const Integrator &I, StageArrays *s)
{
  Vec to[3] = {I.U1, I.V1, I.A1};

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(I.U1, &s->n));
  for (int k = 0; k < 3; k++) PetscCall(VecGetArrayRead(I.base[k], &s->base[k]));
  for (int k = 0; k < 3; k++) PetscCall(VecGetArray(to[k], &s->to[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RestoreStage(const Integrator &I, StageArrays *s)
{
  Vec to[3] = {I.U1, I.V1, I.A1};

  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArray(to[k], &s->to[k]));
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArrayRead(I.base[k], &s->base[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <bool all>
static Stage<all> MakeStage(const Integrator &I, const StageArrays &s, const PetscScalar *x)
{
  return {ScalePosition(I.p, I.h), ScaleVelocity(I.p, I.h), I.p.ca(), x, {s.base[0], s.base[1], s.base[2]}, I.moves.data(), {s.to[0], s.to[1], s.to[2]}};
}

/* Remembers that U1, V1, A1 belong to X */
static PetscErrorCode NoteStage(Integrator &I, Vec X)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)X, &I.stage_id));
  PetscCall(PetscObjectStateGet((PetscObject)X, &I.stage_state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode HasStage(const Integrator &I, Vec X, bool *has)
{
  PetscObjectId    id;
  PetscObjectState state;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)X, &id));
  PetscCall(PetscObjectStateGet((PetscObject)X, &state));
  *has = I.mode == Mode::Step && id == I.stage_id && state == I.stage_state;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U1, V1, A1 from X; to be called after PrepareStage() */
PetscErrorCode StageVectors(TS ts, Vec X)
{
  Integrator        &I = Get(ts);
  StageArrays        s;
  const PetscScalar *x;
  bool               has;

  PetscFunctionBegin;
  PetscCall(HasStage(I, X, &has));
  if (has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(X, &x));
  PetscCall(GetStage(I, &s));
  if (I.mode == Mode::Start) StartStage(I, s.n, x, s.to[0], s.to[1], s.to[2]);
  else {
    if (I.moves.empty()) Sweep(s.n, MakeStage<true>(I, s, x));
    else Sweep(s.n, MakeStage<false>(I, s, x));
    StageOfStates(I, x, s.base, s.to);
    PetscCall(NoteStage(I, X));
  }
  PetscCall(RestoreStage(I, &s));
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X = X - dX, the norm of dX by which the corrector judges it, and U1, V1, A1 that belong to the new X, in one sweep */
PetscErrorCode SubtractCorrection(TS ts, Vec X, Vec dX, PetscReal *e)
{
  Integrator        &I = Get(ts);
  StageArrays        s;
  const PetscScalar *d, *w;
  PetscScalar       *x;
  Four               sum;

  PetscFunctionBegin;
  PetscCall(VecGetArray(X, &x));
  PetscCall(VecGetArrayRead(dX, &d));
  PetscCall(VecGetArrayRead(I.weight, &w));
  PetscCall(GetStage(I, &s));
  if (I.moves.empty()) sum = Sweep(s.n, CorrectedStage<true>{MakeStage<true>(I, s, x), d, w, x}).sum;
  else sum = Sweep(s.n, CorrectedStage<false>{MakeStage<false>(I, s, x), d, w, x}).sum;
  StageOfStates(I, x, s.base, s.to);
  PetscCall(RestoreStage(I, &s));
  PetscCall(VecRestoreArrayRead(I.weight, &w));
  PetscCall(VecRestoreArrayRead(dX, &d));
  PetscCall(VecRestoreArray(X, &x));
  PetscCall(NoteStage(I, X));
  PetscCall(ReduceCorrection(ts, dX, Total(sum), e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* To be called when h, t_n's state or the misfit of its velocities have changed, before the first residual */
PetscErrorCode PrepareStage(TS ts)
{
  Integrator     &I = Get(ts);
  const bool      paper = I.form == TSHHT3_FORM_PAPER, changed = I.misfit != 0 || I.bent == Bend::Velocities;
  const PetscReal cn = paper ? 0 : I.p.am / (1 - I.p.af), c0 = paper ? 0 : I.p.af / (1 - I.p.af);
  Ends            e;
  PetscScalar    *b[3];
  PetscInt        n;

  PetscFunctionBegin;
  I.stage_id = 0;
  if (changed) PetscCall(VelocitiesAtBegin(I, I.base[1]));
  PetscCall(VecGetLocalSize(I.U0, &n));
  PetscCall(VecGetArrayRead(I.U0, &e.u0));
  PetscCall(VecGetArrayRead(I.V0, &e.v0));
  PetscCall(VecGetArrayRead(I.A0, &e.a0));
  PetscCall(VecGetArrayRead(I.X0, &e.x0));
  for (int k = 0; k < 3; k++) PetscCall(VecGetArray(I.base[k], &b[k]));
  const auto sweep = [&](auto base) {
    base = {I.p, I.h, I.h_last > 0 ? I.h / I.h_last : 1, cn, c0, e, I.moves.data(), b[0], b[1], b[2]};
    if (changed) base.e.v0 = b[1];
    Sweep(n, base);
  };
  if (I.moves.empty()) sweep(BaseOfCoordinates<true>());
  else sweep(BaseOfCoordinates<false>());
  BaseOfStates(I, e, b);
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArray(I.base[k], &b[k]));
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
  if (I.constraints()) PetscCall(ScaleResidual(I, F));
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
