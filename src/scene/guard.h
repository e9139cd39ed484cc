/* Users' functions may throw: at the border to PETSc, which is C, it becomes an error. */
#ifndef HHTDAE_SCENE_GUARD_H
#define HHTDAE_SCENE_GUARD_H

#include <exception>
#include <petscsys.h>

namespace hhtdae
{

template <class Call> PetscErrorCode Guarded(Call call)
{
  try {
    return call();
  } catch (const std::exception &e) {
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "A function of the scene's user has failed: %s", e.what());
  } catch (...) {
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "A function of the scene's user has thrown something that is no std::exception");
  }
}

} // namespace hhtdae

#endif
