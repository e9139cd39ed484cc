/*
  Coordinates that the constraints alone move: parts whose motion is given.

  The corrector is judged by corrections of the positions. Those of driven coordinates are over with the first one and say nothing of the
  forces that drive them, which an old matrix gets wrong by what its directions have turned since. So where there are any, what the residual
  has left in their rows is judged as if they were free: by the change of position that it would make in this step.

  To see that takes a residual more, unless the one before the last correction was as good, as where directions do not turn: the vehicle of the
  examples, whose wheels stand on posts that go up and down, takes 22 of them in 4,000 steps, in place of 2,834.
*/
#include "integrator/step/corrector.h"
#include "integrator/entries.h"
#include "proofs.h"
#include "integrator/random.h"
#include "verify.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal least_tolerance = 1e-4; /* of the corrector's: at fixed steps the error of the last step takes the tolerance's place, down to here, as forces have rounding (StiffStart.StrongDampingStopsAtOnce) */
constexpr PetscReal driven_response = 1e-9; /* of what inertia alone would answer to a force: less is rounding of the solve */

/* The residual in the rows of driven coordinates, in units of the tolerance, above what is known of its rounding */
PetscErrorCode InDriven(TS ts, Vec F, PetscReal *left)
{
  PetscReal sum[4];

  PetscFunctionBegin;
  PetscCall(SumRows(ts, sum, [](const RowScale &s, PetscReal local[], PetscReal driven, PetscReal f) { local[0] += PetscSqr(driven * PetscMax(0, PetscAbsReal(f) * s.answer - rounding_factor * s.rounding)); },
                    Read(Get(ts).verify.driven), Read(F)));
  *left = PetscSqrtReal(sum[0] / Get(ts).norm_size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body that turns about any axis is not driven about those that happen to be across it */
PetscErrorCode WholeRotations(const Integrator &I, Vec unmoved)
{
  PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(VecGetArray(unmoved, &x));
  for (PetscInt i : I.rotations.at) std::fill_n(x + i, 3, x[i] * x[i + 1] * x[i + 2]);
  PetscCall(VecRestoreArray(unmoved, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1 for coordinates that do not answer a force of random signs in all rows of motion, by the factored matrix at hand, 0 for the other unknowns */
PetscErrorCode FindUnmoved(TS ts, Vec unmoved)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  PetscInt      first;
  PetscBool     solved;
  WorkVec       force;

  PetscFunctionBegin;
  PetscCall(force.like(unmoved, I.spare));
  PetscCall(VecGetOwnershipRange(force, &first, NULL));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar m, PetscScalar &f) { f = IsCoordinate(I, i) ? RandomSign(first + i, 2) * m : 0; }, Read(v.inertia), Write(force)));
  PetscCall(CorrectionFor(ts, force, unmoved, &solved));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar m, PetscScalar &a) { a = solved && IsCoordinate(I, i) && PetscRealPart(m) > 0 && PetscAbsScalar(a) < driven_response; }, Read(v.inertia), Write(unmoved)));
  PetscCall(WholeRotations(I, unmoved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode CountDriven(const Integrator &I, PetscInt *all)
{
  PetscScalar sum = 0;

  PetscFunctionBegin;
  if (I.verify.driven) PetscCall(VecSum(I.verify.driven, &sum));
  *all = (PetscInt)(PetscRealPart(sum) + 0.5);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which coordinates may be driven, by the factored matrix of the start */
PetscErrorCode NoteDriven(TS ts)
{
  Integrator &I = Get(ts);
  PetscInt    all = 0;

  PetscFunctionBegin;
  PetscCall(VecDestroy(&I.verify.driven));
  if (!I.constraints() || !I.verify.inertia) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(I.X, &I.verify.driven));
  PetscCall(FindUnmoved(ts, I.verify.driven));
  PetscCall(CountDriven(I, &all));
  if (all) PetscCall(PetscInfo(ts, "start: %" PetscInt_FMT " coordinates may be driven, their forces are judged by the residual\n", all));
  else PetscCall(VecDestroy(&I.verify.driven));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before a correction is judged. F: the residual that it answers, unless `evaluated` after it. A new matrix tells which coordinates are free after all: a pendulum that hung
   straight down at the start, Driven.FreeAfterAll. */
PetscErrorCode NoteForces(TS ts, Vec F, PetscBool evaluated)
{
  Integrator      &I = Get(ts);
  const Corrector &c = I.corrector;
  PetscInt         all = 0;
  WorkVec          unmoved;

  PetscFunctionBegin;
  if (!I.verify.driven) PetscFunctionReturn(PETSC_SUCCESS);
  if (c.matrix.fresh && c.it - c.base == 1) {
    PetscCall(unmoved.like(F)); /* a user may have zeros taken for a first guess */
    PetscCall(FindUnmoved(ts, unmoved));
    PetscCall(VecPointwiseMult(I.verify.driven, I.verify.driven, unmoved));
    PetscCall(CountDriven(I, &all));
    if (!all) PetscCall(VecDestroy(&I.verify.driven));
  }
  if (I.verify.driven && !evaluated) PetscCall(InDriven(ts, F, &I.corrector.forces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a correction that would be the last: whether forces of driven coordinates are as good as accelerations of free ones, at `tolerance`.
   F holds the residual at X if `evaluated`, which it then is. */
PetscErrorCode ForcesOfDriven(TS ts, PetscReal tolerance, Vec X, Vec F, PetscBool *evaluated, PetscBool *good)
{
  Integrator     &I      = Get(ts);
  Corrector      &c      = I.corrector;
  const PetscReal before = c.forces, tol = PetscMax(tolerance, least_tolerance * CorrectorTolerance(I));

  PetscFunctionBegin;
  *good = (PetscBool)(!I.verify.driven || (!*evaluated && before <= tol));
  if (*good) PetscFunctionReturn(PETSC_SUCCESS);
  if (!*evaluated) PetscCall(SNESComputeFunction(ts->snes, X, F));
  *evaluated = PETSC_TRUE;
  PetscCall(InDriven(ts, F, &c.forces));
  *good = (PetscBool)(c.forces <= tol);
  if (*good || c.it - c.base < 2) PetscFunctionReturn(PETSC_SUCCESS);
  if (c.forces < unanswered_fraction * before) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MeasureRounding(ts, X, F, I.verify.noise)); /* FullBodyDynamics.CantileverSwingsAtItsFrequency */
  PetscCall(InDriven(ts, F, &c.forces));
  *good = (PetscBool)(c.forces <= tol);
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
