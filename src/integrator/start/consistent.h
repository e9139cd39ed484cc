/* Accelerations and multipliers at given positions and velocities, consistent.cpp, and the derivatives of the constraints in time that stand on the right-hand side
   of their equations, differentiate.cpp. */
#ifndef HHTDAE_CONSISTENT_H
#define HHTDAE_CONSISTENT_H

#include "integrator/state.h"

namespace hht3
{

/* The times over which a row's first and second differences were the best ones, as levels of differentiate.cpp: where they are known, those near by take the same */
struct Levels {
  std::vector<signed char> of[2];
  bool                     known = false;
};

/* Where they are solved for: in the vectors, matrix and solver of the run, or in those of samples between steps */
struct Consistent {
  Mat P   = nullptr; /* [M Phi_q^T; Phi_q 0] */
  Mat J   = nullptr; /* the application's operator beside it, which its Jacobian gets; null: P */
  KSP ksp = nullptr;
  Vec U = nullptr, V = nullptr, A = nullptr; /* the state; of it X has q'', s' and what is algebraic */
  Vec X = nullptr;
  Vec gamma = nullptr;               /* of the differentiated constraints (6b), (6c); null: there are none */
  Vec F = nullptr, d = nullptr;      /* residual, correction */
  PetscReal t    = 0;
  PetscReal tiny = 0; /* the step that stands in the matrix for h -> 0 */
  PetscReal h    = 0; /* of the implicit Euler method: q' = begin[1] + h q'', q = begin[0] + h^2 q''. 0: they are given */
  Vec begin[2] = {};
  LinearState *linear = nullptr; /* of P and ksp */
  PetscReal    T      = 0;       /* gamma is to be made again, for this time scale, once s' is known; 0: it need not */
  Levels      *levels = nullptr; /* of gamma */
  PetscReal    enough = 0;       /* part of the first correction below which no other one is needed; 0: to rounding */
  bool         near   = false;   /* the factors at hand, of a matrix near by, serve as well */
  PetscInt     its = 0, ksp_its = 0;
};

/* Those of samples between steps, evaluate_at.cpp. *S = null where there can be none. */
struct Sampler {
  Consistent  at;
  LinearState linear;
};

PetscErrorCode GetSampler(TS ts, Sampler **S);

/* The step in the matrix for h -> 0, of a time scale: h C/M and h^2 K/M must be nothing. With 1e-12 dampers of 1e12 M/T stood as inertia in the matrix,
   Start.StrongDampingIsNoInertia */
constexpr PetscReal vanishing_step = 1e-28;

/* Where the unknown of a role stands in U, U', U'' */
inline PetscScalar &UnknownOf(TSHHT3Role r, PetscScalar &u, PetscScalar &v, PetscScalar &a) { return r == TSHHT3_COORDINATE ? a : r == TSHHT3_STATE ? v : u; }

/* U, V, A from X, as far as X has them */
PetscErrorCode TakeUnknowns(const Integrator &I, Consistent &c);

/* The matrix at U, V, factored; the solve, with a new matrix unless there is one. why: what has gone wrong if not `ok` */
PetscErrorCode ConsistentMatrix(TS ts, Consistent &c, PetscBool *ok, const char **why);
PetscErrorCode SolveConsistent(TS ts, Consistent &c, bool have_matrix, PetscBool *ok, const char **why);

/* First and second time derivatives of the constraint rows along U + tau V, t + tau, at tau = 0: Phi' and Phi'' of holonomic rows, Psi and Psi' of velocity-level ones.
   Other rows are zero. Either output may be NULL. T: TimeScaleOfConstraints() */
PetscErrorCode ConstraintDerivatives(TS ts, PetscReal t, Vec U, Vec V, PetscReal T, Levels *levels, Vec first, Vec second);

/* Whether neither velocities nor time move what stands still */
PetscErrorCode IsAtRest(const Integrator &I, Vec V, PetscBool *yes);

/* A time over which the motion changes q by as much as its tolerance refers to, min Y_i/|q'_i|; another one over which constraints are differentiated along it: project.cpp */
PetscErrorCode TimeScale(TS ts, PetscReal *T);
PetscErrorCode TimeScaleOfAccelerations(TS ts, Vec A, PetscReal *T);
PetscErrorCode TimeScaleOfConstraints(TS ts, Vec V, PetscReal *T);
PetscErrorCode RelativeRate(TS ts, Vec x, PetscReal *most); /* the largest of coordinates' rates or accelerations x, each by the coordinate's size */

} // namespace hht3

#endif
