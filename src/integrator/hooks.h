/* What the integrator puts into the SNES, and takes out again with what stood there before, hooks.cpp. */
#ifndef HHTDAE_HOOKS_H
#define HHTDAE_HOOKS_H

#include "state.h"

namespace hht3
{

/* Our line search, where the user chose none: a correction then costs no residual after the last one */
PetscErrorCode HooksLineSearch(TS ts);

/* Our differences fill the matrix */
PetscErrorCode HooksJacobian(TS ts);

/* At set-up: the convergence test, and that SNES asks for a matrix and reports a singular one as the corrector wants it */
PetscErrorCode HooksInstall(TS ts);
PetscErrorCode HooksRemove(TS ts);

/* Whether the test of the SNES is the user's, who may have set it at any time */
PetscBool HooksUserTest(TS ts);

} // namespace hht3

#endif
