/* Selects Euler angles in a run of a scene without the option for it */
#ifndef HHTDAE_TESTS_EULER_RUN_H
#define HHTDAE_TESTS_EULER_RUN_H

#include "scene/runtime.h"

namespace hhtest
{

/* To be called before the first step */
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
