/*
  The Newton matrix in a checkpoint: the values of its rows, and what the solver keeps. It is not evaluated again, because the application
  may have gone on since: it may have taken other coordinates, or remember more. Only its pattern has to be there, and that takes an evaluation.
*/
#include "checkpoint_parts.h"
#include "integrator/equations/equations.h"
#include "integrator/equations/jacobian.h"
#include "linear/hash.h"
#include <cstdint>

namespace hht3
{

namespace
{

struct MatrixState {
  PetscBool there  = PETSC_FALSE; /* its values are in the file */
  PetscBool chosen = PETSC_FALSE; /* a linear solver was */
};

std::uint64_t PatternHash(const std::vector<PetscInt> &col, const std::vector<PetscInt> &offset)
{
  return Hash().add(col.data(), col.size() * sizeof(PetscInt)).add(offset.data(), offset.size() * sizeof(PetscInt)).sum;
}

PetscErrorCode SaveRows(Mat A, Archive &a)
{
  std::vector<PetscScalar> values;
  std::vector<PetscInt>    col, offset;

  PetscFunctionBegin;
  PetscCall(LocalValues(A, false, values, col, offset));
  std::uint64_t pattern = PatternHash(col, offset);
  a.plain(pattern);
  a.list(values);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix takes the values if it has the pattern that they belong to, on all ranks */
PetscErrorCode LoadRows(TS ts, Mat A, Archive &a, bool *good)
{
  std::vector<PetscScalar> values, now;
  std::vector<PetscInt>    col, offset;
  std::uint64_t            pattern = 0;

  PetscFunctionBegin;
  PetscCall(LocalValues(A, false, now, col, offset));
  a.plain(pattern);
  a.list(values);
  int same = a.good && values.size() == now.size() && pattern == PatternHash(col, offset);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, PetscObjectComm((PetscObject)ts)));
  *good = same;
  if (same) PetscCall(SetLocalValues(A, values, col, offset));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solver of the matrix as it was; *same = PETSC_FALSE if it may have other bits */
PetscErrorCode LoadSolver(TS ts, KSP ksp, Mat J, Mat P, const MatrixState &m, Archive &a, PetscBool *same, bool *good)
{
  Integrator &I = Get(ts);
  PetscBool   usable;

  PetscFunctionBegin;
  *same = PETSC_FALSE;
  if (!m.chosen) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPSetOperators(ksp, J, P));
  PetscCall(LinearLoadState(ksp, P, &I.linear, &a, same, &usable));
  I.linear.chosen = PETSC_TRUE;
  *good           = usable;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode SaveMatrix(TS ts, Archive &a)
{
  Integrator &I = Get(ts);
  MatrixState m;
  Mat         J, P;
  KSP         ksp;
  PetscBool   rows;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(SNESGetJacobian(ts->snes, &J, &P, NULL, NULL));
  PetscCall(GivesRows(P, &m.there));
  m.chosen = I.linear.chosen;
  a.plain(m);
  if (!m.there) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SaveRows(P, a));
  PetscCall(GivesRows(J, &rows));
  if (J != P && rows) PetscCall(SaveRows(J, a));
  if (m.chosen) PetscCall(LinearSaveState(ksp, I.linear, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LoadMatrix(TS ts, Archive &a)
{
  Integrator &I = Get(ts);
  MatrixState m;
  Mat         J, P;
  KSP         ksp;
  PetscBool   rows, mffd, same = PETSC_FALSE;
  bool        good;

  PetscFunctionBegin;
  a.plain(m);
  PetscCall(Everywhere(ts, a.good, &good));
  if (!good) m = MatrixState{};
  PetscCall(SNESSetUp(ts->snes));
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(SNESGetJacobian(ts->snes, &J, &P, NULL, NULL));
  PetscCall(GivesRows(J, &rows));
  if (m.there) {
    PetscCall(PetscObjectTypeCompare((PetscObject)J, MATMFFD, &mffd));
    const TSHHT3Statistics saved = I.stat;
    PetscCall(EvaluateJacobian(ts, I.t1, I.U1, I.V1, I.A1, ShiftV(I.p, I.h), ShiftA(I.p, I.h), mffd ? P : J, P)); /* for the pattern alone */
    I.stat = saved;
    PetscCall(LoadRows(ts, P, a, &good));
    if (good && J != P && rows) PetscCall(LoadRows(ts, J, a, &good));
    good = good && (rows || mffd); /* the application's product has no values to restore */
    if (good) PetscCall(PetscObjectStateGet((PetscObject)P, &I.linear.scaled));
    if (good) PetscCall(PetscObjectStateGet((PetscObject)J, &I.scaled_operator)); /* as they were saved */
    if (good) PetscCall(LoadSolver(ts, ksp, J, P, m, a, &same, &good));
  } else good = false;
  if (!good) I.corrector.matrix.forget();
  if (!same)
    PetscCall(PetscInfo(ts, "resumed with %s: the run agrees with the uninterrupted one to the tolerance, maybe not bit for bit\n",
                        good ? "a linear solver that does not promise the same bits" : "a new Newton matrix, as the last one cannot be restored"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
