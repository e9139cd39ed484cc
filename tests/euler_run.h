/* Euler angles in a run of a scene that has not said so. */
#ifndef HHTDAE_TESTS_EULER_RUN_H
#define HHTDAE_TESTS_EULER_RUN_H

#include "scene/runtime.h"

namespace hhtest
{

/* Before the run has begun */
inline PetscErrorCode UseEulerAngles(hhtdae::Runtime &R)
{
  PetscFunctionBegin;
  R.bodies.local = false;
  PetscCall(VecDestroy(&R.axes));
  PetscCall(PetscSFDestroy(&R.axes_sf));
  PetscCall(hhtdae::MakeAxes(R));
  PetscFunctionReturn(0);
}

} // namespace hhtest

#endif
