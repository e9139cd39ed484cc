/*
  Checkpoints. All that the next step depends on goes to a PETSc binary file: states at both ends of the last step, history of
  the predictor, running maxima, step sizes, counters. The matrix does not: it is made anew in the step after a checkpoint,
  in the run that wrote it as in the run that reads it, so that on the same ranks both go on bit for bit alike.
*/
#include "impl.h"
#include <cstdint>
#include <cstdio>
#include <string>

namespace hht3
{

namespace
{

constexpr PetscInt magic = 1211306, version = 3;

/* Numbers of the integrator and of TS, in one order for writing and reading */
struct Numbers {
  std::vector<PetscInt *>  ints;
  std::vector<PetscReal *> reals;
  explicit Numbers(TS ts)
  {
    Integrator      &I = Get(ts);
    TSHHT3Statistics &s = I.stat;
    Predictor       &p = I.predictor;
    ints  = {&ts->steps,  &ts->reject,    &ts->snes_its, &ts->ksp_its,         &ts->num_snes_failures, &s.steps,    &s.rejected,   &s.newton, &s.residuals,
             &s.jacobians, &s.factorizations, &s.solves, &s.corrector_fails, &s.retries,            &s.restarts, &s.changes, &I.change.step, &s.tiny_steps, &I.tiny_row, &p.degree, &p.available};
    reals = {&ts->ptime, &ts->ptime_prev, &ts->ptime_prev_rollback, &ts->time_step, &I.t0, &I.t1, &I.h, &I.h_last, &I.h_regular, &s.h_min, &s.h_max, &I.corrector.wlte, &I.corrector.learned, &I.corrector.h_floor, &I.corrector.floor, &I.h_limit, &I.h_proven, &I.change.t};
    for (PetscReal &t : p.t) reals.push_back(&t);
  }
};

std::vector<Vec> Vectors(TS ts)
{
  Integrator      &I = Get(ts);
  std::vector<Vec> v = {ts->vec_sol, ts->vec_dot, I.U0, I.V0, I.A0, I.X0, I.U1, I.V1, I.A1, I.X, I.ymax};
  if (I.F0) v.push_back(I.F0);
  for (PetscInt k = 0; k <= I.predictor.available; k++) v.push_back(I.predictor.D[k]);
  if (I.checkpoint_vec) v.push_back(I.checkpoint_vec);
  return v;
}

/* Entries of the application's vector, 0 without one */
PetscErrorCode ExtraSize(const Integrator &I, PetscInt *n)
{
  PetscFunctionBegin;
  *n = 0;
  if (I.checkpoint_vec) PetscCall(VecGetSize(I.checkpoint_vec, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Write(TS ts, PetscViewer viewer)
{
  Integrator    &I         = Get(ts);
  const PetscInt header[5] = {magic, version, I.form, I.F0 ? 1 : 0, I.predictor.available};
  PetscInt       N[2];

  PetscFunctionBegin;
  PetscCall(VecGetSize(ts->vec_sol, &N[0]));
  PetscCall(ExtraSize(I, &N[1]));
  PetscCall(PetscViewerBinaryWrite(viewer, header, 5, PETSC_INT));
  PetscCall(PetscViewerBinaryWrite(viewer, N, 2, PETSC_INT));
  PetscCall(PetscViewerBinaryWrite(viewer, &I.p, sizeof(I.p) / sizeof(PetscReal), PETSC_REAL));
  Numbers numbers(ts);
  for (PetscInt *i : numbers.ints) PetscCall(PetscViewerBinaryWrite(viewer, i, 1, PETSC_INT));
  for (PetscReal *r : numbers.reals) PetscCall(PetscViewerBinaryWrite(viewer, r, 1, PETSC_REAL));
  for (Vec v : Vectors(ts)) PetscCall(VecView(v, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReadHeader(TS ts, PetscViewer viewer, const char file[], PetscInt header[5])
{
  Integrator &I = Get(ts);
  PetscInt    N[2], M[2];
  Parameters  p;
  MPI_Comm    comm = PetscObjectComm((PetscObject)ts);

  PetscFunctionBegin;
  PetscCall(PetscViewerBinaryRead(viewer, header, 5, NULL, PETSC_INT));
  PetscCheck(header[0] == magic, comm, PETSC_ERR_FILE_UNEXPECTED, "%s is not a checkpoint of TSHHT3", file);
  PetscCheck(header[1] == version, comm, PETSC_ERR_FILE_UNEXPECTED, "Checkpoint %s is of version %" PetscInt_FMT ", this library reads version %" PetscInt_FMT, file, header[1], version);
  PetscCall(PetscViewerBinaryRead(viewer, N, 2, NULL, PETSC_INT));
  PetscCall(VecGetSize(ts->vec_sol, &M[0]));
  PetscCall(ExtraSize(I, &M[1]));
  PetscCheck(N[0] == M[0], comm, PETSC_ERR_FILE_UNEXPECTED, "Checkpoint %s has %" PetscInt_FMT " unknowns, the problem %" PetscInt_FMT, file, N[0], M[0]);
  PetscCheck(N[1] == M[1], comm, PETSC_ERR_FILE_UNEXPECTED,
             "Checkpoint %s has %" PetscInt_FMT " entries of the application's own, the run expects %" PetscInt_FMT ": give TSHHT3SetCheckpointVec() the vector of the run that wrote it", file, N[1], M[1]);
  PetscCall(PetscViewerBinaryRead(viewer, &p, sizeof(p) / sizeof(PetscReal), NULL, PETSC_REAL));
  PetscCheck(header[2] == (PetscInt)I.form && p.beta == I.p.beta && p.am == I.p.am, comm, PETSC_ERR_FILE_UNEXPECTED,
             "Checkpoint %s was written with form %s and alpha_f = %g, the run has %s and %g: give the same options", file, TSHHT3Forms[header[2] == 0 ? 0 : 1], (double)p.af, TSHHT3Forms[I.form], (double)I.p.af);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Read(TS ts, PetscViewer viewer, const char file[])
{
  Integrator &I = Get(ts);
  PetscInt    header[5];

  PetscFunctionBegin;
  PetscCall(ReadHeader(ts, viewer, file, header));
  Numbers numbers(ts);
  for (PetscInt *i : numbers.ints) PetscCall(PetscViewerBinaryRead(viewer, i, 1, NULL, PETSC_INT));
  for (PetscReal *r : numbers.reals) PetscCall(PetscViewerBinaryRead(viewer, r, 1, NULL, PETSC_REAL));
  for (PetscInt k = 0; k <= I.predictor.available; k++)
    if (!I.predictor.D[k]) PetscCall(VecDuplicate(ts->vec_sol, &I.predictor.D[k]));
  for (Vec v : Vectors(ts)) PetscCall(VecLoad(v, viewer));
  const PetscReal floor = I.corrector.floor; /* which the first call measures on the present state */
  PetscCall(UpdateWeights(ts, I.U1));
  I.corrector.floor = floor;
  I.have_step = PETSC_TRUE;
  I.auto_h    = PETSC_FALSE;
  I.status    = TS_STEP_COMPLETE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* FNV-1a over the first `length` bytes of a file */
bool Checksum(std::FILE *f, long length, std::uint64_t *sum)
{
  std::vector<unsigned char> buffer(1 << 16);
  *sum = 14695981039346656037ull;
  while (length > 0) {
    const size_t n = std::fread(buffer.data(), 1, (size_t)PetscMin(length, (long)buffer.size()), f);
    if (!n) return false;
    for (size_t i = 0; i < n; i++) *sum = (*sum ^ buffer[i]) * 1099511628211ull;
    length -= (long)n;
  }
  return true;
}

/* Rank 0 appends the checksum to a file that is complete, and puts it in the place of the one before */
bool Seal(const char part[], const char file[])
{
  std::uint64_t sum = 0;
  std::FILE    *f   = std::fopen(part, "r+b");
  if (!f) return false;
  std::fseek(f, 0, SEEK_END);
  const long length = std::ftell(f);
  std::rewind(f);
  bool ok = Checksum(f, length, &sum);
  std::fseek(f, 0, SEEK_END);
  ok = std::fwrite(&sum, sizeof(sum), 1, f) == 1 && ok;
  ok = std::fclose(f) == 0 && ok;
  return ok && std::rename(part, file) == 0;
}

/* Whether the file is as Seal() left it */
PetscErrorCode CheckSeal(MPI_Comm comm, const char file[])
{
  PetscMPIInt   rank;
  int           state[2] = {0, 0}; /* readable, whole */
  std::uint64_t sum, stored;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  std::FILE *f = rank == 0 ? std::fopen(file, "rb") : NULL;
  if (f) {
    state[0] = 1;
    std::fseek(f, 0, SEEK_END);
    const long length = std::ftell(f) - (long)sizeof(sum);
    std::rewind(f);
    if (length > 0 && Checksum(f, length, &sum) && std::fread(&stored, sizeof(stored), 1, f) == 1) state[1] = sum == stored;
    std::fclose(f);
  }
  PetscCallMPI(MPI_Bcast(state, 2, MPI_INT, 0, comm));
  PetscCheck(state[0], comm, PETSC_ERR_FILE_OPEN, "Cannot open the checkpoint %s", file);
  PetscCheck(state[1], comm, PETSC_ERR_FILE_UNEXPECTED, "%s is not a checkpoint of TSHHT3, or it is damaged or not complete", file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing of the matrix survives, not even the analysis of its pattern, which may depend on the values it was made with */
PetscErrorCode RenewMatrix(TS ts)
{
  Integrator &I = Get(ts);
  KSP         ksp;

  PetscFunctionBegin;
  I.corrector.have_matrix = PETSC_FALSE;
  I.corrector.want_matrix = PETSC_TRUE;
  I.corrector.rate        = -1;
  I.linear_chosen         = PETSC_FALSE;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPReset(ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* The viewer goes whatever happens: a run may live on without its checkpoint */
static PetscErrorCode WritePart(TS ts, const char part[])
{
  PetscViewer    viewer = NULL;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  ierr = PetscViewerBinaryOpen(PetscObjectComm((PetscObject)ts), part, FILE_MODE_WRITE, &viewer);
  if (!ierr) ierr = PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE);
  if (!ierr) ierr = Write(ts, viewer);
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointSave(TS ts, const char file[])
{
  Integrator       &I = Get(ts);
  const std::string part = std::string(file) + ".part";
  PetscMPIInt       rank;
  MPI_Comm          comm = PetscObjectComm((PetscObject)ts);
  int               failed = 0;

  PetscFunctionBegin;
  PetscCheck(I.have_step, comm, PETSC_ERR_ARG_WRONGSTATE, "There is no accepted step to checkpoint yet");
  PetscCall(WritePart(ts, part.c_str()));
  /* a run that dies while writing keeps the checkpoint before */
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) failed = !Seal(part.c_str(), file);
  PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, comm));
  PetscCheck(!failed, comm, PETSC_ERR_FILE_WRITE, "Cannot complete %s and rename it to %s", part.c_str(), file);
  PetscCall(RenewMatrix(ts));
  PetscCall(PetscInfo(ts, "checkpoint at t = %g in %s\n", (double)ts->ptime, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the set-up it is only noted, and read at its end */
PetscErrorCode CheckpointLoad(TS ts, const char file[])
{
  Integrator    &I = Get(ts);
  PetscViewer    viewer;
  PetscErrorCode ierr;

  PetscFunctionBegin;
  if (!I.U0) {
    PetscCall(PetscStrncpy(I.resume_file, file, sizeof(I.resume_file)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(CheckSeal(PetscObjectComm((PetscObject)ts), file));
  PetscCall(PetscViewerBinaryOpen(PetscObjectComm((PetscObject)ts), file, FILE_MODE_READ, &viewer));
  PetscCall(PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE));
  ierr = Read(ts, viewer, file);
  PetscCall(PetscViewerDestroy(&viewer)); /* of a file that is refused, too */
  PetscCall(ierr);
  PetscCall(RenewMatrix(ts));
  ts->steprestart = PETSC_FALSE;
  PetscCall(CommitChange(ts)); /* before anything evaluates the state in its coordinates */
  PetscCall(NoteState(ts));
  if (ts->event) PetscCall(TSEventInitialize(ts->event, ts, ts->ptime, ts->vec_sol));
  PetscCall(PetscInfo(ts, "resumed at t = %g, step %" PetscInt_FMT ", from %s\n", (double)ts->ptime, ts->steps, file));
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

/* Called inside TSStep(), which counts the step only afterwards: the file must hold the count as it will be */
PetscErrorCode CheckpointIfDue(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (!I.checkpoint_file[0] || I.checkpoint_every <= 0 || I.stat.steps % I.checkpoint_every) PetscFunctionReturn(PETSC_SUCCESS);
  if (HHT3EventActive(ts)) PetscFunctionReturn(PETSC_SUCCESS); /* the step may yet be rolled back */
  const PetscReal prev = ts->ptime_prev;
  ts->steps++;
  ts->ptime_prev = I.t0;
  PetscCall(CheckpointSave(ts, I.checkpoint_file));
  ts->steps--;
  ts->ptime_prev = prev;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@C
  TSHHT3CheckpointSave - Writes all that a `TSHHT3` run needs to go on to a file

  Collective

  Input Parameters:
+ ts   - the `TS` context, after at least one step
- file - name of the file; written beside and renamed when complete

  Options Database Keys:
+ -ts_hhtdae_checkpoint <file>    - write checkpoints to the file
- -ts_hhtdae_checkpoint_every <n> - after every n accepted steps

  Level: intermediate

  Note:
  The matrix is renewed after a checkpoint, here and in the run that resumes, so that on the same number of ranks both go on
  with the same bits. The file carries a checksum. Events and adaptors with a memory of their own (dsp) start anew.

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
  TSHHT3CheckpointLoad - Goes on from a file written by `TSHHT3CheckpointSave()`

  Collective

  Input Parameters:
+ ts   - the `TS` context, with the same problem and method as the run that wrote the file
- file - name of the file

  Options Database Key:
. -ts_hhtdae_resume <file> - the same by option

  Level: intermediate

  Note:
  Call it before `TSSolve()`; the state, time, step and counters then take the place of the initial ones. A file of another
  problem, method or version is refused.

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
  TSHHT3SetCheckpointVec - Gives checkpoints a vector of the application's to save and restore with the state

  Collective

  Input Parameters:
+ ts    - the `TS` context
- extra - the vector, of any size and layout, on the communicator of `ts`; `NULL` for none. A reference is kept

  Level: advanced

  Notes:
  It is meant for what the application's residual depends on besides the state, such as the reference frames that
  `TSHHT3SetCoordinateChange()` changes. A file is written with the values that the vector has then, and `TSHHT3CheckpointLoad()`
  overwrites them; then it calls commit of `TSHHT3SetCoordinateChange()`, if there is one, for the application to take them over. A
  file whose vector has another size, or that has one where the run has none or the other way round, is refused.

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
