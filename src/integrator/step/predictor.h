/* The prediction of the unknowns by divided differences of the accepted steps, predictor.cpp. */
#ifndef HHTDAE_PREDICTOR_H
#define HHTDAE_PREDICTOR_H

#include "integrator/state.h"

namespace hht3
{

/* Forgets the history; D_0 stands as the only point */
PetscErrorCode PredictorReset(TS ts);

/* X at t1 */
PetscErrorCode Predict(TS ts, Vec X);

/* X in place of a prediction that has led astray: positions stay as they are at t_n */
PetscErrorCode PredictRest(const Integrator &I, Vec X);

/* The step at t1 is accepted: it becomes D_0, and the degree for the next step is chosen */
PetscErrorCode PredictorUpdate(TS ts);

} // namespace hht3

#endif
