/*
  Primitive constraints on the axes of two markers, i = frame 0 and j = frame 1: rows that are sums of products c (a . b) of an
  axis a of i with an axis b of j, each of which is the sine of an angle that the constraint keeps zero. With the differential of a product

    d(a . b) = (theta_i - theta_j) . (a x b)

  and W = sum over the products of lambda c a b^T, gradient and curvature of all such constraints are

    J^T lambda = (g, -g),  g = sum of lambda c (a x b)
    dg/dtheta_i = W - tr(W) 1,   dg/dtheta_j = -(W^T - tr(W) 1)

  Signs as in primitives.h: multipliers are moments on i's body in the direction named below; the opposite moments act on j's
  body. Antiparallel axes satisfy an alignment as well as parallel ones, but the gradients of the products have the opposite
  sign. A joint stays on the branch on which it starts, and its data have the sign of each row on that branch
  (JointMultipliers.AxesThatPointAwayFromEachOther).
*/
#ifndef HHTDAE_SCENE_PRIMITIVES_AXES_H
#define HHTDAE_SCENE_PRIMITIVES_AXES_H

#include "scene/kernel.h"
#include <algorithm>

namespace hhtdae
{

struct AxisProduct {
  int    row, i, j; /* number of the row; the axis of marker i and the axis of marker j */
  double factor;
};

/* Signs of the rows on the branch on which the joint starts */
template <int R> struct AxisBranch {
  double sign[R];
  AxisBranch() { std::fill(sign, sign + R, 1.); }
};

/* Base of kernels K that define `products`, an array of AxisProduct */
template <class K, int R> struct AxisProducts : Constraint<K, 2, R> {
  using Base = Constraint<K, 2, R>;
  using typename Base::Gradient;
  using typename Base::Hessian;
  using Data = AxisBranch<R>;
  static constexpr unsigned depends = Rotation(0) | Rotation(1);

  template <class T> static void value(const Data &d, const Frame<T> *f, const T &, T *phi)
  {
    for (int r = 0; r < R; r++) phi[r] = T(0);
    for (const AxisProduct &p : K::products) phi[p.row] += T(d.sign[p.row] * p.factor) * f[0].R.col(p.i).dot(f[1].R.col(p.j));
  }
  static void gradient(const Data &d, const Frame<double> *f, double, Gradient &J)
  {
    J.setZero();
    for (const AxisProduct &p : K::products) {
      const Vec3<double> g = d.sign[p.row] * p.factor * Vec3<double>(f[0].R.col(p.i)).cross(Vec3<double>(f[1].R.col(p.j)));
      J.template block<1, 3>(p.row, 3) += g.transpose();
      J.template block<1, 3>(p.row, 9) -= g.transpose();
    }
  }
  static void curvature(const Data &d, const Frame<double> *f, double, const double *lambda, Hessian &H)
  {
    Mat3<double> W = Mat3<double>::Zero();
    for (const AxisProduct &p : K::products)
      W += lambda[p.row] * d.sign[p.row] * p.factor * f[0].R.col(p.i) * f[1].R.col(p.j).transpose();
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
  z_i parallel to z_j: z_i . y_j = 0, -z_i . x_j = 0. Multipliers: moment on i's body about j's x and y axes. The rows use x and y
  of j instead of i, so that those of a shaft in a bearing on the ground do not change as it rotates.
*/
struct Parallel : AxisProducts<Parallel, 2> {
  static constexpr const char *name       = "parallel axes";
  static constexpr AxisProduct products[] = {{0, 2, 1, 1}, {1, 2, 0, -1}};

  static Data branch(const Frame<double> &i, const Frame<double> &j)
  {
    Data d;
    if (i.R.col(2).dot(j.R.col(2)) < 0) d.sign[0] = d.sign[1] = -1;
    return d;
  }
};

/* All axes parallel: z_i . y_j, x_i . z_j, y_i . x_j = 0. Multipliers: moment on i's body about j's axes. */
struct Orient : AxisProducts<Orient, 3> {
  static constexpr const char *name       = "orientation";
  static constexpr AxisProduct products[] = {{0, 2, 1, 1}, {1, 0, 2, 1}, {2, 1, 0, 1}};

  /* The nearest branch: z_i, x_i and y_i are parallel to those of j, or two of them are antiparallel after half a turn.
     *least_cosine: cosine of the angle of the rotation that is missing to this branch, 1 if none is. The products are
     also zero after a third of a turn about (1, 1, 1), where this cosine is -1/2 for all branches. */
  static Data branch(const Frame<double> &i, const Frame<double> &j, double *least_cosine)
  {
    constexpr double half[4][3] = {{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}}; /* signs of the rows for each branch */
    const double     same[3]    = {i.R.col(2).dot(j.R.col(2)), i.R.col(0).dot(j.R.col(0)), i.R.col(1).dot(j.R.col(1))};
    double           most       = -1;
    Data             d;
    for (const double *sign : half) {
      const double trace = sign[0] * same[0] + sign[1] * same[1] + sign[2] * same[2];
      if (trace <= most) continue;
      most = trace;
      std::copy(sign, sign + 3, d.sign);
    }
    *least_cosine = (most - 1) / 2;
    return d;
  }
};

/* No rotation of i relative to j about z, for planar scenes: y_i . x_j = 0. Multiplier: moment on i's body about z. */
struct OrientInPlane : AxisProducts<OrientInPlane, 1> {
  static constexpr const char *name       = "orientation in the plane";
  static constexpr AxisProduct products[] = {{0, 1, 0, 1}};

  static Data branch(const Frame<double> &i, const Frame<double> &j)
  {
    Data d;
    if (i.R.col(1).dot(j.R.col(1)) < 0) d.sign[0] = -1;
    return d;
  }
};

} // namespace hhtdae

#endif
