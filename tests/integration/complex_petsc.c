/* Loaded in front of PETSc, makes it say that its scalars are complex. */
#include <petscsys.h>

PETSC_EXTERN PetscErrorCode PetscDataTypeFromString(const char *name, PetscDataType *type, PetscBool *found)
{
  (void)name;
  *type  = PETSC_COMPLEX;
  *found = PETSC_TRUE;
  return 0;
}
