/* Loops over the local entries of vectors of one layout, each of which is read or written. */
#ifndef HHTDAE_ENTRIES_H
#define HHTDAE_ENTRIES_H

#include "compat.h"

namespace hht3
{

/* A vector's local array while a loop has it */
struct Read {
  Vec                vec;
  const PetscScalar *x = nullptr;
  explicit Read(Vec v) : vec(v) {}
  PetscErrorCode     get() { return VecGetArrayRead(vec, &x); }
  PetscErrorCode     restore() { return VecRestoreArrayRead(vec, &x); }
  const PetscScalar &operator[](PetscInt i) const { return x[i]; }
};

struct Write {
  Vec          vec;
  PetscScalar *x = nullptr;
  explicit Write(Vec v) : vec(v) {}
  PetscErrorCode get() { return VecGetArray(vec, &x); }
  PetscErrorCode restore() { return VecRestoreArray(vec, &x); }
  PetscScalar   &operator[](PetscInt i) const { return x[i]; }
};

template <class First, class... Rest>
PetscErrorCode GetArrays(First &first, Rest &...rest)
{
  PetscFunctionBegin;
  PetscCall(first.get());
  if constexpr (sizeof...(rest) > 0) PetscCall(GetArrays(rest...));
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <class First, class... Rest>
PetscErrorCode RestoreArrays(First &first, Rest &...rest)
{
  PetscFunctionBegin;
  if constexpr (sizeof...(rest) > 0) PetscCall(RestoreArrays(rest...));
  PetscCall(first.restore());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f(i, x_i, y_i, ...) for all local entries i: ForEntries([](PetscInt i, PetscScalar x, PetscScalar &y) { y += x; }, Read(X), Write(Y)) */
template <class F, class First, class... Rest>
PetscErrorCode ForEntries(F f, First first, Rest... rest)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(first.vec, &n));
  PetscCall(GetArrays(first, rest...));
  for (PetscInt i = 0; i < n; i++) f(i, first[i], rest[i]...);
  PetscCall(RestoreArrays(first, rest...));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

#endif
