/*
  Accelerations, multipliers and whatever else is algebraic at given positions, velocities and time: in starts, after steps that are too
  short for the corrector, and between the ends of steps.

    M q'' + Phi_q^T lambda = Q,    Phi_q q'' + gamma = 0,    gamma = (Phi_q q')_q q' + 2 Phi_qt q' + Phi_tt   (6c)

  with velocity-level constraints differentiated once, and states, variables and force states by rows of their own. The matrix is (10) for
  h -> 0, [M Phi_q^T; Phi_q 0], so that neither stiffness nor damping stands in it and a few corrections solve the equations. They end where they are
  rounding, relative to the unknowns themselves: a tolerance there is none.

  With h > 0 the velocities and positions follow from the accelerations, by the implicit Euler method (transient.cpp).
*/
#include "consistent.h"
#include "integrator/step/corrector.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "integrator/random.h"
#include "integrator/equations/solver.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* Corrections relative to the unknowns: converged; and the largest that may be rounding where they no longer fall, also of what forces and constraints leave of their terms */
constexpr PetscReal converged_correction = 1e-10, rounding_correction = 1e-8;
constexpr PetscReal slow_rate            = 0.3; /* rate beyond which the matrix is made again at the iterate */
constexpr PetscInt  max_iterations       = 20;  /* at a rate of `slow_rate` 10 digits take 20 */

/* Rows of constraints of F: Phi_q q'' + gamma. The columns of states are left out, since gamma follows s along V. */
PetscErrorCode ConstraintRows(const Integrator &I, Consistent &c)
{
  PetscFunctionBegin;
  PetscCall(TakeRoles(I, c.X, {TSHHT3_COORDINATE}, c.d));
  PetscCall(MatMult(c.P, c.d, I.work));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar p, PetscScalar g, PetscScalar &f) { if (IsConstraint(I, i)) f = p + g; }, Read(I.work), Read(c.gamma), Write(c.F)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One correction of X, and its size relative to X, unless the solve failed on any rank */
PetscErrorCode CorrectUnknowns(TS ts, Consistent &c, PetscReal *e, PetscBool *ok)
{
  KSPConvergedReason reason;
  PetscReal          d, x;
  PetscInt           its;
  bool               failed;
  PetscBool          unanswered = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(KSPSolve(c.ksp, c.F, c.d));
  PetscCall(KSPGetIterationNumber(c.ksp, &its));
  PetscCall(KSPGetConvergedReason(c.ksp, &reason));
  Get(ts).stat.solves++;
  Get(ts).stat.newton++;
  c.its++;
  c.ksp_its += its;
  PetscCall(OnAnyRank(ts, reason < 0, &failed));
  if (!failed) PetscCall(VecAXPY(c.X, -1, c.d));
  PetscCall(VecNorm(c.d, NORM_2, &d));
  PetscCall(VecNorm(c.X, NORM_2, &x));
  if (ts->snes->ksp == c.ksp) PetscCall(SolveFoundNothing(ts, c.d, c.F, false, &unanswered));
  PetscCall(TakeUnknowns(Get(ts), c));
  *e  = x > 0 ? d / x : d;
  *ok = (PetscBool)(!failed && !unanswered && !PetscIsInfOrNanReal(d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether constraints hold and the residual in the equations of motion is nothing beside the forces there, or no more than rounding of coordinates makes: where accelerations
   are rounding of forces that balance each other, corrections are as large as the unknowns (SmallBodies.StartFromEquilibrium; without multipliers
   SceneEquilibrium.OfBodiesOnSprings) */
PetscErrorCode IsBalanced(TS ts, Consistent &c, PetscBool *yes)
{
  const Integrator &I = Get(ts);
  PetscReal         sum[5] = {0, 0, 0, 0, 0}; /* squares of: forces left, their terms, what rounding makes of them; constraints left, their terms */
  WorkVec           U, F, forces;

  PetscFunctionBegin;
  for (WorkVec *v : {&U, &F, &forces}) PetscCall(v->like(c.X));
  PetscCall(MatMult(c.P, c.X, forces));
  PetscCall(VecCopy(c.U, U));
  PetscCall(Shake(U, PETSC_MACHINE_EPSILON, 0, [&](PetscInt i) { return IsCoordinate(I, i); }));
  PetscCall(EvaluateResidual(ts, c.t, U, c.V, c.A, F));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar f, PetscScalar other, PetscScalar force, PetscScalar a, PetscScalar g) {
      const auto square = [](PetscScalar x) { return PetscRealPart(x * x); };
      if (IsConstraint(I, i)) sum[3] += square(f), sum[4] += square(g);
      else if (IsCoordinate(I, i)) sum[0] += square(f), sum[1] += square(force), sum[2] += square(other - f), sum[4] += square(a);
    },
    Read(c.F), Read(F), Read(forces), Read(c.X), Read(c.gamma ? c.gamma : c.X)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 5, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)c.P)));
  for (PetscReal &x : sum) x = PetscSqrtReal(x);
  *yes = (PetscBool)(sum[0] <= PetscMax(rounding_correction * sum[1], rounding_factor * sum[2]) && sum[3] <= rounding_correction * sum[4]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A rate on which no equation depends there, as that of a damper that is out of contact, has h C alone in its column and would become rounding over h: it is zero
   (Start.RatesThatMeanNothingAtFirst). none: F at first, then 1 where that is so. */
PetscErrorCode LeaveRates(TS ts, Consistent &c, Vec none)
{
  const Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (!I.count[TSHHT3_STATE]) PetscFunctionReturn(PETSC_SUCCESS);
  if (c.its == 0) PetscCall(VecCopy(c.F, none));
  if (c.its == 1)
    PetscCall(ForEntries([&](PetscInt i, PetscScalar f, PetscScalar d, PetscScalar x, PetscScalar &g) { g = RoleOf(I, i) == TSHHT3_STATE && f == g && PetscAbsScalar(d) > 0.5 * PetscAbsScalar(x); },
                         Read(c.F), Read(c.d), Read(c.X), Write(none)));
  if (c.its > 0) {
    PetscCall(ForEntries([&](PetscInt, PetscScalar g, PetscScalar &f, PetscScalar &x) { if (g != 0.) f = x = 0; }, Read(none), Write(c.F), Write(c.X)));
    PetscCall(TakeUnknowns(I, c));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* F at X */
PetscErrorCode ConsistentResidual(TS ts, Consistent &c)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (c.T > 0 && c.its) PetscCall(ConstraintDerivatives(ts, c.t, c.U, c.V, c.T, c.levels, NULL, c.gamma));
  PetscCall(EvaluateResidual(ts, c.t, c.U, c.V, c.A, c.F));
  if (c.gamma) PetscCall(ConstraintRows(I, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode TakeUnknowns(const Integrator &I, Consistent &c)
{
  const PetscReal h = c.h;

  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar x, PetscScalar &u, PetscScalar &v, PetscScalar &a) { UnknownOf(RoleOf(I, i), u, v, a) = x; },
    Read(c.X), Write(c.U), Write(c.V), Write(c.A)));
  if (h > 0)
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar x, PetscScalar u0, PetscScalar v0, PetscScalar &u, PetscScalar &v) {
        if (!IsCoordinate(I, i)) return;
        u = u0 + h * h * x;
        v = v0 + h * x;
      },
      Read(c.X), Read(c.begin[0]), Read(c.begin[1]), Write(c.U), Write(c.V)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix at U, V, A and its factors. An application whose matrix never changes may have left the scaled one in place. */
PetscErrorCode ConsistentMatrix(TS ts, Consistent &c, PetscBool *ok, const char **why)
{
  Integrator      &I = Get(ts);
  const PetscReal  h = c.h > 0 ? c.h : c.tiny;
  PetscObjectState state;
  PetscBool        numbers;

  PetscFunctionBegin;
  PetscCall(EvaluateJacobian(ts, c.t, c.U, c.V, c.A, 1 / h, 1 / (h * h), c.J ? c.J : c.P, c.P));
  PetscCall(PetscObjectStateGet((PetscObject)c.P, &state));
  if (state != c.linear->scaled) PetscCall(ScaleMatrix(I, {1 / h, 1 / (h * h), h * h, h, 1 / (h * h), 1 / h}, c.P));
  PetscCall(PetscObjectStateGet((PetscObject)c.P, &c.linear->scaled));
  PetscCall(MatrixHasNumbers(c.P, &numbers));
  if (c.near && numbers) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ChooseSolver(c.ksp, c.P, c.linear));
  PetscCall(Factor(ts, c.ksp, c.P, c.P, c.linear));
  I.stat.factorizations++;
  if (!numbers && !c.linear->failed) c.linear->failed = PC_FACTOR_OTHER;
  *ok  = (PetscBool)!c.linear->failed;
  *why = !numbers ? I.differences ? "the application's residual is not a number where the matrix is made by its differences" : "the application's Jacobian is not a number" : "the matrix is singular there, or the solver failed";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From now on */
static PetscErrorCode WithOwnFactors(Consistent &c)
{
  PetscFunctionBegin;
  if (c.near) PetscCall(KSPSetReusePreconditioner(c.ksp, PETSC_FALSE));
  c.near = false;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X, which enters as the guess, and with it U, V, A; *why: what was in the way if not *ok. c.linear->failed, where that was the linear solver. */
PetscErrorCode SolveConsistent(TS ts, Consistent &c, bool have_matrix, PetscBool *ok, const char **why)
{
  PetscReal e = 0, last, first = 0;
  PetscBool renew = (PetscBool)!have_matrix, other, balanced;
  WorkVec   none;

  PetscFunctionBegin;
  if (Get(ts).count[TSHHT3_STATE]) PetscCall(none.like(c.X));
  *ok = PETSC_TRUE;
  PetscCall(TakeUnknowns(Get(ts), c));
  for (c.its = c.ksp_its = 0; c.its < max_iterations;) {
    const PetscBool fresh = renew;
    if (renew) PetscCall(ConsistentMatrix(ts, c, ok, why));
    if (!*ok) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(ConsistentResidual(ts, c));
    PetscCall(CheckNumbers(ts, c.t, {c.F, c.U, c.V, c.A}, ok));
    *why = Get(ts).failure;
    if (!*ok) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(LeaveRates(ts, c, none));
    last = e;
    PetscCall(CorrectUnknowns(ts, c, &e, ok));
    PetscCall(LinearGiveUpKrylov(c.ksp, c.P, c.linear, &other));
    if (other) {
      *ok = renew = PETSC_TRUE;
      PetscCall(WithOwnFactors(c));
      continue;
    }
    *why = "the matrix is singular there, or the solver failed";
    if (!*ok) c.linear->failed = PC_SUBPC_ERROR;
    if (c.its == 1) first = e;
    else if (*ok && e <= c.enough * first) PetscFunctionReturn(PETSC_SUCCESS);
    const bool known = c.its > 1 && !fresh, falls = e <= slow_rate * last;
    if (!*ok || e <= converged_correction || (known && (falls ? CorrectorError(e / last, e) <= converged_correction : e <= rounding_correction))) PetscFunctionReturn(PETSC_SUCCESS);
    if (known && !falls) {
      PetscCall(IsBalanced(ts, c, &balanced));
      if (balanced) PetscFunctionReturn(PETSC_SUCCESS);
    }
    renew = (PetscBool)(c.its > 1 && !falls);
    if (renew) PetscCall(WithOwnFactors(c));
  }
  *ok  = PETSC_FALSE;
  *why = "the iteration does not converge";
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
