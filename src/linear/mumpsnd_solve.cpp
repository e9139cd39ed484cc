/*
  The solves of "mumpsnd". On one process MUMPS works in the vector or dense matrix of the solution. On several the
  right-hand sides stay where they are, ICNTL(20)=10, and MUMPS leaves the solution where its pivots are, ICNTL(21)=1:
  nothing is gathered on one process. Many right-hand sides go through the factors together, ICNTL(27) at a time: the
  factors are read from memory once for all of them.
*/
#include <petsc/private/matimpl.h>
#if defined(PETSC_HAVE_MUMPS) && defined(PETSC_USE_REAL_DOUBLE) && !defined(PETSC_USE_COMPLEX)

#include "mumpsnd.h"
#include "mumpsnd_data.h"
#include <algorithm>
#include <cstdlib>

static MumpsND *Data(Mat F) { return static_cast<MumpsND *>(F->data); }

PetscErrorCode MumpsNDDropScatter(MumpsND *m)
{
  PetscFunctionBegin;
  PetscCall(VecScatterDestroy(&m->scatter));
  PetscCall(VecDestroy(&m->sol));
  m->sol_values = std::vector<double>();
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckSolved(Mat F)
{
  const MumpsND *m = Data(F);

  PetscFunctionBegin;
  PetscCheck(m->infog(1) >= 0, PetscObjectComm((PetscObject)F), PETSC_ERR_LIB,
             "MUMPS failed in its solve phase: INFOG(1)=%d, INFOG(2)=%d; see the MUMPS user's guide", m->infog(1),
             m->infog(2));
  PetscFunctionReturn(0);
}

/* A or its transpose is solved with from here on; what MUMPS decided about places of the solution may not hold any more
 */
static PetscErrorCode Direction(MumpsND *m, bool transposed)
{
  const MUMPS_INT which = transposed ? 0 : 1;

  PetscFunctionBegin;
  if (m->icntl(9) != which) PetscCall(MumpsNDDropScatter(m));
  m->icntl(9) = which;
  PetscFunctionReturn(0);
}

/* ---- one process ---- */

/* x: the right-hand sides, which the solutions replace */
static PetscErrorCode SolveInPlace(Mat F, PetscScalar *x, PetscInt lda, PetscInt count)
{
  MumpsND *m = Data(F);

  PetscFunctionBegin;
  m->id.nrhs = (MUMPS_INT)count;
  m->id.lrhs = (MUMPS_INT)lda;
  m->id.rhs  = x;
  MumpsRun(m, MUMPS_SOLVE);
  PetscCall(CheckSolved(F));
  PetscFunctionReturn(0);
}

/* ---- several processes ---- */

/* MUMPS decides anew in every factorization which process returns which part of the solution */
static PetscErrorCode CreateScatter(MumpsND *m, Vec x)
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

/* Solutions of `count` right-hand sides to sol_values */
static PetscErrorCode SolveDistributed(Mat F, const PetscScalar *b, PetscInt lda, PetscInt count)
{
  MumpsND *m = Data(F);

  PetscFunctionBegin;
  if (!m->sol) {
    const PetscInt local = m->id.info[22]; /* INFO(23) */
    PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, local, NULL, &m->sol));
    m->sol_rows.assign(local, 0);
  }
  const size_t rows = m->sol_rows.size();
  if (m->sol_values.size() < std::max<size_t>(rows * count, 1)) m->sol_values.resize(std::max<size_t>(rows * count, 1));
  m->id.nrhs     = (MUMPS_INT)count;
  m->id.rhs_loc  = const_cast<PetscScalar *>(b); /* MUMPS only reads it */
  m->id.irhs_loc = m->rhs_rows.data();
  m->id.nloc_rhs = (MUMPS_INT)m->rhs_rows.size();
  m->id.lrhs_loc = (MUMPS_INT)std::max<PetscInt>(lda, 1);
  m->id.sol_loc  = m->sol_values.data();
  m->id.isol_loc = m->sol_rows.data();
  m->id.lsol_loc = (MUMPS_INT)std::max<size_t>(rows, 1);
  MumpsRun(m, MUMPS_SOLVE);
  PetscCall(CheckSolved(F));
  PetscFunctionReturn(0);
}

/* The k-th of the solutions to the vector that was asked for */
static PetscErrorCode TakeSolution(MumpsND *m, PetscInt k, Vec x)
{
  PetscFunctionBegin;
  if (!m->scatter) PetscCall(CreateScatter(m, x));
  PetscCall(VecPlaceArray(m->sol, m->sol_values.data() + k * m->sol_rows.size()));
  PetscCall(VecScatterBegin(m->scatter, m->sol, x, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(m->scatter, m->sol, x, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecResetArray(m->sol));
  PetscFunctionReturn(0);
}

/* ---- one right-hand side ---- */

static PetscErrorCode Solve(Mat F, Vec b, Vec x, bool transposed)
{
  MumpsND *m = Data(F);

  PetscFunctionBegin;
  if (F->factorerrortype) {
    PetscCall(PetscInfo(F, "Solve with a factor that failed: the result is Inf\n"));
    PetscCall(VecSet(x, PETSC_INFINITY));
    PetscFunctionReturn(0);
  }
  PetscCall(Direction(m, transposed));
  if (m->size == 1) {
    PetscScalar *array;
    PetscCall(VecCopy(b, x));
    PetscCall(VecGetArray(x, &array));
    PetscCall(SolveInPlace(F, array, m->id.n, 1));
    PetscCall(VecRestoreArray(x, &array));
  } else {
    const PetscScalar *array;
    PetscCall(VecGetArrayRead(b, &array));
    PetscCall(SolveDistributed(F, array, (PetscInt)m->rhs_rows.size(), 1));
    PetscCall(VecRestoreArrayRead(b, &array));
    PetscCall(TakeSolution(m, 0, x));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode MatSolve_MumpsND(Mat F, Vec b, Vec x) { return Solve(F, b, x, false); }

static PetscErrorCode MatSolveTranspose_MumpsND(Mat F, Vec b, Vec x) { return Solve(F, b, x, Data(F)->id.sym == 0); }

/* ---- many right-hand sides ---- */

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
  PetscCall(SolveInPlace(F, x, lda, X->cmap->N));
  PetscCall(MatDenseRestoreArray(X, &x));
  PetscFunctionReturn(0);
}

/* In blocks of the size that MUMPS takes at a time, so that no more than one block of solutions is held twice */
static PetscErrorCode SolveBlocks(Mat F, Mat B, Mat X)
{
  MumpsND       *m     = Data(F);
  const PetscInt block = std::max(1, std::abs(m->icntl(27))), all = B->cmap->N;
  PetscInt       lda;

  PetscFunctionBegin;
  PetscCall(MatDenseGetLDA(B, &lda));
  for (PetscInt from = 0; from < all; from += block) {
    const PetscInt     count = std::min(block, all - from);
    const PetscScalar *b;
    PetscCall(MatDenseGetArrayRead(B, &b));
    PetscCall(SolveDistributed(F, b + (size_t)from * lda, lda, count));
    PetscCall(MatDenseRestoreArrayRead(B, &b));
    for (PetscInt k = 0; k < count; ++k) {
      Vec x;
      PetscCall(MatDenseGetColumnVecWrite(X, from + k, &x));
      PetscCall(TakeSolution(m, k, x));
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
  PetscCall(Direction(Data(F), false));
  if (Data(F)->size == 1)
    PetscCall(SolveAllInPlace(F, B, X));
  else
    PetscCall(SolveBlocks(F, B, X));
  PetscFunctionReturn(0);
}

void MumpsNDSetSolves(Mat F)
{
  F->ops->solve          = MatSolve_MumpsND;
  F->ops->solvetranspose = MatSolveTranspose_MumpsND;
  F->ops->matsolve       = MatMatSolve_MumpsND;
}

#endif
