/* Choice of the material in which a node's stress is evaluated where materials meet; see stress_modes.cpp. */
#ifndef HHTDAE_FLEXIBLE_SIDES_H
#define HHTDAE_FLEXIBLE_SIDES_H

#include "flexible/assembly.h"

namespace hhtdae
{

/* The material in which each node's stress is evaluated, and the number of elements of this material at the node */
struct Sides {
  std::vector<PetscInt> material; /* for the nodes of this rank's elements */
  std::vector<double>   count;    /* for own nodes */
};

/* Chooses the material with the largest Young's modulus at each node. Collective */
PetscErrorCode ChooseSides(const FeModel &model, const ElementNodes &nodes, Sides *sides);

} // namespace hhtdae

#endif
