/* What the sources of the choice share */
#ifndef HHTDAE_LINEAR_CHOOSE_H
#define HHTDAE_LINEAR_CHOOSE_H

#include "linear.h"

PetscErrorCode LinearOptionGiven(KSP ksp, const char name[], PetscBool *given);

/* Whether hhtconstraint is in use, and the tolerance of its Krylov method where nobody has set one */
PetscErrorCode LinearLoosen(KSP ksp, LinearChoice *choice);

/* The Krylov method in place of a factor, where no option names one */
PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice);

#endif
