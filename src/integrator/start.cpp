/*
  A consistent start: q''_0, s'_0, lambda_0, V_0, F_0 from given q_0, q'_0, s_0.

  As h -> 0 the matrix (10) becomes [M Phi_q^T; Phi_q 0], so that the start is solved by the step's own SNES in another mode:
  equations of motion, states and definitions at t_0, constraints differentiated to the level of accelerations,
  Phi_q q'' + (Phi_q q')_q q' + 2 Phi_qt q' + Phi_tt = 0 (6c), velocity-level ones once.

  Then a second solve a little later gives q'''_0. From it come the first step, when the user gave none, and the start
  value of the algorithmic acceleration, a_0 = q''(t_0 + lag h): with a_0 = q''_0 the first steps excite an oscillation of
  the multipliers and an error of second order in q' (Arnold, Bruels 2007).
*/
#include "impl.h"

namespace hht3
{

namespace
{

/* Which entries of a vector of unknowns go where */
PetscErrorCode CopyRoles(const Integrator &I, Vec from, Vec to, bool coordinates, bool states, bool algebraic)
{
  const PetscScalar *x;
  PetscScalar       *y;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(from, &n));
  PetscCall(VecGetArrayRead(from, &x));
  PetscCall(VecGetArray(to, &y));
  for (PetscInt i = 0; i < n; i++) {
    const TSHHT3Role r = RoleOf(I, i);
    if (r == TSHHT3_COORDINATE ? coordinates : r == TSHHT3_STATE ? states : algebraic) y[i] = x[i];
  }
  PetscCall(VecRestoreArray(to, &y));
  PetscCall(VecRestoreArrayRead(from, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U and V a time d after U0, V0 by Taylor series with the accelerations A0 */
PetscErrorCode Advance(const Integrator &I, PetscReal d, Vec U, Vec V)
{
  const PetscScalar *u0, *v0, *a0;
  PetscScalar       *u, *v;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(U, &n));
  PetscCall(VecGetArrayRead(I.U0, &u0));
  PetscCall(VecGetArrayRead(I.V0, &v0));
  PetscCall(VecGetArrayRead(I.A0, &a0));
  PetscCall(VecGetArray(U, &u));
  PetscCall(VecGetArray(V, &v));
  for (PetscInt i = 0; i < n; i++) {
    const TSHHT3Role r = RoleOf(I, i);
    u[i]               = u0[i] + (r == TSHHT3_COORDINATE ? d * (v0[i] + d / 2 * a0[i]) : r == TSHHT3_STATE ? d * v0[i] : 0);
    v[i]               = v0[i] + (r == TSHHT3_COORDINATE ? d * a0[i] : 0);
  }
  PetscCall(VecRestoreArray(V, &v));
  PetscCall(VecRestoreArray(U, &u));
  PetscCall(VecRestoreArrayRead(I.A0, &a0));
  PetscCall(VecRestoreArrayRead(I.V0, &v0));
  PetscCall(VecRestoreArrayRead(I.U0, &u0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U1, V1, A1 = U, V, 0 and the mode, time and (tiny) step of the start */
PetscErrorCode EnterStart(TS ts, PetscReal t, Vec U, Vec V)
{
  Integrator &I = Get(ts);
  PetscReal   T;

  PetscFunctionBegin;
  PetscCall(TimeScale(ts, &T));
  I.mode = Mode::Start;
  I.t1   = t;
  I.h    = I.implicit > 0 ? I.implicit : 1e-28 * T; /* h C/M and h^2 K/M must be nothing: with 1e-12 dampers of 1e12 M/T stood as inertia in the matrix, Start.StrongDampingIsNoInertia */
  PetscCall(VecCopy(U, I.U1));
  PetscCall(VecCopy(V, I.V1));
  PetscCall(VecZeroEntries(I.A1));
  if (I.implicit > 0) {
    PetscCall(VecWAXPY(I.base[0], I.implicit, V, U));
    PetscCall(VecCopy(V, I.base[1]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* There is no h to cut here: an application whose Jacobian is not a number is asked once more */
PetscErrorCode MakeStartMatrix(TS ts)
{
  Integrator &I = Get(ts);
  Mat         P; /* alone: a matrix-free operator has nothing to differentiate before SNESSolve() */
  PetscBool   numbers = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(SNESSetUp(ts->snes));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(FormJacobian(ts->snes, I.X, P, P, ts));
  PetscCall(MatrixHasNumbers(P, &numbers));
  if (!numbers) PetscCall(FormJacobian(ts->snes, I.X, P, P, ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rates of all unknowns (q''', s'', lambda', ...) by a second consistent solve, d later; zero where it cannot be had.
   Leaves X as it was. */
PetscErrorCode Rates(TS ts, Vec rate)
{
  Integrator &I = Get(ts);
  PetscReal   T;
  PetscBool   ok;
  Vec         X0, U, V;

  PetscFunctionBegin;
  PetscCall(TimeScale(ts, &T));
  const PetscReal d = 1e-5 * T;
  PetscCall(VecDuplicate(I.X, &X0));
  PetscCall(VecDuplicate(I.X, &U));
  PetscCall(VecDuplicate(I.X, &V));
  PetscCall(VecCopy(I.X, X0));
  PetscCall(Advance(I, d, U, V));
  PetscCall(ConsistentAccelerations(ts, ts->ptime + d, U, V, PETSC_FALSE, &ok));
  PetscCall(VecZeroEntries(rate));
  if (ok) {
    PetscCall(VecWAXPY(rate, -1, X0, I.X));
    PetscCall(VecScale(rate, 1 / d));
  } else PetscCall(PetscInfo(ts, "start: no consistent accelerations at t_0 + %g, the start goes without q'''\n", (double)d));
  PetscCall(VecCopy(X0, I.X));
  PetscCall(VecDestroy(&V));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&X0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first h: a local error of an eighth of the tolerance from q'''; without one, from q'' or the length of the run */
PetscErrorCode FirstStep(TS ts, Vec rate, PetscReal *h)
{
  Integrator &I = Get(ts);
  PetscReal   e3, e2;

  PetscFunctionBegin;
  I.h = 1; /* CorrectionNorm() is |k| h^2 times the weighted norm */
  PetscCall(CorrectionNorm(ts, rate, &e3));
  PetscCall(CorrectionNorm(ts, I.A0, &e2));
  const PetscReal span = HHT3NextStop(ts) < PETSC_MAX_REAL / 2 ? HHT3NextStop(ts) - ts->ptime : 1;
  PetscReal       h3 = e3 > 0 ? 0.5 * PetscPowReal(e3, (PetscReal)-1 / 3) : PETSC_MAX_REAL;
  if (e3 <= 0 && e2 > 0) h3 = PetscPowReal(e2, -0.5);
  *h = PetscMin(h3, span / 10);
  *h = PetscClipInterval(*h, ts->adapt->dt_min, ts->adapt->dt_max);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the user has set none, also not since the set-up; TSSolve() may have cut what stood there to the length of the run */
PetscErrorCode ChooseFirstStep(TS ts, Vec rate)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  const bool unset = ts->time_step == unset_step || ts->time_step == HHT3NextStop(ts) - ts->ptime;
  if (I.auto_h && unset && I.fixed_h) ts->time_step = PetscMin(petsc_step, HHT3NextStop(ts) - ts->ptime);
  else if (I.auto_h && unset) {
    PetscCall(FirstStep(ts, rate, &ts->time_step));
    PetscCall(PetscInfo(ts, "start: first step %g\n", (double)ts->time_step));
    I.h_chosen = PETSC_TRUE;
  }
  I.auto_h = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The history that a step of length h would have left: a_0 and w_0 with their lag, and the rates as the first divided
   difference of the predictor (at a double node). Not if the rates are too wild to be believed. */
PetscErrorCode MakeHistory(TS ts, Vec rate)
{
  Integrator        &I = Get(ts);
  Predictor         &p = I.predictor;
  const PetscReal    h = ts->time_step;
  const PetscScalar *j;
  PetscScalar       *x, *d0;
  PetscInt           n;
  PetscReal          e;

  PetscFunctionBegin;
  PetscCall(PredictorReset(ts));
  I.h           = h;
  I.h_last      = h;
  I.have_misfit = PETSC_FALSE;
  I.bent        = Bend::None;
  PetscCall(CorrectionNorm(ts, rate, &e));
  e *= h;
  I.corrector.wlte = e;
  if (e > 100) {
    PetscCall(PetscInfo(ts, "start: q''' h exceeds the tolerance %g times, a_0 = q''_0\n", (double)e));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetLocalSize(rate, &n));
  PetscCall(VecGetArrayRead(rate, &j));
  PetscCall(VecGetArray(I.X0, &x));
  PetscCall(VecGetArray(p.D[0], &d0));
  for (PetscInt i = 0; i < n; i++) {
    const TSHHT3Role r = RoleOf(I, i);
    if (IsDifferential(r)) x[i] += (r == TSHHT3_STATE ? I.p.lagState() : I.p.lag()) * h * j[i];
    if (r == TSHHT3_COORDINATE) d0[i] = x[i];
  }
  PetscCall(VecRestoreArray(p.D[0], &d0));
  PetscCall(VecRestoreArray(I.X0, &x));
  PetscCall(VecRestoreArrayRead(rate, &j));
  if (e > 0) PetscCall(StartMisfit(ts, rate));
  if (e > 0 && (p.degree_max > 0 || I.count[TSHHT3_STATE])) {
    if (!p.D[1]) PetscCall(VecDuplicate(rate, &p.D[1]));
    PetscCall(VecCopy(rate, p.D[1]));
    p.available = 1;
    p.degree    = PetscMin(1, p.degree_max);
    p.t[1]      = p.t[0];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X holds the accelerations, derivatives and algebraic unknowns at U0, V0 */
PetscErrorCode Distribute(Integrator &I)
{
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(I.A0));
  PetscCall(CopyRoles(I, I.X, I.A0, true, false, false));
  PetscCall(CopyRoles(I, I.X, I.V0, false, true, false));
  PetscCall(CopyRoles(I, I.X, I.U0, false, false, true));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ClearAlgebraicRates(Integrator &I, Vec V)
{
  PetscScalar *v;
  PetscInt     n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(V, &n));
  PetscCall(VecGetArray(V, &v));
  for (PetscInt i = 0; i < n; i++)
    if (!IsDifferential(RoleOf(I, i))) v[i] = 0;
  PetscCall(VecRestoreArray(V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* X may be what a failed correction has left: multipliers that are not numbers would be part of the matrix */
PetscErrorCode StartMatrix(TS ts, PetscReal t, Vec U, Vec V)
{
  Integrator &I = Get(ts);
  PetscReal   norm;

  PetscFunctionBegin;
  PetscCall(VecNorm(I.X, NORM_2, &norm));
  if (PetscIsInfOrNanReal(norm)) PetscCall(VecCopy(I.X0, I.X));
  PetscCall(EnterStart(ts, t, U, V));
  PetscCall(MakeStartMatrix(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix of the start with which no solve is possible, explained: an error in any case */
PetscErrorCode NameRedundant(TS ts)
{
  Integrator           &I = Get(ts);
  IS                    multipliers;
  std::vector<PetscInt> list;
  PetscInt              start, n = 0, rows[20];
  Mat                   P;
  char                  text[256] = "";
  size_t                used;
  PetscBool             numbers, is_singular;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(MatrixHasNumbers(P, &numbers));
  PetscCheck(numbers, PetscObjectComm((PetscObject)ts), PETSC_ERR_FP, "The application's Jacobian (TSSetI2Jacobian()) is not a number at t = %g", (double)ts->ptime);
  PetscCall(MatrixIsSingular(ts, &is_singular));
  if (!is_singular) PetscCall(ExplainLinearFailure(ts));
  PetscCheck(is_singular, PetscObjectComm((PetscObject)ts), PETSC_ERR_NOT_CONVERGED,
             "No consistent accelerations and multipliers were found: %s. The matrix [M Phi_q^T; Phi_q 0] is indefinite; without -ksp_type and -pc_type it is factored directly", I.failure);
  PetscCall(VecGetOwnershipRange(I.X, &start, NULL));
  for (size_t i = 0; i < I.role.size(); i++)
    if (I.role[i] == TSHHT3_HOLONOMIC || I.role[i] == TSHHT3_NONHOLONOMIC) list.push_back(start + (PetscInt)i);
  if (I.constraints()) {
    PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)ts), (PetscInt)list.size(), list.data(), PETSC_COPY_VALUES, &multipliers));
    PetscCall(LinearNameDependent(P, multipliers, 20, &n, rows));
    PetscCall(ISDestroy(&multipliers));
  }
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(PetscStrlen(text, &used));
    if (used < sizeof(text) - 16) PetscCall(PetscSNPrintf(text + used, sizeof(text) - used, "%s%" PetscInt_FMT, i ? ", " : "", rows[i]));
  }
  PetscCheck(!n, PetscObjectComm((PetscObject)ts), PETSC_ERR_MAT_LU_ZRPVT,
             "The matrix [M Phi_q^T; Phi_q 0] is singular at t = %g: the constraints in rows %s depend on one another. Remove the redundant ones.", (double)ts->ptime, text);
  SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_MAT_LU_ZRPVT,
          "The matrix [M Phi_q^T; Phi_q 0] is singular at t = %g, and not by dependent constraints: look for a coordinate without mass that no constraint holds, "
          "or a definition that does not determine its variable (-ts_view lists the roles)", (double)ts->ptime);
}

/* X from U, V at t; X enters as the guess */
PetscErrorCode ConsistentAccelerations(TS ts, PetscReal t, Vec U, Vec V, PetscBool have_matrix, PetscBool *ok)
{
  Integrator &I = Get(ts);
  PetscReal   T;

  PetscFunctionBegin;
  PetscCall(EnterStart(ts, t, U, V));
  if (I.constraints()) {
    PetscCall(TimeScale(ts, &T));
    PetscCall(ConstraintDerivatives(ts, t, U, V, T, NULL, I.gamma));
  }
  if (!have_matrix) PetscCall(MakeStartMatrix(ts));
  if (I.unfactored) {
    I.mode = Mode::Step;
    *ok    = PETSC_FALSE;
    PetscCall(ExplainLinearFailure(ts));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* the matrix is made beforehand, since the first residual needs it */
  const Corrector saved   = I.corrector;
  I.corrector.want_matrix = PETSC_FALSE;
  I.corrector.have_matrix = PETSC_TRUE;
  I.corrector.floor       = 0;
  I.corrector.no_solve    = PETSC_FALSE;
  PetscCall(IterateStart(ts, ok));
  const PetscBool no_solve = I.corrector.no_solve;
  I.corrector             = saved;
  I.corrector.no_solve    = no_solve;
  I.corrector.have_matrix = PETSC_FALSE;
  I.corrector.want_matrix = PETSC_TRUE;
  I.corrector.h_matrix    = 0;
  I.corrector.rate        = -1;
  I.mode                  = Mode::Step;
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{

constexpr int max_transients = 30; /* one within the other; each time a tenth of one is left */

/* Accelerations, multipliers and their rates from U0, V0 */
PetscErrorCode Consistent(TS ts, PetscBool matrix_is_current, Vec rate)
{
  Integrator &I = Get(ts);
  PetscBool   ok;

  PetscFunctionBegin;
  PetscCall(VecZeroEntries(I.X));
  PetscCall(CopyRoles(I, I.U0, I.X, false, false, true));
  PetscCall(ConsistentAccelerations(ts, ts->ptime, I.U0, I.V0, matrix_is_current, &ok));
  if (!ok) {
    if (I.unfactored || I.corrector.no_solve) PetscCall(NameRedundant(ts));
    SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_NOT_CONVERGED, "No consistent accelerations and multipliers were found at t = %g: %s", (double)ts->ptime, I.failure);
  }
  PetscCall(Distribute(I));
  PetscCall(VecCopy(I.X, I.X0));
  PetscCall(VecCopy(I.X, I.predictor.D[0]));
  PetscCall(Rates(ts, rate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A consistent start from U0, V0, and the first step. Transients that are over long before its end are taken out of V0, one after the other, as
   long as that takes their accelerations away. */
PetscErrorCode ConsistentStart(TS ts, PetscBool matrix_is_current, Vec rate)
{
  Integrator     &I      = Get(ts);
  const PetscReal given  = ts->time_step;
  const PetscBool auto_h = I.auto_h;
  PetscReal       before, after, tau;
  bool            gone = true;
  Vec             V;

  PetscFunctionBegin;
  PetscCall(Consistent(ts, matrix_is_current, rate));
  PetscCall(ChooseFirstStep(ts, rate));
  PetscCall(VecDuplicate(I.V0, &V));
  for (int k = 0; gone && k < max_transients; k++) {
    PetscCall(VecCopy(I.V0, V));
    PetscCall(VecNorm(I.A0, NORM_2, &before));
    PetscCall(SettleTransient(ts, ts->time_step, rate, &tau));
    if (tau <= 0) break;
    ts->time_step = given;
    I.auto_h      = auto_h;
    PetscCall(Consistent(ts, PETSC_FALSE, rate));
    PetscCall(VecNorm(I.A0, NORM_2, &after));
    gone = after < 0.5 * before;
    if (gone) PetscCall(PetscInfo(ts, "start: what moves is held within %g, far less than the step, and starts with the velocities that this leaves\n", (double)tau));
    else {
      PetscCall(VecCopy(V, I.V0));
      PetscCall(Consistent(ts, PETSC_FALSE, rate));
    }
    PetscCall(ChooseFirstStep(ts, rate));
    if (!gone && k) PetscCall(VecZeroEntries(rate)); /* those of what rounding leaves of the transient */
  }
  PetscCall(VecDestroy(&V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Everything of t_n from U0, V0: the common part of a start and of a repair */
PetscErrorCode StartFromState(TS ts, PetscBool matrix_is_current)
{
  Integrator &I = Get(ts);
  Vec         rate;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(I.X, &rate));
  PetscCall(ConsistentStart(ts, matrix_is_current, rate));
  PetscCall(VecCopy(I.U0, ts->vec_sol));
  PetscCall(VecCopy(I.V0, ts->vec_dot));
  PetscCall(MakeHistory(ts, rate));
  PetscCall(VecDestroy(&rate));
  if (I.F0) {
    PetscCall(VecZeroEntries(I.A1));
    PetscCall(EvaluateResidual(ts, ts->ptime, I.U0, I.V0, I.A1, I.F0));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* From vec_sol and vec_dot at ptime; history is forgotten */
PetscErrorCode Start(TS ts)
{
  Integrator &I = Get(ts);
  PetscBool   current;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.start, ts, 0, 0, 0));
  PetscCall(PetscInfo(ts, "start: consistent accelerations at t = %g\n", (double)ts->ptime));
  PetscCall(CheckSettings(ts));
  I.stat.restarts++;
  I.repaired = PETSC_FALSE;
  I.tiny_row = 0;
  PetscCall(VecCopy(ts->vec_sol, I.U0));
  PetscCall(VecCopy(ts->vec_dot, I.V0));
  PetscCall(ClearAlgebraicRates(I, I.V0));
  if (I.change.test) PetscCall(ChangeCoordinates(ts, true));
  PetscCall(UpdateWeights(ts, I.U0));
  PetscCall(CheckInitialState(ts, &current));
  PetscCall(StartFromState(ts, current));
  PetscCall(PetscLogEventEnd(events.start, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  When h has to shrink by much. A step of length h satisfies Phi_q q' + Phi_t = 0 to O(h^2) only; a far shorter one that
  starts from there turns this misfit into accelerations of O(h_old^2/h_new), which no further reduction of h mends. So the
  velocities of t_n are projected on the constraints and the step starts afresh, consistently, at the new h.
*/
PetscErrorCode Repair(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.start, ts, 0, 0, 0));
  PetscCall(PetscInfo(ts, "h falls from %g to %g at t = %g: velocities projected, consistent start\n", (double)I.h_last, (double)ts->time_step, (double)ts->ptime));
  I.stat.restarts++;
  if (!I.repaired) {
    Vec now[2] = {I.U0, I.V0};
    for (int k = 0; k < 2; k++) {
      if (!I.accepted[k]) PetscCall(VecDuplicate(now[k], &I.accepted[k]));
      PetscCall(VecCopy(now[k], I.accepted[k]));
    }
    I.repaired = PETSC_TRUE;
  }
  PetscCall(ProjectVelocities(ts));
  PetscCall(StartFromState(ts, (PetscBool)!I.count[TSHHT3_NONHOLONOMIC]));
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
  Integrator     &I = Get(ts);
  const PetscReal h = I.h, t1 = I.t1;
  Vec             U, V;

  PetscFunctionBegin;
  PetscCall(PetscInfo(ts, "step of %g is below what rounding of q allows the corrector: Taylor series\n", (double)h));
  I.stat.tiny_steps++;
  PetscCall(VecDuplicate(I.U0, &U));
  PetscCall(VecDuplicate(I.U0, &V));
  PetscCall(Advance(I, h, U, V));
  PetscCall(VecCopy(I.predictor.D[0], I.X));
  PetscCall(ConsistentAccelerations(ts, t1, U, V, PETSC_FALSE, ok));
  I.h  = h;
  I.t1 = t1;
  if (*ok) {
    /* the start has differentiated the constraints at times around t1: it need not have seen their values there */
    PetscCall(EvaluateResidual(ts, t1, I.U1, I.V1, I.A1, U));
    PetscCall(CheckNumbers(ts, U, ok));
  }
  PetscCall(VecDestroy(&V));
  PetscCall(VecDestroy(&U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
