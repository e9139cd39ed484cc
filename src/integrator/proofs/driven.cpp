/*
  Driven coordinates: those of parts whose motion is given, which are determined by the constraints alone.

  The corrector is judged by corrections of the positions. Driven coordinates are right after the first correction, which says nothing about the
  forces that drive them. With an old matrix these forces are wrong, as the directions of the constraints have turned since. So the residual
  in the rows of driven coordinates is judged as if they were free: by the change of position that it would make in this step.

  This takes one more evaluation of the residual, unless the residual before the last correction was small enough, as it is where
  directions do not turn. The vehicle of the examples, whose wheels stand on posts that go up and down, takes 22 such evaluations in
  4,000 steps, in place of 2,834.
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

/* The tolerance of these forces is at least this part of CorrectorTolerance(): at fixed steps that of the iteration falls with the
   error of the last step, but forces have rounding (StiffStart.StrongDampingStopsAtOnce) */
constexpr PetscReal least_tolerance = 1e-4;
constexpr PetscReal driven_response = 1e-9; /* an acceleration below this part of force/inertia is rounding of the solve: driven */

/* The residual in the rows of driven coordinates, less its rounding as far as measured, in units of the tolerance */
PetscErrorCode InDriven(TS ts, Vec F, PetscReal *left)
{
  PetscReal sum[2];

  PetscFunctionBegin;
  PetscCall(SumRows(ts, sum, [](const RowScale &s, PetscReal local[], PetscReal driven, PetscReal f) { local[0] += PetscSqr(driven * PetscMax(0, PetscAbsReal(f) * s.answer - rounding_factor * s.rounding)); },
                    Read(Get(ts).verify.driven), Read(F)));
  *left = PetscSqrtReal(sum[0] / Get(ts).norm_size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A rotation vector counts as driven only if all its components do not move: a body that turns about one axis is not driven about the
   two others */
PetscErrorCode WholeRotations(const Integrator &I, Vec unmoved)
{
  PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(VecGetArray(unmoved, &x));
  for (PetscInt i : I.rotations.at) std::fill_n(x + i, 3, x[i] * x[i + 1] * x[i + 2]);
  PetscCall(VecRestoreArray(unmoved, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* unmoved: 1 for coordinates that do not accelerate under a force of random signs in all equations of motion, by the present factored
   matrix; 0 for other unknowns */
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

/* Finds the coordinates that may be driven, by the factored matrix of the start */
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

/* Called before a correction is judged. F: the residual before the correction, or after it if `evaluated`. A new matrix shows which
   coordinates are not driven after all, such as those of a pendulum that hung straight down at the start (Driven.FreeAfterAll). */
PetscErrorCode NoteForces(TS ts, Vec F, PetscBool evaluated)
{
  Integrator      &I = Get(ts);
  const Corrector &c = I.corrector;
  PetscInt         all = 0;
  WorkVec          unmoved;

  PetscFunctionBegin;
  if (!I.verify.driven) PetscFunctionReturn(PETSC_SUCCESS);
  if (c.matrix.fresh && c.it - c.base == 1) {
    PetscCall(unmoved.like(F)); /* zeros, as the user may have set KSPSetInitialGuessNonzero() */
    PetscCall(FindUnmoved(ts, unmoved));
    PetscCall(VecPointwiseMult(I.verify.driven, I.verify.driven, unmoved));
    PetscCall(CountDriven(I, &all));
    if (!all) PetscCall(VecDestroy(&I.verify.driven));
  }
  if (I.verify.driven && !evaluated) PetscCall(InDriven(ts, F, &I.corrector.forces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  PetscCall(MeasureRounding(ts, X, F, I.verify.noise)); /* what does not follow may be rounding (FullBodyDynamics.CantileverSwingsAtItsFrequency) */
  PetscCall(InDriven(ts, F, &c.forces));
  *good = (PetscBool)(c.forces <= tol);
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
