/* Is it the model that the residual does not follow a correction, or is the application's Jacobian wrong? See verify.cpp */
#include "integrator/entries.h"
#include "proofs.h"
#include "verify.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal probe_fraction = 0.25; /* of the correction, to either side: near enough for a model without corners there, and far out of rounding */
constexpr PetscReal above_rounding = 10;   /* times rounding: changes that a row shows */
constexpr PetscReal least_answer   = 0.1;  /* part of a correction that the residual answers: below it the iteration does not converge in ten */

bool HasFollowed(const RowScale &s, PetscReal now, PetscReal was) { return PetscAbsReal(now) * s.answer <= unanswered_fraction * PetscAbsReal(was) * s.answer + s.rounding; }

/* How much of the change that the matrix expects on a part `way` of dX, from where the matrix was made, the residual shows: 1 if the Jacobian
   is right there. In the rows that have not followed dX, as far as they stand out of rounding; the constraint `forces` of dX are taken as the
   matrix has them. -1: there are no such rows. */
PetscErrorCode MeasureAnswer(TS ts, PetscReal way, Vec dX, Vec F, Vec F_where, Vec forces, PetscReal *answer)
{
  Verification &v = Get(ts).verify;
  PetscReal     sum[4];
  WorkVec       Y, change;

  PetscFunctionBegin;
  PetscCall(Y.like(dX, Get(ts).spare));
  PetscCall(change.like(dX, Get(ts).spare));
  PetscCall(VecWAXPY(Y, -way, dX, v.where));
  PetscCall(SNESComputeFunction(ts->snes, Y, change));
  PetscCall(VecAYPX(change, -1, F_where));
  PetscCall(SubstituteDefinitions(ts, change));
  PetscCall(VecAXPY(change, -way, forces));
  PetscCall(SumRows(
    ts, sum,
    [&](const RowScale &s, PetscReal local[], PetscReal f, PetscReal m, PetscReal d) {
      const PetscReal model = m * s.answer;
      if (PetscAbsReal(way * model) < above_rounding * s.rounding || HasFollowed(s, f, m)) return;
      local[1] += d * s.answer * model;
      local[2] += way * model * model;
    },
    Read(F), Read(v.model), Read(change)));
  *answer = sum[2] != 0 ? PetscAbsReal(sum[1] / sum[2]) : -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* The residual at X does not follow the correction dX, made with a matrix of this very step: is that a property of the model, such as a
   contact that ends on the way, or is the Jacobian wrong where it was evaluated? There one of the two directions along dX must answer. */
PetscErrorCode CheckJacobian(TS ts, Vec dX, Vec F, PetscBool *wrong)
{
  Verification &v = Get(ts).verify;
  PetscReal     answer[2];
  WorkVec       F_where, forces;

  PetscFunctionBegin;
  PetscCall(F_where.like(dX, Get(ts).spare));
  PetscCall(forces.like(dX, Get(ts).spare));
  PetscCall(VecCopy(v.work, forces));
  PetscCall(SubstituteDefinitions(ts, forces));
  PetscCall(SNESComputeFunction(ts->snes, v.where, F_where));
  for (int k = 0; k < 2; k++) PetscCall(MeasureAnswer(ts, k ? -probe_fraction : probe_fraction, dX, F, F_where, forces, &answer[k]));
  *wrong = (PetscBool)(answer[0] >= 0 && answer[0] < least_answer && answer[1] >= 0 && answer[1] < least_answer);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a correction that has failed with a matrix of its own: whether the residual has not answered it at all */
PetscErrorCode BlameJacobian(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated)
{
  Integrator &I = Get(ts);
  Imbalance   left;

  PetscFunctionBegin;
  if (!I.corrector.matrix.fresh || !MayHideForces(I)) PetscFunctionReturn(PETSC_SUCCESS);
  if (!*evaluated) PetscCall(SNESComputeFunction(ts->snes, X, F));
  *evaluated = PETSC_TRUE;
  PetscCall(ModelResidual(ts, dX));
  PetscCall(CompareAboveRounding(ts, X, F, 0, &left));
  if (left.all > 0) PetscCall(CheckJacobian(ts, dX, F, &I.corrector.wrong_jacobian));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
