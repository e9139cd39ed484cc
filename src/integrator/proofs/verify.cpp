/*
  Whether a small correction proves anything.

  The corrector stops when corrections are small. Where the Newton matrix claims far more stiffness than there is, because it
  is old and what held the system has let go, or because the application's Jacobian is wrong, corrections are small whatever
  the residual, a rate of earlier steps knows nothing of it, and neither does the error test. So the claim itself is measured:

    claim_i = P_ii / (ca M_ii)        how much stiffer than inertia the matrix says that unknown i is
    E       = |k| h^2 |claim dX|      what the correction would have been, were there only inertia

  Where the matrix claims nothing, E is the correction and nothing is to be done. Else accelerations of up to A = E/(|k| h^2) may be
  missing since the last proof, a time T ago, and with them positions of A T^2/2. Before this exceeds a part of the tolerance, the
  residual is evaluated once more after the last correction. It must have followed: what is left of every entry is below
  `unanswered_fraction` times what it was (P dX, the linear model that the correction has solved), or rounding, which is then measured (stiffness.cpp),
  or too little to move the positions: within this step, and since its own last proof where an entry has stayed as it was. A few of many
  entries look so by chance, other ones each time: so T is a row's own.

  Otherwise the iteration goes on; the rate that it then measures, or a new matrix, settles the matter.
*/
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "proofs.h"
#include "verify.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal allowed_unproved      = 0.1; /* unproved change of positions, in units of the tolerance */
constexpr PetscReal explained_by_rounding = 0.9; /* of an imbalance that a sample of rounding has explained in part */

/* Largest change of the positions, in units of the tolerance, by accelerations that would have made a correction of E = |k| h^2 a, over one step */
PetscReal PositionChange(const Integrator &I, PetscReal E) { return E / (2 * PetscAbsReal(I.p.k)); }

/* The same by accelerations that the correction dX may have missed in each row since it was proved. Definitions hide stiffness from the
   diagonal: then what inertia alone would make of the model counts */
PetscErrorCode StiffnessClaimed(TS ts, Vec dX, PetscReal *drift)
{
  Integrator &I = Get(ts);
  PetscReal   sum[4];

  PetscFunctionBegin;
  if (HasDefinitions(I)) {
    PetscCall(ModelResidual(ts, dX));
    PetscCall(SumRows(ts, sum, [](const RowScale &s, PetscReal local[], PetscReal model) { local[0] += PetscSqr(model * s.answer * PetscSqr(s.steps)); }, Read(I.verify.model)));
  } else /* claim dX is P_ii dX_i / inertia_i: the diagonal's part of the model */
    PetscCall(SumRows(ts, sum, [](const RowScale &s, PetscReal local[], PetscReal d, PetscReal c) { local[0] += PetscSqr(c * d * s.claimed * PetscSqr(s.steps)); }, Read(dX), Read(I.verify.claim)));
  *drift = PositionChange(I, PetscSqrtReal(sum[0] / I.norm_size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A row of the residual after a correction, as a correction that inertia alone would make */
struct Row {
  PetscReal is, was, excess; /* excess: of what may be left of it */

  Row(const RowScale &s, bool known, PetscReal f, PetscReal model, PetscReal force)
    : is(f * s.answer), was(model * s.answer), excess(PetscMax(0, PetscAbsReal(is) - unanswered_fraction * (PetscAbsReal(was) + (known ? PetscAbsReal(force) * s.answer : 0)) - s.rounding))
  {
  }
  bool stays() const { return excess > 0 && PetscAbsReal(is - was) < 0.5 * PetscAbsReal(was); }
};

/* The iteration has been seen to converge: what is left of constraint forces is a part of what they were */
bool RateIsKnown(const Integrator &I) { return I.corrector.matrix.rate >= 0; }

/* R: the residual F, with definitions what they make of it in the equations of motion, which then stands in `passed` */
PetscErrorCode ResidualOfMotion(TS ts, Vec F, WorkVec &passed, Vec *R)
{
  PetscFunctionBegin;
  *R = F;
  if (!HasDefinitions(Get(ts))) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(passed.like(F, Get(ts).spare));
  PetscCall(VecCopy(F, passed));
  PetscCall(SubstituteDefinitions(ts, passed));
  *R = passed;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All rows are proved now, but for those whose residual F has stayed as it was */
PetscErrorCode NoteProof(TS ts, Vec F)
{
  Integrator     &I     = Get(ts);
  Verification   &v     = I.verify;
  const bool      known = RateIsKnown(I);
  const RowScales scale(I);
  WorkVec         passed;
  Vec             R;

  PetscFunctionBegin;
  PetscCall(ResidualOfMotion(ts, F, passed, &R));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar m, PetscScalar w, PetscScalar noise, PetscScalar f, PetscScalar model, PetscScalar force, PetscScalar &unproved) {
      if (!(PetscRealPart(m) > 0)) return;
      const RowScale s = scale(i, m, w, noise, unproved);
      unproved         = Row(s, known, PetscRealPart(f), PetscRealPart(model), PetscRealPart(force)).stays() ? s.steps * I.h : 0;
    },
    Read(v.inertia), Read(I.weight), Read(v.noise), Read(R), Read(v.model), Read(v.work), Write(v.unproved)));
  v.since = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Imbalances of variables and force states act on the equations of motion: R -= P R_B for B = V, F */
PetscErrorCode SubstituteDefinitions(TS ts, Vec R)
{
  Integrator &I = Get(ts);
  WorkVec     defined, product;
  Mat         P;

  PetscFunctionBegin;
  if (!HasDefinitions(I)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(defined.like(R, I.spare));
  PetscCall(product.like(R, I.spare));
  PetscCall(TakeRoles(I, R, {TSHHT3_VARIABLE, TSHHT3_FORCE}, defined));
  PetscCall(MatMult(P, defined, product));
  PetscCall(VecAXPY(R, -1, product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the correction was to take away of the residual, by the linear model that it has solved, but for what the constraint forces of
   its multipliers answer: model = P dX - P_lambda dLambda. Those stand in work. */
PetscErrorCode ModelResidual(TS ts, Vec dX)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  Mat           P;

  PetscFunctionBegin;
  if (!v.model) PetscCall(VecDuplicate(dX, &v.model));
  if (!v.work) PetscCall(VecDuplicate(dX, &v.work));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  if (I.constraints()) {
    PetscCall(TakeRoles(I, dX, {TSHHT3_HOLONOMIC, TSHHT3_NONHOLONOMIC}, v.model));
    PetscCall(MatMult(P, v.model, v.work));
    PetscCall(MatMult(P, dX, v.model));
    PetscCall(VecAXPY(v.model, -1, v.work));
  } else {
    PetscCall(VecZeroEntries(v.work));
    PetscCall(MatMult(P, dX, v.model));
  }
  PetscCall(SubstituteDefinitions(ts, v.model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is left in F after the correction that has the model at hand */
PetscErrorCode CompareWithModel(TS ts, Vec F, Imbalance *left)
{
  Integrator &I     = Get(ts);
  const bool  known = RateIsKnown(I);
  PetscReal   sum[4];
  WorkVec     passed;
  Vec         R;

  PetscFunctionBegin;
  PetscCall(ResidualOfMotion(ts, F, passed, &R));
  PetscCall(SumRows(
    ts, sum,
    [&](const RowScale &s, PetscReal local[], PetscReal f, PetscReal model, PetscReal force) {
      const Row row(s, known, f, model, force);
      local[0] += PetscSqr(row.excess);
      if (row.stays()) local[3] += PetscSqr(row.excess * PetscSqr(s.steps));
      if (PetscAbsReal(row.was) <= s.rounding) return; /* less cannot be told from rounding, even by what persists */
      local[1] += row.is * row.was;
      local[2] += row.was * row.was;
    },
    Read(R), Read(I.verify.model), Read(I.verify.work)));
  left->all  = PositionChange(I, PetscSqrtReal(sum[0] / I.norm_size));
  left->stay = PositionChange(I, PetscSqrtReal(sum[3] / I.norm_size));
  left->part = sum[2] > 0 ? sum[1] / sum[2] : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same with inertia and rounding measured at X, until no more than `enough` is left. Of many rows some are rounding that two samples do not show
   (Stiff.FastModesOfManyPairs): new ones are taken until one has taken next to nothing away. */
PetscErrorCode CompareAboveRounding(TS ts, Vec X, Vec F, PetscReal enough, Imbalance *left)
{
  Verification &v = Get(ts).verify;

  PetscFunctionBegin;
  PetscCall(MeasureRowsAtStage(ts, X, F));
  PetscCall(CompareWithModel(ts, F, left));
  for (PetscReal before = PETSC_MAX_REAL; left->all > enough && left->all < explained_by_rounding * before;) {
    before = left->all;
    PetscCall(AddRounding(ts, X, F, v.sample++, v.noise));
    PetscCall(CompareWithModel(ts, F, left));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the correction dX, which has led to X and would be the last. F: the residual at X if `evaluated`, which it then is. */
PetscErrorCode VerifyCorrection(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated, PetscBool *proved)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  Corrector    &c = I.corrector;
  PetscReal     claimed;
  Imbalance     left;

  PetscFunctionBegin;
  *proved  = PETSC_TRUE;
  v.looked = PETSC_FALSE;
  if (!MayHideForces(I)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(StiffnessClaimed(ts, dX, &claimed));
  if (claimed <= allowed_unproved) {
    v.since += I.h;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!*evaluated) PetscCall(SNESComputeFunction(ts->snes, X, F));
  *evaluated = v.looked = PETSC_TRUE;
  if (!HasDefinitions(I)) PetscCall(ModelResidual(ts, dX));
  for (int attempt = 0; attempt < 2; attempt++) {
    if (attempt) PetscCall(CompareAboveRounding(ts, X, F, allowed_unproved, &left));
    else PetscCall(CompareWithModel(ts, F, &left));
    /* a rate measured in this correction speaks for what is left, unless that is as it was */
    const bool good = c.it - c.base >= 2 && c.matrix.rate >= 0 && c.matrix.rate < 0.5 && left.part < 0.5;
    *proved         = (PetscBool)((good || left.all <= allowed_unproved) && left.stay <= allowed_unproved);
    if (attempt && !*proved) {
      PetscCall(StiffnessClaimed(ts, dX, &claimed));
      *proved = (PetscBool)(!MayHideForces(I) || claimed <= allowed_unproved);
    }
    if (*proved) {
      PetscCall(NoteProof(ts, F));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  PetscCall(PetscInfo(ts, "corrector: a correction of %g of the tolerance at t = %g is no proof: the residual, %g of the tolerance by inertia alone, has not followed (%g of it as before)\n",
                      (double)c.e, (double)I.t1, (double)left.all, (double)left.part));
  if (c.matrix.fresh) PetscCall(CheckJacobian(ts, dX, F, &c.wrong_jacobian));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
