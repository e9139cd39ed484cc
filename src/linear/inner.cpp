#include "inner.h"
#include <algorithm>
#include <petsc/private/petscimpl.h>

namespace
{

constexpr PetscInt max_gathered_rows = 30000; /* largest matrix that each rank factors by itself: some 5e6 entries of its factor */

PetscErrorCode Create(PC pc, const char name[], InnerSolver *s)
{
  const char *prefix;

  PetscFunctionBegin;
  PetscCall(KSPCreate(s->gathered ? PETSC_COMM_SELF : PetscObjectComm((PetscObject)pc), &s->ksp));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)s->ksp, (PetscObject)pc, 1));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(KSPSetOptionsPrefix(s->ksp, prefix));
  PetscCall(KSPAppendOptionsPrefix(s->ksp, name));
  PetscCall(KSPSetErrorIfNotConverged(s->ksp, PETSC_FALSE));
  PetscCall(LinearDefaults(s->ksp, &s->choice));
  s->choice.many_solves = PETSC_TRUE;
  PetscCall(KSPSetFromOptions(s->ksp));
  PetscFunctionReturn(0);
}

/* Gathers A on each rank, if it is small and distributed */
PetscErrorCode GatherMatrix(Mat A, InnerSolver *s)
{
  PetscInt    rows;
  PetscMPIInt size;
  Vec         b;
  IS          all;

  PetscFunctionBegin;
  PetscCall(MatGetSize(A, &rows, NULL));
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)A), &size));
  if (size == 1 || rows > max_gathered_rows) PetscFunctionReturn(0);
  if (!s->gathered) {
    PetscCall(MatCreateVecs(A, NULL, &b));
    PetscCall(VecScatterCreateToAll(b, &s->gather, &s->b));
    PetscCall(VecDuplicate(s->b, &s->x));
    PetscCall(VecDestroy(&b));
  }
  PetscCall(ISCreateStride(PETSC_COMM_SELF, rows, 0, 1, &all));
  PetscCall(MatCreateSubMatrices(A, 1, &all, &all, s->gathered ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX, &s->gathered));
  PetscCall(ISDestroy(&all));
  PetscCall(PetscObjectStateIncrease((PetscObject)s->gathered[0])); /* PETSc 3.18 does not do so when it copies new values */
  PetscFunctionReturn(0);
}

PetscErrorCode SolveGathered(InnerSolver *s, Vec b, Vec x)
{
  const PetscScalar *from;
  PetscScalar       *to;
  PetscInt           begin, n;

  PetscFunctionBegin;
  PetscCall(VecScatterBegin(s->gather, b, s->b, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(s->gather, b, s->b, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(KSPSolve(s->ksp, s->b, s->x));
  PetscCall(VecGetOwnershipRange(x, &begin, NULL));
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArrayRead(s->x, &from));
  PetscCall(VecGetArrayWrite(x, &to));
  std::copy_n(from + begin, n, to);
  PetscCall(VecRestoreArrayWrite(x, &to));
  PetscCall(VecRestoreArrayRead(s->x, &from));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode InnerSetUp(PC pc, const char name[], Mat A, InnerSolver *s, PetscBool *failed)
{
  const bool     first = !s->ksp;
  PetscBool      symmetric;
  PC             inner;
  PCFailedReason reason;

  PetscFunctionBegin;
  PetscCall(GatherMatrix(A, s));
  if (s->gathered) A = s->gathered[0];
  PetscCall(LinearSolveOften(A));
  if (first) PetscCall(Create(pc, name, s));
  PetscCall(KSPSetOperators(s->ksp, A, A));
  if (first || s->choice.cholesky) {
    PetscCall(LinearIsSymmetric(A, &symmetric));
    if (first || !symmetric) PetscCall(LinearChoose(s->ksp, A, symmetric, &s->choice));
  }
  PetscCall(KSPSetUp(s->ksp));
  PetscCall(KSPGetPC(s->ksp, &inner));
  PetscCall(PCGetFailedReason(inner, &reason));
  *failed = (PetscBool)(reason != PC_NOERROR);
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSaveState(const InnerSolver &s, Archive *archive)
{
  PetscFunctionBegin;
  PetscCall(LinearSaveState(s.ksp, s.choice, archive));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerLoadState(PC pc, const char name[], Mat A, InnerSolver *s, Archive *archive, PetscBool *same, PetscBool *failed)
{
  PetscBool usable;

  PetscFunctionBegin;
  if (!s->ksp) {
    PetscCall(GatherMatrix(A, s));
    PetscCall(Create(pc, name, s));
  }
  if (s->gathered) A = s->gathered[0];
  PetscCall(LinearSolveOften(A));
  PetscCall(KSPSetOperators(s->ksp, A, A));
  PetscCall(LinearLoadState(s->ksp, A, &s->choice, archive, same, &usable));
  *failed = (PetscBool)!usable;
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolve(InnerSolver *s, Vec b, Vec x, PetscBool *failed)
{
  KSPConvergedReason reason;

  PetscFunctionBegin;
  if (s->gathered) PetscCall(SolveGathered(s, b, x));
  else PetscCall(KSPSolve(s->ksp, b, x));
  PetscCall(KSPGetConvergedReason(s->ksp, &reason));
  *failed = (PetscBool)(reason < 0);
  PetscFunctionReturn(0);
}

PetscErrorCode InnerView(const InnerSolver &s, PetscViewer viewer)
{
  PetscViewer one = viewer;

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPushTab(viewer));
  if (s.gathered) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "each rank by itself, rank 0:\n"));
    PetscCall(PetscViewerGetSubViewer(viewer, PETSC_COMM_SELF, &one));
  }
  PetscMPIInt rank;
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)viewer), &rank));
  if (!s.gathered || !rank) PetscCall(KSPView(s.ksp, one));
  if (s.gathered) PetscCall(PetscViewerRestoreSubViewer(viewer, PETSC_COMM_SELF, &one));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerDestroy(InnerSolver *s)
{
  PetscFunctionBegin;
  PetscCall(KSPDestroy(&s->ksp));
  if (s->gathered) PetscCall(MatDestroySubMatrices(1, &s->gathered));
  PetscCall(VecScatterDestroy(&s->gather));
  PetscCall(VecDestroy(&s->b));
  PetscCall(VecDestroy(&s->x));
  *s = InnerSolver();
  PetscFunctionReturn(0);
}
