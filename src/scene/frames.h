/* Marker frames, their motion and the loads on them, for numbers of any kind; rotations; automatic differentiation. */
#ifndef HHTDAE_SCENE_FRAMES_H
#define HHTDAE_SCENE_FRAMES_H

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <unsupported/Eigen/AutoDiff>

namespace hhtdae
{

template <class T> using Vec3 = Eigen::Matrix<T, 3, 1>;
template <class T> using Mat3 = Eigen::Matrix<T, 3, 3>;
template <int R, int C> using Matrix = Eigen::Matrix<double, R, C>;

/* a number with its derivatives in N directions, and with mixed second ones: Dual2<N> x has x.derivatives()(a).derivatives()(b) */
template <int N> using Dual  = Eigen::AutoDiffScalar<Eigen::Matrix<double, N, 1>>;
template <int N> using Dual2 = Eigen::AutoDiffScalar<Eigen::Matrix<Dual<N>, N, 1>>;

/* Everything in space axes. A wrench acts on the body of the marker; its moment is about the marker's origin. */
template <class T> struct Frame {
  Vec3<T> x; /* position of the origin */
  Mat3<T> R; /* axes as columns */
};
template <class T> struct Twist {
  Vec3<T> v, w; /* velocity of the origin, angular velocity */
};
template <class T> struct Wrench {
  Vec3<T> f, m; /* force, moment */
};

/* a x b = Cross(a) b */
template <class T> Mat3<T> Cross(const Vec3<T> &a)
{
  Mat3<T> c;
  c << T(0), -a(2), a(1), a(2), T(0), -a(0), -a(1), a(0), T(0);
  return c;
}

/* The plain number inside a dual one */
inline double Plain(double x) { return x; }
template <class D> double Plain(const Eigen::AutoDiffScalar<D> &x) { return Plain(x.value()); }

/* f(t) to second order from f, f', f'' at the plain value of t: exact for Dual and Dual2 */
template <class T> T Taylor(double f, double f1, double f2, const T &t)
{
  const T d = t - T(Plain(t));
  return T(f) + d * T(f1) + d * d * T(0.5 * f2);
}
inline double Taylor(double f, double, double, double) { return f; }

/* Eigen's own atan2 of duals takes memory for their derivatives, in each call */
inline double Atan2(double y, double x) { return std::atan2(y, x); }
template <class D> Eigen::AutoDiffScalar<D> Atan2(const Eigen::AutoDiffScalar<D> &y, const Eigen::AutoDiffScalar<D> &x)
{
  const typename D::Scalar r2 = y.value() * y.value() + x.value() * x.value();
  return {Atan2(y.value(), x.value()), D((y.derivatives() * x.value() - y.value() * x.derivatives()) / r2)};
}

/*
  Frames of M markers as duals: directions 6k..6k+2 move marker k, 6k+3..6k+5 turn it about the space axes through its own origin,
  R -> (1 + [e]) R. In Dual2 the inner direction b perturbs first and the outer one a after it, R -> (1 + a[e_a])(1 + b[e_b]) R,
  so that second derivatives are the derivatives along b of the gradient along a, as J^T lambda needs them.
*/
template <int N> Frame<Dual<N>> Seed(const Frame<double> &f, int offset)
{
  Frame<Dual<N>> s;
  for (int i = 0; i < 3; i++) s.x(i) = Dual<N>(f.x(i), N, offset + i);
  for (int c = 0; c < 3; c++) {
    const Mat3<double> turn = -Cross<double>(f.R.col(c)); /* column k: e_k x R_c */
    for (int i = 0; i < 3; i++) {
      s.R(i, c) = Dual<N>(f.R(i, c));
      for (int k = 0; k < 3; k++) s.R(i, c).derivatives()(offset + 3 + k) = turn(i, k);
    }
  }
  return s;
}

template <int N> Frame<Dual2<N>> Seed2(const Frame<double> &f, int offset)
{
  const Frame<Dual<N>> inner = Seed<N>(f, offset);
  Frame<Dual2<N>>      s;
  for (int i = 0; i < 3; i++) {
    s.x(i)                         = Dual2<N>(inner.x(i));
    s.x(i).derivatives()(offset + i) = Dual<N>(1);
  }
  for (int c = 0; c < 3; c++)
    for (int i = 0; i < 3; i++) {
      s.R(i, c)           = Dual2<N>(inner.R(i, c));
      const int j = (i + 1) % 3, k = (i + 2) % 3; /* (e_j x y)_i = y_k, (e_k x y)_i = -y_j */
      s.R(i, c).derivatives()(offset + 3 + j) = inner.R(k, c);
      s.R(i, c).derivatives()(offset + 3 + k) = -inner.R(j, c);
    }
  return s;
}

/* Twists whose directions are offset..offset+5 */
template <int N> Twist<Dual<N>> Seed(const Twist<double> &w, int offset)
{
  Twist<Dual<N>> s;
  for (int i = 0; i < 3; i++) {
    s.v(i) = Dual<N>(w.v(i), N, offset + i);
    s.w(i) = Dual<N>(w.w(i), N, offset + 3 + i);
  }
  return s;
}

/* Constants as duals */
template <class T> Frame<T> Constant(const Frame<double> &f) { return {f.x.template cast<T>(), f.R.template cast<T>()}; }
template <class T> Twist<T> Constant(const Twist<double> &w) { return {w.v.template cast<T>(), w.w.template cast<T>()}; }

} // namespace hhtdae

#endif
