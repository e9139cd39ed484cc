/* One step, step.cpp; the clocks and the monitors of -ts_hhtdae_summary and -ts_hhtdae_progress, report.cpp. */
#ifndef HHTDAE_STEP_H
#define HHTDAE_STEP_H

#include "integrator/state.h"

namespace hht3
{

PetscErrorCode TSStep_HHT(TS ts);
PetscErrorCode TSRollBack_HHT(TS ts);

/* The clocks of the statistics run from the first step of a solve on. StopClocks() writes their time into the statistics, and stops
   them if `stop`. */
void StartClocks(Integrator &I);
void StopClocks(Integrator &I, bool stop);

PetscErrorCode MonitorSummary(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx);
PetscErrorCode MonitorProgress(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx);

} // namespace hht3

#endif
