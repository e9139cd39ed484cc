/*
  The formulas of the method, as pure functions. "(n)" is the number of an equation in Negrut et al. (2005).

  Both forms use (2): the unknown is an algorithmic acceleration a, from which q and q' follow. They differ in the acceleration
  in the equations of motion:

    paper form (9a)       a itself, divided by 1+alpha, and the forces averaged between both ends of the step
    second-order form     (1-af) q''_{n+1} + af q''_n = (1-am) a_{n+1} + am a_n,  equations of motion exact at t_{n+1}

  First-order states s are integrated by the first-order generalized-alpha method of the same spectral radius. With it
  d s' / d s = d q' / d q = gamma/(beta h), so that the Jacobian of TSSetI2Jacobian() is needed with one shift sigma_v only.
*/
#ifndef HHTDAE_FORMULAS_H
#define HHTDAE_FORMULAS_H

#include <petscsys.h>

namespace hht3
{

struct Parameters {
  PetscReal rho;             /* spectral radius at infinite h omega */
  PetscReal am, af;          /* generalized-alpha averages; HHT is am = 0, af = -alpha */
  PetscReal gamma, beta;     /* (5) */
  PetscReal k;               /* position error k h^2 (a_{n+1} - a_n), (26) */
  PetscReal am_s, af_s;      /* the same averages for first-order states */
  PetscReal gamma_s;         /* s_{n+1} = s_n + h [(1-gamma_s) w_n + gamma_s w_{n+1}] */
  PetscReal k_s;             /* local error k_s h^3 s''' of a first-order state */
  PetscReal lag() const { return am - af; }         /* a_n is q'' at t_n + lag h */
  PetscReal lagState() const { return am_s - af_s; } /* w_n is s' at t_n + lagState h */
  PetscReal jerk_factor() const { return beta + lag() / 2 - (PetscReal)1 / 6; } /* (2a) misses q by this times h^3 q''' */
  PetscReal ca() const { return (1 - am) / (1 - af); } /* d q''_{n+1} / d a_{n+1}; 1/(1+alpha) for HHT */
};

/* First-order generalized-alpha (Jansen, Whiting, Hulbert 2000) of spectral radius rho. With equal steps its averages give
   w_n = s' + l h s'' + l (am - 1/2) h^2 s''' at t_n, l = am - af, from which k_s follows. */
inline void StateParameters(PetscReal rho, Parameters &p)
{
  p.am_s    = (3 * rho - 1) / (2 * (1 + rho));
  p.af_s    = rho / (1 + rho);
  p.gamma_s = 1 / (1 + rho);
  const PetscReal l = p.lagState();
  p.k_s = l * (p.am_s - (PetscReal)0.5) + p.gamma_s * (l + (PetscReal)0.5) - (PetscReal)1 / 6;
}

/* HHT of parameter alpha in [-1/3, 0]: (5), and k of (26) for the paper's form. In the second-order form a_n is q'' at
   t_n + alpha h, before t_n, which makes the leading error of the position beta + alpha/2 - 1/6 times h^2 (a_{n+1} - a_n). */
inline Parameters HHTParameters(PetscReal alpha, bool paper)
{
  Parameters p;
  p.rho   = (1 + alpha) / (1 - alpha);
  p.am    = 0;
  p.af    = -alpha;
  p.gamma = (1 - 2 * alpha) / 2;
  p.beta  = (1 - alpha) * (1 - alpha) / 4;
  p.k     = paper ? p.beta - 1 / (6 * (1 + alpha)) : p.beta + p.lag() / 2 - (PetscReal)1 / 6;
  StateParameters(p.rho, p);
  return p;
}

/* Chung and Hulbert (1993): generalized-alpha of spectral radius rho in [0, 1] */
inline Parameters RadiusParameters(PetscReal rho)
{
  Parameters p;
  p.rho   = rho;
  p.am    = (2 * rho - 1) / (rho + 1);
  p.af    = rho / (rho + 1);
  p.gamma = (PetscReal)0.5 - p.am + p.af;
  p.beta  = (p.gamma + (PetscReal)0.5) * (p.gamma + (PetscReal)0.5) / 4;
  p.k     = p.beta + p.lag() / 2 - (PetscReal)1 / 6;
  StateParameters(rho, p);
  return p;
}

/* Shifts of TSI2Jacobian, and the scalings that make it the matrix (10): rows of holonomic constraints times 1/(beta h^2),
   velocity-level rows times 1/(gamma h), columns of q times beta h^2, of states times gamma_s h */
inline PetscReal ShiftV(const Parameters &p, PetscReal h) { return p.gamma / (p.beta * h); }
inline PetscReal ShiftA(const Parameters &p, PetscReal h) { return p.ca() / (p.beta * h * h); }
inline PetscReal ScalePosition(const Parameters &p, PetscReal h) { return p.beta * h * h; }
inline PetscReal ScaleVelocity(const Parameters &p, PetscReal h) { return p.gamma * h; }
inline PetscReal ScaleState(const Parameters &p, PetscReal h) { return p.gamma_s * h; }

/* The factors of a_n in (2a) and (2b); those of a_{n+1} are ScalePosition() and ScaleVelocity() */
inline PetscReal OldPosition(const Parameters &p, PetscReal h) { return h * h * ((PetscReal)0.5 - p.beta); }
inline PetscReal OldVelocity(const Parameters &p, PetscReal h) { return h * (1 - p.gamma); }

/* Damping of the multipliers' oscillation relative to that at alpha = -0.05 (or its spectral radius), between 0 and 1. With Phi = 0
   the accelerations normal to the constraints have the double eigenvalue -rho: an error that one step leaves in q or q' is amplified
   by 1/(1-rho) before it decays, and one that every step leaves, by 1/(1-rho)^2. */
inline PetscReal RelativeDamping(PetscReal rho) { return PetscMin(1, (1 - rho) * (PetscReal)(1.05 / 0.1)); }

/* c of (40) for a system with constraints: so small that c/(1-rho)^2 does not exceed its value at alpha = -0.05, but not below 1e-5
   c. At rho = 1 nothing is damped, and the errors that the iterations leave, which add up, are small. */
inline PetscReal ConstrainedTolerance(PetscReal c, PetscReal rho)
{
  const PetscReal d = RelativeDamping(rho);
  return c * PetscMax(d * d, (PetscReal)1e-5);
}

/* (40), (41b): the error left after a correction of size e (in units of the tolerance) at rate xi */
inline PetscReal CorrectorError(PetscReal xi, PetscReal e) { return xi < 1 ? xi / (1 - xi) * e : PETSC_MAX_REAL; }

} // namespace hht3

#endif
