/* Which element makes a residual that is not a number, for messages of the integrator: the row that they name may belong to a body, on which several forces act. */
#include "model.h"
#include "runtime.h"
#include <cmath>
#include <cstdint>
#include <cstring>

namespace hhtdae
{

/* In integers, since comparisons with NaN trap where -fp_trap is set */
bool AllFinite(const double *x, PetscInt n)
{
  std::uint64_t special = 0; /* the highest bit is set once an exponent has all bits, as those of NaN and infinity have */
  for (PetscInt i = 0; i < n; i++) {
    std::uint64_t bits;
    std::memcpy(&bits, x + i, sizeof(bits));
    special |= (bits & 0x7fffffffffffffffULL) + 0x0010000000000000ULL;
  }
  return !(special >> 63);
}

/* Whether an element has a constraint of this rank whose rows in f are no numbers, and which says when that is so */
static bool IsUndefined(const Runtime &R, const ElementData &e, const double *f)
{
  for (const Part &p : e.parts) {
    const int n = p.store->isConstraint() ? p.store->unknowns(p.index) : 0;
    if (n && p.store->undefined() && OwnerOf(*R.model, *p.store, p.index) == R.rank && !AllFinite(f + p.store->start[p.index] - R.start, n)) return true;
  }
  return false;
}

/* The first element of this rank that is not a number in the state of the evaluation, a force in a component, a constraint in its rows of f; or -1: the state itself has none, or the
   cause is another one */
PetscInt BadElement(Runtime &R, const Evaluation &e, const double *f)
{
  const PetscInt known = R.n + (PetscInt)R.others.size();
  for (const double *x : {e.u, e.v})
    if (!AllFinite(x, known)) return -1;
  for (std::size_t k = 0; k < R.scene.elements.size(); k++) {
    if (IsUndefined(R, R.scene.elements[k], f)) return (PetscInt)k;
    for (const Part &p : R.scene.elements[k].parts) {
      if (p.store->isConstraint() || OwnerOf(*R.model, *p.store, p.index) != R.rank) continue;
      std::vector<double> component(p.store->rows());
      ReaderOf(R, p).components(e, component.data());
      if (!AllFinite(component.data(), (PetscInt)component.size())) return (PetscInt)k;
    }
  }
  return -1;
}

} // namespace hhtdae
