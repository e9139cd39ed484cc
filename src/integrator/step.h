/* One step, step.cpp. */
#ifndef HHTDAE_STEP_H
#define HHTDAE_STEP_H

#include "state.h"

namespace hht3
{

PetscErrorCode Step(TS ts);
PetscErrorCode RollBack(TS ts);

/* vec_sol and vec_dot are as the integrator left them: the next step need not start anew */
PetscErrorCode NoteState(TS ts);

} // namespace hht3

#endif
