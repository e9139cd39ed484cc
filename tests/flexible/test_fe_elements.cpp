/* Element kernels: shape functions, stiffness, mass, stress, large displacements, of all four solids. */
#include "dense.h"
#include "flexible/element.h"
#include "support.h"


using namespace hhtest;
using namespace hhtdae;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace
{

const Material steel{2.1, 0.3, 7.85};

template <class S> class FeElements : public testing::Test
{
};
using Shapes = testing::Types<fe::Tetrahedron4, fe::Tetrahedron10, fe::Brick8, fe::Brick20>;
TYPED_TEST_SUITE(FeElements, Shapes);

template <class Shape> constexpr bool quadratic() { return Shape::nodes > Shape::corners; }

/* The reference element under an affine map, with straight edges; corners, middles: random displacements of these nodes */
template <class Shape> fe::NodeVectors<Shape> element(double corners = 0, double middles = 0)
{
  Matrix3d A;
  A << 1.1, .3, .1, -.2, .9, .2, .15, -.1, 1.3;
  std::srand(3);
  fe::NodeVectors<Shape>      X;
  Eigen::Matrix<double, 3, 8> moved = corners * Eigen::Matrix<double, 3, 8>::Random();
  for (int i = 0; i < Shape::corners; i++) X.col(i) = A * Shape::place(i) + Vector3d(.4, .5, .6) + moved.col(i);
  for (int i = Shape::corners; i < Shape::nodes; i++) {
    const auto &e = Shape::edge[i - Shape::corners];
    X.col(i)      = (X.col(e[0]) + X.col(e[1])) / 2 + middles * Vector3d::Random();
  }
  return X;
}

/* Displacement field at the nodes */
template <class Shape, class F> fe::NodeVectors<Shape> field(const fe::NodeVectors<Shape> &X, F &&f)
{
  fe::NodeVectors<Shape> u;
  for (int i = 0; i < Shape::nodes; i++) u.col(i) = f(Vector3d(X.col(i)));
  return u;
}

/* The elements' results as matrices of dynamic size: compiling the tests' arithmetic for each fixed size takes a minute */
template <int Rows, int Columns, int Options> Eigen::Map<const Eigen::MatrixXd> any(const Eigen::Matrix<double, Rows, Columns, Options> &m)
{
  static_assert(!(Options & Eigen::RowMajor), "by columns");
  return {m.data(), Rows, Columns};
}

template <class Shape> Eigen::Map<const Eigen::VectorXd> flat(const fe::NodeVectors<Shape> &u) { return {u.data(), 3 * Shape::nodes}; }

Eigen::Matrix<double, 6, 1> stressOf(const Matrix3d &D)
{
  const fe::Lame              lame(steel);
  const Matrix3d              s = lame.lambda * D.trace() * Matrix3d::Identity() + lame.mu * (D + D.transpose());
  Eigen::Matrix<double, 6, 1> v;
  v << s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(2, 0);
  return v;
}

} // namespace

TYPED_TEST(FeElements, ShapeFunctionsAreOneAtTheirNode)
{
  using S = TypeParam;
  for (int i = 0; i < S::nodes; i++) {
    fe::Values<S::nodes> N;
    S::shape(S::place(i), N);
    for (int j = 0; j < S::nodes; j++) EXPECT_NEAR(N[j], i == j, 1e-14) << i << " " << j;
  }
}

TYPED_TEST(FeElements, GradientsAreDerivatives)
{
  using S = TypeParam;
  const Vector3d          x(.21, .17, .33);
  fe::Gradients<S::nodes> d;
  S::gradient(x, d);
  for (int k = 0; k < 3; k++) {
    const double         h = 1e-5;
    fe::Values<S::nodes> a, b;
    S::shape(x + h * Vector3d::Unit(k), a);
    S::shape(x - h * Vector3d::Unit(k), b);
    EXPECT_NEAR((any(d).row(k).transpose() - (any(a) - any(b)) / (2 * h)).norm(), 0, 1e-9);
  }
  EXPECT_NEAR(any(d).rowwise().sum().norm(), 0, 1e-13);
}

TYPED_TEST(FeElements, FacesAndEdgesBelongToThePlaces)
{
  using S = TypeParam;
  /* the corners of a face lie in one plane; in Gmsh's orientation its normal points away from the centre of the element */
  Vector3d centre = Vector3d::Zero();
  for (int i = 0; i < S::corners; i++) centre += S::corner(i) / S::corners;
  for (int f = 0; f < S::faces; f++) {
    const Vector3d a = S::corner(S::face[f][0]), b = S::corner(S::face[f][1]), c = S::corner(S::face[f][2]);
    const Vector3d n = (b - a).cross(c - a);
    EXPECT_LT(n.dot(centre - a), -1e-3) << f;
    if (S::perface == 4) {
      EXPECT_NEAR(n.dot(S::corner(S::face[f][3]) - a), 0, 1e-14);
    }
  }
}

/* Integration rules are exact for monomials over the reference element */
TYPED_TEST(FeElements, RulesAreExact)
{
  using S              = TypeParam;
  const bool simplex   = S::corners == 4;
  const auto factorial = [](int n) { return std::tgamma(n + 1.); };
  const auto exact     = [&](int a, int b, int c) {
    if (simplex) return factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 3);
    return (a % 2 || b % 2 || c % 2) ? 0. : 8. / ((a + 1) * (b + 1) * (c + 1));
  };
  const auto check = [&](const auto &points, int degree) {
    for (int a = 0; a <= degree; a++)
      for (int b = 0; b <= degree; b++)
        for (int c = 0; c <= degree; c++) {
          if (simplex && a + b + c > degree) continue;
          double sum = 0;
          for (size_t q = 0; q < points.at.size(); q++)
            sum += points.weight[q] * std::pow(points.at[q][0], a) * std::pow(points.at[q][1], b) *
                   std::pow(points.at[q][2], c);
          EXPECT_NEAR(sum, exact(a, b, c), 1e-14) << a << b << c;
        }
  };
  check(S::StiffnessRule::points(), simplex ? (quadratic<S>() ? 2 : 1) : quadratic<S>() ? 5 : 3);
  check(S::MassRule::points(), simplex ? (quadratic<S>() ? 5 : 2) : quadratic<S>() ? 7 : 5);
}

TYPED_TEST(FeElements, StiffnessHasSixRigidMotionsAndNoOther)
{
  using S                    = TypeParam;
  const fe::NodeVectors<S> X = element<S>(.08, .02);
  fe::Stiffness<S>         K;
  ASSERT_GT(fe::ElementStiffness<S>(X, fe::Lame(steel), K), 1e-3);
  EXPECT_EQ((any(K) - any(K).transpose()).norm(), 0);
  const Eigen::VectorXd e    = hhtest::EigenvaluesOf(any(K));
  const double          most = e[e.size() - 1];
  for (int i = 0; i < 6; i++) EXPECT_LT(std::abs(e[i]), 1e-13 * most) << i;
  EXPECT_GT(e[6], 1e-4 * most);
  for (int k = 0; k < 3; k++) {
    const Vector3d axis = Vector3d::Unit(k);
    EXPECT_LT((any(K) * flat<S>(field<S>(X, [&](Vector3d) { return axis; }))).norm(), 1e-13 * most);
    EXPECT_LT((any(K) * flat<S>(field<S>(X, [&](Vector3d x) { return Vector3d(axis.cross(x)); }))).norm(), 1e-12 * most);
  }
}

/* A field of constant strain: nodal forces are those of the stress on the faces, the energy is that of the volume */
TYPED_TEST(FeElements, ConstantStrain)
{
  using S                    = TypeParam;
  const fe::NodeVectors<S> X = element<S>(.08, .02);
  Matrix3d                 D;
  D << .01, .02, -.01, .03, -.02, .01, .005, .015, .025;
  fe::Stiffness<S> K;
  fe::ElementStiffness<S>(X, fe::Lame(steel), K);
  const auto                        u = field<S>(X, [&](Vector3d x) { return Vector3d(D * x + Vector3d(1, 2, 3)); });
  const Eigen::Matrix<double, 6, 1> s = stressOf(D);
  const Matrix3d                    e = (D + D.transpose()) / 2;
  const double                      density =
      (s[0] * e(0, 0) + s[1] * e(1, 1) + s[2] * e(2, 2)) / 2 + s[3] * e(0, 1) + s[4] * e(1, 2) + s[5] * e(2, 0);
  double      volume = 0; /* with the integration points of the stiffness: exact unless edges are curved */
  const auto &table  = fe::Table<S, typename S::StiffnessRule>::get();
  for (size_t q = 0; q < table.d.size(); q++)
    volume += table.points.weight[q] * Matrix3d(any(X) * any(table.d[q]).transpose()).determinant();
  EXPECT_NEAR(flat<S>(u).dot(any(K) * flat<S>(u)) / 2, density * volume, 1e-11 * std::abs(density * volume));

  fe::NodeStress<S> at;
  fe::StressAtNodes<S>{X}(u, fe::Lame(steel), at);
  for (int i = 0; i < S::nodes; i++) EXPECT_LT((at.col(i) - s).norm(), 1e-12 * s.norm()) << i;
}

/* Elements of degree two reproduce linear strains: displacements of degree two on a parallelepiped */
TYPED_TEST(FeElements, LinearStress)
{
  using S = TypeParam;
  if (!quadratic<S>()) return; /* linear elements have constant strains, see above */
  const fe::NodeVectors<S> X = element<S>();
  const auto               u = [](Vector3d x) {
    return Vector3d(x[0] * x[1] + x[2] * x[2], x[0] * x[0] - x[1] * x[2], 2 * x[0] * x[2] + x[1] * x[1]);
  };
  const auto der = [](Vector3d x) {
    Matrix3d D;
    D << x[1], x[0], 2 * x[2], 2 * x[0], -x[2], -x[1], 2 * x[2], 2 * x[1], 2 * x[0];
    return D;
  };
  fe::NodeStress<S> at;
  fe::StressAtNodes<S>{X}(field<S>(X, u), fe::Lame(steel), at);
  for (int i = 0; i < S::nodes; i++) EXPECT_LT((at.col(i) - stressOf(der(X.col(i)))).norm(), 1e-12) << i;
}

/* Mass, first and second moments of a field that the element reproduces exactly, against those of the polyhedron */
TYPED_TEST(FeElements, MassAndMoments)
{
  using S                    = TypeParam;
  const fe::NodeVectors<S> X = element<S>(S::corners == 8 ? .1 : 0);
  fe::Mass<S>              m;
  fe::ElementMass<S>(X, steel.density, m);
  /* the same integrals over the corners only, with more points than the element uses */
  using Linear                          = std::conditional_t<S::corners == 4, fe::Tetrahedron4, fe::Brick8>;
  using Rule                            = std::conditional_t<S::corners == 4, fe::TetrahedronRule15, fe::BrickRule<4>>;
  const fe::NodeVectors<Linear> corners = X.template leftCols<S::corners>();
  const auto                   &table   = fe::Table<Linear, Rule>::get();
  double                        mass    = 0;
  Vector3d                      first   = Vector3d::Zero();
  Matrix3d                      second  = Matrix3d::Zero();
  for (int q = 0; q < Rule::count; q++) {
    const double w = steel.density * table.points.weight[q] * Matrix3d(any(corners) * any(table.d[q]).transpose()).determinant();
    const Vector3d x = any(corners) * any(table.N[q]);
    mass += w;
    first += w * x;
    second += w * x * x.transpose();
  }
  EXPECT_NEAR(any(m).sum(), mass, 1e-13 * mass);
  EXPECT_LT((any(X) * any(m).rowwise().sum() - first).norm(), 1e-13 * first.norm());
  EXPECT_LT((any(X) * any(m) * any(X).transpose() - second).norm(), 1e-13 * second.norm());
  const Eigen::VectorXd e = hhtest::EigenvaluesOf(any(m));
  EXPECT_GT(e[0], 1e-4 * e[e.size() - 1]);
}

/* All entries of the mass matrix equal those of a rule of higher degree */
TYPED_TEST(FeElements, MassIsIntegratedExactly)
{
  using S                    = TypeParam;
  const fe::NodeVectors<S> X = element<S>(S::corners == 8 ? .1 : 0);
  fe::Mass<S>              m;
  Eigen::MatrixXd          again = Eigen::MatrixXd::Zero(S::nodes, S::nodes);
  fe::ElementMass<S>(X, 1, m);
  /* Gauss rule in each direction, collapsed for a tetrahedron */
  const double x5[5] = {0, .5384693101056831, -.5384693101056831, .9061798459386640, -.9061798459386640};
  const double w5[5] = {.5688888888888889, .4786286704993665, .4786286704993665, .2369268850561891, .2369268850561891};
  for (int i = 0; i < 5; i++)
    for (int j = 0; j < 5; j++)
      for (int k = 0; k < 5; k++) {
        Vector3d x(x5[i], x5[j], x5[k]);
        double   w = w5[i] * w5[j] * w5[k];
        if (S::corners == 4) {
          const double a = (1 + x[0]) / 2, b = (1 + x[1]) / 2, c = (1 + x[2]) / 2;
          x = {a, b * (1 - a), c * (1 - a) * (1 - b)};
          w *= (1 - a) * (1 - a) * (1 - b) / 8;
        }
        fe::Values<S::nodes>    N;
        fe::Gradients<S::nodes> d;
        S::shape(x, N);
        S::gradient(x, d);
        again += w * Matrix3d(any(X) * any(d).transpose()).determinant() * any(N) * any(N).transpose();
      }
  EXPECT_LT((any(m) - again).norm(), 1e-13 * again.norm());
}

TYPED_TEST(FeElements, InvertedAndFlatElementsAreSeen)
{
  using S              = TypeParam;
  fe::NodeVectors<S> X = element<S>(), mirrored = X, flatted = X, nothing = fe::NodeVectors<S>::Zero(), broken = X;
  mirrored.row(2) *= -1;
  flatted.row(1) = flatted.row(0);
  broken(0, 0)   = std::nan("");
  fe::Stiffness<S> K;
  fe::Mass<S>      m;
  for (const auto &x : {mirrored, flatted, nothing, broken}) {
    EXPECT_FALSE(fe::ElementStiffness<S>(x, fe::Lame(steel), K) > fe::degenerate);
    EXPECT_FALSE(fe::ElementMass<S>(x, 1, m) > fe::degenerate);
    EXPECT_FALSE(fe::StressAtNodes<S>(x).least() > fe::degenerate);
  }
  /* a very thin element is not an error */
  fe::NodeVectors<S> thin = X;
  thin.row(2) *= 1e-6;
  EXPECT_GT(fe::ElementStiffness<S>(thin, fe::Lame(steel), K), fe::degenerate);
}

/* ---- large displacements ---- */

TYPED_TEST(FeElements, TangentAtRestIsTheStiffness)
{
  using S                    = TypeParam;
  const fe::NodeVectors<S> X = element<S>(.08, .02);
  fe::NodeVectors<S>       f;
  fe::Stiffness<S>         K, T;
  fe::ElementStiffness<S>(X, fe::Lame(steel), K);
  fe::LargeForce<S>(X, fe::NodeVectors<S>::Zero(), fe::Lame(steel), f, &T);
  EXPECT_EQ(any(f).norm(), 0);
  EXPECT_LT((any(K) - any(T)).norm(), 1e-14 * any(K).norm());
}

TYPED_TEST(FeElements, ForceIsDerivativeOfEnergyAndTangentOfForce)
{
  using S                    = TypeParam;
  const fe::NodeVectors<S> X = element<S>(.08, .02);
  std::srand(5);
  const fe::NodeVectors<S> u = .3 * fe::NodeVectors<S>::Random();
  fe::NodeVectors<S>       f, a, b;
  fe::Stiffness<S>         T;
  double                   energy, up, down;
  fe::LargeForce<S>(X, u, fe::Lame(steel), f, &T, &energy);
  ASSERT_GT(energy, 1e-3);
  for (int k = 0; k < 3 * S::nodes; k++) {
    const double       h = 1e-5;
    fe::NodeVectors<S> v = u;
    v(k % 3, k / 3) += h;
    fe::LargeForce<S>(X, v, fe::Lame(steel), a, nullptr, &up);
    v(k % 3, k / 3) -= 2 * h;
    fe::LargeForce<S>(X, v, fe::Lame(steel), b, nullptr, &down);
    EXPECT_NEAR((up - down) / (2 * h), f(k % 3, k / 3), 1e-8 * any(f).norm()) << k;
    EXPECT_LT((flat<S>(a) / (2 * h) - flat<S>(b) / (2 * h) - any(T).col(k)).norm(), 1e-8 * any(T).norm()) << k;
  }
  EXPECT_EQ((any(T) - any(T).transpose()).norm(), 0);
}

/* The function for forces without tangent, which processes four points at a time, gives the same forces */
TYPED_TEST(FeElements, ForceAloneIsThatOfTheTangent)
{
  using S                    = TypeParam;
  const fe::NodeVectors<S> X = element<S>(.08, .02);
  std::srand(6);
  const fe::NodeVectors<S> u = .3 * fe::NodeVectors<S>::Random();
  fe::NodeVectors<S>       with, alone;
  fe::Stiffness<S>         T;
  double                   energy, of_force;
  const double             least = fe::LargeForce<S>(X, u, fe::Lame(steel), with, &T, &energy);
  EXPECT_NEAR(fe::LargeForce<S>(X, u, fe::Lame(steel), alone, nullptr, &of_force), least, 1e-13 * least);
  EXPECT_LT((any(with) - any(alone)).norm(), 1e-13 * any(with).norm());
  EXPECT_NEAR(of_force, energy, 1e-13 * energy);
  const fe::NodeVectors<S> flat = fe::NodeVectors<S>::Zero();
  EXPECT_EQ(fe::LargeForce<S>(flat, u, fe::Lame(steel), alone) > fe::degenerate, false);
}

TYPED_TEST(FeElements, RotationAtLargeMakesNoForce)
{
  using S                    = TypeParam;
  const fe::NodeVectors<S> X = element<S>(.08, .02);
  const Matrix3d           R = Eigen::AngleAxisd(2.3, Vector3d(1, -2, .5).normalized()).toRotationMatrix();
  const auto               u = field<S>(X, [&](Vector3d x) { return Vector3d(R * x - x + Vector3d(5, -3, 2)); });
  fe::NodeVectors<S>       f;
  fe::Stiffness<S>         K;
  fe::ElementStiffness<S>(X, fe::Lame(steel), K);
  double energy;
  fe::LargeForce<S>(X, u, fe::Lame(steel), f, nullptr, &energy);
  EXPECT_LT(any(f).norm(), 1e-13 * any(K).norm());
  EXPECT_LT(energy, 1e-25 * any(K).norm());
}
