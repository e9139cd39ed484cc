/* Checkpoints of a run, checkpoint.cpp: what may be asked of them. */
#ifndef HHTDAE_CHECKPOINT_H
#define HHTDAE_CHECKPOINT_H

#include "integrator/state.h"

namespace hht3
{

PetscErrorCode SetCheckpointVec(TS ts, Vec extra);
PetscErrorCode CheckpointSave(TS ts, const char file[]);

/* Before the set-up it is only noted, and read at its end */
PetscErrorCode CheckpointLoad(TS ts, const char file[]);
/* A file that has been noted only is read now, by the set-up: for queries between CheckpointLoad() and the first step */
PetscErrorCode ReadCheckpoint(TS ts);

/* At the beginning of a step; the monitor does it after the last one */
PetscErrorCode CheckCheckpointFile(TS ts); /* before the run: whether it can be written */
PetscErrorCode CheckpointIfDue(TS ts);
PetscErrorCode MonitorCheckpoint(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx);

} // namespace hht3

#endif
