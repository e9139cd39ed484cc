/* The calls by which a user describes a scene, and its set-up. */
#include "extension.h"
#include "guard.h"
#include "journal.h"
#include "start.h"
#include <cctype>
#include <cmath>
#include <sstream>

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

SceneData::SceneData()  = default;
SceneData::~SceneData() = default;

Scene::Scene(MPI_Comm comm, Space space) : number_(NextNumber()), model_(std::make_shared<Model>()), journal_(std::make_unique<Journal>())
{
  data().number = number_;
  data().comm   = comm;
  data().planar = space == Space::Planar;
}

Scene::~Scene() = default;

SceneData &Scene::data() const { return model_->scene; }

Body Scene::add(const std::string &name, const RigidBody &b)
{
  if (recording()) record([=](Scene &s) { s.add(name, b); });
  return addRigid(name, b);
}

Body Scene::addRigid(const std::string &name, const RigidBody &b)
{
  BodyData d;
  d.name        = name.empty() ? "body " + std::to_string(data().bodies.size()) : name;
  data().refuseLate("body " + d.name);
  d.mass        = b.mass;
  d.inertia     = b.inertia;
  d.center      = b.center;
  d.A           = b.rotation;
  d.r           = b.position + b.rotation * b.center;
  d.v           = b.velocity;
  d.w           = b.angular_velocity;
  d.fixed_start = b.fixed_start;
  data().bodies.push_back(d);
  return Body{(PetscInt)data().bodies.size() - 1, number_};
}

Body Scene::add(const std::string &name, const PointMass &b)
{
  if (recording()) record([=](Scene &s) { s.add(name, b); });
  RigidBody r;
  r.mass        = b.mass;
  r.position    = b.position;
  r.velocity    = b.velocity;
  r.fixed_start = b.fixed_start;
  const Body body = addRigid(name, r);
  data().bodies[body.id].point = true;
  return body;
}

/* What is wrong with a marker's position and axes, as text; empty if nothing */
static std::string FaultOfPlace(const Vector3 &position, const Matrix3 &axes)
{
  constexpr double tolerance = 1e-8; /* allowed rounding of axes that were computed, or written with eight digits */
  const auto       list      = [](const Vector3 &x) { return "(" + Show(x(0)) + ", " + Show(x(1)) + ", " + Show(x(2)) + ")"; };
  if (!position.allFinite()) return "its position is " + list(position) + ", must be finite";
  if (!axes.allFinite()) return "its axes are not finite";
  const Matrix3 products = axes.transpose() * axes;
  if ((products - Matrix3::Identity()).norm() > tolerance)
    return "its axes are not orthonormal: the columns' lengths are " + list(products.diagonal().cwiseSqrt()) + ", their scalar products " +
           list({products(0, 1), products(1, 2), products(2, 0)}) + ", which must be 1 and 0";
  return axes.determinant() < 0 ? "its axes are left-handed: turn one of them round" : "";
}

Marker Scene::marker(Body body, const Vector3 &position, const Matrix3 &axes, const std::string &name)
{
  if (recording()) record([=](Scene &s) { s.marker(body, position, axes, name); });
  SceneData     &s    = data();
  const PetscInt id   = (PetscInt)s.markers.size();
  const bool     good = body.id == -1 || s.valid(body);
  const std::string who = "marker " + (name.empty() ? std::to_string(id) : name);
  if (!good) s.errors.push_back(who + ": its body is not one of this scene");
  else if (body.id >= 0 && s.bodies[body.id].flexible)
    s.errors.push_back(who + ": a flexible body is held at its attachments and kept nodes; use scene.attachment(" + s.bodies[body.id].name +
                       ", ...) or scene.node(...) as the marker's body");
  const std::string fault = FaultOfPlace(position, axes);
  if (!fault.empty()) s.errors.push_back(who + (good ? " on " + s.bodyName(body.id) : "") + ": " + fault);
  MarkerData m{good ? body.id : -2, position, axes};
  if (good && body.id >= 0) {
    m.s -= s.bodies[body.id].center;
    if (s.turnless(body.id) && m.s.norm() > 0) s.errors.push_back(who + ": a marker on " + s.turnlessName(body.id) + " must be at its position");
  }
  s.markers.push_back(m);
  if (!name.empty()) s.marker_names[id] = name;
  return Marker{id, number_};
}

Marker Scene::markerAt(Body body, const Vector3 &position, const Matrix3 &axes, const std::string &name)
{
  if (recording()) record([=](Scene &s) { s.markerAt(body, position, axes, name); });
  const Nested nested(*this);
  if (!data().valid(body)) return marker(body, position, axes, name);
  const BodyData &b = data().bodies[body.id];
  return marker(body, b.A.transpose() * (position - b.r) + b.center, b.A.transpose() * axes, name);
}

Variable Scene::variable(const std::string &name, const Expression &definition, double initial)
{
  if (recording()) record([=](Scene &s) { s.variable(name, definition, initial); });
  data().refuseLate("variable " + name);
  data().variables.push_back({name.empty() ? "variable " + std::to_string(data().variables.size()) : name, definition, initial});
  return Variable{(PetscInt)data().variables.size() - 1, number_};
}

State Scene::state(const std::string &name, const Expression &rate, double initial)
{
  if (recording()) record([=](Scene &s) { s.state(name, rate, initial); });
  data().refuseLate("state " + name);
  data().states.push_back({name.empty() ? "state " + std::to_string(data().states.size()) : name, rate, initial});
  return State{(PetscInt)data().states.size() - 1, number_};
}

void Scene::gravity(const Vector3 &acceleration)
{
  if (recording()) record([=](Scene &s) { s.gravity(acceleration); });
  data().refuseLate("gravity");
  if (data().fixed) return;
  if (!acceleration.allFinite()) data().errors.push_back("gravity must be finite");
  data().gravity = acceleration;
}

void Scene::groundAcceleration(const TimeFunction &x, const TimeFunction &y, const TimeFunction &z)
{
  if (recording()) record([=](Scene &s) { s.groundAcceleration(x, y, z); });
  data().refuseLate("the ground's acceleration");
  if (data().fixed) return;
  for (const TimeFunction *f : {&x, &y, &z})
    if (!f->error().empty()) data().errors.push_back("the ground's acceleration: " + f->error());
  data().ground_acceleration = {x, y, z};
}

Vector3 SceneData::gravityAt(double t) const
{
  Vector3 g = gravity;
  for (std::size_t c = 0; c < ground_acceleration.size(); c++) g((int)c) -= ground_acceleration[c](t).f;
  return g;
}

PetscInt SceneData::loadedBody(const ElementData &e, PetscInt body, PetscInt *elsewhere) const
{
  const PetscInt carrier = body >= 0 ? bodies[body].carrier : -1;
  PetscInt       loaded = -2, other = -1;
  for (const Part &p : e.parts)
    for (int k = 0; k < p.store->markers(); k++) {
      if (!p.store->loads(k)) continue;
      const PetscInt b = markers[p.store->marker(p.index, k)].body;
      if (b == body) loaded = body;
      else if (carrier >= 0 && b == carrier && loaded == -2) loaded = carrier;
      else if (carrier >= 0 && b >= 0 && bodies[b].carrier == carrier) other = b;
    }
  if (elsewhere) *elsewhere = loaded == -2 ? other : -1;
  return loaded;
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
    : data_(DataOf(scene))
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

bool ElementBuilder::coincident(Marker i, Marker j) const
{
  constexpr double rounding = 1e-13;
  double           size     = 0;
  for (Marker m : {i, j}) {
    const MarkerData &k = data_.markers[m.id];
    size += k.s.norm() + (k.body < 0 ? 0 : data_.bodies[k.body].r.norm());
  }
  return (frame(i).x - frame(j).x).norm() <= rounding * size;
}

Element Scene::absent(const std::string &name)
{
  ElementData e;
  e.name = name.empty() ? "absent " + std::to_string(data().elements.size()) : name;
  e.type = "absent";
  data().refuseLate("element " + e.name);
  data().elements.push_back(e);
  return Element{(PetscInt)data().elements.size() - 1, number_};
}

Element ElementBuilder::done()
{
  data_.elements.push_back(std::move(element_));
  return Element{(PetscInt)data_.elements.size() - 1, data_.number};
}

/* ---- set-up ---- */

/* Removes results of a previous set-up that has failed */
static void BeginAnew(SceneData &s)
{
  for (StoreBase *store : s.order)
    for (PetscInt e = 0; e < store->size(); e++) store->setActive(e, 0xff);
  for (BodyData &b : s.bodies)
    if (!b.massless) b.light_mass = b.light_inertia = 0;
  s.started = StartResult();
}

/* Concatenates the options of the linear solvers of assembly and equilibrium */
static PetscErrorCode SolverOptions(std::string &given)
{
  char *all;
  PetscFunctionBegin;
  given.clear();
  PetscCall(PetscOptionsGetAll(nullptr, &all));
  std::istringstream words(all);
  PetscCall(PetscFree(all));
  bool ours = false; /* whether the last option name has one of our prefixes; values follow their names */
  for (std::string word; words >> word;) {
    if (word[0] == '-' && !(word.size() > 1 && (std::isdigit(word[1]) || word[1] == '.'))) ours = word.rfind("-scene_assemble_", 0) == 0 || word.rfind("-scene_equilibrium_", 0) == 0;
    if (ours) given += word + " ";
  }
  PetscFunctionReturn(0);
}

/* Whether the present model was set up with another start(), or with other options of the set-up. The options are always
   queried, so that PETSc counts them as used. */
static PetscErrorCode StartHasChanged(const SceneData &s, const StartPolicy &given, const std::string &solvers, bool *changed)
{
  SceneData   now;
  std::string solvers_now;
  PetscFunctionBegin;
  now.comm  = s.comm;
  now.start = given;
  PetscCall(ReadStartOptions(now));
  PetscCall(SolverOptions(solvers_now));
  *changed = !SameStart(now.start, s.start) || solvers_now != solvers;
  PetscFunctionReturn(0);
}

/* The set-up evaluates users' constraints, which may throw */
PetscErrorCode Scene::setUp()
{
  PetscFunctionBegin;
  PetscCall(Guarded([&]() -> PetscErrorCode {
    PetscFunctionBegin;
    if (model_->compiled && !journal_->stale && data().errors.empty()) PetscCall(StartHasChanged(data(), start_, journal_->solvers, &journal_->stale));
    describeAnew();
    Model     &M = *model_;
    SceneData &s = M.scene;
    PetscCallMPI(MPI_Comm_rank(s.comm, &M.rank));
    PetscCallMPI(MPI_Comm_size(s.comm, &M.size));
    if (!M.compiled) s.start = start_;
    if (M.size > 1) PetscCall(CompareDescriptions(s, M.size));
    if (M.compiled) PetscFunctionReturn(0);
    BeginAnew(s);
    PetscCall(TSHHT3Initialize());
    PetscCall(DeclareSceneOptions());
    PetscCall(ReadStartOptions(s));
    PetscCall(SolverOptions(journal_->solvers));
    PetscCall(CheckDescription(s));
    if (M.continues) s.start.time = M.begin;
    else PetscCall(Partition(s, M.size, M.number.owner));
    FillLight(s);
    M.described.clear();
    M.start_memories.clear();
    for (const BodyData &b : s.bodies) M.described.push_back(b.A);
    PetscCall(Assemble(M));
    PetscCall(DropRedundant(M));
    PetscCall(CheckInertia(s));
    PetscCall(Number(M));
    if (s.start.equilibrium && !M.continues) PetscCall(FindEquilibrium(model_));
    if (s.start.view) PetscCall(ViewStart(s, PETSC_VIEWER_STDOUT_(s.comm)));
    s.markers_then = s.markers.size();
    s.fixed = M.compiled = true; /* set at the end only, so that setUp() begins again after an error */
    PetscFunctionReturn(0);
  }));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
