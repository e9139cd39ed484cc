/* A flexible body in a scene: its equations against sums over particles, its Jacobian against differences, refused input */
#include "hhtdae/query.h"
#include "hhtdae/scene.h"
#include "modal_cloud.h"
#include "scene_jacobian.h"
#include "scene_output.h"
#include "scene/attach.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

const Matrix3 tilted = (Eigen::AngleAxisd(0.7, Vector3(1, 2, -1).normalized())).toRotationMatrix();

FlexibleBody flexible(const ModalCloud &c, ModalMass mass = ModalMass::Full)
{
  FlexibleBody b;
  b.model            = std::make_shared<ModalBody>(c.body);
  b.mass             = mass;
  b.position         = {0.3, -0.2, 0.5};
  b.rotation         = tilted;
  b.velocity         = {0.1, 0.4, -0.3};
  b.angular_velocity = {1, -2, 0.7};
  b.damping          = {{1, 0.01}, {3, 0.1}};
  return b;
}

/* A flexible arm attached to the ground at one end by a ball joint; a spring and a rigid body at the other end */
struct Arm {
  Scene scene{PETSC_COMM_WORLD};
  Body  body;
  explicit Arm(const FlexibleBody &b)
  {
    scene.gravity({0.3, 1, -9.81});
    body              = scene.add("arm", b);
    const Body   hub  = scene.attachment(body, "hub"), tip = scene.attachment(body, "tip");
    const Marker i    = scene.marker(hub, {0.1, 0, 0});
    const auto   at   = DataOf(scene).frame(i);
    const Marker free = scene.marker(tip);
    const auto   end  = DataOf(scene).frame(free);
    scene.add("ball", Spherical{i, scene.marker(scene.ground(), at.x)});
    scene.add("spring", SpringDamper{free, scene.marker(scene.ground(), Vector3(end.x + Vector3(1, 1, 1))), 100, 5, 1});
    RigidBody load;
    load.position = end.x;
    load.rotation = end.R;
    scene.add("hinge", Revolute{free, scene.marker(scene.add("load", load))});
    scene.start().assembly = Assembly::Off;
    must(scene.setUp());
  }
};

/* Sum over the particles of m (x'' - g) . dx/dq, by differences along the motion and with respect to q */
double particles(const ModalCloud &c, AnyState &s, const Matrix3 &C, PetscInt first, PetscInt k, const Vector3 &g)
{
  const int    m = (int)c.shape.cols();
  const double d = 1e-4;
  const Array  q = whole(s.U), v = whole(s.V), a = whole(s.A);
  const auto   turned = [](const Vector3 &x) -> Matrix3 { return x.norm() > 0 ? Eigen::AngleAxisd(x.norm(), x.normalized()).toRotationMatrix() : Matrix3(Matrix3::Identity()); };
  const auto   place = [&](std::size_t p, double t, double by) {
    Array x(6 + m), along(6 + m);
    for (int i = 0; i < 6 + m; i++) {
      along[i] = t * v[first + i] + 0.5 * t * t * a[first + i];
      x[i]     = q[first + i] + along[i];
    }
    Matrix3 A;
    if (s.R.bodies.local) { /* x is a rotation vector with the angular velocity v */
      Vector3 turn(q[first + 3], q[first + 4], q[first + 5]);
      if (k >= 3 && k < 6) turn(k - 3) += by;
      A = turned(Vector3(along[3], along[4], along[5])) * turned(turn);
      if (k < 3 || k >= 6) x[k] += by;
    } else {
      x[k] += by;
      EulerAxes e;
      EulerFrame(x.data() + 3, A, e);
    }
    return c.place(p, Vector3(x[0], x[1], x[2]), A * C, Eigen::Map<const Eigen::VectorXd>(x.data() + 6, m));
  };
  double sum = 0;
  for (std::size_t p = 0; p < c.mass.size(); p++) {
    const Vector3 acceleration = (place(p, d, 0) - 2 * place(p, 0, 0) + place(p, -d, 0)) / (d * d);
    const Vector3 direction    = (place(p, 0, d) - place(p, 0, -d)) / (2 * d);
    sum += c.mass[p] * direction.dot(acceleration - g);
  }
  return sum;
}

} // namespace

/* A free body with all mass terms: every row of its equations is the sum over the particles */
TEST(FlexibleScene, EquationsAreSumsOverParticles)
{
  for (bool free : {true, false})
    for (Rotations rotations : all_rotations) {
    const ModalCloud c(7, 4, 3, free);
    Scene            scene(PETSC_COMM_WORLD);
    const Vector3    g(0.3, 1, -9.81);
    scene.gravity(g);
    scene.add("cloud", flexible(c));
    must(scene.setUp());
    AnyState     s(scene, 5, 0.4, rotations);
    const Array  f = s.residual(), q = whole(s.U), v = whole(s.V);
    const Matrix3 C = s.R.bodies.body[0].C;
    ASSERT_EQ((PetscInt)f.size(), 10);
    for (PetscInt k = 0; k < 10; k++) {
      double elastic = 0;
      if (k >= 6) {
        const double w = c.body.omega(k - 6), zeta = w / (2 * M_PI) <= 1 ? 0.01 : 0.1;
        elastic = w * w * q[k] + 2 * zeta * w * v[k];
      }
      EXPECT_NEAR(f[k] - elastic, particles(c, s, C, 0, k, g), 2e-5 * (1 + std::abs(f[k]))) << "row " << k << (free ? "" : ", modes with rigid content");
    }
  }
}

TEST(FlexibleScene, JacobianAgainstDifferences)
{
  for (int k = 0; k < 6; k++) {
    const ModalMass mass = (ModalMass)(k % 3);
    ModalCloud      c(9, 5, 11, true);
    if (k > 2) c.stiffen(3);
    Arm              arm(flexible(c, mass));
    for (unsigned seed : {1, 2, 3})
      for (Rotations rotations : all_rotations) {
        AnyState s(arm.scene, seed, 0.3, rotations);
        EXPECT_LT(s.jacobianError(2.7, 13., rotations == Rotations::Local ? .2 : 0), 1e-5) << "mass matrix " << (int)mass;
        EXPECT_LT(s.jacobianError(0, 0), 1e-5);
      }
  }
}

/* A variable and a force that depend on modal coordinates and on an attachment */
TEST(FlexibleScene, ExpressionsOfModalCoordinates)
{
  const ModalCloud c(9, 5, 11, true);
  Scene            scene(PETSC_COMM_WORLD);
  const Body       body = scene.add("arm", flexible(c));
  const Marker     tip = scene.marker(scene.attachment(body, "tip"), {0.1, 0.2, 0});
  const Expression f{{Measure::modal(body, 2), Measure::modal(body, 4), Measure::velocity(tip, 1)},
                     [](const Real *m) -> Real { return m[0] * m[1] * 3. + sin(m[0]) + m[2] * m[2]; }};
  const Variable   v = scene.variable("v", f);
  scene.add("pull", UserScalarForce{tip, scene.marker(scene.ground(), {5, 5, 5}), Expression{{Measure::value(v), Measure::modal(body, 0)}, [](const Real *m) -> Real {
                                      return m[0] * 2. - m[1];
                                    }}});
  must(scene.setUp());
  AnyState s(scene, 4, 0.3);
  EXPECT_LT(s.jacobianError(2.7, 13.), 1e-5);
  Scene other(PETSC_COMM_WORLD);
  other.channel("eta", Measure::modal(other.add("arm", flexible(c)), 5));
  ErrorTrap trap;
  EXPECT_NE(other.setUp(), 0);
  EXPECT_TRUE(trap.says("modes 0 to 4")) << trap.message;
}

/* Suspended at one attachment in static equilibrium: the modal coordinates follow from the weight and the modal stiffness */
TEST(FlexibleScene, StaticEquilibrium)
{
  const ModalCloud c(9, 5, 11, true);
  FlexibleBody     b = flexible(c);
  b.velocity.setZero();
  b.angular_velocity.setZero();
  Scene        scene(PETSC_COMM_WORLD);
  const Body   body = scene.add("arm", b);
  const Marker hub  = scene.marker(scene.attachment(body, "hub"));
  const auto   at   = DataOf(scene).frame(hub);
  const Vector3 g(0.3, 1, -4);
  scene.gravity(g);
  scene.add("clamp", Fixed{hub, scene.marker(scene.ground(), at.x, at.R)});
  scene.start().equilibrium = true;
  must(scene.setUp());
  AnyState s(scene, 1, 0);
  must(VecSet(s.A, 0));
  must(VecSet(s.V, 0));
  /* the clamp's force -m g and moment, that of the weight about the clamp, do work on the modes at the attachment */
  const BodyData        &d = DataOf(scene).bodies[body.id];
  const ModalAttachment &a = c.body.attachments[0];
  const Eigen::Map<const Eigen::VectorXd> eta(d.flexible->deformation.data(), 5);
  const SmallTurn turn(a.rotation * eta);
  const Vector3   force = -c.body.mass * (d.A.transpose() * g), arm = a.position + a.translation * eta;
  const Vector3   moment = -arm.cross(force);
  const Eigen::VectorXd load = a.translation.transpose() * force + a.rotation.transpose() * (turn.J().transpose() * moment);
  const Eigen::VectorXd expected = load.cwiseQuotient(c.body.omega.cwiseAbs2());
  EXPECT_GT(expected.norm(), 0.01);
  EXPECT_LT((eta - expected).norm(), 1e-8 * expected.norm());
}

/* The partial mass matrix omits the terms quadratic in the modal coordinates; for a body at rest it is exact to first
   order in the deformation */
TEST(FlexibleScene, PartialMassIsFirstOrder)
{
  ModalCloud c(9, 3, 4, true);
  double     difference[2];
  for (int k = 0; k < 2; k++) {
    Array f[2];
    for (int full = 0; full < 2; full++) {
      FlexibleBody b = flexible(c, full ? ModalMass::Full : ModalMass::Partial);
      b.deformation  = Eigen::Vector3d(0.1, -0.2, 0.15) * (k ? 0.5 : 1);
      Scene scene(PETSC_COMM_WORLD);
      scene.add("cloud", b);
      must(scene.setUp());
      AnyState s(scene, 8, 0);
      must(VecSet(s.A, 0));
      f[full] = s.residual();
    }
    difference[k] = std::max(std::abs(f[0][3] - f[1][3]), std::max(std::abs(f[0][4] - f[1][4]), std::abs(f[0][5] - f[1][5])));
  }
  EXPECT_GT(difference[0], 0);
  EXPECT_LT(difference[1], 0.6 * difference[0]);
}

TEST(FlexibleScene, TurnAndItsDifferential)
{
  for (double size : {1e-9, 0.03, 0.099, 0.101, 1.2}) {
    const Vector3   phi = size * Vector3(1, -2, 0.5).normalized(), n(0.3, 1, -2), d(0.2, 0.5, 1);
    const SmallTurn t(phi);
    const Matrix3   R = Eigen::AngleAxisd(size, phi.normalized()).toRotationMatrix();
    EXPECT_LT((t.rotation() - R).norm(), 1e-14);
    const double  h    = 1e-5;
    const Matrix3 turn = (SmallTurn(phi + h * d).rotation() - SmallTurn(phi - h * d).rotation()) / (2 * h) * R.transpose();
    EXPECT_LT((Cross<double>(t.J() * d) - turn).norm(), 1e-9);
    const Vector3 change = (SmallTurn(phi + h * d).J().transpose() * n - SmallTurn(phi - h * d).J().transpose() * n) / (2 * h);
    EXPECT_LT((t.momentGradient(n) * d - change).norm(), 1e-9);
  }
}

/* Attachment frames start with the positions and velocities of the deformed body */
TEST(FlexibleScene, AttachmentsStartOnTheDeformedBody)
{
  const ModalCloud c(9, 5, 11, true);
  FlexibleBody     b = flexible(c);
  b.deformation      = Eigen::VectorXd::LinSpaced(5, -0.2, 0.3);
  b.deformation_rate = Eigen::VectorXd::LinSpaced(5, 1, -2);
  Scene scene(PETSC_COMM_WORLD);
  scene.attachment(scene.add("arm", b), "tip");
  must(scene.setUp()); /* the assembly would refuse markers that do not coincide */
  EXPECT_LT(DataOf(scene).started.misfit, 1e-12);
  EXPECT_EQ(DataOf(scene).started.degreesOfFreedom(), 11);
  const Vector3 x = b.position + tilted * (c.X[1] + c.shape.middleRows<3>(3) * b.deformation);
  EXPECT_LT((DataOf(scene).bodies[1].r - x).norm(), 1e-12);
}

/* A closed loop that is redundant for a rigid body is not redundant for a flexible one; rows are dropped only without modes */
TEST(FlexibleScene, ModesFreeLoopsOfRedundancy)
{
  for (int modes : {8, 0}) {
    const ModalCloud c(9, modes, 11, true);
    Scene            scene(PETSC_COMM_WORLD);
    const Body       body = scene.add("frame", flexible(c));
    for (const char *name : {"hub", "tip"}) {
      const Marker m = scene.marker(scene.attachment(body, name));
      const auto   f = DataOf(scene).frame(m);
      scene.add(std::string("fixed ") + name, Fixed{m, scene.marker(scene.ground(), f.x, f.R)});
    }
    DataOf(scene).bodies[body.id].v.setZero();
    scene.start().assembly = Assembly::Off;
    must(scene.setUp());
    EXPECT_EQ(DataOf(scene).started.redundant, modes ? 0 : 6);
  }
}

/* Attachments and elements added after the run was made are not part of it: questions about them are refused, although
   their handles belong to this scene */
TEST(FlexibleScene, LateAttachmentsAndElementsAreRefused)
{
  const ModalCloud c(9, 3, 11, false);
  Scene            scene(PETSC_COMM_SELF);
  const Body       body = scene.add("arm", flexible(c)), hub = scene.attachment(body, "hub");
  const Marker     early = scene.marker(hub);
  SceneRun         run(scene, 0.01, "");
  Snapshot         now;
  Motion           x;
  Load             l;
  double           y;
  must(now.take(run.ts));
  must(now.motion(scene.marker(hub, {0.1, 0, 0}), &x)); /* markers may be added at any time */
  const Body    tip  = scene.attachment(body, "tip");
  const Marker  late = scene.marker(tip);
  const Element e    = scene.add("spring", SpringDamper{late, scene.marker(scene.ground()), 1});
  const Variable v   = scene.variable("v", Expression{{Measure::displacement(early, 0)}, [](const Real *m) { return m[0]; }});
  ErrorTrap     trap;
  const auto    refused = [&](PetscErrorCode code, const char *why) {
    EXPECT_NE(code, 0) << why;
    EXPECT_TRUE(trap.says(why)) << trap.message;
  };
  refused(now.motion(late, &x), "body arm.tip came too late");
  refused(now.motion(tip, &x), "body arm.tip came too late");
  refused(now.relativeMotion(early, late, &x), "body arm.tip came too late");
  refused(now.value(Measure::angle(early, late), &y), "body arm.tip came too late");
  refused(now.value(Measure::displacement(late, 0), &y), "body arm.tip came too late");
  refused(now.load(e, early, &l), "element spring came too late");
  refused(now.value(Measure::force(e, 0), &y), "element spring came too late");
  refused(now.value(Measure::value(v), &y), "the variable came too late");
}

TEST(FlexibleScene, RefusesByName)
{
  const ModalCloud c(9, 3, 11, false);
  const auto       refused = [&](const std::function<void(FlexibleBody &, Scene &)> &spoil, const char *why) {
    Scene        scene(PETSC_COMM_WORLD);
    FlexibleBody b = flexible(c);
    spoil(b, scene);
    scene.add("arm", b);
    ErrorTrap trap;
    EXPECT_NE(scene.setUp(), 0);
    EXPECT_NE(trap.message.find(why), std::string::npos) << trap.message;
  };
  refused([](FlexibleBody &b, Scene &) { b.model.reset(); }, "no model");
  refused([](FlexibleBody &b, Scene &) { b.mass = ModalMass::Constant; }, "constant mass matrix");
  refused([](FlexibleBody &b, Scene &) { b.deformation.setZero(7); }, "deformation of 7");
  refused([](FlexibleBody &b, Scene &) { b.damping = {{1, -0.1}}; }, "damping ratio");
  refused([](FlexibleBody &b, Scene &) { b.damping = {{3, 0.1}, {1, 0.2}}; }, "bands of damping end at 3 and then at 1");
  refused([](FlexibleBody &b, Scene &) { b.damping = {{NAN, 0.1}}; }, "bands of damping end at nan");
  refused([](FlexibleBody &b, Scene &) { b.ratios.setConstant(b.model->modes(), INFINITY); }, "damping ratio");
  refused([](FlexibleBody &b, Scene &) { b.deformation.setConstant(b.model->modes(), NAN); }, "deformation at the start is not finite");
  refused([](FlexibleBody &b, Scene &) { b.deformation_rate.setConstant(b.model->modes(), INFINITY); }, "deformation at the start is not finite");
  refused([](FlexibleBody &b, Scene &) {
    auto m = std::make_shared<ModalBody>(*b.model);
    m->omega(1) = 0;
    b.model = m;
  }, "rigid-body modes");
  refused([&](FlexibleBody &b, Scene &s) { s.attachment(s.add("other", b), "knee"); }, "but hub, tip");
  refused([&](FlexibleBody &b, Scene &s) { s.marker(s.add("other", b)); }, "use scene.attachment");
}
