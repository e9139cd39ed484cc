/* What the sources of the choice share */
#ifndef HHTDAE_LINEAR_CHOOSE_H
#define HHTDAE_LINEAR_CHOOSE_H

#include "linear.h"

PetscErrorCode LinearOptionGiven(KSP ksp, const char name[], PetscBool *given);

/* The tolerance of a Krylov method with hhtconstraint, where nobody has set one */
PetscErrorCode LinearLoosen(KSP ksp);

/* The Krylov method in place of a factor, where no option names one */
PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice);

#endif
