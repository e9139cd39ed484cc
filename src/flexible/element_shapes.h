/*
  Shape functions and integration points of the four solid elements. A shape is a struct of constants and functions:

    nodes, corners      numbers of nodes and corners
    shape, gradient     shape functions and their derivatives at natural coordinates
    place(i)            natural coordinates of node i
    StiffnessRule       integration points of the stiffness: one for a linear tetrahedron, four for a quadratic one,
                        2 x 2 x 2 and 3 x 3 x 3 for bricks (full integration, as CalculiX' C3D4, C3D10, C3D8, C3D20)
    MassRule            points that integrate the mass of every element with straight edges exactly; for tetrahedra with
                        curved edges total mass and first moments are exact as well
    StressRule          points from which stress is extrapolated to the nodes; see element.h

  Nodes are in the order of Gmsh. Abaqus and CalculiX exchange the last two nodes of the quadratic tetrahedron, and order
  the twelve middle nodes of the quadratic brick as: around the bottom, around the top, vertical edges.
*/
#ifndef HHTDAE_FLEXIBLE_ELEMENT_SHAPES_H
#define HHTDAE_FLEXIBLE_ELEMENT_SHAPES_H

#include "hhtdae/flexible.h"
#include "scene/small_matrix.h"
#include <Eigen/Core>
#include <array>

namespace hhtdae
{
namespace fe
{

using Point = Eigen::Vector3d;

template <int count> struct Points {
  std::array<Point, count>  at;
  std::array<double, count> weight;
};

/* ---- integration points ---- */

struct TetrahedronRule1 {
  static constexpr int count = 1;
  static Points<count> points() { return {{Point(.25, .25, .25)}, {1. / 6}}; }
};

namespace detail
{
/* The points with the barycentric coordinates (a, b, b, b) */
inline void Orbit4(double b, double w, Point *at, double *weight)
{
  const double a = 1 - 3 * b;
  at[0] = {b, b, b}, at[1] = {a, b, b}, at[2] = {b, a, b}, at[3] = {b, b, a};
  for (int i = 0; i < 4; i++) weight[i] = w;
}
/* The points with the barycentric coordinates (a, a, b, b) */
inline void Orbit6(double a, double w, Point *at, double *weight)
{
  const double b = .5 - a;
  at[0] = {a, a, b}, at[1] = {a, b, a}, at[2] = {b, a, a}, at[3] = {a, b, b}, at[4] = {b, a, b}, at[5] = {b, b, a};
  for (int i = 0; i < 6; i++) weight[i] = w;
}
} // namespace detail

struct TetrahedronRule4 { /* degree 2; point i is nearest to corner i of the element */
  static constexpr int count = 4;
  static Points<count> points()
  {
    Points<count> p;
    detail::Orbit4((5 - std::sqrt(5.)) / 20, 1. / 24, p.at.data(), p.weight.data());
    return p;
  }
};

struct TetrahedronRule15 { /* degree 5, all weights positive (Keast 1986, in closed form Stroud 1971, T3:5-1) */
  static constexpr int count = 15;
  static Points<count> points()
  {
    Points<count> p;
    const double  s = std::sqrt(15.);
    p.at[0]         = {.25, .25, .25};
    p.weight[0]     = 16. / 135 / 6;
    detail::Orbit4((7 - s) / 34, (2665 + 14 * s) / 37800 / 6, &p.at[1], &p.weight[1]);
    detail::Orbit4((7 + s) / 34, (2665 - 14 * s) / 37800 / 6, &p.at[5], &p.weight[5]);
    detail::Orbit6((10 - 2 * s) / 40, 10. / 189 / 6, &p.at[9], &p.weight[9]);
    return p;
  }
};

template <int n> struct BrickRule { /* Gauss, n points in every direction */
  static constexpr int count = n * n * n;
  static Points<count> points()
  {
    static_assert(n >= 2 && n <= 4, "two to four points");
    double x[4] = {0}, w[4] = {0};
    if (n == 2) x[0] = -1 / std::sqrt(3.), w[0] = 1;
    if (n == 3) x[0] = -std::sqrt(.6), w[0] = 5. / 9, w[1] = 8. / 9;
    if (n == 4) {
      const double s = 2 * std::sqrt(1.2);
      x[0] = -std::sqrt((3 + s) / 7), w[0] = (18 - std::sqrt(30.)) / 36;
      x[1] = -std::sqrt((3 - s) / 7), w[1] = (18 + std::sqrt(30.)) / 36;
    }
    for (int i = 0; i < n / 2; i++) x[n - 1 - i] = -x[i], w[n - 1 - i] = w[i];
    Points<count> p;
    for (int i = 0, q = 0; i < n; i++)
      for (int j = 0; j < n; j++)
        for (int k = 0; k < n; k++, q++) p.at[q] = {x[k], x[j], x[i]}, p.weight[q] = w[i] * w[j] * w[k];
    return p;
  }
};

/* ---- shapes ---- */

template <int n> using Values    = Eigen::Matrix<double, n, 1>;
template <int n> using Gradients = Eigen::Matrix<double, 3, n>;

struct Tetrahedron {
  static constexpr int corners    = 4;
  static constexpr int faces      = 4;
  static constexpr int perface    = 3;
  static constexpr int face[4][4] = {{0, 2, 1, -1}, {0, 1, 3, -1}, {1, 2, 3, -1}, {0, 3, 2, -1}};
  static constexpr int edge[6][2] = {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {2, 3}, {1, 3}};
  static Point         corner(int i) { return i ? Point(Point::Unit(i - 1)) : Point(Point::Zero()); }
  static void          linear(const Point &x, Values<4> &L, Gradients<4> &d)
  {
    L << 1 - x.sum(), x;
    d << -Point::Ones(), Eigen::Matrix3d::Identity();
  }
};

struct Brick {
  static constexpr int corners     = 8;
  static constexpr int faces       = 6;
  static constexpr int perface     = 4;
  static constexpr int face[6][4]  = {{0, 3, 2, 1}, {0, 1, 5, 4}, {0, 4, 7, 3},
                                      {1, 2, 6, 5}, {2, 3, 7, 6}, {4, 5, 6, 7}};
  static constexpr int edge[12][2] = {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3},
                                      {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}};
  static Point         corner(int i) { return {((i + 1) & 2) ? 1. : -1., (i & 2) ? 1. : -1., (i & 4) ? 1. : -1.}; }
};

struct Tetrahedron4 : Tetrahedron {
  static constexpr ElementType type  = ElementType::Tetrahedron4;
  static constexpr int         nodes = 4;
  using StiffnessRule                = TetrahedronRule1;
  using MassRule                     = TetrahedronRule4;
  using StressRule                   = TetrahedronRule1;
  static Point place(int i) { return corner(i); }
  static void  shape(const Point &x, Values<nodes> &N)
  {
    Gradients<4> d;
    linear(x, N, d);
  }
  static void gradient(const Point &x, Gradients<nodes> &d)
  {
    Values<4> N;
    linear(x, N, d);
  }
};

struct Tetrahedron10 : Tetrahedron {
  static constexpr ElementType type  = ElementType::Tetrahedron10;
  static constexpr int         nodes = 10;
  using StiffnessRule                = TetrahedronRule4;
  using MassRule                     = TetrahedronRule15;
  using StressRule                   = TetrahedronRule4;
  static Point place(int i) { return i < 4 ? corner(i) : Point((corner(edge[i - 4][0]) + corner(edge[i - 4][1])) / 2); }
  static void  shape(const Point &x, Values<nodes> &N)
  {
    Values<4>    L;
    Gradients<4> d;
    linear(x, L, d);
    for (int i = 0; i < 4; i++) N[i] = L[i] * (2 * L[i] - 1);
    for (int e = 0; e < 6; e++) N[4 + e] = 4 * L[edge[e][0]] * L[edge[e][1]];
  }
  static void gradient(const Point &x, Gradients<nodes> &g)
  {
    Values<4>    L;
    Gradients<4> d;
    linear(x, L, d);
    for (int i = 0; i < 4; i++) g.col(i) = (4 * L[i] - 1) * d.col(i);
    for (int e = 0; e < 6; e++)
      g.col(4 + e) = 4 * (L[edge[e][0]] * d.col(edge[e][1]) + L[edge[e][1]] * d.col(edge[e][0]));
  }
};

struct Brick8 : Brick {
  static constexpr ElementType type  = ElementType::Brick8;
  static constexpr int         nodes = 8;
  using StiffnessRule                = BrickRule<2>;
  using MassRule                     = BrickRule<3>;
  using StressRule                   = BrickRule<2>;
  static Point place(int i) { return corner(i); }
  static void  shape(const Point &x, Values<nodes> &N)
  {
    for (int i = 0; i < nodes; i++) {
      const Point a = Point::Ones() + x.cwiseProduct(corner(i));
      N[i]          = a.prod() / 8;
    }
  }
  static void gradient(const Point &x, Gradients<nodes> &d)
  {
    for (int i = 0; i < nodes; i++) {
      const Point c = corner(i), a = Point::Ones() + x.cwiseProduct(c);
      d.col(i) << c[0] * a[1] * a[2] / 8, c[1] * a[0] * a[2] / 8, c[2] * a[0] * a[1] / 8;
    }
  }
};

struct Brick20 : Brick { /* serendipity */
  static constexpr ElementType type  = ElementType::Brick20;
  static constexpr int         nodes = 20;
  using StiffnessRule                = BrickRule<3>;
  using MassRule                     = BrickRule<4>;
  using StressRule                   = BrickRule<2>;
  static Point place(int i) { return i < 8 ? corner(i) : Point((corner(edge[i - 8][0]) + corner(edge[i - 8][1])) / 2); }
  /* The direction k of an edge with middle node c; its shape function is (1 - x_k^2) times linear in the two others */
  static int  along(const Point &c) { return c[0] == 0 ? 0 : c[1] == 0 ? 1 : 2; }
  static void shape(const Point &x, Values<nodes> &N)
  {
    for (int i = 0; i < nodes; i++) {
      const Point c = place(i);
      Point       a = Point::Ones() + x.cwiseProduct(c);
      if (i < 8) {
        N[i] = a.prod() * (x.dot(c) - 2) / 8;
        continue;
      }
      const int k = along(c);
      a[k]        = 1 - x[k] * x[k];
      N[i]        = a.prod() / 4;
    }
  }
  static void gradient(const Point &x, Gradients<nodes> &d)
  {
    for (int i = 0; i < nodes; i++) {
      const Point c = place(i);
      Point       a = Point::Ones() + x.cwiseProduct(c), da = c;
      double      s = 1. / 8, f = x.dot(c) - 2; /* N = s f a_0 a_1 a_2 */
      if (i >= 8) {
        const int k = along(c);
        a[k] = 1 - x[k] * x[k], da[k] = -2 * x[k];
        s = 1. / 4, f = 1;
      }
      for (int k = 0; k < 3; k++) {
        const double others = a[(k + 1) % 3] * a[(k + 2) % 3];
        d(k, i)             = s * (f * da[k] * others + (i < 8 ? c[k] * a.prod() : 0));
      }
    }
  }
};

/* Calls f with the shape of a type */
template <class F> decltype(auto) WithShape(ElementType type, F &&f)
{
  switch (type) {
  case ElementType::Tetrahedron4:
    return f(Tetrahedron4());
  case ElementType::Tetrahedron10:
    return f(Tetrahedron10());
  case ElementType::Brick8:
    return f(Brick8());
  default:
    return f(Brick20());
  }
}

inline const char *ShapeName(ElementType type)
{
  switch (type) {
  case ElementType::Tetrahedron4:
    return "tetrahedron with 4 nodes";
  case ElementType::Tetrahedron10:
    return "tetrahedron with 10 nodes";
  case ElementType::Brick8:
    return "brick with 8 nodes";
  default:
    return "brick with 20 nodes";
  }
}

} // namespace fe
} // namespace hhtdae

#endif
