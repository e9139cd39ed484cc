/* For libraries on top of the integrator: options by name, so that misspelt ones are reported when PETSc ends. */
#ifndef HHTDAE_OPTIONS_H
#define HHTDAE_OPTIONS_H

#include <petscsys.h>

/* A list ended by NULL; the first entry is the beginning that all others share */
PETSC_EXTERN PetscErrorCode TSHHT3DeclareOptions(const char *const[]);

#endif
