/* Attachments of flexible bodies without unknowns: their motion and matrix are compared with differences, their
   results with those of a massless part that a fixed joint holds to the attachment and whose coordinates and
   multipliers are unknowns */
#include "hhtdae/helpers.h"
#include "hhtdae/linearize.h"
#include "hhtdae/query.h"
#include "modal_cloud.h"
#include "scene_jacobian.h"
#include "scene_output.h"
#include <algorithm>

using namespace hhtest;
using namespace hhtdae;

namespace
{

const Matrix3 tilted = (Eigen::AngleAxisd(0.7, Vector3(1, 2, -1).normalized())).toRotationMatrix();

ModalCloud cloud(int modes, unsigned seed, bool stiffens)
{
  ModalCloud c(9, modes, seed, true);
  if (stiffens) c.stiffen(seed + 1);
  return c;
}

FlexibleBody flexible(const ModalCloud &c)
{
  FlexibleBody b;
  b.model   = std::make_shared<ModalBody>(c.body);
  b.damping = {{1, 0.01}, {3, 0.05}};
  return b;
}

/* Two flexible bodies and a rigid one with elements between their attachments; the test uses kinds 0 to 3 */
struct Tangle {
  Scene scene{PETSC_COMM_WORLD};

  Tangle(int kind, bool stiffens)
  {
    FlexibleBody b = flexible(cloud(4, 11, stiffens)), d = flexible(cloud(3, 21, stiffens));
    b.rotation = tilted;
    d.position = {1, 0.5, -0.3};
    d.rotation = tilted.transpose();
    const Body   one = scene.add("one", b), two = scene.add("two", d);
    const Marker a = scene.marker(scene.attachment(one, "hub"), {0.1, 0.2, -0.1}, tilted), c = scene.marker(scene.attachment(one, "tip"), {0.3, 0, 0.2});
    const Marker e = scene.marker(scene.attachment(two, "hub"), {0, 0.1, 0.1}), f = scene.marker(scene.attachment(two, "tip"));
    RigidBody    load;
    load.position = {0.2, 1, 0.4};
    const Body   part = scene.add("load", load);
    const Marker g = scene.marker(part, {0.1, 0.3, 0}), ground = scene.marker(scene.ground(), {1, 2, 3}, tilted);
    if (kind == 0) {
      const Element hinge = scene.add("hinge", Revolute{c, e});
      scene.add("ball", Spherical{g, f});
      scene.add("friction", JointFriction{hinge, 0.3, 0.2, 0.5});
      scene.add("driven", RotationalMotion{a, ground, TimeFunction::harmonic(0.4, 2)});
      scene.add("own", SpringDamper{a, c, 100, 5, 1});
      scene.add("speed", UserConstraint{{Expression{{Measure::velocity(a, 1, f, e), Measure::angularVelocity(f, 0, a), Measure::angle(a, c)},
                                                    [](const Real *m) -> Real { return m[0] * (2. + sin(m[2])) + 0.3 * m[1]; }}}});
    } else if (kind == 1) {
      for (bool state : {false, true}) {
        Bushing bush{a, state ? f : c, {30, 20, 10}, {3, 2, 4}, {5, 4, 3}, {1, 0.5, 2}};
        bush.state = state;
        scene.add(state ? "carried" : "bush", bush);
      }
      Bushing other{g, e, {30, 20, 10}, {3, 2, 4}, {5, 4, 3}, {1, 0.5, 2}};
      scene.add("to a part", other);
      scene.add("edge", KnifeEdge{f, g});
      scene.add("ball rolls", RollingSphere{e, ground, 0.7});
    } else if (kind == 2) {
      ContactLaw law;
      law.stiffness = 50;
      law.damping   = 0.2;
      law.friction  = 0.3;
      law.slip_velocity = 0.5;
      scene.add("touch", SphereSphere{a, f, 4, 4, law});
      scene.add("ground contact", SpherePlane{c, ground, 6, law, true});
      const Vector3 from = DataOf(scene).frame(e).x, to = DataOf(scene).frame(g).x;
      const Matrix3 z = hhtdae::axesAlong(to - from);
      Matrix3       along;
      along << z.col(2), z.col(0), z.col(1);
      scene.add("beam", Beam{scene.markerAt(part, to, along), scene.markerAt(scene.attachment(two, "hub"), from, along), -1, 100, 40, 1, 2, 3, 4, 0, 0, 0.1});
      scene.add("distance", PointDistance{a, g});
    } else {
      const Variable v = scene.variable("v", Expression{{Measure::acceleration(a, 0, f, e), Measure::angularAcceleration(c, 1), Measure::modal(two, 1)},
                                                        [](const Real *m) -> Real { return m[0] + 0.5 * m[1] * m[2]; }});
      const State    x = scene.state("x", Expression{{Measure::rate(c, f), Measure::acceleration(g, 2, e)}, [](const Real *m) -> Real { return m[0] - m[1]; }}, 0.1);
      const Element  pin = scene.add("pin", Universal{c, g});
      scene.add("push", UserScalarForce{a, f, Expression{{Measure::value(v), Measure::value(x), Measure::jointForce(pin, 1, e), Measure::jointMoment(pin, 0)},
                                                         [](const Real *m) -> Real { return m[0] * 0.1 + m[1] + m[2] * m[3]; }}});
      UserForce turn;
      turn.i     = e;
      turn.j     = c;
      turn.frame = a;
      for (int k = 0; k < 3; k++)
        turn.moment.push_back(Expression{{Measure::angularVelocity(e, k, c, a), Measure::modal(one, k), Measure::velocity(f, k)},
                                         [](const Real *m) -> Real { return m[0] * 2. - m[1] * m[2]; }});
      scene.add("turn", turn);
    }
    scene.start().assembly  = Assembly::Off;
    scene.start().redundant = Redundant::Keep;
    must(scene.setUp());
  }
};

} // namespace

TEST(Attachments, JacobianAgainstDifferences)
{
  for (int kind = 0; kind < 4; kind++)
    for (bool stiffens : {false, true}) {
      Tangle t(kind, stiffens);
      for (Rotations rotations : all_rotations) {
        AnyState s(t.scene, 7 + kind, 0.3, rotations);
        EXPECT_LT(s.jacobianError(2.7, 13., rotations == Rotations::Local ? .2 : 0), 1e-5) << "kind " << kind << ", stiffening " << stiffens;
        EXPECT_LT(s.jacobianError(0, 0), 1e-5) << "kind " << kind << ", stiffening " << stiffens;
      }
    }
}

/* Velocities and accelerations of an attachment frame are the time derivatives of its pose along a motion of the unknowns */
TEST(Attachments, MotionAgainstDifferences)
{
  for (bool stiffens : {false, true}) {
    Scene        scene(PETSC_COMM_WORLD);
    FlexibleBody b   = flexible(cloud(5, 3, stiffens));
    b.rotation       = tilted;
    const Body frame = scene.attachment(scene.add("body", b), "tip");
    must(scene.setUp());
    AnyState       s(scene, 4, 0.5, Rotations::Euler313);
    Bodies        &B = s.R.bodies;
    const PetscInt i = s.R.local_body[frame.id];
    const Array    q = whole(s.U), v = whole(s.V), a = whole(s.A);
    ASSERT_EQ(q.size(), 11u) << "the frame has no unknowns";
    const auto at = [&](double t) {
      Array u = q, w = v;
      for (std::size_t k = 0; k < q.size(); k++) {
        u[k] += t * v[k] + t * t / 2 * a[k];
        w[k] += t * a[k];
      }
      B.move(u.data(), w.data());
      return B.now[i];
    };
    const double     d    = 1e-5;
    const BodyMotion up   = at(d), down = at(-d), now = at(0);
    const Matrix3    turn = (up.A - down.A) / (2 * d) * now.A.transpose();
    EXPECT_LT(((up.r - down.r) / (2 * d) - now.v).norm(), 1e-8 * (1 + now.v.norm()));
    EXPECT_LT((turn - Cross<double>(now.w)).norm(), 1e-8 * (1 + now.w.norm()));
    EXPECT_LT(((up.v - down.v) / (2 * d) - B.acceleration(i, v.data(), a.data())).norm(), 1e-7 * (1 + now.v.squaredNorm()));
    EXPECT_LT(((up.w - down.w) / (2 * d) - B.angularAcceleration(i, v.data(), a.data())).norm(), 1e-7 * (1 + now.w.squaredNorm()));
    EXPECT_LT((now.A.transpose() * now.A - Matrix3::Identity()).norm(), 1e-14);
  }
}

namespace
{

enum class Tip { Attachment, Part };

/* A flexible body suspended at one attachment from a ball joint; at the other attachment there are a spring and
   damper, a bushing and a rigid body on a hinge with a motor */
struct Rig {
  Scene                scene{PETSC_COMM_SELF};
  Body                 body, frame;
  Marker               tip, end;
  Element              clamp;
  std::vector<Element> loads;

  explicit Rig(Tip kind, bool stiffens = true, bool driven = true, bool damped = true)
  {
    scene.gravity({0.3, 1, -9.81});
    FlexibleBody b = flexible(cloud(5, 11, stiffens));
    b.rotation     = tilted;
    if (!damped) b.damping.clear();
    body             = scene.add("arm", b);
    const Body   hub = scene.attachment(body, "hub");
    frame            = scene.attachment(body, "tip");
    const Marker i   = scene.marker(hub, {0.1, 0, 0});
    scene.add("ball", Spherical{i, scene.marker(scene.ground(), DataOf(scene).frame(i).x)});
    tip           = scene.marker(frame);
    const auto at = DataOf(scene).frame(tip);
    Body       on = frame;
    if (kind == Tip::Part) {
      RigidBody part;
      part.mass = 0;
      part.inertia.setZero();
      part.position = at.x;
      part.rotation = at.R;
      on            = scene.add("part", part);
      clamp         = scene.add("clamp", Fixed{tip, scene.marker(on)});
    }
    end = scene.marker(on, {0.05, 0.1, 0});
    const Marker there = scene.marker(on, {0, -0.1, 0.1});
    loads.push_back(scene.add("spring", SpringDamper{end, scene.marker(scene.ground(), Vector3(at.x + Vector3(1, 1, 1))), 100, damped ? 5. : 0., 1}));
    loads.push_back(scene.add("bush", Bushing{there, scene.marker(scene.ground(), DataOf(scene).frame(there).x, at.R), {60, 50, 40}, {6, 5, 4},
                                              (damped ? 1. : 0.) * Vector3(1, 2, 1), (damped ? 1. : 0.) * Vector3(0.3, 0.2, 0.1)}));
    RigidBody load;
    load.mass     = 0.5;
    load.inertia  = Vector3(0.02, 0.03, 0.04).asDiagonal();
    load.position = at.x + at.R * Vector3(0.05, 0.4, 0);
    load.rotation = at.R;
    const Marker j = scene.marker(scene.add("load", load), {0, -0.3, 0});
    loads.push_back(scene.add("hinge", Revolute{end, j}));
    if (driven) loads.push_back(scene.add("motor", RotationalMotion{end, j, TimeFunction::harmonic(0.5, 3, -M_PI / 2, 0.5)}));
  }

  /* runs with fixed steps */
  PetscInt run(double h, double until, Motion *m, Load *reaction = nullptr, double *energy = nullptr)
  {
    char steps[128];
    std::snprintf(steps, sizeof steps, "-ts_adapt_type none -ts_dt %g -ts_hhtdae_corrector_tolerance 1e-4 ", h);
    SceneRun r(scene, until, tolerance(1e-9) + steps);
    Snapshot now;
    Vec      U;
    PetscInt n;
    double   kinetic, potential;
    if (energy) {
      must(now.take(r.ts));
      must(now.energy(&kinetic, &potential));
      *energy = -kinetic - potential;
    }
    must(r.solve());
    must(TSGetSolution(r.ts, &U));
    must(VecGetSize(U, &n));
    must(now.take(r.ts));
    must(now.motion(end, m));
    if (energy) {
      must(now.energy(&kinetic, &potential));
      *energy += kinetic + potential;
    }
    if (!reaction) return n;
    if (clamp.id >= 0) must(now.load(clamp, tip, reaction));
    for (Element e : loads) {
      Load one;
      must(now.load(e, clamp.id >= 0 ? end : tip, &one));
      if (clamp.id >= 0) continue;
      reaction->force += one.force;
      reaction->moment += one.moment;
    }
    if (clamp.id < 0) tie(now, *reaction);
    return n;
  }

private:
  /* the fixed joint between attachment and part transmits the reaction */
  void tie(Snapshot &now, const Load &reaction)
  {
    const auto &all = DataOf(scene).elements;
    for (std::size_t e = 0; e < all.size(); e++) {
      if (std::string(all[e].type) != "attachment" || DataOf(scene).markers[all[e].j.id].body != frame.id) continue;
      const Element it{(PetscInt)e};
      Load          on;
      double        x;
      must(now.load(it, tip, &on));
      EXPECT_LT((on.force + reaction.force).norm(), 1e-10 * reaction.force.norm());
      EXPECT_LT((on.moment + reaction.moment).norm(), 1e-10 * reaction.force.norm());
      for (int c = 0; c < 3; c++) {
        must(now.value(Measure::multiplier(it, c), &x));
        EXPECT_NEAR(x, reaction.force(c), 1e-10 * reaction.force.norm());
        must(now.value(Measure::elementForce(it, tip, c), &x));
        EXPECT_NEAR(x, -reaction.force(c), 1e-10 * reaction.force.norm());
      }
      return;
    }
    ADD_FAILURE() << "no element of the attachment";
  }
};

} // namespace

/* The motion is the same as with a fixed part, and the reaction between part and attachment is the sum of the forces
   of elements on the attachment. The velocities of the part satisfy its joint to second order in the step size, those
   of the attachment exactly: the difference vanishes with the integrator's error */
TEST(Attachments, AsAPartThatIsFixedToIt)
{
  for (bool stiffens : {false, true}) {
    double position[2], velocity[2];
    for (int fine = 0; fine < 2; fine++) {
      Motion   m[2];
      Load     reaction[2];
      PetscInt n[2];
      for (int k = 0; k < 2; k++) n[k] = Rig(k ? Tip::Part : Tip::Attachment, stiffens).run(fine ? 5e-4 : 1e-3, 0.4, &m[k], &reaction[k]);
      EXPECT_EQ(n[0], 6 + 5 + 3 + 6 + 5 + 1) << "body, modes, ball joint, load, hinge, motor";
      EXPECT_EQ(n[1], n[0] + 12);
      position[fine] = (m[0].position - m[1].position).norm();
      velocity[fine] = (m[0].velocity - m[1].velocity).norm() + (m[0].angular_velocity - m[1].angular_velocity).norm();
      EXPECT_LT((m[0].acceleration - m[1].acceleration).norm(), 1e-3 * (1 + m[1].acceleration.norm()));
      EXPECT_LT((m[0].angular_acceleration - m[1].angular_acceleration).norm(), 1e-3 * (1 + m[1].angular_acceleration.norm()));
      EXPECT_GT(reaction[1].force.norm(), 1);
      EXPECT_LT((reaction[0].force - reaction[1].force).norm(), 1e-4 * reaction[1].force.norm());
      EXPECT_LT((reaction[0].moment - reaction[1].moment).norm(), 1e-4 * reaction[1].force.norm());
    }
    std::printf("[ MEASURED ] differences with steps of 1 and 0.5 ms: positions %.1e, %.1e, velocities %.1e, %.1e\n", position[0], position[1], velocity[0], velocity[1]);
    EXPECT_LT(position[1], 1e-7);
    EXPECT_LT(velocity[1], 1e-5);
    EXPECT_GT(std::log2(position[0] / position[1]), 1.7);
    EXPECT_GT(std::log2(velocity[0] / velocity[1]), 1.7);
  }
}

TEST(Attachments, SecondOrder)
{
  Motion exact, m;
  double error[2];
  Rig(Tip::Attachment).run(2e-3 / 16, 0.3, &exact);
  for (int k = 0; k < 2; k++) {
    Rig(Tip::Attachment).run(4e-3 / (1 << k), 0.3, &m);
    error[k] = (m.position - exact.position).norm();
  }
  EXPECT_GT(error[1], 1e-9);
  EXPECT_GT(std::log2(error[0] / error[1]), 1.8);
  EXPECT_LT(std::log2(error[0] / error[1]), 2.4);
}

/* With springs, gravity and joints only, the loss of energy is the integrator's error */
TEST(Attachments, EnergyStays)
{
  double lost[2];
  Motion m;
  for (int k = 0; k < 2; k++) Rig(Tip::Attachment, true, false, false).run(2e-3 / (1 << k), 0.4, &m, nullptr, &lost[k]);
  std::printf("[ MEASURED ] energy lost with steps of 2 and 1 ms: %.1e, %.1e\n", lost[0], lost[1]);
  EXPECT_LT(std::abs(lost[0]), 1e-2 * m.velocity.squaredNorm());
  EXPECT_LT(std::abs(lost[1]), 0.35 * std::abs(lost[0]));
}

/* Linearization with loads and elements on an attachment: the modal coordinates alone and the variant with a part give
   the same small motions */
TEST(Attachments, LinearizedAsAPart)
{
  std::vector<Mode> modes[2];
  StateSpace                       s[2];
  BodyPart                         part[2];
  for (int k = 0; k < 2; k++) {
    Rig rig(k ? Tip::Part : Tip::Attachment, true, false);
    rig.scene.start().equilibrium = true;
    SceneRun      run(rig.scene, 1, tolerance(1e-6));
    Linearization about;
    Excitation    push;
    push.at     = rig.end;
    push.load   = {1, 2, -1};
    push.moment = {0.1, 0, 0.3};
    must(about.take(run.ts));
    must(about.modes(&modes[k]));
    must(about.stateSpace({push}, {Measure::displacement(rig.end, 1), Measure::acceleration(rig.end, 0)}, &s[k]));
    must(about.part(modes[k][0], rig.frame, &part[k]));
    const double size = std::abs(part[k].displacement(0)); /* the component of largest size may belong to another unknown */
    part[k].displacement /= part[k].displacement(0);
    EXPECT_GT(size, 1e-6);
  }
  ASSERT_EQ(modes[0].size(), modes[1].size());
  for (std::size_t k = 0; k < modes[0].size(); k++) EXPECT_LT(std::abs(modes[0][k].value - modes[1][k].value), 1e-6 * std::abs(modes[1][k].value)) << "mode " << k;
  EXPECT_LT((part[0].displacement - part[1].displacement).norm(), 1e-5);
  ASSERT_EQ(s[0].D.size(), 2u);
  EXPECT_GT(std::abs(s[1].D[1]), 1e-3);
  EXPECT_NEAR(s[0].D[1], s[1].D[1], 1e-6 * std::abs(s[1].D[1]));
}

/* A run resumed from a checkpoint has the same bits; a run continued with a new description finds its accelerations again */
TEST(Attachments, RunsGoOn)
{
  const TemporaryFile file("attachments.checkpoint");
  const std::string   options = tolerance(1e-6) + " -ts_adapt_type none -ts_dt 1e-3 ";
  const auto          end     = [&](double until, const std::string &more, bool again) {
    Rig rig(Tip::Attachment);
    Vec U;
    TS  next;
    rig.scene.channel("x", Measure::displacement(rig.end, 0));
    SceneRun run(rig.scene, until, options + more);
    must(run.solve());
    if (again) {
      Options in(options);
      must(rig.scene.createTS(&next, run.ts));
      must(TSSetMaxTime(next, 0.3));
      must(TSSetFromOptions(next));
      must(rig.scene.solve(next));
      must(TSGetSolution(next, &U));
      const Array u = whole(U);
      must(TSDestroy(&next));
      return u;
    }
    must(TSGetSolution(run.ts, &U));
    return whole(U);
  };
  const Array straight = end(0.3, "", false), on = end(0.2, "", true);
  end(0.3, "-ts_hhtdae_checkpoint " + file.name + " -ts_hhtdae_checkpoint_every 50 -ts_max_steps 120 ", false);
  const Array resumed = end(0.3, "-ts_hhtdae_resume " + file.name + " ", false);
  EXPECT_EQ(straight, resumed);
  ASSERT_EQ(straight.size(), on.size());
  for (std::size_t k = 0; k < 3; k++) EXPECT_NEAR(straight[k], on[k], 1e-5) << k;
  for (std::size_t k = 6; k < 11; k++) EXPECT_NEAR(straight[k], on[k], 1e-4) << "mode " << k - 5;
}

/* The reaction of an attachment is not an unknown and cannot be an argument of equations; it is for output only */
TEST(Attachments, ReactionIsForOutputAlone)
{
  Scene      scene(PETSC_COMM_WORLD);
  const Body body = scene.add("arm", flexible(cloud(3, 5, false)));
  scene.attachment(body, "hub");
  scene.variable("v", Expression{Measure::multiplier(Element{0}, 1)});
  ErrorTrap trap;
  EXPECT_NE(scene.setUp(), 0);
  EXPECT_TRUE(trap.says("for output alone")) << trap.message;
}
