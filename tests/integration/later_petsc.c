/* Loaded in front of PETSc, makes it say that it is a later one. */
#include <petscsys.h>

PETSC_EXTERN PetscErrorCode PetscGetVersionNumber(PetscInt *major, PetscInt *minor, PetscInt *subminor, PetscInt *release)
{
  *major    = PETSC_VERSION_MAJOR;
  *minor    = PETSC_VERSION_MINOR + 7;
  *subminor = 2;
  *release  = PETSC_VERSION_RELEASE;
  return 0;
}
