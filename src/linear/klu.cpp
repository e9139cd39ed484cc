/*
  PETSc's interface to KLU ends the program on a zero pivot, where its other packages let the linear solve fail.
  Dependent constraints give exact zero pivots, and they deserve a better message than "KLU Numeric factorization
  failed"; so the entry "klu" of PETSc's list of packages is replaced by one that passes the failure on. All else is
  PETSc's.
*/
#include "klu.h"
#include <petsc/private/matimpl.h>

using Create   = PetscErrorCode (*)(Mat, MatFactorType, Mat *);
using Symbolic = PetscErrorCode (*)(Mat, Mat, IS, IS, const MatFactorInfo *);
using Numeric  = PetscErrorCode (*)(Mat, Mat, const MatFactorInfo *);

/* PETSc's functions, the same for every factor */
static Create   petsc_create   = NULL;
static Symbolic petsc_symbolic = NULL;
static Numeric  petsc_numeric  = NULL;

static PetscErrorCode FactorNumeric(Mat F, Mat A, const MatFactorInfo *info)
{
  PetscErrorCode error;

  PetscFunctionBegin;
  F->factorerrortype = MAT_FACTOR_NOERROR;
  if (!A->erroriffailure) PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  error = petsc_numeric(F, A, info);
  if (!A->erroriffailure) PetscCall(PetscPopErrorHandler());
  if (error == PETSC_ERR_LIB && !A->erroriffailure) {
    PetscCall(PetscInfo(F, "KLU met a zero pivot: the matrix is singular\n"));
    F->factorerrortype = MAT_FACTOR_NUMERIC_ZEROPIVOT;
  } else
    PetscCall(error);
  PetscFunctionReturn(0);
}

static PetscErrorCode FactorSymbolic(Mat F, Mat A, IS row, IS col, const MatFactorInfo *info)
{
  PetscFunctionBegin;
  PetscCall(petsc_symbolic(F, A, row, col, info));
  if (F->ops->lufactornumeric != FactorNumeric) petsc_numeric = F->ops->lufactornumeric;
  F->ops->lufactornumeric = FactorNumeric;
  PetscFunctionReturn(0);
}

static PetscErrorCode MatGetFactor_KLU(Mat A, MatFactorType type, Mat *F)
{
  PetscFunctionBegin;
  PetscCall(petsc_create(A, type, F));
  petsc_symbolic              = (*F)->ops->lufactorsymbolic;
  (*F)->ops->lufactorsymbolic = FactorSymbolic;
  PetscFunctionReturn(0);
}

PetscErrorCode LinearRegisterKLU(void)
{
  PetscBool package, matrix;
  Create    create;

  PetscFunctionBegin;
  PetscCall(MatInitializePackage());
  PetscCall(MatSolverTypeGet(MATSOLVERKLU, MATSEQAIJ, MAT_FACTOR_LU, &package, &matrix, &create));
  if (!create || create == MatGetFactor_KLU) PetscFunctionReturn(0);
  petsc_create = create;
  PetscCall(MatSolverTypeRegister(MATSOLVERKLU, MATSEQAIJ, MAT_FACTOR_LU, MatGetFactor_KLU));
  PetscFunctionReturn(0);
}
