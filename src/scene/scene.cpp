/* The scene as its user describes it. */
#include "extension.h"
#include "start.h"
#include <cmath>

namespace hhtdae
{

namespace
{

PetscInt NextNumber()
{
  static PetscInt scenes = 0;
  return ++scenes;
}

} // namespace

SceneData::SceneData() : number(NextNumber()) {}
SceneData::~SceneData() = default;

Scene::Scene(MPI_Comm comm, Space space) : data_(std::make_unique<SceneData>())
{
  number_       = data_->number;
  data_->comm   = comm;
  data_->planar = space == Space::Planar;
}

Scene::~Scene() = default;

Body Scene::add(const std::string &name, const RigidBody &b)
{
  BodyData d;
  d.name        = name.empty() ? "body " + std::to_string(data_->bodies.size()) : name;
  data_->refuseLate("body " + d.name);
  d.mass        = b.mass;
  d.inertia     = b.inertia;
  d.center      = b.center;
  d.A           = b.rotation;
  d.r           = b.position + b.rotation * b.center;
  d.v           = b.velocity;
  d.w           = b.angular_velocity;
  d.fixed_start = b.fixed_start;
  data_->bodies.push_back(d);
  return Body{(PetscInt)data_->bodies.size() - 1, number_};
}

Body Scene::add(const std::string &name, const PointMass &b)
{
  RigidBody r;
  r.mass        = b.mass;
  r.position    = b.position;
  r.velocity    = b.velocity;
  r.fixed_start = b.fixed_start;
  const Body body = add(name, r);
  data_->bodies[body.id].point = true;
  return body;
}

Marker Scene::marker(Body body, const Vector3 &position, const Matrix3 &axes, const std::string &name)
{
  SceneData     &s    = *data_;
  const PetscInt id   = (PetscInt)s.markers.size();
  const bool     good = body.id == -1 || s.valid(body);
  const std::string who = "marker " + (name.empty() ? std::to_string(id) : name);
  s.refuseLate(who);
  if (!good) s.errors.push_back(who + ": its body is not one of this scene");
  else if (body.id >= 0 && s.bodies[body.id].flexible)
    s.errors.push_back(who + ": a flexible body is held at its attachments; use scene.attachment(" + s.bodies[body.id].name + ", ...) as the marker's body");
  if (!position.allFinite() || !axes.allFinite() || (axes.transpose() * axes - Matrix3::Identity()).norm() > 1e-8 || axes.determinant() < 0)
    s.errors.push_back(who + ": position must be finite and axes orthonormal and right-handed");
  MarkerData m{good ? body.id : -2, position, axes};
  if (good && body.id >= 0) {
    m.s -= s.bodies[body.id].center;
    if (s.bodies[body.id].point && m.s.norm() > 0) s.errors.push_back(who + ": a marker on the point mass " + s.bodies[body.id].name + " must be at its position");
  }
  s.markers.push_back(m);
  if (!name.empty()) s.marker_names[id] = name;
  return Marker{id, number_};
}

Marker Scene::markerAt(Body body, const Vector3 &position, const Matrix3 &axes, const std::string &name)
{
  if (!data_->valid(body)) return marker(body, position, axes, name);
  const BodyData &b = data_->bodies[body.id];
  return marker(body, b.A.transpose() * (position - b.r) + b.center, b.A.transpose() * axes, name);
}

Variable Scene::variable(const std::string &name, const Expression &definition, double initial)
{
  data_->refuseLate("variable " + name);
  data_->variables.push_back({name.empty() ? "variable " + std::to_string(data_->variables.size()) : name, definition, initial});
  return Variable{(PetscInt)data_->variables.size() - 1, number_};
}

State Scene::state(const std::string &name, const Expression &rate, double initial)
{
  data_->refuseLate("state " + name);
  data_->states.push_back({name.empty() ? "state " + std::to_string(data_->states.size()) : name, rate, initial});
  return State{(PetscInt)data_->states.size() - 1, number_};
}

void Scene::gravity(const Vector3 &acceleration)
{
  data_->refuseLate("gravity");
  if (!acceleration.allFinite()) data_->errors.push_back("gravity must be finite");
  data_->gravity = acceleration;
}

Frame<double> SceneData::frame(Marker m) const
{
  const MarkerData &k = markers[m.id];
  if (k.body < 0) return {k.s, k.R};
  const BodyData &b = bodies[k.body];
  return {b.r + b.A * k.s, b.A * k.R};
}

Twist<double> SceneData::twist(Marker m) const
{
  const MarkerData &k = markers[m.id];
  if (k.body < 0) return {Vector3::Zero(), Vector3::Zero()};
  const BodyData &b = bodies[k.body];
  return {b.v + b.w.cross(b.A * k.s), b.w};
}

/* ---- elements ---- */

ElementBuilder::ElementBuilder(Scene &scene, const std::string &name, const char *type, ElementData::Kind kind, Marker i, Marker j,
                               bool pair)
    : data_(scene.data())
{
  element_.name = name.empty() ? std::string(type) + " " + std::to_string(data_.elements.size()) : name;
  element_.type = type;
  element_.kind = kind;
  element_.i    = i;
  element_.j    = j;
  data_.refuseLate(element_.type + (" " + element_.name));
  require(i, "marker i");
  if (!pair) return;
  require(j, "marker j");
  if (good_) require(i.id != j.id, "markers i and j are the same");
}

void ElementBuilder::require(bool condition, const std::string &message)
{
  if (condition) return;
  good_ = false;
  data_.errors.push_back(std::string(element_.type) + " " + element_.name + ": " + message);
}

void ElementBuilder::require(Marker m, const char *what)
{
  require(data_.valid(m) && data_.markers[m.id].body >= -1, std::string(what) + " is not a marker of this scene");
}

Element ElementBuilder::done()
{
  data_.elements.push_back(std::move(element_));
  return Element{(PetscInt)data_.elements.size() - 1, data_.number};
}

/* ---- from description to work ---- */

StartPolicy &Scene::start() { return data_->start; }

PetscErrorCode Scene::setUp()
{
  SceneData &s = *data_;
  PetscFunctionBegin;
  if (s.run) PetscFunctionReturn(0);
  PetscCall(TSHHT3Initialize());
  PetscCall(DeclareSceneOptions());
  PetscCall(ReadStartOptions(s));
  PetscCall(CheckDescription(s));
  auto     run = std::make_unique<Runtime>(s);
  Runtime &R   = *run;
  PetscCallMPI(MPI_Comm_rank(s.comm, &R.rank));
  PetscCallMPI(MPI_Comm_size(s.comm, &R.size));
  PetscCall(Partition(s, R.size, R.number.owner));
  PetscCall(Assemble(R));
  PetscCall(DropRedundant(R));
  PetscCall(Number(R));
  PetscCall(WantTriangle(R));
  PetscCall(Layout(R));
  PetscCall(StoreTriangle(R));
  if (s.start.equilibrium) PetscCall(FindEquilibrium(R));
  if (s.start.view) PetscCall(ViewStart(s, PETSC_VIEWER_STDOUT_(s.comm)));
  s.start_used = s.start;
  s.run        = std::move(run); /* not before everything is done: after an error setUp() starts anew */
  PetscFunctionReturn(0);
}

} // namespace hhtdae
