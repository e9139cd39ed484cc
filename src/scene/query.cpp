/*
  Questions to a run. Motion and loads are computed where the body or the element is, and sent to the other ranks; what a measure says
  is put together from them everywhere.
*/
#include "hhtdae/query.h"
#include "guard.h"
#include "measures.h"
#include "output/energy.h"
#include "runtime.h"
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

/* The run, and the unknowns of this rank and of its neighbours at the time asked for */
struct Snapshot::Work {
  Runtime            *R = nullptr;
  double              t = 0;
  std::vector<double> u, v, a;
  long                moved = -1; /* which move of the bodies was to this state */
  std::vector<CountedAngle> counted; /* as the run had them when the state was taken, after so many accepted states */
  long                      accepts = 0;
  std::vector<Matrix3>      references; /* of the bodies' rotations then; the run has others once it has gone on */

  Evaluation at() const { return Evaluation{t, u.data(), v.data(), a.data(), R->bodies, R->n}; }
  /* The bodies, where somebody else may have moved them */
  void move()
  {
    if (moved == R->bodies.moves) return;
    exchangeReferences();
    R->bodies.move(u.data(), v.data());
    exchangeReferences();
    moved = R->bodies.moves;
  }
  void exchangeReferences()
  {
    for (std::size_t b = 0; b < references.size(); b++) std::swap(R->bodies.body[b].C, references[b]);
  }
  const SceneData &scene() const { return R->scene; }
  PetscMPIInt      owner(PetscInt body) const { return R->number.owner.empty() ? 0 : R->number.owner[body]; }
  PetscMPIInt      ownerOfElement(const ElementData &e) const { return e.parts.empty() ? 0 : OwnerOf(*R->model, *e.parts[0].store, e.parts[0].index); }

  PetscErrorCode load(PetscInt element, PetscInt on, Load *x);
  PetscErrorCode motion(PetscInt marker, Motion *x);
  PetscErrorCode scalar(PetscMPIInt owner, PetscInt global, double *x);
  PetscErrorCode component(const ElementData &e, PetscInt row, bool constraint, double *x);
  PetscErrorCode ofMarkers(const Measure &m, double *x);
  PetscErrorCode angle(PetscInt i, PetscInt j, double *x);
  PetscErrorCode checkMemory(PetscInt element);
};

Snapshot::Snapshot() : work_(std::make_unique<Work>()) {}
Snapshot::~Snapshot() = default;
PetscReal Snapshot::time() const { return work_->t; }

namespace
{

/* Numbers that one rank computes, on all of them; what goes wrong there goes wrong everywhere */
template <class F> PetscErrorCode FromOwner(const Runtime &R, PetscMPIInt owner, double *x, int n, const F &compute)
{
  std::vector<double> all(n + 1, 0);
  PetscFunctionBegin;
  if (R.rank == owner) {
    all[n] = (double)Guarded([&] {
      compute(all.data());
      return PetscErrorCode(0);
    });
  }
  if (R.size > 1) PetscCallMPI(MPI_Bcast(all.data(), n + 1, MPI_DOUBLE, owner, R.scene.comm));
  PetscCheck(all[n] == 0, R.scene.comm, (PetscErrorCode)all[n], "rank %d could not answer a question to the run, see there", owner);
  std::copy(all.begin(), all.end() - 1, x);
  PetscFunctionReturn(0);
}

/* The unknowns on every rank that reads them */
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

constexpr int motion_size = 24;

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

/* Of a body of this rank, at its centre of mass */
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

/* At a point of the same body, with axes of its own */
Motion Moved(const Motion &b, const Vector3 &s, const Matrix3 &axes)
{
  const Vector3 arm = b.axes * s, &w = b.angular_velocity;
  Motion        m   = b;
  m.position += arm;
  m.velocity += w.cross(arm);
  m.acceleration += b.angular_acceleration.cross(arm) + w.cross(w.cross(arm));
  m.axes = b.axes * axes;
  return m;
}

void Resolve(Motion &m, const Matrix3 &R)
{
  for (Vector3 *y : {&m.position, &m.velocity, &m.acceleration, &m.angular_velocity, &m.angular_acceleration}) *y = R.transpose() * *y;
  m.axes = R.transpose() * m.axes;
}

/* u, u' and u'' of a run at t, or before its first step at where it stands; *copy: to be destroyed, whatever happens */
PetscErrorCode StateAt(TS ts, PetscReal *t, Vec W[3], TS *copy)
{
  PetscInt steps;
  PetscFunctionBegin;
  PetscCall(TSGetStepNumber(ts, &steps));
  if (steps) PetscCall(TSHHT3EvaluateAt(ts, *t, W[0], W[1], W[2]));
  else {
    PetscCall(TSGetTime(ts, t));
    PetscCall(StateOfStart(ts, W, copy));
  }
  PetscFunctionReturn(0);
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
  w.R = RunOf(ts);
  PetscCheck(w.R, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG, "Snapshot::take(): the TS is not one of a scene, Scene::createTS() makes them");
  PetscCall(PetscObjectTypeCompare((PetscObject)ts, TSHHT3, &ours));
  PetscCall(TSGetType(ts, &type));
  PetscCheck(ours, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP, "Snapshot::take(): TS type %s gives no accelerations; use hhtdae", type);
  PetscCall(TSGetSolution(ts, &U));
  for (Vec &x : W) PetscCall(VecDuplicate(U, &x));
  PetscErrorCode failed = StateAt(ts, &t, W, &copy);
  if (!failed) failed = take(*w.R, t, W);
  PetscCall(TSDestroy(&copy));
  for (Vec &x : W) PetscCall(VecDestroy(&x));
  PetscCall(failed);
  PetscFunctionReturn(0);
}

/* u, u' and u'' of the run at t, whatever it has reached */
PetscErrorCode Snapshot::take(Runtime &run, PetscReal t, Vec state[3])
{
  Work &w = *work_;
  PetscFunctionBegin;
  w.R                         = &run;
  w.t                         = t;
  w.moved                     = -1;
  w.counted                   = run.asked;
  w.accepts                   = run.accepts;
  w.references.clear();
  for (const LocalBody &b : run.bodies.body) w.references.push_back(b.C);
  std::vector<double> *out[3] = {&w.u, &w.v, &w.a};
  PetscCall(Localize(run, state, out));
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::take(TS ts)
{
  PetscReal t;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &t));
  PetscCall(take(ts, t));
  PetscFunctionReturn(0);
}

/* ---- motion ---- */

PetscErrorCode Snapshot::Work::motion(PetscInt marker, Motion *x)
{
  const MarkerData &m = scene().markers[marker];
  double            numbers[motion_size];
  PetscFunctionBegin;
  if (m.body < 0) {
    *x = Moved(Motion(), m.s, m.R);
    PetscFunctionReturn(0);
  }
  PetscCall(FromOwner(*R, owner(m.body), numbers, motion_size, [&](double *y) {
    move();
    Pack(Moved(OfBody(*R, m.body, at()), m.s, m.R), y);
  }));
  Unpack(numbers, *x);
  PetscFunctionReturn(0);
}

#define CHECK_TAKEN(w) PetscCheck((w).R, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Snapshot: nothing has been taken, call take() first")
#define CHECK_MARKER(w, m, what) \
  PetscCheck((w).scene().valid(m) && (w).scene().markers[(m).id].body >= -1, (w).scene().comm, PETSC_ERR_ARG_WRONG, "Snapshot: %s is not a marker of this scene", what)

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
  Resolve(*x, f.axes);
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
  Resolve(*x, f.axes);
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::motion(Body b, Motion *x)
{
  Work  &w = *work_;
  double numbers[motion_size];
  PetscFunctionBegin;
  CHECK_TAKEN(w);
  PetscCheck(w.scene().valid(b), w.scene().comm, PETSC_ERR_ARG_WRONG, "Snapshot: the body is not one of this scene");
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
  const int n = (int)w.scene().bodies[b.id].flexible->model->modes();
  coordinates->resize(n);
  PetscCall(FromOwner(*w.R, w.owner(b.id), coordinates->data(), n, [&](double *y) {
    const double *eta = w.u.data() + w.R->bodies.body[w.R->local_body[b.id]].first + 6;
    std::copy(eta, eta + n, y);
  }));
  PetscFunctionReturn(0);
}

/* ---- loads ---- */

/* What elements remember is that of the run as it is now */
PetscErrorCode Snapshot::Work::checkMemory(PetscInt element)
{
  const ElementData &e = scene().elements[element];
  double             n;
  PetscFunctionBegin;
  if (accepts == R->accepts) PetscFunctionReturn(0);
  PetscCall(FromOwner(*R, ownerOfElement(e), &n, 1, [&](double *y) {
    for (const auto &p : ReadersOf(*R, element)) *y += (double)p->memory();
  }));
  PetscCheck(n == 0, scene().comm, PETSC_ERR_ARG_WRONGSTATE,
             "Snapshot: the run has gone on since its state at t = %g was taken, and %s %s counts full turns or follows a curve, which it does for the "
             "present state alone; ask earlier, or take() again",
             t, e.type, e.name.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::Work::load(PetscInt element, PetscInt on, Load *x)
{
  const ElementData &e = scene().elements[element];
  double             numbers[6];
  Motion             at_marker;
  PetscFunctionBegin;
  PetscCall(checkMemory(element));
  PetscCall(motion(on, &at_marker));
  PetscCall(FromOwner(*R, ownerOfElement(e), numbers, 6, [&](double *y) {
    Vector3 f = Vector3::Zero(), m = f;
    move();
    const Evaluation ev = at();
    for (const auto &p : ReadersOf(*R, element)) {
      std::vector<Wrench<double>> wrench(p->markers());
      p->loads(ev, wrench.data());
      for (int k = 0; k < p->markers(); k++) {
        const PetscInt body = R->bodies.body[R->bodies.marker[p->marker(k)].body].id;
        if (body != scene().markers[on].body) continue;
        f += wrench[k].f;
        m += wrench[k].m + (R->bodies.frame(p->marker(k)).x - at_marker.position).cross(wrench[k].f);
      }
    }
    std::copy(f.data(), f.data() + 3, y);
    std::copy(m.data(), m.data() + 3, y + 3);
  }));
  x->force  = Eigen::Map<const Vector3>(numbers);
  x->moment = Eigen::Map<const Vector3>(numbers + 3);
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

/* ---- measures ---- */

/* An unknown; -1: it was dropped, and is zero */
PetscErrorCode Snapshot::Work::scalar(PetscMPIInt owner, PetscInt global, double *x)
{
  PetscFunctionBegin;
  *x = 0;
  if (global >= 0) PetscCall(FromOwner(*R, owner, x, 1, [&](double *y) { *y = u[global - R->start]; }));
  PetscFunctionReturn(0);
}

/* A multiplier, or a component of a force */
PetscErrorCode Snapshot::Work::component(const ElementData &e, PetscInt row, bool constraint, double *x)
{
  PetscFunctionBegin;
  *x = 0;
  for (const Part &p : e.parts) {
    if (p.store->isConstraint() != constraint) continue;
    if (row >= p.store->rows()) {
      row -= p.store->rows();
      continue;
    }
    const PetscMPIInt owner = OwnerOf(*R->model, *p.store, p.index);
    if (constraint && !p.store->isExplicit()) {
      const unsigned char active = p.store->active(p.index);
      PetscInt            place  = 0;
      for (PetscInt i = 0; i < row; i++) place += active >> i & 1;
      PetscCall(scalar(owner, active >> row & 1 ? p.store->start[p.index] + place : -1, x));
    } else if (p.store->carried(p.index)) {
      PetscCall(scalar(owner, p.store->start[p.index] + row, x));
    } else {
      PetscCall(checkMemory(p.store->element(p.index)));
      PetscCall(FromOwner(*R, owner, x, 1, [&](double *y) {
        std::vector<double> c(p.store->rows());
        move();
        const PetscInt element = p.store->element(p.index);
        const auto     part    = &p - scene().elements[element].parts.data();
        ReadersOf(*R, element)[part]->components(at(), c.data());
        *y = c[row];
      }));
    }
    break;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::Work::ofMarkers(const Measure &m, double *x)
{
  Motion i, j, frame;
  PetscFunctionBegin;
  PetscCall(motion(m.i.id, &i));
  if (m.j.id != -1) PetscCall(motion(m.j.id, &j));
  if (m.frame.id != -1) PetscCall(motion(m.frame.id, &frame));
  const Vector3 d = i.position - j.position, v = i.velocity - j.velocity, axis = frame.axes.col(std::clamp(m.component, 0, 2));
  switch (m.kind) {
  case Measure::Displacement: *x = axis.dot(d); break;
  case Measure::Distance: *x = d.norm(); break;
  case Measure::Velocity: *x = axis.dot(v); break;
  case Measure::Rate: *x = d.dot(v) / d.norm(); break;
  case Measure::Acceleration: *x = axis.dot(i.acceleration - j.acceleration); break;
  case Measure::AngularVelocity: *x = axis.dot(i.angular_velocity - j.angular_velocity); break;
  case Measure::AngularAcceleration: *x = axis.dot(i.angular_acceleration - j.angular_acceleration); break;
  default: *x = 0;
  }
  PetscFunctionReturn(0);
}

/* The run counts the turns of an angle from the first question for it on */
PetscErrorCode Snapshot::Work::angle(PetscInt i, PetscInt j, double *x)
{
  const auto                same = [&](const CountedAngle &c) { return c.i == i && c.j == j; };
  const auto                mine = std::find_if(counted.begin(), counted.end(), same);
  std::vector<CountedAngle> now(1);
  PetscFunctionBegin;
  move();
  if (mine != counted.end()) {
    now[0] = *mine;
  } else {
    PetscCall(FirstAngle(*R, u.data(), t, i, j, &now[0]));
    const bool here = accepts == R->accepts; /* else the run has gone on since the state was taken */
    if (here && std::none_of(R->asked.begin(), R->asked.end(), same)) R->asked.push_back(now[0]);
    counted.push_back(now[0]);
  }
  PetscCall(CountAngles(*R, u.data(), now));
  *x = now[0].angle;
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::value(const Measure &m, double *x)
{
  Work              &w = *work_;
  Load               l;
  double             other;
  std::vector<double> eta;
  PetscFunctionBegin;
  CHECK_TAKEN(w);
  const SceneData  &s     = w.scene();
  const Numbering  &N     = w.R->number;
  const std::string error = CheckMeasure(s, m, false);
  PetscCheck(error.empty(), s.comm, PETSC_ERR_ARG_WRONG, "Snapshot::value(): %s", error.c_str());
  const bool of_element = (m.kind >= Measure::Multiplier && m.kind <= Measure::Component) || m.kind == Measure::ElementForce || m.kind == Measure::ElementMoment;
  *x                    = 0;
  if (of_element && s.elements[m.target].parts.empty()) PetscFunctionReturn(0); /* absent */
  switch (m.kind) {
  case Measure::Time: *x = w.t; break;
  case Measure::KineticEnergy: PetscCall(energy(x, &other)); break;
  case Measure::PotentialEnergy: PetscCall(energy(&other, x)); break;
  case Measure::Value: PetscCall(w.scalar(N.variable_owner[m.target], N.variable[m.target], x)); break;
  case Measure::StateValue: PetscCall(w.scalar(N.state_owner[m.target], N.state[m.target], x)); break;
  case Measure::Modal:
    PetscCall(modes(Body{m.target}, &eta));
    *x = eta[m.component];
    break;
  case Measure::Multiplier: PetscCall(w.component(s.elements[m.target], m.component, true, x)); break;
  case Measure::Component: PetscCall(w.component(s.elements[m.target], m.component, false, x)); break;
  case Measure::JointForce:
  case Measure::JointMoment:
    PetscCall(load(Element{m.target}, s.elements[m.target].i, &l, m.frame.id != -1 ? m.frame : s.elements[m.target].j));
    *x = m.kind == Measure::JointForce ? l.force(m.component) : l.moment(m.component);
    break;
  case Measure::ElementForce:
  case Measure::ElementMoment:
    PetscCall(load(Element{m.target}, m.i, &l, m.frame));
    *x = m.kind == Measure::ElementForce ? l.force(m.component) : l.moment(m.component);
    break;
  case Measure::Angle: PetscCall(w.angle(m.i.id, m.j.id, x)); break;
  default: PetscCall(w.ofMarkers(m, x));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::energy(double *kinetic, double *potential)
{
  Work   &w = *work_;
  Balance b;
  PetscFunctionBegin;
  CHECK_TAKEN(w);
  w.move();
  PetscCall(MakeBalance(*w.R, w.at(), b));
  *kinetic   = b.kinetic;
  *potential = b.potential();
  PetscFunctionReturn(0);
}

} // namespace hhtdae
