/*
  Coordinates that are local rotation vectors: U is a body's rotation from its attitude at the last accepted state, V its angular
  velocity w in axes of space, A = w'. So U' = V and U'' = A hold only at U = 0.

  With these coordinates Newmark's relation (2a) is that of the generalized-alpha method on the rotation group (Bruels, Cardona,
  Arnold 2012), if the axis of rotation is fixed during the step: of Magnus' series for U, the integral of w and then commutators of w
  at different times, it contains the first term. The second one, 1/12 h^2 w_{n+1} x w_n in a step, is added here. Without it the
  error of a fast top is 10 times as large, and reactions begin with an error of first order (Arnold, Bruels, Cardona, Numer. Math.
  129, 2015). It uses w_{n+1} of the iterate: with -h^3/12 w_n x w'_n instead, motions against stiff forces across the axis of spin
  grow at small damping. If the application omits the term in its matrix, corrections of stiff forces across that axis converge at the
  rate gamma/(12 beta) h |w|, 0.16 h |w|.

  Above order two (bdf.cpp) no series is needed. About the attitude at t_n, the rotation vectors U of the attitudes before and after
  it are a smooth function of time with U' = T(U)^{-1} w, to which backward differentiation applies as to any coordinate: w is
  differentiated as every velocity is, and

    U_{n+1} = Sum_j c_j U_{n+1-j} + gamma h T(U_{n+1})^{-1} w_{n+1},   U_n = 0

  With every new reference the past vectors are re-expressed by composing rotations. The order is that of backward differentiation at
  any spin for which the history is within half a turn of the reference. (With a reference that goes on rotating with w_n there is no
  such limit, but the error of a precessing top of prescribed w was 10 to 100 times as large.) The derivative of a rotation vector
  with respect to w is gamma h (1 - (h - gamma h)/2 [w] + O(h^2)).
*/
#include "integrator/entries.h"
#include "integrator/step/order.h"
#include "rotation_vector.h"
#include "rotations.h"
#include "integrator/type/settings.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* The second term of Magnus' series in a step of length h */
void Commutator(PetscReal h, const PetscScalar *w0, const PetscScalar *w1, PetscScalar *c) { Cross(h * h / 12, w1, w0, c); }

} // namespace

PetscErrorCode SetUpRotations(TS ts)
{
  Integrator     &I = Get(ts);
  const PetscInt *index;
  PetscInt        n, first, end;

  PetscFunctionBegin;
  I.rotations.at.clear();
  if (!I.rotations.is) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetOwnershipRange(ts->vec_sol, &first, &end));
  PetscCall(ISGetLocalSize(I.rotations.is, &n));
  PetscCall(ISGetIndices(I.rotations.is, &index));
  for (PetscInt k = 0; k < n; k++) {
    PetscCheck(index[k] >= first && index[k] + 3 <= end, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
               "TSHHT3SetRotations(): rotation vector at %" PetscInt_FMT ", but this rank's unknowns are %" PetscInt_FMT " to %" PetscInt_FMT, index[k], first, end - 1);
    for (PetscInt i = index[k]; i < index[k] + 3; i++)
      PetscCheck(IsCoordinate(I, i - first), PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "TSHHT3SetRotations(): unknown %" PetscInt_FMT " is no coordinate", i);
    I.rotations.at.push_back(index[k] - first);
  }
  PetscCall(ISRestoreIndices(I.rotations.is, &index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the rotation vectors in U1; V1 has to be that of the stage already. At order two the commutator is added to U1 of (2a);
   above, U1 follows from its base. */
PetscErrorCode StageOfRotations(const Integrator &I)
{
  PetscFunctionBegin;
  if (I.order.now > 2)
    PetscCall(ForSome(
      I.rotations.at,
      [&](PetscInt, const PetscScalar &base, const PetscScalar &v1, PetscScalar &u1) {
        PetscScalar turn[3];
        for (int k = 0; k < 3; k++) turn[k] = EffectiveStep(I) * (&v1)[k];
        ImplicitRotation(&base, turn, &u1);
      },
      Read(I.base[0]), Read(I.V1), Write(I.U1)));
  else
    PetscCall(ForSome(
      I.rotations.at,
      [&](PetscInt, const PetscScalar &v0, const PetscScalar &v1, PetscScalar &u1) {
        PetscScalar c[3];
        Commutator(I.h, &v0, &v1, c);
        for (int k = 0; k < 3; k++) (&u1)[k] += c[k];
      },
      Read(I.V0), Read(I.V1), Write(I.U1)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void InterpolateCommutator(const Integrator &I, PetscReal x, PetscReal part, const PetscScalar *v0, const PetscScalar *v1, const PetscScalar *v, PetscScalar *u)
{
  PetscScalar whole[3], now[3];
  Commutator(I.h, v0, v1, whole);
  Commutator(x * I.h, v0, v, now);
  for (int k = 0; k < 3; k++) u[k] += now[k] - part * whole[k];
}

/* The factor of TSHHT3GetRotationFactor() in the present step */
PetscReal RotationFactor(const Integrator &I)
{
  const PetscReal gh = EffectiveStep(I);
  return I.order.now > 2 ? 0.5 * gh * (I.h - gh) : I.h * I.h / 12;
}

/* Where the axis of rotation turns but angular accelerations are constant, as those of a ball that rolls along a curve, (26) finds no
   error. The error of the series is its next term, h^2 |w|^2/60 times the second one. It is added to *result, a sum of squares, or
   the maximum with it is taken, on this rank. */
PetscErrorCode AddRotationErrors(const Integrator &I, NormType type, PetscReal *result)
{
  PetscFunctionBegin;
  if (!I.rotations.is) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ForSome(
    I.rotations.at,
    [&](PetscInt, const PetscScalar &v0, const PetscScalar &v1, const PetscScalar &weight) {
      PetscScalar c[3];
      PetscReal   z = 0;
      Commutator(I.h, &v0, &v1, c);
      for (int k = 0; k < 3; k++) z += PetscSqr(I.h * PetscAbsScalar((&v1)[k]));
      for (int k = 0; k < 3; k++) {
        const PetscReal delta = PetscAbsScalar(c[k] * (&weight)[k]) * z / 60;
        *result               = type == NORM_2 ? *result + delta * delta : PetscMax(*result, delta);
      }
    },
    Read(I.V0), Read(I.V1), Read(I.weight)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Expresses past attitudes relative to that of U0: exp([x]) A = exp([x]) exp([-u]) exp([u]) A. Past states with a body more than
   longest_turn away are dropped. Notes the fastest rotation for the choice of the next step. */
static PetscErrorCode ReferPast(TS ts)
{
  Integrator        &I    = Get(ts);
  Order             &o    = I.order;
  PetscReal          most[2] = {(PetscReal)-o.past, 0}, all[2]; /* minus the number of states that are kept, and the largest rotation in the step */
  const PetscScalar *u;
  PetscScalar       *x[max_order];

  PetscFunctionBegin;
  if (!o.past) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(I.U0, &u));
  for (PetscInt j = 0; j < o.past; j++) PetscCall(VecGetArray(o.U[j], &x[j]));
  for (PetscInt i : I.rotations.at) {
    const PetscReal angle = VectorLength(u + i);
    const Turn      turn(u + i);
    most[1] = PetscMax(most[1], angle);
    for (PetscInt j = 0; j < -most[0]; j++) {
      if (!(VectorLength(x[j] + i) + angle <= longest_turn)) most[0] = -j;
      RelativeRotation(x[j] + i, turn, x[j] + i);
    }
  }
  for (PetscInt j = 0; j < o.past; j++) PetscCall(VecRestoreArray(o.U[j], &x[j]));
  PetscCall(VecRestoreArrayRead(I.U0, &u));
  PetscCallMPI(MPI_Allreduce(most, all, 2, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)ts)));
  o.spin = all[1] / I.h_last;
  PetscCall(CutPast(ts, (PetscInt)-all[0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReferToState(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (!I.rotations.refer) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ReferPast(ts));
  PetscCall((*I.rotations.refer)(ts, I.U0, I.rotations.ctx));
  PetscCall(VecCopy(I.U0, ts->vec_sol));
  PetscCall(HHT3KeepForRollBack(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReferTo(TS ts, Vec U, WorkVec &before)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (!I.rotations.refer) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(before.like(U));
  PetscCall(VecCopy(U, before));
  PetscCall((*I.rotations.refer)(ts, U, I.rotations.ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReferBack(TS ts, Vec U, const WorkVec &before)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (!before) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall((*I.rotations.back)(ts, I.rotations.ctx));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar b, PetscScalar &u) { if (IsCoordinate(I, i)) u = b; }, Read(before), Write(U)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GetRotationFactor(TS ts, PetscReal *factor, Vec *begin)
{
  const Integrator &I = Get(ts);

  PetscFunctionBegin;
  *factor = I.rotations.factor;
  if (begin) *begin = *factor > 0 ? I.V0 : NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetRotations(TS ts, IS rotations, TSHHT3Refer refer, TSHHT3ReferBack back, void *ctx)
{
  Rotations &r = Get(ts).rotations;

  PetscFunctionBegin;
  PetscCheck(!refer == !back && !refer == !rotations, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_NULL,
             "TSHHT3SetRotations() needs an index set and both functions, or none of them");
  PetscCall(NotAfterSetUp(ts, "Rotation vectors"));
  if (rotations) PetscCall(PetscObjectReference((PetscObject)rotations));
  PetscCall(ISDestroy(&r.is));
  r       = Rotations();
  r.is    = rotations;
  r.refer = refer;
  r.back  = back;
  r.ctx   = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@C
  TSHHT3SetRotations - Tells which coordinates are local rotation vectors: rotations in space that count from the last accepted state

  Logically Collective, before `TSSetUp()`

  Input Parameters:
+ ts        - the `TS` context
. rotations - for each rotation vector the global index of the first of its three coordinates, on the rank that owns all three; or `NULL`
. refer     - makes given attitudes the reference
. back      - restores the reference from before the last call of `refer`
- ctx       - context of both

  Calling sequence of `refer`:
+ ts  - the `TS` context
. U   - on entry coordinates relative to the present reference: a rotation vector x stands for the attitude A = exp([x]) A_reference, in axes of space.
        These attitudes become the reference: on return the rotation vectors are zero, and all other entries as they were
- ctx - the context

  Calling sequence of `back`:
+ ts  - the `TS` context
- ctx - the context

  Level: advanced

  Notes:
  Velocities of such coordinates are angular velocities in axes of space, accelerations their derivatives; neither depends on the reference.
  With T(x) such that dA = [T dx] A, rows of their equations of motion and columns of constraints have to belong to dx, as with any other
  coordinates: moments and rotational reactions are multiplied by the transpose of T. T is singular at a full turn: a step
  that makes one fails and is repeated with a smaller h. The series is not accurate for rotations that large: `TSHHT3SetStepLimit()` should limit the rotation in a step
  to a radian.

  Both functions are called collectively, `refer` with every accepted state at the beginning of the step that starts from it, and with states at
  which accelerations and multipliers are solved for; after the latter `back` is called next. The reference attitudes have to be in the vector of
  `TSHHT3SetCheckpointVec()`.

  In fast rotation the Jacobian should contain the factor of `TSHHT3GetRotationFactor()`.

  The method is the generalized-alpha method on a Lie group (Bruels, Cardona, Arnold, Mech. Mach. Theory 48, 2012), with the second term of Magnus'
  series in the rotation of a step. It is of second order from the first step on, for multipliers too, and has no singular attitudes. Above order two (`-ts_hhtdae_order`)
  rotation vectors of several steps are differentiated about the last attitude. These must be within half a turn of it: where a body turns faster, the order is lower.

  In monitors U is relative to the reference of the last step.

.seealso: `TSHHT3`, `TSHHT3GetRotationFactor()`, `TSHHT3SetCoordinateChange()`, `TSHHT3SetCheckpointVec()`
@*/
PetscErrorCode TSHHT3SetRotations(TS ts, IS rotations, TSHHT3Refer refer, TSHHT3ReferBack back, void *ctx)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscTryMethod(ts, "TSHHT3SetRotations_C", (TS, IS, TSHHT3Refer, TSHHT3ReferBack, void *), (ts, rotations, refer, back, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3GetRotationFactor - How rotation vectors depend on angular velocities in the step whose Jacobian is being evaluated

  Not Collective

  Input Parameter:
. ts - the `TS` context

  Output Parameters:
+ factor - h^2/12 in a step of order two, gamma h (h - gamma h)/2 above it, 0 where the matrix is not that of a step
- begin  - the velocities at the beginning of the step, `NULL` where there is none; a borrowed vector

  Level: advanced

  Note:
  Only for the function of `TSSetI2Jacobian()`, which need not call it. With s the first of its shifts, a change dU of a rotation vector in the Newton matrix
  changes the rotation by (1 - factor s [w]) dU, where [w] dU is the cross product with the angular velocity w of `begin`. So the derivatives of the residual with respect to U, not those
  with respect to U' and U'', are to be multiplied by that matrix from the right. Without it corrections of stiff forces and constraints across the axis of w converge at the
  rate 0.16 h |w|.

.seealso: `TSHHT3`, `TSHHT3SetRotations()`
@*/
PetscErrorCode TSHHT3GetRotationFactor(TS ts, PetscReal *factor, Vec *begin)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscUseMethod(ts, "TSHHT3GetRotationFactor_C", (TS, PetscReal *, Vec *), (ts, factor, begin));
  PetscFunctionReturn(PETSC_SUCCESS);
}
