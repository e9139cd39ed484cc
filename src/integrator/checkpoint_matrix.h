/* The Newton matrix and what its solver keeps, as part of a checkpoint, checkpoint_matrix.cpp. */
#ifndef HHTDAE_CHECKPOINT_MATRIX_H
#define HHTDAE_CHECKPOINT_MATRIX_H

#include "linear/archive.h"
#include <petscts.h>

namespace hht3
{

PetscErrorCode SaveMatrix(TS ts, Archive &a);

/* Where it cannot be restored the run makes a new one */
PetscErrorCode LoadMatrix(TS ts, Archive &a);

} // namespace hht3

#endif
