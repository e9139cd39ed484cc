/* Where materials meet, the one that a node's stress is taken in; see stress_modes.cpp. */
#ifndef HHTDAE_FLEXIBLE_SIDES_H
#define HHTDAE_FLEXIBLE_SIDES_H

#include "flexible/assembly.h"

namespace hhtdae
{

/* The material that each node's stress is taken in, and the number of its elements around the node */
struct Sides {
  std::vector<PetscInt> material; /* of the nodes of this rank's elements */
  std::vector<double>   count;    /* of own nodes */
};

/* The stiffest around each node. Collective */
PetscErrorCode ChooseSides(const FeModel &model, const ElementNodes &nodes, Sides *sides);

} // namespace hhtdae

#endif
