/* Between the ends of the last accepted step: polynomials (dense.cpp), and accelerations and multipliers that satisfy the equations there (evaluate_at.cpp). */
#ifndef HHTDAE_DENSE_H
#define HHTDAE_DENSE_H

#include "integrator/state.h"

namespace hht3
{

/* The position of t in the last step, from 0 to 1, exact at the ends */
PetscReal StepFraction(const Integrator &I, PetscReal t);

/* U, U', U'' at a time t between the ends of the last accepted step; any of U, V, A may be NULL. Interpolate(): by polynomials.
   EvaluateAt(): accelerations and multipliers by the equations. IsBeginOfStep(): t is the time of the only known state. */
PetscErrorCode Interpolate(TS ts, PetscReal t, Vec U, Vec V, Vec A);
bool           IsBeginOfStep(TS ts, PetscReal t);
PetscErrorCode EvaluateAt(TS ts, PetscReal t, Vec U, Vec V, Vec A);

/* If a restart is due, if the solution is not that of the last step, or if the application says that its forces have `changed` since:
   returns the state of the TS at its present time, with the accelerations and multipliers that satisfy the equations. *done: whether
   this is so and the solve succeeded; otherwise U, V, A are not changed. */
PetscErrorCode EvaluatePresent(TS ts, PetscBool changed, Vec U, Vec V, Vec A, PetscBool *done);

/* Destroys the matrix, solver and vectors of EvaluateAt() */
PetscErrorCode SamplerDestroy(Integrator &I);

} // namespace hht3

#endif
