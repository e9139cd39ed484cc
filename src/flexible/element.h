/*
  Element kernels of fixed size: stiffness, consistent mass, stress at nodes, and for large displacements the internal
  force of a St. Venant-Kirchhoff material with its tangent stiffness, total Lagrangian.

  Matrices have the unknowns x, y, z of node 0, of node 1 and so on. Every kernel returns the smallest determinant of
  the Jacobian at its points, multiplied by InverseExtent() to be dimensionless; its results are valid only if this is
  above `degenerate`. The kernels are instantiated for the four shapes in element.cpp only.
*/
#ifndef HHTDAE_FLEXIBLE_ELEMENT_H
#define HHTDAE_FLEXIBLE_ELEMENT_H

#include "flexible/element_shapes.h"
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

/* With a smaller dimensionless determinant the element's volume is rounding; an aspect ratio of 1e6 is still well above */
constexpr double degenerate = 1e-14;

template <class Shape> using NodeVectors = Eigen::Matrix<double, 3, Shape::nodes>;
template <class Shape> using Stiffness   = Eigen::Matrix<double, 3 * Shape::nodes, 3 * Shape::nodes>;
template <class Shape> using Mass        = Eigen::Matrix<double, Shape::nodes, Shape::nodes>;
template <class Shape> using NodeStress  = Eigen::Matrix<double, 6, Shape::nodes>;

/* Shape functions and their derivatives by natural coordinates at the points of a rule, computed once */
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

/* 1 / l^3, where l is the longest edge of the element's bounding box */
template <class Shape> double InverseExtent(const NodeVectors<Shape> &X);

/* least = min(least, value); NaN is kept */
inline void Lower(double &least, double value)
{
  if (!(value >= least)) least = value;
}

/* Returns the determinant of the Jacobian at point q of the stiffness' rule; G: derivatives of the shape functions with respect to X */
template <class Shape> double SpatialGradients(const NodeVectors<Shape> &X, int q, Gradients<Shape::nodes> &G);

/* Symmetric to the last digit */
template <class Shape> double ElementStiffness(const NodeVectors<Shape> &X, const Lame &lame, Stiffness<Shape> &K);

/* m_ij: the mass matrix has the blocks m_ij times the identity. Integrated at points that are exact for straight edges, or at those of the stiffness. */
enum class MassPoints { Own, Stiffness };
template <class Shape> double ElementMass(const NodeVectors<Shape> &X, double density, Mass<Shape> &m, MassPoints points = MassPoints::Own);

/*
  Stress at the nodes for many displacement fields of one element. It is extrapolated from the points where strains of the
  element are most accurate (Barlow points): the centre of a linear tetrahedron, the four points of a quadratic one, the
  2 x 2 x 2 points of bricks. Strains evaluated at the nodes contain parasitic parts, which vanish at these
  points (a linear brick in bending, a quadratic one with curved edges). For elements with straight edges (bricks:
  parallelepipeds) and linear strains both agree.
*/
template <class Shape> class StressAtNodes
{
public:
  static constexpr int count = Shape::StressRule::count;

  explicit StressAtNodes(const NodeVectors<Shape> &X);
  double least() const { return least_; }

  /* Components xx, yy, zz, xy, yz, zx for small strains */
  void operator()(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const;

  /* For large displacements: Cauchy stress F S F^T / det F of a St. Venant-Kirchhoff material */
  void large(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const;

private:
  std::array<Gradients<Shape::nodes>, count> G_;
  double                                     least_;
};

/*
  St. Venant-Kirchhoff, total Lagrangian: E = (F^T F - 1) / 2, S = lambda tr(E) 1 + 2 mu E, the energy
  (lambda tr(E)^2 / 2 + mu E:E) integrated over the undeformed element at the stiffness' points. u: displacements from
  X; the force is the derivative of the energy, the tangent (unless null) that of the force. At u = 0 the tangent is
  ElementStiffness().
*/
template <class Shape>
double LargeForce(const NodeVectors<Shape> &X, const NodeVectors<Shape> &u, const Lame &lame, NodeVectors<Shape> &force,
                  Stiffness<Shape> *tangent = nullptr, double *energy = nullptr);

} // namespace fe
} // namespace hhtdae

#endif
