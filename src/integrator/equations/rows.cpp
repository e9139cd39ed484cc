/* Rows in messages: what the application calls them, and which of them are no numbers. */
#include "rows.h"
#include "integrator/entries.h"
#include "equations.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* The row's part in the equations, from the rank that has it. Collective */
PetscErrorCode RoleName(const Integrator &I, Vec F, PetscInt row, const char **name)
{
  static const char *const names[] = {"the equation of motion of a coordinate", "the equation of a first-order state", "a holonomic constraint", "a velocity-level constraint",
                                      "the definition of a variable", "the definition of a force state"};
  PetscInt                 start, end, role;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(F, &start, &end));
  role = row >= start && row < end ? RoleOf(I, row - start) : 0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &role, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)F)));
  *name = names[role];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FirstBad(Vec F, PetscInt *row)
{
  PetscFunctionBegin;
  PetscCall(FirstWhere([](PetscInt, PetscScalar f) { return PetscIsInfOrNanScalar(f); }, row, Read(F)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Nothing for a row < 0 */
PetscErrorCode LabelRow(TS ts, PetscInt row, RowLabel *label)
{
  const RowNames &names                          = Get(ts).names;
  char            name[sizeof(label->text) - 32] = "";

  PetscFunctionBegin;
  if (row < 0) PetscFunctionReturn(PETSC_SUCCESS);
  if (names.name) PetscCall((*names.name)(ts, row, name, sizeof(name), names.ctx));
  PetscCall(PetscSNPrintf(label->text, sizeof(label->text), name[0] ? "%" PetscInt_FMT " (%s)" : "%" PetscInt_FMT, row, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first row of the residual that is not a number, into I.failure; else it is the correction */
PetscErrorCode NameBadRow(TS ts, PetscReal t, Vec F)
{
  Integrator &I = Get(ts);
  PetscInt    row;
  RowLabel    label;
  const char *role = NULL;

  PetscFunctionBegin;
  PetscCall(FirstBad(F, &row));
  if (row >= 0) {
    PetscCall(LabelRow(ts, row, &label));
    PetscCall(RoleName(I, F, row, &role));
    PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "the application's residual is not a number at t = %g, first in row %s, %s", (double)t, label.text, role));
  } else {
    PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "a correction is not a number at t = %g", (double)t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first row of the matrix that is not a number, into I.failure */
PetscErrorCode NameBadMatrix(TS ts, PetscReal t, Mat P, PetscBool *bad)
{
  Integrator &I = Get(ts);
  PetscInt    row;
  RowLabel    label;
  WorkVec     x, y;

  PetscFunctionBegin;
  PetscCall(x.like(ts->vec_sol));
  PetscCall(y.like(ts->vec_sol));
  PetscCall(VecSet(x, 1));
  PetscCall(MatMult(P, x, y));
  PetscCall(FirstBad(y, &row));
  *bad = (PetscBool)(row >= 0);
  if (row < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LabelRow(ts, row, &label));
  PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "%s is not a number at t = %g, first in row %s",
                         I.differences ? "the application's residual, from whose differences the matrix comes," : "the application's Jacobian (TSSetI2Jacobian())", (double)t, label.text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RefuseBadMatrix(TS ts, Mat P)
{
  PetscBool bad;

  PetscFunctionBegin;
  PetscCall(NameBadMatrix(ts, ts->ptime, P, &bad));
  PetscCheck(!bad, PetscObjectComm((PetscObject)ts), PETSC_ERR_FP, "There is no start: %s", Get(ts).failure);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error where the residual of the start or its matrix P are no numbers: nothing else can be said of them */
PetscErrorCode RefuseNoNumbers(TS ts, Mat P)
{
  Integrator &I = Get(ts);
  PetscInt    row;
  WorkVec     A, F;

  PetscFunctionBegin;
  PetscCall(A.like(I.X));
  PetscCall(F.like(I.X));
  PetscCall(EvaluateResidual(ts, ts->ptime, I.U0, I.V0, A, F));
  PetscCall(FirstBad(F, &row));
  if (row >= 0) PetscCall(NameBadRow(ts, ts->ptime, F));
  PetscCheck(row < 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_FP, "There is no start: %s", I.failure);
  PetscCall(RefuseBadMatrix(ts, P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetRowName(TS ts, TSHHT3RowName name, void *ctx)
{
  PetscFunctionBegin;
  Get(ts).names = {name, ctx};
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@C
  TSHHT3SetRowName - Gives a function that names unknowns and their rows, for messages

  Logically Collective

  Input Parameters:
+ ts   - the `TS` context
. name - the function, or `NULL` for none
- ctx  - its context

  Calling sequence of name:
$ PetscErrorCode name(TS ts, PetscInt row, char name[], size_t len, void *ctx)
+ ts   - the `TS` context
. row  - global number of the row, also of another rank
. name - what it is called, such as "x of body rod"; empty on entry, and may stay so
. len  - room there, with the zero at the end
- ctx  - the context

  Level: advanced

  Note:
  Errors and warnings that tell of a row tell its name besides. The function is not called otherwise. Scenes name theirs.

.seealso: `TSHHT3`, `TSHHT3SetIS()`
@*/
PetscErrorCode TSHHT3SetRowName(TS ts, TSHHT3RowName name, void *ctx)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscTryMethod(ts, "TSHHT3SetRowName_C", (TS, TSHHT3RowName, void *), (ts, name, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}
