/*
  The origin of i stays on a curve fixed in j. The curve's parameter is not an unknown; it is that of the closest point,
  found by a search from its value at the last accepted step. The rows are the distances n_r . (c - p), p = (axes of j)^T (x_i - x_j),
  along the two normals of the curve, or in a planar scene along z x tangent only. Multipliers: force on i's body along these
  normals.
*/
#ifndef HHTDAE_SCENE_CURVE_H
#define HHTDAE_SCENE_CURVE_H

#include "curve_spline.h"
#include "primitives.h"
#include <cmath>
#include <limits>
#include <memory>

namespace hhtdae
{

template <int R> struct OnCurve : Constraint<OnCurve<R>, 2, R> {
  using Base                           = Constraint<OnCurve<R>, 2, R>;
  static constexpr const char *name    = R == 2 ? "point on curve" : "point on curve in the plane";
  static constexpr unsigned    depends = Position(0) | Position(1) | Rotation(1);
  static constexpr int         memory  = 1;
  struct Data {
    double                       memory[1] = {0}; /* parameter of the point of contact */
    std::shared_ptr<const Curve> curve;
  };

  template <class T> static void value(const Data &data, const Frame<T> *f, const T &, T *phi)
  {
    data.curve->normalDistances(Local<T>(f), data.memory[0], R, phi);
  }

  /* By the chain rule, with automatic differentiation by p only; dp = (axes of j)^T (dx_i - dx_j + [d] theta_j), d = x_i - x_j */
  static void gradient(const Data &data, const Frame<double> *f, double, typename Base::Gradient &J)
  {
    const Vec3<double> local = Local<double>(f);
    Dual<3>            phi[R];
    Vec3<Dual<3>>      p;
    for (int i = 0; i < 3; i++) p(i) = Dual<3>(local(i), i);
    data.curve->normalDistances(p, data.memory[0], R, phi);
    Matrix<R, 3> G;
    for (int r = 0; r < R; r++) G.row(r) = DerivativeRow(phi[r]);
    J = G * Motion(f);
  }
  static void curvature(const Data &data, const Frame<double> *f, double, const double *lambda,
                        typename Base::Hessian &H)
  {
    const Vec3<double> local = Local<double>(f);
    Dual2<3>           phi[R];
    Vec3<Dual2<3>>     p;
    Vec3<double>       g = Vec3<double>::Zero();
    Mat3<double>       K = Mat3<double>::Zero();
    for (int i = 0; i < 3; i++) p(i) = Dual2<3>(Dual<3>(local(i), i), i);
    data.curve->normalDistances(p, data.memory[0], R, phi);
    for (int r = 0; r < R; r++)
      for (int a = 0; a < 3; a++) {
        g(a) += lambda[r] * phi[r].derivatives()(a).value();
        K.row(a) += lambda[r] * DerivativeRow(phi[r].derivatives()(a));
      }
    const Matrix<3, 12> A = Motion(f);
    AlongAxesCurvature(f[0].x - f[1].x, -f[1].R * g, H);
    H += A.transpose() * K * A;
  }

  static void accept(Data &data, const Frame<double> *f)
  {
    const Curve &curve = *data.curve;
    data.memory[0]     = curve.path().wrapped(curve.closest(Local<double>(f), data.memory[0]));
  }

  /* A step passes over no piece of the curve: its ends alone would not show a bump between them (Curve.ABumpOnAStraightTrack) */
  static double longestStep(const Data &data, const Frame<double> *f, const Twist<double> *w, double acceleration, double)
  {
    const double way = data.curve->path().shortestPiece(data.memory[0]), speed = (w[0].v - w[1].v - w[1].w.cross(f[0].x - f[1].x)).norm();
    const double fast = speed + std::sqrt(speed * speed + 2 * acceleration * way);
    return fast > 0 ? 2 * way / fast : std::numeric_limits<double>::infinity();
  }

private:
  template <class T> static Vec3<T> Local(const Frame<T> *f)
  {
    const Vec3<T> d = f[0].x - f[1].x;
    return f[1].R.transpose() * d;
  }
  static Matrix<3, 12> Motion(const Frame<double> *f)
  {
    Matrix<3, 12> A    = Matrix<3, 12>::Zero();
    A.leftCols<3>()    = f[1].R.transpose();
    A.middleCols<3>(6) = -f[1].R.transpose();
    A.rightCols<3>()   = f[1].R.transpose() * Cross<double>(f[0].x - f[1].x);
    return A;
  }
};

} // namespace hhtdae

#endif
