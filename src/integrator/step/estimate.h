/* Weights and norms of the error test, (26) (estimate.cpp), and the length of the next step: the default TSAdapt (adapt.cpp) and the application's longest step
   (limit.cpp). */
#ifndef HHTDAE_ESTIMATE_H
#define HHTDAE_ESTIMATE_H

#include "integrator/state.h"

namespace hht3
{

/* Y_i and the weights after U has been accepted; all: of every entry */
PetscErrorCode UpdateWeights(TS ts, Vec U, bool all = false);
PetscErrorCode FollowTolerances(TS ts, Vec U);

/* Of all ranks, from sums of squares by the weights, or the largest: the root mean square, or the largest */
PetscErrorCode ReduceNorm(TS ts, NormType type, PetscReal local, PetscReal *norm);

/* A correction in units of the tolerance: the change of the error estimate that it makes in a step of length h, (40); for h = 1 |k| times the weighted norm */
PetscErrorCode CorrectionNorm(TS ts, Vec dX, PetscReal h, PetscReal *e);

/* The same from this rank's sum of squares by the weights */
PetscErrorCode ReduceCorrection(TS ts, Vec dX, PetscReal sum, PetscReal h, PetscReal *e);

/* to = dX times the squares of its weights: a product with it is that of corrections, whose norm is CorrectionNorm() but for a factor */
PetscErrorCode WeightCorrection(const Integrator &I, Vec dX, Vec to);

/* The error of the attempt, as TSAdapt asks for it. NoteError() keeps that of the accepted step for the corrector's tolerance in the next one. */
PetscErrorCode TSEvaluateWLTE_HHT(TS ts, NormType type, PetscInt *order, PetscReal *wlte);
PetscErrorCode NoteError(TS ts);

/* Before a time at which a step has to end: of one length, and their change of h is seen by whoever reads the multipliers there */
constexpr PetscReal equal_last_steps = 10;

PetscErrorCode TSAdaptCreate_HHT(TSAdapt adapt);
PetscErrorCode LookAheadAgain(TS ts); /* before the attempts from t_n, where the run goes on beyond its old end */

/* Before an attempt from t_n */
PetscErrorCode ApplyStepLimit(TS ts);
PetscErrorCode SetStepLimit(TS ts, TSHHT3StepLimit limit, void *ctx);

} // namespace hht3

#endif
