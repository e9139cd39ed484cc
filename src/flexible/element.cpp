/* The element kernels of element.h, for the four shapes */
#include "flexible/element.h"
#include "flexible/element_points.h"
#include "scene/products.h"
#include <Eigen/LU>
#include <cmath>

namespace hhtdae
{
namespace fe
{

namespace
{

constexpr int max_nodes = 20, max_points = 64;

/* A shape at the points of a rule, with sizes known at run time, so that the kernels are compiled once for all shapes */
struct Sampled {
  int           nodes, points;
  const double *weight, *N, *d; /* weight[q] of point q; N[nodes q + i]: shape function of node i there; d[3 (nodes q + i)]: its three derivatives */
};

template <class Shape, class Rule> Sampled SampledBy()
{
  static_assert(Shape::nodes <= max_nodes && Rule::count <= max_points, "larger than the kernels' arrays");
  const auto &t = Table<Shape, Rule>::get();
  return {Shape::nodes, Rule::count, t.points.weight.data(), t.N[0].data(), t.d[0].data()};
}
template <class Shape> Sampled ForStiffness() { return SampledBy<Shape, typename Shape::StiffnessRule>(); }
template <class Shape> Sampled ForMass() { return SampledBy<Shape, typename Shape::MassRule>(); }
template <class Shape> Sampled ForStress() { return SampledBy<Shape, typename Shape::StressRule>(); }

/* A A^T, n x n */
void OuterProduct(const double *A, int n, int columns, double *out) { product::Of({A, n, columns, n, false}, {A, columns, n, n, true}, out); }

/* sum of a_i b_i^T over vectors of three components */
Eigen::Matrix3d SumOfProducts(int n, const double *a, const double *b)
{
  double s[9] = {0}; /* by columns */
  for (int i = 0; i < 3 * n; i += 3)
    for (int k = 0; k < 3; k++)
      for (int c = 0; c < 3; c++) s[3 * k + c] += a[i + c] * b[i + k];
  return Eigen::Map<const Eigen::Matrix3d>(s);
}

/* b_i = A a_i */
void TransformEach(int n, const Eigen::Matrix3d &A, const double *a, double *b)
{
  for (int i = 0; i < 3 * n; i += 3)
    for (int c = 0; c < 3; c++) b[i + c] = A(c, 0) * a[i] + A(c, 1) * a[i + 1] + A(c, 2) * a[i + 2];
}

double InverseExtent(int n, const double *X)
{
  double l = 0;
  for (int c = 0; c < 3; c++) {
    double least = X[c], most = X[c];
    for (int i = 1; i < n; i++) {
      least = std::min(least, X[3 * i + c]);
      most  = std::max(most, X[3 * i + c]);
    }
    l = std::max(l, most - least);
  }
  return l > 0 ? 1 / (l * l * l) : std::numeric_limits<double>::infinity();
}

/* Returns the determinant of the Jacobian at point q; G: derivatives of the shape functions with respect to X */
double GradientsAt(const Sampled &s, const double *X, int q, double *G)
{
  const double         *d = s.d + 3 * s.nodes * q;
  const Eigen::Matrix3d J = SumOfProducts(s.nodes, X, d); /* dX / dxi */
  Eigen::Matrix3d       inverse;
  double                det;
  bool                  invertible;
  J.computeInverseAndDetWithCheck(inverse, det, invertible, 0.);
  TransformEach(s.nodes, invertible ? Eigen::Matrix3d(inverse.transpose()) : Eigen::Matrix3d(Eigen::Matrix3d::Zero()), d, G);
  return det;
}

using NodeBlock = Eigen::Map<Eigen::Matrix3d, 0, Eigen::OuterStride<>>;
NodeBlock BlockOf(double *K, int n, int i, int j) { return NodeBlock(K + 3 * i + 9 * n * j, Eigen::OuterStride<>(3 * n)); }

/* Replaces the blocks H of K by B = lambda H + mu H^T plus what add(i, j, H, B) adds to B; exactly symmetric */
template <class Add> void BlocksFromProducts(int n, const Lame &lame, double *K, const Add &add)
{
  for (int j = 0; j < n; j++)
    for (int i = 0; i <= j; i++) {
      const Eigen::Matrix3d H = BlockOf(K, n, i, j);
      Eigen::Matrix3d       B = lame.lambda * H + lame.mu * H.transpose();
      add(i, j, H, B);
      if (i == j) B = (B + B.transpose().eval()) / 2;
      BlockOf(K, n, i, j) = B;
      BlockOf(K, n, j, i) = B.transpose();
    }
}

/*
  The strain energy is a sum over products of gradients: with H_ij = int g_i g_j^T the block of nodes i, j is
  lambda H_ij + mu H_ij^T + mu tr(H_ij) 1, so that the sum over points is one product of matrices.
*/
double StiffnessOf(const Sampled &s, const double *X, const Lame &lame, double *K)
{
  const int rows = 3 * s.nodes;
  double    scaled[3 * max_nodes * max_points], least = std::numeric_limits<double>::infinity();
  for (int q = 0; q < s.points; q++) {
    double      *G   = scaled + rows * q;
    const double det = GradientsAt(s, X, q, G), root = std::sqrt(std::max(det, 0.) * s.weight[q]);
    Lower(least, det);
    for (int i = 0; i < rows; i++) G[i] *= root;
  }
  OuterProduct(scaled, rows, s.points, K);
  BlocksFromProducts(s.nodes, lame, K, [&](int, int, const Eigen::Matrix3d &H, Eigen::Matrix3d &B) { B.diagonal().array() += lame.mu * H.trace(); });
  return least * InverseExtent(s.nodes, X);
}

double MassOf(const Sampled &s, const double *X, double density, double *m)
{
  const int n = s.nodes;
  double    scaled[max_nodes * max_points], least = std::numeric_limits<double>::infinity();
  for (int q = 0; q < s.points; q++) {
    const double det = SumOfProducts(n, X, s.d + 3 * n * q).determinant(), root = std::sqrt(std::max(det, 0.) * s.weight[q] * density);
    Lower(least, det);
    for (int i = 0; i < n; i++) scaled[n * q + i] = s.N[n * q + i] * root;
  }
  OuterProduct(scaled, n, s.points, m);
  for (int j = 0; j < n; j++) /* symmetric to the last digit */
    for (int i = 0; i < j; i++) m[j + n * i] = m[i + n * j];
  return least * InverseExtent(n, X);
}

} // namespace

template <class Shape> double InverseExtent(const NodeVectors<Shape> &X) { return InverseExtent(Shape::nodes, X.data()); }

template <class Shape> double SpatialGradients(const NodeVectors<Shape> &X, int q, Gradients<Shape::nodes> &G)
{
  return GradientsAt(ForStiffness<Shape>(), X.data(), q, G.data());
}

template <class Shape> double ElementStiffness(const NodeVectors<Shape> &X, const Lame &lame, Stiffness<Shape> &K)
{
  return StiffnessOf(ForStiffness<Shape>(), X.data(), lame, K.data());
}

template <class Shape> double ElementMass(const NodeVectors<Shape> &X, double density, Mass<Shape> &m, MassPoints points)
{
  return MassOf(points == MassPoints::Own ? ForMass<Shape>() : ForStiffness<Shape>(), X.data(), density, m.data());
}

/* ---- stress ---- */

/* The matrix that extrapolates stress from the points of StressRule to the nodes */
template <class Shape> static const Eigen::Matrix<double, Shape::StressRule::count, Shape::nodes> &Extrapolation()
{
  constexpr int                                n = Shape::nodes, count = Shape::StressRule::count;
  static const Eigen::Matrix<double, count, n> matrix = [] {
    Eigen::Matrix<double, count, n> E;
    for (int i = 0; i < n; i++) {
      const Point x = Shape::place(i);
      for (int q = 0; q < count; q++) {
        const Point at = Shape::StressRule::points().at[q];
        if (count == 1)
          E(q, i) = 1;
        else if (Shape::corners == 4) {
          /* the rule's points are the corners of the element, in the same order, shrunk towards its centre */
          const double shrunk = 1 - 4 * TetrahedronRule4::points().at[0][0];
          const Point  y      = Point::Constant(.25) + (x - Point::Constant(.25)) / shrunk;
          const double L[4]   = {1 - y.sum(), y[0], y[1], y[2]};
          E(q, i)             = L[q];
        } else
          E(q, i) = (Point::Ones() + 3 * x.cwiseProduct(at)).prod() / 8;
      }
    }
    return E;
  }();
  return matrix;
}

template <class Shape> StressAtNodes<Shape>::StressAtNodes(const NodeVectors<Shape> &X) : least_(std::numeric_limits<double>::infinity())
{
  for (int q = 0; q < count; q++) Lower(least_, GradientsAt(ForStress<Shape>(), X.data(), q, G_[q].data()));
  least_ *= InverseExtent<Shape>(X);
}

using Components = Eigen::Matrix<double, 6, 1>;

static Components SmallStress(const Eigen::Matrix3d &D, const Lame &lame)
{
  const double p = lame.lambda * D.trace();
  Components   s;
  s << p + 2 * lame.mu * D(0, 0), p + 2 * lame.mu * D(1, 1), p + 2 * lame.mu * D(2, 2), lame.mu * (D(0, 1) + D(1, 0)), lame.mu * (D(1, 2) + D(2, 1)), lame.mu * (D(2, 0) + D(0, 2));
  return s;
}

static Components CauchyStress(const Eigen::Matrix3d &D, const Lame &lame)
{
  const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + D, E = (D + D.transpose() + D.transpose() * D) / 2;
  const Eigen::Matrix3d s = F * (lame.lambda * E.trace() * Eigen::Matrix3d::Identity() + 2 * lame.mu * E) * F.transpose() / F.determinant();
  Components            c;
  c << s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(2, 0);
  return c;
}

/* Stress by `law` from the gradients du / dX at the points, extrapolated to the nodes */
template <class Shape, class Law> static void ExtrapolatedStress(const Gradients<Shape::nodes> *G, const NodeVectors<Shape> &u, const Lame &lame, const Law &law, NodeStress<Shape> &stress)
{
  const auto &to_nodes = Extrapolation<Shape>();
  stress.setZero();
  for (int q = 0; q < Shape::StressRule::count; q++) {
    const Components at = law(SumOfProducts(Shape::nodes, u.data(), G[q].data()), lame);
    for (int i = 0; i < Shape::nodes; i++) stress.col(i) += to_nodes(q, i) * at;
  }
}

template <class Shape> void StressAtNodes<Shape>::operator()(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const
{
  ExtrapolatedStress<Shape>(G_.data(), u, lame, SmallStress, stress);
}

template <class Shape> void StressAtNodes<Shape>::large(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const
{
  ExtrapolatedStress<Shape>(G_.data(), u, lame, CauchyStress, stress);
}

/* ---- large displacements ---- */

/*
  Block ij of the tangent is the integral of (g_i S g_j) 1 + lambda h_i h_j^T + mu h_j h_i^T + mu (g_i g_j) F F^T with h
  = F g: the products of h are one matrix product, as in StiffnessOf(); the other terms are six matrices of
  nodes by nodes, computed in the upper triangle.
*/
static double ForceAndTangent(const Sampled &s, const double *X, const double *u, const Lame &lame, double *force, double *tangent, double *energy)
{
  const int n = s.nodes, rows = 3 * n;
  double    scaled[3 * max_nodes * max_points], G[3 * max_nodes], moved[3 * max_nodes];
  double    axis[6][max_nodes];                  /* components of g_i, then of w S g_i */
  double    symmetric[6][max_nodes * max_nodes]; /* xx, yy, zz, xy, yz, zx */
  double    least = std::numeric_limits<double>::infinity();
  std::fill(force, force + rows, 0.);
  for (double *C : symmetric) std::fill(C, C + n * n, 0.);
  *energy = 0;
  for (int q = 0; q < s.points; q++) {
    const double det = GradientsAt(s, X, q, G), w = std::max(det, 0.) * s.weight[q];
    Lower(least, det);
    const Eigen::Matrix3d D = SumOfProducts(n, u, G), F = Eigen::Matrix3d::Identity() + D;
    /* equals (F^T F - 1) / 2, whose difference would lose the digits of small strains */
    const Eigen::Matrix3d E = (D + D.transpose() + D.transpose() * D) / 2;
    const Eigen::Matrix3d S = lame.lambda * E.trace() * Eigen::Matrix3d::Identity() + 2 * lame.mu * E, FF = w * lame.mu * F * F.transpose();
    *energy += w * (lame.lambda / 2 * E.trace() * E.trace() + lame.mu * E.squaredNorm());
    TransformEach(n, w * F * S, G, moved);
    for (int i = 0; i < rows; i++) force[i] += moved[i];
    TransformEach(n, std::sqrt(w) * F, G, scaled + rows * q);
    TransformEach(n, w * S, G, moved);
    for (int i = 0; i < n; i++)
      for (int c = 0; c < 3; c++) {
        axis[c][i]     = G[3 * i + c];
        axis[3 + c][i] = moved[3 * i + c];
      }
    for (int j = 0; j < n; j++)
      for (int i = 0; i <= j; i++) {
        const double gg = axis[0][i] * axis[0][j] + axis[1][i] * axis[1][j] + axis[2][i] * axis[2][j];
        const double gSg = axis[0][i] * axis[3][j] + axis[1][i] * axis[4][j] + axis[2][i] * axis[5][j];
        for (int d = 0; d < 3; d++) {
          symmetric[d][i + n * j] += FF(d, d) * gg + gSg;
          symmetric[3 + d][i + n * j] += FF(d, (d + 1) % 3) * gg;
        }
      }
  }
  OuterProduct(scaled, rows, s.points, tangent);
  BlocksFromProducts(n, lame, tangent, [&](int i, int j, const Eigen::Matrix3d &, Eigen::Matrix3d &B) {
    for (int d = 0; d < 3; d++) {
      const int e = (d + 1) % 3;
      B(d, d) += symmetric[d][i + n * j];
      B(d, e) += symmetric[3 + d][i + n * j];
      B(e, d) += symmetric[3 + d][i + n * j];
    }
  });
  return least;
}

template <class Shape>
double LargeForce(const NodeVectors<Shape> &X, const NodeVectors<Shape> &u, const Lame &lame, NodeVectors<Shape> &force,
                  Stiffness<Shape> *tangent, double *energy)
{
  double       W;
  const double least = tangent ? ForceAndTangent(ForStiffness<Shape>(), X.data(), u.data(), lame, force.data(), tangent->data(), &W) :
                                 InternalForce<Shape>(X.data(), u.data(), lame.lambda, lame.mu, force.data(), &W);
  if (energy) *energy = W;
  return least * InverseExtent<Shape>(X);
}

#define HHTDAE_KERNELS_OF(Shape) \
  template double InverseExtent<Shape>(const NodeVectors<Shape> &); \
  template double SpatialGradients<Shape>(const NodeVectors<Shape> &, int, Gradients<Shape::nodes> &); \
  template double ElementStiffness<Shape>(const NodeVectors<Shape> &, const Lame &, Stiffness<Shape> &); \
  template double ElementMass<Shape>(const NodeVectors<Shape> &, double, Mass<Shape> &, MassPoints); \
  template class StressAtNodes<Shape>; \
  template double LargeForce<Shape>(const NodeVectors<Shape> &, const NodeVectors<Shape> &, const Lame &, NodeVectors<Shape> &, Stiffness<Shape> *, double *);
HHTDAE_KERNELS_OF(Tetrahedron4)
HHTDAE_KERNELS_OF(Tetrahedron10)
HHTDAE_KERNELS_OF(Brick8)
HHTDAE_KERNELS_OF(Brick20)

} // namespace fe
} // namespace hhtdae
