/* Checkpoints of a run: writing, reading and when they are due, checkpoint.cpp. */
#ifndef HHTDAE_CHECKPOINT_H
#define HHTDAE_CHECKPOINT_H

#include "integrator/state.h"

namespace hht3
{

PetscErrorCode SetCheckpointVec(TS ts, Vec extra);
PetscErrorCode CheckpointSave(TS ts, const char file[]);

/* Before TSSetUp() only the name of the file is kept; TSSetUp() reads it at its end */
PetscErrorCode CheckpointLoad(TS ts, const char file[]);
/* Calls TSSetUp() if a file has still to be read: for queries between CheckpointLoad() and the first step */
PetscErrorCode ReadCheckpoint(TS ts);

PetscErrorCode CheckCheckpointFile(TS ts); /* at set-up: error if the file of -ts_hhtdae_checkpoint cannot be written */
PetscErrorCode CheckpointIfDue(TS ts);     /* at the beginning of each step */
/* Writes the checkpoint after the last step */
PetscErrorCode MonitorCheckpoint(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx);

} // namespace hht3

#endif
