/*
  A checkpoint holds everything that the next step depends on, so that a resumed run repeats the uninterrupted one bit
  for bit. Writing it changes nothing in the run that writes.

  Its contents are the plain structs of state.h, the vectors, the values of the Newton matrix, and the state that its
  solver has kept from earlier matrices (LinearSaveState()). The values are saved because the application could not
  evaluate the matrix again: the state, the coordinates and the memory with which it was made are gone. A checkpoint is
  written at the beginning of a step, after monitors and event handlers of the last one.

  checkpoint_identity.cpp checks whether a file belongs to the run.
*/
#include "integrator/coordinates/change.h"
#include "checkpoint.h"
#include "checkpoint_parts.h"
#include "integrator/entries.h"
#include "integrator/step/step.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* Numbers of TS and SNES */
void TransferNumbers(TS ts, Archive &a)
{
  SNES           snes = ts->snes;
  const PetscInt lag  = snes->lagjacobian;

  for (PetscInt *x : {&ts->steps, &ts->reject, &ts->snes_its, &ts->ksp_its, &ts->num_snes_failures, &ts->adapt->timestepjustdecreased, &snes->lagjacobian, &snes->jac_iter, &snes->pre_iter})
    a.plain(*x);
  if (a.reading && (Get(ts).corrector.user_lag || snes->lagjacobian > 0)) snes->lagjacobian = lag; /* this run's, if the user has set one in either run */
  for (PetscReal *x : {&ts->ptime, &ts->ptime_prev, &ts->ptime_prev_rollback, &ts->time_step}) a.plain(*x);
  a.plain(ts->steprestart);
}

void TransferStructs(TS ts, Archive &a)
{
  Integrator &I = Get(ts);

  TransferNumbers(ts, a);
  ForStates(I, [&](auto &state) { a.plain(state); });
  a.plain(I.p);
}

PetscErrorCode TransferVec(TS ts, Archive &a, Vec *x)
{
  PetscScalar *array;
  PetscInt     n;

  PetscFunctionBegin;
  if (!*x) PetscCall(VecDuplicate(ts->vec_sol, x));
  PetscCall(VecGetLocalSize(*x, &n));
  PetscCall(a.reading ? VecGetArray(*x, &array) : VecGetArrayRead(*x, (const PetscScalar **)&array)); /* writing keeps its PetscObjectState */
  a.array(array, (size_t)n);
  PetscCall(a.reading ? VecRestoreArray(*x, &array) : VecRestoreArrayRead(*x, (const PetscScalar **)&array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A vector that may be null: then it is null in the run that reads, too */
PetscErrorCode TransferIfThere(TS ts, Archive &a, Vec *x)
{
  PetscBool there = (PetscBool)(*x != NULL);

  PetscFunctionBegin;
  a.plain(there);
  if (a.good && there) PetscCall(TransferVec(ts, a, x));
  else if (a.good && a.reading) PetscCall(VecDestroy(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both ends of the last step, the history, and the vectors that not every problem or every step has */
PetscErrorCode TransferVectors(TS ts, Archive &a)
{
  Integrator        &I   = Get(ts);
  std::vector<Vec *> all = {&ts->vec_sol, &ts->vec_dot, &I.U0, &I.V0, &I.A0, &I.X0, &I.U1, &I.V1, &I.A1, &I.X, &I.ymax, &I.weight};

  PetscFunctionBegin;
  if (I.F0) all.push_back(&I.F0);
  for (PetscInt k = 0; k <= I.predictor.available; k++) all.push_back(&I.predictor.X[k]);
  for (PetscInt k = 0; k < I.order.past; k++) all.push_back(&I.order.U[k]), all.push_back(&I.order.V[k]);
  if (I.checkpoint_vec) all.push_back(&I.checkpoint_vec);
  for (Vec *x : all) PetscCall(TransferVec(ts, a, x));
  for (Vec *x : {&I.dV, &I.normal_jerk, &I.excitation, &I.verify.inertia, &I.verify.claim, &I.verify.noise, &I.verify.unproved, &I.verify.driven}) PetscCall(TransferIfThere(ts, a, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers of the application whose count changes during the run, unlike that of its vector: a function composed with the TS appends them, or takes those of the file over */
PetscErrorCode NumbersOfApplication(TS ts, PetscBool reading, std::vector<double> *numbers)
{
  PetscFunctionBegin;
  PetscTryMethod(ts, "TSHHT3CheckpointNumbers_C", (TS, PetscBool, std::vector<double> *), (ts, reading, numbers));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* This rank's part of the file */
PetscErrorCode GatherRun(TS ts, Archive &a)
{
  Identity            id;
  std::string         options;
  std::vector<char>   words;
  std::vector<double> numbers;
  WorkVec             probe;

  PetscFunctionBegin;
  PetscCall(IdentifyRun(ts, &id));
  PetscCall(OptionsInWords(ts, &options));
  words.assign(options.begin(), options.end());
  PetscCall(probe.like(ts->vec_sol));
  PetscCall(TellingResidual(ts, probe));
  PetscCall(NumbersOfApplication(ts, PETSC_FALSE, &numbers));
  a.plain(id);
  a.list(words);
  TransferStructs(ts, a);
  PetscCall(TransferVectors(ts, a));
  a.list(numbers);
  Vec of_it = probe;
  PetscCall(TransferVec(ts, a, &of_it));
  PetscCall(SaveMatrices(ts, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Error unless everything read so far has, on all ranks, the size that this run expects */
PetscErrorCode CheckBuild(TS ts, const char file[], const Archive &a)
{
  bool good;

  PetscFunctionBegin;
  PetscCall(OnAllRanks(ts, a.good, &good));
  PetscCheck(good, PetscObjectComm((PetscObject)ts), PETSC_ERR_FILE_UNEXPECTED, "Checkpoint %s was written by another build of this library", file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RestoreRun(TS ts, const char file[], Archive &a)
{
  Integrator         &I    = Get(ts);
  Identity            id;
  std::string         options;
  std::vector<char>   words;
  std::vector<double> numbers;
  WorkVec             was, is;

  PetscFunctionBegin;
  a.plain(id);
  a.list(words);
  PetscCall(CheckBuild(ts, file, a));
  PetscCall(CheckIdentity(ts, file, id));
  TransferStructs(ts, a);
  PetscCall(CheckBuild(ts, file, a));
  PetscCall(was.like(ts->vec_sol));
  PetscCall(is.like(ts->vec_sol));
  PetscCall(TransferVectors(ts, a));
  a.list(numbers);
  Vec of_file = was;
  PetscCall(TransferVec(ts, a, &of_file));
  PetscCall(CheckBuild(ts, file, a));
  I.stage_id = 0;
  PetscCall(CommitChange(ts)); /* the application takes over its coordinates, before anything is evaluated in them */
  PetscCall(NumbersOfApplication(ts, PETSC_TRUE, &numbers));
  PetscCall(OptionsInWords(ts, &options));
  const std::string theirs(words.begin(), words.end());
  if (theirs != options) /* allowed, but the run will not repeat the steps of the other one */
    PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts), "hhtdae: the run that wrote %s had other options, and this one will not repeat its steps:\n  there %s\n  here  %s\n", file, theirs.c_str(), options.c_str()));
  PetscCall(TellingResidual(ts, is));
  PetscCall(CheckTellingResidual(ts, file, was, is));
  PetscCall(LoadMatrices(ts, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode CheckpointSave(TS ts, const char file[])
{
  Integrator &I = Get(ts);
  Archive     a;

  PetscFunctionBegin;
  PetscCheck(I.have_step || I.at_begin, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE, "There is no accepted step to checkpoint yet");
  PetscTryMethod(ts, "TSHHT3CheckpointPrepare_C", (TS), (ts));
  StopClocks(I, false);
  PetscCall(GatherRun(ts, a));
  PetscCall(CheckpointFileWrite(PetscObjectComm((PetscObject)ts), file, a.data));
  PetscCall(PetscInfo(ts, "checkpoint at t = %g in %s\n", (double)ts->ptime, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointLoad(TS ts, const char file[])
{
  Integrator &I = Get(ts);
  Archive     a;

  PetscFunctionBegin;
  if (!I.U0) {
    PetscCall(PetscStrncpy(I.resume_file, file, sizeof(I.resume_file)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(CheckpointFileRead(PetscObjectComm((PetscObject)ts), file, a.data));
  a.reading = true;
  PetscCall(RestoreRun(ts, file, a));
  I.checkpoint_steps = I.stat.steps;
  I.timed            = PETSC_FALSE;
  if (ts->event) PetscCall(TSEventInitialize(ts->event, ts, ts->ptime, ts->vec_sol));
  PetscCall(PetscInfo(ts, "resumed at t = %g, step %" PetscInt_FMT ", from %s\n", (double)ts->ptime, ts->steps, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReadCheckpoint(TS ts)
{
  PetscFunctionBegin;
  if (Get(ts).resume_file[0]) PetscCall(TSSetUp(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetCheckpointVec(TS ts, Vec extra)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(PetscObjectReference((PetscObject)extra));
  PetscCall(VecDestroy(&I.checkpoint_vec));
  I.checkpoint_vec = extra;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the beginning of a step. While an event is being located, TSEvent may roll the last step back, so that no
   checkpoint is written until it is located. */
PetscErrorCode CheckpointIfDue(TS ts)
{
  Integrator    &I     = Get(ts);
  const PetscInt every = I.checkpoint_every;

  PetscFunctionBegin;
  if (!I.checkpoint_file[0] || every <= 0 || !I.have_step || ts->steprollback) PetscFunctionReturn(PETSC_SUCCESS);
  if (I.stat.steps / every <= I.checkpoint_steps / every || HHT3EventActive(ts)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CheckpointSave(ts, I.checkpoint_file));
  I.checkpoint_steps = I.stat.steps;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckCheckpointFile(TS ts)
{
  PetscFunctionBegin;
  if (Get(ts).checkpoint_file[0]) PetscCall(CheckpointFileCheck(PetscObjectComm((PetscObject)ts), Get(ts).checkpoint_file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the checkpoint due after the last step, which no beginning of another step writes: TSSolve() then calls its
   monitors with ts->reason set. Without -ts_hhtdae_checkpoint_every this is the only checkpoint of the run. */
PetscErrorCode MonitorCheckpoint(TS ts, PetscInt step, PetscReal, Vec, void *)
{
  PetscFunctionBegin;
  if (ts->ops->step != TSStep_HHT || ts->reason <= 0 || step < 0) PetscFunctionReturn(PETSC_SUCCESS);
  const Integrator &I = Get(ts);
  if (I.checkpoint_every > 0) PetscCall(CheckpointIfDue(ts));
  else if (I.checkpoint_file[0] && I.have_step) PetscCall(CheckpointSave(ts, I.checkpoint_file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@C
  TSHHT3CheckpointSave - Writes all that a `TSHHT3` run needs to go on to a file

  Collective

  Input Parameters:
+ ts   - the `TS` context, after at least one step
- file - name of the file; it is written as file.part and renamed when it is complete

  Options Database Keys:
+ -ts_hhtdae_checkpoint <file>    - write checkpoints to the file, whose directory has to exist when the run begins
- -ts_hhtdae_checkpoint_every <n> - after every n accepted steps; without it one is written at the end of `TSSolve()`

  Level: intermediate

  Note:
  Writing changes nothing in the run that writes, and a resumed run repeats it bit for bit: the Newton matrix, and the
  state that its solver has kept from earlier matrices, are part of the file. There are two exceptions, for which the
  resumed run makes a new matrix, agrees with the uninterrupted one to the accuracy of the tolerance only, and says so
  by -info: matrices without `MatGetRow()` (shell, nest), and preconditioners whose state cannot be saved. The latter
  are all but `hhtconstraint` and the direct solvers chosen by default, also as the solvers within `hhtconstraint`.
  "mumpsnd" on several ranks repeats a run to rounding only, even without a checkpoint. Types of `TSAdapt` with a memory
  (dsp) start without it. The file has a checksum. After an error within a step, for example in a callback, the state at
  the beginning of the step is written.

.seealso: `TSHHT3`, `TSHHT3CheckpointLoad()`, `TSHHT3SetCheckpointVec()`
@*/
PetscErrorCode TSHHT3CheckpointSave(TS ts, const char file[])
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscUseMethod(ts, "TSHHT3CheckpointSave_C", (TS, const char[]), (ts, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@C
  TSHHT3CheckpointLoad - Resumes a run from a file written by `TSHHT3CheckpointSave()`

  Collective

  Input Parameters:
+ ts   - the `TS` context, with the same problem and method as the run that wrote the file
- file - name of the file

  Options Database Key:
. -ts_hhtdae_resume <file> - the same by option

  Level: intermediate

  Note:
  Call it before `TSSolve()`. The state, time, step and counters of the file replace the initial ones. If the TS has not
  been set up, `TSSetUp()` reads the file; until then `TSGetTime()` and `TS2GetSolution()` give the values from before.
  Queries of scenes set the TS up. A file of another problem, method, version or number of ranks is an error. Other
  tolerances and other options of the solvers are allowed, and reported. For points of `TSSetTimeSpan()` earlier than
  the checkpoint `TSGetTimeSpanSolutions()` gives vectors of NaN.

.seealso: `TSHHT3`, `TSHHT3CheckpointSave()`
@*/
PetscErrorCode TSHHT3CheckpointLoad(TS ts, const char file[])
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscUseMethod(ts, "TSHHT3CheckpointLoad_C", (TS, const char[]), (ts, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3SetCheckpointVec - Sets a vector of the application that checkpoints save and restore with the state

  Collective

  Input Parameters:
+ ts    - the `TS` context
- extra - the vector, of any size and layout, on the communicator of `ts`; `NULL` for none. A reference is kept

  Level: advanced

  Notes:
  The vector is meant for data on which the application's residual depends besides the state, such as the reference
  frames that `TSHHT3SetCoordinateChange()` changes. A checkpoint saves the values that the vector has when it is
  written. `TSHHT3CheckpointLoad()` overwrites the vector and then calls the commit function of
  `TSHHT3SetCoordinateChange()`, if there is one, in which the application takes the values over. If the vector in the
  file has another size, or only one of the file and the run has a vector, the file is an error.

  If the application has to update the vector, or to write what it has recorded so far, before a checkpoint is written,
  it composes a function of `ts`, which is then called: PetscObjectComposeFunction((PetscObject)ts,
  "TSHHT3CheckpointPrepare_C", function).

.seealso: `TSHHT3`, `TSHHT3CheckpointSave()`, `TSHHT3CheckpointLoad()`, `TSHHT3SetCoordinateChange()`
@*/
PetscErrorCode TSHHT3SetCheckpointVec(TS ts, Vec extra)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  if (extra) {
    PetscValidHeaderSpecific(extra, VEC_CLASSID, 2);
    PetscCheckSameComm(ts, 1, extra, 2);
  }
  PetscTryMethod(ts, "TSHHT3SetCheckpointVec_C", (TS, Vec), (ts, extra));
  PetscFunctionReturn(PETSC_SUCCESS);
}
