/* Checks that the running PETSc is the one that the library was built for */
#include "integrator/compat.h"

static const char instruction[] = "build hhtdae with the PETSc of this program, make -f makefile.petsc build PETSC_DIR=... PETSC_ARCH=...";

static const char *Flavour(PetscInt release) { return release ? "" : " (development)"; }

/*
  The layout of PETSc's objects and the values of its enumerations change with every minor version, and between a
  release and the development after it: a library built for another version would corrupt memory. This function calls
  only functions that are the same from 3.18 on. The width of PetscInt is checked first, since the PETSc functions
  called next write integers of PETSc's own width.
*/
PetscErrorCode HHT3CheckPetscVersion(void)
{
  PetscInt      number[4]; /* major, minor, subminor, release */
  size_t        width;
  PetscDataType scalar = PETSC_DATATYPE_UNKNOWN;
  PetscBool     found  = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscDataTypeGetSize(PETSC_INT, &width));
  PetscCheck(width == sizeof(PetscInt), PETSC_COMM_SELF, PETSC_ERR_LIB,
             "This libhhtdae was built for a PETSc with integers of %d bits, and one with %d runs: %s",
             (int)(8 * sizeof(PetscInt)), (int)(8 * width), instruction);
  PetscCall(PetscDataTypeFromString("scalar", &scalar, &found));
  PetscCheck(scalar == PETSC_DOUBLE, PETSC_COMM_SELF, PETSC_ERR_LIB, "hhtdae needs a PETSc with real scalars of double precision, and one with %s runs",
             scalar == PETSC_COMPLEX ? "complex scalars" : "scalars of another precision");
  PetscCall(PetscGetVersionNumber(&number[0], &number[1], &number[2], &number[3]));
  PetscCheck(number[0] == PETSC_VERSION_MAJOR && number[1] == PETSC_VERSION_MINOR && number[3] == PETSC_VERSION_RELEASE, PETSC_COMM_SELF,
             PETSC_ERR_LIB,
             "This libhhtdae was built for PETSc %d.%d%s, and PETSc %d.%d.%d%s runs: %s", PETSC_VERSION_MAJOR, PETSC_VERSION_MINOR,
             Flavour(PETSC_VERSION_RELEASE), (int)number[0], (int)number[1], (int)number[2], Flavour(number[3]), instruction);
  PetscFunctionReturn(PETSC_SUCCESS);
}
