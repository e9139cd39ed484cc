/* The prediction of the unknowns from their values at the ends of the accepted steps, predictor.cpp. */
#ifndef HHTDAE_PREDICTOR_H
#define HHTDAE_PREDICTOR_H

#include "integrator/state.h"

namespace hht3
{

/* A start gives the predictor the slope of the unknowns by values on their tangent, this part of the first step before t_0. With
   values that are nearer the slope is lost to rounding when steps grow tenfold (MatrixTypesRanks.SameRunAsWithAIJ at 1e-5). */
constexpr PetscReal slope_fraction = 5e-4;

/* Forgets the history; X[0] is left as the only point */
PetscErrorCode PredictorReset(TS ts);

/* Predicts X at t1 */
PetscErrorCode Predict(TS ts, Vec X);

/* The alternative to a bad prediction: changes the unknowns of coordinates so that positions at t1 are those at t_n */
PetscErrorCode PredictRest(const Integrator &I, Vec X);

/* The step at t1 is accepted: it becomes X[0], and the degree for the next step is chosen */
PetscErrorCode PredictorUpdate(TS ts);

/* The slope of the unknowns at t_n; needs a value before t_n */
PetscErrorCode SlopeOfUnknowns(const Integrator &I, Vec slope);

/* S[m], m = 1, ..., points - 1: norms (`type`, with the weights of the error test) of the scaled differences tau_1 ... tau_m x[t_0,
   ..., t_m] of vectors at times t_0 > t_1 > ..., tau_j = t_0 - t_j */
PetscErrorCode ScaledDifferences(TS ts, NormType type, PetscInt points, const Vec x[], const PetscReal t[], PetscReal S[]);

} // namespace hht3

#endif
