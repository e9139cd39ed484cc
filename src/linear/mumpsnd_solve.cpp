/*
  The solves of "mumpsnd". On one process MUMPS works in the vector or dense matrix of the solution. On several processes the
  right-hand sides are distributed as in PETSc, ICNTL(20)=10, and MUMPS leaves the solution distributed by its pivots,
  ICNTL(21)=1: nothing is gathered on one process. Many right-hand sides are solved for together, ICNTL(27) at a time, so
  that the factors are read from memory once for all of these.
*/
#include <petsc/private/matimpl.h>
#if defined(PETSC_HAVE_MUMPS) && defined(PETSC_USE_REAL_DOUBLE) && !defined(PETSC_USE_COMPLEX)

#include "mumpsnd.h"
#include "mumpsnd_data.h"
#include <algorithm>
#include <cstdlib>
#include <type_traits>

template <class P> static MumpsND<P> *Data(Mat F) { return static_cast<MumpsND<P> *>(F->data); }

template <class P> PetscErrorCode MumpsNDDropScatter(MumpsND<P> *m)
{
  PetscFunctionBegin;
  PetscCall(VecScatterDestroy(&m->scatter));
  PetscCall(VecDestroy(&m->sol));
  m->sol_values = {};
  m->sol_values.shrink_to_fit();
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode CheckSolved(Mat F)
{
  const MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  PetscCheck(m->infog(1) >= 0, PetscObjectComm((PetscObject)F), PETSC_ERR_LIB,
             "MUMPS failed in its solve phase: INFOG(1)=%d, INFOG(2)=%d; see the MUMPS user's guide", m->infog(1),
             m->infog(2));
  PetscFunctionReturn(0);
}

/* Selects A or its transpose for the next solves; the distribution of the solution by MUMPS may change with it */
template <class P> static PetscErrorCode SetTransposed(MumpsND<P> *m, bool transposed)
{
  const MUMPS_INT which = transposed ? 0 : 1;

  PetscFunctionBegin;
  if (m->icntl(9) != which) PetscCall(MumpsNDDropScatter(m));
  m->icntl(9) = which;
  PetscFunctionReturn(0);
}

/* ---- one process ---- */

/* x: the right-hand sides, which are replaced by the solutions */
template <class P> static PetscErrorCode SolveInPlace(Mat F, typename P::Real *x, PetscInt lda, PetscInt count)
{
  MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  m->id.nrhs = (MUMPS_INT)count;
  m->id.lrhs = (MUMPS_INT)lda;
  m->id.rhs  = x;
  MumpsRun(m, MUMPS_SOLVE);
  PetscCall(CheckSolved<P>(F));
  PetscFunctionReturn(0);
}

/* ---- several processes ---- */

/* The distribution of the solution by MUMPS changes with every factorization */
template <class P> static PetscErrorCode CreateScatter(MumpsND<P> *m, Vec x)
{
  IS                    to;
  std::vector<PetscInt> rows(m->sol_rows.begin(), m->sol_rows.end());

  PetscFunctionBegin;
  for (PetscInt &r : rows) --r;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, &to));
  PetscCall(VecScatterCreate(m->sol, NULL, x, to, &m->scatter));
  PetscCall(ISDestroy(&to));
  PetscFunctionReturn(0);
}

/* Solves for `count` right-hand sides; the solutions go to sol_values */
template <class P> static PetscErrorCode SolveDistributed(Mat F, const typename P::Real *b, PetscInt lda, PetscInt count)
{
  MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  if (!m->sol) {
    const PetscInt local = m->id.info[22]; /* INFO(23) */
    PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, local, NULL, &m->sol));
    m->sol_rows.assign(local, 0);
  }
  const size_t rows = m->sol_rows.size();
  if (m->sol_values.size() < std::max<size_t>(rows * count, 1)) m->sol_values.resize(std::max<size_t>(rows * count, 1));
  m->id.nrhs     = (MUMPS_INT)count;
  m->id.rhs_loc  = const_cast<typename P::Real *>(b); /* MUMPS only reads it */
  m->id.irhs_loc = m->rhs_rows.data();
  m->id.nloc_rhs = (MUMPS_INT)m->rhs_rows.size();
  m->id.lrhs_loc = (MUMPS_INT)std::max<PetscInt>(lda, 1);
  m->id.sol_loc  = m->sol_values.data();
  m->id.isol_loc = m->sol_rows.data();
  m->id.lsol_loc = (MUMPS_INT)std::max<size_t>(rows, 1);
  MumpsRun(m, MUMPS_SOLVE);
  PetscCall(CheckSolved<P>(F));
  PetscFunctionReturn(0);
}

/* Copies the k-th solution, times `scale`, to the vector x */
template <class P> static PetscErrorCode TakeSolution(MumpsND<P> *m, PetscInt k, double scale, Vec x)
{
  const size_t rows = m->sol_rows.size();

  PetscFunctionBegin;
  if (!m->scatter) PetscCall(CreateScatter(m, x));
  m->column.resize(rows);
  std::transform(m->sol_values.begin() + k * rows, m->sol_values.begin() + (k + 1) * rows, m->column.begin(), [&](double y) { return scale * y; });
  PetscCall(VecPlaceArray(m->sol, m->column.data()));
  PetscCall(VecScatterBegin(m->scatter, m->sol, x, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(m->scatter, m->sol, x, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecResetArray(m->sol));
  PetscFunctionReturn(0);
}

/* ---- one right-hand side ---- */

static PetscErrorCode SolveOne(Mat F, Vec b, Vec x, MumpsND<MumpsDouble> *m)
{
  PetscFunctionBegin;
  if (m->size == 1) {
    PetscScalar *array;
    PetscCall(VecCopy(b, x));
    PetscCall(VecGetArray(x, &array));
    PetscCall(SolveInPlace<MumpsDouble>(F, array, m->id.n, 1));
    PetscCall(VecRestoreArray(x, &array));
  } else {
    const PetscScalar *array;
    PetscCall(VecGetArrayRead(b, &array));
    PetscCall(SolveDistributed<MumpsDouble>(F, array, (PetscInt)m->rhs_rows.size(), 1));
    PetscCall(VecRestoreArrayRead(b, &array));
    PetscCall(TakeSolution(m, 0, 1, x));
  }
  PetscFunctionReturn(0);
}

#if defined(HHTDAE_HAVE_SMUMPS)
/* b is divided by its largest entry, so that no right-hand side is too small or too large for single precision */
static PetscErrorCode SolveOne(Mat F, Vec b, Vec x, MumpsND<MumpsSingle> *m)
{
  PetscReal          unit;
  PetscInt           n;
  const PetscScalar *from;

  PetscFunctionBegin;
  PetscCall(VecNorm(b, NORM_INFINITY, &unit));
  if (!(unit > 0) || PetscIsInfOrNanReal(unit)) {
    PetscCall(VecSet(x, unit));
    PetscFunctionReturn(0);
  }
  PetscCall(VecGetLocalSize(b, &n));
  m->rhs_values.resize((size_t)n);
  PetscCall(VecGetArrayRead(b, &from));
  for (PetscInt i = 0; i < n; ++i) m->rhs_values[(size_t)i] = (float)(from[i] / unit);
  PetscCall(VecRestoreArrayRead(b, &from));
  if (m->size == 1) {
    PetscScalar *to;
    PetscCall(SolveInPlace<MumpsSingle>(F, m->rhs_values.data(), n, 1));
    PetscCall(VecGetArrayWrite(x, &to));
    for (PetscInt i = 0; i < n; ++i) to[i] = unit * m->rhs_values[(size_t)i];
    PetscCall(VecRestoreArrayWrite(x, &to));
  } else {
    PetscCall(SolveDistributed<MumpsSingle>(F, m->rhs_values.data(), n, 1));
    PetscCall(TakeSolution(m, 0, unit, x));
  }
  PetscFunctionReturn(0);
}
#endif

template <class P> static PetscErrorCode Solve(Mat F, Vec b, Vec x, bool transposed)
{
  MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  if (F->factorerrortype) {
    PetscCall(PetscInfo(F, "Solve with a factor that failed: the result is Inf\n"));
    PetscCall(VecSet(x, PETSC_INFINITY));
    PetscFunctionReturn(0);
  }
  PetscCall(SetTransposed(m, transposed));
  PetscCall(SolveOne(F, b, x, m));
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode MatSolve_MumpsND(Mat F, Vec b, Vec x) { return Solve<P>(F, b, x, false); }

template <class P> static PetscErrorCode MatSolveTranspose_MumpsND(Mat F, Vec b, Vec x) { return Solve<P>(F, b, x, Data<P>(F)->id.sym == 0); }

/* ---- many right-hand sides, in double precision only; in single precision PETSc solves for one after the other ---- */

static PetscErrorCode CheckDense(Mat A)
{
  PetscBool dense;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)A, &dense, MATSEQDENSE, MATMPIDENSE, ""));
  PetscCheck(dense, PetscObjectComm((PetscObject)A), PETSC_ERR_ARG_WRONG,
             "MatMatSolve() of solver type %s takes right-hand sides and solutions of type %s, not %s", LINEAR_MUMPSND,
             MATDENSE, ((PetscObject)A)->type_name);
  PetscFunctionReturn(0);
}

static PetscErrorCode FillColumns(Mat X, PetscScalar value)
{
  PetscScalar *x;
  PetscInt     lda;

  PetscFunctionBegin;
  PetscCall(MatDenseGetLDA(X, &lda));
  PetscCall(MatDenseGetArrayWrite(X, &x));
  for (PetscInt k = 0; k < X->cmap->N; ++k) std::fill_n(x + (size_t)k * lda, X->rmap->n, value);
  PetscCall(MatDenseRestoreArrayWrite(X, &x));
  PetscFunctionReturn(0);
}

static PetscErrorCode SolveAllInPlace(Mat F, Mat B, Mat X)
{
  PetscScalar *x;
  PetscInt     lda;

  PetscFunctionBegin;
  if (B != X) PetscCall(MatCopy(B, X, SAME_NONZERO_PATTERN));
  PetscCall(MatDenseGetLDA(X, &lda));
  PetscCall(MatDenseGetArray(X, &x));
  PetscCall(SolveInPlace<MumpsDouble>(F, x, lda, X->cmap->N));
  PetscCall(MatDenseRestoreArray(X, &x));
  PetscFunctionReturn(0);
}

/* In blocks of the size that MUMPS takes at a time, so that at most one block of solutions is stored twice */
static PetscErrorCode SolveBlocks(Mat F, Mat B, Mat X)
{
  MumpsND<MumpsDouble>    *m     = Data<MumpsDouble>(F);
  const PetscInt block = std::max(1, std::abs(m->icntl(27))), all = B->cmap->N;
  PetscInt       lda;

  PetscFunctionBegin;
  PetscCall(MatDenseGetLDA(B, &lda));
  for (PetscInt from = 0; from < all; from += block) {
    const PetscInt     count = std::min(block, all - from);
    const PetscScalar *b;
    PetscCall(MatDenseGetArrayRead(B, &b));
    PetscCall(SolveDistributed<MumpsDouble>(F, b + (size_t)from * lda, lda, count));
    PetscCall(MatDenseRestoreArrayRead(B, &b));
    for (PetscInt k = 0; k < count; ++k) {
      Vec x;
      PetscCall(MatDenseGetColumnVecWrite(X, from + k, &x));
      PetscCall(TakeSolution(m, k, 1, x));
      PetscCall(MatDenseRestoreColumnVecWrite(X, from + k, &x));
    }
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode MatMatSolve_MumpsND(Mat F, Mat B, Mat X)
{
  PetscFunctionBegin;
  PetscCall(CheckDense(B));
  PetscCall(CheckDense(X));
  if (!B->cmap->N) PetscFunctionReturn(0);
  if (F->factorerrortype) {
    PetscCall(PetscInfo(F, "Solve with a factor that failed: the result is Inf\n"));
    PetscCall(FillColumns(X, PETSC_INFINITY));
    PetscFunctionReturn(0);
  }
  PetscCall(SetTransposed(Data<MumpsDouble>(F), false));
  if (Data<MumpsDouble>(F)->size == 1)
    PetscCall(SolveAllInPlace(F, B, X));
  else
    PetscCall(SolveBlocks(F, B, X));
  PetscFunctionReturn(0);
}

template <class P> void MumpsNDSetSolves(Mat F)
{
  F->ops->solve          = MatSolve_MumpsND<P>;
  F->ops->solvetranspose = MatSolveTranspose_MumpsND<P>;
  F->ops->matsolve       = std::is_same<typename P::Real, PetscScalar>::value ? MatMatSolve_MumpsND : NULL;
}

template void           MumpsNDSetSolves<MumpsDouble>(Mat);
template PetscErrorCode MumpsNDDropScatter(MumpsND<MumpsDouble> *);
#if defined(HHTDAE_HAVE_SMUMPS)
template void           MumpsNDSetSolves<MumpsSingle>(Mat);
template PetscErrorCode MumpsNDDropScatter(MumpsND<MumpsSingle> *);
#endif

#endif
