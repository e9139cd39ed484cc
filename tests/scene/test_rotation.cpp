/* Local rotation vectors: their kinematics, and an application without the scene library that uses them */
#include "hhtdae/scene.h"
#include "scene/rotation.h"
#include "support.h"

#include <random>

using namespace hhtest;
using namespace hhtdae;

namespace
{

Matrix3 exponential(const Vector3 &x)
{
  const double a = x.norm();
  return a > 0 ? Eigen::AngleAxisd(a, x / a).toRotationMatrix() : Matrix3(Matrix3::Identity());
}

/* Rotation vectors in all directions, up to where they are singular; the two formulas for Stumpff's functions meet at 1 */
std::vector<Vector3> vectors()
{
  std::vector<Vector3>             all;
  std::mt19937                     random(3);
  std::normal_distribution<double> any;
  for (double a : {0., 1e-12, 1e-4, 0.3, 0.9999999, 1.0000001, 2., 3., 5.9}) all.push_back(a * Vector3(any(random), any(random), any(random)).normalized());
  return all;
}

} // namespace

TEST(Rotation, AttitudeAndTangent)
{
  const Matrix3 C = exponential({0.3, -1, 2});
  const double  d = 1e-5;
  for (const Vector3 &x : vectors()) {
    Matrix3 A, G, up, down, unused;
    LocalFrame(x, C, A, G);
    EXPECT_LT((A - exponential(x) * C).norm(), 4e-15) << x.norm();
    EXPECT_LT((LocalTurn(x).toRotationMatrix() * C - A).norm(), 4e-15) << x.norm();
    for (int k = 0; k < 3; k++) {
      LocalFrame(x + d * Vector3::Unit(k), C, up, unused);
      LocalFrame(x - d * Vector3::Unit(k), C, down, unused);
      EXPECT_LT(((up - down) / (2 * d) - Cross<double>(Vector3(G.col(k))) * A).norm(), 1e-9) << x.norm();
    }
  }
}

TEST(Rotation, GradientOfMoments)
{
  const Vector3 m(0.4, -3, 1.5);
  const double  d = 1e-5;
  for (const Vector3 &x : vectors())
    for (int k = 0; k < 3; k++) {
      Matrix3 A, up, down;
      LocalFrame(x + d * Vector3::Unit(k), Matrix3::Identity(), A, up);
      LocalFrame(x - d * Vector3::Unit(k), Matrix3::Identity(), A, down);
      EXPECT_LT(((up - down).transpose() * m / (2 * d) - LocalMomentGradient(x, m).col(k)).norm(), 1e-9) << x.norm();
    }
}

/* ---- with PETSc's interface only ---- */

namespace
{

/* A free body with two equal moments of inertia. With L its angular momentum, fixed in space, and s its spin about the third axis,
   w = L/J1 + (1 - J3/J1) s e3, so that A = exp([L] t/J1) A0 exp([e3] (1 - J3/J1) s t). */
struct FreeBody {
  Vector3       J{2, 2, 3}, spin{1, 0.5, 4}; /* body axes, which coincide with the space axes at the start */
  double        stiffness = 0;               /* of springs that hold the third axis parallel to that of space */
  Matrix3       C = Matrix3::Identity(), before;

  Matrix3 exact(double t) const
  {
    const Vector3 L = J.asDiagonal() * spin;
    return exponential(t / J(0) * L) * exponential((1 - J(2) / J(0)) * spin(2) * t * Vector3::UnitZ());
  }
  Matrix3 attitude(Vec U) const
  {
    const Array x = whole(U);
    return exponential(Vector3(x[0], x[1], x[2])) * C;
  }

  static PetscErrorCode residual(TS, PetscReal, Vec U, Vec V, Vec W, Vec F, void *ctx)
  {
    const auto        &b = *static_cast<FreeBody *>(ctx);
    const PetscScalar *u, *v, *w;
    PetscScalar       *f;
    Matrix3            A, G;
    PetscFunctionBeginUser;
    PetscCall(VecGetArrayRead(U, &u));
    PetscCall(VecGetArrayRead(V, &v));
    PetscCall(VecGetArrayRead(W, &w));
    PetscCall(VecGetArrayWrite(F, &f));
    const Vector3 x(u[0], u[1], u[2]), rate(v[0], v[1], v[2]), alpha(w[0], w[1], w[2]);
    LocalFrame(x, b.C, A, G);
    const Matrix3 I             = A * b.J.asDiagonal() * A.transpose();
    const Vector3 moment        = b.stiffness * A.col(2).cross(Vector3::UnitZ());
    Eigen::Map<Vector3>(f, 3)   = G.transpose() * (I * alpha + rate.cross(I * rate) - moment);
    PetscCall(VecRestoreArrayWrite(F, &f));
    PetscCall(VecRestoreArrayRead(W, &w));
    PetscCall(VecRestoreArrayRead(V, &v));
    PetscCall(VecRestoreArrayRead(U, &u));
    PetscFunctionReturn(0);
  }
  static PetscErrorCode refer(TS, Vec U, void *ctx)
  {
    auto &b = *static_cast<FreeBody *>(ctx);
    PetscFunctionBeginUser;
    b.before = b.C;
    b.C      = b.attitude(U);
    PetscCall(VecZeroEntries(U));
    PetscFunctionReturn(0);
  }
  static PetscErrorCode back(TS, void *ctx)
  {
    auto &b = *static_cast<FreeBody *>(ctx);
    PetscFunctionBeginUser;
    b.C = b.before;
    PetscFunctionReturn(0);
  }
};

struct BodyRun {
  FreeBody body;
  TS       ts;
  Vec      U, V, F;
  double   largest = 0; /* largest error at the ends of steps and between them */

  explicit BodyRun(const std::string &options)
  {
    IS             is;
    const PetscInt first = 0;
    must(VecCreateSeq(PETSC_COMM_SELF, 3, &U));
    must(VecDuplicate(U, &V));
    must(VecDuplicate(U, &F));
    for (int k = 0; k < 3; k++) must(VecSetValue(V, k, body.spin(k), INSERT_VALUES));
    must(VecAssemblyBegin(V));
    must(VecAssemblyEnd(V));
    must(TSCreate(PETSC_COMM_SELF, &ts));
    must(TSSetType(ts, TSHHT3));
    must(TSSetI2Function(ts, F, FreeBody::residual, &body));
    must(TS2SetSolution(ts, U, V));
    must(ISCreateGeneral(PETSC_COMM_SELF, 1, &first, PETSC_COPY_VALUES, &is));
    must(TSHHT3SetRotations(ts, is, FreeBody::refer, FreeBody::back, &body));
    must(ISDestroy(&is));
    must(TSSetMaxTime(ts, 2));
    must(TSSetMaxSteps(ts, 1000000));
    must(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
    must(TSMonitorSet(ts, watch, this, nullptr));
    Options in(options);
    must(TSSetFromOptions(ts));
  }
  ~BodyRun()
  {
    TSDestroy(&ts);
    for (Vec *v : {&U, &V, &F}) VecDestroy(v);
  }
  BodyRun(const BodyRun &) = delete;

  static PetscErrorCode watch(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx)
  {
    auto &r = *static_cast<BodyRun *>(ctx);
    PetscFunctionBeginUser;
    widen(r.largest, (r.body.attitude(U) - r.body.exact(t)).norm());
    if (step == 0) PetscFunctionReturn(0);
    PetscReal last;
    Vec       between;
    PetscCall(VecDuplicate(U, &between));
    PetscCall(TSGetPrevTime(ts, &last));
    const PetscReal middle = last + 0.4 * (t - last);
    PetscCall(TSHHT3Interpolate(ts, middle, between, nullptr, nullptr));
    widen(r.largest, (r.body.attitude(between) - r.body.exact(middle)).norm());
    PetscCall(VecDestroy(&between));
    PetscFunctionReturn(0);
  }
  double error()
  {
    must(TSSolve(ts, nullptr));
    return largest;
  }
};

double errorOf(const std::string &options) { return BodyRun(options).error(); }

std::string constant(double h) { return "-ts_adapt_type none -ts_dt " + std::to_string(h); }

} // namespace

TEST(Rotation, SecondOrderThroughPETSc)
{
  for (const char *form : {" -ts_hhtdae_alpha -0.05 ", " -ts_hhtdae_alpha -0.3 ", " -ts_hhtdae_radius 0.5 "}) {
    const double a = errorOf(form + constant(4e-3)), b = errorOf(form + constant(2e-3)), order = std::log2(a / b);
    MEASURED("free body,%s: errors of the attitude %.2e, %.2e: order %.2f", form, a, b, order);
    EXPECT_NEAR(order, 2, 0.1) << form;
    EXPECT_LT(b, 2e-3);
    const double c = errorOf(form + tolerance(1e-6)), d = errorOf(form + tolerance(1e-9));
    MEASURED("chosen steps: %.2e at 1e-6, %.2e at 1e-9", c, d);
    EXPECT_LT(d, c / 50) << form; /* h is proportional to the cube root of the tolerance, the error to its square */
  }
  const double a = errorOf(" -ts_hhtdae_form paper " + constant(2e-3)), b = errorOf(" -ts_hhtdae_form paper " + constant(1e-3));
  EXPECT_NEAR(std::log2(a / b), 1, 0.15);
}

/* A rotor whose axis is held by springs that are far stiffer than a step resolves: its tilt decays, also with little
   damping. It would grow if the second term of Magnus' series used the accelerations at the beginning instead of the
   change of the angular velocity over the step (rotations.cpp) */
TEST(Rotation, StiffAcrossTheAxisOfSpin)
{
  for (double k : {1e2, 1e5, 1e8})
    for (const char *alpha : {"-0.3", "-0.05", "-0.01"}) {
      BodyRun r(constant(1e-2) + " -ts_hhtdae_alpha " + alpha + " -ts_max_time 2 ");
      r.body.J         = {1, 1, 1};
      r.body.spin      = {0, 0, 30};
      r.body.stiffness = k;
      r.body.C         = exponential({1e-3, 0, 0});
      must(VecZeroEntries(r.V));
      must(VecSetValue(r.V, 2, 30, INSERT_VALUES));
      must(VecAssemblyBegin(r.V));
      must(VecAssemblyEnd(r.V));
      must(TSSolve(r.ts, nullptr));
      const double tilt = r.body.attitude(r.U).col(2).head<2>().norm();
      EXPECT_LT(tilt, 2e-3) << "stiffness " << k << ", alpha " << alpha;
    }
}

/* The same above order two, where the rotation follows from backward differentiation, for stiffnesses at which
   backward differentiation is stable without a spin */
TEST(Rotation, StiffAcrossTheAxisOfSpinAboveOrderTwo)
{
  for (double spin : {0., 10., 30.})
    for (double k : {1e7, 1e8})
      for (int order : {3, 4, 5}) {
        BodyRun r(constant(1e-2) + " -ts_rtol 1e-10 -ts_atol 1e-10 -ts_hhtdae_order " + std::to_string(order) + " -ts_max_time 2 ");
        r.body.J         = {1, 1, 1};
        r.body.spin      = {0, 0, spin};
        r.body.stiffness = k;
        r.body.C         = exponential({1e-6, 0, 0});
        must(VecZeroEntries(r.V));
        must(VecSetValue(r.V, 2, spin, INSERT_VALUES));
        must(VecAssemblyBegin(r.V));
        must(VecAssemblyEnd(r.V));
        must(TSSolve(r.ts, nullptr));
        TSHHT3Statistics s;
        must(TSHHT3GetStatistics(r.ts, &s));
        const double tilt = r.body.attitude(r.U).col(2).head<2>().norm();
        EXPECT_LT(tilt, 1e-8) << "stiffness " << k << ", order " << order << ", spin " << spin;
        EXPECT_GT(s.of_order[order], 150);
        EXPECT_EQ(s.corrector_fails, 0);
      }
}

TEST(Rotation, HigherOrdersThroughPETSc)
{
  for (int order : {3, 4, 5}) {
    const std::string options = " -ts_hhtdae_order " + std::to_string(order) + " -ts_hhtdae_corrector_tolerance 1e-6 ";
    const double      a = errorOf(options + tolerance(1e-6)), b = errorOf(options + tolerance(1e-9));
    MEASURED("free body, order %d: errors of the attitude %.2e at 1e-6, %.2e at 1e-9", order, a, b);
    EXPECT_LT(b, a / 100);
    EXPECT_LT(a, 2e-3);
  }
}

TEST(Rotation, WhatIsRefused)
{
  TS  ts;
  IS  is;
  Vec U, V, F;
  FreeBody       body;
  ErrorTrap      trap;
  const PetscInt second = 1;
  must(ISCreateGeneral(PETSC_COMM_SELF, 1, &second, PETSC_COPY_VALUES, &is));
  must(VecCreateSeq(PETSC_COMM_SELF, 3, &U));
  must(VecDuplicate(U, &V));
  must(VecDuplicate(U, &F));
  must(TSCreate(PETSC_COMM_SELF, &ts));
  must(TSSetType(ts, TSHHT3));
  must(TSSetI2Function(ts, F, FreeBody::residual, &body));
  must(TS2SetSolution(ts, U, V));
  EXPECT_NE(TSHHT3SetRotations(ts, is, FreeBody::refer, nullptr, &body), 0);
  EXPECT_TRUE(trap.says("TSHHT3SetRotations() needs an index set and both functions, or none of them")) << trap.message;
  EXPECT_NE(TSHHT3SetRotations(ts, nullptr, FreeBody::refer, FreeBody::back, &body), 0);
  must(TSHHT3SetRotations(ts, is, FreeBody::refer, FreeBody::back, &body));
  EXPECT_NE(TSSetUp(ts), 0);
  EXPECT_TRUE(trap.says("rotation vector at 1, but this rank's unknowns are 0 to 2")) << trap.message;
  must(ISDestroy(&is));
  must(TSDestroy(&ts));
  for (Vec *v : {&U, &V, &F}) must(VecDestroy(v));
}

/* ---- of scenes ---- */

namespace
{

struct Thrown {
  Scene scene{PETSC_COMM_SELF};
  TS    ts = nullptr;
  explicit Thrown(const std::string &options)
  {
    RigidBody b;
    b.inertia          = Vector3(1, 2, 2.5).asDiagonal();
    b.angular_velocity = {1, -0.5, 2};
    scene.channel("x", Measure::displacement(scene.marker(scene.add("stone", b), {1, 0, 0}), 0));
    Options in(options);
    must(scene.createTS(&ts));
    must(TSSetMaxTime(ts, 0.5));
    must(TSSetTimeStep(ts, 1e-3));
    must(TSSetErrorIfStepFails(ts, PETSC_FALSE));
    must(TSSetFromOptions(ts));
  }
  ~Thrown() { TSDestroy(&ts); }
  Thrown(const Thrown &) = delete;
  std::string view() const
  {
    Printed printed;
    must(TSView(ts, PETSC_VIEWER_STDOUT_SELF));
    return printed.text();
  }
};

} // namespace

TEST(Rotation, OptionsOfScenes)
{
  double x[2];
  for (bool euler : {false, true}) {
    Thrown t(tolerance(1e-8) + (euler ? "-scene_rotations euler313" : ""));
    Array  values;
    must(t.scene.solve(t.ts));
    must(t.scene.sample(t.ts, 0.5, values));
    x[euler] = values[0];
    EXPECT_EQ(t.view().find("local rotation vectors: 1") == std::string::npos, euler) << t.view();
  }
  EXPECT_NEAR(x[0], x[1], 1e-4);
  EXPECT_NE(x[0], x[1]);
}

/* With an angle tolerance of their own, rotations determine shorter steps, or positions determine longer ones; the
   same for planar bodies */
TEST(Rotation, ToleranceOfTheirOwn)
{
  for (bool planar : {false, true}) {
    PetscInt steps[3];
    for (int k = 0; k < 3; k++) {
      Scene            scene(PETSC_COMM_SELF, planar ? Space::Planar : Space::Spatial);
      RigidBody        b;
      TS               ts;
      TSHHT3Statistics s;
      b.inertia        = Vector3(1, 2, 2.5).asDiagonal();
      const Body stone = scene.add("stone", b);
      scene.add("mount", Bushing{scene.marker(stone), scene.marker(scene.ground()), {0, 0, 0}, {500, 500, 500}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, -20}});
      Options in(tolerance(1e-4) + (k == 1 ? "-scene_angle_tol 1e-7" : k == 2 ? "-scene_angle_tol 1e-2" : ""));
      must(scene.createTS(&ts));
      must(TSSetMaxTime(ts, 2));
      must(TSSetFromOptions(ts));
      must(scene.solve(ts));
      must(TSHHT3GetStatistics(ts, &s));
      steps[k] = s.steps;
      must(TSDestroy(&ts));
    }
    MEASURED("%s: %d steps, %d with a tolerance of 1e-7, %d with one of 0.01", planar ? "planar" : "spatial", (int)steps[0], (int)steps[1], (int)steps[2]);
    EXPECT_GT(steps[1], 5 * steps[0]); /* the local error is of third order */
    EXPECT_LT(steps[2], 0.5 * steps[0]);
  }
}

/* TS types that do not renew the reference attitudes in every step require Euler angles */
TEST(Rotation, OtherTypesNeedEulerAngles)
{
  for (bool euler : {false, true}) {
    Thrown t(std::string("-ts_type alpha2 ") + (euler ? "-scene_rotations euler313" : ""));
    if (euler) {
      EXPECT_EQ(TSSolve(t.ts, nullptr), 0);
      continue;
    }
    ErrorTrap trap; /* called directly: inside of a step PETSc's type would leak its vectors */
    Vec       U, V, F;
    must(TS2GetSolution(t.ts, &U, &V));
    must(VecDuplicate(U, &F));
    EXPECT_NE(TSComputeI2Function(t.ts, 0, U, V, V, F), 0);
    must(VecDestroy(&F));
    EXPECT_TRUE(trap.says("whose local rotation vectors TS type alpha2 cannot follow: use Euler angles, -scene_rotations euler313")) << trap.message;
  }
}

/* The matrix of a step in which the spin changes by more than its initial value, against differences of the residual
   of the SNES: rotations depend on the angular velocities at both ends of the step */
TEST(Rotation, MatrixOfAStepThatChangesTheSpin)
{
  const double d = 1e-4;
  Scene        scene(PETSC_COMM_SELF);
  RigidBody    b;
  Bushing      mount;
  TS           ts;
  SNES         snes;
  Mat          P;
  Vec          X, up, down;
  double       worst = 0, largest;
  b.inertia               = Vector3(1, 2, 2.5).asDiagonal();
  b.angular_velocity      = {1, -0.5, 2};
  mount.i                 = scene.marker(scene.add("stone", b), {0.1, 0.2, 0});
  mount.j                 = scene.marker(scene.ground());
  mount.stiffness         = {4e3, 1e3, 2e3};
  mount.torsional_damping = {300, 20, 100};
  scene.add("mount", mount);
  must(scene.createTS(&ts));
  Options in("-ts_adapt_type none -ts_dt 0.05 -ts_max_steps 1 -ts_hhtdae_alpha -0.1");
  must(TSSetFromOptions(ts));
  must(scene.solve(ts));
  must(TSGetSNES(ts, &snes));
  must(SNESGetSolution(snes, &X));
  must(SNESGetJacobian(snes, nullptr, &P, nullptr, nullptr));
  must(VecDuplicate(X, &up));
  must(VecDuplicate(X, &down));
  for (PetscInt i = 3; i < 6; i++) must(VecSetValue(X, i, 200. * (double)(i - 2), ADD_VALUES)); /* another iterate */
  must(VecAssemblyBegin(X));
  must(VecAssemblyEnd(X));
  must(SNESSetLagJacobian(snes, 1));
  must(SNESComputeJacobian(snes, X, P, P));
  must(MatNorm(P, NORM_FROBENIUS, &largest));
  const auto residual = [&](PetscInt c, double by, Vec F) {
    must(VecSetValue(X, c, by, ADD_VALUES));
    must(VecAssemblyBegin(X));
    must(VecAssemblyEnd(X));
    must(SNESComputeFunction(snes, X, F));
  };
  for (PetscInt c = 0; c < 6; c++) {
    residual(c, d, up);
    residual(c, -2 * d, down);
    must(VecSetValue(X, c, d, ADD_VALUES));
    must(VecAXPY(up, -1, down));
    const Array difference = whole(up);
    for (PetscInt r = 0; r < 6; r++) {
      double entry;
      must(MatGetValue(P, r, c, &entry));
      widen(worst, std::abs(entry - difference[(std::size_t)r] / (2 * d)));
    }
  }
  MEASURED("largest difference %g of %g", worst, largest);
  EXPECT_LT(worst, 1e-6 * largest);
  must(VecDestroy(&down));
  must(VecDestroy(&up));
  must(TSDestroy(&ts));
}

/* A rotor that would make a full turn in a step, where rotation vectors are singular: the step is shortened */
TEST(Rotation, FullTurnInAStep)
{
  const double spin = 200 * PETSC_PI;
  for (const char *steps : {"-ts_adapt_type none -ts_dt 1e-2", "-ts_dt 1e-2 -ts_adapt_dt_max 1e-2 -ts_rtol 1e-2 -ts_atol 1e-2"}) {
    Scene            scene(PETSC_COMM_SELF);
    RigidBody        b;
    TS               ts;
    Array            x;
    TSHHT3Statistics s;
    b.angular_velocity = {0, 0, spin};
    const Body rotor   = scene.add("rotor", b);
    scene.add("bearing", Revolute{scene.marker(rotor), scene.marker(scene.ground())});
    for (int c = 0; c < 2; c++) scene.channel("", Measure::displacement(scene.marker(rotor, {1, 0, 0}), c));
    must(scene.createTS(&ts));
    must(TSSetMaxTime(ts, 0.1025));
    Options in(steps);
    must(TSSetFromOptions(ts));
    must(scene.solve(ts));
    must(scene.sample(ts, 0.1025, x));
    must(TSHHT3GetStatistics(ts, &s));
    MEASURED("%s: %d steps, %d failed corrections, x = %.9f, y = %.9f", steps, (int)s.steps, (int)s.corrector_fails, x[0], x[1]);
    EXPECT_NEAR(x[0], 0, 1e-6);
    EXPECT_NEAR(x[1], 1, 1e-6);
    must(TSDestroy(&ts));
  }
}

/* w = w0 + a t, as of a ball that rolls along a parabola: the axis of rotation turns while the accelerations are constant */
TEST(Rotation, AxisThatTurnsEvenly)
{
  Scene          scene(PETSC_COMM_SELF);
  RigidBody      b;
  TS             ts;
  Array          values;
  const double   end = 2;
  const Vector3  w0(2, 0, 1), a(0, 6, 0);
  Matrix3        exact = Matrix3::Identity();
  UserForce      load;
  b.angular_velocity = w0;
  b.inertia          = Matrix3::Identity();
  const Body ball    = scene.add("ball", b);
  load.i             = scene.marker(ball);
  for (int c = 0; c < 3; c++) load.moment.push_back(Expression{{}, [=](const Real *) -> Real { return a(c); }});
  scene.add("torque", load);
  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(scene.marker(ball, Vector3::Unit(k)), c));
  must(scene.createTS(&ts));
  must(TSSetMaxTime(ts, end));
  Options in(tolerance(1e-5));
  must(TSSetFromOptions(ts));
  must(scene.solve(ts));
  must(scene.sample(ts, end, values));
  const int steps = 400000; /* midpoint rule */
  for (int n = 0; n < steps; n++) exact = exponential(end / steps * (w0 + a * ((n + 0.5) * end / steps))) * exact;
  const double error = (Eigen::Map<const Matrix3>(values.data()) - exact).norm();
  PetscInt     taken;
  must(TSGetStepNumber(ts, &taken));
  MEASURED("%d steps, error of the attitude %.1e", (int)taken, error);
  EXPECT_LT(error, 1e-3);
  must(TSDestroy(&ts));
}

/* Between the ends of a step constraints are differentiated about the attitude at that time: the acceleration of the
   point that a joint holds is zero */
TEST(Rotation, SamplesWithinAStep)
{
  Scene     scene(PETSC_COMM_SELF);
  RigidBody b;
  TS        ts;
  Array     values;
  b.mass             = 15;
  b.inertia          = Vector3(0.234375, 0.46875, 0.234375).asDiagonal();
  b.center           = {0, 1, 0};
  b.angular_velocity = {0, 150, -4.61538};
  b.velocity         = b.angular_velocity.cross(b.center);
  const Marker pivot = scene.marker(scene.add("top", b));
  scene.gravity({0, 0, -9.81});
  scene.add("pivot", Spherical{pivot, scene.marker(scene.ground())});
  for (int c = 0; c < 3; c++) scene.channel("", Measure::acceleration(pivot, c));
  must(scene.createTS(&ts));
  must(TSSetMaxTime(ts, 0.02));
  Options in(constant(2e-3));
  must(TSSetFromOptions(ts));
  must(scene.solve(ts));
  must(scene.sample(ts, 0.0192, values));
  const double a = Eigen::Map<const Vector3>(values.data()).norm();
  MEASURED("acceleration of the pivot %.1e m/s^2 of %.0f", a, 150 * 4.6);
  EXPECT_LT(a, 0.1);
  must(TSDestroy(&ts));
}
