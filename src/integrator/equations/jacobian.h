/* Where the matrix of the run comes from, jacobian.cpp: from the application, also as one triangle (triangle.cpp), or from differences of the residual. */
#ifndef HHTDAE_JACOBIAN_H
#define HHTDAE_JACOBIAN_H

#include "integrator/state.h"

namespace hht3
{

/* At set-up: the matrices of the SNES, then its solvers and the corrector in it. TakeSNES() does both again where the TS has another SNES, or this one other matrices
   or options. */
PetscErrorCode SetUpJacobian(TS ts);
PetscErrorCode SetUpSolvers(TS ts);
PetscErrorCode NoteMatrices(TS ts);
PetscErrorCode IsAnotherSNES(TS ts, bool *yes);
PetscErrorCode TakeSNES(TS ts);

/* Whether someone else has put values into the matrices since a correction has left them there; then the matrix of the last steps is none */
PetscErrorCode HasForeignValues(TS ts, PetscBool *yes);
PetscErrorCode ForgetForeignMatrix(TS ts);

/* Refuses matrices without rows and operators that cannot be scaled */
PetscErrorCode CheckMatrices(TS ts);
PetscErrorCode GivesRows(Mat A, PetscBool *yes);

/* Values of the local rows, one after another, and for each its global column; of one triangle from the diagonal on. And back: of a matrix with these places */
PetscErrorCode LocalValues(Mat P, bool triangle, std::vector<PetscScalar> &val, std::vector<PetscInt> &col, std::vector<PetscInt> &offset);
PetscErrorCode SetLocalValues(Mat P, const std::vector<PetscScalar> &val, const std::vector<PetscInt> &col, const std::vector<PetscInt> &offset);

/* triangle.cpp: refuses a matrix of one triangle where the Newton matrix is not symmetric; D A D with the scalings of rows and columns */
PetscErrorCode CheckTriangle(TS ts);
PetscErrorCode ScaleTriangle(Mat A, Vec row, Vec col);

/* differences.cpp: for applications that have no Jacobian. *P: the matrix to use, or NULL to have one made with the pattern that the residual shows */
PetscErrorCode DifferencesCreate(TS ts, Mat *P);
PetscErrorCode DifferencesJacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat P);
PetscErrorCode DifferencesDestroy(TS ts);

} // namespace hht3

#endif
