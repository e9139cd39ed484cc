/* What the user has set: tolerances and options that have a meaning here or none (settings.cpp), and the public setters and getters (setters.cpp). */
#ifndef HHTDAE_SETTINGS_H
#define HHTDAE_SETTINGS_H

#include "state.h"

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

} // namespace hht3

#endif
