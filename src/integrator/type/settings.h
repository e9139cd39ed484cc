/* What the user has set: tolerances and options that have a meaning here or none (settings.cpp), and the public setters and getters (setters.cpp); what the
   integrator puts into the SNES, and takes out again with what stood there before (hooks.cpp). */
#ifndef HHTDAE_SETTINGS_H
#define HHTDAE_SETTINGS_H

#include "integrator/state.h"

namespace hht3
{

/* At set-up, and at a start: whatever may change between two runs */
PetscErrorCode CheckSettings(TS ts);

/* Of the SNES, after HooksInstall() */
PetscErrorCode TakeSNESSettings(TS ts);
PetscErrorCode OptionGiven(PetscObject object, const char name[], PetscBool *given);

/* The list of functions by which the public ones find a TS of our type, made or taken back */
PetscErrorCode ComposeSetters(TS ts, bool attach);

/* An error in a setter that comes too late */
PetscErrorCode NotAfterSetUp(TS ts, const char *what);

/* Our line search, where the user chose none, nor a type of SNES that has its own: a correction then costs no residual after the last one */
PetscErrorCode HooksLineSearch(TS ts);

/* Our differences fill the matrix */
PetscErrorCode HooksJacobian(TS ts);

/* At set-up: the convergence test, and that SNES asks for a matrix and reports a singular one as the corrector wants it */
PetscErrorCode HooksTakeOver(TS ts, SNES snes);
PetscErrorCode HooksInstall(TS ts);
PetscErrorCode HooksRemove(TS ts);

/* The functions of this TS in the DM of its SNES for a step, where another solver on it has put its own, and those back at the end */
PetscErrorCode HooksBorrowDM(TS ts);
PetscErrorCode HooksReturnDM(TS ts);

/* Whether the test of the SNES is the user's, who may have set it at any time */
PetscBool HooksUserTest(TS ts);

} // namespace hht3

#endif
