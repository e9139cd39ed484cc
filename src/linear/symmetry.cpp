#include "linear.h"
#include "vectors.h"

/* Row i and column i are scaled by 1/sqrt(largest entry of row i), lest small entries hide behind large ones */
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

/* MATSBAIJ: the upper triangle alone is stored, by block rows */
PetscErrorCode LinearStoresTriangle(Mat A, PetscBool *triangle)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)A, triangle, MATSEQSBAIJ, MATMPISBAIJ, ""));
  PetscFunctionReturn(0);
}

/*
  With entries of order one at most, y^T A x is a sum of nz terms of random sign: rounding leaves about eps sqrt(nz) in
  the difference. A hundred times that is still far below what one wrong entry of relative size 1e-10 contributes.
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
