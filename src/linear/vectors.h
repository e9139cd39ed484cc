/* Pseudo-random vectors that depend on the global index alone: the same on any number of processes and in every run */
#ifndef HHTDAE_LINEAR_VECTORS_H
#define HHTDAE_LINEAR_VECTORS_H

#include "hash.h"
#include <petscvec.h>

/* A value with 1/2 <= |value| < 1 and either sign, so that no component is small by chance */
inline PetscReal LinearPseudoRandomValue(uint64_t index, uint64_t stream)
{
  const uint64_t  z    = HashMix(index + (stream << 48) + 0x9e3779b97f4a7c15u);
  const PetscReal size = 0.5 + 0.5 * (PetscReal)(z >> 12) / (PetscReal)(1ull << 52);
  return z & 1 ? size : -size;
}

inline PetscErrorCode LinearPseudoRandom(Vec x, uint64_t stream)
{
  PetscScalar *array;
  PetscInt     begin, end;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(x, &begin, &end));
  PetscCall(VecGetArrayWrite(x, &array));
  for (PetscInt i = begin; i < end; ++i) array[i - begin] = LinearPseudoRandomValue((uint64_t)i, stream);
  PetscCall(VecRestoreArrayWrite(x, &array));
  PetscFunctionReturn(0);
}

#endif
