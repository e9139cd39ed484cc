/* User-defined variables, first-order states and user's forces. */
#include "runtime.h"

namespace hhtdae
{

PetscMPIInt OwnerOf(const Runtime &R, const Expression &e)
{
  if (R.size == 1) return 0;
  for (const Measure &m : e.arguments)
    for (Marker k : {m.i, m.j, m.frame})
      if (R.scene.valid(k) && R.scene.markers[k.id].body >= 0) return R.number.owner[R.scene.markers[k.id].body];
  return 0;
}

PetscErrorCode LocalizeExpressions(Runtime &R, Localizer &)
{
  PetscFunctionBegin;
  PetscCheck(R.scene.variables.empty() && R.scene.states.empty(), R.scene.comm, PETSC_ERR_SUP, "variables and states are on their way");
  PetscFunctionReturn(0);
}

} // namespace hhtdae
