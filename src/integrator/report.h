/* Clocks, and the monitors of -ts_hhtdae_summary and -ts_hhtdae_progress, report.cpp. */
#ifndef HHTDAE_REPORT_H
#define HHTDAE_REPORT_H

#include "state.h"

namespace hht3
{

void ReadClocks(PetscReal *wall, PetscReal *cpu);

/* The time since the set-up into the statistics */
void StopClocks(Integrator &I);

PetscErrorCode MonitorSummary(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx);
PetscErrorCode MonitorProgress(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx);

} // namespace hht3

#endif
