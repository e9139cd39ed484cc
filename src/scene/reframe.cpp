#include "runtime.h"
namespace hhtdae
{
PetscErrorCode AttachReframing(Runtime &, TS)
{
  PetscFunctionBegin;
  PetscFunctionReturn(0);
}
} // namespace hhtdae
