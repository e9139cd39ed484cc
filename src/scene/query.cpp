/*
  Queries of a run. Motion and loads are computed by the owner of the body or element and sent to the other ranks; measures are
  evaluated from them on all ranks (query_measures.cpp).
*/
#include "hhtdae/query.h"
#include "snapshot.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

Vector3 Motion::euler() const
{
  const double sine = std::hypot(axes(0, 2), axes(1, 2));
  if (sine < 1e-12) return {std::atan2(axes(1, 0), axes(0, 0)), axes(2, 2) > 0 ? 0 : M_PI, 0};
  return {std::atan2(axes(0, 2), -axes(1, 2)), std::atan2(sine, axes(2, 2)), std::atan2(axes(2, 0), axes(2, 1))};
}

Vector3 Motion::bryant() const
{
  const double cosine = std::hypot(axes(0, 0), axes(0, 1));
  if (cosine < 1e-12) return {std::atan2(axes(2, 1), axes(1, 1)), axes(0, 2) > 0 ? M_PI / 2 : -M_PI / 2, 0};
  return {std::atan2(-axes(1, 2), axes(2, 2)), std::atan2(axes(0, 2), cosine), std::atan2(-axes(0, 1), axes(0, 0))};
}

Snapshot::Snapshot() : work_(std::make_unique<Work>()) {}
Snapshot::~Snapshot() = default;
PetscReal Snapshot::time() const { return work_->t; }

namespace
{

/* The local unknowns of a state: own ones, then those of other ranks that this rank reads */
PetscErrorCode Localize(Runtime &R, Vec W[3], std::vector<double> *out[3])
{
  const double       *w[3], *local[3];
  std::vector<double> room;
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) PetscCall(VecGetArrayRead(W[k], &w[k]));
  PetscCall(LocalMotion(R, w[0], w[1], w[2], room, local));
  for (int k = 0; k < 3; k++) out[k]->assign(local[k], local[k] + R.n + R.others.size());
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArrayRead(W[k], &w[k]));
  PetscFunctionReturn(0);
}

constexpr int motion_size = 24; /* number of values in a Motion */

void Pack(const Motion &m, double *x)
{
  for (const Vector3 *y : {&m.position, &m.velocity, &m.acceleration, &m.angular_velocity, &m.angular_acceleration}) x = std::copy(y->data(), y->data() + 3, x);
  std::copy(m.axes.data(), m.axes.data() + 9, x);
}
void Unpack(const double *x, Motion &m)
{
  for (Vector3 *y : {&m.position, &m.velocity, &m.acceleration, &m.angular_velocity, &m.angular_acceleration}) {
    *y = Eigen::Map<const Vector3>(x);
    x += 3;
  }
  m.axes = Eigen::Map<const Matrix3>(x);
}

/* Motion of a body of this rank, at its centre of mass */
Motion OfBody(const Runtime &R, PetscInt id, const Evaluation &e)
{
  const PetscInt    b = R.local_body[id];
  const BodyMotion &n = R.bodies.now[b];
  Motion            m;
  m.position         = n.r;
  m.velocity         = n.v;
  m.axes             = n.A;
  m.angular_velocity = n.w;
  m.acceleration         = R.bodies.acceleration(b, e.v, e.a);
  m.angular_acceleration = R.bodies.angularAcceleration(b, e.v, e.a);
  return m;
}

/* Motion of a point fixed to the body with motion b: s is its position in the body, `axes` its axes there */
Motion MotionAtPoint(const Motion &b, const Vector3 &s, const Matrix3 &axes)
{
  const Vector3 arm = b.axes * s, &w = b.angular_velocity;
  Motion        m   = b;
  m.position += arm;
  m.velocity += w.cross(arm);
  m.acceleration += b.angular_acceleration.cross(arm) + w.cross(w.cross(arm));
  m.axes = b.axes * axes;
  return m;
}

void ToAxes(Motion &m, const Matrix3 &R)
{
  for (Vector3 *y : {&m.position, &m.velocity, &m.acceleration, &m.angular_velocity, &m.angular_acceleration}) *y = R.transpose() * *y;
  m.axes = R.transpose() * m.axes;
}

} // namespace

PetscErrorCode Snapshot::take(TS ts, PetscReal t)
{
  TS        copy = nullptr;
  Vec       U, W[3];
  PetscBool ours;
  TSType    type;
  Work     &w = *work_;
  PetscFunctionBegin;
  PetscCall(ReadCheckpoint(ts));
  w.R = RunOf(ts);
  PetscCheck(w.R, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG, "Snapshot::take(): the TS is not one of a scene, Scene::createTS() makes them");
  PetscCall(PetscObjectTypeCompare((PetscObject)ts, TSHHT3, &ours));
  PetscCall(TSGetType(ts, &type));
  PetscCheck(ours, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP, "Snapshot::take(): TS type %s gives no accelerations; use hhtdae", type);
  PetscCall(TSGetSolution(ts, &U));
  for (Vec &x : W) PetscCall(VecDuplicate(U, &x));
  PetscErrorCode failed = StateAt(ts, t, true, W, &copy);
  if (!failed) failed = take(*w.R, t, W);
  if (!failed) failed = ParametersAt(*w.R, ts, t, &w.origin.parameters);
  /* a copy that has made the first step has other reference attitudes than the run */
  for (std::size_t b = 0; copy && !failed && b < w.origin.references.size(); b++) w.origin.references[b] = RunOf(copy)->bodies.body[b].C;
  PetscCall(TSDestroy(&copy));
  for (Vec &x : W) PetscCall(VecDestroy(&x));
  PetscCall(failed);
  PetscFunctionReturn(0);
}

/* state: u, u' and u'' at t, which need not be the present state of the run */
PetscErrorCode Snapshot::take(Runtime &run, PetscReal t, Vec state[3])
{
  Work &w = *work_;
  PetscFunctionBegin;
  w.R     = &run;
  w.t     = t;
  w.moved = -1;
  w.origin.take(run);
  std::vector<double> *out[3] = {&w.u, &w.v, &w.a};
  PetscCall(Localize(run, state, out));
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::take(TS ts)
{
  PetscReal t;
  PetscFunctionBegin;
  PetscCall(ReadCheckpoint(ts));
  PetscCall(TSGetTime(ts, &t));
  PetscCall(take(ts, t));
  PetscFunctionReturn(0);
}

/* ---- motion ---- */

PetscErrorCode Snapshot::Work::hasBody(PetscInt body) const
{
  PetscFunctionBegin;
  PetscCheck(body < (PetscInt)R->local_body.size(), scene().comm, PETSC_ERR_ARG_WRONGSTATE,
             "Snapshot: body %s came too late: the scene is fixed from its set-up or first run on; ask flexible bodies for their attachments and nodes, attachment() and node(), before",
             scene().bodyName(body).c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::Work::hasElement(PetscInt element) const
{
  const ElementData &e     = scene().elements[element];
  const auto         known = [](const Part &p) { return p.index < (PetscInt)p.store->start.size(); };
  PetscFunctionBegin;
  PetscCheck(std::all_of(e.parts.begin(), e.parts.end(), known), scene().comm, PETSC_ERR_ARG_WRONGSTATE, "Snapshot: element %s came too late: the scene is fixed from its set-up or first run on",
             e.name.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::Work::motion(PetscInt marker, Motion *x)
{
  const MarkerData &m = scene().markers[marker];
  double            numbers[motion_size];
  PetscFunctionBegin;
  PetscCall(hasBody(m.body));
  if (m.body < 0) {
    *x = MotionAtPoint(Motion(), m.s, m.R);
    PetscFunctionReturn(0);
  }
  PetscCall(FromOwner(*R, owner(m.body), numbers, motion_size, [&](double *y) {
    move();
    Pack(MotionAtPoint(OfBody(*R, m.body, at()), m.s, m.R), y);
  }));
  Unpack(numbers, *x);
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::motion(Marker m, Motion *x, Marker axes)
{
  Motion f;
  PetscFunctionBegin;
  CHECK_TAKEN(*work_);
  CHECK_MARKER(*work_, m, "the first");
  PetscCall(work_->motion(m.id, x));
  if (axes.id == -1) PetscFunctionReturn(0);
  CHECK_MARKER(*work_, axes, "that of the axes");
  PetscCall(work_->motion(axes.id, &f));
  ToAxes(*x, f.axes);
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::relativeMotion(Marker m, Marker to, Motion *x)
{
  Motion f;
  PetscFunctionBegin;
  CHECK_TAKEN(*work_);
  CHECK_MARKER(*work_, m, "the first");
  CHECK_MARKER(*work_, to, "the second");
  PetscCall(work_->motion(m.id, x));
  PetscCall(work_->motion(to.id, &f));
  const Vector3 d = x->position - f.position, &w = f.angular_velocity;
  const Vector3 v = x->velocity - f.velocity - w.cross(d);
  x->acceleration += -f.acceleration - f.angular_acceleration.cross(d) - w.cross(w.cross(d)) - 2 * w.cross(v);
  x->angular_acceleration += -f.angular_acceleration - w.cross(x->angular_velocity);
  x->angular_velocity -= w;
  x->position = d;
  x->velocity = v;
  ToAxes(*x, f.axes);
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::motion(Body b, Motion *x)
{
  Work  &w = *work_;
  double numbers[motion_size];
  PetscFunctionBegin;
  CHECK_TAKEN(w);
  PetscCheck(w.scene().valid(b), w.scene().comm, PETSC_ERR_ARG_WRONG, "Snapshot: the body is not one of this scene");
  PetscCall(w.hasBody(b.id));
  PetscCall(FromOwner(*w.R, w.owner(b.id), numbers, motion_size, [&](double *y) {
    w.move();
    Pack(OfBody(*w.R, b.id, w.at()), y);
  }));
  Unpack(numbers, *x);
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::modes(Body b, std::vector<double> *coordinates)
{
  Work &w = *work_;
  PetscFunctionBegin;
  CHECK_TAKEN(w);
  PetscCheck(w.scene().valid(b) && w.scene().bodies[b.id].flexible, w.scene().comm, PETSC_ERR_ARG_WRONG, "Snapshot: the body is not a flexible one of this scene");
  PetscCall(w.hasBody(b.id));
  const int n = (int)w.scene().bodies[b.id].flexible->model->modes();
  coordinates->resize(n);
  PetscCall(FromOwner(*w.R, w.owner(b.id), coordinates->data(), n, [&](double *y) {
    const double *eta = w.u.data() + w.R->bodies.body[w.R->local_body[b.id]].first + 6;
    std::copy(eta, eta + n, y);
  }));
  PetscFunctionReturn(0);
}

/* ---- loads ---- */

PetscErrorCode Snapshot::Work::load(PetscInt element, PetscInt on, Load *x)
{
  using Six = Eigen::Matrix<double, 6, 1>;
  const ElementData &e = scene().elements[element];
  Six                part, whole = Six::Zero(); /* force and moment */
  Motion             at_marker;
  PetscFunctionBegin;
  PetscCall(hasElement(element));
  PetscInt       elsewhere;
  const PetscInt loaded = scene().loadedBody(e, scene().markers[on].body, &elsewhere);
  PetscCheck(elsewhere < 0, scene().comm, PETSC_ERR_ARG_WRONG, "Snapshot: %s %s acts on %s, not on %s, which is another part of the same flexible body: ask at a marker there", e.type, e.name.c_str(),
             scene().bodyName(elsewhere).c_str(), scene().bodyName(scene().markers[on].body).c_str());
  PetscCall(motion(on, &at_marker));
  for (const Part &p : e.parts) {
    PetscCall(FromOwner(*R, OwnerOf(*R->model, *p.store, p.index), part.data(), 6, [&](double *y) {
      Eigen::Map<Six> sum(y);
      move();
      const CountFrom             then(*R, origin);
      const Evaluation            ev     = at();
      Probe                      &reader = ReaderOf(*R, p);
      std::vector<Wrench<double>> wrench(reader.markers());
      reader.loads(ev, wrench.data());
      for (int k = 0; k < reader.markers(); k++) {
        if (R->bodies.body[R->bodies.marker[reader.marker(k)].body].id != loaded) continue;
        sum.head<3>() += wrench[k].f;
        sum.tail<3>() += wrench[k].m + (R->bodies.frame(reader.marker(k)).x - at_marker.position).cross(wrench[k].f);
      }
    }));
    whole += part;
  }
  x->force  = whole.head<3>();
  x->moment = whole.tail<3>();
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::load(Element e, Marker on, Load *x, Marker axes)
{
  Work  &w = *work_;
  Motion f;
  PetscFunctionBegin;
  CHECK_TAKEN(w);
  PetscCheck(w.scene().valid(e), w.scene().comm, PETSC_ERR_ARG_WRONG, "Snapshot: the element is not one of this scene");
  CHECK_MARKER(w, on, "that of the load");
  PetscCall(w.load(e.id, on.id, x));
  if (axes.id == -1) PetscFunctionReturn(0);
  CHECK_MARKER(w, axes, "that of the axes");
  PetscCall(w.motion(axes.id, &f));
  x->force  = f.axes.transpose() * x->force;
  x->moment = f.axes.transpose() * x->moment;
  PetscFunctionReturn(0);
}

} // namespace hhtdae
