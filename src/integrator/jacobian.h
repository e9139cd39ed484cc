/* Where the matrix of the run comes from, jacobian.cpp: from the application, also as one triangle (triangle.cpp), or from differences of the residual. */
#ifndef HHTDAE_JACOBIAN_H
#define HHTDAE_JACOBIAN_H

#include "state.h"

namespace hht3
{

/* At set-up: the matrices of the SNES, then its solvers and the corrector in it. TakeSNES() does both again where the TS has another SNES. */
PetscErrorCode SetUpJacobian(TS ts);
PetscErrorCode SetUpSolvers(TS ts);
PetscErrorCode TakeSNES(TS ts);

/* Refuses matrices without rows and operators that cannot be scaled */
PetscErrorCode CheckMatrices(TS ts);
PetscErrorCode GivesRows(Mat A, PetscBool *yes);

/* triangle.cpp: refuses a matrix of one triangle where the Newton matrix is not symmetric; D A D with the scalings of the present h */
PetscErrorCode CheckTriangle(TS ts);
PetscErrorCode ScaleTriangle(Integrator &I, Mat A);

/* differences.cpp: for applications that have no Jacobian. *P: the matrix to use, or NULL to have one made with the pattern that the residual shows */
PetscErrorCode DifferencesCreate(TS ts, Mat *P);
PetscErrorCode DifferencesJacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat P);
PetscErrorCode DifferencesDestroy(TS ts);

} // namespace hht3

#endif
