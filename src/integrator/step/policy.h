/* Decisions of the corrector on numbers alone: when a matrix is due, and when an iteration has converged. "(n)" is the number of an
   equation in Negrut et al. (2005). */
#ifndef HHTDAE_POLICY_H
#define HHTDAE_POLICY_H

#include "integrator/formulas.h"

namespace hht3
{

struct ReuseOptions {
  PetscReal ratio     = 1.4;  /* h over the h of the matrix, or its inverse, beyond which the matrix is renewed */
  PetscReal slow_rate = 0.25; /* measured rate beyond which the next step gets a new matrix */
  PetscReal hold      = 1.2;  /* growth of h that is not worth a new matrix */
  PetscBool given     = PETSC_FALSE; /* by the user */

  /* The same where a matrix costs no factorization, but as much as a few solves: with 0.25 a step of fullbody of tests/bench takes 9 corrections in place of 5 */
  static constexpr PetscReal slow_rate_without_factor = 0.1;
  ReuseOptions of(bool without_factor) const
  {
    ReuseOptions o = *this;
    if (without_factor && !given) o.slow_rate = slow_rate_without_factor;
    return o;
  }
};

/* The Newton matrix, what its use has shown, and whether the next correction gets another one */
struct MatrixPolicy {
  PetscBool have  = PETSC_FALSE; /* it is (10) of some earlier step */
  PetscBool want  = PETSC_TRUE;  /* renew it before the next correction */
  PetscBool fresh = PETSC_FALSE; /* it was made in the present correction */
  PetscReal h     = 0;           /* it was made with */
  PetscReal rate  = -1;          /* last measured rate with it, -1 before the first measurement */
  PetscInt  renew_steps = 0;     /* steps that get a new matrix after an old one has failed; doubled while old ones go on failing */
  PetscInt  renew_left  = 0;     /* of these, still to come */

  static constexpr PetscInt max_renew_steps = 32;

  void made(PetscReal with)
  {
    have  = PETSC_TRUE;
    fresh = PETSC_TRUE;
    h     = with;
    rate  = -1;
  }

  /* The matrix of the run is another one than that of the last steps: the next correction makes its own */
  void forget()
  {
    have = PETSC_FALSE;
    want = PETSC_TRUE;
    h    = 0;
    rate = -1;
  }

  /* Before a correction with the step `now` */
  bool due(PetscReal now, const ReuseOptions &o) const { return want || !have || !(h > 0) || now > o.ratio * h || now * o.ratio < h; }

  /* From the end of a correction, whose worst rate was `worst`; retried: with a new matrix after an old one had failed */
  void learn(bool converged, bool retried, PetscReal worst, const ReuseOptions &o)
  {
    if (retried) renew_steps = renew_left = PetscClipInterval(2 * renew_steps, 1, max_renew_steps);
    else if (converged && !fresh) renew_steps = renew_left = 0;
    else if (renew_left > 0) renew_left--;
    want = (PetscBool)(!converged || worst >= o.slow_rate || renew_left > 0);
  }
};

/* A remembered rate is believed down to here: it was measured steps ago on smaller corrections, and the matrix has aged since.
   With 0.02 the error that first iterations left behind was up to ten times that of the step (heavy top, 1e-7); 0.3 costs
   5 to 20 % more iterations. */
constexpr PetscReal least_remembered_rate = 0.3;

/* Of the tolerance: a correction so small needs no rate */
constexpr PetscReal immediate_tolerance = 0.1;

enum class Verdict { Converged, GoOn, Stalled, TooMany }; /* stalled: it does not converge in the iterations that are left */

/* Corrections with one matrix, in units of the tolerance */
struct Corrections {
  PetscReal last = 0, before = 0;
  PetscInt  with_matrix = 0; /* that were made with the present matrix in this iteration */
  PetscInt  left        = 0; /* that may follow */
  bool      rough       = false; /* each solve leaves a part, as Krylov methods do */
  PetscReal rate() const { return last / before; }
  /* What the first solve has left in other directions may be more than the first correction: a second one that is slow says nothing, the third tells the rate */
  bool tooEarly() const { return rough && with_matrix == 2; }
};

/* (40), (41b): converged as soon as the error left, rate/(1-rate) times the last correction, is below tol. A rate of earlier steps (-1: none)
   answers after the first correction; below `floor` corrections are rounding. */
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
