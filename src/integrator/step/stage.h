/* The stage U1, V1, A1 as a function of the unknowns X, (2), stage.cpp; the drift of the velocities at t_n off the velocity
   constraints, drift.cpp. */
#ifndef HHTDAE_STAGE_H
#define HHTDAE_STAGE_H

#include "integrator/state.h"

namespace hht3
{

/* Called before the first residual of an attempt, and again after h, the state at t_n or the drift of its velocities have changed */
PetscErrorCode PrepareStage(TS ts);

/* U1, V1, A1 from X */
PetscErrorCode StageVectors(TS ts, Vec X);

/* X = X - dX with U1, V1, A1 of the new X, and the norm of dX as CorrectionNorm() has it, in one sweep */
PetscErrorCode SubtractCorrection(TS ts, Vec X, Vec dX, PetscReal *e);

/* Corrects the velocities at t_n for a step of length I.h after one of length h_last */
PetscErrorCode AdaptVelocities(TS ts);

/* The drift that a step of the method would have left at a consistent start, from the rates of the accelerations; and the measured
   drift dV at t_n */
PetscErrorCode SetDriftOfStart(TS ts, Vec rate);
PetscErrorCode MeasureDrift(TS ts);

} // namespace hht3

#endif
