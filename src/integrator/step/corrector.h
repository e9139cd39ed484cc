/* The corrector: when a matrix is made and kept (corrector.cpp), one run of SNES (iterate.cpp), when it ends (judge.cpp), corrections
   of alternating direction (bisection.cpp) and corrections that are rounding (rounding.cpp). */
#ifndef HHTDAE_CORRECTOR_H
#define HHTDAE_CORRECTOR_H

#include "integrator/state.h"
#include <initializer_list>

namespace hht3
{

/* The c of (40) that is used */
inline PetscReal CorrectorTolerance(const Integrator &I)
{
  return I.corrector.c_given || !I.constraints() ? I.corrector.c : ConstrainedTolerance(I.corrector.c, I.p.rho);
}

/* Puts the integrator's functions into the SNES and reads the user's settings from it, at set-up */
PetscErrorCode CorrectorSetUp(TS ts);

/* Solves (9) for X at t1 = t_n + h, from the prediction in X */
PetscErrorCode RunCorrector(TS ts, PetscBool *converged);

/* The convergence test of the SNES, unless the user has set another one */
PetscErrorCode SNESConverged_HHT(SNES snes, PetscInt it, PetscReal xnorm, PetscReal ynorm, PetscReal fnorm, SNESConvergedReason *reason, void *ctx);

/* Whether the vectors, the first of which is a residual at t, are finite; if not, I.failure names the row */
PetscErrorCode CheckNumbers(TS ts, PetscReal t, std::initializer_list<Vec> all, PetscBool *ok);

/* dX = J^{-1} r with the present Newton matrix, and its size in units of the tolerance, infinite if the solve fails. As no further
   correction follows that would remove the error of this one, the solve is an accurate one. */
PetscErrorCode CorrectionFor(TS ts, Vec r, Vec dX, PetscBool *solved);
PetscErrorCode SizeOfCorrectionFor(TS ts, Vec r, Vec dX, PetscReal *e);

/* Whether the linear solver has reported convergence with a dX that is zero or too short to be a solution. F is the residual before
   the correction or, if `after`, the one after it; then only a dX of zero is recognized. */
PetscErrorCode SolveFoundNothing(TS ts, Vec dX, Vec F, bool after, PetscBool *yes);

/* Safety factor on the rounding that rounding.cpp samples: with the four-bars of tests/stability/test_stiff.cpp one sample may be too
   small by as much */
constexpr PetscReal rounding_factor = 16;

/* From here on: for the sources of the corrector alone */

/* One run of SNES from the present X, with a new matrix if corrector.matrix.want */
PetscErrorCode RunSNES(TS ts, PetscBool *converged);

/* Counts and judges the correction dX of size e, which has led to X, and proves it if it is to be the last one. On return F holds the
   residual at X if `evaluated`. */
PetscErrorCode CountCorrection(TS ts, PetscReal e, Vec X, Vec dX, Vec F, PetscBool *evaluated);

/* After the correction dX, which has led to X: if the next one has the opposite direction, moves X to the zero between them; F is
   then the residual there */
PetscErrorCode BisectIterates(TS ts, Vec X, Vec dX, Vec F, PetscBool *found);

/* The size of the corrections at X that rounding errors of the residual make */
PetscErrorCode RoundingOfCorrection(TS ts, Vec X, PetscReal *e);

} // namespace hht3

#endif
