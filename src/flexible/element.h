/*
  Element kernels of fixed size: stiffness, consistent mass, stress at nodes, and for large displacements the internal
  force of a St. Venant-Kirchhoff material with its tangent stiffness, total Lagrangian.

  Matrices have the unknowns x, y, z of node 0, of node 1 and so on. Every kernel returns the smallest determinant of
  the Jacobian at its points, made dimensionless by the element's extent (ScaledDeterminant); what it has computed is of
  use if this is above `degenerate` only.
*/
#ifndef HHTDAE_FLEXIBLE_ELEMENT_H
#define HHTDAE_FLEXIBLE_ELEMENT_H

#include "flexible/element_points.h"
#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace hhtdae
{
namespace fe
{

struct Lame {
  double lambda, mu;
  explicit Lame(const Material &m)
      : lambda(m.young * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson))), mu(m.young / (2 * (1 + m.poisson)))
  {
  }
};

/* Below this the element has no volume but for rounding; an aspect ratio of 1e6 is still well above */
constexpr double degenerate = 1e-14;

template <class Shape> using NodeVectors = Eigen::Matrix<double, 3, Shape::nodes>;
template <class Shape> using Stiffness   = Eigen::Matrix<double, 3 * Shape::nodes, 3 * Shape::nodes>;
template <class Shape> using Mass        = Eigen::Matrix<double, Shape::nodes, Shape::nodes>;
template <class Shape> using NodeStress  = Eigen::Matrix<double, 6, Shape::nodes>;

/* Shape functions and natural derivatives at the points of a rule, computed once */
template <class Shape, class Rule> struct Table {
  Points<Rule::count>                              points = Rule::points();
  std::array<Values<Shape::nodes>, Rule::count>    N;
  std::array<Gradients<Shape::nodes>, Rule::count> d;

  static const Table &get()
  {
    static const Table table;
    return table;
  }

private:
  Table()
  {
    for (int q = 0; q < Rule::count; q++) {
      Shape::shape(points.at[q], N[q]);
      Shape::gradient(points.at[q], d[q]);
    }
  }
};

/* 1 / volume of the box around the element */
template <class Shape> double InverseExtent(const NodeVectors<Shape> &X)
{
  const double l = (X.rowwise().maxCoeff() - X.rowwise().minCoeff()).maxCoeff();
  return l > 0 ? 1 / (l * l * l) : std::numeric_limits<double>::infinity();
}

/* Keeps the smaller, and a value that is no number */
inline void Lower(double &least, double value)
{
  if (!(value >= least)) least = value;
}

/* Determinant of the Jacobian at point q and derivatives with respect to X */
template <class Shape, class Rule>
double SpatialGradients(const NodeVectors<Shape> &X, int q, Gradients<Shape::nodes> &G)
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
    const double det = SpatialGradients<Shape, Rule>(X, q, G);
    Lower(least, det);
    G *= std::sqrt(std::max(det, 0.) * table.points.weight[q]);
    all.col(q) = Eigen::Map<const Eigen::Matrix<double, 3 * n, 1>>(G.data());
  }
  K.noalias() = all * all.transpose();
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

/* m_ij: the mass matrix has the blocks m_ij 1 */
template <class Shape, class Rule = typename Shape::MassRule>
double ElementMass(const NodeVectors<Shape> &X, double density, Mass<Shape> &m)
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
  m.noalias()                                       = all * all.transpose();
  m.template triangularView<Eigen::StrictlyLower>() = m.transpose(); /* to the last digit */
  return least * InverseExtent<Shape>(X);
}

/* ---- stress ---- */

/*
  Stress at nodes is extrapolated from the points where strains of the element are most accurate (Barlow's): the centre
  of a linear tetrahedron, the four points of a quadratic one, the 2 x 2 x 2 points of bricks. Strains taken at the
  nodes themselves carry the parasitic parts, which vanish at these points (a linear brick in bending, a quadratic one
  with curved edges). For elements with straight edges (bricks: parallelepipeds) and strains that are linear both give
  the same.
*/
template <class Shape> const Eigen::Matrix<double, Shape::StressRule::count, Shape::nodes> &Extrapolation()
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

/* Stress at the nodes for many displacements of one element; strains are small */
template <class Shape> class StressAtNodes
{
public:
  static constexpr int count = Shape::StressRule::count;

  explicit StressAtNodes(const NodeVectors<Shape> &X)
  {
    least_ = std::numeric_limits<double>::infinity();
    for (int q = 0; q < count; q++) Lower(least_, SpatialGradients<Shape, typename Shape::StressRule>(X, q, G_[q]));
    least_ *= InverseExtent<Shape>(X);
  }
  double least() const { return least_; }

  /* Components xx, yy, zz, xy, yz, zx */
  void operator()(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const
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

  /* The same at large: Cauchy's stress F S F^T / det F of a St. Venant-Kirchhoff material */
  void large(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const
  {
    Eigen::Matrix<double, 6, count> at;
    for (int q = 0; q < count; q++) {
      const Eigen::Matrix3d D = u * G_[q].transpose(), F = Eigen::Matrix3d::Identity() + D, E = (D + D.transpose() + D.transpose() * D) / 2;
      const Eigen::Matrix3d s = F * (lame.lambda * E.trace() * Eigen::Matrix3d::Identity() + 2 * lame.mu * E) * F.transpose() / F.determinant();
      at.col(q) << s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(2, 0);
    }
    stress.noalias() = at * Extrapolation<Shape>();
  }

private:
  std::array<Gradients<Shape::nodes>, count> G_;
  double                                     least_;
};

/* ---- large displacements ---- */

/*
  St. Venant-Kirchhoff, total Lagrangian: E = (F^T F - 1) / 2, S = lambda tr(E) 1 + 2 mu E, the energy
  (lambda tr(E)^2 / 2 + mu E:E) integrated over the undeformed element at the stiffness' points. u: displacements from
  X; the force is the derivative of the energy, the tangent (where asked for) that of the force. At u = 0 the tangent is
  ElementStiffness.

  Block ij of the tangent is the integral of (g_i S g_j) 1 + lambda h_i h_j^T + mu h_j h_i^T + mu (g_i g_j) F F^T with h
  = F g: the products of h come from one product of matrices, as in ElementStiffness, the others are six matrices of
  nodes by nodes.
*/
template <class Shape>
double LargeForce(const NodeVectors<Shape> &X, const NodeVectors<Shape> &u, const Lame &lame, NodeVectors<Shape> &force,
                  Stiffness<Shape> *tangent = nullptr, double *energy = nullptr)
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
    const double det = SpatialGradients<Shape, Rule>(X, q, G), w = std::max(det, 0.) * table.points.weight[q];
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
  tangent->noalias() = all * all.transpose();
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

} // namespace fe
} // namespace hhtdae

#endif
