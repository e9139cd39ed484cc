/* Loops over the local entries of vectors of the same layout, which are marked as read or written. */
#ifndef HHTDAE_ENTRIES_H
#define HHTDAE_ENTRIES_H

#include "compat.h"
#include <vector>

namespace hht3
{

/* A vector and, while a loop runs, its local array */
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

/* Calls get() or restore() of all arrays */
template <class Call, class... Arrays>
PetscErrorCode ForArrays(Call call, Arrays &...arrays)
{
  PetscErrorCode failed = PETSC_SUCCESS;

  PetscFunctionBegin;
  (void)(... && !(failed = call(arrays)));
  PetscCall(failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls loop() with access to the arrays */
template <class Loop, class... Arrays>
PetscErrorCode WithArrays(Loop loop, Arrays &...arrays)
{
  PetscFunctionBegin;
  PetscCall(ForArrays([](auto &a) { return a.get(); }, arrays...));
  loop();
  PetscCall(ForArrays([](auto &a) { return a.restore(); }, arrays...));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls f(i, x_i, y_i, ...) for all local entries i: ForEntries([](PetscInt i, PetscScalar x, PetscScalar &y) { y += x; }, Read(X), Write(Y)) */
template <class F, class First, class... Rest>
PetscErrorCode ForEntries(F f, First first, Rest... rest)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(first.vec, &n));
  PetscCall(WithArrays([&] { for (PetscInt i = 0; i < n; i++) f(i, first[i], rest[i]...); }, first, rest...));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether something is so on any rank, or on all of them; object: whose ranks */
template <class Object>
PetscErrorCode OnAnyRank(Object object, bool here, bool *any)
{
  PetscMPIInt yes = here;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &yes, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)object)));
  *any = yes;
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <class Object>
PetscErrorCode OnAllRanks(Object object, bool here, bool *all)
{
  PetscFunctionBegin;
  PetscCall(OnAnyRank(object, !here, all));
  *all = !*all;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *first: the smallest global index, over all ranks, of an entry for which f(i, x_i, ...) is true; -1 if there is none */
template <class F, class First, class... Rest>
PetscErrorCode FirstWhere(F f, PetscInt *first, First a, Rest... rest)
{
  PetscInt start, mine = HHT3_INT_MAX;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(a.vec, &start, NULL));
  PetscCall(ForEntries([&](PetscInt i, auto... x) { if (mine == HHT3_INT_MAX && f(i, x...)) mine = start + i; }, a, rest...));
  PetscCallMPI(MPI_Allreduce(&mine, first, 1, MPIU_INT, MPI_MIN, PetscObjectComm((PetscObject)a.vec)));
  if (*first == HHT3_INT_MAX) *first = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest f(i, x_i, ...) over the entries of all ranks, at least 0 */
template <class F, class First, class... Rest>
PetscErrorCode LargestOf(F f, PetscReal *largest, First a, Rest... rest)
{
  PetscReal most = 0;

  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, auto... x) { most = PetscMax(most, f(i, x...)); }, a, rest...));
  PetscCallMPI(MPI_Allreduce(&most, largest, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)a.vec)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The entry of a vector with this global index, on all ranks */
inline PetscErrorCode EntryOf(Vec x, PetscInt index, PetscScalar *entry)
{
  PetscInt first, end;

  PetscFunctionBegin;
  *entry = 0;
  PetscCall(VecGetOwnershipRange(x, &first, &end));
  if (index >= first && index < end) PetscCall(VecGetValues(x, 1, &index, entry));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, entry, 1, MPIU_SCALAR, MPIU_SUM, PetscObjectComm((PetscObject)x)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls f(i, x_i, ...) for the local entries i in `list` */
template <class F, class... Arrays>
PetscErrorCode ForSome(const std::vector<PetscInt> &list, F f, Arrays... arrays)
{
  PetscFunctionBegin;
  PetscCall(WithArrays([&] { for (PetscInt i : list) f(i, arrays[i]...); }, arrays...));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sum over entries in four parts, which the processor adds in parallel, and whose rounding errors are smaller */
class Sum
{
public:
  void      add(PetscInt i, PetscReal x) { part[i & 3] += x; }
  PetscReal total() const { return (part[0] + part[1]) + (part[2] + part[3]); }

private:
  PetscReal part[4] = {};
};

} // namespace hht3

#endif
