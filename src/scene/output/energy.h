/* Energy and momentum of a scene at the present state of its bodies */
#ifndef HHTDAE_SCENE_OUTPUT_ENERGY_H
#define HHTDAE_SCENE_OUTPUT_ENERGY_H

#include "scene/runtime.h"

namespace hhtdae
{

struct Balance {
  double  kinetic = 0;
  double  gravity = 0;                 /* potential energy - sum of m g . r, zero at the origin of space */
  double  elastic = 0;                 /* potential energy of linear springs, bushings, beams and other kernels with HasEnergy */
  Vector3 linear  = Vector3::Zero();   /* momentum */
  Vector3 angular = Vector3::Zero();   /* moment of momentum about the origin of space */
  double  potential() const { return gravity + elastic; }
  double  total() const { return kinetic + potential(); }
};

/* The balance of the whole scene, on every rank. The bodies must have been moved to the state of e. */
PetscErrorCode MakeBalance(const Runtime &R, const Evaluation &e, Balance &b);

} // namespace hhtdae

#endif
