/* Whether a small correction proves that the equations hold (stiffness.cpp, verify.cpp), also those of parts whose motion is given
   (driven.cpp); and if not, whether the application's Jacobian is wrong (wrong_jacobian.cpp). */
#ifndef HHTDAE_PROOFS_H
#define HHTDAE_PROOFS_H

#include "integrator/state.h"

namespace hht3
{

/* NoteInertia(): called with the matrix P of a start. NoteDriven(): called when it is factored, as it solves with it. NoteStiffness():
   called with every new matrix P of a step, made at X. */
PetscErrorCode NoteInertia(TS ts, Mat P);
PetscErrorCode NoteDriven(TS ts);
PetscErrorCode NoteStiffness(TS ts, Vec X, Mat P);

/* Rounding of each entry of the residual F at X, by two samples */
PetscErrorCode MeasureRounding(TS ts, Vec X, Vec F, Vec noise);

/* Called before a correction is judged. F: the residual before the correction, or after it if `evaluated` */
PetscErrorCode NoteForces(TS ts, Vec F, PetscBool evaluated);

/* Called after the correction dX, which has led to X and would be the last one. VerifyCorrection(): whether the residual has followed
   it. ForcesOfDriven(): whether the forces of driven coordinates are as accurate as the accelerations of free ones. F: the residual
   at X if `evaluated`; they evaluate it if they need it. */
PetscErrorCode VerifyCorrection(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated, PetscBool *proved);
PetscErrorCode ForcesOfDriven(TS ts, PetscReal tolerance, Vec X, Vec F, PetscBool *evaluated, PetscBool *good);

/* Called after an iteration that has failed with a matrix of its own: sets corrector.wrong_jacobian if the residual does not respond
   to the last correction at all */
PetscErrorCode BlameJacobian(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated);

/* Whether corrections may be small although the residual is not: the matrix has large claims, or there are definitions, whose
   stiffness does not show in its diagonal */
bool MayHideForces(const Integrator &I);

/* The number of coordinates that may be driven, on all ranks */
PetscErrorCode CountDriven(const Integrator &I, PetscInt *all);

} // namespace hht3

#endif
