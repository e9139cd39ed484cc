/* Between the ends of the last accepted step: polynomials (dense.cpp), and accelerations and multipliers that satisfy the equations there (evaluate_at.cpp). */
#ifndef HHTDAE_DENSE_H
#define HHTDAE_DENSE_H

#include "integrator/state.h"

namespace hht3
{

/* Where t lies in the last step: 0 to 1, and these at its ends exactly */
PetscReal StepFraction(const Integrator &I, PetscReal t);

/* Any of U, V, A may be NULL. t lies between the ends of the last accepted step. */
PetscErrorCode Interpolate(TS ts, PetscReal t, Vec U, Vec V, Vec A);
bool           IsBeginOfStep(TS ts, PetscReal t);
PetscErrorCode EvaluateAt(TS ts, PetscReal t, Vec U, Vec V, Vec A);

/* Where a restart is due, the solution is another one than the last step's, or the application says that its forces have `changed` since: the state of the TS at its
   present time, with the accelerations and multipliers that it has by the equations. *done: whether this is so, and they were found; else U, V, A are untouched. */
PetscErrorCode EvaluatePresent(TS ts, PetscBool changed, Vec U, Vec V, Vec A, PetscBool *done);

/* The matrix, solver and vectors of EvaluateAt() */
PetscErrorCode SamplerDestroy(Integrator &I);

} // namespace hht3

#endif
