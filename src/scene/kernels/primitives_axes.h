/*
  Primitive constraints on the axes of two markers, i = frame 0 and j = frame 1: rows that are sums of products of an
  axis of i with an axis of j, c (a . b) = the sine of an angle where they are met. With the product's turn by theta

    d(a . b) = (theta_i - theta_j) . (a x b)

  and W = sum over the products of lambda c a b^T, gradient and curvature of all such constraints are the same few
  lines:

    J^T lambda = (g, -g),  g = sum of lambda c (a x b)
    dg/dtheta_i = W - tr(W) 1,   dg/dtheta_j = -(W^T - tr(W) 1)

  Signs as in primitives.h: multipliers are moments on i's body in the direction that is named, its opposite acts on j's
  body. An alignment is met by antiparallel axes too; a joint stays on the branch on which it starts.
*/
#ifndef HHTDAE_SCENE_PRIMITIVES_AXES_H
#define HHTDAE_SCENE_PRIMITIVES_AXES_H

#include "scene/kernel.h"

namespace hhtdae
{

struct AxisProduct {
  int    row, i, j; /* axis i of marker i with axis j of marker j */
  double factor;
};

/* K gives `products`, an array of AxisProduct */
template <class K, int R> struct AxisProducts : Constraint<K, 2, R> {
  using Base = Constraint<K, 2, R>;
  using typename Base::Gradient;
  using typename Base::Hessian;
  static constexpr unsigned depends = Rotation(0) | Rotation(1);

  template <class T> static void value(const Empty &, const Frame<T> *f, const T &, T *phi)
  {
    for (int r = 0; r < R; r++) phi[r] = T(0);
    for (const AxisProduct &p : K::products) phi[p.row] += T(p.factor) * f[0].R.col(p.i).dot(f[1].R.col(p.j));
  }
  static void gradient(const Empty &, const Frame<double> *f, double, Gradient &J)
  {
    J.setZero();
    for (const AxisProduct &p : K::products) {
      const Vec3<double> g = p.factor * Vec3<double>(f[0].R.col(p.i)).cross(Vec3<double>(f[1].R.col(p.j)));
      J.template block<1, 3>(p.row, 3) += g.transpose();
      J.template block<1, 3>(p.row, 9) -= g.transpose();
    }
  }
  static void curvature(const Empty &, const Frame<double> *f, double, const double *lambda, Hessian &H)
  {
    Mat3<double> W = Mat3<double>::Zero();
    for (const AxisProduct &p : K::products)
      W += lambda[p.row] * p.factor * f[0].R.col(p.i) * f[1].R.col(p.j).transpose();
    W.diagonal().array() -= W.trace();
    H.setZero();
    H.template block<3, 3>(3, 3) = W;
    H.template block<3, 3>(3, 9) = -W.transpose();
    H.template block<3, 3>(9, 3) = -W;
    H.template block<3, 3>(9, 9) = W.transpose();
  }
};

/* Axis A of i perpendicular to axis B of j. Multiplier: moment on i's body about (axis B of j) x (axis A of i). */
template <int A, int B> struct AxesPerpendicular : AxisProducts<AxesPerpendicular<A, B>, 1> {
  static constexpr const char *name       = "perpendicular axes";
  static constexpr AxisProduct products[] = {{0, A, B, 1}};
};

/*
  z_i parallel to z_j: z_i . y_j = 0, -z_i . x_j = 0. Multipliers: moment on i's body about j's x and y axes. With the
  axes of j rather than i the rows of a shaft on the ground do not change as it turns.
*/
struct Parallel : AxisProducts<Parallel, 2> {
  static constexpr const char *name       = "parallel axes";
  static constexpr AxisProduct products[] = {{0, 2, 1, 1}, {1, 2, 0, -1}};
};

/* All axes parallel: z_i . y_j, x_i . z_j, y_i . x_j = 0. Multipliers: moment on i's body about j's axes. */
struct Orient : AxisProducts<Orient, 3> {
  static constexpr const char *name       = "orientation";
  static constexpr AxisProduct products[] = {{0, 2, 1, 1}, {1, 0, 2, 1}, {2, 1, 0, 1}};
};

/* No turn of i relative to j about z, for planar scenes: y_i . x_j = 0. Multiplier: moment on i's body about z. */
struct OrientInPlane : AxisProducts<OrientInPlane, 1> {
  static constexpr const char *name       = "orientation in the plane";
  static constexpr AxisProduct products[] = {{0, 1, 0, 1}};
};

} // namespace hhtdae

#endif
