/* Why no consistent accelerations and multipliers can be had, or no step: constraints that depend on one another, or what else makes the matrix of the start singular. */
#include "integrator/equations/equations.h"
#include "integrator/equations/rows.h"
#include "integrator/equations/solver.h"
#include "integrator/work_vec.h"
#include "start.h"
#include <string>

namespace hht3
{

namespace
{

constexpr PetscReal null_vector = 1e-9; /* |Phi_q^T lambda| of a redundant constraint, relative to |Phi_q| |lambda| */
/* The same where a mechanism locks: it falls as the square root of the time that is left. UnknownNames.OfAMotionThatLocks */
constexpr PetscReal locked = 1e-5;

/* Rows of constraints that depend on one another, some of them with their names */
struct Dependent {
  PetscInt    n = 0, row[20];
  std::string numbers, names;
};

PetscErrorCode FindDependent(TS ts, Mat P, PetscReal tolerance, Dependent *d)
{
  const Integrator     &I = Get(ts);
  IS                    multipliers;
  std::vector<PetscInt> list(I.constrained);
  PetscInt              start;
  constexpr PetscInt    max_named_rows = 4;

  PetscFunctionBegin;
  if (!I.constraints()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetOwnershipRange(I.X, &start, NULL));
  for (PetscInt &i : list) i += start;
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)ts), (PetscInt)list.size(), list.data(), PETSC_COPY_VALUES, &multipliers));
  PetscCall(LinearNameDependent(P, multipliers, tolerance, PETSC_STATIC_ARRAY_LENGTH(d->row), &d->n, d->row));
  PetscCall(ISDestroy(&multipliers));
  for (PetscInt i = 0; i < d->n; i++) {
    RowLabel label;
    d->numbers += (i ? ", " : "") + std::to_string(d->row[i]);
    if (!I.names.name || i >= max_named_rows) continue;
    PetscCall(LabelRow(ts, d->row[i], &label));
    d->names += std::string(i ? ", " : " Rows ") + label.text;
  }
  if (I.names.name && d->n > max_named_rows) d->names += ", ...";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first of the rows that depends on time itself, as that of a motion does: -1 if there is none. All others have the same value at another time, to the bit. */
PetscErrorCode FindRheonomic(TS ts, const Dependent &d, PetscInt *row)
{
  const Integrator  &I = Get(ts);
  PetscReal          T;
  PetscInt           start, end, first = d.n;
  WorkVec            now, later;
  const PetscScalar *a, *b;

  PetscFunctionBegin;
  PetscCall(now.like(I.X));
  PetscCall(later.like(I.X));
  PetscCall(TimeScaleOfConstraints(ts, I.V0, &T));
  PetscCall(EvaluateResidual(ts, ts->ptime, I.U0, I.V0, I.A0, now));
  PetscCall(EvaluateResidual(ts, ts->ptime + T, I.U0, I.V0, I.A0, later));
  PetscCall(VecGetOwnershipRange(now, &start, &end));
  PetscCall(VecGetArrayRead(now, &a));
  PetscCall(VecGetArrayRead(later, &b));
  for (PetscInt i = d.n - 1; i >= 0; i--)
    if (d.row[i] >= start && d.row[i] < end && a[d.row[i] - start] != b[d.row[i] - start]) first = i;
  PetscCall(VecRestoreArrayRead(later, &b));
  PetscCall(VecRestoreArrayRead(now, &a));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &first, 1, MPIU_INT, MPI_MIN, PetscObjectComm((PetscObject)ts)));
  *row = first < d.n ? d.row[first] : -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode ExplainLock(TS ts, std::string *text)
{
  Mat       P;
  PetscBool has_rows, numbers = PETSC_FALSE;
  PetscInt  driven = -1;
  Dependent d;
  RowLabel  label;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(MatHasOperation(P, MATOP_GET_ROW, &has_rows));
  if (has_rows) PetscCall(MatrixHasNumbers(P, &numbers));
  if (numbers) PetscCall(FindDependent(ts, P, locked, &d));
  if (d.n < 2) PetscFunctionReturn(PETSC_SUCCESS);
  *text = " There the constraints in rows " + d.numbers + " nearly depend on one another, as where a mechanism locks";
  PetscCall(FindRheonomic(ts, d, &driven));
  PetscCall(LabelRow(ts, driven, &label));
  *text += driven < 0 ? "." + d.names : std::string("; row ") + label.text + " depends on time, and the others may not allow what it prescribes.";
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode NameRedundant(TS ts)
{
  Integrator   &I = Get(ts);
  Dependent     d;
  Mat           P;
  RowLabel      label;
  PetscBool     is_singular;
  MatSolverType package;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(RefuseNoNumbers(ts, P));
  PetscCall(MatrixIsSingular(ts, &is_singular));
  if (!is_singular) PetscCall(ExplainLinearFailure(ts, ts->ptime, 0));
  PetscCheck(is_singular, PetscObjectComm((PetscObject)ts), PETSC_ERR_NOT_CONVERGED,
             "No consistent accelerations and multipliers were found: %s. %s; without -ksp_type and -pc_type it is factored directly", I.failure,
             I.constraints() ? "The matrix [M Phi_q^T; Phi_q 0] is indefinite" : "The solver has not solved with the matrix of the start, M");
  PetscCall(FindDependent(ts, P, null_vector, &d));
  if (d.n == 1) PetscCall(LabelRow(ts, d.row[0], &label));
  PetscCheck(d.n != 1, PetscObjectComm((PetscObject)ts), PETSC_ERR_MAT_LU_ZRPVT,
             "The matrix [M Phi_q^T; Phi_q 0] is singular at t = %g: no coordinate that can move changes the constraint in row %s. It depends on time alone, or has no derivatives here", (double)ts->ptime, label.text);
  PetscCheck(!d.n, PetscObjectComm((PetscObject)ts), PETSC_ERR_MAT_LU_ZRPVT,
             "The matrix [M Phi_q^T; Phi_q 0] is singular at t = %g: the constraints in rows %s depend on one another. Remove the redundant ones.%s", (double)ts->ptime, d.numbers.c_str(),
             d.names.c_str());
  PetscCall(FindDependent(ts, P, locked, &d));
  PetscCheck(!d.n, PetscObjectComm((PetscObject)ts), PETSC_ERR_MAT_LU_ZRPVT,
             "The matrix [M Phi_q^T; Phi_q 0] is singular at t = %g: the constraints in rows %s nearly depend on one another, as at a dead centre, where accelerations and multipliers are not determined.%s",
             (double)ts->ptime, d.numbers.c_str(), d.names.c_str());
  PetscCall(PackageInDoubt(ts, &package));
  PetscCheck(!package, PetscObjectComm((PetscObject)ts), PETSC_ERR_MAT_LU_ZRPVT,
             "%s has met a zero pivot in the matrix [M Phi_q^T; Phi_q 0] at t = %g, whose constraints do not depend on one another. The cause may be this package, as multipliers have zeros on the diagonal: "
             "-pc_factor_mat_solver_type mumps or klupair exchanges rows there. If that fails, too, look for a coordinate without mass that no constraint holds",
             package, (double)ts->ptime);
  SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_MAT_LU_ZRPVT,
          "The matrix [M Phi_q^T; Phi_q 0] is singular at t = %g, and not by dependent constraints: look for a coordinate without mass that no constraint holds, "
          "or a definition that does not determine its variable (-ts_view lists the roles)", (double)ts->ptime);
}

} // namespace hht3
