/* The prediction of the unknowns from the ends of the accepted steps, predictor.cpp. */
#ifndef HHTDAE_PREDICTOR_H
#define HHTDAE_PREDICTOR_H

#include "integrator/state.h"

namespace hht3
{

/* A start tells the slope of the unknowns: by values this part of its step earlier, on the tangent. Nearer ones lose it to rounding where steps grow tenfold
   (MatrixTypesRanks.SameRunAsWithAIJ at 1e-5). */
constexpr PetscReal slope_fraction = 5e-4;

/* Forgets the history; X[0] stands as the only point */
PetscErrorCode PredictorReset(TS ts);

/* X at t1 */
PetscErrorCode Predict(TS ts, Vec X);

/* X in place of a prediction that has led astray: positions stay as they are at t_n */
PetscErrorCode PredictRest(const Integrator &I, Vec X);

/* The step at t1 is accepted: it becomes X[0], and the degree for the next step is chosen */
PetscErrorCode PredictorUpdate(TS ts);

/* The slope of the unknowns at t_n, where there is a value before it */
PetscErrorCode SlopeOfUnknowns(const Integrator &I, Vec slope);

/* S[m], m = 1, ..., points - 1: scaled differences tau_1 ... tau_m x[t_0, ..., t_m] of vectors at times t_0 > t_1 > ..., tau_j = t_0 - t_j, as root mean squares or the largest by the weights
   of the error test */
PetscErrorCode ScaledDifferences(TS ts, NormType type, PetscInt points, const Vec x[], const PetscReal t[], PetscReal S[]);

} // namespace hht3

#endif
