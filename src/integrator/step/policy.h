/* The decisions of the corrector as pure functions of numbers: when a matrix is due, and when an iteration has converged. "(n)" is the number of
   an equation in Negrut et al. (2005). */
#ifndef HHTDAE_POLICY_H
#define HHTDAE_POLICY_H

#include "integrator/formulas.h"

namespace hht3
{

struct ReuseOptions {
  PetscReal ratio     = 1.4;  /* h over the h of the matrix, or its inverse, beyond which the matrix is renewed */
  PetscReal slow_rate = 0.25; /* measured rate of convergence beyond which the next step gets a new matrix */
  PetscReal hold      = 1.2;  /* h does not grow by less than this factor, since that is not worth a new matrix */
  PetscBool given     = PETSC_FALSE; /* the user has set the three numbers */

  /* slow_rate if a matrix costs no factorization but only as much as a few solves: with 0.25 a step of fullbody of tests/bench takes
     9 corrections in place of 5 */
  static constexpr PetscReal slow_rate_without_factor = 0.1;
  ReuseOptions of(bool without_factor) const
  {
    ReuseOptions o = *this;
    if (without_factor && !given) o.slow_rate = slow_rate_without_factor;
    return o;
  }
};

/* What is known of the Newton matrix, and whether the next step gets another one */
struct MatrixPolicy {
  PetscBool have  = PETSC_FALSE; /* there is a matrix (10), perhaps of an earlier step */
  PetscBool want  = PETSC_TRUE;  /* a new matrix is to be made at the beginning of the next iteration */
  PetscBool fresh = PETSC_FALSE; /* the matrix was made in the present run of the iteration */
  PetscReal h     = 0;           /* EffectiveStep() of the matrix */
  PetscReal rate  = -1;          /* last measured rate of convergence with the matrix, -1 before the first measurement */
  PetscInt  renew_steps = 0;     /* number of steps that get a new matrix after an old one has failed; doubled while old ones go on failing */
  PetscInt  renew_left  = 0;     /* how many of these are still to come */

  static constexpr PetscInt max_renew_steps = 32;

  void made(PetscReal with)
  {
    have  = PETSC_TRUE;
    fresh = PETSC_TRUE;
    h     = with;
    rate  = -1;
  }

  /* The matrix can no longer be used, for instance after a change of coordinates or of the solver */
  void forget()
  {
    have = PETSC_FALSE;
    want = PETSC_TRUE;
    h    = 0;
    rate = -1;
  }

  /* Whether a step of size `now` needs a new matrix */
  bool due(PetscReal now, const ReuseOptions &o) const { return want || !have || !(h > 0) || now > o.ratio * h || now * o.ratio < h; }

  /* After the iteration of a step: `worst` is its largest rate, `retried` that it was repeated with a new matrix because an old one had failed */
  void learn(bool converged, bool retried, PetscReal worst, const ReuseOptions &o)
  {
    if (retried) renew_steps = renew_left = PetscClipInterval(2 * renew_steps, 1, max_renew_steps);
    else if (converged && !fresh) renew_steps = renew_left = 0;
    else if (renew_left > 0) renew_left--;
    want = (PetscBool)(!converged || worst >= o.slow_rate || renew_left > 0);
  }
};

/* Smallest rate that is assumed on the word of earlier steps: it was measured on smaller corrections, when the matrix was newer.
   With 0.02 the error that the first iterations left behind was up to ten times that of the step (heavy top, 1e-7); 0.3 costs
   5 to 20 % more iterations. */
constexpr PetscReal least_remembered_rate = 0.3;

/* A first correction below this part of the iteration's tolerance is accepted without a rate */
constexpr PetscReal immediate_tolerance = 0.1;

enum class Verdict { Converged, GoOn, Stalled, TooMany }; /* Stalled: at the measured rate the remaining iterations do not suffice */

/* The last two corrections, in units of the tolerance */
struct Corrections {
  PetscReal last = 0, before = 0;
  PetscInt  with_matrix = 0; /* number of corrections made with the present matrix in this iteration */
  PetscInt  left        = 0; /* number of corrections that may follow */
  bool      rough       = false; /* linear solves are inexact, as those of Krylov methods are */
  PetscReal rate() const { return last / before; }
  /* The error of a rough first solve may exceed the first correction in other directions. So a slow second correction says nothing;
     only the third one shows the rate. */
  bool tooEarly() const { return rough && with_matrix == 2; }
};

/* (40), (41b): converged as soon as the error left, rate/(1-rate) times the last correction, is below tol. After the first correction the rate of
   earlier steps is used (-1: there is none). Corrections below `floor` are rounding. */
inline Verdict JudgeCorrections(const Corrections &c, PetscReal known_rate, PetscReal tol, PetscReal floor)
{
  if (c.last <= floor) return Verdict::Converged;
  if (c.with_matrix < 2) {
    const bool known = known_rate >= 0 && CorrectorError(PetscMax(known_rate, least_remembered_rate), c.last) <= tol;
    return known || c.last <= immediate_tolerance * tol ? Verdict::Converged : c.left > 0 ? Verdict::GoOn : Verdict::TooMany;
  }
  const PetscReal xi = c.rate(), error = CorrectorError(xi, c.last);
  if (error <= tol) return Verdict::Converged;
  if (c.tooEarly() && c.left > 0) return Verdict::GoOn;
  return xi >= 1 || c.left <= 0 || PetscPowReal(xi, c.left) * error > tol ? Verdict::Stalled : Verdict::GoOn;
}

} // namespace hht3

#endif
