/* Weights and norms of the error test, (26) (estimate.cpp), and the length of the next step: the default TSAdapt (adapt.cpp) and the
   longest step that the application allows (limit.cpp). */
#ifndef HHTDAE_ESTIMATE_H
#define HHTDAE_ESTIMATE_H

#include "integrator/state.h"

namespace hht3
{

/* Updates Y_i and the weights after U has been accepted; all: of every entry, and not only where Y_i has grown */
PetscErrorCode UpdateWeights(TS ts, Vec U, bool all = false);
PetscErrorCode FollowTolerances(TS ts, Vec U);

/* The norm over all ranks from this rank's sum of squares of weighted entries (NORM_2: root mean square) or from its largest one
   (NORM_INFINITY) */
PetscErrorCode ReduceNorm(TS ts, NormType type, PetscReal local, PetscReal *norm);

/* The size of a correction in units of the tolerance: by how much it changes the error estimate of a step of length h, (40). With
   h = 1 it is |k| times the weighted norm. */
PetscErrorCode CorrectionNorm(TS ts, Vec dX, PetscReal h, PetscReal *e);

/* The same from this rank's sum of squares of weighted entries */
PetscErrorCode ReduceCorrection(TS ts, Vec dX, PetscReal sum, PetscReal h, PetscReal *e);

/* to = dX times the squares of the weights: VecDot() with it is the inner product whose norm is CorrectionNorm() up to a factor */
PetscErrorCode WeightCorrection(const Integrator &I, Vec dX, Vec to);

/* The error of the attempt, for TSAdapt. NoteError() keeps that of the accepted step for the corrector's tolerance in the next one. */
PetscErrorCode TSEvaluateWLTE_HHT(TS ts, NormType type, PetscInt *order, PetscReal *wlte);
PetscErrorCode NoteError(TS ts);

/* Largest number of steps of equal length before a time at which a step has to end (ShareTheRest() in adapt.cpp). A change of h
   within them disturbs the multipliers there, so that AdaptVelocities() corrects even a small one. */
constexpr PetscReal equal_last_steps = 10;

PetscErrorCode TSAdaptCreate_HHT(TSAdapt adapt);
PetscErrorCode LookAheadAgain(TS ts); /* before the attempts from t_n, if the run goes on beyond its former end */

/* Before an attempt from t_n */
PetscErrorCode ApplyStepLimit(TS ts);
PetscErrorCode SetStepLimit(TS ts, TSHHT3StepLimit limit, void *ctx);

} // namespace hht3

#endif
