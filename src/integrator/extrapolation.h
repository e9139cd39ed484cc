/* The predictor's polynomial as the body of a sweep; section 6 of the paper, see predictor.cpp. */
#ifndef HHTDAE_EXTRAPOLATION_H
#define HHTDAE_EXTRAPOLATION_H

#include "impl.h"
#include "sweeps.h"

namespace hht3
{

/* x = D_0 + factor_1 D_1 + ... */
template <int degree>
struct Extrapolation {
  const PetscScalar *D[degree + 1];
  PetscReal          factor[degree + 1];
  PetscScalar       *x;

  template <class At>
  HHT3_INLINE void operator()(const At &at) const
  {
    Four sum = at.get(D[0]);
    for (int k = 1; k <= degree; k++) sum += factor[k] * at.get(D[k]);
    at.put(x, sum);
  }
};

/* use(extrapolation) with the arrays of the differences and of X, for the degree in use and the time t */
template <int degree, class Use>
PetscErrorCode ExtrapolateBy(const Predictor &p, PetscReal t, Vec X, const Use &use)
{
  Extrapolation<degree> e;

  PetscFunctionBegin;
  e.factor[0] = 1;
  for (int k = 1; k <= degree; k++) e.factor[k] = e.factor[k - 1] * (t - p.t[k - 1]);
  for (int k = 0; k <= degree; k++) PetscCall(VecGetArrayRead(p.D[k], &e.D[k]));
  PetscCall(VecGetArrayWrite(X, &e.x));
  use(e);
  PetscCall(VecRestoreArrayWrite(X, &e.x));
  for (int k = 0; k <= degree; k++) PetscCall(VecRestoreArrayRead(p.D[k], &e.D[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <class Use>
PetscErrorCode Extrapolate(const Predictor &p, PetscReal t, Vec X, const Use &use)
{
  static_assert(max_degree == 3, "one case for each degree");

  PetscFunctionBegin;
  switch (p.degree) {
  case 0: PetscCall(ExtrapolateBy<0>(p, t, X, use)); break;
  case 1: PetscCall(ExtrapolateBy<1>(p, t, X, use)); break;
  case 2: PetscCall(ExtrapolateBy<2>(p, t, X, use)); break;
  default: PetscCall(ExtrapolateBy<3>(p, t, X, use)); break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

#endif
