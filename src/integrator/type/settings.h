/* The user's settings: checks of tolerances and of PETSc's options (settings.cpp), the public setters and getters
   (setters.cpp); and what the integrator puts into the SNES and removes again (hooks.cpp). */
#ifndef HHTDAE_SETTINGS_H
#define HHTDAE_SETTINGS_H

#include "integrator/state.h"

namespace hht3
{

/* Checks tolerances, times and TSAdapt: at set-up, and at each start, since they may change between two runs */
PetscErrorCode CheckSettings(TS ts);

/* Checks the settings of the SNES and takes -snes_max_it; after HooksInstall() */
PetscErrorCode TakeSNESSettings(TS ts);
PetscErrorCode OptionGiven(PetscObject object, const char name[], PetscBool *given);

/* Composes the functions that the public setters and getters call with the TS; attach = false removes them */
PetscErrorCode ComposeSetters(TS ts, bool attach);

/* Error if the TS has been set up; `what` is the name of the setting in the message */
PetscErrorCode NotAfterSetUp(TS ts, const char *what);

/* Chooses the integrator's line search, which evaluates no residual after the last correction, unless the user has
   chosen a line search or a type of SNES other than newtonls */
PetscErrorCode HooksLineSearch(TS ts);

/* Makes the integrator's finite differences fill the matrix */
PetscErrorCode HooksJacobian(TS ts);

/* At set-up: removes the hooks of another TS from a SNES that both share */
PetscErrorCode HooksTakeOver(TS ts, SNES snes);
/* At set-up: the convergence test, the lag of the Jacobian and the check of its domain error, which reports a singular
   matrix */
PetscErrorCode HooksInstall(TS ts);
PetscErrorCode HooksRemove(TS ts);

/* At the beginning and at the end of a step: sets the functions of this TS in the DM of its SNES if another solver has
   replaced them, and restores those of the other solver */
PetscErrorCode HooksBorrowDM(TS ts);
PetscErrorCode HooksReturnDM(TS ts);

/* Whether the convergence test of the SNES is the user's, who may set one at any time */
PetscBool HooksUserTest(TS ts);

} // namespace hht3

#endif
