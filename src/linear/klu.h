/* KLU as PETSc has it, but a singular matrix fails the linear solve instead of ending the program */
#ifndef HHTDAE_LINEAR_KLU_H
#define HHTDAE_LINEAR_KLU_H

#include <petscmat.h>

/* Does nothing where PETSc was built without KLU */
PetscErrorCode LinearRegisterKLU(void);

#endif
