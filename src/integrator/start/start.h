/* A consistent state at t_n: at the beginning of a run (start.cpp, project.cpp, transient.cpp), and where h has fallen by much or is too short for the corrector
   (restart.cpp). */
#ifndef HHTDAE_START_H
#define HHTDAE_START_H

#include "consistent.h"
#include <string>

namespace hht3
{

/* ts->time_step as TSCreate() makes it, and what stands for "not set": a rounding error less, so that a 0.1 of the user's differs */
constexpr PetscReal petsc_default_step = 0.1;
constexpr PetscReal unset_step         = petsc_default_step * (1 - PETSC_MACHINE_EPSILON);

/* What a consistent solve finds: its matrix, and gamma of (6c), or how it was differenced near by; or the factors of a matrix near by, and a need of four digits alone */
struct Prepared {
  bool   matrix = false, gamma = false;
  Levels levels;
  bool   near = false;
};

/* From vec_sol and vec_dot at ptime; history is forgotten */
PetscErrorCode StartFromSolution(TS ts);

/* How fast loads and motions are that depend on time alone, excitation.cpp */
PetscErrorCode FindExcitation(TS ts);
constexpr PetscReal unit_of_time      = 1;    /* the time scale of what is at rest in a run without end */
constexpr PetscReal coasting_fraction = 0.02; /* of the run: the longest step where nothing moves, though loads or motions follow time */
PetscErrorCode LookAhead(TS ts, PetscReal t, Vec U, Vec V);
PetscErrorCode WarnOfUnfollowedLoads(TS ts);

/* U0 and V0 projected on the constraints and a consistent start from there, before a step of another length than the last one, and when that is called for */
PetscErrorCode RestartConsistently(TS ts);
PetscErrorCode NeedsRestart(TS ts, PetscReal h, PetscBool *yes);
PetscBool      IsFarShorter(const Integrator &I, PetscReal h);

/* Whether a step of length h is so short that rounding would drown its accelerations; such a step by Taylor series: U1, V1, A1 and X as a corrected one would
   leave them */
PetscErrorCode IsTinyStep(TS ts, PetscReal h, PetscBool *tiny);
PetscErrorCode TinyStep(TS ts, PetscBool *tiny, PetscBool *ok);

/* The matrix of the start, [M Phi_q^T; Phi_q 0] at t_n, U0, V0, factored */
PetscErrorCode StartMatrix(TS ts);

/* Of use to the files of the start alone, from here on. Where no solve with that matrix is possible, NameRedundant() is the error that says why. */
PetscErrorCode NameRedundant(TS ts);

/* Where no step from t_n succeeds: a sentence about constraints that nearly depend on one another there, if there are any */
PetscErrorCode ExplainLock(TS ts, std::string *text);

/* ts->time_step from U0, V0, A0 and the rates of a consistent start, where the user has set none, also not since the set-up */
PetscErrorCode ChooseFirstStep(TS ts, Vec rate);

/* The local error that a step of length h from there leaves by these rates, in units of the tolerance */
PetscErrorCode ErrorOfStart(TS ts, Vec rate, PetscReal h, PetscReal *e);

/* For the restart that comes next: the application has changed what forces and constraints depend on */
PetscErrorCode NoteChange(TS ts);

/* Measures, reports and by choice mends U0, V0. Of what the start needs of the final ones, `prepared` says what has been made. */
PetscErrorCode CheckInitialState(TS ts, Prepared *prepared);

/* Whether the solution is what a step has left in t, U, V, but for less than the tolerance */
PetscErrorCode IsOwnState(TS ts, PetscReal t, Vec U, Vec V, PetscBool *own);

/* Whether a step that ended at t has left the time as it is; AcceptStep() may have moved it a little */
inline bool IsEndOf(TS ts, PetscReal t) { return PetscAbsReal(ts->ptime - t) <= PetscMax(1e-9 * Get(ts).h, 16 * PETSC_MACHINE_EPSILON * PetscAbsReal(t)); }

/* U0 and V0 to the nearest ones that the constraints allow */
PetscErrorCode ProjectState(TS ts, Prepared *prepared);

/* U0, V0, A0 hold a consistent start: the step ends before a function of an event that begins at its zero there comes back to it, events.cpp */
PetscErrorCode LimitStepByEvents(TS ts);

/* Everything of t_n from U0, V0: the common part of a start and of a consistent restart */
PetscErrorCode StartFromState(TS ts, Prepared &have);

/* X from U, V at t; X enters as the guess. h > 0: with the velocities and positions that the implicit Euler method reaches from U, V */
PetscErrorCode ConsistentAccelerations(TS ts, PetscReal t, PetscReal h, Vec U, Vec V, Prepared &have, PetscBool *ok);

/* U0, V0, A0 hold a consistent start and `rate` what follows from it, for a step of length h. Where a transient of time constant *tau is over long before the
   step ends, V0 is what it `leaves`, and the rest is to be made anew. */
PetscErrorCode RemoveTransient(TS ts, PetscReal h, Vec rate, Prepared &have, PetscReal *tau, PetscBool *leaves);

/* U and V a time d after U0, V0 by Taylor series with the accelerations A0 */
PetscErrorCode Advance(const Integrator &I, PetscReal d, Vec U, Vec V);

} // namespace hht3

#endif
