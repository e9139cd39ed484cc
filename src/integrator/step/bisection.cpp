/*
  Corrections that turn back. A force that is steep about one velocity and flat on both sides of it, as dry friction is, throws Newton's
  iteration from one side to the other: on either side the matrix knows nothing of the steep part, and each correction is the last one
  with the other sign. The solution lies between the two iterates. It is looked for on the line that joins them, by the sign of what the
  next correction with the same matrix would be (the natural level function of Deuflhard, Newton Methods for Nonlinear Problems, 2004,
  section 3.3); there a new matrix sees the steep part.
*/
#include "corrector.h"
#include "estimate.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal even_middle  = 0.1; /* a middle so far from the mean of both ends, of their difference: the steep part is met */
constexpr int       max_halvings = 60; /* beyond rounding: the force jumps */

/* What the iterates of the line X(s) = X(0) - s dX share */
struct Line {
  Vec X, dX, begin, along, next; /* begin: X(0); along: dX weighted as in the norm of corrections; next: work */
};

/* along * the correction that the matrix would make at X(s); F: the residual there. Not a number if it makes none. */
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

/* Bisection between s = 0, where phi is `begin`, and s = 1, where it has to be negative, until phi changes evenly between the ends: while the
   steep part lies between flat ones, the middle is about as far as one of the ends */
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

/* The correction dX has led to X. If the next one turns back, X is moved to where the two meet, and F is the
   residual there. */
PetscErrorCode BisectIterates(TS ts, Vec X, Vec dX, Vec F, PetscBool *found)
{
  Integrator &I = Get(ts);
  WorkVec     begin, along, next;
  PetscScalar moved;
  PetscReal   s;

  PetscFunctionBegin;
  *found = PETSC_FALSE;
  for (WorkVec *v : {&begin, &along}) PetscCall(v->like(X, I.spare));
  PetscCall(next.like(X)); /* a user may have zeros taken for a first guess */
  PetscCall(VecWAXPY(begin, 1, dX, X));
  PetscCall(WeightCorrection(I, dX, along));
  PetscCall(VecDot(along, dX, &moved));
  PetscCall(Bisect(ts, {X, dX, begin, along, next}, PetscRealPart(moved), F, &s, found));
  if (!*found) PetscCall(VecWAXPY(X, -1, dX, begin));
  else PetscCall(PetscInfo(ts, "corrector: corrections turn back at t = %g, h = %g; the solution is at %g of the last one\n", (double)I.t1, (double)I.h, (double)s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
