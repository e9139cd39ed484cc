/* Kept nodes of flexible bodies as places for markers, load cases scaled by functions, acceleration of the ground:
   Jacobians against differences; motions and loads against the particles that form the body */
#include "hhtdae/query.h"
#include "modal_cloud.h"
#include "scene/model.h"
#include "scene_jacobian.h"
#include "scene_output.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

const Matrix3 tilted = (Eigen::AngleAxisd(0.7, Vector3(1, 2, -1).normalized())).toRotationMatrix();

ModalCloud withNodes(int modes, unsigned seed)
{
  ModalCloud c(9, modes, seed);
  c.keepNodes(seed + 1);
  return c;
}

FlexibleBody flexible(const ModalCloud &c)
{
  FlexibleBody b;
  b.model   = std::make_shared<ModalBody>(c.body);
  b.damping = {{1, 0.01}, {3, 0.05}};
  return b;
}

std::string refused(const std::function<void(Scene &, Body)> &describe)
{
  Scene      scene(PETSC_COMM_SELF);
  const Body body = scene.add("cloud", flexible(withNodes(3, 5)));
  describe(scene, body);
  ErrorTrap trap;
  EXPECT_NE(scene.setUp(), 0);
  return trap.message;
}

Expression constant(double x) { return Expression(TimeFunction(x)); }

} // namespace

TEST(NodesAndLoads, JacobianAgainstDifferences)
{
  for (int kind = 0; kind < 4; kind++) {
    Scene        scene(PETSC_COMM_WORLD);
    FlexibleBody b = flexible(withNodes(4, 11)), d = flexible(withNodes(3, 21));
    b.rotation = tilted;
    d.position = {1, 0.5, -0.3};
    const Body   one = scene.add("one", b), two = scene.add("two", d);
    const Marker turning = scene.marker(scene.node(one, 13), {0.1, 0.2, -0.1}, tilted), plain = scene.marker(scene.node(one, 16)), other = scene.marker(scene.node(two, 10));
    const Marker far = scene.marker(scene.node(two, 19), {0, 0.1, 0}), hub = scene.marker(scene.attachment(two, "hub"));
    const auto   law = [&](std::vector<Measure> a) {
      return Expression{std::move(a), [](const Real *m) -> Real { return m[0] * sin(m[1]) + 0.4 * m[2]; }};
    };
    if (kind == 0) {
      scene.add("hinge", Revolute{turning, far});
      scene.add("ball", Spherical{plain, other});
      scene.add("bush", Bushing{turning, hub, {30, 20, 10}, {3, 2, 4}, {5, 4, 3}, {1, 0.5, 2}});
      scene.add("spring", SpringDamper{plain, hub, 100, 5, 1});
    } else {
      ModalLoad load{kind == 3 ? two : one, kind == 1 ? "dead" : "follows", law({Measure::displacement(far, 0, turning), Measure::velocity(plain, 1, other, turning), Measure::time()})};
      load.state = kind == 2;
      if (kind == 3) load.scale.arguments[2] = Measure::acceleration(plain, 2);
      scene.add("load", load);
      scene.add("time alone", ModalLoad{one, "follows", TimeFunction::harmonic(2, 3, 0.5, 1)});
    }
    scene.start().assembly  = Assembly::Off;
    scene.start().redundant = Redundant::Keep;
    must(scene.setUp());
    for (Rotations rotations : all_rotations) {
      AnyState s(scene, 7 + kind, 0.3, rotations);
      EXPECT_LT(s.jacobianError(2.7, 13., rotations == Rotations::Local ? .2 : 0), 1e-5) << "kind " << kind;
      EXPECT_LT(s.jacobianError(0, 0), 1e-5) << "kind " << kind;
    }
  }
}

/* The load case of forces on all particles gives the same residual as separate forces on the particles, in any state */
TEST(NodesAndLoads, ALoadCaseIsItsForces)
{
  Array F[2];
  for (int kind = 0; kind < 2; kind++) {
    const ModalCloud c = withNodes(4, 3);
    Scene            scene(PETSC_COMM_WORLD);
    FlexibleBody     b = flexible(c);
    b.rotation         = tilted;
    const Body body    = scene.add("body", b);
    for (std::size_t p = 0; p < c.X.size(); p++) { /* nodes without rotation have the axes of the body */
      UserForce f;
      f.i     = scene.marker(scene.node(body, 10 + 3 * (PetscInt)p));
      f.frame = scene.marker(scene.node(body, 10));
      for (int k = 0; k < 3; k++) f.force.push_back(constant(kind ? 0 : 1.7 * ModalCloud::deadForce(p)(k)));
      scene.add(text("force %d", (int)p), f);
    }
    if (kind) scene.add("all", ModalLoad{body, "dead", constant(1.7)});
    must(scene.setUp());
    AnyState s(scene, 8, 0.4);
    F[kind] = s.residual();
  }
  for (std::size_t i = 0; i < F[0].size(); i++) EXPECT_NEAR(F[0][i], F[1][i], 1e-11 * (1 + std::abs(F[0][i])));
}

/* A marker at a node has the position of the particle */
TEST(NodesAndLoads, MarkersFollowTheirParticles)
{
  const ModalCloud c = withNodes(4, 3);
  Scene            scene(PETSC_COMM_SELF);
  FlexibleBody     b = flexible(c);
  b.rotation         = tilted;
  b.position         = {1, 2, 3};
  b.deformation      = Eigen::Vector4d(0.1, -0.2, 0.05, 0.3);
  const Body body    = scene.add("body", b);
  std::vector<Marker> at;
  for (std::size_t p = 0; p < c.X.size(); p++) at.push_back(scene.marker(scene.node(body, 10 + 3 * (PetscInt)p)));
  must(scene.setUp());
  for (std::size_t p = 0; p < c.X.size(); p++) EXPECT_LT((DataOf(scene).frame(at[p]).x - c.place(p, b.position, tilted, b.deformation)).norm(), 1e-13);
  AnyState s(scene, 8, 0.4);
  const Array u = whole(s.U), v = whole(s.V);
  s.R.bodies.move(u.data(), v.data());
  ASSERT_EQ(u.size(), 10u) << "the frames have no unknowns";
  const BodyMotion     &frame = s.R.bodies.now[s.R.local_body[body.id]];
  const Eigen::Vector4d eta(&u[6]);
  for (PetscInt i = 0; i < (PetscInt)s.R.bodies.body.size(); i++) {
    const LocalBody &k = s.R.bodies.body[i];
    if (k.kind == BodyKind::Attached) {
      EXPECT_LT((s.R.bodies.now[i].r - c.place((std::size_t)DataOf(scene).bodies[k.id].attachment - 2, frame.r, frame.A, eta)).norm(), 1e-13);
    }
  }
}

TEST(NodesAndLoads, RefusedByName)
{
  const auto says = [](const std::string &message, const std::string &part) { EXPECT_NE(message.find(part), std::string::npos) << message; };
  says(refused([](Scene &s, Body b) { s.node(b, 12); }), "flexible body cloud: its model has not kept node 12, but 9 others");
  says(refused([](Scene &s, Body) { s.node(s.ground(), 10); }), "node 10: its body is not a flexible one of this scene");
  says(refused([](Scene &s, Body b) { s.marker(s.node(b, 10), {0.1, 0, 0}); }), "a marker on cloud.node 10, a node whose neighbours tell no rotation must be at its position");
  says(refused([](Scene &s, Body b) { s.add("pin", Revolute{s.marker(s.node(b, 10)), s.marker(s.ground())}); }), "marker i is on cloud.node 10, a node whose neighbours tell no rotation");
  says(refused([](Scene &s, Body b) { s.add("bush", Bushing{s.marker(s.node(b, 10)), s.marker(s.ground()), {1, 1, 1}, {1, 1, 1}}); }), "cloud.node 10, a node whose neighbours tell no rotation");
  says(refused([](Scene &s, Body b) {
         UserForce f;
         f.i = s.marker(s.node(b, 10));
         for (int k = 0; k < 3; k++) f.moment.push_back(constant(1));
         s.add("turn", f);
       }),
       "cloud.node 10, a node whose neighbours tell no rotation");
  says(refused([](Scene &s, Body b) { s.channel("w", Measure::angularVelocity(s.marker(s.node(b, 10)), 0)); }), "cloud.node 10, a node whose neighbours tell no rotation");
  says(refused([](Scene &s, Body b) { s.add("wind", ModalLoad{b, "wind", constant(1)}); }), "modal load wind: cloud has no load case wind, but dead, follows");
  says(refused([](Scene &s, Body b) { s.add("wind", ModalLoad{s.node(b, 10), "dead", constant(1)}); }), "modal load wind: its body is not a flexible one of this scene");
  says(refused([](Scene &s, Body b) { s.add("wind", ModalLoad{b, "dead", {}}); }), "modal load wind, component 0: its function is empty");
  ModalCloud c = withNodes(3, 5);
  Scene      scene(PETSC_COMM_SELF);
  c.body.loads[1].modal_gradient.resize(2, 2);
  scene.add("cloud", flexible(c));
  ErrorTrap trap;
  EXPECT_NE(scene.setUp(), 0);
  says(trap.message, "nodes or loads with another number of modes");
}

/* Loads and components of load cases are read like those of any other force; the scale may change in the next run */
TEST(NodesAndLoads, QueriesAndParameters)
{
  const ModalCloud c = withNodes(4, 3);
  Scene            scene(PETSC_COMM_SELF);
  const Parameter  scale = scene.parameter("scale", 2);
  FlexibleBody     b     = flexible(c);
  b.rotation             = tilted;
  const Body    body     = scene.add("body", b);
  const Element load     = scene.add("load", [=] { return ModalLoad{body, "dead", TimeFunction(scale)}; });
  scene.channel("scale", Measure::force(load, 0));
  for (double x : {2., -3.}) {
    TS    ts;
    Array y;
    must(scene.set("scale", x));
    must(scene.createTS(&ts));
    must(TSSetMaxTime(ts, 1e-3));
    must(scene.solve(ts));
    must(scene.sample(ts, 1e-3, y));
    EXPECT_DOUBLE_EQ(y[0], x);
    must(TSDestroy(&ts));
  }
}

/* Loads and contacts of a flexible body that a parameter removes, with a marker that was made after them */
TEST(NodesAndLoads, ThatMayBeMissing)
{
  Scene           scene(PETSC_COMM_SELF);
  const Parameter on    = scene.parameter("on", 1);
  const Body      body  = scene.add("body", flexible(withNodes(4, 3)));
  const Marker    floor = scene.marker(scene.ground(), {0, 0, -50});
  scene.add("load", [=] { return on > 0 ? std::optional<ModalLoad>(ModalLoad{body, "dead", TimeFunction(2)}) : std::nullopt; });
  scene.add("contact", [=] {
    NodeContact c;
    c.body = body;
    c.j    = floor;
    c.law  = {1e3};
    return on > 0 ? std::optional<NodeContact>(c) : std::nullopt;
  });
  const Body    weight = scene.add("weight", RigidBody());
  const Channel z      = scene.channel("z", Measure::displacement(scene.marker(weight, {0, 0, 0.5}), 2));
  for (double x : {1., 0., 1.}) {
    TS    ts;
    Array y;
    must(scene.set("on", x));
    must(scene.createTS(&ts));
    must(TSSetMaxTime(ts, 1e-3));
    must(scene.solve(ts));
    must(scene.sample(ts, 1e-3, y));
    EXPECT_DOUBLE_EQ(y[z.id], 0.5);
    must(TSDestroy(&ts));
  }
}

TEST(NodesAndLoads, ABodyWithoutMass)
{
  for (const bool mass : {true, false}) {
    Scene      scene(PETSC_COMM_SELF);
    ModalCloud c = withNodes(3, 5);
    if (mass) c.body.mass = 0;
    else c.body.moments.setZero();
    scene.add("cloud", flexible(c));
    ErrorTrap trap;
    EXPECT_NE(scene.setUp(), 0);
    EXPECT_TRUE(trap.says("flexible body cloud: its ModalBody has a mass of")) << trap.message;
  }
}

namespace
{

/* A flexible body with a rigid body on a hinge, fixed either to a base whose motion has the given acceleration, or to
   ground that accelerates */
Array shaken(bool ground)
{
  Scene        scene(PETSC_COMM_SELF);
  FlexibleBody b = flexible(withNodes(4, 3));
  scene.gravity({0, 0.5, -9.81});
  const double w = 7, a[3] = {0.3, -0.2, 0.1};
  const auto   of = [&](int c) { return ground ? TimeFunction::harmonic(-a[c] * w * w, w) : TimeFunction(0); };
  if (ground) scene.groundAcceleration(of(0), of(1), of(2));
  RigidBody weight, base;
  b.velocity           = ground ? Vector3(0, 0, 0) : Vector3(w * Vector3(a[0], a[1], a[2]));
  base.velocity        = b.velocity;
  const Body   beam    = scene.add("beam", b);
  const Marker foot    = scene.marker(scene.attachment(beam, "hub")), tip = scene.marker(scene.node(beam, 13));
  const auto   at      = DataOf(scene).frame(foot);
  weight.position      = DataOf(scene).frame(tip).x + Vector3(0.3, 0, 0.1);
  weight.velocity      = b.velocity;
  weight.mass          = 0.3;
  weight.inertia      *= 0.02;
  const Body   hanging = scene.add("weight", weight);
  scene.add("hinge", Revolute{scene.marker(hanging, {-0.3, 0, -0.1}), tip});
  Marker on = scene.markerAt(scene.ground(), at.x, at.R);
  if (!ground) {
    base.position       = at.x;
    const Marker middle = scene.marker(scene.add("base", base));
    const Marker zero   = scene.markerAt(scene.ground(), at.x);
    scene.add("orientation", Orientation{middle, zero});
    for (int c = 0; c < 3; c++) scene.add(text("drive %d", c), TranslationalMotion{middle, zero, TimeFunction::harmonic(a[c], w), MotionOf::Displacement, c});
    on = middle;
  }
  scene.add("foot", Fixed{foot, on});
  for (int k = 0; k < 4; k++) scene.channel(text("eta%d", k), Measure::modal(beam, k));
  for (int c = 0; c < 3; c++) scene.channel(text("x%d", c), Measure::displacement(scene.marker(hanging), c, on));
  scene.start().tolerance = 1e-3; /* the axes of the deformed attachment differ by this much */
  SceneRun run(scene, 0.8, tolerance(1e-10) + " -ts_hhtdae_corrector_tolerance 1e-8 ");
  Array    x;
  must(run.solve());
  must(scene.sample(run.ts, 0.8, x));
  return x;
}

} // namespace

TEST(NodesAndLoads, GroundAccelerationIsAMovingBase)
{
  const Array moving = shaken(false), still = shaken(true);
  double      most = 0, off = 0;
  for (std::size_t i = 0; i < moving.size(); i++) {
    widen(most, std::abs(still[i]));
    widen(off, std::abs(still[i] - moving[i]));
  }
  MEASURED("of %g, off by %.2e", most, off);
  EXPECT_GT(most, 0.1);
  EXPECT_LT(off, 3e-6); /* 2e-5 with a hundredfold tolerance */
}

namespace
{

/* No node has a rotation, so that a frame at a node rotates with the body, like the ball of a contact */
FlexibleBody plainNodes(int modes, unsigned seed)
{
  ModalCloud c = withNodes(modes, seed);
  for (ModalNode &n : c.body.nodes) {
    n.turns = false;
    n.rotation.setZero();
  }
  return flexible(c);
}

enum class Other { Ground, Part, Attachment };

/* Nodes of a flexible body against a plane or a sphere, described as one element or node by node; the caller adds the
   loads of the single element */
void describeTouching(Scene &scene, Other other, bool sphere, bool single)
{
  FlexibleBody b = plainNodes(4, 11), d = plainNodes(3, 21);
  b.rotation     = tilted;
  const Body one = scene.add("one", b), two = scene.add("two", d);
  Marker     j   = scene.markerAt(scene.ground(), {0.2, -0.1, 0.1}, tilted);
  if (other == Other::Part) j = scene.marker(scene.add("part", RigidBody()), {0.2, -0.1, 0.1}, tilted);
  if (other == Other::Attachment) j = scene.marker(scene.attachment(two, "tip"), {0.2, 0.1, 0.3}, tilted.transpose());
  ContactLaw law;
  law.stiffness     = 50;
  law.damping       = 0.2;
  law.friction      = 0.3;
  law.slip_velocity = 0.5;
  const double radius = 0.4, radius_j = sphere ? 1 : 0;
  if (!single) {
    scene.add("touch", NodeContact{one, {}, radius, j, radius_j, law});
  } else {
    for (const ModalNode &n : b.model->nodes) {
      const Marker i = scene.marker(scene.node(one, n.label));
      if (sphere) scene.add(text("touch %d", (int)n.label), SphereSphere{i, j, radius, radius_j, law});
      else scene.add(text("touch %d", (int)n.label), SpherePlane{i, j, radius, law});
    }
  }
  scene.start().assembly = Assembly::Off;
  must(scene.setUp());
}

} // namespace

TEST(NodeContact, IsOneContactForEachNode)
{
  for (Other other : {Other::Ground, Other::Part, Other::Attachment})
    for (bool sphere : {false, true}) {
      Array  F[2];
      double energy[2];
      for (int single = 0; single < 2; single++) {
        Scene scene(PETSC_COMM_WORLD);
        describeTouching(scene, other, sphere, single);
        AnyState s(scene, 5, 0.3);
        F[single]      = s.residual();
        energy[single] = 0;
        const Array u = whole(s.U), v = whole(s.V), a = whole(s.A);
        Evaluation  ev{0, u.data(), v.data(), a.data(), s.R.bodies, s.R.n};
        for (const auto &batch : s.R.batches) energy[single] += batch->energy(ev);
      }
      ASSERT_EQ(F[0].size(), F[1].size());
      for (std::size_t i = 0; i < F[0].size(); i++) EXPECT_NEAR(F[0][i], F[1][i], 1e-10 * (1 + std::abs(F[1][i])));
      EXPECT_GT(energy[1], 0);
      EXPECT_NEAR(energy[0], energy[1], 1e-12 * energy[1]);
    }
}

TEST(NodeContact, JacobianAgainstDifferences)
{
  for (Other other : {Other::Ground, Other::Part, Other::Attachment})
    for (bool sphere : {false, true}) {
      Scene scene(PETSC_COMM_WORLD);
      describeTouching(scene, other, sphere, false);
      for (Rotations rotations : all_rotations) {
        AnyState s(scene, 5, 0.3, rotations);
        EXPECT_LT(s.jacobianError(2.7, 13., rotations == Rotations::Local ? .2 : 0), 1e-5) << (int)other << sphere;
        EXPECT_LT(s.jacobianError(0, 0), 1e-5) << (int)other << sphere;
      }
    }
}

TEST(NodeContact, RefusedByName)
{
  const auto says = [](const std::string &message, const std::string &part) { EXPECT_NE(message.find(part), std::string::npos) << message; };
  const auto touch = [](const std::function<void(NodeContact &, Scene &)> &change) {
    return refused([&](Scene &s, Body b) {
      NodeContact c;
      c.body = b;
      c.j    = s.marker(s.ground());
      change(c, s);
      s.add("touch", c);
    });
  };
  says(touch([](NodeContact &c, Scene &) { c.nodes = {10, 11}; }), "node contact touch: cloud has not kept node 11; keep it when the body is reduced");
  says(touch([](NodeContact &c, Scene &) { c.radius = -1; }), "node contact touch: radius is -1, must be finite and not negative");
  says(touch([](NodeContact &c, Scene &) { c.radius_j = 1; }), "node contact touch: radius is 0, must be finite and positive");
  says(touch([](NodeContact &c, Scene &) { c.radius_j = -1; }), "radius_j is -1, must be finite and positive");
  says(touch([](NodeContact &c, Scene &s) { c.j = s.marker(s.node(c.body, 13)); }), "marker j is on the same flexible body cloud");
  says(touch([](NodeContact &c, Scene &s) { c.body = s.add("part", RigidBody()); }), "node contact touch: its body is not a flexible one of this scene");
  says(touch([](NodeContact &c, Scene &) { c.law.stiffness = 0; }), "node contact touch: stiffness is 0");
}

/* A bounce without damping or friction conserves energy, and its resultant is read like the load of any other element */
TEST(NodeContact, ABounceKeepsEnergy)
{
  double drift[2], impulse = 0;
  for (int k = 0; k < 2; k++) {
    Scene         scene(PETSC_COMM_SELF);
    FlexibleBody  b = flexible(withNodes(4, 11));
    TemporaryFile file(text("bounce%d.csv", k));
    ContactLaw    law;
    b.position         = {0, 0, 3};
    b.velocity         = {0, 0, -2};
    b.angular_velocity = {0.3, 0.1, 0.2};
    b.damping.clear();
    law.stiffness       = 500;
    const Body    body  = scene.add("body", b);
    const Element touch = scene.add("touch", NodeContact{body, {}, 0.1, scene.marker(scene.ground()), 0, law});
    scene.channel("force", Measure::force(touch, 2));
    scene.output().balance      = true;
    scene.output().balance_file = file.name;
    SceneRun run(scene, 3, text(" -ts_dt %g -ts_adapt_type none -ts_max_steps 100000 -ts_hhtdae_alpha 0 ", 2e-3 / (1 << k)));
    must(run.solve());
    const CSV   table(file.text());
    const Array energy = table.column("total"), pz = table.column("pz");
    drift[k] = 0;
    for (double e : energy) widen(drift[k], std::abs(e - energy[0]) / energy[0]);
    impulse = pz.back() - pz.front();
  }
  MEASURED("drift of energy %.2e, %.2e; impulse %.3f", drift[0], drift[1], impulse);
  EXPECT_GT(impulse, 10); /* the body has come back */
  EXPECT_LT(drift[1], 2e-3);
  EXPECT_LT(drift[1], 0.35 * drift[0]);
}
