/* The element kernels of element.h, for the four shapes */
#include "flexible/element.h"
#include "flexible/element_points.h"
#include <Eigen/LU>
#include <cmath>

namespace hhtdae
{
namespace fe
{

/* A A^T, n x n: a product whose sizes are known at run time, so that it is compiled once for all shapes and rules */
static void OuterProduct(const double *A, int n, int columns, double *out)
{
  const Eigen::Map<const Eigen::MatrixXd> a(A, n, columns);
  Eigen::Map<Eigen::MatrixXd>(out, n, n).noalias() = a * a.transpose();
}

template <class Shape> double InverseExtent(const NodeVectors<Shape> &X)
{
  const double l = (X.rowwise().maxCoeff() - X.rowwise().minCoeff()).maxCoeff();
  return l > 0 ? 1 / (l * l * l) : std::numeric_limits<double>::infinity();
}

/* Determinant of the Jacobian at point q of a rule and derivatives with respect to X */
template <class Shape, class Rule> static double GradientsAt(const NodeVectors<Shape> &X, int q, Gradients<Shape::nodes> &G)
{
  const auto           &d = Table<Shape, Rule>::get().d[q];
  const Eigen::Matrix3d J = X * d.transpose(); /* dX / dxi */
  Eigen::Matrix3d       inverse;
  double                det;
  bool                  invertible;
  J.computeInverseAndDetWithCheck(inverse, det, invertible, 0.);
  if (invertible)
    G.noalias() = inverse.transpose() * d;
  else
    G.setZero();
  return det;
}

template <class Shape> double SpatialGradients(const NodeVectors<Shape> &X, int q, Gradients<Shape::nodes> &G)
{
  return GradientsAt<Shape, typename Shape::StiffnessRule>(X, q, G);
}

/*
  The strain energy is a sum over products of gradients: with H_ij = int g_i g_j^T the block of nodes i, j is
  lambda H_ij + mu H_ij^T + mu tr(H_ij) 1, so that the sum over points is one product of matrices.
*/
template <class Shape> double ElementStiffness(const NodeVectors<Shape> &X, const Lame &lame, Stiffness<Shape> &K)
{
  using Rule                                      = typename Shape::StiffnessRule;
  constexpr int                             n     = Shape::nodes;
  const auto                               &table = Table<Shape, Rule>::get();
  Eigen::Matrix<double, 3 * n, Rule::count> all;
  double                                    least = std::numeric_limits<double>::infinity();
  for (int q = 0; q < Rule::count; q++) {
    Gradients<n> G;
    const double det = GradientsAt<Shape, Rule>(X, q, G);
    Lower(least, det);
    G *= std::sqrt(std::max(det, 0.) * table.points.weight[q]);
    all.col(q) = Eigen::Map<const Eigen::Matrix<double, 3 * n, 1>>(G.data());
  }
  OuterProduct(all.data(), 3 * n, Rule::count, K.data());
  for (int j = 0; j < n; j++)
    for (int i = 0; i <= j; i++) {
      const Eigen::Matrix3d H = K.template block<3, 3>(3 * i, 3 * j);
      Eigen::Matrix3d       B = lame.lambda * H + lame.mu * H.transpose();
      B.diagonal().array() += lame.mu * H.trace();
      if (i == j) B = (B + B.transpose().eval()) / 2; /* symmetric to the last digit */
      K.template block<3, 3>(3 * i, 3 * j) = B;
      K.template block<3, 3>(3 * j, 3 * i) = B.transpose();
    }
  return least * InverseExtent<Shape>(X);
}

template <class Shape, class Rule> static double MassAt(const NodeVectors<Shape> &X, double density, Mass<Shape> &m)
{
  constexpr int                         n     = Shape::nodes;
  const auto                           &table = Table<Shape, Rule>::get();
  Eigen::Matrix<double, n, Rule::count> all;
  double                                least = std::numeric_limits<double>::infinity();
  for (int q = 0; q < Rule::count; q++) {
    const Eigen::Matrix3d J   = X * table.d[q].transpose();
    const double          det = J.determinant();
    Lower(least, det);
    all.col(q) = table.N[q] * std::sqrt(std::max(det, 0.) * table.points.weight[q] * density);
  }
  OuterProduct(all.data(), n, Rule::count, m.data());
  m.template triangularView<Eigen::StrictlyLower>() = m.transpose(); /* to the last digit */
  return least * InverseExtent<Shape>(X);
}

template <class Shape> double ElementMass(const NodeVectors<Shape> &X, double density, Mass<Shape> &m, MassPoints points)
{
  return points == MassPoints::Own ? MassAt<Shape, typename Shape::MassRule>(X, density, m) : MassAt<Shape, typename Shape::StiffnessRule>(X, density, m);
}

/* ---- stress ---- */

/* From the points where stress is sampled to the nodes */
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
          /* the rule's points are a tetrahedron in the order of the element's corners, about the centre, shrunk */
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
  for (int q = 0; q < count; q++) Lower(least_, GradientsAt<Shape, typename Shape::StressRule>(X, q, G_[q]));
  least_ *= InverseExtent<Shape>(X);
}

template <class Shape> void StressAtNodes<Shape>::operator()(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const
{
  Eigen::Matrix<double, 6, count> at;
  for (int q = 0; q < count; q++) {
    const Eigen::Matrix3d D = u * G_[q].transpose(); /* du / dX */
    const double          p = lame.lambda * D.trace();
    at.col(q) << p + 2 * lame.mu * D(0, 0), p + 2 * lame.mu * D(1, 1), p + 2 * lame.mu * D(2, 2),
        lame.mu * (D(0, 1) + D(1, 0)), lame.mu * (D(1, 2) + D(2, 1)), lame.mu * (D(2, 0) + D(0, 2));
  }
  stress.noalias() = at * Extrapolation<Shape>();
}

template <class Shape> void StressAtNodes<Shape>::large(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const
{
  Eigen::Matrix<double, 6, count> at;
  for (int q = 0; q < count; q++) {
    const Eigen::Matrix3d D = u * G_[q].transpose(), F = Eigen::Matrix3d::Identity() + D, E = (D + D.transpose() + D.transpose() * D) / 2;
    const Eigen::Matrix3d s = F * (lame.lambda * E.trace() * Eigen::Matrix3d::Identity() + 2 * lame.mu * E) * F.transpose() / F.determinant();
    at.col(q) << s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(2, 0);
  }
  stress.noalias() = at * Extrapolation<Shape>();
}

/* ---- large displacements ---- */

/*
  Block ij of the tangent is the integral of (g_i S g_j) 1 + lambda h_i h_j^T + mu h_j h_i^T + mu (g_i g_j) F F^T with h
  = F g: the products of h come from one product of matrices, as in ElementStiffness, the others are six matrices of
  nodes by nodes.
*/
template <class Shape>
double LargeForce(const NodeVectors<Shape> &X, const NodeVectors<Shape> &u, const Lame &lame, NodeVectors<Shape> &force,
                  Stiffness<Shape> *tangent, double *energy)
{
  using Rule                                      = typename Shape::StiffnessRule;
  constexpr int                             n     = Shape::nodes;
  const auto                               &table = Table<Shape, Rule>::get();
  double                                    least = std::numeric_limits<double>::infinity();
  if (!tangent) {
    double W;
    least = InternalForce<Shape>(X.data(), u.data(), lame.lambda, lame.mu, force.data(), &W);
    if (energy) *energy = W;
    return least * InverseExtent<Shape>(X);
  }
  Eigen::Matrix<double, 3 * n, Rule::count> all;
  std::array<Mass<Shape>, 6>                symmetric; /* xx, yy, zz, xy, yz, zx */
  force.setZero();
  if (energy) *energy = 0;
  for (Mass<Shape> &C : symmetric) C.setZero();
  for (int q = 0; q < Rule::count; q++) {
    Gradients<n> G;
    const double det = GradientsAt<Shape, Rule>(X, q, G), w = std::max(det, 0.) * table.points.weight[q];
    Lower(least, det);
    const Eigen::Matrix3d D = u * G.transpose(), F = Eigen::Matrix3d::Identity() + D;
    /* not the difference of F^T F and 1, which would lose the digits of small strains */
    const Eigen::Matrix3d E = (D + D.transpose() + D.transpose() * D) / 2;
    const Eigen::Matrix3d S = lame.lambda * E.trace() * Eigen::Matrix3d::Identity() + 2 * lame.mu * E;
    const Eigen::Matrix3d P = w * F * S;
    force.noalias() += P * G;
    if (energy) *energy += w * (lame.lambda / 2 * E.trace() * E.trace() + lame.mu * E.squaredNorm());
    const Gradients<n> h = std::sqrt(w) * F * G, SG = w * S * G;
    all.col(q)               = Eigen::Map<const Eigen::Matrix<double, 3 * n, 1>>(h.data());
    const Eigen::Matrix3d FF = w * lame.mu * F * F.transpose();
    const Mass<Shape>     GG = G.transpose() * G, GSG = G.transpose() * SG;
    for (int d = 0; d < 3; d++) {
      symmetric[d] += FF(d, d) * GG + GSG;
      symmetric[3 + d] += FF(d, (d + 1) % 3) * GG;
    }
  }
  OuterProduct(all.data(), 3 * n, Rule::count, tangent->data());
  for (int j = 0; j < n; j++)
    for (int i = 0; i <= j; i++) {
      const Eigen::Matrix3d H = tangent->template block<3, 3>(3 * i, 3 * j);
      Eigen::Matrix3d       B = lame.lambda * H + lame.mu * H.transpose();
      for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3;
        B(d, d) += symmetric[d](i, j);
        B(d, e) += symmetric[3 + d](i, j);
        B(e, d) += symmetric[3 + d](i, j);
      }
      if (i == j) B = (B + B.transpose().eval()) / 2;
      tangent->template block<3, 3>(3 * i, 3 * j) = B;
      tangent->template block<3, 3>(3 * j, 3 * i) = B.transpose();
    }
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
