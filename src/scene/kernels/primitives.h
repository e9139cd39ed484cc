/*
  Primitive constraints on the origins of two markers, i = frame 0 and j = frame 1. Gradient and curvature are written
  out for speed. The reaction on the bodies is -J^T lambda; the sign of each row is chosen so that
  its multiplier is the force on i's body in the direction named below. The opposite force acts on j's body at the
  same point.

  d = x_i - x_j; a rotation theta_j of j changes an axis a of j by theta_j x a.
*/
#ifndef HHTDAE_SCENE_PRIMITIVES_H
#define HHTDAE_SCENE_PRIMITIVES_H

#include "scene/kernel.h"

namespace hhtdae
{

/* The first R space components of x_j - x_i. Multipliers: force on i's body at its marker, in space axes. */
template <int R> struct CoincideRows : Constraint<CoincideRows<R>, 2, R> {
  using Base                                  = Constraint<CoincideRows<R>, 2, R>;
  static constexpr const char *name           = R == 3 ? "coincidence" : "coincidence in the plane";
  static constexpr unsigned    depends        = Position(0) | Position(1);
  static constexpr bool        needs_rotation = false, purely_translational = true;
  static constexpr bool        curved(int, int) { return false; }

  template <class T> static void value(const Empty &, const Frame<T> *f, const T &, T *phi)
  {
    for (int r = 0; r < R; r++) phi[r] = f[1].x(r) - f[0].x(r);
  }
  static void gradient(const Empty &, const Frame<double> *, double, typename Base::Gradient &J)
  {
    J.setZero();
    for (int r = 0; r < R; r++) {
      J(r, r)     = -1;
      J(r, 6 + r) = 1;
    }
  }
  static void curvature(const Empty &, const Frame<double> *, double, const double *, typename Base::Hessian &H)
  {
    H.setZero();
  }
};
using Coincide  = CoincideRows<3>;
using Coincide2 = CoincideRows<2>; /* planar scenes */

/*
  Gradient and curvature of rows -d . a_r with axes a_r fixed in j. With u = sum of lambda_r a_r, J^T lambda = (-u, 0, u, d x u).
*/
inline void AlongAxesGradient(const Vec3<double> &d, const Vec3<double> &a,
                              Eigen::Ref<Matrix<1, 12>, 0, Eigen::InnerStride<>> J)
{
  J.segment<3>(0) = -a.transpose();
  J.segment<3>(3).setZero();
  J.segment<3>(6) = a.transpose();
  J.segment<3>(9) = d.cross(a).transpose();
}

inline void AlongAxesCurvature(const Vec3<double> &d, const Vec3<double> &u, Matrix<12, 12> &H)
{
  const Mat3<double> U = Cross<double>(u);
  H.setZero();
  H.block<3, 3>(0, 9) = U;
  H.block<3, 3>(6, 9) = -U;
  H.block<3, 3>(9, 0) = -U;
  H.block<3, 3>(9, 6) = U;
  H.block<3, 3>(9, 9) = u.dot(d) * Mat3<double>::Identity() - u * d.transpose(); /* -[d][u] */
}

constexpr bool AlongAxesCurved(int a, int b) { return (a == 3 && b != 1) || (b == 3 && a != 1); }

/* i's origin in the plane normal to axis A of j, at the distance `offset` from j's origin along that axis. Multiplier: force on i's body
   along that axis. */
template <int A> struct OnPlane : Constraint<OnPlane<A>, 2, 1> {
  using Base                           = Constraint<OnPlane<A>, 2, 1>;
  static constexpr const char *name    = "point on plane";
  static constexpr unsigned    depends = Position(0) | Position(1) | Rotation(1);
  static constexpr bool        curved(int a, int b) { return AlongAxesCurved(a, b); }
  struct Data {
    double offset = 0;
  };

  template <class T> static void value(const Data &data, const Frame<T> *f, const T &, T *phi)
  {
    const Vec3<T> d = f[0].x - f[1].x;
    phi[0]          = T(data.offset) - d.dot(f[1].R.col(A));
  }
  static void gradient(const Data &, const Frame<double> *f, double, typename Base::Gradient &J)
  {
    AlongAxesGradient(f[0].x - f[1].x, f[1].R.col(A), J);
  }
  static void curvature(const Data &, const Frame<double> *f, double, const double *lambda, typename Base::Hessian &H)
  {
    AlongAxesCurvature(f[0].x - f[1].x, lambda[0] * f[1].R.col(A), H);
  }
};

/* i's origin on the z axis of j. Multipliers: force on i's body along j's x and y axes. */
struct OnLine : Constraint<OnLine, 2, 2> {
  static constexpr const char *name    = "point on line";
  static constexpr unsigned    depends = Position(0) | Position(1) | Rotation(1);
  static constexpr bool        curved(int a, int b) { return AlongAxesCurved(a, b); }

  template <class T> static void value(const Empty &, const Frame<T> *f, const T &, T *phi)
  {
    const Vec3<T> d = f[1].x - f[0].x;
    for (int r = 0; r < 2; r++) phi[r] = d.dot(f[1].R.col(r));
  }
  static void gradient(const Empty &, const Frame<double> *f, double, Gradient &J)
  {
    const Vec3<double> d = f[0].x - f[1].x;
    for (int r = 0; r < 2; r++) AlongAxesGradient(d, f[1].R.col(r), J.row(r));
  }
  static void curvature(const Empty &, const Frame<double> *f, double, const double *lambda, Hessian &H)
  {
    AlongAxesCurvature(f[0].x - f[1].x, lambda[0] * f[1].R.col(0) + lambda[1] * f[1].R.col(1), H);
  }
};

/*
  |d| = L, written as (|d|^2 - L^2) / (2 L) = 0: a polynomial, which is smooth even where the points coincide. Multiplier: tension of the massless
  link, positive if it pulls i towards j (force on i's body -lambda d / L).
*/
struct Distance : Constraint<Distance, 2, 1> {
  static constexpr const char *name           = "distance";
  static constexpr unsigned    depends        = Position(0) | Position(1);
  static constexpr bool        needs_rotation = false;
  struct Data {
    double length = 1; /* positive */
    bool   at_start = false; /* whether it is the distance at the start */
    double moved = 0; /* by which continueFrom() has moved `length` from the value of the description */
  };

  template <class T> static void value(const Data &data, const Frame<T> *f, const T &, T *phi)
  {
    const Vec3<T> d = f[0].x - f[1].x;
    phi[0]          = (d.squaredNorm() - T(data.length * data.length)) * T(.5 / data.length);
  }
  static void gradient(const Data &data, const Frame<double> *f, double, Gradient &J)
  {
    const Vec3<double> u = (f[0].x - f[1].x) / data.length;
    J.setZero();
    J.segment<3>(0) = u.transpose();
    J.segment<3>(6) = -u.transpose();
  }
  static void curvature(const Data &data, const Frame<double> *, double, const double *lambda, Hessian &H)
  {
    const Mat3<double> k = lambda[0] / data.length * Mat3<double>::Identity();
    H.setZero();
    H.block<3, 3>(0, 0) = H.block<3, 3>(6, 6) = k;
    H.block<3, 3>(0, 6) = H.block<3, 3>(6, 0) = -k;
  }
  /* The start of a link that comes in a run which goes on from another one is there */
  static void continueFrom(Data &d, const Data *before, const Frame<double> *f)
  {
    if (!d.at_start) return;
    d.moved = before && before->at_start ? before->moved : (f[0].x - f[1].x).norm() - d.length;
    d.length += d.moved;
  }
};

} // namespace hhtdae

#endif
