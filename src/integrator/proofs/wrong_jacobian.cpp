/* If the residual does not follow a correction (verify.cpp): whether the application's Jacobian is wrong, or the model has for
   instance a contact that ends */
#include "integrator/entries.h"
#include "proofs.h"
#include "verify.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal probe_fraction = 0.25; /* part of the correction by which probes go to either side: near, to avoid corners of the model, but well above rounding */
constexpr PetscReal least_answer   = 0.1;  /* ratio of actual to expected change below which the Jacobian is wrong: ten corrections would not suffice */

/* *answer: ratio of the actual change of the residual to the one that the matrix predicts, from the X at which the matrix was made to
   X - way dX; 1 if the Jacobian is right there. Only rows above rounding count; the constraint `forces` of dX are taken from
   the matrix. -1: there are no such rows. */
PetscErrorCode MeasureAnswer(TS ts, PetscReal way, Vec dX, Vec F_where, Vec forces, PetscReal *answer)
{
  Verification &v = Get(ts).verify;
  PetscReal     sum[2];
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
    [&](const RowScale &s, PetscReal local[], PetscReal m, PetscReal d) {
      const PetscReal model = m * s.answer;
      if (PetscAbsReal(way * model) < s.rounding) return;
      local[0] += d * s.answer * model;
      local[1] += way * model * model;
    },
    Read(v.model), Read(change)));
  *answer = sum[1] != 0 ? PetscAbsReal(sum[0] / sum[1]) : -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* The residual has not followed the correction dX, made with a matrix of this very iteration. That may be a property of the
   model, such as a contact that ends on the way. *wrong: the Jacobian is wrong where it was evaluated, as the residual there responds
   in neither direction along dX. */
PetscErrorCode CheckJacobian(TS ts, Vec dX, PetscBool *wrong)
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
  for (int k = 0; k < 2; k++) PetscCall(MeasureAnswer(ts, k ? -probe_fraction : probe_fraction, dX, F_where, forces, &answer[k]));
  *wrong = (PetscBool)(answer[0] >= 0 && answer[0] < least_answer && answer[1] >= 0 && answer[1] < least_answer);
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
  if (left.all > 0) PetscCall(CheckJacobian(ts, dX, &I.corrector.wrong_jacobian));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
