/* Why no consistent accelerations and multipliers can be had: constraints that depend on one another, or what else makes the matrix of the start singular. */
#include "integrator/equations/rows.h"
#include "integrator/equations/solver.h"
#include "start.h"
#include <string>

namespace hht3
{

PetscErrorCode NameRedundant(TS ts)
{
  Integrator           &I = Get(ts);
  IS                    multipliers;
  std::vector<PetscInt> list(I.constrained);
  PetscInt              start, n = 0, rows[20];
  Mat                   P;
  RowLabel              label;
  constexpr PetscInt max_named_rows = 4;
  std::string           text, names;
  PetscBool             is_singular;
  MatSolverType         package;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(RefuseNoNumbers(ts, P));
  PetscCall(MatrixIsSingular(ts, &is_singular));
  if (!is_singular) PetscCall(ExplainLinearFailure(ts, ts->ptime, 0));
  PetscCheck(is_singular, PetscObjectComm((PetscObject)ts), PETSC_ERR_NOT_CONVERGED,
             "No consistent accelerations and multipliers were found: %s. %s; without -ksp_type and -pc_type it is factored directly", I.failure,
             I.constraints() ? "The matrix [M Phi_q^T; Phi_q 0] is indefinite" : "The solver has not solved with the matrix of the start, M");
  PetscCall(VecGetOwnershipRange(I.X, &start, NULL));
  for (PetscInt &i : list) i += start;
  if (I.constraints()) {
    PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)ts), (PetscInt)list.size(), list.data(), PETSC_COPY_VALUES, &multipliers));
    PetscCall(LinearNameDependent(P, multipliers, 20, &n, rows));
    PetscCall(ISDestroy(&multipliers));
  }
  for (PetscInt i = 0; i < n; i++) {
    text += (i ? ", " : "") + std::to_string(rows[i]);
    if (!I.names.name || i >= max_named_rows) continue;
    PetscCall(LabelRow(ts, rows[i], &label));
    names += std::string(i ? ", " : " Rows ") + label.text;
  }
  if (n == 1) PetscCall(LabelRow(ts, rows[0], &label));
  PetscCheck(n != 1, PetscObjectComm((PetscObject)ts), PETSC_ERR_MAT_LU_ZRPVT,
             "The matrix [M Phi_q^T; Phi_q 0] is singular at t = %g: no coordinate that can move changes the constraint in row %s. It depends on time alone, or has no derivatives here", (double)ts->ptime, label.text);
  PetscCheck(!n, PetscObjectComm((PetscObject)ts), PETSC_ERR_MAT_LU_ZRPVT,
             "The matrix [M Phi_q^T; Phi_q 0] is singular at t = %g: the constraints in rows %s depend on one another. Remove the redundant ones.%s%s", (double)ts->ptime, text.c_str(),
             names.c_str(), I.names.name && n > max_named_rows ? ", ..." : "");
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
