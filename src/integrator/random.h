/* Pseudo-random numbers that depend on a global index alone, so that they are the same on any number of ranks. */
#ifndef HHTDAE_RANDOM_H
#define HHTDAE_RANDOM_H

#include "entries.h"

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

/* Entries of x for which which(i) moved by pseudo-random amounts of relative size r */
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

/* A state off the initial one, with accelerations about a: there entries may vanish that do not elsewhere, at rest or in a symmetric position */
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

/* Of either sign, between a half and one: rounding that neither vanishes by chance nor is the same for all */
inline PetscReal RandomRounding(PetscInt i, unsigned salt) { return (RandomSign(i, salt) + RandomNumber(i, salt)) / 2; }

} // namespace hht3

#endif
