/* Some modes of a large scene, by SLEPc; in libhhtflexible */
#ifndef HHTDAE_MODES_H
#define HHTDAE_MODES_H

#include "hhtdae/linearize.h"

namespace hhtdae
{

/* The slowest `count` modes, by increasing |value|, sparse and on all ranks. They are looked for about the real number `shift` in 1/s, which must
   not be the value of a mode: near the slowest ones it is best. Where these are found to be far above it, they are looked for again about the slowest. SLEPc's options have the prefix -scene_modes_ (-scene_modes_pep_view). */
PetscErrorCode SlowestModes(const Linearization &of, PetscInt count, std::vector<Mode> *modes, PetscReal shift = 1);

} // namespace hhtdae

#endif
