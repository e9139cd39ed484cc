/*
  Bodies on a ball joint, compared with an implementation of the generalized-alpha method on the rotation group that shares no code with the
  library: unknowns are the attitude and the angular velocity about the joint, without constraints (Bruels, Cardona, Arnold, Mech. Mach. Theory
  48, 2012), in space axes or body axes. The implementation is first checked with closed forms; references are extrapolated in long double.
*/
#include "../../examples/problems/extrapolation.h"
#include "../../examples/scene_watch.h"
#include "scene_output.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

Matrix3 skew(const Vector3 &x) { return (Matrix3() << 0, -x(2), x(1), x(2), 0, -x(0), -x(1), x(0), 0).finished(); }
Matrix3 turn(const Vector3 &x)
{
  const double a = x.norm();
  return a > 0 ? Eigen::AngleAxisd(a, x / a).toRotationMatrix() : Matrix3(Matrix3::Identity());
}

/* J W' + W x J W = c x R^T weight */
struct Top {
  Vector3 J, c, weight, spin; /* J: about the joint; c: centre of mass; weight: in space axes; spin: W at the start, where R = 1 */
  Vector3 rate(const Matrix3 &R, const Vector3 &W) const
  {
    const Vector3 moment = c.cross(R.transpose() * weight) - W.cross(J.asDiagonal() * W);
    return moment.cwiseQuotient(J);
  }
};

/* HHT: (1 - af) W'_{n+1} + af W'_n = a_{n+1}, af = -alpha; W in space axes or in body axes */
struct LieGroup {
  const Top &top;
  double     h, af, beta, gamma;
  bool       space;
  Matrix3    R = Matrix3::Identity();
  Vector3    W, dW, a;

  LieGroup(const Top &t, double step, double alpha, bool in_space)
      : top(t), h(step), af(-alpha), beta((1 - alpha) * (1 - alpha) / 4), gamma(0.5 - alpha), space(in_space), W(t.spin), dW(rateOf(R, W))
  {
    a = dW - af * h * (rateOf(turned(1e-6 * W), W + 1e-6 * dW) - dW) / 1e-6; /* a is W' at a time af h earlier */
  }
  Vector3 rateOf(const Matrix3 &A, const Vector3 &w) const { return space ? Vector3(A * top.rate(A, A.transpose() * w)) : top.rate(A, w); }
  Matrix3 turned(const Vector3 &x) const { return space ? Matrix3(turn(x) * R) : Matrix3(R * turn(x)); }
  Vector3 inBody() const { return space ? Vector3(R.transpose() * W) : W; }
  /* residual of the equation of motion with a_{n+1} = x */
  Vector3 residual(const Vector3 &x, Matrix3 &next, Vector3 &rate, Vector3 &acceleration) const
  {
    next         = turned(h * W + h * h * ((0.5 - beta) * a + beta * x));
    rate         = W + h * ((1 - gamma) * a + gamma * x);
    acceleration = (x - af * dW) / (1 - af);
    return acceleration - rateOf(next, rate);
  }
  void step()
  {
    Vector3 x = a, rate, acceleration;
    Matrix3 next;
    for (int it = 0; it < 20; it++) {
      const Vector3 r = residual(x, next, rate, acceleration);
      Matrix3       D;
      for (int k = 0; k < 3; k++) {
        const double d = 1e-5 * (1 + x.norm());
        D.col(k)       = (residual(x + d * Vector3::Unit(k), next, rate, acceleration) - r) / d;
      }
      const Vector3 dx = D.inverse() * r;
      x -= dx;
      if (dx.norm() < 1e-12 * (1 + x.norm())) break;
    }
    residual(x, next, rate, acceleration);
    R  = next;
    W  = rate;
    dW = acceleration;
    a  = x;
  }
};

/* Extrapolated solution: R by rows, then W */
class Exact
{
public:
  explicit Exact(const Top &t, double unit)
      : top_(t), solution_([this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L, unit,
                           {1, 0, 0, 0, 1, 0, 0, 0, 1, t.spin(0), t.spin(1), t.spin(2)})
  {
  }
  Exact(const Exact &) = delete;
  Matrix3 attitude(double t)
  {
    const auto y = solution_.at(t);
    Matrix3    R;
    for (int k = 0; k < 9; k++) R(k / 3, k % 3) = (double)y[k];
    return R;
  }

private:
  Top                  top_;
  hhtex::Extrapolation solution_;

  void rates(const long double *y, long double *f) const
  {
    const long double *W = y + 9;
    long double        weight[3];
    for (int i = 0; i < 3; i++) {
      weight[i] = y[i] * top_.weight(0) + y[3 + i] * top_.weight(1) + y[6 + i] * top_.weight(2);
      for (int k = 0; k < 3; k++) f[3 * i + k] = y[3 * i + (k + 1) % 3] * W[(k + 2) % 3] - y[3 * i + (k + 2) % 3] * W[(k + 1) % 3];
    }
    for (int k = 0; k < 3; k++) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      f[9 + k]    = (top_.c(i) * weight[j] - top_.c(j) * weight[i] + (top_.J(i) - top_.J(j)) * W[i] * W[j]) / top_.J(k);
    }
  }
};

/* sn, cn, dn of the parameter m by the arithmetic-geometric mean */
void jacobiElliptic(double u, double m, double *sn, double *cn, double *dn)
{
  double a[12] = {1}, c[12] = {std::sqrt(m)}, b = std::sqrt(1 - m);
  int    n     = 0;
  for (; c[n] > 1e-16 && n < 11; n++) {
    a[n + 1] = (a[n] + b) / 2;
    c[n + 1] = (a[n] - b) / 2;
    b        = std::sqrt(a[n] * b);
  }
  double phi = std::ldexp(a[n], n) * u, before = phi;
  for (; n > 0; n--) {
    before = phi;
    phi    = (phi + std::asin(c[n] / a[n] * std::sin(phi))) / 2;
  }
  *sn = std::sin(phi);
  *cn = std::cos(phi);
  *dn = *cn / std::cos(before - phi);
}

/* Largest error of the position of the centre of mass (or of a point on the first axis, if the centre of mass is at
   rest) at 20 times up to the end */
double errorOfReference(const Top &top, Exact &exact, const Vector3 &point, double end, double h, double alpha, bool space)
{
  LieGroup   m(top, h, alpha, space);
  const int  steps = (int)std::lround(end / h), every = steps / 20;
  double     worst = 0;
  for (int k = 1; k <= steps; k++) {
    m.step();
    if (k % every == 0) worst = std::max(worst, ((m.R - exact.attitude(k * h)) * point).norm());
  }
  return worst;
}

double errorOfScene(const Top &top, double mass, Exact &exact, const Vector3 &point, double end, double h, double alpha, Rotations rotations)
{
  Scene     scene(PETSC_COMM_SELF);
  RigidBody b;
  double    worst = 0;
  scene.gravity(top.weight / mass);
  scene.start().rotations = rotations;
  b.mass                  = mass;
  b.inertia               = Matrix3(top.J.asDiagonal()) + mass * skew(top.c) * skew(top.c); /* from the joint to the centre of mass (parallel axes) */
  b.center                = top.c;
  b.angular_velocity      = top.spin;
  b.velocity              = top.spin.cross(top.c);
  const Body body         = scene.add("top", b);
  scene.add("pivot", Spherical{scene.marker(body), scene.marker(scene.ground())});
  for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(scene.marker(body, point), c));
  SceneRun run(scene, end, fixedSteps(h) + " -ts_hhtdae_corrector_tolerance 1e-6 -ts_hhtdae_alpha " + std::to_string(alpha));
  hhtex::Watch watch(scene, end / 20, [&](double t, const std::vector<double> &x) {
    widen(worst, (Eigen::Map<const Vector3>(x.data()) - exact.attitude(t) * point).norm());
  });
  must(watch.attach(run.ts));
  must(run.solve());
  return worst;
}

} // namespace

/* Euler's equations of a free body: W by elliptic functions (Landau, Lifshitz, Mechanics, section 37) */
TEST(LieGroup, ReferenceAgainstEllipticFunctions)
{
  const Vector3 J(1, 2, 3), start(0.3, 0, 1.2); /* 2 E J2 < L^2, as W2 = 0 */
  const Top     top{J, Vector3::Zero(), Vector3::Zero(), start};
  const double  E = start.dot(J.asDiagonal() * start), L = Vector3(J.asDiagonal() * start).squaredNorm(), end = 10;
  ASSERT_GT(L, E * J(1));
  const double scale = std::sqrt((J(2) - J(1)) * (L - E * J(0)) / (J(0) * J(1) * J(2))), m = (J(1) - J(0)) * (E * J(2) - L) / ((J(2) - J(1)) * (L - E * J(0)));
  double       sn, cn, dn;
  jacobiElliptic(scale * end, m, &sn, &cn, &dn);
  const Vector3 exact(std::sqrt((E * J(2) - L) / (J(0) * (J(2) - J(0)))) * cn, std::sqrt((E * J(2) - L) / (J(1) * (J(2) - J(1)))) * sn,
                      std::sqrt((L - E * J(0)) / (J(2) * (J(2) - J(0)))) * dn);
  for (bool space : {true, false}) {
    double error[2];
    for (int k = 0; k < 2; k++) {
      LieGroup method(top, 0.01 / (1 << k), -0.1, space);
      for (int n = 0; n < 1000 << k; n++) method.step();
      error[k] = (method.inBody() - exact).norm();
    }
    MEASURED("free body: errors of the angular velocity %.2e, %.2e", error[0], error[1]);
    EXPECT_LT(error[1], 1e-3);
    EXPECT_NEAR(std::log2(error[0] / error[1]), 2, 0.1);
  }
}

/* Lagrange's top in regular precession, for the reference method and for the extrapolation */
TEST(LieGroup, ReferenceAgainstRegularPrecession)
{
  const double  l = 0.5, I3 = 0.02, I1 = 0.265, spin = 120, theta = PETSC_PI / 3, g = 9.81, cos = std::cos(theta), end = 2;
  const double  rate = 2 * g * l / (I3 * spin + std::sqrt(I3 * spin * I3 * spin - 4 * I1 * cos * g * l));
  const Matrix3 tilt = turn({theta, 0, 0}); /* at the start body axes coincide with space axes, and c is along the tilted axis */
  const Vector3 axis = tilt.col(2), up = Vector3::UnitZ();
  /* moments about e1, e2 of the tilted frame: I1 across the axis, I3 along it */
  const Matrix3 toTop = tilt.transpose();
  const Top     top{{I1, I1, I3}, {0, 0, l}, toTop * (-g * up), toTop * (rate * up + (spin - rate * cos) * axis)};
  Exact         extrapolated(top, 0.1 / spin);
  const auto    exact = [&](double t) -> Vector3 { return toTop * (Eigen::AngleAxisd(rate * t, up) * Vector3(l * axis)); };
  EXPECT_LT((extrapolated.attitude(end) * top.c - exact(end)).norm(), 1e-12);
  for (bool space : {true, false}) {
    double error[2];
    for (int k = 0; k < 2; k++) {
      LieGroup method(top, 2e-4 / (1 << k), -0.1, space);
      for (int n = 0; n < 10000 << k; n++) method.step();
      error[k] = (method.R * top.c - exact(end)).norm();
    }
    MEASURED("regular precession of %.2f rad: errors of the place %.2e, %.2e", rate * end, error[0], error[1]);
    EXPECT_LT(error[1], 1e-3);
    EXPECT_NEAR(std::log2(error[0] / error[1]), 2, 0.1);
  }
}

/* With the same steps the scene, with absolute coordinates and multipliers, is at least as accurate as the reference
   method in space axes; with Euler angles it is not. Velocities in body axes are worse for a fast spin about an axis
   that hardly moves, and better by a factor of up to 10 for a tumbling body: there the bounds state how much less
   accurate the scene is */
TEST(LieGroup, ErrorsOfScenesAtTheSameSteps)
{
  const double g = 9.81;
  struct {
    const char *name;
    double      mass;
    Top         top;
    double      end, h, allowed, of_body; /* error allowed relative to the reference method in space axes, and in body axes */
  } const cases[] = {
      {"heavy top", 15, {{0.234375 + 15, 0.46875, 0.234375 + 15}, {0, 1, 0}, {0, 0, -15 * g}, {0, 150, -4.61538}}, 2, 5e-4, 1. / 300, 1. / 300}, /* without the second term of Magnus' series 1/70 */
      {"tumbling top", 1, {{0.1, 0.45, 0.55}, {0.5, 0, 0}, {0, 0, -g}, {0.4, 4, 0.4}}, 4, 2e-3, 1.2, 6},
      {"satellite that tumbles", 1, {{1, 2, 3}, {0, 0, 0}, {0, 0, 0}, {0.02, 1, 0.01}}, 30, 1e-2, 1.2, 10},
  };
  for (const auto &c : cases) {
    Exact         exact(c.top, 0.1 / c.top.spin.norm());
    const Vector3 point = c.top.c.norm() > 0 ? c.top.c : Vector3(Vector3::UnitX());
    for (double alpha : {-0.3, -0.05}) {
      double reference[2], in_body[2], ours[2];
      for (int k = 0; k < 2; k++) {
        const double h = c.h / (1 << k);
        reference[k]   = errorOfReference(c.top, exact, point, c.end, h, alpha, true);
        in_body[k]     = errorOfReference(c.top, exact, point, c.end, h, alpha, false);
        ours[k]        = errorOfScene(c.top, c.mass, exact, point, c.end, h, alpha, Rotations::Local);
      }
      const double euler = errorOfScene(c.top, c.mass, exact, point, c.end, c.h / 2, alpha, Rotations::Euler313);
      MEASURED("%s, alpha %g, h = %g: error %.2e, of order %.2f; reference %.2e, of order %.2f, in body axes %.2e; Euler angles %.2e", c.name, alpha, c.h / 2,
               ours[1], std::log2(ours[0] / ours[1]), reference[1], std::log2(reference[0] / reference[1]), in_body[1], euler);
      EXPECT_LT(ours[1], c.allowed * reference[1]) << c.name;
      EXPECT_LT(ours[1], c.of_body * in_body[1]) << c.name;
      EXPECT_LT(ours[1], euler / 4) << c.name;
      EXPECT_GT(std::log2(ours[0] / ours[1]), 1.9) << c.name;
    }
  }
}
