/* Marker frames, their motion and the loads on them, with doubles or dual numbers as entries. */
#ifndef HHTDAE_SCENE_FRAMES_H
#define HHTDAE_SCENE_FRAMES_H

#include "dual_vector.h"
#include "small_matrix.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace hhtdae
{

/* Vectors and matrices of doubles are Eigen's, those of dual numbers DualVector and DualMatrix (dual_vector.h). */
template <class T> struct Vectors {
  using Vector = DualVector<T>;
  using Matrix = DualMatrix<T>;
};
template <> struct Vectors<double> {
  using Vector = Eigen::Matrix<double, 3, 1>;
  using Matrix = Eigen::Matrix<double, 3, 3>;
};
template <class T> using Vec3 = typename Vectors<T>::Vector;
template <class T> using Mat3 = typename Vectors<T>::Matrix;
template <int R, int C> using Matrix = Eigen::Matrix<double, R, C>;

/* Dual numbers with mixed second derivatives, x.derivatives()(a).derivatives()(b) */
template <int N> using Dual2 = Dual<N, Dual<N>>;

/* The derivatives of a dual number as a row: in all N directions, or in n directions from `first` on */
template <int N> Eigen::Map<const Matrix<1, N>> DerivativeRow(const Dual<N> &x) { return Eigen::Map<const Matrix<1, N>>(x.derivatives().data()); }
template <int n, int N> Eigen::Map<const Matrix<1, n>> DerivativeRow(const Dual<N> &x, int first)
{
  return Eigen::Map<const Matrix<1, n>>(x.derivatives().data() + first);
}

/* All components are in space axes. A wrench acts on the body of the marker; its moment is about the marker's origin. */
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

/* The matrix [a] with a x b = [a] b */
template <class T> Mat3<T> Cross(const Vec3<T> &a)
{
  Mat3<T> c;
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    c(i, i) = T(0);
    c(k, j) = a(i);
    c(j, k) = -a(i);
  }
  return c;
}

/* f(t) for a dual number t, from f, f' and f'' at the plain value of t; exact for Dual and Dual2, which have no third derivatives */
template <class T> T Taylor(double f, double f1, double f2, const T &t)
{
  const T d = t - T(Plain(t));
  return T(f) + d * T(f1) + d * d * T(0.5 * f2);
}
inline double Taylor(double f, double, double, double) { return f; }

/*
  A marker frame as dual numbers. With offset = 6k for marker k, directions 6k..6k+2 translate the marker and 6k+3..6k+5
  rotate it about the space axes through its own origin, R -> (1 + [e]) R. In Dual2 the perturbation in the inner direction b
  is applied first and the one in the outer direction a after it, R -> (1 + a[e_a])(1 + b[e_b]) R. Second derivatives are then
  derivatives in direction b of the gradient in direction a, as d(J^T lambda)/dq requires.
*/
template <int N> Frame<Dual<N>> Seed(const Frame<double> &f, int offset)
{
  Frame<Dual<N>> s;
  for (int i = 0; i < 3; i++) s.x(i) = Dual<N>(f.x(i), offset + i);
  for (int c = 0; c < 3; c++) {
    const Mat3<double> turn = -Cross<double>(f.R.col(c)); /* column k is e_k x R_c */
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

/* A twist as dual numbers with the directions offset..offset+5 */
template <int N> Twist<Dual<N>> Seed(const Twist<double> &w, int offset)
{
  Twist<Dual<N>> s;
  for (int i = 0; i < 3; i++) {
    s.v(i) = Dual<N>(w.v(i), offset + i);
    s.w(i) = Dual<N>(w.w(i), offset + 3 + i);
  }
  return s;
}

/* Constants as dual numbers, with zero derivatives */
template <class T> Vec3<T> Constant(const Vec3<double> &x) { return {T(x(0)), T(x(1)), T(x(2))}; }
template <class T> Mat3<T> Constant(const Mat3<double> &A)
{
  Mat3<T> B;
  for (int c = 0; c < 3; c++)
    for (int i = 0; i < 3; i++) B(i, c) = T(A(i, c));
  return B;
}
template <class T> Frame<T> Constant(const Frame<double> &f) { return {Constant<T>(f.x), Constant<T>(f.R)}; }
template <class T> Twist<T> Constant(const Twist<double> &w) { return {Constant<T>(w.v), Constant<T>(w.w)}; }

} // namespace hhtdae

#endif
