/* For libraries on top of the integrator: they declare the names of their options, so that misspelt options are reported in PetscFinalize(). */
#ifndef HHTDAE_OPTIONS_H
#define HHTDAE_OPTIONS_H

#include <petscsys.h>

/* The list ends with NULL; its first entry is the prefix that all other entries begin with */
PETSC_EXTERN PetscErrorCode TSHHT3DeclareOptions(const char *const[]);

#endif
