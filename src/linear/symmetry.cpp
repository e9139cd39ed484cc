#include "linear.h"
#include "vectors.h"

/* d_i = 1/sqrt(largest entry of row i), to scale row and column i, so that an unsymmetric pair of small entries is not lost beside large ones */
static PetscErrorCode Scaling(Mat A, Vec d)
{
  PetscScalar *array;
  PetscInt     n;

  PetscFunctionBegin;
  PetscCall(MatGetRowMaxAbs(A, d, NULL));
  PetscCall(VecGetLocalSize(d, &n));
  PetscCall(VecGetArray(d, &array));
  for (PetscInt i = 0; i < n; ++i)
    array[i] = PetscAbsScalar(array[i]) > 0 ? 1 / PetscSqrtReal(PetscAbsScalar(array[i])) : 1;
  PetscCall(VecRestoreArray(d, &array));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearStoresTriangle(Mat A, PetscBool *triangle)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)A, triangle, MATSEQSBAIJ, MATMPISBAIJ, ""));
  PetscFunctionReturn(0);
}

/*
  With scaled entries of order one at most, y^T A x is a sum of nz terms of random sign: rounding leaves about eps sqrt(nz) in
  the difference. The limit is a hundred times that, still far below the contribution of one wrong entry of relative size
  1e-10 (LinearSymmetry.OneWrongEntryIsSeen has one of 1e-9).
*/
PetscErrorCode LinearIsSymmetric(Mat A, PetscBool *symmetric)
{
  Vec         x, y, w, d;
  PetscScalar yAx, xAy;
  MatInfo     info;

  PetscFunctionBegin;
  PetscCall(LinearStoresTriangle(A, symmetric));
  if (*symmetric) PetscFunctionReturn(0);
  PetscCall(MatCreateVecs(A, &x, &w));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecDuplicate(x, &d));
  PetscCall(Scaling(A, d));
  PetscCall(LinearPseudoRandom(x, 1));
  PetscCall(LinearPseudoRandom(y, 2));
  PetscCall(VecPointwiseMult(x, x, d));
  PetscCall(VecPointwiseMult(y, y, d));
  PetscCall(MatMult(A, x, w));
  PetscCall(VecDot(w, y, &yAx));
  PetscCall(MatMult(A, y, w));
  PetscCall(VecDot(w, x, &xAy));
  PetscCall(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
  *symmetric = PetscAbsScalar(yAx - xAy) <= 100 * PETSC_MACHINE_EPSILON * PetscSqrtReal(PetscMax(info.nz_used, 1.0))
                   ? PETSC_TRUE
                   : PETSC_FALSE;
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&w));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(0);
}
