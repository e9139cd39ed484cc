/*
  Reference attitudes of rotational coordinates. Local rotation vectors refer to the attitude at the last accepted step, which the integrator
  reports through the callbacks of TSHHT3SetRotations().

  With Euler angles, a body whose theta approaches 0 or pi gets new axes: the angles then describe another body-fixed frame,
  which is far from the singularity. The integrator calls MapToNewAxes() to transform angles, rates, accelerations and their
  history, TSHHT3SetCoordinateChange(). It calls TestAxes() before each step, when the state has been accepted; memories, such
  as angles over full turns, are updated then.

  One vector, Runtime::axes, which is part of checkpoints, has the references and memories: the quaternion of LocalBody::C of each own
  body, the memories of the elements, and the numbers of kept.cpp.
*/
#include "runtime.h"
#include "start.h"

namespace hhtdae
{

namespace
{

bool RotatesInSpace(const LocalBody &k) { return TurnsInSpace(k.kind); }

void StoreQuaternion(const Eigen::Quaterniond &q, double *x)
{
  x[0] = q.w();
  x[1] = q.x();
  x[2] = q.y();
  x[3] = q.z();
}

Matrix3 LoadQuaternion(const double *x) { return Eigen::Quaterniond(x[0], x[1], x[2], x[3]).normalized().toRotationMatrix(); }

/* Creates the PetscSF of the axes: its leaves are copies of other ranks' bodies on this rank, its roots these bodies on their owners */
PetscErrorCode MakeAxesExchange(Runtime &R)
{
  std::vector<PetscInt>   place(R.scene.bodies.size()), next(R.size, 0);
  std::vector<PetscSFNode> root;
  PetscFunctionBegin;
  for (std::size_t b = 0; b < place.size(); b++) place[b] = next[R.number.owner[b]]++;
  for (std::size_t b = R.bodies.own; b + 1 < R.bodies.body.size(); b++) {
    const PetscInt id = R.bodies.body[b].id;
    PetscSFNode    node;
    node.rank  = R.number.owner[id];
    node.index = place[id];
    root.push_back(node);
  }
  PetscCall(PetscSFCreate(R.scene.comm, &R.axes_sf));
  PetscCall(PetscSFSetGraph(R.axes_sf, R.bodies.own, (PetscInt)root.size(), nullptr, PETSC_OWN_POINTER, root.data(), PETSC_COPY_VALUES));
  PetscFunctionReturn(0);
}

/* Finds own bodies near the singularity, and their new axes */
PetscErrorCode ChooseNewAxes(Runtime &R, Vec U, Vec V)
{
  const double *u, *v;
  PetscFunctionBegin;
  R.next_body.clear();
  R.next_axes.clear();
  R.changing_axes = false;
  if (!R.rotates_in_space || R.bodies.local) PetscFunctionReturn(0);
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (!RotatesInSpace(k)) continue;
    const double *eps = u + k.first + 3, *rate = v + k.first + 3;
    if (std::abs(std::sin(eps[1])) >= singular_sine) continue;
    Matrix3   A;
    EulerAxes e;
    EulerFrame(eps, A, e);
    R.next_body.push_back(b);
    R.next_axes.push_back(ChooseAxes(A * k.C, AngularVelocity(e, Vector3(rate[0], rate[1], rate[2]))));
  }
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(V, &v));
  int any = !R.next_body.empty();
  if (R.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, R.scene.comm));
  R.changing_axes = any;
  PetscFunctionReturn(0);
}

/* An error if t is before the time of the references and memories, which cannot be restored to an earlier time */
PetscErrorCode CheckTime(Runtime &R, PetscReal t)
{
  PetscFunctionBegin;
  PetscCheck(t >= R.accepted, R.scene.comm, PETSC_ERR_ARG_WRONGSTATE,
             "the TS starts again at t = %g, but its reference attitudes and counted angles are those of t = %g: take a new TS from "
             "Scene::createTS() for another run, or use TSHHT3CheckpointLoad() to return to an earlier state",
             (double)t, (double)R.accepted);
  R.accepted = t;
  PetscFunctionReturn(0);
}

PetscErrorCode TestAxes(TS ts, PetscReal t, Vec U, Vec V, PetscBool *change, void *ctx)
{
  Runtime        &R = *static_cast<Runtime *>(ctx);
  const PetscReal h = R.accepted > PETSC_NINFINITY ? t - R.accepted : 0; /* 0: at the first state, and at that of a checkpoint */
  PetscFunctionBegin;
  PetscCall(CheckTime(R, t));
  PetscCall(TellOfNoOutput(R, ts));
  PetscCall(AngleTolerances(R, ts));
  PetscCall(Remember(R, U, V));
  PetscCall(TellOfLostTurns(R, ts, h));
  PetscCall(CheckDropped(R, t, U, V));
  PetscCall(ChooseNewAxes(R, U, V));
  *change = R.changing_axes ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

/* Transforms Euler angles eps, their rates and accelerations from axes C to the axes `next`; attitude, angular velocity
   and angular acceleration do not change */
void MapBody(const Matrix3 &C, const Matrix3 &next, double *eps, double *rate, double *acc)
{
  Matrix3   A;
  EulerAxes e;
  EulerFrame(eps, A, e);
  const Vector3 x(rate[0], rate[1], rate[2]), w = AngularVelocity(e, x);
  const Vector3 alpha = AngularVelocity(e, Vector3(acc[0], acc[1], acc[2])) + Convective(e, x, w);
  const Vector3 angles = EulerAngles(A * C * next.transpose());
  EulerFrame(angles.data(), A, e);
  const Vector3 y = EulerRates(e, w), z = EulerRates(e, alpha - Convective(e, y, w));
  for (int i = 0; i < 3; i++) {
    eps[i]  = angles(i);
    rate[i] = y(i);
    acc[i]  = z(i);
  }
}

PetscErrorCode MapToNewAxes(TS, PetscReal, Vec U, Vec V, Vec A, void *ctx)
{
  Runtime &R = *static_cast<Runtime *>(ctx);
  double  *u, *v, *a;
  PetscFunctionBegin;
  PetscCall(VecGetArray(U, &u));
  PetscCall(VecGetArray(V, &v));
  PetscCall(VecGetArray(A, &a));
  for (std::size_t i = 0; i < R.next_body.size(); i++) {
    const LocalBody &k = R.bodies.body[R.next_body[i]];
    MapBody(k.C, R.next_axes[i], u + k.first + 3, v + k.first + 3, a + k.first + 3);
  }
  PetscCall(VecRestoreArray(U, &u));
  PetscCall(VecRestoreArray(V, &v));
  PetscCall(VecRestoreArray(A, &a));
  PetscFunctionReturn(0);
}

/* Called after a checkpoint has been loaded: sets the tolerances of angles, which other runs set in their first step, and
   reads the last entries of the vector */
PetscErrorCode ResumeFromCheckpoint(Runtime &R, TS ts)
{
  double *x;
  PetscFunctionBegin;
  PetscCall(AngleTolerances(R, ts));
  PetscCall(VecGetArray(R.axes, &x));
  const std::vector<double> end(x + 4 * R.bodies.own + Memories(R), x + 4 * R.bodies.own + Memories(R) + Kept(R));
  PetscCall(VecRestoreArray(R.axes, &x));
  PetscCall(ReadKept(R, end.data()));
  PetscFunctionReturn(0);
}

/* Stores new axes in the vector and copies references and memories from it; also called after a checkpoint has been loaded */
PetscErrorCode CommitAxes(TS ts, void *ctx)
{
  Runtime &R = *static_cast<Runtime *>(ctx);
  double  *x;
  PetscFunctionBegin;
  PetscCall(VecGetArray(R.axes, &x));
  for (std::size_t i = 0; i < R.next_body.size(); i++) {
    StoreQuaternion(Eigen::Quaterniond(R.next_axes[i]), x + 4 * R.next_body[i]);
    PetscCall(PetscInfo(ts, "new axes for the Euler angles of %s\n", R.scene.bodyName(R.bodies.body[R.next_body[i]].id).c_str()));
  }
  PetscCall(VecRestoreArray(R.axes, &x));
  if (R.next_body.empty()) R.accepted = PETSC_NINFINITY; /* a checkpoint has been loaded; its time may be before that of the present state */
  R.axes_changes += (PetscInt)R.next_body.size();
  R.next_body.clear();
  R.next_axes.clear();
  PetscCall(UseAxes(R));
  if (!R.changing_axes) PetscCall(ResumeFromCheckpoint(R, ts));
  R.changing_axes = false;
  PetscFunctionReturn(0);
}

/* Sends the references of own bodies to the other ranks with copies of these bodies */
PetscErrorCode ExchangeReferences(Runtime &R, const double *own)
{
  std::vector<double> other(4 * (R.bodies.body.size() - R.bodies.own));
  PetscFunctionBegin;
  if (R.size > 1) {
    MPI_Datatype quaternion;
    PetscCallMPI(MPI_Type_contiguous(4, MPI_DOUBLE, &quaternion));
    PetscCallMPI(MPI_Type_commit(&quaternion));
    PetscCall(PetscSFBcastBegin(R.axes_sf, quaternion, own, other.data(), MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(R.axes_sf, quaternion, own, other.data(), MPI_REPLACE));
    PetscCallMPI(MPI_Type_free(&quaternion));
  }
  for (PetscInt b = 0; b + 1 < (PetscInt)R.bodies.body.size(); b++)
    if (RotatesInSpace(R.bodies.body[b])) R.bodies.body[b].C = LoadQuaternion(b < R.bodies.own ? own + 4 * b : other.data() + 4 * (b - R.bodies.own));
  PetscFunctionReturn(0);
}

/* Makes the attitudes in U the references of local rotation vectors, which become zero in U */
PetscErrorCode UpdateReferences(Runtime &R, Vec U)
{
  double *u, *x;
  PetscFunctionBegin;
  PetscCall(VecGetArray(U, &u));
  PetscCall(VecGetArray(R.axes, &x));
  R.reference_before.assign(x, x + 4 * R.bodies.own);
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (!RotatesInSpace(k)) continue;
    double *turn = u + k.first + 3, *q = x + 4 * b;
    StoreQuaternion((LocalTurn(Vector3(turn[0], turn[1], turn[2])) * Eigen::Quaterniond(q[0], q[1], q[2], q[3])).normalized(), q);
    std::fill(turn, turn + 3, 0.0);
  }
  PetscCall(ExchangeReferences(R, x));
  PetscCall(VecRestoreArray(R.axes, &x));
  PetscCall(VecRestoreArray(U, &u));
  PetscFunctionReturn(0);
}

PetscErrorCode UpdateReferencesOfTS(TS, Vec U, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(UpdateReferences(*static_cast<Runtime *>(ctx), U));
  PetscFunctionReturn(0);
}

PetscErrorCode RestoreReferences(TS, void *ctx)
{
  Runtime &R = *static_cast<Runtime *>(ctx);
  double  *x;
  PetscFunctionBegin;
  PetscCall(VecGetArray(R.axes, &x));
  std::copy(R.reference_before.begin(), R.reference_before.end(), x);
  PetscCall(ExchangeReferences(R, x));
  PetscCall(VecRestoreArray(R.axes, &x));
  PetscFunctionReturn(0);
}

PetscErrorCode RotationVectors(Runtime &R, TS ts, IS *is)
{
  Vec                   U;
  PetscInt              first;
  std::vector<PetscInt> at;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &U));
  PetscCall(VecGetOwnershipRange(U, &first, nullptr));
  for (PetscInt b = 0; b < R.bodies.own; b++)
    if (RotatesInSpace(R.bodies.body[b])) at.push_back(first + R.bodies.body[b].first + 3);
  PetscCall(ISCreateGeneral(R.scene.comm, (PetscInt)at.size(), at.data(), PETSC_COPY_VALUES, is));
  PetscFunctionReturn(0);
}

/* Completes the vector before a checkpoint is written; a restart that is due is in the file, too */
PetscErrorCode PrepareCheckpoint(TS ts)
{
  void *ctx;
  PetscFunctionBegin;
  PetscCall(TSGetI2Function(ts, nullptr, nullptr, &ctx));
  PetscCall(RestartAfterChange(*static_cast<Runtime *>(ctx), ts));
  PetscCall(WriteKept(*static_cast<Runtime *>(ctx)));
  PetscFunctionReturn(0);
}

} // namespace

PetscInt Memories(const Runtime &R)
{
  PetscInt n = 0;
  for (const auto &b : R.batches) n += b->memory();
  return n;
}

void CopyMemories(Runtime &R, double *x, bool in)
{
  for (auto &b : R.batches) {
    b->copyMemory(x, in);
    x += b->memory();
  }
}

/* Moves the bodies on this rank, including copies of other ranks' bodies, to the state (U, V) */
PetscErrorCode MoveBodies(Runtime &R, Vec U, Vec V)
{
  const double *u, *v, *local[3];
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  PetscCall(LocalState(R, u, v, v, local));
  R.bodies.move(local[0], local[1]);
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscFunctionReturn(0);
}

/* Updates memories of elements and queried angles at an accepted state */
PetscErrorCode Remember(Runtime &R, Vec U, Vec V)
{
  const double *u;
  PetscFunctionBegin;
  R.accepted_states++;
  R.start_parameters.clear();
  R.step_parameters = ParametersNow(R.scene);
  if (!R.has_memory && R.queried_angles.empty()) PetscFunctionReturn(0);
  PetscCall(MoveBodies(R, U, V));
  R.accepted_move = R.bodies.local ? R.bodies.moves : -1;
  for (auto &b : R.batches) b->accept(R.bodies);
  PetscCall(KeepMemories(R));
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(CountAngles(R, u, R.queried_angles));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscFunctionReturn(0);
}

/* For a run that has not begun: chooses new references or axes; attitudes and angular velocities do not change */
PetscErrorCode RenewAxes(Runtime &R, Vec U, Vec V)
{
  Vec A;
  PetscFunctionBegin;
  if (R.rotates_in_space && R.bodies.local) PetscCall(UpdateReferences(R, U));
  PetscCall(ChooseNewAxes(R, U, V));
  if (!R.changing_axes) PetscFunctionReturn(0);
  PetscCall(VecDuplicate(U, &A));
  PetscCall(VecZeroEntries(A));
  PetscCall(MapToNewAxes(nullptr, 0, U, V, A, &R));
  PetscCall(VecDestroy(&A));
  PetscCall(CommitAxes(nullptr, &R));
  PetscFunctionReturn(0);
}

/* Copies memories of elements into the checkpoint vector */
PetscErrorCode KeepMemories(Runtime &R)
{
  double *x;
  PetscFunctionBegin;
  PetscCall(VecGetArray(R.axes, &x));
  CopyMemories(R, x + 4 * R.bodies.own, false);
  PetscCall(VecRestoreArray(R.axes, &x));
  PetscFunctionReturn(0);
}

/* Creates the vector; axes of Euler angles are chosen by the initial attitudes and angular velocities */
PetscErrorCode MakeAxes(Runtime &R)
{
  double *x;
  int     local[2] = {0, Memories(R) > 0}, global[2];
  PetscFunctionBegin;
  for (PetscInt b = 0; b < R.bodies.own; b++) local[0] |= RotatesInSpace(R.bodies.body[b]);
  PetscCallMPI(MPI_Allreduce(local, global, 2, MPI_INT, MPI_MAX, R.scene.comm));
  R.rotates_in_space = global[0];
  R.has_memory       = global[1];
  PetscCall(VecCreate(R.scene.comm, &R.axes));
  PetscCall(VecSetSizes(R.axes, 4 * R.bodies.own + Memories(R) + Kept(R), PETSC_DETERMINE));
  PetscCall(VecSetType(R.axes, VECSTANDARD));
  if (R.size > 1) PetscCall(MakeAxesExchange(R));
  PetscCall(VecGetArray(R.axes, &x));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const BodyData &d = R.scene.bodies[R.bodies.body[b].id];
    Matrix3         C = Matrix3::Identity();
    if (RotatesInSpace(R.bodies.body[b])) C = R.bodies.local ? d.A : ChooseAxes(d.A, d.w);
    StoreQuaternion(Eigen::Quaterniond(C), x + 4 * b);
  }
  PetscCall(VecRestoreArray(R.axes, &x));
  if ((PetscInt)R.model->start_memories.size() == Memories(R)) CopyMemories(R, const_cast<double *>(R.model->start_memories.data()), true);
  PetscCall(KeepMemories(R));
  PetscCall(UseAxes(R));
  PetscFunctionReturn(0);
}

/* Copies references and memories from the vector */
PetscErrorCode UseAxes(Runtime &R)
{
  double *x;
  PetscFunctionBegin;
  PetscCall(VecGetArray(R.axes, &x));
  PetscCall(ExchangeReferences(R, x));
  CopyMemories(R, x + 4 * R.bodies.own, true);
  PetscCall(VecRestoreArray(R.axes, &x));
  PetscFunctionReturn(0);
}

static PetscErrorCode ToleranceOfAngles(const Runtime &R, Vec U, double whole, double angles, Vec *tolerance)
{
  double *x;
  PetscFunctionBegin;
  if (!*tolerance) PetscCall(VecDuplicate(U, tolerance));
  PetscCall(VecSet(*tolerance, whole));
  PetscCall(VecGetArray(*tolerance, &x));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (k.kind == BodyKind::Planar) x[k.first + 2] = angles;
    if (TurnsInSpace(k.kind)) std::fill(x + k.first + 3, x + k.first + 6, angles);
  }
  PetscCall(VecRestoreArray(*tolerance, &x));
  PetscFunctionReturn(0);
}

/* Angles have only an absolute tolerance, atol or -scene_angle_tol. A tolerance relative to their values, which depend on
   the axes and grow with every turn, would change although the effect of an error does not. */
PetscErrorCode AngleTolerances(Runtime &R, TS ts)
{
  PetscReal atol, rtol;
  Vec       vatol, vrtol, U;
  PetscFunctionBegin;
  PetscCall(TSGetTolerances(ts, &atol, &vatol, &rtol, &vrtol));
  /* the user has set tolerances of each unknown; the check of dropped rows uses the largest */
  if ((vatol && vatol != R.tolerance[0]) || (vrtol && vrtol != R.tolerance[1])) {
    R.tolerance_of[0] = atol;
    R.tolerance_of[1] = rtol;
    if (R.dropped && vatol) PetscCall(VecMax(vatol, nullptr, &R.tolerance_of[0]));
    if (R.dropped && vrtol) PetscCall(VecMax(vrtol, nullptr, &R.tolerance_of[1]));
    PetscFunctionReturn(0);
  }
  if (vrtol && R.tolerance_of[0] == atol && R.tolerance_of[1] == rtol) PetscFunctionReturn(0);
  PetscCall(TSGetSolution(ts, &U));
  const double whole[2] = {atol, rtol}, angles[2] = {R.scene.start.angle_tol, 0};
  for (int k = angles[0] > 0 ? 0 : 1; k < 2; k++) PetscCall(ToleranceOfAngles(R, U, whole[k], angles[k], &R.tolerance[k]));
  std::copy(whole, whole + 2, R.tolerance_of);
  PetscCall(TSSetTolerances(ts, atol, R.tolerance[0], rtol, R.tolerance[1]));
  PetscFunctionReturn(0);
}

PetscErrorCode AttachReframing(Runtime &R, TS ts)
{
  PetscFunctionBegin;
  const bool local = R.rotates_in_space && R.bodies.local;
  IS         is    = nullptr;
  PetscCall(TSHHT3SetCoordinateChange(ts, TestAxes, R.rotates_in_space && !local ? MapToNewAxes : nullptr, CommitAxes, &R));
  if (local) PetscCall(RotationVectors(R, ts, &is));
  PetscCall(TSHHT3SetRotations(ts, is, local ? UpdateReferencesOfTS : nullptr, local ? RestoreReferences : nullptr, &R));
  PetscCall(ISDestroy(&is));
  PetscCall(TSHHT3SetCheckpointVec(ts, R.axes));
  PetscCall(PetscObjectComposeFunction((PetscObject)ts, "TSHHT3CheckpointPrepare_C", PrepareCheckpoint));
  PetscCall(KeepNumbers(ts));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
