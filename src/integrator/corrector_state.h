/* What the corrector remembers of its matrix and of its corrections, and what is known of the forces that small corrections may hide. */
#ifndef HHTDAE_CORRECTOR_STATE_H
#define HHTDAE_CORRECTOR_STATE_H

#include "policy.h"
#include <petscsnes.h>

namespace hht3
{

/* The stopping test and the reuse ladder, section 5 of the paper */
struct CorrectorOptions : ReuseOptions {
  PetscReal c         = 1e-3; /* error left by the iteration, relative to the tolerance; see CorrectorTolerance() */
  PetscBool c_given   = PETSC_FALSE; /* by the user: taken as it is */
  PetscInt  max_it    = 10;
  PetscBool user_lag  = PETSC_FALSE; /* -snes_lag_jacobian: the user rules */
  PetscBool user_test = PETSC_FALSE; /* the user's test of SNES decides; corrections are only measured */
};

struct CorrectorState {
  MatrixPolicy matrix;
  PetscBool no_solve    = PETSC_FALSE; /* the last failure was one of the linear solve */
  PetscBool from_rest   = PETSC_FALSE; /* the last step went from where it began: at fixed steps a prediction may lead astray */
  PetscBool wrong_jacobian = PETSC_FALSE; /* as blame.cpp has seen in this correction */
  PetscBool rounding    = PETSC_FALSE; /* what is left of it is rounding */
  PetscReal blames      = 0;           /* how often of late: by one each time, down a little with every accepted step */
  PetscReal floor       = 0;           /* corrections below this are rounding of q */
  PetscReal wlte        = 1;           /* error estimate of the last accepted step, in units of the tolerance */

  PetscInt            it     = 0; /* of the present correction */
  PetscInt            base   = 0; /* iteration after which the present matrix came into use */
  PetscInt            renewals = 0; /* matrices made in the course of it */
  PetscInt            met    = 0; /* times that corrections have turned back and met */
  PetscReal           e      = 0; /* last correction, in units of the tolerance */
  PetscReal           xi_max = 0; /* worst rate of this correction */
  PetscReal           forces = 0; /* residual in the rows of driven coordinates, in units of the tolerance */
  SNESConvergedReason reason = SNES_CONVERGED_ITERATING;
};

struct Corrector : CorrectorOptions, CorrectorState {
  PetscInt limit() const { return max_it + 2 * met; } /* of iterations; -snes_max_it ends them before */
};

struct VerificationState {
  PetscReal largest = 0;            /* claim of the present matrix; 0: not known */
  PetscBool measured = PETSC_FALSE; /* inertia has been measured since the matrix was made */
  PetscBool looked   = PETSC_FALSE; /* the residual after the last correction was needed for its proof */
  unsigned  sample = 3;              /* of rounding, the next one of its own random numbers */
  PetscReal since = 0;              /* time since the residual was looked at last: forces may have been missing for so long */
};

/* Whether small corrections prove anything, verify.cpp */
struct Verification : VerificationState {
  Vec inertia = nullptr, claim = nullptr, noise = nullptr, model = nullptr, work = nullptr, where = nullptr; /* where: X of the matrix */
  Vec unproved = nullptr; /* time before `since` in which a row's residual has stayed as it was, whenever it was looked at */
  Vec defined = nullptr, product = nullptr, passed = nullptr; /* work of PassDefinitionsOn(), none where nothing is defined */
  Vec driven = nullptr; /* 1 for coordinates that the constraints alone move, driven.cpp; none where there are none */
};

} // namespace hht3

#endif
