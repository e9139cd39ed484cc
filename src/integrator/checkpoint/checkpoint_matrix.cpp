/*
  The Newton matrix in a checkpoint, and the matrix of samples between steps: the values of their rows and the state of
  their solvers. The values are saved because the application cannot evaluate the matrix again: its coordinates and its
  memory may have changed since the matrix was made. The matrix is evaluated after a resume only in order to create its
  pattern.
*/
#include "checkpoint_parts.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "integrator/equations/jacobian.h"
#include "integrator/start/consistent.h"
#include "integrator/step/dense.h"
#include "linear/hash.h"
#include <cstdint>

namespace hht3
{

namespace
{

struct MatrixState {
  PetscBool there  = PETSC_FALSE; /* the values of the matrix are in the file */
  PetscBool chosen = PETSC_FALSE; /* a linear solver had been chosen */
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

/* *good: the pattern of A is the saved one on all ranks, and A has the saved values */
PetscErrorCode LoadRows(TS ts, Mat A, Archive &a, bool *good)
{
  std::vector<PetscScalar> values, now;
  std::vector<PetscInt>    col, offset;
  std::uint64_t            pattern = 0;

  PetscFunctionBegin;
  PetscCall(LocalValues(A, false, now, col, offset));
  a.plain(pattern);
  a.list(values);
  PetscCall(OnAllRanks(ts, a.good && values.size() == now.size() && pattern == PatternHash(col, offset), good));
  if (*good) PetscCall(SetLocalValues(A, values, col, offset));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Restores the solver of the matrix; *same = PETSC_FALSE if its solves may differ bitwise */
PetscErrorCode LoadSolver(KSP ksp, Mat J, Mat P, LinearState *linear, const MatrixState &m, Archive &a, PetscBool *same, bool *good)
{
  PetscBool usable;

  PetscFunctionBegin;
  *same = PETSC_FALSE;
  if (!m.chosen) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPSetOperators(ksp, J, P));
  PetscCall(LinearLoadState(ksp, P, linear, &a, same, &usable));
  linear->chosen = PETSC_TRUE;
  *good          = usable;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives the same on all ranks; an empty state if the file ends before it */
PetscErrorCode ReadMatrixState(TS ts, Archive &a, MatrixState *m)
{
  bool good;

  PetscFunctionBegin;
  a.plain(*m);
  PetscCall(OnAllRanks(ts, a.good, &good));
  if (!good) *m = MatrixState{};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SaveSampler(TS ts, Archive &a)
{
  const Sampler *S = Get(ts).sampler;
  MatrixState    m;

  PetscFunctionBegin;
  m.there = m.chosen = (PetscBool)(S && S->linear.chosen);
  a.plain(m);
  if (!m.there) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SaveRows(S->at.P, a));
  PetscCall(LinearSaveState(S->at.ksp, S->linear, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If the sampler cannot be restored, the next sample makes a new one */
PetscErrorCode LoadSampler(TS ts, Archive &a)
{
  Integrator            &I     = Get(ts);
  const TSHHT3Statistics saved = I.stat;
  MatrixState            m;
  Sampler               *S;
  PetscBool              same;
  bool                   good;

  PetscFunctionBegin;
  PetscCall(SamplerDestroy(I));
  PetscCall(ReadMatrixState(ts, a, &m));
  if (!m.there) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetSampler(ts, &S));
  if (!S) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(EvaluateJacobian(ts, I.t1, I.U1, I.V1, I.A1, ShiftV(I.p, I.h), ShiftA(I.p, I.h), S->at.P, S->at.P)); /* for the pattern alone */
  I.stat = saved;
  PetscCall(LoadRows(ts, S->at.P, a, &good));
  if (good) PetscCall(LoadSolver(S->at.ksp, S->at.P, S->at.P, &S->linear, m, a, &same, &good));
  if (!good) PetscCall(SamplerDestroy(I));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SaveNewton(TS ts, Archive &a)
{
  Integrator &I = Get(ts);
  MatrixState m;
  Mat         J, P;
  KSP         ksp;
  PetscBool   rows, foreign;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(SNESGetJacobian(ts->snes, &J, &P, NULL, NULL));
  PetscCall(GivesRows(P, &m.there));
  PetscCall(HasForeignValues(ts, &foreign));
  if (foreign && I.corrector.matrix.have) m.there = PETSC_FALSE;
  m.chosen = I.linear.chosen;
  a.plain(m);
  if (!m.there) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SaveRows(P, a));
  PetscCall(GivesRows(J, &rows));
  if (J != P && rows) PetscCall(SaveRows(J, a));
  if (m.chosen) PetscCall(LinearSaveState(ksp, I.linear, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TSSetUp() sets the Jacobian of the TS in the SNES only after the set-up of its type, which calls this function;
   without it SNESSetUp() would choose finite differences (Checkpoint.JacobianOfADM) */
PetscErrorCode SetUpSNES(TS ts)
{
  DM     dm;
  DMSNES sdm;
  DMTS   tdm;

  PetscFunctionBegin;
  PetscCall(SNESGetDM(ts->snes, &dm));
  PetscCall(DMGetDMSNES(dm, &sdm));
  PetscCall(DMGetDMTS(dm, &tdm));
  if (!sdm->ops->computejacobian && tdm->ops->i2jacobian) PetscCall(DMSNESSetJacobian(dm, SNESTSFormJacobian, ts));
  PetscCall(SNESSetUp(ts->snes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LoadNewton(TS ts, Archive &a)
{
  Integrator &I = Get(ts);
  MatrixState m;
  Mat         J, P;
  KSP         ksp;
  PetscBool   rows, mffd, same = PETSC_FALSE;
  bool        good;

  PetscFunctionBegin;
  PetscCall(ReadMatrixState(ts, a, &m));
  PetscCall(SetUpSNES(ts));
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
    good = good && (rows || mffd); /* an operator of the application without rows has no values to restore */
    if (good) PetscCall(PetscObjectStateGet((PetscObject)P, &I.linear.scaled));
    if (good) PetscCall(PetscObjectStateGet((PetscObject)J, &I.scaled_operator)); /* the values were saved scaled */
    if (good) PetscCall(LoadSolver(ksp, J, P, &I.linear, m, a, &same, &good));
  } else good = false;
  if (!good) I.corrector.matrix.forget();
  PetscCall(NoteMatrices(ts));
  if (!same)
    PetscCall(PetscInfo(ts, "resumed with %s: the run agrees with the uninterrupted one to the tolerance, maybe not bit for bit\n",
                        good ? "a linear solver that does not promise the same bits" : "a new Newton matrix, as the last one cannot be restored"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* The sampler is saved as a separate list, since less of the Newton matrix's part is read if the user has chosen
   another solver */
PetscErrorCode SaveMatrices(TS ts, Archive &a)
{
  Archive samples;

  PetscFunctionBegin;
  PetscCall(SaveSampler(ts, samples));
  a.list(samples.data);
  PetscCall(SaveNewton(ts, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LoadMatrices(TS ts, Archive &a)
{
  Archive samples;

  PetscFunctionBegin;
  a.list(samples.data);
  samples.reading = true;
  PetscCall(LoadNewton(ts, a));
  PetscCall(LoadSampler(ts, samples)); /* last, since GetSampler() depends on the solver of the run */
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
