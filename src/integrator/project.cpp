/*
  Initial values and the constraints: how far q_0 and q'_0 are from them, and the projection of both.

  The misfit is measured as the distance to the nearest consistent state in the metric of the mass matrix, from

    [M Phi_q^T; Phi_q 0] [dq; mu] = [0; Phi],      the same with dq', Phi_q q' + Phi_t (and Psi) for the velocities,

  which has the units of q and so can be held against the tolerances. Time derivatives of the constraints come from
  one-sided differences of the application's residual along q_0 + tau q'_0: exact in q'' by construction, blind to what
  happened before t_0 (a motion may start there), and each row takes the step tau at which it is most accurate.
*/
#include "entries.h"
#include "impl.h"

namespace hht3
{

namespace
{

constexpr int       levels = 9, points = 6;
constexpr PetscReal first_weights[points]  = {-25. / 12, 4, -3, 4. / 3, -1. / 4, 0};
constexpr PetscReal second_weights[points] = {45. / 12, -154. / 12, 214. / 12, -13, 61. / 12, -10. / 12};

/* For each row, the value at the tau where it changed least from one tau to the next */
struct Refined {
  std::vector<PetscReal> last, best, change;
  explicit Refined(PetscInt n) : last(n, 0), best(n, 0), change(n, PETSC_MAX_REAL) {}
  void take(PetscInt i, int level, PetscReal value)
  {
    const PetscReal d = PetscAbsReal(value - last[i]);
    if (level > 0 && d < change[i]) { /* false for NaN */
      change[i] = d;
      best[i]   = value;
    }
    last[i] = value;
  }
};

/* Copies the rows of holonomic constraints of F into R and clears the others */
PetscErrorCode HolonomicRows(const Integrator &I, Vec F, Vec R)
{
  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar f, PetscScalar &r) { r = RoleOf(I, i) == TSHHT3_HOLONOMIC ? f : 0; }, Read(F), Write(R)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Weighted root mean square of the entries of d that belong to coordinates, times s: in units of the tolerance */
PetscErrorCode Distance(TS ts, Vec d, PetscReal s, PetscReal *e)
{
  Integrator &I   = Get(ts);
  PetscReal   sum = 0, total;

  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar x, PetscScalar w) { if (IsCoordinate(I, i)) sum += PetscSqr(PetscRealPart(x * w) * s); }, Read(d), Read(I.weight)));
  PetscCallMPI(MPI_Allreduce(&sum, &total, 1, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  *e = PetscSqrtReal(total / PetscMax(I.norm_size, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y -= d on coordinates */
PetscErrorCode Move(const Integrator &I, Vec y, Vec d)
{
  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar x, PetscScalar &z) { if (IsCoordinate(I, i)) z -= x; }, Read(d), Write(y)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SolveStart(TS ts, Vec rhs, Vec d)
{
  SNES               snes = ts->snes;
  KSP                ksp;
  Mat                P;
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(SNESGetJacobian(snes, NULL, &P, NULL, NULL));
  if (Get(ts).unfactored) PetscCall(NameRedundant(ts));
  PetscCall(KSPSetOperators(ksp, P, P));
  PetscCall(KSPSolve(ksp, rhs, d));
  Get(ts).stat.solves++;
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  if (reason < 0) PetscCall(NameRedundant(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The row with the largest violation, for the report */
PetscErrorCode WorstRow(TS ts, Vec R, PetscInt *row, PetscReal *value)
{
  Vec      a = Get(ts).A1;

  PetscFunctionBegin;
  PetscCall(VecCopy(R, a));
  PetscCall(VecAbs(a));
  PetscCall(VecMax(a, row, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Report(TS ts, const char *what, const char *unit, PetscReal e, PetscInt row, PetscReal value, PetscBool moved)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(PetscInfo(ts, "start: %s violate the constraints by %g of the tolerance, most in row %" PetscInt_FMT " (%g)%s\n", what,
                      (double)e, row, (double)value, moved ? "; projected" : ""));
  /* within a run the velocities are consistent to the order of the method only, which is no fault of the user's */
  if (e > (I.stat.restarts > 1 ? 100 : 1) && I.start_policy == TSHHT3_START_REPORT) {
    PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts),
                          "hhtdae: at t = %g the %s%s violate the constraints: the nearest consistent ones are %.3g "
                          "tolerances away%s; the largest violation is %.3g, in row %" PetscInt_FMT
                          ". Give consistent values, or use -ts_hhtdae_start project.\n",
                          (double)ts->ptime, I.stat.restarts > 1 ? "" : "initial ", what, (double)e, unit, (double)value, row));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckPositions(TS ts, PetscBool *current)
{
  Integrator     &I = Get(ts);
  PetscReal       e = PETSC_MAX_REAL, last, value = 0, e0 = 0, worst = 0;
  PetscInt        row = 0, worst_row = 0;
  const PetscBool project = (PetscBool)(I.start_policy == TSHHT3_START_PROJECT);

  PetscFunctionBegin;
  for (int it = 0; it < 20; it++) {
    last = e;
    PetscCall(StartMatrix(ts, ts->ptime, I.U0, I.V0));
    PetscCall(EvaluateResidual(ts, ts->ptime, I.U0, I.V0, I.A1, I.gamma));
    PetscCall(HolonomicRows(I, I.gamma, I.work));
    PetscCall(SolveStart(ts, I.work, I.X));
    PetscCall(Distance(ts, I.X, 1, &e));
    PetscCall(WorstRow(ts, I.work, &row, &value));
    if (it == 0) {
      e0        = e;
      worst     = value;
      worst_row = row;
    }
    *current = PETSC_TRUE;
    if (!project || e == 0 || e >= 0.5 * last) break;
    PetscCall(Move(I, I.U0, I.X));
    *current = PETSC_FALSE;
  }
  PetscCall(Report(ts, "positions", "", e0, worst_row, worst, project));
  if (project && e > 1e-3)
    SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG,
            "The initial positions cannot be projected on the constraints: after the last correction row %" PetscInt_FMT
            " is still violated by %g. Check that the mechanism can be assembled.", row, (double)value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckVelocities(TS ts, PetscBool project, PetscReal *e, PetscInt *row, PetscReal *value)
{
  Integrator &I = Get(ts);
  PetscReal   T;

  PetscFunctionBegin;
  PetscCall(TimeScale(ts, &T));
  PetscCall(ConstraintDerivatives(ts, ts->ptime, I.U0, I.V0, T, I.work, NULL));
  PetscCall(SolveStart(ts, I.work, I.X));
  PetscCall(Distance(ts, I.X, T, e));
  PetscCall(WorstRow(ts, I.work, row, value));
  if (project) PetscCall(Move(I, I.V0, I.X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* A time over which the motion changes q by as much as its tolerance refers to: min Y_i/|q'_i|, at most the whole run */
PetscErrorCode TimeScale(TS ts, PetscReal *T)
{
  Integrator        &I = Get(ts);
  PetscReal local = 0, rate;

  PetscFunctionBegin;
  const PetscReal least = PetscMax(ts->rtol > 0 && !ts->vatol && !ts->vrtol ? ts->atol / ts->rtol : 1, 1e-8);
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar v, PetscScalar y) {
      if (IsCoordinate(I, i)) local = PetscMax(local, PetscAbsScalar(v) / PetscMax(PetscRealPart(y), least));
    },
    Read(I.V0), Read(I.ymax)));
  PetscCallMPI(MPI_Allreduce(&local, &rate, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)ts)));
  /* not what is left of the run: differences over next to nothing are rounding */
  const PetscReal span = ts->max_time < PETSC_MAX_REAL / 2 && ts->max_time > I.t_begin ? ts->max_time - I.t_begin : 1;
  *T                   = rate > 0 ? PetscMin(1 / rate, span) : span;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First and second time derivatives of the constraint rows along U + tau V, t + tau, at tau = 0: Phi' and Phi'' of
   holonomic rows, Psi and Psi' of velocity-level ones. Other rows are zero. Either output may be NULL. */
PetscErrorCode ConstraintDerivatives(TS ts, PetscReal t, Vec U, Vec V, PetscReal T, Vec first, Vec second)
{
  Integrator        &I = Get(ts);
  Vec                Ut, F, zero;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(U, &n));
  PetscCall(VecDuplicate(U, &Ut));
  PetscCall(VecDuplicate(U, &F));
  PetscCall(VecDuplicate(U, &zero));
  PetscCall(VecZeroEntries(zero));
  std::vector<PetscReal> f0(n), s1(n), s2(n);
  Refined                d1(n), d2(n);
  for (int level = 0; level < levels; level++) {
    const PetscReal tau = 0.1 * T * PetscPowRealInt(0.25, level);
    for (int j = 0; j < points; j++) {
      if (j > 0 || level == 0) {
        PetscCall(VecWAXPY(Ut, j * tau, V, U));
        PetscCall(EvaluateResidual(ts, t + j * tau, Ut, V, zero, F));
      }
      PetscCall(ForEntries(
        [&](PetscInt i, PetscScalar f) {
          if (j == 0 && level == 0) f0[i] = PetscRealPart(f);
          const PetscReal x = j ? PetscRealPart(f) : f0[i];
          s1[i]             = (j ? s1[i] : 0) + first_weights[j] * x;
          s2[i]             = (j ? s2[i] : 0) + second_weights[j] * x;
        },
        Read(F)));
    }
    for (PetscInt i = 0; i < n; i++) {
      if (!IsConstraint(I, i)) continue;
      d1.take(i, level, s1[i] / tau);
      d2.take(i, level, s2[i] / (tau * tau));
    }
  }
  for (int order = 1; order <= 2; order++) {
    Vec out = order == 1 ? first : second;
    if (!out) continue;
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar &g) {
        g = 0;
        if (!IsConstraint(I, i)) return;
        if (I.role[i] == TSHHT3_HOLONOMIC) g = order == 1 ? d1.best[i] : d2.best[i];
        else g = order == 1 ? f0[i] : d1.best[i];
      },
      Write(out)));
  }
  PetscCall(VecDestroy(&zero));
  PetscCall(VecDestroy(&F));
  PetscCall(VecDestroy(&Ut));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Measures, reports and by choice mends U0, V0. *matrix_is_current: the start's matrix has been made at the final U0. */
PetscErrorCode CheckInitialState(TS ts, PetscBool *matrix_is_current)
{
  Integrator     &I       = Get(ts);
  const PetscBool project = (PetscBool)(I.start_policy == TSHHT3_START_PROJECT);
  PetscReal       e, value;
  PetscInt        row;

  PetscFunctionBegin;
  *matrix_is_current = PETSC_FALSE;
  if (!I.constraints() || I.start_policy == TSHHT3_START_OFF) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckPositions(ts, matrix_is_current));
  if (!*matrix_is_current) PetscCall(StartMatrix(ts, ts->ptime, I.U0, I.V0));
  PetscCall(CheckVelocities(ts, project, &e, &row, &value));
  PetscCall(Report(ts, "velocities", " (times the time scale of the motion)", e, row, value, project));
  /* the rows of velocity-level constraints may depend on q' */
  *matrix_is_current = (PetscBool)(!I.count[TSHHT3_NONHOLONOMIC] || !project);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* V0 to the nearest velocities that the constraints allow; makes the start's matrix at U0 */
PetscErrorCode ProjectVelocities(TS ts)
{
  PetscReal e, value;
  PetscInt  row;

  PetscFunctionBegin;
  PetscCall(StartMatrix(ts, ts->ptime, Get(ts).U0, Get(ts).V0));
  PetscCall(CheckVelocities(ts, PETSC_TRUE, &e, &row, &value));
  PetscCall(PetscInfo(ts, "velocities moved by %g of the tolerance\n", (double)e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
