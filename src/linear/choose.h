/* What the sources of the choice share */
#ifndef HHTDAE_LINEAR_CHOOSE_H
#define HHTDAE_LINEAR_CHOOSE_H

#include "linear.h"

PetscErrorCode LinearOptionGiven(KSP ksp, const char name[], PetscBool *given);

/* Whether hhtconstraint is in use, and the tolerance of its Krylov method where nobody has set one */
PetscErrorCode LinearLoosen(KSP ksp, LinearChoice *choice);

/* The Krylov method in place of a factor, where no option names one */
PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice);

/* For a matrix whose factor is large, by default: *taken, where most unknowns are those of nodes of finite elements */
PetscErrorCode LinearPreferKrylov(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice, PetscBool *taken);

/* Types that were set for a Krylov method, back to those of a factor; nothing where they are the user's */
PetscErrorCode LinearTakeFactor(KSP ksp, LinearChoice *choice);

#endif
