/*
  New generalized coordinates in the course of a run, such as Euler angles about another reference frame before theta reaches 0:
  a pointwise, nonlinear map of q, and with it of q', q'', the history and the matrix. The motion does not change, so that
  the run goes on without a restart and with the same degree of the predictor.

  The change takes place at the beginning of a step, after the last one has become history. From then on everything is in the
  new coordinates; neither a rejection nor a roll-back returns to the old ones. history.cpp describes what is mapped and how,
  drift.cpp what the constraints require. As to the rest:

  weights   Y_i becomes max(Y_i, |new q_i|), so that an entry's tolerance can only grow, as everywhere. With |new q_i| alone it could fall at
            once to what an angle happens to be in the new frame, and the tolerance rtol Y_i with it: the same motion at the same h would fail the
            test that it has just passed.
  h         is shortened if, by the prediction, the error test would fail in the new coordinates
  matrix    is made before the next correction, from the prediction; one factorization per change
  F0        of the paper's form is evaluated after commit
  dV        of drift.cpp belongs to a step, and is measured in the new coordinates if h changes
*/
#include "change.h"
#include "integrator/equations/equations.h"
#include "integrator/step/estimate.h"
#include "integrator/step/order.h"
#include "integrator/step/predictor.h"
#include "integrator/step/stage.h"

namespace hht3
{

namespace
{

/* If the predicted error of the first step in new coordinates exceeds the tolerance, h is shortened, but at most to this part: below
   restart_ratio, NeedsRestart() would ask for a restart */
constexpr PetscReal least_cut = 0.2;

PetscErrorCode WantsChange(TS ts, PetscBool *wanted)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  *wanted = PETSC_FALSE;
  PetscCall(VecLockReadPush(I.U0));
  PetscCall(VecLockReadPush(I.V0));
  PetscCall((*I.change.test)(ts, ts->ptime, I.U0, I.V0, wanted, I.change.ctx));
  PetscCall(VecLockReadPop(I.V0));
  PetscCall(VecLockReadPop(I.U0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the mapped U0, V0 into vec_sol, vec_dot, and tells the application that the change is done */
PetscErrorCode PublishState(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(VecCopy(I.U0, ts->vec_sol));
  PetscCall(VecCopy(I.V0, ts->vec_dot));
  PetscCall(HHT3KeepForRollBack(ts));
  PetscCall(CommitChange(ts));
  I.stat.changes++;
  I.change.t    = ts->ptime;
  I.change.step = ts->steps;
  PetscCall(PetscInfo(ts, "coordinates changed at t = %g, step %" PetscInt_FMT "\n", (double)ts->ptime, ts->steps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode CommitChange(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (I.change.commit) PetscCall((*I.change.commit)(ts, I.change.ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ChangeCoordinates(TS ts, bool starting)
{
  Integrator &I = Get(ts);
  PetscBool   wanted;

  PetscFunctionBegin;
  PetscCall(WantsChange(ts, &wanted));
  if (!wanted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(I.change.map, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE,
             "The test of TSHHT3SetCoordinateChange() asks for new coordinates at t = %g, and there is no map to them",
             (double)ts->ptime);
  if (starting) {
    PetscCall(MapStart(ts));
    PetscCall(PublishState(ts));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MapHistory(ts));
  PetscCall(MapPast(ts));
  PetscCall(PublishState(ts));
  PetscCall(UpdateWeights(ts, I.U0));
  PetscCall(HistoryForces(ts, ts->ptime));
  I.corrector.matrix.forget();
  I.change.stale = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Applies the error test in the new coordinates before the step, to the prediction in place of the solution. The same
   motion has another third derivative there, so that the old h may be too long by a quarter: this avoids a rejected
   step. */
PetscErrorCode StepAfterChange(TS ts)
{
  Integrator &I = Get(ts);
  PetscReal   e;
  PetscInt    order;

  PetscFunctionBegin;
  if (I.fixed_h || HHT3EventActive(ts)) PetscFunctionReturn(PETSC_SUCCESS);
  I.h      = ts->time_step;
  I.t1     = ts->ptime + I.h;
  I.drift_removed = 0;
  PetscCall(UseOrder(ts));
  PetscCall(PrepareStage(ts));
  PetscCall(Predict(ts, I.X));
  PetscCall(StageVectors(ts, I.X));
  const TSStepStatus status = I.status;
  I.status                  = TS_STEP_PENDING;
  PetscCall(TSEvaluateWLTE_HHT(ts, NORM_2, &order, &e));
  I.status = status;
  if (!(e > 1)) PetscFunctionReturn(PETSC_SUCCESS);
  const PetscReal next =
      PetscMax(I.h * PetscMax(least_cut, 0.9 * PetscPowReal(e, (PetscReal)-1 / order)), PetscMin(ts->adapt->dt_min, I.h));
  PetscCall(PetscInfo(ts, "h = %g would make an error of %g times the tolerance in the new coordinates: cut to %g\n", (double)I.h,
                      (double)e, (double)next));
  ts->time_step = next;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes beforehand the matrix that the first corrector iteration of the next step would make: drift.cpp needs it, and with a
   user's -snes_lag_jacobian the matrix of the old coordinates would be used again */
PetscErrorCode MatrixAfterChange(TS ts)
{
  Integrator &I = Get(ts);
  Mat         J, P;
  PetscBool   mffd;

  PetscFunctionBegin;
  I.change.stale = PETSC_FALSE;
  I.drift_removed = 0;
  PetscCall(PrepareStage(ts));
  PetscCall(Predict(ts, I.X));
  PetscCall(SNESSetUp(ts->snes));
  PetscCall(SNESGetJacobian(ts->snes, &J, &P, NULL, NULL));
  PetscCall(PetscObjectTypeCompare((PetscObject)J, MATMFFD, &mffd));
  PetscCall(FormJacobian(ts->snes, I.X, mffd ? P : J, P, ts));
  I.corrector.matrix.want = (PetscBool)!I.corrector.matrix.have;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetCoordinateChange(TS ts, TSHHT3ChangeTest test, TSHHT3ChangeMap map, TSHHT3ChangeCommit commit,
                                   void *ctx)
{
  Change &c = Get(ts).change;

  PetscFunctionBegin;
  PetscCheck(test || !map, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_NULL,
             "TSHHT3SetCoordinateChange() was given a map but no test that asks for it");
  c.test   = test;
  c.map    = map;
  c.commit = commit;
  c.ctx    = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@C
  TSHHT3SetCoordinateChange - Lets the application take new generalized coordinates in the course of a run, without a restart

  Logically Collective

  Input Parameters:
+ ts     - the `TS` context
. test   - tells whether new coordinates are wanted, or `NULL` for never
. map    - maps the old to the new coordinates; `NULL` if `test` never asks for any, and only takes note of accepted states
. commit - is told that the change is done, or `NULL`
- ctx    - context of the three functions

  Calling sequence of `test`:
+ ts     - the `TS` context
. t      - time of the state
. U      - the accepted state, to be read only
. V      - its time derivative, to be read only
. change - whether to change, `PETSC_FALSE` on entry; to be the same on all ranks
- ctx    - the context

  Calling sequence of `map`:
+ ts  - the `TS` context
. t   - time of the triple
. U   - coordinates, changed in place; other unknowns as at the last accepted time
. V   - velocities, changed in place
. A   - accelerations, changed in place
- ctx - the context

  Calling sequence of `commit`:
+ ts  - the `TS` context
- ctx - the context

  Level: advanced

  Notes:
  All three are called collectively. `test` is called once with every accepted state, at the beginning of the step that starts from it, after monitors
  and dense output of the last step, and with initial and otherwise changed states before their consistent start. If it asks for a
  change, `map` is called for several triples, at times around that of the state: q^ = T(q), q^' = T_q q', q^'' = T_q q'' + (T_q q')_q q',
  with one and the same smooth T, chosen by `test`. It must not depend on time nor on how often it is called, must change coordinates only,
  and must keep entries that it does not change bit for bit. During `map` the residual is not evaluated; from `commit` on it is evaluated in the
  new coordinates only. Before a consistent start A is zero on entry and not used on return.

  Multipliers, variables and force states keep their values: constraints and definitions must mean the same in both coordinates. As the weight of an entry in the
  error test contains its largest value so far, its unit and scale should not change.

  A change is not undone: steps that are rejected or rolled back start again in the new coordinates, without another call of `test`. All data on
  which the new coordinates depend have to be in the vector of `TSHHT3SetCheckpointVec()`; after a checkpoint is loaded, `commit` is called so that
  the application reads it there.

.seealso: `TSHHT3`, `TSHHT3SetCheckpointVec()`, `TSRestartStep()`, `TSRollBack()`
@*/
PetscErrorCode TSHHT3SetCoordinateChange(TS ts, TSHHT3ChangeTest test, TSHHT3ChangeMap map, TSHHT3ChangeCommit commit,
                                         void *ctx)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscTryMethod(ts, "TSHHT3SetCoordinateChange_C", (TS, TSHHT3ChangeTest, TSHHT3ChangeMap, TSHHT3ChangeCommit, void *),
                 (ts, test, map, commit, ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}
