/* The corrector: when a matrix is made and kept (corrector.cpp), one run of SNES (iterate.cpp), when it ends (judge.cpp), corrections that turn back
   (bisection.cpp) and those that are rounding (rounding.cpp). */
#ifndef HHTDAE_CORRECTOR_H
#define HHTDAE_CORRECTOR_H

#include "integrator/state.h"
#include <initializer_list>

namespace hht3
{

/* c of (40) in force */
inline PetscReal CorrectorTolerance(const Integrator &I)
{
  return I.corrector.c_given || !I.constraints() ? I.corrector.c : ConstrainedTolerance(I.corrector.c, I.p.rho);
}

/* Our hooks and the user's settings in the SNES, at set-up */
PetscErrorCode CorrectorSetUp(TS ts);

/* Solves (9) for X at t1 = t_n + h, from the prediction in X */
PetscErrorCode RunCorrector(TS ts, PetscBool *converged);

/* That of SNES, where it is ours */
PetscErrorCode SNESConverged_HHT(SNES snes, PetscInt it, PetscReal xnorm, PetscReal ynorm, PetscReal fnorm, SNESConvergedReason *reason, void *ctx);

/* Whether the vectors, the first of which is a residual at t, are finite; if not, I.failure names the row */
PetscErrorCode CheckNumbers(TS ts, PetscReal t, std::initializer_list<Vec> all, PetscBool *ok);

/* The correction that the matrix at hand makes of a residual r, and its size, 0 if it has none. No other correction follows. */
PetscErrorCode CorrectionFor(TS ts, Vec r, Vec dX, PetscBool *solved);
PetscErrorCode SizeOfCorrectionFor(TS ts, Vec r, Vec dX, PetscReal *e);

/* Whether what the run's linear solver has made of a residual is zero, or too short, and so no solution whatever it says. F: the residual before the correction,
   or after it, which shows whether it was zero alone */
PetscErrorCode SolveFoundNothing(TS ts, Vec dX, Vec F, bool after, PetscBool *yes);

/* One sample of rounding (rounding.cpp) may miss what the four-bars of tests/stability/test_stiff.cpp have by this factor */
constexpr PetscReal rounding_factor = 16;

/* Of use to the files of the corrector alone, from here on. One run of SNES from the present X, with a new matrix if the policy wants one */
PetscErrorCode RunSNES(TS ts, PetscBool *converged);

/* The correction dX of size e has led to X: judged, and proved if it is to be the last one. F holds the residual at X on return if `evaluated`. */
PetscErrorCode CountCorrection(TS ts, PetscReal e, Vec X, Vec dX, Vec F, PetscBool *evaluated);

/* The correction dX has led to X. If the next one turns back, X is moved to where the two meet, and F is the residual there. */
PetscErrorCode BisectIterates(TS ts, Vec X, Vec dX, Vec F, PetscBool *found);

/* The size of a correction that is rounding, at X */
PetscErrorCode RoundingOfCorrection(TS ts, Vec X, PetscReal *e);

} // namespace hht3

#endif
