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
  by X in D_c. Nothing is divided by h: for h -> 0 it tends to [M Phi_q^T; Phi_q 0], the matrix of consistent.cpp.
*/
#include "integrator/entries.h"
#include "equations.h"
#include "jacobian.h"
#include "integrator/proofs/proofs.h"
#include "integrator/coordinates/rotations.h"
#include "solver.h"
#include "integrator/step/stage.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

Scales StepScales(const Integrator &I)
{
  const PetscReal h = I.h;
  const Parameters &p = I.p;
  return {ShiftV(p, h),       ShiftA(p, h), ScalePosition(p, h), ScaleState(p, h), 1 / ScalePosition(p, h),
          1 / ScaleVelocity(p, h)};
}

/* Definitions of V and F that use q'' need the true one, where (9a) evaluates at q''/(1+alpha): a second evaluation, made
   only for problems that have such definitions */
PetscErrorCode TrueAccelerationRows(TS ts, Vec X, Vec F)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, X, I.work));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar g, PetscScalar &f) { if (!IsCoordinate(I, i)) f = g; }, Read(I.work), Write(F)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* d[i] = value of the role of i; roles in the order of TSHHT3Role */
PetscErrorCode FillByRole(const Integrator &I, const PetscReal (&value)[TSHHT3_NUM_ROLES], Vec d)
{
  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar &x) { x = value[I.role[i]]; }, Write(d)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (9b) and its velocity-level sibling: F times D_r, which is 1 in all rows but those of constraints */
PetscErrorCode ScaleResidual(const Integrator &I, Vec F)
{
  const Scales s = StepScales(I);

  PetscFunctionBegin;
  PetscCall(ForSome(I.constrained, [&](PetscInt i, PetscScalar &f) { f *= RoleOf(I, i) == TSHHT3_HOLONOMIC ? s.holonomic : s.velocity; }, Write(F)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of definitions that use q'', in the paper's form: d q''/d a is 1 there and ca in the equations of motion */
PetscErrorCode TrueAccelerationMatrix(TS ts, Vec X, Mat P)
{
  Integrator     &I = Get(ts);
  const Scales    s = StepScales(I);
  const PetscReal sa = 1 / ScalePosition(I.p, I.h);

  PetscFunctionBegin;
  if (!I.second) PetscCall(MatDuplicate(P, MAT_DO_NOT_COPY_VALUES, &I.second));
  PetscCall(EvaluateJacobian(ts, I.t1, I.U1, I.V1, X, s.sv, sa, I.second, I.second));
  for (int motion = 1; motion >= 0; motion--) { /* keep the rows of motion of P, the others of I.second */
    PetscCall(ForEntries([&](PetscInt i, PetscScalar &r) { r = IsCoordinate(I, i) == (motion == 1) ? 1 : 0; }, Write(I.work)));
    PetscCall(MatDiagonalScale(motion ? P : I.second, I.work, NULL));
  }
  PetscCall(MatAXPY(P, 1, I.second, SAME_NONZERO_PATTERN));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode TakeRoles(const Integrator &I, Vec x, std::initializer_list<TSHHT3Role> roles, Vec to)
{
  bool taken[TSHHT3_NUM_ROLES] = {};

  PetscFunctionBegin;
  for (TSHHT3Role r : roles) taken[r] = true;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar from, PetscScalar &y) { y = taken[RoleOf(I, i)] ? from : 0; }, Read(x), Write(to)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D_r A D_c, in place; matrix-free operators that PETSc makes from our own residual are in these units already (MATMFFD). Products of the
   application's (MATSHELL) are not. */
PetscErrorCode ScaleMatrix(Integrator &I, const Scales &s, Mat A)
{
  PetscBool mffd, triangle;
  WorkVec   row, col;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)A, MATMFFD, &mffd));
  if (mffd) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LinearStoresTriangle(A, &triangle));
  if (I.coordinatesAlone()) PetscCall(MatScale(A, s.coordinate));
  else {
    PetscCall(row.like(I.U0, I.spare));
    PetscCall(col.like(I.U0, I.spare));
    PetscCall(FillByRole(I, {1, 1, s.holonomic, s.velocity, 1, 1}, row));
    PetscCall(FillByRole(I, {s.coordinate, s.state, 1, 1, 1, 1}, col));
    if (triangle) PetscCall(ScaleTriangle(A, row, col));
    else PetscCall(MatDiagonalScale(A, row, col));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An operator J beside P. A shell multiplies with all the scalings that it was given since it was assembled last, which an application
   need not do: so it is assembled here (MatrixTypes.Operators). */
static PetscErrorCode ScaleOperator(Integrator &I, const Scales &s, Mat J)
{
  PetscObjectState state;
  PetscBool        shell;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)J, MATSHELL, &shell));
  PetscCall(PetscObjectStateGet((PetscObject)J, &state));
  if (!shell && state == I.scaled_operator) PetscFunctionReturn(PETSC_SUCCESS); /* one that never changes */
  if (shell) {
    PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(ScaleMatrix(I, s, J));
  PetscCall(PetscObjectStateGet((PetscObject)J, &I.scaled_operator));
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
  PetscCall(TellPositions(P, U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f_n of (9a), everything but the inertia forces at t_n, if the form needs it. A1 serves as work space. */
PetscErrorCode HistoryForces(TS ts, PetscReal t)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (!I.F0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecZeroEntries(I.A1));
  PetscCall(EvaluateResidual(ts, t, I.U0, I.V0, I.A1, I.F0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FormFunction(SNES, Vec X, Vec F, TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(StageVectors(ts, X));
  PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, I.A1, F));
  if (I.F0) {
    if (I.definitions_use_acceleration) PetscCall(TrueAccelerationRows(ts, X, F));
    const PetscReal w = -I.alpha / (1 + I.alpha); /* (9a): what the average takes from t_n. f_n is evaluated once per step, at the end of the last one */
    PetscCall(ForEntries([&](PetscInt i, PetscScalar f0, PetscScalar &f) { if (IsCoordinate(I, i)) f += w * f0; }, Read(I.F0), Write(F)));
  }
  if (I.constraints()) PetscCall(ScaleResidual(I, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* SNES asks for it only when the reuse ladder (corrector.cpp) or the user's -snes_lag_jacobian says so */
PetscErrorCode FormJacobian(SNES snes, Vec X, Mat J, Mat P, TS ts)
{
  Integrator      &I = Get(ts);
  const Scales     s = StepScales(I);
  PetscObjectState state;
  KSP              ksp;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.matrix, ts, 0, 0, 0));
  PetscCall(StageVectors(ts, X));
  I.rotations.factor = RotationFactor(I);
  const PetscErrorCode failed = EvaluateJacobian(ts, I.t1, I.U1, I.V1, I.A1, s.sv, s.sa, J, P);
  if (failed) I.rotations.factor = 0;
  PetscCall(failed);
  PetscCall(PetscObjectStateGet((PetscObject)P, &state));
  if (state != I.linear.scaled) { /* an application whose matrix never changes may have left our scaled one in place */
    if (I.F0 && I.definitions_use_acceleration) PetscCall(TrueAccelerationMatrix(ts, X, P));
    PetscCall(ScaleMatrix(I, s, P));
    PetscCall(PetscObjectStateGet((PetscObject)P, &I.linear.scaled));
  }
  if (J != P) PetscCall(ScaleOperator(I, s, J));
  I.rotations.factor = 0;
  PetscCall(NoteStiffness(ts, X, P));
  I.corrector.matrix.made(EffectiveStep(I));
  I.stat.factorizations++;

  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(ChooseSolver(ksp, P, &I.linear));
  PetscCall(Factor(ts, ksp, J, P, &I.linear));
  if (I.linear.failed) PetscCall(SNESSetJacobianDomainError(snes));
  PetscCall(PetscLogEventEnd(events.matrix, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
