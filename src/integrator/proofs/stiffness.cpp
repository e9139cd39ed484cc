/* The stiffness relative to inertia that the Newton matrix claims for each unknown (claim_i of verify.cpp); measurement of inertia
   and of rounding of the residual where these claims are doubtful */
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "proofs.h"
#include "integrator/random.h"
#include "integrator/step/stage.h"
#include "verify.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* Claims below this need no proof: a correction is too small by at most this factor, and the following steps correct the rest.
   Inertia that varies with the position claims as much. */
constexpr PetscReal stiffness_to_prove = 10;
constexpr PetscReal negligible_inertia = 1e-14; /* inertia below this part of the (geometric) mean is rounding */
constexpr PetscReal rounding_of_sums   = 4 * PETSC_MACHINE_EPSILON; /* of a sum of a few terms, relative to the largest */

} // namespace

bool MayHideForces(const Integrator &I) { return I.verify.largest >= stiffness_to_prove || (I.verify.largest > 0 && HasDefinitions(I)); }

/* Computes claim_i of the matrix P with the present inertia, and the largest one */
static PetscErrorCode MeasureStiffness(TS ts, Mat P)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  PetscReal     largest = 0;

  PetscFunctionBegin;
  PetscCall(MatGetDiagonal(P, v.claim));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar m, PetscScalar &p) {
      p       = PetscRealPart(m) > 0 ? PetscAbsScalar(p) / (m * (RoleOf(I, i) == TSHHT3_STATE ? StateInertia(I.p) : I.p.ca())) : 0;
      largest = PetscMax(largest, PetscRealPart(p));
    },
    Read(v.inertia), Write(v.claim)));
  PetscCallMPI(MPI_Allreduce(&largest, &v.largest, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)ts)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes inertia_i from the matrix P of a start: M_ii of coordinates, dF/ds' of states. It is 0 for coordinates without mass (up to
   rounding) and for all other unknowns, whose rows are not verified. */
PetscErrorCode NoteInertia(TS ts, Mat P)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  PetscReal     local[2] = {0, 0}, sum[2];
  PetscBool     has;

  PetscFunctionBegin;
  v.largest = v.since = 0;
  PetscCall(MatHasOperation(P, MATOP_GET_DIAGONAL, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  for (Vec *x : {&v.inertia, &v.claim, &v.noise, &v.unproved})
    if (!*x) PetscCall(VecDuplicate(I.X, x));
  PetscCall(VecZeroEntries(v.unproved));
  PetscCall(MatGetDiagonal(P, v.inertia));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar m) {
      if (IsCoordinate(I, i) && PetscAbsScalar(m) > 0) local[0] += PetscLogReal(PetscAbsScalar(m)), local[1] += 1;
    },
    Read(v.inertia)));
  PetscCallMPI(MPI_Allreduce(local, sum, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  const PetscReal least = negligible_inertia * (sum[1] > 0 ? PetscExpReal(sum[0] / sum[1]) : 1);
  PetscCall(ForEntries([&](PetscInt i, PetscScalar &m) { m = IsDifferential(RoleOf(I, i)) && PetscAbsScalar(m) > least ? PetscAbsScalar(m) : 0; }, Write(v.inertia)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode NoteStiffness(TS ts, Vec X, Mat P)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  PetscBool     has;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(P, MATOP_GET_DIAGONAL, &has));
  if (!has || !v.inertia) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MeasureStiffness(ts, P));
  PetscCall(VecZeroEntries(v.noise));
  v.measured = PETSC_FALSE;
  if (MayHideForces(I)) {
    if (!v.where) PetscCall(VecDuplicate(X, &v.where));
    PetscCall(VecCopy(X, v.where));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* noise = maximum of noise and |F(x + dx) - F|, where F is the residual at X and dx are pseudo-random rounding errors of all that the
   residual depends on: the unknowns, and positions, states and velocities as sums of terms. All quantities of one unknown have the same
   random factor, so that they do not cancel. (If X alone were changed, rounding of positions would change velocities, too, by far more
   than their rounding if h is small: for a body at rest in a steep brake all of the force would count as rounding.) */
PetscErrorCode AddRounding(TS ts, Vec X, Vec F, unsigned salt, Vec noise)
{
  Integrator &I = Get(ts);
  WorkVec     near, sample;
  PetscInt    first;

  PetscFunctionBegin;
  PetscCall(near.like(X, I.spare));
  PetscCall(sample.like(X, I.spare));
  PetscCall(VecCopy(X, near));
  PetscCall(VecGetOwnershipRange(X, &first, NULL));
  const auto rounding = [=](PetscInt i) { return rounding_of_sums * RandomRounding(first + i, salt); };
  PetscCall(ForEntries([&](PetscInt i, PetscScalar &x) { x += rounding(i) * PetscAbsScalar(x); }, Write(near)));
  PetscCall(StageVectors(ts, near));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar y, PetscScalar a, PetscScalar &u, PetscScalar &v) {
      const TSHHT3Role r = RoleOf(I, i);
      if (!IsDifferential(r)) return;
      const PetscReal way = I.h * PetscAbsScalar(v), turn = r == TSHHT3_STATE ? 0 : I.h * PetscAbsScalar(a);
      u += rounding(i) * (PetscRealPart(y) + way);
      v += rounding(i) * (PetscAbsScalar(v) + turn);
    },
    Read(I.ymax), Read(I.A1), Write(I.U1), Write(I.V1)));
  PetscCall(SNESComputeFunction(ts->snes, near, sample));
  PetscCall(VecAXPY(sample, -1, F));
  PetscCall(VecAbs(sample));
  PetscCall(VecPointwiseMax(noise, noise, sample));
  PetscCall(StageVectors(ts, X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By two samples: in a single one the unknowns at both ends of a stiff spring may have the same change, which does not change its force
   (Stiff.FastModeBesideASlowOne) */
PetscErrorCode MeasureRounding(TS ts, Vec X, Vec F, Vec noise)
{
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(noise));
  for (unsigned salt : {1u, 2u}) PetscCall(AddRounding(ts, X, F, salt, noise));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Measures the inertia of coordinates as |F(q''+z) - F(q'')|/|z|, for rows in which the difference exceeds rounding. z_i is
   1/weight_i with a random sign, so that columns do not cancel; for unknowns that are no coordinates it is zero. */
static PetscErrorCode MeasureInertia(TS ts)
{
  Integrator &I = Get(ts);
  WorkVec     Z, A, F, change;
  PetscInt    first;

  PetscFunctionBegin;
  for (WorkVec *v : {&Z, &A, &F, &change}) PetscCall(v->like(I.X, I.spare));
  PetscCall(VecGetOwnershipRange(Z, &first, NULL));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar w, PetscScalar &z) { z = IsCoordinate(I, i) ? RandomSign(first + i, 1) / (PetscRealPart(w) > 0 ? w : 1) : 0; }, Read(I.weight), Write(Z)));
  PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, I.A1, F));
  PetscCall(VecWAXPY(A, 1, Z, I.A1));
  PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, A, change));
  PetscCall(VecAXPY(change, -1, F));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar z, PetscScalar f, PetscScalar noise, PetscScalar &m) {
      if (!IsCoordinate(I, i)) return;
      const PetscReal now = PetscAbsScalar(f / z);
      if (PetscAbsScalar(f) > PetscRealPart(noise)) m = now;
    },
    Read(Z), Read(change), Read(I.verify.noise), Write(I.verify.inertia)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Called where a proof has failed at first: measures rounding of the residual at X and, once for each matrix, inertia. Inertia that
   varies with the position looks like stiffness as long as that of the start is used. */
PetscErrorCode MeasureRowsAtStage(TS ts, Vec X, Vec F)
{
  Verification &v = Get(ts).verify;
  Mat           P;

  PetscFunctionBegin;
  PetscCall(MeasureRounding(ts, X, F, v.noise));
  if (v.measured) PetscFunctionReturn(PETSC_SUCCESS);
  v.measured = PETSC_TRUE;
  PetscCall(MeasureInertia(ts));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(MeasureStiffness(ts, P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
