/*
  Backward differentiation of positions and of velocities, orders 3 to 5, as pure functions of the times of a history with variable steps.

  With tau_j = t_{n+1} - t_{n+1-j}, j = 1 ... k, the derivative at t_{n+1} of the polynomial through q_{n+1} and the last k values is

    q'_{n+1} = (q_{n+1} - psi_q) / (gamma h),  1/(gamma h) = Sum_j 1/tau_j,  psi_q = Sum_j c_j q_{n+1-j}

  and likewise q''_{n+1} from the velocities, so that

    q'_{n+1} = psi_v + gamma h q''_{n+1},  q_{n+1} = psi_q + gamma h psi_v + (gamma h)^2 q''_{n+1}

  which are (2a) and (2b) with beta = gamma^2 and other base values: unknowns, matrix (10) and scalings are those of order two. The
  equations of motion and the constraints hold at t_{n+1}. The local error of the positions is (Brenan, Campbell, Petzold 1996,
  section 5.2; Hairer, Norsett, Wanner, III.5)

    gamma h tau_1 ... tau_k q[t_{n+1}, ..., t_{n-k}] = gamma h/tau_{k+1} (q_{n+1} - extrapolation of the polynomial through the last k + 1 values)

  With index 3 and constant steps q, q' and lambda are of order k (Loetstedt, Petzold, Math. Comp. 46, 1986). A change of h leaves an error of
  order h^(k-1) in q'' and lambda for as many steps as the history has.
*/
#ifndef HHTDAE_BDF_H
#define HHTDAE_BDF_H

#include "integrator/formulas.h"

namespace hht3
{

constexpr PetscInt max_order = 5;

struct BDF {
  PetscReal gh;           /* gamma h */
  PetscReal c[max_order]; /* c_1, c_2, ..., factors of the values at t_n, t_{n-1}, ... */
};

/* The coefficients of order k, from tau_1 ... tau_k */
inline BDF BDFOf(PetscInt k, const PetscReal tau[])
{
  BDF       b   = {};
  PetscReal sum = 0;
  for (PetscInt j = 0; j < k; j++) sum += 1 / tau[j];
  b.gh = 1 / sum;
  for (PetscInt j = 0; j < k; j++) {
    b.c[j] = b.gh / tau[j];
    for (PetscInt i = 0; i < k; i++)
      if (i != j) b.c[j] *= tau[i] / (tau[i] - tau[j]);
  }
  return b;
}

/* The parameters, in place of HHT's, of a step of length h and order k, from tau_1 ... tau_{k+1} */
inline Parameters BDFParameters(PetscInt k, PetscReal h, const PetscReal tau[])
{
  const PetscReal gh = BDFOf(k, tau).gh;
  Parameters      p;
  p.rho     = 0;
  p.am      = p.af = p.am_s = p.af_s = 0;
  p.gamma   = p.gamma_s = gh / h;
  p.beta    = p.gamma * p.gamma;
  p.k       = p.beta * gh / tau[k];
  p.k_s     = 0; /* not used: the error of states is that of coordinates, ErrorOfOrder() */
  return p;
}

/* Scaled differences follow from values d_j at times t_0 > t_1 > ... by d_j = (d_j - d_{j+1}) times this factor, for m = 1, 2, ...:
   then d_0 is the m-th divided difference times tau_1 ... tau_m, tau_j = t_0 - t_j; with constant steps this is the m-th backward
   difference */
inline PetscReal DifferenceFactor(const PetscReal t[], PetscInt m, PetscInt j) { return (t[0] - t[m]) / (t[j] - t[j + m]); }

/* The error of a step of order k is this times the (k+1)-th scaled difference */
inline PetscReal ErrorFactor(PetscInt k, const PetscReal tau[]) { return BDFOf(k, tau).gh / tau[k]; }

/* The error of HHT in a step of length h is this times the third scaled difference, which is tau_1 tau_2 tau_3 q'''/6 */
inline PetscReal HHTErrorFactor(const Parameters &p, PetscReal h, const PetscReal tau[])
{
  return PetscAbsReal(p.k) * 6 * h / tau[0] * h / tau[1] * h / tau[2];
}

/* Weights of the values at the nodes x_0 ... x_k in the value at x of the polynomial through them; exactly one and zero if x is a node */
inline void LagrangeWeights(PetscInt k, const PetscReal node[], PetscReal x, PetscReal weight[])
{
  for (PetscInt j = 0; j <= k; j++) {
    weight[j] = 1;
    for (PetscInt i = 0; i <= k; i++)
      if (i != j) weight[j] *= (x - node[i]) / (node[j] - node[i]);
  }
}

} // namespace hht3

#endif
