/*
  Whether a small correction proves that the residual is small.

  The corrector stops when corrections are small. But if the Newton matrix contains far more stiffness than there is, because it
  is old and what held the system has let go, or because the application's Jacobian is wrong, corrections are small whatever
  the residual. Neither a rate of earlier steps nor the error test shows this. So the stiffness that the matrix claims is measured:

    claim_i = P_ii / (ca M_ii)        stiffness of unknown i in the matrix, relative to inertia
    E       = |k| h^2 |claim dX|      size of the correction if there were only inertia

  If the matrix claims no stiffness, E is the size of the correction, and small corrections are a proof. Otherwise accelerations of up
  to A = E/(|k| h^2) may have been wrong since the last proof, a time T ago, and positions by A T^2/2. Before this exceeds a part of
  the tolerance, the residual is evaluated once more after the last correction. It must have followed the correction: each of its
  entries must be below `unanswered_fraction` times its former value (P dX, the linear model that the correction has solved), or be
  rounding, which is then measured (stiffness.cpp), or be too small to change the positions: within this step or, for an entry that
  has stayed as it was, since its own last proof. Of many entries a few stay as they were by chance, others each time: so each row has
  a T of its own.

  If the residual has not followed, the iteration goes on. The rate that is then measured, or a new matrix, decides.
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

constexpr PetscReal allowed_unproved      = 0.1; /* largest change of positions without proof, in units of the tolerance */
constexpr PetscReal explained_by_rounding = 0.9; /* further samples of rounding are taken while each reduces the imbalance below this part of it */

/* Largest change of positions, in units of the tolerance, that accelerations A make within a step; E = |k| h^2 A */
PetscReal PositionChange(const Integrator &I, PetscReal E) { return E / (2 * PetscAbsReal(I.p.k)); }

/* *drift: largest change of positions by accelerations that the small correction dX may hide, in each row since it was last proved.
   With definitions (variables, force states) the diagonal of the matrix does not show stiffness: then the whole model P dX is taken
   in place of P_ii dX_i */
PetscErrorCode StiffnessClaimed(TS ts, Vec dX, PetscReal *drift)
{
  Integrator &I = Get(ts);
  PetscReal   sum[2];

  PetscFunctionBegin;
  if (HasDefinitions(I)) {
    PetscCall(ModelResidual(ts, dX));
    PetscCall(SumRows(ts, sum, [](const RowScale &s, PetscReal local[], PetscReal model) { local[0] += PetscSqr(model * s.answer * PetscSqr(s.steps)); }, Read(I.verify.model)));
  } else /* claim dX is P_ii dX_i / inertia_i: the diagonal's part of the model */
    PetscCall(SumRows(ts, sum, [](const RowScale &s, PetscReal local[], PetscReal d, PetscReal c) { local[0] += PetscSqr(c * d * s.claimed * PetscSqr(s.steps)); }, Read(dX), Read(I.verify.claim)));
  *drift = PositionChange(I, PetscSqrtReal(sum[0] / I.norm_size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An entry of the residual after a correction, and before it, as the size of the correction that it would make if there were only inertia */
struct Row {
  PetscReal is, was, excess; /* excess: by how much it is larger than it may be */

  Row(const RowScale &s, bool known, PetscReal f, PetscReal model, PetscReal force)
    : is(f * s.answer), was(model * s.answer), excess(PetscMax(0, PetscAbsReal(is) - unanswered_fraction * (PetscAbsReal(was) + (known ? PetscAbsReal(force) * s.answer : 0)) - s.rounding))
  {
  }
  bool stays() const { return excess > 0 && PetscAbsReal(is - was) < 0.5 * PetscAbsReal(was); }
};

/* The iteration has been seen to converge: then a part unanswered_fraction of the constraint forces of the correction may be left, too */
bool RateIsKnown(const Integrator &I) { return I.corrector.matrix.rate >= 0; }

/* R: the residual F or, with definitions, `passed`, in which they are substituted into the equations of motion */
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

/* Notes that all rows are proved now, except those whose residual F has stayed as it was */
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

/* Substitutes the residual of definitions (B = V, F), which acts on the equations of motion: R -= P R_B */
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

/* The residual that the correction was to remove, by the linear model that it has solved, without the part that forces of constraints remove:
   model = P dX - P_lambda dlambda. P_lambda dlambda is in `work`. */
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

/* Compares the residual F after a correction with the model of the correction */
static PetscErrorCode CompareWithModel(TS ts, Vec F, Imbalance *left)
{
  Integrator &I     = Get(ts);
  const bool  known = RateIsKnown(I);
  PetscReal   sum[2];
  WorkVec     passed;
  Vec         R;

  PetscFunctionBegin;
  PetscCall(ResidualOfMotion(ts, F, passed, &R));
  PetscCall(SumRows(
    ts, sum,
    [&](const RowScale &s, PetscReal local[], PetscReal f, PetscReal model, PetscReal force) {
      const Row row(s, known, f, model, force);
      local[0] += PetscSqr(row.excess);
      if (row.stays()) local[1] += PetscSqr(row.excess * PetscSqr(s.steps));
    },
    Read(R), Read(I.verify.model), Read(I.verify.work)));
  left->all  = PositionChange(I, PetscSqrtReal(sum[0] / I.norm_size));
  left->stay = PositionChange(I, PetscSqrtReal(sum[1] / I.norm_size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same with inertia and rounding measured at X. Of many rows some have rounding that two samples do not show
   (Stiff.FastModesOfManyPairs): further samples are taken until at most `enough` is left, or a sample has removed next to nothing. */
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
    /* A good rate measured in this iteration is a proof, too, but not of rows that stay as they were */
    const bool good = c.it - c.base >= 2 && c.matrix.rate >= 0 && c.matrix.rate < 0.5;
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
  PetscCall(PetscInfo(ts, "corrector: the residual has not followed a correction of %g of the tolerance at t = %g: with inertia alone it moves positions by %g of the tolerance\n",
                      (double)c.e, (double)I.t1, (double)left.all));
  if (c.matrix.fresh) PetscCall(CheckJacobian(ts, dX, &c.wrong_jacobian));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
