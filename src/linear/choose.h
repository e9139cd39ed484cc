/* What the sources of the choice share */
#ifndef HHTDAE_LINEAR_CHOOSE_H
#define HHTDAE_LINEAR_CHOOSE_H

#include "linear.h"

PetscErrorCode LinearOptionGiven(KSP ksp, const char name[], PetscBool *given);

/* The Krylov method and its tolerance, where no option names them */
PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice);

#endif
