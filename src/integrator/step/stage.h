/* U1, V1, A1 of the unknowns X, (2), in stage.cpp; and the drift of the velocities at t_n off the constraints, drift.cpp. */
#ifndef HHTDAE_STAGE_H
#define HHTDAE_STAGE_H

#include "integrator/state.h"

namespace hht3
{

/* Before the first residual of an attempt, and again where h, the state at t_n or the drift of its velocities have changed */
PetscErrorCode PrepareStage(TS ts);

/* U1, V1, A1 from X */
PetscErrorCode StageVectors(TS ts, Vec X);

/* X = X - dX with U1, V1, A1 of the new X, and the norm of dX as CorrectionNorm() has it, in one sweep */
PetscErrorCode SubtractCorrection(TS ts, Vec X, Vec dX, PetscReal *e);

/* The velocities at t_n for a step of length I.h after one of length h_last */
PetscErrorCode AdaptVelocities(TS ts);

/* That drift: the one that the method wants at a consistent start, from the rates of the accelerations, and dV at t_n in the course of a run */
PetscErrorCode SetDriftOfStart(TS ts, Vec rate);
PetscErrorCode MeasureDrift(TS ts);

} // namespace hht3

#endif
