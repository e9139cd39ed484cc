/*
  The matrix of the SNES and who fills it: the application's I2Jacobian, or differences of its residual where it has none or the user
  asked for them. PETSc's own differences (-snes_fd, -snes_fd_color, -ts_fd_color) would difference the step's residual by the step's
  unknowns, rounding of q divided by beta h^2 included, and not at all in the start: ours take their place.
*/
#include "integrator/step/corrector.h"
#include "integrator/step/dense.h"
#include "jacobian.h"
#include "integrator/type/settings.h"
#include "solver.h"
#include <algorithm>
#include <petscdm.h>
#include <petscdmshell.h>

namespace hht3
{

namespace
{

/* Whether the application has a Jacobian, the user's wish for differences, and whether their pattern is to be found, too */
PetscErrorCode WhoFillsMatrix(DM dm, bool *has, bool *wanted, bool *pattern)
{
  DMTS   tdm;
  DMSNES sdm;

  PetscFunctionBegin;
  PetscCall(DMGetDMTS(dm, &tdm));
  PetscCall(DMGetDMSNES(dm, &sdm));
  *has     = tdm->ops->i2jacobian || tdm->ops->ijacobian;
  *pattern = sdm->ops->computejacobian == SNESComputeJacobianDefault;
  *wanted  = *pattern || sdm->ops->computejacobian == SNESComputeJacobianDefaultColor || tdm->ops->ijacobian == TSComputeIJacobianDefaultColor;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetUpDifferences(TS ts, DM dm, Mat P, PetscBool shell)
{
  SNES            snes = ts->snes;
  const PetscBool mine = (PetscBool)!P;

  PetscFunctionBegin;
  if (!P && !shell) PetscCall(DMCreateMatrix(dm, &P));
  PetscCall(DifferencesCreate(ts, &P));
  PetscCall(HooksJacobian(ts));
  if (mine) {
    PetscCall(SNESSetJacobian(snes, P, P, NULL, NULL));
    PetscCall(MatDestroy(&P));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A SNES that came by TSSetSNES() has a DM that makes no vectors: it takes that of the TS. With a function of the program's own it keeps its DM, and is refused. */
PetscErrorCode ShareDM(SNES snes, DM dm)
{
  DMSNES own;

  PetscFunctionBegin;
  if (!snes->dmAuto) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DMGetDMSNES(snes->dm, &own));
  if (!own->ops->computefunction || own->ops->computefunction == SNESTSFormFunction) PetscCall(SNESSetDM(snes, dm)); /* FrontDoor.ASNESOfTheProgram */
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode SetUpJacobian(TS ts)
{
  DM        dm;
  SNES      snes;
  Mat       J, P;
  PetscBool shell;
  bool      has = false, wanted = false, pattern = false;

  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(HooksTakeOver(ts, snes));
  PetscCall(TSGetDM(ts, &dm));
  PetscCall(ShareDM(snes, dm));
  PetscCall(WhoFillsMatrix(dm, &has, &wanted, &pattern));
  PetscCall(SNESGetJacobian(snes, &J, &P, NULL, NULL));
  PetscCall(PetscObjectTypeCompare((PetscObject)dm, DMSHELL, &shell));
  if (has && !wanted) {
    if (P) PetscFunctionReturn(PETSC_SUCCESS);
    if (shell) PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL)); /* that of the TS itself makes none, one of the application may */
    const PetscErrorCode none = DMCreateMatrix(dm, &P);
    if (shell) PetscCall(PetscPopErrorHandler());
    PetscCheck(!shell || !none, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE,
               "The SNES of the TS has no matrix, and the TS has no DM that makes one: TSSetI2Jacobian() was given a function without a matrix, or another TS with the same SNES was reset");
    PetscCall(none);
    PetscCall(SNESSetJacobian(snes, J ? J : P, P, NULL, NULL));
    PetscCall(MatDestroy(&P));
  } else if (!Get(ts).differences) {
    PetscBool dense = PETSC_FALSE; /* it tells no pattern; another type of TS without a Jacobian has left it */
    if (P) PetscCall(PetscObjectTypeCompareAny((PetscObject)P, &dense, MATSEQDENSE, MATMPIDENSE, ""));
    if (dense) P = NULL;
    PetscCall(SetUpDifferences(ts, dm, pattern ? NULL : P, pattern ? PETSC_TRUE : shell));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GivesRows(Mat A, PetscBool *yes)
{
  PetscBool foreign;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(A, MATOP_GET_ROW, yes));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)A, &foreign, MATMFFD, MATSHELL, MATNEST, MATMPIDENSE, ""));
  if (foreign) *yes = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LocalValues(Mat P, bool triangle, std::vector<PetscScalar> &val, std::vector<PetscInt> &col, std::vector<PetscInt> &offset)
{
  PetscInt           start, end, nc;
  const PetscInt    *c;
  const PetscScalar *v;

  PetscFunctionBegin;
  val.clear();
  col.clear();
  offset.assign(1, 0);
  PetscCall(MatGetOwnershipRange(P, &start, &end));
  PetscCall(MatGetRowUpperTriangular(P)); /* nothing but with MATSBAIJ, whose blocks on the diagonal are whole */
  for (PetscInt i = start; i < end; i++) {
    PetscCall(MatGetRow(P, i, &nc, &c, &v));
    const PetscInt from = triangle ? (PetscInt)(std::lower_bound(c, c + nc, i) - c) : 0;
    col.insert(col.end(), c + from, c + nc);
    val.insert(val.end(), v + from, v + nc);
    offset.push_back((PetscInt)val.size());
    PetscCall(MatRestoreRow(P, i, &nc, &c, &v));
  }
  PetscCall(MatRestoreRowUpperTriangular(P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetLocalValues(Mat P, const std::vector<PetscScalar> &val, const std::vector<PetscInt> &col, const std::vector<PetscInt> &offset)
{
  PetscInt start;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(P, &start, NULL));
  for (PetscInt i = 0; i + 1 < (PetscInt)offset.size(); i++) {
    const PetscInt row = start + i;
    PetscCall(MatSetValues(P, 1, &row, offset[i + 1] - offset[i], col.data() + offset[i], val.data() + offset[i], INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A row of the matrix is that of the unknown on the same rank. Of the first rank where it is not the message tells. */
static PetscErrorCode CheckLayout(TS ts, Mat A, const char *what)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)ts);
  PetscInt       n[5];
  PetscMPIInt    rank, size, first;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(ts->vec_sol, &n[0]));
  PetscCall(VecGetSize(ts->vec_sol, &n[1]));
  PetscCall(MatGetLocalSize(A, &n[2], &n[3]));
  PetscCall(MatGetSize(A, &n[4], NULL));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  const PetscMPIInt other = n[0] != n[2] || n[0] != n[3] ? rank : size;
  PetscCallMPI(MPI_Allreduce(&other, &first, 1, MPI_INT, MPI_MIN, comm));
  if (first == size) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Bcast(n, 5, MPIU_INT, first, comm));
  SETERRQ(comm, PETSC_ERR_ARG_SIZ,
          "The %s of TSSetI2Jacobian() is distributed otherwise than the solution: on rank %d it has %" PetscInt_FMT " rows and %" PetscInt_FMT " columns of %" PetscInt_FMT ", and the solution %" PetscInt_FMT " entries of %" PetscInt_FMT ". Make it with the local sizes of the solution (VecGetLocalSize(), MatSetSizes())",
          what, (int)first, n[2], n[3], n[4], n[0], n[1]);
}

/* The rows of P tell roles, symmetry and what a factorization costs; an operator has to take the scalings of rows and columns */
PetscErrorCode CheckMatrices(TS ts)
{
  Mat       J, P;
  MatType   type;
  PetscBool rows, mffd, shell, scales, scales_all;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, &J, &P, NULL, NULL));
  if (!P) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetType(P, &type));
  PetscCall(GivesRows(P, &rows));
  PetscCheck(rows, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP,
             "The matrix (Pmat of TSSetI2Jacobian()) is of type %s, which gives no rows: TSHHT3 needs an assembled one there, of type %s, %s, %s or, on one rank, %s. A matrix-free product may be the operator (Amat) beside it",
             type, MATAIJ, MATBAIJ, MATSBAIJ, MATDENSE);
  PetscCall(CheckLayout(ts, P, "matrix (Pmat)"));
  if (!J || J == P) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckLayout(ts, J, "operator (Amat)"));
  PetscCall(MatGetType(J, &type));
  PetscCall(PetscObjectTypeCompare((PetscObject)J, MATMFFD, &mffd));
  PetscCall(PetscObjectTypeCompare((PetscObject)J, MATSHELL, &shell));
  PetscCall(MatHasOperation(J, MATOP_DIAGONAL_SCALE, &scales));
  PetscCall(MatHasOperation(J, MATOP_SCALE, &scales_all));
  PetscCheck(mffd || (scales && scales_all), PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP,
             "The operator (Amat of TSSetI2Jacobian()) is of type %s without MatScale() and MatDiagonalScale(), by which TSHHT3 scales the Newton matrix: %s, or give the assembled matrix twice",
             type, shell ? "leave out MatShellSetManageScalingShifts()" : "give it both operations (of a MATPYTHON the methods scale and diagonalScale)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the SNES needs to solve with the matrix */
PetscErrorCode SetUpSolvers(TS ts)
{
  KSP ksp;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(SolverDefaults(ts, ksp)); /* what the program has set since TSSetFromOptions(), or without it */
  PetscCall(CorrectorSetUp(ts));
  PetscCall(NoteMatrices(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{

PetscErrorCode IdsOfMatrices(TS ts, PetscObjectId id[2])
{
  Mat A[2];

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, &A[0], &A[1], NULL, NULL));
  for (int k = 0; k < 2; k++) {
    id[k] = 0;
    if (A[k]) PetscCall(PetscObjectGetId((PetscObject)A[k], &id[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 0 of what has no values of its own: the application's product may change as it likes */
PetscErrorCode StatesOfMatrices(TS ts, PetscObjectState state[2])
{
  Mat       A[2];
  PetscBool rows;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, &A[0], &A[1], NULL, NULL));
  for (int k = 0; k < 2; k++) {
    state[k] = 0;
    if (!A[k]) continue;
    PetscCall(GivesRows(A[k], &rows));
    if (rows) PetscCall(PetscObjectStateGet((PetscObject)A[k], &state[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* After a correction, too: -snes_mf_operator has SNES exchange the operator in the first one */
PetscErrorCode NoteMatrices(TS ts)
{
  PetscFunctionBegin;
  PetscCall(IdsOfMatrices(ts, Get(ts).hooks.matrices));
  PetscCall(StatesOfMatrices(ts, Get(ts).hooks.values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A monitor has evaluated the Jacobian, or another TS has the same matrix (Hooks.MonitorsThatEvaluateTheJacobian) */
PetscErrorCode HasForeignValues(TS ts, PetscBool *yes)
{
  const Hooks     &H = Get(ts).hooks;
  PetscObjectState state[2];

  PetscFunctionBegin;
  PetscCall(StatesOfMatrices(ts, state));
  *yes = (PetscBool)(H.values[1] && (state[0] != H.values[0] || state[1] != H.values[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ForgetForeignMatrix(TS ts)
{
  Integrator &I = Get(ts);
  PetscBool   foreign;

  PetscFunctionBegin;
  if (!I.corrector.matrix.have) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HasForeignValues(ts, &foreign));
  if (!foreign) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "someone else has put values into the Newton matrix: it is made anew\n"));
  I.corrector.matrix.forget();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Since the last step the user has given the TS another SNES, another matrix or other options, or lent its SNES to another TS */
PetscErrorCode IsAnotherSNES(TS ts, bool *yes)
{
  const Hooks  &H = Get(ts).hooks;
  PetscObjectId id[2];

  PetscFunctionBegin;
  PetscCall(IdsOfMatrices(ts, id));
  *yes = ts->snes != H.snes || id[0] != H.matrices[0] || id[1] != H.matrices[1] || !id[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where IsAnotherSNES() */
PetscErrorCode TakeSNES(TS ts)
{
  Integrator   &I = Get(ts);
  PetscObjectId id[2];

  PetscFunctionBegin;
  PetscCall(IdsOfMatrices(ts, id));
  if (id[0] != I.hooks.matrices[0]) I.scaled_operator = 0;
  if (id[1] != I.hooks.matrices[1]) I.linear.scaled = 0;
  PetscCall(HooksRemove(ts));
  PetscCall(SNESSetDM(ts->snes, ts->dm));
  I.linear.chosen         = PETSC_FALSE;
  I.corrector.matrix.have = PETSC_FALSE;
  PetscCall(DifferencesDestroy(ts));
  PetscCall(SamplerDestroy(I));
  PetscCall(MatDestroy(&I.second));
  PetscCall(SetUpJacobian(ts));
  PetscCall(CheckMatrices(ts));
  PetscCall(CheckTriangle(ts));
  PetscCall(SetUpSolvers(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
