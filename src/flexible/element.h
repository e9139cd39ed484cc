/*
  Element kernels of fixed size: stiffness, consistent mass, stress at nodes, and for large displacements the internal
  force of a St. Venant-Kirchhoff material with its tangent stiffness, total Lagrangian.

  Matrices have the unknowns x, y, z of node 0, of node 1 and so on. Every kernel returns the smallest determinant of
  the Jacobian at its points, made dimensionless by the element's extent (ScaledDeterminant); what it has computed is of
  use if this is above `degenerate` only. They are compiled for the four shapes in element.cpp, and nowhere else.
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
template <class Shape> double InverseExtent(const NodeVectors<Shape> &X);

/* Keeps the smaller, and a value that is no number */
inline void Lower(double &least, double value)
{
  if (!(value >= least)) least = value;
}

/* Determinant of the Jacobian at point q of the stiffness' rule and derivatives with respect to X */
template <class Shape> double SpatialGradients(const NodeVectors<Shape> &X, int q, Gradients<Shape::nodes> &G);

/* Symmetric to the last digit */
template <class Shape> double ElementStiffness(const NodeVectors<Shape> &X, const Lame &lame, Stiffness<Shape> &K);

/* m_ij: the mass matrix has the blocks m_ij 1. By default at points that are exact for straight edges, else at those of the stiffness. */
enum class MassPoints { Own, Stiffness };
template <class Shape> double ElementMass(const NodeVectors<Shape> &X, double density, Mass<Shape> &m, MassPoints points = MassPoints::Own);

/*
  Stress at the nodes for many displacements of one element. It is extrapolated from the points where strains of the
  element are most accurate (Barlow's): the centre of a linear tetrahedron, the four points of a quadratic one, the
  2 x 2 x 2 points of bricks. Strains taken at the nodes themselves carry the parasitic parts, which vanish at these
  points (a linear brick in bending, a quadratic one with curved edges). For elements with straight edges (bricks:
  parallelepipeds) and strains that are linear both give the same.
*/
template <class Shape> class StressAtNodes
{
public:
  static constexpr int count = Shape::StressRule::count;

  explicit StressAtNodes(const NodeVectors<Shape> &X);
  double least() const { return least_; }

  /* Components xx, yy, zz, xy, yz, zx; strains are small */
  void operator()(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const;

  /* The same at large: Cauchy's stress F S F^T / det F of a St. Venant-Kirchhoff material */
  void large(const NodeVectors<Shape> &u, const Lame &lame, NodeStress<Shape> &stress) const;

private:
  std::array<Gradients<Shape::nodes>, count> G_;
  double                                     least_;
};

/*
  St. Venant-Kirchhoff, total Lagrangian: E = (F^T F - 1) / 2, S = lambda tr(E) 1 + 2 mu E, the energy
  (lambda tr(E)^2 / 2 + mu E:E) integrated over the undeformed element at the stiffness' points. u: displacements from
  X; the force is the derivative of the energy, the tangent (where asked for) that of the force. At u = 0 the tangent is
  ElementStiffness.
*/
template <class Shape>
double LargeForce(const NodeVectors<Shape> &X, const NodeVectors<Shape> &u, const Lame &lame, NodeVectors<Shape> &force,
                  Stiffness<Shape> *tangent = nullptr, double *energy = nullptr);

} // namespace fe
} // namespace hhtdae

#endif
