/* The beam element: derivatives and energy, its matrix at rest, and static structures against closed forms */
#include "dense.h"
#include "force_checks.h"
#include "scene/kernels/beam.h"


using namespace hhtdae;

namespace
{

template <bool Damped> typename BeamForce<Damped>::Data BeamData(Random &random, Frame<double> *f)
{
  const Vector3 stretching(random(.5, 3), random(.5, 3), random(.5, 3)),
      turning(random(.5, 3), random(.5, 3), random(.5, 3));
  RelativeRotation(random, f);
  return {random(.5, 2), stretching, turning, random(.2, 1)};
}

struct Section {
  double E = 2, G = .75, area = 1, Iyy = .5, Izz = .25, J = .375, shear_y = 0, shear_z = 0;

  BeamForce<false>::Data element(double L) const
  {
    return BeamForce<false>::section(L, E, G, area, Iyy, Izz, J, shear_y, shear_z, 0);
  }
};

/* The textbook's 12 x 12 matrix; unknowns are displacement and rotation at x = 0, then at x = L, in the axes of the beam */
DynamicMatrix Przemieniecki(const Section &s, double L)
{
  const double  py = s.shear_y > 0 ? 12 * s.E * s.Izz / (s.G * s.shear_y * L * L) : 0;
  const double  pz = s.shear_z > 0 ? 12 * s.E * s.Iyy / (s.G * s.shear_z * L * L) : 0;
  const double  a = s.E * s.area / L, t = s.G * s.J / L;
  const double  y = s.E * s.Izz / ((1 + py) * L * L * L), z = s.E * s.Iyy / ((1 + pz) * L * L * L);
  DynamicMatrix K   = DynamicMatrix::Zero(12, 12);
  const auto    set = [&](int i, int j, double k) { K(i, j) = K(j, i) = k; };
  set(0, 0, a), set(6, 6, a), set(0, 6, -a);
  set(3, 3, t), set(9, 9, t), set(3, 9, -t);
  set(1, 1, 12 * y), set(7, 7, 12 * y), set(1, 7, -12 * y);
  set(1, 5, 6 * y * L), set(1, 11, 6 * y * L), set(5, 7, -6 * y * L), set(7, 11, -6 * y * L);
  set(5, 5, (4 + py) * y * L * L), set(11, 11, (4 + py) * y * L * L), set(5, 11, (2 - py) * y * L * L);
  set(2, 2, 12 * z), set(8, 8, 12 * z), set(2, 8, -12 * z);
  set(2, 4, -6 * z * L), set(2, 10, -6 * z * L), set(4, 8, 6 * z * L), set(8, 10, 6 * z * L);
  set(4, 4, (4 + pz) * z * L * L), set(10, 10, (4 + pz) * z * L * L), set(4, 10, (2 - pz) * z * L * L);
  return K;
}

/* A cantilever of n straight elements: node 0 is clamped, the others are free bodies that turn with their axes */
struct Cantilever {
  struct Element {
    int                    j, i;
    Matrix3                Rj, Ri; /* axes of the markers on the nodes */
    BeamForce<false>::Data data;
  };
  std::vector<Frame<double>> node;
  std::vector<Element>       element;
  Vector3                    force = Vector3::Zero(), moment = Vector3::Zero(); /* at the tip, fixed in space */

  /* through these points, with bending about the y and z axes of `up` */
  Cantilever(const std::vector<Vector3> &points, const Section &section)
  {
    for (const Vector3 &x : points) node.push_back({x, Matrix3::Identity()});
    for (int k = 0; k + 1 < (int)points.size(); k++) {
      const Vector3 along = points[k + 1] - points[k];
      Matrix3       R;
      R.col(0) = along.normalized();
      R.col(2) = Vector3::UnitZ();
      R.col(1) = R.col(2).cross(R.col(0));
      element.push_back({k, k + 1, R, R, section.element(along.norm())});
    }
  }
  static Cantilever straight(int n, double L, const Section &section)
  {
    std::vector<Vector3> points;
    for (int k = 0; k <= n; k++) points.push_back({k * L / n, 0, 0});
    return Cantilever(points, section);
  }
  Frame<double> &tip() { return node.back(); }

  /* r = -(loads), K = dr/d(free nodes) */
  void assemble(DynamicVector &r, DynamicMatrix &K) const
  {
    const int n = 6 * ((int)node.size() - 1);
    r.setZero(n);
    K.setZero(n, n);
    r.segment<3>(n - 6) = -force;
    r.tail<3>()         = -moment;
    for (const Element &e : element) {
      const Frame<double> f[2]  = {{node[e.i].x, node[e.i].R * e.Ri}, {node[e.j].x, node[e.j].R * e.Rj}};
      const int           at[2] = {6 * (e.i - 1), 6 * (e.j - 1)};
      Wrench<double>      on[2];
      ForceJacobian<2, 0> J;
      BeamForce<false>::jacobian(e.data, f, nullptr, 0, nullptr, on, J);
      for (int a = 0; a < 2; a++) {
        if (at[a] < 0) continue;
        r.segment<3>(at[a]) -= on[a].f;
        r.segment<3>(at[a] + 3) -= on[a].m;
        for (int b = 0; b < 2; b++)
          if (at[b] >= 0) K.block<6, 6>(at[a], at[b]) -= J.frames.block<6, 6>(6 * a, 6 * b);
      }
    }
  }

  /* Newton's method; returns the number of iterations, -1 if it does not converge. Corrections that would turn a node
     far are shortened */
  int solve(int most = 60)
  {
    DynamicVector r;
    DynamicMatrix K;
    for (int iteration = 0; iteration < most; iteration++) {
      assemble(r, K);
      DynamicVector dx      = hhtest::SolveDense(K, -r);
      double        largest = 0;
      for (int k = 1; k < (int)node.size(); k++) largest = std::max(largest, dx.segment<3>(6 * k - 3).norm());
      if (!std::isfinite(largest)) return -1;
      if (largest > .5) dx *= .5 / largest;
      for (int k = 1; k < (int)node.size(); k++) {
        const Vector3 turn = dx.segment<3>(6 * k - 3);
        node[k].x += dx.segment<3>(6 * k - 6);
        node[k].R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * node[k].R;
      }
      if (dx.norm() < 1e-10) return iteration + 1; /* lengths are up to 100; convergence is quadratic */
    }
    return -1;
  }
};

/* a slender strip, in which only bending matters */
Section Strip()
{
  Section s;
  s.E = 1, s.G = .5, s.area = 1e7, s.Iyy = s.Izz = 1, s.J = 2;
  return s;
}

/*
  The elastica under a dead tip load P across it, a = P L^2/EI: with theta the angle at the tip, k^2 = (1 + sin theta)/2
  and sin phi = 1/(k sqrt 2), sqrt(a) = K(k) - F(k, phi); deflection/L = 1 - 2 (E(k) - E(k, phi))/sqrt(a), shortening/L
  = 1 - sqrt(2 sin(theta)/a)  (Bisshopp and Drucker 1945).
*/
struct Elastica {
  double deflection, shortening, angle;

  explicit Elastica(double a)
  {
    double low = 1e-6, high = M_PI / 2 - 1e-12;
    for (int k = 0; k < 200; k++) {
      angle          = (low + high) / 2;
      const double m = std::sqrt((1 + std::sin(angle)) / 2), phi = std::asin(1 / (m * std::sqrt(2.)));
      const double sq            = std::comp_ellint_1(m) - std::ellint_1(m, phi);
      (sq * sq < a ? low : high) = angle;
      deflection                 = 1 - 2 * (std::comp_ellint_2(m) - std::ellint_2(m, phi)) / std::sqrt(a);
    }
    shortening = 1 - std::sqrt(2 * std::sin(angle) / a);
  }
};

} // namespace

TEST(Beam, Kernels)
{
  CheckForce<BeamForce<true>>(BeamData<true>);
  CheckForce<BeamForce<false>>(BeamData<false>);
}

TEST(Beam, AgreesWithAutomaticDifferentiation)
{
  CompareForce<BeamForce<true>>(BeamData<true>);
  CompareForce<BeamForce<false>>(BeamData<false>);
}

TEST(Beam, Potential)
{
  ExpectSymmetric<BeamForce<false>>(BeamData<false>);
  ExpectPotential<BeamForce<false>>(BeamData<false>, BeamForce<false>::energy);
  ExpectDissipative<BeamForce<true>>(BeamData<true>);
  ExpectObjective<BeamForce<true>>(BeamData<true>);
}

/* the stiffness at rest for any orientation, with and without shear, and the damping proportional to it */
TEST(Beam, MatrixAtRest)
{
  Random random(31);
  for (double shear : {0., .8}) {
    Section s;
    s.shear_y = shear, s.shear_z = 1.5 * shear;
    const double                 L = 1.25, damping = .125;
    BeamForce<true>::Data        data;
    const BeamForce<false>::Data elastic = s.element(L);
    data                                 = {elastic.length, elastic.stretching, elastic.turning, damping};
    const Matrix3       R                = random.rotation();
    const Vector3       x                = random.vector();
    const Frame<double> f[2]             = {{x + L * R.col(0), R}, {x, R}};
    const Twist<double> w[2]             = {{Vector3::Zero(), Vector3::Zero()}, {Vector3::Zero(), Vector3::Zero()}};
    const DynamicMatrix K                = Przemieniecki(s, L);
    DynamicMatrix       Q                = DynamicMatrix::Zero(12, 12); /* node 0 is j, node 1 is i */
    Wrench<double>      on[2];
    ForceJacobian<2, 0> J;
    for (int b = 0; b < 2; b++) Q.block<3, 3>(3 * b, 6 + 3 * b) = Q.block<3, 3>(6 + 3 * b, 3 * b) = R;
    BeamForce<true>::jacobian(data, f, w, 0, nullptr, on, J);
    EXPECT_LT(checks::ToVector<2>(on).norm(), 1e-14);
    ExpectClose(J.frames, -Q * K * Q.transpose(), 1e-13, "stiffness");
    ExpectClose(J.twists, -damping * Q * K * Q.transpose(), 1e-13, "damping");
    ExpectClose(J.frames, J.frames.transpose(), 1e-14, "stiffness, transposed,");
  }
}

/* Both ends are treated alike: exchanging the ends of the beam gives the same wrenches */
TEST(Beam, HasNoPreferredEnd)
{
  Random        random(32);
  const Matrix3 back = Vector3(-1, -1, 1).asDiagonal(); /* half a turn about z */
  for (int k = 0; k < 20; k++) {
    const checks::Sample<BeamForce<true>> s(BeamData<true>, random);
    const Frame<double>                   f[2] = {{s.f[1].x, s.f[1].R * back}, {s.f[0].x, s.f[0].R * back}};
    const Twist<double>                   w[2] = {s.w[1], s.w[0]};
    Wrench<double>                        on[2], reversed[2];
    BeamForce<true>::wrench(s.data, s.f, s.w, 0, nullptr, on);
    BeamForce<true>::wrench(s.data, f, w, 0, nullptr, reversed);
    for (int m = 0; m < 2; m++) {
      EXPECT_LT((on[m].f - reversed[1 - m].f).norm(), 1e-12);
      EXPECT_LT((on[m].m - reversed[1 - m].m).norm(), 1e-12);
    }
  }
}

/* Without strain there is no force, for any rigid position and velocity */
TEST(Beam, RigidMotion)
{
  Random                      random(33);
  Section                     s;
  const auto                  elastic = s.element(3);
  const BeamForce<true>::Data data    = {elastic.length, elastic.stretching, elastic.turning, .5};
  for (int k = 0; k < 50; k++) {
    const Matrix3       R = random.rotation();
    const Vector3       x = random.vector(10), v = random.vector(10), spin = random.vector(10);
    const Frame<double> f[2] = {{x + 3 * R.col(0), R}, {x, R}};
    const Twist<double> w[2] = {{v + spin.cross(Vector3(3 * R.col(0))), spin}, {v, spin}};
    Wrench<double>      on[2];
    BeamForce<true>::wrench(data, f, w, 0, nullptr, on);
    EXPECT_LT(checks::ToVector<2>(on).norm(), 2e-13);
  }
}

/* P L^3/3EI + P L/GA and P L^2/2EI at the tip, in both planes, for any number of elements */
TEST(Beam, CantileverUnderSmallLoads)
{
  Section s;
  s.shear_y = .8, s.shear_z = .6;
  const double L = 2, P = 1e-6;
  for (int n : {1, 8}) {
    Cantilever c = Cantilever::straight(n, L, s);
    c.force      = {P, P, P};
    c.moment     = {P, 0, 0};
    ASSERT_GT(c.solve(), 0);
    const Vector3 u = c.tip().x - Vector3(L, 0, 0);
    const double  y = P * L * L * L / (3 * s.E * s.Izz) + P * L / (s.G * s.shear_y);
    const double  z = P * L * L * L / (3 * s.E * s.Iyy) + P * L / (s.G * s.shear_z);
    EXPECT_NEAR(u(0), P * L / (s.E * s.area), 1e-4 * P) << n;
    EXPECT_NEAR(u(1), y, 1e-4 * y) << n;
    EXPECT_NEAR(u(2), z, 1e-4 * z) << n;
    EXPECT_NEAR(c.tip().R(1, 0), P * L * L / (2 * s.E * s.Izz), 1e-4 * P) << n;
    EXPECT_NEAR(c.tip().R(2, 0), P * L * L / (2 * s.E * s.Iyy), 1e-4 * P) << n;
    EXPECT_NEAR(c.tip().R(2, 1), P * L / (s.G * s.J), 1e-4 * P) << n;
  }
}

TEST(Beam, ElasticaUnderTipLoad)
{
  const Section strip = Strip();
  for (double a : {1., 5., 10.}) {
    const Elastica exact(a);
    double         before = 0;
    for (int n : {4, 8, 16}) {
      Cantilever c     = Cantilever::straight(n, 1, strip);
      const int  steps = (int)(4 * a);
      for (int step = 1; step <= steps; step++) {
        c.force = {0, step * a / steps, 0};
        ASSERT_GT(c.solve(), 0) << "load " << a << ", elements " << n;
      }
      const double error = std::hypot(c.tip().x(1) - exact.deflection, 1 - c.tip().x(0) - exact.shortening);
      if (before > 0) {
        EXPECT_GT(before / error, 3.6) << "second order, load " << a << ", elements " << n;
      }
      before = error;
    }
    EXPECT_LT(before, 5e-4) << "load " << a;
  }
}

/* M = 2 pi EI/L rolls a strip into a circle: its elements are the sides of a regular polygon, the tip comes back to the
   root exactly, and the opposite point tends to the circle's */
TEST(Beam, StripRollsIntoCircle)
{
  const double L         = 1;
  double       before[3] = {0, 0, 0};
  for (int n : {8, 16})
    for (int plane : {1, 2}) {
      Cantilever c = Cantilever::straight(n, L, Strip());
      for (int step = 1; step <= 10; step++) {
        c.moment = Vector3::Zero();
        if (plane == 1)
          c.moment(2) = step * 2 * M_PI / (10 * L);
        else
          c.moment(1) = -step * 2 * M_PI / (10 * L);
        ASSERT_GT(c.solve(), 0) << n << " elements, step " << step;
      }
      const double error = (c.node[n / 2].x - L / M_PI * Vector3::Unit(plane)).norm();
      EXPECT_LT(c.tip().x.norm(), 1e-12) << n;
      EXPECT_LT((c.tip().R - Matrix3::Identity()).norm(), 1e-12) << n;
      if (before[plane] > 0) {
        EXPECT_NEAR(before[plane] / error, 4, .2) << "second order, elements " << n;
      }
      before[plane] = error;
    }
  EXPECT_LT(before[2], 2.5e-3);
}

/* A cantilever bent to an eighth of a circle of radius 100 in the plane, loaded across it, of eight straight elements:
   tip by Bathe and Bolourchi (1979) and by Simo and Vu-Quoc (1986), whose figures differ among themselves by 0.15 */
TEST(Beam, CurvedCantileverInSpace)
{
  Section s;
  s.E = 1e7, s.G = 5e6, s.area = 1, s.Iyy = s.Izz = 1. / 12, s.J = 1. / 6, s.shear_y = s.shear_z = 1;
  std::vector<Vector3> points;
  const int            n = 8;
  for (int k = 0; k <= n; k++) {
    const double a = M_PI / 4 * k / n;
    points.push_back({100 * std::sin(a), 100 * (1 - std::cos(a)), 0});
  }
  Cantilever    c(points, s);
  const Vector3 published[] = {{58.84, 22.33, 40.08}, {47.23, 15.79, 53.37}};
  for (int k : {0, 1}) {
    c.force = {0, 0, 300. * (k + 1)};
    ASSERT_GT(c.solve(), 0);
    EXPECT_LT((c.tip().x - published[k]).cwiseAbs().maxCoeff(), .2) << c.tip().x.transpose();
  }
}

/* At Euler's load pi^2 EI/4L^2 of a cantilever the matrix of the straight, compressed beam becomes singular */
TEST(Beam, EulerBuckling)
{
  const double exact  = M_PI * M_PI / 4;
  double       before = 0;
  for (int n : {4, 8}) {
    double low = 0, high = 2 * exact;
    for (int k = 0; k < 30; k++) {
      const double  P = (low + high) / 2;
      Cantilever    c = Cantilever::straight(n, 1, Strip());
      DynamicVector r;
      DynamicMatrix K;
      c.force = {-P, 0, 0};
      for (int i = 1; i <= n; i++) c.node[i].x(0) *= 1 - P / 1e7; /* EA = 1e7 */
      c.assemble(r, K);
      ASSERT_LT(r.norm(), 1e-6);
      const double smallest = hhtest::EigenvaluesOf((K + K.transpose()) / 2)(0);
      (smallest > 0 ? low : high) = P;
    }
    const double error = std::abs(low / exact - 1);
    if (before > 0) {
      EXPECT_NEAR(before / error, 4, .5);
    }
    before = error;
  }
  EXPECT_LT(before, 4e-3);
}
