/* Pseudo-random numbers that depend on a seed (`salt`) and a global index only, so that they are the same on any number of ranks. */
#ifndef HHTDAE_RANDOM_H
#define HHTDAE_RANDOM_H

#include "entries.h"

namespace hht3
{

/* In [-1, 1) */
inline PetscReal RandomNumber(PetscInt i, unsigned salt)
{
  unsigned x = (unsigned)i * 2654435761u + (salt + 1) * 2246822519u;
  x          = (x ^ (x >> 15)) * 2246822519u;
  x          = (x ^ (x >> 13)) * 3266489917u;
  return (x >> 8) / (PetscReal)(1 << 23) - 1;
}

/* Changes the entries of x for which which(i) is true by pseudo-random amounts, at most r (1 + |x_i|) */
template <class Which>
PetscErrorCode Shake(Vec x, PetscReal r, unsigned salt, const Which &which)
{
  PetscInt start;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(x, &start, NULL));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar &a) { if (which(i)) a += r * (1 + PetscAbsScalar(a)) * RandomNumber(start + i, salt); }, Write(x)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

inline PetscErrorCode Shake(Vec x, PetscReal r, unsigned salt) { return Shake(x, r, salt, [](PetscInt) { return true; }); }

/* A state near the initial one, with accelerations about a. At the initial state itself, at rest or in a symmetric position,
   derivatives may vanish that do not elsewhere. */
inline PetscErrorCode StateOffStart(TS ts, unsigned salt, PetscReal a, Vec U, Vec V, Vec A)
{
  PetscFunctionBegin;
  PetscCall(VecCopy(ts->vec_sol, U));
  PetscCall(VecCopy(ts->vec_dot, V));
  PetscCall(VecSet(A, a));
  PetscCall(Shake(U, 1e-4, salt));
  PetscCall(Shake(V, 1e-3, salt + 1));
  PetscCall(Shake(A, 1e-3, salt + 2));
  PetscFunctionReturn(PETSC_SUCCESS);
}

inline PetscReal RandomSign(PetscInt i, unsigned salt) { return RandomNumber(i, salt) < 0 ? -1 : 1; }

/* A factor for rounding errors: of random sign, and of random size between 1/2 and 1, so that none vanishes by chance and they are
   not all equal */
inline PetscReal RandomRounding(PetscInt i, unsigned salt) { return (RandomSign(i, salt) + RandomNumber(i, salt)) / 2; }

} // namespace hht3

#endif
