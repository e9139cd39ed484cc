/*
  The Newton matrix in a checkpoint, and that of samples between steps: the values of the rows, and what the solver keeps. It is not evaluated again, because the application
  may have gone on since: it may have taken other coordinates, or remember more. Only its pattern has to be there, and that takes an evaluation.
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
  PetscCall(OnAllRanks(ts, a.good && values.size() == now.size() && pattern == PatternHash(col, offset), good));
  if (*good) PetscCall(SetLocalValues(A, values, col, offset));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The solver of the matrix as it was; *same = PETSC_FALSE if it may have other bits */
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

/* The same on all ranks; nothing where the file ends before it */
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

/* Where it cannot be had, the next sample makes it anew */
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

/* TSSetUp() lets the SNES call the Jacobian of the TS when its type is set up; without, SNESSetUp() takes differences of its own function (Checkpoint.JacobianOfADM) */
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
    good = good && (rows || mffd); /* the application's product has no values to restore */
    if (good) PetscCall(PetscObjectStateGet((PetscObject)P, &I.linear.scaled));
    if (good) PetscCall(PetscObjectStateGet((PetscObject)J, &I.scaled_operator)); /* as they were saved */
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

/* What is read of a solver may end earlier where the user has chosen another one: the samples' part is apart */
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
  PetscCall(LoadSampler(ts, samples)); /* whose solver is the one of the run */
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
