/* Whether a small correction proves that the equations hold (stiffness.cpp, verify.cpp), also for forces of parts whose motion is given (driven.cpp), and whether
   the application's Jacobian is to blame if it does not (wrong_jacobian.cpp). */
#ifndef HHTDAE_PROOFS_H
#define HHTDAE_PROOFS_H

#include "integrator/state.h"

namespace hht3
{

/* From the matrix of the start, and from every new matrix P of a step, made at X */
PetscErrorCode NoteInertia(TS ts, Mat P);
PetscErrorCode NoteDriven(TS ts);
PetscErrorCode NoteStiffness(TS ts, Vec X, Mat P);

/* Rounding of each entry of the residual F at X */
PetscErrorCode MeasureRounding(TS ts, Vec X, Vec F, Vec noise);

/* Before a correction is judged. F: the residual that it answers, unless `evaluated` after it */
PetscErrorCode NoteForces(TS ts, Vec F, PetscBool evaluated);

/* After the correction dX, which has led to X and would be the last: whether the residual has followed it, and whether forces of driven coordinates are
   as good as accelerations of free ones. F: the residual at X if `evaluated`, which it then is. */
PetscErrorCode VerifyCorrection(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated, PetscBool *proved);
PetscErrorCode ForcesOfDriven(TS ts, PetscReal tolerance, Vec X, Vec F, PetscBool *evaluated, PetscBool *good);

/* After a correction that has failed with a matrix of its own: sets wrong_jacobian if the residual has not answered it at all */
PetscErrorCode BlameJacobian(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated);

/* Whether the matrix may hide an imbalance: by its diagonal, or by definitions, whose stiffness does not stand there */
bool MayHideForces(const Integrator &I);

/* How many coordinates may be driven */
PetscErrorCode CountDriven(const Integrator &I, PetscInt *all);

} // namespace hht3

#endif
