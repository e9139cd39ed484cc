/* Which force makes a residual that is not a number, for messages of the integrator: the row that it names belongs to a body, on which several forces may act. */
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

/* The first force of this rank with a component that is not a number in the state of the evaluation, or -1: the state itself has none, or the cause is another one */
PetscInt BadForce(Runtime &R, const Evaluation &e)
{
  const PetscInt known = R.n + (PetscInt)R.others.size();
  for (const double *x : {e.u, e.v})
    if (!AllFinite(x, known)) return -1;
  for (std::size_t k = 0; k < R.scene.elements.size(); k++)
    for (const Part &p : R.scene.elements[k].parts) {
      if (p.store->isConstraint() || OwnerOf(*R.model, *p.store, p.index) != R.rank) continue;
      std::vector<double> component(p.store->rows());
      ReaderOf(R, p).components(e, component.data());
      if (!AllFinite(component.data(), (PetscInt)component.size())) return (PetscInt)k;
    }
  return -1;
}

} // namespace hhtdae
