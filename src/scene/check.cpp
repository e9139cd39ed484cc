/* What can be wrong with a description, found before anything is numbered and reported all at once. */
#include "measures.h"
#include "runtime.h"

namespace hhtdae
{

PetscErrorCode CheckDescription(SceneData &s)
{
  std::string all;
  PetscFunctionBegin;
  PetscCheck(!s.bodies.empty(), s.comm, PETSC_ERR_ARG_WRONGSTATE, "the scene has no bodies");
  std::vector<std::string> errors = s.errors;
  CheckExpressions(s, errors);
  for (const std::string &e : errors) all += "\n  " + e;
  PetscCheck(all.empty(), s.comm, PETSC_ERR_ARG_WRONG, "the scene cannot be built:%s", all.c_str());
  PetscFunctionReturn(0);
}

} // namespace hhtdae
