/* New coordinates in the course of a run: the application's map (change.cpp) for state and history (history.cpp). */
#ifndef HHTDAE_CHANGE_H
#define HHTDAE_CHANGE_H

#include "integrator/state.h"

namespace hht3
{

PetscErrorCode SetCoordinateChange(TS ts, TSHHT3ChangeTest test, TSHHT3ChangeMap map, TSHHT3ChangeCommit commit, void *ctx);

/* At t_n, if the application wants to: before a consistent start, or before a step that goes on from U0, V0 */
PetscErrorCode ChangeCoordinates(TS ts, bool starting);

/* U0 and V0 alone, before a consistent start; all that the next step takes from the past */
PetscErrorCode MapStart(TS ts);
PetscErrorCode MapHistory(TS ts);

/* The application takes the new coordinates for its own */
PetscErrorCode CommitChange(TS ts);

/* What the first step in new coordinates needs: an h that the error test allows there, and the matrix */
PetscErrorCode StepAfterChange(TS ts);
PetscErrorCode MatrixAfterChange(TS ts);

} // namespace hht3

#endif
