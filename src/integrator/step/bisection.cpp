/*
  Corrections of alternating direction. With a force that is steep about one velocity and flat on both sides of it, as dry friction is, Newton's
  iteration jumps from one side to the other: the matrices of both sides do not contain the steep part, and each correction is about the negative
  of the last one. The solution lies between the two iterates. Bisection on the line between them finds it by the sign of the
  next correction with the same matrix (the natural level function of Deuflhard, Newton Methods for Nonlinear Problems, 2004,
  section 3.3). A new matrix made there contains the steep part.
*/
#include "corrector.h"
#include "estimate.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal even_middle  = 0.1; /* part of the difference between the ends by which phi in the middle may miss their mean */
constexpr int       max_halvings = 60; /* then the interval is rounding, and the force jumps */

/* The line X(s) = X(0) - s dX */
struct Line {
  Vec X, dX, begin, along, next; /* begin: X(0); along: dX weighted as in the norm of corrections; next: work space */
};

/* *phi: inner product of dX and the correction that the present matrix would make at X(s), NAN if the solve fails. F: the residual there. */
PetscErrorCode NextAlong(TS ts, const Line &l, PetscReal s, Vec F, PetscReal *phi)
{
  PetscScalar dot;
  PetscBool   solved;

  PetscFunctionBegin;
  PetscCall(VecWAXPY(l.X, -s, l.dX, l.begin));
  PetscCall(SNESComputeFunction(ts->snes, l.X, F));
  PetscCall(CorrectionFor(ts, F, l.next, &solved));
  PetscCall(VecDot(l.next, l.along, &dot));
  *phi = solved ? PetscRealPart(dot) : NAN;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bisection between s = 0, where phi is `begin`, and s = 1, where it has to be negative, until phi changes evenly between the ends.
   As long as the interval contains flat parts beside the steep one, phi in the middle is about that at one of the ends. */
PetscErrorCode Bisect(TS ts, const Line &l, PetscReal begin, Vec F, PetscReal *s, PetscBool *found)
{
  PetscReal low = 0, high = 1, at_low = begin, at_high = 0, phi = 0;

  PetscFunctionBegin;
  *s = 1;
  PetscCall(NextAlong(ts, l, *s, F, &at_high));
  if (!(at_high < 0)) PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < max_halvings && !*found; k++) {
    *s = 0.5 * (low + high);
    PetscCall(NextAlong(ts, l, *s, F, &phi));
    if (PetscIsInfOrNanReal(phi)) PetscFunctionReturn(PETSC_SUCCESS);
    *found = (PetscBool)(PetscAbsReal(phi - 0.5 * (at_low + at_high)) < even_middle * (at_low - at_high));
    if (phi > 0) low = *s, at_low = phi;
    else high = *s, at_high = phi;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode BisectIterates(TS ts, Vec X, Vec dX, Vec F, PetscBool *found)
{
  Integrator &I = Get(ts);
  WorkVec     begin, along, next;
  PetscScalar moved;
  PetscReal   s;

  PetscFunctionBegin;
  *found = PETSC_FALSE;
  for (WorkVec *v : {&begin, &along}) PetscCall(v->like(X, I.spare));
  PetscCall(next.like(X)); /* zeros, as the user may have set KSPSetInitialGuessNonzero() */
  PetscCall(VecWAXPY(begin, 1, dX, X));
  PetscCall(WeightCorrection(I, dX, along));
  PetscCall(VecDot(along, dX, &moved));
  PetscCall(Bisect(ts, {X, dX, begin, along, next}, PetscRealPart(moved), F, &s, found));
  if (!*found) PetscCall(VecWAXPY(X, -1, dX, begin));
  else PetscCall(PetscInfo(ts, "corrector: corrections alternate in direction at t = %g, h = %g; bisection goes to %g of the last one\n", (double)I.t1, (double)I.h, (double)s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
