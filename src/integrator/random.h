/* Pseudo-random numbers that depend on a global index alone, so that they are the same on any number of ranks. */
#ifndef HHTDAE_RANDOM_H
#define HHTDAE_RANDOM_H

#include <petscsys.h>

namespace hht3
{

/* In [-1, 1); other numbers for every salt */
inline PetscReal RandomNumber(PetscInt i, unsigned salt)
{
  unsigned x = (unsigned)i * 2654435761u + (salt + 1) * 2246822519u;
  x          = (x ^ (x >> 15)) * 2246822519u;
  x          = (x ^ (x >> 13)) * 3266489917u;
  return (x >> 8) / (PetscReal)(1 << 23) - 1;
}

inline PetscReal RandomSign(PetscInt i, unsigned salt) { return RandomNumber(i, salt) < 0 ? -1 : 1; }

} // namespace hht3

#endif
