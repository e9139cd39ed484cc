/*
  What rotational coordinates refer to. Local rotation vectors count from the attitude at the last accepted step: the integrator tells where
  that is, TSHHT3SetRotations().

  Of Euler angles, a body whose theta comes near 0 or pi gets new axes: they then belong to another frame fixed in the body, in which it
  is far from the singularity. The integrator carries angles, rates, accelerations and their history over, TSHHT3SetCoordinateChange(). The
  same call before each step tells that the state has been accepted, and angles that are counted over full turns remember where they are.

  References and remembered angles are in one vector, Runtime::axes, which checkpoints keep: the quaternion of LocalBody::C per own rigid
  body, then the memories of the elements.
*/
#include "runtime.h"

namespace hhtdae
{

namespace
{

bool HasAxes(const LocalBody &k) { return TurnsInSpace(k.kind); }

void Store(const Eigen::Quaterniond &q, double *x)
{
  x[0] = q.w();
  x[1] = q.x();
  x[2] = q.y();
  x[3] = q.z();
}

Matrix3 Load(const double *x) { return Eigen::Quaterniond(x[0], x[1], x[2], x[3]).normalized().toRotationMatrix(); }

/* Leaves: others' rigid bodies here; roots: own bodies of their owners */
PetscErrorCode MakeExchange(Runtime &R)
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

/* Own bodies that need other axes, and which */
PetscErrorCode ChooseNext(Runtime &R, Vec U, Vec V)
{
  const double *u, *v;
  PetscFunctionBegin;
  R.next_body.clear();
  R.next_axes.clear();
  R.changing = false;
  if (!R.turns || R.bodies.local) PetscFunctionReturn(0);
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (!HasAxes(k)) continue;
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
  R.changing = any;
  PetscFunctionReturn(0);
}

/* Axes and memories go forward in time */
PetscErrorCode CheckTime(Runtime &R, PetscReal t)
{
  PetscFunctionBegin;
  PetscCheck(t >= R.accepted, R.scene.comm, PETSC_ERR_ARG_WRONGSTATE,
             "the TS starts again at t = %g, but what its rotations count from and its unwound angles are those of t = %g: take a new TS from "
             "Scene::createTS() for another run, or TSHHT3CheckpointLoad() to go back",
             (double)t, (double)R.accepted);
  R.accepted = t;
  PetscFunctionReturn(0);
}

PetscErrorCode Test(TS ts, PetscReal t, Vec U, Vec V, PetscBool *change, void *ctx)
{
  Runtime &R = *static_cast<Runtime *>(ctx);
  PetscFunctionBegin;
  PetscCall(CheckTime(R, t));
  PetscCall(TellOfNoOutput(R, ts));
  PetscCall(AngleTolerances(R, ts));
  PetscCall(Remember(R, U, V));
  PetscCall(CheckDropped(R, t, U, V));
  PetscCall(ChooseNext(R, U, V));
  *change = R.changing ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

/* The same attitude, angular velocity and acceleration in other axes; eps'' also when it is not quite at the time of eps */
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

PetscErrorCode Map(TS, PetscReal, Vec U, Vec V, Vec A, void *ctx)
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

/* A checkpoint has been loaded: the tolerances as the run had set them in its first step, and the rest of the vector */
PetscErrorCode Resume(Runtime &R, TS ts)
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

/* New axes into the vector, and from it to where they are used; also after a checkpoint has been loaded */
PetscErrorCode Commit(TS ts, void *ctx)
{
  Runtime &R = *static_cast<Runtime *>(ctx);
  double  *x;
  PetscFunctionBegin;
  PetscCall(VecGetArray(R.axes, &x));
  for (std::size_t i = 0; i < R.next_body.size(); i++) {
    Store(Eigen::Quaterniond(R.next_axes[i]), x + 4 * R.next_body[i]);
    PetscCall(PetscInfo(ts, "new axes for the Euler angles of %s\n", R.scene.bodyName(R.bodies.body[R.next_body[i]].id).c_str()));
  }
  PetscCall(VecRestoreArray(R.axes, &x));
  if (R.next_body.empty()) R.accepted = PETSC_NINFINITY; /* a checkpoint, of any time */
  R.reframed += (PetscInt)R.next_body.size();
  R.next_body.clear();
  R.next_axes.clear();
  PetscCall(UseAxes(R));
  if (!R.changing) PetscCall(Resume(R, ts));
  R.changing = false;
  PetscFunctionReturn(0);
}

/* Others' bodies refer to what their owners say */
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
    if (HasAxes(R.bodies.body[b])) R.bodies.body[b].C = Load(b < R.bodies.own ? own + 4 * b : other.data() + 4 * (b - R.bodies.own));
  PetscFunctionReturn(0);
}

/* Local rotation vectors count from where U is */
PetscErrorCode Refer(Runtime &R, Vec U)
{
  double *u, *x;
  PetscFunctionBegin;
  PetscCall(VecGetArray(U, &u));
  PetscCall(VecGetArray(R.axes, &x));
  R.reference_before.assign(x, x + 4 * R.bodies.own);
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (!HasAxes(k)) continue;
    double *turn = u + k.first + 3, *q = x + 4 * b;
    Store((LocalTurn(Vector3(turn[0], turn[1], turn[2])) * Eigen::Quaterniond(q[0], q[1], q[2], q[3])).normalized(), q);
    std::fill(turn, turn + 3, 0.0);
  }
  PetscCall(ExchangeReferences(R, x));
  PetscCall(VecRestoreArray(R.axes, &x));
  PetscCall(VecRestoreArray(U, &u));
  PetscFunctionReturn(0);
}

PetscErrorCode ReferTo(TS, Vec U, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(Refer(*static_cast<Runtime *>(ctx), U));
  PetscFunctionReturn(0);
}

PetscErrorCode ReferBack(TS, void *ctx)
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
    if (HasAxes(R.bodies.body[b])) at.push_back(first + R.bodies.body[b].first + 3);
  PetscCall(ISCreateGeneral(R.scene.comm, (PetscInt)at.size(), at.data(), PETSC_COPY_VALUES, is));
  PetscFunctionReturn(0);
}

/* Before a checkpoint is written */
PetscErrorCode Prepare(TS ts)
{
  void *ctx;
  PetscFunctionBegin;
  PetscCall(TSGetI2Function(ts, nullptr, nullptr, &ctx));
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

/* Motion of the bodies in the state (U, V), with others' bodies */
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

/* Elements and questions remember the accepted state */
PetscErrorCode Remember(Runtime &R, Vec U, Vec V)
{
  const double *u;
  PetscFunctionBegin;
  R.accepts++;
  R.step_parameters = ParametersNow(R.scene);
  if (!R.remembers && R.asked.empty()) PetscFunctionReturn(0);
  PetscCall(MoveBodies(R, U, V));
  R.moved = R.bodies.local ? R.bodies.moves : -1;
  for (auto &b : R.batches) b->accept(R.bodies);
  PetscCall(KeepMemories(R));
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(CountAngles(R, u, R.asked));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscFunctionReturn(0);
}

/* Before a run has begun: new axes for the bodies that need them, at the same attitudes and angular velocities */
PetscErrorCode RenewAxes(Runtime &R, Vec U, Vec V)
{
  Vec A;
  PetscFunctionBegin;
  if (R.turns && R.bodies.local) PetscCall(Refer(R, U));
  PetscCall(ChooseNext(R, U, V));
  if (!R.changing) PetscFunctionReturn(0);
  PetscCall(VecDuplicate(U, &A));
  PetscCall(VecZeroEntries(A));
  PetscCall(Map(nullptr, 0, U, V, A, &R));
  PetscCall(VecDestroy(&A));
  PetscCall(Commit(nullptr, &R));
  PetscFunctionReturn(0);
}

/* What elements remember into the vector that checkpoints keep */
PetscErrorCode KeepMemories(Runtime &R)
{
  double *x;
  PetscFunctionBegin;
  PetscCall(VecGetArray(R.axes, &x));
  CopyMemories(R, x + 4 * R.bodies.own, false);
  PetscCall(VecRestoreArray(R.axes, &x));
  PetscFunctionReturn(0);
}

/* Makes the vector, with the axes that the initial attitudes and angular velocities choose */
PetscErrorCode MakeAxes(Runtime &R)
{
  double *x;
  int     local[2] = {0, Memories(R) > 0}, global[2];
  PetscFunctionBegin;
  for (PetscInt b = 0; b < R.bodies.own; b++) local[0] |= HasAxes(R.bodies.body[b]);
  PetscCallMPI(MPI_Allreduce(local, global, 2, MPI_INT, MPI_MAX, R.scene.comm));
  R.turns     = global[0];
  R.remembers = global[1];
  PetscCall(VecCreate(R.scene.comm, &R.axes));
  PetscCall(VecSetSizes(R.axes, 4 * R.bodies.own + Memories(R) + Kept(R), PETSC_DETERMINE));
  PetscCall(VecSetType(R.axes, VECSTANDARD));
  if (R.size > 1) PetscCall(MakeExchange(R));
  PetscCall(VecGetArray(R.axes, &x));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const BodyData &d = R.scene.bodies[R.bodies.body[b].id];
    Matrix3         C = Matrix3::Identity();
    if (HasAxes(R.bodies.body[b])) C = R.bodies.local ? d.A : ChooseAxes(d.A, d.w);
    Store(Eigen::Quaterniond(C), x + 4 * b);
  }
  PetscCall(VecRestoreArray(R.axes, &x));
  if ((PetscInt)R.model->turned.size() == Memories(R)) CopyMemories(R, const_cast<double *>(R.model->turned.data()), true);
  PetscCall(KeepMemories(R));
  PetscCall(UseAxes(R));
  PetscFunctionReturn(0);
}

/* Axes and memories as the vector has them */
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

/* Angles are measured against atol alone, or a tolerance of their own: their values depend on the axes and grow with every turn, while an error of an
   angle does not. */
PetscErrorCode AngleTolerances(Runtime &R, TS ts)
{
  PetscReal atol, rtol;
  Vec       vatol, vrtol, U;
  PetscFunctionBegin;
  PetscCall(TSGetTolerances(ts, &atol, &vatol, &rtol, &vrtol));
  if ((vatol && vatol != R.tolerance[0]) || (vrtol && vrtol != R.tolerance[1])) { /* the user's own, by the largest of which dropped rows are judged */
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
  const bool local = R.turns && R.bodies.local;
  IS         is    = nullptr;
  PetscCall(TSHHT3SetCoordinateChange(ts, Test, R.turns && !local ? Map : nullptr, Commit, &R));
  if (local) PetscCall(RotationVectors(R, ts, &is));
  PetscCall(TSHHT3SetRotations(ts, is, local ? ReferTo : nullptr, local ? ReferBack : nullptr, &R));
  PetscCall(ISDestroy(&is));
  PetscCall(TSHHT3SetCheckpointVec(ts, R.axes));
  PetscCall(PetscObjectComposeFunction((PetscObject)ts, "TSHHT3CheckpointPrepare_C", Prepare));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
