/* New generalized coordinates in the course of a run: the application's functions (change.cpp), and its map applied to state and
   history (history.cpp). */
#ifndef HHTDAE_CHANGE_H
#define HHTDAE_CHANGE_H

#include "integrator/state.h"

namespace hht3
{

PetscErrorCode SetCoordinateChange(TS ts, TSHHT3ChangeTest test, TSHHT3ChangeMap map, TSHHT3ChangeCommit commit, void *ctx);

/* Changes the coordinates at t_n if the application asks for it: before a consistent start, or before a step from U0, V0 */
PetscErrorCode ChangeCoordinates(TS ts, bool starting);

/* MapStart(): maps U0 and V0 alone, before a consistent start. MapHistory(): maps all that the next step uses of the past. */
PetscErrorCode MapStart(TS ts);
PetscErrorCode MapHistory(TS ts);

/* Tells the application that the new coordinates hold from now on */
PetscErrorCode CommitChange(TS ts);

/* Before the first step in new coordinates: shortens h if the error test would fail there; makes the matrix */
PetscErrorCode StepAfterChange(TS ts);
PetscErrorCode MatrixAfterChange(TS ts);

} // namespace hht3

#endif
